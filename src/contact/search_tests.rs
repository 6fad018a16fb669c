//! The search against looking at everything, and what it does at ties, ends and corners.

use super::*;
use crate::contact::looks::{FACE_ON, Seen, counts, look};
use crate::contact::pair_scene::{LIMITS, Scene, block};
use crate::contact::surface::Quadrature;
use crate::contact::target::TargetFacets;
use crate::mesh::{ElementKind, Mesh};
use crate::taylor::scatter;

/// What the search would find if it looked at every facet.
fn brute<const D: usize>(scene: &Scene<D>, previous: &Pairing) -> Vec<Option<u64>> {
    let (surface, target) = (&scene.contact.surface, &scene.contact.target);
    let mut found = Vec::new();
    let mut nodes = Vec::new();
    for facet in surface.facets() {
        let points: Vec<_> = current_points(surface, facet, &scene.u).collect();
        let reference = surface.reference_points(facet);
        let size = reference.iter().map(|x| (x - reference[0]).norm()).fold(0.0, f64::max);
        for (q, point) in facet.points.clone().enumerate() {
            let at = surface.facet_point(facet, q);
            let probe = Probe {
                x: at.position(&points),
                outward: facet_normal(&facet_tangents(&points, at.gradient)),
                nodes: surface.facet_nodes(facet),
                previous: previous.facet(point),
                tie: TIE * size,
                far: FAR * size,
            };
            let all: Vec<Seen> = (0..target.len() as u32)
                .map(|facet| {
                    target.current(facet, &scene.u, &mut nodes);
                    look(&probe, target, facet, &nodes, &LIMITS)
                })
                .filter(|seen| seen.distance <= LIMITS.reach)
                .collect();
            let valid: Vec<_> = all.iter().filter(|s| counts(s, &all, target, probe.tie)).collect();
            let nearest = valid.iter().map(|s| s.distance).fold(f64::INFINITY, f64::min);
            let tied = valid.iter().filter(|s| s.distance <= nearest + probe.tie);
            let tied: Vec<_> = tied.collect();
            let deepest = tied.iter().map(|s| s.gap.abs()).fold(0.0, f64::max);
            let face_on = tied.iter().filter(|s| s.gap.abs() >= FACE_ON * deepest - probe.tie);
            let is_near = nearest <= probe.far;
            let order = |s: &&&&Seen| (is_near && probe.previous != Some(s.facet), target.identity(s.facet));
            found.push(face_on.min_by_key(order).map(|s| target.identity(s.facet)));
        }
    }
    found
}

fn named<const D: usize>(scene: &Scene<D>, pairing: &Pairing) -> Vec<Option<u64>> {
    let names = pairing.identities(&scene.contact.target);
    names.into_iter().map(|name| (name != u64::MAX).then_some(name)).collect()
}

fn clouds<const D: usize>(upper: ElementKind, lower: ElementKind) {
    let upper = block(upper, [0.1, 1.2], [0.0, 1.0], 4);
    let lower = block(lower, [0.0, 1.1], [-1.0, 0.02], 5);
    let mut scene = Scene::<D>::new(upper, lower, &["lower.top", "lower.right"], Quadrature::Gauss);
    let mut search = Search::new(&scene.contact.target, LIMITS, &scene.u);
    let (mut paired, mut open, mut built) = (0, 0, 1);
    for k in 0..12 {
        let size = scene.u.len();
        let wild = if k % 4 == 3 { 0.2 } else { 0.03 };
        scene.u = scatter(size, 40 + k).iter().map(|u| wild * u).collect();
        let slide: [f64; D] = std::array::from_fn(|i| if i == 0 { 0.05 * f64::from(k) } else { 0.0 });
        scene.shift(1, slide);
        scene.shift(0, slide.map(|s| 0.5 * s));
        let before = scene.pairing.clone();
        let expected = brute(&scene, &before);
        scene.contact.pair(&mut search, &scene.u, &mut scene.pairing);
        assert_eq!(named(&scene, &scene.pairing), expected, "{k}");
        paired += expected.iter().flatten().count();
        open += expected.iter().filter(|name| name.is_none()).count();
        built += usize::from(search.motion == 0.0);
        scene.pairing.begin_step();
        let radius = 0.1;
        let couples = search.candidates(scene.contact.sides(), &scene.u, radius);
        assert_eq!(couples, every_couple(&scene, radius), "{k}");
    }
    assert!(paired > open && open > 0, "{paired} {open}");
    assert!(built > 1 && built < 12, "the tree is built anew now and then, not always: {built}");
}

fn every_couple<const D: usize>(scene: &Scene<D>, radius: f64) -> Vec<(u32, u32)> {
    let (surface, target) = (&scene.contact.surface, &scene.contact.target);
    let mut couples = Vec::new();
    let mut nodes = Vec::new();
    for (index, facet) in surface.facets().iter().enumerate() {
        let points: Vec<_> = current_points(surface, facet, &scene.u).collect();
        let near = bounds(facet.kind, &points).inflate(radius);
        for other in 0..target.len() as u32 {
            target.current(other, &scene.u, &mut nodes);
            if bounds(target.kind(other), &nodes).inflate(radius).meets(&near) {
                couples.push((index as u32, other));
            }
        }
    }
    couples
}

/// Rough surfaces that slide and shake: tree and no tree agree on every point and every couple.
#[test]
fn finds_what_looking_at_everything_finds() {
    clouds::<2>(ElementKind::Quad4, ElementKind::Quad4);
    clouds::<2>(ElementKind::Quad9, ElementKind::Quad8);
    clouds::<3>(ElementKind::Hex8, ElementKind::Tet4);
    clouds::<3>(ElementKind::Tet4, ElementKind::Hex20);
}

/// A nodal contactor with nodes at -0.5, 0, 0.5, right over the border of the two facets of its target.
fn on_the_border(gap: f64) -> Scene<2> {
    let upper = block::<2>(ElementKind::Quad4, [-0.5, 0.5], [gap, 1.0], 2);
    let lower = block::<2>(ElementKind::Quad4, [-1.0, 1.0], [-1.0, 0.0], 2);
    Scene::<2>::new(upper, lower, &["lower.top"], Quadrature::Nodal)
}

/// Points of the scene at the place `x`.
fn points_at(scene: &Scene<2>, x: f64) -> Vec<usize> {
    let surface = &scene.contact.surface;
    let nodes =
        surface.facets().iter().flat_map(|f| f.points.clone().enumerate().map(move |(q, p)| (f, q, p)));
    let here = nodes.filter(|(facet, q, _)| {
        let node = surface.facet_nodes(facet)[*q] as usize;
        (scene.mesh.points[node][0] + scene.u[2 * node] - x).abs() < 1e-9
    });
    here.map(|(_, _, p)| p).collect()
}

/// A point over a vertex keeps its facet; a new one and one far away take the lowest name, in whatever order the rank knows
/// the facets.
#[test]
fn ties_keep_the_facet_or_take_the_lowest_name() {
    for (gap, is_near) in [(-1e-3, true), (0.0, true), (1e-3, true), (0.2, false)] {
        let mut scene = on_the_border(gap);
        let backwards: Vec<u32> = (0..scene.contact.target.len() as u32).rev().collect();
        let mut facets = TargetFacets::default();
        for &f in &backwards {
            let target = &scene.contact.target;
            facets.push(target.kind(f), target.nodes(f), target.identity(f), target.body(f));
        }
        let lowest = backwards.iter().map(|&f| scene.contact.target.identity(f)).min();
        let mut other = scene.clone();
        other.contact.target = TargetSurface::new(facets, &scene.mesh.points);
        scene.pair();
        other.pair();
        assert_eq!(named(&scene, &scene.pairing), named(&other, &other.pairing), "the order says nothing");
        let points = points_at(&scene, 0.0);
        assert_eq!(points.len(), 2);
        for p in points {
            assert_eq!(named(&scene, &scene.pairing)[p], lowest);
        }
        let highest = (0..2).map(|f| scene.contact.target.identity(f)).max().unwrap();
        let kept = vec![highest; scene.pairing.len()];
        scene.pairing = Pairing::from_identities(&kept, &scene.contact.target);
        scene.pair();
        for p in points_at(&scene, 0.0) {
            let expected = if is_near { Some(highest) } else { lowest };
            assert_eq!(named(&scene, &scene.pairing)[p], expected, "at {gap}");
        }
        assert!(named(&scene, &scene.pairing).iter().any(|name| *name != Some(highest)));
    }
}

/// A point that slides off the end is open at once, one on the end itself is not, and a ledge below catches it.
#[test]
fn points_slide_off_the_end() {
    let mut scene = on_the_border(-1e-3);
    scene.shift(1, [0.5, 0.0]);
    scene.pair();
    let at_end = points_at(&scene, 1.0);
    assert!(!at_end.is_empty() && at_end.iter().all(|p| scene.pairing.facet(*p).is_some()), "on the end");
    for step in [0.01, 0.1, 0.3] {
        scene.shift(1, [step, 0.0]);
        scene.pair();
        let evaluated: Vec<_> = (0..scene.pairing.len()).map(|p| scene.pairing.facet(p).is_some()).collect();
        assert_eq!(evaluated, [true, true, true, false], "step {step}");
    }
    let lower = block::<2>(ElementKind::Quad4, [-1.0, 1.0], [-1.0, 0.0], 2);
    let ledge = block::<2>(ElementKind::Quad4, [1.0, 3.0], [-1.0, -0.3], 2);
    let mesh = crate::mesh::merge(vec![("a".to_owned(), lower), ("b".to_owned(), ledge)]).unwrap();
    let upper = block::<2>(ElementKind::Quad4, [0.5, 1.5], [-1e-3, 1.0], 2);
    let mut scene = Scene::<2>::new(upper, mesh, &["lower.a.top", "lower.b.top"], Quadrature::Nodal);
    scene.pair();
    for p in points_at(&scene, 1.5) {
        let facet = scene.pairing.facet(p).expect("the ledge");
        assert_eq!(scene.contact.target.reference_points(facet)[0][1], -0.3);
    }
}

fn beside(right: f64) -> Mesh<2> {
    block::<2>(ElementKind::Quad4, [-1.0, right], [-1.0, 0.0], 3)
}

/// Beside a corner that is part of the target a point is open, although it lies below the level of the top.
#[test]
fn beside_a_corner_is_outside() {
    let upper = block::<2>(ElementKind::Quad4, [-0.5, 0.5], [-0.05, 1.0], 10);
    let mut scene = Scene::<2>::new(upper, beside(0.01), &["lower.top", "lower.right"], Quadrature::Gauss);
    scene.pair();
    scene.evaluate(&Default::default());
    let surface = &scene.contact.surface;
    for facet in surface.facets() {
        let centre = surface.reference_points(facet).iter().map(|x| 0.5 * x[0]).sum::<f64>();
        for p in facet.points.clone() {
            let closed = scene.state.current[p].is_closed();
            assert_eq!(closed, centre < 0.0, "{centre}: {:?}", scene.state.current[p]);
        }
    }
}

/// Facets on the far side of a thin target and those of the other side's body do not attract.
#[test]
fn deep_and_averted_facets_do_not_count() {
    let upper = block::<2>(ElementKind::Quad4, [-0.5, 0.5], [-0.55, 1.0], 2);
    let mut scene = Scene::<2>::new(upper, beside(1.0), &["lower.top", "lower.bottom"], Quadrature::Gauss);
    scene.pair();
    assert!((0..scene.pairing.len()).all(|p| scene.pairing.facet(p).is_none()));
    scene.shift(1, [0.0, 0.1]);
    scene.pair();
    for p in 0..scene.pairing.len() {
        let facet = scene.pairing.facet(p).unwrap();
        assert_eq!(scene.contact.target.reference_points(facet)[0][1], 0.0);
    }
}

/// Perpendicular facets do not attract either, whatever rounding makes of the angle.
#[test]
fn perpendicular_facets_do_not_count() {
    for tilt in [0.0, 1e-12, -1e-12] {
        let upper = block::<2>(ElementKind::Quad4, [0.0, 0.9], [-0.3, 1.0], 2);
        let mut scene = Scene::<2>::new(upper, beside(1.0), &["lower.right"], Quadrature::Gauss);
        for (a, x) in scene.mesh.points.iter().enumerate() {
            scene.u[2 * a] = tilt * x[1];
        }
        scene.pair();
        assert!((0..scene.pairing.len()).all(|p| scene.pairing.facet(p).is_none()), "{tilt}");
    }
}

/// Contactor and target may be one body: facets that share a node with the contactor facet are not its target.
#[test]
fn neighbours_on_the_same_body_are_no_target() {
    let upper = block::<2>(ElementKind::Quad4, [0.0, 1.0], [0.0, 1.0], 1);
    let mut scene = Scene::<2>::new(upper, beside(1.0), &["upper.right", "upper.left"], Quadrature::Gauss);
    // Folded up, so that right and left face the bottom.
    for (a, x) in scene.mesh.points.iter().enumerate().filter(|(_, x)| x[1] == 1.0) {
        scene.u[2 * a] = if x[0] > 0.5 { 1.0 } else { -1.0 };
        scene.u[2 * a + 1] = -1.5;
    }
    let mut search = Search::new(&scene.contact.target, LIMITS, &scene.u);
    assert!(search.candidates(scene.contact.sides(), &scene.u, 10.0).is_empty());
    scene.pair();
    assert!((0..scene.pairing.len()).all(|p| scene.pairing.facet(p).is_none()));
}

/// A facet that comes and goes is frozen for the step, free again in the next; a point that walks on is not.
#[test]
fn toggling_points_are_frozen() {
    let mut pairing = Pairing::new(2);
    let mut changed = 0;
    for k in 0..30 {
        changed += usize::from(pairing.take(0, Some(k % 2)));
        assert!(pairing.take(1, Some(k)));
    }
    assert!(pairing.is_frozen(0) && !pairing.is_frozen(1));
    assert_eq!(changed, 12);
    let saved = pairing.clone();
    pairing.begin_step();
    assert!(!pairing.is_frozen(0) && pairing != saved);
    assert!(pairing.take(0, None) && pairing.facet(0).is_none());
    pairing.clone_from(&saved);
    assert_eq!(pairing, saved);
    let mut scene = on_the_border(-1e-3);
    scene.pair();
    let names = scene.pairing.identities(&scene.contact.target);
    let back = Pairing::from_identities(&names, &scene.contact.target);
    assert_eq!(named(&scene, &back), named(&scene, &scene.pairing));
    assert_eq!(scene.pairing.renumbered(&scene.contact.target, &scene.contact.target), scene.pairing);
}

/// A point that holds energy and went to and fro keeps its facet a little way beyond its end, and no further.
#[test]
fn a_settled_point_keeps_its_facet_nearby() {
    let mut scene = on_the_border(-1e-3);
    scene.shift(1, [-0.02, 0.0]);
    scene.pair();
    let [p, _] = points_at(&scene, -0.02)[..] else { panic!("two points") };
    let left = scene.pairing.facet(p);
    for held in [false, true] {
        scene.pairing.begin_step();
        scene.pairing.hold(p, held);
        let mut move_by = |by: f64| {
            scene.shift(1, [by, 0.0]);
            scene.pair();
            scene.pairing.facet(p)
        };
        let right = move_by(0.04);
        assert_ne!(right, left);
        assert_eq!([move_by(-0.04), move_by(0.04)], [left, right]);
        // Two returns: from now on it stays where it is, up to a tenth of its facet beyond the end.
        assert_eq!(move_by(-0.06), if held { right } else { left });
        assert_eq!(move_by(-0.02), left);
        move_by(0.04);
    }
}

/// An iterate that ran away is not searched: the pairing stays, and the next good one is searched as ever.
#[test]
fn an_iterate_without_numbers_changes_nothing() {
    let mut scene = on_the_border(-1e-3);
    scene.pair();
    let (before, good) = (scene.pairing.clone(), scene.u.clone());
    let mut search = Search::new(&scene.contact.target, LIMITS, &scene.u);
    for bad in [f64::NAN, f64::INFINITY] {
        scene.u.fill(bad);
        let changes = scene.contact.pair(&mut search, &scene.u, &mut scene.pairing);
        assert_eq!((changes, &scene.pairing), (PairChanges::default(), &before));
        assert!(search.candidates(scene.contact.sides(), &scene.u, 0.1).is_empty());
    }
    let mut late = Search::new(&scene.contact.target, LIMITS, &scene.u);
    scene.pairing = Pairing::new(before.len());
    scene.contact.pair(&mut late, &good, &mut scene.pairing);
    assert_eq!(named(&scene, &scene.pairing), named(&scene, &before));
}

/// Points in front of their facet have one up to a distance of their own, however far the search reaches for those that lie deep.
#[test]
fn what_lies_deep_does_not_decide_about_what_is_in_front() {
    let facets = |gap: f64, limits: SearchLimits| {
        let scene = on_the_border(gap);
        let mut pairing = Pairing::new(scene.contact.surface.point_count());
        let mut search = Search::new(&scene.contact.target, limits, &scene.u);
        search.pair(scene.contact.sides(), &scene.u, &mut pairing);
        (0..pairing.len()).filter(|point| pairing.facet(*point).is_some()).count()
    };
    let deeper = |below: f64| SearchLimits { reach: LIMITS.ahead + below, ..LIMITS };
    for below in [0.0, 0.2, 0.4] {
        assert_eq!(
            facets(0.9 * LIMITS.ahead, deeper(below)),
            facets(0.5 * LIMITS.ahead, deeper(0.0)),
            "{below}"
        );
        assert_eq!(facets(1.1 * LIMITS.ahead, deeper(below)), 0, "{below}");
    }
    assert!(facets(-0.3, deeper(0.2)) > 0);
}
