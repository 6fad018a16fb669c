//! Reads back what [`super::vtu`] wrote. The reader is strict: it accepts pieces of this program,
//! not every VTU file.

use std::collections::BTreeMap;
use std::path::Path;

use crate::error::{Error, Result};
use crate::files;

use super::io_error::trouble;
use super::vtu::VtuValues;
use super::xml::{Tag, tags};

/// An array as it was read.
#[derive(Debug, Clone, PartialEq)]
pub struct VtuField {
    /// Values per entity.
    pub components: usize,
    /// The numbers, entity by entity.
    pub values: VtuValues,
}

/// One piece as it was read.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReadPiece {
    /// Reference positions \[m\].
    pub points: Vec<[f64; 3]>,
    /// Points of all cells, one cell after the other.
    pub connectivity: Vec<i32>,
    /// End of each cell in `connectivity`.
    pub offsets: Vec<i32>,
    /// VTK cell type of each cell.
    pub types: Vec<u8>,
    /// Arrays on points by name.
    pub point_data: BTreeMap<String, VtuField>,
    /// Arrays on cells by name.
    pub cell_data: BTreeMap<String, VtuField>,
}

impl ReadPiece {
    /// The points of a cell.
    pub fn cell(&self, cell: usize) -> &[i32] {
        let start = cell.checked_sub(1).map_or(0, |before| self.offsets[before] as usize);
        &self.connectivity[start..self.offsets[cell] as usize]
    }
}

/// Reads a piece.
///
/// # Errors
/// The file is missing, truncated, or was not written by this program. The message names the file
/// and the fault.
pub fn read_piece(path: &Path) -> Result<ReadPiece> {
    let bytes = files::read(path, files::LONGEST_TABLE).map_err(|e| trouble(path, "read", &e))?;
    parse(&bytes).map_err(|e| e.within(&path.display().to_string()))
}

/// Reads a piece from the bytes of a file, see [`read_piece`].
///
/// # Errors
/// See [`read_piece`]; the message does not name the file.
pub fn parse(bytes: &[u8]) -> Result<ReadPiece> {
    let tags = tags(bytes, "AppendedData")?;
    check_encoding(&tags)?;
    let mark = tags.last().map_or(0, |tag| tag.end);
    let start = bytes[mark..].iter().position(|&b| b == b'_').map(|at| mark + at + 1);
    let raw = &bytes[start.ok_or_else(|| Error::file("truncated before the data"))?..];
    let piece = only(&tags, "Piece")?;
    let (points, cells) = (piece.number("NumberOfPoints")?, piece.number("NumberOfCells")?);
    let mut sections = read_sections(&tags, raw)?;
    let mut take = |section: &str| sections.remove(section).unwrap_or_default();
    let (mut positions, mut topology) = (take("Points"), take("Cells"));
    let grid = ReadPiece {
        points: floats(positions.remove("Points"), "Points")?
            .chunks_exact(3)
            .map(|p| [p[0], p[1], p[2]])
            .collect(),
        connectivity: numbers(topology.remove("connectivity"), "connectivity")?,
        offsets: numbers(topology.remove("offsets"), "offsets")?,
        types: codes(topology.remove("types"), "types")?,
        point_data: take("PointData"),
        cell_data: take("CellData"),
    };
    check_grid(&grid, points, cells)?;
    Ok(grid)
}

fn check_encoding(tags: &[Tag]) -> Result<()> {
    let file = only(tags, "VTKFile")?;
    let expected = [("type", "UnstructuredGrid"), ("byte_order", "LittleEndian"), ("header_type", "UInt64")];
    for (key, value) in expected {
        if file.get(key)? != value {
            return Err(Error::file(format!("`{key}` is not {value}")));
        }
    }
    match tags.last().and_then(|tag| tag.find("encoding")) {
        Some("raw") => Ok(()),
        _ => Err(Error::file("the appended data is not raw")),
    }
}

fn only<'a>(tags: &'a [Tag], name: &str) -> Result<&'a Tag> {
    let mut found = tags.iter().filter(|tag| tag.name == name);
    match (found.next(), found.next()) {
        (Some(tag), None) => Ok(tag),
        _ => Err(Error::file(format!("expected exactly one <{name}>"))),
    }
}

type Sections = BTreeMap<String, BTreeMap<String, VtuField>>;

fn read_sections(tags: &[Tag], raw: &[u8]) -> Result<Sections> {
    let mut sections = Sections::new();
    let mut section = String::new();
    for tag in tags {
        match tag.name.as_str() {
            "Points" | "Cells" | "PointData" | "CellData" => section = tag.name.clone(),
            "DataArray" => {
                let name = tag.get("Name")?.to_string();
                let field = read_field(tag, raw).map_err(|e| e.within(&format!("array `{name}`")))?;
                sections.entry(section.clone()).or_default().insert(name, field);
            }
            _ => {}
        }
    }
    Ok(sections)
}

fn read_field(tag: &Tag, raw: &[u8]) -> Result<VtuField> {
    let cut = || Error::file("truncated");
    let offset: usize = tag.number("offset")?;
    let components =
        if tag.find("NumberOfComponents").is_some() { tag.number("NumberOfComponents")? } else { 1 };
    let block = raw.get(offset..).and_then(|rest| rest.split_first_chunk::<8>()).ok_or_else(cut)?;
    let length = usize::try_from(u64::from_le_bytes(*block.0)).map_err(|_| cut())?;
    let data = block.1.get(..length).ok_or_else(cut)?;
    let values = match tag.get("type")? {
        "Float64" => VtuValues::Float64(decode(data, f64::from_le_bytes)?),
        "Int32" => VtuValues::Int32(decode(data, i32::from_le_bytes)?),
        "UInt8" => VtuValues::UInt8(data.to_vec()),
        other => return Err(Error::file(format!("unknown type {other}"))),
    };
    Ok(VtuField { components, values })
}

fn decode<T, const N: usize>(data: &[u8], number: fn([u8; N]) -> T) -> Result<Vec<T>> {
    let (chunks, rest) = data.as_chunks::<N>();
    if !rest.is_empty() {
        return Err(Error::file("a number is truncated"));
    }
    Ok(chunks.iter().map(|&chunk| number(chunk)).collect())
}

fn floats(field: Option<VtuField>, name: &str) -> Result<Vec<f64>> {
    match field.map(|field| field.values) {
        Some(VtuValues::Float64(values)) => Ok(values),
        _ => Err(Error::file(format!("no Float64 array `{name}`"))),
    }
}

fn numbers(field: Option<VtuField>, name: &str) -> Result<Vec<i32>> {
    match field.map(|field| field.values) {
        Some(VtuValues::Int32(values)) => Ok(values),
        _ => Err(Error::file(format!("no Int32 array `{name}`"))),
    }
}

fn codes(field: Option<VtuField>, name: &str) -> Result<Vec<u8>> {
    match field.map(|field| field.values) {
        Some(VtuValues::UInt8(values)) => Ok(values),
        _ => Err(Error::file(format!("no UInt8 array `{name}`"))),
    }
}

fn check_grid(grid: &ReadPiece, points: usize, cells: usize) -> Result<()> {
    let ends = std::iter::once(&0).chain(&grid.offsets);
    let is_sound = grid.points.len() == points
        && grid.types.len() == cells
        && grid.offsets.len() == cells
        && ends.zip(&grid.offsets).all(|(start, end)| start <= end)
        && grid.offsets.last().copied().unwrap_or(0) as usize == grid.connectivity.len()
        && grid.connectivity.iter().all(|&point| usize::try_from(point).is_ok_and(|point| point < points));
    if !is_sound {
        return Err(Error::file("cells, offsets and points do not fit each other"));
    }
    let on = |data: &BTreeMap<String, VtuField>, count: usize| {
        data.iter()
            .find(|(_, field)| count.checked_mul(field.components) != Some(field.values.len()))
            .map(|(name, _)| name.clone())
    };
    match on(&grid.point_data, points).or(on(&grid.cell_data, cells)) {
        Some(name) => Err(Error::file(format!("array `{name}` does not fit the grid"))),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::folder::tests::Scratch;
    use super::super::vtu::{tests::sample, write};
    use super::*;

    /// A file that is truncated anywhere before its last number is an error, not a panic.
    #[test]
    fn refuses_every_truncation() {
        let scratch = Scratch::new("vtu-cut");
        let path = scratch.0.join("a.vtu");
        write(&path, &sample()).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let tail = b"\n</AppendedData>\n</VTKFile>\n".len();
        assert!(parse(&bytes[..bytes.len() - tail]).is_ok());
        for length in 0..bytes.len() - tail {
            assert!(parse(&bytes[..length]).is_err(), "{length} of {} bytes", bytes.len());
        }
    }

    /// A cell that points outside of the grid is refused.
    #[test]
    fn refuses_points_that_are_not_there() {
        let scratch = Scratch::new("vtu-outside");
        let path = scratch.0.join("a.vtu");
        let mut piece = sample();
        piece.connectivity[2] = 99;
        write(&path, &piece).unwrap();
        assert!(read_piece(&path).is_err());
    }

    /// The points of each cell are found in the flat lists.
    #[test]
    fn cells_have_their_points() {
        let scratch = Scratch::new("vtu-cells");
        let path = scratch.0.join("a.vtu");
        write(&path, &sample()).unwrap();
        let piece = read_piece(&path).unwrap();
        assert_eq!((piece.cell(0), piece.cell(1)), ([0, 1, 2, 3].as_slice(), [1, 4, 2].as_slice()));
        assert_eq!(piece.points[4], [2.0, 0.5, 0.0]);
    }
}
