//! Balances of the equations of motion: free fall, momentum, energy.

use std::rc::Rc;

use contact_petsc::assembly::{SystemOptions, set_velocity};
use contact_petsc::mesh::ElementKind::{self, Hex8, Quad4, Tet10, Tri6};
use contact_petsc::petsc::{Format, Session};
use contact_petsc::solvers::{LinearChoice, Outcome};
use contact_petsc::tensor::Vector;
use contact_petsc::time::{Integrate, Scheme};

use super::march::{Results, run};
use super::scene::{DENSITY, POISSON, Scene, Solid, YOUNG, function};

pub fn all(session: &Rc<Session>) {
    free_fall::<2>(session);
    free_fall::<3>(session);
    energy(session);
    momentum::<2>(session, Quad4);
    momentum::<2>(session, Tri6);
    momentum::<3>(session, Hex8);
    momentum::<3>(session, Tet10);
}

/// A body without supports: `u = -g t^2 / 2`, `v = -g t`, and the work of the weight becomes
/// kinetic energy.
fn free_fall<const D: usize>(session: &Rc<Session>) {
    let row = |value: &str| vec![value; D].join(", ");
    let g = if D == 2 { "0, -9.81" } else { "0, 0, -9.81" };
    let text = format!(
        "dimension: {D}
bodies:
  block:
    mesh: {{ box: {{ min: [{}], max: [{}], cells: [{}] }} }}
    material: {{ neo_hookean: {{ young_modulus: {YOUNG}, poisson_ratio: {POISSON} }} }}
    density: {DENSITY}
boundary: {{ weight: {{ on: block, gravity: [{g}] }} }}
time: {{ end: 0.5, step: 0.05, scheme: {{ newmark: {{ beta: 0.25, gamma: 0.5 }} }} }}
output: {{ fields: {{ every: 1000000 }}, probes: {{ corner: {{ at: [{}] }} }} }}
",
        row("0"),
        row("1"),
        row("2"),
        row("1"),
    );
    let Some(results) = run(session, &text) else { return };
    let probes = results.table("probes.csv");
    let last = ["x", "y", "z"][D - 1];
    let (u, v) = (probes.column(&format!("corner.u_{last}")), probes.column(&format!("corner.v_{last}")));
    let kinetic = results.table("energy.csv").column("kinetic");
    for (step, t) in probes.column("time").into_iter().enumerate() {
        assert!((u[step] + 0.5 * 9.81 * t * t).abs() < 1e-10, "t = {t}: u = {}", u[step]);
        assert!((v[step] + 9.81 * t).abs() < 1e-9, "t = {t}: v = {}", v[step]);
        assert!(
            (kinetic[step] - 0.5 * DENSITY * (9.81 * t).powi(2)).abs() < 1e-8,
            "t = {t}: {}",
            kinetic[step]
        );
    }
    closes(&results, 1e-9, "free fall");
}

/// The residual of the energy balance, divided by the largest energy.
fn closes(results: &Results, tolerance: f64, what: &str) {
    let table = results.table("energy.csv");
    let columns = ["kinetic", "strain", "external_work"].map(|name| table.column(name));
    let scale = columns.iter().flatten().fold(0.0f64, |most, value| most.max(value.abs()));
    let worst = table.column("numerical").iter().fold(0.0f64, |most, value| most.max(value.abs()));
    println!("{what}: {worst:.1e} of {scale:.1e} J left over");
    assert!(worst < tolerance * scale, "{what}: {worst:.1e} of {scale:.1e} J left over");
}

/// The energy balance of a linear bar with Newmark's average acceleration closes to rounding: in
/// free oscillation, under a suddenly applied traction, and on a support with constant acceleration
/// from the start.
fn energy(session: &Rc<Session>) {
    let bar = |velocity: &str, boundary: &str| {
        let text = format!(
            "dimension: 2
bodies:
  bar:
    mesh: {{ box: {{ min: [0, 0], max: [4, 1], cells: [12, 3] }} }}
    material: {{ saint_venant_kirchhoff: {{ young_modulus: {YOUNG}, poisson_ratio: {POISSON} }} }}
    density: {DENSITY}
    kinematics: linear
    initial_velocity: [\"{velocity}\", 0]
boundary:
{boundary}
time: {{ end: 4, step: 0.1, scheme: {{ newmark: {{ beta: 0.25, gamma: 0.5 }} }} }}
output: {{ fields: {{ every: 1000000 }} }}
"
        );
        run(session, &text)
    };
    let held = "  wall: { on: bar.left, displacement: { x: 0, y: 0 } }";
    if let Some(results) = bar("0.1 * x", held) {
        closes(&results, 1e-8, "oscillating bar");
        let table = results.table("energy.csv");
        let (total, strain) = (table.column("total"), table.column("strain"));
        assert!(total.iter().all(|energy| (energy - total[0]).abs() < 1e-8 * total[0]), "{total:?}");
        assert!(strain.iter().any(|energy| *energy > 0.5 * total[0]), "the bar swings: {strain:?}");
    }
    let pulled = format!("{held}\n  pull: {{ on: bar.right, traction: {{ x: 0.5, y: 0.1 }} }}");
    if let Some(results) = bar("0", &pulled) {
        closes(&results, 1e-8, "pulled bar");
    }
    let driven = "  wall: { on: bar.left, displacement: { x: \"0.15 * t^2\", y: 0 } }";
    if let Some(results) = bar("0", driven) {
        closes(&results, 1e-8, "driven bar");
    }
}

/// A free body that flies, spins and vibrates at finite strain conserves its linear momentum. Its
/// angular momentum drifts with the square of the step.
fn momentum<const D: usize>(session: &Rc<Session>, kind: ElementKind) {
    let [coarse, fine] = [0.04, 0.02].map(|step| drift::<D>(session, kind, step));
    let rate = (coarse / fine).log2();
    if session.rank() == 0 {
        println!("{kind}: drift of the angular momentum {coarse:.1e} {fine:.1e}, rate {rate:.2}");
    }
    assert!(fine < 1e-3 && rate > 1.8, "{kind}: {coarse:.1e} {fine:.1e}");
}

/// Relative change of the angular momentum.
fn drift<const D: usize>(session: &Rc<Session>, kind: ElementKind, step: f64) -> f64 {
    let mut model = Solid::new(kind, "neo_hookean").model::<D>();
    let spin = ["0.3 - 1.5 * y + 0.4 * x", "0.2 + 1.5 * x - 0.6 * y * x", "0.1 + 0.5 * x - 0.4 * z"];
    model.bodies[0].initial_velocity = spin[..D].iter().map(|text| function(text)).collect();
    let options = SystemOptions { inertia: true, format: Format::Baij };
    let mesh = Solid::new(kind, "neo_hookean").mesh(2, |_| ());
    let mut scene = Scene::new(session, mesh, &model, options);
    // Undeformed and unloaded: the acceleration at the start is zero.
    set_velocity(&scene.system, &mut scene.stage, &model).expect("PETSc");
    let mut strategy = scene.strategy(&LinearChoice::Named("direct"), true);
    let at_start = momenta(&scene);
    for _ in 0..(0.4 / step).round() as usize {
        let Scene { system, stage, .. } = &mut scene;
        let end = stage.start.time + step;
        Scheme::newmark(0.25, 0.5).prepare(stage, step, end).expect("PETSc");
        let outcome = strategy.solve(system, stage, |_| ()).expect("PETSc");
        assert!(matches!(outcome, Outcome::Converged(_)), "{outcome:?}");
        system.accept(stage).expect("PETSc");
    }
    let at_end = momenta(&scene);
    for i in 0..D {
        assert!((at_end[i] - at_start[i]).abs() < 1e-9, "{kind}: {at_start:?} becomes {at_end:?}");
    }
    let norm = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>().sqrt();
    let change: Vec<f64> = (3..6).map(|k| at_end[k] - at_start[k]).collect();
    norm(&change) / norm(&at_start[3..])
}

/// Linear and angular momentum.
fn momenta<const D: usize>(scene: &Scene<D>) -> [f64; 6] {
    let (u, v) = (scene.stage.start.u.local(), scene.stage.start.v.local());
    scene.integrate([&u[..], &v[..]], |x, [u, v]| {
        let full = |w: Vector<D>| Vector::<3>::from_fn(|i, _| if i < D { w[i] } else { 0.0 });
        let (arm, v) = (full(x + u), full(v));
        let spin = arm.cross(&v);
        [v[0], v[1], v[2], spin[0], spin[1], spin[2]].map(|value| DENSITY * value)
    })
}
