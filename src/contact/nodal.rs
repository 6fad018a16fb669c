//! Nodal fields as plain arrays.

use crate::tensor::Vector;

/// The vector of a node in a nodal field.
pub fn at<const D: usize>(field: &[f64], node: u32) -> Vector<D> {
    Vector::from_column_slice(&field[node as usize * D..][..D])
}
