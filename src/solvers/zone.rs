//! The unknowns around the facets in contact, and a factorisation of the matrix on them.

use std::rc::Rc;

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;
use serde::{Deserialize, Serialize};

use super::own::source_of;
use crate::dynamics::{MatrixSource, MultigridHints, Sources};
use crate::error::Result;
use crate::petsc::{BlockPattern, Event, Krylov, Matrix, Operator, Reuse, Session, SubMatrix, Vector};

/// W of the filtered multigrid. It is slightly larger than the facets in contact need, so that it
/// can be kept while they change.
pub(super) struct Zone {
    session: Rc<Session>,
    layers: u32,
    /// Owned nodes currently in contact.
    touching: Vec<bool>,
    /// Owned nodes that may come into contact before W is chosen again.
    covered: Vec<bool>,
    /// Number of nodes in contact when W was chosen, on all ranks.
    chosen_for: u64,
    solver: Option<Solver>,
    /// Source of the matrix that was factorised.
    factorised: Option<Rc<MatrixSource>>,
    /// Whether the factors are those of an earlier matrix.
    kept: bool,
    renewal: Event,
    correction: Event,
}

/// The state of W that outlives a solve. Marks and sources are given by their numbers.
#[derive(Serialize, Deserialize)]
pub(super) struct ZoneState {
    touching: usize,
    covered: usize,
    chosen_for: u64,
    factorised: Option<usize>,
    kept: bool,
}

/// The matrix on W with its factors.
struct Solver {
    part: SubMatrix,
    krylov: Krylov,
    rhs: Vector,
    solution: Vector,
    /// An irregular vector on W, zero elsewhere, and its product with the matrix.
    sample: Vector,
    product: Vector,
    /// Product with the sample and diagonal, on W, of the matrix that was factorised.
    made_of: [Vector; 2],
}

impl Zone {
    /// Prefix of PETSc's options for the solver on W.
    const PREFIX: &str = "filter_";
    const OPTIONS: [(&str, &str); 5] = [
        ("ksp_type", "preonly"),
        ("pc_type", "lu"),
        ("pc_factor_mat_solver_type", "mumps"),
        ("mat_mumps_icntl_7", "5"),
        ("mat_mumps_icntl_14", "50"),
    ];
    /// W is chosen again when contact has shrunk by this factor.
    const SHRUNK: u64 = 4;

    /// Creates an empty W, until nodes in contact are observed.
    ///
    /// # Errors
    /// If PETSc cannot register the phase.
    pub fn new(session: &Rc<Session>, layers: u32) -> Result<Self> {
        let (touching, covered) = (Vec::new(), Vec::new());
        let renewal = Event::register(session, "ZoneFactors")?;
        let correction = Event::register(session, "ZoneSolve")?;
        let session = Rc::clone(session);
        let (chosen_for, solver, kept) = (0, None, false);
        let factorised = None;
        Ok(Self {
            session,
            layers,
            touching,
            covered,
            chosen_for,
            solver,
            factorised,
            kept,
            renewal,
            correction,
        })
    }

    /// Records the owned nodes in contact.
    pub fn observe(&mut self, touching: Vec<bool>) {
        self.touching = touching;
    }

    /// Whether any rank has a node in W.
    pub fn is_there(&self) -> bool {
        self.solver.is_some()
    }

    /// Whether the factors in use are those of an earlier matrix.
    pub fn is_kept(&self) -> bool {
        self.kept
    }

    /// Factorises the part of `matrix` on W, which is chosen again if contact has left it. Factors
    /// of an earlier matrix are kept if `reuse` allows it and the rows of all nodes of W are
    /// unchanged. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails. The solve reports a zero pivot.
    pub fn prepare(
        &mut self,
        matrix: &Matrix,
        source: Option<&Rc<MatrixSource>>,
        reuse: Reuse,
    ) -> Result<()> {
        let left = self
            .touching
            .iter()
            .enumerate()
            .any(|(node, touches)| *touches && !self.covered.get(node).copied().unwrap_or(false));
        let count = self.touching.iter().filter(|touches| **touches).count() as u64;
        let changed = match &mut self.solver {
            Some(solver) => solver.changed(matrix)?,
            None => false,
        };
        let mut total = [0u64; 3];
        let own = [count, u64::from(left), u64::from(changed)];
        self.session.world().all_reduce_into(&own, &mut total, SystemOperation::sum());
        let [count, left, changed] = total;
        let anew = left > 0 || count * Self::SHRUNK < self.chosen_for;
        self.kept = !anew && changed == 0 && reuse == Reuse::Keep && self.is_there();
        if self.kept {
            return Ok(());
        }
        if anew {
            self.choose(matrix, count)?;
        } else if let Some(solver) = &mut self.solver {
            solver.part.extract(matrix)?;
        }
        self.factorised = source.cloned();
        let Some(solver) = &mut self.solver else { return Ok(()) };
        let _running = self.renewal.begin();
        solver.factorise(matrix)
    }

    /// The state that outlives a solve.
    pub fn state(&self, sources: &mut Sources) -> ZoneState {
        ZoneState {
            touching: sources.mark(&self.touching),
            covered: sources.mark(&self.covered),
            chosen_for: self.chosen_for,
            factorised: self.factorised.as_ref().map(|source| sources.matrix(source)),
            kept: self.kept,
        }
    }

    /// Restores the state. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails, or the state is incomplete.
    pub fn resume(
        &mut self,
        state: &ZoneState,
        sources: &Sources,
        system: &mut dyn MultigridHints,
    ) -> Result<()> {
        let marks = |number: usize| sources.marks.get(number).cloned().unwrap_or_default();
        self.touching = marks(state.touching);
        self.covered = marks(state.covered);
        self.chosen_for = state.chosen_for;
        self.kept = state.kept;
        let Some(number) = state.factorised else { return Ok(()) };
        let source = source_of(sources, number)?;
        self.factorised = Some(Rc::clone(source));
        if self.chosen_for == 0 {
            return Ok(());
        }
        system.assemble_again(source)?;
        let matrix = system.matrix();
        let mut grown = Growth::new(&self.session, matrix.pattern(), &self.covered)?;
        // The covered nodes include the first layer.
        for _ in 1..self.layers {
            grown.grow()?;
        }
        self.extract(matrix, &grown)?;
        self.solver.as_mut().map_or(Ok(()), |solver| solver.factorise(matrix))
    }

    /// Computes `z += P (P^T K P)^-1 P^T r`. Returns whether this was possible. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn correct(&mut self, r: &Vector, z: &mut Vector) -> Result<bool> {
        let Some(Solver { part, krylov, rhs, solution, .. }) = &mut self.solver else { return Ok(true) };
        let _running = self.correction.begin();
        part.restrict(r, rhs);
        let outcome = krylov.solve(rhs, solution)?;
        part.add_to(solution, z);
        Ok(outcome.converged())
    }

    /// Grows W layer by layer along the rows of the matrix. Collective.
    fn choose(&mut self, matrix: &Matrix, count: u64) -> Result<()> {
        self.solver = None;
        self.chosen_for = count;
        self.covered = self.touching.clone();
        if count == 0 {
            return Ok(());
        }
        let mut grown = Growth::new(&self.session, matrix.pattern(), &self.touching)?;
        for layer in 0..self.layers {
            grown.grow()?;
            if layer == 0 {
                self.covered = grown.marked();
            }
        }
        self.extract(matrix, &grown)
    }

    /// Creates the solver on the grown W. Collective.
    fn extract(&mut self, matrix: &Matrix, grown: &Growth) -> Result<()> {
        let marked = grown.marked();
        let nodes = (0..marked.len() as u32).filter(|&node| marked[node as usize]).collect();
        let part = SubMatrix::new(&self.session, matrix, nodes)?;
        let mut krylov = Krylov::new(&self.session, Self::PREFIX)?;
        krylov.configure(&Self::OPTIONS)?;
        let (mut rhs, solution) = (part.vector()?, part.vector()?);
        let made_of = [part.vector()?, part.vector()?];
        // The sample is zero outside of W, so that the product contains no other columns.
        let mut sample = matrix.irregular(0)?;
        let product = sample.like()?;
        part.restrict(&sample, &mut rhs);
        sample.set(0.0);
        part.add_to(&rhs, &mut sample);
        self.solver = Some(Solver { part, krylov, rhs, solution, sample, product, made_of });
        Ok(())
    }
}

impl Solver {
    /// Change of the product with the sample, relative to the least diagonal entry of a node, above
    /// which the rows of the node count as changed.
    ///
    /// It is less than the change of one point of a facet that begins to slip, and more than that
    /// of a small strain. A penalty that rotates with its normal matters for sliding points, not
    /// for points that stick with the same stiffness.
    const CHANGED: f64 = 0.1;

    /// Whether the rows of an owned node on W differ from those that were factorised. Collective.
    fn changed(&mut self, matrix: &Matrix) -> Result<bool> {
        matrix.multiply(&self.sample, &mut self.product)?;
        self.part.restrict(&self.product, &mut self.rhs);
        let [before, diagonal] = &self.made_of;
        let (now, before, diagonal) = (self.rhs.owned(), before.owned(), diagonal.owned());
        let size = matrix.block_size();
        let mut nodes =
            now.chunks_exact(size).zip(before.chunks_exact(size)).zip(diagonal.chunks_exact(size));
        Ok(nodes.any(|((now, before), diagonal)| {
            let change: f64 = now.iter().zip(before).map(|(now, before)| (now - before).abs()).sum();
            let softest = diagonal.iter().fold(f64::INFINITY, |least, entry| least.min(entry.abs()));
            change > Self::CHANGED * softest || change.is_nan()
        }))
    }

    /// Factorises the part, and stores the data that show whether the factors still fit the matrix.
    /// Collective.
    fn factorise(&mut self, matrix: &Matrix) -> Result<()> {
        let [made, diagonal] = &mut self.made_of;
        matrix.multiply(&self.sample, &mut self.product)?;
        self.part.restrict(&self.product, made);
        matrix.diagonal(&mut self.product)?;
        self.part.restrict(&self.product, diagonal);
        self.krylov.set_operators(&self.part, &self.part)?;
        self.krylov.set_up()
    }
}

/// Marks that spread over the couplings of a pattern, including those with nodes of other ranks.
struct Growth {
    couplings: Matrix,
    marks: Vector,
    next: Vector,
}

impl Growth {
    fn new(session: &Rc<Session>, pattern: &Rc<BlockPattern>, marked: &[bool]) -> Result<Self> {
        let mut couplings = Matrix::scalar(session, pattern)?;
        couplings.fill(|values| {
            let slots: Vec<u32> = (0..pattern.slots() as u32).collect();
            values.zero();
            values.add_blocks(&slots, &vec![1.0; slots.len()]);
        })?;
        let mut marks = Vector::new(session, pattern.rows(), 1)?;
        for (mark, &marked) in marks.owned_mut().iter_mut().zip(marked) {
            *mark = f64::from(u8::from(marked));
        }
        let next = marks.like()?;
        Ok(Self { couplings, marks, next })
    }

    fn grow(&mut self) -> Result<()> {
        self.couplings.multiply(&self.marks, &mut self.next)?;
        let (mut marks, next) = (self.marks.owned_mut(), self.next.owned());
        marks.iter_mut().zip(&*next).for_each(|(mark, sum)| *mark = if *sum > 0.0 { 1.0 } else { 0.0 });
        Ok(())
    }

    fn marked(&self) -> Vec<bool> {
        self.marks.owned().iter().map(|mark| *mark > 0.0).collect()
    }
}
