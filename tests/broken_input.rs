//! Broken input in the real program. Each run ends within seconds on all ranks, with its exit code
//! and one message that names location and remedy, and never with a panic.

mod common;

use std::fs;
use std::process::Command;
use std::time::Duration;

use common::{Folder, Output, SMALL_BLOCK, run};

const BOX: &str = "box: { min: [0, 0], max: [0.4, 0.4], cells: [4, 4] }";
const FRICTION: &str =
    "friction: { coulomb: { coefficient: 0.5, regularization: { stick_velocity: 1.0e-3 } } }";
const TIME: &str = "time: { end: 0.002, step: 5.0e-4 }";
const START: &str = "start: { equilibrium: { friction: false, increments: 2 } }\n";

/// A square of one element in Gmsh's format, with sets of all dimensions, one of them empty.
const SQUARE: &str = r#"$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
5
0 4 "corner"
1 1 "bottom"
1 2 "top"
1 5 "nothing"
2 3 "rubber"
$EndPhysicalNames
$Nodes
4
1 0 0 0
2 0.4 0 0
3 0.4 0.4 0
4 0 0.4 0
$EndNodes
$Elements
4
1 15 2 4 1 1
2 1 2 1 1 1 2
3 1 2 2 2 3 4
4 3 2 3 1 1 2 3 4
$EndElements
"#;

/// Two squares with separate nodes on their common line, as Gmsh writes without `Coherence`.
const UNJOINED: &str = r#"$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
3
1 1 "bottom"
1 2 "top"
2 3 "rubber"
$EndPhysicalNames
$Nodes
8
1 0 0 0
2 0.2 0 0
3 0.2 0.4 0
4 0 0.4 0
5 0.2 0 0
6 0.4 0 0
7 0.4 0.4 0
8 0.2 0.4 0
$EndNodes
$Elements
6
1 1 2 1 1 1 2
2 1 2 1 1 5 6
3 1 2 2 2 3 4
4 1 2 2 2 7 8
5 3 2 3 1 1 2 3 4
6 3 2 3 1 5 6 7 8
$EndElements
"#;

/// An element with a curved side that crosses its opposite side, while its corners are valid.
const FOLDED: &str = r#"$MeshFormat
2.2 0 8
$EndMeshFormat
$Nodes
8
1 0 0 0
2 0.4 0 0
3 0.4 0.4 0
4 0 0.4 0
5 0.2 0.6 0
6 0.4 0.2 0
7 0.2 0.4 0
8 0 0.2 0
$EndNodes
$Elements
1
1 16 2 1 1 1 2 3 4 5 6 7 8
$EndElements
"#;

/// Text to replace in the case and its replacement, the exit code, words of the message, and the
/// number of ranks (at most one: no `mpirun`).
type Broken = (&'static str, &'static str, i32, &'static [&'static str], usize);

const CASES: &[Broken] = &[
    (
        "cells: [4, 4] }",
        "cells: [4, 4], map: { x: \"0.4 - x\" } }",
        3,
        &["case.yml:5:75", "the map of the box", "[0.4, 0] m", "inverted", "hint: "],
        2,
    ),
    ("cells: [4, 4] }", "cells: [4, 4], map: { z: \"1\" } }", 3, &["case.yml:5:", "z", "2D"], 0),
    ("cells: [4, 4] }", "cells: [4, 4], map: { x: \"x + t\" } }", 3, &["case.yml:5:", "depend on t"], 0),
    (
        "cells: [4, 4] }",
        "cells: [4, 4], map: { y: \"sqrt(y - 1)\" } }",
        3,
        &["case.yml:5:75", "the value is not finite at t = 0, point [0, 0]"],
        1,
    ),
    (
        "title: Small block",
        "accuracy: { penetration: 1e-300 }",
        3,
        &[
            "case.yml:1:26: ",
            "1.0e-300 m",
            "spacing of coordinates",
            "accuracy.penetration",
            "{ relative: 1e-3 }",
        ],
        2,
    ),
    // Words of the case file.
    ("density:", "densty:", 3, &["case.yml:7:5", "unknown key 'densty'", "did you mean 'density'?"], 2),
    ("density: 1700", "density: heavy", 3, &["case.yml:7:14", "heavy"], 0),
    ("density: 1700", "density: [1700]", 3, &["case.yml:7:14"], 0),
    ("density: 1700", "density: \"1700 Pa\"", 3, &["case.yml:7:14", "kg/m3"], 0),
    ("young_modulus: 5.0e6", "young_modulus: \"5 Mpsi\"", 3, &["case.yml:6:47", "Mpsi"], 0),
    ("young_modulus: 5.0e6", "young_modulus: \"5 \"", 3, &["case.yml:6:47", "unit"], 0),
    ("young_modulus: 5.0e6, ", "", 3, &["'young_modulus' is missing"], 0),
    ("coulomb:", "coulumb:", 3, &["unknown friction law 'coulumb'", "known: none, coulomb, power_law"], 3),
    ("title: Small block", "title: [", 3, &["case.yml:"], 0),
    ("    density", "\tdensity", 3, &["case.yml:7"], 0),
    ("dimension: 2", "dimension: 2\ndimension: 2", 3, &["case.yml:3:1", "'dimension' occurs twice"], 0),
    // Ranges.
    ("density: 1700", "density: -1700", 3, &["case.yml:7:14", "density must be >= 0, found -1700"], 2),
    ("    density: 1700\n", "", 3, &["density", "block"], 0),
    ("poisson_ratio: 0.3", "poisson_ratio: 0.5", 3, &["case.yml:6:69", "0.5"], 0),
    ("dimension: 2", "dimension: 4", 3, &["case.yml:2:12", "2, 3 or axisymmetric, not 4"], 0),
    ("max: [0.4, 0.4]", "max: [0.4, -0.4]", 3, &["case.yml:5:", "along y", "max -0.4"], 0),
    ("cells: [4, 4]", "cells: [4, 0]", 3, &["case.yml:5:", "at least one cell"], 0),
    ("step: 5.0e-4", "step: 0", 3, &["the step must be > 0, found 0"], 3),
    ("step: 5.0e-4", "step: 1", 3, &["case.yml:19:", "the step 1 is longer", "0.002"], 0),
    ("step: 5.0e-4", "step: 5.0e-300", 3, &["case.yml:19:", "the run would take 4.0e296 steps"], 0),
    ("increments: 2", "increments: 4294967295", 3, &["case.yml:18:", "at most 1000000, found 4294967295"], 0),
    (
        "boundary:",
        "accuracy: { time: 1.0e-300 }\nboundary:",
        3,
        &["case.yml:16:", "1e-300", "1e-12 or more"],
        0,
    ),
    ("boundary:", "guard: { motion: 0 }\nboundary:", 3, &["the motion guard must be > 0"], 0),
    // Values that are too large.
    ("young_modulus: 5.0e6", "young_modulus: 1.0e308", 5, &["hint: ", "check the units of moduli"], 0),
    (
        "stick_velocity: 1.0e-3",
        "stick_velocity: 1.0e-300",
        5,
        &["tangent matrix is not finite", "check the units of moduli"],
        2,
    ),
    ("y: -0.01", "y: { table: [[0, .nan], [1, 0]] }", 3, &["case.yml:17"], 0),
    ("y: -0.01", "y: { table: [[0, 0], [0, 1]] }", 3, &["the times of a table must increase"], 0),
    ("y: -0.01", "y: \"-0.01 * tt\"", 3, &["case.yml:17", "tt"], 0),
    ("y: -0.01", "y: \"-0.01 / t\"", 3, &["case.yml:17", "not finite at t = 0"], 0),
    ("x: \"1.0 * t\"", "x: \"1e300 * t\"", 3, &["case.yml:17", "the derivative is 1e300", "t = 0"], 2),
    ("x: \"1.0 * t\"", "x: \"1e300 * t * x\"", 3, &["case.yml:17:46", "the derivative is", "t = "], 2),
    ("y: -0.01", "y: \"-0.01 / (x - 0.1)\"", 3, &["case.yml:17:60", "not finite", "[0.1, 0.4]"], 3),
    // Values that only the points of a mesh show.
    (
        "density: 1700",
        "density: 1700\n    initial_velocity: [\"1/x\", 0]",
        3,
        &["case.yml:8:24", "the value is not finite at t = 0, point [0, 0]", "1/x", "hint: "],
        2,
    ),
    (
        "boundary:",
        "boundary:\n  weight: { on: block, gravity: [0, \"sqrt(x - 0.2)\"] }",
        3,
        &["case.yml:17:37", "not finite", "sqrt"],
        2,
    ),
    (
        "boundary:",
        "boundary:\n  pull: { on: block.right, traction: { x: \"log(y - 0.2)\" } }",
        3,
        &["case.yml:17:43", "not finite"],
        0,
    ),
    (
        "boundary:",
        "boundary:\n  push: { on: block.right, pressure: \"sqrt(0.0015 - t + 0 * y)\" }",
        3,
        &["case.yml:17:38", "not finite at t = 0.002"],
        3,
    ),
    // Names and sets.
    ("on: block.top", "on: block.topp", 3, &["the box 'block' has no set 'topp'", "did you mean 'top'?"], 0),
    ("on: block.top", "on: block.front", 3, &["the box 'block' has no set 'front'"], 0),
    ("target: floor", "target: flor", 3, &["unknown target 'flor'", "did you mean 'floor'?"], 0),
    ("contactor: block.bottom", "contactor: floor", 3, &["'floor' is an obstacle"], 0),
    ("contactor: block.bottom", "contactor: block", 3, &["is a whole body"], 0),
    (
        "start:",
        "  pull: { on: block.left, displacement: { x: 0.1 } }\nstart:",
        3,
        &["'clamp' and 'pull'", "u_x of the node at (0, 0.4)", "remove x"],
        3,
    ),
    (
        "at: [0, 0]",
        "at: [7, 0]",
        3,
        &["case.yml:", "probe 'corner'", "6.6", "away from the nearest node", "hint: "],
        2,
    ),
    ("at: [0, 0]", "at: [0, 0, 0]", 3, &["probe", "2 entries in 2D, found 3"], 0),
    // Physics that can not be.
    (
        "normal: [0, 1]",
        "normal: [0, -1]",
        3,
        &["'sole'", "behind 'floor'", "free side", "normal of a plane", "side: outside or inside"],
        2,
    ),
    (
        "point: [0, 0]",
        "point: [0, 0.1]",
        3,
        &["'sole'", "5 nodes behind 'floor'", "1.000e-1 m", "set initial_overclosure"],
        2,
    ),
    ("normal: [0, 1]", "normal: [0, 0]", 3, &["the normal of a plane is zero"], 0),
    (
        "boundary:",
        "  heel: { contactor: block.bottom, target: floor }\nboundary:",
        3,
        &["case.yml:16:", "'sole' and 'heel' have the same two sides", "keep only one of them"],
        0,
    ),
    (
        "point: [0, 0]",
        "point: [0, -50]",
        3,
        &["'sole' can not close", "5.000e1 m", "hint: ", "lengths are in m"],
        3,
    ),
    (TIME, "time: { end: 1, scheme: { static: { increments: 2 } } }", 3, &["stick_velocity", "statics"], 0),
    ("boundary:", "solver: { linear: cg_icc }\nboundary:", 3, &["symmetric", "auto"], 2),
    (
        "point: [0, 0], normal: [0, 1] } }\ncontact:\n  sole:\n",
        "point: [0, 0.2], normal: [0, 1] } }\ncontact:\n  sole:\n    initial_overclosure: adjust\n",
        3,
        &["'sole'", "2.000e-1 m", "quarter of the facet size, 1.000e-1 m", "initial_overclosure to accept"],
        2,
    ),
    (
        "cells: [4, 4] }",
        "cells: [40, 4], map: { x: \"(1 + y) * cos(5 * pi * x)\", y: \"-(1 + y) * sin(5 * pi * x)\" } }",
        3,
        &["body 'block'", "coincide", "(5 such pairs)", "merge: { tolerance: "],
        2,
    ),
    (BOX, "box: { min: [0, 0], max: [1, 1], cells: [1, 1] }, merge: never", 3, &["it is a key of 'box'"], 0),
    // Files.
    (
        BOX,
        "file: unjoined.msh",
        4,
        &["unjoined.msh: line 13: node 2", "node 5 coincide", "(2 such pairs)", "Coherence"],
        2,
    ),
    (BOX, "file: unjoined.msh, merge: { tolerance: 0 }", 3, &["merge.tolerance must be > 0"], 0),
    (
        BOX,
        "file: unjoined.msh, merge: { tolerance: 1 }",
        4,
        &["unjoined.msh: line 27: element 5", "within merge.tolerance"],
        0,
    ),
    (
        BOX,
        "file: folded.msh",
        4,
        &["folded.msh: line 17: element 1 (quad8)", "inverted or flat inside", "hint: "],
        2,
    ),
    (BOX, "file: nowhere.msh", 4, &["nowhere.msh", "No such file"], 2),
    (BOX, "file: .", 4, &["directory"], 0),
    (BOX, "file: garbage.msh", 4, &["garbage.msh"], 2),
    (BOX, "file: empty.msh", 4, &["empty.msh"], 0),
    (BOX, "file: truncated.msh", 4, &["truncated.msh", "line"], 3),
    (BOX, "file: inverted.msh", 4, &["inverted.msh", "element"], 2),
    (BOX, "file: unknown.msh", 4, &["unknown.msh: line 24", "unknown type 99", "quad4"], 0),
    (BOX, "file: dangling.msh", 4, &["dangling.msh", "node"], 0),
    (BOX, "file: square.msh, region: rubbr", 4, &["square.msh", "rubbr", "rubber"], 2),
];

/// Bodies and their probe at coordinates so large that no digits are left.
const FAR_AWAY: &[Broken] = &[(
    BOX,
    "box: { min: [1.0e12, 0], max: [1000000000000.4, 0.4], cells: [4, 4] }",
    3,
    &["coordinates of 1.0e12 m", "2.2e-4 m", "closer to the origin"],
    2,
)];

/// Cases on a mesh file whose sets only the mesh defines.
const ON_A_FILE: &[Broken] = &[
    ("block.bottom", "block.sole", 3, &["block.sole", "block.bottom"], 2),
    ("block.bottom", "block.nothing", 3, &["block.nothing"], 3),
    ("block.bottom", "block.corner", 3, &["block.corner", "hint: "], 2),
    ("block.bottom", "block.rubber", 3, &["block.rubber", "hint: "], 0),
    ("block.bottom", "block.Bottom", 3, &["case.yml:12:16", "did you mean 'block.bottom'?"], 0),
    (
        "on: block.top",
        "on: block.roof",
        3,
        &["case.yml:17:16", "no set 'roof'", "block.corner", "block.top"],
        2,
    ),
    (
        "on: block.top, displacement: { x: \"1.0 * t\", y: -0.01 }",
        "on: block.corner, traction: { x: 1 }",
        3,
        &["case.yml:17:", "'block.corner' has points", "known: block.bottom"],
        2,
    ),
];

/// Contacts on a mesh file with the same facet in the sets `bottom` and `foot`.
const ON_COMMON_FACETS: &[Broken] = &[
    (
        "boundary:",
        "  heel: { contactor: block.foot, target: floor }\nboundary:",
        3,
        &[
            "case.yml:16:22: contacts 'sole' and 'heel' have 1 facets of the contactor and the obstacle 'floor' in common",
            "would be added: remove the common facets",
        ],
        2,
    ),
    (
        "boundary:",
        "  toe: { contactor: block.bottom, target: block.top }\n  heel: { contactor: block.foot, target: block.top }\nboundary:",
        3,
        &["case.yml:17:", "'toe' and 'heel'", "1 facets of the contactor and 1 facets of the target"],
        0,
    ),
];

fn check(output: &Output, code: i32, words: &[&str]) -> Result<(), String> {
    let said = format!("exit {:?} after {:?}\n{}{}", output.code, output.took, output.stdout, output.stderr);
    let fail = |what: String| Err(format!("{what}\n{said}"));
    if output.code != Some(code) {
        return fail(format!("expected exit code {code}"));
    }
    if let Some(word) = words.iter().find(|word| !output.stderr.contains(**word)) {
        return fail(format!("{word:?} is missing"));
    }
    if output.stderr.matches("contact-petsc: error: ").count() != 1 {
        return fail("not one message".into());
    }
    if ["panicked", "PETSC ERROR", "RUST_BACKTRACE"].iter().any(|word| said.contains(word)) {
        return fail("not our own words".into());
    }
    if output.took > Duration::from_secs(30) {
        return fail("took too long".into());
    }
    Ok(())
}

fn folder_with_meshes(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("square.msh", SQUARE);
    let named = SQUARE.replace("5\n0 4", "6\n1 6 \"foot\"\n0 4");
    folder.write("foot.msh", &named.replace("4\n1 15", "5\n5 1 2 6 6 1 2\n1 15"));
    folder.write("unjoined.msh", UNJOINED);
    folder.write("folded.msh", FOLDED);
    folder.write("garbage.msh", "\u{1}\u{2} not a mesh\n\u{fffd}");
    folder.write("empty.msh", "");
    folder.write("truncated.msh", &SQUARE[..SQUARE.find("3 1 2 2").unwrap() + 5]);
    folder.write("inverted.msh", &SQUARE.replace("1 2 3 4\n$End", "1 4 3 2\n$End"));
    folder.write("unknown.msh", &SQUARE.replace("4 3 2 3 1", "4 99 2 3 1"));
    folder.write("dangling.msh", &SQUARE.replace("1 2 3 4\n$End", "1 2 3 9\n$End"));
    folder
}

/// Runs all entries of the list, some at a time, each in its own folder.
fn all_refused(name: &str, base: &str, list: &[Broken]) {
    let at_once = std::thread::available_parallelism().map_or(1, usize::from);
    let failures: Vec<String> = std::thread::scope(|scope| {
        let parts = list.chunks(list.len().div_ceil(at_once)).enumerate().map(|(number, part)| {
            let folder = folder_with_meshes(&format!("{name}-{number}"));
            scope.spawn(move || part.iter().filter_map(|broken| taken(&folder, base, broken)).collect())
        });
        let parts: Vec<_> = parts.collect();
        parts.into_iter().flat_map(|part| -> Vec<String> { part.join().expect("a thread") }).collect()
    });
    assert!(failures.is_empty(), "{} of {}:\n{}", failures.len(), list.len(), failures.join("\n"));
}

/// Returns what is wrong with the refusal of a broken case.
fn taken(folder: &Folder, base: &str, (from, to, code, words, ranks): &Broken) -> Option<String> {
    assert!(base.contains(from), "not in the case: {from}");
    folder.write("case.yml", &base.replacen(from, to, 1));
    let output = run(*ranks, &["case.yml", "-o", "out"], folder);
    let failure = check(&output, *code, words).err()?;
    Some(format!("--- {from} -> {to} on {ranks} ranks: {failure}"))
}

/// A wrong word, number, name, set or file in a case is refused with its location and a remedy.
#[test]
fn broken_cases_are_refused_on_1_2_and_3_ranks() {
    all_refused("broken", SMALL_BLOCK, CASES);
    all_refused("far", &SMALL_BLOCK.replace("at: [0, 0]", "at: [1.0e12, 0]"), FAR_AWAY);
}

/// Errors that only the mesh reveals are reported together: non-finite values at a node, and probes
/// far from all bodies.
#[test]
fn faults_that_the_mesh_shows_are_told_together_on_1_and_2_ranks() {
    let folder = Folder::new("together");
    folder.write("case.yml", FAULTY);
    for ranks in [0, 2] {
        let output = run(ranks, &["case.yml", "-o", "out"], &folder);
        let words = [
            "case.yml:3:179: the value is not finite at t = 0, point [0, 0]",
            "case.yml:4:56: the value is not finite at t = 0, point [0, 0]",
            "case.yml:6:32: probe 'far' is 5.657e0 m away from the nearest node",
        ];
        check(&output, 3, &words).unwrap_or_else(|e| panic!("{e}"));
    }
}

const FAULTY: &str = "dimension: 2
bodies:
  block: { mesh: { box: { min: [0, 0], max: [1, 1], cells: [2, 2] } }, material: { neo_hookean: { young_modulus: 5.0e6, poisson_ratio: 0.3 } }, density: 1000, initial_velocity: [1/x, 0] }
boundary: { base: { on: block.left, displacement: { x: 1/y, y: 0 } } }
time: { end: 1, step: 0.1 }
output: { probes: { far: { at: [5, 5], on: block } } }
";

/// A penetration that coordinates barely resolve is accepted.
#[test]
fn a_penetration_above_the_spacing_of_coordinates_is_accepted() {
    let folder = Folder::new("penetration");
    for asked in ["1e-16", "{ relative: 1e-12 }"] {
        folder.write("case.yml", &format!("{SMALL_BLOCK}accuracy: {{ penetration: {asked} }}\n"));
        run(0, &["check", "case.yml"], &folder).success();
    }
}

/// Errors that only the mesh file reveals are refused with location and remedy.
#[test]
fn sets_that_the_mesh_lacks_are_refused_on_1_2_and_3_ranks() {
    let mesh = SMALL_BLOCK.replace(BOX, "file: square.msh, region: rubber");
    all_refused("sets", &mesh, ON_A_FILE);
    all_refused("common", &mesh.replace("square", "foot"), ON_COMMON_FACETS);
}

/// A mesh file whose dimension differs from that of the case is refused.
#[test]
fn a_mesh_of_another_dimension_is_refused() {
    let folder = folder_with_meshes("dimension");
    let case = SMALL_BLOCK.replace(BOX, "file: square.msh").replace("dimension: 2", "dimension: 3");
    let case = case.replace("[0, 0]", "[0, 0, 0]").replace("[0, 1]", "[0, 0, 1]");
    folder.write("case.yml", &case);
    let output = run(2, &["case.yml"], &folder);
    check(&output, 4, &["square.msh", "no elements of dimension 3"]).unwrap();
}

/// In statics a body without support and contact is an error that names it.
#[test]
fn a_body_that_nothing_holds_is_refused_on_2_ranks() {
    let folder = Folder::new("loose");
    let loose = "  loose:\n    mesh: { box: { min: [1, 0], max: [2, 1], cells: [2, 2] } }\n    \
                 material: { neo_hookean: { young_modulus: 5.0e6, poisson_ratio: 0.3 } }\nobstacles:";
    let case =
        SMALL_BLOCK.replace("obstacles:", loose).replace(START, "").replace(FRICTION, "friction: none");
    let case = case.replace(TIME, "time: { end: 1, scheme: { static: { increments: 2 } } }");
    let half = case.replace("boundary:", "boundary:\n  half: { on: loose.top, displacement: { y: 0 } }");
    for (case, words) in [(&case, "holds the body 'loose'"), (&half, "holds 'loose' along x")] {
        folder.write("case.yml", case);
        for command in [&["case.yml", "-o", "out"][..], &["check", "case.yml"][..]] {
            check(&run(2, command, &folder), 3, &[words, "hint: "]).unwrap();
        }
    }
}

/// A block that a load pushes along a frictionless floor has no equilibrium, and the program
/// reports this.
#[test]
fn a_body_that_slides_away_is_refused_on_2_ranks() {
    let folder = Folder::new("slides");
    let case = SMALL_BLOCK
        .replace(START, "")
        .replace(FRICTION, "friction: none")
        .replace(
            "on: block.top, displacement: { x: \"1.0 * t\", y: -0.01 }",
            "on: block.top, traction: { x: 1.0e4, y: -1.0e5 }",
        )
        .replace(TIME, "time: { end: 1, scheme: { static: { increments: 2 } } }");
    folder.write("case.yml", &case);
    let output = run(2, &["case.yml", "-o", "out"], &folder);
    assert!([Some(3), Some(5)].contains(&output.code), "{}{}", output.stdout, output.stderr);
    assert!(output.stderr.contains("no support holds 'block' along x"), "{}", output.stderr);
}

/// PETSc's options: a stray word is a usage error. A method that does not fit or does not exist is
/// named. An option file that PETSc could not read, or would wait for, is named as well.
#[test]
fn petsc_options_are_checked_on_1_and_2_ranks() {
    let folder = Folder::new("options");
    folder.write("case.yml", SMALL_BLOCK);
    folder.write("case.txt", SMALL_BLOCK);
    assert!(Command::new("mkfifo").arg(folder.join("pipe")).status().expect("mkfifo").success());
    for (options, code, words, ranks) in [
        (&["ksp_monitor"][..], 2, &["`ksp_monitor`", "PETSc option", "after `--`"][..], 2),
        (&["-ksp_type", "cg"], 3, &["'cg'", "symmetric matrix", "-ksp_type gmres"], 2),
        (&["-start_ksp_type", "nonsense"], 2, &["nonsense"], 2),
        (&["-ksp_type", "nonsense"], 2, &["nonsense"], 1),
        (&["-mass_ksp_rtol", "tight"], 2, &["tight", "-mass_ksp_rtol"], 2),
        (&["-options_file", "pipe"], 4, &["pipe: ", "a named pipe", "one option per line"], 2),
        (&["-options_file", "absent"], 4, &["absent: ", "PETSc options file", "No such file", "hint: "], 0),
        (&["-options_file", "case.txt"], 4, &["case.txt: line 1: `title: Small block`", "PETSc option"], 1),
    ] {
        let line = [&["case.yml", "-o", "out", "--"], options].concat();
        check(&run(ranks, &line, &folder), code, words).unwrap_or_else(|e| panic!("{options:?}: {e}"));
    }
}

/// Wrong command lines are usage errors.
#[test]
fn wrong_command_lines_are_usage_errors() {
    let folder = Folder::new("usage");
    for (line, words, ranks) in [
        (&[][..], "no case file and no command", 0),
        (&["a.yml", "b.yml"], "b.yml", 2),
        (&["a.yml", "--restrat"], "--restrat", 2),
        (&["a.yml", "--wall-time", "soon"], "0:55:00", 0),
        (&["a.yml", "-q", "-v"], "cannot be used with", 0),
        (&["plot"], "RESULTS", 0),
        (&["list", "more"], "more", 0),
        (&["lst"], "did you mean `contact-petsc list`?", 2),
        (&["chek", "base.yml"], "did you mean `contact-petsc check`?", 0),
        (&["quux"], "no such command or case file: 'quux'", 0),
    ] {
        check(&run(ranks, line, &folder), 2, &[words]).unwrap_or_else(|e| panic!("{line:?}: {e}"));
    }
}

/// Files and folders that cannot be read or written are named.
#[test]
fn unusable_files_are_named_on_1_and_2_ranks() {
    let folder = Folder::new("files");
    folder.write("case.yml", SMALL_BLOCK);
    fs::write(folder.join("binary.yml"), [0u8, 159, 146, 150]).unwrap();
    folder.write("empty.yml", "");
    fs::create_dir(folder.join("theirs")).unwrap();
    folder.write("theirs/thesis.txt", "years of work");
    for (line, code, words, ranks) in [
        (&["absent.yml"][..], 4, &["absent.yml", "No such file"][..], 2),
        (&["check", "absent.yml"], 4, &["absent.yml"], 2),
        (&["."], 4, &["directory"], 0),
        (&["binary.yml"], 3, &["binary.yml", "not text"], 2),
        (&["empty.yml"], 3, &["empty.yml"], 0),
        (&["case.yml", "-o", "/proc/out"], 4, &["/proc/out", "hint: "], 2),
        (&["case.yml", "-o", "theirs"], 4, &["theirs", "nothing was changed", "hint: "], 2),
        (&["case.yml", "-o", "case.yml"], 4, &["case.yml", "hint: "], 0),
        (&["plot", "theirs"], 4, &["theirs", "run.json", "hint: "], 0),
        (&["plot", "absent"], 4, &["absent"], 0),
    ] {
        check(&run(ranks, line, &folder), code, words).unwrap_or_else(|e| panic!("{line:?}: {e}"));
    }
    assert_eq!(fs::read_to_string(folder.join("theirs/thesis.txt")).unwrap(), "years of work");
}
