//! Kinematics of an element: how far it may deform, how it is kept from locking, and gradients on it.

use crate::error::{Error, Result};
use crate::lanes::Real;
use crate::mesh::ElementKind;
use crate::square::{Row, Square, apply, cofactor, dot, scale};

/// How strain is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Kinematics {
    /// Green's strain, total Lagrangian: any rotation, any strain.
    #[default]
    Finite,
    /// The symmetric gradient on the reference geometry: Hooke's law whatever the material, no `K_S`.
    Linear,
}

/// Cure for locking at small compressibility.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Locking {
    /// Full integration of everything.
    #[default]
    None,
    /// Terms with `mu` by the full rule, terms with `lambda` by one less in each direction. Variational, so the tangent
    /// stays symmetric.
    ///
    /// On quad4 and hex8 the one value is taken at the mean of the gradient over the element. On every quad4 and on hex8
    /// with parallel sides that is the value at the centroid; on other hex8 the centroid would fail the patch test.
    SelectiveReduced,
}

impl Locking {
    /// Name and sentence of each, for lists and hints.
    pub const ALL: [(Self, &'static str, &'static str); 2] = [
        (Self::None, "none", "full integration"),
        (
            Self::SelectiveReduced,
            "selective_reduced",
            "shear terms fully integrated, volume terms by one point less in each direction (quads and hexes)",
        ),
    ];

    /// The name in case files.
    pub fn name(self) -> &'static str {
        Self::ALL[self as usize].1
    }

    /// The points that integrate the volume terms of `kind`; an error where this cure does not exist on `kind`.
    pub(super) fn volume_rule(self, kind: ElementKind) -> Result<VolumeRule> {
        match (self, kind) {
            (Self::None, _) => Ok(VolumeRule::Full),
            (Self::SelectiveReduced, ElementKind::Quad4 | ElementKind::Hex8) => Ok(VolumeRule::Mean),
            (Self::SelectiveReduced, ElementKind::Quad8 | ElementKind::Quad9) => {
                Ok(VolumeRule::Of(ElementKind::Quad4))
            }
            (Self::SelectiveReduced, ElementKind::Hex20 | ElementKind::Hex27) => {
                Ok(VolumeRule::Of(ElementKind::Hex8))
            }
            (Self::SelectiveReduced, _) => {
                let cure = "use locking: none, or quads and hexes";
                Err(Error::case(format!("locking: {} does not exist for {kind}", self.name())).hint(cure))
            }
        }
    }

    /// Whether elements of `kind` offer this cure.
    pub fn offered(self, kind: ElementKind) -> bool {
        self.volume_rule(kind).is_ok()
    }
}

/// Which points integrate the volume terms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum VolumeRule {
    /// The element's full rule, together with the shear terms.
    Full,
    /// One value, at the mean gradient.
    Mean,
    /// The full rule of the linear sibling.
    Of(ElementKind),
}

/// Reference gradients `dN_a / dX` [1/m] into `gradients` and `det(dX / dxi)` [m^D], from node positions and the gradients
/// `dn[a * D + k]` in reference coordinates.
#[inline(always)]
pub(super) fn reference_gradients<T: Real, const D: usize>(
    points: &[Row<T, D>],
    dn: &[f64],
    gradients: &mut [Row<T, D>],
) -> T {
    let unit = points[0][0];
    let (dn, _) = dn.as_chunks::<D>();
    let mut jacobian = [[unit.constant(0.0); D]; D];
    for (point, dn) in points.iter().zip(dn) {
        for k in 0..D {
            let slope = unit.constant(dn[k]);
            for i in 0..D {
                jacobian[i][k] = point[i].mul_add(slope, jacobian[i][k]);
            }
        }
    }
    let mut map = cofactor(&jacobian);
    let det = dot(&jacobian[0], &map[0]);
    let inverse = det.recip();
    for row in &mut map {
        *row = scale(row, inverse);
    }
    for (gradient, dn) in gradients.iter_mut().zip(dn) {
        let mut slopes = [unit; D];
        for k in 0..D {
            slopes[k] = unit.constant(dn[k]);
        }
        *gradient = apply(&map, &slopes);
    }
    det
}

/// `H = sum_a u_a (x) dN_a/dX`, dimensionless; row = component, column = reference direction.
#[inline(always)]
pub(super) fn displacement_gradient<T: Real, const D: usize>(
    displacements: &[Row<T, D>],
    gradients: &[Row<T, D>],
) -> Square<T, D> {
    let mut grad_u = [[displacements[0][0].constant(0.0); D]; D];
    for (u, gradient) in displacements.iter().zip(gradients) {
        for i in 0..D {
            for k in 0..D {
                grad_u[i][k] = u[i].mul_add(gradient[k], grad_u[i][k]);
            }
        }
    }
    grad_u
}
