//! A point of a facet with all that its kernel needs, for tests.

use super::super::{ContactLaw, Manner, Motion, PointState, Response, Selection, Status, respond};
use crate::contact::friction::Regularization;
use crate::contact::geometry::{AreaMeasure, FacetPoint, Geometry};
use crate::contact::history::History;
use crate::contact::obstacle::Obstacle;
use crate::mesh::ElementKind;
use crate::space::{Table, reference};
use crate::taylor::{scatter, taylor_rate};
use crate::tensor::Vector;
use crate::terms::Terms;

/// Change of a velocity with the displacement in [`Scene::moved`] \[1/s\].
pub(super) const SHIFT: f64 = 3.0;

/// One point of a facet with everything that it needs.
#[derive(Clone)]
pub(super) struct Scene<const D: usize> {
    pub target: Obstacle<D>,
    pub table: Table,
    pub nodes: Vec<Vector<D>>,
    pub velocity: Vec<Vector<D>>,
    pub increment: Vec<Vector<D>>,
    pub history: History<D>,
    pub law: ContactLaw,
    pub measure: AreaMeasure,
    pub manner: Manner<D>,
}

pub(super) fn vectors<const D: usize>(count: usize, seed: u32, size: f64) -> Vec<Vector<D>> {
    scatter(count * D, seed).chunks_exact(D).map(|c| Vector::from_column_slice(c) * size).collect()
}

/// Nodes of a facet on its reference domain, bent out of the plane, scaled by `size`.
fn facet_nodes<const D: usize>(kind: ElementKind, size: f64, seed: u32) -> Vec<Vector<D>> {
    let place = |p: &[f64; 3]| {
        Vector::<D>::from_fn(|i, _| if i + 1 < D { p[i] } else { 0.1 * p[0] * p[0] - 0.07 * p[1] })
    };
    let bend = vectors::<D>(kind.nodes(), seed, 0.05);
    reference(kind).node_coordinates().iter().zip(bend).map(|(p, b)| (place(p) + b) * size).collect()
}

impl<const D: usize> Scene<D> {
    /// A point of the last Gauss point of `kind`, with the given gap.
    pub fn new(kind: ElementKind, target: Obstacle<D>, law: ContactLaw, gap: f64) -> Self {
        let element = reference(kind);
        let table = element.tabulate(element.gauss_contact_rule());
        let offset = Vector::from_fn(|i, _| 0.41 + 0.2 * i as f64);
        let nodes: Vec<_> = facet_nodes::<D>(kind, 0.2, 3).into_iter().map(|x| x + offset).collect();
        let count = nodes.len();
        let mut scene = Self {
            target,
            table,
            nodes,
            velocity: vectors(count, 7, 0.5),
            increment: vectors(count, 11, 0.01),
            history: History::default(),
            law,
            measure: AreaMeasure::Current,
            manner: Manner::default(),
        };
        let contactors = scene.table.nodes;
        for _ in 0..3 {
            let here = scene.geometry();
            let shift = here.normal * (gap - here.gap);
            scene.nodes[..contactors].iter_mut().for_each(|x| *x += shift);
        }
        assert!((scene.geometry().gap - gap).abs() < 1e-6 * gap.abs());
        scene
    }

    pub fn point_of(table: &Table, nodes: &[Vector<D>]) -> Vector<D> {
        let shape = &table.n[(table.points - 1) * table.nodes..];
        nodes.iter().zip(shape).map(|(x, n)| x * *n).sum()
    }

    pub fn geometry(&self) -> Geometry<D> {
        let (last, count) = (self.table.points - 1, self.table.nodes);
        let point = FacetPoint {
            shape: &self.table.n[last * count..],
            gradient: &self.table.dn[last * count * (D - 1)..],
            weight: self.table.weights[last],
        };
        let x = Self::point_of(&self.table, &self.nodes);
        let mut geometry = Geometry::default();
        geometry.against_obstacle(&point, &self.target.proximity(&x));
        geometry.with_area(&point, &self.nodes[..count], self.measure);
        geometry
    }

    pub fn response(&self) -> Response<D> {
        let motion = Motion { velocity: &self.velocity, increment: &self.increment, history: &self.history };
        respond(&self.law, &self.geometry(), &motion, &self.manner)
    }

    pub fn state(&self) -> PointState<D> {
        self.response().state
    }

    pub fn force(&self) -> Vec<f64> {
        let mut force = vec![0.0; self.nodes.len() * D];
        self.response().add_force(&self.geometry(), &mut force);
        force
    }

    pub fn stiffness(&self, terms: Terms) -> Vec<f64> {
        self.selected(Selection { terms, velocity_shift: SHIFT, joint: None })
    }

    fn selected(&self, selection: Selection) -> Vec<f64> {
        let mut stiffness = vec![0.0; (self.nodes.len() * D).pow(2)];
        self.response().add_stiffness(&self.geometry(), &selection, &mut stiffness);
        stiffness
    }

    /// The dense matrix of some terms.
    pub fn matrix(&self, terms: Terms) -> nalgebra::DMatrix<f64> {
        self.dense(&self.stiffness(terms))
    }

    /// That of the springs for multigrid.
    pub fn joint(&self, stiffest: f64) -> nalgebra::DMatrix<f64> {
        let selection = Selection { terms: Terms::empty(), velocity_shift: SHIFT, joint: Some(stiffest) };
        self.dense(&self.selected(selection))
    }

    fn dense(&self, k: &[f64]) -> nalgebra::DMatrix<f64> {
        let m = self.nodes.len();
        nalgebra::DMatrix::from_fn(m * D, m * D, |r, c| k[((r / D * m + c / D) * D + r % D) * D + c % D])
    }

    /// The scene with all nodes moved by `z`, velocities by `SHIFT z`, step increments by `z`.
    pub fn moved(&self, z: &[f64]) -> Self {
        let mut scene = self.clone();
        for (a, z) in z.chunks_exact(D).enumerate() {
            let z = Vector::<D>::from_column_slice(z);
            scene.nodes[a] += z;
            scene.velocity[a] += z * SHIFT;
            scene.increment[a] += z;
        }
        scene
    }

    pub fn rate(&self, terms: Terms) -> f64 {
        let zero = vec![0.0; self.nodes.len() * D];
        let direction: Vec<f64> = scatter(zero.len(), 13).iter().map(|d| d * 2e-3).collect();
        let matrix = self.matrix(terms);
        let slope =
            |_: &[f64], d: &[f64]| (-(&matrix * nalgebra::DVector::from_column_slice(d))).as_slice().to_vec();
        taylor_rate(|z| self.moved(z).force(), slope, &zero, &direction)
    }

    /// Tunes the regularisation and the history such that the point sticks or slips with margin.
    pub fn tuned(mut self, regularization: Regularization, status: Status) -> Self {
        let Some(friction) = &mut self.law.friction else { return self };
        friction.regularization = regularization;
        let state = self.state();
        let (speed, path, sticks) =
            (state.slip_velocity.norm(), state.slip_increment.norm(), status == Status::Stick);
        let Some(friction) = &mut self.law.friction else { return self };
        friction.regularization = match regularization {
            Regularization::StickVelocity { .. } => {
                Regularization::StickVelocity { velocity: if sticks { 3.0 * speed } else { 0.4 * speed } }
            }
            Regularization::SmoothStickVelocity { .. } => Regularization::SmoothStickVelocity {
                velocity: if sticks { 2.0 * speed } else { 0.5 * speed },
            },
            Regularization::StickStiffness { .. } => {
                let stiffness = state.bound / path * if sticks { 0.3 } else { 4.0 };
                let old_normal = (state.normal + vectors::<D>(1, 17, 0.1)[0]).normalize();
                let push = vectors::<D>(1, 19, 1.0)[0];
                let tangential = (push - old_normal * old_normal.dot(&push)).normalize();
                self.history.normal = old_normal;
                self.history.friction_traction = tangential * (0.4 * state.bound);
                Regularization::StickStiffness { stiffness }
            }
        };
        let reached = self.state().status;
        assert_eq!(reached, status, "{:?}", self.law);
        self
    }
}
