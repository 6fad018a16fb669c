//! Mortar contact of two blocks: tangents term by term, action and reaction, patch tests, smooth
//! sliding.

use super::*;
use crate::contact::friction::{FRICTION_LAWS, Friction, Regularization};
use crate::contact::normal::{NORMAL_LAWS, NormalPowerLaw};
use crate::contact::pair_scene::{COMPLIANCE, block, coulomb, frictionless, penalty, target};
use crate::contact::point::TermSelection;
use crate::contact::point::step::stored;
use crate::contact::surface::Ownership;
use crate::mesh::{ElementKind, Mesh, merge};
use crate::taylor::{scatter, taylor_rate};
use crate::tensor::Tensor;

const OVERLAP: f64 = 0.05;
pub const SHIFT: f64 = 3.0;
/// Length of a step of the conserving scheme.
const STEP: f64 = 0.1;
pub const CONTACT_TERMS: [Terms; 7] = [
    Terms::NORMAL_CONTACT,
    Terms::NORMAL_GEOMETRY,
    Terms::FRICTION_DAMPING,
    Terms::FRICTION_NORMAL_COUPLING,
    Terms::COEFFICIENT_CHANGE,
    Terms::FRICTION_GEOMETRY,
    Terms::ZONE_CHANGE,
];

#[derive(Clone)]
pub struct PairScene<const D: usize> {
    pub mesh: Mesh<D>,
    pub contact: VertexContact<D>,
    pub candidates: Candidates<D>,
    pub u: Vec<f64>,
    pub v: Vec<f64>,
    pub u_start: Vec<f64>,
    pub state: ContactState<D>,
}

pub struct Dense<const D: usize> {
    pub force: Vec<f64>,
    pub matrix: Vec<f64>,
}

impl<const D: usize> ContactSink for Dense<D> {
    fn force(&mut self, nodes: &[u32], force: &[f64]) {
        for (&node, force) in nodes.iter().zip(force.chunks_exact(D)) {
            self.force[node as usize * D..][..D].iter_mut().zip(force).for_each(|(sum, f)| *sum += f);
        }
    }

    fn stiffness(&mut self, _: usize, nodes: &[u32], stiffness: &[f64]) {
        let (m, total) = (nodes.len(), self.force.len());
        self.matrix.resize(total * total, 0.0);
        let dof = |local: usize| nodes[local / D] as usize * D + local % D;
        for (r, c) in (0..m * D).flat_map(|r| (0..m * D).map(move |c| (r, c))) {
            self.matrix[dof(r) * total + dof(c)] += stiffness[((r / D * m + c / D) * D + r % D) * D + c % D];
        }
    }
}

impl<const D: usize> PairScene<D> {
    /// The bottom of `upper` on the top of `lower`, at rest.
    fn new(upper: Mesh<D>, lower: Mesh<D>) -> Self {
        let mesh = merge(vec![("lower".to_owned(), lower), ("upper".to_owned(), upper)]).unwrap();
        let mine = vec![true; mesh.element_count()];
        let global: Vec<u32> = (0..mesh.element_count() as u32).collect();
        let ownership = Ownership { owned_nodes: mesh.points.len(), mine: &mine, global_element: &global };
        let opposite = target(&mesh, &["lower.top"]);
        let opposites = opposite.count() as u32;
        let target = ContactTarget::Body(opposite);
        let surface = VertexSurface::new(&mesh, &mesh.facet_sets["upper.bottom"], &ownership, &target);
        let facets = surface.facets().len() as u32;
        let couples = (0..facets).flat_map(|f| (0..opposites).map(move |t| (f, t))).collect();
        let state = ContactState::new(surface.vertices().len());
        let contact = frictionless(surface, target);
        let rest = vec![0.0; mesh.points.len() * D];
        let candidates = contact.candidates_of(couples);
        Self { mesh, contact, candidates, v: rest.clone(), u_start: rest.clone(), u: rest, state }
    }

    /// A block of `upper` elements pressed by the overlap into a wider block of `lower` elements.
    fn pressed(upper: ElementKind, lower: ElementKind) -> Self {
        let upper = block(upper, [0.0, 1.0], [0.0, 1.0], 2);
        let lower = block(lower, [-0.35, 1.25], [-1.0, OVERLAP], 3);
        Self::new(upper, lower)
    }

    /// Both blocks bent and in motion, with tractions from the previous step.
    pub fn bent(upper: ElementKind, lower: ElementKind, law: ContactLaw) -> Self {
        let mut scene = Self::pressed(upper, lower);
        let size = scene.u.len();
        scene.contact.law = law;
        scene.v = scatter(size, 3).iter().map(|v| v * 0.5).collect();
        scene.u = scatter(size, 5).iter().map(|u| u * 0.008).collect();
        scene.u_start = scatter(size, 7).iter().map(|u| u * 0.008).collect();
        scene.evaluate(&ContactRequest::default());
        scene.state.accept(1e-3);
        scene.u = scatter(size, 9).iter().map(|u| u * 0.008).collect();
        scene
    }

    /// The scene with the upper block displaced laterally by `by`.
    fn shifted(mut self, by: f64) -> Self {
        for node in (0..self.mesh.points.len()).filter(|&node| is_upper(&self, node)).collect::<Vec<_>>() {
            self.u[node * D] += by;
            self.u_start[node * D] += by;
        }
        self
    }

    pub fn evaluate(&mut self, request: &ContactRequest) -> Dense<D> {
        let mut dense = Dense { force: vec![0.0; self.u.len()], matrix: Vec::new() };
        let fields = ContactFields { u: &self.u, v: &self.v, u_start: &self.u_start };
        self.contact.evaluate(&self.candidates, &fields, request, &mut self.state, &mut dense);
        dense
    }

    pub fn force_at(&self, u: &[f64], request: &ContactRequest) -> Vec<f64> {
        let mut moved = self.clone();
        // Velocities follow from the displacements as in a time integrator.
        let velocities =
            moved.v.iter().zip(u.iter().zip(&self.u)).map(|(v, (new, old))| v + SHIFT * (new - old));
        moved.v = velocities.collect();
        moved.u = u.to_vec();
        moved.evaluate(request).force
    }

    pub fn matrix(&self, terms: Terms) -> Vec<f64> {
        self.selected(terms, &ContactRequest::default(), None)
    }

    /// The matrix of these terms for a force request. With `joint` it is that of springs no stiffer
    /// than this value.
    pub fn selected(&self, terms: Terms, request: &ContactRequest, joint: Option<f64>) -> Vec<f64> {
        let selection = TermSelection { terms, velocity_shift: SHIFT, joint };
        let mut matrix =
            self.clone().evaluate(&ContactRequest { stiffness: Some(selection), ..*request }).matrix;
        matrix.resize(self.u.len().pow(2), 0.0);
        matrix
    }

    pub fn positions(&self) -> Vec<Vector<D>> {
        let nodes = self.mesh.points.iter().zip(self.u.chunks_exact(D));
        nodes.map(|(x, u)| Vector::<D>::from_row_slice(x) + Vector::<D>::from_row_slice(u)).collect()
    }
}

/// Friction regimes with all vertices well within stick or slip, at the penetrations of the scenes.
pub fn regimes() -> [Regularization; 5] {
    [
        Regularization::stick_velocity(20.0),
        Regularization::stick_velocity(1e-4),
        Regularization::smooth_stick_velocity(0.3),
        Regularization::stick_stiffness(1e3),
        Regularization::stick_stiffness(1e12),
    ]
}

pub fn is_consistent<const D: usize>(scene: &PairScene<D>, what: &str) {
    let rate = rate(scene, Terms::ALL, &ContactRequest::default());
    assert!(rate > 1.9, "{what}: rate {rate}");
}

/// Order of the error of the matrix of these terms as the derivative of the force.
pub fn rate<const D: usize>(scene: &PairScene<D>, terms: Terms, request: &ContactRequest) -> f64 {
    let total = scene.u.len();
    let matrix = scene.selected(terms, request, None);
    let direction: Vec<f64> = scatter(total, 31).iter().map(|d| 1e-4 * d).collect();
    let df = |_: &[f64], d: &[f64]| -> Vec<f64> {
        (0..total).map(|r| -(0..total).map(|c| matrix[r * total + c] * d[c]).sum::<f64>()).collect()
    };
    taylor_rate(|u| scene.force_at(u, request), df, &scene.u, &direction)
}

/// The sum of all terms is minus the derivative of the force. This is checked for every pair of
/// facets without friction, and with friction in every regime and for every law.
#[test]
fn the_tangent_is_the_derivative_of_the_force() {
    let plane = [ElementKind::Quad4, ElementKind::Quad9, ElementKind::Tri6];
    for (upper, lower) in plane.into_iter().flat_map(|a| plane.map(move |b| (a, b))) {
        for area in [AreaKind::Current, AreaKind::Reference] {
            let mut scene = PairScene::<2>::bent(upper, lower, penalty(None));
            scene.contact.area = area;
            is_consistent(&scene, &format!("{upper} on {lower}, {area:?}"));
        }
    }
    let space = [ElementKind::Hex8, ElementKind::Tet4, ElementKind::Hex27, ElementKind::Tet10];
    for (upper, lower) in space.into_iter().zip([space[1], space[0], space[3], space[0]]) {
        is_consistent(&PairScene::<3>::bent(upper, lower, penalty(None)), &format!("{upper} on {lower}"));
    }
    // Segments that are deeper than they are long.
    for shift in [1.17, 1.2, 1.23] {
        let scene = PairScene::<2>::bent(ElementKind::Quad4, ElementKind::Quad4, penalty(None));
        is_consistent(&scene.shifted(shift), &format!("shifted by {shift}"));
        let scene = PairScene::<3>::bent(ElementKind::Hex8, ElementKind::Tet4, penalty(None));
        is_consistent(&scene.shifted(shift), &format!("shifted by {shift} in space"));
    }
    for regularization in regimes() {
        let law = penalty(Some(coulomb(0.4, regularization)));
        is_consistent(
            &PairScene::<2>::bent(ElementKind::Quad4, ElementKind::Quad9, law),
            &format!("{regularization:?}"),
        );
        is_consistent(
            &PairScene::<3>::bent(ElementKind::Hex8, ElementKind::Hex8, law),
            &format!("{regularization:?}"),
        );
    }
    for normal in NORMAL_LAWS.iter().flat_map(|entry| (entry.samples)()) {
        for own in FRICTION_LAWS.iter().flat_map(|entry| (entry.samples)()) {
            let friction = Some(Friction { law: own, regularization: regimes()[2] });
            let scene = PairScene::<2>::bent(
                ElementKind::Quad4,
                ElementKind::Quad4,
                ContactLaw { normal, ..penalty(friction) },
            );
            is_consistent(&scene, &format!("{normal:?}, {own:?}"));
        }
    }
}

/// How far two arrays differ, relative to the largest entry of the second.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    let largest = b.iter().fold(0.0f64, |most, b| most.max(b.abs()));
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / largest
}

/// Linear gaps follow the gaps in first order. At the linearised gaps, forces and matrix are those of a
/// surface that is offset by the difference.
#[test]
fn laws_at_linearised_gaps_are_those_of_an_offset_surface() {
    fn check<const D: usize>(element: ElementKind, regularization: Regularization) {
        let law = penalty(Some(coulomb(0.4, regularization)));
        let mut scene = PairScene::<D>::bent(element, element, law);
        let terms = TermSelection { terms: Terms::ALL, velocity_shift: SHIFT, joint: None };
        scene.evaluate(&ContactRequest { stiffness: Some(terms), ..ContactRequest::default() });
        scene.state.linearise_gaps();
        let linearised = ContactRequest { branches: Branches::Linearised, ..ContactRequest::default() };
        let direction = scatter(scene.u.len(), 13);
        let gaps_at = |size: f64, request: &ContactRequest| -> Vec<f64> {
            let mut moved = scene.clone();
            moved.u.iter_mut().zip(&direction).for_each(|(u, d)| *u += size * d);
            moved.evaluate(request);
            moved.state.current.iter().filter(|point| point.is_closed()).map(|point| point.gap).collect()
        };
        let error = |size| {
            let [linear, true_gaps] = [&linearised, &ContactRequest::default()].map(|r| gaps_at(size, r));
            assert!(!linear.is_empty() && linear.len() == true_gaps.len());
            linear.iter().zip(&true_gaps).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        let (large, small) = (error(4e-4), error(2e-4));
        assert!((large / small).log2() > 1.9 && error(0.0) < 1e-15, "{element}: {large} {small}");

        // Each point has its own difference.
        let points = scene.state.current.clone();
        let offset = |p: usize| 2e-3 * (1.0 + (p % 3) as f64);
        let constant = |(p, point): (usize, &PointState<D>)| point.is_closed().then(|| point.gap - offset(p));
        let mut offset_surface = scene.clone();
        offset_surface.state.forget_linear_gaps();
        offset_surface.state.current.iter_mut().enumerate().for_each(|(p, point)| point.gap = offset(p));
        offset_surface.state.adjust(f64::MAX);
        scene.state.note_linear_gaps(LinearGaps::constant(points.iter().enumerate().map(constant)));
        scene.state.linearise_gaps();
        let force = |scene: &PairScene<D>, request| scene.force_at(&scene.u, request);
        let actual = ContactRequest::default();
        let forces = difference(&force(&scene, &linearised), &force(&offset_surface, &actual));
        let without = difference(&force(&scene, &actual), &force(&offset_surface, &actual));
        let matrices = difference(
            &scene.selected(Terms::ALL, &linearised, None),
            &offset_surface.selected(Terms::ALL, &actual, None),
        );
        assert!(forces < 1e-12 && matrices < 1e-12, "{element}: {forces:e} {matrices:e}");
        assert!(without > 1e-2, "{element}: {without:e}");
    }
    for regularization in [regimes()[0], regimes()[3], regimes()[4]] {
        check::<2>(ElementKind::Quad4, regularization);
        check::<3>(ElementKind::Hex8, regularization);
    }
}

/// Points whose status departs from that of the linearised gap get the force of that status for the
/// next correction: the law's tangent beyond an open gap, or none at a closed one.
#[test]
fn departed_points_are_corrected_by_their_linearised_status() {
    let stick = Regularization::stick_velocity(1e-4);
    let pressed = || PairScene::<2>::pressed(ElementKind::Quad4, ElementKind::Quad4);
    let size = pressed().contact.surface.facets()[0].size;
    let at_height = |height: f64, linear: Option<f64>| {
        let mut scene = pressed();
        scene.contact.law = penalty(Some(coulomb(0.4, stick)));
        for node in (0..scene.mesh.points.len()).filter(|&node| is_upper(&scene, node)).collect::<Vec<_>>() {
            scene.u[2 * node + 1] += height + OVERLAP;
            scene.v[2 * node] = 1.0;
        }
        let points = scene.state.current.len();
        scene.state.note_linear_gaps(LinearGaps::constant((0..points).map(|_| linear)));
        scene.state.linearise_gaps();
        let actual = scene.evaluate(&ContactRequest::default()).force;
        let departed = scene.state.iterate().departed;
        let request = ContactRequest { branches: Branches::Predicted, ..ContactRequest::default() };
        (actual, departed, scene.evaluate(&request).force, points)
    };
    let (none, departed, pulled, points) = at_height(0.01, Some(-0.02));
    assert!(none.iter().all(|force| *force == 0.0) && departed == points);
    let (pushed, departed, same, _) = at_height(-0.01, None);
    assert!(departed == 0 && same == pushed);
    // The weight of open points fades.
    let s = 0.01 / (OPEN * size);
    let weight = 1.0 - s * s * (3.0 - 2.0 * s);
    let opposite: Vec<f64> = pushed.iter().map(|force| -weight * force).collect();
    assert!(difference(&pulled, &opposite) < 1e-12);
    let (pushed, departed, dropped, _) = at_height(-0.01, Some(0.02));
    assert!(pushed.iter().any(|force| *force != 0.0) && departed == points);
    assert!(dropped.iter().all(|force| *force == 0.0));
    // A held bound acts at every gap, and does not hide that the normal law is open.
    let mut scene = pressed();
    scene.evaluate(&ContactRequest::default());
    scene.state.current.iter_mut().for_each(|point| point.bound = 1.0);
    scene.state.freeze(crate::contact::state::Keep::Pressure);
    scene.state.note_linear_gaps(LinearGaps::constant((0..points).map(|_| Some(0.02))));
    scene.state.linearise_gaps();
    let hold = crate::contact::state::Hold::Bound;
    scene.evaluate(&ContactRequest { hold, ..ContactRequest::default() });
    assert_eq!(scene.state.iterate().departed, points);
}

/// Matrix and right side of the next correction have the laws at the same gap: with the slopes of the matrix,
/// the forces at the linearised gaps continue to those of the right side.
#[test]
fn right_sides_continue_the_laws_from_the_linearised_gaps() {
    let height = 0.01;
    let normal = NormalPowerLaw::of(1e9, 2.0).into();
    let friction = Some(coulomb(0.4, Regularization::stick_velocity(1e-4)));
    let mut scene = PairScene::<2>::pressed(ElementKind::Quad4, ElementKind::Quad4);
    scene.contact.law = ContactLaw { normal, ..penalty(friction) };
    let upper = |scene: &PairScene<2>| -> Vec<usize> {
        (0..scene.mesh.points.len()).filter(|&node| is_upper(scene, node)).collect()
    };
    let nodes = upper(&scene);
    nodes.iter().for_each(|node| scene.v[2 * node] = 1.0);
    let gaps: Vec<f64> = scene.state.current.iter().map(|_| -OVERLAP - height).collect();
    scene.state.note_linear_gaps(LinearGaps::constant(gaps.into_iter().map(Some)));
    scene.state.linearise_gaps();
    let at = |scene: &mut PairScene<2>, branches| {
        scene.evaluate(&ContactRequest { branches, ..ContactRequest::default() }).force
    };
    let [linear, predicted] =
        [Branches::Linearised, Branches::Predicted].map(|branches| at(&mut scene.clone(), branches));
    // Of p = c d^2 at the linearised depth d, and its tangent at the depth d - height.
    let depth = OVERLAP + height;
    let continued: Vec<f64> = linear.iter().map(|force| force * (1.0 - 2.0 * height / depth)).collect();
    assert!(difference(&predicted, &continued) < 1e-12);
    assert!(difference(&at(&mut scene.clone(), Branches::Actual), &continued) > 0.01);

    // All points reverse, and the next correction assumes stick. The linear solve then ends all slip: the matrix
    // times the slip is the force.
    scene.evaluate(&ContactRequest::default());
    scene.state.iterate();
    nodes.iter().for_each(|node| scene.v[2 * node] = -1.0);
    scene.evaluate(&ContactRequest::default());
    assert_eq!(scene.state.iterate().flipped, scene.state.current.len());
    let request = ContactRequest { branches: Branches::Linearised, ..ContactRequest::default() };
    let damping = scene.selected(Terms::FRICTION_DAMPING, &request, None);
    let resistance = damping.chunks_exact(scene.v.len());
    let resistance = resistance.map(|row| row.iter().zip(&scene.v).map(|(k, v)| -k * v).sum::<f64>() / SHIFT);
    let resistance: Vec<f64> = resistance.step_by(2).collect();
    let friction: Vec<f64> = at(&mut scene, Branches::Predicted).into_iter().step_by(2).collect();
    assert!(difference(&resistance, &friction) < 1e-12);
}

/// A point that was open in the linear solve has stiffness, but its depth carries no traction under
/// which the geometry changes.
#[test]
fn newly_closed_points_have_no_traction_in_the_tangent() {
    let mut scene = PairScene::<2>::pressed(ElementKind::Quad4, ElementKind::Quad4);
    let request = ContactRequest { branches: Branches::Linearised, ..ContactRequest::default() };
    let largest = |scene: &PairScene<2>, terms| {
        scene.selected(terms, &request, None).iter().fold(0.0f64, |most, entry| most.max(entry.abs()))
    };
    assert!(largest(&scene, Terms::NORMAL_CONTACT) > 0.0);
    assert_eq!(largest(&scene, Terms::NORMAL_GEOMETRY), 0.0);
    // Neither in the iterate that found it closed, nor in one more after a step.
    scene.evaluate(&ContactRequest::default());
    scene.state.iterate();
    assert_eq!(largest(&scene, Terms::NORMAL_GEOMETRY), 0.0);
    scene.state.iterate();
    assert!(largest(&scene, Terms::NORMAL_GEOMETRY) > 0.0);
    scene.state.accept(1e-3);
    assert!(largest(&scene, Terms::NORMAL_GEOMETRY) > 0.0);
}

/// The individual terms add up to the full matrix.
#[test]
fn terms_add_up() {
    let law = penalty(Some(coulomb(0.4, regimes()[0])));
    let scene = PairScene::<3>::bent(ElementKind::Hex8, ElementKind::Hex8, law);
    let whole = scene.matrix(Terms::ALL);
    let mut sum = vec![0.0; whole.len()];
    for terms in CONTACT_TERMS {
        let part = scene.matrix(terms);
        sum.iter_mut().zip(&part).for_each(|(sum, part)| *sum += part);
    }
    let size = whole.iter().fold(0.0_f64, |most, entry| most.max(entry.abs()));
    for (sum, whole) in sum.iter().zip(&whole) {
        assert!((sum - whole).abs() < 1e-12 * size, "{sum} {whole}");
    }
}

fn balances<const D: usize>(scene: &mut PairScene<D>, moment_bound: f64, what: &str) {
    let places = scene.positions();
    let force = scene.evaluate(&ContactRequest::default()).force;
    let forces: Vec<Vector<D>> = force.chunks_exact(D).map(Vector::from_row_slice).collect();
    let size: f64 = forces.iter().map(|f| f.norm()).sum();
    let total: Vector<D> = forces.iter().sum();
    let moment =
        places.iter().zip(&forces).map(|(x, f)| x * f.transpose() - f * x.transpose()).sum::<Tensor<D>>();
    assert!(size > 0.0 && total.norm() < 1e-14 * size, "{what}: {:e}", total.norm() / size);
    assert!(moment.amax() < moment_bound * size, "{what}: {:e}", moment.amax() / size);
}

/// Action equals reaction to rounding, also with friction. Pressures between straight lines and
/// between triangles have no moment.
#[test]
fn action_is_reaction() {
    let friction = penalty(Some(coulomb(0.4, regimes()[1])));
    balances(
        &mut PairScene::<2>::bent(ElementKind::Quad4, ElementKind::Quad4, penalty(None)),
        1e-14,
        "quad4",
    );
    balances(&mut PairScene::<3>::bent(ElementKind::Tet4, ElementKind::Tet4, penalty(None)), 1e-14, "tet4");
    balances(&mut PairScene::<3>::bent(ElementKind::Hex8, ElementKind::Hex8, penalty(None)), 1e-2, "hex8");
    balances(
        &mut PairScene::<2>::bent(ElementKind::Quad9, ElementKind::Quad4, friction),
        0.1,
        "quad9, friction",
    );
    balances(
        &mut PairScene::<3>::bent(ElementKind::Hex27, ElementKind::Tet10, friction),
        0.1,
        "hex27, friction",
    );
}

fn presses_evenly<const D: usize>(upper: ElementKind, lower: ElementKind, shift: f64) {
    let mut scene = PairScene::<D>::pressed(upper, lower);
    // The contactor overhangs the end of the target by this length.
    let count = scene.mesh.points.len();
    for element in (0..scene.mesh.element_count()).filter(|&e| scene.mesh.body[e] == 1) {
        for &node in scene.mesh.element_nodes(element) {
            scene.u[node as usize * D] = shift;
        }
    }
    let force = scene.evaluate(&ContactRequest::default()).force;
    let pressure = OVERLAP / COMPLIANCE;
    for (vertex, point) in scene.state.current.iter().enumerate() {
        if point.area > 0.0 {
            assert!((point.gap + OVERLAP).abs() < 1e-14, "{upper} on {lower}: {}", point.gap);
            assert!((point.normal_traction / pressure - 1.0).abs() < 1e-12, "{vertex}");
        }
    }
    let covered = (1.25 - shift).min(1.0) * 1.0_f64.powi(D as i32 - 2);
    let up: f64 = (0..count)
        .filter(|&node| scene.mesh.points[node][D - 1] >= 0.0 && is_upper(&scene, node))
        .map(|n| force[n * D + D - 1])
        .sum();
    assert!((up / (pressure * covered) - 1.0).abs() < 1e-12, "{upper} on {lower}: {up:e}");
}

fn is_upper<const D: usize>(scene: &PairScene<D>, node: usize) -> bool {
    (0..scene.mesh.element_count())
        .any(|e| scene.mesh.body[e] == 1 && scene.mesh.element_nodes(e).contains(&(node as u32)))
}

/// Flat surfaces with different meshes have equal gap and pressure at every vertex. The resultant
/// is pressure times covered area, also if the contactor overhangs its target.
#[test]
fn flat_surfaces_press_evenly() {
    let plane =
        [ElementKind::Tri3, ElementKind::Tri6, ElementKind::Quad4, ElementKind::Quad8, ElementKind::Quad9];
    for (upper, lower) in plane.into_iter().flat_map(|a| plane.map(move |b| (a, b))) {
        [0.0, 0.45, 0.6].into_iter().for_each(|shift| presses_evenly::<2>(upper, lower, shift));
    }
    let space = [
        ElementKind::Tet4,
        ElementKind::Tet10,
        ElementKind::Hex8,
        ElementKind::Hex20,
        ElementKind::Hex27,
        ElementKind::Wedge6,
        ElementKind::Pyramid5,
    ];
    for (upper, lower) in space.into_iter().flat_map(|a| space.map(move |b| (a, b))) {
        [0.0, 0.45].into_iter().for_each(|shift| presses_evenly::<3>(upper, lower, shift));
    }
}

/// When a bumpy block slides over another one, the forces are continuously differentiable: second
/// differences decrease with the square of the step.
#[test]
fn forces_are_smooth_along_a_slide() {
    fn roughness<const D: usize>(steps: usize) -> f64 {
        let kind = if D == 2 { ElementKind::Quad4 } else { ElementKind::Hex8 };
        let mut scene = PairScene::<D>::pressed(kind, kind);
        scene.u = scatter(scene.u.len(), 5).iter().map(|u| u * 0.01).collect();
        let start = scene.u.clone();
        let force = |part: f64| {
            let mut moved = scene.clone();
            for element in (0..moved.mesh.element_count()).filter(|&e| moved.mesh.body[e] == 1) {
                for &node in moved.mesh.element_nodes(element) {
                    moved.u[node as usize * D] = start[node as usize * D] + 0.2 * part;
                }
            }
            moved.evaluate(&ContactRequest::default()).force
        };
        let path: Vec<Vec<f64>> = (0..=steps).map(|k| force(k as f64 / steps as f64)).collect();
        let size = path[0].iter().map(|f| f.abs()).sum::<f64>();
        let bend = |w: &[Vec<f64>]| {
            (0..w[0].len()).map(|i| (w[0][i] - 2.0 * w[1][i] + w[2][i]).abs()).fold(0.0, f64::max)
        };
        path.windows(3).map(bend).fold(0.0, f64::max) / size
    }
    let plane = [200, 400].map(roughness::<2>);
    assert!(plane[0] / plane[1] > 3.5, "{plane:?}");
    let space = [60, 120].map(roughness::<3>);
    assert!(space[0] / space[1] > 3.5, "{space:?}");
}

/// Energy that the vertices store at the displacements `u`: area times potential.
pub fn stored_energy<const D: usize>(scene: &PairScene<D>, u: &[f64]) -> f64 {
    let mut at = scene.clone();
    at.u = u.to_vec();
    at.evaluate(&ContactRequest::default());
    at.state.current.iter().filter(|point| point.is_closed()).map(|point| point.area * point.potential).sum()
}

pub fn conserves<const D: usize>(upper: ElementKind, lower: ElementKind, law: ContactLaw, size: f64) {
    let what = format!("{upper} on {lower}, motion {size}");
    let mut scene = PairScene::<D>::bent(upper, lower, law);
    scene.contact.area = AreaKind::Reference;
    let step = scatter(scene.u.len(), 11);
    scene.u_start = scene.u.iter().zip(&step).map(|(u, d)| u - 0.5 * size * d).collect();
    let end: Vec<f64> = scene.u.iter().zip(&step).map(|(u, d)| u + 0.5 * size * d).collect();
    let [before, after] = [&scene.u_start, &end].map(|u| stored_energy(&scene, u));
    let held: f64 = {
        let mut at = scene.clone();
        at.u = scene.u_start.clone();
        at.evaluate(&ContactRequest::default());
        let history = &scene.state.history;
        let areas = at.state.current.iter().map(|point| point.area);
        areas.zip(history).map(|(area, own)| area * stored(&law, &own.friction_traction)).sum()
    };
    let places = scene.positions();
    let request = ContactRequest { over_step: true, step: STEP, ..ContactRequest::default() };
    let force = scene.evaluate(&request).force;
    let work: f64 = force.iter().zip(&step).map(|(f, d)| f * size * d).sum();
    let sum = |value: &dyn Fn(&PointState<D>) -> f64| -> f64 {
        scene.state.current.iter().map(|point| point.area * value(point)).sum()
    };
    let heat = sum(&|point| point.plastic_work + point.damping_work);
    let stick = sum(&|point| point.recoverable);
    let balance = work + (after - before) + heat + (stick - held);
    let scale = force.iter().zip(&step).map(|(f, d)| (f * size * d).abs()).sum::<f64>();
    // The change of energy is known only to the rounding error of the energy.
    let rounding = 1e-12 * scale + 1e-14 * before;
    assert!(balance.abs() < rounding, "{what}: energy {balance:e} of {scale:e}");
    let forces: Vec<Vector<D>> = force.chunks_exact(D).map(Vector::from_row_slice).collect();
    let total: Vector<D> = forces.iter().sum();
    let moments = places.iter().zip(&forces).map(|(x, f)| x * f.transpose() - f * x.transpose());
    let moment = moments.sum::<Tensor<D>>().amax();
    let size: f64 = forces.iter().map(|f| f.norm()).sum();
    assert!(size > 0.0 && total.norm() < 1e-13 * size, "{what}: resultant {:e}", total.norm() / size);
    assert!(moment < 1e-12 * size, "{what}: moment {:e}", moment / size);
}

/// Forces over a step do work equal to the decrease of contact energy minus frictional heat. They
/// have neither resultant nor moment. This is checked for small and large motions, with and without
/// friction, on flat and bent facets.
#[test]
fn forces_over_a_step_conserve_energy_and_momentum() {
    let friction = penalty(Some(coulomb(0.4, regimes()[3])));
    for size in [1e-6, 1e-3, 3e-2, 0.1] {
        for law in [penalty(None), friction] {
            conserves::<2>(ElementKind::Quad4, ElementKind::Quad4, law, size);
            conserves::<2>(ElementKind::Quad9, ElementKind::Tri6, law, size);
            conserves::<3>(ElementKind::Hex8, ElementKind::Tet4, law, size);
            conserves::<3>(ElementKind::Hex20, ElementKind::Hex8, law, size);
        }
    }
}

fn error_of_bent<const D: usize>(kind: ElementKind, law: ContactLaw, bend: f64, terms: Terms) -> f64 {
    let mut scene = PairScene::<D>::bent(kind, kind, law);
    scene.u.iter_mut().for_each(|u| *u *= bend);
    error_over_step(scene, terms)
}

/// Error of the matrix over a step in one direction, relative to the derivative of the force.
pub fn error_over_step<const D: usize>(mut scene: PairScene<D>, terms: Terms) -> f64 {
    scene.contact.area = AreaKind::Reference;
    scene.v.fill(0.0);
    let step = scatter(scene.u.len(), 11);
    scene.u_start = scene.u.iter().zip(&step).map(|(u, d)| u - 5e-5 * d).collect();
    let total = scene.u.len();
    let selection = TermSelection { terms, velocity_shift: 0.0, joint: None };
    let over_step = ContactRequest { over_step: true, step: STEP, ..ContactRequest::default() };
    let request = ContactRequest { stiffness: Some(selection), ..over_step };
    let matrix = scene.clone().evaluate(&request).matrix;
    let direction = scatter(total, 17);
    let force = |part: f64| {
        let mut moved = scene.clone();
        moved.u.iter_mut().zip(&direction).for_each(|(u, d)| *u += part * d);
        moved.evaluate(&over_step).force
    };
    let [ahead, behind] = [force(1e-6), force(-1e-6)];
    let slope: Vec<f64> = ahead.iter().zip(&behind).map(|(a, b)| (b - a) / 2e-6).collect();
    let found = (0..total).map(|r| (0..total).map(|c| matrix[r * total + c] * direction[c]).sum::<f64>());
    let error: f64 = found.zip(&slope).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    error / slope.iter().map(|s| s * s).sum::<f64>().sqrt()
}

/// The matrix over a step is the derivative of the force for flat surfaces with uniform pressure,
/// and within one percent for bent surfaces. Without the geometric stiffness it is not.
#[test]
fn the_matrix_over_a_step_is_near_the_derivative() {
    let stick = penalty(Some(coulomb(0.4, regimes()[3])));
    for law in [penalty(None), stick] {
        for (bend, least, most) in [(0.0, 0.0, 1e-5), (1.0, 1e-4, 0.01)] {
            let plane = |terms| error_of_bent::<2>(ElementKind::Quad4, law, bend, terms);
            let space = |terms| error_of_bent::<3>(ElementKind::Hex8, law, bend, terms);
            let found = [plane(Terms::ALL), space(Terms::ALL)];
            assert!(found.iter().all(|error| (least..most).contains(error)), "bend {bend}: {found:?}");
            let less = Terms::ALL - Terms::NORMAL_GEOMETRY;
            assert!(plane(less) > 0.05 && space(less) > 0.3, "{} {}", plane(less), space(less));
        }
    }
}

/// A sliver of a corner deep behind a side has no pressure. A sliver half as deep as it is long has
/// the full pressure.
#[test]
fn a_sliver_deeper_than_long_does_not_press() {
    let force = |sunk: f64| -> f64 {
        let upper = block(ElementKind::Quad4, [0.0, 1.0], [0.0, 1.0], 2);
        let lower = block(ElementKind::Quad4, [-1.0, 0.001], [-1.0, sunk], 2);
        let mut scene = PairScene::<2>::new(upper, lower);
        scene.evaluate(&ContactRequest::default());
        scene.state.current.iter().map(|point| point.area * point.normal_traction).sum()
    };
    let stiffness = 0.001 / COMPLIANCE;
    for sunk in [1e-5, 4.9e-4] {
        assert!((force(sunk) / (sunk * stiffness) - 1.0).abs() < 1e-9, "{}", force(sunk));
    }
    assert!(force(1e-3) > 0.0 && force(1e-3) < 1e-3 * stiffness);
    assert_eq!([2.1e-3, 0.1].map(force), [0.0; 2]);
}

/// The depth of a covered part that is shorter than half of it is ignored, alone or beside a covered
/// facet. Otherwise it counts.
#[test]
fn a_sliver_deeper_than_long_has_no_depth() {
    const SHALLOW: f64 = 1e-6;
    let deepest = |start: f64, long: f64, deep: f64| -> f64 {
        let body = |across: [f64; 2], top: f64| block(ElementKind::Quad4, across, [-1.0, top], 2);
        let [beside, sliver] = [body([start, 0.5], SHALLOW), body([0.5, 0.5 + long], deep)];
        let mut lower = merge(vec![("a".to_owned(), beside), ("b".to_owned(), sliver)]).unwrap();
        let top = ["a.top", "b.top"].map(|set| lower.facet_sets[set].clone()).concat();
        lower.facet_sets.insert("top".to_owned(), top);
        let upper = block(ElementKind::Quad4, [0.0, 1.0], [0.0, 1.0], 2);
        let mut scene = PairScene::<2>::new(upper, lower);
        scene.evaluate(&ContactRequest::default());
        scene.state.current.iter().map(|point| point.sunk).fold(0.0, f64::max)
    };
    for (start, rest) in [(-1.0, SHALLOW), (0.499_999_9, 0.0)] {
        assert!((deepest(start, 1e-3, 0.1) - rest).abs() < 1e-9, "{}", deepest(start, 1e-3, 0.1));
        for (long, deep) in [(1e-3, 1e-3), (0.2, 0.1)] {
            assert!((deepest(start, long, deep) - deep).abs() < 1e-9, "{}", deepest(start, long, deep));
        }
    }
}

/// A fully covered vertex presses according to its depth, also if several facets cover it.
#[test]
fn what_is_covered_presses_however_deep() {
    for sunk in [0.05, 0.1, 0.2] {
        let upper = block(ElementKind::Quad4, [0.0, 1.0], [0.0, 1.0], 20);
        let lower = block(ElementKind::Quad4, [-0.5, 1.5], [-1.0, sunk], 33);
        let mut scene = PairScene::<2>::new(upper, lower);
        scene.evaluate(&ContactRequest::default());
        let points = &scene.state.current;
        assert!(points.iter().all(|point| (point.gap + sunk).abs() < 1e-12), "{sunk}");
    }
}
