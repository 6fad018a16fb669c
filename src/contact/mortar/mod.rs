//! Contact by mortar segments and vertices (theory, chapter 1).
//!
//! A contact point is a vertex of the contactor. Its gap, normal and slip are means over the segments that the facets around it share
//! with facets of the target, or over those facets where the target is a rigid obstacle, weighted by the linear function of the vertex:
//! [`segment`] finds segments, [`integrals`] integrates over a pair of facets, [`obstacle`] over an obstacle, [`kernel`] evaluates the laws of a vertex, [`contact`] puts them together. Nothing is remembered from iterate
//! to iterate but what the laws of a vertex remember.

pub mod candidates;
mod clip;
pub mod contact;
pub mod integrals;
pub mod kernel;
mod line;
pub mod obstacle;
mod over_step;
mod parametric;
mod polygon;
pub mod segment;
pub mod shape;
pub mod split;
pub mod surface;
