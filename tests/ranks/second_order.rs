//! Two deformable bodies of second-order elements, with curved facets: an indenter that slides over
//! a slab, and a cube over a cube.

use super::{Scene, invariant_by};

const RANKS: [usize; 3] = [2, 3, 4];

/// Facets of the indenter are as long as those of the slab, as is appropriate for second order.
const IRONING: [(&str, &str); 3] =
    [("cells: [48, 6]", "cells: [5, 2]"), ("cells: [40, 10]", "cells: [16, 3]"), ("end: 1,", "end: 0.4,")];

const CUBES: [(&str, &str); 4] = [
    ("cells: [10, 10, 10]", "cells: [3, 3, 2]"),
    ("cells: [8, 8, 8]", "cells: [2, 2, 1]"),
    ("end: 0.01,", "end: 0.0015,"),
    ("selective_reduced", "mean_dilatation"),
];

/// A scene with an element in place of the shipped one.
#[track_caller]
fn invariant(
    case: &'static str,
    changes: &[(&'static str, &'static str)],
    (shipped, element): (&'static str, &'static str),
) {
    let changes = [changes, &[(shipped, element)]].concat();
    invariant_by(&Scene { case, changes: changes.leak() }, "linear: direct", &RANKS);
}

#[test]
fn curved_facets_in_the_plane_on_1_2_3_4_ranks() {
    for element in ["quad8", "quad9"] {
        invariant("ironing/case.yml", &IRONING, ("quad4", element));
    }
}

#[test]
fn curved_facets_in_space_on_1_2_3_4_ranks() {
    for element in ["hex20", "hex27", "tet10"] {
        invariant("two-cubes/case.yml", &CUBES, ("hex8", element));
    }
}
