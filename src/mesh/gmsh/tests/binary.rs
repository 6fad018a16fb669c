//! Binary files: both byte orders, and truncated or damaged files.

use std::time::{Duration, Instant};

use proptest::prelude::*;

use super::super::parse;
use super::{FORMATS, bytes};
use crate::mesh::Mesh;

/// Writes the small mesh as binary in either byte order.
struct Writer {
    bytes: Vec<u8>,
    big: bool,
}

impl Writer {
    fn text(&mut self, text: &str) {
        self.bytes.extend_from_slice(text.as_bytes());
    }

    fn ints(&mut self, values: impl IntoIterator<Item = i32>) {
        for value in values {
            self.bytes.extend(if self.big { value.to_be_bytes() } else { value.to_le_bytes() });
        }
    }

    fn sizes(&mut self, values: impl IntoIterator<Item = u64>) {
        for value in values {
            self.bytes.extend(if self.big { value.to_be_bytes() } else { value.to_le_bytes() });
        }
    }

    fn reals(&mut self, values: impl IntoIterator<Item = f64>) {
        self.sizes(values.into_iter().map(f64::to_bits));
    }
}

const POINTS: [[f64; 3]; 6] =
    [[0., 0., 0.], [1., 0., 0.], [2., 0., 0.], [0., 1., 0.], [1., 1., 0.], [2., 1., 0.]];
const QUADS: [[i32; 4]; 2] = [[1, 2, 5, 4], [2, 3, 6, 5]];

/// The quadrilaterals in MSH 2.2, both in one block, or in 4.1 with parametric nodes.
fn binary(version: &str, big: bool) -> Vec<u8> {
    let mut w = Writer { bytes: Vec::new(), big };
    w.text(&format!("$MeshFormat\n{version} 1 8\n"));
    w.ints([1]);
    w.text("\n$EndMeshFormat\n");
    if version == "2.2" {
        w.text("$Nodes\n6\n");
        for (id, point) in (1..).zip(POINTS) {
            w.ints([id]);
            w.reals(point);
        }
        w.text("\n$EndNodes\n$Elements\n2\n");
        w.ints([3, 2, 2]);
        for (id, quad) in (1..).zip(QUADS) {
            w.ints([id, 7, 1]);
            w.ints(quad);
        }
    } else {
        w.text("$Entities\n");
        w.sizes([0, 0, 1, 0]);
        w.ints([1]);
        w.reals([0.0; 6]);
        w.sizes([1]);
        w.ints([-7]);
        w.sizes([2]);
        w.ints([1, -2]);
        w.text("\n$EndEntities\n$Nodes\n");
        w.sizes([1, 6, 1, 6]);
        w.ints([2, 1, 1]);
        w.sizes([6]);
        w.sizes(1..=6);
        for point in POINTS {
            w.reals(point);
            w.reals([0.5, 0.5]);
        }
        w.text("\n$EndNodes\n$Elements\n");
        w.sizes([1, 2, 1, 2]);
        w.ints([2, 1, 3]);
        w.sizes([2]);
        for (id, quad) in (1..).zip(QUADS) {
            w.sizes([id]);
            w.sizes(quad.map(|n| n as u64));
        }
    }
    w.text("\n$EndElements\n");
    w.bytes
}

/// Both byte orders give the same mesh, in both formats.
#[test]
fn both_byte_orders_are_read() {
    let expected: Mesh<2> = parse(&binary("2.2", false), None).unwrap();
    assert_eq!(expected.points, POINTS.map(|p| [p[0], p[1]]));
    assert_eq!(expected.element_nodes(1), [1, 2, 5, 4]);
    assert_eq!(expected.element_sets["7"], [0, 1]);
    for version in ["2.2", "4.1"] {
        for big in [false, true] {
            assert_eq!(parse::<2>(&binary(version, big), None).unwrap(), expected, "{version} {big}");
        }
    }
}

/// Each group of eight bytes of a binary file in turn becomes a huge count. Each file is rejected
/// immediately, with little memory.
#[test]
fn huge_counts_are_refused_quickly() {
    let start = Instant::now();
    for version in ["2.2", "4.1"] {
        let good = binary(version, false);
        for at in 0..good.len() - 8 {
            let mut bad = good.clone();
            bad[at..at + 8].copy_from_slice(&0x7fff_ffff_7fff_ffffu64.to_le_bytes());
            let _ = parse::<2>(&bad, None);
        }
    }
    assert!(start.elapsed() < Duration::from_secs(10));
}

/// A file that is truncated anywhere before its last word is rejected, in every format.
#[test]
fn truncated_files_are_refused() {
    for format in FORMATS {
        let whole = bytes("quad8", format);
        for length in 0..whole.len() - 1 {
            assert!(parse::<2>(&whole[..length], None).is_err(), "{format} cut after {length} bytes");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    /// Damaged bytes never make the reader panic.
    #[test]
    fn damaged_files_never_panic(
        kind in prop::sample::select(vec!["quad4", "tri6", "quad9", "tet10", "hex27"]),
        format in prop::sample::select(FORMATS.to_vec()),
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let mut file = bytes(kind, format);
        for (at, value) in damage {
            let at = at.index(file.len());
            file[at] = value;
        }
        if let Some(cut) = cut {
            file.truncate(cut.index(file.len()));
        }
        let _ = parse::<2>(&file, None);
        let _ = parse::<3>(&file, None);
        let _ = parse::<2>(&file, Some("rubber"));
    }
}
