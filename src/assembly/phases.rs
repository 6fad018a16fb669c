//! Phases of the work whose time is recorded.

use std::rc::Rc;

use crate::error::Result;
use crate::petsc::{Event, Session};

/// Phases whose time is recorded.
pub(super) struct Phases {
    pub contact: Event,
    pub forces: Event,
    pub tangent: Event,
    pub search: Event,
    pub exchange: Event,
}

impl Phases {
    /// Registers them with PETSc.
    ///
    /// # Errors
    /// a PETSc call fails.
    pub fn register(session: &Rc<Session>) -> Result<Self> {
        Ok(Self {
            contact: Event::register(session, "Contact")?,
            forces: Event::register(session, "ElementForces")?,
            tangent: Event::register(session, "Tangent")?,
            search: Event::register(session, "ContactSearch")?,
            exchange: Event::register(session, "ContactExchange")?,
        })
    }
}
