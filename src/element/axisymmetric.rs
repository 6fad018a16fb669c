//! Elements of bodies of revolution: internal force, stiffness and energy of a group whose plane is a
//! meridian (theory, section 3.20).
//!
//! With the reference gradients `g_a` of the shape functions in the meridian and the ratios `n_a = N_a /
//! R`, a node has the strain `B_a` with the rows `F_iI g_I` of the plane and, for the radial component
//! alone, `(1 + u_r / R) n_a` around the axis. The measure is `2 pi R dA`. All results are those of the
//! whole revolution.

use super::Inverted;
use super::batch::{Batch, check};
use super::group::{ElementGroup, Pass, Sampling};
use super::kinematics::Kinematics;
use super::linearised_pressure::{LinearisedPressure, PressureChange, VolumeSamples};
use super::projection::Dilatation;
use super::tangent::{Blocks, Selected};
use super::workspace::{Job, Workspace};
use crate::composed::LaneWise;
use crate::lanes::{Lane, LaneTask, WIDTH, dispatch};
use crate::material::{Axisymmetric, HOOP_COMPONENTS, HoopGradient, Part, VolumeLaw, Volumetric};
use crate::square::{
    Row, Square, apply, cofactor, det_minus_one, diagonal, dot, double_dot, inner_gram, plus_one, scale_all,
    sum,
};

/// Circumference of the unit circle.
const TURN: f64 = std::f64::consts::TAU;

/// Index of the radial component.
const RADIAL: usize = 0;

impl<const D: usize> ElementGroup<D> {
    /// Evaluates the job of an axisymmetric group.
    pub(super) fn evaluate_axisymmetric(job: Job<'_, D>) -> std::result::Result<(), Inverted> {
        let parts = job.group.axisymmetric_parts();
        dispatch(Evaluate { job, parts })
    }

    /// Strain energy \[J\] of the elements with `mine[element]` of an axisymmetric group.
    pub(super) fn axisymmetric_energy(&self, u: &[f64], mine: &[bool]) -> f64 {
        dispatch(Energy { group: self, u, mine, parts: self.axisymmetric_parts() })
    }

    /// Evaluates the job of an axisymmetric group.
    pub(super) fn axisymmetric_pressure_change(job: PressureChange<'_, D>) {
        dispatch(Around(job));
    }

    fn axisymmetric_parts(&self) -> Vec<Axisymmetric> {
        self.parts(|part| self.formulation.axisymmetric(part))
    }
}

impl super::Formulation {
    /// A part of the law of an axisymmetric group.
    pub(super) fn axisymmetric(&self, part: Part) -> Axisymmetric {
        match self.kinematics {
            Kinematics::Finite => Axisymmetric::new(&self.material, part),
            Kinematics::Linear => Axisymmetric::linear(&self.moduli(), part),
        }
    }
}

/// Displacement gradient and volume at one sample.
pub(super) struct Ring<L, const D: usize> {
    /// Reference volume of the sample over the whole revolution \[m^3\].
    volume: L,
    at: HoopGradient<L, D>,
}

/// Shape functions at a sample.
pub(super) struct RingShape<L, const D: usize> {
    /// `g_a` [1/m].
    gradients: Vec<Row<L, D>>,
    /// `n_a` [1/m].
    ratios: Vec<L>,
    /// Integrals of both over the points so far, if a pass needs their mean.
    mean_gradients: Vec<Row<L, D>>,
    mean_ratios: Vec<L>,
    volume: L,
}

impl<L: Lane, const D: usize> RingShape<L, D> {
    #[inline(always)]
    pub fn new(unit: L, group: &ElementGroup<D>) -> Self {
        let n = group.kind.nodes();
        let zero = unit.constant(0.0);
        Self {
            gradients: vec![[zero; D]; n],
            ratios: vec![zero; n],
            mean_gradients: vec![[zero; D]; n],
            mean_ratios: vec![zero; n],
            volume: zero,
        }
    }

    /// The displacement gradient at the sample to which the shape moved last.
    #[inline(always)]
    fn gradient(&self, unit: L, displacements: &[Row<L, D>]) -> HoopGradient<L, D> {
        let zero = unit.constant(0.0);
        let mut plane = [[zero; D]; D];
        let mut hoop = zero;
        for (a, displacement) in displacements.iter().enumerate() {
            for i in 0..D {
                for k in 0..D {
                    plane[i][k] = displacement[i].mul_add(self.gradients[a][k], plane[i][k]);
                }
            }
            hoop = displacement[RADIAL].mul_add(self.ratios[a], hoop);
        }
        HoopGradient { plane, hoop }
    }
}

impl<L: Lane, const D: usize> VolumeSamples<L, D> for RingShape<L, D> {
    type Sample = Ring<L, D>;

    #[inline(always)]
    fn clear(&mut self, unit: L) {
        let zero = unit.constant(0.0);
        self.mean_gradients.fill([zero; D]);
        self.mean_ratios.fill(zero);
        self.volume = zero;
    }

    #[inline(always)]
    fn locate(&mut self, unit: L, batch: &mut Batch<L, D, 1>, pass: &Pass, q: usize) -> Ring<L, D> {
        let n = self.ratios.len();
        let volume = if pass.sampling == Sampling::Mean {
            let inverse = self.volume.recip();
            for a in 0..n {
                for k in 0..D {
                    self.gradients[a][k] = self.mean_gradients[a][k] * inverse;
                }
                self.ratios[a] = self.mean_ratios[a] * inverse;
            }
            self.volume
        } else {
            let sample = batch.locate(unit, pass, q);
            let radius = batch.place(unit, pass, q)[RADIAL];
            let inverse = radius.recip();
            let volume = sample.volume * radius.scale(TURN);
            for a in 0..n {
                self.gradients[a] = apply(&sample.map, &batch.slopes[a]);
                self.ratios[a] = inverse.scale(pass.table.n[q * n + a]);
                for k in 0..D {
                    self.mean_gradients[a][k] =
                        volume.mul_add(self.gradients[a][k], self.mean_gradients[a][k]);
                }
                self.mean_ratios[a] = volume.mul_add(self.ratios[a], self.mean_ratios[a]);
            }
            self.volume = self.volume + volume;
            volume
        };
        Ring { volume, at: self.gradient(unit, batch.displacements(0)) }
    }

    #[inline(always)]
    fn moved(&self, _: &Batch<L, D, 1>, at: &Self::Sample, displacements: &[Row<L, D>]) -> Self::Sample {
        Ring { volume: at.volume, at: self.gradient(at.volume, displacements) }
    }

    #[inline(always)]
    fn volume(at: &Self::Sample) -> L {
        at.volume
    }

    #[inline(always)]
    fn dilatation(law: &VolumeLaw, at: &Self::Sample) -> L {
        law.dilatation(&at.at.in_space())
    }

    #[inline(always)]
    fn change(law: &VolumeLaw, from: &Self::Sample, to: &Self::Sample) -> L {
        let minus_one = from.volume.constant(-1.0);
        let motion = sum(&to.at.in_space(), &scale_all(&from.at.in_space(), minus_one));
        double_dot(&law.gradient(&from.at.in_space()), &motion)
    }

    #[inline(always)]
    fn add_force(&self, work: &mut Workspace<L, D>, law: &VolumeLaw, at: &Self::Sample, weight: L) {
        let slope = DilatationSlope::new(law, &at.at);
        for a in 0..self.ratios.len() {
            let of_node = slope.of_node(&self.gradients[a], self.ratios[a]);
            for i in 0..D {
                work.force[a][i] = weight.mul_add(of_node[i], work.force[a][i]);
            }
        }
    }

    #[inline(always)]
    fn add_stiffness(
        &self,
        work: &mut Workspace<L, D>,
        law: &VolumeLaw,
        at: &Self::Sample,
        weight: L,
        wanted: Selected<L>,
    ) {
        let slope = DilatationSlope::new(law, &at.at);
        slope.add_curvature(&mut work.blocks, self, law, &at.at, weight, wanted);
    }
}

/// The change of the pressure around the axis.
struct Around<'a, const D: usize>(PressureChange<'a, D>);

impl<const D: usize> LaneTask for Around<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane>(self, unit: L) {
        let shape = RingShape::new(unit, self.0.group);
        self.0.sum(unit, shape);
    }
}

/// A job with the parts of its law, one for each pass.
struct Evaluate<'a, const D: usize> {
    job: Job<'a, D>,
    parts: Vec<Axisymmetric>,
}

impl<const D: usize> LaneTask for Evaluate<'_, D> {
    type Output = std::result::Result<(), Inverted>;

    #[inline(always)]
    fn run<L: Lane>(self, unit: L) -> Self::Output {
        let Job { group, u, request, sink, .. } = self.job;
        let n = group.kind.nodes();
        let is_linear = group.formulation.kinematics == Kinematics::Linear;
        let volume_law = group.volume_law();
        let wanted = request.stiffness.map(|terms| Selected::new(unit, terms));
        let mut work = Workspace::<L, D>::new(unit, group);
        let mut pressures = LinearisedPressure::new(unit, group, request.linearised_at);
        let mut shape = RingShape::new(unit, group);
        let mut strains = Strains::new(unit, n);
        let mut reserves = Vec::new();
        let batches = group.elements.chunks(WIDTH).zip(group.nodes.chunks_exact(n));
        for (batch, ((elements, nodes), points)) in batches.zip(group.points.chunks_exact(n)).enumerate() {
            work.gather(unit, nodes, points, u);
            shape.clear(unit);
            reserves.clear();
            let mut point = 0;
            for (pass, law) in group.passes.iter().zip(&self.parts) {
                if let Sampling::Projected(_) = pass.sampling {
                    add_volume_terms(unit, &mut work, &mut shape, pass, &volume_law, wanted, point);
                    point += pass.samples();
                    continue;
                }
                for q in 0..pass.samples() {
                    let ring = shape.locate(unit, &mut work.batch, pass, q);
                    strains.set(unit, &shape, &ring.at, is_linear);
                    match wanted {
                        None => strains.add_force(&mut work, &law.stress(&ring.at), ring.volume),
                        Some(wanted) => {
                            let response = law.respond(&ring.at);
                            strains.add_force(&mut work, &response.stress, ring.volume);
                            strains.add_material(&mut work, &response.tangent, ring.volume * wanted.material);
                            if !is_linear {
                                let weight = ring.volume * wanted.geometric;
                                let [one, two, shear, hoop] = response.stress;
                                let mut metric = diagonal(one);
                                metric[1][1] = two;
                                metric[0][1] = shear;
                                metric[1][0] = shear;
                                work.blocks.add_isotropic(&shape.gradients, &scale_all(&metric, weight));
                                work.blocks.add_radial(&shape.ratios, hoop * weight);
                            }
                        }
                    }
                    work.det_f[point] = if is_linear {
                        // Geometry does not change, so nothing can invert. A NaN must still show.
                        (ring.at.hoop.scale(0.0) + ring.at.plane[0][0].scale(0.0) + unit.constant(1.0))
                            .lanes()
                    } else {
                        volume_ratio(&ring.at).lanes()
                    };
                    if let Some(reserve) = law.reserve(&ring.at) {
                        reserves.push(reserve.lanes());
                    }
                    point += 1;
                }
            }
            if let (Some(wanted), Some(pressures)) = (wanted, &mut pressures) {
                pressures.add_stiffness(unit, &mut work, &mut shape, group, nodes, wanted);
            }
            check(&work.det_f, &reserves, elements, &group.passes)?;
            work.emit(unit, batch * WIDTH, elements.len(), wanted.is_some(), sink);
        }
        Ok(())
    }
}

/// `det F`; not positive where the plane or the circle is inverted.
#[inline(always)]
fn volume_ratio<L: Lane, const D: usize>(at: &HoopGradient<L, D>) -> L {
    let one = at.hoop.constant(1.0);
    let plane = det_minus_one(&at.plane) + one;
    let [ratio] = L::lane_wise([plane, at.hoop + one], |[plane, hoop]| {
        // Both may be negative, whose product is positive.
        [if hoop > 0.0 { plane * hoop } else { hoop }]
    });
    ratio
}

/// Strains of unit displacements of the nodes at a sample.
struct Strains<L, const D: usize> {
    /// `[node][component of the displacement]`: `E_11, E_22, 2 E_12, E_33`.
    of: Vec<[Row<L, HOOP_COMPONENTS>; D]>,
    /// Stresses of these strains times the volume.
    stresses: Vec<[Row<L, HOOP_COMPONENTS>; D]>,
}

impl<L: Lane, const D: usize> Strains<L, D> {
    #[inline(always)]
    fn new(unit: L, n: usize) -> Self {
        let zero = [[unit.constant(0.0); HOOP_COMPONENTS]; D];
        Self { of: vec![zero; n], stresses: vec![zero; n] }
    }

    #[inline(always)]
    fn set(&mut self, unit: L, shape: &RingShape<L, D>, at: &HoopGradient<L, D>, is_linear: bool) {
        let zero = unit.constant(0.0);
        let f = if is_linear { diagonal(unit.constant(1.0)) } else { plus_one(&at.plane) };
        let stretch = if is_linear { unit.constant(1.0) } else { at.hoop + unit.constant(1.0) };
        for a in 0..self.of.len() {
            let g = &shape.gradients[a];
            for i in 0..D {
                let shear = f[i][0].mul_add(g[1], f[i][1] * g[0]);
                self.of[a][i] = [f[i][0] * g[0], f[i][1] * g[1], shear, zero];
            }
            self.of[a][RADIAL][HOOP_COMPONENTS - 1] = stretch * shape.ratios[a];
        }
    }

    /// Adds `B_a^T S`.
    #[inline(always)]
    fn add_force(&self, work: &mut Workspace<L, D>, stress: &[L; HOOP_COMPONENTS], volume: L) {
        let mut weighted = *stress;
        for m in 0..HOOP_COMPONENTS {
            weighted[m] = stress[m] * volume;
        }
        for a in 0..self.of.len() {
            for i in 0..D {
                work.force[a][i] = work.force[a][i] + dot(&self.of[a][i], &weighted);
            }
        }
    }

    /// Adds `B_a^T C B_b`.
    #[inline(always)]
    fn add_material(
        &mut self,
        work: &mut Workspace<L, D>,
        tangent: &[[L; HOOP_COMPONENTS]; HOOP_COMPONENTS],
        weight: L,
    ) {
        let weighted = scale_all(tangent, weight);
        for a in 0..self.of.len() {
            for i in 0..D {
                self.stresses[a][i] = apply(&weighted, &self.of[a][i]);
            }
        }
        work.blocks.add_strain_products(&self.stresses, &self.of);
    }
}

/// `ds/dF` and the parts of the second derivative at a sample.
struct DilatationSlope<L, const D: usize> {
    /// In the plane.
    plane: Square<L, D>,
    /// By the stretch around the axis.
    hoop: L,
    /// Volume ratio of the plane.
    ratio: L,
    /// Stretch around the axis.
    stretch: L,
}

impl<L: Lane, const D: usize> DilatationSlope<L, D> {
    #[inline(always)]
    fn new(law: &VolumeLaw, at: &HoopGradient<L, D>) -> Self {
        let one = at.hoop.constant(1.0);
        let ratio = det_minus_one(&at.plane) + one;
        let stretch = at.hoop + one;
        let (plane, hoop) = match law.form {
            Volumetric::Rubber | Volumetric::Logarithmic => {
                (scale_all(&cofactor(&plus_one(&at.plane)), stretch), ratio)
            }
            Volumetric::GreenTrace => (plus_one(&at.plane), stretch),
            Volumetric::SmallTrace => (diagonal(one), one),
        };
        Self { plane, hoop, ratio, stretch }
    }

    /// Adds `weight` times the second derivative of the dilatation.
    #[inline(always)]
    fn add_curvature(
        &self,
        blocks: &mut Blocks<L, D>,
        shape: &RingShape<L, D>,
        law: &VolumeLaw,
        at: &HoopGradient<L, D>,
        weight: L,
        wanted: Selected<L>,
    ) {
        match law.form {
            Volumetric::Rubber | Volumetric::Logarithmic => {
                let cofactors = cofactor(&plus_one(&at.plane));
                for (mapped, gradient) in blocks.mapped.iter_mut().zip(&shape.gradients) {
                    *mapped = apply(&cofactors, gradient);
                }
                let per_area = self.stretch * self.ratio.recip();
                blocks.add_skew(weight * per_area * wanted.material);
                blocks.add_radial_cross(&shape.ratios, weight * wanted.material);
                let apart = wanted.geometric - wanted.material;
                if !apart.vanishes() {
                    let metric = scale_all(&inner_gram(&cofactors), weight * per_area * apart);
                    blocks.add_isotropic(&shape.gradients, &metric);
                    blocks.add_radial(&shape.ratios, weight * per_area.recip() * apart);
                }
            }
            Volumetric::GreenTrace => {
                let metric = diagonal(weight * wanted.geometric);
                blocks.add_isotropic(&shape.gradients, &metric);
                blocks.add_radial(&shape.ratios, weight * wanted.geometric);
            }
            Volumetric::SmallTrace => {}
        }
    }

    /// `ds` of a unit displacement of a node.
    #[inline(always)]
    fn of_node(&self, gradient: &Row<L, D>, ratio: L) -> Row<L, D> {
        let mut flux = apply(&self.plane, gradient);
        flux[RADIAL] = self.hoop.mul_add(ratio, flux[RADIAL]);
        flux
    }
}

/// Adds the volume terms of a batch at a projected dilatation, as
/// [`Workspace::add_volume_terms`] does in the plane. `first` is the number of the first point of the pass.
#[inline(always)]
fn add_volume_terms<L: Lane, const D: usize>(
    unit: L,
    work: &mut Workspace<L, D>,
    shape: &mut RingShape<L, D>,
    pass: &Pass,
    law: &VolumeLaw,
    wanted: Option<Selected<L>>,
    first: usize,
) {
    let n = work.force.len();
    let samples = pass.samples();
    project_dilatation(unit, &mut work.batch, shape, pass, law, &mut work.dilatation);
    let terms = &mut work.dilatation;
    for q in 0..samples {
        let [slope, curvature] = law.slope_and_curvature(terms.dilatation[q]);
        terms.pressure[q] = slope;
        terms.curvature[q] = curvature;
        work.det_f[first + q] = law.volume_ratio(terms.dilatation[q]).lanes();
    }
    terms.projection.project(&mut terms.pressure);
    terms.flux.fill([unit.constant(0.0); D]);
    for q in 0..samples {
        let ring = shape.locate(unit, &mut work.batch, pass, q);
        let slope = DilatationSlope::new(law, &ring.at);
        let weight = terms.pressure[q] * ring.volume;
        for a in 0..n {
            let of_node = slope.of_node(&shape.gradients[a], shape.ratios[a]);
            for i in 0..D {
                work.force[a][i] = weight.mul_add(of_node[i], work.force[a][i]);
            }
            for k in 0..terms.projection.size() {
                let share = terms.projection.basis[k * samples + q] * ring.volume;
                let flux = &mut terms.flux[k * n + a];
                for i in 0..D {
                    flux[i] = share.mul_add(of_node[i], flux[i]);
                }
            }
        }
        let Some(wanted) = wanted else { continue };
        slope.add_curvature(&mut work.blocks, shape, law, &ring.at, weight, wanted);
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

/// Sets the projection of a batch and the projected dilatation at the points.
#[inline(always)]
fn project_dilatation<L: Lane, const D: usize>(
    unit: L,
    batch: &mut Batch<L, D, 1>,
    shape: &mut RingShape<L, D>,
    pass: &Pass,
    law: &VolumeLaw,
    terms: &mut Dilatation<L, D>,
) {
    for q in 0..pass.samples() {
        let ring = shape.locate(unit, batch, pass, q);
        terms.projection.set(q, ring.volume, &batch.place(unit, pass, q));
        terms.dilatation[q] = law.dilatation(&ring.at.in_space());
    }
    terms.projection.orthogonalize();
    terms.projection.project(&mut terms.dilatation);
}

/// The sum of the strain energy, with the parts of the law, one for each pass.
struct Energy<'a, const D: usize> {
    group: &'a ElementGroup<D>,
    u: &'a [f64],
    mine: &'a [bool],
    parts: Vec<Axisymmetric>,
}

impl<const D: usize> LaneTask for Energy<'_, D> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lane>(self, unit: L) -> f64 {
        let Self { group, u, mine, parts } = self;
        let n = group.kind.nodes();
        let mut batch = Batch::<L, D, 1>::new(unit, group);
        let mut shape = RingShape::new(unit, group);
        let mut terms = Dilatation::new(unit, group);
        let law_of_volume = group.volume_law();
        let mut total = 0.0;
        let batches = group.elements.chunks(WIDTH).zip(group.nodes.chunks_exact(n));
        for ((elements, nodes), points) in batches.zip(group.points.chunks_exact(n)) {
            batch.gather(unit, nodes, points, [u]);
            shape.clear(unit);
            let mut sum = unit.constant(0.0);
            for (pass, law) in group.passes.iter().zip(&parts) {
                if let Sampling::Projected(_) = pass.sampling {
                    project_dilatation(unit, &mut batch, &mut shape, pass, &law_of_volume, &mut terms);
                    for q in 0..pass.samples() {
                        let energy = law_of_volume.energy(terms.dilatation[q]);
                        sum = energy.mul_add(terms.projection.volumes()[q], sum);
                    }
                    continue;
                }
                for q in 0..pass.samples() {
                    let ring = shape.locate(unit, &mut batch, pass, q);
                    sum = law.energy(&ring.at).mul_add(ring.volume, sum);
                }
            }
            let own = elements.iter().zip(sum.lanes()).filter(|(element, _)| mine[**element as usize]);
            total += own.map(|(_, energy)| energy).sum::<f64>();
        }
        total
    }
}
