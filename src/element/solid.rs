//! The solid kernel: internal force `Q`, `K_0 + K_NL` and `K_S` of a group, four elements a time.
//!
//! With a tangent `C = lam m (x) m + 2 q I_m`, reference gradients `g_a` of the shape functions and `h_a = F m g_a`
//! the strain operator drops out of `int B*^T C B* + K_S`:
//!
//! `K_ab = int lam h_a h_b^T + q h_b h_a^T + q (g_a . m g_b) F m F^T + (g_a . S g_b) 1`,
//!
//! a third of the work of the textbook product. Only blocks `b >= a` are summed; the others are mirrored.

use std::marker::PhantomData;

use super::group::{ElementGroup, Pass, Sampling};
use super::kinematics::{Kinematics, displacement_gradient, reference_gradients};
use super::{ElementSink, Inverted, Request};
use crate::lanes::{Lane, LaneTask, WIDTH, dispatch};
use crate::material::{Hooke, Law, Metric, Model, Moduli, NeoHookean, Response, SaintVenantKirchhoff};
use crate::square::{Row, Square, apply, diagonal, dot, inner_gram, outer_gram, scale};
use crate::terms::Terms;

/// One evaluation of a group.
pub(super) struct Job<'a, const D: usize> {
    pub group: &'a ElementGroup<D>,
    pub u: &'a [f64],
    pub request: Request,
    pub sink: &'a mut dyn ElementSink,
}

impl<const D: usize> ElementGroup<D> {
    /// Internal force (and, as requested, its derivative) of each element at the nodal displacements `u`
    /// (`u[node * D + i]`, local nodes, [m]).
    ///
    /// The same element gives the same bits in any group on the same processor.
    ///
    /// # Errors
    /// The first element of the group with `det F <= 0` or NaN at a quadrature point; the sink has then seen a part of
    /// the group and what it holds is void.
    pub fn evaluate(
        &self,
        u: &[f64],
        request: Request,
        sink: &mut dyn ElementSink,
    ) -> std::result::Result<(), Inverted> {
        let job = Job { group: self, u, request, sink };
        match (self.formulation.kinematics, self.formulation.material.model) {
            (Kinematics::Linear, _) => dispatch(Solid::<Hooke, D>::new(job)),
            (Kinematics::Finite, Model::SaintVenantKirchhoff) => {
                dispatch(Solid::<SaintVenantKirchhoff, D>::new(job))
            }
            (Kinematics::Finite, Model::NeoHookean) => dispatch(Solid::<NeoHookean, D>::new(job)),
        }
    }
}

/// A job whose law is known to the compiler.
pub(super) struct Solid<'a, P, const D: usize>(Job<'a, D>, PhantomData<P>);

impl<'a, P, const D: usize> Solid<'a, P, D> {
    pub fn new(job: Job<'a, D>) -> Self {
        Self(job, PhantomData)
    }
}

impl<P: Law, const D: usize> LaneTask for Solid<'_, P, D> {
    type Output = std::result::Result<(), Inverted>;

    #[inline(always)]
    fn run<L: Lane>(self, unit: L) -> Self::Output {
        let Job { group, u, request, sink } = self.0;
        let n = group.kind.nodes();
        let wanted = request.stiffness.map(|terms| Wanted::new(unit, terms));
        let mut work = Workspace::<L, D>::new(unit, group);
        let batches = group.elements.chunks(WIDTH).zip(group.nodes.chunks_exact(n));
        for (batch, ((elements, nodes), points)) in batches.zip(group.points.chunks_exact(n)).enumerate() {
            work.gather(unit, nodes, points, u);
            let mut point = 0;
            for pass in &group.passes {
                let moduli = pass.moduli.in_lanes(unit);
                for q in 0..pass.samples() {
                    let volume = work.locate(unit, pass, q);
                    let det_f = work.add_law::<P>(volume, &moduli, wanted);
                    work.det_f[point] = det_f.lanes();
                    point += 1;
                }
            }
            work.check(elements, &group.passes)?;
            work.emit(batch * WIDTH, elements.len(), wanted.is_some(), sink);
        }
        Ok(())
    }
}

/// One or zero in lanes: which parts of the stiffness are wanted.
#[derive(Clone, Copy)]
struct Wanted<L> {
    material: L,
    geometric: L,
}

impl<L: Lane> Wanted<L> {
    #[inline(always)]
    fn new(unit: L, terms: Terms) -> Self {
        let switch = |term| unit.constant(if terms.contains(term) { 1.0 } else { 0.0 });
        Self { material: switch(Terms::MATERIAL), geometric: switch(Terms::GEOMETRIC) }
    }
}

/// Everything that the loop over a group writes to; allocated once per evaluation.
struct Workspace<L, const D: usize> {
    points: Vec<Row<L, D>>,
    displacements: Vec<Row<L, D>>,
    gradients: Vec<Row<L, D>>,
    /// `h_a`.
    mapped: Vec<Row<L, D>>,
    force: Vec<Row<L, D>>,
    /// Integral of the gradients over the points so far, where a pass wants their mean.
    mean: Vec<Row<L, D>>,
    /// Volume of the points so far.
    volume: L,
    /// Blocks `(a, b)`, `b >= a`, row by row.
    upper: Vec<Square<L, D>>,
    /// For each quadrature point of all passes.
    det_f: Vec<[f64; WIDTH]>,
    force_out: Vec<f64>,
    stiffness_out: Vec<f64>,
}

impl<L: Lane, const D: usize> Workspace<L, D> {
    #[inline(always)]
    fn new(unit: L, group: &ElementGroup<D>) -> Self {
        let n = group.kind.nodes();
        let zero = unit.constant(0.0);
        let rows = || vec![[zero; D]; n];
        Self {
            points: rows(),
            displacements: rows(),
            gradients: rows(),
            mapped: rows(),
            force: rows(),
            mean: if group.passes.iter().any(|pass| pass.sampling == Sampling::Mean) {
                rows()
            } else {
                Vec::new()
            },
            volume: zero,
            upper: vec![[[zero; D]; D]; n * (n + 1) / 2],
            det_f: vec![[0.0; WIDTH]; group.passes.iter().map(Pass::samples).sum()],
            force_out: vec![0.0; WIDTH * n * D],
            stiffness_out: vec![0.0; WIDTH * n * n * D * D],
        }
    }

    /// Fetches a batch and clears the sums.
    #[inline(always)]
    fn gather(&mut self, unit: L, nodes: &[[u32; WIDTH]], points: &[[[f64; WIDTH]; D]], u: &[f64]) {
        let zero = unit.constant(0.0);
        for (a, (nodes, points)) in nodes.iter().zip(points).enumerate() {
            for i in 0..D {
                self.points[a][i] = unit.load(points[i]);
                let mut values = [0.0; WIDTH];
                for lane in 0..WIDTH {
                    values[lane] = u[nodes[lane] as usize * D + i];
                }
                self.displacements[a][i] = unit.load(values);
            }
            self.force[a] = [zero; D];
        }
        self.upper.fill([[zero; D]; D]);
        self.mean.fill([zero; D]);
        self.volume = zero;
    }

    /// Sets the gradients to those of a sample and returns its volume.
    #[inline(always)]
    fn locate(&mut self, unit: L, pass: &Pass, q: usize) -> L {
        if pass.sampling == Sampling::Mean {
            let inverse = self.volume.recip();
            for (gradient, mean) in self.gradients.iter_mut().zip(&self.mean) {
                *gradient = scale(mean, inverse);
            }
            return self.volume;
        }
        let det = reference_gradients(&self.points, pass.dn(q), &mut self.gradients);
        let volume = unit.constant(pass.table.weights[q]) * det;
        self.volume = self.volume + volume;
        // Empty where nothing asks for the mean.
        for (mean, gradient) in self.mean.iter_mut().zip(&self.gradients) {
            for i in 0..D {
                mean[i] = gradient[i].mul_add(volume, mean[i]);
            }
        }
        volume
    }

    /// Adds one sample; returns `det F` there.
    #[inline(always)]
    fn add_law<P: Law>(&mut self, volume: L, moduli: &Moduli<L>, wanted: Option<Wanted<L>>) -> L {
        let grad_u = displacement_gradient(&self.displacements, &self.gradients);
        let response = P::respond(moduli, &grad_u);
        let mut piola = response.first_piola;
        for row in &mut piola {
            *row = scale(row, volume);
        }
        for (force, gradient) in self.force.iter_mut().zip(&self.gradients) {
            for i in 0..D {
                force[i] = force[i] + dot(&piola[i], gradient);
            }
        }
        if let Some(wanted) = wanted {
            self.add_stiffness::<P>(&response, volume, wanted);
        }
        response.det_f
    }

    #[inline(always)]
    fn add_stiffness<P: Law>(&mut self, response: &Response<L, D>, volume: L, wanted: Wanted<L>) {
        let lam = response.lam * volume * wanted.material;
        let q = response.q * volume * wanted.material;
        let scalar = scalar_metric::<L, P, D>(response, q, volume * wanted.geometric);
        let pushed = outer_gram(&response.gradient_map);
        for (mapped, gradient) in self.mapped.iter_mut().zip(&self.gradients) {
            *mapped =
                if P::METRIC == Metric::Linear { *gradient } else { apply(&response.gradient_map, gradient) };
        }
        let mut blocks = self.upper.iter_mut();
        for a in 0..self.gradients.len() {
            let (g_a, h_a) = (&self.gradients[a], &self.mapped[a]);
            let (lam_h, q_h, q_g) = (scale(h_a, lam), scale(h_a, q), scale(g_a, q));
            let scalar_g = apply(&scalar, g_a);
            // The finite iterator goes first: a zip asks its first half once more than its second.
            let partners = self.gradients[a..].iter().zip(&self.mapped[a..]);
            for ((g_b, h_b), block) in partners.zip(blocks.by_ref()) {
                let isotropic = dot(&scalar_g, g_b);
                let metric = dot(&q_g, g_b);
                for i in 0..D {
                    for j in 0..D {
                        let mut entry = lam_h[i].mul_add(h_b[j], block[i][j]);
                        entry = h_b[i].mul_add(q_h[j], entry);
                        if P::METRIC == Metric::Reference {
                            entry = metric.mul_add(pushed[i][j], entry);
                        }
                        block[i][j] = if i == j { entry + isotropic } else { entry };
                    }
                }
            }
        }
    }

    /// Finds the first element of the batch that is inverted at a quadrature point.
    #[inline(always)]
    fn check(&self, elements: &[u32], passes: &[Pass]) -> std::result::Result<(), Inverted> {
        if self.det_f.iter().flatten().all(|&det| det > 0.0) {
            return Ok(());
        }
        inverted(&self.det_f, elements, passes)
    }

    /// Hands the real lanes of a batch to the sink.
    #[inline(always)]
    fn emit(&mut self, first: usize, count: usize, stiffness: bool, sink: &mut dyn ElementSink) {
        let n = self.force.len();
        for (a, force) in self.force.iter().enumerate() {
            for i in 0..D {
                let lanes = force[i].lanes();
                for lane in 0..WIDTH {
                    self.force_out[(lane * n + a) * D + i] = lanes[lane];
                }
            }
        }
        if stiffness {
            self.spread();
        }
        let (forces, blocks) = (n * D, n * n * D * D);
        for lane in 0..count {
            let matrix = &self.stiffness_out[lane * blocks..(lane + 1) * blocks];
            let force = &self.force_out[lane * forces..(lane + 1) * forces];
            sink.element(first + lane, force, stiffness.then_some(matrix));
        }
    }

    /// Upper blocks in lanes to full matrices, one after the other.
    #[inline(always)]
    fn spread(&mut self) {
        let n = self.force.len();
        let mut blocks = self.upper.iter();
        for a in 0..n {
            for (b, block) in (a..n).zip(blocks.by_ref()) {
                let mirrored = crate::square::transpose(block);
                write_block(block, (a * n + b) * D * D, n * n * D * D, &mut self.stiffness_out);
                if a != b {
                    write_block(&mirrored, (b * n + a) * D * D, n * n * D * D, &mut self.stiffness_out);
                }
            }
        }
    }
}

/// `q m + S` (times volumes and switches), as far as it multiplies the identity.
#[inline(always)]
fn scalar_metric<L: Lane, P: Law, const D: usize>(
    response: &Response<L, D>,
    q: L,
    geometric: L,
) -> Square<L, D> {
    match P::METRIC {
        Metric::Linear => diagonal(q),
        Metric::Reference => {
            let mut stress = response.second_piola;
            for row in &mut stress {
                *row = scale(row, geometric);
            }
            stress
        }
        Metric::Current => {
            let mut sum = inner_gram(&response.gradient_map);
            for i in 0..D {
                for j in 0..D {
                    sum[i][j] = response.second_piola[i][j].mul_add(geometric, sum[i][j] * q);
                }
            }
            sum
        }
    }
}

/// Writes a block to `at` of each lane's matrix of `size` numbers.
#[inline(always)]
fn write_block<L: Lane, const D: usize>(block: &Square<L, D>, at: usize, size: usize, out: &mut [f64]) {
    let mut entries = [block[0][0]; 9];
    for i in 0..D {
        for j in 0..D {
            entries[i * D + j] = block[i][j];
        }
    }
    let whole = D * D / WIDTH * WIDTH;
    for first in (0..whole).step_by(WIDTH) {
        let rows = L::transpose([entries[first], entries[first + 1], entries[first + 2], entries[first + 3]]);
        for (lane, row) in rows.iter().enumerate() {
            out[lane * size + at + first..][..WIDTH].copy_from_slice(row);
        }
    }
    for rest in whole..D * D {
        let lanes = entries[rest].lanes();
        for (lane, value) in lanes.into_iter().enumerate() {
            out[lane * size + at + rest] = value;
        }
    }
}

/// The lowest element of the batch with a point that is not positive, and its first such point.
#[cold]
fn inverted(det_f: &[[f64; WIDTH]], elements: &[u32], passes: &[Pass]) -> std::result::Result<(), Inverted> {
    let points = || passes.iter().flat_map(|pass| &pass.points).zip(det_f);
    for (lane, &element) in elements.iter().enumerate() {
        if let Some((&point, det)) = points().find(|(_, det)| !(det[lane] > 0.0)) {
            return Err(Inverted { element, point, det: det[lane] });
        }
    }
    Ok(())
}
