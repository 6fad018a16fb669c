//! Two blocks, one on the other, for the tests of deformable contact.

use super::deformable::{DeformableContact, PairContribution, PairSink};
use super::evaluation::{AreaKind, ContactFields, ContactRequest};
use super::friction::coefficient::{Coefficient, Constant};
use super::friction::{Coulomb, Friction, FrictionLaw, Regularization};
use super::normal::{NormalLaw, Penalty};
use super::pairing::Pairing;
use super::point::ContactLaw;
use super::search::{Search, SearchLimits};
use super::state::ContactState;
use super::surface::{ContactSurface, Ownership, Quadrature};
use super::target::{TargetFacets, TargetSurface};
use crate::mesh::{BoxShape, ElementKind, Mesh, merge};

pub const COMPLIANCE: f64 = 1e-8;
pub const OVERLAP: f64 = 0.05;
pub const LIMITS: SearchLimits = SearchLimits { reach: 0.6, ahead: 0.6, depth: 0.5 };

pub fn coulomb(mu: f64, regularization: Regularization) -> Friction {
    let coefficient = Coefficient::Constant(Constant::new(mu).unwrap());
    Friction { law: FrictionLaw::Coulomb(Coulomb { coefficient }), regularization }
}

pub fn penalty(friction: Option<Friction>) -> ContactLaw {
    ContactLaw { normal: NormalLaw::Penalty(Penalty::new(COMPLIANCE).unwrap()), friction }
}

/// A box whose lateral extent is `across` in each direction, its height `up`.
pub fn block<const D: usize>(element: ElementKind, across: [f64; 2], up: [f64; 2], cells: u32) -> Mesh<D> {
    let corner = |k: usize| std::array::from_fn(|i| if i + 1 < D { across[k] } else { up[k] });
    let cells = std::array::from_fn(|i| if i + 1 < D { cells } else { 1 });
    BoxShape { min: corner(0), max: corner(1), cells, element }.mesh().unwrap()
}

/// Facets of some sets of the mesh as a target; node numbers are those of the mesh.
pub fn target<const D: usize>(mesh: &Mesh<D>, sets: &[&str]) -> TargetSurface<D> {
    let mut facets = TargetFacets::default();
    let mut nodes = Vec::new();
    for &facet in sets.iter().flat_map(|set| &mesh.facet_sets[*set]) {
        mesh.facet_nodes(facet, &mut nodes);
        let identity = TargetFacets::identity(facet.element, facet.side);
        facets.push(mesh.facet_kind(facet), &nodes, identity, mesh.body[facet.element as usize]);
    }
    TargetSurface::new(facets, &mesh.points)
}

/// A set of the mesh as a contactor, all of it on one rank.
pub fn contactor<const D: usize>(mesh: &Mesh<D>, set: &str, quadrature: Quadrature) -> ContactSurface<D> {
    let mine = vec![true; mesh.element_count()];
    let global: Vec<u32> = (0..mesh.element_count() as u32).collect();
    let ownership = Ownership { owned_nodes: mesh.points.len(), mine: &mine, global_element: &global };
    ContactSurface::of_mine(mesh, &mesh.facet_sets[set], &ownership, quadrature, 1.0).unwrap()
}

/// A mesh and a contact on it, with fields.
#[derive(Clone)]
pub struct Scene<const D: usize> {
    pub mesh: Mesh<D>,
    pub contact: DeformableContact<D>,
    pub u: Vec<f64>,
    pub v: Vec<f64>,
    pub u_start: Vec<f64>,
    pub pairing: Pairing,
    pub state: ContactState<D>,
}

/// Force and matrix added up.
#[derive(Default)]
pub struct Dense<const D: usize> {
    pub force: Vec<f64>,
    pub matrix: Vec<f64>,
    pub calls: usize,
}

impl<const D: usize> PairSink for Dense<D> {
    fn pair(&mut self, pair: &PairContribution<'_>) {
        self.calls += 1;
        let (m, total) = (pair.nodes.len(), self.force.len());
        let dof = |local: usize| pair.nodes[local / D] as usize * D + local % D;
        pair.force.iter().enumerate().for_each(|(r, f)| self.force[dof(r)] += f);
        let Some(stiffness) = pair.stiffness else { return };
        self.matrix.resize(total * total, 0.0);
        for (r, c) in (0..m * D).flat_map(|r| (0..m * D).map(move |c| (r, c))) {
            let entry = stiffness[((r / D * m + c / D) * D + r % D) * D + c % D];
            self.matrix[dof(r) * total + dof(c)] += entry;
        }
    }
}

impl<const D: usize> Scene<D> {
    /// The bottom of the block `upper` on the sets of the block `lower`, unpaired, at rest.
    pub fn new(upper: Mesh<D>, lower: Mesh<D>, sets: &[&str], quadrature: Quadrature) -> Self {
        let mesh = merge(vec![("lower".to_owned(), lower), ("upper".to_owned(), upper)]).unwrap();
        let contact = DeformableContact {
            surface: contactor(&mesh, "upper.bottom", quadrature),
            target: target(&mesh, sets),
            law: penalty(None),
            area: AreaKind::Current,
        };
        let rest = vec![0.0; mesh.points.len() * D];
        let points = contact.surface.point_count();
        let (pairing, state) = (Pairing::new(points), ContactState::new(points));
        Self { mesh, contact, v: rest.clone(), u_start: rest.clone(), u: rest, pairing, state }
    }

    /// A block of `upper` elements, one cell, sunk by the overlap into a wider one of `lower` elements, 2 cells across.
    pub fn pressed(upper: ElementKind, lower: ElementKind, quadrature: Quadrature) -> Self {
        let upper = block(upper, [0.0, 1.0], [0.0, 1.0], 1);
        let lower = block(lower, [-0.35, 1.25], [-1.0, OVERLAP], 2);
        Self::new(upper, lower, &["lower.top"], quadrature)
    }

    /// Displaces the nodes of a body by the same vector.
    pub fn shift(&mut self, body: u16, by: [f64; D]) {
        let elements = (0..self.mesh.element_count()).filter(|&e| self.mesh.body[e] == body);
        let mut nodes: Vec<u32> = elements.flat_map(|e| self.mesh.element_nodes(e)).copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        for (node, i) in nodes.iter().flat_map(|n| (0..D).map(move |i| (*n as usize, i))) {
            self.u[node * D + i] += by[i];
        }
    }

    /// Pairs with a search of its own.
    pub fn pair(&mut self) {
        let mut search = Search::new(&self.contact.target, LIMITS, &self.u);
        self.contact.pair(&mut search, &self.u, &mut self.pairing);
    }

    pub fn evaluate(&mut self, request: &ContactRequest) -> Dense<D> {
        let mut dense = Dense { force: vec![0.0; self.u.len()], ..Dense::default() };
        let fields = ContactFields { u: &self.u, v: &self.v, u_start: &self.u_start };
        self.contact.evaluate(&fields, request, &self.pairing, &mut self.state, &mut dense);
        dense
    }
}
