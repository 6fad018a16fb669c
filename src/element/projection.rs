//! The projection in `L2` of functions of an element on its constant or linear functions, by values at
//! the points of the full rule (theory, section 3.8).

use super::group::{ElementGroup, Pass, Sampling};
use crate::lanes::{Lane, Real};
use crate::material::VolumeLaw;
use crate::square::Row;

/// Most functions of a space.
const MOST: usize = 4;

impl<const D: usize> ElementGroup<D> {
    /// The volumetric energy of the law.
    pub(super) fn volume_law(&self) -> VolumeLaw {
        self.formulation.volume_law()
    }
}

/// The projection of one element (in lanes: of four), by values at the points of the full rule.
pub(super) struct Projection<T, const D: usize> {
    /// Reference volumes of the points \[m^D\].
    volumes: Vec<T>,
    /// Orthogonal functions at the points, `[k * points + q]`. The first one is 1.
    pub basis: Vec<T>,
    /// `1 / int phi_k^2 dV` [1/m^D].
    inverse: [T; MOST],
    size: usize,
}

impl<T: Real, const D: usize> Projection<T, D> {
    /// Buffers for the projection of a pass.
    #[inline(always)]
    pub fn new(zero: T, pass: &Pass) -> Self {
        let (size, points) = match pass.sampling {
            Sampling::Projected(space) => (space.size(D), pass.samples()),
            Sampling::Points | Sampling::Mean => (0, 0),
        };
        let basis = vec![zero.constant(1.0); size * points];
        Self { volumes: vec![zero; points], basis, inverse: [zero; MOST], size }
    }

    /// Reference volumes of the points \[m^D\].
    pub fn volumes(&self) -> &[T] {
        &self.volumes
    }

    /// Number of functions.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Sets a point, with its reference position in a space of linear functions.
    #[inline(always)]
    pub fn set(&mut self, q: usize, volume: T, place: &Row<T, D>) {
        let points = self.volumes.len();
        self.volumes[q] = volume;
        for k in 1..self.size {
            self.basis[k * points + q] = place[k - 1];
        }
    }

    /// Makes the functions orthogonal. The volumes and positions of all points are set.
    #[inline(always)]
    pub fn orthogonalize(&mut self) {
        let points = self.volumes.len();
        for k in 0..self.size {
            for l in 0..k {
                let (before, own) = self.basis.split_at_mut(k * points);
                let before = &before[l * points..(l + 1) * points];
                let part = inner(&self.volumes, before, own) * self.inverse[l];
                for q in 0..points {
                    own[q] = own[q] - part * before[q];
                }
            }
            let own = &self.basis[k * points..(k + 1) * points];
            self.inverse[k] = inner(&self.volumes, own, own).recip();
        }
    }

    /// Replaces the values of a function at the points by those of its projection.
    #[inline(always)]
    pub fn project(&self, values: &mut [T]) {
        let points = self.volumes.len();
        let mut coefficients = self.inverse;
        for k in 0..self.size {
            let own = &self.basis[k * points..(k + 1) * points];
            coefficients[k] = inner(&self.volumes, own, values) * self.inverse[k];
        }
        for q in 0..points {
            values[q] = coefficients[0];
            for k in 1..self.size {
                values[q] = coefficients[k].mul_add(self.basis[k * points + q], values[q]);
            }
        }
    }

    /// The matrix `H` with which `dB . H dB`, `B_k = int phi_k s dV`, is the second derivative of the
    /// energy by the projected dilatation, from the curvature of the energy at the points.
    #[inline(always)]
    pub fn curvatures(&self, curvature: &[T]) -> [[T; MOST]; MOST] {
        let points = self.volumes.len();
        let zero = self.inverse[0].constant(0.0);
        let mut out = [[zero; MOST]; MOST];
        for k in 0..self.size {
            for l in k..self.size {
                let mut sum = zero;
                for q in 0..points {
                    let pair = self.basis[k * points + q] * self.basis[l * points + q];
                    sum = (pair * curvature[q]).mul_add(self.volumes[q], sum);
                }
                out[k][l] = sum * self.inverse[k] * self.inverse[l];
                out[l][k] = out[k][l];
            }
        }
        out
    }
}

/// `int a b dV`.
#[inline(always)]
fn inner<T: Real>(volumes: &[T], a: &[T], b: &[T]) -> T {
    let mut sum = volumes[0].constant(0.0);
    for q in 0..volumes.len() {
        sum = (volumes[q] * a[q]).mul_add(b[q], sum);
    }
    sum
}

/// Buffers for the volume terms of a batch.
pub(super) struct Dilatation<L, const D: usize> {
    pub projection: Projection<L, D>,
    /// The dilatation at the points, then its projection.
    pub dilatation: Vec<L>,
    /// `p` at the points \[Pa\].
    pub pressure: Vec<L>,
    /// Second derivative of the energy at the points \[Pa\].
    pub curvature: Vec<L>,
    /// `dB_k/du_a`, `[k * nodes + a]` \[m^(D-1)\].
    pub flux: Vec<Row<L, D>>,
}

impl<L: Lane, const D: usize> Dilatation<L, D> {
    /// Buffers for the last pass of a group, empty if that is not projected.
    #[inline(always)]
    pub fn new(unit: L, group: &ElementGroup<D>) -> Self {
        let zero = unit.constant(0.0);
        let projection = Projection::new(zero, &group.passes[group.passes.len() - 1]);
        let values = || vec![zero; projection.volumes.len()];
        Self {
            dilatation: values(),
            pressure: values(),
            curvature: values(),
            flux: vec![[zero; D]; projection.size * group.kind.nodes()],
            projection,
        }
    }
}
