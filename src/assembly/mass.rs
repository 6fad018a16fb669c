//! The mass matrix: one value per node pair, equal for all components.

use std::rc::Rc;

use mpi::collective::SystemOperation;

use super::redistribution::Redistribution;
use super::solid::{MassKind, SolidElements};
use crate::collective::Collective;
use crate::error::Result;
use crate::partition::IndexMap;
use crate::petsc::{BlockPattern, BlockValues, Kronecker, Matrix, Operator, Session, Vector};
use crate::space::Held;

/// The mass matrix `M` of (3.5).
pub struct MassMatrix {
    /// Mass `m_ab` of each slot [kg, per metre of depth in 2D].
    values: Vec<f64>,
    /// Slots that supports restrict.
    restricted: Vec<RestrictedSlot>,
    /// Owned nodes without mass. `anywhere` is true if any rank has one.
    massless: Vec<u32>,
    anywhere: bool,
    operator: Kronecker,
    _nodes: Matrix,
}

impl MassMatrix {
    /// Assembles all masses. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn new<const D: usize>(
        session: &Rc<Session>,
        pattern: &Rc<BlockPattern>,
        masses: &Masses<D>,
        supported: &Supported<D>,
        redistribution: Option<&Redistribution>,
    ) -> Result<Self> {
        let mut values = vec![0.0; pattern.slots()];
        for solid in masses.solids {
            masses_of(solid, redistribution, |slot, value| {
                if let Some(entry) = values.get_mut(slot as usize) {
                    *entry += value;
                }
            });
        }
        for &(node, mass) in masses.nodes {
            let slot = pattern.slot(node as usize, supported.index.global(node));
            if let Some(entry) = slot.and_then(|slot| values.get_mut(slot as usize)) {
                *entry += mass;
            }
        }
        let without = |row: &usize| values[pattern.row(*row)].iter().all(|&mass| mass == 0.0);
        let massless: Vec<u32> = (0..pattern.rows()).filter(without).map(|node| node as u32).collect();
        let mut anywhere = false;
        session.world().reduce_all(&!massless.is_empty(), &mut anywhere, SystemOperation::logical_or());
        let mut nodes = Matrix::scalar(session, pattern)?;
        nodes.fill(|entries| {
            entries.zero();
            let slots: Vec<u32> = (0..values.len() as u32).collect();
            entries.add_blocks(&slots, &values);
        })?;
        let operator = nodes.kronecker_identity(D)?;
        let restricted = restricted(pattern, supported);
        Ok(Self { values, restricted, massless, anywhere, operator, _nodes: nodes })
    }

    /// Writes `factor M`, restricted to the free directions of the nodes, into a matrix of the same
    /// pattern.
    pub fn write_to<const D: usize>(&self, factor: f64, held: &Held<D>, values: &mut BlockValues) {
        values.set_isotropic(factor, &self.values);
        let whole = u8::MAX;
        let mut block = [0.0; 9];
        let block = &mut block[..D * D];
        for place in &self.restricted {
            let mass = factor * self.values[place.slot as usize];
            block
                .iter_mut()
                .enumerate()
                .for_each(|(ij, entry)| *entry = if ij % (D + 1) == 0 { mass } else { 0.0 });
            held.restrict(place.row as usize, place.column as usize, block);
            values.mask(place.slot, whole, whole);
            values.add(place.slot, block);
        }
    }

    /// Owned nodes without mass. Their rows are zero.
    pub fn massless(&self) -> &[u32] {
        &self.massless
    }

    /// Whether any rank has a node without mass.
    pub fn is_partial(&self) -> bool {
        self.anywhere
    }

    /// Computes `out = M a` \[N\]. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn multiply(&self, a: &Vector, out: &mut Vector) -> Result<()> {
        self.operator.multiply(a, out)
    }
}

/// What has mass.
pub struct Masses<'a, const D: usize> {
    /// The elements.
    pub solids: &'a [SolidElements<D>],
    /// Owned nodes with concentrated masses \[kg\].
    pub nodes: &'a [(u32, f64)],
}

/// The held directions and the numbering of the nodes.
pub struct Supported<'a, const D: usize> {
    /// Held directions of the local nodes.
    pub held: &'a Held<D>,
    /// Numbers of the nodes.
    pub index: &'a IndexMap,
}

/// A slot whose row or column belongs to a held node.
#[derive(Debug, Clone, Copy)]
pub(super) struct RestrictedSlot {
    pub slot: u32,
    /// Local node of the row.
    pub row: u32,
    /// Local node of the column.
    pub column: u32,
}

/// Slots of rows and columns of held nodes, by slot.
pub(super) fn restricted<const D: usize>(
    pattern: &BlockPattern,
    supported: &Supported<D>,
) -> Vec<RestrictedSlot> {
    let mut found = Vec::new();
    for row in 0..pattern.rows() {
        let is_held = supported.held.holds(row);
        for slot in pattern.row(row) {
            // Nodes that are not local couple through contact only.
            let Some(column) = supported.index.local(pattern.columns[slot]) else { continue };
            if is_held || supported.held.holds(column as usize) {
                found.push(RestrictedSlot { slot: slot as u32, row: row as u32, column });
            }
        }
    }
    found
}

/// Passes the mass of each element of a group to `receive(index, m)` with `m[a * n + b]` \[kg\], as it is
/// assembled.
pub(super) fn element_masses<const D: usize>(
    solid: &SolidElements<D>,
    redistribution: Option<&Redistribution>,
    mut receive: impl FnMut(usize, &[f64]),
) {
    let map = &solid.map;
    let mut own = Vec::new();
    match (solid.mass, redistribution) {
        (MassKind::Redistributed, Some(redistribution)) if redistribution.has(solid.body) => {
            solid.group.mass(|index, mass| {
                redistribution.apply(map.nodes(index), mass, &mut own);
                receive(index, &own);
            });
        }
        (MassKind::Consistent | MassKind::Redistributed, _) => solid.group.mass(receive),
        (MassKind::Lumped, _) => solid.group.lumped_mass(|index, mass| {
            let n = mass.len();
            own.clear();
            own.resize(n * n, 0.0);
            mass.iter().enumerate().for_each(|(a, &value)| own[a * (n + 1)] = value);
            receive(index, &own);
        }),
    }
}

/// Passes the mass of each node pair of all elements to `add(slot, mass)` \[kg\]. Slots of rows of
/// other ranks are [`NO_SLOT`](crate::petsc::NO_SLOT).
pub(super) fn masses_of<const D: usize>(
    solid: &SolidElements<D>,
    redistribution: Option<&Redistribution>,
    mut add: impl FnMut(u32, f64),
) {
    let map = &solid.map;
    let mut left = Vec::new();
    match (solid.mass, redistribution) {
        (MassKind::Redistributed, Some(redistribution)) if redistribution.has(solid.body) => {
            solid.group.mass(|index, mass| {
                redistribution.apply(map.nodes(index), mass, &mut left);
                map.slots(index).iter().zip(&left).for_each(|(&slot, &value)| add(slot, value));
            })
        }
        (MassKind::Consistent | MassKind::Redistributed, _) => solid.group.mass(|index, mass| {
            map.slots(index).iter().zip(mass).for_each(|(&slot, &value)| add(slot, value));
        }),
        (MassKind::Lumped, _) => solid.group.lumped_mass(|index, mass| {
            let slots = map.slots(index);
            mass.iter().enumerate().for_each(|(a, &value)| add(slots[a * (map.width + 1)], value));
        }),
    }
}
