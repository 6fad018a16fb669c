//! `contact.csv`: quantities of each contact. One entry of [`ContactColumn::TABLE`] is one column.

use super::energy::ContactEnergies;
use super::quantity::{Cell, ReportedQuantity, STEP, TIME, TableFile};
use crate::assembly::{ContactResultants, ContactSystem, LocalContact};
use crate::contact::history::History;
use crate::contact::point::{PointState, Status};
use crate::dynamics::Stage;
use crate::petsc::{max_over_ranks, sum_over_ranks};
use crate::tensor::Vector as Point;

/// The table of all contacts.
pub const CONTACT_FILE: TableFile = TableFile {
    name: "contact.csv",
    rows: "one per step and contact",
    keys: &[STEP, TIME, ReportedQuantity::number("contact", "", "name of the contact in the case")],
};

/// A contact point at the trial state.
#[derive(Debug, Clone, Copy)]
pub struct ContactPoint<'a, const D: usize> {
    /// Gap, tractions, slip, area, status.
    pub state: &'a PointState<D>,
    /// Slip path and frictional work up to the last accepted step.
    pub history: &'a History<D>,
    /// Current position \[m\].
    pub position: Point<D>,
    /// Distance up to which gaps are known \[m\].
    pub reach: f64,
    /// Factor from its area to its current area.
    pub stretch: f64,
}

impl<'a, const D: usize> ContactPoint<'a, D> {
    /// The point `vertex` of a contact at the local displacements `u` \[m\], without its stretch.
    pub fn new(contact: &'a LocalContact<D>, vertex: usize, u: &[f64]) -> Self {
        let first = contact.vertices()[vertex] as usize * D;
        Self {
            state: &contact.state.current[vertex],
            history: &contact.state.history[vertex],
            position: contact.reference_point(vertex) + Point::from_fn(|i, _| u[first + i]),
            reach: contact.pair.reach(),
            stretch: 1.0,
        }
    }

    /// All points of a contact on this rank.
    fn all(contact: &'a LocalContact<D>, u: &[f64]) -> Vec<Self> {
        let stretches = contact.area_factors(u).into_iter().enumerate();
        stretches.map(|(vertex, stretch)| Self { stretch, ..Self::new(contact, vertex, u) }).collect()
    }
}

/// Reduction over the closed points of a contact and over the ranks. Integrals are over the area.
#[derive(Debug, Clone, Copy)]
pub enum OverPoints<const D: usize> {
    /// Number of closed points for which the condition holds.
    Count(fn(&ContactPoint<D>) -> bool),
    /// `sum A f`.
    Integral(fn(&ContactPoint<D>) -> f64),
    /// `sum A f` of a vector.
    VectorIntegral(fn(&ContactPoint<D>) -> Point<D>),
    /// Length of `sum A f` of a vector.
    LengthOfIntegral(fn(&ContactPoint<D>) -> Point<D>),
    /// Mean of `value` with the weight `A weight`. Absent if the weights sum up to zero.
    Mean {
        /// The value.
        value: fn(&ContactPoint<D>) -> f64,
        /// Its weight per area.
        weight: fn(&ContactPoint<D>) -> f64,
    },
    /// Largest value, at least 0.
    Largest(fn(&ContactPoint<D>) -> f64),
    /// Largest value of all points, open ones included, at least 0.
    LargestOfAll(fn(&ContactPoint<D>) -> f64),
    /// A number of the whole contact, from the energy ledger.
    Total(fn(&ContactTotals<D>) -> f64),
    /// A vector of the whole contact, from the forces of its nodes. It is `None` where it is not
    /// defined, such as a centre of pressure without pressure.
    /// Components that do not exist in 2D are ignored.
    OfForces(fn(&ContactTotals<D>) -> Option<[f64; 3]>),
}

/// Quantities of a whole contact, the same on all ranks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactTotals<const D: usize> {
    /// Sums over the nodal forces on the contactor.
    pub resultants: ContactResultants<D>,
    /// Whether both sides carry tractions as contactors.
    pub is_two_sided: bool,
    /// Stored energy and heat.
    pub energies: ContactEnergies,
}

impl<const D: usize> OverPoints<D> {
    /// The reduction in a word or two.
    pub fn about(&self) -> &'static str {
        match self {
            Self::Count(_) => "count",
            Self::Integral(_) | Self::VectorIntegral(_) => "integral",
            Self::LengthOfIntegral(_) => "length of the integral",
            Self::Mean { .. } => "weighted mean",
            Self::Largest(_) | Self::LargestOfAll(_) => "largest",
            Self::Total(_) => "whole contact",
            Self::OfForces(_) => "sum over the nodes",
        }
    }
}

/// A quantity of a contact.
#[derive(Debug, Clone, Copy)]
pub struct ContactColumn<const D: usize> {
    /// Name, unit and meaning.
    pub quantity: ReportedQuantity,
    /// The value.
    pub value: OverPoints<D>,
}

impl<const D: usize> ContactColumn<D> {
    /// The columns of `contact.csv` after step, time and the name of the contact.
    pub const TABLE: &'static [Self] = &[
        Self::FORCE_N,
        Self {
            quantity: ReportedQuantity::vector(
                "force",
                "N",
                "resultant on the contactor, friction and damping included; where both sides are contactors (`contact: all`, a \
                 set against itself) the difference of two passes, near zero",
            ),
            value: OverPoints::VectorIntegral(|point| force(point.state)),
        },
        Self {
            quantity: ReportedQuantity::number(
                "force_t",
                "N",
                "friction and tangential damping on the contactor: in 2D with the sign of its component along the tangent, the normal of \
                 the target turned clockwise; in 3D the length of the resultant",
            ),
            value: if D == 2 {
                OverPoints::Integral(|point| point.state.along(&point.state.tangential_traction()))
            } else {
                OverPoints::LengthOfIntegral(|point| point.state.tangential_traction())
            },
        },
        Self {
            quantity: ReportedQuantity::number(
                "area",
                "m2",
                "area of the contact zone on which the tractions act: deformed, or undeformed with `area: reference` and with `scheme: conserving`",
            ),
            value: OverPoints::Integral(|_| 1.0),
        },
        Self {
            quantity: ReportedQuantity::number("points", "", "closed contact points"),
            value: OverPoints::Count(|_| true),
        },
        Self {
            quantity: ReportedQuantity::number("stick", "", "points that stick"),
            value: OverPoints::Count(|point| point.state.status == Status::Stick),
        },
        Self {
            quantity: ReportedQuantity::number("slip", "", "points that slip"),
            value: OverPoints::Count(|point| point.state.status == Status::Slip),
        },
        Self::MAX_PENETRATION,
        Self {
            quantity: ReportedQuantity::number("max_pressure", "Pa", "largest normal traction of a point"),
            value: OverPoints::Largest(|point| point.state.normal_traction),
        },
        Self {
            quantity: ReportedQuantity::number(
                "friction_power",
                "W",
                "power that friction takes at this instant",
            ),
            value: OverPoints::Integral(|point| point.state.friction_power()),
        },
        Self {
            quantity: ReportedQuantity::rotation(
                "moment",
                "N m",
                "moment of the resultant on the contactor about the origin, at the current positions; about a point \
                 c it is moment - c x force",
            ),
            value: OverPoints::OfForces(|totals| Some(totals.resultants.whole.moment())),
        },
        Self {
            quantity: ReportedQuantity::vector(
                "centre_of_pressure",
                "m",
                "mean position of the forces of the pressure, weighted by their component along their resultant; \
                 on a flat surface they have no moment about it; empty if they balance each other, and where both \
                 sides are contactors",
            ),
            value: OverPoints::OfForces(|totals| {
                let centre = totals.resultants.normal.centre().filter(|_| !totals.is_two_sided)?;
                Some(std::array::from_fn(|i| if i < D { centre[i] } else { 0.0 }))
            }),
        },
        Self {
            quantity: ReportedQuantity::number(
                "current_area",
                "m2",
                "area of the contact zone in the deformed configuration",
            ),
            value: OverPoints::Integral(|point| point.stretch),
        },
        Self {
            quantity: ReportedQuantity::number(
                "friction_work",
                "J",
                "heat from friction since the start; the sum over the contacts is `friction_dissipated` of \
                 `energy.csv`",
            ),
            value: OverPoints::Total(|totals| totals.energies.friction_work),
        },
        Self {
            quantity: ReportedQuantity::number(
                "damping_work",
                "J",
                "heat from `damping` of the contact since the start, normal and tangential; part of \
                 `damping_dissipated` of `energy.csv`",
            ),
            value: OverPoints::Total(|totals| totals.energies.damping_work),
        },
        Self {
            quantity: ReportedQuantity::number(
                "stored",
                "J",
                "energy stored by the laws of the contact at this instant; the sum over the contacts is `contact` \
                 of `energy.csv`",
            ),
            value: OverPoints::Total(|totals| totals.energies.stored),
        },
        Self {
            quantity: ReportedQuantity::number(
                "work",
                "J",
                "work of its forces on both sides together since the start: the loss of `stored`, minus \
                 `friction_work` and `damping_work`; on the bodies alone it is larger by the `work` of a moving \
                 rigid target",
            ),
            value: OverPoints::Total(|totals| totals.energies.work()),
        },
    ];

    /// Normal force.
    pub const FORCE_N: Self = Self {
        quantity: ReportedQuantity::number(
            "force_n",
            "N",
            "integral of the normal traction, positive in compression",
        ),
        value: OverPoints::Integral(|point| point.state.normal_traction),
    };

    /// Largest penetration of a point.
    pub const MAX_PENETRATION: Self = Self {
        quantity: ReportedQuantity::number("max_penetration", "m", "largest penetration of a point"),
        value: OverPoints::Largest(|point| -point.state.gap),
    };

    /// Largest depth between the points, for the record.
    pub const DEPTH_BETWEEN: Self = Self {
        quantity: ReportedQuantity::number(
            "depth_between",
            "m",
            "largest known depth below the target, also between points",
        ),
        value: OverPoints::LargestOfAll(|point| point.state.sunk),
    };

    /// Sums and maxima on this rank.
    fn tally<'a>(&self, points: impl Iterator<Item = ContactPoint<'a, D>>) -> Tally {
        let is_closed = |point: &ContactPoint<D>| point.state.is_closed();
        let sum = |sum: f64| Tally { sums: vec![sum], most: 0.0 };
        match self.value {
            OverPoints::Count(holds) => {
                sum(points.filter(is_closed).filter(|point| holds(point)).count() as f64)
            }
            OverPoints::Integral(value) => {
                sum(points.filter(is_closed).fold(0.0, |sum, point| sum + value(&point) * point.state.area))
            }
            OverPoints::VectorIntegral(value) | OverPoints::LengthOfIntegral(value) => {
                let zero = Point::<D>::zeros();
                let total =
                    points.filter(is_closed).fold(zero, |sum, point| sum + value(&point) * point.state.area);
                Tally { sums: total.iter().copied().collect(), most: 0.0 }
            }
            OverPoints::Mean { value, weight } => {
                let mut sums = vec![0.0; 2];
                points.filter(is_closed).for_each(|point| {
                    let weight = weight(&point) * point.state.area;
                    sums[0] += weight * value(&point);
                    sums[1] += weight;
                });
                Tally { sums, most: 0.0 }
            }
            OverPoints::Largest(value) => Tally {
                sums: Vec::new(),
                most: points.filter(is_closed).fold(0.0, |most, point| value(&point).max(most)),
            },
            OverPoints::LargestOfAll(value) => {
                Tally { sums: Vec::new(), most: points.fold(0.0, |most, point| value(&point).max(most)) }
            }
            OverPoints::Total(_) | OverPoints::OfForces(_) => Tally { sums: Vec::new(), most: 0.0 },
        }
    }

    /// The cells from the sums and maxima over all ranks.
    fn cells(&self, tally: &Tally, totals: &ContactTotals<D>) -> Vec<Cell<'static>> {
        match self.value {
            OverPoints::Count(_) => vec![Cell::Count(tally.sums[0] as u64)],
            OverPoints::Integral(_) | OverPoints::VectorIntegral(_) => {
                tally.sums.iter().copied().map(Cell::Number).collect()
            }
            OverPoints::LengthOfIntegral(_) => {
                vec![Cell::Number(Point::<D>::from_fn(|i, _| tally.sums[i]).norm())]
            }
            OverPoints::Mean { .. } => {
                vec![(tally.sums[1] != 0.0).then(|| tally.sums[0] / tally.sums[1]).into()]
            }
            OverPoints::Largest(_) | OverPoints::LargestOfAll(_) => vec![Cell::Number(tally.most)],
            OverPoints::Total(value) => vec![Cell::Number(value(totals))],
            OverPoints::OfForces(value) => {
                let vector = value(totals);
                let axes = self.quantity.components.axes::<D>();
                axes.map(|axis| vector.map(|vector| vector[axis]).into()).collect()
            }
        }
    }
}

/// Force on the contactor per area.
fn force<const D: usize>(state: &PointState<D>) -> Point<D> {
    state.normal * (state.normal_traction * state.flatness) + state.tangential_traction()
}

/// Partial result of a column.
struct Tally {
    sums: Vec<f64>,
    most: f64,
}

/// The quantities of one contact.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactReport {
    /// Name of the contact.
    pub name: String,
    /// Mean size of a facet of the contactor \[m\].
    pub facet: f64,
    /// Cells of each column by its name.
    values: Vec<(&'static str, Vec<Cell<'static>>)>,
}

impl ContactReport {
    /// The cells of `contact.csv` after step, time and the name of the contact.
    pub fn cells<const D: usize>(&self) -> Vec<Cell<'_>> {
        ContactColumn::<D>::TABLE.iter().flat_map(|column| self.of(column)).copied().collect()
    }

    /// A number.
    pub fn number<const D: usize>(&self, column: &ContactColumn<D>) -> f64 {
        match self.of(column) {
            [Cell::Number(value)] => *value,
            _ => 0.0,
        }
    }

    fn of<const D: usize>(&self, column: &ContactColumn<D>) -> &[Cell<'static>] {
        let found = self.values.iter().find(|(name, _)| *name == column.quantity.name);
        found.map_or(&[], |(_, cells)| cells)
    }
}

/// Resultants of each contact at the trial state of `stage`, the same on all ranks. Collective.
pub fn resultants<const D: usize>(system: &ContactSystem<D>, stage: &Stage) -> Vec<ContactResultants<D>> {
    let mut resultants = system.contact_resultants(stage);
    let sums = resultants.iter_mut().flat_map(|own| own.whole.sums().chain(own.normal.sums()));
    sum_over_ranks(system.session().world(), sums);
    resultants
}

/// Reports all contacts at the trial state of `stage`, with the same result on all ranks.
/// Collective.
///
/// `energies` and `resultants` are those of each contact.
pub fn reports<const D: usize>(
    system: &ContactSystem<D>,
    stage: &Stage,
    energies: &[ContactEnergies],
    resultants: &[ContactResultants<D>],
) -> Vec<ContactReport> {
    let world = system.session().world();
    let u = stage.trial.u.local();
    let report = |(number, contact): (usize, &LocalContact<D>)| {
        let totals = ContactTotals {
            resultants: resultants[number],
            is_two_sided: contact.is_two_sided(),
            energies: energies.get(number).copied().unwrap_or_default(),
        };
        let points = ContactPoint::all(contact, &u);
        let columns = || ContactColumn::<D>::TABLE.iter().chain([&ContactColumn::DEPTH_BETWEEN]);
        let mut tallies: Vec<Tally> = columns().map(|column| column.tally(points.iter().copied())).collect();
        sum_over_ranks(world, tallies.iter_mut().flat_map(|tally| &mut tally.sums));
        max_over_ranks(world, tallies.iter_mut().map(|tally| &mut tally.most));
        let values = columns().zip(&tallies);
        let values =
            values.map(|(column, tally)| (column.quantity.name, column.cells(tally, &totals))).collect();
        ContactReport { name: contact.name.clone(), facet: contact.facet_size, values }
    };
    system.contacts().iter().enumerate().map(report).collect()
}

/// Force of a contact on all ranks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactLoad<const D: usize> {
    /// Number of closed points that do more than touch.
    pub pressing: u64,
    /// Resultant on the contactor \[N\].
    pub force: Point<D>,
}

/// The loads of all contacts. Collective.
pub fn loads<const D: usize>(system: &ContactSystem<D>) -> Vec<ContactLoad<D>> {
    let load = |contact: &LocalContact<D>| {
        let mut pressing = 0.0;
        let mut resultant = Point::<D>::zeros();
        for state in contact.state.current.iter().filter(|state| state.is_closed()) {
            pressing += f64::from(u8::from(state.presses));
            resultant += force(state) * state.area;
        }
        let parts = std::iter::once(&mut pressing).chain(resultant.iter_mut());
        sum_over_ranks(system.session().world(), parts);
        ContactLoad { pressing: pressing as u64, force: resultant }
    };
    system.contacts().iter().map(load).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every entry reduces to as many cells as it has headings, and each by its own rule. Open
    /// points enter only the entries over all points.
    #[test]
    fn entries_reduce_by_their_rule() {
        let closed = PointState::<2> {
            gap: -2e-3,
            normal: Point::<2>::new(0.0, 1.0),
            normal_traction: 4.0,
            friction_traction: Point::<2>::new(-1.0, 0.0),
            slip_velocity: Point::<2>::new(2.0, 0.0),
            status: Status::Slip,
            area: 0.5,
            ..PointState::default()
        };
        let open = PointState::<2> { area: 7.0, sunk: 3e-3, ..PointState::default() };
        let history = History::default();
        let at = |state, x| ContactPoint {
            state,
            history: &history,
            position: Point::<2>::new(x, 0.0),
            reach: 1.0,
            stretch: 1.5,
        };
        let points = [at(&closed, 1.0), at(&open, 5.0), at(&closed, 2.0)];
        let mut resultants = ContactResultants::<2>::default();
        resultants.whole.first_moment[(1, 0)] = 6.0;
        resultants.normal.force = Point::<2>::new(0.0, 4.0);
        resultants.normal.first_moment[(1, 0)] = 6.0;
        let energies =
            ContactEnergies { stored: 0.25, stored_at_start: 2.0, friction_work: 0.75, damping_work: 0.5 };
        let totals = ContactTotals { resultants, is_two_sided: false, energies };
        let cells = |column: &ContactColumn<2>| column.cells(&column.tally(points.into_iter()), &totals);
        let mut row = Vec::new();
        for column in ContactColumn::<2>::TABLE {
            assert_eq!(
                cells(column).len(),
                column.quantity.headings::<2>().len(),
                "{}",
                column.quantity.name
            );
            row.extend(cells(column));
        }
        let numbers = |values: &[f64]| values.iter().copied().map(Cell::Number).collect::<Vec<_>>();
        assert_eq!(row[..5], numbers(&[4.0, -1.0, 4.0, -1.0, 1.0]));
        assert_eq!(row[5..8], [Cell::Count(2), Cell::Count(0), Cell::Count(2)]);
        assert_eq!(row[8..], numbers(&[2e-3, 4.0, 2.0, 6.0, 1.5, 0.0, 1.5, 0.75, 0.5, 0.25, 0.5]));
        assert_eq!(cells(&ContactColumn::DEPTH_BETWEEN), numbers(&[3e-3]));
        let mean = ContactColumn {
            quantity: ReportedQuantity::number("x", "m", "mean position"),
            value: OverPoints::Mean {
                value: |point| point.position[0],
                weight: |point| point.state.normal_traction,
            },
        };
        assert_eq!(cells(&mean), numbers(&[1.5]));
        let none: [ContactPoint<2>; 0] = [];
        assert_eq!(mean.cells(&mean.tally(none.into_iter()), &totals), [Cell::Absent]);
    }

    /// The header of `contact.csv` in 2D. In 3D it also has `force_z`.
    #[test]
    fn the_header_follows_the_contract() {
        let header = |headings: Vec<String>| headings.join(",");
        let plane =
            super::super::quantity::headings::<2>(ContactColumn::<2>::TABLE.iter().map(|c| &c.quantity));
        assert_eq!(
            header(plane),
            "force_n [N],force_x [N],force_y [N],force_t [N],area [m2],points,stick,slip,max_penetration [m],\
             max_pressure [Pa],friction_power [W],moment_z [N m],centre_of_pressure_x [m],centre_of_pressure_y [m],\
             current_area [m2],friction_work [J],damping_work [J],stored [J],work [J]"
        );
        let space =
            super::super::quantity::headings::<3>(ContactColumn::<3>::TABLE.iter().map(|c| &c.quantity));
        assert_eq!(space[1..4].join(","), "force_x [N],force_y [N],force_z [N]");
    }
}
