//! The part of the journal that writes fields: from the system's arrays to the pieces that ParaView
//! reads.

use super::field_output::FieldOutput;
use super::journal::Journal;
use crate::assembly::ContactSystem;
use crate::case::FieldFormat;
use crate::dynamics::Stage;
use crate::error::Result;
use crate::observe::energy::EnergyLedger;
use crate::observe::fields::{SurfaceCells, body_fields, surface_cells, surface_fields};
use crate::output::fields::{CellMaterials, Cells, FieldWriter, Ranks};
use crate::output::grids::{GridCells, GridFields};
use crate::output::vtkhdf::OneFileWriter;

impl<const D: usize> Journal<D> {
    /// The writer for the fields of this rank.
    pub(super) fn field_writer(&self, system: &ContactSystem<D>) -> Result<FieldOutput<D>> {
        let local = system.bodies().local();
        let types: Vec<u8> = local.mesh.kinds.iter().map(|kind| kind.vtk_type()).collect();
        let materials = system.bodies().materials();
        let numbers: Vec<u32> =
            (0..types.len()).map(|element| materials.of(&local.mesh, element) as u32).collect();
        let volume = Cells {
            points: &local.mesh.points,
            node_number: &local.input_node,
            offsets: &local.mesh.offsets,
            nodes: &local.mesh.nodes,
            vtk_types: &types,
            mine: &local.mine,
            group: &local.mesh.body,
            materials: materials.are_several().then_some(CellMaterials {
                number: &numbers,
                within: materials.indices(),
                layers: if self.stresses { materials.most() } else { 1 },
            }),
        };
        let SurfaceCells { offsets, nodes, vtk_types, contact } = surface_cells(system);
        let surface = Cells {
            points: &local.mesh.points,
            node_number: &local.input_node,
            offsets: &offsets,
            nodes: &nodes,
            vtk_types: &vtk_types,
            mine: &vec![true; vtk_types.len()],
            group: &contact,
            materials: None,
        };
        let ranks = Ranks { rank: self.session.rank() as usize, size: self.session.size() as usize };
        let surface = (!system.contacts().is_empty()).then_some(surface);
        let rigid = &self.rigid_surfaces;
        let all = vec![true; rigid.vtk_types.len()];
        let rigid = Cells {
            points: &rigid.points,
            node_number: &rigid.numbers,
            offsets: &rigid.offsets,
            nodes: &rigid.nodes,
            vtk_types: &rigid.vtk_types,
            mine: &all,
            group: &rigid.body,
            materials: None,
        };
        let rigid = (!self.rigid_shapes.is_empty()).then_some(rigid);
        let cells = GridCells { volume, surface, rigid };
        let folder = &self.shared_folder;
        Ok(match self.format {
            FieldFormat::Vtu => FieldOutput::Pieces(FieldWriter::new(folder, ranks, &cells)?),
            FieldFormat::Vtkhdf => FieldOutput::OneFile(OneFileWriter::new(folder, ranks, &cells)?),
        })
    }

    /// Writes the fields of a state if the case requests fields. Collective.
    ///
    /// # Errors
    /// A file can not be written; the error is the same on all ranks.
    pub(super) fn write_fields(
        &mut self,
        system: &ContactSystem<D>,
        stage: &Stage,
        ledger: &EnergyLedger,
    ) -> Result<()> {
        let Some(writer) = &mut self.fields else { return Ok(()) };
        let volume = body_fields(system, stage, self.stresses)?;
        let surface = surface_fields(system, stage)?;
        let surface = (!system.contacts().is_empty()).then_some(&surface[..]);
        let rigid = [self.rigid_surfaces.displacement(ledger.rigid().map(|(state, _)| state))];
        let rigid = (!self.rigid_shapes.is_empty()).then_some(&rigid[..]);
        let fields = GridFields { volume: &volume, surface, rigid };
        writer.write(self.session.world(), self.step, stage.trial.time, &fields)
    }
}
