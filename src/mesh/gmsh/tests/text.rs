//! A small mesh as text: errors are reported with their line, and harmless variants are read.

use super::super::parse;
use crate::mesh::Mesh;

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

/// The small mesh is read. Each defect is reported with its location, its reason and, if possible,
/// a remedy.
#[test]
fn broken_meshes_are_refused_with_place_and_reason() {
    let mesh: Mesh<2> = parse(SMALL.as_bytes(), None).unwrap();
    assert_eq!(mesh.set_nodes("under side").unwrap(), [0, 1]);
    assert_eq!(mesh.set_nodes("rubber").unwrap().len(), 6);
    let cases = [
        ("$MeshFormat\n2.2", "solid\n2.2", "line 1: this is not a Gmsh mesh"),
        ("2.2 0 8", "4 0 8", "line 2: expected version 2.2 or 4.1 of the MSH format, found '4'"),
        ("2.2 0 8", "2.2 2 8", "line 2: expected 0 for text or 1 for binary"),
        ("2.2 0 8", "2.2 0 4", "line 2: expected numbers of 8 bytes, found 4"),
        ("1 2 \"under", "x 2 \"under", "line 7: expected a dimension, a number and a name"),
        ("3 2 0 0\n", "3 2 0\n", "line 14: the node has too few numbers"),
        ("3 2 0 0\n", "3 2 0 0 0\n", "line 14: the node has too many numbers"),
        ("3 2 0 0\n", "3 nan 0 0\n", "line 14: node 3: x is NaN"),
        ("3 2 0 0\n", "3 2 1e999 0\n", "line 14: node 3: y is inf"),
        ("3 2 0 0\n", "3 2,5 0 0\n", "line 14: expected a coordinate, found '2,5'"),
        ("3 2 0 0\n", "2 2 0 0\n", "line 14: node 2 is defined twice"),
        ("3 2 0 0\n", "3 2 0 1e-3\n", "line 14: node 3 at (2, 0, 0.001) is out of the plane"),
        ("3 2 0 0\n", "-3 2 0 0\n", "line 14: expected a node number, found '-3'"),
        ("6\n1 0 0 0", "7\n1 0 0 0", "line 18: expected a node number, found '$EndNodes'"),
        ("6\n1 0 0 0", "5\n1 0 0 0", "line 17: expected $EndNodes: the section holds more"),
        ("6\n1 0 0 0", "7\n70 9 9 0\n1 0 0 0", "line 12: node 70 at (9, 9, 0) belongs to no element"),
        ("6\n1 0 0 0", "99999999999\n1 0 0 0", "line 11: 99999999999 nodes are declared, but only"),
        ("4\n1 15", "18446744073709551615\n1 15", "line 20: 18446744073709551615 elements are declared"),
        ("3 3 2 3 1 1", "3 3 999999999 3 1 1", "line 23: 999999999 tags are declared"),
        (
            "4 3 2 3 1 2 3 6 5",
            "4 14 2 3 1 2 3 6 5",
            "line 24: element 4: unknown type 14 (a pyramid of second order)",
        ),
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
        (
            "4 3 2 3 1 2 3 6 5",
            "4 3 2 3 1 1 2 5 4",
            "line 24: element 4 (quad4) has the same corners as element 3",
        ),
        (
            "6 2 1 0\n",
            "6 1.5 0.5 0\n",
            "line 24: element 4 (quad4) at (1.375, 0.375) is flat at its node 6 at (1.5, 0.5)",
        ),
        (
            "2 1 2 2 1 1 2",
            "2 1 2 2 1 1 5",
            "line 22: element 2 (line2) of set 'under side' is not a side of any element",
        ),
        ("2 1 2 2 1 1 2", "2 1 2 2 1 2 5", "of set 'under side' lies inside the mesh"),
        ("2 1 2 2 1 1 2", "2 8 2 2 1 1 2 3", "has other nodes than the line2 side of the quad4"),
        ("\"tip\"", "\"rubber\"", "different dimensions are both called 'rubber'"),
        ("1 15 2 1 6 6", "1 15 2 1 6 6 6", "line 21: the element has too many numbers"),
        ("$Nodes", "$Knots", "the file ends where $EndKnots is expected"),
        ("$EndElements\n", "$EndElements\nmore", "line 26: expected the start of a section, found 'more'"),
        ("$EndNodes", "$EndNodes\n$PartitionedEntities", "line 19: the mesh is partitioned"),
    ];
    for (from, to, expected) in cases {
        let found = broken(from, to);
        assert!(found.contains(expected), "{from:?} -> {to:?}\n  gives    {found}\n  expected {expected}");
    }
}

/// Node numbers may have gaps and any order. A duplicate number is detected even far from its first
/// occurrence.
#[test]
fn node_numbers_may_have_gaps_and_any_order() {
    let expected: Mesh<2> = parse(SMALL.as_bytes(), None).unwrap();
    let numbers = ["50", "9000000000000000001", "7", "1000000007", "8", "52"];
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

/// A node of a point set must belong to the body, unless a region is selected. The node then
/// belongs to another body.
#[test]
fn point_of_a_set_must_belong_to_the_body() {
    let alone = SMALL.replace("6\n1 0 0 0", "7\n7 9 9 0\n1 0 0 0").replace("1 15 2 1 6 6", "1 15 2 1 6 7");
    let error = parse::<2>(alone.as_bytes(), None).unwrap_err().message;
    assert!(error.contains("line 22: element 1 (point) of set 'tip' uses node 7"), "{error}");
    let mesh = parse::<2>(alone.as_bytes(), Some("rubber")).unwrap();
    assert_eq!(mesh.points.len(), 6);
    assert!(mesh.point_sets.is_empty());
}

/// A region drops unused nodes. Groups without a name are identified by their number.
#[test]
fn region_by_number_drops_loose_nodes() {
    let loose =
        SMALL.replace("6\n1 0 0 0", "7\n7 9 9 0\n1 0 0 0").replace("2 3 \"rubber\"", "2 4 \"unused\"");
    let mesh = parse::<2>(loose.as_bytes(), Some("3")).unwrap();
    assert_eq!((mesh.points.len(), mesh.element_count()), (6, 2));
    let error = parse::<2>(loose.as_bytes(), Some("unused")).unwrap_err().message;
    assert!(error.contains("region 'unused' has no elements\nhint: known regions: 3"), "{error}");
}

/// Three triangles at one edge are rejected.
#[test]
fn three_elements_at_one_side_are_refused() {
    let extra =
        SMALL.replace("6\n1 0 0 0", "7\n7 3 0.5 0\n1 0 0 0").replace("4\n1 15", "5\n5 2 2 3 1 2 7 5\n1 15");
    let error = parse::<2>(extra.as_bytes(), None).unwrap_err().message;
    assert!(error.contains("shares one side with two or more others: 5, 3, 4"), "{error}");
}

/// Windows line ends, comments, data sections, padded names and a missing final line end are
/// accepted.
#[test]
fn harmless_variants_are_read() {
    let mesh: Mesh<2> = parse(SMALL.as_bytes(), None).unwrap();
    let data = "$EndNodes\n$NodeData\n1\n\"x\"\n$EndNodeData";
    for variant in [
        SMALL.replace('\n', "\r\n"),
        SMALL.replace("$EndNodes", data),
        SMALL.replace("$PhysicalNames", "$Comments\nby hand\n$EndComments\n$PhysicalNames"),
        SMALL.trim_end().to_owned(),
        SMALL.replace("rubber\"", "rubber     \""),
    ] {
        assert_eq!(parse::<2>(variant.as_bytes(), None).unwrap(), mesh, "{variant}");
    }
}
