//! The terms of the linearised balance (3.5), each under its name, so that a solver can ask for any subset.

use bitflags::bitflags;

bitflags! {
    /// Contributions to the effective matrix. All are left-hand sides: minus the derivative of a force.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub struct Terms: u16 {
        /// `M`, inertia.
        const MASS = 1;
        /// `K_0 + K_NL`, material stiffness (linear and displacement-dependent part).
        const MATERIAL = 1 << 1;
        /// `K_S`, geometric stiffness.
        const GEOMETRIC = 1 << 2;
        /// `K_CN`, normal contact stiffness. Symmetric.
        const NORMAL_CONTACT = 1 << 3;
        /// The part of `K_CG` that the normal traction carries: the change of its direction and of the nodes that it acts on. Symmetric on obstacles.
        const NORMAL_GEOMETRY = 1 << 4;
        /// `K_T`, friction damping, and damping of contact along the surface. Symmetric.
        const FRICTION_DAMPING = 1 << 5;
        /// `K_nT`, friction-normal coupling, the change of the coefficient with pressure included. Non-symmetric.
        const FRICTION_NORMAL_COUPLING = 1 << 6;
        /// `C_mu`, the change of the coefficient with the slip speed (from `K_mu`).
        const COEFFICIENT_CHANGE = 1 << 7;
        /// The part of `K_CG` that the friction traction carries, and `K_TG`: change of the slip measure. Non-symmetric.
        const FRICTION_GEOMETRY = 1 << 8;
        /// `K_phi`, change of the contact area, what (2.16) stands for. Non-symmetric.
        const ZONE_CHANGE = 1 << 9;
        /// Change of a following load with the surface it acts on. Non-symmetric.
        const FOLLOWING_LOAD = 1 << 10;
        /// `C`, Rayleigh damping of the bodies, and dashpots. Symmetric.
        const DAMPING = 1 << 11;
        /// `K_s`, stiffness of foundations and springs. Symmetric.
        const SPRINGS = 1 << 12;
        /// Stiffness of ties between surfaces. Symmetric.
        const TIES = 1 << 13;
        /// `K_CD`, damping of contact along the normal. Symmetric on planes.
        const NORMAL_DAMPING = 1 << 14;
        /// What stage I of the two-stage scheme keeps (3.6): symmetric.
        const NORMAL_STAGE = Self::MASS.bits() | Self::DAMPING.bits() | Self::SPRINGS.bits() | Self::TIES.bits() | Self::MATERIAL.bits() | Self::GEOMETRIC.bits()
            | Self::NORMAL_CONTACT.bits() | Self::NORMAL_DAMPING.bits() | Self::NORMAL_GEOMETRY.bits() | Self::FRICTION_DAMPING.bits();
        /// What stage II keeps (3.7): symmetric, without the stiffness and the damping of contact along the normal.
        const FRICTION_STAGE = Self::NORMAL_STAGE.bits() & !(Self::NORMAL_CONTACT.bits() | Self::NORMAL_DAMPING.bits());
        /// What multigrid takes for the bodies: without their contacts and ties, and without `K_S`, which makes the matrix indefinite where
        /// an iterate far from balance has large stresses. Symmetric.
        const BODIES = Self::MASS.bits() | Self::DAMPING.bits() | Self::SPRINGS.bits() | Self::MATERIAL.bits();
        /// Everything: the consistent tangent of (3.5).
        const ALL = (1 << 15) - 1;
    }
}
