//! Rigid motions of bodies that their supports leave: what may be free where contact does not resist it.
//!
//! A body moves as a rigid one by `t + w x (x - c)` about the centre `c` of its nodes: 3 motions in the plane, 6 in space.
//! Those combinations are left that vanish at all prescribed unknowns, at the present places of the nodes, or where
//! kinematics are linear at the first ones.

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;
use nalgebra::{DMatrix, SymmetricEigen};

use super::system::ContactSystem;
use crate::dynamics::{RigidMotion, Stage};
use crate::element::Kinematics;
use crate::error::Result;
use crate::model::Model;
use crate::petsc::Vector;

/// A body as its rigid motions are told.
pub(super) struct Named {
    name: String,
    kinematics: Kinematics,
}

impl Named {
    /// Name in the case file.
    pub fn name(&self) -> &str {
        &self.name
    }
}

/// Names and kinematics of the bodies of the model.
pub(super) fn named<const D: usize>(model: &Model<D>) -> Vec<Named> {
    let named = |body: &crate::model::Body| Named {
        name: body.name.clone(),
        kinematics: body.formulation.kinematics,
    };
    model.bodies.iter().map(named).collect()
}

/// A combination that a support feels by less than this part of its square is not held by it; rounding is below.
const UNFELT: f64 = 1e-12;

/// Rigid motions of a body in `D` dimensions.
const fn motions(dimension: usize) -> usize {
    dimension * (dimension + 1) / 2
}

/// Displacement at an arm from the centre in motion `k`: translations first, then rotations about z, or x, y, z.
fn displacement<const D: usize>(k: usize, arm: &[f64; D]) -> [f64; D] {
    let mut moved = [0.0; D];
    if k < D {
        moved[k] = 1.0;
        return moved;
    }
    let axis = if D == 2 { 2 } else { k - D };
    let (from, to) = ((axis + 1) % 3, (axis + 2) % 3);
    moved[to] = arm[from];
    moved[from] = -arm[to];
    moved
}

impl<const D: usize> ContactSystem<D> {
    /// Whether supports leave an undeformed body a rigid motion, if only to turn. Collective.
    pub(super) fn has_leeway(&self) -> bool {
        let places = self.places(&vec![0.0; self.local.mesh.points.len() * D]);
        self.combinations(&places, &self.centres(&places)).iter().any(|motions| motions.ncols() > 0)
    }

    /// The rigid motions that supports leave at the trial places; each body's are orthonormal. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub(super) fn rigid_at(&self, stage: &Stage) -> Result<Vec<RigidMotion>> {
        self.rigid(&stage.trial.u.local())
    }

    fn rigid(&self, u: &[f64]) -> Result<Vec<RigidMotion>> {
        let places = self.places(u);
        let centres = self.centres(&places);
        let mut found = Vec::new();
        for (body, combinations) in self.combinations(&places, &centres).iter().enumerate() {
            let (count, centre) = centres[body];
            for column in combinations.column_iter() {
                let mut field = Vector::new(&self.session, self.local.index.owned, D)?;
                {
                    let mut values = field.owned_mut();
                    for (node, place) in
                        places.iter().enumerate().filter(|(_, place)| place.body == Some(body))
                    {
                        let arm = std::array::from_fn(|i| place.at[i] - centre[i]);
                        for (k, factor) in column.iter().enumerate() {
                            let moved = displacement::<D>(k, &arm);
                            (0..D).for_each(|i| values[node * D + i] += factor * moved[i]);
                        }
                    }
                    let held = self.supports.dofs.constrained.iter();
                    values
                        .iter_mut()
                        .zip(held)
                        .filter(|(_, held)| **held)
                        .for_each(|(value, _)| *value = 0.0);
                }
                let mut shift = [0.0; 3];
                shift[..D].copy_from_slice(&column.as_slice()[..D]);
                let mut spin = [0.0; 3];
                let axes = if D == 2 { 2..3 } else { 0..3 };
                spin[axes].copy_from_slice(&column.as_slice()[D..]);
                let name = self.bodies[body].name.clone();
                found.push(RigidMotion { body, name, field, nodes: count, shift, spin });
            }
        }
        Ok(found)
    }

    /// Body and place of each owned node.
    fn places(&self, u: &[f64]) -> Vec<Place<D>> {
        let mesh = &self.local.mesh;
        let mut places = vec![Place { body: None, at: [0.0; D] }; self.local.index.owned];
        for element in 0..mesh.element_count() {
            let body = usize::from(mesh.body[element]);
            let moves = self.bodies[body].kinematics != Kinematics::Linear;
            for &node in mesh.element_nodes(element) {
                let node = node as usize;
                let Some(place) = places.get_mut(node) else { continue };
                let at = |i: usize| mesh.points[node][i] + if moves { u[node * D + i] } else { 0.0 };
                *place = Place { body: Some(body), at: std::array::from_fn(at) };
            }
        }
        places
    }

    /// Number and centre of the nodes of each body. Collective.
    fn centres(&self, places: &[Place<D>]) -> Vec<(f64, [f64; D])> {
        let mut own = vec![0.0; self.bodies.len() * (D + 1)];
        for place in places {
            let Some(body) = place.body else { continue };
            let sums = &mut own[body * (D + 1)..][..D + 1];
            sums[0] += 1.0;
            sums[1..].iter_mut().zip(place.at).for_each(|(sum, x)| *sum += x);
        }
        let mut all = vec![0.0; own.len()];
        self.session.world().all_reduce_into(&own[..], &mut all[..], SystemOperation::sum());
        let centre = |sums: &[f64]| (sums[0], std::array::from_fn(|i| sums[i + 1] / sums[0].max(1.0)));
        all.chunks_exact(D + 1).map(centre).collect()
    }

    /// For each body the combinations of its motions, as columns, that are orthonormal as fields and vanish at prescribed
    /// unknowns. Collective.
    fn combinations(&self, places: &[Place<D>], centres: &[(f64, [f64; D])]) -> Vec<DMatrix<f64>> {
        let (count, held) = (motions(D), &self.supports.dofs.constrained);
        // Products of the motions over all unknowns of a body, then over the prescribed ones; rotations by the extent, so that
        // all are of one size.
        let scale = |k: usize| if k < D { 1.0 } else { 1.0 / self.size };
        let mut own = vec![0.0; self.bodies.len() * 2 * count * count];
        for (node, place) in places.iter().enumerate() {
            let Some(body) = place.body else { continue };
            let arm = std::array::from_fn(|i| place.at[i] - centres[body].1[i]);
            let moved: Vec<[f64; D]> =
                (0..count).map(|k| displacement::<D>(k, &arm).map(|value| scale(k) * value)).collect();
            let products = &mut own[body * 2 * count * count..][..2 * count * count];
            for (k, l) in (0..count).flat_map(|k| (0..count).map(move |l| (k, l))) {
                for i in 0..D {
                    let product = moved[k][i] * moved[l][i];
                    products[k * count + l] += product;
                    products[count * count + k * count + l] += if held[node * D + i] { product } else { 0.0 };
                }
            }
        }
        let mut all = vec![0.0; own.len()];
        self.session.world().all_reduce_into(&own[..], &mut all[..], SystemOperation::sum());
        let of_body = |products: &[f64]| {
            let (whole, felt) = products.split_at(count * count);
            let mut left = unfelt(
                &DMatrix::from_row_slice(count, count, whole),
                &DMatrix::from_row_slice(count, count, felt),
            );
            for (k, mut row) in left.row_iter_mut().enumerate() {
                row *= scale(k);
            }
            left
        };
        all.chunks_exact(2 * count * count).map(of_body).collect()
    }

    /// `M n`, or `n` where there is no mass, zero in prescribed rows: what a motion weighs. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub(super) fn weigh_motion(&self, motion: &Vector, out: &mut Vector) -> Result<()> {
        match &self.mass {
            Some(mass) => mass.multiply(motion, out)?,
            None => out.copy_from(motion)?,
        }
        let mut values = out.owned_mut();
        let held = self.supports.dofs.constrained.iter();
        values.iter_mut().zip(held).filter(|(_, held)| **held).for_each(|(value, _)| *value = 0.0);
        Ok(())
    }
}

/// Where a node is, and whose it is.
#[derive(Clone)]
struct Place<const D: usize> {
    body: Option<usize>,
    at: [f64; D],
}

/// Columns `q`, orthonormal in `whole`, for which `q^T felt q` is zero.
fn unfelt(whole: &DMatrix<f64>, felt: &DMatrix<f64>) -> DMatrix<f64> {
    let eigen = SymmetricEigen::new(whole.clone());
    let largest = eigen.eigenvalues.iter().copied().fold(0.0, f64::max);
    let kept = (0..whole.nrows()).filter(|&k| eigen.eigenvalues[k] > UNFELT * largest);
    let columns: Vec<_> = kept.map(|k| eigen.eigenvectors.column(k) / eigen.eigenvalues[k].sqrt()).collect();
    if columns.is_empty() {
        return DMatrix::zeros(whole.nrows(), 0);
    }
    let basis = DMatrix::from_columns(&columns);
    let eigen = SymmetricEigen::new(basis.transpose() * felt * &basis);
    let free: Vec<_> = (0..basis.ncols())
        .filter(|&k| eigen.eigenvalues[k] <= UNFELT)
        .map(|k| &basis * eigen.eigenvectors.column(k))
        .collect();
    if free.is_empty() { DMatrix::zeros(whole.nrows(), 0) } else { DMatrix::from_columns(&free) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rotations are cross products: about z in the plane, about each axis in space.
    #[test]
    fn rotations_are_cross_products() {
        assert_eq!(displacement::<2>(2, &[1.0, 2.0]), [-2.0, 1.0]);
        let arm = [1.0, 2.0, 3.0];
        let axes = [[0.0, -3.0, 2.0], [3.0, 0.0, -1.0], [-2.0, 1.0, 0.0]];
        for (axis, expected) in axes.into_iter().enumerate() {
            assert_eq!(displacement::<3>(3 + axis, &arm), expected);
        }
    }

    /// A square of four nodes: free it has three motions, held along y two of them, pinned at a corner the turn about
    /// that, held at two corners none.
    #[test]
    fn supports_leave_what_they_do_not_feel() {
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let left = |held: &[(usize, usize)]| {
            let (mut whole, mut felt) = (DMatrix::zeros(3, 3), DMatrix::zeros(3, 3));
            for (node, arm) in corners.iter().enumerate() {
                let moved: Vec<[f64; 2]> = (0..3).map(|k| displacement::<2>(k, arm)).collect();
                for (k, l, i) in (0..18).map(|n| (n / 6, n / 2 % 3, n % 2)) {
                    whole[(k, l)] += moved[k][i] * moved[l][i];
                    if held.contains(&(node, i)) {
                        felt[(k, l)] += moved[k][i] * moved[l][i];
                    }
                }
            }
            unfelt(&whole, &felt)
        };
        assert_eq!(left(&[]).ncols(), 3);
        assert_eq!(left(&[(0, 1)]).ncols(), 2);
        let pinned = left(&[(0, 0), (0, 1)]);
        assert_eq!(pinned.ncols(), 1);
        // x = -w (y + 1), y = w (x + 1): the centre moves by (-w, w).
        let turn = pinned.column(0);
        assert!((turn[0] + turn[2]).abs() < 1e-12 && (turn[1] - turn[2]).abs() < 1e-12, "{turn}");
        assert_eq!(left(&[(0, 0), (0, 1), (1, 1)]).ncols(), 0);
    }
}
