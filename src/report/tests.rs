//! A page is complete, closed and escaped, and has no external references, whatever the results
//! contain.

use super::*;
use crate::output::folder::tests::Scratch;

const ODD: &str = "</pre><script>alert(\"x\")</script> & <b> µ 'q'";

const SECTIONS: [&str; 10] = [
    "warnings",
    "bodies",
    "histories",
    "energy",
    "iterations",
    "phases",
    "ranks",
    "versions",
    "case",
    "notes",
];

/// Checks that every tag is closed in the order in which it was opened. Returns the names and
/// attributes of the tags.
fn tags_of(page: &str) -> Vec<String> {
    let mut open: Vec<&str> = Vec::new();
    let mut seen = Vec::new();
    let mut rest = page;
    while let Some(start) = rest.find('<') {
        let end = start + rest[start..].find('>').expect("a tag ends");
        let inner = &rest[start + 1..end];
        rest = &rest[end + 1..];
        if inner.starts_with('!') {
            continue;
        }
        if let Some(name) = inner.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name), "closed in order");
            continue;
        }
        assert_eq!(inner.matches('"').count() % 2, 0, "<{inner}>");
        seen.push(inner.to_owned());
        if !inner.ends_with('/') {
            open.push(inner.split_whitespace().next().expect("a name"));
        }
    }
    assert!(open.is_empty(), "{open:?}");
    seen
}

fn check(page: &str) {
    let tags = tags_of(page);
    assert!(page.starts_with("<!DOCTYPE html>"));
    for tag in &tags {
        let name = tag.split_whitespace().next().unwrap();
        assert!(
            !["script", "link", "img", "iframe", "object", "image", "use", "a", "b"].contains(&name),
            "<{tag}>"
        );
        assert!(!tag.contains("src=") && !tag.contains("href="), "<{tag}>");
    }
    let references =
        page.matches("http").count() - page.matches("xmlns=\"http://www.w3.org/2000/svg\"").count();
    assert_eq!(references, 0, "references to the outside");
    assert!(!page.contains("url(") && !page.contains("@import"));
}

fn write_run(folder: &Path, verdict: &str) {
    let record = serde_json::json!({
        "program": "contact-petsc", "verdict": verdict, "reason": if verdict == "failed" { Some(ODD) } else { None },
        "start": "2026-11-21T12:00:00Z", "wall_seconds": 2.5, "simulated_time": 0.01, "ranks": 2, "unknowns": 100,
        "steps": 3, "phases": { "solve": { "seconds": 1.5, "count": 9 } }, "peak_memory_bytes": [1 << 27, 1 << 26],
        "balance": { "elements": [6, 4], "nodes": [9, 9], "contact_facets": [1, 0], "cpu_seconds": [2.0, 2.5],
            "work_seconds": [1.0, 0.5] },
        "penetration": [{ "contact": ODD, "deepest": 1e-6, "asked": 5e-7 }], "warnings": [ODD, "watch it"],
        "versions": { "contact-petsc": "0.1.0" }, "inputs": [{ "path": ODD, "sha256": "abc" }],
        "case": { "title": ODD, "dimension": 2, "bodies": { ODD: { "density": 1 } } },
    });
    std::fs::write(folder.join("run.json"), record.to_string()).unwrap();
    let energy = "step,time [s],kinetic [J],strain [J],total [J]\n0,0,0,1,1\n1,0.01,1,2,3\n";
    std::fs::write(folder.join("energy.csv"), energy).unwrap();
    let probes =
        format!("step,time [s],dt [s],\"{}.u_x [m]\"\n0,0,0,0\n1,0.01,0.01,1\n", ODD.replace('"', "\"\""));
    std::fs::write(folder.join("probes.csv"), probes).unwrap();
}

/// The page of a completed run and that of a failed one have all sections, escape names, and report
/// missing data.
#[test]
fn a_page_is_whole_and_escaped() {
    let scratch = Scratch::new("report");
    for verdict in ["completed", "failed", "running"] {
        write_run(&scratch.0, verdict);
        let written = report(&scratch.0, &[], None).unwrap();
        assert_eq!(written.file, scratch.0.join("report.html"));
        assert!(written.notes.iter().any(|note| note.contains("fields.pvd")), "{:?}", written.notes);
        let page = std::fs::read_to_string(&written.file).unwrap();
        check(&page);
        let places: Vec<usize> =
            SECTIONS.iter().map(|id| page.find(&format!("<h2 id=\"{id}\">")).expect(id)).collect();
        assert!(places.is_sorted());
        assert!(page.contains("&lt;/pre&gt;&lt;script&gt;alert(") && page.contains("watch it"));
        assert_eq!(page.matches("class=\"verdict").count(), 1);
        assert!(page.contains("@media print") && page.contains("<svg") && page.contains("Energy"));
        assert!(page.contains("1.333") || page.contains("1.2"), "the imbalance of the ranks");
        assert_eq!(page.contains("<pre class=\"wrap\">"), verdict == "failed");
    }
    let elsewhere = scratch.0.join("page.html");
    assert_eq!(report(&scratch.0, &[0.5], Some(&elsewhere)).unwrap().file, elsewhere);
    assert!(report(&scratch.0.join("absent"), &[], None).is_err());
}

/// The first warnings of a long list are shown in full, and the rest opens on demand.
#[test]
fn many_warnings_are_folded() {
    let scratch = Scratch::new("report-warnings");
    let warnings: Vec<String> = (0..30).map(|k| format!("step {k} failed")).collect();
    let record =
        serde_json::json!({ "program": "contact-petsc", "verdict": "completed", "warnings": warnings });
    std::fs::write(scratch.0.join("run.json"), record.to_string()).unwrap();
    let page = std::fs::read_to_string(report(&scratch.0, &[], None).unwrap().file).unwrap();
    check(&page);
    assert_eq!(page.matches("class=\"warning\"").count(), 8);
    assert!(page.contains("<summary>22 more</summary>") && page.contains("step 29 failed"));
}

/// A record of an older version, or one that a killed start left, still gives a page.
#[test]
fn a_bare_record_gives_a_page() {
    let scratch = Scratch::new("report-bare");
    std::fs::write(scratch.0.join("run.json"), "{\"program\": \"contact-petsc\"}").unwrap();
    check(&std::fs::read_to_string(report(&scratch.0, &[], None).unwrap().file).unwrap());
}

/// The page of a study contains advice, pictures, members and the file. A picture outside the
/// folder is not included.
#[test]
fn a_study_has_a_page() {
    let scratch = Scratch::new("report-study");
    let marker = serde_json::json!({
        "program": "contact-petsc", "state": "completed", "title": ODD, "study": "study.yml", "version": "0.1.0",
        "written": "2026-11-21T12:00:00Z", "advice": [ODD], "figures": ["figures/a.svg", "../b.svg"], "text": ODD,
    });
    std::fs::write(scratch.0.join(STUDY), marker.to_string()).unwrap();
    std::fs::create_dir(scratch.0.join("figures")).unwrap();
    std::fs::write(scratch.0.join("figures/a.svg"), "<svg width=\"1\"></svg>\n").unwrap();
    std::fs::write(scratch.0.join("study.csv"), "member,verdict,cpu [s]\nm<1>,failed,0.125\n").unwrap();
    let written = report(&scratch.0, &[], None).unwrap();
    assert_eq!(written.notes, ["../b.svg: file not found"]);
    let page = std::fs::read_to_string(written.file).unwrap();
    check(&page);
    assert!(page.contains("m&lt;1&gt;") && page.contains("0.125") && page.contains("<svg width=\"1\">"));
    for id in ["advice", "figures", "members", "study"] {
        assert!(page.contains(&format!("<h2 id=\"{id}\">")), "{id}");
    }
}
