//! A tree of boxes, which finds those that intersect a given box without testing all of them.

use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree, RTreeObject, SelectionFunction};

use super::Bounds;

/// A box with its number.
type Leaf<const D: usize> = GeomWithData<Rectangle<[f64; D]>, u32>;

/// Boxes, numbered in the order given.
#[derive(Debug, Clone)]
pub struct BoundsTree<const D: usize> {
    tree: RTree<Leaf<D>>,
}

impl<const D: usize> BoundsTree<D> {
    /// A tree of these boxes. Empty or non-finite boxes intersect none.
    pub fn new(boxes: &[Bounds<D>]) -> Self {
        let finite = |one: &Bounds<D>| one.low.iter().chain(&one.high).all(|x| x.is_finite());
        let known = (0..).zip(boxes).filter(|(_, one)| finite(one) && !one.is_empty());
        let leaves =
            known.map(|(number, one)| GeomWithData::new(Rectangle::from_corners(one.low, one.high), number));
        Self { tree: RTree::bulk_load(leaves.collect()) }
    }

    /// Numbers of the boxes that intersect this one, in arbitrary order.
    pub fn meeting(&self, one: &Bounds<D>) -> impl Iterator<Item = u32> + '_ {
        // An envelope cannot be empty: its corners would be swapped.
        let asked = (!one.is_empty()).then(|| AABB::from_corners(one.low, one.high));
        asked
            .into_iter()
            .flat_map(|asked| self.tree.locate_in_envelope_intersecting(asked))
            .map(|leaf| leaf.data)
    }

    /// Numbers of the boxes that `admits` accepts, in arbitrary order.
    ///
    /// If `admits` accepts a box, it must accept every larger box that contains it. Then only the
    /// parts of the tree that may have such boxes are visited.
    pub fn admitted(&self, admits: impl Fn(&Bounds<D>) -> bool) -> impl Iterator<Item = u32> {
        self.tree.locate_with_selection_function(Selection(admits)).map(|leaf| leaf.data)
    }
}

/// The boxes, of facets and of parts of the tree, that a function accepts.
struct Selection<F>(F);

impl<const D: usize, F: Fn(&Bounds<D>) -> bool> SelectionFunction<Leaf<D>> for Selection<F> {
    fn should_unpack_parent(&self, envelope: &AABB<[f64; D]>) -> bool {
        (self.0)(&Bounds { low: envelope.lower(), high: envelope.upper() })
    }

    fn should_unpack_leaf(&self, leaf: &Leaf<D>) -> bool {
        self.should_unpack_parent(&leaf.envelope())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The tree finds the same boxes as a test of every box, whether it is given a box or a
    /// function. Empty boxes are never found and find nothing.
    #[test]
    fn tree_finds_what_meets() {
        let mut seed = 7_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 40) as f64 / f64::from(1 << 24)
        };
        let mut boxes: Vec<Bounds<3>> = (0..200)
            .map(|_| {
                let low: [f64; 3] = std::array::from_fn(|_| random());
                Bounds { low, high: low.map(|x| x + 0.2 * random()) }
            })
            .collect();
        boxes[17] = Bounds::EMPTY;
        let tree = BoundsTree::new(&boxes);
        for asked in &boxes {
            let mut found: Vec<u32> = tree.meeting(asked).collect();
            found.sort_unstable();
            let expected = (0..200).filter(|&k| boxes[k as usize].meets(asked));
            assert!(found.into_iter().eq(expected.clone()));
            let mut admitted: Vec<u32> = tree.admitted(|one| one.meets(asked)).collect();
            admitted.sort_unstable();
            assert!(admitted.into_iter().eq(expected));
        }
    }
}
