//! Reference elements, quadrature, facet geometry, prescribed degrees of freedom, points in
//! elements.
//!
//! A reference element is data: its nodes and, for each shape function, a product of affine factors
//! (see [`shape`]). Values, gradients and second derivatives of every element follow from a single
//! product rule.

mod dofs;
mod facet;
mod held;
mod hexes;
mod layout;
mod lines;
mod locate;
mod pyramids;
mod quadrature;
mod quads;
mod reference;
pub mod shape;
mod tets;
mod triangles;
mod wedges;

pub use dofs::{DisplacementBoundary, DofMap, Prescribed, PrescribedFields, PrescribedState};
pub use facet::{Tangents, area_variation, facet_normal, facet_tangents};
pub use held::Held;
pub use locate::{ElementTree, Located, Nearest, locate, nearest_node, pull_back};
pub use quadrature::Rule;
pub use reference::{ReferenceElement, ShapeTable, reference};
