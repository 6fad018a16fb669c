//! The tangent of a point over a step: minus the derivative of its forces by the places in the middle, whole.

use super::{Fields, Relative, StepResponse};
use crate::contact::curvature::Curvature;
use crate::contact::geometry::Geometry;
use crate::contact::point::Selection;
use crate::contact::point::joint::Joint;
use crate::tensor::{Tensor, Vector, tangential_projector};
use crate::terms::Terms;

/// What a point is seen in: the middle of the step, its end, and how the normal turns in the middle.
#[derive(Debug, Clone, Copy)]
pub struct StepGeometry<'a, const D: usize> {
    /// In the middle.
    pub middle: &'a Geometry<D>,
    /// At the end.
    pub end: &'a Geometry<D>,
    /// Second variations in the middle.
    pub curvature: &'a Curvature<D>,
}

/// Derivatives of the tractions by the place of one node.
struct Column<const D: usize> {
    /// `dt_n`.
    pressure: Vector<D>,
    /// `dq`, of the tangential part of the normal law.
    correction: Tensor<D>,
    /// `dt_T`.
    friction: Tensor<D>,
}

impl<const D: usize> StepResponse<D> {
    /// Adds the chosen left-hand-side terms to `stiffness[((a * m + b) * D + i) * D + j]`, `m` nodes \[N/m\]. All terms
    /// together are minus the derivative of the force by the places in the middle of the step, as the displacements and, through
    /// `velocity_shift`, the velocities follow them.
    pub fn add_stiffness(
        &self,
        geometry: &StepGeometry<'_, D>,
        fields: &Fields<'_, D>,
        selection: &Selection,
        stiffness: &mut [f64],
    ) {
        let Some(slopes) = &self.slopes else {
            return;
        };
        if let Some(stiffest) = selection.joint {
            // The end moves twice as far as the middle.
            let (friction, mean) = (&slopes.friction, &slopes.mean);
            let by_middle = friction.by_velocity * selection.velocity_shift + friction.by_increment * 2.0;
            let joint = Joint { normal: -2.0 * mean.derivative, tangential: -by_middle };
            let middle = geometry.middle;
            let coefficients = middle.nodes.iter().map(|node| node.coefficient);
            return joint.add_springs(&middle.normal, middle.area, coefficients, stiffest, stiffness);
        }
        let (middle, terms, count) = (geometry.middle, selection.terms, geometry.middle.nodes.len());
        // `d/dx (dn/dx field)` of the field at the point.
        let [increment, velocity] = [fields.increment, fields.velocity]
            .map(|field| geometry.curvature.of_turn(&middle.relative(field)));
        let switch = |term| if terms.contains(term) { 1.0 } else { 0.0 };
        let geometric = [switch(Terms::NORMAL_GEOMETRY), switch(Terms::FRICTION_GEOMETRY)];
        let pressure = self.state.normal_traction * geometric[0];
        // Tangential tractions of both laws: their test functions are the same.
        let tangential = self.correction * geometric[0] + self.state.friction_traction * geometric[1];
        for (b, node) in middle.nodes.iter().enumerate() {
            let column = self.column(geometry, [&increment, &velocity], selection, b);
            let normal = column.pressure * switch(Terms::NORMAL_CONTACT);
            let moved = column.correction + column.friction;
            for (a, test) in middle.nodes.iter().enumerate() {
                let share = test.coefficient * node.coefficient;
                let lever = test.normal.transpose();
                let mut block = test.gap * normal.transpose()
                    + node.normal * (test.coefficient * pressure)
                    + moved * test.coefficient
                    - lever * moved * middle.gap
                    - lever * tangential * node.gap.transpose();
                block -= geometry.curvature.of_normal(&tangential) * (middle.gap * share);
                block *= -middle.area;
                let start = (a * count + b) * D * D;
                for (i, row) in stiffness[start..start + D * D].chunks_exact_mut(D).enumerate() {
                    row.iter_mut().enumerate().for_each(|(j, entry)| *entry += block[(i, j)]);
                }
            }
        }
    }

    fn column(
        &self,
        geometry: &StepGeometry<'_, D>,
        [increment, velocity]: [&Tensor<D>; 2],
        selection: &Selection,
        b: usize,
    ) -> Column<D> {
        let Some(slopes) = &self.slopes else {
            return Column {
                pressure: Vector::zeros(),
                correction: Tensor::zeros(),
                friction: Tensor::zeros(),
            };
        };
        let (middle, terms, node) = (geometry.middle, selection.terms, &geometry.middle.nodes[b]);
        let share = node.coefficient;
        let own = Tensor::identity() * share - node.normal * middle.gap;
        // How slip and slip velocity change though the nodes' own do not.
        let carried = |field: &Relative<D>, turned: &Tensor<D>, factor: f64| {
            -field.turn * node.gap.transpose() - turned * (middle.gap * share * factor)
        };
        let of_increment = carried(&slopes.increment, increment, 2.0);

        // The normal law.
        let (change, mean) = (&slopes.change, &slopes.mean);
        let along = node.gap * 2.0 + node.normal.transpose() * slopes.moved;
        let outward = middle.normal.dot(&slopes.increment.value);
        let slip = tangential_projector(&middle.normal) * (own * 2.0 + of_increment)
            - middle.normal * (node.normal.transpose() * slopes.increment.value).transpose()
            - node.normal * outward;
        let missed = geometry.end.nodes[b].gap * 2.0 - along;
        let square = along * (2.0 * change.along) + slip.transpose() * self.state.slip_increment * 2.0;
        let factor = missed * change.missed.by_miss + square * change.missed.by_square;
        let end = along + square * change.missed.value + factor * change.square;
        let by_mean = end * mean.derivative;
        let pressure = by_mean * (1.0 + change.missed.value * change.along)
            + (factor * change.along + along * change.missed.value) * mean.traction;
        let mut correction = Tensor::zeros();
        if terms.contains(Terms::NORMAL_GEOMETRY) {
            let size = by_mean * change.missed.value + factor * mean.traction;
            correction =
                self.state.slip_increment * size.transpose() + slip * (mean.traction * change.missed.value);
        }

        // Friction.
        let answer = &slopes.friction;
        let by_velocity = answer.by_velocity + answer.by_velocity_through_bound;
        let mut friction = Tensor::zeros();
        if terms.contains(Terms::FRICTION_NORMAL_COUPLING) {
            friction += slopes.by_pressure * pressure.transpose();
        }
        if terms.contains(Terms::FRICTION_DAMPING) {
            friction += (answer.by_velocity * selection.velocity_shift + answer.by_increment * 2.0) * own;
        }
        if terms.contains(Terms::COEFFICIENT_CHANGE) {
            friction += answer.by_velocity_through_bound * own * selection.velocity_shift;
        }
        if terms.contains(Terms::FRICTION_GEOMETRY) {
            let of_velocity = carried(&slopes.velocity, velocity, 1.0);
            friction += answer.by_normal * node.normal
                + by_velocity * of_velocity
                + answer.by_increment * of_increment;
        }
        Column { pressure, correction, friction }
    }
}
