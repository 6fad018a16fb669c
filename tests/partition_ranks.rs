//! Are the parts of a mesh consistent on any number of ranks?
//!
//! This program has no test harness. Started by cargo, it starts itself with `mpirun`, once for
//! each number of ranks. Started there, it distributes meshes that every rank also holds
//! completely, and compares.

mod common;
#[path = "partition_ranks/contact.rs"]
mod contact;
#[path = "partition_ranks/exchange.rs"]
mod exchange;

use std::process::ExitCode;
use std::time::Duration;

use common::Running;
use contact_petsc::case::Partitioner;
use contact_petsc::collective::Collective;
use contact_petsc::mesh::{BoxShape, ElementKind, ElementPatch, Facet, Mesh, element_patches, merge};
use contact_petsc::partition::{LocalMesh, Ordering, Pair, Plan, Report, Weights, distribute};
use contact_petsc::petsc::Session;
use contact_petsc::space::{facet_normal, facet_tangents, reference};
use contact_petsc::tensor::Vector;
use mpi::collective::SystemOperation;
use mpi::topology::SimpleCommunicator;
use mpi::traits::Communicator;

/// Seven ranks on the mesh of four elements, so that some ranks own nothing.
const RANKS: [usize; 5] = [1, 2, 3, 4, 7];
const LIMIT: Duration = Duration::from_secs(300);
const INSIDE: &str = "PARTITION_RANKS_INSIDE";

fn main() -> ExitCode {
    if std::env::var_os(INSIDE).is_some() {
        return on_ranks();
    }
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let filters: Vec<&String> = arguments.iter().filter(|argument| !argument.starts_with('-')).collect();
    let name = |ranks: usize| format!("pieces_fit_together_on_{ranks}_ranks");
    let wanted =
        |ranks: &usize| filters.is_empty() || filters.iter().any(|part| name(*ranks).contains(part.as_str()));
    let mut failed = false;
    for ranks in RANKS.into_iter().filter(wanted) {
        if arguments.iter().any(|argument| argument == "--list") {
            println!("{}: test", name(ranks));
            continue;
        }
        let run = Running::of_this_test(ranks, &[(INSIDE, "1".as_ref())]).wait(LIMIT);
        let good = run.code == Some(0) && run.stdout.contains("all pieces fit");
        println!("test {} ... {}", name(ranks), if good { "ok" } else { "FAILED" });
        if !good {
            println!("{:?} after {:?}\n{}", run.code, run.took, run.text());
            failed = true;
        }
    }
    ExitCode::from(u8::from(failed))
}

fn on_ranks() -> ExitCode {
    let session = match Session::start(&[]) {
        Ok(session) => session,
        Err(error) => {
            println!("{error}");
            return ExitCode::FAILURE;
        }
    };
    check_all(session.world());
    if session.rank() == 0 {
        println!("all pieces fit");
    }
    ExitCode::SUCCESS
}

fn check_all(world: &SimpleCommunicator) {
    use ElementKind::*;
    for kind in [Tri3, Tri6, Quad4, Quad8, Quad9] {
        check(world, &rectangles(kind, [9, 8]), &Plan::default());
    }
    for kind in [Tet4, Tet10, Hex8, Hex20, Hex27] {
        check(world, &cube(kind), &Plan::default());
    }
    let together = Plan { partitioner: Partitioner::Ptscotch, ..Plan::default() };
    check(world, &rectangles(Quad4, [9, 8]), &together);
    check(world, &rectangles(Quad4, [2, 1]), &together);
    check(world, &cube(Tet10), &together);
    check(world, &mixed(), &together);
    let order = Plan { ordering: Ordering::ReverseCuthillMckee, ..Plan::default() };
    check(world, &rectangles(Quad4, [9, 8]), &order);
    check(world, &rectangles(Quad4, [2, 1]), &Plan::default());
    check(world, &mixed(), &Plan::default());
    check(world, &patched(rectangles(Tri3, [9, 8])), &Plan::default());
    check(world, &patched(cube(Tet4)), &Plan::default());
    check(world, &patched(mixed()), &Plan::default());
    for partitioner in [Partitioner::Metis, Partitioner::Ptscotch] {
        parts_are_even(world, partitioner);
        ties_hold(world, partitioner);
    }
    errors_are_shared(world);
    exchange::check_all(world);
    contact::check_all(world);
}

fn rectangle(kind: ElementKind, y: [f64; 2], cells: [u32; 2]) -> Mesh<2> {
    BoxShape { min: [0.0, y[0]], max: [1.0, y[1]], cells, element: kind }.mesh().expect("a box")
}

/// Two bodies, one above the other, with a gap between them.
fn rectangles(kind: ElementKind, cells: [u32; 2]) -> Mesh<2> {
    let lower = ("stratum".to_owned(), rectangle(kind, [-0.5, 0.0], cells));
    let upper = ("block".to_owned(), rectangle(kind, [0.1, 0.6], cells));
    merge(vec![lower, upper]).expect("small")
}

fn cube(kind: ElementKind) -> Mesh<3> {
    let shape = BoxShape { min: [0.0; 3], max: [1.0, 2.0, 1.5], cells: [3, 4, 3], element: kind };
    merge(vec![("cube".to_owned(), shape.mesh().expect("a box"))]).expect("small")
}

/// The mesh with patches of elements in each body.
fn patched<const D: usize>(mut mesh: Mesh<D>) -> Mesh<D> {
    let labels: Vec<_> = mesh.body.iter().map(|&body| Some((body, 0))).collect();
    mesh.patches = element_patches(&mesh, &labels);
    mesh
}

/// Quadrilaterals and triangles in one mesh, with a set of points and one of facets in a corner.
fn mixed() -> Mesh<2> {
    let mut mesh = Mesh::with_points((0..20).map(|n| [f64::from(n % 5), f64::from(n / 5)]).collect());
    for y in 0..3 {
        for x in 0..4 {
            let n = y * 5 + x;
            if (x + y) % 2 == 0 {
                mesh.push(ElementKind::Quad4, [n, n + 1, n + 6, n + 5]);
            } else {
                mesh.push(ElementKind::Tri3, [n, n + 1, n + 6]);
                mesh.push(ElementKind::Tri3, [n, n + 6, n + 5]);
            }
        }
    }
    mesh.point_sets.insert("spot".into(), vec![7, 19]);
    mesh.facet_sets.insert("start".into(), vec![Facet { element: 0, side: 0 }]);
    mesh.element_sets.insert("some".into(), vec![3, 4, 5]);
    mesh
}

fn deal<const D: usize>(world: &SimpleCommunicator, whole: &Mesh<D>, plan: &Plan) -> (LocalMesh<D>, Report) {
    let mesh = (world.rank() == 0).then(|| whole.clone());
    distribute(world, mesh, plan).expect("a good mesh is distributed")
}

/// Checks everything that must hold for the parts of a mesh.
fn check<const D: usize>(world: &SimpleCommunicator, whole: &Mesh<D>, plan: &Plan) {
    let (local, report) = deal(world, whole, plan);
    is_a_piece_of(&local, whole);
    rows_can_be_assembled(&local, whole);
    patches_are_whole(&local, whole);
    sets_are_complete(&local, whole);
    numbers_fit_together(world, &local, whole);
    areas_add_up(world, &local, whole);
    let (nodes, elements) = (whole.points.len() as u64, whole.element_count() as u64);
    assert_eq!((report.owned.iter().sum::<u64>(), report.elements.iter().sum::<u64>()), (nodes, elements));
    assert_eq!(report.ghosts[world.rank() as usize], local.index.ghosts.len() as u64);
    assert_eq!(deal(world, whole, plan), (local, report), "the same again");
}

/// Nodes, elements and bodies agree with the whole mesh.
fn is_a_piece_of<const D: usize>(local: &LocalMesh<D>, whole: &Mesh<D>) {
    let mesh = &local.mesh;
    assert_eq!(mesh.points.len(), local.index.local_count());
    assert_eq!(mesh.points.len(), local.input_node.len());
    assert_eq!([local.mine.len(), local.input_element.len(), mesh.body.len()], [mesh.element_count(); 3]);
    for (point, &input) in mesh.points.iter().zip(&local.input_node) {
        assert_eq!(*point, whole.points[input as usize]);
    }
    for (element, &input) in local.input_element.iter().enumerate() {
        let input = input as usize;
        let nodes: Vec<u32> =
            mesh.element_nodes(element).iter().map(|&n| local.input_node[n as usize]).collect();
        assert_eq!(nodes, whole.element_nodes(input));
        assert_eq!((mesh.kinds[element], mesh.body[element]), (whole.kinds[input], whole.body[input]));
    }
}

/// All elements at owned nodes are present, and come first. The other elements are owned by the
/// rank.
fn rows_can_be_assembled<const D: usize>(local: &LocalMesh<D>, whole: &Mesh<D>) {
    let owned: Vec<u32> = local.input_node[..local.index.owned].to_vec();
    let touches = |element: usize| whole.element_nodes(element).iter().any(|node| owned.contains(node));
    let expected: Vec<u32> = (0..whole.element_count()).filter(|&e| touches(e)).map(|e| e as u32).collect();
    assert_eq!(local.input_element[..local.assembled], expected);
    assert!(local.mine[local.assembled..].iter().all(|&mine| mine));
}

/// All patches of the local elements are present with all their elements and nodes.
fn patches_are_whole<const D: usize>(local: &LocalMesh<D>, whole: &Mesh<D>) {
    let mine = |patch: &&ElementPatch| patch.elements.iter().any(|e| local.input_element.contains(e));
    let expected: Vec<&ElementPatch> = whole.patches.iter().filter(mine).collect();
    assert_eq!(local.mesh.patches.len(), expected.len());
    for (patch, input) in local.mesh.patches.iter().zip(expected) {
        assert_eq!((patch.body, patch.material, &patch.kinds), (input.body, input.material, &input.kinds));
        assert!(patch.nodes.iter().map(|&n| local.input_node[n as usize]).eq(input.nodes.iter().copied()));
        for (&element, input) in patch.elements.iter().zip(&input.elements) {
            match local.input_element.iter().position(|known| known == input) {
                Some(place) => assert_eq!(element as usize, place),
                None => assert_eq!(element, ElementPatch::ELSEWHERE),
            }
        }
    }
}

/// Every set exists by name and holds all of its local members, including ghost nodes.
fn sets_are_complete<const D: usize>(local: &LocalMesh<D>, whole: &Mesh<D>) {
    assert!(local.mesh.facet_sets.keys().eq(whole.facet_sets.keys()));
    assert!(local.mesh.element_sets.keys().eq(whole.element_sets.keys()));
    for (name, facets) in &local.mesh.facet_sets {
        let input =
            |facet: &Facet| Facet { element: local.input_element[facet.element as usize], side: facet.side };
        let mut found: Vec<Facet> = facets.iter().map(input).collect();
        found.sort_unstable();
        let here = |facet: &&Facet| local.input_element.contains(&facet.element);
        assert!(found.iter().eq(whole.facet_sets[name].iter().filter(here)), "{name}");
    }
    for (name, elements) in &local.mesh.element_sets {
        let mut found: Vec<u32> = elements.iter().map(|&e| local.input_element[e as usize]).collect();
        found.sort_unstable();
        let here = |element: &&u32| local.input_element.contains(element);
        assert!(found.iter().eq(whole.element_sets[name].iter().filter(here)), "{name}");
    }
    for (name, _) in whole.sets() {
        let nodes = local.mesh.set_nodes(name).expect("every set is known on every rank");
        let mut found: Vec<u32> = nodes.iter().map(|&n| local.input_node[n as usize]).collect();
        found.sort_unstable();
        let all = whole.set_nodes(name).expect("a set of the whole mesh");
        assert!(found.iter().eq(all.iter().filter(|node| local.input_node.contains(node))), "{name}");
    }
}

/// Every node has one owner and one number, the numbering of the ranks is contiguous, and every
/// element belongs to one rank.
fn numbers_fit_together<const D: usize>(world: &SimpleCommunicator, local: &LocalMesh<D>, whole: &Mesh<D>) {
    let index = &local.index;
    assert_eq!(index.total as usize, whole.points.len());
    let mut owners = vec![0; whole.points.len()];
    let mut number = vec![0; whole.points.len()];
    for node in 0..index.owned as u32 {
        owners[local.input_node[node as usize] as usize] += 1;
        number[local.input_node[node as usize] as usize] += index.global(node);
    }
    assert!(sum(world, &owners).iter().all(|&n| n == 1), "every node is owned once");
    let number = sum(world, &number);
    for node in 0..index.local_count() as u32 {
        assert_eq!(index.global(node), number[local.input_node[node as usize] as usize]);
    }
    assert!(index.ghosts.is_sorted_by(|a, b| a < b));
    let mut sorted = number;
    sorted.sort_unstable();
    assert!(sorted.into_iter().eq(0..index.total));
    let mut before = 0;
    let owned = index.owned as i32;
    world.reduce_up_to(&owned, &mut before, SystemOperation::sum());
    assert_eq!(index.first, before - owned);

    let mut own = vec![0; whole.element_count()];
    for (&mine, &input) in local.mine.iter().zip(&local.input_element) {
        own[input as usize] += i32::from(mine);
    }
    assert!(sum(world, &own).iter().all(|&n| n == 1), "every element is one rank's own");
}

/// The total area of the facets of owned elements equals that of the whole mesh.
fn areas_add_up<const D: usize>(world: &SimpleCommunicator, local: &LocalMesh<D>, whole: &Mesh<D>) {
    for (name, facets) in &local.mesh.facet_sets {
        let own: Vec<Facet> =
            facets.iter().filter(|facet| local.mine[facet.element as usize]).copied().collect();
        let mine = area(&local.mesh, &own);
        let mut total = 0.0;
        world.reduce_all(&mine, &mut total, SystemOperation::sum());
        assert!((total - area(whole, &whole.facet_sets[name])).abs() < 1e-13, "{name}");
    }
}

fn area<const D: usize>(mesh: &Mesh<D>, facets: &[Facet]) -> f64 {
    let (mut nodes, mut total) = (Vec::new(), 0.0);
    for &facet in facets {
        mesh.facet_nodes(facet, &mut nodes);
        let x: Vec<Vector<D>> = nodes.iter().map(|&node| Vector::from(mesh.points[node as usize])).collect();
        let element = reference(mesh.facet_kind(facet));
        let table = element.tabulate(element.mass_rule());
        for (dn, weight) in table.dn.chunks_exact(x.len() * (D - 1)).zip(&table.weights) {
            total += weight * facet_normal(&facet_tangents(&x, dn)).norm();
        }
    }
    total
}

/// A mesh with enough elements for its ranks is distributed evenly.
fn parts_are_even(world: &SimpleCommunicator, partitioner: Partitioner) {
    let plan = Plan { partitioner, ..Plan::default() };
    let (_, report) = deal(world, &rectangle(ElementKind::Quad4, [0.0, 1.0], [40, 40]), &plan);
    assert!(report.imbalance() < 1.03, "{report}");
    let most = report.elements.iter().max().copied().unwrap_or(0) as usize;
    assert!(most * report.elements.len() <= 1600 + 80, "{report}");
}

/// Coupled facing elements of two bodies stay together on two ranks. Without the coupling each body
/// would have its own rank.
fn ties_hold(world: &SimpleCommunicator, partitioner: Partitioner) {
    let whole = rectangles(ElementKind::Quad4, [12, 6]);
    let facing = |x: u32| Pair { elements: [60 + x, 72 + x], weight: 100 };
    let weights = Weights { elements: None, pairs: (0..12).map(facing).collect() };
    let plan = Plan { weights, partitioner, ..Plan::default() };
    let plain = Plan { partitioner, ..Plan::default() };
    check(world, &whole, &plan);
    if world.size() != 2 {
        return;
    }
    let parted = |plan: &Plan| {
        let (local, _) = deal(world, &whole, plan);
        let mut part = vec![0; whole.element_count()];
        for (&input, _) in local.input_element.iter().zip(&local.mine).filter(|(_, mine)| **mine) {
            part[input as usize] = world.rank();
        }
        let part = sum(world, &part);
        (60..72).filter(|&e| part[e] != part[e + 12]).count()
    };
    assert_eq!((parted(&plan), parted(&plain)), (0, 12), "{partitioner:?}");
}

/// An error that rank 0 finds becomes an error of every rank.
fn errors_are_shared(world: &SimpleCommunicator) {
    let mut lonely = rectangles(ElementKind::Quad4, [2, 2]);
    lonely.points.push([7.0, 8.0]);
    let mesh = (world.rank() == 0).then_some(lonely);
    let error = distribute(world, mesh, &Plan::default()).expect_err("a node without element");
    assert!(error.message.contains("node 18 at [7.0, 8.0] belongs to no element"), "{error}");
    let error = distribute::<3>(world, None, &Plan::default()).expect_err("no mesh at all");
    assert!(error.message.contains("no mesh"), "{error}");
}

fn sum(world: &SimpleCommunicator, values: &[i32]) -> Vec<i32> {
    let mut total = vec![0; values.len()];
    world.reduce_all(values, &mut total[..], SystemOperation::sum());
    total
}
