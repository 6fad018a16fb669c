//! Values of contact points as means at nodes, weighted by area.

use super::contact::ContactPoint;
use crate::assembly::{ContactSystem, LocalContact};
use crate::contact::point::Status;
use crate::error::Result;
use crate::petsc::Vector;
use crate::tensor::Vector as Point;

/// Weight of a vertex that counts only where no other one does.
const ASIDE: f64 = 1e-100;

/// A value at the nodes of a contactor.
#[derive(Debug, Clone, Copy)]
pub enum NodalValue<const D: usize> {
    /// Mean of a number over the points.
    Mean(fn(&ContactPoint<D>) -> f64),
    /// Mean of a vector over the points.
    MeanVector(fn(&ContactPoint<D>) -> Point<D>),
    /// Status of most of the area.
    Status,
}

/// A value at one node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NodalMean<const D: usize> {
    /// A number.
    Number(f64),
    /// A vector.
    Vector(Point<D>),
    /// A status.
    Status(Status),
}

impl<const D: usize> NodalMean<D> {
    /// The value as numbers. A status is 0 for open, 1 for stick, 2 for slip.
    pub fn numbers(&self) -> Vec<f64> {
        match self {
            Self::Number(value) => vec![*value],
            Self::Vector(value) => value.iter().copied().collect(),
            Self::Status(status) => vec![f64::from(*status as u8)],
        }
    }

    /// The number; 0 for other values.
    pub fn number(&self) -> f64 {
        if let Self::Number(value) = self { *value } else { 0.0 }
    }
}

impl<const D: usize> NodalValue<D> {
    /// Normal traction \[Pa\].
    pub const PRESSURE: Self = Self::Mean(|point| point.state.normal_traction);

    /// Gap \[m\], at most the distance up to which gaps are known.
    pub const GAP: Self = Self::Mean(|point| point.state.gap.min(point.reach));

    /// Number of sums from which the value is computed.
    fn width(&self) -> usize {
        match self {
            Self::Mean(_) => 1,
            Self::MeanVector(_) => D,
            Self::Status => 2,
        }
    }

    fn sample(&self, point: &ContactPoint<D>, sample: &mut Vec<f64>) {
        let one_if = |holds: bool| f64::from(u8::from(holds));
        match self {
            Self::Mean(value) => sample.push(value(point)),
            Self::MeanVector(value) => sample.extend(value(point).iter()),
            Self::Status => {
                sample.extend([point.state.is_closed(), point.state.status == Status::Slip].map(one_if));
            }
        }
    }

    fn mean(&self, means: &[f64]) -> NodalMean<D> {
        match (self, means) {
            (Self::Status, &[closed, slips]) => NodalMean::Status(status(closed, slips)),
            (Self::MeanVector(_), means) => NodalMean::Vector(Point::from_fn(|i, _| means[i])),
            (_, means) => NodalMean::Number(means[0]),
        }
    }
}

/// Status of most of the area, from the fractions of the area that are closed and that slip.
///
/// A tie counts as closed and as slip, whatever the order of summation, which depends on the
/// partition.
fn status(closed: f64, slips: f64) -> Status {
    const TIE: f64 = 0.5 - 1e-9;
    match (closed < TIE, slips < TIE * closed) {
        (true, _) => Status::Open,
        (false, true) => Status::Stick,
        (false, false) => Status::Slip,
    }
}

/// Area-weighted sums of some values of a contact at local nodes.
pub struct NodalSums<const D: usize> {
    values: Vec<NodalValue<D>>,
    /// For each node, the area and then the sums of all values.
    sums: Vec<f64>,
    width: usize,
}

impl<const D: usize> NodalSums<D> {
    /// Gathers values of a contact at the local displacements `u` \[m\]. The sums are complete at
    /// owned nodes. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn gather(
        system: &ContactSystem<D>,
        contact: &LocalContact<D>,
        u: &[f64],
        values: Vec<NodalValue<D>>,
    ) -> Result<Self> {
        let index = &system.bodies().local().index;
        let width = 1 + values.iter().map(NodalValue::width).sum::<usize>();
        let mut all = Vector::ghosted(system.session(), index.owned, width, &index.ghosts)?;
        {
            let mut sums = all.local_mut();
            let mut sample = Vec::with_capacity(width);
            contact.nodal_shares(|vertex, node, share| {
                sample.clear();
                sample.push(1.0);
                let point = ContactPoint::new(contact, vertex, u);
                // The side of an edge that does not face the target does not dilute the pressure.
                let aside = contact.is_on_edge(vertex) && point.state.area == 0.0;
                let share = if aside { ASIDE * share } else { share };
                values.iter().for_each(|value| value.sample(&point, &mut sample));
                let row = &mut sums[node as usize * width..][..width];
                row.iter_mut().zip(&sample).for_each(|(sum, value)| *sum += share * value);
            });
        }
        all.add_ghosts_to_owners()?;
        let sums = all.local().to_vec();
        Ok(Self { values, sums, width })
    }

    /// Means at a node in the order of the values; `None` if the node is not on the surface.
    pub fn at(&self, node: u32) -> Option<Vec<NodalMean<D>>> {
        let (weight, sums) = self.sums[node as usize * self.width..][..self.width].split_first()?;
        if *weight <= 0.0 {
            return None;
        }
        let mut means = sums.iter().map(|sum| sum / weight);
        let own = |value: &NodalValue<D>| {
            let own: Vec<f64> = means.by_ref().take(value.width()).collect();
            value.mean(&own)
        };
        Some(self.values.iter().map(own).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tie counts as closed and as slip, on either side of rounding.
    #[test]
    fn ties_do_not_depend_on_rounding() {
        for rounding in [-1e-12, 0.0, 1e-12] {
            assert_eq!(status(0.5 + rounding, 0.25), Status::Slip);
            assert_eq!(status(0.6, 0.3 + rounding), Status::Slip);
        }
        assert_eq!(status(0.49, 0.49), Status::Open);
        assert_eq!(status(1.0, 0.49), Status::Stick);
    }
}
