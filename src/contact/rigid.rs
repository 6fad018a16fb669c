//! A contact of a surface with a rigid obstacle: evaluates all its points, facet by facet, into a sink.

use super::geometry::{AreaMeasure, Geometry};
use super::obstacle::Obstacle;
use super::point::{ContactLaw, Motion, PointState, Selection, respond};
use super::state::{Branches, ContactState, Hold};
use super::surface::{ContactSurface, SurfaceFacet};
use super::zone::ZoneSummary;
use crate::tensor::Vector;

/// Which configuration gives the area of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AreaKind {
    /// The deformed facets.
    #[default]
    Current,
    /// The undeformed facets; `K_phi` vanishes.
    Reference,
}

/// Receives what the facets contribute.
pub trait ContactSink {
    /// `force[a * D + i]`, to be added to the right-hand side, and `stiffness[((a * m + b) * D + i) * D + j]`, to
    /// be added to the left-hand matrix, of the facet `index` with local `nodes`. Not called for open facets.
    fn facet(&mut self, index: usize, nodes: &[u32], force: &[f64], stiffness: Option<&[f64]>);
}

/// Nodal fields in local numbering, `node * D + component`, ghosts included.
#[derive(Debug, Clone, Copy)]
pub struct ContactFields<'a> {
    /// Displacement \[m\].
    pub u: &'a [f64],
    /// Velocity \[m/s\].
    pub v: &'a [f64],
    /// Displacement at the start of the step \[m\].
    pub u_start: &'a [f64],
}

/// What an evaluation is to bring.
#[derive(Debug, Clone, Copy, Default)]
pub struct ContactRequest {
    /// The terms of the matrix, or none.
    pub stiffness: Option<Selection>,
    /// What is held fixed.
    pub hold: Hold,
    /// Branches of the friction law.
    pub branches: Branches,
}

/// Energies of a contact on this rank \[J\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactEnergy {
    /// Stored by the normal law and by elastic stick.
    pub stored: f64,
    /// Turned into heat by friction in the step that ends in the current state.
    pub heat_of_step: f64,
}

/// One contact with a rigid obstacle.
#[derive(Debug, Clone)]
pub struct RigidContact<const D: usize> {
    /// Contactor.
    pub surface: ContactSurface<D>,
    /// Target.
    pub obstacle: Obstacle<D>,
    /// Laws.
    pub law: ContactLaw,
    /// Area on which the tractions act.
    pub area: AreaKind,
}

/// Nodal values of one facet, refilled for each.
struct FacetMotion<const D: usize> {
    current: Vec<Vector<D>>,
    velocity: Vec<Vector<D>>,
    increment: Vec<Vector<D>>,
}

impl<const D: usize> FacetMotion<D> {
    fn gather(&mut self, reference: &[Vector<D>], nodes: &[u32], fields: &ContactFields<'_>) {
        let at = |field: &[f64], node: u32| Vector::<D>::from_column_slice(&field[node as usize * D..][..D]);
        self.current.clear();
        self.velocity.clear();
        self.increment.clear();
        for (reference, &node) in reference.iter().zip(nodes) {
            let u = at(fields.u, node);
            self.current.push(reference + u);
            self.velocity.push(at(fields.v, node));
            self.increment.push(u - at(fields.u_start, node));
        }
    }
}

impl<const D: usize> RigidContact<D> {
    /// Evaluates every point, keeps their states in `state.current` and hands the facets in contact to `sink`.
    pub fn evaluate(
        &self,
        fields: &ContactFields<'_>,
        request: &ContactRequest,
        state: &mut ContactState<D>,
        sink: &mut impl ContactSink,
    ) {
        let mut motion = FacetMotion { current: Vec::new(), velocity: Vec::new(), increment: Vec::new() };
        let mut geometry = Geometry::default();
        let (mut force, mut stiffness) = (Vec::new(), Vec::new());
        for (index, facet) in self.surface.facets().iter().enumerate() {
            let nodes = self.surface.facet_nodes(facet);
            motion.gather(self.surface.reference_points(facet), nodes, fields);
            force.clear();
            force.resize(nodes.len() * D, 0.0);
            stiffness.clear();
            if request.stiffness.is_some() {
                stiffness.resize((nodes.len() * D).pow(2), 0.0);
            }
            let mut contributes = false;
            for point in facet.points.clone() {
                self.locate(facet, point, &motion.current, &mut geometry);
                let of_point = Motion {
                    velocity: &motion.velocity,
                    increment: &motion.increment,
                    history: &state.history[point],
                };
                let response = respond(
                    &self.law,
                    &geometry,
                    &of_point,
                    &state.manner(point, request.hold, request.branches),
                );
                state.current[point] = response.state;
                if !response.state.is_closed() {
                    continue;
                }
                contributes = true;
                response.add_force(&geometry, &mut force);
                if let Some(selection) = &request.stiffness {
                    response.add_stiffness(&geometry, selection, &mut stiffness);
                }
            }
            if contributes {
                sink.facet(index, nodes, &force, request.stiffness.map(|_| &stiffness[..]));
            }
        }
    }

    fn locate(&self, facet: &SurfaceFacet, point: usize, current: &[Vector<D>], geometry: &mut Geometry<D>) {
        let at = self.surface.facet_point(facet, point - facet.points.start);
        let x: Vector<D> = current.iter().zip(at.shape).map(|(x, n)| x * *n).sum();
        geometry.against_obstacle(&at, &self.obstacle.proximity(&x));
        let measure = match self.area {
            AreaKind::Current => AreaMeasure::Current,
            AreaKind::Reference => AreaMeasure::Reference(self.surface.reference_area(point)),
        };
        geometry.with_area(&at, current, measure);
    }

    /// Largest initial overlap of this rank: depth \[m\] and place; None without any.
    pub fn overclosure(&self) -> Option<(f64, Vector<D>)> {
        let places = self.surface.facets().iter().flat_map(|facet| {
            let nodes = self.surface.reference_points(facet);
            (0..facet.points.len()).map(move |q| {
                let shape = self.surface.facet_point(facet, q).shape;
                nodes.iter().zip(shape).map(|(x, n)| x * *n).sum::<Vector<D>>()
            })
        });
        let depths = places.map(|x| (-self.obstacle.gap(&x), x)).filter(|(depth, _)| *depth > 0.0);
        depths.max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// What this rank reports of the zone; merge it over ranks.
    pub fn summary(&self, state: &ContactState<D>) -> ZoneSummary<D> {
        let mut summary = ZoneSummary::default();
        for facet in self.surface.facets().iter().filter(|facet| facet.mine) {
            state.current[facet.points.clone()].iter().for_each(|point| summary.add_forces(point));
        }
        let counted = state.current.iter().zip(self.surface.representative()).filter(|(_, counts)| **counts);
        counted.for_each(|(point, _)| summary.count(point));
        summary
    }

    /// Energies of this rank's facets; call it before [`ContactState::accept`] of a step of length `dt` \[s\].
    pub fn energy(&self, state: &ContactState<D>, dt: f64) -> ContactEnergy {
        let mut energy = ContactEnergy::default();
        for facet in self.surface.facets().iter().filter(|facet| facet.mine) {
            for p in facet.points.clone() {
                let (point, history) = (&state.current[p], &state.history[p]);
                energy.stored +=
                    self.surface.reference_area(p) * point.potential + point.area * point.recoverable;
                energy.heat_of_step += point.area * history.work_of_step(point, dt);
            }
        }
        energy
    }

    /// Adds to each local node the area-weighted sum of a value of its points and the weights; their quotient is
    /// the nodal value, complete at owned nodes. `sum[node * K + k]`, `weight[node]`.
    pub fn gather_nodal<const K: usize>(
        &self,
        state: &ContactState<D>,
        value: impl Fn(usize, &PointState<D>) -> [f64; K],
        (sum, weight): (&mut [f64], &mut [f64]),
    ) {
        for facet in self.surface.facets() {
            for (q, p) in facet.points.clone().enumerate() {
                let values = value(p, &state.current[p]);
                let shape = self.surface.facet_point(facet, q).shape;
                for (&node, n) in self.surface.facet_nodes(facet).iter().zip(shape) {
                    let share = n.max(0.0) * self.surface.reference_area(p);
                    weight[node as usize] += share;
                    let sums = &mut sum[node as usize * K..][..K];
                    sums.iter_mut().zip(&values).for_each(|(s, v)| *s += share * v);
                }
            }
        }
    }
}
