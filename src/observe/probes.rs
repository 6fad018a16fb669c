//! `probes.csv`: motion and contact at chosen nodes. One entry of [`ProbeColumn::TABLE`] is one
//! column of each probe.

use mpi::collective::SystemOperation;
use mpi::traits::{Communicator, Root};

use super::nodal::{NodalMean, NodalSums, NodalValue};
use super::quantity::{Cell, LENGTH, ReportedQuantity, STEP, TIME, TableFile};
use crate::assembly::ContactSystem;
use crate::collective::Collective;
use crate::contact::point::Status;
use crate::dynamics::Stage;
use crate::error::{Error, Result};
use crate::model::ProbeModel;
use crate::petsc::{Vector, sum_over_ranks};
use crate::tensor::Vector as Point;

/// The table of all probes.
pub const PROBE_FILE: TableFile =
    TableFile { name: "probes.csv", rows: "one per step", keys: &[STEP, TIME, LENGTH] };

/// Where the value of a column comes from.
#[derive(Debug, Clone, Copy)]
pub enum ProbeValue<const D: usize> {
    /// A field of the unknowns at the node.
    Field(fn(&Stage) -> &Vector),
    /// A value of the contact. Only probes on a contactor have this column.
    Contact(NodalValue<D>),
}

/// A column of each probe.
#[derive(Debug, Clone, Copy)]
pub struct ProbeColumn<const D: usize> {
    /// Name, unit and meaning.
    pub quantity: ReportedQuantity,
    /// The value.
    pub value: ProbeValue<D>,
}

impl<const D: usize> ProbeColumn<D> {
    /// The columns of each probe. Their headings begin with the name of the probe.
    pub const TABLE: &'static [Self] = &[
        Self {
            quantity: ReportedQuantity::vector("u", "m", "displacement"),
            value: ProbeValue::Field(|stage| &stage.trial.u),
        },
        Self {
            quantity: ReportedQuantity::vector(
                "v",
                "m/s",
                "velocity; in statics the rate of the displacement",
            ),
            value: ProbeValue::Field(|stage| &stage.trial.v),
        },
        Self {
            quantity: ReportedQuantity::number(
                "contact_pressure",
                "Pa",
                "normal traction, positive in compression",
            ),
            value: ProbeValue::Contact(NodalValue::PRESSURE),
        },
        Self {
            quantity: ReportedQuantity::number(
                "traction_t",
                "Pa",
                "traction of friction and tangential damping; signed in 2D, its length in 3D",
            ),
            value: ProbeValue::Contact(NodalValue::Mean(|point| {
                point.state.along(&point.state.tangential_traction())
            })),
        },
        Self {
            quantity: ReportedQuantity::number(
                "gap",
                "m",
                "gap, positive where open; between bodies up to a quarter of the largest facet",
            ),
            value: ProbeValue::Contact(NodalValue::GAP),
        },
        Self {
            quantity: ReportedQuantity::number(
                "slip_velocity",
                "m/s",
                "velocity of the contactor against the target, along the surface; signed in 2D, its length in 3D",
            ),
            value: ProbeValue::Contact(NodalValue::Mean(|point| {
                point.state.along(&point.state.slip_velocity)
            })),
        },
        Self {
            quantity: ReportedQuantity::number("status", "", "`open`, `stick` or `slip`"),
            value: ProbeValue::Contact(NodalValue::Status),
        },
    ];

    /// The columns of a probe that is on a contactor, or is not.
    fn of_probe(on_contact: bool) -> impl Iterator<Item = &'static Self> {
        Self::TABLE.iter().filter(move |column| on_contact || matches!(column.value, ProbeValue::Field(_)))
    }

    /// Number of numbers that make up the value.
    fn width(&self) -> usize {
        match self.value {
            ProbeValue::Field(_) | ProbeValue::Contact(NodalValue::MeanVector(_)) => D,
            ProbeValue::Contact(NodalValue::Mean(_) | NodalValue::Status) => 1,
        }
    }

    fn cell(&self, number: f64) -> Cell<'static> {
        match self.value {
            ProbeValue::Contact(NodalValue::Status) => {
                let status = [Status::Open, Status::Stick, Status::Slip][(number as usize).min(2)];
                Cell::Text(word(status))
            }
            _ => Cell::Number(number),
        }
    }
}

/// The status of a contact point as a word.
pub fn word(status: Status) -> &'static str {
    match status {
        Status::Open => "open",
        Status::Stick => "stick",
        Status::Slip => "slip",
    }
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

impl<const D: usize> Watched<D> {
    /// Headings of the columns of this probe.
    pub fn headings(&self) -> Vec<String> {
        let columns = ProbeColumn::<D>::of_probe(self.contact.is_some());
        let own = columns.flat_map(|column| column.quantity.headings::<D>());
        own.map(|heading| format!("{}.{heading}", self.name)).collect()
    }

    /// Cells of the columns from the numbers of [`report`].
    fn cells(&self, numbers: &[f64]) -> Vec<Cell<'static>> {
        let mut numbers = numbers.iter();
        let columns = ProbeColumn::<D>::of_probe(self.contact.is_some());
        let mut cells = Vec::new();
        for column in columns {
            cells.extend(numbers.by_ref().take(column.width()).map(|number| column.cell(*number)));
        }
        cells
    }

    /// Number of numbers that make up the values.
    fn width(&self) -> usize {
        ProbeColumn::<D>::of_probe(self.contact.is_some()).map(ProbeColumn::width).sum()
    }
}

/// Finds the nodes nearest to the probes, with the same result on all ranks. Collective.
///
/// # Errors
/// If a body has no nodes.
pub fn watch<const D: usize>(system: &ContactSystem<D>, probes: &[ProbeModel<D>]) -> Result<Vec<Watched<D>>> {
    let still = vec![0.0; system.bodies().local().mesh.points.len() * D];
    let sums = system.contacts().iter().map(|contact| NodalSums::gather(system, contact, &still, Vec::new()));
    let sums = sums.collect::<Result<Vec<_>>>()?;
    probes.iter().map(|probe| nearest(system, probe, &sums)).collect()
}

fn nearest<const D: usize>(
    system: &ContactSystem<D>,
    probe: &ProbeModel<D>,
    contacts: &[NodalSums<D>],
) -> Result<Watched<D>> {
    let world = system.session().world();
    let local = system.bodies().local();
    // The nodes of free rigid bodies belong to no element.
    let mut on_body = vec![false; local.mesh.points.len()];
    for element in 0..local.mesh.element_count() {
        if probe.body.is_none_or(|body| usize::from(local.mesh.body[element]) == body) {
            local.mesh.element_nodes(element).iter().for_each(|&n| on_body[n as usize] = true);
        }
    }
    let distance =
        |node: u32| (Point::<D>::from(local.mesh.points[node as usize]) - Point::from(probe.at)).norm();
    let owned = (0..local.index.owned as u32).filter(|&node| on_body[node as usize]);
    let own = owned.map(|node| (distance(node), local.input_node[node as usize], node));
    let own = own.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mine = own.map_or(f64::INFINITY, |(distance, ..)| distance);
    let mut least = 0.0;
    world.reduce_all(&mine, &mut least, SystemOperation::min());
    let candidate = own.filter(|(distance, ..)| *distance == least).map_or(u32::MAX, |(_, input, _)| input);
    let mut chosen = 0;
    world.reduce_all(&candidate, &mut chosen, SystemOperation::min());
    if chosen == u32::MAX {
        return Err(Error::case(format!("probe '{}' has no node", probe.name)));
    }
    let holder = if candidate == chosen { world.rank() } else { i32::MAX };
    let mut rank = 0;
    world.reduce_all(&holder, &mut rank, SystemOperation::min());
    let node = own.filter(|_| world.rank() == rank).map_or(0, |(_, _, node)| node);
    let mut place = local.mesh.points.get(node as usize).copied().unwrap_or([0.0; D]);
    let contact = contacts.iter().position(|sums| world.rank() == rank && sums.at(node).is_some());
    let mut number = contact.map_or(-1, |index| index as i32);
    world.process_at_rank(rank).broadcast_into(&mut place[..]);
    world.process_at_rank(rank).broadcast_into(&mut number);
    let contact = usize::try_from(number).ok();
    let line = probe.line;
    Ok(Watched { name: probe.name.clone(), line, rank, node, place, distance: least, contact })
}

/// The cells of all watched nodes at the trial state, with the same result on all ranks.
/// Collective.
///
/// # Errors
/// If a PETSc call fails.
pub fn report<const D: usize>(
    system: &ContactSystem<D>,
    watched: &[Watched<D>],
    stage: &Stage,
) -> Result<Vec<Vec<Cell<'static>>>> {
    let world = system.session().world();
    // All ranks call this and have the same list of probes.
    let wanted = watched.iter().any(|point| point.contact.is_some());
    let contacts = if wanted { system.contacts() } else { &[] };
    let on_contact = || {
        ProbeColumn::<D>::TABLE.iter().filter_map(|column| match column.value {
            ProbeValue::Contact(value) => Some(value),
            ProbeValue::Field(_) => None,
        })
    };
    let u = stage.trial.u.local();
    let gathered = contacts.iter().map(|contact| {
        let values = [NodalValue::PRESSURE, NodalValue::GAP].into_iter().chain(on_contact()).collect();
        NodalSums::gather(system, contact, &u, values)
    });
    let sums = gathered.collect::<Result<Vec<_>>>()?;
    let row = |point: &Watched<D>| {
        let mut row = Vec::with_capacity(point.width());
        if point.rank == world.rank() {
            let mut means = most_loaded(&sums, point.node).into_iter();
            for column in ProbeColumn::<D>::of_probe(point.contact.is_some()) {
                match column.value {
                    ProbeValue::Field(field) => {
                        let start = point.node as usize * D;
                        row.extend_from_slice(&field(stage).owned()[start..start + D]);
                    }
                    ProbeValue::Contact(_) => {
                        row.extend(means.next().into_iter().flat_map(|mean| mean.numbers()))
                    }
                }
            }
        }
        row.resize(point.width(), 0.0);
        row
    };
    let mut rows: Vec<Vec<f64>> = watched.iter().map(row).collect();
    sum_over_ranks(world, rows.iter_mut().flatten());
    Ok(watched.iter().zip(&rows).map(|(point, row)| point.cells(row)).collect())
}

/// Means of the probe's columns in one of the contacts that contain the node: the one with the
/// highest pressure, or else with the smallest gap.
fn most_loaded<const D: usize>(contacts: &[NodalSums<D>], node: u32) -> Vec<NodalMean<D>> {
    let found = contacts.iter().filter_map(|sums| {
        let mut means = sums.at(node)?.into_iter();
        let pressure = means.next()?.number();
        let gap = means.next()?.number();
        Some((pressure, gap, means.collect()))
    });
    let most = found.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.total_cmp(&a.1)));
    most.map_or_else(Vec::new, |(_, _, means)| means)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn probe<const D: usize>(name: &str, contact: Option<usize>) -> Watched<D> {
        Watched { name: name.into(), line: 0, rank: 0, node: 0, place: [0.0; D], distance: 0.0, contact }
    }

    /// The headings follow the documented format, with contact columns only for probes on a contact
    /// surface. In 3D each vector has its third component.
    #[test]
    fn headings_follow_the_contract() {
        assert_eq!(
            probe::<2>("node_50", Some(0)).headings().join(","),
            "node_50.u_x [m],node_50.u_y [m],node_50.v_x [m/s],node_50.v_y [m/s],node_50.contact_pressure [Pa],\
             node_50.traction_t [Pa],node_50.gap [m],node_50.slip_velocity [m/s],node_50.status"
        );
        assert_eq!(
            probe::<2>("top", None).headings().join(","),
            "top.u_x [m],top.u_y [m],top.v_x [m/s],top.v_y [m/s]"
        );
        assert_eq!(
            probe::<3>("p", Some(0)).headings().join(","),
            "p.u_x [m],p.u_y [m],p.u_z [m],p.v_x [m/s],p.v_y [m/s],p.v_z [m/s],p.contact_pressure [Pa],\
             p.traction_t [Pa],p.gap [m],p.slip_velocity [m/s],p.status"
        );
    }

    /// Each number is under its heading, and a status is a word.
    #[test]
    fn numbers_are_under_their_headings() {
        let point = probe::<2>("node_50", Some(0));
        let numbers = [0.5, -0.25, 1.0, 0.0, 2e5, -1e5, 1e-3, 0.25, 2.0];
        assert_eq!((point.width(), point.headings().len()), (9, 9));
        let cells = point.cells(&numbers);
        assert_eq!(cells[4], Cell::Number(2e5));
        assert_eq!(cells[8], Cell::Text("slip"));
    }
}
