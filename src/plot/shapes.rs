//! Outlines of VTK cells: the polygon of a flat cell, or the faces of a solid one, including
//! mid-side nodes.

/// VTK cell types line2 and line3.
const LINES: [u8; 2] = [3, 21];

const TETRA_4: [&[u8]; 4] = [&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[2, 0, 3]];
const TETRA_10: [&[u8]; 4] =
    [&[0, 6, 2, 5, 1, 4], &[0, 4, 1, 8, 3, 7], &[1, 5, 2, 9, 3, 8], &[2, 6, 0, 7, 3, 9]];
const HEXA_8: [&[u8]; 6] =
    [&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]];
const WEDGE_6: [&[u8]; 5] = [&[0, 2, 1], &[3, 4, 5], &[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]];
const PYRAMID_5: [&[u8]; 5] = [&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]];
const HEXA_20: [&[u8]; 6] = [
    &[0, 11, 3, 10, 2, 9, 1, 8],
    &[4, 12, 5, 13, 6, 14, 7, 15],
    &[0, 8, 1, 17, 5, 12, 4, 16],
    &[1, 9, 2, 18, 6, 13, 5, 17],
    &[2, 10, 3, 19, 7, 14, 6, 18],
    &[3, 11, 0, 16, 4, 15, 7, 19],
];

/// The polygons that bound a cell of a VTK type, as positions in its node list. There is one for a
/// flat cell, one per face for a solid one, and two or three points for a line. An unknown type has
/// no polygons.
pub fn polygons(vtk_type: u8) -> &'static [&'static [u8]] {
    match vtk_type {
        3 => &[&[0, 1]],
        21 => &[&[0, 2, 1]],
        5 => &[&[0, 1, 2]],
        22 => &[&[0, 3, 1, 4, 2, 5]],
        9 => &[&[0, 1, 2, 3]],
        23 | 28 => &[&[0, 4, 1, 5, 2, 6, 3, 7]],
        10 => &TETRA_4,
        24 => &TETRA_10,
        12 => &HEXA_8,
        13 => &WEDGE_6,
        14 => &PYRAMID_5,
        25 | 29 => &HEXA_20,
        _ => &[],
    }
}

/// Whether the cell fills a volume.
pub fn is_solid(vtk_type: u8) -> bool {
    [10, 12, 13, 14, 24, 25, 29].contains(&vtk_type)
}

/// Whether the cell is a line, which is the contact facet in 2D.
pub fn is_line(vtk_type: u8) -> bool {
    LINES.contains(&vtk_type)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    /// The faces of a solid are closed: each edge, including its mid-side node, belongs to two
    /// faces that traverse it in opposite directions.
    #[test]
    fn solids_are_closed() {
        for (vtk_type, edges) in [(10, 6), (24, 12), (12, 12), (13, 9), (14, 8), (25, 24), (29, 24)] {
            let mut count: BTreeMap<(u8, u8), i32> = BTreeMap::new();
            for face in polygons(vtk_type) {
                for (i, &a) in face.iter().enumerate() {
                    let b = face[(i + 1) % face.len()];
                    *count.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { 10 };
                }
            }
            assert_eq!(count.len(), edges, "kind {vtk_type}");
            assert!(count.values().all(|&n| n == 11), "kind {vtk_type}: {count:?}");
        }
    }
}
