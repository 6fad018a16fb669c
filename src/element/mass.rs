//! Consistent and lumped mass.

use super::group::ElementGroup;
use super::kinematics::reference_gradients;
use crate::space::reference;

impl<const D: usize> ElementGroup<D> {
    /// Consistent mass of each element, `m_ab = int rho N_a N_b dV` \[kg\], passed to
    /// `receive(index, m)` with `m[a * N + b]`. It acts on each component in the same way.
    pub fn mass(&self, mut receive: impl FnMut(usize, &[f64])) {
        let element = reference(self.kind);
        let table = element.tabulate(element.mass_rule());
        let n = table.nodes;
        let size = table.nodes * D;
        let mut points = Vec::new();
        let mut gradients = vec![[0.0; D]; n];
        let mut mass = vec![0.0; n * n];
        for index in 0..self.elements.len() {
            self.points_of(index, &mut points);
            mass.fill(0.0);
            for q in 0..table.points {
                let det = reference_gradients(&points, &table.dn[q * size..(q + 1) * size], &mut gradients);
                let shape = &table.n[q * n..(q + 1) * n];
                let depth = self.depth_at(&points, shape);
                let weight = self.formulation.density * det * table.weights[q] * depth;
                for (row, n_a) in mass.chunks_exact_mut(n).zip(shape) {
                    for (entry, n_b) in row.iter_mut().zip(shape) {
                        *entry += weight * (n_a * n_b);
                    }
                }
            }
            receive(index, &mass);
        }
    }

    /// Lumped mass of each element (3.17), `receive(index, m)` with `m[a]` \[kg\].
    ///
    /// The diagonal of the consistent mass is scaled to the element's mass (Hinton, Rock,
    /// Zienkiewicz 1976). It is positive for every kind, unlike row sums, which are negative at the
    /// corners of quad8, hex20 and tet10.
    pub fn lumped_mass(&self, mut receive: impl FnMut(usize, &[f64])) {
        let n = self.kind.nodes();
        let mut lumped = vec![0.0; n];
        self.mass(|index, mass| {
            let total: f64 = mass.iter().sum();
            let diagonal: f64 = (0..n).map(|a| mass[a * n + a]).sum();
            let factor = if diagonal > 0.0 { total / diagonal } else { 0.0 };
            for (a, lumped) in lumped.iter_mut().enumerate() {
                *lumped = factor * mass[a * n + a];
            }
            receive(index, &lumped);
        });
    }
}
