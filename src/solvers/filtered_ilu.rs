//! Incomplete factors and a coarse space of bodies with softened contact joints, combined with a
//! factorisation of the true contact (theory, section 6.4).
//!
//! ILU(0) has no fill between the two sides of a contact. A contact that is stiffer than the elements
//! therefore costs iterations: the more, the stiffer it is and the finer the mesh. Let A be the
//! matrix of the bodies, joined by springs at most as stiff as an element as in
//! [`super::filtered_amg`], and W the nodes in contact or in ties ([`super::zone`]). One application
//! to `r` has three parts:
//!
//! 1. a correction in the [coarse space](super::coarse) of A;
//! 2. incomplete factors of A on overlapping subdomains, with the residual of A;
//! 3. a solve on W with the residual of `K`, which takes the rows of `K` on W alone.
//!
//! The first part reduces errors that are smooth over many elements, the second those that vary from
//! node to node, and the third those against the penalty. So the iterations grow little with the mesh
//! and hardly depend on the penalty.
//!
//! If W has the nodes of the contactor alone, a solve on W comes first as well. Otherwise the soft
//! joints would answer a force of the penalty by large motions of both sides, and W would repair
//! those of one.
//!
//! ILU(0) of nearly incompressible bodies fails, so in A they have a smaller bulk modulus. The iterations
//! then grow with the bulk modulus.
//!
//! All factors are made and kept together. The diagonal blocks of `K` show when they no longer fit
//! ([`super::diagonal`]). If the factors are made again while the tangent is kept, A and W are those of
//! the present iterate.

use std::rc::Rc;

use mpi::collective::SystemOperation;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::coarse::CoarseSpace;
use super::joined::{diagonal_of_inertia, hold_floating};
use super::own::{CustomPreconditioner, Origin, source_of, stored};
use super::subdomain::Subdomain;
use super::zone::Zone;
use crate::collective::Collective;
use crate::dynamics::{MatrixSource, MultigridHints, Sources, Stage};
use crate::error::{Error, Result};
use crate::petsc::{Matrix, Operator, Reuse, Session, SharedOperator, Vector};
use crate::terms::Terms;

/// The state that outlives a solve: the number of the source.
#[derive(Serialize, Deserialize)]
struct FilteredIluState {
    made_for: Option<usize>,
}

/// The preconditioner with its factors.
pub struct FilteredIlu {
    session: Rc<Session>,
    /// Matrix of the joined bodies.
    joined: Matrix,
    /// Source of this matrix and of the nodes of W.
    made_for: Option<Rc<MatrixSource>>,
    subdomain: Subdomain,
    /// `None` before the first assembly, and if there are too few nodes for one.
    coarse: Option<CoarseSpace>,
    /// Whether a body floats on any rank; `None` before the first assembly.
    floats: Option<bool>,
    zone: Zone,
    /// `K`; known after the first solve has started.
    operator: Option<SharedOperator>,
    residual: Vector,
    correction: Vector,
    further: Vector,
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
            session: Rc::clone(origin.session),
            joined,
            made_for: None,
            subdomain,
            coarse: None,
            floats: None,
            zone: Zone::new(origin.session)?,
            operator: None,
            residual: origin.pattern.like()?,
            correction: origin.pattern.like()?,
            further: origin.pattern.like()?,
        })
    }

    /// Builds the coarse space, and finds out whether bodies float. Collective.
    fn begin(&mut self, system: &mut dyn MultigridHints) -> Result<bool> {
        if let Some(floats) = self.floats {
            return Ok(floats);
        }
        if let Some(nodes) = system.body_nodes() {
            self.coarse = CoarseSpace::new(&self.session, self.joined.pattern(), &nodes)?;
        }
        let mut any = 0u8;
        let own = u8::from(system.floating_nodes().contains(&true));
        self.session.world().reduce_all(&own, &mut any, SystemOperation::max());
        Ok(*self.floats.insert(any > 0))
    }

    /// Observes W and assembles the matrix of the joined bodies. Collective.
    fn renew(&mut self, system: &mut dyn MultigridHints, stage: &Stage) -> Result<()> {
        self.zone.observe(system);
        if !self.begin(system)? {
            return system.joined_bodies_into(stage, &mut self.joined);
        }
        let inertia = diagonal_of_inertia(system, stage, &mut self.joined, &self.residual)?;
        system.joined_bodies_into(stage, &mut self.joined)?;
        hold_floating(system, &mut self.joined, &inertia)
    }
}

impl CustomPreconditioner for FilteredIlu {
    fn fits(&self, matrix: &Matrix) -> bool {
        self.subdomain.fits(matrix)
    }

    fn assemble(&mut self, system: &mut dyn MultigridHints, stage: &Stage, reuse: Reuse) -> Result<()> {
        if reuse == Reuse::Renew {
            self.renew(system, stage)?;
            self.made_for = Some(system.source_at(stage, Terms::BODIES));
        }
        Ok(())
    }

    fn prepare(&mut self, matrix: &Matrix, source: Option<&Rc<MatrixSource>>, reuse: Reuse) -> Result<()> {
        self.operator = Some(matrix.share()?);
        if reuse == Reuse::Renew {
            self.zone.prepare(matrix, source)?;
            self.subdomain.renew(&self.joined)?;
            if let Some(coarse) = &mut self.coarse {
                coarse.project(&self.joined)?;
            }
        }
        Ok(())
    }

    fn apply(&mut self, r: &Vector, z: &mut Vector) -> Result<()> {
        let Self { joined, subdomain, coarse, zone, operator, residual, correction, further, .. } = self;
        let mut well = true;
        if zone.has_one_side() {
            let operator = operator.as_ref().ok_or_else(|| Error::internal("factors without a matrix"))?;
            well &= zone.begin(operator, r, z, residual)?;
        } else {
            z.set(0.0);
            residual.aypx(0.0, r)?;
        }
        if let Some(coarse) = coarse {
            well &= coarse.solve(residual, correction)?;
            z.axpy(1.0, correction)?;
            joined.multiply(correction, further)?;
            residual.axpy(-1.0, further)?;
        }
        subdomain.apply(residual, correction);
        z.axpy(1.0, correction)?;
        well &= zone.correct_residual(r, z)?;
        if !well {
            z.set(f64::NAN);
        }
        Ok(())
    }

    fn take_iterations(&mut self) -> u32 {
        self.zone.take_iterations()
    }

    fn state(&self, sources: &mut Sources) -> Value {
        json!(FilteredIluState { made_for: self.made_for.as_ref().map(|source| sources.matrix(source)) })
    }

    fn resume(&mut self, state: &Value, sources: &Sources, system: &mut dyn MultigridHints) -> Result<()> {
        let FilteredIluState { made_for } = stored(state)?;
        if let Some(number) = made_for {
            let source = source_of(sources, number)?;
            let stage = system.assemble_again(source)?;
            self.renew(system, &stage)?;
            self.made_for = Some(Rc::clone(source));
        }
        Ok(())
    }
}
