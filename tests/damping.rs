//! Rayleigh damping in complete runs, against closed forms: a damped oscillator in every scheme and in both
//! kinematics, free flight, the energy ledger, and equal results on any number of ranks and after a restart.

mod common;

use common::{Folder, Results, assert_says, run};

/// A bar of one element that can only extend along x: an oscillator of one unknown with stiffness
/// `E A / L = 3e4` and mass `rho A L / 3 = 3`.
const OSCILLATOR: &str = "
dimension: 2
bodies:
  bar:
    mesh: { box: { min: [0, 0], max: [1, 1], cells: [1, 1], element: quad4 } }
    material: { saint_venant_kirchhoff: { young_modulus: 3.0e4, poisson_ratio: 0 } }
    density: 9
    kinematics: linear
    damping: { rayleigh: DAMPING }
    initial_velocity: ['1.0e-3 * x', 0]
boundary:
  wall: { on: bar.left, displacement: { x: 0 } }
  floor: { on: bar.bottom, displacement: { y: 0 } }
  lid: { on: bar.top, displacement: { y: 0 } }
time: { end: 0.1, step: STEP, scheme: SCHEME }
solver: { newton: { tolerance: 1.0e-12 } }
output: { fields: { every: 100000 }, probes: { tip: { at: [1, 0] } } }
";

/// Angular frequency of the oscillator without damping [1/s].
const FREQUENCY: f64 = 100.0;

fn oscillator(damping: &str, scheme: &str, step: &str) -> Results {
    let case = OSCILLATOR.replace("DAMPING", damping).replace("SCHEME", scheme).replace("STEP", step);
    Results::of(&case, 1)
}

/// Largest difference from `v_0 / w_d exp(-z w t) sin(w_d t)`, relative to its first maximum.
fn error(results: &Results, ratio: f64) -> f64 {
    let probes = results.table("probes.csv");
    let damped = FREQUENCY * (1.0 - ratio * ratio).sqrt();
    let exact = |t: f64| 1.0e-3 / damped * (-ratio * FREQUENCY * t).exp() * (damped * t).sin();
    let rows = probes.numbers("time").into_iter().zip(probes.numbers("tip.u_x"));
    rows.map(|(t, u)| (u - exact(t)).abs()).fold(0.0, f64::max) / 1.0e-5
}

/// The motion has the damping ratio `mass / (2 w) + stiffness w / 2` and converges with order two.
#[test]
fn an_oscillator_decays_like_the_closed_form() {
    let laws = [
        ("{ mass: 20 }", 0.1),
        ("{ stiffness: 2.0e-3 }", 0.1),
        ("{ mass: '20 1/s', stiffness: '4 ms' }", 0.3),
    ];
    for scheme in [
        "{ newmark: { beta: 0.25, gamma: 0.5 } }",
        "{ generalized_alpha: { spectral_radius: 0.8 } }",
        "{ hht: { spectral_radius: 0.8 } }",
        "midpoint",
        "conserving",
    ] {
        for (law, ratio) in laws {
            let errors =
                ["2.0e-3", "1.0e-3", "5.0e-4"].map(|step| error(&oscillator(law, scheme, step), ratio));
            let order = (errors[1] / errors[2]).log2();
            assert!(errors[2] < 3e-3 && order > 1.9, "{scheme} {law}: {errors:?}, order {order}");
        }
    }
}

/// Successive maxima of the oscillator fall by the logarithmic decrement `2 pi z / sqrt(1 - z^2)`.
#[test]
fn maxima_fall_by_the_logarithmic_decrement() {
    let probes =
        oscillator("{ mass: 4 }", "{ newmark: { beta: 0.25, gamma: 0.5 } }", "1.0e-4").table("probes.csv");
    let u = probes.numbers("tip.u_x");
    let maxima: Vec<f64> = u.windows(3).filter(|w| w[1] > w[0] && w[1] > w[2]).map(|w| w[1]).collect();
    let ratio = 4.0 / (2.0 * FREQUENCY);
    let decrement = std::f64::consts::TAU * ratio / (1.0 - ratio * ratio).sqrt();
    let found = (maxima[0] / maxima[1]).ln();
    assert!((found / decrement - 1.0).abs() < 2e-3, "{found}, expected {decrement}");
}

/// A block in free flight whose velocity is not uniform.
const FLIGHT: &str = "
dimension: 3
bodies:
  block:
    mesh: { box: { min: [0, 0, 0], max: [0.1, 0.2, 0.3], cells: [2, 2, 3], element: hex8 } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    density: 1000
    damping: { rayleigh: DAMPING }
    initial_velocity: ['3 + 20 * z', '1 - 5 * x', 2]
time: { end: 0.02, step: 5.0e-4, scheme: conserving }
solver: { newton: { tolerance: 1.0e-12 } }
output: { fields: { every: 100000 } }
";

/// Mass-proportional damping makes the momentum fall by `(1 - a dt / 2) / (1 + a dt / 2)` in each
/// step of the midpoint rule. The ledger closes to rounding, and the heat never falls.
#[test]
fn momentum_decays_and_the_ledger_closes() {
    for damping in ["{ mass: 30 }", "{ stiffness: 1.0e-4 }", "{ mass: 30, stiffness: 1.0e-4 }"] {
        let results = Results::of(&FLIGHT.replace("DAMPING", damping), 1);
        let energy = results.table("energy.csv");
        let (total, heat) = (energy.numbers("total"), energy.numbers("damping_dissipated"));
        assert!(heat[0] == 0.0 && heat.windows(2).all(|pair| pair[1] > pair[0]), "{damping}: {heat:?}");
        assert!(heat[heat.len() - 1] > 1e-4 * total[0], "{damping}: {heat:?}");
        let left = energy.numbers("numerical").iter().fold(0.0, |most: f64, left| most.max(left.abs()));
        assert!(left < 1e-9 * total[0], "{damping}: {left} of {}", total[0]);
        let momentum = results.table("momentum.csv").numbers("linear_x");
        let rate: f64 = if damping.contains("mass") { 30.0 * 5.0e-4 / 2.0 } else { 0.0 };
        for (step, found) in momentum.iter().enumerate() {
            let expected = momentum[0] * ((1.0 - rate) / (1.0 + rate)).powi(step as i32);
            assert!((found / expected - 1.0).abs() < 1e-9, "{damping}, step {step}: {found}, {expected}");
        }
    }
}

/// A damped block falls on a damped one.
const IMPACT: &str = "
dimension: 2
bodies:
  upper:
    mesh: { box: { min: [0.02, 0.1], max: [0.12, 0.2], cells: [4, 4], element: quad4 } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    density: 1000
    damping: { rayleigh: { mass: 5, stiffness: 2.0e-4 } }
    initial_velocity: [0.5, -2]
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
boundary: { floor: { on: lower.bottom, displacement: { x: 0, y: 0 } } }
time: { end: 0.01, step: 2.0e-4, scheme: { generalized_alpha: { spectral_radius: 0.8 } } }
solver: { newton: { tolerance: 1.0e-10 } }
output: { fields: { every: 100000 }, probes: { corner: { at: [0.02, 0.1] } } }
";

/// Results with contact are equal on 1 to 4 ranks, and damping is not without effect.
#[test]
fn ranks_agree() {
    let one = Results::of(IMPACT, 1);
    let motion = one.table("probes.csv").numbers("corner.u_x");
    let heat = one.table("energy.csv").numbers("damping_dissipated");
    let total = one.table("energy.csv").numbers("total")[0];
    assert!(heat[heat.len() - 1] > 0.01 * total, "{heat:?}");
    for ranks in 2..=4 {
        let several = Results::of(IMPACT, ranks);
        let apart = |of_one: &[f64], table: &str, column: &str, scale: f64| {
            let found = several.table(table).numbers(column);
            assert_eq!(found.len(), of_one.len());
            assert!(found.iter().chain(of_one).all(|value| value.is_finite()));
            let most = found.iter().zip(of_one).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
            assert!(most < 1e-7 * scale, "{ranks} ranks: {column} {most} of {scale}");
        };
        apart(&motion, "probes.csv", "corner.u_x", 5.0e-3);
        apart(&heat, "energy.csv", "damping_dissipated", total);
    }
}

/// A run that ends and is continued computes the same bits as one that does not end.
#[test]
fn a_continued_run_has_the_same_bits() {
    let folder = Folder::new("damping");
    // MUMPS on several ranks rounds differently in each run.
    let whole = IMPACT.replace("output: {", "output: { checkpoint: { every: 20 },");
    let whole = whole.replace("solver: {", "solver: { linear: gmres_asm_ilu,");
    folder.write("case.yml", &whole);
    run(2, &["case.yml", "-q", "-o", "whole"], &folder).success();
    let start = "--restart=whole/checkpoints/step-000040.ckpt";
    run(2, &["case.yml", "-q", "-o", "branch", start], &folder).success();
    for table in ["energy.csv", "probes.csv"] {
        let rows = |of: &str| -> Vec<String> {
            let text = std::fs::read_to_string(folder.join(of).join(table)).expect("a table");
            text.lines().map(str::to_owned).collect()
        };
        let (whole, branch) = (rows("whole"), rows("branch"));
        assert_eq!(branch.len(), 11);
        assert_eq!(branch[1..], whole[whole.len() - 10..], "{table}");
    }
}

/// The static equilibrium before the steps has no damping, although its supports move.
#[test]
fn the_static_start_is_not_damped() {
    let text = |damping: &str| {
        OSCILLATOR
            .replace("    damping: { rayleigh: DAMPING }\n", damping)
            .replace("    initial_velocity: ['1.0e-3 * x', 0]\n", "")
            .replace("displacement: { x: 0 }", "displacement: { x: '1.0e-3 + 0.5 * t' }")
            .replace("boundary:", "boundary:\n  stop: { on: bar.right, displacement: { x: 0 } }")
            .replace("time:", "start: { equilibrium: {} }\ntime:")
            .replace("SCHEME", "midpoint")
            .replace("STEP", "1.0e-3")
    };
    let strain = |damping: &str| Results::of(&text(damping), 1).table("energy.csv").numbers("strain")[0];
    let undamped = strain("");
    assert!(undamped > 0.0);
    assert_eq!(strain("    damping: { rayleigh: { mass: 100, stiffness: 0.1 } }\n"), undamped);
}

/// Invalid damping is refused with its place and a reason.
#[test]
fn invalid_damping_is_refused() {
    let folder = Folder::new("damping");
    let by = |damping: &str, scheme: &str| {
        let case = OSCILLATOR.replace("DAMPING", damping).replace("SCHEME", scheme).replace("STEP", "1.0e-3");
        folder.write("case.yml", &case);
        let output = run(0, &["check", "case.yml"], &folder);
        assert_eq!(output.code, Some(3), "{}", output.text());
        output.text()
    };
    assert_says(&by("{ mass: -1 }", "midpoint"), &["case.yml:9:", "factor of the mass"]);
    assert_says(&by("{ stiffness: '-1 s' }", "midpoint"), &["case.yml:9:", "factor of the stiffness"]);
    assert_says(&by("{}", "midpoint"), &["case.yml:9:", "zero"]);
    assert_says(&by("{ stiffness: '1 m' }", "midpoint"), &["case.yml:9:", "1 m"]);
    assert_says(&by("{ mass: 1, speed: 2 }", "midpoint"), &["case.yml:9:", "speed"]);
    let fixed = by("{ mass: 1 }", "{ static: { increments: 2 } }");
    assert_says(&fixed, &["case.yml:9:", "damping", "static"]);
}
