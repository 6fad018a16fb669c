//! Whole surfaces against obstacles: resultants, counts, energies, tangents, and extremes of the numbers.

use std::cell::RefCell;

use super::friction::coefficient::{COEFFICIENTS, Coefficient, Constant, GroschSchallamach};
use super::friction::regularization::REGULARIZATIONS;
use super::friction::{Coulomb, FRICTION_LAWS, Friction, FrictionLaw, PowerLaw, Regularization};
use super::normal::{NORMAL_LAWS, NormalLaw, Penalty, PowerLaw as NormalPowerLaw};
use super::obstacle::{Obstacle, Plane, Side, Sphere};
use super::point::{ContactLaw, Selection, Status};
use super::rigid::{AreaKind, ContactFields, ContactRequest, ContactSink, RigidContact};
use super::state::{ContactState, Hold, Keep};
use super::surface::{ContactSurface, Ownership, Quadrature};
use crate::mesh::{BoxShape, ElementKind, Mesh};
use crate::space::reference;
use crate::taylor::{scatter, taylor_rate};
use crate::tensor::Vector;
use crate::terms::Terms;

const COMPLIANCE: f64 = 1e-8;
const OVERLAP: f64 = 1e-3;

/// Adds everything up into a dense force and matrix.
#[derive(Default)]
struct Dense {
    force: Vec<f64>,
    matrix: Vec<f64>,
    calls: usize,
}

struct DenseSink<'a, const D: usize>(&'a mut Dense);

impl<const D: usize> ContactSink for DenseSink<'_, D> {
    fn facet(&mut self, _: usize, nodes: &[u32], force: &[f64], stiffness: Option<&[f64]>) {
        self.0.calls += 1;
        let (m, total) = (nodes.len(), self.0.force.len());
        let dof = |local: usize| nodes[local / D] as usize * D + local % D;
        force.iter().enumerate().for_each(|(r, f)| self.0.force[dof(r)] += f);
        let Some(stiffness) = stiffness else { return };
        self.0.matrix.resize(total * total, 0.0);
        for (r, c) in (0..m * D).flat_map(|r| (0..m * D).map(move |c| (r, c))) {
            let entry = stiffness[((r / D * m + c / D) * D + r % D) * D + c % D];
            self.0.matrix[dof(r) * total + dof(c)] += entry;
        }
    }
}

fn unit_box<const D: usize>(element: ElementKind) -> Mesh<D> {
    BoxShape { min: [0.0; D], max: [1.0; D], cells: [2; D], element }.mesh().unwrap()
}

/// The bottom of the mesh, all of it on one rank.
fn bottom<const D: usize>(mesh: &Mesh<D>, quadrature: Quadrature) -> ContactSurface<D> {
    let mine = vec![true; mesh.element_count()];
    let global: Vec<u32> = (0..mesh.element_count() as u32).collect();
    let ownership = Ownership { owned_nodes: mesh.points.len(), mine: &mine, global_element: &global };
    ContactSurface::new(mesh, &mesh.facet_sets["bottom"], &ownership, quadrature).unwrap()
}

fn floor<const D: usize>(height: f64) -> Obstacle<D> {
    let up = Vector::from_fn(|i, _| f64::from(i + 1 == D));
    Obstacle::Plane(Plane::new(up * height, up).unwrap())
}

fn coulomb(mu: f64, regularization: Regularization) -> Friction {
    let coefficient = Coefficient::Constant(Constant::new(mu).unwrap());
    Friction { law: FrictionLaw::Coulomb(Coulomb { coefficient }), regularization }
}

fn penalty_law(friction: Option<Friction>) -> ContactLaw {
    ContactLaw { normal: NormalLaw::Penalty(Penalty::new(COMPLIANCE).unwrap()), friction }
}

fn contact<const D: usize>(
    mesh: &Mesh<D>,
    quadrature: Quadrature,
    friction: Option<Friction>,
) -> RigidContact<D> {
    let surface = bottom(mesh, quadrature);
    RigidContact { surface, obstacle: floor(OVERLAP), law: penalty_law(friction), area: AreaKind::Current }
}

fn evaluate<const D: usize>(
    contact: &RigidContact<D>,
    (u, v): (&[f64], &[f64]),
    request: &ContactRequest,
    state: &mut ContactState<D>,
) -> Dense {
    let start = vec![0.0; u.len()];
    let mut dense = Dense { force: vec![0.0; u.len()], ..Dense::default() };
    let fields = ContactFields { u, v, u_start: &start };
    contact.evaluate(&fields, request, state, &mut DenseSink::<D>(&mut dense));
    dense
}

fn patch<const D: usize>(element: ElementKind, quadrature: Quadrature) {
    let mesh = unit_box::<D>(element);
    let contact = contact(&mesh, quadrature, None);
    let mut state = ContactState::new(contact.surface.point_count());
    let rest = vec![0.0; mesh.points.len() * D];
    let dense = evaluate(&contact, (&rest, &rest), &ContactRequest::default(), &mut state);
    let summary = contact.surface.summary(&state);
    let expected = OVERLAP / COMPLIANCE;
    assert!((summary.normal_force / expected - 1.0).abs() < 1e-12, "{element:?} {quadrature:?}");
    assert!((summary.area - 1.0).abs() < 1e-12);
    assert!((summary.max_pressure / expected - 1.0).abs() < 1e-12);
    assert!((summary.max_penetration / OVERLAP - 1.0).abs() < 1e-12);
    let nodal: f64 = dense.force.chunks_exact(D).map(|f| f[D - 1]).sum();
    assert!((nodal / expected - 1.0).abs() < 1e-12);
    let nodes = mesh.set_nodes("bottom").unwrap().len();
    let counted = if quadrature == Quadrature::Nodal { nodes } else { contact.surface.point_count() };
    assert_eq!((summary.points, summary.slip, summary.stick), (counted, counted, 0), "{element:?}");
    assert!((contact.surface.energy(&state, 1.0).stored / (0.5 * expected * OVERLAP) - 1.0).abs() < 1e-12);
    let (mut sum, mut weight) = (vec![0.0; mesh.points.len()], vec![0.0; mesh.points.len()]);
    contact.surface.gather_nodal(&state, |_, p| [p.normal_traction], (&mut sum, &mut weight));
    for node in mesh.set_nodes("bottom").unwrap() {
        assert!((sum[node as usize] / weight[node as usize] / expected - 1.0).abs() < 1e-12);
    }
}

/// A block with any elements pressed on a plane: force, area, pressure, energy are exact, each node counts once.
#[test]
fn flat_patch_is_exact_for_every_element() {
    for element in ElementKind::SOLIDS {
        let nodal = reference(element.facet_kind()).nodal_rule().is_some();
        for quadrature in [Quadrature::Nodal, Quadrature::Gauss].into_iter().skip(usize::from(!nodal)) {
            match element.dimension() {
                2 => patch::<2>(element, quadrature),
                _ => patch::<3>(element, quadrature),
            }
        }
    }
}

/// Nodal quadrature on facets that have none is refused with the cure.
#[test]
fn refuses_nodal_quadrature_where_there_is_none() {
    let mesh = unit_box::<3>(ElementKind::Tet10);
    let (mine, global) = (vec![true; mesh.element_count()], vec![0; mesh.element_count()]);
    let ownership = Ownership { owned_nodes: mesh.points.len(), mine: &mine, global_element: &global };
    let refused = ContactSurface::new(&mesh, &mesh.facet_sets["bottom"], &ownership, Quadrature::Nodal);
    assert!(refused.unwrap_err().message.contains("quadrature: gauss"));
}

/// Two ranks that own parts of the nodes and elements report together what one rank reports.
#[test]
fn two_ranks_count_what_one_counts() {
    let mesh = unit_box::<3>(ElementKind::Hex8);
    let global: Vec<u32> = (0..mesh.element_count() as u32).collect();
    let friction = Some(coulomb(0.5, Regularization::stick_velocity(1e-3).unwrap()));
    let rest = vec![0.0; mesh.points.len() * 3];
    for quadrature in [Quadrature::Nodal, Quadrature::Gauss] {
        let whole = contact(&mesh, quadrature, friction);
        let mut state = ContactState::new(whole.surface.point_count());
        evaluate(&whole, (&rest, &rest), &ContactRequest::default(), &mut state);
        let all = whole.surface.summary(&state);
        let mut parts = super::zone::ZoneSummary::default();
        let nodes = mesh.points.len();
        // Second rank: the same mesh with its nodes in reverse, so that it owns the others.
        let mut reversed = mesh.clone();
        reversed.points.reverse();
        reversed.nodes.iter_mut().for_each(|n| *n = nodes as u32 - 1 - *n);
        let first_owns = 5;
        for (mesh, owned, rank) in [(&mesh, first_owns, 0), (&reversed, nodes - first_owns, 1)] {
            let mine: Vec<bool> = (0..mesh.element_count()).map(|e| e % 2 == rank).collect();
            let ownership = Ownership { owned_nodes: owned, mine: &mine, global_element: &global };
            let surface =
                ContactSurface::new(mesh, &mesh.facet_sets["bottom"], &ownership, quadrature).unwrap();
            let part = RigidContact { surface, ..whole.clone() };
            let mut state = ContactState::new(part.surface.point_count());
            evaluate(&part, (&rest, &rest), &ContactRequest::default(), &mut state);
            parts += part.surface.summary(&state);
        }
        assert_eq!((parts.points, parts.stick, parts.slip), (all.points, all.stick, all.slip));
        assert!(all.stick > 0 && (parts.normal_force / all.normal_force - 1.0).abs() < 1e-12);
    }
}

fn tangent<const D: usize>(element: ElementKind, quadrature: Quadrature, hold: Hold) {
    let mesh = unit_box::<D>(element);
    let friction = Some(coulomb(0.5, Regularization::stick_velocity(1e-3).unwrap()));
    let mut contact = contact(&mesh, quadrature, friction);
    let below = Vector::from_fn(|i, _| if i + 1 == D { -4.0 } else { 0.45 });
    contact.obstacle = Obstacle::Sphere(Sphere::new(below, 4.02, Side::Outside).unwrap());
    let held = RefCell::new(ContactState::new(contact.surface.point_count()));
    let size = mesh.points.len() * D;
    let v = scatter(size, 3);
    let forced = |u: &[f64], request: &ContactRequest| {
        let v: Vec<f64> = v.iter().zip(u).map(|(v, u)| v + 10.0 * u).collect();
        evaluate(&contact, (u, &v), request, &mut held.borrow_mut())
    };
    let selection = Selection { terms: Terms::ALL, velocity_shift: 10.0, joint: None };
    let zero = vec![0.0; size];
    forced(&zero, &ContactRequest::default());
    held.borrow_mut().freeze(Keep::Pressure);
    held.borrow_mut().freeze(Keep::Friction);
    let matrix =
        forced(&zero, &ContactRequest { stiffness: Some(selection), hold, ..Default::default() }).matrix;
    let direction: Vec<f64> = scatter(size, 5).iter().map(|d| d * 1e-4).collect();
    let force = |u: &[f64]| forced(u, &ContactRequest { stiffness: None, hold, ..Default::default() }).force;
    let slope = |_: &[f64], d: &[f64]| {
        matrix.chunks_exact(size).map(|row| -row.iter().zip(d).map(|(k, d)| k * d).sum::<f64>()).collect()
    };
    let rate = taylor_rate(force, slope, &zero, &direction);
    assert!(rate > 1.9, "{element:?} {quadrature:?} {hold:?}: {rate}");
}

/// The assembled matrix of a surface on a sphere is minus the derivative of the assembled force.
#[test]
fn surface_tangent_is_consistent() {
    for hold in [Hold::Nothing, Hold::Frictionless, Hold::Bound, Hold::BoundAndPressure] {
        tangent::<2>(ElementKind::Quad9, Quadrature::Gauss, hold);
        tangent::<3>(ElementKind::Hex8, Quadrature::Nodal, hold);
    }
}

/// Over the reference area the force is minus the gradient of the stored energy.
#[test]
fn force_is_the_gradient_of_the_energy() {
    let mesh = unit_box::<2>(ElementKind::Quad4);
    let mut contact = contact(&mesh, Quadrature::Gauss, None);
    contact.obstacle =
        Obstacle::Sphere(Sphere::new(Vector::<2>::new(0.4, -4.0), 4.02, Side::Outside).unwrap());
    contact.area = AreaKind::Reference;
    let size = mesh.points.len() * 2;
    let at = |u: &[f64]| {
        let mut state = ContactState::new(contact.surface.point_count());
        let force = evaluate(&contact, (u, &vec![0.0; size]), &ContactRequest::default(), &mut state).force;
        (contact.surface.energy(&state, 1.0).stored, force)
    };
    let zero = vec![0.0; size];
    let force = at(&zero).1;
    let slope = |_: &[f64], d: &[f64]| vec![-force.iter().zip(d).map(|(f, d)| f * d).sum::<f64>()];
    let direction: Vec<f64> = scatter(size, 5).iter().map(|d| d * 1e-3).collect();
    assert!(taylor_rate(|u| vec![at(u).0], slope, &zero, &direction) > 1.9);
}

/// The friction heat of constant sliding is force times path, and remembered per area.
#[test]
fn heat_is_friction_force_times_path() {
    let mesh = unit_box::<2>(ElementKind::Quad4);
    let (mu, speed, dt) = (0.5, 2.0, 1e-3);
    for regularization in
        [Regularization::stick_velocity(1e-3).unwrap(), Regularization::stick_stiffness(1e12).unwrap()]
    {
        let contact = contact(&mesh, Quadrature::Nodal, Some(coulomb(mu, regularization)));
        let mut state = ContactState::new(contact.surface.point_count());
        let v: Vec<f64> = (0..mesh.points.len()).flat_map(|_| [speed, 0.0]).collect();
        let u: Vec<f64> = v.iter().map(|v| v * dt).collect();
        let expected = mu * OVERLAP / COMPLIANCE * speed * dt;
        let mut heat = 0.0;
        for _ in 0..100 {
            evaluate(&contact, (&u, &v), &ContactRequest::default(), &mut state);
            assert!(state.current.iter().all(|p| p.status == Status::Slip));
            heat += contact.surface.energy(&state, dt).heat_of_step;
            state.accept(dt);
        }
        assert!((heat / (100.0 * expected) - 1.0).abs() < 6e-3, "{regularization:?}: {heat}");
        assert!((state.history[0].friction_work / heat - 1.0).abs() < 1e-12);
        assert!((state.history[0].slip / (100.0 * speed * dt) - 1.0).abs() < 1e-12);
    }
}

/// Power law and Grosch-Schallamach at -1/9 are one law, down to the assembled force.
#[test]
fn power_law_and_grosch_schallamach_assemble_alike() {
    let mesh = unit_box::<3>(ElementKind::Hex8);
    let (stiffness, modulus) = (1.0 / COMPLIANCE, 5e6);
    let regularization = Regularization::stick_velocity(1e-1).unwrap();
    let grosch = GroschSchallamach::new(1.0, modulus, GroschSchallamach::EXPONENT).unwrap();
    let coefficient = Coefficient::GroschSchallamach(grosch);
    let law = FrictionLaw::Coulomb(Coulomb { coefficient });
    let first = contact(&mesh, Quadrature::Nodal, Some(Friction { law, regularization }));
    let tangential = f64::powf(stiffness, 8.0 / 9.0) * f64::powf(modulus, 1.0 / 9.0);
    let law = FrictionLaw::PowerLaw(PowerLaw::new(tangential, 8.0 / 9.0).unwrap());
    let normal = NormalLaw::PowerLaw(NormalPowerLaw::new(stiffness, 1.0).unwrap());
    let second = RigidContact {
        law: ContactLaw { normal, friction: Some(Friction { law, regularization }) },
        ..first.clone()
    };
    let size = mesh.points.len() * 3;
    let (u, v) = (scatter(size, 7).iter().map(|u| u * 5e-4).collect::<Vec<_>>(), scatter(size, 9));
    let mut state = ContactState::new(first.surface.point_count());
    let a = evaluate(&first, (&u, &v), &ContactRequest::default(), &mut state).force;
    let b = evaluate(&second, (&u, &v), &ContactRequest::default(), &mut state).force;
    let norm = |f: &[f64]| f.iter().map(|f| f * f).sum::<f64>().sqrt();
    let difference: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
    assert!(norm(&difference) < 1e-12 * norm(&a) && norm(&a) > 0.0);
}

/// At vanishing gaps and speeds, huge coefficients and huge speeds, every law gives numbers.
#[test]
fn extremes_give_numbers() {
    let mesh =
        BoxShape { min: [0.0; 3], max: [1.0; 3], cells: [1; 3], element: ElementKind::Hex8 }.mesh().unwrap();
    let size = mesh.points.len() * 3;
    let laws: Vec<FrictionLaw> = FRICTION_LAWS.iter().flat_map(|entry| (entry.samples)()).collect();
    assert!(laws.len() > COEFFICIENTS.len());
    let selection = Selection { terms: Terms::ALL, velocity_shift: 1e6, joint: None };
    let request = ContactRequest { stiffness: Some(selection), ..Default::default() };
    for normal in NORMAL_LAWS.iter().map(|entry| (entry.samples)()[0]) {
        for (law, entry) in laws.iter().flat_map(|law| REGULARIZATIONS.iter().map(move |r| (law, r))) {
            let friction = Friction { law: *law, regularization: (entry.samples)()[0] };
            let mut contact = contact(&mesh, Quadrature::Nodal, Some(friction));
            contact.law.normal = normal;
            for height in [0.0, 1e-310, 1e-300, 1e-160, 1e-12, 1.0] {
                contact.obstacle = floor(height);
                for speed in [0.0, 1e-310, 1e-160, 1.0, 1e8] {
                    let v = vec![speed; size];
                    let mut state = ContactState::new(contact.surface.point_count());
                    let dense = evaluate(&contact, (&vec![0.0; size], &v), &request, &mut state);
                    assert!(dense.calls > 0, "a gap of zero is closed");
                    let finite = dense.force.iter().chain(&dense.matrix).all(|f| f.is_finite());
                    assert!(finite, "{law:?} {normal:?} {} {height} {speed}", entry.name);
                    state.accept(1e-3);
                    assert!(
                        state.history.iter().all(|h| h.friction_work >= 0.0 && h.friction_work.is_finite())
                    );
                }
            }
        }
    }
}
