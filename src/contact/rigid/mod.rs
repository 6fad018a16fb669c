//! Rigid bodies: where they are, how they move, and the frame in which a contact sees them at rest
//! (theory, section 1.12).

mod frame;
mod free;
mod placement;
mod prescribed;

pub use frame::{BodyFrame, SeenNode, TargetLoad};
pub use free::{FreeRigid, MassProperties, PoseVariations, principal_axes};
pub use placement::Placement;
pub use prescribed::{BodyMotion, MotionInstant, MotionStep, RigidState};
