//! The kernel of a vertex: its gap, normal and slip with their variations, and every term of (3.5)
//! that its laws contribute.
//!
//! With the sums of [`super::integrals`] over all pairs of a vertex, `g = W / kappa`, `n = N / |N|`
//! and `c_a = D_a / kappa`. A node receives the force `kappa (t_n v_a + c_a t_T)` with `v_a = V_a /
//! kappa`. The pressure acts along the normals of facets, so that forces pass the patch test. Along those of
//! the contactor they have no moment. Friction acts along the tangent plane of the vertex.
//!
//! The stiffness is minus the variation of this force. Its parts are, by the varying quantity:
//!
//! - `t_n` with the gap (`K_CN`) and with the closing speed (`K_CD`), computed here.
//! - `t_T` with the bound (`K_nT`) and with the slip (`K_T`, `C_mu`), computed here.
//! - `t_T` with slip measure and normal (`K_TG`), computed here.
//! - `v_a`, `c_a` and `kappa`, computed by [`super::integrals::FacetPair::vary`].

use super::surface::{VertexFacet, VertexSize};
use crate::contact::history::History;
use crate::contact::point::joint::Joint;
use crate::contact::point::{ContactLaw, Manner, PointState, Relation, Slopes, TermSelection, tractions};
use crate::tensor::{Tensor, Vector};
use crate::terms::Terms;

/// Dependence of a vertex on one node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VertexNode<const D: usize> {
    /// Index of the node in the field arrays.
    pub node: u32,
    /// `c_a`.
    pub coefficient: f64,
    /// `v_a`.
    pub push: Vector<D>,
    /// `dg/dx_a` \[-\].
    pub gap: Vector<D>,
    /// `dn/dx_a` \[1/m\].
    pub normal: Tensor<D>,
    /// Derivatives of the relative velocity \[1/s\] and of the relative increment \[-\] at fixed
    /// fields.
    pub slips: [Tensor<D>; 2],
}

impl<const D: usize> VertexNode<D> {
    /// A node with zero coefficients.
    pub fn of(node: u32) -> Self {
        Self {
            node,
            coefficient: 0.0,
            push: Vector::zeros(),
            gap: Vector::zeros(),
            normal: Tensor::zeros(),
            slips: [Tensor::zeros(); 2],
        }
    }
}

/// Sums over all pairs of a vertex.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VertexSums<const D: usize> {
    /// `kappa` [m, m^2].
    pub area: f64,
    /// `W` [m^2, m^3].
    pub gap: f64,
    /// `N` [m, m^2].
    pub normal: Vector<D>,
    /// `sum_a D_a f_a` of velocities and of displacements since the start of the step.
    pub slips: [Vector<D>; 2],
    /// Minus the gap of the deepest segment point \[m\].
    pub depth: f64,
    /// Covered area of the facets around the vertex, and their whole undeformed area [m, m^2].
    pub cover: f64,
    full: f64,
    /// Length of the vertex across the plane: 1 in 2D, that of the circle in axisymmetry, the square root
    /// of its area in 3D [-, m].
    width: f64,
}

impl<const D: usize> Default for VertexSums<D> {
    fn default() -> Self {
        let none = Vector::zeros();
        Self {
            area: 0.0,
            gap: 0.0,
            normal: none,
            slips: [none; 2],
            depth: f64::NEG_INFINITY,
            cover: 0.0,
            full: 0.0,
            width: 1.0,
        }
    }
}

/// A vertex with less than this fraction of its area covered has no target, because its gap would
/// be a quotient of rounding errors. A value ten times larger or smaller changes nothing, because
/// the force is that fraction of the pressure.
const COVERED: f64 = 1e-13;

/// Ratio of depth to covered length from which on a vertex carries no traction. With 1 and with 4
/// all shipped scenes of two bodies take the same Newton iterations, except `collision/cubes`: 265
/// and 227 instead of 229 (2026-11-23).
const ACROSS: f64 = 2.0;

/// Inverse of the length that `cover` of the area `full` has across `width` [1/m]; 0 if all of it
/// is covered.
fn inverse_length(cover: f64, full: f64, width: f64) -> f64 {
    (width / cover - width / full).max(0.0)
}

/// Whether the covered part of a facet is a sliver, much shorter than its depth. A pair carries `share`
/// of the tractions, and so much of the area counts in `cover`.
pub(super) fn is_sliver(depth: f64, cover: f64, facet: &VertexFacet, share: f64) -> bool {
    let full = share * facet.area;
    depth * inverse_length(cover, full, full / facet.size) >= ACROSS
}

impl<const D: usize> VertexSums<D> {
    /// Finishes the summation. It clears the sums of a vertex, except its depth, in three cases:
    /// the vertex is covered only by rounding, the normals of the facets cancel, or it is covered
    /// by a sliver that is deeper than long.
    pub fn finish(&mut self, size: &VertexSize) {
        self.full = size.facets * size.share;
        self.width = size.share * size.width;
        let faces = self.area > COVERED * size.vertex && self.normal.amax() > 0.0;
        if !faces || -self.mean_gap() * self.inverse_length() >= ACROSS {
            *self = Self { depth: self.depth, ..Self::default() };
        }
    }

    /// Inverse of the covered length around the vertex [1/m]; 0 if it is fully covered.
    fn inverse_length(&self) -> f64 {
        inverse_length(self.cover, self.full, self.width)
    }

    /// Mean gap `g = W / kappa` \[m\].
    pub fn mean_gap(&self) -> f64 {
        self.gap / self.area
    }

    /// The gap with which the laws are evaluated \[m\].
    pub fn gap(&self) -> f64 {
        self.limited().0
    }

    /// The gap with which the laws are evaluated, with its derivatives by the mean gap \[-\] and by
    /// the covered area [-, 1/m].
    ///
    /// With `l` the covered length around the vertex, `g = -l phi(-W / (kappa l))`. `phi(s) = s` up
    /// to one half; from there `phi` decreases to 0 at `s = 2` (theory, section 1.3).
    fn limited(&self) -> (f64, f64, f64) {
        let mean = self.mean_gap();
        let inverse = self.inverse_length();
        let s = -mean * inverse;
        if s <= 0.5 {
            return (mean, 1.0, 0.0);
        }
        let width = ACROSS - 0.5;
        let t = ((s - 0.5) / width).min(1.0);
        let part = 0.5 * (1.0 - t * t * (3.0 - 2.0 * t)) + width * t * (1.0 - t) * (1.0 - t);
        let slope = -3.0 * t * (1.0 - t) / width + (1.0 - t) * (1.0 - 3.0 * t);
        (-part / inverse, slope, (s * slope - part) * self.width / (self.cover * inverse).powi(2))
    }

    /// Derivative of the gap with which the laws are evaluated by the mean gap.
    pub fn by_mean_gap(&self) -> f64 {
        self.limited().1
    }

    /// Whether any part of the vertex lies opposite a target.
    pub fn is_covered(&self) -> bool {
        self.area > 0.0
    }

    /// Depth of the deepest point below the target \[m\], minus the initial overclosure `adjusted`
    /// that is treated as zero gap.
    pub fn sunk(&self, adjusted: f64) -> f64 {
        (self.depth + adjusted).max(0.0)
    }

    /// Evaluates the laws at a gap, without the initial overclosure `adjusted` that is treated as zero
    /// gap \[m\].
    ///
    /// The slip increment of the return map excludes the rotation of the normal, `d = sum c_a du_a
    /// - g (n - n_old)`. A common rotation of both sides therefore produces no slip.
    pub fn respond(
        &self,
        law: &ContactLaw,
        history: &History<D>,
        gap: f64,
        adjusted: f64,
        manner: &Manner<D>,
    ) -> (PointState<D>, Option<Slopes<D>>) {
        let normal = self.normal.normalize();
        let [velocity, increment] = self.slips.map(|slip| slip / self.area);
        let turned = turn(&normal, history) * self.mean_gap();
        let relation = Relation {
            gap,
            normal,
            area: self.area,
            velocity,
            increment: increment - turned,
            displacement: increment,
            history,
        };
        let (state, slopes) = tractions(law, &relation, manner);
        let flatness = self.normal.norm() / self.area;
        let sunk = self.sunk(adjusted);
        (PointState { flatness, sunk, ..state }, slopes)
    }

    /// Converts the derivatives of the sums, which the nodes of `row` hold initially, to
    /// derivatives of the means.
    pub(super) fn normalise(&self, history: &History<D>, row: &mut VertexRows<D>) {
        let gap = self.mean_gap();
        let (_, by_mean, by_cover) = self.limited();
        let size = self.normal.norm();
        let normal = self.normal / size;
        let projector = (Tensor::identity() - normal * normal.transpose()) / size;
        let slips = self.slips.map(|slip| slip / self.area);
        let turned = turn(&normal, history);
        let turns = history.normal.amax() > 0.0;
        for ((node, by_area), covered) in row.nodes.iter_mut().zip(&row.by_area).zip(&row.by_cover) {
            node.coefficient /= self.area;
            node.push /= self.area;
            node.gap = (node.gap - by_area * gap) / self.area;
            node.normal = projector * node.normal;
            for (by, slip) in node.slips.iter_mut().zip(&slips) {
                *by = (*by - slip * by_area.transpose()) / self.area;
            }
            if turns {
                node.slips[1] -= turned * node.gap.transpose() + node.normal * gap;
            }
            node.gap = node.gap * by_mean + covered * by_cover;
        }
    }
}

/// `n - n_old`; zero if there is no previous normal.
fn turn<const D: usize>(normal: &Vector<D>, history: &History<D>) -> Vector<D> {
    if history.normal.amax() == 0.0 { Vector::zeros() } else { normal - history.normal }
}

/// Adds the selected terms of a closed vertex to `stiffness[((a * m + b) * D + i) * D + j]` of its
/// `m` nodes \[N/m\].
///
/// `spin` is the derivative of the velocity of a node by its position at fixed velocity in space
/// \[1/s\], which a rotating target adds.
pub fn add_stiffness<const D: usize>(
    state: &PointState<D>,
    slopes: &Slopes<D>,
    nodes: &[VertexNode<D>],
    selection: &TermSelection,
    spin: Option<&Tensor<D>>,
    stiffness: &mut [f64],
) {
    let terms = selection.terms;
    let shift = selection.velocity_shift;
    let area = state.area;
    if let Some(stiffest) = selection.joint {
        let tangential = -(slopes.by_velocity * shift + slopes.by_increment);
        let coefficients = nodes.iter().map(|node| node.coefficient);
        let normal = -slopes.normal - slopes.normal_by_velocity.dot(&state.normal) * shift;
        let joint = Joint { normal, tangential };
        return joint.add_springs(&state.normal, area, coefficients, stiffest, stiffness);
    }
    let pressed = terms.contains(Terms::NORMAL_CONTACT);
    let damped = slopes.normal_by_velocity.amax() > 0.0;
    for (b, node) in nodes.iter().enumerate() {
        let mut by_pressure = if pressed { node.gap * (slopes.normal * area) } else { Vector::zeros() };
        let by_damping = if damped { damping_by_node(slopes, node, shift, spin) } else { Vector::zeros() };
        if terms.contains(Terms::NORMAL_DAMPING) {
            by_pressure += by_damping * area;
        }
        let mut by_friction = Tensor::zeros();
        if terms.contains(Terms::FRICTION_NORMAL_COUPLING) {
            by_friction += slopes.by_gap * node.gap.transpose() + slopes.by_pressure * by_damping.transpose();
        }
        if terms.contains(Terms::FRICTION_DAMPING) {
            by_friction += (slopes.by_velocity * shift + slopes.by_increment) * node.coefficient;
        }
        if terms.contains(Terms::COEFFICIENT_CHANGE) {
            by_friction += slopes.through_bound * (shift * node.coefficient);
        }
        if terms.contains(Terms::FRICTION_GEOMETRY) && !state.is_beyond_bound {
            by_friction += slopes.by_normal * node.normal
                + (slopes.by_velocity + slopes.through_bound) * node.slips[0]
                + slopes.by_increment * node.slips[1];
            if let Some(spin) = spin {
                by_friction += (slopes.by_velocity + slopes.through_bound) * spin * node.coefficient;
            }
        }
        by_friction *= area;
        for (a, test) in nodes.iter().enumerate() {
            let start = (a * nodes.len() + b) * D * D;
            let block = &mut stiffness[start..start + D * D];
            for i in 0..D {
                for j in 0..D {
                    block[i * D + j] -=
                        test.push[i] * by_pressure[j] + test.coefficient * by_friction[(i, j)];
                }
            }
        }
    }
}

/// Derivative of the pressure by the position of a node through the closing speed \[Pa/m\]: through the
/// velocity of the node, and through the measure of the relative velocity and the normal.
fn damping_by_node<const D: usize>(
    slopes: &Slopes<D>,
    node: &VertexNode<D>,
    shift: f64,
    spin: Option<&Tensor<D>>,
) -> Vector<D> {
    let by_velocity = &slopes.normal_by_velocity;
    let mut by = by_velocity * (shift * node.coefficient)
        + node.slips[0].transpose() * by_velocity
        + node.normal.transpose() * slopes.normal_by_normal;
    if let Some(spin) = spin {
        by += spin.transpose() * by_velocity * node.coefficient;
    }
    by
}

/// A vertex with the nodes on which it depends.
#[derive(Debug)]
pub(super) struct VertexRows<const D: usize> {
    pub vertex: usize,
    pub nodes: Vec<VertexNode<D>>,
    /// Undeformed positions of the nodes \[m\].
    pub reference_points: Vec<Vector<D>>,
    /// Derivatives of `kappa` and of the covered area of the surrounding facets [-, m].
    pub by_area: Vec<Vector<D>>,
    pub by_cover: Vec<Vector<D>>,
}

impl<const D: usize> VertexRows<D> {
    /// Index of a node of the vertex in its row.
    pub fn place(&self, node: u32) -> usize {
        self.nodes.iter().position(|known| known.node == node).unwrap_or(0)
    }
}
