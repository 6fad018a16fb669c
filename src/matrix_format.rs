//! Formats in which PETSc stores a matrix; presets name those that they work with.

/// Storage format of the values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Format {
    /// Scalar rows. Every preconditioner works, including algebraic multigrid.
    Aij,
    /// Blocks. Products and ILU take about half the time. Multigrid and MUMPS's Cholesky do not
    /// support it, and ICC of PETSc 3.18 crashes on a rank without rows. ILU(0), which is symmetric
    /// for a symmetric matrix, replaces ICC.
    Baij,
}
