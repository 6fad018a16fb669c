//! Reports of the iterations and of the outcome of a solve (theory, section 5.1).

use super::held::HeldMotions;
use crate::dynamics::ContactCounts;

/// The part of a solve that an iteration belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SolvePhase {
    /// Newton's method on the full system.
    Monolithic,
    /// Stage I of the two-stage scheme.
    NormalStage,
    /// Stage II of the two-stage scheme.
    FrictionStage,
    /// The end of a sweep over both stages: the balance of the full system with the result of stage
    /// I.
    Sweep,
    /// An update of the multipliers of contact.
    Augment,
}

impl SolvePhase {
    /// Name of the phase in `iterations.csv`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Monolithic => "monolithic",
            Self::NormalStage => "I",
            Self::FrictionStage => "II",
            Self::Sweep => "sweep",
            Self::Augment => "augment",
        }
    }
}

/// One Newton iteration: a row of `iterations.csv` and of the table that `-v` prints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IterationReport {
    /// Phase of the solve.
    pub phase: SolvePhase,
    /// Number of corrections applied so far; 0 is the initial guess. For a sweep or an update, its
    /// number, counted from 1.
    pub iteration: u32,
    /// Residual, relative to the largest force.
    pub residual: f64,
    /// 2-norm of the last correction \[m\]; 0 for the initial guess.
    ///
    /// For a sweep it is the distance between the stages. For an update it is the remaining
    /// penetration or gap.
    pub increment: f64,
    /// Krylov iterations of that correction. For the initial guess, those of the solve that moves
    /// it with the prescribed motion.
    pub krylov: u32,
    /// Contact points of this iterate.
    pub contact: ContactCounts,
    /// Step length along the correction; 1 for a full correction.
    pub line_search: f64,
    /// For a sweep: distance between the stages, relative to that of the previous sweep.
    pub contraction: Option<f64>,
}

impl IterationReport {
    /// Reports the initial guess of a Newton iteration.
    pub fn first(residual: f64, contact: ContactCounts) -> Self {
        let (iteration, increment, krylov, line_search) = (0, 0.0, 0, 1.0);
        let phase = SolvePhase::Monolithic;
        Self { phase, iteration, residual, increment, krylov, contact, line_search, contraction: None }
    }
}

/// Reason why a solve found no balance. It decides which remedies are tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Trouble {
    /// Newton's method does not converge.
    #[default]
    Balance,
    /// The multipliers of contact do not reach the requested penetration.
    Multipliers,
    /// The stages of a staggered step do not agree.
    Sweeps,
    /// No linear solver reached its tolerance.
    Linear,
    /// Surfaces move too far within the step.
    Motion,
    /// A value is not finite or too large.
    Numbers,
}

/// Totals of one solve. They include the linear solve that moves the initial guess with the
/// prescribed motion, which is iteration 0.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SolveReport {
    /// Number of Newton corrections.
    pub newton: u32,
    /// Newton corrections of a single solve, if there were several: of the first one before
    /// multiplier updates, or of the longer of two stages.
    pub single: Option<u32>,
    /// Number of Krylov iterations.
    pub krylov: u32,
    /// Number of Krylov iterations within preconditioners.
    pub inner: u32,
    /// Final residual, relative to the largest force.
    pub residual: f64,
    /// Contact points at the end.
    pub contact: ContactCounts,
    /// Free motions that were held in the last correction.
    pub held: HeldMotions,
    /// Whether loads drove a body along a motion that nothing resists.
    pub driven: bool,
    /// Why the solve found no balance, if it failed.
    pub trouble: Trouble,
}

impl SolveReport {
    /// Newton corrections that are used to judge the length of a step. Updates of multipliers and
    /// sweeps over two stages are not counted, because their cost hardly depends on the step.
    pub fn effort(&self) -> u32 {
        self.single.unwrap_or(self.newton)
    }

    /// Adds the work of another solve, which is the latest one so far.
    pub fn add_work(&mut self, other: &Self) {
        self.newton += other.newton;
        self.krylov += other.krylov;
        self.inner += other.inner;
        // Without a correction there was no search for free motions.
        if other.newton > 0 {
            self.held.clone_from(&other.held);
        }
    }
}

/// Outcome of a solve.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// The residual meets the tolerance.
    Converged(SolveReport),
    /// The solve did not converge, and the step may be cut. The message contains values and
    /// thresholds.
    Failed(SolveReport, String),
}

impl Outcome {
    /// Adds the work of an earlier failed attempt. That work does not count when the length of the
    /// step is judged.
    #[must_use]
    pub fn after(mut self, earlier: &SolveReport) -> Self {
        let (Self::Converged(report) | Self::Failed(report, _)) = &mut self;
        report.single.get_or_insert(report.newton);
        report.newton += earlier.newton;
        report.krylov += earlier.krylov;
        report.inner += earlier.inner;
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The cost of an initial guess counts in the totals, but not when the length of the step is
    /// judged.
    #[test]
    fn work_that_led_nowhere_counts() {
        let spent = SolveReport { newton: 25, krylov: 60, inner: 3, ..SolveReport::default() };
        let solved = SolveReport { newton: 4, krylov: 10, residual: 1e-10, ..SolveReport::default() };
        let Outcome::Converged(report) = Outcome::Converged(solved).after(&spent) else {
            panic!("it converged")
        };
        assert_eq!((report.newton, report.krylov, report.inner, report.effort()), (29, 70, 3, 4));
        assert_eq!(report.residual, 1e-10);
        let staggered = SolveReport { newton: 20, single: Some(3), ..SolveReport::default() };
        let Outcome::Failed(report, _) = Outcome::Failed(staggered, String::new()).after(&spent) else {
            panic!("it failed")
        };
        assert_eq!((report.newton, report.effort()), (45, 3));
    }
}
