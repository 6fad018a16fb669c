//! The command `contact-petsc`: reads the command line, does what it says, prints the cause where it fails.

use std::io::Write as _;
use std::process::ExitCode;

use contact_petsc::{cli, commands, petsc};

fn main() -> ExitCode {
    let versions = petsc::versions().map(|(name, version)| format!("{name} {version}")).join("\n");
    let done = cli::parse(std::env::args_os(), &versions).and_then(commands::execute);
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // What was told already has no words left.
            if commands::speaks() && !error.message.is_empty() {
                // A reader that went away is no reason to panic.
                let _ = writeln!(std::io::stderr(), "contact-petsc: {}: {error}", error.label());
            }
            ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(70))
        }
    }
}
