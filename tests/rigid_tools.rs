//! Rigid bodies with prescribed motion: pressing, dragging and lifting, invariance under a common
//! velocity, Coulomb torque, energy, ranks, restart and refusals.

mod common;

use common::{Folder, Results, Table, assert_says, run, shipped};

/// The scene `indenter` on a coarser mesh and in fewer steps.
fn indenter() -> String {
    shipped(
        "indenter/case.yml",
        &[("cells: [64, 24]", "cells: [32, 12]"), ("increments: 100", "increments: 40")],
    )
}

/// Largest difference of two columns, relative to the largest value of the first.
fn apart(one: &[f64], other: &[f64]) -> f64 {
    assert!(one.len() == other.len() && !one.is_empty());
    let largest = one.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    assert!(one.iter().chain(other).all(|value| value.is_finite()));
    one.iter().zip(other).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs())) / largest
}

/// The row of a table at a time.
#[track_caller]
fn at(table: &Table, column: &str, time: f64) -> f64 {
    let row = table.numbers("time").iter().position(|t| (t - time).abs() < 1e-9).expect("a row");
    table.numbers(column)[row]
}

/// A disc that is dragged has the torque of Coulomb's law, `mu N R`, and meets a drag; after it is
/// lifted off its load is exactly zero. The force on the disc is the reaction of the support. The
/// ledger closes: the work of the disc is heat and strain energy.
#[test]
fn a_tool_presses_drags_and_lifts() {
    let results = Results::of(&indenter(), 1);
    let [rigid, contact, energy, reactions] =
        ["rigid.csv", "contact.csv", "energy.csv", "reactions.csv"].map(|name| results.table(name));
    for (time, slides) in [(0.3, false), (0.6, true), (0.8, true)] {
        let normal = at(&contact, "force_n", time);
        let ratio = -at(&rigid, "torque_z", time) / (0.3 * 0.1 * normal);
        assert!(normal > 5e4, "{normal}");
        assert_eq!(slides, (0.98..1.005).contains(&ratio), "torque at {time}: {ratio}");
        for axis in ["x", "y"] {
            let force = format!("force_{axis}");
            let own = at(&rigid, &force, time);
            assert!((own + at(&contact, &force, time)).abs() < 1e-9 * normal);
            assert!((own - at(&reactions, &force, time)).abs() < 1e-6 * normal, "{axis}");
        }
        assert!(!slides || at(&rigid, "force_x", time) < -0.25 * normal);
    }
    assert!(at(&rigid, "position_x", 0.55).abs() < 1e-15);
    assert!((at(&rigid, "velocity_x", 0.5) - 0.3).abs() < 1e-12);
    for column in ["force_x", "force_y", "torque_z"] {
        assert_eq!(rigid.last(column), 0.0, "{column} after lift-off");
    }
    let [work, heat] = [rigid.last("work"), energy.last("friction_dissipated")];
    assert_eq!(energy.last("external_work"), work);
    assert!(work > 1e3 && (heat / work - 1.0).abs() < 0.02, "{heat} of {work}");
    assert!(energy.last("numerical").abs() < 0.02 * work && energy.last("strain") < 1e-6 * work);
}

/// A block that is held over a moving floor, or dragged over one at rest.
fn block_on_floor(held: bool, scheme: &str) -> String {
    let down = "\"-0.004 * min(t / 0.02, 1)\"";
    let (floor, top, velocity) = match held {
        true => (
            "rigid: { floor: { shape: { plane: { point: [0, 0], normal: [0, 1] } }, \
             motion: { translation: { x: \"-0.5 * t\" } } } }",
            "0",
            "",
        ),
        false => (
            "obstacles: { floor: { plane: { point: [0, 0], normal: [0, 1] } } }",
            "\"0.5 * t\"",
            "initial_velocity: [0.5, 0]",
        ),
    };
    let velocity = if scheme == "static" { "" } else { velocity };
    format!(
        "dimension: 2
bodies:
  block:
    mesh: {{ box: {{ min: [0, 0], max: [0.2, 0.1], cells: [10, 5] }} }}
    material: {{ neo_hookean: {{ young_modulus: 5e6, poisson_ratio: 0.4 }} }}
    density: 1000
    {velocity}
{floor}
contact:
  sole:
    contactor: block.bottom
    target: floor
    friction: {{ coulomb: {{ coefficient: 0.4, regularization: {{ stick_stiffness: 2.0e+10 }} }} }}
boundary:
  hold: {{ on: block.top, displacement: {{ x: {top}, y: {down} }} }}
time: {{ end: 0.03, step: 1.0e-3, scheme: {scheme} }}
solver: {{ newton: {{ tolerance: 1.0e-12, inexact: false }} }}
output: {{ probes: {{ corner: {{ at: [0.2, 0] }} }} }}
"
    )
}

/// A block that is dragged over a floor at rest has the forces, displacements and heat of one that
/// is held while the floor moves the other way, in statics and with every kind of scheme.
#[test]
fn only_relative_motion_matters() {
    for scheme in [
        "static",
        "{ newmark: { beta: 0.25, gamma: 0.5 } }",
        "{ hht: { spectral_radius: 0.8 } }",
        "{ generalized_alpha: { spectral_radius: 0.8 } }",
        "midpoint",
        "backward_euler",
        "conserving",
    ] {
        let [held, dragged] = [true, false].map(|held| Results::of(&block_on_floor(held, scheme), 1));
        let [one, other] = [&held, &dragged].map(|results| results.table("contact.csv"));
        for column in ["force_x", "force_n", "area"] {
            let apart = apart(&one.numbers(column), &other.numbers(column));
            assert!(apart < 1e-10, "{scheme} {column}: {apart:e}");
        }
        assert!(one.last("force_x").abs() > 0.39 * one.last("force_n"), "{scheme}: it slides");
        let corner = |results: &Results| results.table("probes.csv").numbers("corner.u_x");
        let moved: Vec<f64> =
            corner(&held).iter().zip(one.numbers("time")).map(|(u, t)| u + 0.5 * t).collect();
        assert!(apart(&moved, &corner(&dragged)) < 1e-12, "{scheme}");
        let heat = |results: &Results| results.table("energy.csv").numbers("friction_dissipated");
        assert!(apart(&heat(&held), &heat(&dragged)) < 1e-10, "{scheme}");
        let ledger = held.table("energy.csv");
        assert!(ledger.last("external_work") > 0.0);
        let unexplained = ledger.last("numerical").abs() / ledger.last("external_work");
        assert!(unexplained < 5e-3, "{scheme}: {unexplained}");
    }
}

/// A disc that is pressed in and then rotates in place has Coulomb's torque `mu N R` against its
/// rotation, and its work is that torque times the angle. With another coefficient the torque
/// changes in proportion.
#[test]
fn a_disc_that_rotates_in_place_has_coulombs_torque() {
    let torque = |mu: f64| {
        let text = indenter()
            .replace("coefficient: 0.3", &format!("coefficient: {mu}"))
            .replace("        x: { table: [[0, 0], [0.3, 0], [0.8, 0.15]] }\n", "")
            .replace("[0.8, -0.02], [1, 0.05]]", "[1, -0.02]]");
        let text = text.replace(
            "contact:",
            "      rotation: { angle: { table: [[0, 0], [0.3, 0], [1, 0.7]] } }\ncontact:",
        );
        let results = Results::of(&text, 1);
        let [rigid, contact] = ["rigid.csv", "contact.csv"].map(|name| results.table(name));
        let torque = rigid.last("torque_z");
        let ratio = -torque / (mu * contact.last("force_n") * 0.1);
        assert!((0.99..1.0).contains(&ratio), "{mu}: {ratio}");
        let work = at(&rigid, "work", 1.0) - at(&rigid, "work", 0.8);
        assert!((work / (-torque * 0.2) - 1.0).abs() < 1e-6, "{work} {torque}");
        assert!(
            (rigid.last("rotation_z") - 0.7).abs() < 1e-14 && (at(&rigid, "spin_z", 0.6) - 1.0).abs() < 1e-12
        );
        torque
    };
    assert!((torque(0.15) / torque(0.3) - 0.5).abs() < 0.02);
}

/// A free block that an accelerated, rotating plate hits, with the conserving scheme.
fn hit(dimension: usize) -> String {
    let block = match dimension {
        2 => "box: { min: [-0.1, 0], max: [0.1, 0.1], cells: [8, 4] }",
        _ => "box: { min: [-0.1, -0.1, 0], max: [0.1, 0.1, 0.1], cells: [3, 3, 2] }",
    };
    let up = if dimension == 2 { "y" } else { "z" };
    let (point, normal, about) = match dimension {
        2 => ("[0, -0.001]", "[0, 1]", "about: [0.3, -0.001]"),
        _ => ("[0, 0, -0.001]", "[0, 0, 1]", "about: [0.3, 0, -0.001], axis: [0.2, -1, 0.1]"),
    };
    format!(
        "dimension: {dimension}
bodies:
  block:
    mesh: {{ {block} }}
    material: {{ neo_hookean: {{ young_modulus: 5e6, poisson_ratio: 0.4 }} }}
    density: 1000
rigid:
  bat:
    shape: {{ plane: {{ point: {point}, normal: {normal} }} }}
    motion:
      translation: {{ x: \"0.3 * t\", {up}: \"2 * t + 5 * t ^ 2\" }}
      rotation: {{ {about}, angle: \"3 * t + 20 * t ^ 2\" }}
contact:
  hit:
    contactor: block.bottom
    target: bat
    friction: {{ coulomb: {{ coefficient: 0.3, regularization: {{ stick_stiffness: 1.0e+9 }} }} }}
time: {{ end: 5.0e-3, step: 1.0e-4, scheme: conserving }}
solver: {{ newton: {{ tolerance: 1.0e-12 }} }}
"
    )
}

/// The conserving scheme takes the work of a plate that accelerates and rotates exactly: the energy
/// of a block that it hits is the work of the plate minus the heat, with friction, in 2D and 3D.
#[test]
fn the_work_of_a_plate_is_the_energy_that_it_gives() {
    for dimension in [2, 3] {
        let results = Results::of(&hit(dimension), 1);
        let energy = results.table("energy.csv");
        let work = results.table("rigid.csv").last("work");
        let unexplained = energy.numbers("numerical").iter().fold(0.0_f64, |most, e| most.max(e.abs()));
        assert!(energy.last("friction_dissipated") > 1e-3 * work && energy.last("kinetic") > 0.5 * work);
        assert!(unexplained < 1e-10 * work, "{dimension}D: {unexplained:e} of {work}");
    }
}

/// Tools give the same results on 1, 2, 3 and 4 ranks.
#[test]
fn tools_do_not_depend_on_the_number_of_ranks() {
    for text in [indenter(), hit(3)] {
        let one = Results::of(&text, 1).table("rigid.csv");
        for ranks in 2..=4 {
            let other = Results::of(&text, ranks).table("rigid.csv");
            for column in ["force_x", "force_y", "torque_z", "work"] {
                let apart = apart(&one.numbers(column), &other.numbers(column));
                assert!(apart < 1e-8, "{column} on {ranks} ranks: {apart:e}");
            }
        }
    }
}

/// Direct, preconditioned and staggered solutions agree, also on two ranks.
#[test]
fn solvers_agree_on_a_tool() {
    let text = |solver: &str| indenter().replace("output:\n", &format!("solver: {solver}\noutput:\n"));
    let short = |text: String| {
        text.replace(
            "end: 1, scheme: { static: { increments: 40 } }",
            "end: 0.4, step: 0.025, scheme: static",
        )
    };
    let tight = "newton: { tolerance: 1.0e-11, inexact: false }";
    let direct = Results::of(&short(text(&format!("{{ linear: direct, {tight} }}"))), 1).table("rigid.csv");
    let pieces = "petsc: { filter_pc_type: asm }\n";
    let solvers = [
        ("filtered_amg", "", 2),
        ("filtered_amg", pieces, 3),
        ("filtered_ilu", pieces, 3),
        ("gmres_asm_ilu", "", 2),
        ("two_stage", "", 1),
    ];
    for (solver, petsc, ranks) in solvers {
        let solver = format!("{{ linear: {solver}, {tight} }}");
        let other = Results::of(&format!("{}\n{petsc}", short(text(&solver))), ranks).table("rigid.csv");
        for column in ["force_x", "force_y", "torque_z"] {
            let apart = apart(&direct.numbers(column), &other.numbers(column));
            assert!(apart < 1e-8, "{solver} {column}: {apart:e}");
        }
    }
    let staggered = Results::of(&short(text("{ strategy: staggered }")), 1).table("rigid.csv");
    let apart = apart(&direct.numbers("force_x"), &staggered.numbers("force_x"));
    assert!(apart < 1e-6, "staggered: {apart:e}");
}

/// A thin rod that a body would pass in one step is detected, although the body rests and the rod
/// moves. Shorter steps meet it.
#[test]
fn a_tool_that_passes_through_a_body_is_detected() {
    let text = |step: f64, cuts: u32| {
        format!(
            "dimension: 2
bodies:
  sheet:
    mesh: {{ box: {{ min: [0, 0], max: [1, 0.05], cells: [40, 2] }} }}
    material: {{ neo_hookean: {{ young_modulus: 5e6, poisson_ratio: 0.3 }} }}
    density: 1000
rigid:
  rod:
    shape: {{ sphere: {{ center: [0.5, 0.2], radius: 0.06 }} }}
    motion: {{ translation: {{ y: \"-10 * t\" }} }}
contact: {{ hit: {{ contactor: sheet.top, target: rod }} }}
boundary: {{ base: {{ on: sheet.bottom, displacement: {{ x: 0, y: 0 }} }} }}
time: {{ end: 0.0145, step: {step}, cuts: {cuts}, scheme: {{ newmark: {{ beta: 0.25, gamma: 0.5 }} }} }}
"
        )
    };
    let folder = Folder::new("through");
    folder.write("case.yml", &text(0.0145, 0).replace("-10 * t", "-30 * t"));
    let passed = run(0, &["case.yml", "-q"], &folder);
    assert_ne!(passed.code, Some(0));
    assert_says(&passed.stderr, &["contact 'hit'", "radius 6.000e-2 m", "smaller than the radius"]);
    let met = Results::of(&text(5e-4, 6), 1);
    assert!(met.table("rigid.csv").last("force_y") > 0.0);
}

/// A disc presses rubber, stops and drags at once with 60 times the stick velocity. Newton's method takes
/// few iterations at long and at short steps, and the surface under the disc moves with it.
#[test]
fn a_tool_may_change_its_velocity_at_once() {
    let text = |end: f64, step: f64| {
        format!(
            "dimension: 2
bodies:
  pad:
    mesh: {{ box: {{ min: [-0.1, 0], max: [0.1, 0.06], cells: [24, 10], element: quad4 }} }}
    material: {{ neo_hookean: {{ young_modulus: 5.0e+6, poisson_ratio: 0.49 }} }}
    density: 1100
rigid:
  tool:
    shape: {{ sphere: {{ center: [0, 0.1001], radius: 0.04 }} }}
    motion:
      translation:
        x: {{ table: [[0, 0], [0.5, 0], [1, 0.03]] }}
        y: {{ table: [[0, 0], [0.5, -0.015], [1, -0.015]] }}
contact:
  press:
    contactor: pad.top
    target: tool
    normal: {{ penalty: {{ compliance: 2.0e-10 }} }}
    friction: {{ coulomb: {{ coefficient: 0.3, regularization: {{ stick_velocity: 1.0e-3 }} }} }}
boundary: {{ clamp: {{ on: pad.bottom, displacement: {{ x: 0, y: 0 }} }} }}
time: {{ end: {end}, step: {step} }}
output: {{ probes: {{ middle: {{ at: [0, 0.06], on: pad }} }} }}
"
        )
    };
    for (end, step, most) in [(0.6, 0.02, 160), (0.52, 0.005, 400)] {
        let results = Results::of(&text(end, step), 1);
        let record = results.record();
        let iterations = record["newton_iterations"].as_u64().expect("a count");
        assert_eq!(record["cut_steps"].as_u64(), Some(0), "step {step}");
        assert!(iterations <= most, "step {step}: {iterations}");
        let moved = results.table("probes.csv").last("middle.u_x");
        let tool = 0.06 * (end - 0.5);
        assert!((0.75 * tool..1.25 * tool).contains(&moved), "step {step}: {moved} of {tool}");
    }
}

/// A tool that presses at t = 0 is applied in the increments of the static start like a prescribed
/// displacement: forces are those of a block that is pressed onto a floor at rest. Friction in the
/// start makes no difference to that.
#[test]
fn a_tool_may_press_in_the_static_start() {
    for friction in [false, true] {
        let [by_floor, by_top] = [true, false].map(|by_floor| {
            let [floor, top] = match by_floor {
                true => [
                    "rigid: { floor: { shape: { plane: { point: [0, 0], normal: [0, 1] } }, \
                     motion: { translation: { x: \"0.02 + 0.3 * t\", y: 0.004 } } } }",
                    "{ x: 0, y: 0 }",
                ],
                false => [
                    "obstacles: { floor: { plane: { point: [0, 0], normal: [0, 1] } } }",
                    "{ x: \"-0.02 - 0.3 * t\", y: -0.004 }",
                ],
            };
            let velocity = if by_floor { "" } else { "initial_velocity: [-0.3, 0]" };
            let text = format!(
                "dimension: 2
bodies:
  block:
    mesh: {{ box: {{ min: [0, 0], max: [0.2, 0.1], cells: [10, 5] }} }}
    material: {{ neo_hookean: {{ young_modulus: 5e6, poisson_ratio: 0.4 }} }}
    density: 1000
    {velocity}
{floor}
contact:
  sole:
    contactor: block.bottom
    target: floor
    friction: {{ coulomb: {{ coefficient: 0.4, regularization: {{ stick_stiffness: 2.0e+10 }} }} }}
boundary: {{ hold: {{ on: block.top, displacement: {top} }} }}
start: {{ equilibrium: {{ friction: {friction}, increments: 4 }} }}
time: {{ end: 0.01, step: 1.0e-3, scheme: {{ newmark: {{ beta: 0.25, gamma: 0.5 }} }} }}
solver: {{ newton: {{ tolerance: 1.0e-12, inexact: false }} }}
"
            );
            Results::of(&text, 1).table("contact.csv")
        });
        assert!(by_floor.numbers("force_n")[0] > 3e4);
        for column in ["force_n", "force_x"] {
            let apart = apart(&by_floor.numbers(column), &by_top.numbers(column));
            assert!(apart < 1e-9, "{column}: {apart:e}");
        }
    }
}

/// The closing speed of an impact is that of the tool.
#[test]
fn the_closing_speed_is_that_of_the_tool() {
    let folder = Folder::new("closing");
    let text =
        indenter().replace("poisson_ratio: 0.4 } }", "poisson_ratio: 0.4 } }\n    density: 1000").replace(
            "{ end: 1, scheme: { static: { increments: 40 } } }",
            "{ end: 0.03, step: 0.01, scheme: { newmark: { beta: 0.25, gamma: 0.5 } } }",
        );
    folder.write("case.yml", &text);
    let output = run(0, &["case.yml"], &folder).success();
    assert_says(&output.text(), &["contact 'press' closed at 6.67e-2 m/s"]);
}

/// Motions that are not finite during the run end it with their position in the case.
#[test]
fn a_motion_that_is_not_finite_is_reported() {
    let folder = Folder::new("infinite");
    let text = block_on_floor(true, "static").replace("\"-0.5 * t\"", "\"1e-3 / (t - 0.01)\"");
    folder.write("case.yml", &text);
    for ranks in [0, 2, 3] {
        let output = run(ranks, &["case.yml", "-q"], &folder);
        assert_eq!(output.code, Some(3), "{ranks}: {}", output.text());
        assert_says(&output.stderr, &["case.yml:8:", "at t = 0.01", "finite"]);
    }
}

/// Statics begins without the motion at t = 0, and applies it within the first step. The work of
/// that step is in both tables, also if the tool touches at the start.
#[test]
fn a_motion_at_the_start_of_statics_does_its_work_once() {
    let text = "dimension: 2
bodies:
  block:
    mesh: { box: { min: [0, 0], max: [0.4, 0.3], cells: [6, 5] } }
    material: { neo_hookean: { young_modulus: 5.0e+6, poisson_ratio: 0.3 } }
rigid:
  floor:
    shape: { plane: { point: [0, 0.001], normal: [0, 1] } }
    motion: { translation: { y: '0.002 + 0.001 * t' } }
contact:
  sole: { contactor: block.bottom, target: floor, normal: { penalty: { compliance: 1.0e-9 } }, initial_overclosure: accept }
boundary: { clamp: { on: block.top, displacement: { x: 0, y: 0 } } }
time: { end: 1, scheme: { static: { increments: 2 } } }
output: { fields: { every: 100 } }
";
    let results = Results::of(text, 1);
    let (rigid, energy) = (results.table("rigid.csv"), results.table("energy.csv"));
    let work = rigid.numbers("work");
    assert_eq!(work[0], 0.0);
    assert!(work[1] > 0.0 && rigid.numbers("force_y")[0] < 0.0);
    assert_eq!(work, energy.numbers("external_work"));
    let position = rigid.numbers("position_y");
    assert!((position[0] - 0.001).abs() < 1e-12 && (position[2] - 0.004).abs() < 1e-12, "{position:?}");
}

/// A block that its base turns by 1.2 rad while it presses on a floor, in statics and dynamics.
fn turned(motion: &str, dynamic: bool) -> String {
    let (density, time) = match dynamic {
        true => (
            "\n    density: 1000",
            "{ end: 0.5, step: 0.05, scheme: { generalized_alpha: { spectral_radius: 0.5 } } }",
        ),
        false => ("", "{ end: 1, scheme: { static: { increments: 5 } } }"),
    };
    format!(
        "dimension: 2
bodies:
  block:
    mesh: {{ box: {{ min: [-0.1, 0], max: [0.1, 0.1], cells: [6, 3] }} }}
    material: {{ neo_hookean: {{ young_modulus: 5 MPa, poisson_ratio: 0.3 }} }}{density}
obstacles: {{ floor: {{ plane: {{ point: [0, 0], normal: [0, 1] }} }} }}
contact: {{ sole: {{ contactor: block.bottom, target: floor }} }}
boundary:
  grip: {{ on: block.top, {motion} }}
time: {time}
"
    )
}

/// The motion of a boundary gives the results of the expressions that it replaces, in statics and
/// dynamics, on 1 and 3 ranks.
#[test]
fn the_motion_of_a_boundary_replaces_expressions() {
    let key = "motion: { translation: { x: '0.01 * t^2', y: -0.01 }, rotation: { angle: '0.3 * t^2', about: [0.02, 0.1] } }";
    let written = "displacement: { x: '(x - 0.02) * (cos(0.3 * t^2) - 1) - (y - 0.1) * sin(0.3 * t^2) + 0.01 * t^2', \
                   y: '(x - 0.02) * sin(0.3 * t^2) + (y - 0.1) * (cos(0.3 * t^2) - 1) - 0.01' }";
    for dynamic in [false, true] {
        let expected = Results::of(&turned(written, dynamic), 1).table("reactions.csv");
        for ranks in [1, 3] {
            let found = Results::of(&turned(key, dynamic), ranks).table("reactions.csv");
            // Without friction the force along the floor is zero up to the tolerance of the solver.
            for column in ["force_y", "moment_z"] {
                let apart = apart(&expected.numbers(column), &found.numbers(column));
                assert!(apart < 1e-8, "{column} on {ranks} ranks: {apart:.1e}");
            }
        }
    }
}

/// A block whose motion is prescribed at all nodes spins about an inclined axis. Its kinetic energy,
/// the force of its support and its strain energy are those of a rigid body.
#[test]
fn a_boundary_spins_about_an_inclined_axis() {
    let case = "
dimension: 3
bodies:
  block:
    mesh: { box: { min: [0, 0, 0], max: [0.2, 0.1, 0.1], cells: [2, 1, 1] } }
    material: { neo_hookean: { young_modulus: 5 MPa, poisson_ratio: 0.3 } }
    density: 1000
boundary:
  spin: { on: block, motion: { rotation: { angle: '3 * t + 5 * t^2', about: [0, 0, 0], axis: [1, 2, 2] } } }
time: { end: 0.5, step: 0.05, scheme: { newmark: {} } }
";
    let results = Results::of(case, 2);
    let [energy, reactions] = ["energy.csv", "reactions.csv"].map(|name| results.table(name));
    // A box of mass 2 kg, with principal axes x, y, z through (0.1, 0.05, 0.05), about k = (1, 2, 2) / 3.
    let (mass, half) = (2.0, [0.1, 0.05, 0.05]);
    let axis = [1.0, 2.0, 2.0].map(|x: f64| x / 3.0);
    let along: f64 = (0..3).map(|i| axis[i] * half[i]).sum();
    let square: f64 = half.iter().map(|x| x * x).sum();
    let about_centre: f64 = (0..3).map(|i| axis[i].powi(2) * mass / 3.0 * (square - half[i].powi(2))).sum();
    let inertia = about_centre + mass * (square - along * along);
    let time = energy.numbers("time");
    for (row, kinetic) in energy.numbers("kinetic").iter().enumerate() {
        let expected = 0.5 * inertia * (3.0 + 10.0 * time[row]).powi(2);
        assert!((kinetic / expected - 1.0).abs() < 1e-12, "{kinetic} at {}", time[row]);
    }
    // The force is the mass times the acceleration of the centre.
    let distance = (square - along * along).sqrt();
    let rate: f64 = 3.0 + 10.0 * 0.5;
    let expected = mass * distance * (rate.powi(4) + 100.0).sqrt();
    let force =
        ["force_x", "force_y", "force_z"].map(|name| reactions.last(name)).iter().map(|f| f * f).sum::<f64>();
    assert!((force.sqrt() / expected - 1.0).abs() < 1e-9, "{} and {expected}", force.sqrt());
    assert!(energy.last("strain") < 1e-15 * 5e6 * 0.002);
}

/// Mistakes in the motion of a boundary are reported with cause and cure.
#[test]
fn wrong_motions_of_boundaries_are_refused() {
    let rotation = |text: &str| format!("motion: {{ rotation: {{ {text} }} }}");
    let rows = [
        (rotation("angle: 1"), "the rotation of a boundary needs a point of its axis"),
        (rotation("angle: 1, about: [0, 0, 0]"), "2 entries"),
        (rotation("angle: 1, about: [0, 0], axis: [0, 0, 1]"), "no axis"),
        (rotation("angle: x, about: [0, 0]"), "depends on t only"),
        (rotation("angle: '1 / t', about: [0, 0]"), "at t = 0"),
        (rotation("angle: 10 deg, about: [0, 0]"), "deg"),
        ("motion: {}".to_owned(), "the motion of 'grip' is empty"),
        ("motion: { translation: { x: 0 } }, displacement: { x: 0 }".to_owned(), "more than one action"),
        (
            rotation("angle: t, about: [0, 0]") + " }\n  other: { on: block.top, displacement: { x: 0 }",
            "prescribed twice",
        ),
    ];
    for (motion, words) in rows {
        let folder = Folder::new("motion");
        folder.write("case.yml", &turned(&motion, false));
        let output = run(0, &["case.yml", "-q"], &folder);
        assert_eq!(output.code, Some(3), "{motion}");
        assert_says(&output.stderr, &["case.yml:", words]);
    }
}
