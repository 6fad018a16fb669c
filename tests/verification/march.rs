//! A case run with the program's own simulation, and the tables that it wrote.

use std::path::PathBuf;
use std::rc::Rc;

use contact_petsc::case::Case;
use contact_petsc::error::Result;
use contact_petsc::output::console::Verbosity;
use contact_petsc::petsc::Session;
use contact_petsc::simulation::{self, RunRequest};

/// The results of a run, on rank 0.
pub struct Results {
    folder: PathBuf,
}

/// A column of numbers for each name.
pub struct Table {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

/// Runs a case. Returns its results on rank 0, and nothing elsewhere. Collective.
pub fn run(session: &Rc<Session>, text: &str) -> Option<Results> {
    attempt(session, text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Runs a case that may be refused. Returns its results on rank 0, and nothing elsewhere.
/// Collective.
pub fn attempt(session: &Rc<Session>, text: &str) -> Result<Option<Results>> {
    let scratch = PathBuf::from(std::env::var(super::FOLDER).expect("a folder for the check"));
    let (case_file, folder) = (scratch.join("case.yml"), scratch.join("results"));
    let case = Case::parse(text, "case.yml").unwrap_or_else(|error| panic!("{error}\n{text}"));
    if session.rank() == 0 {
        std::fs::write(&case_file, text).expect("the case is written");
    }
    let place = RunRequest::anew(case_file, folder.clone(), Verbosity::Silent);
    match case.dimension.value.coordinates() {
        2 => simulation::run::<2>(session, &case, &place)?,
        _ => simulation::run::<3>(session, &case, &place)?,
    }
    Ok((session.rank() == 0).then_some(Results { folder }))
}

impl Results {
    /// One of the tables, `probes.csv`.
    pub fn table(&self, name: &str) -> Table {
        let text = std::fs::read_to_string(self.folder.join(name)).expect("a table");
        let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect());
        Table { header: lines.next().expect("a header"), rows: lines.collect() }
    }
}

impl Table {
    /// The numbers of a column, by its name without the unit.
    pub fn column(&self, name: &str) -> Vec<f64> {
        let column = self.header.iter().position(|title| title.split(" [").next() == Some(name));
        let column = column.unwrap_or_else(|| panic!("{name} is not among {:?}", self.header));
        self.rows.iter().map(|row| row[column].parse().expect("a number")).collect()
    }
}
