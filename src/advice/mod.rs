//! What a user should know of a case before and at its start: units, locking, coordinates that are too
//! large, contacts that cannot close, surfaces that would not see each other.
//!
//! Each file reads the system and gives remarks, hints or an error. Nothing here changes a result.

pub mod crushed;
pub mod lifting;
pub mod locking;
pub mod magnitudes;
pub mod precision;
pub mod reach;
pub mod self_contact;
