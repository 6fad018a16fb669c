//! Viscoelasticity in complete runs, against closed forms: relaxation, ramps, creep and harmonic shear at
//! small strain, rubber at large strain, oscillators in every scheme, the energy ledger, the limits of
//! fast and slow relaxation, and equal results on any number of ranks and after a restart.

mod common;

use std::f64::consts::TAU;
use std::fs;

use common::{Folder, Results, assert_says, run};

/// Shear modulus of the law [Pa].
const MU: f64 = 1.0e6;
/// Shares of the instantaneous modulus, and relaxation times [s].
const TERMS: [(f64, f64); 2] = [(0.3, 0.1), (0.2, 2.0)];
/// Sum of the shares.
const RELAXING: f64 = 0.5;

/// A unit cell that is sheared along x: every motion is a uniform shear.
const SHEAR: &str = "
dimension: 2
bodies:
  cell:
    mesh: { box: { min: [0, 0], max: [1, 1], cells: [1, 1], element: ELEMENT } }
    material: { saint_venant_kirchhoff: { young_modulus: YOUNG, poisson_ratio: 0.49 } }
    viscoelasticity: { moduli: MODULI, prony: [{ share: 0.3, time: 0.1 }, { share: 0.2, time: 2 s }] }
    kinematics: linear
    locking: LOCKING
boundary:
  floor: { on: cell.bottom, FLOOR }
  skin: { on: [cell.left, cell.right, cell.top], SKIN }
time: { end: END, step: STEP, scheme: { static: {} } }
solver: { newton: { tolerance: 1.0e-13 } }
output: { fields: { every: 100000 }, probes: { lid: { at: [0, 1] } } }
";

/// The case with a motion of the surface above the floor.
fn shear(skin: &str, end: &str, step: &str) -> String {
    SHEAR
        .replace("YOUNG", &format!("{:e}", 2.0 * 1.49 * MU))
        .replace("SKIN", skin)
        .replace("FLOOR", if skin.contains("x:") { skin } else { "displacement: { x: 0, y: 0 }" })
        .replace("END", end)
        .replace("STEP", step)
}

fn shear_case(skin: &str, end: &str, step: &str) -> String {
    let text = shear(skin, end, step);
    text.replace("ELEMENT", "quad4").replace("MODULI", "long_term").replace("LOCKING", "auto")
}

/// Branches relative to the law, if its moduli are long-term ones.
fn branches() -> [(f64, f64); 2] {
    TERMS.map(|(share, time)| (share / (1.0 - RELAXING), time))
}

/// Times and shear stresses of a run.
fn stresses(results: &Results) -> (Vec<f64>, Vec<f64>) {
    let floor = results.table("reactions.csv").only("boundary", "floor");
    (floor.numbers("time"), floor.numbers("force_x").into_iter().map(|force| -force).collect())
}

fn close(what: &str, value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{what}: {value}, expected {expected}");
}

/// A strain that grows at a constant rate and is then held: the stress is that of the series at every
/// step, for steps of any length, in every element and treatment of locking, and in both conventions.
#[test]
fn a_ramp_and_its_relaxation_follow_the_series() {
    let strain = 0.01;
    let skin = "displacement: { x: '0.01 * y * min(t / 0.25, 1)', y: 0 }";
    for (element, moduli, locking) in [
        ("quad4", "long_term", "none"),
        ("quad4", "instantaneous", "selective_reduced"),
        ("quad8", "long_term", "selective_reduced"),
        ("quad9", "long_term", "mean_dilatation"),
        ("quad9", "instantaneous", "none"),
        ("tri3", "instantaneous", "none"),
        ("tri6", "long_term", "none"),
    ] {
        let text = shear(skin, "3", "0.125").replace("ELEMENT", element);
        let text = text.replace("MODULI", moduli).replace("LOCKING", locking);
        let (times, stresses) = stresses(&Results::of(&text, 1));
        let given = if moduli == "long_term" { 1.0 - RELAXING } else { 1.0 };
        for (time, stress) in times.iter().zip(stresses) {
            let (ramp, held) = (time.min(0.25), (time - 0.25).max(0.0));
            let of_branch = |(share, tau): (f64, f64)| {
                share * tau / 0.25 * (1.0 - (-ramp / tau).exp()) * (-held / tau).exp()
            };
            let branches: f64 = TERMS.into_iter().map(of_branch).sum();
            let expected = MU / given * strain * ((1.0 - RELAXING) * ramp / 0.25 + branches);
            close(&format!("{element} {moduli} at {time}"), stress, expected, 1e-10 * MU * strain);
        }
    }
}

/// The same in space, with hexahedra and tetrahedra.
#[test]
fn a_ramp_and_its_relaxation_follow_the_series_in_space() {
    for element in ["hex8", "hex20", "tet4", "tet10"] {
        let skin = "displacement: { x: '0.01 * z * min(t / 0.25, 1)', y: 0, z: 0 }";
        let text = shear_case(skin, "1", "0.25")
            .replace("dimension: 2", "dimension: 3")
            .replace("[0, 0]", "[0, 0, 0]")
            .replace("[1, 1]", "[1, 1, 1]")
            .replace("[0, 1]", "[0, 0, 1]")
            .replace("[cell.left, cell.right,", "[cell.left, cell.right, cell.front, cell.back,")
            .replace("element: quad4", &format!("element: {element}"));
        let (times, stresses) = stresses(&Results::of(&text, 1));
        let (time, stress) = (times[4], stresses[4]);
        let of_branch = |(weight, tau): (f64, f64)| {
            weight * tau / 0.25 * (1.0 - (-0.25 / tau).exp()) * (-(time - 0.25) / tau).exp()
        };
        let branches: f64 = branches().into_iter().map(of_branch).sum();
        close(element, stress, MU * 0.01 * (1.0 + branches), 1e-10 * MU * 0.01);
    }
}

/// Under a stress that grows at a constant rate a body with one branch creeps like a standard linear
/// solid, with order two.
#[test]
fn creep_converges_with_order_two() {
    let error = |step: &str| {
        let text = shear_case("displacement: { y: 0 }", "1", step)
            .replace(
                "prony: [{ share: 0.3, time: 0.1 }, { share: 0.2, time: 2 s }]",
                "prony: [{ share: 0.6, time: 0.1 }]",
            )
            .replace("boundary:", "boundary:\n  pull: { on: cell.top, traction: { x: '1e3 * t' } }");
        let probes = Results::of(&text, 1).table("probes.csv");
        let (slow, sudden) = (1.0 / MU, 0.4 / MU);
        let tau = 0.1 / 0.4;
        let exact = |t: f64| 1e3 * (t * slow - (slow - sudden) * tau * (1.0 - (-t / tau).exp()));
        let rows = probes.numbers("time").into_iter().zip(probes.numbers("lid.u_x"));
        rows.map(|(t, u)| (u - exact(t)).abs()).fold(0.0, f64::max) / exact(1.0)
    };
    let errors = ["0.1", "0.05", "0.025"].map(error);
    let order = (errors[1] / errors[2]).log2();
    assert!(errors[2] < 1e-3 && order > 1.9, "{errors:?}, order {order}");
}

/// Storage and loss modulus of a harmonic shear, after its start has relaxed, converge to the closed
/// form with order two.
#[test]
fn storage_and_loss_modulus_converge_with_order_two() {
    let frequency = TAU;
    let moduli = |count: usize| {
        let text = shear_case(
            "displacement: { x: '1e-3 * y * sin(6.283185307179586 * t)', y: 0 }",
            "3",
            &format!("{:e}", 1.0 / count as f64),
        )
        .replace("{ share: 0.2, time: 2 s }", "{ share: 0.2, time: 0.05 }");
        let (times, stresses) = stresses(&Results::of(&text, 1));
        let last = times.len() - count;
        let project = |wave: fn(f64) -> f64| {
            let rows = times[last..].iter().zip(&stresses[last..]);
            2.0 / count as f64 * rows.map(|(t, s)| s * wave(frequency * t)).sum::<f64>() / 1e-3
        };
        [project(f64::sin), project(f64::cos)]
    };
    let mut exact = [MU, 0.0];
    for (weight, tau) in [(0.6, 0.1), (0.4, 0.05)] {
        let x = frequency * tau;
        exact[0] += MU * weight * x * x / (1.0 + x * x);
        exact[1] += MU * weight * x / (1.0 + x * x);
    }
    let error = |count| {
        let found = moduli(count);
        (found[0] - exact[0]).hypot(found[1] - exact[1]) / exact[0].hypot(exact[1])
    };
    let errors = [16, 32, 64].map(error);
    let order = (errors[1] / errors[2]).log2();
    assert!(errors[2] < 2e-3 && (order - 2.0).abs() < 0.1, "{errors:?}, order {order}");
}

/// A cube of rubber that is stretched to twice its length and held, with free sides.
const STRETCH: &str = "
dimension: 3
bodies:
  cube:
    mesh: { box: { min: [0, 0, 0], max: [1, 1, 1], cells: [1, 1, 1], element: hex8 } }
    material: { LAW }
    viscoelasticity: { moduli: instantaneous, prony: [{ share: 0.3, time: 0.1 }, { share: 0.2, time: 2 }] }
boundary:
  left: { on: cube.left, displacement: { x: 0 } }
  front: { on: cube.front, displacement: { y: 0 } }
  bottom: { on: cube.bottom, displacement: { z: 0 } }
  pull: { on: cube.right, displacement: { x: 'min(t / 0.01, 1)' } }
time: { end: 1, step: 0.05, scheme: { static: {} } }
solver: { newton: { tolerance: 1.0e-12 } }
output: { fields: { every: 100000 } }
";

/// The force of rubber that was stretched in one step relaxes by the same series at a stretch of two as
/// at small strain. The bulk modulus is 10^5 times the shear modulus.
#[test]
fn stretched_rubber_relaxes_by_the_series() {
    let laws: [(&str, f64); 2] = [
        // Nominal stress of the incompressible law at a stretch of two.
        ("mooney_rivlin: { c10: 4e5, c01: 1e5, bulk_modulus: 1e11 }", 2.0 * (2.0 - 0.25) * (4e5 + 0.5e5)),
        ("yeoh: { c1: 5e5, c2: -2e4, c3: 2e3, bulk_modulus: 1e11 }", {
            let x = 5.0 - 3.0;
            2.0 * (2.0 - 0.25) * (5e5 - 4e4 * x + 6e3 * x * x)
        }),
    ];
    for (law, sudden) in laws {
        let text = STRETCH.replace("LAW", law);
        let pull = Results::of(&text, 1).table("reactions.csv").only("boundary", "pull");
        // Within the first step, the stress is taken as linear in time.
        let first = 0.05;
        for (time, force) in pull.numbers("time").into_iter().zip(pull.numbers("force_x")).skip(1) {
            let of_branch = |(share, tau): (f64, f64)| {
                share * tau / first * (1.0 - (-first / tau).exp()) * (-(time - first) / tau).exp()
            };
            let part = 1.0 - RELAXING + TERMS.into_iter().map(of_branch).sum::<f64>();
            close(&format!("{law} at {time}"), force, part * sudden, 3e-5 * sudden);
        }
    }
}

/// Relaxation times far below the step give the long-term law, and far above the duration the
/// instantaneous one. The block is pressed onto a curved obstacle at large strain.
#[test]
fn fast_and_slow_relaxation_are_elastic() {
    const PRESS: &str = "
dimension: 2
bodies:
  pad:
    mesh: { box: { min: [-1, 0], max: [1, 1], cells: [8, 4], element: quad4 } }
    material: { mooney_rivlin: { c10: C10, c01: C01, bulk_modulus: 3e6 } }
    VISCOUS
obstacles: { roller: { sphere: { center: [0, -1], radius: 1 } } }
contact:
  sole: { contactor: pad.bottom, target: roller, normal: { penalty: { compliance: 1.0e-9 } } }
boundary: { top: { on: pad.top, displacement: { x: 0, y: '-0.2 * t' } } }
time: { end: 1, step: 0.25, scheme: { static: {} } }
solver: { newton: { tolerance: 1.0e-11 } }
output: { fields: { every: 100000 } }
";
    let force = |factor: f64, viscous: &str| {
        let text = PRESS
            .replace("C10", &format!("{:e}", 4e5 * factor))
            .replace("C01", &format!("{:e}", 1e5 * factor))
            .replace("VISCOUS", viscous);
        Results::of(&text, 1).table("reactions.csv").last("force_y").abs()
    };
    let viscous = |moduli: &str, time: &str| {
        force(
            1.0,
            &format!("viscoelasticity: {{ moduli: {moduli}, prony: [{{ share: 0.5, time: {time} }}] }}"),
        )
    };
    let [half, whole, double] = [0.5, 1.0, 2.0].map(|factor| force(factor, ""));
    assert!(double > 1.2 * whole && whole > 1.2 * half);
    for (found, expected) in [
        (viscous("long_term", "1e-12"), whole),
        (viscous("long_term", "1e12"), double),
        (viscous("instantaneous", "1e-12"), half),
        (viscous("instantaneous", "1e12"), whole),
    ] {
        close("force", found, expected, 1e-9 * expected);
    }
}

/// A bar of one element that can only extend along x, on a branch: three unknowns with a closed form.
const OSCILLATOR: &str = "
dimension: 2
bodies:
  bar:
    mesh: { box: { min: [0, 0], max: [1, 1], cells: [1, 1], element: quad4 } }
    material: { saint_venant_kirchhoff: { young_modulus: 3.0e4, poisson_ratio: 0 } }
    viscoelasticity: { moduli: instantaneous, prony: [{ share: 0.6, time: 0.01 }] }
    density: 9
    kinematics: linear
    initial_velocity: ['1.0e-3 * x', 0]
boundary:
  wall: { on: bar.left, displacement: { x: 0 } }
  floor: { on: bar.bottom, displacement: { y: 0 } }
  lid: { on: bar.top, displacement: { y: 0 } }
time: { end: 0.1, step: STEP, scheme: SCHEME }
solver: { newton: { tolerance: 1.0e-12 } }
output: { fields: { every: 100000 }, probes: { tip: { at: [1, 0] } } }
";

/// Displacement of the oscillator at these times, by many small steps of the classical Runge-Kutta method.
fn oscillation(times: &[f64]) -> Vec<f64> {
    // M = rho / 3, stiffness K + 4/3 G of which the branch has 0.6 * 4/3 G, G = E/2, K = E/3.
    let mass = 3.0;
    let whole = 3.0e4;
    let branch = 0.6 * 4.0 / 3.0 * 1.5e4;
    let rates = |[u, v, h]: [f64; 3]| [v, -((whole - branch) * u + h) / mass, branch * v - h / 0.01];
    let (mut t, mut state) = (0.0, [0.0, 1.0e-3, 0.0]);
    let mut out = Vec::new();
    for &time in times {
        let count = 400;
        let dt = (time - t) / f64::from(count);
        for _ in 0..count {
            let moved = |k: [f64; 3], by: f64| [0, 1, 2].map(|i| state[i] + by * dt * k[i]);
            let a = rates(state);
            let b = rates(moved(a, 0.5));
            let c = rates(moved(b, 0.5));
            let d = rates(moved(c, 1.0));
            state = [0, 1, 2].map(|i| state[i] + dt / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]));
        }
        t = time;
        out.push(state[0]);
    }
    out
}

/// A mass on a viscoelastic bar converges with the order of the scheme, and the ledger closes with that
/// order.
#[test]
fn an_oscillator_converges_in_every_scheme() {
    for (scheme, expected) in [
        ("{ newmark: { beta: 0.25, gamma: 0.5 } }", 2.0),
        ("{ generalized_alpha: { spectral_radius: 0.8 } }", 2.0),
        ("{ hht: { spectral_radius: 0.8 } }", 2.0),
        ("midpoint", 2.0),
        ("backward_euler", 1.0),
    ] {
        let errors = ["1.0e-3", "5.0e-4", "2.5e-4"].map(|step| {
            let results = Results::of(&OSCILLATOR.replace("SCHEME", scheme).replace("STEP", step), 1);
            let probes = results.table("probes.csv");
            let exact = oscillation(&probes.numbers("time"));
            let rows = probes.numbers("tip.u_x").into_iter().zip(exact);
            let error = rows.map(|(u, exact)| (u - exact).abs()).fold(0.0, f64::max) / 1.0e-5;
            let energy = results.table("energy.csv");
            let heat = energy.numbers("viscous_dissipated");
            assert!(heat.windows(2).all(|pair| pair[1] > pair[0]), "{scheme}: {heat:?}");
            let total = energy.numbers("total");
            // Backward Euler takes energy, too.
            let least = if expected > 1.0 { 0.8 } else { 0.4 };
            assert!(heat[heat.len() - 1] > least * total[0], "{scheme}: {heat:?}");
            [error, energy.numbers("numerical").iter().fold(0.0, |m: f64, x| m.max(x.abs())) / total[0]]
        });
        for (what, k) in [("motion", 0), ("ledger", 1)] {
            let [first, second] = [errors[1][k], errors[2][k]];
            let order = (first / second).log2();
            // Newmark's average acceleration closes the linear ledger to rounding.
            let closes = k == 1 && second < 1e-10;
            assert!(closes || order > expected - 0.15, "{scheme}, {what}: {errors:?}, order {order}");
        }
    }
}

/// In statics the work is the energy of law and branches and their heat, to rounding at small strain.
/// When a strain has relaxed, the branches hold nothing, and all that they took is heat.
#[test]
fn the_ledger_closes() {
    let skin = "displacement: { x: '0.01 * y * min(t / 0.25, 1)', y: 0 }";
    let work = |step: &str| {
        let results = Results::of(&shear_case(skin, "40", step), 1);
        let energy = results.table("energy.csv");
        let column = |name: &str| energy.numbers(name);
        let [stored, heat, numerical] = ["viscous_stored", "viscous_dissipated", "numerical"].map(column);
        let most = column("external_work").iter().fold(0.0, |m: f64, x| m.max(*x));
        assert!(numerical.iter().all(|left| left.abs() < 1e-12 * most), "{numerical:?}");
        assert!(
            stored.iter().all(|stored| *stored >= 0.0)
                && heat.windows(2).all(|h| h[1] >= h[0] - 1e-12 * most)
        );
        assert!(stored[stored.len() - 1] < 1e-12 * most);
        close("strain energy", energy.last("strain"), 0.5 * MU * 1e-4, 1e-10 * MU * 1e-4);
        heat[heat.len() - 1]
    };
    // Work of a branch during the ramp.
    let of_branch = |(weight, tau): (f64, f64)| {
        weight * MU * 1e-4 * tau / 0.0625 * (0.25 - tau * (1.0 - (-0.25 / tau).exp()))
    };
    let exact: f64 = branches().into_iter().map(of_branch).sum();
    let errors = ["0.0625", "0.03125"].map(|step| (work(step) - exact).abs() / exact);
    let order = (errors[0] / errors[1]).log2();
    assert!(errors[1] < 3e-3 && (order - 2.0).abs() < 0.1, "{errors:?}, order {order}");
}

/// A block of viscous rubber is sheared by a large angle and released: the ledger closes with order two
/// at large strain.
#[test]
fn the_ledger_of_large_strains_has_order_two() {
    const SWING: &str = "
dimension: 3
bodies:
  block:
    mesh: { box: { min: [0, 0, 0], max: [0.1, 0.1, 0.2], cells: [1, 1, 2], element: hex8 } }
    material: { yeoh: { c1: 2e5, c2: -1e4, c3: 1e3, poisson_ratio: 0.4 } }
    viscoelasticity: { prony: [{ share: 0.4, time: 5 ms }] }
    density: 1000
    initial_velocity: ['40 * z', 0, '5 * z']
boundary: { floor: { on: block.bottom, displacement: { x: 0, y: 0, z: 0 } } }
time: { end: 0.02, step: STEP, scheme: midpoint }
solver: { newton: { tolerance: 1.0e-11 } }
output: { fields: { every: 100000 }, probes: { top: { at: [0, 0, 0.2] } } }
";
    let left = |step: &str| {
        let results = Results::of(&SWING.replace("STEP", step), 1);
        let energy = results.table("energy.csv");
        let total = energy.numbers("total");
        let motion = results.table("probes.csv").numbers("top.u_x");
        assert!(motion.iter().any(|u| u.abs() > 0.04), "the strain is not large: {motion:?}");
        assert!(energy.last("viscous_dissipated") > 0.2 * total[0]);
        energy.numbers("numerical").iter().fold(0.0, |m: f64, x| m.max(x.abs())) / total[0]
    };
    let left = ["2.0e-4", "1.0e-4", "5.0e-5"].map(left);
    let order = (left[1] / left[2]).log2();
    assert!(left[2] < 1e-3 && order > 1.9, "{left:?}, order {order}");
}

/// Steps that are repeated or cut leave no trace in the history: with a controlled error in time the
/// motion is that of the closed form.
#[test]
fn repeated_steps_do_not_advance_the_history() {
    let text = OSCILLATOR
        .replace("SCHEME", "{ generalized_alpha: { spectral_radius: 0.8 } }")
        .replace("STEP", "2.0e-2")
        .replace(
            "\ntime:",
            "\naccuracy: { time: 1.0e-4, penetration: none, slip: none, energy: none }\ntime:",
        );
    let folder = Folder::new("viscous");
    folder.write("case.yml", &text);
    let output = run(1, &["case.yml", "-o", "out"], &folder).success();
    assert!(output.text().contains("is repeated with"), "{}", output.text());
    let probes = common::Table::read(&folder.join("out/probes.csv"));
    let exact = oscillation(&probes.numbers("time"));
    let rows = probes.numbers("tip.u_x").into_iter().zip(exact);
    let error = rows.map(|(u, exact)| (u - exact).abs()).fold(0.0, f64::max) / 1.0e-5;
    assert!(error < 3e-3, "{error}");
}

/// A static start is in equilibrium with the long-term law, and nothing relaxes afterwards.
#[test]
fn the_static_start_is_relaxed() {
    const HANGING: &str = "
dimension: 2
bodies:
  block:
    mesh: { box: { min: [0, 0], max: [1, 1], cells: [2, 2], element: quad4 } }
    material: { neo_hookean: { young_modulus: YOUNG, poisson_ratio: 0.3 } }
    VISCOUS
    density: 1000
boundary:
  hook: { on: block.top, displacement: { x: 0, y: 0 } }
  weight: { on: block, gravity: [0, -9.81] }
start: { equilibrium: {} }
time: { end: 0.1, step: 0.01, scheme: midpoint }
solver: { newton: { tolerance: 1.0e-12 } }
output: { fields: { every: 100000 }, probes: { foot: { at: [0, 0] } } }
";
    let foot = |viscous: &str| {
        let text = HANGING.replace("YOUNG", "1e5").replace("VISCOUS", viscous);
        Results::of(&text, 1).table("probes.csv").numbers("foot.u_y")
    };
    let elastic = foot("");
    let viscous = foot("viscoelasticity: { prony: [{ share: 0.5, time: 0.02 }] }");
    assert!(elastic[0] < -0.01);
    for (found, expected) in viscous.iter().zip(&elastic) {
        close("foot", *found, *expected, 1e-10);
    }
    let softer = foot("viscoelasticity: { moduli: instantaneous, prony: [{ share: 0.5, time: 0.02 }] }");
    assert!(softer[0] < 1.3 * elastic[0]);
    close("foot at the end", softer[softer.len() - 1], softer[0], 1e-10);
}

/// A viscoelastic block falls on another one of a different series and of two kinds of elements.
const IMPACT: &str = "
dimension: 2
bodies:
  upper:
    mesh: { box: { min: [0.02, 0.1], max: [0.12, 0.2], cells: [4, 4], element: quad4 } }
    material: { neo_hookean: { young_modulus: 1.0e6, poisson_ratio: 0.3 } }
    viscoelasticity: { prony: [{ share: 0.4, time: 2 ms }] }
    density: 1000
    initial_velocity: [0.5, -2]
  base:
    mesh: { box: { min: [0, -0.05], max: [0.2, 0], cells: [7, 2], element: quad4 } }
    material: { neo_hookean: { young_modulus: 1.0e7, poisson_ratio: 0.3 } }
    density: 1000
  lower:
    mesh: { box: { min: [0, 0], max: [0.2, 0.1], cells: [7, 4], element: tri6 } }
    material: { yeoh: { c1: 3e5, c2: -1e4, c3: 1e3, poisson_ratio: 0.3 } }
    viscoelasticity: { moduli: instantaneous, prony: [{ share: 0.2, time: 1 ms }, { share: 0.2, time: 20 ms }] }
    density: 1000
contact:
  between:
    contactor: upper.bottom
    target: lower.top
    normal: { penalty: { compliance: 1.0e-9 } }
    friction: { coulomb: { coefficient: 0.3, regularization: { stick_velocity: 1.0e-2 } } }
boundary:
  floor: { on: lower.bottom, displacement: { x: 0, y: 0 } }
  ground: { on: base.bottom, displacement: { x: 0, y: 0 } }
time: { end: 0.008, step: 2.0e-4, scheme: { generalized_alpha: { spectral_radius: 0.8 } } }
solver: { newton: { tolerance: 1.0e-10 } }
output: { fields: { every: 10 }, probes: { corner: { at: [0.02, 0.1], on: upper } } }
";

/// Results with contact are equal on 1 to 4 ranks.
#[test]
fn ranks_agree() {
    let one = Results::of(IMPACT, 1);
    let motion = one.table("probes.csv").numbers("corner.u_x");
    let heat = one.table("energy.csv").numbers("viscous_dissipated");
    let total = one.table("energy.csv").numbers("total")[0];
    assert!(heat[heat.len() - 1] > 0.05 * total, "{heat:?}");
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
        apart(&heat, "energy.csv", "viscous_dissipated", total);
    }
}

/// Rows of a table of a results folder.
fn rows(folder: &Folder, of: &str, table: &str) -> Vec<String> {
    let text = fs::read_to_string(folder.join(of).join(table)).expect("a table");
    text.lines().map(str::to_owned).collect()
}

/// A run that is continued computes the same bits as one that does not end, also with a matrix that is
/// kept over many steps. On another number of ranks it computes the same numbers.
#[test]
fn a_continued_run_has_the_same_bits() {
    let folder = Folder::new("viscous");
    for (name, linear, own) in [("gmres", "gmres_asm_ilu", 2), ("amg", "filtered_amg", 1)] {
        let whole = IMPACT.replace("output: {", "output: { checkpoint: { every: 15 },");
        folder.write("case.yml", &whole.replace("solver: {", &format!("solver: {{ linear: {linear},")));
        let results = format!("{name}-whole");
        run(own, &["case.yml", "-q", "-o", &results], &folder).success();
        let checkpoint = format!("{results}/checkpoints/step-000030.ckpt");
        let bytes = fs::read(folder.join(&checkpoint)).expect("a checkpoint");
        let holds = |name: &str| bytes.windows(name.len()).any(|part| part == name.as_bytes());
        assert!(holds("branches of lower") && holds("branch 2_zz") && !holds("branches of base"));
        assert!(holds("matrix 0 viscous_xy"), "{linear} keeps no matrix");
        let start = format!("--restart={checkpoint}");
        for (ranks, branch) in [(own, "same"), (3 - own, "other"), (3, "three")] {
            let branch = format!("{name}-{branch}");
            run(ranks, &["case.yml", "-q", "-o", &branch, &start], &folder).success();
            for table in ["energy.csv", "probes.csv"] {
                let (whole, branch) = (rows(&folder, &results, table), rows(&folder, &branch, table));
                assert_eq!(branch.len(), 11);
                for (a, b) in branch[1..].iter().zip(&whole[whole.len() - 10..]) {
                    if ranks == own {
                        assert_eq!(a, b, "{name} {table}");
                        continue;
                    }
                    let numbers = |row: &str| -> Vec<f64> {
                        row.split(',').take(6).map(|cell| cell.parse().expect("a number")).collect()
                    };
                    for (a, b) in numbers(a).into_iter().zip(numbers(b)) {
                        assert!(
                            (a - b).abs() <= 1e-7 * (a.abs() + b.abs()) + 1e-9,
                            "{name} {table}: {a} {b}"
                        );
                    }
                }
            }
        }
    }
}

/// Invalid viscoelasticity is refused with its place and a reason.
#[test]
fn invalid_viscoelasticity_is_refused() {
    let folder = Folder::new("viscous");
    let by = |viscous: &str, scheme: &str| {
        let case = OSCILLATOR
            .replace("{ moduli: instantaneous, prony: [{ share: 0.6, time: 0.01 }] }", viscous)
            .replace("SCHEME", scheme)
            .replace("STEP", "1.0e-3");
        folder.write("case.yml", &case);
        let output = run(0, &["check", "case.yml"], &folder);
        assert_eq!(output.code, Some(3), "{}", output.text());
        output.text()
    };
    let good = "{ prony: [{ share: 0.6, time: 0.01 }] }";
    assert_says(&by("{ prony: [] }", "midpoint"), &["case.yml:7:", "at least one term"]);
    assert_says(&by("{ prony: [{ share: 0, time: 1 }] }", "midpoint"), &["case.yml:7:", "share", "> 0"]);
    assert_says(
        &by("{ prony: [{ share: 0.1, time: -1 }] }", "midpoint"),
        &["case.yml:7:", "relaxation time"],
    );
    assert_says(
        &by("{ prony: [{ share: 0.6, time: 1 }, { share: 0.4, time: 2 }] }", "midpoint"),
        &["case.yml:7:", "less than 1", "instantaneous"],
    );
    assert_says(&by("{ prony: [{ share: 0.1, time: '1 m' }] }", "midpoint"), &["case.yml:7:", "1 m"]);
    assert_says(&by("{ moduli: fast, prony: [] }", "midpoint"), &["case.yml:7:", "fast", "long_term"]);
    assert_says(&by(good, "conserving"), &["case.yml:7:", "conserving", "generalized_alpha"]);
}
