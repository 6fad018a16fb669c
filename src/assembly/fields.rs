//! Fields for result files: stress of the elements, contact at the nodes of the contactors.

use super::report::NodalSums;
use super::system::ContactSystem;
use crate::error::Result;
use crate::petsc::Vector;

/// Stress and volume ratio of each local element.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StressFields {
    /// Mean Cauchy stress `xx, yy, zz, xy, yz, xz` \[Pa\], six values per element.
    pub cauchy_stress: Vec<f64>,
    /// Mean `det F`.
    pub det_f: Vec<f64>,
}

/// Contact quantities at each local node; zero at nodes that are not on a contactor.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ContactFields {
    /// Contact pressure `t_n` \[Pa\].
    pub contact_pressure: Vec<f64>,
    /// Friction traction `t_T` \[Pa\], D values per node.
    pub traction_t: Vec<f64>,
    /// Gap `g_n` \[m\].
    pub gap: Vec<f64>,
    /// Slip path in contact \[m\].
    pub slip: Vec<f64>,
    /// Slip velocity `v_T` \[m/s\], D values per node.
    pub slip_velocity: Vec<f64>,
    /// Status: 0 open, 1 stick, 2 slip.
    pub status: Vec<u8>,
    /// Frictional heat [J/m2].
    pub friction_work: Vec<f64>,
}

/// Facets of all contactors of a rank as cells.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SurfaceCells {
    /// Start of each facet in `nodes`, with one entry more than facets.
    pub offsets: Vec<u32>,
    /// Local nodes.
    pub nodes: Vec<u32>,
    /// VTK cell type of each facet.
    pub vtk_types: Vec<u8>,
    /// Index of the contact.
    pub contact: Vec<u16>,
}

impl<const D: usize> ContactSystem<D> {
    /// Stress of the local elements at the local displacement `u` \[m\].
    pub fn stress_fields(&self, u: &Vector) -> StressFields {
        let elements = self.local.mesh.element_count();
        let mut fields = StressFields { cauchy_stress: vec![0.0; 6 * elements], det_f: vec![0.0; elements] };
        let u = u.local();
        for solid in &self.solids {
            solid.group.stress(&u, |index, stress| {
                let element = solid.group.elements()[index] as usize;
                fields.cauchy_stress[6 * element..6 * element + 6].copy_from_slice(&stress.mean.cauchy.0);
                fields.det_f[element] = stress.mean.det_f;
            });
        }
        fields
    }

    /// The facets of the contactors.
    pub fn surface_cells(&self) -> SurfaceCells {
        let mut cells = SurfaceCells { offsets: vec![0], ..SurfaceCells::default() };
        for (number, contact) in self.contacts.iter().enumerate() {
            let surface = contact.surface();
            for facet in surface.facets() {
                cells.nodes.extend_from_slice(surface.facet_nodes(facet));
                cells.offsets.push(cells.nodes.len() as u32);
                cells.vtk_types.push(facet.kind.vtk_type());
                cells.contact.push(number as u16);
            }
        }
        cells
    }

    /// Contact quantities at the local nodes, including ghosts. Collective.
    ///
    /// At a node of several contacts, tractions and work are summed and the gap is the smallest.
    /// The node slips if it slips in any of them.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn contact_fields(&self) -> Result<ContactFields> {
        const WIDTH: usize = 12;
        let index = &self.local.index;
        let mut gathered = Vector::ghosted(&self.session, index.owned, WIDTH, &index.ghosts)?;
        for contact in 0..self.contacts.len() {
            let sums = self.nodal_sums(contact)?;
            let mut values = gathered.owned_mut();
            for (node, row) in values.chunks_exact_mut(WIDTH).enumerate() {
                let weight = sums.weights[node];
                if weight <= 0.0 {
                    continue;
                }
                let mean = |k: usize| sums.sums[node * NodalSums::FIELDS + k] / weight;
                let closed = mean(4) >= 0.5;
                let slips = mean(5) >= 0.5 * mean(4);
                let status = f64::from(u8::from(closed) + u8::from(closed && slips));
                let known = row[0] > 0.0;
                row[0] = 1.0;
                row[1] += mean(0);
                row[2] = if known { row[2].min(mean(2)) } else { mean(2) };
                row[3] = row[3].max(mean(6));
                row[4] += mean(7);
                row[5] = row[5].max(status);
                for i in 0..D {
                    row[6 + i] += mean(8 + i);
                    if closed || !known {
                        row[9 + i] = mean(11 + i);
                    }
                }
            }
        }
        gathered.update_ghosts()?;
        let values = gathered.local();
        let mut fields = ContactFields::default();
        for row in values.chunks_exact(WIDTH) {
            fields.contact_pressure.push(row[1]);
            fields.gap.push(row[2]);
            fields.slip.push(row[3]);
            fields.friction_work.push(row[4]);
            fields.status.push(row[5] as u8);
            fields.traction_t.extend_from_slice(&row[6..6 + D]);
            fields.slip_velocity.extend_from_slice(&row[9..9 + D]);
        }
        Ok(fields)
    }
}
