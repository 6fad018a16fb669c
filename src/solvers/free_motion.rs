//! Free motions of a static equilibrium, and their projection out of the correction.
//!
//! Some bodies are held only by friction. While friction is off, nothing resists their motion `n`,
//! so the tangent is singular along it, `K n = 0`. If the loads have no component along it,
//! `n . r = 0`, any position along it is an equilibrium. The body should stay where it is.
//!
//! The rigid motions that the supports allow are therefore reduced to those that the present
//! tangent, contact included, does not resist. If nothing drives them, they are removed from both
//! sides of
//!
//! `K x = b`: the solver uses `b - M n (n . b)` and takes `x - n (n . M x)`, with `n . M n = 1`
//! (5.4).
//!
//! This moves neither the centre of mass nor the mean angle along `n`. The weak spring of
//! [`Continuation::spring`](crate::dynamics::Continuation) makes the factorisation regular and does not affect
//! the solution.
//!
//! A target that deforms resists a body weakly wherever the target is not bent evenly, and the
//! equilibrium of the body may be far away. If [`Continuation::free_resistance`](crate::dynamics::Continuation) is above
//! zero, such motions are held as well, by a force that is removed from the residual and reported
//! ([`HeldMotions`]). Friction has to carry this force from then on.
//!
//! A motion that loads drive is not an equilibrium. The spring carries the body along it, in steps
//! of limited length, until something resists. If there are several free motions, this is the one
//! combination along which the loads act. The others are still held. If nothing ever resists, the
//! solve fails and reports body, direction and force.

use mpi::collective::SystemOperation;
use nalgebra::{Cholesky, DMatrix, DVector, SVD};

use super::held::{Driven, HeldMotions, describe};
use crate::case::Units;
use crate::collective::Collective;
use crate::dynamics::{FloatingBodies, RigidMotion, Stage};
use crate::error::Result;
use crate::petsc::{Operator, Vector};

/// A held motion, its weight, and the direction along which it is removed from corrections.
struct Motion {
    field: Vector,
    weight: Vector,
    /// `K^-1 M n`, unless it is a multiple of `n`.
    answer: Option<Vector>,
}

impl Motion {
    fn new(field: Vector, weight: Vector) -> Self {
        Self { field, weight, answer: None }
    }
}

/// The free motions at an iterate.
#[derive(Default)]
pub struct FreeMotions {
    units: Units,
    /// All rigid motions that the supports allow.
    rigid: Vec<RigidMotion>,
    held: Vec<Motion>,
    /// Body and direction of each held motion.
    words: Vec<String>,
    /// Number of motions that contact does not resist, whether held or driven.
    pub free: usize,
    /// The motion that loads drive.
    pub driven: Option<Driven>,
}

/// Resistance, relative to a typical diagonal entry, up to which a motion is free. It is above
/// rounding and below the softest penalty.
const FREE: f64 = 1e-12;
/// Resistance up to which a motion is free, relative to the largest entry and in units of rounding.
const ROUNDINGS: f64 = 32.0;
/// Factor by which the total force of a motion may exceed its part in the space of rigid motions.
const WHOLE: f64 = 10.0;

impl FreeMotions {
    /// Finds the free motions at the matrix that the system has assembled for `stage`. Forces `b`
    /// along them of at most `allowed` \[N\] count as zero. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn find(system: &dyn FloatingBodies, stage: &Stage, b: &Vector, allowed: f64) -> Result<Self> {
        let rigid = system.rigid_motions(stage)?;
        if rigid.is_empty() {
            return Ok(Self::default());
        }
        let fields: Vec<&Vector> = rigid.iter().map(|motion| &motion.field).collect();
        let free = unresisted(system, &fields)?;
        if free.ncols() == 0 {
            return Ok(Self::default());
        }
        let loads = DVector::from_vec(products(&fields, &[b]));
        let along = free.transpose() * &loads;
        let size = along.norm();
        let mut driven = None;
        let mut idle = free.clone();
        if size > allowed {
            let way = &free * (&along / size);
            driven = Some(describe(&rigid, &way, &loads, system.units()));
            idle = &free * complement(&(along / size));
        }
        let held = weighed(system, &fields, &idle)?;
        let words = |way: DVector<f64>| describe(&rigid, &way, &loads, system.units()).words;
        let words = reduced(&idle).column_iter().map(|way| words(way.into_owned())).collect();
        Ok(Self { units: system.units(), rigid, held, words, free: free.ncols(), driven })
    }

    /// Number of motions that are held.
    pub fn held(&self) -> usize {
        self.held.len()
    }

    /// Removes the part of the forces along the held motions. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn clear_force(&self, b: &mut Vector) -> Result<()> {
        let fields: Vec<&Vector> = self.held.iter().map(|motion| &motion.field).collect();
        let parts = products(&fields, &[b]);
        self.held.iter().zip(parts).try_for_each(|(motion, part)| b.axpy(-part, &motion.weight))
    }

    /// Uses `solve` to find the direction along which each held motion is removed, if something
    /// resists the motion. Collective.
    ///
    /// # Errors
    /// Those of `solve`.
    pub fn answer(&mut self, mut solve: impl FnMut(&Vector, &mut Vector) -> Result<bool>) -> Result<()> {
        for motion in &mut self.held {
            let mut answer = motion.weight.like()?;
            motion.answer = solve(&motion.weight, &mut answer)?.then_some(answer);
        }
        Ok(())
    }

    /// Removes the held motions from a correction. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn clear_motion(&self, x: &mut Vector) -> Result<()> {
        let weights: Vec<&Vector> = self.held.iter().map(|motion| &motion.weight).collect();
        let answers: Option<Vec<&Vector>> = self.held.iter().map(|motion| motion.answer.as_ref()).collect();
        let parts = products(&weights, &[x]);
        if let (Some(answers), false) = (answers, parts.is_empty()) {
            let shares = DMatrix::from_row_slice(parts.len(), parts.len(), &products(&weights, &answers));
            if let Some(amounts) = shares.lu().solve(&DVector::from_column_slice(&parts)) {
                return answers
                    .iter()
                    .zip(&amounts)
                    .try_for_each(|(answer, &amount)| x.axpy(-amount, answer));
            }
        }
        self.held.iter().zip(parts).try_for_each(|(motion, part)| x.axpy(-part, &motion.field))
    }

    /// Components of the remaining forces `r` along the held motions, relative to the force `scale`
    /// \[N\]. `carries` states that these forces hold the motions. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn needed(&self, r: &Vector, scale: f64, carries: bool) -> Result<HeldMotions> {
        let fields: Vec<&Vector> = self.held.iter().map(|motion| &motion.field).collect();
        let parts = products(&fields, &[r]);
        let mut force = 0.0_f64;
        for (motion, part) in fields.iter().zip(&parts) {
            force = force.max(part.abs() / motion.norm()?);
        }
        let force = if force == 0.0 { 0.0 } else { force / scale };
        let motions = fields.len() as u32;
        if force == 0.0 || !carries {
            return Ok(HeldMotions { motions, words: self.words.clone(), force, by: None });
        }
        let mut holding = r.like()?;
        self.held.iter().zip(&parts).try_for_each(|(motion, part)| holding.axpy(*part, &motion.weight))?;
        let rigid: Vec<&Vector> = self.rigid.iter().map(|motion| &motion.field).collect();
        // The driving force is opposite to the holding force.
        let drive = -DVector::from_vec(products(&rigid, &[&holding]));
        let way = &drive / drive.norm();
        let by = Some(describe(&self.rigid, &way, &drive, self.units));
        Ok(HeldMotions { motions, words: self.words.clone(), force, by })
    }
}

/// Dot products of all `left` with all `right`, row by row, in one message. Collective.
fn products(left: &[&Vector], right: &[&Vector]) -> Vec<f64> {
    let Some(first) = left.first() else { return Vec::new() };
    let dot =
        |a: &Vector, b: &Vector| a.owned().iter().zip(b.owned().iter()).map(|(a, b)| a * b).sum::<f64>();
    let own: Vec<f64> = left.iter().flat_map(|a| right.iter().map(|b| dot(a, b))).collect();
    let mut all = vec![0.0; own.len()];
    first.session().world().reduce_all(&own[..], &mut all[..], SystemOperation::sum());
    all
}

/// Coefficients, as orthonormal columns, of the combinations of `fields` for which `K n` and
/// `K^T n` are zero. Collective.
fn unresisted(system: &dyn FloatingBodies, fields: &[&Vector]) -> Result<DMatrix<f64>> {
    let (matrix, unit, count) = (system.matrix(), system.unit(), fields.len());
    // The spring does not count as resistance.
    let spring = system.continuation().spring * unit;
    let mut image = fields[0].like()?;
    matrix.diagonal(&mut image)?;
    let tolerance = (FREE.max(system.continuation().free_resistance) * unit)
        .max(ROUNDINGS * f64::EPSILON * image.max_norm()?);
    let mut columns = Vec::with_capacity(count);
    for field in fields {
        matrix.multiply(field, &mut image)?;
        image.axpy(-spring, field)?;
        columns.push(DVector::from_vec(products(fields, &[&image])));
    }
    let stiffness = DMatrix::from_columns(&columns);
    if stiffness.iter().any(|entry| !entry.is_finite()) {
        return Ok(DMatrix::zeros(count, 0));
    }
    let mut free = null_space(&stiffness, tolerance);
    // The part in the space of rigid motions can vanish although the total does not: under stress,
    // a rotation changes forces.
    let mut kept = Vec::new();
    let mut sum = fields[0].like()?;
    for column in free.column_iter() {
        combine(fields, column.iter(), &mut sum)?;
        matrix.multiply(&sum, &mut image)?;
        image.axpy(-spring, &sum)?;
        let forward = image.norm()?;
        matrix.multiply_transpose(&sum, &mut image)?;
        image.axpy(-spring, &sum)?;
        if forward.max(image.norm()?) <= WHOLE * tolerance {
            kept.push(column.into_owned());
        }
    }
    free = if kept.is_empty() { DMatrix::zeros(count, 0) } else { DMatrix::from_columns(&kept) };
    Ok(free)
}

/// Orthonormal columns `y` with `|A y|` and `|A^T y|` up to a tolerance.
fn null_space(a: &DMatrix<f64>, tolerance: f64) -> DMatrix<f64> {
    let count = a.ncols();
    let mut both = DMatrix::zeros(2 * count, count);
    both.rows_mut(0, count).copy_from(a);
    both.rows_mut(count, count).copy_from(&a.transpose());
    let svd = SVD::new(both, false, true);
    let Some(right) = svd.v_t else { return DMatrix::zeros(count, 0) };
    let free: Vec<_> = (0..count)
        .filter(|&k| svd.singular_values[k] <= tolerance)
        .map(|k| right.row(k).transpose())
        .collect();
    if free.is_empty() { DMatrix::zeros(count, 0) } else { DMatrix::from_columns(&free) }
}

/// The columns of `basis`, combined so that each has a one where the others have zeros, as early as
/// possible: the same for every basis of a space.
fn reduced(basis: &DMatrix<f64>) -> DMatrix<f64> {
    // Coefficients are of order one and have errors of rounding.
    const ZERO: f64 = 1e-6;
    let mut all = basis.clone();
    let mut done = 0;
    for row in 0..all.nrows() {
        let rest = done..all.ncols();
        let Some(pivot) = rest.max_by(|&a, &b| all[(row, a)].abs().total_cmp(&all[(row, b)].abs())) else {
            break;
        };
        if all[(row, pivot)].abs() <= ZERO {
            continue;
        }
        all.swap_columns(done, pivot);
        let own = all.column(done) / all[(row, done)];
        for k in 0..all.ncols() {
            let part = if k == done { all[(row, k)] - 1.0 } else { all[(row, k)] };
            all.column_mut(k).axpy(-part, &own, 1.0);
        }
        done += 1;
    }
    all
}

/// Orthonormal columns that are orthogonal to a unit vector, one fewer than its length. They come
/// from its reflection onto the first axis.
fn complement(unit: &DVector<f64>) -> DMatrix<f64> {
    let count = unit.len();
    let mut axis = unit.clone();
    axis[0] += if unit[0] >= 0.0 { 1.0 } else { -1.0 };
    let mirror = DMatrix::identity(count, count) - &axis * axis.transpose() * (2.0 / axis.norm_squared());
    mirror.columns(1, count - 1).into_owned()
}

/// `sum_k c_k f_k`.
fn combine<'a>(fields: &[&Vector], factors: impl Iterator<Item = &'a f64>, into: &mut Vector) -> Result<()> {
    into.set(0.0);
    fields.iter().zip(factors).try_for_each(|(field, &factor)| into.axpy(factor, field))
}

/// Combines `fields` by the columns of `idle` and orthonormalises the results with the weight.
/// Collective.
fn weighed(system: &dyn FloatingBodies, fields: &[&Vector], idle: &DMatrix<f64>) -> Result<Vec<Motion>> {
    let mut motions = Vec::with_capacity(idle.ncols());
    for column in idle.column_iter() {
        let (mut field, mut weight) = (fields[0].like()?, fields[0].like()?);
        combine(fields, column.iter(), &mut field)?;
        system.weigh_motion(&field, &mut weight)?;
        motions.push(Motion::new(field, weight));
    }
    let parts = |take: fn(&Motion) -> &Vector| motions.iter().map(take).collect::<Vec<_>>();
    let (own, weights) = (parts(|motion| &motion.field), parts(|motion| &motion.weight));
    let masses = DMatrix::from_row_slice(own.len(), own.len(), &products(&own, &weights));
    let Some(mixed) = Cholesky::new(masses).and_then(|root| root.l().try_inverse()) else {
        // For bodies without mass, the mean of the nodes stays fixed.
        let plain = |motion: Motion| -> Result<Motion> {
            let mut weight = motion.weight;
            weight.copy_from(&motion.field)?;
            Ok(Motion::new(motion.field, weight))
        };
        return motions.into_iter().map(plain).collect();
    };
    let mut result = Vec::with_capacity(motions.len());
    for row in mixed.row_iter() {
        let (mut field, mut weight) = (fields[0].like()?, fields[0].like()?);
        combine(&own, row.iter(), &mut field)?;
        combine(&weights, row.iter(), &mut weight)?;
        result.push(Motion::new(field, weight));
    }
    Ok(result)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A matrix has to be singular on both sides: a motion that changes friction elsewhere is not
    /// free.
    #[test]
    fn a_free_motion_is_free_on_both_sides() {
        let a = DMatrix::from_row_slice(3, 3, &[0.0, 0.0, 0.0, 0.0, 2.0, 1.0, 0.0, 1.0, 3.0]);
        let free = null_space(&a, 1e-12);
        assert_eq!(free.ncols(), 1);
        assert!(free[(0, 0)].abs() > 1.0 - 1e-12);
        let mut coupled = a.clone();
        coupled[(0, 1)] = 0.5;
        assert_eq!(null_space(&coupled, 1e-12).ncols(), 0);
        assert_eq!(null_space(&(a + DMatrix::identity(3, 3) * 1e-3), 1e-12).ncols(), 0);
    }

    /// Every basis of a space of motions is reduced to the same one, which shows single motions.
    #[test]
    fn a_reduced_basis_shows_single_motions() {
        let plain = DMatrix::from_row_slice(4, 2, &[0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        let (sin, cos) = 2.1_f64.sin_cos();
        let turned = &plain * DMatrix::from_row_slice(2, 2, &[cos, -sin, sin, cos]);
        assert!((reduced(&turned) - &plain).amax() < 1e-14);
        let mixed = DMatrix::from_row_slice(3, 1, &[0.0, -0.6, 0.8]);
        let expected = DMatrix::from_row_slice(3, 1, &[0.0, 1.0, -0.8 / 0.6]);
        assert!((reduced(&mixed) - expected).amax() < 1e-14);
    }

    /// The complement of a direction is orthonormal and orthogonal to it.
    #[test]
    fn the_complement_is_orthonormal() {
        for unit in [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.6, -0.8]] {
            let unit = DVector::from_row_slice(&unit);
            let rest = complement(&unit);
            assert_eq!(rest.shape(), (3, 2));
            assert!((rest.transpose() * &rest - DMatrix::identity(2, 2)).amax() < 1e-14);
            assert!((rest.transpose() * unit).amax() < 1e-14);
        }
        assert_eq!(complement(&DVector::from_row_slice(&[-1.0])).ncols(), 0);
    }
}
