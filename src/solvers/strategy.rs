//! How a step is solved: at once, or normal contact and friction in turn.

use super::convergence::{IterationReport, Outcome};
use super::linear::Fallback;
use super::monolithic::Monolithic;
use crate::dynamics::{Dynamics, Stage};
use crate::error::Result;

/// A strategy that a user can name.
#[derive(Debug, PartialEq)]
pub struct Entry {
    /// Key in the case file.
    pub name: &'static str,
    /// One sentence.
    pub about: &'static str,
}

/// All strategies, for `contact-petsc list`.
pub const STRATEGIES: &[Entry] = &[
    Entry { name: "monolithic", about: "Newton with the full non-symmetric tangent, whatever the friction" },
    Entry {
        name: "staggered",
        about: "normal contact and friction in turn by symmetric matrices; a sweep contracts in proportion to the \
                coefficient of friction, by 0.4 to 0.66 mu for rubber, 0.05 mu for concrete, and is relaxed where that is \
                too much",
    },
];

/// A way to bring `stage.trial` to the balance at the end of a step.
pub trait Strategy {
    /// Corrects `stage.trial` until the balance holds; its forces are then those of the full system. Collective.
    ///
    /// # Errors
    /// When PETSc refuses; a solve that does not converge is an [`Outcome`].
    fn solve(
        &mut self,
        system: &mut dyn Dynamics,
        stage: &mut Stage,
        watch: &mut dyn FnMut(&IterationReport),
    ) -> Result<Outcome>;

    /// Moves the prescribed unknowns to their values at the trial instant and the free ones along with them;
    /// `false` where the linear solve failed. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    fn follow_prescribed(&mut self, system: &mut dyn Dynamics, stage: &mut Stage) -> Result<bool>;

    /// Strategy and linear solvers, for people.
    fn describe(&self) -> String;

    /// Whether a linear solver wants the rigid-body modes.
    fn wants_rigid_body_modes(&self) -> bool;

    /// Whether a factorisation is shared by all ranks, which then rounds differently each time.
    fn factorises_together(&self) -> bool;

    /// Linear solvers that failed since the last call, and what took over.
    fn take_fallbacks(&mut self) -> Vec<Fallback>;
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
