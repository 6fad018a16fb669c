//! Disjoint sets (union-find) of numbered members.

/// Sets of the numbers from 0. Initially each number is a set of its own.
#[derive(Debug, Clone)]
pub struct DisjointSets {
    parent: Vec<u32>,
}

impl DisjointSets {
    /// `count` sets of one member each.
    pub fn new(count: usize) -> Self {
        Self { parent: (0..count as u32).collect() }
    }

    /// The lowest member of the set of `member`.
    pub fn find(&mut self, member: u32) -> u32 {
        let mut root = member;
        while self.parent[root as usize] != root {
            let above = self.parent[self.parent[root as usize] as usize];
            self.parent[root as usize] = above;
            root = above;
        }
        root
    }

    /// Joins the sets of two members. Returns whether the sets were different.
    pub fn join(&mut self, one: u32, other: u32) -> bool {
        let (one, other) = (self.find(one), self.find(other));
        self.parent[one.max(other) as usize] = one.min(other);
        one != other
    }

    /// The number of the set of each member: sets count from 0 in the order of their lowest
    /// members.
    pub fn labels(&mut self) -> Vec<u32> {
        let mut labels = vec![0; self.parent.len()];
        let mut count = 0;
        for member in 0..self.parent.len() as u32 {
            let root = self.find(member);
            labels[member as usize] = if root == member {
                count += 1;
                count - 1
            } else {
                labels[root as usize]
            };
        }
        labels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sets that are joined have one label, in the order of their lowest members.
    #[test]
    fn joined_members_have_one_label() {
        let mut sets = DisjointSets::new(6);
        assert!(sets.join(5, 3) && sets.join(1, 4) && sets.join(4, 5));
        assert!(!sets.join(1, 3));
        assert_eq!(sets.labels(), [0, 1, 2, 1, 1, 1]);
        assert!(DisjointSets::new(0).labels().is_empty());
    }
}
