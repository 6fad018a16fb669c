//! Properties of every friction law: it opposes the slip, respects the bound and dissipates energy.

use num_dual::{Dual64, DualNum};

use super::Bound;
use super::regularization::{REGULARIZATIONS, Regularization};
use super::traction::{Branch, FrictionTraction, Slip, rotate};
use crate::reader::quantity::Quantity;
use crate::taylor::{scatter, taylor_rate};
use crate::tensor::Vector;

fn bound(value: f64) -> Bound {
    Bound { value, by_gap: 0.0, by_speed: 0.0 }
}

fn vector<const D: usize>(seed: u32, size: f64) -> Vector<D> {
    Vector::from_column_slice(&scatter(D, seed)) * size
}

/// Traction for a velocity and an increment, given the old traction and the old normal.
fn traction<const D: usize>(
    law: &Regularization,
    b: f64,
    (normal, old_normal): (&Vector<D>, &Vector<D>),
    (velocity, increment): (&Vector<D>, &Vector<D>),
    old_traction: &Vector<D>,
) -> FrictionTraction<D> {
    let slip = Slip { normal, velocity, increment, old_traction, old_normal };
    law.traction(&bound(b), &slip, Branch::Actual)
}

fn respects_the_cone<const D: usize>() {
    let law = Regularization::stick_stiffness(1e9);
    let (mut old, mut old_normal) = (Vector::<D>::zeros(), vector::<D>(1, 1.0).normalize());
    let mut slips = 0;
    for step in 2..400 {
        let normal = (old_normal + vector::<D>(step, 0.3)).normalize();
        let b = 1e5 * (1.0 + scatter(1, step)[0]);
        let d = vector::<D>(step + 1000, 1e-4);
        let answer = traction(&law, b, (&normal, &old_normal), (&d, &d), &old);
        assert!(answer.traction.norm() <= b * (1.0 + 1e-14), "outside of the cone");
        assert!(answer.traction.dot(&normal).abs() <= 1e-11 * 1e5, "not tangential");
        assert!(answer.plastic_work >= 0.0);
        slips += usize::from(answer.slips);
        (old, old_normal) = (answer.traction, normal);
    }
    assert!(slips > 50 && slips < 390, "both branches are met: {slips}");
}

/// The return map never leaves the friction cone, for any slip, normal and bound.
#[test]
fn return_map_stays_in_the_cone() {
    respects_the_cone::<2>();
    respects_the_cone::<3>();
}

/// A point that slid starts the next step on the slip branch, regardless of rounding in its
/// traction. A point at rest without traction sticks.
#[test]
fn rounding_does_not_choose_the_branch() {
    let normal = Vector::<3>::new(0.0, 0.0, 1.0);
    let law = Regularization::stick_stiffness(5e9);
    let still = Vector::<3>::zeros();
    for k in 0..200 {
        let old = Vector::<3>::new((0.1 * f64::from(k)).cos(), (0.1 * f64::from(k)).sin(), 0.0) * 0.3;
        let slip = Slip {
            normal: &normal,
            velocity: &still,
            increment: &still,
            old_traction: &old,
            old_normal: &normal,
        };
        let response = law.traction(&bound(0.3), &slip, Branch::Actual);
        assert!(response.slips && response.plastic_work >= 0.0 && (response.traction - old).norm() < 1e-15);
        let below = law.traction(&bound(0.3 * (1.0 + 1e-9)), &slip, Branch::Actual);
        assert!(!below.slips);
    }
    let nothing = Slip {
        normal: &normal,
        velocity: &still,
        increment: &still,
        old_traction: &still,
        old_normal: &normal,
    };
    let response = law.traction(&bound(0.0), &nothing, Branch::Actual);
    assert!(!response.slips && response.by_increment.iter().all(|c| c.is_finite()));
}

/// Cyclic sliding by +-a dissipates 4 b (a - b / k_T) as heat. All work is either heat or
/// recoverable energy.
#[test]
fn cycling_dissipates_the_hysteresis_loop() {
    let (stiffness, b, amplitude) = (1e9, 1e5, 5e-4);
    let law = Regularization::stick_stiffness(stiffness);
    let normal = Vector::<3>::new(0.0, 0.0, 1.0);
    let direction = Vector::<3>::new(0.6, 0.8, 0.0);
    let mut old = direction * -b;
    let (mut heat, mut work) = (0.0, 0.0);
    for half in [-1.0, 1.0] {
        let d = direction * (half * 2.0 * amplitude / 1000.0);
        for _ in 0..1000 {
            let answer = traction(&law, b, (&normal, &normal), (&d, &d), &old);
            heat += answer.plastic_work;
            work -= 0.5 * (old + answer.traction).dot(&d);
            old = answer.traction;
        }
    }
    assert!((old - direction * -b).norm() < 1e-9 * b, "the cycle is closed");
    let loop_area = 4.0 * b * (amplitude - b / stiffness);
    assert!((heat / loop_area - 1.0).abs() < 1e-10, "{heat} {loop_area}");
    assert!((work / heat - 1.0).abs() < 1e-2);
}

/// In stick the velocity form creeps at eps_v |t_T| / b, and the return map comes to rest.
#[test]
fn velocity_form_creeps_as_the_formula_says() {
    let (eps, b) = (1e-3, 1e5);
    let law = Regularization::stick_velocity(eps);
    let normal = Vector::<2>::new(0.0, 1.0);
    let load = 30f64.to_radians().tan() / 0.8;
    let creep = Vector::<2>::new(eps * load, 0.0);
    let answer = traction(&law, b, (&normal, &normal), (&creep, &creep), &Vector::zeros());
    assert!((answer.traction[0] / (-load * b) - 1.0).abs() < 1e-14 && !answer.slips);
    let held = Regularization::stick_stiffness(1e9);
    let rest = traction(&held, b, (&normal, &normal), (&Vector::zeros(), &Vector::zeros()), &answer.traction);
    assert_eq!(rest.traction, answer.traction, "loaded stick needs no further slip");
}

/// The velocity forms dissipate power at any velocity, and the traction never exceeds the bound.
#[test]
fn velocity_forms_dissipate() {
    let normal = vector::<3>(5, 1.0).normalize();
    for law in REGULARIZATIONS.iter().map(|entry| (entry.of)(entry.sample)).take(2) {
        for seed in 0..50 {
            let w = vector::<3>(seed + 100, 10f64.powi(seed as i32 % 9 - 6));
            let answer = traction(&law, 1e5, (&normal, &normal), (&w, &w), &Vector::zeros());
            assert!(answer.traction.dot(&w) < 0.0, "{law:?}");
            assert!(answer.traction.norm() <= 1e5 * (1.0 + 1e-14), "{law:?}");
            let rate =
                ((answer.by_velocity + answer.by_velocity.transpose()) * 0.5).symmetric_eigenvalues().max();
            assert!(rate <= 1e-9 * answer.by_velocity.norm(), "{law:?}: damping gains energy");
        }
    }
}

/// Rotation keeps the length and ends in the new tangent plane; its derivative has order two.
#[test]
fn rotated_history_keeps_its_length() {
    for seed in 0..20 {
        let (from, to) = (vector::<3>(seed, 1.0).normalize(), vector::<3>(seed + 40, 1.0).normalize());
        let push = vector::<3>(seed + 80, 1e5);
        let old = push - from * from.dot(&push);
        let (turned, by_normal) = rotate(&old, &from, &to);
        assert!((turned.norm() / old.norm() - 1.0).abs() < 1e-9, "{}", from.dot(&to));
        assert!(turned.dot(&to).abs() < 1e-9 * old.norm());
        let f = |n: &[f64]| rotate(&old, &from, &Vector::from_column_slice(n)).0.as_slice().to_vec();
        let df = |_: &[f64], d: &[f64]| (by_normal * Vector::<3>::from_column_slice(d)).as_slice().to_vec();
        let small = vector::<3>(seed + 120, 0.02 * (1.0 + from.dot(&to)));
        assert!(taylor_rate(f, df, to.as_slice(), small.as_slice()) > 1.9);
    }
    let (along, up) = (Vector::<2>::new(3.0, 0.0), Vector::<2>::new(0.0, 1.0));
    assert_eq!(rotate(&along, &up, &up).0, along);
    assert_eq!(rotate(&along, &up, &-up).0, -along, "half a turn in the plane");
    let quarter = rotate(&along, &up, &Vector::<2>::new(1.0, 0.0)).0;
    assert!((quarter - Vector::<2>::new(0.0, -3.0)).norm() < 1e-15, "tangents turn with their normals");
}

/// The laws of theory, section 2.9, implemented independently with dual numbers.
fn oracle(law: &Regularization, b: f64, w: [Dual64; 3], old: [f64; 3]) -> [Dual64; 3] {
    let size = |v: &[Dual64; 3]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    let bound = Dual64::from(b);
    match *law {
        Regularization::StickVelocity(Quantity { value: velocity, .. }) => {
            let speed = size(&w);
            let stick = Dual64::from(velocity);
            let largest = if (speed - stick).re < 0.0 { stick } else { speed };
            w.map(|w| -bound * w / largest)
        }
        Regularization::SmoothStickVelocity(Quantity { value: velocity, .. }) => {
            let speed = (size(&w) * size(&w) + Dual64::from(velocity * velocity)).sqrt();
            w.map(|w| -bound * w / speed)
        }
        Regularization::StickStiffness(Quantity { value: stiffness, .. }) => {
            let trial: [Dual64; 3] =
                std::array::from_fn(|i| Dual64::from(old[i]) - Dual64::from(stiffness) * w[i]);
            let length = size(&trial);
            if (length - bound).re < 0.0 { trial } else { trial.map(|t| t * bound / length) }
        }
    }
}

/// Comparison with dual numbers: in the tangent plane both regimes of every regularization have the
/// exact derivative.
#[test]
fn agrees_with_dual_numbers() {
    let normal = Vector::<3>::new(0.0, 0.0, 1.0);
    let (b, old) = (1e5, Vector::<3>::new(3e4, -2e4, 0.0));
    for law in REGULARIZATIONS.iter().map(|entry| (entry.of)(entry.sample)) {
        let scale = if law.stiffness().is_some() { 1e-4 } else { 1e-2 };
        for size in [0.3 * scale, 7.0 * scale] {
            let w = Vector::<3>::new(0.6, -0.8, 0.0) * size;
            let answer = traction(&law, b, (&normal, &normal), (&w, &w), &old);
            let slope = answer.by_velocity + answer.by_increment;
            for k in 0..2 {
                let seed = std::array::from_fn(|i| Dual64::new(w[i], f64::from(i == k)));
                let exact = oracle(&law, b, seed, old.into());
                for i in 0..3 {
                    assert!((answer.traction[i] - exact[i].re).abs() < 1e-12 * b, "{law:?}");
                    let scale = b / size;
                    assert!((slope[(i, k)] - exact[i].eps).abs() < 1e-12 * scale, "{law:?} {size}");
                }
            }
        }
    }
}

/// The continued stick branch keeps the stick stiffness beyond the bound, so that its root is the
/// stick state.
#[test]
fn stick_branch_continues_beyond_the_bound() {
    let normal = Vector::<2>::new(0.0, 1.0);
    let (b, w) = (1e5, Vector::<2>::new(0.5, 0.2));
    let cases = [
        (Regularization::stick_velocity(1e-2), b / 1e-2),
        (Regularization::smooth_stick_velocity(1e-2), b / 1e-2),
        (Regularization::stick_stiffness(1e9), 1e9),
    ];
    for (law, slope) in cases {
        let zero = Vector::<2>::zeros();
        let slip =
            Slip { normal: &normal, velocity: &w, increment: &w, old_traction: &zero, old_normal: &normal };
        let actual = law.traction(&bound(b), &slip, Branch::Actual);
        let stick = law.traction(&bound(b), &slip, Branch::Stick);
        assert!(actual.slips && !stick.slips);
        assert!(
            (stick.traction[0] / (-slope * 0.5) - 1.0).abs() < 1e-14 && stick.traction.norm() > b,
            "{law:?}"
        );
        let tangent = stick.by_velocity + stick.by_increment;
        assert!((tangent[(0, 0)] / -slope - 1.0).abs() < 1e-14, "{law:?}");
        assert_eq!(tangent[(1, 1)], 0.0);
    }
}
