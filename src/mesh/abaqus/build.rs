//! Conversion of the content of a file to a checked mesh: elements, selected region, surfaces.

use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap};

use super::content::{Content, FaceKind, LEFT_OUT, SetMember, SolidElement, SurfaceLine};
use super::lines::Deck;
use super::names::{Names, Scope};
use super::sets::{self, SetMembers};
use super::types;
use crate::error::{Error, Result, shown};
use crate::mesh::compact::GONE;
use crate::mesh::source::{Label, Labels};
use crate::mesh::spelling::coordinates;
use crate::mesh::{Facet, FacetIndex, Mesh, validate};

/// Tolerance of the distance from the plane z = 0 in a plane mesh, relative to the size of the
/// mesh.
const PLANE: f64 = 1e-8;

/// The checked mesh in `D` dimensions, the locations of its nodes and elements, and remarks.
pub(super) fn mesh<const D: usize>(
    deck: &Deck,
    content: &Content,
    region: Option<&str>,
) -> Result<(Mesh<D>, Labels, Vec<String>)> {
    if content.solids.is_empty() {
        let message = format!("the mesh has no solid elements of dimension {D}");
        let types = format!("types that are read: {}, with variants", types::known());
        return Err(deck.segments.error_in_file(&message).hint(&types));
    }
    let members = sets::resolve(deck, content)?;
    let chosen = region.map(|region| choose(deck, content, &members, region)).transpose()?;
    let Solids { mut mesh, origin, number } = solids(deck, content, chosen)?;
    let index = FacetIndex::new(&mesh);
    check_sides(deck, content, &origin, &index)?;
    check_plane(deck, content, &mesh)?;
    check_shape(deck, content, &mesh, &origin)?;

    let mut found = Sets::default();
    for (name, elements) in content.element_sets.list.iter().zip(&members.elements) {
        if !name.is_internal {
            let of_mesh = elements.iter().map(|&solid| number[solid as usize]).filter(|&e| e != GONE);
            found.elements.insert((name.name.clone(), name.scope), of_mesh.collect());
        }
    }
    for (name, nodes) in content.node_sets.list.iter().zip(&members.nodes) {
        if !name.is_internal {
            found.points.insert((name.name.clone(), name.scope), nodes.clone());
        }
    }
    let surfaces = Surfaces { deck, content, members: &members, number: &number, index: &index };
    surfaces.read(&mesh, &mut found)?;
    let renumbered = mesh.drop_unused_points();
    for nodes in found.points.values_mut() {
        nodes.iter_mut().for_each(|node| *node = renumbered[*node as usize]);
        nodes.retain(|&node| node != GONE);
    }
    let renamed = found.publish(&mut mesh, content.instance());

    let dropped = renumbered.iter().filter(|new| **new == GONE).count();
    let mut remarks = left_out(content, if region.is_none() { dropped } else { 0 });
    remarks.extend(renamed);
    let kept = renumbered.iter().enumerate().filter(|(_, new)| **new != GONE);
    let nodes = kept
        .map(|(old, _)| Label { id: content.nodes.ids()[old], place: content.node_places[old] })
        .collect();
    let elements = origin.iter().map(|&solid| &content.solids[solid as usize]);
    let elements = elements.map(|solid| Label { id: solid.id, place: solid.place }).collect();
    Ok((mesh, Labels { nodes, elements }, remarks))
}

impl Content {
    /// Indices of the nodes of an element, in the order of its kind.
    pub(super) fn nodes_of(&self, deck: &Deck, solid: &SolidElement) -> Result<Vec<u32>> {
        let ids = &self.element_nodes[solid.first..solid.first + solid.kind.nodes()];
        let mut nodes = Vec::with_capacity(ids.len());
        for &id in ids {
            let Some(node) = self.nodes.index(id) else {
                let message = format!("uses node {id}, which is not defined");
                return Err(error_at(deck, solid, &message).hint("write the input again: nodes are missing"));
            };
            if nodes.contains(&node) {
                let cure = "elements whose nodes coincide are not read; use elements of another shape there";
                return Err(error_at(deck, solid, &format!("uses node {id} twice")).hint(cure));
            }
            nodes.push(node);
        }
        Ok(nodes)
    }
}

fn error_at(deck: &Deck, solid: &SolidElement, message: &str) -> Error {
    deck.error_at(solid.place, format!("element {} ({}) {message}", solid.id, solid.kind))
}

/// Which solid elements belong to the region.
fn choose(deck: &Deck, content: &Content, members: &SetMembers, region: &str) -> Result<Vec<bool>> {
    let found = content.element_sets.find(region, Scope::Assembly, content.instance());
    let elements = found.map(|set| &members.elements[set as usize]).filter(|elements| !elements.is_empty());
    let Some(elements) = elements else {
        let sets = content.element_sets.list.iter().zip(&members.elements);
        let sets = sets.filter(|(name, elements)| !name.is_internal && !elements.is_empty());
        let known: Vec<&str> = sets.map(|(name, _)| name.name.as_str()).collect();
        let hint = match known.is_empty() {
            true => "the mesh has no element sets".to_owned(),
            false => format!("known regions (element sets): {}", known.join(", ")),
        };
        let message = match found {
            Some(_) => format!("region '{region}' has no solid elements"),
            None => format!("the mesh has no element set '{region}'"),
        };
        return Err(deck.segments.error_in_file(&message).hint(&hint));
    };
    let mut kept = vec![false; content.solids.len()];
    elements.iter().for_each(|&solid| kept[solid as usize] = true);
    Ok(kept)
}

/// The elements of the mesh.
struct Solids<const D: usize> {
    mesh: Mesh<D>,
    /// Index of each element in [`Content::solids`].
    origin: Vec<u32>,
    /// Number of each solid in the mesh, or `GONE`.
    number: Vec<u32>,
}

fn solids<const D: usize>(deck: &Deck, content: &Content, kept: Option<Vec<bool>>) -> Result<Solids<D>> {
    let mut mesh = Mesh::with_points(content.points.iter().map(|x| std::array::from_fn(|k| x[k])).collect());
    let mut origin: Vec<u32> = Vec::new();
    let mut number = vec![GONE; content.solids.len()];
    let mut known: HashMap<[u32; 8], u32> = HashMap::with_capacity(content.solids.len());
    for (index, solid) in (0u32..).zip(&content.solids) {
        let nodes = content.nodes_of(deck, solid)?;
        if kept.as_ref().is_some_and(|kept| !kept[index as usize]) {
            continue;
        }
        let mut corners = [u32::MAX; 8];
        corners[..solid.kind.corners()].copy_from_slice(&nodes[..solid.kind.corners()]);
        corners.sort_unstable();
        match known.entry(corners) {
            Entry::Vacant(place) => place.insert(index),
            Entry::Occupied(place) => {
                let before = &content.solids[*place.get() as usize];
                let message = format!("has the same corners as element {}", before.id);
                return Err(error_at(deck, solid, &message).hint("remove one of the two"));
            }
        };
        number[index as usize] = mesh.push(solid.kind, nodes);
        origin.push(index);
    }
    Ok(Solids { mesh, origin, number })
}

/// Checks that no side has three elements.
fn check_sides(deck: &Deck, content: &Content, origin: &[u32], index: &FacetIndex) -> Result<()> {
    let Some(crowd) = index.overcrowded().next() else { return Ok(()) };
    let solids = crowd.iter().map(|facet| &content.solids[origin[facet.element as usize] as usize]);
    let ids: Vec<String> = solids.clone().map(|solid| solid.id.to_string()).collect();
    let Some(last) = solids.clone().next_back() else { return Ok(()) };
    let message = format!("shares one side with two or more others: {}", ids.join(", "));
    let cure = "give bodies that overlap or share a face sets of their own, and choose one by `region`";
    Err(error_at(deck, last, &message).hint(cure))
}

fn check_plane<const D: usize>(deck: &Deck, content: &Content, mesh: &Mesh<D>) -> Result<()> {
    if D == 3 {
        return Ok(());
    }
    let used = || mesh.nodes.iter().map(|&node| node as usize);
    let size = used().flat_map(|node| content.points[node]).fold(0.0, |size: f64, x| size.max(x.abs()));
    let Some(node) = used().find(|&node| content.points[node][2].abs() > PLANE * size) else { return Ok(()) };
    let place = coordinates(&content.points[node]);
    let id = content.nodes.ids()[node];
    let message = format!("node {id} at {place} is out of the plane: |z| > {:e}", PLANE * size);
    let cure = "a case of dimension 2 needs a mesh in the plane z = 0";
    Err(deck.error_at(content.node_places[node], message).hint(cure))
}

/// Checks that no element is inverted or flat.
fn check_shape<const D: usize>(deck: &Deck, content: &Content, mesh: &Mesh<D>, origin: &[u32]) -> Result<()> {
    let Some(bad) = validate::first_bad_element(mesh) else { return Ok(()) };
    let solid = &content.solids[origin[bad.element] as usize];
    if bad.reversed {
        let centre = coordinates(&mesh.element_centre(bad.element));
        let message = format!("at {centre} is inverted at every corner");
        return Err(error_at(deck, solid, &message).hint("list its nodes in the opposite orientation"));
    }
    let id = content.nodes.ids()[bad.node as usize];
    let place = coordinates(&mesh.points[bad.node as usize]);
    let kind = if bad.sine < -validate::FLAT { "inverted" } else { "flat" };
    let message = format!("is {kind} at its node {id} at {place} (sine {:.1e})", bad.sine);
    Err(error_at(deck, solid, &message).hint("mesh again, with smaller or more regular elements there"))
}

/// A name, and where it is defined.
type ScopedName = (String, Scope);

/// Sets before their names are made unique.
#[derive(Default)]
struct Sets {
    facets: BTreeMap<ScopedName, Vec<Facet>>,
    /// Surfaces that consist of nodes.
    surface_points: BTreeMap<ScopedName, Vec<u32>>,
    points: BTreeMap<ScopedName, Vec<u32>>,
    elements: BTreeMap<ScopedName, Vec<u32>>,
}

impl Sets {
    /// Adds the sets that have members to the mesh under unique names. A surface comes before a
    /// node set, and this before an element set; what is defined in the assembly comes before what
    /// is defined in a part.
    fn publish<const D: usize>(self, mesh: &mut Mesh<D>, instance: Option<&str>) -> Option<String> {
        // A surface of nodes often has the name of the set that it consists of.
        let Self { facets, surface_points, mut points, elements } = self;
        points.retain(|name, nodes| surface_points.get(name) != Some(nodes));
        let instance = instance.unwrap_or("part");
        let mut names = Unique { instance, taken: BTreeMap::new(), renamed: Vec::new() };
        for scope in [Scope::Assembly, Scope::Part] {
            for (name, facets) in of_scope(&facets, scope) {
                mesh.facet_sets.insert(names.of(name, scope, Meaning::Surface), facets.clone());
            }
            for (name, nodes) in of_scope(&surface_points, scope) {
                mesh.point_sets.insert(names.of(name, scope, Meaning::Surface), nodes.clone());
            }
            for (name, nodes) in of_scope(&points, scope) {
                mesh.point_sets.insert(names.of(name, scope, Meaning::Nodes), nodes.clone());
            }
            for (name, members) in of_scope(&elements, scope) {
                mesh.element_sets.insert(names.of(name, scope, Meaning::Elements), members.clone());
            }
        }
        let renamed = !names.renamed.is_empty();
        renamed.then(|| format!("mesh: sets whose name another set has: {}", list(&names.renamed)))
    }
}

/// The sets of one scope that have members.
fn of_scope<T>(
    sets: &BTreeMap<ScopedName, Vec<T>>,
    scope: Scope,
) -> impl Iterator<Item = (&String, &Vec<T>)> {
    let of_scope = sets.iter().filter(move |((_, at), set)| *at == scope && !set.is_empty());
    of_scope.map(|((name, _), set)| (name, set))
}

/// At most twelve names, for a remark.
fn list(names: &[String]) -> String {
    const MOST: usize = 12;
    let more = names.len().saturating_sub(MOST);
    let text = names[..names.len() - more].join(", ");
    if more > 0 { format!("{text} and {more} more") } else { text }
}

/// Names that differ from each other.
struct Unique<'a> {
    instance: &'a str,
    /// What each name means.
    taken: BTreeMap<String, Meaning>,
    /// Sets that have other names here than in the file.
    renamed: Vec<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Meaning {
    Surface,
    Nodes,
    Elements,
}

impl Unique<'_> {
    fn of(&mut self, name: &str, scope: Scope, meaning: Meaning) -> String {
        let mut unique = name.to_owned();
        if let Some(&other) = self.taken.get(name) {
            if other == meaning && scope == Scope::Part {
                unique = format!("{}.{name}", self.instance);
            }
            let (what, suffix) = match meaning {
                Meaning::Surface => ("surface", "_surface"),
                Meaning::Nodes => ("node set", "_nodes"),
                Meaning::Elements => ("element set", "_elements"),
            };
            while self.taken.contains_key(&unique) {
                unique.push_str(suffix);
            }
            self.renamed.push(format!("the {what} '{}' is '{}'", shown(name), shown(&unique)));
        }
        self.taken.insert(unique.clone(), meaning);
        unique
    }
}

/// What the surfaces of a file refer to.
struct Surfaces<'a> {
    deck: &'a Deck,
    content: &'a Content,
    members: &'a SetMembers,
    /// Number of each solid in the mesh, or `GONE`.
    number: &'a [u32],
    index: &'a FacetIndex,
}

impl Surfaces<'_> {
    fn read<const D: usize>(&self, mesh: &Mesh<D>, found: &mut Sets) -> Result<()> {
        let mut boundary = None;
        for face in &self.content.faces {
            let name = &self.content.surfaces.list[face.surface as usize];
            let name = (name.name.clone(), name.scope);
            if face.kind == FaceKind::Nodes {
                let nodes = self.nodes(face)?;
                found.surface_points.entry(name).or_default().extend(nodes);
                continue;
            }
            let elements = self.elements(face)?;
            let facets = found.facets.entry(name).or_default();
            match face.kind {
                FaceKind::Number(number) => {
                    for element in elements {
                        facets.push(self.facet(mesh, face, element, number)?);
                    }
                }
                _ => {
                    let boundary: &Vec<Facet> = boundary.get_or_insert_with(|| self.index.boundary());
                    for element in elements {
                        let begin = boundary.partition_point(|facet| facet.element < element);
                        let own = boundary[begin..].iter().take_while(|facet| facet.element == element);
                        facets.extend(own);
                    }
                }
            }
        }
        for facets in found.facets.values_mut() {
            facets.sort_unstable();
            facets.dedup();
        }
        for nodes in found.surface_points.values_mut() {
            nodes.sort_unstable();
            nodes.dedup();
        }
        Ok(())
    }

    fn member(
        &self,
        face: &SurfaceLine,
        sets: &Names,
        number: Option<u32>,
        what: &str,
    ) -> Result<Option<u32>> {
        match &face.member {
            SetMember::Number(id) => match number {
                Some(_) => Ok(None),
                None => {
                    let message = format!("the surface contains {what} {id}, which is not defined");
                    Err(self.deck.error_at(face.place, message).hint("write the input again"))
                }
            },
            SetMember::Set(name) => match sets.find(name, face.scope, self.content.instance()) {
                Some(set) => Ok(Some(set)),
                None => {
                    let message = format!("there is no {what} set '{}'", shown(name));
                    Err(self.deck.error_at(face.place, message).hint(&sets.cure()))
                }
            },
        }
    }

    fn nodes(&self, face: &SurfaceLine) -> Result<Vec<u32>> {
        let number = match face.member {
            SetMember::Number(id) => self.content.nodes.index(id),
            SetMember::Set(_) => None,
        };
        let set = self.member(face, &self.content.node_sets, number, "node")?;
        Ok(match (set, number) {
            (Some(set), _) => self.members.nodes[set as usize].clone(),
            (None, number) => number.into_iter().collect(),
        })
    }

    /// The elements of the mesh in a line of a surface, in ascending order.
    fn elements(&self, face: &SurfaceLine) -> Result<Vec<u32>> {
        let number = match face.member {
            SetMember::Number(id) => self.content.elements.index(id),
            SetMember::Set(_) => None,
        };
        let set = self.member(face, &self.content.element_sets, number, "element")?;
        let of_mesh = |solid: u32| match solid {
            LEFT_OUT => GONE,
            solid => self.number[solid as usize],
        };
        let elements: Vec<u32> = match (set, number) {
            (Some(set), _) => {
                self.members.elements[set as usize].iter().map(|&solid| of_mesh(solid)).collect()
            }
            (None, number) => {
                number.iter().map(|&element| of_mesh(self.content.solid[element as usize])).collect()
            }
        };
        Ok(elements.into_iter().filter(|&element| element != GONE).collect())
    }

    /// A face of an element by its number.
    fn facet<const D: usize>(
        &self,
        mesh: &Mesh<D>,
        face: &SurfaceLine,
        element: u32,
        number: usize,
    ) -> Result<Facet> {
        let kind = mesh.kinds[element as usize];
        let error = |message: String| {
            let name = &self.content.surfaces.list[face.surface as usize].name;
            self.deck.error_at(face.place, format!("surface '{}': {message}", shown(name)))
        };
        let Some(side) = types::side(kind, number) else {
            let sides = kind.sides().len();
            return Err(error(format!("face S{number} of a {kind} element, which has {sides} faces")));
        };
        let facet = Facet { element, side };
        if self.index.find(mesh.facet_corners(facet)).nth(1).is_some() {
            let centre = coordinates(&mesh.element_centre(element as usize));
            let message =
                format!("face S{number} of the element at {centre} is inside the mesh, between two elements");
            let cure =
                "a surface must be on the boundary of its body; choose a `region`, or remove the surface";
            return Err(error(message).hint(cure));
        }
        Ok(facet)
    }
}

/// Remarks on what is not part of the mesh.
fn left_out(content: &Content, dropped: usize) -> Vec<String> {
    let mut remarks = Vec::new();
    let variants = content.variants.iter().map(|(name, kind)| format!("{name} as {kind}"));
    if !content.variants.is_empty() {
        remarks.push(format!(
            "mesh: elements are read by their shape, {}; the case says how they are integrated (`locking`)",
            list(&variants.collect::<Vec<_>>())
        ));
    }
    if !content.left_out.is_empty() {
        let types = content.left_out.iter().map(|(name, count)| format!("{count} {}", shown(name)));
        remarks.push(format!(
            "mesh: elements that are not solid are left out: {}",
            list(&types.collect::<Vec<_>>())
        ));
    }
    if dropped > 0 {
        remarks.push(format!("mesh: {dropped} nodes belong to no solid element and are left out"));
    }
    if !content.skipped.is_empty() {
        let names = content.skipped.iter().map(|name| format!("*{}", shown(name)));
        remarks.push(format!("mesh: only the mesh is read; skipped: {}", list(&names.collect::<Vec<_>>())));
    }
    remarks
}
