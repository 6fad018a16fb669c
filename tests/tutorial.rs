//! The first pages are correct: every command of the tutorial runs and prints what the page shows,
//! and every case of the book is valid.

mod common;

use std::fs;
use std::path::Path;
use std::process::Command;

use common::{Folder, LIMIT, Running, Table, run};
use contact_petsc::mesh::gmsh;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A fenced block of a page: its language and its lines.
struct Block {
    language: String,
    text: String,
}

fn blocks(page: &str) -> Vec<Block> {
    let text = fs::read_to_string(root().join(page)).expect("the page");
    let mut blocks: Vec<Block> = Vec::new();
    let mut inside = false;
    for line in text.lines() {
        if let Some(language) = line.strip_prefix("```") {
            inside = !inside;
            if inside {
                blocks.push(Block { language: language.to_owned(), text: String::new() });
            }
        } else if let (true, Some(block)) = (inside, blocks.last_mut()) {
            block.text.push_str(line);
            block.text.push('\n');
        }
    }
    blocks
}

fn of<'a>(blocks: &'a [Block], language: &'a str) -> impl Iterator<Item = &'a Block> {
    blocks.iter().filter(move |block| block.language == language)
}

fn has_gmsh() -> bool {
    Command::new("gmsh").arg("--version").output().is_ok_and(|output| output.status.success())
}

/// All `sh` blocks of the tutorial run in one shell, in order. Every line of a `text` block is in
/// the output of the `sh` block before it.
#[test]
fn the_tutorial_is_true_on_2_ranks() {
    const MARK: &str = "=== block of the page";
    let folder = Folder::new("tutorial");
    std::os::unix::fs::symlink(root().join("docs"), folder.join("docs")).expect("a link");
    let blocks = blocks("docs/tutorial.md");
    let mut script = "set -e\nexec 2>&1\n".to_owned();
    for block in of(&blocks, "sh") {
        script.push_str(&format!("echo '{MARK}'\n"));
        let is_gmsh = block.text.starts_with("gmsh");
        if !is_gmsh || has_gmsh() {
            script.push_str(&block.text);
        }
        // Another version of Gmsh or another processor may make another mesh than that of the page.
        if is_gmsh {
            script.push_str("mv stop.msh own.msh\ncp ../docs/tutorial/stop.msh .\n");
        }
    }
    let output = Running::script(2, &script, &folder).wait(LIMIT).success().stdout;
    let mut said = output.split(MARK);
    let mut last = said.next().unwrap_or_default();
    let mut compared = 0;
    for block in &blocks {
        match block.language.as_str() {
            "sh" => last = said.next().expect("the output of a block"),
            "text" => {
                for line in block.text.lines().map(str::trim).filter(|line| !line.is_empty()) {
                    assert!(last.contains(line), "the page says:\n{line}\nthe program says:\n{last}");
                    compared += 1;
                }
            }
            _ => {}
        }
    }
    assert!(compared > 10, "{compared} lines were compared");

    let elements = |name: &str| {
        let mesh = fs::read(folder.join("stop").join(name)).expect("a mesh");
        let mesh = gmsh::parse::<2>(&mesh, None).expect("a mesh");
        ["rubber", "top", "sole"].iter().for_each(|set| assert!(mesh.set_nodes(set).is_some(), "{set}"));
        mesh.kinds.len()
    };
    let [own, shown] = ["own.msh", "stop.msh"].map(elements);
    assert!(own.abs_diff(shown) < shown / 5, "{own} elements, and {shown} on the page");

    let results = folder.join("stop/results/stop");
    let contact = Table::read(&results.join("contact.csv"));
    let (normal, friction) = (contact.last("force_n"), -contact.last("force_t"));
    assert!((normal - 23.8).abs() < 0.1 && (friction - 11.1).abs() < 0.1, "{normal} {friction}");
    for figure in ["deformed_von_mises", "contact_stresses_lowest"] {
        let drawn = fs::read(results.join(format!("figures/{figure}.svg"))).expect("a figure");
        let shown = fs::read(root().join(format!("docs/tutorial/{figure}.svg"))).expect("a figure");
        assert!(
            drawn.len().abs_diff(shown.len()) < shown.len() / 5,
            "{figure} is not the figure of the page"
        );
    }
}

/// The files that the page shows equal those of its folder.
#[test]
fn the_tutorial_shows_its_files() {
    let blocks = blocks("docs/tutorial.md");
    for (language, file) in [("c", "stop.geo"), ("yaml", "case.yml")] {
        let shipped = fs::read_to_string(root().join("docs/tutorial").join(file)).expect("a file");
        assert!(of(&blocks, language).any(|block| block.text == shipped), "{file} differs from the page");
    }
}

/// Every complete case that the first pages and the how-to pages show is valid.
#[test]
fn the_cases_of_the_book_are_valid() {
    let mut pages: Vec<String> = ["README.md", "docs/getting-started.md"].map(str::to_owned).into();
    for entry in fs::read_dir(root().join("docs/how-to")).expect("the how-to pages").flatten() {
        pages.push(format!("docs/how-to/{}", entry.file_name().to_string_lossy()));
    }
    let mut cases = 0;
    for page in pages {
        for block in of(&blocks(&page), "yaml").filter(|block| block.text.starts_with("title:")) {
            let folder = Folder::new("book");
            folder.write("case.yml", &block.text);
            let output = run(0, &["check", "case.yml"], &folder);
            assert_eq!(output.code, Some(0), "{page}: {}", output.text());
            cases += 1;
        }
    }
    assert!(cases >= 4, "{cases} cases");
}
