//! A block on every obstacle: tangents term by term, stages, conserving steps, and lumped vertices.

use std::rc::Rc;

use super::tests::{CONTACT_TERMS, Dense, PairScene, error_over_step, rate, regimes, stored_energy};
use super::*;
use crate::contact::friction::{FRICTION_LAWS, Friction};
use crate::contact::normal::NORMAL_LAWS;
use crate::contact::obstacle::{Plane, Shape, sample_shapes};
use crate::contact::pair_scene::{block, coulomb, frictionless, penalty};
use crate::contact::point::step::stored;
use crate::contact::state::{Hold, Keep};
use crate::contact::surface::Ownership;
use crate::mesh::{ElementKind, merge};
use crate::taylor::scatter;
use crate::tensor::Tensor;

/// Depth of the centre of the bottom \[m\].
const DEPTH: f64 = 0.01;
const WIDTH: f64 = 0.2;

const PLANE_KINDS: [ElementKind; 2] = [ElementKind::Quad4, ElementKind::Quad9];
pub const SPACE_KINDS: [ElementKind; 5] =
    [ElementKind::Hex8, ElementKind::Tet4, ElementKind::Hex20, ElementKind::Hex27, ElementKind::Tet10];

impl<const D: usize> PairScene<D> {
    /// The bottom of a block pressed into an obstacle that it faces, at rest.
    fn over(obstacle: &Rc<dyn Shape<D>>, kind: ElementKind) -> Self {
        let middle = Self::middle(&**obstacle);
        Self::standing(obstacle, kind, obstacle.proximity(&middle).normal)
    }

    /// A point below the surface of an obstacle.
    fn middle(obstacle: &dyn Shape<D>) -> Vector<D> {
        let mut middle = Vector::<D>::from_fn(|i, _| 0.41 + 0.1 * i as f64);
        for _ in 0..4 {
            let at = obstacle.proximity(&middle);
            middle -= at.normal * (at.gap + DEPTH);
        }
        middle
    }

    /// A block whose upward direction is `up`.
    fn standing(obstacle: &Rc<dyn Shape<D>>, kind: ElementKind, up: Vector<D>) -> Self {
        let mut mesh = block::<D>(kind, [-0.5 * WIDTH, 0.5 * WIDTH], [0.0, WIDTH], 2);
        let axis = Vector::<D>::from_fn(|i, _| f64::from(u8::from(i + 1 == D)));
        let turn = up * axis.transpose() - axis * up.transpose();
        let rotation = Tensor::identity() + turn + turn * turn / (1.0 + axis.dot(&up));
        let middle = Self::middle(&**obstacle);
        for point in &mut mesh.points {
            *point = (middle + rotation * Vector::from(*point)).into();
        }
        let mesh = merge(vec![("upper".to_owned(), mesh)]).unwrap();
        let mine = vec![true; mesh.element_count()];
        let global: Vec<u32> = (0..mesh.element_count() as u32).collect();
        let ownership = Ownership { owned_nodes: mesh.points.len(), mine: &mine, global_element: &global };
        let facets = &mesh.facet_sets["upper.bottom"];
        let target = ContactTarget::Obstacle(obstacle.clone().into());
        let surface = VertexSurface::new(&mesh, facets, &ownership, &target);
        let state = ContactState::new(surface.vertices().len());
        let contact = VertexContact { depth: f64::MAX, ..frictionless(surface, target) };
        let rest = vec![0.0; mesh.points.len() * D];
        let candidates = contact.candidates_of((0..facets.len() as u32).map(|facet| (facet, 0)).collect());
        Self { mesh, contact, candidates, v: rest.clone(), u_start: rest.clone(), u: rest, state }
    }

    /// A block on an obstacle, bent and in motion, with tractions from the previous step.
    pub fn bent_over(obstacle: &Rc<dyn Shape<D>>, kind: ElementKind, law: ContactLaw) -> Self {
        Self::over(obstacle, kind).bend(law)
    }

    fn bend(self, law: ContactLaw) -> Self {
        let mut scene = self;
        let size = scene.u.len();
        scene.contact.law = law;
        scene.v = scatter(size, 3).iter().map(|v| v * 0.5).collect();
        scene.u = scatter(size, 5).iter().map(|u| u * 0.002).collect();
        scene.u_start = scatter(size, 7).iter().map(|u| u * 0.002).collect();
        scene.evaluate(&ContactRequest::default());
        scene.state.accept(1e-3);
        scene.u = scatter(size, 9).iter().map(|u| u * 0.002).collect();
        scene
    }
}

pub fn size(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Checks that the tangent has order two, and that it loses this order without any of its terms
/// that is not small. Returns the terms that mattered.
pub fn check<const D: usize>(scene: &PairScene<D>, request: &ContactRequest, what: &str) -> Terms {
    let found = rate(scene, Terms::ALL, request);
    let (target, law) = (&scene.contact.target, &scene.contact.law);
    assert!(found > 1.9, "{what} {target:?} {law:?}: order {found}");
    let whole = scene.selected(Terms::ALL, request, None);
    let mut seen = Terms::empty();
    for term in CONTACT_TERMS {
        let rest = scene.selected(Terms::ALL - term, request, None);
        let part: Vec<f64> = whole.iter().zip(&rest).map(|(whole, rest)| whole - rest).collect();
        if size(&part) < 1e-3 * size(&whole) {
            continue;
        }
        seen |= term;
        let found = rate(scene, Terms::ALL - term, request);
        assert!(found < 1.5, "{what} {target:?} {law:?}: order {found} without {term:?}");
    }
    seen
}

fn every_law<const D: usize>(targets: &[Rc<dyn Shape<D>>], kind: ElementKind) -> Terms {
    let mut seen = Terms::empty();
    for target in targets {
        for normal in NORMAL_LAWS.iter().flat_map(|entry| (entry.samples)()) {
            let law = ContactLaw { normal, ..penalty(None) };
            seen |=
                check(&PairScene::bent_over(target, kind, law), &ContactRequest::default(), "frictionless");
            for own in FRICTION_LAWS.iter().flat_map(|entry| (entry.samples)()) {
                for regularization in regimes() {
                    let law = ContactLaw { normal, ..penalty(Some(Friction { law: own, regularization })) };
                    seen |=
                        check(&PairScene::bent_over(target, kind, law), &ContactRequest::default(), "law");
                }
            }
        }
    }
    seen
}

/// On every obstacle every law has a consistent tangent in stick and in slip, and every term of it
/// matters in some case.
#[test]
fn the_tangent_over_an_obstacle_is_the_derivative() {
    let all: Terms = CONTACT_TERMS.into_iter().collect();
    assert_eq!(every_law::<2>(&sample_shapes(), ElementKind::Quad4), all);
    let spheres = sample_shapes::<3>();
    every_law::<3>(&spheres[2..3], ElementKind::Tet4);
}

/// The tangent is consistent on every kind of facet, with the current and with the undeformed area.
/// With the undeformed area no area varies.
#[test]
fn so_is_that_of_every_facet() {
    fn facets<const D: usize>(obstacle: &Rc<dyn Shape<D>>, kinds: &[ElementKind]) {
        for &kind in kinds {
            for regularization in [regimes()[1], regimes()[3]] {
                let law = penalty(Some(coulomb(0.7, regularization)));
                let mut scene = PairScene::bent_over(obstacle, kind, law);
                assert!(check(&scene, &ContactRequest::default(), kind.name()).contains(Terms::ZONE_CHANGE));
                scene.contact.area = AreaKind::Reference;
                assert!(!check(&scene, &ContactRequest::default(), kind.name()).contains(Terms::ZONE_CHANGE));
            }
        }
    }
    sample_shapes::<2>().into_iter().for_each(|obstacle| facets(&obstacle, &PLANE_KINDS));
    sample_shapes::<3>().into_iter().step_by(2).for_each(|obstacle| facets(&obstacle, &SPACE_KINDS));
}

/// The weight of a facet decreases as it becomes upright, and is zero for a facet that faces away.
/// The tangent includes this weight.
#[test]
fn upright_facets_do_not_press() {
    let force = |degrees: f64, kind: ElementKind| {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let plane: Rc<dyn Shape<2>> = Rc::new(Plane::new(Vector::zeros(), Vector::<2>::new(sine, cosine)));
        let mut scene = PairScene::standing(&plane, kind, Vector::<2>::y());
        let still = size(&scene.evaluate(&ContactRequest::default()).force);
        if still > 0.0 {
            let bent = PairScene::bent_over(&plane, kind, penalty(Some(coulomb(0.7, regimes()[1]))));
            let found = rate(&bent, Terms::ALL, &ContactRequest::default());
            assert!(found > 1.9, "{kind} at {degrees} degrees: order {found}");
        }
        still
    };
    for kind in PLANE_KINDS {
        let forces = [0.0, 70.0, 80.0, 90.0, 120.0].map(|degrees| force(degrees, kind));
        assert!(forces[1] > forces[2] && forces[2] > 0.0, "{forces:?}");
        assert!(forces[3] < 1e-20 * forces[0] && forces[4] == 0.0, "{forces:?}");
    }
}

/// Without friction and with the undeformed area the tangent over a plane is symmetric.
#[test]
fn the_tangent_over_a_plane_is_symmetric() {
    for obstacle in sample_shapes::<3>().into_iter().filter(|obstacle| obstacle.is_plane()) {
        for kind in SPACE_KINDS {
            let mut scene = PairScene::bent_over(&obstacle, kind, penalty(None));
            scene.contact.area = AreaKind::Reference;
            let (matrix, total) = (scene.matrix(Terms::ALL), scene.u.len());
            let skew = (0..total * total).map(|i| (matrix[i] - matrix[i % total * total + i / total]).abs());
            assert!(size(&matrix) > 0.0 && skew.fold(0.0, f64::max) < 1e-14 * size(&matrix), "{kind}");
        }
    }
}

/// On straight facets over a plane, each vertex has the gap at its own position and applies force
/// only to its own node. This also holds for a facet that overhangs the plane.
#[test]
fn a_corner_on_a_plane_keeps_to_itself() {
    let plane: Rc<dyn Shape<3>> = Rc::new(Plane::new(Vector::zeros(), Vector::<3>::new(0.3, 0.0, 1.0)));
    let mut scene = PairScene::standing(&plane, ElementKind::Hex8, Vector::<3>::z());
    let Dense { force, .. } = scene.evaluate(&ContactRequest::default());
    let mut open = 0;
    for (vertex, point) in scene.state.current.iter().enumerate() {
        let node = scene.contact.surface.vertices()[vertex] as usize;
        let gap = plane.gap(&scene.mesh.points[node].into());
        assert!((point.gap - gap).abs() < 1e-16);
        let pushed = Vector::<3>::from_row_slice(&force[3 * node..][..3]);
        assert!(
            (pushed - point.normal * (point.normal_traction * point.area)).norm() <= 1e-12 * pushed.norm()
        );
        open += usize::from(gap > 0.0);
        assert_eq!(point.is_closed(), gap <= 0.0);
    }
    assert!(open > 0 && open < scene.state.current.len());
}

/// A vertex far from a round obstacle has the correct distance of its facets.
#[test]
fn gaps_are_known_at_any_distance() {
    for obstacle in sample_shapes::<2>() {
        let mut scene = PairScene::<2>::over(&obstacle, ElementKind::Quad4);
        let normal = obstacle.proximity(&PairScene::middle(&*obstacle)).normal;
        let away = if obstacle.is_plane() { 5.0 } else { 0.1 };
        scene
            .u
            .chunks_exact_mut(2)
            .for_each(|u| u.iter_mut().zip(normal.iter()).for_each(|(u, n)| *u += away * n));
        scene.evaluate(&ContactRequest::default());
        for point in &scene.state.current {
            assert!(
                !point.is_closed() && point.gap > 0.01 && point.gap < away + 0.1,
                "{obstacle:?}: {}",
                point.gap
            );
        }
    }
}

/// Frozen quantities do not change in a stage, and the tangent accounts for this.
#[test]
fn stages_have_consistent_tangents() {
    let law = penalty(Some(coulomb(0.7, regimes()[0])));
    for obstacle in sample_shapes::<2>() {
        let mut scene = PairScene::bent_over(&obstacle, ElementKind::Quad4, law);
        scene.evaluate(&ContactRequest::default());
        let live = scene.evaluate(&ContactRequest::default()).force;
        scene.state.freeze(Keep::Pressure);
        scene.state.freeze(Keep::Friction);
        let stage = |hold| ContactRequest { hold, ..ContactRequest::default() };
        for hold in [Hold::Bound, Hold::BoundAndPressure, Hold::FrictionTraction] {
            let force = scene.evaluate(&stage(hold)).force;
            let apart: Vec<f64> = force.iter().zip(&live).map(|(a, b)| a - b).collect();
            assert!(size(&apart) < 1e-12 * size(&live), "frozen at its own value nothing changes: {hold:?}");
        }
        let first = check(&scene, &stage(Hold::Bound), "stage I");
        assert!(!first.contains(Terms::FRICTION_NORMAL_COUPLING) && first.contains(Terms::NORMAL_CONTACT));
        let second = check(&scene, &stage(Hold::BoundAndPressure), "stage II");
        assert!(!second.intersects(Terms::NORMAL_CONTACT | Terms::FRICTION_NORMAL_COUPLING));
        assert!(second.contains(Terms::FRICTION_DAMPING));
        assert!(
            !check(&scene, &stage(Hold::FrictionTraction), "known friction")
                .contains(Terms::FRICTION_DAMPING)
        );
        let frictionless = check(&scene, &stage(Hold::Frictionless), "start");
        assert!(!frictionless.intersects(Terms::FRICTION_DAMPING | Terms::FRICTION_GEOMETRY));
    }
}

/// Energy that elastic stick had stored at the start, on the areas at these displacements \[J\].
pub fn held_energy<const D: usize>(scene: &PairScene<D>, u: &[f64]) -> f64 {
    let mut at = scene.clone();
    at.u = u.to_vec();
    at.evaluate(&ContactRequest::default());
    let areas = at.state.current.iter().map(|point| point.area);
    let law = &scene.contact.law;
    areas.zip(&scene.state.history).map(|(area, own)| area * stored(law, &own.friction_traction)).sum()
}

fn conserves<const D: usize>(obstacle: &Rc<dyn Shape<D>>, kind: ElementKind, law: ContactLaw, motion: f64) {
    let what = format!("{kind} on {obstacle:?}, motion {motion}");
    let mut scene = PairScene::<D>::bent_over(obstacle, kind, law);
    scene.contact.area = AreaKind::Reference;
    let step = scatter(scene.u.len(), 11);
    scene.u_start = scene.u.iter().zip(&step).map(|(u, d)| u - 0.5 * motion * d).collect();
    let end: Vec<f64> = scene.u.iter().zip(&step).map(|(u, d)| u + 0.5 * motion * d).collect();
    let [before, after] = [&scene.u_start, &end].map(|u| stored_energy(&scene, u));
    let held = held_energy(&scene, &scene.u_start);
    let places = scene.positions();
    let force = scene.evaluate(&ContactRequest { over_step: true, ..ContactRequest::default() }).force;
    let work: f64 = force.iter().zip(&step).map(|(f, d)| f * motion * d).sum();
    let sum = |value: &dyn Fn(&PointState<D>) -> f64| -> f64 {
        scene.state.current.iter().map(|point| point.area * value(point)).sum()
    };
    let [heat, stick] = [sum(&|point| point.plastic_work), sum(&|point| point.recoverable)];
    let balance = work + (after - before) + heat + (stick - held);
    let scale = force.iter().zip(&step).map(|(f, d)| (f * motion * d).abs()).sum::<f64>();
    let rounding = 1e-12 * scale + 1e-13 * before;
    assert!(balance.abs() < rounding, "{what}: energy {balance:e} of {scale:e}");
    if law.friction.is_some() {
        return;
    }
    let nodes = places.iter().zip(force.chunks_exact(D));
    let mut along = [0.0; 6];
    for (x, force) in nodes {
        let force = Vector::<D>::from_row_slice(force);
        obstacle.motions_along(x).iter().zip(&mut along).for_each(|(motion, sum)| *sum += motion.dot(&force));
    }
    assert!(size(&along) < 1e-12 * size(&force), "{what}: momentum {along:?}");
}

/// Over a step the work equals the change of energies plus frictional heat. Without friction there
/// is no momentum along a plane and no angular momentum about a centre or an axis.
#[test]
fn forces_over_a_step_conserve_on_obstacles() {
    let friction = penalty(Some(coulomb(0.4, regimes()[3])));
    for motion in [1e-6, 1e-3, 2e-2] {
        for law in [penalty(None), friction] {
            for obstacle in sample_shapes::<2>() {
                PLANE_KINDS.iter().for_each(|&kind| conserves::<2>(&obstacle, kind, law, motion));
            }
            for obstacle in sample_shapes::<3>() {
                SPACE_KINDS[..3].iter().for_each(|&kind| conserves::<3>(&obstacle, kind, law, motion));
            }
        }
    }
}

/// The matrix over a step is the derivative of the force on a plane, and within one percent on
/// round obstacles.
#[test]
fn the_matrix_over_a_step_on_obstacles_is_near_the_derivative() {
    for law in [penalty(None), penalty(Some(coulomb(0.4, regimes()[3])))] {
        let mut worst = [0.0_f64; 2];
        for obstacle in sample_shapes::<2>() {
            let error =
                error_over_step(PairScene::<2>::bent_over(&obstacle, ElementKind::Quad4, law), Terms::ALL);
            let round = usize::from(!obstacle.is_plane());
            worst[round] = worst[round].max(error);
        }
        for obstacle in sample_shapes::<3>() {
            let error =
                error_over_step(PairScene::<3>::bent_over(&obstacle, ElementKind::Hex8, law), Terms::ALL);
            let round = usize::from(!obstacle.is_plane());
            worst[round] = worst[round].max(error);
        }
        assert!(worst[0] < 1e-5 && worst[1] < 1e-2, "{worst:?}");
    }
}

/// On a plane no normal rotates, and the springs for multigrid equal K_CN and K_T, limited to the
/// given stiffness. This holds at an instant and over a step.
#[test]
fn springs_on_a_plane_are_the_terms() {
    let stick = penalty(Some(coulomb(0.4, regimes()[3])));
    for obstacle in sample_shapes::<3>().into_iter().filter(|obstacle| obstacle.is_plane()) {
        for (law, over_step) in [(penalty(None), false), (stick, false), (penalty(None), true), (stick, true)]
        {
            let mut scene = PairScene::<3>::bent_over(&obstacle, ElementKind::Hex8, law);
            scene.contact.area = AreaKind::Reference;
            scene.u_start.clone_from(&scene.u);
            let request = ContactRequest { over_step, ..ContactRequest::default() };
            let springs = |joint| scene.selected(Terms::empty(), &request, Some(joint));
            let terms = scene.selected(Terms::NORMAL_CONTACT | Terms::FRICTION_DAMPING, &request, None);
            let apart: Vec<f64> = springs(f64::INFINITY).iter().zip(&terms).map(|(a, b)| a - b).collect();
            assert!(
                size(&terms) > 0.0 && size(&apart) < 1e-9 * size(&terms),
                "{}",
                size(&apart) / size(&terms)
            );
            let stiffest = 1e-3 / crate::contact::pair_scene::COMPLIANCE;
            let most = springs(stiffest).iter().fold(0.0_f64, |most, k| most.max(k.abs()));
            assert!(most > 0.0 && most <= 2.0 * stiffest * WIDTH * WIDTH, "{most:e}");
        }
    }
}
