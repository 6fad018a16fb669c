//! What the kernel knows of a rigid obstacle: a signed distance. No other code asks which shape it is.

use std::fmt::Debug;

use crate::tensor::{Tensor, Vector};

/// Where a point stands to an obstacle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Proximity<const D: usize> {
    /// `g_n`, signed distance \[m\], > 0 where the point is free (2.2).
    pub gap: f64,
    /// `n = dg/dx`, unit normal outward from the obstacle, towards the free side.
    pub normal: Vector<D>,
    /// `dn/dx`, symmetric \[1/m\]. Zero on a plane.
    pub hessian: Tensor<D>,
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

    /// What the solid is round about, if it is round: a thin one may slip between the points of a contactor. `None` of planes and hollows.
    fn core(&self) -> Option<Core<D>> {
        None
    }

    /// Velocities at `x` of the motions that take the shape into itself, and so change no gap. Zero where there are fewer.
    fn motions_along(&self, _x: &Vector<D>) -> [Vector<D>; 6] {
        [Vector::zeros(); 6]
    }

    /// The shape with its surface described from the point that is nearest to `near` \[m\]. Gaps around there then lose no digits to a large
    /// radius or to a far point by which the case describes the shape.
    fn anchored(&self, near: &Vector<D>) -> Box<dyn Shape<D>>;
}

/// The middle of a round solid: its surface has the same distance from it everywhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Core<const D: usize> {
    /// That distance \[m\].
    pub radius: f64,
    /// The middle, or a point of it \[m\].
    pub point: Vector<D>,
    /// Direction of the axis, of length 1; `None` if the middle is a point.
    pub axis: Option<Vector<D>>,
}

impl<const D: usize> Core<D> {
    /// From the middle to `x` \[m\], square to the axis.
    pub fn offset(&self, x: &Vector<D>) -> Vector<D> {
        let offset = x - self.point;
        self.axis.map_or(offset, |axis| offset - axis * axis.dot(&offset))
    }

    /// The point of the middle that is nearest to `x` \[m\].
    pub fn nearest(&self, x: &Vector<D>) -> Vector<D> {
        x - self.offset(x)
    }
}

/// Whether the normal of a shape turns by less than 0.2 between any two points of a path of this length \[m\], at the ends of which the gap
/// is `least` \[m\] or more. A hollow says no, whatever it does.
pub fn is_flat_along<const D: usize>(shape: &dyn Shape<D>, length: f64, least: f64) -> bool {
    /// Length over the distance from the centre; seen from there it is an angle of 0.19.
    const CHORD: f64 = 0.19;
    // No gap changes faster than the place.
    let is_short = |core: Core<D>| length <= CHORD * (core.radius + least - 0.5 * length);
    shape.is_plane() || shape.core().is_some_and(is_short)
}

/// A surface at a constant distance from a point or an axis, described from one of its points, the anchor.
///
/// With the arm `r_0` from the middle to the anchor, `|r_0| = R`, and the way `d` from the anchor, the distance from the surface is
/// `|r_0 + d| - R = (2 r_0 . d + d . d) / (|r_0 + d| + R)`, in which nothing cancels near the anchor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RoundSurface<const D: usize> {
    anchor: Vector<D>,
    arm: Vector<D>,
    radius: f64,
    sign: f64,
}

/// Nearer to the centre than this fraction of the radius a direction is rounding noise.
const CENTRE: f64 = 1e-12;

impl<const D: usize> RoundSurface<D> {
    /// From the anchor's direction as seen from the middle, which is at `middle` \[m\]; `sign` is 1 outside and -1 inside.
    pub fn new(middle: &Vector<D>, direction: &Vector<D>, radius: f64, sign: f64) -> Self {
        let arm = direction * radius;
        Self { anchor: middle + arm, arm, radius, sign }
    }

    /// The same surface with another anchor, in that direction from `middle`, which belongs to it \[m\].
    pub fn seen_from(&self, middle: &Vector<D>, direction: &Vector<D>) -> Self {
        Self::new(middle, direction, self.radius, self.sign)
    }

    /// From the middle to `x` \[m\]; `transverse` projects onto the directions in which the surface is round.
    pub fn offset(&self, x: &Vector<D>, transverse: &Tensor<D>) -> Vector<D> {
        self.arm + transverse * (x - self.anchor)
    }

    /// The gap at `x` \[m\].
    pub fn gap(&self, x: &Vector<D>, transverse: &Tensor<D>) -> f64 {
        let way = transverse * (x - self.anchor);
        let distance = (self.arm + way).norm();
        self.sign * (2.0 * self.arm.dot(&way) + way.norm_squared()) / (distance + self.radius)
    }

    /// Gap, normal and Hessian. At the centre every direction is as near as the others: the last round one is taken, without curvature.
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
