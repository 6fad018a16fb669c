//! Memory check of a requested mesh before it is created.

use crate::error::{Error, Result};

/// Minimum memory of one node while its mesh is partitioned and distributed: the mesh, its graph
/// and its copies \[bytes\].
const NODE: f64 = 500.0;

/// Rejects a mesh with so many nodes that the memory of this machine cannot hold it, even without
/// the solver. The limit is the memory that the system reports as available. If the system does not
/// report it, every mesh is accepted.
///
/// # Errors
/// The mesh is too large. The message gives its estimated size and the available memory.
pub fn require_room(nodes: f64) -> Result<()> {
    check(nodes, available())
}

fn check(nodes: f64, available: Option<u64>) -> Result<()> {
    let needed = nodes * NODE;
    match available {
        Some(available) if needed > available as f64 => {
            let [needed, available] = [needed, available as f64].map(|bytes| bytes / 1e9);
            let text = format!(
                "{nodes:.3e} nodes: the mesh alone needs about {needed:.1} GB, but only {available:.1} GB \
                 are free"
            );
            Err(Error::case(text).hint("use fewer cells, or a machine with more memory"))
        }
        _ => Ok(()),
    }
}

/// Memory available without swapping \[bytes\].
fn available() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    line.split_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mesh that fits is accepted. One that does not is rejected with both sizes. Without
    /// information from the system every mesh is accepted.
    #[test]
    fn refuses_what_can_not_be_held() {
        assert!(check(1e6, Some(1 << 30)).is_ok());
        assert!(check(1e12, None).is_ok());
        let error = check(1e8, Some(8_000_000_000)).unwrap_err();
        assert!(error.message.contains("50.0 GB") && error.message.contains("8.0 GB"), "{error}");
    }
}
