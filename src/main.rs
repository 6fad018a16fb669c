//! The command `contact-petsc`.
use contact_petsc::{case::Case, petsc::Session, simulation, output::console::Verbosity};
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let split = args.iter().position(|a| a == "--").unwrap_or(args.len());
    let petsc: Vec<String> = args[(split + 1).min(args.len())..].to_vec();
    let file = std::path::PathBuf::from(&args[0]);
    let session = Session::start(&petsc).unwrap();
    let code = (|| {
        let case = Case::read(&file)?;
        let folder = args[..split].iter().position(|a| a == "--output").map(|i| args[i + 1].clone().into()).map_or_else(|| contact_petsc::output::folder::default_folder(&file), Ok)?;
        let verbosity = if args[..split].iter().any(|a| a == "-v") { Verbosity::Verbose } else { Verbosity::Normal };
        let place = simulation::Place { case_file: file.clone(), folder, verbosity };
        if case.dimension.value == 2 { simulation::run::<2>(&session, &case, &place) } else { simulation::run::<3>(&session, &case, &place) }
    })();
    if let Err(e) = code {
        if session.rank() == 0 { eprintln!("contact-petsc: error: {e}"); }
        let c = e.exit_code(); drop(session); std::process::exit(c);
    }
}
