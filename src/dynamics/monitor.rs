//! What Newton's method needs to know of contact: counts and safeguards.

use serde::{Deserialize, Serialize};

use super::{Equations, Residual, Stage};
use crate::error::Result;
use crate::petsc::Vector;

/// Numbers of contact points of an iterate. Each point is counted once.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ContactCounts {
    /// Closed points.
    pub closed: u64,
    /// Closed points with more than a touching contact. At other closed points, rounding decides
    /// the sign of the gap.
    pub pressing: u64,
    /// Closed points that stick.
    pub stick: u64,
    /// Closed points that slip.
    pub slip: u64,
    /// Points whose status differs from the previous iterate.
    pub changed: u64,
    /// Points whose slip direction reversed.
    pub flipped: u64,
}

/// Monitoring of the contact points during the iterations. The defaults are those of a system
/// without contact.
pub trait ContactMonitor: Equations {
    /// Compares the contact points with the previous iterate and activates the safeguards.
    /// Collective.
    ///
    /// # Errors
    /// If another rank failed.
    fn observe(&mut self) -> Result<ContactCounts> {
        Ok(ContactCounts::default())
    }

    /// Discards the iterates of the last solve.
    fn rewind(&mut self) {}

    /// Whether [`ContactMonitor::predicted_residual`] is the better right side for the next correction.
    fn predicts(&self) -> bool {
        false
    }

    /// Computes the residual with stick assumed where the slip direction flipped, and with the laws of
    /// contact continued from the linearised gaps to the gaps. Collective.
    ///
    /// It is the right side of the next correction, and [`Equations::jacobian`] always assembles the
    /// matching matrix. Call it after [`Equations::residual`] at the same state, because it
    /// recomputes only the contact forces.
    ///
    /// # Errors
    /// If a PETSc call fails.
    fn predicted_residual(&mut self, stage: &Stage, out: &mut Vector) -> Result<Residual> {
        self.residual(stage, out)
    }

    /// Largest motion of a node in one correction of bodies that only contact holds \[m\].
    ///
    /// Without this limit, a body that nothing holds yet would pass through its target in a single
    /// correction.
    fn stride(&self) -> f64 {
        f64::INFINITY
    }

    /// Describes the contact points that changed last, as a phrase for a message. Empty if no point
    /// changed.
    fn restless_points(&self) -> String {
        String::new()
    }
}
