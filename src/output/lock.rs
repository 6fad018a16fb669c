//! Ensures that one process writes into a folder, even if several hosts share it.
//!
//! The file `run.lock` is locked by the operating system. On one host this suffices, because the
//! system frees the lock of a process that died. Some file systems have no locks between hosts.
//! Therefore the owner changes the file every two seconds. A run that finds the file of another
//! host waits long enough to see whether it changes.

use std::fs::{File, OpenOptions, TryLockError, read_to_string};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex};
use std::thread::{Builder, JoinHandle, sleep};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use serde_json::{Value, json};

use crate::error::{Error, Result};
use crate::files;

use super::anchor::is_same;
use super::io_error::{trouble, unwritable};
use super::process::host;

/// Name of the file in the folder.
pub const LOCK: &str = "run.lock";

/// Interval at which the file changes. Half of it doubles the writes on a shared file system. Twice
/// of it doubles the time for which a run waits in the folder of a run that was killed on another
/// host.
const BEAT: Duration = Duration::from_secs(2);

/// Time after which an unchanged file belongs to a dead run. It allows for a host that caches its
/// reads, and for a busy one that misses a beat.
const SILENCE: Duration = Duration::from_secs(7);

/// Time that a run that is being killed may take to end.
const PATIENCE: Duration = Duration::from_secs(1);

/// A folder into which only this process writes, until the lock is dropped.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    file: Arc<File>,
    token: String,
    /// Set when another run has taken the folder.
    lost: Arc<AtomicBool>,
    stop: Arc<(Mutex<bool>, Condvar)>,
    heart: Option<JoinHandle<()>>,
}

impl Lock {
    /// Locks an existing folder. Rank 0 only.
    ///
    /// # Errors
    /// Another run writes into it, or the file can not be written.
    pub fn take(folder: &Path) -> Result<Self> {
        Self::take_within(folder, [PATIENCE, SILENCE])
    }

    fn take_within(folder: &Path, [patience, silence]: [Duration; 2]) -> Result<Self> {
        let path = folder.join(LOCK);
        let deadline = Instant::now() + patience;
        loop {
            let open = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
            let file = open.map_err(|e| unwritable(&path, &e))?;
            let before = content(&path);
            let is_locked = match file.try_lock() {
                Ok(()) => true,
                Err(TryLockError::WouldBlock) if Instant::now() < deadline => {
                    sleep(Duration::from_millis(50));
                    continue;
                }
                Err(TryLockError::WouldBlock) => return Err(in_use(folder, &before)),
                // The file system does not support locks.
                Err(TryLockError::Error(_)) => false,
            };
            // Its last owner may have removed it in the meantime.
            if !is_same(&file, &path).map_err(|e| trouble(&path, "find", &e))? {
                continue;
            }
            let is_elsewhere = || owner(&before)["kernel"] != kernel();
            if !before.trim().is_empty() && (!is_locked || is_elsewhere()) && beats(&path, &before, silence) {
                return Err(in_use(folder, &before));
            }
            return Self::own(path, file);
        }
    }

    fn own(path: PathBuf, file: File) -> Result<Self> {
        // The clock may be set back, so the boot identifier and the process number also distinguish
        // runs.
        let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos());
        let token = format!("{}-{}-{now}", kernel(), std::process::id());
        let written = file.set_len(0).and_then(|()| file.write_all_at(text(&token, 0).as_bytes(), 0));
        written.map_err(|e| unwritable(&path, &e))?;
        let mut lock = Self {
            path,
            file: Arc::new(file),
            token,
            lost: Arc::default(),
            stop: Arc::default(),
            heart: None,
        };
        let path = lock.path.clone();
        let file = Arc::clone(&lock.file);
        let token = lock.token.clone();
        let (lost, stop) = (Arc::clone(&lock.lost), Arc::clone(&lock.stop));
        let beat = move || {
            let (mutex, bell) = &*stop;
            for count in 1u64.. {
                let Ok(stopped) = mutex.lock() else { return };
                let Ok((stopped, _)) = bell.wait_timeout_while(stopped, BEAT, |stopped| !*stopped) else {
                    return;
                };
                if *stopped {
                    return;
                }
                drop(stopped);
                if owner(&content(&path))["token"].as_str().is_some_and(|found| found != token) {
                    lost.store(true, Ordering::Relaxed);
                    return;
                }
                // A write that fails is repeated at the next beat.
                let _ = file.write_all_at(text(&token, count).as_bytes(), 0).and_then(|()| file.sync_data());
            }
        };
        let heart = Builder::new().name("lock".into()).spawn(beat).map_err(|e| {
            Error::internal(format!(
                "{}: the thread that keeps this lock can not be started: {e}",
                lock.path.display()
            ))
            .hint("raise the limits on processes (`ulimit -u`) and on address space (`ulimit -v`)")
        })?;
        lock.heart = Some(heart);
        Ok(lock)
    }

    /// The identifier of this run in the folder, by which other ranks recognise it.
    pub fn token(&self) -> &str {
        &self.token
    }

    /// Checks that this run still holds the folder.
    ///
    /// # Errors
    /// Another run has taken it.
    pub fn check(&self) -> Result<()> {
        match self.lost.load(Ordering::Relaxed) {
            true => Err(in_use(self.path.parent().unwrap_or(&self.path), &content(&self.path))),
            false => Ok(()),
        }
    }

    /// The token of the run that writes into a folder; empty if there is no such run.
    pub fn token_of(folder: &Path) -> String {
        owner(&content(&folder.join(LOCK)))["token"].as_str().unwrap_or_default().to_owned()
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        if let Ok(mut stopped) = self.stop.0.lock() {
            *stopped = true;
            self.stop.1.notify_all();
        }
        self.heart.take().map(JoinHandle::join);
        if is_same(&self.file, &self.path).unwrap_or(false)
            && owner(&content(&self.path))["token"] == *self.token
        {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// The content of the file. It has the same length at every beat, so that no reader sees an
/// incomplete text.
fn text(token: &str, beat: u64) -> String {
    let owner = json!({ "token": token, "kernel": kernel(), "host": host(), "process": std::process::id() });
    let beat = format!("{beat:020}");
    format!("{}\n", json!({ "owner": owner, "beat": beat }))
}

fn content(path: &Path) -> String {
    files::read_text(path, files::LONGEST_RECORD).unwrap_or_default()
}

fn owner(content: &str) -> Value {
    let whole: Value = serde_json::from_str(content).unwrap_or_default();
    whole["owner"].clone()
}

/// Whether the file changes within the interval in which a live run changes it.
fn beats(path: &Path, before: &str, silence: Duration) -> bool {
    let deadline = Instant::now() + silence;
    while Instant::now() < deadline {
        sleep(silence / 20);
        if content(path) != before {
            return true;
        }
    }
    false
}

/// An identifier of this boot of the operating system. Unlike the name of a host, it is unique.
fn kernel() -> String {
    let id = read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default();
    if id.trim().is_empty() { host() } else { id.trim().to_owned() }
}

fn in_use(folder: &Path, content: &str) -> Error {
    let owner = owner(content);
    let who = match (owner["process"].as_u64(), owner["host"].as_str()) {
        (Some(id), Some(host)) => format!("process {id} on {host}"),
        _ => "an unknown process".to_owned(),
    };
    Error::file(format!(
        "{}: another run is writing to this folder, {who}; nothing was changed",
        folder.display()
    ))
    .hint("wait until it has ended, or choose another folder with --output")
}

#[cfg(test)]
mod tests {
    use super::super::folder::tests::Scratch;
    use super::*;

    const SOON: [Duration; 2] = [Duration::from_millis(60), Duration::from_millis(400)];

    /// The content that another host would have left.
    fn foreign(beat: u64) -> String {
        format!(
            "{{\"owner\":{{\"token\":\"t\",\"kernel\":\"k\",\"host\":\"h\",\"process\":1}},\"beat\":{beat}}}"
        )
    }

    /// A second writer is refused with the process number of the first. It is accepted when the
    /// first has ended, which removes the file.
    #[test]
    fn one_writer_at_a_time() {
        let scratch = Scratch::new("lock");
        let first = Lock::take_within(&scratch.0, SOON).unwrap();
        let refused = Lock::take_within(&scratch.0, SOON).unwrap_err();
        assert!(refused.message.contains(&format!("process {}", std::process::id())), "{refused}");
        assert_eq!(Lock::token_of(&scratch.0), first.token());
        first.check().unwrap();
        drop(first);
        assert!(!scratch.0.join(LOCK).exists());
        drop(Lock::take_within(&scratch.0, SOON).unwrap());
    }

    /// A file that another host keeps changing is respected although the system grants its lock. An
    /// unchanged one belongs to a dead run. Damaged files and those of dead processes of this host
    /// are replaced.
    #[test]
    fn a_run_of_another_host_is_known_by_its_beats() {
        let scratch = Scratch::new("lock-beats");
        let path = scratch.0.join(LOCK);
        std::fs::write(&path, foreign(0)).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let other = std::thread::spawn({
            let path = path.clone();
            let stop = Arc::clone(&stop);
            move || {
                for beat in 1.. {
                    if stop.load(Ordering::Relaxed) {
                        return;
                    }
                    std::fs::write(&path, foreign(beat)).unwrap();
                    sleep(Duration::from_millis(5));
                }
            }
        });
        let refused = Lock::take_within(&scratch.0, SOON).unwrap_err();
        assert!(refused.message.contains("process 1 on h"), "{refused}");
        stop.store(true, Ordering::Relaxed);
        other.join().unwrap();
        drop(Lock::take_within(&scratch.0, SOON).unwrap());
        for left in ["", "{ damaged", "\u{0}\u{0}"] {
            std::fs::write(&path, left).unwrap();
            drop(Lock::take_within(&scratch.0, SOON).unwrap());
        }
    }

    /// A run whose folder was taken by another run reports it at the next check. A missing file is
    /// not reported.
    #[test]
    fn a_folder_that_was_taken_is_noticed() {
        let scratch = Scratch::new("lock-lost");
        let lock = Lock::take_within(&scratch.0, SOON).unwrap();
        std::fs::write(scratch.0.join(LOCK), foreign(0)).unwrap();
        while !lock.lost.load(Ordering::Relaxed) {
            sleep(Duration::from_millis(20));
        }
        assert!(lock.check().unwrap_err().message.contains("process 1 on h"));
        drop(lock);
        assert!(scratch.0.join(LOCK).exists(), "it is the other one's");
        let lock = Lock::take_within(&scratch.0, SOON).unwrap();
        std::fs::remove_file(scratch.0.join(LOCK)).unwrap();
        sleep(BEAT + BEAT / 2);
        lock.check().unwrap();
    }
}
