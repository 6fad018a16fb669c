//! Any bytes are a mesh or an error, in both formats, as text and binary, plane and solid, whole and a region of it.
#![no_main]

use contact_petsc::mesh::gmsh::parse;
use contact_petsc::mesh::FacetIndex;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    contact_petsc_fuzz::watch();
    for region in [None, Some("left"), Some("1")] {
        if let Ok(mesh) = parse::<2>(bytes, region) {
            FacetIndex::new(&mesh);
        }
        if let Ok(mesh) = parse::<3>(bytes, region) {
            FacetIndex::new(&mesh);
        }
    }
});
