//! How well places are known: coordinates are rounded, and elements and depths of contact are differences of them.

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::system::ContactSystem;

/// What coordinates are compared with.
#[derive(Debug, Clone, PartialEq)]
pub struct Precision {
    /// Largest coordinate \[m\].
    pub farthest: f64,
    /// Distance between neighbouring numbers there \[m\].
    pub spacing: f64,
    /// Shortest distance between two corners of an element \[m\].
    pub edge: f64,
    /// Name of each contact, and its depth at a high pressure, a tenth of the softer modulus \[m\].
    pub depths: Vec<(String, f64)>,
    /// The unit of these lengths.
    pub unit: String,
}

impl<const D: usize> ContactSystem<D> {
    /// How well the places of this system are known. Collective.
    pub fn precision(&self) -> Precision {
        let mesh = &self.local.mesh;
        let edge = |element: usize| {
            let corners = &mesh.element_nodes(element)[..mesh.kinds[element].corners()];
            let pairs =
                corners.iter().enumerate().flat_map(|(k, a)| corners[k + 1..].iter().map(move |b| (a, b)));
            let square = |(a, b): (&u32, &u32)| -> f64 {
                let [a, b] = [a, b].map(|&node| mesh.points[node as usize]);
                (0..D).map(|k| (a[k] - b[k]).powi(2)).sum()
            };
            pairs.map(square).fold(f64::INFINITY, f64::min)
        };
        let own = (0..mesh.element_count()).map(edge).fold(f64::INFINITY, f64::min);
        let mut shortest = 0.0_f64;
        self.session.world().all_reduce_into(&own, &mut shortest, SystemOperation::min());
        let depth = |contact: &super::contact::Contact<D>| {
            let modulus = contact.beneath * contact.facet_size;
            (contact.name.clone(), contact.law().normal.penetration(0.1 * modulus))
        };
        Precision {
            farthest: self.extent,
            spacing: f64::EPSILON * self.extent,
            edge: shortest.sqrt(),
            depths: self.contacts.iter().map(depth).collect(),
            unit: self.units.of("m"),
        }
    }
}
