//! Messages between neighbouring ranks. They are set up once and used often, with one message per
//! neighbour.
//!
//! [`sparse_all_to_all`] sets up the communication. [`NodeExchange`] fetches values of nodes that
//! other ranks own, and adds contributions to their rows. [`RowExchange`] sends contributions to
//! rows of the matrix. Sums are computed in the order of the sending ranks, never in that of
//! arrival.

mod nodes;
mod owners;
mod peers;
mod rows;
mod sparse;

pub use nodes::{ExchangedField, NodeExchange, Traffic};
pub use rows::{Arrived, ForeignRows, RowExchange};
pub use sparse::sparse_all_to_all;
