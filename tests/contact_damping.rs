//! Damping of contacts in complete runs, against closed forms: decay in permanent contact, restitution
//! of a rebound, the energy ledger, massless contact nodes, the staggered strategy, and equal results
//! on any number of ranks and after a restart.

mod common;

use common::{Folder, Results, assert_says, run};

/// A stiff block of the mass 1 on a plane with the penalty 1e4: an oscillator of the frequency 100 1/s.
const BLOCK: &str = "
dimension: 2
bodies:
  block:
    mesh: { box: { min: [0, HEIGHT], max: [1, TOP], cells: [1, 1], element: quad4 } }
    material: { saint_venant_kirchhoff: { young_modulus: 1.0e9, poisson_ratio: 0 } }
    density: 1
    kinematics: linear
    initial_velocity: VELOCITY
obstacles: { floor: { plane: { point: [0, 0], normal: [0, 1] } } }
contact:
  sole:
    contactor: block.bottom
    target: floor
    normal: { penalty: { compliance: 1.0e-4 } }
    damping: DAMPING
    area: reference
    initial_overclosure: accept
boundary: { weight: { on: block, gravity: [0, WEIGHT] } }
time: { end: END, step: STEP, scheme: SCHEME }
solver: { newton: { tolerance: 1.0e-12 } }
output: { fields: { every: 100000 }, probes: { low: { at: [0, HEIGHT] } } }
";

/// Frequency of the oscillator without damping [1/s].
const FREQUENCY: f64 = 100.0;

const NEWMARK: &str = "{ newmark: { beta: 0.25, gamma: 0.5 } }";

/// A flat block in permanent contact: it oscillates about the penetration of its weight, and slides.
fn resting(damping: &str, scheme: &str, step: &str) -> String {
    BLOCK
        .replace("[0, HEIGHT], max: [1, TOP], cells: [1, 1]", "[0, -1.0e-3], max: [10, 0.099], cells: [2, 1]")
        .replace("[0, HEIGHT]", "[5, 0.099]")
        .replace("1.0e-4", "1.0e-3")
        .replace("DAMPING", damping)
        .replace("SCHEME", scheme)
        .replace("STEP", step)
        .replace("VELOCITY", "[0.2, 0.05]")
        .replace("WEIGHT", "-10")
        .replace("END", "0.1")
}

/// The block in space, or on a body that is fixed.
fn in_space(text: &str) -> String {
    text.replace("dimension: 2", "dimension: 3")
        .replace(
            "[0, -1.0e-3], max: [10, 0.099], cells: [2, 1]",
            "[0, 0, -1.0e-3], max: [10, 1, 0.099], cells: [2, 2, 1]",
        )
        .replace("quad4", "hex8")
        .replace("[0.2, 0.05]", "[0.2, 0, 0.05]")
        .replace("point: [0, 0], normal: [0, 1]", "point: [0, 0, 0], normal: [0, 0, 1]")
        .replace("[0, -10]", "[0, 0, -10]")
        .replace("at: [5, 0.099]", "at: [5, 0.5, 0.099]")
}

/// A fixed body in place of the plane.
fn on_a_body(text: &str) -> String {
    let space = text.contains("dimension: 3");
    let floor = text.lines().find(|line| line.starts_with("obstacles")).expect("the floor");
    let (shape, held) = if space {
        ("min: [-1, -1, -1], max: [12, 2, 0], cells: [4, 5, 1], element: hex8", "{ x: 0, y: 0, z: 0 }")
    } else {
        ("min: [-1, -1], max: [12, 0], cells: [5, 1], element: quad4", "{ x: 0, y: 0 }")
    };
    let base = format!(
        "bodies:\n  base:\n    mesh: {{ box: {{ {shape} }} }}\n    density: 1\n    kinematics: linear\n    \
         material: {{ saint_venant_kirchhoff: {{ young_modulus: 1.0e9, poisson_ratio: 0 }} }}\n"
    );
    text.replace(&format!("{floor}\n"), "")
        .replace("bodies:\n", &base)
        .replace("target: floor", "target: base.top")
        .replace("boundary: {", &format!("boundary: {{ bed: {{ on: base, displacement: {held} }},"))
}

const RESTING: &str = "{ normal: { kelvin: { viscosity: 2 } }, tangential: 1.5 }";

/// Largest differences of height and slide from `v / w_d exp(-z w t) sin(w_d t)` and
/// `v / c (1 - exp(-c t))`, relative to the first maximum and the end.
fn errors(results: &Results, up: &str) -> [f64; 2] {
    let probes = results.table("probes.csv");
    let ratio: f64 = 0.1;
    let damped = FREQUENCY * (1.0 - ratio * ratio).sqrt();
    let height = |t: f64| 0.05 / damped * (-ratio * FREQUENCY * t).exp() * (damped * t).sin();
    let slide = |t: f64| 0.2 / 15.0 * (1.0 - (-15.0 * t).exp());
    let most = |column: &str, exact: &dyn Fn(f64) -> f64| {
        let rows = probes.numbers("time").into_iter().zip(probes.numbers(column));
        rows.map(|(t, u)| (u - exact(t)).abs()).fold(0.0, f64::max)
    };
    [most(&format!("low.u_{up}"), &height) / 5e-4, most("low.u_x", &slide) / slide(0.1)]
}

/// In permanent contact the block oscillates with the damping ratio `c / (2 m w)` and slides to a stop
/// like a mass on a dashpot, in every scheme, in the plane and in space, on a plane and on a body.
#[test]
fn permanent_contact_decays_like_the_closed_form() {
    for (scheme, order) in [
        (NEWMARK, 1.9),
        ("{ generalized_alpha: { spectral_radius: 0.8 } }", 1.9),
        ("{ hht: { spectral_radius: 0.8 } }", 1.9),
        ("midpoint", 1.9),
        ("conserving", 1.9),
        ("backward_euler", 0.85),
    ] {
        let text = |step| resting(RESTING, scheme, step);
        let found = ["1.0e-3", "5.0e-4"].map(|step| errors(&Results::of(&text(step), 1), "y"));
        // The slide is limited by the elasticity of the block.
        let [coarse, fine] = found;
        let bounds = if order > 1.0 { [1.5e-3, 5e-5] } else { [0.1, 3e-3] };
        assert!(fine[0] < bounds[0] && fine[1] < bounds[1], "{scheme}: {found:?}");
        assert!((coarse[0] / fine[0]).log2() > order, "{scheme}: {found:?}");
        if [NEWMARK, "conserving"].contains(&scheme) {
            let text = text("5.0e-4");
            for (text, up, ranks) in
                [(in_space(&text), "z", 2), (on_a_body(&text), "y", 2), (on_a_body(&in_space(&text)), "z", 1)]
            {
                let [height, slide] = errors(&Results::of(&text, ranks), up);
                assert!(height < 1.5e-3 && slide < 5e-5, "{scheme}, {up}: {height} {slide}");
            }
        }
    }
}

/// Successive maxima fall by the logarithmic decrement `2 pi z / sqrt(1 - z^2)`.
#[test]
fn maxima_fall_by_the_logarithmic_decrement() {
    let probes = Results::of(&resting(RESTING, NEWMARK, "1.0e-4").replace("end: 0.1", "end: 0.15"), 1)
        .table("probes.csv");
    let u = probes.numbers("low.u_y");
    let maxima: Vec<f64> = u.windows(3).filter(|w| w[1] > w[0] && w[1] > w[2]).map(|w| w[1]).collect();
    let ratio: f64 = 0.1;
    let decrement = std::f64::consts::TAU * ratio / (1.0 - ratio * ratio).sqrt();
    let found = (maxima[0] / maxima[1]).ln();
    assert!((found / decrement - 1.0).abs() < 2e-3, "{found}, expected {decrement}");
}

/// The energy that is left over: zero to rounding with the trapezoidal rule and the conserving scheme,
/// where the contact stays closed.
#[test]
fn the_ledger_closes() {
    for scheme in [NEWMARK, "conserving"] {
        for text in [resting(RESTING, scheme, "1.0e-3"), on_a_body(&resting(RESTING, scheme, "1.0e-3"))] {
            let results = Results::of(&text, 1);
            let energy = results.table("energy.csv");
            let heat = energy.numbers("damping_dissipated");
            assert!(heat[0] == 0.0 && heat.windows(2).all(|pair| pair[1] >= pair[0]), "{heat:?}");
            assert!(energy.last("damping_dissipated") > 0.015, "{heat:?}");
            let of_contact = results.table("contact.csv").last("damping_work");
            assert!((of_contact / energy.last("damping_dissipated") - 1.0).abs() < 1e-12, "{of_contact}");
            let left = energy.numbers("numerical").iter().fold(0.0, |most: f64, left| most.max(left.abs()));
            // Between bodies the area varies by the strain.
            assert!(left < 2e-5 * energy.last("damping_dissipated"), "{scheme}: {left}");
        }
    }
}

/// The block that flies against the plane with the speed 1.
fn rebound(damping: &str, scheme: &str, step: &str) -> Results {
    let text = BLOCK
        .replace("DAMPING", damping)
        .replace("SCHEME", scheme)
        .replace("STEP", step)
        .replace("HEIGHT", "1.0e-3")
        .replace("TOP", "1.001")
        .replace("VELOCITY", "[0, -1]")
        .replace("WEIGHT", "0")
        .replace("END", "0.05");
    Results::of(&text, 1)
}

/// Restitution of a mass on a spring and a dashpot that leave it when their force is zero:
/// `exp(-z / sqrt(1 - z^2) (pi - atan2(2 z sqrt(1 - z^2), 1 - 2 z^2)))`.
fn kelvin(ratio: f64) -> f64 {
    let root = (1.0 - ratio * ratio).sqrt();
    let phase = std::f64::consts::PI - (2.0 * ratio * root).atan2(1.0 - 2.0 * ratio * ratio);
    (-ratio / root * phase).exp()
}

/// Restitution under Hunt and Crossley's law with `a = factor * speed`, from
/// `a (1 + e) = ln((1 + a) / (1 - a e))`, by bisection.
fn hunt_crossley(a: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0_f64.min(1.0 / a));
    for _ in 0..100 {
        let e = 0.5 * (low + high);
        if ((1.0 + a) / (1.0 - a * e)).ln() < a * (1.0 + e) { low = e } else { high = e }
    }
    0.5 * (low + high)
}

/// The speed after a rebound is that of the closed forms, in every scheme. Without damping it is the
/// speed before.
#[test]
fn a_rebound_has_the_restitution_of_the_closed_forms() {
    let laws = [
        ("{ normal: { kelvin: { viscosity: 20 } } }", kelvin(0.1)),
        ("{ normal: { kelvin: { viscosity: 100 } } }", kelvin(0.5)),
        ("{ normal: { hunt_crossley: { factor: 0.3 } } }", hunt_crossley(0.3)),
        ("{ normal: { hunt_crossley: { factor: '2 s/m' } } }", hunt_crossley(2.0)),
        ("{ tangential: 1 }", 1.0),
    ];
    assert!((kelvin(1e-9) - 1.0).abs() < 1e-8 && (hunt_crossley(1e-3) - 1.0).abs() < 1e-3);
    for (scheme, bound) in [
        (NEWMARK, 6e-3),
        ("{ generalized_alpha: { spectral_radius: 0.8 } }", 6e-3),
        ("midpoint", 6e-3),
        ("conserving", 6e-3),
        ("backward_euler", 0.06),
    ] {
        for (law, expected) in laws {
            let results = rebound(law, scheme, "2.0e-4");
            let found = results.table("momentum.csv").last("linear_y");
            assert!((found - expected).abs() < bound, "{scheme} {law}: {found}, expected {expected}");
            let energy = results.table("energy.csv");
            let heat = energy.last("damping_dissipated");
            let lost = 0.5 * (1.0 - expected * expected);
            assert!((heat - lost).abs() < 2.0 * bound, "{scheme} {law}: {heat}, expected {lost}");
        }
    }
}

/// What the rebound leaves over in the ledger falls with the step, and the conserving scheme leaves
/// nothing over.
#[test]
fn the_ledger_of_a_rebound_closes() {
    let law = "{ normal: { kelvin: { viscosity: 100 } } }";
    let left = |scheme: &str, step: &str| {
        let energy = rebound(law, scheme, step).table("energy.csv");
        energy.numbers("numerical").iter().fold(0.0, |most: f64, left| most.max(left.abs()))
    };
    let [coarse, fine] = ["1.0e-3", "1.0e-4"].map(|step| left(NEWMARK, step));
    assert!(fine < 2e-3 && fine < 0.3 * coarse, "{coarse} {fine}");
    assert!(left("conserving", "1.0e-3") < 1e-9, "{}", left("conserving", "1.0e-3"));
}

/// A block that falls obliquely on another one.
const IMPACT: &str = "
dimension: 3
bodies:
  upper:
    mesh: { box: { min: [0.02, 0.03, 0.1], max: [0.12, 0.13, 0.2], cells: [3, 3, 3], element: hex8 } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    density: 1000
    initial_velocity: [0.5, 0.2, -2]
  lower:
    mesh: { box: { min: [0, 0, 0], max: [0.2, 0.2, 0.0999], cells: [4, 5, 2], element: hex8 } }
    material: { neo_hookean: { young_modulus: 2.0e6, poisson_ratio: 0.3 } }
    density: 1000
contact:
  between:
    contactor: upper.bottom
    target: lower.top
    normal: { penalty: { compliance: 1.0e-8 } }
    friction: { coulomb: { coefficient: 0.3, regularization: { stick_velocity: 1.0e-2 } } }
    damping: { normal: { NORMAL }, tangential: 2.0e3 }
boundary: { floor: { on: lower.bottom, displacement: { x: 0, y: 0, z: 0 } } }
time: { end: 4.0e-3, step: 2.0e-4, scheme: { generalized_alpha: { spectral_radius: 0.8 } } }
solver: { newton: { tolerance: 1.0e-10 } }
output: { fields: { every: 100000 }, probes: { corner: { at: [0.02, 0.03, 0.1] } } }
";

const HUNT_CROSSLEY: &str = "hunt_crossley: { factor: 0.3 }";

fn apart(one: &Results, other: &Results, table: &str, column: &str) -> f64 {
    let [a, b] = [one, other].map(|results| results.table(table).numbers(column));
    assert_eq!(a.len(), b.len());
    let scale = a.iter().fold(f64::MIN_POSITIVE, |most: f64, value| most.max(value.abs()));
    a.iter().zip(&b).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs())) / scale
}

/// Results agree on 1 to 4 ranks and with both strategies, and damping takes a part of the energy.
#[test]
fn ranks_and_strategies_agree() {
    for law in [HUNT_CROSSLEY, "kelvin: { viscosity: 2.0e4 }"] {
        let text = IMPACT.replace("NORMAL", law);
        let one = Results::of(&text, 1);
        let energy = one.table("energy.csv");
        let heat = energy.last("damping_dissipated");
        assert!(heat > 0.02 * energy.numbers("total")[0], "{law}: {heat}");
        for ranks in [2, 4] {
            let several = Results::of(&text, ranks);
            for (table, column) in [("probes.csv", "corner.u_z"), ("energy.csv", "damping_dissipated")] {
                let most = apart(&one, &several, table, column);
                assert!(most < 1e-6, "{law}, {ranks} ranks: {column} {most}");
            }
        }
        let staggered = text.replace("solver: {", "solver: { strategy: staggered,");
        let most = apart(&one, &Results::of(&staggered, 1), "probes.csv", "corner.u_z");
        assert!(most < 1e-4, "{law}, staggered: {most}");
    }
}

/// A run that ends and is continued computes the same bits as one that does not end.
#[test]
fn a_continued_run_has_the_same_bits() {
    let folder = Folder::new("contact-damping");
    let text = IMPACT.replace("NORMAL", "kelvin: { viscosity: 2.0e4 }");
    let whole = text.replace("output: {", "output: { checkpoint: { every: 10 },");
    folder.write("case.yml", &whole.replace("solver: {", "solver: { linear: gmres_asm_ilu,"));
    run(2, &["case.yml", "-q", "-o", "whole"], &folder).success();
    let start = "--restart=whole/checkpoints/step-000010.ckpt";
    run(2, &["case.yml", "-q", "-o", "branch", start], &folder).success();
    for table in ["energy.csv", "probes.csv", "contact.csv"] {
        let rows = |of: &str| -> Vec<String> {
            let text = std::fs::read_to_string(folder.join(of).join(table)).expect("a table");
            text.lines().map(str::to_owned).collect()
        };
        let (whole, branch) = (rows("whole"), rows("branch"));
        assert_eq!(branch.len(), 11);
        assert_eq!(branch[1..], whole[whole.len() - 10..], "{table}");
    }
}

/// Massless contact nodes have the damping of nodes with mass, also with a requested penetration.
#[test]
fn massless_nodes_are_damped() {
    let at = |step: &str| {
        let text = resting(RESTING, NEWMARK, step)
            .replace("cells: [2, 1]", "cells: [2, 4]")
            .replace("density: 1\n", "density: 1\n    mass: redistributed\n");
        errors(&Results::of(&text, 2), "y")
    };
    // The velocity of a node without mass is the mean of the step, of first order.
    let [coarse, fine] = ["5.0e-4", "2.5e-4"].map(at);
    assert!(fine[0] < 0.02 && fine[1] < 4e-3, "{coarse:?} {fine:?}");
    assert!(coarse[0] / fine[0] > 1.8 && coarse[1] / fine[1] > 1.8, "{coarse:?} {fine:?}");
    let requested = IMPACT
        .replace("NORMAL", HUNT_CROSSLEY)
        .replace("density: 1000\n    initial", "density: 1000\n    mass: redistributed\n    initial")
        .replace("output: {", "accuracy: { penetration: 2.0e-5 }\noutput: {");
    let energy = Results::of(&requested, 2).table("energy.csv");
    assert!(energy.last("damping_dissipated") > 0.0);
    assert!(energy.last("numerical").abs() < 0.1 * energy.last("total"));
}

/// A static start is not damped; the static scheme and invalid parameters are refused with their place.
#[test]
fn invalid_damping_is_refused() {
    // The contact nodes move with a prescribed velocity from the start on.
    let start = |damping: &str| {
        let side = "boundary: { side: { on: block.bottom, displacement: { x: 0, y: '-0.2 * t' } },";
        let text = on_a_body(&resting(damping, "midpoint", "1.0e-3"))
            .replace("on: base,", "on: base.bottom,")
            .replace("time:", "start: { equilibrium: { increments: 1 } }\ntime:")
            .replace("boundary: {", side)
            .replace("    initial_velocity: [0.2, 0.05]\n", "");
        Results::of(&text.replace("    damping: none\n", ""), 1).table("energy.csv").numbers("strain")[0]
    };
    let undamped = start("none");
    assert!(undamped > 0.0);
    assert_eq!(start("{ normal: { hunt_crossley: { factor: 1 } } }"), undamped);
    let folder = Folder::new("contact-damping");
    let by = |damping: &str, scheme: &str| {
        folder.write("case.yml", &resting(damping, scheme, "1.0e-3"));
        let output = run(0, &["check", "case.yml"], &folder);
        assert_eq!(output.code, Some(3), "{}", output.text());
        output.text()
    };
    assert_says(&by("{}", "midpoint"), &["case.yml:16:", "neither `normal` nor `tangential`"]);
    assert_says(&by("{ tangential: -1 }", "midpoint"), &["case.yml:16:", "tangential viscosity"]);
    assert_says(&by("{ normal: { kelvin: { viscosity: 0 } } }", "midpoint"), &["case.yml:16:", "viscosity"]);
    assert_says(
        &by("{ normal: { hunt_crossley: { factor: '1 Pa' } } }", "midpoint"),
        &["case.yml:16:", "1 Pa"],
    );
    assert_says(&by("{ normal: { hertz: 1 } }", "midpoint"), &["case.yml:16:", "kelvin"]);
    assert_says(&by(RESTING, "{ static: { increments: 2 } }"), &["case.yml:16:", "damping", "static"]);
}
