//! The results folder: its location, when it may be replaced, and how files are written atomically.

use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::Duration;

use serde_json::{Value, json};

use super::io_error::{trouble, unwritable};
use super::lock::{LOCK, Lock};
use super::process;
use crate::error::{Error, Result};
use crate::files;

/// The value of `program` in `run.json` that identifies a results folder of this program.
pub const PROGRAM: &str = "contact-petsc";

/// The run record, which also marks a results folder.
pub const RECORD: &str = "run.json";

/// Files that a run may leave in its folder, apart from [`RECORD`]. Only these are removed when a
/// result is replaced.
const OWN: [&str; 21] = [
    "probes.csv",
    "contact.csv",
    "reactions.csv",
    "rigid.csv",
    "bodies.csv",
    "loads.csv",
    "derived.csv",
    "lines.csv",
    "energy.csv",
    "momentum.csv",
    "iterations.csv",
    "fields.pvd",
    "contact.pvd",
    "rigid.pvd",
    "fields.vtkhdf",
    "contact.vtkhdf",
    "rigid.vtkhdf",
    "fields",
    "figures",
    "checkpoints",
    "report.html",
];

/// Suffix of the name of a file until it is complete.
const PART: &str = ".part";

/// A folder that this program created.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ResultsFolder {
    path: PathBuf,
}

/// Default location of the results of a case, without `--output`: `results/<name>` in the working
/// directory. `name` is the folder of the case for a file called `case.yml`, and the stem of the
/// file for any other.
///
/// # Errors
/// The path names no file, or the working directory does not exist.
pub fn default_folder(case_file: &Path) -> Result<PathBuf> {
    let whole = std::path::absolute(case_file).map_err(|e| trouble(case_file, "resolve", &e))?;
    let whole = whole.canonicalize().unwrap_or(whole);
    let stem = whole.file_stem();
    let folder = whole.parent().and_then(Path::file_name);
    let name = if stem.is_some_and(|s| s == "case") { folder.or(stem) } else { stem };
    let name =
        name.ok_or_else(|| Error::file(format!("{}: not the name of a case file", case_file.display())))?;
    Ok(Path::new("results").join(name))
}

impl ResultsFolder {
    /// Creates the folder, or empties one that an earlier run created. Rank 0 only.
    ///
    /// Afterwards a `run.json` with the verdict `running` marks it as a results folder, and the
    /// lock excludes other runs. Files that no run of this program writes are kept.
    ///
    /// # Errors
    /// The folder holds something that this program did not create, another run writes into it, or
    /// it can not be written.
    pub fn create(path: &Path) -> Result<(Self, Lock)> {
        let folder = Self { path: path.to_path_buf() };
        if is_occupied(path)? && !is_ours(path) {
            return Err(Error::file(format!(
                "{}: not empty and not a results folder of {PROGRAM}; nothing was changed",
                path.display()
            ))
            .hint("choose another folder with --output, or empty this folder"));
        }
        fs::create_dir_all(path).map_err(|e| unwritable(path, &e))?;
        let lock = Lock::take(path)?;
        let marker = json!({ "program": PROGRAM, "verdict": "running", "process": process::own() });
        write_whole(&folder.join(RECORD), format!("{marker:#}\n").as_bytes())?;
        OWN.iter().try_for_each(|name| remove(&folder.join(name)))?;
        Ok((folder, lock))
    }

    /// Empties a folder whose `run.json` is damaged or missing, if it holds only files that a run
    /// leaves. Returns whether there was such a folder. Use it for folders whose parent folder
    /// identifies them as created by this program.
    ///
    /// # Errors
    /// It can not be read or written.
    pub fn reclaim(path: &Path) -> Result<bool> {
        if !is_occupied(path)? || is_ours(path) {
            return Ok(false);
        }
        let entries = fs::read_dir(path).map_err(|e| trouble(path, "read", &e))?;
        let mut names = Vec::new();
        for entry in entries {
            names.push(entry.map_err(|e| trouble(path, "read", &e))?.file_name());
        }
        let is_known = |name: &std::ffi::OsString| {
            let name = name.to_str().unwrap_or_default();
            let name = name.strip_suffix(PART).unwrap_or(name);
            OWN.contains(&name) || [RECORD, LOCK].contains(&name)
        };
        // A readable record belongs to another program.
        let is_foreign = !record(path).is_null();
        if is_foreign || !names.iter().all(is_known) {
            return Ok(false);
        }
        let _lock = Lock::take(path)?;
        names.iter().filter(|name| *name != LOCK).try_for_each(|name| remove(&path.join(name)))?;
        Ok(true)
    }

    /// Opens a folder that a run created, to plot it or to resume the run.
    ///
    /// # Errors
    /// The folder does not exist, or holds no `run.json` of this program.
    pub fn open(path: &Path) -> Result<Self> {
        let cure = "give the results folder of a run, for example `contact-petsc plot results/rubber-block`";
        Self::find(path).map_err(|error| error.hint(cure))
    }

    /// Opens a folder like [`open`](Self::open), for callers that give their own hint.
    ///
    /// # Errors
    /// The folder does not exist, or holds no `run.json` of this program. The error has no hint.
    pub fn find(path: &Path) -> Result<Self> {
        if !path.is_dir() {
            return Err(Error::file(format!("{}: no such folder", path.display())));
        }
        if !is_ours(path) {
            let text = format!("{}: not a results folder: it has no {RECORD} of {PROGRAM}", path.display());
            return Err(Error::file(text));
        }
        Ok(Self { path: path.to_path_buf() })
    }

    /// Whether the path does not exist or is an empty folder, so that results can be written there.
    pub fn is_free(path: &Path) -> bool {
        matches!(is_occupied(path), Ok(false))
    }

    /// The folder itself.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A file in the folder.
    pub fn join(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }
}

/// Writes a file so that a reader sees either the old or the new content. It writes a temporary
/// file and renames it.
///
/// # Errors
/// The file system reports an error.
pub fn write_whole(path: &Path, content: &[u8]) -> Result<()> {
    write_whole_with(path, |file| file.write_all(content))
}

/// Writes a file like [`write_whole`], with the content streamed by `fill`. No file is left behind
/// when `fill` fails.
///
/// # Errors
/// The file system or `fill` reports an error.
pub fn write_whole_with<F>(path: &Path, fill: F) -> Result<()>
where
    F: FnOnce(&mut std::io::BufWriter<fs::File>) -> std::io::Result<()>,
{
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(PART);
    let part = path.with_file_name(name);
    let written = fs::File::create(&part).and_then(|file| {
        let mut file = std::io::BufWriter::new(file);
        fill(&mut file)?;
        file.flush()
    });
    written.and_then(|()| rename_patiently(|| fs::rename(&part, path))).map_err(|e| {
        let _ = fs::remove_file(&part);
        unwritable(path, &e)
    })
}

/// Number of attempts to rename a file over one that another process has open.
///
/// With [`PAUSE`] between them they last two seconds, far longer than a reader has a small file
/// open. With half of it a slow file server is more likely to end a run. With twice of it a
/// permanent refusal is reported two seconds later.
const TRIES: u32 = 20;

/// Time between two attempts to rename a file.
const PAUSE: Duration = Duration::from_millis(100);

/// Renames a file, and repeats the attempt while it fails for a reason that may be temporary.
///
/// Network file systems such as SMB refuse to rename over a file while a reader has it open. The
/// error code, one of those below, depends on the server. On a local disk the first attempt
/// decides.
///
/// # Errors
/// The error of the last attempt, or the first error of another kind.
fn rename_patiently(mut rename: impl FnMut() -> std::io::Result<()>) -> std::io::Result<()> {
    let is_passing = |kind: ErrorKind| {
        matches!(
            kind,
            ErrorKind::PermissionDenied
                | ErrorKind::ResourceBusy
                | ErrorKind::ExecutableFileBusy
                | ErrorKind::AlreadyExists
        )
    };
    for _ in 1..TRIES {
        match rename() {
            Err(e) if is_passing(e.kind()) => sleep(PAUSE),
            done => return done,
        }
    }
    rename()
}

fn is_occupied(path: &Path) -> Result<bool> {
    match fs::read_dir(path) {
        Ok(mut entries) => Ok(entries.any(|entry| entry.is_ok_and(|entry| entry.file_name() != LOCK))),
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(false),
        Err(e) if e.kind() == ErrorKind::NotADirectory => {
            Err(Error::file(format!("{}: a file, not a folder", path.display()))
                .hint("choose another folder with --output"))
        }
        Err(e) => Err(trouble(path, "read", &e)),
    }
}

fn is_ours(path: &Path) -> bool {
    record(path).get("program").is_some_and(|program| program == PROGRAM)
}

/// The content of `run.json` in a folder; null if the file is missing or damaged.
pub fn record(folder: &Path) -> Value {
    json_of(&folder.join(RECORD))
}

/// The content of a JSON file; null if the file is missing or damaged.
pub fn json_of(path: &Path) -> Value {
    let text = files::read_text(path, files::LONGEST_RECORD).unwrap_or_default();
    serde_json::from_str(&text).unwrap_or_default()
}

fn remove(path: &Path) -> Result<()> {
    let removed = match fs::symlink_metadata(path) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(()),
        Err(e) => Err(e),
        Ok(found) if found.is_dir() => fs::remove_dir_all(path),
        Ok(_) => fs::remove_file(path),
    };
    removed.map_err(|e| unwritable(path, &e))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::error::Cause;

    /// A separate empty folder for each test, removed when the test ends.
    pub(crate) struct Scratch(pub PathBuf);

    impl Scratch {
        pub(crate) fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("contact-petsc-{}-{name}", std::process::id()));
            let _ = fs::remove_dir_all(&path);
            fs::create_dir_all(&path).unwrap();
            Self(path)
        }
    }

    impl Drop for Scratch {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    /// The folder's name comes from the case's folder for `case.yml`, and from the stem for any
    /// other file.
    #[test]
    fn names_the_folder_after_the_case() {
        assert_eq!(
            default_folder(Path::new("meshes/rubber-block/case.yml")).unwrap(),
            Path::new("results/rubber-block")
        );
        assert_eq!(
            default_folder(Path::new("meshes/rubber-block/power-law-2.yml")).unwrap(),
            Path::new("results/power-law-2")
        );
        let here = std::env::current_dir().unwrap();
        assert_eq!(
            default_folder(Path::new("case.yml")).unwrap(),
            Path::new("results").join(here.file_name().unwrap())
        );
        assert_eq!(default_folder(Path::new("/case.yml")).unwrap(), Path::new("results/case"));
    }

    /// A result of this program is replaced and its stale files are removed. Files that a user
    /// added are kept.
    #[test]
    fn replaces_its_own_results_only() {
        let scratch = Scratch::new("replace");
        let path = scratch.0.join("deep/results");
        ResultsFolder::create(&path).unwrap();
        fs::write(path.join("energy.csv"), "old").unwrap();
        fs::write(path.join("lines.csv"), "old").unwrap();
        fs::write(path.join("notes.txt"), "mine").unwrap();
        fs::create_dir_all(path.join("fields/step_000001")).unwrap();
        fs::write(path.join(RECORD), r#"{"program": "contact-petsc", "verdict": "completed"}"#).unwrap();
        let (folder, _lock) = ResultsFolder::create(&path).unwrap();
        assert!(!folder.join("lines.csv").exists());
        assert!(!folder.join("energy.csv").exists() && !folder.join("fields").exists());
        assert_eq!(fs::read_to_string(folder.join("notes.txt")).unwrap(), "mine");
        assert!(fs::read_to_string(folder.join(RECORD)).unwrap().contains("running"));
        assert_eq!(ResultsFolder::open(&path).unwrap(), folder);
    }

    /// A folder whose record is damaged or missing is emptied if it holds only files of this
    /// program. A foreign file, or a record of another program, keeps it unchanged.
    #[test]
    fn reclaims_what_lost_its_record() {
        let scratch = Scratch::new("reclaim");
        let path = scratch.0.join("member");
        drop(ResultsFolder::create(&path).unwrap());
        assert!(!ResultsFolder::reclaim(&path).unwrap(), "whole");
        fs::write(path.join("energy.csv"), "ours").unwrap();
        fs::write(path.join(RECORD), r#"{"program": "another"}"#).unwrap();
        assert!(!ResultsFolder::reclaim(&path).unwrap(), "of another program");
        fs::write(path.join(RECORD), "{ \"program\": \"contact-p").unwrap();
        fs::write(path.join("notes.txt"), "mine").unwrap();
        assert!(!ResultsFolder::reclaim(&path).unwrap() && path.join("energy.csv").exists(), "foreign files");
        fs::remove_file(path.join("notes.txt")).unwrap();
        assert!(ResultsFolder::reclaim(&path).unwrap() && ResultsFolder::is_free(&path));
        assert!(
            !ResultsFolder::reclaim(&path).unwrap() && !ResultsFolder::reclaim(&path.join("no")).unwrap()
        );
    }

    /// A rename that is refused while a reader has the file open is repeated; one that fails
    /// permanently is not.
    #[test]
    fn renames_are_repeated() {
        let mut calls = 0;
        let mut rename = |kind: ErrorKind, busy: u32| {
            calls = 0;
            let outcome = rename_patiently(|| {
                calls += 1;
                if calls <= busy { Err(kind.into()) } else { Ok(()) }
            });
            (outcome.is_ok(), calls)
        };
        assert_eq!(rename(ErrorKind::ResourceBusy, 2), (true, 3));
        assert_eq!(rename(ErrorKind::StorageFull, 2), (false, 1));
    }

    /// A foreign folder is refused and left untouched; an empty one is accepted.
    #[test]
    fn refuses_foreign_folders() {
        let scratch = Scratch::new("foreign");
        for record in [None, Some(r#"{"program": "another"}"#), Some("{ not json")] {
            fs::write(scratch.0.join("energy.csv"), "theirs").unwrap();
            if let Some(record) = record {
                fs::write(scratch.0.join(RECORD), record).unwrap();
            }
            let error = ResultsFolder::create(&scratch.0).unwrap_err();
            assert_eq!(error.cause, Cause::File);
            assert!(error.message.contains("not a results folder of contact-petsc"), "{error}");
            assert_eq!(fs::read_to_string(scratch.0.join("energy.csv")).unwrap(), "theirs");
            assert_eq!(ResultsFolder::open(&scratch.0).unwrap_err().cause, Cause::File);
        }
        let empty = Scratch::new("empty");
        assert!(ResultsFolder::create(&empty.0).is_ok());
    }

    /// A file that blocks the path is an error of cause `File`, whether it is at the folder itself
    /// or at a part of its path.
    #[test]
    fn names_a_file_in_the_way() {
        let scratch = Scratch::new("in-the-way");
        fs::write(scratch.0.join("file"), "").unwrap();
        for path in ["file", "file/below"] {
            let error = ResultsFolder::create(&scratch.0.join(path)).unwrap_err();
            assert_eq!(error.cause, Cause::File);
            assert!(error.message.contains("file") && error.message.contains("hint: "), "{error}");
        }
        assert_eq!(ResultsFolder::open(&scratch.0.join("absent")).unwrap_err().cause, Cause::File);
        let error = ResultsFolder::create(Path::new("/proc/contact-petsc-results")).unwrap_err();
        assert!(error.cause == Cause::File && error.message.contains("can not write"), "{error}");
    }

    /// When filling fails, the old content stays and no temporary file is left.
    #[test]
    fn a_failed_write_changes_nothing() {
        let scratch = Scratch::new("atomic");
        let path = scratch.0.join("a.txt");
        write_whole(&path, b"first").unwrap();
        let result = write_whole_with(&path, |file| {
            file.write_all(b"second, cut sho")?;
            Err(std::io::Error::other("disk gone"))
        });
        assert!(result.unwrap_err().message.contains("disk gone"));
        assert_eq!(fs::read_to_string(&path).unwrap(), "first");
        assert_eq!(fs::read_dir(&scratch.0).unwrap().count(), 1);
    }
}
