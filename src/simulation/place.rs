//! Where a run comes from and where it goes: its inputs, its folder, and the tables in it.

use std::path::PathBuf;
use std::time::Duration;

use super::restart::Begin;
use super::tables::Tables;
use crate::case::{Case, Mesh};
use crate::error::Result;
use crate::output::console::Verbosity;
use crate::output::folder::ResultsFolder;
use crate::output::process::claim;
use crate::output::record::Input;
use crate::output::table::Lengths;

/// Where a run comes from and where it goes.
#[derive(Debug, Clone)]
pub struct Place {
    /// The case file.
    pub case_file: PathBuf,
    /// The results folder.
    pub folder: PathBuf,
    /// How much the console says.
    pub verbosity: Verbosity,
    /// From the start, or from a checkpoint.
    pub begin: Begin,
    /// Wall time of this process in place of the case's.
    pub wall_time: Option<Duration>,
}

impl Place {
    /// A run from the start of the case.
    pub fn anew(case_file: PathBuf, folder: PathBuf, verbosity: Verbosity) -> Self {
        Self { case_file, folder, verbosity, begin: Begin::Anew, wall_time: None }
    }

    /// The command that goes on with this run on so many ranks, but for `--restart`.
    pub fn command(&self, ranks: usize) -> String {
        let on_ranks = if ranks > 1 { format!("mpirun -n {ranks} ") } else { String::new() };
        format!("{on_ranks}contact-petsc {} --output {}", self.case_file.display(), self.folder.display())
    }
}

/// Case file and mesh files.
pub(super) fn files(case: &Case, place: &Place) -> Vec<PathBuf> {
    let meshes = case.bodies.values().filter_map(|body| match &body.mesh {
        Mesh::File(file) => Some(case.resolve(&file.file.value)),
        _ => None,
    });
    std::iter::once(place.case_file.clone()).chain(meshes).collect()
}

/// Case file and mesh files with their hashes.
pub(super) fn inputs(case: &Case, place: &Place) -> Result<Vec<Input>> {
    files(case, place).iter().map(|path| Input::of(path)).collect()
}

/// The results folder, made or gone on in, with its tables; and the inputs. Rank 0 only.
pub(super) fn prepare<const D: usize>(
    case: &Case,
    place: &Place,
    lengths: Option<&Lengths>,
) -> Result<(Option<Tables<D>>, Vec<Input>)> {
    let inputs = inputs(case, place)?;
    claim(&place.folder)?;
    let folder = match lengths {
        Some(_) => ResultsFolder::open(&place.folder)?,
        None => ResultsFolder::create(&place.folder)?,
    };
    Ok((Some(Tables::open(folder.path(), case.units, lengths)?), inputs))
}

/// Names and versions of the program and its libraries.
pub(super) fn versions() -> Vec<(String, String)> {
    let own = ("contact-petsc".to_owned(), env!("CARGO_PKG_VERSION").to_owned());
    std::iter::once(own).chain(crate::petsc::versions()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What goes on with a run of several ranks asks for as many.
    #[test]
    fn the_command_names_the_ranks() {
        let place = Place::anew("a.yml".into(), "results/a".into(), Verbosity::Silent);
        assert_eq!(place.command(1), "contact-petsc a.yml --output results/a");
        assert_eq!(place.command(4), "mpirun -n 4 contact-petsc a.yml --output results/a");
    }
}
