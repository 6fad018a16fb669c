//! Strategies to solve a step: monolithic, or normal contact and friction in turn.

use serde_json::Value;

use super::convergence::{IterationReport, Outcome};
use super::linear::Fallback;
use super::monolithic::Monolithic;
use crate::dynamics::{Dynamics, RigidInstant, Sources, Stage};
use crate::error::Result;

/// A strategy that a user can name.
#[derive(Debug, PartialEq)]
pub struct StrategyEntry {
    /// Key in the case file.
    pub name: &'static str,
    /// Description in one sentence.
    pub about: &'static str,
}

/// All strategies, for `contact-petsc list`.
pub const STRATEGIES: &[StrategyEntry] = &[
    StrategyEntry {
        name: "monolithic",
        about: "Newton with the full non-symmetric tangent, for any coefficient of friction",
    },
    StrategyEntry {
        name: "staggered",
        about: "normal contact and friction in turn, with symmetric matrices; the contraction factor of a \
                sweep is proportional to the coefficient of friction, and sweeps are relaxed if it is too \
                large",
    },
];

/// A method that brings `stage.trial` to the balance at the end of a step.
pub trait Strategy {
    /// Corrects `stage.trial` until the balance is met. Its forces are then those of the full
    /// system. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails. A solve that does not converge is an [`Outcome`].
    fn solve(
        &mut self,
        system: &mut dyn Dynamics,
        stage: &mut Stage,
        watch: &mut dyn FnMut(&IterationReport),
    ) -> Result<Outcome>;

    /// Moves the prescribed unknowns to their values at the trial time, and the free ones with
    /// them. Rigid bodies with prescribed motion are where `stage.rigid_at` says. Returns `false` if
    /// the linear solve failed. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn follow_prescribed(&mut self, system: &mut dyn Dynamics, stage: &mut Stage) -> Result<bool>;

    /// State that outlives a step. The matrices and preconditioners in it are given by their
    /// `sources`.
    ///
    /// # Errors
    /// An internal error of the program.
    fn state(&self, system: &dyn Dynamics, sources: &mut Sources) -> Result<Value>;

    /// Restores the state. The system's matrix and contact points are then undefined. Collective.
    ///
    /// # Errors
    /// The state is not one of this strategy, or a PETSc call fails.
    fn resume(&mut self, state: &Value, sources: &Sources, system: &mut dyn Dynamics) -> Result<()>;

    /// Describes strategy and linear solvers for the user.
    fn describe(&self) -> String;

    /// Whether a linear solver uses the rigid-body modes.
    fn wants_rigid_body_modes(&self) -> bool;

    /// Whether a factorisation runs on all ranks, and therefore rounds differently in each run.
    fn factorises_together(&self) -> bool;

    /// Returns the linear solvers that failed since the last call, and their replacements.
    fn take_fallbacks(&mut self) -> Vec<Fallback>;
}

/// Computes a first guess with [`Strategy::follow_prescribed`]. At [`RigidInstant::Start`] the motion
/// of rigid bodies enters it like prescribed displacements: points that stick follow. At
/// [`RigidInstant::End`] the bodies already are at the end of the step, and push the points that they
/// reach. Collective.
///
/// # Errors
/// If a PETSc call fails.
pub fn first_guess(
    strategy: &mut dyn Strategy,
    system: &mut dyn Dynamics,
    stage: &mut Stage,
    rigid_at: RigidInstant,
) -> Result<bool> {
    stage.rigid_at = rigid_at;
    let moved = strategy.follow_prescribed(system, stage);
    stage.rigid_at = RigidInstant::End;
    moved
}

impl Strategy for Monolithic {
    fn solve(
        &mut self,
        system: &mut dyn Dynamics,
        stage: &mut Stage,
        watch: &mut dyn FnMut(&IterationReport),
    ) -> Result<Outcome> {
        Self::solve(self, system, stage, watch)
    }

    fn follow_prescribed(&mut self, system: &mut dyn Dynamics, stage: &mut Stage) -> Result<bool> {
        Self::follow_prescribed(self, system, stage)
    }

    fn state(&self, system: &dyn Dynamics, sources: &mut Sources) -> Result<Value> {
        Self::state(self, system, sources)
    }

    fn resume(&mut self, state: &Value, sources: &Sources, system: &mut dyn Dynamics) -> Result<()> {
        Self::resume(self, state, sources, system)
    }

    fn describe(&self) -> String {
        self.linear().describe()
    }

    fn wants_rigid_body_modes(&self) -> bool {
        self.linear().wants_rigid_body_modes()
    }

    fn factorises_together(&self) -> bool {
        self.linear().factorises_together()
    }

    fn take_fallbacks(&mut self) -> Vec<Fallback> {
        Self::take_fallbacks(self)
    }
}
