//! The sets that a case defines by the reference position, and lists of sets as one surface.

use std::collections::HashSet;

use crate::case::{self, At, BodySet, Case, Combination, Members, Named, Selection, SetNames};
use crate::error::{Error, Result};
use crate::mesh::{Facet, FacetIndex, Mesh, SetKind, spelled};

/// Adds the sets that the case defines for a body to its mesh, in the order of the file.
///
/// # Errors
/// A name is taken by the mesh, a set is empty, or a set that it combines is unknown or of another kind. The error gives the
/// location in the case.
pub fn define<const D: usize>(
    case: &Case,
    body: &str,
    sets: &Named<BodySet>,
    mesh: &mut Mesh<D>,
) -> Result<()> {
    if sets.is_empty() {
        return Ok(());
    }
    let surface = FacetIndex::new(mesh).boundary();
    let mut faults = Vec::new();
    // What is wrong with a set that combines faulty ones follows from them.
    let mut faulty = HashSet::new();
    for (name, set) in sets.iter() {
        if set.combined().any(|member| faulty.contains(member)) {
            faulty.insert(name.value.as_str());
            continue;
        }
        if kind_of(mesh, name).is_some() {
            let message = format!("the mesh of '{body}' already has a set '{}'", name.value);
            faults.push(case.error(name.place, message).hint("choose another name"));
            continue;
        }
        let fault = match members(case, body, set, mesh, &surface) {
            Ok(found) if found.is_empty() => nothing(case, body, name, set, mesh),
            Ok(found) => {
                found.insert(mesh, name.value.clone());
                continue;
            }
            Err(fault) => fault,
        };
        faults.push(fault);
        faulty.insert(name.value.as_str());
    }
    Error::together(faults)
}

/// Removes the sets of [`define`].
pub fn forget<const D: usize>(sets: &Named<BodySet>, mesh: &mut Mesh<D>) {
    for name in sets.names() {
        mesh.facet_sets.remove(name);
        mesh.point_sets.remove(name);
        mesh.element_sets.remove(name);
    }
}

/// Adds the union of each list of sets that the case uses, under the joined name of the list. Facets that two sets of a list
/// have in common occur once. A list of surfaces is a surface; any other list has the nodes of its bodies and sets.
pub fn join_lists<const D: usize>(case: &Case, mesh: &mut Mesh<D>) {
    let of_contacts = case.contact.values().flat_map(|contact| [&contact.contactor, &contact.target]);
    let of_ties = case.tied.values().flat_map(|tied| [&tied.contactor, &tied.target]);
    let lists = of_contacts.chain(of_ties).chain(case.boundary.values().map(|boundary| &boundary.on));
    for list in lists.filter(|list| list.is_list()) {
        let names = || list.names().iter().map(|name| name.value.as_str());
        let joined = if names().all(|name| mesh.facet_sets.contains_key(name)) {
            let facets = names().flat_map(|name| mesh.facet_sets[name].iter().copied());
            Found::Facets(facets.collect())
        } else {
            Found::Nodes(names().filter_map(|name| mesh.set_nodes(name)).flatten().collect())
        };
        joined.insert(mesh, list.value.clone());
    }
}

/// Members of a set.
enum Found {
    Facets(Vec<Facet>),
    Nodes(Vec<u32>),
    Elements(Vec<u32>),
}

impl Found {
    fn is_empty(&self) -> bool {
        match self {
            Self::Facets(facets) => facets.is_empty(),
            Self::Nodes(members) | Self::Elements(members) => members.is_empty(),
        }
    }

    fn insert<const D: usize>(self, mesh: &mut Mesh<D>, name: String) {
        match self {
            Self::Facets(facets) => drop(mesh.facet_sets.insert(name, sorted(facets))),
            Self::Nodes(nodes) => drop(mesh.point_sets.insert(name, sorted(nodes))),
            Self::Elements(elements) => drop(mesh.element_sets.insert(name, sorted(elements))),
        }
    }
}

fn sorted<T: Ord>(mut members: Vec<T>) -> Vec<T> {
    members.sort_unstable();
    members.dedup();
    members
}

fn kind_of<const D: usize>(mesh: &Mesh<D>, name: &str) -> Option<SetKind> {
    mesh.sets().into_iter().find(|(known, _)| *known == name).map(|(_, kind)| kind)
}

fn members<const D: usize>(
    case: &Case,
    body: &str,
    set: &BodySet,
    mesh: &Mesh<D>,
    surface: &[Facet],
) -> Result<Found> {
    if let Selection::Of(how, names) = &set.selection {
        return combined(case, body, *how, names, mesh);
    }
    let inside: Vec<bool> = mesh.points.iter().map(|point| contains(&set.selection, point)).collect();
    let is_inside = |node: &u32| inside[*node as usize];
    Ok(match set.members {
        Members::Facets => {
            let mut nodes = Vec::new();
            let mut fits = |facet: &Facet| {
                mesh.facet_nodes(*facet, &mut nodes);
                nodes.iter().all(is_inside)
            };
            Found::Facets(surface.iter().copied().filter(|facet| fits(facet)).collect())
        }
        Members::Nodes => Found::Nodes((0..mesh.points.len() as u32).filter(is_inside).collect()),
        Members::Elements => {
            let fits = |element: &u32| mesh.element_nodes(*element as usize).iter().all(is_inside);
            Found::Elements((0..mesh.element_count() as u32).filter(fits).collect())
        }
    })
}

/// Whether a region contains a point; boundaries belong to it. A combination of sets is no region.
fn contains<const D: usize>(region: &Selection, point: &[f64; D]) -> bool {
    match region {
        Selection::Where(condition) => {
            condition.holds(std::array::from_fn(|k| point.get(k).copied().unwrap_or(0.0)))
        }
        Selection::Box(region) => {
            let corners = region.min.iter().zip(region.max.iter());
            point.iter().zip(corners).all(|(x, (min, max))| (min.value..=max.value).contains(x))
        }
        Selection::Sphere(sphere) => {
            let squares =
                point.iter().zip(sphere.center.iter()).map(|(x, centre)| (x - centre.value).powi(2));
            squares.sum::<f64>().sqrt() <= sphere.radius.value
        }
        Selection::Of(..) => false,
    }
}

/// A union, difference or intersection of sets of one kind.
fn combined<const D: usize>(
    case: &Case,
    body: &str,
    how: Combination,
    names: &At<Vec<At<String>>>,
    mesh: &Mesh<D>,
) -> Result<Found> {
    let mut kind = None;
    for name in names.iter() {
        let Some(found) = kind_of(mesh, name) else {
            let message = format!("the body '{body}' has no set '{}' above this one", name.value);
            return Err(case.unknown(name, message, mesh.sets().iter().map(|(known, _)| *known)));
        };
        let first = *kind.get_or_insert(found);
        if first != found {
            let message =
                format!("'{}' has {}, but '{}' has {}", name.value, noun(found), names[0].value, noun(first));
            return Err(case.error(name.place, message).hint("combine sets of one kind"));
        }
    }
    let names = || names.iter().map(|name| name.value.as_str());
    Ok(match kind {
        Some(SetKind::Facets) => Found::Facets(combine(how, names().map(|name| &mesh.facet_sets[name]))),
        Some(SetKind::Points) => Found::Nodes(combine(how, names().map(|name| &mesh.point_sets[name]))),
        Some(SetKind::Elements) => {
            Found::Elements(combine(how, names().map(|name| &mesh.element_sets[name])))
        }
        None => Found::Nodes(Vec::new()),
    })
}

fn noun(kind: SetKind) -> &'static str {
    match kind {
        SetKind::Facets => "facets",
        SetKind::Points => "nodes",
        SetKind::Elements => "elements",
    }
}

fn combine<'a, T: Copy + Eq + std::hash::Hash + 'a>(
    how: Combination,
    mut sets: impl Iterator<Item = &'a Vec<T>>,
) -> Vec<T> {
    let mut members = sets.next().cloned().unwrap_or_default();
    for set in sets {
        let other: HashSet<&T> = set.iter().collect();
        match how {
            Combination::Union => members.extend(set),
            Combination::Difference => members.retain(|member| !other.contains(member)),
            Combination::Intersection => members.retain(|member| other.contains(member)),
        }
    }
    members
}

/// The error of a set without members: how far the body reaches, and how to find out why.
fn nothing<const D: usize>(
    case: &Case,
    body: &str,
    name: &At<String>,
    set: &BodySet,
    mesh: &Mesh<D>,
) -> Error {
    let message = format!("the set '{}' of '{body}' is empty", name.value);
    if matches!(set.selection, Selection::Of(..)) {
        let cure = "the sets have no members in common, or the difference is empty";
        return case.error(name.place, message).hint(cure);
    }
    let inside = mesh.points.iter().filter(|point| contains(&set.selection, point)).count();
    let m = case.units.of("m");
    let extent =
        mesh.bounding_box().map(|(low, high)| format!("{} to {} {m}", spelled(&low), spelled(&high)));
    let extent = extent.unwrap_or_default();
    let (what, cure) = match set.members {
        Members::Facets => (
            "no facet of the outer surface has all of its nodes in it",
            "give conditions such as `z < 1e-6` a tolerance, include a whole facet, or choose `of: nodes`",
        ),
        Members::Nodes => ("", "give conditions such as `z == 0` a tolerance: `z < 1e-6`"),
        Members::Elements => ("no element has all of its nodes in it", "include a whole element"),
    };
    let what = if inside == 0 || what.is_empty() { "" } else { what };
    let count = if inside == 0 {
        "no node is in it".to_owned()
    } else {
        format!("nodes in it: {inside}, but {what}")
    };
    case.error(name.place, format!("{message}: {count}; the body extends from {extent}")).hint(cure)
}

/// The bodies of a list of sets, each once.
pub fn bodies_of(case: &Case, names: &SetNames) -> Vec<usize> {
    if names.value == case::ALL {
        return (0..case.bodies.len()).collect();
    }
    sorted(names.bodies().filter_map(|name| case.bodies.position(name)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::read_mesh;

    const PLANE: &str = "dimension: 2\nbodies:\n  block:\n    mesh: { box: { min: [0, 0], max: [0.4, 0.2], cells: [4, 2], \
        element: ELEMENT } }\n    sets:\nSETS    material: { neo_hookean: { young_modulus: 1e6, poisson_ratio: 0.3 } }\n    \
        density: 1\nobstacles:\n  floor: { plane: { point: [0, 0], normal: [0, 1] } }\ncontact:\n  sole: { contactor: CONTACTOR, \
        target: floor }\nboundary:\n  clamp: { on: ON, displacement: { x: 0 } }\ntime: { end: 1, step: 1 }\n";

    /// The mesh with sets, one per line.
    fn mesh<const D: usize>(element: &str, sets: &[&str], contactor: &str, on: &str) -> Result<Mesh<D>> {
        let lines: String = sets.iter().map(|set| format!("      {set}\n")).collect();
        let text = PLANE.replace("SETS", &lines).replace("ELEMENT", element);
        let text = text.replace("CONTACTOR", contactor).replace("ON,", &format!("{on},"));
        let text = match D {
            3 => text
                .replace("dimension: 2", "dimension: 3")
                .replace("[0, 0]", "[0, 0, 0]")
                .replace("[0.4, 0.2]", "[0.4, 0.2, 0.2]")
                .replace("[4, 2]", "[4, 2, 2]")
                .replace("normal: [0, 1]", "normal: [0, 0, 1]"),
            _ => text,
        };
        read_mesh(&Case::parse(&text, "case.yml")?)
    }

    /// An expression of the position of a side selects the facets of that side, with every element.
    #[test]
    fn expressions_select_the_sides_of_a_box() {
        let sides = [
            "a: \"x < 1e-6\"",
            "b: \"x > 0.4 - 1e-6\"",
            "c: \"y < 1e-6\"",
            "d: \"0.2 - y < 1e-6 and x == x\"",
        ];
        let names = ["left", "right", "bottom", "top"];
        for element in ["quad4", "tri3", "quad8", "quad9", "tri6"] {
            let mesh = mesh::<2>(element, &sides, "block.c", "block.d").unwrap();
            for (set, side) in ["a", "b", "c", "d"].into_iter().zip(names) {
                let [set, side] = [set, side].map(|name| &mesh.facet_sets[&format!("block.{name}")]);
                assert_eq!(set, side, "{element}");
            }
        }
        let sides = [
            &sides[..2],
            &["c: \"z < 1e-6\"", "d: \"not z < 0.2 - 1e-6\"", "e: \"y < 1e-6\"", "f: \"y > 0.2 - 1e-6\""],
        ]
        .concat();
        for element in ["hex8", "tet4", "hex20", "hex27", "tet10"] {
            let mesh = mesh::<3>(element, &sides, "block.c", "block.d").unwrap();
            for (set, side) in ["a", "b", "c", "d", "e", "f"]
                .into_iter()
                .zip(["left", "right", "bottom", "top", "front", "back"])
            {
                let [set, side] = [set, side].map(|name| &mesh.facet_sets[&format!("block.{name}")]);
                assert_eq!(set, side, "{element}");
            }
        }
    }

    /// Boxes, spheres, unions, differences and intersections have the members that one counts by hand.
    #[test]
    fn sets_have_their_members() {
        let sets = [
            "pad: \"x > 0.15 and y < 1e-6\"",
            "corner: { of: nodes, where: \"x < 1e-6 and y < 1e-6\" }",
            "inner: { of: nodes, box: { min: [0.05, 0.05], max: [\"350 mm\", 0.15] } }",
            "core: { of: elements, sphere: { center: [0.2, 0.1], radius: 0.15 } }",
            "west: { box: { min: [0, 0], max: [0, 1] } }",
            "sides: { union: [left, west, right] }",
            "shell: { union: [sides, bottom, top] }",
            "open: { difference: [shell, top, left] }",
            "both: { intersection: [shell, pad] }",
        ];
        let mesh = mesh::<2>("quad4", &sets, "block.pad", "block.corner").unwrap();
        let facets = |name: &str| mesh.facet_sets[&format!("block.{name}")].len();
        assert_eq!(["pad", "west", "sides", "shell", "open", "both"].map(facets), [2, 2, 4, 12, 6, 2]);
        assert_eq!(mesh.point_sets["block.corner"], [0]);
        assert_eq!(mesh.point_sets["block.inner"].len(), 3);
        assert_eq!(mesh.element_sets["block.core"].len(), 4);
    }

    /// A list of surfaces is their union, in which common facets occur once; a list with other sets has all their nodes.
    #[test]
    fn lists_are_one_set() {
        let sets = ["pad: \"x > 0.15 and y < 1e-6\"", "edge: { of: nodes, where: \"x < 1e-6\" }"];
        let contactor = "[block.pad, block.bottom, block.left]";
        let mesh = mesh::<2>("quad4", &sets, contactor, "[block.top, block.edge]").unwrap();
        assert_eq!(mesh.facet_sets["block.bottom + block.left + block.pad"].len(), 4 + 2);
        assert_eq!(mesh.point_sets["block.edge + block.top"].len(), 3 + 5 - 1);
    }

    /// What only the mesh shows to be wrong is reported at its place, with a cure.
    #[test]
    fn wrong_sets_are_refused() {
        for (sets, place, words) in [
            (vec!["top: \"x < 1e-6\""], "6:7", ["already has a set 'top'", "another name"]),
            (vec!["a: \"x > 2\""], "6:7", ["is empty: no node is in it", "from [0, 0] to [0.4, 0.2] m"]),
            (vec!["a: \"x > 0.35 and y < 0.05\""], "6:7", ["nodes in it: 1, but no facet", "of: nodes"]),
            (vec!["a: { of: nodes, where: \"y == 0.05\" }"], "6:7", ["is empty", "tolerance"]),
            (
                vec!["a: { of: elements, where: \"y < 0.05\" }"],
                "6:7",
                ["no element has all", "whole element"],
            ),
            (vec!["a: { intersection: [left, right] }"], "6:7", ["is empty", "no members in common"]),
            (vec!["a: { union: [left, b] }", "b: \"y < 1e-6\""], "6:26", ["no set 'b' above", "bottom"]),
            (
                vec!["a: { of: nodes, where: \"x < 1e-6\" }", "b: { union: [left, a] }"],
                "7:26",
                ["'a' has nodes, but 'left' has facets", "one kind"],
            ),
            (vec!["a: { of: nodes, where: \"y < 1e-6\" }"], "12:22", ["expected a surface", "points"]),
        ] {
            let contactor = if place == "12:22" { "block.a" } else { "block.bottom" };
            let text = mesh::<2>("quad4", &sets, contactor, "block.top").unwrap_err().message;
            assert!(text.starts_with(&format!("case.yml:{place}: ")), "{text}");
            words.iter().for_each(|word| assert!(text.contains(word), "'{word}' missing in {text}"));
        }
    }
}
