//! Damping of contact: tangents by displacement and velocity, work, and heat.

use super::free_tests;
use super::moving_tests::motion;
use super::obstacle_tests::size;
use super::tests::{
    CONTACT_TERMS, PairScene, SHIFT, conserves, error_over_step, is_consistent, rate, regimes,
};
use super::*;
use crate::contact::damping::{ActiveDamping, ContactDamping, HuntCrossley, Kelvin, NormalDamping};
use crate::contact::obstacle::sample_shapes;
use crate::contact::pair_scene::{COMPLIANCE, coulomb, penalty};
use crate::mesh::ElementKind;
use crate::reader::quantity::AreaViscosity;
use crate::taylor::scatter;

/// Viscosity [Pa s/m] whose traction at the velocities of the scenes is below their pressure.
const VISCOSITY: f64 = 0.02 / COMPLIANCE;

fn dampings() -> [ContactDamping; 4] {
    let of = |normal: Option<NormalDamping>, tangential: f64| ContactDamping {
        normal,
        tangential: (tangential > 0.0).then(|| AreaViscosity::new(tangential)),
    };
    [
        of(Some(Kelvin::of(VISCOSITY).into()), 0.0),
        of(Some(HuntCrossley::of(0.7).into()), 0.0),
        of(None, VISCOSITY),
        of(Some(Kelvin::of(VISCOSITY).into()), 0.5 * VISCOSITY),
    ]
}

/// The laws of [`dampings`] without friction, and with friction in every regime.
fn laws() -> Vec<ContactLaw> {
    let friction = std::iter::once(penalty(None))
        .chain(regimes().map(|regularization| penalty(Some(coulomb(0.4, regularization)))));
    friction.flat_map(|law| dampings().map(|damping| ContactLaw { damping, ..law })).collect()
}

impl<const D: usize> PairScene<D> {
    /// The scene whose points were open at the start of the step.
    fn closing(mut self) -> Self {
        self.state.history.iter_mut().for_each(|history| history.gap = 0.03);
        self
    }
}

/// Between bodies the tangent is the derivative of the force by displacement and velocity, for points
/// in contact and for points that close within the step. Without the term of normal damping it is
/// not.
#[test]
fn the_damped_tangent_between_bodies_is_the_derivative() {
    for law in laws() {
        let plane = PairScene::<2>::bent(ElementKind::Quad4, ElementKind::Quad9, law);
        let space = PairScene::<3>::bent(ElementKind::Hex8, ElementKind::Tet4, law);
        is_consistent(&plane, &format!("{law:?}"));
        is_consistent(&plane.clone().closing(), &format!("closing, {law:?}"));
        is_consistent(&space, &format!("in space, {law:?}"));
        if law.damping.normal.is_some() {
            let whole = plane.matrix(Terms::ALL);
            let rest = Terms::ALL - Terms::NORMAL_DAMPING;
            assert!(size(&plane.matrix(Terms::NORMAL_DAMPING)) > 1e-3 * size(&whole));
            let found = rate(&plane, rest, &ContactRequest::default());
            assert!(found < 1.5, "{found}");
        }
    }
}

/// The tangent is consistent over obstacles, moving bodies and free bodies of every shape.
#[test]
fn the_damped_tangent_over_rigid_bodies_is_the_derivative() {
    fn shapes<const D: usize>(kind: ElementKind) {
        for obstacle in sample_shapes::<D>() {
            for law in laws().into_iter().step_by(3) {
                let scene = PairScene::<D>::bent_over(&obstacle, kind, law);
                is_consistent(&scene, "at rest");
                is_consistent(&scene.clone().closing(), "closing");
                is_consistent(&scene.clone().moving(&motion(0.02), [0.0, 0.05], None), "moving");
                free_tests::check(&scene.over_free_body(), SHIFT, "free");
            }
        }
    }
    shapes::<2>(ElementKind::Quad4);
    shapes::<3>(ElementKind::Hex8);
}

/// The terms of a damped contact add up to the full matrix.
#[test]
fn damped_terms_add_up() {
    for law in laws() {
        let scene = PairScene::<2>::bent(ElementKind::Quad4, ElementKind::Quad4, law);
        let whole = scene.matrix(Terms::ALL);
        let mut sum = vec![0.0; whole.len()];
        for terms in CONTACT_TERMS.into_iter().chain([Terms::NORMAL_DAMPING]) {
            sum.iter_mut().zip(scene.matrix(terms)).for_each(|(sum, part)| *sum += part);
        }
        let left: Vec<f64> = whole.iter().zip(&sum).map(|(whole, sum)| whole - sum).collect();
        assert!(size(&left) < 1e-12 * size(&whole), "{law:?}");
    }
}

/// Damping of the pressure and of the shear oppose the relative motion, beside what the contact does
/// without damping. A static start is not damped.
#[test]
fn damping_opposes_the_motion() {
    for law in laws() {
        let mut scene = PairScene::<3>::bent(ElementKind::Hex8, ElementKind::Hex8, law);
        let undamped = ContactRequest { damping: ActiveDamping::Off, ..ContactRequest::default() };
        let still = scene.clone().evaluate(&undamped).force;
        scene.evaluate(&ContactRequest::default());
        let mut heat = 0.0;
        for point in scene.state.current.iter().filter(|point| point.is_closed()) {
            let shear = -point.viscous_traction.dot(&point.slip_velocity);
            assert!(shear >= 0.0 && point.normal_traction >= 0.0);
            heat += shear + point.normal_damping.abs();
        }
        assert!(heat > 0.0, "{law:?}");
        scene.contact.law.damping = ContactDamping::default();
        let without = scene.evaluate(&ContactRequest::default()).force;
        assert_eq!(still, without);
    }
}

/// Forces over a step do work equal to the decrease of the contact energy minus the heat of friction
/// and damping, without resultant and moment.
#[test]
fn damped_forces_over_a_step_keep_the_balance() {
    for law in
        laws().into_iter().filter(|law| law.friction.is_none_or(|f| f.regularization.stiffness().is_some()))
    {
        for size in [1e-3, 3e-2] {
            conserves::<2>(ElementKind::Quad4, ElementKind::Quad4, law, size);
            conserves::<3>(ElementKind::Hex8, ElementKind::Tet4, law, size);
        }
    }
}

/// Over a step the matrix includes the damping along the normal: on flat surfaces it is the derivative.
#[test]
fn the_damped_matrix_over_a_step_is_near_the_derivative() {
    for damping in &dampings()[..2] {
        let law = ContactLaw { damping: *damping, ..penalty(None) };
        let flat = |terms| {
            let mut scene = PairScene::<2>::bent(ElementKind::Quad4, ElementKind::Quad4, law);
            scene.u.fill(0.0);
            error_over_step(scene, terms)
        };
        assert!(flat(Terms::ALL) < 1e-4, "{}", flat(Terms::ALL));
        assert!(flat(Terms::ALL - Terms::NORMAL_CONTACT) > 0.1);
    }
}

/// The heat of damping is exact for a uniform motion: traction times path.
#[test]
fn heat_is_traction_times_path() {
    let damping = dampings()[3];
    let law = ContactLaw { damping, ..penalty(None) };
    let mut scene = PairScene::<2>::bent(ElementKind::Quad4, ElementKind::Quad4, law);
    let count = scene.u.len();
    scene.v = scatter(count, 3).iter().map(|v| 0.1 * v).collect();
    scene.u.fill(0.0);
    scene.u_start = scene.v.iter().map(|v| -1e-3 * v).collect();
    scene.evaluate(&ContactRequest::default());
    for (point, history) in scene.state.current.iter().zip(&mut scene.state.history) {
        history.damping_traction = point.damping_traction();
    }
    scene.evaluate(&ContactRequest::default());
    let heat: f64 = scene.state.current.iter().map(|point| point.area * point.damping_work).sum();
    let mut bare = scene.clone();
    let damped = scene.evaluate(&ContactRequest::default()).force;
    let elastic =
        bare.evaluate(&ContactRequest { damping: ActiveDamping::Off, ..ContactRequest::default() }).force;
    let forces = damped.iter().zip(&elastic).zip(&scene.v);
    let work: f64 = forces.map(|((damped, elastic), v)| (damped - elastic) * 1e-3 * v).sum();
    assert!(heat > 0.0 && (heat / -work - 1.0).abs() < 1e-12, "{heat:e} {work:e}");
}
