//! The fields for ParaView: the bodies and their contact surfaces, every n-th step.
//!
//! ```text
//! fields.pvd                             bodies and contact surfaces of every step (parts 0 and 1)
//! contact.pvd                            the contact surfaces alone
//! rigid.pvd                              the surfaces of obstacles and rigid bodies
//! fields/step_000010/volume.pvtu         index of the pieces, contact.pvtu and rigid.pvtu alike
//! fields/step_000010/volume_0000.vtu     the piece of rank 0, contact_0000.vtu alike
//! fields/step_000010/rigid_0000.vtu      the only piece of rigid bodies
//! ```
//!
//! Points are reference positions: warp by `displacement` to see the deformed bodies. Stress and
//! det F are constant in each element, as the element computes them. They are not smoothed across
//! bodies. A case without contact has no contact grid, and one without rigid bodies no rigid grid.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::error::Result;

pub use super::selection::{CellMaterials, Cells, GRID_FIELDS};

use super::anchor::Anchor;
use super::grids::{GridCells, GridFields};
use super::io_error::unwritable;
use super::pvd::{PvdEntry, PvdSeries};
use super::pvtu::{self, Schema};
use super::selection::{BODY, CONTACT, FieldSelection, RIGID};
use super::vtu;

/// Number of this rank and of all ranks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ranks {
    /// Number of this rank.
    pub rank: usize,
    /// Number of all ranks.
    pub size: usize,
}

/// A rank's writer of fields. It stores the constant data of the cells that it writes.
#[derive(Debug)]
pub struct FieldWriter<const D: usize> {
    folder: PathBuf,
    /// The folder as this rank sees it.
    place: Anchor,
    ranks: Ranks,
    volume: FieldSelection,
    surface: Option<FieldSelection>,
    /// On rank 0 only.
    rigid: Option<FieldSelection>,
    /// The grids of the last step that was written, which [`Self::publish`] indexes.
    written: Vec<(Grid, Schema)>,
    all: PvdSeries,
    contact: PvdSeries,
    rigid_series: PvdSeries,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Grid {
    Volume,
    Contact,
    Rigid,
}

impl Grid {
    fn name(self) -> &'static str {
        match self {
            Self::Volume => "volume",
            Self::Contact => "contact",
            Self::Rigid => "rigid",
        }
    }

    fn piece(self, rank: usize) -> String {
        format!("{}_{rank:04}.vtu", self.name())
    }
}

impl<const D: usize> FieldWriter<D> {
    /// Prepares a writer in the results folder.
    ///
    /// # Errors
    /// This rank can not open the folder.
    pub fn new(folder: &Path, ranks: Ranks, cells: &GridCells<D>) -> Result<Self> {
        let rigid = cells.rigid.filter(|_| ranks.rank == 0);
        Ok(Self {
            folder: folder.to_path_buf(),
            place: Anchor::of(folder)?,
            ranks,
            volume: FieldSelection::new(&cells.volume, BODY, ranks.rank),
            surface: cells.surface.map(|cells| FieldSelection::new(&cells, CONTACT, ranks.rank)),
            rigid: rigid.map(|cells| FieldSelection::new(&cells, RIGID, ranks.rank)),
            written: Vec::new(),
            all: PvdSeries::new(&folder.join("fields.pvd")),
            contact: PvdSeries::new(&folder.join("contact.pvd")),
            rigid_series: PvdSeries::new(&folder.join("rigid.pvd")),
        })
    }

    /// Number of steps whose fields the series lists; on rank 0 only.
    pub fn steps(&self) -> u64 {
        self.all.steps()
    }

    /// Removes entries whose files are missing from the series. Returns how many steps have
    /// disappeared since they were written. Pieces of other ranks may become visible a moment
    /// later. Rank 0 only.
    ///
    /// # Errors
    /// A series can not be written.
    pub fn drop_lost(&mut self) -> Result<u64> {
        let before = self.all.steps();
        let deadline = Instant::now() + DELAY;
        while self.ranks.size > 1 && !self.all.is_whole() && Instant::now() < deadline {
            sleep(Duration::from_millis(100));
        }
        self.all.drop_lost()?;
        self.contact.drop_lost()?;
        self.rigid_series.drop_lost()?;
        Ok(before - self.all.steps())
    }

    /// Continues the series of an earlier run from a checkpoint at `last_step` and `last_time`
    /// \[s\]. Pieces of later steps are removed, because a different number of ranks may not
    /// overwrite all of them. [`Self::drop_lost`] and [`Self::steps`] report which earlier steps
    /// are missing. Rank 0 only, before any rank writes.
    ///
    /// # Errors
    /// A series can not be read, or a piece can not be removed.
    pub fn resume(&mut self, last_step: u64, last_time: f64) -> Result<()> {
        self.all = PvdSeries::resume(&self.folder.join("fields.pvd"), last_time)?;
        self.contact = PvdSeries::resume(&self.folder.join("contact.pvd"), last_time)?;
        self.rigid_series = PvdSeries::resume(&self.folder.join("rigid.pvd"), last_time)?;
        let entries = std::fs::read_dir(self.folder.join("fields")).into_iter().flatten().flatten();
        let step = |path: &Path| path.file_name()?.to_str()?.strip_prefix("step_")?.parse::<u64>().ok();
        let later =
            entries.map(|entry| entry.path()).filter(|path| step(path).is_some_and(|step| step > last_step));
        for folder in later {
            std::fs::remove_dir_all(&folder).map_err(|e| unwritable(&folder, &e))?;
        }
        Ok(())
    }

    /// Writes this rank's pieces of a step. Every rank does so, in any order; no rank waits.
    ///
    /// # Errors
    /// A field does not fit the mesh (an internal fault), or the disk can not be written.
    pub fn write(&mut self, step: u64, fields: &GridFields) -> Result<()> {
        self.place.check()?;
        let written = self.write_pieces(step, fields);
        self.place.explain(written)
    }

    fn write_pieces(&mut self, step: u64, fields: &GridFields) -> Result<()> {
        let folder = self.folder.join(step_folder(step));
        // The results folder itself is not created here: if it was deleted, a single rank must not
        // create it again.
        make_folder(&self.folder.join("fields"))?;
        make_folder(&folder)?;
        let mut pieces = vec![(Grid::Volume, self.volume.piece::<D>(fields.volume)?)];
        let others =
            [(Grid::Contact, &self.surface, fields.surface), (Grid::Rigid, &self.rigid, fields.rigid)];
        for (grid, selection, fields) in others {
            if let (Some(selection), Some(fields)) = (selection, fields) {
                pieces.push((grid, selection.piece::<D>(fields)?));
            }
        }
        for (grid, piece) in &pieces {
            vtu::write(&folder.join(grid.piece(self.ranks.rank)), piece)?;
        }
        self.written = pieces.iter().map(|(grid, piece)| (*grid, Schema::of(piece))).collect();
        Ok(())
    }

    /// Makes a step visible by writing its indices and the series. Rank 0 only, after all ranks
    /// have returned from [`Self::write`].
    ///
    /// # Errors
    /// The disk can not be written.
    pub fn publish(&mut self, step: u64, time: f64) -> Result<()> {
        let written = self.write_indices(step, time);
        self.place.explain(written)
    }

    fn write_indices(&mut self, step: u64, time: f64) -> Result<()> {
        let mut entries = Vec::new();
        for (grid, schema) in &self.written {
            let file = format!("{}/{}.pvtu", step_folder(step), grid.name());
            let ranks = if *grid == Grid::Rigid { 1 } else { self.ranks.size };
            let sources: Vec<String> = (0..ranks).map(|rank| grid.piece(rank)).collect();
            pvtu::write(&self.folder.join(&file), schema, &sources)?;
            let alone = PvdEntry { time, part: 0, file: file.clone() };
            match grid {
                Grid::Volume => {}
                Grid::Contact => self.contact.add([alone])?,
                Grid::Rigid => {
                    self.rigid_series.add([alone])?;
                    continue;
                }
            }
            entries.push(PvdEntry { time, part: *grid as u32, file });
        }
        self.all.add(entries)
    }
}

/// Time for which rank 0 waits for pieces that other ranks have written. Network file systems cache
/// the contents of a folder for three seconds by default.
const DELAY: Duration = Duration::from_secs(4);

/// Creates a folder that another rank may already have created. This host may not see it yet,
/// although the file system already has it.
fn make_folder(path: &Path) -> Result<()> {
    let is_file = || std::fs::metadata(path).is_ok_and(|found| !found.is_dir());
    match std::fs::create_dir(path) {
        Err(e) if e.kind() != ErrorKind::AlreadyExists || is_file() => Err(unwritable(path, &e)),
        _ => Ok(()),
    }
}

fn step_folder(step: u64) -> String {
    format!("fields/step_{step:06}")
}

#[cfg(test)]
mod tests {
    use super::super::folder::tests::Scratch;
    use super::super::vtu::VtuValues;
    use super::super::vtu_reader::read_piece;
    use super::super::{pvd, pvtu};
    use super::*;
    use crate::observe::fields::{Field, FieldValues, Location};
    use crate::observe::quantity::ReportedQuantity;

    /// Two quadrilaterals side by side, six nodes. The second is written; the first belongs to
    /// another rank.
    fn two_quads(mine: &[bool]) -> Cells<'_, 2> {
        Cells {
            points: &[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 1.0], [1.0, 1.0], [2.0, 1.0]],
            node_number: &[10, 11, 12, 13, 14, 15],
            offsets: &[0, 4, 8],
            nodes: &[0, 1, 4, 3, 1, 2, 5, 4],
            vtk_types: &[9, 9],
            mine,
            group: &[0, 3],
            materials: None,
        }
    }

    fn bottom_edges(mine: &[bool]) -> Cells<'_, 2> {
        Cells { offsets: &[0, 2, 4], nodes: &[0, 1, 1, 2], vtk_types: &[3, 3], ..two_quads(mine) }
    }

    fn bodies(mine: &[bool]) -> GridCells<'_, 2> {
        GridCells { volume: two_quads(mine), surface: None, rigid: None }
    }

    fn both(mine: &[bool]) -> GridCells<'_, 2> {
        GridCells { surface: Some(bottom_edges(mine)), ..bodies(mine) }
    }

    fn body_fields(volume: &[Field]) -> GridFields<'_> {
        GridFields { volume, surface: None, rigid: None }
    }

    fn both_fields<'a>(volume: &'a [Field], surface: &'a [Field]) -> GridFields<'a> {
        GridFields { surface: Some(surface), ..body_fields(volume) }
    }

    const U: [f64; 12] = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5];
    const PER_NODE: [f64; 6] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];

    fn field(quantity: ReportedQuantity, location: Location, values: &[f64]) -> Field {
        Field { quantity, location, values: FieldValues::Numbers(values.to_vec()) }
    }

    fn displacement() -> Field {
        field(ReportedQuantity::vector("displacement", "m", ""), Location::Nodes, &U)
    }

    fn det_f(values: &[f64]) -> Field {
        field(ReportedQuantity::number("det_f", "", ""), Location::Elements, values)
    }

    fn volume_fields() -> Vec<Field> {
        let stress = &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0];
        let cauchy =
            field(ReportedQuantity::symmetric_tensor("cauchy_stress", "Pa", ""), Location::Elements, stress);
        vec![displacement(), cauchy, det_f(&[0.9, 1.1])]
    }

    fn surface_fields() -> Vec<Field> {
        let codes = FieldValues::Codes(vec![0, 1, 2, 0, 0, 0]);
        let status = Field {
            quantity: ReportedQuantity::number("status", "", ""),
            location: Location::Nodes,
            values: codes,
        };
        vec![
            displacement(),
            field(ReportedQuantity::number("slip", "m", ""), Location::Nodes, &PER_NODE),
            status,
        ]
    }

    fn float(values: &VtuValues) -> &[f64] {
        match values {
            VtuValues::Float64(values) => values,
            _ => panic!("not Float64"),
        }
    }

    /// A rank writes its own cells with the nodes that they use, renumbered, and each value stays
    /// at its node.
    #[test]
    fn writes_own_cells_with_their_values() {
        let scratch = Scratch::new("fields");
        let mine = [false, true];
        let ranks = Ranks { rank: 1, size: 2 };
        let mut writer = FieldWriter::new(&scratch.0, ranks, &both(&mine)).unwrap();
        writer.write(10, &both_fields(&volume_fields(), &surface_fields())).unwrap();
        let volume = read_piece(&scratch.0.join("fields/step_000010/volume_0001.vtu")).unwrap();
        assert_eq!(volume.points, [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [1.0, 1.0, 0.0]]);
        assert_eq!(volume.cell(0), [0, 1, 2, 3]);
        assert_eq!(volume.point_data["node"].values, VtuValues::Int32(vec![11, 12, 15, 14]));
        let u = float(&volume.point_data["displacement"].values);
        assert_eq!(u, [1.0, 1.5, 0.0, 2.0, 2.5, 0.0, 5.0, 5.5, 0.0, 4.0, 4.5, 0.0]);
        assert_eq!(float(&volume.cell_data["cauchy_stress"].values), [7.0, 8.0, 9.0, 10.0, 11.0, 12.0]);
        assert_eq!(float(&volume.cell_data["det_f"].values), [1.1]);
        assert_eq!(volume.cell_data["body"].values, VtuValues::Int32(vec![3]));
        assert_eq!(volume.cell_data["rank"].values, VtuValues::Int32(vec![1]));
        let contact = read_piece(&scratch.0.join("fields/step_000010/contact_0001.vtu")).unwrap();
        assert_eq!(contact.cell(0), [0, 1]);
        assert_eq!(contact.point_data["status"].values, VtuValues::UInt8(vec![1, 2]));
        assert_eq!(float(&contact.point_data["slip"].values), [1.0, 2.0]);
    }

    /// A rank that owns no cells writes an empty piece with the arrays of the others, and the index
    /// includes it.
    #[test]
    fn a_rank_without_cells_writes_an_empty_piece() {
        let scratch = Scratch::new("fields-empty");
        let mine = [[true, true], [false, false]];
        let mut writers = [0, 1].map(|rank| {
            let ranks = Ranks { rank, size: 2 };
            FieldWriter::new(&scratch.0, ranks, &both(&mine[rank])).unwrap()
        });
        writers
            .iter_mut()
            .for_each(|w| w.write(0, &both_fields(&volume_fields(), &surface_fields())).unwrap());
        writers[0].publish(0, 0.25).unwrap();
        let folder = scratch.0.join("fields/step_000000");
        for grid in ["volume", "contact"] {
            let sources = pvtu::read(&folder.join(format!("{grid}.pvtu"))).unwrap();
            let pieces: Vec<_> =
                sources.iter().map(|source| read_piece(&folder.join(source)).unwrap()).collect();
            assert_eq!((pieces[0].types.len(), pieces[1].types.len()), (2, 0));
            assert!(pieces[0].point_data.keys().eq(pieces[1].point_data.keys()));
            assert!(pieces[0].cell_data.keys().eq(pieces[1].cell_data.keys()));
        }
        let parts: Vec<_> =
            pvd::read(&scratch.0.join("fields.pvd")).unwrap().iter().map(|entry| entry.part).collect();
        assert_eq!(parts, [0, 1]);
        assert_eq!(pvd::read(&scratch.0.join("contact.pvd")).unwrap().len(), 1);
    }

    /// Steps whose files are missing, completely or in part, are removed from the series; the
    /// others remain.
    #[test]
    fn the_series_names_what_is_there() {
        let scratch = Scratch::new("fields-lost");
        let mine = [true, true];
        let ranks = Ranks { rank: 0, size: 1 };
        let mut writer = FieldWriter::new(&scratch.0, ranks, &both(&mine)).unwrap();
        for step in 0..4 {
            writer.write(step, &both_fields(&volume_fields(), &surface_fields())).unwrap();
            writer.publish(step, 0.5 * step as f64).unwrap();
        }
        assert_eq!((writer.drop_lost().unwrap(), writer.steps()), (0, 4));
        std::fs::remove_dir_all(scratch.0.join("fields/step_000001")).unwrap();
        std::fs::remove_file(scratch.0.join("fields/step_000002/volume_0000.vtu")).unwrap();
        assert_eq!((writer.drop_lost().unwrap(), writer.steps()), (2, 2));
        let times = |name: &str| {
            let entries = pvd::read(&scratch.0.join(name)).unwrap();
            entries.into_iter().filter(|entry| entry.part == 0).map(|entry| entry.time).collect::<Vec<_>>()
        };
        assert_eq!(times("fields.pvd"), [0.0, 1.5]);
        assert_eq!(times("contact.pvd"), [0.0, 0.5 * 2.0, 1.5]);
        std::fs::remove_dir_all(scratch.0.join("fields")).unwrap();
        writer.resume(3, 1.5).unwrap();
        assert_eq!((writer.drop_lost().unwrap(), writer.steps()), (2, 0));
    }

    /// A piece of another rank that becomes visible a moment later does not count as missing.
    #[test]
    fn late_pieces_are_waited_for() {
        let scratch = Scratch::new("fields-late");
        let writer = |rank: usize, mine: [bool; 2]| {
            FieldWriter::new(&scratch.0, Ranks { rank, size: 2 }, &bodies(&mine)).unwrap()
        };
        let mut first = writer(0, [true, false]);
        first.write(0, &body_fields(&volume_fields())).unwrap();
        first.publish(0, 0.0).unwrap();
        std::thread::scope(|scope| {
            scope.spawn(|| {
                sleep(Duration::from_millis(300));
                writer(1, [false, true]).write(0, &body_fields(&volume_fields())).unwrap();
            });
            assert_eq!((first.drop_lost().unwrap(), first.steps()), (0, 1));
        });
    }

    /// No rank creates a deleted results folder again.
    #[test]
    fn a_folder_that_is_gone_stays_so() {
        let scratch = Scratch::new("fields-moved");
        let folder = scratch.0.join("out");
        let mine = [true, true];
        std::fs::create_dir(&folder).unwrap();
        let ranks = Ranks { rank: 0, size: 1 };
        let mut writer = FieldWriter::new(&folder, ranks, &bodies(&mine)).unwrap();
        writer.write(0, &body_fields(&volume_fields())).unwrap();
        std::fs::rename(&folder, scratch.0.join("other")).unwrap();
        assert!(writer.write(1, &body_fields(&volume_fields())).unwrap_err().message.contains("out: moved"));
        assert!(!folder.exists());
    }

    /// Only the given fields are written, and no contact grid for a case without contact.
    #[test]
    fn writes_only_what_the_case_has() {
        let scratch = Scratch::new("fields-static");
        let mine = [true, true];
        let mut writer = FieldWriter::new(&scratch.0, Ranks { rank: 0, size: 1 }, &bodies(&mine)).unwrap();
        writer.write(1, &body_fields(&volume_fields())).unwrap();
        writer.publish(1, 1.0).unwrap();
        let index = std::fs::read_to_string(scratch.0.join("fields/step_000001/volume.pvtu")).unwrap();
        assert!(index.contains("displacement") && !index.contains("velocity"));
        assert!(!scratch.0.join("contact.pvd").exists());
        assert!(!scratch.0.join("fields/step_000001/contact.pvtu").exists());
    }

    /// A value that is not finite is an error that names its field, and no piece is written.
    #[test]
    fn refuses_what_is_no_number() {
        let scratch = Scratch::new("fields-nan");
        let mine = [true, true];
        let mut writer = FieldWriter::new(&scratch.0, Ranks { rank: 0, size: 1 }, &bodies(&mine)).unwrap();
        for sick in [f64::NAN, f64::INFINITY] {
            let error = writer.write(1, &body_fields(&[displacement(), det_f(&[1.0, sick])])).unwrap_err();
            assert!(error.message.contains("`det_f`") && error.exit_code() == 5, "{error}");
        }
        assert!(!scratch.0.join("fields/step_000001/volume_0000.vtu").exists());
    }

    /// A field of the wrong length is an error that names it.
    #[test]
    fn refuses_a_short_field() {
        let scratch = Scratch::new("fields-short");
        let mine = [true, true];
        let mut writer = FieldWriter::new(&scratch.0, Ranks { rank: 0, size: 1 }, &bodies(&mine)).unwrap();
        let error = writer.write(1, &body_fields(&[det_f(&[1.0])])).unwrap_err();
        assert!(error.message.contains("det_f"), "{error}");
    }
}
