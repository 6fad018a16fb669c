//! Selects what a rank writes: its own cells and the nodes that they use, renumbered compactly.

use crate::error::{Error, Result};

use super::vtu::{Array, VtuPiece};
use crate::observe::fields::{Field, FieldValues, Location};
use crate::observe::quantity::{QuantityShape, ReportedQuantity};

/// Cells on a rank's nodes: the elements of the bodies, the facets of the contact surfaces, or those of
/// rigid bodies.
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
    /// Index of the body, of the contact, or of the rigid body that a cell belongs to.
    pub group: &'a [u16],
    /// Materials of the cells; `None` for facets, and if no body has several.
    pub materials: Option<CellMaterials<'a>>,
}

/// Materials of cells.
#[derive(Debug, Clone, Copy)]
pub struct CellMaterials<'a> {
    /// Number of the material of each cell.
    pub number: &'a [u32],
    /// Index of the material of each cell among those of its body.
    pub within: &'a [u32],
    /// Largest number of materials of a body if every material has its own points, and 1 if cells of
    /// different materials share the points of their nodes.
    pub layers: usize,
}

/// Number of the node.
const NODE: ReportedQuantity =
    ReportedQuantity::number("node", "", "number of the node in the mesh, by which pieces can be joined");
/// Number of the rank.
const RANK: ReportedQuantity = ReportedQuantity::number("rank", "", "number of the rank that wrote the cell");
/// Number of the body.
pub(super) const BODY: ReportedQuantity = ReportedQuantity::number("body", "", "number of the body");
/// Number of the material.
const MATERIAL: ReportedQuantity = ReportedQuantity::number(
    "material",
    "",
    "number of the material, counted over the bodies in the order of the file; if a body has several materials",
);
/// Number of the rigid body.
pub(super) const RIGID: ReportedQuantity = ReportedQuantity::number(
    "rigid",
    "",
    "number of the obstacle or rigid body, in the order of the case, obstacles first",
);
/// Number of the contact.
pub(super) const CONTACT: ReportedQuantity = ReportedQuantity::number("contact", "", "number of the contact");

/// File, location and meaning of the arrays that do not change.
pub const GRID_FIELDS: &[(&str, &str, ReportedQuantity)] = &[
    ("all", "nodes", NODE),
    ("`fields.pvd`", "elements", BODY),
    ("`fields.pvd`", "elements", MATERIAL),
    ("`contact.pvd`", "facets", CONTACT),
    ("`rigid.pvd`", "facets", RIGID),
    ("all", "elements, facets", RANK),
];

/// A part of a rank's mesh, to which fields are added.
#[derive(Debug)]
pub(super) struct FieldSelection {
    /// Nodes of the rank that are written, in the order in which they are first used.
    nodes: Vec<u32>,
    /// Place of each of these points among the nodes by material: `node * layers + material`.
    by_material: Vec<u32>,
    /// Cells of the rank that are written.
    cells: Vec<u32>,
    /// The grid, with only the fields that never change.
    grid: VtuPiece,
}

impl FieldSelection {
    pub(super) fn new<const D: usize>(mesh: &Cells<D>, group: ReportedQuantity, rank: usize) -> Self {
        let cells: Vec<u32> =
            (0..mesh.vtk_types.len() as u32).filter(|&cell| mesh.mine[cell as usize]).collect();
        let layers = mesh.materials.map_or(1, |materials| materials.layers);
        let mut place = vec![None; mesh.points.len() * layers];
        let mut by_material = Vec::new();
        let mut connectivity = Vec::new();
        let mut offsets = Vec::with_capacity(cells.len());
        for &cell in &cells {
            let within = mesh.materials.map_or(0, |materials| materials.within[cell as usize] as usize);
            let layer = if layers == 1 { 0 } else { within };
            let [start, end] = [cell, cell + 1].map(|at| mesh.offsets[at as usize] as usize);
            for &node in &mesh.nodes[start..end] {
                let slot = node as usize * layers + layer;
                let index = *place[slot].get_or_insert_with(|| {
                    by_material.push(slot as u32);
                    by_material.len() as i32 - 1
                });
                connectivity.push(index);
            }
            offsets.push(connectivity.len() as i32);
        }
        let nodes: Vec<u32> = by_material.iter().map(|slot| slot / layers as u32).collect();
        let points: Vec<f64> = nodes.iter().flat_map(|&node| mesh.points[node as usize]).collect();
        let numbers = nodes.iter().map(|&node| mesh.node_number[node as usize] as i32).collect();
        let groups = cells.iter().map(|&cell| i32::from(mesh.group[cell as usize])).collect();
        let ranks = vec![rank as i32; cells.len()];
        let types = cells.iter().map(|&cell| mesh.vtk_types[cell as usize]).collect();
        let mut cell_data = vec![Array::numbers(group.name, groups), Array::numbers(RANK.name, ranks)];
        if let Some(materials) = mesh.materials {
            let numbers = cells.iter().map(|&cell| materials.number[cell as usize] as i32).collect();
            cell_data.push(Array::numbers(MATERIAL.name, numbers));
        }
        let grid = VtuPiece {
            points: Array::vector("Points", &points, D),
            connectivity,
            offsets,
            types,
            point_data: vec![Array::numbers(NODE.name, numbers)],
            cell_data,
        };
        Self { nodes, by_material, cells, grid }
    }

    /// Numbers of arrays on points and on cells that never change. They are the first of a piece.
    pub(super) fn constant_arrays(&self) -> [usize; 2] {
        [self.grid.point_data.len(), self.grid.cell_data.len()]
    }

    /// The grid with fields of all nodes or all cells of the rank.
    pub(super) fn piece<const D: usize>(&self, fields: &[Field]) -> Result<VtuPiece> {
        let mut piece = self.grid.clone();
        for field in fields {
            let (entities, arrays) = match field.location {
                Location::Nodes => (&self.nodes, &mut piece.point_data),
                Location::NodesByMaterial => (&self.by_material, &mut piece.point_data),
                Location::Elements => (&self.cells, &mut piece.cell_data),
            };
            let name = field.quantity.name;
            arrays.push(match (&field.values, field.quantity.components) {
                (FieldValues::Codes(codes), _) => Array::codes(name, gather(name, codes, entities, 1)?),
                (FieldValues::Numbers(values), QuantityShape::One) => {
                    Array::scalar(name, gather(name, values, entities, 1)?)
                }
                (FieldValues::Numbers(values), QuantityShape::SymmetricTensor) => {
                    Array::symmetric_tensor(name, gather(name, values, entities, 6)?)
                }
                (FieldValues::Numbers(values), components) => {
                    let width = components.axes::<D>().len();
                    Array::vector(name, &gather(name, values, entities, width)?, width)
                }
            });
        }
        Ok(piece)
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
