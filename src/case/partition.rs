//! `partition`: the library that assigns the elements to ranks.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::reader::tagged::tagged;

/// Library that assigns the elements to ranks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Partitioner")]
pub enum Partitioner {
    /// METIS, on rank 0. Elements and facets in contact are balanced separately.
    #[default]
    Metis,
    /// PT-Scotch, on all ranks together, which takes less time on large meshes. Only elements are
    /// balanced, and few ranks may hold all contact. PETSc must be linked with it, as that of Debian is.
    Ptscotch,
}
tagged!(Partitioner, "partitioner");
