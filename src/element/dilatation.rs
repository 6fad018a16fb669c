//! Volume terms at a projected dilatation (theory, section 3.8).
//!
//! The volumetric energy of an element is `int U(s_h) dV`, where `s_h` is the projection in `L2` of the
//! dilatation `s`, which is `J - 1` for most laws, on the constant functions of the element or on the
//! linear functions of the reference position. With the symmetric projection `P`, the derivative is
//!
//! `int p ds/dF : grad(du) dV` with the pressure `p = P U'(s_h)`,
//!
//! and the second derivative adds to the terms at the points an update of the rank of the space. Nothing
//! is solved: the functions are orthogonal at the points of the full rule.

use super::batch::Sample;
use super::group::Pass;
use super::tangent::{Blocks, Selected};
use super::workspace::Workspace;
use crate::lanes::{Lane, LanePart};
use crate::material::{VolumeLaw, Volumetric};
use crate::square::{Row, Square, apply, apply_add, inner_gram, product, scale_all};

impl<L: Lane, const D: usize> Workspace<L, D> {
    /// Adds the volume terms of a batch. `first` is the number of the first point of the pass.
    #[inline(always)]
    pub fn add_volume_terms(
        &mut self,
        unit: L,
        pass: &Pass,
        law: &VolumeLaw,
        wanted: Option<Selected<L>>,
        first: usize,
    ) {
        unit.apart(VolumeTerms { work: self, unit, pass, law, wanted, first });
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
        let n = work.force.len();
        let terms = &mut work.dilatation;
        for q in 0..pass.samples() {
            let sample = work.batch.locate(unit, pass, q);
            terms.projection.set(q, sample.volume, &work.batch.place(unit, pass, q));
            terms.dilatation[q] = law.dilatation(&sample.grad_u[0]);
        }
        terms.projection.orthogonalize();
        terms.projection.project(&mut terms.dilatation);
        for q in 0..pass.samples() {
            let [slope, curvature] = law.slope_and_curvature(terms.dilatation[q]);
            terms.pressure[q] = slope;
            terms.curvature[q] = curvature;
            work.det_f[first + q] = law.volume_ratio(terms.dilatation[q]).lanes();
        }
        terms.projection.project(&mut terms.pressure);
        terms.flux.fill([unit.constant(0.0); D]);
        for q in 0..pass.samples() {
            let sample = work.batch.locate(unit, pass, q);
            let grad_u = &sample.grad_u[0];
            let map = product(&law.gradient(grad_u), &sample.map);
            let weight = terms.pressure[q] * sample.volume;
            let slopes = &work.batch.slopes;
            let Some(wanted) = wanted else {
                let weighted = scale_all(&map, weight);
                for (force, slope) in work.force.iter_mut().zip(slopes) {
                    *force = apply_add(&weighted, slope, force);
                }
                continue;
            };
            for (mapped, slope) in work.blocks.mapped.iter_mut().zip(slopes) {
                *mapped = apply(&map, slope);
            }
            for a in 0..n {
                let mapped = work.blocks.mapped[a];
                let force = &mut work.force[a];
                for i in 0..D {
                    force[i] = weight.mul_add(mapped[i], force[i]);
                }
                for k in 0..terms.projection.size() {
                    let share = terms.projection.basis[k * pass.samples() + q] * sample.volume;
                    let flux = &mut terms.flux[k * n + a];
                    for i in 0..D {
                        flux[i] = share.mul_add(mapped[i], flux[i]);
                    }
                }
            }
            work.blocks.add_dilatation_curvature(slopes, law, &sample, &map, weight, wanted);
        }
        if let Some(wanted) = wanted {
            let curvatures = terms.projection.curvatures(&terms.curvature);
            for k in 0..terms.projection.size() {
                // The row of H times the fluxes takes the place of the mapped slopes.
                work.blocks.mapped.fill([unit.constant(0.0); D]);
                for l in 0..terms.projection.size() {
                    let factor = curvatures[k][l] * wanted.material;
                    for (sum, flux) in work.blocks.mapped.iter_mut().zip(&terms.flux[l * n..(l + 1) * n]) {
                        for i in 0..D {
                            sum[i] = factor.mul_add(flux[i], sum[i]);
                        }
                    }
                }
                work.blocks.add_outer(&terms.flux[k * n..(k + 1) * n]);
            }
        }
    }
}

impl<L: Lane, const D: usize> Blocks<L, D> {
    /// Adds `weight` times the second derivative of the dilatation at a sample. `map` is the product of
    /// `ds/dF` and the map of the sample, and `mapped` has its product with the slopes.
    #[inline(always)]
    pub fn add_dilatation_curvature<const STATES: usize>(
        &mut self,
        slopes: &[Row<L, D>],
        law: &VolumeLaw,
        sample: &Sample<L, D, STATES>,
        map: &Square<L, D>,
        weight: L,
        wanted: Selected<L>,
    ) {
        match law.form {
            // d2J = (h_a h_b^T - h_b h_a^T) / J with the cofactors h; its part in K_S is (h_a . h_b) / J.
            Volumetric::Rubber | Volumetric::Logarithmic => {
                let ratio = law.volume_ratio(law.dilatation(&sample.grad_u[0]));
                let weight = weight * ratio.recip();
                self.add_skew(weight * wanted.material);
                let apart = wanted.geometric - wanted.material;
                if !apart.vanishes() {
                    self.add_isotropic(slopes, &scale_all(&inner_gram(map), weight * apart));
                }
            }
            Volumetric::GreenTrace => {
                self.add_isotropic(slopes, &scale_all(&inner_gram(&sample.map), weight * wanted.geometric));
            }
            Volumetric::SmallTrace => {}
        }
    }
}
