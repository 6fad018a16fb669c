//! A study from the file to the advice. Every member runs or is recorded with its reason, the
//! results are the same on any number of ranks, and completed members do not run again.

mod common;

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use common::{Folder, Output, Running, SMALL_BLOCK, Table, run};

/// A grid, and a member that crushes the block.
const STUDY: &str = r#"title: A < small > study
case: case.yml
sweep:
  element: { key: bodies.block.mesh.box.element, values: [quad4, quad9] }
  h: { key: bodies.block.mesh.box.cells, values: { 0.2: [2, 2], 0.1: [4, 4] } }
members:
  crushed: { boundary.clamp.displacement.y: "-0.01 - 300 * t", time.cuts: 1 }
reference: { member: { bodies.block.mesh.box: { min: [0, 0], max: [0.4, 0.4], cells: [6, 6], element: quad9 } } }
quantities:
  reaction: { table: reactions.csv, where: { boundary: clamp }, column: "force_x [N]", measure: { at: 0.002 } }
  corner: { table: probes.csv, column: "corner.u_x [m]", measure: l2 }
"#;

fn folder(study: &str) -> Folder {
    let folder = Folder::new("study");
    folder.write("case.yml", SMALL_BLOCK);
    folder.write("study.yml", study);
    folder
}

fn study(ranks: usize, more: &[&str], folder: &Folder) -> Output {
    run(ranks, &[&["study", "study.yml", "--output", "out"], more].concat(), folder)
}

/// The columns of a study that do not depend on the clock, the machine, or the last digits.
fn settled(path: &Path) -> Vec<Vec<String>> {
    let table = Table::read(&path.join("out/study.csv"));
    let words = ["member", "element", "h", "verdict", "newton", "steps", "unknowns"];
    let mut columns: Vec<Vec<String>> =
        words.iter().map(|name| table.texts(name).into_iter().map(str::to_owned).collect()).collect();
    for name in ["reaction", "reaction error", "corner", "corner error"] {
        columns.push(table.numbers(name).into_iter().map(|value| format!("{value:.6e}")).collect());
    }
    columns
}

/// On one rank and on two a study has the same rows. The failed member is a row with its reason.
#[test]
fn a_study_is_the_same_on_1_and_2_ranks() {
    let folders = [1, 2].map(|ranks| {
        let folder = folder(STUDY);
        let output = study(ranks, &[], &folder).success();
        assert_eq!(output.stdout.matches("study of case.yml: 6 members").count(), 1, "{}", output.stdout);
        assert!(output.stdout.contains("[6/6] crushed: failed: t ="), "{}", output.stdout);
        assert!(output.stdout.contains("for 10 % in reaction use element = "), "{}", output.stdout);
        folder
    });
    let [one, two] = [0, 1].map(|k| settled(&folders[k]));
    assert_eq!(one, two);
    let table = Table::read(&folders[1].join("out/study.csv"));
    assert_eq!(
        table.texts("verdict"),
        ["completed", "completed", "completed", "completed", "completed", "failed"]
    );
    assert!(table.texts("reason")[5].contains("is inverted (det F = "), "{:?}", table.texts("reason"));
    assert_eq!(table.numbers("ranks"), [2.0; 6]);
    assert_eq!(table.numbers("reaction error")[0], 0.0);
    assert!(table.numbers("reaction error")[1..5].iter().all(|error| *error > 0.0));
    assert!(
        table.numbers("cpu")[..5].iter().chain(&table.numbers("peak memory")[..5]).all(|cost| *cost > 0.0)
    );
    // A member is an ordinary results folder, with the phases of itself alone: they do not exceed its wall time.
    let record = fs::read_to_string(folders[0].join("out/members/element-quad9_h-0.1/run.json")).unwrap();
    let record: serde_json::Value = serde_json::from_str(&record).unwrap();
    assert!(record["verdict"] == "completed" && record["case_sha256"].is_string(), "{record}");
    let phases = record["phases"].as_object().unwrap().values();
    let seconds: f64 = phases.map(|phase| phase["seconds"].as_f64().unwrap()).sum();
    assert!(seconds < 1.1 * record["wall_seconds"].as_f64().unwrap(), "{record}");
    for file in [
        "advice.txt",
        "study.md",
        "figures/work-precision-reaction.svg",
        "figures/time-accuracy-size-corner.svg",
    ] {
        assert!(folders[0].join("out").join(file).exists(), "{file}");
    }
}

/// A killed study resumes where it stopped. Completed members do not run again, unless the case has
/// changed, or they failed and a repetition is requested.
#[test]
fn a_study_goes_on_where_it_was() {
    let whole = folder(STUDY);
    study(1, &[], &whole).success();
    let folder = folder(STUDY);
    let running = Running::start(0, &["study", "study.yml", "--output", "out"], &folder);
    let deadline = Instant::now() + Duration::from_secs(300);
    while !folder.join("out/members/element-quad4_h-0.1/run.json").exists() && Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(1));
    }
    running.signal("KILL");
    running.wait(Duration::from_secs(300));
    // What a member leaves that is killed while it runs.
    let cut = folder.join("out/members/element-quad4_h-0.1/run.json");
    fs::write(&cut, "{ \"program\": \"contact-petsc\", \"verdict\": \"running\" }").unwrap();
    let output = study(1, &[], &folder).success();
    assert!(output.stdout.contains("reference: ") && output.stdout.contains("(before)"), "{}", output.stdout);
    let again = output.stdout.lines().find(|line| line.contains("element-quad4_h-0.1:")).unwrap();
    assert!(!again.contains("(before)"), "{again}");
    assert_eq!(settled(&whole), settled(&folder));

    let output = study(1, &["--rerun-failed"], &folder).success();
    assert_eq!(output.stdout.matches("(before)").count(), 5, "{}", output.stdout);
    // Other options of PETSc are another study, those that only report are not; without options it is the first one again.
    for (options, before) in [(&["--", "-ksp_rtol", "1e-9"], 0), (&["--", "-ksp_rtol", "1e-9"], 6)] {
        let output = study(1, options, &folder).success();
        assert_eq!(output.stdout.matches("(before)").count(), before, "{}", output.stdout);
    }
    let output = study(1, &["--", "-ksp_rtol", "1e-9", "-malloc_dump"], &folder).success();
    assert_eq!(output.stdout.matches("(before)").count(), 6, "{}", output.stdout);
    let changed = SMALL_BLOCK.replace("coefficient: 0.5", "coefficient: 0.4");
    folder.write("case.yml", &changed);
    let output = study(1, &[], &folder).success();
    assert_eq!(output.stdout.matches("(before)").count(), 0, "{}", output.stdout);
}

/// A wrong path, a wrong value and a wrong column are reported with their location in the study,
/// the first two before any run.
#[test]
fn wrong_studies_end_with_3_on_2_ranks() {
    for (from, to, words) in [
        ("box.element", "box.elment", "study.yml:4:41"),
        ("[quad4, quad9]", "[quad4, hex8]", "study.yml:4:66"),
        ("\"force_x [N]\"", "force_x", "did you mean 'force_x [N]'"),
    ] {
        let folder = folder(&STUDY.replacen(from, to, 1));
        let output = study(2, &[], &folder);
        assert_eq!(output.code, Some(3), "{}", output.stderr);
        assert!(
            output.stderr.contains(words) && output.stderr.contains("study.yml:"),
            "{words}: {}",
            output.stderr
        );
        assert_eq!(output.stderr.matches("contact-petsc: error:").count(), 1, "{}", output.stderr);
        assert_eq!(folder.join("out").exists(), from.starts_with('"'), "{from}");
    }
}

/// The results folder contains the names of scene and study, so that two studies of a scene do not
/// collide.
#[test]
fn studies_of_a_scene_keep_apart() {
    let folder = folder(STUDY);
    let scene = folder.canonicalize().unwrap().file_name().unwrap().to_str().unwrap().to_owned();
    for (file, results) in [("study.yml", "study"), ("study-mesh.yml", "study-mesh")] {
        folder.write(file, STUDY);
        run(1, &["study", file, "--quiet"], &folder).success();
        assert!(folder.join(format!("results/{scene}-{results}/study.csv")).exists(), "{file}");
    }
}

/// A dry run lists the members and runs none. A folder of another program is not modified. A study
/// without a completed member has failed.
#[test]
fn a_study_runs_nothing_that_it_should_not() {
    let folder = folder(STUDY);
    let output = study(0, &["--dry-run"], &folder).success();
    assert!(
        output.stdout.contains("6 members; quantities: reaction, corner\n  reference\n"),
        "{}",
        output.stdout
    );
    let checked = run(1, &["check", "study.yml"], &folder).success();
    assert_eq!(checked.stdout, output.stdout, "a check is a dry run");
    assert!(!folder.join("out").exists() && !folder.join("results").exists());
    fs::create_dir(folder.join("out")).unwrap();
    folder.write("out/mine.txt", "mine");
    let output = study(0, &[], &folder);
    assert_eq!(output.code, Some(4), "{}", output.stderr);
    assert!(output.stderr.contains("not a study of contact-petsc"), "{}", output.stderr);
    let crushed = STUDY.replace(
        "case: case.yml",
        "case: case.yml\nset: { boundary.clamp.displacement.y: \"-0.01 - 300 * t\", time.cuts: 1 }",
    );
    folder.write("study.yml", &crushed);
    let output = run(1, &["study", "study.yml"], &folder);
    assert_eq!(output.code, Some(5), "{}\n{}", output.stdout, output.stderr);
    assert!(output.stderr.contains("no member completed"), "{}", output.stderr);
    assert_eq!(
        Table::read(
            &folder.join("results").read_dir().unwrap().next().unwrap().unwrap().path().join("study.csv")
        )
        .len(),
        6
    );
}

/// A member with an invalid case, or with a missing or invalid mesh, is a row with its reason. The
/// study continues and reports the number of failures. It tries them again once a file has changed,
/// or on request.
#[test]
fn members_that_can_not_begin_are_rows_on_1_and_2_ranks() {
    let members = "members:\n  first: {}\n  massless: { bodies.block.mass: redistributed, bodies.block.mesh.box.cells: [4, 1] }\n  \
                   absent: { bodies.block.mesh: { file: absent.msh } }\n  torn: { bodies.block.mesh: { file: torn.msh } }\n  \
                   last: { time.step: 1.0e-3 }\n";
    let quantities = "reference: finest\nquantities:\n  reaction: { table: reactions.csv, where: { boundary: clamp }, column: \
                      \"force_x [N]\", measure: { at: 0.002 } }\n";
    for ranks in [1, 2] {
        let folder = folder(&format!("case: case.yml\n{members}{quantities}"));
        folder.write("torn.msh", "$MeshFormat\n4.1 0 8\n");
        let again = |more: &[&str], before: [bool; 5]| {
            let output = study(ranks, more, &folder).success();
            let names = ["first", "massless", "absent", "torn", "last"];
            for (name, before) in names.into_iter().zip(before) {
                let line = output.stdout.lines().find(|line| line.contains(&format!("] {name}: "))).unwrap();
                assert_eq!(line.ends_with("(before)"), before, "{line}");
            }
            assert!(output.stdout.contains("3 of 5 members failed"), "{}", output.stdout);
            let table = Table::read(&folder.join("out/study.csv"));
            assert_eq!(table.texts("verdict"), ["completed", "failed", "failed", "failed", "completed"]);
            let reasons: Vec<String> = table.texts("reason").into_iter().map(str::to_owned).collect();
            assert!(reasons[1].contains("mass"), "{reasons:?}");
            assert!(reasons[2].contains("absent.msh: ") && reasons[3].contains("torn.msh"), "{reasons:?}");
            reasons
        };
        let first = again(&[], [false; 5]);
        again(&[], [true; 5]);
        folder.write("absent.msh", "no mesh");
        let other = again(&[], [true, true, false, true, true]);
        assert_ne!(first[2], other[2]);
        again(&["--rerun-failed"], [true, false, false, false, true]);
        // A folder that is not ours is no matter of one member alone, and a file that could not be written is tried again.
        let record = folder.join("out/members/torn/run.json");
        let text = fs::read_to_string(&record).unwrap();
        fs::write(&record, text.replace("\"unknowns\": 0", "\"unknowns\": 50")).unwrap();
        again(&[], [true, true, true, false, true]);
        fs::remove_file(folder.join("out/members/last/run.json")).unwrap();
        fs::write(folder.join("out/members/last/thesis.txt"), "years of work").unwrap();
        let output = study(ranks, &[], &folder);
        assert_eq!(output.code, Some(4), "{}", output.stderr);
        assert!(
            output.stderr.contains("member last: ") && output.stderr.contains("not a results folder"),
            "{}",
            output.stderr
        );
    }
}

/// A study in which no member can start has failed, as has one in which none converges. A signal
/// also ends it between members.
#[test]
fn a_study_without_members_that_begin_ends() {
    let values: Vec<String> = (100..500).map(|k| format!("{k}: {k}.0e-6")).collect();
    let text = format!(
        "case: case.yml\nset: {{ bodies.block.mesh: {{ file: absent.msh }} }}\nsweep: {{ step: {{ key: time.step, values: {{ {} }} }} }}\n\
         reference: finest\nquantities: {{ a: {{ table: energy.csv, column: \"total [J]\", measure: last }} }}\n",
        values.join(", ")
    );
    let folder = folder(&text);
    let running = Running::start(0, &["study", "study.yml", "--output", "out"], &folder);
    let deadline = Instant::now() + Duration::from_secs(300);
    while !folder.join("out/members/step-105/run.json").exists() && Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(1));
    }
    running.signal("TERM");
    let output = running.wait(Duration::from_secs(300));
    assert_eq!(output.code, Some(7), "{}\n{}", output.stdout, output.stderr);
    assert!(output.stderr.contains("SIGTERM: member step-"), "{}", output.stderr);
    let table = Table::read(&folder.join("out/study.csv"));
    let words = table.texts("verdict");
    assert!(words[0] == "failed" && words[399] == "waiting", "{words:?}");
    let output = study(1, &[], &folder);
    assert_eq!(output.code, Some(5), "{}\n{}", output.stdout, output.stderr);
    assert!(output.stderr.contains("no member completed"), "{}", output.stderr);
    assert!(Table::read(&folder.join("out/study.csv")).texts("verdict").iter().all(|word| *word == "failed"));
}

/// A member that exceeds its own wall time limit is a row with that reason, and runs again only on
/// request. A signal within a member ends the study. The message tells how to resume the study, not
/// the member.
#[test]
fn a_member_out_of_time_is_a_row_and_a_signal_ends_the_study() {
    let text = "case: case.yml\nset: { time.end: 1.0, time.step: 1.0e-4 }\nmembers:\n  short: { output.checkpoint: { every: 1000, wall_time: 0.2 } }\n  \
                done: { time.end: 1.0e-3 }\n  long: { time.step: 1.0e-5 }\nreference: finest\nquantities:\n  \
                a: { table: energy.csv, column: \"total [J]\", measure: last }\n";
    let folder = folder(text);
    for (more, before) in [(&[][..], false), (&[], true), (&["--rerun-failed"], false)] {
        let line = [&["study", "study.yml", "--output", "out"], more].concat();
        let running = Running::start(2, &line, &folder);
        let deadline = Instant::now() + Duration::from_secs(300);
        let steps = folder.join("out/members/long/energy.csv");
        let size = || fs::metadata(&steps).map_or(0, |file| file.len());
        while size() < 1000 && Instant::now() < deadline {
            std::thread::sleep(Duration::from_millis(5));
        }
        running.signal("USR1");
        let output = running.wait(Duration::from_secs(300));
        assert_eq!(output.code, Some(7), "{}\n{}", output.stdout, output.stderr);
        assert!(output.stderr.contains("SIGUSR1: member long"), "{}", output.stderr);
        assert!(output.stderr.contains("the same command"), "{}", output.stderr);
        assert!(!output.stderr.contains("--restart"), "{}", output.stderr);
        let short = output.stdout.lines().find(|line| line.contains("[1/3] short: ")).unwrap_or_default();
        assert!(short.contains("failed: the wall time limit is reached"), "{}", output.stdout);
        assert_eq!(short.ends_with("(before)"), before, "{short}");
        let table = Table::read(&folder.join("out/study.csv"));
        assert_eq!(table.texts("verdict"), ["failed", "completed", "waiting"]);
        fs::remove_dir_all(folder.join("out/members/long")).unwrap();
    }
}

/// The memory of a member is that of a separate run, whatever ran before it.
#[test]
fn a_small_member_after_a_large_one_has_its_own_memory() {
    let text = "case: case.yml\nset: { time.end: 5.0e-4, output: { fields: { every: 0 } } }\nsweep:\n  cells: { key: \
                bodies.block.mesh.box.cells, values: { large: [120, 120], small: [5, 5] } }\nreference: finest\nquantities:\n  \
                reaction: { table: reactions.csv, where: { boundary: clamp }, column: \"force_x [N]\", measure: { at: 5.0e-4 } }\n";
    let peaks = |text: &str| {
        let folder = folder(text);
        study(1, &[], &folder).success();
        Table::read(&folder.join("out/study.csv")).numbers("peak memory")
    };
    let [large, small] = peaks(text)[..] else { panic!("two members") };
    let [alone] = peaks(&text.replace("large: [120, 120], ", ""))[..] else { panic!("one member") };
    assert!(large > alone + 50.0, "{large} MiB, {alone} MiB");
    assert!((small - alone).abs() < 6.0, "{small} MiB after a large one, {alone} MiB alone");
}

/// Damaged results are not used. A member runs again if its tables were truncated, changed or lost,
/// or if its record or the study's marker is damaged. The study then has the same results.
#[test]
fn damaged_members_run_again() {
    let text = "case: case.yml\nsweep:\n  step: { key: time.step, values: { a: 1.0e-3, b: 5.0e-4, c: 2.5e-4 } }\nreference: finest\n\
                quantities:\n  reaction: { table: reactions.csv, where: { boundary: clamp }, column: \"force_x [N]\", measure: { at: 0.002 } }\n";
    let folder = folder(text);
    let values = |more: &[&str]| {
        let output = study(0, more, &folder).success();
        let again = output.stdout.matches("the member runs again").count();
        let before = output.stdout.matches("(before)").count();
        let table = Table::read(&folder.join("out/study.csv"));
        let values: Vec<String> = table.texts("reaction").into_iter().map(str::to_owned).collect();
        (values, again, before)
    };
    let (whole, ..) = values(&[]);
    let member = |name: &str| folder.join("out/members").join(name);
    let cut = |file: std::path::PathBuf, part: usize| {
        let bytes = fs::read(&file).unwrap();
        fs::write(&file, &bytes[..bytes.len() * part / 4]).unwrap();
    };
    cut(member("step-a/reactions.csv"), 2);
    cut(member("step-b/energy.csv"), 0);
    fs::remove_file(member("step-c/probes.csv")).unwrap();
    assert_eq!(values(&[]), (whole.clone(), 3, 0));
    cut(member("step-a/run.json"), 3);
    cut(member("step-b/run.json"), 0);
    fs::remove_file(member("step-c/run.json")).unwrap();
    cut(folder.join("out/study.json"), 1);
    assert_eq!(values(&[]), (whole.clone(), 3, 0));
    let record = fs::read_to_string(member("step-a/run.json")).unwrap();
    let early = record.replace("\"simulated_time\": 0.002", "\"simulated_time\": 0.001");
    assert_ne!(record, early);
    fs::write(member("step-a/run.json"), early).unwrap();
    assert_eq!(values(&[]), (whole.clone(), 1, 2));
    assert_eq!(values(&[]), (whole, 0, 3));
}

/// Only one study runs at a time in a folder: a second one is refused, and one whose folder is
/// moved ends.
#[test]
fn a_study_has_its_folder_alone() {
    let folder = folder(&STUDY.replace("case: case.yml", "case: case.yml\nset: { time.end: 30.0 }"));
    let first = Running::start(0, &["study", "study.yml", "--output", "out", "--quiet"], &folder);
    let deadline = Instant::now() + Duration::from_secs(300);
    while !folder.join("out/members/reference/energy.csv").exists() && Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(5));
    }
    let second = study(0, &[], &folder);
    assert_eq!(second.code, Some(4), "{}", second.stderr);
    assert!(
        second.stderr.contains("out: another run is writing to this folder, process "),
        "{}",
        second.stderr
    );
    fs::rename(folder.join("out"), folder.join("moved")).unwrap();
    let first = first.wait(Duration::from_secs(300));
    assert_eq!(first.code, Some(4), "{}", first.stderr);
    assert!(first.stderr.contains("moved, deleted or replaced"), "{}", first.stderr);
    assert!(!folder.join("out").exists());
}
