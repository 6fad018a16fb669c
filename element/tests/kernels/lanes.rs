//! Comparison of lane types, inverted elements, and invalid groups.

use super::*;
use serial::lanes::on_portable_lanes;
use serial::material::Gent;
use serial::reader::quantity::{Number, Pressure};

fn lanes<const D: usize>(kind: ElementKind, mesh: &Mesh<D>) {
    let u = random(mesh, 0.02, 24);
    for formulation in variants(kind) {
        let whole = group(mesh, formulation);
        let together = collect(&whole, &u);
        let everyone = vec![true; mesh.element_count()];
        let energy_of = |index: usize| {
            let mine: Vec<bool> = (0..everyone.len()).map(|element| element == index).collect();
            whole.group.strain_energy(&u, &mine)
        };
        let (energy, parts) =
            (whole.group.strain_energy(&u, &everyone), (0..everyone.len()).map(energy_of).sum::<f64>());
        assert!(energy > 0.0 && (energy - parts).abs() < 1e-13 * energy, "{kind}: {energy} is not {parts}");
        for index in 0..mesh.element_count() {
            let alone = ElementGroup::new(mesh, vec![index as u32], formulation).unwrap();
            assert!(collect(&alone, &u)[0] == together[index], "{kind}: lanes see each other");
        }
        for (plain, fast) in on_portable_lanes(|| collect(&whole, &u)).iter().zip(&together) {
            let largest = fast.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let apart = plain.iter().zip(fast).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
            assert!(apart < 1e-14 * largest, "{kind} {formulation:?}: {apart}");
        }
    }
}

#[derive(Default)]
struct Rows(Vec<Vec<f64>>);

impl ElementSink for Rows {
    fn element(&mut self, index: usize, force: &[f64], stiffness: Option<&[f64]>) {
        assert_eq!(index, self.0.len());
        self.0.push([force, stiffness.unwrap_or_default()].concat());
    }
}

fn collect<const D: usize>(group: &ElementGroup<D>, u: &[f64]) -> Vec<Vec<f64>> {
    let mut rows = Rows::default();
    group.evaluate(u, Request::TANGENT, &mut rows).unwrap();
    rows.0
}

/// The results of an element are bitwise identical alone and with any other elements in the group.
/// The portable lanes agree with the fast ones.
#[test]
fn lanes_do_not_change_the_answer() {
    for_every_kind!(lanes);
}

fn inversions<const D: usize>(kind: ElementKind, mesh: &Mesh<D>) {
    // Two inverted elements: the lower one must be reported for any lane type.
    let count = mesh.element_count();
    let victims = [count - 1, count / 2];
    let mut u = vec![0.0; mesh.points.len() * D];
    for victim in victims {
        for &node in mesh.element_nodes(victim) {
            u[node as usize * D] = -3.0 * mesh.points[node as usize][0];
        }
    }
    for formulation in variants(kind) {
        let result = group(mesh, formulation).evaluate(&u, Request::FORCE, &mut Rows::default());
        if formulation.kinematics == Kinematics::Linear {
            assert!(result.is_ok(), "{kind}: linear kinematics can not invert");
            let mut broken = u.clone();
            let node = mesh.element_nodes(count - 1)[0] as usize;
            broken[node * D + 1] = f64::NAN;
            let found = group(mesh, formulation).evaluate(&broken, Request::FORCE, &mut Rows::default());
            assert!(found.unwrap_err().det.is_nan());
            continue;
        }
        let found = result.unwrap_err();
        // Stretched elements beside it may have lost their thickness.
        let is_thin = formulation.plane == PlaneState::Stress && found.reserve.is_nan();
        assert!(found.det <= 0.0 || is_thin, "{kind}: {found:?}");
        let first = (0..count as u32)
            .find(|&e| {
                let alone = ElementGroup::new(mesh, vec![e], formulation).unwrap();
                alone.evaluate(&u, Request::TANGENT, &mut Rows::default()).is_err()
            })
            .unwrap();
        assert_eq!(found.element, first, "{kind}");
        assert!(found.point.iter().all(|x| x.abs() <= 1.0));
    }
}

/// The first inverted element of the group is reported with its location. A NaN is reported in the
/// same way.
#[test]
fn inverted_elements_are_reported() {
    for_every_kind!(inversions);
}

fn overstretches<const D: usize>(kind: ElementKind, mesh: &Mesh<D>) {
    let gent = |limit: f64| {
        let law = Gent {
            mu: Pressure::new(1.0),
            j_m: Number::new(limit),
            bulk_modulus: Some(Pressure::new(10.0)),
            poisson_ratio: None,
        };
        group(mesh, formulation(law.into(), Kinematics::Finite, Locking::None))
    };
    // Three times as long at the end, twice in the middle of a step.
    let mut end = vec![0.0; mesh.points.len() * D];
    for (a, point) in mesh.points.iter().enumerate() {
        end[a * D] = 2.0 * point[0];
    }
    let start = vec![0.0; end.len()];
    let middle: Vec<f64> = end.iter().map(|u| 0.5 * u).collect();
    // I1 - 3 is 2.29 at the end and 0.78 in the middle.
    let at_end = |limit, request| gent(limit).evaluate(&end, request, &mut Rows::default());
    let over_step =
        |limit, request| gent(limit).evaluate_step(&start, &middle, request, &mut Rows::default());
    for request in [Request::FORCE, Request::TANGENT] {
        assert!(at_end(2.4, request).is_ok() && over_step(2.4, request).is_ok(), "{kind}");
        assert!(gent(1.0).evaluate(&middle, request, &mut Rows::default()).is_ok(), "{kind}");
        for found in [at_end(2.2, request), over_step(2.2, request), over_step(1.0, request)] {
            let found = found.unwrap_err();
            assert!(found.element == 0 && found.det > 2.9 && found.reserve <= 0.0, "{kind}: {found:?}");
        }
    }
}

/// Elements that are stretched beyond the limit of their law, at a state or at the end of a step, are reported.
#[test]
fn overstretched_elements_are_reported() {
    for_every_kind!(overstretches);
}

/// Invalid groups are rejected with a message.
#[test]
fn wrong_groups_are_refused() {
    let neo = |locking| formulation(neo_hookean(), Kinematics::Finite, locking);
    let mut mesh = distorted::<2>(ElementKind::Tri3);
    let locked = ElementGroup::new(&mesh, vec![0], neo(Locking::SelectiveReduced)).unwrap_err();
    assert!(locked.message.contains("tri3 does not support selective_reduced"), "{locked}");
    let weightless = Formulation { density: -1.0, ..neo(Locking::None) };
    assert!(ElementGroup::new(&mesh, vec![0], weightless).is_err());
    assert!(ElementGroup::new(&mesh, vec![], neo(Locking::None)).is_err());
    mesh.nodes.swap(0, 1);
    let flipped = ElementGroup::new(&mesh, vec![0], neo(Locking::None)).unwrap_err();
    assert!(flipped.message.contains("element 0") && flipped.message.contains("inverted"), "{flipped}");
}
