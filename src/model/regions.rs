//! Bodies of several materials: the material of each element.

use std::rc::Rc;

use super::{Body, RayleighFactors};
use crate::case::Case;
use crate::element::Formulation;
use crate::error::Error;
use crate::material::{Moduli, PronySeries};
use crate::mesh::{Facet, Mesh, PlaneState};

/// Material of a body, or of one of its regions.
#[derive(Debug, Clone)]
pub struct BodyMaterial {
    /// Set of its elements, `body.set`; `None` for the first material of a body, which all elements
    /// outside of regions have.
    pub set: Option<String>,
    /// Material law, kinematics, locking treatment and density.
    pub formulation: Formulation,
    /// Rayleigh damping; `None` without damping.
    pub damping: Option<RayleighFactors>,
    /// Prony series of the deviator; `None` for an elastic material.
    pub series: Option<Rc<PronySeries>>,
    /// Young's modulus \[Pa\], the reference for penalties.
    pub young_modulus: f64,
}

impl BodyMaterial {
    /// Moduli at small strain against a sudden deformation, which waves meet.
    pub fn sudden_moduli(&self) -> Moduli<f64> {
        let given = self.formulation.moduli();
        let stiffer = self.series.as_ref().map_or(1.0, |series| series.relaxation(0.0));
        Moduli::of_shear_and_bulk(stiffer * given.mu, given.bulk())
    }

    /// Density times the square of the speed of pressure waves after a sudden deformation \[Pa\].
    pub fn wave_modulus(&self) -> f64 {
        let sudden = self.sudden_moduli();
        match self.formulation.plane {
            PlaneState::Strain | PlaneState::Axisymmetric => sudden.uniaxial_strain(),
            PlaneState::Stress => sudden.plane_stress().uniaxial_strain(),
        }
    }
}

/// The materials of the elements of a mesh.
#[derive(Debug, Clone)]
pub struct ElementMaterials {
    /// For each element, the index of its material among those of its body.
    within: Vec<u32>,
    /// Number of the first material of each body, counted over the bodies.
    first: Vec<u32>,
    /// Largest number of materials of a body.
    most: usize,
}

impl ElementMaterials {
    /// Those of the elements of this mesh.
    pub fn new<const D: usize>(bodies: &[Body], mesh: &Mesh<D>) -> Self {
        let counts = bodies.iter().map(|body| body.materials.len());
        let first = counts.clone().scan(0, |next, count| {
            let number = *next;
            *next += count as u32;
            Some(number)
        });
        Self {
            within: material_of_elements(bodies, mesh),
            first: first.collect(),
            most: counts.max().unwrap_or(1),
        }
    }

    /// For each element, the index of its material among those of its body.
    pub fn indices(&self) -> &[u32] {
        &self.within
    }

    /// Index of the material of an element among those of its body.
    pub fn within(&self, element: usize) -> usize {
        self.within[element] as usize
    }

    /// Number of the material of an element, counted over the bodies.
    pub fn of<const D: usize>(&self, mesh: &Mesh<D>, element: usize) -> usize {
        self.first[usize::from(mesh.body[element])] as usize + self.within(element)
    }

    /// Largest number of materials of a body.
    pub fn most(&self) -> usize {
        self.most
    }

    /// Whether a body has several materials.
    pub fn are_several(&self) -> bool {
        self.most > 1
    }
}

/// For each element, the index of its material among those of its body.
fn material_of_elements<const D: usize>(bodies: &[Body], mesh: &Mesh<D>) -> Vec<u32> {
    let mut materials = vec![0; mesh.element_count()];
    for (number, material) in bodies.iter().flat_map(|body| (0..).zip(&body.materials)) {
        let set = material.set.as_ref().and_then(|set| mesh.element_sets.get(set));
        set.into_iter().flatten().for_each(|&element| materials[element as usize] = number);
    }
    materials
}

/// Smallest Young's modulus of the elements beneath facets \[Pa\]; infinite without facets.
pub fn softest_beneath<const D: usize>(bodies: &[Body], mesh: &Mesh<D>, facets: &[Facet]) -> f64 {
    let is_uniform = bodies.iter().all(|body| body.materials.len() == 1);
    let materials = if is_uniform { Vec::new() } else { material_of_elements(bodies, mesh) };
    let modulus = |facet: &Facet| {
        let element = facet.element as usize;
        let material = materials.get(element).copied().unwrap_or_default();
        bodies[usize::from(mesh.body[element])].materials[material as usize].young_modulus
    };
    facets.iter().map(modulus).fold(f64::INFINITY, f64::min)
}

/// Errors for regions that are no set of elements, or have elements in common. Each error gives its
/// location in the case.
pub fn unsound_regions<const D: usize>(case: &Case, mesh: &Mesh<D>) -> Vec<Error> {
    let mut faults = Vec::new();
    for (body, its) in case.bodies.iter() {
        let mut known: Vec<(&str, &[u32])> = Vec::new();
        for (name, _) in its.regions.iter() {
            let set = format!("{}.{}", body.value, name.value);
            let Some(elements) = mesh.element_sets.get(&set) else {
                faults.push(missing(case, &body.value, name, mesh));
                continue;
            };
            for (other, before) in &known {
                let common = elements.iter().filter(|element| before.binary_search(element).is_ok()).count();
                if common > 0 {
                    let message = format!(
                        "the regions '{other}' and '{}' of '{}' have {common} elements in common",
                        name.value, body.value
                    );
                    let cure = "an element has one material: remove the common elements from one of the sets, \
                                for example with `difference` in `sets`";
                    faults.push(case.error(name.place, message).hint(cure));
                }
            }
            known.push((&name.value, elements));
        }
    }
    faults
}

/// The error of a region that is no set of elements.
fn missing<const D: usize>(case: &Case, body: &str, name: &crate::case::At<String>, mesh: &Mesh<D>) -> Error {
    let set = format!("{body}.{}", name.value);
    let other = if mesh.facet_sets.contains_key(&set) { Some("facets") } else { None };
    let other = other.or_else(|| mesh.point_sets.contains_key(&set).then_some("nodes"));
    if let Some(members) = other {
        let message = format!("expected a set of elements, but '{set}' is a set of {members}");
        return case.error(name.place, message).hint("in `sets`, write `of: elements`");
    }
    let of_body = |known: &&str| known.split_once('.').is_some_and(|(owner, _)| owner == body);
    let known = mesh.element_sets.keys().map(String::as_str).filter(of_body);
    let message = format!("the mesh of '{body}' has no set of elements '{}'", name.value);
    case.unknown(name, message, known.filter_map(|known| Some(known.split_once('.')?.1)))
}
