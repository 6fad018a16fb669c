//! Second variations of the normal of a facet and of the gap over it.
//!
//! With `o = x - y(xi)`, the tangents `a_k = y_,k`, the free directions `d_i` of the projection and a tangential vector
//! `t = tau^l a_l` the normal turns by `t . dn = -tau^l n . da_l`, where `da_l` is the change of the tangent as the nodes and
//! the projection move. The second change is that of `tau^l`, of `n` and of `da_l`; the last holds the second change of the
//! projection, which the derivative of `o . a_i = 0` gives.

use super::newton::{LARGEST, solve};
use super::polynomial::Polynomial;
use super::{Place, Projection};
use crate::contact::curvature::{Curvature, tangents_of};
use crate::space::reference;
use crate::tensor::{Tensor, Vector};

/// What the motion of one position changes.
pub(super) struct Position<const D: usize> {
    /// `dxi^k`.
    pub coordinates: [Vector<D>; 2],
    pub normal: Tensor<D>,
    /// `do`.
    pub offset: Tensor<D>,
    /// `da_k`.
    pub tangents: [Tensor<D>; 2],
    /// `M_,k` and `M_,kl` of a node; zero of the point.
    pub gradient: [f64; 2],
    pub second: [[f64; 2]; 2],
}

/// Vectors that depend on `t` alone.
struct Along<const D: usize> {
    /// `tau^l`.
    components: [f64; 2],
    /// Answer of the projection to `tau^l n . y_,l`, as a direction of the reference domain.
    answer: [f64; 2],
}

impl<const D: usize> Projection<D> {
    /// Second variations by the point and the nodes of the facet, which are at `nodes` \[m\].
    pub fn curvature(&self, nodes: &[Vector<D>]) -> Curvature<D> {
        let positions = self.positions();
        let third = Polynomial::seen_from(&(self.point + self.facet.offset), self.kind, nodes)
            .third(&self.coordinates);
        let raised = self.raised();
        let tangents = tangents_of(&self.normal);
        let blocks = |t: &Vector<D>| -> Vec<Tensor<D>> {
            let along = self.along(t, &raised);
            let pairs = positions.iter().flat_map(|a| positions.iter().map(move |b| (a, b)));
            pairs.map(|(a, b)| self.turn(&along, &raised, &third, [a, b])).collect()
        };
        let second = if D == 3 { blocks(&tangents[1]) } else { Vec::new() };
        let mut curvature = Curvature {
            tangents,
            turns: [blocks(&tangents[0]), second],
            beyond: Vec::new(),
            spins: self.spins(&positions),
            positions: positions.len(),
        };
        if self.place != Place::Interior {
            let overhang = self.facet.offset - self.normal * self.gap;
            let pairs = (0..positions.len()).flat_map(|a| (0..positions.len()).map(move |b| (a, b)));
            let block = |(a, b): (usize, usize)| {
                let moved = positions[b].offset - positions[b].normal * self.gap;
                curvature.of_normal(&overhang, a, b) + positions[a].normal.transpose() * moved
            };
            curvature.beyond = pairs.map(block).collect();
        }
        curvature
    }

    fn positions(&self) -> Vec<Position<D>> {
        let (dim, count) = (D - 1, self.kind.nodes());
        let mut second = [0.0; 4 * LARGEST];
        reference(self.kind).second_gradient(&self.coordinates[..dim], &mut second[..count * dim * dim]);
        let of = |coefficient: f64, coordinates: [Vector<D>; 2], normal, gradient: [f64; 2], second| {
            let facet = &self.facet;
            let along = |k: usize| facet.tangents[k] * coordinates[k].transpose();
            let bent = |l: usize| {
                Tensor::identity() * gradient[l]
                    + facet.second[l][0] * coordinates[0].transpose()
                    + facet.second[l][1] * coordinates[1].transpose()
            };
            let offset = Tensor::identity() * coefficient - along(0) - along(1);
            Position { coordinates, normal, offset, tangents: [bent(0), bent(1)], gradient, second }
        };
        let point = self.by_contactor();
        let mut positions = vec![of(1.0, point.coordinates, point.normal, [0.0; 2], [[0.0; 2]; 2])];
        positions.extend(self.by_target_nodes().enumerate().map(|(a, node)| {
            let at = |k: usize, l: usize| {
                if k < dim && l < dim { second[(a * dim + k) * dim + l] } else { 0.0 }
            };
            let bends = std::array::from_fn(|k| std::array::from_fn(|l| at(k, l)));
            let gradient = node.coefficient_gradient.map(|m| -m);
            of(node.coefficient, node.coordinates, node.normal, gradient, bends)
        }));
        positions
    }

    /// `a^k`: the tangents with raised index.
    fn raised(&self) -> [Vector<D>; 2] {
        let axes = [[1.0, 0.0], [0.0, 1.0]];
        let metric = self.facet.hessian(&axes[..D - 1], 0.0);
        std::array::from_fn(|k| {
            if k + 1 >= D {
                return Vector::zeros();
            }
            self.facet.along(&solve(&metric, axes[k], D - 1).unwrap_or([0.0; 2]))
        })
    }

    fn along(&self, t: &Vector<D>, raised: &[Vector<D>; 2]) -> Along<D> {
        let (facet, free) = (&self.facet, &self.free[..self.frees]);
        let components = raised.map(|raised| raised.dot(t));
        let mut right = [0.0; 2];
        for (r, d) in right.iter_mut().zip(free) {
            for (tau, second) in components.iter().zip(&facet.second) {
                *r += tau * self.normal.dot(&(second[0] * d[0] + second[1] * d[1]));
            }
        }
        let found = solve(&facet.hessian(free, 1.0), right, free.len()).unwrap_or([0.0; 2]);
        let mut answer = [0.0; 2];
        for (s, d) in found.iter().zip(free) {
            answer = [answer[0] + s * d[0], answer[1] + s * d[1]];
        }
        Along { components, answer }
    }

    /// `d/dz_b (dn/dz_a^T t)`.
    fn turn(
        &self,
        along: &Along<D>,
        raised: &[Vector<D>; 2],
        third: &[Vector<D>; 2],
        [a, b]: [&Position<D>; 2],
    ) -> Tensor<D> {
        let (facet, normal) = (&self.facet, self.normal);
        let weighted = |p: &Position<D>, w: &[f64; 2]| p.tangents[0] * w[0] + p.tangents[1] * w[1];
        let [of_a, of_b] = [a, b].map(|p| weighted(p, &along.components));
        let mut block = Tensor::zeros();
        // Of tau^l and of n.
        for (k, up) in raised.iter().enumerate().take(D - 1) {
            let [out_a, out_b] = [a, b].map(|p| p.tangents[k].transpose() * normal);
            block +=
                out_a * (of_b.transpose() * up).transpose() + (of_a.transpose() * up) * out_b.transpose();
        }
        // Of da_l, and of the projection within it.
        let answer = &along.answer;
        let turned = |p: &Position<D>, w: &[f64; 2], other: &Position<D>| {
            let by = |m: usize| w[0] * p.second[0][m] + w[1] * p.second[1][m];
            other.coordinates[0] * by(0) + other.coordinates[1] * by(1)
        };
        let drawn = |p: &Position<D>, other: &Position<D>| {
            other.coordinates[0] * p.gradient[0] + other.coordinates[1] * p.gradient[1]
        };
        let pull = facet.along(answer);
        for (first, second, forward) in [(a, b, true), (b, a, false)] {
            let part = normal * turned(first, &along.components, second).transpose()
                - pull * drawn(first, second).transpose()
                + facet.offset * turned(first, answer, second).transpose()
                + first.offset.transpose() * weighted(second, answer);
            block -= if forward { part } else { part.transpose() };
        }
        for m in 0..D - 1 {
            for p in 0..D - 1 {
                let bent = |w: &[f64; 2], v: &Vector<D>| {
                    (0..D - 1).map(|l| w[l] * v.dot(&third_of(third, [l, m, p]))).sum::<f64>()
                };
                let factor = bent(&along.components, &normal) - facet.second[m][p].dot(&pull)
                    + bent(answer, &facet.offset);
                block -= a.coordinates[m] * b.coordinates[p].transpose() * factor;
            }
        }
        block
    }
}

/// `y_,klm` of a facet that is at most biquadratic.
fn third_of<const D: usize>(third: &[Vector<D>; 2], index: [usize; 3]) -> Vector<D> {
    match index.iter().sum() {
        1 => third[0],
        2 => third[1],
        _ => Vector::zeros(),
    }
}
