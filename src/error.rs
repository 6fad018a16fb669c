//! One error type by cause, and the rule that one rank's error is every rank's error.

use mpi::collective::SystemOperation;
use mpi::traits::{CommunicatorCollectives, Root};

/// Why the program ends; each cause has its exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum Cause {
    /// The command line is wrong.
    Usage = 2,
    /// The case file is wrong.
    Case = 3,
    /// A mesh or another file can not be read or written.
    File = 4,
    /// The equations were not solved; results up to the last good step are kept.
    NotConverged = 5,
    /// A physics guard fired: inverted element, unexplained energy.
    Guard = 6,
    /// Asked to stop, by a signal or a wall-time limit; a checkpoint was written.
    Stopped = 7,
    /// A fault of the program or of a library below it.
    Internal = 70,
}

impl Cause {
    fn from_code(code: i32) -> Self {
        [Self::Usage, Self::Case, Self::File, Self::NotConverged, Self::Guard, Self::Stopped]
            .into_iter()
            .find(|cause| *cause as i32 == code)
            .unwrap_or(Self::Internal)
    }
}

/// What went wrong, where, and where known what to do about it.
///
/// `message` is one sentence or a rendered snippet; a cure stands on a line of its own that begins with `hint: `.
#[derive(Debug, Clone, thiserror::Error)]
#[error("{message}")]
pub struct Error {
    /// Decides the exit code.
    pub cause: Cause,
    /// What the user reads.
    pub message: String,
}

/// Result with this program's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// An error of the given cause.
    pub fn new(cause: Cause, message: impl Into<String>) -> Self {
        Self { cause, message: message.into() }
    }

    /// The command line is wrong.
    pub fn usage(message: impl Into<String>) -> Self {
        Self::new(Cause::Usage, message)
    }

    /// The case is wrong.
    pub fn case(message: impl Into<String>) -> Self {
        Self::new(Cause::Case, message)
    }

    /// A mesh or file is wrong.
    pub fn file(message: impl Into<String>) -> Self {
        Self::new(Cause::File, message)
    }

    /// The equations were not solved.
    pub fn not_converged(message: impl Into<String>) -> Self {
        Self::new(Cause::NotConverged, message)
    }

    /// A physics guard fired.
    pub fn guard(message: impl Into<String>) -> Self {
        Self::new(Cause::Guard, message)
    }

    /// Stopped on request with a checkpoint.
    pub fn stopped(message: impl Into<String>) -> Self {
        Self::new(Cause::Stopped, message)
    }

    /// The program or a library is at fault.
    pub fn internal(message: impl Into<String>) -> Self {
        Self::new(Cause::Internal, message)
    }

    /// One error that says all of several, with the cause of the first.
    ///
    /// # Errors
    /// There is any.
    pub fn together(errors: Vec<Self>) -> Result<()> {
        let messages: Vec<&str> = errors.iter().map(|error| error.message.as_str()).collect();
        let text = messages.join("\n\n");
        errors.first().map_or(Ok(()), |first| Err(Self::new(first.cause, text)))
    }

    /// The same error with a line of context in front, as in `block.msh: line 12: ...`.
    #[must_use]
    pub fn within(mut self, context: &str) -> Self {
        self.message = format!("{context}: {}", self.message);
        self
    }

    /// The same error with a line that says what to do.
    #[must_use]
    pub fn hint(mut self, cure: &str) -> Self {
        self.message.push_str("\nhint: ");
        self.message.push_str(cure);
        self
    }

    /// What the user reads before the message: a run that stops as it was asked to is no error.
    pub fn label(&self) -> &'static str {
        if self.cause == Cause::Stopped { "stopped" } else { "error" }
    }

    /// Exit code of the process, see [`Cause`].
    pub fn exit_code(&self) -> i32 {
        self.cause as i32
    }
}

/// Makes the error of the lowest failing rank the error of all ranks. Collective.
///
/// # Errors
/// The same [`Error`] on every rank, when any rank brought one.
pub fn agree<T>(world: &impl CommunicatorCollectives, result: Result<T>) -> Result<T> {
    let mine = if result.is_err() { world.rank() } else { i32::MAX };
    let mut first = i32::MAX;
    world.all_reduce_into(&mine, &mut first, SystemOperation::min());
    if first == i32::MAX {
        return result;
    }
    let own = result.err();
    let root = world.process_at_rank(first);
    let speaks = own.as_ref().filter(|_| world.rank() == first);
    let mut head = [speaks.map_or(0, Error::exit_code), speaks.map_or(0, |e| e.message.len() as i32)];
    root.broadcast_into(&mut head);
    let mut text = speaks.map_or_else(|| vec![0u8; head[1] as usize], |e| e.message.clone().into_bytes());
    root.broadcast_into(&mut text);
    Err(Error::new(Cause::from_code(head[0]), String::from_utf8_lossy(&text)))
}
