//! Integrals over the common segments of one contactor facet and one target facet, weighted by the
//! vertices of the contactor.
//!
//! At a segment point with `x = sum N_a x_a`, `y = sum M_b y_b` and `nu = x_,1 x x_,2` (outward
//! from the contactor) the normal is `n = -nu / |nu|`, the gap `g = (x - y) . n` and `dGamma =
//! fade(g) w j`, with `j = |nu|` now or in the reference configuration. With the coefficients `c_a
//! = N_a` on the contactor and `-M_b` on the target, vertex `A` with weight `Phi_A` has
//!
//! `kappa = int Phi_A`, `W = int Phi_A g`, `N = int Phi_A n`, `D_a = int Phi_A c_a`, `V_a = int
//! Phi_A n c_a`.
//!
//! All integrals depend only on the node positions of the two facets. Over a rigid obstacle a
//! quadrature rule on the whole contactor facet gives the points. Gap and normal are the obstacle's
//! signed distance at `x` and its gradient.

use super::intersection::{degree, overlap};
use super::obstacle::PlacedObstacle;
use super::segment::{ByCorners, PlacedPiece, PointVariation, SegmentPoint, TARGET, Want};
use super::shape::{FacetShape, MOST_NODES};
use super::split::{FacetPiece, MOST_CORNERS, linear, pieces};
use crate::mesh::ElementKind;
use crate::space::{area_variation, facet_normal};
use crate::tensor::{Tensor, Vector, tangential_projector};

/// Maximum number of nodes of two facets.
pub const PAIR_NODES: usize = 2 * MOST_NODES;

/// A facet with its nodes.
#[derive(Debug, Clone, Copy)]
pub struct PlacedFacet<'a, const D: usize> {
    /// Its kind.
    pub kind: ElementKind,
    /// Positions of its nodes now \[m\].
    pub nodes: &'a [Vector<D>],
}

/// Configuration in which the tractions act.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AreaMeasure<'a, const D: usize> {
    /// The deformed facet: tractions are Cauchy tractions.
    Current,
    /// The undeformed facet with these positions of its nodes \[m\]: tractions are nominal.
    Reference(&'a [Vector<D>]),
}

/// Range of gaps over which surfaces are integrated, and the weight of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Part of the tractions that a pair carries: all of them, or half if every facet is both
    /// contactor and target.
    pub share: f64,
    /// Points deeper than this lie nearer to the other side of the target and have no weight. The
    /// weight fades from half of this depth \[m\].
    pub depth: f64,
    /// Points farther away than this have no weight. The weight fades from half of this distance
    /// \[m\].
    pub open: f64,
}

impl Range {
    /// Weight of a point at this gap, and its derivatives [1/m, 1/m^2].
    ///
    /// The gap of a vertex is a mean value. Without this factor, a facet over a deep hole would
    /// open the vertex although its other facets press. The factor is continuously differentiable.
    pub(super) fn fade(&self, gap: f64) -> [f64; 3] {
        let (end, toward_open) = if gap > 0.0 { (self.open, 1.0) } else { (self.depth, -1.0) };
        let width = 0.5 * end;
        let s = (gap.abs() - (end - width)) / width;
        if s <= 0.0 {
            return [self.share, 0.0, 0.0];
        }
        if s >= 1.0 {
            return [0.0; 3];
        }
        let part = 1.0 - s * s * (3.0 - 2.0 * s);
        let slope = -6.0 * s * (1.0 - s) / width * toward_open;
        let bend = (12.0 * s - 6.0) / (width * width);
        [part, slope, bend].map(|part| self.share * part)
    }
}

/// The side opposite a contactor facet.
#[derive(Debug, Clone, Copy)]
pub enum Opposite<'a, const D: usize> {
    /// A facet of a body: the integrals go over the common segments.
    Facet(PlacedFacet<'a, D>),
    /// A rigid obstacle: the integrals cover the whole contactor facet.
    Obstacle(PlacedObstacle<'a, D>),
}

impl<'a, const D: usize> Opposite<'a, D> {
    /// Positions of the nodes \[m\]; empty for an obstacle.
    pub fn nodes(&self) -> &'a [Vector<D>] {
        match self {
            Self::Facet(facet) => facet.nodes,
            Self::Obstacle(_) => &[],
        }
    }
}

/// A contactor facet and the opposite side.
#[derive(Debug, Clone, Copy)]
pub struct FacetPair<'a, const D: usize> {
    /// The contactor facet, whose corners are the vertices.
    pub contactor: PlacedFacet<'a, D>,
    /// The other side.
    pub target: Opposite<'a, D>,
    /// Configuration in which the area of the contactor is measured.
    pub measure: AreaMeasure<'a, D>,
    /// Range of gaps.
    pub range: Range,
}

/// The integrals of one vertex over one pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VertexIntegrals<const D: usize> {
    /// `kappa` [m, m^2].
    pub area: f64,
    /// `W` [m^2, m^3].
    pub gap: f64,
    /// `N` [m, m^2].
    pub normal: Vector<D>,
    /// `D_a` of the contactor's nodes, then of the target's [m, m^2].
    pub coefficients: [f64; PAIR_NODES],
    /// `V_a` [m, m^2].
    pub pushes: [Vector<D>; PAIR_NODES],
    /// Maximum of `-g` \[m\]. It is taken over all points; over an obstacle, over the points around
    /// the vertex, in range or not.
    pub depth: f64,
}

impl<const D: usize> Default for VertexIntegrals<D> {
    fn default() -> Self {
        Self {
            area: 0.0,
            gap: 0.0,
            normal: Vector::zeros(),
            coefficients: [0.0; PAIR_NODES],
            pushes: [Vector::zeros(); PAIR_NODES],
            depth: f64::NEG_INFINITY,
        }
    }
}

/// The integrals of all vertices over one pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairIntegrals<const D: usize> {
    /// One entry for each corner of the contactor facet.
    pub vertices: [VertexIntegrals<D>; MOST_CORNERS],
    /// Covered area of the facet, `sum_A kappa_A` [m, m^2].
    pub cover: f64,
}

/// Fields of the nodes whose relative values are integrated: `S = int Phi_A sum_a c_a f_a`.
#[derive(Debug, Clone, Copy)]
pub struct PairFields<'a, const D: usize> {
    /// Velocities [m/s], displacements since the start of the step \[m\].
    pub fields: [&'a [Vector<D>]; 2],
}

/// Derivatives of the integrals of one vertex by the position of one node. Rows are components of
/// the integral, columns those of the node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VertexVariation<const D: usize> {
    /// `dkappa`.
    pub area: Vector<D>,
    /// `dW`.
    pub gap: Vector<D>,
    /// `dN`.
    pub normal: Tensor<D>,
    /// `dS` of the two fields, at fixed fields.
    pub slips: [Tensor<D>; 2],
}

impl<const D: usize> Default for VertexVariation<D> {
    fn default() -> Self {
        Self {
            area: Vector::zeros(),
            gap: Vector::zeros(),
            normal: Tensor::zeros(),
            slips: [Tensor::zeros(); 2],
        }
    }
}

/// Tractions of a vertex that are held fixed while the geometry varies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Carried<const D: usize> {
    /// `t_n` \[Pa\].
    pub normal: f64,
    /// `t_T` \[Pa\].
    pub friction: Vector<D>,
}

impl<const D: usize> Carried<D> {
    /// Whether any traction is nonzero.
    pub fn acts(&self) -> bool {
        self.normal != 0.0 || self.friction.iter().any(|t| *t != 0.0)
    }
}

/// Quantities held fixed at the vertices of a contactor facet while the geometry varies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrozenFacet<const D: usize> {
    /// Tractions at the corners.
    pub carried: [Carried<D>; MOST_CORNERS],
    /// Geometric quantities that vary under these tractions.
    pub changes: FrozenChanges,
    /// Coefficients of the potential `sum_A p_A (W_A - g_A kappa_A) - u_A kappa_A` at the corners.
    pub potential: [VertexPotential; MOST_CORNERS],
}

/// Geometric quantities that vary under fixed tractions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FrozenChanges {
    /// Normals and the pairing of opposite points vary under the pressure.
    pub under_pressure: bool,
    /// The pairing of opposite points varies under friction.
    pub under_friction: bool,
    /// The area varies under both tractions.
    pub area: bool,
}

/// Derivatives of the energy of a vertex by its weighted gap and its area.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct VertexPotential {
    /// `p` \[Pa\].
    pub pressure: f64,
    /// `g` \[m\].
    pub gap: f64,
    /// `u` \[J/m^2\].
    pub energy: f64,
}

impl<const D: usize> Default for FrozenFacet<D> {
    fn default() -> Self {
        let carried = [Carried { normal: 0.0, friction: Vector::zeros() }; MOST_CORNERS];
        Self {
            carried,
            changes: FrozenChanges::default(),
            potential: [VertexPotential::default(); MOST_CORNERS],
        }
    }
}

/// Variations of a vertex that are needed besides those of gap and area.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct WantedVariations {
    /// `dN`.
    pub normal: bool,
    /// `dS` of the velocities.
    pub slip_velocity: bool,
    /// `dS` of the displacements since the start of the step.
    pub slip_increment: bool,
}

/// All quantities of one segment point, from which its variation with the nodes follows.
pub(super) struct Point<const D: usize> {
    pub contactor: FacetShape,
    /// Shape functions of the target facet; zero over an obstacle.
    pub target: FacetShape,
    /// `Phi_A` with its gradient.
    pub weights: FacetShape,
    /// `dGamma` with and without the fading weight.
    pub measure: f64,
    pub whole: f64,
    pub fade: [f64; 3],
    pub gap: f64,
    pub normal: Vector<D>,
}

pub(super) struct Variation<const D: usize> {
    pub xi: [[Vector<D>; PAIR_NODES]; 2],
    pub eta: [[Vector<D>; PAIR_NODES]; 2],
    /// Of the measure: at fixed size of the facet, and by that size.
    pub measure: [Vector<D>; PAIR_NODES],
    pub stretch: [Vector<D>; PAIR_NODES],
    /// Of the measure without the fading weight.
    pub whole: [Vector<D>; PAIR_NODES],
    pub gap: [Vector<D>; PAIR_NODES],
    pub normal: [Tensor<D>; PAIR_NODES],
}

impl<const D: usize> Variation<D> {
    pub fn new() -> Self {
        let none = [Vector::zeros(); PAIR_NODES];
        Self {
            xi: [none; 2],
            eta: [none; 2],
            measure: none,
            stretch: none,
            whole: none,
            gap: none,
            normal: [Tensor::zeros(); PAIR_NODES],
        }
    }
}

impl<const D: usize> FacetPair<'_, D> {
    /// Nodes of both facets.
    pub fn nodes(&self) -> usize {
        self.contactor.nodes.len() + self.target.nodes().len()
    }

    /// The integrals; `None` if the facets have no common segment.
    pub fn integrate(&self) -> Option<PairIntegrals<D>> {
        let vertices = [VertexIntegrals::default(); MOST_CORNERS];
        let mut sums = PairIntegrals { vertices, cover: 0.0 };
        let mut found = false;
        let everywhere = matches!(self.target, Opposite::Facet(_));
        let (first, all) = (self.contactor.nodes.len(), self.nodes());
        let corners = self.contactor.kind.corners();
        self.sweep(Want::Points, |point, _| {
            found = true;
            sums.cover += point.measure;
            for (vertex, weight) in sums.vertices.iter_mut().zip(point.weights.value).take(corners) {
                if everywhere || weight * corners as f64 >= 1.0 {
                    vertex.depth = vertex.depth.max(-point.gap);
                }
                let share = weight * point.measure;
                vertex.area += share;
                vertex.gap += share * point.gap;
                vertex.normal += point.normal * share;
                for a in 0..all {
                    let part = share * point.coefficient(a, first);
                    vertex.coefficients[a] += part;
                    vertex.pushes[a] += point.normal * part;
                }
            }
        });
        found.then_some(sums)
    }

    /// Passes the variation of the integrals of each vertex with each node to `add`: corner, node,
    /// change.
    ///
    /// It also adds the stiffness of the `frozen` quantities to `stiffness[((a * m + b) * D + i) *
    /// D + j]` of the `m` nodes \[N/m\]. This stiffness is minus the derivative of the force `sum_A
    /// (t_n V_a + t_T D_a)` and of the gradient of the potential, see [`FrozenFacet`].
    pub fn vary(
        &self,
        fields: &PairFields<'_, D>,
        varying: WantedVariations,
        frozen: Option<(&FrozenFacet<D>, &mut [f64])>,
        mut add: impl FnMut(usize, usize, &VertexVariation<D>),
    ) {
        let all = self.nodes();
        let corners = self.contactor.kind.corners();
        let mut sums = [[VertexVariation::default(); PAIR_NODES]; MOST_CORNERS];
        let mut frozen = frozen;
        self.sweep(Want::Variations, |point, variation| {
            self.add_variation(point, variation, fields, varying, &mut sums);
            if let Some((frozen, stiffness)) = &mut frozen {
                self.add_frozen_point(point, variation, frozen, stiffness);
            }
        });
        for (vertex, sums) in sums.iter().enumerate().take(corners) {
            for (b, change) in sums.iter().enumerate().take(all) {
                add(vertex, b, change);
            }
        }
    }

    /// Adds only the stiffness of the frozen quantities, see [`vary`](Self::vary).
    pub fn add_frozen(&self, frozen: &FrozenFacet<D>, stiffness: &mut [f64]) {
        self.sweep(Want::Variations, |point, variation| {
            self.add_frozen_point(point, variation, frozen, stiffness);
        });
    }

    fn add_variation(
        &self,
        point: &Point<D>,
        variation: &Variation<D>,
        fields: &PairFields<'_, D>,
        varying: WantedVariations,
        sums: &mut [[VertexVariation<D>; PAIR_NODES]; MOST_CORNERS],
    ) {
        let first = self.contactor.nodes.len();
        let [velocities, increments] = fields.fields;
        let relative = [
            varying.slip_velocity.then(|| point.relative(velocities, first)),
            varying.slip_increment.then(|| point.relative(increments, first)),
        ];
        for b in 0..self.nodes() {
            let by_measure = variation.measure[b] + variation.stretch[b];
            let by_relative = [0, 1].map(|k| relative[k].as_ref().map(|relative| relative.by(variation, b)));
            for (vertex, sums) in sums.iter_mut().enumerate().take(self.contactor.kind.corners()) {
                let weight = point.weights.value[vertex];
                let slope = point.weights.gradient[vertex];
                let mut by_share = by_measure * weight;
                for k in 0..D - 1 {
                    by_share += variation.xi[k][b] * (point.measure * slope[k]);
                }
                let share = weight * point.measure;
                let sum = &mut sums[b];
                sum.area += by_share;
                sum.gap += by_share * point.gap + variation.gap[b] * share;
                if varying.normal {
                    sum.normal += point.normal * by_share.transpose() + variation.normal[b] * share;
                }
                for k in 0..2 {
                    if let (Some(relative), Some(by)) = (&relative[k], &by_relative[k]) {
                        sum.slips[k] += relative.value * by_share.transpose() + by * share;
                    }
                }
            }
        }
    }

    fn add_frozen_point(
        &self,
        point: &Point<D>,
        variation: &Variation<D>,
        frozen: &FrozenFacet<D>,
        stiffness: &mut [f64],
    ) {
        let corners = self.contactor.kind.corners();
        if frozen.carried[..corners].iter().any(Carried::acts) {
            self.add_geometry(point, variation, &frozen.carried, frozen.changes, stiffness);
        }
        if frozen.potential[..corners].iter().any(|own| own.pressure != 0.0) {
            self.add_potential(point, variation, &frozen.potential, stiffness);
        }
    }

    /// Adds the change of `sum_A (t_n V_a + t_T D_a)` at fixed tractions of the vertices.
    fn add_geometry(
        &self,
        point: &Point<D>,
        variation: &Variation<D>,
        carried: &[Carried<D>; MOST_CORNERS],
        changes: FrozenChanges,
        stiffness: &mut [f64],
    ) {
        let (first, all) = (self.contactor.nodes.len(), self.nodes());
        let mut pressure = 0.0;
        let mut friction = Vector::zeros();
        let mut pressure_slope = [0.0; 2];
        let mut friction_slope = [Vector::zeros(); 2];
        for (vertex, carried) in carried.iter().enumerate().take(self.contactor.kind.corners()) {
            pressure += point.weights.value[vertex] * carried.normal;
            friction += carried.friction * point.weights.value[vertex];
            for k in 0..D - 1 {
                pressure_slope[k] += point.weights.gradient[vertex][k] * carried.normal;
                friction_slope[k] += carried.friction * point.weights.gradient[vertex][k];
            }
        }
        let whole = point.normal * pressure + friction;
        if !changes.under_pressure {
            (pressure, pressure_slope) = (0.0, [0.0; 2]);
        }
        if !changes.under_friction {
            (friction, friction_slope) = (Vector::zeros(), [Vector::zeros(); 2]);
        }
        let traction = point.normal * pressure + friction;
        let force = traction * point.measure;
        for b in 0..all {
            let mut by = traction * variation.measure[b].transpose()
                + variation.normal[b] * (pressure * point.measure);
            if changes.area {
                by += whole * variation.stretch[b].transpose();
            }
            for k in 0..D - 1 {
                let along = point.normal * pressure_slope[k] + friction_slope[k];
                by += along * (variation.xi[k][b] * point.measure).transpose();
            }
            for a in 0..all {
                let (shape, coordinates, sign, node) = match a < first {
                    true => (&point.contactor, &variation.xi, 1.0, a),
                    false => (&point.target, &variation.eta, -1.0, a - first),
                };
                let mut by_coefficient = Vector::zeros();
                for k in 0..D - 1 {
                    by_coefficient += coordinates[k][b] * (sign * shape.gradient[node][k]);
                }
                let block = by * (sign * shape.value[node]) + force * by_coefficient.transpose();
                subtract_block(stiffness, a * all + b, &block);
            }
        }
    }

    /// Adds the Hessian of the potential (1.11) of the theory, which names its parts. It omits the
    /// second derivatives of the measure and the part proportional to the angle between the two
    /// sides.
    fn add_potential(
        &self,
        point: &Point<D>,
        variation: &Variation<D>,
        potential: &[VertexPotential; MOST_CORNERS],
        stiffness: &mut [f64],
    ) {
        let (first, all) = (self.contactor.nodes.len(), self.nodes());
        // With `D_A = fade (p (g - g_A) - u)`: `sum_A Phi_A` of its first and second derivatives by
        // the gap.
        let [counts, fading, bending] = point.fade;
        let (mut first_slope, mut second_slope) = (0.0, 0.0);
        let mut along_weights = [0.0; 2];
        for (vertex, own) in potential.iter().enumerate().take(self.contactor.kind.corners()) {
            let energy = own.pressure * (point.gap - own.gap) - own.energy;
            let by_gap = fading * energy + counts * own.pressure;
            first_slope += point.weights.value[vertex] * by_gap;
            second_slope += point.weights.value[vertex] * (bending * energy + 2.0 * fading * own.pressure);
            (0..D - 1).for_each(|k| along_weights[k] += point.weights.gradient[vertex][k] * by_gap);
        }
        let force = first_slope * point.whole;
        let mut by_weight = [Vector::zeros(); PAIR_NODES];
        for a in 0..all {
            by_weight[a] =
                variation.whole[a] * first_slope + variation.gap[a] * (0.5 * second_slope * point.whole);
            for k in 0..D - 1 {
                by_weight[a] += variation.xi[k][a] * (point.whole * along_weights[k]);
            }
        }
        let Opposite::Facet(target) = &self.target else {
            return add_potential_on_obstacle(point, variation, all, force, &by_weight, stiffness);
        };
        let along = tangents(&point.target, target.nodes);
        let curvatures =
            |shape: &FacetShape, nodes: &[Vector<D>]| bends(shape, nodes).map(|bend| bend.dot(&point.normal));
        let below = curvatures(&point.contactor, self.contactor.nodes);
        let above = curvatures(&point.target, target.nodes);
        // `d_a(y_,k . n)` without the contribution of the sliding of the point.
        let mut tilts = [[Vector::zeros(); PAIR_NODES]; 2];
        for a in 0..all {
            for k in 0..D - 1 {
                tilts[k][a] = variation.normal[a].transpose() * along[k];
                if a >= first {
                    tilts[k][a] += point.normal * point.target.gradient[a - first][k];
                }
            }
        }
        for a in 0..all {
            let own = point.coefficient(a, first) * force;
            for b in a..all {
                let other = point.coefficient(b, first) * force;
                let mut block = by_weight[a] * variation.gap[b].transpose()
                    + variation.gap[a] * by_weight[b].transpose()
                    + variation.normal[b] * own
                    + variation.normal[a].transpose()
                        * (Tensor::identity() * other - variation.normal[b] * (point.gap * force));
                for k in 0..D - 1 {
                    let mut over = tilts[k][b];
                    let mut under = Vector::zeros();
                    for l in 0..D - 1 {
                        over += variation.eta[l][b] * above[k + l];
                        under += variation.xi[l][b] * below[k + l];
                    }
                    block -= variation.eta[k][a] * (over * force).transpose()
                        + tilts[k][a] * (variation.eta[k][b] * force).transpose()
                        + variation.xi[k][a] * (under * force).transpose();
                }
                subtract_block(stiffness, a * all + b, &block);
                if b > a {
                    subtract_block(stiffness, b * all + a, &block.transpose());
                }
            }
        }
    }

    /// Visits the points of all segments, with their variation if it is needed.
    fn sweep(&self, want: Want, mut visit: impl FnMut(&Point<D>, &Variation<D>)) {
        let target = match &self.target {
            Opposite::Facet(target) => target,
            Opposite::Obstacle(obstacle) => return self.sweep_over(obstacle, want, visit),
        };
        let degree = degree(self.contactor.kind, target.kind);
        let mut variation = Variation::new();
        for below in pieces(self.contactor.kind) {
            let below_at = below.positions(self.contactor.kind, self.contactor.nodes);
            for above in pieces(target.kind) {
                let above_at = above.positions(target.kind, target.nodes);
                overlap(
                    &PlacedPiece { piece: below, corners: &below_at },
                    &PlacedPiece { piece: above, corners: &above_at },
                    degree,
                    want,
                    &mut |segment, moves| {
                        let pieces = [below, above];
                        if let Some(point) = self.point(target, pieces, segment, moves, want, &mut variation)
                        {
                            visit(&point, &variation);
                        }
                    },
                );
            }
        }
    }

    fn point(
        &self,
        opposite: &PlacedFacet<'_, D>,
        pieces: [&FacetPiece; 2],
        segment: &SegmentPoint<D>,
        moves: &PointVariation<D>,
        want: Want,
        variation: &mut Variation<D>,
    ) -> Option<Point<D>> {
        let contactor = FacetShape::at(self.contactor.kind, segment.xi);
        let target = FacetShape::at(opposite.kind, segment.eta);
        let x = interpolate(&contactor.value, self.contactor.nodes);
        let y = interpolate(&target.value, opposite.nodes);
        let tangents = tangents(&contactor, self.contactor.nodes);
        let vector_area = facet_normal(&tangents);
        let size = vector_area.norm();
        if size.is_nan() || size <= 0.0 {
            return None;
        }
        let normal = -vector_area / size;
        let chord = x - y;
        let gap = chord.dot(&normal);
        let fade = self.range.fade(gap);
        let [counts, fading, _] = fade;
        if counts == 0.0 {
            return None;
        }
        let reference = match self.measure {
            AreaMeasure::Current => None,
            AreaMeasure::Reference(nodes) => {
                Some(Vector::from(facet_normal(&self::tangents(&contactor, nodes))))
            }
        };
        let stretch = reference.map_or(size, |area: Vector<D>| area.norm());
        let point = Point {
            weights: FacetShape::at(linear(self.contactor.kind), segment.xi),
            measure: counts * segment.weight * stretch,
            whole: segment.weight * stretch,
            fade,
            gap,
            normal,
            contactor,
            target,
        };
        if want == Want::Points {
            return Some(point);
        }
        for k in 0..D - 1 {
            self.spread(opposite.kind, pieces, &moves.xi[k], &mut variation.xi[k]);
            self.spread(opposite.kind, pieces, &moves.eta[k], &mut variation.eta[k]);
        }
        self.spread(opposite.kind, pieces, &moves.weight, &mut variation.measure);
        let bends = bends(&contactor, self.contactor.nodes);
        let area_slopes = area_slopes(&tangents, &bends);
        let stretch_slopes = match self.measure {
            AreaMeasure::Current => area_slopes.map(|slope| -slope.dot(&normal)),
            AreaMeasure::Reference(nodes) => {
                let slopes =
                    self::area_slopes(&self::tangents(&contactor, nodes), &self::bends(&contactor, nodes));
                let direction = reference.map_or_else(Vector::zeros, |area| area / stretch);
                slopes.map(|slope| slope.dot(&direction))
            }
        };
        let others = self::tangents(&target, opposite.nodes);
        let projector = tangential_projector(&normal) / size;
        let first = self.contactor.nodes.len();
        for b in 0..self.nodes() {
            let mut by_area = Tensor::zeros();
            let mut by_size = Vector::zeros();
            let mut by_gap = normal * point.coefficient(b, first);
            if b < first {
                by_area = area_variation(&tangents, &contactor.gradient[b]);
                by_size = -by_area.transpose() * normal;
            }
            let mut by_stretch = Vector::zeros();
            for k in 0..D - 1 {
                let (xi, eta) = (variation.xi[k][b], variation.eta[k][b]);
                by_area += area_slopes[k] * xi.transpose();
                by_gap += xi * tangents[k].dot(&normal) - eta * others[k].dot(&normal);
                by_stretch += xi * stretch_slopes[k];
            }
            let by_normal = -projector * by_area;
            by_gap += by_normal.transpose() * chord;
            let by_size = match self.measure {
                AreaMeasure::Current => by_size * segment.weight,
                AreaMeasure::Reference(_) => Vector::zeros(),
            };
            let by_place = variation.measure[b] * stretch + by_stretch * segment.weight;
            variation.measure[b] = by_place * counts + by_gap * (fading * segment.weight * stretch);
            variation.stretch[b] = by_size * counts;
            variation.whole[b] = by_place + by_size;
            variation.gap[b] = by_gap;
            variation.normal[b] = by_normal;
        }
        Some(point)
    }

    /// Derivatives by the nodes, from those by the corners of two pieces.
    fn spread(
        &self,
        target: ElementKind,
        [below, above]: [&FacetPiece; 2],
        by: &ByCorners<D>,
        nodes: &mut [Vector<D>; PAIR_NODES],
    ) {
        nodes[..self.nodes()].fill(Vector::zeros());
        let (first, second) = nodes.split_at_mut(self.contactor.nodes.len());
        for (piece, kind, by, nodes) in
            [(below, self.contactor.kind, &by[..TARGET], first), (above, target, &by[TARGET..], second)]
        {
            for (corner, by) in piece.corners.iter().zip(by) {
                match corner.node {
                    Some(node) => nodes[node] += by,
                    None => {
                        let shape = FacetShape::at(kind, corner.at);
                        nodes.iter_mut().zip(shape.value).for_each(|(node, n)| *node += by * n);
                    }
                }
            }
        }
    }
}

/// Adds the Hessian of the potential over an obstacle. The gap has the second derivative `N_a N_b
/// dn/dx` by the nodes.
fn add_potential_on_obstacle<const D: usize>(
    point: &Point<D>,
    variation: &Variation<D>,
    nodes: usize,
    force: f64,
    by_weight: &[Vector<D>; PAIR_NODES],
    stiffness: &mut [f64],
) {
    for a in 0..nodes {
        for b in 0..nodes {
            let block = by_weight[a] * variation.gap[b].transpose()
                + variation.gap[a] * by_weight[b].transpose()
                + variation.normal[b] * (point.contactor.value[a] * force);
            subtract_block(stiffness, a * nodes + b, &block);
        }
    }
}

fn subtract_block<const D: usize>(stiffness: &mut [f64], number: usize, block: &Tensor<D>) {
    let entries = &mut stiffness[number * D * D..][..D * D];
    for i in 0..D {
        for j in 0..D {
            entries[i * D + j] -= block[(i, j)];
        }
    }
}

/// A relative field (contactor minus target) at a segment point, and its derivatives along both
/// facets.
struct Relative<const D: usize> {
    value: Vector<D>,
    along_contactor: [Vector<D>; 2],
    along_target: [Vector<D>; 2],
}

impl<const D: usize> Relative<D> {
    fn by(&self, variation: &Variation<D>, b: usize) -> Tensor<D> {
        let mut by = Tensor::zeros();
        for k in 0..D - 1 {
            by += self.along_contactor[k] * variation.xi[k][b].transpose();
            by -= self.along_target[k] * variation.eta[k][b].transpose();
        }
        by
    }
}

impl<const D: usize> Point<D> {
    /// `c_a`.
    fn coefficient(&self, a: usize, first: usize) -> f64 {
        if a < first { self.contactor.value[a] } else { -self.target.value[a - first] }
    }

    fn relative(&self, field: &[Vector<D>], first: usize) -> Relative<D> {
        let (below, above) = field.split_at(first);
        Relative {
            value: interpolate(&self.contactor.value, below) - interpolate(&self.target.value, above),
            along_contactor: tangents(&self.contactor, below),
            along_target: tangents(&self.target, above),
        }
    }
}

pub(super) fn interpolate<const D: usize>(shape: &[f64; MOST_NODES], nodes: &[Vector<D>]) -> Vector<D> {
    nodes.iter().zip(shape).map(|(x, n)| x * *n).sum()
}

/// `f_,k` of a nodal field.
pub(super) fn tangents<const D: usize>(shape: &FacetShape, nodes: &[Vector<D>]) -> [Vector<D>; 2] {
    let mut tangents = [Vector::zeros(); 2];
    for (x, gradient) in nodes.iter().zip(&shape.gradient) {
        for k in 0..D - 1 {
            tangents[k] += x * gradient[k];
        }
    }
    tangents
}

/// `x_,11`, `x_,12`, `x_,22`.
fn bends<const D: usize>(shape: &FacetShape, nodes: &[Vector<D>]) -> [Vector<D>; 3] {
    let mut bends = [Vector::zeros(); 3];
    for (x, second) in nodes.iter().zip(&shape.second) {
        for (bend, second) in bends.iter_mut().zip(second) {
            *bend += x * *second;
        }
    }
    bends
}

/// Derivatives of the vector area by the coordinates: `x_,1k x x_,2 + x_,1 x x_,2k`; in the plane
/// the rotated `x_,11`.
fn area_slopes<const D: usize>(tangents: &[Vector<D>; 2], bends: &[Vector<D>; 3]) -> [Vector<D>; 2] {
    if D == 2 {
        return [facet_normal(&[bends[0], Vector::zeros()]), Vector::zeros()];
    }
    [0, 1].map(|k| facet_normal(&[bends[k], tangents[1]]) + facet_normal(&[tangents[0], bends[k + 1]]))
}

#[cfg(test)]
#[path = "integrals_tests.rs"]
mod tests;
