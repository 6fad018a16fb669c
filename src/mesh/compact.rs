//! Removal of points that no element uses.

use super::Mesh;

/// The new number of a removed point.
pub(crate) const GONE: u32 = u32::MAX;

impl<const D: usize> Mesh<D> {
    /// Removes the points that no element uses and keeps the order of the others. Returns the new
    /// number of each old point, or `GONE`.
    ///
    /// Point sets are updated and lose the removed points.
    pub fn drop_unused_points(&mut self) -> Vec<u32> {
        let mut number = vec![GONE; self.points.len()];
        for &node in &self.nodes {
            number[node as usize] = 0;
        }
        let mut kept = 0;
        for (old, new) in number.iter_mut().enumerate() {
            if *new != GONE {
                *new = kept;
                self.points[kept as usize] = self.points[old];
                kept += 1;
            }
        }
        self.points.truncate(kept as usize);
        self.nodes.iter_mut().for_each(|node| *node = number[*node as usize]);
        for members in self.point_sets.values_mut() {
            members.iter_mut().for_each(|node| *node = number[*node as usize]);
            members.retain(|&node| node != GONE);
        }
        number
    }
}
