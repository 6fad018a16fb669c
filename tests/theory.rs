//! Every citation of `docs/theory.md` has a target there.
//!
//! Citations have one of these forms, in sources, documents and case files:
//!
//! | Cited | Form |
//! |---|---|
//! | an equation | its number in parentheses alone |
//! | a section | `theory, section` and its number, or the same after a link to `theory.md` |
//! | a chapter | `theory, chapter` and its number, or the same after a link to `theory.md` |
//! | a section of the paper | the words "of the paper" or the authors after the number, or "the paper's" before |
//! | a section of another book | after the year of the book and a comma |
//!
//! Within `docs/theory.md` a section or chapter without these words is its own. Everything else
//! that looks like a citation is an error: the test would not know what it means.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Folders and files in which citations are collected.
const PLACES: &[&str] =
    &["src", "docs", "meshes", "tests", "benches", "fuzz/src", "fuzz/targets", "README.md", "CHANGELOG.md"];

/// Files that may hold citations.
const ENDINGS: &[&str] = &["rs", "md", "yml"];

/// Sections of the paper.
const PAPER: &[&str] = &["1", "2", "3", "4", "4.1", "4.2", "5"];

/// Equations of the paper, all of which the theory must have: the last number of each series.
const PRINTED: [(u32, u32); 2] = [(2, 16), (3, 10)];

/// The target of a citation.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Target {
    Equation(String),
    /// A section of the theory.
    Section(String),
    /// A chapter of the theory.
    Chapter(String),
    /// A section of the paper.
    Printed(String),
    /// A section of another book.
    Book,
    /// A form that is not allowed.
    Unclear(String),
}

/// The numbers in the theory.
struct Theory {
    equations: Vec<String>,
    sections: Vec<String>,
    chapters: Vec<String>,
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

impl Theory {
    fn new(text: &str) -> Self {
        let tags = text.split("\\tag{").skip(1).filter_map(|rest| rest.split('}').next());
        let heading = |line: &str, mark: &str| {
            let number = line.strip_prefix(mark)?.split(' ').next()?.trim_end_matches('.');
            number.starts_with(|c: char| c.is_ascii_digit()).then(|| number.to_owned())
        };
        Self {
            equations: tags.map(str::to_owned).collect(),
            sections: text.lines().filter_map(|line| heading(line, "### ")).collect(),
            chapters: text.lines().filter_map(|line| heading(line, "## ")).collect(),
        }
    }

    fn resolves(&self, target: &Target) -> bool {
        match target {
            Target::Equation(number) => self.equations.contains(number),
            Target::Section(number) => self.sections.contains(number),
            Target::Chapter(number) => self.chapters.contains(number),
            Target::Printed(number) => PAPER.contains(&number.as_str()),
            Target::Book => true,
            Target::Unclear(_) => false,
        }
    }
}

fn files(place: &Path, found: &mut Vec<PathBuf>) {
    if place.is_dir() {
        let mut entries: Vec<PathBuf> =
            fs::read_dir(place).expect("a folder").flatten().map(|entry| entry.path()).collect();
        entries.sort();
        entries.iter().for_each(|entry| files(entry, found));
    } else if place.extension().is_some_and(|end| ENDINGS.iter().any(|ending| end == *ending)) {
        found.push(place.to_owned());
    }
}

/// The text as one line. A citation may be broken at the end of a line, and the next line may start
/// with a comment mark.
fn joined(text: &str) -> String {
    let mut out = String::new();
    for line in text.lines() {
        let line = line.trim();
        let bare = ["//!", "///", "//", "#"].iter().find_map(|mark| line.strip_prefix(mark)).unwrap_or(line);
        out.push_str(bare.trim());
        out.push(' ');
    }
    out
}

/// The number `n` or `n.m` at the beginning of a text.
fn number(text: &str) -> Option<&str> {
    let digits = |text: &str| text.len() - text.trim_start_matches(|c: char| c.is_ascii_digit()).len();
    let first = digits(text);
    if first == 0 {
        return None;
    }
    let second = text[first..].strip_prefix('.').map_or(0, digits);
    Some(if second == 0 { &text[..first] } else { &text[..first + 1 + second] })
}

/// Numbers of equations: one digit, a point, one or two digits without a leading zero, in
/// parentheses that do not belong to a name.
fn equations(text: &str, found: &mut Vec<Target>) {
    for (place, _) in text.match_indices('(') {
        let belongs = |c: char| c.is_alphanumeric() || "_)]>!".contains(c);
        if text[..place].chars().next_back().is_some_and(belongs) {
            continue;
        }
        let inside = &text[place + 1..];
        let Some(number) = number(inside).filter(|number| inside[number.len()..].starts_with(')')) else {
            continue;
        };
        let Some((chapter, equation)) = number.split_once('.') else { continue };
        if chapter.len() == 1 && chapter != "0" && equation.len() <= 2 && !equation.starts_with('0') {
            found.push(Target::Equation(number.to_owned()));
        }
    }
}

/// Whether a text ends with a year and a comma, like the title of a book.
fn ends_with_year(text: &str) -> bool {
    let Some(rest) = text.trim_end().strip_suffix(',') else { return false };
    let digits = rest.chars().rev().take_while(char::is_ascii_digit).count();
    digits == 4
}

/// Sections and chapters, found by the word before the number.
fn parts(text: &str, within_theory: bool, found: &mut Vec<Target>) {
    let lower = text.to_ascii_lowercase();
    for (word, is_section) in [("section", true), ("chapter", false)] {
        for (place, _) in lower.match_indices(word) {
            let (before, after) = (&lower[..place], &lower[place + word.len()..]);
            if before.ends_with(|c: char| c.is_alphanumeric() || c == '_') {
                continue;
            }
            let (several, after) = after.strip_prefix('s').map_or((false, after), |rest| (true, rest));
            let Some(number) = after.strip_prefix(' ').and_then(number) else { continue };
            let behind = &after[1 + number.len()..];
            let before = before.trim_end();
            let of_theory = before.ends_with("theory,") || before.ends_with("theory.md),");
            let of_paper = before.ends_with("paper's")
                || [" of the paper", " of g. szefer"].iter().any(|words| behind.starts_with(words));
            let number = number.to_owned();
            found.push(if several {
                Target::Unclear(format!("{word}s {number}: cite them one by one"))
            } else if of_paper && is_section {
                Target::Printed(number)
            } else if of_theory || (within_theory && !ends_with_year(before)) {
                if is_section { Target::Section(number) } else { Target::Chapter(number) }
            } else if ends_with_year(before) {
                Target::Book
            } else {
                Target::Unclear(format!("{word} {number}: of the theory, or of the paper?"))
            });
        }
    }
}

fn citations(text: &str, within_theory: bool) -> Vec<Target> {
    let text = joined(text);
    let mut found = Vec::new();
    equations(&text, &mut found);
    parts(&text, within_theory, &mut found);
    found
}

/// Every citation in the repository resolves, and citations of each kind are found.
#[test]
fn citations_resolve() {
    let theory = Theory::new(&read(&root().join("docs/theory.md")));
    let mut paths = Vec::new();
    PLACES.iter().for_each(|place| files(&root().join(place), &mut paths));
    let mut broken = Vec::new();
    let mut all = Vec::new();
    for path in paths {
        let name = path.strip_prefix(root()).expect("a file of the repository").display().to_string();
        // The examples of this test are no citations.
        if name == "tests/theory.rs" {
            continue;
        }
        let within_theory = name == "docs/theory.md";
        let found = citations(&read(&path), within_theory);
        broken.extend(found.iter().filter(|c| !theory.resolves(c)).map(|c| format!("{name}: {c:?}")));
        all.extend(found.into_iter().map(|citation| (within_theory, citation)));
    }
    assert!(broken.is_empty(), "docs/theory.md does not have what is cited:\n{}", broken.join("\n"));
    let count = |within: bool, is: fn(&Target) -> bool| {
        all.iter().filter(|(inside, citation)| *inside == within && is(citation)).count()
    };
    let of_equations = |target: &Target| matches!(target, Target::Equation(_));
    let of_sections = |target: &Target| matches!(target, Target::Section(_));
    let of_chapters = |target: &Target| matches!(target, Target::Chapter(_));
    let of_paper = |target: &Target| matches!(target, Target::Printed(_));
    println!(
        "cited outside of the theory: {} equations, {} sections, {} chapters, {} sections of the paper; in it: {} equations, {} sections",
        count(false, of_equations),
        count(false, of_sections),
        count(false, of_chapters),
        count(false, of_paper),
        count(true, of_equations),
        count(true, of_sections)
    );
    // A search that finds nothing would pass.
    assert!(count(false, of_equations) >= 50);
    assert!(count(false, of_sections) >= 20);
    assert!(count(false, of_chapters) >= 2);
    assert!(count(false, of_paper) >= 15);
    assert!(count(true, of_equations) >= 60 && count(true, of_sections) >= 15);
}

/// The theory has every equation of the paper under its own number, uses no number twice, and skips
/// no number.
#[test]
fn theory_is_numbered_without_gaps() {
    let theory = Theory::new(&read(&root().join("docs/theory.md")));
    let split = |number: &String| -> (u32, u32) {
        let (chapter, rest) = number.split_once('.').expect("a number with two figures");
        (chapter.parse().expect("a chapter"), rest.parse().expect("a number"))
    };
    for numbers in [&theory.equations, &theory.sections] {
        let all: BTreeSet<(u32, u32)> = numbers.iter().map(split).collect();
        assert_eq!(all.len(), numbers.len(), "a number occurs twice");
        for &(chapter, number) in &all {
            assert!(theory.chapters.contains(&chapter.to_string()), "({chapter}.{number}) has no chapter");
            assert!(
                number == 1 || all.contains(&(chapter, number - 1)),
                "before {chapter}.{number} is a gap"
            );
        }
    }
    let sections: Vec<_> = theory.sections.iter().map(split).collect();
    assert!(sections.is_sorted(), "sections are not in order");
    let chapters: Vec<_> = (1..=theory.chapters.len()).map(|n| n.to_string()).collect();
    assert_eq!(theory.chapters, chapters);
    for (chapter, last) in PRINTED {
        for number in 1..=last {
            let number = format!("{chapter}.{number}");
            assert!(theory.equations.contains(&number), "the theory does not have ({number}) of the paper");
        }
    }
}

/// Each form of a citation is recognised, also across lines. Other text is ignored.
#[test]
fn forms_are_recognised() {
    let of = |text: &str| citations(text, false);
    let equation = |number: &str| Target::Equation(number.to_owned());
    let section = |number: &str| Target::Section(number.to_owned());
    assert_eq!(of("/// `M` of (3.5), (2.16)"), [equation("3.5"), equation("2.16")]);
    assert_eq!(of("phi(1.5) f[0](2.5) vec!(1.5) (0.5) (1.05) (12.5) (2.999) (3.) (3)"), []);
    assert_eq!(of("//! sums (theory, section 1.11): so"), [section("1.11")]);
    assert_eq!(of("//! sums (theory,\n    //! section 1.11)"), [section("1.11")]);
    assert_eq!(of("see ([theory.md](../theory.md), section\n  4.2)."), [section("4.2")]);
    assert_eq!(of("# rings (theory, chapter 4)"), [Target::Chapter("4".into())]);
    assert_eq!(
        of("Section 4.1 of the paper. The paper's section 3;"),
        [Target::Printed("4.1".into()), Target::Printed("3".into())]
    );
    assert_eq!(of("*Contact Mechanics*, 1985, section 7.2). cross-section area"), [Target::Book]);
    for unclear in ["see section 3.2", "theory, sections 1.2 and 1.3", "(formulation, section 6)"] {
        assert!(matches!(of(unclear)[..], [Target::Unclear(_)]), "{unclear}");
    }
    assert_eq!(citations("as in section 2.3", true), [section("2.3")]);
}

/// Citations without a target do not resolve.
#[test]
fn broken_citations_are_found() {
    let theory = Theory::new("## 1. One\n### 1.1 First\n$$ x \\tag{1.1} $$\n## Sources\n");
    let resolves = |text: &str| citations(text, false).iter().all(|citation| theory.resolves(citation));
    assert!(resolves("(1.1), theory, section 1.1, theory, chapter 1, section 4.2 of the paper"));
    let broken =
        ["(1.2)", "theory, section 1.2", "theory, chapter 2", "section 4.3 of the paper", "section 1.1"];
    assert!(broken.iter().all(|text| !resolves(text)));
}
