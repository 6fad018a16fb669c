//! Reader of triangle surfaces: STL files, as text or binary, and Gmsh meshes.

use std::collections::HashMap;

use super::SurfaceMesh;
use super::gmsh;
use crate::error::{Error, Result};

/// Bytes before the triangles of a binary STL file: a comment and their number.
const HEADER: usize = 84;
/// Bytes of a triangle of a binary STL file.
const RECORD: usize = 50;
const SAVE: &str = "save the surface again as STL (text or binary) or as a Gmsh mesh";

/// Reads a surface from the bytes of a file.
///
/// # Errors
/// The file is damaged, truncated or of unknown format. The message has a line or the expected
/// length.
pub fn surface(bytes: &[u8]) -> Result<SurfaceMesh> {
    let start = bytes.trim_ascii_start();
    if start.starts_with(b"$MeshFormat") || start.starts_with(b"$Comments") {
        return gmsh::surface(bytes);
    }
    let count = bytes.get(80..HEADER).and_then(|four| four.try_into().ok()).map(u32::from_le_bytes);
    let length = count.map(|count| HEADER as u64 + RECORD as u64 * u64::from(count));
    // Some programs begin the comment of a binary file with `solid`.
    if start.starts_with(b"solid") && length != Some(bytes.len() as u64) {
        return text(bytes);
    }
    match (count, length) {
        (Some(count), Some(length)) if length == bytes.len() as u64 => Ok(binary(bytes, count)),
        (Some(count), Some(length)) => {
            let found = bytes.len();
            let message = format!(
                "neither a text nor a binary STL file: with {count} triangles, the number in its header, a \
                 binary file has {length} bytes, but this file has {found}: it is damaged or truncated"
            );
            Err(Error::file(message).hint(SAVE))
        }
        _ => Err(Error::file("neither an STL file nor a Gmsh mesh").hint(SAVE)),
    }
}

fn binary(bytes: &[u8], count: u32) -> SurfaceMesh {
    let mut builder = Builder::with_capacity(count as usize);
    for record in bytes[HEADER..].chunks_exact(RECORD) {
        // Twelve bytes of a normal precede the corners.
        let number = |k: usize| {
            let mut four = [0; 4];
            four.copy_from_slice(&record[12 + 4 * k..][..4]);
            f64::from(f32::from_le_bytes(four))
        };
        builder.push(std::array::from_fn(|corner| std::array::from_fn(|i| number(3 * corner + i))));
    }
    builder.mesh
}

fn text(bytes: &[u8]) -> Result<SurfaceMesh> {
    let fault = |line: usize, message: &str| Err(Error::file(format!("line {line}: {message}")).hint(SAVE));
    let mut builder = Builder::with_capacity(bytes.len() / 200);
    let mut corners: Vec<[f64; 3]> = Vec::with_capacity(3);
    let (mut inside, mut last) = (false, 0);
    for (number, line) in bytes.split(|&byte| byte == b'\n').enumerate() {
        let number = number + 1;
        let Ok(line) = std::str::from_utf8(line) else {
            return fault(number, "not text: an STL file that begins with 'solid' is text");
        };
        let mut words = line.split_ascii_whitespace();
        let Some(word) = words.next() else { continue };
        last = number;
        match word.to_ascii_lowercase().as_str() {
            "solid" => inside = true,
            "endsolid" => inside = false,
            "facet" | "outer" | "endloop" => {}
            "vertex" => {
                let mut corner = [f64::NAN; 3];
                for x in &mut corner {
                    let Some(value) = words.next().and_then(|word| word.parse().ok()) else {
                        return fault(number, "expected three numbers after 'vertex'");
                    };
                    *x = value;
                }
                corners.push(corner);
            }
            "endfacet" => {
                let Ok(triangle) = <[[f64; 3]; 3]>::try_from(&corners[..]) else {
                    return fault(number, &format!("expected a facet of 3 corners, found {}", corners.len()));
                };
                builder.push(triangle);
                corners.clear();
            }
            other => {
                let shown: String = other.chars().take(20).collect();
                return fault(number, &format!("unknown word '{shown}' in an STL file"));
            }
        }
    }
    if inside || !corners.is_empty() {
        return fault(last, "the file ends without 'endsolid': it is truncated");
    }
    Ok(builder.mesh)
}

/// Joins equal corners of triangles.
#[derive(Default)]
struct Builder {
    known: HashMap<[u64; 3], u32>,
    mesh: SurfaceMesh,
}

impl Builder {
    fn with_capacity(triangles: usize) -> Self {
        let known = HashMap::with_capacity(triangles / 2 + 1);
        Self { known, mesh: SurfaceMesh::default() }
    }

    /// Adds a triangle, except if two of its corners are one point.
    fn push(&mut self, corners: [[f64; 3]; 3]) {
        let triangle = corners.map(|corner| {
            // Zero has two signs.
            let key = corner.map(|x| (x + 0.0).to_bits());
            *self.known.entry(key).or_insert_with(|| {
                self.mesh.points.push(corner);
                self.mesh.points.len() as u32 - 1
            })
        });
        let [a, b, c] = triangle;
        if a != b && b != c && c != a {
            self.mesh.triangles.push(triangle);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "solid x\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex -0 1e0 0\n \
                        endloop\nendfacet\nfacet normal 0 0 0\nouter loop\nvertex 1 0 0\nvertex 1 0 0\nvertex 0 0 0\n\
                        endloop\nendfacet\nendsolid x\n";

    fn binary_of(triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
        let mut bytes = b"solid by a program".to_vec();
        bytes.resize(80, b' ');
        bytes.extend((triangles.len() as u32).to_le_bytes());
        for triangle in triangles {
            bytes.extend([0; 12]);
            bytes.extend(triangle.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }

    /// Text, binary and Gmsh files of one triangle give the same surface. Points occur once, and
    /// triangles of two points are omitted.
    #[test]
    fn formats_agree() {
        let text = surface(TEXT.as_bytes()).unwrap();
        assert_eq!(text.triangles, [[0, 1, 2]]);
        assert_eq!(text.points, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let bytes = binary_of(&[[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [-0.0, 1.0, 0.0]]]);
        assert_eq!(surface(&bytes).unwrap(), text);
        let gmsh = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n9 5 5 5\n$EndNodes\n\
                    $Elements\n2\n1 15 2 0 1 9\n2 2 2 0 1 1 2 3\n$EndElements\n";
        assert_eq!(surface(gmsh.as_bytes()).unwrap(), text);
    }

    /// Every truncation and many damages give an error or a surface, never a panic. Messages name a
    /// line or lengths.
    #[test]
    fn damaged_files_are_refused() {
        let refused = |bytes: &[u8]| surface(bytes).unwrap_err().to_string();
        assert!(refused(b"").contains("neither"));
        assert!(refused(&[7; 300]).contains("damaged or truncated"));
        assert!(refused(&TEXT.as_bytes()[..69]).contains("truncated"));
        assert!(refused(TEXT.replace("1e0", "one").as_bytes()).contains("line 6: expected three numbers"));
        assert!(
            refused(TEXT.replace("endloop", "noise").as_bytes()).contains("line 7: unknown word 'noise'")
        );
        assert!(refused(TEXT.replacen("vertex 1 0 0", "", 1).as_bytes()).contains("3 corners, found 2"));
        assert!(refused(b"solid \xff\n").contains("not text"));
        let good = binary_of(&[[[0.0; 3], [1.0; 3], [2.0; 3]]; 2]);
        for length in 0..good.len() {
            assert!(surface(&good[..length]).is_err());
        }
        for at in 0..TEXT.len() {
            let mut bytes = TEXT.as_bytes().to_vec();
            bytes[at] = 0xf3;
            let _ = surface(&bytes);
            let _ = surface(&TEXT.as_bytes()[..at]);
        }
    }
}
