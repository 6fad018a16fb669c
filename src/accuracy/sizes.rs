//! Sizes of nodal fields, with which errors in time are measured and compared.

use crate::assembly::ContactSystem;
use crate::dynamics::MultigridHints;
use crate::error::Result;
use crate::petsc::Vector;

/// Root mean square of a nodal field, weighted by the mass. In systems without mass, all nodes
/// have equal weight. `weight` is that of [`weight`]. Collective.
///
/// # Errors
/// If a PETSc call fails.
pub fn mean_size<const D: usize>(system: &mut ContactSystem<D>, field: &Vector, weight: f64) -> Result<f64> {
    let square = system.bodies().weighted_square(field)?;
    Ok((square / weight).max(0.0).sqrt())
}

/// Mass of all bodies \[kg\], or the number of nodes in systems without mass. Collective.
///
/// # Errors
/// If a PETSc call fails.
pub fn weight<const D: usize>(system: &mut ContactSystem<D>) -> Result<f64> {
    if !system.bodies().is_dynamic() {
        return Ok(f64::from(system.bodies().local().index.total));
    }
    let mut ones = system.pattern_vector().like()?;
    ones.set(1.0);
    {
        // A free rigid body has its mass at two nodes.
        let mut ones = ones.owned_mut();
        system.bodies().rotation_nodes().for_each(|node| ones[node * D..][..D].fill(0.0));
    }
    Ok(system.bodies().weighted_square(&ones)? / D as f64)
}

/// Sets entries to zero that errors do not count: prescribed unknowns, and the normal part at
/// nodes in contact that have mass. Collective.
///
/// Such nodes oscillate on the penalty along the normal. Their bodies respond only to what this
/// moves at the nodes behind them. If most nodes are in contact, the normal part is kept.
///
/// # Errors
/// If a PETSc call fails.
pub fn clear_uncounted<const D: usize>(system: &mut ContactSystem<D>, field: &mut Vector) -> Result<()> {
    clear_prescribed(system, field);
    if system.contacts().iter().all(|contact| system.bodies().is_calm(contact)) {
        return Ok(());
    }
    let mut normals = system.pattern_vector().like()?;
    system.contact_normals(&mut normals)?;
    if 2.0 * normals.dot(&normals)? > f64::from(system.bodies().local().index.total) {
        return Ok(());
    }
    let (mut owned, normals) = (field.owned_mut(), normals.owned());
    for (value, normal) in owned.chunks_exact_mut(D).zip(normals.chunks_exact(D)) {
        let along: f64 = value.iter().zip(normal).map(|(v, n)| v * n).sum();
        value.iter_mut().zip(normal).for_each(|(v, n)| *v -= along * n);
    }
    Ok(())
}

/// Sets the entries of prescribed unknowns to zero.
fn clear_prescribed<const D: usize>(system: &ContactSystem<D>, field: &mut Vector) {
    system.bodies().held().clear(&mut field.owned_mut());
}
