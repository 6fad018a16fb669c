//! Chain of straight lines with a radius, in the plane.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::drawing::{Drawing, Window, beside};
use super::numbers;
use super::shape::{Outline, Proximity, Shape, tube_about};
use super::side::Side;
use super::solid::{SolidMoments, SurfaceSums};
use crate::reader::at::At;
use crate::reader::findings::Findings;
use crate::reader::quantity::Length;
use crate::tensor::{Tensor, Vector};

/// Chain of straight lines with a radius, in 2D only: a profile, or a bent plate.
///
/// A closed chain bounds a solid, whose surface is at the distance `radius` outside of the chain.
/// An open chain is a plate of the thickness `2 radius` with round ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PolylineObstacle {
    /// Points of the chain \[m\], at most 10 000.
    pub points: At<Vec<At<Vec<Length>>>>,
    /// Distance of the surface from the chain \[m\], > 0. It rounds corners that point outward. Make
    /// it larger than the penetration.
    pub radius: Length,
    /// Whether the last point is joined to the first one.
    #[serde(default)]
    pub closed: bool,
    /// The side on which the bodies are.
    #[serde(default)]
    pub side: Side,
}

/// Maximum number of points. Every line is examined for every contact point, so this bounds the
/// work at a point.
const MOST_POINTS: usize = 10_000;

impl PolylineObstacle {
    pub(super) fn check(&self, dimension: usize, findings: &mut Findings) {
        if dimension != 2 {
            findings.say(self.points.place, "a polyline is a 2D obstacle");
            findings.cure("use a `surface`, which is read from an STL file");
            return;
        }
        let count = self.points.len();
        let least = if self.closed { 3 } else { 2 };
        if count < least {
            findings
                .say(self.points.place, format!("a polyline needs at least {least} points, found {count}"));
            return;
        }
        let message = format!("a polyline has at most {MOST_POINTS} points, found {count}");
        findings.require(count <= MOST_POINTS, self.points.place, message);
        let before = findings.is_empty();
        self.points.iter().for_each(|point| findings.entries("a point of a polyline", point, 2));
        findings.positive("the radius of a polyline", self.radius);
        if self.radius.value == 0.0 {
            findings.cure("a sharp corner has no normal; choose a radius above the penetration");
        }
        if !(before && findings.is_empty()) {
            return;
        }
        for (k, point) in self.points.iter().enumerate() {
            let next = self.points.get(k + 1).or_else(|| self.points.first().filter(|_| self.closed));
            if next.is_some_and(|next| numbers::<2, 0, 1, 0>(next) == numbers::<2, 0, 1, 0>(point)) {
                let after = (k + 1) % count + 1;
                findings.say(point.place, format!("points {} and {after} of a polyline are the same", k + 1));
                findings.cure("remove one of them; with `closed: true` the last point is not repeated");
            }
        }
        if self.closed && area(&self.vertices::<2>()) == 0.0 {
            findings.say(self.points.place, "the closed polyline encloses no area");
            findings.cure("order the points along the outline, or remove `closed`");
        } else if self.closed
            && findings.is_empty()
            && let Some((one, other)) = crossing(&self.vertices::<2>())
        {
            let message =
                format!("the lines from points {} and {} of the closed polyline meet", one + 1, other + 1);
            findings.say(self.points[one].place, message);
            findings
                .cure("order the points along the outline, which must not touch itself, or remove `closed`");
        }
        if !self.closed && self.side == Side::Inside {
            findings.say(self.points.place, "an open polyline has no inside");
            findings.cure("add `closed: true`, or remove `side`");
        }
    }

    fn vertices<const D: usize>(&self) -> Vec<Vector<D>> {
        self.points.iter().map(|point| numbers(point)).collect()
    }

    /// Whether it bounds a solid on the side of its region.
    pub(super) fn is_solid(&self) -> bool {
        self.closed && self.side == Side::Outside
    }

    /// From points and radius \[m\], whether the last point is joined to the first one, and the free
    /// side.
    pub fn of(points: &[[f64; 2]], radius: f64, closed: bool, side: Side) -> Self {
        let points = points.iter().map(|point| At::from(point.map(Length::new).to_vec()));
        Self { points: points.collect::<Vec<_>>().into(), radius: Length::new(radius), closed, side }
    }

    /// The mean of the points.
    pub(super) fn centre<const D: usize>(&self) -> Vector<D> {
        let points = self.vertices::<D>();
        points.iter().sum::<Vector<D>>() / points.len().max(1) as f64
    }

    pub(super) fn shape<const D: usize>(&self) -> Polyline<D> {
        let points = self.vertices();
        let sign = if area(&points) < 0.0 { -1.0 } else { 1.0 };
        let bounded = self.closed.then_some(sign);
        Polyline { points: points.into(), bounded, radius: self.radius.value, side: self.side }
    }

    pub(super) fn samples() -> Vec<Self> {
        let profile = [[-0.3, -0.2], [0.2, -0.3], [0.2, 0.1], [-0.1, 0.2]];
        vec![
            Self::of(&profile, 0.4, true, Side::Outside),
            Self::of(&[[-1.5, -1.4], [-1.3, 1.3], [1.4, 0.7], [1.1, -1.2]], 0.3, true, Side::Inside),
            Self::of(&[[-0.9, 0.1], [-0.1, 0.0], [0.1, -0.9]], 0.5, false, Side::Outside),
        ]
    }
}

/// Twice the area within a closed chain in the x-y plane \[m2\], positive if it runs
/// counterclockwise.
fn area<const D: usize>(points: &[Vector<D>]) -> f64 {
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum()
}

/// Two lines of a closed chain in the x-y plane that meet although they are not neighbours.
fn crossing<const D: usize>(points: &[Vector<D>]) -> Option<(usize, usize)> {
    let count = points.len();
    let ends = |line: usize| [points[line], points[(line + 1) % count]];
    let side =
        |[a, b]: [Vector<D>; 2], c: Vector<D>| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let apart = |[a, b]: [Vector<D>; 2], [c, d]: [Vector<D>; 2]| {
        (0..2).any(|i| a[i].max(b[i]) < c[i].min(d[i]) || c[i].max(d[i]) < a[i].min(b[i]))
    };
    let splits = |line: [Vector<D>; 2], [c, d]: [Vector<D>; 2]| side(line, c) * side(line, d) <= 0.0;
    (0..count).find_map(|one| {
        let own = ends(one);
        let meets = |&other: &usize| {
            let neighbours = other == one + 1 || (one == 0 && other + 1 == count);
            let its = ends(other);
            !neighbours && !apart(own, its) && splits(own, its) && splits(its, own)
        };
        (one + 1..count).find(meets).map(|other| (one, other))
    })
}

/// All points at the radius from a chain of straight lines in the plane, or from the region within
/// it.
#[derive(Debug, Clone, PartialEq)]
pub struct Polyline<const D: usize> {
    points: std::rc::Rc<[Vector<D>]>,
    /// 1 if the chain bounds a region and runs counterclockwise, -1 if clockwise.
    bounded: Option<f64>,
    radius: f64,
    side: Side,
}

impl<const D: usize> Polyline<D> {
    fn lines(&self) -> usize {
        if self.bounded.is_some() { self.points.len() } else { self.points.len().saturating_sub(1) }
    }

    fn ends(&self, line: usize) -> [Vector<D>; 2] {
        [self.points[line], self.points[(line + 1) % self.points.len()]]
    }

    /// Unit normal of a line to its right, which is outward if the chain runs counterclockwise.
    fn right_of(&self, line: usize) -> Vector<D> {
        let [from, to] = self.ends(line);
        let along = (to - from).normalize();
        Vector::from_fn(|i, _| {
            if i == 0 {
                along[1]
            } else if i == 1 {
                -along[0]
            } else {
                0.0
            }
        })
    }
}

impl<const D: usize> Polyline<D> {
    /// Moments of the solid in the x-y plane, whose surface consists of lines and of arcs about the
    /// corners that point outward. `None` if the radius fills a notch, so that this is not its
    /// surface. `sign` is 1 if the chain runs counterclockwise and -1 if clockwise.
    fn moments(&self, sign: f64) -> Option<SolidMoments<2>> {
        let in_plane = |x: &Vector<D>| Vector::<2>::new(x[0], x[1]);
        let count = self.points.len();
        let points = |k: usize| {
            let k = k % count;
            in_plane(&self.points[if sign > 0.0 { k } else { count - 1 - k }])
        };
        let middle = (0..count).map(points).sum::<Vector<2>>() / count.max(1) as f64;
        let mut sums = SurfaceSums::<2>::about(middle);
        let direction = |k: usize| (points(k + 1) - points(k)).try_normalize(0.0);
        // Angle by which the chain turns to the left at the start of a line.
        let turn = |k: usize| -> Option<f64> {
            let (one, other) = (direction(k + count - 1)?, direction(k)?);
            Some((one[0] * other[1] - one[1] * other[0]).atan2(one.dot(&other)))
        };
        // Length by which lines end before a corner that points inward.
        let cut = |k: usize| Some((-0.5 * turn(k)?).tan().max(0.0) * self.radius);
        let mut convex = true;
        let mut marks = Vec::new();
        for k in 0..count {
            let along = direction(k)?;
            let right = Vector::<2>::new(along[1], -along[0]) * self.radius;
            let from = points(k) + right + along * cut(k)?;
            let to = points(k + 1) + right - along * cut(k + 1)?;
            if (to - from).dot(&along) < 0.0 {
                return None;
            }
            sums.add_line(&from, &to);
            marks.extend([from, (from + to) * 0.5, to]);
            let angle = turn(k)?;
            if angle > 0.0 {
                let end = right[1].atan2(right[0]);
                sums.add_arc(&points(k), self.radius, end - angle, end);
                let (sine, cosine) = (end - 0.5 * angle).sin_cos();
                marks.push(points(k) + Vector::<2>::new(cosine, sine) * self.radius);
            }
            convex &= angle >= 0.0;
        }
        /// Depth below the surface, per radius, at which a mark is not on it: well above rounding.
        const DEPTH: f64 = 1e-6;
        let is_covered = |mark: &Vector<2>| {
            let x = Vector::<D>::from_fn(|i, _| if i < 2 { mark[i] } else { 0.0 });
            self.gap(&x) < -DEPTH * self.radius
        };
        if !convex && marks.iter().any(is_covered) {
            return None;
        }
        Some(sums.finish())
    }
}

impl<const D: usize> Shape<D> for Polyline<D> {
    fn proximity(&self, x: &Vector<D>) -> Proximity<D> {
        let mut best = (f64::INFINITY, 0, 0.0);
        for line in 0..self.lines() {
            let [from, to] = self.ends(line);
            let span = to - from;
            let along = (span.dot(&(x - from)) / span.norm_squared()).clamp(0.0, 1.0);
            let square = (x - from - span * along).norm_squared();
            if square < best.0 {
                best = (square, line, along);
            }
        }
        let (_, line, along) = best;
        let [from, to] = self.ends(line);
        let inner = along > 0.0 && along < 1.0;
        let axis = inner.then(|| (to - from).normalize());
        let way = x - (from + (to - from) * along);
        let (distance, mut normal, mut hessian) = tube_about(&way, axis.as_ref(), self.radius);
        let mut gap = distance;
        if let Some(sign) = self.bounded {
            // At a corner the sign follows from the sum of the normals of both lines.
            let count = self.lines();
            let other = match along {
                along if inner || !(0.0..=1.0).contains(&along) => line,
                0.0 => (line + count - 1) % count,
                _ => (line + 1) % count,
            };
            let outward = (self.right_of(line) + self.right_of(other)) * sign;
            if way.dot(&outward) < 0.0 {
                (gap, normal, hessian) = (-gap, -normal, -hessian);
            }
        }
        Proximity { gap: gap - self.radius, normal, hessian }.on(self.side)
    }

    fn outline(&self) -> Outline {
        Outline::Edged
    }

    fn solid(&self) -> Option<SolidMoments<D>> {
        if D != 2 || self.side == Side::Inside {
            return None;
        }
        let flat = self.moments(self.bounded?)?;
        Some(SolidMoments {
            volume: flat.volume,
            centroid: Vector::from_fn(|i, _| flat.centroid[i]),
            second: Tensor::from_fn(|i, j| flat.second[(i, j)]),
        })
    }

    fn facets(&self, window: &Window<D>) -> Drawing<D> {
        let chain = self.points.iter().map(|x| Vector::<2>::new(x[0], x[1]));
        let around: Vec<_> = match self.bounded {
            Some(sign) if sign < 0.0 => chain.rev().collect(),
            Some(_) => chain.collect(),
            // Once along each side.
            None => {
                chain.clone().chain(chain.rev().skip(1).take(self.points.len().saturating_sub(2))).collect()
            }
        };
        // In notches the curve beside the chain is within the radius of other lines.
        let is_surface = |x: &Vector<2>| {
            let x = Vector::from_fn(|i, _| if i < 2 { x[i] } else { 0.0 });
            self.gap(&x).abs() <= 1e-6 * self.radius
        };
        Drawing::chain(beside(&around, self.radius, window).into_iter().filter(is_surface), true)
    }

    fn anchored(&self, _near: &Vector<D>) -> Box<dyn Shape<D>> {
        Box::new(self.clone())
    }
}
