//! Summary of a contact zone for the report of a step. Summaries can be merged over facets,
//! contacts and ranks.

use std::ops::AddAssign;

use super::point::{PointState, Status};
use crate::tensor::Vector;

/// Sums and extremes over the closed points of a zone. Forces act on the contactor, per metre of
/// depth in 2D.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZoneSummary<const D: usize> {
    /// Closed points.
    pub points: usize,
    /// Closed points that do more than touch.
    pub pressing: usize,
    /// Sticking points.
    pub stick: usize,
    /// Slipping points.
    pub slip: usize,
    /// Resultant `sum A t` \[N\].
    pub force: Vector<D>,
    /// `sum A t_n` \[N\].
    pub normal_force: f64,
    /// `sum A t_T` \[N\].
    pub friction_force: Vector<D>,
    /// `sum A t_T` along the tangents, see [`PointState::along`] \[N\].
    pub tangential_force: f64,
    /// Area of the closed points \[m, m^2\].
    pub area: f64,
    /// Largest `-g` \[m\], >= 0.
    pub max_penetration: f64,
    /// Largest `t_n` \[Pa\].
    pub max_pressure: f64,
    /// Largest known depth below the target, also between the points \[m\], >= 0.
    pub sunk: f64,
    /// `-sum A t_T . v_T` \[W\].
    pub friction_power: f64,
}

impl<const D: usize> Default for ZoneSummary<D> {
    fn default() -> Self {
        Self {
            points: 0,
            pressing: 0,
            stick: 0,
            slip: 0,
            force: Vector::zeros(),
            normal_force: 0.0,
            friction_force: Vector::zeros(),
            tangential_force: 0.0,
            area: 0.0,
            max_penetration: 0.0,
            max_pressure: 0.0,
            sunk: 0.0,
            friction_power: 0.0,
        }
    }
}

impl<const D: usize> ZoneSummary<D> {
    /// Adds the forces of a point. Open points add nothing. Call it for the points of this rank.
    pub fn add_forces(&mut self, point: &PointState<D>) {
        self.sunk = self.sunk.max(point.sunk);
        if !point.is_closed() {
            return;
        }
        let pressure = point.normal * (point.normal_traction * point.flatness);
        self.force += (pressure + point.friction_traction) * point.area;
        self.normal_force += point.normal_traction * point.area;
        self.friction_force += point.friction_traction * point.area;
        self.tangential_force += point.along(&point.friction_traction) * point.area;
        self.area += point.area;
        self.max_penetration = self.max_penetration.max(-point.gap);
        self.max_pressure = self.max_pressure.max(point.normal_traction);
        self.friction_power += point.friction_power() * point.area;
    }

    /// Counts a point.
    pub fn count(&mut self, point: &PointState<D>) {
        match point.status {
            Status::Open => return,
            Status::Stick => self.stick += 1,
            Status::Slip => self.slip += 1,
        }
        self.points += 1;
        self.pressing += usize::from(point.presses);
    }
}

impl<const D: usize> AddAssign for ZoneSummary<D> {
    fn add_assign(&mut self, other: Self) {
        self.points += other.points;
        self.pressing += other.pressing;
        self.stick += other.stick;
        self.slip += other.slip;
        self.force += other.force;
        self.normal_force += other.normal_force;
        self.friction_force += other.friction_force;
        self.tangential_force += other.tangential_force;
        self.area += other.area;
        self.max_penetration = self.max_penetration.max(other.max_penetration);
        self.max_pressure = self.max_pressure.max(other.max_pressure);
        self.sunk = self.sunk.max(other.sunk);
        self.friction_power += other.friction_power;
    }
}
