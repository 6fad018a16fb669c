//! Input files as preprocessors and users write them: kinds, sets, surfaces, parts, and defects.

use super::*;
use crate::mesh::{ElementKind, Facet, PlaneState, SetKind, gmsh, measure};
use std::fmt::Write as _;
use std::path::PathBuf;

/// Two rectangles, 1 x 0.6 and 0.5 x 0.6, in the style of a user of CalculiX.
const PLANE: &str = "** two bodies
*HEADING
this is a title, not data
*Node, nset=Nall
 1, 0., 0.
 2, 1.D0, 0, 0
 3, 1.5, .0,
 11, 0, 6e-1
 12, 1.0E+00, 0.6
 13, 1.5, 0.6
** the left one
*ELEMENT, TYPE=CPE4R,
ELSET=\"Left body\"
 7, 1, 2,
 12, 11
*element, type=CPE4, elset=right
8, 2, 3, 13, 12

*NSET, NSET=Bottom, GENERATE
1, 3
*Nset, nset=corners, generate
 1, 11, 10
*NSET, NSET=corners
Bottom, 13,
*ELSET, ELSET=all
\"LEFT BODY\", 8
*SURFACE, NAME=Top, TYPE=ELEMENT
all, S3
*SURFACE, NAME=side
7, s4
right, S2
*SURFACE, NAME=foot, TYPE=NODE
bottom, 1.0
*SURFACE, NAME=free
all
*MATERIAL, NAME=rubber
*ELASTIC
1e6, 0.3
*STEP
*STATIC
*END STEP
";

fn facets(list: &[(u32, u8)]) -> Vec<Facet> {
    list.iter().map(|&(element, side)| Facet { element, side }).collect()
}

/// Continued lines, quotation marks, lower case, Fortran's exponents, comments, ranges, sets of
/// sets, surfaces of sets and of single elements, and free faces.
#[test]
fn a_plane_input_with_all_kinds_of_sets() {
    let mesh: Mesh<2> = parse(PLANE.as_bytes(), None).unwrap();
    assert_eq!(mesh.points, [[0.0, 0.0], [1.0, 0.0], [1.5, 0.0], [0.0, 0.6], [1.0, 0.6], [1.5, 0.6]]);
    assert_eq!(mesh.kinds, [ElementKind::Quad4; 2]);
    assert_eq!(mesh.nodes, [0, 1, 4, 3, 1, 2, 5, 4]);
    assert_eq!(mesh.facet_sets["Top"], facets(&[(0, 2), (1, 2)]));
    assert_eq!(mesh.facet_sets["side"], facets(&[(0, 3), (1, 1)]));
    assert_eq!(mesh.facet_sets["free"], facets(&[(0, 0), (0, 2), (0, 3), (1, 0), (1, 1), (1, 2)]));
    assert_eq!(mesh.point_sets["Bottom"], [0, 1, 2]);
    assert_eq!(mesh.point_sets["foot"], [0, 1, 2]);
    assert_eq!(mesh.point_sets["corners"], [0, 1, 2, 3, 5]);
    assert_eq!(mesh.point_sets["Nall"], [0, 1, 2, 3, 4, 5]);
    assert_eq!(mesh.element_sets["Left body"], [0]);
    assert_eq!(mesh.element_sets["right"], [1]);
    assert_eq!(mesh.element_sets["all"], [0, 1]);
    assert_eq!(mesh.sets().len(), 10);
}

/// A region keeps its elements, its nodes and its part of each set. Sets without members in it are
/// dropped.
#[test]
fn a_region_is_an_element_set() {
    let mesh: Mesh<2> = parse(PLANE.as_bytes(), Some("RIGHT")).unwrap();
    assert_eq!(mesh.points, [[1.0, 0.0], [1.5, 0.0], [1.0, 0.6], [1.5, 0.6]]);
    assert_eq!(mesh.nodes, [0, 1, 3, 2]);
    assert_eq!(mesh.facet_sets["side"], facets(&[(0, 1)]));
    assert_eq!(mesh.facet_sets["free"].len(), 4, "the common side is free without the other body");
    assert_eq!(mesh.point_sets["corners"], [0, 1, 3]);
    assert_eq!(mesh.element_sets.keys().collect::<Vec<_>>(), ["all", "right"]);
    let error = parse::<2>(PLANE.as_bytes(), Some("rihgt")).unwrap_err().message;
    assert!(error.contains("no element set 'rihgt'") && error.contains("Left body, right, all"), "{error}");
}

/// Everything that is not the mesh is listed in remarks.
#[test]
fn what_is_skipped_is_reported() {
    let text =
        format!("{PLANE}*NODE\n99, 7, 7, 7\n*ELEMENT, TYPE=SPRING1\n50, 99\n51, 99\n*ELSET, ELSET=all\n50\n");
    let mut deck = Deck::new("", text.into_bytes(), None);
    let parsed = labelled::<2>(&mut deck, None, PlaneState::Strain).unwrap();
    assert_eq!(parsed.mesh.points.len(), 6);
    assert_eq!(parsed.mesh.element_sets["all"], [0, 1]);
    let remarks = parsed.remarks.join("\n");
    for part in [
        "CPE4R as quad4",
        "2 SPRING1",
        "1 nodes belong to no",
        "skipped: *MATERIAL, *ELASTIC, *STEP, *STATIC",
    ] {
        assert!(remarks.contains(part), "{part}: {remarks}");
    }
}

/// One element of a type, with nodes where the manual of Abaqus has them: corners as given, and each
/// midside node between its two corners. Corners and edges are counted from one.
fn single(name: &str, corners: &[[f64; 3]], edges: &[[usize; 2]]) -> String {
    let mut text = String::from("*NODE\n");
    let mut write = |node: usize, x: [f64; 3]| {
        let _ = writeln!(text, "{node}, {}, {}, {}", x[0], x[1], x[2]);
    };
    corners.iter().enumerate().for_each(|(k, &x)| write(k + 1, x));
    for (k, edge) in edges.iter().enumerate() {
        let [one, other] = edge.map(|corner| corners[corner - 1]);
        write(corners.len() + k + 1, std::array::from_fn(|i| 0.5 * (one[i] + other[i])));
    }
    let nodes: Vec<String> = (1..=corners.len() + edges.len()).map(|node| node.to_string()).collect();
    let lines: Vec<String> = nodes.chunks(15).map(|line| line.join(", ")).collect();
    let _ = write!(text, "*ELEMENT, TYPE={name}, ELSET=E\n1, {}\n", lines.join(",\n"));
    for face in 1..=6 {
        let _ = write!(text, "*SURFACE, NAME=face{face}\nE, S{face}\n");
    }
    text
}

const CUBE: [[f64; 3]; 8] = [
    [0., 0., 0.],
    [1., 0., 0.],
    [1., 1., 0.],
    [0., 1., 0.],
    [0., 0., 1.],
    [1., 0., 1.],
    [1., 1., 1.],
    [0., 1., 1.],
];
const HEX_EDGES: [[usize; 2]; 12] =
    [[1, 2], [2, 3], [3, 4], [4, 1], [5, 6], [6, 7], [7, 8], [8, 5], [1, 5], [2, 6], [3, 7], [4, 8]];
const TET_EDGES: [[usize; 2]; 6] = [[1, 2], [2, 3], [3, 1], [1, 4], [2, 4], [3, 4]];
const HEX_FACES: [&[usize]; 6] =
    [&[1, 2, 3, 4], &[5, 8, 7, 6], &[1, 5, 6, 2], &[2, 6, 7, 3], &[3, 7, 8, 4], &[4, 8, 5, 1]];
const TET_FACES: [&[usize]; 4] = [&[1, 2, 3], &[1, 4, 2], &[2, 4, 3], &[3, 4, 1]];

fn check_single<const D: usize>(
    name: &str,
    kind: ElementKind,
    corners: &[[f64; 3]],
    edges: &[[usize; 2]],
    faces: &[&[usize]],
) {
    let text = single(name, corners, edges);
    let cut = text.find(&format!("*SURFACE, NAME=face{}", faces.len() + 1)).unwrap_or(text.len());
    let mesh: Mesh<D> = parse(&text.as_bytes()[..cut], None).unwrap();
    assert_eq!(mesh.kinds, [kind], "{name}");
    measure::assert_straight(&mesh);
    for (face, expected) in (1..).zip(faces) {
        let set = &mesh.facet_sets[&format!("face{face}")];
        assert_eq!(set.len(), 1);
        let mut found: Vec<usize> = mesh.facet_corners(set[0]).map(|node| node as usize + 1).collect();
        let mut expected = expected.to_vec();
        found.sort_unstable();
        expected.sort_unstable();
        assert_eq!(found, expected, "{name} S{face}");
    }
    if cut < text.len() {
        let error = parse::<D>(text.as_bytes(), None).unwrap_err().message;
        assert!(error.contains(&format!("face S{}", faces.len() + 1)), "{error}");
    }
}

/// Node orders and face numbers of every type, as the manuals of Abaqus and CalculiX give them.
/// Variants are read as the same kind.
#[test]
fn node_orders_and_face_numbers_of_all_types() {
    use ElementKind::*;
    let tet = [CUBE[0], CUBE[1], CUBE[3], CUBE[4]];
    let quad = &CUBE[..4];
    let tri = &CUBE[..3];
    let quad_edges = [[1, 2], [2, 3], [3, 4], [4, 1]];
    let tri_edges = [[1, 2], [2, 3], [3, 1]];
    let quad_faces: [&[usize]; 4] = [&[1, 2], &[2, 3], &[3, 4], &[4, 1]];
    let tri_faces: [&[usize]; 3] = [&[1, 2], &[2, 3], &[3, 1]];
    check_single::<2>("CPE3", Tri3, tri, &[], &tri_faces);
    check_single::<2>("CPE6MH", Tri6, tri, &tri_edges, &tri_faces);
    check_single::<2>("cpe4i", Quad4, quad, &[], &quad_faces);
    check_single::<2>("CPE8RH", Quad8, quad, &quad_edges, &quad_faces);
    check_single::<3>("C3D4H", Tet4, &tet, &[], &TET_FACES);
    check_single::<3>("C3D10HS", Tet10, &tet, &TET_EDGES, &TET_FACES);
    let wedge = [CUBE[0], CUBE[1], CUBE[3], CUBE[4], CUBE[5], CUBE[7]];
    let wedge_faces: [&[usize]; 5] = [&[1, 2, 3], &[4, 6, 5], &[1, 4, 5, 2], &[2, 5, 6, 3], &[3, 6, 4, 1]];
    check_single::<3>("C3D6H", Wedge6, &wedge, &[], &wedge_faces);
    let pyramid = [CUBE[0], CUBE[1], CUBE[2], CUBE[3], CUBE[4]];
    let pyramid_faces: [&[usize]; 5] = [&[1, 2, 3, 4], &[1, 5, 2], &[2, 5, 3], &[3, 5, 4], &[4, 5, 1]];
    check_single::<3>("C3D5H", Pyramid5, &pyramid, &[], &pyramid_faces);
    check_single::<3>("C3D8R", Hex8, &CUBE, &[], &HEX_FACES);
    check_single::<3>("C3D20", Hex20, &CUBE, &HEX_EDGES, &HEX_FACES);
    check_single::<3>("C3D20RH", Hex20, &CUBE, &HEX_EDGES, &HEX_FACES);
}

/// Part, instance and assembly as Abaqus/CAE writes them: sets of both levels with equal names,
/// internal sets, and reference points with numbers of their own.
#[test]
fn one_part_with_its_instance() {
    let (nodes, elements) =
        ("*Node\n1, 0, 0\n2, 1, 0\n3, 1, 1\n4, 0, 1\n", "*Element, type=CPE4\n1, 1, 2, 3, 4\n");
    let sets = "*Nset, nset=Set-1\n 1, 2\n*Elset, elset=Set-1\n 1\n";
    let assembly = "*Node\n1, 5., 5., 0.\n*Nset, nset=RP\n 1\n\
                    *Nset, nset=Set-1, instance=Block-1\n 3\n*Nset, nset=whole\nBlock-1.Set-1, Set-1\n\
                    *Elset, elset=_Top_S3, internal, instance=Block-1\n 1\n\
                    *Surface, type=ELEMENT, name=Top\n_Top_S3, S3\n*Surface, name=low\nBlock-1.1, S1\n\
                    *End Assembly\n*Step\n*Nset, nset=late\nBlock-1.4\n";
    let dependent = format!(
        "*Heading\n*Part, name=Block\n{nodes}{elements}{sets}*End Part\n*Assembly, name=A\n\
         *Instance, name=Block-1, part=Block\n 0., 0., 0.\n*End Instance\n{assembly}"
    );
    let independent = format!(
        "*Part, name=Block\n*End Part\n*Part, name=Rest\n*End Part\n*Assembly, name=A\n\
         *Instance, name=Block-1, part=Block\n{nodes}{elements}{sets}*End Instance\n{assembly}"
    );
    for text in [&dependent, &independent] {
        let mesh: Mesh<2> = parse(text.as_bytes(), None).unwrap();
        assert_eq!(mesh.points.len(), 4);
        assert_eq!(mesh.facet_sets["Top"], facets(&[(0, 2)]));
        assert_eq!(mesh.facet_sets["low"], facets(&[(0, 0)]));
        assert_eq!(mesh.point_sets["Set-1"], [2]);
        assert_eq!(mesh.point_sets["Block-1.Set-1"], [0, 1]);
        assert_eq!(mesh.point_sets["whole"], [0, 1, 2]);
        assert_eq!(mesh.point_sets["late"], [3]);
        let kinds = mesh.sets();
        assert!(kinds.contains(&("Set-1_elements", SetKind::Elements)), "{kinds:?}");
        assert_eq!(kinds.len(), 7, "{kinds:?}");
        assert!(parse::<2>(text.as_bytes(), Some("Set-1")).is_ok());
    }
    let moved = dependent.replace(" 0., 0., 0.\n", " 0., 2., 0.\n");
    let twice =
        dependent.replace("*End Assembly", "*Instance, name=B, part=Block\n*End Instance\n*End Assembly");
    let parts = dependent.replace("*Assembly", &format!("*Part, name=C\n{nodes}*End Part\n*Assembly"));
    for (text, message) in [
        (moved, "is moved or rotated"),
        (twice, "more than one instance"),
        (parts, "a mesh in more than one part"),
    ] {
        let error = parse::<2>(text.as_bytes(), None).unwrap_err().message;
        assert!(error.contains(message) && error.contains("noPartsInputFile"), "{error}");
    }
}

/// The file in the format of this module with the mesh of a Gmsh file.
fn converted<const D: usize>(mesh: &Mesh<D>) -> String {
    let mut text = String::from("*NODE\n");
    for (node, x) in (1..).zip(&mesh.points) {
        let _ = writeln!(text, "{node}, {:?}, {:?}, {:?}", x[0], x[1], x.get(2).unwrap_or(&0.0));
    }
    for (element, &kind) in mesh.kinds.iter().enumerate() {
        let name = if D == 2 { "CPE" } else { "C3D" };
        let nodes: Vec<String> = mesh.element_nodes(element).iter().map(|n| (n + 1).to_string()).collect();
        let lines: Vec<String> = nodes.chunks(10).map(|line| line.join(",")).collect();
        let _ =
            write!(text, "*ELEMENT, TYPE={name}{}\n{}, {}\n", kind.nodes(), element + 1, lines.join(",\n"));
    }
    for (name, facets) in &mesh.facet_sets {
        let _ = writeln!(text, "*SURFACE, NAME={name}");
        for facet in facets {
            let kind = mesh.kinds[facet.element as usize];
            let face = (1..7).find(|&face| types::side(kind, face) == Some(facet.side)).unwrap();
            let _ = writeln!(text, "{}, S{face}", facet.element + 1);
        }
    }
    for (keyword, sets) in [("NSET", &mesh.point_sets), ("ELSET", &mesh.element_sets)] {
        for (name, members) in sets {
            let _ = writeln!(text, "*{keyword}, {keyword}={name}");
            members.iter().for_each(|member| {
                let _ = writeln!(text, "{},", member + 1);
            });
        }
    }
    text
}

fn check_conversion<const D: usize>(kind: &str) {
    let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
        .join(format!("tests/fixtures/gmsh/{kind}-22a.msh"));
    let mesh: Mesh<D> = gmsh::read(&path, None).unwrap();
    let again: Mesh<D> = parse(converted(&mesh).as_bytes(), None).unwrap();
    assert_eq!(again, mesh, "{kind}");
    let part: Mesh<D> = parse(converted(&mesh).as_bytes(), Some("steel")).unwrap();
    assert_eq!(part, gmsh::read(&path, Some("steel")).unwrap(), "{kind}");
}

/// The meshes of Gmsh, converted to input files, are read as the same meshes, whole and in part.
#[test]
fn meshes_of_gmsh_as_input_files() {
    ["tri3", "quad4", "tri6", "quad8"].iter().for_each(|kind| check_conversion::<2>(kind));
    ["tet4", "hex8", "tet10", "hex20"].iter().for_each(|kind| check_conversion::<3>(kind));
}

/// Files that are included, also in the middle of data; errors name the included file and its line.
#[test]
fn included_files() {
    let folder = std::env::temp_dir().join(format!("contact-petsc-{}-include", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    write("nodes.txt", "1, 0, 0\n2, 1, 0\n** comment\n3, 1, 1\n");
    write("sets.nam", "*NSET, NSET=low\n1, 2\n");
    let main = "*NODE\n*INCLUDE, INPUT=nodes.txt\n4, 0, 1\n*ELEMENT, TYPE=CPE4\n1, 1, 2, 3, 4\n\
                *INCLUDE, INPUT=sets.nam\n3\n*NSET, NSET=up\n4\n";
    let path = folder.join("main.INP");
    write("main.INP", main);
    let (mesh, source) = crate::mesh::read_file::<2>(&path, None, PlaneState::Strain).unwrap();
    assert_eq!(mesh.points.len(), 4);
    assert_eq!(mesh.point_sets["low"], [0, 1, 2]);
    let at = |node| source.error_at_node(&mesh, node, "is here").message;
    assert!(at(2).contains("nodes.txt: line 4: node 3 at (1, 1) is here"), "{}", at(2));
    assert!(at(3).contains("main.INP: line 3: node 4"), "{}", at(3));
    let element = source.error_at_element(&mesh, 0, "is bad").message;
    assert!(element.contains("main.INP: line 5: element 1 (quad4) at (0.5, 0.5) is bad"), "{element}");

    let refused = |main: &str| {
        write("main.INP", main);
        read_with_source::<2>(&path, None, PlaneState::Strain).unwrap_err().message
    };
    write("sets.nam", "*NSET, NSET=low\n1, 77\n");
    let error = refused(main);
    assert!(error.contains("sets.nam: line 2: the set contains node 77"), "{error}");
    let error = refused("*INCLUDE, INPUT=main.INP\n");
    assert!(error.contains("line 1") && error.contains("was included before"), "{error}");
    let error = refused("*NODE\n*INCLUDE, INPUT=none.txt\n");
    assert!(error.contains("main.INP: line 2") && error.contains("none.txt"), "{error}");
    let error = refused("1, 0, 0\n");
    assert!(error.contains("does not begin with a keyword"), "{error}");
    let error = refused("*NODE\n1, 0, 0\n");
    assert!(error.contains("main.INP: the mesh has no solid elements of dimension 2"), "{error}");
    let text = folder.join("main.msh");
    std::fs::write(&text, main).unwrap();
    let error = crate::mesh::read_file::<2>(&text, None, PlaneState::Strain).unwrap_err().message;
    assert!(error.contains("must end in .inp"), "{error}");
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A case of plane stress reads elements in plane stress only, one of plane strain those in plane strain only.
#[test]
fn elements_have_the_state_of_the_case() {
    let stressed = PLANE.replace("CPE", "CPS");
    for (text, plane, other) in
        [(PLANE, PlaneState::Strain, PlaneState::Stress), (&stressed, PlaneState::Stress, PlaneState::Strain)]
    {
        let read = |plane| labelled::<2>(&mut Deck::new("", text.as_bytes().to_vec(), None), None, plane);
        let parsed = read(plane).unwrap();
        assert_eq!(parsed.mesh.kinds, [ElementKind::Quad4; 2]);
        let error = read(other).map(drop).unwrap_err().message;
        let expected = format!("are {}, not {}", plane.name(), other.name());
        assert!(error.contains("line 12") && error.contains(&expected), "{error}");
        assert_eq!(
            error.contains("write `plane: stress` in the case"),
            other == PlaneState::Strain,
            "{error}"
        );
    }
}

/// One replacement in the plane input, and the message with its line.
#[test]
fn defects_are_refused_with_their_line() {
    let cases = [
        ("12, 11\n", "12\n", "line 15: element 7 has too few nodes"),
        ("12, 11\n", "12, 11, 3\n", "line 15: element 7 has too many nodes"),
        ("8, 2, 3, 13, 12", "8, 2, 3, 13, ", "line 17: element 8 lacks 1 of its nodes"),
        (
            "8, 2, 3, 13, 12",
            "8, 2, 3, 14, 12",
            "line 17: element 8 (quad4) uses node 14, which is not defined",
        ),
        ("8, 2, 3, 13, 12", "8, 2, 3, 3, 12", "line 17: element 8 (quad4) uses node 3 twice"),
        ("8, 2, 3, 13, 12", "7, 2, 3, 13, 12", "line 17: element 7 is defined twice"),
        (
            "8, 2, 3, 13, 12",
            "8, 2, 12, 13, 3",
            "line 17: element 8 (quad4) at (1.25, 0.3) is inverted at every",
        ),
        (
            "8, 2, 3, 13, 12",
            "8, 2, 3, 13, 12\n9, 3, 13, 12, 2",
            "line 18: element 9 (quad4) has the same corners",
        ),
        ("type=CPE4,", "type=CPS4,", "line 16: *ELEMENT: the elements of type CPS4 are plane stress"),
        ("type=CPE4,", "type=CPE5,", "line 16: *ELEMENT: unknown type CPE5"),
        ("type=CPE4,", "type=C3D8,", "line 16: *ELEMENT: the elements of type C3D8 are solid"),
        ("type=CPE4,", "type=C3D15,", "unknown type C3D15 (a wedge of second order)"),
        ("type=CPE4,", "type=C3D13,", "unknown type C3D13 (a pyramid of second order)"),
        ("type=CPE4,", "type=,", "line 16: *ELEMENT: the type of the elements is missing"),
        ("type=CPE4, elset=right", "type=CPE4, elset=", "line 16: *ELEMENT has no name: ELSET"),
        (" 13, 1.5, 0.6", " 13, 1.5, nan", "line 10: node 13: y is 'nan', not a finite number"),
        (" 13, 1.5, 0.6", " 13, 1.5, 0.6, 1", "line 10: node 13 at (1.5, 0.6, 1) is out of the plane"),
        (" 13, 1.5, 0.6", " 12, 1.5, 0.6", "line 10: node 12 is defined twice, first in line 9"),
        (" 13, 1.5, 0.6", " 13, 1.5, 0.6, 0, 0, 0, 1, 1", "line 10: node 13 has too many numbers"),
        (" 13, 1.5, 0.6", " x, 1.5, 0.6", "line 10: expected a node number, found 'x'"),
        ("*Node, nset", "*Node, system=C, nset", "line 4: *NODE: cylindrical"),
        ("*Node, nset", "*Node, input=a.txt, nset", "line 4: *NODE: data in another file"),
        ("Bottom, 13", "Buttom, 13", "line 24: there is no node set 'Buttom' above this line"),
        ("Bottom, 13", "Bottom, 14", "line 24: the set contains node 14, which is not defined"),
        ("1, 3\n", "4, 9\n", "line 20: there is no node from 4 to 9"),
        ("1, 3\n", "3, 1\n", "line 20: expected a range"),
        ("1, 3\n", "1, 3, 0\n", "line 20: expected a range"),
        ("7, s4", "7, s5", "line 30: surface 'side': face S5 of a quad4 element, which has 4 faces"),
        (
            "7, s4",
            "7, s2",
            "line 30: surface 'side': face S2 of the element at (0.5, 0.3) is inside the mesh",
        ),
        ("7, s4", "7, spos", "line 30: expected a face S1 to S6, found 'spos'"),
        ("7, s4", "9, s4", "line 30: the surface contains element 9, which is not defined"),
        ("7, s4", "whole, s4", "line 30: there is no element set 'whole'"),
        ("NAME=side", "NAM=side", "line 29: *SURFACE has no name"),
        (
            "*SURFACE, NAME=side",
            "*SURFACE, NAME=side, COMBINE=UNION",
            "line 29: *SURFACE: 'side' is a combination",
        ),
        ("*MATERIAL", "*NGEN", "line 36: *NGEN: a mesh that keywords generate"),
        ("*MATERIAL", "*SYSTEM", "line 36: *SYSTEM: nodes in a local system"),
        ("*MATERIAL", "*INCLUDE, INPUT=a.inp", "line 36: *INCLUDE is not possible here"),
    ];
    for (old, new, message) in cases {
        assert!(PLANE.contains(old), "{old}");
        let error = parse::<2>(PLANE.replacen(old, new, 1).as_bytes(), None).expect_err(new).message;
        assert!(error.contains(message), "{new}: {error}");
    }
    let mut latin = PLANE.as_bytes().to_vec();
    latin[PLANE.find("this").unwrap()] = 0xe4;
    assert!(parse::<2>(&latin, None).is_ok(), "titles are not looked at");
    latin[PLANE.find("Bottom, 13").unwrap()] = 0xe4;
    let error = parse::<2>(&latin, None).unwrap_err().message;
    assert!(error.contains("line 24: the line is not UTF-8"), "{error}");
}

/// Sets that contain themselves double with every line; ranges may name more numbers than there are.
#[test]
fn sets_do_not_fill_the_memory() {
    let text = PLANE.to_owned() + "*NSET, NSET=Bottom, GENERATE\n1, 18446744073709551615, 1\n";
    assert_eq!(parse::<2>(text.as_bytes(), None).unwrap().point_sets["Bottom"].len(), 6);
    let text = PLANE.to_owned() + "*NSET, NSET=Bottom\n" + &"Bottom\n".repeat(3);
    assert!(parse::<2>(text.as_bytes(), None).is_ok());
    let text = PLANE.to_owned() + &"*NSET, NSET=Bottom\nBottom, Bottom\n".repeat(100);
    let error = parse::<2>(text.as_bytes(), None).unwrap_err().message;
    assert!(error.contains("more than 64 members for each node and element"), "{error}");
}

/// Files with lines repeated, removed, exchanged and cut, and with bytes replaced, are a mesh or an
/// error.
#[test]
fn damaged_files_are_a_mesh_or_an_error() {
    let solid = single("C3D20R", &CUBE, &HEX_EDGES);
    let part = "*Part, name=P\n*Node\n1, 0, 0\n2, 1, 0\n3, 0, 1\n*Element, type=CPE3, elset=all\n1, 1, 2, 3\n*End Part\n\
                *Assembly, name=A\n*Instance, name=I, part=P\n0., 0., 0.\n*End Instance\n*Node\n1, 5, 5\n\
                *Nset, nset=all, instance=I, generate\n1, 3\n*Elset, elset=e, internal, instance=I\n1\n\
                *Surface, name=all\ne, S1\nI.1, S2\ne\n*Surface, name=n, type=NODE\nI.all\n*End Assembly\n*Step\n1, 2\n";
    let mut state = 7u64;
    let mut below = |bound: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % bound
    };
    let (mut meshes, mut errors) = (0, 0);
    for round in 0..3000 {
        let text = [PLANE, &solid, part][round % 3];
        let mut lines: Vec<&str> = text.split_inclusive('\n').collect();
        for _ in 0..1 + below(3) {
            let (one, other) = (below(lines.len()), below(lines.len()));
            match below(4) {
                0 => lines.insert(one, lines[other]),
                1 => drop(lines.remove(one)),
                2 => lines.swap(one, other),
                _ => lines.truncate(lines.len() / 2 + one / 2 + 1),
            }
        }
        let mut bytes = lines.concat().into_bytes();
        for _ in 0..below(4) {
            let at = below(bytes.len());
            bytes[at] = b"*,=.\"-019eEsS\n \xff"[below(16)];
        }
        for outcome in [parse::<2>(&bytes, None).map(drop), parse::<3>(&bytes, Some("e")).map(drop)] {
            match outcome {
                Ok(()) => meshes += 1,
                Err(error) => {
                    errors += 1;
                    assert_eq!(error.cause, crate::error::Cause::File, "{error}");
                }
            }
        }
    }
    assert!(meshes > 200 && errors > 1000, "{meshes} meshes and {errors} errors");
}
