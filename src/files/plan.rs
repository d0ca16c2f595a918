//! Files that a command reads and writes, checked before it reads anything.

use super::mark;
use crate::error::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};

/// The files of one command.
#[derive(Debug, Clone, Default)]
pub struct Plan {
    reads: Vec<PathBuf>,
    writes: Vec<Planned>,
}

#[derive(Debug, Clone)]
struct Planned {
    option: &'static str,
    path: PathBuf,
    replaces: Replaces,
}

/// Files that an output may replace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Replaces {
    /// A file that gyroid wrote and that this command does not read.
    Result,
    /// Also a file that this command reads, of which it is the next version.
    Input,
    /// Any file: it is read first, and refused there unless it is a table of results.
    Table,
}

impl Plan {
    /// A command that reads and writes nothing.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds files that the command reads.
    #[must_use]
    pub fn reads<P: AsRef<Path>>(mut self, paths: impl IntoIterator<Item = P>) -> Self {
        self.reads.extend(paths.into_iter().map(|p| p.as_ref().to_path_buf()));
        self
    }

    /// Adds files that the command writes, named by `option`.
    #[must_use]
    pub fn writes<P: AsRef<Path>>(self, option: &'static str, paths: impl IntoIterator<Item = P>) -> Self {
        self.with(option, paths, Replaces::Result)
    }

    /// Adds files of which the command writes a new version; it may read them too.
    #[must_use]
    pub fn updates<P: AsRef<Path>>(self, option: &'static str, paths: impl IntoIterator<Item = P>) -> Self {
        self.with(option, paths, Replaces::Input)
    }

    /// Adds tables of results that the command appends to.
    #[must_use]
    pub(crate) fn resumes<P: AsRef<Path>>(self, option: &'static str, paths: impl IntoIterator<Item = P>) -> Self {
        self.with(option, paths, Replaces::Table)
    }

    fn with<P: AsRef<Path>>(
        mut self,
        option: &'static str,
        paths: impl IntoIterator<Item = P>,
        replaces: Replaces,
    ) -> Self {
        let planned = |path: P| Planned { option, path: path.as_ref().to_path_buf(), replaces };
        self.writes.extend(paths.into_iter().map(planned));
        self
    }

    /// Sees that no output is an input or another output, under whatever name, and that no file is replaced that gyroid did not
    /// write, unless by `force`.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] for two names of one file; [`ErrorKind::Exists`] for a file that gyroid did not write.
    pub fn check(&self, force: bool) -> Result<()> {
        let reads: Vec<(&PathBuf, Identity)> = self.reads.iter().map(|path| (path, Identity::of(path))).collect();
        let writes: Vec<(&Planned, Identity)> = self.writes.iter().map(|w| (w, Identity::of(&w.path))).collect();
        for (i, (write, here)) in writes.iter().enumerate() {
            let usage = |found: String, hint: &str| {
                Err(Error::new(ErrorKind::Usage, write.path.display(), found).at(write.option).hint(hint))
            };
            if let Some((read, _)) = reads.iter().find(|(_, read)| here.is(read))
                && write.replaces == Replaces::Result
            {
                let other = other_name(&write.path, read);
                return usage(format!("is an input of this command{other}: it would be lost"), "name another file");
            }
            if let Some((before, _)) = writes[..i].iter().find(|(_, before)| here.is(before)) {
                let other = other_name(&write.path, &before.path);
                return usage(
                    format!("is written by {} too{other}", before.option),
                    "give each output a file of its own",
                );
            }
        }
        for (write, _) in &writes {
            let foreign = write.path.is_file() && write.replaces != Replaces::Table && !mark::is_own(&write.path);
            if foreign && !force {
                let found = "is there already, and gyroid did not write it, or it was changed since";
                let hint = match write.replaces {
                    Replaces::Input => "write a copy instead, or replace it and its comments with --force",
                    _ => "name another file, or replace it with --force",
                };
                return Err(Error::new(ErrorKind::Exists, write.path.display(), found).at(write.option).hint(hint));
            }
        }
        Ok(())
    }
}

fn other_name(one: &Path, other: &Path) -> String {
    if one == other { String::new() } else { format!(", as {}", other.display()) }
}

/// Identity of a file, equal for all its names.
#[derive(Debug)]
struct Identity {
    /// Without links and detours.
    place: PathBuf,
    /// Device and file number, alike for hard links; where there is a file.
    number: Option<(u64, u64)>,
}

impl Identity {
    fn of(path: &Path) -> Self {
        // a file that is yet to be written has a folder at least
        let beside = || {
            let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            Some(folder.canonicalize().ok()?.join(path.file_name()?))
        };
        let place = path.canonicalize().ok().or_else(beside).unwrap_or_else(|| path.to_path_buf());
        Self { place, number: number(path) }
    }

    fn is(&self, other: &Self) -> bool {
        self.place == other.place || (self.number.is_some() && self.number == other.number)
    }
}

#[cfg(unix)]
fn number(path: &Path) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    std::fs::metadata(path).ok().map(|m| (m.dev(), m.ino()))
}

#[cfg(not(unix))]
fn number(_path: &Path) -> Option<(u64, u64)> {
    None
}
