//! Messages between neighbouring ranks: agreed once, then used often, with one message a neighbour.
//!
//! [`sparse_all_to_all`] makes the agreements. [`NodeExchange`] brings values of nodes that others own, and adds
//! contributions back into their rows; [`RowExchange`] does the same for rows of the matrix. Sums are made in the order
//! of the ranks that sent, never in that of arrival.

mod nodes;
mod owners;
mod peers;
mod rows;
mod sparse;

pub use nodes::{Field, NodeExchange, Traffic};
pub use rows::{Arrived, ForeignRows, RowExchange};
pub use sparse::sparse_all_to_all;
