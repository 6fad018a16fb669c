//! Forces per length on edges: total force and moment on every element, on any number of ranks.

mod common;

use common::{Folder, Results, assert_says, run};

/// A plate with a force per length along its upper right edge that varies with y.
fn plate(element: &str) -> String {
    format!(
        "dimension: 3
bodies:
  plate:
    mesh: {{ box: {{ min: [0, 0, 0], max: [1, 2, 0.2], cells: [2, 3, 1], element: {element}, map: {{ y: 'y + 0.1 * y * (2 - y)' }} }} }}
    material: {{ saint_venant_kirchhoff: {{ young_modulus: 1.0e7, poisson_ratio: 0.3 }} }}
    kinematics: linear
    sets: {{ edge: {{ of: nodes, where: 'x > 1 - 1e-9 and z > 0.2 - 1e-9' }} }}
boundary:
  clamp: {{ on: plate.left, displacement: {{ x: 0, y: 0, z: 0 }} }}
  blade: {{ on: plate.edge, line_force: {{ x: 3, z: '-10 * (1 + y)' }} }}
time: {{ end: 1, scheme: {{ static: {{ increments: 1 }} }} }}
solver: {{ linear: direct }}
"
    )
}

/// The support carries the resultant `int q dl` and its moment, whatever the elements and ranks.
#[test]
fn the_resultant_is_that_of_the_line() {
    for (element, ranks) in [
        ("hex8", 1),
        ("hex8", 4),
        ("tet4", 2),
        ("wedge6", 1),
        ("pyramid5", 2),
        ("hex20", 3),
        ("hex27", 1),
        ("tet10", 3),
    ] {
        let reactions = Results::of(&plate(element), ranks).table("reactions.csv");
        // int (1 + y) dy = 4 and int y (1 + y) dy = 14 / 3 over [0, 2].
        let [force_x, force_z] = [3.0 * 2.0, -10.0 * 4.0];
        let first = -10.0 * 14.0 / 3.0;
        let moment = [first, 0.2 * force_x - force_z, -3.0 * 2.0];
        let columns = ["force_x", "force_y", "force_z"];
        for (column, expected) in columns.into_iter().zip([force_x, 0.0, force_z]) {
            let found = reactions.last(column);
            assert!((found + expected).abs() < 1e-9 * 40.0, "{column} of {element} on {ranks}: {found}");
        }
        // The columns have the moment at the current positions, which differ by the displacement.
        for (column, expected) in ["moment_x", "moment_y", "moment_z"].into_iter().zip(moment) {
            let found = reactions.last(column);
            assert!((found + expected).abs() < 1e-9 * 40.0, "{column} of {element} on {ranks}: {found}");
        }
    }
}

/// One hexahedron with a physical surface on the left and a physical curve along the upper right edge.
const BRICK: &str = "$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
3
3 1 \"brick\"
2 2 \"left\"
1 3 \"edge\"
$EndPhysicalNames
$Nodes
8
1 0 0 0
2 1 0 0
3 1 2 0
4 0 2 0
5 0 0 0.2
6 1 0 0.2
7 1 2 0.2
8 0 2 0.2
$EndNodes
$Elements
3
1 5 2 1 1 1 2 3 4 5 6 7 8
2 3 2 2 2 1 5 8 4
3 1 2 3 3 6 7
$EndElements
";

/// A physical curve of a Gmsh mesh is the line.
#[test]
fn a_physical_curve_is_a_line() {
    let text = plate("hex8");
    let (head, tail) = text.split_once("    mesh:").expect("a mesh");
    let (_, tail) = tail.split_once("\n").expect("a line");
    let (middle, tail) = tail.split_once("    sets:").expect("sets");
    let (_, tail) = tail.split_once("\n").expect("a line");
    let folder = Folder::new("curve");
    folder.write("brick.msh", BRICK);
    folder.write("case.yml", &format!("{head}    mesh: {{ file: brick.msh }}\n{middle}{tail}"));
    run(2, &["case.yml", "-q", "-o", "out"], &folder).success();
    let reactions = Results(folder).table("reactions.csv");
    for (column, expected) in
        [("force_x", -6.0), ("force_y", 0.0), ("force_z", 40.0), ("moment_x", 140.0 / 3.0)]
    {
        let found = reactions.last(column);
        assert!((found - expected).abs() < 1e-9 * 40.0, "{column}: {found}");
    }
}

/// Mistakes are reported with line, cause and cure.
#[test]
fn wrong_line_forces_are_refused() {
    let good = plate("hex8");
    let rows = [
        (good.replace("on: plate.edge", "on: plate.top"), "a line force acts on a set of points"),
        (good.replace("on: plate.edge", "on: plate"), "a line force acts on a set of points"),
        (good.replace("on: plate.edge", "on: plate.edges"), "no set 'edges'"),
        (
            good.replace(
                "'x > 1 - 1e-9 and z > 0.2 - 1e-9'",
                "'x > 1 - 1e-9 and y < 1e-9 and z > 0.2 - 1e-9'",
            ),
            "has no edge of an element",
        ),
        (good.replace("{ x: 3, z: '-10 * (1 + y)' }", "{}"), "has no components"),
        (good.replace("x: 3,", "x: 3 N,"), "N"),
        (
            good.replace("dimension: 3", "dimension: 2")
                .replace(
                    "min: [0, 0, 0], max: [1, 2, 0.2], cells: [2, 3, 1], element: hex8",
                    "min: [0, 0], max: [1, 2], cells: [2, 3]",
                )
                .replace(", z: 0 }", " }")
                .replace(", z: '-10 * (1 + y)'", ""),
            "a line force acts in 3D only",
        ),
    ];
    for (text, words) in rows {
        let folder = Folder::new("line");
        folder.write("case.yml", &text);
        let output = run(0, &["case.yml", "-q"], &folder);
        assert_eq!(output.code, Some(3), "{words}: {}", output.text());
        assert_says(&output.stderr, &["case.yml:", words]);
    }
}
