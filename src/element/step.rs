//! The solid kernel over a step: forces whose work equals the change of the energy of a group
//! (theory, section 4.5).
//!
//! `Q_a = int F_middle S g_a dV` with the stress `S` of [`PointLaw::respond_step`]. Its derivative by
//! the displacement in the middle of the step, `int (g_a . S g_b) 1 + F_middle dS_b g_a dV`, is not
//! symmetric, because the strain at the end of the step changes with `F_end`. Terms with a separate
//! quadrature are conserved separately.

use super::batch::{Batch, Sample, check};
use super::group::{ElementGroup, Pass, Sampling};
use super::projection::Dilatation;
use super::tangent::Selected;
use super::workspace::Gather;
use super::{ElementSink, Inverted, Request};
use crate::lanes::{Lane, LanePart, LaneTask, WIDTH, dispatch};
use crate::material::{IsotropicLaw, Law, LawPart, LawTask, PointLaw, StepMotion, VolumeLaw, VolumeStep};
use crate::square::{
    Row, Square, apply, apply_add, det_minus_one, dot, plus_one, product, scale_add, scale_all,
};

/// One evaluation of a group over a step.
pub(super) struct StepJob<'a, const D: usize> {
    pub group: &'a ElementGroup<D>,
    /// Displacements at the start and in the middle of the step \[m\].
    pub u: [&'a [f64]; 2],
    pub request: Request<'a>,
    pub sink: &'a mut dyn ElementSink,
}

/// Evaluates a group in plane strain or plane stress over a step.
pub(super) fn in_plane(job: StepJob<'_, 2>) -> Result<(), Inverted> {
    match job.group.formulation().plane_stress() {
        None => solid(job),
        Some(law) => dispatch(Step::new(job, vec![Box::new(law)])),
    }
}

/// Evaluates a group without strain across the plane, or in 3D, over a step.
pub(super) fn solid<const D: usize>(job: StepJob<'_, D>) -> Result<(), Inverted> {
    job.group.formulation().material.accept(job)
}

impl<const D: usize> LawTask for StepJob<'_, D> {
    type Output = Result<(), Inverted>;

    fn run<P: Law>(self, law: &P) -> Self::Output {
        let parts = self.group.parts(|part| Box::new(LawPart::<P>(law.constants(part))));
        dispatch(Step::new(self, parts))
    }

    fn run_isotropic<P: IsotropicLaw>(self, law: &P) -> Self::Output {
        let parts = self.group.parts(|part| law.energy_of_part(part));
        dispatch(Step::new(self, parts))
    }
}

/// A job with the parts of a law.
pub(super) struct Step<'a, K: ?Sized, const D: usize> {
    job: StepJob<'a, D>,
    /// One entry for each pass.
    parts: Vec<Box<K>>,
}

impl<'a, K: ?Sized, const D: usize> Step<'a, K, D> {
    pub fn new(job: StepJob<'a, D>, parts: Vec<Box<K>>) -> Self {
        Self { job, parts }
    }
}

impl<K: PointLaw + ?Sized, const D: usize> LaneTask for Step<'_, K, D> {
    type Output = Result<(), Inverted>;

    #[inline(always)]
    fn run<L: Lane>(self, unit: L) -> Self::Output {
        let StepJob { group, u, request, sink } = self.job;
        let n = group.kind.nodes();
        let volume_law = group.volume_law();
        let wanted = request.stiffness.map(|terms| Selected::new(unit, terms));
        let mut work = Workspace::<L, D>::new(unit, group);
        let mut reserves = Vec::new();
        let batches = group.elements.chunks(WIDTH).zip(group.nodes.chunks_exact(n));
        for (batch, ((elements, nodes), points)) in batches.zip(group.points.chunks_exact(n)).enumerate() {
            work.gather(unit, nodes, points, u);
            reserves.clear();
            let mut point = 0;
            for (pass, law) in group.passes.iter().zip(&self.parts) {
                if let Sampling::Projected(_) = pass.sampling {
                    work.add_volume_terms(unit, pass, &volume_law, wanted, point);
                    point += pass.samples();
                    continue;
                }
                for q in 0..pass.samples() {
                    let (volume, [start, middle]) = work.locate(unit, pass, q);
                    let motion = StepMotion::new(start, middle);
                    work.det_f[point] = (det_minus_one(&motion.end) + unit).lanes();
                    point += 1;
                    let second_piola = match wanted {
                        None => law.stress_over_step(&motion),
                        Some(wanted) => {
                            let response = law.respond_step(&motion);
                            let change = LawOverStep::<K, L, D>(&response.tangent);
                            work.add_stiffness(&motion, &response.second_piola, &change, volume, wanted);
                            response.second_piola
                        }
                    };
                    work.add_force(&plus_one(&middle), &second_piola, volume);
                    if let Some(reserve) = law.reserve(&motion.end, &second_piola) {
                        reserves.push(reserve.lanes());
                    }
                }
            }
            check(&work.det_f, &reserves, elements, &group.passes)?;
            work.emit(batch * WIDTH, elements.len(), wanted.is_some(), sink);
        }
        Ok(())
    }
}

/// Change of a stress over a step with the strain at its end.
trait StepChange<L, const D: usize> {
    /// `dS` for a symmetric change of Green's strain.
    fn contract(&self, strain: &Square<L, D>) -> Square<L, D>;
}

/// The tangent of a law over a step.
struct LawOverStep<'a, K: PointLaw + ?Sized, L: Lane, const D: usize>(&'a K::StepTangent<L, D>);

impl<K: PointLaw + ?Sized, L: Lane, const D: usize> StepChange<L, D> for LawOverStep<'_, K, L, D> {
    #[inline(always)]
    fn contract(&self, strain: &Square<L, D>) -> Square<L, D> {
        K::contract_step(self.0, strain)
    }
}

/// The stress of the volume terms at a constant pressure.
struct VolumeOverStep<'a, L, const D: usize> {
    step: &'a VolumeStep<L, D>,
    pressure: L,
}

impl<L: Lane, const D: usize> StepChange<L, D> for VolumeOverStep<'_, L, D> {
    #[inline(always)]
    fn contract(&self, strain: &Square<L, D>) -> Square<L, D> {
        scale_all(&self.step.contract(strain), self.pressure)
    }
}

/// Buffers of the loop over a group, allocated once per evaluation.
struct Workspace<L, const D: usize> {
    batch: Batch<L, D, 2>,
    dilatation: Dilatation<L, D>,
    /// The dilatation at the start of the step at the points, then its projection.
    dilatation_start: Vec<L>,
    /// Derivative of the projected dilatation at the end by the displacement in the middle,
    /// `[k * nodes + a]`.
    flux_end: Vec<Row<L, D>>,
    /// `g_a` at the current sample [1/m].
    gradients: Vec<Row<L, D>>,
    force: Vec<Row<L, D>>,
    /// Blocks `a * n + b`.
    blocks: Vec<Square<L, D>>,
    det_f: Vec<[f64; WIDTH]>,
    force_out: Vec<f64>,
    stiffness_out: Vec<f64>,
}

impl<L: Lane, const D: usize> Workspace<L, D> {
    #[inline(always)]
    fn new(unit: L, group: &ElementGroup<D>) -> Self {
        let n = group.kind.nodes();
        let zero = unit.constant(0.0);
        let dilatation = Dilatation::new(unit, group);
        Self {
            batch: Batch::new(unit, group),
            dilatation_start: dilatation.dilatation.clone(),
            flux_end: dilatation.flux.clone(),
            dilatation,
            gradients: vec![[zero; D]; n],
            force: vec![[zero; D]; n],
            blocks: vec![[[zero; D]; D]; n * n],
            det_f: vec![[0.0; WIDTH]; group.passes.iter().map(Pass::samples).sum()],
            force_out: vec![0.0; n * D],
            stiffness_out: vec![0.0; n * n * D * D],
        }
    }

    #[inline(always)]
    fn gather(&mut self, unit: L, nodes: &[[u32; WIDTH]], points: &[[[f64; WIDTH]; D]], u: [&[f64]; 2]) {
        let zero = unit.constant(0.0);
        unit.apart(Gather { batch: &mut self.batch, unit, nodes, points, u });
        self.force.fill([zero; D]);
        self.blocks.fill([[zero; D]; D]);
    }

    /// Moves to a sample: sets the gradients and returns its volume and both displacement
    /// gradients.
    #[inline(always)]
    fn locate(&mut self, unit: L, pass: &Pass, q: usize) -> (L, [Square<L, D>; 2]) {
        let Sample { volume, map, grad_u } = self.batch.locate(unit, pass, q);
        for (gradient, slope) in self.gradients.iter_mut().zip(&self.batch.slopes) {
            *gradient = apply(&map, slope);
        }
        (volume, grad_u)
    }

    #[inline(always)]
    fn add_force(&mut self, f_middle: &Square<L, D>, second_piola: &Square<L, D>, volume: L) {
        let flux = scale_all(&product(f_middle, second_piola), volume);
        for (force, gradient) in self.force.iter_mut().zip(&self.gradients) {
            *force = apply_add(&flux, gradient, force);
        }
    }

    #[inline(always)]
    fn add_stiffness(
        &mut self,
        motion: &StepMotion<L, D>,
        second_piola: &Square<L, D>,
        change: &impl StepChange<L, D>,
        volume: L,
        wanted: Selected<L>,
    ) {
        volume.apart(AddStiffness { work: self, motion, second_piola, change, volume, wanted });
    }

    /// Adds the volume terms of a batch, with the pressure `p = P (U_end - U_start) / (s_end - s_start)`
    /// and the stress `p G` of [`VolumeStep`]. The projection is symmetric, so their work is the change
    /// of the energy. `first` is the number of the first point of the pass.
    #[inline(always)]
    fn add_volume_terms(
        &mut self,
        unit: L,
        pass: &Pass,
        law: &VolumeLaw,
        wanted: Option<Selected<L>>,
        first: usize,
    ) {
        unit.apart(VolumeTerms { work: self, unit, pass, law, wanted, first });
    }

    /// Passes the real (not padded) lanes of a batch to the sink.
    #[inline(always)]
    fn emit(&mut self, first: usize, count: usize, stiffness: bool, sink: &mut dyn ElementSink) {
        for lane in 0..count {
            for (out, value) in self.force_out.iter_mut().zip(self.force.as_flattened()) {
                *out = value.lanes()[lane];
            }
            if stiffness {
                let entries = self.blocks.as_flattened().as_flattened();
                for (out, value) in self.stiffness_out.iter_mut().zip(entries) {
                    *out = value.lanes()[lane];
                }
            }
            sink.element(first + lane, &self.force_out, stiffness.then_some(&self.stiffness_out));
        }
    }
}

/// The stiffness of a sample, see [`Workspace::add_stiffness`].
struct AddStiffness<'a, C, L, const D: usize> {
    work: &'a mut Workspace<L, D>,
    motion: &'a StepMotion<L, D>,
    second_piola: &'a Square<L, D>,
    change: &'a C,
    volume: L,
    wanted: Selected<L>,
}

impl<C: StepChange<L, D>, L: Lane, const D: usize> LanePart for AddStiffness<'_, C, L, D> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { work, motion, second_piola, change, volume, wanted } = self;
        let n = work.gradients.len();
        let f_end = plus_one(&motion.end);
        let stress = scale_all(second_piola, volume * wanted.geometric);
        let carrier = scale_all(&plus_one(&motion.middle), volume * wanted.material);
        for b in 0..n {
            let gradient = work.gradients[b];
            let stiffening = apply(&stress, &gradient);
            let mut columns = [[[gradient[0].constant(0.0); D]; D]; D];
            for (column, row) in columns.iter_mut().zip(&f_end) {
                // The end moves twice as far as the middle.
                let mut strain = *column;
                for k in 0..D {
                    for l in 0..D {
                        strain[k][l] = row[k].mul_add(gradient[l], gradient[k] * row[l]);
                    }
                }
                *column = product(&carrier, &change.contract(&strain));
            }
            for a in 0..n {
                let test = work.gradients[a];
                let isotropic = dot(&test, &stiffening);
                let block = &mut work.blocks[a * n + b];
                for (j, column) in columns.iter().enumerate() {
                    for i in 0..D {
                        block[i][j] = block[i][j] + dot(&column[i], &test);
                    }
                    block[j][j] = block[j][j] + isotropic;
                }
            }
        }
    }
}

/// The volume terms of a batch, see [`Workspace::add_volume_terms`].
struct VolumeTerms<'a, L, const D: usize> {
    work: &'a mut Workspace<L, D>,
    unit: L,
    pass: &'a Pass,
    law: &'a VolumeLaw,
    wanted: Option<Selected<L>>,
    first: usize,
}

impl<L: Lane, const D: usize> LanePart for VolumeTerms<'_, L, D> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { work, unit, pass, law, wanted, first } = self;
        let n = work.gradients.len();
        for q in 0..pass.samples() {
            let Sample { volume, grad_u: [start, middle], .. } = work.batch.locate(unit, pass, q);
            let motion = StepMotion::new(start, middle);
            let terms = &mut work.dilatation;
            terms.projection.set(q, volume, &work.batch.place(unit, pass, q));
            work.dilatation_start[q] = law.dilatation(&motion.start);
            terms.dilatation[q] = law.dilatation(&motion.end);
        }
        let terms = &mut work.dilatation;
        terms.projection.orthogonalize();
        terms.projection.project(&mut work.dilatation_start);
        terms.projection.project(&mut terms.dilatation);
        for q in 0..pass.samples() {
            let [slope, curvature] = law.slope_over_step(work.dilatation_start[q], terms.dilatation[q]);
            terms.pressure[q] = slope;
            terms.curvature[q] = curvature;
            work.det_f[first + q] = law.volume_ratio(terms.dilatation[q]).lanes();
        }
        terms.projection.project(&mut terms.pressure);
        terms.flux.fill([unit.constant(0.0); D]);
        work.flux_end.fill([unit.constant(0.0); D]);
        for q in 0..pass.samples() {
            let (volume, [start, middle]) = work.locate(unit, pass, q);
            let motion = StepMotion::new(start, middle);
            let step = law.over_step(&motion);
            let pressure = work.dilatation.pressure[q];
            let stress = scale_all(&step.gradient, pressure);
            let f_middle = plus_one(&middle);
            work.add_force(&f_middle, &stress, volume);
            let Some(wanted) = wanted else { continue };
            let change = VolumeOverStep { step: &step, pressure };
            work.add_stiffness(&motion, &stress, &change, volume, wanted);
            let force = product(&f_middle, &step.gradient);
            // The end moves twice as far as the middle.
            let end = scale_all(&law.gradient(&motion.end), unit.constant(2.0));
            let terms = &mut work.dilatation;
            for k in 0..terms.projection.size() {
                let share = terms.projection.basis[k * pass.samples() + q] * volume;
                let [force, end] = [scale_all(&force, share), scale_all(&end, share)];
                for a in 0..n {
                    let (flux, flux_end) = (&mut terms.flux[k * n + a], &mut work.flux_end[k * n + a]);
                    *flux = apply_add(&force, &work.gradients[a], flux);
                    *flux_end = apply_add(&end, &work.gradients[a], flux_end);
                }
            }
        }
        let Some(wanted) = wanted else { return };
        let terms = &work.dilatation;
        let curvatures = terms.projection.curvatures(&terms.curvature);
        for k in 0..terms.projection.size() {
            for b in 0..n {
                let mut row = [unit.constant(0.0); D];
                for l in 0..terms.projection.size() {
                    row = scale_add(&work.flux_end[l * n + b], curvatures[k][l] * wanted.material, &row);
                }
                for a in 0..n {
                    let flux = &terms.flux[k * n + a];
                    let block = &mut work.blocks[a * n + b];
                    for i in 0..D {
                        block[i] = scale_add(&row, flux[i], &block[i]);
                    }
                }
            }
        }
    }
}
