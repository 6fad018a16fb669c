//! The solid kernel for any law: internal force `Q`, `K_0 + K_NL` and `K_S` of a group, four
//! elements at a time. It is compiled once for each type of [`PointLaw`].
//!
//! `K_ab = g_a . A g_b` with the reference gradients `g_a` of the shape functions and the first
//! elasticity tensor `A_iJkL = F_iI C_IJKL F_kK + delta_ik S_JL`. [`PointLaw::contract`] gives the
//! columns of `C`. Only blocks `b >= a` are summed; the others follow by symmetry.
//!
//! A viscoelastic group adds the stress of its Prony series at the points of the full rule.

use super::Inverted;
use super::batch::{Sample, check};
use super::group::Sampling;
use super::linearised_pressure::{FlatShape, LinearisedPressure};
use super::tangent::{Blocks, Selected};
use super::viscous::{added_stress, in_plane, in_space};
use super::workspace::{Job, Workspace};
use crate::lanes::{Lane, LanePart, LaneTask, WIDTH};
use crate::material::{Deviator, DeviatorTangent, FiniteDeviator, Overstress, Part, PointLaw, Response};
use crate::square::{
    Row, Square, apply, apply_add, det_minus_one, plus_one, product, scale_all, sum, transpose,
};

/// A job with the parts of a law.
pub(super) struct General<'a, K: ?Sized, const D: usize> {
    job: Job<'a, D>,
    /// One entry for each pass.
    parts: Vec<Box<K>>,
    /// Part of the law whose isochoric stress relaxes; `None` for an elastic group.
    relaxing: Option<Box<K>>,
}

impl<'a, K: ?Sized, const D: usize> General<'a, K, D> {
    /// A job with the law of which `part` gives the parts.
    pub fn new(job: Job<'a, D>, part: impl Fn(Part) -> Box<K>) -> Self {
        let parts = job.group.parts(&part);
        let relaxing = job.viscous.map(|_| part(Part::Shear));
        Self { job, parts, relaxing }
    }

    /// A job with a law that one rule integrates as a whole, without a Prony series.
    pub fn of_one(job: Job<'a, D>, law: Box<K>) -> Self {
        Self { job, parts: vec![law], relaxing: None }
    }
}

/// Viscous stress at one sample.
#[derive(Clone, Copy)]
struct Viscous<'a, K: ?Sized> {
    law: &'a K,
    overstress: &'a Overstress,
    /// Number of the sample among those of the group.
    number: usize,
}

impl<K: PointLaw + ?Sized, const D: usize> LaneTask for General<'_, K, D> {
    type Output = std::result::Result<(), Inverted>;

    #[inline(always)]
    fn run<L: Lane>(self, unit: L) -> Self::Output {
        let Job { group, u, viscous, request, sink } = self.job;
        let viscous = viscous.zip(self.relaxing.as_deref());
        let n = group.kind.nodes();
        let volume_law = group.volume_law();
        let wanted = request.stiffness.map(|terms| Selected::new(unit, terms));
        let mut work = Workspace::<L, D>::new(unit, group);
        let mut pressures = LinearisedPressure::new(unit, group, request.linearised_at);
        let mut reserves = Vec::new();
        let mut gradients = vec![[unit.constant(0.0); D]; n];
        let batches = group.elements.chunks(WIDTH).zip(group.nodes.chunks_exact(n));
        for (batch, ((elements, nodes), points)) in batches.zip(group.points.chunks_exact(n)).enumerate() {
            work.gather(unit, nodes, points, u);
            reserves.clear();
            let mut point = 0;
            for (number, (pass, law)) in group.passes.iter().zip(&self.parts).enumerate() {
                if let Sampling::Projected(_) = pass.sampling {
                    work.add_volume_terms(unit, pass, &volume_law, wanted, point);
                    point += pass.samples();
                    continue;
                }
                let viscous = viscous.filter(|_| number == 0);
                for q in 0..pass.samples() {
                    let sample = work.batch.locate(unit, pass, q);
                    for (gradient, slope) in gradients.iter_mut().zip(&work.batch.slopes) {
                        *gradient = apply(&sample.map, slope);
                    }
                    let viscous = viscous.map(|(overstress, law)| Viscous {
                        law,
                        overstress,
                        number: batch * pass.samples() + q,
                    });
                    let elastic = ElasticSample {
                        work: &mut work,
                        gradients: &gradients,
                        sample: &sample,
                        law: &**law,
                        wanted,
                    };
                    let reached = match viscous {
                        None => unit.apart(elastic),
                        Some(viscous) => unit.apart(RelaxingSample { elastic, viscous }),
                    };
                    work.det_f[point] = reached.det_f.lanes();
                    if let Some(reserve) = law.reserve(&sample.grad_u[0], &reached.second_piola) {
                        reserves.push(reserve.lanes());
                    }
                    point += 1;
                }
            }
            if let (Some(wanted), Some(pressures)) = (wanted, &mut pressures) {
                pressures.add_stiffness(unit, &mut work, &mut FlatShape, group, nodes, wanted);
            }
            check(&work.det_f, &reserves, elements, &group.passes)?;
            work.emit(unit, batch * WIDTH, elements.len(), wanted.is_some(), sink);
        }
        Ok(())
    }
}

/// The state at a sample.
struct Reached<L, const D: usize> {
    det_f: L,
    second_piola: Square<L, D>,
}

/// One sample of a law, which is added to the sums of its batch.
struct ElasticSample<'a, K: ?Sized, L, const D: usize> {
    work: &'a mut Workspace<L, D>,
    gradients: &'a [Row<L, D>],
    sample: &'a Sample<L, D, 1>,
    law: &'a K,
    wanted: Option<Selected<L>>,
}

impl<K: PointLaw + ?Sized, L: Lane, const D: usize> LanePart for ElasticSample<'_, K, L, D> {
    type Output = Reached<L, D>;

    #[inline(always)]
    fn run(self) -> Reached<L, D> {
        let grad_u = &self.sample.grad_u[0];
        let Some(wanted) = self.wanted else {
            let stress = self.law.stress(grad_u);
            return self.add_force(stress);
        };
        let Response { second_piola, tangent } = self.law.respond(grad_u);
        let tangent = Elastic::<K, L, D>(&tangent);
        let elasticity = elasticity(&second_piola, &tangent, self.sample, wanted);
        self.add(&second_piola, &elasticity)
    }
}

impl<K: ?Sized, L: Lane, const D: usize> ElasticSample<'_, K, L, D> {
    /// Adds the stiffness, and the force of this stress.
    #[inline(always)]
    fn add(self, second_piola: &Square<L, D>, elasticity: &[[Square<L, D>; D]; D]) -> Reached<L, D> {
        self.sample.volume.apart(AddElasticity {
            blocks: &mut self.work.blocks,
            gradients: self.gradients,
            elasticity,
        });
        self.add_force(*second_piola)
    }

    /// Adds the force of this stress.
    #[inline(always)]
    fn add_force(self, second_piola: Square<L, D>) -> Reached<L, D> {
        let Sample { volume, grad_u: [grad_u], .. } = self.sample;
        let flux = scale_all(&product(&plus_one(grad_u), &second_piola), *volume);
        for (force, gradient) in self.work.force.iter_mut().zip(self.gradients) {
            *force = apply_add(&flux, gradient, force);
        }
        Reached { det_f: det_minus_one(grad_u) + volume.constant(1.0), second_piola }
    }
}

/// One sample of a law with a Prony series.
struct RelaxingSample<'a, K: ?Sized, L, const D: usize> {
    elastic: ElasticSample<'a, K, L, D>,
    viscous: Viscous<'a, K>,
}

impl<K: PointLaw + ?Sized, L: Lane, const D: usize> LanePart for RelaxingSample<'_, K, L, D> {
    type Output = Reached<L, D>;

    #[inline(always)]
    fn run(self) -> Reached<L, D> {
        let Self { elastic, viscous } = self;
        let grad_u = &elastic.sample.grad_u[0];
        let Some(wanted) = elastic.wanted else {
            let stress = sum(&elastic.law.stress(grad_u), &viscous.stress(grad_u));
            return elastic.add_force(stress);
        };
        let response = elastic.law.respond(grad_u);
        let added = viscous.respond(grad_u);
        let second_piola = sum(&response.second_piola, &added.second_piola);
        let tangent = Relaxing::<K, L, D> {
            elastic: &response.tangent,
            factor: viscous.overstress.factor,
            deviator: &added.tangent,
        };
        let elasticity = elasticity(&second_piola, &tangent, elastic.sample, wanted);
        elastic.add(&second_piola, &elasticity)
    }
}

/// The stiffness of a sample, see [`Blocks::add_elasticity`].
struct AddElasticity<'a, L, const D: usize> {
    blocks: &'a mut Blocks<L, D>,
    gradients: &'a [Row<L, D>],
    elasticity: &'a [[Square<L, D>; D]; D],
}

impl<L: Lane, const D: usize> LanePart for AddElasticity<'_, L, D> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.blocks.add_elasticity(self.gradients, self.elasticity);
    }
}

impl<K: PointLaw + ?Sized> Viscous<'_, K> {
    /// `factor S_iso + predicted`
    #[inline(always)]
    fn stress<L: Lane, const D: usize>(&self, grad_u: &Square<L, D>) -> Square<L, D> {
        self.with_history(&FiniteDeviator(self.law).stress(&in_space(grad_u)))
    }

    /// Stress, and the tangent of `S_iso`.
    #[inline(always)]
    fn respond<L: Lane, const D: usize>(
        &self,
        grad_u: &Square<L, D>,
    ) -> Response<L, DeviatorTangent<L, K::Tangent<L, 3>>, D> {
        let response = FiniteDeviator(self.law).respond(&in_space(grad_u));
        Response { second_piola: self.with_history(&response.second_piola), tangent: response.tangent }
    }

    #[inline(always)]
    fn with_history<L: Lane, const D: usize>(&self, isochoric: &Square<L, 3>) -> Square<L, D> {
        added_stress(self.overstress, self.number, isochoric)
    }
}

/// Change of a stress with the strain.
trait Contraction<L, const D: usize> {
    /// `dS` for a symmetric change of Green's strain.
    fn contract(&self, strain: &Square<L, D>) -> Square<L, D>;
}

/// The tangent of a law.
struct Elastic<'a, K: PointLaw + ?Sized, L: Lane, const D: usize>(&'a K::Tangent<L, D>);

/// The tangent of a law with a Prony series.
struct Relaxing<'a, K: PointLaw + ?Sized, L: Lane, const D: usize> {
    elastic: &'a K::Tangent<L, D>,
    factor: f64,
    deviator: &'a DeviatorTangent<L, K::Tangent<L, 3>>,
}

impl<K: PointLaw + ?Sized, L: Lane, const D: usize> Contraction<L, D> for Elastic<'_, K, L, D> {
    #[inline(always)]
    fn contract(&self, strain: &Square<L, D>) -> Square<L, D> {
        K::contract(self.0, strain)
    }
}

impl<K: PointLaw + ?Sized, L: Lane, const D: usize> Contraction<L, D> for Relaxing<'_, K, L, D> {
    #[inline(always)]
    fn contract(&self, strain: &Square<L, D>) -> Square<L, D> {
        let added = FiniteDeviator::<K>::contract(self.deviator, &in_space(strain));
        let factor = strain[0][0].constant(self.factor);
        sum(&K::contract(self.elastic, strain), &scale_all(&in_plane(&added), factor))
    }
}

/// `A_iJkL` times the volume, as `[i][k][L][J]`.
#[inline(always)]
fn elasticity<C: Contraction<L, D>, L: Lane, const D: usize>(
    second_piola: &Square<L, D>,
    tangent: &C,
    sample: &Sample<L, D, 1>,
    wanted: Selected<L>,
) -> [[Square<L, D>; D]; D] {
    let volume = sample.volume;
    let f = plus_one(&sample.grad_u[0]);
    let zero = volume.constant(0.0);
    let half = volume.constant(0.5);
    let carrier = scale_all(&f, volume * wanted.material);
    let stress = scale_all(second_piola, volume * wanted.geometric);
    // columns[K][L][J][i] = F_iI C_IJKL
    let mut columns = [[[[zero; D]; D]; D]; D];
    for k in 0..D {
        for l in k..D {
            let mut strain = [[zero; D]; D];
            strain[k][l] = half;
            strain[l][k] = strain[l][k] + half;
            let change = tangent.contract(&strain);
            columns[k][l] = transpose(&product(&carrier, &change));
            columns[l][k] = columns[k][l];
        }
    }
    let mut out = [[[[zero; D]; D]; D]; D];
    for i in 0..D {
        for k in 0..D {
            for j in 0..D {
                for l in 0..D {
                    let mut sum = if i == k { stress[j][l] } else { zero };
                    for m in 0..D {
                        sum = f[k][m].mul_add(columns[m][l][j][i], sum);
                    }
                    out[i][k][l][j] = sum;
                }
            }
        }
    }
    out
}
