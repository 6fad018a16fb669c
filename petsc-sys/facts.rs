//! What the installed PETSc is, and whether this program can stand on it.

/// Configuration of a PETSc, as its headers tell it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Facts {
    /// Major, minor and patch number.
    pub version: [u32; 3],
    /// Scalars are complex.
    pub complex: bool,
    /// Reals are 64 bit wide.
    pub double: bool,
    /// Indices are 64 bit wide.
    pub wide_indices: bool,
}

/// Source whose preprocessed form [`Facts::parse`] reads.
pub const PROBE: &str = r#"
#include <petscconf.h>
#include <petscversion.h>
#ifdef PETSC_USE_COMPLEX
fact complex
#endif
#ifdef PETSC_USE_REAL_DOUBLE
fact double
#endif
#ifdef PETSC_USE_64BIT_INDICES
fact wide_indices
#endif
fact version PETSC_VERSION_MAJOR PETSC_VERSION_MINOR PETSC_VERSION_SUBMINOR
"#;

/// Oldest release that has every function of the allow-list.
const OLDEST: [u32; 2] = [3, 18];

impl Facts {
    /// Reads what follows each word `fact` in the preprocessed [`PROBE`].
    pub fn parse(preprocessed: &str) -> Option<Self> {
        // A compiler may break a line around a macro of a system header; only its line markers begin with `#`.
        let lines = preprocessed.lines().filter(|line| !line.starts_with('#'));
        let words: Vec<&str> = lines.flat_map(str::split_whitespace).collect();
        let fact = |name: &str| words.windows(2).position(|pair| pair == ["fact", name]).map(|at| at + 2);
        let start = fact("version")?;
        let version: Vec<u32> = words[start..].iter().take(3).filter_map(|word| word.parse().ok()).collect();
        Some(Self {
            version: version.try_into().ok()?,
            complex: fact("complex").is_some(),
            double: fact("double").is_some(),
            wide_indices: fact("wide_indices").is_some(),
        })
    }

    /// One sentence that says why this PETSc will not do and which package will; `None` if it will do.
    pub fn refusal(&self) -> Option<String> {
        let [major, minor, patch] = self.version;
        let flaw = if [major, minor] < OLDEST {
            format!("is version {major}.{minor}.{patch}, but at least {}.{} is needed", OLDEST[0], OLDEST[1])
        } else if self.complex {
            "is built for complex numbers, but real ones are needed".to_owned()
        } else if !self.double {
            "is built for another precision, but double precision is needed".to_owned()
        } else if self.wide_indices {
            "is built for 64-bit indices, but 32-bit ones are needed".to_owned()
        } else {
            return None;
        };
        Some(format!(
            "the PETSc found by pkg-config {flaw}: install the Debian package petsc-dev (of Debian 12 or \
             newer)"
        ))
    }
}

/// The sentence for a system without PETSc.
pub const MISSING: &str =
    "PETSc is not found by pkg-config: install the Debian packages petsc-dev and pkg-config";

/// The sentence for a system without MPI.
pub const MISSING_MPI: &str = "MPI is not found: install the Debian package libopenmpi-dev";
