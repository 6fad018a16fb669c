//! Any text is a case or an error with a place; what is a case can be written, and read again as the same.
#![no_main]

use contact_petsc::case::Case;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    contact_petsc_fuzz::watch();
    let Ok(case) = Case::parse(text, "case.yml") else { return };
    let yaml = case.to_yaml().expect("a case can be written as YAML");
    case.to_json().expect("a case can be written as JSON");
    let again = Case::parse(&yaml, "again.yml").unwrap_or_else(|error| panic!("{error}\n{yaml}"));
    let twice = again.to_yaml().expect("a case can be written as YAML");
    assert_eq!(yaml, twice, "a completed case is complete");
});
