//! The unknowns around the facets in contact, and a factorisation of the matrix on them.

use std::rc::Rc;

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use crate::error::Result;
use crate::petsc::{BlockPattern, Event, Krylov, Matrix, Operator, Session, SubMatrix, Vector};

/// W of the filtered multigrid. A little larger than the facets in contact need, so that it may stay while they change.
pub(super) struct Zone {
    session: Rc<Session>,
    layers: u32,
    /// Owned nodes in contact at present.
    touching: Vec<bool>,
    /// Owned nodes that may come into contact before W is chosen anew.
    covered: Vec<bool>,
    /// Nodes in contact when W was chosen, on all ranks.
    chosen_for: u64,
    solver: Option<Solver>,
    renewal: Event,
    correction: Event,
}

/// The matrix on W with its factors.
struct Solver {
    part: SubMatrix,
    krylov: Krylov,
    rhs: Vector,
    solution: Vector,
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
    /// W is chosen anew when contact has shrunk by this factor.
    const SHRUNK: u64 = 4;

    /// Nothing, until nodes in contact are observed.
    ///
    /// # Errors
    /// When PETSc can not register the phase.
    pub fn new(session: &Rc<Session>, layers: u32) -> Result<Self> {
        let (touching, covered) = (Vec::new(), Vec::new());
        let renewal = Event::register(session, "ZoneFactors")?;
        let correction = Event::register(session, "ZoneSolve")?;
        let session = Rc::clone(session);
        Ok(Self { session, layers, touching, covered, chosen_for: 0, solver: None, renewal, correction })
    }

    /// Takes the owned nodes in contact.
    pub fn observe(&mut self, touching: Vec<bool>) {
        self.touching = touching;
    }

    /// Whether any rank has a node in W.
    pub fn is_there(&self) -> bool {
        self.solver.is_some()
    }

    /// Factorises the part of `matrix` on W, which is chosen anew where contact has left it. Collective.
    ///
    /// # Errors
    /// When PETSc refuses; a zero pivot is told by the solve.
    pub fn prepare(&mut self, matrix: &Matrix) -> Result<()> {
        let left = self
            .touching
            .iter()
            .enumerate()
            .any(|(node, touches)| *touches && !self.covered.get(node).copied().unwrap_or(false));
        let count = self.touching.iter().filter(|touches| **touches).count() as u64;
        let mut total = [0u64; 2];
        self.session.world().all_reduce_into(&[count, u64::from(left)], &mut total, SystemOperation::sum());
        let [count, left] = total;
        if left > 0 || count * Self::SHRUNK < self.chosen_for {
            self.choose(matrix, count)?;
        } else if let Some(solver) = &mut self.solver {
            solver.part.extract(matrix)?;
        }
        let Some(solver) = &mut self.solver else { return Ok(()) };
        let _running = self.renewal.begin();
        solver.krylov.set_operators(&solver.part, &solver.part)?;
        solver.krylov.set_up()
    }

    /// `z += P (P^T K P)^-1 P^T r`; whether it could be done. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub fn correct(&mut self, r: &Vector, z: &mut Vector) -> Result<bool> {
        let Some(Solver { part, krylov, rhs, solution }) = &mut self.solver else { return Ok(true) };
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
        let marked = grown.marked();
        let nodes = (0..marked.len() as u32).filter(|&node| marked[node as usize]).collect();
        let part = SubMatrix::new(&self.session, matrix, nodes)?;
        let mut krylov = Krylov::new(&self.session, Self::PREFIX)?;
        krylov.configure(&Self::OPTIONS)?;
        let (rhs, solution) = (part.vector()?, part.vector()?);
        self.solver = Some(Solver { part, krylov, rhs, solution });
        Ok(())
    }
}

/// Marks that spread over the couplings of a pattern, those with nodes of other ranks included.
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
