//! A tree of boxes around patches, for the patch that is nearest to a point.

use super::patch::Patch;
use crate::mesh::Bounds;
use crate::tensor::Vector;

/// Number of patches in a leaf. It changes the cost of a search, not its result.
const LEAF: usize = 4;
/// Depth of the tree that a search can handle: each level halves the number of patches.
const DEPTH: usize = 64;

/// A binary tree in one array. The first child follows its parent.
#[derive(Debug)]
pub(super) struct PatchTree {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    bounds: Bounds<3>,
    /// Second child, or 0 for a leaf.
    second: u32,
    /// Range in the order of the patches.
    range: [u32; 2],
}

impl PatchTree {
    /// A tree of these patches.
    pub fn new(patches: &[Patch]) -> Self {
        let boxes: Vec<Bounds<3>> = patches.iter().map(Patch::bounds).collect();
        let mut tree = Self { nodes: Vec::new(), order: (0..patches.len() as u32).collect() };
        tree.split(&boxes, 0, patches.len());
        tree
    }

    fn split(&mut self, boxes: &[Bounds<3>], first: usize, end: usize) {
        let members = &mut self.order[first..end];
        let bounds = members.iter().fold(Bounds::EMPTY, |all, &k| all.join(&boxes[k as usize]));
        let node = self.nodes.len();
        self.nodes.push(Node { bounds, second: 0, range: [first as u32, end as u32] });
        if members.len() <= LEAF {
            return;
        }
        let length = |axis: usize| bounds.high[axis] - bounds.low[axis];
        let axis = (0..3).max_by(|&a, &b| length(a).total_cmp(&length(b))).unwrap_or(0);
        let half = members.len() / 2;
        let centre = |k: &u32| boxes[*k as usize].centre()[axis];
        members.select_nth_unstable_by(half, |a, b| centre(a).total_cmp(&centre(b)));
        self.split(boxes, first, first + half);
        self.nodes[node].second = self.nodes.len() as u32;
        self.split(boxes, first + half, end);
    }

    /// Visits patches that may be nearest to `x`. Each visit returns the square of the smallest
    /// distance so far \[m2\].
    pub fn visit(&self, x: &Vector<3>, mut visit: impl FnMut(usize) -> f64) {
        let square = |node: usize| {
            let Bounds { low, high } = self.nodes[node].bounds;
            (0..3).map(|i| (low[i] - x[i]).max(x[i] - high[i]).max(0.0).powi(2)).sum::<f64>()
        };
        let mut best = f64::INFINITY;
        let mut stack = [(0_usize, 0.0_f64); DEPTH];
        let mut height = usize::from(!self.order.is_empty());
        while height > 0 {
            height -= 1;
            let (node, least) = stack[height];
            if least > best {
                continue;
            }
            let Node { second, range, .. } = self.nodes[node];
            if second == 0 {
                for &patch in &self.order[range[0] as usize..range[1] as usize] {
                    best = visit(patch as usize);
                }
                continue;
            }
            let mut children = [node + 1, second as usize].map(|child| (child, square(child)));
            if children[0].1 < children[1].1 {
                children.swap(0, 1);
            }
            // The nearer child is visited first.
            stack[height..height + 2].copy_from_slice(&children);
            height += 2;
        }
    }
}
