//! A closed surface of triangles as a smooth signed distance (theory, section 1.11).
//!
//! Every triangle is replaced by a quadratic patch through its corners, whose edges follow the
//! normals of the corners. The patch has the distance, the normal and the curvature of a curved
//! surface.

mod bounding;
mod patch;
mod topology;

use super::solid::{SolidMoments, SurfaceSums};
use crate::error::Result;
use crate::tensor::{Tensor, Vector};
use bounding::PatchTree;
use patch::{Foot, Patch};

/// A closed surface of patches, which bounds a solid.
#[derive(Debug)]
pub struct TriangleSurface {
    patches: Vec<Patch>,
    tree: PatchTree,
    /// Centroid of the solid \[m\].
    pub centroid: Vector<3>,
}

/// Closest point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestPoint {
    /// Signed distance \[m\], > 0 outside.
    pub distance: f64,
    /// Gradient of the distance.
    pub normal: Vector<3>,
    /// Hessian of the distance \[1/m\].
    pub hessian: Tensor<3>,
}

impl TriangleSurface {
    /// From points \[m\] and triangles, anticlockwise seen from outside or all clockwise. Edges
    /// whose triangles meet at more than `crease` \[rad\] stay sharp.
    ///
    /// # Errors
    /// The surface has no triangles, is open, or its triangles are degenerate or not consistently
    /// oriented.
    pub fn new(points: &[[f64; 3]], triangles: Vec<[u32; 3]>, crease: f64) -> Result<Self> {
        let topology::Oriented { triangles, neighbours, centroid } = topology::check(points, triangles)?;
        let patches = patch::patches(points, &triangles, &neighbours, crease);
        let tree = PatchTree::new(&patches);
        Ok(Self { patches, tree, centroid })
    }

    /// Volume, centroid and second moments of the solid within the patches.
    pub fn moments(&self) -> SolidMoments<3> {
        let mut sums = SurfaceSums::<3>::about(self.centroid);
        self.patches.iter().for_each(|patch| sums.add_patch(|u, v| (patch.at(u, v), patch.tangents(u, v))));
        sums.finish()
    }

    /// Number of patches.
    pub fn count(&self) -> usize {
        self.patches.len()
    }

    /// Corners of all patches, moved outward by a distance \[m\].
    pub fn corners(&self, distance: f64) -> impl Iterator<Item = [Vector<3>; 3]> {
        let corner = move |patch: &Patch, [u, v]: [f64; 2]| {
            let [along, across] = patch.tangents(u, v);
            patch.at(u, v) + along.cross(&across).normalize() * distance
        };
        let ends = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        self.patches.iter().map(move |patch| ends.map(|end| corner(patch, end)))
    }

    /// The point of the surface that is closest to `x` \[m\].
    pub fn nearest(&self, x: &Vector<3>) -> NearestPoint {
        let mut best: Option<(usize, Foot)> = None;
        self.tree.visit(x, |patch| {
            let foot = self.patches[patch].nearest(x);
            if best.is_none_or(|(_, best)| foot.square < best.square) {
                best = Some((patch, foot));
            }
            best.map_or(f64::INFINITY, |(_, best)| best.square)
        });
        match best {
            Some((patch, foot)) => self.patches[patch].relation(x, &foot),
            None => NearestPoint { distance: f64::MAX, normal: Vector::<3>::z(), hessian: Tensor::zeros() },
        }
    }
}

#[cfg(test)]
pub(super) mod tests;
