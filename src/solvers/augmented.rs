//! Augmented Lagrange: meets the requested penetration and slip by multipliers instead of ever stiffer
//! laws.
//!
//! `t_n = <lambda - g / eps_n>` (2.24) and the return map (2.41) are solved with fixed `lambda`. The
//! resulting pressure and friction are the next `lambda` (Uzawa), until the remaining gap and elastic
//! slip at closed points are small enough. Each update reduces them by about the ratio of the stiffness
//! of the bodies to that of the law. Each step starts with the multipliers of the last one.

use serde_json::Value;

use super::convergence::{IterationReport, Outcome, SolvePhase, SolveReport, Trouble};
use super::linear::Fallback;
use super::strategy::Strategy;
use crate::dynamics::{Dynamics, Sources, Stage};
use crate::error::Result;

/// A strategy whose contact is augmented.
pub struct Augmented {
    inner: Box<dyn Strategy>,
}

impl Augmented {
    /// Maximum number of multiplier updates before the step is cut.
    const MOST: u32 = 25;
    /// Number of consecutive updates without progress before the step is cut.
    const IDLE: u32 = 4;
    /// An update that leaves more than this part of the gap makes no progress.
    const PROGRESS: f64 = 0.95;

    /// Creates a strategy that solves with `inner` while the multipliers are fixed.
    pub fn new(inner: Box<dyn Strategy>) -> Self {
        Self { inner }
    }
}

impl Strategy for Augmented {
    fn solve(
        &mut self,
        system: &mut dyn Dynamics,
        stage: &mut Stage,
        watch: &mut dyn FnMut(&IterationReport),
    ) -> Result<Outcome> {
        system.reset_multipliers();
        let mut report = SolveReport::default();
        let mut least = f64::INFINITY;
        let mut idle = 0;
        for update in 1.. {
            let outcome = self.inner.solve(system, stage, watch)?;
            let (Outcome::Converged(solved) | Outcome::Failed(solved, _)) = &outcome;
            report.add_work(solved);
            report.single.get_or_insert(solved.effort());
            (report.residual, report.contact) = (solved.residual, solved.contact);
            (report.driven, report.trouble) = (solved.driven, solved.trouble);
            if let Outcome::Failed(_, reason) = outcome {
                return Ok(Outcome::Failed(report, reason));
            }
            // In dynamics the penalty increases between steps instead, because inertia prevents a
            // correction within one step.
            let left = if stage.inertia { None } else { system.shortfall(stage)? };
            let Some(left) = left.filter(|left| left.ratio > 1.0) else {
                return Ok(Outcome::Converged(report));
            };
            idle = if left.ratio > Self::PROGRESS * least { idle + 1 } else { 0 };
            least = least.min(left.ratio);
            if update > Self::MOST || idle >= Self::IDLE {
                report.trouble = Trouble::Multipliers;
                let m = system.units().of("m");
                return Ok(Outcome::Failed(
                    report,
                    format!(
                        "the {} of contact points is {:.2e} {m} after {update} updates of the multipliers, \
                         but {} allows {:.2e} {m}",
                        left.name,
                        left.length,
                        left.key,
                        left.length / left.ratio
                    ),
                ));
            }
            system.improve();
            watch(&IterationReport {
                phase: SolvePhase::Augment,
                iteration: update,
                increment: left.length,
                ..IterationReport::first(report.residual, report.contact)
            });
        }
        Ok(Outcome::Failed(report, String::new()))
    }

    fn follow_prescribed(&mut self, system: &mut dyn Dynamics, stage: &mut Stage) -> Result<bool> {
        system.reset_multipliers();
        self.inner.follow_prescribed(system, stage)
    }

    fn state(&self, system: &dyn Dynamics, sources: &mut Sources) -> Result<Value> {
        self.inner.state(system, sources)
    }

    fn resume(&mut self, state: &Value, sources: &Sources, system: &mut dyn Dynamics) -> Result<()> {
        self.inner.resume(state, sources, system)
    }

    fn describe(&self) -> String {
        format!("augmented, {}", self.inner.describe())
    }

    fn wants_rigid_body_modes(&self) -> bool {
        self.inner.wants_rigid_body_modes()
    }

    fn factorises_together(&self) -> bool {
        self.inner.factorises_together()
    }

    fn take_fallbacks(&mut self) -> Vec<Fallback> {
        self.inner.take_fallbacks()
    }
}
