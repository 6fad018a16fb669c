//! Patches of elements that share a pressure, with their volume terms and the positions of their entries.

use std::collections::BTreeMap;

use super::forces::{SolidFields, SolidTerms};
use super::scatter::ScatterMap;
use super::solid::{BodyPhysics, SolidElements};
use crate::element::{ElementSink, Inverted, PatchGroup, Request};
use crate::error::Result;
use crate::mesh::ElementPatch;
use crate::model::RayleighFactors;
use crate::partition::LocalMesh;
use crate::petsc::BlockPattern;
use crate::space::Held;

/// Patches of one material with equal numbers of nodes.
pub struct SolidPatches<const D: usize> {
    /// The kernel.
    group: PatchGroup<D>,
    /// The kernel for joined bodies, as in [`SolidElements`].
    softened: Option<PatchGroup<D>>,
    /// Positions of its entries.
    pub map: ScatterMap,
    damping: Option<RayleighFactors>,
    /// Index of the body.
    pub body: usize,
    /// For each patch, whether this rank counts it in sums over all ranks: that which owns its first element.
    counted: Vec<bool>,
}

/// Creates the patches of a rank.
///
/// # Errors
/// If a patch has elements of another dimension.
pub fn patches<const D: usize>(
    local: &LocalMesh<D>,
    bodies: &[Vec<BodyPhysics>],
    pattern: &BlockPattern,
    held: &Held<D>,
) -> Result<Vec<SolidPatches<D>>> {
    let mut groups: BTreeMap<(u16, u32, usize), Vec<u32>> = BTreeMap::new();
    for (number, patch) in (0..).zip(&local.mesh.patches) {
        let width = PatchGroup::<D>::nodes_of(patch).len();
        groups.entry((patch.body, patch.material, width)).or_default().push(number);
    }
    let of_group = |((body, material, width), numbers): ((u16, u32, usize), Vec<u32>)| {
        let physics = &bodies[usize::from(body)][material as usize];
        let group = PatchGroup::new(&local.mesh, &numbers, physics.formulation)?;
        let map = ScatterMap::new::<D>(width, group.nodes().to_vec(), pattern, &local.index, held);
        let owns = |element: u32| element != ElementPatch::ELSEWHERE && local.mine[element as usize];
        let counted = (0..group.len()).map(|patch| owns(group.elements(patch)[0])).collect();
        Ok(SolidPatches {
            softened: group.softened(physics.relaxed()),
            group,
            map,
            damping: physics.damping,
            body: usize::from(body),
            counted,
        })
    };
    groups.into_iter().map(of_group).collect()
}

impl<const D: usize> SolidPatches<D> {
    /// Volumetric energy of the patches that this rank counts \[J\].
    pub fn energy(&self, u: &[f64]) -> f64 {
        self.group.energy(u, &self.counted)
    }
}

/// Patches never report an inverted element: the group of the element does.
impl<const D: usize> SolidTerms<D> for SolidPatches<D> {
    fn map(&self) -> &ScatterMap {
        &self.map
    }

    fn damping(&self) -> Option<RayleighFactors> {
        self.damping
    }

    fn evaluate(
        &self,
        at: &SolidFields,
        request: Request,
        sink: &mut dyn ElementSink,
    ) -> std::result::Result<(), Inverted> {
        let group = self.softened.as_ref().filter(|_| at.softened).unwrap_or(&self.group);
        match at.start {
            Some(start) => group.evaluate_step(start, at.u, request, sink),
            None => group.evaluate(at.u, request, sink),
        }
        Ok(())
    }

    fn pressure_change(&self, u: &[f64], earlier: &[f64], sink: &mut dyn ElementSink) {
        self.group.pressure_change(u, earlier, sink);
    }
}

/// All terms of the solids.
pub fn solid_terms<'a, const D: usize>(
    solids: &'a [SolidElements<D>],
    patches: &'a [SolidPatches<D>],
) -> impl Iterator<Item = &'a dyn SolidTerms<D>> {
    let of_patches = patches.iter().map(|patches| patches as &dyn SolidTerms<D>);
    solids.iter().map(|solid| solid as &dyn SolidTerms<D>).chain(of_patches)
}

/// The slope of the volumetric energy \[Pa\] of each element of the rank that is in a patch; empty without
/// patches.
pub fn pressures<const D: usize>(patches: &[SolidPatches<D>], elements: usize, u: &[f64]) -> Vec<f64> {
    let mut pressures = vec![0.0; if patches.is_empty() { 0 } else { elements }];
    for patches in patches {
        patches.group.pressures(u, |element, pressure| pressures[element as usize] = pressure);
    }
    pressures
}
