//! Any bytes are a checkpoint or an error: as they are, and with the hash that they should have, which opens what lies
//! behind it, down to the rows of its sections.
#![no_main]

use std::io::Cursor;
use std::path::Path;

use contact_petsc::checkpoint::{StoredTable, examine, fill};
use libfuzzer_sys::fuzz_target;
use sha2::{Digest, Sha256};

fuzz_target!(|bytes: &[u8]| {
    contact_petsc_fuzz::watch();
    let path = Path::new("step-000001.ckpt");
    let _ = examine(path, &mut Cursor::new(bytes), bytes.len() as u64);
    let mut whole = bytes[..bytes.len().saturating_sub(32)].to_vec();
    let hash = Sha256::digest(&whole);
    whole.extend_from_slice(&hash);
    let length = whole.len() as u64;
    if let Ok(header) = examine(path, &mut Cursor::new(&whole), length) {
        let words: u64 = header.sections.iter().map(|s| s.rows * (1 + s.columns.len() as u64)).sum();
        assert!(8 * words <= length, "the sections lie within the file");
        // Few keys of each section, backwards: what a rank wants that owns a part of the mesh.
        let table = |section: &contact_petsc::checkpoint::FileSection| {
            let keys = (0..section.rows.min(9)).rev().collect();
            StoredTable::keyed(&section.name, section.columns.clone(), keys, 4)
        };
        let mut tables: Vec<StoredTable> = header.sections.iter().map(table).collect();
        if fill(path, &mut Cursor::new(&whole), length, &mut tables).is_ok() {
            assert!(tables.iter().all(|table| table.words.len() == table.keys.len() * table.columns.len()));
        }
    }
});
