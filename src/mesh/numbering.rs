//! Numbers of nodes and elements in a file.

use std::collections::HashMap;

/// Maximum number of nodes for 32-bit unknowns in 3D.
pub(super) const MAX_NODES: usize = i32::MAX as usize / 3;

/// Numbers in the order of the file, and the index of each.
#[derive(Debug, Clone, Default)]
pub(super) struct FileNumbers {
    ids: Vec<u64>,
    /// Indices of numbers that do not continue the consecutive numbering from the first. Most files
    /// have none.
    strays: HashMap<u64, u32>,
}

impl FileNumbers {
    /// The numbers, in the order of the file.
    pub fn ids(&self) -> &[u64] {
        &self.ids
    }

    /// Index of a number.
    pub fn index(&self, id: u64) -> Option<u32> {
        let row = usize::try_from(id.wrapping_sub(*self.ids.first()?)).ok()?;
        if self.ids.get(row) == Some(&id) { Some(row as u32) } else { self.strays.get(&id).copied() }
    }

    /// Adds a number that is not known yet.
    pub fn push(&mut self, id: u64) {
        if self.ids.first().is_some_and(|first| first.wrapping_add(self.ids.len() as u64) != id) {
            self.strays.insert(id, self.ids.len() as u32);
        }
        self.ids.push(id);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Consecutive numbers, gaps, numbers below the first and the largest number are all found.
    #[test]
    fn every_number_has_its_index() {
        let mut numbering = FileNumbers::default();
        let ids = [5, 6, 7, 100, 9, 2, u64::MAX, 0];
        ids.iter().for_each(|&id| numbering.push(id));
        for (index, &id) in (0..).zip(&ids) {
            assert_eq!(numbering.index(id), Some(index), "{id}");
        }
        assert_eq!(numbering.index(8), None);
        assert_eq!(numbering.index(1), None);
        assert_eq!(FileNumbers::default().index(0), None);
        assert_eq!(numbering.ids(), ids);
    }
}
