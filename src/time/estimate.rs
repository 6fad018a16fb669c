//! Error that a step adds to the displacement, estimated from displacements alone (4.13).
//!
//! A scheme of second order rotates each mode by a wrong angle, `(omega dt)^3 c` per step. A scheme
//! of first order damps it, by `(omega dt)^2 c`. The displacement errors are `c dt^3 u'''` and
//! `c dt^2 u''`, with derivatives from divided differences of the last displacements.
//!
//! Differences of accelerations, as used by Zienkiewicz and Xie, have the same limit. However, they
//! weight modes that the step does not resolve by `(omega dt)^2`, and these modes dominate the
//! estimate after an impact.

/// Number of fields in the weighted sum of an estimate.
///
/// In order: displacements two steps ago, one step ago, at the start and at the end of the step;
/// velocity and acceleration at its start.
pub const FIELDS: usize = 6;

/// Times of the displacements: two steps ago, one step ago, start and end \[s\].
pub type Instants = [f64; 4];

/// Weights of the [`FIELDS`] in the error of a step. `known` (0 to 2) is the number of
/// displacements before its start that belong to the same smooth motion.
pub fn weights([damping, turn]: [f64; 2], instants: &Instants, known: usize) -> [f64; FIELDS] {
    let dt = instants[3] - instants[2];
    std::array::from_fn(|field| {
        let unit: [f64; FIELDS] = std::array::from_fn(|other| f64::from(u8::from(other == field)));
        let [second, third] = differences(instants, &unit, known);
        2.0 * damping * dt * dt * second + 6.0 * turn * dt.powi(3) * third
    })
}

/// Weights of three displacements, one per instant, in the parabola through them, evaluated at `at`
/// \[s\].
pub fn extrapolation(instants: [f64; 3], at: f64) -> [f64; 3] {
    std::array::from_fn(|k| {
        let others = (0..3).filter(|other| *other != k);
        others.map(|other| (at - instants[other]) / (instants[k] - instants[other])).product()
    })
}

/// Divided differences of second and third order up to the end of the step. Rates at its start
/// replace unknown earlier displacements.
fn differences(t: &Instants, fields: &[f64; FIELDS], known: usize) -> [f64; 2] {
    let [u0, u1, u2, u3, v, a] = *fields;
    let dt = t[3] - t[2];
    let last = (u3 - u2) / dt;
    let at_start = (last - v) / dt;
    if known == 0 {
        return [at_start, (at_start - 0.5 * a) / dt];
    }
    let middle = (u2 - u1) / (t[2] - t[1]);
    let second = (last - middle) / (t[3] - t[1]);
    if known == 1 {
        let before = (v - middle) / (t[2] - t[1]);
        return [second, (at_start - before) / (t[3] - t[1])];
    }
    let first = (u1 - u0) / (t[1] - t[0]);
    let before = (middle - first) / (t[2] - t[0]);
    [second, (second - before) / (t[3] - t[0])]
}

#[cfg(test)]
mod tests {
    use super::super::scheme::{Integrate, Scheme};
    use super::*;

    /// Integrates an oscillator `u'' = -omega^2 u` with varying steps of the scheme. Returns the
    /// sum of the estimates and the largest true error in displacement and scaled velocity.
    fn oscillate(scheme: Scheme, steps: usize) -> [f64; 2] {
        let (omega, end) = (5.0f64, 2.0);
        let dts: Vec<f64> = (0..steps).map(|k| 1.0 + 0.2 * (k as f64 * 0.7).sin()).collect();
        let total: f64 = dts.iter().sum();
        let mut t = 0.0;
        let mut u = 1.0;
        let mut v = 0.0;
        let mut a = -omega * omega;
        let (mut older, mut times) = ([0.0; 2], [0.0; 2]);
        let (mut sum, mut worst) = (0.0, 0.0f64);
        for (k, part) in dts.iter().enumerate() {
            let dt = part / total * end;
            let shifts = scheme.shifts(dt);
            let balance = scheme.balance();
            let (v_base, a_base) = match scheme {
                Scheme::Newmark { beta, gamma, .. } => {
                    let base = -v / (beta * dt) - (0.5 / beta - 1.0) * a;
                    (v + dt * ((1.0 - gamma) * a + gamma * base), base)
                }
                Scheme::Midpoint => (0.0, -2.0 * v / dt),
                _ => (0.0, -v / dt),
            };
            let stiffness = balance.mass[1] * shifts.acceleration + omega * omega;
            let inertia = balance.mass[0] * a + balance.mass[1] * a_base;
            let change = -(inertia + omega * omega * (balance.start_force + 1.0) * u) / stiffness;
            let start = [u, v, a];
            u += change;
            (v, a) = (v_base + shifts.velocity * change, a_base + shifts.acceleration * change);
            if scheme.is_midpoint() {
                (u, v) = (2.0 * u - start[0], 2.0 * v - start[1]);
            }
            let fields = [older[1], older[0], start[0], u, start[1], start[2]];
            let instants = [times[1], times[0], t, t + dt];
            let weights = weights(scheme.local_error().unwrap(), &instants, k.min(2));
            sum += weights.iter().zip(&fields).map(|(w, f)| w * f).sum::<f64>().abs();
            (older, times) = ([start[0], older[0]], [t, times[0]]);
            t += dt;
            worst = worst.max((u - (omega * t).cos()).hypot(v / omega + (omega * t).sin()));
        }
        [sum, worst]
    }

    /// For every scheme, the sum of the estimates is between half and twice the true error. It
    /// falls with the order of the scheme.
    #[test]
    fn estimates_add_up_to_the_error() {
        let schemes = [
            Scheme::newmark(0.25, 0.5),
            Scheme::newmark(0.3025, 0.6),
            Scheme::hht(0.8),
            Scheme::generalized_alpha(0.8),
            Scheme::generalized_alpha(0.5),
            Scheme::Midpoint,
            Scheme::BackwardEuler,
        ];
        for scheme in schemes {
            let ([coarse, _], [sum, worst]) = (oscillate(scheme, 400), oscillate(scheme, 800));
            assert!((0.5..2.0).contains(&(sum / worst)), "{scheme:?}: {sum:e} of {worst:e}");
            assert!(((coarse / sum).log2() - scheme.order()).abs() < 0.1, "{scheme:?}: {coarse:e}, {sum:e}");
        }
        assert_eq!(Scheme::Static.local_error(), None);
    }

    /// A parabola is extrapolated exactly.
    #[test]
    fn extrapolates_parabolas() {
        let u = |t: f64| 3.0 * t * t - t + 2.0;
        let weights = extrapolation([0.1, 0.3, 0.35], 0.5);
        let value: f64 = weights.iter().zip([0.1, 0.3, 0.35]).map(|(w, t)| w * u(t)).sum();
        assert!((value - u(0.5)).abs() < 1e-13);
    }

    /// If only rates at the start are known, the differences are still those of a smooth motion.
    #[test]
    fn rates_replace_displacements() {
        let instants = [0.0, 0.1, 0.25, 0.45];
        let u = |t: f64| 2.0 * t.powi(3) - t * t + 3.0;
        let s = instants[2];
        let fields =
            [u(instants[0]), u(instants[1]), u(s), u(instants[3]), 6.0 * s * s - 2.0 * s, 12.0 * s - 2.0];
        for known in 0..3 {
            assert!((differences(&instants, &fields, known)[1] - 2.0).abs() < 1e-12, "{known}");
        }
    }
}
