//! A system without bodies, contact or mesh: Newton's method and the integrators need no more than
//! [`Equations`].

use std::rc::Rc;

use contact_petsc::case::Units;
use contact_petsc::dynamics::{
    Augmentation, ContactMonitor, Continuation, Equations, FloatingBodies, Lift, MultigridHints,
    PressureLinearisation, Residual, Resumption, Stage, Staging,
};
use contact_petsc::error::{Error, Result};
use contact_petsc::petsc::{BlockPattern, Format, Matrix, Session, Vector};
use contact_petsc::solvers::{LinearChoice, LinearSolver, Monolithic, NewtonSettings, Outcome, Problem};
use contact_petsc::terms::Terms;
use contact_petsc::time::{Integrate, Scheme};

/// Duffing's oscillator `u'' + u + u^3 = 0` in each of two directions, of mass 1 kg.
struct Duffing {
    matrix: Matrix,
    pattern: Vector,
    continuation: Continuation,
}

impl Duffing {
    fn new(session: &Rc<Session>) -> Result<Self> {
        let pattern = BlockPattern {
            block_size: 2,
            first_row: 0,
            row_offsets: vec![0, 1],
            columns: vec![0],
            places: vec![0],
        };
        Ok(Self {
            matrix: Matrix::new(session, &Rc::new(pattern), Format::Aij)?,
            pattern: Vector::ghosted(session, 1, 2, &[])?,
            continuation: Continuation::default(),
        })
    }

    fn force(u: f64) -> f64 {
        u + u.powi(3)
    }
}

impl Equations for Duffing {
    fn prescribe(&mut self, _: &mut Stage) -> Result<()> {
        Ok(())
    }

    fn residual(&mut self, stage: &Stage, out: &mut Vector) -> Result<Residual> {
        let u = stage.trial.u.owned();
        let a = stage.trial.a.owned();
        let a_start = stage.start.a.owned();
        let start_forces = stage.start_forces.owned();
        let [at_start, at_end] = stage.balance.mass;
        let mut scale: f64 = 0.0;
        {
            let mut out = out.owned_mut();
            for i in 0..2 {
                let force = Self::force(u[i]);
                scale = scale.hypot(force);
                out[i] = at_start * a_start[i]
                    + at_end * a[i]
                    + stage.balance.start_force * start_forces[i]
                    + force;
            }
        }
        Ok(Residual { norm: out.norm()?, scale })
    }

    fn jacobian(&mut self, stage: &Stage, _: Terms, _: Option<Lift>) -> Result<()> {
        let u = stage.trial.u.owned();
        let inertia = stage.balance.mass[1] * stage.shifts.acceleration;
        self.matrix.fill(|values| {
            values.zero();
            (0..2).for_each(|i| values.add_diagonal(i, inertia + 1.0 + 3.0 * u[i].powi(2)));
        })
    }

    fn jacobian_into(&mut self, stage: &Stage, terms: Terms, matrix: &mut Matrix) -> Result<()> {
        self.jacobian(stage, terms, None)?;
        matrix.copy_values_from(&self.matrix)
    }

    fn matrix(&self) -> &Matrix {
        &self.matrix
    }

    fn fault(&mut self) -> Option<Error> {
        None
    }

    fn rounding(&self, _: &Stage) -> Result<f64> {
        Ok(f64::EPSILON)
    }

    fn continuation(&self) -> &Continuation {
        &self.continuation
    }

    fn units(&self) -> Units {
        Units::default()
    }

    fn extent(&self) -> f64 {
        1.0
    }
}

impl ContactMonitor for Duffing {}
impl PressureLinearisation for Duffing {}
impl Staging for Duffing {}
impl Augmentation for Duffing {}
impl FloatingBodies for Duffing {}
impl MultigridHints for Duffing {}
impl Resumption for Duffing {}

/// Displacement at t = 2 s after a start at 1 m and 2 m at rest, and the largest number of
/// corrections of a step.
fn swing(session: &Rc<Session>, scheme: Scheme, steps: u32) -> Result<([f64; 2], u32)> {
    let mut system = Duffing::new(session)?;
    let problem = Problem {
        unknowns: 2,
        dimension: 2,
        dynamic: true,
        symmetric: false,
        contact: false,
        joins_bodies: false,
        tied: false,
        nearly_incompressible: false,
        format: None,
    };
    let linear = LinearSolver::new(&system.pattern, "", &LinearChoice::Named("direct"), &problem)?;
    let settings = NewtonSettings {
        tolerance: 1e-12,
        max_iterations: 10,
        linear: [1e-12; 2],
        line_search: true,
        keep_tangent: false,
        terms: Terms::ALL,
    };
    let mut newton = Monolithic::new(settings, linear, &system.pattern)?;
    let mut stage = Stage::at_rest(&system.pattern)?;
    for (i, start) in [1.0, 2.0].into_iter().enumerate() {
        stage.start.u.owned_mut()[i] = start;
        stage.start.a.owned_mut()[i] = -Duffing::force(start);
    }
    let dt = 2.0 / f64::from(steps);
    let mut most = 0;
    for step in 1..=steps {
        for i in 0..2 {
            let force = Duffing::force(stage.start.u.owned()[i]);
            stage.start_forces.owned_mut()[i] = force;
        }
        scheme.prepare(&mut stage, dt, f64::from(step) * dt)?;
        scheme.extrapolate(&mut stage)?;
        match newton.solve(&mut system, &mut stage, |_| ())? {
            Outcome::Converged(report) => most = most.max(report.newton),
            Outcome::Failed(_, reason) => panic!("{scheme:?}, step {step}: {reason}"),
        }
        scheme.finish(&mut stage, f64::from(step) * dt)?;
        stage.accept();
    }
    let u = stage.start.u.owned();
    Ok(([u[0], u[1]], most))
}

/// Each scheme converges with its order to the solution of a fine step, by quadratic corrections.
pub fn orders(session: &Rc<Session>) {
    let exact = swing(session, Scheme::generalized_alpha(0.8), 1 << 12).expect("PETSc").0;
    for (scheme, order) in [
        (Scheme::newmark(0.25, 0.5), 2.0),
        (Scheme::hht(0.9), 2.0),
        (Scheme::generalized_alpha(0.5), 2.0),
        (Scheme::Midpoint, 2.0),
        (Scheme::BackwardEuler, 1.0),
    ] {
        let error = |steps: u32| {
            let (u, most) = swing(session, scheme, steps).expect("PETSc");
            assert!(most <= 4, "{scheme:?}: {most} corrections");
            (u[0] - exact[0]).hypot(u[1] - exact[1])
        };
        let rate = (error(256) / error(512)).log2();
        println!("{scheme:?}: rate {rate:.3}");
        assert!((rate - order).abs() < 0.1, "{scheme:?}: rate {rate}");
    }
}
