//! Initial velocities of the bodies.

use super::system::ContactSystem;
use crate::dynamics::Stage;
use crate::error::{Result, agree};
use crate::mesh::Mesh;
use crate::model::Model;
use crate::tensor::in_space;

/// Sets the initial velocity of the bodies. Prescribed components follow their supports. Collective.
///
/// # Errors
/// If a velocity is not finite (the same on all ranks), or a PETSc call fails.
pub fn set_velocity<const D: usize>(
    system: &ContactSystem<D>,
    stage: &mut Stage,
    model: &Model<D>,
) -> Result<()> {
    let own = {
        let mut v = stage.start.v.local_mut();
        let filled = fill_velocity(&system.bodies().local().mesh, &mut v, model);
        system.bodies().free.start(&mut v);
        filled
    };
    agree(system.session().world(), own)?;
    stage.start.a.set(0.0);
    stage.start.v.update_ghosts()
}

fn fill_velocity<const D: usize>(mesh: &Mesh<D>, v: &mut [f64], model: &Model<D>) -> Result<()> {
    v.fill(0.0);
    for element in 0..mesh.element_count() {
        let functions = &model.bodies[usize::from(mesh.body[element])].initial_velocity;
        for &node in mesh.element_nodes(element) {
            let point = &mesh.points[node as usize];
            for (i, function) in functions.iter().enumerate().take(D) {
                let motion = function.motion(in_space(point), 0.0);
                function.require_sound(&motion, point, 0.0)?;
                v[node as usize * D + i] = motion.value;
            }
        }
    }
    Ok(())
}
