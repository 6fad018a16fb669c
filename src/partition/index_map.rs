//! Local and global numbers of the nodes of a rank: owned nodes, contiguous over the ranks, and
//! ghosts.

/// Numbering of the nodes that a rank holds. Local numbers: owned nodes first, then ghosts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IndexMap {
    /// Global number of the first owned node.
    pub first: i32,
    /// Number of owned nodes; their global numbers are `first..first + owned`.
    pub owned: usize,
    /// Global numbers of the ghosts, ascending.
    pub ghosts: Vec<i32>,
    /// Total number of nodes on all ranks.
    pub total: i32,
}

impl IndexMap {
    /// Global number of a local node.
    pub fn global(&self, local: u32) -> i32 {
        match (local as usize).checked_sub(self.owned) {
            None => self.first + local as i32,
            Some(ghost) => self.ghosts[ghost],
        }
    }

    /// Local number of a global node; `None` if this rank does not hold it.
    pub fn local(&self, global: i32) -> Option<u32> {
        let offset = i64::from(global) - i64::from(self.first);
        if (0..self.owned as i64).contains(&offset) {
            return Some(offset as u32);
        }
        self.ghosts.binary_search(&global).ok().map(|ghost| (self.owned + ghost) as u32)
    }

    /// Number of local nodes, including ghosts.
    pub fn local_count(&self) -> usize {
        self.owned + self.ghosts.len()
    }

    /// Whether a local node is owned by this rank.
    pub fn owns(&self, local: u32) -> bool {
        (local as usize) < self.owned
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Local and global numbers are inverse to each other, for owned nodes and ghosts on both
    /// sides.
    #[test]
    fn local_and_global_numbers_are_inverse() {
        let index = IndexMap { first: 10, owned: 3, ghosts: vec![2, 9, 13, 40], total: 50 };
        let global: Vec<i32> = (0..index.local_count() as u32).map(|local| index.global(local)).collect();
        assert_eq!(global, [10, 11, 12, 2, 9, 13, 40]);
        for (local, &global) in global.iter().enumerate() {
            assert_eq!(index.local(global), Some(local as u32));
        }
        assert_eq!([3, 14, -1, 49].map(|global| index.local(global)), [None; 4]);
        assert!(index.owns(2) && !index.owns(3));
    }
}
