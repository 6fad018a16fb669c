//! A contact of a surface with a deformable body: every point with the facet that the search paired it with.

use super::evaluation::{AreaKind, ContactFields, ContactRequest, Foot, Workspace};
use super::pairing::{PairChanges, Pairing};
use super::point::step::open_over_step;
use super::point::{ContactLaw, PointState};
use super::projection::Projection;
use super::search::{Search, SearchLimits, Sides};
use super::state::ContactState;
use super::surface::ContactSurface;
use super::target::TargetSurface;
use crate::rounding;
use crate::tensor::Vector;

/// What one point in contact contributes to the nodes of its two facets.
#[derive(Debug, Clone, Copy)]
pub struct PairContribution<'a> {
    /// Point, in the numbering of the contactor surface.
    pub point: usize,
    /// Facet of the contactor surface.
    pub contactor_facet: usize,
    /// Facet of the target surface.
    pub target_facet: u32,
    /// Contactor nodes, then target nodes: places in the field arrays.
    pub nodes: &'a [u32],
    /// `force[a * D + i]`, to be added to the right-hand side \[N, per depth in 2D\].
    pub force: &'a [f64],
    /// `stiffness[((a * m + b) * D + i) * D + j]` of `m` nodes, to be added to the left-hand matrix \[N/m\].
    pub stiffness: Option<&'a [f64]>,
}

/// Receives what the points contribute.
pub trait PairSink {
    /// Takes a point's contribution. Not called for open points.
    fn pair(&mut self, contribution: &PairContribution<'_>);
}

/// One contact with a deformable target, one pass of it.
#[derive(Debug, Clone)]
pub struct DeformableContact<const D: usize> {
    /// Contactor: the facets that this rank reports, [`ContactSurface::of_mine`]; with a share of one half in each pass
    /// of two.
    pub surface: ContactSurface<D>,
    /// Target.
    pub target: TargetSurface<D>,
    /// Laws.
    pub law: ContactLaw,
    /// Area on which the tractions act.
    pub area: AreaKind,
}

impl<const D: usize> DeformableContact<D> {
    /// Contactor and target, as the search wants them.
    pub fn sides(&self) -> Sides<'_, D> {
        Sides { contactor: &self.surface, target: &self.target }
    }

    /// A search for this contact at the displacements `u` of local and foreign nodes.
    pub fn search(&self, limits: SearchLimits, u: &[f64]) -> Search<D> {
        Search::new(&self.target, limits, u)
    }

    /// Pairs every point at the displacements `u`, see [`Search::pair`].
    pub fn pair(&self, search: &mut Search<D>, u: &[f64], pairing: &mut Pairing) -> PairChanges {
        search.pair(self.sides(), u, pairing)
    }

    /// Evaluates every point on its facet in `pairing`, keeps their states in `state.current` and hands the points in
    /// contact to `sink`. A point without a facet is open, its gap infinite.
    pub fn evaluate(
        &self,
        fields: &ContactFields<'_>,
        request: &ContactRequest,
        pairing: &Pairing,
        state: &mut ContactState<D>,
        sink: &mut impl PairSink,
    ) {
        let mut work = Workspace::new();
        for index in rounding::order(self.surface.facets().len()) {
            let facet = &self.surface.facets()[index];
            let nodes = self.surface.facet_nodes(facet);
            let undeformed = self.surface.reference_points(facet);
            work.keep(0);
            work.look_from(&undeformed[0], nodes[0], fields);
            work.gather(undeformed, nodes, fields);
            for q in rounding::order(facet.points.len()) {
                let point = facet.points.start + q;
                let Some(target) = pairing.facet(point) else {
                    state.current[point] = match request.over_step {
                        true => {
                            let area = self.surface.reference_area(point);
                            open_over_step(&self.law, &state.history[point], area)
                        }
                        false => PointState::default(),
                    };
                    continue;
                };
                work.keep(nodes.len());
                work.gather(self.target.reference_points(target), self.target.nodes(target), fields);
                let at = self.surface.facet_point(facet, q);
                self.locate((&at, point), target, request, &mut work);
                let adjusted = state.adjusted(point);
                if request.over_step {
                    // The gap in the middle is the lever of tractions, and no law's.
                    let was_open = state.history[point].counted >= 0.0;
                    self.locate_ends(&at, target, was_open, &mut work);
                    work.start_gap -= adjusted;
                    work.end_geometry.gap -= adjusted;
                } else {
                    work.geometry.gap -= adjusted;
                }
                let Some(response) = work.respond(&self.law, point, request, state) else { continue };
                work.clear_sums(request);
                work.add(&response, request);
                sink.pair(&PairContribution {
                    point,
                    contactor_facet: index,
                    target_facet: target,
                    nodes: &work.nodes,
                    force: &work.force,
                    stiffness: work.stiffness(request),
                });
            }
        }
    }

    /// The point at the end of the step, on the facet that it has in the middle, and its gap there at the start, unless it
    /// stays open.
    fn locate_ends(
        &self,
        at: &super::geometry::FacetPoint<'_>,
        target: u32,
        was_open: bool,
        work: &mut Workspace<D>,
    ) {
        work.go_to_ends();
        let kind = self.target.kind(target);
        let project = |places: &[Vector<D>]| {
            let (contactor, facet) = places.split_at(at.shape.len());
            Projection::of(&at.position(contactor), kind, facet)
        };
        work.end_geometry.against_facet(at, &project(&work.end));
        let counts = !was_open || work.end_geometry.gap < 0.0;
        work.start_gap = if counts { project(&work.start).gap } else { f64::INFINITY };
    }

    fn locate(
        &self,
        (at, point): (&super::geometry::FacetPoint<'_>, usize),
        target: u32,
        request: &ContactRequest,
        work: &mut Workspace<D>,
    ) {
        let (contactor, facet) = work.current.split_at(at.shape.len());
        let projection = Projection::of(&at.position(contactor), self.target.kind(target), facet);
        work.geometry.against_facet(at, &projection);
        work.geometry.with_area(at, &work.current, self.area.measure(&self.surface, point));
        let wanted = request.over_step && request.stiffness.is_some();
        work.foot = wanted.then_some(Foot::Facet(projection, at.shape.len()));
    }
}
