//! The command line as a user meets it: what a broken input gets, and what a good one.

mod common;

use common::{Folder, run};

/// The version names the libraries that the program runs with.
#[test]
fn version_names_the_libraries() {
    let folder = Folder::new("version");
    let output = run(0, &["--version"], &folder).success();
    for library in ["PETSc 3.", "MPI", "METIS"] {
        assert!(output.stdout.contains(library), "{}", output.stdout);
    }
}
