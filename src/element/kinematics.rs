//! Kinematics of an element: strain measure, treatment of locking, and gradients (theory, section
//! 3.8).

use crate::error::{Error, Result};
use crate::lanes::Real;
use crate::material::Moduli;
use crate::mesh::ElementKind;
use crate::square::{Row, Square, apply, cofactor, dot, scale_all};

/// Strain measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Kinematics {
    /// Green's strain, total Lagrangian: any rotation, any strain.
    #[default]
    Finite,
    /// The symmetric gradient on the reference geometry: Hooke's law for any material, no `K_S`.
    Linear,
}

/// Treatment of locking for nearly incompressible materials.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Locking {
    /// For a Poisson's ratio of at least [`LOCKS`]: [`SelectiveReduced`](Self::SelectiveReduced) on
    /// elements that support it, [`MeanDilatation`](Self::MeanDilatation) on elements in patches.
    /// Otherwise [`None`](Self::None).
    #[default]
    Auto,
    /// Full integration of all terms.
    None,
    /// Terms with `mu` are integrated by the full rule, terms with `lambda` by a rule with one
    /// point less in each direction. The method is variational, so the tangent stays symmetric.
    /// Laws that are not written in `lambda` and `mu` are split so that their parts agree with
    /// these terms at small strain, see [`Part`](crate::material::Part).
    ///
    /// On quad4 and hex8 the single value is evaluated at the mean of the gradient over the
    /// element. On every quad4 and on hex8 with parallel sides this is the value at the centroid.
    /// On other hex8 the centroid would fail the patch test.
    SelectiveReduced,
    /// Volume terms at the projection of the dilatation on the constant or linear functions of each
    /// element (theory, section 3.8), which is a mixed formulation with a discontinuous pressure
    /// that is condensed. On tri3, tet4, wedge6 and pyramid5 it is
    /// [`PatchDilatation`](Self::PatchDilatation). The method is variational, so the tangent stays symmetric.
    MeanDilatation,
    /// Volume terms at the mean of the dilatation over patches of elements, with one pressure for each
    /// patch, which does not alternate. On tri6, quad8, quad9 and hex27, whose own pressures do not, it is
    /// [`MeanDilatation`](Self::MeanDilatation).
    PatchDilatation,
}

/// Poisson's ratio from which on full integration locks.
///
/// A pad of 12 by 6 quad4 pressed between a clamp and a plane is too stiff by 3 % at 0.45, by 12 %
/// at 0.49 and by 77 % at 0.499 (docs/validation/extremes.md). At 0.4 only the discretization error
/// of the mesh remains.
pub const LOCKS: f64 = 0.45;

/// Rounding error of a Poisson's ratio that is recomputed from moduli.
const ROUNDING: f64 = 1e-9;

impl Locking {
    /// Name and description of each, for lists and hints.
    pub const ALL: [(Self, &'static str, &'static str); 5] = [
        (
            Self::Auto,
            "auto",
            "at a Poisson's ratio of 0.45 or more selective_reduced on quads and hexes, mean_dilatation on tri3, \
             tet4, wedge6 and pyramid5; otherwise none",
        ),
        (Self::None, "none", "full integration"),
        (
            Self::SelectiveReduced,
            "selective_reduced",
            "full integration of shear terms, one point less in each direction for volume terms (quads and \
             hexes)",
        ),
        (
            Self::MeanDilatation,
            "mean_dilatation",
            "mixed formulation with a discontinuous pressure, which is condensed: constant or linear in each \
             element, on tri3, tet4, wedge6 and pyramid5 constant in patches of elements",
        ),
        (
            Self::PatchDilatation,
            "patch_dilatation",
            "mixed formulation with pressures that do not alternate: one for each patch of a few elements; \
             on tri6, quad8, quad9 and hex27 that of mean_dilatation",
        ),
    ];

    /// The name in case files.
    pub fn name(self) -> &'static str {
        Self::ALL[self as usize].1
    }

    /// The treatment of elements of `kind` with these moduli: never [`Auto`](Self::Auto).
    pub fn on(self, kind: ElementKind, moduli: &Moduli<f64>) -> Self {
        match self {
            Self::Auto if !locks(moduli) => Self::None,
            Self::Auto if Self::SelectiveReduced.offered(kind) => Self::SelectiveReduced,
            Self::Auto if Self::MeanDilatation.shares_pressure(kind) => Self::MeanDilatation,
            Self::Auto => Self::None,
            chosen => chosen,
        }
    }

    /// The points that integrate the volume terms of `kind`; an error if `kind` does not support
    /// this treatment.
    pub(super) fn volume_rule(self, kind: ElementKind) -> Result<VolumeRule> {
        match (self, kind) {
            (Self::Auto | Self::None, _) => Ok(VolumeRule::Full),
            (Self::SelectiveReduced, ElementKind::Quad4 | ElementKind::Hex8) => Ok(VolumeRule::Mean),
            (Self::SelectiveReduced, ElementKind::Quad8 | ElementKind::Quad9) => {
                Ok(VolumeRule::Of(ElementKind::Quad4))
            }
            (Self::SelectiveReduced, ElementKind::Hex20 | ElementKind::Hex27) => {
                Ok(VolumeRule::Of(ElementKind::Hex8))
            }
            (
                Self::MeanDilatation,
                ElementKind::Quad4
                | ElementKind::Quad8
                | ElementKind::Hex8
                | ElementKind::Hex20
                | ElementKind::Tri6
                | ElementKind::Tet10,
            ) => Ok(VolumeRule::Projected(DilatationSpace::Constant)),
            (Self::MeanDilatation, ElementKind::Quad9 | ElementKind::Hex27) => {
                Ok(VolumeRule::Projected(DilatationSpace::Linear))
            }
            (
                Self::MeanDilatation,
                ElementKind::Tri3 | ElementKind::Tet4 | ElementKind::Wedge6 | ElementKind::Pyramid5,
            )
            | (
                Self::PatchDilatation,
                ElementKind::Tri3
                | ElementKind::Quad4
                | ElementKind::Tet4
                | ElementKind::Tet10
                | ElementKind::Hex8
                | ElementKind::Hex20
                | ElementKind::Wedge6
                | ElementKind::Pyramid5,
            ) => Ok(VolumeRule::Patches),
            // Single elements of the other kinds have stable pressures.
            (Self::PatchDilatation, _) => Self::MeanDilatation.volume_rule(kind),
            (Self::MeanDilatation, ElementKind::Line2 | ElementKind::Line3) => {
                Err(Error::internal("a treatment of locking on facets"))
            }
            (Self::SelectiveReduced, _) => {
                let cure = "use locking: auto or mean_dilatation, or quads and hexes";
                Err(Error::case(format!("locking: {kind} does not support {}", self.name())).hint(cure))
            }
        }
    }

    /// The space of the dilatation of elements of `kind`; `None` if it is not projected.
    pub fn dilatation_space(self, kind: ElementKind) -> Option<DilatationSpace> {
        match self.volume_rule(kind) {
            Ok(VolumeRule::Projected(space)) => Some(space),
            _ => None,
        }
    }

    /// Whether elements of `kind` share a pressure with others of a patch.
    pub fn shares_pressure(self, kind: ElementKind) -> bool {
        matches!(self.volume_rule(kind), Ok(VolumeRule::Patches))
    }

    /// Whether elements of `kind` support this treatment.
    pub fn offered(self, kind: ElementKind) -> bool {
        self.volume_rule(kind).is_ok()
    }
}

/// Whether Poisson's ratio is so high that full integration locks.
pub fn locks(moduli: &Moduli<f64>) -> bool {
    moduli.lambda >= (LOCKS - ROUNDING) * 2.0 * (moduli.lambda + moduli.mu)
}

/// Functions per element on which the dilatation is projected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DilatationSpace {
    /// The constants.
    Constant,
    /// The linear functions of the reference position.
    Linear,
}

impl DilatationSpace {
    /// Number of functions in `dimension` dimensions.
    pub fn size(self, dimension: usize) -> usize {
        match self {
            Self::Constant => 1,
            Self::Linear => dimension + 1,
        }
    }
}

/// Points that integrate the volume terms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum VolumeRule {
    /// The element's full rule, together with the shear terms.
    Full,
    /// One value, at the mean gradient.
    Mean,
    /// The full rule of the linear element of the same shape.
    Of(ElementKind),
    /// The full rule, with a projected dilatation.
    Projected(DilatationSpace),
    /// The points of all elements of a patch, with their mean dilatation. The group has no volume terms.
    Patches,
}

/// `sum_a v_a (x) s_a`. With the slopes `dN_a/dxi` and node positions it is `dX/dxi` \[m\], with
/// gradients `dN_a/dX` and displacements the displacement gradient. Row = component of `v`, column
/// = component of `s`.
#[inline(always)]
pub(super) fn gradient_of<T: Real, const D: usize>(
    values: &[Row<T, D>],
    slopes: &[Row<T, D>],
) -> Square<T, D> {
    let mut sum = [[values[0][0].constant(0.0); D]; D];
    for (value, slope) in values.iter().zip(slopes) {
        for i in 0..D {
            for k in 0..D {
                sum[i][k] = value[i].mul_add(slope[k], sum[i][k]);
            }
        }
    }
    sum
}

/// `det(dX/dxi)` [m^D] and the map `(dX/dxi)^-T` [1/m] from `dN_a/dxi` to `dN_a/dX`.
#[inline(always)]
pub(super) fn reference_map<T: Real, const D: usize>(jacobian: &Square<T, D>) -> (T, Square<T, D>) {
    let cofactors = cofactor(jacobian);
    let det = dot(&jacobian[0], &cofactors[0]);
    (det, scale_all(&cofactors, det.recip()))
}

/// Reference gradients `dN_a/dX` [1/m] into `gradients`, and `det(dX/dxi)` [m^D], from node
/// positions and `dn[a * D + k]`.
pub fn reference_gradients<const D: usize>(
    points: &[[f64; D]],
    dn: &[f64],
    gradients: &mut [[f64; D]],
) -> f64 {
    let (slopes, _) = dn.as_chunks::<D>();
    let (det, map) = reference_map(&gradient_of(points, slopes));
    for (gradient, slope) in gradients.iter_mut().zip(slopes) {
        *gradient = apply(&map, slope);
    }
    det
}
