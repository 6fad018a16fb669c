//! The assembled matrix is the derivative of the whole residual: Taylor tests with every term
//! active.

use std::rc::Rc;

use contact_petsc::dynamics::{ContactMonitor, Equations, Lift};
use contact_petsc::petsc::{Format, Operator, Session, Symmetry, Vector as Distributed};
use contact_petsc::terms::Terms;
use contact_petsc::time::{Integrate, Scheme};

use super::cases::{Case, plane_cases, solid_cases};
use super::scene::Scene;

pub fn all(session: &Rc<Session>) {
    let plane = plane_cases();
    let solid = solid_cases();
    for format in [Format::Aij, Format::Baij] {
        plane.iter().for_each(|case| check(session, case, format));
        solid.iter().for_each(|case| check(session, case, format));
    }
}

/// Pseudo-random numbers in (-1, 1) that depend on the node of the input mesh and not on the
/// partition.
pub fn scatter<const D: usize>(scene: &Scene<D>, seed: f64) -> Vec<f64> {
    let entry = |node: &u32, i: usize| {
        ((f64::from(*node) * D as f64 + i as f64 + 1.0) * 12.9898 + seed * 78.233).sin()
    };
    let number = |value: f64| 2.0 * (value * 43_758.545_3 - (value * 43_758.545_3).floor()) - 1.0;
    scene.local().input_node.iter().flat_map(|node| (0..D).map(move |i| number(entry(node, i)))).collect()
}

pub fn set(vector: &mut Distributed, values: impl IntoIterator<Item = f64>) {
    vector.local_mut().iter_mut().zip(values).for_each(|(entry, value)| *entry = value);
}

/// One for the nodes of the block, zero for those of the body below.
fn moving<const D: usize>(scene: &Scene<D>) -> Vec<f64> {
    let mesh = &scene.local().mesh;
    let mut moves = vec![1.0; mesh.points.len()];
    for element in (0..mesh.element_count()).filter(|&element| mesh.body[element] == 1) {
        mesh.element_nodes(element).iter().for_each(|&node| moves[node as usize] = 0.0);
    }
    moves
}

/// Sets the stage to a random state in the middle of a step of generalised-alpha.
pub fn disturb<const D: usize>(scene: &mut Scene<D>) {
    let [start, velocity, acceleration, forces, change] =
        [1.0, 2.0, 3.0, 4.0, 5.0].map(|seed| scatter(scene, seed));
    let moves = moving(scene);
    let stage = &mut scene.stage;
    set(&mut stage.start.u, start.iter().map(|value| 0.02 * value));
    set(
        &mut stage.start.v,
        velocity
            .iter()
            .enumerate()
            .map(|(dof, value)| moves[dof / D] * [5.0, 3.0, 0.5][dof % D] + 0.4 * value),
    );
    set(&mut stage.start.a, acceleration.iter().map(|value| 3.0 * value));
    set(&mut stage.start_forces, forces);
    stage.start.time = 0.3;
    Scheme::generalized_alpha(0.8).prepare(stage, 0.1, 0.4).expect("PETSc");
    // Along x and y all points of the block move on, so that the increment slips where the velocity does.
    let drift = [0.03, 0.02, 0.0];
    let last = |dof: usize| dof % D == D - 1;
    let moved = start.iter().zip(change).enumerate();
    let moved = moved.map(|(dof, (start, change))| {
        0.02 * (start + 0.5 * change) + if last(dof) { 0.0 } else { moves[dof / D] * drift[dof % D] }
    });
    set(&mut stage.trial.u, moved);
}

/// Records the closed points of the trial state as those of the last two iterates. Without this the matrix
/// has their stiffness, but not their tractions (theory, section 5.1).
pub fn note_closed_points<const D: usize>(scene: &mut Scene<D>) {
    let Scene { system, stage, .. } = scene;
    let mut out = stage.trial.u.like().expect("PETSc");
    stage.update_rates().expect("PETSc");
    system.prescribe(stage).expect("PETSc");
    system.residual(stage, &mut out).expect("PETSc");
    for _ in 0..2 {
        system.observe().expect("PETSc");
    }
}

/// Residual at the state `u + h d`; prescribed unknowns do not move.
pub fn residual<const D: usize>(
    scene: &mut Scene<D>,
    (u, d): (&Distributed, &Distributed),
    h: f64,
) -> Distributed {
    let mut out = u.like().expect("PETSc");
    let Scene { system, stage, .. } = scene;
    stage.trial.u.waxpy(h, d, u).expect("PETSc");
    stage.update_rates().expect("PETSc");
    system.prescribe(stage).expect("PETSc");
    let found = system.residual(stage, &mut out).expect("PETSc");
    assert!(found.norm.is_finite(), "an inverted element");
    out
}

/// Matrix of the terms at `u`, times `d`.
fn slope<const D: usize>(
    scene: &mut Scene<D>,
    (u, d): (&Distributed, &Distributed),
    terms: Terms,
) -> Distributed {
    residual(scene, (u, d), 0.0);
    let mut out = u.like().expect("PETSc");
    scene.system.jacobian(&scene.stage, terms, None).expect("PETSc");
    scene.system.matrix().multiply(d, &mut out).expect("PETSc");
    out
}

/// Order with which `R(u + h d) - R(u) - h K d` vanishes.
pub fn rate<const D: usize>(scene: &mut Scene<D>, at: (&Distributed, &Distributed), terms: Terms) -> f64 {
    let base = residual(scene, at, 0.0);
    let slope = slope(scene, at, terms);
    let [coarse, fine] = [0.5f64.powi(14), 0.5f64.powi(15)].map(|h: f64| {
        let mut rest = residual(scene, at, h);
        rest.axpy(-1.0, &base).expect("PETSc");
        rest.axpy(-h, &slope).expect("PETSc");
        rest.norm().expect("PETSc")
    });
    (coarse / fine).log2()
}

/// Order with which `R(u + h e) - R(u) + h rhs` vanishes. Prescribed unknowns change by `e`, and
/// `rhs` is the term that the matrix moves to the right-hand side for this change, in statics.
fn lift_rate<const D: usize>(scene: &mut Scene<D>, (u, e): (&Distributed, &mut Distributed)) -> f64 {
    e.update_ghosts().expect("PETSc");
    scene.stage.inertia = false;
    let mut moved = |h: f64| {
        let mut out = u.like().expect("PETSc");
        let Scene { system, stage, .. } = &mut *scene;
        stage.trial.u.waxpy(h, e, u).expect("PETSc");
        stage.update_rates().expect("PETSc");
        stage.trial.u.update_ghosts().expect("PETSc");
        stage.trial.v.update_ghosts().expect("PETSc");
        system.residual(stage, &mut out).expect("PETSc");
        out
    };
    let steps = [0.5f64.powi(14), 0.5f64.powi(15)];
    let ([coarse, fine], base) = (steps.map(&mut moved), moved(0.0));
    let mut rhs = u.like().expect("PETSc");
    let lift = Lift { change: e, rhs: &mut rhs };
    scene.system.jacobian(&scene.stage, Terms::ALL, Some(lift)).expect("PETSc");
    let [coarse, fine] = [(coarse, steps[0]), (fine, steps[1])].map(|(mut rest, h)| {
        rest.axpy(-1.0, &base).expect("PETSc");
        rest.axpy(h, &rhs).expect("PETSc");
        rest.norm().expect("PETSc")
    });
    (coarse / fine).log2()
}

/// The owned unknowns that are prescribed: those that `prescribe` changes.
pub fn prescribed<const D: usize>(scene: &mut Scene<D>) -> Vec<bool> {
    const FREE: f64 = 7.0;
    scene.stage.trial.u.set(FREE);
    scene.system.prescribe(&mut scene.stage).expect("PETSc");
    scene.stage.trial.u.owned().iter().map(|value| *value != FREE).collect()
}

fn check<const D: usize>(session: &Rc<Session>, case: &Case<D>, format: Format) {
    let mut scene = case.scene(session, format);
    let held = prescribed(&mut scene);
    disturb(&mut scene);
    note_closed_points(&mut scene);
    let mut u = scene.stage.trial.u.like().expect("PETSc");
    u.copy_from(&scene.stage.trial.u).expect("PETSc");
    let [free, mut fixed] = [false, true].map(|of_held| {
        let mut d = u.like().expect("PETSc");
        let values = scatter(&scene, 6.0).into_iter().zip(&held);
        set(&mut d, values.map(|(value, held)| if *held == of_held { 0.5 * value } else { 0.0 }));
        d
    });
    let at = (&u, &free);
    let name = format!("{} ({:?}, {} ranks)", case.name, format, session.size());
    let whole = rate(&mut scene, at, Terms::ALL);
    assert!(whole > 1.95, "{name}: rate {whole}");
    let at_work = case.at_work
        | Terms::MASS
        | Terms::DAMPING
        | Terms::SPRINGS
        | Terms::MATERIAL
        | Terms::GEOMETRIC
        | Terms::NORMAL_CONTACT;
    let follows = if case.current_area { Terms::FOLLOWING_LOAD } else { Terms::empty() };
    let at_work = at_work | follows;
    for term in Terms::ALL.iter() {
        let without = rate(&mut scene, at, Terms::ALL - term);
        let right = if at_work.contains(term) { without < 1.5 } else { without > 1.95 };
        assert!(right, "{name}: rate {without} without {term:?}, {whole} with it");
    }
    // Neither rows nor columns couple free and prescribed unknowns, the residual has no prescribed rows.
    let (by_free, by_fixed) =
        (slope(&mut scene, at, Terms::ALL), slope(&mut scene, (&u, &fixed), Terms::ALL));
    let force = residual(&mut scene, at, 0.0);
    let columns = [by_free.owned(), by_fixed.owned(), force.owned()];
    for (dof, held) in held.iter().enumerate() {
        let [by_free, by_fixed, force] = [columns[0][dof], columns[1][dof], columns[2][dof]];
        assert!(
            if *held { by_free == 0.0 && force == 0.0 } else { by_fixed == 0.0 },
            "{name}: unknown {dof}"
        );
    }
    drop(columns);
    let promised = scene.system.matrix().symmetry() == Symmetry::Symmetric;
    let asymmetry = scene.system.matrix().asymmetry().expect("PETSc");
    assert!(
        if promised { asymmetry < 1e-13 } else { asymmetry > 1e-8 },
        "{name}: {promised} but {asymmetry:.1e}"
    );
    let lifted = lift_rate(&mut scene, (&u, &mut fixed));
    assert!(lifted > 1.95, "{name}: rate {lifted} of the prescribed columns");
    if session.rank() == 0 {
        println!("{name}: rate {whole:.3}, asymmetry {asymmetry:.1e}");
    }
}
