//! Rigid obstacles as signed distances, in 2D and 3D. Each obstacle has its own file and one line
//! in the table below.
//!
//! The gradient of a signed distance `g(x)` is the normal, and its Hessian the curvature. The
//! tangent therefore contains the complete geometry.

mod check;
mod shape;
mod side;

pub use cylinder::Cylinder;
pub use plane::Plane;
pub use shape::{Core, Proximity, Shape, is_flat_along};
pub use side::Side;
pub use sphere::Sphere;

use std::rc::Rc;

use crate::reader::findings::Findings;
use crate::reader::laws::family;
use crate::reader::quantity::Quantity;
use crate::tensor::{Vector, cross};

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

            /// Radius of a ball or disc \[m\]; `None` for other shapes.
            pub fn radius_of_solid(&self) -> Option<f64> {
                let ball = self.shape::<3>().core().filter(|core| core.axis.is_none());
                ball.map(|core| core.radius)
            }

            /// The point about which it rotates unless the case names another one \[m\].
            pub fn centre<const D: usize>(&self) -> Vector<D> {
                match self {
                    $(Self::$obstacle(obstacle) => numbers(obstacle.centre()),)+
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

/// The shapes of all sample obstacles of this dimension.
#[cfg(test)]
pub(super) fn sample_shapes<const D: usize>() -> Vec<Rc<dyn Shape<D>>> {
    let fits = |obstacle: &Obstacle| {
        let mut findings = Findings::new(crate::reader::units::Units::SI);
        obstacle.check(D, &mut findings);
        findings.is_empty()
    };
    let all = OBSTACLES.iter().flat_map(|entry| (entry.samples)()).filter(fits);
    all.map(|obstacle| obstacle.shape()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
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
        assert!(sample_shapes::<2>().len() >= 4 && sample_shapes::<3>().len() >= 2 * OBSTACLES.len());
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
