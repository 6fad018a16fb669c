//! Valid study files, and the errors for invalid ones.

use std::path::Path;

use super::row::{Cost, MemberState, StudyRow};
use super::run::Planned;

/// A row with the given labels and no results.
pub fn row(name: &str, labels: &[&str], state: MemberState) -> StudyRow {
    let mut row = StudyRow::blank(name.to_owned(), labels.iter().map(|&label| label.to_owned()).collect(), 1);
    row.state = state;
    row.cost = Cost::default();
    row
}

const CASE: &str = "dimension: 2\nbodies:\n  block:\n    mesh: { box: { min: [0, 0], max: [1, 1], cells: [2, 2] } }\n    \
    material: { neo_hookean: { young_modulus: 5.0e6, poisson_ratio: 0.3 } }\n    density: 1700\nboundary:\n  clamp: { on: \
    block.top, displacement: { x: \"1.0 * t\", y: -0.05 } }\ntime: { end: 0.01, step: 1.0e-3 }\n";

const STUDY: &str = "case: case.yml\nset: { time.end: 0.004 }\nsweep:\n  element: { key: bodies.block.mesh.box.element, \
    values: [quad4, quad9] }\n  h: { key: bodies.block.mesh.box.cells, values: { 0.5: [2, 2], 0.25: [4, 4] } }\n  time:\n    \
    choices:\n      coarse: { time.step: 2.0e-3, solver.newton.tolerance: 1.0e-6 }\n      fine: { time.step: 1.0e-3 \
    }\nmembers:\n  odd: { bodies.block.mesh.box.cells: [3, 5] }\nreference: { member: { time.step: 0.5 ms } }\nquantities:\n  \
    push: { table: reactions.csv, where: { boundary: clamp }, column: \"force_x [N]\", measure: { at: 0.004 } }\n";

fn planned(study: &str) -> crate::error::Result<Planned> {
    Planned::read(study, Path::new("folder/study.yml"), |path| {
        assert_eq!(path, Path::new("folder/case.yml"));
        Ok(CASE.to_owned())
    })
}

/// The grid is the product of its axes, with the last one varying fastest. The reference comes
/// first, and named members come last.
#[test]
fn members_are_all_combinations() {
    let Planned { members, .. } = planned(STUDY).unwrap();
    let names: Vec<&str> = members.iter().map(|member| member.name.as_str()).collect();
    assert_eq!(names.len(), 1 + 8 + 1);
    assert_eq!(names[..3], ["reference", "element-quad4_h-0.5_time-coarse", "element-quad4_h-0.5_time-fine"]);
    assert_eq!(names[9], "odd");
    let fine = &members[8];
    assert_eq!(fine.labels, ["quad9", "0.25", "fine"]);
    let json = fine.case.to_json().unwrap();
    assert_eq!(json["bodies"]["block"]["mesh"]["box"]["cells"], serde_json::json!([4, 4]));
    assert_eq!((&json["time"]["end"], &json["time"]["step"]), (&0.004.into(), &0.001.into()));
    let mut digests: Vec<&str> = members.iter().map(|member| member.digest.as_str()).collect();
    digests.sort_unstable();
    digests.dedup();
    assert_eq!(digests.len(), members.len());
}

/// An error states line, column, cause and hint before anything runs.
#[test]
fn broken_studies_are_told_where_and_why() {
    let mut wrong = Vec::new();
    for (from, to, place, words) in [
        ("sweep:", "sweeep:", "study.yml:3:1", "did you mean 'sweep'"),
        ("box.element", "box.elemnt", "study.yml:4:41", "did you mean 'element'"),
        ("quad9]", "quad7]", "study.yml:4:66", "quad7"),
        ("case: case.yml", "title: a", "study.yml:", "'case' is missing"),
        ("reactions.csv", "reaction.csv", "study.yml:14:18", "did you mean 'reactions.csv'"),
        ("{ at: 0.004 }", "mean", "", "unknown measure 'mean'"),
        ("{ at: 0.004 }", "{ at: [1] }", "study.yml:14:99", "expected"),
        ("reference: { member: { time.step: 0.5 ms } }\n", "", "study.yml:13:3", "has no reference"),
        ("{ member: { time.step: 0.5 ms } }", "best", "study.yml:12:12", "unknown reference 'best'"),
        ("time.end: 0.004", "time.end: -1", "study.yml:2:18", "end"),
        ("values: [quad4, quad9]", "values: 3", "study.yml:4", "expected a list"),
        ("values: [quad4, quad9]", "values: []", "study.yml:4:3", "no value"),
        ("key: bodies.block.mesh.box.element, ", "", "study.yml:4:3", "a key and its values, or choices"),
        ("  odd:", "  reference:", "study.yml:11:3", "reserved for the reference run"),
        ("  h: { key", "  steps: { key", "study.yml:5:3", "name of a column of study.csv"),
        ("  push:", "  wall [s]:", "study.yml:14:3", "name of a column of study.csv"),
    ] {
        assert!(STUDY.contains(from), "{from}");
        let text = planned(&STUDY.replacen(from, to, 1)).map(|_| "read".into()).unwrap_or_else(|e| e.message);
        if !text.contains(place) || !text.contains(words) {
            wrong.push(format!("{from} -> {to}: {text}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
    let more = "accuracy: [0.1, 2]\n";
    let text = planned(&format!("{STUDY}{more}")).map(|_| "read".into()).unwrap_or_else(|e| e.message);
    assert!(text.contains("between 0 and 1") && text.contains("0.01 means 1 %"), "{text}");
    let nothing = "case: case.yml\nreference: finest\nquantities: { a: { table: energy.csv, column: a, measure: last } }\n";
    let text = planned(nothing).map(|_| "read".into()).unwrap_or_else(|e| e.message);
    assert!(text.contains("nothing is varied"), "{text}");
    let huge = format!("{:?}", (0..200).collect::<Vec<_>>());
    let text = STUDY.replace("[quad4, quad9]", &huge).replace("{ 0.5: [2, 2], 0.25: [4, 4] }", &huge);
    let text = planned(&text).map(|_| "read".into()).unwrap_or_else(|e| e.message);
    assert!(text.contains("more than 10000 members"), "{text}");
}

/// The shipped study files are valid and name the schema. The shipped schema equals the one that
/// the types generate.
#[test]
fn shipped_studies_are_right() {
    let meshes = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes");
    let mut count = 0;
    let scenes = std::fs::read_dir(&meshes).unwrap().flatten();
    let paths = scenes.flat_map(|scene| {
        ["study.yml", "study-factors.yml", "study-accuracy.yml"].map(|name| scene.path().join(name))
    });
    for path in paths {
        let Ok(text) = std::fs::read_to_string(&path) else { continue };
        count += 1;
        assert!(text.starts_with("# yaml-language-server: $schema=../study.schema.json\n"), "{path:?}");
        let planned = Planned::read(&text, &path, crate::case::Case::load).unwrap_or_else(|e| panic!("{e}"));
        assert!(planned.members.len() > 3 && planned.listing().contains("quantities"), "{path:?}");
    }
    assert_eq!(count, 10);
    let shipped = std::fs::read_to_string(meshes.join("study.schema.json")).unwrap();
    assert_eq!(shipped, serde_json::to_string_pretty(&super::schema()).unwrap() + "\n");
}

/// Instants of a study are in the case's unit of time, and its members use the units of the case.
#[test]
fn a_study_has_the_units_of_its_case() {
    let case =
        format!("units: {{ time: ms }}\n{}", CASE.replace("end: 0.01, step: 1.0e-3", "end: 10, step: 1"));
    let read = |study: &str| Planned::read(study, Path::new("folder/study.yml"), |_| Ok(case.clone()));
    let study = STUDY.replace("time.end: 0.004", "time.end: 4").replace("2.0e-3", "2").replace("1.0e-3", "1");
    for at in ["4", "\"4 ms\"", "\"0.004 s\""] {
        let planned =
            read(&study.replace("at: 0.004", &format!("at: {at}"))).unwrap_or_else(|e| panic!("{e}"));
        let quantity = planned.study.quantities.value.values().next().unwrap();
        let super::file::Measure::At(time) = quantity.measure.value else { panic!("{at}") };
        assert!((time.value - 4.0).abs() < 1e-12, "{at}: {}", time.value);
        assert_eq!(planned.members[0].case.time.step.unwrap().value, 0.5);
    }
    let text = read(&study.replace("set: {", "set: { units.time: s,")).map(|_| ()).unwrap_err().message;
    assert!(text.contains("study.yml:2:8") && text.contains("the units of its case"), "{text}");
}
