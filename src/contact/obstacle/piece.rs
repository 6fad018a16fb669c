//! Parts of the outline of a region in the plane: lines and arcs.

use crate::tensor::Vector;

/// A part of an outline. The region is on the left of the way along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Piece {
    /// A straight line \[m\].
    Line { from: Vector<2>, to: Vector<2> },
    /// An arc from angle to angle \[rad\], anticlockwise, with centre and radius \[m\].
    Arc { centre: Vector<2>, radius: f64, from: f64, to: f64 },
}
