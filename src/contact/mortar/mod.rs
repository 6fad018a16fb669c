//! Contact by mortar segments and vertices (theory, chapter 1).
//!
//! A contact point is a vertex of the contactor. Its gap, normal and slip are means, weighted by
//! the linear function of the vertex. The means cover the segments that the surrounding facets
//! share with facets of the target. Over a rigid obstacle they cover the facets themselves. Only
//! the history of the contact laws is carried from iterate to iterate.
//!
//! The modules in order of execution:
//!
//! - `broad_phase` finds candidate pairs.
//! - `intersection` finds the segments of two pieces (`line` in the plane, `polygon` in space).
//! - [`integrals`] integrates over a pair of facets, and `over_obstacle` over an obstacle. `products`
//!   adds up the derivatives, and `potential` has those of second order.
//! - `facing` weights facets by the angle to the other side.
//! - `smooth_parts` divides the facets around a node at sharp edges.
//! - [`kernel`] evaluates the laws of a vertex.
//! - [`tied`] ties two surfaces in the reference configuration.
//! - [`contact`] combines them, and `over_step` does so for the conserving scheme. `moving` does so
//!   over a moving rigid body.
//! - [`resultant`] adds up the forces on the contactor for output.

mod broad_phase;
pub mod candidates;
mod clip;
pub mod contact;
pub mod facing;
pub mod integrals;
pub mod intersection;
pub mod kernel;
mod line;
mod moving;
pub mod obstacle;
mod over_obstacle;
mod over_step;
mod overlap;
mod parametric;
mod polygon;
mod potential;
mod products;
pub mod resultant;
pub mod segment;
pub mod shape;
mod smooth_parts;
pub mod split;
pub mod surface;
pub mod tied;
