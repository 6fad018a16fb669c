//! Studies: a case, the parameters that vary, and the quantities of interest. Every member is run,
//! its error is compared with its cost, and a sentence says which member to use for which accuracy.
//!
//! | File | What it holds |
//! |---|---|
//! | [`mod@file`] | `study.yml` as written |
//! | [`plan`] | its members: cases with keys changed by their paths, all read before the first is run |
//! | [`mod@run`] | runs the members one after the other on all ranks; finished members are skipped |
//! | [`row`], [`series`] | values and errors from the tables of a member |
//! | [`front`], [`advice`], [`figures`], [`table`], [`folder`] | results of the study and the files that hold them |

pub mod advice;
mod columns;
pub mod figures;
pub mod file;
pub mod folder;
pub mod front;
pub mod plan;
pub mod row;
pub mod run;
pub mod series;
pub mod table;

pub use file::Study;
pub use folder::default_place;
pub use run::{Planned, StudyOptions, run};

/// The JSON schema (draft-07) of a study file.
pub fn schema() -> serde_json::Value {
    crate::reader::schema::schema_of::<Study>()
}

#[cfg(test)]
mod tests;
