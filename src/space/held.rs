//! Directions in which supports hold the nodes: axes, and inclined directions of rollers (3.31).
//!
//! With the orthogonal projection `P` of each node onto its free directions, the equations of the
//! free unknowns are `P K P du = P r`. For a node that is held along axes, `P` is diagonal with
//! zeros and ones.

/// Held directions of the local nodes, with the degrees of freedom of [`DofMap`](super::DofMap).
#[derive(Debug, Clone, PartialEq)]
pub struct Held<const D: usize> {
    /// Whether each local unknown is prescribed along its axis; false at inclined nodes.
    axes: Vec<bool>,
    /// Nodes with a held direction that is not an axis, in ascending order, each with the projection
    /// onto its free directions.
    inclined: Vec<(u32, [[f64; D]; D])>,
}

impl<const D: usize> Held<D> {
    /// Nodes that are held along axes, one entry per unknown.
    pub fn along_axes(axes: Vec<bool>) -> Self {
        Self { axes, inclined: Vec::new() }
    }

    /// Gives these nodes the projections onto their free directions; `node` in ascending order.
    #[must_use]
    pub fn with_inclined(mut self, inclined: Vec<(u32, [[f64; D]; D])>) -> Self {
        for (node, _) in &inclined {
            self.axes[*node as usize * D..][..D].fill(false);
        }
        self.inclined = inclined;
        self
    }

    /// Appends nodes with these projections, row-major, `D * D` values per node.
    #[must_use]
    pub fn followed_by(mut self, projections: &[f64]) -> Self {
        for projection in projections.chunks_exact(D * D) {
            let projection: [[f64; D]; D] =
                std::array::from_fn(|i| std::array::from_fn(|j| projection[i * D + j]));
            let node = (self.axes.len() / D) as u32;
            let is_of_axes = |(ij, value): (usize, &f64)| match ij % (D + 1) {
                0 => *value == 0.0 || *value == 1.0,
                _ => *value == 0.0,
            };
            if projection.as_flattened().iter().enumerate().all(is_of_axes) {
                self.axes.extend((0..D).map(|i| projection[i][i] == 0.0));
            } else {
                self.axes.extend([false; D]);
                self.inclined.push((node, projection));
            }
        }
        self
    }

    /// The held directions of the first `nodes` nodes.
    #[must_use]
    pub fn first_nodes(&self, nodes: usize) -> Self {
        let inclined = self.inclined.iter().filter(|(node, _)| (*node as usize) < nodes);
        Self { axes: self.axes[..nodes * D].to_vec(), inclined: inclined.copied().collect() }
    }

    /// Number of local unknowns.
    pub fn len(&self) -> usize {
        self.axes.len()
    }

    /// Whether there are no unknowns.
    pub fn is_empty(&self) -> bool {
        self.axes.is_empty()
    }

    /// Whether each unknown is prescribed along its axis. False at [inclined](Self::inclined) nodes.
    pub fn axes(&self) -> &[bool] {
        &self.axes
    }

    /// Marks unknowns that are prescribed along their axes.
    pub fn axes_mut(&mut self) -> &mut [bool] {
        &mut self.axes
    }

    /// Nodes with a held direction that is not an axis, in ascending order, each with the projection
    /// onto its free directions.
    pub fn inclined(&self) -> &[(u32, [[f64; D]; D])] {
        &self.inclined
    }

    /// Projection of an inclined node onto its free directions.
    #[inline]
    pub fn inclination(&self, node: usize) -> Option<&[[f64; D]; D]> {
        if self.inclined.is_empty() {
            return None;
        }
        let place = self.inclined.binary_search_by_key(&(node as u32), |(node, _)| *node);
        place.ok().map(|place| &self.inclined[place].1)
    }

    /// Whether a node has a held direction.
    pub fn holds(&self, node: usize) -> bool {
        self.axes[node * D..][..D].contains(&true) || self.inclination(node).is_some()
    }

    /// The projection of a node onto its free directions.
    pub fn projection(&self, node: usize) -> [[f64; D]; D] {
        self.inclination(node).copied().unwrap_or_else(|| {
            let free = |i: usize, j: usize| if i == j && !self.axes[node * D + i] { 1.0 } else { 0.0 };
            std::array::from_fn(|i| std::array::from_fn(|j| free(i, j)))
        })
    }

    /// Number of held directions of the first `nodes` nodes.
    pub fn count(&self, nodes: usize) -> usize {
        let along_axes = self.axes[..nodes * D].iter().filter(|held| **held).count();
        let inclined = self.inclined.iter().filter(|(node, _)| (*node as usize) < nodes);
        let held = |projection: &[[f64; D]; D]| D as f64 - (0..D).map(|i| projection[i][i]).sum::<f64>();
        along_axes + inclined.map(|(_, projection)| held(projection).round() as usize).sum::<usize>()
    }

    /// Removes the held part of the values of one node.
    pub fn clear_node(&self, node: usize, values: &mut [f64]) {
        match self.inclination(node) {
            Some(projection) => project(projection, values),
            None => zero(values, &self.axes[node * D..][..D], true),
        }
    }

    /// Removes the held part of nodal values: of all local nodes, or of the first ones.
    pub fn clear(&self, values: &mut [f64]) {
        zero(values, &self.axes, true);
        for (node, projection) in &self.inclined {
            if let Some(values) = values.get_mut(*node as usize * D..(*node as usize + 1) * D) {
                project(projection, values);
            }
        }
    }

    /// Removes the free part of nodal values: of all local nodes, or of the first ones.
    pub fn keep(&self, values: &mut [f64]) {
        let start: Vec<[f64; D]> = self.inclined_values(values).collect();
        zero(values, &self.axes, false);
        for ((node, projection), mut old) in self.inclined.iter().zip(start) {
            let values = &mut values[*node as usize * D..][..D];
            values.copy_from_slice(&old);
            project(projection, &mut old);
            values.iter_mut().zip(old).for_each(|(value, free)| *value -= free);
        }
    }

    fn inclined_values(&self, values: &[f64]) -> impl Iterator<Item = [f64; D]> {
        let of_node = |(node, _): &(u32, _)| {
            let own = values.get(*node as usize * D..(*node as usize + 1) * D)?;
            Some(std::array::from_fn(|i| own[i]))
        };
        self.inclined.iter().map_while(of_node)
    }

    /// Replaces the free part of the values of one node.
    pub fn replace_free(&self, node: usize, values: &mut [f64], by: &[f64; D]) {
        let mut change: [f64; D] = std::array::from_fn(|i| by[i] - values[i]);
        match self.inclination(node) {
            None => {
                let held = &self.axes[node * D..][..D];
                (0..D).filter(|i| !held[*i]).for_each(|i| values[i] = by[i]);
            }
            Some(projection) => {
                project(projection, &mut change);
                values.iter_mut().zip(change).for_each(|(value, change)| *value += change);
            }
        }
    }

    /// Replaces the held part of nodal values, of all local nodes or of the first ones, by that of
    /// `target(dof, value)`.
    pub fn replace_held(&self, values: &mut [f64], target: impl Fn(usize, f64) -> f64) {
        let held = self.axes[..values.len()].iter().enumerate().filter(|(_, held)| **held);
        held.for_each(|(dof, _)| values[dof] = target(dof, values[dof]));
        for (node, projection) in &self.inclined {
            let first = *node as usize * D;
            let Some(values) = values.get_mut(first..first + D) else { continue };
            let change: [f64; D] = std::array::from_fn(|i| target(first + i, values[i]) - values[i]);
            let mut free = change;
            project(projection, &mut free);
            for (i, value) in values.iter_mut().enumerate() {
                *value += change[i] - free[i];
            }
        }
    }

    /// Restricts a block of the matrix, row-major, to the free directions of its nodes: `P_a B P_b`.
    pub fn restrict(&self, row: usize, column: usize, block: &mut [f64]) {
        match self.inclination(row) {
            Some(projection) => {
                for j in 0..D {
                    let mut of_column: [f64; D] = std::array::from_fn(|i| block[i * D + j]);
                    project(projection, &mut of_column);
                    (0..D).for_each(|i| block[i * D + j] = of_column[i]);
                }
            }
            None => {
                let held = &self.axes[row * D..][..D];
                (0..D).filter(|i| held[*i]).for_each(|i| block[i * D..][..D].fill(0.0));
            }
        }
        match self.inclination(column) {
            Some(projection) => block.chunks_exact_mut(D).for_each(|of_row| project(projection, of_row)),
            None => {
                let held = &self.axes[column * D..][..D];
                block.chunks_exact_mut(D).for_each(|of_row| zero(of_row, held, true));
            }
        }
    }
}

/// Applies a symmetric projection to the values of a node.
fn project<const D: usize>(projection: &[[f64; D]; D], values: &mut [f64]) {
    let product: [f64; D] =
        std::array::from_fn(|i| projection[i].iter().zip(&*values).map(|(p, value)| p * value).sum());
    values.copy_from_slice(&product);
}

/// Sets those values to zero whose mark is `marked`.
fn zero(values: &mut [f64], marks: &[bool], marked: bool) {
    let wanted = values.iter_mut().zip(marks).filter(|(_, mark)| **mark == marked);
    wanted.for_each(|(value, _)| *value = 0.0);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three nodes: held along y, free, and held along (0.6, 0.8).
    fn sample() -> Held<2> {
        let along_axes = vec![false, true, false, false, false, false];
        Held::along_axes(along_axes).with_inclined(vec![(2, [[0.64, -0.48], [-0.48, 0.36]])])
    }

    /// The held and the free part add up to the values, and each is orthogonal to the other's
    /// directions.
    #[test]
    fn values_have_a_held_and_a_free_part() {
        let values = [1.0, 2.0, 3.0, 4.0, 5.0, 10.0];
        let (mut free, mut held) = (values, values);
        sample().clear(&mut free);
        sample().keep(&mut held);
        assert_eq!(free[..4], [1.0, 0.0, 3.0, 4.0]);
        assert_eq!(held[..4], [0.0, 2.0, 0.0, 0.0]);
        assert!((held[4] - 6.6).abs() < 1e-14 && (held[5] - 8.8).abs() < 1e-14, "{held:?}");
        (0..6).for_each(|i| assert!((free[i] + held[i] - values[i]).abs() < 1e-14));
        assert!((0.6 * free[4] + 0.8 * free[5]).abs() < 1e-14);
        assert_eq!(sample().count(3), 2);
        assert_eq!(sample().count(2), 1);
    }

    /// Values of the first nodes only, such as those that a rank owns, are handled.
    #[test]
    fn fewer_values_than_nodes() {
        let mut owned = [1.0, 2.0, 3.0, 4.0];
        sample().clear(&mut owned);
        assert_eq!(owned, [1.0, 0.0, 3.0, 4.0]);
        sample().keep(&mut owned);
        assert_eq!(owned, [0.0, 0.0, 0.0, 0.0]);
    }

    /// Replacing one part leaves the other.
    #[test]
    fn replaced_parts() {
        let mut values = [1.0, 2.0, 3.0, 4.0, 5.0, 10.0];
        sample().replace_held(&mut values, |_, _| 0.0);
        let mut free = [1.0, 2.0, 3.0, 4.0, 5.0, 10.0];
        sample().clear(&mut free);
        (0..6).for_each(|i| assert!((values[i] - free[i]).abs() < 1e-14));
        let mut node = [5.0, 10.0];
        sample().replace_free(2, &mut node, &[0.0, 0.0]);
        assert!((node[0] - 6.6).abs() < 1e-14 && (node[1] - 8.8).abs() < 1e-14, "{node:?}");
        let mut node = [1.0, 2.0];
        sample().replace_free(0, &mut node, &[7.0, 7.0]);
        assert_eq!(node, [7.0, 2.0]);
    }

    /// A restricted block maps free directions to free directions, and a block between an inclined
    /// node and one that is held along an axis obeys both.
    #[test]
    fn restricted_blocks() {
        let mut block = [1.0, 2.0, 3.0, 4.0];
        sample().restrict(2, 0, &mut block);
        assert_eq!([block[1], block[3]], [0.0, 0.0]);
        assert!((0.6 * block[0] + 0.8 * block[2]).abs() < 1e-15);
        let mut own = [1.0, 2.0, 3.0, 4.0];
        sample().restrict(2, 2, &mut own);
        let through: [f64; 2] = [0.6 * own[0] + 0.8 * own[1], 0.6 * own[2] + 0.8 * own[3]];
        assert!(through.iter().all(|value| value.abs() < 1e-15), "{through:?}");
    }

    /// Projections that travel between ranks arrive as they were.
    #[test]
    fn appended_nodes_equal_the_originals() {
        let all = sample();
        let flat: Vec<f64> = (0..3).flat_map(|node| all.projection(node).into_iter().flatten()).collect();
        assert_eq!(Held::<2>::along_axes(Vec::new()).followed_by(&flat), all);
    }
}
