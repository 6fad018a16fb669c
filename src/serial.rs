//! What knows neither PETSc nor how meshes are distributed: the case file and its reader, meshes, laws, and the
//! kernels of elements and contact. Only errors, on which ranks agree, and collective operations name MPI.
//!
//! The modules are on the map of the crate `contact_petsc`, which re-exports them. They are a crate of their own
//! because they take most of the time of a build: the program and all tests above them link one compiled form.

pub mod case;
pub mod collective;
pub mod composed;
pub mod contact;
pub mod derivatives;
pub mod element;
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
