//! Data shared by the kernels of a group at one displacement: the requested evaluation, and the
//! sums of a batch.

use super::batch::Batch;
use super::group::{ElementGroup, Pass};
use super::projection::Dilatation;
use super::tangent::Blocks;
use super::{ElementSink, Request};
use crate::lanes::{Lane, LanePart, WIDTH};
use crate::material::Overstress;
use crate::square::Row;

/// One evaluation of a group.
pub(super) struct Job<'a, const D: usize> {
    pub group: &'a ElementGroup<D>,
    pub u: &'a [f64],
    /// Stress of a Prony series; `None` for an elastic group.
    pub viscous: Option<&'a Overstress>,
    pub request: Request<'a>,
    pub sink: &'a mut dyn ElementSink,
}

/// Buffers of the loop over a group, allocated once per evaluation.
pub(super) struct Workspace<L, const D: usize> {
    pub batch: Batch<L, D, 1>,
    pub force: Vec<Row<L, D>>,
    pub blocks: Blocks<L, D>,
    pub dilatation: Dilatation<L, D>,
    /// One entry for each quadrature point of all passes.
    pub det_f: Vec<[f64; WIDTH]>,
    force_out: Vec<f64>,
}

impl<L: Lane, const D: usize> Workspace<L, D> {
    #[inline(always)]
    pub fn new(unit: L, group: &ElementGroup<D>) -> Self {
        let n = group.kind.nodes();
        Self {
            batch: Batch::new(unit, group),
            force: vec![[unit.constant(0.0); D]; n],
            blocks: Blocks::new(unit, n),
            dilatation: Dilatation::new(unit, group),
            det_f: vec![[0.0; WIDTH]; group.passes.iter().map(Pass::samples).sum()],
            force_out: vec![0.0; WIDTH * n * D],
        }
    }

    /// Loads a batch and clears the sums.
    #[inline(always)]
    pub fn gather(&mut self, unit: L, nodes: &[[u32; WIDTH]], points: &[[[f64; WIDTH]; D]], u: &[f64]) {
        unit.apart(Gather { batch: &mut self.batch, unit, nodes, points, u: [u] });
        self.force.fill([unit.constant(0.0); D]);
        self.blocks.clear(unit);
    }

    /// Passes the real (not padded) lanes of a batch to the sink.
    #[inline(always)]
    pub fn emit(&mut self, unit: L, first: usize, count: usize, stiffness: bool, sink: &mut dyn ElementSink) {
        unit.apart(Emit { work: self, first, count, stiffness, sink });
    }
}

/// A batch whose nodes are loaded, see [`Batch::gather`].
pub(super) struct Gather<'a, L, const D: usize, const STATES: usize> {
    pub batch: &'a mut Batch<L, D, STATES>,
    pub unit: L,
    pub nodes: &'a [[u32; WIDTH]],
    pub points: &'a [[[f64; WIDTH]; D]],
    pub u: [&'a [f64]; STATES],
}

impl<L: Lane, const D: usize, const STATES: usize> LanePart for Gather<'_, L, D, STATES> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.batch.gather(self.unit, self.nodes, self.points, self.u);
    }
}

/// A batch that is passed to the sink, see [`Workspace::emit`].
struct Emit<'a, L, const D: usize> {
    work: &'a mut Workspace<L, D>,
    first: usize,
    count: usize,
    stiffness: bool,
    sink: &'a mut dyn ElementSink,
}

impl<L: Lane, const D: usize> LanePart for Emit<'_, L, D> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { work, first, count, stiffness, sink } = self;
        let n = work.force.len();
        for (a, force) in work.force.iter().enumerate() {
            for i in 0..D {
                let lanes = force[i].lanes();
                for lane in 0..WIDTH {
                    work.force_out[(lane * n + a) * D + i] = lanes[lane];
                }
            }
        }
        if stiffness {
            work.blocks.spread();
        }
        let forces = n * D;
        let blocks = n * n * D * D;
        for lane in 0..count {
            let matrix = &work.blocks.out[lane * blocks..(lane + 1) * blocks];
            let force = &work.force_out[lane * forces..(lane + 1) * forces];
            sink.element(first + lane, force, stiffness.then_some(matrix));
        }
    }
}
