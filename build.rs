//! Puts the versions of the libraries below into `--version`, and refuses a system without METIS in one sentence.

use std::path::PathBuf;
use std::{env, fs, process};

const MISSING_METIS: &str = "METIS is not found: install the Debian package libmetis-dev";

/// Source whose preprocessed form carries METIS's version numbers.
const PROBE: &str = "#include <metis.h>\nmetis_version METIS_VER_MAJOR METIS_VER_MINOR METIS_VER_SUBMINOR\n";

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let version = metis_version().unwrap_or_else(|sentence| {
        println!("cargo::error={sentence}");
        process::exit(1);
    });
    println!("cargo::rustc-env=METIS_VERSION={version}");
    // What the program is built against; what it runs with is found out then (`petsc::versions`).
    let petsc = env::var("DEP_PETSC_VERSION").unwrap_or_default();
    println!("cargo::rustc-env=PETSC_BUILD_VERSION={petsc}");
}

fn metis_version() -> Result<String, String> {
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("cargo did not set OUT_DIR")?);
    let probe = out.join("metis_probe.c");
    fs::write(&probe, PROBE).map_err(|error| format!("{}: {error}", probe.display()))?;
    let expanded = cc::Build::new()
        .cargo_metadata(false)
        .cargo_warnings(false)
        .file(&probe)
        .try_expand()
        .map_err(|_| MISSING_METIS.to_owned())?;
    let text = String::from_utf8_lossy(&expanded);
    // The compiler breaks the line around macros of a system header; its line markers begin with `#`.
    let words = text.lines().filter(|line| !line.starts_with('#')).flat_map(str::split_whitespace);
    let numbers: Vec<&str> = words.skip_while(|&word| word != "metis_version").skip(1).take(3).collect();
    if numbers.iter().all(|number| number.parse::<u32>().is_ok()) {
        Ok(numbers.join("."))
    } else {
        Err("METIS does not tell its version: install the Debian package libmetis-dev (5.1 or newer)"
            .to_owned())
    }
}
