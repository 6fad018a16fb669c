//! Lifetime of MPI and PETSc: the owner of a [`Session`] may use both.

use super::call::{self, petsc, quiet_handler};
use super::options::{self, OptionsDatabase};
use super::{alone, limits, threads, usage};
use crate::collective::Collective;
use crate::error::{Error, Result, agree};
use mpi::collective::SystemOperation;
use mpi::environment::Universe;
use mpi::topology::{Color, SimpleCommunicator};
use mpi::traits::{AsRaw, Communicator, CommunicatorCollectives};
use petsc_sys as sys;
use std::cell::{Cell, RefCell};
use std::ffi::{CString, c_char, c_int};
use std::io::Write;
use std::panic::PanicHookInfo;
use std::ptr::{null, null_mut};
use std::rc::Rc;
use std::time::{Duration, Instant};

use super::event_totals::EventTotals;

/// Exit code for an internal error of the program.
const FAULT: i32 = 70;

/// Time for which a failed rank waits for the others to fail as well.
const PATIENCE: Duration = Duration::from_secs(5);

/// Some or all ranks of a process that has started MPI and PETSc. Both end, in the correct order,
/// when the last owner is dropped.
///
/// Every vector, matrix and solver holds a reference, so none of them outlives PETSc.
pub struct Session {
    world: SimpleCommunicator,
    process: Rc<Process>,
}

/// The state of the process, which all its sessions share.
struct Process {
    /// Used only for [`Session::meet`], so that it does not match other pending communication.
    ending: SimpleCommunicator,
    options: RefCell<OptionsDatabase>,
    events: RefCell<Vec<Rc<EventTotals>>>,
    /// Processor time at the beginning of the measured run \[s\].
    began: Cell<f64>,
    /// Whether this process was requested to stop; see [`Session::listen`].
    asked: RefCell<Option<Box<dyn Fn() -> bool>>>,
    /// PETSc keeps pointers to its arguments until the end.
    _arguments: Arguments,
    /// Dropped, and MPI with it, after `Drop::drop` has finalized PETSc.
    _universe: Universe,
}

impl Session {
    /// Starts MPI, then PETSc with only `args` (and `PETSC_OPTIONS`), alone or under `mpirun`.
    /// Collective.
    ///
    /// After this call a panic on any rank ends all ranks with one message and code 70.
    ///
    /// # Errors
    /// There is a stray word among `args`, a library cannot start, or the process already has a
    /// session.
    pub fn start(args: &[String]) -> Result<Rc<Self>> {
        options::validate(args)?;
        alone::isolate();
        threads::one_unless_chosen();
        threads::require_buffers().map_err(say_late)?;
        limits::require_file_size().map_err(say_late)?;
        let again = || Error::internal("MPI is already initialised: a process can have only one session");
        let universe = mpi::initialize().ok_or_else(again)?;
        std::panic::set_hook(Box::new(report_panic));
        let world = universe.world();
        agree(&world, if world.rank() == 0 { require_files(args) } else { Ok(()) })?;
        let mut arguments = Arguments::new(args)?;
        petsc!(PetscInitialize(&mut arguments.count, &mut arguments.pointer, null(), null()))?;
        petsc!(PetscPushErrorHandler(Some(quiet_handler), null_mut()))?;
        let process = Process {
            ending: world.duplicate(),
            options: RefCell::new(OptionsDatabase::snapshot()?),
            events: RefCell::default(),
            began: Cell::new(0.0),
            asked: RefCell::default(),
            _arguments: arguments,
            _universe: universe,
        };
        let session = Self { world, process: Rc::new(process) };
        session.make_mpi_errors_fatal();
        agree(session.world(), threads::take_buffers())?;
        // The program reports unused options itself, from rank 0 and by name.
        session.set_default("options_left", "no")?;
        // From 3.20 on, PETSc computes sums over several vectors with the BLAS, whose rounding
        // depends on the memory addresses of the vectors. Runs would not be bitwise reproducible.
        for name in ["vec_mdot_use_gemv", "vec_maxpy_use_gemv"] {
            session.set_default(name, "no")?;
        }
        // Coarse matrices of multigrid, `P^T A P`, by way of `A P`, as PETSc does on several ranks. On one
        // rank its default takes twice as long, for less memory (docs/performance/large-problems.md).
        if session.size() == 1 {
            session.set_default("matptap_via", "rap")?;
        }
        Ok(Rc::new(session))
    }

    /// A session of the ranks that are members, in their present order, for objects in which the
    /// others take no part. It is this session if all ranks are members, and `None` on ranks
    /// that are not members. Collective.
    pub fn of_members(self: &Rc<Self>, member: bool) -> Option<Rc<Self>> {
        let color = if member { Color::with_value(0) } else { Color::undefined() };
        let world = self.world.split_by_color(color)?;
        if world.size() == self.size() {
            return Some(Rc::clone(self));
        }
        Some(Rc::new(Self { world, process: Rc::clone(&self.process) }))
    }

    /// Phases that measure their time.
    pub(super) fn events(&self) -> &RefCell<Vec<Rc<EventTotals>>> {
        &self.process.events
    }

    /// Restarts the measurement of phase times, processor time and peak memory, for several runs in
    /// one process. Earlier runs whose memory is freed do not count.
    pub fn measure_anew(&self) {
        self.process.events.borrow().iter().for_each(|event| event.reset());
        self.process.began.set(usage::user_seconds());
        usage::reset_peak();
    }

    /// Processor time of this rank in user mode since the run began \[s\].
    pub fn user_seconds(&self) -> f64 {
        usage::user_seconds() - self.process.began.get()
    }

    /// The ranks of this session: all ranks of the run, except in a session of some members.
    pub fn world(&self) -> &SimpleCommunicator {
        &self.world
    }

    /// Number of this rank.
    pub fn rank(&self) -> i32 {
        self.world.rank()
    }

    /// Number of ranks.
    pub fn size(&self) -> i32 {
        self.world.size()
    }

    /// Sets a PETSc option (name without dash; empty value for a flag), even if the user gave it.
    ///
    /// # Errors
    /// PETSc rejects the name.
    pub fn set_option(&self, name: &str, value: &str) -> Result<()> {
        options::insert(name, value)
    }

    /// Sets a PETSc option unless the user gave it.
    ///
    /// # Errors
    /// PETSc rejects the name.
    pub fn set_default(&self, name: &str, value: &str) -> Result<()> {
        if self.is_given(name) { Ok(()) } else { options::insert(name, value) }
    }

    /// Adds a PETSc option that the user gave elsewhere, for example in the case, unless it was
    /// given at the start.
    ///
    /// # Errors
    /// PETSc rejects the name.
    pub fn give(&self, name: &str, value: &str) -> Result<()> {
        self.set_default(name, value)?;
        self.process.options.borrow_mut().give(name);
        Ok(())
    }

    /// Removes a PETSc option that [`Session::give`] has added, before another case is run.
    ///
    /// # Errors
    /// PETSc rejects the name.
    pub fn take_back(&self, name: &str) -> Result<()> {
        self.process.options.borrow_mut().take_back(name);
        options::remove(name)
    }

    /// Whether the user gave the PETSc option `name`. This query does not mark it as used.
    pub fn is_given(&self, name: &str) -> bool {
        self.process.options.borrow().is_given(name)
    }

    /// The user's options for the linear solver with this prefix, each as `-name`.
    pub fn given(&self, prefix: &str) -> Vec<String> {
        self.process.options.borrow().of_solver(prefix)
    }

    /// Sets the function that [`Session::is_asked_to_stop`] calls, and replaces the previous one.
    pub fn listen(&self, asked: impl Fn() -> bool + 'static) {
        *self.process.asked.borrow_mut() = Some(Box::new(asked));
    }

    /// Whether this rank was requested to stop. Other ranks may not know it yet.
    pub fn is_asked_to_stop(&self) -> bool {
        self.process.asked.borrow().as_ref().is_some_and(|asked| asked())
    }

    /// The PETSc options with which the session was started, by the command line or
    /// `PETSC_OPTIONS`, with their values, sorted. Options that only affect reports at the end are
    /// omitted.
    pub fn options_at_the_start(&self) -> String {
        self.process.options.borrow().at_the_start().to_owned()
    }

    /// The user's PETSc options that have not been read on any rank so far, each as `-name value`. A
    /// solver of some ranks reads its options on these ranks only. Collective.
    ///
    /// # Errors
    /// PETSc cannot list its options.
    pub fn unused_options(&self) -> Result<Vec<String>> {
        let options = self.process.options.borrow();
        let left = options.unused();
        let names = options.names();
        let is_left = |name: &String| left.iter().flatten().any(|(own, _)| own == name);
        let own: Vec<u8> = names.iter().map(|name| u8::from(is_left(name))).collect();
        let mut everywhere = own.clone();
        self.world.reduce_all(&own, &mut everywhere, SystemOperation::min());
        let unused =
            |(name, _): &(String, String)| names.binary_search(name).is_ok_and(|at| everywhere[at] > 0);
        Ok(left?.into_iter().filter(unused).map(|(_, words)| words).collect())
    }

    /// Waits for all other ranks to fail as well. If they do not, the error is known only here and
    /// they wait for this rank elsewhere: this rank then prints the error and ends all ranks.
    /// Collective among ranks that failed.
    pub fn meet(&self, error: &Error) {
        let deadline = Instant::now() + PATIENCE;
        let mut waiting = self.process.ending.immediate_barrier();
        while let Err(still) = waiting.test() {
            if Instant::now() > deadline {
                say(error);
                end_all_ranks(error.exit_code());
            }
            waiting = still;
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// Prints an error once. Rank 0 prints before any rank may end, because `mpirun` kills the
    /// others when the first one fails. Returns the error without its message. Collective among
    /// ranks that failed.
    #[must_use]
    pub fn report(&self, error: &Error) -> Error {
        if self.rank() == 0 {
            say(error);
        }
        self.meet(error);
        Error::new(error.cause, "")
    }

    /// Ends all ranks immediately with the exit code `code`, for errors that the other ranks cannot
    /// know.
    pub fn abort(&self, code: i32) -> ! {
        end_all_ranks(code)
    }

    /// The communicator in PETSc's type.
    pub(super) fn comm(&self) -> sys::MPI_Comm {
        self.world.as_raw()
    }

    /// PETSc makes MPI return its errors, but the crate `mpi` does not check them.
    fn make_mpi_errors_fatal(&self) {
        // SAFETY: the communicator is alive; the handler is a constant of MPI.
        unsafe { mpi::ffi::MPI_Comm_set_errhandler(self.comm(), mpi::ffi::RSMPI_ERRORS_ARE_FATAL) };
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // MPI ends after PETSc: the field with the universe is dropped after this body.
        let ended = petsc!(PetscPopErrorHandler()).and_then(|()| petsc!(PetscFinalize()));
        if let Err(error) = ended {
            let _ = writeln!(std::io::stderr(), "contact-petsc: {error}");
        }
    }
}

/// Program name and options in the form of C's `main` arguments.
struct Arguments {
    count: c_int,
    pointer: *mut *mut c_char,
    _array: Vec<*mut c_char>,
    _texts: Vec<CString>,
}

impl Arguments {
    fn new(args: &[String]) -> Result<Self> {
        // Signals keep their default or our handling: PETSc would end the run when a terminal is
        // closed or a pipe is broken. The last option prevents PETSc from reading stray .petscrc
        // files.
        let own = ["-no_signal_handler", "-skip_petscrc"];
        let words = ["contact-petsc"].into_iter().chain(args.iter().map(String::as_str)).chain(own);
        let texts = words.map(options::text).collect::<Result<Vec<_>>>()?;
        let mut array: Vec<*mut c_char> = texts.iter().map(|text| text.as_ptr().cast_mut()).collect();
        array.push(null_mut());
        let count = texts.len() as c_int;
        let pointer = array.as_mut_ptr();
        Ok(Self { count, pointer, _array: array, _texts: texts })
    }
}

/// Reads the files from which PETSc will read its options. PETSc reads them on rank 0 only.
///
/// # Errors
/// Such a file is not an options file.
fn require_files(args: &[String]) -> Result<()> {
    let environment = std::env::var("PETSC_OPTIONS").unwrap_or_default();
    let given = environment.split_whitespace().map(|word| word.trim_matches(['"', '\'']));
    options::require_files(&given.collect::<Vec<_>>())?;
    options::require_files(&args.iter().map(String::as_str).collect::<Vec<_>>())
}

/// Handles an error before the start of MPI, which the other ranks cannot know. Rank 0 returns the
/// error; it is printed elsewhere, and `mpirun` then ends the others. If rank 0 has no error, this
/// rank prints it. Returns the error without its message once it is printed.
fn say_late(error: Error) -> Error {
    if std::env::var("OMPI_COMM_WORLD_RANK").map_or(true, |rank| rank == "0") {
        return error;
    }
    std::thread::sleep(Duration::from_secs(1));
    say(&error);
    Error::new(error.cause, "")
}

fn say(error: &Error) {
    let _ = std::io::stderr().write_all(format!("contact-petsc: {}: {error}\n", error.label()).as_bytes());
}

/// Ends all ranks with one message after an unrecoverable error.
pub(super) fn fault(error: &Error) -> ! {
    let _ = writeln!(std::io::stderr(), "contact-petsc: {error}");
    end_all_ranks(FAULT)
}

fn report_panic(info: &PanicHookInfo) {
    let payload = info.payload();
    let words = payload.downcast_ref::<&str>().copied();
    let words = words.or_else(|| payload.downcast_ref::<String>().map(String::as_str)).unwrap_or("panic");
    let place = info.location().map(|place| format!(" ({}:{})", place.file(), place.line()));
    let message = format!("contact-petsc: internal error: {words}{}\n", place.unwrap_or_default());
    // A single write, so that the messages of two ranks do not mix.
    let _ = std::io::stderr().write_all(message.as_bytes());
    end_all_ranks(FAULT)
}

fn end_all_ranks(code: i32) -> ! {
    let _ = std::io::stdout().flush();
    let _ = call::take_detail();
    let mut running = 0;
    // SAFETY: both may be called at any time; abort only while MPI runs.
    unsafe {
        mpi::ffi::MPI_Finalized(&mut running);
        if running == 0 {
            mpi::ffi::MPI_Abort(mpi::ffi::RSMPI_COMM_WORLD, code);
        }
    }
    std::process::exit(code)
}
