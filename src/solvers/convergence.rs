//! What an iteration did, and how a solve ended (theory, section 5.1).

use super::held::HeldMotions;
use crate::dynamics::ContactCounts;

/// What an iteration belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SolvePhase {
    /// Newton's method on the full system.
    Monolithic,
    /// Stage I of the two-stage scheme.
    NormalStage,
    /// Stage II of it.
    FrictionStage,
    /// The end of a sweep over both stages: the balance of the full system at the result of stage I.
    Sweep,
    /// An update of the multipliers of contact.
    Augment,
}

impl SolvePhase {
    /// The word in `iterations.csv`.
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

/// One Newton iteration, a row of `iterations.csv` and of the table at `-v`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IterationReport {
    /// What it belongs to.
    pub phase: SolvePhase,
    /// Number of corrections applied so far; 0 is the first guess. Of a sweep or an update its number, from 1 on.
    pub iteration: u32,
    /// Residual over the largest force.
    pub residual: f64,
    /// 2-norm of the correction that led here \[m\]; 0 for the first guess. Of a sweep the distance of the stages, of
    /// an update the penetration or gap that is left.
    pub increment: f64,
    /// Krylov iterations of that correction; of what carried the first guess along with prescribed motion.
    pub krylov: u32,
    /// Contact points of this iterate.
    pub contact: ContactCounts,
    /// Length of the step along the correction, 1 where it was taken whole.
    pub line_search: f64,
    /// Of a sweep: distance of the stages over that of the sweep before.
    pub contraction: Option<f64>,
}

impl IterationReport {
    /// The first guess of a Newton iteration.
    pub fn first(residual: f64, contact: ContactCounts) -> Self {
        let (iteration, increment, krylov, line_search) = (0, 0.0, 0, 1.0);
        let phase = SolvePhase::Monolithic;
        Self { phase, iteration, residual, increment, krylov, contact, line_search, contraction: None }
    }
}

/// What kept a solve from its balance: decides what may help.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Trouble {
    /// Newton's method finds no balance.
    #[default]
    Balance,
    /// The multipliers of contact do not reach the penetration that is asked for.
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

/// Totals of one solve; the linear solve that carries prescribed motion into its first guess counts, with iteration 0.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SolveReport {
    /// Newton corrections.
    pub newton: u32,
    /// Those of one solve, where there were several: of the first one before multipliers are updated, of the longest of two stages.
    pub single: Option<u32>,
    /// Krylov iterations.
    pub krylov: u32,
    /// Krylov iterations within preconditioners.
    pub inner: u32,
    /// Residual over the largest force at the end.
    pub residual: f64,
    /// Contact points at the end.
    pub contact: ContactCounts,
    /// Free motions that were held in the last correction.
    pub held: HeldMotions,
    /// Loads drove a body along a motion that nothing resists.
    pub driven: bool,
    /// What kept a solve that failed from its balance.
    pub trouble: Trouble,
}

impl SolveReport {
    /// Newton corrections by which the length of a step is judged: updates of multipliers, and sweeps over two stages, cost what
    /// they cost whatever it is.
    pub fn effort(&self) -> u32 {
        self.single.unwrap_or(self.newton)
    }

    /// Adds the work of another solve, the last one so far.
    pub fn add_work(&mut self, other: &Self) {
        self.newton += other.newton;
        self.krylov += other.krylov;
        self.inner += other.inner;
        // Where nothing was corrected free motions were not looked for.
        if other.newton > 0 {
            self.held.clone_from(&other.held);
        }
    }
}

/// How a solve ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// The balance holds to the tolerance.
    Converged(SolveReport),
    /// It does not; the step may be cut. The sentence carries figures and thresholds.
    Failed(SolveReport, String),
}

impl Outcome {
    /// The same with the work of an earlier solve that led nowhere; the length of the step is judged without that.
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

    /// What a first guess cost counts, and is none of what the length of the step is judged by.
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
