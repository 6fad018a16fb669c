//! Residual that is left by the rounding of displacements and positions.

use mpi::collective::SystemOperation;

use super::system::ContactSystem;
use crate::collective::Collective;
use crate::dynamics::Stage;
use crate::error::Result;

impl<const D: usize> ContactSystem<D> {
    /// Norm of the residual if the displacement of each node has its rounding error, and each
    /// closed gap that of a position \[N\]. Collective.
    ///
    /// It uses the matrix that was assembled last. It does not decrease with the load.
    pub(super) fn rounding_of_forces(&self, stage: &Stage) -> Result<f64> {
        let mut diagonal = self.pattern_vector().like()?;
        self.matrix.diagonal(&mut diagonal)?;
        let (stiffness, u) = (diagonal.owned(), stage.trial.u.owned());
        let free = self.bodies.held().axes().iter().map(|held| !held);
        let own = stiffness.iter().zip(u.iter()).zip(free).filter(|(_, free)| *free);
        let bodies: f64 = own.map(|((stiffness, u), _)| (stiffness * u).powi(2)).sum();
        let contacts: f64 = self.contacts.iter().map(|contact| contact.squared_stiffness()).sum();
        let own = bodies + contacts * self.bodies.extent.farthest.powi(2);
        let mut all = 0.0_f64;
        self.bodies.session.world().reduce_all(&own, &mut all, SystemOperation::sum());
        Ok(f64::EPSILON * all.sqrt())
    }
}

impl<const D: usize> super::contact::LocalContact<D> {
    /// Sum of the squared normal stiffnesses of the closed parts of this rank's facets [N^2/m^2].
    fn squared_stiffness(&self) -> f64 {
        let law = &self.law().normal;
        let closed = self.state.current.iter();
        let stiffness = |gap: f64, area: f64| (area * law.evaluate(gap.min(0.0)).derivative).powi(2);
        closed.filter(|point| point.is_closed()).map(|point| stiffness(point.gap, point.area)).sum()
    }
}
