//! Second variations of the normal at a point: what the tangent of a lever needs.

use super::obstacle::Proximity;
use crate::tensor::{Tensor, Vector};

/// How the variation `dn/dx` changes with the position `x` of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curvature<const D: usize> {
    /// Unit tangents `e`, the second zero in the plane.
    tangents: [Vector<D>; 2],
    /// `d/dx (dn/dx^T e)` at fixed `e` \[1/m^2\], symmetric.
    turns: [Tensor<D>; 2],
}

impl<const D: usize> Curvature<D> {
    /// Against an obstacle of constant curvature, which all of them have: with the Hessian `h` of the gap
    /// `d(h t) = -(h^2 t n^T + n t^T h^2) dx` for a tangential `t`.
    pub fn of_obstacle(proximity: &Proximity<D>) -> Self {
        let (normal, hessian) = (proximity.normal, proximity.hessian);
        let tangents = tangents_of(&normal);
        let turns = tangents.map(|tangent| {
            let bent = hessian * (hessian * tangent);
            -(bent * normal.transpose() + normal * bent.transpose())
        });
        Self { tangents, turns }
    }

    /// `d/dx (dn/dx^T t)` for a tangential `t`, in its unit \[1/m^2\].
    pub fn of_normal(&self, t: &Vector<D>) -> Tensor<D> {
        let both = self.tangents.iter().zip(&self.turns).take(D - 1);
        both.map(|(tangent, turn)| turn * tangent.dot(t)).sum()
    }

    /// The tangential part of `d/dx (dn/dx field)`.
    pub fn of_turn(&self, field: &Vector<D>) -> Tensor<D> {
        let both = self.tangents.iter().zip(&self.turns).take(D - 1);
        both.map(|(tangent, turn)| tangent * (turn.transpose() * field).transpose()).sum()
    }
}

/// Unit vectors that span the tangent plane of the unit vector `normal`; the second zero in the plane.
fn tangents_of<const D: usize>(normal: &Vector<D>) -> [Vector<D>; 2] {
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
