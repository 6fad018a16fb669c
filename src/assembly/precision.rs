//! Precision of positions. Coordinates are rounded, and element sizes and contact depths are
//! differences of coordinates.

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::system::ContactSystem;
use crate::dynamics::Stage;

/// Lengths with which coordinates are compared.
#[derive(Debug, Clone, PartialEq)]
pub struct Precision {
    /// Largest coordinate, or largest displacement if [`moved`](Self::moved) \[m\].
    pub farthest: f64,
    /// Whether bodies have moved to the largest coordinate. Otherwise they start there.
    pub moved: bool,
    /// Distance between adjacent floating-point numbers at `farthest` \[m\].
    pub spacing: f64,
    /// Shortest distance between two corners of an element \[m\].
    pub edge: f64,
    /// Name of each contact, and its depth at a high pressure (a tenth of the softer modulus)
    /// \[m\].
    pub depths: Vec<(String, f64)>,
    /// Unit of these lengths.
    pub unit: String,
}

impl Precision {
    /// Returns the precision of bodies that have moved as far as `farthest` \[m\], if that is
    /// farther than before.
    #[must_use]
    pub fn at(&self, farthest: f64) -> Self {
        if farthest <= self.farthest {
            return self.clone();
        }
        Self { farthest, moved: true, spacing: f64::EPSILON * farthest, ..self.clone() }
    }
}

/// Displacements that [`ContactSystem::farthest_motion`] covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motions {
    /// All displacements.
    All,
    /// Prescribed displacements.
    Prescribed,
}

impl<const D: usize> ContactSystem<D> {
    /// Largest component of a displacement, or of a displaced position, at the trial state \[m\].
    /// Collective.
    ///
    /// Strains are differences of displacements, gaps are differences of positions.
    pub fn farthest_motion(&self, stage: &Stage, motions: Motions) -> f64 {
        let u = stage.trial.u.owned();
        let places = self.local.mesh.points.as_flattened();
        let held = &self.supports.dofs.constrained;
        let wanted = u.iter().zip(places).zip(held.iter());
        let own = wanted
            .filter(|(_, held)| motions == Motions::All || **held)
            .map(|((u, x), _)| u.abs().max((x + u).abs()))
            .fold(0.0, f64::max);
        let mut most = 0.0_f64;
        self.session.world().all_reduce_into(&own, &mut most, SystemOperation::max());
        most
    }

    /// Precision of the positions of this system. Collective.
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
        let depth = |contact: &super::contact::LocalContact<D>| {
            let modulus = contact.beneath * contact.facet_size;
            (contact.name.clone(), contact.law().normal.penetration(0.1 * modulus))
        };
        Precision {
            farthest: self.extent,
            moved: false,
            spacing: f64::EPSILON * self.extent,
            edge: shortest.sqrt(),
            depths: self.contacts.iter().map(depth).collect(),
            unit: self.units.of("m"),
        }
    }
}
