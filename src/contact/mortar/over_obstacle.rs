//! Integrals of a contactor facet over a rigid obstacle: quadrature points on the facet, gap and
//! normal from the signed distance.

use super::facing::facing;
use super::integrals::{AreaMeasure, FacetPair, Point, Variation, interpolate};
use super::obstacle::PlacedObstacle;
use super::segment::Want;
use super::shape::{FacetShape, tangents};
use super::split::linear;
use crate::rounding;
use crate::space::{area_variation, facet_normal};
use crate::tensor::Vector;

impl<const D: usize> FacetPair<'_, D> {
    /// Visits all points of the facet. Points out of range have zero measure. With `want` for
    /// variations, points out of range are skipped.
    pub(super) fn sweep_over(
        &self,
        placed: &PlacedObstacle<'_, D>,
        want: Want,
        variation: &mut Variation<D>,
        mut visit: impl FnMut(&Point<D>, &Variation<D>),
    ) {
        for q in rounding::order(placed.rule.len()) {
            let [first, second, _] = placed.rule.points[q];
            let contactor = FacetShape::at(self.contactor.kind, [first, second]);
            let x = interpolate(&contactor.value, self.contactor.nodes);
            let proximity = placed.obstacle.proximity(&x);
            let fade = self.range.fade(proximity.gap);
            let tangents = tangents(&contactor, self.contactor.nodes);
            let vector_area = facet_normal(&tangents);
            let size = vector_area.norm();
            let cosine = if size > 0.0 { -vector_area.dot(&proximity.normal) / size } else { 0.0 };
            let (part, by_cosine) = facing(cosine);
            let (per_depth, depth) = match self.measure {
                AreaMeasure::Current => (size, self.across.depth(x[0])),
                AreaMeasure::Reference(nodes) => (
                    facet_normal(&super::shape::tangents(&contactor, nodes)).norm(),
                    self.across.plane.depth(interpolate(&contactor.value, nodes)[0]),
                ),
            };
            let stretch = per_depth * depth;
            let by_radius = self.across.plane.depth_slope() * per_depth;
            let weight = placed.rule.weights[q];
            let point = Point {
                weights: FacetShape::at(linear(self.contactor.kind), [first, second]),
                measure: fade[0] * part * weight * stretch,
                whole: part * weight * stretch,
                fade,
                part: 1.0,
                gap: proximity.gap,
                normal: proximity.normal,
                xi: [first, second],
                eta: [0.0; 2],
                target: FacetShape::default(),
                contactor,
            };
            if want != Want::Points {
                if point.measure == 0.0 {
                    continue;
                }
                for (b, gradient) in point.contactor.gradient.iter().enumerate().take(self.nodes()) {
                    let shape = point.contactor.value[b];
                    let by_area = area_variation(&tangents, gradient);
                    let by_size = by_area.transpose() * vector_area / size;
                    let by_angle = -(by_area.transpose() * proximity.normal
                        + proximity.hessian * vector_area * shape
                        + by_size * cosine)
                        / size;
                    let by_part = by_angle * (by_cosine * weight * stretch);
                    let by_size = match self.measure {
                        AreaMeasure::Current => {
                            let mut by_size = by_size * depth;
                            by_size[0] += by_radius * shape;
                            by_size * (part * weight)
                        }
                        AreaMeasure::Reference(_) => Vector::zeros(),
                    };
                    let by_gap = proximity.normal * shape;
                    let by_measure = by_gap * (fade[1] * point.whole) + by_part * fade[0];
                    variation.gap[b] = by_gap.into();
                    variation.turns[b] = proximity.hessian * shape;
                    for (i, by) in variation.normal.iter_mut().enumerate() {
                        by[b] = (proximity.hessian.row(i).transpose() * shape).into();
                    }
                    variation.measure[b] = by_measure.into();
                    variation.stretch[b] = (by_size * fade[0]).into();
                    variation.whole[b] = (by_size + by_part).into();
                }
            }
            visit(&point, variation);
        }
    }
}
