//! The unknowns of the nodes in contact, and a solver for the matrix on them.
//!
//! If few ranks own nodes in contact, W has those of both sides, and the solver is a factorisation.
//! On more ranks it has those of the contactor, and the solver is an overlapping Schwarz method: each
//! rank factorises its own nodes of W and a layer of W around them, and GMRES combines these pieces.
//!
//! Pieces need the contactor alone. While the target is fixed, the penalty is a product of two mass
//! matrices of the contactor. Its condition does not depend on the stiffness, and the influence of a
//! load decays over about an element. With both sides the penalty leaves free the motions in which
//! the contactor follows the target. Where a piece cuts such a motion off, the penalty resists with
//! its full stiffness, and the iterations grow with it. If all surfaces are contactors, W has both
//! sides all the same, and pieces fail at stiff penalties (docs/limits.md).

use std::rc::Rc;

use mpi::collective::SystemOperation;
use serde::{Deserialize, Serialize};

use super::zone_rows::ZoneRows;
use crate::collective::Collective;
use crate::dynamics::{MatrixSource, MultigridHints, Sides, Sources};
use crate::error::Result;
use crate::petsc::{
    Event, KrylovSolver, Matrix, Operator, Reason, Session, SharedOperator, SubMatrix, Vector,
};

/// W of the filtered preconditioners.
pub(super) struct Zone {
    session: Rc<Session>,
    nodes: ZoneNodes,
    /// Whether any rank has a node in W.
    is_there: bool,
    /// The solver, on the ranks that own a node of W.
    solver: Option<Solver>,
    /// The rows of the matrix on W.
    rows: Option<ZoneRows>,
    /// Source of the matrix that was factorised.
    made_for: Option<Rc<MatrixSource>>,
    /// Iterations on W since they were last taken.
    iterations: u32,
    factors: Event,
    correction: Event,
}

/// The nodes of W.
#[derive(Default)]
struct ZoneNodes {
    /// Marks of the owned nodes.
    marks: Vec<bool>,
    /// Whether W has the contactor's nodes and is solved by pieces, or has those of both sides and is
    /// factorised as a whole.
    in_pieces: bool,
}

/// The state of W that outlives a solve.
#[derive(Serialize, Deserialize)]
pub(super) struct ZoneState {
    /// Number of the marks of its nodes.
    nodes: usize,
    in_pieces: bool,
}

/// The matrix on W with its factors.
struct Solver {
    part: SubMatrix,
    krylov: KrylovSolver,
    rhs: Vector,
    solution: Vector,
    /// Whether the solver iterates.
    iterates: bool,
}

impl Zone {
    /// Prefix of PETSc's options for the solver on W.
    const PREFIX: &str = "filter_";
    /// Largest number of ranks with nodes in contact that factorise W as a whole. One factorisation
    /// takes fewer iterations, but MUMPS hardly scales: with two layers of elements in W its factors
    /// took 2.3 times less time on four ranks than on one (docs/performance/on-a-cluster.md). With
    /// two ranks in pieces a solve takes 0.8 to 1.25 times as long as with one factorisation.
    const FEW: i32 = 4;
    /// Options of one factorisation. That of PETSc takes 2 to 3 times as long as that of MUMPS.
    const WHOLE: [(&str, &str); 5] = [
        ("ksp_type", "preonly"),
        ("pc_type", "lu"),
        ("pc_factor_mat_solver_type", "mumps"),
        ("mat_mumps_icntl_7", "5"),
        ("mat_mumps_icntl_14", "50"),
    ];
    /// Options of the pieces, one per rank: GMRES with overlapping Schwarz.
    ///
    /// Without overlap GMRES takes 8 to 14 iterations in place of 2 or 3, and the outer method 48 in
    /// place of 26 at a penalty of 1e5 E / h on 8 ranks. With two layers both take as many as with
    /// one.
    const PIECES: [(&str, &str); 11] = [
        ("ksp_type", "gmres"),
        ("ksp_pc_side", "right"),
        ("ksp_rtol", Self::TOLERANCE),
        ("ksp_max_it", Self::MOST),
        ("pc_type", "asm"),
        ("pc_asm_overlap", "1"),
        ("sub_ksp_type", "preonly"),
        ("sub_pc_type", "lu"),
        ("sub_pc_factor_mat_solver_type", "mumps"),
        ("sub_mat_mumps_icntl_7", "5"),
        ("sub_mat_mumps_icntl_14", "50"),
    ];
    /// Tolerance of GMRES on W. The residual of a stiff penalty says little about the error: at 1e-2
    /// the outer iterations on 8 ranks are 30.5 in place of 25.5 at a penalty of 1e5 E / h, 89.5 in
    /// place of 31.5 at 1e6, and equal with usual penalties.
    const TOLERANCE: &str = "1e-3";
    /// Number of iterations after which the solution on W is used as it is. Solves take two or three,
    /// and more only if both surfaces are contactors and the penalty is stiff.
    const MOST: &str = "30";

    /// Creates an empty W, until nodes in contact are observed.
    ///
    /// # Errors
    /// If PETSc cannot register the phase.
    pub fn new(session: &Rc<Session>) -> Result<Self> {
        Ok(Self {
            session: Rc::clone(session),
            nodes: ZoneNodes::default(),
            is_there: false,
            solver: None,
            rows: None,
            made_for: None,
            iterations: 0,
            factors: Event::register(session, "ZoneFactors")?,
            correction: Event::register(session, "ZoneSolve")?,
        })
    }

    /// Observes which nodes are in contact. W is factorised anew for the next solve. Collective.
    pub fn observe(&mut self, system: &mut dyn MultigridHints) {
        let both = system.contact_nodes(Sides::Both);
        let in_pieces = self.takes_pieces(&both);
        let marks = if in_pieces { system.contact_nodes(Sides::Contactor) } else { both };
        self.nodes = ZoneNodes { marks, in_pieces };
        self.made_for = None;
    }

    /// Whether W is solved by pieces if both of its sides have these owned nodes. Collective.
    fn takes_pieces(&self, both: &[bool]) -> bool {
        let mut ranks = 0;
        let own = i32::from(both.contains(&true));
        self.session.world().reduce_all(&own, &mut ranks, SystemOperation::sum());
        let asks = |option| self.session.is_given(option);
        let asks_for_pieces = self.session.size() > 1 && asks("filter_pc_type");
        !asks("filter_ksp_type") && (ranks > Self::FEW || asks_for_pieces)
    }

    /// Whether any rank has a node in W.
    pub fn is_there(&self) -> bool {
        self.is_there
    }

    /// Whether it has the nodes of the contactor alone. If all surfaces are contactors, these are the
    /// nodes of both sides.
    pub fn has_one_side(&self) -> bool {
        self.nodes.in_pieces
    }

    /// Returns the iterations on W since the last call, zero if it is factorised as a whole.
    /// Collective.
    pub fn take_iterations(&mut self) -> u32 {
        let own = std::mem::take(&mut self.iterations);
        let mut most = 0;
        self.session.world().reduce_all(&own, &mut most, SystemOperation::max());
        most
    }

    /// Factorises the part of `matrix` on W, unless it is that of the same `source` and of the same
    /// nodes. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails. The solve reports a zero pivot.
    pub fn prepare(&mut self, matrix: &Matrix, source: Option<&Rc<MatrixSource>>) -> Result<()> {
        let is_same = |made_for: &Rc<MatrixSource>| source.is_some_and(|source| Rc::ptr_eq(made_for, source));
        if self.made_for.as_ref().is_some_and(is_same) {
            return Ok(());
        }
        (self.solver, self.rows) = (None, None);
        self.made_for = source.cloned();
        let ZoneNodes { marks, in_pieces } = &self.nodes;
        let nodes: Vec<u32> = (0..).zip(marks).filter(|(_, is_in)| **is_in).map(|(node, _)| node).collect();
        let mut any = 0u8;
        let own = u8::from(!nodes.is_empty());
        self.session.world().reduce_all(&own, &mut any, SystemOperation::max());
        self.is_there = any > 0;
        if !self.is_there {
            return Ok(());
        }
        let _running = self.factors.begin();
        self.rows = Some(ZoneRows::new(&self.session, matrix, &nodes)?);
        let part = SubMatrix::new(&self.session, matrix, nodes)?;
        self.solver = part.map(|part| Solver::new(part, *in_pieces)).transpose()?;
        Ok(())
    }

    /// The state that outlives a solve.
    pub fn state(&self, sources: &mut Sources) -> ZoneState {
        let ZoneNodes { marks, in_pieces } = &self.nodes;
        ZoneState { nodes: sources.mark(marks), in_pieces: *in_pieces }
    }

    /// Restores the state. The factors are made for the next solve.
    pub fn resume(&mut self, state: &ZoneState, sources: &Sources) {
        let marks = sources.marks.get(state.nodes).cloned().unwrap_or_default();
        self.nodes = ZoneNodes { marks, in_pieces: state.in_pieces };
    }

    /// Computes `z += P (P^T K P)^-1 P^T r`, on several ranks to the tolerance of the iteration.
    /// Returns whether this was possible. Collective among the ranks that own a node of W; the
    /// others return at once.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn correct(&mut self, r: &Vector, z: &mut Vector) -> Result<bool> {
        let Some(solver) = &mut self.solver else { return Ok(true) };
        let _running = self.correction.begin();
        solver.part.restrict(r, &mut solver.rhs);
        self.solve(z)
    }

    /// Computes `z = P (P^T K P)^-1 P^T r` and `residual = r - K z` with the full operator `K`. Returns
    /// whether this was possible. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn begin(
        &mut self,
        operator: &SharedOperator,
        r: &Vector,
        z: &mut Vector,
        residual: &mut Vector,
    ) -> Result<bool> {
        z.set(0.0);
        let well = self.correct(r, z)?;
        operator.multiply(z, residual)?;
        residual.aypx(-1.0, r)?;
        Ok(well)
    }

    /// Computes `z += P (P^T K P)^-1 P^T (r - K z)` with the rows of `K` on W alone, on several ranks to
    /// the tolerance of the iteration. Returns whether this was possible. Collective among all ranks.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn correct_residual(&mut self, r: &Vector, z: &mut Vector) -> Result<bool> {
        let Some(rows) = &mut self.rows else { return Ok(true) };
        let _running = self.correction.begin();
        rows.receive(z);
        let Some(solver) = &mut self.solver else { return Ok(true) };
        solver.part.restrict(r, &mut solver.rhs);
        rows.subtract_product(z, &mut solver.rhs.owned_mut());
        self.solve(z)
    }

    /// Adds the solution for the right side on W.
    fn solve(&mut self, z: &mut Vector) -> Result<bool> {
        let Some(Solver { part, krylov, rhs, solution, iterates }) = &mut self.solver else {
            return Ok(true);
        };
        let outcome = krylov.solve(rhs, solution)?;
        part.add_to(solution, z);
        if *iterates {
            self.iterations += outcome.iterations as u32;
        }
        // A less accurate solution is still a preconditioner.
        Ok(outcome.converged() || outcome.reason == Reason::Iterations)
    }
}

impl Solver {
    /// Factorises the part. Collective among its ranks.
    fn new(part: SubMatrix, in_pieces: bool) -> Result<Self> {
        let session = part.session();
        let mut krylov = KrylovSolver::new(session, Zone::PREFIX)?;
        krylov.configure(if in_pieces { &Zone::PIECES[..] } else { &Zone::WHOLE })?;
        let iterates = krylov.types()?.0 != "preonly";
        krylov.set_operators(&part, &part)?;
        krylov.set_up_pieces()?;
        Ok(Self { rhs: part.vector()?, solution: part.vector()?, part, krylov, iterates })
    }
}
