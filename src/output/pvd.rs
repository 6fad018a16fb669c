//! A time series of grids, what one opens in ParaView.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::files;

use super::folder::write_whole;
use super::io_error::trouble;
use super::pvtu;
use super::xml::{escaped, tags};

/// One grid at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Time \[s\].
    pub time: f64,
    /// Which of the grids of that time.
    pub part: u32,
    /// Index of the pieces, relative to the series.
    pub file: String,
}

/// A `.pvd` file that grows; every version of it is whole and names only grids that are there.
#[derive(Debug)]
pub struct PvdSeries {
    path: PathBuf,
    entries: Vec<Entry>,
}

impl PvdSeries {
    /// An empty series; the file appears with the first entry. Rank 0 only.
    pub fn new(path: &Path) -> Self {
        Self { path: path.to_path_buf(), entries: Vec::new() }
    }

    /// Goes on with a series after a restart, without what comes after `last_time` \[s\].
    ///
    /// # Errors
    /// The file can not be read or written.
    pub fn resume(path: &Path, last_time: f64) -> Result<Self> {
        let mut series = Self::new(path);
        if path.exists() {
            let cure =
                "remove this file to go on without the fields that it names, or start anew without --restart";
            series.entries = read(path).map_err(|error| error.hint(cure))?;
            series.entries.retain(|entry| entry.time <= last_time);
            series.write()?;
        }
        Ok(series)
    }

    /// Drops the grids whose files are gone, so that the series names only what is there; how many it drops.
    ///
    /// # Errors
    /// The disk refuses.
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

    /// Whether all grids that the series names are there.
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
    /// The disk refuses.
    pub fn add(&mut self, entries: impl IntoIterator<Item = Entry>) -> Result<()> {
        self.entries.extend(entries);
        self.write()
    }

    fn write(&self) -> Result<()> {
        let mut text = String::from(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\">\n<Collection>\n",
        );
        for Entry { time, part, file } in &self.entries {
            let file = escaped(file);
            text.push_str(&format!("<DataSet timestep=\"{time:?}\" part=\"{part}\" file=\"{file}\"/>\n"));
        }
        text.push_str("</Collection>\n</VTKFile>\n");
        write_whole(&self.path, text.as_bytes())
    }
}

/// Whether an index and all its pieces are there.
fn is_whole(index: &Path) -> bool {
    let folder = index.parent().unwrap_or(Path::new(""));
    pvtu::read(index).is_ok_and(|pieces| pieces.iter().all(|piece| folder.join(piece).is_file()))
}

/// The grids of a series.
///
/// # Errors
/// The file is missing, cut short, or not a series.
pub fn read(path: &Path) -> Result<Vec<Entry>> {
    let bytes = files::read(path, files::LONGEST_TABLE).map_err(|e| trouble(path, "read", &e))?;
    let place = path.display().to_string();
    let tags = tags(&bytes, "/VTKFile").map_err(|e| e.within(&place))?;
    if tags.first().and_then(|tag| tag.find("type")) != Some("Collection") {
        return Err(Error::file(format!("{place}: not a time series")));
    }
    let entries = tags.iter().filter(|tag| tag.name == "DataSet").map(|tag| {
        Ok(Entry {
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

    fn entry(time: f64, part: u32) -> Entry {
        Entry { time, part, file: format!("fields/{time}/{part}.pvtu") }
    }

    /// After each step the file holds all steps so far, times to the last bit, and a restart drops later
    /// ones.
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
