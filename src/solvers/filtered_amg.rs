//! Multigrid on bodies with softened contact joints, combined with a factorisation of the true
//! contact (theory, section 6.4).
//!
//! The penalty couples a thin layer with entries far above those of the bulk, and aggregation fails
//! on them. Let W be nodes in contact or in ties: those of both sides if at most four ranks own one,
//! otherwise those of the contactor. One application to `r`, with the residual of the full operator
//! `K` in between, has three parts:
//!
//! 1. solve with the part of `K` on W, in the first case exactly, in the second by overlapping
//!    pieces;
//! 2. one cycle of multigrid with rigid-body modes on the matrix of the bodies, joined in contact
//!    by springs at most as stiff as an element;
//! 3. solve on W again.
//!
//! The springs prevent the iterations from growing with the mesh. Without them the cycle separates
//! the bodies, and W repairs that only over its depth. For long waves a joint as stiff as an element
//! is as good as a rigid one. So W needs no layer around the contact: with two the iterations are
//! fewer, but its factors cost more than these iterations. With both sides in W the iterations are
//! fewer than with the contactor, but pieces of both sides cost more than these iterations, and
//! fail at stiff penalties ([`super::zone`], docs/performance/large-problems.md).
//!
//! The interpolation is built from the bodies alone, before they are joined, so every aggregate
//! lies on one side of a contact. The coarse matrices are those of the joined bodies. They
//! therefore contain the joint as it is, whether it sticks, slips or opens, and no coarse level
//! ties sliding bodies.
//!
//! The interpolation is kept as long as the bodies remain. The matrices on the levels are kept
//! until a twentieth of the points changes its status, or an iteration gains less. W is factorised for
//! every matrix.

use std::rc::Rc;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::joined::{diagonal_of_inertia, hold_floating};
use super::own::{CustomPreconditioner, Origin, source_of, stored};
use super::zone::{Zone, ZoneState};
use crate::dynamics::{ContactCounts, MatrixSource, MultigridHints, Sources, Stage};
use crate::error::{Error, Result};
use crate::petsc::{Event, Format, KrylovSolver, Matrix, Reuse, SharedOperator, Vector};
use crate::terms::Terms;

/// The bodies with joints in place of contact, and their multigrid.
struct Bulk {
    matrix: Matrix,
    krylov: KrylovSolver,
    /// Slipping part of the closed points: when the matrix was assembled, and now.
    slipping: [f64; 2],
    /// Changes of status since the matrix was assembled, relative to the closed points.
    turned: f64,
    /// `da/du` and spring of the matrix; `None` before the first assembly.
    made_for: Option<[f64; 2]>,
    /// Whether the matrix was assembled since the last setup.
    changed: bool,
    /// Whether to build the interpolation, for the first time or again. The first solve with the
    /// present one was poor, possibly because it belongs to an unusual iterate.
    poor: bool,
    /// Source of the interpolation, and of the matrix.
    interpolated: Option<Rc<MatrixSource>>,
    joined: Option<Rc<MatrixSource>>,
    set_up: Event,
    renewal: Event,
    cycle: Event,
}

/// The state of the bulk that outlives a solve. Sources are given by their numbers.
#[derive(Serialize, Deserialize)]
struct BulkState {
    slipping: [f64; 2],
    turned: f64,
    made_for: Option<[f64; 2]>,
    changed: bool,
    poor: bool,
    interpolated: Option<usize>,
    joined: Option<usize>,
}

/// The state of the preconditioner that outlives a solve.
#[derive(Serialize, Deserialize)]
struct FilteredAmgState {
    bulk: BulkState,
    zone: ZoneState,
}

impl Bulk {
    /// Prefix of PETSc's options for the multigrid.
    const PREFIX: &str = "bulk_";
    /// One W-cycle, whose coarse levels are a seventh of the work.
    ///
    /// The threshold prevents stored zeros, which are reserved for contact, from joining nodes of
    /// two bodies. Bounds of the smoothers are estimated for each matrix, because PETSc would
    /// otherwise take those from the interpolation.
    const OPTIONS: [(&str, &str); 6] = [
        ("ksp_type", "preonly"),
        ("pc_type", "gamg"),
        ("pc_gamg_threshold", "0.0"),
        ("pc_gamg_reuse_interpolation", "true"),
        ("pc_gamg_use_sa_esteig", "false"),
        ("pc_mg_cycle_type", "w"),
    ];
    /// The matrix is assembled again when this part of the contact points has changed to slip,
    /// stick or open. Their joints are then different.
    const TURNED: f64 = 0.05;
    /// Factor by which the weight of inertia may change before the matrix is assembled again.
    const RANGE: f64 = 2.0;

    fn new(origin: &Origin) -> Result<Self> {
        let krylov = KrylovSolver::new(origin.session, Self::PREFIX)?;
        let mut matrix = origin.like.like_stored_as(Format::Aij)?;
        matrix.ungroup_rows()?;
        let [set_up, renewal, cycle] =
            ["SolverSetUp", "BulkHierarchy", "BulkCycle"].map(|name| Event::register(origin.session, name));
        Ok(Self {
            matrix,
            krylov,
            slipping: [0.0; 2],
            turned: 0.0,
            made_for: None,
            changed: false,
            poor: true,
            interpolated: None,
            joined: None,
            set_up: set_up?,
            renewal: renewal?,
            cycle: cycle?,
        })
    }

    /// Records how many points have changed their status.
    fn note_contacts(&mut self, contact: &ContactCounts) {
        let part = |points: u64| points as f64 / contact.closed.max(1) as f64;
        self.turned += part(contact.changed);
        self.slipping[1] = part(contact.slip);
    }

    /// Whether the matrix can be used at the stage.
    fn serves(&self, wanted: [f64; 2]) -> bool {
        // The first iterate of a step has no predecessor from which points could have changed.
        let [made, now] = self.slipping;
        self.turned.max((made - now).abs()) <= Self::TURNED
            && self.made_for.is_some_and(|made| {
                made.iter().zip(wanted).all(|(&made, wanted)| {
                    made == wanted
                        || (made > 0.0 && (Self::RANGE.recip()..=Self::RANGE).contains(&(wanted / made)))
                })
            })
    }

    fn assemble(
        &mut self,
        system: &mut dyn MultigridHints,
        stage: &Stage,
        layout: &Vector,
        reuse: Reuse,
    ) -> Result<()> {
        let wanted =
            [if stage.inertia { stage.shifts.acceleration } else { 0.0 }, system.continuation().spring];
        if reuse == Reuse::Keep && self.serves(wanted) {
            return Ok(());
        }
        let source = system.source_at(stage, Terms::BODIES);
        let inertia = diagonal_of_inertia(system, stage, &mut self.matrix, layout)?;
        if std::mem::take(&mut self.poor) {
            self.interpolate(system, stage, &inertia)?;
            self.interpolated = Some(Rc::clone(&source));
        }
        self.join(system, stage, &inertia)?;
        self.joined = Some(source);
        self.turned = 0.0;
        self.slipping[0] = self.slipping[1];
        self.made_for = Some(wanted);
        self.changed = true;
        Ok(())
    }

    /// Builds the interpolation from the bodies alone.
    fn interpolate(
        &mut self,
        system: &mut dyn MultigridHints,
        stage: &Stage,
        inertia: &Vector,
    ) -> Result<()> {
        system.jacobian_into(stage, Terms::BODIES, &mut self.matrix)?;
        hold_floating(system, &mut self.matrix, inertia)?;
        // A reset is not sufficient: the levels of PETSc 3.18 keep their sizes.
        self.krylov.configure(&Self::OPTIONS)?;
        self.set_up()
    }

    /// Assembles the matrix of the joined bodies.
    fn join(&mut self, system: &mut dyn MultigridHints, stage: &Stage, inertia: &Vector) -> Result<()> {
        system.joined_bodies_into(stage, &mut self.matrix)?;
        hold_floating(system, &mut self.matrix, inertia)
    }

    fn state(&self, sources: &mut Sources) -> BulkState {
        let mut number =
            |source: &Option<Rc<MatrixSource>>| source.as_ref().map(|source| sources.matrix(source));
        BulkState {
            slipping: self.slipping,
            turned: self.turned,
            made_for: self.made_for,
            changed: self.changed,
            poor: self.poor,
            interpolated: number(&self.interpolated),
            joined: number(&self.joined),
        }
    }

    fn resume(
        &mut self,
        state: &BulkState,
        sources: &Sources,
        system: &mut dyn MultigridHints,
        layout: &Vector,
    ) -> Result<()> {
        if let (Some(interpolated), Some(joined)) = (state.interpolated, state.joined) {
            let source = source_of(sources, interpolated)?;
            let stage = system.assemble_again(source)?;
            let inertia = diagonal_of_inertia(system, &stage, &mut self.matrix, layout)?;
            self.interpolate(system, &stage, &inertia)?;
            self.interpolated = Some(Rc::clone(source));
            let source = source_of(sources, joined)?;
            let stage = system.assemble_again(source)?;
            let inertia = diagonal_of_inertia(system, &stage, &mut self.matrix, layout)?;
            self.join(system, &stage, &inertia)?;
            self.set_up()?;
            self.joined = Some(Rc::clone(source));
        }
        self.slipping = state.slipping;
        self.turned = state.turned;
        self.made_for = state.made_for;
        self.changed = state.changed;
        self.poor = state.poor;
        Ok(())
    }

    /// Sets up the levels for the current matrix. Builds the interpolation if there is none yet.
    fn set_up(&mut self) -> Result<()> {
        let (_set_up, _renewal) = (self.set_up.begin(), self.renewal.begin());
        self.krylov.set_operators(&self.matrix, &self.matrix)?;
        self.krylov.set_up()
    }

    fn prepare(&mut self) -> Result<()> {
        if self.changed { self.set_up() } else { Ok(()) }
    }

    /// Records whether the first solve after a renewal was poor.
    fn learn(&mut self, poor: bool) {
        if std::mem::take(&mut self.changed) {
            self.poor = poor;
        }
    }
}

/// The preconditioner with its matrices.
pub struct FilteredAmg {
    bulk: Bulk,
    zone: Zone,
    operator: Option<SharedOperator>,
    residual: Vector,
    correction: Vector,
}

impl FilteredAmg {
    /// Creates a preconditioner whose matrices are still zero. Collective.
    ///
    /// # Errors
    /// If memory is insufficient.
    pub fn new(origin: &Origin) -> Result<Self> {
        Ok(Self {
            bulk: Bulk::new(origin)?,
            zone: Zone::new(origin.session)?,
            operator: None,
            residual: origin.pattern.like()?,
            correction: origin.pattern.like()?,
        })
    }
}

impl CustomPreconditioner for FilteredAmg {
    fn fits(&self, matrix: &Matrix) -> bool {
        Rc::ptr_eq(self.bulk.matrix.pattern(), matrix.pattern())
    }

    fn note_contacts(&mut self, contact: &ContactCounts) {
        self.bulk.note_contacts(contact);
    }

    fn assemble(&mut self, system: &mut dyn MultigridHints, stage: &Stage, reuse: Reuse) -> Result<()> {
        self.zone.observe(system);
        self.bulk.assemble(system, stage, &self.residual, reuse)
    }

    fn prepare(&mut self, matrix: &Matrix, source: Option<&Rc<MatrixSource>>, _: Reuse) -> Result<()> {
        self.operator = Some(matrix.share()?);
        self.zone.prepare(matrix, source)?;
        self.bulk.prepare()
    }

    fn apply(&mut self, r: &Vector, z: &mut Vector) -> Result<()> {
        let Self { bulk, zone, operator, residual, correction } = self;
        let operator = operator.as_ref().ok_or_else(|| Error::internal("multigrid without operator"))?;
        let mut well = true;
        if zone.is_there() {
            well &= zone.begin(operator, r, z, residual)?;
        } else {
            z.set(0.0);
            residual.aypx(0.0, r)?;
        }
        let Bulk { krylov, cycle, .. } = bulk;
        well &= cycle.time(|| krylov.solve(residual, correction))?.converged();
        z.axpy(1.0, correction)?;
        if zone.is_there() {
            well &= zone.correct_residual(r, z)?;
        }
        if !well {
            z.set(f64::NAN);
        }
        Ok(())
    }

    fn take_iterations(&mut self) -> u32 {
        self.zone.take_iterations()
    }

    fn learn(&mut self, poor: bool) {
        self.bulk.learn(poor);
    }

    fn state(&self, sources: &mut Sources) -> Value {
        json!(FilteredAmgState { bulk: self.bulk.state(sources), zone: self.zone.state(sources) })
    }

    fn resume(&mut self, state: &Value, sources: &Sources, system: &mut dyn MultigridHints) -> Result<()> {
        let FilteredAmgState { bulk, zone } = stored(state)?;
        self.bulk.resume(&bulk, sources, system, &self.residual)?;
        self.zone.resume(&zone, sources);
        Ok(())
    }
}
