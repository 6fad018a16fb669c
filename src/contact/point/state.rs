//! State of a contact point, which is reported, compared between iterates and frozen.

use super::Slopes;
use crate::tensor::Vector;

/// Open, or closed and stuck or slipping. A frictionless closed point slips.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub enum Status {
    /// No contact.
    #[default]
    Open,
    /// Closed, on the stick branch of the regularised law.
    Stick,
    /// Closed, on the slip branch.
    Slip,
}

/// State of a contact point in one iterate, which is reported, compared and frozen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointState<const D: usize> {
    /// `g_n` \[m\], > 0 open.
    pub gap: f64,
    /// `n`, unit, outward from the target.
    pub normal: Vector<D>,
    /// `t_n >= 0`, pressure on the contactor \[Pa\].
    pub normal_traction: f64,
    /// `t_T` on the contactor \[Pa\].
    pub friction_traction: Vector<D>,
    /// Part of the pressure that is damping \[Pa\]; negative while the gap opens.
    pub normal_damping: f64,
    /// Traction of damping along the surface, on the contactor \[Pa\], beside `friction_traction`.
    pub viscous_traction: Vector<D>,
    /// Heat of damping in the step per area \[J/m^2\].
    pub damping_work: f64,
    /// `b` \[Pa\], bound of `|t_T|`.
    pub bound: f64,
    /// `v_T` \[m/s\].
    pub slip_velocity: Vector<D>,
    /// `P d`, slip since the start of the step \[m\].
    pub slip_increment: Vector<D>,
    /// Open, stick or slip. A point that touches up to rounding is closed.
    pub status: Status,
    /// The point penetrates by more than the rounding error of its position. The force of any other
    /// closed point is zero or rounding error.
    pub presses: bool,
    /// `A` \[m, m^2\].
    pub area: f64,
    /// Length of the mean of the unit normals over the area: 1 on a flat surface. Multiplied by
    /// area and pressure it gives the magnitude of the resultant.
    pub flatness: f64,
    /// Largest depth below the target in the facets around a vertex \[m\], at least 0.
    pub sunk: f64,
    /// `w(g)` \[J/m^2\]. Multiplied by the reference area it is the energy stored by the normal
    /// law.
    pub potential: f64,
    /// Elastic slip `e` of the return map \[m\], tangential: the part of the slip that unloading gives
    /// back. Zero in the velocity form.
    pub elastic_slip: Vector<D>,
    /// `t_T` carried back to the start of the step by the inverse of the rotation that carries the
    /// multiplier of friction forward \[Pa\]; zero if friction is not augmented.
    pub traction_at_start: Vector<D>,
    /// Energy stored in elastic stick \[J/m^2\]; zero in the velocity form.
    pub recoverable: f64,
    /// Frictional heat of the step by the return map \[J/m^2\]. It is zero in the velocity form,
    /// whose power is [`friction_power`](Self::friction_power).
    pub plastic_work: f64,
    /// Stick is elastic, and the frictional heat of the step is `plastic_work`.
    pub sticks_elastically: bool,
    /// The tractions acted over the step, and `plastic_work` is the total heat of the step.
    pub over_step: bool,
    /// The friction traction is that of the stick branch beyond the bound.
    pub is_beyond_bound: bool,
}

impl<const D: usize> Default for PointState<D> {
    fn default() -> Self {
        Self {
            gap: f64::INFINITY,
            normal: Vector::zeros(),
            normal_traction: 0.0,
            friction_traction: Vector::zeros(),
            normal_damping: 0.0,
            viscous_traction: Vector::zeros(),
            damping_work: 0.0,
            bound: 0.0,
            slip_velocity: Vector::zeros(),
            slip_increment: Vector::zeros(),
            status: Status::Open,
            presses: false,
            area: 0.0,
            flatness: 1.0,
            sunk: 0.0,
            potential: 0.0,
            elastic_slip: Vector::zeros(),
            traction_at_start: Vector::zeros(),
            recoverable: 0.0,
            plastic_work: 0.0,
            sticks_elastically: false,
            over_step: false,
            is_beyond_bound: false,
        }
    }
}

impl<const D: usize> PointState<D> {
    /// `-t_T . v_T` per area \[W/m^2\]: power that friction dissipates, >= 0 in the velocity form.
    pub fn friction_power(&self) -> f64 {
        -self.friction_traction.dot(&self.slip_velocity)
    }

    /// A tangential vector as one number. In the plane it is the component along the tangent, which
    /// is the normal rotated clockwise by a right angle. In space it is the length.
    pub fn along(&self, vector: &Vector<D>) -> f64 {
        let n = &self.normal;
        if D == 2 { vector[0] * n[1] - vector[1] * n[0] } else { vector.norm() }
    }

    /// Whether the point is closed.
    pub fn is_closed(&self) -> bool {
        self.status != Status::Open
    }

    /// Friction and damping along the surface \[Pa\], on the contactor.
    pub fn tangential_traction(&self) -> Vector<D> {
        self.friction_traction + self.viscous_traction
    }

    /// Traction along the surface under which the geometry changes \[Pa\]. A correction from the stick
    /// branch beyond the bound leads to a state of almost no slip, whose traction is below the bound.
    pub fn carried_traction(&self) -> Vector<D> {
        if self.is_beyond_bound { self.viscous_traction } else { self.tangential_traction() }
    }

    /// Traction of damping, along the normal and along the surface \[Pa\], on the contactor.
    pub fn damping_traction(&self) -> Vector<D> {
        self.normal * self.normal_damping + self.viscous_traction
    }

    /// The state with the tractions of the tangent of the law at a gap larger by `change` \[m\].
    #[must_use]
    pub(in crate::contact) fn extrapolated(&self, slopes: Option<&Slopes<D>>, change: f64) -> Self {
        let Some(slopes) = slopes else { return *self };
        Self {
            normal_traction: self.normal_traction + slopes.normal * change,
            friction_traction: self.friction_traction + slopes.by_gap * change,
            ..*self
        }
    }

    /// The state without tractions, as at a closed point that merely touches.
    #[must_use]
    pub(in crate::contact) fn without_tractions(&self) -> Self {
        Self {
            normal_traction: 0.0,
            friction_traction: Vector::zeros(),
            viscous_traction: Vector::zeros(),
            ..*self
        }
    }

    /// `t = t_n n + t_T` \[Pa\], on the contactor.
    pub fn traction(&self) -> Vector<D> {
        self.normal * self.normal_traction + self.tangential_traction()
    }
}
