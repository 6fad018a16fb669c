//! A block on a free rigid body: the tangent with the rows and columns of the body, and action and
//! reaction.

use nalgebra::{UnitQuaternion, Vector3};

use super::tests::{PairScene, regimes};
use super::*;
use crate::contact::obstacle::sample_shapes;
use crate::contact::pair_scene::{coulomb, penalty};
use crate::contact::rigid::{FreeRigid, principal_axes};
use crate::contact::target::{RigidTarget, TargetMotion};
use crate::mesh::ElementKind;
use crate::taylor::{scatter, taylor_rate};
use crate::tensor::Tensor;

/// Displacement, rotation and their rates of the body, by size.
const MOTION: f64 = 0.02;

impl<const D: usize> PairScene<D> {
    /// The scene over the same shape as a free body, whose two nodes are the last ones.
    pub fn over_free_body(mut self) -> Self {
        let ContactTarget::Obstacle(RigidTarget { shape, .. }) = &self.contact.target else { panic!() };
        let free = RigidTarget::moving(shape.clone(), Some(TargetMotion::Free(0)));
        self.contact.target = ContactTarget::Obstacle(free);
        let node = (self.u.len() / D) as u32;
        self.contact.target.set_pose_nodes([node, node + 1]);
        for (seed, field) in [(41, &mut self.u), (42, &mut self.u_start), (43, &mut self.v)] {
            field.extend(scatter(2 * D, seed).iter().map(|value| MOTION * value));
        }
        if D == 2 {
            let last = self.u.len() - 1;
            self.u[last] = 0.0;
            self.u_start[last] = 0.0;
            self.v[last] = 0.0;
        }
        self.placed()
    }

    /// Places the body at its unknowns.
    fn placed(mut self) -> Self {
        let body = body::<D>();
        let first = self.u.len() - 2 * D;
        let of = |field: &[f64]| [0, D].map(|k| Vector::<D>::from_column_slice(&field[first + k..][..D]));
        let [start, now, v] = [of(&self.u_start), of(&self.u), of(&self.v)];
        let before = UnitQuaternion::from_scaled_axis(Vector3::new(0.1, -0.2, 0.05));
        let after = body.turned(&before, &(now[1] - start[1]));
        let ends = [
            body.placement(&before, start[0], &start[1], v[0], &v[1]),
            body.placement(&after, now[0], &now[1], v[0], &v[1]),
        ];
        let frame = BodyFrame::free(body.centre, ends, body.variations(&(now[1] - start[1])));
        let step = crate::contact::rigid::MotionStep {
            start: crate::contact::rigid::MotionInstant { time: 0.0, factor: 1.0 },
            end: crate::contact::rigid::MotionInstant { time: 0.0, factor: 1.0 },
            over: None,
            ahead: None,
        };
        self.contact.target.place(&step, &[frame]).unwrap();
        self
    }

    /// Forces at these displacements. Velocities follow as in a time integrator.
    fn free_force_at(&self, u: &[f64], shift: f64) -> Vec<f64> {
        let mut moved = self.clone();
        moved.v.iter_mut().zip(u.iter().zip(&self.u)).for_each(|(v, (new, old))| *v += shift * (new - old));
        moved.u = u.to_vec();
        moved.placed().evaluate(&ContactRequest::default()).force
    }
}

fn body<const D: usize>() -> FreeRigid<D> {
    let skewed = Tensor::<3>::new(0.6, 0.1, -0.05, 0.1, 0.8, 0.2, -0.05, 0.2, 0.9);
    FreeRigid {
        centre: Vector::from_fn(|i, _| [0.3, 0.5, 0.45][i]),
        lengths: std::array::from_fn(|i| [0.4, 0.6, 0.3][i]),
        axes: if D == 2 { Tensor::<3>::identity() } else { principal_axes(&skewed, [false; 3]) },
    }
}

pub fn check<const D: usize>(scene: &PairScene<D>, shift: f64, what: &str) {
    let total = scene.u.len();
    let selection = TermSelection { terms: Terms::ALL, velocity_shift: shift, joint: None };
    let request = ContactRequest { stiffness: Some(selection), ..ContactRequest::default() };
    let matrix = scene.clone().evaluate(&request).matrix;
    // The body alone, and everything.
    for first in [total - 2 * D, 0] {
        let mut direction: Vec<f64> = scatter(total, 31).iter().map(|d| 1e-4 * d).collect();
        direction[..first].fill(0.0);
        if D == 2 {
            direction[total - 1] = 0.0;
        }
        let df = |_: &[f64], d: &[f64]| -> Vec<f64> {
            (0..total).map(|r| -(0..total).map(|c| matrix[r * total + c] * d[c]).sum::<f64>()).collect()
        };
        let rate = taylor_rate(|u| scene.free_force_at(u, shift), df, &scene.u, &direction);
        assert!(rate > 1.9, "{what}, unknowns from {first}: rate {rate}");
    }
}

/// The matrix with the rows and columns of the body is the derivative of the forces, over every
/// shape, without friction and with friction in every regime.
#[test]
fn the_tangent_with_a_free_body_is_the_derivative() {
    fn shapes<const D: usize>(kind: ElementKind) {
        for obstacle in sample_shapes::<D>() {
            let plain = PairScene::<D>::bent_over(&obstacle, kind, penalty(None)).over_free_body();
            check(&plain, 3.0, "frictionless");
            for regularization in regimes() {
                let law = penalty(Some(coulomb(0.7, regularization)));
                let scene = PairScene::<D>::bent_over(&obstacle, kind, law).over_free_body();
                check(&scene, 3.0, "with friction");
            }
        }
    }
    shapes::<2>(ElementKind::Quad4);
    shapes::<2>(ElementKind::Quad9);
    shapes::<3>(ElementKind::Hex8);
}

/// A body that rotates fast: velocities depend strongly on its position.
#[test]
fn the_tangent_of_a_fast_body_is_the_derivative() {
    for obstacle in sample_shapes::<3>() {
        let law = penalty(Some(coulomb(0.7, regimes()[0])));
        let mut scene = PairScene::<3>::bent_over(&obstacle, ElementKind::Hex8, law).over_free_body();
        let first = scene.u.len() - 6;
        scene.v[first..].iter_mut().for_each(|rate| *rate *= 200.0);
        check(&scene.placed(), 3.0, "fast");
    }
}

/// The force on the body is minus the sum of the forces on the nodes, and its moment balances
/// theirs about the origin.
#[test]
fn the_force_on_the_body_is_the_reaction() {
    for obstacle in sample_shapes::<3>() {
        let law = penalty(Some(coulomb(0.7, regimes()[0])));
        let mut scene = PairScene::<3>::bent_over(&obstacle, ElementKind::Hex8, law).over_free_body();
        let force = scene.evaluate(&ContactRequest::default()).force;
        let first = scene.u.len() - 6;
        let vector = |k: usize| Vector3::from_column_slice(&force[k..k + 3]);
        let body = body::<3>();
        let centre = body.centre + Vector3::from_column_slice(&scene.u[first..first + 3]);
        let frame = scene.contact.target.frame().unwrap();
        let moment =
            frame.at_end() * (body.axes * vector(first + 3).component_mul(&Vector3::from(body.lengths)));
        let mut total = vector(first);
        let mut about = moment + centre.cross(&vector(first));
        let mut size = 0.0;
        for (node, x) in scene.positions().iter().enumerate().take(first / 3) {
            total += vector(3 * node);
            about += x.cross(&vector(3 * node));
            size += vector(3 * node).norm();
        }
        assert!(size > 0.0 && total.norm() < 1e-13 * size && about.norm() < 1e-13 * size, "{about}");
    }
}
