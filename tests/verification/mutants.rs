//! Meshes with realistic defects: each is refused, or the result is correct.
//!
//! A block is stretched by a prescribed displacement or by a traction. Its strain is uniform, so
//! every mesh with conforming elements gives the exact force. Mutators duplicate nodes and
//! elements, refine one side of an interface, cut out pieces, invert and displace elements, mix
//! kinds and renumber everything, two at a time. If a mutator leaves the block intact, the force
//! must be exact. In all cases reactions must balance the applied loads to 1e-6. Every mesh is
//! also read from an input file of Abaqus, with the same outcome.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::rc::Rc;

use contact_petsc::error::{Cause, Error};
use contact_petsc::mesh::{BoxShape, ElementKind, FacetIndex, Mesh, abaqus, gmsh};
use contact_petsc::petsc::Session;

use super::march::attempt;

/// Pseudo-random numbers that are the same everywhere.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 33
    }

    fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound as u64) as usize
    }

    /// A number between -1 and 1.
    fn signed(&mut self) -> f64 {
        self.next() as f64 / f64::from(1 << 30) - 1.0
    }

    fn half(&mut self) -> bool {
        self.below(2) == 0
    }
}

/// The effect of a mutator on the block.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Mutation {
    Shuffle,
    Jiggle,
    DuplicateNodes,
    DuplicateElement,
    Refine,
    Remove,
    Island,
    Swap,
    Displace,
    Mix,
}

use Mutation::*;

const MUTATIONS: [Mutation; 10] =
    [Shuffle, Jiggle, DuplicateNodes, DuplicateElement, Refine, Remove, Island, Swap, Displace, Mix];

impl Mutation {
    /// Whether the block still fills its region, so that an accepted mesh must give the exact
    /// force.
    fn leaves_the_block(self) -> bool {
        !matches!(self, Remove | Island | Displace)
    }
}

/// Whether the block is intact after all of these. If parts are not joined, moved nodes open a slit
/// of the same width.
fn leave_the_block(mutations: &[Mutation]) -> bool {
    let splits = |mutation: &Mutation| matches!(mutation, DuplicateNodes | DuplicateElement | Refine);
    let slit = mutations.iter().position(splits).is_some_and(|first| mutations[first..].contains(&Jiggle));
    !slit && mutations.iter().all(|mutation| mutation.leaves_the_block())
}

/// A mutable mesh: elements as lists.
#[derive(Clone)]
struct Draft<const D: usize> {
    points: Vec<[f64; D]>,
    elements: Vec<(ElementKind, Vec<u32>)>,
}

impl<const D: usize> Draft<D> {
    fn block(kind: ElementKind, cells: [u32; D], min: [f64; D], max: [f64; D]) -> Self {
        let mesh = BoxShape { min, max, cells, element: kind }.mesh().expect("a box");
        let elements = (0..mesh.element_count()).map(|e| (mesh.kinds[e], mesh.element_nodes(e).to_vec()));
        Self { elements: elements.collect(), points: mesh.points }
    }

    fn add(&mut self, other: &Self) {
        let first = self.points.len() as u32;
        self.points.extend(&other.points);
        let moved = other
            .elements
            .iter()
            .map(|(kind, nodes)| (*kind, nodes.iter().map(|node| node + first).collect()));
        self.elements.extend(moved);
    }

    /// Joins nodes with the same coordinates.
    fn join(&mut self) {
        let mut known = BTreeMap::new();
        let key = |x: &[f64; D]| x.map(|value| (value * 1e9).round() as i64);
        let number: Vec<u32> =
            (0..).zip(&self.points).map(|(node, x)| *known.entry(key(x)).or_insert(node)).collect();
        for (_, nodes) in &mut self.elements {
            nodes.iter_mut().for_each(|node| *node = number[*node as usize]);
        }
    }

    fn centre(&self, element: usize) -> [f64; D] {
        let (kind, nodes) = &self.elements[element];
        let corners = &nodes[..kind.corners()];
        std::array::from_fn(|k| {
            corners.iter().map(|&n| self.points[n as usize][k]).sum::<f64>() / corners.len() as f64
        })
    }

    fn mutate(&mut self, mutation: Mutation, kind: ElementKind, random: &mut Random) {
        let count = self.elements.len();
        match mutation {
            Shuffle => {
                for k in (1..count).rev() {
                    self.elements.swap(k, random.below(k + 1));
                }
                let mut number: Vec<u32> = (0..self.points.len() as u32).collect();
                for k in (1..number.len()).rev() {
                    number.swap(k, random.below(k + 1));
                }
                let old = self.points.clone();
                number.iter().zip(&old).for_each(|(&new, x)| self.points[new as usize] = *x);
                self.elements
                    .iter_mut()
                    .flat_map(|(_, nodes)| nodes)
                    .for_each(|node| *node = number[*node as usize]);
            }
            Jiggle => {
                for x in &mut self.points {
                    if x.iter().all(|x| (0.01..0.99).contains(x)) {
                        x.iter_mut().for_each(|x| *x += 0.02 * random.signed());
                    }
                }
            }
            DuplicateNodes => {
                let axis = random.below(D);
                let chosen: Vec<bool> = (0..count)
                    .map(|e| if random.below(4) == 0 { random.half() } else { self.centre(e)[axis] > 0.5 })
                    .collect();
                let mut twin = BTreeMap::new();
                for element in (0..count).filter(|&element| chosen[element]) {
                    for node in &mut self.elements[element].1 {
                        let points = &mut self.points;
                        *node = *twin.entry(*node).or_insert_with(|| {
                            points.push(points[*node as usize]);
                            points.len() as u32 - 1
                        });
                    }
                }
            }
            DuplicateElement => {
                let (kind, mut nodes) = self.elements[random.below(count)].clone();
                if random.half() {
                    for node in &mut nodes {
                        self.points.push(self.points[*node as usize]);
                        *node = self.points.len() as u32 - 1;
                    }
                }
                self.elements.push((kind, nodes));
            }
            Refine => {
                // Two blocks with different cells, joined where nodes coincide.
                let (axis, across) = (random.below(D), random.below(D - 1));
                let across = if across < axis { across } else { across + 1 };
                let (mut middle, mut coarse, mut low) = ([1.0; D], [2; D], [0.0; D]);
                (middle[axis], coarse[axis], low[axis]) = (0.5, 1, 0.5);
                let mut fine = coarse;
                fine[across] = 3 + random.below(2) as u32;
                *self = Self::block(kind, coarse, [0.0; D], middle);
                self.add(&Self::block(kind, fine, low, [1.0; D]));
                self.join();
            }
            Remove => {
                for _ in 0..1 + random.below(1 + count / 2) {
                    let last = self.elements.len();
                    if last > 1 {
                        self.elements.swap_remove(random.below(last));
                    }
                }
            }
            Island => {
                let low = 1.5 + random.signed().abs();
                let (mut min, mut max) = ([0.2; D], [0.7; D]);
                (min[0], max[0]) = (low, low + 0.5);
                if random.half() {
                    (min[D - 1], max[D - 1]) = (0.0, 0.4);
                }
                self.add(&Self::block(kind, [1; D], min, max));
            }
            Swap => {
                let (kind, nodes) = &mut self.elements[random.below(count)];
                let (one, other) = (random.below(kind.nodes()), random.below(kind.nodes()));
                nodes.swap(one, other);
            }
            Displace => {
                let node = random.below(self.points.len());
                self.points[node].iter_mut().for_each(|x| *x += 0.8 * random.signed());
            }
            Mix => self.mix(random),
        }
    }

    /// Changes an element to one of the other order, or to simplices.
    fn mix(&mut self, random: &mut Random) {
        let element = random.below(self.elements.len());
        let (kind, nodes) = self.elements[element].clone();
        let corners = &nodes[..kind.corners()];
        if random.half() && matches!(corners.len(), 4 | 8) && kind.order() == 1 && kind != ElementKind::Tet4 {
            let (simplex, parts): (_, &[&[usize]]) = match D {
                2 => (ElementKind::Tri3, &[&[0, 1, 2], &[0, 2, 3]]),
                _ => (
                    ElementKind::Tet4,
                    &[&[0, 1, 3, 4], &[1, 2, 3, 6], &[1, 4, 5, 6], &[3, 4, 6, 7], &[1, 3, 4, 6]],
                ),
            };
            self.elements.swap_remove(element);
            let parts = parts.iter().map(|part| (simplex, part.iter().map(|&k| corners[k]).collect()));
            self.elements.extend(parts);
            return;
        }
        let other = ElementKind::SOLIDS.into_iter().find(|other| {
            other.dimension() == D && other.corners() == kind.corners() && other.order() != kind.order()
        });
        let Some(other) = other else { return };
        let mut new = corners.to_vec();
        for parents in &other.parents()[corners.len()..] {
            let place = |k: usize| {
                parents.iter().map(|&p| self.points[corners[p as usize] as usize][k]).sum::<f64>()
                    / parents.len() as f64
            };
            let place = std::array::from_fn(place);
            self.points.push(place);
            new.push(self.points.len() as u32 - 1);
        }
        self.elements[element] = (other, new);
    }

    /// Whether a side of the top is curved, so that its corners do not determine its area.
    fn is_curved_on_top(&self) -> bool {
        self.side(D - 1, 1.0).iter().any(|(kind, nodes)| {
            kind.parents().iter().zip(nodes).any(|(parents, &node)| {
                (0..D).any(|k| {
                    let mean =
                        parents.iter().map(|&p| self.points[nodes[usize::from(p)] as usize][k]).sum::<f64>()
                            / parents.len() as f64;
                    (self.points[node as usize][k] - mean).abs() > 1e-9
                })
            })
        })
    }

    /// Boundary facets whose corners all have this coordinate, as corners of their elements in
    /// Gmsh's order.
    fn side(&self, axis: usize, at: f64) -> Vec<(ElementKind, Vec<u32>)> {
        let mut mesh = Mesh::with_points(self.points.clone());
        for (kind, nodes) in &self.elements {
            mesh.push(*kind, nodes.iter().copied());
        }
        let facets = FacetIndex::new(&mesh).boundary().into_iter().filter(|&facet| {
            mesh.facet_corners(facet).all(|node| (mesh.points[node as usize][axis] - at).abs() < 1e-9)
        });
        let nodes_of = |facet| {
            let mut nodes = Vec::new();
            mesh.facet_nodes(facet, &mut nodes);
            (mesh.facet_kind(facet), nodes)
        };
        facets.map(nodes_of).collect()
    }

    /// The mesh in Gmsh's format, with the existing sides at x, y and z of 0 or 1.
    fn msh(&self) -> String {
        let mut text = String::from("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n4\n");
        let _ = writeln!(
            text,
            "{0} 1 \"bottom\"\n{0} 2 \"top\"\n{0} 3 \"left\"\n{0} 4 \"front\"\n$EndPhysicalNames",
            D - 1
        );
        let sides = [self.side(D - 1, 0.0), self.side(D - 1, 1.0), self.side(0, 0.0), self.side(1, 0.0)];
        let sides = &sides[..if D == 2 { 3 } else { 4 }];
        let used: BTreeSet<u32> = self.elements.iter().flat_map(|(_, nodes)| nodes).copied().collect();
        let _ = writeln!(text, "$Nodes\n{}", used.len());
        for &node in &used {
            let x = self.points[node as usize];
            let _ = writeln!(text, "{} {:e} {:e} {:e}", node + 1, x[0], x[1], x.get(2).unwrap_or(&0.0));
        }
        let total = self.elements.len() + sides.iter().map(Vec::len).sum::<usize>();
        let _ = writeln!(text, "$EndNodes\n$Elements\n{total}");
        let mut number = 0;
        let mut write = |kind: ElementKind, group: usize, nodes: &[u32]| {
            number += 1;
            let _ = write!(text, "{number} {} 2 {group} 1", kind.gmsh_type());
            let mut ordered = vec![0; nodes.len()];
            kind.gmsh_order().iter().zip(nodes).for_each(|(&to, node)| ordered[to as usize] = node + 1);
            ordered.iter().for_each(|node| {
                let _ = write!(text, " {node}");
            });
            text.push('\n');
        };
        for (group, side) in (1..).zip(sides) {
            side.iter().for_each(|(kind, nodes)| write(*kind, group, nodes));
        }
        self.elements.iter().for_each(|(kind, nodes)| write(*kind, 9, nodes));
        text + "$EndElements\n"
    }
}

impl<const D: usize> Draft<D> {
    /// The mesh as an input file of Abaqus, with the sets of [`msh`](Self::msh). `None` if an
    /// element has no type there.
    fn inp(&self) -> Option<String> {
        let mut text = String::from("*NODE\n");
        let used: BTreeSet<u32> = self.elements.iter().flat_map(|(_, nodes)| nodes).copied().collect();
        for &node in &used {
            let x = self.points[node as usize];
            let _ = writeln!(text, "{}, {:e}, {:e}, {:e}", node + 1, x[0], x[1], x.get(2).unwrap_or(&0.0));
        }
        let mut sides = String::new();
        for (number, (kind, nodes)) in (1..).zip(&self.elements) {
            let (name, faces) = abaqus_type(*kind)?;
            let nodes: Vec<String> = nodes.iter().map(|node| (node + 1).to_string()).collect();
            let lines: Vec<String> = nodes.chunks(10).map(|line| line.join(", ")).collect();
            let _ = write!(text, "*Element, type={name}, elset=9\n{number}, {}\n", lines.join(",\n"));
            let boundary = [("bottom", D - 1, 0.0), ("top", D - 1, 1.0), ("left", 0, 0.0), ("front", 1, 0.0)];
            for (set, axis, at) in &boundary[..if D == 2 { 3 } else { 4 }] {
                for (face, &side) in (1..).zip(faces) {
                    if self.is_on_boundary(number - 1, side, *axis, *at) {
                        let _ = writeln!(sides, "*Surface, name={set}\n{number}, S{face}");
                    }
                }
            }
        }
        Some(text + &sides)
    }

    /// Whether a side is on the surface, with all corners at this coordinate.
    fn is_on_boundary(&self, element: usize, side: usize, axis: usize, at: f64) -> bool {
        let (kind, nodes) = &self.elements[element];
        let corners = &kind.sides()[side][..kind.side_kind(side).corners()];
        let mut corners: Vec<u32> = corners.iter().map(|&local| nodes[usize::from(local)]).collect();
        corners.sort_unstable();
        self.side(axis, at).iter().any(|(kind, nodes)| {
            let mut found = nodes[..kind.corners()].to_vec();
            found.sort_unstable();
            found == corners
        })
    }
}

/// Type of a kind in Abaqus, and the sides that its faces `S1`, `S2`, ... are.
fn abaqus_type(kind: ElementKind) -> Option<(&'static str, &'static [usize])> {
    Some(match kind {
        ElementKind::Tri3 => ("CPE3", &[0, 1, 2]),
        ElementKind::Tri6 => ("CPE6", &[0, 1, 2]),
        ElementKind::Quad4 => ("CPE4", &[0, 1, 2, 3]),
        ElementKind::Quad8 => ("CPE8", &[0, 1, 2, 3]),
        ElementKind::Wedge6 => ("C3D6", &[0, 1, 2, 3, 4]),
        ElementKind::Pyramid5 => ("C3D5", &[0, 1, 2, 3, 4]),
        ElementKind::Tet4 => ("C3D4", &[3, 0, 1, 2]),
        ElementKind::Tet10 => ("C3D10", &[3, 0, 1, 2]),
        ElementKind::Hex8 => ("C3D8", &[4, 5, 2, 1, 3, 0]),
        ElementKind::Hex20 => ("C3D20", &[4, 5, 2, 1, 3, 0]),
        _ => return None,
    })
}

/// The file in the format of Gmsh and in that of Abaqus: both are refused, or both are the same
/// mesh to the last bit.
fn reads_alike<const D: usize>(msh: &str, inp: &str, what: &str) {
    match (gmsh::parse::<D>(msh.as_bytes(), None), abaqus::parse::<D>(inp.as_bytes(), None)) {
        (Ok(one), Ok(other)) => assert!(one == other, "{what}: the meshes differ"),
        (Err(_), Err(error)) => {
            assert!(error.message.contains("line ") && error.message.contains("hint: "), "{what}: {error}");
        }
        (one, other) => panic!("{what}: {:?} from .msh, {:?} from .inp", one.err(), other.err()),
    }
}

const YOUNG: f64 = 1e7;
const POISSON: f64 = 0.3;
const STRETCH: f64 = 1e-3;
const TRACTION: f64 = 1e4;

fn case<const D: usize>(path: &str, pulled: bool) -> String {
    let up = ["x", "y", "z"][D - 1];
    let load = match pulled {
        true => format!("traction: {{ {up}: {TRACTION} }}"),
        false => format!("displacement: {{ {up}: {STRETCH} }}"),
    };
    let front = if D == 3 { "front: { on: block.front, displacement: { y: 0 } }\n  " } else { "" };
    format!(
        "dimension: {D}
bodies:
  block:
    mesh: {{ file: {path} }}
    material: {{ neo_hookean: {{ young_modulus: {YOUNG}, poisson_ratio: {POISSON} }} }}
    kinematics: linear
boundary:
  left: {{ on: block.left, displacement: {{ x: 0 }} }}
  {front}bottom: {{ on: block.bottom, displacement: {{ {up}: 0 }} }}
  top: {{ on: block.top, {load} }}
time: {{ end: 1, scheme: {{ static: {{ increments: 1 }} }} }}
output: {{ fields: {{ every: 0 }} }}
"
    )
}

/// Meshes with unjoined parts are refused for a reason: without the refusal, some give another
/// force.
fn unchecked_meshes_are_wrong(session: &Rc<Session>) {
    for mutation in [DuplicateNodes, Refine] {
        let mut wrong = 0;
        for seed in 0..6 {
            let mut draft = Draft::<2>::block(ElementKind::Quad4, [2; 2], [0.0; 2], [1.0; 2]);
            draft.mutate(mutation, ElementKind::Quad4, &mut Random(seed));
            let path = path();
            if session.rank() == 0 {
                std::fs::write(&path, draft.msh()).expect("the mesh is written");
            }
            let text = case::<2>(&path.display().to_string(), false);
            let error = attempt(session, &text).err().expect("a mesh that is refused");
            assert_eq!(error.cause, Cause::File, "{error}");
            let force = match attempt(session, &text.replace("mesh.msh }", "mesh.msh, merge: never }")) {
                Ok(Some(results)) => results.table("reactions.csv").column("force_y").pop().expect("a row"),
                Ok(None) => continue,
                Err(_) => 0.0,
            };
            let exact = YOUNG / (1.0 - POISSON * POISSON) * STRETCH;
            wrong += u32::from((force / exact - 1.0).abs() > 0.01);
        }
        assert!(session.rank() > 0 || wrong > 0, "{mutation:?} does no harm");
    }
}

/// Half of a block consists of wedges and half of hexahedra, with the inner node moved: the stress is
/// uniform, and the force exact. From both formats of mesh files.
fn wedges_beside_hexahedra(session: &Rc<Session>) {
    const WEDGES: [[usize; 6]; 2] = [[0, 1, 2, 4, 5, 6], [0, 2, 3, 4, 6, 7]];
    let mut draft = Draft::<3>::block(ElementKind::Hex8, [2; 3], [0.0; 3], [1.0; 3]);
    draft.mutate(Jiggle, ElementKind::Hex8, &mut seeded(1));
    let split: Vec<bool> = (0..draft.elements.len()).map(|element| draft.centre(element)[0] < 0.5).collect();
    let old = std::mem::take(&mut draft.elements);
    for ((kind, nodes), split) in old.into_iter().zip(split) {
        if split {
            let wedge = |corners: [usize; 6]| corners.iter().map(|&corner| nodes[corner]).collect();
            draft.elements.extend(WEDGES.map(|corners| (ElementKind::Wedge6, wedge(corners))));
        } else {
            draft.elements.push((kind, nodes));
        }
    }
    uniform_from_both_formats(session, &draft, "wedges beside hexahedra");
}

/// A block of hexahedra and tetrahedra with pyramids between them, with the inner nodes moved: the
/// stress is uniform, and the force exact. From both formats of mesh files.
fn pyramids_between_hexahedra_and_tetrahedra(session: &Rc<Session>) {
    // Hexahedra below, cells of pyramids and tetrahedra above, whose upper half is cut along diagonals.
    const CORNERS: [[f64; 3]; 8] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [1.0, 1.0, 1.0],
        [0.0, 1.0, 1.0],
    ];
    let mut draft = Draft::<3>::block(ElementKind::Hex8, [2; 3], [0.0; 3], [1.0; 3]);
    draft.mutate(Jiggle, ElementKind::Hex8, &mut seeded(1));
    let upper: Vec<bool> = (0..draft.elements.len()).map(|element| draft.centre(element)[2] > 0.5).collect();
    let old = std::mem::take(&mut draft.elements);
    for ((kind, nodes), upper) in old.into_iter().zip(upper) {
        if !upper {
            draft.elements.push((kind, nodes));
            continue;
        }
        let centre = draft.points.len() as u32;
        let mean = |k: usize| nodes.iter().map(|&node| draft.points[node as usize][k]).sum::<f64>() / 8.0;
        let at = [mean(0), mean(1), mean(2)];
        draft.points.push(at);
        for side in ElementKind::Hex8.sides() {
            // Seen from the centre.
            let mut face: Vec<u32> = side.iter().rev().map(|&corner| nodes[usize::from(corner)]).collect();
            let is_low = side.iter().all(|&corner| CORNERS[usize::from(corner)][2] == 0.0);
            if is_low {
                face.push(centre);
                draft.elements.push((ElementKind::Pyramid5, face));
                continue;
            }
            // The diagonal from the lowest number, which neighbours share.
            let first = (0..4).min_by_key(|&k| face[k]).expect("a corner");
            face.rotate_left(first);
            draft.elements.push((ElementKind::Tet4, vec![face[0], face[1], face[2], centre]));
            draft.elements.push((ElementKind::Tet4, vec![face[0], face[2], face[3], centre]));
        }
    }
    let kinds = |kind| draft.elements.iter().filter(|(own, _)| *own == kind).count();
    assert_eq!([ElementKind::Hex8, ElementKind::Pyramid5, ElementKind::Tet4].map(kinds), [4, 4, 40]);
    uniform_from_both_formats(session, &draft, "pyramids between hexahedra and tetrahedra");
}

/// The mesh of both formats is the same, and gives the force of a uniform stretch.
fn uniform_from_both_formats(session: &Rc<Session>, draft: &Draft<3>, what: &str) {
    let inp = draft.inp().expect("types of Abaqus");
    reads_alike::<3>(&draft.msh(), &inp, what);
    for (ending, text) in [("msh", draft.msh()), ("inp", inp)] {
        let path = path().with_extension(ending);
        if session.rank() == 0 {
            std::fs::write(&path, text).expect("the mesh is written");
        }
        let results = attempt(session, &case::<3>(&path.display().to_string(), false));
        let Some(results) = results.unwrap_or_else(|error| panic!("{error}")) else { continue };
        let column = results.table("reactions.csv").column("force_z");
        let exact = YOUNG * STRETCH;
        for (force, expected) in column.iter().rev().zip([exact, -exact]) {
            assert!((force - expected).abs() < 1e-10 * exact, "{ending}: {force} in place of {expected}");
        }
    }
}

/// Path of the mesh of a run.
fn path() -> std::path::PathBuf {
    std::path::PathBuf::from(std::env::var(super::FOLDER).expect("a folder")).join("mesh.msh")
}

/// Outcome of the meshes, to check that the sweep is meaningful.
#[derive(Debug, Default)]
struct Tally {
    refused: u32,
    exact: u32,
    balanced: u32,
}

/// Number of meshes and seed of a longer sweep, see `scripts/fuzz-meshes`.
pub const SWEEP: &str = "CONTACT_PETSC_MUTANTS";

/// Parameters of a longer sweep.
pub fn longer_sweep() -> Option<(u64, u64)> {
    let text = std::env::var(SWEEP).ok()?;
    let numbers: Vec<u64> =
        text.split_whitespace().map(|word| word.parse().expect("a count and a seed")).collect();
    Some((numbers[0], numbers[1]))
}

pub fn all(session: &Rc<Session>) {
    if let Some((count, seed)) = longer_sweep() {
        return random_sweep(session, count, seed);
    }
    let mut tally = Tally::default();
    for kind in ElementKind::SOLIDS {
        match kind.dimension() {
            2 => sweep::<2>(session, kind, &mut tally),
            _ => sweep::<3>(session, kind, &mut tally),
        }
    }
    for seed in FOUND {
        let mut random = seeded(seed);
        let kind = ElementKind::SOLIDS[random.below(KINDS_THEN)];
        random_mesh::<3>(session, kind, seed, &mut random, &mut tally);
    }
    unchecked_meshes_are_wrong(session);
    wedges_beside_hexahedra(session);
    pyramids_between_hexahedra_and_tetrahedra(session);
    if session.rank() == 0 {
        println!("{tally:?}");
        assert!(tally.refused > 50 && tally.exact > 15 && tally.balanced > 5, "{tally:?}");
    }
}

/// Seeds of longer sweeps whose meshes gave another force: hexahedra next to tetrahedra on warped
/// sides.
const FOUND: [u64; 3] = [442, 705, 1408];

/// Number of kinds when these were found. Later kinds come after them.
const KINDS_THEN: usize = 10;

/// Numbers of a mesh of a longer sweep.
fn seeded(seed: u64) -> Random {
    // Seeds next to each other begin with similar numbers.
    let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    (0..8).for_each(|_| {
        random.next();
    });
    random
}

fn random_kind(random: &mut Random) -> ElementKind {
    ElementKind::SOLIDS[random.below(ElementKind::SOLIDS.len())]
}

/// Meshes with one or two mutations, often with nodes moved and renumbered. Each has its own seed,
/// so that a failed one can be repeated alone.
fn random_sweep(session: &Rc<Session>, count: u64, seed: u64) {
    let mut tally = Tally::default();
    let mut failures = Vec::new();
    // The hook of a session ends the process.
    drop(std::panic::take_hook());
    for seed in seed..seed + count {
        let mut random = seeded(seed);
        let kind = random_kind(&mut random);
        let one = std::panic::AssertUnwindSafe(|| match kind.dimension() {
            2 => random_mesh::<2>(session, kind, seed, &mut random, &mut tally),
            _ => random_mesh::<3>(session, kind, seed, &mut random, &mut tally),
        });
        if std::panic::catch_unwind(one).is_err() {
            failures.push(seed);
        }
    }
    println!("{tally:?}");
    assert!(failures.is_empty(), "seeds that fail: {failures:?}");
}

fn random_mesh<const D: usize>(
    session: &Rc<Session>,
    kind: ElementKind,
    seed: u64,
    random: &mut Random,
    tally: &mut Tally,
) {
    let mut draft = Draft::<D>::block(kind, [2; D], [0.0; D], [1.0; D]);
    // Most meshes with several defects are refused for the first.
    let defects = if random.below(3) > 0 { 1 } else { 2 };
    let mut mutations: Vec<Mutation> =
        (0..defects).map(|_| MUTATIONS[random.below(MUTATIONS.len())]).collect();
    if random.half() {
        mutations.insert(0, Jiggle);
    }
    if random.half() {
        mutations.push(Shuffle);
    }
    mutations.iter().for_each(|&mutation| draft.mutate(mutation, kind, random));
    let pulled = random.half() && !draft.is_curved_on_top();
    let what = format!("seed {seed}: {kind} {mutations:?}, {}", if pulled { "pulled" } else { "moved" });
    verdict(session, &draft, &mutations, pulled, &what, tally);
}

fn sweep<const D: usize>(session: &Rc<Session>, kind: ElementKind, tally: &mut Tally) {
    for (number, &first) in (0u64..).zip(&MUTATIONS) {
        // On several ranks each alone: they are slow where ranks are more than cores.
        for round in 0..if session.size() > 1 { 1 } else { ROUNDS } {
            let mut random = Random(1 + 1000 * kind as u64 + 10 * number + round);
            (0..8).for_each(|_| {
                random.next();
            });
            let mut draft = Draft::<D>::block(kind, [2; D], [0.0; D], [1.0; D]);
            draft.mutate(first, kind, &mut random);
            let mut mutations = vec![first];
            if round > 0 {
                let second = MUTATIONS[random.below(MUTATIONS.len())];
                draft.mutate(second, kind, &mut random);
                mutations.push(second);
            }
            let pulled = random.half();
            let what =
                format!("{kind} {mutations:?}, round {round}, {}", if pulled { "pulled" } else { "moved" });
            verdict(session, &draft, &mutations, pulled, &what, tally);
        }
    }
}

/// Rounds of each mutator: alone, then with another one.
const ROUNDS: u64 = 2;

fn verdict<const D: usize>(
    session: &Rc<Session>,
    draft: &Draft<D>,
    mutations: &[Mutation],
    pulled: bool,
    what: &str,
    tally: &mut Tally,
) {
    let mut path = path();
    let top = draft.side(D - 1, 1.0);
    let mut text = draft.msh();
    if let Some(inp) = draft.inp() {
        reads_alike::<D>(&text, &inp, what);
        // Half of the meshes are run from the input file.
        if draft.points.len().is_multiple_of(2) {
            (path, text) = (path.with_extension("inp"), inp);
        }
    }
    if session.rank() == 0 {
        std::fs::write(&path, text).expect("the mesh is written");
    }
    let results = match attempt(session, &case::<D>(&path.display().to_string(), pulled)) {
        Err(error) => {
            is_refused_well(&error, what);
            tally.refused += 1;
            return;
        }
        Ok(results) => results,
    };
    let Some(results) = results else { return };
    let reactions = results.table("reactions.csv");
    let column = reactions.column(&format!("force_{}", ["x", "y", "z"][D - 1]));
    let rows = if D == 2 { 2 } else { 3 } + usize::from(!pulled);
    let last = &column[column.len() - rows..];
    let bottom = last[rows - 1 - usize::from(!pulled)];
    let area = top.iter().map(|(kind, nodes)| draft.area(*kind, nodes)).sum::<f64>();
    let applied = if pulled { TRACTION * area } else { last[rows - 1] };
    let size = applied.abs().max(bottom.abs()).max(1e-3 * YOUNG * STRETCH);
    let imbalance = (applied + bottom).abs() / size;
    assert!(imbalance < 1e-6, "{what}: {applied} against {bottom}");
    if leave_the_block(mutations) {
        let modulus = if D == 2 { YOUNG / (1.0 - POISSON * POISSON) } else { YOUNG };
        let exact = if pulled { TRACTION } else { modulus * STRETCH };
        // Four points integrate what a tet10 with curved sides needs for a patch test but for 1e-5.
        let curved =
            draft.elements.iter().any(|(kind, _)| *kind == ElementKind::Tet10) && mutations.contains(&Jiggle);
        let tolerance = if curved && longer_sweep().is_some() { 1e-4 } else { 1e-6 };
        assert!((bottom + exact).abs() < tolerance * exact, "{what}: {bottom} in place of {}", -exact);
        tally.exact += 1;
    } else {
        tally.balanced += 1;
    }
}

impl<const D: usize> Draft<D> {
    /// Area of a flat facet from its corners.
    fn area(&self, kind: ElementKind, nodes: &[u32]) -> f64 {
        let at = |k: usize| self.points[nodes[k] as usize];
        let edge = |a: usize, b: usize| -> [f64; 2] { [at(b)[0] - at(a)[0], at(b)[1] - at(a)[1]] };
        let cross = |a: [f64; 2], b: [f64; 2]| 0.5 * (a[0] * b[1] - a[1] * b[0]).abs();
        match (D, kind.corners()) {
            (2, _) => edge(0, 1)[0].abs(),
            (_, 3) => cross(edge(0, 1), edge(0, 2)),
            _ => cross(edge(0, 2), edge(1, 3)),
        }
    }
}

/// A refusal names the cause: a file with the location, a case with the unsupported part, or a
/// solve that did not converge to equilibrium.
fn is_refused_well(error: &Error, what: &str) {
    let message = &error.message;
    match error.cause {
        Cause::File => {
            assert!(
                (message.contains("mesh.msh: line ") || message.contains("mesh.inp: line "))
                    && message.contains("hint: "),
                "{what}: {message}"
            );
        }
        Cause::Case | Cause::NotConverged => {
            let names =
                ["contact holds", "no surface", "no set", "nothing resists", "both prescribe", "no facet"];
            assert!(names.iter().any(|name| message.contains(name)), "{what}: {message}");
        }
        cause => panic!("{what}: {cause:?}: {message}"),
    }
}
