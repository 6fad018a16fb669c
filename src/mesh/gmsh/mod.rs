//! Reader of Gmsh meshes, MSH 2.2 and 4.1, as text or binary of either byte order.
//!
//! Physical groups become sets according to their dimension. Groups of the mesh's dimension become
//! regions (element sets), groups one dimension lower become facet sets, and lower ones point sets.
//! A group without a name is identified by its number.

mod build;
mod input;
mod msh2;
mod msh4;
mod raw;
mod sets;

use std::io::Read;
use std::path::Path;

use super::source::{Labels, MeshFile, Places, unreadable};
use super::{Mesh, SurfaceMesh};
use crate::error::{Error, Result};
use crate::files;
use input::{Encoding, GmshInput, shortened};
use raw::Raw;

/// The section `$MeshFormat` lies within this number of bytes.
const HEAD: u64 = 4096;

/// The two formats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Version {
    Two,
    Four,
}

/// Reads a mesh of `D` dimensions. With `region`, only the elements of the region and their nodes
/// are kept.
///
/// # Errors
/// - The file cannot be read, or is damaged, truncated or of unknown format.
/// - The region does not exist.
/// - An element is unknown, inverted or degenerate.
/// - A node is used by no element.
/// - A facet of a set does not bound the mesh.
pub fn read<const D: usize>(path: &Path, region: Option<&str>) -> Result<Mesh<D>> {
    read_with_source(path, region).map(|(mesh, _)| mesh)
}

/// Reads a mesh like [`read`], and keeps the locations of its nodes and elements in the file.
///
/// # Errors
/// The errors of [`read`].
pub fn read_with_source<const D: usize>(path: &Path, region: Option<&str>) -> Result<(Mesh<D>, MeshFile)> {
    let name = path.display().to_string();
    let unreadable = |e| unreadable(&name, &e);
    let mut file = files::open(path).map_err(unreadable)?;
    // A file that is not a mesh is not read further, regardless of its length.
    let mut bytes = Vec::new();
    file.by_ref().take(HEAD).read_to_end(&mut bytes).map_err(unreadable)?;
    format(&mut GmshInput::new(&bytes)).map_err(|e| e.within(&name))?;
    let rest = file.metadata().map_or(0, |data| data.len().saturating_sub(HEAD));
    bytes.try_reserve_exact(usize::try_from(rest).unwrap_or(usize::MAX)).map_err(|_| {
        Error::file(format!("the mesh has {rest} bytes, more than the available memory")).within(&name)
    })?;
    file.read_to_end(&mut bytes).map_err(unreadable)?;
    let (mesh, encoding, labels) = labelled(&bytes, region).map_err(|e| e.within(&name))?;
    let places = Places::Bytes { file: name, bytes, is_text: encoding == Encoding::Text };
    Ok((mesh, MeshFile { places, labels, remarks: Vec::new() }))
}

/// Reads the mesh from the bytes of a file, see [`read`].
///
/// # Errors
/// The errors of [`read`], with a line or byte and without the name of the file.
pub fn parse<const D: usize>(bytes: &[u8], region: Option<&str>) -> Result<Mesh<D>> {
    labelled(bytes, region).map(|(mesh, ..)| mesh)
}

/// Reads the triangles of a mesh, and its quadrilaterals as two triangles each, from the bytes of a
/// file. Elements of other dimensions are ignored.
///
/// # Errors
/// The file is damaged or truncated, or has no elements of dimension two.
pub fn surface(bytes: &[u8]) -> Result<SurfaceMesh> {
    let mut input = GmshInput::new(bytes);
    let version = format(&mut input)?;
    let raw = sections(&mut input, version)?;
    let mut mesh = SurfaceMesh::default();
    let mut number = vec![u32::MAX; raw.points.len()];
    for element in &raw.elements {
        let Some(kind) = element.kind.filter(|kind| kind.dimension() == 2) else { continue };
        let nodes = raw.resolve(&input, element)?;
        let corners = &nodes[..kind.corners()];
        for &node in corners {
            let number = &mut number[node as usize];
            if *number == u32::MAX {
                *number = mesh.points.len() as u32;
                mesh.points.push(raw.points[node as usize]);
            }
        }
        for k in 2..corners.len() {
            mesh.triangles.push([0, k - 1, k].map(|corner| number[corners[corner] as usize]));
        }
    }
    if mesh.triangles.is_empty() {
        let error = Error::file("the mesh has no triangles or quadrilaterals");
        return Err(error.hint("mesh the surface with `gmsh -2`, and save all entities"));
    }
    Ok(mesh)
}

fn labelled<const D: usize>(bytes: &[u8], region: Option<&str>) -> Result<(Mesh<D>, Encoding, Labels)> {
    let mut input = GmshInput::new(bytes);
    let version = format(&mut input)?;
    let raw = sections(&mut input, version)?;
    let (mesh, labels) = build::mesh(&input, &raw, region)?;
    Ok((mesh, input.encoding, labels))
}

fn format(input: &mut GmshInput) -> Result<Version> {
    const CURE: &str = "convert it with `gmsh old.msh -save -format msh41 -o new.msh`";
    let head = input
        .word("$MeshFormat")
        .map_err(|_| input.error("this is not a Gmsh mesh: it is empty or binary"))?;
    if head != "$MeshFormat" {
        let message =
            format!("this is not a Gmsh mesh: it begins with '{}', not with $MeshFormat", shortened(head));
        let error = input.error(message);
        return Err(match head.starts_with('*') {
            true => error.hint("the name of an input file of Abaqus or CalculiX must end in .inp"),
            false => error,
        });
    }
    let version = match input.word("the version")? {
        "2.2" => Version::Two,
        "4.1" => Version::Four,
        other => {
            let message =
                format!("expected version 2.2 or 4.1 of the MSH format, found '{}'", shortened(other));
            return Err(input.error(message).hint(CURE));
        }
    };
    let binary = match input.word("0 for text or 1 for binary")? {
        "0" => false,
        "1" => true,
        other => {
            return Err(
                input.error(format!("expected 0 for text or 1 for binary, found '{}'", shortened(other)))
            );
        }
    };
    let size = input.line("the size of a number")?;
    if size != "8" {
        let message = format!("expected numbers of 8 bytes, found {}", shortened(size));
        return Err(input.error(message).hint(CURE));
    }
    if binary {
        input.encoding = Encoding::LittleEndian;
        input.encoding = match input.int("the number 1, which marks the byte order")? {
            1 => Encoding::LittleEndian,
            other if other.swap_bytes() == 1 => Encoding::BigEndian,
            other => return Err(input.error(format!("expected the number 1 in four bytes, found {other}"))),
        };
    }
    input.end_section("MeshFormat")?;
    Ok(version)
}

fn sections(input: &mut GmshInput, version: Version) -> Result<Raw> {
    let mut raw = Raw::default();
    let mut entities = msh4::Entities::new();
    let mut seen = [false; 2];
    while let Some(name) = input.next_section()? {
        match (name, version) {
            ("PhysicalNames", _) => names(input, &mut raw)?,
            ("Entities", Version::Four) => entities = msh4::entities(input, &mut raw)?,
            ("Nodes", Version::Two) => msh2::nodes(input, &mut raw)?,
            ("Nodes", Version::Four) => msh4::nodes(input, &mut raw)?,
            ("Elements", Version::Two) => msh2::elements(input, &mut raw)?,
            ("Elements", Version::Four) => msh4::elements(input, &mut raw, &entities)?,
            ("PartitionedEntities", _) => {
                let message = "the mesh is partitioned, but this program partitions meshes automatically";
                return Err(input.error(message).hint("mesh the geometry again without `-part`"));
            }
            _ => {
                input.skip_section(name)?;
                continue;
            }
        }
        input.end_section(name)?;
        seen[0] |= name == "Nodes";
        seen[1] |= name == "Elements";
    }
    for (found, name) in seen.into_iter().zip(["$Nodes", "$Elements"]) {
        if !found {
            let message =
                format!("the file has no section {name}: it is truncated, or was saved without a mesh");
            return Err(input
                .error(message)
                .hint("mesh the geometry (`gmsh -2` or `gmsh -3`) and save it again"));
        }
    }
    Ok(raw)
}

/// Names of physical groups, which are text in every format. Names from MED files are padded with
/// blanks.
fn names(input: &mut GmshInput, raw: &mut Raw) -> Result<()> {
    let count = input.line_size("the number of physical names")?;
    for _ in 0..count {
        let line = input.line("a physical name")?;
        let mut parts = line.splitn(3, ' ');
        let dimension = parts.next().and_then(|word| word.parse().ok()).filter(|&d: &usize| d <= 3);
        let tag = parts.next().and_then(|word| word.parse::<i32>().ok());
        let name = parts.next().map(|word| word.trim().trim_matches('"').trim());
        let (Some(dimension), Some(tag), Some(name)) = (dimension, tag, name) else {
            let message = format!("expected a dimension, a number and a name, found '{}'", shortened(line));
            return Err(input.error(message));
        };
        raw.names.insert((dimension, tag.unsigned_abs()), name.to_owned());
    }
    Ok(())
}

#[cfg(test)]
mod tests;
