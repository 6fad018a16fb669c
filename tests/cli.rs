//! The command line from the user's view: the results of valid input, and the end of a run that
//! cannot continue.

mod common;

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use common::{ENVIRONMENT, Folder, PROGRAM, Running, SMALL_BLOCK, Table, assert_says, run, shipped};

fn with(from: &str, to: &str) -> String {
    assert!(SMALL_BLOCK.contains(from), "not in the case: {from}");
    SMALL_BLOCK.replacen(from, to, 1)
}

/// The version output names the libraries of the running program.
#[test]
fn version_names_the_libraries() {
    let folder = Folder::new("version");
    let output = run(0, &["--version"], &folder).success();
    for library in ["PETSc 3.", "MPI", "METIS"] {
        assert!(output.stdout.contains(library), "{}", output.stdout);
    }
}

/// A run on two ranks prints its output once, and writes all its files and the fields of the start
/// and of the end.
#[test]
fn a_run_leaves_its_results_on_2_ranks() {
    let folder = Folder::new("run");
    folder.write("small.yml", &with("output: {", "output: { fields: { every: 3 },"));
    let output = run(2, &["small.yml"], &folder).success();
    assert_eq!(output.stdout.matches("Small block").count(), 1, "{}", output.stdout);
    assert_eq!(output.stdout.matches("completed at t = 0.002 s").count(), 1, "{}", output.stdout);
    let results = folder.join("results/small");
    for table in ["energy.csv", "contact.csv", "probes.csv", "reactions.csv"] {
        assert_eq!(Table::read(&results.join(table)).len(), 5, "{table}");
    }
    assert!(Table::read(&results.join("iterations.csv")).len() > 4);
    let series = fs::read_to_string(results.join("fields.pvd")).unwrap();
    for step in ["000000", "000003", "000004"] {
        assert!(series.contains(&format!("step_{step}/volume.pvtu")), "{series}");
    }
    let record = fs::read_to_string(results.join("run.json")).unwrap();
    assert!(record.contains("\"verdict\": \"completed\"") && record.contains("\"exit_code\": 0"), "{record}");
}

/// The completed case that `check` prints is a valid case and checks to the same text. Nothing is
/// solved or written.
#[test]
fn check_prints_a_case_on_1_and_2_ranks() {
    let folder = Folder::new("check");
    folder.write("case.yml", SMALL_BLOCK);
    let first = run(2, &["check", "case.yml"], &folder).success().stdout;
    for words in
        ["c_p", "CFL", "E/h", "expected penetration", "creeps", "linear solver: direct", "K_nT", "ranks"]
    {
        assert!(first.contains(words), "{words}: {first}");
    }
    // sqrt((lambda + 2 mu) / rho) of E = 5 MPa, nu = 0.3, rho = 1700.
    assert!(first.contains("c_p 6.2923e1 m/s"), "{first}");
    folder.write("again.yml", &first);
    let plain = |text: &str| text.lines().filter(|l| !l.starts_with('#')).collect::<Vec<_>>().join("\n");
    let again = run(0, &["check", "again.yml"], &folder).success().stdout;
    assert_eq!(plain(&first), plain(&again));
    assert!(!folder.join("results").exists());
}

/// The list contains the entries of every table.
#[test]
fn list_has_every_table() {
    let folder = Folder::new("list");
    let text = run(0, &["list"], &folder).success().stdout;
    for name in [
        "hex27",
        "neo_hookean",
        "selective_reduced",
        "mean_dilatation",
        "cylinder",
        "penalty",
        "coulomb",
        "stribeck",
        "stick_stiffness",
        "generalized_alpha",
        "gmres_asm_ilu",
        "auto",
    ] {
        assert!(text.contains(name), "{name}: {text}");
    }
}

/// Options of PETSc are accepted from the case and from the command line, which takes precedence.
/// An unused option is named.
#[test]
fn petsc_options_reach_petsc_on_1_and_2_ranks() {
    let folder = Folder::new("petsc");
    folder.write(
        "case.yml",
        &format!("{SMALL_BLOCK}petsc: {{ ksp_type: gmres, pc_type: jacobi, ksp_vew: }}\n"),
    );
    let words = ["case.yml", "-o", "out", "--", "-ksp_view", "-pc_type", "ilu", "-snes_mponitor", "3"];
    let output = run(1, &words, &folder).success();
    assert!(
        output.stdout.contains("type: gmres") && output.stdout.contains("type: ilu"),
        "{}",
        output.stdout
    );
    for option in ["`-snes_mponitor 3`", "`-ksp_vew`"] {
        let warnings = output.stderr.lines().filter(|line| line.contains(option));
        assert_eq!(warnings.count(), 1, "{option}: {}", output.stderr);
    }
    assert_eq!(output.stderr.matches("was not used").count(), 2, "{}", output.stderr);
    assert!(output.stdout.contains("solver    by PETSc options"), "{}", output.stdout);
    let unused = run(2, &["case.yml", "-o", "out", "--", "-pc_type", "asm", "-x_y", "1"], &folder).success();
    assert_eq!(unused.stderr.matches("`-x_y 1` was not used").count(), 1, "{}", unused.stderr);
}

/// `-v` prints the Newton table, `-vv` also the linear solvers' iterations, `-q` nothing.
#[test]
fn verbosity_has_its_levels() {
    let folder = Folder::new("verbosity");
    folder.write("case.yml", &with("time:", "solver: { linear: gmres_asm_ilu }\ntime:"));
    let said = |flag: &[&str]| {
        let output = run(0, &[&["case.yml", "-o", "out"], flag].concat(), &folder).success();
        format!("{}{}", output.stdout, output.stderr)
    };
    let (plain, newton, linear, quiet) = (said(&[]), said(&["-v"]), said(&["-vv"]), said(&["-q"]));
    assert!(plain.contains("step     4") && !plain.contains("krylov  points"), "{plain}");
    assert!(newton.contains("krylov  points") && !newton.contains("KSP Residual norm"), "{newton}");
    assert!(
        linear.contains("KSP Residual norm") && linear.contains("Linear solve converged due to"),
        "{linear}"
    );
    assert_eq!(quiet, "");
    // Warnings are no progress: they are told all the same, on standard error, and by one rank.
    for ranks in [0, 2] {
        folder.write("open.yml", &with("y: -0.01", "y: 0.01"));
        let output = run(ranks, &["open.yml", "-o", "open", "-q", "--", "-x_y", "1"], &folder).success();
        assert_eq!(output.stdout, "");
        assert_eq!(
            output.stderr.matches("warning: contact 'sole' never closed").count(),
            1,
            "{}",
            output.stderr
        );
        assert_eq!(output.stderr.matches("`-x_y 1` was not used").count(), 1, "{}", output.stderr);
        assert!(!output.stderr.contains("newton"), "{}", output.stderr);
    }
}

/// The achieved penetration is reported together with the requested one, with a warning if it is
/// larger.
#[test]
fn achieved_penetration_is_reported() {
    let folder = Folder::new("penetration");
    for (asked, kept) in [("\"1 mm\"", true), ("\"1 um\"", true), ("\"1 mm\" }, power", false)] {
        let normal = match kept {
            true => format!("penalty: {{ penetration: {asked} }}"),
            // Far too soft for the pressure: E / 10 would be reached by ten times less than what comes.
            false => "penalty: { penetration: \"1 mm\" }".to_owned(),
        };
        let mut case = with("penalty: { compliance: 1.0e-9 }", &normal);
        if !kept {
            case = case.replace("y: -0.01", "y: -0.1");
        }
        folder.write("case.yml", &case);
        let output = run(0, &["case.yml", "-o", "out"], &folder).success();
        assert!(output.stdout.contains("sole: deepest penetration"), "{}", output.stdout);
        assert!(output.stdout.contains(", requested 1.000e-"), "{}", output.stdout);
        let warned = output.stderr.contains("warning: contact 'sole' penetrated by");
        assert_eq!(warned, !kept, "{asked}: {}{}", output.stdout, output.stderr);
    }
}

/// A contact that can hardly close causes a remark at the start and at the end, and the run
/// continues.
#[test]
fn a_contact_that_never_closes_is_remarked() {
    let folder = Folder::new("far");
    folder.write("case.yml", &with("point: [0, 0]", "point: [0, -0.5]"));
    let output = run(2, &["case.yml"], &folder).success();
    assert_says(&output.stdout, &["contact 'sole' starts with a gap of 5.000e-1 m", "can close"]);
    assert_eq!(output.stderr.matches("'sole' never closed").count(), 1, "{}", output.stderr);
}

/// A contactor on the wrong side of its body causes a remark.
#[test]
fn a_contactor_that_looks_away_is_remarked() {
    let folder = Folder::new("away");
    for (side, away) in [("top", true), ("left", true), ("bottom", false)] {
        let case = with("contactor: block.bottom", &format!("contactor: block.{side}"));
        folder.write("case.yml", &case.replace("on: block.top", "on: block.right"));
        let output = run(2, &["check", "case.yml"], &folder).success();
        assert_eq!(
            output.stdout.contains("contact 'sole': all facets of its contactor face away"),
            away,
            "{side}: {}",
            output.stdout
        );
    }
}

/// A wrong unit is reported by its effect on the wave speed and on the contact.
#[test]
fn units_that_slipped_are_remarked() {
    let folder = Folder::new("units");
    for (name, modulus) in [("right.yml", "5 MPa"), ("slipped.yml", "5 mPa")] {
        folder.write(name, &with("young_modulus: 5.0e6", &format!("young_modulus: {modulus}")));
        let text = run(0, &["check", name], &folder).success().stdout;
        for words in ["pressure waves in 'block'", "contact 'sole' is"] {
            assert_eq!(text.contains(words), name == "slipped.yml", "{words}: {text}");
        }
    }
}

/// Multipliers on both sides of self-contact cause a remark, those of two surfaces do not.
#[test]
fn multipliers_of_a_surface_that_meets_itself_are_remarked() {
    let folder = Folder::new("multipliers");
    let enforced =
        "accuracy: { penetration: { relative: 1e-4 }, time: none, slip: none, energy: none }\noutput:\n";
    let damped = "scheme: { generalized_alpha: { spectral_radius: 0.8 } }";
    for (contact, told) in [("all", true), ("{ a: { contactor: left.bottom, target: low.top } }", false)] {
        let changes = [
            ("contact: all", &format!("contact: {contact}")[..]),
            ("scheme: conserving", damped),
            ("output:\n", enforced),
        ];
        folder.write("case.yml", &shipped("pile/case.yml", &changes));
        let text = run(0, &["check", "case.yml"], &folder).success().stdout;
        assert_eq!(text.contains("both sides have multipliers"), told, "{contact}: {text}");
    }
}

/// If an error in time is requested of the conserving scheme, bodies whose contact nodes have mass
/// cause a remark. No other bodies do.
#[test]
fn contact_nodes_that_swing_are_remarked() {
    let folder = Folder::new("swing");
    let mass = ("    initial_velocity: [3.0, 0]", "    mass: redistributed\n    initial_velocity: [3.0, 0]");
    for (changes, names) in [
        (&[][..], None),
        (&[("output:\n", "accuracy: { time: none }\noutput:\n")][..], None),
        (&[("output:\n", "accuracy: fast\noutput:\n")][..], Some("in 'left', 'right'")),
        (&[("output:\n", "accuracy: fast\noutput:\n"), mass][..], Some("in 'right'")),
    ] {
        folder.write("case.yml", &shipped("collision/case.yml", changes));
        let text = run(0, &["check", "case.yml"], &folder).success().stdout;
        assert_eq!(text.contains("oscillate on the penalty"), names.is_some(), "{text}");
        assert!(
            names.is_none_or(|names| text.contains(&format!("`mass: redistributed` {names} avoids this"))),
            "{text}"
        );
    }
}

/// Two supports that prescribe the same motion of a node are compatible. Each reaction is counted
/// once.
#[test]
fn equal_supports_share_a_corner_on_2_ranks() {
    let folder = Folder::new("corner");
    let side = "  side: { on: block.right, displacement: { x: \"1.0 * t\" } }\nstart:";
    folder.write("case.yml", &with("start:", side));
    run(2, &["case.yml", "-o", "out"], &folder).success();
    assert_eq!(Table::read(&folder.join("out/reactions.csv")).len(), 10);
}

/// An earlier result is replaced only if this program wrote it.
#[test]
fn results_are_replaced_when_they_are_ours() {
    let folder = Folder::new("replace");
    folder.write("case.yml", SMALL_BLOCK);
    for _ in 0..2 {
        run(0, &["case.yml", "-o", "out"], &folder).success();
    }
    fs::write(folder.join("out/run.json"), "{ \"program\": \"another\" }").unwrap();
    let refused = run(2, &["case.yml", "-o", "out"], &folder);
    assert_eq!(refused.code, Some(4), "{}", refused.stderr);
    assert!(refused.stderr.contains("nothing was changed"), "{}", refused.stderr);
    assert_eq!(fs::read_to_string(folder.join("out/run.json")).unwrap(), "{ \"program\": \"another\" }");
}

/// One rank computes the same without `mpirun` as with it. Then it starts no helper process and has no
/// session folder of Open MPI, which runs at the same time would share.
#[test]
fn one_rank_needs_no_launcher() {
    let folder = Folder::new("alone");
    folder.write("case.yml", SMALL_BLOCK);
    run(1, &["case.yml", "-o", "alone"], &folder).success();
    let launched = "mpirun -n 1 contact-petsc case.yml -o launched";
    Running::script(1, launched, &folder).wait(Duration::from_secs(300)).success();
    for name in ["energy.csv", "contact.csv", "probes.csv", "iterations.csv"] {
        let read = |results: &str| fs::read_to_string(folder.join(results).join(name)).unwrap();
        assert!(read("alone") == read("launched"), "{name}");
    }

    folder.write("long.yml", &with("end: 0.002", "end: 0.3"));
    let long = "mkdir temporary; TMPDIR=$PWD/temporary exec contact-petsc long.yml -o out";
    let running = Running::script(1, long, &folder);
    wait_for_steps(&folder.join("out"));
    assert_eq!(fs::read_dir(folder.join("temporary")).unwrap().count(), 0);
    let children = format!("/proc/{0}/task/{0}/children", running.id());
    assert_eq!(fs::read_to_string(children).unwrap(), "");
    running.signal("KILL");
    running.wait(Duration::from_secs(10));
}

/// Waits until results have ten steps.
fn wait_for_steps(results: &Path) {
    let energy = results.join("energy.csv");
    let deadline = Instant::now() + Duration::from_secs(300);
    while fs::read_to_string(&energy).unwrap_or_default().lines().count() < 12 {
        assert!(Instant::now() < deadline, "no steps within five minutes");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// A killed run leaves tables of complete rows and a record with the state `running`. The figures
/// can be drawn.
#[test]
fn a_killed_run_leaves_whole_rows() {
    let folder = Folder::new("killed");
    folder.write("case.yml", &with("end: 0.002", "end: 0.3"));
    let killed = Running::start(0, &["case.yml", "-o", "out"], &folder);
    wait_for_steps(&folder.join("out"));
    killed.signal("KILL");
    assert_eq!(killed.wait(Duration::from_secs(10)).code, None);
    for name in ["energy.csv", "contact.csv", "probes.csv", "reactions.csv", "iterations.csv"] {
        let text = fs::read_to_string(folder.join("out").join(name)).unwrap();
        assert!(text.ends_with('\n') && Table::read(&folder.join("out").join(name)).len() >= 10, "{name}");
    }
    let record = fs::read_to_string(folder.join("out/run.json")).unwrap();
    assert!(record.contains("\"verdict\": \"running\""), "{record}");
    let figures = run(0, &["plot", "out"], &folder).success();
    assert!(figures.stdout.contains(".svg"), "{}", figures.stdout);
    run(0, &["case.yml", "-o", "out", "-q", "--", "-ksp_type", "nonsense"], &folder);
}

/// A table that can no longer be written ends all ranks, as on a full disk.
#[test]
fn a_full_disk_ends_all_ranks_on_2_ranks() {
    let folder = Folder::new("full");
    folder.write("case.yml", &with("end: 0.002", "end: 10"));
    // A limit of file sizes (in KiB) stands for the full disk: it needs no privileges.
    let script = format!("ulimit -f 24; exec {PROGRAM} case.yml -o out");
    // Shared memory between the ranks would be files, too.
    let mut command = Command::new("timeout");
    command.args(["-k", "5", "300", "mpirun", "-n", "2", "bash", "-c", &script]).current_dir(&*folder);
    let output = command
        .envs(ENVIRONMENT)
        .envs([("OMPI_MCA_btl", "self,tcp"), ("OMPI_MCA_btl_tcp_if_include", "lo")])
        .output()
        .expect("mpirun starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(4), "{stderr}");
    assert_eq!(stderr.matches("contact-petsc: error").count(), 1, "{stderr}");
    assert!(stderr.contains("can not write") && stderr.contains("ulimit -f"), "{stderr}");
    // No part of a row is left.
    for name in ["energy.csv", "iterations.csv", "probes.csv"] {
        assert!(fs::read_to_string(folder.join("out").join(name)).unwrap().ends_with('\n'), "{name}");
    }
}

/// An inverted element that cutback cannot avoid ends the run with code 6, and with the element,
/// its location and the time.
#[test]
fn an_inverted_element_ends_with_its_place_on_2_ranks() {
    let folder = Folder::new("inverted");
    let text = SMALL_BLOCK
        .replace("neo_hookean", "saint_venant_kirchhoff")
        .replace("y: -0.01", "y: \"-0.01 - 150 * t\"")
        .replace("5.0e-4 }", "5.0e-4, cuts: 2 }");
    folder.write("case.yml", &text);
    let output = run(2, &["case.yml", "-o", "out"], &folder);
    assert_eq!(output.code, Some(6), "{}{}", output.stdout, output.stderr);
    assert_eq!(output.stderr.matches("contact-petsc: error").count(), 1, "{}", output.stderr);
    for words in ["element 1", "at [0.0", "t = ", "det F"] {
        assert!(output.stderr.contains(words), "{words}: {}", output.stderr);
    }
    let record = fs::read_to_string(folder.join("out/run.json")).unwrap();
    assert!(record.contains("\"verdict\": \"failed\"") && record.contains("\"exit_code\": 6"), "{record}");
}

/// A solve that does not converge ends with code 5, the residuals, the threshold and the place that
/// is farthest from balance, the same on 1, 3 and 20 ranks, of which some own nothing. The rows
/// before it are kept.
#[test]
fn no_convergence_ends_with_the_figures_on_1_3_20_ranks() {
    let folder = Folder::new("slow");
    let text = SMALL_BLOCK
        .replace("start: { equilibrium: { friction: false, increments: 2 } }", "start: { rest: {} }")
        .replace("y: -0.01", "y: \"-10 * t\"")
        .replace(
            "5.0e-4 }",
            "5.0e-4, cuts: 1 }\nsolver: { newton: { max_iterations: 1, tolerance: 1.0e-12 } }",
        );
    folder.write("case.yml", &text);
    let places = [1, 3, 20].map(|ranks| {
        let output = run(ranks, &["case.yml", "-o", "out", "--anew"], &folder);
        assert_eq!(output.code, Some(5), "{}{}", output.stdout, output.stderr);
        assert_eq!(output.stderr.matches("contact-petsc: error").count(), 1, "{}", output.stderr);
        for words in ["residual", "> 1.0e-12", "after 1 iteration", "t = "] {
            assert!(output.stderr.contains(words), "{words}: {}", output.stderr);
        }
        assert!(!Table::read(&folder.join("out/energy.csv")).is_empty());
        let place = output.stderr.lines().find_map(|line| line.split_once("N, is at "));
        place.unwrap_or_else(|| panic!("no place: {}", output.stderr)).1.to_owned()
    });
    assert!(places[0].contains("m of 'block', on a surface of contact 'sole'"), "{}", places[0]);
    assert!(places.iter().all(|place| *place == places[0]), "{places:?}");
}

/// A block with a slanted side passes in one step through a disc, over a disc that is smaller than the
/// distance of its points, and over a pin of another body that is narrower than its facets. The error
/// names the contact, the position and the body.
#[test]
fn missed_contact_names_its_place_on_1_3_20_ranks() {
    let folder = Folder::new("missed");
    let disc = |centre: &str, radius: &str| {
        format!("obstacles:\n  it: {{ sphere: {{ center: {centre}, radius: {radius} }} }}\n")
    };
    let pin = "  it:\n    mesh: { box: { min: [0.12, -0.4], max: [0.14, -0.05], cells: [2, 6] } }\n    \
               material: { neo_hookean: { young_modulus: 1.0e8, poisson_ratio: 0.3 } }\n    density: 1000\n\
               boundary: { foot: { on: it.bottom, displacement: { x: 0, y: 0 } } }\n";
    let through =
        "contact 'hit': missed contact: a surface would pass through the target within one step at ";
    for (other, target, words, place) in [
        (disc("[0.33, -0.25]", "0.2"), "it", through, "[0.178868, -0.0178868] m of 'block'"),
        (
            disc("[0.13, -0.15]", "1.0e-3"),
            "it",
            "of 1 facets (size about 1.005e-1 m), one of them at ",
            "[0.15, -0.015] m of 'block'",
        ),
        (pin.to_owned(), "it.top", through, "[0.12, -0.05] m of 'it'"),
    ] {
        folder.write(
            "case.yml",
            &format!(
                "dimension: 2\nbodies:\n  block:\n    mesh: {{ box: {{ min: [0, 0], max: [0.4, 0.4], cells: [4, 4], map: {{ y: \"y - 0.1 * x\" }} }} }}\n    \
                 material: {{ neo_hookean: {{ young_modulus: 5.0e6, poisson_ratio: 0.3 }} }}\n    density: 1700\n    \
                 initial_velocity: [0, -300]\n{other}contact:\n  \
                 hit: {{ contactor: block.bottom, target: {target}, friction: none }}\n\
                 time: {{ end: 0.2, step: 2.0e-3, cuts: 1, scheme: backward_euler }}\n"
            ),
        );
        for ranks in [1, 3, 20] {
            let output = run(ranks, &["case.yml", "-o", "out", "-q", "--anew"], &folder);
            assert_eq!(output.code, Some(5), "{}{}", output.stdout, output.stderr);
            assert_says(&output.stderr, &[&format!("{words}{place}")]);
        }
    }
}

/// A static start that finds no equilibrium names the node with the largest unbalanced force, its body
/// and its contacts. So does a step of the staggered strategy whose stages do not agree.
#[test]
fn starts_and_sweeps_without_balance_name_a_node_on_1_3_20_ranks() {
    let folder = Folder::new("start-and-sweeps");
    let time = "time: { end: 0.002, step: 5.0e-4 }";
    let newton = format!("{time}\nsolver: {{ newton: {{ max_iterations: 1, tolerance: 1.0e-12 }} }}");
    let start = SMALL_BLOCK.replace("y: -0.01", "y: -0.1").replace("increments: 2", "increments: 1");
    let start = start.replace(time, &newton);
    let sweeps = "time: { end: 0.002, step: 5.0e-4, cuts: 1 }\n\
                  solver: { strategy: { staggered: { tolerance: 1.0e-8, max_sweeps: 1 } } }";
    let sweeps = SMALL_BLOCK.replace(time, sweeps);
    for (text, words) in [
        (start, "static start at 100 % of the loads: residual "),
        (sweeps, "t = 0.000000e0 s, step cut to 2.500e-4 s: the staggered scheme reached its sweep limit"),
    ] {
        folder.write("case.yml", &text);
        let places = [1, 3, 20].map(|ranks| {
            let output = run(ranks, &["case.yml", "-o", "out", "--anew"], &folder);
            assert_eq!(output.code, Some(5), "{}{}", output.stdout, output.stderr);
            let error = output.stderr.lines().find(|line| line.contains("contact-petsc: error: "));
            let error = error.unwrap_or_else(|| panic!("no error: {}", output.stderr));
            assert_says(error, &[&format!("error: {words}"), "; the largest unbalanced force, "]);
            error.split_once(" N, is at ").expect("a place").1.to_owned()
        });
        assert!(places[0].contains(" m of 'block', on a surface of contact 'sole'"), "{}", places[0]);
        assert!(places.iter().all(|place| *place == places[0]), "{places:?}");
    }
}
