//! Detection of nearly incompressible bodies whose elements lock because no remedy is available, or
//! whose pressures are poor although a better remedy is available.

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use crate::assembly::ContactSystem;
use crate::element::{LOCKS, Locking, locks};
use crate::mesh::ElementKind;
use crate::model::Model;

/// Poisson's ratio from which on pressures of second-order elements without a mean dilatation are
/// poor on coarse meshes, except those of quad9 and hex27 with selective reduced integration.
///
/// Of a smooth solution on 2 by 2 cells with moved nodes, the error of the pressure of tri6 is 38 % at
/// 0.49, 78 % at 0.499 and 410 % at 0.4999, and of quad8 with `selective_reduced` 25 %, 209 % and more
/// than 1000 %. With `mean_dilatation` it is 18 % or less at all of them. At 0.49 full integration is
/// the more accurate on finer meshes (docs/validation/incompressible.md).
const NOISY: f64 = 0.499;

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
        let kinds = ElementKind::ALL.into_iter().filter(|&kind| has[kind as usize] > 0);
        let of_kind = |kind| {
            let formulations = body.materials.iter().map(|material| &material.formulation);
            formulations.map(move |formulation| (kind, formulation.locking.on(kind, &formulation.moduli())))
        };
        let mut found: Vec<(ElementKind, Locking)> = kinds.flat_map(of_kind).collect();
        found.dedup();
        found
    };
    model.bodies.iter().zip(all.chunks_exact(kinds)).map(of_body).collect()
}

/// Bodies that lock because some of their elements have no remedy, with the kinds: linear
/// simplices, wedges and pyramids at a high Poisson's ratio. Collective.
fn locked_bodies<const D: usize>(
    system: &ContactSystem<D>,
    model: &Model<D>,
) -> Vec<(String, Vec<ElementKind>)> {
    let cures = cures(system, model);
    let with_kinds = model.bodies.iter().zip(&cures).map(|(body, kinds)| {
        let bad = |kind: &ElementKind| {
            !Locking::SelectiveReduced.offered(*kind) && !Locking::MeanDilatation.offered(*kind)
        };
        let kinds = kinds.iter().map(|(kind, _)| *kind).filter(bad);
        let locks = body.materials.iter().any(|material| locks(&material.formulation.moduli()));
        let mut kinds = kinds.filter(|_| locks).collect::<Vec<_>>();
        kinds.dedup();
        (body.name.clone(), kinds)
    });
    with_kinds.filter(|(_, kinds)| !kinds.is_empty()).collect()
}

/// Rounding error of a Poisson's ratio that is recomputed from moduli.
const ROUNDING: f64 = 1e-9;

/// A remark for each body whose elements lock and have no formulation that avoids it, and for each whose
/// pressures another formulation would improve. Collective.
pub fn remarks<const D: usize>(system: &ContactSystem<D>, model: &Model<D>) -> Vec<String> {
    let locked = locked_bodies(system, model).into_iter().map(|(name, kinds)| {
        let kinds: Vec<&str> = kinds.iter().map(|kind| kind.name()).collect();
        let better = if D == 2 { "quad4, quad8, quad9 or tri6" } else { "hex8, hex20, hex27 or tet10" };
        format!(
            "'{name}' locks: {} elements support neither selective_reduced nor mean_dilatation and are too \
             stiff at a Poisson's ratio of {LOCKS} or more: mesh it with {better}",
            kinds.join(" and ")
        )
    });
    let cures = cures(system, model);
    let noisy = model.bodies.iter().zip(&cures).filter_map(|(body, kinds)| {
        let poor = |(kind, cure): &&(ElementKind, Locking)| match cure {
            Locking::MeanDilatation => false,
            Locking::SelectiveReduced => matches!(kind, ElementKind::Quad8 | ElementKind::Hex20),
            Locking::Auto | Locking::None => kind.order() > 1,
        };
        let mut kinds: Vec<&str> = kinds.iter().filter(poor).map(|(kind, _)| kind.name()).collect();
        kinds.dedup();
        let ratios = body.materials.iter().map(|material| material.formulation.moduli().poisson_ratio());
        let ratio = ratios.fold(0.0, f64::max);
        (ratio > NOISY - ROUNDING && !kinds.is_empty()).then(|| {
            format!(
                "pressures of {} elements of '{}' may be inaccurate at a Poisson's ratio of {NOISY} or more: \
                 write `locking: mean_dilatation`",
                kinds.join(" and "),
                body.name
            )
        })
    });
    locked.chain(noisy).collect()
}
