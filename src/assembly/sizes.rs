//! Sizes of nodal fields, with which errors in time are measured and compared.

use super::system::ContactSystem;
use crate::dynamics::MultigridHints;
use crate::error::Result;
use crate::petsc::Vector;

impl<const D: usize> ContactSystem<D> {
    /// Root mean square of a nodal field, weighted by the mass. In systems without mass, all nodes
    /// have equal weight. `weight` is that of [`weight`](Self::weight). Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn mean_size(&mut self, field: &Vector, weight: f64) -> Result<f64> {
        let square = self.weighted_square(field)?;
        Ok((square / weight).max(0.0).sqrt())
    }

    pub(super) fn weighted_square(&mut self, field: &Vector) -> Result<f64> {
        let Some(mass) = &self.mass else { return field.dot(field) };
        mass.multiply(field, &mut self.work)?;
        field.dot(&self.work)
    }

    /// Mass of all bodies \[kg\], or the number of nodes in systems without mass. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn weight(&mut self) -> Result<f64> {
        if self.mass.is_none() {
            return Ok(f64::from(self.local.index.total));
        }
        let mut ones = self.forces.like()?;
        ones.set(1.0);
        Ok(self.weighted_square(&ones)? / D as f64)
    }

    /// Sets entries to zero that errors do not count: prescribed unknowns, and the normal part at
    /// nodes in contact that have mass. Collective.
    ///
    /// Such nodes oscillate on the penalty along the normal. Their bodies respond only to what this
    /// moves at the nodes behind them. If most nodes are in contact, the normal part is kept.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn clear_uncounted(&mut self, field: &mut Vector) -> Result<()> {
        self.clear_prescribed(field);
        if self.contacts.iter().all(|contact| self.is_calm(contact)) {
            return Ok(());
        }
        let mut normals = self.pattern_vector().like()?;
        self.contact_normals(&mut normals)?;
        if 2.0 * normals.dot(&normals)? > f64::from(self.local.index.total) {
            return Ok(());
        }
        let (mut owned, normals) = (field.owned_mut(), normals.owned());
        for (value, normal) in owned.chunks_exact_mut(D).zip(normals.chunks_exact(D)) {
            let along: f64 = value.iter().zip(normal).map(|(v, n)| v * n).sum();
            value.iter_mut().zip(normal).for_each(|(v, n)| *v -= along * n);
        }
        Ok(())
    }

    /// Sets the entries of prescribed unknowns to zero.
    fn clear_prescribed(&self, field: &mut Vector) {
        let mut owned = field.owned_mut();
        let held = self.supports.dofs.constrained.iter();
        owned.iter_mut().zip(held).filter(|(_, held)| **held).for_each(|(value, _)| *value = 0.0);
    }
}
