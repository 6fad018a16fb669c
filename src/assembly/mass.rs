//! The mass matrix: one value a node pair, the same for all components.

use std::rc::Rc;

use super::forces::Solid;
use crate::error::Result;
use crate::petsc::{BlockPattern, Kronecker, Matrix, Operator, Session, Vector};

/// How the mass is spread over the nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MassKind {
    /// `int rho N_a N_b dV`.
    Consistent,
    /// Diagonal.
    Lumped,
}

/// `M` of (3.5).
pub struct Mass {
    /// `m_ab` of each slot [kg, per metre of depth in 2D].
    pub values: Vec<f64>,
    operator: Kronecker,
    _nodes: Matrix,
}

impl Mass {
    /// Assembles the mass of all solids. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub fn new<const D: usize>(
        session: &Rc<Session>,
        pattern: &Rc<BlockPattern>,
        solids: &[Solid<D>],
    ) -> Result<Self> {
        let mut values = vec![0.0; pattern.slots()];
        for solid in solids {
            add_solid(solid, &mut values);
        }
        let mut nodes = Matrix::scalar(session, pattern)?;
        nodes.fill(|entries| {
            entries.zero();
            let slots: Vec<u32> = (0..values.len() as u32).collect();
            entries.add_blocks(&slots, &values);
        })?;
        let operator = nodes.kronecker_identity(D)?;
        Ok(Self { values, operator, _nodes: nodes })
    }

    /// `out = M a` [N]. Collective.
    ///
    /// # Errors
    /// When PETSc refuses.
    pub fn multiply(&self, a: &Vector, out: &mut Vector) -> Result<()> {
        self.operator.multiply(a, out)
    }

}

fn add_solid<const D: usize>(solid: &Solid<D>, values: &mut [f64]) {
    let map = &solid.map;
    let mut add = |slot: u32, value: f64| {
        if let Some(entry) = values.get_mut(slot as usize) {
            *entry += value;
        }
    };
    match solid.mass {
        MassKind::Consistent => solid.group.mass(|index, mass| {
            map.slots(index).iter().zip(mass).for_each(|(&slot, &value)| add(slot, value));
        }),
        MassKind::Lumped => solid.group.lumped_mass(|index, mass| {
            let slots = map.slots(index);
            mass.iter().enumerate().for_each(|(a, &value)| add(slots[a * (map.width + 1)], value));
        }),
    }
}
