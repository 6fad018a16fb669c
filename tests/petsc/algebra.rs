//! Vectors and matrices against dense references.

use crate::lattice::{Lattice, Local};
use contact_petsc::petsc::{
    Event, Format, Matrix, Operator, Session, ShellOperator, Vector, memory, peak_memory, versions,
};
use std::cell::Cell;
use std::rc::Rc;

pub fn run() {
    let session = Session::start(&[]).expect("MPI and PETSc start");
    let size = session.size() as usize;
    let even = vec![1; size];
    // With three ranks the middle one owns nothing in the second distribution.
    let gap: Vec<usize> = (0..size).map(|rank| if size == 3 && rank == 1 { 0 } else { rank + 1 }).collect();
    for shares in [even, gap] {
        for counts in [[4, 3, 1], [3, 3, 3]] {
            let dimension = if counts[2] == 1 { 2 } else { 3 };
            let local = Local::new(&session, Lattice { counts, dimension, skew: 0.1, cut: 0 }, &shares);
            ghosts_follow_their_owners(&session, &local);
            vector_algebra(&session, &local);
            for format in [Format::Aij, Format::Baij] {
                matrix_equals_dense(&session, &local, format);
                rows_and_masks(&session, &local, format);
            }
            scalar_matrix_acts_on_components(&session, &local);
            shell_operator_multiplies(&session, &local);
        }
    }
    events_and_records(&session);
    if session.rank() == 0 {
        println!("algebra done");
    }
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * (1.0 + a.abs().max(b.abs()))
}

fn wave(dof: usize) -> f64 {
    (dof as f64 * 0.7 + 0.3).sin()
}

/// Ghost values equal those of the owner after an update, and are summed at the owner.
fn ghosts_follow_their_owners(session: &Rc<Session>, local: &Local) {
    let d = local.lattice.dimension;
    let mut x = local.vector(session, |dof| dof as f64);
    x.update_ghosts().unwrap();
    let owned = x.owned_len();
    let values = x.local();
    for (g, &node) in local.ghosts.iter().enumerate() {
        for k in 0..d {
            assert_eq!(values[owned + g * d + k], (node as usize * d + k) as f64);
        }
    }
    drop(values);
    // Every rank puts one into each of its ghosts: an owner counts the ranks that see its node.
    let mut count = x.like().unwrap();
    count.local_mut()[owned..].fill(1.0);
    count.add_ghosts_to_owners().unwrap();
    let mut seen = count.like().unwrap();
    seen.set(1.0);
    let total = count.dot(&seen).unwrap();
    let mut mine = Vector::new(session, 1, 1).unwrap();
    mine.set((local.ghosts.len() * d) as f64);
    let mut one = mine.like().unwrap();
    one.set(1.0);
    assert!(close(total, mine.dot(&one).unwrap()));
}

/// The operations follow their formulas, and a norm is recomputed after a change of the values.
fn vector_algebra(session: &Rc<Session>, local: &Local) {
    let total = local.lattice.total() * local.lattice.dimension;
    let x = local.vector(session, wave);
    let y = local.vector(session, |dof| 1.0 + dof as f64);
    let check = |z: &Vector, formula: &dyn Fn(f64, f64) -> f64| {
        let (x, y, z) = (x.owned(), y.owned(), z.owned());
        assert!((0..z.len()).all(|i| close(z[i], formula(x[i], y[i]))));
    };
    let mut z = x.like().unwrap();
    z.waxpy(2.0, &x, &y).unwrap();
    check(&z, &|x, y| 2.0 * x + y);
    z.axpy(-1.0, &x).unwrap();
    check(&z, &|x, y| x + y);
    z.aypx(3.0, &x).unwrap();
    check(&z, &|x, y| 4.0 * x + 3.0 * y);
    z.axpby(2.0, -1.0, &y).unwrap();
    check(&z, &|x, y| -4.0 * x - y);
    z.scale(-0.5).unwrap();
    check(&z, &|x, y| 2.0 * x + 0.5 * y);
    z.pointwise_multiply(&x, &y).unwrap();
    check(&z, &|x, y| x * y);
    z.pointwise_divide(&x, &y).unwrap();
    check(&z, &|x, y| x / y);
    z.copy_from(&y).unwrap();
    check(&z, &|_, y| y);
    assert!(close(z.max_norm().unwrap(), total as f64));
    let exact: f64 = (0..total).map(|dof| wave(dof) * (1.0 + dof as f64)).sum();
    assert!(close(x.dot(&y).unwrap(), exact));
    let before = z.norm().unwrap();
    z.local_mut().iter_mut().for_each(|value| *value *= 2.0);
    assert!(close(z.norm().unwrap(), 2.0 * before));
}

/// The matrix filled through the scatter has the entries of the dense reference and the same
/// product.
fn matrix_equals_dense(session: &Rc<Session>, local: &Local, format: Format) {
    let mut matrix = Matrix::new(session, &local.pattern, format).unwrap();
    // Twice: a second filling must not see the first one.
    for _ in 0..2 {
        matrix.fill(|values| local.fill(values)).unwrap();
    }
    let dense = local.dense();
    let (size, d, first) = (dense.len(), local.lattice.dimension, local.owned().start);
    let blocks_agree = matrix.fill(|values| {
        let mut block = vec![0.0; d * d];
        let pairs =
            (0..local.pattern.rows()).flat_map(|row| local.pattern.row(row).map(move |slot| (row, slot)));
        pairs.into_iter().all(|(row, slot)| {
            values.block(slot as u32, &mut block);
            let column = local.pattern.columns[slot] as usize;
            (0..d * d).all(|k| close(block[k], dense[(first + row) * d + k / d][column * d + k % d]))
        })
    });
    assert!(blocks_agree.unwrap(), "blocks of {format:?}");

    // A mass takes the place of whatever was there.
    let masses: Vec<f64> = (0..local.pattern.slots()).map(wave).collect();
    let isotropic = matrix.fill(|values| {
        values.set_isotropic(2.0, &masses);
        let mut block = vec![0.0; d * d];
        (0..local.pattern.slots()).all(|slot| {
            values.block(slot as u32, &mut block);
            (0..d * d).all(|k| block[k] == if k / d == k % d { 2.0 * masses[slot] } else { 0.0 })
        })
    });
    assert!(isotropic.unwrap(), "mass in {format:?}");
    matrix.fill(|values| local.fill(values)).unwrap();

    let x = local.vector(session, wave);
    let mut y = x.like().unwrap();
    let agrees = |y: &Vector, entry: &dyn Fn(usize, usize) -> f64| {
        let exact = |row: usize| (0..size).map(|column| entry(row, column) * wave(column)).sum::<f64>();
        y.owned().iter().enumerate().all(|(i, &value)| close(value, exact(first * d + i)))
    };
    matrix.multiply(&x, &mut y).unwrap();
    assert!(agrees(&y, &|i, j| dense[i][j]), "product of {format:?}");
    matrix.multiply_transpose(&x, &mut y).unwrap();
    assert!(agrees(&y, &|i, j| dense[j][i]), "transposed product of {format:?}");
    matrix.diagonal(&mut y).unwrap();
    assert!(
        y.owned().iter().enumerate().all(|(i, &value)| close(value, dense[first * d + i][first * d + i]))
    );
    let frobenius = dense.iter().flatten().map(|value| value * value).sum::<f64>().sqrt();
    assert!(close(matrix.norm_frobenius().unwrap(), frobenius));
    assert!(matrix.asymmetry().unwrap() > 1e-3);
    assert!(matrix.bytes() >= local.pattern.slots() * d * d * 8);

    let mut twin = Matrix::new(session, &local.pattern, format).unwrap();
    twin.copy_values_from(&matrix).unwrap();
    twin.axpy_same_pattern(-3.0, &matrix).unwrap();
    assert!(close(twin.norm_frobenius().unwrap(), 2.0 * frobenius));
    twin.multiply(&x, &mut y).unwrap();
    assert!(agrees(&y, &|i, j| -2.0 * dense[i][j]));
}

/// Identity rows, masks, diagonal and isotropic additions change only the named entries.
fn rows_and_masks(session: &Rc<Session>, local: &Local, format: Format) {
    let symmetric = local.with_skew(0.0);
    let mut matrix = Matrix::new(session, &symmetric.pattern, format).unwrap();
    matrix.fill(|values| symmetric.fill(values)).unwrap();
    assert!(matrix.asymmetry().unwrap() < 1e-13);
    let (d, owned) = (local.lattice.dimension, local.owned());
    let mut x = local.vector(session, wave);
    let mut y = x.like().unwrap();
    matrix
        .fill(|values| {
            for row in 0..owned.len() {
                let dof = row * d + 1;
                values.set_identity_row(dof, 5.0);
                // Columns of component 1 everywhere: the matrix becomes symmetric again.
                for slot in symmetric.pattern.row(row) {
                    values.mask(slot as u32, 0, 0b10);
                }
                values.add_diagonal(dof, 5.0);
                let own = symmetric.pattern.slot(row, (owned.start + row) as i32).unwrap();
                values.add_isotropic(own, 1.0);
            }
        })
        .unwrap();
    assert!(matrix.asymmetry().unwrap() < 1e-13);
    x.owned_mut().iter_mut().enumerate().filter(|(i, _)| i % d != 1).for_each(|(_, value)| *value = 0.0);
    matrix.multiply(&x, &mut y).unwrap();
    let (x, y) = (x.owned(), y.owned());
    assert!((0..x.len()).all(|i| close(y[i], if i % d == 1 { 6.0 * x[i] } else { 0.0 })));
}

/// The product with a scalar matrix applied to each component, also after its values changed.
fn scalar_matrix_acts_on_components(session: &Rc<Session>, local: &Local) {
    let d = local.lattice.dimension;
    let mut scalar = Matrix::scalar(session, &local.pattern).unwrap();
    let product = scalar.kronecker_identity(d).unwrap();
    let owned = local.owned();
    for factor in [1.0, 2.0] {
        scalar
            .fill(|values| {
                values.zero();
                for row in 0..owned.len() {
                    for slot in local.pattern.row(row) {
                        let entry =
                            (owned.start + row) as f64 + 0.01 * f64::from(local.pattern.columns[slot]);
                        values.add(slot as u32, &[factor * entry]);
                    }
                }
            })
            .unwrap();
        let x = local.vector(session, wave);
        let mut y = x.like().unwrap();
        product.multiply(&x, &mut y).unwrap();
        for (i, &value) in y.owned().iter().enumerate() {
            let node = owned.start + i / d;
            let near = local.lattice.neighbours(node).into_iter();
            let exact: f64 = near.map(|b| (node as f64 + 0.01 * b as f64) * wave(b * d + i % d)).sum();
            assert!(close(value, factor * exact), "{value} {exact}");
        }
    }
}

/// A closure serves as a matrix.
fn shell_operator_multiplies(session: &Rc<Session>, local: &Local) {
    let matrix = Matrix::new(session, &local.pattern, Format::Baij).unwrap();
    let calls = Rc::new(Cell::new(0));
    let counter = Rc::clone(&calls);
    let shell = ShellOperator::new(session, &matrix, move |x, y| {
        counter.set(counter.get() + 1);
        y.owned_mut().iter_mut().zip(&*x.owned()).for_each(|(y, x)| *y = 3.0 * x);
        Ok(())
    });
    let shell = shell.unwrap();
    let x = local.vector(session, wave);
    let mut y = x.like().unwrap();
    shell.multiply(&x, &mut y).unwrap();
    assert!(y.owned().iter().zip(&*x.owned()).all(|(y, x)| close(*y, 3.0 * x)));
    drop(shell);
    assert_eq!((calls.get(), Rc::strong_count(&calls)), (1, 1), "called once, and the closure is gone");
}

/// Phases count their time once when nested; memory and versions are known.
fn events_and_records(session: &Rc<Session>) {
    let event = Event::register(session, "Phase").unwrap();
    {
        let _outer = event.begin();
        let _inner = event.begin();
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    assert_eq!((event.calls(), event.name()), (1, "Phase"));
    assert!(event.seconds() >= 0.02);
    // The peak is read last: memory grows between the two.
    let now = memory();
    assert!(now > 1 << 20 && peak_memory() >= now);
    let [petsc, mpi, metis] = versions().map(|(name, version)| format!("{name} {version}"));
    assert!(
        petsc.starts_with("PETSc 3.") && mpi.contains("MPI") && metis.starts_with("METIS 5."),
        "{petsc}, {mpi}, {metis}"
    );
}
