//! Pictures of obstacles: facets on their surfaces, for ParaView.
//!
//! Most shapes are drawn from a chain of points in a plane: in 2D the chain itself, in 3D the chain
//! revolved about an axis. Points are on the surface, and facets are below it by at most
//! [`SAGITTA`] of the size of the scene.

use std::f64::consts::PI;

use super::tangents_of;
use crate::tensor::{Vector, cross};

/// Distance of facets from the surface, per size of the scene, chosen by eye. Half of it doubles the
/// number of facets in 3D, and twice the value the gap that is drawn below a tool that touches.
const SAGITTA: f64 = 1e-3;

/// Smallest number of facets around, so that small tools look round.
const FEWEST: f64 = 48.0;

/// Largest number of facets along an arc. Longer arcs are those of profiles far larger than the scene.
const fn most(dimension: usize) -> usize {
    if dimension == 2 { 20_000 } else { 720 }
}

/// Largest number of facets of a picture. A shape with more is not drawn. Each facet takes 81 bytes of
/// each output of fields, which makes 16 MB; half or twice the value changes this in proportion.
const MOST_FACETS: usize = 200_000;

/// Whether so many facets are too many, although some of them may be far from the scene.
pub(super) fn is_too_fine(facets: usize) -> bool {
    facets > 4 * MOST_FACETS
}

/// Distance from the scene up to which shapes without ends are drawn, per size of the scene, chosen by
/// eye.
const BEYOND: f64 = 2.0;

/// Distance from the scene up to which facets are drawn, per size of the scene, so that a huge tool
/// does not hide the bodies, chosen by eye. Tools of up to this diameter are drawn completely.
const WITHIN: f64 = 4.0;

/// The part of space that a picture shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window<const D: usize> {
    /// Middle \[m\].
    pub centre: Vector<D>,
    /// Distance from the middle to the farthest point of the bodies \[m\], > 0.
    pub size: f64,
}

impl<const D: usize> Window<D> {
    /// Distance from the middle up to which shapes without ends are drawn \[m\].
    pub(super) fn reach(&self) -> f64 {
        BEYOND * self.size
    }

    /// Half of the angle around a centre at this distance from the middle within which facets are drawn
    /// \[rad\]; `PI` if all of them are.
    pub(super) fn half_angle(&self, distance: f64) -> f64 {
        let near = WITHIN * self.size;
        // The chord to the farthest facet is shorter than the arc.
        if distance <= near { PI } else { (0.5 * PI * near / distance).min(PI) }
    }

    /// Number of equal parts of an arc of this angle \[rad\] and radius \[m\].
    fn parts(&self, angle: f64, radius: f64) -> usize {
        let step = (8.0 * SAGITTA * self.size / radius).sqrt().min(2.0 * PI / FEWEST);
        // Rounding must not add a part to a full circle.
        ((angle.abs() / step - 1e-9).ceil() as usize).clamp(1, most(D))
    }

    /// Points of an arc in the plane from one angle to another \[rad\], both ends included.
    pub(super) fn arc(
        &self,
        centre: Vector<2>,
        radius: f64,
        [from, to]: [f64; 2],
    ) -> impl Iterator<Item = Vector<2>> {
        let parts = self.parts(to - from, radius);
        (0..=parts).map(move |k| {
            let (sine, cosine) = (from + (to - from) * k as f64 / parts as f64).sin_cos();
            centre + Vector::<2>::new(cosine, sine) * radius
        })
    }

    /// Points of a circle in the plane, anticlockwise.
    pub(super) fn circle(&self, centre: Vector<2>, radius: f64) -> Vec<Vector<2>> {
        let mut points: Vec<_> = self.arc(centre, radius, [0.0, 2.0 * PI]).collect();
        points.pop();
        points
    }
}

/// Facets on a surface: lines in 2D, triangles and quadrilaterals in 3D.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Drawing<const D: usize> {
    /// Points of the surface \[m\].
    pub points: Vec<Vector<D>>,
    /// Points of all facets, one facet after the other.
    pub nodes: Vec<u32>,
    /// Number of points of each facet.
    pub sizes: Vec<u8>,
}

impl<const D: usize> Drawing<D> {
    /// Adds a point and returns its index.
    pub(super) fn point(&mut self, x: Vector<D>) -> u32 {
        self.points.push(x);
        self.points.len() as u32 - 1
    }

    /// Adds a facet, unless too few of its points differ.
    pub(super) fn facet(&mut self, nodes: &[u32]) {
        let first = self.nodes.len();
        for &node in nodes {
            if !self.nodes[first..].contains(&node) {
                self.nodes.push(node);
            }
        }
        let size = self.nodes.len() - first;
        if size < D {
            self.nodes.truncate(first);
        } else {
            self.sizes.push(size as u8);
        }
    }

    /// The facets.
    pub fn facets(&self) -> impl Iterator<Item = &[u32]> {
        let mut rest = &self.nodes[..];
        self.sizes.iter().map(move |&size| {
            let (facet, others) = rest.split_at(usize::from(size));
            rest = others;
            facet
        })
    }

    /// A chain of lines through points of the plane.
    pub(super) fn chain(points: impl IntoIterator<Item = Vector<2>>, closed: bool) -> Self {
        Self::chain_about(points, closed, &Vector::zeros(), &in_direction(1))
    }

    /// A chain of lines in the plane. Its points have the distance to the right of an axis and the
    /// position along it from `origin` \[m\].
    pub(super) fn chain_about(
        points: impl IntoIterator<Item = Vector<2>>,
        closed: bool,
        origin: &Vector<D>,
        axis: &Vector<D>,
    ) -> Self {
        let right = Vector::from_fn(|i, _| [axis[1], -axis[0], 0.0][i]);
        let mut drawing = Self::default();
        for x in points {
            let node = drawing.point(origin + right * x[0] + axis * x[1]);
            if node > 0 {
                drawing.facet(&[node - 1, node]);
            }
        }
        if closed && drawing.points.len() > 2 {
            drawing.facet(&[drawing.points.len() as u32 - 1, 0]);
        }
        drawing
    }

    /// A chain that is revolved about an axis. Its points have the distance from the axis, at least
    /// zero, and the position along it from `origin` \[m\].
    pub(super) fn revolved(
        chain: &[Vector<2>],
        closed: bool,
        origin: &Vector<D>,
        axis: &Vector<D>,
        window: &Window<D>,
    ) -> Self {
        let widest = chain.iter().map(|point| point[0]).fold(0.0, f64::max);
        let offset = window.centre - origin;
        let across = offset - axis * axis.dot(&offset);
        // Of a huge solid only the sector on the side of the bodies is drawn.
        let half = window.half_angle(across.norm());
        let is_round = half >= PI;
        let parts = window.parts(2.0 * half, widest);
        let around = if is_round { parts } else { parts + 1 };
        let mut drawing = Self::default();
        if is_too_fine(chain.len() * around) {
            return drawing;
        }
        let first = if is_round { tangents_of(axis)[0] } else { across.normalize() };
        let second = cross(axis, &first);
        let rings: Vec<Vec<u32>> = chain
            .iter()
            .map(|point| {
                let middle = origin + axis * point[1];
                if point[0] <= 1e-12 * widest {
                    return vec![drawing.point(middle); around];
                }
                let at = |k: usize| {
                    let (sine, cosine) = (half * (2.0 * k as f64 / parts as f64 - 1.0)).sin_cos();
                    middle + (first * cosine + second * sine) * point[0]
                };
                (0..around).map(|k| drawing.point(at(k))).collect()
            })
            .collect();
        let joins = if is_round { around } else { parts };
        let joined = if closed { rings.len() } else { rings.len().saturating_sub(1) };
        for ring in 0..joined {
            let (low, high) = (&rings[ring], &rings[(ring + 1) % rings.len()]);
            for k in 0..joins {
                let next = (k + 1) % around;
                drawing.facet(&[low[k], low[next], high[next], high[k]]);
            }
        }
        drawing
    }

    /// The facets that reach into the neighbourhood of the middle of the window; none if there are
    /// [too many](MOST_FACETS).
    pub(super) fn clipped(self, window: &Window<D>) -> Self {
        let at = |node: u32| self.points[node as usize];
        let is_near = |facet: &[u32]| {
            let middle = facet.iter().map(|&node| at(node)).sum::<Vector<D>>() / facet.len() as f64;
            let radius = facet.iter().map(|&node| (at(node) - middle).norm()).fold(0.0, f64::max);
            (middle - window.centre).norm() - radius <= WITHIN * window.size
        };
        let mut kept = Self::default();
        let mut places = vec![None; self.points.len()];
        for facet in self.facets().filter(|facet| is_near(facet)) {
            for &node in facet {
                let place = *places[node as usize].get_or_insert_with(|| kept.point(at(node)));
                kept.nodes.push(place);
            }
            kept.sizes.push(facet.len() as u8);
        }
        if kept.sizes.len() > MOST_FACETS { Self::default() } else { kept }
    }
}

/// The unit vector along a coordinate axis.
pub(super) fn in_direction<const D: usize>(axis: usize) -> Vector<D> {
    Vector::from_fn(|i, _| f64::from(u8::from(i == axis)))
}

/// The curve at this distance to the right of a closed chain in the plane \[m\]: lines, and arcs about
/// the corners where the chain turns to the left. It may cross itself where the chain has notches.
pub(super) fn beside<const D: usize>(
    chain: &[Vector<2>],
    distance: f64,
    window: &Window<D>,
) -> Vec<Vector<2>> {
    /// Parts of each line, so that a part of it may be left out. A chain of many lines has short ones.
    const PARTS: usize = 16;
    /// Parts of all lines.
    const ALL_PARTS: usize = 4096;
    let count = chain.len();
    let parts = (ALL_PARTS / count.max(1)).clamp(1, PARTS);
    let along = |k: usize| (chain[(k + 1) % count] - chain[k % count]).normalize();
    let right = |k: usize| Vector::<2>::new(along(k)[1], -along(k)[0]);
    let mut curve = Vec::new();
    for k in 0..count {
        let (before, after) = (right(k + count - 1), right(k));
        let sine = before[0] * after[1] - before[1] * after[0];
        let cosine = before.dot(&after);
        // A chain that turns back turns to the left.
        let turn = if cosine <= -1.0 + 1e-12 { PI } else { sine.atan2(cosine) };
        let corner = chain[k];
        if turn > 0.0 {
            let from = before[1].atan2(before[0]);
            curve.extend(window.arc(corner, distance, [from, from + turn]));
        } else {
            curve.push(corner + (before + after) * (distance / (1.0 + cosine)));
        }
        let end = chain[(k + 1) % count];
        let inner = (0..=parts).map(|part| part as f64 / parts as f64);
        curve.extend(inner.map(|t| corner + (end - corner) * t + after * distance));
    }
    curve
}

/// The plane, or in 2D the line, through `point` \[m\] with a normal.
pub(super) fn flat<const D: usize>(point: Vector<D>, normal: &Vector<D>, window: &Window<D>) -> Drawing<D> {
    let mut drawing = Drawing::default();
    let [first, second] = tangents_of(normal).map(|way| way * window.reach());
    let corners = if D == 2 {
        vec![point - first, point + first]
    } else {
        vec![point - first - second, point + first - second, point + first + second, point - first + second]
    };
    let nodes: Vec<u32> = corners.into_iter().map(|corner| drawing.point(corner)).collect();
    drawing.facet(&nodes);
    drawing
}

/// A box with rounded edges, given the half edge lengths of its core and the radius \[m\], in its
/// own axes.
pub(super) fn round_cuboid<const D: usize>(half: &Vector<D>, radius: f64, window: &Window<D>) -> Drawing<D> {
    if D == 2 {
        let corners = [[1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]].into_iter().enumerate();
        let chain = corners.flat_map(|(k, signs)| {
            let corner = Vector::<2>::from_fn(|i, _| signs[i] * half[i]);
            let from = (k as f64 - 1.0) * 0.5 * PI;
            window.arc(corner, radius, [from, from + 0.5 * PI])
        });
        return Drawing::chain(chain.collect::<Vec<_>>(), true);
    }
    let parts = window.parts(0.5 * PI, radius);
    let mut drawing = Drawing::default();
    // A sphere whose octants are moved apart: rows from the bottom to the top, each around the axis.
    // Angles between two octants occur twice, once in each of them.
    let angles = |quarters: usize, start: f64| -> Vec<(f64, usize)> {
        let of = |quarter: usize| {
            (0..=parts).map(move |k| (start + (quarter as f64 + k as f64 / parts as f64) * 0.5 * PI, quarter))
        };
        (0..quarters).flat_map(of).collect()
    };
    let columns = angles(4, 0.0);
    let rows: Vec<Vec<u32>> = angles(2, -0.5 * PI)
        .into_iter()
        .map(|(height, upper)| {
            let is_pole = height.cos() < 1e-12;
            let mut row = Vec::with_capacity(columns.len());
            for (k, &(angle, quarter)) in columns.iter().enumerate() {
                if is_pole && k % (parts + 1) > 0 {
                    row.push(row[k - 1]);
                    continue;
                }
                let signs = [
                    if quarter == 0 || quarter == 3 { 1.0 } else { -1.0 },
                    if quarter < 2 { 1.0 } else { -1.0 },
                    if upper == 1 { 1.0 } else { -1.0 },
                ];
                let flat = if is_pole { 0.0 } else { height.cos() };
                let normal = [angle.cos() * flat, angle.sin() * flat, height.sin()];
                let at = |i: usize| signs[i] * half[i] + radius * normal[i];
                row.push(drawing.point(Vector::from_fn(|i, _| if i < 3 { at(i) } else { 0.0 })));
            }
            row
        })
        .collect();
    let quarters = |row: &[u32]| [0, 1, 2, 3].map(|quarter| row[quarter * (parts + 1)]);
    if let (Some(bottom), Some(top)) = (rows.first(), rows.last()) {
        let [a, b, c, d] = quarters(bottom);
        drawing.facet(&[d, c, b, a]);
        drawing.facet(&quarters(top));
    }
    for pair in rows.windows(2) {
        let [low, high] = pair else { continue };
        for k in 0..low.len() {
            let next = (k + 1) % low.len();
            drawing.facet(&[low[k], low[next], high[next], high[k]]);
        }
    }
    drawing
}

/// Volume within closed facets that are oriented outward \[m3\], in 2D the area \[m2\].
#[cfg(test)]
pub(super) fn volume<const D: usize>(drawing: &Drawing<D>) -> f64 {
    let at = |node: u32| drawing.points[node as usize];
    let of_facet = |facet: &[u32]| -> f64 {
        if D == 2 {
            let [from, to] = [at(facet[0]), at(facet[1])];
            return 0.5 * (from[0] * to[1] - from[1] * to[0]);
        }
        let first = at(facet[0]);
        facet[1..].windows(2).map(|pair| first.dot(&cross(&at(pair[0]), &at(pair[1]))) / 6.0).sum()
    };
    drawing.facets().map(of_facet).sum()
}

#[cfg(test)]
mod tests {
    use super::super::{Cylinder, Shape, Side, Sphere, sample_shapes};
    use super::*;

    const WINDOWS: [f64; 2] = [0.02, 3.0];

    /// Corners of facets are on the surface, and the middle of a facet is close to it.
    #[test]
    fn facets_are_on_the_surface() {
        fn check<const D: usize>() {
            for shape in sample_shapes::<D>() {
                for size in WINDOWS {
                    let window = Window { centre: Vector::<D>::repeat(0.1), size };
                    let drawing = shape.drawing(&window);
                    // Near a rounded edge of a surface from a file, a small window may show nothing.
                    assert!(size < 1.0 || !drawing.sizes.is_empty(), "{shape:?}");
                    for facet in drawing.facets() {
                        let corners: Vec<_> =
                            facet.iter().map(|&node| drawing.points[node as usize]).collect();
                        let worst = corners.iter().map(|x| shape.gap(x).abs()).fold(0.0, f64::max);
                        assert!(worst < 1e-6, "{shape:?}: {worst:e}");
                        let middle = corners.iter().sum::<Vector<D>>() / corners.len() as f64;
                        let bound = (3.0 * SAGITTA * size).max(0.01);
                        assert!(shape.gap(&middle).abs() < bound, "{shape:?} at {middle}");
                    }
                }
            }
        }
        check::<2>();
        check::<3>();
    }

    /// The facets of a solid enclose its volume.
    #[test]
    fn facets_enclose_the_volume() {
        fn check<const D: usize>() -> usize {
            let window = Window { centre: Vector::<D>::zeros(), size: 3.0 };
            let solids = sample_shapes::<D>().into_iter().filter_map(|shape| Some((shape.solid()?, shape)));
            solids
                .map(|(solid, shape)| {
                    let found = volume(&shape.facets(&window));
                    assert!((found / solid.volume - 1.0).abs() < 0.02, "{shape:?}: {found} {}", solid.volume);
                })
                .count()
        }
        assert!(check::<2>() >= 4 && check::<3>() >= 4);
    }

    /// A huge tool is drawn near the bodies only, in facets that are small compared with them.
    #[test]
    fn a_huge_tool_is_drawn_near_the_bodies() {
        let window = Window { centre: Vector::<2>::zeros(), size: 1.0 };
        let disc = Sphere::new(Vector::<2>::new(0.0, 300.0), 300.0, Side::Outside);
        let drawing = disc.drawing(&window);
        let farthest = drawing.facets().flatten().map(|&node| drawing.points[node as usize].norm());
        assert!((2..40).contains(&drawing.sizes.len()) && farthest.fold(0.0, f64::max) < 8.0);
        for radius in [300.0, 1e4, 1e6] {
            let window = Window { centre: Vector::<3>::zeros(), size: 1.0 };
            let centre = Vector::<3>::new(0.6, 0.0, 0.8) * (radius + 0.5);
            let axis = Vector::<3>::new(0.0, 1.0, 0.0);
            let sphere = Sphere::new(centre, radius, Side::Outside);
            let cylinder = Cylinder::new(centre, axis, radius, Side::Outside);
            let shapes: [&dyn Shape<3>; 2] = [&sphere, &cylinder];
            for shape in shapes {
                let drawing = shape.drawing(&window);
                assert!(!drawing.sizes.is_empty(), "{shape:?}");
                for facet in drawing.facets() {
                    let corners = facet.iter().map(|&node| drawing.points[node as usize]);
                    let middle = corners.sum::<Vector<3>>() / facet.len() as f64;
                    let gap = shape.gap(&middle);
                    assert!(gap.abs() < 3.0 * SAGITTA, "{shape:?} at {middle}: {gap:e}");
                    assert!(middle.norm() < 12.0);
                }
            }
        }
    }

    /// A profile of very many points is not drawn, and the limit is beyond any usual tool.
    #[test]
    fn too_many_facets_are_not_drawn() {
        let window = Window { centre: Vector::<3>::zeros(), size: 1.0 };
        let turned = |points: u32| {
            let chain: Vec<_> =
                (0..points).map(|k| Vector::<2>::new(1.0, f64::from(k) / f64::from(points))).collect();
            Drawing::revolved(&chain, false, &Vector::zeros(), &in_direction(2), &window).clipped(&window)
        };
        assert!(turned(20_000).sizes.is_empty() && turned(5_000).sizes.is_empty());
        assert!(turned(2_000).sizes.len() > 90_000);
    }
}
