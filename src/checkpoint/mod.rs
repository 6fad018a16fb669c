//! Checkpoints: files from which a run resumes, on any number of ranks.
//!
//! ```text
//! contact-petsc checkpoint\n     magic, 25 bytes
//! format                         u32, see [`FORMAT`]
//! length of the header           u64
//! header                         JSON: description of the run, and sections with columns and rows
//! sections                       rows of 8-byte words (key, then columns), by ascending key
//! SHA-256                        of all preceding bytes, 32 bytes
//! ```
//!
//! All numbers are little-endian. Keys are numbers of the input mesh, so that the bytes do not
//! depend on the number of ranks. A file appears by renaming when it is complete and on the disk.
//! Only rank 0 writes and reads it. The data are exchanged with the other ranks in pieces of
//! bounded size.

mod file;
mod store;
mod stream;
mod table;

pub use file::{FORMAT, FileSection, Header, examine, verify};
pub use store::{FoundCheckpoint, Store};
pub use stream::{fill, read, write};
pub use table::StoredTable;
