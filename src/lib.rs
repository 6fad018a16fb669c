//! Parallel implicit finite elements for dynamic, large-deformation, frictional contact, on PETSc.

pub mod assembly;
pub mod case;
pub mod cli;
pub mod commands;
pub mod contact;
pub mod dynamics;
pub mod element;
pub mod error;
pub mod lanes;
pub mod material;
pub mod mesh;
pub mod model;
pub mod output;
pub mod partition;
pub mod petsc;
pub mod plot;
pub mod simulation;
pub mod solvers;
pub mod space;
pub mod square;
#[cfg(test)]
pub mod taylor;
pub mod tensor;
pub mod terms;
pub mod time;
