//! The grids of a run: bodies, contact surfaces, surfaces of rigid bodies.

use super::selection::Cells;
use crate::observe::fields::Field;

/// The cells of all grids on a rank.
#[derive(Debug, Clone, Copy)]
pub struct GridCells<'a, const D: usize> {
    /// Elements of the bodies.
    pub volume: Cells<'a, D>,
    /// Facets of the contact surfaces; `None` on all ranks if the case has no contacts.
    pub surface: Option<Cells<'a, D>>,
    /// Facets of obstacles and rigid bodies, which rank 0 holds; `None` on all ranks if the case has no
    /// such bodies.
    pub rigid: Option<Cells<'a, D>>,
}

/// The fields of all grids on a rank.
#[derive(Debug, Clone, Copy)]
pub struct GridFields<'a> {
    /// Of the bodies.
    pub volume: &'a [Field],
    /// Of the contact surfaces; `None` if the case has no contact.
    pub surface: Option<&'a [Field]>,
    /// Of obstacles and rigid bodies; `None` if the case has no such bodies.
    pub rigid: Option<&'a [Field]>,
}
