//! The checkpoints of a results folder: their names, which are kept, and from which one a run
//! resumes.

use std::path::{Path, PathBuf};

use super::file::{Header, verify};
use crate::error::{Error, Result};

/// The folder of the checkpoints of one run. Rank 0 only.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Store {
    folder: PathBuf,
}

/// A checkpoint that was verified.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundCheckpoint {
    /// The file.
    pub path: PathBuf,
    /// Its header.
    pub header: Header,
}

impl Store {
    /// Name of the folder in a results folder.
    pub const FOLDER: &str = "checkpoints";

    /// The checkpoints of a results folder.
    pub fn of(results: &Path) -> Self {
        Self { folder: results.join(Self::FOLDER) }
    }

    /// The file of a step.
    pub fn path(&self, step: u64) -> PathBuf {
        self.folder.join(format!("step-{step:06}.ckpt"))
    }

    /// Steps and files, the newest first.
    pub fn list(&self) -> Vec<(u64, PathBuf)> {
        let entries = std::fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let mut found: Vec<(u64, PathBuf)> =
            entries.filter_map(|entry| Some((step_of(&entry.path())?, entry.path()))).collect();
        found.sort_unstable_by(|a, b| b.cmp(a));
        found
    }

    /// Removes all checkpoints except the last `keep` up to `step`, which is already on the disk.
    /// Later checkpoints are also removed: they belong to a run that was abandoned by a restart
    /// from an older one. So are incomplete files of a killed run. A file that can not be removed
    /// is kept.
    pub fn prune(&self, step: u64, keep: usize) {
        let all = self.list();
        let later = all.iter().filter(|(other, _)| *other > step);
        let older = all.iter().filter(|(other, _)| *other <= step).skip(keep.max(1));
        later.chain(older).for_each(|(_, path)| drop(std::fs::remove_file(path)));
        let entries = std::fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let parts = entries.filter(|entry| entry.path().extension().is_some_and(|end| end == "part"));
        parts.for_each(|entry| drop(std::fs::remove_file(entry.path())));
    }

    /// The checkpoint from which to resume: `asked`, or the newest. `again` creates the command
    /// that resumes from another one.
    ///
    /// # Errors
    /// There is no checkpoint, or it is damaged. The error then suggests an intact one: the last
    /// one before it, or else the first one after it.
    pub fn find(&self, asked: Option<&Path>, again: impl Fn(&Path) -> String) -> Result<FoundCheckpoint> {
        let all = self.list();
        let newest = all.first().map(|(_, path)| path.clone());
        let Some(path) = asked.map(|path| self.resolve(path)).or(newest) else {
            let text = format!("{}: there is no checkpoint to resume from", self.folder.display());
            return Err(Error::file(text).hint(
                "start again without --restart; to write checkpoints, set output: { checkpoint: { every: \
                 100 } }",
            ));
        };
        let broken = match verify(&path) {
            Ok(header) => return Ok(FoundCheckpoint { path, header }),
            Err(error) => error,
        };
        let wanted = step_of(&path);
        let is_later = |step: u64| wanted.is_some_and(|wanted| step > wanted);
        let (later, earlier): (Vec<_>, Vec<_>) =
            all.iter().filter(|(_, other)| *other != path).partition(|(step, _)| is_later(*step));
        let mut others = earlier.into_iter().chain(later.into_iter().rev());
        Err(match others.find(|(_, other)| verify(other).is_ok()) {
            Some((step, other)) => {
                let which = match wanted {
                    Some(_) if is_later(*step) => "the later",
                    Some(_) => "the earlier",
                    None => "the",
                };
                broken.hint(&format!(
                    "{which} checkpoint of step {step} is intact; resume from it with\n  {}",
                    again(other)
                ))
            }
            None => broken.hint("no other checkpoint is intact; start again without --restart"),
        })
    }

    /// Resolves a path as the user gave it, or a file name in this folder.
    fn resolve(&self, path: &Path) -> PathBuf {
        let here = path.file_name().map(|name| self.folder.join(name)).filter(|here| here.exists());
        if path.exists() { path.to_path_buf() } else { here.unwrap_or_else(|| path.to_path_buf()) }
    }
}

/// The step in the name of a checkpoint; `None` for any other name.
fn step_of(path: &Path) -> Option<u64> {
    path.file_name()?.to_str()?.strip_prefix("step-")?.strip_suffix(".ckpt")?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The requested number of checkpoints up to the last step is kept. Later ones and incomplete
    /// files are removed.
    #[test]
    fn keeps_the_last_ones() {
        let results = std::env::temp_dir().join(format!("contact-petsc-{}-store", std::process::id()));
        let store = Store::of(&results);
        std::fs::create_dir_all(results.join(Store::FOLDER)).unwrap();
        for step in [5, 10, 15, 1_000_000, 20] {
            std::fs::write(store.path(step), "").unwrap();
        }
        let foreign = results.join(Store::FOLDER).join("notes.txt");
        std::fs::write(&foreign, "mine").unwrap();
        std::fs::write(store.path(25).with_extension("part"), "half").unwrap();
        let steps = || store.list().into_iter().map(|(step, _)| step).collect::<Vec<_>>();
        assert_eq!(steps(), [1_000_000, 20, 15, 10, 5]);
        store.prune(20, 2);
        assert_eq!(steps(), [20, 15]);
        assert!(foreign.exists() && !store.path(25).with_extension("part").exists());
        let error = store.find(None, |path| format!("again {}", path.display())).unwrap_err();
        assert!(error.message.contains("step-000020.ckpt: truncated"), "{error}");
        assert!(error.message.contains("no other checkpoint"), "{error}");
        std::fs::remove_dir_all(&results).unwrap();
        assert!(
            store.find(None, |_| String::new()).unwrap_err().message.contains("no checkpoint to resume from")
        );
    }
}
