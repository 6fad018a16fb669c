//! Meshes, materials and element kernels, and the reader of their parameters.

pub mod collective;
pub mod composed;
pub mod derivatives;
pub mod element;
pub mod error;
pub mod files;
pub mod lanes;
pub mod material;
pub mod mesh;
pub mod reader;
pub mod rounding;
pub mod space;
pub mod square;
pub mod taylor;
pub mod tensor;
pub mod terms;
