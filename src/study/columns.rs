//! The columns of `study.csv` that do not depend on the study.

/// Columns that every study has. No axis or quantity may use these names.
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
