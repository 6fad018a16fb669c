//! Where a run starts: at the start of the case or from a checkpoint.

use std::path::PathBuf;

/// Where a run starts.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Begin {
    /// From the start of the case. An older result is replaced.
    #[default]
    Anew,
    /// From the start of the case, except when the results folder holds an interrupted run of this
    /// case that could be resumed.
    Fresh,
    /// From the newest checkpoint of the results folder.
    Newest,
    /// From this checkpoint. The run continues in the folder that holds its tables, or as a branch
    /// in a new folder.
    From(PathBuf),
}
