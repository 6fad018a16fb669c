//! Linear solvers on both matrix formats, in the combinations that the presets use.

use crate::lattice::{Lattice, Local};
use contact_petsc::dynamics::BodyNodes;
use contact_petsc::petsc::{
    Format, InitialGuess, KrylovSolver, LinearOutcome, Matrix, Operator, Reason, Reuse, Session, Symmetry,
    Vector, residual_norm,
};
use contact_petsc::solvers::CoarseSpace;
use std::cell::Cell;
use std::rc::Rc;

type Options = &'static [(&'static str, &'static str)];

const GMRES: Options = &[("ksp_type", "gmres"), ("ksp_pc_side", "right"), ("ksp_gmres_restart", "100")];
const CG: Options = &[("ksp_type", "cg"), ("ksp_norm_type", "unpreconditioned")];
const DIRECT: Options = &[("ksp_type", "preonly")];

const MUMPS_LU: Options =
    &[("pc_type", "lu"), ("pc_factor_mat_solver_type", "mumps"), ("mat_mumps_icntl_14", "40")];
const MUMPS_CHOLESKY: Options = &[("pc_type", "cholesky"), ("pc_factor_mat_solver_type", "mumps")];
const ASM_ILU: Options = &[("pc_type", "asm"), ("pc_asm_overlap", "1"), ("sub_pc_type", "ilu")];
const ASM_ILU1: Options =
    &[("pc_type", "asm"), ("pc_asm_overlap", "1"), ("sub_pc_type", "ilu"), ("sub_pc_factor_levels", "1")];
const ASM_ICC: Options =
    &[("pc_type", "asm"), ("pc_asm_overlap", "1"), ("pc_asm_type", "basic"), ("sub_pc_type", "icc")];
// An incomplete LU of a symmetric matrix is symmetric, so CG may have it.
const ASM_BASIC_ILU: Options =
    &[("pc_type", "asm"), ("pc_asm_overlap", "1"), ("pc_asm_type", "basic"), ("sub_pc_type", "ilu")];
const ASM_MUMPS: Options = &[
    ("pc_type", "asm"),
    ("pc_asm_overlap", "1"),
    ("sub_pc_type", "lu"),
    ("sub_pc_factor_mat_solver_type", "mumps"),
];
const GAMG: Options = &[("pc_type", "gamg"), ("mg_levels_ksp_type", "chebyshev")];

const AIJ: &[Format] = &[Format::Aij];
const BOTH: &[Format] = &[Format::Aij, Format::Baij];

/// A preset: the skewness of its problem, its options, the formats for which PETSc supports it, the
/// largest number of iterations.
struct Preset {
    name: &'static str,
    skew: f64,
    method: Options,
    preconditioner: Options,
    formats: &'static [Format],
    most: usize,
}

const fn preset(
    name: &'static str,
    method: Options,
    preconditioner: Options,
    formats: &'static [Format],
    most: usize,
) -> Preset {
    Preset { name, skew: 0.05, method, preconditioner, formats, most }
}

const PRESETS: &[Preset] = &[
    preset("MUMPS LU", DIRECT, MUMPS_LU, BOTH, 1),
    preset("GMRES-ASM(1)/ILU(0)", GMRES, ASM_ILU, BOTH, 30),
    preset("GMRES-ASM(1)/ILU(1)", GMRES, ASM_ILU1, BOTH, 28),
    preset("GMRES-ASM(1)/MUMPS", GMRES, ASM_MUMPS, BOTH, 28),
    Preset { skew: 0.0, ..preset("MUMPS Cholesky", DIRECT, MUMPS_CHOLESKY, AIJ, 1) },
    Preset { skew: 0.0, ..preset("CG-ASM(1)/ICC(0)", CG, ASM_ICC, BOTH, 40) },
    Preset { skew: 0.0, ..preset("CG-ASM(1)/ILU(0)", CG, ASM_BASIC_ILU, BOTH, 40) },
    Preset { skew: 0.0, ..preset("CG-GAMG", CG, GAMG, AIJ, 20) },
];

pub fn run() {
    let session = Session::start(&[]).expect("MPI and PETSc start");
    for counts in [[12, 9, 1], [6, 6, 7]] {
        let lattice = Lattice { counts, dimension: if counts[2] == 1 { 2 } else { 3 }, skew: 0.0, cut: 0 };
        let local = Local::new(&session, lattice, &vec![1; session.size() as usize]);
        for preset in PRESETS {
            for &format in preset.formats {
                preset_solves(&session, &local.with_skew(preset.skew), format, preset);
            }
        }
        rigid_body_modes_help(&session, &local);
        unfit_formats_are_errors(&session, &local);
        failures_are_outcomes(&session, &local);
        preconditioner_is_kept_on_demand(&session, &local);
        closures_precondition(&session, &local);
    }
    for counts in [[40, 30, 1], [12, 12, 10]] {
        coarse_space_has_rigid_motions(&session, counts);
    }
    one_basis_serves_each_body(&session);
    ranks_without_rows(&session);
    if session.rank() == 0 {
        println!("solvers done");
    }
}

fn filled(session: &Rc<Session>, local: &Local, format: Format) -> Matrix {
    let mut matrix = Matrix::new(session, &local.pattern, format).unwrap();
    matrix.fill(|values| local.fill(values)).unwrap();
    matrix
}

fn configured(session: &Rc<Session>, matrix: &Matrix, options: &[(&str, &str)]) -> KrylovSolver {
    let mut krylov = KrylovSolver::new(session, "").unwrap();
    krylov.configure(options).unwrap();
    krylov.set_operators(matrix, matrix).unwrap();
    krylov.set_tolerances(1e-10, 1e-30, 300).unwrap();
    krylov
}

fn right_hand_side(session: &Rc<Session>, local: &Local) -> Vector {
    local.vector(session, |dof| (dof as f64 * 0.37).cos())
}

/// Solves and returns the outcome with the true relative residual.
fn solve(
    session: &Rc<Session>,
    local: &Local,
    krylov: &mut KrylovSolver,
    matrix: &Matrix,
) -> (LinearOutcome, f64) {
    let b = right_hand_side(session, local);
    let (mut x, mut work) = (b.like().unwrap(), b.like().unwrap());
    let outcome = krylov.solve(&b, &mut x).unwrap();
    (outcome, residual_norm(matrix, &b, &x, &mut work).unwrap() / b.norm().unwrap())
}

/// The preset converges, by the true residual, within its known number of iterations.
fn preset_solves(session: &Rc<Session>, local: &Local, format: Format, preset: &Preset) {
    let mut matrix = filled(session, local, format);
    if preset.skew == 0.0 {
        matrix.set_symmetry(Symmetry::PositiveDefinite).unwrap();
        matrix.set_near_null_space(&local.coordinates(session)).unwrap();
    }
    let options = [preset.method, preset.preconditioner].concat();
    let mut krylov = configured(session, &matrix, &options);
    // The second time with other values, so that the preconditioner is built anew.
    for _ in 0..2 {
        let (outcome, residual) = solve(session, local, &mut krylov, &matrix);
        if session.rank() == 0 {
            let (d, n) = (local.lattice.dimension, outcome.iterations);
            println!("{d}D {format:?} {}: {n} iterations, {}, {residual:.1e}", preset.name, outcome.reason);
        }
        assert!(outcome.converged() && residual < 2e-10, "{}", preset.name);
        assert!(outcome.iterations <= preset.most, "{}", preset.name);
        matrix.fill(|values| values.scale(7.0)).unwrap();
    }
}

/// Multigrid needs fewer iterations with the rigid-body modes than without them.
fn rigid_body_modes_help(session: &Rc<Session>, local: &Local) {
    let options = [CG, GAMG].concat();
    let mut matrix = filled(session, local, Format::Aij);
    let (plain, _) = solve(session, local, &mut configured(session, &matrix, &options), &matrix);
    matrix.set_near_null_space(&local.coordinates(session)).unwrap();
    let (with_modes, _) = solve(session, local, &mut configured(session, &matrix, &options), &matrix);
    if session.rank() == 0 {
        println!(
            "CG-GAMG: {} iterations with rigid-body modes, {} without",
            with_modes.iterations, plain.iterations
        );
    }
    assert!(with_modes.iterations < plain.iterations);
}

/// On an aggregate with nodes of one body, the rigid motions of the whole are all rigid motions of
/// that body. Two bodies therefore take at most a fifth more iterations than one of their size, and
/// half as many again if the basis lacks the rotations of one of them. With a threshold of zero,
/// pattern entries without springs do not join nodes of both bodies.
fn one_basis_serves_each_body(session: &Rc<Session>) {
    let options = [CG, GAMG, &[("pc_gamg_threshold", "0.0")]].concat();
    let iterations = |width: usize, cut: usize, turns: bool| {
        let lattice = Lattice { counts: [width, 5, 12], dimension: 3, skew: 0.0, cut };
        let local = Local::new(session, lattice, &vec![1; session.size() as usize]);
        let mut matrix = filled(session, &local, Format::Aij);
        matrix.set_symmetry(Symmetry::PositiveDefinite).unwrap();
        let places = local.vector(session, |dof| match turns || lattice.body(dof / 3) == 0 {
            true => lattice.point(dof / 3)[dof % 3],
            false => 0.0,
        });
        matrix.set_near_null_space(&places).unwrap();
        let mut krylov = configured(session, &matrix, &options);
        let (outcome, residual) = solve(session, &local, &mut krylov, &matrix);
        assert!(outcome.converged() && residual < 2e-10);
        outcome.iterations
    };
    let (alone, both, half) = (iterations(10, 0, true), iterations(10, 5, true), iterations(10, 5, false));
    if session.rank() == 0 {
        println!("CG-GAMG: {alone} iterations for one body, {both} for two, {half} where one has no turns");
    }
    assert!(both * 5 <= alone * 6 && half * 5 >= both * 7, "{alone}, {both}, {half}");
}

/// A solver that PETSc does not support for a format is an error with PETSc's message.
fn unfit_formats_are_errors(session: &Rc<Session>, local: &Local) {
    let matrix = filled(session, local, Format::Baij);
    for (preconditioner, words) in [(MUMPS_CHOLESKY, "SBAIJ or AIJ"), (GAMG, "creategraph")] {
        let mut krylov = configured(session, &matrix, &[CG, preconditioner].concat());
        let b = right_hand_side(session, local);
        let error = krylov.solve(&b, &mut b.like().unwrap()).expect_err("PETSc can not do that");
        assert!(error.message.starts_with("petsc call KSPSolve failed (56): "), "{error}");
        assert!(error.message.contains(words), "{error}");
    }
}

/// A singular matrix, an indefinite one and too few iterations are distinguished, and none of them
/// is an error.
fn failures_are_outcomes(session: &Rc<Session>, local: &Local) {
    for format in [Format::Aij, Format::Baij] {
        let mut matrix = filled(session, local, format);
        let mut krylov = configured(session, &matrix, &CG.iter().chain(ASM_ICC).copied().collect::<Vec<_>>());
        krylov.set_tolerances(1e-10, 1e-30, 2).unwrap();
        let (outcome, _) = solve(session, local, &mut krylov, &matrix);
        assert_eq!((outcome.reason, outcome.iterations), (Reason::Iterations, 2));

        let unknowns = local.pattern.rows() * local.lattice.dimension;
        let tilt = |dof: usize| if dof.is_multiple_of(2) { -50.0 } else { 0.0 };
        matrix.fill(|values| (0..unknowns).for_each(|dof| values.add_diagonal(dof, tilt(dof)))).unwrap();
        let mut krylov = configured(session, &matrix, &[CG, &[("pc_type", "none")]].concat());
        let (outcome, _) = solve(session, local, &mut krylov, &matrix);
        assert_eq!((outcome.reason, outcome.converged()), (Reason::Indefinite, false));

        matrix.fill(|values| values.zero()).unwrap();
        for preconditioner in [MUMPS_LU, ASM_ILU] {
            let mut krylov = configured(session, &matrix, &[GMRES, preconditioner].concat());
            let (outcome, _) = solve(session, local, &mut krylov, &matrix);
            assert_eq!(outcome.reason, Reason::PreconditionerFailed, "{format:?} {preconditioner:?}");
        }
        matrix.fill(|values| values.scale(f64::NAN)).unwrap();
        let mut krylov = configured(session, &matrix, &[GMRES, &[("pc_type", "none")]].concat());
        let (outcome, _) = solve(session, local, &mut krylov, &matrix);
        assert_eq!((outcome.reason, outcome.converged()), (Reason::NotANumber, false));
    }
}

/// A direct factor kept from an old matrix is a preconditioner of the new one. A given initial
/// guess is used.
fn preconditioner_is_kept_on_demand(session: &Rc<Session>, local: &Local) {
    let local = local.with_skew(0.05);
    let mut matrix = filled(session, &local, Format::Baij);
    let mut krylov = configured(session, &matrix, &[GMRES, MUMPS_LU].concat());
    krylov.set_up().unwrap();
    assert_eq!(solve(session, &local, &mut krylov, &matrix).0.iterations, 1);
    let diagonals = local.pattern.rows() * local.lattice.dimension;
    matrix
        .fill(|values| (0..diagonals).for_each(|dof| values.add_diagonal(dof, 0.1 * (dof % 3) as f64)))
        .unwrap();
    krylov.reuse_preconditioner(Reuse::Keep).unwrap();
    let (kept, residual) = solve(session, &local, &mut krylov, &matrix);
    assert!(kept.iterations > 1 && kept.converged() && residual < 2e-10);
    krylov.reuse_preconditioner(Reuse::Renew).unwrap();
    assert_eq!(solve(session, &local, &mut krylov, &matrix).0.iterations, 1);

    let b = right_hand_side(session, &local);
    let mut x = b.like().unwrap();
    krylov.solve(&b, &mut x).unwrap();
    krylov.start_from(InitialGuess::Given).unwrap();
    krylov.set_tolerances(1e-6, 1e-30, 10).unwrap();
    assert_eq!(krylov.solve(&b, &mut x).unwrap().iterations, 0);

    krylov.reset().unwrap();
    krylov.set_operators(&matrix, &matrix).unwrap();
    assert!(krylov.solve(&b, &mut x).unwrap().converged());
}

/// A closure that solves with another solver is a preconditioner. Its error becomes the error of
/// the solve, and its captures are freed.
fn closures_precondition(session: &Rc<Session>, local: &Local) {
    let local = local.with_skew(0.05);
    let matrix = Rc::new(filled(session, &local, Format::Aij));
    let mut inner = configured(session, &matrix, &[DIRECT, MUMPS_LU].concat());
    let mut krylov = configured(session, &matrix, GMRES);
    let (calls, keep) = (Rc::new(Cell::new(0)), Rc::clone(&matrix));
    let counter = Rc::clone(&calls);
    krylov
        .set_shell_preconditioner(move |x, y| {
            counter.set(counter.get() + 1);
            assert_eq!(keep.block_size(), x.block_size());
            inner.solve(x, y).map(|_| ())
        })
        .unwrap();
    let (outcome, residual) = solve(session, &local, &mut krylov, &matrix);
    assert!(outcome.iterations == 1 && residual < 1e-10 && calls.get() >= 1);
    drop(krylov);
    assert_eq!((Rc::strong_count(&calls), Rc::strong_count(&matrix)), (1, 1));

    let mut krylov = configured(session, &matrix, GMRES);
    let refuse =
        |_: &Vector, _: &mut Vector| Err(contact_petsc::error::Error::internal("this closure refuses"));
    krylov.set_shell_preconditioner(refuse).unwrap();
    let b = right_hand_side(session, &local);
    let error = krylov.solve(&b, &mut b.like().unwrap()).expect_err("the closure refuses");
    assert!(error.message.contains("(83)") && error.message.ends_with("this closure refuses"), "{error}");
}

/// Ranks that own nothing take part in every kind of solve except one: PETSc 3.18's ICC of an empty
/// BAIJ matrix crashes.
fn ranks_without_rows(session: &Rc<Session>) {
    let shares: Vec<usize> = (0..session.size() as usize).map(|rank| usize::from(rank != 1)).collect();
    let shares = if shares.len() == 2 { vec![1, 0] } else { shares };
    let lattice = Lattice { counts: [8, 7, 1], dimension: 2, skew: 0.0, cut: 0 };
    let local = Local::new(session, lattice, &shares);
    for preset in PRESETS {
        let crashes = |format: &&Format| preset.preconditioner == ASM_ICC && **format == Format::Baij;
        for &format in preset.formats.iter().filter(|format| !crashes(format)) {
            let local = local.with_skew(preset.skew);
            let mut matrix = filled(session, &local, format);
            matrix.set_near_null_space(&local.coordinates(session)).unwrap();
            let mut krylov = configured(session, &matrix, &[preset.method, preset.preconditioner].concat());
            let (outcome, residual) = solve(session, &local, &mut krylov, &matrix);
            assert!(outcome.converged() && residual < 2e-10, "{} {format:?}", preset.name);
        }
    }
}

/// The coarse correction of `A u` is `u` itself for all rigid motions without the fixed nodes, on any number
/// of aggregates and ranks, and applying it twice changes nothing.
fn coarse_space_has_rigid_motions(session: &Rc<Session>, counts: [usize; 3]) {
    let d = if counts[2] == 1 { 2 } else { 3 };
    let lattice = Lattice { counts, dimension: d, skew: 0.3, cut: 0 };
    let local = Local::new(session, lattice, &vec![1; session.size() as usize]);
    let matrix = filled(session, &local, Format::Baij);
    let coordinates = local.coordinates(session).owned().to_vec();
    let nodes = BodyNodes { pattern: Rc::clone(&local.pattern), coordinates };
    let mut coarse = CoarseSpace::new(session, &local.pattern, &nodes).unwrap().expect("aggregates");
    coarse.project(&matrix).unwrap();
    let mut corrected = |u: &Vector| {
        let (mut r, mut z) = (u.like().unwrap(), u.like().unwrap());
        matrix.multiply(u, &mut r).unwrap();
        assert!(coarse.solve(&r, &mut z).unwrap());
        z
    };
    let apart = |a: &Vector, b: &Vector| {
        let mut difference = a.like().unwrap();
        difference.copy_from(a).unwrap();
        difference.axpy(-1.0, b).unwrap();
        difference.norm().unwrap() / b.norm().unwrap()
    };
    let turns: &[(usize, usize)] = if d == 2 { &[(0, 1)] } else { &[(0, 1), (1, 2), (2, 0)] };
    for mode in 0..d + turns.len() {
        let motion = local.vector(session, |dof| {
            let (node, i) = (dof / d, dof % d);
            let at = lattice.point(node);
            let value = match mode.checked_sub(d).map(|turn| turns[turn]) {
                None => f64::from(u8::from(i == mode)),
                Some((a, b)) if i == a => -at[b],
                Some((a, b)) if i == b => at[a],
                Some(_) => 0.0,
            };
            if lattice.held(node) { 0.0 } else { value }
        });
        let found = apart(&corrected(&motion), &motion);
        assert!(found < 1e-9, "motion {mode} of {counts:?}: {found:.1e}");
    }
    let once = corrected(&right_hand_side(session, &local));
    let found = apart(&corrected(&once), &once);
    assert!(found < 1e-9, "{counts:?}: {found:.1e}");
}
