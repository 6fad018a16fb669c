//! Missed contact over an obstacle.

use super::moving::{BodyPoint, StepEnds, around, nodes_of, parts, points_of, reference_of};
use super::{Missed, MissedContactCheck};
use crate::assembly::LocalContact;
use crate::contact::obstacle::{Core, Shape};
use crate::contact::passage::{lies_between, normal_of};
use crate::error::Result;
use crate::tensor::Vector as Point;

/// Depth, relative to the length of a facet, from which a round obstacle that no point can touch
/// counts as sunk in.
const SHALLOW: f64 = 0.02;

/// The check of a contact with an obstacle.
pub(super) struct ObstacleCheck<'a, const D: usize> {
    /// The contact.
    pub contact: &'a LocalContact<D>,
    /// Its target.
    pub obstacle: &'a dyn Shape<D>,
    /// Ends of the step.
    pub ends: StepEnds<'a>,
    /// Body of each element.
    pub bodies: &'a [u16],
}

impl<const D: usize> MissedContactCheck<D> for ObstacleCheck<'_, D> {
    /// Whether a point of this rank is above a round obstacle, so that it would touch before the facet
    /// is one radius deep.
    fn is_near(&self) -> bool {
        let Self { contact, obstacle, ends, .. } = *self;
        // If a facet is no longer than the thickness of the obstacle, its points nearly touch the
        // obstacle.
        let core = obstacle.core().filter(|core| core.radius < 4.0 * contact.facet_size);
        let Some(core) = core else { return true };
        let surface = contact.surface();
        surface.facets().iter().any(|facet| {
            let nodes = nodes_of(contact, facet, ends);
            if obstacle.gap(&nodes[0].end) > 2.0 * contact.facet_size {
                return false;
            }
            let outward = normal_of(&std::array::from_fn(|k| nodes[k].end));
            let Some(outward) = outward.try_normalize(0.0) else { return false };
            points_of(obstacle, facet.kind, contact.plane(), &nodes).any(|point| {
                let away = core.offset(&point.end);
                let height = away.dot(&outward);
                height.abs() <= core.radius + contact.facet_size
                    && (away - outward * height).norm() < core.radius
            })
        })
    }

    fn missed(&self, motion: f64, is_near: bool) -> Result<Missed<D>> {
        let through = if motion > 0.0 { self.passing() } else { Vec::new() };
        Ok(Missed { between: self.between_points(is_near), through })
    }
}

impl<const D: usize> ObstacleCheck<'_, D> {
    /// Points of this rank's facets that passed through the obstacle.
    fn passing(&self) -> Vec<BodyPoint<D>> {
        let Self { contact, obstacle, ends, bodies } = *self;
        let surface = contact.surface();
        let mut found = Vec::new();
        for facet in surface.facets() {
            let nodes = nodes_of(contact, facet, ends);
            let paths = points_of(obstacle, facet.kind, contact.plane(), &nodes);
            let places = reference_of(obstacle, facet.kind, contact.plane(), surface.reference_points(facet));
            let body = usize::from(bodies[facet.facet.element as usize]);
            let passes = paths.zip(places).filter(|(path, _)| path.passes_obstacle(obstacle));
            found.extend(passes.map(|(_, reference)| BodyPoint { reference, body }));
        }
        found
    }

    /// Centres of the facets of this rank that contain a small round obstacle but have no point that
    /// touches it.
    ///
    /// If a point of the contact can touch the obstacle (`met`), the obstacle must be half of its
    /// radius deep. Otherwise a shallow depth is sufficient.
    fn between_points(&self, met: bool) -> Vec<BodyPoint<D>> {
        let Self { contact, obstacle, ends, bodies } = *self;
        let Some(Core { radius, .. }) = obstacle.core() else { return Vec::new() };
        let surface = contact.surface();
        let mut found = Vec::new();
        for facet in surface.facets() {
            let corners = nodes_of(contact, facet, ends);
            if points_of(obstacle, facet.kind, contact.plane(), &corners)
                .any(|point| obstacle.gap(&point.end) <= 0.0)
            {
                continue;
            }
            let around = around(&corners);
            let size = (Point::<D>::from(around.high) - Point::from(around.low)).norm();
            // A facet no longer than the thickness of the obstacle always has a point in it before
            // reaching this depth.
            let deep = if met { 0.5 * radius } else { (SHALLOW * size).min(0.5 * radius) };
            if radius >= 2.0 * size || obstacle.gap(&corners[0].end) > size - deep {
                continue;
            }
            let mut lies = false;
            parts(facet.kind, |part| {
                lies |= lies_between(&std::array::from_fn(|k| corners[part[k]]), obstacle, deep)
            });
            if lies {
                let nodes = &surface.reference_points(facet)[..facet.kind.corners()];
                let reference = nodes.iter().sum::<Point<D>>() / nodes.len() as f64;
                found.push(BodyPoint { reference, body: usize::from(bodies[facet.facet.element as usize]) });
            }
        }
        found
    }
}

/// Explains that an obstacle lies between the points of some `facets`, one of them at `place`.
pub(super) fn describe_between<const D: usize>(
    contact: &LocalContact<D>,
    facets: u64,
    place: &str,
    m: &str,
) -> String {
    let radius = contact.target().obstacle().and_then(Shape::core).map_or(0.0, |core| core.radius);
    format!(
        "contact '{}': the obstacle (radius {radius:.3e} {m}) lies between the contact points of {facets} \
         facets (size about {:.3e} {m}), one of them {place}, and none of the points touches it: use \
         contactor facets smaller than the radius",
        contact.name, contact.facet_size
    )
}
