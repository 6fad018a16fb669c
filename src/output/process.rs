//! Identifies the process that writes a run record, so that a reader distinguishes a killed run
//! from a running one.

use std::fs;
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

use serde_json::{Value, json};

use crate::error::{Error, Result};

/// This process as it is recorded in `run.json`: host, number, and the name that the operating
/// system gives it.
pub fn own() -> Value {
    json!({ "host": host(), "id": std::process::id(), "name": name("self") })
}

/// The verdict of a run record. It is `killed` if the record says `running` and the process that
/// wrote it does not exist.
///
/// The verdict of a run on another host is returned unchanged, because its process can not be
/// checked.
pub fn verdict(record: &Value) -> &str {
    match record["verdict"].as_str() {
        Some("running") if on_this_host(record).is_some_and(|id| !is_there(record, id)) => "killed",
        verdict => verdict.unwrap_or("unknown"),
    }
}

/// Checks that no other run writes into a results folder. A run that is being killed may take a
/// second to end.
///
/// # Errors
/// Another run on this host writes into the folder.
pub fn claim(folder: &Path) -> Result<()> {
    let record = super::folder::record(folder);
    let Some(id) = on_this_host(&record).filter(|_| record["verdict"] == "running") else { return Ok(()) };
    let own = id == u64::from(std::process::id());
    for _ in 0..PATIENCE {
        if own || !is_there(&record, id) {
            return Ok(());
        }
        sleep(Duration::from_millis(100));
    }
    Err(Error::file(format!(
        "{}: another run is writing to this folder, process {id}; nothing was changed",
        folder.display()
    ))
    .hint("wait until it has ended, or choose another folder with --output"))
}

/// Number of checks, a tenth of a second apart, before a process counts as alive.
const PATIENCE: u32 = 10;

/// Number of the process of a record, if it ran on this host.
fn on_this_host(record: &Value) -> Option<u64> {
    let process = &record["process"];
    let here = process["host"].as_str().is_some_and(|there| !there.is_empty() && there == host());
    process["id"].as_u64().filter(|_| here)
}

fn is_there(record: &Value, id: u64) -> bool {
    name(&id.to_string()).is_some_and(|name| record["process"]["name"] == name)
}

/// Name of this host.
pub fn host() -> String {
    fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default().trim().to_owned()
}

/// Name of a process; `None` for zombies, whose parents have not waited for them.
fn name(id: &str) -> Option<String> {
    let status = fs::read_to_string(format!("/proc/{id}/status")).ok()?;
    let entry = |key: &str| status.lines().find_map(|line| line.strip_prefix(key)).map(str::trim);
    let dead = entry("State:").is_some_and(|state| state.starts_with(['Z', 'X']));
    entry("Name:").filter(|_| !dead).map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use std::process::{Child, Command};

    use super::super::folder::RECORD;
    use super::super::folder::tests::Scratch;
    use super::*;

    /// Starts a process that sleeps. It exists a moment before its name is set.
    fn sleeper() -> Child {
        let child = Command::new("sleep").arg("60").spawn().unwrap();
        while name(&child.id().to_string()).as_deref() != Some("sleep") {
            sleep(Duration::from_millis(1));
        }
        child
    }

    fn record(verdict: &str, child: &Child) -> Value {
        let process = json!({ "host": host(), "id": child.id(), "name": name(&child.id().to_string()) });
        json!({ "verdict": verdict, "process": process })
    }

    /// A run whose process exists is running. A run whose process is dead was killed, whether its
    /// parent has waited for it or not. The verdict is unchanged for another host, for a record
    /// without a process, and for a run that has ended.
    #[test]
    fn a_killed_run_is_told_from_one_that_goes_on() {
        assert_eq!(verdict(&json!({ "verdict": "running", "process": own() })), "running");
        let mut child = sleeper();
        let mut running = record("running", &child);
        let failed = record("failed", &child);
        assert_eq!(verdict(&running), "running");
        child.kill().unwrap();
        while name(&child.id().to_string()).is_some() {
            sleep(Duration::from_millis(1));
        }
        assert_eq!(verdict(&running), "killed");
        child.wait().unwrap();
        assert_eq!((verdict(&running), verdict(&failed)), ("killed", "failed"));
        running["process"]["host"] = json!("another");
        assert_eq!(verdict(&running), "running");
        assert_eq!(verdict(&json!({ "verdict": "running" })), "running");
        assert_eq!(verdict(&json!({})), "unknown");
    }

    /// A folder into which a live process writes is refused. It is free as soon as the process or
    /// its run has ended.
    #[test]
    fn a_folder_in_use_is_refused() {
        let scratch = Scratch::new("claimed");
        let put = |record: &Value| fs::write(scratch.0.join(RECORD), record.to_string()).unwrap();
        claim(&scratch.0).unwrap();
        let mut child = sleeper();
        put(&record("running", &child));
        let refused = claim(&scratch.0).unwrap_err();
        assert!(refused.message.contains(&format!("process {}", child.id())), "{refused}");
        put(&record("completed", &child));
        claim(&scratch.0).unwrap();
        put(&record("running", &child));
        child.kill().unwrap();
        claim(&scratch.0).unwrap();
        child.wait().unwrap();
    }
}
