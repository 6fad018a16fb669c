//! Errors end with the correct message and code, on all ranks.

use crate::lattice::{Lattice, Local};
use contact_petsc::error::Error;
use contact_petsc::petsc::{
    BlockPattern, Format, GraphRows, KrylovSolver, Matrix, Session, Vector, partition_graph,
};
use std::rc::Rc;

fn words(text: &str) -> Vec<String> {
    text.split_whitespace().map(str::to_owned).collect()
}

/// The other rank waits in a reduction that never completes. All ranks must end immediately.
pub fn panic_on_one_rank() {
    let session = Session::start(&[]).expect("MPI and PETSc start");
    let vector = Vector::new(&session, 1, 2).unwrap();
    assert!(session.rank() != 1, "rank 1 gives up");
    let _ = vector.norm();
}

/// Ends like a panic, with a code of our choice.
pub fn abort_on_one_rank() {
    let session = Session::start(&[]).expect("MPI and PETSc start");
    let vector = Vector::new(&session, 1, 2).unwrap();
    if session.rank() == 2 {
        session.abort(7);
    }
    let _ = vector.norm();
}

/// An error that is unknown to the other ranks also ends them, within seconds and with its code.
pub fn error_on_one_rank() {
    let session = Session::start(&[]).expect("MPI and PETSc start");
    let vector = Vector::new(&session, 1, 2).unwrap();
    if session.rank() == 1 {
        session.meet(&Error::file("rank 1 alone fails"));
    }
    let _ = vector.norm();
}

/// Rank 0 reports an error that all ranks know before any rank ends.
pub fn error_on_all_ranks() {
    let session = Session::start(&[]).expect("MPI and PETSc start");
    let told = session.report(&Error::file("all ranks fail"));
    assert!(told.message.is_empty());
    drop(session);
    std::process::exit(told.exit_code());
}

/// PETSc's errors name the call, the code and the cause. Malformed patterns are refused before they
/// reach PETSc.
pub fn errors() {
    let session = Session::start(&[]).expect("MPI and PETSc start");
    assert!(Session::start(&[]).is_err_and(|error| error.message.contains("one session")));

    let (short, mut long) = (Vector::new(&session, 2, 2).unwrap(), Vector::new(&session, 3, 2).unwrap());
    let error = long.axpy(1.0, &short).expect_err("lengths differ");
    assert!(
        error.message.starts_with("petsc call VecAXPY failed (75): Arguments are incompatible: "),
        "{error}"
    );
    assert!(error.message.contains("Incompatible vector") && error.exit_code() == 70, "{error}");

    let mut krylov = KrylovSolver::new(&session, "").unwrap();
    let error = krylov.configure(&[("ksp_type", "no_such_method")]).expect_err("no such method");
    assert!(error.message.contains("no_such_method"), "{error}");

    let pattern = |row_offsets: &[u32], columns: &[i32]| {
        let pattern = BlockPattern {
            block_size: 2,
            first_row: 0,
            row_offsets: row_offsets.to_vec(),
            columns: columns.to_vec(),
            places: (1..row_offsets.len() as u32).collect(),
        };
        Matrix::new(&session, &Rc::new(pattern), Format::Aij).err().map(|error| error.message)
    };
    assert!(pattern(&[0, 2, 3], &[0, 1, 1]).is_none());
    for (offsets, columns, reason) in [
        (&[0, 2, 3][..], &[1, 0, 1][..], "do not ascend"),
        (&[0, 1, 2], &[1, 1], "no diagonal"),
        (&[0, 1, 3], &[0, 1], "do not span"),
    ] {
        let message = pattern(offsets, columns).expect(reason);
        assert!(message.contains(reason), "{message}");
    }

    let row = GraphRows { total: 1, offsets: vec![0, 0], loads: vec![1], ..GraphRows::default() };
    let error = partition_graph(session.world(), &row, 1, c"no_such_library").expect_err("no such library");
    assert!(error.message.contains("no partitioner 'no_such_library'"), "{error}");
    assert!(error.message.contains("petsc-dev") && error.exit_code() == 3, "{error}");
    println!("errors done");
}

/// User options take precedence and unused ones are named; the program's own options are not.
/// Solvers do not affect each other.
pub fn options() {
    let given =
        words("-ksp_max_it 3 -no_such_option 7 -flag_without_value -log_view :/dev/null -sub_pc_type lu");
    let session = Session::start(&given).expect("MPI and PETSc start");
    assert!(session.is_given("KSP_max_it") && !session.is_given("ksp_rtol"));
    session.set_default("no_such_default", "1").unwrap();

    let local =
        Local::new(&session, Lattice { counts: [8, 8, 1], dimension: 2, skew: 0.05, cut: 0 }, &[1, 1]);
    let mut matrix = Matrix::new(&session, &local.pattern, Format::Aij).unwrap();
    matrix.fill(|values| local.fill(values)).unwrap();
    let (mut one, mut two) =
        (KrylovSolver::new(&session, "").unwrap(), KrylovSolver::new(&session, "").unwrap());
    one.configure(&[("ksp_type", "gmres"), ("pc_type", "jacobi"), ("ksp_max_it", "50")]).unwrap();
    two.configure(&[("ksp_type", "cg"), ("pc_type", "none")]).unwrap();
    let b = local.vector(&session, |dof| dof as f64);
    let mut x = b.like().unwrap();
    for (krylov, types) in [(&mut one, ("gmres", "jacobi")), (&mut two, ("cg", "none"))] {
        krylov.set_operators(&matrix, &matrix).unwrap();
        krylov.set_tolerances(1e-12, 1e-30, 40).unwrap();
        let outcome = krylov.solve(&b, &mut x).unwrap();
        assert_eq!(outcome.iterations, 3, "the user asked for three");
        assert!(!outcome.converged() && outcome.reason.to_string() == "iteration limit reached");
        let found = krylov.types().unwrap();
        assert_eq!((found.0.as_str(), found.1.as_str()), types);
    }
    let mut unused = session.unused_options().unwrap();
    unused.sort();
    assert_eq!(unused, ["-flag_without_value", "-no_such_option 7", "-sub_pc_type lu"]);
    if session.rank() == 0 {
        println!("options done");
    }
}
