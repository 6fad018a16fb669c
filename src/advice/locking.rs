//! Detection of bodies with locking elements: nearly incompressible ones for which no remedy is
//! available.

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use crate::assembly::ContactSystem;
use crate::element::{LOCKS, Locking, locks};
use crate::mesh::ElementKind;
use crate::model::Model;

/// For each body, the kinds of its elements, each with the locking remedy in use. Collective.
pub fn cures<const D: usize>(
    system: &ContactSystem<D>,
    model: &Model<D>,
) -> Vec<Vec<(ElementKind, Locking)>> {
    let kinds = ElementKind::ALL.len();
    let mut own = vec![0u8; model.bodies.len() * kinds];
    for solid in system.bodies().solids() {
        own[solid.body * kinds + solid.group.kind() as usize] = 1;
    }
    let mut all = vec![0u8; own.len()];
    system.session().world().all_reduce_into(&own[..], &mut all[..], SystemOperation::max());
    let of_body = |(body, has): (&crate::model::Body, &[u8])| {
        let formulation = &body.formulation;
        let kinds = ElementKind::ALL.into_iter().filter(|&kind| has[kind as usize] > 0);
        kinds.map(|kind| (kind, formulation.locking.on(kind, &formulation.moduli()))).collect()
    };
    model.bodies.iter().zip(all.chunks_exact(kinds)).map(of_body).collect()
}

/// Bodies that lock because some of their elements have no remedy, with the kinds: linear
/// simplices at a high Poisson's ratio. Collective.
fn locked_bodies<const D: usize>(
    system: &ContactSystem<D>,
    model: &Model<D>,
) -> Vec<(String, Vec<ElementKind>)> {
    let cures = cures(system, model);
    let with_kinds = model.bodies.iter().zip(&cures).map(|(body, kinds)| {
        let bad = |kind: &ElementKind| kind.order() == 1 && !Locking::SelectiveReduced.offered(*kind);
        let kinds = kinds.iter().map(|(kind, _)| *kind).filter(bad);
        let kinds = kinds.filter(|_| locks(&body.formulation.moduli())).collect::<Vec<_>>();
        (body.name.clone(), kinds)
    });
    with_kinds.filter(|(_, kinds)| !kinds.is_empty()).collect()
}

/// A remark for each body whose elements lock and have no formulation that avoids it. Collective.
pub fn remarks<const D: usize>(system: &ContactSystem<D>, model: &Model<D>) -> Vec<String> {
    let locked = locked_bodies(system, model).into_iter().map(|(name, kinds)| {
        let kinds: Vec<&str> = kinds.iter().map(|kind| kind.name()).collect();
        let better = if D == 2 { "quad4, quad8, quad9 or tri6" } else { "hex8, hex20, hex27 or tet10" };
        format!(
            "'{name}' locks: {} elements do not support selective_reduced and are too stiff at a Poisson's \
             ratio of {LOCKS} or more: mesh it with {better}",
            kinds.join(" and ")
        )
    });
    locked.collect()
}
