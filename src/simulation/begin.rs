//! How a run begins.

use std::path::PathBuf;

/// How a run begins.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Begin {
    /// From the start of the case; an older result is replaced.
    #[default]
    Anew,
    /// The same, but not where the older result is one of this case that stopped and could go on.
    Fresh,
    /// From the newest checkpoint of the results folder.
    Newest,
    /// From this checkpoint: in the folder that has its rows, or as a branch in a new one.
    From(PathBuf),
}
