//! Many short lists in two arrays.

/// Lists of items, one after the other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Lists<T> {
    offsets: Vec<u32>,
    items: Vec<T>,
}

impl<T: Copy + Default> Lists<T> {
    /// Puts each item into the list given by its pair, in order. The pairs are traversed twice.
    pub fn collect(lists: usize, pairs: impl Iterator<Item = (u32, T)> + Clone) -> Self {
        let mut offsets = vec![0; lists + 1];
        for (list, _) in pairs.clone() {
            offsets[list as usize + 1] += 1;
        }
        for list in 0..lists {
            offsets[list + 1] += offsets[list];
        }
        let mut next = offsets.clone();
        let mut items = vec![T::default(); offsets[lists] as usize];
        for (list, item) in pairs {
            items[next[list as usize] as usize] = item;
            next[list as usize] += 1;
        }
        Self { offsets, items }
    }

    /// The items of a list.
    pub fn get(&self, list: u32) -> &[T] {
        &self.items[self.offsets[list as usize] as usize..self.offsets[list as usize + 1] as usize]
    }

    /// The items of a list, for permutation.
    pub fn get_mut(&mut self, list: u32) -> &mut [T] {
        &mut self.items[self.offsets[list as usize] as usize..self.offsets[list as usize + 1] as usize]
    }

    /// Number of lists.
    pub fn count(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Index of the first item of a list among all items.
    pub fn first(&self, list: u32) -> u32 {
        self.offsets[list as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Items are in their lists in the original order; empty lists are empty.
    #[test]
    fn items_keep_their_order() {
        let pairs = [(2, 'a'), (0, 'b'), (2, 'c')];
        let lists = Lists::collect(4, pairs.into_iter());
        let all: Vec<&[char]> = (0..4).map(|list| lists.get(list)).collect();
        assert_eq!(all, [&['b'][..], &[], &['a', 'c'], &[]]);
        assert_eq!((lists.count(), lists.first(3)), (4, 3));
    }
}
