//! Does every rank have the target facets that its contactor facets may touch, and does METIS keep
//! them together?

use contact_petsc::assembly::targets::{ForeignNodes, Reach, Surfaces, TargetGather};
use contact_petsc::mesh::{Bounds, BoxShape, ElementKind, Facet, Mesh, merge};
use contact_petsc::partition::exchange::NodeExchange;
use contact_petsc::partition::{Couple, LocalMesh, Plan, Quality};
use mpi::topology::SimpleCommunicator;
use mpi::traits::Communicator;

use super::{deal, sum};

const COUPLE: Couple<'static> =
    Couple { contactor: "upper.bottom", target: "lower.top", travel: 0.0, load: true };

pub fn check_all(world: &SimpleCommunicator) {
    use ElementKind::*;
    let plain = Plan::default();
    for kind in [Tri6, Quad4, Quad8] {
        targets_are_found(world, &stacked([9, 2], [7, 2], kind), &plain);
    }
    for kind in [Tet10, Hex8, Hex20, Hex27] {
        targets_are_found(world, &stacked([3, 4, 1], [4, 3, 1], kind), &plain);
    }
    // Fewer elements than some runs have ranks.
    targets_are_found(world, &stacked([2, 1], [1, 1], Quad4), &plain);
    let whole = stacked([9, 4], [12, 4], Quad4);
    targets_are_found(world, &whole, &Plan::for_contact(Some(&whole), &[COUPLE]).expect("both sets"));
    pairs_stay_together(world, &stacked([30, 15], [36, 12], Quad4));
    pairs_stay_together(world, &stacked([8, 8, 6], [7, 7, 7], Hex8));
}

/// Two boxes on top of each other with non-matching meshes.
fn stacked<const D: usize>(lower: [u32; D], upper: [u32; D], element: ElementKind) -> Mesh<D> {
    let (mut min, mut max) = ([0.0; D], [1.0; D]);
    let below = BoxShape { min, max, cells: lower, element }.mesh().expect("a box");
    (min[D - 1], max[D - 1]) = (1.0, 2.0);
    let above = BoxShape { min, max, cells: upper, element }.mesh().expect("a box");
    merge(vec![("lower".into(), below), ("upper".into(), above)]).expect("small")
}

/// Current position of a node of the whole mesh: perturbed by up to `shake`.
fn place<const D: usize>(whole: &Mesh<D>, node: u32, shake: f64) -> [f64; D] {
    let mut seed = u64::from(node) + 1;
    whole.points[node as usize].map(|x| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        x + shake * ((seed >> 33) as f64 / f64::from(1_u32 << 30) - 1.0)
    })
}

fn positions<const D: usize>(whole: &Mesh<D>, local: &LocalMesh<D>, shake: f64) -> Vec<f64> {
    local.input_node.iter().flat_map(|&node| place(whole, node, shake)).collect()
}

fn around<const D: usize>(whole: &Mesh<D>, facet: Facet, shake: f64) -> Bounds<D> {
    let mut nodes = Vec::new();
    whole.facet_nodes(facet, &mut nodes);
    Bounds::of_facet(whole.facet_kind(facet), nodes.iter().map(|&node| place(whole, node, shake)))
}

/// Whether facets of an element of the whole mesh are marked as being at an edge, here by its number.
fn is_marked(element: u32) -> bool {
    element.is_multiple_of(3)
}

/// The gathered facets equal those that a search over all facets of the whole mesh finds.
fn targets_are_found<const D: usize>(world: &SimpleCommunicator, whole: &Mesh<D>, plan: &Plan) {
    let (local, _) = deal(world, whole, plan);
    let (contactor, target) =
        (&local.mesh.facet_sets[COUPLE.contactor], &local.mesh.facet_sets[COUPLE.target]);
    let mine = |facet: &&Facet| local.mine[facet.element as usize];
    let own: Vec<Facet> = contactor.iter().filter(mine).copied().collect();
    let input = |facet: &Facet| local.input_element[facet.element as usize];
    let target_edges = target.iter().filter(|facet| is_marked(input(facet))).copied().collect();
    let surfaces = Surfaces { local: &local, contactor: &own, target, target_edges: &target_edges };
    for (shake, radius, slack) in [(0.0, 0.01, 0.0), (0.15, 0.1, 0.05), (0.05, 5.0, 1.0)] {
        let now = positions(whole, &local, shake);
        let gather = TargetGather::new(world, &surfaces, &now, Reach { radius, slack }).expect("whole");
        let boxes: Vec<Bounds<D>> = own
            .iter()
            .map(|facet| Facet { element: local.input_element[facet.element as usize], side: facet.side })
            .map(|facet| around(whole, facet, shake).inflate(radius + slack))
            .collect();
        let near = |facet: &&Facet| boxes.iter().any(|one| one.meets(&around(whole, **facet, shake)));
        let expected: Vec<Facet> = whole.facet_sets[COUPLE.target].iter().filter(near).copied().collect();
        facets_are_those(world, whole, &local, &gather, &expected);
        values_fit_the_facets(world, whole, &local, &gather.foreign, shake);
        motion_is_noticed(&gather, &now, slack);
        turning_is_noticed(world, &gather, &now);
    }
}

/// Checks that facets, nodes, bodies and reference points are equal.
fn facets_are_those<const D: usize>(
    world: &SimpleCommunicator,
    whole: &Mesh<D>,
    local: &LocalMesh<D>,
    found: &TargetGather<D>,
    expected: &[Facet],
) {
    let TargetGather { facets: found, foreign: beyond, .. } = found;
    let identity = |facet: &Facet| 16 * u64::from(facet.element) + u64::from(facet.side);
    assert!(found.identities.iter().copied().eq(expected.iter().map(identity)), "{:?}", found.identities);
    let input = input_of_global(world, local);
    let foreign = beyond.numbers.iter().map(|&global| input[global as usize]);
    let here: Vec<u32> = local.input_node.iter().copied().chain(foreign).collect();
    assert!(beyond.numbers.is_sorted_by(|a, b| a < b));
    assert!(beyond.numbers.iter().all(|&global| local.index.local(global).is_none()));
    let mut nodes = Vec::new();
    for (number, &facet) in expected.iter().enumerate() {
        whole.facet_nodes(facet, &mut nodes);
        assert!(found.nodes_of(number).iter().map(|&node| here[node as usize]).eq(nodes.iter().copied()));
        assert_eq!(found.kinds[number], whole.facet_kind(facet));
        assert_eq!(found.bodies[number], whole.body[facet.element as usize]);
        assert_eq!(found.at_edge[number], is_marked(facet.element));
    }
    let points = here[local.index.local_count()..].iter().map(|&node| whole.points[node as usize]);
    assert!(beyond.points.iter().copied().eq(points));
}

/// The foreign nodes receive their positions from their owners.
fn values_fit_the_facets<const D: usize>(
    world: &SimpleCommunicator,
    whole: &Mesh<D>,
    local: &LocalMesh<D>,
    foreign: &ForeignNodes<D>,
    shake: f64,
) {
    let input = input_of_global(world, local);
    let mut exchange = NodeExchange::new(world, &local.index, &foreign.numbers).expect("nodes that exist");
    let mut brought = vec![0.0; D * foreign.numbers.len()];
    exchange.forward(world, D, &positions(whole, local, shake), &mut brought);
    let expected = foreign.numbers.iter().flat_map(|&global| place(whole, input[global as usize], shake));
    assert!(brought.iter().copied().eq(expected));
}

/// Motion within the search margin is permitted, larger motion is not.
fn motion_is_noticed<const D: usize>(gather: &TargetGather<D>, now: &[f64], slack: f64) {
    let at =
        |positions: &[f64]| gather.motion(|node| std::array::from_fn(|i| positions[D * node as usize + i]));
    assert_eq!(at(now), [0.0; 2]);
    assert!(gather.holds([0.0, 0.0]) && gather.holds([slack, 0.0]) && !gather.holds([slack, 1e-9]));
    let moved: Vec<f64> = now.iter().map(|x| x + 0.25).collect();
    assert!(at(&moved).iter().all(|&m| m == 0.0 || (0.249..=0.751).contains(&m)));
    let lost = vec![f64::NAN; now.len()];
    assert!(at(&lost).iter().all(|&m| m == 0.0 || !gather.holds([m, 0.0])));
}

/// A turn of all facets by 15 degrees is permitted. One by 25 degrees is noticed on some rank.
fn turning_is_noticed<const D: usize>(world: &SimpleCommunicator, gather: &TargetGather<D>, now: &[f64]) {
    let turned = |degrees: f64| {
        let (sine, cosine) = f64::to_radians(degrees).sin_cos();
        gather.has_turned(|node| {
            let mut point: [f64; D] = std::array::from_fn(|i| now[D * node as usize + i]);
            let [x, y] = [point[0], point[D - 1]];
            (point[0], point[D - 1]) = (cosine * x - sine * y, sine * x + cosine * y);
            point
        })
    };
    assert!(!turned(0.0) && !turned(15.0));
    assert!(sum(world, &[i32::from(turned(25.0))])[0] > 0);
}

/// Number in the input mesh of each global node.
fn input_of_global<const D: usize>(world: &SimpleCommunicator, local: &LocalMesh<D>) -> Vec<u32> {
    let mut input = vec![0; local.index.total as usize];
    for node in 0..local.index.owned {
        input[local.index.first as usize + node] = local.input_node[node] as i32;
    }
    sum(world, &input).into_iter().map(|node| node as u32).collect()
}

/// Contact weights cut far fewer pairs, keep the balance, and the report is correct.
fn pairs_stay_together<const D: usize>(world: &SimpleCommunicator, whole: &Mesh<D>) {
    let plan = Plan::for_contact(Some(whole), &[COUPLE]).expect("both sets");
    let (_, report) = deal(world, whole, &plan);
    let parts = world.size() as usize;
    let plain = Quality::of_plain(whole, &plan, parts).expect("a cut");
    let reported = Quality {
        elements: report.elements.clone(),
        contact: report.contact.clone(),
        edge_cut: report.edge_cut,
        pairs: report.pairs,
        pairs_cut: report.pairs_cut,
    };
    assert_eq!(reported, Quality::of_plan(whole, &plan, parts).expect("a cut"));
    if parts == 1 {
        assert_eq!((report.pairs_cut, report.edge_cut), (0, 0));
        return;
    }
    // On seven ranks the second mesh leaves each but seven contactor facets, and most of what these see is elsewhere.
    let fewer = if parts <= 4 { 3 } else { 2 };
    assert!(fewer * report.pairs_cut < plain.pairs_cut, "{report}; plain: {plain:?}");
    assert!(report.element_imbalance() < 1.1, "{report}");
    assert!(report.contact_imbalance() < 1.2 && plain.contact_imbalance() > 1.5, "{report}; {plain:?}");
}
