//! The two-stage scheme as preconditioner of the monolithic system (theory, section 6.3).
//!
//! With the symmetric operator `A_I` of stage I and the full `K`, one application to `r` is
//! `z_1 = A_I^-1 r`, then `z = z_1 + A^-1 (r - K z_1)`.
//!
//! With `A = A_I` and exact inner solves this is `z = A_I^-1 (r - (K - A_I) z_1)`, the effect of
//! the new normal tractions on friction. `K - A_I` is `K_nT` plus the small non-symmetric terms.
//! The form with `K` takes one product, needs no matrix for `K_nT`, and also corrects the error of
//! an inexact `z_1`.
//!
//! The second variant uses the operator of the paper's stage II, `A = A_II = A_I - K_CN`, and keeps
//! the normal components of `z_1` at the nodes in contact. Otherwise the result would not include
//! the penalty.

use std::rc::Rc;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::own::{CustomPreconditioner, Origin, source_of, stored};
use crate::dynamics::{MatrixSource, MultigridHints, Sources, Stage};
use crate::error::{Error, Result};
use crate::petsc::{KrylovSolver, Matrix, Operator, Reuse, SharedOperator, Vector};
use crate::presets::{Preset, Second};
use crate::terms::Terms;

/// Settings of the preconditioner in the case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TwoStageSettings {
    /// Operator of the second half.
    pub second: Second,
    /// Preset for the symmetric matrices. `None` selects it from the properties of the problem.
    pub inner: Option<&'static str>,
}

/// One symmetric operator and its solver.
struct Half {
    matrix: Matrix,
    terms: Terms,
    krylov: KrylovSolver,
}

/// The preconditioner with its matrices.
pub struct TwoStage {
    normal: Half,
    friction: Option<Half>,
    /// `K`; known after the first solve has started.
    operator: Option<SharedOperator>,
    residual: Vector,
    correction: Vector,
    normals: Vector,
    iterations: u32,
    /// Source of the matrices, and of those that the inner preconditioners are made for.
    assembled: Option<Rc<MatrixSource>>,
    renewed: Option<Rc<MatrixSource>>,
}

/// The state of the preconditioner that outlives a solve: numbers of its sources.
#[derive(Serialize, Deserialize)]
struct TwoStageState {
    assembled: Option<usize>,
    renewed: Option<usize>,
}

impl Half {
    fn new(origin: &Origin, terms: Terms, preset: &Preset) -> Result<Self> {
        let mut krylov = KrylovSolver::new(origin.session, TwoStage::PREFIX)?;
        krylov.configure(&preset.options_on(origin.session.size() as usize))?;
        Ok(Self { matrix: origin.like.like()?, terms, krylov })
    }

    /// Notes new values of the matrix.
    fn prepare(&mut self, reuse: Reuse) -> Result<()> {
        self.krylov.set_operators(&self.matrix, &self.matrix)?;
        self.krylov.reuse_preconditioner(reuse)?;
        self.krylov.set_tolerances(TwoStage::TOLERANCE, 0.0, TwoStage::MAX_ITERATIONS)?;
        self.krylov.set_up()
    }

    /// Solves `x = matrix^-1 b` approximately. Returns the iterations, or `None` if it failed.
    fn solve(&mut self, b: &Vector, x: &mut Vector) -> Result<Option<u32>> {
        let outcome = self.krylov.solve(b, x)?;
        Ok(outcome.converged().then_some(outcome.iterations as u32))
    }
}

impl TwoStage {
    /// Prefix of PETSc's options for the inner solvers.
    pub const PREFIX: &str = "two_stage_";
    /// Relative tolerance of the inner solves.
    const TOLERANCE: f64 = 1e-2;
    /// Number of iterations after which an inner solve counts as failed.
    const MAX_ITERATIONS: usize = 1000;
    /// Stiffness that keeps the normal components at contact nodes, relative to the diagonal.
    const HOLD: f64 = 1e6;

    /// Creates a preconditioner whose matrices are still zero. Collective.
    ///
    /// # Errors
    /// If memory is insufficient, or the inner preset is not one for symmetric matrices.
    pub fn new(origin: &Origin, second: Second, inner: &str) -> Result<Self> {
        let preset = Preset::named(inner).filter(|preset| preset.symmetric).ok_or_else(|| {
            Error::case(format!("'{inner}' does not solve the symmetric systems of two_stage"))
                .hint("known: cholesky, cg_icc, cg_amg, cg_jacobi")
        })?;
        let friction = match second {
            Second::Coupling => None,
            Second::FrictionStage => Some(Half::new(origin, Terms::FRICTION_STAGE, preset)?),
        };
        Ok(Self {
            normal: Half::new(origin, Terms::NORMAL_STAGE, preset)?,
            friction,
            operator: None,
            residual: origin.pattern.like()?,
            correction: origin.pattern.like()?,
            normals: origin.pattern.like()?,
            iterations: 0,
            assembled: None,
            renewed: None,
        })
    }
}

impl CustomPreconditioner for TwoStage {
    fn fits(&self, matrix: &Matrix) -> bool {
        Rc::ptr_eq(self.normal.matrix.pattern(), matrix.pattern())
    }

    fn assemble(&mut self, system: &mut dyn MultigridHints, stage: &Stage, _: Reuse) -> Result<()> {
        self.assembled = Some(system.source_at(stage, self.normal.terms));
        system.jacobian_into(stage, self.normal.terms, &mut self.normal.matrix)?;
        let Some(friction) = &mut self.friction else { return Ok(()) };
        system.jacobian_into(stage, friction.terms, &mut friction.matrix)?;
        system.contact_normals(&mut self.normals)?;
        friction.matrix.hold_directions(&self.normals, Self::HOLD)
    }

    fn prepare(&mut self, matrix: &Matrix, _: Option<&Rc<MatrixSource>>, reuse: Reuse) -> Result<()> {
        self.operator = Some(matrix.share()?);
        if reuse == Reuse::Renew {
            self.renewed.clone_from(&self.assembled);
        }
        self.normal.prepare(reuse)?;
        self.friction.as_mut().map_or(Ok(()), |half| half.prepare(reuse))
    }

    fn apply(&mut self, r: &Vector, z: &mut Vector) -> Result<()> {
        let operator = self.operator.as_ref().ok_or_else(|| Error::internal("two_stage without operator"))?;
        let first = self.normal.solve(r, z)?;
        operator.multiply(z, &mut self.residual)?;
        self.residual.aypx(-1.0, r)?;
        let second = self.friction.as_mut().unwrap_or(&mut self.normal);
        let second = second.solve(&self.residual, &mut self.correction)?;
        let (Some(first), Some(second)) = (first, second) else {
            z.set(f64::NAN);
            return Ok(());
        };
        self.iterations += first + second;
        z.axpy(1.0, &self.correction)
    }

    fn take_iterations(&mut self) -> u32 {
        std::mem::take(&mut self.iterations)
    }

    fn state(&self, sources: &mut Sources) -> Value {
        let mut number =
            |source: &Option<Rc<MatrixSource>>| source.as_ref().map(|source| sources.matrix(source));
        json!(TwoStageState { assembled: number(&self.assembled), renewed: number(&self.renewed) })
    }

    fn resume(&mut self, state: &Value, sources: &Sources, system: &mut dyn MultigridHints) -> Result<()> {
        let TwoStageState { assembled, renewed } = stored(state)?;
        for (number, reuse) in [(renewed, Reuse::Renew), (assembled, Reuse::Keep)] {
            let Some(number) = number else { continue };
            let source = source_of(sources, number)?;
            let stage = system.assemble_again(source)?;
            self.assemble(system, &stage, reuse)?;
            self.prepare(system.matrix(), None, reuse)?;
        }
        let source =
            |number: Option<usize>| number.map(|number| source_of(sources, number).cloned()).transpose();
        self.assembled = source(assembled)?;
        self.renewed = source(renewed)?;
        Ok(())
    }
}
