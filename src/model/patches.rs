//! Patches of elements that share a pressure near incompressibility.

use super::Model;
use super::regions::ElementMaterials;
use crate::mesh::{Mesh, element_patches};

impl<const D: usize> Model<D> {
    /// Divides the elements whose treatment of locking is one pressure for several elements into patches.
    /// Patches depend on the whole mesh, so that they are the same on any number of ranks.
    pub fn add_patches(&self, mesh: &mut Mesh<D>) {
        let materials = ElementMaterials::new(&self.bodies, mesh);
        let label = |element: usize| {
            let body = mesh.body[element];
            let material = materials.within(element);
            let formulation = &self.bodies[usize::from(body)].materials[material].formulation;
            formulation.shares_pressure(mesh.kinds[element]).then_some((body, material as u32))
        };
        let labels: Vec<_> = (0..mesh.element_count()).map(label).collect();
        mesh.patches = element_patches(mesh, &labels);
    }
}
