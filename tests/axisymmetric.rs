//! Bodies of revolution in complete runs: closed forms of tubes, bars, rings and contact, press fits, free rigid
//! bodies, mistakes, and equal results on any number of ranks and after a restart.

mod common;

use std::f64::consts::{PI, TAU};

use common::{Folder, Results, Table, assert_says, near, run};

/// Elements in the plane.
const KINDS: [&str; 5] = ["tri3", "quad4", "tri6", "quad8", "quad9"];

fn tube(kind: &str, cells: usize, more: &str, ratio: f64) -> String {
    format!(
        "dimension: axisymmetric\nbodies:\n  tube:\n    \
         mesh: {{ box: {{ min: [1, 0], max: [2, 0.25], cells: [{cells}, {}], element: {kind} }} }}\n    \
         material: {{ neo_hookean: {{ young_modulus: 1e6, poisson_ratio: {ratio} }} }}\n    kinematics: linear\n{more}\
         boundary:\n  flat: {{ on: [tube.bottom, tube.top], displacement: {{ y: 0 }} }}\n  \
         inside: {{ on: tube.left, pressure: 1000 }}\n\
         time: {{ end: 1, scheme: {{ static: {{ increments: 1 }} }} }}\n\
         output: {{ fields: {{ every: 1, stresses: true }}, probes: {{ in: {{ at: [1, 0.125] }}, out: {{ at: [2, 0.125] }} }} }}\n",
        cells / 4
    )
}

/// Lamé's radial displacement \[m\] of that tube between rigid plates.
fn lame(radius: f64, ratio: f64) -> f64 {
    (1.0 + ratio) * 1000.0 / (1e6 * 3.0) * ((1.0 - 2.0 * ratio) * radius + 4.0 / radius)
}

/// A tube under internal pressure follows Lamé's solution: the energy with order 2 for linear elements and 4 for
/// quadratic ones, and the displacements as well.
#[test]
fn a_tube_under_pressure_follows_lame() {
    for kind in KINDS {
        let error = |cells: usize| {
            let results = Results::of(&tube(kind, cells, "", 0.3), 1);
            let energy = 0.5 * 1000.0 * lame(1.0, 0.3) * TAU * 0.25;
            let probes = results.table("probes.csv");
            let radial = [probes.last("in.u_x") / lame(1.0, 0.3), probes.last("out.u_x") / lame(2.0, 0.3)];
            let worst = radial.iter().fold(0.0_f64, |worst, ratio| worst.max((ratio - 1.0).abs()));
            [(results.table("energy.csv").last("strain") / energy - 1.0).abs(), worst]
        };
        let [[coarse, _], [fine, worst]] = [error(8), error(16)];
        let order = (coarse / fine).log2();
        let (least, most) = if kind.ends_with(['3', '4']) { (1.9, 3e-3) } else { (3.7, 3e-5) };
        assert!(order > least && worst < most, "{kind}: error {fine}, order {order}, displacement {worst}");
    }
}

/// Near incompressibility the treatments of locking keep the accuracy. Full integration of quad4 locks.
#[test]
fn nearly_incompressible_tubes_do_not_lock() {
    let error = |kind: &str, locking: &str| {
        let more = format!("    locking: {locking}\n");
        let probes = Results::of(&tube(kind, 16, &more, 0.4999), 1).table("probes.csv");
        (probes.last("in.u_x") / lame(1.0, 0.4999) - 1.0).abs()
    };
    for (kind, locking, most) in [
        ("quad4", "selective_reduced", 2e-3),
        ("quad4", "mean_dilatation", 2e-3),
        ("quad8", "selective_reduced", 1e-5),
        ("quad8", "mean_dilatation", 1e-4),
        ("quad9", "mean_dilatation", 1e-5),
        ("tri6", "mean_dilatation", 1e-4),
    ] {
        let found = error(kind, locking);
        assert!(found < most, "{kind} {locking}: {found}");
    }
    let locked = error("quad4", "none");
    assert!(locked > 0.05, "{locked}");
}

/// Lateral stretch and nominal stress \[Pa\] of a neo-Hookean bar with free sides, of 1 MPa and Poisson's ratio 0.3.
fn bar(stretch: f64) -> [f64; 2] {
    let mu = 1e6 / 2.6;
    let lambda = mu * 0.6 / 0.4;
    let kirchhoff = |l: f64, across: f64| mu * (l * l - 1.0) + lambda * (stretch * across * across).ln();
    let (mut low, mut high) = (0.1, 3.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if kirchhoff(middle, middle) < 0.0 { low = middle } else { high = middle }
    }
    [low, kirchhoff(stretch, low) / stretch]
}

/// A round bar that is pulled to 1.6 of its length follows the closed form, on any element and number of ranks.
#[test]
fn a_round_bar_follows_the_closed_form() {
    let [across, stress] = bar(1.6);
    for (number, kind) in KINDS.into_iter().enumerate() {
        let text = format!(
            "dimension: axisymmetric\nbodies:\n  bar:\n    \
             mesh: {{ box: {{ min: [0, 0], max: [0.5, 1], cells: [3, 4], element: {kind} }} }}\n    \
             material: {{ neo_hookean: {{ young_modulus: 1e6, poisson_ratio: 0.3 }} }}\n\
             boundary:\n  bottom: {{ on: bar.bottom, displacement: {{ y: 0 }} }}\n  \
             pull: {{ on: bar.top, displacement: {{ y: '0.6 * t' }} }}\n\
             time: {{ end: 1, scheme: {{ static: {{ increments: 3 }} }} }}\n\
             solver: {{ newton: {{ tolerance: 1.0e-12 }} }}\n\
             output: {{ probes: {{ side: {{ at: [0.5, 1] }} }} }}\n"
        );
        let results = Results::of(&text, 1 + number % 3);
        let pull = results.table("reactions.csv").only("boundary", "pull").last("force_y");
        near(&[pull], &[stress * PI * 0.25], 1e-9);
        near(&[results.table("probes.csv").last("side.u_x")], &[0.5 * (across - 1.0)], 1e-9);
        let ledger = results.table("energy.csv");
        near(&[ledger.last("strain")], &[ledger.last("external_work")], 2e-2);
    }
}

fn pile(upper: &str, lower: &str, area: &str) -> String {
    let law = "material: { neo_hookean: { young_modulus: 1e6, poisson_ratio: 0.3 } }";
    format!(
        "dimension: axisymmetric\nbodies:\n  \
         upper:\n    mesh: {{ box: {{ min: [0, 1], max: [1, 1.5], cells: [3, 2], element: {upper} }} }}\n    {law}\n  \
         lower:\n    mesh: {{ box: {{ min: [0, 0], max: [1, 1], cells: [4, 4], element: {lower} }} }}\n    {law}\n\
         obstacles:\n  floor: {{ plane: {{ point: [0, 0], normal: [0, 1] }} }}\n\
         contact:\n  \
         face: {{ contactor: upper.bottom, target: lower.top, area: {area}, normal: {{ penalty: {{ compliance: 1.0e-15 }} }} }}\n  \
         sole: {{ contactor: lower.bottom, target: floor, area: {area}, normal: {{ penalty: {{ compliance: 1.0e-15 }} }} }}\n\
         boundary:\n  press: {{ on: upper.top, displacement: {{ y: '-0.3 * t' }} }}\n\
         time: {{ end: 1, scheme: {{ static: {{ increments: 2 }} }} }}\nsolver: {{ newton: {{ tolerance: 1.0e-10 }} }}\n\
         output: {{ fields: {{ every: 1 }}, probes: {{ above: {{ at: [1, 1.5], on: upper }}, below: {{ at: [1, 0.5], on: lower }} }} }}\n"
    )
}

/// Two discs whose meshes do not match are pressed onto each other and onto a plane. They have the uniform state of
/// one bar, with one pressure at all vertices, on 1 to 3 ranks.
#[test]
fn discs_pass_the_patch_test() {
    let [across, stress] = bar(0.8);
    for (upper, lower, area, ranks) in [
        ("quad4", "quad9", "current", 1),
        ("quad4", "quad4", "current", 2),
        ("tri6", "quad8", "reference", 3),
        ("tri3", "tri6", "current", 1),
        ("quad9", "tri3", "reference", 2),
    ] {
        let results = Results::of(&pile(upper, lower, area), ranks);
        let table = results.table("contact.csv");
        for contact in ["face", "sole"] {
            let own = table.only("contact", contact);
            near(&[own.last("force_y")], &[-PI * stress], 1e-7);
            // The pressure is that of the area on which it acts.
            let stretch = if area == "current" { across * across } else { 1.0 };
            near(&[own.last("max_pressure")], &[-stress / stretch], 1e-7);
            near(&[own.last("area")], &[PI * stretch], 1e-7);
        }
        let probes = results.table("probes.csv");
        let found = [probes.last("above.u_x"), probes.last("below.u_x"), probes.last("below.u_y")];
        near(&found, &[across - 1.0, across - 1.0, -0.1], 1e-7);
    }
}

/// Two tied discs whose meshes do not match have the uniform state of one bar under a given traction. The spring of
/// the joint adds a jump of their displacement.
#[test]
fn tied_discs_pass_the_patch_test() {
    let [across, stress] = bar(0.8);
    let text = pile("quad4", "quad9", "current");
    let face = text.lines().find(|line| line.starts_with("  face:")).expect("the contact").to_owned();
    let text = text
        .replace(&format!("{face}\n"), "")
        .replace("displacement: { y: '-0.3 * t' }", &format!("traction: {{ y: '{stress} * t' }}"))
        .replace(
            "boundary:\n",
            "tied:\n  joint: { contactor: upper.bottom, target: lower.top }\nboundary:\n",
        );
    let results = Results::of(&text, 2);
    near(&[results.table("contact.csv").last("force_y")], &[-PI * stress], 1e-7);
    let probes = results.table("probes.csv");
    let found = [probes.last("above.u_x"), probes.last("below.u_x"), probes.last("below.u_y")];
    near(&found, &[across - 1.0, across - 1.0, -0.1], 1e-7);
}

/// Two rings with an interference follow the formula of press fits, the pressure with order 2.
#[test]
fn rings_fit_with_lames_pressure() {
    let pressure = |cells: usize| {
        let text = format!(
            "dimension: axisymmetric\nbodies:\n  \
             hub:\n    mesh: {{ box: {{ min: [0.5, 0], max: [1.001, 0.5], cells: [{cells}, 3] }} }}\n    \
             material: {{ neo_hookean: {{ young_modulus: 1e6, poisson_ratio: 0.3 }} }}\n    kinematics: linear\n  \
             shaft:\n    mesh: {{ box: {{ min: [1, 0], max: [2, 0.5], cells: [{}, 2] }} }}\n    \
             material: {{ neo_hookean: {{ young_modulus: 1e6, poisson_ratio: 0.3 }} }}\n    kinematics: linear\n\
             contact:\n  fit: {{ contactor: hub.right, target: shaft.left, normal: {{ penalty: {{ compliance: 1.0e-15 }} }}, initial_overclosure: accept }}\n\
             boundary:\n  flat: {{ on: [hub.bottom, hub.top, shaft.bottom, shaft.top], displacement: {{ y: 0 }} }}\n\
             time: {{ end: 1, scheme: {{ static: {{ increments: 1 }} }} }}\n",
            2 * cells
        );
        let table = Results::of(&text, 1).table("contact.csv");
        table.last("force_n") / table.last("area")
    };
    // Plane strain: interference 1e-3 at the radius 1, between the radii 0.5 and 2.
    let modulus = 1e6 / (1.0 - 0.09);
    let own = 0.3 / 0.7;
    let inner = 1.0 * ((1.0 + 0.25) / (1.0 - 0.25) - own);
    let outer = 1.0 * ((4.0 + 1.0) / (4.0 - 1.0) + own);
    let exact = 1e-3 * modulus / (inner + outer);
    let [coarse, fine] = [6, 12].map(|cells| (pressure(cells) / exact - 1.0).abs());
    // What remains is the change of the radii by the interference, which the formula neglects.
    assert!(fine < 3e-3 && coarse > 2.0 * fine, "{coarse} {fine}");
}

/// A thin ring breathes with the frequency of its hoop stiffness, and keeps its energy.
#[test]
fn a_ring_breathes_with_its_hoop_stiffness() {
    let period = TAU * (1000.0_f64 / 1e6).sqrt();
    let text = format!(
        "dimension: axisymmetric\nbodies:\n  ring:\n    \
         mesh: {{ box: {{ min: [0.995, 0], max: [1.005, 0.01], cells: [1, 1], element: quad8 }} }}\n    \
         material: {{ neo_hookean: {{ young_modulus: 1e6, poisson_ratio: 0.3 }} }}\n    density: 1000\n    kinematics: linear\n    \
         initial_velocity: [0.01, 0]\n\
         time: {{ end: {period}, step: {}, scheme: {{ newmark: {{ beta: 0.25, gamma: 0.5 }} }} }}\n\
         solver: {{ newton: {{ tolerance: 1.0e-12 }} }}\n\
         output: {{ probes: {{ mid: {{ at: [1, 0.005] }} }} }}\n",
        period / 200.0
    );
    let results = Results::of(&text, 1);
    let radial = results.table("probes.csv").numbers("mid.u_x");
    let most = 0.01 * period / TAU;
    assert!((radial[50] / most - 1.0).abs() < 3e-3, "{} {most}", radial[50]);
    assert!(radial[100].abs() < 5e-3 * most && radial[200].abs() < 5e-3 * most, "{radial:?}");
    let ledger = results.table("energy.csv");
    let kinetic = 0.5 * 1000.0 * 1e-4 * TAU * 0.01 * 0.01;
    near(&[ledger.numbers("kinetic")[0]], &[kinetic], 1e-6);
    let lost = ledger.numbers("numerical").iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    assert!(lost < 1e-9 * kinetic, "{lost}");
}

/// A solid disc of unit radius and height 0.5.
fn disc(more: &str, boundary: &str, time: &str) -> String {
    format!(
        "dimension: axisymmetric\nbodies:\n  disc:\n    \
         mesh: {{ box: {{ min: [0, 0], max: [1, 0.5], cells: [4, 2] }} }}\n    \
         material: {{ neo_hookean: {{ young_modulus: 1e6, poisson_ratio: 0.3 }} }}\n    density: 1000\n{more}\
         boundary:\n  bottom: {{ on: disc.bottom, displacement: {{ y: 0 }} }}\n{boundary}\
         time: {time}\n\
         output: {{ probes: {{ axis: {{ at: [0, 0.5] }}, rim: {{ at: [1, 0.5] }} }} }}\n"
    )
}

/// Nodes on the axis stay there, whatever the initial velocity, loads and displacements are.
#[test]
fn the_axis_stays_where_it_is() {
    let stays = |results: &Results| {
        let probes = results.table("probes.csv");
        for column in ["axis.u_x", "axis.v_x"] {
            assert!(probes.numbers(column).iter().all(|value| *value == 0.0), "{column}");
        }
        probes.numbers("rim.u_x").iter().fold(0.0_f64, |most, value| most.max(value.abs()))
    };
    let dynamic = "{ end: 0.01, step: 1.0e-3, scheme: { newmark: { beta: 0.25, gamma: 0.5 } } }";
    for velocity in ["[1, 0]", "['1 * x', 0]"] {
        let text = disc(&format!("    initial_velocity: {velocity}\n"), "", dynamic);
        assert!(stays(&Results::of(&text, 2)) > 1e-3, "{velocity}");
    }
    let fixed = "{ end: 1, scheme: { static: { increments: 2 } } }";
    let stretch = "  all: { on: disc, displacement: { x: '0.1 * x * t' } }\n";
    near(&[stays(&Results::of(&disc("", stretch, fixed), 1))], &[0.1], 1e-12);
    // Surfaces that are put onto a cone.
    for slope in ["0.3", "-0.02"] {
        let text = disc("", "", fixed).replace(
            "boundary:\n",
            &format!(
                "obstacles:\n  cone: {{ plane: {{ point: [0, 0.49], normal: [{slope}, -1] }} }}\n\
                 contact:\n  seat: {{ contactor: disc.top, target: cone, initial_overclosure: adjust }}\nboundary:\n"
            ),
        );
        stays(&Results::of(&text, 2));
    }
}

/// A rigid sphere that a force presses into an elastic half space sinks in as Hertz says, and balances the force.
#[test]
fn a_rigid_sphere_sinks_in_as_hertz_says() {
    let results = Results::of(&common::shipped("hertz/sphere-axisymmetric.yml", &[]), 2);
    // The sphere touches the ground when its centre is at 1 m.
    let approach = 1.0 - results.table("rigid.csv").last("position_y");
    assert!((approach / 4e-4 - 1.0).abs() < 1e-2, "{approach}");
    near(&[results.table("contact.csv").last("force_y")], &[-11.721612], 1e-7);
    let area = results.table("contact.csv").last("area");
    assert!((area / (PI * 0.02 * 0.02) - 1.0).abs() < 0.02, "{area}");
    let pressure = results.table("contact.csv").last("max_pressure");
    let peak = 1.5 * 11.721612 / (PI * 0.02 * 0.02);
    assert!((pressure / peak - 1.0).abs() < 0.01, "{pressure} {peak}");
}

/// A rubber sleeve that a rigid cone pushes open with friction.
const SLEEVE: &str = "
dimension: axisymmetric
bodies:
  sleeve:
    mesh: { box: { min: [0.5, 0], max: [0.7, 0.6], cells: [4, 10] } }
    material: { mooney_rivlin: { c10: 4e5, c01: 1e5, poisson_ratio: 0.48 } }
    density: 1100
rigid:
  cone:
    shape: { polyline: { points: [[0, 0.62], [0.44, 0.62], [0.6, 1.32], [0, 1.32]], radius: 0.05, closed: true } }
    motion: { translation: { y: '-20 * t' } }
contact:
  bore:
    contactor: [sleeve.left, sleeve.top]
    target: cone
    normal: { penalty: { compliance: 1.0e-8 } }
    friction: { coulomb: { coefficient: 0.2, regularization: { stick_velocity: 1.0e-2 } } }
boundary:
  seat: { on: sleeve.bottom, displacement: { y: 0 } }
time: { end: 0.01, step: 1.0e-3, scheme: { generalized_alpha: { spectral_radius: 0.8 } } }
solver: { newton: { tolerance: 1.0e-11 } }
output: { checkpoint: { every: 5 } }
";

/// Friction on a moving cone: equal results on 1 to 3 ranks and after a restart on other numbers of ranks; the work of
/// the cone is in the ledger.
#[test]
fn results_are_independent_of_ranks_and_restarts() {
    let folder = Folder::new("axisymmetric");
    folder.write("case.yml", SLEEVE);
    for ranks in 1..=3 {
        let said = run(ranks, &["case.yml", "-q", "-o", &format!("on-{ranks}")], &folder).success().text();
        // The hint of an impact does not propose a scheme that is refused here.
        assert!(said.contains("warning: impact") && !said.contains("conserving"), "{said}");
    }
    let columns =
        [("energy.csv", "strain"), ("energy.csv", "friction_dissipated"), ("contact.csv", "force_y")];
    for ranks in 1..=3 {
        let after = format!("after-{ranks}");
        let start = "--restart=on-2/checkpoints/step-000005.ckpt";
        run(ranks, &["case.yml", "-q", "-o", &after, start], &folder).success();
        for (table, column) in columns {
            let [one, several, after] = ["on-1", &format!("on-{ranks}"), &after]
                .map(|of| Table::read(&folder.join(of).join(table)).numbers(column));
            assert!(one.last().is_some_and(|value| value.abs() > 0.0), "{column}: {one:?}");
            near(&several, &one, 1e-7);
            let last = |values: &[f64]| values[values.len() - 3..].to_vec();
            near(&last(&after), &last(&one), 1e-7);
        }
    }
    let energy = Table::read(&folder.join("on-1/energy.csv"));
    let unexplained = energy.last("numerical").abs();
    assert!(unexplained < 0.05 * energy.last("strain"), "{unexplained}");
}

/// Work of a cone that is pushed into the sleeve is the energy of the sleeve and the heat of friction. The
/// rest is of the order of the mesh and the steps.
#[test]
fn the_ledger_of_friction_on_a_cone_closes() {
    let text = SLEEVE
        .replace("cells: [4, 10]", "cells: [4, 10], element: quad8")
        .replace("    density: 1100\n", "")
        .replace("stick_velocity: 1.0e-2", "stick_stiffness: 1.0e9")
        .replace(
            "step: 1.0e-3, scheme: { generalized_alpha: { spectral_radius: 0.8 } }",
            "scheme: { static: { increments: 40 } }",
        );
    let results = Results::of(&text, 2);
    let ledger = results.table("energy.csv");
    let work = ledger.last("external_work");
    let heat = ledger.last("friction_dissipated");
    assert!(heat > 0.1 * work, "{heat} {work}");
    assert!(ledger.last("numerical").abs() < 5e-3 * work, "{} {work}", ledger.last("numerical"));
}

/// Keys that are undefined for bodies of revolution are refused with their place and a remedy.
#[test]
fn undefined_keys_are_refused() {
    let static_scheme = "generalized_alpha: { spectral_radius: 0.8 }";
    let material = "    density: 1100\n";
    let seat = "  seat: { on: sleeve.bottom, displacement: { y: 0 } }\n";
    for (text, says) in [
        (
            SLEEVE.replace("dimension: axisymmetric", "dimension: axi"),
            ["case.yml:2:12", "axisymmetric", "'axi'"],
        ),
        (
            SLEEVE.replace("dimension: axisymmetric", "dimension: axisymmetric\nplane: stress"),
            ["case.yml:3:8", "`plane` is for 2D", "axisymmetric"],
        ),
        (
            SLEEVE.replace(&format!("{{ {static_scheme} }}"), "conserving"),
            ["case.yml:20:42", "conserving", "midpoint"],
        ),
        (
            SLEEVE.replace(
                material,
                &format!("{material}    viscoelasticity: {{ prony: [{{ share: 0.5, time: 1 }}] }}\n"),
            ),
            ["case.yml:8:22", "viscoelasticity", "sector"],
        ),
        (
            SLEEVE.replace("translation: { y: '-20 * t' }", "translation: { x: '-20 * t' }"),
            ["case.yml:11:", "changes its radius", "remove x"],
        ),
        (
            SLEEVE.replace("translation: { y: '-20 * t' }", "rotation: { angle: '-20 * t' }"),
            ["case.yml:11:", "rotation", "remove it"],
        ),
        (
            SLEEVE.replace(
                "    motion: { translation: { y: '-20 * t' } }",
                "    free: { mass: 1, fixed: [ux] }",
            ),
            ["case.yml:11:11", "axis y only", "fixed: [ux, rz]"],
        ),
        (
            SLEEVE.replace(seat, &format!("{seat}  turn: {{ on: sleeve.top, torque: {{ z: 1 }} }}\n")),
            ["case.yml:20:3", "torque 'turn'", "remove it"],
        ),
        (
            SLEEVE.replace(
                "    motion: { translation: { y: '-20 * t' } }",
                "    free: { mass: 1, fixed: [ux, rz], torque: { z: 1 } }",
            ),
            ["case.yml:11:", "does not rotate", "remove it"],
        ),
        (
            SLEEVE.replace(
                "boundary:\n",
                "tied:\n  cell: { contactor: sleeve.right, target: sleeve.left, offset: [-0.2, 0] }\nboundary:\n",
            ),
            ["case.yml:19:", "along the axis y only", "remove x"],
        ),
        (
            disc("", "  open: { on: disc, displacement: { x: '0.1 * t' } }\n", "{ end: 1, scheme: { static: { increments: 2 } } }"),
            ["case.yml:9:", "on the axis of revolution", "without the nodes at x = 0"],
        ),
        (
            SLEEVE.replace("min: [0.5, 0]", "min: [-0.5, 0]"),
            ["case.yml:", "negative radius", "x >= 0"],
        ),
    ] {
        let folder = Folder::new("axisymmetric");
        folder.write("case.yml", &text);
        let output = run(0, &["check", "case.yml"], &folder);
        assert!(matches!(output.code, Some(3 | 4)), "{}", output.text());
        assert_says(&output.text(), &says);
    }
}

/// `check` says what the case is.
#[test]
fn check_describes_bodies_of_revolution() {
    let folder = Folder::new("axisymmetric");
    folder.write("case.yml", SLEEVE);
    let text = run(0, &["check", "case.yml"], &folder).success().text();
    assert_says(&text, &["axisymmetric: forces and energies are those of the whole revolution"]);
}
