//! Newmark, HHT, generalised-alpha, midpoint, backward Euler and statics as one family of schemes
//! (theory, chapter 4).

use crate::dynamics::{Balance, OverStep, Shifts, Stage};
use crate::error::Result;

pub use crate::schemes::Method as Scheme;

/// What a scheme does with a stage.
pub trait Integrate: Copy {
    /// `dv/du` and `da/du` for a step `dt` \[s\].
    fn shifts(self, dt: f64) -> Shifts;

    /// Weights of inertia and forces in the balance.
    fn balance(self) -> Balance;

    /// Prepares a step from `stage.start` to the time `end` \[s\]. Sets shifts and bases, and takes
    /// the start displacement as initial guess.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn prepare(self, stage: &mut Stage, dt: f64, end: f64) -> Result<()>;

    /// Moves the initial guess along the velocity at the start, to `u_start + dt v_start`.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn extrapolate(self, stage: &mut Stage) -> Result<()>;

    /// Advances a trial state from the midpoint of the step to its end: `u` and `v` linearly, `a`
    /// as at the midpoint.
    ///
    /// Returns `true` if the trial state was at the midpoint. The system then has to update
    /// prescribed values and forces.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn finish(self, stage: &mut Stage, end: f64) -> Result<bool>;
}

impl Integrate for Scheme {
    fn shifts(self, dt: f64) -> Shifts {
        match self {
            Self::Newmark { beta, gamma, .. } => {
                Shifts { velocity: gamma / (beta * dt), acceleration: 1.0 / (beta * dt * dt) }
            }
            Self::BackwardEuler => Shifts { velocity: 1.0 / dt, acceleration: 1.0 / (dt * dt) },
            Self::Midpoint | Self::Conserving => Self::BackwardEuler.shifts(0.5 * dt),
            Self::Static => Shifts { velocity: 1.0 / dt, acceleration: 0.0 },
        }
    }

    fn balance(self) -> Balance {
        match self {
            Self::Newmark { alpha_m, alpha_f, .. } => {
                let end = 1.0 - alpha_f;
                Balance { mass: [alpha_m / end, (1.0 - alpha_m) / end], start_force: alpha_f / end }
            }
            Self::BackwardEuler | Self::Midpoint | Self::Conserving | Self::Static => Balance::AT_THE_END,
        }
    }

    fn prepare(self, stage: &mut Stage, dt: f64, end: f64) -> Result<()> {
        stage.dt = dt;
        stage.shifts = self.shifts(dt);
        stage.balance = self.balance();
        stage.inertia = self.has_inertia();
        stage.over_step = if self == Self::Conserving { OverStep::Middle } else { OverStep::No };
        stage.trial.time = if self.is_midpoint() { 0.5 * (stage.start.time + end) } else { end };
        bases(self, stage)?;
        stage.trial.u.copy_from(&stage.start.u)
    }

    fn extrapolate(self, stage: &mut Stage) -> Result<()> {
        match self {
            Self::Static => Ok(()),
            Self::Midpoint | Self::Conserving => stage.trial.u.axpy(0.5 * stage.dt, &stage.start.v),
            _ => stage.trial.u.axpy(stage.dt, &stage.start.v),
        }
    }

    fn finish(self, stage: &mut Stage, end: f64) -> Result<bool> {
        if !self.is_midpoint() {
            return Ok(false);
        }
        stage.trial.u.axpby(-1.0, 2.0, &stage.start.u)?;
        stage.trial.v.axpby(-1.0, 2.0, &stage.start.v)?;
        stage.trial.time = end;
        if stage.over_step == OverStep::Middle {
            stage.over_step = OverStep::End;
        }
        Ok(true)
    }
}

/// Computes `v` and `a` at the end of the step for an unchanged displacement.
fn bases(scheme: Scheme, stage: &mut Stage) -> Result<()> {
    let dt = stage.dt;
    if scheme == Scheme::Static {
        stage.velocity_base.set(0.0);
        stage.acceleration_base.set(0.0);
        return Ok(());
    }
    let (v, a) = (stage.start.v.owned(), stage.start.a.owned());
    let mut v_base = stage.velocity_base.owned_mut();
    let mut a_base = stage.acceleration_base.owned_mut();
    for i in 0..v.len() {
        (v_base[i], a_base[i]) = match scheme {
            Scheme::Newmark { beta, gamma, .. } => {
                let base = -v[i] / (beta * dt) - (0.5 / beta - 1.0) * a[i];
                (v[i] + dt * ((1.0 - gamma) * a[i] + gamma * base), base)
            }
            Scheme::BackwardEuler => (0.0, -v[i] / dt),
            Scheme::Midpoint | Scheme::Conserving => (0.0, -2.0 * v[i] / dt),
            Scheme::Static => (0.0, 0.0),
        };
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Advances `m a + c v + k u = 0` with the scheme's own weights and shifts. Returns `u` at the
    /// end.
    fn oscillate(scheme: Scheme, steps: usize, end: f64) -> f64 {
        let (m, k) = (2.0, 18.0);
        let dt = end / steps as f64;
        let shifts = scheme.shifts(dt);
        let balance = scheme.balance();
        let mut u = 1.0;
        let mut v = 0.5;
        let mut a = -k / m;
        for _ in 0..steps {
            let (v_base, a_base) = match scheme {
                Scheme::Newmark { beta, gamma, .. } => {
                    let base = -v / (beta * dt) - (0.5 / beta - 1.0) * a;
                    (v + dt * ((1.0 - gamma) * a + gamma * base), base)
                }
                Scheme::Midpoint | Scheme::Conserving => (0.0, -2.0 * v / dt),
                _ => (0.0, -v / dt),
            };
            let stiffness = balance.mass[1] * m * shifts.acceleration + k;
            let inertia = m * (balance.mass[0] * a + balance.mass[1] * a_base);
            let residual = inertia + k * (balance.start_force + 1.0) * u;
            let change = -residual / stiffness;
            let [u_start, v_start] = [u, v];
            u += change;
            (v, a) = (v_base + shifts.velocity * change, a_base + shifts.acceleration * change);
            if scheme.is_midpoint() {
                (u, v) = (2.0 * u - u_start, 2.0 * v - v_start);
            }
        }
        u
    }

    /// Newmark, HHT, generalised-alpha and midpoint converge with order 2 on an oscillator,
    /// backward Euler with order 1.
    #[test]
    fn schemes_converge_with_their_order() {
        let exact = (3.0f64 * 1.0).cos() + 0.5 / 3.0 * (3.0f64 * 1.0).sin();
        let cases = [
            (Scheme::newmark(0.25, 0.5), 2.0),
            (Scheme::hht(0.8), 2.0),
            (Scheme::generalized_alpha(0.8), 2.0),
            (Scheme::generalized_alpha(0.0), 2.0),
            (Scheme::Midpoint, 2.0),
            (Scheme::BackwardEuler, 1.0),
        ];
        for (scheme, order) in cases {
            let error = |steps| (oscillate(scheme, steps, 1.0) - exact).abs();
            let rate = (error(400) / error(800)).log2();
            assert!((rate - order).abs() < 0.05, "{scheme:?}: rate {rate}");
        }
    }

    /// Every scheme that a case can name converges on an oscillator with order 2, except for backward
    /// Euler and for a damped Newmark, which have order 1.
    #[test]
    fn all_schemes_converge() {
        use crate::schemes::{self, SCHEMES};
        let exact = (3.0f64 * 1.0).cos() + 0.5 / 3.0 * (3.0f64 * 1.0).sin();
        for scheme in SCHEMES.iter().flat_map(|entry| (entry.samples)()) {
            let method = scheme.law().method();
            if !method.has_inertia() {
                continue;
            }
            let error = |steps| (oscillate(method, steps, 1.0) - exact).abs();
            let rate = (error(400) / error(800)).log2();
            let is_first = match scheme {
                schemes::Scheme::BackwardEuler(_) => true,
                schemes::Scheme::Newmark(schemes::Newmark { gamma, .. }) => gamma.value > 0.5,
                _ => false,
            };
            let order = if is_first { 1.0 } else { 2.0 };
            assert!((rate - order).abs() < 0.05, "{scheme:?}: rate {rate}");
        }
    }

    /// With spectral radius 1, both damped schemes are the average-acceleration method or its
    /// midpoint form.
    #[test]
    fn undamped_limits() {
        assert_eq!(Scheme::hht(1.0), Scheme::newmark(0.25, 0.5));
        let Scheme::Newmark { beta, gamma, alpha_m, alpha_f } = Scheme::generalized_alpha(1.0) else {
            unreachable!()
        };
        assert_eq!((beta, gamma, alpha_m, alpha_f), (0.25, 0.5, 0.5, 0.5));
    }
}
