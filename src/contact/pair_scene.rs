//! Blocks and laws for the tests of contact between bodies.

use super::damping::ContactDamping;
use super::evaluation::AreaKind;
use super::friction::coefficient::Constant;
use super::friction::{Coulomb, Friction, Regularization};
use super::mortar::contact::VertexContact;
use super::mortar::integrals::NormalOf;
use super::mortar::surface::VertexSurface;
use super::normal::NormalLaw;
use super::point::ContactLaw;
use super::target::{ContactTarget, TargetFacets, TargetSurface};
use crate::mesh::{BoxShape, ElementKind, Mesh};

pub const COMPLIANCE: f64 = 1e-8;

pub fn coulomb(mu: f64, regularization: Regularization) -> Friction {
    Friction { law: Coulomb::of(Constant(mu), regularization).into(), regularization }
}

pub fn penalty(friction: Option<Friction>) -> ContactLaw {
    ContactLaw { normal: NormalLaw::penalty(COMPLIANCE), friction, damping: ContactDamping::default() }
}

/// A contact without friction that has no memory of its start.
pub fn frictionless<const D: usize>(surface: VertexSurface<D>, target: ContactTarget<D>) -> VertexContact<D> {
    VertexContact {
        surface,
        target,
        law: penalty(None),
        area: AreaKind::Current,
        depth: 0.5,
        share: 1.0,
        closed: 0.0,
        edge_normal: NormalOf::Contactor,
    }
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
        facets.push(mesh.facet_kind(facet), &nodes, identity, mesh.body[facet.element as usize], false);
    }
    TargetSurface::new(facets, &mesh.points)
}
