//! History and energies of the Prony series of a group (theory, section 3.15).
//!
//! A history holds the symmetric tensors of each point of the full rule in space, with their
//! components in the order of [`Cauchy`](super::Cauchy): `S_iso` at the start of the step, then `H_i` of
//! each branch. In plane strain the components `yz` and `xz` are left out.

use super::batch::Batch;
use super::group::{ElementGroup, Formulation};
use super::kinematics::Kinematics;
use crate::lanes::{Lane, LaneTask, Pack, Real, WIDTH, dispatch};
use crate::material::{
    Deviator, FiniteDeviator, IsotropicLaw, Law, LawPart, LawTask, LinearDeviator, Overstress, Part,
    PronySeries,
};
use crate::square::{Square, double_dot, scale_all, sum};

/// Positions of the components.
const PLACES: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [0, 1], [1, 2], [0, 2]];

/// Number of components of a symmetric tensor in space that can differ from zero in `dimension`
/// dimensions.
pub const fn components(dimension: usize) -> usize {
    if dimension == 2 { 4 } else { 6 }
}

/// Stresses of the branches of a group at the start of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct ViscousHistory {
    /// Components `[((batch * points + q) * (branches + 1) + tensor) * components + c]` \[Pa\].
    values: Vec<Pack>,
    components: usize,
    branches: usize,
}

/// Energies of the branches of a group \[J\] (in 2D per metre of depth).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ViscousEnergies {
    /// Work against the stresses of the branches in the step, by the trapezoidal rule.
    pub work: f64,
    /// Energy of the springs of the branches at the end of the step.
    pub stored: f64,
}

impl ViscousHistory {
    /// Number of tensors of a point.
    fn tensors(&self) -> usize {
        self.branches + 1
    }

    /// The tensors of each point of each batch.
    fn points(&self) -> impl Iterator<Item = &[Pack]> {
        self.values.chunks_exact(self.tensors() * self.components)
    }

    /// The relaxed state of a body with these isochoric stresses: the branches carry nothing.
    pub fn relaxed(series: &PronySeries, isochoric: &[Pack], dimension: usize) -> Self {
        let components = components(dimension);
        let branches = series.branches().len();
        let mut values = Vec::with_capacity(isochoric.len() * (branches + 1));
        for stress in isochoric.chunks_exact(components) {
            values.extend_from_slice(stress);
            values.resize(values.len() + branches * components, [0.0; WIDTH]);
        }
        Self { values, components, branches }
    }

    /// Advances the history by a step of length `elapsed` \[s\] that ends with these isochoric stresses.
    pub fn advance(&mut self, series: &PronySeries, elapsed: f64, isochoric: &[Pack]) {
        let width = self.components;
        let size = self.tensors() * width;
        for (values, stress) in self.values.chunks_exact_mut(size).zip(isochoric.chunks_exact(width)) {
            let (start, stresses) = values.split_at_mut(width);
            for (branch, own) in series.branches().iter().zip(stresses.chunks_exact_mut(width)) {
                let decay = branch.decay(elapsed);
                let gain = branch.weight * branch.mean_decay(elapsed);
                for (own, (start, stress)) in own.iter_mut().zip(start.iter().zip(stress)) {
                    for lane in 0..WIDTH {
                        own[lane] = decay * own[lane] + gain * (stress[lane] - start[lane]);
                    }
                }
            }
            start.copy_from_slice(stress);
        }
    }

    /// Writes the stress that this history adds `elapsed` \[s\] after its time into `out`.
    pub fn predict(&self, series: &PronySeries, elapsed: f64, out: &mut Overstress) {
        let width = self.components;
        out.factor = series.factor(elapsed);
        out.predicted.clear();
        for values in self.points() {
            let (start, stresses) = values.split_at(width);
            let first = out.predicted.len();
            out.predicted.resize(first + width, [0.0; WIDTH]);
            let sums = &mut out.predicted[first..];
            for (branch, own) in series.branches().iter().zip(stresses.chunks_exact(width)) {
                let decay = branch.decay(elapsed);
                let gain = branch.weight * branch.mean_decay(elapsed);
                for (sum, (own, start)) in sums.iter_mut().zip(own.iter().zip(start)) {
                    for lane in 0..WIDTH {
                        sum[lane] += decay * own[lane] - gain * start[lane];
                    }
                }
            }
        }
    }

    /// A history without values, to be filled by [`set`](Self::set).
    pub fn zero(series: &PronySeries, batches_and_points: usize, dimension: usize) -> Self {
        let (components, branches) = (components(dimension), series.branches().len());
        let values = vec![[0.0; WIDTH]; batches_and_points * (branches + 1) * components];
        Self { values, components, branches }
    }

    /// Components of all tensors of an element at one of its `points`, for a checkpoint.
    pub fn at(&self, index: usize, points: usize, point: usize) -> impl Iterator<Item = f64> {
        let size = self.tensors() * self.components;
        let first = (index / WIDTH * points + point) * size;
        self.values[first..first + size].iter().map(move |pack| pack[index % WIDTH])
    }

    /// Sets the components of all tensors of an element at one of its `points`.
    pub fn set(&mut self, index: usize, points: usize, point: usize, values: &[f64]) {
        let size = self.tensors() * self.components;
        let first = (index / WIDTH * points + point) * size;
        for (pack, value) in self.values[first..first + size].iter_mut().zip(values) {
            pack[index % WIDTH] = *value;
        }
    }
}

/// `factor isochoric + predicted` at a sample, in the plane or in space.
#[inline(always)]
pub(super) fn added_stress<L: Lane, const D: usize>(
    viscous: &Overstress,
    number: usize,
    isochoric: &Square<L, 3>,
) -> Square<L, D> {
    in_plane(&added_in_space::<L, D>(viscous, number, isochoric))
}

/// `factor isochoric + predicted` at a sample.
#[inline(always)]
fn added_in_space<L: Lane, const D: usize>(
    viscous: &Overstress,
    number: usize,
    isochoric: &Square<L, 3>,
) -> Square<L, 3> {
    let unit = isochoric[0][0];
    let out = scale_all(isochoric, unit.constant(viscous.factor));
    let width = components(D);
    match viscous.predicted.get(number * width..(number + 1) * width) {
        Some(values) => sum(&out, &tensor(unit, values)),
        None => out,
    }
}

/// The symmetric tensor with these components.
#[inline(always)]
fn tensor<L: Lane>(unit: L, values: &[Pack]) -> Square<L, 3> {
    let mut out = [[unit.constant(0.0); 3]; 3];
    for (value, [i, j]) in values.iter().zip(PLACES) {
        out[i][j] = unit.load(*value);
        out[j][i] = out[i][j];
    }
    out
}

/// A gradient or strain of plane strain in space.
#[inline(always)]
pub(super) fn in_space<T: Real, const D: usize>(a: &Square<T, D>) -> Square<T, 3> {
    let mut out = [[a[0][0].constant(0.0); 3]; 3];
    for i in 0..D {
        for j in 0..D {
            out[i][j] = a[i][j];
        }
    }
    out
}

/// The components of a tensor in the first `D` directions.
#[inline(always)]
pub(super) fn in_plane<T: Real, const D: usize>(a: &Square<T, 3>) -> Square<T, D> {
    let mut out = [[a[0][0]; D]; D];
    for i in 0..D {
        for j in 0..D {
            out[i][j] = a[i][j];
        }
    }
    out
}

impl<const D: usize> ElementGroup<D> {
    /// Number of points of the full rule.
    pub fn full_points(&self) -> usize {
        self.passes[0].samples()
    }

    /// Number of batches of elements times [`full_points`](Self::full_points).
    pub fn points_of_batches(&self) -> usize {
        self.elements.len().div_ceil(WIDTH) * self.full_points()
    }
}

/// Does a task with the isochoric part of the law of its group.
pub(super) fn compute<K: DeviatorTask>(task: K) -> K::Output {
    let formulation = *task.formulation();
    match formulation.kinematics {
        Kinematics::Linear => {
            let deviator = LinearDeviator { mu: formulation.moduli().mu };
            dispatch(InLanes { task, deviator: &deviator })
        }
        Kinematics::Finite => formulation.material.accept(OfLaw(task)),
    }
}

/// Something to be done with the isochoric part of a law, in lanes.
pub(super) trait DeviatorTask: Sized {
    type Output;
    fn formulation(&self) -> &Formulation;
    fn run<V: Deviator, L: Lane>(self, deviator: &V, unit: L) -> Self::Output;
}

struct InLanes<'a, K, V> {
    task: K,
    deviator: &'a V,
}

impl<K: DeviatorTask, V: Deviator> LaneTask for InLanes<'_, K, V> {
    type Output = K::Output;
    #[inline(always)]
    fn run<L: Lane>(self, unit: L) -> K::Output {
        self.task.run(self.deviator, unit)
    }
}

/// Selects the isochoric part of a law at finite strain.
struct OfLaw<K>(K);

impl<K: DeviatorTask> LawTask for OfLaw<K> {
    type Output = K::Output;

    fn run<P: Law>(self, law: &P) -> K::Output {
        let part = LawPart::<P>(law.constants(Part::Shear));
        dispatch(InLanes { task: self.0, deviator: &FiniteDeviator(&part) })
    }

    fn run_isotropic<P: IsotropicLaw>(self, law: &P) -> K::Output {
        let part = law.energy_of_part(Part::Shear);
        dispatch(InLanes { task: self.0, deviator: &FiniteDeviator(&*part) })
    }
}

/// Calls `visit(batch, number, sample)` at all points of the full rule.
macro_rules! for_every_sample {
    ($unit:ident, $group:ident, $states:literal, $u:expr, |$batch:ident, $number:ident, $sample:ident| $body:block, $end:expr) => {{
        let n = $group.kind.nodes();
        let mut nodes_of_batch = Batch::<L, D, $states>::new($unit, $group);
        let batches = $group.nodes.chunks_exact(n).zip($group.points.chunks_exact(n));
        let pass = &$group.passes[0];
        for ($batch, (nodes, points)) in batches.enumerate() {
            nodes_of_batch.gather($unit, nodes, points, $u);
            for q in 0..pass.samples() {
                let $sample = nodes_of_batch.locate($unit, pass, q);
                let $number = $batch * pass.samples() + q;
                $body
            }
            $end
        }
    }};
}

pub(super) struct Stresses<'a, const D: usize> {
    pub group: &'a ElementGroup<D>,
    pub u: &'a [f64],
    pub out: &'a mut Vec<Pack>,
}

impl<const D: usize> DeviatorTask for Stresses<'_, D> {
    type Output = ();

    fn formulation(&self) -> &Formulation {
        &self.group.formulation
    }

    #[inline(always)]
    fn run<V: Deviator, L: Lane>(self, deviator: &V, unit: L) {
        let Self { group, u, out } = self;
        for_every_sample!(
            unit,
            group,
            1,
            [u],
            |_batch, _number, sample| {
                let stress = deviator.stress(&in_space(&sample.grad_u[0]));
                for [i, j] in &PLACES[..components(D)] {
                    out.push(stress[*i][*j].lanes());
                }
            },
            ()
        );
    }
}

pub(super) struct IsochoricEnergy<'a, const D: usize> {
    pub group: &'a ElementGroup<D>,
    pub u: &'a [f64],
    pub mine: &'a [bool],
}

impl<const D: usize> DeviatorTask for IsochoricEnergy<'_, D> {
    type Output = f64;

    fn formulation(&self) -> &Formulation {
        &self.group.formulation
    }

    #[inline(always)]
    fn run<V: Deviator, L: Lane>(self, deviator: &V, unit: L) -> f64 {
        let Self { group, u, mine } = self;
        let mut total = 0.0;
        let mut sum = unit.constant(0.0);
        for_every_sample!(
            unit,
            group,
            1,
            [u],
            |batch, _number, sample| {
                sum = deviator.energy(&in_space(&sample.grad_u[0])).mul_add(sample.volume, sum);
            },
            {
                total += own_sum(group, batch, sum, mine);
                sum = unit.constant(0.0);
            }
        );
        total
    }
}

/// Sum over the elements of a batch with `mine[element]`.
fn own_sum<L: Lane, const D: usize>(group: &ElementGroup<D>, batch: usize, sum: L, mine: &[bool]) -> f64 {
    let elements = group.elements.iter().skip(batch * WIDTH).take(WIDTH);
    let own = elements.zip(sum.lanes()).filter(|(element, _)| mine[**element as usize]);
    own.map(|(_, value)| value).sum()
}

pub(super) struct BranchEnergies<'a, const D: usize> {
    pub group: &'a ElementGroup<D>,
    pub series: &'a PronySeries,
    pub history: &'a ViscousHistory,
    pub elapsed: f64,
    pub u: [&'a [f64]; 2],
    pub mine: &'a [bool],
    /// Shear modulus of the law at small strain \[Pa\].
    pub mu: f64,
}

impl<const D: usize> DeviatorTask for BranchEnergies<'_, D> {
    type Output = ViscousEnergies;

    fn formulation(&self) -> &Formulation {
        &self.group.formulation
    }

    #[inline(always)]
    fn run<V: Deviator, L: Lane>(self, deviator: &V, unit: L) -> ViscousEnergies {
        let Self { group, series, history, elapsed, u, mine, mu } = self;
        let width = components(D);
        let size = history.tensors() * width;
        let zero = unit.constant(0.0);
        let mut out = ViscousEnergies::default();
        let mut work = zero;
        let mut stored = zero;
        for_every_sample!(
            unit,
            group,
            2,
            u,
            |batch, number, sample| {
                let [start, end] = [in_space(&sample.grad_u[0]), in_space(&sample.grad_u[1])];
                let values = &history.values[number * size..(number + 1) * size];
                let isochoric = deviator.stress(&end);
                let gained = minus(&isochoric, &tensor(unit, &values[..width]));
                let mut both = [[zero; 3]; 3];
                for (branch, values) in series.branches().iter().zip(values[width..].chunks_exact(width)) {
                    let before = tensor(unit, values);
                    let gain = unit.constant(branch.weight * branch.mean_decay(elapsed));
                    let left = scale_all(&before, unit.constant(branch.decay(elapsed)));
                    let after = sum(&left, &scale_all(&gained, gain));
                    both = sum(&both, &sum(&before, &after));
                    let modulus = branch.weight * mu;
                    let ratio = scale_all(&after, unit.constant(1.0 / modulus));
                    let energy = deviator.branch_energy(&ratio, &end);
                    stored = energy.mul_add(sample.volume.scale(modulus), stored);
                }
                let strain = minus(&deviator.strain(&end), &deviator.strain(&start));
                work = double_dot(&both, &strain).mul_add(sample.volume.scale(0.5), work);
            },
            {
                out.work += own_sum(group, batch, work, mine);
                out.stored += own_sum(group, batch, stored, mine);
                work = zero;
                stored = zero;
            }
        );
        out
    }
}

#[inline(always)]
fn minus<T: Real>(a: &Square<T, 3>, b: &Square<T, 3>) -> Square<T, 3> {
    sum(a, &scale_all(b, b[0][0].constant(-1.0)))
}

/// The second Piola stress in space that `overstress` adds to the element `index` at one of its `points`, of
/// which the isochoric stress of the law is given \[Pa\].
pub(super) fn overstress_at<const D: usize>(
    overstress: &Overstress,
    index: usize,
    points: usize,
    point: usize,
    isochoric: &Square<f64, 3>,
) -> Square<f64, 3> {
    let width = components(D);
    let mut out = scale_all(isochoric, overstress.factor);
    let first = (index / WIDTH * points + point) * width;
    if let Some(values) = overstress.predicted.get(first..first + width) {
        for (value, [i, j]) in values.iter().zip(PLACES) {
            out[i][j] += value[index % WIDTH];
            if i != j {
                out[j][i] += value[index % WIDTH];
            }
        }
    }
    out
}
