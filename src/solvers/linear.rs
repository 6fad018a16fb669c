//! Linear solves: the presets of a ladder, each checked by the true residual.

use std::rc::Rc;

use super::ladder::{LinearChoice, Problem, ladder};
use super::presets::Preset;
use crate::error::{Error, Result};
use crate::petsc::{Event, Krylov, Matrix, Reuse, Session, Vector, residual_norm};

/// How a linear solve ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solved {
    /// Krylov iterations of all attempts.
    pub iterations: u32,
    /// True residual over the right side.
    pub residual: f64,
    /// The preset that did it.
    pub preset: &'static str,
}

/// Solves with the current preset of the ladder and steps up where that fails.
pub struct LinearSolver {
    session: Rc<Session>,
    prefix: String,
    ladder: Vec<&'static Preset>,
    solvers: Vec<Option<Krylov>>,
    /// Current rung.
    rung: usize,
    /// Solves since the last step up.
    calm: u32,
    symmetric: bool,
    fatigue: Fatigue,
    work: Vector,
    setup: Event,
    solve: Event,
}

impl LinearSolver {
    /// Iterations after which a preset counts as failed.
    const MAX_ITERATIONS: usize = 500;
    /// Solves on a higher rung before the first is tried again.
    const CALM: u32 = 50;
    /// The true residual may miss the tolerance by this factor before the solve counts as failed.
    const SLACK: f64 = 10.0;

    /// A solver for such problems with vectors like `pattern` and PETSc options under `prefix`.
    ///
    /// # Errors
    /// When the choice does not fit the problem.
    pub fn new(pattern: &Vector, prefix: &str, choice: &LinearChoice, problem: &Problem) -> Result<Self> {
        let session = pattern.session();
        let ladder = ladder(choice, problem)?;
        Ok(Self {
            session: session.clone(),
            prefix: prefix.to_owned(),
            solvers: ladder.iter().map(|_| None).collect(),
            ladder,
            rung: 0,
            calm: 0,
            symmetric: problem.symmetric,
            fatigue: Fatigue::default(),
            work: pattern.like()?,
            setup: Event::register(session, "SolverSetUp")?,
            solve: Event::register(session, "Solve")?,
        })
    }

    /// The presets in the order in which they are tried.
    pub fn describe(&self) -> String {
        self.ladder.iter().map(|preset| preset.name).collect::<Vec<_>>().join(", then ")
    }

    /// The preset in use.
    pub fn preset(&self) -> &'static Preset {
        self.ladder[self.rung]
    }

    /// `x` with `|matrix x - rhs| <= tolerance |rhs|`, or `None` where the last rung failed too. Collective.
    ///
    /// # Errors
    /// When PETSc refuses, or a user's option asks for a method that the matrix does not allow.
    pub fn solve(
        &mut self,
        matrix: &Matrix,
        rhs: &Vector,
        x: &mut Vector,
        tolerance: f64,
    ) -> Result<Option<Solved>> {
        let mut iterations = 0;
        self.step_down();
        loop {
            let tried = self.attempt(matrix, rhs, x, tolerance)?;
            iterations += tried.iterations;
            if tried.residual <= Self::SLACK * tolerance.max(1e-9) {
                return Ok(Some(Solved { iterations, ..tried }));
            }
            if self.rung + 1 == self.ladder.len() {
                return Ok(None);
            }
            self.rung += 1;
            self.calm = 0;
            self.fatigue = Fatigue::default();
        }
    }

    /// Goes back to the first rung after a calm time.
    fn step_down(&mut self) {
        self.calm += 1;
        if self.rung > 0 && self.calm > Self::CALM {
            self.rung = 0;
            self.calm = 0;
            self.fatigue = Fatigue::default();
        }
    }

    fn attempt(&mut self, matrix: &Matrix, rhs: &Vector, x: &mut Vector, tolerance: f64) -> Result<Solved> {
        let preset = self.preset();
        let symmetric = self.symmetric;
        let (setup, solve) = (self.setup.clone(), self.solve.clone());
        let renew = !preset.iterative || self.fatigue.is_tired();
        let krylov = self.krylov()?;
        krylov.set_operators(matrix, matrix)?;
        krylov.reuse_preconditioner(if renew { Reuse::Renew } else { Reuse::Keep })?;
        krylov.set_tolerances(tolerance, 0.0, Self::MAX_ITERATIONS)?;
        if !symmetric {
            refuse_symmetric_method(krylov)?;
        }
        setup.time(|| krylov.set_up())?;
        let outcome = solve.time(|| krylov.solve(rhs, x))?;
        let size = rhs.norm()?;
        let residual = match outcome.converged() {
            true if size > 0.0 => residual_norm(matrix, rhs, x, &mut self.work)? / size,
            true => 0.0,
            false => f64::INFINITY,
        };
        self.fatigue.record(renew, outcome.iterations as u32, tolerance);
        if !renew && !residual.is_finite() {
            self.fatigue = Fatigue::default();
            return self.attempt(matrix, rhs, x, tolerance);
        }
        Ok(Solved { iterations: outcome.iterations as u32, residual, preset: preset.name })
    }

    /// The Krylov solver of the current rung, made on first use.
    fn krylov(&mut self) -> Result<&mut Krylov> {
        let slot = &mut self.solvers[self.rung];
        if slot.is_none() {
            let mut krylov = Krylov::new(&self.session, &self.prefix)?;
            krylov.configure(&self.ladder[self.rung].options_on(self.session.size() as usize))?;
            *slot = Some(krylov);
        }
        slot.as_mut().ok_or_else(|| Error::internal("the linear solver was not made"))
    }
}

/// Whether a preconditioner of an earlier matrix still serves: contact and step change the matrix little, and an
/// incomplete factorisation costs as much as several iterations.
#[derive(Debug, Clone, Copy, Default)]
struct Fatigue {
    /// Digits an iteration gained while the preconditioner was new; 0 before there is one.
    fresh: f64,
    /// Digits an iteration gained last.
    last: f64,
}

impl Fatigue {
    /// A preconditioner is made anew when an iteration gains less than this part of what it gained at first.
    const WORTH: f64 = 0.7;

    fn is_tired(self) -> bool {
        self.last <= Self::WORTH * self.fresh
    }

    fn record(&mut self, renewed: bool, iterations: u32, tolerance: f64) {
        self.last = -tolerance.log10() / f64::from(iterations.max(1));
        if renewed {
            self.fresh = self.last;
        }
    }
}

/// Methods of PETSc that rely on a symmetric operator.
const SYMMETRIC_METHODS: [&str; 8] = ["cg", "fcg", "pipecg", "groppcg", "minres", "symmlq", "cgne", "nash"];

/// The user may have chosen a method by PETSc's options that this matrix does not allow.
fn refuse_symmetric_method(krylov: &Krylov) -> Result<()> {
    let (method, _) = krylov.types()?;
    if !SYMMETRIC_METHODS.contains(&method.as_str()) {
        return Ok(());
    }
    let message =
        format!("KSP type '{method}' needs a symmetric matrix, and friction makes this one non-symmetric");
    Err(Error::case(message).hint("use -ksp_type gmres or fgmres, or leave the choice to the program"))
}
