//! A run with terminals, pipes and libraries: none of them ends it, slows it down, or remains
//! unrecorded.

mod common;

use std::fs;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use common::{ENVIRONMENT, Folder, PROGRAM, SMALL_BLOCK, Table, send};

/// A shell command in which `$PROGRAM` is the program, without `OPENBLAS_NUM_THREADS` and
/// `OMP_NUM_THREADS`, which the program does not need.
fn shell(line: &str, folder: &Folder) -> Output {
    let mut command = Command::new("timeout");
    command.args(["-k", "5", "300", "bash", "-c", line]).current_dir(&**folder).env("PROGRAM", PROGRAM);
    command.envs(ENVIRONMENT).env_remove("OPENBLAS_NUM_THREADS").env_remove("OMP_NUM_THREADS");
    command.output().expect("bash starts")
}

fn record(folder: &Folder) -> serde_json::Value {
    let text = fs::read_to_string(folder.join("out/run.json")).expect("a record");
    serde_json::from_str(&text).expect("JSON")
}

/// A case with thousands of steps.
fn long(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("case.yml", &SMALL_BLOCK.replace("end: 0.002", "end: 0.3"));
    folder
}

/// The BLAS has one thread unless the user chose another number. Both are recorded, with the names
/// of the libraries.
#[test]
fn the_blas_has_one_thread_unless_told() {
    let folder = Folder::new("threads");
    folder.write("case.yml", SMALL_BLOCK);
    let threads = |before: &str| {
        let output = shell(&format!("{before} $PROGRAM case.yml -q -o out"), &folder);
        assert!(output.status.success(), "{output:?}");
        record(&folder)["blas_threads"].clone()
    };
    let [own, chosen] = [threads(""), threads("OPENBLAS_NUM_THREADS=2")];
    if !own.is_null() {
        assert_eq!(own, 1);
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        assert_eq!(chosen, cores.min(2));
    }
    let record = record(&folder);
    let versions = record["versions"].as_object().expect("versions");
    let names: Vec<&str> = versions.keys().map(String::as_str).collect();
    assert_eq!([names[0], names[1], names[3]], ["contact-petsc", "PETSc", "METIS"], "{names:?}");
    assert!(["Open MPI", "MPICH", "Intel(R) MPI Library"].contains(&names[2]), "{names:?}");
    let number = |text: &str| text.trim_start_matches('v').starts_with(|first: char| first.is_ascii_digit());
    assert!(versions.values().all(|version| version.as_str().is_some_and(number)), "{versions:?}");
}

/// A reader that closes the pipe after three lines does not end the run, on one rank and on two.
#[test]
fn a_closed_pipe_ends_no_run_on_1_and_2_ranks() {
    for start in ["", "mpirun -n 2 "] {
        let folder = Folder::new("pipe");
        folder.write("case.yml", SMALL_BLOCK);
        let line = format!("{start}$PROGRAM case.yml -v -o out 2>&1 | head -3; exit ${{PIPESTATUS[0]}}");
        let output = shell(&line, &folder);
        if !start.is_empty() && record(&folder)["verdict"] == "stopped" {
            continue; // Open MPI 5 may ask its ranks to stop when its own output has nowhere to go.
        }
        assert_eq!(record(&folder)["verdict"], "completed", "{output:?}");
        assert!(!start.is_empty() || output.status.success(), "{output:?}");
        assert_eq!(Table::read(&folder.join("out/energy.csv")).len(), 5);
    }
}

/// A second run is refused the folder of a run in progress, and changes nothing. A killed run is
/// distinguished from a running one, and its folder is free.
#[test]
fn two_runs_do_not_share_a_folder() {
    let folder = Folder::new("shared");
    folder.write("case.yml", &SMALL_BLOCK.replace("end: 0.002", "end: 30.0"));
    let line = "$PROGRAM case.yml -q -o out & first=$!
        until [ -s out/energy.csv ]; do sleep 0.01; done
        $PROGRAM case.yml -q -o out; echo $?; $PROGRAM case.yml -q -o out --restart; echo $?
        $PROGRAM plot out; kill -9 $first; wait $first
        $PROGRAM plot out; $PROGRAM report out > page; grep -c '>killed</span>' out/report.html";
    let output = shell(line, &folder);
    let [said, warned] =
        [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text).into_owned());
    let codes: Vec<&str> = said.lines().filter(|line| line.parse::<i32>().is_ok()).collect();
    assert_eq!(codes, ["4", "4", "1"], "{output:?}");
    assert!(warned.contains("out: another run is writing to this folder, process "), "{warned}");
    let verdicts: Vec<bool> = warned
        .lines()
        .filter(|line| line.contains("(verdict: "))
        .map(|line| line.contains("killed"))
        .collect();
    assert_eq!(verdicts, [false, true, true], "{warned}");
    let rows = Table::read(&folder.join("out/energy.csv")).numbers("step");
    assert!(rows.iter().zip(0..).all(|(&row, step)| row == f64::from(step)), "{rows:?}");
    fs::write(folder.join("case.yml"), SMALL_BLOCK).expect("a case that ends");
    assert!(shell("$PROGRAM case.yml -q -o out", &folder).status.success());
}

/// Under `nohup` a lost terminal does not stop a run; otherwise it does (tests/restart).
#[test]
fn nohup_keeps_a_run_going() {
    let folder = long("nohup");
    let line = "nohup $PROGRAM case.yml -q -o out > log 2>&1 & echo $! > id; wait $!";
    let mut command = Command::new("timeout");
    command.args(["-k", "5", "300", "bash", "-c", line]).current_dir(&*folder).env("PROGRAM", PROGRAM);
    let mut running = command.envs(ENVIRONMENT).spawn().expect("bash starts");
    let rows = || fs::read_to_string(folder.join("out/energy.csv")).map_or(0, |text| text.lines().count());
    let wait_for = |count: usize| {
        let deadline = Instant::now() + Duration::from_secs(300);
        while rows() < count && Instant::now() < deadline {
            std::thread::sleep(Duration::from_millis(5));
        }
        rows()
    };
    assert!(wait_for(5) >= 5);
    let id = fs::read_to_string(folder.join("id")).expect("the process");
    assert!(send("HUP", id.trim()));
    let reached = rows();
    assert!(wait_for(reached + 20) >= reached + 20, "it stopped at SIGHUP");
    assert!(send("TERM", id.trim()));
    assert_eq!(running.wait().expect("its end").code(), Some(7));
}

/// An additional body without any contact.
const BIRD: &str = "  bird:\n    mesh: { box: { min: [9, 9], max: [9.1, 9.1], cells: [1, 1] } }\n    \
    material: { neo_hookean: { young_modulus: 5.0e6, poisson_ratio: 0.3 } }\n    density: 1700\n";

/// An unused option is recorded, and a quiet run prints it and nothing else. A flying body causes
/// no warning.
#[test]
fn the_record_has_what_the_console_leaves_out() {
    let folder = Folder::new("record");
    let free = SMALL_BLOCK
        .replace(
            "clamp: { on: block.top, displacement: { x: \"1.0 * t\", y: -0.01 } }",
            "push: { on: block.top, traction: { y: -10 } }",
        )
        .replace("start: { equilibrium: { friction: false, increments: 2 } }\n", "")
        .replace("obstacles:", &format!("{BIRD}obstacles:"));
    folder.write("case.yml", &free);
    let output = shell("$PROGRAM case.yml -q -o out -- -snes_mponitor 3", &folder);
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && output.stdout.is_empty(), "{output:?}");
    assert!(told.starts_with("warning: the PETSc option") && told.lines().count() == 1, "{told}");
    let warnings = record(&folder)["warnings"].clone();
    let warnings: Vec<&str> =
        warnings.as_array().into_iter().flatten().filter_map(|text| text.as_str()).collect();
    assert!(warnings.contains(&"the PETSc option `-snes_mponitor 3` was not used"), "{warnings:?}");
    assert!(!warnings.iter().any(|text| text.contains("holds")), "{warnings:?}");
    let output = shell("$PROGRAM case.yml -o out", &folder);
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("note      no support or contact holds 'bird' along x, y"), "{said}");
    // The floor holds it, as in every ordinary case.
    assert!(!said.contains("'block' along"), "{said}");
}

/// Two ranks that share neither memory nor a working directory, and communicate by TCP. They give
/// the results of one host with the planned number of messages. `scripts/two-hosts` without `SHORT`
/// runs them on two hosts, which needs network namespaces.
#[test]
fn two_hosts_need_no_shared_memory_on_2_ranks() {
    let folder = Folder::new("hosts");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/scripts/two-hosts");
    let output = shell(&format!("SHORT=1 {script} results"), &folder);
    let said = String::from_utf8_lossy(&output.stdout);
    let held = said.lines().filter(|line| line.starts_with("ok ")).count();
    assert!(output.status.success() && held == 8 && !said.contains("FAIL"), "{output:?}");
}

/// Printing into a full device is an error of code 4, on standard output and on standard error,
/// also for help. It is also an error for the output of a run or a study, whose results are
/// complete.
#[test]
fn a_full_device_is_no_place_to_print() {
    let folder = Folder::new("device");
    folder.write("case.yml", SMALL_BLOCK);
    folder.write("study.yml", "case: case.yml\nmembers: { a: {} }\nreference: finest\nquantities: { e: { table: energy.csv, column: \"total [J]\", measure: last } }\n");
    let line = "$PROGRAM case.yml -q -o out && mv out/probes.csv out/x
        for words in list schema 'schema --study' 'completions bash' --help --version 'parts case.yml 2' 'check case.yml' \
          'study study.yml --dry-run' 'plot out' 'report out'; do $PROGRAM $words >/dev/full; echo $?; done
        $PROGRAM plot out 2>/dev/full >/dev/null; echo $?
        for words in 'case.yml -o whole' 'study study.yml -o members'; do $PROGRAM $words >/dev/full; echo $?; done
        cat whole/run.json members/members/a/run.json | grep -c '\"verdict\": \"completed\"'
        $PROGRAM schema | head -1 >/dev/null; echo ${PIPESTATUS[0]}";
    let output = shell(line, &folder);
    let said = String::from_utf8_lossy(&output.stdout);
    let codes: Vec<&str> = said.lines().collect();
    assert_eq!(codes[..14], ["4"; 14], "{output:?}");
    assert_eq!(codes[14..], ["2", "0"], "{output:?}");
    let warned = String::from_utf8_lossy(&output.stderr);
    assert_eq!(warned.matches("standard output can not be written: No space").count(), 13, "{warned}");
    assert_eq!(warned.matches("hint: the results are complete").count(), 2, "{warned}");
}

/// If a results folder is moved, or a table is deleted, emptied or changed while a run writes it,
/// the run ends with code 4. Nothing is created again at the old path.
#[test]
fn results_that_are_touched_end_the_run_on_1_and_2_ranks() {
    for (start, change, words) in [
        ("", "mv out moved", "moved, deleted or replaced"),
        ("", "until rm -rf out 2>/dev/null; do :; done", "moved, deleted or replaced"),
        ("", "rm out/reactions.csv", "out/reactions.csv: moved, deleted or replaced"),
        ("", ": > out/contact.csv", "out/contact.csv: changed during the run"),
        ("mpirun -n 2 ", "mv out moved", "moved, deleted or replaced"),
    ] {
        let folder = Folder::new("touched");
        let often = SMALL_BLOCK
            .replace("end: 0.002", "end: 30.0")
            .replace("output: {", "output: { fields: { every: 5 },");
        folder.write("case.yml", &often);
        let line = format!(
            "{start}$PROGRAM case.yml -q -o out & run=$!
             until [ -s out/energy.csv ] && [ $(wc -l <out/energy.csv) -gt 8 ]; do sleep 0.01; done
             {change}; wait $run; echo $?"
        );
        let output = shell(&line, &folder);
        let (said, warned) =
            (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert_eq!(said.trim(), "4", "{change}: {warned}");
        // A folder that is just being deleted may still be there while a file can no longer be written in it.
        let half_gone = change.contains("rm -rf") && warned.contains("can not write");
        assert!(warned.contains(words) || half_gone, "{change}: {warned}");
        assert_eq!(warned.matches("contact-petsc: error").count(), 1, "{change}: {warned}");
        assert_eq!(folder.join("out").exists(), change.contains("out/"), "{change}: {warned}");
        if folder.join("out").exists() {
            let record = record(&folder);
            assert_eq!((&record["verdict"], &record["exit_code"]), (&"failed".into(), &4.into()), "{change}");
        }
    }
}

/// Ranks that work in different folders write to the relative path as rank 0 resolves it.
#[test]
fn ranks_in_different_folders_share_the_results_on_2_ranks() {
    let folder = Folder::new("apart");
    fs::create_dir(folder.join("elsewhere")).expect("a folder");
    folder.write("case.yml", SMALL_BLOCK);
    let line =
        "mpirun -n 1 $PROGRAM case.yml -q -o out : -n 1 -wdir $PWD/elsewhere $PROGRAM case.yml -q -o out";
    let output = shell(line, &folder);
    assert!(output.status.success(), "{output:?}");
    let series = fs::read_to_string(folder.join("out/fields.pvd")).expect("a series");
    assert!(series.contains("step_000004/volume.pvtu"), "{series}");
    for piece in ["volume_0000.vtu", "volume_0001.vtu", "contact_0000.vtu", "contact_0001.vtu"] {
        assert!(folder.join("out/fields/step_000004").join(piece).is_file(), "{piece}");
    }
    assert_eq!(fs::read_dir(folder.join("elsewhere")).expect("a folder").count(), 0);
}

/// Without address space for the BLAS a run is refused, on any rank, and does not hang.
#[test]
fn a_limit_of_address_space_is_refused_on_1_and_2_ranks() {
    let folder = Folder::new("space");
    folder.write("case.yml", SMALL_BLOCK);
    // Enough to load the program with its libraries, and not for a buffer of the BLAS.
    let limited = "ulimit -v 300000; exec $PROGRAM case.yml -q -o out";
    for line in [
        format!("({limited})"),
        format!("mpirun -n 1 $PROGRAM case.yml -q -o out : -n 1 bash -c '{limited}'"),
    ] {
        let output = shell(&line, &folder);
        let warned = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(70), "{warned}");
        assert_eq!(warned.matches("not enough memory for the libraries").count(), 1, "{warned}");
        assert!(
            warned.contains("hint: the limit is 300000 kB: raise it with `ulimit -v unlimited`"),
            "{warned}"
        );
    }
}

/// If memory is limited, OpenBLAS starts no threads before the program begins, because they could
/// wait for memory forever. Memory has one arena, unless the user chose otherwise. A pipe as the
/// case blocks the program while its environment is checked.
#[test]
fn limited_memory_makes_libraries_frugal_from_the_start() {
    let folder = Folder::new("limited");
    folder.write("case.yml", SMALL_BLOCK);
    let line = "mkfifo pipe
        for limit in 'ulimit -v 8000000' 'ulimit -d 8000000' 'ulimit -v 8000000; export OMP_NUM_THREADS=2' :; do
          bash -c \"$limit; exec $PROGRAM check pipe >said\" & id=$!
          exec 3>pipe; tr '\\0' '\\n' </proc/$id/environ | grep -cE '^(OPENBLAS_NUM_THREADS|MALLOC_ARENA_MAX)=1$'; cat /proc/$id/comm
          cat case.yml >&3; exec 3>&-; wait $id; echo $?
        done";
    let output = shell(line, &folder);
    let said = String::from_utf8_lossy(&output.stdout);
    let name = "contact-petsc";
    let expected = [["2", name, "0"], ["2", name, "0"], ["1", name, "0"], ["0", name, "0"]].concat();
    assert_eq!(said.lines().collect::<Vec<_>>(), expected, "{output:?}");
}

/// A file size limit below what MPI needs to start is an error of code 4. Commands without MPI and
/// runs without `mpirun` are not affected.
#[test]
fn a_small_limit_on_files_is_refused_on_2_ranks() {
    let folder = Folder::new("files");
    folder.write("case.yml", SMALL_BLOCK);
    let line = "ulimit -f 40
        $PROGRAM list >/dev/null && $PROGRAM check case.yml >/dev/null || exit 1
        mpirun -n 2 $PROGRAM case.yml -q -o out";
    let output = shell(line, &folder);
    let warned = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(4), "{warned}");
    assert!(warned.contains("files are limited to 40 KiB, and MPI needs 4096 KiB"), "{warned}");
    assert!(warned.contains("hint: raise the limit") && !warned.contains("PMIX"), "{warned}");
}

/// Paths with spaces, quotes, line breaks and letters of other alphabets work. The printed command
/// for a restart is valid in a shell.
#[test]
fn paths_of_any_letters_serve_on_1_and_2_ranks() {
    let folder = Folder::new("letters");
    let name = "a b'é\"ß\n漢 $(x)";
    fs::create_dir(folder.join(name)).expect("a folder");
    let case = SMALL_BLOCK.replace("output: {", "output: { checkpoint: { every: 1 },");
    folder.write(&format!("{name}/case.yml"), &case);
    let text = "case: case.yml\nmembers: { a: {} }\nreference: finest\nquantities: { e: { table: energy.csv, column: \"total [J]\", measure: last } }\n";
    folder.write(&format!("{name}/study.yml"), text);
    let line = "name=$(ls -d a*); out=\"$name/results 1\"
        for start in '' 'mpirun -n 2'; do
          $start $PROGRAM \"$name/case.yml\" -q -o \"$out\" --wall-time 1e-9 2>said; [ $? = 7 ] || [ -n \"$start\" ] || cat said >&2
          again=$(sed -n '/contact-petsc .*--restart/{s/.*contact-petsc /$PROGRAM /;p}' said)
          eval \"$again -q\" || exit 1
          grep -q '\"verdict\": \"completed\"' \"$out/run.json\" || exit 2
          rm -r \"$out\"/checkpoints
        done
        for command in check parts; do $PROGRAM $command \"$name/case.yml\" $([ $command = parts ] && echo 2) >/dev/null || exit 3; done
        for command in plot report; do $PROGRAM $command \"$out\" -o \"$name/$command\" >/dev/null || exit 4; done
        $PROGRAM chart \"$out/contact.csv\" --x step --y 'area [m2]' --by contact -o \"$name/a.svg\" || $PROGRAM chart \"$out/contact.csv\" --x step --y points --by contact -o \"$name/a.svg\" || exit 5
        $PROGRAM study \"$name/study.yml\" -q -o \"$name/study out\" || exit 6
        $PROGRAM \"$name/case.yml\" -q && ls results";
    let output = shell(line, &folder);
    assert!(output.status.success(), "{output:?}");
}

/// A pipe without a writer, or an endless device, is refused immediately as a mesh, a checkpoint or
/// a table. Only the case may be a pipe.
#[test]
fn pipes_and_devices_are_refused() {
    let folder = Folder::new("pipes");
    folder.write("case.yml", SMALL_BLOCK);
    let meshed = "box: { min: [0, 0], max: [0.4, 0.4], cells: [4, 4] }";
    assert!(SMALL_BLOCK.contains(meshed));
    folder.write("meshed.yml", &SMALL_BLOCK.replace(meshed, "file: odd"));
    let line = "$PROGRAM case.yml -q -o out || exit 1
        for make in mkfifo 'ln -s /dev/zero'; do
          $make odd
          for words in 'meshed.yml -o a' 'check meshed.yml' 'parts meshed.yml 2' 'case.yml -o a --restart=odd' \
            'chart odd --x a --y b --by c -o a.svg'; do timeout 60 $PROGRAM $words >/dev/null; echo $?; done
          for table in energy.csv run.json; do
            cp -r out copy; rm copy/$table; $make copy/$table
            for command in plot report; do timeout 60 $PROGRAM $command copy >/dev/null; echo $?; done
            rm -r copy
          done; rm odd
        done
        mkfifo case; cat case.yml >case & timeout 60 $PROGRAM case -q -o piped; echo $?
        sha256sum <case.yml | cut -d' ' -f1";
    let output = shell(line, &folder);
    let said = String::from_utf8_lossy(&output.stdout);
    let words: Vec<&str> = said.lines().collect();
    let warned = String::from_utf8_lossy(&output.stderr);
    assert_eq!(words[..18], ["4"; 18], "{said}{warned}");
    assert_eq!(words[18], "0", "{warned}");
    for what in ["a named pipe", "a device"] {
        assert!(warned.matches(&format!("it is {what}, not a regular file")).count() >= 7, "{warned}");
    }
    assert!(!warned.contains("relative to the folder of the case file"), "{warned}");
    let record = fs::read_to_string(folder.join("piped/run.json")).expect("a record");
    assert!(record.contains(words[19]), "the hash is of what was read");
}

/// No name makes a message that fills a terminal, and none moves its cursor.
#[test]
fn long_and_odd_names_make_short_messages() {
    let folder = Folder::new("names");
    let long = "x".repeat(1 << 20);
    for (from, to) in [
        ("target: floor", &*format!("target: {long}")),
        ("neo_hookean", &long),
        ("density: 1700", &format!("density: \"1 {long}\"")),
        ("1.0 * t", &format!("1.0 * {long}")),
        ("title: ", &format!("{long}: 1\n{long}: ")),
        ("on: block.top", "on: \"block.t\\e[2Jop\""),
        ("title: ", "\"a\\x01b\": "),
    ] {
        assert!(SMALL_BLOCK.contains(from));
        folder.write("case.yml", &SMALL_BLOCK.replacen(from, to, 1));
        let output = shell("$PROGRAM case.yml -q -o out", &folder);
        let warned = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{:.2000}", warned);
        assert!(warned.len() < 2000 && !warned.contains(['\u{1b}', '\u{1}']), "{:.2000}", warned);
        assert!(warned.contains("case.yml:"), "{warned}");
    }
    // A title is for people, and goes into pictures as far as they can hold it.
    let title = format!("title: \"a\\x01b\\e[2Jc <&> {long}\" #");
    folder.write("case.yml", &SMALL_BLOCK.replacen("title: ", &title, 1));
    let output = shell("$PROGRAM case.yml -q -o out && $PROGRAM plot out && $PROGRAM report out", &folder);
    assert!(output.status.success(), "{output:?}");
    for file in ["figures/energy.svg", "report.html", "fields/step_000004/volume_0000.vtu"] {
        let bytes = fs::read(folder.join("out").join(file)).expect("a file");
        let end = bytes.windows(13).position(|found| found == b"<AppendedData").unwrap_or(bytes.len());
        let text = &bytes[..end];
        assert!(!text.contains(&1) && !text.contains(&0x1b), "{file}");
    }
}
