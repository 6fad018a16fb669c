//! Whether the elements of a body fit together: neighbours share whole sides, parts that touch are joined, and which
//! parts move without strain.
//!
//! Nodes that are not joined lie on sides that only one element has, so that the surface is all that is searched.

use std::collections::{BTreeMap, BTreeSet};

use crate::contact::projection::Projection;
use crate::error::{Error, Result};
use crate::mesh::{Bounds, BoundsTree, DisjointSets, ElementKind, Facet, FacetIndex, Mesh, gmsh, spelled};
use crate::space::reference;
use crate::square::{cofactor, dot};
use crate::tensor::Vector;

/// Nodes and sides that are closer than this part of the shortest edge of the elements around them touch.
///
/// Gmsh writes 16 digits, and other programs as few as seven: with elements of a thousandth of the body seven digits leave
/// 1e-4. Half of it would pass meshes with six digits; at ten times as much narrow slits between coarse elements are refused.
const TOUCH: f64 = 1e-4;

/// A void between four triangles is a slit where diagonals do not agree if it is flatter than this part of its edges. Elements that
/// were left out on purpose are as thick as long.
const SLIT: f64 = 0.2;

/// A body whose parts hinge on nodes may have this many of them: their motions are found by dense algebra.
const MOST_HINGED: usize = 64;

/// Midside nodes that are closer than this part of an element's size to the middle leave its sides straight.
const STRAIGHT: f64 = 1e-9;

/// Where a mesh comes from.
pub(super) enum Source<'a> {
    /// A box of the case: its body, and the unit of length.
    Box(&'a str, &'a str),
    /// A file.
    File(&'a gmsh::Source),
}

impl Source<'_> {
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
                let (kind, place) = (mesh.kinds[element], spelled(&mesh.element_centre(element)));
                Error::case(format!("body '{body}': the {kind} element at {place} {m} {message}"))
            }
        }
    }

    /// How messages call a second node.
    fn node<const D: usize>(&self, mesh: &Mesh<D>, node: u32) -> String {
        match self {
            Self::File(source) => format!("node {}", source.node(node)),
            Self::Box(..) => format!("another node at {}", spelled(&mesh.points[node as usize])),
        }
    }

    /// How messages call a second element.
    fn element<const D: usize>(&self, mesh: &Mesh<D>, element: u32) -> String {
        match self {
            Self::File(source) => format!("element {}", source.element(element as usize)),
            Self::Box(..) => format!("the element at {}", spelled(&mesh.element_centre(element as usize))),
        }
    }
}

/// What to do with parts of a body that touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Parts {
    /// They must be joined.
    Joined,
    /// Nodes up to this distance \[m\] are joined; then all must be joined.
    Merged(f64),
    /// They are meant to be apart.
    Apart,
}

/// Checks a body's mesh, joins its nodes where `parts` says so, and finds its pieces. `meets` are the pairs of sets between
/// which a contact acts: what touches there is not joined on purpose. The body has a `name`, lengths are in `m`. Returns what
/// a user should know.
///
/// # Errors
/// Sides that do not match or are not joined, with their place.
pub(super) fn conform<const D: usize>(
    mesh: &mut Mesh<D>,
    (name, m): (&str, &str),
    source: &Source,
    parts: Parts,
    meets: &[(String, String)],
) -> Result<Vec<String>> {
    let mut remarks = Vec::new();
    if let Parts::Merged(tolerance) = parts {
        let joined = merge_nodes(mesh, (tolerance, m), source)?;
        remarks.push(match joined {
            0 => format!("merge: no two nodes of '{name}' are closer than {tolerance:.1e} {m}"),
            _ => {
                format!(
                    "merge: {joined} nodes of '{name}' were joined with others within {tolerance:.1e} {m}"
                )
            }
        });
    }
    let mut index = FacetIndex::new(mesh);
    if let Parts::Merged(_) = parts {
        require_two_sides(mesh, &index, source)?;
        remarks.extend(drop_inner_facets(mesh, &index, name));
    }
    require_equal_orders(mesh, &index, source)?;
    let boundary = index.boundary();
    if parts != Parts::Apart {
        require_joined(mesh, &boundary, source, meets)?;
    }
    remarks.extend(find_pieces(mesh, &mut index, (name, m), source)?);
    Ok(remarks)
}

/// Joins nodes that are closer than `tolerance` \[m\]; returns how many there are less. The nodes that go lose their elements.
fn merge_nodes<const D: usize>(
    mesh: &mut Mesh<D>,
    (tolerance, m): (f64, &str),
    source: &Source,
) -> Result<usize> {
    let mut nodes = Vec::new();
    let mut surface = Vec::new();
    for facet in FacetIndex::new(mesh).boundary() {
        mesh.facet_nodes(facet, &mut nodes);
        surface.extend_from_slice(&nodes);
    }
    surface.sort_unstable();
    surface.dedup();
    let at = |node: u32| mesh.points[node as usize];
    let boxes: Vec<Bounds<D>> = surface.iter().map(|&node| Bounds::of([at(node)])).collect();
    let tree = BoundsTree::new(&boxes);
    let mut sets = DisjointSets::new(mesh.points.len());
    let mut joined = 0;
    for (&node, around) in surface.iter().zip(&boxes) {
        for other in tree.meeting(&around.inflate(tolerance)) {
            let other = surface[other as usize];
            if other != node && distance(&at(node), &at(other)) <= tolerance && sets.join(node, other) {
                joined += 1;
            }
        }
    }
    if joined == 0 {
        return Ok(0);
    }
    for element in 0..mesh.element_count() {
        let mut own: Vec<u32> = mesh.element_nodes(element).iter().map(|&node| sets.find(node)).collect();
        let count = own.len();
        own.sort_unstable();
        own.dedup();
        if own.len() < count {
            let message = format!("has two nodes within merge.tolerance, {tolerance:.1e} {m}");
            let cure = "give a tolerance well below the shortest side of an element";
            return Err(source.at_element(mesh, element, &message).hint(cure));
        }
    }
    mesh.nodes.iter_mut().for_each(|node| *node = sets.find(*node));
    for members in mesh.point_sets.values_mut() {
        members.iter_mut().for_each(|node| *node = sets.find(*node));
        members.sort_unstable();
        members.dedup();
    }
    Ok(joined)
}

/// After nodes were joined no side may have three elements.
fn require_two_sides<const D: usize>(mesh: &Mesh<D>, index: &FacetIndex, source: &Source) -> Result<()> {
    let Some(crowd) = index.overcrowded().next() else { return Ok(()) };
    let others: Vec<String> = crowd[1..].iter().map(|side| source.element(mesh, side.element)).collect();
    let message =
        format!("shares one side with two or more others once nodes are merged: {}", others.join(", "));
    Err(source
        .at_element(mesh, crowd[0].element as usize, &message)
        .hint("elements lie on each other there: remove one of them, or give a smaller merge.tolerance"))
}

/// Sides that lie inside since nodes were joined leave their sets.
fn drop_inner_facets<const D: usize>(mesh: &mut Mesh<D>, index: &FacetIndex, name: &str) -> Vec<String> {
    let mut remarks = Vec::new();
    let mut sets = std::mem::take(&mut mesh.facet_sets);
    for (set, facets) in &mut sets {
        let before = facets.len();
        facets.retain(|&facet| index.find(mesh.facet_corners(facet)).count() == 1);
        let inner = before - facets.len();
        if inner > 0 {
            remarks.push(format!(
                "merge: {inner} of the {before} sides in the set '{name}.{set}' lie inside the body now, and are not in it any more"
            ));
        }
    }
    sets.retain(|_, facets| !facets.is_empty());
    mesh.facet_sets = sets;
    remarks
}

/// Two elements that share the corners of a side share all its nodes.
fn require_equal_orders<const D: usize>(mesh: &Mesh<D>, index: &FacetIndex, source: &Source) -> Result<()> {
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
            let cure = "mesh the body with elements of one order; in Gmsh `-order 1` or `-order 2`, and the same \
                        `Mesh.SecondOrderIncomplete` for all of it";
            return Err(source.at_element(mesh, one.element as usize, &message).hint(cure));
        }
    }
    Ok(())
}

/// How two parts of a surface touch without being joined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Touch {
    /// Two nodes coincide.
    Nodes(u32, u32),
    /// A node lies inside a side that does not have it.
    Hanging(u32, Facet),
    /// Two sides lie on each other.
    Sides(Facet, Facet),
}

/// The surface of a body as touching is looked for.
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
        let (mut starts, mut nodes, mut sizes) = (vec![0], Vec::new(), Vec::new());
        let mut boxes = Vec::with_capacity(facets.len());
        let mut own = Vec::new();
        for &facet in facets {
            mesh.facet_nodes(facet, &mut own);
            let at = |node: u32| mesh.points[node as usize];
            // Across the element as well: thin ones have close sides.
            let element = facet.element as usize;
            let corners = &mesh.element_nodes(element)[..mesh.kinds[element].corners()];
            let pairs =
                corners.iter().enumerate().flat_map(|(k, &a)| corners[k + 1..].iter().map(move |&b| (a, b)));
            let size = pairs.map(|(a, b)| distance(&at(a), &at(b))).fold(f64::INFINITY, f64::min);
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

    /// How far a place is from a facet \[m\].
    fn distance(&self, place: &[f64; D], facet: usize) -> f64 {
        let kind = self.mesh.facet_kind(self.facets[facet]);
        Projection::of(&Vector::from(*place), kind, &self.points_of(facet)).distance
    }

    /// Nodes that lie on sides which do not have them.
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

    /// Sides in space that have the same corners and do not match, however they are warped: a triangle on a quadrilateral, and two
    /// triangles on two with the other diagonal.
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

    /// Whether two triangles with a common edge and two on the other diagonal of their four corners enclose a flat void.
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
        // Height of the fourth corner over the plane of the first three.
        let along = a * (1.0 / a.norm());
        let across = b - along * along.dot(&b);
        let across = across * (1.0 / across.norm());
        let c = edge(3);
        let height = (c - along * along.dot(&c) - across * across.dot(&c)).norm();
        height < SLIT * a.norm().min(b.norm())
    }

    /// Sides whose middles lie on other sides.
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

/// No two parts of the surface touch, except those between which a contact acts.
fn require_joined<const D: usize>(
    mesh: &Mesh<D>,
    boundary: &[Facet],
    source: &Source,
    meets: &[(String, String)],
) -> Result<()> {
    let surface = Surface::new(mesh, boundary);
    let sides = Sides::new(mesh, meets);
    let mut found = surface.touching_nodes();
    found.retain(|touch| !sides.meet(mesh, touch));
    if found.is_empty() {
        found = surface.touching_sides();
        found.retain(|touch| !sides.meet(mesh, touch));
    }
    // The first by kind and number: files are looked through from their begin.
    found.sort_unstable();
    found.dedup();
    let Some(&first) = found.first() else { return Ok(()) };
    Err(refusal(mesh, source, first, found.len()))
}

fn refusal<const D: usize>(mesh: &Mesh<D>, source: &Source, first: Touch, count: usize) -> Error {
    let apart = "faces that shall be apart, as those of a crack, need `merge: never`";
    let places = |what: &str| match count {
        1 => String::new(),
        _ => format!(" ({count} such {what})"),
    };
    match first {
        Touch::Nodes(one, other) => {
            let tolerance = 10.0 * distance(&mesh.points[one as usize], &mesh.points[other as usize]);
            let least = 1e-9 * mesh.bounding_box().map_or(1.0, |(low, high)| distance(&low, &high));
            let message = format!(
                "and {} coincide, and no element joins them{}: the parts of the mesh on both sides are not joined",
                source.node(mesh, other),
                places("pairs")
            );
            let cure = match source {
                Source::File(_) => {
                    "join them by `Coherence;` in the geometry or `Coherence Mesh;` in Gmsh, or"
                }
                Source::Box(..) => "join them by",
            };
            let cure = format!("{cure} `merge: {{ tolerance: {:.0e} }}`; {apart}", tolerance.max(least));
            source.at_node(mesh, one, &message).hint(&cure)
        }
        Touch::Hanging(node, facet) => {
            let element = source.element(mesh, facet.element);
            let message = format!(
                "hangs: it lies inside a side of {element}, which does not have it{}: the meshes on both sides do not match",
                places("places")
            );
            let cure = format!(
                "mesh both sides with the same nodes; parts whose meshes do not match can be two bodies with a contact; {apart}"
            );
            source.at_node(mesh, node, &message).hint(&cure)
        }
        Touch::Sides(one, other) => {
            let element = source.element(mesh, other.element);
            let message = format!(
                "has a side that lies on a side of {element} with other corners{}: the elements on both sides do not match",
                places("places")
            );
            let cure = format!(
                "a quadrilateral side needs a quadrilateral one beside it, and diagonals must agree: mesh both parts anew \
                 with elements of one shape; {apart}"
            );
            source.at_element(mesh, one.element as usize, &message).hint(&cure)
        }
    }
}

/// Nodes of the two sides of each contact of the body with itself.
struct Sides(Vec<[Vec<u32>; 2]>);

impl Sides {
    fn new<const D: usize>(mesh: &Mesh<D>, meets: &[(String, String)]) -> Self {
        let nodes = |set: &str| mesh.set_nodes(set).unwrap_or_default();
        Self(meets.iter().map(|(one, other)| [nodes(one), nodes(other)]).collect())
    }

    /// Whether a contact acts where this is.
    fn meet<const D: usize>(&self, mesh: &Mesh<D>, touch: &Touch) -> bool {
        let of = |facet: Facet| {
            let mut nodes = Vec::new();
            mesh.facet_nodes(facet, &mut nodes);
            nodes
        };
        let (one, other) = match *touch {
            Touch::Nodes(one, other) => (vec![one], vec![other]),
            Touch::Hanging(node, facet) => (vec![node], of(facet)),
            Touch::Sides(one, other) => (of(one), of(other)),
        };
        let has = |set: &[u32], nodes: &[u32]| nodes.iter().all(|node| set.binary_search(node).is_ok());
        self.0.iter().any(|[a, b]| has(a, &one) && has(b, &other) || has(b, &one) && has(a, &other))
    }
}

/// Numbers the pieces of the body; returns what a user should know where there is more than one.
///
/// # Errors
/// More pieces that hinge on nodes than can be dealt with.
fn find_pieces<const D: usize>(
    mesh: &mut Mesh<D>,
    index: &mut FacetIndex,
    (name, m): (&str, &str),
    source: &Source,
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
            let message =
                format!("is one of many that alone join {most} pieces of the mesh, each free to turn");
            return Err(source
                .at_node(mesh, node, &message)
                .hint("elements must share sides; a body has at most 64 pieces that hinge on nodes"));
        }
        remarks.push(format!(
            "pieces of '{name}' are joined at single nodes only, as at {} {m}: they turn about them without resistance",
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

/// Joins pieces that share nodes which do not lie on one axis; whether there were any.
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

/// Whether bodies that share these nodes can not move against each other: two nodes in the plane, in space three that do not
/// lie on one line.
fn spans<const D: usize>(mesh: &Mesh<D>, nodes: &[u32]) -> bool {
    /// Sine below which directions are one.
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

/// Whether each curved element can be integrated: its Jacobian is positive at its points of integration.
///
/// # Errors
/// The first that can not, with its place.
pub(super) fn require_sound_curves<const D: usize>(mesh: &Mesh<D>, source: &Source) -> Result<()> {
    let curved = (0..mesh.element_count()).filter(|&element| !is_straight(mesh, element));
    let mut tables: [Option<Vec<Vec<f64>>>; ElementKind::ALL.len()] =
        [const { None }; ElementKind::ALL.len()];
    for element in curved {
        let kind = mesh.kinds[element];
        let nodes = mesh.element_nodes(element);
        for slopes in &*tables[kind as usize].get_or_insert_with(|| slopes(kind)) {
            // Row k has the derivative of the place along the reference axis k.
            let mut map = [[0.0; D]; D];
            for (&node, slope) in nodes.iter().zip(slopes.chunks_exact(D)) {
                let place = mesh.points[node as usize];
                for k in 0..D {
                    (0..D).for_each(|i| map[k][i] += slope[k] * place[i]);
                }
            }
            let columns: f64 = map.iter().map(|row| row.iter().map(|x| x * x).sum::<f64>().sqrt()).product();
            let det = dot(&map[0], &cofactor(&map)[0]);
            if det.is_nan() || det <= FLAT_CURVE * columns {
                let message = format!(
                    "is inverted or flat inside, although its corners are good: its Jacobian at a point of integration is \
                     {:.1e} of what its sides would give",
                    det / columns
                );
                let cure = "nodes on its sides lie too far from the middle: mesh finer where the body is curved, or in Gmsh set \
                            `Mesh.HighOrderOptimize = 2;`";
                return Err(source.at_element(mesh, element, &message).hint(cure));
            }
        }
    }
    Ok(())
}

/// Gradients of the shape functions of a kind at all its points of integration.
fn slopes(kind: ElementKind) -> Vec<Vec<f64>> {
    let element = reference(kind);
    let at = |xi: &[f64; 3]| {
        let mut slopes = vec![0.0; kind.nodes() * kind.dimension()];
        element.gradient(xi, &mut slopes);
        slopes
    };
    element.full_rule().points.iter().chain(&element.reduced_rule().points).map(at).collect()
}

/// Jacobian over the product of its columns up to which an element is flat.
const FLAT_CURVE: f64 = 1e-12;

/// Whether corners tell all of an element: its other nodes lie where straight sides have them, and a hexahedron is
/// a parallelepiped.
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
