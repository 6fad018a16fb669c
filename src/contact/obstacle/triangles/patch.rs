//! A quadratic patch over a triangle, with the closest point of it.
//!
//! The patch is `p(u, v) = x_0 + a u + b v + c u^2 + d u v + e v^2` over `u, v >= 0, u + v <= 1`. Its
//! edges are parabolas whose ends are perpendicular to the normals of the corners (Nagata 2005).

use super::NearestPoint;
use crate::mesh::{Bounds, DisjointSets};
use crate::tensor::{Tensor, Vector, cross};

type Point = Vector<3>;

/// One patch.
#[derive(Debug, Clone)]
pub(super) struct Patch {
    corner: Point,
    /// `a`, `b`, `c`, `d`, `e` \[m\].
    coefficients: [Point; 5],
    /// Whether the surface bends smoothly over each edge, from corner 0 to 1, 1 to 2 and 2 to 0.
    smooth: [bool; 3],
    /// Whether the surface is smooth all around each corner.
    smooth_corners: [bool; 3],
    /// Sums of the normals of the flat triangles at each edge and around each corner, which tell
    /// inside from outside.
    edge_normals: [Point; 3],
    corner_normals: [Point; 3],
}

/// Where a closest point lies.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Region {
    /// Within the patch.
    Inner,
    /// On an edge, at this fraction of it.
    Edge(usize, f64),
    /// At a corner.
    Corner(usize),
}

/// Closest point of a patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Foot {
    /// Square of the distance \[m2\].
    pub square: f64,
    region: Region,
    /// Stationary point of the distance from the patch, which may extend beyond its edges.
    free: Option<[f64; 2]>,
}

/// Maximum number of iterations of Newton's method for a closest point. It converges quadratically:
/// a point without convergence after these is far away, and the edges are searched instead.
const MOST: usize = 20;
/// Change of a coordinate in a patch at which Newton's method ends.
const END: f64 = 1e-14;
/// Distance beyond an edge, as a coordinate in a patch, up to which a patch is extended over a
/// smooth edge. A point needs the jump of the normal over the edge times its distance, which is small
/// next to the patch, so that half and twice the value give the same distances there.
const EXTENT: f64 = 0.25;

impl Patch {
    /// The point at these coordinates \[m\].
    pub fn at(&self, u: f64, v: f64) -> Point {
        let [a, b, c, d, e] = self.coefficients;
        self.corner + a * u + b * v + c * (u * u) + d * (u * v) + e * (v * v)
    }

    /// Derivatives of the point by `u` and `v` \[m\], whose cross product is outward.
    pub fn tangents(&self, u: f64, v: f64) -> [Point; 2] {
        let [a, b, c, d, e] = self.coefficients;
        [a + c * (2.0 * u) + d * v, b + d * u + e * (2.0 * v)]
    }

    /// Start, slope and curvature `q_0`, `l`, `k` of the edge `q_0 + l t + k t^2`.
    fn edge(&self, edge: usize) -> [Point; 3] {
        let [a, b, c, d, e] = self.coefficients;
        match edge {
            0 => [self.corner, a, c],
            1 => {
                let from = self.corner + a + c;
                let bend = c + e - d;
                [from, self.corner + b + e - from - bend, bend]
            }
            _ => [self.corner + b + e, -b - e * 2.0, e],
        }
    }

    /// A box around the patch: around its Bezier points.
    pub fn bounds(&self) -> Bounds<3> {
        let ends = (0..3).map(|k| self.edge(k)[0]);
        let middles = (0..3).map(|k| {
            let [from, slope, _] = self.edge(k);
            from + slope * 0.5
        });
        Bounds::of(ends.chain(middles).map(Into::into))
    }

    /// The point of the patch that is closest to `x` \[m\].
    pub fn nearest(&self, x: &Point) -> Foot {
        let free = self.stationary(x);
        let inner = free.filter(|&[u, v]| u >= 0.0 && v >= 0.0 && u + v <= 1.0);
        if let Some([u, v]) = inner {
            let square = (x - self.at(u, v)).norm_squared();
            return Foot { square, region: Region::Inner, free };
        }
        let free = free.filter(|&[u, v]| u >= -EXTENT && v >= -EXTENT && u + v <= 1.0 + EXTENT);
        let mut best = Foot { square: f64::INFINITY, region: Region::Corner(0), free };
        for edge in 0..3 {
            let [from, slope, bend] = self.edge(edge);
            let way = x - from;
            let chord = slope + bend;
            let mut t = (way.dot(&chord) / chord.norm_squared()).clamp(0.0, 1.0);
            for _ in 0..MOST {
                let apart = from + slope * t + bend * (t * t) - x;
                let along = slope + bend * (2.0 * t);
                let full = along.norm_squared() + 2.0 * apart.dot(&bend);
                let stiffness = if full > 0.0 { full } else { along.norm_squared() };
                let next = (t - apart.dot(&along) / stiffness).clamp(0.0, 1.0);
                let done = (next - t).abs() <= END;
                t = next;
                if done {
                    break;
                }
            }
            let square = (from + slope * t + bend * (t * t) - x).norm_squared();
            if square < best.square {
                best.square = square;
                best.region = match t {
                    0.0 => Region::Corner(edge),
                    1.0 => Region::Corner((edge + 1) % 3),
                    t => Region::Edge(edge, t),
                };
            }
        }
        best
    }

    /// Coordinates at which the distance from the extended patch is stationary, if Newton's method
    /// finds them near the patch.
    fn stationary(&self, x: &Point) -> Option<[f64; 2]> {
        let [_, _, c, d, e] = self.coefficients;
        let (mut u, mut v) = (1.0 / 3.0, 1.0 / 3.0);
        for _ in 0..MOST {
            let apart = self.at(u, v) - x;
            let [pu, pv] = self.tangents(u, v);
            let slope = [apart.dot(&pu), apart.dot(&pv)];
            let metric = [pu.norm_squared(), pu.dot(&pv), pv.norm_squared()];
            let bend = [2.0 * apart.dot(&c), apart.dot(&d), 2.0 * apart.dot(&e)];
            let full: [f64; 3] = std::array::from_fn(|k| metric[k] + bend[k]);
            let determinant = |m: &[f64; 3]| m[0] * m[2] - m[1] * m[1];
            // Where the distance is not convex, the metric alone leads downhill.
            let convex = full[0] > 0.0 && determinant(&full) > 0.1 * determinant(&metric);
            let matrix = if convex { full } else { metric };
            let by = 1.0 / determinant(&matrix);
            let du = (matrix[2] * slope[0] - matrix[1] * slope[1]) * by;
            let dv = (matrix[0] * slope[1] - matrix[1] * slope[0]) * by;
            if !(du.is_finite() && dv.is_finite()) {
                return None;
            }
            u -= du;
            v -= dv;
            if u.abs().max(v.abs()) > 4.0 {
                return None;
            }
            if du.abs().max(dv.abs()) <= END {
                return Some([u, v]);
            }
        }
        None
    }

    /// Distance, normal and Hessian at `x` \[m\], which has this closest point.
    pub fn relation(&self, x: &Point, foot: &Foot) -> NearestPoint {
        let smooth = match foot.region {
            Region::Inner => true,
            Region::Edge(edge, _) => self.smooth[edge],
            Region::Corner(corner) => self.smooth_corners[corner],
        };
        match foot.free {
            Some([u, v]) if smooth => self.beside(x, u, v),
            _ => self.beside_edge(x, foot.region),
        }
    }

    /// The relation to the patch: its normal, and its curvature carried along the distance.
    fn beside(&self, x: &Point, u: f64, v: f64) -> NearestPoint {
        let [_, _, c, d, e] = self.coefficients;
        let [pu, pv] = self.tangents(u, v);
        let normal = cross(&pu, &pv).normalize();
        let distance = (x - self.at(u, v)).dot(&normal);
        let metric = nalgebra::Matrix2::new(pu.dot(&pu), pu.dot(&pv), pv.dot(&pu), pv.dot(&pv));
        let mixed = d.dot(&normal);
        let bend = nalgebra::Matrix2::new(2.0 * c.dot(&normal), mixed, mixed, 2.0 * e.dot(&normal));
        let carried = metric - bend * distance;
        let inverses = metric.try_inverse().zip(carried.try_inverse());
        // Beyond the centre of curvature the closest point is elsewhere.
        let inverses = inverses.filter(|_| carried.determinant() > 0.0);
        let hessian = inverses.map_or_else(Tensor::zeros, |(metric, carried)| {
            let part = metric * bend * carried;
            let mixed = 0.5 * (part[(0, 1)] + part[(1, 0)]);
            let both = pu * pv.transpose() + pv * pu.transpose();
            -(pu * pu.transpose() * part[(0, 0)] + both * mixed + pv * pv.transpose() * part[(1, 1)])
        });
        NearestPoint { distance, normal, hessian }
    }

    /// The relation to a point of an edge, or to a corner.
    fn beside_edge(&self, x: &Point, region: Region) -> NearestPoint {
        let (place, along, outward) = match region {
            Region::Edge(edge, t) => {
                let [from, slope, bend] = self.edge(edge);
                let place = from + slope * t + bend * (t * t);
                let tangent = slope + bend * (2.0 * t);
                let size = tangent.norm_squared() - 2.0 * (x - place).dot(&bend);
                (place, Some((tangent, size)), self.edge_normals[edge])
            }
            Region::Corner(corner) => (self.edge(corner)[0], None, self.corner_normals[corner]),
            Region::Inner => (self.at(1.0 / 3.0, 1.0 / 3.0), None, self.edge_normals[0]),
        };
        let way = x - place;
        let away = way.norm();
        if away <= f64::EPSILON * (self.coefficients[0].norm() + place.norm()) {
            let normal = outward.try_normalize(0.0).unwrap_or_else(Vector::<3>::z);
            return NearestPoint { distance: 0.0, normal, hessian: Tensor::zeros() };
        }
        let distance = away.copysign(way.dot(&outward));
        let normal = way / distance;
        let fixed = along.filter(|(_, size)| *size > 0.0);
        let fixed = fixed.map_or_else(Tensor::zeros, |(tangent, size)| tangent * tangent.transpose() / size);
        let hessian = (Tensor::identity() - normal * normal.transpose() - fixed) / distance;
        NearestPoint { distance, normal, hessian }
    }
}

/// The patches of oriented triangles with these neighbours over their edges. Edges whose triangles
/// meet at more than `crease` \[rad\] stay straight and sharp.
pub(super) fn patches(
    points: &[[f64; 3]],
    triangles: &[[u32; 3]],
    neighbours: &[[u32; 3]],
    crease: f64,
) -> Vec<Patch> {
    let at = |k: u32| Point::from(points[k as usize]);
    let flat: Vec<Point> = triangles
        .iter()
        .map(|triangle| {
            let [a, b, c] = triangle.map(at);
            cross(&(b - a), &(c - a)).normalize()
        })
        .collect();
    let limit = crease.cos();
    let is_smooth = |triangle: usize, edge: usize| {
        flat[triangle].dot(&flat[neighbours[triangle][edge] as usize]) >= limit
    };
    // Corners that the surface joins smoothly have one normal.
    let mut groups = DisjointSets::new(3 * triangles.len());
    for (number, triangle) in triangles.iter().enumerate() {
        for edge in (0..3).filter(|&edge| is_smooth(number, edge)) {
            let other = neighbours[number][edge] as usize;
            for corner in [edge, (edge + 1) % 3] {
                if let Some(same) = triangles[other].iter().position(|&k| k == triangle[corner]) {
                    groups.join((3 * number + corner) as u32, (3 * other + same) as u32);
                }
            }
        }
    }
    let mut group = |triangle: usize, corner: usize| groups.find((3 * triangle + corner) as u32) as usize;
    let mut normals = vec![Point::zeros(); 3 * triangles.len()];
    let mut around = vec![Point::zeros(); points.len()];
    let mut sharp = vec![false; points.len()];
    for (number, triangle) in triangles.iter().enumerate() {
        for corner in 0..3 {
            let [here, next, last] = [0, 1, 2].map(|k| at(triangle[(corner + k) % 3]));
            let (one, other) = (next - here, last - here);
            // These weights are exact if the points lie on a sphere (Max 1999).
            let weight = one.norm_squared() * other.norm_squared();
            normals[group(number, corner)] += cross(&one, &other) / weight;
            let vertex = triangle[corner] as usize;
            around[vertex] += flat[number] * one.angle(&other);
            let before = (corner + 2) % 3;
            sharp[vertex] |= !(is_smooth(number, corner) && is_smooth(number, before));
        }
    }
    let mut all = Vec::with_capacity(triangles.len());
    for (number, triangle) in triangles.iter().enumerate() {
        let smooth: [bool; 3] = std::array::from_fn(|edge| is_smooth(number, edge));
        let corners = triangle.map(at);
        let bends = [0, 1, 2].map(|edge| {
            let ends = [edge, (edge + 1) % 3];
            let normals = ends.map(|corner| normals[group(number, corner)].try_normalize(0.0));
            match normals {
                [Some(first), Some(second)] if smooth[edge] => {
                    bend_of(&(corners[ends[1]] - corners[ends[0]]), &first, &second)
                }
                _ => Point::zeros(),
            }
        });
        let [k01, k12, k20] = bends;
        let [x0, x1, x2] = corners;
        all.push(Patch {
            corner: x0,
            coefficients: [x1 - x0 - k01, x2 - x0 - k20, k01, k01 + k20 - k12, k20],
            smooth,
            smooth_corners: triangle.map(|vertex| !sharp[vertex as usize]),
            edge_normals: std::array::from_fn(|edge| flat[number] + flat[neighbours[number][edge] as usize]),
            corner_normals: triangle.map(|vertex| around[vertex as usize]),
        });
    }
    all
}

/// Curvature `k` of the parabola `(way - k) t + k t^2` \[m\]. Its ends are perpendicular to both
/// normals, except for the part of the two conditions that only an edge with an inflection meets.
fn bend_of(way: &Point, first: &Point, second: &Point) -> Point {
    let cosine = first.dot(second);
    if cosine < -0.5 {
        return Point::zeros();
    }
    (first + second) * (0.5 * (first - second).dot(way) / (1.0 + cosine))
}
