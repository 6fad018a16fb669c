//! The unknowns of the nodes in contact, and a solver for the matrix on them.
//!
//! On few ranks the solver is a factorisation. On more it is an overlapping Schwarz method:
//! each rank factorises its own nodes of W and a layer of W around them, and GMRES combines these
//! pieces. The neighbours of W are fixed, so that its Green's function decays within about an element
//! and no coarse space is needed.

use std::rc::Rc;

use mpi::collective::SystemOperation;
use serde::{Deserialize, Serialize};

use super::own::source_of;
use super::subdomain::Grown;
use crate::collective::Collective;
use crate::dynamics::{MatrixSource, MultigridHints, Sources};
use crate::error::Result;
use crate::partition::exchange::NodeExchange;
use crate::petsc::{
    BlockPattern, Event, KrylovSolver, Matrix, Operator, Reason, Reuse, Session, SubMatrix, Vector,
};

/// W of the filtered multigrid: the nodes in contact and `layers` layers of elements around them. With
/// layers it is kept until contact leaves the first of them.
pub(super) struct Zone {
    session: Rc<Session>,
    layers: u32,
    /// Owned nodes currently in contact.
    touching: Vec<bool>,
    /// Owned nodes that may come into contact before W is chosen again.
    covered: Vec<bool>,
    /// Number of nodes in contact when W was chosen, on all ranks.
    chosen_for: u64,
    /// The solver, on the ranks that own a node of W.
    solver: Option<Solver>,
    /// Sources of the matrices whose factors are in use, the oldest first. The same on all ranks.
    factorised: Vec<Option<Rc<MatrixSource>>>,
    /// Whether factors of an earlier matrix are in use on any rank.
    kept: bool,
    /// Iterations on W since they were last taken.
    iterations: u32,
    renewal: Event,
    correction: Event,
}

/// The state of W that outlives a solve. Marks and sources are given by their numbers.
#[derive(Serialize, Deserialize)]
pub(super) struct ZoneState {
    touching: usize,
    covered: usize,
    chosen_for: u64,
    factorised: Vec<PiecesState>,
    kept: bool,
}

/// The pieces that were factorised for the same matrix.
#[derive(Serialize, Deserialize)]
struct PiecesState {
    source: usize,
    /// Marks all owned nodes of a rank with such a piece.
    pieces: usize,
}

/// The matrix on W with the factors of the rank's piece.
struct Solver {
    part: SubMatrix,
    krylov: KrylovSolver,
    rhs: Vector,
    solution: Vector,
    /// Whether the solver iterates, or factorises W as a whole.
    iterates: bool,
    /// An irregular vector on W, the same on any number of ranks up to their numbering.
    sample: Vector,
    /// Values on the nodes of the rank's piece beyond its own nodes.
    overlap: NodeExchange,
    /// Number of these nodes.
    further: usize,
    /// Product with the sample and diagonal, on the piece, of the matrix that was factorised.
    made_of: [Vec<f64>; 2],
    /// Number of that matrix among the sources.
    made_for: usize,
}

/// What the ranks know together before factors are renewed: numbers of nodes or ranks.
struct Survey {
    /// Nodes in contact.
    touching: u64,
    /// Ranks on which contact has left W.
    left: u64,
    /// Ranks whose piece has changed.
    changed: u64,
    /// Ranks whose factors cannot be renewed separately.
    joined: u64,
    /// Ranks with unchanged pieces, by the source of their factors.
    unchanged: [u64; Zone::SOURCES],
}

impl Zone {
    /// Prefix of PETSc's options for the solver on W.
    const PREFIX: &str = "filter_";
    /// Largest number of ranks that factorise W as a whole unless `filter_pc_type` is given.
    ///
    /// On two ranks pieces take 1.2 times as long per linear solve, because their solves are
    /// repeated. MUMPS gains from up to four ranks, and hardly from more
    /// (docs/performance/on-a-cluster.md).
    const FEW: i32 = 4;
    /// Options on few ranks: a factorisation.
    const ALONE: [(&str, &str); 5] = [
        ("ksp_type", "preonly"),
        ("pc_type", "lu"),
        ("pc_factor_mat_solver_type", "mumps"),
        ("mat_mumps_icntl_7", "5"),
        ("mat_mumps_icntl_14", "50"),
    ];
    /// Options on many ranks: GMRES with overlapping pieces, one per rank.
    const TOGETHER: [(&str, &str); 11] = [
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
    /// the outer iterations of a block with a penalty of 1e5 E / h were 46 in place of 18, with
    /// usual penalties they were equal.
    const TOLERANCE: &str = "1e-3";
    /// Number of iterations after which the solution on W is used as it is. It is never reached with
    /// the present pieces, whose solves take two to five.
    const MOST: &str = "30";
    /// Number of layers of W around a rank's own nodes whose change renews its factors, as in
    /// `pc_asm_overlap`. One layer of couplings of contact is several facets wide. Without overlap GMRES
    /// takes 20 iterations in place of 3, the outer method 118 in place of 17 at a penalty of 1e4 E / h,
    /// and it fails at 1e5. Two layers save almost half of the iterations, and factors cost four times
    /// as much.
    const OVERLAP: usize = 1;
    /// W is chosen again when contact has shrunk by this factor.
    const SHRUNK: u64 = 4;
    /// Largest number of matrices whose factors are in use on some rank. The pieces of the oldest
    /// are renewed first. Each costs as much memory as four vectors.
    const SOURCES: usize = 4;

    /// Creates an empty W, until nodes in contact are observed.
    ///
    /// # Errors
    /// If PETSc cannot register the phase.
    pub fn new(session: &Rc<Session>, layers: u32) -> Result<Self> {
        Ok(Self {
            session: Rc::clone(session),
            layers,
            touching: Vec::new(),
            covered: Vec::new(),
            chosen_for: 0,
            solver: None,
            factorised: Vec::new(),
            kept: false,
            iterations: 0,
            renewal: Event::register(session, "ZoneFactors")?,
            correction: Event::register(session, "ZoneSolve")?,
        })
    }

    /// Records the owned nodes in contact.
    pub fn observe(&mut self, touching: Vec<bool>) {
        self.touching = touching;
    }

    /// Whether any rank has a node in W.
    pub fn is_there(&self) -> bool {
        self.chosen_for > 0
    }

    /// Whether factors of an earlier matrix are in use on any rank.
    pub fn is_kept(&self) -> bool {
        self.kept
    }

    /// Returns the iterations on W since the last call, zero if it is factorised as a whole.
    /// Collective.
    pub fn take_iterations(&mut self) -> u32 {
        let own = std::mem::take(&mut self.iterations);
        let mut most = 0;
        self.session.world().reduce_all(&own, &mut most, SystemOperation::max());
        most
    }

    /// Factorises the part of `matrix` on W, which is chosen again if contact has left it. Each rank
    /// keeps the factors of an earlier matrix if `reuse` allows it and no row of its piece has
    /// changed. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails. The solve reports a zero pivot.
    pub fn prepare(
        &mut self,
        matrix: &Matrix,
        source: Option<&Rc<MatrixSource>>,
        reuse: Reuse,
    ) -> Result<()> {
        let changed = self.solver.as_mut().map(|solver| solver.follow(matrix)).transpose()?;
        let survey = self.survey(changed)?;
        let anew = survey.left > 0 || survey.touching * Self::SHRUNK < self.chosen_for;
        if anew {
            self.choose(matrix, survey.touching)?;
        }
        if !self.is_there() {
            self.factorised.clear();
            self.kept = false;
            return Ok(());
        }
        let serves = if anew || reuse == Reuse::Renew { [false; Self::SOURCES] } else { survey.serve() };
        self.kept = serves.contains(&true);
        let renews = !self.kept || survey.changed > 0;
        let before = |at: usize| serves.iter().take(at).filter(|serves| **serves).count();
        let mut own = Reuse::Renew;
        if let Some(solver) = &mut self.solver {
            if changed == Some(false) && serves[solver.made_for] {
                own = Reuse::Keep;
            }
            solver.made_for = before(if own == Reuse::Keep { solver.made_for } else { Self::SOURCES });
        }
        let mut remain = serves.iter();
        self.factorised.retain(|_| remain.next() == Some(&true));
        if renews {
            self.factorised.push(source.cloned());
        }
        let Some(solver) = &mut self.solver else { return Ok(()) };
        if !renews {
            return solver.krylov.reuse_preconditioner(Reuse::Keep);
        }
        let _running = (own == Reuse::Renew).then(|| self.renewal.begin());
        solver.factorise(own)
    }

    /// Gathers what all ranks know, where the rank's piece, if there is one, has `changed`.
    /// Collective.
    fn survey(&self, changed: Option<bool>) -> Result<Survey> {
        let is_left =
            |(node, touches): (usize, &bool)| *touches && !self.covered.get(node).copied().unwrap_or(false);
        let mut own = [0; 4 + Self::SOURCES];
        own[0] = self.touching.iter().filter(|touches| **touches).count() as u64;
        own[1] = u64::from(self.touching.iter().enumerate().any(is_left));
        if let (Some(solver), Some(changed)) = (&self.solver, changed) {
            own[2] = u64::from(changed);
            own[3] = u64::from(solver.is_joined()?);
            own[4 + solver.made_for] = u64::from(!changed);
        }
        let mut total = own;
        self.session.world().reduce_all(&own, &mut total, SystemOperation::sum());
        let [touching, left, changed, joined, unchanged @ ..] = total;
        Ok(Survey { touching, left, changed, joined, unchanged })
    }

    /// The state that outlives a solve.
    pub fn state(&self, sources: &mut Sources) -> ZoneState {
        let made_for = self.solver.as_ref().map(|solver| solver.made_for);
        let mut pieces = |(at, source): (usize, &Option<Rc<MatrixSource>>)| {
            let source = sources.matrix(source.as_ref()?);
            let pieces = sources.mark(&vec![made_for == Some(at); self.touching.len()]);
            Some(PiecesState { source, pieces })
        };
        let factorised: Option<Vec<_>> = self.factorised.iter().enumerate().map(&mut pieces).collect();
        ZoneState {
            touching: sources.mark(&self.touching),
            covered: sources.mark(&self.covered),
            chosen_for: self.chosen_for,
            factorised: factorised.unwrap_or_default(),
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
        if state.factorised.is_empty() {
            return Ok(());
        }
        self.covered = marks(state.covered);
        self.chosen_for = state.chosen_for;
        self.kept = state.kept;
        for (at, PiecesState { source, pieces }) in state.factorised.iter().enumerate() {
            let source = source_of(sources, *source)?;
            system.assemble_again(source)?;
            let matrix = system.matrix();
            self.factorised.push(Some(Rc::clone(source)));
            if at == 0 {
                self.extract(matrix)?;
            }
            let Some(solver) = &mut self.solver else { continue };
            let is_own = solver.part.first_node().is_some_and(|node| marks(*pieces)[node]);
            if is_own {
                solver.made_for = at;
            }
            solver.part.extract(matrix)?;
            solver.factorise(if is_own { Reuse::Renew } else { Reuse::Keep })?;
        }
        Ok(())
    }

    /// Computes `z += P (P^T K P)^-1 P^T r`, on several ranks to the tolerance of the iteration.
    /// Returns whether this was possible. Collective among the ranks that own a node of W; the
    /// others return at once.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn correct(&mut self, r: &Vector, z: &mut Vector) -> Result<bool> {
        let Some(Solver { part, krylov, rhs, solution, iterates, .. }) = &mut self.solver else {
            return Ok(true);
        };
        let _running = self.correction.begin();
        part.restrict(r, rhs);
        let outcome = krylov.solve(rhs, solution)?;
        part.add_to(solution, z);
        if *iterates {
            self.iterations += outcome.iterations as u32;
        }
        // A less accurate solution is still a preconditioner.
        Ok(outcome.converged() || outcome.reason == Reason::Iterations)
    }

    /// Chooses W for the nodes in contact. Collective.
    fn choose(&mut self, matrix: &Matrix, count: u64) -> Result<()> {
        self.solver = None;
        self.chosen_for = count;
        self.covered = self.touching.clone();
        if count == 0 {
            return Ok(());
        }
        self.covered = grown(&self.session, matrix.pattern(), &self.touching, self.layers.min(1))?;
        self.extract(matrix)
    }

    /// Creates the solver on the covered nodes, which include the first layer, and the other layers.
    /// Collective.
    fn extract(&mut self, matrix: &Matrix) -> Result<()> {
        let further = self.layers.saturating_sub(1);
        let marked = grown(&self.session, matrix.pattern(), &self.covered, further)?;
        let nodes = (0..marked.len() as u32).filter(|&node| marked[node as usize]).collect();
        let irregular = matrix.irregular(0)?;
        let part = SubMatrix::new(&self.session, matrix, nodes)?;
        self.solver = part.map(|part| Solver::new(part, &irregular)).transpose()?;
        Ok(())
    }
}

impl Survey {
    /// The sources whose factors remain on the ranks with unchanged pieces.
    fn serve(&self) -> [bool; Zone::SOURCES] {
        if self.changed > 0 && self.joined > 0 {
            return [false; Zone::SOURCES];
        }
        let mut serves = self.unchanged.map(|pieces| pieces > 0);
        if self.changed > 0 && !serves.contains(&false) {
            serves[0] = false;
        }
        serves
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

    /// Creates a solver without factors, with a sample from an irregular vector on the full matrix.
    /// Collective among the ranks of the part.
    fn new(part: SubMatrix, irregular: &Vector) -> Result<Self> {
        let session = part.session();
        let mut krylov = KrylovSolver::new(session, Zone::PREFIX)?;
        match session.size() {
            1 => krylov.configure(&Zone::ALONE)?,
            few if few <= Zone::FEW && !session.is_given("filter_pc_type") => {
                krylov.configure(&Zone::ALONE)?;
            }
            _ => krylov.configure(&Zone::TOGETHER)?,
        }
        let iterates = krylov.types()?.0 != "preonly";
        let layers = [f64::INFINITY; Zone::OVERLAP];
        let Grown { ghosts, exchange, .. } = Grown::new(session, part.matrix().pattern(), &layers)?;
        let mut sample = part.vector()?;
        part.restrict(irregular, &mut sample);
        Ok(Self {
            rhs: part.vector()?,
            solution: part.vector()?,
            part,
            krylov,
            iterates,
            sample,
            overlap: exchange,
            further: ghosts.len(),
            made_of: [Vec::new(), Vec::new()],
            made_for: 0,
        })
    }

    /// Whether the factors of the pieces are those of one factorisation, so that no rank can keep
    /// its own.
    fn is_joined(&self) -> Result<bool> {
        Ok(self.part.session().size() > 1 && self.krylov.types()?.1 != "asm")
    }

    /// Takes the values of `matrix`. Returns whether the rows of a node of the piece differ from
    /// those that were factorised. Collective among the ranks of the part.
    fn follow(&mut self, matrix: &Matrix) -> Result<bool> {
        self.part.extract(matrix)?;
        let now = self.product()?;
        let [before, diagonal] = &self.made_of;
        let size = matrix.block_size();
        let mut nodes =
            now.chunks_exact(size).zip(before.chunks_exact(size)).zip(diagonal.chunks_exact(size));
        Ok(nodes.any(|((now, before), diagonal)| {
            let change: f64 = now.iter().zip(before).map(|(now, before)| (now - before).abs()).sum();
            let softest = diagonal.iter().fold(f64::INFINITY, |least, entry| least.min(entry.abs()));
            change > Self::CHANGED * softest || change.is_nan()
        }))
    }

    /// Factorises the piece, or keeps its factors while other ranks factorise theirs. Stores the
    /// data that show whether the factors still fit the matrix. Collective among the ranks of the
    /// part.
    fn factorise(&mut self, own: Reuse) -> Result<()> {
        let is_first = self.made_of[0].is_empty();
        if !is_first {
            self.krylov.reuse_pieces(own)?;
        }
        let product = self.product()?;
        self.part.matrix().diagonal(&mut self.rhs)?;
        let diagonal = self.on_piece();
        if is_first || own == Reuse::Renew {
            self.made_of = [product, diagonal];
        }
        self.krylov.set_operators(&self.part, &self.part)?;
        self.krylov.reuse_preconditioner(Reuse::Renew)?;
        self.krylov.set_up_pieces()
    }

    /// Product of the matrix with the sample, on the piece. Collective among the ranks of the part.
    fn product(&mut self) -> Result<Vec<f64>> {
        self.part.multiply(&self.sample, &mut self.rhs)?;
        Ok(self.on_piece())
    }

    /// The values of `rhs` on the piece. Collective among the ranks of the part.
    fn on_piece(&mut self) -> Vec<f64> {
        let size = self.rhs.block_size();
        let owned = self.rhs.owned();
        let mut values = owned.to_vec();
        values.resize(owned.len() + self.further * size, 0.0);
        let world = self.part.session().world();
        self.overlap.forward(world, size, &owned, &mut values[owned.len()..]);
        values
    }
}

/// Marks of owned nodes, spread `layers` times over the couplings of a pattern, including those with
/// nodes of other ranks. Collective.
fn grown(
    session: &Rc<Session>,
    pattern: &Rc<BlockPattern>,
    marked: &[bool],
    layers: u32,
) -> Result<Vec<bool>> {
    if layers == 0 {
        return Ok(marked.to_vec());
    }
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
    let mut next = marks.like()?;
    for _ in 0..layers {
        couplings.multiply(&marks, &mut next)?;
        let (mut marks, next) = (marks.owned_mut(), next.owned());
        marks.iter_mut().zip(&*next).for_each(|(mark, sum)| *mark = if *sum > 0.0 { 1.0 } else { 0.0 });
    }
    Ok(marks.owned().iter().map(|mark| *mark > 0.0).collect())
}
