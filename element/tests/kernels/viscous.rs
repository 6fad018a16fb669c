//! Viscous branches: derivatives over all elements, laws and treatments of locking, and the history.

use super::*;
use serial::lanes::WIDTH;
use serial::material::{GivenModuli, Overstress, PronySeries};

fn series() -> PronySeries {
    PronySeries::new(&[(0.3, 0.1), (0.2, 2.0)], GivenModuli::Instantaneous)
}

/// An overstress as after some motion.
fn overstress<const D: usize>(group: &ElementGroup<D>, u: &[f64], factor: f64) -> Overstress {
    let predicted = group.isochoric_stress(u).into_iter().map(|pack| pack.map(|stress| 0.7 * stress));
    Overstress { factor, predicted: predicted.collect() }
}

fn assemble_viscous<const D: usize>(
    mesh: &Mesh<D>,
    group: &ElementGroup<D>,
    u: &[f64],
    viscous: Option<&Overstress>,
    terms: Terms,
) -> (DVector<f64>, DMatrix<f64>) {
    let nodes = |index| mesh.element_nodes(group.elements()[index] as usize).to_vec();
    let mut sink = Dense::new(mesh, &nodes);
    group.evaluate_viscous(u, viscous, Request::of(terms), &mut sink).unwrap();
    (sink.force, sink.stiffness)
}

fn derivatives<const D: usize>(kind: ElementKind, mesh: &Mesh<D>) {
    let (u, d) = (random(mesh, 0.02, 21), random(mesh, 0.02, 22));
    let everyone = vec![true; mesh.element_count()];
    for formulation in variants(kind).into_iter().filter(|f| f.plane == PlaneState::Strain) {
        let what = format!("{kind} {formulation:?}");
        let group = group(mesh, formulation);
        let viscous = overstress(&group, &random(mesh, 0.02, 23), 0.9);
        let without_history = Overstress { predicted: Vec::new(), ..viscous.clone() };
        let energy = |u: &[f64]| {
            vec![group.group.strain_energy(u, &everyone) + 0.9 * group.isochoric_energy(u, &everyone)]
        };
        let force =
            |u: &[f64], viscous| plain(assemble_viscous(mesh, &group, u, Some(viscous), Terms::empty()).0);
        let work =
            |u: &[f64], d: &[f64]| vec![force(u, &without_history).iter().zip(d).map(|(f, d)| f * d).sum()];
        assert!(taylor_rate(energy, work, &u, &d) > 1.9, "{what}: the force is not that of the energy");
        let change = |u: &[f64], d: &[f64]| {
            let (_, stiffness) = assemble_viscous(mesh, &group, u, Some(&viscous), Terms::ALL);
            assert!((&stiffness - stiffness.transpose()).amax() < 1e-13 * stiffness.amax(), "{what}");
            plain(stiffness * DVector::from_column_slice(d))
        };
        let rate = taylor_rate(|u: &[f64]| force(u, &viscous), change, &u, &d);
        assert!(rate > 1.9, "{what}: the tangent is not the derivative of the force: {rate}");
        let elastic = |u: &[f64], d: &[f64]| {
            plain(assemble_viscous(mesh, &group, u, None, Terms::ALL).1 * DVector::from_column_slice(d))
        };
        let rate = taylor_rate(|u: &[f64]| force(u, &viscous), elastic, &u, &d);
        assert!(rate < 1.3, "{what}: the tangent of the branches is not missed");
    }
}

/// Force and tangent with viscous branches are derivatives to second order and the tangent is
/// symmetric, for every element, law, kinematics and treatment of locking.
#[test]
fn force_and_tangent_of_branches_have_order_two() {
    for_every_kind!(derivatives);
}

fn lanes<const D: usize>(kind: ElementKind, mesh: &Mesh<D>) {
    let u = random(mesh, 0.02, 24);
    let n = kind.nodes() * D;
    for formulation in variants(kind).into_iter().filter(|f| f.plane == PlaneState::Strain) {
        let whole = group(mesh, formulation);
        let viscous = overstress(&whole, &random(mesh, 0.02, 23), 0.9);
        let rows = |group: &ElementGroup<D>, viscous: &Overstress| {
            let mut rows: Vec<Vec<f64>> = Vec::new();
            struct Rows<'a>(&'a mut Vec<Vec<f64>>);
            impl ElementSink for Rows<'_> {
                fn element(&mut self, _: usize, force: &[f64], stiffness: Option<&[f64]>) {
                    self.0.push([force, stiffness.unwrap_or_default()].concat());
                }
            }
            group.evaluate_viscous(&u, Some(viscous), Request::TANGENT, &mut Rows(&mut rows)).unwrap();
            rows
        };
        let together = rows(&whole, &viscous);
        let (points, width) = (whole.full_points(), components(D));
        for index in 0..mesh.element_count() {
            let alone = ElementGroup::new(mesh, vec![index as u32], formulation).unwrap();
            let first = index / WIDTH * points * width;
            let own = viscous.predicted[first..first + points * width].iter();
            let predicted = own.map(|pack| [pack[index % WIDTH]; WIDTH]).collect();
            let found = &rows(&alone, &Overstress { predicted, ..viscous })[0];
            assert_eq!(found.len(), n + n * n);
            assert!(*found == together[index], "{kind}: lanes see each other");
        }
        // Stress for output is that of the forces: the mean over a body that is deformed uniformly.
        let mut uniform = [[0.0; D]; D];
        uniform[0][1] = 0.1;
        let u = affine(mesh, &uniform);
        let viscous = overstress(&whole, &u, 0.5);
        let elastic = Overstress { factor: 0.0, predicted: Vec::new() };
        let shear = |viscous: &Overstress| {
            let mut sum = 0.0;
            whole.full_stress(&u, Some(viscous), &[], |_, stress| sum += stress.mean.cauchy.0[3]);
            sum
        };
        let (added, law) = (shear(&viscous) - shear(&elastic), shear(&elastic));
        assert!(
            added > 0.0 && (added / law / 1.2 - 1.0).abs() < 0.02,
            "{kind} {formulation:?}: {added} {law}"
        );
    }
}

/// Results of an element with viscous branches are bitwise identical alone and in a group, and stress
/// for output contains the branches.
#[test]
fn lanes_of_branches_are_separate() {
    for_every_kind!(lanes);
}

fn relaxation<const D: usize>(kind: ElementKind, mesh: &Mesh<D>) {
    for formulation in variants(kind).into_iter().filter(|f| f.plane == PlaneState::Strain) {
        let group = group(mesh, formulation);
        let series = series();
        let u = random(mesh, 0.02, 25);
        let rest = vec![0.0; u.len()];
        let everyone = vec![true; mesh.element_count()];
        let isochoric = group.isochoric_stress(&u);
        let mut history = ViscousHistory::relaxed(&series, &group.isochoric_stress(&rest), D);
        let mut out = Overstress { factor: 0.0, predicted: Vec::new() };
        // A sudden strain that is held: `elapsed` is zero in the step, and the branches follow entirely.
        let energies = group.viscous_energies(&series, &history, 0.0, [&rest, &u], &everyone);
        history.advance(&series, 0.0, &isochoric);
        let mut age = 0.0;
        for elapsed in [0.01, 0.2, 3.0] {
            history.predict(&series, elapsed, &mut out);
            let added = |c: usize| out.factor * isochoric[c][0] + out.predicted[c][0];
            age += elapsed;
            for c in 0..components(D) {
                let expected = (series.relaxation(age) - 1.0) * isochoric[c][0];
                assert!(
                    (added(c) - expected).abs() < 1e-14 * isochoric[c][0].abs(),
                    "{kind} {formulation:?}"
                );
            }
            let before = history.clone();
            history.advance(&series, elapsed, &isochoric);
            let held = group.viscous_energies(&series, &before, elapsed, [&u, &u], &everyone);
            assert!(held.work == 0.0 && held.stored > 0.0 && held.stored < energies.stored, "{kind}");
        }
        // The branches hold half of what a linear law stores, and the work is that energy.
        let energy = group.isochoric_energy(&u, &everyone);
        let exact = formulation.kinematics == Kinematics::Linear;
        let tolerance = if exact { 1e-13 } else { 0.1 };
        for found in [energies.work, energies.stored] {
            assert!(
                (found / (0.5 * energy) - 1.0).abs() < tolerance,
                "{kind} {formulation:?}: {found} {energy}"
            );
        }
    }
}

/// After a sudden strain the added stress is that of the series at any later time, in steps of any
/// length, and the energy of the branches falls.
#[test]
fn a_held_strain_relaxes() {
    for_every_kind!(relaxation);
}

/// The values of a history are found again by element and point.
#[test]
fn histories_are_addressed_by_element_and_point() {
    let mesh = distorted::<3>(ElementKind::Hex8);
    let group = group(&mesh, formulation(neo_hookean(), Kinematics::Finite, Locking::None));
    let (series, points) = (series(), group.full_points());
    let mut history = ViscousHistory::relaxed(&series, &group.isochoric_stress(&random(&mesh, 0.02, 1)), 3);
    history.advance(&series, 0.3, &group.isochoric_stress(&random(&mesh, 0.02, 2)));
    let mut copy = ViscousHistory::zero(&series, group.points_of_batches(), 3);
    for index in 0..group.elements().len() {
        for point in 0..points {
            let values: Vec<f64> = history.at(index, points, point).collect();
            assert_eq!(values.len(), 18);
            copy.set(index, points, point, &values);
        }
    }
    assert_eq!(copy, history);
}
