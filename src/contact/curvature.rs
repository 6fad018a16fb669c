//! Second variations of the normal at a point, and of its gap, arm and spin beyond an edge: what the tangent of a lever needs.

use super::obstacle::Proximity;
use crate::tensor::{Tensor, Vector};

/// How the variations `dn/dz_a` change with the positions `z_b`; the first position is that of the point itself, which its
/// contactor nodes share by their shape functions, the others are the nodes of the target facet.
#[derive(Debug, Clone, PartialEq)]
pub struct Curvature<const D: usize> {
    /// Unit tangents `e`, the second zero in the plane.
    pub(super) tangents: [Vector<D>; 2],
    /// `d/dz_b (dn/dz_a^T e)` at fixed `e`, at `a * positions + b` \[1/m^2\], symmetric as a whole.
    pub(super) turns: [Vec<Tensor<D>>; 2],
    /// What `d^2 g / dz_a dz_b` has besides `c_a dn/dz_b + n dc_a/dz_b`; empty unless beyond an edge \[1/m\].
    pub(super) beyond: Vec<Tensor<D>>,
    /// Of arm and spin; none where there is no arm.
    pub(super) spins: Option<Spins<D>>,
    /// The point and the nodes of the target facet.
    pub(super) positions: usize,
}

/// Variations of the arm of a point beyond an edge in space, and of the spin of its target.
#[derive(Debug, Clone, PartialEq)]
pub struct Spins<const D: usize> {
    /// `dp/dz_b` \[-\].
    pub(super) arms: Vec<Tensor<D>>,
    /// `d/dz_b dw/dz_a` at `a * positions + b` \[1/m^2\].
    pub(super) turns: Vec<Tensor<D>>,
}

impl<const D: usize> Spins<D> {
    /// `dp/dz_b`.
    pub fn arm(&self, b: usize) -> &Tensor<D> {
        &self.arms[b]
    }

    /// `d/dz_b dw/dz_a`.
    pub fn turn(&self, a: usize, b: usize) -> &Tensor<D> {
        &self.turns[a * self.arms.len() + b]
    }

    /// For each position `b` the `d/dz_b sum_a dw/dz_a . field_a`, the field given at the positions.
    pub fn of_field(&self, field: &[Vector<D>]) -> Vec<Vector<D>> {
        contract(&self.turns, field)
    }
}

impl<const D: usize> Curvature<D> {
    /// Against an obstacle of constant curvature, which all of them have: with the Hessian `h` of the gap
    /// `d(h t) = -(h^2 t n^T + n t^T h^2) dx` for a tangential `t`.
    pub fn of_obstacle(proximity: &Proximity<D>) -> Self {
        let (normal, hessian) = (proximity.normal, proximity.hessian);
        let tangents = tangents_of(&normal);
        let turn = |t: &Vector<D>| {
            let bent = hessian * (hessian * t);
            vec![-(bent * normal.transpose() + normal * bent.transpose())]
        };
        let turns = [turn(&tangents[0]), turn(&tangents[1])];
        Self { tangents, turns, beyond: Vec::new(), spins: None, positions: 1 }
    }

    /// `d/dz_b (dn/dz_a^T t)` for a tangential `t`, in its unit \[1/m^2\].
    pub fn of_normal(&self, t: &Vector<D>, a: usize, b: usize) -> Tensor<D> {
        let at = a * self.positions + b;
        let mut sum = Tensor::zeros();
        for (tangent, turns) in self.tangents.iter().zip(&self.turns).take(D - 1) {
            sum += turns[at] * tangent.dot(t);
        }
        sum
    }

    /// For each position `b` the tangential part of `d/dz_b sum_a dn/dz_a field_a`, the field given at the positions.
    pub fn of_turn(&self, field: &[Vector<D>]) -> Vec<Tensor<D>> {
        let mut out = vec![Tensor::zeros(); self.positions];
        for (tangent, turns) in self.tangents.iter().zip(&self.turns).take(D - 1) {
            for (out, row) in out.iter_mut().zip(contract(turns, field)) {
                *out += tangent * row.transpose();
            }
        }
        out
    }

    /// For each position `b` the `d/dz_b sum_a dg/dz_a . field_a` that `beyond` stands for.
    pub fn of_gap(&self, field: &[Vector<D>]) -> Vec<Vector<D>> {
        if self.beyond.is_empty() {
            return vec![Vector::zeros(); self.positions];
        }
        contract(&self.beyond, field)
    }

    /// Variations of arm and spin; none where there is no arm.
    pub fn spins(&self) -> Option<&Spins<D>> {
        self.spins.as_ref()
    }

    /// The block of the gap beyond an edge; zero over the facet.
    pub fn gap_block(&self, a: usize, b: usize) -> Tensor<D> {
        self.beyond.get(a * self.positions + b).copied().unwrap_or_else(Tensor::zeros)
    }
}

/// `sum_a blocks_ab^T field_a` for each `b`.
fn contract<const D: usize>(blocks: &[Tensor<D>], field: &[Vector<D>]) -> Vec<Vector<D>> {
    let count = field.len();
    let row = |b: usize| (0..count).map(|a| blocks[a * count + b].transpose() * field[a]).sum();
    (0..count).map(row).collect()
}

/// Unit vectors that span the tangent plane of the unit vector `normal`; the second zero in the plane.
pub(super) fn tangents_of<const D: usize>(normal: &Vector<D>) -> [Vector<D>; 2] {
    let axis = normal.iter().enumerate().min_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).map_or(0, |(i, _)| i);
    let mut across = Vector::<D>::zeros();
    across[axis] = 1.0;
    let first = (across - normal * normal[axis]).try_normalize(0.0).unwrap_or_else(Vector::zeros);
    if D == 2 {
        return [first, Vector::zeros()];
    }
    let second = Vector::<D>::from_fn(|i, _| {
        let (j, k) = ((i + 1) % D, (i + 2) % D);
        normal[j] * first[k] - normal[k] * first[j]
    });
    [first, second]
}
