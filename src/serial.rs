//! What knows neither PETSc nor how meshes are distributed: the case file and its reader, meshes, laws and contact.
//! Only errors, on which ranks agree, and collective operations name MPI.
//!
//! The modules are on the map of the crate `contact_petsc`, which re-exports them. They are a crate of their own, so
//! that the program and all tests above them link one compiled form. The crate `element` has the element kernels,
//! which use these modules.

pub mod case;
pub mod collective;
pub mod composed;
pub mod contact;
pub mod derivatives;
pub mod error;
pub mod files;
pub mod lanes;
pub mod material;
pub mod matrix_format;
pub mod mesh;
pub mod presets;
pub mod reader;
pub mod rounding;
pub mod schemes;
pub mod space;
pub mod square;
pub mod taylor;
pub mod tensor;
pub mod terms;
