//! The writer of fields in the format of the case.

use mpi::topology::SimpleCommunicator;
use mpi::traits::Communicator;

use crate::case::{Case, FieldFormat};
use crate::error::{Result, agree};
use crate::output::fields::FieldWriter;
use crate::output::grids::GridFields;
use crate::output::vtkhdf::{FIELDS_FILE, OneFileWriter};
use crate::petsc::require_hdf5;
use crate::reader::complaint::Complaint;

/// A rank's writer of fields, in the format of the case.
pub(super) enum FieldOutput<const D: usize> {
    /// A file per rank, grid and output.
    Pieces(FieldWriter<D>),
    /// A file per grid.
    OneFile(OneFileWriter<D>),
}

impl<const D: usize> FieldOutput<D> {
    /// Number of steps whose fields the folder has; on rank 0 only.
    pub(super) fn steps(&self) -> u64 {
        match self {
            Self::Pieces(writer) => writer.steps(),
            Self::OneFile(writer) => writer.steps(),
        }
    }

    /// The file that lists the steps.
    pub(super) fn file(&self) -> &'static str {
        match self {
            Self::Pieces(_) => "fields.pvd",
            Self::OneFile(_) => FIELDS_FILE,
        }
    }

    /// Number of written steps that have disappeared. Rank 0 only.
    ///
    /// # Errors
    /// The disk can not be written.
    pub(super) fn drop_lost(&mut self) -> Result<u64> {
        match self {
            Self::Pieces(writer) => writer.drop_lost(),
            Self::OneFile(writer) => Ok(writer.lost()),
        }
    }

    /// Continues the fields of an earlier run from a checkpoint at `step` and `time` \[s\]. Collective.
    ///
    /// # Errors
    /// A file can not be read or changed; the error is the same on all ranks.
    pub(super) fn resume(&mut self, world: &SimpleCommunicator, step: u64, time: f64) -> Result<()> {
        match self {
            Self::Pieces(writer) => {
                let own = if world.rank() == 0 { writer.resume(step, time) } else { Ok(()) };
                agree(world, own)
            }
            Self::OneFile(writer) => writer.resume(world, time),
        }
    }

    /// Adds the fields of a step. Collective.
    ///
    /// # Errors
    /// A file can not be written; the error is the same on all ranks.
    pub(super) fn write(
        &mut self,
        world: &SimpleCommunicator,
        step: u64,
        time: f64,
        fields: &GridFields,
    ) -> Result<()> {
        match self {
            Self::Pieces(writer) => {
                agree(world, writer.write(step, fields))?;
                let own = if world.rank() == 0 { writer.publish(step, time) } else { Ok(()) };
                agree(world, own)
            }
            Self::OneFile(writer) => writer.write(world, time, fields),
        }
    }
}

/// Checks that the libraries of this machine can write the format of the case.
///
/// # Errors
/// They can not. The message has the position in the case and names the package.
pub fn require_format(case: &Case) -> Result<()> {
    let fields = &case.output.fields;
    if fields.every.value == 0 || fields.format.value == FieldFormat::Vtu {
        return Ok(());
    }
    require_hdf5().map_err(|error| {
        let (reason, cure) = error.message.split_once("\nhint: ").unwrap_or((&error.message, ""));
        case.complain(&Complaint::new(reason.to_owned()).hint(cure).at(fields.format.place))
    })
}
