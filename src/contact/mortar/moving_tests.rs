//! A block on a moving rigid body: tangents, invariance under a common motion, and the work of the
//! body over a step.

use std::rc::Rc;

use super::obstacle_tests::{SPACE_KINDS, check, held_energy, size};
use super::tests::{PairScene, error_over_step, regimes, stored_energy};
use super::*;
use crate::contact::obstacle::{Shape, sample_shapes};
use crate::contact::pair_scene::{coulomb, penalty};
use crate::contact::rigid::{BodyMotion, MotionInstant, MotionStep, TargetLoad};
use crate::contact::target::{RigidTarget, TargetMotion};
use crate::mesh::ElementKind;
use crate::reader::function::Function;
use crate::taylor::scatter;
use crate::tensor::{Tensor, cross};

const CENTRE: [f64; 3] = [0.3, 0.5, 0.45];
const AXIS: [f64; 3] = [2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0];

/// A motion with displacements and angles of this size in a unit of time.
pub fn motion<const D: usize>(scale: f64) -> BodyMotion<D> {
    let function = |text: &str| Function::expression(&format!("{scale} * ({text})")).unwrap().into();
    let along = ["t + 2 * t ^ 2", "-0.7 * t", "0.4 * sin(t)"];
    BodyMotion {
        centre: Vector::from_fn(|i, _| CENTRE[i]),
        axis: if D == 2 { [0.0, 0.0, 1.0] } else { AXIS },
        translation: std::array::from_fn(|i| function(along[i])),
        angle: function("1.3 * t + t ^ 2"),
    }
}

fn instant(time: f64) -> MotionInstant {
    MotionInstant { time, factor: 1.0 }
}

/// The rotation of that motion at an angle, by an independent formula.
fn rotation<const D: usize>(angle: f64) -> Tensor<D> {
    let plane = nalgebra::Rotation2::new(angle).into_inner();
    let axis = nalgebra::Unit::new_normalize(nalgebra::Vector3::from(AXIS));
    let space = nalgebra::Rotation3::from_axis_angle(&axis, angle).into_inner();
    Tensor::from_fn(|i, j| if D == 2 { plane[(i, j)] } else { space[(i, j)] })
}

/// Current position of a point of the body frame.
fn carried<const D: usize>(motion: &BodyMotion<D>, time: f64, x: &Vector<D>) -> Vector<D> {
    let value = |function: &Function| function.value([0.0; 3], time);
    let shift = Vector::from_fn(|i, _| value(&motion.translation[i]));
    motion.centre + shift + rotation::<D>(value(&motion.angle)) * (x - motion.centre)
}

impl<const D: usize> PairScene<D> {
    /// The scene over the same shape in motion, placed for a step between these times.
    pub fn moving(mut self, motion: &BodyMotion<D>, times: [f64; 2], over: Option<f64>) -> Self {
        let ContactTarget::Obstacle(RigidTarget { shape, .. }) = &self.contact.target else { panic!() };
        let moving =
            RigidTarget::moving(shape.clone(), Some(TargetMotion::Prescribed(Rc::new(motion.clone()))));
        self.contact.target = ContactTarget::Obstacle(moving);
        let [start, end] = times.map(instant);
        self.contact.target.place(&MotionStep { start, end, over, ahead: None }, &[]).unwrap();
        self
    }

    fn gaps(mut self, branches: Branches) -> Vec<f64> {
        self.evaluate(&ContactRequest { branches, ..ContactRequest::default() });
        self.state.current.iter().map(|point| point.gap).collect()
    }

    /// The scene at rest, carried along by the body: its nodes have the same positions, velocities
    /// and history as seen from the body.
    fn carried(mut self, motion: &BodyMotion<D>, times: [f64; 2]) -> Self {
        let at = |time: f64| motion.at(instant(time)).unwrap();
        let points: Vec<Vector<D>> = self.mesh.points.iter().map(|&x| x.into()).collect();
        let turn = rotation::<D>(at(times[1]).angle);
        for (node, x) in points.iter().enumerate() {
            let field = |field: &[f64]| Vector::<D>::from_column_slice(&field[node * D..][..D]);
            let start = carried(motion, times[0], &(x + field(&self.u_start)));
            let seen = x + field(&self.u);
            let end = carried(motion, times[1], &seen);
            // Twice the step of a central difference.
            let h = 1e-5;
            let dragged =
                (carried(motion, times[1] + h, &seen) - carried(motion, times[1] - h, &seen)) / (2.0 * h);
            let v = dragged + turn * field(&self.v);
            for i in 0..D {
                self.u_start[node * D + i] = start[i] - x[i];
                self.u[node * D + i] = end[i] - x[i];
                self.v[node * D + i] = v[i];
            }
        }
        let before = rotation::<D>(at(times[0]).angle);
        for history in &mut self.state.history {
            history.normal = before * history.normal;
            history.friction_traction = before * history.friction_traction;
        }
        self.moving(motion, times, None)
    }
}

/// Over moving bodies of every shape the tangent of every law is consistent, in stick and in slip.
#[test]
fn the_tangent_over_a_moving_body_is_the_derivative() {
    fn shapes<const D: usize>(kind: ElementKind, scale: f64) {
        for obstacle in sample_shapes::<D>() {
            for regularization in regimes() {
                let law = penalty(Some(coulomb(0.7, regularization)));
                let scene =
                    PairScene::<D>::bent_over(&obstacle, kind, law).moving(&motion(scale), [0.0, 0.05], None);
                check(&scene, &ContactRequest::default(), "moving");
            }
        }
    }
    shapes::<2>(ElementKind::Quad4, 0.02);
    shapes::<2>(ElementKind::Quad9, 0.02);
    shapes::<3>(ElementKind::Hex8, 0.02);
    // A fast rotation about a near point hardly moves the surface in a short time.
    let fast = BodyMotion { angle: Function::expression("40 * t").unwrap().into(), ..motion(0.0) };
    for obstacle in sample_shapes::<2>() {
        let law = penalty(Some(coulomb(0.7, regimes()[2])));
        let scene =
            PairScene::<2>::bent_over(&obstacle, ElementKind::Quad4, law).moving(&fast, [0.0, 1e-4], None);
        check(&scene, &ContactRequest::default(), "fast");
    }
}

/// A body and a scene that it carries along have the forces, tractions and slips of the scene at
/// rest, turned by the rotation of the body. The load on the body is the reaction.
#[test]
fn a_common_motion_changes_nothing() {
    fn shapes<const D: usize>(kind: ElementKind) {
        let motion = motion::<D>(1.0);
        let times = [0.4, 0.7];
        for obstacle in sample_shapes::<D>() {
            for regularization in regimes() {
                let law = penalty(Some(coulomb(0.7, regularization)));
                let mut rest = PairScene::<D>::bent_over(&obstacle, kind, law);
                let mut moving = rest.clone().carried(&motion, times);
                let [still, force] =
                    [&mut rest, &mut moving].map(|scene| scene.evaluate(&ContactRequest::default()).force);
                let state = motion.at(instant(times[1])).unwrap();
                let turn = rotation::<D>(state.angle);
                let mut load = TargetLoad::default();
                let origin = motion.centre + state.translation;
                for ((still, force), x) in
                    still.chunks_exact(D).zip(force.chunks_exact(D)).zip(moving.positions())
                {
                    let [still, force] = [still, force].map(Vector::<D>::from_column_slice);
                    assert!(
                        (force - turn * still).norm() < 1e-7 * size(&self::flat(&rest, still)),
                        "{obstacle:?}"
                    );
                    load.react(&(x - origin), &force);
                }
                let scale = size(&force);
                assert!((load.force - moving.state.load.force).norm() < 1e-12 * scale);
                let apart = load.torque.iter().zip(&moving.state.load.torque).map(|(a, b)| (a - b).abs());
                assert!(apart.fold(0.0, f64::max) < 1e-12 * scale);
                for (point, still) in moving.state.current.iter().zip(&rest.state.current) {
                    let near = |a: Vector<D>, b: Vector<D>, scale: f64| (a - turn * b).norm() < 1e-7 * scale;
                    assert!((point.gap - still.gap).abs() < 1e-12);
                    assert!(near(point.normal, still.normal, 1.0));
                    assert!(near(point.friction_traction, still.friction_traction, still.bound.max(1.0)));
                    assert!(near(point.slip_velocity, still.slip_velocity, 1.0));
                    assert!(near(point.slip_increment, still.slip_increment, 1.0));
                }
            }
        }
    }
    shapes::<2>(ElementKind::Quad4);
    shapes::<3>(ElementKind::Hex8);
}

/// Gaps are linear in the positions as seen from the body: a scene that the body carries along has the
/// linearised gaps of the scene at rest.
#[test]
fn linearised_gaps_are_those_seen_from_the_body() {
    fn shapes<const D: usize>(kind: ElementKind) {
        let motion = motion::<D>(1.0);
        let times = [0.4, 0.7];
        let mut largest = 0.0_f64;
        for obstacle in sample_shapes::<D>() {
            let mut rest = PairScene::<D>::bent_over(&obstacle, kind, penalty(None));
            let mut moving = rest.clone().carried(&motion, times);
            let selection = TermSelection { terms: Terms::ALL, velocity_shift: 0.0, joint: None };
            for scene in [&mut rest, &mut moving] {
                scene.evaluate(&ContactRequest { stiffness: Some(selection), ..ContactRequest::default() });
                scene.state.linearise_gaps();
            }
            rest.u.iter_mut().zip(scatter(moving.u.len(), 13)).for_each(|(u, d)| *u += 2e-3 * d);
            moving.u = rest.clone().carried(&motion, times).u;
            let actual = rest.clone().gaps(Branches::Actual);
            let [still, moved] = [rest, moving].map(|scene| scene.gaps(Branches::Linearised));
            for (still, moved) in still.iter().zip(&moved).filter(|(still, _)| still.is_finite()) {
                assert!((still - moved).abs() < 1e-12, "{obstacle:?}: {still:e} {moved:e}");
            }
            let differences = still.iter().zip(&actual).map(|(still, actual)| (still - actual).abs());
            largest = differences.filter(|difference| difference.is_finite()).fold(largest, f64::max);
        }
        assert!(largest > 1e-6, "gaps of the positions are the linear ones: {largest:e}");
    }
    shapes::<2>(ElementKind::Quad4);
    shapes::<3>(ElementKind::Hex8);
}

/// The size against which a force is compared: that of all contact forces.
fn flat<const D: usize>(scene: &PairScene<D>, _: Vector<D>) -> Vec<f64> {
    scene.state.current.iter().map(|point| point.area * (point.normal_traction + point.bound)).collect()
}

/// A block that sticks to a body and moves with it, rotation included, gets no slip and keeps its
/// friction, which rotates with the body.
#[test]
fn a_body_that_carries_a_block_along_makes_no_slip() {
    fn shapes<const D: usize>(kind: ElementKind) {
        let motion = motion::<D>(1.0);
        let times = [0.4, 0.7];
        for obstacle in sample_shapes::<D>() {
            let law = penalty(Some(coulomb(0.7, regimes()[3])));
            let mut rest = PairScene::<D>::bent_over(&obstacle, kind, law);
            // At the start of the step the block has the shape that it has at the end.
            rest.evaluate(&ContactRequest::default());
            rest.state.accept(1e-3);
            rest.u_start.clone_from(&rest.u);
            rest.v.fill(0.0);
            let mut moving = rest.clone().carried(&motion, times);
            moving.evaluate(&ContactRequest::default());
            let turn = rotation::<D>(motion.at(instant(times[1])).unwrap().angle);
            let mut stuck = 0;
            for (point, before) in moving.state.current.iter().zip(&rest.state.history) {
                assert!(point.slip_increment.norm() < 1e-14, "{:e}", point.slip_increment.norm());
                assert!(point.slip_velocity.norm() < 1e-8, "{:e}", point.slip_velocity.norm());
                if point.is_closed() {
                    stuck += 1;
                    let apart = (point.friction_traction - turn * before.friction_traction).norm();
                    assert!(apart < 1e-9 * point.bound, "{apart:e}");
                }
            }
            assert!(stuck > 0);
        }
    }
    shapes::<2>(ElementKind::Quad4);
    shapes::<3>(ElementKind::Hex8);
}

/// Over a step the work of the forces on the block is the change of energies plus frictional heat,
/// plus the work of the body: its load times its motion.
#[test]
fn the_work_of_a_body_over_a_step_is_exact() {
    fn shapes<const D: usize>(kind: ElementKind) {
        for (scale, what) in [(0.0, "rest"), (0.01, "slow"), (0.3, "fast")] {
            for law in [penalty(None), penalty(Some(coulomb(0.4, regimes()[3])))] {
                for obstacle in sample_shapes::<D>() {
                    conserves::<D>(&obstacle, kind, law, scale, what);
                }
            }
        }
    }
    shapes::<2>(ElementKind::Quad4);
    shapes::<2>(ElementKind::Quad9);
    shapes::<3>(ElementKind::Hex8);
}

fn conserves<const D: usize>(
    obstacle: &Rc<dyn Shape<D>>,
    kind: ElementKind,
    law: ContactLaw,
    scale: f64,
    what: &str,
) {
    let motion = motion::<D>(scale);
    let times = [0.0, 0.05];
    let dt = times[1] - times[0];
    let mut scene = PairScene::<D>::bent_over(obstacle, kind, law);
    scene.contact.area = AreaKind::Reference;
    let step: Vec<f64> = scatter(scene.u.len(), 11).iter().map(|d| 1e-3 * d).collect();
    scene.u_start = scene.u.iter().zip(&step).map(|(u, d)| u - 0.5 * d).collect();
    let end: Vec<f64> = scene.u.iter().zip(&step).map(|(u, d)| u + 0.5 * d).collect();
    scene.v = step.iter().map(|d| d / dt).collect();
    // Energies at the ends, with the body where it is there.
    let energy_at = |time: f64, u: &[f64]| {
        let mut still = scene.clone().moving(&motion, [time, time], None);
        still.u = u.to_vec();
        still.u_start = u.to_vec();
        (stored_energy(&still, u), held_energy(&still, u))
    };
    let ((before, held), (after, _)) = (energy_at(times[0], &scene.u_start), energy_at(times[1], &end));
    let mut moving = scene.clone().moving(&motion, times, Some(dt));
    let force = moving.evaluate(&ContactRequest { over_step: true, ..ContactRequest::default() }).force;
    let work: f64 = force.iter().zip(&step).map(|(f, d)| f * d).sum();
    let sum = |value: &dyn Fn(&PointState<D>) -> f64| -> f64 {
        moving.state.current.iter().map(|point| point.area * value(point)).sum()
    };
    let [heat, stick] = [sum(&|point| point.plastic_work), sum(&|point| point.recoverable)];
    let frame = moving.contact.target.frame().unwrap();
    let (shift, turn) = frame.moved();
    let load = moving.state.load;
    let torque: f64 = motion.axis.iter().zip(&load.torque).map(|(a, t)| a * t).sum();
    let of_body = -(load.force.dot(&shift) + torque * turn);
    let balance = work - of_body + (after - before) + heat + (stick - held);
    let scale = force.iter().zip(&step).map(|(f, d)| (f * d).abs()).sum::<f64>() + of_body.abs() + before;
    assert!(force.iter().any(|f| *f != 0.0), "{what} {obstacle:?}");
    assert!(balance.abs() < 1e-12 * scale, "{what} {obstacle:?}: energy {balance:e} of {scale:e}");
}

/// The matrix over a step is the derivative of the force on a plane, and within one percent on
/// round bodies.
#[test]
fn the_matrix_over_a_step_on_a_moving_body_is_near_the_derivative() {
    for law in [penalty(None), penalty(Some(coulomb(0.4, regimes()[3])))] {
        let mut worst = [0.0_f64; 2];
        let mut note = |plane: bool, error: f64| {
            let worst = &mut worst[usize::from(!plane)];
            *worst = worst.max(error);
        };
        for obstacle in sample_shapes::<2>() {
            let scene = PairScene::<2>::bent_over(&obstacle, ElementKind::Quad4, law);
            let scene = scene.moving(&motion(0.02), [0.0, 0.05], Some(0.05));
            note(obstacle.is_plane(), error_over_step(scene, Terms::ALL));
        }
        for obstacle in sample_shapes::<3>() {
            let scene = PairScene::<3>::bent_over(&obstacle, SPACE_KINDS[0], law);
            let scene = scene.moving(&motion(0.02), [0.0, 0.05], Some(0.05));
            note(obstacle.is_plane(), error_over_step(scene, Terms::ALL));
        }
        assert!(worst[0] < 1e-5 && worst[1] < 1e-2, "{worst:?}");
    }
}

/// Receives what a first guess adds to the right-hand side.
struct Lifted<const D: usize> {
    force: Vec<f64>,
}

impl<const D: usize> ContactSink for Lifted<D> {
    fn force(&mut self, _: &[u32], _: &[f64]) {}

    fn stiffness(&mut self, _: usize, _: &[u32], _: &[f64]) {}

    fn lift(&mut self, nodes: &[u32], force: &[f64]) {
        for (&node, force) in nodes.iter().zip(force.chunks_exact(D)) {
            self.force[node as usize * D..][..D].iter_mut().zip(force).for_each(|(sum, f)| *sum += f);
        }
    }
}

/// What a first guess adds to the right-hand side is the change of the forces when the body moves
/// and the nodes stay, up to the square of the motion and the rotation of the forces themselves.
#[test]
fn a_first_guess_moves_with_the_body() {
    fn shapes<const D: usize>(kind: ElementKind) {
        for obstacle in sample_shapes::<D>() {
            let law = penalty(Some(coulomb(0.7, regimes()[3])));
            // The body does not rotate: forces keep their direction.
            let motion = BodyMotion { angle: Function::constant(0.0).into(), ..motion(1.0) };
            let scene = PairScene::<D>::bent_over(&obstacle, kind, law);
            let at_end = |time: f64| {
                let mut moved = scene.clone().moving(&motion, [0.0, time], None);
                moved.evaluate(&ContactRequest::default()).force
            };
            let still = at_end(0.0);
            let errors = [2e-3, 1e-3].map(|time| {
                let mut moved = scene.clone().moving(&motion, [0.0, 0.0], None);
                let [start, ahead] = [0.0, time].map(instant);
                let step = MotionStep { start, end: start, over: None, ahead: Some(ahead) };
                moved.contact.target.place(&step, &[]).unwrap();
                let selection = TermSelection { terms: Terms::ALL, velocity_shift: 0.0, joint: None };
                let request = ContactRequest { stiffness: Some(selection), ..ContactRequest::default() };
                let fields = ContactFields { u: &moved.u, v: &moved.v, u_start: &moved.u_start };
                let mut sink = Lifted::<D> { force: vec![0.0; moved.u.len()] };
                moved.contact.evaluate(&moved.candidates, &fields, &request, &mut moved.state, &mut sink);
                let change = at_end(time).into_iter().zip(&still).map(|(end, start)| end - start);
                let apart: Vec<f64> = change.zip(&sink.force).map(|(a, b)| a - b).collect();
                assert!(size(&sink.force) > 0.0);
                size(&apart) / size(&sink.force)
            });
            // Over a plane the change is linear.
            assert!(errors[1] < 1e-12 || errors[1] < 0.6 * errors[0], "{obstacle:?}: {errors:?}");
            assert!(errors[1] < 0.1, "{obstacle:?}: {errors:?}");
        }
    }
    shapes::<2>(ElementKind::Quad4);
    shapes::<3>(ElementKind::Hex8);
}

/// The velocity of a node relative to the body is the rate of its position in the frame. A body
/// moves with constant velocity before t = 0, and a factor applies to all of its motion.
#[test]
fn seen_velocities_are_rates_of_seen_positions() {
    fn rates<const D: usize>() {
        let motion = motion::<D>(1.0);
        let place = Vector::<D>::from_fn(|i, _| 0.2 - 0.3 * i as f64);
        let v = Vector::<D>::from_fn(|i, _| 0.5 + 0.2 * i as f64);
        let u = Vector::<D>::from_fn(|i, _| 0.1 * i as f64);
        for (time, factor) in [(0.6, 1.0), (0.6, 0.4), (-0.3, 1.0)] {
            let seen = |h: f64| {
                let [start, end] = [time - h, time + h].map(|time| MotionInstant { time, factor });
                let frame = motion.frame(&MotionStep { start, end, over: None, ahead: None });
                frame.unwrap().see(&place, &(u - v * h), &(u + v * h), &v)
            };
            let h = 1e-5;
            let rate = seen(h).increment / (2.0 * h);
            assert!((rate - seen(0.0).velocity).norm() < 1e-8, "{time}: {rate} {}", seen(0.0).velocity);
            assert!((seen(h).end - seen(h).start - seen(h).increment).norm() < 1e-14);
        }
        let [one, two] = [-0.1, -0.2].map(|time| motion.at(instant(time)).unwrap());
        let zero = motion.at(instant(0.0)).unwrap();
        assert!((two.translation - one.translation * 2.0).norm() < 1e-15 && two.velocity == zero.velocity);
        let half = motion.at(MotionInstant { time: 0.5, factor: 0.5 }).unwrap();
        assert_eq!(half.angle, 0.5 * motion.at(instant(0.5)).unwrap().angle);
        let spin = cross(&Vector::<3>::from(motion.axis), &Vector::<3>::x());
        assert!(spin.norm() > 0.0);
    }
    rates::<2>();
    rates::<3>();
}
