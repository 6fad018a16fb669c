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
mod energy;
mod equations;
mod external;
mod fields;
mod forces;
mod interface;
mod lifting;
mod locking;
mod mass;
mod memory;
mod pair;
mod passage;
mod pattern;
mod phases;
mod pieces;
mod precision;
mod redistribution;
mod renewal;
mod report;
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
pub use energy::{Balances, Energies, EnergyLedger, Momentum, SavedLedger};
pub use fields::{ContactFields, StressFields, SurfaceCells};
pub use memory::{NamedFields, StoredSources, StoredState, SystemState};
pub use precision::{Motions, Precision};
pub use report::{ContactSummary, NodalContact, PointReport, Watched};
pub use slide::Slide;
pub use start::Overclosure;
pub use system::{ContactSystem, SystemOptions};
