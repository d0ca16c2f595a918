//! A file that is changed while it is read: it is said.

use super::head::Head;
use super::source::{Facts, Source, Take};
use crate::error::Result;
use std::fs::Metadata;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

const CHANGED: &str = "the file was changed or replaced while it was read: read it again once it is complete";

/// Size, time of the last change and identity of a file.
#[derive(Debug, PartialEq)]
pub(super) struct State {
    bytes: u64,
    modified: Option<SystemTime>,
    /// Of its device and on it.
    number: Option<(u64, u64)>,
}

impl State {
    /// None of pipes and devices, which change as they are read.
    pub(super) fn of(path: &Path) -> Option<Self> {
        let about = std::fs::metadata(path).ok().filter(Metadata::is_file)?;
        Some(Self { bytes: about.len(), modified: about.modified().ok(), number: number(&about) })
    }
}

#[cfg(unix)]
fn number(about: &Metadata) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    Some((about.dev(), about.ino()))
}

#[cfg(not(unix))]
fn number(_: &Metadata) -> Option<(u64, u64)> {
    None
}

/// A source of a file, watched since before it was opened.
pub(super) struct Watched {
    pub source: Box<dyn Source>,
    pub path: PathBuf,
    pub before: Option<State>,
}

impl Source for Watched {
    fn heads(&self) -> &[Head] {
        self.source.heads()
    }

    fn rows(&self) -> Option<u64> {
        self.source.rows()
    }

    fn hold(&mut self) {
        self.source.hold();
    }

    fn read(self: Box<Self>, wanted: &[bool], take: Take<'_>) -> Result<Facts> {
        let Self { source, path, before } = *self;
        let done = source.read(wanted, take);
        if before.is_none() || before == State::of(&path) {
            return done;
        }
        match done {
            Ok(mut facts) => {
                facts.notes.push(CHANGED.to_string());
                Ok(facts)
            }
            Err(mut error) => {
                error.found = format!("{}; {CHANGED}", error.found);
                Err(error)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Choice, open};

    #[test]
    fn a_file_that_grows_while_it_is_read_is_told() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("log.csv");
        for (change, told) in [(false, 0), (true, 1)] {
            std::fs::write(&path, "t_s,gyro_z_rad_s\n0,1\n1,2\n").unwrap();
            let source = open(&path, Choice::default()).unwrap().source;
            let wanted = vec![true; source.heads().len()];
            let facts = source.read(&wanted, &mut |_| {
                if change {
                    std::fs::write(&path, "t_s,gyro_z_rad_s\n0,1\n1,2\n2,3\n").unwrap();
                }
                Ok(())
            });
            let notes = facts.unwrap().notes;
            assert_eq!(notes.iter().filter(|n| n.contains("changed or replaced")).count(), told, "{notes:?}");
        }
    }
}
