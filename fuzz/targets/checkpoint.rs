//! Any bytes are a checkpoint or an error: as they are, and with the hash that they should have, which opens what lies
//! behind it.
#![no_main]

use std::io::Cursor;
use std::path::Path;

use contact_petsc::checkpoint::examine;
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
    }
});
