//! A run resumed from a checkpoint ends with the same bits on the same number of ranks, and to
//! 1e-10 on others.

use super::*;

/// Resumes from the first checkpoint and from the one in the middle of an uninterrupted run.
#[track_caller]
fn goes_on_to_the_last_bit(text: &str, ranks: usize) {
    let folder = place(text);
    compute(&folder, ranks, "whole", &[]).success();
    let all = checkpoints(&folder.join("whole"));
    assert!(all.len() > 2, "{all:?}");
    for from in [&all[0], &all[all.len() / 2]] {
        let _ = fs::remove_dir_all(folder.join("part"));
        copy(&folder.join("whole"), &folder.join("part"));
        let name = from.file_name().and_then(|name| name.to_str()).expect("a name");
        compute(&folder, ranks, "part", &[&format!("--restart=checkpoints/{name}")]).success();
        same_bits(&folder.join("whole"), &folder.join("part"));
        let [whole, part] = ["whole", "part"].map(|results| record(&folder.join(results)));
        assert_eq!((&whole["restarts"], &part["restarts"]), (&0.into(), &1.into()));
        for key in ["steps", "newton_iterations", "krylov_iterations", "penetration", "start"] {
            assert_eq!(whole[key], part[key], "{key}");
        }
    }
}

/// A rigid target and velocity-regularised friction.
#[test]
fn rubber_block_to_the_last_bit_on_1_and_2_ranks() {
    goes_on_to_the_last_bit(&rubber_block(GMRES, "end: 0.015", 8), 1);
    goes_on_to_the_last_bit(&rubber_block(GMRES, "end: 0.015", 8), 2);
}

/// Mortar segments: only the state of the vertices must be saved.
#[test]
fn segments_to_the_last_bit_on_1_2_and_3_ranks() {
    goes_on_to_the_last_bit(&ironing("{ linear: auto }"), 1);
    goes_on_to_the_last_bit(&ironing(GMRES), 2);
    goes_on_to_the_last_bit(&ironing(GMRES), 3);
}

/// Forces at the start of a step, midpoint rule and stages.
#[test]
fn other_schemes_to_the_last_bit_on_1_and_2_ranks() {
    goes_on_to_the_last_bit(&concrete_block(GMRES), 2);
    let flight = shipped("collision/case.yml", &[("end: 0.012", "end: 0.003")], GMRES, 20);
    goes_on_to_the_last_bit(&flight, 1);
    let small = [("cells: [16, 4]", "cells: [8, 2]"), ("end: 0.25", "end: 0.03")];
    let staggered = "{ strategy: staggered, linear: cg_icc }";
    goes_on_to_the_last_bit(&shipped("sliding-block/return-map.yml", &small, staggered, 10), 1);
}

/// Error-controlled steps, increased penalties, and the conserving scheme resume with their state.
#[test]
fn accuracies_and_the_conserving_scheme_to_the_last_bit_on_1_and_2_ranks() {
    let tolerances = "accuracy: { time: 2.0e-3, penetration: 2.0e-5, slip: 1.0e-2, energy: none }\ntime:";
    let small = [("cells: [48, 50]", "cells: [8, 8]"), ("end: 0.07", "end: 0.01"), ("time:", tolerances)];
    let accurate = shipped("rubber-block/case.yml", &small, GMRES, 7);
    goes_on_to_the_last_bit(&accurate, 1);
    goes_on_to_the_last_bit(&accurate, 2);
    // Contact has become stiffer before the second checkpoint.
    let deep = "accuracy: { time: none, penetration: { relative: 1.0e-2 }, slip: none, energy: none }\ntime:";
    let dragged = [("cells: [48, 50]", "cells: [24, 25]"), ("end: 0.07", "end: 0.04"), ("time:", deep)];
    goes_on_to_the_last_bit(&shipped("rubber-block/case.yml", &dragged, GMRES, 30), 1);
    let friction = shipped("collision/friction.yml", &[("end: 0.012", "end: 0.004")], GMRES, 25);
    goes_on_to_the_last_bit(&friction, 1);
    goes_on_to_the_last_bit(&friction, 2);
}

/// Statics of bodies that contact and a spring in the matrix hold. The spring is restored.
#[test]
fn loose_bodies_to_the_last_bit_on_1_and_2_ranks() {
    let text = shipped("patch/plane.yml", &[("increments: 2", "increments: 6")], "{ linear: auto }", 2);
    goes_on_to_the_last_bit(&text, 1);
    goes_on_to_the_last_bit(&text.replace("linear: auto", "linear: gmres_asm_ilu"), 2);
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
    let text = rubber_block("{ linear: direct }", "end: 0.008", 4).replace("solver:", petsc);
    goes_on_to_the_last_bit(&text, 3);
    let folder = place(&text);
    for name in ["one", "other"] {
        compute(&folder, 3, name, &[]).success();
    }
    same_bits(&folder.join("one"), &folder.join("other"));
}

/// Three dimensions.
#[test]
fn rubber_cube_to_the_last_bit_on_1_and_2_ranks() {
    goes_on_to_the_last_bit(&rubber_cube("{ linear: auto }"), 1);
    goes_on_to_the_last_bit(&rubber_cube(GMRES), 2);
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
            let pieces = fs::read_dir(last).expect("the last fields");
            assert_eq!(pieces.count(), 2 * (ranks + 1));
        }
    }
}
