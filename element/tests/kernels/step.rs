//! Forces over a step: their work, their tangent, their moment.

use super::*;
use serial::lanes::on_portable_lanes;

struct Motion {
    start: Vec<f64>,
    middle: Vec<f64>,
    end: Vec<f64>,
}

fn motion<const D: usize>(mesh: &Mesh<D>) -> Motion {
    let (start, moved) = (random(mesh, 0.02, 31), random(mesh, 0.015, 32));
    let along = |by: f64| start.iter().zip(&moved).map(|(u, d)| u + by * d).collect();
    Motion { middle: along(1.0), end: along(2.0), start }
}

fn assemble_step<const D: usize>(
    mesh: &Mesh<D>,
    solid: &Solid<D>,
    u: [&[f64]; 2],
    terms: Terms,
) -> (DVector<f64>, DMatrix<f64>) {
    solid.assemble(mesh, Some(u[0]), u[1], terms)
}

fn work<const D: usize>(kind: ElementKind, mesh: &Mesh<D>) {
    let Motion { start, middle, end } = motion(mesh);
    let everyone = vec![true; mesh.element_count()];
    for formulation in variants(kind) {
        let group = group(mesh, formulation);
        let force = assemble_step(mesh, &group, [&start, &middle], Terms::empty()).0;
        let work: f64 = force.iter().zip(start.iter().zip(&end)).map(|(f, (a, b))| f * (b - a)).sum();
        let [before, after] = [&start, &end].map(|u| group.strain_energy(u, &everyone));
        assert!(
            (work - (after - before)).abs() < 1e-13 * after.max(before),
            "{kind} {formulation:?}: {work}"
        );
        let resultant =
            (0..D).map(|i| force.iter().skip(i).step_by(D).sum::<f64>().abs()).fold(0.0, f64::max);
        assert!(
            resultant < 1e-13 * force.amax() * force.len() as f64,
            "{kind}: forces of a body add up to zero"
        );
        if formulation.kinematics == Kinematics::Finite {
            let place = |a: usize, i: usize| mesh.points[a][i] + middle[a * D + i];
            let about = |a: usize| place(a, 0) * force[a * D + 1] - place(a, 1) * force[a * D];
            let moment: f64 = (0..mesh.points.len()).map(about).sum();
            assert!(
                moment.abs() < 1e-13 * force.amax() * force.len() as f64,
                "{kind} {formulation:?}: {moment}"
            );
        }
    }
}

/// Over a step the work of the forces equals the increase of energy. The forces have no resultant,
/// and no moment about the positions in the middle of the step. This holds for every element, law,
/// kinematics and treatment of locking.
#[test]
fn forces_over_a_step_conserve() {
    for_every_kind!(work);
}

fn derivatives<const D: usize>(kind: ElementKind, mesh: &Mesh<D>) {
    let Motion { start, middle, .. } = motion(mesh);
    let d = random(mesh, 0.01, 33);
    for formulation in variants(kind) {
        let group = group(mesh, formulation);
        let force = |u: &[f64]| plain(assemble_step(mesh, &group, [&start, u], Terms::empty()).0);
        let rate = |terms| {
            let change = |u: &[f64], d: &[f64]| {
                plain(assemble_step(mesh, &group, [&start, u], terms).1 * DVector::from_column_slice(d))
            };
            taylor_rate(force, change, &middle, &d)
        };
        assert!(rate(Terms::ALL) > 1.9, "{kind} {formulation:?}: {}", rate(Terms::ALL));
        assert!(rate(Terms::GEOMETRIC) < 1.3, "{kind}: the material stiffness is not missed");
    }
}

/// The tangent over a step is the derivative of the force by the displacement in its middle, to
/// second order.
#[test]
fn tangent_over_a_step_has_order_two() {
    for_every_kind!(derivatives);
}

#[derive(Default)]
struct Rows(Vec<f64>);

impl ElementSink for Rows {
    fn element(&mut self, _: usize, force: &[f64], stiffness: Option<&[f64]>) {
        self.0.extend_from_slice(force);
        self.0.extend_from_slice(stiffness.unwrap_or_default());
    }
}

/// Portable lanes agree with the fast ones, and a step whose end state is inverted is reported.
#[test]
fn lanes_agree_over_a_step() {
    let mesh = distorted::<3>(ElementKind::Hex8);
    let Motion { start, middle, .. } = motion(&mesh);
    let group = group(&mesh, formulation(neo_hookean(), Kinematics::Finite, Locking::SelectiveReduced));
    let (mut fast, mut plain) = (Rows::default(), Rows::default());
    group.evaluate_step(&start, &middle, Request::TANGENT, &mut fast).unwrap();
    on_portable_lanes(|| group.evaluate_step(&start, &middle, Request::TANGENT, &mut plain)).unwrap();
    let largest = fast.0.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    assert!(fast.0.iter().zip(&plain.0).all(|(a, b)| (a - b).abs() < 1e-13 * largest));
    let squeezed: Vec<f64> = mesh.points.iter().flat_map(|p| [-0.6 * p[0], 0.0, 0.0]).collect();
    let still = vec![0.0; squeezed.len()];
    let found = group.evaluate_step(&still, &squeezed, Request::FORCE, &mut Rows::default()).unwrap_err();
    assert!(found.det < 0.0 && found.element == 0, "{found:?}");
}
