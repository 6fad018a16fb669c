//! Work phases whose time is recorded.

use std::rc::Rc;

use crate::error::Result;
use crate::petsc::{Event, Session};

/// The work phases whose time is recorded.
pub(super) struct Phases {
    pub contact: Event,
    pub forces: Event,
    pub tangent: Event,
    pub search: Event,
    pub exchange: Event,
}

impl Phases {
    /// Registers the phases with PETSc.
    ///
    /// # Errors
    /// If a PETSc call fails.
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
