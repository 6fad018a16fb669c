//! Cases whose keys are changed before they are read, and where their errors point.

use std::path::Path;

use super::super::{Case, Named};
use crate::error::Result;
use crate::reader::document::{Document, read_as};
use crate::reader::node::Node;
use crate::reader::source::Source;

const CASE: &str = "dimension: 2\nbodies:\n  block:\n    mesh: { box: { min: [0, 0], max: [1, 1], cells: [2, 2] } }\n    \
    material: { neo_hookean: { young_modulus: \"5 MPa\", poisson_ratio: 0.3 } }\n    density: 1.7e3\nboundary:\n  \
    clamp: { on: block.top, displacement: { x: \"1.0 * t\", y: -0.05 } }\ntime: { end: 0.01, step: 1.0e-3 }\n";

fn changed(overrides: &str) -> Result<Case> {
    let source = Source::new(overrides, Path::new("study.yml"));
    let overrides: Named<Node> = read_as(1, &source, None, |_| Vec::new())?;
    let mut document = Document::read(CASE, Path::new("folder/case.yml"), source)?;
    document.put(&overrides)?;
    Case::from_document(&document)
}

/// Without changes the case is the same as read directly, to the last bit; with them it is the one that says so.
#[test]
fn overrides_are_as_if_written() {
    let plain = Case::parse(CASE, "folder/case.yml").unwrap();
    assert_eq!(changed("{}").unwrap().to_json().unwrap().to_string(), plain.to_json().unwrap().to_string());
    let case = changed(
        "time.step: 0.5 ms\nbodies.block.mesh.box.cells[1]: 7\nsolver.newton.max_iterations: 9\n\"time.scheme\": \
         midpoint\nbodies.block.mesh.box.element: quad9\n",
    );
    let text = CASE
        .replace("step: 1.0e-3", "step: 5.0e-4, scheme: midpoint")
        .replace("cells: [2, 2]", "cells: [2, 7], element: quad9")
        + "solver: { newton: { max_iterations: 9 } }\n";
    let direct = Case::parse(&text, "case.yml").unwrap();
    let case = case.unwrap();
    assert_eq!(case, direct);
    assert_eq!(case.digest().unwrap(), direct.digest().unwrap());
    assert_ne!(case.digest().unwrap(), plain.digest().unwrap());
    assert_eq!(case.resolve("a.msh"), Path::new("folder/a.msh"));
}

/// `null` takes a key away, so that its default stands.
#[test]
fn null_takes_away() {
    let case =
        changed("bodies.block.density: 2\ntime.end: 1\nbodies.block.mesh.box.cells: [1, 1]\n").unwrap();
    assert_eq!(case.time.end.value, 1.0);
    let text = changed("time.step: null").unwrap_err().message;
    assert!(text.contains("'step'"), "{text}");
    let text = changed("time.stepp: null").unwrap_err().message;
    assert!(text.contains("did you mean 'step'") && text.contains("study.yml:1:6"), "{text}");
}

/// What is wrong is told where the user wrote it: overrides in the study, the rest in the case; with the nearest key.
#[test]
fn errors_point_into_the_right_file() {
    for (overrides, place, words) in [
        ("time.stepp: 1", "study.yml:1:6", "did you mean 'step'"),
        ("\ntime.step: -1", "study.yml:2:12", "step"),
        ("a: 1\n", "study.yml:1:1", "unknown key 'a'"),
        ("bodies.blok.density: 1", "study.yml:1:8", "did you mean 'block'"),
        ("dimension.x: 1", "study.yml:1:11", "'dimension' is '2'"),
        ("bodies.block.mesh.box.cells[2]: 1", "study.yml:1:28", "2 entries"),
        ("bodies.block.density[0]: 1", "study.yml:1:21", "is not a list"),
        ("bodies..density: 1", "study.yml:1:8", "a key is missing"),
        ("bodies.block.mesh.box.cells[x]: 1", "study.yml:1:28", "is not a position"),
        ("boundary.clamp.on: blok.top", "study.yml:1:20", "blok"),
        ("bodies.block.mesh.box.element: quad7", "study.yml:1:32", "quad7"),
        ("bodies: { b: 1 }", "study.yml:1:14", "expected"),
    ] {
        let text = changed(overrides).map(|_| "read".to_owned()).unwrap_or_else(|e| e.message);
        assert!(text.contains(place) && text.contains(words), "{overrides}: {text}");
    }
    let broken = CASE.replace("density", "densty");
    let document =
        Document::read(&broken, Path::new("case.yml"), Source::new("", Path::new("study.yml"))).unwrap();
    let text = Case::from_document(&document).unwrap_err().message;
    assert!(text.contains("case.yml:6:5") && text.contains("did you mean 'density'"), "{text}");
    assert!(text.contains("densty: 1.7e3"), "the line itself: {text}");
}

/// What serde asks a tree for, and what it is told where the tree has something else: with the place, and never a panic.
#[test]
fn trees_are_read_as_typed_data() {
    #[derive(serde::Deserialize, schemars::JsonSchema, Debug, PartialEq)]
    #[serde(deny_unknown_fields)]
    struct Data {
        word: String,
        count: u8,
        whole: i64,
        real: f64,
        pair: (f64, f64),
        nothing: Option<f64>,
        choice: Choice,
    }
    #[derive(serde::Deserialize, schemars::JsonSchema, Debug, PartialEq)]
    #[serde(rename_all = "snake_case")]
    enum Choice {
        Plain,
        Valued(f64),
    }
    let read = |text: &str| read_as::<Data>(0, &Source::new(text, Path::new("a.yml")), None, |_| Vec::new());
    let good = "word: 5\ncount: 7\nwhole: -3\nreal: 2\npair: [1, 2.5]\nnothing: null\nchoice: plain\n";
    let (pair, choice) = ((1.0, 2.5), Choice::Plain);
    let data = Data { word: "5".into(), count: 7, whole: -3, real: 2.0, pair, nothing: None, choice };
    assert_eq!(read(good).unwrap(), data);
    assert_eq!(read(&good.replace("plain", "{ valued: 2 }")).unwrap().choice, Choice::Valued(2.0));
    for (from, to, place, words) in [
        ("count: 7", "count: 300", "a.yml:2:8", "300"),
        ("count: 7", "count: -7", "a.yml:2:8", "whole number, zero or more, found -7"),
        ("count: 7", "count: 7\ncount: 8", "a.yml:3:1", "occurs twice"),
        ("count: 7", "cuont: 7", "a.yml:2:1", "did you mean 'count'"),
        ("whole: -3", "whole: 1.5", "a.yml:3:8", "expected a whole number, found 1.5"),
        ("real: 2", "real: [2]", "a.yml:4:7", "expected a number, found a list"),
        ("real: 2\n", "", "a.yml:1:1", "'real' is missing"),
        ("[1, 2.5]", "[1, 2.5, 3]", "a.yml:5:7", "expected 2 entries, found 3"),
        ("[1, 2.5]", "[1]", "a.yml:5:7", "length 1"),
        ("[1, 2.5]", "[1, yes]", "a.yml:5:11", "expected a number, found 'yes'"),
        ("plain", "{ valued: yes }", "a.yml:7:19", "expected a number, found 'yes'"),
        ("plain", "plan", "a.yml:7:9", "did you mean 'plain'"),
        ("word: 5", "word: { a: 5 }", "a.yml:1:7", "expected a word, found a mapping"),
    ] {
        let text = read(&good.replace(from, to)).unwrap_err().message;
        assert!(text.contains(place) && text.contains(words), "{to}: {text}");
    }
}
