//! The point kernel against its own force: every law, obstacle, facet and regime, and every term by itself.

mod scene;

use scene::{SHIFT, Scene, vectors};

use super::step::{Fields, StepMotion, respond_over_step};
use super::{ContactLaw, Frozen, Manner, Motion, Status, respond};
use crate::contact::friction::coefficient::{Coefficient, Constant};
use crate::contact::friction::regularization::REGULARIZATIONS;
use crate::contact::friction::traction::Branch;
use crate::contact::friction::{Coulomb, FRICTION_LAWS, Friction, FrictionLaw, Regularization};
use crate::contact::geometry::{AreaMeasure, Geometry};
use crate::contact::history::History;
use crate::contact::normal::{NORMAL_LAWS, NormalLaw, Penalty};
use crate::contact::obstacle::{OBSTACLES, Obstacle};
use crate::mesh::ElementKind;
use crate::tensor::Vector;
use crate::terms::Terms;

const SINGLES: [Terms; 7] = [
    Terms::NORMAL_CONTACT,
    Terms::NORMAL_GEOMETRY,
    Terms::FRICTION_DAMPING,
    Terms::FRICTION_NORMAL_COUPLING,
    Terms::COEFFICIENT_CHANGE,
    Terms::FRICTION_GEOMETRY,
    Terms::ZONE_CHANGE,
];

fn coulomb(mu: f64, regularization: Regularization) -> Option<Friction> {
    let coefficient = Coefficient::Constant(Constant::new(mu).unwrap());
    Some(Friction { law: FrictionLaw::Coulomb(Coulomb { coefficient }), regularization })
}

fn penalty() -> NormalLaw {
    NormalLaw::Penalty(Penalty::new(1e-8).unwrap())
}

fn regularizations() -> Vec<Regularization> {
    REGULARIZATIONS.iter().flat_map(|entry| (entry.samples)()).collect()
}

fn facets(dimension: usize) -> impl Iterator<Item = ElementKind> {
    ElementKind::ALL.into_iter().filter(move |kind| kind.dimension() + 1 == dimension)
}

/// The consistent tangent has order two, and loses it with any of its terms. Returns the terms that mattered.
fn check<const D: usize>(scene: &Scene<D>, label: &str) -> Terms {
    let rate = scene.rate(Terms::ALL);
    assert!(rate > 1.9, "{label} {:?} {:?}: order {rate}", scene.target, scene.law);
    let total = scene.matrix(Terms::ALL).norm();
    let mut seen = Terms::empty();
    for term in SINGLES {
        if scene.matrix(term).norm() < 1e-4 * total {
            continue;
        }
        seen |= term;
        let rate = scene.rate(Terms::ALL - term);
        assert!(rate < 1.5, "{label} {:?} {:?}: order {rate} without {term:?}", scene.target, scene.law);
    }
    seen
}

fn every_law<const D: usize>(kind: ElementKind, targets: &[Obstacle<D>]) -> Terms {
    let mut seen = Terms::empty();
    let normals: Vec<_> = NORMAL_LAWS.iter().flat_map(|entry| (entry.samples)()).collect();
    let frictions: Vec<_> = FRICTION_LAWS.iter().flat_map(|entry| (entry.samples)()).collect();
    for target in targets {
        for normal in &normals {
            let frictionless =
                Scene::new(kind, *target, ContactLaw { normal: *normal, friction: None }, -0.02);
            seen |= check(&frictionless, "frictionless");
            for (law, regularization) in
                frictions.iter().flat_map(|l| regularizations().into_iter().map(move |r| (l, r)))
            {
                let law =
                    ContactLaw { normal: *normal, friction: Some(Friction { law: *law, regularization }) };
                for status in [Status::Stick, Status::Slip] {
                    let scene = Scene::new(kind, *target, law, -0.02).tuned(regularization, status);
                    seen |= check(&scene, "law");
                }
            }
        }
    }
    seen
}

/// In the plane every law in every regime on every obstacle has a consistent tangent, term by term.
#[test]
fn tangent_is_consistent_for_every_law_in_2d() {
    let targets: Vec<_> = OBSTACLES.iter().flat_map(|entry| (entry.samples_2d)()).collect();
    assert_eq!(every_law(ElementKind::Line2, &targets), SINGLES.into_iter().collect());
}

/// In space every law in every regime on every obstacle has a consistent tangent, term by term.
#[test]
fn tangent_is_consistent_for_every_law_in_3d() {
    let targets: Vec<_> = OBSTACLES.iter().flat_map(|entry| (entry.samples_3d)()).collect();
    assert_eq!(every_law(ElementKind::Tri3, &targets), SINGLES.into_iter().collect());
}

fn every_facet<const D: usize>(obstacle: Obstacle<D>) {
    for contactor in facets(D) {
        for (regularization, status) in
            regularizations().into_iter().zip([Status::Stick, Status::Slip, Status::Slip])
        {
            let law = ContactLaw { normal: penalty(), friction: coulomb(0.7, regularization) };
            let mut scene = Scene::new(contactor, obstacle, law, -0.02).tuned(regularization, status);
            assert!(check(&scene, contactor.name()).contains(Terms::ZONE_CHANGE));
            scene.measure = AreaMeasure::Reference(0.03);
            assert!(!check(&scene, contactor.name()).contains(Terms::ZONE_CHANGE));
        }
    }
}

/// Every facet kind against a round obstacle in the plane, current and reference area.
#[test]
fn tangent_is_consistent_for_every_facet_in_2d() {
    every_facet((OBSTACLES[1].samples_2d)()[0]);
}

/// Every facet kind against a round obstacle in space, current and reference area.
#[test]
fn tangent_is_consistent_for_every_facet_in_3d() {
    every_facet((OBSTACLES[2].samples_3d)()[0]);
}

/// Which side of its target a point that touches lies on, rounding decides, and nothing else follows from it: the point is closed
/// and does not press, in a configuration and over a step. Its traction is that of the law.
#[test]
fn a_point_that_touches_is_closed_on_either_side() {
    let law = ContactLaw {
        normal: penalty(),
        friction: coulomb(0.7, Regularization::stick_velocity(1.0).unwrap()),
    };
    let manner = Manner { touching: 1e-12, ..Manner::default() };
    let history = History::default();
    for (gap, closed, presses) in [
        (2e-12, false, false),
        (1e-13, true, false),
        (0.0, true, false),
        (-1e-13, true, false),
        (-2e-12, true, true),
    ] {
        let geometry = Geometry::<2> { gap, normal: Vector::<2>::y(), area: 1.0, ..Geometry::default() };
        let motion = Motion { velocity: &[], increment: &[], history: &history };
        let state = respond(&law, &geometry, &motion, &manner).state;
        assert_eq!((state.is_closed(), state.presses), (closed, presses), "{gap:e}");
        assert_eq!(state.normal_traction, law.normal.evaluate(gap).traction);
        for fresh in [false, true] {
            let slopes = respond(&law, &geometry, &motion, &Manner { fresh, ..manner }).slopes;
            let resists = slopes.is_some_and(|slopes| slopes.normal < 0.0);
            assert_eq!(resists, if fresh { closed } else { gap <= 0.0 }, "{gap:e}");
        }
        let fields = Fields { velocity: &[], increment: &[] };
        let motion = StepMotion { middle: &geometry, end: gap, start: 1.0, fields, history: &history };
        let state = respond_over_step(&law, &motion, &manner).state;
        assert_eq!((state.is_closed(), state.presses), (closed, presses), "{gap:e} over a step");
    }
}

fn open_and_frozen<const D: usize>(kind: ElementKind, obstacle: Obstacle<D>) {
    let stick = Regularization::stick_velocity(10.0).unwrap();
    let law = ContactLaw { normal: penalty(), friction: coulomb(0.7, stick) };
    let open = Scene::new(kind, obstacle, law, 0.02);
    assert_eq!(open.state().status, Status::Open);
    assert!(open.force().iter().chain(&open.stiffness(Terms::ALL)).all(|f| *f == 0.0));
    let mut frozen = open.clone();
    frozen.manner.frozen = Frozen { normal_traction: Some(3e5), bound: Some(2e5), friction_traction: None };
    assert!(check(&frozen, "stage II").contains(Terms::FRICTION_DAMPING));
    assert!(frozen.matrix(Terms::NORMAL_CONTACT | Terms::FRICTION_NORMAL_COUPLING).norm() == 0.0);
    let mut staged = Scene::new(kind, obstacle, law, -0.02);
    let live = staged.force();
    staged.manner.frozen = Frozen { bound: Some(staged.state().bound), ..Frozen::default() };
    assert_eq!(staged.force(), live, "frozen at its own value a bound changes nothing");
    assert!(!check(&staged, "stage I").contains(Terms::FRICTION_NORMAL_COUPLING));
    staged.manner.frozen =
        Frozen { friction_traction: Some(vectors::<D>(1, 3, 1e5)[0]), ..Frozen::default() };
    assert!(!check(&staged, "known friction").contains(Terms::FRICTION_DAMPING));
    staged.manner.frozen = Frozen::frictionless();
    assert_eq!(staged.state().friction_traction.norm(), 0.0);
}

/// Open points cost nothing, and the stages of the two-stage scheme have consistent tangents of their own.
#[test]
fn open_and_frozen_points_are_consistent() {
    open_and_frozen::<2>(ElementKind::Line2, (OBSTACLES[1].samples_2d)()[0]);
    open_and_frozen::<3>(ElementKind::Quad4, (OBSTACLES[1].samples_3d)()[1]);
}

fn definite<const D: usize>(kind: ElementKind, obstacle: Obstacle<D>) {
    let symmetric = |k: &nalgebra::DMatrix<f64>| (k - k.transpose()).norm() <= 1e-12 * k.norm();
    let lowest = |k: nalgebra::DMatrix<f64>| k.symmetric_eigenvalues().min();
    for regularization in regularizations() {
        for (status, branch) in
            [(Status::Stick, Branch::Actual), (Status::Slip, Branch::Actual), (Status::Slip, Branch::Stick)]
        {
            let law = ContactLaw { normal: penalty(), friction: coulomb(0.7, regularization) };
            let mut scene = Scene::new(kind, obstacle, law, -0.02).tuned(regularization, status);
            scene.manner.branch = branch;
            for term in [Terms::NORMAL_CONTACT, Terms::FRICTION_DAMPING] {
                let k = scene.matrix(term);
                assert!(symmetric(&k), "{term:?} {regularization:?}");
                assert!(lowest(k.clone()) >= -1e-12 * k.norm(), "{term:?} {regularization:?}");
            }
            assert!(symmetric(&scene.matrix(Terms::NORMAL_GEOMETRY)));
            let damping = scene.matrix(Terms::FRICTION_DAMPING).norm();
            let clipped = !matches!(regularization, Regularization::SmoothStickVelocity { .. });
            if D == 2 && status == Status::Slip && branch == Branch::Actual && clipped {
                assert_eq!(damping, 0.0, "in the plane a slipping point has no friction stiffness");
            } else {
                assert!(damping > 0.0, "{regularization:?} {status:?} {branch:?}");
            }
            let coupling = scene.matrix(Terms::FRICTION_NORMAL_COUPLING);
            assert!(coupling.norm() == 0.0 || !symmetric(&coupling));
        }
    }
}

/// K_CN and K_T are symmetric and not negative, the continued stick branch too; K_nT is not symmetric; slip in 2D has no K_T.
#[test]
fn terms_have_their_symmetries() {
    definite::<2>(ElementKind::Line3, (OBSTACLES[1].samples_2d)()[0]);
    definite::<3>(ElementKind::Quad4, (OBSTACLES[2].samples_3d)()[0]);
}

/// Section 4 of the formulation, written down for a straight facet: K_CN, K_nT and C in the plane.
#[test]
fn matrices_are_those_of_the_formulation() {
    let floor =
        crate::contact::obstacle::Plane::new(Vector::<2>::zeros(), Vector::<2>::new(0.0, 1.0)).unwrap();
    let (compliance, mu, stick) = (1e-8, 0.7, 2.0);
    let friction = coulomb(mu, Regularization::stick_velocity(stick).unwrap());
    let law = ContactLaw { normal: NormalLaw::Penalty(Penalty::new(compliance).unwrap()), friction };
    let scene = Scene::new(ElementKind::Line2, Obstacle::Plane(floor), law, -0.02);
    let (geometry, state) = (scene.geometry(), scene.state());
    let (area, n) = (geometry.area, &scene.table.n[2..4]);
    let (along, slip) = (Vector::<2>::new(1.0, 0.0), state.slip_velocity[0] / stick);
    let up = Vector::<2>::new(0.0, 1.0);
    let product = |left: Vector<2>, right: Vector<2>, scale: f64, (r, c): (usize, usize)| {
        scale * n[r / 2] * left[r % 2] * n[c / 2] * right[c % 2]
    };
    let expected = [
        (Terms::NORMAL_CONTACT, up, up, area / compliance),
        (Terms::FRICTION_NORMAL_COUPLING, along, up, -area * mu / compliance * slip),
        (Terms::FRICTION_DAMPING, along, along, SHIFT * area * mu * state.normal_traction / stick),
    ];
    for (term, left, right, scale) in expected {
        let written = nalgebra::DMatrix::from_fn(4, 4, |r, c| product(left, right, scale, (r, c)));
        assert!((scene.matrix(term) - &written).norm() < 1e-13 * written.norm(), "{term:?}");
    }
    let traction = up * state.normal_traction - along * (mu * state.normal_traction * slip);
    assert!((state.traction() - traction).norm() < 1e-13 * traction.norm());
}

/// With a multiplier the tangent is as consistent, a point presses beyond its target, and at no penetration the traction
/// is the multiplier.
#[test]
fn multipliers_keep_the_tangent() {
    let stick = Regularization::stick_velocity(10.0).unwrap();
    let law = ContactLaw { normal: penalty(), friction: coulomb(0.7, stick) };
    let ball = Obstacle::<3>::clone(&(OBSTACLES[1].samples_3d)()[0]);
    for (target, gap, offset) in [(ball, 0.02, 0.05), (ball, -0.02, -0.005)] {
        let mut scene = Scene::new(ElementKind::Quad4, target, law, gap);
        scene.manner.offset = offset;
        assert_ne!(scene.state().status, Status::Open);
        check(&scene, "multiplier");
        let NormalLaw::Penalty(penalty) = law.normal else { unreachable!() };
        let expected = (offset - scene.state().gap) / penalty.normal_compliance();
        assert!((scene.state().normal_traction / expected - 1.0).abs() < 1e-12);
    }
}

fn joins<const D: usize>(kind: ElementKind, target: Obstacle<D>) {
    for regularization in regularizations() {
        for status in [Status::Stick, Status::Slip] {
            let law = ContactLaw { normal: penalty(), friction: coulomb(0.7, regularization) };
            let scene = Scene::new(kind, target, law, -0.02).tuned(regularization, status);
            let terms = scene.matrix(Terms::NORMAL_CONTACT | Terms::FRICTION_DAMPING);
            let whole = scene.joint(f64::INFINITY);
            let what = format!("{kind} {regularization:?} {status:?}");
            assert!((&whole - &terms).norm() <= 1e-12 * terms.norm(), "{what}");
            let (geometry, limit) = (scene.geometry(), 1e-3 * terms.amax() / scene.geometry().area);
            let soft = scene.joint(limit);
            assert!((&soft - soft.transpose()).norm() <= 1e-12 * soft.norm(), "{what}");
            assert!(soft.clone().symmetric_eigenvalues().min() >= -1e-12 * soft.norm(), "{what}");
            // Both sides moved apart along the normal meet the spring that was asked for, and no stiffer one anywhere.
            let resists = |direction: &Vector<D>| {
                let apart = nalgebra::DVector::from_fn(geometry.nodes.len() * D, |i, _| {
                    geometry.nodes[i / D].coefficient * direction[i % D]
                });
                let square: f64 = geometry.nodes.iter().map(|node| node.coefficient.powi(2)).sum();
                (apart.transpose() * &soft * &apart)[0] / (square * square * geometry.area)
            };
            assert!((resists(&geometry.normal) / limit - 1.0).abs() < 1e-12, "{what}");
            for direction in vectors::<D>(5, 23, 1.0) {
                let along = direction - geometry.normal * geometry.normal.dot(&direction);
                assert!(resists(&along) <= D as f64 * limit * along.norm_squared(), "{what}");
            }
        }
    }
}

/// The springs for multigrid are K_CN and K_T where these are soft, and no stiffer than asked; symmetric, not negative.
#[test]
fn joints_are_soft_enough_for_multigrid() {
    joins::<2>(ElementKind::Line3, (OBSTACLES[1].samples_2d)()[0]);
    joins::<3>(ElementKind::Quad4, (OBSTACLES[2].samples_3d)()[0]);
}
