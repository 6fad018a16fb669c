//! The columns of `study.csv` that do not depend on the study.

/// Columns that every study has, so that no axis or quantity may be called so.
pub const COLUMNS: [&str; 14] = [
    "member",
    "verdict",
    "cpu [s]",
    "wall [s]",
    "newton",
    "krylov",
    "steps",
    "cut steps",
    "unknowns",
    "peak memory [MiB]",
    "energy drift",
    "ranks",
    "front of",
    "reason",
];
