//! A linear solver: Krylov method and preconditioner, selected by PETSc's options.

use super::call::{check, petsc, take_detail};
use super::operator::Operator;
use super::options::{insert, remove, text};
use super::outcome::{InitialGuess, LinearOutcome, Reason, Reuse};
use super::session::Session;
use super::shell::ShellPreconditioner;
use super::vector::Vector;
use crate::error::{Error, Result};
use petsc_sys as sys;
use std::ptr::null_mut;
use std::rc::Rc;

/// A linear solver with an options prefix.
///
/// The program's settings are in PETSc's options database only while the solver needs them. Solvers
/// with one prefix therefore do not disturb each other, and only the user's options remain in the
/// database. The user's options take precedence.
pub struct KrylovSolver {
    session: Rc<Session>,
    prefix: String,
    raw: sys::KSP,
    defaults: Vec<(String, String)>,
}

impl KrylovSolver {
    /// A solver that reads options with the prefix, as in `contact_ksp_type`; the prefix of the
    /// main solver is empty. Collective.
    ///
    /// # Errors
    /// PETSc fails.
    pub fn new(session: &Rc<Session>, prefix: &str) -> Result<Self> {
        let raw = create(session, prefix)?;
        Ok(Self { session: Rc::clone(session), prefix: prefix.to_owned(), raw, defaults: Vec::new() })
    }

    /// Recreates the solver with these options (names without dash and prefix, as in `("pc_type",
    /// "asm")`, empty value for a flag). Options given by the user take precedence. Operators and
    /// tolerances must be set again. Collective.
    ///
    /// # Errors
    /// PETSc does not know a value.
    pub fn configure(&mut self, options: &[(&str, &str)]) -> Result<()> {
        petsc!(KSPDestroy(&mut self.raw))?;
        self.raw = create(&self.session, &self.prefix)?;
        let owned = |&(name, value): &(&str, &str)| (format!("{}{name}", self.prefix), value.to_owned());
        let mut defaults: Vec<(String, String)> = options.iter().map(owned).collect();
        defaults.retain(|(name, _)| !self.session.is_given(name));
        self.defaults = defaults;
        let raw = self.raw;
        self.with_defaults(|| petsc!(KSPSetFromOptions(raw))).map_err(|error| self.blame(error))
    }

    /// Attributes an error to the user's options if there are any for this solver; otherwise it is
    /// a fault of the program.
    fn blame(&self, error: Error) -> Error {
        let given = self.session.given(&self.prefix);
        if given.is_empty() {
            return error;
        }
        Error::usage(error.message).hint(&format!("your PETSc options for this solver: {}", given.join(" ")))
    }

    /// Runs a function that may read options while the program's settings are in the database.
    fn with_defaults<R>(&self, run: impl FnOnce() -> Result<R>) -> Result<R> {
        for (name, value) in &self.defaults {
            insert(name, value)?;
        }
        let answer = run();
        for (name, _) in &self.defaults {
            remove(name)?;
        }
        answer
    }

    /// Sets the matrix `operator` to solve with and the matrix `preconditioner` to precondition
    /// with. The next solve uses their current values. Collective.
    ///
    /// # Errors
    /// The sizes do not match.
    pub fn set_operators(&mut self, operator: &impl Operator, preconditioner: &impl Operator) -> Result<()> {
        petsc!(KSPSetOperators(self.raw, operator.raw(), preconditioner.raw()))
    }

    /// Sets the relative and absolute tolerance of the residual and the maximum number of
    /// iterations. Values given by the user are kept.
    ///
    /// # Errors
    /// A tolerance is out of range.
    pub fn set_tolerances(&mut self, relative: f64, absolute: f64, iterations: usize) -> Result<()> {
        let (mut rtol, mut atol, mut dtol, mut most) = (0.0, 0.0, 0.0, 0);
        petsc!(KSPGetTolerances(self.raw, &mut rtol, &mut atol, &mut dtol, &mut most))?;
        let given = |name: &str| self.session.is_given(&format!("{}{name}", self.prefix));
        let rtol = if given("ksp_rtol") { rtol } else { relative };
        let atol = if given("ksp_atol") { atol } else { absolute };
        let most = if given("ksp_max_it") { most } else { iterations as i32 };
        petsc!(KSPSetTolerances(self.raw, rtol, atol, dtol, most))
    }

    /// The effective relative tolerance: the user's value if there is one.
    ///
    /// # Errors
    /// PETSc fails.
    pub fn tolerance(&self) -> Result<f64> {
        let (mut rtol, mut atol, mut dtol, mut most) = (0.0, 0.0, 0.0, 0);
        petsc!(KSPGetTolerances(self.raw, &mut rtol, &mut atol, &mut dtol, &mut most))?;
        Ok(rtol)
    }

    /// Builds the preconditioner (factorizes) now instead of in the next solve. Collective.
    ///
    /// # Errors
    /// PETSc fails. A zero pivot is not an error here; the solve reports it.
    pub fn set_up(&mut self) -> Result<()> {
        self.with_defaults(|| petsc!(KSPSetUp(self.raw))).map_err(|error| self.blame(error))
    }

    /// Builds the preconditioner including that of each piece, which `set_up` leaves to the first
    /// solve. Collective.
    ///
    /// # Errors
    /// The errors of [`set_up`](Self::set_up).
    pub fn set_up_pieces(&mut self) -> Result<()> {
        self.set_up()?;
        self.with_defaults(|| petsc!(KSPSetUpOnBlocks(self.raw))).map_err(|error| self.blame(error))
    }

    /// Solves `A x = b`, starting from zero. Collective.
    ///
    /// # Errors
    /// PETSc fails for a reason other than lack of convergence.
    pub fn solve(&mut self, b: &Vector, x: &mut Vector) -> Result<LinearOutcome> {
        // SAFETY: all three handles are alive.
        let code = self.with_defaults(|| Ok(unsafe { sys::KSPSolve(self.raw, b.raw(), x.raw()) }))?;
        // Some factorizations report a zero pivot by an error code, which is treated as a failed
        // solve.
        if [sys::ERROR_ZERO_PIVOT_LU, sys::ERROR_ZERO_PIVOT_CHOLESKY].contains(&code) {
            let _ = take_detail();
            return Ok(LinearOutcome {
                iterations: 0,
                reason: Reason::PreconditionerFailed,
                residual: f64::NAN,
            });
        }
        check("KSPSolve", code)?;
        let mut iterations = 0;
        let mut residual = 0.0;
        let mut reason = sys::KSPConvergedReason(0);
        petsc!(KSPGetIterationNumber(self.raw, &mut iterations))?;
        petsc!(KSPGetResidualNorm(self.raw, &mut residual))?;
        petsc!(KSPGetConvergedReason(self.raw, &mut reason))?;
        Ok(LinearOutcome { iterations: iterations as usize, reason: Reason::new(reason), residual })
    }

    /// Sets whether the preconditioner is kept when the matrix changes.
    ///
    /// # Errors
    /// PETSc fails.
    pub fn reuse_preconditioner(&mut self, reuse: Reuse) -> Result<()> {
        let flag = if reuse == Reuse::Keep { sys::PETSC_TRUE } else { sys::PETSC_FALSE };
        petsc!(KSPSetReusePreconditioner(self.raw, flag))
    }

    /// Sets whether the iteration starts from the given `x` or from zero.
    ///
    /// # Errors
    /// PETSc fails.
    pub fn start_from(&mut self, start: InitialGuess) -> Result<()> {
        let flag = if start == InitialGuess::Given { sys::PETSC_TRUE } else { sys::PETSC_FALSE };
        petsc!(KSPSetInitialGuessNonzero(self.raw, flag))
    }

    /// Sets the preconditioner to `apply(x, y)`, which computes `y`, an approximation of `A^-1 x`.
    /// Call it after `configure`.
    ///
    /// The closure runs on all ranks together. If it fails, it must fail on all ranks.
    ///
    /// # Errors
    /// PETSc fails.
    pub fn set_shell_preconditioner(
        &mut self,
        apply: impl FnMut(&Vector, &mut Vector) -> Result<()> + 'static,
    ) -> Result<()> {
        ShellPreconditioner::install(&self.session, self.preconditioner()?, Box::new(apply))
    }

    /// Frees factors and work vectors. Options are kept; operators must be set again. Collective.
    ///
    /// # Errors
    /// PETSc fails.
    pub fn reset(&mut self) -> Result<()> {
        petsc!(KSPReset(self.raw))
    }

    /// Type of the Krylov method and of the preconditioner, as in `("gmres", "asm")`; empty if not
    /// yet known.
    ///
    /// # Errors
    /// PETSc fails.
    pub fn types(&self) -> Result<(String, String)> {
        let (mut method, mut kind) = (std::ptr::null(), std::ptr::null());
        petsc!(KSPGetType(self.raw, &mut method))?;
        petsc!(PCGetType(self.preconditioner()?, &mut kind))?;
        // SAFETY: PETSc returns null or strings that live as long as the objects.
        Ok(unsafe { (super::call::string(method), super::call::string(kind)) })
    }

    /// PETSc's preconditioner. It is valid until `self` is configured again.
    ///
    /// # Errors
    /// PETSc fails.
    pub fn preconditioner(&self) -> Result<sys::PC> {
        let mut pc = null_mut();
        petsc!(KSPGetPC(self.raw, &mut pc))?;
        Ok(pc)
    }
}

fn create(session: &Session, prefix: &str) -> Result<sys::KSP> {
    let mut raw = null_mut();
    petsc!(KSPCreate(session.comm(), &mut raw))?;
    if !prefix.is_empty() {
        petsc!(KSPSetOptionsPrefix(raw, text(prefix)?.as_ptr()))?;
    }
    Ok(raw)
}

impl Drop for KrylovSolver {
    fn drop(&mut self) {
        // SAFETY: we own the handle, and PETSc is running because we hold the session.
        unsafe { sys::KSPDestroy(&mut self.raw) };
    }
}
