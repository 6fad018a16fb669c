//! Names and versions of the libraries in use.

use std::ffi::{CStr, c_void};
use std::mem::MaybeUninit;
use std::path::{Path, PathBuf};

use super::call::petsc;
use super::threads;

/// PETSc, MPI and METIS as loaded at run time; works without a session.
///
/// Names and versions, as in `PETSc` and `3.18.5`.
pub fn versions() -> [(String, String); 3] {
    let [mut major, mut minor, mut patch, mut release] = [0; 4];
    let known = petsc!(PetscGetVersionNumber(&mut major, &mut minor, &mut patch, &mut release));
    let petsc = match known {
        Ok(()) => format!("{major}.{minor}.{patch}"),
        Err(_) => env!("PETSC_BUILD_VERSION").to_owned(),
    };
    let mpi = name_and_version(&mpi::environment::library_version().unwrap_or_default());
    let metis =
        threads::address(c"METIS_PartGraphKway").and_then(file_of).as_deref().and_then(version_of_file);
    let metis = metis.unwrap_or_else(|| env!("METIS_VERSION").to_owned());
    [("PETSc".to_owned(), petsc), mpi, ("METIS".to_owned(), metis)]
}

/// The library file that contains a function, with links resolved.
fn file_of(function: *mut c_void) -> Option<PathBuf> {
    let mut found = MaybeUninit::<libc::Dl_info>::zeroed();
    // SAFETY: the linker only compares the address, and fills the record if it returns anything but
    // zero.
    let found = unsafe { (libc::dladdr(function, found.as_mut_ptr()) != 0).then(|| found.assume_init()) }?;
    if found.dli_fname.is_null() {
        return None;
    }
    // SAFETY: a string of the linker, which is valid as long as the library is loaded.
    let name = unsafe { CStr::from_ptr(found.dli_fname) };
    std::fs::canonicalize(name.to_str().ok()?).ok()
}

/// The version in the name of a shared library, if all three numbers are present. METIS does not
/// provide it otherwise.
fn version_of_file(path: impl AsRef<Path>) -> Option<String> {
    let (_, version) = path.as_ref().file_name()?.to_str()?.split_once(".so.")?;
    let mut numbers = version.split('.');
    let is_whole = numbers.clone().count() == 3 && numbers.all(|number| number.parse::<u32>().is_ok());
    is_whole.then(|| version.to_owned())
}

/// Name and version from the description of an MPI library. A version begins with a digit, or with
/// a `v` and a digit.
fn name_and_version(library: &str) -> (String, String) {
    let line = library.split([',', '\n']).next().unwrap_or_default();
    let is_version =
        |word: &&str| word.trim_start_matches('v').starts_with(|first: char| first.is_ascii_digit());
    let words: Vec<&str> = line.split_whitespace().collect();
    let name: Vec<&str> = words.iter().copied().take_while(|word| !is_version(word)).collect();
    let name = name.join(" ");
    let name = name.trim_end_matches(':').trim_end_matches("Version").trim_end();
    let version = words.iter().copied().find(is_version).unwrap_or_default();
    (if name.is_empty() { "MPI" } else { name }.to_owned(), version.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names may consist of several words and are separated correctly from the version.
    #[test]
    fn libraries_have_names_and_versions() {
        for (words, name, version) in [
            ("Open MPI v4.1.4, package: Debian OpenMPI, ident: 4.1.4", "Open MPI", "v4.1.4"),
            ("MPICH Version:      4.0.2\nMPICH Release date: 2022", "MPICH", "4.0.2"),
            ("Intel(R) MPI Library 2021.5 for Linux* OS\n", "Intel(R) MPI Library", "2021.5"),
            ("", "MPI", ""),
        ] {
            assert_eq!(name_and_version(words), (name.to_owned(), version.to_owned()));
        }
    }

    /// A file name gives a complete version, or none if it contains only a part of it.
    #[test]
    fn files_of_libraries_have_versions() {
        assert_eq!(version_of_file("/usr/lib/libmetis.so.5.1.0").as_deref(), Some("5.1.0"));
        for name in
            ["/usr/lib/libmetis.so.5", "/usr/lib/libmetis.so", "/bin/contact-petsc", "libmetis.so.5.a.0"]
        {
            assert_eq!(version_of_file(name), None, "{name}");
        }
    }
}
