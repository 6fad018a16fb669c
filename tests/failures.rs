//! An error on one rank ends all ranks within seconds, with one message and an exit code.

mod common;

use std::path::Path;
use std::time::{Duration, Instant};

use common::{Folder, Output, Running, assert_says, run};

/// Time limit, generous for a loaded machine. Only a hang reaches it.
const LIMIT: Duration = Duration::from_secs(300);

fn rubber_block(changes: &[(&str, &str)]) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes/rubber-block/case.yml");
    let small = [("cells: [48, 50]", "cells: [8, 8]"), ("end: 0.07", "end: 0.02")];
    let text = std::fs::read_to_string(path).expect("the case");
    small.iter().chain(changes).fold(text, |text, (from, to)| {
        assert!(text.contains(from), "no '{from}'");
        text.replace(from, to)
    })
}

/// Starts a case, modifies its folder while it runs, and waits for its end.
fn disturbed(text: &str, ranks: usize, disturb: impl FnOnce(&Folder)) -> Output {
    let folder = Folder::new("failures");
    folder.write("case.yml", text);
    let running = Running::start(ranks, &["case.yml", "--output", "out", "--quiet"], &folder);
    disturb(&folder);
    running.wait(LIMIT)
}

/// Checks the exit code, and that the program's message appears once.
#[track_caller]
fn ended(output: &Output, code: i32, fragments: &[&str]) {
    assert_eq!(output.code, Some(code), "{}", output.stderr);
    assert_eq!(output.stderr.matches("contact-petsc: error:").count(), 1, "{}", output.stderr);
    assert_says(&output.stderr, fragments);
}

/// Rank 1 cannot write its part.
#[test]
fn unwritable_piece_of_rank_1_on_2_ranks() {
    let text = rubber_block(&[("every: 10", "every: 40")]);
    let output = disturbed(&text, 2, |folder| {
        let deadline = Instant::now() + LIMIT;
        while !folder.join("out/fields/step_000000").exists() && Instant::now() < deadline {
            std::thread::sleep(Duration::from_millis(1));
        }
        let obstacle = folder.join("out/fields/step_000040/volume_0001.vtu/occupied");
        std::fs::create_dir_all(obstacle).expect("a folder in the way");
    });
    ended(&output, 4, &["volume_0001.vtu"]);
}

/// A prescribed value is not finite at a few nodes, which belong to only one rank of three.
#[test]
fn bad_support_on_one_rank_on_3_ranks() {
    let jump = "x: \"t + if(x > 0.4, sqrt(0.005 - t), 0)\", y";
    let output = disturbed(&rubber_block(&[("x: \"1.0 * t\", y", jump)]), 3, |_| ());
    ended(&output, 3, &["not finite", "sqrt(0.005 - t)"]);
}

/// Rank 0 cannot read the mesh.
#[test]
fn missing_mesh_on_3_ranks() {
    let mesh =
        ("{ box: { min: [0, 0], max: [0.48, 0.5], cells: [8, 8], element: quad4 } }", "{ file: no.msh }");
    let output = disturbed(&rubber_block(&[mesh]), 3, |_| ());
    ended(&output, 4, &["no.msh"]);
}

/// A block with prescribed motion of all nodes is pushed into a floor whose force is not finite at
/// the depth of the first step. The step is cut like any failed step, and some steps are completed.
/// The run ends with the node and the force, and no table has a non-finite value. The force acts on
/// no free unknown, so the residual alone does not reveal it.
#[test]
fn a_force_that_overflows_is_a_failed_step_on_1_3_ranks() {
    let text = "
dimension: 2
bodies:
  block:
    mesh: { box: { min: [0, 0], max: [1, 1], cells: [2, 1] } }
    material: { neo_hookean: { young_modulus: 1e7, poisson_ratio: 0.3 } }
    density: 1000
obstacles: { floor: { plane: { point: [0, 0], normal: [0, 1] } } }
contact:
  sole: { contactor: block.bottom, target: floor, normal: { power_law: { stiffness: 1e260, exponent: 50 } }, friction: none }
boundary: { all: { on: block, displacement: { x: 0, y: \"-100 * t\" } } }
time: { end: 0.2, step: 0.1, cuts: 12 }
";
    for ranks in [1, 3] {
        let folder = Folder::new("beyond");
        folder.write("case.yml", text);
        let output = Running::start(ranks, &["case.yml", "--output", "out", "--quiet"], &folder).wait(LIMIT);
        ended(&output, 5, &["contact force", "node 0, [0, 0] m, on rank"]);
        let record = std::fs::read_to_string(folder.join("out/run.json")).expect("a record");
        let record: serde_json::Value = serde_json::from_str(&record).expect("JSON");
        let count = |name: &str| record[name].as_u64().unwrap_or(0);
        assert!(count("cut_steps") > 10 && count("steps") > 0, "{} cuts", count("cut_steps"));
        for table in ["contact.csv", "energy.csv", "reactions.csv", "iterations.csv"] {
            let text =
                std::fs::read_to_string(folder.join("out").join(table)).expect("a table").to_lowercase();
            assert!(!text.contains("nan") && !text.contains("inf"), "{table}: {text}");
        }
    }
}

/// Elements that become inverted at some position whatever the cutback.
#[test]
fn inverted_element_on_3_ranks() {
    let crushed = ("y: -0.05", "y: \"-0.05 - 60 * t\"");
    let output = disturbed(&rubber_block(&[crushed]), 3, |_| ());
    ended(&output, 6, &["element ", "inverted", "det F = -", "a shorter step"]);
}

/// A block without support along the plane it is pressed against, and the pressing load.
fn pressed(load: &str) -> String {
    format!(
        "
dimension: 2
bodies:
  block:
    mesh: {{ box: {{ min: [0, 0], max: [1, 0.5], cells: [6, 3] }} }}
    material: {{ neo_hookean: {{ young_modulus: 1.0e7, poisson_ratio: 0.3 }} }}
    density: 1000
obstacles: {{ floor: {{ plane: {{ point: [0, 0], normal: [0, 1] }} }} }}
contact:
  sole:
    contactor: block.bottom
    target: floor
    normal: {{ penalty: {{ compliance: 1.0e-9 }} }}
    friction: {{ coulomb: {{ coefficient: 0.5, regularization: {{ stick_velocity: 1.0e-3 }} }} }}
    initial_overclosure: accept
boundary: {{ press: {{ on: block.top, traction: {{ {load} }} }} }}
start: {{ equilibrium: {{ friction: false, increments: 1 }} }}
time: {{ end: 1.0e-3, step: 1.0e-3 }}
"
    )
}

/// If the block is pressed perpendicularly, the start needs no holding force, and the run reports
/// this. If it is pressed obliquely, there is no frictionless equilibrium, and the error names
/// body, direction and force.
#[test]
fn a_frictionless_start_needs_loads_that_balance_on_1_3_ranks() {
    for ranks in [1, 3] {
        let aslant = disturbed(&pressed("x: 2.0e3, y: -1.0e4"), ranks, |_| ());
        // At the part of the loads that was tried last, 1/64.
        ended(&aslant, 5, &["nothing resists the motion of 'block' along x", "3.125e1 N"]);
        let folder = Folder::new("pressed");
        folder.write("case.yml", &pressed("y: -1.0e4"));
        let straight = Running::start(ranks, &["case.yml", "--output", "out"], &folder).wait(LIMIT);
        assert_eq!(straight.code, Some(0), "{}", straight.stderr);
        let note = "1 free motion was restrained (the motion of 'block' along x), and no force was needed";
        assert_says(&straight.stderr, &[note]);
    }
}

/// Two bodies at a distance of `GAP`, one of which may be moved towards the other.
const APART: &str = "title: apart
dimension: 2
bodies:
  left: { mesh: { box: { min: [0, 0], max: [1, 1], cells: [2, 2] } }, material: RUBBER, density: 1000, VELOCITY }
  right: { mesh: { box: { min: [GAP, 0], max: [END, 1], cells: [2, 2] } }, material: RUBBER, density: 1000 }
contact:
  touch: { contactor: left.right, target: right.left, normal: { penalty: { compliance: 1.0e-9 } } }
LOADS
time: { end: 1, step: 0.1 }
";

/// A contact that starts far open can close by prescribed motion, by an initial velocity, or by
/// loads with enough time. Without these the contact is refused, by `check` and in a run.
#[test]
fn contacts_that_can_not_close_are_refused_on_1_and_3_ranks() {
    let folder = Folder::new("apart");
    let filled = |gap: f64, velocity: &str, loads: &str| {
        let rubber = "{ neo_hookean: { young_modulus: 5.0e6, poisson_ratio: 0.3 } }";
        let text = APART.replace("RUBBER", rubber).replace("VELOCITY", velocity).replace("LOADS", loads);
        text.replace("GAP", &gap.to_string()).replace("END", &(gap + 1.0).to_string())
    };
    let pushed = "boundary: { push: { on: left.left, traction: { x: 1.0e5 } } }";
    let carried = "boundary: { carry: { on: left.left, displacement: { x: \"50 * t\" } } }";
    // A pulse so short that equal instants miss it.
    let thrown = "boundary: { throw: { on: left.left, displacement: { x: { table: [[0, 0], [0.001, 5], [0.002, 0]] } } } }";
    let blow = "boundary: { blow: { on: left.left, traction: { x: { table: [[0, 0], [0.005, 8e6], [0.01, 0]] } } } }";
    let still = "boundary: { one: { on: left, displacement: { x: 0, y: 0 } }, \
                 other: { on: right, displacement: { x: 0, y: 0 } } }"
        .to_owned();
    let drawn = "boundary: { weight: { on: left, gravity: [20, 0] } }";
    let rows = [
        (20.0, "", "", false),
        (20.0, "initial_velocity: [1, 0]", "", false),
        (20.0, "initial_velocity: [10, 0]", "", true),
        (20.0, "", pushed, true),
        (20.0, "", drawn, true),
        (2000.0, "", drawn, false),
        (40.0, "", carried, true),
        (40.0, "", thrown, true),
        // A load that varies by an expression, a blow by a table, a motion that few steps see.
        (40.0, "", "boundary: { w: { on: left, gravity: [\"500*sin(20*pi*t)^2\", 0] } }", true),
        (20.0, "", blow, true),
        (
            40.0,
            "",
            "boundary: { c: { on: left.left, displacement: { x: \"if(abs(t - 0.507) < 0.1, 5, 0)\" } } }",
            true,
        ),
        // Both surfaces are prescribed, and stay where they are, or meet.
        (1.1, "", &still, false),
        (1.1, "", &still.replace("left, displacement: { x: 0", "left, displacement: { x: \"t\""), true),
        (1.5, "", "", true),
    ];
    for (gap, velocity, loads, can_close) in rows {
        folder.write("case.yml", &filled(gap, velocity, loads));
        for ranks in [0, 3] {
            let output = match can_close {
                true => run(ranks, &["check", "case.yml"], &folder),
                false => run(ranks, &["check", "case.yml"], &folder),
            };
            if can_close {
                output.success();
                continue;
            }
            ended(&output, 3, &["contact 'touch' can not close"]);
            assert_says(&output.stderr, &["m apart", "within 1 s", "hint: ", "lengths are in m"]);
        }
    }
}

/// Two squares of four elements that share one corner. The first one has a lower and a left side.
const HINGED: &str = "$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
2
1 1 \"bottom\"
1 2 \"left\"
$EndPhysicalNames
$Nodes
17
1 0 0 0
2 0.5 0 0
3 1 0 0
4 0 0.5 0
5 0.5 0.5 0
6 1 0.5 0
7 0 1 0
8 0.5 1 0
9 1 1 0
10 1.5 1 0
11 2 1 0
12 1 1.5 0
13 1.5 1.5 0
14 2 1.5 0
15 1 2 0
16 1.5 2 0
17 2 2 0
$EndNodes
$Elements
12
1 1 2 1 1 1 2
2 1 2 1 1 2 3
3 1 2 2 2 1 4
4 1 2 2 2 4 7
5 3 2 0 1 1 2 5 4
6 3 2 0 1 2 3 6 5
7 3 2 0 1 4 5 8 7
8 3 2 0 1 5 6 9 8
9 3 2 0 1 9 10 13 12
10 3 2 0 1 10 11 14 13
11 3 2 0 1 12 13 16 15
12 3 2 0 1 13 14 17 16
$EndElements
";

const HEAVY: &str = "dimension: 2
bodies:
  block:
    mesh: { file: hinged.msh }
    material: { neo_hookean: { young_modulus: 5.0e6, poisson_ratio: 0.3 } }
    density: 1700
obstacles: { floor: { plane: { point: [0, 0], normal: [0, 1] } } }
contact: CONTACT
boundary:
  clamp: { on: block.left, displacement: { x: 0, y: 0 } }
  weight: { on: block, gravity: [0, -9.81] }
TIME
";

/// A piece that hangs by one node and rotates under its weight is reported with the hinge and a
/// remedy: in statics and in the static start, and also if a contact touches the rest of its body.
#[test]
fn a_hinge_is_named_on_1_and_2_ranks() {
    const SOLE: &str = "{ sole: { contactor: block.bottom, target: floor, normal: { penalty: { compliance: 1.0e-9 } }, friction: none } }";
    const STATIC: &str = "time: { end: 1, scheme: { static: { increments: 2 } } }";
    const START: &str =
        "time: { end: 0.1, step: 0.01 }\nstart: { equilibrium: { friction: false, increments: 2 } }";
    for (contact, time, ranks) in [("{}", STATIC, 0), (SOLE, STATIC, 2), (SOLE, START, 0)] {
        let folder = Folder::new("hinge");
        folder.write("hinged.msh", HINGED);
        folder.write("case.yml", &HEAVY.replace("CONTACT", contact).replace("TIME", time));
        let output = run(ranks, &["case.yml", "-q", "-o", "out"], &folder);
        let piece = "hint: the piece of 'block' with 4 elements around [1.5, 1.5] m is joined";
        ended(&output, 5, &[piece, "single nodes", "common sides", "support it"]);
        assert!(
            !output.stderr.contains("penalty") && !output.stderr.contains("buckles"),
            "{}",
            output.stderr
        );
    }
}

/// Loads that lift a body off all that holds it: the hint names the motion and the force. It does so on an obstacle and on another
/// body, with friction and without, from the first step on or later, and in a static start.
#[test]
fn a_body_that_lifts_off_is_named_on_1_and_2_ranks() {
    const STATIC: &str = "time: { end: 1, scheme: { static: { increments: 2 } } }\n";
    const START: &str =
        "time: { end: 0.1, step: 0.01 }\nstart: { equilibrium: { friction: false, increments: 2 } }\n";
    const RUBS: &str = "{ coulomb: { coefficient: 0.5, regularization: { stick_stiffness: 1.0e9 } } }";
    let body = |name: &str, low: f64| {
        format!(
            "  {name}: {{ mesh: {{ box: {{ min: [0, {low}], max: [1, {}], cells: [4, 4] }} }}, density: 1000, \
             material: {{ neo_hookean: {{ young_modulus: 5.0e6, poisson_ratio: 0.3 }} }} }}\n",
            low + 1.0
        )
    };
    for (on_body, friction, load, time, ranks) in [
        (false, "none", "1.0e+5", STATIC, 0),
        (false, RUBS, "1.0e+5", STATIC, 2),
        (true, "none", "1.0e+5", STATIC, 0),
        (false, "none", "\"4.0e+5 * (t - 0.6)\"", STATIC, 0),
        (false, "none", "1.0e+5", START, 0),
    ] {
        let target = if on_body { "base.top" } else { "floor" };
        let base = if on_body { body("base", -1.0) } else { String::new() };
        let ground =
            if on_body { "  ground: { on: base.bottom, displacement: { x: 0, y: 0 } }\n" } else { "" };
        let case = format!(
            "dimension: 2\nbodies:\n{}{base}obstacles: {{ floor: {{ plane: {{ point: [0, 0], normal: [0, 1] }} }} }}\n\
             contact: {{ sole: {{ contactor: b.bottom, target: {target}, normal: {{ penalty: {{ compliance: 1.0e-10 }} }}, \
             friction: {friction} }} }}\nboundary:\n{ground}  side: {{ on: b.left, displacement: {{ x: 0 }} }}\n  \
             lift: {{ on: b.top, traction: {{ y: {load} }} }}\n{time}",
            body("b", 0.0)
        );
        let folder = Folder::new("lifted");
        folder.write("case.yml", &case);
        let output = run(ranks, &["case.yml", "-q", "-o", "out"], &folder);
        let motion = "nothing resists the motion of 'b' along y, which the loads drive with ";
        ended(&output, 5, &[motion, " N; ", "support it there"]);
        assert!(!output.stderr.contains("softer") && !output.stderr.contains("buckles"), "{}", output.stderr);
    }
}
