//! The stiffness of a batch: its terms at one sample, their sum over the samples, and its output.
//!
//! Only blocks `b >= a` are summed; the others are added by symmetry in the output.

use crate::lanes::{Lane, WIDTH};
use crate::material::{Metric, MetricLaw, MetricResponse, Moduli};
use crate::square::{
    Row, Square, apply, congruent, dot, inner_gram, outer_gram, product, scale, scale_add, scale_all,
    transpose,
};
use crate::terms::Terms;

/// Factors one or zero in lanes that select the requested parts of the stiffness.
#[derive(Clone, Copy)]
pub(super) struct Selected<L> {
    pub material: L,
    pub geometric: L,
}

impl<L: Lane> Selected<L> {
    #[inline(always)]
    pub fn new(unit: L, terms: Terms) -> Self {
        let switch = |term| unit.constant(if terms.contains(term) { 1.0 } else { 0.0 });
        Self { material: switch(Terms::MATERIAL), geometric: switch(Terms::GEOMETRIC) }
    }
}

/// Form in which the stiffness of a pass is summed.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// The stiffness itself.
    Sum,
    /// The factor `P` of `lambda P + mu P^T`.
    Factored,
}

/// The form of the first pass. The factored form requires constant moduli and an initially empty
/// sum.
pub(super) const fn first_form<P: MetricLaw>() -> Form {
    match P::METRIC {
        Metric::Current => Form::Sum,
        Metric::Reference | Metric::Linear => Form::Factored,
    }
}

/// The tangent at one sample in terms of the slopes `s_a`. It includes volumes and the selection
/// factors: `K_ab = lam h_a h_b^T + q h_b h_a^T + (s_a . metric s_b) pushed + (s_a . isotropic s_b)
/// 1`.
pub(super) struct Tangent<L, const D: usize> {
    lam: L,
    q: L,
    /// `h_a = map s_a`.
    map: Square<L, D>,
    isotropic: Square<L, D>,
    /// `metric` and `pushed` are used only with [`Metric::Reference`]. If `F m F^T = 1`, the metric
    /// is part of `isotropic`.
    metric: Square<L, D>,
    pushed: Square<L, D>,
}

impl<L: Lane, const D: usize> Tangent<L, D> {
    /// The tangent of a response at a sample, from the map of slopes to reference gradients and the
    /// volume.
    #[inline(always)]
    pub fn new<P: MetricLaw>(
        response: &MetricResponse<L, D>,
        map: &Square<L, D>,
        volume: L,
        wanted: Selected<L>,
    ) -> Self {
        let material = volume * wanted.material;
        let (lam, q) = (response.lam * material, response.q * material);
        let stress = scale_all(&response.second_piola, volume * wanted.geometric);
        let reference = scale_all(&inner_gram(map), q);
        let (map, isotropic) = match P::METRIC {
            Metric::Linear => (*map, reference),
            Metric::Reference => (product(&response.gradient_map, map), congruent(&stress, map)),
            Metric::Current => {
                let mut sum = inner_gram(&response.gradient_map);
                for i in 0..D {
                    for j in 0..D {
                        sum[i][j] = sum[i][j].mul_add(q, stress[i][j]);
                    }
                }
                (product(&response.gradient_map, map), congruent(&sum, map))
            }
        };
        Self { lam, q, map, isotropic, metric: reference, pushed: outer_gram(&response.gradient_map) }
    }

    /// The tangent with the terms symmetric in `i, j` multiplied by `factor`.
    #[inline(always)]
    pub fn over(self, factor: L) -> Self {
        let (isotropic, metric) = (scale_all(&self.isotropic, factor), scale_all(&self.metric, factor));
        Self { isotropic, metric, ..self }
    }
}

/// The stiffness of a batch during summation and output.
pub(super) struct Blocks<L, const D: usize> {
    /// `h_a`.
    pub mapped: Vec<Row<L, D>>,
    /// Blocks `(a, b)`, `b >= a`, row by row.
    upper: Vec<Square<L, D>>,
    /// Full matrices, one after the other.
    pub out: Vec<f64>,
}

impl<L: Lane, const D: usize> Blocks<L, D> {
    /// Blocks for elements of `n` nodes.
    #[inline(always)]
    pub fn new(unit: L, n: usize) -> Self {
        let zero = unit.constant(0.0);
        Self {
            mapped: vec![[zero; D]; n],
            upper: vec![[[zero; D]; D]; n * (n + 1) / 2],
            out: vec![0.0; WIDTH * n * n * D * D],
        }
    }

    /// Begins a batch.
    #[inline(always)]
    pub fn clear(&mut self, unit: L) {
        self.upper.fill([[unit.constant(0.0); D]; D]);
    }

    /// Adds `P_ab = weight h_a h_b^T` and, scaled by `1 / (lambda + mu)`, the terms symmetric in
    /// `i, j`. With constant moduli the stiffness is `lambda P + mu P^T` (3.14), which saves a
    /// third of the operations at the points.
    #[inline(always)]
    pub fn add_factored(&mut self, slopes: &[Row<L, D>], tangent: &Tangent<L, D>, weight: L, metric: Metric) {
        for (mapped, slope) in self.mapped.iter_mut().zip(slopes) {
            *mapped = apply(&tangent.map, slope);
        }
        let mut blocks = self.upper.iter_mut();
        for a in 0..slopes.len() {
            let h_a = scale(&self.mapped[a], weight);
            let isotropic_a = apply(&tangent.isotropic, &slopes[a]);
            let metric_a = apply(&tangent.metric, &slopes[a]);
            // The finite iterator goes first: a zip advances its first iterator once more than its
            // second.
            let partners = slopes[a..].iter().zip(&self.mapped[a..]);
            for ((slope_b, h_b), block) in partners.zip(blocks.by_ref()) {
                let isotropic = dot(&isotropic_a, slope_b);
                let strength = dot(&metric_a, slope_b);
                let mut sum = *block;
                for i in 0..D {
                    sum[i][i] = sum[i][i] + isotropic;
                    sum[i] = scale_add(h_b, h_a[i], &sum[i]);
                    if metric == Metric::Reference {
                        sum[i] = scale_add(&tangent.pushed[i], strength, &sum[i]);
                    }
                }
                *block = sum;
            }
        }
    }

    /// Completes a factored sum: `lambda P + mu P^T`.
    #[inline(always)]
    pub fn unfold(&mut self, moduli: &Moduli<L>) {
        for block in &mut self.upper {
            let factor = *block;
            for i in 0..D {
                for j in 0..D {
                    block[i][j] = moduli.lambda.mul_add(factor[i][j], moduli.mu * factor[j][i]);
                }
            }
        }
    }

    /// Adds the stiffness at one sample.
    #[inline(always)]
    pub fn add(&mut self, slopes: &[Row<L, D>], tangent: &Tangent<L, D>, metric: Metric) {
        for (mapped, slope) in self.mapped.iter_mut().zip(slopes) {
            *mapped = apply(&tangent.map, slope);
        }
        let both = tangent.lam + tangent.q;
        let mut blocks = self.upper.iter_mut();
        for a in 0..slopes.len() {
            let h_a = &self.mapped[a];
            let (lam_h, q_h, both_h) = (scale(h_a, tangent.lam), scale(h_a, tangent.q), scale(h_a, both));
            let isotropic_a = apply(&tangent.isotropic, &slopes[a]);
            let metric_a = apply(&tangent.metric, &slopes[a]);
            // The finite iterator goes first: a zip advances its first iterator once more than its
            // second.
            let partners = slopes[a..].iter().zip(&self.mapped[a..]);
            for ((slope_b, h_b), block) in partners.zip(blocks.by_ref()) {
                let isotropic = dot(&isotropic_a, slope_b);
                let mut sum = *block;
                for i in 0..D {
                    for j in 0..D {
                        sum[i][j] = if i == j {
                            both_h[i].mul_add(h_b[i], sum[i][i] + isotropic)
                        } else {
                            h_b[i].mul_add(q_h[j], lam_h[i].mul_add(h_b[j], sum[i][j]))
                        };
                    }
                }
                if metric == Metric::Reference {
                    let strength = dot(&metric_a, slope_b);
                    for i in 0..D {
                        sum[i] = scale_add(&tangent.pushed[i], strength, &sum[i]);
                    }
                }
                *block = sum;
            }
        }
    }

    /// Adds `K_ab = g_a . A g_b` with the reference gradients `g_a` and `A_iJkL` as
    /// `elasticity[i][k][L][J]`.
    #[inline(always)]
    pub fn add_elasticity(&mut self, gradients: &[Row<L, D>], elasticity: &[[Square<L, D>; D]; D]) {
        let mut blocks = self.upper.iter_mut();
        for a in 0..gradients.len() {
            let mut rows = elasticity[0];
            for i in 0..D {
                for k in 0..D {
                    rows[i][k] = apply(&elasticity[i][k], &gradients[a]);
                }
            }
            // The finite iterator goes first: a zip advances its first iterator once more than its
            // second.
            for (gradient, block) in gradients[a..].iter().zip(blocks.by_ref()) {
                let mut sum = *block;
                for i in 0..D {
                    for k in 0..D {
                        for l in 0..D {
                            sum[i][k] = rows[i][k][l].mul_add(gradient[l], sum[i][k]);
                        }
                    }
                }
                *block = sum;
            }
        }
    }

    /// Adds `weight (h_a h_b^T - h_b h_a^T)` for the mapped slopes `h_a`.
    #[inline(always)]
    pub fn add_skew(&mut self, weight: L) {
        let mut blocks = self.upper.iter_mut();
        for a in 0..self.mapped.len() {
            let h_a = scale(&self.mapped[a], weight);
            // The block (a, a) vanishes.
            blocks.next();
            for (h_b, block) in self.mapped[a + 1..].iter().zip(blocks.by_ref()) {
                for i in 0..D {
                    for j in i + 1..D {
                        let entry = h_a[i].mul_add(h_b[j], -(h_a[j] * h_b[i]));
                        block[i][j] = block[i][j] + entry;
                        block[j][i] = block[j][i] - entry;
                    }
                }
            }
        }
    }

    /// Adds `(s_a . metric s_b) 1`.
    #[inline(always)]
    pub fn add_isotropic(&mut self, slopes: &[Row<L, D>], metric: &Square<L, D>) {
        let mut blocks = self.upper.iter_mut();
        for a in 0..slopes.len() {
            let metric_a = apply(metric, &slopes[a]);
            for (slope_b, block) in slopes[a..].iter().zip(blocks.by_ref()) {
                let isotropic = dot(&metric_a, slope_b);
                for i in 0..D {
                    block[i][i] = block[i][i] + isotropic;
                }
            }
        }
    }

    /// Adds `h_a r_b^T` for mapped slopes `h_a` and rows `r_b` whose sums over all calls are symmetric.
    #[inline(always)]
    pub fn add_outer(&mut self, rows: &[Row<L, D>]) {
        let mut blocks = self.upper.iter_mut();
        for a in 0..rows.len() {
            let h_a = self.mapped[a];
            for (row, block) in rows[a..].iter().zip(blocks.by_ref()) {
                for i in 0..D {
                    block[i] = scale_add(row, h_a[i], &block[i]);
                }
            }
        }
    }

    /// Adds `sum_m stresses_a[i][m] strains_b[k][m]`, which is symmetric under an exchange of `(a, i)` and
    /// `(b, k)`.
    #[inline(always)]
    pub fn add_strain_products<const M: usize>(
        &mut self,
        stresses: &[[Row<L, M>; D]],
        strains: &[[Row<L, M>; D]],
    ) {
        let mut blocks = self.upper.iter_mut();
        for a in 0..strains.len() {
            for (strain, block) in strains[a..].iter().zip(blocks.by_ref()) {
                for i in 0..D {
                    for k in 0..D {
                        block[i][k] = block[i][k] + dot(&stresses[a][i], &strain[k]);
                    }
                }
            }
        }
    }

    /// Adds `weight n_a n_b` to the radial entries, for the ratios `n_a` of shape functions to the radius.
    #[inline(always)]
    pub fn add_radial(&mut self, ratios: &[L], weight: L) {
        let mut blocks = self.upper.iter_mut();
        for a in 0..ratios.len() {
            let n_a = ratios[a] * weight;
            for (n_b, block) in ratios[a..].iter().zip(blocks.by_ref()) {
                block[0][0] = n_a.mul_add(*n_b, block[0][0]);
            }
        }
    }

    /// Adds `weight (h_a (x) n_b e_r + n_a e_r (x) h_b)` for the mapped slopes `h_a` and the radial direction
    /// `e_r`.
    #[inline(always)]
    pub fn add_radial_cross(&mut self, ratios: &[L], weight: L) {
        let mut blocks = self.upper.iter_mut();
        for a in 0..ratios.len() {
            let n_a = ratios[a] * weight;
            let h_a = scale(&self.mapped[a], weight);
            let partners = ratios[a..].iter().zip(&self.mapped[a..]);
            for ((n_b, h_b), block) in partners.zip(blocks.by_ref()) {
                for i in 0..D {
                    block[i][0] = h_a[i].mul_add(*n_b, block[i][0]);
                    block[0][i] = n_a.mul_add(h_b[i], block[0][i]);
                }
            }
        }
    }

    /// Expands upper blocks in lanes to full matrices, one after the other.
    #[inline(always)]
    pub fn spread(&mut self) {
        // Blocks as arrays: their size must be known at compile time for the copies to become
        // vector moves.
        match D {
            2 => self.spread_blocks::<4>(),
            _ => self.spread_blocks::<9>(),
        }
    }

    #[inline(always)]
    fn spread_blocks<const SIZE: usize>(&mut self) {
        let n = self.mapped.len();
        let (blocks, _) = self.out.as_chunks_mut::<SIZE>();
        let (front, back) = blocks.split_at_mut(2 * n * n);
        let ((first, second), (third, fourth)) = (front.split_at_mut(n * n), back.split_at_mut(n * n));
        let mut matrices = [first, second, third, fourth];
        let mut upper = self.upper.iter();
        for a in 0..n {
            for (b, block) in (a..n).zip(upper.by_ref()) {
                write_block(block, a * n + b, &mut matrices);
                if a != b {
                    write_block(&transpose(block), b * n + a, &mut matrices);
                }
            }
        }
    }
}

/// Writes a block as number `at` of each lane's matrix.
#[inline(always)]
fn write_block<L: Lane, const D: usize, const SIZE: usize>(
    block: &Square<L, D>,
    at: usize,
    matrices: &mut [&mut [[f64; SIZE]]; WIDTH],
) {
    let entries = block.as_flattened();
    let mut rows = [[0.0; SIZE]; WIDTH];
    for first in (0..SIZE / WIDTH * WIDTH).step_by(WIDTH) {
        let four = L::transpose([entries[first], entries[first + 1], entries[first + 2], entries[first + 3]]);
        for lane in 0..WIDTH {
            rows[lane][first..first + WIDTH].copy_from_slice(&four[lane]);
        }
    }
    for rest in SIZE / WIDTH * WIDTH..SIZE {
        let lanes = entries[rest].lanes();
        for lane in 0..WIDTH {
            rows[lane][rest] = lanes[lane];
        }
    }
    for (matrix, row) in matrices.iter_mut().zip(rows) {
        matrix[at] = row;
    }
}
