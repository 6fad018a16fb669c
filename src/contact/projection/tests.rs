//! Closest points on facets of every kind, inside, beyond edges and beyond vertices.

use super::{Place, Projection};
use crate::mesh::ElementKind;
use crate::space::reference;
use crate::taylor::{scatter, taylor_rate};
use crate::tensor::{Tensor, Vector};

fn facets(dimension: usize) -> impl Iterator<Item = ElementKind> {
    ElementKind::ALL.into_iter().filter(move |kind| kind.dimension() + 1 == dimension)
}

/// A facet on its reference domain, bent out of its plane.
fn bent<const D: usize>(kind: ElementKind, bend: f64) -> Vec<Vector<D>> {
    let noise = scatter(kind.nodes() * D, 23);
    let place = |(a, p): (usize, &[f64; 3])| {
        Vector::<D>::from_fn(
            |i, _| if i + 1 < D { p[i] } else { bend * p[0] * p[0] } + 0.3 * bend * noise[a * D + i],
        )
    };
    reference(kind).node_coordinates().iter().enumerate().map(place).collect()
}

/// Points over the facet, beyond an edge, beyond a vertex, all at the given height.
fn places<const D: usize>(kind: ElementKind, height: f64) -> Vec<(Vector<D>, usize)> {
    let flat: &[([f64; 2], usize)] = match (D, kind.corners()) {
        (2, _) => &[([0.3, 0.0], 1), ([1.4, 0.0], 0), ([-1.5, 0.0], 0)],
        (_, 3) => &[([0.2, 0.3], 2), ([0.4, -0.5], 1), ([0.8, 0.9], 1), ([1.9, -0.4], 0)],
        _ => &[([0.3, -0.2], 2), ([0.2, 1.6], 1), ([-1.5, 0.1], 1), ([1.6, -1.7], 0)],
    };
    let lift = |xi: &[f64; 2]| Vector::<D>::from_fn(|i, _| if i + 1 < D { xi[i] } else { height });
    flat.iter().map(|(xi, free)| (lift(xi), *free)).collect()
}

fn nearest_by_sampling<const D: usize>(x: &Vector<D>, kind: ElementKind, nodes: &[Vector<D>]) -> f64 {
    let steps = if D == 2 { 4000 } else { 60 };
    let simplex = D == 3 && kind.corners() == 3;
    let mut nearest = f64::INFINITY;
    let mut shape = vec![0.0; nodes.len()];
    for i in 0..=steps {
        for j in 0..=(if D == 2 { 0 } else { steps }) {
            let (s, t) = (f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps));
            let xi = if simplex { [s, t * (1.0 - s)] } else { [2.0 * s - 1.0, 2.0 * t - 1.0] };
            reference(kind).shape(&xi[..D - 1], &mut shape);
            let y: Vector<D> = nodes.iter().zip(&shape).map(|(y, m)| y * *m).sum();
            nearest = nearest.min((x - y).norm());
        }
    }
    nearest
}

fn nearest<const D: usize>() {
    for kind in facets(D) {
        let nodes = bent::<D>(kind, 0.1);
        for height in [0.3, -0.3] {
            for (x, free) in places::<D>(kind, height) {
                let found = Projection::of(&x, kind, &nodes);
                let sampled = nearest_by_sampling(&x, kind, &nodes);
                assert!(found.distance <= sampled + 1e-12, "{kind:?} {x:?}: {} > {sampled}", found.distance);
                assert!(found.distance >= sampled - 5e-2);
                assert_eq!(found.is_interior(), free == D - 1, "{kind:?} {x:?}");
                assert!((found.normal.norm() - 1.0).abs() < 1e-14);
                assert!(((x - found.point).dot(&found.normal) - found.gap).abs() < 1e-14);
                assert!((found.by_target_nodes().map(|v| v.coefficient).sum::<f64>() + 1.0).abs() < 1e-13);
                if found.is_interior() {
                    assert!((found.gap.abs() - found.distance).abs() < 1e-12);
                    assert!(found.overhang() < 1e-12);
                }
                let corner = |k: u8| nodes[usize::from(k) % kind.corners()];
                match found.place {
                    Place::Interior => {}
                    Place::Corner(k) => assert!((found.point - corner(k)).norm() < 1e-12, "{kind:?}"),
                    Place::Edge(k) => {
                        let ends = (found.point - corner(k)).norm() + (found.point - corner(k + 1)).norm();
                        assert!(ends < 1.1 * (corner(k) - corner(k + 1)).norm(), "{kind:?}");
                    }
                }
            }
        }
    }
}

/// No sampled point of a curved facet is nearer than the projection, and it knows where it lies.
#[test]
fn finds_the_nearest_point_in_2d() {
    nearest::<2>();
}

/// No sampled point of a curved facet is nearer than the projection, and it knows where it lies.
#[test]
fn finds_the_nearest_point_in_3d() {
    nearest::<3>();
}

fn variations<const D: usize>() {
    for kind in facets(D) {
        let nodes = bent::<D>(kind, 0.1);
        for (x, _) in places::<D>(kind, -0.2) {
            let at = |z: &[f64]| {
                let moved: Vec<Vector<D>> = z.chunks_exact(D).map(Vector::from_column_slice).collect();
                Projection::of(&moved[0], kind, &moved[1..])
            };
            let z: Vec<f64> = std::iter::once(&x).chain(&nodes).flat_map(|p| p.as_slice().to_vec()).collect();
            let value = |z: &[f64]| {
                let p = at(z);
                let mut out = vec![p.gap, p.coordinates[0], p.coordinates[1]];
                out.extend(p.normal.iter());
                out
            };
            let here = at(&z);
            let slope = |_: &[f64], d: &[f64]| {
                let mut out = vec![0.0; 3 + D];
                for (a, d) in d.chunks_exact(D).enumerate() {
                    let d = Vector::<D>::from_column_slice(d);
                    let (gap, normal, coordinates) = if a == 0 {
                        let v = here.by_contactor();
                        (v.gap, v.normal, v.coordinates)
                    } else {
                        let v = here.by_target_nodes().nth(a - 1).unwrap();
                        (v.gap, v.normal, v.coordinates)
                    };
                    out[0] += gap.dot(&d);
                    out[1] += coordinates[0].dot(&d);
                    out[2] += coordinates[1].dot(&d);
                    (normal * d).iter().enumerate().for_each(|(i, n)| out[3 + i] += n);
                }
                out
            };
            let direction: Vec<f64> = scatter(z.len(), 31).iter().map(|d| d * 0.02).collect();
            let rate = taylor_rate(value, slope, &z, &direction);
            assert!(rate > 1.9, "{kind:?} {x:?}: {rate}");
        }
    }
}

/// Gap, normal and coordinates have variations of order two, inside and beyond edges and vertices, in the plane.
#[test]
fn variations_have_taylor_order_two_in_2d() {
    variations::<2>();
}

/// Gap, normal and coordinates have variations of order two, inside and beyond edges and vertices, in space.
#[test]
fn variations_have_taylor_order_two_in_3d() {
    variations::<3>();
}

fn second_variations<const D: usize>() {
    for kind in facets(D) {
        let nodes = bent::<D>(kind, 0.1);
        for (x, _) in places::<D>(kind, -0.2) {
            let z: Vec<f64> = std::iter::once(&x).chain(&nodes).flat_map(|p| p.as_slice().to_vec()).collect();
            let split =
                |z: &[f64]| -> Vec<Vector<D>> { z.chunks_exact(D).map(Vector::from_column_slice).collect() };
            let at = |z: &[f64]| {
                let moved = split(z);
                Projection::of(&moved[0], kind, &moved[1..])
            };
            let here = at(&z);
            let curvature = here.curvature(&nodes);
            let any = Vector::<D>::from_fn(|i, _| 0.3 - 0.7 * i as f64);
            let t = any - here.normal * here.normal.dot(&any);
            let field = split(&scatter(z.len(), 41));
            let value = |z: &[f64]| {
                let p = at(z);
                let of = |normal: &Tensor<D>, gap: &Vector<D>, field: &Vector<D>| {
                    ((normal.transpose() * t), normal * field, gap.dot(field))
                };
                let point = p.by_contactor();
                let mut all = vec![of(&point.normal, &point.gap, &field[0])];
                all.extend(p.by_target_nodes().zip(&field[1..]).map(|(v, f)| of(&v.normal, &v.gap, f)));
                let turn: Vector<D> = all.iter().map(|(_, turn, _)| *turn).sum();
                let flat = turn - here.normal * here.normal.dot(&turn);
                let mut out: Vec<f64> =
                    all.iter().flat_map(|(lever, ..)| lever.iter().copied().collect::<Vec<_>>()).collect();
                out.extend(flat.iter());
                out.push(all.iter().map(|(.., gap)| gap).sum());
                out.extend(p.arm().iter());
                out.push(p.by_target_nodes().zip(&field[1..]).map(|(v, f)| v.spin.dot(f)).sum());
                out
            };
            let (turns, gaps) = (curvature.of_turn(&field), curvature.of_gap(&field));
            let mut variations =
                vec![(1.0, [0.0; 2], here.by_contactor().normal, here.by_contactor().coordinates)];
            variations.extend(
                here.by_target_nodes()
                    .map(|v| (v.coefficient, v.coefficient_gradient, v.normal, v.coordinates)),
            );
            let slope = |_: &[f64], d: &[f64]| {
                let d = split(d);
                let count = d.len();
                let mut out = Vec::new();
                for a in 0..count {
                    let row: Vector<D> = (0..count).map(|b| curvature.of_normal(&t, a, b) * d[b]).sum();
                    out.extend(row.iter());
                }
                let turn: Vector<D> = turns.iter().zip(&d).map(|(turn, d)| turn * d).sum();
                out.extend(turn.iter());
                let mut gap: f64 = gaps.iter().zip(&d).map(|(gap, d)| gap.dot(d)).sum();
                for (field, (c, along, ..)) in field.iter().zip(&variations) {
                    for (d, (.., normal, coordinates)) in d.iter().zip(&variations) {
                        gap += field.dot(&(normal * d)) * c;
                        gap += field.dot(&here.normal)
                            * (0..2).map(|k| along[k] * coordinates[k].dot(d)).sum::<f64>();
                    }
                }
                out.push(gap);
                let (mut arm, mut spin) = (Vector::<D>::zeros(), 0.0);
                if let Some(spins) = curvature.spins() {
                    arm = d.iter().enumerate().map(|(b, d)| spins.arm(b) * d).sum();
                    spin = spins.of_field(&field).iter().zip(&d).map(|(spin, d)| spin.dot(d)).sum();
                }
                out.extend(arm.iter());
                out.push(spin);
                out
            };
            let direction: Vec<f64> = scatter(z.len(), 31).iter().map(|d| d * 0.01).collect();
            let rate = taylor_rate(value, slope, &z, &direction);
            assert!(rate > 1.9, "{kind:?} {:?} {x:?}: {rate}", here.place);
            assert_eq!(curvature.spins().is_some(), D == 3 && !here.is_interior());
        }
    }
}

/// The second variations of the normal along its tangents, of the gap, and of arm and spin, have order two, inside and beyond edges and
/// vertices.
#[test]
fn second_variations_have_taylor_order_two() {
    second_variations::<2>();
    second_variations::<3>();
}

/// Gap, normal and spin of a body that turns with the point: nothing, the turn of the normal, and the part of the turn about it.
#[test]
fn a_common_rotation_is_told_as_such() {
    let turn = Vector::<3>::new(0.3, -0.7, 0.4);
    for kind in facets(3) {
        let nodes = bent::<3>(kind, 0.1);
        for (x, _) in places::<3>(kind, -0.2) {
            let here = Projection::of(&x, kind, &nodes);
            let point = here.by_contactor();
            let mut gap = point.gap.dot(&turn.cross(&x));
            let mut normal = point.normal * turn.cross(&x);
            let mut spin = 0.0;
            for (node, y) in here.by_target_nodes().zip(&nodes) {
                gap += node.gap.dot(&turn.cross(y));
                normal += node.normal * turn.cross(y);
                spin += node.spin.dot(&turn.cross(y));
            }
            let about = if here.is_interior() { 0.0 } else { turn.dot(&here.normal) };
            assert!(gap.abs() < 1e-14 && (normal - turn.cross(&here.normal)).norm() < 1e-13, "{kind} {x:?}");
            assert!((spin - about).abs() < 1e-14, "{kind} {x:?}: {spin} {about}");
            // What the point moves by besides that of its foot is this rotation of its offset, in its parts.
            let offset = x - here.point;
            let told = turn.cross(&here.normal) * here.gap + here.arm() * about;
            let tangential = |v: Vector<3>| v - here.normal * here.normal.dot(&v);
            assert!(tangential(turn.cross(&offset) - told).norm() < 1e-13, "{kind} {x:?}");
        }
    }
}

/// On a straight facet the projection is exact, also far away, and gaps are positive outside.
#[test]
fn straight_facets_are_exact() {
    // Outward is to the right of the way from the first node to the second.
    let nodes = [Vector::<2>::new(2.0, 0.0), Vector::<2>::new(0.0, 0.0)];
    let found = Projection::of(&Vector::<2>::new(0.5, 1e3), ElementKind::Line2, &nodes);
    assert!((found.gap - 1e3).abs() < 1e-12 && (found.coordinates[0] - 0.5).abs() < 1e-12);
    let below = Projection::of(&Vector::<2>::new(0.5, -1e-3), ElementKind::Line2, &nodes);
    assert!((below.gap + 1e-3).abs() < 1e-15);
    let beyond = Projection::of(&Vector::<2>::new(3.0, 1.0), ElementKind::Line2, &nodes);
    assert!((beyond.gap - 1.0).abs() < 1e-15 && (beyond.distance - 2f64.sqrt()).abs() < 1e-15);
}

/// A facet without extent, and a point right on a facet, give numbers.
#[test]
fn degenerate_facets_give_numbers() {
    for kind in facets(3) {
        let nodes = vec![Vector::<3>::new(1.0, 2.0, 3.0); kind.nodes()];
        let found = Projection::of(&Vector::<3>::zeros(), kind, &nodes);
        assert!(found.gap == 0.0 && found.distance.is_finite());
        assert!(found.by_target_nodes().all(|v| v.normal.iter().all(|c| c.is_finite())));
        let flat = bent::<3>(kind, 0.0);
        let on = Projection::of(&flat[0], kind, &flat);
        assert!(on.distance < 1e-14 && on.gap.abs() < 1e-14);
    }
}
