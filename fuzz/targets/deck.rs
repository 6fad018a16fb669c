//! Any bytes as an input file of Abaqus are a mesh or an error, plane and solid, whole and a region of it.
#![no_main]

use contact_petsc::mesh::FacetIndex;
use contact_petsc::mesh::abaqus::parse;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    contact_petsc_fuzz::watch();
    for region in [None, Some("left")] {
        if let Ok(mesh) = parse::<2>(bytes, region) {
            FacetIndex::new(&mesh);
        }
        if let Ok(mesh) = parse::<3>(bytes, region) {
            FacetIndex::new(&mesh);
        }
    }
});
