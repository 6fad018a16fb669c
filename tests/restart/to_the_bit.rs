//! A run computes the same bits whatever checkpoints it writes, and so does a run resumed from any
//! of them on the same number of ranks. On other numbers of ranks results agree to 1e-10.

use super::*;

/// The case with checkpoints at another cadence, or without any.
pub fn with_cadence(text: &str, every: Option<u32>) -> String {
    let lines = text.lines().filter_map(|line| match (line.contains("checkpoint: {"), every) {
        (false, _) => Some(format!("{line}\n")),
        (true, Some(every)) => Some(format!("  checkpoint: {{ every: {every}, keep: 1000 }}\n")),
        (true, None) => None,
    });
    lines.collect()
}

/// Compares a run without checkpoints with runs that write them in every and in every third step,
/// and with runs resumed after each of the `steps`.
#[track_caller]
fn computes_the_same_bits(text: &str, ranks: usize, steps: &[u32]) {
    let folder = place(&with_cadence(text, None));
    compute(&folder, ranks, "never", &[]).success();
    assert!(checkpoints(&folder.join("never")).is_empty());
    for (name, every) in [("third", 3), ("always", 1)] {
        folder.write("case.yml", &with_cadence(text, Some(every)));
        compute(&folder, ranks, name, &[]).success();
        same_bits(&folder.join("never"), &folder.join(name));
    }
    let all = checkpoints(&folder.join("always"));
    for step in steps {
        let _ = fs::remove_dir_all(folder.join("part"));
        copy(&folder.join("always"), &folder.join("part"));
        let from = format!("checkpoints/step-{step:06}.ckpt");
        assert!(all.iter().rev().skip(1).any(|path| path.ends_with(&from)), "{from} of {}", all.len());
        compute(&folder, ranks, "part", &[&format!("--restart={from}")]).success();
        same_bits(&folder.join("never"), &folder.join("part"));
        let [whole, part] = ["never", "part"].map(|results| record(&folder.join(results)));
        assert_eq!((&whole["restarts"], &part["restarts"]), (&0.into(), &1.into()));
        for key in ["steps", "cut_steps", "newton_iterations", "krylov_iterations", "penetration"] {
            assert_eq!(whole[key], part[key], "{key} after step {step}");
        }
        assert_eq!(record(&folder.join("always"))["start"], part["start"]);
        let last = all.last().expect("a checkpoint");
        let (numbers, rows) = state(last);
        let (own, own_rows) = state(&folder.join("part/checkpoints").join(last.file_name().expect("a name")));
        assert!(rows == own_rows && numbers == own, "after step {step}: {numbers:#} is {own:#}");
    }
}

/// A rigid target and velocity-regularised friction.
#[test]
fn rubber_block_to_the_last_bit_on_1_and_2_ranks() {
    computes_the_same_bits(&rubber_block(GMRES, "end: 0.006", 1), 1, &[1, 7]);
    computes_the_same_bits(&rubber_block(GMRES, "end: 0.006", 1), 2, &[4]);
}

/// Mortar segments: facets are gathered again and the pattern of the matrix grows. Preconditioners
/// and their matrices are made again.
#[test]
fn segments_to_the_last_bit_on_1_2_and_3_ranks() {
    computes_the_same_bits(&ironing("{ linear: auto }"), 1, &[13]);
    for linear in ["filtered_amg", "filtered_ilu"] {
        computes_the_same_bits(&ironing(&format!("{{ linear: {linear} }}")), 1, &[2, 14, 33]);
    }
    computes_the_same_bits(&ironing(GMRES), 2, &[21]);
    computes_the_same_bits(&ironing(GMRES), 3, &[30]);
}

/// A nearly incompressible pad under a rigid disc: matrices and preconditioners are made again with
/// the pressure linearised at the iterate before theirs.
#[test]
fn linearised_pressures_to_the_last_bit_on_1_and_2_ranks() {
    let pad = |solver, ratio| {
        format!(
            "dimension: 2
bodies:
  pad:
    mesh: {{ box: {{ min: [-0.1, 0], max: [0.1, 0.06], cells: [14, 6], element: quad4 }} }}
    material: {{ neo_hookean: {{ young_modulus: 5.0e+6, poisson_ratio: {ratio} }} }}
rigid:
  tool:
    shape: {{ sphere: {{ center: [0, 0.1001], radius: 0.04 }} }}
    motion: {{ translation: {{ x: '0.01 * t', y: '-0.008 * t' }} }}
contact:
  press:
    contactor: pad.top
    target: tool
    normal: {{ penalty: {{ compliance: 2.0e-10 }} }}
    friction: {{ coulomb: {{ coefficient: 0.3, regularization: {{ stick_stiffness: 5.0e+9 }} }} }}
boundary: {{ clamp: {{ on: pad.bottom, displacement: {{ x: 0, y: 0 }} }} }}
time: {{ end: 1, scheme: {{ static: {{ increments: 9 }} }} }}
solver: {solver}
output:
  checkpoint: {{ every: 1, keep: 1000 }}
"
        )
    };
    for solver in ["{ linear: filtered_amg }", "{ linear: { two_stage: { inner: cg_icc } } }"] {
        computes_the_same_bits(&pad(solver, 0.49), 1, &[3, 6]);
    }
    // Incomplete factors still converge at this ratio.
    computes_the_same_bits(&pad(GMRES, 0.45), 2, &[5]);
}

/// Statics with multipliers of pressure and friction, which stick keeps from step to step.
#[test]
fn multipliers_to_the_last_bit_on_1_and_2_ranks() {
    let accuracy = "accuracy: { slip: 1e-6, penetration: { relative: 1e-4 }, time: none }";
    let text = |solver| format!("{}{accuracy}\n", ironing(solver));
    computes_the_same_bits(&text("{ linear: auto }"), 1, &[2, 20]);
    computes_the_same_bits(&text(GMRES), 2, &[14]);
}

/// The pieces of the filtered multigrid on two ranks, all of which are made again. A sum over two
/// ranks has only one order; on more ranks the multigrid rounds differently in each run. With two
/// pairs of bodies each rank has a contact of its own.
#[test]
fn pieces_to_the_last_bit_on_2_ranks() {
    let pieces = "petsc: { filter_pc_type: asm }";
    for linear in ["filtered_amg", "filtered_ilu"] {
        let solver = format!("{{ linear: {linear} }}");
        computes_the_same_bits(&format!("{}{pieces}\n", ironing(&solver)), 2, &[14]);
    }
    let pairs = two_pairs().replace("output:\n", "output:\n  checkpoint: { every: 2, keep: 1000 }\n");
    let pairs = format!("{pairs}\nsolver: {{ linear: filtered_amg }}\n{pieces}\n");
    computes_the_same_bits(&pairs, 2, &[2]);
}

/// Factors that are made again while the tangent is kept, and patterns that change in an impact: the
/// incomplete factors and the nodes in contact belong to another iterate than the tangent.
#[test]
fn kept_tangents_with_new_factors_to_the_last_bit() {
    let stiff = ("compliance: 1.0e-10", "compliance: 1.0e-11");
    let short = ("end: 0.012, step: 5.0e-5, scheme: conserving", SCHEME);
    const SCHEME: &str = "end: 0.0025, step: 5.0e-5, scheme: { generalized_alpha: { spectral_radius: 0.8 } }";
    let text = |solver| shipped("collision/friction.yml", &[stiff, short], solver, 1);
    let accuracy = "accuracy: { time: 1.0e-2, penetration: none, slip: none, energy: none }";
    let kept = format!("{}{accuracy}\n", text("{ linear: filtered_ilu }"));
    computes_the_same_bits(&kept, 1, &[17, 28, 41]);
    let new = format!("{}{accuracy}\n", text("{ linear: filtered_ilu, newton: { inexact: false } }"));
    computes_the_same_bits(&new, 1, &[100]);
}

/// Preconditioners of PETSc, and the two-stage scheme with its own matrices.
#[test]
fn other_preconditioners_to_the_last_bit() {
    computes_the_same_bits(&ironing("{ linear: gmres_amg }"), 1, &[14]);
    computes_the_same_bits(&accurate_block("{ linear: gmres_amg }"), 1, &[2, 8]);
    computes_the_same_bits(&ironing("{ linear: two_stage }"), 1, &[14]);
}

/// Multipliers in statics, with a stick stiffness that follows the requested slip.
#[test]
fn multipliers_to_the_last_bit() {
    let tolerances =
        "accuracy: { time: none, penetration: { relative: 1.0e-3 }, slip: 1.0e-2, energy: none }\ntime:";
    computes_the_same_bits(&ironing(GMRES).replace("time:", tolerances), 1, &[2, 20]);
}

/// Forces at the start of a step, midpoint rule and stages.
#[test]
fn other_schemes_to_the_last_bit_on_1_and_2_ranks() {
    computes_the_same_bits(&concrete_block(GMRES), 2, &[17]);
    let flight = shipped("collision/case.yml", &[("end: 0.012", "end: 0.0012")], GMRES, 1);
    computes_the_same_bits(&flight, 1, &[9]);
    let small = [("cells: [16, 4]", "cells: [8, 2]"), ("end: 0.25", "end: 0.02")];
    let staggered = "{ strategy: staggered, linear: cg_icc }";
    computes_the_same_bits(&shipped("sliding-block/return-map.yml", &small, staggered, 1), 1, &[3, 12]);
}

/// The block with error-controlled steps, and requested penetration and slip.
pub fn accurate_block(solver: &str) -> String {
    let tolerances = "accuracy: { time: 2.0e-3, penetration: 2.0e-5, slip: 1.0e-2, energy: none }\ntime:";
    let small = [("cells: [48, 50]", "cells: [8, 8]"), ("end: 0.07", "end: 0.01"), ("time:", tolerances)];
    shipped("rubber-block/case.yml", &small, solver, 1)
}

/// Error-controlled steps: the error estimate, the smoothed rates and the kept tangents continue,
/// in flight and over landings and repeated steps.
#[test]
fn accuracies_to_the_last_bit_on_1_and_2_ranks() {
    computes_the_same_bits(&accurate_block(GMRES), 1, &[1, 3, 6, 9, 14, 19]);
    computes_the_same_bits(&accurate_block(GMRES), 2, &[5, 12]);
    computes_the_same_bits(&accurate_block("{ linear: filtered_amg }"), 1, &[4, 11]);
    let bar =
        [("cells: [1, 100]", "cells: [1, 20]"), ("end: 1.5", "end: 0.6"), ("time:", "accuracy: fast\ntime:")];
    computes_the_same_bits(&shipped("bar-impact/case.yml", &bar, "{}", 1), 1, &[3, 40, 70]);
}

/// A penalty that is increased during the run, and the conserving scheme with friction between two
/// bodies.
#[test]
fn increased_penalties_and_the_conserving_scheme_to_the_last_bit_on_1_and_2_ranks() {
    let deep = "accuracy: { time: none, penetration: { relative: 3.0e-3 }, slip: none, energy: none }\ntime:";
    let dragged = [("cells: [48, 50]", "cells: [12, 13]"), ("end: 0.07", "end: 0.016"), ("time:", deep)];
    // The penalty is increased at the end of step 28.
    computes_the_same_bits(&shipped("rubber-block/case.yml", &dragged, GMRES, 1), 1, &[27, 28]);
    let friction = shipped("collision/friction.yml", &[("end: 0.012", "end: 0.0016")], GMRES, 1);
    computes_the_same_bits(&friction, 1, &[10, 25]);
    computes_the_same_bits(&friction, 2, &[25]);
}

/// Statics of bodies that contact and a spring in the matrix hold. The spring is restored.
#[test]
fn loose_bodies_to_the_last_bit_on_1_and_2_ranks() {
    let text = shipped("patch/plane.yml", &[("increments: 2", "increments: 6")], "{ linear: auto }", 1);
    computes_the_same_bits(&text, 1, &[2]);
    computes_the_same_bits(&text.replace("linear: auto", "linear: gmres_asm_ilu"), 2, &[3]);
}

/// Two runs from the start agree to the bit on any number of ranks. The static start is factorised
/// on one of them.
#[test]
fn whole_runs_to_the_last_bit_on_3_and_4_ranks() {
    for (ranks, text) in [(3, concrete_block(GMRES)), (4, rubber_block(GMRES, "end: 0.005", 4))] {
        let folder = place(&text);
        for name in ["one", "other", "third"] {
            compute(&folder, ranks, name, &[]).success();
            same_bits(&folder.join("one"), &folder.join(name));
        }
    }
}

/// Factorisations on one rank of several: complete runs agree to the bit, and so do resumed ones.
#[test]
fn factors_on_one_rank_to_the_last_bit_on_3_ranks() {
    let petsc = "petsc: { pc_type: telescope, pc_telescope_reduction_factor: 3, telescope_pc_type: lu, \
                 telescope_pc_factor_mat_solver_type: mumps }\nsolver:";
    let text = rubber_block("{ linear: direct }", "end: 0.006", 1).replace("solver:", petsc);
    computes_the_same_bits(&text, 3, &[5]);
}

/// Three dimensions.
#[test]
fn rubber_cube_to_the_last_bit_on_1_and_2_ranks() {
    computes_the_same_bits(&rubber_cube("{ linear: auto }"), 1, &[3]);
    computes_the_same_bits(&rubber_cube(GMRES), 2, &[5]);
}

/// A checkpoint of one number of ranks is valid for any other, also if some ranks own nothing.
#[test]
fn other_ranks_agree() {
    for text in [rubber_block(TIGHT, "end: 0.01", 8), ironing(TIGHT), rubber_cube(TIGHT)] {
        let folder = place(&text);
        compute(&folder, 2, "whole", &[]).success();
        let first = checkpoints(&folder.join("whole"))[0].display().to_string();
        for ranks in [1, 3, 7] {
            let name = format!("on-{ranks}");
            copy(&folder.join("whole"), &folder.join(&name));
            compute(&folder, ranks, &name, &[&format!("--restart={first}")]).success();
            let apart = apart(&folder.join("whole"), &folder.join(&name));
            println!("2 -> {ranks} ranks: {apart:.1e}");
            assert!(apart <= AGREEMENT, "2 -> {ranks} ranks: {apart:.1e}");
            // No piece of the two ranks is left beside those of the new ones.
            let fields = fs::read_dir(folder.join(&name).join("fields")).into_iter().flatten().flatten();
            let last = fields.map(|entry| entry.path()).max().expect("fields");
            let pieces = fs::read_dir(last).expect("the last fields").flatten();
            // Rank 0 alone writes those of rigid bodies.
            let pieces = pieces.filter(|entry| !entry.file_name().to_string_lossy().starts_with("rigid"));
            assert_eq!(pieces.count(), 2 * (ranks + 1));
        }
    }
}

/// A rigid disc that is pressed in, dragged and lifted, with kept matrices, in statics and in the
/// conserving scheme.
#[test]
fn a_moving_rigid_body_to_the_last_bit_on_1_and_2_ranks() {
    let text = |scheme: &str| {
        let small = [
            ("cells: [64, 24]", "cells: [16, 6]"),
            ("poisson_ratio: 0.4 } }", "poisson_ratio: 0.4 } }\n    density: 1000"),
        ];
        let changes = [("{ end: 1, scheme: { static: { increments: 100 } } }", scheme)];
        let all: Vec<_> = small.into_iter().chain(changes).collect();
        let case = shipped("indenter/case.yml", &all, GMRES, 1);
        case.replace("[[0, 0], [0.3, -0.02]", "[[0, -0.002], [0.3, -0.02]")
            .replace("[[0, 0], [0.3, 0]", "[[0, 0.001], [0.1, 0], [0.3, 0.02]")
    };
    let statics = text("{ end: 0.5, step: 0.05, scheme: static }");
    computes_the_same_bits(&statics, 1, &[1, 6]);
    computes_the_same_bits(&statics, 2, &[5]);
    computes_the_same_bits(&text("{ end: 0.01, step: 1.0e-3, scheme: conserving }"), 1, &[4]);
}

/// Viscous branches, and the stress of matrices that are kept.
#[test]
fn viscous_branches_to_the_last_bit_on_1_and_2_ranks() {
    let relaxing = |solver: &str| {
        let series = "viscoelasticity: { prony: [{ share: 0.3, time: 1e-3 }, { share: 0.2, time: 2e-2 }] }";
        let text = rubber_block(solver, "end: 0.006", 1);
        text.replace("    density:", &format!("    {series}\n    density:"))
    };
    assert!(relaxing(GMRES).contains("prony"));
    computes_the_same_bits(&relaxing(GMRES), 1, &[1, 7]);
    computes_the_same_bits(&relaxing(GMRES), 2, &[4]);
    computes_the_same_bits(&relaxing("{ linear: filtered_amg }"), 1, &[3]);
}
