//! Where a value is written.

use serde_saphyr::Location;

/// Line and column (both from 1, in characters) and length of a piece of a file; zeros where unknown.
///
/// Two places are always equal: the location of a value does not distinguish two cases.
#[derive(Debug, Clone, Copy, Default)]
pub struct Place {
    /// 0: the case or the study that is read; 1: the study that changes keys of the case.
    pub file: usize,
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1.
    pub column: usize,
    /// Number of characters.
    pub length: usize,
}

impl Place {
    /// Whether this is the same piece of the same file.
    pub(super) fn is(self, other: Self) -> bool {
        let all = |place: Self| (place.file, place.line, place.column, place.length);
        all(self) == all(other)
    }
}

impl PartialEq for Place {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl From<Location> for Place {
    fn from(location: Location) -> Self {
        Self {
            file: 0,
            line: location.line() as usize,
            column: location.column() as usize,
            length: location.span().len() as usize,
        }
    }
}
