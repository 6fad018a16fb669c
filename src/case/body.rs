//! `bodies`: deformable bodies, their meshes and materials.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::damping::Damping;
use super::region::Region;
use super::sets::BodySet;
use super::viscoelasticity::Viscoelasticity;
use crate::material::Material;
use crate::reader::at::{At, Named};
use crate::reader::complaint::Complaint;
use crate::reader::function::{VaryingLength, VaryingVelocity};
use crate::reader::quantity::{Density, Length};
use crate::reader::tagged::tagged;

/// A deformable body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Mesh: a box, or a mesh file or a region of it.
    pub mesh: Mesh,
    /// Further sets by name, selected by the reference position; `body.set` names them, as it names
    /// the sets of the mesh.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    pub sets: Named<BodySet>,
    /// Hyperelastic law and its parameters; in a body with regions, of all elements in no region.
    pub material: Material,
    /// Relaxation of the isochoric stress; none if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub viscoelasticity: Option<At<Viscoelasticity>>,
    /// Reference density [kg/m3], >= 0. Required in dynamics and with gravity. A body without mass
    /// has no inertia and follows its supports, loads and contacts instantaneously.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density: Option<Density>,
    /// finite: Green strain, current contact; linear: small strain.
    #[serde(default)]
    pub kinematics: Kinematics,
    /// Treatment of volumetric locking: full integration is too stiff for nearly incompressible
    /// solids.
    #[serde(default)]
    pub locking: At<Locking>,
    /// Mass matrix.
    #[serde(default)]
    pub mass: Mass,
    /// Damping; none if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping: Option<At<Damping>>,
    /// Materials of sets of elements, each under the name of the set.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    pub regions: Named<Region>,
    /// Initial velocity \[m/s\], one entry per direction, expressions in x, y, z; zero if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub initial_velocity: Option<At<Vec<VaryingVelocity>>>,
}

impl Body {
    /// Whether its density is zero, also in all regions.
    pub fn is_massless(&self) -> bool {
        let zero = |density: Option<Density>| density.is_some_and(|density| density.value == 0.0);
        zero(self.density)
            && self.regions.values().all(|region| region.density.is_none() || zero(region.density))
    }
}

/// Where a body's mesh comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "MeshKeys", into = "MeshKeys")]
pub enum Mesh {
    /// Built in.
    Box(Box<BoxMesh>),
    /// Read from a Gmsh file.
    File(FileMesh),
}

/// A box of equal cells; its facets are left, right (x), bottom, top (y in 2D, z in 3D), front, back (y in 3D).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxMesh {
    /// Corner of smallest coordinates \[m\].
    pub min: At<Vec<Length>>,
    /// Corner of largest coordinates \[m\].
    pub max: At<Vec<Length>>,
    /// Number of cells in each direction, each >= 1. A cell is one quadrilateral or hexahedron, or
    /// several simplices that fill it.
    pub cells: At<Vec<u32>>,
    /// Element; quad4 in 2D and hex8 in 3D if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub element: Option<At<Element>>,
    /// New positions of the points of the box, for curved and graded bodies.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub map: Option<BoxMap>,
    /// Treatment of nodes that the map moves to the same position, such as the ends of a ring.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub merge: Option<At<Merge>>,
}

/// Treatment of coincident nodes of a body that no element joins. If absent, such a mesh is
/// refused.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Merge")]
pub enum Merge {
    /// Nodes up to this distance \[m\] are merged, > 0.
    Tolerance(Length),
    /// Parts that touch are separate on purpose, such as the faces of a crack; their nodes need not
    /// match.
    Never,
}
tagged!(Merge, "way to merge nodes");

/// New coordinates as functions of the coordinates x, y, z in the box; coordinates that are not
/// given stay unchanged.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxMap {
    /// New x \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub x: Option<VaryingLength>,
    /// New y \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub y: Option<VaryingLength>,
    /// New z \[m\], in 3D.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub z: Option<VaryingLength>,
}

impl BoxMap {
    /// The functions in the order of the axes.
    pub fn functions(&self) -> [Option<&VaryingLength>; 3] {
        [self.x.as_ref(), self.y.as_ref(), self.z.as_ref()]
    }
}

/// A mesh file, or a region of it.
#[derive(Debug, Clone, PartialEq)]
pub struct FileMesh {
    /// Path, relative to the case file.
    pub file: At<String>,
    /// Physical group or element set of the body; the whole mesh if absent.
    pub region: Option<At<String>>,
    /// Treatment of coincident nodes.
    pub merge: Option<At<Merge>>,
}

/// Mesh: `{ box: {...} }` or `{ file: block.msh, region: rubber }`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct MeshKeys {
    /// A built-in box of equal cells.
    #[serde(default, rename = "box", skip_serializing_if = "Option::is_none")]
    cuboid: Option<BoxMesh>,
    /// Mesh file, relative to the case file: an input file of Abaqus or CalculiX if its name ends in
    /// `.inp`, a Gmsh file (MSH 2.2 or 4.1) otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    file: Option<At<String>>,
    /// Physical group or element set of the file that forms the body; the whole mesh if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    region: Option<At<String>>,
    /// Treatment of coincident nodes of the file that no element joins, as Gmsh writes them without
    /// `Coherence`. `{ tolerance: 1e-9 }` merges nodes within a distance \[m\]. `never` declares
    /// that the parts are separate on purpose, such as the faces of a crack. If absent, such a mesh
    /// is refused.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    merge: Option<At<Merge>>,
}

impl TryFrom<MeshKeys> for Mesh {
    type Error = Complaint;
    fn try_from(keys: MeshKeys) -> Result<Self, Complaint> {
        let wrong = |message: &str, place| Err(Complaint::new(message.into()).at(place));
        let merge = keys.merge;
        if let (Some(merge), None) = (&merge, &keys.file) {
            return wrong("'merge' belongs to a mesh file; for a box it is a key of 'box'", merge.place);
        }
        match (keys.cuboid, keys.file, keys.region) {
            (Some(_), Some(file), _) => wrong("a mesh is a box or a file, not both", file.place),
            (Some(_), None, Some(region)) => {
                wrong("'region' belongs to a mesh file, not to a box", region.place)
            }
            (Some(cuboid), None, None) => Ok(Self::Box(Box::new(cuboid))),
            (None, Some(file), region) => Ok(Self::File(FileMesh { file, region, merge })),
            (None, None, _) => Err(Complaint::new("a mesh needs 'box' or 'file'".into()).hint(
                "for example { file: block.msh, region: rubber } or { box: { min: [0, 0], max: [1, 1], \
                 cells: [8, 8] } }",
            )),
        }
    }
}

impl From<Mesh> for MeshKeys {
    fn from(mesh: Mesh) -> Self {
        match mesh {
            Mesh::Box(cuboid) => Self { cuboid: Some(*cuboid), ..Self::default() },
            Mesh::File(FileMesh { file, region, merge }) => {
                Self { file: Some(file), region, merge, cuboid: None }
            }
        }
    }
}

impl JsonSchema for Mesh {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Mesh".into()
    }
    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        MeshKeys::json_schema(generator)
    }
}

/// Finite elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Element")]
#[expect(missing_docs, reason = "the names say all")]
pub enum Element {
    Tri3,
    Tri6,
    Quad4,
    Quad8,
    Quad9,
    Tet4,
    Tet10,
    Hex8,
    Hex20,
    Hex27,
    Wedge6,
    Pyramid5,
}
tagged!(Element, "element");

impl Element {
    /// The name in the case file, `quad4`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tri3 => "tri3",
            Self::Tri6 => "tri6",
            Self::Quad4 => "quad4",
            Self::Quad8 => "quad8",
            Self::Quad9 => "quad9",
            Self::Tet4 => "tet4",
            Self::Tet10 => "tet10",
            Self::Hex8 => "hex8",
            Self::Hex20 => "hex20",
            Self::Hex27 => "hex27",
            Self::Wedge6 => "wedge6",
            Self::Pyramid5 => "pyramid5",
        }
    }

    /// 2 or 3.
    pub fn dimension(self) -> usize {
        match self {
            Self::Tri3 | Self::Tri6 | Self::Quad4 | Self::Quad8 | Self::Quad9 => 2,
            Self::Tet4
            | Self::Tet10
            | Self::Hex8
            | Self::Hex20
            | Self::Hex27
            | Self::Wedge6
            | Self::Pyramid5 => 3,
        }
    }

    /// Whether a treatment of locking applies.
    pub fn offers(self, cure: Locking) -> bool {
        match cure {
            Locking::Auto | Locking::None | Locking::MeanDilatation | Locking::PatchDilatation => true,
            Locking::SelectiveReduced => !matches!(
                self,
                Self::Tri3 | Self::Tri6 | Self::Tet4 | Self::Tet10 | Self::Wedge6 | Self::Pyramid5
            ),
        }
    }
}

/// Measure of strain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Kinematics")]
pub enum Kinematics {
    /// Green strain, finite rotations.
    #[default]
    Finite,
    /// Small strain and small rotation.
    Linear,
}
tagged!(Kinematics, "kinematics");

/// State across the plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Plane")]
pub enum PlaneAssumption {
    /// Plane strain: the thickness does not change, as in a long body.
    #[default]
    Strain,
    /// Plane stress: no stress across the plane, as in a thin plate. The thickness changes, and forces are
    /// per unit of the thickness before the deformation.
    Stress,
}
tagged!(PlaneAssumption, "state across the plane");

/// Treatment of volumetric locking.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Locking")]
pub enum Locking {
    /// If Poisson's ratio is at least 0.45: `selective_reduced` on quadrilaterals and hexahedra,
    /// `mean_dilatation` on tri3, tet4, wedge6 and pyramid5. Otherwise `none`, also on tri6 and tet10;
    /// `none` under plane stress, where the thickness is free.
    #[default]
    Auto,
    /// Full integration.
    None,
    /// Integration of the lambda terms with one point less in each direction, of the mu terms at
    /// all points; for quadrilaterals and hexahedra.
    SelectiveReduced,
    /// Mixed formulation: the volumetric energy at the mean dilatation of each element, or at its best
    /// linear fit, with a discontinuous pressure that is condensed. On tri3, tet4, wedge6 and pyramid5
    /// it is `patch_dilatation`. For all elements, up to a Poisson's ratio of 0.4999.
    MeanDilatation,
    /// Mixed formulation whose pressures do not alternate from element to element: one for each patch of
    /// a few elements, such as two quad4, three hex8 or eleven tet4. On tri6, quad8, quad9 and hex27 it is
    /// `mean_dilatation`.
    PatchDilatation,
}
tagged!(Locking, "cure for locking");

impl Locking {
    /// The name in the case file, `mean_dilatation`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::None => "none",
            Self::SelectiveReduced => "selective_reduced",
            Self::MeanDilatation => "mean_dilatation",
            Self::PatchDilatation => "patch_dilatation",
        }
    }

    /// What to do if an element does not support this treatment.
    pub const CURE: &'static str =
        "remove `locking`, or write mean_dilatation: selective_reduced is for quadrilaterals and hexahedra";
}

/// Mass matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", rename_all = "snake_case")]
#[schemars(rename = "Mass")]
pub enum Mass {
    /// Redistributed if `accuracy` controls time and penetration in dynamics, or time with the
    /// conserving scheme on obstacles, and if the body has enough layers of elements to make its
    /// contact surfaces massless. With mass they would oscillate on a stiff penalty. Otherwise
    /// consistent.
    #[default]
    Auto,
    /// Integral of rho N_a N_b.
    Consistent,
    /// Diagonal matrix with the same total mass.
    Lumped,
    /// For impact: nodes of contact surfaces are massless, so that contact forces do not oscillate.
    /// Preserves mass, centre of mass and, as far as possible, inertia.
    Redistributed,
}
tagged!(Mass, "mass matrix");
