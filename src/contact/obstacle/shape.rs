//! Interface of the kernel to a rigid obstacle: a signed distance. No other code depends on the
//! type of the shape.

use std::fmt::Debug;

use super::drawing::{Drawing, Window};
use super::side::Side;
use super::solid::SolidMoments;
use super::tangents_of;
use crate::tensor::{Tensor, Vector, tangential_projector};

/// Relation of a point to an obstacle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Proximity<const D: usize> {
    /// `g_n`, signed distance \[m\], > 0 on the free side (2.2).
    pub gap: f64,
    /// `n = dg/dx`, unit normal outward from the obstacle, towards the free side.
    pub normal: Vector<D>,
    /// `dn/dx`, symmetric \[1/m\]. Zero on a plane.
    pub hessian: Tensor<D>,
}

impl<const D: usize> Proximity<D> {
    /// This relation to a solid, or with the signs of the hollow of that solid.
    pub(super) fn on(self, side: Side) -> Self {
        let sign = side.sign();
        Self { gap: self.gap * sign, normal: self.normal * sign, hessian: self.hessian * sign }
    }
}

/// How the gap changes along a line, which decides how a point that passes through is detected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outline {
    /// The gap is convex along a line outside of the solid, and no line leaves a hollow.
    Round,
    /// The gap may have any form along a line, and the normal rotates slowly.
    Smooth,
    /// The gap may have any form along a line, and the normal rotates by a right angle at an edge.
    Edged,
}

/// The rigid shape of an obstacle.
pub trait Shape<const D: usize>: Debug {
    /// Gap, normal and curvature at the current point `x` \[m\].
    fn proximity(&self, x: &Vector<D>) -> Proximity<D>;

    /// The gap alone \[m\].
    fn gap(&self, x: &Vector<D>) -> f64 {
        self.proximity(x).gap
    }

    /// Whether the surface is a plane, so that gaps are linear in the positions.
    fn is_plane(&self) -> bool {
        false
    }

    /// How the gap changes along a line.
    fn outline(&self) -> Outline {
        Outline::Round
    }

    /// Centre or axis of a solid round shape. A thin one may slip between the points of a
    /// contactor. `None` for planes and hollows.
    fn core(&self) -> Option<Core<D>> {
        None
    }

    /// Volume and moments of the solid. `None` for hollows, for infinite and open shapes, and for
    /// solids whose moments are not known.
    fn solid(&self) -> Option<SolidMoments<D>> {
        None
    }

    /// Facets on the surface for a picture of what is in the window. Shapes without ends extend beyond
    /// it.
    fn facets(&self, window: &Window<D>) -> Drawing<D>;

    /// The facets near the bodies, which the window contains.
    fn drawing(&self, window: &Window<D>) -> Drawing<D> {
        let there = self.proximity(&window.centre);
        let window = Window { centre: window.centre - there.normal * there.gap, ..*window };
        self.facets(&window).clipped(&window)
    }

    /// Velocities at `x` of the motions that map the shape onto itself and so change no gap. Unused
    /// entries are zero.
    fn motions_along(&self, _x: &Vector<D>) -> [Vector<D>; 6] {
        [Vector::zeros(); 6]
    }

    /// The shape with its surface described relative to the surface point nearest to `near` \[m\].
    /// Gaps near this point then lose no digits, even for a large radius or a far reference point
    /// in the case.
    fn anchored(&self, near: &Vector<D>) -> Box<dyn Shape<D>>;
}

/// The centre or axis of a round solid. All points of its surface have the same distance from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Core<const D: usize> {
    /// Radius \[m\].
    pub radius: f64,
    /// The centre, or a point of the axis \[m\].
    pub point: Vector<D>,
    /// Unit direction of the axis; `None` for a centre.
    pub axis: Option<Vector<D>>,
}

impl<const D: usize> Core<D> {
    /// Vector from the centre or axis to `x` \[m\], perpendicular to the axis.
    pub fn offset(&self, x: &Vector<D>) -> Vector<D> {
        let offset = x - self.point;
        self.axis.map_or(offset, |axis| offset - axis * axis.dot(&offset))
    }

    /// The point of the centre or axis that is nearest to `x` \[m\].
    pub fn nearest(&self, x: &Vector<D>) -> Vector<D> {
        x - self.offset(x)
    }
}

/// Whether the normal of a shape rotates by less than 0.2 between any two points of a path of this
/// length \[m\]. The gap at the ends of the path is at least `least` \[m\]. For a hollow the answer
/// is always no.
pub fn is_flat_along<const D: usize>(shape: &dyn Shape<D>, length: f64, least: f64) -> bool {
    /// Length divided by the distance from the centre; the path then subtends an angle of 0.19.
    const CHORD: f64 = 0.19;
    // The gap changes at most as much as the position.
    let is_short = |core: Core<D>| length <= CHORD * (core.radius + least - 0.5 * length);
    shape.is_plane() || shape.core().is_some_and(is_short)
}

/// A surface at a constant distance from a point or an axis, described relative to one of its
/// points, the anchor.
///
/// Let the arm `r_0` lead from the centre to the anchor, `|r_0| = R`, and let `d` be the offset
/// from the anchor. The distance from the surface is `|r_0 + d| - R = (2 r_0 . d + d . d) / (|r_0 +
/// d| + R)`. This form has no cancellation near the anchor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RoundSurface<const D: usize> {
    anchor: Vector<D>,
    arm: Vector<D>,
    radius: f64,
    sign: f64,
}

/// Closer to the centre than this fraction of the radius, a direction is rounding noise.
pub(super) const CENTRE: f64 = 1e-12;

/// Distance, its gradient and its Hessian at this offset \[m\] from a point, or from the nearest
/// point of a line with this unit direction. Closer than `CENTRE` times the radius \[m\], all
/// directions are equally near. One of them is used, without curvature.
pub(super) fn tube_about<const D: usize>(
    offset: &Vector<D>,
    axis: Option<&Vector<D>>,
    radius: f64,
) -> (f64, Vector<D>, Tensor<D>) {
    let distance = offset.norm();
    if distance <= CENTRE * radius {
        let up = || Vector::from_fn(|i, _| f64::from(u8::from(i + 1 == D)));
        return (distance, axis.map_or_else(up, |axis| tangents_of(axis)[0]), Tensor::zeros());
    }
    let normal = offset / distance;
    let transverse = axis.map_or_else(Tensor::identity, tangential_projector);
    (distance, normal, (transverse - normal * normal.transpose()) / distance)
}

impl<const D: usize> RoundSurface<D> {
    /// From the direction of the anchor as seen from the centre, which is at `middle` \[m\]; `sign`
    /// is 1 outside and -1 inside.
    pub fn new(middle: &Vector<D>, direction: &Vector<D>, radius: f64, sign: f64) -> Self {
        let arm = direction * radius;
        Self { anchor: middle + arm, arm, radius, sign }
    }

    /// This surface with another anchor, in the given direction from `middle`, a point of its
    /// centre or axis \[m\].
    pub fn seen_from(&self, middle: &Vector<D>, direction: &Vector<D>) -> Self {
        Self::new(middle, direction, self.radius, self.sign)
    }

    /// Vector from the centre to `x` \[m\]; `transverse` projects onto the directions in which the
    /// surface is round.
    pub fn offset(&self, x: &Vector<D>, transverse: &Tensor<D>) -> Vector<D> {
        self.arm + transverse * (x - self.anchor)
    }

    /// The gap at `x` \[m\].
    pub fn gap(&self, x: &Vector<D>, transverse: &Tensor<D>) -> f64 {
        let way = transverse * (x - self.anchor);
        let distance = (self.arm + way).norm();
        self.sign * (2.0 * self.arm.dot(&way) + way.norm_squared()) / (distance + self.radius)
    }

    /// Gap, normal and Hessian. At the centre all directions are equally near. The longest
    /// projected coordinate axis is then the normal, without curvature.
    pub fn proximity(&self, x: &Vector<D>, transverse: &Tensor<D>) -> Proximity<D> {
        let offset = self.offset(x, transverse);
        let distance = offset.norm();
        let gap = self.gap(x, transverse);
        if distance <= CENTRE * self.radius {
            let columns = (0..D).rev().map(|k| transverse.column(k).into_owned());
            let axis = columns.max_by(|a, b| a.norm().total_cmp(&b.norm()));
            let normal = axis.unwrap_or_else(Vector::zeros).normalize() * self.sign;
            return Proximity { gap, normal, hessian: Tensor::zeros() };
        }
        let radial = offset / distance;
        let hessian = (transverse - radial * radial.transpose()) * (self.sign / distance);
        Proximity { gap, normal: radial * self.sign, hessian }
    }
}
