//! Start without `mpirun`.

/// Setting of Open MPI: a process without `mpirun` gets no helper process.
const ISOLATED: &str = "OMPI_MCA_ess_singleton_isolated";

/// Setting of Open MPI: whether a process has a session folder, which is for ranks that share memory.
const SESSION_FOLDER: &str = "OMPI_MCA_orte_create_session_dirs";

/// Variables that a launcher sets for its processes: `mpirun`, or a batch system that starts the ranks
/// itself.
const LAUNCHED: [&str; 3] = ["OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK"];

/// Whether no launcher started this process, so that it is the only rank.
pub(super) fn is_alone() -> bool {
    LAUNCHED.iter().all(|name| std::env::var_os(name).is_none())
}

/// Spares a process without `mpirun` Open MPI's helper process and session folder, unless the user chose
/// otherwise. The process must have no threads yet.
///
/// The helper would start further processes on demand, and this program never does: `contact-petsc check` of
/// a small case took 0.18 s without it and 0.31 s with it. All processes without helper on a machine would
/// share one session folder, which each of them removes at its end, so that starts at the same time fail.
pub(super) fn isolate() {
    if !is_alone() || std::env::var_os(ISOLATED).is_some() {
        return;
    }
    let folder_is_chosen = std::env::var_os(SESSION_FOLDER).is_some();
    // SAFETY: no other thread reads or writes the environment, because MPI has not started.
    unsafe {
        std::env::set_var(ISOLATED, "1");
        if !folder_is_chosen {
            std::env::set_var(SESSION_FOLDER, "0");
        }
    }
}
