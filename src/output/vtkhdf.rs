//! The fields of a run in one file: VTKHDF, which ParaView 5.12 and VTK 9.3 or newer read.
//!
//! ```text
//! fields.vtkhdf      the bodies of all steps
//! contact.vtkhdf     the contact surfaces of all steps
//! rigid.vtkhdf       the surfaces of obstacles and rigid bodies, written by rank 0
//! ```
//!
//! A file is an unstructured grid of version 2.0 of the format, with one part for each rank and the
//! steps of the group `Steps`. The mesh is written once by each process of a run, the fields at each
//! step. All ranks write together.
//!
//! A step appears when `NSteps` is increased, which is written last, after everything else is on the
//! disk. Between two outputs the file is closed. So a run that is killed leaves a file with all steps
//! up to then, except when it is killed in the moment in which HDF5 renews its tables on the disk.

use std::collections::BTreeMap;
use std::fs::OpenOptions;
use std::path::{Path, PathBuf};

use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, Root};
use nix::errno::Errno;
use nix::fcntl::posix_fallocate;

use super::anchor::Anchor;
use super::fields::Ranks;
use super::grids::{GridCells, GridFields};
use super::io_error::unwritable;
use super::selection::{BODY, CONTACT, Cells, FieldSelection, RIGID};
use super::vtu::{Array, VtuPiece, VtuValues};
use crate::collective::Collective;
use crate::error::{Error, Result, agree};
use crate::observe::fields::Field;
use crate::petsc::{Hdf5File, NumberType, Rows, Width};

/// The file of the bodies.
pub const FIELDS_FILE: &str = "fields.vtkhdf";

/// The file of the contact surfaces.
pub const CONTACT_FILE: &str = "contact.vtkhdf";

/// The file of the surfaces of rigid bodies.
pub const RIGID_FILE: &str = "rigid.vtkhdf";

/// Version of the format.
const VERSION: [i64; 2] = [2, 0];

/// Most rows by which a dataset grows on the disk: 0.5 MB of numbers, 1.5 MB of vectors. Smaller grids
/// grow by a step. With half of it a large step needs twice as many entries in HDF5's tables.
const LARGEST_CHUNK: u64 = 65_536;

/// Rows by which the lists with one row per step or rank grow: 0.5 kB. Half of it saves nothing that
/// can be measured, and twice of it makes the file of a short run larger by 20 kB.
const STEP_CHUNK: u64 = 64;

/// Space for HDF5's tables and the lists of steps, for each dataset and output \[bytes\]. A new node of a
/// table is 2 to 3 kB, a new chunk of a list 0.5 kB. With half of it, outputs on a full disk are still
/// refused in time; twice of it only refuses earlier.
const TABLES: u64 = 16_384;

/// The cure if the file of an earlier run can not be continued.
const CURE: &str = "remove this file to resume without the fields that it holds, or start again without \
                    --restart";

/// Lists with one row for each part, that is for each rank that wrote a mesh.
const PART_LISTS: [&str; 3] = ["NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"];

/// A rank's writer of fields in one file per grid. All functions are collective.
pub struct OneFileWriter<const D: usize> {
    /// The folder as this rank sees it.
    place: Anchor,
    volume: GridFile,
    surface: Option<GridFile>,
    rigid: Option<GridFile>,
}

impl<const D: usize> OneFileWriter<D> {
    /// Prepares a writer in the results folder.
    ///
    /// # Errors
    /// This rank can not open the folder.
    pub fn new(folder: &Path, ranks: Ranks, cells: &GridCells<D>) -> Result<Self> {
        let file = |name: &str, cells: Cells<D>, group| {
            GridFile::new(folder.join(name), FieldSelection::new(&cells, group, ranks.rank))
        };
        Ok(Self {
            place: Anchor::of(folder)?,
            volume: file(FIELDS_FILE, cells.volume, BODY),
            surface: cells.surface.map(|cells| file(CONTACT_FILE, cells, CONTACT)),
            rigid: cells.rigid.map(|cells| file(RIGID_FILE, cells, RIGID)),
        })
    }

    /// Number of steps in the file.
    pub fn steps(&self) -> u64 {
        self.volume.steps
    }

    /// Number of steps that were written and whose file has disappeared. Rank 0 only.
    pub fn lost(&mut self) -> u64 {
        if self.volume.path.exists() { 0 } else { std::mem::take(&mut self.volume.steps) }
    }

    /// Continues the files of an earlier run from a checkpoint at `last_time` \[s\], without the later
    /// steps. A run without such a file begins a new one. Collective.
    ///
    /// # Errors
    /// A file is damaged.
    pub fn resume(&mut self, world: &SimpleCommunicator, last_time: f64) -> Result<()> {
        self.volume.resume(world, last_time)?;
        [&mut self.surface, &mut self.rigid]
            .into_iter()
            .flatten()
            .try_for_each(|file| file.resume(world, last_time))
    }

    /// Adds a step at `time` \[s\]. Collective.
    ///
    /// # Errors
    /// A field does not fit the mesh (an internal fault) or is not finite, or the disk can not be
    /// written. The error is the same on all ranks.
    pub fn write(&mut self, world: &SimpleCommunicator, time: f64, fields: &GridFields) -> Result<()> {
        agree(world, self.place.check())?;
        let mut written = self.volume.write::<D>(world, time, fields.volume);
        let others = [(&mut self.surface, fields.surface), (&mut self.rigid, fields.rigid)];
        for (file, fields) in others {
            if let (Ok(()), Some(file), Some(fields)) = (&written, file, fields) {
                written = file.write::<D>(world, time, fields);
            }
        }
        agree(world, self.place.explain(written))
    }
}

/// Where the mesh of this process begins in its file.
#[derive(Debug, Clone, Copy)]
struct MeshStart {
    part: u64,
    point: u64,
    cell: u64,
    connectivity: u64,
}

/// The file of one grid.
struct GridFile {
    path: PathBuf,
    selection: FieldSelection,
    /// Number of steps in the file.
    steps: u64,
    /// Number of used rows of each dataset; empty if there is no file yet.
    ends: BTreeMap<String, u64>,
    /// Whether the file is that of an earlier run.
    continues: bool,
    /// The mesh of this process; `None` until it is written.
    mesh: Option<MeshStart>,
}

/// A dataset with the rows of this rank.
struct Dataset<'a> {
    name: String,
    width: Width,
    rows: Rows<'a>,
    /// The entities to which the rows belong.
    of: Entity,
}

/// What the rows of a dataset belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Entity {
    Point,
    Cell,
    /// Cells and, for each part, the end of the last one.
    CellEnd,
    Connectivity,
}

/// Numbers of points, cells and points of cells on the ranks.
struct Sizes {
    /// Of each rank, three after another.
    all: Vec<u64>,
    rank: usize,
}

impl Sizes {
    fn of(world: &SimpleCommunicator, piece: &VtuPiece) -> Self {
        let own =
            [piece.points.values.len() / 3, piece.types.len(), piece.connectivity.len()].map(|n| n as u64);
        let mut all = vec![0; 3 * world.size() as usize];
        world.gather_all(&own, &mut all[..]);
        Self { all, rank: world.rank() as usize }
    }

    fn ranks(&self) -> usize {
        self.all.len() / 3
    }

    fn sum(&self, of: Entity, ranks: usize) -> u64 {
        let sum = |k: usize| self.all.chunks_exact(3).take(ranks).map(|sizes| sizes[k]).sum::<u64>();
        match of {
            Entity::Point => sum(0),
            Entity::Cell => sum(1),
            Entity::CellEnd => sum(1) + ranks as u64,
            Entity::Connectivity => sum(2),
        }
    }

    fn before(&self, of: Entity) -> u64 {
        self.sum(of, self.rank)
    }

    fn total(&self, of: Entity) -> u64 {
        self.sum(of, self.ranks())
    }
}

fn rows(values: &VtuValues) -> Rows<'_> {
    match values {
        VtuValues::Float64(values) => Rows::Float64(values),
        VtuValues::Int32(values) => Rows::Int32(values),
        VtuValues::UInt8(values) => Rows::UInt8(values),
    }
}

fn path_in_file(of: Entity, name: &str) -> String {
    format!("VTKHDF/{}/{name}", if of == Entity::Point { "PointData" } else { "CellData" })
}

/// The list of the first row of an array at each step.
fn offsets_in_file(array: &str) -> String {
    let (group, name) = array.trim_start_matches("VTKHDF/").split_once('/').unwrap_or_default();
    format!("VTKHDF/Steps/{group}Offsets/{name}")
}

fn datasets_of<'a>(arrays: &'a [Array], of: Entity) -> impl Iterator<Item = Dataset<'a>> {
    arrays.iter().map(move |array| Dataset {
        name: path_in_file(of, array.name),
        width: if array.components == 1 { Width::List } else { Width::Table(array.components as u64) },
        rows: rows(&array.values),
        of,
    })
}

impl GridFile {
    fn new(path: PathBuf, selection: FieldSelection) -> Self {
        Self { path, selection, steps: 0, ends: BTreeMap::new(), continues: false, mesh: None }
    }

    /// The piece of this rank, whose values are finite on all ranks.
    fn piece<const D: usize>(&self, world: &SimpleCommunicator, fields: &[Field]) -> Result<VtuPiece> {
        let own = self.selection.piece::<D>(fields).and_then(|piece| {
            piece.require_sound(&self.path)?;
            Ok(piece)
        });
        agree(world, own)
    }

    fn write<const D: usize>(
        &mut self,
        world: &SimpleCommunicator,
        time: f64,
        fields: &[Field],
    ) -> Result<()> {
        let piece = self.piece::<D>(world, fields)?;
        let sizes = Sizes::of(world, &piece);
        let arrays = self.selection.constant_arrays();
        let ids = |values: &[i32]| values.iter().map(|&id| i64::from(id)).collect::<Vec<_>>();
        let connectivity = ids(&piece.connectivity);
        let offsets: Vec<i64> = std::iter::once(0).chain(ids(&piece.offsets)).collect();
        let mesh = mesh_datasets(&piece, &connectivity, &offsets);
        let constant = data_datasets(&piece, 0..arrays[0], 0..arrays[1]);
        let varying =
            data_datasets(&piece, arrays[0]..piece.point_data.len(), arrays[1]..piece.cell_data.len());
        let new_mesh = if self.mesh.is_none() { &mesh[..] } else { &[] };
        let new_constant = if self.mesh.is_none() { &constant[..] } else { &[] };
        let added = new_mesh.iter().chain(new_constant).chain(&varying);
        let lists = mesh.len() + constant.len() + varying.len() + STEP_LISTS.len() + PART_LISTS.len();
        let needed = added.map(|dataset| growth(dataset, &sizes)).sum::<u64>() + lists as u64 * TABLES;
        agree(world, if sizes.rank == 0 { require_space(&self.path, needed) } else { Ok(()) })?;
        let begins = self.ends.is_empty();
        let file = if begins && !self.continues {
            let file = Hdf5File::create(world, &self.path)?;
            self.create(&file, &sizes, &mesh, [&constant, &varying])?;
            file
        } else {
            Hdf5File::open(world, &self.path)?
        };
        if begins && self.continues {
            self.trim(&file, &piece)?;
        }
        if self.mesh.is_none() {
            let end = |name: &str| self.ends.get(&format!("VTKHDF/{name}")).copied().unwrap_or(0);
            let start = MeshStart {
                part: end(PART_LISTS[0]),
                point: end("Points"),
                cell: end("Types"),
                connectivity: end("Connectivity"),
            };
            for (k, name) in PART_LISTS.iter().enumerate() {
                let name = format!("VTKHDF/{name}");
                file.set_rows(&name, start.part + sizes.ranks() as u64)?;
                let own = [sizes.all[3 * sizes.rank + k] as i64];
                file.write(&name, start.part + sizes.rank as u64, Rows::Int64(&own))?;
                self.ends.insert(name, start.part + sizes.ranks() as u64);
            }
            for dataset in mesh.iter().chain(&constant) {
                self.append(&file, dataset, &sizes)?;
            }
            self.mesh = Some(start);
        }
        for dataset in &varying {
            self.append(&file, dataset, &sizes)?;
        }
        self.add_step(&file, time, &sizes, constant.iter().chain(&varying))?;
        file.flush()?;
        self.steps += 1;
        file.change_integer("VTKHDF/Steps", "NSteps", self.steps as i64)?;
        file.close()
    }

    /// Creates all groups and datasets, without rows.
    fn create(
        &mut self,
        file: &Hdf5File,
        sizes: &Sizes,
        mesh: &[Dataset],
        data: [&[Dataset]; 2],
    ) -> Result<()> {
        for group in [
            "VTKHDF",
            "VTKHDF/PointData",
            "VTKHDF/CellData",
            "VTKHDF/Steps",
            "VTKHDF/Steps/PointDataOffsets",
            "VTKHDF/Steps/CellDataOffsets",
        ] {
            file.create_group(group)?;
        }
        file.set_integers("VTKHDF", "Version", &VERSION)?;
        file.set_text("VTKHDF", "Type", "UnstructuredGrid")?;
        file.set_integers("VTKHDF/Steps", "NSteps", &[0])?;
        for name in PART_LISTS {
            let name = format!("VTKHDF/{name}");
            file.create_dataset(&name, NumberType::Int64, Width::List, STEP_CHUNK)?;
            self.ends.insert(name, 0);
        }
        for dataset in mesh.iter().chain(data.into_iter().flatten()) {
            let chunk = sizes.total(dataset.of).min(LARGEST_CHUNK);
            file.create_dataset(&dataset.name, dataset.rows.number_type(), dataset.width, chunk)?;
            self.ends.insert(dataset.name.clone(), 0);
        }
        file.create_dataset("VTKHDF/Steps/Values", NumberType::Float64, Width::List, STEP_CHUNK)?;
        for (name, width) in STEP_LISTS {
            let name = format!("VTKHDF/Steps/{name}");
            file.create_dataset(&name, NumberType::Int64, width, STEP_CHUNK)?;
        }
        for dataset in data.into_iter().flatten() {
            let name = offsets_in_file(&dataset.name);
            file.create_dataset(&name, NumberType::Int64, Width::List, STEP_CHUNK)?;
        }
        Ok(())
    }

    /// Adds the rows of all ranks to a dataset, in the order of the ranks.
    fn append(&mut self, file: &Hdf5File, dataset: &Dataset, sizes: &Sizes) -> Result<()> {
        let end = self.ends.entry(dataset.name.clone()).or_default();
        let start = *end;
        *end += sizes.total(dataset.of);
        file.set_rows(&dataset.name, *end)?;
        file.write(&dataset.name, start + sizes.before(dataset.of), dataset.rows)
    }

    /// Writes the row of a step into all lists of the group `Steps`. Rank 0 has the numbers.
    fn add_step<'a>(
        &self,
        file: &Hdf5File,
        time: f64,
        sizes: &Sizes,
        data: impl Iterator<Item = &'a Dataset<'a>>,
    ) -> Result<()> {
        let mesh = self.mesh.ok_or_else(|| Error::internal("a step of fields without a mesh"))?;
        let own = if sizes.rank == 0 { 1 } else { 0 };
        let step = self.steps;
        let list = |name: &str, value: u64| {
            file.set_rows(name, step + 1)?;
            file.write(name, step, Rows::Int64(&[value as i64][..own]))
        };
        file.set_rows("VTKHDF/Steps/Values", step + 1)?;
        file.write("VTKHDF/Steps/Values", step, Rows::Float64(&[time][..own]))?;
        let values = [mesh.part, sizes.ranks() as u64, mesh.point, mesh.cell, mesh.connectivity];
        for ((name, _), value) in STEP_LISTS.iter().zip(values) {
            list(&format!("VTKHDF/Steps/{name}"), value)?;
        }
        for dataset in data {
            let end = self.ends.get(&dataset.name).copied().unwrap_or(0);
            list(&offsets_in_file(&dataset.name), end - sizes.total(dataset.of))?;
        }
        Ok(())
    }

    /// Removes the steps after `last_time` \[s\] from the list of steps. [`Self::trim`] removes their
    /// rows before the next step is written.
    fn resume(&mut self, world: &SimpleCommunicator, last_time: f64) -> Result<()> {
        // A run that ended before its first output may leave an empty file.
        let mut is_there = [u8::from(std::fs::metadata(&self.path).is_ok_and(|file| file.len() > 0))];
        world.process_at_rank(0).broadcast_into(&mut is_there[..]);
        if is_there == [0] {
            return Ok(());
        }
        let kept = Hdf5File::open(world, &self.path).and_then(|file| {
            let steps = file.integer("VTKHDF/Steps", "NSteps")?;
            let steps = usize::try_from(steps).map_err(|_| Error::file("a negative number of steps"))?;
            let times = file.floats("VTKHDF/Steps/Values", 0, steps)?;
            let kept = times.iter().take_while(|&&time| time <= last_time).count() as u64;
            file.change_integer("VTKHDF/Steps", "NSteps", kept as i64)?;
            file.close()?;
            Ok(kept)
        });
        self.steps = kept.map_err(|error| error.hint(CURE))?;
        self.continues = true;
        Ok(())
    }

    /// Removes all rows that no step uses from an open file, and finds where the next step begins.
    fn trim(&mut self, file: &Hdf5File, piece: &VtuPiece) -> Result<()> {
        let mesh = mesh_datasets(piece, &[], &[]);
        let data = data_datasets(piece, 0..piece.point_data.len(), 0..piece.cell_data.len());
        let mut same = true;
        for (group, count) in
            [("VTKHDF/PointData", piece.point_data.len()), ("VTKHDF/CellData", piece.cell_data.len())]
        {
            same &= file.members(group)? == count as u64;
        }
        for dataset in mesh.iter().chain(&data) {
            same = same
                && file.has(&dataset.name)?
                && file.rows(&dataset.name, dataset.rows.number_type(), dataset.width)?.1;
        }
        if !same {
            let text = format!("{}: its fields are not those of the case", self.path.display());
            return Err(Error::file(text).hint(CURE));
        }
        let steps = self.steps;
        let last = |name: &str| match steps.checked_sub(1) {
            Some(step) => Ok(file.integers(name, step, 1)?[0] as u64),
            None => Ok(0),
        };
        let part = last("VTKHDF/Steps/PartOffsets")?;
        let parts = last("VTKHDF/Steps/NumberOfParts")?;
        let mut totals = [0; 3];
        for (total, name) in totals.iter_mut().zip(PART_LISTS) {
            let name = format!("VTKHDF/{name}");
            *total = file.integers(&name, part, parts as usize)?.iter().map(|&n| n as u64).sum::<u64>();
            file.set_rows(&name, part + parts)?;
            self.ends.insert(name, part + parts);
        }
        let [points, cells, connectivity] = totals;
        let cell = last("VTKHDF/Steps/CellOffsets")?;
        for dataset in &mesh {
            let end = match dataset.of {
                Entity::Point => last("VTKHDF/Steps/PointOffsets")? + points,
                Entity::Cell => cell + cells,
                Entity::CellEnd => cell + cells + part + parts,
                Entity::Connectivity => last("VTKHDF/Steps/ConnectivityIdOffsets")? + connectivity,
            };
            file.set_rows(&dataset.name, end)?;
            self.ends.insert(dataset.name.clone(), end);
        }
        for dataset in &data {
            let offsets = offsets_in_file(&dataset.name);
            let end = last(&offsets)? + if dataset.of == Entity::Point { points } else { cells };
            file.set_rows(&offsets, steps)?;
            file.set_rows(&dataset.name, end)?;
            self.ends.insert(dataset.name.clone(), end);
        }
        file.set_rows("VTKHDF/Steps/Values", steps)?;
        for (name, _) in STEP_LISTS {
            file.set_rows(&format!("VTKHDF/Steps/{name}"), steps)?;
        }
        Ok(())
    }
}

/// Largest growth of a file by the rows of all ranks in a dataset \[bytes\].
fn growth(dataset: &Dataset, sizes: &Sizes) -> u64 {
    let rows = sizes.total(dataset.of);
    let chunk = rows.clamp(1, LARGEST_CHUNK);
    (rows / chunk + 2) * chunk * dataset.width.numbers() * dataset.rows.number_type().bytes()
}

/// Reserves space on the disk behind the end of a file.
///
/// If HDF5 itself runs out of space, the steps that were written before can be lost, and ranks can
/// wait for each other for ever. The file loses what it does not need when HDF5 closes it.
///
/// # Errors
/// There is too little space. The file has not changed.
fn require_space(path: &Path, bytes: u64) -> Result<()> {
    let reserved = || {
        let file = OpenOptions::new().write(true).create(true).truncate(false).open(path)?;
        let size = file.metadata()?.len();
        let [from, more] = [size, bytes].map(|n| i64::try_from(n).unwrap_or(i64::MAX));
        match posix_fallocate(&file, from, more) {
            // Some file systems can not reserve space.
            Ok(()) | Err(Errno::EOPNOTSUPP | Errno::EINVAL) => Ok(()),
            Err(error) => file.set_len(size).and(Err(error.into())),
        }
    };
    reserved().map_err(|error: std::io::Error| unwritable(path, &error))
}

/// Lists of integers in the group `Steps`. Those of cells have a column for each kind of topology, of
/// which an unstructured grid has one.
const STEP_LISTS: [(&str, Width); 5] = [
    ("PartOffsets", Width::List),
    ("NumberOfParts", Width::List),
    ("PointOffsets", Width::List),
    ("CellOffsets", Width::Table(1)),
    ("ConnectivityIdOffsets", Width::Table(1)),
];

fn mesh_datasets<'a>(piece: &'a VtuPiece, connectivity: &'a [i64], offsets: &'a [i64]) -> [Dataset<'a>; 4] {
    let list =
        |name: &str, rows, of| Dataset { name: format!("VTKHDF/{name}"), width: Width::List, rows, of };
    let points = list("Points", rows(&piece.points.values), Entity::Point);
    [
        Dataset { width: Width::Table(3), ..points },
        list("Connectivity", Rows::Int64(connectivity), Entity::Connectivity),
        list("Offsets", Rows::Int64(offsets), Entity::CellEnd),
        list("Types", Rows::UInt8(&piece.types), Entity::Cell),
    ]
}

fn data_datasets(
    piece: &VtuPiece,
    on_points: std::ops::Range<usize>,
    on_cells: std::ops::Range<usize>,
) -> Vec<Dataset<'_>> {
    let on_points = datasets_of(&piece.point_data[on_points], Entity::Point);
    on_points.chain(datasets_of(&piece.cell_data[on_cells], Entity::Cell)).collect()
}
