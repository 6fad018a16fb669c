//! Fields for result files: stress of the elements, contact at the nodes of the contactors.

use super::report::NodalSums;
use super::system::ContactSystem;
use crate::error::Result;
use crate::petsc::Vector;

/// Stress and volume ratio of each local element.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StressFields {
    /// Mean Cauchy stress `xx, yy, zz, xy, yz, xz` \[Pa\], six an element.
    pub cauchy_stress: Vec<f64>,
    /// Mean `det F`.
    pub det_f: Vec<f64>,
}

/// Contact at each local node; zero off the contactors.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ContactFields {
    /// `t_n` \[Pa\].
    pub contact_pressure: Vec<f64>,
    /// `t_T` \[Pa\], D values a node.
    pub traction_t: Vec<f64>,
    /// `g_n` \[m\].
    pub gap: Vec<f64>,
    /// Path slid in contact \[m\].
    pub slip: Vec<f64>,
    /// `v_T` \[m/s\], D values a node.
    pub slip_velocity: Vec<f64>,
    /// 0 open, 1 stick, 2 slip.
    pub status: Vec<u8>,
    /// Heat of friction [J/m2].
    pub friction_work: Vec<f64>,
}

/// Facets of all contactors of a rank as cells.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SurfaceCells {
    /// Start of each facet in `nodes`, one more than facets.
    pub offsets: Vec<u32>,
    /// Local nodes.
    pub nodes: Vec<u32>,
    /// VTK's number of each kind.
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

    /// Contact at the local nodes, ghosts included. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub fn contact_fields(&self) -> Result<ContactFields> {
        const WIDTH: usize = NodalSums::FIELDS + 1;
        let index = &self.local.index;
        let mut gathered = Vector::ghosted(&self.session, index.owned, WIDTH, &index.ghosts)?;
        for contact in 0..self.contacts.len() {
            let sums = self.nodal_sums(contact)?;
            let mut values = gathered.owned_mut();
            for (node, row) in values.chunks_exact_mut(WIDTH).enumerate() {
                row[0] += sums.weights[node];
                let own = &sums.sums[node * NodalSums::FIELDS..][..NodalSums::FIELDS];
                row[1..].iter_mut().zip(own).for_each(|(total, part)| *total += part);
            }
        }
        gathered.update_ghosts()?;
        let values = gathered.local();
        let mut fields = ContactFields::default();
        for row in values.chunks_exact(WIDTH) {
            let mean = |k: usize| if row[0] > 0.0 { row[1 + k] / row[0] } else { 0.0 };
            fields.contact_pressure.push(mean(0));
            fields.gap.push(mean(2));
            fields.slip.push(mean(6));
            fields.friction_work.push(mean(7));
            fields.traction_t.extend((0..D).map(|i| mean(8 + i)));
            fields.slip_velocity.extend((0..D).map(|i| mean(11 + i)));
            let (closed, slips) = (mean(4), mean(5));
            fields.status.push(if closed < 0.5 { 0 } else { 1 + u8::from(slips >= 0.5 * closed) });
        }
        Ok(fields)
    }
}
