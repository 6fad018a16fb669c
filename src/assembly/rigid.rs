//! Strain-free motions that supports allow. They may be free if contact does not resist them.
//!
//! A piece of a body moves as a rigid body by `t + w x (x - c)` about the centre `c` of its nodes,
//! with 3 motions in 2D and 6 in 3D. The allowed combinations vanish at all prescribed unknowns, do
//! not strain foundations, springs and periodic sides, and pieces that share a node move it equally. They
//! use the current positions of the nodes, or the initial ones if kinematics are linear. In axisymmetry
//! only the translation along the axis is free of strain.

use mpi::collective::SystemOperation;
use nalgebra::{Cholesky, DMatrix, SymmetricEigen};

use super::bodies::Bodies;
use crate::collective::Collective;
use crate::dynamics::{MovingPart, RigidMotion};
use crate::element::Kinematics;
use crate::error::Result;
use crate::petsc::Vector;

/// Relative square below which a support does not resist a combination. Rounding is below it.
const UNFELT: f64 = 1e-12;

/// The motion along the axis of revolution in axisymmetry.
const AXIS: usize = 1;

/// Number of rigid motions of a body in `D` dimensions.
const fn motions(dimension: usize) -> usize {
    dimension * (dimension + 1) / 2
}

/// Displacement at an arm from the centre in motion `k`: translations first, then rotations about
/// z, or x, y, z.
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

impl<const D: usize> Bodies<D> {
    /// For each group of pieces, the number of motions that supports allow in the undeformed state,
    /// including rotations only. Collective.
    pub(super) fn allowed_motions(&self) -> Vec<usize> {
        let at_rest = vec![0.0; self.local.mesh.points.len() * D];
        let places = self.places(&at_rest);
        let combinations = self.combinations(&at_rest, &places, &self.centres(&places));
        combinations.iter().map(|found| found.motions.ncols()).collect()
    }

    /// Computes the strain-free motions that supports allow at the displacement `u` \[m\]. Those of
    /// each group are orthonormal. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub(super) fn free_motions(&self, u: &[f64]) -> Result<Vec<RigidMotion>> {
        let count = motions(D);
        let places = self.places(u);
        let centres = self.centres(&places);
        let mut found = Vec::new();
        for (group, left) in self.combinations(u, &places, &centres).iter().enumerate() {
            let pieces = &self.pieces.groups[group];
            for column in left.motions.column_iter() {
                let of = |piece: usize| {
                    let member = pieces.binary_search(&piece).ok()?;
                    Some(&column.as_slice()[member * count..][..count])
                };
                let mut field = Vector::new(&self.session, self.local.index.owned, D)?;
                {
                    let mut values = field.owned_mut();
                    for (node, place) in places.iter().enumerate() {
                        let Some((piece, factors)) = place.piece.and_then(|p| Some((p, of(p)?))) else {
                            continue;
                        };
                        let arm = place.arm(&centres[piece].at);
                        for (k, factor) in factors.iter().enumerate() {
                            let moved = displacement::<D>(k, &arm);
                            (0..D).for_each(|i| values[node * D + i] += factor * moved[i]);
                        }
                    }
                    self.held().clear(&mut values);
                }
                let part = |(member, &piece): (usize, &usize)| {
                    let factors = &column.as_slice()[member * count..][..count];
                    let mut shift = [0.0; 3];
                    shift[..D].copy_from_slice(&factors[..D]);
                    let mut spin = [0.0; 3];
                    let axes = if D == 2 { 2..3 } else { 0..3 };
                    spin[axes].copy_from_slice(&factors[D..]);
                    let name = self.pieces.name(piece);
                    let nodes = centres[piece].nodes;
                    MovingPart { name, nodes, spread: left.spreads[member], shift, spin }
                };
                let parts = pieces.iter().enumerate().map(part).collect();
                found.push(RigidMotion { group, field, parts });
            }
        }
        Ok(found)
    }

    /// Piece and position of each owned node. If it belongs to several pieces, the one with the
    /// lowest index.
    fn places(&self, u: &[f64]) -> Vec<Place<D>> {
        let mesh = &self.local.mesh;
        let mut places = vec![Place { piece: None, at: [0.0; D] }; self.local.index.owned];
        for element in 0..mesh.element_count() {
            let piece = mesh.piece[element] as usize;
            for &node in mesh.element_nodes(element) {
                let node = node as usize;
                let Some(place) = places.get_mut(node) else { continue };
                if place.piece.is_some_and(|known| known <= piece) {
                    continue;
                }
                *place = self.place(node, piece, u);
            }
        }
        places
    }

    /// Position of a local node that belongs to this piece.
    fn place(&self, node: usize, piece: usize, u: &[f64]) -> Place<D> {
        let moves = self.names[self.pieces.all[piece].body].kinematics != Kinematics::Linear;
        let at = |i: usize| self.local.mesh.points[node][i] + if moves { u[node * D + i] } else { 0.0 };
        Place { piece: Some(piece), at: std::array::from_fn(at) }
    }

    /// Owned nodes with each piece that contains them.
    fn members<'a>(&'a self, places: &'a [Place<D>]) -> impl Iterator<Item = (usize, usize)> + 'a {
        let own = places.iter().enumerate().filter_map(|(node, place)| Some((node, place.piece?)));
        let more = self
            .pieces
            .hinges
            .iter()
            .flat_map(|(node, pieces)| pieces[1..].iter().map(move |&piece| (*node as usize, piece)));
        own.chain(more)
    }

    /// Number and centre of the nodes of each piece. Collective.
    fn centres(&self, places: &[Place<D>]) -> Vec<Centre<D>> {
        let mut own = vec![0.0; self.pieces.all.len() * (D + 1)];
        for (node, piece) in self.members(places) {
            let sums = &mut own[piece * (D + 1)..][..D + 1];
            sums[0] += 1.0;
            sums[1..].iter_mut().zip(places[node].at).for_each(|(sum, x)| *sum += x);
        }
        let mut all = vec![0.0; own.len()];
        self.session.world().reduce_all(&own[..], &mut all[..], SystemOperation::sum());
        let centre = |sums: &[f64]| Centre {
            nodes: sums[0],
            at: std::array::from_fn(|i| sums[i + 1] / sums[0].max(1.0)),
        };
        all.chunks_exact(D + 1).map(centre).collect()
    }

    /// Finds for each group the combinations of the motions of its pieces that are orthonormal as
    /// fields, vanish at prescribed unknowns, do not strain foundations and springs, and agree at nodes
    /// that pieces share. Collective.
    fn combinations(&self, u: &[f64], places: &[Place<D>], centres: &[Centre<D>]) -> Vec<Combinations> {
        let count = motions(D);
        let held = self.held();
        let is_revolved = self.local.mesh.plane.is_revolved();
        // Rotations are scaled by the extent, so that all motions have similar size.
        let scale = |k: usize| if k < D { 1.0 } else { 1.0 / self.extent.size };
        let widths: Vec<usize> = self.pieces.groups.iter().map(|pieces| pieces.len() * count).collect();
        let starts: Vec<usize> = widths
            .iter()
            .scan(0, |next, width| {
                let start = *next;
                *next += 3 * width * width;
                Some(start)
            })
            .collect();
        let total: usize = widths.iter().map(|width| 3 * width * width).sum();
        // Products of the motions of each group: over the unknowns of all pieces, over those of all
        // nodes once, and over the constraints, foundations and springs.
        let mut own = vec![0.0; total];
        let moved = |node: usize, piece: usize| -> Vec<[f64; D]> {
            let arm = places[node].arm(&centres[piece].at);
            (0..count).map(|k| displacement::<D>(k, &arm).map(|value| scale(k) * value)).collect()
        };
        let first = |piece: usize| {
            let group = self.pieces.all[piece].group;
            let member = self.pieces.groups[group].binary_search(&piece).unwrap_or(0);
            (group, member * count)
        };
        let mut add = |group: usize, kind: usize, terms: &[(usize, f64)]| {
            let width = widths[group];
            let products = &mut own[starts[group] + kind * width * width..][..width * width];
            for &(k, a) in terms {
                for &(l, b) in terms {
                    products[k * width + l] += a * b;
                }
            }
        };
        for (node, piece) in self.members(places) {
            let (group, begin) = first(piece);
            let moved = moved(node, piece);
            if is_revolved {
                // Only the translation along the axis does not strain rings.
                (0..count).filter(|&k| k != AXIS).for_each(|k| add(group, 2, &[(begin + k, 1.0)]));
            }
            for i in 0..D {
                let terms: Vec<(usize, f64)> = (0..count).map(|k| (begin + k, moved[k][i])).collect();
                add(group, 0, &terms);
                if places[node].piece == Some(piece) {
                    add(group, 1, &terms);
                    if held.axes()[node * D + i] {
                        add(group, 2, &terms);
                    }
                }
            }
            if let Some(free) = held.inclination(node).filter(|_| places[node].piece == Some(piece)) {
                for (i, free) in free.iter().enumerate() {
                    let part = |k: usize| moved[k][i] - (0..D).map(|j| free[j] * moved[k][j]).sum::<f64>();
                    add(group, 2, &(0..count).map(|k| (begin + k, part(k))).collect::<Vec<_>>());
                }
            }
        }
        for (node, pieces) in &self.pieces.hinges {
            let node = *node as usize;
            let (group, begin) = first(pieces[0]);
            let one = moved(node, pieces[0]);
            for &piece in &pieces[1..] {
                let other = moved(node, piece);
                let start = first(piece).1;
                for i in 0..D {
                    let apart = (0..count).map(|k| (begin + k, one[k][i]));
                    let terms: Vec<_> = apart.chain((0..count).map(|k| (start + k, -other[k][i]))).collect();
                    add(group, 2, &terms);
                }
            }
        }
        for restraint in self.ties.restraints() {
            // All nodes of periodic sides belong to one piece, and the rank owns the first of them.
            let Some(piece) = places.get(restraint.nodes[0] as usize).and_then(|place| place.piece) else {
                continue;
            };
            let (group, begin) = first(piece);
            let mut apart = vec![[0.0; D]; count];
            for (&node, weight) in restraint.nodes.iter().zip(restraint.weights) {
                let arm = self.place(node as usize, piece, u).arm(&centres[piece].at);
                for (k, apart) in apart.iter_mut().enumerate() {
                    let moved = displacement::<D>(k, &arm);
                    (0..D).for_each(|i| apart[i] += weight / restraint.area * scale(k) * moved[i]);
                }
            }
            for i in 0..D {
                let terms: Vec<_> = (0..count).map(|k| (begin + k, apart[k][i])).collect();
                add(group, 2, &terms);
            }
        }
        for felt in self.elastic.felt().filter(|felt| felt.counted) {
            let piece = match felt.element {
                Some(element) => Some(self.local.mesh.piece[element as usize] as usize),
                None => places[felt.nodes[0] as usize].piece,
            };
            let Some(piece) = piece else { continue };
            let (group, begin) = first(piece);
            let width = widths[group];
            let products = &mut own[starts[group] + 2 * width * width..][..width * width];
            let moved: Vec<Vec<[f64; D]>> = felt
                .nodes
                .iter()
                .map(|&node| {
                    let arm = self.place(node as usize, piece, u).arm(&centres[piece].at);
                    (0..count).map(|k| displacement::<D>(k, &arm).map(|value| scale(k) * value)).collect()
                })
                .collect();
            for (pair, block) in felt.matrix.chunks_exact(D * D).enumerate() {
                let [a, b] = [pair / felt.nodes.len(), pair % felt.nodes.len()];
                for (k, l) in (0..count * count).map(|kl| (kl / count, kl % count)) {
                    let sum: f64 =
                        (0..D * D).map(|ij| moved[a][k][ij / D] * block[ij] * moved[b][l][ij % D]).sum();
                    products[(begin + k) * width + begin + l] += sum;
                }
            }
        }
        let mut all = vec![0.0; own.len()];
        self.session.world().reduce_all(&own[..], &mut all[..], SystemOperation::sum());
        let of_group = |(&start, &width): (&usize, &usize)| {
            let matrix = |kind: usize| {
                DMatrix::from_row_slice(width, width, &all[start + kind * width * width..][..width * width])
            };
            let [members, whole, felt] = [matrix(0), matrix(1), matrix(2)];
            let mut left = unfelt(&members, &felt);
            if width > count {
                left = orthonormal(&left, &whole);
            }
            for (k, mut row) in left.row_iter_mut().enumerate() {
                row *= scale(k % count);
            }
            let turns = count - D;
            let spread = |member: usize| {
                let entry = |k: usize| members[(member * count + k, member * count + k)] / scale(k).powi(2);
                (D..count).map(entry).sum::<f64>() / turns as f64
            };
            Combinations { motions: left, spreads: (0..width / count).map(spread).collect() }
        };
        starts.iter().zip(&widths).map(of_group).collect()
    }
}

/// Position of a node, and its piece.
#[derive(Clone)]
struct Place<const D: usize> {
    piece: Option<usize>,
    at: [f64; D],
}

impl<const D: usize> Place<D> {
    /// Vector from a centre to the node \[m\].
    fn arm(&self, centre: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|i| self.at[i] - centre[i])
    }
}

/// Number and centre of the nodes of a piece.
struct Centre<const D: usize> {
    nodes: f64,
    at: [f64; D],
}

/// Motions of a group.
struct Combinations {
    /// Factors of the motions of its pieces, one motion per column.
    motions: DMatrix<f64>,
    /// Spread of each piece, see [`MovingPart::spread`].
    spreads: Vec<f64>,
}

/// Columns with the same span that are orthonormal in `whole`.
fn orthonormal(columns: &DMatrix<f64>, whole: &DMatrix<f64>) -> DMatrix<f64> {
    let products = columns.transpose() * whole * columns;
    match Cholesky::new(products).and_then(|root| root.l().try_inverse()) {
        Some(mixed) => columns * mixed.transpose(),
        None => columns.clone(),
    }
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

    /// Rotations are cross products: about z in 2D, about each axis in 3D.
    #[test]
    fn rotations_are_cross_products() {
        assert_eq!(displacement::<2>(2, &[1.0, 2.0]), [-2.0, 1.0]);
        let arm = [1.0, 2.0, 3.0];
        let axes = [[0.0, -3.0, 2.0], [3.0, 0.0, -1.0], [-2.0, 1.0, 0.0]];
        for (axis, expected) in axes.into_iter().enumerate() {
            assert_eq!(displacement::<3>(3 + axis, &arm), expected);
        }
    }

    /// A square of four nodes has three motions when free and two when held along y. Pinned at a
    /// corner, it has the rotation about that corner. Held at two corners, it has no motion.
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
