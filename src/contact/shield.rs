//! How near a facet can be at least: cheaper than a projection onto it, and closer to the truth than the box around it.

use crate::tensor::Vector;

/// A disc of some thickness around a facet: no point of it lies outside.
#[derive(Debug, Clone, Copy)]
pub struct Shield<const D: usize> {
    centre: Vector<D>,
    /// Unit normal of the disc, zero where the facet has none.
    normal: Vector<D>,
    /// Of the disc \[m\].
    radius: f64,
    /// From the middle of the disc to either side \[m\].
    thickness: f64,
}

impl<const D: usize> Shield<D> {
    /// Around a facet with these nodes \[m\], the `corners` first; the absolute values of its shape functions sum up to
    /// `stretch` at most.
    pub fn around(nodes: &[Vector<D>], corners: usize, stretch: f64) -> Self {
        let centre = nodes.iter().sum::<Vector<D>>() / nodes.len() as f64;
        let normal = across(&nodes[..corners]).try_normalize(f64::MIN_POSITIVE).unwrap_or_else(Vector::zeros);
        let arms = || nodes.iter().map(|node| node - centre);
        let radius = stretch * arms().map(|arm| arm.norm_squared()).fold(0.0, f64::max).sqrt();
        let thickness = stretch * arms().map(|arm| arm.dot(&normal).abs()).fold(0.0, f64::max);
        Self { centre, normal, radius, thickness }
    }

    /// No point of the facet is nearer to `x` than this \[m\].
    pub fn distance(&self, x: &Vector<D>) -> f64 {
        let arm = x - self.centre;
        let height = arm.dot(&self.normal);
        let beside = (arm.norm_squared() - height * height).max(0.0).sqrt();
        let (above, outside) = ((height.abs() - self.thickness).max(0.0), (beside - self.radius).max(0.0));
        (above * above + outside * outside).sqrt()
    }
}

/// A vector across a line, or across the diagonals of a triangle or quadrangle.
fn across<const D: usize>(corners: &[Vector<D>]) -> Vector<D> {
    let mut normal = Vector::zeros();
    match corners {
        [a, b] if D == 2 => {
            let along = b - a;
            (normal[0], normal[1]) = (-along[1], along[0]);
        }
        [a, b, c, ..] if D == 3 => {
            let (one, other) = (c - a, corners.get(3).unwrap_or(a) - b);
            for i in 0..3 {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                normal[i] = one[j] * other[k] - one[k] * other[j];
            }
        }
        _ => {}
    }
    normal
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::projection::Projection;
    use crate::mesh::{ElementKind, stretch};

    /// Bent and warped facets of all kinds, seen from all sides: the shield is never further than the facet, and straight
    /// above and beside a flat one it is as far.
    #[test]
    fn the_shield_is_no_further_than_the_facet() {
        let bent = |x: f64, y: f64| 0.2 * x * y + 0.1 * x * x - 0.15 * y;
        let mut number = 0.37_f64;
        let mut random = || {
            number = (number * 997.0).fract();
            4.0 * number - 2.0
        };
        for kind in
            [ElementKind::Tri3, ElementKind::Tri6, ElementKind::Quad4, ElementKind::Quad8, ElementKind::Quad9]
        {
            let reference = crate::space::reference(kind).node_coordinates();
            let nodes: Vec<Vector<3>> =
                reference.iter().map(|[x, y, _]| Vector::from([*x, *y, bent(*x, *y)])).collect();
            let shield = Shield::around(&nodes, kind.corners(), stretch(kind));
            for _ in 0..200 {
                let x = Vector::from([random(), random(), random()]);
                let distance = Projection::of(&x, kind, &nodes).distance;
                assert!(shield.distance(&x) <= distance * (1.0 + 1e-9), "{kind:?} at {x}");
            }
        }
        let line = [Vector::from([0.0, 0.0]), Vector::from([2.0, 0.0])];
        let shield = Shield::around(&line, 2, 1.0);
        assert!((shield.distance(&Vector::from([1.3, 0.7])) - 0.7).abs() < 1e-15);
        assert!((shield.distance(&Vector::from([5.0, 0.0])) - 3.0).abs() < 1e-15);
    }
}
