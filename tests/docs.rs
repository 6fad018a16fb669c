//! The book: every link of every page resolves, every page is in the table of contents, and
//! generated pages are up to date.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};

/// Folders with pages. Pages in the root of the repository belong to the book as well.
const FOLDERS: &[&str] = &["docs", "meshes", "tests", "fuzz", "scripts", "petsc-sys", "benches", "src"];

/// Folders that a build or a run creates.
const LEFT_BEHIND: &[&str] = &["target", "results", "corpus", "artifacts", "node_modules"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn is_page(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "md")
}

/// All Markdown files below a folder.
fn collect(folder: &Path, pages: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        let name = entry.file_name().to_string_lossy().into_owned();
        let kind = entry.file_type().expect("a kind of file");
        if kind.is_dir() && !name.starts_with('.') && !LEFT_BEHIND.contains(&name.as_str()) {
            collect(&path, pages);
        } else if kind.is_file() && is_page(&path) {
            pages.push(path);
        }
    }
}

/// All pages of the repository, relative to its root.
fn pages() -> Vec<PathBuf> {
    let mut pages: Vec<PathBuf> = fs::read_dir(root()).unwrap().flatten().map(|entry| entry.path()).collect();
    pages.retain(|path| path.is_file() && is_page(path));
    FOLDERS.iter().for_each(|folder| collect(&root().join(folder), &mut pages));
    pages.sort();
    pages.into_iter().map(|page| page.strip_prefix(root()).unwrap().to_owned()).collect()
}

/// The lines of a page that are not code, with their numbers.
fn prose(text: &str) -> Vec<(usize, &str)> {
    let mut fence: Option<&str> = None;
    let mut lines = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let start = line.trim_start();
        let mark = ["```", "~~~"].into_iter().find(|mark| start.starts_with(mark));
        match (fence, mark) {
            (None, Some(mark)) => fence = Some(mark),
            (Some(open), Some(mark)) if open == mark => fence = None,
            (Some(_), _) => {}
            (None, None) => lines.push((number + 1, line)),
        }
    }
    lines
}

/// A line without its code spans.
fn without_code(line: &str) -> String {
    let mut kept = String::new();
    for (index, part) in line.split('`').enumerate() {
        if index % 2 == 0 {
            kept.push_str(part);
        }
    }
    kept
}

/// Targets of the links and pictures of a line.
fn targets(line: &str) -> Vec<String> {
    let line = without_code(line);
    let mut targets = Vec::new();
    let mut rest = line.as_str();
    while let Some(start) = rest.find("](") {
        rest = &rest[start + 2..];
        let Some(end) = rest.find(')') else { break };
        let target = rest[..end].split_whitespace().next().unwrap_or_default();
        targets.push(target.trim_matches(['<', '>']).to_owned());
        rest = &rest[end..];
    }
    let definition = line.trim_start().strip_prefix('[').and_then(|rest| rest.split_once("]: "));
    targets.extend(definition.map(|(_, target)| target.trim().to_owned()));
    targets
}

/// The anchors that a forge generates from the headings of a page, and those that the page defines
/// itself.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut anchors = BTreeSet::new();
    let mut repeated: BTreeMap<String, usize> = BTreeMap::new();
    for (_, line) in prose(text) {
        let marks = line.chars().take_while(|c| *c == '#').count();
        if (1..=6).contains(&marks) && line[marks..].starts_with(' ') {
            let slug = slug(line[marks..].trim());
            let count = repeated.entry(slug.clone()).or_insert(0);
            anchors.insert(if *count == 0 { slug } else { format!("{slug}-{count}") });
            *count += 1;
        }
        for part in line.split("id=\"").skip(1) {
            anchors.extend(part.split('"').next().map(str::to_owned));
        }
    }
    anchors
}

fn slug(heading: &str) -> String {
    let kept = heading.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.collect::<String>().to_lowercase().replace(' ', "-")
}

/// The path of a relative target from the root of the repository. `None` if it leaves the
/// repository.
fn resolve(page: &Path, target: &str) -> Option<PathBuf> {
    let mut path = PathBuf::new();
    for part in page.parent().unwrap_or(Path::new("")).join(target).components() {
        match part {
            Component::Normal(name) => path.push(name),
            Component::CurDir => {}
            Component::ParentDir => path.pop().then_some(())?,
            Component::RootDir | Component::Prefix(_) => return None,
        }
    }
    Some(path)
}

/// Errors of the links of a page with the given text.
fn broken(page: &Path, text: &str) -> Vec<String> {
    let mut broken = Vec::new();
    for (number, line) in prose(text) {
        for target in targets(line) {
            if target.contains("://") || target.starts_with("mailto:") {
                continue;
            }
            let (file, anchor) =
                target.split_once('#').map_or((target.as_str(), None), |(f, a)| (f, Some(a)));
            let place = format!("{}:{number}: ({target})", page.display());
            let Some(path) = (if file.is_empty() { Some(page.to_owned()) } else { resolve(page, file) })
            else {
                broken.push(format!("{place} leaves the repository"));
                continue;
            };
            let full = root().join(&path);
            if !full.exists() {
                broken.push(format!("{place}: there is no {}", path.display()));
            } else if let Some(anchor) = anchor
                && is_page(&path)
                && !anchors(&if path == page { text.to_owned() } else { read(&full) }).contains(anchor)
            {
                broken.push(format!("{place}: {} has no such heading", path.display()));
            }
        }
    }
    broken
}

#[test]
fn every_link_leads_somewhere() {
    let pages = pages();
    assert!(pages.len() > 30, "{pages:?}");
    let broken: Vec<String> = pages.iter().flat_map(|page| broken(page, &read(&root().join(page)))).collect();
    assert!(broken.is_empty(), "\n{}", broken.join("\n"));
}

/// The link test detects broken links.
#[test]
fn a_broken_link_is_found() {
    let page = Path::new("docs/README.md");
    let faults = |text: &str| broken(page, text).len();
    assert_eq!(faults("[a](theory.md) and [b](../README.md#licence) and [c](https://example.org/no.md)"), 0);
    assert_eq!(faults("[a](no-such-page.md) and ![b](no-such-picture.svg)"), 2);
    assert_eq!(faults("[a](theory.md#no-such-heading)"), 1);
    assert_eq!(faults("# Here\n\n[a](#here), [b](#there)"), 1);
    assert_eq!(faults("[a](../../outside.md)"), 1);
    assert_eq!(faults("```sh\n[a](no-such-page.md)\n```\n`[b](no-such-page.md)`"), 0);
    assert_eq!(faults("[a]: no-such-page.md"), 1);
}

/// Every page of the book and every scene is in the table of contents exactly once.
#[test]
fn every_page_is_in_the_table_of_contents() {
    let summary = Path::new("docs/SUMMARY.md");
    let text = read(&root().join(summary));
    let mut listed: Vec<PathBuf> = Vec::new();
    for (_, line) in prose(&text) {
        listed.extend(targets(line).iter().filter_map(|target| resolve(summary, target)));
    }
    let unique: BTreeSet<&PathBuf> = listed.iter().collect();
    assert_eq!(unique.len(), listed.len(), "a page is listed twice");
    let is_book =
        |page: &&PathBuf| (page.starts_with("docs") || page.starts_with("meshes")) && *page != summary;
    let missing: Vec<PathBuf> =
        pages().iter().filter(is_book).filter(|page| !unique.contains(page)).cloned().collect();
    assert!(missing.is_empty(), "not in docs/SUMMARY.md: {missing:?}");
}

/// Files of the repository that a line names in code spans.
fn named_files(line: &str) -> Vec<String> {
    const FOLDERS: &[&str] =
        &["src/", "tests/", "scripts/", "docs/", "meshes/", "petsc-sys/", "benches/", "fuzz/"];
    let spans = line.split('`').skip(1).step_by(2);
    let words = spans.filter_map(|span| span.split_whitespace().next());
    let is_path = |word: &&str| FOLDERS.iter().any(|folder| word.starts_with(folder));
    // A part in capitals stands for a name.
    let is_name = |part: &str| !part.is_empty() && part.chars().all(|c| c.is_ascii_uppercase());
    let is_plain = |word: &&str| {
        word.chars().all(|c| c.is_alphanumeric() || matches!(c, '/' | '.' | '-' | '_'))
            && !word.split('/').any(is_name)
    };
    words.filter(is_path).filter(is_plain).map(str::to_owned).collect()
}

/// No page names a file of the repository that does not exist. The changelog may.
#[test]
fn files_that_pages_name_exist() {
    assert_eq!(
        named_files("`src/lib.rs` and `scripts/bench ladder`, `src/*/x` and src/y"),
        ["src/lib.rs", "scripts/bench"]
    );
    let mut gone = Vec::new();
    for page in pages().iter().filter(|page| *page != Path::new("CHANGELOG.md")) {
        for (number, line) in prose(&read(&root().join(page))) {
            let missing = named_files(line).into_iter().filter(|file| !root().join(file).exists());
            gone.extend(missing.map(|file| format!("{}:{number}: there is no {file}", page.display())));
        }
    }
    assert!(gone.is_empty(), "\n{}", gone.join("\n"));
}

#[test]
fn the_references_are_current() {
    let case = contact_petsc::case::case_reference();
    let study = contact_petsc::case::study_reference(&contact_petsc::study::schema());
    for (page, made, option) in [("case", case, ""), ("study", study, " --study")] {
        let path = root().join(format!("docs/{page}-reference.md"));
        assert!(
            read(&path) == made,
            "docs/{page}-reference.md differs from the program: contact-petsc schema{option} --markdown > docs/{page}-reference.md"
        );
    }
}

/// The page of columns and fields lists exactly what the tables of the program hold.
#[test]
fn the_results_reference_is_current() {
    let path = root().join("docs/results-reference.md");
    assert!(
        read(&path) == contact_petsc::output::reference::results_reference(),
        "docs/results-reference.md differs from the program: contact-petsc list --results > docs/results-reference.md"
    );
}

/// The first page is short enough to be read completely.
#[test]
fn the_first_page_is_short() {
    let bytes = read(&root().join("README.md")).len();
    assert!(bytes <= 6144, "README.md has {bytes} bytes: move what only some readers need into the book");
}

/// The citation file names the current version.
#[test]
fn the_citation_names_the_version() {
    let citation = read(&root().join("CITATION.cff"));
    let version = format!("\nversion: {}\n", env!("CARGO_PKG_VERSION"));
    assert!(citation.contains(&version), "CITATION.cff has another version than Cargo.toml");
}
