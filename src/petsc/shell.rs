//! Operators and preconditioners given as closures, which PETSc calls back.

use super::call::{keep_detail, petsc};
use super::matrix::Matrix;
use super::operator::Operator;
use super::session::Session;
use super::vector::Vector;
use crate::error::{Error, Result};
use petsc_sys as sys;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr::null_mut;
use std::rc::Rc;

/// Computes `y` from `x`.
pub(super) type Apply = Box<dyn FnMut(&Vector, &mut Vector) -> Result<()>>;

struct Context {
    session: Rc<Session>,
    apply: Apply,
}

impl Context {
    /// Runs the closure. A panic must not cross C. An error becomes a code, and its text is stored.
    fn run(&mut self, x: sys::Vec, y: sys::Vec) -> sys::PetscErrorCode {
        let answer = catch_unwind(AssertUnwindSafe(|| {
            let x = Vector::share(&self.session, x)?;
            let mut y = Vector::share(&self.session, y)?;
            (self.apply)(&x, &mut y)
        }));
        match answer.unwrap_or_else(|_| Err(Error::internal("a callback panicked"))) {
            Ok(()) => sys::SUCCESS,
            Err(error) => {
                keep_detail(error.message);
                sys::ERROR_USER
            }
        }
    }
}

/// The closure behind a preconditioner, owned by PETSc's object.
pub(super) struct ShellPreconditioner;

impl ShellPreconditioner {
    pub(super) fn install(session: &Rc<Session>, pc: sys::PC, apply: Apply) -> Result<()> {
        petsc!(PCSetType(pc, c"shell".as_ptr()))?;
        let context = Box::into_raw(Box::new(Context { session: Rc::clone(session), apply }));
        petsc!(PCShellSetContext(pc, context.cast()))?;
        petsc!(PCShellSetDestroy(pc, Some(destroy_preconditioner)))?;
        petsc!(PCShellSetApply(pc, Some(apply_preconditioner)))
    }
}

unsafe extern "C" fn apply_preconditioner(pc: sys::PC, x: sys::Vec, y: sys::Vec) -> sys::PetscErrorCode {
    let mut context: *mut Context = null_mut();
    // SAFETY: the context was set in `install` and lives until `destroy_preconditioner`.
    unsafe {
        let code = sys::PCShellGetContext(pc, (&raw mut context).cast());
        if code != sys::SUCCESS { code } else { (*context).run(x, y) }
    }
}

unsafe extern "C" fn destroy_preconditioner(pc: sys::PC) -> sys::PetscErrorCode {
    let mut context: *mut Context = null_mut();
    // SAFETY: PETSc calls this once, last; the box is the one that `install` released.
    unsafe {
        let code = sys::PCShellGetContext(pc, (&raw mut context).cast());
        if code == sys::SUCCESS && !context.is_null() {
            drop(Box::from_raw(context));
        }
        code
    }
}

/// A matrix defined only by its product with a vector.
pub struct ShellOperator {
    _session: Rc<Session>,
    raw: sys::Mat,
}

impl ShellOperator {
    /// An operator with the layout of `like` whose product is `apply(x, y)`, which sets `y = A x`.
    /// Collective.
    ///
    /// The closure runs on all ranks together. If it fails, it must fail on all ranks.
    ///
    /// # Errors
    /// PETSc fails.
    pub fn new(
        session: &Rc<Session>,
        like: &Matrix,
        apply: impl FnMut(&Vector, &mut Vector) -> Result<()> + 'static,
    ) -> Result<Self> {
        let rows = (like.pattern().rows() * like.block_size()) as i32;
        let mut raw = null_mut();
        let comm = session.comm();
        let total = sys::DETERMINE;
        petsc!(MatCreateShell(comm, rows, rows, total, total, null_mut(), &mut raw))?;
        let shell = Self { _session: Rc::clone(session), raw };
        petsc!(MatSetBlockSize(raw, like.block_size() as i32))?;
        // SAFETY: PETSc stores operations as functions without a signature and calls them with
        // these handles.
        let (multiply, destroy) = unsafe {
            (
                std::mem::transmute::<Multiply, unsafe extern "C" fn()>(multiply),
                std::mem::transmute::<Destroy, unsafe extern "C" fn()>(destroy_operator),
            )
        };
        petsc!(MatShellSetOperation(raw, sys::MATOP_MULT, Some(multiply)))?;
        petsc!(MatShellSetOperation(raw, sys::MATOP_DESTROY, Some(destroy)))?;
        let context =
            Box::into_raw(Box::new(Context { session: Rc::clone(session), apply: Box::new(apply) }));
        petsc!(MatShellSetContext(raw, context.cast()))?;
        Ok(shell)
    }
}

type Multiply = unsafe extern "C" fn(sys::Mat, sys::Vec, sys::Vec) -> sys::PetscErrorCode;
type Destroy = unsafe extern "C" fn(sys::Mat) -> sys::PetscErrorCode;

unsafe extern "C" fn multiply(matrix: sys::Mat, x: sys::Vec, y: sys::Vec) -> sys::PetscErrorCode {
    let mut context: *mut Context = null_mut();
    // SAFETY: the context was set in `new` and lives until `destroy_operator`.
    unsafe {
        let code = sys::MatShellGetContext(matrix, (&raw mut context).cast());
        if code != sys::SUCCESS { code } else { (*context).run(x, y) }
    }
}

unsafe extern "C" fn destroy_operator(matrix: sys::Mat) -> sys::PetscErrorCode {
    let mut context: *mut Context = null_mut();
    // SAFETY: PETSc calls this once, when the last reference to the matrix is released.
    unsafe {
        let code = sys::MatShellGetContext(matrix, (&raw mut context).cast());
        if code == sys::SUCCESS && !context.is_null() {
            drop(Box::from_raw(context));
        }
        code
    }
}

impl Operator for ShellOperator {
    fn raw(&self) -> sys::Mat {
        self.raw
    }
}

impl Drop for ShellOperator {
    fn drop(&mut self) {
        // SAFETY: we own the handle, and PETSc is running because we hold the session.
        unsafe { sys::MatDestroy(&mut self.raw) };
    }
}
