//! Output of a run: CSV tables, ParaView files, the run record, and the console.
//!
//! The writers take plain data that is already reduced over the ranks; they do not depend on the
//! solver. Rank 0 writes the tables, the indices and the record. Every rank writes its own piece of
//! the fields, and rank 0 the surfaces of rigid bodies.
//!
//! | File | Written by | When it is complete |
//! |---|---|---|
//! | `*.csv` | [`table::Table`], with the columns of [`crate::observe`] and [`iterations`] | after each row: a row is one write |
//! | `fields/step_*/` | [`fields::FieldWriter`] | each file appears by renaming |
//! | `fields.pvd`, `contact.pvd`, `rigid.pvd` | [`pvd::PvdSeries`] | rewritten by renaming, names only steps that exist |
//! | `fields.vtkhdf`, `contact.vtkhdf`, `rigid.vtkhdf` | [`vtkhdf::OneFileWriter`], all ranks together | after each step, which is counted last |
//! | `run.json` | [`record::Record`] | rewritten by renaming; `running` until the end, with the [process] that writes it; at the end with rows and hashes of the tables |
//! | `run.lock` | [`lock::Lock`] | present while a run writes into the folder |

pub mod accuracy;
pub mod anchor;
pub mod console;
pub mod fields;
pub mod folder;
pub mod grids;
pub mod io_error;
pub mod iterations;
pub mod lock;
pub mod pace;
pub mod process;
pub mod pvd;
pub mod pvtu;
pub mod record;
pub mod reference;
mod selection;
pub mod summary;
pub mod table;
pub mod timestamp;
pub mod vtkhdf;
pub mod vtu;
pub mod vtu_reader;
pub mod xml;
