//! Averages of the stress at nodes, weighted by the volume of the elements around them.
//!
//! Every element extrapolates its points to its nodes by a linear fit. An element enters on the rank to
//! which it belongs. Each material has its own average, because some components of the stress jump at an
//! interface. Bodies share no nodes, so that nothing is averaged across them (theory, section 3.17).

use crate::assembly::ContactSystem;
use crate::dynamics::Stage;
use crate::element::{Cauchy, ElementStress};
use crate::error::Result;
use crate::petsc::Vector;

/// Sums from which the averages are computed.
pub struct NodalStress {
    /// For each node and each material of a body six sums and the volume.
    sums: Vector,
    materials: usize,
}

impl NodalStress {
    /// Numbers of a node and material: six components and the volume.
    const WIDTH: usize = 7;

    /// Sums without any element.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn new<const D: usize>(system: &ContactSystem<D>) -> Result<Self> {
        let index = &system.bodies().local().index;
        let materials = system.bodies().materials().most();
        let sums = Vector::ghosted(system.session(), index.owned, Self::WIDTH * materials, &index.ghosts)?;
        Ok(Self { sums, materials })
    }

    /// The averages of all elements at the trial state, as of [`means`](Self::means). Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn of_state<const D: usize>(system: &ContactSystem<D>, stage: &Stage) -> Result<Vec<Cauchy>> {
        let mut nodes = Self::new(system)?;
        system.bodies().element_stress(stage, |element, stress| nodes.add(system, element, stress));
        nodes.means()
    }

    /// Adds an element of the mesh of this rank.
    pub fn add<const D: usize>(&mut self, system: &ContactSystem<D>, element: usize, stress: &ElementStress) {
        let local = system.bodies().local();
        if !local.mine[element] {
            return;
        }
        let material = system.bodies().materials().within(element);
        let mut sums = self.sums.local_mut();
        for (&node, state) in local.mesh.element_nodes(element).iter().zip(&stress.nodes) {
            let place = node as usize * self.materials + material;
            let row = &mut sums[place * Self::WIDTH..][..Self::WIDTH];
            let parts = state.cauchy.0.iter().chain([&1.0]);
            row.iter_mut().zip(parts).for_each(|(sum, value)| *sum += stress.volume * value);
        }
    }

    /// The averages \[Pa\] at the local nodes, including ghosts: `[node * materials + material]` with the
    /// number of materials of the body that has most of them. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn means(mut self) -> Result<Vec<Cauchy>> {
        self.sums.add_ghosts_to_owners()?;
        self.sums.update_ghosts()?;
        let mean = |row: &[f64]| {
            let volume = row[Self::WIDTH - 1];
            // Nodes of free rigid bodies belong to no element, and most nodes to one material.
            Cauchy(std::array::from_fn(|i| if volume > 0.0 { row[i] / volume } else { 0.0 }))
        };
        Ok(self.sums.local().chunks_exact(Self::WIDTH).map(mean).collect())
    }
}
