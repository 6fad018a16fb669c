//! Linear solves with a ladder of presets. Each solution is checked by its true residual.

use std::cell::RefCell;
use std::rc::Rc;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::diagonal::DiagonalBlocks;
use super::fatigue::SetupAge;
use super::filtered_amg::FilteredAmg;
use super::filtered_ilu::FilteredIlu;
use super::ladder::{LinearChoice, Problem, ladder};
use super::one_rank::on_one_rank;
use super::own::{CustomPreconditioner, Origin, source_of};
use super::subdomain::Subdomain;
use super::tried::LinearAttempt;
use super::two_stage::{TwoStage, TwoStageSettings};
use super::users_options::{beside_the_users, refuse_symmetric_method};
use crate::dynamics::{ContactCounts, MatrixSource, MultigridHints, Sources, Stage};
use crate::error::{Error, Result};
use crate::petsc::{BlockPattern, Event, KrylovSolver, Matrix, Reuse, Session, Vector, residual_norm};
use crate::presets::{Implementation, Preset};

/// Result of a linear solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solved {
    /// Krylov iterations of all attempts.
    pub iterations: u32,
    /// Krylov iterations within the preconditioner.
    pub inner: u32,
    /// True residual, relative to the right side.
    pub residual: f64,
    /// The preset that succeeded.
    pub preset: &'static str,
}

/// Record that a preset failed and the next one replaced it.
#[derive(Debug, Clone, PartialEq)]
pub struct Fallback {
    /// The preset that failed.
    pub from: &'static str,
    /// The preset that replaced it.
    pub to: &'static str,
    /// Reason of the failure, in words.
    pub why: String,
}

/// The state of a [`LinearSolver`] that outlives a solve.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct LinearState {
    rung: usize,
    calm: u32,
    patience: u32,
    fatigue: SetupAge,
    contact: ContactCounts,
    /// Number of the source of the matrix for which the preconditioner was set up.
    set_up_for: Option<usize>,
    /// The preconditioner that the program implements.
    own: Option<OwnState>,
}

/// The state of a preconditioner that the program implements.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct OwnState {
    /// Rung of its preset.
    rung: usize,
    state: Value,
}

/// Solves with the current preset of the ladder, and moves to the next preset when it fails.
pub struct LinearSolver {
    session: Rc<Session>,
    prefix: String,
    ladder: Vec<&'static Preset>,
    solvers: Vec<Option<KrylovSolver>>,
    /// Current rung.
    rung: usize,
    /// Number of solves since the last move to a higher rung.
    calm: u32,
    /// Number of solves on a higher rung before the first rung is tried again.
    patience: u32,
    symmetric: bool,
    /// Whether a factorisation is cheap for this problem and the program chose the presets.
    prefers_factors: bool,
    fallbacks: Vec<Fallback>,
    fatigue: SetupAge,
    /// Pattern of the last matrix. Setups for another pattern cannot be reused.
    pattern: Option<Rc<BlockPattern>>,
    /// The preconditioner of the last preset that needs more than the matrix, created on first use and
    /// called back by PETSc.
    own: Rc<RefCell<Option<Box<dyn CustomPreconditioner>>>>,
    /// Rung of that preset.
    own_rung: usize,
    /// Factors on overlapping subdomains, created on first use.
    subdomain: Rc<RefCell<Option<Subdomain>>>,
    /// Source of the matrix for which the preconditioner of the current rung was set up. It is
    /// `None` for factorisations, which are made for every matrix, and for preconditioners that keep
    /// their own sources.
    set_up_for: Option<Rc<MatrixSource>>,
    /// Diagonal blocks of the matrix for which the preconditioner of the current rung was set up.
    /// `None` for factorisations and for preconditioners that have their own matrices.
    diagonal: Option<DiagonalBlocks>,
    /// State of the contact points when they were last observed.
    contact: ContactCounts,
    stages: TwoStageSettings,
    /// Whether factorisations run on a single rank.
    alone: bool,
    work: Vector,
    setup: Event,
    solve: Event,
}

impl LinearSolver {
    /// Number of iterations after which a preset counts as failed.
    const MAX_ITERATIONS: usize = 500;
    /// Number of iterations after which a preset counts as failed if a cheap factorisation is next. That many cheap iterations cost as much as either of them on
    /// first-order elements; on hex20 they cost more.
    const WORTHWHILE: usize = 200;
    /// Number of iterations after which a preset counts as failed if `filtered_ilu` is next.
    ///
    /// A set-up and a solve with `filtered_ilu` take as long as 30 to 80 iterations of `gmres_asm_ilu` on
    /// two boxes of 27 753 unknowns or more. With half of this number, boxes of 89 328 unknowns would
    /// take 1.3 times as long at CFL 50 and 0.9 times in statics. With twice the number a change takes
    /// another 2 s at 273 309 unknowns (docs/performance/large-problems.md).
    const BESIDE_FILTERED_ILU: usize = 100;
    /// Tolerance of a solve whose result is not used.
    const ANY: f64 = 0.5;
    /// A preconditioner is made again if a diagonal block of the matrix has changed by more than this
    /// part of its largest entry.
    ///
    /// Two boxes of 27 753 unknowns that begin to slip take 444 iterations in all, with 0.1 as well, and
    /// 443 with twice the value. With four times the value they take 843, as with factors that are
    /// kept (docs/performance/large-problems.md).
    const CHANGED: f64 = 0.25;
    /// Number of solves on a higher rung before the first rung is tried again. The number doubles
    /// each time.
    const PATIENCE: u32 = 25;

    /// Creates a solver for problems of this kind, with vectors like `pattern` and PETSc options
    /// under `prefix`. Collective.
    ///
    /// # Errors
    /// If the choice, or a method in the user's options, does not fit the problem.
    pub fn new(pattern: &Vector, prefix: &str, choice: &LinearChoice, problem: &Problem) -> Result<Self> {
        let session = pattern.session();
        let ladder = ladder(choice, problem)?;
        let mut solver = Self {
            session: session.clone(),
            prefix: prefix.to_owned(),
            solvers: ladder.iter().map(|_| None).collect(),
            ladder,
            rung: 0,
            calm: 0,
            patience: Self::PATIENCE,
            symmetric: problem.symmetric,
            prefers_factors: *choice == LinearChoice::Auto && problem.prefers_factors(),
            fallbacks: Vec::new(),
            fatigue: SetupAge::default(),
            pattern: None,
            own: Rc::default(),
            own_rung: 0,
            subdomain: Rc::default(),
            set_up_for: None,
            diagonal: None,
            contact: ContactCounts::default(),
            stages: choice.stages(problem),
            alone: false,
            work: pattern.like()?,
            setup: Event::register(session, "SolverSetUp")?,
            solve: Event::register(session, "Solve")?,
        };
        solver.krylov()?;
        Ok(solver)
    }

    /// Makes this solver factorise on one rank, so that results are bitwise reproducible.
    /// Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn on_one_rank(mut self) -> Result<Self> {
        (self.alone, self.solvers[self.rung]) = (true, None);
        self.krylov()?;
        Ok(self)
    }

    /// Lists the presets in the order in which they are tried, or reports that the user chose the
    /// solver by PETSc options.
    pub fn describe(&self) -> String {
        let given = |name: &str| self.session.is_given(&format!("{}{name}", self.prefix));
        let presets = self.ladder.iter().map(|preset| preset.name).collect::<Vec<_>>().join(", then ");
        match (given("pc_type"), given("ksp_type")) {
            (true, _) => "by PETSc options".to_owned(),
            (false, true) => format!("{presets}, with the method by PETSc options"),
            (false, false) => presets,
        }
    }

    /// The preset that is in use.
    pub fn preset(&self) -> &'static Preset {
        self.ladder[self.rung]
    }

    /// Whether the ladder contains a multigrid, or the user chose one by options.
    pub fn wants_rigid_body_modes(&self) -> bool {
        let chosen = self.session.is_given(&format!("{}pc_type", self.prefix));
        let inner = self.stages.inner.and_then(Preset::named).filter(|_| self.ladder[0].is_two_stage());
        chosen || self.ladder.iter().copied().chain(inner).any(|preset| preset.multigrid)
    }

    /// Whether the first preset factorises on several ranks, where MUMPS rounds differently in each
    /// run, or is a filtered preconditioner, whose sums over several ranks do.
    pub fn factorises_together(&self) -> bool {
        let preset = self.ladder[0];
        let chosen = self.session.is_given(&format!("{}pc_type", self.prefix));
        let inner = self.stages.inner.and_then(Preset::named).filter(|_| preset.is_two_stage());
        let factorises = inner.map_or(preset.is_own() || !preset.iterative, |inner| !inner.iterative);
        self.session.size() > 1 && factorises && !chosen
    }

    /// Passes the state of the contact points to the preconditioner, which may depend on it.
    pub fn note_contacts(&mut self, contact: ContactCounts) {
        self.contact = contact;
    }

    /// Returns the presets that failed since the last call.
    pub fn take_fallbacks(&mut self) -> Vec<Fallback> {
        std::mem::take(&mut self.fallbacks)
    }

    /// State that outlives a solve.
    pub(super) fn state(&self, system: &dyn MultigridHints, sources: &mut Sources) -> LinearState {
        let pattern = system.matrix().pattern();
        let is_current = self.pattern.as_ref().is_some_and(|known| Rc::ptr_eq(known, pattern));
        let mut fatigue = self.fatigue;
        if !is_current && self.pattern.is_some() {
            // The next solve notices that the pattern has changed.
            fatigue.discard();
        }
        let set_up_for = self.set_up_for.as_ref().filter(|_| is_current && !fatigue.is_tired());
        let own = self.own.borrow();
        let own = own.as_ref().filter(|own| own.fits(system.matrix()));
        LinearState {
            rung: self.rung,
            calm: self.calm,
            patience: self.patience,
            fatigue,
            contact: self.contact,
            set_up_for: set_up_for.map(|source| sources.matrix(source)),
            own: own.map(|own| OwnState { rung: self.own_rung, state: own.state(sources) }),
        }
    }

    /// Restores the state of a new solver. Collective.
    ///
    /// # Errors
    /// The state is not one of this solver, or a PETSc call fails.
    pub(super) fn resume(
        &mut self,
        state: &LinearState,
        sources: &Sources,
        system: &mut dyn MultigridHints,
    ) -> Result<()> {
        if state.rung >= self.ladder.len() {
            return Err(Error::file("a checkpoint with another state of the solver"));
        }
        self.rung = state.rung;
        self.calm = state.calm;
        self.patience = state.patience;
        self.fatigue = state.fatigue;
        self.contact = state.contact;
        self.pattern = Some(Rc::clone(system.matrix().pattern()));
        if let Some(OwnState { rung, state }) = &state.own
            && let Some(preset) = self.ladder.get(*rung)
        {
            let mut own = self.make(preset, system.matrix())?;
            own.resume(state, sources, system)?;
            *self.own.borrow_mut() = Some(own);
            self.own_rung = *rung;
        }
        let Some(number) = state.set_up_for else { return Ok(()) };
        let source = source_of(sources, number)?;
        system.assemble_again(source)?;
        self.set_up_for = Some(Rc::clone(source));
        self.diagonal = Some(DiagonalBlocks::of(system.matrix())?);
        if self.overlaps() {
            self.factorise(system.matrix(), Reuse::Renew)?;
        }
        if let (true, Some(own)) = (self.preset().is_own(), self.own.borrow_mut().as_mut()) {
            own.prepare(system.matrix(), Some(source), Reuse::Renew)?;
        }
        let krylov = self.krylov()?;
        krylov.set_operators(system.matrix(), system.matrix())?;
        krylov.reuse_preconditioner(Reuse::Renew)?;
        krylov.set_up()?;
        // PETSc sets up parts of some preconditioners when they are applied first.
        krylov.set_tolerances(Self::ANY, 0.0, 1)?;
        let rhs = system.matrix().irregular(0)?;
        krylov.solve(&rhs, &mut rhs.like()?).map(drop)
    }

    /// Updates the preconditioner's own matrices, if there are any. If the system's matrix is
    /// `kept`, they are updated only when they no longer fit.
    fn refresh(&mut self, system: &mut dyn MultigridHints, stage: &Stage, kept: bool) -> Result<()> {
        let preset = self.preset();
        if !preset.is_own() || kept && !self.fatigue.is_tired() {
            return Ok(());
        }
        let is_of_this = std::mem::replace(&mut self.own_rung, self.rung) == self.rung;
        let kept = self.own.borrow_mut().take().filter(|made| is_of_this && made.fits(system.matrix()));
        let renew = kept.is_none() || self.fatigue.is_tired();
        let mut made = match kept {
            Some(made) => made,
            None => self.make(preset, system.matrix())?,
        };
        made.note_contacts(&self.contact);
        made.assemble(system, stage, if renew { Reuse::Renew } else { Reuse::Keep })?;
        *self.own.borrow_mut() = Some(made);
        Ok(())
    }

    /// Creates the preconditioner of a preset that has its own matrices, for a matrix like `like`.
    /// Collective.
    fn make(&self, preset: &Preset, like: &Matrix) -> Result<Box<dyn CustomPreconditioner>> {
        let origin = Origin { session: &self.session, like, pattern: &self.work };
        Ok(match preset.implementation {
            Implementation::TwoStage => {
                let inner = self.stages.inner.unwrap_or("cg_icc");
                Box::new(TwoStage::new(&origin, self.stages.second, inner)?)
            }
            Implementation::FilteredIlu => Box::new(FilteredIlu::new(&origin)?),
            _ => Box::new(FilteredAmg::new(&origin)?),
        })
    }

    /// Solves for `x` with `|matrix x - rhs| <= tolerance |rhs|`. Returns `None` if the last rung
    /// failed too. Collective.
    ///
    /// The matrix is the one that the system has assembled. It is either new or `kept` since the
    /// last solve.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn solve_system(
        &mut self,
        system: &mut dyn MultigridHints,
        stage: &Stage,
        kept: bool,
        rhs: &Vector,
        x: &mut Vector,
        tolerance: f64,
    ) -> Result<Option<Solved>> {
        let size = rhs.norm()?;
        self.notice(system.matrix())?;
        self.climb(|solver| {
            solver.refresh(system, stage, kept)?;
            let source = system.matrix_source();
            solver.attempt(system.matrix(), source.as_ref(), rhs, size, x, tolerance)
        })
    }

    /// Solves for `x` with a matrix alone, hence without presets that need more than the matrix.
    /// Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn solve(
        &mut self,
        matrix: &Matrix,
        rhs: &Vector,
        x: &mut Vector,
        tolerance: f64,
    ) -> Result<Option<Solved>> {
        let size = rhs.norm()?;
        self.notice(matrix)?;
        self.climb(|solver| solver.attempt(matrix, None, rhs, size, x, tolerance))
    }

    /// Tries the current preset and, on failure, the following ones.
    fn climb(
        &mut self,
        mut attempt: impl FnMut(&mut Self) -> Result<LinearAttempt>,
    ) -> Result<Option<Solved>> {
        let (mut iterations, mut inner) = (0, 0);
        self.step_down();
        loop {
            let tried = attempt(self)?;
            iterations += tried.iterations;
            inner += self.own.borrow_mut().as_mut().map_or(0, |own| own.take_iterations());
            if tried.is_good() {
                let residual = tried.residual;
                let preset = self.preset().name;
                return Ok(Some(Solved { iterations, inner, residual, preset }));
            }
            if tried.reuse == Reuse::Keep {
                // The failure may be due to the preconditioner of an earlier matrix. The preset is tried
                // again with a new one.
                self.fatigue.discard();
                continue;
            }
            if self.rung + 1 == self.ladder.len() {
                return Ok(None);
            }
            self.step_up(&tried);
        }
    }

    /// Whether the solver is a factorisation, which has to be of the current matrix.
    fn factorises(&self) -> bool {
        let preset = self.preset();
        let inner = self.stages.inner.and_then(Preset::named).filter(|_| preset.is_two_stage());
        !inner.unwrap_or(preset).iterative
    }

    /// Whether the current preset uses overlapping subdomains that the program makes, without
    /// options of the user for them.
    fn overlaps(&self) -> bool {
        let kinds = ["pc_", "sub_"].map(|kind| format!("-{}{kind}", self.prefix));
        let chosen = |name: &String| kinds.iter().any(|kind| name.starts_with(kind));
        self.preset().is_overlapping() && !self.session.given(&self.prefix).iter().any(chosen)
    }

    /// Whether PETSc may build a multigrid. A second set-up of the same object differs from a first
    /// one by rounding, so each set-up needs a new object.
    fn coarsens(&self) -> bool {
        let preset = self.preset();
        let chosen = self.session.is_given(&format!("{}pc_type", self.prefix));
        preset.iterative && !preset.is_own() && (preset.multigrid || chosen)
    }

    /// Updates the factors on subdomains. Those of an earlier matrix may be kept. Collective.
    fn factorise(&self, matrix: &Matrix, reuse: Reuse) -> Result<()> {
        let mut slot = self.subdomain.borrow_mut();
        let kept = slot.take().filter(|made| made.fits(matrix));
        let renew = kept.is_none() || reuse == Reuse::Renew;
        let mut made = match kept {
            Some(made) => made,
            None => Subdomain::new(&self.session, matrix)?,
        };
        if renew {
            made.renew(matrix)?;
        }
        *slot = Some(made);
        Ok(())
    }

    /// Number of iterations after which the current preset counts as failed.
    fn most(&self) -> usize {
        let is_filtered_ilu = |preset: &Preset| preset.implementation == Implementation::FilteredIlu;
        match self.ladder.get(self.rung + 1) {
            Some(next) if is_filtered_ilu(next) && !self.preset().is_own() => Self::BESIDE_FILTERED_ILU,
            Some(next) if self.prefers_factors && !next.iterative => Self::WORTHWHILE,
            _ => Self::MAX_ITERATIONS,
        }
    }

    /// Restarts if contact has changed the pattern of the matrix, and discards the preconditioner if
    /// the matrix has changed much since it was set up. Collective.
    fn notice(&mut self, matrix: &Matrix) -> Result<()> {
        let known = self.pattern.replace(Rc::clone(matrix.pattern()));
        if known.is_some_and(|known| !Rc::ptr_eq(&known, matrix.pattern())) {
            self.solvers.iter_mut().for_each(|solver| *solver = None);
            self.fatigue.discard();
        }
        if !self.fatigue.is_tired()
            && let Some(diagonal) = &self.diagonal
            && diagonal.change(&self.session, matrix)? > Self::CHANGED
        {
            self.fatigue.discard();
        }
        Ok(())
    }

    fn step_up(&mut self, tried: &LinearAttempt) {
        let why = match tried.residual.is_finite() {
            true => format!("true residual {:.1e} > {:.1e}", tried.residual, tried.tolerance),
            false => format!("{} after {} iterations", tried.reason, tried.iterations),
        };
        let from = self.preset().name;
        (self.rung, self.calm) = (self.rung + 1, 0);
        self.fatigue = SetupAge::default();
        self.fallbacks.push(Fallback { from, to: self.preset().name, why });
    }

    /// Returns to the first rung after enough solves without a failure.
    fn step_down(&mut self) {
        self.calm += 1;
        if self.rung > 0 && self.calm > self.patience {
            (self.rung, self.calm) = (0, 0);
            self.patience = self.patience.saturating_mul(2);
            self.fatigue = SetupAge::default();
        }
    }

    /// Solves once on the current rung. `rhs` comes with its norm, and the matrix with its source.
    fn attempt(
        &mut self,
        matrix: &Matrix,
        source: Option<&Rc<MatrixSource>>,
        rhs: &Vector,
        size: f64,
        x: &mut Vector,
        tolerance: f64,
    ) -> Result<LinearAttempt> {
        let (setup, solve) = (self.setup.clone(), self.solve.clone());
        let renew = self.factorises() || self.fatigue.is_tired();
        let reuse = if renew { Reuse::Renew } else { Reuse::Keep };
        if let (true, Some(own)) = (self.preset().is_own(), self.own.borrow_mut().as_mut()) {
            setup.time(|| own.prepare(matrix, source, reuse))?;
        }
        if self.overlaps() {
            setup.time(|| self.factorise(matrix, reuse))?;
        }
        if renew && self.coarsens() {
            self.solvers[self.rung] = None;
        }
        if renew {
            let makes_its_own = self.factorises() || self.preset().decides_on_renewal();
            self.set_up_for = source.filter(|_| !makes_its_own).cloned();
            self.diagonal = if makes_its_own { None } else { Some(DiagonalBlocks::of(matrix)?) };
        }
        let most = self.most();
        let krylov = self.krylov()?;
        krylov.set_operators(matrix, matrix)?;
        krylov.reuse_preconditioner(reuse)?;
        krylov.set_tolerances(tolerance, 0.0, most)?;
        let tolerance = krylov.tolerance()?;
        setup.time(|| krylov.set_up())?;
        let outcome = solve.time(|| krylov.solve(rhs, x))?;
        let residual = match outcome.converged() {
            true if size > 0.0 => residual_norm(matrix, rhs, x, &mut self.work)? / size,
            true => 0.0,
            false => f64::INFINITY,
        };
        let iterations = outcome.iterations as u32;
        self.fatigue.record(renew, iterations, tolerance);
        if let (true, Some(own)) = (self.preset().is_own(), self.own.borrow_mut().as_mut()) {
            own.learn(self.fatigue.is_poor());
        }
        let reason = outcome.reason.to_string();
        let tried = LinearAttempt { iterations, residual, tolerance, reason, reuse };
        match self.preset().iterative {
            true => Ok(tried),
            false => tried.at_rounding(matrix, x, &mut self.work, size),
        }
    }

    /// The Krylov solver of the current rung, created on first use.
    fn krylov(&mut self) -> Result<&mut KrylovSolver> {
        if self.solvers[self.rung].is_none() {
            let mut krylov = KrylovSolver::new(&self.session, &self.prefix)?;
            let options = self.ladder[self.rung].options_on(self.session.size() as usize);
            let given = |name: &str| self.session.is_given(&format!("{}{name}", self.prefix));
            let options = beside_the_users(options, given);
            let ranks = self.session.size().to_string();
            let alone = self.alone && ranks != "1" && !self.ladder[self.rung].iterative;
            krylov.configure(&if alone { on_one_rank(&options, &ranks) } else { options })?;
            let own = !self.session.is_given(&format!("{}pc_type", self.prefix));
            if own && self.ladder[self.rung].is_own() {
                let own = Rc::clone(&self.own);
                krylov.set_shell_preconditioner(move |r, z| match own.borrow_mut().as_mut() {
                    Some(own) => own.apply(r, z),
                    None => Err(Error::internal("a preconditioner was used before it was assembled")),
                })?;
            }
            if self.overlaps() {
                let subdomain = Rc::clone(&self.subdomain);
                krylov.set_shell_preconditioner(move |r, z| match subdomain.borrow_mut().as_mut() {
                    Some(subdomain) => {
                        subdomain.apply(r, z);
                        Ok(())
                    }
                    None => Err(Error::internal("factors were used before they were made")),
                })?;
            }
            if !self.symmetric {
                refuse_symmetric_method(&krylov)?;
            }
            self.solvers[self.rung] = Some(krylov);
        }
        self.solvers[self.rung].as_mut().ok_or_else(|| Error::internal("the linear solver was not made"))
    }
}
