//! Batches of four elements in lanes: their nodes at one or more displacements, and the data of a
//! sample. All kernels of a group iterate over batches and samples with this type.

use super::Inverted;
use super::group::{ElementGroup, Pass, Sampling};
use super::kinematics::{gradient_of, reference_map};
use crate::lanes::{Lane, WIDTH};
use crate::square::{Row, Square, apply_add, diagonal, product_transposed, scale, scale_all};

/// Geometry and displacements at one sample.
pub(super) struct Sample<L, const D: usize, const STATES: usize> {
    /// Reference volume of the sample \[m^D\].
    pub volume: L,
    /// Maps the slopes to reference gradients [1/m].
    pub map: Square<L, D>,
    /// Displacement gradient of each state.
    pub grad_u: [Square<L, D>; STATES],
}

/// The nodes of a batch. It is reused for all batches of a group and allocated once per evaluation.
pub(super) struct Batch<L, const D: usize, const STATES: usize> {
    points: Vec<Row<L, D>>,
    displacements: [Vec<Row<L, D>>; STATES],
    /// `dN_a/dxi` of the current sample, or mean gradients.
    pub slopes: Vec<Row<L, D>>,
    /// Integral of the gradients over the points so far, if a pass needs their mean.
    mean: Vec<Row<L, D>>,
    /// Volume of the points so far.
    volume: L,
}

impl<L: Lane, const D: usize, const STATES: usize> Batch<L, D, STATES> {
    #[inline(always)]
    pub fn new(unit: L, group: &ElementGroup<D>) -> Self {
        let n = group.kind.nodes();
        let zero = unit.constant(0.0);
        let rows = || vec![[zero; D]; n];
        let wants_mean = group.passes.iter().any(|pass| pass.sampling == Sampling::Mean);
        Self {
            points: rows(),
            displacements: std::array::from_fn(|_| rows()),
            slopes: rows(),
            mean: if wants_mean { rows() } else { Vec::new() },
            volume: zero,
        }
    }

    /// Loads a batch at the displacements `u` of each state.
    #[inline(always)]
    pub fn gather(
        &mut self,
        unit: L,
        nodes: &[[u32; WIDTH]],
        points: &[[[f64; WIDTH]; D]],
        u: [&[f64]; STATES],
    ) {
        let zero = unit.constant(0.0);
        for (a, (nodes, points)) in nodes.iter().zip(points).enumerate() {
            for i in 0..D {
                self.points[a][i] = unit.load(points[i]);
                for (displacements, u) in self.displacements.iter_mut().zip(u) {
                    let mut values = [0.0; WIDTH];
                    for lane in 0..WIDTH {
                        values[lane] = u[nodes[lane] as usize * D + i];
                    }
                    displacements[a][i] = unit.load(values);
                }
            }
        }
        self.mean.fill([zero; D]);
        self.volume = zero;
    }

    /// Displacements of the nodes in one of the states \[m\].
    #[inline(always)]
    pub fn displacements(&self, state: usize) -> &[Row<L, D>] {
        &self.displacements[state]
    }

    /// Reference position of a point of the rule of a pass \[m\].
    #[inline(always)]
    pub fn place(&self, unit: L, pass: &Pass, q: usize) -> Row<L, D> {
        let n = self.points.len();
        let mut place = [unit.constant(0.0); D];
        for (point, shape) in self.points.iter().zip(&pass.table.n[q * n..(q + 1) * n]) {
            for i in 0..D {
                place[i] = point[i].mul_add(unit.constant(*shape), place[i]);
            }
        }
        place
    }

    /// Moves to a sample: sets the slopes and returns the quantities that depend on geometry and
    /// displacement there.
    #[inline(always)]
    pub fn locate(&mut self, unit: L, pass: &Pass, q: usize) -> Sample<L, D, STATES> {
        // Explicit loops: closures passed to the standard library are compiled without the lane
        // instructions.
        let mut grad_u = [[[unit.constant(0.0); D]; D]; STATES];
        if pass.sampling == Sampling::Mean {
            let inverse = self.volume.recip();
            for (slope, mean) in self.slopes.iter_mut().zip(&self.mean) {
                *slope = scale(mean, inverse);
            }
            for (grad_u, displacements) in grad_u.iter_mut().zip(&self.displacements) {
                *grad_u = gradient_of(displacements, &self.slopes);
            }
            return Sample { volume: self.volume, map: diagonal(unit), grad_u };
        }
        for (slope, dn) in self.slopes.iter_mut().zip(pass.dn(q).as_chunks::<D>().0) {
            for k in 0..D {
                slope[k] = unit.constant(dn[k]);
            }
        }
        let (det, map) = reference_map(&gradient_of(&self.points, &self.slopes));
        for (grad_u, displacements) in grad_u.iter_mut().zip(&self.displacements) {
            *grad_u = product_transposed(&gradient_of(displacements, &self.slopes), &map);
        }
        let volume = unit.constant(pass.table.weights[q]) * det;
        if !self.mean.is_empty() {
            self.volume = self.volume + volume;
            let weighted = scale_all(&map, volume);
            for (mean, slope) in self.mean.iter_mut().zip(&self.slopes) {
                *mean = apply_add(&weighted, slope, mean);
            }
        }
        Sample { volume, map, grad_u }
    }
}

/// Checks a batch for elements that are inverted at a quadrature point, or beyond the limit of their
/// law. `det_f` and `reserve` are given at each point of all passes; `reserve` is empty for a law
/// without limit.
///
/// # Errors
/// The first such element.
#[inline(always)]
pub(super) fn check(
    det_f: &[[f64; WIDTH]],
    reserve: &[[f64; WIDTH]],
    elements: &[u32],
    passes: &[Pass],
) -> std::result::Result<(), Inverted> {
    if det_f.iter().chain(reserve).flatten().all(|&value| value > 0.0) {
        return Ok(());
    }
    inverted(det_f, reserve, elements, passes)
}

/// Returns the lowest element of the batch with a nonpositive value, and its first such point.
#[cold]
fn inverted(
    det_f: &[[f64; WIDTH]],
    reserve: &[[f64; WIDTH]],
    elements: &[u32],
    passes: &[Pass],
) -> std::result::Result<(), Inverted> {
    let points: Vec<_> = passes.iter().flat_map(|pass| &pass.points).collect();
    for (lane, &element) in elements.iter().enumerate() {
        for (number, (&&point, det_f)) in points.iter().zip(det_f).enumerate() {
            let det = det_f[lane];
            let reserve = reserve.get(number).map_or(1.0, |reserve| reserve[lane]);
            if !(det > 0.0 && reserve > 0.0) {
                return Err(Inverted { element, point, det, reserve });
            }
        }
    }
    Ok(())
}
