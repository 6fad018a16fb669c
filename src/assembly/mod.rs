//! Combines element kernels, contact and PETSc: residual and matrix of the whole system (3.5),
//! (3.9).
//!
//! Each rank evaluates every element and facet that touches one of its nodes and keeps its own
//! rows. The assembly therefore sends nothing to other ranks.

mod augmentation;
mod balance;
mod bodies;
mod body_sums;
mod build;
mod contact;
mod contact_forces;
mod damping;
mod elastic;
mod equations;
mod external;
mod forces;
mod free_bodies;
mod holding;
mod initial_velocity;
mod interface;
mod mass;
mod memory;
mod observed;
mod pair;
mod patches;
mod pattern;
mod phases;
mod pieces;
mod redistribution;
mod renewal;
mod rigid;
mod rollers;
mod rounding;
mod scatter;
mod slip_limit;
mod solid;
mod soundness;
mod stages;
mod start;
mod state_part;
mod supports;
mod system;
mod tangent;
pub mod targets;
mod ties;
mod tools;
mod viscous;

pub use augmentation::{depths, excess_penetration};
pub use bodies::Bodies;
pub use body_sums::BodySums;
pub use build::sides_of;
pub use contact::{LocalContact, facets_of};
pub use elastic::ElasticSupports;
pub use free_bodies::{MotionSums, RigidVelocity, TurnDirection};
pub use holding::Holding;
pub use initial_velocity::set_velocity;
pub use memory::{NamedFields, StoredSources, StoredState, SystemState, state_tables};
pub use observed::ContactResultants;
pub use solid::SolidElements;
pub use soundness::unsound_state;
pub use start::Overclosure;
pub use state_part::{StatePart, from_numbers, named, numbers_of};
pub use supports::Supports;
pub use system::{ContactSystem, SystemOptions};
pub use ties::Ties;
pub use tools::ToolState;
