//! Files that are no case, texts made to hurt, and any text at all: an error, and never a panic.

use proptest::prelude::*;

use super::super::Case;
use super::{GOOD, message, with};
use crate::error::Cause;

/// What is not a case at all is refused, too.
#[test]
fn documents_that_are_no_case_are_refused() {
    for (text, words) in [
        ("", "the case is empty"),
        ("  \n", "the case is empty"),
        ("# nothing\n", "holds only comments"),
        ("---\n", "holds only comments"),
        ("just words", "expected a mapping"),
        ("[1, 2]", "expected a mapping"),
        ("bodies: {}\ndimension: 2\ntime: { end: 1, step: 1 }", "at least one body"),
    ] {
        let message = message(text);
        assert!(message.contains(words) && message.starts_with("case.yml:"), "{text:?}: {message}");
    }
}

/// Nesting and aliases that explode end in an error, quickly and without exhausting the stack.
#[test]
fn nesting_and_alias_bombs_are_refused() {
    let deep = format!("title: {}{}", "[".repeat(100_000), "]".repeat(100_000));
    let mut bomb = String::from("a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n");
    for level in 1..12 {
        let alias = format!("*a{}, ", level - 1).repeat(10);
        bomb.push_str(&format!("a{level}: &a{level} [{alias}]\n"));
    }
    let aliased = with("\"1.0 * t\"", "*deep").replace("title: A", "title: &deep A");
    let parentheses = with("\"1.0 * t\"", &format!("\"{}t{}\"", "(".repeat(5000), ")".repeat(5000)));
    let signs = with("\"1.0 * t\"", &format!("\"{}t\"", "-".repeat(5000)));
    let sum = with("\"1.0 * t\"", &format!("\"{}t\"", "t+".repeat(5000)));
    for text in [deep, bomb, aliased, parentheses, signs, sum] {
        assert!(message(&text).starts_with("case.yml:"));
    }
}

/// A file that is not there is a file error, one that is not text a case error.
#[test]
fn unreadable_files_have_their_cause() {
    let missing = Case::read(std::path::Path::new("no/such/case.yml")).map_err(|error| error.cause);
    assert_eq!(missing, Err(Cause::File));
    let binary = std::env::temp_dir().join(format!("contact-petsc-binary-{}.yml", std::process::id()));
    std::fs::write(&binary, [0xff, 0xfe, 0x00]).unwrap();
    let refused = Case::read(&binary).map_err(|error| error.cause);
    std::fs::remove_file(&binary).unwrap();
    assert_eq!(refused, Err(Cause::Case));
}

proptest! {
    /// No text makes the reader panic.
    #[test]
    fn arbitrary_text_never_panics(text in "\\PC*") {
        let _ = Case::parse(&text, "case.yml");
    }

    /// Nor does a good case with a piece replaced by anything.
    #[test]
    fn a_damaged_case_never_panics(start in 0..GOOD.len(), length in 0..40usize, to in "[ -~\n\tµ€]{0,12}") {
        let mut text = GOOD.to_string();
        text.replace_range(start..(start + length).min(GOOD.len()), &to);
        let _ = Case::parse(&text, "case.yml");
    }

    /// Nor does any expression or unit.
    #[test]
    fn arbitrary_expressions_and_units_never_panic(text in "([-+*/^().,<>=!a-z0-9 µ€]|and|or|not|if|mod|atan2){0,40}") {
        let _ = crate::case::Function::expression(&text).map(|function| function.motion([0.1, 0.2, 0.3], 0.4));
        let _ = crate::reader::condition::Condition::parse(&text).map(|condition| condition.holds([0.1, 0.2, 0.3]));
        let _ = crate::reader::unit::parse(&text);
    }
}
