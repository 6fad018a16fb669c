//! Factorisation on one of several ranks.

/// Options of a factorisation on all ranks, and the corresponding options for a factorisation on
/// one of several ranks.
const ON_ONE_RANK: [(&str, &str); 4] = [
    ("pc_type", "telescope_pc_type"),
    ("pc_factor_mat_solver_type", "telescope_pc_factor_mat_solver_type"),
    ("mat_mumps_icntl_7", "telescope_mat_mumps_icntl_7"),
    ("mat_mumps_icntl_14", "telescope_mat_mumps_icntl_14"),
];

/// Returns the options of a factorisation that runs on one of `ranks` ranks. They do not apply if
/// the user chose a preconditioner.
///
/// On several ranks MUMPS rounds differently in each run, and it is not faster on small problems.
pub fn on_one_rank<'a>(options: &[(&'a str, &'a str)], ranks: &'a str) -> Vec<(&'a str, &'a str)> {
    let there = |(key, value): &(&'a str, &'a str)| {
        let known = ON_ONE_RANK.iter().find(|(own, _)| own == key);
        (known.map_or(*key, |(_, there)| there), *value)
    };
    let method = [
        ("pc_type", "telescope"),
        ("pc_telescope_reduction_factor", ranks),
        ("telescope_ksp_type", "preonly"),
    ];
    options.iter().map(there).chain(method).collect()
}
