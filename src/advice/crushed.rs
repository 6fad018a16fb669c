//! Bodies that prescribed displacements compress by more than their thickness.

use crate::assembly::{ContactSystem, sides_of};
use crate::model::Model;

/// Part of its thickness from which on a body counts as crushed.
const PART: f64 = 0.8;

/// Describes the first support that moves its body at t = 0 by at least four fifths of its
/// length along an axis. Collective.
pub fn crushed<const D: usize>(system: &ContactSystem<D>, model: &Model<D>) -> Option<String> {
    let sides: Vec<[f64; D]> = (0..model.bodies.len())
        .map(|body| sides_of(system.session().world(), system.bodies().local(), body))
        .collect();
    let m = &model.units.of("m");
    model.supports.iter().find_map(|support| {
        support.bodies.iter().find_map(|&body| {
            let name = &model.bodies[body].name;
            support.components.iter().enumerate().find_map(|(i, component)| {
                let moved = component.as_ref()?.value([0.0; 3], 0.0).abs();
                let axis = ["x", "y", "z"][i];
                let side = sides[body][i];
                (moved >= PART * side).then(|| {
                    format!(
                        "'{}' moves '{}' by {moved:.3e} {m} along {axis}, but '{name}' is only {side:.3e} \
                         {m} long in this direction: prescribe a smaller displacement",
                        support.name, support.set
                    )
                })
            })
        })
    })
}
