//! Second derivatives of the potential of a pair of facets, for the matrix over a step (theory,
//! section 1.8).
//!
//! The potential is `int D w`, with the weight `w` of a segment point without the fading weight, and
//! `D = sum_A Phi_A fade(g) (p_A (g - g_A) - u_A)` with what is frozen at the vertices. In 3D the
//! derivatives are taken [at fixed places](super::segment::Want::FixedPlaces), relative to the centre of the
//! contactor's piece. All sums hold half of the second derivative; the other half is the transpose.
//!
//! Left out are the second derivatives of `Phi_A w`, which cancel only together with those of the corners of
//! the overlap, and the terms that the theory names.

use super::integrals::{
    FacetPair, Opposite, PlacedFacet, Point, Variation, VertexPotential, add_by_node, add_multiple, bends,
    row,
};
use super::products::Products;
use super::shape;
use super::split::MOST_CORNERS;
use crate::space::facet_normal;
use crate::tensor::Vector;

/// Derivatives of `D` at a segment point.
#[derive(Default)]
struct Density {
    /// First derivative by the gap.
    slope: f64,
    /// Second derivative by the gap.
    bend: f64,
    /// By the coordinates on the contactor, at a fixed gap.
    along: [f64; 2],
    /// By a coordinate and the gap.
    mixed: [f64; 2],
}

impl Density {
    fn of<const D: usize>(pair: &FacetPair<'_, D>, point: &Point<D>, vertices: &[VertexPotential]) -> Self {
        let [counts, fading, bending] = point.fade;
        let mut sum = Self::default();
        for (vertex, own) in vertices.iter().enumerate().take(pair.contactor.kind.corners()) {
            let weight = point.weights.value[vertex];
            let energy = own.pressure * (point.gap - own.gap) - own.energy;
            let by_gap = fading * energy + counts * own.pressure;
            sum.slope += weight * by_gap;
            sum.bend += weight * (bending * energy + 2.0 * fading * own.pressure);
            for k in 0..D - 1 {
                sum.along[k] += point.weights.gradient[vertex][k] * counts * energy;
                sum.mixed[k] += point.weights.gradient[vertex][k] * by_gap;
            }
        }
        sum
    }
}

impl<const D: usize> FacetPair<'_, D> {
    /// Adds half of the second derivative of the potential at one point, (1.11) of the theory, which names
    /// the parts and what is left out.
    pub(super) fn add_potential(
        &self,
        point: &Point<D>,
        variation: &Variation<D>,
        vertices: &[VertexPotential; MOST_CORNERS],
        products: &mut Products,
        buffer: &mut Vec<f64>,
    ) {
        let density = Density::of(self, point, vertices);
        if point.whole == 0.0 {
            self.add_boundary(variation, &density, products);
        } else {
            self.add_by_gap(point, variation, &density, products);
            if let Opposite::Facet(target) = &self.target {
                self.add_second_of_gap(
                    point,
                    variation,
                    target,
                    density.slope * point.whole,
                    products,
                    buffer,
                );
            } else {
                // The gap has the second derivative `N_a N_b dn/dx` by the nodes.
                for (i, by) in variation.normal.iter().enumerate() {
                    products.left.push_copy(row(by, self.nodes()));
                    let own = products.right.push();
                    let force = 0.5 * density.slope * point.whole;
                    (0..self.nodes()).for_each(|a| own[a * D + i] = force * point.contactor.value[a]);
                }
            }
        }
        products.flush();
    }

    /// A point on the boundary of the overlap: the integrand varies and the boundary moves.
    fn add_boundary(&self, variation: &Variation<D>, density: &Density, products: &mut Products) {
        let all = self.nodes();
        let integrand = products.left.push();
        add_multiple(integrand, row(&variation.gap, all), density.slope);
        for k in 0..self.coordinates() {
            add_multiple(integrand, row(&variation.xi[k], all), density.along[k]);
        }
        products.right.push_copy(row(&variation.whole, all));
    }

    /// Products of the first derivative of the gap with the others.
    fn add_by_gap(
        &self,
        point: &Point<D>,
        variation: &Variation<D>,
        density: &Density,
        products: &mut Products,
    ) {
        let all = self.nodes();
        let by_gap = row(&variation.gap, all);
        products.left.push_copy(by_gap);
        let others = products.right.push();
        add_multiple(others, row(&variation.whole, all), density.slope);
        add_multiple(others, by_gap, 0.5 * density.bend * point.whole);
        for k in 0..self.coordinates() {
            add_multiple(others, row(&variation.xi[k], all), point.whole * density.mixed[k]);
        }
    }

    /// Adds half of the second derivative of the gap over a target facet, times `force`.
    fn add_second_of_gap(
        &self,
        point: &Point<D>,
        variation: &Variation<D>,
        target: &PlacedFacet<'_, D>,
        force: f64,
        products: &mut Products,
        buffer: &mut Vec<f64>,
    ) {
        let (first, all) = (self.contactor.nodes.len(), self.nodes());
        for (i, by) in variation.normal.iter().enumerate() {
            let by = row(by, all);
            products.left.push_copy(by);
            let own = products.right.push();
            add_multiple(own, by, -0.5 * point.gap * force);
            (0..all).for_each(|a| own[a * D + i] += force * point.coefficient(a, first));
        }
        let along = shape::tangents(&point.target, target.nodes);
        let area: Vector<D> = facet_normal(&along);
        // `q`, the normal of the target whose part along the normal of the contactor is 1.
        let toward = area / area.dot(&point.normal);
        let [below, above] = [(&self.contactor, point.xi, point.normal), (target, point.eta, toward)]
            .map(|(facet, at, normal)| bends(facet.kind, at, facet.nodes).map(|bend| bend.dot(&normal)));
        let slope = point.normal - toward;
        if slope.norm_squared() > 0.0 {
            let tilt = products.left.push();
            for (i, by) in variation.normal.iter().enumerate() {
                add_multiple(tilt, row(by, all), slope[i]);
            }
            products.right.push_multiple(row(&variation.gap, all), force);
        }
        for k in 0..D - 1 {
            // `y_,k . dn + q . dy_,k` without half of the contribution of the sliding of the point.
            buffer.clear();
            buffer.resize(all * D, 0.0);
            for (i, by) in variation.normal.iter().enumerate() {
                add_multiple(buffer, row(by, all), along[k][i]);
            }
            add_by_node(&mut buffer[first * D..], &point.target, k, &toward);
            for l in 0..D - 1 {
                add_multiple(buffer, row(&variation.eta[l], all), 0.5 * above[k + l]);
            }
            products.left.push_copy(row(&variation.eta[k], all));
            products.right.push_multiple(buffer, -force);
        }
        if below.iter().any(|bend| *bend != 0.0) {
            for k in 0..D - 1 {
                products.left.push_copy(row(&variation.xi[k], all));
                let under = products.right.push();
                for l in 0..D - 1 {
                    add_multiple(under, row(&variation.xi[l], all), -0.5 * force * below[k + l]);
                }
            }
        }
    }
}
