//! One piece of an unstructured grid as VTK's XML with appended raw data: little endian, 64-bit
//! block headers.

use std::io::{BufWriter, Write};
use std::path::Path;

use crate::error::{Error, Result};

use super::folder::write_whole_with;

/// The numbers of an array, entity by entity.
#[derive(Debug, Clone, PartialEq)]
pub enum VtuValues {
    /// Physical quantities.
    Float64(Vec<f64>),
    /// Counts and indices.
    Int32(Vec<i32>),
    /// Statuses and cell types.
    UInt8(Vec<u8>),
}

impl VtuValues {
    /// VTK's name of the type.
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::Float64(_) => "Float64",
            Self::Int32(_) => "Int32",
            Self::UInt8(_) => "UInt8",
        }
    }

    /// Number of values.
    pub fn len(&self) -> usize {
        match self {
            Self::Float64(values) => values.len(),
            Self::Int32(values) => values.len(),
            Self::UInt8(values) => values.len(),
        }
    }

    /// Whether there are no values, as on a rank that owns no cells.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn are_finite(&self) -> bool {
        match self {
            Self::Float64(values) => values.iter().all(|value| value.is_finite()),
            Self::Int32(_) | Self::UInt8(_) => true,
        }
    }

    fn bytes(&self) -> u64 {
        let width = match self {
            Self::Float64(_) => 8,
            Self::Int32(_) => 4,
            Self::UInt8(_) => 1,
        };
        width * self.len() as u64
    }

    fn write(&self, file: &mut impl Write) -> std::io::Result<()> {
        file.write_all(&self.bytes().to_le_bytes())?;
        match self {
            Self::Float64(values) => values.iter().try_for_each(|v| file.write_all(&v.to_le_bytes())),
            Self::Int32(values) => values.iter().try_for_each(|v| file.write_all(&v.to_le_bytes())),
            Self::UInt8(values) => file.write_all(values),
        }
    }
}

/// A named array on points or cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Name in ParaView.
    pub name: &'static str,
    /// Values per entity: 1, 3 (a vector) or 6 (a symmetric tensor: xx, yy, zz, xy, yz, xz).
    pub components: usize,
    /// The numbers.
    pub values: VtuValues,
}

impl Array {
    /// A scalar quantity.
    pub fn scalar(name: &'static str, values: Vec<f64>) -> Self {
        Self { name, components: 1, values: VtuValues::Float64(values) }
    }

    /// A vector of `dimension` components, padded with zeros to three as VTK expects.
    pub fn vector(name: &'static str, values: &[f64], dimension: usize) -> Self {
        let mut padded = Vec::with_capacity(values.len() / dimension * 3);
        for vector in values.chunks_exact(dimension) {
            padded.extend((0..3).map(|i| vector.get(i).copied().unwrap_or(0.0)));
        }
        Self { name, components: 3, values: VtuValues::Float64(padded) }
    }

    /// A symmetric tensor in the order xx, yy, zz, xy, yz, xz.
    pub fn symmetric_tensor(name: &'static str, values: Vec<f64>) -> Self {
        Self { name, components: 6, values: VtuValues::Float64(values) }
    }

    /// An array of counts or indices.
    pub fn numbers(name: &'static str, values: Vec<i32>) -> Self {
        Self { name, components: 1, values: VtuValues::Int32(values) }
    }

    /// An array of small codes.
    pub fn codes(name: &'static str, values: Vec<u8>) -> Self {
        Self { name, components: 1, values: VtuValues::UInt8(values) }
    }

    /// The attributes that a piece and its index share.
    pub(super) fn attributes(&self) -> String {
        let mut text = format!("type=\"{}\" Name=\"{}\"", self.values.type_name(), self.name);
        if self.components > 1 {
            text.push_str(&format!(" NumberOfComponents=\"{}\"", self.components));
        }
        if self.components == 6 {
            for (index, name) in ["XX", "YY", "ZZ", "XY", "YZ", "XZ"].iter().enumerate() {
                text.push_str(&format!(" ComponentName{index}=\"{name}\""));
            }
        }
        text
    }
}

/// What one rank contributes to a grid. All parts may be empty.
#[derive(Debug, Clone, PartialEq)]
pub struct VtuPiece {
    /// Reference positions \[m\], an array of vectors called `Points`.
    pub points: Array,
    /// Points of all cells, one cell after the other.
    pub connectivity: Vec<i32>,
    /// End of each cell in `connectivity`.
    pub offsets: Vec<i32>,
    /// VTK cell type of each cell.
    pub types: Vec<u8>,
    /// Arrays on points.
    pub point_data: Vec<Array>,
    /// Arrays on cells.
    pub cell_data: Vec<Array>,
}

impl VtuPiece {
    fn check(&self) -> Result<(usize, usize)> {
        let points = self.points.values.len() / 3;
        let cells = self.types.len();
        let fits = |array: &Array, count: usize| array.values.len() == count * array.components;
        let wrong = |array: &&Array, count| !fits(array, count);
        let misfit = self
            .point_data
            .iter()
            .find(|a| wrong(a, points))
            .or(self.cell_data.iter().find(|a| wrong(a, cells)));
        if let Some(array) = misfit {
            let text = format!(
                "field `{}` has {} values for {points} points, {cells} cells",
                array.name,
                array.values.len()
            );
            return Err(Error::internal(text));
        }
        let last = self.offsets.last().copied().unwrap_or(0);
        if self.offsets.len() != cells || last as usize != self.connectivity.len() {
            return Err(Error::internal("the cells of a field piece do not fit their connectivity"));
        }
        Ok((points, cells))
    }
}

impl VtuPiece {
    /// Checks that the arrays fit the grid and are finite. Returns the numbers of points and cells.
    ///
    /// # Errors
    /// An array does not fit (an internal fault), or a value for the file `path` is not finite.
    pub(super) fn require_sound(&self, path: &Path) -> Result<[usize; 2]> {
        let (points, cells) = self.check()?;
        let arrays = self.point_data.iter().chain(&self.cell_data).chain(std::iter::once(&self.points));
        if let Some(array) = arrays.into_iter().find(|array| !array.values.are_finite()) {
            let text = format!("{}: a value of `{}` is not finite", path.display(), array.name);
            return Err(Error::not_converged(text));
        }
        Ok([points, cells])
    }
}

/// Writes a piece. The file appears only when it is complete.
///
/// # Errors
/// An array does not fit the grid (an internal fault), or the disk can not be written.
pub fn write(path: &Path, piece: &VtuPiece) -> Result<()> {
    let sizes = piece.require_sound(path)?;
    write_whole_with(path, |file| stream(file, piece, sizes))
}

fn stream(
    file: &mut BufWriter<std::fs::File>,
    piece: &VtuPiece,
    [points, cells]: [usize; 2],
) -> std::io::Result<()> {
    let topology = [
        Array::numbers("connectivity", piece.connectivity.clone()),
        Array::numbers("offsets", piece.offsets.clone()),
        Array::codes("types", piece.types.clone()),
    ];
    let sections: [(&str, &[Array]); 4] = [
        ("Points", std::slice::from_ref(&piece.points)),
        ("Cells", &topology),
        ("PointData", &piece.point_data),
        ("CellData", &piece.cell_data),
    ];
    writeln!(file, "<?xml version=\"1.0\"?>")?;
    writeln!(file, "<VTKFile type=\"UnstructuredGrid\" {ENCODING}>\n<UnstructuredGrid>")?;
    writeln!(file, "<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">")?;
    let mut offset = 0;
    for (section, arrays) in sections {
        writeln!(file, "<{section}>")?;
        for array in arrays {
            writeln!(file, "<DataArray {} format=\"appended\" offset=\"{offset}\"/>", array.attributes())?;
            offset += 8 + array.values.bytes();
        }
        writeln!(file, "</{section}>")?;
    }
    writeln!(file, "</Piece>\n</UnstructuredGrid>")?;
    write!(file, "<AppendedData encoding=\"raw\">\n_")?;
    for array in sections.into_iter().flat_map(|(_, arrays)| arrays) {
        array.values.write(file)?;
    }
    writeln!(file, "\n</AppendedData>\n</VTKFile>")
}

/// Encoding of numbers in every file of this program.
pub(super) const ENCODING: &str = "version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\"";

#[cfg(test)]
pub(super) mod tests {
    use super::super::folder::tests::Scratch;
    use super::super::vtu_reader::read_piece;
    use super::*;
    use crate::error::Cause;

    /// One quadrilateral and one triangle with one array of each type.
    pub(in super::super) fn sample() -> VtuPiece {
        VtuPiece {
            points: Array::vector("Points", &[0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0, 2.0, 0.5], 2),
            connectivity: vec![0, 1, 2, 3, 1, 4, 2],
            offsets: vec![4, 7],
            types: vec![9, 5],
            point_data: vec![
                Array::vector("displacement", &(0..10).map(|i| f64::from(i) / 3.0).collect::<Vec<_>>(), 2),
                Array::codes("status", vec![0, 1, 2, 1, 0]),
            ],
            cell_data: vec![
                Array::symmetric_tensor("cauchy_stress", (0..12).map(|i| 1e6 / f64::from(i + 1)).collect()),
                Array::numbers("body", vec![0, 7]),
            ],
        }
    }

    /// A piece with the same arrays and no values.
    pub(in super::super) fn empty() -> VtuPiece {
        let nothing = |array: &Array| {
            let values = match array.values {
                VtuValues::Float64(_) => VtuValues::Float64(vec![]),
                VtuValues::Int32(_) => VtuValues::Int32(vec![]),
                VtuValues::UInt8(_) => VtuValues::UInt8(vec![]),
            };
            Array { values, ..array.clone() }
        };
        let full = sample();
        VtuPiece {
            points: nothing(&full.points),
            connectivity: vec![],
            offsets: vec![],
            types: vec![],
            point_data: full.point_data.iter().map(nothing).collect(),
            cell_data: full.cell_data.iter().map(nothing).collect(),
        }
    }

    /// Every value of a full and of an empty piece is read back bit by bit.
    #[test]
    fn a_piece_survives_the_round_trip() {
        let scratch = Scratch::new("vtu");
        let path = scratch.0.join("a.vtu");
        for piece in [sample(), empty()] {
            write(&path, &piece).unwrap();
            let found = read_piece(&path).unwrap();
            assert_eq!(found.types, piece.types);
            assert_eq!(found.connectivity, piece.connectivity);
            assert_eq!(found.offsets, piece.offsets);
            for (arrays, read) in
                [(&piece.point_data, &found.point_data), (&piece.cell_data, &found.cell_data)]
            {
                assert_eq!(read.len(), arrays.len());
                for array in arrays {
                    assert_eq!(read[array.name].values, array.values);
                    assert_eq!(read[array.name].components, array.components);
                }
            }
        }
        assert_eq!(std::fs::read_dir(&scratch.0).unwrap().count(), 1);
    }

    /// Vectors in 2D get a zero third component.
    #[test]
    fn pads_plane_vectors() {
        let array = Array::vector("v", &[1.0, 2.0, 3.0, 4.0], 2);
        assert_eq!(array.values, VtuValues::Float64(vec![1.0, 2.0, 0.0, 3.0, 4.0, 0.0]));
    }

    /// An array that does not fit the grid is an internal fault. The error names the array, and no
    /// file is written.
    #[test]
    fn refuses_arrays_that_do_not_fit() {
        let scratch = Scratch::new("vtu-misfit");
        let mut piece = sample();
        piece.cell_data[1].values = VtuValues::Int32(vec![0]);
        let error = write(&scratch.0.join("a.vtu"), &piece).unwrap_err();
        assert_eq!(error.cause, Cause::Internal);
        assert!(error.message.contains("`body`"), "{error}");
        assert_eq!(std::fs::read_dir(&scratch.0).unwrap().count(), 0);
    }
}
