//! Contact by mortar segments and vertices (theory, chapter 1).
//!
//! A contact point is a vertex of the contactor. Its gap, normal and slip are means over the segments that the facets around it share
//! with facets of the target, or over those facets where the target is a rigid obstacle, weighted by the linear function of the vertex.
//! Nothing is remembered from iterate to iterate except what the laws of a vertex remember.
//!
//! In the order of the work: `broad_phase` finds candidate pairs, `intersection` the segments of two pieces (`line` in the plane,
//! `polygon` in space), [`integrals`] integrates over a pair of facets and `over_obstacle` over an obstacle, [`kernel`] evaluates the laws of
//! a vertex, [`contact`] puts them together, and `over_step` does so for the conserving scheme.

mod broad_phase;
pub mod candidates;
mod clip;
pub mod contact;
pub mod integrals;
pub mod intersection;
pub mod kernel;
mod line;
pub mod obstacle;
mod over_obstacle;
mod over_step;
mod overlap;
mod parametric;
mod polygon;
pub mod segment;
pub mod shape;
pub mod split;
pub mod surface;
