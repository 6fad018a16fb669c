//! Incomplete factors of bodies with softened contact joints, combined with a factorisation of the
//! true contact (theory, section 6.4).
//!
//! ILU(0) has no fill between the two sides of a contact. A contact that is stiffer than the elements
//! therefore costs iterations: the more, the stiffer it is and the finer the mesh. Let M be the
//! factors of the bodies, joined by springs at most as stiff as an element as in
//! [`super::filtered_amg`], and W the nodes in contact or in ties ([`super::zone`]). One application
//! to `r` has two parts:
//!
//! 1. `z = M^-1 r`, on overlapping subdomains;
//! 2. a solve on W with the residual `r - K z`, which takes the rows of `K` on W alone.
//!
//! If W has the nodes of the contactor alone, a solve on W comes first as well. Otherwise the soft
//! joints would answer a force of the penalty by large motions of both sides, and W would repair
//! those of one. On 8 ranks a penalty of 1e5 E / h took 87 iterations without it and takes 28.
//!
//! The iterations that remain are those of the bodies. They do not grow with the mesh if inertia
//! dominates the matrix. If stiffness dominates, they do, and multigrid is better.
//!
//! All factors are made for one matrix and are kept together. The diagonal blocks of `K` show when
//! they no longer fit ([`super::diagonal`]), so this preconditioner has no state of its own.

use std::rc::Rc;

use serde_json::Value;

use super::own::{CustomPreconditioner, Origin};
use super::subdomain::Subdomain;
use super::zone::Zone;
use crate::dynamics::{MatrixSource, MultigridHints, Sources, Stage};
use crate::error::{Error, Result};
use crate::petsc::{Matrix, Operator, Reuse, SharedOperator, Vector};

/// The preconditioner with its factors.
pub struct FilteredIlu {
    /// Matrix of the joined bodies.
    joined: Matrix,
    subdomain: Subdomain,
    zone: Zone,
    /// `K`; known after the first solve has started.
    operator: Option<SharedOperator>,
    residual: Vector,
    correction: Vector,
}

impl FilteredIlu {
    /// Creates a preconditioner without factors. Collective.
    ///
    /// # Errors
    /// If memory is insufficient.
    pub fn new(origin: &Origin) -> Result<Self> {
        let joined = origin.like.like()?;
        let subdomain = Subdomain::new(origin.session, &joined)?;
        Ok(Self {
            joined,
            subdomain,
            zone: Zone::new(origin.session)?,
            operator: None,
            residual: origin.pattern.like()?,
            correction: origin.pattern.like()?,
        })
    }
}

impl CustomPreconditioner for FilteredIlu {
    fn fits(&self, matrix: &Matrix) -> bool {
        self.subdomain.fits(matrix)
    }

    fn assemble(&mut self, system: &mut dyn MultigridHints, stage: &Stage, reuse: Reuse) -> Result<()> {
        if reuse == Reuse::Renew {
            self.zone.observe(system);
            system.joined_bodies_into(stage, &mut self.joined)?;
        }
        Ok(())
    }

    fn prepare(&mut self, matrix: &Matrix, source: Option<&Rc<MatrixSource>>, reuse: Reuse) -> Result<()> {
        self.operator = Some(matrix.share()?);
        if reuse == Reuse::Renew {
            self.zone.prepare(matrix, source)?;
            self.subdomain.renew(&self.joined)?;
        }
        Ok(())
    }

    fn apply(&mut self, r: &Vector, z: &mut Vector) -> Result<()> {
        let Self { subdomain, zone, operator, residual, correction, .. } = self;
        let mut well = true;
        if zone.has_one_side() {
            let operator = operator.as_ref().ok_or_else(|| Error::internal("factors without a matrix"))?;
            z.set(0.0);
            well &= zone.correct(r, z)?;
            operator.multiply(z, residual)?;
            residual.aypx(-1.0, r)?;
            subdomain.apply(residual, correction);
            z.axpy(1.0, correction)?;
        } else {
            subdomain.apply(r, z);
        }
        well &= zone.correct_residual(r, z)?;
        if !well {
            z.set(f64::NAN);
        }
        Ok(())
    }

    fn take_iterations(&mut self) -> u32 {
        self.zone.take_iterations()
    }

    fn state(&self, _: &mut Sources) -> Value {
        Value::Null
    }

    fn resume(&mut self, _: &Value, _: &Sources, _: &mut dyn MultigridHints) -> Result<()> {
        Ok(())
    }
}
