//! The command `contact-petsc`: reads the command line, does what it says, prints the cause where it fails.

use std::io::Write as _;
use std::process::ExitCode;

use contact_petsc::{cli, commands, petsc, rounding};

/// Time by which rank 0 ends before the other ranks in failure, on a machine that is busy with other work as well; they are killed earlier
/// where `mpirun` sees to it.
const HEAD_START: std::time::Duration = std::time::Duration::from_millis(500);

fn main() -> ExitCode {
    petsc::outlive_file_limits();
    let versions = petsc::versions().map(|(name, version)| format!("{name} {version}")).join("\n");
    let done = rounding::check()
        .and_then(|()| cli::parse(std::env::args_os(), &versions))
        .and_then(commands::execute);
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // What was told already has no words left.
            if commands::speaks() && !error.message.is_empty() {
                // A reader that went away is no reason to panic.
                let _ = writeln!(std::io::stderr(), "contact-petsc: {}: {error}", error.label());
            }
            if !commands::speaks() {
                // `mpirun` kills all ranks when the first has failed, and no longer knows what rank 0 said a moment before: let that be rank 0.
                std::thread::sleep(HEAD_START);
            }
            ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(70))
        }
    }
}
