//! Multigrid that sees contact as soft joints, and a factorisation that sees it as it is (formulation, section 12).
//!
//! Penalty couples a thin layer with entries far above those of the bulk, on which aggregation breaks. So let W be the
//! nodes of facets in contact and of some element layers around them. One application to `r`, with the residual of the
//! full operator `K` in between: exact solve with the part of `K` on W; one cycle of multigrid with rigid-body modes
//! on the matrix of the bodies, joined where they touch by springs no stiffer than an element; exact solve on W again.
//!
//! The springs are what keeps the iterations from growing with the mesh: without them the cycle parts the bodies, and
//! what W repairs over its depth of `l` elements of size `h` has the condition `1 + L / (l h)` of two overlapping
//! subdomains. To long waves a joint as stiff as an element is as good as a rigid one. Sticking and slipping change the
//! springs little, so the hierarchy serves for many iterations and steps; W is a surface, its factors are renewed with
//! every matrix.

use super::own::{Origin, Own};
use super::zone::Zone;
use crate::dynamics::{Dynamics, Stage};
use crate::error::{Error, Result};
use crate::petsc::{Event, Format, Krylov, Matrix, Operator, Reuse, SharedOperator, Vector};
use crate::terms::Terms;
use std::rc::Rc;

/// When the solve on W takes place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Passes {
    /// Before the cycle of multigrid and after it.
    #[default]
    Around,
    /// Only before it: cheaper, and worse by a third.
    Before,
}

/// What the case says of the preconditioner.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FilteredAmgSettings {
    /// Element layers of W around the facets in contact.
    pub layers: u32,
    /// When W is solved on.
    pub passes: Passes,
}

impl Default for FilteredAmgSettings {
    fn default() -> Self {
        Self { layers: 2, passes: Passes::Around }
    }
}

/// The bodies with joints for contacts, and multigrid for them.
struct Bulk {
    matrix: Matrix,
    krylov: Krylov,
    /// One cycle.
    options: [(&'static str, &'static str); 4],
    /// `da/du` and spring of the matrix; `None` before there is one.
    made_for: Option<[f64; 2]>,
    /// Assembled since the last set-up.
    changed: bool,
    /// The first solve after that was poor: the interpolation may be of an odd matrix.
    poor: bool,
    renewal: Event,
    cycle: Event,
}

/// The preconditioner with its matrices.
pub struct FilteredAmg {
    passes: Passes,
    bulk: Bulk,
    zone: Zone,
    operator: Option<SharedOperator>,
    residual: Vector,
    correction: Vector,
}

impl Bulk {
    /// Prefix of PETSc's options for the multigrid.
    const PREFIX: &str = "bulk_";
    /// Threshold of couplings by which nodes are aggregated: it keeps stored zeros, places for contact to come, from joining
    /// nodes of two bodies.
    const THRESHOLD: &str = "0.0";
    /// The same where all slides freely: aggregates stay on their side of a joint, or sliding would be tied on the coarse
    /// levels.
    const SLIDING_THRESHOLD: &str = "0.04";
    /// Spring on the unknowns of a floating body, over the diagonal entry, what inertia gives included.
    const SHIFT: f64 = 1e-4;
    /// The weight of inertia may change by this factor before the matrix is assembled anew.
    const RANGE: f64 = 2.0;

    fn new(origin: &Origin, sliding: bool) -> Result<Self> {
        let mut krylov = Krylov::new(origin.session, Self::PREFIX)?;
        let options = [
            ("ksp_type", "preonly"),
            ("pc_type", "gamg"),
            ("pc_gamg_threshold", if sliding { Self::SLIDING_THRESHOLD } else { Self::THRESHOLD }),
            ("pc_gamg_reuse_interpolation", "true"),
        ];
        krylov.configure(&options)?;
        let mut matrix = origin.like.like_stored_as(Format::Aij)?;
        matrix.ungroup_rows()?;
        let renewal = Event::register(origin.session, "BulkHierarchy")?;
        let cycle = Event::register(origin.session, "BulkCycle")?;
        Ok(Self { matrix, krylov, options, made_for: None, changed: false, poor: false, renewal, cycle })
    }

    /// Whether the matrix serves at the stage.
    fn serves(&self, wanted: [f64; 2]) -> bool {
        self.made_for.is_some_and(|made| {
            made.iter().zip(wanted).all(|(&made, wanted)| {
                made == wanted
                    || (made > 0.0 && (Self::RANGE.recip()..=Self::RANGE).contains(&(wanted / made)))
            })
        })
    }

    fn assemble(
        &mut self,
        (system, stage): (&mut dyn Dynamics, &Stage),
        layout: &Vector,
        reuse: Reuse,
    ) -> Result<()> {
        let wanted = [if stage.inertia { stage.shifts.acceleration } else { 0.0 }, stage.holding];
        if reuse == Reuse::Keep && self.serves(wanted) {
            return Ok(());
        }
        let mut inertia = layout.like()?;
        if wanted[0] > 0.0 {
            system.jacobian_into(stage, Terms::MASS, &mut self.matrix)?;
            self.matrix.diagonal(&mut inertia)?;
        }
        system.joined_bodies_into(stage, &mut self.matrix)?;
        self.hold_floating(system, &inertia)?;
        self.made_for = Some(wanted);
        self.changed = true;
        Ok(())
    }

    /// Springs for what nothing but contact holds, which may slide or be open.
    fn hold_floating(&mut self, system: &dyn Dynamics, inertia: &Vector) -> Result<()> {
        let floats = system.floating_nodes();
        let mut diagonal = inertia.like()?;
        self.matrix.diagonal(&mut diagonal)?;
        let (diagonal, inertia, size) = (diagonal.owned(), inertia.owned(), self.matrix.block_size());
        self.matrix.fill(|values| {
            for dof in (0..diagonal.len()).filter(|dof| floats[dof / size]) {
                values.add_diagonal(dof, (Self::SHIFT * diagonal[dof] - inertia[dof]).max(0.0));
            }
        })
    }

    fn prepare(&mut self) -> Result<()> {
        if !self.changed {
            return Ok(());
        }
        let _running = self.renewal.begin();
        if std::mem::take(&mut self.poor) {
            // Resetting is not enough: PETSc's (3.18) levels keep their sizes.
            self.krylov.configure(&self.options)?;
        }
        self.krylov.set_operators(&self.matrix, &self.matrix)?;
        self.krylov.set_up()
    }

    /// Hears how the first solve after a renewal went.
    fn learn(&mut self, poor: bool) {
        if std::mem::take(&mut self.changed) {
            self.poor = poor;
        }
    }
}

impl FilteredAmg {
    /// A preconditioner whose matrices are still zero, of a problem without friction where all is `sliding`. Collective.
    ///
    /// # Errors
    /// No memory.
    pub fn new(origin: &Origin, settings: FilteredAmgSettings, sliding: bool) -> Result<Self> {
        Ok(Self {
            passes: settings.passes,
            bulk: Bulk::new(origin, sliding)?,
            zone: Zone::new(origin.session, settings.layers)?,
            operator: None,
            residual: origin.pattern.like()?,
            correction: origin.pattern.like()?,
        })
    }
}

impl Own for FilteredAmg {
    fn fits(&self, matrix: &Matrix) -> bool {
        Rc::ptr_eq(self.bulk.matrix.pattern(), matrix.pattern())
    }

    fn assemble(&mut self, system: &mut dyn Dynamics, stage: &Stage, reuse: Reuse) -> Result<()> {
        self.zone.observe(system.contact_nodes());
        self.bulk.assemble((system, stage), &self.residual, reuse)
    }

    fn prepare(&mut self, matrix: &Matrix, _: Reuse) -> Result<()> {
        self.operator = Some(matrix.share()?);
        self.zone.prepare(matrix)?;
        self.bulk.prepare()
    }

    fn apply(&mut self, r: &Vector, z: &mut Vector) -> Result<()> {
        let Self { passes, bulk, zone, operator, residual, correction } = self;
        let operator = operator.as_ref().ok_or_else(|| Error::internal("multigrid without operator"))?;
        z.set(0.0);
        residual.aypx(0.0, r)?;
        let mut well = true;
        if zone.is_there() {
            well &= zone.correct(residual, z)?;
            operator.multiply(z, residual)?;
            residual.aypx(-1.0, r)?;
        }
        let Bulk { krylov, cycle, .. } = bulk;
        well &= cycle.time(|| krylov.solve(residual, correction))?.converged();
        z.axpy(1.0, correction)?;
        if zone.is_there() && *passes == Passes::Around {
            operator.multiply(z, residual)?;
            residual.aypx(-1.0, r)?;
            well &= zone.correct(residual, z)?;
        }
        if !well {
            z.set(f64::NAN);
        }
        Ok(())
    }

    fn learn(&mut self, poor: bool) {
        self.bulk.learn(poor);
    }
}
