//! The solid kernel: internal force `Q`, `K_0 + K_NL` and `K_S` of a group, four elements a time.
//!
//! With a tangent `C = lam m (x) m + 2 q I_m` (2.20), reference gradients `g_a` of the shape functions and `h_a = F m g_a`
//! the strain operator drops out of `int B*^T C B* + K_S`:
//!
//! `K_ab = int lam h_a h_b^T + q h_b h_a^T + q (g_a . m g_b) F m F^T + (g_a . S g_b) 1` (3.13),
//!
//! a third of the work of the textbook product. Only blocks `b >= a` are summed; the others are mirrored.

use std::marker::PhantomData;

use super::batch::{Batch, Sample, check};
use super::group::{ElementGroup, Pass};
use super::kinematics::Kinematics;
use super::tangent::{Blocks, Form, Tangent, Wanted, first_form};
use super::{ElementSink, Inverted, Request};
use crate::lanes::{Lane, LaneTask, WIDTH, dispatch};
use crate::material::{Hooke, Law, Model, Moduli, NeoHookean, SaintVenantKirchhoff};
use crate::square::{Row, apply_add, product, scale_all};

/// One evaluation of a group.
pub(super) struct Job<'a, const D: usize> {
    pub group: &'a ElementGroup<D>,
    pub u: &'a [f64],
    pub request: Request,
    pub sink: &'a mut dyn ElementSink,
}

impl<const D: usize> ElementGroup<D> {
    /// Internal force (and, as requested, its derivative) of each element at the nodal displacements `u`
    /// (`u[node * D + i]`, local nodes, \[m\]).
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
            for (number, pass) in group.passes.iter().enumerate() {
                let moduli = pass.moduli.in_lanes(unit);
                let form = if number == 0 { first_form::<P>() } else { Form::Sum };
                for q in 0..pass.samples() {
                    let sample = work.batch.locate(unit, pass, q);
                    let det_f = work.add_law::<P>(&sample, &moduli, wanted, form);
                    work.det_f[point] = det_f.lanes();
                    point += 1;
                }
                if wanted.is_some() && form == Form::Factored {
                    work.blocks.unfold(&moduli);
                }
            }
            check(&work.det_f, elements, &group.passes)?;
            work.emit(batch * WIDTH, elements.len(), wanted.is_some(), sink);
        }
        Ok(())
    }
}

/// Everything that the loop over a group writes to; allocated once per evaluation.
struct Workspace<L, const D: usize> {
    batch: Batch<L, D, 1>,
    force: Vec<Row<L, D>>,
    blocks: Blocks<L, D>,
    /// For each quadrature point of all passes.
    det_f: Vec<[f64; WIDTH]>,
    force_out: Vec<f64>,
}

impl<L: Lane, const D: usize> Workspace<L, D> {
    #[inline(always)]
    fn new(unit: L, group: &ElementGroup<D>) -> Self {
        let n = group.kind.nodes();
        Self {
            batch: Batch::new(unit, group),
            force: vec![[unit.constant(0.0); D]; n],
            blocks: Blocks::new(unit, n),
            det_f: vec![[0.0; WIDTH]; group.passes.iter().map(Pass::samples).sum()],
            force_out: vec![0.0; WIDTH * n * D],
        }
    }

    /// Fetches a batch and clears the sums.
    #[inline(always)]
    fn gather(&mut self, unit: L, nodes: &[[u32; WIDTH]], points: &[[[f64; WIDTH]; D]], u: &[f64]) {
        self.batch.gather(unit, nodes, points, [u]);
        self.force.fill([unit.constant(0.0); D]);
        self.blocks.clear(unit);
    }

    /// Adds one sample; returns `det F` there.
    #[inline(always)]
    fn add_law<P: Law>(
        &mut self,
        sample: &Sample<L, D, 1>,
        moduli: &Moduli<L>,
        wanted: Option<Wanted<L>>,
        form: Form,
    ) -> L {
        let response = P::respond(moduli, &sample.grad_u[0]);
        let flux = scale_all(&product(&response.first_piola, &sample.map), sample.volume);
        for (force, slope) in self.force.iter_mut().zip(&self.batch.slopes) {
            *force = apply_add(&flux, slope, force);
        }
        if let Some(wanted) = wanted {
            let tangent = Tangent::new::<P>(&response, &sample.map, sample.volume, wanted);
            let slopes = &self.batch.slopes;
            match form {
                Form::Sum => self.blocks.add(slopes, &tangent, P::METRIC),
                Form::Factored => {
                    let inverse = (moduli.lambda + moduli.mu).recip();
                    let weight = sample.volume * wanted.material;
                    self.blocks.add_factored(slopes, &tangent.over(inverse), weight, P::METRIC);
                }
            }
        }
        response.det_f
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
            self.blocks.spread();
        }
        let forces = n * D;
        let blocks = n * n * D * D;
        for lane in 0..count {
            let matrix = &self.blocks.out[lane * blocks..(lane + 1) * blocks];
            let force = &self.force_out[lane * forces..(lane + 1) * forces];
            sink.element(first + lane, force, stiffness.then_some(matrix));
        }
    }
}
