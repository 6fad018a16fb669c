//! Integrals over the common segments of one contactor facet and one target facet, weighted by the
//! vertices of the contactor.
//!
//! At a segment point with `x = sum N_a x_a`, `y = sum M_b y_b` and `nu = x_,1 x x_,2` (outward
//! from the contactor) the normal is `n = -nu / |nu|`, or the outward normal of the target
//! ([`NormalOf`]), the gap `g = (x - y) . n` and `dGamma = fade(g_c) psi w j`, with the gap `g_c` along
//! the normal of the contactor, the weight `psi` of the angle between the facets (`facing`) and
//! `j = |nu|` now or in the reference configuration. With the coefficients `c_a = N_a` on the contactor
//! and `-M_b` on the target, vertex `A` with weight `Phi_A` has
//!
//! `kappa = int Phi_A`, `W = int Phi_A g`, `N = int Phi_A n`, `D_a = int Phi_A c_a`, `V_a = int
//! Phi_A n c_a`.
//!
//! All integrals depend only on the node positions of the two facets. Over a rigid obstacle a
//! quadrature rule on the whole contactor facet gives the points. Gap and normal are the obstacle's
//! signed distance at `x` and its gradient.

use super::facing::{PairFacing, pair_facing};
use super::intersection::{degree, overlap};
use super::obstacle::PlacedObstacle;
use super::products::Products;
use super::segment::{ByCorners, PlacedPiece, PointVariation, SegmentPoint, TARGET, Want};
use super::shape::{self, FacetShape, MOST_NODES};
use super::split::{FacetPiece, MOST_CORNERS, linear, pieces};
use crate::mesh::{ElementKind, PlaneState};
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
    /// The undeformed facet with these positions of its nodes \[m\], whose origin is that of the mesh:
    /// tractions are nominal.
    Reference(&'a [Vector<D>]),
}

/// Extent of the surfaces across the plane, in two dimensions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AcrossPlane {
    /// State across the plane.
    pub plane: PlaneState,
    /// Distance of the origin of current positions from the y axis \[m\].
    pub origin: f64,
}

impl AcrossPlane {
    /// The extent at the coordinate `x` of a current position \[m\].
    pub(super) fn depth(&self, x: f64) -> f64 {
        self.plane.depth(self.origin + x)
    }
}

/// Range of gaps over which surfaces are integrated, and the weight of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Part of the tractions that a pair carries: all of them, or half if every facet is both
    /// contactor and target.
    pub share: f64,
    /// Depths at which the weight of a point begins to fade and at which it is zero: deeper points lie
    /// nearer to the other side of the target \[m\].
    pub deep: [f64; 2],
    /// Gaps at which the weight of a point begins to fade and at which it is zero \[m\].
    pub open: [f64; 2],
}

impl Range {
    /// Weight of a point at this gap, and its derivatives [1/m, 1/m^2].
    ///
    /// The gap of a vertex is a mean value. Without this factor, a facet over a deep hole would
    /// open the vertex although its other facets press. The factor is continuously differentiable.
    pub(super) fn fade(&self, gap: f64) -> [f64; 3] {
        let ([begin, end], toward_open) = if gap > 0.0 { (self.open, 1.0) } else { (self.deep, -1.0) };
        let width = end - begin;
        let s = (gap.abs() - begin) / width;
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

    /// Whether the points lie on segments, so that only a part of the contactor facet may be covered.
    pub fn has_segments(&self) -> bool {
        matches!(self, Self::Facet(_))
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
    /// Extent across the plane.
    pub across: AcrossPlane,
    /// The side that gives the normal.
    pub normal_of: NormalOf,
}

/// A side of a pair of facets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NormalOf {
    /// The contactor, or the obstacle.
    Contactor,
    /// The target facet.
    Target,
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
    /// Maximum of `-g` \[m\] times the weight of the angle between the facets. It is taken over all
    /// points; over an obstacle, over the points around the vertex, in range or not, without that weight.
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

impl<const D: usize> Default for PairIntegrals<D> {
    fn default() -> Self {
        Self { vertices: [VertexIntegrals::default(); MOST_CORNERS], cover: 0.0 }
    }
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

impl<const D: usize> FrozenFacet<D> {
    /// Whether a traction acts at one of this many corners.
    fn acts(&self, corners: usize) -> bool {
        self.carried[..corners].iter().any(Carried::acts)
    }
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
    /// Whether the derivatives are integrals of derivatives, see [`Want::FixedPlaces`], and not those of the
    /// sums over points, from which they differ by the error of the quadrature. Not together with
    /// frozen quantities.
    pub fixed_places: bool,
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
    /// Weight of the angle between the facets. Over an obstacle, where it is in the measures, 1.
    pub part: f64,
    pub gap: f64,
    pub normal: Vector<D>,
    /// Coordinates on both facets.
    pub xi: [f64; 2],
    pub eta: [f64; 2],
}

/// Derivatives of a scalar by the positions of the nodes of both facets.
pub(super) type ByNodes<const D: usize> = [[f64; D]; PAIR_NODES];

/// Derivatives of the quantities of a segment point.
#[derive(Debug)]
pub(super) struct Variation<const D: usize> {
    pub xi: [ByNodes<D>; 2],
    pub eta: [ByNodes<D>; 2],
    /// Of the weight of the segment point.
    pub weight: ByNodes<D>,
    /// Of the measure: at fixed size of the facet, and by that size.
    pub measure: ByNodes<D>,
    pub stretch: ByNodes<D>,
    /// Of the measure without the fading weight.
    pub whole: ByNodes<D>,
    pub gap: ByNodes<D>,
    /// Of the distance along the normal of the contactor, if the normal is that of the target and the
    /// point fades.
    reach: ByNodes<D>,
    /// Of the normal by the nodes of its side, at a fixed point of the facet.
    pub turns: [Tensor<D>; MOST_NODES],
    /// Of the normal by the coordinates of the point on its side.
    pub bends: [Vector<D>; 2],
    /// Of each component of the normal, both together, if requested.
    pub normal: [ByNodes<D>; D],
}

impl<const D: usize> Variation<D> {
    pub fn new() -> Self {
        let none = [[0.0; D]; PAIR_NODES];
        Self {
            xi: [none; 2],
            eta: [none; 2],
            weight: none,
            measure: none,
            stretch: none,
            whole: none,
            gap: none,
            reach: none,
            turns: [Tensor::zeros(); MOST_NODES],
            bends: [Vector::zeros(); 2],
            normal: [none; D],
        }
    }
}

/// The derivatives by the positions of this many nodes as a flat row.
pub(super) fn row<const D: usize>(by: &ByNodes<D>, nodes: usize) -> &[f64] {
    by[..nodes].as_flattened()
}

/// Adds a multiple of one row to another.
pub(super) fn add_multiple(sum: &mut [f64], row: &[f64], factor: f64) {
    sum.iter_mut().zip(row).for_each(|(sum, value)| *sum += factor * value);
}

/// Buffers for the derivatives of pairs, reused for every pair.
#[derive(Debug)]
pub struct PairWorkspace<const D: usize> {
    point: Variation<D>,
    variations: Products,
    frozen: FrozenProducts,
    row: Vec<f64>,
}

impl<const D: usize> Default for PairWorkspace<D> {
    fn default() -> Self {
        Self {
            point: Variation::new(),
            variations: Products::default(),
            frozen: FrozenProducts::default(),
            row: Vec::new(),
        }
    }
}

/// Stiffness of frozen quantities as products of rows.
#[derive(Debug, Default)]
struct FrozenProducts {
    /// Under fixed tractions.
    geometry: Products,
    /// Of a potential, which is symmetric: half of its matrix. The other half is the transpose.
    potential: Products,
}

impl FrozenProducts {
    fn clear(&mut self, unknowns: usize) {
        self.geometry.clear(unknowns, unknowns);
        self.potential.clear(unknowns, unknowns);
    }

    /// Subtracts the sums from `stiffness[((a * m + b) * D + i) * D + j]` of the `m` nodes.
    fn subtract_from<const D: usize>(&mut self, stiffness: &mut [f64], nodes: usize) {
        let place =
            |row: usize, column: usize| ((row / D * nodes + column / D) * D + row % D) * D + column % D;
        let unknowns = 0..nodes * D;
        for (products, symmetric) in [(&mut self.geometry, false), (&mut self.potential, true)] {
            let sums = products.sums();
            if !sums.any {
                continue;
            }
            for row in unknowns.clone() {
                for (column, value) in unknowns.clone().zip(sums.row(row)) {
                    stiffness[place(row, column)] -= value;
                    if symmetric {
                        stiffness[place(column, row)] -= value;
                    }
                }
            }
        }
    }
}

/// Order of the sums of one vertex: area, gap, normal and the two slips, as far as they are needed.
struct SumOrder {
    normal: Option<usize>,
    slips: [Option<usize>; 2],
    count: usize,
}

impl SumOrder {
    fn of<const D: usize>(varying: WantedVariations) -> Self {
        let mut count = 2;
        let mut place = |wanted: bool| {
            let first = count;
            count += if wanted { D } else { 0 };
            wanted.then_some(first)
        };
        let normal = place(varying.normal);
        let slips = [place(varying.slip_velocity), place(varying.slip_increment)];
        Self { normal, slips, count }
    }
}

impl<const D: usize> FacetPair<'_, D> {
    /// Nodes of both facets.
    pub fn nodes(&self) -> usize {
        self.contactor.nodes.len() + self.target.nodes().len()
    }

    /// The integrals; `None` if the facets have no common segment.
    pub fn integrate(&self, workspace: &mut PairWorkspace<D>) -> Option<PairIntegrals<D>> {
        let mut found: Option<PairIntegrals<D>> = None;
        let everywhere = self.target.has_segments();
        let (first, all) = (self.contactor.nodes.len(), self.nodes());
        let corners = self.contactor.kind.corners();
        self.sweep(Want::Points, &mut workspace.point, |point, _| {
            let sums = found.get_or_insert_default();
            sums.cover += point.measure;
            for (vertex, weight) in sums.vertices.iter_mut().zip(point.weights.value).take(corners) {
                if everywhere || weight * corners as f64 >= 1.0 {
                    vertex.depth = vertex.depth.max(-point.gap * point.part);
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
        found
    }

    /// Passes the variation of the integrals of each vertex with each node to `add`: corner, node,
    /// change.
    ///
    /// It also adds the stiffness under the tractions of `frozen` to `stiffness[((a * m + b) * D + i) *
    /// D + j]` of the `m` nodes \[N/m\]: minus the derivative of the force `sum_A (t_n V_a + t_T D_a)`.
    pub fn vary(
        &self,
        fields: &PairFields<'_, D>,
        varying: WantedVariations,
        frozen: Option<(&FrozenFacet<D>, &mut [f64])>,
        workspace: &mut PairWorkspace<D>,
        mut add: impl FnMut(usize, usize, &VertexVariation<D>),
    ) {
        let all = self.nodes();
        let corners = self.contactor.kind.corners();
        let order = SumOrder::of::<D>(varying);
        let PairWorkspace { point: variation, variations, frozen: products, .. } = workspace;
        variations.clear(corners * order.count, all * D);
        products.clear(all * D);
        let want = match &frozen {
            Some(_) => Want::NormalVariations,
            None if varying.fixed_places => Want::FixedPlaces,
            None => Want::Variations,
        };
        let mut turns = [[Tensor::zeros(); MOST_NODES]; MOST_CORNERS];
        let turning = self.turning_nodes();
        self.sweep(want, variation, |point, variation| {
            self.add_variation(point, variation, fields, &order, variations);
            if varying.normal {
                for (turns, weight) in turns.iter_mut().zip(point.weights.value).take(corners) {
                    let share = weight * point.measure;
                    let changes = turns.iter_mut().zip(&variation.turns).take(turning.len());
                    changes.for_each(|(turn, by)| *turn += by * share);
                }
            }
            if let Some((frozen, _)) = frozen.as_ref().filter(|(frozen, _)| frozen.acts(corners)) {
                self.add_geometry(point, variation, frozen, &mut products.geometry);
            }
        });
        let sums = variations.sums();
        let mut change = VertexVariation::default();
        for vertex in 0..corners {
            for b in 0..all {
                let by = |number: usize| {
                    Vector::from_column_slice(&sums.row(vertex * order.count + number)[b * D..][..D])
                };
                change.area = by(0);
                change.gap = by(1);
                let tensor = |first: usize| Tensor::from_fn(|i, j| by(first + i)[j]);
                if let Some(place) = order.normal {
                    change.normal = tensor(place);
                    if turning.contains(&b) {
                        change.normal += turns[vertex][b - turning.start];
                    }
                }
                for (slip, place) in change.slips.iter_mut().zip(order.slips) {
                    if let Some(place) = place {
                        *slip = tensor(place);
                    }
                }
                add(vertex, b, &change);
            }
        }
        if let Some((_, stiffness)) = frozen {
            products.subtract_from::<D>(stiffness, all);
        }
    }

    /// Adds the stiffness of the frozen quantities: under fixed tractions as in [`vary`](Self::vary), and
    /// that of the potential, by variations [at fixed places](Want::FixedPlaces).
    pub fn add_frozen(
        &self,
        frozen: &FrozenFacet<D>,
        stiffness: &mut [f64],
        workspace: &mut PairWorkspace<D>,
    ) {
        let corners = self.contactor.kind.corners();
        let PairWorkspace { point: variation, frozen: products, row, .. } = workspace;
        products.clear(self.nodes() * D);
        if frozen.acts(corners) {
            self.sweep(Want::NormalVariations, variation, |point, variation| {
                self.add_geometry(point, variation, frozen, &mut products.geometry);
            });
        }
        if frozen.potential[..corners].iter().any(|own| own.pressure != 0.0) {
            self.sweep(Want::FixedPlaces, variation, |point, variation| {
                self.add_potential(point, variation, &frozen.potential, &mut products.potential, row);
            });
        }
        products.subtract_from::<D>(stiffness, self.nodes());
    }

    /// Adds the variation of one point, without the turns of its normal. With the share `Phi_A m` of
    /// a vertex, the sums of `Phi_A m q` vary by `q (Phi_A dm + m Phi_A,k dxi_k) + Phi_A m dq`.
    fn add_variation(
        &self,
        point: &Point<D>,
        variation: &Variation<D>,
        fields: &PairFields<'_, D>,
        order: &SumOrder,
        products: &mut Products,
    ) {
        let (first, all) = (self.contactor.nodes.len(), self.nodes());
        let Products { left, right, .. } = &mut *products;
        let corners = 0..self.contactor.kind.corners();
        let of = |vertex: usize| vertex * order.count..(vertex + 1) * order.count;
        let relative =
            [0, 1].map(|k| order.slips[k].map(|place| (place, point.relative(fields.fields[k], first))));
        let spread = |factor: f64, sums: &mut [f64]| {
            sums[0] = factor;
            sums[1] = factor * point.gap;
            if let Some(place) = order.normal {
                (0..D).for_each(|i| sums[place + i] = factor * point.normal[i]);
            }
            for (place, relative) in relative.iter().flatten() {
                (0..D).for_each(|i| sums[place + i] = factor * relative.value[i]);
            }
        };
        let by_measure = right.push();
        by_measure.copy_from_slice(row(&variation.measure, all));
        add_multiple(by_measure, row(&variation.stretch, all), 1.0);
        let factors = left.push();
        corners.clone().for_each(|vertex| spread(point.weights.value[vertex], &mut factors[of(vertex)]));
        for k in 0..self.coordinates() {
            right.push_copy(row(&variation.xi[k], all));
            let factors = left.push();
            for vertex in corners.clone() {
                let sums = &mut factors[of(vertex)];
                spread(point.measure * point.weights.gradient[vertex][k], sums);
                let share = point.weights.value[vertex] * point.measure;
                if let (Some(place), NormalOf::Contactor) = (order.normal, self.normal_of) {
                    (0..D).for_each(|i| sums[place + i] += share * variation.bends[k][i]);
                }
                for (place, relative) in relative.iter().flatten() {
                    (0..D).for_each(|i| sums[place + i] += share * relative.along_contactor[k][i]);
                }
            }
        }
        let mut add = |by: &ByNodes<D>, fill: &dyn Fn(&mut [f64], f64)| {
            right.push_copy(row(by, all));
            let factors = left.push();
            for vertex in corners.clone() {
                fill(&mut factors[of(vertex)], point.weights.value[vertex] * point.measure);
            }
        };
        add(&variation.gap, &|sums, share| sums[1] = share);
        let bent = order.normal.filter(|_| self.normal_of == NormalOf::Target);
        if relative.iter().any(Option::is_some) || bent.is_some() {
            for k in 0..self.coordinates() {
                add(&variation.eta[k], &|sums, share| {
                    for (place, relative) in relative.iter().flatten() {
                        (0..D).for_each(|i| sums[place + i] = -share * relative.along_target[k][i]);
                    }
                    if let Some(place) = bent {
                        (0..D).for_each(|i| sums[place + i] = share * variation.bends[k][i]);
                    }
                });
            }
        }
        products.flush();
    }

    /// The nodes that turn the normal.
    fn turning_nodes(&self) -> std::ops::Range<usize> {
        let first = self.contactor.nodes.len();
        match self.normal_of {
            NormalOf::Contactor => 0..first,
            NormalOf::Target => first..self.nodes(),
        }
    }

    /// Number of coordinates of the segment points that vary. Over an obstacle the points are
    /// fixed.
    pub(super) fn coordinates(&self) -> usize {
        match self.target {
            Opposite::Facet(_) => D - 1,
            Opposite::Obstacle(_) => 0,
        }
    }

    /// Adds the change of `sum_A (t_n V_a + t_T D_a)` at fixed tractions of the vertices.
    fn add_geometry(
        &self,
        point: &Point<D>,
        variation: &Variation<D>,
        frozen: &FrozenFacet<D>,
        products: &mut Products,
    ) {
        let FrozenFacet { carried, changes, .. } = frozen;
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
        let add_force = |entries: &mut [f64], force: &Vector<D>| {
            for (a, entries) in entries.chunks_exact_mut(D).enumerate() {
                add_multiple(entries, force.as_slice(), point.coefficient(a, first));
            }
        };
        let mut add = |force: &Vector<D>, by: &ByNodes<D>| {
            add_force(products.left.push(), force);
            products.right.push_copy(row(by, all));
        };
        add(&traction, &variation.measure);
        if changes.area {
            add(&whole, &variation.stretch);
        }
        if pressure != 0.0 {
            for (i, by) in variation.normal.iter().enumerate() {
                let mut push = Vector::zeros();
                push[i] = pressure * point.measure;
                add(&push, by);
            }
        }
        for k in 0..self.coordinates() {
            let along = (point.normal * pressure_slope[k] + friction_slope[k]) * point.measure;
            let by_xi = products.left.push();
            add_force(by_xi, &along);
            add_by_node(&mut by_xi[..first * D], &point.contactor, k, &force);
            products.right.push_copy(row(&variation.xi[k], all));
            add_by_node(&mut products.left.push()[first * D..], &point.target, k, &-force);
            products.right.push_copy(row(&variation.eta[k], all));
        }
        products.flush();
    }

    /// Visits the points of all segments, with their variation if it is needed.
    fn sweep(
        &self,
        want: Want,
        variation: &mut Variation<D>,
        mut visit: impl FnMut(&Point<D>, &Variation<D>),
    ) {
        let target = match &self.target {
            Opposite::Facet(target) => target,
            Opposite::Obstacle(obstacle) => {
                return self.sweep_over(obstacle, want, variation, visit);
            }
        };
        let sides = [(self.contactor.kind, self.contactor.nodes), (target.kind, target.nodes)];
        let Some(facing) = pair_facing(sides) else { return };
        let degree = degree(self.contactor.kind, target.kind);
        if want != Want::Points {
            variation.stretch[..self.nodes()].fill([0.0; D]);
        }
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
                        let request = (want, &facing);
                        let point = self.point(target, segment, request, variation, |variation| {
                            self.spread_moves(target.kind, [below, above], moves, variation)
                        });
                        if let Some(point) = point {
                            visit(&point, variation);
                        }
                    },
                );
            }
        }
    }

    /// The quantities of a point between two facets, with their variations if these are requested; `None` if
    /// the point has no weight.
    ///
    /// `moves` sets the derivatives of the coordinates and of the weight by the nodes, which follow from how
    /// the point is found. All other derivatives follow from them.
    fn point(
        &self,
        opposite: &PlacedFacet<'_, D>,
        segment: &SegmentPoint<D>,
        (want, facing): (Want, &PairFacing<D>),
        variation: &mut Variation<D>,
        moves: impl FnOnce(&mut Variation<D>),
    ) -> Option<Point<D>> {
        let contactor = FacetShape::at(self.contactor.kind, segment.xi);
        let target = FacetShape::at(opposite.kind, segment.eta);
        let x = interpolate(&contactor.value, self.contactor.nodes);
        let y = interpolate(&target.value, opposite.nodes);
        let tangents = shape::tangents(&contactor, self.contactor.nodes);
        let vector_area = facet_normal(&tangents);
        let size = vector_area.norm();
        if size.is_nan() || size <= 0.0 {
            return None;
        }
        let outward = vector_area / size;
        let normal = match self.normal_of {
            NormalOf::Contactor => -outward,
            NormalOf::Target => facet_normal(&shape::tangents(&target, opposite.nodes)).try_normalize(0.0)?,
        };
        let chord = x - y;
        let gap = chord.dot(&normal);
        let fade = self.range.fade(-chord.dot(&outward)).map(|part| part * facing.part);
        let [counts, fading, _] = fade;
        if counts == 0.0 {
            return None;
        }
        let reference = match self.measure {
            AreaMeasure::Current => None,
            AreaMeasure::Reference(nodes) => {
                Some(Vector::from(facet_normal(&shape::tangents(&contactor, nodes))))
            }
        };
        let depth = match self.measure {
            AreaMeasure::Current => self.across.depth(x[0]),
            AreaMeasure::Reference(nodes) => self.across.plane.depth(interpolate(&contactor.value, nodes)[0]),
        };
        let per_depth = reference.map_or(size, |area: Vector<D>| area.norm());
        let stretch = per_depth * depth;
        let linear = linear(self.contactor.kind);
        let point = Point {
            weights: if linear == self.contactor.kind {
                contactor
            } else {
                FacetShape::at(linear, segment.xi)
            },
            measure: counts * segment.weight * stretch,
            whole: segment.weight * stretch,
            fade,
            part: facing.part,
            gap,
            normal,
            xi: segment.xi,
            eta: segment.eta,
            contactor,
            target,
        };
        if want == Want::Points {
            return Some(point);
        }
        moves(variation);
        let bends = bends(self.contactor.kind, segment.xi, self.contactor.nodes);
        let area_slopes = area_slopes(&tangents, &bends);
        let by_radius = self.across.plane.depth_slope() * per_depth;
        let stretch_slopes = match self.measure {
            AreaMeasure::Current => {
                [0, 1].map(|k| area_slopes[k].dot(&outward) * depth + by_radius * tangents[k][0])
            }
            AreaMeasure::Reference(nodes) => {
                let tangents = shape::tangents(&point.contactor, nodes);
                let bends = self::bends(self.contactor.kind, segment.xi, nodes);
                let slopes = self::area_slopes(&tangents, &bends);
                let direction = reference.map_or_else(Vector::zeros, |area| area / per_depth);
                [0, 1].map(|k| slopes[k].dot(&direction) * depth + by_radius * tangents[k][0])
            }
        };
        let (first, all) = (self.contactor.nodes.len(), self.nodes());
        let Variation { xi, eta, weight, measure, stretch: by_size, whole, gap: by_gap, .. } = variation;
        let Variation { reach, turns, bends: along, normal: by_normal, .. } = variation;
        for (b, by_gap) in by_gap.iter_mut().enumerate().take(all) {
            *by_gap = (normal * point.coefficient(b, first)).into();
        }
        if want.includes_normals() {
            by_normal.iter_mut().for_each(|by| by[..all].fill([0.0; D]));
        }
        let others = shape::tangents(&point.target, opposite.nodes);
        let projector = tangential_projector(&normal);
        let (edges, gradients, slopes, turned_by) = match self.normal_of {
            NormalOf::Contactor => (&tangents, &point.contactor.gradient, area_slopes, -projector / size),
            NormalOf::Target => {
                let bends = self::bends(opposite.kind, segment.eta, opposite.nodes);
                let facing_size = facet_normal(&others).norm();
                let slopes = self::area_slopes(&others, &bends);
                (&others, &point.target.gradient, slopes, projector / facing_size)
            }
        };
        for ((node, turn), gradient) in self.turning_nodes().zip(turns.iter_mut()).zip(gradients) {
            *turn = turned_by * area_variation(edges, gradient);
            add_multiple(&mut by_gap[node], turn.tr_mul(&chord).as_slice(), 1.0);
            if want.includes_normals() {
                for (i, by) in by_normal.iter_mut().enumerate() {
                    by[node] = turn.row(i).transpose().into();
                }
            }
        }
        for (b, gradient) in point.contactor.gradient.iter().enumerate().take(first) {
            by_size[b] = match self.measure {
                AreaMeasure::Current => {
                    let by_area = area_variation(&tangents, gradient);
                    let mut by_size = by_area.tr_mul(&outward) * (segment.weight * depth);
                    by_size[0] += segment.weight * by_radius * point.contactor.value[b];
                    by_size.into()
                }
                AreaMeasure::Reference(_) => [0.0; D],
            };
        }
        let by_gap = by_gap[..all].as_flattened_mut();
        let whole = whole[..all].as_flattened_mut();
        whole.fill(0.0);
        add_multiple(whole, row(weight, all), stretch);
        if let Some(by_nodes) = &facing.by_nodes {
            add_multiple(whole, row(by_nodes, all), segment.weight * stretch);
        }
        for k in 0..D - 1 {
            let [xi, eta] = [row(&xi[k], all), row(&eta[k], all)];
            along[k] = turned_by * slopes[k];
            add_multiple(by_gap, xi, tangents[k].dot(&normal));
            add_multiple(by_gap, eta, -others[k].dot(&normal));
            add_multiple(whole, xi, stretch_slopes[k] * segment.weight);
            let bending = match self.normal_of {
                NormalOf::Contactor => xi,
                NormalOf::Target => eta,
            };
            add_multiple(by_gap, bending, along[k].dot(&chord));
            if want.includes_normals() {
                for (i, by) in by_normal.iter_mut().enumerate() {
                    add_multiple(by[..all].as_flattened_mut(), bending, along[k][i]);
                }
            }
        }
        let measure = measure[..all].as_flattened_mut();
        measure.fill(0.0);
        add_multiple(measure, whole, counts);
        if fading != 0.0 {
            let by_reach = match self.normal_of {
                NormalOf::Contactor => by_gap,
                NormalOf::Target => {
                    let turned_by = -tangential_projector(&outward) / size;
                    for (b, reach) in reach.iter_mut().enumerate().take(all) {
                        *reach = (-outward * point.coefficient(b, first)).into();
                    }
                    for (reach, gradient) in reach[..first].iter_mut().zip(&point.contactor.gradient) {
                        let turn = turned_by * area_variation(&tangents, gradient);
                        add_multiple(reach, turn.tr_mul(&chord).as_slice(), 1.0);
                    }
                    let reach = reach[..all].as_flattened_mut();
                    for k in 0..D - 1 {
                        let along = turned_by * area_slopes[k];
                        add_multiple(reach, row(&xi[k], all), along.dot(&chord) - tangents[k].dot(&outward));
                        add_multiple(reach, row(&eta[k], all), others[k].dot(&outward));
                    }
                    reach
                }
            };
            add_multiple(measure, by_reach, fading * segment.weight * stretch);
        }
        let by_size = by_size[..first].as_flattened_mut();
        add_multiple(whole, by_size, 1.0);
        by_size.iter_mut().for_each(|by| *by *= counts);
        Some(point)
    }

    /// Sets the derivatives of coordinates and weight by the nodes, from those by the corners of two pieces.
    fn spread_moves(
        &self,
        target: ElementKind,
        pieces: [&FacetPiece; 2],
        moves: &PointVariation<D>,
        variation: &mut Variation<D>,
    ) {
        for k in 0..D - 1 {
            self.spread(target, pieces, &moves.xi[k], &mut variation.xi[k]);
            self.spread(target, pieces, &moves.eta[k], &mut variation.eta[k]);
        }
        self.spread(target, pieces, &moves.weight, &mut variation.weight);
    }

    /// Derivatives by the nodes, from those by the corners of two pieces.
    fn spread(
        &self,
        target: ElementKind,
        [below, above]: [&FacetPiece; 2],
        by: &ByCorners<D>,
        nodes: &mut ByNodes<D>,
    ) {
        let (first, second) = nodes[..self.nodes()].split_at_mut(self.contactor.nodes.len());
        for (piece, kind, by, nodes) in
            [(below, self.contactor.kind, &by[..TARGET], first), (above, target, &by[TARGET..], second)]
        {
            // The only piece of a linear facet has its nodes as corners.
            if linear(kind) == kind {
                nodes.iter_mut().zip(by).for_each(|(node, by)| *node = (*by).into());
                continue;
            }
            nodes.fill([0.0; D]);
            for (corner, by) in piece.corners.iter().zip(by) {
                match corner.node {
                    Some(node) => add_multiple(&mut nodes[node], by.as_slice(), 1.0),
                    None => {
                        let shape = FacetShape::at(kind, corner.at);
                        let nodes = nodes.iter_mut().zip(shape.value);
                        nodes.for_each(|(node, n)| add_multiple(node, by.as_slice(), n));
                    }
                }
            }
        }
    }
}

/// Adds `force_i dN_a/dxi_k` to the entries of the nodes `a` of one facet.
pub(super) fn add_by_node<const D: usize>(
    entries: &mut [f64],
    shape: &FacetShape,
    k: usize,
    force: &Vector<D>,
) {
    for (entries, gradient) in entries.chunks_exact_mut(D).zip(&shape.gradient) {
        add_multiple(entries, force.as_slice(), gradient[k]);
    }
}

/// A relative field (contactor minus target) at a segment point, and its derivatives along both
/// facets.
struct Relative<const D: usize> {
    value: Vector<D>,
    along_contactor: [Vector<D>; 2],
    along_target: [Vector<D>; 2],
}

impl<const D: usize> Point<D> {
    /// `c_a`.
    pub(super) fn coefficient(&self, a: usize, first: usize) -> f64 {
        if a < first { self.contactor.value[a] } else { -self.target.value[a - first] }
    }

    fn relative(&self, field: &[Vector<D>], first: usize) -> Relative<D> {
        let (below, above) = field.split_at(first);
        Relative {
            value: interpolate(&self.contactor.value, below) - interpolate(&self.target.value, above),
            along_contactor: shape::tangents(&self.contactor, below),
            along_target: shape::tangents(&self.target, above),
        }
    }
}

pub(super) fn interpolate<const D: usize>(shape: &[f64; MOST_NODES], nodes: &[Vector<D>]) -> Vector<D> {
    nodes.iter().zip(shape).map(|(x, n)| x * *n).sum()
}

/// `x_,11`, `x_,12`, `x_,22` of a facet of `kind` at these coordinates.
pub(super) fn bends<const D: usize>(kind: ElementKind, at: [f64; 2], nodes: &[Vector<D>]) -> [Vector<D>; 3] {
    let mut bends = [Vector::zeros(); 3];
    match kind {
        ElementKind::Line2 | ElementKind::Tri3 => return bends,
        ElementKind::Quad4 => {
            bends[1] = (nodes[0] - nodes[1] + nodes[2] - nodes[3]) * 0.25;
            return bends;
        }
        _ => {}
    }
    for (x, second) in nodes.iter().zip(&FacetShape::second(kind, at)) {
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
