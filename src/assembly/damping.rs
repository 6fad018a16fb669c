//! Rayleigh damping of the bodies: `C = a M + b K_0` with the stiffness `K_0` of the undeformed bodies
//! (3.18).

use std::rc::Rc;

use super::forces::SolidFields;
use super::mass::{RestrictedSlot, Supported, masses_of, restricted};
use super::patches::{SolidPatches, solid_terms};
use super::redistribution::Redistribution;
use super::scatter::ScatterMap;
use super::solid::SolidElements;
use super::viscous::ViscousState;
use crate::element::{ElementSink, Request};
use crate::error::{Error, Result, agree};
use crate::petsc::{BlockPattern, BlockValues, Format, Matrix, NO_SLOT, Operator, Session, Vector};
use crate::space::Held;
use crate::terms::Terms;

/// The damping matrix `C` [N s/m].
pub(super) struct DampingMatrix {
    matrix: Matrix,
    /// Slots that supports restrict, by slot.
    restricted: Vec<RestrictedSlot>,
}

impl DampingMatrix {
    /// Assembles the damping of all solids, `softened` as in [`SolidFields`]. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails, or an element is inverted in the mesh. All ranks return the same
    /// error.
    pub fn new<const D: usize>(
        session: &Rc<Session>,
        pattern: &Rc<BlockPattern>,
        solids: &[SolidElements<D>],
        patches: &[SolidPatches<D>],
        supported: &Supported<D>,
        redistribution: Option<&Redistribution>,
        softened: bool,
    ) -> Result<Self> {
        let mut matrix = Matrix::new(session, pattern, Format::Baij)?;
        let at_rest = vec![0.0; supported.held.len()];
        let undeformed = SolidFields {
            u: &at_rest,
            start: None,
            linearised_at: None,
            viscous: ViscousState::Relaxed,
            softened,
        };
        let filled = matrix.fill(|values| {
            values.zero();
            for solid in solids {
                let Some(rayleigh) = solid.damping.filter(|rayleigh| rayleigh.mass > 0.0) else { continue };
                masses_of(solid, redistribution, |slot, mass| {
                    if slot != NO_SLOT {
                        values.add_isotropic(slot, rayleigh.mass * mass);
                    }
                });
            }
            for terms in solid_terms(solids, patches) {
                let Some(rayleigh) = terms.damping().filter(|rayleigh| rayleigh.stiffness > 0.0) else {
                    continue;
                };
                let scaled = Vec::new();
                let mut sink = ScaledSink { map: terms.map(), values, factor: rayleigh.stiffness, scaled };
                let request = Request::of(Terms::MATERIAL);
                let done = terms.evaluate(&undeformed, request, &mut sink);
                done.map_err(|_| Error::internal("an element of the mesh is inverted"))?;
            }
            Ok(())
        })?;
        agree(session.world(), filled)?;
        let restricted = restricted(pattern, supported);
        Ok(Self { matrix, restricted })
    }

    /// Adds `factor C`, restricted to the free directions of the nodes, to a matrix of the same
    /// pattern.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn add_to<const D: usize>(
        &self,
        factor: f64,
        held: &Held<D>,
        values: &mut BlockValues,
    ) -> Result<()> {
        let mut places = self.restricted.iter().peekable();
        self.matrix.read(|own| {
            let mut block = [0.0; 9];
            let block = &mut block[..D * D];
            for slot in 0..self.matrix.pattern().slots() as u32 {
                own.block(slot, block);
                block.iter_mut().for_each(|entry| *entry *= factor);
                if let Some(place) = places.next_if(|place| place.slot == slot) {
                    held.restrict(place.row as usize, place.column as usize, block);
                }
                values.add(slot, block);
            }
        })
    }

    /// Computes the forces `out = C v` \[N\]. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn multiply(&self, v: &Vector, out: &mut Vector) -> Result<()> {
        self.matrix.multiply(v, out)
    }
}

/// Adds multiples of element matrices.
struct ScaledSink<'a, 'm> {
    map: &'a ScatterMap,
    values: &'a mut BlockValues<'m>,
    factor: f64,
    scaled: Vec<f64>,
}

impl ElementSink for ScaledSink<'_, '_> {
    fn element(&mut self, index: usize, _: &[f64], stiffness: Option<&[f64]>) {
        let Some(stiffness) = stiffness else { return };
        self.scaled.clear();
        self.scaled.extend(stiffness.iter().map(|entry| self.factor * entry));
        self.values.add_blocks(self.map.slots(index), &self.scaled);
    }
}
