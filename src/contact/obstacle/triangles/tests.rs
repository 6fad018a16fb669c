//! Surfaces of patches against a sphere, their derivatives and continuity, and surfaces that bound no
//! solid.

use super::*;
use crate::taylor::{scatter, taylor_rate};

/// A cube between -1 and 1 of twelve triangles, outward.
pub fn cube() -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let corner = |k: u32| std::array::from_fn(|i| if k >> i & 1 == 1 { 1.0 } else { -1.0 });
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    ((0..8).map(corner).collect(), triangles)
}

/// A sphere of radius 1: a cube whose faces have `n` times `n` cells of two triangles.
pub fn ball(n: u32) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let (corners, _) = cube();
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let mut known = std::collections::HashMap::new();
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for face in faces {
        let mut at = |i: u32, j: u32| {
            let [s, t] = [i, j]
                .map(|k| ((2.0 * f64::from(k) / f64::from(n) - 1.0) * std::f64::consts::FRAC_PI_4).tan());
            let [a, b, _, d] = face.map(|k: usize| Vector::<3>::from(corners[k]));
            let x = a + (b - a) * (0.5 + 0.5 * s) + (d - a) * (0.5 + 0.5 * t);
            let key = [x[0], x[1], x[2]].map(|c| (c * 1e6).round() as i64);
            *known.entry(key).or_insert_with(|| {
                points.push(x.normalize().into());
                points.len() as u32 - 1
            })
        };
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    (points, triangles)
}

fn surface((points, triangles): (Vec<[f64; 3]>, Vec<[u32; 3]>)) -> TriangleSurface {
    TriangleSurface::new(&points, triangles, 0.6).unwrap()
}

/// Largest errors of distance, normal and curvature beside a sphere of patches.
fn errors(n: u32) -> [f64; 3] {
    let sphere = surface(ball(n));
    let mut worst = [0.0_f64; 3];
    for x in scatter(3 * 2000, 3).chunks_exact(3) {
        let direction = Vector::<3>::from_column_slice(x).normalize();
        let radius = 1.0 + 0.1 * x[0];
        let near = sphere.nearest(&(direction * radius));
        let exact = (Tensor::<3>::identity() - direction * direction.transpose()) / radius;
        let found = [
            (near.distance - (radius - 1.0)).abs(),
            (near.normal - direction).norm(),
            (near.hessian - exact).norm(),
        ];
        worst.iter_mut().zip(found).for_each(|(worst, found)| *worst = worst.max(found));
    }
    worst
}

/// On a sphere the distance is of fourth order in the size of the triangles, and the normal of
/// third order. With flat triangles both are two orders lower.
#[test]
fn patches_approximate_a_sphere() {
    let [coarse, fine] = [errors(8), errors(16)];
    let order = |k: usize| (coarse[k] / fine[k]).log2();
    assert!(order(0) > 3.5 && order(1) > 2.5 && order(2) > 1.5, "{coarse:?} {fine:?}");
    assert!(fine[0] < 1e-5 && fine[1] < 1e-3 && fine[2] < 0.1, "{fine:?}");
    assert!(surface(ball(16)).centroid.norm() < 1e-3);
}

/// Normal and Hessian are the derivatives of the distance within a patch.
#[test]
fn patches_have_consistent_derivatives() {
    let sphere = surface(ball(6));
    let mut right = [0; 2];
    for x in scatter(3 * 100, 5).chunks_exact(3) {
        let x = Vector::<3>::from_column_slice(x).normalize() * (1.0 + 0.1 * x[1]);
        let d = Vector::<3>::new(0.3, -0.5, 0.4) * 1e-3;
        let here = sphere.nearest(&x);
        let at = |x: &[f64]| sphere.nearest(&Vector::from_column_slice(x));
        let gap = taylor_rate(
            |x| vec![at(x).distance],
            |_, d| vec![here.normal.dot(&Vector::from_column_slice(d))],
            x.as_slice(),
            d.as_slice(),
        );
        let normal = taylor_rate(
            |x| at(x).normal.as_slice().to_vec(),
            |_, d| (here.hessian * Vector::<3>::from_column_slice(d)).as_slice().to_vec(),
            x.as_slice(),
            d.as_slice(),
        );
        right[0] += usize::from(gap > 1.9);
        right[1] += usize::from(normal > 1.9);
        assert!((here.normal.norm() - 1.0).abs() < 1e-13 && (here.hessian * here.normal).norm() < 1e-12);
    }
    // Some of the paths leave their patch.
    assert!(right[0] >= 90 && right[1] >= 90, "{right:?}");
}

/// Normals hardly jump between patches, outside and inside. Between the flat triangles they jump
/// by 0.1 to 0.2.
#[test]
fn normals_are_nearly_continuous() {
    let sphere = surface(ball(8));
    for radius in [0.9, 0.99, 1.0, 1.01, 1.2] {
        let at = |angle: f64| {
            let x = Vector::<3>::new(angle.cos(), angle.sin(), 0.3 * angle.sin()).normalize() * radius;
            sphere.nearest(&x).normal
        };
        let mut before = at(0.0);
        for k in 1..=20_000 {
            let normal = at(f64::from(k) * 1e-4);
            assert!((normal - before).norm() < 1e-2, "{radius} {k}: {}", (normal - before).norm());
            before = normal;
        }
    }
}

/// Nothing else is nearer: the tree finds the same patch as a search in all of them.
#[test]
fn the_tree_misses_nothing() {
    let sphere = surface(ball(5));
    for x in scatter(3 * 300, 9).chunks_exact(3) {
        let x = Vector::<3>::from_column_slice(x) * 1.5;
        let all = sphere.patches.iter().map(|patch| patch.nearest(&x).square);
        let least = all.fold(f64::INFINITY, f64::min);
        let near = sphere.nearest(&x).distance;
        assert!((near.abs() - least.sqrt()).abs() < 1e-3 * near.abs() + 1e-12, "{x}: {near} {least}");
    }
}

/// Damage to points and triangles.
type Change = dyn Fn(&mut Vec<[f64; 3]>, &mut Vec<[u32; 3]>);

/// Surfaces that bound no solid are refused. One that is inside out is turned.
#[test]
fn broken_surfaces_are_refused() {
    let refused = |change: &Change| {
        let (mut points, mut triangles) = cube();
        change(&mut points, &mut triangles);
        TriangleSurface::new(&points, triangles, 0.6).map(|_| ()).unwrap_err().to_string()
    };
    assert!(refused(&|_, triangles| triangles.clear()).contains("no triangles"));
    assert!(refused(&|_, triangles| triangles.truncate(11)).contains("open"));
    assert!(refused(&|_, triangles| triangles[3].swap(0, 1)).contains("orient"));
    assert!(refused(&|_, triangles| triangles.push(triangles[0])).contains("more than two"));
    assert!(refused(&|points, _| points[0][1] = f64::NAN).contains("not finite"));
    assert!(refused(&|points, _| points[0] = points[1]).contains("no area"));
    let (points, mut triangles) = cube();
    triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1));
    let turned = TriangleSurface::new(&points, triangles, 0.6).unwrap();
    assert!((turned.nearest(&Vector::<3>::new(0.0, 0.0, 3.0)).distance - 2.0).abs() < 1e-14);
}
