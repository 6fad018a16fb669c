//! Pressures linearised at an earlier state (theory, section 5.1).
//!
//! The volume terms of an element are those of a pressure `p = P U'(s_h)`, with the projection `P` of the
//! dilatation `s` (at single points, the identity). Linearised at an earlier state `e`, the pressure is
//!
//! `p* = P (U'(s_e) + U''(s_e) P ds/dF(e) : (F - F_e))` (5.5).
//!
//! Force and stiffness of the difference `p* - p` are `int (p* - p) ds/dF : grad(du) dV` and the second
//! derivative of the dilatation with the weight `p* - p` (5.6).

use super::ElementSink;
use super::batch::{Batch, Sample};
use super::group::{ElementGroup, Formulation, Pass, Sampling};
use super::kinematics::{Kinematics, gradient_of, locks};
use super::tangent::Selected;
use super::workspace::Workspace;
use crate::lanes::{Lane, LanePart, LaneTask, WIDTH, dispatch};
use crate::material::VolumeLaw;
use crate::mesh::PlaneState;
use crate::square::{Row, apply, apply_add, double_dot, product, product_transposed, scale_all, sum};

impl Formulation {
    /// Whether the pressure is so stiff that Newton's method linearises it: that of finite kinematics from a
    /// Poisson's ratio of [`LOCKS`](super::LOCKS) on, except under plane stress, where the thickness is free.
    pub fn linearises_pressure(&self) -> bool {
        self.kinematics == Kinematics::Finite && self.plane != PlaneState::Stress && locks(&self.moduli())
    }
}

impl<const D: usize> ElementGroup<D> {
    /// Whether the tangent has a linearised pressure in the elements themselves.
    pub(super) fn linearises_pressure(&self) -> bool {
        self.formulation.linearises_pressure() && !self.formulation.shares_pressure(self.kind)
    }
}

/// The force of the difference between the pressure linearised at the displacements `earlier` and that at `u`.
pub(super) struct PressureChange<'a, const D: usize> {
    pub group: &'a ElementGroup<D>,
    pub u: &'a [f64],
    pub earlier: &'a [f64],
    pub sink: &'a mut dyn ElementSink,
}

/// Adds up the change in the plane.
pub(super) fn in_plane(change: PressureChange<'_, 2>) {
    if change.group.formulation().plane.is_revolved() {
        ElementGroup::axisymmetric_pressure_change(change);
    } else {
        solid(change);
    }
}

/// Adds up the change in plane strain or in 3D.
pub(super) fn solid<const D: usize>(change: PressureChange<'_, D>) {
    dispatch(change);
}

impl<const D: usize> LaneTask for PressureChange<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane>(self, unit: L) {
        self.sum(unit, FlatShape);
    }
}

/// Kinematics of the samples of a batch.
pub(super) trait VolumeSamples<L: Lane, const D: usize> {
    /// A sample at the displacements of the batch.
    type Sample;

    /// Begins a batch.
    fn clear(&mut self, unit: L);

    /// Moves to a sample.
    fn locate(&mut self, unit: L, batch: &mut Batch<L, D, 1>, pass: &Pass, q: usize) -> Self::Sample;

    /// The sample to which the batch moved last, at other displacements of the nodes.
    fn moved(&self, batch: &Batch<L, D, 1>, at: &Self::Sample, displacements: &[Row<L, D>]) -> Self::Sample;

    /// Reference volume.
    fn volume(at: &Self::Sample) -> L;

    /// The dilatation `s`.
    fn dilatation(law: &VolumeLaw, at: &Self::Sample) -> L;

    /// `ds/dF : (F_to - F)`.
    fn change(law: &VolumeLaw, from: &Self::Sample, to: &Self::Sample) -> L;

    /// Adds the force of a `weight`, the pressure times the volume.
    fn add_force(&self, work: &mut Workspace<L, D>, law: &VolumeLaw, at: &Self::Sample, weight: L);

    /// Adds the second derivative of the dilatation times a `weight`.
    fn add_stiffness(
        &self,
        work: &mut Workspace<L, D>,
        law: &VolumeLaw,
        at: &Self::Sample,
        weight: L,
        wanted: Selected<L>,
    );
}

/// Samples of elements of a plane or of space, whose kinematics is that of the batch.
pub(super) struct FlatShape;

impl<L: Lane, const D: usize> VolumeSamples<L, D> for FlatShape {
    type Sample = Sample<L, D, 1>;

    #[inline(always)]
    fn clear(&mut self, _: L) {}

    #[inline(always)]
    fn locate(&mut self, unit: L, batch: &mut Batch<L, D, 1>, pass: &Pass, q: usize) -> Self::Sample {
        batch.locate(unit, pass, q)
    }

    #[inline(always)]
    fn moved(&self, batch: &Batch<L, D, 1>, at: &Self::Sample, displacements: &[Row<L, D>]) -> Self::Sample {
        let grad_u = [product_transposed(&gradient_of(displacements, &batch.slopes), &at.map)];
        Sample { volume: at.volume, map: at.map, grad_u }
    }

    #[inline(always)]
    fn volume(at: &Self::Sample) -> L {
        at.volume
    }

    #[inline(always)]
    fn dilatation(law: &VolumeLaw, at: &Self::Sample) -> L {
        law.dilatation(&at.grad_u[0])
    }

    #[inline(always)]
    fn change(law: &VolumeLaw, from: &Self::Sample, to: &Self::Sample) -> L {
        let minus_one = from.volume.constant(-1.0);
        let motion = sum(&to.grad_u[0], &scale_all(&from.grad_u[0], minus_one));
        double_dot(&law.gradient(&from.grad_u[0]), &motion)
    }

    #[inline(always)]
    fn add_force(&self, work: &mut Workspace<L, D>, law: &VolumeLaw, at: &Self::Sample, weight: L) {
        let weighted = scale_all(&product(&law.gradient(&at.grad_u[0]), &at.map), weight);
        for (force, slope) in work.force.iter_mut().zip(&work.batch.slopes) {
            *force = apply_add(&weighted, slope, force);
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
        let map = product(&law.gradient(&at.grad_u[0]), &at.map);
        let slopes = &work.batch.slopes;
        for (mapped, slope) in work.blocks.mapped.iter_mut().zip(slopes) {
            *mapped = apply(&map, slope);
        }
        work.blocks.add_dilatation_curvature(slopes, law, at, &map, weight, wanted);
    }
}

/// The difference `p* - p` in a batch.
pub(super) struct LinearisedPressure<'a, L, const D: usize> {
    /// Displacements at which the pressure is linearised, local nodes \[m\].
    earlier: &'a [f64],
    /// Earlier displacements of the nodes of the batch.
    displacements: Vec<Row<L, D>>,
    /// Projected dilatation at the samples of the volume terms, and at the earlier displacements.
    dilatation: Vec<L>,
    earlier_dilatation: Vec<L>,
    /// Change of the dilatation to first order, then `p* - p` \[Pa\].
    change: Vec<L>,
}

impl<'a, L: Lane, const D: usize> LinearisedPressure<'a, L, D> {
    /// Buffers for a group; `None` if the group has no linearised pressure.
    #[inline(always)]
    pub fn new(unit: L, group: &ElementGroup<D>, earlier: Option<&'a [f64]>) -> Option<Self> {
        let zero = unit.constant(0.0);
        let samples = group.passes[group.passes.len() - 1].samples();
        earlier.filter(|_| group.linearises_pressure()).map(|earlier| Self {
            earlier,
            displacements: vec![[zero; D]; group.kind.nodes()],
            dilatation: vec![zero; samples],
            earlier_dilatation: vec![zero; samples],
            change: vec![zero; samples],
        })
    }

    /// Adds the stiffness of `p* - p` in a batch all of whose passes were visited.
    #[inline(always)]
    pub fn add_stiffness<S: VolumeSamples<L, D>>(
        &mut self,
        unit: L,
        work: &mut Workspace<L, D>,
        shape: &mut S,
        group: &ElementGroup<D>,
        nodes: &[[u32; WIDTH]],
        wanted: Selected<L>,
    ) {
        unit.apart(AddStiffness { pressures: self, unit, work, shape, group, nodes, wanted });
    }

    /// Sets `p* - p` at the samples of a pass.
    #[inline(always)]
    fn find<S: VolumeSamples<L, D>>(
        &mut self,
        unit: L,
        work: &mut Workspace<L, D>,
        shape: &mut S,
        pass: &Pass,
        law: &VolumeLaw,
        nodes: &[[u32; WIDTH]],
    ) {
        for (displacement, nodes) in self.displacements.iter_mut().zip(nodes) {
            for i in 0..D {
                let mut values = [0.0; WIDTH];
                for lane in 0..WIDTH {
                    values[lane] = self.earlier[nodes[lane] as usize * D + i];
                }
                displacement[i] = unit.load(values);
            }
        }
        let projection = &mut work.dilatation.projection;
        let is_projected = matches!(pass.sampling, Sampling::Projected(_));
        for q in 0..pass.samples() {
            let at = shape.locate(unit, &mut work.batch, pass, q);
            let from = shape.moved(&work.batch, &at, &self.displacements);
            self.dilatation[q] = S::dilatation(law, &at);
            self.earlier_dilatation[q] = S::dilatation(law, &from);
            self.change[q] = S::change(law, &from, &at);
            if is_projected {
                projection.set(q, S::volume(&at), &work.batch.place(unit, pass, q));
            }
        }
        if is_projected {
            projection.orthogonalize();
            projection.project(&mut self.dilatation);
            projection.project(&mut self.earlier_dilatation);
            projection.project(&mut self.change);
        }
        let minus_one = unit.constant(-1.0);
        for q in 0..pass.samples() {
            let [pressure, _] = law.slope_and_curvature(self.dilatation[q]);
            let [slope, curvature] = law.slope_and_curvature(self.earlier_dilatation[q]);
            self.change[q] = curvature.mul_add(self.change[q], minus_one.mul_add(pressure, slope));
        }
        if is_projected {
            projection.project(&mut self.change);
        }
    }
}

/// The stiffness of `p* - p` in a batch, see [`LinearisedPressure::add_stiffness`].
struct AddStiffness<'a, 'b, S, L, const D: usize> {
    pressures: &'a mut LinearisedPressure<'b, L, D>,
    unit: L,
    work: &'a mut Workspace<L, D>,
    shape: &'a mut S,
    group: &'a ElementGroup<D>,
    nodes: &'a [[u32; WIDTH]],
    wanted: Selected<L>,
}

impl<S: VolumeSamples<L, D>, L: Lane, const D: usize> LanePart for AddStiffness<'_, '_, S, L, D> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { pressures, unit, work, shape, group, nodes, wanted } = self;
        let law = group.volume_law();
        let pass = &group.passes[group.passes.len() - 1];
        pressures.find(unit, work, shape, pass, &law, nodes);
        for q in 0..pass.samples() {
            let at = shape.locate(unit, &mut work.batch, pass, q);
            shape.add_stiffness(work, &law, &at, pressures.change[q] * S::volume(&at), wanted);
        }
    }
}

impl<const D: usize> PressureChange<'_, D> {
    /// Passes the forces of all elements to the sink.
    #[inline(always)]
    pub fn sum<L: Lane, S: VolumeSamples<L, D>>(self, unit: L, mut shape: S) {
        let Self { group, u, earlier, sink } = self;
        let Some(mut pressures) = LinearisedPressure::<L, D>::new(unit, group, Some(earlier)) else { return };
        let n = group.kind.nodes();
        let law = group.volume_law();
        let pass = &group.passes[group.passes.len() - 1];
        let mut work = Workspace::<L, D>::new(unit, group);
        let batches = group.elements.chunks(WIDTH).zip(group.nodes.chunks_exact(n));
        for (batch, ((elements, nodes), points)) in batches.zip(group.points.chunks_exact(n)).enumerate() {
            work.gather(unit, nodes, points, u);
            shape.clear(unit);
            if pass.sampling == Sampling::Mean {
                // The mean of the gradient is that over the points of the first pass.
                for q in 0..group.passes[0].samples() {
                    shape.locate(unit, &mut work.batch, &group.passes[0], q);
                }
            }
            pressures.find(unit, &mut work, &mut shape, pass, &law, nodes);
            for q in 0..pass.samples() {
                let at = shape.locate(unit, &mut work.batch, pass, q);
                shape.add_force(&mut work, &law, &at, pressures.change[q] * S::volume(&at));
            }
            work.emit(unit, batch * WIDTH, elements.len(), false, sink);
        }
    }
}
