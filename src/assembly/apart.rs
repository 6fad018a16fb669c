//! Contacts that can not close: how far apart their surfaces start, beside how far the bodies can get.

use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;

use super::contact::facets_of;
use super::external::Moment;
use super::scatter::ForceSink;
use super::system::ContactSystem;
use crate::error::{Error, Result};
use crate::mesh::{Bounds, Facet};
use crate::model::{self, Model, Target};

/// Equal parts of the time at whose ends prescribed motions and loads are looked at, beside the instants at which they may jump.
const INSTANTS: u32 = 64;

/// Factor on what motions and loads would do alone: a light body that is hit flies faster than what hits it, a load acts
/// on an area that grows.
const GENEROUS: f64 = 10.0;

/// The time that bodies have, and what acts in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// End of the motion \[s\].
    pub end: f64,
    /// Inertia takes part.
    pub is_dynamic: bool,
    /// The motion starts from a static equilibrium.
    pub from_equilibrium: bool,
}

impl<const D: usize> ContactSystem<D> {
    /// Refuses a contact whose surfaces start further apart than the bodies can get within the time. Collective.
    ///
    /// They can get as far as their own size (an elastic body that is held would have to be twice as long), and
    /// [`GENEROUS`] times `|u| + (|v| + |v_0|) T + a T^2 / 2`, with the largest prescribed displacement and velocity, the
    /// largest velocity at the start, and all loads on the lightest body. Nothing bounds what a load does in statics.
    ///
    /// # Errors
    /// Names the contact, its gap and what there is to close it, the same on all ranks.
    pub fn require_reach(&mut self, model: &Model<D>, span: &Span) -> Result<()> {
        let mut motion = None;
        for (at, contact) in model.contacts.iter().enumerate() {
            let gap = self.overclosures()[at].smallest_gap;
            let sizes = self.sizes(contact);
            if gap <= sizes {
                continue;
            }
            let gap = if gap < f64::MAX { gap } else { self.between(contact)? };
            let moved = match motion {
                Some(moved) => moved,
                None => *motion.insert(self.way(model, span)),
            };
            let reach = sizes + moved;
            if gap > reach {
                let message = format!(
                    "contact '{}' can not close: its surfaces start {gap:.3e} m apart, and within {} s the bodies get no \
                     further than {reach:.3e} m",
                    contact.name, span.end
                );
                return Err(Error::case(message)
                    .hint("bring them together (are all lengths in metres?), or leave the contact out"));
            }
        }
        Ok(())
    }

    /// Distance of the boxes around the two surfaces of a contact between bodies \[m\].
    fn between(&self, contact: &model::Contact<D>) -> Result<f64> {
        let Target::Surface { set, .. } = &contact.target else { return Ok(0.0) };
        let [one, other] = [&contact.contactor, set]
            .map(|set| facets_of(&self.local, set).map(|facets| self.bounds(facets)));
        let (one, other) = (one?, other?);
        let apart = |k: usize| (one.low[k] - other.high[k]).max(other.low[k] - one.high[k]).max(0.0);
        Ok((0..D).map(|k| apart(k).powi(2)).sum::<f64>().sqrt())
    }

    /// The box around facets of all ranks. Collective.
    fn bounds(&self, facets: &[Facet]) -> Bounds<D> {
        let mesh = &self.local.mesh;
        let of_facet = |&facet: &Facet| {
            let mut nodes = Vec::new();
            mesh.facet_nodes(facet, &mut nodes);
            Bounds::of_facet(mesh.facet_kind(facet), nodes.iter().map(|&node| mesh.points[node as usize]))
        };
        self.joined(facets.iter().map(of_facet).fold(Bounds::EMPTY, |all, one| all.join(&one)))
    }

    /// The box around the boxes of all ranks. Collective.
    fn joined(&self, own: Bounds<D>) -> Bounds<D> {
        let (mut low, mut high) = ([0.0; D], [0.0; D]);
        let world = self.session.world();
        world.all_reduce_into(&own.low[..], &mut low[..], SystemOperation::min());
        world.all_reduce_into(&own.high[..], &mut high[..], SystemOperation::max());
        Bounds { low, high }
    }

    /// Diagonals of the boxes around the bodies of a contact \[m\]. Collective.
    fn sizes(&self, contact: &model::Contact<D>) -> f64 {
        let mesh = &self.local.mesh;
        let size = |body: usize| {
            let elements =
                (0..mesh.element_count()).filter(|&element| usize::from(mesh.body[element]) == body);
            let nodes = elements.flat_map(|element| mesh.element_nodes(element));
            let around = self.joined(Bounds::of(nodes.map(|&node| mesh.points[node as usize])));
            (0..D).map(|k| (around.high[k] - around.low[k]).powi(2)).sum::<f64>().sqrt()
        };
        match contact.target {
            Target::Surface { body, .. } => size(contact.body) + size(body),
            Target::Obstacle(_) => size(contact.body),
        }
    }

    /// How far prescribed motions, velocities at the start and loads can bring a body \[m\]. Collective.
    fn way(&mut self, model: &Model<D>, span: &Span) -> f64 {
        let even = (0..=INSTANTS).map(|k| span.end * f64::from(k) / f64::from(INSTANTS));
        let instants = even.chain(model.kinks().into_iter().filter(|time| (0.0..=span.end).contains(time)));
        let (mut travel, mut speed, mut load) = (0.0_f64, 0.0_f64, 0.0_f64);
        let mut force = vec![0.0; self.local.index.owned * D];
        let zero = vec![0.0; self.local.mesh.points.len() * D];
        for time in instants {
            let [u, v] = self.supports.largest(&self.local.mesh.points, time);
            (travel, speed) = (travel.max(u), speed.max(v));
            force.fill(0.0);
            self.external.add_force(&Moment { time, u: &zero, factor: 1.0 }, &self.solids, &mut force);
            load = load.max(force.iter().map(|entry| entry.abs()).sum());
        }
        speed += self.speed_at_start(model);
        let masses = self.masses(model.bodies.len());
        let world = self.session.world();
        let (own, mut most) = ([travel, speed], [0.0; 2]);
        world.all_reduce_into(&own[..], &mut most[..], SystemOperation::max());
        let mut total = 0.0;
        world.all_reduce_into(&load, &mut total, SystemOperation::sum());
        let [travel, speed] = most;
        if !span.is_dynamic {
            return if total > 0.0 { f64::INFINITY } else { GENEROUS * travel };
        }
        let lightest = masses.into_iter().fold(f64::INFINITY, f64::min);
        let pushed = match (total > 0.0, span.from_equilibrium) {
            (false, _) => 0.0,
            (true, true) => f64::INFINITY,
            (true, false) => 0.5 * total / lightest * span.end.powi(2),
        };
        GENEROUS * (travel + speed * span.end + pushed)
    }

    /// Largest velocity that this rank's bodies have at the start \[m/s\].
    fn speed_at_start(&self, model: &Model<D>) -> f64 {
        let mesh = &self.local.mesh;
        let of_element = |element: usize| {
            let functions = &model.bodies[usize::from(mesh.body[element])].initial_velocity;
            let at = |&node: &u32| {
                let point = super::supports::in_space(&mesh.points[node as usize]);
                functions.iter().map(|function| function.value(point, 0.0).powi(2)).sum::<f64>().sqrt()
            };
            mesh.element_nodes(element).iter().map(at).fold(0.0, f64::max)
        };
        (0..mesh.element_count()).map(of_element).fold(0.0, f64::max)
    }

    /// Mass of each body \[kg\]. Collective.
    fn masses(&self, bodies: usize) -> Vec<f64> {
        let mut own = vec![0.0; bodies];
        let mut force = vec![0.0; self.local.index.owned * D];
        for solid in &self.solids {
            force.fill(0.0);
            let along_x = |_: &[f64; D]| std::array::from_fn(|i| if i == 0 { 1.0 } else { 0.0 });
            solid.group.body_force(along_x, &mut ForceSink::<D> { map: &solid.map, force: &mut force });
            own[solid.body] += force.iter().sum::<f64>();
        }
        let mut all = vec![0.0; bodies];
        self.session.world().all_reduce_into(&own[..], &mut all[..], SystemOperation::sum());
        all
    }
}
