//! A run that is interrupted and resumed has the results of an uninterrupted one, whether that one
//! writes checkpoints or not: to the last bit on the same number of ranks, to rounding on another.
//! Defects of a checkpoint are reported before any file is modified.
//!
//! Bits are compared with GMRES, because MUMPS on several ranks rounds differently each time, and the
//! multigrid on more than two. The static start is factorised on one rank.

#[path = "../common/mod.rs"]
mod common;
mod kills;
mod refusals;
mod stops;
mod to_the_bit;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use common::{Folder, Output, Running, Table, run, send, two_pairs};

/// Displacements on other numbers of ranks agree to this fraction of the largest one.
const AGREEMENT: f64 = 1e-10;
const GMRES: &str = "{ linear: gmres_asm_ilu }";
const TIGHT: &str = "{ linear: direct, newton: { inexact: false, tolerance: 1.0e-11 } }";

/// Bytes before the header of a checkpoint, and of its hash.
const HEAD: usize = 37;
const HASH: usize = 32;

/// A shipped case with some of its text replaced, a solver, and a checkpoint at fixed intervals of
/// steps, all of which are kept.
#[track_caller]
fn shipped(case: &str, changes: &[(&str, &str)], solver: &str, every: u32) -> String {
    let checkpoint = format!("output:\n  checkpoint: {{ every: {every}, keep: 1000 }}\n");
    let text = common::shipped(case, &[changes, &[("output:\n", &checkpoint)]].concat());
    let others = text.lines().filter(|line| !line.starts_with("solver:"));
    others.chain([&*format!("solver: {solver}")]).map(|line| format!("{line}\n")).collect()
}

/// Velocity-regularised friction on a rigid plane, Newmark.
fn rubber_block(solver: &str, end: &str, every: u32) -> String {
    let small = [("cells: [48, 50]", "cells: [12, 13]"), ("end: 0.07", end)];
    shipped("rubber-block/case.yml", &small, solver, every)
}

/// Two bodies, return map, statics. Points move to other facets, and the sparsity pattern of the
/// matrix grows.
fn ironing(solver: &str) -> String {
    let small = [("cells: [48, 6]", "cells: [16, 3]"), ("cells: [40, 10]", "cells: [20, 4]")];
    shipped("ironing/case.yml", &small, solver, 8)
}

/// Three dimensions.
fn rubber_cube(solver: &str) -> String {
    let small = [("cells: [10, 10, 10]", "cells: [4, 4, 4]"), ("end: 0.03", "end: 0.004")];
    shipped("rubber-cube/case.yml", &small, solver, 3)
}

/// Two bodies with velocity-regularised friction, generalised-alpha. The forces at the start of a
/// step matter.
fn concrete_block(solver: &str) -> String {
    shipped("concrete-block/case.yml", &[("end: 0.094", "end: 0.01")], solver, 16)
}

/// A folder with a case and its runs.
fn place(text: &str) -> Folder {
    let folder = Folder::new("restart");
    folder.write("case.yml", text);
    folder
}

fn compute(folder: &Folder, ranks: usize, output: &str, more: &[&str]) -> Output {
    run(ranks, &[&["case.yml", "-q", "-o", output], more].concat(), folder)
}

/// All files of a result by name, except the record and the checkpoints.
fn files(results: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let (mut found, mut folders) = (BTreeMap::new(), vec![results.to_path_buf()]);
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder").flatten() {
            let path = entry.path();
            let name = path.strip_prefix(results).expect("a file within").to_path_buf();
            if path.is_dir() && !name.starts_with("checkpoints") {
                folders.push(path);
            } else if path.is_file() && name != Path::new("run.json") {
                found.insert(name, fs::read(&path).expect("a file"));
            }
        }
    }
    found
}

#[track_caller]
fn same_bits(one: &Path, other: &Path) {
    let (one, other) = (files(one), files(other));
    assert_eq!(one.keys().collect::<Vec<_>>(), other.keys().collect::<Vec<_>>());
    assert!(one.contains_key(Path::new("energy.csv")) && one.contains_key(Path::new("fields.pvd")));
    let apart: Vec<_> = one.iter().filter(|(name, bytes)| other[*name] != **bytes).map(|(n, _)| n).collect();
    assert!(apart.is_empty(), "not the same: {apart:?}");
}

/// The state in a checkpoint: the numbers of its header, and the rows of its sections.
fn state(checkpoint: &Path) -> (serde_json::Value, Vec<u8>) {
    let bytes = fs::read(checkpoint).expect("a checkpoint");
    let end = HEAD + header_length(&bytes);
    let header: serde_json::Value = serde_json::from_slice(&bytes[HEAD..end]).expect("a header");
    (header["state"]["run"].clone(), bytes[end..bytes.len() - HASH].to_vec())
}

/// Length of the header of a checkpoint.
fn header_length(bytes: &[u8]) -> usize {
    u64::from_le_bytes(bytes[HEAD - 8..HEAD].try_into().expect("a length")) as usize
}

fn copy(from: &Path, to: &Path) {
    let copied = std::process::Command::new("cp").arg("-r").args([from, to]).status();
    assert!(copied.is_ok_and(|status| status.success()));
}

/// The complete checkpoints. The name of a half-written one ends in `part`.
fn checkpoints(results: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(results.join("checkpoints")).into_iter().flatten().flatten();
    let mut found: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    found.retain(|path| path.extension().is_some_and(|end| end == "ckpt"));
    found.sort();
    found
}

fn record(results: &Path) -> serde_json::Value {
    let text = fs::read_to_string(results.join("run.json")).expect("a record");
    serde_json::from_str(&text).expect("JSON")
}

/// Largest difference of the displacements of all probes, divided by the largest displacement.
#[track_caller]
fn apart(one: &Path, other: &Path) -> f64 {
    let [one, other] = [one, other].map(|results| {
        let table = Table::read(&results.join("probes.csv"));
        let names = table.names().filter(|name| name.contains(".u_"));
        let steps: Vec<f64> = table.numbers("step");
        assert!(steps.iter().enumerate().all(|(row, step)| row as f64 == *step), "a gap or a double row");
        names.flat_map(|name| table.numbers(name)).collect::<Vec<_>>()
    });
    assert!(!one.is_empty() && one.len() == other.len(), "{} and {} numbers", one.len(), other.len());
    let largest = one.iter().fold(0.0f64, |most, u| most.max(u.abs()));
    one.iter().zip(&other).fold(0.0f64, |most, (a, b)| most.max((a - b).abs())) / largest
}
