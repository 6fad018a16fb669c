//! Turned solids against the shapes of which their surfaces consist, and their moments against
//! closed forms and sums over points inside.

use std::f64::consts::{FRAC_PI_4, PI};

use super::super::solid::rounded_box;
use super::super::{
    CapsuleObstacle, ConeObstacle, Cylinder, NoSolid, Obstacle, Plane, SphereObstacle, TorusObstacle,
};
use super::*;
use crate::taylor::{scatter, taylor_rate};
use crate::tensor::Tensor;

const AXIS: [f64; 3] = [1.0, -2.0, 2.0];
const POINT: [f64; 3] = [0.3, -0.1, 0.2];

fn turned(profile: &[[f64; 2]], radius: f64, side: Side) -> Turned<3> {
    TurnedObstacle::of(POINT, AXIS, profile, radius, side).shape()
}

/// The position at this height on the axis \[m\].
fn on_axis(height: f64) -> Vector<3> {
    Vector::<3>::from(POINT) + Vector::<3>::from(AXIS) * (height / 3.0)
}

/// Profile of a cylinder of this radius and length from height zero, whose edges have a radius.
fn cylinder(radius: f64, length: f64, edge: f64) -> [[f64; 2]; 4] {
    let [near, far] = [edge, length - edge];
    [[0.0, near], [radius - edge, near], [radius - edge, far], [0.0, far]]
}

fn same(one: &Proximity<3>, other: &Proximity<3>, tolerance: f64) -> bool {
    (one.gap - other.gap).abs() < tolerance
        && (one.normal - other.normal).norm() < tolerance
        && (one.hessian - other.hessian).norm() < tolerance
}

/// A cylinder of finite length has the distances, normals and curvatures of an infinite one on its
/// side, of planes at its ends and of tori at its edges, from both sides.
#[test]
fn a_finite_cylinder_consists_of_known_shapes() {
    let [radius, length, edge] = [0.4, 1.0, 0.1];
    let [bottom, top] = [0.0, length].map(on_axis);
    let axis = Vector::<3>::from(AXIS) / 3.0;
    for side in [Side::Outside, Side::Inside] {
        let whole = turned(&cylinder(radius, length, edge), edge, side);
        let infinite = Cylinder::new(bottom, axis, radius, side);
        let [below, above] = [Plane::new(bottom, -axis), Plane::new(top, axis)];
        let [lower, upper] = [edge, length - edge].map(|height| {
            TorusObstacle::of(on_axis(height).into(), AXIS, [radius - edge, edge], side).shape::<3>()
        });
        let mut seen = [0; 3];
        for place in scatter(3 * 2000, 3).chunks_exact(3) {
            let x = on_axis(0.5 * length) + Vector::<3>::from_column_slice(place);
            let height = axis.dot(&(x - bottom));
            let reach = (x - on_axis(height)).norm();
            let beside = height > edge && height < length - edge;
            let within = reach < radius - edge;
            let (kind, known) = match (beside, within) {
                (true, true) => continue,
                (true, false) => (0, infinite.proximity(&x)),
                (false, true) if height < edge => (1, below.proximity(&x).on(side)),
                (false, true) => (1, above.proximity(&x).on(side)),
                (false, false) if height < edge => (2, lower.proximity(&x)),
                (false, false) => (2, upper.proximity(&x)),
            };
            seen[kind] += 1;
            let found = whole.proximity(&x);
            assert!(same(&found, &known, 1e-11), "{kind} at {x}: {found:?} {known:?}");
        }
        assert!(seen.iter().all(|&count| count > 100), "{seen:?}");
        // At the ends the axis is a place like any other.
        for (height, normal) in [(-0.3, -axis), (length + 0.2, axis)] {
            let found = whole.proximity(&on_axis(height));
            assert!((found.normal - normal * side.sign()).norm() < 1e-15 && found.hessian.norm() < 1e-15);
        }
    }
}

/// The tip of a cone of finite length is that of the infinite cone, also on the axis.
#[test]
fn the_tip_of_a_finite_cone_is_that_of_a_cone() {
    let [half_angle, radius, length] = [0.5_f64, 0.2, 4.0];
    let profile = [[0.0, 0.0], [length * half_angle.tan(), length], [0.0, length]];
    let tip = on_axis(-radius);
    for side in [Side::Outside, Side::Inside] {
        let finite = turned(&profile, radius, side);
        let cone = ConeObstacle::of(tip.as_slice(), &AXIS, half_angle, radius, side).shape::<3>();
        let mut curved = 0;
        for place in scatter(3 * 500, 4).chunks_exact(3) {
            let x = on_axis(0.1) + Vector::<3>::from_column_slice(place) * 0.6;
            let [found, known] = [finite.proximity(&x), cone.proximity(&x)];
            assert!(same(&found, &known, 1e-10), "{x}: {found:?} {known:?}");
            curved += usize::from(found.hessian.trace().abs() > 1.5 / (found.gap.abs() + radius));
        }
        assert!(curved > 20, "{curved}");
        for height in [-0.9, -0.3, -0.05] {
            let [found, known] = [finite.proximity(&on_axis(height)), cone.proximity(&on_axis(height))];
            assert!(same(&found, &known, 1e-12), "{height}: {found:?} {known:?}");
        }
    }
}

/// A profile that shrinks to a point, a line on the axis or a circle about it gives a ball, a
/// capsule and a torus, with their moments.
#[test]
fn thin_profiles_are_balls_capsules_and_tori() {
    let thin = 1e-13;
    let ball = [[0.0, -thin], [thin, 0.0], [0.0, thin]];
    let line = [[0.0, -0.5], [thin, 0.2], [0.0, 0.5]];
    let circle = [[0.8 - thin, 0.0], [0.8 + thin, 0.0], [0.8, thin]];
    let [from, to] = [-0.5, 0.5].map(on_axis);
    let rows: [(&[[f64; 2]], Obstacle); 3] = [
        (&ball, SphereObstacle::of(&POINT, 0.3, Side::Outside).into()),
        (&line, CapsuleObstacle::of(from.as_slice(), to.as_slice(), 0.3, Side::Outside).into()),
        (&circle, TorusObstacle::of(POINT, AXIS, [0.8, 0.3], Side::Outside).into()),
    ];
    for (profile, known) in rows {
        let known = known.shape::<3>();
        let shape = turned(profile, 0.3, Side::Outside);
        for place in scatter(3 * 200, 8).chunks_exact(3) {
            let x = on_axis(0.0) + Vector::<3>::from_column_slice(place) * 1.5;
            assert!((shape.gap(&x) - known.gap(&x)).abs() < 1e-12, "{known:?} at {x}");
        }
        let [found, known] = [shape.solid().unwrap(), known.solid().unwrap()];
        assert!((found.volume / known.volume - 1.0).abs() < 1e-11, "{found:?} {known:?}");
        assert!((found.centroid - known.centroid).norm() < 1e-11);
        assert!((found.second - known.second).norm() < 1e-11, "{found:?} {known:?}");
    }
}

/// On the axis normals are differentiable at ends and at tips, from outside and within a hollow,
/// and the Hessian is their derivative. Beside it no rounding is left in the curvature.
#[test]
fn curvature_is_known_on_the_axis() {
    let blunt = cylinder(0.5, 1.0, 0.2);
    let sharp = [[0.0, 0.0], [1.0, 1.0], [0.0, 2.0]];
    for (profile, height) in [(&blunt[..], -0.4), (&blunt, 1.7), (&sharp, -0.5), (&sharp, 2.3)] {
        for side in [Side::Outside, Side::Inside] {
            let shape = turned(profile, 0.2, side);
            let normal =
                |x: &[f64]| shape.proximity(&Vector::from_column_slice(x)).normal.as_slice().to_vec();
            let x = on_axis(height);
            let by_normal = |x: &[f64], d: &[f64]| {
                let hessian = shape.proximity(&Vector::from_column_slice(x)).hessian;
                (hessian * Vector::<3>::from_column_slice(d)).as_slice().to_vec()
            };
            assert!(taylor_rate(normal, by_normal, x.as_slice(), &[0.05, 0.02, -0.08]) > 1.9, "{height}");
            let here = shape.proximity(&x);
            for reach in [1e-17, 1e-14, 1e-11, 1e-8] {
                let beside = shape.proximity(&(x + Vector::<3>::new(2.0, 1.0, 0.0) * reach));
                assert!(same(&here, &beside, 1e-6), "{height} {reach}: {here:?} {beside:?}");
                assert!((beside.normal.norm() - 1.0).abs() < 1e-14);
            }
        }
    }
    // Within a cone the normal is inclined, and rounding chooses its direction around the axis.
    let hollow = turned(&sharp, 1e-6, Side::Inside);
    for height in scatter(20, 6) {
        let at = hollow.proximity(&on_axis(1.0 + 0.5 * height));
        assert!((at.normal.norm() - 1.0).abs() < 1e-14, "{at:?}");
        assert!((at.hessian * at.normal).norm() <= 1e-14 * at.hessian.norm(), "{at:?}");
        assert!((at.normal.dot(&Vector::<3>::from(AXIS)).abs() / 3.0 - 0.5_f64.sqrt()).abs() < 1e-14);
    }
}

/// A cylinder of finite length with rounded edges: its middle and two caps, whose radius is `a + e cos
/// t` at the height `e sin t`. Integrals of powers of the cosine give their moments.
#[test]
fn a_rounded_cylinder_has_its_closed_form() {
    let [radius, length, e] = [0.4, 1.0, 0.15];
    let [a, l] = [radius - e, length - 2.0 * e];
    // Integrals of cos^n t over a right angle, and of those times sin t and sin^2 t.
    let cosine = [PI / 2.0, 1.0, FRAC_PI_4, 2.0 / 3.0, 3.0 * PI / 16.0, 8.0 / 15.0];
    let by_sine = |n: usize| 1.0 / (n as f64 + 1.0);
    let by_square = |n: usize| cosine[n] - cosine[n + 2];
    // Integral over a cap of a function of the height whose integrals with the powers are given.
    let over =
        |with: &dyn Fn(usize) -> f64| PI * e * (a * a * with(1) + 2.0 * a * e * with(2) + e * e * with(3));
    let cap = over(&|n| cosine[n]);
    let volume = PI * radius * radius * l + 2.0 * cap;
    let along = PI * radius * radius * l.powi(3) / 12.0
        + 2.0 * (0.25 * l * l * cap + l * e * over(&by_sine) + e * e * over(&by_square));
    let fourth: f64 = [1.0, 4.0, 6.0, 4.0, 1.0]
        .into_iter()
        .enumerate()
        .map(|(k, binomial)| binomial * a.powi(4 - k as i32) * e.powi(k as i32 + 1) * cosine[k + 1])
        .sum();
    let across = 0.25 * PI * (radius.powi(4) * l + 2.0 * fourth);
    // Steiner's formula for all points near a convex solid.
    let steiner =
        PI * a * a * l + 2.0 * PI * a * (a + l) * e + PI * (l + PI * a) * e * e + 4.0 / 3.0 * PI * e.powi(3);
    assert!((steiner - volume).abs() < 1e-14);
    let rod = TurnedObstacle::of(POINT, AXIS, &cylinder(radius, length, e), e, Side::Outside);
    let found = rod.shape::<3>().solid().unwrap();
    let axis = Vector::<3>::from(AXIS) / 3.0;
    assert!((found.volume - volume).abs() < 1e-14);
    assert!((found.centroid - on_axis(0.5 * length)).norm() < 1e-14);
    assert!((rod.centre::<3>() - found.centroid).norm() < 1e-14);
    let known = Tensor::<3>::identity() * across + axis * axis.transpose() * (along - across);
    assert!((found.second - known).norm() < 1e-14, "{found:?} {known}");
}

/// A frustum of a cone, a cone, a pin with a head, and a cylinder with a conical bore. Their edges are
/// nearly sharp.
#[test]
fn sharp_solids_have_the_moments_of_textbooks() {
    let sharp = 1e-12;
    let of = |profile: &[[f64; 2]]| turned(profile, sharp, Side::Outside).solid().unwrap();
    let axis = Vector::<3>::from(AXIS) / 3.0;
    let near = |found: f64, known: f64| assert!((found / known - 1.0).abs() < 3e-11, "{found} {known}");
    // Volume, height of the centroid, and moment of inertia about the axis.
    let check = |profile: &[[f64; 2]], volume: f64, height: f64, about: f64| {
        let found = of(profile);
        near(found.volume, volume);
        near(axis.dot(&(found.centroid - on_axis(0.0))), height);
        near(axis.dot(&(found.inertia() * axis)), about);
    };
    let (r, s, h) = (0.9_f64, 0.4_f64, 1.5_f64);
    let squares = r * r + r * s + s * s;
    check(
        &[[0.0, 0.0], [r, 0.0], [s, h], [0.0, h]],
        PI * h * squares / 3.0,
        0.25 * h * (r * r + 2.0 * r * s + 3.0 * s * s) / squares,
        0.1 * PI * h * (r.powi(5) - s.powi(5)) / (r - s),
    );
    // The profile of a cone in the opposite direction. Its inertia across is 3/80 m (4 r^2 + h^2).
    let cone = [[0.0, h], [r, 0.0], [0.0, 0.0]];
    let volume = PI * h * r * r / 3.0;
    check(&cone, volume, 0.25 * h, 0.3 * volume * r * r);
    let across = Vector::<3>::new(2.0, 1.0, 0.0) / 5.0_f64.sqrt();
    near(across.dot(&(of(&cone).inertia() * across)), 0.0375 * volume * (4.0 * r * r + h * h));
    let rod = |radius: f64, length: f64| PI * radius * radius * length;
    let [head, shaft] = [rod(r, 0.5), rod(s, 2.0)];
    check(
        &[[0.0, 0.0], [r, 0.0], [r, 0.5], [s, 0.5], [s, 2.5], [0.0, 2.5]],
        head + shaft,
        (head * 0.25 + shaft * 1.5) / (head + shaft),
        0.5 * (head * r * r + shaft * s * s),
    );
    let [whole, bore] = [rod(r, h), rod(r, 0.6) / 3.0];
    check(
        &[[0.0, 0.6], [r, 0.0], [r, h], [0.0, h]],
        whole - bore,
        (whole * 0.5 * h - bore * 0.25 * 0.6) / (whole - bore),
        0.5 * whole * r * r - 0.3 * bore * r * r,
    );
}

/// A ring of rounded rectangular section obeys Pappus's theorem and its analogue for second moments.
/// Far from its axis it loses only the digits that the positions of its points have lost.
#[test]
fn rings_obey_pappus() {
    let [width, height, e] = [0.3, 0.5, 0.1];
    let half = Vector::<2>::new(0.5 * width, 0.5 * height);
    let section = rounded_box(Vector::<2>::zeros(), &half, e, &Tensor::identity());
    let axis = Vector::<3>::from(AXIS) / 3.0;
    for far in [0.3, 1.0, 1e3, 1e6] {
        // That of the positions, relative to the section.
        let rounding = 1e-13 + 1e-15 * far;
        let [inner, outer] = [far - half[0], far + half[0]];
        let profile = [[inner, 0.0], [outer, 0.0], [outer, height], [inner, height]];
        let found = turned(&profile, e, Side::Outside).solid().unwrap();
        let volume = 2.0 * PI * far * section.volume;
        let about = 2.0 * PI * (far.powi(3) * section.volume + 3.0 * far * section.second[(0, 0)]);
        let along = 2.0 * PI * far * section.second[(1, 1)];
        let near = |found: f64, known: f64| {
            assert!((found / known - 1.0).abs() < rounding, "{far}: {found} {known}")
        };
        near(found.volume, volume);
        near(axis.dot(&(found.inertia() * axis)), about);
        assert!((found.centroid - on_axis(0.5 * height)).norm() < rounding);
        // The tensor contains the much larger moments across.
        let apart = axis.dot(&(found.second * axis)) - along;
        assert!(apart.abs() < rounding * along + 1e-15 * found.second.norm(), "{far}: {apart}");
    }
}

/// Solids with round tips, notches and bores have the moments of the points of their section where
/// the gap is negative. Solids whose radius fills a notch or a bore have none.
#[test]
fn moments_are_those_of_the_section() {
    let notched =
        [[0.0, 0.0], [0.9, 0.0], [0.9, 0.6], [0.4, 0.6], [0.4, 0.9], [0.9, 0.9], [0.9, 1.4], [0.0, 1.4]];
    let bored = [[0.0, 0.9], [0.3, 0.3], [0.3, 0.0], [0.8, 0.0], [0.8, 1.4], [0.0, 1.9]];
    let channel =
        [[0.5, 0.0], [1.5, 0.0], [1.5, 1.0], [1.1, 1.0], [1.1, 0.4], [0.9, 0.4], [0.9, 1.0], [0.5, 1.0]];
    let dimple = [[0.0, 0.5], [0.9, 0.0], [0.9, 1.0], [0.0, 1.0]];
    let spindle = [[0.0, -0.4], [0.5, 0.3], [0.0, 1.5]];
    for profile in [&notched[..], &bored, &channel, &dimple, &spindle] {
        let shape = TurnedObstacle::of([0.0; 3], [0.0, 0.0, 1.0], profile, 0.08, Side::Outside).shape::<3>();
        let found = shape.solid().unwrap();
        let cells = 400;
        let cell = 3.0 / f64::from(cells);
        let [mut volume, mut first, mut along, mut across] = [0.0; 4];
        for (i, j) in (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j))) {
            let r = (f64::from(i) + 0.5) * cell;
            let z = (f64::from(j) + 0.5) * cell - 0.8;
            let gap = shape.gap(&Vector::<3>::new(0.6 * r, -0.8 * r, z));
            // The part of a cell on this side of a line at the distance of the gap.
            let ring = 2.0 * PI * r * cell * cell * (0.5 - gap / cell).clamp(0.0, 1.0);
            volume += ring;
            first += ring * z;
            along += ring * z * z;
            across += 0.5 * ring * r * r;
        }
        let near = |found: f64, known: f64| {
            assert!((found / known - 1.0).abs() < 3e-4, "{profile:?}: {found} {known}");
        };
        near(found.volume, volume);
        near(found.centroid[2], first / volume);
        near(found.second[(2, 2)] + found.volume * found.centroid[2].powi(2), along);
        near(found.second[(0, 0)], across);
        near(found.second[(1, 1)], across);
    }
    // The neck of a bottle is filled, but not the bottle.
    let bottle =
        [[0.0, 0.0], [0.9, 0.0], [0.9, 2.0], [0.1, 2.0], [0.1, 1.6], [0.5, 1.6], [0.5, 0.4], [0.0, 0.4]];
    for (profile, radius) in [(&notched[..], 0.31), (&bored, 0.31), (&channel, 0.31), (&bottle, 0.15)] {
        let solid: Obstacle = TurnedObstacle::of(POINT, AXIS, profile, 0.05, Side::Outside).into();
        assert_eq!(solid.no_solid(3), None, "{profile:?}");
        let filled: Obstacle = TurnedObstacle::of(POINT, AXIS, profile, radius, Side::Outside).into();
        assert_eq!(filled.no_solid(3), Some(NoSolid::Overlap), "{profile:?}");
    }
    let hollow: Obstacle = TurnedObstacle::of(POINT, AXIS, &spindle, 0.1, Side::Inside).into();
    assert_eq!(hollow.no_solid(3), Some(NoSolid::Unbounded));
}
