//! Meshes with nonconforming elements are rejected with the location, for every kind of element.
//! Conforming meshes are accepted.

use super::*;
use crate::mesh::{BoxShape, gmsh};

/// A box of `cells` cells of one kind.
fn block<const D: usize>(kind: ElementKind, cells: [u32; D], min: [f64; D], max: [f64; D]) -> Mesh<D> {
    BoxShape { min, max, cells, element: kind }.mesh().expect("a box")
}

/// Elements and points of several meshes in one mesh, without shared nodes.
fn beside<const D: usize>(parts: &[Mesh<D>]) -> Mesh<D> {
    let mut all = Mesh::with_points(Vec::new());
    for part in parts {
        let first = all.points.len() as u32;
        all.points.extend(&part.points);
        for element in 0..part.element_count() {
            all.push(part.kinds[element], part.element_nodes(element).iter().map(|node| node + first));
        }
    }
    all
}

fn check<const D: usize>(mesh: &mut Mesh<D>, parts: MeshParts) -> Result<Vec<String>> {
    conform(mesh, "block", "m", &MeshOrigin::Box("block", "m"), parts, &[])
}

/// Asserts that a mesh is rejected with this message.
#[track_caller]
fn refused<const D: usize>(mesh: &mut Mesh<D>, words: &str) {
    let error = check(mesh, MeshParts::Joined).expect_err(words);
    assert!(error.message.contains(words), "{words}: {}", error.message);
    assert!(error.message.contains("hint: "), "{}", error.message);
}

fn unit<const D: usize>(kind: ElementKind, low: f64, cells: [u32; D]) -> Mesh<D> {
    let (mut min, mut max) = ([0.0; D], [1.0; D]);
    (min[0], max[0]) = (low, low + 1.0);
    block(kind, cells, min, max)
}

fn kinds(dimension: usize) -> impl Iterator<Item = ElementKind> {
    ElementKind::SOLIDS.into_iter().filter(move |kind| kind.dimension() == dimension)
}

fn in_dimension<const D: usize>() {
    for kind in kinds(D) {
        let mut whole = unit::<D>(kind, 0.0, [2; D]);
        assert_eq!(
            check(&mut whole, MeshParts::Joined).expect("a good mesh"),
            Vec::<String>::new(),
            "{kind}"
        );
        assert!(whole.piece.iter().all(|piece| *piece == 0));

        // Two cells of two by two, as Gmsh writes surfaces that do not share their common line.
        let twice = || beside(&[unit::<D>(kind, 0.0, [2; D]), unit::<D>(kind, 1.0, [2; D])]);
        refused(&mut twice(), "coincide");
        let mut apart = twice();
        let remarks = check(&mut apart, MeshParts::Apart).expect("parts that are meant");
        assert!(remarks[0].contains("2 parts that share no node"), "{kind}: {remarks:?}");
        assert_eq!(apart.piece.iter().max(), Some(&1));
        let mut merged = twice();
        let remarks = check(&mut merged, MeshParts::Merged(1e-9)).expect("nodes that are joined");
        assert!(remarks[0].contains("were joined"), "{kind}: {remarks:?}");
        assert!(merged.piece.iter().all(|piece| *piece == 0), "{kind}");
        merged.drop_unused_points();
        let mut cells = [2; D];
        cells[0] = 4;
        let mut max = [1.0; D];
        max[0] = 2.0;
        assert_eq!(merged.points.len(), block::<D>(kind, cells, [0.0; D], max).points.len(), "{kind}");

        // One cell next to two: there are hanging nodes, also after the corners are joined.
        let mut cells = [1; D];
        cells[1] = 2;
        let hanging = || beside(&[unit::<D>(kind, 0.0, [1; D]), unit::<D>(kind, 1.0, cells)]);
        refused(&mut hanging(), "coincide");
        let error = check(&mut hanging(), MeshParts::Merged(1e-9)).expect_err("a hanging node");
        let sides = kind.order() == 2
            || error.message.contains("hanging node")
            || error.message.contains("lies on a side");
        assert!(sides, "{kind}: {}", error.message);

        // A second copy of the elements, with nodes of its own.
        refused(&mut beside(&[unit::<D>(kind, 0.0, [2; D]), unit::<D>(kind, 0.0, [2; D])]), "coincide");
        // Two parts that are far apart are accepted, with a remark.
        let mut island = beside(&[unit::<D>(kind, 0.0, [2; D]), unit::<D>(kind, 5.0, [1; D])]);
        let remarks = check(&mut island, MeshParts::Joined).expect("an island");
        assert!(remarks[0].contains("elements in the smallest: "), "{remarks:?}");
    }
}

#[test]
fn plane_meshes_must_fit_together() {
    in_dimension::<2>();
}

#[test]
fn solid_meshes_must_fit_together() {
    in_dimension::<3>();
}

/// Elements ten million times as long as thick have sides close to each other, but still form one
/// body.
#[test]
fn thin_bodies_are_not_taken_for_parts_that_touch() {
    for kind in kinds(2) {
        let mut thin = block::<2>(kind, [5, 1], [0.0; 2], [1.0, 2e-8]);
        check(&mut thin, MeshParts::Joined).unwrap_or_else(|error| panic!("{kind}: {error}"));
    }
    for kind in kinds(3) {
        let mut thin = block::<3>(kind, [3, 3, 1], [0.0; 3], [1.0, 1.0, 2e-8]);
        check(&mut thin, MeshParts::Joined).unwrap_or_else(|error| panic!("{kind}: {error}"));
    }
}

/// A node inside the side of a neighbour is a hanging node, although the corners are shared.
#[test]
fn a_hanging_node_is_named() {
    let mut mesh = Mesh::with_points(vec![
        [0.0, 0.0],
        [1.0, 0.0],
        [1.0, 1.0],
        [0.0, 1.0],
        [2.0, 0.0],
        [2.0, 0.5],
        [2.0, 1.0],
        [1.0, 0.5],
    ]);
    mesh.push(ElementKind::Quad4, [0, 1, 2, 3]);
    mesh.push(ElementKind::Quad4, [1, 4, 5, 7]);
    mesh.push(ElementKind::Quad4, [7, 5, 6, 2]);
    refused(&mut mesh, "the node at [1, 0.5] m is a hanging node");
}

/// Elements of different orders do not share the nodes of their sides; elements of different shapes
/// do not share the sides.
#[test]
fn neighbours_of_another_order_or_shape_are_refused() {
    let mut orders = Mesh::with_points(vec![
        [0.0, 0.0],
        [1.0, 0.0],
        [1.0, 1.0],
        [0.0, 1.0],
        [2.0, 0.0],
        [2.0, 1.0],
        [1.5, 0.0],
        [2.0, 0.5],
        [1.5, 1.0],
        [1.0, 0.5],
    ]);
    orders.push(ElementKind::Quad4, [0, 1, 2, 3]);
    orders.push(ElementKind::Quad8, [1, 4, 5, 2, 6, 7, 8, 9]);
    refused(&mut orders, "share the corners of a side, but not its other nodes");

    // A cube beside five tetrahedra on its corners: the square side is opposite two triangles.
    let mut shapes = block::<3>(ElementKind::Hex8, [2, 1, 1], [0.0; 3], [2.0, 1.0, 1.0]);
    let nodes = shapes.element_nodes(1).to_vec();
    let mut mixed = Mesh::with_points(std::mem::take(&mut shapes.points));
    mixed.push(ElementKind::Hex8, shapes.element_nodes(0).iter().copied());
    for tet in FIVE {
        mixed.push(ElementKind::Tet4, tet.map(|local: usize| nodes[local]));
    }
    refused(&mut mixed, "lies on a side of");
}

/// Five tetrahedra on the corners of a hexahedron.
const FIVE: [[usize; 4]; 5] = [[0, 1, 3, 4], [1, 2, 3, 6], [1, 4, 5, 6], [3, 4, 6, 7], [1, 3, 4, 6]];

/// Warped sides that do not match do not coincide but have the same corners: a quadrilateral beside
/// two triangles, or triangles with different diagonals. The void of an omitted tetrahedron is not
/// such a slit.
#[test]
fn warped_sides_that_do_not_match_are_refused() {
    let cells = block::<3>(ElementKind::Hex8, [2, 1, 1], [0.0; 3], [2.0, 1.0, 1.0]);
    let mut points = cells.points.clone();
    let middle = points.iter().position(|x| x == &[1.0, 0.0, 0.0]).expect("a corner between the cells");
    points[middle][0] += 0.05;
    for both in [false, true] {
        let mut mesh = Mesh::with_points(points.clone());
        for cell in 0..2 {
            let nodes = cells.element_nodes(cell);
            if cell == 0 && !both {
                mesh.push(ElementKind::Hex8, nodes.iter().copied());
            } else {
                for tet in FIVE {
                    mesh.push(ElementKind::Tet4, tet.map(|local| nodes[local]));
                }
            }
        }
        refused(&mut mesh, "lies on a side of");
    }
    let mut hollow = Mesh::with_points(points);
    let nodes = cells.element_nodes(0);
    for tet in &FIVE[..4] {
        hollow.push(ElementKind::Tet4, tet.map(|local| nodes[local]));
    }
    let boundary = FacetIndex::new(&hollow).boundary();
    assert!(Surface::new(&hollow, &boundary).unmatched_sides().is_empty());
}

/// Pieces that share one node, or in space an edge, are hinged. With more shared nodes they are one
/// piece.
#[test]
fn pieces_hinge_on_what_does_not_hold_them() {
    // Two squares at one corner.
    let mut hinge = Mesh::with_points(vec![
        [0.0, 0.0],
        [1.0, 0.0],
        [1.0, 1.0],
        [0.0, 1.0],
        [2.0, 1.0],
        [2.0, 2.0],
        [1.0, 2.0],
    ]);
    hinge.push(ElementKind::Quad4, [0, 1, 2, 3]);
    hinge.push(ElementKind::Quad4, [2, 4, 5, 6]);
    let remarks = check(&mut hinge, MeshParts::Joined).expect("a hinge");
    assert!(remarks[0].contains("joined at single nodes only, for example at [1, 1] m"), "{remarks:?}");
    assert_eq!(hinge.piece, [0, 1]);
    // A ring of four squares around a hole of the size of a square: two nodes at two corners join
    // the pieces.
    let mut ring = Mesh::with_points((0..16).map(|k| [f64::from(k % 4), f64::from(k / 4)]).collect());
    for corner in [1, 4, 6, 9] {
        ring.push(ElementKind::Quad4, [corner, corner + 1, corner + 5, corner + 4]);
    }
    let remarks = check(&mut ring, MeshParts::Joined).expect("a ring");
    assert_eq!(ring.piece, [0, 1, 2, 3], "four hinges: a mechanism");
    assert_eq!(remarks.len(), 1, "{remarks:?}");
    // Two cubes at an edge rotate about it. A third cube that shares a side with both makes them
    // one piece.
    let mut cubes = block::<3>(ElementKind::Hex8, [2, 2, 1], [0.0; 3], [2.0, 2.0, 1.0]);
    let all: Vec<Vec<u32>> = (0..4).map(|element| cubes.element_nodes(element).to_vec()).collect();
    let of = |chosen: &[usize]| {
        let mut mesh = Mesh::with_points(cubes.points.clone());
        chosen.iter().for_each(|&element| {
            mesh.push(ElementKind::Hex8, all[element].iter().copied());
        });
        mesh
    };
    let mut edge = of(&[0, 3]);
    check(&mut edge, MeshParts::Joined).expect("an edge");
    assert_eq!(edge.piece, [0, 1]);
    let mut three = of(&[0, 1, 3]);
    check(&mut three, MeshParts::Joined).expect("three cubes");
    assert_eq!(three.piece, [0, 0, 0]);
    check(&mut cubes, MeshParts::Joined).expect("four cubes");
}

/// Adds the sides at x = 1 to the sets `left`, for the first `count` elements, and `right`, for the
/// others.
fn name_seam<const D: usize>(mesh: &mut Mesh<D>, count: u32) {
    let boundary = FacetIndex::new(mesh).boundary();
    let at_seam = |facet: &Facet| mesh.facet_corners(*facet).all(|node| mesh.points[node as usize][0] == 1.0);
    let (left, right): (Vec<_>, Vec<_>) =
        boundary.into_iter().filter(at_seam).partition(|facet| facet.element < count);
    mesh.facet_sets.insert("left".into(), left);
    mesh.facet_sets.insert("right".into(), right);
}

/// Runs `check` with a contact between the sets `left` and `right`.
fn check_with_contact<const D: usize>(mesh: &mut Mesh<D>, parts: MeshParts) -> Result<Vec<String>> {
    let meets = [("left".to_owned(), "right".to_owned())];
    conform(mesh, "block", "m", &MeshOrigin::Box("block", "m"), parts, &meets)
}

/// Surfaces between which a contact of the body with itself acts may touch, with matching or
/// nonmatching meshes. In space the nodes at the rim of the contact also lie on outer sides, which
/// are in no set.
#[test]
fn sides_of_a_contact_may_touch() {
    fn check_kind<const D: usize>(kind: ElementKind) {
        for cells in 2..4 {
            let first = unit::<D>(kind, 0.0, [2; D]);
            let mut mesh = beside(&[first.clone(), unit::<D>(kind, 1.0, [cells; D])]);
            name_seam(&mut mesh, first.element_count() as u32);
            check_with_contact(&mut mesh, MeshParts::Joined)
                .unwrap_or_else(|error| panic!("{kind}: {error}"));
            let error = check(&mut mesh, MeshParts::Joined).expect_err("no contact").message;
            assert!(error.contains("a contact between their sets"), "{kind}: {error}");
        }
    }
    kinds(2).for_each(check_kind::<2>);
    kinds(3).for_each(check_kind::<3>);
}

/// Surfaces that touch outside of the sets of a contact are rejected, at a location in neither set.
#[test]
fn a_contact_excuses_its_own_surfaces_only() {
    let lower = unit::<3>(ElementKind::Hex8, 0.0, [1, 2, 2]);
    let mut mesh = beside(&[lower.clone(), unit::<3>(ElementKind::Hex8, 1.0, [1, 3, 3])]);
    name_seam(&mut mesh, lower.element_count() as u32);
    let upper_half =
        |facet: &Facet| mesh.facet_corners(*facet).all(|node| mesh.points[node as usize][1] >= 0.5);
    let left: Vec<Facet> = mesh.facet_sets["left"].iter().copied().filter(upper_half).collect();
    assert_eq!((left.len(), mesh.facet_sets["right"].len()), (2, 9));
    mesh.facet_sets.insert("left".into(), left);
    let error = check_with_contact(&mut mesh, MeshParts::Joined).expect_err("a gap in a set").message;
    assert!(error.contains("the node at [1, 0, 0] m") && error.contains("(2 such pairs)"), "{error}");
}

/// Merging does not join the two sets of a contact. At the tip of a crack, where the sides beyond
/// must be joined, it joins the last nodes of the sets.
#[test]
fn merging_keeps_the_sets_of_a_contact_apart() {
    fn check_kind<const D: usize>(kind: ElementKind) {
        let first = unit::<D>(kind, 0.0, [2; D]);
        let mut mesh = beside(&[first.clone(), unit::<D>(kind, 1.0, [2; D])]);
        let count = first.element_count() as u32;
        name_seam(&mut mesh, count);
        let mut whole = mesh.clone();
        let remarks =
            check_with_contact(&mut whole, MeshParts::Merged(1e-9)).unwrap_or_else(|e| panic!("{kind}: {e}"));
        assert!(remarks[0].starts_with("merge: 0 nodes"), "{kind}: {remarks:?}");
        assert!(remarks[1].contains("stay separate"), "{kind}: {remarks:?}");
        assert_eq!(whole.facet_sets, mesh.facet_sets, "{kind}");

        let above =
            |facet: &Facet| mesh.facet_corners(*facet).all(|node| mesh.points[node as usize][1] >= 0.5);
        let mut crack = mesh.clone();
        crack.facet_sets.values_mut().for_each(|set| set.retain(above));
        let sets = crack.facet_sets.clone();
        check_with_contact(&mut crack, MeshParts::Merged(1e-9)).unwrap_or_else(|e| panic!("{kind}: {e}"));
        assert_eq!(crack.facet_sets, sets, "{kind}");
        let is_seam = |place: &[f64; D]| place[0] == 1.0;
        let used: std::collections::BTreeSet<u32> = crack.nodes.iter().copied().collect();
        let at = |open: bool| {
            let nodes = used.iter().map(|&node| crack.points[node as usize]);
            nodes.filter(|place| is_seam(place) && (place[1] > 0.5) == open).count()
        };
        let before = |open: bool| {
            mesh.points.iter().filter(|place| is_seam(place) && (place[1] > 0.5) == open).count()
        };
        assert_eq!((at(true), 2 * at(false)), (before(true), before(false)), "{kind}");
    }
    kinds(2).for_each(check_kind::<2>);
    kinds(3).for_each(check_kind::<3>);
}

/// Merging by more than an edge is rejected at the element. Sides that become interior are removed
/// from their sets.
#[test]
fn merging_has_its_limits() {
    let twice =
        || beside(&[unit::<2>(ElementKind::Quad4, 0.0, [2, 2]), unit::<2>(ElementKind::Quad4, 1.0, [2, 2])]);
    let error = check(&mut twice(), MeshParts::Merged(0.6)).expect_err("a tolerance beyond edges");
    assert!(error.message.contains("has two nodes within merge.tolerance"), "{}", error.message);
    let mut mesh = twice();
    let seam = FacetIndex::new(&mesh).boundary().into_iter().filter(|facet| {
        let mut nodes = mesh.facet_corners(*facet);
        nodes.all(|node| mesh.points[node as usize][0] == 1.0)
    });
    let seam = seam.collect();
    mesh.facet_sets.insert("seam".into(), seam);
    let remarks = check(&mut mesh, MeshParts::Merged(1e-9)).expect("a merged mesh");
    assert!(remarks[1].contains("4 of the 4 sides in the set 'block.seam'"), "{remarks:?}");
    assert!(mesh.facet_sets.is_empty());
}

/// For every curved kind, an element that is inverted only by its curved sides is rejected,
/// although all its corners are valid.
#[test]
fn inverted_curves_are_refused() {
    fn check<const D: usize>(kind: ElementKind) {
        let good = block::<D>(kind, [1; D], [0.0; D], [1.0; D]);
        let source = MeshOrigin::Box("block", "m");
        require_sound_curves(&good, &source).expect("a straight element");
        let nodes = good.element_nodes(0);
        let (corners, middle) = (kind.corners(), nodes[kind.corners()]);
        let mut bent = good.clone();
        // The first midside node is moved through the element to the opposite side.
        let centre = good.element_centre(0);
        let from = good.points[middle as usize];
        bent.points[middle as usize] = std::array::from_fn(|k| from[k] + 2.0 * (centre[k] - from[k]));
        assert!(crate::mesh::validate::first_bad_element(&bent).is_none(), "{kind}: {corners} corners");
        let error = require_sound_curves(&bent, &source).expect_err("a folded element");
        assert!(
            error.message.contains("inverted or flat inside") && error.message.contains("hint: "),
            "{}",
            error.message
        );
    }
    for kind in ElementKind::SOLIDS.into_iter().filter(|kind| kind.order() == 2) {
        if kind.dimension() == 2 { check::<2>(kind) } else { check::<3>(kind) }
    }
}

/// If all nodes of an element coincide, the message contains a finite number.
#[test]
fn an_element_without_extent_is_refused() {
    let mut mesh = block::<2>(ElementKind::Quad8, [1; 2], [0.0; 2], [1.0; 2]);
    // Straight sides are not integrated: a midside node is moved first.
    for place in &mut mesh.points {
        place[0] *= place[0];
        place[1] = 0.0;
    }
    let error =
        require_sound_curves(&mesh, &MeshOrigin::Box("block", "m")).expect_err("a flat element").message;
    assert!(error.contains("is 0.0e0 of"), "{error}");
}

/// The Gmsh fixtures, in original form and with a defect. 22a is the readable form.
fn fixture(kind: &str, format: &str) -> std::path::PathBuf {
    let name = format!("tests/fixtures/gmsh/{kind}-{format}.msh");
    std::path::PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(name)
}

/// The remarks or the error for a mesh file.
fn read<const D: usize>(path: &std::path::Path, parts: MeshParts) -> Result<Vec<String>> {
    let (mut mesh, source) = gmsh::read_with_source::<D>(path, None)?;
    let source = MeshOrigin::File(&source);
    require_sound_curves(&mesh, &source)?;
    conform(&mut mesh, "block", "m", &source, parts, &[])
}

/// An MSH 2.2 text in which the elements of group 2 have nodes of their own, moved along x.
fn unjoined(text: &str, dimension: usize, moved: f64) -> String {
    let mut nodes: BTreeMap<u64, Vec<String>> = BTreeMap::new();
    let (mut head, mut elements, mut section) = (String::new(), Vec::new(), "");
    for line in text.lines() {
        let words: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
        match (section, line) {
            (_, "$Nodes") => section = "nodes",
            (_, "$Elements") => section = "elements",
            (_, _) if line.starts_with("$End") && !section.is_empty() => section = "passed",
            ("nodes", _) if words.len() == 4 => {
                drop(nodes.insert(words[0].parse().unwrap(), words[1..].to_vec()))
            }
            ("elements", _) if words.len() > 4 => elements.push(words),
            ("", _) => head += &format!("{line}\n"),
            _ => {}
        }
    }
    let solid = |words: &[String]| {
        let code = words[1].parse().unwrap();
        ElementKind::from_gmsh(code).is_some_and(|kind| kind.dimension() == dimension)
    };
    let ids = |words: &[String]| words[5..].to_vec();
    let of_group = |group: &str| -> Vec<String> {
        elements
            .iter()
            .filter(|words| solid(words) && words[3] == group)
            .flat_map(|words| ids(words))
            .collect()
    };
    let (own, other) = (of_group("2"), of_group("1"));
    let twin = |id: &String| (id.parse::<u64>().unwrap() + 1000).to_string();
    let known = nodes.clone();
    for id in &own {
        let mut place = known[&id.parse::<u64>().unwrap()].clone();
        place[0] = (place[0].parse::<f64>().unwrap() + moved).to_string();
        nodes.insert(id.parse::<u64>().unwrap() + 1000, place);
        if !other.contains(id) {
            nodes.remove(&id.parse::<u64>().unwrap());
        }
    }
    let mut out = format!("{head}$Nodes\n{}\n", nodes.len());
    nodes.iter().for_each(|(id, place)| out += &format!("{id} {}\n", place.join(" ")));
    out += &format!("$EndNodes\n$Elements\n{}\n", elements.len());
    for words in &elements {
        let all = |set: &[String]| ids(words).iter().all(|id| set.contains(id));
        let moves = all(&own) && !all(&other);
        let ids: Vec<String> = ids(words)
            .iter()
            .map(|id| if moves || (!other.contains(id)) { twin(id) } else { id.clone() })
            .collect();
        out += &format!("{} {}\n", words[..5].join(" "), ids.join(" "));
    }
    out + "$EndElements\n"
}

/// All meshes written by Gmsh are accepted, in every format. With nodes doubled between the two
/// regions, the mesh is rejected at a line, or the nodes are merged, or there are two parts. This
/// is checked for linear and quadratic elements, plane and solid.
#[test]
fn meshes_of_gmsh_fit_together_unless_they_are_damaged() {
    fn check<const D: usize>(kind: &str) {
        for format in ["22a", "22b", "41a", "41b"] {
            let remarks = read::<D>(&fixture(kind, format), MeshParts::Joined);
            assert_eq!(
                remarks.unwrap_or_else(|error| panic!("{kind}: {error}")),
                Vec::<String>::new(),
                "{kind}"
            );
        }
        let text = std::fs::read_to_string(fixture(kind, "22a")).unwrap();
        let path = std::env::temp_dir().join(format!("contact-petsc-{}-{kind}.msh", std::process::id()));
        let say = |text: String, parts| {
            std::fs::write(&path, text).unwrap();
            read::<D>(&path, parts)
        };
        let error = say(unjoined(&text, D, 0.0), MeshParts::Joined).expect_err("doubled nodes").message;
        assert!(
            error.contains(": line ") && error.contains("coincide") && error.contains("Coherence"),
            "{error}"
        );
        let merged =
            say(unjoined(&text, D, 0.0), MeshParts::Merged(1e-8)).unwrap_or_else(|e| panic!("{kind}: {e}"));
        assert!(merged.len() == 1 && merged[0].contains("were joined"), "{kind}: {merged:?}");
        let island =
            say(unjoined(&text, D, 5.0), MeshParts::Joined).unwrap_or_else(|e| panic!("{kind}: {e}"));
        assert!(island.len() == 1 && island[0].contains("2 parts that share no node"), "{kind}: {island:?}");
        let _ = std::fs::remove_file(&path);
    }
    ["tri3", "quad4", "tri6", "quad8", "quad9"].into_iter().for_each(check::<2>);
    ["tet4", "hex8", "tet10", "hex20", "hex27"].into_iter().for_each(check::<3>);
}
