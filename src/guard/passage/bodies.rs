//! Missed contact between two deformable surfaces.

use super::moving::{BodyPoint, Moving, StepEnds, around};
use super::{Missed, MissedContactCheck};
use crate::assembly::{ContactSystem, LocalContact};
use crate::contact::history::History;
use crate::contact::passage::Path;
use crate::error::Result;
use crate::mesh::{Bounds, BoundsTree};

/// The check of a contact with facets as the target.
pub(super) struct BodyCheck<'a, const D: usize> {
    /// All contacts.
    pub system: &'a ContactSystem<D>,
    /// The contact.
    pub contact: &'a LocalContact<D>,
    /// Ends of the step.
    pub ends: StepEnds<'a>,
}

impl<const D: usize> MissedContactCheck<D> for BodyCheck<'_, D> {
    /// Whether a vertex of this rank was so deep in its target at the start of the step that points
    /// around it have lost weight.
    fn is_near(&self) -> bool {
        let contact = self.contact;
        let gap = |(vertex, history): (usize, &History<D>)| history.gap + contact.state.adjusted(vertex);
        contact.state.history.iter().enumerate().map(gap).any(|gap| gap < -0.5 * contact.pair.depth())
    }

    fn missed(&self, motion: f64, is_near: bool) -> Result<Missed<D>> {
        // Points deeper than half the depth have less weight. A point that gets there
        // in one long step may not be pushed back. A point that starts the step there
        // may get deeper.
        let depth = self.contact.pair.depth();
        let mut through = Vec::new();
        if motion > self.contact.pair.stride() {
            through.extend(self.swept(motion, 0.5 * depth)?);
        }
        if is_near {
            through.extend(self.swept(motion, depth)?);
        }
        Ok(Missed { through, ..Missed::default() })
    }
}

impl<const D: usize> BodyCheck<'_, D> {
    /// Points of either surface that went deeper than `depth` behind the other one, while
    /// the surfaces moved by `motion` \[m\]. Collective.
    fn swept(&self, motion: f64, depth: f64) -> Result<Vec<BodyPoint<D>>> {
        let Self { system, contact, ends } = *self;
        let surfaces = contact.pair.surfaces(system.bodies().local());
        let target = Moving::gathered(system.session(), &surfaces, ends, motion + depth)?;
        let contactor = Moving::local(system.bodies().local(), surfaces.contactor, ends);
        let spacing = EDGE * contact.pair.facet();
        let limits = [depth, 0.5 * contact.pair.depth()];
        let mut found = crossings(&contactor, &target, limits, spacing);
        found.extend(crossings(&target, &contactor, limits, spacing));
        Ok(found)
    }
}

/// Spacing of the points on edges whose paths are tested, relative to the size of a facet. Two
/// edges that cross each other are detected by such a point.
const EDGE: f64 = 0.25;

/// Nodes of the facets `a`, and points on their edges, that passed through a facet of `b` and end
/// more than `depth` \[m\] behind it. A point that went around an edge of `b` and ends at most
/// `seen` \[m\] from the next facet, such as one ahead of a block that slides over it, did not.
fn crossings<const D: usize>(
    a: &Moving<D>,
    b: &Moving<D>,
    [depth, seen]: [f64; 2],
    spacing: f64,
) -> Vec<BodyPoint<D>> {
    let simplices = b.simplices();
    let boxes: Vec<Bounds<D>> = simplices.iter().map(|corners| around(corners)).collect();
    let tree = BoundsTree::new(&boxes);
    let crosses = |path: &Path<D>| {
        let near: Vec<_> = tree.meeting(&around(&[*path]).inflate(depth)).collect();
        let corners = |simplex: &u32| &simplices[*simplex as usize];
        let around_edge =
            |crossed: &u32| near.iter().any(|other| path.goes_around(corners(crossed), corners(other), seen));
        near.iter().any(|simplex| path.crosses(corners(simplex), depth) && !around_edge(simplex))
    };
    let crossing = a.vertices(spacing).into_iter().filter(|vertex| crosses(&vertex.path));
    crossing.map(|vertex| vertex.point).collect()
}
