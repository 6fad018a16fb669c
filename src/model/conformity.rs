//! Checks that the elements of a body conform: neighbours share whole sides, and touching parts are
//! joined. Also finds the parts that can move without strain.
//!
//! Nodes that are not joined lie on sides that belong to one element only. The search is therefore
//! limited to the surface.

mod merging;
pub(super) mod nearest;
mod seams;

use std::collections::{BTreeMap, BTreeSet, HashSet};

use crate::error::{Error, Result};
use crate::mesh::{
    Bounds, BoundsTree, DisjointSets, ElementKind, Facet, FacetIndex, Mesh, MeshFile, spelled,
};
use crate::space::reference;
use crate::square::{cofactor, dot};
use crate::tensor::Vector;

use merging::{Merged, drop_inner_facets, merge_nodes, require_two_sides};
use seams::Seams;

/// Nodes and sides touch if their distance is below this fraction of the shortest edge of the
/// surrounding elements.
///
/// Gmsh writes 16 digits, other programs as few as seven. With seven digits, elements of a
/// thousandth of the body have a relative error of 1e-4. At half the value, unconnected parts in
/// meshes with six digits pass. At ten times the value, narrow slits between coarse elements are
/// rejected.
const TOUCH: f64 = 1e-4;

/// A void between four triangles is a slit of mismatched diagonals if it is flatter than this
/// fraction of its edges. Voids from elements that were omitted on purpose are as thick as long.
const SLIT: f64 = 0.2;

/// Maximum number of hinged parts in a body. Their motions are found by dense linear algebra.
const MOST_HINGED: usize = 64;

/// Midside nodes within this fraction of the element size from the middle leave its sides straight.
const STRAIGHT: f64 = 1e-9;

/// Source of a mesh.
pub(super) enum MeshOrigin<'a> {
    /// A box of the case: its body, and the unit of length.
    Box(&'a str, &'a str),
    /// A file.
    File(&'a MeshFile),
}

impl MeshOrigin<'_> {
    fn at_node<const D: usize>(&self, mesh: &Mesh<D>, node: u32, message: &str) -> Error {
        match self {
            Self::File(source) => source.error_at_node(mesh, node, message),
            Self::Box(body, m) => {
                let place = spelled(&mesh.points[node as usize]);
                Error::case(format!("body '{body}': the node at {place} {m} {message}"))
            }
        }
    }

    fn at_element<const D: usize>(&self, mesh: &Mesh<D>, element: usize, message: &str) -> Error {
        match self {
            Self::File(source) => source.error_at_element(mesh, element, message),
            Self::Box(body, m) => {
                let kind = mesh.kinds[element];
                let place = spelled(&mesh.element_centre(element));
                Error::case(format!("body '{body}': the {kind} element at {place} {m} {message}"))
            }
        }
    }

    /// Name of a second node in messages.
    fn node<const D: usize>(&self, mesh: &Mesh<D>, node: u32) -> String {
        match self {
            Self::File(source) => format!("node {}", source.node(node)),
            Self::Box(..) => format!("another node at {}", spelled(&mesh.points[node as usize])),
        }
    }

    /// Name of a second element in messages.
    fn element<const D: usize>(&self, mesh: &Mesh<D>, element: u32) -> String {
        match self {
            Self::File(source) => format!("element {}", source.element(element as usize)),
            Self::Box(..) => format!("the element at {}", spelled(&mesh.element_centre(element as usize))),
        }
    }
}

/// Treatment of touching parts of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum MeshParts {
    /// They must be joined.
    Joined,
    /// Nodes up to this distance \[m\] are merged; afterwards all parts must be joined.
    Merged(f64),
    /// They are separate on purpose.
    Apart,
}

/// Checks a body's mesh, merges its nodes if `parts` requests it, and finds its pieces.
///
/// `meets` are the pairs of sets between which a contact of the body with itself acts: surfaces
/// that touch there are separate on purpose. The body has a `name`, and `m` is the unit of length.
/// Returns the remarks for the user.
///
/// # Errors
/// Sides do not match or are not joined. The error gives their location.
pub(super) fn conform<const D: usize>(
    mesh: &mut Mesh<D>,
    name: &str,
    m: &str,
    source: &MeshOrigin,
    parts: MeshParts,
    meets: &[(String, String)],
) -> Result<Vec<String>> {
    let mut remarks = Vec::new();
    if let MeshParts::Merged(tolerance) = parts {
        let Merged { joined, apart } = merge_nodes(mesh, tolerance, m, source, &Seams::new(mesh, meets))?;
        remarks.push(match (joined, apart) {
            (0, 0) => format!("merge: no two nodes of '{name}' are closer than {tolerance:.1e} {m}"),
            _ => format!(
                "merge: {joined} nodes of '{name}' were joined with others within {tolerance:.1e} {m}"
            ),
        });
        if apart > 0 {
            remarks.push(format!(
                "merge: {apart} pairs of nodes of '{name}' stay separate, since a contact acts between their sets"
            ));
        }
    }
    let mut index = FacetIndex::new(mesh);
    if let MeshParts::Merged(_) = parts {
        require_two_sides(mesh, &index, source)?;
        remarks.extend(drop_inner_facets(mesh, &index, name));
    }
    require_equal_orders(mesh, &index, source)?;
    let boundary = index.boundary();
    if parts != MeshParts::Apart {
        require_joined(mesh, &boundary, source, meets)?;
    }
    remarks.extend(find_pieces(mesh, &mut index, name, m, source)?);
    Ok(remarks)
}

/// Requires that two elements that share the corners of a side share all its nodes.
fn require_equal_orders<const D: usize>(
    mesh: &Mesh<D>,
    index: &FacetIndex,
    source: &MeshOrigin,
) -> Result<()> {
    let (mut own, mut its) = (Vec::new(), Vec::new());
    for [one, other] in index.inner() {
        if mesh.facet_kind(one).order() == 1 && mesh.facet_kind(one) == mesh.facet_kind(other) {
            continue;
        }
        mesh.facet_nodes(one, &mut own);
        mesh.facet_nodes(other, &mut its);
        own.sort_unstable();
        its.sort_unstable();
        if own != its {
            let neighbour = source.element(mesh, other.element);
            let kind = mesh.kinds[other.element as usize];
            let message =
                format!("and {neighbour} ({kind}) share the corners of a side, but not its other nodes");
            let cure = "mesh the body with elements of a single order; in Gmsh `-order 1` or `-order 2`, \
                        and the same `Mesh.SecondOrderIncomplete` for all of it";
            return Err(source.at_element(mesh, one.element as usize, &message).hint(cure));
        }
    }
    Ok(())
}

/// Ways in which two parts of a surface touch without being joined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Touch {
    /// Two nodes coincide.
    Nodes(u32, u32),
    /// A node lies inside a side to which it does not belong.
    Hanging(u32, Facet),
    /// Two sides coincide.
    Sides(Facet, Facet),
}

impl Touch {
    /// The touching nodes; empty for two sides.
    fn nodes(&self) -> Vec<u32> {
        match *self {
            Self::Nodes(one, other) => vec![one, other],
            Self::Hanging(node, _) => vec![node],
            Self::Sides(..) => Vec::new(),
        }
    }
}

/// The surface of a body, prepared for the search for touching parts.
struct Surface<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    facets: &'a [Facet],
    /// Nodes of facet `f`: `nodes[starts[f]..starts[f + 1]]`.
    starts: Vec<usize>,
    nodes: Vec<u32>,
    /// Shortest distance between two corners of the element of each facet \[m\].
    sizes: Vec<f64>,
    tree: BoundsTree<D>,
}

impl<'a, const D: usize> Surface<'a, D> {
    fn new(mesh: &'a Mesh<D>, facets: &'a [Facet]) -> Self {
        let mut starts = vec![0];
        let mut nodes = Vec::new();
        let mut sizes = Vec::new();
        let mut boxes = Vec::with_capacity(facets.len());
        let mut own = Vec::new();
        for &facet in facets {
            mesh.facet_nodes(facet, &mut own);
            let at = |node: u32| mesh.points[node as usize];
            // Measure across the element as well: thin elements have close sides.
            let element = facet.element as usize;
            let corners = &mesh.element_nodes(element)[..mesh.kinds[element].corners()];
            let pairs =
                corners.iter().enumerate().flat_map(|(k, &a)| corners[k + 1..].iter().map(move |&b| (a, b)));
            let mut size = pairs.map(|(a, b)| distance(&at(a), &at(b))).fold(f64::INFINITY, f64::min);
            if let (3, [base @ .., apex]) = (D, corners)
                && base.len() == 4
            {
                // No edge of a flat pyramid is short.
                let centre = std::array::from_fn(|k| base.iter().map(|&n| at(n)[k]).sum::<f64>() / 4.0);
                size = size.min(distance(&at(*apex), &centre));
            }
            let around = Bounds::of_facet(mesh.facet_kind(facet), own.iter().map(|&node| at(node)));
            boxes.push(around.inflate(TOUCH * size));
            sizes.push(size);
            nodes.extend_from_slice(&own);
            starts.push(nodes.len());
        }
        Self { mesh, facets, starts, nodes, sizes, tree: BoundsTree::new(&boxes) }
    }

    fn nodes_of(&self, facet: usize) -> &[u32] {
        &self.nodes[self.starts[facet]..self.starts[facet + 1]]
    }

    fn points_of(&self, facet: usize) -> Vec<Vector<D>> {
        self.nodes_of(facet).iter().map(|&node| self.mesh.points[node as usize].into()).collect()
    }

    /// Distance of a position from a facet \[m\].
    fn distance(&self, place: &[f64; D], facet: usize) -> f64 {
        let kind = self.mesh.facet_kind(self.facets[facet]);
        nearest::distance(&Vector::from(*place), kind, &self.points_of(facet))
    }

    /// Nodes that lie on sides to which they do not belong.
    fn touching_nodes(&self) -> Vec<Touch> {
        let mut reach = vec![f64::INFINITY; self.mesh.points.len()];
        for facet in 0..self.facets.len() {
            for &node in self.nodes_of(facet) {
                reach[node as usize] = self.sizes[facet].min(reach[node as usize]);
            }
        }
        let mut found = Vec::new();
        for (node, &size) in (0..).zip(&reach).filter(|(_, size)| size.is_finite()) {
            let place = self.mesh.points[node as usize];
            for facet in self.tree.meeting(&Bounds::of([place])) {
                let facet = facet as usize;
                let tolerance = TOUCH * size.min(self.sizes[facet]);
                if self.nodes_of(facet).contains(&node) || self.distance(&place, facet) > tolerance {
                    continue;
                }
                let at = |other: u32| self.mesh.points[other as usize];
                let same =
                    self.nodes_of(facet).iter().find(|&&other| distance(&place, &at(other)) <= tolerance);
                found.push(match same {
                    Some(&other) => Touch::Nodes(node.min(other), node.max(other)),
                    None => Touch::Hanging(node, self.facets[facet]),
                });
            }
        }
        found
    }

    /// Corners of a facet.
    fn corners_of(&self, facet: usize) -> &[u32] {
        &self.nodes_of(facet)[..self.mesh.facet_kind(self.facets[facet]).corners()]
    }

    /// Sides in space with the same corners that do not match, even if they are warped: a triangle
    /// on a quadrilateral, or two triangles on two with the other diagonal.
    fn unmatched_sides(&self) -> Vec<Touch> {
        let mut around: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        let mut triangles: BTreeSet<Vec<u32>> = BTreeSet::new();
        for facet in 0..self.facets.len() {
            let corners = self.corners_of(facet);
            corners.iter().for_each(|&node| around.entry(node).or_default().push(facet));
            if corners.len() == 3 {
                triangles.insert(sorted(corners));
            }
        }
        let mut found = Vec::new();
        for facet in (0..self.facets.len()).filter(|&facet| self.corners_of(facet).len() == 3) {
            let corners = self.corners_of(facet);
            let others = corners.iter().flat_map(|node| &around[node]).filter(|&&other| other != facet);
            for &other in others {
                let its = self.corners_of(other);
                let shared = corners.iter().filter(|node| its.contains(node)).count();
                let lies_on = match its.len() {
                    4 => shared == 3,
                    3 => shared == 2 && self.is_slit(corners, its, &triangles),
                    _ => false,
                };
                if lies_on {
                    found.push(Touch::Sides(self.facets[facet], self.facets[other]));
                }
            }
        }
        found
    }

    /// Whether two triangles with a common edge and two triangles on the other diagonal of their
    /// four corners enclose a flat void.
    fn is_slit(&self, one: &[u32], other: &[u32], triangles: &BTreeSet<Vec<u32>>) -> bool {
        let mut nodes = one.to_vec();
        nodes.extend(other.iter().filter(|node| !one.contains(node)));
        let closed = (0..4).all(|left_out| {
            let rest = nodes.iter().enumerate().filter(|(k, _)| *k != left_out).map(|(_, node)| *node);
            triangles.contains(&sorted(&rest.collect::<Vec<_>>()))
        });
        if !closed {
            return false;
        }
        let at = |k: usize| Vector::<D>::from(self.mesh.points[nodes[k] as usize]);
        let edge = |k: usize| at(k) - at(0);
        let (a, b) = (edge(1), edge(2));
        // Height of the fourth corner above the plane of the first three.
        let along = a * (1.0 / a.norm());
        let across = b - along * along.dot(&b);
        let across = across * (1.0 / across.norm());
        let c = edge(3);
        let height = (c - along * along.dot(&c) - across * across.dot(&c)).norm();
        height < SLIT * a.norm().min(b.norm())
    }

    /// Sides whose centres lie on other sides.
    fn touching_sides(&self) -> Vec<Touch> {
        let mut found = self.unmatched_sides();
        for facet in 0..self.facets.len() {
            let element = reference(self.mesh.facet_kind(self.facets[facet]));
            let mut shape = vec![0.0; self.nodes_of(facet).len()];
            element.shape(&element.reduced_rule().points[0], &mut shape);
            let middle: Vector<D> = self.points_of(facet).iter().zip(&shape).map(|(x, n)| x * *n).sum();
            let middle: [f64; D] = middle.into();
            for other in self.tree.meeting(&Bounds::of([middle])) {
                let other = other as usize;
                let tolerance = TOUCH * self.sizes[facet].min(self.sizes[other]);
                if other != facet && self.distance(&middle, other) <= tolerance {
                    found.push(Touch::Sides(self.facets[facet], self.facets[other]));
                }
            }
        }
        found
    }
}

/// Requires that no two parts of the surface touch, except those between which a contact acts.
fn require_joined<const D: usize>(
    mesh: &Mesh<D>,
    boundary: &[Facet],
    source: &MeshOrigin,
    meets: &[(String, String)],
) -> Result<()> {
    let surface = Surface::new(mesh, boundary);
    let seams = Seams::new(mesh, meets);
    let mut found = surface.touching_nodes();
    let in_contact: HashSet<u32> =
        found.iter().filter(|touch| seams.explain(mesh, touch)).flat_map(Touch::nodes).collect();
    found.retain(|touch| !seams.explain(mesh, touch) && !seams.has_on_rim(mesh, touch, &in_contact));
    if found.is_empty() {
        found = surface.touching_sides();
        found.retain(|touch| !seams.explain(mesh, touch));
    }
    // The first by kind and number, which is the first in the file.
    found.sort_unstable();
    found.dedup();
    let Some(&first) = found.first() else { return Ok(()) };
    let is_alike = |touch: &&Touch| std::mem::discriminant(*touch) == std::mem::discriminant(&first);
    Err(refusal(mesh, source, first, found.iter().filter(is_alike).count()))
}

fn refusal<const D: usize>(mesh: &Mesh<D>, source: &MeshOrigin, first: Touch, count: usize) -> Error {
    let apart = "for faces that are separate on purpose, such as those of a crack, define a contact between \
                 their sets, or use `merge: never`";
    let places = |what: &str| match count {
        1 => String::new(),
        _ => format!(" ({count} such {what})"),
    };
    match first {
        Touch::Nodes(one, other) => {
            let tolerance = 10.0 * distance(&mesh.points[one as usize], &mesh.points[other as usize]);
            let least = 1e-9 * mesh.bounding_box().map_or(1.0, |(low, high)| distance(&low, &high));
            let message = format!(
                "and {} coincide but are separate nodes{}: the parts of the mesh on the two sides are not joined",
                source.node(mesh, other),
                places("pairs")
            );
            let cure = match source {
                MeshOrigin::File(_) => {
                    "join them by `Coherence;` in the geometry or `Coherence Mesh;` in Gmsh, or"
                }
                MeshOrigin::Box(..) => "join them by",
            };
            let cure = format!("{cure} `merge: {{ tolerance: {:.0e} }}`; {apart}", tolerance.max(least));
            source.at_node(mesh, one, &message).hint(&cure)
        }
        Touch::Hanging(node, facet) => {
            let element = source.element(mesh, facet.element);
            let message = format!(
                "is a hanging node: it lies on a side of {element} but is not one of its nodes{}; the \
                 meshes on the two sides do not match",
                places("places")
            );
            let cure = format!(
                "mesh both parts with the same nodes on their common side, or make them two bodies with a contact; {apart}"
            );
            source.at_node(mesh, node, &message).hint(&cure)
        }
        Touch::Sides(one, other) => {
            let element = source.element(mesh, other.element);
            let message = format!(
                "has a side that lies on a side of {element} with other corners{}: the elements on the two sides do not match",
                places("places")
            );
            let cure = format!(
                "a quadrilateral side must meet a quadrilateral side, and diagonals of triangles must agree: mesh both parts \
                 with elements of one shape, or put pyramids between quadrilaterals and triangles; {apart}"
            );
            source.at_element(mesh, one.element as usize, &message).hint(&cure)
        }
    }
}

/// Numbers the pieces of the body. Returns remarks if there is more than one.
///
/// # Errors
/// There are more hinged pieces than the program supports.
fn find_pieces<const D: usize>(
    mesh: &mut Mesh<D>,
    index: &mut FacetIndex,
    name: &str,
    m: &str,
    source: &MeshOrigin,
) -> Result<Vec<String>> {
    let mut sets = DisjointSets::new(mesh.element_count());
    for [one, other] in index.inner() {
        sets.join(one.element, other.element);
    }
    mesh.piece = sets.labels();
    let count = |piece: &[u32]| piece.iter().max().map_or(0, |last| *last as usize + 1);
    if count(&mesh.piece) < 2 {
        return Ok(Vec::new());
    }
    let hinges = shared_nodes(mesh);
    let mut rigid = DisjointSets::new(count(&mesh.piece));
    while join_rigid(mesh, &hinges, &mut rigid) {}
    let labels = rigid.labels();
    mesh.piece.iter_mut().for_each(|piece| *piece = labels[*piece as usize]);
    let pieces = count(&mesh.piece);
    let mut loose = DisjointSets::new(pieces);
    let mut hinge = None;
    for &([one, other], node) in &hinges {
        let (one, other) = (labels[one as usize], labels[other as usize]);
        if one != other {
            loose.join(one, other);
            hinge.get_or_insert(node);
        }
    }
    let parts = loose.labels();
    let mut members = vec![0; count(&parts)];
    parts.iter().for_each(|part| members[*part as usize] += 1);
    let most = members.iter().copied().max().unwrap_or(0);
    let mut remarks = Vec::new();
    if let Some(node) = hinge {
        if most > MOST_HINGED {
            let message = format!(
                "is one of the single nodes that connect {most} pieces of the mesh, each of which is free \
                 to rotate"
            );
            return Err(source.at_node(mesh, node, &message).hint(
                "connect elements by common sides; a body can have at most 64 pieces joined at single nodes",
            ));
        }
        remarks.push(format!(
            "pieces of '{name}' are joined at single nodes only, for example at {} {m}: they can rotate \
             about these nodes without resistance",
            spelled(&mesh.points[node as usize])
        ));
    }
    if members.len() > 1 {
        let mut elements = vec![0_u64; members.len()];
        mesh.piece.iter().for_each(|piece| elements[parts[*piece as usize] as usize] += 1);
        let least = (0..elements.len()).min_by_key(|&part| elements[part]).unwrap_or(0);
        let of_it = |element: &usize| parts[mesh.piece[*element] as usize] as usize == least;
        let first = (0..mesh.element_count()).find(of_it).unwrap_or(0);
        remarks.push(format!(
            "the mesh of '{name}' has {} parts that share no node; number of elements in the smallest: {}, one of them at {} {m}",
            members.len(),
            elements[least],
            spelled(&mesh.element_centre(first))
        ));
    }
    Ok(remarks)
}

/// Pairs of pieces that share a node, with the node.
fn shared_nodes<const D: usize>(mesh: &Mesh<D>) -> Vec<([u32; 2], u32)> {
    let mut first = vec![u32::MAX; mesh.points.len()];
    let mut more: Vec<(u32, u32)> = Vec::new();
    for element in 0..mesh.element_count() {
        let piece = mesh.piece[element];
        for &node in mesh.element_nodes(element) {
            match first[node as usize] {
                u32::MAX => first[node as usize] = piece,
                known if known != piece => more.push((node, piece)),
                _ => {}
            }
        }
    }
    more.sort_unstable();
    more.dedup();
    let mut pairs = Vec::new();
    for at_node in more.chunk_by(|a, b| a.0 == b.0) {
        let node = at_node[0].0;
        let mut pieces = vec![first[node as usize]];
        pieces.extend(at_node.iter().map(|(_, piece)| *piece));
        for (k, &one) in pieces.iter().enumerate() {
            pairs.extend(pieces[k + 1..].iter().map(|&other| ([one.min(other), one.max(other)], node)));
        }
    }
    pairs
}

/// Joins pieces that share nodes which do not lie on one axis. Returns whether there were any.
fn join_rigid<const D: usize>(mesh: &Mesh<D>, hinges: &[([u32; 2], u32)], rigid: &mut DisjointSets) -> bool {
    let mut shared: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
    for &([one, other], node) in hinges {
        let (one, other) = (rigid.find(one), rigid.find(other));
        if one != other {
            shared.entry([one.min(other), one.max(other)]).or_default().push(node);
        }
    }
    let mut any = false;
    for ([one, other], nodes) in shared {
        if spans(mesh, &nodes) {
            any |= rigid.join(one, other);
        }
    }
    any
}

/// Whether bodies that share these nodes cannot move against each other: two nodes in the plane,
/// and in space three that are not collinear.
fn spans<const D: usize>(mesh: &Mesh<D>, nodes: &[u32]) -> bool {
    /// Sine below which two directions are parallel.
    const FLAT: f64 = 1e-6;
    let origin = Vector::from(mesh.points[nodes[0] as usize]);
    let arms = || nodes.iter().map(|&node| Vector::from(mesh.points[node as usize]) - origin);
    let longest = arms().max_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap_or(Vector::zeros());
    let length = longest.norm();
    if length == 0.0 || D == 2 {
        return length > 0.0;
    }
    let axis = longest / length;
    arms().any(|arm| (arm - axis * arm.dot(&axis)).norm() > FLAT * length)
}

/// Requires that each curved element can be integrated: its Jacobian determinant is positive at its
/// integration points.
///
/// # Errors
/// An element cannot be integrated. The error gives the location of the first one.
pub(super) fn require_sound_curves<const D: usize>(mesh: &Mesh<D>, source: &MeshOrigin) -> Result<()> {
    let curved = (0..mesh.element_count()).filter(|&element| !is_straight(mesh, element));
    let mut tables: [Option<Vec<Vec<f64>>>; ElementKind::ALL.len()] =
        [const { None }; ElementKind::ALL.len()];
    for element in curved {
        let kind = mesh.kinds[element];
        let nodes = mesh.element_nodes(element);
        for slopes in &*tables[kind as usize].get_or_insert_with(|| slopes(kind)) {
            // Row k is the derivative of the position along the reference axis k.
            let mut map = [[0.0; D]; D];
            for (&node, slope) in nodes.iter().zip(slopes.chunks_exact(D)) {
                let place = mesh.points[node as usize];
                for k in 0..D {
                    (0..D).for_each(|i| map[k][i] += slope[k] * place[i]);
                }
            }
            let det = normalised_determinant(map);
            if det.is_nan() || det <= FLAT_CURVE {
                let message = format!(
                    "is inverted or flat inside, although its corners are valid: its Jacobian determinant at an integration point \
                     is {det:.1e} of the product of the lengths of its columns"
                );
                let cure = "nodes on its sides lie too far from the middle: refine the mesh where the body is curved, or set \
                            `Mesh.HighOrderOptimize = 2;` in Gmsh";
                return Err(source.at_element(mesh, element, &message).hint(cure));
            }
        }
    }
    Ok(())
}

/// The determinant of a matrix whose rows are normalized; 0 if a row is zero.
fn normalised_determinant<const D: usize>(mut map: [[f64; D]; D]) -> f64 {
    for row in &mut map {
        let length = row.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length > 0.0 {
            row.iter_mut().for_each(|x| *x /= length);
        }
    }
    dot(&map[0], &cofactor(&map)[0])
}

/// Gradients of the shape functions of a kind at all its integration points.
fn slopes(kind: ElementKind) -> Vec<Vec<f64>> {
    let element = reference(kind);
    let at = |xi: &[f64; 3]| {
        let mut slopes = vec![0.0; kind.nodes() * kind.dimension()];
        element.gradient(xi, &mut slopes);
        slopes
    };
    element.full_rule().points.iter().chain(&element.reduced_rule().points).map(at).collect()
}

/// An element is flat if its Jacobian determinant, divided by the product of the lengths of its
/// columns, does not exceed this value.
const FLAT_CURVE: f64 = 1e-12;

/// Whether the corners determine the shape of an element: its other nodes are the midpoints of
/// straight sides, and a hexahedron is a parallelepiped.
fn is_straight<const D: usize>(mesh: &Mesh<D>, element: usize) -> bool {
    let kind = mesh.kinds[element];
    let nodes = mesh.element_nodes(element);
    let at = |local: u8| Vector::<D>::from(mesh.points[nodes[local as usize] as usize]);
    let size = (at(1) - at(0)).norm();
    let parents = kind.parents().iter().zip(0u8..).skip(kind.corners());
    let even = parents.into_iter().all(|(parents, local)| {
        let middle = parents.iter().map(|&corner| at(corner)).sum::<Vector<D>>() / parents.len() as f64;
        (at(local) - middle).norm() <= STRAIGHT * size
    });
    let parallel = || {
        let edges =
            [(1, 0), (2, 3), (5, 4), (6, 7), (3, 0), (2, 1), (7, 4), (6, 5), (4, 0), (5, 1), (6, 2), (7, 3)];
        let edge = |k: usize| at(edges[k].0) - at(edges[k].1);
        (0..12).all(|k| (edge(k) - edge(k / 4 * 4)).norm() <= STRAIGHT * size)
    };
    even && (D == 2 || kind.corners() != 8 || parallel())
}

fn sorted(nodes: &[u32]) -> Vec<u32> {
    let mut nodes = nodes.to_vec();
    nodes.sort_unstable();
    nodes
}

fn distance<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    (0..D).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests;
