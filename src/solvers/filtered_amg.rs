//! Multigrid that does not see contact, and a factorisation that sees nothing else (formulation, section 12).
//!
//! Penalty couples a thin layer with entries far above those of the bulk, on which aggregation breaks. So let W be the
//! nodes of facets in contact and of some element layers around them. One application to `r`, with the residual of the
//! full operator `K` in between: exact solve with the part of `K` on W; one cycle of multigrid with rigid-body modes
//! on the matrix of the bodies without their contacts; exact solve on W again. The hierarchy does not know contact,
//! hence serves for many iterations and steps; W is a surface, its factors are renewed with every matrix.

use super::own::{Origin, Own};
use super::zone::Zone;
use crate::dynamics::{Dynamics, Stage};
use crate::error::{Error, Result};
use crate::petsc::{Format, Krylov, Matrix, Operator, Reuse, SharedOperator, Vector};
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

/// The bodies without their contacts, and multigrid for them.
struct Bulk {
    matrix: Matrix,
    krylov: Krylov,
    /// `da/du` and spring of the matrix; `None` before there is one.
    made_for: Option<[f64; 2]>,
    /// Assembled since the last set-up.
    changed: bool,
    /// Digits an iteration gained after the interpolation was made, and after the last renewal of the values.
    digits: [f64; 2],
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
    /// One cycle. The threshold keeps stored zeros, places for contact, from joining nodes of two bodies.
    const OPTIONS: [(&str, &str); 4] = [
        ("ksp_type", "preonly"),
        ("pc_type", "gamg"),
        ("pc_gamg_threshold", "0.0"),
        ("pc_gamg_reuse_interpolation", "true"),
    ];
    /// Spring on the unknowns of a floating body, over the diagonal entry, what inertia gives included.
    const SHIFT: f64 = 1e-3;
    /// The weight of inertia may change by this factor before the matrix is assembled anew.
    const RANGE: f64 = 2.0;
    /// The interpolation is made anew when an iteration gains less than this part of what it gained at first.
    const WORTH: f64 = 0.6;

    fn new(origin: &Origin) -> Result<Self> {
        let mut krylov = Krylov::new(origin.session, Self::PREFIX)?;
        krylov.configure(&Self::OPTIONS)?;
        let mut matrix = origin.like.like_stored_as(Format::Aij)?;
        matrix.ungroup_rows()?;
        Ok(Self { matrix, krylov, made_for: None, changed: false, digits: [0.0; 2] })
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
        system.jacobian_into(stage, Terms::BODIES, &mut self.matrix)?;
        self.hold_floating(system, &inertia)?;
        self.made_for = Some(wanted);
        self.changed = true;
        Ok(())
    }

    /// Springs for what nothing but contact holds.
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
        let [first, last] = self.digits;
        if last < Self::WORTH * first {
            self.krylov.reset()?;
            self.digits = [0.0; 2];
        }
        self.krylov.set_operators(&self.matrix, &self.matrix)?;
        self.krylov.set_up()
    }

    /// Hears how the first solve after a renewal went.
    fn learn(&mut self, digits: f64) {
        if std::mem::take(&mut self.changed) {
            self.digits = [if self.digits[0] > 0.0 { self.digits[0] } else { digits }, digits];
        }
    }
}

impl FilteredAmg {
    /// A preconditioner whose matrices are still zero. Collective.
    ///
    /// # Errors
    /// No memory.
    pub fn new(origin: &Origin, settings: FilteredAmgSettings) -> Result<Self> {
        Ok(Self {
            passes: settings.passes,
            bulk: Bulk::new(origin)?,
            zone: Zone::new(origin.session, settings.layers),
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
        well &= bulk.krylov.solve(residual, correction)?.converged();
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

    fn learn(&mut self, digits: f64) {
        self.bulk.learn(digits);
    }
}
