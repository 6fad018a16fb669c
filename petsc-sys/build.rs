//! Finds PETSc and MPI, refuses what will not do in one sentence, and binds the functions of the list.

#[path = "facts.rs"]
mod facts;

use facts::{Facts, MISSING, MISSING_MPI, PROBE};
use std::path::{Path, PathBuf};
use std::{env, fs, process};

/// Every function of PETSc that this program calls: session, options, errors and log; vectors; matrices; solvers.
const FUNCTIONS: &str = "
    PetscInitialize PetscFinalize PetscGetVersionNumber PetscPushErrorHandler PetscPopErrorHandler
    PetscErrorMessage PetscOptionsSetValue PetscOptionsClearValue
    PetscOptionsGetAll PetscOptionsLeftGet PetscOptionsLeftRestore PetscClassIdRegister
    PetscLogEventRegister PetscObjectReference contact_log_begin contact_log_end contact_allocate contact_free

    VecCreateGhostBlock VecDuplicate VecDestroy VecGetArray VecRestoreArray VecGetArrayRead
    VecRestoreArrayRead VecGetLocalSize VecGetBlockSize VecGhostUpdateBegin VecGhostUpdateEnd
    VecAXPY VecAYPX VecAXPBY VecWAXPY VecScale VecSet VecNorm VecDot VecPointwiseMult
    VecPointwiseDivide

    MatCreate MatSetSizes MatSetType MatSetBlockSize MatSetOption MatDestroy MatGetInfo
    MatSeqAIJSetPreallocationCSR MatMPIAIJSetPreallocationCSR MatSeqBAIJSetPreallocationCSR
    MatMPIBAIJSetPreallocationCSR MatMPIAIJGetSeqAIJ MatMPIBAIJGetSeqBAIJ MatSeqAIJGetArray
    MatSeqAIJRestoreArray MatSeqBAIJGetArray MatSeqBAIJRestoreArray MatAssemblyBegin MatAssemblyEnd
    MatMult MatMultTranspose MatGetDiagonal MatNorm MatCreateMAIJ MatNullSpaceCreateRigidBody
    MatSetNearNullSpace MatGetNearNullSpace MatNullSpaceDestroy MatCreateShell MatShellSetOperation MatShellSetContext MatShellGetContext

    MatCreateMPIAdj MatPartitioningCreate MatPartitioningDestroy MatPartitioningSetType
    MatPartitioningSetAdjacency MatPartitioningSetNParts MatPartitioningSetUseEdgeWeights
    MatPartitioningSetVertexWeights MatPartitioningSetFromOptions MatPartitioningApply
    ISGetLocalSize ISGetIndices ISRestoreIndices ISDestroy

    KSPCreate KSPDestroy KSPSetOptionsPrefix KSPSetOperators KSPSetFromOptions KSPSetTolerances
    KSPGetTolerances KSPSetUp KSPSolve KSPReset KSPGetPC KSPGetType KSPGetIterationNumber
    KSPGetResidualNorm KSPGetConvergedReason KSPSetReusePreconditioner KSPSetInitialGuessNonzero
    KSPSetUpOnBlocks
    PCGetType PCSetType PCGetFailedReason PCShellSetContext PCShellGetContext PCShellSetApply
    PCShellSetDestroy PCShellSetName
";

/// Constants and enumerations that no listed function mentions.
const CONSTANTS: &[&str] =
    &["PETSC_COMM_WORLD", "MATOP_.*", "KSP_.*", "PC_.*", "MAT_.*", "NORM_.*", "PETSC_(TRUE|FALSE)"];

fn main() {
    if let Err(sentence) = bind() {
        println!("cargo::error={sentence}");
        process::exit(1);
    }
}

fn bind() -> Result<(), String> {
    for file in ["facts.rs", "src/shim.c", "src/shim.h"] {
        println!("cargo::rerun-if-changed={file}");
    }
    let petsc = ["PETSc", "petsc"]
        .iter()
        .find_map(|name| pkg_config::Config::new().cargo_metadata(false).env_metadata(true).probe(name).ok())
        .ok_or(MISSING)?;
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("cargo did not set OUT_DIR")?);
    for header in petsc.include_paths.iter().map(|path| path.join("petscversion.h")) {
        println!("cargo::rerun-if-changed={}", header.display());
    }
    let facts = facts(&petsc.include_paths, &out)?;
    if let Some(sentence) = facts.refusal() {
        return Err(sentence);
    }
    let mpi = build_probe_mpi::probe().map_err(|_| MISSING_MPI.to_owned())?;
    let includes: Vec<PathBuf> = petsc.include_paths.iter().chain(&mpi.include_paths).cloned().collect();
    compile_shim(&includes)?;
    generate(&includes, &out)?;
    for path in petsc.link_paths {
        println!("cargo::rustc-link-search=native={}", path.display());
    }
    for library in petsc.libs {
        println!("cargo::rustc-link-lib={library}");
    }
    let [major, minor, patch] = facts.version;
    println!("cargo::metadata=version={major}.{minor}.{patch}");
    Ok(())
}

fn facts(includes: &[PathBuf], out: &Path) -> Result<Facts, String> {
    let probe = out.join("probe.c");
    fs::write(&probe, PROBE).map_err(|error| format!("{}: {error}", probe.display()))?;
    let expanded = cc::Build::new()
        .cargo_metadata(false)
        .includes(includes)
        .file(&probe)
        .try_expand()
        .map_err(|_| MISSING.to_owned())?;
    Facts::parse(&String::from_utf8_lossy(&expanded)).ok_or_else(|| MISSING.to_owned())
}

fn compile_shim(includes: &[PathBuf]) -> Result<(), String> {
    cc::Build::new()
        .includes(includes)
        .file("src/shim.c")
        .try_compile("contact_petsc_shim")
        .map_err(|error| format!("the shim over PETSc's macros does not compile: {error}"))
}

fn generate(includes: &[PathBuf], out: &Path) -> Result<(), String> {
    let mut builder = bindgen::builder()
        .header("src/shim.h")
        .clang_args(includes.iter().map(|path| format!("-I{}", path.display())))
        // A value that C returns but the header does not list would be undefined behaviour in a Rust enum.
        .default_enum_style(bindgen::EnumVariation::NewType { is_bitfield: false, is_global: true })
        .prepend_enum_name(false)
        // MPI's types come from mpi-sys; the error code differs between releases, see lib.rs.
        .blocklist_type("MPI_.*|ompi_.*|PetscErrorCode")
        .blocklist_item("MPI_.*|ompi_.*")
        .layout_tests(false)
        .generate_comments(false);
    for function in FUNCTIONS.split_whitespace() {
        builder = builder.allowlist_function(function);
    }
    for constant in CONSTANTS {
        builder = builder.allowlist_var(constant);
    }
    builder
        .generate()
        .map_err(|error| format!("bindgen can not read PETSc's headers: {error}"))?
        .write_to_file(out.join("bindings.rs"))
        .map_err(|error| format!("can not write the bindings: {error}"))
}
