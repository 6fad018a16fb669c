//! Chain of straight lines in the plane with a radius: its signed distance, and the outline of the
//! region that it bounds.

use std::rc::Rc;

use super::drawing::{Window, beside};
use super::piece::Piece;
use super::shape::{CENTRE, Proximity, tube_about};
use crate::tensor::{Tensor, Vector};

/// Maximum number of points. Every line is examined for every contact point, so this bounds the
/// work at a point.
pub(super) const MOST_POINTS: usize = 10_000;

/// What is at the ends of a chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ends {
    /// Nothing: the chain bounds no region.
    Free,
    /// The last point is joined to the first one, and the chain bounds a region.
    Joined,
    /// Both ends are at x = 0, and the chain and its mirror image bound a region. Positions have
    /// x >= 0.
    Mirrored,
}

/// All points at the radius from a chain of straight lines in the plane, or from the region that the
/// chain bounds.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Chain {
    /// Anticlockwise around the region \[m\].
    points: Rc<[Vector<2>]>,
    ends: Ends,
    radius: f64,
}

/// The vector rotated to the right by a right angle.
fn right_of(along: &Vector<2>) -> Vector<2> {
    Vector::<2>::new(along[1], -along[0])
}

fn cross(a: &Vector<2>, b: &Vector<2>) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

impl Chain {
    /// From points \[m\] in either direction around the region, and a radius > 0 \[m\].
    pub fn new(mut points: Vec<Vector<2>>, ends: Ends, radius: f64) -> Self {
        if ends != Ends::Free && area(&points) < 0.0 {
            points.reverse();
        }
        Self { points: points.into(), ends, radius }
    }

    /// Distance of the surface from the chain \[m\].
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Whether the last point is joined to the first one.
    pub fn is_joined(&self) -> bool {
        self.ends == Ends::Joined
    }

    fn lines(&self) -> usize {
        let count = self.points.len();
        if self.ends == Ends::Joined { count } else { count.saturating_sub(1) }
    }

    fn line(&self, line: usize) -> [Vector<2>; 2] {
        [self.points[line], self.points[(line + 1) % self.points.len()]]
    }

    /// Unit directions of the lines to and from a corner. At an end of a mirrored chain one of them
    /// is of the mirror image. `None` at the ends of a free chain, and if a line has no length.
    fn directions(&self, corner: usize) -> Option<[Vector<2>; 2]> {
        let count = self.points.len();
        let along = |line: usize| {
            let [from, to] = self.line(line);
            (to - from).try_normalize(0.0)
        };
        let mirrored = |along: Vector<2>| Vector::<2>::new(along[0], -along[1]);
        let is_end = corner == 0 || corner + 1 == count;
        match self.ends {
            _ if !is_end => Some([along(corner - 1)?, along(corner)?]),
            Ends::Free => None,
            Ends::Joined => Some([along((corner + count - 1) % count)?, along(corner)?]),
            Ends::Mirrored if corner == 0 => along(0).map(|leaving| [mirrored(leaving), leaving]),
            Ends::Mirrored => along(corner - 1).map(|arriving| [arriving, mirrored(arriving)]),
        }
    }

    /// Signed distance of `x` \[m\] from the surface, its gradient and its Hessian, positive outside.
    ///
    /// Nearer to the end of a line than `CENTRE` times the radius, `x` counts as beside the line.
    /// Where two lines continue each other, so no curvature appears.
    pub fn proximity(&self, x: &Vector<2>) -> Proximity<2> {
        let mut best = (f64::INFINITY, 0, 0.0);
        for line in 0..self.lines() {
            let [from, to] = self.line(line);
            let span = to - from;
            let along = span.dot(&(x - from)) / span.norm_squared();
            let square = (x - from - span * along.clamp(0.0, 1.0)).norm_squared();
            if square < best.0 {
                best = (square, line, along);
            }
        }
        let (_, line, along) = best;
        let [from, to] = self.line(line);
        let length = (to - from).norm();
        let is_bounded = self.ends != Ends::Free;
        if (-along).max(along - 1.0) * length <= CENTRE * self.radius {
            let normal = right_of(&(to - from)) / length;
            let height = normal.dot(&(x - from));
            let sign = if is_bounded || height >= 0.0 { 1.0 } else { -1.0 };
            return Proximity {
                gap: sign * height - self.radius,
                normal: normal * sign,
                hessian: Tensor::zeros(),
            };
        }
        let corner = if along < 0.0 { line } else { (line + 1) % self.points.len() };
        let way = x - self.points[corner];
        let (distance, normal, hessian) = tube_about(&way, None, self.radius);
        // The sign follows from the sum of the normals of both lines.
        let outward = self.directions(corner).map(|[to, from]| right_of(&(to + from)));
        let is_inside = is_bounded && outward.is_some_and(|outward| way.dot(&outward) < 0.0);
        let sign = if is_inside { -1.0 } else { 1.0 };
        Proximity { gap: sign * distance - self.radius, normal: normal * sign, hessian: hessian * sign }
    }

    /// The outline of the solid around the region: lines, and arcs about the corners that point
    /// outward. Of a mirrored chain only the half with x >= 0, without the line on the axis. `None` if
    /// the chain bounds no region, or if the radius fills a notch, so that this is not its surface.
    pub fn outline(&self) -> Option<Vec<Piece>> {
        if self.ends == Ends::Free {
            return None;
        }
        let count = self.points.len();
        // Angle by which the chain turns to the left at a corner.
        let turn = |corner: usize| {
            let [to, from] = self.directions(corner)?;
            Some(cross(&to, &from).atan2(to.dot(&from)))
        };
        // Length by which lines end before a corner that points inward.
        let cut = |corner: usize| Some((-0.5 * turn(corner)?).tan().max(0.0) * self.radius);
        let mut is_convex = true;
        let mut pieces = Vec::new();
        let mut marks = Vec::new();
        for corner in 0..count {
            let angle = turn(corner)?;
            is_convex &= angle >= 0.0;
            if angle > 0.0 {
                let centre = self.points[corner];
                let right = right_of(&self.directions(corner)?[0]);
                let from = right[1].atan2(right[0]);
                // The arc about the end of a mirrored chain is cut apart by the axis.
                let is_mirrored = |end: usize| self.ends == Ends::Mirrored && corner == end;
                let first = if is_mirrored(0) { from + 0.5 * angle } else { from };
                let last = if is_mirrored(count - 1) { from + 0.5 * angle } else { from + angle };
                pieces.push(Piece::Arc { centre, radius: self.radius, from: first, to: last });
                let (sine, cosine) = (0.5 * (first + last)).sin_cos();
                marks.push(centre + Vector::<2>::new(cosine, sine) * self.radius);
            }
            if corner == self.lines() {
                break;
            }
            let [start, end] = self.line(corner);
            let along = (end - start).try_normalize(0.0)?;
            let right = right_of(&along) * self.radius;
            let from = start + right + along * cut(corner)?;
            let to = end + right - along * cut((corner + 1) % count)?;
            if (to - from).dot(&along) < 0.0 {
                return None;
            }
            pieces.push(Piece::Line { from, to });
            marks.extend([from, (from + to) * 0.5, to]);
        }
        /// Depth below the surface, per radius, at which a mark is not on it: well above the rounding
        /// of angles.
        const DEPTH: f64 = 1e-6;
        /// Rounding of a mark's gap, per coordinate: a small radius is not smaller than it.
        const ROUNDING: f64 = 1e-14;
        let is_covered = |mark: &Vector<2>| {
            let x = if self.ends == Ends::Mirrored { mark[0].abs() } else { mark[0] };
            let depth = DEPTH * self.radius + ROUNDING * mark.amax();
            self.proximity(&Vector::<2>::new(x, mark[1])).gap < -depth
        };
        if !is_convex && marks.iter().any(is_covered) {
            return None;
        }
        Some(pieces)
    }

    /// Points of the surface, one after the other around the region or the chain, for a picture. Of a
    /// mirrored chain they lead from the axis to the axis.
    pub fn curve<const D: usize>(&self, window: &Window<D>) -> Vec<Vector<2>> {
        let Some(pieces) = self.outline() else {
            // In notches the curve beside the chain is within the radius of other lines.
            let is_surface = |x: &Vector<2>| {
                let is_right = self.ends != Ends::Mirrored || x[0] >= 0.0;
                is_right && self.proximity(x).gap.abs() <= 1e-6 * self.radius
            };
            return beside(&self.around(), self.radius, window).into_iter().filter(is_surface).collect();
        };
        let of_piece = |piece: &Piece| -> Vec<Vector<2>> {
            match *piece {
                Piece::Line { from, to } => vec![from, to],
                Piece::Arc { centre, radius, from, to } => window.arc(centre, radius, [from, to]).collect(),
            }
        };
        let mut points: Vec<Vector<2>> = pieces.iter().flat_map(of_piece).collect();
        // Pieces end where the next one begins.
        let are_one = |one: &Vector<2>, other: &Vector<2>| (one - other).norm() <= 1e-9 * self.radius;
        points.dedup_by(|next, last| are_one(next, last));
        if self.is_joined()
            && points.first().zip(points.last()).is_some_and(|(one, other)| are_one(one, other))
        {
            points.pop();
        }
        points
    }

    /// The chain as a closed one: free ones there and back, mirrored ones with their mirror image.
    fn around(&self) -> Vec<Vector<2>> {
        let points = self.points.iter().copied();
        let back = self.points.iter().rev().skip(1).take(self.points.len().saturating_sub(2)).copied();
        match self.ends {
            Ends::Joined => points.collect(),
            Ends::Free => points.chain(back).collect(),
            Ends::Mirrored => points.chain(back.map(|x| Vector::<2>::new(-x[0], x[1]))).collect(),
        }
    }
}

/// Pairs of neighbours in a list of points that are the same point, as numbers from 0. In a closed
/// chain the last and the first point are neighbours.
pub(super) fn repeated(points: &[Vector<2>], is_closed: bool) -> Vec<[usize; 2]> {
    let count = points.len();
    let last = if is_closed { count } else { count.saturating_sub(1) };
    let pairs = (0..last).map(|k| [k, (k + 1) % count]);
    pairs.filter(|&[one, other]| points[one] == points[other]).collect()
}

/// Twice the area within a closed chain \[m2\], positive if it runs anticlockwise.
fn area(points: &[Vector<2>]) -> f64 {
    let origin = points.first().copied().unwrap_or_default();
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).map(|(a, b)| cross(&(a - origin), &(b - origin))).sum()
}

/// Whether a closed chain encloses an area beyond rounding.
pub(super) fn encloses_area(points: &[Vector<2>]) -> bool {
    /// Area per squared length of the chain: well above the rounding of points in one line.
    const ROUNDING: f64 = 1e-12;
    let square = points.iter().map(|x| (x - points[0]).norm_squared()).fold(0.0, f64::max);
    area(points).abs() > ROUNDING * square
}

/// Two lines of a closed chain that meet although they are not neighbours.
pub(super) fn crossing(points: &[Vector<2>]) -> Option<[usize; 2]> {
    let count = points.len();
    let ends = |line: usize| [points[line], points[(line + 1) % count]];
    let side = |[a, b]: [Vector<2>; 2], c: Vector<2>| cross(&(b - a), &(c - a));
    let apart = |[a, b]: [Vector<2>; 2], [c, d]: [Vector<2>; 2]| {
        (0..2).any(|i| a[i].max(b[i]) < c[i].min(d[i]) || c[i].max(d[i]) < a[i].min(b[i]))
    };
    let splits = |line: [Vector<2>; 2], [c, d]: [Vector<2>; 2]| side(line, c) * side(line, d) <= 0.0;
    (0..count).find_map(|one| {
        let own = ends(one);
        let meets = |&other: &usize| {
            let neighbours = other == one + 1 || (one == 0 && other + 1 == count);
            let its = ends(other);
            !neighbours && !apart(own, its) && splits(own, its) && splits(its, own)
        };
        (one + 1..count).find(meets).map(|other| [one, other])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where two lines continue each other there is no curvature, whatever rounding does.
    #[test]
    fn a_joint_of_lines_in_one_direction_is_flat() {
        let along = Vector::<2>::new(0.6, -0.3).normalize();
        let normal = Vector::<2>::new(-along[1], along[0]);
        for length in [0.1, 0.3, 0.7, 1.1, 3.3] {
            let points = [-0.77, 0.0, length].map(|t| Vector::<2>::new(0.1, 0.7) + along * t);
            let chain = Chain::new(points.to_vec(), Ends::Free, 0.2);
            for height in [-1.7, -0.31, 0.07, 0.9] {
                let at = chain.proximity(&(points[1] + normal * height));
                assert_eq!(at.hessian, Tensor::<2>::zeros());
                assert!((at.gap - (height.abs() - 0.2)).abs() < 1e-15);
            }
            let end = chain.proximity(&(points[2] + along * 0.5));
            assert!((end.gap - 0.3).abs() < 1e-15 && (end.hessian.trace() - 2.0).abs() < 1e-14);
        }
    }

    /// Points in one line enclose no area, in any direction and anywhere. A thin plate does.
    #[test]
    fn points_in_one_line_enclose_no_area() {
        for [x, y] in [[0.1, 0.3], [0.7, -0.2], [1.3, 0.11]] {
            let line = [1.0, 2.0, 3.0, 2.5].map(|t| Vector::<2>::new(x * t + 7.0, y * t));
            assert!(!encloses_area(&line), "{x} {y}");
            let plate = [1.0, 2.0, 3.0, 2.5].map(|t| Vector::<2>::new(x * t, y * t + 1e-6 * t * t));
            assert!(encloses_area(&plate), "{x} {y}");
        }
    }

    /// Of an outline in either direction, joined or mirrored, the pieces follow each other
    /// anticlockwise, and a mirrored one starts and ends on the axis.
    #[test]
    fn pieces_of_an_outline_follow_each_other() {
        let mut points = [[0.0, 0.4], [0.7, -0.1], [0.8, 0.5], [0.4, 0.6], [0.5, 1.2], [0.0, 1.5]]
            .map(Vector::<2>::from)
            .to_vec();
        for ends in [Ends::Mirrored, Ends::Joined] {
            for _ in 0..2 {
                points.reverse();
                let pieces = Chain::new(points.clone(), ends, 0.05).outline().unwrap();
                let on = |centre: Vector<2>, radius: f64, angle: f64| {
                    centre + Vector::<2>::new(angle.cos(), angle.sin()) * radius
                };
                let tips = pieces.iter().map(|piece| match *piece {
                    Piece::Line { from, to } => [from, to],
                    Piece::Arc { centre, radius, from, to } => {
                        assert!(to > from);
                        [on(centre, radius, from), on(centre, radius, to)]
                    }
                });
                let tips: Vec<[Vector<2>; 2]> = tips.collect();
                assert!(tips.windows(2).all(|pair| (pair[0][1] - pair[1][0]).norm() < 1e-15), "{pieces:?}");
                let [first, last] = [tips[0][0], tips[tips.len() - 1][1]];
                match ends {
                    Ends::Mirrored => assert!(first[0].abs() < 1e-15 && last[0].abs() < 1e-15, "{pieces:?}"),
                    _ => assert!((first - last).norm() < 1e-15, "{pieces:?}"),
                }
            }
        }
        assert!(Chain::new(points, Ends::Free, 0.05).outline().is_none());
    }
}
