//! Gaps linearised at the iterate before, which replace the gaps in tangents (theory, section 5.1).
//!
//! A correction changes gaps by more than its first-order part, and the stiffness of the normal law
//! multiplies the rest. In a mixed method, whose pressures are unknowns, these pressures do not arise.

use std::ops::Range;
use std::rc::Rc;

use crate::tensor::Vector;

/// A node on which a gap depends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GapNode<const D: usize> {
    /// Index of the node in the field arrays.
    pub node: u32,
    /// Undeformed position \[m\].
    pub reference: Vector<D>,
    /// Displacement at which the gap is linearised, or position as seen from a moving target \[m\].
    pub place: Vector<D>,
    /// Derivative of the gap by `place` \[-\].
    pub slope: Vector<D>,
}

/// Gaps as linear functions of the places of their nodes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LinearGaps<const D: usize> {
    /// For each point the gap at the places of its nodes \[m\], and where its nodes are; `None` for a
    /// point that had no stiffness there.
    points: Vec<Option<(f64, Range<usize>)>>,
    nodes: Vec<GapNode<D>>,
}

impl<const D: usize> LinearGaps<D> {
    /// This number of points, all without a gap.
    pub fn new(points: usize) -> Self {
        Self { points: vec![None; points], nodes: Vec::new() }
    }

    /// Gaps that depend on no node, `None` for a point without one.
    pub fn constant(gaps: impl Iterator<Item = Option<f64>>) -> Self {
        Self { points: gaps.map(|gap| gap.map(|gap| (gap, 0..0))).collect(), nodes: Vec::new() }
    }

    /// Sets the gap of point `p` and its nodes.
    pub fn set(&mut self, p: usize, gap: f64, nodes: impl Iterator<Item = GapNode<D>>) {
        let first = self.nodes.len();
        self.nodes.extend(nodes);
        self.points[p] = Some((gap, first..self.nodes.len()));
    }

    /// The gap of point `p` at these places of the nodes \[m\], if it is known.
    pub fn at(&self, p: usize, place: impl Fn(&GapNode<D>) -> Vector<D>) -> Option<f64> {
        let (gap, nodes) = self.points.get(p)?.as_ref()?;
        let changes =
            self.nodes[nodes.clone()].iter().map(|node| node.slope.dot(&(place(node) - node.place)));
        Some(gap + changes.sum::<f64>())
    }
}

/// The linear gaps of a contact between its tangents. A point is known if the last linear solve had its
/// stiffness and has found its pressure, and at first if it was closed at the end of the last step.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GapLinearisation<const D: usize> {
    used: Option<Rc<LinearGaps<D>>>,
    /// Those at the last tangent.
    next: Option<Rc<LinearGaps<D>>>,
}

impl<const D: usize> GapLinearisation<D> {
    /// Stores the linear gaps at a tangent, to be used after its linear solve.
    pub fn note(&mut self, gaps: LinearGaps<D>) {
        self.next = Some(Rc::new(gaps));
    }

    /// Uses the gaps of the last tangent from now on, because its linear solve is done. Without a new
    /// tangent, gaps are those of the positions.
    pub fn advance(&mut self) {
        self.used = self.next.take();
    }

    /// Uses these gaps from now on.
    pub fn use_gaps(&mut self, gaps: LinearGaps<D>) {
        *self = Self { used: Some(Rc::new(gaps)), next: None };
    }

    /// Forgets all gaps.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Nodes on which gaps depend. A node is named once for each gap.
    pub fn nodes(&self) -> impl Iterator<Item = &GapNode<D>> {
        [&self.used, &self.next].into_iter().flatten().flat_map(|gaps| &gaps.nodes)
    }

    /// Follows nodes to their new indices.
    pub fn renumber(&mut self, new: impl Fn(u32) -> u32) {
        for gaps in [&mut self.used, &mut self.next].into_iter().flatten() {
            Rc::make_mut(gaps).nodes.iter_mut().for_each(|node| node.node = new(node.node));
        }
    }

    /// The gap of point `p` at these places of the nodes \[m\], if it is known.
    pub fn at(&self, p: usize, place: impl Fn(&GapNode<D>) -> Vector<D>) -> Option<f64> {
        self.used.as_ref()?.at(p, place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gaps(value: f64) -> LinearGaps<2> {
        let node = |node, slope| GapNode {
            node,
            reference: Vector::<2>::zeros(),
            place: Vector::<2>::new(1.0, f64::from(node)),
            slope: Vector::<2>::new(0.0, slope),
        };
        let mut gaps = LinearGaps::new(3);
        gaps.set(2, -value, [node(7, 3.0)].into_iter());
        gaps.set(0, value, [node(0, 1.0), node(1, -0.5)].into_iter());
        gaps
    }

    /// A linear gap changes with the places of its own nodes by their slopes.
    #[test]
    fn gaps_are_linear_in_places() {
        let gaps = gaps(0.25);
        let there = |p| gaps.at(p, |node| node.place);
        assert_eq!([there(0), there(1), there(2), there(3)], [Some(0.25), None, Some(-0.25), None]);
        let moved = |node: &GapNode<2>| node.place + Vector::<2>::new(7.0, f64::from(1 + node.node));
        assert_eq!(gaps.at(0, moved), Some(0.25 + 1.0 - 0.5 * 2.0));
        assert_eq!(gaps.at(2, moved), Some(-0.25 + 3.0 * 8.0));
    }

    /// Gaps of a tangent serve after its solve, and only until the next solve.
    #[test]
    fn gaps_serve_between_two_solves() {
        let mut all = GapLinearisation::default();
        let first = |all: &GapLinearisation<2>| all.at(0, |node| node.place);
        all.note(gaps(1.0));
        assert_eq!(first(&all), None);
        all.advance();
        assert_eq!(first(&all), Some(1.0));
        all.note(gaps(2.0));
        assert_eq!(first(&all), Some(1.0));
        all.advance();
        assert_eq!(first(&all), Some(2.0));
        all.advance();
        assert_eq!(first(&all), None);
        all.note(gaps(2.0));
        all.use_gaps(LinearGaps::constant([Some(3.0), None].into_iter()));
        assert_eq!(first(&all), Some(3.0));
        all.clear();
        assert_eq!(first(&all), None);
    }

    /// Gaps follow their nodes to new indices.
    #[test]
    fn gaps_follow_their_nodes() {
        let mut all = GapLinearisation::default();
        all.use_gaps(gaps(1.0));
        all.note(gaps(2.0));
        assert_eq!(all.nodes().map(|node| node.node).collect::<Vec<_>>(), [7, 0, 1, 7, 0, 1]);
        all.renumber(|node| 17 - node);
        for size in [1.0, 2.0] {
            // Every node moves by its new index.
            let moved = |node: &GapNode<2>| node.place + Vector::<2>::new(0.0, f64::from(node.node));
            assert_eq!([all.at(0, moved), all.at(2, moved)], [Some(size + 9.0), Some(30.0 - size)]);
            all.advance();
        }
    }
}
