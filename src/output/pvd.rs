//! A time series of grids, which is the file to open in ParaView.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::files;

use super::folder::write_whole;
use super::io_error::trouble;
use super::pvtu;
use super::xml::{escaped, tags};

/// One grid at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct PvdEntry {
    /// Time \[s\].
    pub time: f64,
    /// Index of the grid among those of that time.
    pub part: u32,
    /// The index file of the pieces, relative to the series.
    pub file: String,
}

/// A `.pvd` file that grows. Every version of it is complete and names only grids that exist.
#[derive(Debug)]
pub struct PvdSeries {
    path: PathBuf,
    entries: Vec<PvdEntry>,
}

impl PvdSeries {
    /// An empty series; the file appears with the first entry. Rank 0 only.
    pub fn new(path: &Path) -> Self {
        Self { path: path.to_path_buf(), entries: Vec::new() }
    }

    /// Continues a series after a restart, without the entries after `last_time` \[s\].
    ///
    /// # Errors
    /// The file can not be read or written.
    pub fn resume(path: &Path, last_time: f64) -> Result<Self> {
        let mut series = Self::new(path);
        if path.exists() {
            let cure = "remove this file to resume without the fields that it lists, or start again without \
                        --restart";
            series.entries = read(path).map_err(|error| error.hint(cure))?;
            series.entries.retain(|entry| entry.time <= last_time);
            series.write()?;
        }
        Ok(series)
    }

    /// Removes the grids whose files are missing, so that the series names only existing files.
    /// Returns the number removed.
    ///
    /// # Errors
    /// The disk can not be written.
    pub fn drop_lost(&mut self) -> Result<usize> {
        let before = self.entries.len();
        let folder = self.path.parent().unwrap_or(Path::new("")).to_path_buf();
        self.entries.retain(|entry| is_whole(&folder.join(&entry.file)));
        let lost = before - self.entries.len();
        if lost > 0 {
            self.write()?;
        }
        Ok(lost)
    }

    /// Whether all grids that the series names exist.
    pub fn is_whole(&self) -> bool {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        self.entries.iter().all(|entry| is_whole(&folder.join(&entry.file)))
    }

    /// Number of instants.
    pub fn steps(&self) -> u64 {
        self.entries.iter().filter(|entry| entry.part == 0).count() as u64
    }

    /// Adds grids and rewrites the file.
    ///
    /// # Errors
    /// The disk can not be written.
    pub fn add(&mut self, entries: impl IntoIterator<Item = PvdEntry>) -> Result<()> {
        self.entries.extend(entries);
        self.write()
    }

    fn write(&self) -> Result<()> {
        let mut text = String::from(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\">\n<Collection>\n",
        );
        for PvdEntry { time, part, file } in &self.entries {
            let file = escaped(file);
            text.push_str(&format!("<DataSet timestep=\"{time:?}\" part=\"{part}\" file=\"{file}\"/>\n"));
        }
        text.push_str("</Collection>\n</VTKFile>\n");
        write_whole(&self.path, text.as_bytes())
    }
}

/// Whether an index and all its pieces exist.
fn is_whole(index: &Path) -> bool {
    let folder = index.parent().unwrap_or(Path::new(""));
    pvtu::read(index).is_ok_and(|pieces| pieces.iter().all(|piece| folder.join(piece).is_file()))
}

/// Reads the grids of a series.
///
/// # Errors
/// The file is missing, truncated, or not a series.
pub fn read(path: &Path) -> Result<Vec<PvdEntry>> {
    let bytes = files::read(path, files::LONGEST_TABLE).map_err(|e| trouble(path, "read", &e))?;
    let place = path.display().to_string();
    let tags = tags(&bytes, "/VTKFile").map_err(|e| e.within(&place))?;
    if tags.first().and_then(|tag| tag.find("type")) != Some("Collection") {
        return Err(Error::file(format!("{place}: not a time series")));
    }
    let entries = tags.iter().filter(|tag| tag.name == "DataSet").map(|tag| {
        Ok(PvdEntry {
            time: tag.number("timestep")?,
            part: tag.number("part")?,
            file: tag.get("file")?.to_string(),
        })
    });
    entries.collect::<Result<_>>().map_err(|e| e.within(&place))
}

#[cfg(test)]
mod tests {
    use super::super::folder::tests::Scratch;
    use super::*;

    fn entry(time: f64, part: u32) -> PvdEntry {
        PvdEntry { time, part, file: format!("fields/{time}/{part}.pvtu") }
    }

    /// After each step the file holds all steps so far, with times exact to the last bit. A restart
    /// removes later steps.
    #[test]
    fn grows_and_resumes() {
        let scratch = Scratch::new("pvd");
        let path = scratch.0.join("a.pvd");
        let mut series = PvdSeries::new(&path);
        let times = [0.0, 0.1 + 0.2, 1e-7];
        for (count, time) in times.into_iter().enumerate() {
            series.add([entry(time, 0), entry(time, 1)]).unwrap();
            assert_eq!(read(&path).unwrap().len(), 2 * (count + 1));
        }
        assert_eq!(read(&path).unwrap()[2], entry(0.1 + 0.2, 0));
        let mut series = PvdSeries::resume(&path, 1e-7).unwrap();
        assert_eq!(read(&path).unwrap().len(), 4);
        series.add([entry(0.5, 0)]).unwrap();
        let left: Vec<f64> = read(&path).unwrap().iter().map(|entry| entry.time).collect();
        assert_eq!(left, [0.0, 0.0, 1e-7, 1e-7, 0.5]);
    }
}
