//! The scenes of two deformable bodies with each iterative solver that is selected automatically or
//! made for contact, on few and on many ranks.

use super::{Scene, invariant_by, scene};

/// Few and many ranks, for Krylov methods. With a factorisation every scene runs on all of
/// [`RANKS`].
const KRYLOV_RANKS: [usize; 2] = [2, 8];

/// The scenes for Krylov methods are short, so that many solvers can be tested.
const PLANE: Scene = scene(
    "concrete-block/case.yml",
    &[
        ("cells: [20, 10]", "cells: [8, 4]"),
        ("cells: [50, 16]", "cells: [20, 6]"),
        ("end: 0.094", "end: 5.0e-4"),
    ],
);

const CUBE_CELLS: [(&str, &str); 2] =
    [("cells: [10, 10, 10]", "cells: [5, 5, 3]"), ("cells: [8, 8, 8]", "cells: [4, 4, 3]")];

const SOLID: Scene =
    scene("two-cubes/case.yml", &[CUBE_CELLS[0], CUBE_CELLS[1], ("end: 0.01,", "end: 5.0e-4,")]);

/// The scenes without inertia.
const PRESSED: Scene = scene("two-cubes/case.yml", &[CUBE_CELLS[0], CUBE_CELLS[1], STATIC]);

const STATIC: (&str, &str) = (
    "start: { equilibrium: { friction: false, increments: 2 } }\ntime: { end: 0.01, step: 5.0e-4, scheme: { generalized_alpha: { spectral_radius: 0.8 } } }",
    "time: { end: 1.0e-3, step: 1.0e-3, scheme: { static: {} } }",
);

/// The scenes without inertia and without friction, hence with symmetric matrices.
const SLIDING: Scene = scene(
    "two-cubes/case.yml",
    &[
        CUBE_CELLS[0],
        CUBE_CELLS[1],
        STATIC,
        (
            "friction: { coulomb: { coefficient: 0.5, regularization: { stick_stiffness: 1.0e9 } } }",
            "friction: none",
        ),
    ],
);

#[test]
fn krylov_methods_in_the_plane_on_1_2_and_8_ranks() {
    for solver in ["linear: gmres_asm_ilu", "linear: two_stage", "strategy: staggered, linear: cg_icc"] {
        invariant_by(&PLANE, solver, &KRYLOV_RANKS);
    }
}

#[test]
fn krylov_methods_in_space_on_1_2_and_8_ranks() {
    for solver in [
        "linear: gmres_asm_ilu",
        "linear: filtered_ilu",
        "linear: two_stage",
        "strategy: staggered, linear: cg_icc",
    ] {
        invariant_by(&SOLID, solver, &KRYLOV_RANKS);
    }
}

#[test]
fn multigrid_on_1_2_and_8_ranks() {
    for solver in ["linear: filtered_amg", "linear: gmres_amg"] {
        invariant_by(&PRESSED, solver, &KRYLOV_RANKS);
    }
    for solver in ["linear: cg_icc", "linear: cg_filtered_amg"] {
        invariant_by(&SLIDING, solver, &KRYLOV_RANKS);
    }
}
