//! The map in `src/lib.rs` is correct: a module imports only from rows above its own, and each
//! module is on the map.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Imports that are forbidden although the rows would permit them.
const NEVER: &[(&str, &[&str])] = &[
    ("material", &["petsc", "case"]),
    ("element", &["petsc", "case"]),
    ("contact", &["petsc", "case"]),
    ("contact::normal", &["petsc", "case"]),
    ("contact::friction", &["petsc", "case"]),
    ("contact::obstacle", &["petsc", "case"]),
    ("solvers", &["element", "contact", "mesh"]),
    ("time", &["element", "contact", "mesh"]),
];

/// Modules of the crates below the program that name `mpi`: ranks agree on errors and on sums.
const COLLECTIVE: &[&str] = &["error", "collective"];

/// Modules that only support tests.
const HELPERS: &[&str] = &["taylor"];

/// Macros that other crates use stand at the root of their crate.
const MACROS: &[&str] = &["tagged", "family", "laws"];

/// Names that types of several files share on purpose.
const SHARED: &[&str] = &[
    // As a case states them, and as the program holds them.
    "Body",
    "Kinematics",
    "Locking",
    "Mesh",
    "StageMatrix",
    "Strategy",
    "TwoStage",
    // Each material law has its own.
    "Coefficients",
    // Of a tensor, and PETSc's.
    "Vector",
];

/// Row of each module, and its group within the row. Semicolons separate groups.
type Map = BTreeMap<String, (usize, usize)>;

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// Modules that the root of a crate lists.
fn listed(root: &str) -> BTreeSet<String> {
    let text = fs::read_to_string(source().join(root)).expect("the root of a crate");
    let modules = text.lines().filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';'));
    let modules: BTreeSet<String> = modules.map(str::to_owned).collect();
    assert!(modules.len() > 10, "{root}: {modules:?}");
    modules
}

fn map() -> Map {
    let text = fs::read_to_string(source().join("lib.rs")).expect("the map");
    let mut map = Map::new();
    for line in text.lines().filter_map(|line| line.strip_prefix("//! |")) {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let Ok(row) = cells[0].parse::<usize>() else { continue };
        for (group, modules) in cells[1].split(';').enumerate() {
            for name in modules.split(',') {
                let name = name.trim().trim_matches(['[', ']']).trim_matches('`').to_owned();
                assert!(map.insert(name.clone(), (row, group)).is_none(), "{name} occurs twice on the map");
            }
        }
    }
    map
}

/// The part of a file before its tests.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).expect("a source file");
    let end = text.find("#[cfg(test)]\nmod tests {").unwrap_or(text.len());
    text[..end]
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .map(|l| format!("{l}\n"))
        .collect()
}

fn is_test(path: &Path) -> bool {
    let named = |name: &str| name == "tests" || name == "tests.rs" || name.ends_with("_tests.rs");
    path.strip_prefix(source()).unwrap_or(path).iter().any(|part| part.to_str().is_some_and(named))
}

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder of sources").flatten() {
        let path = entry.path();
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|end| end == "rs") && !is_test(&path) {
            found.push(path);
        }
    }
}

/// The module on the map to which a path such as `contact::normal::penalty` belongs.
fn place<'a>(map: &'a Map, path: &str) -> Option<&'a str> {
    let parts: Vec<&str> = path.split("::").collect();
    let deep = parts.get(..2).map(|two| two.join("::"));
    let known = |name: &str| map.get_key_value(name).map(|(name, _)| name.as_str());
    deep.and_then(|deep| known(&deep)).or_else(|| known(parts[0]))
}

/// Every path after `crate::` in a text, up to the first character that cannot belong to a path.
/// Groups in braces are expanded.
fn imports(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (at, mark) in text.match_indices("crate::") {
        if text[..at].ends_with('$') {
            continue;
        }
        let rest = &text[at + mark.len()..];
        let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':')).unwrap_or(rest.len());
        let (path, after) = rest.split_at(end);
        match after.strip_prefix('{') {
            Some(group) => {
                let names = group.split('}').next().unwrap_or_default().split(',');
                found.extend(names.map(|name| format!("{path}{}", name.trim())));
            }
            None => found.push(path.to_owned()),
        }
    }
    found
}

/// Imports refer to rows above or stay in the group, and none violates `NEVER`.
#[test]
fn imports_follow_the_map() {
    let map = map();
    assert!(map.len() > 20, "{map:?}");
    let mut sources = Vec::new();
    files(&source(), &mut sources);
    assert!(sources.len() > 100, "{} files", sources.len());
    let mut below = listed("serial.rs");
    below.insert("element".to_owned());
    let (mut wrong, mut seen) = (Vec::new(), 0);
    for path in &sources {
        let own = path.strip_prefix(source()).unwrap().with_extension("");
        let own = own.iter().filter_map(|part| part.to_str()).collect::<Vec<_>>().join("::");
        if ["lib", "main", "serial"].contains(&own.as_str()) || HELPERS.contains(&own.as_str()) {
            continue;
        }
        let Some(room) = place(&map, &own) else {
            wrong.push(format!("{own} is not on the map"));
            continue;
        };
        let text = code(path);
        for import in imports(&text).into_iter().filter(|import| !MACROS.contains(&import.as_str())) {
            let Some(target) = place(&map, &import) else {
                wrong.push(format!("{own} imports {import}, which is not on the map"));
                continue;
            };
            seen += 1;
            let ((row, group), (other, its)) = (map[room], map[target]);
            let forbidden = NEVER.iter().any(|(who, whom)| *who == room && whom.contains(&target));
            // A part of a module may use what the whole module shares.
            let inside = room == target || room.starts_with(&format!("{target}::"));
            if forbidden || !(inside || other < row || (other == row && group == its)) {
                wrong.push(format!("{own} (row {row}) imports {import} (row {other})"));
            }
        }
        let talks = ["mpi::", "petsc_sys", "metis::"].iter().any(|name| {
            text.match_indices(name)
                .any(|(at, _)| !text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':'))
        });
        let own_crate = room.split("::").next().unwrap_or(room);
        if talks && below.contains(own_crate) && !COLLECTIVE.contains(&own_crate) {
            wrong.push(format!("{own} names mpi, PETSc or METIS"));
        }
    }
    assert!(seen > 300, "{seen} imports");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Every module of the crate is on the map, and the map names no other.
#[test]
fn the_map_is_complete() {
    let map = map();
    let mut modules = listed("lib.rs");
    modules.extend(listed("serial.rs"));
    modules.insert("element".to_owned());
    let missing = modules.iter().filter(|name| !map.contains_key(*name) && !HELPERS.contains(&name.as_str()));
    assert_eq!(missing.collect::<Vec<_>>(), Vec::<&String>::new());
    for name in map.keys() {
        let path = source().join(name.replace("::", "/"));
        assert!(path.is_dir() || path.with_extension("rs").is_file(), "{name} is on the map, but not there");
    }
}

/// Functions of `mpi` that accept buffers of two types are only called where both have one type.
#[test]
fn reductions_have_one_type() {
    let mut sources = Vec::new();
    files(&source(), &mut sources);
    let raw = ["reduce_into", "all_gather_into", "scan_into", "to_all_into"];
    let calls = |path: &&PathBuf| raw.iter().any(|name| code(path).contains(name));
    let found: Vec<String> = sources.iter().filter(calls).map(|path| path.display().to_string()).collect();
    assert!(found.len() == 1 && found[0].ends_with("src/collective.rs"), "{found:?}");
}

/// `unsafe` is limited to the owners of PETSc's and METIS's objects.
/// The name of the type that a line of code defines for other modules.
fn public_type(line: &str) -> Option<&str> {
    let rest = line.strip_prefix("pub")?;
    let rest = rest.strip_prefix("(super)").or(rest.strip_prefix("(crate)")).unwrap_or(rest);
    let kinds = [" struct ", " enum ", " trait ", " type "];
    let rest = kinds.iter().find_map(|kind| rest.strip_prefix(kind))?;
    rest.split(|letter: char| !letter.is_alphanumeric() && letter != '_').next()
}

#[test]
fn types_do_not_share_names_by_accident() {
    let mut found = Vec::new();
    files(&source(), &mut found);
    let mut homes: BTreeMap<String, BTreeSet<PathBuf>> = BTreeMap::new();
    for path in found {
        for name in code(&path).lines().filter_map(public_type) {
            homes.entry(name.to_owned()).or_default().insert(path.clone());
        }
    }
    assert!(homes.len() > 500, "{}", homes.len());
    let shared: BTreeMap<_, _> = homes.iter().filter(|(_, homes)| homes.len() > 1).collect();
    let meant = |name: &String| SHARED.contains(&name.as_str());
    let accidents: Vec<_> = shared.iter().filter(|(name, _)| !meant(name)).collect();
    assert!(accidents.is_empty(), "types that share a name, rename all but one: {accidents:#?}");
    let unused: Vec<_> = SHARED.iter().filter(|name| !shared.contains_key(&(**name).to_owned())).collect();
    assert!(unused.is_empty(), "no types share these names any more: {unused:?}");
}

#[test]
fn unsafe_stays_with_petsc() {
    let mut sources = Vec::new();
    files(&source(), &mut sources);
    for path in sources.iter().filter(|path| code(path).contains("unsafe ")) {
        let own = path.strip_prefix(source()).unwrap().display().to_string();
        assert!(own.starts_with("petsc/") || own == "partition/metis.rs", "unsafe in {own}");
    }
}

/// The modules of the crate by their paths, such as `contact::mortar::clip`, with their code.
fn modules() -> BTreeMap<String, String> {
    let mut sources = Vec::new();
    files(&source(), &mut sources);
    let mut modules = BTreeMap::new();
    for path in &sources {
        let own = path.strip_prefix(source()).unwrap().with_extension("");
        let parts: Vec<&str> = own.iter().filter_map(|part| part.to_str()).collect();
        let parts = if parts.last() == Some(&"mod") { &parts[..parts.len() - 1] } else { &parts[..] };
        modules.insert(parts.join("::"), code(path));
    }
    modules
}

/// The paths that a `use` names, with expanded braces: `a::{b, c::d}` gives `a::b` and `a::c::d`.
fn opened(path: &str) -> Vec<String> {
    let path: String = path.split_whitespace().collect::<Vec<_>>().join(" ");
    let Some((head, rest)) = path.split_once('{') else {
        let name = path.split(" as ").next().unwrap_or_default();
        return vec![name.trim().trim_end_matches("::self").to_owned()];
    };
    let inner = rest.trim_end().trim_end_matches('}');
    let mut depth = 0;
    let mut part = String::new();
    let mut parts = Vec::new();
    for c in inner.chars() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if c == ',' && depth == 0 {
            parts.push(std::mem::take(&mut part));
        } else {
            part.push(c);
        }
    }
    parts.push(part);
    let parts = parts.iter().filter(|part| !part.trim().is_empty());
    parts.flat_map(|part| opened(&format!("{}{}", head.trim(), part.trim()))).collect()
}

/// The `use` items of a text without their visibility: whether an item re-exports, and the path.
fn uses(text: &str) -> Vec<(bool, String)> {
    let mut found = Vec::new();
    for (at, _) in text.match_indices("use ") {
        let line = text[..at].rsplit('\n').next().unwrap_or_default().trim();
        let hands_on = line.starts_with("pub");
        if !(line.is_empty() || hands_on) {
            continue;
        }
        let path = text[at + 4..].split(';').next().unwrap_or_default();
        found.extend(opened(path).into_iter().map(|path| (hands_on, path)));
    }
    found
}

/// An absolute path for one that a module names, if it refers to the crate.
fn absolute(own: &str, path: &str, modules: &BTreeMap<String, String>) -> Option<String> {
    let mut base: Vec<&str> = own.split("::").collect();
    let mut parts = path.split("::").peekable();
    match *parts.peek()? {
        "crate" => {
            parts.next();
            base.clear();
        }
        "self" => drop(parts.next()),
        "super" => {
            while parts.peek() == Some(&"super") {
                parts.next();
                base.pop();
            }
        }
        first if modules.contains_key(&format!("{own}::{first}")) => {}
        _ => return None,
    }
    base.extend(parts);
    Some(base.join("::"))
}

/// The module in which a path ends, with re-exported names resolved.
fn home(path: &str, modules: &BTreeMap<String, String>) -> Option<String> {
    let parts: Vec<&str> = path.split("::").collect();
    let known = (1..=parts.len()).rev().find(|&length| modules.contains_key(&parts[..length].join("::")))?;
    let module = parts[..known].join("::");
    let Some(name) = parts.get(known) else { return Some(module) };
    let handed = uses(&modules[&module]).into_iter().filter(|(hands_on, _)| *hands_on);
    for (_, path) in handed {
        if path.rsplit("::").next() == Some(*name)
            && let Some(path) = absolute(&module, &path, modules)
        {
            return home(&path, modules);
        }
    }
    Some(module)
}

/// The imports of each module, except those from modules inside it and around it.
fn arrows(modules: &BTreeMap<String, String>) -> BTreeMap<String, Vec<String>> {
    let inside = |inner: &str, outer: &str| inner == outer || inner.starts_with(&format!("{outer}::"));
    let mut arrows = BTreeMap::new();
    for (own, text) in modules.iter().filter(|(own, _)| !["lib", "main"].contains(&own.as_str())) {
        let paths = uses(text).into_iter().filter_map(|(_, path)| absolute(own, &path, modules));
        let mut homes: Vec<String> = paths.filter_map(|path| home(&path, modules)).collect();
        homes.retain(|other| !inside(own, other) && !inside(other, own));
        homes.sort();
        homes.dedup();
        arrows.insert(own.clone(), homes);
    }
    arrows
}

/// The imports that are part of a cycle, cycle by cycle. Modules of a cycle must be read together.
fn circles(modules: &BTreeMap<String, String>) -> Vec<Vec<String>> {
    let arrows = arrows(modules);
    let reached = |from: &str| {
        let (mut seen, mut open) = (Vec::<String>::new(), vec![from.to_owned()]);
        while let Some(next) = open.pop() {
            for other in arrows.get(next.as_str()).into_iter().flatten() {
                if !seen.contains(other) {
                    seen.push(other.clone());
                    open.push(other.clone());
                }
            }
        }
        seen
    };
    let all: BTreeMap<&String, Vec<String>> = arrows.keys().map(|own| (own, reached(own))).collect();
    let mut circles: Vec<Vec<String>> = Vec::new();
    let mut known: Vec<&String> = Vec::new();
    for (own, seen) in all.iter().filter(|(own, seen)| seen.contains(own)) {
        if known.contains(own) {
            continue;
        }
        let mates: Vec<&String> = seen.iter().filter(|other| all[other].contains(own)).collect();
        let arrow = |from: &&String| {
            let to = arrows[*from].iter().filter(|to| mates.contains(to));
            to.map(|to| format!("{from} -> {to}")).collect::<Vec<_>>()
        };
        circles.push(mates.iter().flat_map(arrow).collect());
        known.extend(mates);
    }
    circles
}

/// No two files of a folder import each other in a cycle, unless one is inside the other. Each can
/// be read after those that it imports.
#[test]
fn files_do_not_import_each_other_in_circles() {
    let modules = modules();
    assert!(modules.len() > 300, "{} modules", modules.len());
    let circles = circles(&modules);
    let text: Vec<String> = circles.iter().map(|circle| circle.join("\n  ")).collect();
    assert!(circles.is_empty(), "{} circles:\n{}", circles.len(), text.join("\n\n"));
}

/// The search finds a cycle, also through a re-exported name.
#[test]
fn circles_are_found() {
    let text = |text: &str| text.to_owned();
    let modules: BTreeMap<String, String> = [
        (text("room"), text("mod a;\nmod b;\npub use b::{Other, Thing};\n")),
        (text("room::a"), text("use super::Thing;\n")),
        (
            text("room::b"),
            text("use std::rc::Rc;\nuse crate::room::a::{\n    First,\n    inner::Second,\n};\n"),
        ),
        (text("room::c"), text("use super::a::First;\n")),
    ]
    .into();
    assert_eq!(circles(&modules), [["room::b -> room::a", "room::a -> room::b"]]);
}
