//! Mass, momentum and energy of each deformable body.

use super::bodies::Bodies;
use super::mass::element_masses;
use crate::dynamics::Stage;
use crate::petsc::sum_over_ranks;

/// Sums over the elements of a body, in 2D per metre of depth.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BodySums {
    /// Mass \[kg\].
    pub mass: f64,
    /// `int rho x dV` at the current positions [kg m].
    pub first_moment: [f64; 3],
    /// `int rho v dV` \[N s\]; 0 without inertia.
    pub linear: [f64; 3],
    /// `int rho x x v dV` about the origin at the current positions [N m s]; 0 without inertia. In 2D
    /// only the last component is nonzero.
    pub angular: [f64; 3],
    /// Kinetic energy \[J\]; 0 without inertia.
    pub kinetic: f64,
    /// Strain energy, without that of viscous branches \[J\].
    pub strain: f64,
}

impl BodySums {
    fn entries(&mut self) -> impl Iterator<Item = &mut f64> {
        let Self { mass, first_moment, linear, angular, kinetic, strain } = self;
        [mass, kinetic, strain].into_iter().chain(first_moment).chain(linear).chain(angular)
    }
}

/// A vector of a node in space; a missing component is 0.
fn of_node<const D: usize>(field: &[f64], node: u32) -> [f64; 3] {
    std::array::from_fn(|i| if i < D { field[node as usize * D + i] } else { 0.0 })
}

impl<const D: usize> Bodies<D> {
    /// Names of the deformable bodies.
    pub fn body_names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(super::bodies::NamedBody::name)
    }

    /// Sums over each deformable body at the trial state of `stage`, with the mass matrix of the
    /// equations of motion, the same on all ranks. Collective.
    ///
    /// Each element is summed by one rank, so that bodies may meet and nodes may belong to ghosts.
    pub fn body_sums(&self, stage: &Stage) -> Vec<BodySums> {
        let (u, v) = (stage.trial.u.local(), stage.trial.v.local());
        let mine = &self.local.mine;
        let mut sums = vec![BodySums::default(); self.names.len()];
        for patches in &self.patches {
            sums[patches.body].strain += patches.energy(&u);
        }
        for solid in &self.solids {
            let sum = &mut sums[solid.body];
            sum.strain += self.strain_energy_of(solid, &u);
            element_masses(solid, self.redistribution.as_ref(), |index, mass| {
                if !mine[solid.group.elements()[index] as usize] {
                    return;
                }
                let nodes = solid.map.nodes(index);
                for (&a, row) in nodes.iter().zip(mass.chunks_exact(nodes.len())) {
                    let own: f64 = row.iter().sum();
                    let shift = of_node::<D>(&u, a);
                    let place = &self.local.mesh.points[a as usize];
                    let x: [f64; 3] = std::array::from_fn(|i| if i < D { place[i] + shift[i] } else { 0.0 });
                    sum.mass += own;
                    (0..3).for_each(|i| sum.first_moment[i] += own * x[i]);
                    if !self.inertia {
                        continue;
                    }
                    let mut p = [0.0; 3];
                    for (&b, value) in nodes.iter().zip(row) {
                        let v = of_node::<D>(&v, b);
                        (0..3).for_each(|i| p[i] += value * v[i]);
                    }
                    let v = of_node::<D>(&v, a);
                    for i in 0..3 {
                        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                        sum.kinetic += 0.5 * v[i] * p[i];
                        sum.linear[i] += p[i];
                        sum.angular[i] += x[j] * p[k] - x[k] * p[j];
                    }
                }
            });
        }
        sum_over_ranks(self.session.world(), sums.iter_mut().flat_map(BodySums::entries));
        sums
    }
}
