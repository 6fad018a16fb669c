//! Moments of solids against closed forms, and of all shapes against sums over points inside.

use std::f64::consts::PI;

use super::super::triangles::TriangleSurface;
use super::super::triangles::tests::{ball as sphere_of_triangles, cube};
use super::super::{
    CapsuleObstacle, OBSTACLES, Obstacle, PolylineObstacle, Shape, Side, SphereObstacle, TorusObstacle, fits,
    rotation_about,
};
use super::*;

fn near(found: f64, known: f64) {
    assert!((found - known).abs() < 2e-13 * known.abs().max(1.0), "{found} is not {known}");
}

/// Moments of inertia of balls, capsules, boxes and rings are those of textbooks.
#[test]
fn closed_forms_are_met() {
    let ball = SphereObstacle::of(&[1.0, 2.0, 3.0], 0.5, Side::Outside).shape::<3>().solid().unwrap();
    let volume = PI / 6.0;
    near(ball.volume, volume);
    near((ball.inertia() - Tensor::<3>::identity() * (0.4 * volume * 0.25)).norm(), 0.0);
    let disc = SphereObstacle::of(&[1.0, 2.0], 0.5, Side::Outside).shape::<2>().solid().unwrap();
    near(disc.volume, 0.25 * PI);
    near(disc.inertia()[(2, 2)], 0.5 * 0.25 * PI * 0.25);
    // A cylinder of length l with half balls, whose centroids are 3/8 r beyond its ends.
    let (l, r) = (2.0, 0.3);
    let capsule = CapsuleObstacle::of(&[0.0, -1.0, 1.0], &[0.0, 1.0, 1.0], r, Side::Outside);
    let capsule = capsule.shape::<3>().solid().unwrap();
    let [rod, half] = [PI * r * r * l, 2.0 / 3.0 * PI * r.powi(3)];
    let along = 0.5 * rod * r * r + 2.0 * half * 0.4 * r * r;
    let end = half * (0.4 * r * r - (0.375 * r).powi(2) + (0.5 * l + 0.375 * r).powi(2));
    let across = rod * (l * l / 12.0 + r * r / 4.0) + 2.0 * end;
    let inertia = capsule.inertia();
    near(capsule.volume, rod + 2.0 * half);
    near(inertia[(1, 1)], along);
    near(inertia[(0, 0)], across);
    near(inertia[(2, 2)], across);
    near((capsule.centroid - Vector::<3>::z()).norm(), 0.0);
    let size = Vector::<3>::new(1.0, 2.0, 3.0);
    let sharp = rounded_box(Vector::<3>::zeros(), &(size * 0.5), 0.0, &Tensor::identity());
    near(sharp.inertia()[(0, 0)], 6.0 * (4.0 + 9.0) / 12.0);
    let [rim, tube] = [2.0, 0.5];
    let ring = TorusObstacle::of([0.0; 3], [0.0, 0.0, 2.0], [rim, tube], Side::Outside);
    let ring = ring.shape::<3>().solid().unwrap();
    near(ring.volume, 2.0 * PI * PI * rim * tube * tube);
    near(ring.inertia()[(2, 2)], ring.volume * (rim * rim + 0.75 * tube * tube));
    near(ring.inertia()[(0, 0)], ring.volume * (0.5 * rim * rim + 0.625 * tube * tube));
}

/// A cube and a tetrahedron have their volume, centroid and inertia at any position and rotation.
#[test]
fn polyhedra_are_exact_anywhere() {
    let corners = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let faces = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let quarter = Vector::<3>::repeat(0.25);
    // About the corner of the tetrahedron the integrals of x^2 and x y are 1/60 and 1/120.
    let dyads = Tensor::<3>::from_fn(|i, j| if i == j { 1.0 / 60.0 } else { 1.0 / 120.0 });
    let tetrahedron = dyads - quarter * quarter.transpose() / 6.0;
    let solids = [
        (cube(), 8.0, Vector::<3>::zeros(), Tensor::<3>::identity() * (8.0 / 3.0)),
        ((corners, faces), 1.0 / 6.0, quarter, tetrahedron),
    ];
    for ((points, triangles), volume, centroid, second) in solids {
        for (angle, shift) in [(0.0, 0.0), (0.7, 3.0), (-2.2, 40.0)] {
            let turn = rotation_about::<3>(&Vector::<3>::new(1.0, -2.0, 0.5), angle);
            let by = Vector::<3>::new(shift, -shift, 0.5 * shift);
            let moved: Vec<[f64; 3]> =
                points.iter().map(|x| (turn * Vector::<3>::from(*x) + by).into()).collect();
            for crease in [0.6, 1e-3] {
                let surface = TriangleSurface::new(&moved, triangles.clone(), crease).unwrap();
                let found = surface.moments();
                near(found.volume, volume);
                near((found.centroid - (turn * centroid + by)).norm(), 0.0);
                near((found.second - turn * second * turn.transpose()).norm(), 0.0);
            }
        }
    }
}

/// The patches of a sphere have its moments to the fourth order in the size of the triangles.
#[test]
fn a_sphere_of_patches_has_the_moments_of_the_ball() {
    let errors = [8, 16].map(|n| {
        let (points, triangles) = sphere_of_triangles(n);
        let found = TriangleSurface::new(&points, triangles, 0.6).unwrap().moments();
        let [volume, _, spread] = ball(3, 1.0);
        assert!(found.centroid.norm() < 1e-5);
        [found.volume / volume - 1.0, (found.second / spread - Tensor::<3>::identity()).norm()].map(f64::abs)
    });
    let order = |k: usize| (errors[0][k] / errors[1][k]).log2();
    assert!(order(0) > 3.5 && order(1) > 3.5 && errors[1][0] < 2e-5, "{errors:?}");
}

/// A triangle with round corners, in both orientations, and an angle with a corner that points inward.
#[test]
fn closed_polylines_have_round_and_sharp_corners() {
    let of = |points: &[[f64; 2]]| PolylineObstacle::of(points, 0.1, true, Side::Outside).shape::<2>();
    let mut corners = [[0.0, 0.0], [3.0, 0.0], [0.0, 4.0]];
    for _ in 0..2 {
        near(of(&corners).solid().unwrap().volume, 6.0 + 12.0 * 0.1 + PI * 0.01);
        corners.reverse();
    }
    // Its seven sides' strips, less the square that two of them share at the inner corner.
    let angle = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
    let found = of(&angle).solid().unwrap();
    near(found.volume, 3.0 + 8.0 * 0.1 + 1.25 * PI * 0.01 - 0.01);
    near(found.centroid[0], found.centroid[1]);
    near(found.second[(0, 0)], found.second[(1, 1)]);
    assert!(found.second[(0, 1)] < 0.0);
    // A slot that the radius closes has no outline of lines and arcs.
    let slot =
        [[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [1.55, 2.0], [1.55, 1.0], [1.45, 1.0], [1.45, 2.0], [0.0, 2.0]];
    assert!(of(&slot).solid().is_none());
    assert!(PolylineObstacle::of(&angle, 0.1, false, Side::Outside).shape::<2>().solid().is_none());
}

/// The moments of all shapes are those of the points where the gap is negative. Hollow and infinite
/// shapes have none.
#[test]
fn moments_are_those_of_the_points_inside() {
    fn all<const D: usize>(cells: usize, wanted: usize) {
        let samples = OBSTACLES.iter().flat_map(|entry| (entry.samples)());
        let solids = samples.filter(|obstacle: &Obstacle| fits(obstacle, D)).filter_map(|obstacle| {
            let shape = obstacle.shape::<D>();
            shape.solid().map(|solid| (shape, solid))
        });
        let mut count = 0;
        for (shape, solid) in solids {
            count += 1;
            // The solids are within a cube of this half length about their centroids.
            let size = 1.8;
            let cell = 2.0 * size / cells as f64;
            let mut sums = (0.0, Vector::<D>::zeros(), Tensor::<D>::zeros());
            for number in 0..cells.pow(D as u32) {
                let y = Vector::<D>::from_fn(|i, _| {
                    ((number / cells.pow(i as u32) % cells) as f64 + 0.5) * cell - size
                });
                if shape.gap(&(solid.centroid + y)) < 0.0 {
                    sums.0 += 1.0;
                    sums.1 += y;
                    sums.2 += y * y.transpose();
                }
            }
            let volume = sums.0 * cell.powi(D as i32);
            assert!((volume / solid.volume - 1.0).abs() < 0.01, "{shape:?} {volume} {solid:?}");
            assert!(sums.1.norm() / sums.0 < 0.005, "{shape:?}");
            let second = sums.2 * cell.powi(D as i32);
            assert!(
                (second - solid.second).norm() < 0.02 * solid.second.norm(),
                "{shape:?} {second} {solid:?}"
            );
        }
        assert_eq!(count, wanted);
    }
    all::<2>(200, 4);
    all::<3>(60, 6);
}
