//! Combination of the user's PETSc options with those of a preset. The user's options take
//! precedence, and methods that the matrix does not allow are rejected.

use crate::error::{Error, Result};
use crate::petsc::KrylovSolver;

/// Options of a preset that remain beside the user's options. A method or preconditioner of the
/// user replaces that of the preset, with all related options.
pub(super) fn beside_the_users(
    mut options: Vec<(&'static str, &'static str)>,
    given: impl Fn(&str) -> bool,
) -> Vec<(&'static str, &'static str)> {
    let method = |name: &str| name.starts_with("ksp_");
    if given("ksp_type") {
        options.retain(|(name, _)| !method(name));
    }
    if given("pc_type") {
        options.retain(|&(name, value)| method(name) && value != "preonly");
    }
    options
}

/// Methods of PETSc that rely on a symmetric operator.
const SYMMETRIC_METHODS: [&str; 8] = ["cg", "fcg", "pipecg", "groppcg", "minres", "symmlq", "nash", "stcg"];

/// Rejects a method that the user chose by PETSc options and that this matrix does not allow.
///
/// # Errors
/// If the user chose such a method.
pub(super) fn refuse_symmetric_method(krylov: &KrylovSolver) -> Result<()> {
    let (method, _) = krylov.types()?;
    if !SYMMETRIC_METHODS.contains(&method.as_str()) {
        return Ok(());
    }
    let message = format!(
        "KSP type '{method}' needs a symmetric matrix, but friction or a follower load makes this one \
         non-symmetric"
    );
    Err(Error::case(message).hint("use -ksp_type gmres or fgmres, or remove the option"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solvers::PRESETS;

    /// The user's method or preconditioner is not combined with the preset's options for it.
    #[test]
    fn the_users_choice_replaces_the_presets() {
        for preset in PRESETS {
            let options = preset.options_on(2);
            let none = beside_the_users(options.clone(), |_| false);
            assert_eq!(none, options, "{}", preset.name);
            let method = beside_the_users(options.clone(), |name| name == "ksp_type");
            assert!(method.iter().all(|(name, _)| !name.starts_with("ksp_")), "{}", preset.name);
            let preconditioner = beside_the_users(options, |name| name == "pc_type");
            assert!(
                preconditioner.iter().all(|(name, value)| name.starts_with("ksp_") && *value != "preonly")
            );
        }
    }
}
