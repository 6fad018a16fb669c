//! Missed contact: a point passes through its target within one step and is open at both ends.
//!
//! Equilibrium is enforced only at the ends of a step. Between them, points and target facets are
//! assumed to move on straight lines at constant speed. A point that is open at both ends must not
//! have crossed the target in between.

use super::obstacle::{Core, Outline, Shape, is_flat_along};
use crate::space::facet_normal;
use crate::tensor::Vector;

/// Positions at both ends of a step \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Path<const D: usize> {
    /// At the start.
    pub start: Vector<D>,
    /// At the end.
    pub end: Vector<D>,
}

/// Cosine of 0.2, the largest rotation of an obstacle's normal along the path of a point through
/// it. This corresponds to a chord of one fifth of the radius, at a depth of 0.005 radii.
const COSINE: f64 = 0.98;
/// The same for shapes with edges (96 degrees). Within one step a point may slide around an edge of
/// a box, or meet it where both of its faces are equally near. It may not pass through a plate. At
/// a right angle (0) rounding would decide. At an obtuse limit such as -0.5, a point that passes
/// through the corner of a triangular plate would be accepted.
const EDGE_COSINE: f64 = -0.1;
/// Part of a path by which a search for the surface advances at least. A shape that is thinner than
/// this part of the path can be missed if the path only grazes it.
const STRIDE: f64 = 1e-3;
/// Bisection steps that find the time of an intersection, or the deepest point of a chord.
const HALVINGS: usize = 60;
/// A path crosses a facet if it misses its border by less than this fraction of its size.
const BORDER: f64 = 1e-6;
/// A point that grazes an edge may lie behind the plane of a facet by less than this fraction of
/// its size, and still be outside.
const GRAZE: f64 = 0.25;
/// Closer to the plane of a facet than this fraction of its size, a point is neither in front nor
/// behind.
const TOUCH: f64 = 1e-9;

impl<const D: usize> Path<D> {
    /// Position at the fraction `t` of the step.
    pub fn at(&self, t: f64) -> Vector<D> {
        self.start + (self.end - self.start) * t
    }

    /// Length \[m\].
    pub fn length(&self) -> f64 {
        (self.end - self.start).norm()
    }

    /// Whether the normal of `obstacle` rotates too much between the entry of this path and its end
    /// or exit. The nearest surface point is then on another side.
    pub fn passes_obstacle(&self, obstacle: &dyn Shape<D>) -> bool {
        let gap = |t: f64| obstacle.gap(&self.at(t));
        let ends = [gap(0.0), gap(1.0)];
        // The gap changes at most as much as the position.
        let length = self.length();
        if ends[0] + ends[1] >= length || is_flat_along(obstacle, length, ends[0].min(ends[1])) {
            return false;
        }
        match obstacle.outline() {
            Outline::Round => {}
            Outline::Smooth => return self.turns_through(obstacle, COSINE),
            Outline::Edged => return self.turns_through(obstacle, EDGE_COSINE),
        }
        // Outside of round obstacles the gap is convex along a line; inside of hollow ones no line
        // leaves.
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

    /// Whether the cosine between the normals where this path first enters an obstacle and where it
    /// last leaves it, or ends in it, is below `limit`. The gap of a signed distance changes at most
    /// as much as the position, so a search from both ends can advance by the gap.
    fn turns_through(&self, obstacle: &dyn Shape<D>, limit: f64) -> bool {
        let length = self.length();
        let from_end = |at: &dyn Fn(f64) -> f64| {
            let mut t = 0.0;
            while t < 1.0 {
                let gap = obstacle.gap(&self.at(at(t)));
                if gap <= 0.0 {
                    return Some(obstacle.proximity(&self.at(at(t))).normal);
                }
                t += (gap / length).max(STRIDE);
            }
            None
        };
        let (first, last) = (from_end(&|t| t), from_end(&|t| 1.0 - t));
        first.zip(last).is_some_and(|(first, last)| first.dot(&last) < limit)
    }

    /// Whether a point on this path moves from the front of a moving simplex to its back, between
    /// its corners. The simplex is a line in the plane, and in space a triangle whose corners are
    /// anticlockwise seen from the front.
    ///
    /// The point must end behind the simplex by more than the search depth `depth` \[m\], or by
    /// more than a point that grazes an edge and is outside again. A point that initially touches
    /// the simplex, or lies less than `depth` behind it, passes if it ends deeper than `depth` and
    /// is still behind the simplex.
    pub fn passes_simplex(&self, corners: &[Self; D], depth: f64) -> bool {
        self.goes_behind(corners, depth, depth.min(GRAZE * size_of(corners)))
    }

    /// Whether a point on this path starts in front of a moving simplex, or less than `depth` \[m\]
    /// behind it, passes between its corners, and ends deeper than `depth` behind it.
    pub fn crosses(&self, corners: &[Self; D], depth: f64) -> bool {
        self.goes_behind(corners, depth, depth)
    }

    /// Whether the point passes behind a simplex. A point in front passes if it ends deeper than
    /// `entered` \[m\]. A point less than `depth` \[m\] behind passes if it ends deeper than
    /// `depth`.
    fn goes_behind(&self, corners: &[Self; D], depth: f64, entered: f64) -> bool {
        let [start, end] = [0.0, 1.0].map(|t| self.height(corners, t));
        if start <= TOUCH * size_of(corners) {
            let between = |t: f64| self.is_between(corners, t);
            return start >= -depth && end < -depth && between(0.0) && between(1.0);
        }
        end <= -entered && self.enters(corners)
    }

    /// Whether a point on this path crosses the plane of a moving simplex between its corners. The
    /// point is in front of the simplex at the start and behind it at the end.
    fn enters(&self, corners: &[Self; D]) -> bool {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if self.height(corners, middle) > 0.0 { low = middle } else { high = middle }
        }
        self.is_between(corners, high)
    }

    /// Whether a point on this path ends above or below a moving simplex, at a distance of at most
    /// `within` \[m\].
    pub fn is_over(&self, corners: &[Self; D], within: f64) -> bool {
        self.height(corners, 1.0).abs() <= within && self.is_between(corners, 1.0)
    }

    /// Whether a point that crossed one simplex only went around an edge: it ends above or below
    /// another one at the same corner, at a distance of at most `within` \[m\], where the contact sees
    /// it. The simplices meet at 96 degrees at most, so that no point goes through a tip.
    pub fn goes_around(&self, crossed: &[Self; D], other: &[Self; D], within: f64) -> bool {
        if !crossed.iter().any(|corner| other.contains(corner)) {
            return false;
        }
        let [a, b] = [crossed, other].map(|corners| normal_of(&corners.map(|corner| corner.end)));
        a.dot(&b) > EDGE_COSINE * a.norm() * b.norm() && self.is_over(other, within)
    }

    /// Height above the plane of a simplex at the fraction `t` of the step \[m\]; 0 if the simplex
    /// is degenerate.
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

/// Whether a round obstacle penetrates a simplex, or moved through it in a step, although no point
/// of its facet touches. The simplex ends `deep` \[m\] inside the obstacle, or swept over its
/// centre or axis.
pub fn lies_between<const D: usize>(corners: &[Path<D>; D], obstacle: &dyn Shape<D>, deep: f64) -> bool {
    let Some(core) = obstacle.core() else { return false };
    let ends = corners.map(|corner| corner.end);
    let swept = match core.axis {
        Some(axis) => sweeps_axis(corners, &core, &axis),
        None => Path { start: core.point, end: core.point }.passes_simplex(corners, core.radius),
    };
    swept || deepest(&ends, obstacle) < -deep
}

/// Whether an edge of a moving simplex crosses an axis at some time in the step. Otherwise a
/// simplex that the axis pierces during the step is still pierced at the end.
fn sweeps_axis<const D: usize>(corners: &[Path<D>; D], core: &Core<D>, axis: &Vector<D>) -> bool {
    let across =
        corners.map(|corner| Path { start: core.offset(&corner.start), end: core.offset(&corner.end) });
    (0..D).any(|k| {
        let [a, b] = [across[k], across[(k + 1) % D]];
        let [da, db] = [a, b].map(|path| path.end - path.start);
        let turn = |a: &Vector<D>, b: &Vector<D>| {
            axis.dot(&facet_normal(&std::array::from_fn(|k| if k == 0 { *a } else { *b })))
        };
        // Seen along the axis: `turn(a, b)` is quadratic in time, and zero when the line through
        // both points meets the axis.
        let polynomial =
            [turn(&a.start, &b.start), turn(&a.start, &db) + turn(&da, &b.start), turn(&da, &db)];
        let meets = |t: &f64| (0.0..=1.0).contains(t) && a.at(*t).dot(&b.at(*t)) <= 0.0;
        roots(polynomial).iter().any(meets)
    })
}

/// Real roots of `c_0 + c_1 t + c_2 t^2`; non-finite if there are no roots or the polynomial is
/// zero.
fn roots([c0, c1, c2]: [f64; 3]) -> [f64; 2] {
    // Compute the root of larger magnitude first to avoid cancellation.
    let larger = -0.5 * (c1 + (c1 * c1 - 4.0 * c0 * c2).sqrt().copysign(c1));
    [larger / c2, c0 / larger]
}

/// The smallest gap on a simplex \[m\]; the gap of a round obstacle is convex.
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

/// The outward normal of the simplex with these corners. Its length is the measure of the simplex
/// or twice that.
pub fn normal_of<const D: usize>(corners: &[Vector<D>; D]) -> Vector<D> {
    facet_normal(&std::array::from_fn(
        |k| if k + 1 < D { corners[k + 1] - corners[0] } else { Vector::zeros() },
    ))
}

/// Whether a point on the plane of the simplex lies between its corners. Each barycentric
/// coordinate is the relative measure that remains when the point replaces a corner.
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
    use crate::contact::obstacle::{
        BoxObstacle, CapsuleObstacle, Cylinder, Obstacle, Plane, Side, Sphere, TorusObstacle, TurnedObstacle,
    };

    /// Half of the radius of the larger discs and balls in these tests.
    const DEEP: f64 = 0.05;

    fn still<const D: usize>(x: Vector<D>) -> Path<D> {
        Path { start: x, end: x }
    }

    fn path<const D: usize>(start: [f64; D], end: [f64; D]) -> Path<D> {
        Path { start: start.into(), end: end.into() }
    }

    /// Paths through a disc, past it, along it, into it and off a plane: only the first passes.
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

    /// A point that passes through a plate, a ring or a capsule is detected, also if it ends in it
    /// beyond its middle. One that slides around an edge, or through the hole of a ring, is not.
    #[test]
    fn shapes_with_edges_are_passed_by_their_faces_only() {
        let shape = |obstacle: Obstacle| obstacle.shape::<3>();
        let plate = shape(BoxObstacle::of(&[0.0; 3], &[4.0, 4.0, 0.1], 0.02, Side::Outside).into());
        let profile = [[0.0, -0.03], [1.98, -0.03], [1.98, 0.03], [0.0, 0.03]];
        let disc = TurnedObstacle::of([0.0; 3], [0.0, 0.0, 1.0], &profile, 0.02, Side::Outside);
        for plate in [plate, shape(disc.into())] {
            assert!(path([0.0, 0.0, 1.0], [0.1, 0.0, -3.0]).passes_obstacle(&*plate));
            assert!(path([0.0, 0.0, 1.0], [0.1, 0.0, -0.02]).passes_obstacle(&*plate), "beyond the middle");
            assert!(!path([0.0, 0.0, 1.0], [0.1, 0.0, 0.02]).passes_obstacle(&*plate));
            assert!(!path([1.99, 0.0, 0.049], [2.0, 0.0, 0.0]).passes_obstacle(&*plate), "around an edge");
            assert!(!path([3.0, 0.0, 1.0], [3.0, 0.0, -1.0]).passes_obstacle(&*plate));
        }
        let ring = shape(TorusObstacle::of([0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.1], Side::Outside).into());
        assert!(path([1.0, 0.0, 1.0], [1.0, 0.0, -1.0]).passes_obstacle(&*ring));
        assert!(path([3.0, 0.0, 0.0], [-3.0, 0.0, 0.0]).passes_obstacle(&*ring), "on both sides");
        assert!(!path([0.0, 0.0, 1.0], [0.0, 0.0, -1.0]).passes_obstacle(&*ring), "through its hole");
        let capsule = CapsuleObstacle::of(&[0.0; 3], &[1.0, 0.0, 0.0], 0.1, Side::Outside);
        assert!(path([0.5, 0.0, 1.0], [0.5, 0.05, -1.0]).passes_obstacle(&*shape(capsule.into())));
    }

    /// A point ahead of a block that ends at the bottom of the block went around its edge. One that ends
    /// deep in the block, or that goes through the tip of a wedge, did not.
    #[test]
    fn points_go_around_right_angles_only() {
        let line = |from: [f64; 2], to: [f64; 2]| [from, to].map(|corner| still(Vector::from(corner)));
        let (side, bottom) = (line([0.0, 0.0], [0.0, 1.0]), line([-1.0, 0.0], [0.0, 0.0]));
        let under = path([0.1, 0.02], [-0.3, -0.001]);
        assert!(under.crosses(&side, 0.1) && under.goes_around(&side, &bottom, 0.1));
        let inside = path([0.1, 0.02], [-0.3, 0.25]);
        assert!(inside.crosses(&side, 0.1) && !inside.goes_around(&side, &bottom, 0.1));
        let apart = line([-1.0, 0.0], [-0.1, 0.0]);
        assert!(!under.goes_around(&side, &apart, 0.1), "no common corner");
        let (front, back) = (line([0.0, 0.0], [-0.1, 1.0]), line([-0.3, 1.0], [0.0, 0.0]));
        let through = path([0.1, 0.4], [-0.2, 0.5]);
        assert!(through.crosses(&front, 0.05) && !through.goes_around(&front, &back, 0.2));
    }

    /// A disc or ball between the corners of a facet, or swept over by the facet, is detected. One
    /// beside it, in front of it or larger than the facet is not.
    #[test]
    fn small_obstacles_between_points_are_seen() {
        let disc = |y: f64, radius: f64| Sphere::new(Vector::<2>::new(0.5, y), radius, Side::Outside);
        // The outward normal points down: the disc comes from below.
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

    /// A cylinder swept over by a triangle is detected, along any edge, oblique to its axis, and
    /// for a rotating triangle. A cylinder that the triangle passes beside or does not reach is
    /// not.
    #[test]
    fn a_cylinder_swept_over_is_seen() {
        let cylinder = |x: f64, y: f64| {
            let (point, axis) = (Vector::<3>::new(x, y, 0.0), Vector::<3>::new(0.0, 0.0, 1.0));
            Cylinder::new(point, axis, 0.01, Side::Outside)
        };
        // In the plane y = 0, moving down; seen along the axis it is a line from x = 0 to 1.
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

    /// Front to back counts; back to front and beside do not. A facet that moves along with the
    /// point is not passed.
    #[test]
    fn only_front_to_back_passes_a_facet() {
        // By the order of nodes, the outward normal of a line along +x points in -y, as for the
        // bottom of a body.
        let line = |y: f64, dy: f64| {
            [
                Path { start: Vector::<2>::new(1.0, y), end: Vector::<2>::new(1.0, y + dy) },
                Path { start: Vector::<2>::new(0.0, y), end: Vector::<2>::new(0.0, y + dy) },
            ]
        };
        assert!(path([0.5, 1.0], [0.5, -1.0]).passes_simplex(&line(0.0, 0.0), 0.1));
        // A touching point passes once it is deeper than the search depth, but not if it slides
        // off.
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
