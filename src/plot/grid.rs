//! The fields of the last step of a run, with the pieces of all ranks merged.

use std::collections::BTreeMap;
use std::path::Path;

use super::axis::Display;
use super::shapes::is_solid;
use crate::case::Units;
use crate::error::{Error, Result};
use crate::output::vtu::VtuValues;
use crate::output::vtu_reader::{ReadPiece, VtuField, read_piece};
use crate::output::{pvd, pvtu};

/// A grid of all ranks.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Grid {
    /// Reference positions \[m\].
    pub points: Vec<[f64; 3]>,
    /// Displacements \[m\].
    pub displacement: Vec<[f64; 3]>,
    /// Points of each cell.
    pub cells: Vec<Vec<usize>>,
    /// VTK cell type of each cell.
    pub types: Vec<u8>,
    /// The scalar to show \[Pa\]: von Mises stress of each cell of the bodies, or pressure at each
    /// point of a contact surface. Empty for rigid surfaces.
    pub values: Vec<f64>,
}

impl Grid {
    /// Length of the largest displacement \[m\].
    pub fn largest_displacement(&self) -> f64 {
        self.displacement.iter().map(|u| u[0].hypot(u[1]).hypot(u[2])).fold(0.0, f64::max)
    }

    /// Diagonal of the bounding box of all reference positions \[m\]; 0 if there are no points.
    pub fn diagonal(&self) -> f64 {
        let extent = |i: usize| {
            let along = self.points.iter().map(|point| point[i]);
            along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
        };
        if self.points.is_empty() { 0.0 } else { extent(0).hypot(extent(1)).hypot(extent(2)) }
    }
}

/// The bodies and their contact surfaces at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct Shot {
    /// Time \[s\].
    pub time: f64,
    /// The bodies, one value per cell.
    pub bodies: Grid,
    /// The contact surfaces, one value per point; `None` if the case has no contact.
    pub surfaces: Option<Grid>,
    /// In 2D the surfaces of obstacles and rigid bodies, without values; `None` in a case without them.
    pub rigid: Option<Grid>,
}

impl Shot {
    /// Converts the snapshot to the units of a figure.
    pub fn shown(mut self, units: Units, display: &Display) -> Self {
        let [length, pressure, time] = ["m", "Pa", "s"].map(|si| display.factor(units, si));
        self.time *= time;
        for grid in std::iter::once(&mut self.bodies).chain(&mut self.surfaces).chain(&mut self.rigid) {
            let places = grid.points.iter_mut().chain(&mut grid.displacement);
            places.flatten().for_each(|x| *x *= length);
            grid.values.iter_mut().for_each(|value| *value *= pressure);
        }
        self
    }
}

/// Reads the last step whose files all exist and are complete; `None` if there is no such step.
/// Notes report what was left out.
pub fn last_shot(folder: &Path, notes: &mut Vec<String>) -> Option<Shot> {
    let entries = match pvd::read(&folder.join("fields.pvd")) {
        Ok(entries) => entries,
        Err(e) => {
            notes.push(format!("{e}; the deformed mesh is omitted"));
            return None;
        }
    };
    let rigid = rigid_entries(folder);
    for bodies in entries.iter().rev().filter(|entry| entry.part == 0) {
        let surface = entries.iter().find(|entry| entry.part == 1 && entry.time == bodies.time);
        match read_shot(folder, bodies, surface, &rigid, notes) {
            Ok(shot) => return Some(shot),
            Err(e) => notes.push(format!("{e}; the previous step is drawn")),
        }
    }
    None
}

/// Reads the steps nearest to the given times \[s\], or without times the first, the middle and the
/// last. Steps with missing or incomplete files are left out with a note.
pub fn shots(folder: &Path, times: &[f64], notes: &mut Vec<String>) -> Vec<Shot> {
    let entries = match pvd::read(&folder.join("fields.pvd")) {
        Ok(entries) => entries,
        Err(e) => {
            notes.push(format!("{e}; the deformed mesh is omitted"));
            return Vec::new();
        }
    };
    let bodies: Vec<&pvd::PvdEntry> = entries.iter().filter(|entry| entry.part == 0).collect();
    let Some(last) = bodies.len().checked_sub(1) else { return Vec::new() };
    let distance = |k: usize, time: f64| (bodies[k].time - time).abs();
    let nearest = |time: f64| {
        (0..=last).min_by(|&a, &b| distance(a, time).total_cmp(&distance(b, time))).unwrap_or(last)
    };
    let mut chosen: Vec<usize> = match times {
        [] => vec![0, last / 2, last],
        times => times.iter().map(|&time| nearest(time)).collect(),
    };
    chosen.sort_unstable();
    chosen.dedup();
    let rigid = rigid_entries(folder);
    let mut shots = Vec::new();
    for body in chosen.into_iter().map(|k| bodies[k]) {
        let surface = entries.iter().find(|entry| entry.part == 1 && entry.time == body.time);
        match read_shot(folder, body, surface, &rigid, notes) {
            Ok(shot) => shots.push(shot),
            Err(e) => notes.push(format!("{e}; this step is omitted")),
        }
    }
    shots
}

/// The surfaces of rigid bodies at all steps. A run without them, or of an earlier version of the program,
/// has no such series.
fn rigid_entries(folder: &Path) -> Vec<pvd::PvdEntry> {
    pvd::read(&folder.join("rigid.pvd")).unwrap_or_default()
}

fn read_shot(
    folder: &Path,
    bodies: &pvd::PvdEntry,
    surfaces: Option<&pvd::PvdEntry>,
    rigid: &[pvd::PvdEntry],
    notes: &mut Vec<String>,
) -> Result<Shot> {
    let read = |entry: &pvd::PvdEntry, value: Value| read_grid(&folder.join(&entry.file), value);
    let surfaces = surfaces.map(|entry| read(entry, Value::Pressure)).transpose()?;
    let time = bodies.time;
    let bodies = read(bodies, Value::VonMises)?;
    let is_plane = !bodies.types.iter().any(|&kind| is_solid(kind));
    let rigid = rigid.iter().find(|entry| is_plane && entry.time == time);
    let rigid = rigid.and_then(|entry| match read(entry, Value::Nothing) {
        Ok(grid) => Some(grid),
        Err(e) => {
            notes.push(format!("{e}; the rigid bodies are omitted"));
            None
        }
    });
    Ok(Shot { time, bodies, surfaces, rigid })
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Value {
    VonMises,
    Pressure,
    Nothing,
}

fn read_grid(index: &Path, value: Value) -> Result<Grid> {
    let folder = index.parent().unwrap_or(Path::new("."));
    let mut grid = Grid::default();
    let mut sewn = BTreeMap::new();
    for source in pvtu::read(index)? {
        let path = folder.join(source);
        let piece = read_piece(&path)?;
        add(&mut grid, &mut sewn, &piece, value).map_err(|e| e.within(&path.display().to_string()))?;
    }
    Ok(grid)
}

/// Adds a piece. Points with the same number are merged.
fn add(grid: &mut Grid, sewn: &mut BTreeMap<i32, usize>, piece: &ReadPiece, value: Value) -> Result<()> {
    let numbers = match piece.point_data.get("node").map(|field| &field.values) {
        Some(VtuValues::Int32(numbers)) => numbers,
        _ => return Err(Error::file("no Int32 array `node`")),
    };
    let displacement = floats(&piece.point_data, "displacement", 3)?;
    let shown = match value {
        Value::VonMises => floats(&piece.cell_data, "cauchy_stress", 6)?,
        Value::Pressure => floats(&piece.point_data, "contact_pressure", 1)?,
        Value::Nothing => &[],
    };
    let mut place = Vec::with_capacity(numbers.len());
    for (local, number) in numbers.iter().enumerate() {
        let next = grid.points.len();
        let index = *sewn.entry(*number).or_insert(next);
        if index == next {
            let u = &displacement[3 * local..3 * local + 3];
            grid.points.push(piece.points[local]);
            grid.displacement.push([u[0], u[1], u[2]]);
            if value == Value::Pressure {
                grid.values.push(shown[local]);
            }
        }
        place.push(index);
    }
    if value == Value::VonMises {
        grid.values.extend(shown.chunks_exact(6).map(von_mises));
    }
    let cells = (0..piece.types.len())
        .map(|cell| piece.cell(cell).iter().map(|&point| place[point as usize]).collect());
    grid.cells.extend(cells);
    grid.types.extend(&piece.types);
    Ok(())
}

fn floats<'a>(data: &'a BTreeMap<String, VtuField>, name: &str, components: usize) -> Result<&'a [f64]> {
    match data.get(name) {
        Some(VtuField { components: found, values: VtuValues::Float64(values) }) if *found == components => {
            Ok(values)
        }
        _ => Err(Error::file(format!("no Float64 array `{name}` of {components} components"))),
    }
}

/// Von Mises stress of a symmetric tensor xx, yy, zz, xy, yz, xz, in the same unit.
fn von_mises(stress: &[f64]) -> f64 {
    let [xx, yy, zz, xy, yz, xz] = [0, 1, 2, 3, 4, 5].map(|i| stress[i]);
    let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
    (0.5 * normal + 3.0 * (xy * xy + yz * yz + xz * xz)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uniaxial tension gives its own magnitude, pure shear its magnitude times the root of three,
    /// and hydrostatic pressure gives zero.
    #[test]
    fn von_mises_of_known_states() {
        assert_eq!(von_mises(&[-3.0, 0.0, 0.0, 0.0, 0.0, 0.0]), 3.0);
        assert!((von_mises(&[0.0, 0.0, 0.0, 0.0, 2.0, 0.0]) - 2.0 * 3f64.sqrt()).abs() < 1e-15);
        assert_eq!(von_mises(&[5.0, 5.0, 5.0, 0.0, 0.0, 0.0]), 0.0);
    }
}
