//! Transfers tables between all ranks and the file on rank 0, piece by piece.

use std::io::{Read, Seek};
use std::path::Path;

use mpi::collective::SystemOperation;
use mpi::datatype::PartitionMut;
use mpi::traits::{CommunicatorCollectives, Root};
use serde_json::Value;

use super::file::{FileSection, Header, Reader, Writer, examine, unreadable};
use super::table::StoredTable;
use crate::collective::Collective;
use crate::error::{Error, Result, agree};

/// Number of words that rank 0 reads at a time.
const PIECE: usize = 1 << 17;

/// Writes a checkpoint with the rows of all ranks. Each row is given by one rank. The `state` of
/// rank 0 goes into the header. Collective.
///
/// # Errors
/// The file can not be written, for example on a full disk. The error is the same on all ranks, and
/// the file is removed.
pub fn write(
    world: &impl CommunicatorCollectives,
    path: &Path,
    state: Value,
    tables: &[StoredTable],
) -> Result<()> {
    agree(world, tables.iter().try_for_each(StoredTable::check))?;
    let mut sections = Vec::with_capacity(tables.len());
    for table in tables {
        let mut rows = 0;
        world.reduce_all(&(table.keys.len() as u64), &mut rows, SystemOperation::sum());
        sections.push(FileSection { name: table.name.clone(), columns: table.columns.clone(), rows });
    }
    let header = Header { state, sections };
    let opened = if world.rank() == 0 { Writer::create(path, &header).map(Some) } else { Ok(None) };
    let mut writer = agree(world, opened)?;
    for table in tables {
        let written = collect(world, table, |words| writer.as_mut().map_or(Ok(()), |file| file.words(words)));
        agree(world, written)?;
    }
    agree(world, writer.map_or(Ok(()), Writer::finish))
}

/// Sends the rows of all ranks to rank 0 by ascending key, one range of keys at a time. After the
/// first error of `take`, rank 0 discards the remaining rows. Collective.
fn collect(
    world: &impl CommunicatorCollectives,
    table: &StoredTable,
    mut take: impl FnMut(&[u64]) -> Result<()>,
) -> Result<()> {
    let order = table.order();
    let own_end = order.last().map_or(0, |&row| table.keys[row] + 1);
    let mut end = 0;
    world.reduce_all(&own_end, &mut end, SystemOperation::max());
    let width = table.columns.len();
    let mut given = 0;
    let mut outcome = Ok(());
    let mut start = 0u64;
    let mut words = Vec::new();
    let mut sorted = Vec::new();
    while start < end {
        let stop = start.saturating_add(table.span);
        words.clear();
        while let Some(&row) = order.get(given).filter(|&&row| table.keys[row] < stop) {
            words.push(table.keys[row]);
            words.extend_from_slice(&table.words[row * width..(row + 1) * width]);
            given += 1;
        }
        let arrived = gather(world, &words);
        if outcome.is_ok() && world.rank() == 0 {
            let mut rows: Vec<&[u64]> = arrived.chunks_exact(width + 1).collect();
            rows.sort_unstable_by_key(|row| row[0]);
            sorted.clear();
            rows.iter().for_each(|row| sorted.extend_from_slice(row));
            outcome = take(&sorted);
        }
        start = stop;
    }
    outcome
}

/// Gathers the words of all ranks on rank 0; the result is empty on the others. Collective.
fn gather(world: &impl CommunicatorCollectives, words: &[u64]) -> Vec<u64> {
    let root = world.process_at_rank(0);
    let count = words.len() as i32;
    if world.rank() != 0 {
        root.gather_into(&count);
        root.gather_varcount_into(words);
        return Vec::new();
    }
    let mut counts = vec![0i32; world.size() as usize];
    root.gather_into_root(&count, &mut counts[..]);
    let starts = counts.iter().scan(0, |sum, &count| Some(std::mem::replace(sum, *sum + count)));
    let starts: Vec<i32> = starts.collect();
    let mut all = vec![0u64; counts.iter().map(|&count| count as usize).sum()];
    root.gather_varcount_into_root(words, &mut PartitionMut::new(&mut all[..], &counts[..], &starts[..]));
    all
}

/// Fills the rows of `tables`, whose keys are given, from a verified checkpoint. Collective.
///
/// # Errors
/// The sections differ or a row is missing. The error is the same on all ranks.
pub fn read(world: &impl CommunicatorCollectives, path: &Path, tables: &mut [StoredTable]) -> Result<()> {
    let opened = if world.rank() == 0 { Reader::open(path).map(Some) } else { Ok(None) };
    let mut reader = agree(world, opened)?;
    let fits = reader.as_ref().map_or(Ok(()), |reader| compare(&reader.header.sections, tables));
    agree(world, fits.map_err(|error| error.within(&path.display().to_string())))?;
    for (number, table) in tables.iter_mut().enumerate() {
        let mut rows = reader.as_ref().map_or(0, |reader| reader.header.sections[number].rows);
        world.process_at_rank(0).broadcast_into(&mut rows);
        let share = |words: &mut [u64]| world.process_at_rank(0).broadcast_into(words);
        let bring = |words: &mut [u64]| reader.as_mut().map_or(Ok(()), |file| file.words(words));
        let missing = agree(world, spread(table, rows, bring, share))?;
        agree(world, complete(path, table, missing))?;
    }
    Ok(())
}

/// Fills tables like [`read`] in one process without MPI, from any source that can be read and
/// rewound, of the given length \[bytes\]. The path is used in errors only.
///
/// # Errors
/// See [`read`] and [`examine`].
pub fn fill(
    path: &Path,
    file: &mut (impl Read + Seek),
    length: u64,
    tables: &mut [StoredTable],
) -> Result<()> {
    examine(path, file, length)?;
    file.rewind().map_err(|error| unreadable(path, &error))?;
    let mut reader = Reader::new(path, file)?;
    compare(&reader.header.sections, tables)?;
    for (number, table) in tables.iter_mut().enumerate() {
        let rows = reader.header.sections[number].rows;
        let missing = spread(table, rows, |words| reader.words(words), |_| ())?;
        complete(path, table, missing)?;
    }
    Ok(())
}

fn complete(path: &Path, table: &StoredTable, missing: usize) -> Result<()> {
    let lacks = || Error::file(format!("{}: {missing} rows of '{}' are missing", path.display(), table.name));
    (missing == 0).then_some(()).ok_or_else(lacks)
}

fn compare(sections: &[FileSection], tables: &[StoredTable]) -> Result<()> {
    let told: Vec<_> = sections.iter().map(|section| (&section.name, &section.columns)).collect();
    let wanted: Vec<_> = tables.iter().map(|table| (&table.name, &table.columns)).collect();
    if told == wanted {
        return Ok(());
    }
    let other = told.iter().zip(&wanted).find(|(told, wanted)| told != wanted).map(|(told, _)| told.0);
    let name = other.map_or("tables", String::as_str);
    Err(Error::file(format!("the columns of '{name}' differ from those of this program"))
        .hint("resume with the version of the program that wrote it, or start again without --restart"))
}

/// Reads a section with the given number of rows. Rank 0 reads pieces with `bring`, `share`
/// distributes them to all ranks, and each rank takes the rows of its keys. Returns the number of
/// rows that it did not find. Collective if `share` is.
fn spread(
    table: &mut StoredTable,
    rows: u64,
    mut bring: impl FnMut(&mut [u64]) -> Result<()>,
    share: impl Fn(&mut [u64]),
) -> Result<usize> {
    let (order, width) = (table.order(), table.columns.len());
    let most = (PIECE / (width + 1)).max(1) as u64;
    let mut left = rows;
    let mut taken = 0;
    let mut found = 0;
    let mut outcome = Ok(());
    let mut words = Vec::new();
    while left > 0 {
        let count = left.min(most);
        words.resize(count as usize * (width + 1), 0);
        if outcome.is_ok() {
            outcome = bring(&mut words);
        }
        share(&mut words);
        for row in words.chunks_exact(width + 1) {
            while order.get(taken).is_some_and(|&mine| table.keys[mine] < row[0]) {
                taken += 1;
            }
            if let Some(&mine) = order.get(taken).filter(|&&mine| table.keys[mine] == row[0]) {
                table.words[mine * width..(mine + 1) * width].copy_from_slice(&row[1..]);
                found += 1;
                taken += 1;
            }
        }
        left -= count;
    }
    outcome.map(|()| order.len() - found)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    /// Rows are returned by key in any requested order. A missing row or a different column is an
    /// error.
    #[test]
    fn rows_come_back_by_their_keys() {
        let folder = std::env::temp_dir().join(format!("contact-petsc-{}-stream", std::process::id()));
        let path = folder.join("a.ckpt");
        let columns = vec!["u_x".to_owned(), "u_y".to_owned()];
        let section = FileSection { name: "nodes".into(), columns: columns.clone(), rows: 3 };
        let header = Header { state: Value::Null, sections: vec![section] };
        let mut writer = Writer::create(&path, &header).unwrap();
        writer.words(&[2, 20, 21, 5, 50, 51, 9, 90, 91]).unwrap();
        writer.finish().unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let fill = |keys: &[u64], columns: &[String]| {
            let mut tables = [StoredTable::keyed("nodes", columns.to_vec(), keys.to_vec(), 4)];
            fill(&path, &mut Cursor::new(&bytes), bytes.len() as u64, &mut tables)
                .map(|()| tables[0].words.clone())
        };
        assert_eq!(fill(&[9, 2], &columns).unwrap(), [90, 91, 20, 21]);
        assert_eq!(fill(&[], &columns).unwrap(), [0; 0]);
        assert!(fill(&[2, 3], &columns).unwrap_err().message.contains("1 rows of 'nodes' are missing"));
        assert!(fill(&[2], &columns[..1]).unwrap_err().message.contains("the columns of"));
    }
}
