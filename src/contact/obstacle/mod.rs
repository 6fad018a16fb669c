//! Rigid obstacles as signed distances, in 2D and 3D. Each obstacle has its own file and one line
//! in the table below.
//!
//! The gradient of a signed distance `g(x)` is the normal, and its Hessian the curvature. The
//! tangent therefore contains the complete geometry.

mod chain;
mod check;
mod drawing;
mod piece;
mod shape;
mod side;
mod solid;
mod triangles;

pub use capsule::Capsule;
pub use cone::Cone;
pub use cuboid::Cuboid;
pub use cylinder::Cylinder;
pub use drawing::{Drawing, Window};
pub use plane::Plane;
pub use polyline::Polyline;
pub use shape::{Core, Outline, Proximity, Shape, is_flat_along};
pub use side::Side;
pub use solid::SolidMoments;
pub use sphere::Sphere;
pub use surface::Surface;
pub use torus::Torus;
pub use turned::Turned;

use std::rc::Rc;

use crate::reader::findings::Findings;
use crate::reader::laws::family;
use crate::reader::quantity::Quantity;
use crate::tensor::{Tensor, Vector, cross};

/// Defines the enum of the obstacles, its table, and the dispatch to checks and shapes.
macro_rules! obstacles {
    ($($name:literal: $file:ident::$obstacle:ident),+ $(,)?) => {
        family! {
            /// The shape of a rigid body that others touch.
            Obstacle ("obstacle", schema "Obstacle", table OBSTACLES):
            $($name: $file::$obstacle),+
        }

        impl Obstacle {
            /// Reports invalid parameters in a case of this dimension.
            pub fn check(&self, dimension: usize, findings: &mut Findings) {
                match self {
                    $(Self::$obstacle(obstacle) => obstacle.check(dimension, findings),)+
                }
            }

            /// Whether its surface is a plane.
            pub fn is_plane(&self) -> bool {
                self.shape::<3>().is_plane()
            }

            /// The point about which it rotates unless the case names another one \[m\].
            pub fn centre<const D: usize>(&self) -> Vector<D> {
                match self {
                    $(Self::$obstacle(obstacle) => obstacle.centre(),)+
                }
            }

            /// Its shape.
            pub fn shape<const D: usize>(&self) -> Rc<dyn Shape<D>> {
                match self {
                    $(Self::$obstacle(obstacle) => Rc::new(obstacle.shape::<D>()),)+
                }
            }
        }
    };
}
obstacles! {
    "plane": plane::PlaneObstacle,
    "sphere": sphere::SphereObstacle,
    "cylinder": cylinder::CylinderObstacle,
    "box": cuboid::BoxObstacle,
    "capsule": capsule::CapsuleObstacle,
    "cone": cone::ConeObstacle,
    "torus": torus::TorusObstacle,
    "polyline": polyline::PolylineObstacle,
    "turned": turned::TurnedObstacle,
    "surface": surface::SurfaceObstacle,
}

impl Obstacle {
    /// The surface that is read from a file; `None` for a shape that the case describes.
    pub fn surface(&self) -> Option<&SurfaceObstacle> {
        match self {
            Self::SurfaceObstacle(surface) => Some(surface),
            _ => None,
        }
    }
}

/// Why a shape has no mass from a density.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoSolid {
    /// The shape is infinite, hollow or open.
    Unbounded,
    /// The surface is at a distance from the triangles of a file.
    Offset,
    /// The radius of a closed polyline or of a turned solid fills a notch.
    Overlap,
}

impl Obstacle {
    /// Why the shape has no mass from a density in this dimension; `None` if it has. The answer does not need
    /// the file of a surface.
    pub fn no_solid(&self, dimension: usize) -> Option<NoSolid> {
        if let Self::SurfaceObstacle(surface) = self {
            return surface.no_solid();
        }
        let solid = match dimension {
            2 => self.shape::<2>().solid().is_some(),
            _ => self.shape::<3>().solid().is_some(),
        };
        match self {
            _ if solid => None,
            Self::PolylineObstacle(line) if line.is_solid() => Some(NoSolid::Overlap),
            Self::TurnedObstacle(turned) if turned.is_solid() => Some(NoSolid::Overlap),
            _ => Some(NoSolid::Unbounded),
        }
    }
}

/// Entries as numbers; missing entries are 0.
fn numbers<const D: usize, const KG: i8, const M: i8, const S: i8>(
    values: &[Quantity<KG, M, S>],
) -> Vector<D> {
    Vector::from_fn(|i, _| values.get(i).map_or(0.0, |value| value.value))
}

/// Unit vectors that span the tangent plane of the unit vector `normal`; in 2D the second is zero.
fn tangents_of<const D: usize>(normal: &Vector<D>) -> [Vector<D>; 2] {
    let axis = normal.iter().enumerate().min_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).map_or(0, |(i, _)| i);
    let mut across = Vector::<D>::zeros();
    across[axis] = 1.0;
    let first = (across - normal * normal[axis]).try_normalize(0.0).unwrap_or_else(Vector::zeros);
    [first, if D == 3 { cross(normal, &first) } else { Vector::zeros() }]
}

/// Rotation by an angle \[rad\] about an axis; in 2D about z.
fn rotation_about<const D: usize>(axis: &Vector<3>, angle: f64) -> Tensor<D> {
    let (sine, cosine) = angle.sin_cos();
    let axis = if D == 2 { Vector::<3>::z() } else { axis.normalize() };
    Tensor::from_fn(|i, j| {
        let same = f64::from(u8::from(i == j));
        // Component of the cross product with the axis.
        let across = match (3 + j - i) % 3 {
            1 => -axis[3 - i - j],
            2 => axis[3 - i - j],
            _ => 0.0,
        };
        cosine * same + sine * across + (1.0 - cosine) * axis[i] * axis[j]
    })
}

/// Whether an obstacle has this dimension.
#[cfg(test)]
fn fits(obstacle: &Obstacle, dimension: usize) -> bool {
    let mut findings = Findings::new(crate::reader::units::Units::SI);
    obstacle.check(dimension, &mut findings);
    findings.is_empty()
}

/// The shapes of all sample obstacles of this dimension.
#[cfg(test)]
pub(super) fn sample_shapes<const D: usize>() -> Vec<Rc<dyn Shape<D>>> {
    let all = OBSTACLES.iter().flat_map(|entry| (entry.samples)()).filter(|obstacle| fits(obstacle, D));
    all.map(|obstacle| obstacle.shape()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reader::quantity::Number;
    use crate::reader::units::Units;
    use crate::taylor::taylor_rate;

    fn taylor<const D: usize>(obstacle: &dyn Shape<D>) {
        let x = Vector::<D>::from_fn(|i, _| 0.45 + 0.21 * i as f64);
        let d = Vector::<D>::from_fn(|i, _| 0.05 - 0.08 * i as f64);
        let at = |x: &[f64]| obstacle.proximity(&Vector::from_column_slice(x));
        let here = at(x.as_slice());
        let gap = |x: &[f64]| vec![at(x).gap];
        let by_gap = |_: &[f64], d: &[f64]| vec![here.normal.dot(&Vector::from_column_slice(d))];
        assert!(taylor_rate(gap, by_gap, x.as_slice(), d.as_slice()) > 1.9, "{obstacle:?}");
        let normal = |x: &[f64]| at(x).normal.as_slice().to_vec();
        let by_normal =
            |_: &[f64], d: &[f64]| (here.hessian * Vector::<D>::from_column_slice(d)).as_slice().to_vec();
        assert!(taylor_rate(normal, by_normal, x.as_slice(), d.as_slice()) > 1.9, "{obstacle:?}");
        assert!((here.normal.norm() - 1.0).abs() < 1e-14);
        assert!((here.hessian * here.normal).norm() < 1e-14);
        assert!((here.gap - obstacle.gap(&x)).abs() < 1e-15);
    }

    /// In 2D and 3D, the normal of every obstacle is the gradient of the gap, and the Hessian is
    /// that of the normal.
    #[test]
    fn derivatives_have_taylor_order_two() {
        // A polyline is in the plane only.
        assert!(sample_shapes::<2>().len() >= 4 && sample_shapes::<3>().len() >= 2 * (OBSTACLES.len() - 1));
        for shape in sample_shapes::<2>() {
            taylor(&*shape);
            taylor(&*shape.anchored(&Vector::<2>::new(0.4, 0.6)));
        }
        for shape in sample_shapes::<3>() {
            taylor(&*shape);
            taylor(&*shape.anchored(&Vector::<3>::new(0.4, 0.6, 0.8)));
        }
    }

    /// Gaps are distances, positive on the free side.
    #[test]
    fn gaps_are_signed_distances() {
        let floor = Plane::new(Vector::<2>::zeros(), Vector::<2>::new(0.0, 2.0));
        assert_eq!(floor.gap(&Vector::<2>::new(7.0, 0.25)), 0.25);
        let disc = |side| Sphere::new(Vector::<2>::zeros(), 2.0, side);
        let point = Vector::<2>::new(0.0, 3.0);
        assert_eq!(disc(Side::Outside).gap(&point), 1.0);
        assert_eq!(disc(Side::Inside).gap(&point), -1.0);
        assert_eq!(disc(Side::Inside).proximity(&point).normal, Vector::<2>::new(0.0, -1.0));
        let rod = Cylinder::new(Vector::<3>::zeros(), Vector::<3>::new(0.0, 0.0, 9.0), 1.0, Side::Outside);
        assert!((rod.gap(&Vector::<3>::new(3.0, 4.0, 100.0)) - 4.0).abs() < 1e-15);
    }

    /// Gap and normal lead to the surface: one gap back along the normal, the gap is zero and the
    /// normal is the same. No gap changes by more than the position.
    #[test]
    fn gap_and_normal_lead_to_the_surface() {
        fn shapes<const D: usize>() {
            for shape in sample_shapes::<D>() {
                let mut checked = 0;
                let points = crate::taylor::scatter(D * 400, 17);
                let points = points.chunks_exact(D).map(|x| Vector::<D>::from_column_slice(x) * 1.5);
                let mut before = Vector::<D>::zeros();
                for x in points {
                    let here = shape.proximity(&x);
                    assert!((here.gap - shape.gap(&before)).abs() <= (x - before).norm() * (1.0 + 1e-12));
                    before = x;
                    if here.gap <= 0.0 {
                        continue;
                    }
                    let foot = shape.proximity(&(x - here.normal * here.gap));
                    assert!(foot.gap.abs() < 1e-12, "{shape:?} at {x}: {}", foot.gap);
                    assert!((foot.normal - here.normal).norm() < 1e-9, "{shape:?} at {x}");
                    checked += 1;
                }
                assert!(checked > 10, "{shape:?}: {checked}");
            }
        }
        shapes::<2>();
        shapes::<3>();
    }

    /// Distances of points beside faces, edges, corners, ends and tips that are known from a
    /// sketch.
    #[test]
    fn distances_of_shapes_with_edges_are_known() {
        let near = |gap: f64, known: f64| assert!((gap - known).abs() < 1e-14, "{gap} {known}");
        let size = Vector::<3>::new(2.0, 4.0, 6.0);
        let turn = rotation_about(&Vector::<3>::z(), std::f64::consts::FRAC_PI_2);
        for (turn, faces) in [(Tensor::identity(), [1.0, 2.0, 3.0]), (turn, [2.0, 1.0, 3.0])] {
            let cuboid = Cuboid::new(Vector::<3>::zeros(), size, 0.5, turn, Side::Outside);
            for axis in 0..3 {
                let mut x = Vector::<3>::zeros();
                x[axis] = -faces[axis] - 0.25;
                near(cuboid.gap(&x), 0.25);
                assert!((cuboid.proximity(&x).normal[axis] + 1.0).abs() < 1e-14);
            }
            let corner = Vector::<3>::from(faces) - Vector::<3>::repeat(0.5);
            near(cuboid.gap(&(corner + Vector::<3>::repeat(1.0))), 3.0_f64.sqrt() - 0.5);
            near(cuboid.gap(&(corner + Vector::<3>::new(1.0, 1.0, -1.0))), 2.0_f64.sqrt() - 0.5);
            near(cuboid.gap(&Vector::zeros()), -1.0);
        }
        let stadium = CapsuleObstacle::of(&[-1.0, 0.0], &[1.0, 0.0], 0.5, Side::Outside).shape::<2>();
        near(stadium.gap(&Vector::<2>::new(0.3, 2.0)), 1.5);
        near(stadium.gap(&Vector::<2>::new(4.0, 4.0)), 4.5);
        let up = [0.0, 0.0, 1.0];
        let ring = TorusObstacle::of([0.0; 3], up, [2.0, 0.5], Side::Outside).shape::<3>();
        near(ring.gap(&Vector::<3>::new(0.0, 5.0, 4.0)), 4.5);
        near(ring.gap(&Vector::zeros()), 1.5);
        let angle = std::f64::consts::FRAC_PI_6;
        let cone = ConeObstacle::of(&[0.0, 0.0, -0.5], &up, angle, 0.5, Side::Outside).shape::<3>();
        near(cone.gap(&Vector::<3>::new(0.0, 0.0, -2.0)), 1.5);
        // From the tip of the sharp cone along its surface, then along its normal.
        let (along, normal) =
            (Vector::<3>::new(0.5, 0.0, angle.cos()), Vector::<3>::new(angle.cos(), 0.0, -0.5));
        near(cone.gap(&(along * 3.0 + normal * 2.0)), 1.5);
        let wedge = ConeObstacle::of(&[0.0, 0.0], &[0.0, 1.0], angle, 0.1, Side::Outside).shape::<2>();
        near(wedge.gap(&Vector::<2>::new(-angle.cos() * 2.0, 0.1 - 1.0)), 1.9);
        // A pin with a head, about the x axis.
        let profile = [[0.0, 0.0], [0.5, 0.0], [0.5, 1.0], [0.2, 1.0], [0.2, 3.0], [0.0, 3.0]];
        let pin = TurnedObstacle::of([1.0, 0.0, 0.0], [2.0, 0.0, 0.0], &profile, 0.1, Side::Outside);
        let pin = pin.shape::<3>();
        let gap = |height: f64, y: f64, z: f64| pin.gap(&Vector::<3>::new(1.0 + height, y, z));
        near(gap(4.0, 0.0, 0.0), 0.9);
        near(gap(-2.0, 0.1, -0.2), 1.9);
        near(gap(0.5, 0.6, 0.8), 0.4);
        near(gap(-0.4, 0.48, 0.64), 0.4);
        near(gap(3.3, 0.0, -0.6), 0.4);
        // Beside the shaft, near the head: the shaft is nearer, then the head.
        near(gap(1.2, 0.35, 0.0), 0.05);
        near(gap(1.15, 0.0, 0.45), 0.05);
        // Within the head and the shaft.
        near(gap(0.3, 0.0, 0.0), -0.4);
        near(gap(2.0, 0.05, 0.0), -0.25);
    }

    /// On axes, centres and in corners normals are unit vectors, and nothing is NaN.
    #[test]
    fn finite_where_all_directions_are_near() {
        fn shapes<const D: usize>(points: &[Vector<D>]) {
            let obstacles = OBSTACLES.iter().flat_map(|entry| (entry.samples)());
            for obstacle in obstacles.filter(|obstacle| fits(obstacle, D)) {
                let shape = obstacle.shape::<D>();
                for x in points.iter().copied().chain([obstacle.centre()]) {
                    let at = shape.proximity(&x);
                    let finite = at.gap.is_finite() && at.hessian.iter().all(|c| c.is_finite());
                    assert!(finite && (at.normal.norm() - 1.0).abs() < 1e-14, "{shape:?} at {x}: {at:?}");
                }
            }
        }
        shapes::<2>(&[Vector::<2>::zeros(), Vector::<2>::new(0.1, 0.1)]);
        shapes::<3>(&[Vector::<3>::zeros(), Vector::<3>::repeat(0.1)]);
    }

    /// A point on the centre or the axis has a unit normal across the axis and no NaN.
    #[test]
    fn finite_on_centre_and_axis() {
        for side in [Side::Outside, Side::Inside] {
            let centre = Vector::<3>::new(1.0, 2.0, 3.0);
            let axis = Vector::<3>::new(0.0, 0.0, 1.0);
            let sphere = Sphere::new(centre, 0.5, side);
            let rod = Cylinder::new(centre, axis, 0.5, side);
            let disc = Sphere::new(Vector::<2>::zeros(), 1e-3, side).proximity(&Vector::zeros());
            let both: [(&dyn Shape<3>, f64); 2] = [(&sphere, 0.0), (&rod, 5.0)];
            for offset in [0.0, 1e-300, 1e-15] {
                for (obstacle, along) in both {
                    let p = obstacle.proximity(&(centre + Vector::<3>::new(offset, 0.0, along)));
                    assert!((p.normal.norm() - 1.0).abs() < 1e-14 && p.hessian.iter().all(|c| c.is_finite()));
                    assert!(along == 0.0 || p.normal.dot(&axis).abs() < 1e-14);
                    assert!((p.gap.abs() - 0.5).abs() < 1e-12);
                }
            }
            assert!((disc.normal.norm() - 1.0).abs() < 1e-14);
        }
    }

    /// Invalid obstacles are rejected: zero normal or axis, nonpositive radius, wrong number of
    /// coordinates, a cylinder in 2D.
    #[test]
    fn refuses_degenerate_obstacles() {
        let refused = |obstacle: Obstacle, dimension: usize| {
            let mut findings = Findings::new(Units::SI);
            obstacle.check(dimension, &mut findings);
            !findings.is_empty()
        };
        let up = [0.0, 0.0, 1.0];
        assert!(!refused(PlaneObstacle::of(&[0.0; 3], &up).into(), 3));
        assert!(refused(PlaneObstacle::of(&[0.0; 3], &[0.0; 3]).into(), 3));
        assert!(refused(PlaneObstacle::of(&[0.0; 3], &[f64::NAN, 0.0, 1.0]).into(), 3));
        assert!(refused(PlaneObstacle::of(&[0.0; 2], &up).into(), 3));
        for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(refused(SphereObstacle::of(&[0.0; 3], radius, Side::Outside).into(), 3));
            assert!(refused(CylinderObstacle::of([0.0; 3], up, radius, Side::Outside).into(), 3));
        }
        assert!(refused(CylinderObstacle::of([0.0; 3], [0.0; 3], 1.0, Side::Outside).into(), 3));
        assert!(refused(CylinderObstacle::of([0.0; 3], up, 1.0, Side::Outside).into(), 2));
        let cuboid =
            |size: f64, radius: f64| BoxObstacle::of(&[0.0; 3], &[1.0, 2.0, size], radius, Side::Outside);
        assert!(!refused(cuboid(1.0, 0.5).into(), 3) && refused(cuboid(1.0, 0.5).into(), 2));
        assert!(refused(cuboid(1.0, 0.6).into(), 3) && refused(cuboid(0.0, 0.1).into(), 3));
        assert!(refused(cuboid(1.0, 0.0).into(), 3) && refused(cuboid(f64::NAN, 0.1).into(), 3));
        let turned = |angle: Option<f64>, axis: Option<[f64; 3]>| {
            let axis = axis.map(|axis| axis.map(Number::new).to_vec().into());
            Obstacle::from(BoxObstacle { angle: angle.map(Number::new), axis, ..cuboid(1.0, 0.1) })
        };
        assert!(!refused(turned(Some(1.0), Some(up)), 3) && refused(turned(Some(1.0), None), 3));
        assert!(refused(turned(None, Some(up)), 3) && refused(turned(Some(1.0), Some([0.0; 3])), 3));
        let capsule =
            |x: f64, radius: f64| CapsuleObstacle::of(&[0.0; 3], &[x, 0.0, 0.0], radius, Side::Outside);
        assert!(!refused(capsule(1.0, 0.5).into(), 3));
        assert!(refused(capsule(0.0, 0.5).into(), 3) && refused(capsule(1.0, 0.0).into(), 3));
        let torus = |radii: [f64; 2]| TorusObstacle::of([0.0; 3], up, radii, Side::Outside);
        assert!(!refused(torus([1.0, 0.5]).into(), 3) && refused(torus([1.0, 0.5]).into(), 2));
        assert!(refused(torus([1.0, 1.0]).into(), 3) && refused(torus([1.0, 0.0]).into(), 3));
        let cone = |angle: f64, radius: f64| ConeObstacle::of(&[0.0; 3], &up, angle, radius, Side::Outside);
        assert!(!refused(cone(1.0, 0.1).into(), 3));
        for (angle, radius) in [(0.0, 0.1), (1.6, 0.1), (f64::NAN, 0.1), (1.0, 0.0)] {
            assert!(refused(cone(angle, radius).into(), 3));
        }
        let part = |profile: &[[f64; 2]], radius: f64| {
            TurnedObstacle::of([0.0; 3], up, profile, radius, Side::Outside)
        };
        let pin = [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [0.0, 2.0]];
        let ring = [[1.0, 0.0], [2.0, 0.0], [1.5, 1.0]];
        assert!(!refused(part(&pin, 1.5).into(), 3) && refused(part(&pin, 1.5).into(), 2));
        assert!(!refused(part(&ring, 0.9).into(), 3) && refused(part(&ring, 1.0).into(), 3));
        assert!(refused(part(&pin, 0.0).into(), 3) && refused(part(&pin, f64::NAN).into(), 3));
        assert!(refused(part(&pin[1..3], 0.1).into(), 3) && refused(part(&pin[..3], 0.1).into(), 3));
        let aside = TurnedObstacle::of([0.0; 3], [0.0; 3], &pin, 0.1, Side::Outside);
        assert!(refused(aside.into(), 3));
    }

    /// Near the anchor, gaps have full precision for shapes with a large radius or given by a far
    /// point.
    #[test]
    fn gaps_near_the_anchor_lose_no_digits() {
        let near = Vector::<2>::new(0.2, 0.0);
        let disc = Sphere::new(Vector::<2>::new(0.2, -1e9), 1e9, Side::Outside).anchored(&near);
        let slope = Vector::<2>::new(-0.6, 0.8);
        let plane = Plane::new(Vector::<2>::new(0.8e10, 0.6e10), slope).anchored(&near);
        let start = [disc.gap(&near), plane.gap(&near)];
        for step in [1e-3, 1e-9, 1e-12] {
            let up = disc.gap(&(near + Vector::<2>::new(0.0, step))) - start[0];
            assert!((up / step - 1.0).abs() < 1e-3, "{step}: {up}");
            let away = plane.gap(&(near + slope * step)) - start[1];
            assert!((away / step - 1.0).abs() < 1e-3, "{step}: {away}");
        }
    }

    /// Between any two points of a path that is reported as flat, the normal rotates by less than
    /// 0.2. A plane is flat. A chord as long as the radius and the inside of a hollow are not flat.
    #[test]
    fn what_is_flat_turns_by_little() {
        let mut flat = 0;
        for obstacle in sample_shapes::<3>() {
            for ends in crate::taylor::scatter(6 * 2000, 5).chunks_exact(6) {
                let (from, way) = ends.split_at(3);
                let from = Vector::<3>::from_column_slice(from);
                let to = from + Vector::<3>::from_column_slice(way) * 0.2;
                let least = obstacle.gap(&from).min(obstacle.gap(&to));
                if !is_flat_along(&*obstacle, (to - from).norm(), least) {
                    continue;
                }
                flat += usize::from(obstacle.core().is_some());
                let normal = |t: f64| obstacle.proximity(&(from + (to - from) * t)).normal;
                assert!(
                    (0..=8).all(|k| normal(0.0).dot(&normal(0.125 * f64::from(k))) >= 0.98),
                    "{obstacle:?}"
                );
            }
        }
        assert!(flat > 100, "{flat}");
        let disc = Sphere::new(Vector::<2>::zeros(), 0.1, Side::Outside);
        assert!(is_flat_along(&disc, 0.015, 0.0));
        assert!(!is_flat_along(&disc, 0.1, 0.0) && !is_flat_along(&disc, 0.015, -0.05));
        let hollow = Sphere::new(Vector::<2>::zeros(), 0.1, Side::Inside);
        assert!(!is_flat_along(&hollow, 1e-3, 0.0));
    }
}
