//! Initial guess for moving supports: prescribed unknowns move the free ones with them.

use super::Monolithic;
use crate::dynamics::{Dynamics, Lift, Stage};
use crate::error::Result;

impl Monolithic {
    /// Moves the prescribed unknowns and rigid bodies with prescribed motion to their positions at
    /// the trial time, and the free unknowns with them. Collective.
    ///
    /// It uses one linear solve at the previous state: `K_ff du_f = -(r_f + K_fd du_d)`. Without
    /// it, a large prescribed increment would invert the first row of elements. Returns `false` if
    /// the linear solve failed.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn follow_prescribed(&mut self, system: &mut dyn Dynamics, stage: &mut Stage) -> Result<bool> {
        system.rewind();
        system.linearise_pressure(None);
        self.origin.copy_from(&stage.trial.u)?;
        stage.update_rates()?;
        system.prescribe(stage)?;
        // `correction` contains the prescribed change. Its free rows are zero.
        self.correction.waxpy(-1.0, &self.origin, &stage.trial.u)?;
        stage.trial.u.copy_from(&self.origin)?;
        self.correction.update_ghosts()?;
        stage.trial.u.update_ghosts()?;
        let now = system.residual(stage, &mut self.residual)?;
        if !now.norm.is_finite() {
            return Ok(false);
        }
        self.rhs.copy_from(&self.residual)?;
        self.rhs.scale(-1.0)?;
        let lift = Lift { change: &self.correction, rhs: &mut self.rhs };
        self.kept.discard();
        system.jacobian(stage, self.settings.terms, Some(lift))?;
        if !system.matrix().norm_frobenius()?.is_finite() {
            return Ok(false);
        }
        let tolerance = self.settings.linear[1];
        // Motions that nothing resists are excluded. The corrections determine how far loads drive
        // a body, because they check its path.
        self.release(system, stage, f64::INFINITY)?;
        let solved = self.solve_held(system, stage, tolerance)?;
        let Some(solved) = solved else { return Ok(false) };
        self.ahead = [self.ahead[0] + solved.iterations, self.ahead[1] + solved.inner];
        system.linearise_pressure(Some(&stage.trial.u));
        stage.trial.u.axpy(1.0, &self.correction)?;
        Ok(true)
    }
}
