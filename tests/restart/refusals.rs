//! Incompatible checkpoints, a full disk, and branches.

use sha2::Digest;

use super::*;

/// Checks the exit code, the words, and that no file of the results has changed.
#[track_caller]
fn refused(folder: &Folder, more: &[&str], code: i32, words: &[&str]) {
    let before = files(&folder.join("out"));
    let output = compute(folder, 0, "out", more);
    assert_eq!(output.code, Some(code), "{}", output.stderr);
    assert_eq!(output.stderr.matches("contact-petsc: error:").count(), 1, "{}", output.stderr);
    for word in words {
        assert!(output.stderr.contains(word), "no '{word}' in: {}", output.stderr);
    }
    assert_eq!(files(&folder.join("out")), before);
}

/// An incomplete checkpoint is an error that suggests the previous one. Another case, another mesh
/// and lost rows are errors, too. None of them modifies a file.
#[test]
fn what_does_not_fit_is_refused() {
    let folder = place(&rubber_block(GMRES, "end: 0.01", 5));
    let out = folder.join("out");
    let none = compute(&folder, 0, "out", &["--restart"]);
    assert!(none.code == Some(4) && none.stderr.contains("no such folder"), "{}", none.stderr);
    compute(&folder, 0, "out", &[]).success();
    let all = checkpoints(&out);
    let (newest, older) = (&all[all.len() - 1], &all[all.len() - 2]);
    let whole = fs::read(newest).expect("a checkpoint");
    let offer =
        format!("--restart=out/checkpoints/{}", older.file_name().and_then(|n| n.to_str()).expect("a name"));
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    let mut later = whole.clone();
    later[25] = 99;
    for (bytes, words) in [
        (&whole[..whole.len() / 2], "truncated"),
        (&whole[..10], "truncated"),
        (&flipped, "SHA-256"),
        (&later, "format 99; this program reads format"),
        (b"something else that is long enough to be looked at", "not a checkpoint"),
    ] {
        fs::write(newest, bytes).expect("a damaged checkpoint");
        refused(&folder, &["--restart"], 4, &[words, "earlier checkpoint of step", &offer]);
    }
    fs::write(newest, &whole).expect("the checkpoint");
    // Of those that are whole, the last one before the missing one is offered, and one after it only if there is no other.
    let offer =
        format!("--restart=out/checkpoints/{}", all[0].file_name().and_then(|n| n.to_str()).expect("a name"));
    refused(
        &folder,
        &["--restart=out/checkpoints/step-000001.ckpt"],
        4,
        &["later checkpoint of step", &offer],
    );

    let case = fs::read_to_string(folder.join("case.yml")).expect("the case");
    for (from, to, words) in [
        ("coefficient: 1.0", "coefficient: 0.9", "contact.sole.friction"),
        ("step: 5.0e-4", "step: 2.5e-4", "time.step was 0.0005 and is 0.00025"),
        ("cells: [12, 13]", "cells: [12, 12]", "bodies.block.mesh"),
        ("node_50: { at: [0, 0] }", "node_50: { at: [0, 0.1] }", "output.probes"),
        ("end: 0.01", "end: 0.005", "the case ends at"),
    ] {
        assert!(case.contains(from), "{from}");
        folder.write("case.yml", &case.replace(from, to));
        refused(&folder, &["--restart"], 3, &[words, "hint: "]);
    }
    folder.write("case.yml", &case);
    let rows = fs::read(out.join("energy.csv")).expect("a table");
    fs::write(out.join("energy.csv"), &rows[..rows.len() - 10]).expect("a shorter table");
    refused(&folder, &["--restart"], 4, &["energy.csv", "rows are missing", "--restart=FILE"]);
    let mut other = rows.clone();
    let place = other.iter().rposition(u8::is_ascii_digit).expect("a number");
    other[place] ^= 1;
    fs::write(out.join("energy.csv"), other).expect("another table");
    refused(&folder, &["--restart"], 4, &["energy.csv: damaged", "hint: "]);
    fs::write(out.join("energy.csv"), rows).expect("the table");

    // What may change: title, solver, partition, fields, end.
    let more =
        case.replace("end: 0.01", "end: 0.012").replace("fields: { every: 10 }", "fields: { every: 3 }");
    folder.write(
        "case.yml",
        &more.replace("title: ", "partition: ptscotch\ntitle: Again, ").replace(GMRES, TIGHT),
    );
    compute(&folder, 0, "out", &["--restart"]).success();
    assert_eq!(Table::read(&out.join("energy.csv")).last("step"), 24.0);

    fs::remove_dir_all(out.join("checkpoints")).expect("no checkpoints");
    refused(
        &folder,
        &["--restart"],
        4,
        &["no checkpoint", "without --restart", "checkpoint: { every: 100 }"],
    );
}

/// A checkpoint without a part of the state is refused, whichever part it is.
#[test]
fn no_part_may_be_missing() {
    let folder = place(&rubber_block(GMRES, "end: 0.001", 1));
    compute(&folder, 0, "out", &[]).success();
    let path = checkpoints(&folder.join("out")).swap_remove(0);
    let whole = fs::read(&path).expect("a checkpoint");
    let length = header_length(&whole);
    let header: serde_json::Value = serde_json::from_slice(&whole[HEAD..HEAD + length]).expect("a header");
    let parts = header["state"]["run"]["parts"].as_object().expect("the parts");
    let names: Vec<&String> = parts.keys().collect();
    assert!(names.len() > 6, "{names:?}");
    for name in names {
        let mut header = header.clone();
        header["state"]["run"]["parts"].as_object_mut().expect("the parts").remove(name);
        let text = serde_json::to_vec(&header).expect("a header");
        let rows = &whole[HEAD + length..whole.len() - HASH];
        let mut bytes = [&whole[..HEAD - 8], &(text.len() as u64).to_le_bytes(), &text, rows].concat();
        let hash = sha2::Sha256::digest(&bytes);
        bytes.extend_from_slice(&hash);
        fs::write(&path, bytes).expect("a checkpoint without a part");
        let from = "--restart=checkpoints/step-000001.ckpt";
        refused(&folder, &[from], 4, &[&format!("a checkpoint without the part '{name}'")]);
    }
}

/// If the disk is full when a checkpoint is written, the error suggests the older one. A run
/// resumed from it has the results of an uninterrupted one.
#[test]
fn a_full_disk_loses_nothing_on_1_and_2_ranks() {
    let folder = place(&rubber_block(GMRES, "end: 0.005", 10));
    let out = folder.join("out");
    for ranks in [1, 2] {
        folder.write("case.yml", &rubber_block(GMRES, "end: 0.005", 10));
        compute(&folder, ranks, "out", &[]).success();
        let _ = fs::remove_dir_all(folder.join("whole"));
        copy(&out, &folder.join("whole"));
        folder.write("case.yml", &rubber_block(GMRES, "end: 0.015", 10));
        compute(&folder, ranks, "whole", &["--restart"]).success();
        // What is written here meets a disk without room.
        std::os::unix::fs::symlink("/dev/full", out.join("checkpoints/step-000020.part")).expect("a link");
        let full = compute(&folder, ranks, "out", &["--restart"]);
        assert_eq!(full.code, Some(4), "{}", full.stderr);
        assert_eq!(full.stderr.matches("contact-petsc: error:").count(), 1, "{}", full.stderr);
        for words in ["No space left", "step-000020.ckpt", "the checkpoint of step 10 is intact", "--restart"]
        {
            assert!(full.stderr.contains(words), "no '{words}' in: {}", full.stderr);
        }
        assert_eq!(checkpoints(&out).len(), 1, "{:?}", checkpoints(&out));
        // So it is told where another file meets it.
        std::os::unix::fs::symlink("/dev/full", out.join("run.json.part")).expect("a link");
        let full = compute(&folder, ranks, "out", &["--restart"]);
        assert_eq!(full.code, Some(4), "{}", full.stderr);
        for words in ["No space left", "run.json", "the checkpoint of step 10 is intact", "--restart"] {
            assert!(full.stderr.contains(words), "no '{words}' in: {}", full.stderr);
        }
        compute(&folder, ranks, "out", &["--restart"]).success();
        same_bits(&folder.join("whole"), &out);
    }
}

/// A checkpoint starts a branch in a new folder. Its rows are those with which the resumed run
/// continued, and the branch can be resumed itself. The first run is not modified. Without a
/// checkpoint there is nothing to resume.
#[test]
fn a_run_branches_off_on_1_and_2_ranks() {
    for ranks in [0, 2] {
        let folder = place(&rubber_block(GMRES, "end: 0.01", 5));
        compute(&folder, ranks, "whole", &[]).success();
        let before = files(&folder.join("whole"));
        let from = "--restart=whole/checkpoints/step-000010.ckpt";
        compute(&folder, ranks, "branch", &[from]).success();
        assert_eq!(before, files(&folder.join("whole")));
        for name in ["energy.csv", "probes.csv", "contact.csv"] {
            let text = |results: &str| fs::read_to_string(folder.join(results).join(name)).expect("a table");
            let (whole, branch) = (text("whole"), text("branch"));
            let mut rows = branch.lines();
            assert_eq!(rows.next(), whole.lines().next(), "{name}");
            let later: Vec<&str> = rows.collect();
            assert!(later.len() == 10 && later[0].starts_with("11,"), "{name}: {later:?}");
            assert!(whole.lines().skip(12).eq(later), "{name}");
        }
        assert_eq!(record(&folder.join("branch"))["restarts"], 1);
        let on = "--restart=branch/checkpoints/step-000015.ckpt";
        compute(&folder, ranks, "branch", &[on]).success();
        assert_eq!(Table::read(&folder.join("branch/energy.csv")).len(), 10);
        let absent = compute(&folder, ranks, "absent", &["--restart"]);
        assert_eq!(absent.code, Some(4), "{}", absent.stderr);
        assert!(
            absent.stderr.contains("no run to resume") && !absent.stderr.contains("plot"),
            "{}",
            absent.stderr
        );
        assert!(!folder.join("absent").exists());
    }
}

/// Field files that are missing when a run resumes are removed from the series, and their number is
/// reported. A damaged series is refused.
#[test]
fn the_series_names_no_fields_that_are_gone() {
    let text = rubber_block(GMRES, "end: 0.005", 5);
    let text = text.replace("fields: { every: 10 }", "fields: { every: 5 }");
    let folder = place(&text);
    compute(&folder, 0, "out", &[]).success();
    let out = folder.join("out");
    fs::remove_dir_all(out.join("fields")).expect("fields");
    folder.write("case.yml", &text.replace("end: 0.005", "end: 0.0075"));
    let output = compute(&folder, 1, "out", &["--restart"]).success();
    assert!(output.stderr.contains("3 field steps"), "{}", output.stderr);
    assert!(record(&out)["warnings"].to_string().contains("3 field steps"));
    let series = fs::read_to_string(out.join("fields.pvd")).expect("a series");
    let named: Vec<&str> =
        series.split("file=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    assert!(!named.is_empty() && named.iter().all(|file| out.join(file).is_file()), "{series}");
    fs::write(out.join("fields.pvd"), "<VTKFile").expect("a damaged series");
    folder.write("case.yml", &text.replace("end: 0.005", "end: 0.008"));
    refused(&folder, &["--restart"], 4, &["fields.pvd: truncated", "hint: remove this file"]);
}
