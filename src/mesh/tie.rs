//! Ties between surfaces: which nodes a vertex of a tied surface holds together.

/// The mean relative displacement of two tied surfaces around a vertex (theory, section 3.16).
///
/// With the weights `w_a` \[m^(D - 1)\] of its nodes and the area `A`, the displacements `u_a` give
/// the mean jump `sum_a w_a u_a / A` \[m\]. The weights add up to zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Tie {
    /// Number of the pair of surfaces, in the order of the case.
    pub pair: u32,
    /// Nodes: first those of the contactor, then those of the target.
    pub nodes: Vec<u32>,
    /// Weight of each node [m, m^2]: that of the contactor's nodes is `int Phi N_a`, that of the
    /// target's nodes `-int Phi M_b`.
    pub weights: Vec<f64>,
    /// Number of nodes of the contactor.
    pub contactor: u32,
    /// Tied area of the vertex in the reference configuration, `int Phi` [m, m^2].
    pub area: f64,
    /// Stiffness per reference area [Pa/m].
    pub stiffness: f64,
    /// Stiffness per area of an element beneath it, Young's modulus over size [Pa/m].
    pub element_stiffness: f64,
}
