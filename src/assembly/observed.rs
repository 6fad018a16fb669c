//! What observers may read of a system, see [`crate::observe`].

use super::contact::LocalContact;
use super::system::ContactSystem;
use crate::element::ElementStress;
use crate::error::Result;
use crate::petsc::Vector;
use crate::space::Prescribed;

impl<const D: usize> ContactSystem<D> {
    /// The contacts with their points on this rank.
    pub fn contacts(&self) -> &[LocalContact<D>] {
        &self.contacts
    }

    /// The displacement boundaries with their unknowns on this rank.
    pub fn boundaries(&self) -> &[Prescribed] {
        &self.supports.dofs.boundaries
    }

    /// Whether each local unknown is prescribed.
    pub fn constrained(&self) -> &[bool] {
        &self.supports.dofs.constrained
    }

    /// Loads on the owned unknowns at the last residual \[N\].
    pub fn external_forces(&self) -> &[f64] {
        &self.parts.external
    }

    /// Strain energy of this rank's elements at the local displacements `u` \[J\].
    pub fn strain_energy(&self, u: &[f64]) -> f64 {
        self.solids.iter().map(|solid| solid.group.strain_energy(u, &self.local.mine)).sum()
    }

    /// Passes the stress of each local element at the displacement `u` \[m\] to
    /// `receive(element, stress)`.
    pub fn element_stress(&self, u: &Vector, mut receive: impl FnMut(usize, &ElementStress)) {
        let u = u.local();
        for solid in &self.solids {
            let elements = solid.group.elements();
            solid.group.stress(&u, |index, stress| receive(elements[index] as usize, stress));
        }
    }

    /// Computes the momenta of the nodes, `out = M v` \[N s\]. Returns `false` if the system has no
    /// mass. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn momenta(&self, v: &Vector, out: &mut Vector) -> Result<bool> {
        let Some(mass) = &self.mass else { return Ok(false) };
        mass.multiply(v, out)?;
        Ok(true)
    }

    /// Names of the contacts with their normal stiffness at a high pressure (a tenth of the softer
    /// modulus), relative to that of the elements beneath them.
    pub fn relative_stiffnesses(&self) -> impl Iterator<Item = (&str, f64)> {
        self.contacts.iter().map(|contact| {
            let law = contact.law().normal;
            let modulus = contact.beneath * contact.facet_size;
            let stiffness = -law.evaluate(-law.penetration(0.1 * modulus)).derivative;
            (contact.name.as_str(), stiffness / contact.beneath)
        })
    }
}
