//! Two deformable bodies: tangents term by term, action and reaction, patches, borders between facets.

use super::evaluation::{AreaKind, ContactRequest};
use super::friction::{FRICTION_LAWS, Friction, Regularization};
use super::normal::NORMAL_LAWS;
use super::pair_scene::{COMPLIANCE, OVERLAP, Scene, block, coulomb, penalty};
use super::pairing::Pairing;
use super::point::{ContactLaw, Selection, Status};
use super::projection::{Place, Projection};
use super::surface::Quadrature;
use crate::mesh::ElementKind;
use crate::space::reference;
use crate::taylor::{scatter, taylor_rate};
use crate::tensor::Vector;
use crate::terms::Terms;

const SHIFT: f64 = 3.0;
const SINGLES: [Terms; 7] = [
    Terms::NORMAL_CONTACT,
    Terms::NORMAL_GEOMETRY,
    Terms::FRICTION_DAMPING,
    Terms::FRICTION_NORMAL_COUPLING,
    Terms::COEFFICIENT_CHANGE,
    Terms::FRICTION_GEOMETRY,
    Terms::ZONE_CHANGE,
];

/// Regimes with all points well within stick or slip, at the penetrations of the scenes.
fn regimes() -> [Regularization; 5] {
    [
        Regularization::stick_velocity(20.0).unwrap(),
        Regularization::stick_velocity(1e-4).unwrap(),
        Regularization::SmoothStickVelocity { velocity: 0.3 },
        Regularization::stick_stiffness(1e3).unwrap(),
        Regularization::stick_stiffness(1e12).unwrap(),
    ]
}

/// Both blocks bent and in motion, with tractions from a step before.
fn bent<const D: usize>(upper: ElementKind, lower: ElementKind, law: ContactLaw) -> Scene<D> {
    let mut scene = Scene::<D>::pressed(upper, lower, Quadrature::Gauss);
    let size = scene.u.len();
    scene.contact.law = law;
    scene.v = scatter(size, 3).iter().map(|v| v * 0.5).collect();
    scene.u = scatter(size, 5).iter().map(|u| u * 0.008).collect();
    scene.u_start = scatter(size, 7).iter().map(|u| u * 0.008).collect();
    scene.pair();
    scene.evaluate(&ContactRequest::default());
    scene.state.accept(1e-3);
    scene.u = scatter(size, 9).iter().map(|u| u * 0.008).collect();
    scene.pair();
    scene
}

fn matrix<const D: usize>(scene: &Scene<D>, terms: Terms) -> Vec<f64> {
    let selection = Selection { terms, velocity_shift: SHIFT, joint: None };
    let request = ContactRequest { stiffness: Some(selection), ..Default::default() };
    scene.clone().evaluate(&request).matrix
}

fn rate<const D: usize>(scene: &Scene<D>, terms: Terms) -> f64 {
    let size = scene.u.len();
    let force = |z: &[f64]| {
        let mut moved = scene.clone();
        moved.u.iter_mut().zip(z).for_each(|(u, z)| *u += z);
        moved.v.iter_mut().zip(z).for_each(|(v, z)| *v += SHIFT * z);
        moved.evaluate(&ContactRequest::default()).force
    };
    let matrix = matrix(scene, terms);
    let slope = |_: &[f64], d: &[f64]| {
        matrix.chunks_exact(size).map(|row| -row.iter().zip(d).map(|(k, d)| k * d).sum::<f64>()).collect()
    };
    let direction: Vec<f64> = scatter(size, 13).iter().map(|d| d * 2e-4).collect();
    taylor_rate(force, slope, &vec![0.0; size], &direction)
}

fn norm(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// The tangent has order two, and loses it with any of its terms. Returns the terms that mattered.
fn check<const D: usize>(scene: &Scene<D>, label: &str) -> Terms {
    let whole = rate(scene, Terms::ALL);
    assert!(whole > 1.9, "{label} {:?}: order {whole}", scene.contact.law);
    let total = norm(&matrix(scene, Terms::ALL));
    let mut seen = Terms::empty();
    for term in SINGLES {
        if norm(&matrix(scene, term)) < 1e-4 * total {
            continue;
        }
        seen |= term;
        let rate = rate(scene, Terms::ALL - term);
        assert!(rate < 1.5, "{label} {:?}: order {rate} without {term:?}", scene.contact.law);
    }
    seen
}

fn every_law<const D: usize>(upper: ElementKind, lower: ElementKind) {
    let mut seen = Terms::empty();
    for normal in NORMAL_LAWS.iter().flat_map(|entry| (entry.samples)()) {
        seen |= check(&bent::<D>(upper, lower, ContactLaw { normal, friction: None }), "frictionless");
        for law in FRICTION_LAWS.iter().flat_map(|entry| (entry.samples)()) {
            for regularization in regimes() {
                let friction = Some(Friction { law, regularization });
                seen |= check(&bent::<D>(upper, lower, ContactLaw { normal, friction }), "law");
            }
        }
    }
    assert_eq!(seen, SINGLES.into_iter().collect());
}

/// With every law and regime the pairs of two surfaces have a consistent tangent in the plane, term by term.
#[test]
fn tangent_is_consistent_for_every_law_in_2d() {
    every_law::<2>(ElementKind::Quad4, ElementKind::Quad4);
}

/// With every law and regime the pairs of two surfaces have a consistent tangent in space, term by term.
#[test]
fn tangent_is_consistent_for_every_law_in_3d() {
    every_law::<3>(ElementKind::Tet4, ElementKind::Hex8);
}

/// All points on one facet: many lie beyond its edges and corners, at least one of each is closed.
fn on_one_facet<const D: usize>(scene: &mut Scene<D>, facet: u32) {
    let target = &scene.contact.target;
    let names = vec![target.identity(facet); scene.pairing.len()];
    scene.pairing = Pairing::from_identities(&names, target);
}

fn places<const D: usize>(scene: &Scene<D>, facet: u32) -> Vec<Place> {
    let (surface, target) = (&scene.contact.surface, &scene.contact.target);
    let mut nodes = Vec::new();
    target.current(facet, &scene.u, &mut nodes);
    let mut places = Vec::new();
    for of in surface.facets() {
        let x: Vec<Vector<D>> = surface
            .reference_points(of)
            .iter()
            .zip(surface.facet_nodes(of))
            .map(|(x, n)| x + Vector::<D>::from_column_slice(&scene.u[*n as usize * D..][..D]))
            .collect();
        for (q, p) in of.points.clone().enumerate().filter(|(_, p)| scene.state.current[*p].is_closed()) {
            let at = surface.facet_point(of, q).position(&x);
            assert!(p < surface.point_count());
            places.push(Projection::of(&at, target.kind(facet), &nodes).place);
        }
    }
    places
}

fn every_kind<const D: usize>() {
    let (mut edges, mut corners) = (0, 0);
    for upper in ElementKind::SOLIDS.into_iter().filter(|kind| kind.dimension() == D) {
        for lower in ElementKind::SOLIDS.into_iter().filter(|kind| kind.dimension() == D) {
            for regularization in regimes() {
                let mut scene = bent::<D>(upper, lower, penalty(Some(coulomb(0.7, regularization))));
                let label = format!("{} on {} {regularization:?}", upper.name(), lower.name());
                assert!(rate(&scene, Terms::ALL) > 1.9, "{label}");
                on_one_facet(&mut scene, 0);
                assert!(scene.evaluate(&ContactRequest::default()).calls > 0, "{label}");
                assert!(rate(&scene, Terms::ALL) > 1.9, "{label} clipped");
                let places = places(&scene, 0);
                edges += places.iter().filter(|place| matches!(place, Place::Edge(_))).count();
                corners += places.iter().filter(|place| matches!(place, Place::Corner(_))).count();
                scene.contact.area = AreaKind::Reference;
                assert!(rate(&scene, Terms::ALL) > 1.9, "{label} reference area");
                assert_eq!(norm(&matrix(&scene, Terms::ZONE_CHANGE)), 0.0);
            }
        }
    }
    assert!(corners > 0 && (D == 2 || edges > 0));
}

/// Every element on every element: inside of facets, beyond their ends, on both areas, in the plane.
#[test]
fn tangent_is_consistent_for_every_facet_in_2d() {
    every_kind::<2>();
}

/// Every element on every element: inside of facets, beyond edges and corners, on both areas, in space.
#[test]
fn tangent_is_consistent_for_every_facet_in_3d() {
    every_kind::<3>();
}

fn balance<const D: usize>(upper: ElementKind, lower: ElementKind) {
    let friction = coulomb(0.7, Regularization::stick_velocity(0.1).unwrap());
    let mut scene = bent::<D>(upper, lower, penalty(Some(friction)));
    let total = |force: &[f64]| force.chunks_exact(D).map(Vector::<D>::from_column_slice).sum::<Vector<D>>();
    let force = scene.evaluate(&ContactRequest::default()).force;
    assert!(norm(&force) > 0.0 && total(&force).norm() < 1e-12 * norm(&force));
    let size = scene.u.len();
    for term in SINGLES {
        let matrix = matrix(&scene, term);
        for (column, i) in (0..size).flat_map(|c| (0..D).map(move |i| (c, i))) {
            let sum: f64 = (0..size / D).map(|a| matrix[(a * D + i) * size + column]).sum();
            assert!(sum.abs() <= 1e-12 * norm(&matrix), "{term:?}");
        }
    }
    scene.contact.law.friction = None;
    let force = scene.evaluate(&ContactRequest::default()).force;
    let moment = |(i, j): (usize, usize)| -> f64 {
        let of = |(a, f): (usize, &[f64])| {
            let x = |k: usize| scene.mesh.points[a][k] + scene.u[a * D + k];
            x(i) * f[j] - x(j) * f[i]
        };
        force.chunks_exact(D).enumerate().map(of).sum()
    };
    for pair in [(0, 1), (D - 2, D - 1)] {
        assert!(moment(pair).abs() < 1e-11 * norm(&force), "{pair:?}: {}", moment(pair));
    }
}

/// Forces of contactor and target cancel, with every column of every term; without friction their moments as well.
#[test]
fn action_is_reaction() {
    balance::<2>(ElementKind::Quad8, ElementKind::Quad9);
    balance::<3>(ElementKind::Hex8, ElementKind::Tet10);
}

fn patch<const D: usize>(upper: ElementKind, lower: ElementKind, quadrature: Quadrature) {
    let mut scene = Scene::<D>::pressed(upper, lower, quadrature);
    scene.pair();
    let dense = scene.evaluate(&ContactRequest::default());
    let surface = &scene.contact.surface;
    let (summary, expected) = (surface.summary(&scene.state), OVERLAP / COMPLIANCE);
    assert!((summary.normal_force / expected - 1.0).abs() < 1e-12, "{upper:?} on {lower:?} {quadrature:?}");
    assert!((summary.max_penetration / OVERLAP - 1.0).abs() < 1e-12);
    assert_eq!((summary.points, dense.calls), (surface.point_count(), surface.point_count()));
    assert!((surface.energy(&scene.state, 1.0).stored / (0.5 * expected * OVERLAP) - 1.0).abs() < 1e-12);
    let mut half = scene.clone();
    half.contact.surface = half.contact.surface.with_share(0.5);
    let halved = half.evaluate(&ContactRequest::default()).force;
    assert!(halved.iter().zip(&dense.force).all(|(h, f)| (2.0 * h - f).abs() < 1e-9 * expected));
    assert!((half.contact.surface.summary(&half.state).area - 0.5).abs() < 1e-12);
    assert!((half.state.current[0].normal_traction / expected - 1.0).abs() < 1e-12);
    let stored = half.contact.surface.energy(&half.state, 1.0).stored;
    assert!((stored / (0.25 * expected * OVERLAP) - 1.0).abs() < 1e-12);
}

/// Flat blocks of any elements press each other with exactly the law's force; a half share takes half of it all.
#[test]
fn flat_patch_is_exact_for_every_pair() {
    for upper in ElementKind::SOLIDS {
        for lower in ElementKind::SOLIDS.into_iter().filter(|kind| kind.dimension() == upper.dimension()) {
            let nodal = reference(upper.facet_kind()).nodal_rule().is_some();
            for quadrature in [Quadrature::Nodal, Quadrature::Gauss].into_iter().skip(usize::from(!nodal)) {
                match upper.dimension() {
                    2 => patch::<2>(upper, lower, quadrature),
                    _ => patch::<3>(upper, lower, quadrature),
                }
            }
        }
    }
}

/// A penetration of a nanometre between blocks a kilometre from the origin of coordinates has the law's pressure, with
/// the rounding of displacements of a micrometre.
#[test]
fn tiny_penetrations_are_not_rounded_like_places() {
    let upper = block::<3>(ElementKind::Hex8, [1000.0, 1000.5], [1000.3, 1000.6], 1);
    let lower = block::<3>(ElementKind::Tet4, [999.7, 1000.9], [1000.0, 1000.3], 2);
    let mut scene = Scene::<3>::new(upper, lower, &["lower.top"], Quadrature::Gauss);
    scene.shift(0, [2e-6, 1e-6, -3e-6]);
    scene.shift(1, [3e-6, 2e-6, -3.001e-6]);
    scene.pair();
    scene.evaluate(&ContactRequest::default());
    let pressure = 1e-9 / COMPLIANCE;
    for point in &scene.state.current {
        assert!((point.normal_traction / pressure - 1.0).abs() < 1e-11, "{}", point.normal_traction);
    }
}

fn slide<const D: usize>(upper: ElementKind, lower: ElementKind) {
    let upper = block(upper, [-0.1, 0.1], [0.0, 0.2], 1);
    let lower = block(lower, [-1.0, 1.0], [-1.0, 1e-3], 2);
    let mut scene = Scene::<D>::new(upper, lower, &["lower.top"], Quadrature::Gauss);
    scene.contact.law =
        penalty(Some(coulomb(0.5, Regularization::stick_stiffness(0.2 / COMPLIANCE).unwrap())));
    let area = 0.2_f64.powi(D as i32 - 1);
    let expected = 1e-3 / COMPLIANCE * area;
    let step: [f64; D] = std::array::from_fn(|i| if i == 0 { 1e-2 } else { 0.0 });
    scene.shift(1, std::array::from_fn(|i| if i + 1 < D { -0.3 } else { 0.0 }));
    let mut facets = std::collections::BTreeSet::new();
    for k in 0..60 {
        scene.u_start = scene.u.clone();
        scene.shift(1, step);
        scene.pairing.begin_step();
        scene.pair();
        scene.evaluate(&ContactRequest::default());
        let summary = scene.contact.surface.summary(&scene.state);
        assert!((summary.normal_force / expected - 1.0).abs() < 1e-9, "step {k}");
        let friction = -(0.5 * expected).min(0.2 / COMPLIANCE * area * 1e-2 * f64::from(k + 1));
        assert!((summary.friction_force[0] / friction - 1.0).abs() < 1e-9, "step {k}: {summary:?}");
        scene.state.accept(1e-3);
        facets.extend((0..scene.pairing.len()).map(|p| scene.pairing.facet(p)));
    }
    assert!(facets.len() > 1 && !facets.contains(&None), "the slide crosses a border");
}

/// Over the borders between facets of a flat target gap, force and the memory of friction go on.
#[test]
fn sliding_over_a_flat_border_changes_nothing() {
    slide::<2>(ElementKind::Quad4, ElementKind::Quad4);
    slide::<2>(ElementKind::Quad9, ElementKind::Quad8);
    slide::<3>(ElementKind::Hex8, ElementKind::Hex27);
    slide::<3>(ElementKind::Hex8, ElementKind::Tet4);
}

/// A narrow contactor, its middle at depth `depth` along the inward normals of a roof of slope `slope` (valley: < 0).
fn over_the_ridge(slope: f64, s: f64, depth: f64, pairing: Option<Pairing>) -> Scene<2> {
    let upper = block::<2>(ElementKind::Quad4, [-1e-4, 1e-4], [0.0, 0.2], 1);
    let lower = block::<2>(ElementKind::Quad4, [-1.0, 1.0], [-1.0, 0.0], 2);
    let mut scene = Scene::<2>::new(upper, lower, &["lower.top"], Quadrature::Gauss);
    for (a, x) in scene.mesh.points.iter().enumerate().filter(|(_, x)| x[1] == 0.0 && x[0].abs() == 1.0) {
        assert!(x[0].abs() == 1.0);
        scene.u[a * 2 + 1] = -slope;
    }
    scene.shift(1, [s, -slope * s.abs() - depth]);
    if let Some(pairing) = pairing {
        scene.pairing = pairing;
    }
    scene.pair();
    scene.evaluate(&ContactRequest::default());
    scene
}

/// Between two facets no contact is lost, be the vertex convex, flat or concave, gentle or sharp, and gaps do not jump.
#[test]
fn no_contact_is_lost_at_a_vertex() {
    for slope in [-1.2, -0.3, 0.0, 0.3, 0.9] {
        let mut pairing = None;
        let mut last: Option<f64> = None;
        for k in -100..=100 {
            let scene = over_the_ridge(slope, f64::from(k) * 1e-3, 1e-2, pairing.take());
            for point in &scene.state.current {
                assert_ne!(point.status, Status::Open, "slope {slope}, {k}: {:?}", scene.pairing);
                assert!(point.gap > -1.2e-2);
            }
            let gap = scene.state.current[0].gap;
            let jump = last.map_or(0.0, |last| (gap - last).abs());
            assert!(jump < 2e-3, "slope {slope}, {k}: {last:?} {gap}");
            last = Some(gap);
            pairing = Some(scene.pairing);
        }
        for k in -100..=100 {
            let above = over_the_ridge(slope, f64::from(k) * 1e-3, -1e-2, None);
            assert!(above.state.current.iter().all(|point| point.status == Status::Open), "{slope} {k}");
        }
    }
}

/// A point without a facet is open, contributes nothing and forgets its friction.
#[test]
fn points_without_a_facet_are_open() {
    let mut scene = Scene::<2>::pressed(ElementKind::Quad4, ElementKind::Quad4, Quadrature::Gauss);
    scene.shift(1, [0.0, 3.0]);
    scene.pair();
    let dense = scene.evaluate(&ContactRequest::default());
    assert_eq!(dense.calls, 0);
    assert!(scene.state.current.iter().all(|p| p.status == Status::Open && p.gap == f64::INFINITY));
    scene.shift(1, [0.0, -2.9]);
    scene.pair();
    assert_eq!(scene.evaluate(&ContactRequest::default()).calls, 0);
    let gaps = scene.state.current.iter().map(|p| p.gap);
    assert!(gaps.into_iter().all(|gap| (gap - 0.05).abs() < 1e-12), "a finite gap where there is a facet");
}
