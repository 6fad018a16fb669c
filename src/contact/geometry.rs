//! Geometry of one contact point: gap, normal and area, with their variations by every node involved.
//!
//! The target is a rigid obstacle, which has no nodes: those of the facet, with coefficients `N_a`, are all there are. The point kernel
//! sees nothing else of the geometry.

use super::obstacle::Proximity;
use crate::space::{area_variation, facet_normal, facet_tangents};
use crate::tensor::{Tensor, Vector};

/// A quadrature point of the contactor facet: one row of its table.
#[derive(Debug, Clone, Copy)]
pub struct FacetPoint<'a> {
    /// `N_a`, one for each node.
    pub shape: &'a [f64],
    /// `dN_a/dxi_k` at `a * (D - 1) + k`.
    pub gradient: &'a [f64],
    /// Weight on the reference facet.
    pub weight: f64,
}

impl FacetPoint<'_> {
    /// Position \[m\] between nodes at `nodes`.
    pub fn position<const D: usize>(&self, nodes: &[Vector<D>]) -> Vector<D> {
        nodes.iter().zip(self.shape).map(|(x, n)| x * *n).sum()
    }
}

/// Which area carries the traction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AreaMeasure {
    /// The deformed facet: tractions are Cauchy's.
    Current,
    /// The undeformed facet with this area of the point \[m, m^2\]: tractions are nominal and `K_phi` vanishes.
    Reference(f64),
}

/// How gap, normal and area of a point change with the position of one node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodeVariation<const D: usize> {
    /// `c_a = N_a`.
    pub coefficient: f64,
    /// `dg/dz_a` \[-\].
    pub gap: Vector<D>,
    /// `dn/dz_a` \[1/m\].
    pub normal: Tensor<D>,
    /// `dA/dz_a` \[-, m\].
    pub area: Vector<D>,
}

/// Gap, normal and area of a point with their variations. Keep one and refill it: it does not allocate anew.
#[derive(Debug, Clone, PartialEq)]
pub struct Geometry<const D: usize> {
    /// `g_n` \[m\], > 0 open.
    pub gap: f64,
    /// `n`, unit, outward from the target.
    pub normal: Vector<D>,
    /// `A`: area that the point stands for \[m per depth in 2D, m^2\].
    pub area: f64,
    /// Nodes of the facet.
    pub nodes: Vec<NodeVariation<D>>,
}

impl<const D: usize> Default for Geometry<D> {
    fn default() -> Self {
        Self { gap: f64::INFINITY, normal: Vector::zeros(), area: 0.0, nodes: Vec::new() }
    }
}

impl<const D: usize> Geometry<D> {
    /// Fills in a point against a rigid obstacle: `dg = n . dx`, `dn = H dx`.
    pub fn against_obstacle(&mut self, point: &FacetPoint<'_>, proximity: &Proximity<D>) {
        self.gap = proximity.gap;
        self.normal = proximity.normal;
        self.nodes.clear();
        self.nodes.extend(point.shape.iter().map(|&n| NodeVariation {
            gap: proximity.normal * n,
            normal: proximity.hessian * n,
            coefficient: n,
            area: Vector::zeros(),
        }));
    }

    /// Fills in the area of the point, `w |x_,1 x x_,2|` or the reference one; call it after the gap.
    pub fn with_area(&mut self, point: &FacetPoint<'_>, current: &[Vector<D>], measure: AreaMeasure) {
        if let AreaMeasure::Reference(area) = measure {
            self.area = area;
            return;
        }
        let tangents = facet_tangents(current, point.gradient);
        let outward = facet_normal(&tangents);
        let size = outward.norm();
        self.area = point.weight * size;
        if size <= 0.0 {
            return;
        }
        let unit = outward / size;
        for (node, gradient) in self.nodes.iter_mut().zip(point.gradient.chunks_exact(D - 1)) {
            node.area = area_variation(&tangents, gradient).transpose() * unit * point.weight;
        }
    }

    /// `sum_a c_a field_a`: a field at the point.
    pub fn relative(&self, field: &[Vector<D>]) -> Vector<D> {
        self.nodes.iter().zip(field).map(|(node, value)| value * node.coefficient).sum()
    }
}
