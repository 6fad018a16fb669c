use std::path::PathBuf;
use std::time::{Duration, Instant};

use proptest::prelude::*;

use super::{parse, read};
use crate::mesh::{ElementKind, Mesh, SetKind, measure};

const FORMATS: [&str; 4] = ["22a", "22b", "41a", "41b"];
const PLANE: [&str; 3] = ["tri6", "quad8", "quad9"];
const SOLID: [&str; 3] = ["tet10", "hex20", "hex27"];

fn fixture(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/gmsh").join(format!("{name}.msh"))
}

fn bytes(kind: &str, format: &str) -> Vec<u8> {
    std::fs::read(fixture(&format!("{kind}-{format}"))).unwrap()
}

fn all_kinds(mesh_kinds: &[ElementKind], name: &str) {
    assert!(mesh_kinds.iter().all(|kind| kind.name() == name), "{mesh_kinds:?}");
}

fn check_area<const D: usize>(mesh: &Mesh<D>, set: &str, area: [f64; D]) {
    let found = measure::area(mesh, &mesh.facet_sets[set]);
    for k in 0..D {
        assert!((found[k] - area[k]).abs() < 1e-10, "{set}: {found:?}");
    }
}

/// Plane meshes that Gmsh wrote, in all formats: area, sides outward, midside nodes between their corners, sets.
#[test]
fn plane_meshes_of_gmsh() {
    for kind in PLANE {
        for format in FORMATS {
            let mesh: Mesh<2> = parse(&bytes(kind, format), None).unwrap();
            all_kinds(&mesh.kinds, kind);
            measure::assert_straight(&mesh);
            assert!((measure::volume(&mesh) - 0.9).abs() < 1e-10);
            check_area(&mesh, "bottom", [0.0, -1.5]);
            check_area(&mesh, "top", [0.0, 1.5]);
            check_area(&mesh, "left", [-0.6, 0.0]);
            check_area(&mesh, "right", [0.6, 0.0]);
            let tip = mesh.set_nodes("tip").unwrap();
            assert_eq!(tip.iter().map(|&n| mesh.points[n as usize]).collect::<Vec<_>>(), [[1.5, 0.6]]);
            assert_eq!(mesh.element_sets["all"].len(), mesh.element_count());
            let regions = mesh.element_sets["rubber"].len() + mesh.element_sets["steel"].len();
            assert_eq!(regions, mesh.element_count());
        }
    }
}

/// Solid meshes that Gmsh wrote, in all formats: volume, sides outward, midside nodes between their corners, sets.
#[test]
fn solid_meshes_of_gmsh() {
    for kind in SOLID {
        for format in FORMATS {
            let mesh: Mesh<3> = parse(&bytes(kind, format), None).unwrap();
            all_kinds(&mesh.kinds, kind);
            measure::assert_straight(&mesh);
            assert!((measure::volume(&mesh) - 0.525).abs() < 1e-10);
            check_area(&mesh, "bottom", [0.0, 0.0, -1.05]);
            check_area(&mesh, "top", [0.0, 0.0, 1.05]);
            check_area(&mesh, "left", [-0.35, 0.0, 0.0]);
            check_area(&mesh, "right", [0.35, 0.0, 0.0]);
            let edge = mesh.set_nodes("edge").unwrap();
            assert_eq!(edge.len(), 5);
            assert!(edge.iter().all(|&n| mesh.points[n as usize][1..] == [0.0, 0.0]));
            assert_eq!(mesh.set_nodes("tip").unwrap().len(), 1);
            assert_eq!(mesh.element_sets["all"].len(), mesh.element_count());
        }
    }
}

/// Text and binary files of one mesh give the same mesh, number by number; text has 16 digits.
#[test]
fn text_and_binary_agree() {
    for version in ["22", "41"] {
        for kind in PLANE {
            check_formats::<2>(kind, version);
        }
        for kind in SOLID {
            check_formats::<3>(kind, version);
        }
    }
}

fn check_formats<const D: usize>(kind: &str, version: &str) {
    let text: Mesh<D> = parse(&bytes(kind, &format!("{version}a")), None).unwrap();
    let mut binary: Mesh<D> = parse(&bytes(kind, &format!("{version}b")), None).unwrap();
    for (a, b) in text.points.iter().zip(&mut binary.points) {
        assert!((0..D).all(|k| (a[k] - b[k]).abs() < 1e-15), "{kind}: {a:?} {b:?}");
        *b = *a;
    }
    assert_eq!(text, binary, "{kind}");
}

/// A region keeps its elements, the nodes that they use and its part of each set; its border becomes its surface.
#[test]
fn region_keeps_its_elements_and_nodes() {
    for format in FORMATS {
        let rubber: Mesh<2> = parse(&bytes("quad4", format), Some("rubber")).unwrap();
        assert_eq!((rubber.element_count(), rubber.points.len()), (2, 6));
        measure::assert_straight(&rubber);
        check_area(&rubber, "interface", [0.6, 0.0]);
        check_area(&rubber, "bottom", [0.0, -1.0]);
        let names: Vec<&str> = rubber.sets().into_iter().map(|(name, _)| name).collect();
        assert_eq!(names, ["all", "bottom", "interface", "left", "rubber", "top"]);
        let steel: Mesh<2> = parse(&bytes("quad4", format), Some("steel")).unwrap();
        assert_eq!((steel.element_count(), steel.points.len()), (1, 4));
        check_area(&steel, "interface", [-0.6, 0.0]);
        assert_eq!(steel.set_nodes("tip").map(|tip| steel.points[tip[0] as usize]), Some([1.5, 0.6]));
        assert!(steel.sets().contains(&("right", SetKind::Facets)));
    }
}

/// A facet set between two elements of the body is refused with the place and the cure.
#[test]
fn set_inside_the_mesh_is_refused() {
    let error = parse::<2>(&bytes("quad4", "22a"), None).unwrap_err().message;
    assert!(error.starts_with("line ") && error.contains("of set 'interface' lies inside"), "{error}");
    assert!(error.contains("hint: ") && error.contains("`region`"), "{error}");
    let error = parse::<2>(&bytes("quad4", "41b"), None).unwrap_err().message;
    assert!(error.starts_with("byte ") && error.contains("'interface'"), "{error}");
}

/// Errors carry the file's name, and a missing file is one of exit code 4.
#[test]
fn errors_carry_the_name_of_the_file() {
    let error = read::<2>(&fixture("none"), None).unwrap_err();
    assert!(error.message.contains("none.msh: the mesh can not be read"), "{error}");
    assert_eq!(error.exit_code(), 4);
    let error = read::<2>(&fixture("tri6-22a"), Some("robber")).unwrap_err();
    assert!(error.message.contains("tri6-22a.msh: the mesh has no region 'robber'"), "{error}");
    assert!(error.message.contains("hint: known regions: all, rubber, steel"), "{error}");
    assert_eq!(error.exit_code(), 4);
}

/// A name of another dimension is called by its dimension.
#[test]
fn region_of_another_dimension_is_refused() {
    let error = parse::<2>(&bytes("tri6", "41a"), Some("bottom")).unwrap_err().message;
    assert!(error.contains("'bottom' is a physical group of dimension 1"), "{error}");
}

/// Meshes of the other dimension are refused with both dimensions.
#[test]
fn mesh_of_another_dimension_is_refused() {
    let error = parse::<2>(&bytes("hex20", "22a"), None).unwrap_err().message;
    assert!(error.contains("(hex20) has 3 dimensions, the case has 2"), "{error}");
    let error = parse::<3>(&bytes("tri6", "22a"), None).unwrap_err().message;
    assert!(error.contains("no elements of dimension 3"), "{error}");
}

/// Two quadrilaterals, with a group of each kind.
const SMALL: &str = "$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
3
0 1 \"tip\"
1 2 \"under side\"
2 3 \"rubber\"
$EndPhysicalNames
$Nodes
6
1 0 0 0
2 1 0 0
3 2 0 0
4 0 1 0
5 1 1 0
6 2 1 0
$EndNodes
$Elements
4
1 15 2 1 6 6
2 1 2 2 1 1 2
3 3 2 3 1 1 2 5 4
4 3 2 3 1 2 3 6 5
$EndElements
";

fn broken(from: &str, to: &str) -> String {
    assert_eq!(SMALL.matches(from).count(), 1, "{from}");
    parse::<2>(SMALL.replace(from, to).as_bytes(), None).unwrap_err().message
}

/// The small mesh is read, and each way to break it gives its place, its reason and, where there is one, a cure.
#[test]
fn broken_meshes_are_refused_with_place_and_reason() {
    let mesh: Mesh<2> = parse(SMALL.as_bytes(), None).unwrap();
    assert_eq!(mesh.set_nodes("under side").unwrap(), [0, 1]);
    assert_eq!(mesh.set_nodes("rubber").unwrap().len(), 6);
    let cases = [
        ("$MeshFormat\n2.2", "solid\n2.2", "line 1: this is not a Gmsh mesh"),
        ("2.2 0 8", "4 0 8", "line 2: version '4' of the MSH format; known are 2.2 and 4.1"),
        ("2.2 0 8", "2.2 2 8", "line 2: expected 0 for text or 1 for binary"),
        ("2.2 0 8", "2.2 0 4", "line 2: numbers of 4 bytes"),
        ("1 2 \"under", "x 2 \"under", "line 7: expected a dimension, a number and a name"),
        ("3 2 0 0\n", "3 2 0\n", "line 14: the node has too few numbers"),
        ("3 2 0 0\n", "3 2 0 0 0\n", "line 14: the node has too many numbers"),
        ("3 2 0 0\n", "3 nan 0 0\n", "line 14: node 3: x is NaN"),
        ("3 2 0 0\n", "3 2 1e999 0\n", "line 14: node 3: y is inf"),
        ("3 2 0 0\n", "3 2,5 0 0\n", "line 14: expected a coordinate, found '2,5'"),
        ("3 2 0 0\n", "2 2 0 0\n", "line 14: node 2 is defined twice"),
        ("3 2 0 0\n", "3 2 0 1e-3\n", "line 14: node 3 at (2, 0, 0.001) is out of the plane"),
        ("3 2 0 0\n", "-3 2 0 0\n", "line 14: expected a node number, found -3"),
        ("6\n1 0 0 0", "7\n1 0 0 0", "line 18: expected a node number, found '$EndNodes'"),
        ("6\n1 0 0 0", "5\n1 0 0 0", "line 17: expected $EndNodes: the section holds more"),
        ("6\n1 0 0 0", "7\n70 9 9 0\n1 0 0 0", "line 12: node 70 at (9, 9, 0) belongs to no element"),
        ("6\n1 0 0 0", "99999999999\n1 0 0 0", "line 11: 99999999999 nodes are announced, but only"),
        ("4\n1 15", "18446744073709551615\n1 15", "line 20: 18446744073709551615 elements are announced"),
        ("3 3 2 3 1 1", "3 3 999999999 3 1 1", "line 23: 999999999 tags are announced"),
        ("4 3 2 3 1 2 3 6 5", "4 6 2 3 1 2 3 6 5", "line 24: element 4: unknown type 6 (a prism)"),
        ("4 3 2 3 1 2 3 6 5", "4 26 2 3 1 2 3 6 5", "unknown type 26 (a line of third or higher order)"),
        (
            "4 3 2 3 1 2 3 6 5",
            "4 3 2 3 1 2 3 6 8",
            "line 24: element 4 (quad4) uses node 8, which is not defined",
        ),
        ("4 3 2 3 1 2 3 6 5", "4 3 2 3 1 2 3 6 3", "line 24: element 4 (quad4) uses node 3 twice"),
        (
            "4 3 2 3 1 2 3 6 5",
            "4 3 2 3 1 2 5 6 3",
            "element 4 (quad4) at (1.5, 0.5) is inverted at every corner",
        ),
        (
            "4 3 2 3 1 2 3 6 5",
            "4 3 2 3 1 2 3 5 6",
            "line 24: element 4 (quad4) at (1.5, 0.5) is inverted at its node",
        ),
        ("4 3 2 3 1 2 3 6 5", "4 3 2 3 1 1 2 5 4", "line 24: element 4 (quad4) has the corners of element 3"),
        (
            "6 2 1 0\n",
            "6 1.5 0.5 0\n",
            "line 24: element 4 (quad4) at (1.375, 0.375) is flat at its node 6 at (1.5, 0.5)",
        ),
        (
            "2 1 2 2 1 1 2",
            "2 1 2 2 1 1 5",
            "line 22: element 2 (line2) of set 'under side' is no element's side",
        ),
        ("2 1 2 2 1 1 2", "2 1 2 2 1 2 5", "of set 'under side' lies inside the mesh"),
        ("2 1 2 2 1 1 2", "2 8 2 2 1 1 2 3", "has other nodes than the line2 side of the quad4"),
        ("\"tip\"", "\"rubber\"", "different dimensions are both called 'rubber'"),
        ("1 15 2 1 6 6", "1 15 2 1 6 6 6", "line 21: the element has too many numbers"),
        ("$Nodes", "$Knots", "the file ends where $EndKnots should follow"),
        ("$EndElements\n", "$EndElements\nmore", "line 26: expected the start of a section, found 'more'"),
        ("$EndNodes", "$EndNodes\n$PartitionedEntities", "line 19: the mesh is partitioned"),
    ];
    for (from, to, expected) in cases {
        let found = broken(from, to);
        assert!(found.contains(expected), "{from:?} -> {to:?}\n  gives    {found}\n  expected {expected}");
    }
}

/// Node numbers may have gaps and any order; the same number far from the first is still found to be twice.
#[test]
fn node_numbers_may_have_gaps_and_any_order() {
    let expected: Mesh<2> = parse(SMALL.as_bytes(), None).unwrap();
    let numbers = ["50", "51", "7", "1000000007", "8", "52"];
    let renumbered = |line: &str, places: &[usize]| -> String {
        let mut words: Vec<&str> = line.split(' ').collect();
        for &place in places {
            words[place] = numbers[words[place].parse::<usize>().unwrap() - 1];
        }
        words.join(" ") + "\n"
    };
    let lines = SMALL.lines().enumerate().map(|(index, line)| match index + 1 {
        12..=17 => renumbered(line, &[0]),
        21 => renumbered(line, &[5]),
        22 => renumbered(line, &[5, 6]),
        23 | 24 => renumbered(line, &[5, 6, 7, 8]),
        _ => format!("{line}\n"),
    });
    let text: String = lines.collect();
    assert_eq!(parse::<2>(text.as_bytes(), None).unwrap(), expected, "{text}");
    let twice = text.replace("\n8 1 1 0\n", "\n7 1 1 0\n");
    let error = parse::<2>(twice.as_bytes(), None).unwrap_err().message;
    assert!(error.contains("line 16: node 7 is defined twice"), "{error}");
}

/// A node of a point set must belong to the body, unless a region is chosen: then it is another body's.
#[test]
fn point_of_a_set_must_belong_to_the_body() {
    let alone = SMALL.replace("6\n1 0 0 0", "7\n7 9 9 0\n1 0 0 0").replace("1 15 2 1 6 6", "1 15 2 1 6 7");
    let error = parse::<2>(alone.as_bytes(), None).unwrap_err().message;
    assert!(error.contains("line 22: element 1 (point) of set 'tip' uses node 7"), "{error}");
    let mesh = parse::<2>(alone.as_bytes(), Some("rubber")).unwrap();
    assert_eq!(mesh.points.len(), 6);
    assert!(mesh.point_sets.is_empty());
}

/// A region drops nodes that nothing uses; groups without a name go by their number.
#[test]
fn region_by_number_drops_loose_nodes() {
    let loose =
        SMALL.replace("6\n1 0 0 0", "7\n7 9 9 0\n1 0 0 0").replace("2 3 \"rubber\"", "2 4 \"unused\"");
    let mesh = parse::<2>(loose.as_bytes(), Some("3")).unwrap();
    assert_eq!((mesh.points.len(), mesh.element_count()), (6, 2));
    let error = parse::<2>(loose.as_bytes(), Some("unused")).unwrap_err().message;
    assert!(error.contains("region 'unused' has no elements\nhint: known regions: 3"), "{error}");
}

/// Three triangles at one edge are no body.
#[test]
fn three_elements_at_one_side_are_refused() {
    let extra =
        SMALL.replace("6\n1 0 0 0", "7\n7 3 0.5 0\n1 0 0 0").replace("4\n1 15", "5\n5 2 2 3 1 2 7 5\n1 15");
    let error = parse::<2>(extra.as_bytes(), None).unwrap_err().message;
    assert!(error.contains("shares one side with two or more others: 5, 3, 4"), "{error}");
}

/// Line ends of Windows, comments, sections of data and no trailing line end are all read.
#[test]
fn harmless_variants_are_read() {
    let mesh: Mesh<2> = parse(SMALL.as_bytes(), None).unwrap();
    let data = "$EndNodes\n$NodeData\n1\n\"x\"\n$EndNodeData";
    for variant in [
        SMALL.replace('\n', "\r\n"),
        SMALL.replace("$EndNodes", data),
        SMALL.replace("$PhysicalNames", "$Comments\nby hand\n$EndComments\n$PhysicalNames"),
        SMALL.trim_end().to_owned(),
    ] {
        assert_eq!(parse::<2>(variant.as_bytes(), None).unwrap(), mesh, "{variant}");
    }
}

/// A writer of the small mesh in binary, of either byte order.
struct Writer {
    bytes: Vec<u8>,
    big: bool,
}

impl Writer {
    fn text(&mut self, text: &str) {
        self.bytes.extend_from_slice(text.as_bytes());
    }

    fn ints(&mut self, values: impl IntoIterator<Item = i32>) {
        for value in values {
            self.bytes.extend(if self.big { value.to_be_bytes() } else { value.to_le_bytes() });
        }
    }

    fn sizes(&mut self, values: impl IntoIterator<Item = u64>) {
        for value in values {
            self.bytes.extend(if self.big { value.to_be_bytes() } else { value.to_le_bytes() });
        }
    }

    fn reals(&mut self, values: impl IntoIterator<Item = f64>) {
        self.sizes(values.into_iter().map(f64::to_bits));
    }
}

const POINTS: [[f64; 3]; 6] =
    [[0., 0., 0.], [1., 0., 0.], [2., 0., 0.], [0., 1., 0.], [1., 1., 0.], [2., 1., 0.]];
const QUADS: [[i32; 4]; 2] = [[1, 2, 5, 4], [2, 3, 6, 5]];

/// The quadrilaterals in MSH 2.2, both in one block, or in 4.1 with parametric nodes.
fn binary(version: &str, big: bool) -> Vec<u8> {
    let mut w = Writer { bytes: Vec::new(), big };
    w.text(&format!("$MeshFormat\n{version} 1 8\n"));
    w.ints([1]);
    w.text("\n$EndMeshFormat\n");
    if version == "2.2" {
        w.text("$Nodes\n6\n");
        for (id, point) in (1..).zip(POINTS) {
            w.ints([id]);
            w.reals(point);
        }
        w.text("\n$EndNodes\n$Elements\n2\n");
        w.ints([3, 2, 2]);
        for (id, quad) in (1..).zip(QUADS) {
            w.ints([id, 7, 1]);
            w.ints(quad);
        }
    } else {
        w.text("$Entities\n");
        w.sizes([0, 0, 1, 0]);
        w.ints([1]);
        w.reals([0.0; 6]);
        w.sizes([1]);
        w.ints([-7]);
        w.sizes([2]);
        w.ints([1, -2]);
        w.text("\n$EndEntities\n$Nodes\n");
        w.sizes([1, 6, 1, 6]);
        w.ints([2, 1, 1]);
        w.sizes([6]);
        w.sizes(1..=6);
        for point in POINTS {
            w.reals(point);
            w.reals([0.5, 0.5]);
        }
        w.text("\n$EndNodes\n$Elements\n");
        w.sizes([1, 2, 1, 2]);
        w.ints([2, 1, 3]);
        w.sizes([2]);
        for (id, quad) in (1..).zip(QUADS) {
            w.sizes([id]);
            w.sizes(quad.map(|n| n as u64));
        }
    }
    w.text("\n$EndElements\n");
    w.bytes
}

/// Both byte orders give the same mesh, in both formats.
#[test]
fn both_byte_orders_are_read() {
    let expected: Mesh<2> = parse(&binary("2.2", false), None).unwrap();
    assert_eq!(expected.points, POINTS.map(|p| [p[0], p[1]]));
    assert_eq!(expected.element_nodes(1), [1, 2, 5, 4]);
    assert_eq!(expected.element_sets["7"], [0, 1]);
    for version in ["2.2", "4.1"] {
        for big in [false, true] {
            assert_eq!(parse::<2>(&binary(version, big), None).unwrap(), expected, "{version} {big}");
        }
    }
}

/// Every eight bytes of a binary file in turn become a huge count: each is refused at once, in little memory.
#[test]
fn huge_counts_are_refused_quickly() {
    let start = Instant::now();
    for version in ["2.2", "4.1"] {
        let good = binary(version, false);
        for at in 0..good.len() - 8 {
            let mut bad = good.clone();
            bad[at..at + 8].copy_from_slice(&0x7fff_ffff_7fff_ffffu64.to_le_bytes());
            let _ = parse::<2>(&bad, None);
        }
    }
    assert!(start.elapsed() < Duration::from_secs(10));
}

/// A file that is cut anywhere before its last word is refused, in every format.
#[test]
fn truncated_files_are_refused() {
    for format in FORMATS {
        let whole = bytes("quad8", format);
        for length in 0..whole.len() - 1 {
            assert!(parse::<2>(&whole[..length], None).is_err(), "{format} cut after {length} bytes");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    /// Damaged bytes never make the reader panic.
    #[test]
    fn damaged_files_never_panic(
        kind in prop::sample::select(vec!["quad4", "tri6", "quad9", "tet10", "hex27"]),
        format in prop::sample::select(FORMATS.to_vec()),
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let mut file = bytes(kind, format);
        for (at, value) in damage {
            let at = at.index(file.len());
            file[at] = value;
        }
        if let Some(cut) = cut {
            file.truncate(cut.index(file.len()));
        }
        let _ = parse::<2>(&file, None);
        let _ = parse::<3>(&file, None);
        let _ = parse::<2>(&file, Some("rubber"));
    }
}
