//! A surface of triangles in space, without elements.

/// A surface as points \[in the units of the file\] and triangles.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SurfaceMesh {
    /// Points, each once.
    pub points: Vec<[f64; 3]>,
    /// Corners of the triangles.
    pub triangles: Vec<[u32; 3]>,
}
