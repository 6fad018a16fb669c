//! The point kernel over a step: its work, its resultant and moment, its tangent.

use super::step::{Fields, StepGeometry, StepMotion, StepResponse, respond_over_step};
use super::{ContactLaw, Manner, Selection};
use crate::contact::curvature::Curvature;
use crate::contact::friction::coefficient::{Coefficient, Constant};
use crate::contact::friction::{Coulomb, Friction, FrictionLaw, Regularization};
use crate::contact::geometry::{AreaMeasure, FacetPoint, Geometry};
use crate::contact::history::History;
use crate::contact::normal::{NormalLaw, Penalty, PowerLaw};
use crate::contact::obstacle::{OBSTACLES, Obstacle};
use crate::mesh::ElementKind;
use crate::space::{Table, reference};
use crate::taylor::{scatter, taylor_rate};
use crate::tensor::Vector;
use crate::terms::Terms;

const AREA: f64 = 0.3;
const STEP: f64 = 0.01;

/// A point of a facet and the obstacle that it moves towards.
struct Scene<const D: usize> {
    obstacle: Obstacle<D>,
    table: Table,
    start: Vec<Vector<D>>,
    middle: Vec<Vector<D>>,
    law: ContactLaw,
    history: History<D>,
}

fn vectors<const D: usize>(count: usize, seed: u32, size: f64) -> Vec<Vector<D>> {
    scatter(count * D, seed).chunks_exact(D).map(|c| Vector::from_column_slice(c) * size).collect()
}

fn laws() -> [NormalLaw; 2] {
    [NormalLaw::Penalty(Penalty::new(1e-6).unwrap()), NormalLaw::PowerLaw(PowerLaw::new(1e8, 1.7).unwrap())]
}

fn rubbing(regularization: Regularization) -> Option<Friction> {
    let coefficient = Coefficient::Constant(Constant::new(0.4).unwrap());
    Some(Friction { law: FrictionLaw::Coulomb(Coulomb { coefficient }), regularization })
}

fn frictions() -> [Option<Friction>; 4] {
    [
        None,
        rubbing(Regularization::StickVelocity { velocity: 1e-2 }),
        rubbing(Regularization::SmoothStickVelocity { velocity: 10.0 }),
        rubbing(Regularization::StickStiffness { stiffness: 1e6 }),
    ]
}

impl<const D: usize> Scene<D> {
    /// On the `obstacle` a facet of `kind` that goes from the gap `from` to about the gap `to`, all nodes moving their own way besides.
    fn new(kind: ElementKind, obstacle: Obstacle<D>, law: ContactLaw, [from, to]: [f64; 2]) -> Self {
        let element = reference(kind);
        let table = element.tabulate(element.gauss_contact_rule());
        let place = |p: &[f64; 3]| {
            Vector::<D>::from_fn(|i, _| if i + 1 < D { 0.2 * p[i] } else { 0.01 * p[0] * p[0] })
        };
        let mut start: Vec<Vector<D>> = reference(kind).node_coordinates().iter().map(place).collect();
        start.iter_mut().zip(vectors::<D>(9, 3, 0.01)).for_each(|(x, bend)| *x += bend);
        start.iter_mut().for_each(|x| *x += Vector::from_fn(|i, _| 0.3 + 0.2 * i as f64));
        let mut scene =
            Self { obstacle, table, middle: start.clone(), start, law, history: History::default() };
        for _ in 0..4 {
            let here = scene.at(&scene.start);
            let shift = here.normal * (from - here.gap);
            scene.start.iter_mut().for_each(|x| *x += shift);
        }
        let normal = scene.at(&scene.start).normal;
        scene.history.gap = scene.at(&scene.start).gap;
        scene.history.counted = scene.history.gap;
        scene.history.normal = normal;
        let along = Vector::from_fn(|i, _| if i == 0 { 0.02 } else { 0.01 });
        let common = along + normal * (0.5 * (to - from) - normal.dot(&along));
        let motion = vectors::<D>(scene.start.len(), 11, 2e-4);
        scene.middle = (0..motion.len()).map(|k| scene.start[k] + motion[k] + common).collect();
        scene
    }

    fn at(&self, nodes: &[Vector<D>]) -> Geometry<D> {
        let (last, count) = (self.table.points - 1, self.table.nodes);
        let point = FacetPoint {
            shape: &self.table.n[last * count..],
            gradient: &self.table.dn[last * count * (D - 1)..],
            weight: self.table.weights[last],
        };
        let x = point.position(nodes);
        let mut geometry = Geometry::default();
        geometry.against_obstacle(&point, &self.obstacle.proximity(&x));
        geometry.with_area(&point, nodes, AreaMeasure::Reference(AREA));
        geometry
    }

    fn increments(&self, middle: &[Vector<D>]) -> Vec<Vector<D>> {
        middle.iter().zip(&self.start).map(|(x, start)| x - start).collect()
    }

    fn velocities(&self, middle: &[Vector<D>]) -> Vec<Vector<D>> {
        self.increments(middle).iter().map(|u| u * (2.0 / STEP)).collect()
    }

    fn end(&self, middle: &[Vector<D>]) -> Geometry<D> {
        self.at(&middle.iter().zip(&self.start).map(|(x, start)| x * 2.0 - start).collect::<Vec<_>>())
    }

    fn respond(&self, middle: &[Vector<D>]) -> (StepResponse<D>, Geometry<D>) {
        let (increment, velocity) = (self.increments(middle), self.velocities(middle));
        let here = self.at(middle);
        let motion = StepMotion {
            middle: &here,
            end: self.end(middle).gap,
            start: self.at(&self.start).gap,
            fields: Fields { velocity: &velocity, increment: &increment },
            history: &self.history,
        };
        (respond_over_step(&self.law, &motion, &Manner::default()), here)
    }

    fn force(&self, middle: &[Vector<D>]) -> Vec<f64> {
        let (response, here) = self.respond(middle);
        let mut force = vec![0.0; middle.len() * D];
        response.add_force(&here, &mut force);
        force
    }

    fn curvature(&self, middle: &[Vector<D>]) -> Curvature<D> {
        let (last, count) = (self.table.points - 1, self.table.nodes);
        let shape = &self.table.n[last * count..];
        let x: Vector<D> = middle.iter().zip(shape).map(|(x, n)| x * *n).sum();
        Curvature::of_obstacle(&self.obstacle.proximity(&x))
    }

    fn stiffness(&self, middle: &[Vector<D>], selection: &Selection) -> Vec<f64> {
        let (increment, velocity) = (self.increments(middle), self.velocities(middle));
        let (response, here) = self.respond(middle);
        let (there, curvature) = (self.end(middle), self.curvature(middle));
        let count = middle.len();
        let mut stiffness = vec![0.0; count * count * D * D];
        let geometry = StepGeometry { middle: &here, end: &there, curvature: &curvature };
        let fields = Fields { velocity: &velocity, increment: &increment };
        response.add_stiffness(&geometry, &fields, selection, &mut stiffness);
        stiffness
    }

    fn stiffness_times(&self, middle: &[Vector<D>], d: &[f64], terms: Terms) -> Vec<f64> {
        let selection = Selection { terms, velocity_shift: 2.0 / STEP, joint: None };
        let (count, stiffness) = (middle.len(), self.stiffness(middle, &selection));
        let entry = |r: usize, c: usize| stiffness[((r / D * count + c / D) * D + r % D) * D + c % D];
        (0..count * D).map(|r| -(0..count * D).map(|c| entry(r, c) * d[c]).sum::<f64>()).collect()
    }

    /// Order of the tangent.
    fn rate(&self, terms: Terms) -> f64 {
        let places =
            |x: &[f64]| -> Vec<Vector<D>> { x.chunks_exact(D).map(Vector::from_column_slice).collect() };
        let at: Vec<f64> = self.middle.iter().flat_map(|x| x.iter().copied().collect::<Vec<_>>()).collect();
        let d: Vec<f64> = scatter(at.len(), 17).iter().map(|x| 1e-4 * x).collect();
        taylor_rate(|x| self.force(&places(x)), |x, d| self.stiffness_times(&places(x), d, terms), &at, &d)
    }
}

/// Closing, opening, pressing on.
const MOTIONS: [[f64; 2]; 4] = [[2e-3, -3e-3], [-3e-3, 2e-3], [-2e-3, -4e-3], [-4e-3, -2e-3]];

fn motions_by_every_law() -> impl Iterator<Item = (NormalLaw, Option<Friction>, [f64; 2])> {
    let moved = |n, f| MOTIONS.into_iter().map(move |gaps| (n, f, gaps));
    laws().into_iter().flat_map(move |n| frictions().into_iter().flat_map(move |f| moved(n, f)))
}

fn conserves<const D: usize>(kind: ElementKind, obstacle: Obstacle<D>, lags: bool) {
    for (normal, friction, gaps) in motions_by_every_law() {
        let mut scene = Scene::<D>::new(kind, obstacle, ContactLaw { normal, friction }, gaps);
        if lags {
            // The gap that counts is not the one that there is.
            scene.history.counted -= 5e-4;
        }
        let (response, _) = scene.respond(&scene.middle);
        let there = scene.end(&scene.middle);
        let state = response.state;
        assert!(state.normal_traction > 0.0 && (there.gap - gaps[1]).abs() < 2e-3, "{gaps:?}: {}", there.gap);
        let force = scene.force(&scene.middle);
        let moved: Vec<f64> = scene
            .increments(&scene.middle)
            .iter()
            .flat_map(|u| (2.0 * u).iter().copied().collect::<Vec<_>>())
            .collect();
        let work: f64 = force.iter().zip(&moved).map(|(f, u)| f * u).sum();
        let gained = state.potential - normal.evaluate(scene.history.counted).potential + state.recoverable;
        let (what, size) = (
            format!("{kind} {D}D {obstacle:?} {normal:?} {friction:?} {gaps:?}"),
            AREA * state.normal_traction * 1e-2,
        );
        assert!((work + AREA * (gained + state.plastic_work)).abs() < 1e-7 * size, "{what}: {work} {gained}");
        assert!(state.plastic_work >= 0.0, "{what}");
    }
}

/// Over a step the work of a point's force is what its potential, its elastic stick and its heat take; with and without friction,
/// closing, opening and closed.
#[test]
fn force_over_a_step_conserves() {
    for (entry, lags) in OBSTACLES.iter().flat_map(|entry| [(entry, false), (entry, true)]) {
        let line = |obstacle| conserves::<2>(ElementKind::Line2, obstacle, lags);
        let quad = |obstacle| conserves::<3>(ElementKind::Quad4, obstacle, lags);
        (entry.samples_2d)().into_iter().for_each(line);
        (entry.samples_3d)().into_iter().for_each(quad);
    }
}

const SINGLES: [Terms; 5] = [
    Terms::NORMAL_CONTACT,
    Terms::NORMAL_GEOMETRY,
    Terms::FRICTION_DAMPING,
    Terms::FRICTION_NORMAL_COUPLING,
    Terms::FRICTION_GEOMETRY,
];

fn derivatives<const D: usize>(kind: ElementKind, obstacle: Obstacle<D>, lag: f64) {
    let mut needed = [false; SINGLES.len()];
    for (normal, friction, gaps) in motions_by_every_law() {
        let mut scene = Scene::<D>::new(kind, obstacle, ContactLaw { normal, friction }, gaps);
        scene.history.counted -= lag;
        let rate = scene.rate(Terms::ALL);
        assert!(rate > 1.9, "{kind} {D}D {obstacle:?} {normal:?} {friction:?} {gaps:?}: {rate}");
        for (needed, term) in needed.iter_mut().zip(SINGLES) {
            *needed |= scene.rate(Terms::ALL - term) < 1.5;
        }
    }
    let flat = matches!(obstacle, Obstacle::Plane(_));
    for (needed, term) in needed.iter().zip(SINGLES) {
        let geometric = term == Terms::NORMAL_GEOMETRY || term == Terms::FRICTION_GEOMETRY;
        assert!(*needed || flat && geometric, "{kind} {D}D {obstacle:?}: {term:?} says nothing");
    }
}

/// The tangent over a step is the derivative by the middle of the step, with and without friction, on obstacles, for every kind of facet;
/// and none of its terms can be left out.
#[test]
fn tangent_over_a_step_has_order_two() {
    let lines = [ElementKind::Line2, ElementKind::Line3];
    let faces =
        [ElementKind::Tri3, ElementKind::Tri6, ElementKind::Quad4, ElementKind::Quad8, ElementKind::Quad9];
    for entry in OBSTACLES {
        for (obstacle, kind) in (entry.samples_2d)().into_iter().flat_map(|o| lines.map(|kind| (o, kind))) {
            derivatives::<2>(kind, obstacle, 0.0);
        }
        for (obstacle, kind) in (entry.samples_3d)().into_iter().flat_map(|o| faces.map(|kind| (o, kind))) {
            derivatives::<3>(kind, obstacle, 0.0);
        }
        (entry.samples_2d)().into_iter().for_each(|o| derivatives::<2>(ElementKind::Line2, o, 1e-3));
    }
}

fn joins<const D: usize>(kind: ElementKind, plane: Obstacle<D>) {
    for (normal, friction, gaps) in motions_by_every_law() {
        let scene = Scene::<D>::new(kind, plane, ContactLaw { normal, friction }, gaps);
        let terms = Terms::NORMAL_CONTACT | Terms::FRICTION_DAMPING;
        let springs =
            |joint| scene.stiffness(&scene.middle, &Selection { terms, velocity_shift: 2.0 / STEP, joint });
        let (whole, expected) = (springs(Some(f64::INFINITY)), springs(None));
        let largest = expected.iter().fold(0.0f64, |most, k| most.max(k.abs()));
        assert!(largest > 0.0);
        for (spring, term) in whole.iter().zip(&expected) {
            assert!((spring - term).abs() <= 1e-12 * largest, "{kind} {normal:?} {friction:?} {gaps:?}");
        }
        let limit = 1e-3 * largest / AREA;
        let softer = springs(Some(limit)).iter().fold(0.0f64, |most, k| most.max(k.abs()));
        assert!(softer <= 2.0 * AREA * limit, "{kind} {normal:?} {friction:?} {gaps:?}: {softer:e}");
    }
}

/// On a plane, where nothing turns, the springs for multigrid are K_CN and K_T over the step, and no stiffer than asked.
#[test]
fn joints_over_a_step_are_the_terms_on_a_plane() {
    let flat = |obstacle: &Obstacle<2>| matches!(obstacle, Obstacle::Plane(_));
    let solid = |obstacle: &Obstacle<3>| matches!(obstacle, Obstacle::Plane(_));
    for entry in OBSTACLES {
        (entry.samples_2d)().into_iter().filter(flat).for_each(|plane| joins::<2>(ElementKind::Line2, plane));
        (entry.samples_3d)()
            .into_iter()
            .filter(solid)
            .for_each(|plane| joins::<3>(ElementKind::Quad4, plane));
    }
}
