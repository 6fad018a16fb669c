//! Springs that hold floating bodies in matrices of joined bodies.

use crate::dynamics::{MultigridHints, Stage};
use crate::error::Result;
use crate::petsc::{Matrix, Vector};
use crate::terms::Terms;

/// Spring on the unknowns of a floating body, relative to the diagonal entry including inertia.
const SHIFT: f64 = 1e-4;

/// Diagonal of the inertia at the stage. Overwrites `matrix`. Collective.
///
/// # Errors
/// If a PETSc call fails.
pub(super) fn diagonal_of_inertia(
    system: &mut dyn MultigridHints,
    stage: &Stage,
    matrix: &mut Matrix,
    layout: &Vector,
) -> Result<Vector> {
    let mut inertia = layout.like()?;
    if stage.inertia && stage.shifts.acceleration > 0.0 {
        system.jacobian_into(stage, Terms::MASS, matrix)?;
        matrix.diagonal(&mut inertia)?;
    }
    Ok(inertia)
}

/// Adds springs to bodies that only contact holds, because contact can slide or be open. Free rigid
/// bodies get none. Collective.
///
/// # Errors
/// If a PETSc call fails.
pub(super) fn hold_floating(
    system: &dyn MultigridHints,
    matrix: &mut Matrix,
    inertia: &Vector,
) -> Result<()> {
    let floats = system.floating_nodes();
    let mut diagonal = inertia.like()?;
    matrix.diagonal(&mut diagonal)?;
    let diagonal = diagonal.owned();
    let inertia = inertia.owned();
    let size = matrix.block_size();
    matrix.fill(|values| {
        for dof in (0..diagonal.len()).filter(|dof| floats[dof / size]) {
            values.add_diagonal(dof, (SHIFT * diagonal[dof] - inertia[dof]).max(0.0));
        }
    })
}
