//! A scene built from the library's own parts: mesh, model, system, and its static equilibrium.

use std::rc::Rc;

use contact_petsc::assembly::{ContactSystem, SystemOptions};
use contact_petsc::case::{Function, PlacedFunction, Units};
use contact_petsc::collective::Collective;
use contact_petsc::dynamics::{Equations, Stage};
use contact_petsc::element::{Formulation, Kinematics, Locking};
use contact_petsc::material::Material;
use contact_petsc::mesh::{BoxShape, ElementKind, Mesh, PlaneState, merge};
use contact_petsc::model::{Body, BodyMaterial, Load, LoadKind, MassChoice, Model, Support};
use contact_petsc::partition::{LocalMesh, Plan, distribute};
use contact_petsc::petsc::{Format, Session};
use contact_petsc::solvers::{LinearChoice, LinearSolver, Monolithic, NewtonSettings, Outcome, Problem};
use contact_petsc::space::reference;
use contact_petsc::tensor::{Tensor, Vector, det_minus_one};
use contact_petsc::terms::Terms;
use contact_petsc::time::{Integrate, Scheme};
use mpi::collective::SystemOperation;

/// The properties of a body.
#[derive(Debug, Clone, Copy)]
pub struct Solid {
    pub kind: ElementKind,
    pub law: &'static str,
    pub kinematics: Kinematics,
    pub locking: Locking,
}

pub const YOUNG: f64 = 10.0;
pub const POISSON: f64 = 0.3;
pub const DENSITY: f64 = 2.0;

/// Lame's constants of [`YOUNG`] and [`POISSON`] [Pa].
pub fn lame() -> (f64, f64) {
    let mu = YOUNG / (2.0 * (1.0 + POISSON));
    (2.0 * mu * POISSON / (1.0 - 2.0 * POISSON), mu)
}

impl Solid {
    pub const fn new(kind: ElementKind, law: &'static str) -> Self {
        Self { kind, law, kinematics: Kinematics::Finite, locking: Locking::None }
    }

    pub const fn linear(self) -> Self {
        Self { kinematics: Kinematics::Linear, ..self }
    }

    pub const fn reduced(self) -> Self {
        Self { locking: Locking::SelectiveReduced, ..self }
    }

    /// A model of the single body `block`, without supports and loads.
    pub fn model<const D: usize>(&self) -> Model<D> {
        let formulation = Formulation {
            material: Material::named(self.law, YOUNG, POISSON).expect("a known law"),
            kinematics: self.kinematics,
            plane: PlaneState::Strain,
            locking: self.locking,
            density: DENSITY,
        };
        let block = Body {
            name: "block".to_owned(),
            materials: vec![BodyMaterial {
                set: None,
                formulation,
                damping: None,
                series: None,
                young_modulus: YOUNG,
            }],
            mass: MassChoice::Consistent,
            initial_velocity: Vec::new(),
        };
        let bodies = vec![block];
        Model {
            units: Units::SI,
            bodies,
            rigid: Vec::new(),
            contacts: Vec::new(),
            ties: Vec::new(),
            supports: Vec::new(),
            rollers: Vec::new(),
            elastic_supports: Vec::new(),
            loads: Vec::new(),
            probes: Vec::new(),
            lines: Vec::new(),
        }
    }

    /// The body `block`, a unit square or cube of `cells` cells along each axis, whose points
    /// `move_point` moves. The set `block.surface` holds all points of its surface.
    pub fn mesh<const D: usize>(&self, cells: u32, move_point: impl Fn(&mut [f64; D])) -> Mesh<D> {
        let shape = BoxShape { min: [0.0; D], max: [1.0; D], cells: [cells; D], element: self.kind };
        let mut mesh = shape.mesh().expect("a box");
        let mut surface: Vec<u32> =
            mesh.facet_sets.keys().filter_map(|name| mesh.set_nodes(name)).flatten().collect();
        surface.sort_unstable();
        surface.dedup();
        mesh.point_sets.insert("surface".to_owned(), surface);
        mesh.points.iter_mut().for_each(move_point);
        merge(vec![("block".to_owned(), mesh)]).expect("small")
    }
}

/// An expression in x, y, z, t.
pub fn function(text: &str) -> PlacedFunction {
    Function::expression(text).unwrap_or_else(|complaint| panic!("{text}: {complaint:?}")).into()
}

/// A prescribed motion of the components that are not empty.
pub fn support<const D: usize>(set: &str, components: [&str; D]) -> Support<D> {
    let components = components.map(|text| (!text.is_empty()).then(|| function(text)));
    Support { name: format!("hold {set}"), set: set.to_owned(), bodies: vec![0], components }
}

/// A load on a set of the block.
pub fn load<const D: usize>(set: &str, kind: LoadKind<D>) -> Load<D> {
    Load { name: format!("load {set}"), set: set.to_owned(), body: Some(0), kind }
}

/// A system with a stage at rest.
pub struct Scene<const D: usize> {
    pub system: ContactSystem<D>,
    pub stage: Stage,
    pub session: Rc<Session>,
}

impl<const D: usize> Scene<D> {
    /// Distributes the mesh over all ranks and builds the system. Collective.
    pub fn new(session: &Rc<Session>, mesh: Mesh<D>, model: &Model<D>, options: SystemOptions) -> Self {
        let mut mesh = (session.rank() == 0).then_some(mesh);
        mesh.iter_mut().for_each(|mesh| model.add_patches(mesh));
        let (local, _) = distribute(session.world(), mesh, &Plan::default()).expect("a partition");
        let system = ContactSystem::new(session, local, model, options).expect("a system");
        let stage = Stage::at_rest(system.pattern_vector()).expect("a stage");
        Self { system, stage, session: session.clone() }
    }

    pub fn local(&self) -> &LocalMesh<D> {
        self.system.bodies().local()
    }

    /// Newton's method with tight tolerances.
    pub fn strategy(&self, choice: &LinearChoice, dynamic: bool) -> Monolithic {
        let problem = Problem {
            unknowns: self.system.bodies().unknowns(),
            dimension: D,
            dynamic,
            symmetric: !self.system.has_friction() && !self.system.has_following_loads(),
            contact: !self.system.contacts().is_empty(),
            joins_bodies: false,
            tied: false,
            nearly_incompressible: false,
            format: Some(self.system.matrix().format()),
        };
        let pattern = self.system.pattern_vector();
        let linear = LinearSolver::new(pattern, "", choice, &problem).expect("a linear solver");
        let settings = NewtonSettings {
            tolerance: 1e-11,
            max_iterations: 25,
            linear: [1e-10, 1e-10],
            line_search: true,
            keep_tangent: false,
            terms: Terms::ALL,
        };
        Monolithic::new(settings, linear, pattern).expect("a strategy")
    }

    /// Static equilibrium at t = 1. Collective.
    pub fn equilibrium(session: &Rc<Session>, mesh: Mesh<D>, model: &Model<D>) -> Self {
        let options = SystemOptions { inertia: false, format: Format::Aij };
        let mut scene = Self::new(session, mesh, model, options);
        let choice = if D == 3 && !scene.system.has_following_loads() { "cg_icc" } else { "direct" };
        let mut strategy = scene.strategy(&LinearChoice::Named(choice), false);
        Scheme::Static.prepare(&mut scene.stage, 1.0, 1.0).expect("a stage");
        let moved = strategy.follow_prescribed(&mut scene.system, &mut scene.stage);
        assert!(moved.expect("PETSc"), "the first guess");
        let outcome = strategy.solve(&mut scene.system, &mut scene.stage, |_| ()).expect("PETSc");
        assert!(matches!(outcome, Outcome::Converged(_)), "{outcome:?}");
        scene
    }

    /// Sums up over all ranks.
    pub fn sum<const N: usize>(&self, own: [f64; N]) -> [f64; N] {
        let mut total = [0.0; N];
        self.session.world().reduce_all(&own[..], &mut total[..], SystemOperation::sum());
        total
    }

    /// `int f(X, w(X)) dV` over the reference volume for nodal fields `w`, with a rule of high
    /// degree. Collective.
    pub fn integrate<const F: usize, const N: usize>(
        &self,
        fields: [&[f64]; F],
        f: impl Fn(&Vector<D>, [Vector<D>; F]) -> [f64; N],
    ) -> [f64; N] {
        let local = self.local();
        let mut own = [0.0; N];
        for element in (0..local.mesh.element_count()).filter(|&e| local.mine[e]) {
            let (kind, nodes) = (local.mesh.kinds[element], local.mesh.element_nodes(element));
            let table = reference(kind).tabulate(&reference(kind).rule(if D == 2 { 7 } else { 5 }));
            for q in 0..table.points {
                let (mut x, mut w, mut jacobian) =
                    (Vector::zeros(), [Vector::zeros(); F], Tensor::<D>::zeros());
                for (a, &node) in nodes.iter().enumerate() {
                    let n = table.n[q * table.nodes + a];
                    let place = Vector::from(local.mesh.points[node as usize]);
                    let dn = Vector::<D>::from_column_slice(&table.dn[(q * table.nodes + a) * D..][..D]);
                    x += place * n;
                    for (w, field) in w.iter_mut().zip(fields) {
                        *w += Vector::from_column_slice(&field[node as usize * D..][..D]) * n;
                    }
                    jacobian += place * dn.transpose();
                }
                let weight = table.weights[q] * (1.0 + det_minus_one(&(jacobian - Tensor::identity())));
                own.iter_mut().zip(f(&x, w)).for_each(|(sum, value)| *sum += weight * value);
            }
        }
        self.sum(own)
    }
}
