//! Points that would pass through their target within one step: a step ends on the other side and sees no contact.
//!
//! Only the ends of a step are balanced. Between them points and target facets are taken to move on straight lines at
//! constant speed, and a point that is open at both ends must not have met the target on its way.

use super::obstacle::{Core, Shape, is_flat_along};
use crate::space::facet_normal;
use crate::tensor::Vector;

/// Where something is at the two ends of a step \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Path<const D: usize> {
    /// At the start.
    pub start: Vector<D>,
    /// At the end.
    pub end: Vector<D>,
}

/// Cosine of 0.2, by which the normal of an obstacle may turn on the way of a point through it: a chord of a fifth of the
/// radius, five thousandths of it deep.
const COSINE: f64 = 0.98;
/// Halvings that find the instant of a meeting, or the deepest place of a chord.
const HALVINGS: usize = 60;
/// A path meets a facet if it passes by its border by less than this part of its size.
const BORDER: f64 = 1e-6;
/// A point that grazes an edge may lie behind the plane of a facet by less than this part of its size, and be outside.
const GRAZE: f64 = 0.25;
/// Closer to the plane of a facet than this part of its size a point is neither in front nor behind.
const TOUCH: f64 = 1e-9;

impl<const D: usize> Path<D> {
    /// At the part `t` of the step.
    pub fn at(&self, t: f64) -> Vector<D> {
        self.start + (self.end - self.start) * t
    }

    /// Length \[m\].
    pub fn length(&self) -> f64 {
        (self.end - self.start).norm()
    }

    /// Whether the surface of `obstacle` turns by more than a little between where this path goes in and where it ends or
    /// comes out again: what is nearest then is another side.
    pub fn passes_obstacle(&self, obstacle: &dyn Shape<D>) -> bool {
        let gap = |t: f64| obstacle.gap(&self.at(t));
        let ends = [gap(0.0), gap(1.0)];
        // No gap changes faster than the place.
        let length = self.length();
        if ends[0] + ends[1] >= length || is_flat_along(obstacle, length, ends[0].min(ends[1])) {
            return false;
        }
        // Outside of round obstacles the gap is convex along a line, and inside of hollow ones no line leaves.
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let third = (high - low) / 3.0;
            if gap(low + third) < gap(high - third) { high -= third } else { low += third }
        }
        let deepest = 0.5 * (low + high);
        if gap(deepest) >= 0.0 {
            return false;
        }
        let surface = |end: f64| {
            let (mut inside, mut outside) = (deepest, end);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (inside + outside);
                if gap(middle) < 0.0 { inside = middle } else { outside = middle }
            }
            obstacle.proximity(&self.at(inside)).normal
        };
        surface(0.0).dot(&surface(1.0)) < COSINE
    }

    /// Whether a point on this path goes from the front of a moving simplex (in the plane a line, in space a triangle
    /// whose corners turn left seen from the front) to its back, between its corners. It ends deeper behind than the
    /// search looks, `depth` \[m\], or than a point gets that grazes an edge and is outside again. A point that touches it
    /// at the start, or lies less than `depth` behind, passes where it is deeper than that at the end and still behind it.
    pub fn passes_simplex(&self, corners: &[Self; D], depth: f64) -> bool {
        self.goes_behind(corners, depth, depth.min(GRAZE * size_of(corners)))
    }

    /// Whether a point on this path comes from the front of a moving simplex, or from less than `depth` \[m\] behind it, passes between
    /// its corners, and ends deeper behind it.
    pub fn crosses(&self, corners: &[Self; D], depth: f64) -> bool {
        self.goes_behind(corners, depth, depth)
    }

    /// A point in front of a simplex passes when it ends deeper than `entered`, one that is less than `depth` behind it when it ends deeper
    /// than that \[m\].
    fn goes_behind(&self, corners: &[Self; D], depth: f64, entered: f64) -> bool {
        let [start, end] = [0.0, 1.0].map(|t| self.height(corners, t));
        if start <= TOUCH * size_of(corners) {
            let between = |t: f64| self.is_between(corners, t);
            return start >= -depth && end < -depth && between(0.0) && between(1.0);
        }
        end <= -entered && self.enters(corners)
    }

    /// Whether a point on this path that is in front of a moving simplex at the start and behind it at the end goes through
    /// its plane between its corners.
    fn enters(&self, corners: &[Self; D]) -> bool {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if self.height(corners, middle) > 0.0 { low = middle } else { high = middle }
        }
        self.is_between(corners, high)
    }

    /// Whether a point on this path ends over or below a moving simplex, no further than `within` \[m\].
    pub fn is_over(&self, corners: &[Self; D], within: f64) -> bool {
        self.height(corners, 1.0).abs() <= within && self.is_between(corners, 1.0)
    }

    /// Height over the plane of a simplex, at the part `t` of the step \[m\]; 0 where it has no plane.
    fn height(&self, corners: &[Self; D], t: f64) -> f64 {
        let there = corners.map(|corner| corner.at(t));
        let normal = normal_of(&there).try_normalize(0.0);
        normal.map_or(0.0, |normal| (self.at(t) - there[0]).dot(&normal))
    }

    fn is_between(&self, corners: &[Self; D], t: f64) -> bool {
        is_between(&self.at(t), &corners.map(|corner| corner.at(t)))
    }
}

/// Length of the longest edge from the first corner, at the start \[m\].
fn size_of<const D: usize>(corners: &[Path<D>; D]) -> f64 {
    (1..D).map(|k| (corners[k].start - corners[0].start).norm()).fold(0.0, f64::max)
}

/// Whether a round obstacle lies in a simplex, or went through it in a step, though none of the points of the facet that it
/// is part of touches: the simplex ends `deep` \[m\] in the obstacle, or swept over its centre or axis.
pub fn lies_between<const D: usize>(corners: &[Path<D>; D], obstacle: &dyn Shape<D>, deep: f64) -> bool {
    let Some(core) = obstacle.core() else { return false };
    let ends = corners.map(|corner| corner.end);
    let swept = match core.axis {
        Some(axis) => sweeps_axis(corners, &core, &axis),
        None => Path { start: core.point, end: core.point }.passes_simplex(corners, core.radius),
    };
    swept || deepest(&ends, obstacle) < -deep
}

/// Whether an edge of a moving simplex meets an axis at some time in the step. A simplex that has the axis in
/// it without that has it at the end.
fn sweeps_axis<const D: usize>(corners: &[Path<D>; D], core: &Core<D>, axis: &Vector<D>) -> bool {
    let across =
        corners.map(|corner| Path { start: core.offset(&corner.start), end: core.offset(&corner.end) });
    (0..D).any(|k| {
        let [a, b] = [across[k], across[(k + 1) % D]];
        let [da, db] = [a, b].map(|path| path.end - path.start);
        let turn = |a: &Vector<D>, b: &Vector<D>| {
            axis.dot(&facet_normal(&std::array::from_fn(|k| if k == 0 { *a } else { *b })))
        };
        // Seen along the axis: `turn(a, b)` is quadratic in time, zero where the line through both meets the axis.
        let polynomial =
            [turn(&a.start, &b.start), turn(&a.start, &db) + turn(&da, &b.start), turn(&da, &db)];
        let meets = |t: &f64| (0.0..=1.0).contains(t) && a.at(*t).dot(&b.at(*t)) <= 0.0;
        roots(polynomial).iter().any(meets)
    })
}

/// Real roots of `c_0 + c_1 t + c_2 t^2`; not numbers where there are none, or all are.
fn roots([c0, c1, c2]: [f64; 3]) -> [f64; 2] {
    // By the larger of both first: nothing cancels.
    let larger = -0.5 * (c1 + (c1 * c1 - 4.0 * c0 * c2).sqrt().copysign(c1));
    [larger / c2, c0 / larger]
}

/// The smallest gap on a simplex \[m\]; gaps of round obstacles are convex.
fn deepest<const D: usize>(corners: &[Vector<D>; D], obstacle: &dyn Shape<D>) -> f64 {
    let along = |from: &Vector<D>, to: &Vector<D>| smallest(|t| obstacle.gap(&(from + (to - from) * t)));
    match D {
        2 => along(&corners[0], &corners[1]),
        _ => smallest(|t| {
            let [left, right] = [1, 2].map(|k| corners[0] + (corners[k] - corners[0]) * t);
            along(&left, &right)
        }),
    }
}

/// The smallest value of a convex function between 0 and 1, to a few digits.
fn smallest(f: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..30 {
        let third = (high - low) / 3.0;
        if f(low + third) < f(high - third) { high -= third } else { low += third }
    }
    f(0.5 * (low + high))
}

/// The outward normal of the simplex with these corners, as long as its measure or twice it.
pub fn normal_of<const D: usize>(corners: &[Vector<D>; D]) -> Vector<D> {
    facet_normal(&std::array::from_fn(
        |k| if k + 1 < D { corners[k + 1] - corners[0] } else { Vector::zeros() },
    ))
}

/// Whether a point on the plane of the simplex lies between its corners, by barycentric coordinates: the part of the
/// whole that is left where the point takes the place of a corner.
fn is_between<const D: usize>(x: &Vector<D>, corners: &[Vector<D>; D]) -> bool {
    let whole = normal_of(corners);
    let part = |corner: usize| {
        let mut replaced = *corners;
        replaced[corner] = *x;
        normal_of(&replaced).dot(&whole)
    };
    (0..D).all(|corner| part(corner) >= -BORDER * whole.norm_squared())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::obstacle::{Cylinder, Plane, Side, Sphere};

    /// Half of the radius of the larger discs and balls here.
    const DEEP: f64 = 0.05;

    fn still<const D: usize>(x: Vector<D>) -> Path<D> {
        Path { start: x, end: x }
    }

    fn path<const D: usize>(start: [f64; D], end: [f64; D]) -> Path<D> {
        Path { start: start.into(), end: end.into() }
    }

    /// Through a disc, past it, along it, into it and off a plane: only the first passes.
    #[test]
    fn only_a_chord_passes_an_obstacle() {
        let disc = Sphere::new(Vector::<2>::zeros(), 0.1, Side::Outside);
        assert!(path([0.0, 1.0], [0.02, -1.0]).passes_obstacle(&disc));
        assert!(path([0.0, 1.0], [0.0, -0.05]).passes_obstacle(&disc), "closed, but beyond the middle");
        assert!(path([0.05, 1.0], [0.05, 0.0]).passes_obstacle(&disc), "closed, and pushed aside");
        assert!(path([0.05, 100.0], [0.05, -100.0]).passes_obstacle(&disc));
        assert!(!path([0.0, 0.1], [0.01, 0.0995]).passes_obstacle(&disc), "slides");
        assert!(!path([0.2, 1.0], [0.2, -1.0]).passes_obstacle(&disc));
        assert!(!path([0.0, 0.1001], [0.01, 0.1001]).passes_obstacle(&disc));
        assert!(!path([0.0, 1.0], [0.0, 0.05]).passes_obstacle(&disc));
        let plane = Plane::new(Vector::<2>::zeros(), Vector::<2>::new(0.0, 1.0));
        assert!(!path([0.0, 1.0], [5.0, 1e-3]).passes_obstacle(&plane));
    }

    /// A disc or ball between the corners of a facet, or swept over by it, is seen; one beside it, in front of it or larger than
    /// what it is cut by is not.
    #[test]
    fn small_obstacles_between_points_are_seen() {
        let disc = |y: f64, radius: f64| Sphere::new(Vector::<2>::new(0.5, y), radius, Side::Outside);
        // Outward is down: the disc comes from below.
        let facet = |y: f64| [path([0.0, 0.0], [0.0, y]), path([1.0, 0.0], [1.0, y])];
        assert!(lies_between(&facet(-0.1), &disc(-0.14, 0.1), DEEP));
        assert!(!lies_between(&facet(-0.1), &disc(-0.16, 0.1), DEEP), "its cap alone");
        assert!(lies_between(&facet(-0.1), &disc(-0.16, 0.1), 0.02), "its cap, where that is too much");
        assert!(!lies_between(&facet(-0.1), &disc(-0.3, 0.1), DEEP));
        assert!(lies_between(&facet(-1.0), &disc(-0.5, 0.01), DEEP), "swept over");
        assert!(!lies_between(&facet(-1.0), &disc(0.5, 0.01), DEEP), "on the other side all the while");
        let beside = Sphere::new(Vector::<2>::new(1.2, -0.1), 0.1, Side::Outside);
        assert!(!lies_between(&facet(-0.1), &beside, DEEP));
        let corners =
            [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(|x| still(Vector::<3>::from(x)));
        let ball = |x: [f64; 3]| Sphere::new(x.into(), 0.1, Side::Outside);
        assert!(lies_between(&corners, &ball([0.3, 0.3, 0.04]), DEEP));
        assert!(!lies_between(&corners, &ball([0.3, 0.3, 0.06]), DEEP));
        assert!(!lies_between(&corners, &ball([0.7, 0.7, 0.0]), DEEP));
    }

    /// A cylinder that a triangle swept over is seen, along any edge of it, aslant to its axis, and where the triangle turns;
    /// one that it passes beside, or stops short of, is not.
    #[test]
    fn a_cylinder_swept_over_is_seen() {
        let cylinder = |x: f64, y: f64| {
            let (point, axis) = (Vector::<3>::new(x, y, 0.0), Vector::<3>::new(0.0, 0.0, 1.0));
            Cylinder::new(point, axis, 0.01, Side::Outside)
        };
        // In the plane y = 0, moving down; seen along the axis a line from x = 0 to 1.
        let moving = |dy: [f64; 3]| {
            let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.3, 0.0, 1.0]].map(Vector::<3>::from);
            std::array::from_fn(|k| Path {
                start: corners[k],
                end: corners[k] + Vector::<3>::new(0.0, dy[k], 0.0),
            })
        };
        for x in [0.02, 0.3, 0.5, 0.98] {
            assert!(lies_between(&moving([-1.0; 3]), &cylinder(x, -0.5), DEEP), "{x}");
            assert!(!lies_between(&moving([-1.0; 3]), &cylinder(x, -1.1), DEEP), "{x}");
            assert!(!lies_between(&moving([-1.0; 3]), &cylinder(x, 0.1), DEEP), "{x}");
        }
        assert!(!lies_between(&moving([-1.0; 3]), &cylinder(1.1, -0.5), DEEP));
        assert!(lies_between(&moving([0.0, -2.0, -0.6]), &cylinder(0.5, -0.5), DEEP), "turns");
        assert!(!lies_between(&moving([0.0, -2.0, -0.6]), &cylinder(0.5, -1.2), DEEP), "turns");
        let [point, axis] = [[0.4, -0.5, 0.3], [0.3, 0.2, 1.0]].map(Vector::<3>::from);
        let aslant = Cylinder::new(point, axis, 0.01, Side::Outside);
        assert!(lies_between(&moving([-1.0; 3]), &aslant, DEEP));
        assert!(!lies_between(&moving([-0.2; 3]), &aslant, DEEP));
    }

    /// Front to back counts, back to front and beside do not, and what flies along with the point is not passed.
    #[test]
    fn only_front_to_back_passes_a_facet() {
        // Outward of the order of nodes is down the y axis for a line along +x, as for the bottom of a body.
        let line = |y: f64, dy: f64| {
            [
                Path { start: Vector::<2>::new(1.0, y), end: Vector::<2>::new(1.0, y + dy) },
                Path { start: Vector::<2>::new(0.0, y), end: Vector::<2>::new(0.0, y + dy) },
            ]
        };
        assert!(path([0.5, 1.0], [0.5, -1.0]).passes_simplex(&line(0.0, 0.0), 0.1));
        // A point that touches passes once it is too deep to be seen, and not where it slides off.
        assert!(path([0.5, 0.0], [0.5, -0.2]).passes_simplex(&line(0.0, 0.0), 0.1));
        assert!(!path([0.5, 0.0], [0.5, -0.05]).passes_simplex(&line(0.0, 0.0), 0.1));
        assert!(!path([0.5, 0.0], [1.5, -0.2]).passes_simplex(&line(0.0, 0.0), 0.1));
        assert!(!path([0.5, -1.0], [0.5, 1.0]).passes_simplex(&line(0.0, 0.0), 0.1));
        assert!(!path([0.9, 0.02], [1.1, -0.05]).passes_simplex(&line(0.0, 0.0), 0.1), "grazes an edge");
        assert!(!path([1.5, 1.0], [1.5, -1.0]).passes_simplex(&line(0.0, 0.0), 0.1));
        assert!(!path([0.5, 1.0], [0.5, -1.0]).passes_simplex(&line(0.0, -2.0), 0.1));
        assert!(path([0.5, 1.0], [0.5, 1.0]).passes_simplex(&line(0.0, 2.0), 0.1));
        let corners =
            [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(|x| still(Vector::<3>::from(x)));
        assert!(path([0.2, 0.2, 1.0], [0.2, 0.2, -1.0]).passes_simplex(&corners, 0.1));
        assert!(!path([0.2, 0.2, -1.0], [0.2, 0.2, 1.0]).passes_simplex(&corners, 0.1));
        assert!(!path([0.6, 0.6, 1.0], [0.6, 0.6, -1.0]).passes_simplex(&corners, 0.1));
    }
}
