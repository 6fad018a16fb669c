//! The fast solid kernel: internal force `Q`, `K_0 + K_NL` and `K_S` of a group, four elements at a
//! time. [`super::general`] is the kernel for arbitrary laws.
//!
//! With a tangent `C = lam m (x) m + 2 q I_m` (2.20), reference gradients `g_a` of the shape
//! functions and `h_a = F m g_a`, the strain operator is eliminated from `int B*^T C B* + K_S`:
//!
//! `K_ab = int lam h_a h_b^T + q h_b h_a^T + q (g_a . m g_b) F m F^T + (g_a . S g_b) 1` (3.13).
//!
//! This needs a third of the operations of the textbook product. Only blocks `b >= a` are summed;
//! the others follow by symmetry.
//!
//! A viscoelastic group comes here only in linear kinematics, where the stress of its Prony series is
//! a change of the moduli and a stress that is known.

use std::marker::PhantomData;

use super::Inverted;
use super::batch::{Sample, check};
use super::group::Sampling;
use super::linearised_pressure::{FlatShape, LinearisedPressure};
use super::tangent::{Form, Selected, Tangent, first_form};
use super::viscous::added_stress;
use super::workspace::{Job, Workspace};
use crate::lanes::{Lane, LanePart, LaneTask, WIDTH};
use crate::material::{MetricLaw, Moduli, Overstress};
use crate::square::{apply_add, product, scale_all};

/// A job with a law known at compile time.
pub(super) struct Solid<'a, P, const D: usize> {
    job: Job<'a, D>,
    moduli: Moduli<f64>,
    law: PhantomData<P>,
}

impl<'a, P, const D: usize> Solid<'a, P, D> {
    pub fn new(job: Job<'a, D>, moduli: Moduli<f64>) -> Self {
        Self { job, moduli, law: PhantomData }
    }
}

impl<P: MetricLaw, const D: usize> LaneTask for Solid<'_, P, D> {
    type Output = std::result::Result<(), Inverted>;

    #[inline(always)]
    fn run<L: Lane>(self, unit: L) -> Self::Output {
        let Job { group, u, viscous, request, sink } = self.job;
        let n = group.kind.nodes();
        let volume_law = group.volume_law();
        let wanted = request.stiffness.map(|terms| Selected::new(unit, terms));
        let mut work = Workspace::<L, D>::new(unit, group);
        let mut pressures = LinearisedPressure::new(unit, group, request.linearised_at);
        let batches = group.elements.chunks(WIDTH).zip(group.nodes.chunks_exact(n));
        for (batch, ((elements, nodes), points)) in batches.zip(group.points.chunks_exact(n)).enumerate() {
            work.gather(unit, nodes, points, u);
            let mut point = 0;
            for (number, pass) in group.passes.iter().enumerate() {
                if let Sampling::Projected(_) = pass.sampling {
                    work.add_volume_terms(unit, pass, &volume_law, wanted, point);
                    point += pass.samples();
                    continue;
                }
                let viscous = viscous.filter(|_| number == 0);
                let moduli = self.moduli.part(pass.part);
                let moduli = viscous.map_or(moduli, |viscous| stiffened(self.moduli, moduli, viscous.factor));
                let moduli = moduli.in_lanes(unit);
                let form = if number == 0 { first_form::<P>() } else { Form::Sum };
                for q in 0..pass.samples() {
                    let sample = work.batch.locate(unit, pass, q);
                    let law = PhantomData::<P>;
                    let det_f = unit.apart(AddLaw {
                        law,
                        work: &mut work,
                        sample: &sample,
                        moduli: &moduli,
                        wanted,
                        form,
                    });
                    if let Some(viscous) = viscous {
                        work.add_history(viscous, batch * pass.samples() + q, &sample);
                    }
                    work.det_f[point] = det_f.lanes();
                    point += 1;
                }
                if wanted.is_some() && form == Form::Factored {
                    work.blocks.unfold(&moduli);
                }
            }
            if let (Some(wanted), Some(pressures)) = (wanted, &mut pressures) {
                pressures.add_stiffness(unit, &mut work, &mut FlatShape, group, nodes, wanted);
            }
            check(&work.det_f, &[], elements, &group.passes)?;
            work.emit(unit, batch * WIDTH, elements.len(), wanted.is_some(), sink);
        }
        Ok(())
    }
}

/// Moduli of a part of Hooke's law to which `factor` times its deviator is added.
fn stiffened(whole: Moduli<f64>, part: Moduli<f64>, factor: f64) -> Moduli<f64> {
    let added = factor * whole.mu;
    Moduli { lambda: part.lambda - 2.0 / 3.0 * added, mu: part.mu + added }
}

impl<L: Lane, const D: usize> Workspace<L, D> {
    /// Adds the force of the stress that the history of a group in linear kinematics adds at sample
    /// `number`.
    #[inline(always)]
    fn add_history(&mut self, viscous: &Overstress, number: usize, sample: &Sample<L, D, 1>) {
        let zero = sample.volume.constant(0.0);
        let stress = added_stress::<L, D>(viscous, number, &[[zero; 3]; 3]);
        let flux = scale_all(&product(&stress, &sample.map), sample.volume);
        for (force, slope) in self.force.iter_mut().zip(&self.batch.slopes) {
            *force = apply_add(&flux, slope, force);
        }
    }
}

/// One sample of a law, which is added to the sums of its batch. The result is `det F`.
struct AddLaw<'a, P, L, const D: usize> {
    law: PhantomData<P>,
    work: &'a mut Workspace<L, D>,
    sample: &'a Sample<L, D, 1>,
    moduli: &'a Moduli<L>,
    wanted: Option<Selected<L>>,
    form: Form,
}

impl<P: MetricLaw, L: Lane, const D: usize> LanePart for AddLaw<'_, P, L, D> {
    type Output = L;

    #[inline(always)]
    fn run(self) -> L {
        let Self { law: _, work, sample, moduli, wanted, form } = self;
        let response = P::respond_with_metric(moduli, &sample.grad_u[0]);
        let flux = scale_all(&product(&response.first_piola, &sample.map), sample.volume);
        for (force, slope) in work.force.iter_mut().zip(&work.batch.slopes) {
            *force = apply_add(&flux, slope, force);
        }
        if let Some(wanted) = wanted {
            let tangent = Tangent::new::<P>(&response, &sample.map, sample.volume, wanted);
            let slopes = &work.batch.slopes;
            match form {
                Form::Sum => work.blocks.add(slopes, &tangent, P::METRIC),
                Form::Factored => {
                    let inverse = (moduli.lambda + moduli.mu).recip();
                    let weight = sample.volume * wanted.material;
                    work.blocks.add_factored(slopes, &tangent.over(inverse), weight, P::METRIC);
                }
            }
        }
        response.det_f
    }
}
