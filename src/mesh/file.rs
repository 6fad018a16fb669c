//! Meshes from files. The ending of its name gives the format of a file.

use std::path::Path;

use super::{Mesh, MeshFile, PlaneState, abaqus, gmsh};
use crate::error::Result;

/// Reads a mesh of `D` dimensions: an input file of Abaqus or CalculiX if its name ends in `.inp`, a
/// Gmsh mesh otherwise. With `region`, only the elements of this region are kept. Plane elements of an
/// input file must be of the state `plane`; Gmsh meshes have none.
///
/// # Errors
/// The errors of [`gmsh::read`] and [`abaqus::read_with_source`].
pub fn read_file<const D: usize>(
    path: &Path,
    region: Option<&str>,
    plane: PlaneState,
) -> Result<(Mesh<D>, MeshFile)> {
    match path.extension() {
        Some(ending) if ending.eq_ignore_ascii_case("inp") => abaqus::read_with_source(path, region, plane),
        _ => gmsh::read_with_source(path, region),
    }
}
