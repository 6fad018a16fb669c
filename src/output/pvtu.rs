//! The index of the pieces of one grid at one step.

use std::path::Path;

use crate::error::{Error, Result};
use crate::files;

use super::folder::write_whole;
use super::io_error::trouble;
use super::vtu::{Array, ENCODING, VtuPiece};
use super::xml::{escaped, tags};

/// Names and types of the arrays of a grid, without their values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Schema {
    sections: [(&'static str, Vec<String>); 3],
}

impl Schema {
    /// The schema that the pieces of all ranks share, taken from one of them.
    pub fn of(piece: &VtuPiece) -> Self {
        let names = |arrays: &[Array]| arrays.iter().map(Array::attributes).collect();
        let points = names(std::slice::from_ref(&piece.points));
        let (on_points, on_cells) = (names(&piece.point_data), names(&piece.cell_data));
        Self { sections: [("PPoints", points), ("PPointData", on_points), ("PCellData", on_cells)] }
    }
}

/// Writes the index; `sources` are the files of all pieces relative to it. Rank 0 only, after the
/// pieces are written.
///
/// # Errors
/// The disk can not be written.
pub fn write(path: &Path, schema: &Schema, sources: &[String]) -> Result<()> {
    let mut text = format!("<?xml version=\"1.0\"?>\n<VTKFile type=\"PUnstructuredGrid\" {ENCODING}>\n");
    text.push_str("<PUnstructuredGrid GhostLevel=\"0\">\n");
    for (section, arrays) in &schema.sections {
        text.push_str(&format!("<{section}>\n"));
        text.extend(arrays.iter().map(|attributes| format!("<PDataArray {attributes}/>\n")));
        text.push_str(&format!("</{section}>\n"));
    }
    text.extend(sources.iter().map(|source| format!("<Piece Source=\"{}\"/>\n", escaped(source))));
    text.push_str("</PUnstructuredGrid>\n</VTKFile>\n");
    write_whole(path, text.as_bytes())
}

/// Reads the files of the pieces, relative to the index.
///
/// # Errors
/// The index is missing, truncated, or was not written by this program.
pub fn read(path: &Path) -> Result<Vec<String>> {
    let bytes = files::read(path, files::LONGEST_TABLE).map_err(|e| trouble(path, "read", &e))?;
    let tags = tags(&bytes, "/VTKFile").map_err(|e| e.within(&path.display().to_string()))?;
    if tags.first().and_then(|tag| tag.find("type")) != Some("PUnstructuredGrid") {
        return Err(Error::file(format!("{}: not an index of pieces", path.display())));
    }
    tags.iter().filter(|tag| tag.name == "Piece").map(|tag| Ok(tag.get("Source")?.to_string())).collect()
}

#[cfg(test)]
mod tests {
    use super::super::folder::tests::Scratch;
    use super::super::vtu::tests::sample;
    use super::*;

    /// The index names every piece and declares every array with its type and components.
    #[test]
    fn names_pieces_and_arrays() {
        let scratch = Scratch::new("pvtu");
        let path = scratch.0.join("a.pvtu");
        let sources = ["a_0000.vtu".to_string(), "a_0001.vtu".to_string()];
        write(&path, &Schema::of(&sample()), &sources).unwrap();
        assert_eq!(read(&path).unwrap(), sources);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(
            text.contains("<PDataArray type=\"Float64\" Name=\"displacement\" NumberOfComponents=\"3\"/>")
        );
        assert!(text.contains("<PDataArray type=\"UInt8\" Name=\"status\"/>"));
        assert!(text.contains("Name=\"cauchy_stress\" NumberOfComponents=\"6\" ComponentName0=\"XX\""));
        std::fs::write(&path, &text[..text.len() - 20]).unwrap();
        assert!(read(&path).is_err());
    }
}
