//! `lines.csv`: displacement, velocity and stress at points of segments. One entry of [`LINE_COLUMNS`] is one
//! column.

use mpi::collective::SystemOperation;

use super::nodal_stress::NodalStress;
use super::quantity::{Column, ReportedQuantity, STEP, TIME, TableFile, Value};
use crate::assembly::ContactSystem;
use crate::collective::Collective;
use crate::dynamics::Stage;
use crate::element::Cauchy;
use crate::error::{Error, Result};
use crate::model::LineModel;
use crate::petsc::sum_over_ranks;
use crate::space::{ElementTree, Located, reference};
use crate::tensor::in_space;

/// The table of all segments.
pub const LINE_FILE: TableFile = TableFile {
    name: "lines.csv",
    rows: "one per step and point of a segment; the file exists only with `output: lines`",
    keys: &[
        STEP,
        TIME,
        ReportedQuantity::number("line", "", "name of the segment in the case"),
        ReportedQuantity::number("point", "", "number of the point, from 1"),
    ],
};

/// The columns of `lines.csv` after step, time, name and point.
pub const LINE_COLUMNS: &[Column<LinePoint>] = &[
    Column {
        quantity: ReportedQuantity::number(
            "distance",
            "m",
            "distance from the first point in the reference configuration",
        ),
        value: Value::Number(|point| point.distance),
    },
    Column {
        quantity: ReportedQuantity::vector("reference", "m", "position in the reference configuration"),
        value: Value::Vector(|point| point.at),
    },
    Column {
        quantity: ReportedQuantity::vector("u", "m", "displacement"),
        value: Value::Vector(|point| point.u),
    },
    Column {
        quantity: ReportedQuantity::vector("v", "m/s", "velocity; in statics the rate of the displacement"),
        value: Value::Vector(|point| point.v),
    },
    Column {
        quantity: ReportedQuantity::number(
            "stress_xx",
            "Pa",
            "Cauchy stress, as `nodal_stress` of the fields; empty without `stresses: true`",
        ),
        value: Value::Optional(|point| point.stress.as_ref().map(|s| s.0[0])),
    },
    Column {
        quantity: ReportedQuantity::number("stress_yy", "Pa", "Cauchy stress"),
        value: Value::Optional(|point| point.stress.as_ref().map(|s| s.0[1])),
    },
    Column {
        quantity: ReportedQuantity::number("stress_zz", "Pa", "Cauchy stress; in 2D across the plane"),
        value: Value::Optional(|point| point.stress.as_ref().map(|s| s.0[2])),
    },
    Column {
        quantity: ReportedQuantity::number("stress_xy", "Pa", "Cauchy stress"),
        value: Value::Optional(|point| point.stress.as_ref().map(|s| s.0[3])),
    },
    Column {
        quantity: ReportedQuantity::number("stress_yz", "Pa", "Cauchy stress; 0 in 2D"),
        value: Value::Optional(|point| point.stress.as_ref().map(|s| s.0[4])),
    },
    Column {
        quantity: ReportedQuantity::number("stress_xz", "Pa", "Cauchy stress; 0 in 2D"),
        value: Value::Optional(|point| point.stress.as_ref().map(|s| s.0[5])),
    },
    Column {
        quantity: ReportedQuantity::number("von_mises", "Pa", "von Mises stress of this tensor"),
        value: Value::Optional(|point| point.stress.as_ref().map(Cauchy::von_mises)),
    },
];

/// Values at a point of a segment, the same on all ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct LinePoint {
    /// Name of the segment.
    pub name: String,
    /// Number of the point, from 1.
    pub number: u64,
    /// Distance from the first point \[m\].
    pub distance: f64,
    /// Reference position \[m\].
    pub at: [f64; 3],
    /// Displacement \[m\].
    pub u: [f64; 3],
    /// Velocity \[m/s\].
    pub v: [f64; 3],
    /// Cauchy stress \[Pa\]; `None` if the segment asks for no stresses.
    pub stress: Option<Cauchy>,
}

/// A point of a segment, and the nodes that it is interpolated from.
#[derive(Debug, Clone, PartialEq)]
pub struct WatchedPoint {
    name: String,
    number: u64,
    distance: f64,
    at: [f64; 3],
    /// Local nodes with the values of their shape functions; empty on ranks that do not report it.
    nodes: Vec<(u32, f64)>,
    /// Whether its stress is reported.
    stresses: bool,
    /// Material of the element within its body.
    material: usize,
}

/// Finds the elements that contain the points of the segments: of several, the one with the lowest
/// number in the mesh. Collective.
///
/// # Errors
/// A point is in no element, the same on all ranks.
pub fn locate_lines<const D: usize>(
    system: &ContactSystem<D>,
    lines: &[LineModel<D>],
) -> Result<Vec<WatchedPoint>> {
    if lines.is_empty() {
        return Ok(Vec::new());
    }
    let local = system.bodies().local();
    let mut elements: Vec<u32> = (0..local.mesh.element_count() as u32).collect();
    elements.retain(|&element| local.mine[element as usize]);
    elements.sort_unstable_by_key(|&element| local.input_element[element as usize]);
    let tree = ElementTree::new(&local.mesh, elements);
    let mut watched = Vec::new();
    for line in lines {
        let of_body = |element: u32| {
            line.body.is_none_or(|body| usize::from(local.mesh.body[element as usize]) == body)
        };
        for (number, point) in (1..).zip(line.points()) {
            let found = tree.locate(of_body, &point);
            let mine = found.map_or(u32::MAX, |found| local.input_element[found.element as usize]);
            let mut chosen = 0;
            system.session().world().reduce_all(&mine, &mut chosen, SystemOperation::min());
            if chosen == u32::MAX {
                return Err(Error::case(format!("line '{}': point {number} is in no element", line.name)));
            }
            let found = found.filter(|_| mine == chosen);
            let nodes = found.map_or_else(Vec::new, |found| weights(system, &found));
            let material =
                found.map_or(0, |found| system.bodies().materials().within(found.element as usize));
            let distance = line.distance(number);
            watched.push(WatchedPoint {
                name: line.name.clone(),
                number,
                distance,
                at: in_space(&point),
                nodes,
                stresses: line.stresses,
                material,
            });
        }
    }
    Ok(watched)
}

/// Local nodes of an element with the values of their shape functions.
fn weights<const D: usize>(system: &ContactSystem<D>, found: &Located) -> Vec<(u32, f64)> {
    let mesh = &system.bodies().local().mesh;
    let nodes = mesh.element_nodes(found.element as usize);
    let mut shape = vec![0.0; nodes.len()];
    reference(mesh.kinds[found.element as usize]).shape(&found.coordinates, &mut shape);
    nodes.iter().copied().zip(shape).collect()
}

/// Values of all points at the trial state, the same on all ranks. Collective.
///
/// # Errors
/// If a PETSc call fails.
pub fn report<const D: usize>(
    system: &ContactSystem<D>,
    watched: &[WatchedPoint],
    stage: &Stage,
) -> Result<Vec<LinePoint>> {
    if watched.is_empty() {
        return Ok(Vec::new());
    }
    let materials = system.bodies().materials().most();
    let wants_stress = watched.iter().any(|point| point.stresses);
    let stresses = if wants_stress { NodalStress::of_state(system, stage)? } else { Vec::new() };
    let stress = |point: &WatchedPoint| {
        let mut sum = [0.0; 6];
        for &(node, weight) in &point.nodes {
            let own = &stresses[node as usize * materials + point.material].0;
            sum.iter_mut().zip(own).for_each(|(sum, value)| *sum += weight * value);
        }
        Cauchy(sum)
    };
    let (u, v) = (stage.trial.u.local(), stage.trial.v.local());
    let at = |point: &WatchedPoint, field: &[f64]| {
        let mut sum = [0.0; 3];
        for &(node, weight) in &point.nodes {
            (0..D).for_each(|i| sum[i] += weight * field[node as usize * D + i]);
        }
        sum
    };
    let value = |point: &WatchedPoint| LinePoint {
        name: point.name.clone(),
        number: point.number,
        distance: point.distance,
        at: point.at,
        u: at(point, &u),
        v: at(point, &v),
        stress: point.stresses.then(|| stress(point)),
    };
    let mut points: Vec<LinePoint> = watched.iter().map(value).collect();
    let sums = points.iter_mut().flat_map(|point| {
        let stress = point.stress.iter_mut().flat_map(|stress| &mut stress.0);
        point.u.iter_mut().chain(&mut point.v).chain(stress)
    });
    sum_over_ranks(system.session().world(), sums);
    Ok(points)
}
