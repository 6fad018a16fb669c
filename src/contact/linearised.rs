//! Gaps linearised at the iterate before, which replace the gaps in tangents (theory, section 5.1).
//!
//! A correction changes gaps by more than its first-order part, and the stiffness of the normal law
//! multiplies the rest. In a mixed method, whose pressures are unknowns, these pressures do not arise.

use std::rc::Rc;

use crate::tensor::Vector;

/// A node of a [`LinearGap`].
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

/// The gap of a point as a linear function of the places of its nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearGap<const D: usize> {
    /// Gap at the places of the nodes \[m\].
    pub gap: f64,
    /// The nodes on which it depends.
    pub nodes: Vec<GapNode<D>>,
}

impl<const D: usize> LinearGap<D> {
    /// The linearised gap at other places of the nodes \[m\].
    pub fn at(&self, place: impl Fn(&GapNode<D>) -> Vector<D>) -> f64 {
        let changes = self.nodes.iter().map(|node| node.slope.dot(&(place(node) - node.place)));
        self.gap + changes.sum::<f64>()
    }
}

/// The linear gaps of all points of a contact; `None` for a point that had no stiffness there.
type All<const D: usize> = Vec<Option<LinearGap<D>>>;

/// Linear gaps of the points of a contact. Points are known if the last tangent but one had their
/// stiffness, so that a linear solve has found their pressure.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LinearGaps<const D: usize> {
    used: Option<Rc<All<D>>>,
    /// Those at the last tangent.
    next: All<D>,
}

impl<const D: usize> LinearGaps<D> {
    /// Stores the linear gaps at a tangent, to be used after its linear solve.
    pub fn note(&mut self, gaps: All<D>) {
        self.next = gaps;
    }

    /// Uses the gaps of the last tangent from now on, because its linear solve is done. Without a new
    /// tangent, gaps are those of the positions.
    pub fn advance(&mut self) {
        let next = std::mem::take(&mut self.next);
        self.used = (!next.is_empty()).then(|| Rc::new(next));
    }

    /// Uses these gaps, whatever the positions of the nodes.
    pub fn set(&mut self, gaps: impl Iterator<Item = Option<f64>>) {
        let constant = |gap| LinearGap { gap, nodes: Vec::new() };
        self.used = Some(Rc::new(gaps.map(|gap| gap.map(constant)).collect()));
        self.next = Vec::new();
    }

    /// Forgets all gaps.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// The gap of a point, if it is known.
    pub fn of(&self, p: usize) -> Option<&LinearGap<D>> {
        self.used.as_ref()?.get(p)?.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gap(value: f64) -> LinearGap<2> {
        let node = |node, slope| GapNode {
            node,
            reference: Vector::<2>::zeros(),
            place: Vector::<2>::new(1.0, f64::from(node)),
            slope: Vector::<2>::new(0.0, slope),
        };
        LinearGap { gap: value, nodes: vec![node(0, 1.0), node(1, -0.5)] }
    }

    /// A linear gap changes with the places of its nodes by their slopes.
    #[test]
    fn gaps_are_linear_in_places() {
        let gap = gap(0.25);
        assert_eq!(gap.at(|node| node.place), 0.25);
        let moved = |node: &GapNode<2>| node.place + Vector::<2>::new(7.0, f64::from(1 + node.node));
        assert_eq!(gap.at(moved), 0.25 + 1.0 - 0.5 * 2.0);
    }

    /// Gaps of a tangent serve after its solve, and only until the next solve.
    #[test]
    fn gaps_serve_between_two_solves() {
        let mut gaps = LinearGaps::default();
        gaps.note(vec![Some(gap(1.0)), None]);
        assert_eq!(gaps.of(0), None);
        gaps.advance();
        assert_eq!((gaps.of(0), gaps.of(1), gaps.of(2)), (Some(&gap(1.0)), None, None));
        gaps.note(vec![Some(gap(2.0)), None]);
        assert_eq!(gaps.of(0), Some(&gap(1.0)));
        gaps.advance();
        assert_eq!(gaps.of(0), Some(&gap(2.0)));
        gaps.advance();
        assert_eq!(gaps.of(0), None);
        gaps.set([None, Some(3.0)].into_iter());
        assert_eq!(gaps.of(1).map(|gap| gap.at(|node| node.place)), Some(3.0));
        gaps.clear();
        assert_eq!(gaps.of(1), None);
    }
}
