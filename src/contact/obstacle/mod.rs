//! Rigid obstacles as signed distances, in the plane and in space. One file each, one line in [`OBSTACLES`].
//!
//! With a signed distance `g(x)` the normal is its gradient and the curvature its Hessian, so nothing of the
//! geometry is lost in the tangent.

mod cylinder;
mod plane;
mod sphere;

pub use cylinder::Cylinder;
pub use plane::Plane;
pub use sphere::Sphere;

use crate::error::Result;
use crate::tensor::{Tensor, Vector, cross, rotations};

/// Which side of a closed surface is free.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Side {
    /// The contactor is outside of the obstacle.
    #[default]
    Outside,
    /// The contactor is inside of a hollow obstacle.
    Inside,
}

impl Side {
    fn sign(self) -> f64 {
        match self {
            Self::Outside => 1.0,
            Self::Inside => -1.0,
        }
    }
}

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

/// A rigid obstacle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Obstacle<const D: usize> {
    /// See [`Plane`].
    Plane(Plane<D>),
    /// See [`Sphere`].
    Sphere(Sphere<D>),
    /// See [`Cylinder`].
    Cylinder(Cylinder<D>),
}

impl<const D: usize> Obstacle<D> {
    /// Gap, normal and curvature at the current point `x` \[m\].
    pub fn proximity(&self, x: &Vector<D>) -> Proximity<D> {
        match self {
            Self::Plane(plane) => plane.proximity(x),
            Self::Sphere(sphere) => sphere.proximity(x),
            Self::Cylinder(cylinder) => cylinder.proximity(x),
        }
    }

    /// Radius \[m\] of an obstacle that is round and may slip between the points of a contactor; none of planes and hollows.
    pub fn outer_radius(&self) -> Option<f64> {
        match self {
            Self::Plane(_) => None,
            Self::Sphere(sphere) => sphere.outer_radius(),
            Self::Cylinder(cylinder) => cylinder.outer_radius(),
        }
    }

    /// Whether the normal turns by less than 0.2 between any two points of a path of this length \[m\], at the ends of which the
    /// gap is `least` \[m\] or more. A hollow says no, whatever it does.
    pub fn is_flat_along(&self, length: f64, least: f64) -> bool {
        /// Length over the distance from the centre; seen from there it is an angle of 0.19.
        const CHORD: f64 = 0.19;
        match self {
            Self::Plane(_) => true,
            // No gap changes faster than the place.
            _ => self.outer_radius().is_some_and(|radius| length <= CHORD * (radius + least - 0.5 * length)),
        }
    }

    /// Centre \[m\] of a sphere or disc.
    pub fn centre(&self) -> Option<Vector<D>> {
        match self {
            Self::Sphere(sphere) => Some(sphere.centre()),
            Self::Plane(_) | Self::Cylinder(_) => None,
        }
    }

    /// From the centre of a sphere or disc, or square from the axis of a cylinder, to `x` \[m\].
    pub fn offset(&self, x: &Vector<D>) -> Option<Vector<D>> {
        match self {
            Self::Plane(_) => None,
            Self::Sphere(sphere) => Some(x - sphere.centre()),
            Self::Cylinder(cylinder) => Some(cylinder.offset(x)),
        }
    }

    /// Velocities at `x` of the motions that take the obstacle into itself, and so change no gap: a plane slides and turns in itself, a
    /// sphere turns, a cylinder turns and slides along its axis. Zero where there are fewer.
    pub fn motions_along(&self, x: &Vector<D>) -> [Vector<D>; 6] {
        let mut motions = [Vector::zeros(); 6];
        match self {
            Self::Plane(plane) => {
                let [first, second] = tangents_of(&plane.normal());
                motions[0] = first;
                if D == 3 {
                    motions[1] = second;
                    let arm = x - plane.point();
                    motions[2] = first * second.dot(&arm) - second * first.dot(&arm);
                }
            }
            Self::Sphere(sphere) => {
                motions[..3].copy_from_slice(&rotations(&(x - sphere.centre())));
            }
            Self::Cylinder(cylinder) => {
                motions[0] = cylinder.axis();
                motions[1] = cross(&cylinder.axis(), &cylinder.offset(x));
            }
        }
        motions
    }

    /// The gap alone \[m\].
    pub fn gap(&self, x: &Vector<D>) -> f64 {
        match self {
            Self::Plane(plane) => plane.gap(x),
            Self::Sphere(sphere) => sphere.gap(x),
            Self::Cylinder(cylinder) => cylinder.gap(x),
        }
    }
}

/// Unit vectors that span the tangent plane of the unit vector `normal`; the second zero in the plane.
fn tangents_of<const D: usize>(normal: &Vector<D>) -> [Vector<D>; 2] {
    let axis = normal.iter().enumerate().min_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).map_or(0, |(i, _)| i);
    let mut across = Vector::<D>::zeros();
    across[axis] = 1.0;
    let first = (across - normal * normal[axis]).try_normalize(0.0).unwrap_or_else(Vector::zeros);
    [first, if D == 3 { cross(normal, &first) } else { Vector::zeros() }]
}

/// Distance from a centre or an axis: gap, normal and Hessian of `sign (|r| - radius)` for the offset `r`.
///
/// `transverse` projects onto the directions in which the surface is round. At the centre every direction is
/// as near as the others: the last round one is taken, without curvature.
fn round<const D: usize>(
    offset: &Vector<D>,
    transverse: &Tensor<D>,
    radius: f64,
    side: Side,
) -> Proximity<D> {
    let distance = offset.norm();
    let (sign, gap) = (side.sign(), side.sign() * (distance - radius));
    if distance <= CENTRE * radius {
        let column = (0..D)
            .rev()
            .map(|k| transverse.column(k).into_owned())
            .max_by(|a, b| a.norm().total_cmp(&b.norm()));
        let axis = column.unwrap_or_else(Vector::zeros).normalize();
        return Proximity { gap, normal: axis * sign, hessian: Tensor::zeros() };
    }
    let radial = offset / distance;
    let hessian = (transverse - radial * radial.transpose()) * (sign / distance);
    Proximity { gap, normal: radial * sign, hessian }
}

/// Nearer to the centre than this fraction of the radius a direction is rounding noise.
const CENTRE: f64 = 1e-12;

/// A row of [`OBSTACLES`].
pub struct ObstacleEntry {
    /// Name in the case file.
    pub name: &'static str,
    /// One line for `contact-petsc list`.
    pub summary: &'static str,
    /// Instances in the plane on which every test of derivatives runs.
    pub samples_2d: fn() -> Vec<Obstacle<2>>,
    /// Instances in space.
    pub samples_3d: fn() -> Vec<Obstacle<3>>,
}

fn planes<const D: usize>() -> Vec<Obstacle<D>> {
    let point = Vector::from_fn(|i, _| 0.1 * i as f64);
    let normals =
        [Vector::from_fn(|i, _| f64::from(i + 1 == D)), Vector::from_fn(|i, _| 1.0 - 1.7 * i as f64)];
    normals.into_iter().filter_map(|normal| Plane::new(point, normal).ok()).map(Obstacle::Plane).collect()
}

fn spheres<const D: usize>() -> Vec<Obstacle<D>> {
    let centre = Vector::from_fn(|i, _| 0.2 - 0.3 * i as f64);
    let sides = [Side::Outside, Side::Inside];
    sides.into_iter().filter_map(|side| Sphere::new(centre, 0.7, side).ok()).map(Obstacle::Sphere).collect()
}

fn cylinders() -> Vec<Obstacle<3>> {
    let (point, axis) = (Vector::<3>::new(0.1, -0.2, 0.3), Vector::<3>::new(1.0, 2.0, -0.5));
    let sides = [Side::Outside, Side::Inside];
    sides
        .into_iter()
        .filter_map(|side| Cylinder::new(point, axis, 0.6, side).ok())
        .map(Obstacle::Cylinder)
        .collect()
}

/// Every obstacle there is: feeds `list`, the hints in errors and the tests.
pub const OBSTACLES: &[ObstacleEntry] = &[
    ObstacleEntry {
        name: "plane",
        summary: "half space, free where the normal points",
        samples_2d: planes,
        samples_3d: planes,
    },
    ObstacleEntry {
        name: "sphere",
        summary: "sphere, in 2D a disc; side: outside or inside",
        samples_2d: spheres,
        samples_3d: spheres,
    },
    ObstacleEntry {
        name: "cylinder",
        summary: "endless cylinder, 3D only; side: outside or inside",
        samples_2d: Vec::new,
        samples_3d: cylinders,
    },
];

/// A direction of unit length.
fn direction<const D: usize>(what: &str, vector: Vector<D>) -> Result<Vector<D>> {
    let length = vector.norm();
    if length > 0.0 && length.is_finite() {
        return Ok(vector / length);
    }
    let shown: Vec<f64> = vector.iter().copied().collect();
    let message = format!("the {what} {shown:?} has no direction");
    Err(crate::error::Error::case(message).hint("give a vector of any length but zero"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::taylor::taylor_rate;

    fn taylor<const D: usize>(obstacle: &Obstacle<D>) {
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

    /// In 2D and 3D, of every obstacle the normal is the gradient of the gap and the Hessian that of the normal.
    #[test]
    fn derivatives_have_taylor_order_two() {
        for entry in OBSTACLES {
            (entry.samples_2d)().iter().for_each(taylor);
            (entry.samples_3d)().iter().for_each(taylor);
            assert!((entry.samples_3d)().len() >= 2, "{}", entry.name);
        }
    }

    /// Gaps are distances with the free side positive.
    #[test]
    fn gaps_are_signed_distances() {
        let floor = Plane::new(Vector::<2>::zeros(), Vector::<2>::new(0.0, 2.0)).unwrap();
        assert_eq!(floor.gap(&Vector::<2>::new(7.0, 0.25)), 0.25);
        let disc = |side| Obstacle::Sphere(Sphere::new(Vector::<2>::zeros(), 2.0, side).unwrap());
        let point = Vector::<2>::new(0.0, 3.0);
        assert_eq!(disc(Side::Outside).gap(&point), 1.0);
        assert_eq!(disc(Side::Inside).gap(&point), -1.0);
        assert_eq!(disc(Side::Inside).proximity(&point).normal, Vector::<2>::new(0.0, -1.0));
        let rod =
            Cylinder::new(Vector::<3>::zeros(), Vector::<3>::new(0.0, 0.0, 9.0), 1.0, Side::Outside).unwrap();
        assert_eq!(rod.gap(&Vector::<3>::new(3.0, 4.0, 100.0)), 4.0);
    }

    /// A point on the centre or the axis gets a unit normal across the axis and no NaN.
    #[test]
    fn finite_on_centre_and_axis() {
        for side in [Side::Outside, Side::Inside] {
            let centre = Vector::<3>::new(1.0, 2.0, 3.0);
            let axis = Vector::<3>::new(0.0, 0.0, 1.0);
            let sphere = Obstacle::Sphere(Sphere::new(centre, 0.5, side).unwrap());
            let rod = Obstacle::Cylinder(Cylinder::new(centre, axis, 0.5, side).unwrap());
            let disc = Sphere::new(Vector::<2>::zeros(), 1e-3, side).unwrap().proximity(&Vector::zeros());
            for offset in [0.0, 1e-300, 1e-15] {
                for (obstacle, along) in [(sphere, 0.0), (rod, 5.0)] {
                    let p = obstacle.proximity(&(centre + Vector::<3>::new(offset, 0.0, along)));
                    assert!((p.normal.norm() - 1.0).abs() < 1e-14 && p.hessian.iter().all(|c| c.is_finite()));
                    assert!(along == 0.0 || p.normal.dot(&axis).abs() < 1e-14);
                    assert!((p.gap.abs() - 0.5).abs() < 1e-12);
                }
            }
            assert!((disc.normal.norm() - 1.0).abs() < 1e-14);
        }
    }

    /// What is no obstacle is refused: zero normal or axis, radius not positive, numbers that are none, a cylinder in 2D.
    #[test]
    fn refuses_degenerate_obstacles() {
        let origin = Vector::<3>::zeros();
        assert!(Plane::new(origin, origin).is_err());
        assert!(Plane::new(origin, Vector::<3>::new(f64::NAN, 0.0, 1.0)).is_err());
        assert!(Plane::new(Vector::<3>::new(f64::NAN, 0.0, 1.0), Vector::<3>::new(0.0, 0.0, 1.0)).is_err());
        for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Sphere::new(origin, radius, Side::Outside).is_err());
            assert!(Cylinder::new(origin, Vector::<3>::new(0.0, 0.0, 1.0), radius, Side::Outside).is_err());
        }
        assert!(Cylinder::new(origin, origin, 1.0, Side::Outside).is_err());
        let flat = Cylinder::new(Vector::<2>::zeros(), Vector::<2>::new(0.0, 1.0), 1.0, Side::Outside);
        assert!(flat.unwrap_err().message.contains("sphere"));
    }

    /// Between any two points of a path that is told flat the normal turns by less than 0.2; a plane is flat, a chord as long as
    /// the radius and the inside of a hollow are not.
    #[test]
    fn what_is_flat_turns_by_little() {
        let mut flat = 0;
        for obstacle in OBSTACLES.iter().flat_map(|entry| (entry.samples_3d)()) {
            for ends in crate::taylor::scatter(6 * 2000, 5).chunks_exact(6) {
                let (from, way) = ends.split_at(3);
                let from = Vector::<3>::from_column_slice(from);
                let to = from + Vector::<3>::from_column_slice(way) * 0.2;
                let least = obstacle.gap(&from).min(obstacle.gap(&to));
                if !obstacle.is_flat_along((to - from).norm(), least) {
                    continue;
                }
                flat += usize::from(obstacle.outer_radius().is_some());
                let normal = |t: f64| obstacle.proximity(&(from + (to - from) * t)).normal;
                assert!(
                    (0..=8).all(|k| normal(0.0).dot(&normal(0.125 * f64::from(k))) >= 0.98),
                    "{obstacle:?}"
                );
            }
        }
        assert!(flat > 100, "{flat}");
        let disc = Obstacle::Sphere(Sphere::new(Vector::<2>::zeros(), 0.1, Side::Outside).expect("a disc"));
        assert!(
            disc.is_flat_along(0.015, 0.0)
                && !disc.is_flat_along(0.1, 0.0)
                && !disc.is_flat_along(0.015, -0.05)
        );
        let hollow =
            Obstacle::Sphere(Sphere::new(Vector::<2>::zeros(), 0.1, Side::Inside).expect("a hollow"));
        assert!(!hollow.is_flat_along(1e-3, 0.0));
    }
}
