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
use super::kinematics::{Kinematics, gradient_of, reference_map};
use super::tangent::{Form, Tangent, Wanted, first_form};
use super::{ElementSink, Inverted, Request};
use crate::lanes::{Lane, LaneTask, WIDTH, dispatch};
use crate::material::{Hooke, Law, Model, Moduli, NeoHookean, SaintVenantKirchhoff};
use crate::square::{Row, Square, apply_add, diagonal, product, product_transposed, scale, scale_all};

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
                    let sample = work.locate(unit, pass, q);
                    let det_f = work.add_law::<P>(&sample, &moduli, wanted, form);
                    work.det_f[point] = det_f.lanes();
                    point += 1;
                }
                if wanted.is_some() && form == Form::Factored {
                    work.unfold(&moduli);
                }
            }
            work.check(elements, &group.passes)?;
            work.emit(batch * WIDTH, elements.len(), wanted.is_some(), sink);
        }
        Ok(())
    }
}

/// Geometry and displacement at one sample.
pub(super) struct Sample<L, const D: usize> {
    /// Reference volume that it stands for [m^D].
    pub volume: L,
    /// Takes the slopes to reference gradients [1/m].
    pub map: Square<L, D>,
    /// Displacement gradient.
    pub grad_u: Square<L, D>,
}

/// Everything that the loop over a group writes to; allocated once per evaluation.
pub(super) struct Workspace<L, const D: usize> {
    points: Vec<Row<L, D>>,
    displacements: Vec<Row<L, D>>,
    /// `dN_a/dxi` of the current sample, or mean gradients.
    pub slopes: Vec<Row<L, D>>,
    /// `h_a`.
    pub mapped: Vec<Row<L, D>>,
    pub force: Vec<Row<L, D>>,
    /// Integral of the gradients over the points so far, where a pass wants their mean.
    mean: Vec<Row<L, D>>,
    /// Volume of the points so far.
    volume: L,
    /// Blocks `(a, b)`, `b >= a`, row by row.
    pub upper: Vec<Square<L, D>>,
    /// For each quadrature point of all passes.
    det_f: Vec<[f64; WIDTH]>,
    force_out: Vec<f64>,
    pub stiffness_out: Vec<f64>,
}

impl<L: Lane, const D: usize> Workspace<L, D> {
    #[inline(always)]
    pub(super) fn new(unit: L, group: &ElementGroup<D>) -> Self {
        let n = group.kind.nodes();
        let zero = unit.constant(0.0);
        let rows = || vec![[zero; D]; n];
        Self {
            points: rows(),
            displacements: rows(),
            slopes: rows(),
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
    pub(super) fn gather(
        &mut self,
        unit: L,
        nodes: &[[u32; WIDTH]],
        points: &[[[f64; WIDTH]; D]],
        u: &[f64],
    ) {
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

    /// Goes to a sample: sets the slopes and returns what depends on geometry and displacement there.
    #[inline(always)]
    pub(super) fn locate(&mut self, unit: L, pass: &Pass, q: usize) -> Sample<L, D> {
        if pass.sampling == Sampling::Mean {
            let inverse = self.volume.recip();
            for (slope, mean) in self.slopes.iter_mut().zip(&self.mean) {
                *slope = scale(mean, inverse);
            }
            let grad_u = gradient_of(&self.displacements, &self.slopes);
            return Sample { volume: self.volume, map: diagonal(unit), grad_u };
        }
        for (slope, dn) in self.slopes.iter_mut().zip(pass.dn(q).as_chunks::<D>().0) {
            for k in 0..D {
                slope[k] = unit.constant(dn[k]);
            }
        }
        let (det, map) = reference_map(&gradient_of(&self.points, &self.slopes));
        let grad_u = product_transposed(&gradient_of(&self.displacements, &self.slopes), &map);
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

    /// Adds one sample; returns `det F` there.
    #[inline(always)]
    fn add_law<P: Law>(
        &mut self,
        sample: &Sample<L, D>,
        moduli: &Moduli<L>,
        wanted: Option<Wanted<L>>,
        form: Form,
    ) -> L {
        let response = P::respond(moduli, &sample.grad_u);
        let flux = scale_all(&product(&response.first_piola, &sample.map), sample.volume);
        for (force, slope) in self.force.iter_mut().zip(&self.slopes) {
            *force = apply_add(&flux, slope, force);
        }
        if let Some(wanted) = wanted {
            let tangent = Tangent::new::<P>(&response, sample, wanted);
            match form {
                Form::Sum => self.add_stiffness(&tangent, P::METRIC),
                Form::Factored => {
                    let inverse = (moduli.lambda + moduli.mu).recip();
                    self.add_factored(&tangent.over(inverse), sample.volume * wanted.material, P::METRIC);
                }
            }
        }
        response.det_f
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
}

/// The lowest element of the batch with a point that is not positive, and its first such point.
#[cold]
pub(super) fn inverted(
    det_f: &[[f64; WIDTH]],
    elements: &[u32],
    passes: &[Pass],
) -> std::result::Result<(), Inverted> {
    let points = || passes.iter().flat_map(|pass| &pass.points).zip(det_f);
    for (lane, &element) in elements.iter().enumerate() {
        if let Some((&point, det)) = points().find(|(_, det)| det[lane] <= 0.0 || det[lane].is_nan()) {
            return Err(Inverted { element, point, det: det[lane] });
        }
    }
    Ok(())
}
