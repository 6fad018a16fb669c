//! Reports of a step: contact zones, reactions, and the points that probes watch.

use std::rc::Rc;

use mpi::collective::SystemOperation;
use mpi::traits::{Communicator, CommunicatorCollectives, Root};

use super::contact::LocalContact;
use super::system::ContactSystem;
use crate::contact::point::{PointState, Status};
use crate::contact::zone::ZoneSummary;
use crate::error::{Error, Result};
use crate::model::ProbeModel;
use crate::partition::IndexMap;
use crate::petsc::{Session, Vector};
use crate::tensor::Vector as Point;

/// Contact quantities at a node: area-weighted averages over its points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodalContact {
    /// Normal traction `t_n` \[Pa\].
    pub normal_traction: f64,
    /// Friction traction `t_T` \[Pa\]: in 2D its component along the tangent, in 3D its magnitude.
    pub friction_traction: f64,
    /// Gap `g_n` \[m\].
    pub gap: f64,
    /// Slip velocity \[m/s\]: in 2D its component along the tangent, in 3D its magnitude.
    pub slip_velocity: f64,
    /// Status of most of the area.
    pub status: Status,
}

/// A node that a probe watches.
#[derive(Debug, Clone, PartialEq)]
pub struct Watched<const D: usize> {
    /// Name of the probe.
    pub name: String,
    /// Line of the case file that requests it; 0 if unknown.
    pub line: usize,
    /// Rank that owns the node.
    pub rank: i32,
    /// Local number of the node on that rank.
    pub node: u32,
    /// Reference position of the node \[m\].
    pub place: [f64; D],
    /// Distance of the node from the requested position \[m\].
    pub distance: f64,
    /// Index of the contact whose surface contains the node, if there is one.
    pub contact: Option<usize>,
}

/// Motion and contact of a watched node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointReport<const D: usize> {
    /// Displacement \[m\].
    pub u: [f64; D],
    /// Velocity \[m/s\].
    pub v: [f64; D],
    /// Contact quantities, if the node is on a contactor.
    pub contact: Option<NodalContact>,
}

/// Summary of a contact after each step, with the same values on all ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactSummary<const D: usize> {
    /// Name of the contact.
    pub name: String,
    /// Mean size of a facet of the contactor \[m\].
    pub facet: f64,
    /// Forces, area, counts, extremes.
    pub zone: ZoneSummary<D>,
}

/// Nodal values of a contact as area-weighted sums at local nodes.
pub struct NodalSums {
    /// Sums `[node * FIELDS + k]`: the values of [`NodalContact`], then the closed and the slipping
    /// share, the slip path, the friction work, friction traction and slip velocity in space.
    pub sums: Vec<f64>,
    /// Area of each node.
    pub weights: Vec<f64>,
}

impl NodalSums {
    /// Number of values per node.
    pub const FIELDS: usize = 14;

    /// Sums up all points of a contact. Values at owned nodes are complete after
    /// [`complete`](Self::complete). Between bodies a gap is at most a quarter of the largest
    /// facet.
    pub fn of<const D: usize>(contact: &LocalContact<D>, nodes: usize) -> Self {
        let furthest = contact.pair.reach();
        let mut gathered = Self { sums: vec![0.0; nodes * Self::FIELDS], weights: vec![0.0; nodes] };
        let history = &contact.state.history;
        let value = |p: usize, point: &PointState<D>| {
            let closed = f64::from(u8::from(point.is_closed()));
            let slips = f64::from(u8::from(point.status == Status::Slip));
            let component = |vector: &Point<D>, i: usize| vector.get(i).copied().unwrap_or(0.0);
            let (t, v) = (&point.friction_traction, &point.slip_velocity);
            [
                point.normal_traction,
                point.along(&point.friction_traction),
                point.gap.min(furthest),
                point.along(&point.slip_velocity),
                closed,
                slips,
                history[p].slip,
                history[p].friction_work,
                component(t, 0),
                component(t, 1),
                component(t, 2),
                component(v, 0),
                component(v, 1),
                component(v, 2),
            ]
        };
        contact.gather_nodal(value, &mut gathered.sums, &mut gathered.weights);
        gathered
    }

    /// Adds the contributions of other ranks to this rank's nodes. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn complete(&mut self, session: &Rc<Session>, index: &IndexMap) -> Result<()> {
        const WIDTH: usize = NodalSums::FIELDS + 1;
        let mut all = Vector::ghosted(session, index.owned, WIDTH, &index.ghosts)?;
        let parts = self.sums.chunks_exact(Self::FIELDS).zip(&self.weights);
        for ((own, weight), row) in parts.zip(all.local_mut().chunks_exact_mut(WIDTH)) {
            row[0] = *weight;
            row[1..].copy_from_slice(own);
        }
        all.add_ghosts_to_owners()?;
        let parts = self.sums.chunks_exact_mut(Self::FIELDS).zip(&mut self.weights);
        for ((own, weight), row) in parts.zip(all.local().chunks_exact(WIDTH)) {
            *weight = row[0];
            own.copy_from_slice(&row[1..]);
        }
        Ok(())
    }

    /// Returns the averages at a node; `None` if it is not on the surface.
    pub fn at(&self, node: u32) -> Option<(NodalContact, [f64; 2])> {
        let node = node as usize;
        let weight = self.weights[node];
        if weight <= 0.0 {
            return None;
        }
        let mean = |k: usize| self.sums[node * Self::FIELDS + k] / weight;
        // A tie counts as closed and as slip, whatever the order of summation, which depends on the
        // partition.
        let tie = 0.5 - 1e-9;
        let status = match (mean(4) < tie, mean(5) < tie * mean(4)) {
            (true, _) => Status::Open,
            (false, true) => Status::Stick,
            (false, false) => Status::Slip,
        };
        let contact = NodalContact {
            normal_traction: mean(0),
            friction_traction: mean(1),
            gap: mean(2),
            slip_velocity: mean(3),
            status,
        };
        Some((contact, [mean(6), mean(7)]))
    }
}

impl<const D: usize> ContactSystem<D> {
    /// Finds the nodes nearest to the probes, with the same result on all ranks. Collective.
    ///
    /// # Errors
    /// If a body has no nodes.
    pub fn watch(&self, probes: &[ProbeModel<D>]) -> Result<Vec<Watched<D>>> {
        let sums = (0..self.contacts.len()).map(|contact| self.nodal_sums(contact));
        let sums = sums.collect::<Result<Vec<_>>>()?;
        probes.iter().map(|probe| self.nearest(probe, &sums)).collect()
    }

    /// Computes the nodal sums of a contact, which are complete at owned nodes. Collective.
    pub(super) fn nodal_sums(&self, contact: usize) -> Result<NodalSums> {
        let mut sums = NodalSums::of(&self.contacts[contact], self.local.mesh.points.len());
        sums.complete(&self.session, &self.local.index)?;
        Ok(sums)
    }

    /// Names of the contacts with their normal stiffness at a high pressure (a tenth of the softer
    /// modulus), relative to that of the elements beneath them.
    pub fn relative_stiffnesses(&self) -> impl Iterator<Item = (&str, f64)> {
        self.contacts.iter().map(|contact| {
            let law = contact.law().normal;
            let modulus = contact.beneath * contact.facet_size;
            let stiffness = -law.evaluate(-law.penetration(0.1 * modulus)).derivative;
            (contact.name.as_str(), stiffness / contact.beneath)
        })
    }

    fn nearest(&self, probe: &ProbeModel<D>, contacts: &[NodalSums]) -> Result<Watched<D>> {
        let world = self.session.world();
        let mut on_body = vec![probe.body.is_none(); self.local.mesh.points.len()];
        for element in (0..self.local.mesh.element_count()).filter(|_| probe.body.is_some()) {
            if Some(usize::from(self.local.mesh.body[element])) == probe.body {
                self.local.mesh.element_nodes(element).iter().for_each(|&n| on_body[n as usize] = true);
            }
        }
        let distance = |node: u32| {
            (Point::<D>::from(self.local.mesh.points[node as usize]) - Point::from(probe.at)).norm()
        };
        let owned = (0..self.local.index.owned as u32).filter(|&node| on_body[node as usize]);
        let own = owned.map(|node| (distance(node), self.local.input_node[node as usize], node));
        let own = own.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mine = own.map_or(f64::INFINITY, |(distance, ..)| distance);
        let mut least = 0.0;
        world.all_reduce_into(&mine, &mut least, SystemOperation::min());
        let candidate =
            own.filter(|(distance, ..)| *distance == least).map_or(u32::MAX, |(_, input, _)| input);
        let mut chosen = 0;
        world.all_reduce_into(&candidate, &mut chosen, SystemOperation::min());
        if chosen == u32::MAX {
            return Err(Error::case(format!("probe '{}' has no node", probe.name)));
        }
        let holder = if candidate == chosen { world.rank() } else { i32::MAX };
        let mut rank = 0;
        world.all_reduce_into(&holder, &mut rank, SystemOperation::min());
        let node = own.filter(|_| world.rank() == rank).map_or(0, |(_, _, node)| node);
        let mut place = self.local.mesh.points.get(node as usize).copied().unwrap_or([0.0; D]);
        let contact = contacts.iter().position(|sums| world.rank() == rank && sums.at(node).is_some());
        let mut number = contact.map_or(-1, |index| index as i32);
        world.process_at_rank(rank).broadcast_into(&mut place[..]);
        world.process_at_rank(rank).broadcast_into(&mut number);
        let contact = usize::try_from(number).ok();
        let line = probe.line;
        Ok(Watched { name: probe.name.clone(), line, rank, node, place, distance: least, contact })
    }

    /// Reports motion and contact at the watched nodes, with the same result on all ranks.
    /// Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn points(&self, watched: &[Watched<D>], u: &Vector, v: &Vector) -> Result<Vec<PointReport<D>>> {
        let world = self.session.world();
        let width = 2 * D + 5;
        let mut own = vec![0.0; watched.len() * width];
        let (u, v) = (u.owned(), v.owned());
        let here = |point: &Watched<D>| point.rank == world.rank();
        // All ranks call this and have the same list of probes.
        let wanted = watched.iter().any(|point| point.contact.is_some());
        let contacts = if wanted { 0..self.contacts.len() } else { 0..0 };
        let sums = contacts.map(|index| self.nodal_sums(index)).collect::<Result<Vec<_>>>()?;
        for (point, row) in watched.iter().zip(own.chunks_mut(width)).filter(|(point, _)| here(point)) {
            let start = point.node as usize * D;
            row[..D].copy_from_slice(&u[start..start + D]);
            row[D..2 * D].copy_from_slice(&v[start..start + D]);
            // If several contacts contain the node, take the one with the highest pressure, or else
            // with the smallest gap.
            let found = sums.iter().filter_map(|sums| sums.at(point.node)).map(|(contact, _)| contact);
            let most = found
                .max_by(|a, b| a.normal_traction.total_cmp(&b.normal_traction).then(b.gap.total_cmp(&a.gap)));
            if let Some(contact) = most {
                let status = f64::from(contact.status as u8);
                let values = [
                    contact.normal_traction,
                    contact.friction_traction,
                    contact.gap,
                    contact.slip_velocity,
                    status,
                ];
                row[2 * D..].copy_from_slice(&values);
            }
        }
        let mut all = vec![0.0; own.len()];
        world.all_reduce_into(&own[..], &mut all[..], SystemOperation::sum());
        let reports = watched.iter().zip(all.chunks(width)).map(|(point, row)| PointReport {
            u: std::array::from_fn(|i| row[i]),
            v: std::array::from_fn(|i| row[D + i]),
            contact: point.contact.map(|_| nodal_contact(&row[2 * D..])),
        });
        Ok(reports.collect())
    }

    /// Summarises the zones of all contacts, with the same result on all ranks. Collective.
    pub fn contact_summaries(&self) -> Vec<ContactSummary<D>> {
        let world = self.session.world();
        let reduce = |contact: &LocalContact<D>| {
            let own = contact.summary();
            let mut sums = vec![own.normal_force, own.area, own.friction_power, own.tangential_force];
            sums.extend(own.force.iter().chain(own.friction_force.iter()));
            sums.extend([own.points, own.stick, own.slip, own.pressing].map(|n| n as f64));
            let peaks = [own.max_penetration, own.max_pressure, own.sunk];
            let mut total = vec![0.0; sums.len()];
            let mut top = [0.0; 3];
            world.all_reduce_into(&sums[..], &mut total[..], SystemOperation::sum());
            world.all_reduce_into(&peaks[..], &mut top[..], SystemOperation::max());
            let count = |k: usize| total[4 + 2 * D + k] as usize;
            ZoneSummary {
                points: count(0),
                stick: count(1),
                slip: count(2),
                pressing: count(3),
                force: Point::from_fn(|i, _| total[4 + i]),
                friction_force: Point::from_fn(|i, _| total[4 + D + i]),
                normal_force: total[0],
                area: total[1],
                friction_power: total[2],
                tangential_force: total[3],
                max_penetration: top[0],
                max_pressure: top[1],
                sunk: top[2],
            }
        };
        self.contacts
            .iter()
            .map(|contact| ContactSummary {
                name: contact.name.clone(),
                facet: contact.facet_size,
                zone: reduce(contact),
            })
            .collect()
    }

    /// Returns the name of each support and the force that it exerts, from the reactions \[N\]. The
    /// same on all ranks. Collective.
    pub fn reactions(&self, imbalance: &Vector) -> Vec<(String, [f64; D])> {
        let imbalance = imbalance.owned();
        let boundaries = &self.supports.dofs.boundaries;
        let mut own = vec![0.0; boundaries.len() * D];
        for (boundary, sums) in boundaries.iter().zip(own.chunks_mut(D)) {
            for &(node, component) in boundary.entries.iter().filter(|(node, _)| self.local.index.owns(*node))
            {
                sums[usize::from(component)] += imbalance[node as usize * D + usize::from(component)];
            }
        }
        let mut all = vec![0.0; own.len()];
        self.session.world().all_reduce_into(&own[..], &mut all[..], SystemOperation::sum());
        let row = |sums: &[f64]| std::array::from_fn(|i| sums[i]);
        boundaries.iter().zip(all.chunks(D)).map(|(b, sums)| (b.name.clone(), row(sums))).collect()
    }
}

fn nodal_contact(row: &[f64]) -> NodalContact {
    let status = [Status::Open, Status::Stick, Status::Slip][(row[4] as usize).min(2)];
    NodalContact {
        normal_traction: row[0],
        friction_traction: row[1],
        gap: row[2],
        slip_velocity: row[3],
        status,
    }
}
