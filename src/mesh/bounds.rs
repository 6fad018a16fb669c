//! Axis-aligned bounding boxes, a first inexpensive test of whether two facets can touch.

use super::ElementKind;

/// An axis-aligned box \[m\]. It is closed, so that boxes with a common face intersect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds<const D: usize> {
    /// Lowest coordinates.
    pub low: [f64; D],
    /// Highest coordinates; below `low` if the box is empty.
    pub high: [f64; D],
}

impl<const D: usize> Default for Bounds<D> {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl<const D: usize> Bounds<D> {
    /// The empty box. It intersects no other box and adds nothing in a union.
    pub const EMPTY: Self = Self { low: [f64::INFINITY; D], high: [f64::NEG_INFINITY; D] };

    /// The smallest box around points.
    pub fn of(points: impl IntoIterator<Item = [f64; D]>) -> Self {
        points.into_iter().fold(Self::EMPTY, |all, x| all.join(&Self { low: x, high: x }))
    }

    /// A box around the whole facet, given its nodes. A curved facet may extend beyond the box
    /// around its nodes.
    pub fn of_facet(kind: ElementKind, nodes: impl IntoIterator<Item = [f64; D]>) -> Self {
        let nodal = Self::of(nodes);
        let beyond = overshoot(kind);
        let edge = |k: usize| beyond * (nodal.high[k] - nodal.low[k]);
        if beyond == 0.0 || nodal.is_empty() {
            return nodal;
        }
        Self {
            low: std::array::from_fn(|k| nodal.low[k] - edge(k)),
            high: std::array::from_fn(|k| nodal.high[k] + edge(k)),
        }
    }

    /// Whether the box is empty.
    pub fn is_empty(&self) -> bool {
        (0..D).any(|k| self.low[k] > self.high[k])
    }

    /// The smallest box around both.
    #[must_use]
    pub fn join(&self, other: &Self) -> Self {
        Self {
            low: std::array::from_fn(|k| self.low[k].min(other.low[k])),
            high: std::array::from_fn(|k| self.high[k].max(other.high[k])),
        }
    }

    /// The box extended on every side by `distance` \[m\].
    #[must_use]
    pub fn inflate(&self, distance: f64) -> Self {
        Self { low: self.low.map(|x| x - distance), high: self.high.map(|x| x + distance) }
    }

    /// Whether the boxes have a point in common.
    pub fn meets(&self, other: &Self) -> bool {
        (0..D).all(|k| self.low[k] <= other.high[k] && other.low[k] <= self.high[k])
    }

    /// Whether the segment between two points comes within rounding of the box: a billionth of the
    /// lengths of box and segment. Half and twice that find the same walls in the tests.
    pub fn meets_segment(&self, [from, to]: [[f64; D]; 2]) -> bool {
        const ROUNDING: f64 = 1e-9;
        let size = (0..D).map(|k| (to[k] - from[k]).abs()).fold(self.extent(), f64::max);
        let slack = ROUNDING * size;
        let (mut first, mut last) = (0.0_f64, 1.0_f64);
        for k in 0..D {
            let (low, high) = (self.low[k] - slack - from[k], self.high[k] + slack - from[k]);
            let way = to[k] - from[k];
            if way == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return false;
                }
                continue;
            }
            let (enters, leaves) = if way > 0.0 { (low / way, high / way) } else { (high / way, low / way) };
            first = first.max(enters);
            last = last.min(leaves);
        }
        first <= last
    }

    /// The middle of the box \[m\].
    pub fn centre(&self) -> [f64; D] {
        std::array::from_fn(|k| 0.5 * (self.low[k] + self.high[k]))
    }

    /// Longest edge \[m\]; negative if the box is empty.
    pub fn extent(&self) -> f64 {
        (0..D).map(|k| self.high[k] - self.low[k]).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Axis of the longest edge.
    fn axis(&self) -> usize {
        let edge = |k: usize| self.high[k] - self.low[k];
        (1..D).fold(0, |best, k| if edge(k) > edge(best) { k } else { best })
    }

    /// At most `most` boxes that cover `all`, each around neighbouring boxes.
    ///
    /// The list is halved recursively at the median along its longest edge. A long thin surface
    /// becomes a row of boxes.
    pub fn clusters(all: &mut [Self], most: usize) -> Vec<Self> {
        let whole = all.iter().fold(Self::EMPTY, |sum, one| sum.join(one));
        if whole.is_empty() {
            return Vec::new();
        }
        if most < 2 || all.len() < 2 {
            return vec![whole];
        }
        let axis = whole.axis();
        let middle = all.len() / 2;
        all.select_nth_unstable_by(middle, |a, b| a.centre()[axis].total_cmp(&b.centre()[axis]));
        let (one, other) = all.split_at_mut(middle);
        let mut clusters = Self::clusters(one, most / 2);
        clusters.extend(Self::clusters(other, most - most / 2));
        clusters
    }
}

/// Maximum displacement of a point of a facet, relative to the largest displacement of its nodes.
///
/// This is the maximum of the sum of absolute shape functions (Lebesgue constant); 1 for a linear
/// facet.
pub fn stretch(kind: ElementKind) -> f64 {
    1.0 + 2.0 * overshoot(kind)
}

/// Maximum distance by which a facet extends beyond the box around its nodes, in widths of that
/// box.
///
/// Coordinates are sums of nodal coordinates times shape functions, and the shape functions sum to
/// one. Let `L` be the maximum of the sum of their absolute values (Lebesgue constant). The
/// distance from the middle is at most `L` times half the width.
fn overshoot(kind: ElementKind) -> f64 {
    use ElementKind::*;
    let lebesgue = match kind {
        Line3 => 5.0 / 4.0,
        Tri6 => 5.0 / 3.0,
        Quad8 => 3.0,
        Quad9 => 25.0 / 16.0,
        Line2 | Tri3 | Quad4 | Tet4 | Hex8 | Wedge6 | Pyramid5 => 1.0,
        // Not facets.
        Tet10 | Hex20 | Hex27 => f64::INFINITY,
    };
    0.5 * (lebesgue - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::reference;

    /// No curved facet leaves its box for any node positions. The bound is the sum of the absolute
    /// shape functions.
    #[test]
    fn curved_facets_stay_in_their_boxes() {
        use ElementKind::*;
        for kind in [Line2, Line3, Tri3, Tri6, Quad4, Quad8, Quad9] {
            let mut n = vec![0.0; kind.nodes()];
            let mut most = 0.0_f64;
            let triangle = matches!(kind, Tri3 | Tri6);
            for (i, j) in (0..=60).flat_map(|i| (0..=60).map(move |j| (i, j))) {
                let (mut xi, mut eta) = (f64::from(i) / 30.0 - 1.0, f64::from(j) / 30.0 - 1.0);
                if triangle {
                    (xi, eta) = (0.5 * (xi + 1.0), 0.5 * (eta + 1.0));
                }
                if !triangle || xi + eta <= 1.0 {
                    reference(kind).shape(&[xi, eta, 0.0], &mut n);
                    most = most.max(n.iter().map(|n| n.abs()).sum());
                }
            }
            let bound = stretch(kind);
            assert!(most <= bound + 1e-12 && most > bound - 0.01, "{kind}: {most} against {bound}");
        }
    }

    /// Clusters cover all boxes, do not exceed the requested number, and follow a bent strip
    /// closely.
    #[test]
    fn clusters_cover_a_strip() {
        let at = |x: [f64; 2]| Bounds { low: x, high: x.map(|x| x + 1.0) };
        let strip =
            (0..40).map(|i| at(if i < 20 { [f64::from(i), 0.0] } else { [20.0, f64::from(i) - 20.0] }));
        let mut boxes: Vec<Bounds<2>> = strip.collect();
        let all = boxes.clone();
        for most in 1..=8 {
            let clusters = Bounds::clusters(&mut boxes, most);
            assert!(clusters.len() <= most);
            for one in &all {
                assert!(clusters.iter().any(|cluster| cluster.join(one) == *cluster), "{one:?}");
            }
        }
        let clusters = Bounds::clusters(&mut boxes, 8);
        assert!(clusters.iter().all(|cluster| cluster.extent() <= 7.0), "{clusters:?}");
        assert!(!clusters.iter().any(|cluster| cluster.meets(&at([8.0, 8.0]))));
        assert!(Bounds::<2>::clusters(&mut [], 8).is_empty());
    }

    /// A segment meets a box if a point of it is in the box, also through a corner, along a side, and
    /// through a box without thickness.
    #[test]
    fn segments_meet_boxes() {
        let cube = Bounds { low: [0.0; 3], high: [1.0, 2.0, 3.0] };
        let meets = |from, to| cube.meets_segment([from, to]);
        assert!(meets([-1.0, -1.0, -1.0], [2.0, 3.0, 4.0]) && meets([0.5; 3], [0.6; 3]));
        assert!(meets([0.5, 1.0, -9.0], [0.5, 1.0, 9.0]) && !meets([0.5, 2.1, -9.0], [0.5, 2.1, 9.0]));
        // Past a corner on either side, through it, and along an edge.
        let past = |x: f64| meets([x, -1.0, 0.5], [x - 2.0, 1.0, 0.5]);
        assert!(past(1.0) && past(1.0 - 1e-12) && past(1.001) && !past(0.999));
        assert!(meets([1.0, -1.0, 0.0], [1.0, 5.0, 0.0]) && !meets([1.0, -1.0, -1e-6], [1.0, 5.0, -1e-6]));
        // It ends before the box.
        assert!(!meets([-1.0, 1.0, 1.0], [-0.01, 1.0, 1.0]) && meets([-1.0, 1.0, 1.0], [0.0, 1.0, 1.0]));
        let plate = Bounds { low: [0.1, 0.0, 0.0], high: [0.1, 1.0, 1.0] };
        for k in 1..100 {
            let from = [0.1 - f64::from(k) / 7.0, 0.3, 0.9];
            let to = [0.1 + f64::from(k) / 3.0, 0.7, 0.1];
            assert!(plate.meets_segment([from, to]));
            assert!(!plate.meets_segment([from, [0.1 - 1e-6, 0.5, 0.5]]));
        }
        assert!(!Bounds::EMPTY.meets_segment([[0.0; 3], [1.0; 3]]));
        assert!(!Bounds::EMPTY.meets_segment([[0.0; 3], [0.0; 3]]));
    }

    /// The empty box intersects no box of any size.
    #[test]
    fn empty_box_meets_nothing() {
        let all = Bounds { low: [-1e300; 3], high: [1e300; 3] };
        assert!(!Bounds::EMPTY.meets(&all) && !all.meets(&Bounds::EMPTY) && all.meets(&all));
        assert_eq!(Bounds::EMPTY.join(&all), all);
    }
}
