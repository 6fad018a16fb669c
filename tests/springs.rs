//! Foundations, springs and dashpots, and total forces and torques, in complete runs: closed forms of
//! statics and vibrations, a bar end that absorbs a wave, the energy ledger, what holds a body, and equal
//! results on any number of ranks and after a restart.

mod common;

use common::{Folder, Results, Table, assert_says, near, run};

/// The last row of a boundary in `reactions.csv`.
#[track_caller]
fn reaction(results: &Results, boundary: &str, columns: &[&str]) -> Vec<f64> {
    let table = results.table("reactions.csv").only("boundary", boundary);
    columns.iter().map(|column| table.last(column)).collect()
}

/// A block under a uniform pressure on foundations that resist only the normal directions of two sides.
const SETTLED: &str = "
dimension: 2
bodies:
  block:
    mesh: { box: { min: [0, 0], max: [0.4, 0.2], cells: [4, 3], element: KIND } }
    material: { saint_venant_kirchhoff: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    kinematics: linear
boundary:
  soil: { on: block.bottom, foundation: { stiffness: { SOIL } } }
  wall: { on: block.left, foundation: { stiffness: { normal: '0.5 MPa/m' } } }
  load: { on: block.top, traction: { y: -1.0e4 } }
time: { end: 1, scheme: { static: { increments: 2 } } }
output: { probes: { corner: { at: [0.4, 0.2] } } }
";

/// Normal foundations alone hold a body in statics. The force is `k u` over the area, to rounding, with
/// every element; the energy of the springs is half the work of the load on them.
#[test]
fn a_block_settles_on_its_foundation_on_1_to_3_ranks() {
    let p = 1.0e4;
    let k = 2.0e6;
    let young = 1.0e6;
    let nu = 0.3;
    let across = nu * (1.0 + nu) * p / young;
    let sinks = p / k + 0.2 * p * (1.0 - nu * nu) / young;
    for (kind, soil, ranks) in [
        ("quad4", "normal: 2.0e6", 1),
        ("quad4", "y: '2 MPa/m'", 3),
        ("quad9", "normal: 2.0e6", 2),
        ("tri3", "normal: '2e6 * (1 + 0 * x)'", 2),
        ("tri6", "normal: 2.0e6", 1),
    ] {
        let results = Results::of(&SETTLED.replace("KIND", kind).replace("SOIL", soil), ranks);
        let probes = results.table("probes.csv");
        near(&[probes.last("corner.u_x"), probes.last("corner.u_y")], &[0.4 * across, -sinks], 1e-9);
        let found = reaction(&results, "soil", &["force_x", "force_y", "moment_z"]);
        near(&found, &[0.0, 0.4 * p, 0.5 * p * 0.16 * (1.0 + across)], 1e-9);
        let wall = reaction(&results, "wall", &["force_x", "force_y"]);
        assert!(wall.iter().all(|force| force.abs() < 1e-9 * p), "{wall:?}");
        let energy = results.table("energy.csv");
        near(&[energy.last("springs")], &[0.5 * p * p / k * 0.4], 1e-9);
        near(&[energy.last("external_work")], &[0.5 * 0.4 * p * sinks], 1e-9);
        assert!(energy.last("numerical").abs() < 1e-9 * energy.last("total"), "{kind}");
    }
}

/// The same in space, where the sides of hexahedra and tetrahedra have three to nine nodes.
#[test]
fn a_block_settles_in_space_on_1_to_3_ranks() {
    let p = 1.0e4;
    let k = 2.0e6;
    let young = 1.0e6;
    let nu = 0.3;
    for (kind, ranks) in [("hex8", 3), ("hex20", 1), ("tet4", 2), ("tet10", 1), ("hex27", 2)] {
        let text = SETTLED
            .replace("dimension: 2", "dimension: 3")
            .replace(
                "min: [0, 0], max: [0.4, 0.2], cells: [4, 3]",
                "min: [0, 0, 0], max: [0.4, 0.3, 0.2], cells: [2, 2, 2]",
            )
            .replace("KIND", kind)
            .replace("SOIL", "normal: 2.0e6")
            .replace(
                "  load:",
                "  side: { on: block.front, foundation: { stiffness: { y: 3.0e5 } } }\n  load:",
            )
            .replace("y: -1.0e4", "z: -1.0e4")
            .replace("at: [0.4, 0.2]", "at: [0.4, 0.3, 0.2]");
        let results = Results::of(&text, ranks);
        let probes = results.table("probes.csv");
        let found = ["corner.u_x", "corner.u_y", "corner.u_z"].map(|column| probes.last(column));
        near(&found, &[0.4 * nu * p / young, 0.3 * nu * p / young, -p / k - 0.2 * p / young], 1e-9);
        let found = reaction(&results, "soil", &["force_x", "force_y", "force_z"]);
        near(&found, &[0.0, 0.0, 0.12 * p], 1e-9);
        near(&[results.table("energy.csv").last("springs")], &[0.5 * p * p / k * 0.12], 1e-9);
    }
}

/// What a foundation or springs do not resist is reported. With a spring for the free direction the body is
/// held, and the spring carries the load of that direction.
#[test]
fn what_holds_a_body_is_known_on_2_ranks() {
    let free = SETTLED.replace("KIND", "quad4").replace("SOIL", "normal: 2.0e6");
    let free =
        free.replace("  wall: { on: block.left, foundation: { stiffness: { normal: '0.5 MPa/m' } } }\n", "");
    let folder = Folder::new("springs");
    let refused = |text: &str, out: &str| {
        folder.write("case.yml", text);
        let output = run(2, &["case.yml", "-q", "-o", out], &folder);
        assert_ne!(output.code, Some(0));
        output.text()
    };
    assert_says(&refused(&free, "free"), &["in statics", "holds 'block' along x", "foundation"]);
    let on_springs = "sets: { feet: { of: nodes, where: 'y < 1e-9 and x < 1e-9' } }\n    kinematics: linear";
    let spring = "  anchor: { on: block.feet, spring: { stiffness: { x: '4 MN/m' } } }\n  push: { on: block.right, force: { x: 300 } }\n  load:";
    let held = free.replace("kinematics: linear", on_springs).replace("  load:", spring);
    let results = Results::of(&held, 2);
    near(&reaction(&results, "anchor", &["force_x", "force_y"]), &[-300.0, 0.0], 1e-9);
    near(&reaction(&results, "soil", &["force_x", "force_y"]), &[0.0, 4.0e3], 1e-9);
    // Springs at one node leave the rotation about it.
    let hinged = free.replace("kinematics: linear", on_springs).replace(
        "{ on: block.bottom, foundation: { stiffness: { normal: 2.0e6 } } }",
        "{ on: block.feet, spring: { stiffness: { x: 1.0e6, y: 1.0e6 } } }",
    );
    assert_says(&refused(&hinged, "hinged"), &["nothing resists the motion of 'block'"]);
}

/// A bar of one element that can only extend along x, with the stiffness `E A / L = 3e4` and the mass
/// `rho A L / 3 = 3`, on springs and dashpots at its end.
const OSCILLATOR: &str = "
dimension: 2
bodies:
  bar:
    mesh: { box: { min: [0, 0], max: [1, 1], cells: [1, 1], element: quad4 } }
    material: { saint_venant_kirchhoff: { young_modulus: 3.0e4, poisson_ratio: 0 } }
    density: 9
    kinematics: linear
    initial_velocity: ['1.0e-3 * x', 0]
boundary:
  wall: { on: bar.left, displacement: { x: 0 } }
  floor: { on: bar.bottom, displacement: { y: 0 } }
  lid: { on: bar.top, displacement: { y: 0 } }
  end: { on: bar.right, END }
time: { end: 0.1, step: STEP, scheme: SCHEME }
solver: { newton: { tolerance: 1.0e-12 } }
output: { fields: { every: 100000 }, probes: { tip: { at: [1, 0] } } }
";

/// Angular frequency of the oscillator: the springs add as much stiffness as the bar has, three times over.
const FREQUENCY: f64 = 200.0;

/// Springs `4 * 3e4 - 3e4 = 9e4` and dashpots `2 * 0.1 * 200 * 3 = 120` at two nodes, or over the area 1.
const ENDS: [&str; 2] = [
    "spring: { stiffness: { x: '45 kN/m' }, damping: { x: '60 N s/m' } }",
    "foundation: { stiffness: { normal: '90 kPa/m' }, damping: { x: '120 Pa s/m' } }",
];

/// Springs and dashpots at the nodes and on the surface of an oscillator give the closed form of the damped
/// motion with order two in every scheme of second order, and the scheme of first order converges.
#[test]
fn an_oscillator_follows_the_closed_form() {
    let damped = FREQUENCY * (1.0_f64 - 0.01).sqrt();
    let exact = |t: f64| 1.0e-3 / damped * (-0.1 * FREQUENCY * t).exp() * (damped * t).sin();
    let error = |end: &str, scheme: &str, step: &str| {
        let text = OSCILLATOR.replace("END", end).replace("SCHEME", scheme).replace("STEP", step);
        let probes = Results::of(&text, 1).table("probes.csv");
        let rows = probes.numbers("time").into_iter().zip(probes.numbers("tip.u_x"));
        rows.map(|(t, u)| (u - exact(t)).abs()).fold(0.0, f64::max) / 5.0e-6
    };
    for (scheme, order, most) in [
        ("{ newmark: { beta: 0.25, gamma: 0.5 } }", 1.9, 3e-3),
        ("{ generalized_alpha: { spectral_radius: 0.8 } }", 1.9, 3e-3),
        ("{ hht: { spectral_radius: 0.8 } }", 1.9, 5e-3),
        ("midpoint", 1.9, 3e-3),
        ("conserving", 1.9, 3e-3),
        ("backward_euler", 0.8, 0.1),
    ] {
        for end in ENDS {
            let errors = ["1.0e-3", "5.0e-4", "2.5e-4"].map(|step| error(end, scheme, step));
            let found = (errors[1] / errors[2]).log2();
            assert!(errors[2] < most && found > order, "{scheme} {end}: {errors:?}, order {found}");
        }
    }
}

/// Successive maxima fall by the logarithmic decrement, and the forces in `reactions.csv` are those of the
/// spring and the dashpot.
#[test]
fn maxima_fall_by_the_logarithmic_decrement() {
    let scheme = "{ newmark: { beta: 0.25, gamma: 0.5 } }";
    let text = OSCILLATOR.replace("END", ENDS[0]).replace("SCHEME", scheme).replace("STEP", "5.0e-5");
    let results = Results::of(&text, 1);
    let probes = results.table("probes.csv");
    let [u, v] = ["tip.u_x", "tip.v_x"].map(|column| probes.numbers(column));
    let maxima: Vec<f64> = u.windows(3).filter(|w| w[1] > w[0] && w[1] > w[2]).map(|w| w[1]).collect();
    let decrement = std::f64::consts::TAU * 0.1 / 0.99_f64.sqrt();
    let found = (maxima[0] / maxima[1]).ln();
    assert!((found / decrement - 1.0).abs() < 2e-3, "{found}, expected {decrement}");
    let force = results.table("reactions.csv").only("boundary", "end").numbers("force_x");
    assert_eq!(force.len(), u.len());
    for ((force, u), v) in force.iter().zip(&u).zip(&v) {
        assert!((force + 9.0e4 * u + 120.0 * v).abs() < 1e-9, "{force} {u} {v}");
    }
}

/// A bar with the impedance `rho c = 1` that is hit by a pulse of 0.4 s on the left and has dashpots on the
/// right.
fn hit_bar(cells: u32, viscosity: f64) -> Table {
    let step = 0.5 / f64::from(cells);
    let text = format!(
        "
dimension: 2
bodies:
  bar:
    mesh: {{ box: {{ min: [0, 0], max: [1, 0.1], cells: [{cells}, 1], element: quad4 }} }}
    material: {{ saint_venant_kirchhoff: {{ young_modulus: 1, poisson_ratio: 0 }} }}
    density: 1
    kinematics: linear
boundary:
  floor: {{ on: bar.bottom, displacement: {{ y: 0 }} }}
  lid: {{ on: bar.top, displacement: {{ y: 0 }} }}
  pulse: {{ on: bar.left, traction: {{ x: 'if(t < 0.4, 1.0e-3 * sin(pi * t / 0.4)^2, 0)' }} }}
  far: {{ on: bar.right, foundation: {{ damping: {{ normal: {viscosity} }} }} }}
time: {{ end: 2, step: {step}, scheme: {{ newmark: {{ beta: 0.25, gamma: 0.5 }} }} }}
solver: {{ newton: {{ tolerance: 1.0e-10 }} }}
output: {{ fields: {{ every: 100000 }} }}
"
    );
    Results::of(&text, 1).table("energy.csv")
}

/// Dashpots of the impedance of the bar absorb a wave: what is reflected is an error of the mesh and of the
/// steps of order two, so its energy has order four. With half of the impedance the amplitude `1/3` is
/// reflected. The heat of the dashpots is the energy that has left the bar.
#[test]
fn a_matched_end_absorbs_a_wave() {
    let reflected = |table: &Table| table.last("total") / table.last("external_work");
    let parts = [20, 40, 80].map(|cells| reflected(&hit_bar(cells, 1.0)));
    assert!(parts[2] < 1e-4, "{parts:?}");
    assert!(parts[0] / parts[1] > 8.0 && parts[1] / parts[2] > 12.0, "{parts:?}");
    let half = hit_bar(80, 0.5);
    assert!((9.0 * reflected(&half) - 1.0).abs() < 5e-3, "{}", reflected(&half));
    let left = half.last("external_work") - half.last("total") - half.last("damping_dissipated");
    assert!(left.abs() < 1e-9 * half.last("external_work"), "{left}");
}

/// A block that is thrown against its springs, foundation and dashpots.
const THROWN: &str = "
dimension: 3
bodies:
  block:
    mesh: { box: { min: [0, 0, 0], max: [0.1, 0.2, 0.3], cells: [2, 2, 3], element: hex8 } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    density: 1000
    initial_velocity: ['3 + 20 * z', '1 - 5 * x', 2]
    sets: { tip: { of: nodes, where: 'x + y + z < 1e-9' } }
boundary:
  soil: { on: block.bottom, foundation: { stiffness: { normal: 5.0e6, tangential: 1.0e6 }, DAMPING } }
  cord: { on: block.tip, spring: { stiffness: { x: 2.0e3, z: 1.0e3 } } }
  push: { on: block.top, force: { x: '40 * sin(300 * t)', at: [0, 0.1, 0.3] } }
time: { end: 0.02, step: 5.0e-4, scheme: conserving }
solver: { newton: { tolerance: 1.0e-12 } }
output: { fields: { every: 100000 } }
";

/// With the conserving scheme the ledger closes to rounding: the energy of springs is stored, that of
/// dashpots is heat that never falls.
#[test]
fn the_ledger_closes_in_the_conserving_scheme() {
    for (damping, is_damped) in [("", false), ("damping: { normal: 4.0e4, tangential: 2.0e4 }", true)] {
        let text = THROWN.replace(", DAMPING", if is_damped { ", DAMPING" } else { "" });
        let energy = Results::of(&text.replace("DAMPING", damping), 2).table("energy.csv");
        let (total, heat) = (energy.numbers("total"), energy.numbers("damping_dissipated"));
        let springs = energy.numbers("springs").into_iter().fold(0.0, f64::max);
        assert!(springs > 0.05 * total[0], "{springs} of {}", total[0]);
        let left = energy.numbers("numerical").iter().fold(0.0, |most: f64, left| most.max(left.abs()));
        assert!(left < 1e-10 * total[0], "{damping}: {left} of {}", total[0]);
        assert!(heat.windows(2).all(|pair| pair[1] >= pair[0]), "{heat:?}");
        assert_eq!(heat[heat.len() - 1] > 0.05 * total[0], is_damped, "{heat:?}");
    }
}

/// A static start on a foundation with dashpots is an equilibrium of the motion that follows it: nothing
/// moves, although the dashpots did not act in the start.
#[test]
fn a_static_start_rests_on_its_foundation() {
    let text = THROWN
        .replace("    initial_velocity: ['3 + 20 * z', '1 - 5 * x', 2]\n", "")
        .replace("40 * sin(300 * t)", "40")
        .replace("DAMPING", "damping: { normal: 2.0e3, tangential: 1.0e3 }")
        .replace(
            "boundary:",
            "start: { equilibrium: {} }\nboundary:\n  weight: { on: block, gravity: [0, 0, -9.81] }",
        );
    let energy = Results::of(&text, 2).table("energy.csv");
    let [springs, kinetic] = ["springs", "kinetic"].map(|column| energy.numbers(column));
    assert!(springs[0] > 1e-4, "{springs:?}");
    assert!(springs.iter().all(|now| (now / springs[0] - 1.0).abs() < 1e-9), "{springs:?}");
    assert!(kinetic.iter().all(|kinetic| *kinetic < 1e-15 * springs[0]), "{kinetic:?}");
}

/// A beam of second-order elements whose left end is held so that a section may contract.
fn beam(dimension: usize, load: &str) -> Results {
    let (mesh, sets, pins) = match dimension {
        2 => (
            "min: [0, -0.1], max: [1, 0.1], cells: [3, 2], element: quad8",
            "pin: { of: nodes, where: 'x < 1e-9 and y * y < 1e-9' }",
            "  pin: { on: beam.pin, displacement: { y: 0 } }",
        ),
        _ => (
            "min: [0, -0.1, -0.15], max: [1, 0.1, 0.15], cells: [2, 2, 2], element: hex20",
            "pin: { of: nodes, where: 'x < 1e-9 and y * y + z * z < 1e-9' }, \
             side: { of: nodes, where: 'x < 1e-9 and y > 0.099 and z * z < 1e-9' }",
            "  pin: { on: beam.pin, displacement: { y: 0, z: 0 } }\n  side: { on: beam.side, displacement: { z: 0 } }",
        ),
    };
    let probe = if dimension == 2 { "[1, 0.1]" } else { "[1, 0.1, 0.15]" };
    Results::of(
        &format!(
            "
dimension: {dimension}
bodies:
  beam:
    mesh: {{ box: {{ {mesh} }} }}
    material: {{ saint_venant_kirchhoff: {{ young_modulus: 1.0e6, poisson_ratio: 0.3 }} }}
    kinematics: linear
    sets: {{ {sets} }}
boundary:
  left: {{ on: beam.left, displacement: {{ x: 0 }} }}
{pins}
  end: {{ on: beam.right, {load} }}
time: {{ end: 1, scheme: {{ static: {{ increments: 1 }} }} }}
output: {{ probes: {{ tip: {{ at: {probe} }} }} }}
"
        ),
        2,
    )
}

/// A torque bends a beam of second-order elements exactly: the traction over its end is that of pure
/// bending. An eccentric force bends and stretches it. The support carries the opposite moment.
#[test]
fn torques_and_eccentric_forces_bend_a_beam_exactly() {
    let young = 1.0e6;
    let nu = 0.3;
    let y = 0.1;
    let z = 0.15;
    let tip = |results: &Results, columns: &[&str]| -> Vec<f64> {
        let probes = results.table("probes.csv");
        columns.iter().map(|column| probes.last(column)).collect()
    };
    // In plane strain with the modulus E / (1 - nu^2), I = 0.2^3 / 12.
    let plane = young / (1.0 - nu * nu);
    let bending = |moment: f64| moment / (plane * 0.008 / 12.0);
    let across = nu / (1.0 - nu);
    for (load, force, moment) in [
        ("torque: { z: '10 N m' }", 0.0, 10.0),
        ("force: { x: 200, at: [1, 0.02] }", 200.0, -4.0),
        ("force: { x: 200 }", 200.0, 0.0),
    ] {
        let results = beam(2, load);
        let curvature = bending(moment);
        let strain = force / (0.2 * plane);
        let known = [strain - curvature * y, 0.5 * curvature * (1.0 + across * y * y) - across * strain * y];
        near(&tip(&results, &["tip.u_x", "tip.u_y"]), &known, 1e-9);
        let found = reaction(&results, "left", &["force_x", "moment_z"]);
        // The moment is that about the displaced nodes, which move by `a y^2 - b y`.
        let [a, b] = [0.5 * curvature * across, across * strain];
        near(&found, &[-force, -moment + a * force * 0.04 / 12.0 + b * moment], 1e-9);
    }
    let results = beam(3, "torque: { z: 10 }");
    let curvature = 10.0 / (young * 0.3 * 0.008 / 12.0);
    let known = [-curvature * y, 0.5 * curvature * (1.0 + nu * (y * y - z * z)), curvature * nu * y * z];
    near(&tip(&results, &["tip.u_x", "tip.u_y", "tip.u_z"]), &known, 1e-9);
    near(&reaction(&results, "left", &["force_x", "moment_z", "moment_y"]), &[0.0, -10.0, 0.0], 1e-9);
}

/// A square bar under a torque twists like Saint-Venant's solution away from its ends, and its support
/// carries the opposite torque and no force. A total force on two nodes is shared by them.
#[test]
fn a_bar_twists_like_saint_venant_on_1_to_3_ranks() {
    let text = "
dimension: 3
bodies:
  bar:
    mesh: { box: { min: [0, -0.05, -0.05], max: [0.6, 0.05, 0.05], cells: [9, 4, 4], element: hex20 } }
    material: { saint_venant_kirchhoff: { young_modulus: 2.6e6, poisson_ratio: 0.3 } }
    kinematics: linear
    sets: { ends: { of: nodes, where: 'x > 0.599 and y * y < 1e-9 and z * z > 0.0024' } }
boundary:
  clamp: { on: bar.left, displacement: { x: 0, y: 0, z: 0 } }
  twist: { on: bar.right, torque: { x: '5 N m' } }
  pull: { on: bar.ends, force: { x: 60 } }
time: { end: 1, scheme: { static: { increments: 1 } } }
output: { probes: { near: { at: [0.2, 0.05, 0] }, far: { at: [0.4, 0.05, 0] } } }
";
    // G = 1e6; the torsion constant of a square of side a is 0.140577 a^4.
    let rate = 5.0 / (1.0e6 * 0.140_577 * 1.0e-4);
    for ranks in 1..=3 {
        let results = Results::of(text, ranks);
        let probes = results.table("probes.csv");
        let twist = (probes.last("far.u_z") - probes.last("near.u_z")) / 0.05 / 0.2;
        assert!((twist / rate - 1.0).abs() < 3e-3, "{twist}, expected {rate}");
        let columns = ["force_x", "force_y", "force_z", "moment_x", "moment_y", "moment_z"];
        let found = reaction(&results, "clamp", &columns);
        near(&found[..3], &[-60.0, 0.0, 0.0], 1e-9);
        near(&found[3..], &[-5.0, 0.0, 0.0], 1e-9);
    }
}

/// A block falls on another one, which stands on a foundation with dashpots.
const IMPACT: &str = "
dimension: 2
bodies:
  upper:
    mesh: { box: { min: [0.02, 0.1], max: [0.12, 0.2], cells: [4, 4], element: quad4 } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    density: 1000
    initial_velocity: [0.5, -2]
    sets: { knob: { of: nodes, where: 'x > 0.119 and y > 0.199' } }
  lower:
    mesh: { box: { min: [0, 0], max: [0.2, 0.1], cells: [7, 4], element: quad4 } }
    material: { neo_hookean: { young_modulus: 2.0e6, poisson_ratio: 0.3 } }
    density: 1000
contact:
  between:
    contactor: upper.bottom
    target: lower.top
    normal: { penalty: { compliance: 1.0e-9 } }
    friction: { coulomb: { coefficient: 0.3, regularization: { stick_velocity: 1.0e-2 } } }
boundary:
  soil:
    on: lower.bottom
    foundation: { stiffness: { normal: 1.0e7, tangential: 5.0e6 }, damping: { normal: 5.0e3 } }
  cord: { on: upper.knob, spring: { stiffness: { x: 2.0e3 }, damping: { y: 3 } } }
  turn: { on: upper.top, torque: { z: -2 } }
time: { end: 0.01, step: 2.0e-4, scheme: { generalized_alpha: { spectral_radius: 0.8 } } }
solver: { newton: { tolerance: 1.0e-10 } }
output: { fields: { every: 100000 }, probes: { corner: { at: [0.02, 0.1] } } }
";

/// Results with contact are equal on 1 to 4 ranks.
#[test]
fn ranks_agree() {
    let one = Results::of(IMPACT, 1);
    let total = one.table("energy.csv").numbers("total")[0];
    assert!(one.table("energy.csv").last("damping_dissipated") > 0.01 * total);
    for ranks in 2..=4 {
        let several = Results::of(IMPACT, ranks);
        for (table, column, scale) in [
            ("probes.csv", "corner.u_x", 5.0e-3),
            ("energy.csv", "springs", total),
            ("energy.csv", "damping_dissipated", total),
            ("reactions.csv", "force_y", 1.0e3),
            ("reactions.csv", "moment_z", 1.0e2),
        ] {
            let [one, several] = [&one, &several].map(|results| results.table(table).numbers(column));
            assert!(!one.is_empty() && one.len() == several.len());
            assert!(one.iter().chain(&several).all(|value| value.is_finite()));
            let most = several.iter().zip(&one).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
            assert!(most < 1e-7 * scale, "{ranks} ranks: {column} {most} of {scale}");
        }
    }
}

/// A run that ends and is continued computes the same bits as one that does not end.
#[test]
fn a_continued_run_has_the_same_bits() {
    let folder = Folder::new("springs");
    // MUMPS on several ranks rounds differently in each run.
    let whole = IMPACT.replace("output: {", "output: { checkpoint: { every: 20 },");
    let whole = whole.replace("solver: {", "solver: { linear: gmres_asm_ilu,");
    folder.write("case.yml", &whole);
    run(2, &["case.yml", "-q", "-o", "whole"], &folder).success();
    let start = "--restart=whole/checkpoints/step-000040.ckpt";
    run(2, &["case.yml", "-q", "-o", "branch", start], &folder).success();
    for (table, rows) in [("energy.csv", 10), ("probes.csv", 10), ("reactions.csv", 20)] {
        let lines = |of: &str| -> Vec<String> {
            let text = std::fs::read_to_string(folder.join(of).join(table)).expect("a table");
            text.lines().map(str::to_owned).collect()
        };
        let (whole, branch) = (lines("whole"), lines("branch"));
        assert_eq!(branch.len(), rows + 1);
        assert_eq!(branch[1..], whole[whole.len() - rows..], "{table}");
    }
}

/// Foundations, springs, forces and torques that mean nothing are refused with their place and a reason.
#[test]
fn invalid_actions_are_refused() {
    let folder = Folder::new("springs");
    let by = |end: &str, scheme: &str, on: &str| {
        let text = OSCILLATOR.replace("END", end).replace("SCHEME", scheme).replace("STEP", "1.0e-3");
        let text = text.replace("on: bar.right", &format!("on: {on}"));
        let text = text.replace(
            "    kinematics: linear\n",
            "    kinematics: linear\n    sets: { tip: { of: nodes, where: 'x > 0.5' } }\n",
        );
        let text = match scheme.contains("static") {
            true => text.replace("    initial_velocity: ['1.0e-3 * x', 0]\n", ""),
            false => text,
        };
        folder.write("case.yml", &text);
        let output = run(0, &["check", "case.yml"], &folder);
        assert_eq!(output.code, Some(3), "{}", output.text());
        output.text()
    };
    let refused = |end: &str, says: &[&str]| {
        assert_says(&by(end, "midpoint", "bar.right"), &[&["case.yml:15:"], says].concat());
    };
    refused("foundation: { stiffness: { normal: -1 } }", &["stiffness must be >= 0"]);
    refused("foundation: { stiffness: { normal: '0.5 - y' } }", &["negative", "max(x, 0)"]);
    refused("foundation: { stiffness: { normal: '1 + t' } }", &["stiffness can not depend on t"]);
    refused("foundation: { stiffness: { normal: 1, x: 1 } }", &["mixes"]);
    refused("foundation: { stiffness: { z: 1 } }", &["2D case has no z"]);
    refused("foundation: { stiffness: { normal: 0 } }", &["stiffness is zero"]);
    refused("foundation: { damping: { normal: '5 Pa/m' } }", &["damping coefficient per area"]);
    refused("spring: { damping: { x: '-1 N s/m' } }", &["damping must be >= 0"]);
    refused("spring: { stiffness: { normal: 1 } }", &["normal"]);
    refused("force: { x: '2 * y' }", &["can not depend on x, y or z"]);
    refused("force: { x: 2, at: [1] }", &["at"]);
    refused("torque: { x: 2 }", &["about z only"]);
    let [forceless, empty] = ["force: {}", "foundation: {}"].map(|end| by(end, "midpoint", "bar.right"));
    assert_says(&forceless, &["'end' has no components"]);
    assert_says(&empty, &["'end' has neither stiffness nor damping"]);
    let fixed = by("spring: { damping: { x: 1 } }", "{ static: { increments: 2 } }", "bar.right");
    assert_says(&fixed, &["case.yml:15:", "damping", "static"]);
    for end in ["force: { x: 2, at: [1, 0] }", "torque: { z: 2 }", "foundation: { stiffness: { x: 2 } }"] {
        assert_says(&by(end, "midpoint", "bar.tip"), &["case.yml", "expected a surface"]);
    }
    for end in [
        "force: { x: 2 }",
        "torque: { z: 2 }",
        "spring: { stiffness: { x: 2 } }",
        "foundation: { stiffness: { x: 2 } }",
    ] {
        assert_says(&by(end, "midpoint", "bar"), &["case.yml", "such as body.set"]);
    }
}
