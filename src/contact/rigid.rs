//! A contact of a surface with a rigid obstacle: evaluates all its points, facet by facet, into a sink.

use super::evaluation::Workspace;
pub use super::evaluation::{AreaKind, ContactFields, ContactRequest};
use super::obstacle::Obstacle;
use super::point::ContactLaw;
use super::state::ContactState;
use super::surface::{ContactSurface, SurfaceFacet};
use crate::rounding;

/// Receives what the facets contribute.
pub trait ContactSink {
    /// `force[a * D + i]`, to be added to the right-hand side, and `stiffness[((a * m + b) * D + i) * D + j]`, to
    /// be added to the left-hand matrix, of the facet `index` with local `nodes`. Not called for open facets.
    fn facet(&mut self, index: usize, nodes: &[u32], force: &[f64], stiffness: Option<&[f64]>);
}

/// One contact with a rigid obstacle.
#[derive(Debug, Clone)]
pub struct RigidContact<const D: usize> {
    /// Contactor.
    pub surface: ContactSurface<D>,
    /// Target.
    pub obstacle: Obstacle<D>,
    /// Laws.
    pub law: ContactLaw,
    /// Area on which the tractions act.
    pub area: AreaKind,
}

impl<const D: usize> RigidContact<D> {
    /// Evaluates every point, keeps their states in `state.current` and hands the facets in contact to `sink`.
    pub fn evaluate(
        &self,
        fields: &ContactFields<'_>,
        request: &ContactRequest,
        state: &mut ContactState<D>,
        sink: &mut impl ContactSink,
    ) {
        let mut work = Workspace::new();
        for index in rounding::order(self.surface.facets().len()) {
            let facet = &self.surface.facets()[index];
            let nodes = self.surface.facet_nodes(facet);
            work.clear();
            work.gather(self.surface.reference_points(facet), nodes, fields);
            work.clear_sums(request);
            if request.over_step {
                work.go_to_ends();
            }
            let mut contributes = false;
            for point in rounding::order(facet.points.len()).map(|q| facet.points.start + q) {
                self.locate(facet, point, request, &mut work);
                if let Some(response) = work.respond(&self.law, point, request, state) {
                    contributes = true;
                    work.add(&response, request);
                }
            }
            if contributes {
                sink.facet(index, nodes, &work.force, work.stiffness(request));
            }
        }
    }

    fn locate(&self, facet: &SurfaceFacet, point: usize, request: &ContactRequest, work: &mut Workspace<D>) {
        let at = self.surface.facet_point(facet, point - facet.points.start);
        let proximity = self.obstacle.proximity(&at.position(&work.current));
        work.geometry.against_obstacle(&at, &proximity);
        work.geometry.with_area(&at, &work.current, self.area.measure(&self.surface, point));
        if request.over_step {
            work.foot = request.stiffness.is_some().then_some(proximity);
            work.start_gap = self.obstacle.gap(&at.position(&work.start));
            let proximity = self.obstacle.proximity(&at.position(&work.end));
            work.end_geometry.against_obstacle(&at, &proximity);
        }
    }
}
