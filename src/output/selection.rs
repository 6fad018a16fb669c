//! Selects what a rank writes: its own cells and the nodes that they use, renumbered compactly.

use crate::error::{Error, Result};

use super::vtu::{Array, VtuPiece};

/// Cells on a rank's nodes: the elements of the bodies, or the facets of the contact surfaces.
///
/// Nodes are numbered as in the rank's mesh. Only those that a selected cell uses are written.
#[derive(Debug, Clone, Copy)]
pub struct Cells<'a, const D: usize> {
    /// Reference positions of the rank's nodes \[m\].
    pub points: &'a [[f64; D]],
    /// Number of each node in the input mesh, with which the pieces can be merged.
    pub node_number: &'a [u32],
    /// Ranges of the cells in `nodes`: cell `e` has `nodes[offsets[e]..offsets[e + 1]]`.
    pub offsets: &'a [u32],
    /// Nodes of the cells in VTK's order.
    pub nodes: &'a [u32],
    /// VTK cell type of each cell.
    pub vtk_types: &'a [u8],
    /// Cells that this rank writes; each cell of the mesh is written by one rank.
    pub mine: &'a [bool],
    /// Index of the body (elements) or of the contact (facets) that a cell belongs to.
    pub group: &'a [u16],
}

/// Fields of the bodies. Nodal fields have all nodes of the rank, element fields all its elements.
#[derive(Debug, Clone, Copy)]
pub struct VolumeFields<'a> {
    /// \[m\], node-major, `D` components per node.
    pub displacement: &'a [f64],
    /// \[m/s\], node-major, `D` components per node; `None` in statics.
    pub velocity: Option<&'a [f64]>,
    /// \[Pa\], six per element: xx, yy, zz, xy, yz, xz, including the out-of-plane stress of plane
    /// strain.
    pub cauchy_stress: &'a [f64],
    /// Volume ratio of each element.
    pub det_f: &'a [f64],
}

/// Fields of the contact surfaces for all nodes of the rank. Values at nodes off the surfaces are
/// ignored.
#[derive(Debug, Clone, Copy)]
pub struct SurfaceFields<'a> {
    /// \[m\], node-major, `D` components per node.
    pub displacement: &'a [f64],
    /// `t_n` \[Pa\], positive in compression.
    pub contact_pressure: &'a [f64],
    /// Friction traction on the contactor \[Pa\], `D` components per node.
    pub traction_t: &'a [f64],
    /// `g_n` \[m\], positive if open. If there is no target opposite, a quarter of the largest
    /// facet.
    pub gap: &'a [f64],
    /// Accumulated length of slip \[m\].
    pub slip: &'a [f64],
    /// Velocity of the contactor relative to the target, in the tangent plane \[m/s\], `D`
    /// components per node.
    pub slip_velocity: &'a [f64],
    /// [`super::Status`] as its number.
    pub status: &'a [u8],
    /// Work dissipated by friction so far, per area [J/m2].
    pub friction_work: &'a [f64],
}

/// A part of a rank's mesh, to which fields are added.
#[derive(Debug)]
pub(super) struct FieldSelection {
    /// Nodes of the rank that are written, in the order in which they are first used.
    nodes: Vec<u32>,
    /// Cells of the rank that are written.
    cells: Vec<u32>,
    /// The grid, with only the fields that never change.
    grid: VtuPiece,
}

impl FieldSelection {
    pub(super) fn new<const D: usize>(mesh: &Cells<D>, group: &'static str, rank: usize) -> Self {
        let cells: Vec<u32> =
            (0..mesh.vtk_types.len() as u32).filter(|&cell| mesh.mine[cell as usize]).collect();
        let mut place = vec![None; mesh.points.len()];
        let mut nodes = Vec::new();
        let mut connectivity = Vec::new();
        let mut offsets = Vec::with_capacity(cells.len());
        for &cell in &cells {
            let [start, end] = [cell, cell + 1].map(|at| mesh.offsets[at as usize] as usize);
            for &node in &mesh.nodes[start..end] {
                let index = *place[node as usize].get_or_insert_with(|| {
                    nodes.push(node);
                    nodes.len() as i32 - 1
                });
                connectivity.push(index);
            }
            offsets.push(connectivity.len() as i32);
        }
        let points: Vec<f64> = nodes.iter().flat_map(|&node| mesh.points[node as usize]).collect();
        let numbers = nodes.iter().map(|&node| mesh.node_number[node as usize] as i32).collect();
        let groups = cells.iter().map(|&cell| i32::from(mesh.group[cell as usize])).collect();
        let ranks = vec![rank as i32; cells.len()];
        let types = cells.iter().map(|&cell| mesh.vtk_types[cell as usize]).collect();
        let grid = VtuPiece {
            points: Array::vector("Points", &points, D),
            connectivity,
            offsets,
            types,
            point_data: vec![Array::numbers("node", numbers)],
            cell_data: vec![Array::numbers(group, groups), Array::numbers("rank", ranks)],
        };
        Self { nodes, cells, grid }
    }

    pub(super) fn volume_piece(&self, fields: &VolumeFields, dimension: usize) -> Result<VtuPiece> {
        let mut piece = self.grid.clone();
        piece.point_data.push(self.nodal("displacement", fields.displacement, dimension)?);
        if let Some(velocity) = fields.velocity {
            piece.point_data.push(self.nodal("velocity", velocity, dimension)?);
        }
        let stress = gather("cauchy_stress", fields.cauchy_stress, &self.cells, 6)?;
        piece.cell_data.push(Array::symmetric_tensor("cauchy_stress", stress));
        piece.cell_data.push(Array::scalar("det_f", gather("det_f", fields.det_f, &self.cells, 1)?));
        Ok(piece)
    }

    pub(super) fn surface_piece(&self, fields: &SurfaceFields, dimension: usize) -> Result<VtuPiece> {
        let mut piece = self.grid.clone();
        piece.point_data.extend([
            self.nodal("displacement", fields.displacement, dimension)?,
            self.nodal("contact_pressure", fields.contact_pressure, 1)?,
            self.nodal("traction_t", fields.traction_t, dimension)?,
            self.nodal("gap", fields.gap, 1)?,
            self.nodal("slip", fields.slip, 1)?,
            self.nodal("slip_velocity", fields.slip_velocity, dimension)?,
            Array::codes("status", gather("status", fields.status, &self.nodes, 1)?),
            self.nodal("friction_work", fields.friction_work, 1)?,
        ]);
        Ok(piece)
    }

    fn nodal(&self, name: &'static str, values: &[f64], components: usize) -> Result<Array> {
        let chosen = gather(name, values, &self.nodes, components)?;
        Ok(if components == 1 {
            Array::scalar(name, chosen)
        } else {
            Array::vector(name, &chosen, components)
        })
    }
}

fn gather<T: Copy>(name: &str, values: &[T], entities: &[u32], components: usize) -> Result<Vec<T>> {
    let mut chosen = Vec::with_capacity(entities.len() * components);
    for &entity in entities {
        let start = entity as usize * components;
        let Some(found) = values.get(start..start + components) else {
            return Err(Error::internal(format!(
                "field `{name}` has {} values, too few for its mesh",
                values.len()
            )));
        };
        chosen.extend_from_slice(found);
    }
    Ok(chosen)
}
