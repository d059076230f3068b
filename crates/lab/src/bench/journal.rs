//! The finished runs, one line each, so that an interrupted bench goes on where it was.

use std::collections::BTreeMap;
use std::fs::{File, TryLockError};
use std::io::{Read, Write};
use std::path::Path;

use anyhow::{Context, bail};

use super::row::Row;

/// An open journal; only one process has it at a time.
pub(crate) struct Journal {
    file: File,
    path: std::path::PathBuf,
    rows: BTreeMap<String, Row>,
}

impl Journal {
    /// Opens or creates it. A line that is cut off at the end, as a kill leaves it, is dropped from the file; rows of
    /// another program are set aside unless `any_build`.
    pub(crate) fn open(path: &Path, program: &str, any_build: bool) -> anyhow::Result<Self> {
        let named = || format!("cannot use {}", path.display());
        let mut file = File::options().read(true).append(true).create(true).open(path).with_context(named)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => bail!("{} is in use by another process", path.display()),
            Err(TryLockError::Error(error)) => return Err(error).with_context(named),
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).with_context(named)?;
        let whole = bytes.iter().rposition(|b| *b == b'\n').map_or(0, |at| at + 1);
        file.set_len(whole as u64).with_context(named)?;
        let mut rows = BTreeMap::new();
        for (number, line) in bytes[..whole].split(|b| *b == b'\n').enumerate().filter(|(_, l)| !l.is_empty())
        {
            match serde_json::from_slice::<Row>(line) {
                Ok(row) if any_build || row.program == program => {
                    rows.insert(row.key.clone(), row);
                }
                Ok(_) => {}
                Err(error) => {
                    tracing::warn!(line = number + 1, %error, "{}: not a run, ignored", path.display());
                }
            }
        }
        Ok(Self { file, path: path.to_owned(), rows })
    }

    pub(crate) fn row(&self, key: &str) -> Option<&Row> {
        self.rows.get(key)
    }

    /// Adds the line a worker answered with, as it is.
    pub(crate) fn add(&mut self, line: &str, row: Row) -> anyhow::Result<()> {
        let write = self.file.write_all(format!("{}\n", line.trim_end()).as_bytes());
        write.with_context(|| format!("cannot write {}", self.path.display()))?;
        self.rows.insert(row.key.clone(), row);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::row::tests::row;
    use super::*;

    fn line(row: &Row) -> String {
        serde_json::to_string(row).unwrap()
    }

    #[test]
    fn a_row_cut_off_by_a_kill_is_dropped_and_the_rest_goes_on() {
        let path = std::env::temp_dir().join(format!("curionav-journal-{}", std::process::id()));
        let rows = [1, 2, 3].map(|seed| row("a", "b", seed));
        let cut = &line(&rows[1])[..40];
        std::fs::write(&path, format!("{}\nnot a run\n{cut}", line(&rows[0]))).unwrap();
        let mut journal = Journal::open(&path, "p", false).unwrap();
        assert!(Journal::open(&path, "p", false).is_err(), "two at a time");
        assert_eq!((journal.row("a-b-1"), journal.row("a-b-2")), (Some(&rows[0]), None));
        journal.add(&line(&rows[2]), rows[2].clone()).unwrap();
        drop(journal);
        let again = Journal::open(&path, "p", false).unwrap();
        assert_eq!((again.row("a-b-1"), again.row("a-b-3")), (Some(&rows[0]), Some(&rows[2])));
        drop(again);
        let [other, any] =
            [false, true].map(|any| Journal::open(&path, "q", any).unwrap().row("a-b-1").is_some());
        std::fs::remove_file(&path).unwrap();
        assert_eq!((other, any), (false, true));
    }
}
