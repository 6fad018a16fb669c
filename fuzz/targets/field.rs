//! Any bytes are a piece of field output or an error; the cells of a piece lie within it.
#![no_main]

use contact_petsc::output::vtu_reader::parse;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    contact_petsc_fuzz::watch();
    let Ok(piece) = parse(bytes) else { return };
    for cell in 0..piece.types.len() {
        for point in piece.cell(cell) {
            assert!((*point as usize) < piece.points.len());
        }
    }
});
