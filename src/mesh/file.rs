//! Meshes from files. The ending of its name gives the format of a file.

use std::io::ErrorKind;
use std::path::Path;

use super::{Mesh, MeshFile, abaqus, gmsh};
use crate::error::{Error, Result};

/// Reads a mesh of `D` dimensions: an input file of Abaqus or CalculiX if its name ends in `.inp`, a
/// Gmsh mesh otherwise. With `region`, only the elements of this region are kept.
///
/// # Errors
/// The errors of [`gmsh::read`] and [`abaqus::read_with_source`].
pub fn read_file<const D: usize>(path: &Path, region: Option<&str>) -> Result<(Mesh<D>, MeshFile)> {
    match path.extension() {
        Some(ending) if ending.eq_ignore_ascii_case("inp") => abaqus::read_with_source(path, region),
        _ => gmsh::read_with_source(path, region),
    }
}

/// The error of a mesh file that the system does not let the program read.
pub(super) fn unreadable(name: &str, cause: &std::io::Error) -> Error {
    let error = Error::file(format!("the mesh can not be read: {cause}"));
    let error = match cause.kind() {
        ErrorKind::NotFound => error.hint("paths of meshes are relative to the folder of the case file"),
        _ => error,
    };
    error.within(name)
}
