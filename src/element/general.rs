//! The solid kernel for any law: internal force `Q`, `K_0 + K_NL` and `K_S` of a group, four
//! elements at a time. It is compiled once for each type of [`PointLaw`].
//!
//! `K_ab = g_a . A g_b` with the reference gradients `g_a` of the shape functions and the first
//! elasticity tensor `A_iJkL = F_iI C_IJKL F_kK + delta_ik S_JL`. [`PointLaw::contract`] gives the
//! columns of `C`. Only blocks `b >= a` are summed; the others follow by symmetry.

use super::Inverted;
use super::batch::{Sample, check};
use super::tangent::Wanted;
use super::workspace::{Job, Workspace};
use crate::lanes::{Lane, LaneTask, WIDTH};
use crate::material::{PointLaw, Response};
use crate::square::{Row, Square, apply, apply_add, det_minus_one, plus_one, product, scale_all, transpose};

/// A job with the parts of a law.
pub(super) struct General<'a, K: ?Sized, const D: usize> {
    job: Job<'a, D>,
    /// One entry for each pass.
    parts: Vec<Box<K>>,
}

impl<'a, K: ?Sized, const D: usize> General<'a, K, D> {
    pub fn new(job: Job<'a, D>, parts: Vec<Box<K>>) -> Self {
        Self { job, parts }
    }
}

impl<K: PointLaw + ?Sized, const D: usize> LaneTask for General<'_, K, D> {
    type Output = std::result::Result<(), Inverted>;

    #[inline(always)]
    fn run<L: Lane>(self, unit: L) -> Self::Output {
        let Job { group, u, request, sink } = self.job;
        let n = group.kind.nodes();
        let wanted = request.stiffness.map(|terms| Wanted::new(unit, terms));
        let mut work = Workspace::<L, D>::new(unit, group);
        let mut reserves = Vec::new();
        let mut gradients = vec![[unit.constant(0.0); D]; n];
        let batches = group.elements.chunks(WIDTH).zip(group.nodes.chunks_exact(n));
        for (batch, ((elements, nodes), points)) in batches.zip(group.points.chunks_exact(n)).enumerate() {
            work.gather(unit, nodes, points, u);
            reserves.clear();
            let mut point = 0;
            for (pass, law) in group.passes.iter().zip(&self.parts) {
                for q in 0..pass.samples() {
                    let sample = work.batch.locate(unit, pass, q);
                    for (gradient, slope) in gradients.iter_mut().zip(&work.batch.slopes) {
                        *gradient = apply(&sample.map, slope);
                    }
                    let det_f = add_law(&mut work, &gradients, &sample, &**law, wanted);
                    work.det_f[point] = det_f.lanes();
                    if let Some(reserve) = law.reserve(&sample.grad_u[0]) {
                        reserves.push(reserve.lanes());
                    }
                    point += 1;
                }
            }
            check(&work.det_f, &reserves, elements, &group.passes)?;
            work.emit(batch * WIDTH, elements.len(), wanted.is_some(), sink);
        }
        Ok(())
    }
}

/// Adds one sample; returns `det F` there.
#[inline(always)]
fn add_law<K: PointLaw + ?Sized, L: Lane, const D: usize>(
    work: &mut Workspace<L, D>,
    gradients: &[Row<L, D>],
    sample: &Sample<L, D, 1>,
    law: &K,
    wanted: Option<Wanted<L>>,
) -> L {
    let grad_u = &sample.grad_u[0];
    let f = plus_one(grad_u);
    let second_piola = match wanted {
        None => law.stress(grad_u),
        Some(wanted) => {
            let response = law.respond(grad_u);
            let elasticity = elasticity::<K, L, D>(&response, &f, sample.volume, wanted);
            work.blocks.add_elasticity(gradients, &elasticity);
            response.second_piola
        }
    };
    let flux = scale_all(&product(&f, &second_piola), sample.volume);
    for (force, gradient) in work.force.iter_mut().zip(gradients) {
        *force = apply_add(&flux, gradient, force);
    }
    det_minus_one(grad_u) + sample.volume.constant(1.0)
}

/// `A_iJkL` times the volume, as `[i][k][L][J]`.
#[inline(always)]
fn elasticity<K: PointLaw + ?Sized, L: Lane, const D: usize>(
    response: &Response<L, K::Tangent<L, D>, D>,
    f: &Square<L, D>,
    volume: L,
    wanted: Wanted<L>,
) -> [[Square<L, D>; D]; D] {
    let zero = volume.constant(0.0);
    let half = volume.constant(0.5);
    let carrier = scale_all(f, volume * wanted.material);
    let stress = scale_all(&response.second_piola, volume * wanted.geometric);
    // columns[K][L][J][i] = F_iI C_IJKL
    let mut columns = [[[[zero; D]; D]; D]; D];
    for k in 0..D {
        for l in k..D {
            let mut strain = [[zero; D]; D];
            strain[k][l] = half;
            strain[l][k] = strain[l][k] + half;
            let change = K::contract(&response.tangent, &strain);
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
