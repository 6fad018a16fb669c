//! Small scenes that together contain every term of the matrix. Each lists its terms.

use std::rc::Rc;

use contact_petsc::assembly::SystemOptions;
use contact_petsc::case::PlacedFunction;
use contact_petsc::contact::damping::{ContactDamping, HuntCrossley};
use contact_petsc::contact::friction::coefficient::{Coefficient, Constant, Stribeck};
use contact_petsc::contact::friction::{Coulomb, Friction, FrictionPowerLaw, Regularization};
use contact_petsc::contact::normal::{NormalLaw, NormalPowerLaw};
use contact_petsc::contact::obstacle::{Cylinder, Plane, Shape, Side, Sphere};
use contact_petsc::mesh::ElementKind::{self, Hex8, Quad4, Quad9, Tet4, Tet10, Tri6};
use contact_petsc::mesh::{BoxShape, Facet, Mesh, PlaneState};
use contact_petsc::model::{
    Body, ContactModel, ElasticSupport, Grounded, InitialOverclosure, LoadKind, MassChoice, RayleighFactors,
    SupportCoefficients, Target,
};
use contact_petsc::petsc::{Format, Session};
use contact_petsc::tensor::Vector;
use contact_petsc::terms::Terms;

use super::scene::{Scene, Solid, function, load, support};

const NH: &str = "neo_hookean";
const SVK: &str = "saint_venant_kirchhoff";

/// A scene with its terms, in addition to those of the solid and the normal contact.
pub struct Case<const D: usize> {
    pub name: &'static str,
    solid: Solid,
    lumped: bool,
    obstacle: Rc<dyn Shape<D>>,
    /// Elements of a second body that replaces the obstacle.
    bed: Option<ElementKind>,
    normal: NormalLaw,
    pub friction: Option<Friction>,
    pub damping: ContactDamping,
    pub current_area: bool,
    /// Whether the bodies are bodies of revolution.
    revolved: bool,
    pub at_work: Terms,
}

const CURVED: Terms = Terms::NORMAL_GEOMETRY.union(Terms::FRICTION_GEOMETRY);
const RUBBING: Terms = Terms::FRICTION_NORMAL_COUPLING.union(Terms::ZONE_CHANGE);

fn coulomb(coefficient: Coefficient, regularization: Regularization) -> Option<Friction> {
    Some(Friction { law: Coulomb::of(coefficient, regularization).into(), regularization })
}

fn constant() -> Coefficient {
    Constant(0.6).into()
}

/// Points stick below this slip velocity [m/s], and slip above it.
fn velocity(limit: f64) -> Regularization {
    Regularization::stick_velocity(limit)
}

fn penalty() -> NormalLaw {
    NormalLaw::penalty(0.05)
}

fn floor<const D: usize>() -> Rc<dyn Shape<D>> {
    let up = Vector::from_fn(|i, _| if i + 1 == D { 1.0 } else { 0.1 });
    Rc::new(Plane::new(Vector::from_fn(|i, _| if i + 1 == D { 0.2 } else { 0.5 }), up))
}

/// A ball from below that overlaps the whole bottom.
fn ball<const D: usize>() -> Rc<dyn Shape<D>> {
    let centre = Vector::from_fn(|i, _| if i + 1 == D { -2.0 } else { 0.45 });
    Rc::new(Sphere::new(centre, 2.3, Side::Outside))
}

pub fn plane_cases() -> Vec<Case<2>> {
    let power = Friction {
        law: FrictionPowerLaw::of(8.0, 1.5, velocity(1e-3)).into(),
        regularization: velocity(1e-3),
    };
    let stribeck = Coefficient::from(Stribeck::of(0.9, 0.4, 3.0));
    let stick = Regularization::stick_stiffness(20.0);
    let slip = Regularization::stick_stiffness(1e4);
    let damped = RUBBING | Terms::FRICTION_DAMPING;
    vec![
        new("stick by velocity", Quad4, NH, coulomb(constant(), velocity(8.0)), damped),
        Case {
            obstacle: ball(),
            solid: Solid::new(Quad4, NH).reduced(),
            ..new("slip on a disc", Quad4, NH, coulomb(constant(), velocity(1e-3)), RUBBING | CURVED)
        },
        Case {
            lumped: true,
            ..new(
                "slip by Stribeck",
                Tri6,
                SVK,
                coulomb(stribeck, velocity(1e-3)),
                // The slip of a vertex is a mean over facets whose areas change.
                RUBBING | Terms::COEFFICIENT_CHANGE | Terms::FRICTION_GEOMETRY,
            )
        },
        Case {
            obstacle: ball(),
            ..new(
                "stick by stiffness",
                Tri6,
                NH,
                coulomb(constant(), stick),
                Terms::ZONE_CHANGE | Terms::FRICTION_DAMPING | CURVED,
            )
        },
        new("slip by stiffness", Quad4, SVK, coulomb(constant(), slip), RUBBING),
        Case {
            normal: NormalPowerLaw::of(40.0, 2.0).into(),
            ..new("power laws", Quad4, NH, Some(power), RUBBING)
        },
        Case { current_area: false, ..new("no friction", Quad4, NH, None, Terms::empty()) },
        Case {
            bed: Some(Quad4),
            ..new("stick on a body", Quad4, NH, coulomb(constant(), velocity(8.0)), damped | CURVED)
        },
        Case {
            bed: Some(Tri6),
            ..new("slip on a body", Quad9, NH, coulomb(constant(), velocity(1e-3)), RUBBING | CURVED)
        },
        Case {
            bed: Some(Tri6),
            // A dashpot needs the gap at the start of the step, which these scenes have not had.
            damping: ContactDamping { normal: Some(HuntCrossley::of(0.02).into()), tangential: None },
            ..new(
                "damped on a body",
                Quad9,
                NH,
                coulomb(constant(), velocity(1e-3)),
                RUBBING | CURVED | Terms::NORMAL_DAMPING,
            )
        },
        Case {
            bed: Some(Quad4),
            current_area: false,
            // Without the change of the area the matrix is taken for symmetric, which contact by segments is not.
            ..new("no friction on a body", Tri6, NH, None, Terms::NORMAL_GEOMETRY | Terms::ZONE_CHANGE)
        },
        Case {
            revolved: true,
            ..new("rings that slip", Quad4, NH, coulomb(constant(), velocity(1e-3)), RUBBING)
        },
        Case {
            bed: Some(Tri6),
            revolved: true,
            ..new("rings on rings", Quad9, SVK, coulomb(constant(), velocity(1e-3)), RUBBING | CURVED)
        },
        Case {
            obstacle: ball(),
            ..new("no friction on a disc", Quad4, SVK, None, Terms::NORMAL_GEOMETRY | Terms::ZONE_CHANGE)
        },
    ]
}

pub fn solid_cases() -> Vec<Case<3>> {
    let stribeck = Coefficient::from(Stribeck::of(0.9, 0.4, 3.0));
    let cylinder =
        Cylinder::new(Vector::from([0.4, 0.0, -2.0]), Vector::from([0.1, 1.0, 0.0]), 2.3, Side::Outside);
    let slip = Regularization::stick_stiffness(1e4);
    // In space a slipping point turns: its slip has a tangent.
    let damped = RUBBING | Terms::FRICTION_DAMPING;
    vec![
        new("slip in space", Hex8, NH, coulomb(constant(), velocity(1e-3)), damped),
        Case {
            obstacle: Rc::new(cylinder),
            ..new("stick on a cylinder", Tet10, SVK, coulomb(constant(), velocity(8.0)), damped | CURVED)
        },
        Case {
            obstacle: ball(),
            solid: Solid::new(Hex8, NH).reduced(),
            ..new(
                "slip on a ball",
                Hex8,
                NH,
                coulomb(stribeck, velocity(1e-3)),
                damped | CURVED | Terms::COEFFICIENT_CHANGE,
            )
        },
        Case {
            bed: Some(Tet4),
            ..new("stick on a body in space", Hex8, NH, coulomb(constant(), velocity(8.0)), damped | CURVED)
        },
        Case {
            bed: Some(Hex8),
            ..new("slip on a body in space", Tet10, SVK, coulomb(constant(), velocity(1e-3)), damped | CURVED)
        },
        new("slip by stiffness in space", Tet4, NH, coulomb(constant(), slip), damped),
    ]
}

/// On the floor with a penalty, with consistent mass and tractions on the deformed area.
fn new<const D: usize>(
    name: &'static str,
    kind: ElementKind,
    law: &'static str,
    friction: Option<Friction>,
    at_work: Terms,
) -> Case<D> {
    Case {
        name,
        solid: Solid::new(kind, law),
        lumped: false,
        obstacle: floor(),
        bed: None,
        normal: penalty(),
        friction,
        damping: ContactDamping::default(),
        current_area: true,
        revolved: false,
        at_work,
    }
}

impl<const D: usize> Case<D> {
    pub fn scene(&self, session: &Rc<Session>, format: Format) -> Scene<D> {
        let mut model = self.solid.model::<D>();
        if self.lumped {
            model.bodies[0].mass = MassChoice::Lumped;
        }
        model.bodies[0].materials[0].damping = Some(RayleighFactors { mass: 0.7, stiffness: 0.02 });
        let only = |axis: usize, text| std::array::from_fn(|i| if i == axis { text } else { "" });
        model.supports.push(support("block.top", only(D - 1, "-0.2 * t")));
        model.supports.push(support("block.right", only(0, "2 * t - 0.7")));
        let axes = |of: &dyn Fn(usize) -> Option<PlacedFunction>| SupportCoefficients {
            axes: std::array::from_fn(of),
            ..SupportCoefficients::NONE
        };
        model.elastic_supports.push(ElasticSupport {
            name: "soil".to_owned(),
            set: "block.left".to_owned(),
            on: Grounded::Surface,
            stiffness: SupportCoefficients {
                normal: Some(function("3 + y")),
                tangential: Some(function("1.2")),
                ..SupportCoefficients::NONE
            },
            damping: axes(&|i| (i > 0).then(|| function("0.4 + 0.1 * y"))),
        });
        model.elastic_supports.push(ElasticSupport {
            name: "springs".to_owned(),
            set: "block.surface".to_owned(),
            on: Grounded::Nodes,
            stiffness: axes(&|i| Some(function(["0.5", "0.3", "0.2"][i]))),
            damping: axes(&|i| (i == 0).then(|| function("0.1"))),
        });
        if self.current_area {
            model.loads.push(load("block.left", LoadKind::Pressure(function("1.5 + 0.5 * y"))));
        }
        model.loads.push(load("block", LoadKind::BodyForce(std::array::from_fn(|_| function("0.3")))));
        model.contacts.push(ContactModel {
            name: "sole".to_owned(),
            contactor: "block.bottom".to_owned(),
            bodies: vec![0],
            target: match self.bed {
                None => Target::Obstacle(self.obstacle.clone().into()),
                Some(_) => Target::Surface { set: "bed.top".to_owned(), bodies: vec![1] },
            },
            target_name: "foundation".to_owned(),
            softer: 5.0e6,
            normal: self.normal,
            penetration: None,
            friction: self.friction,
            damping: self.damping,
            current_area: self.current_area,
            initial_overclosure: InitialOverclosure::Accept,
            conserves: false,
            keeps_momentum: false,
            wall: f64::INFINITY,
        });
        let options = SystemOptions { inertia: true, format };
        let mut mesh = self.solid.mesh(2, |_| ());
        if let Some(kind) = self.bed {
            let bed = Solid::new(kind, NH);
            model.bodies.push(Body { name: "bed".to_owned(), ..bed.model::<D>().bodies.remove(0) });
            model.supports.push(support("bed.bottom", std::array::from_fn(|_| "0.1 * t")));
            mesh = beside(mesh, &bed);
        }
        if self.revolved {
            mesh.plane = PlaneState::Axisymmetric;
            mesh.points.iter_mut().for_each(|point| point[0] += 0.6);
            let materials = model.bodies.iter_mut().flat_map(|body| &mut body.materials);
            materials.for_each(|material| material.formulation.plane = PlaneState::Axisymmetric);
        }
        Scene::new(session, mesh, &model, options)
    }
}

/// A second body below the block, wider and with different cells. The whole bottom of the block
/// overlaps its top.
fn beside<const D: usize>(mut block: Mesh<D>, bed: &Solid) -> Mesh<D> {
    let mut bed = BoxShape {
        min: std::array::from_fn(|i| if i + 1 == D { -1.0 } else { -0.45 }),
        max: std::array::from_fn(|i| if i + 1 == D { 0.2 } else { 1.55 }),
        cells: [3; D],
        element: bed.kind,
    }
    .mesh()
    .expect("a box");
    let first = block.points.len() as u32;
    let elements = block.element_count() as u32;
    block.points.append(&mut bed.points);
    for element in 0..bed.element_count() {
        let nodes: Vec<u32> = bed.element_nodes(element).iter().map(|node| node + first).collect();
        block.push(bed.kinds[element], nodes);
        *block.body.last_mut().expect("just pushed") = 1;
    }
    for (name, facets) in bed.facet_sets {
        let facets = facets.iter().map(|facet| Facet { element: facet.element + elements, ..*facet });
        block.facet_sets.insert(format!("bed.{name}"), facets.collect());
    }
    block
}
