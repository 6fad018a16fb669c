//! Parallel implicit finite elements for dynamic, large-deformation, frictional contact, on PETSc.
//!
//! After G. Szefer and D. Jasinska, *Dynamic analysis of large deformation contact of elastic bodies* (2001). This page
//! is the map of the program. Equation numbers are those of docs/theory.md, which keeps the paper's numbers.
//!
//! # Modules in the order of their dependencies
//!
//! What knows neither PETSc nor how meshes are distributed has two crates, so that the program and the tests share one
//! compiled form: `element` has the element kernels, and `serial` (`src/serial.rs`) the modules that they use, the case and
//! contact. This crate re-exports them under their names.
//!
//! A module imports from rows above its own, and from what stands beside it before a semicolon (`tests/layers.rs` reads the
//! imports and compares).
//!
//! | Layer | Modules | What they hold |
//! |---|---|---|
//! | 0 | [`error`], [`files`], [`collective`], [`rounding`], [`tensor`], [`square`], [`lanes`], [`derivatives`], [`composed`], [`terms`], [`matrix_format`] | causes and exit codes; files from outside; reductions over ranks; rounding perturbed on purpose; small tensors; SIMD lanes; numbers that carry derivatives; functions that are compiled once for all kernels; the terms of (3.5); formats of matrices |
//! | 1 | [`reader`]; [`petsc`]; [`checkpoint`] | reading YAML with places, units and functions; owners of PETSc's objects, files of its HDF5; checkpoints, from which a run resumes |
//! | 2 | [`mesh`], `contact::obstacle`; [`material`]; [`presets`]; [`schemes`]; `contact::normal`, `contact::friction`, `contact::damping` | data, named linear solvers and schemes, point laws |
//! | 3 | [`case`] | what the user writes |
//! | 4 | [`partition`] | METIS and PT-Scotch, who owns what, distribution |
//! | 5 | [`space`] | reference elements, quadrature, prescribed unknowns (3.1) and held directions (3.31) |
//! | 6 | [`element`]; [`contact`] | kernels: Q, K_0, K_NL, K_S, M; contact at vertices, by mortar segments between bodies and over obstacles (`contact::mortar`, docs/theory.md): gap, F_n, F_T and their tangents |
//! | 7 | [`model`]; [`dynamics`] | the checked case; what solvers and integrators see |
//! | 8 | [`assembly`] | where kernels, contact and PETSc meet: (3.5), (3.9) |
//! | 9 | [`solvers`]; [`time`]; [`observe`] | monolithic and staggered Newton, linear solvers; Newmark and its family; tables of the quantities that a run reports |
//! | 10 | [`output`], [`plot`] | tables, fields, record, console; figures |
//! | 11 | [`advice`]; [`guard`] | what to know of a case before it runs; supervision of a run |
//! | 12 | [`accuracy`] | control of step lengths, penalties and stick by requested errors |
//! | 13 | [`simulation`]; [`report`] | the run, in the order of the paper's section 3; a page about results |
//! | 14 | [`study`] | many runs: errors against costs, advice |
//! | 15 | [`commands`], [`cli`] | the command line |
//!
//! # From the paper's symbols to names
//!
//! | Paper | Here |
//! |---|---|
//! | B+, B- | contactor, target |
//! | q, q', q'' | `u`, `v`, `a` |
//! | E, S, T | `green_strain`, `second_piola`, `cauchy` |
//! | g_n | `gap` (> 0 is open) |
//! | P | `tangential_projector` |
//! | t_n (>= 0 in compression), t_T | `normal_traction`, `friction_traction` |
//! | eps of t_n; eps of phi | `normal_compliance` in m/Pa; `stick_velocity` in m/s |
//! | v_T, phi_eps | `slip_velocity`, `inverse_slip_speed` |
//! | mu, c_N, m_N, c_T, m_T | `coefficient`, `normal_stiffness`, `normal_exponent`, `tangential_stiffness`, `tangential_exponent` |
//! | M; K_0 + K_NL; K_S | [`Terms::MASS`](terms::Terms::MASS); `MATERIAL`; `GEOMETRIC` |
//! | K_CN; K_nT; K_T; K_mu | `NORMAL_CONTACT`; `FRICTION_NORMAL_COUPLING` (non-symmetric); `FRICTION_DAMPING`; `COEFFICIENT_CHANGE` |
//! | F_phi_n, F_phi_T of (2.16) | `ZONE_CHANGE`, `NORMAL_GEOMETRY`, `FRICTION_GEOMETRY`: change of area, of the normal and of where sides lie opposite each other |
//! | stage I (3.6), stage II (3.7) | [`Split`](dynamics::Split)`::NormalStage`, `FrictionStage`; `Terms::NORMAL_STAGE`, `FRICTION_STAGE` |
//! | Newmark's alpha, beta | `beta`, `gamma` |
//!
//! Signs: every term is its contribution to the left-hand side, minus the derivative of a force.

pub use element;
pub use serial::{
    case, collective, composed, contact, derivatives, error, files, lanes, material, matrix_format, mesh,
    presets, reader, rounding, schemes, space, square, taylor, tensor, terms,
};

pub mod accuracy;
pub mod advice;
pub mod assembly;
pub mod checkpoint;
pub mod cli;
pub mod commands;
pub mod dynamics;
pub mod guard;
pub mod model;
pub mod observe;
pub mod output;
pub mod partition;
pub mod petsc;
pub mod plot;
pub mod report;
pub mod simulation;
pub mod solvers;
pub mod study;
pub mod time;
