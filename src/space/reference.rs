//! Reference elements: nodes, shape functions with their derivatives, and quadrature rules for each
//! purpose.

use std::sync::LazyLock;

use super::layout::Layout;
use super::quadrature::Rule;
use super::shape::{Family, Product, functions};
use super::{hexes, lines, pyramids, quads, tets, triangles, wedges};
use crate::mesh::ElementKind;

/// An element on its reference domain: `[-1, 1]^d` (lines, quads, hexes), the unit simplex
/// (triangles, tets), the unit triangle times `[-1, 1]` (wedges), or `|xi|, |eta| <= 1 - zeta` with
/// `0 <= zeta <= 1` (pyramids).
#[derive(Debug)]
pub struct ReferenceElement {
    /// Kind of the element.
    pub kind: ElementKind,
    dim: usize,
    coordinates: &'static [[f64; 3]],
    functions: Vec<Product>,
    full: Rule,
    reduced: Rule,
    mass: Rule,
    gauss_contact: Rule,
    nodal: Option<Rule>,
}

/// Shape functions and gradients at the points of a rule.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeTable {
    /// Nodes of the element.
    pub nodes: usize,
    /// Points of the rule.
    pub points: usize,
    /// Dimension of the reference domain.
    pub dim: usize,
    /// `N_a` at point `q`: `n[q * nodes + a]`.
    pub n: Vec<f64>,
    /// `dN_a / d xi_k` at point `q`: `dn[(q * nodes + a) * dim + k]`.
    pub dn: Vec<f64>,
    /// Weights of the points.
    pub weights: Vec<f64>,
}

/// The reference element of `kind`.
pub fn reference(kind: ElementKind) -> &'static ReferenceElement {
    static ELEMENTS: LazyLock<Vec<ReferenceElement>> =
        LazyLock::new(|| ElementKind::ALL.iter().map(|&kind| ReferenceElement::new(kind)).collect());
    &ELEMENTS[kind as usize]
}

fn layout(kind: ElementKind) -> Layout {
    match kind {
        ElementKind::Line2 => lines::LINE2,
        ElementKind::Line3 => lines::LINE3,
        ElementKind::Tri3 => triangles::TRI3,
        ElementKind::Tri6 => triangles::TRI6,
        ElementKind::Quad4 => quads::QUAD4,
        ElementKind::Quad8 => quads::QUAD8,
        ElementKind::Quad9 => quads::QUAD9,
        ElementKind::Tet4 => tets::TET4,
        ElementKind::Tet10 => tets::TET10,
        ElementKind::Hex8 => hexes::HEX8,
        ElementKind::Hex20 => hexes::HEX20,
        ElementKind::Hex27 => hexes::HEX27,
        ElementKind::Wedge6 => wedges::WEDGE6,
        ElementKind::Pyramid5 => pyramids::PYRAMID5,
    }
}

impl ReferenceElement {
    fn new(kind: ElementKind) -> Self {
        let Layout { family, nodes, rules } = layout(kind);
        let dim = kind.dimension();
        let rule = |degree| rule(family, dim, degree);
        let functions = functions(family, nodes, dim);
        let nodal = nodal(&functions, nodes, &rule(rules.full.max(2)), rules.nodal);
        Self {
            kind,
            dim,
            coordinates: nodes,
            functions,
            full: rule(rules.full),
            reduced: rule(1),
            mass: rule(rules.mass),
            gauss_contact: rule(rules.contact),
            nodal,
        }
    }

    /// Dimension of the reference domain.
    pub fn dimension(&self) -> usize {
        self.dim
    }

    /// Whether the reference domain is the unit simplex rather than `[-1, 1]^d`.
    pub fn is_simplex(&self) -> bool {
        matches!(layout(self.kind).family, Family::Simplex(_))
    }

    /// Whether the reference domain is the unit triangle times `[-1, 1]`.
    pub fn is_wedge(&self) -> bool {
        layout(self.kind).family == Family::Wedge
    }

    /// Whether the reference domain is a pyramid.
    pub fn is_pyramid(&self) -> bool {
        layout(self.kind).family == Family::Pyramid
    }

    /// Reference coordinates of the nodes in VTK's order, unused ones zero.
    pub fn node_coordinates(&self) -> &'static [[f64; 3]] {
        self.coordinates
    }

    /// `N_a` at `xi` into `n[a]`. Dimensionless.
    pub fn shape(&self, xi: &[f64], n: &mut [f64]) {
        let xi = &xi[..self.dim];
        for (n, function) in n.iter_mut().zip(&self.functions) {
            *n = function.value(xi);
        }
    }

    /// `dN_a / d xi_k` at `xi` into `dn[a * dim + k]`.
    pub fn gradient(&self, xi: &[f64], dn: &mut [f64]) {
        let xi = &xi[..self.dim];
        for (dn, function) in dn.chunks_exact_mut(self.dim).zip(&self.functions) {
            for (k, dn) in dn.iter_mut().enumerate() {
                *dn = function.derivative(xi, k);
            }
        }
    }

    /// `d2N_a / d xi_k d xi_l` at `xi` into `d2n[(a * dim + k) * dim + l]`, needed for the
    /// curvature of facets.
    pub fn second_gradient(&self, xi: &[f64], d2n: &mut [f64]) {
        let xi = &xi[..self.dim];
        for (d2n, function) in d2n.chunks_exact_mut(self.dim * self.dim).zip(&self.functions) {
            for (kl, d2n) in d2n.iter_mut().enumerate() {
                *d2n = function.second_derivative(xi, kl / self.dim, kl % self.dim);
            }
        }
    }

    /// Stiffness: full integration (quad4 2x2, hex8 2x2x2, quadratic ones 3 in each direction; tri3
    /// and tet4 1, tri6 3, tet10 4, wedge6 6, pyramid5 8 points).
    pub fn full_rule(&self) -> &Rule {
        &self.full
    }

    /// One point, at the centroid.
    pub fn reduced_rule(&self) -> &Rule {
        &self.reduced
    }

    /// Mass: exact for `N_a N_b` on an affine element.
    pub fn mass_rule(&self) -> &Rule {
        &self.mass
    }

    /// Contact by Gauss points: 2 in each direction on linear facets, 3 on quadratic ones; tri3 3,
    /// tri6 7 points.
    pub fn gauss_contact_rule(&self) -> &Rule {
        &self.gauss_contact
    }

    /// Points at the nodes, in their order, with the integrals of the shape functions as weights (a
    /// Lobatto rule if there is one). `None` if a weight would not be positive (tri6, quad8, tet10,
    /// hex20).
    pub fn nodal_rule(&self) -> Option<&Rule> {
        self.nodal.as_ref()
    }

    /// A rule exact to `degree`, for error norms and data of high degree.
    pub fn rule(&self, degree: usize) -> Rule {
        rule(layout(self.kind).family, self.dim, degree)
    }

    /// Shape functions and gradients at the points of `rule`.
    pub fn tabulate(&self, rule: &Rule) -> ShapeTable {
        let nodes = self.functions.len();
        let mut n = vec![0.0; rule.len() * nodes];
        let mut dn = vec![0.0; rule.len() * nodes * self.dim];
        for (q, xi) in rule.points.iter().enumerate() {
            self.shape(xi, &mut n[q * nodes..(q + 1) * nodes]);
            self.gradient(xi, &mut dn[q * nodes * self.dim..(q + 1) * nodes * self.dim]);
        }
        ShapeTable { nodes, points: rule.len(), dim: self.dim, n, dn, weights: rule.weights.clone() }
    }
}

fn rule(family: Family, dim: usize, degree: usize) -> Rule {
    match family {
        Family::Simplex(_) => Rule::simplex(dim, degree),
        Family::Wedge => Rule::wedge(degree),
        Family::Pyramid => Rule::pyramid(degree),
        Family::Lagrange(_) | Family::Serendipity => Rule::tensor(dim, degree),
    }
}

fn nodal(functions: &[Product], nodes: &[[f64; 3]], exact: &Rule, degree: usize) -> Option<Rule> {
    let integral = |function: &Product| {
        exact
            .points
            .iter()
            .zip(&exact.weights)
            .map(|(point, weight)| weight * function.value(point))
            .sum::<f64>()
    };
    let weights: Vec<f64> = functions.iter().map(integral).collect();
    let positive = weights.iter().all(|&weight| weight > 1e-12);
    positive.then(|| Rule { points: nodes.to_vec(), weights, degree })
}

#[cfg(test)]
mod tests;
