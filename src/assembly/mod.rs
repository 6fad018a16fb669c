//! Combines element kernels, contact and PETSc: residual and matrix of the whole system (3.5),
//! (3.9).
//!
//! Each rank evaluates every element and facet that touches one of its nodes and keeps its own
//! rows. The assembly therefore sends nothing to other ranks.

mod accuracy;
mod apart;
mod balance;
mod bodies;
mod build;
mod closing;
mod contact;
mod contact_forces;
mod crushed;
mod equations;
mod external;
mod forces;
mod interface;
mod lifting;
mod locking;
mod mass;
mod memory;
mod observed;
mod pair;
mod passage;
mod pattern;
mod phases;
mod pieces;
mod precision;
mod redistribution;
mod renewal;
mod rigid;
mod rounding;
mod scatter;
mod sizes;
mod slide;
mod solid;
mod soundness;
mod stages;
mod start;
mod supports;
mod system;
mod tangent;
pub mod targets;

pub use accuracy::{Asked, Stuck};
pub use apart::Span;
pub use closing::Closing;
pub use contact::LocalContact;
pub use precision::{Motions, Precision};
pub use slide::Slide;
pub use start::Overclosure;
pub use system::{ContactSystem, SystemOptions};
