//! Detection of nearly incompressible bodies whose elements lock because the case chose no remedy, or
//! whose pressures are poor although a better remedy is available.

use mpi::collective::SystemOperation;

use crate::assembly::ContactSystem;
use crate::collective::Collective;
use crate::element::{LOCKS, Locking, locks};
use crate::mesh::{ElementKind, PlaneState};
use crate::model::{Body, Model};

/// Poisson's ratio from which on pressures of second-order elements without a mean dilatation are
/// poor on coarse meshes, except those of quad9 and hex27 with selective reduced integration.
///
/// Of a smooth solution on 2 by 2 cells with moved nodes, the error of the pressure of tri6 is 38 % at
/// 0.49, 78 % at 0.499 and 410 % at 0.4999, and of quad8 with `selective_reduced` 25 %, 209 % and more
/// than 1000 %. With `mean_dilatation` it is 18 % or less at all of them. At 0.49 full integration is
/// the more accurate on finer meshes (docs/validation/incompressible.md).
const NOISY: f64 = 0.499;

/// Elements of one kind and material of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UsedElements {
    /// Kind of the elements.
    pub kind: ElementKind,
    /// Their remedy against locking.
    pub cure: Locking,
    /// Index of the material among those of the body.
    material: usize,
}

/// For each body, its materials and the kinds of their elements, each with the locking remedy in use.
/// Collective.
pub fn cures<const D: usize>(system: &ContactSystem<D>, model: &Model<D>) -> Vec<Vec<UsedElements>> {
    let kinds = ElementKind::ALL.len();
    let most = system.bodies().materials().most();
    let mut own = vec![0u8; model.bodies.len() * most * kinds];
    for solid in system.bodies().solids() {
        own[(solid.body * most + solid.material) * kinds + solid.group.kind() as usize] = 1;
    }
    let mut all = vec![0u8; own.len()];
    system.session().world().reduce_all(&own[..], &mut all[..], SystemOperation::max());
    let of_body = |(body, has): (&Body, &[u8])| {
        let mut found = Vec::new();
        for (material, has) in has.chunks_exact(kinds).enumerate() {
            for kind in ElementKind::ALL.into_iter().filter(|&kind| has[kind as usize] > 0) {
                let formulation = &body.materials[material].formulation;
                let cure = formulation.cure(kind);
                found.push(UsedElements { kind, cure, material });
            }
        }
        found
    };
    model.bodies.iter().zip(all.chunks_exact(most * kinds)).map(of_body).collect()
}

/// Names of the kinds of those elements of a body that are `bad`, each once.
fn kinds_of(used: &[UsedElements], bad: impl Fn(&UsedElements) -> bool) -> Vec<&'static str> {
    let mut names: Vec<&str> = used.iter().filter(|used| bad(used)).map(|used| used.kind.name()).collect();
    names.sort_unstable();
    names.dedup();
    names
}

/// Rounding error of a Poisson's ratio that is recomputed from moduli.
const ROUNDING: f64 = 1e-9;

/// A remark for each body whose elements lock, and for each whose pressures another formulation would
/// improve. Collective.
pub fn remarks<const D: usize>(system: &ContactSystem<D>, model: &Model<D>) -> Vec<String> {
    let cures = cures(system, model);
    let bodies = || model.bodies.iter().zip(&cures);
    let locked = bodies().filter_map(|(body, used)| {
        let bad = |used: &UsedElements| {
            let formulation = &body.materials[used.material].formulation;
            used.cure == Locking::None
                && used.kind.order() == 1
                && formulation.plane != PlaneState::Stress
                && locks(&formulation.moduli())
        };
        let kinds = kinds_of(used, bad);
        (!kinds.is_empty()).then(|| {
            format!(
                "'{}' locks: {} elements with `locking: none` are too stiff at a Poisson's ratio of {LOCKS} or \
                 more: remove `locking`",
                body.name,
                kinds.join(" and ")
            )
        })
    });
    let noisy = bodies().filter_map(|(body, used)| {
        let poor = |used: &UsedElements| {
            let formulation = &body.materials[used.material].formulation;
            let ratio = formulation.moduli().poisson_ratio();
            let is_poor = match used.cure {
                Locking::MeanDilatation | Locking::PatchDilatation => false,
                Locking::SelectiveReduced => matches!(used.kind, ElementKind::Quad8 | ElementKind::Hex20),
                Locking::Auto | Locking::None => used.kind.order() > 1,
            };
            is_poor && formulation.plane == PlaneState::Strain && ratio > NOISY - ROUNDING
        };
        let kinds = kinds_of(used, poor);
        (!kinds.is_empty()).then(|| {
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
