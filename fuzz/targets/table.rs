//! Any bytes are a table of results or an error with a line, and rows of numbers are a function of time or an error.
#![no_main]

use std::path::Path;

use contact_petsc::case::Function;
use contact_petsc::plot::Csv;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    contact_petsc_fuzz::watch();
    let Ok(Some(csv)) = Csv::parse(Path::new("a.csv"), bytes) else { return };
    let columns: Vec<Vec<f64>> =
        csv.columns().iter().filter_map(|column| csv.numbers(column).ok().flatten()).collect();
    for column in csv.columns() {
        csv.words(column).expect("a column that is named is there");
    }
    let [times, values, ..] = &columns[..] else { return };
    let rows: Vec<[f64; 2]> = times.iter().zip(values).map(|(t, v)| [*t, *v]).collect();
    let times = times.clone();
    let Ok(function) = Function::table(rows) else { return };
    for t in times.iter().flat_map(|t| [*t, t.next_up(), t.next_down()]).chain([f64::NAN, f64::INFINITY, 0.0]) {
        function.motion([0.0; 3], t);
    }
});
