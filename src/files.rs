//! Output files that are written whole or not at all: a temporary file on the target's disk, fsync, link or rename. [`Plan`]
//! sees beforehand that none of them takes the place of something of the user's.

pub mod mark;
pub mod memory;
pub(crate) mod parquet;
mod plan;
mod temporary;

pub use plan::Plan;

use crate::error::{Error, ErrorKind, Result};
use sha2::{Digest, Sha256};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use temporary::Temporary;

/// A place to write to, claimed before the work begins, so that hours of work are not lost to a bad path.
///
/// The target is untouched until [`OutputFile::commit`]; a drop without it leaves nothing behind.
#[derive(Debug)]
pub struct OutputFile {
    target: PathBuf,
    /// Where it lies when links are followed.
    place: PathBuf,
    content: Content,
}

/// Where the content lies until it is committed.
#[derive(Debug)]
enum Content {
    File {
        /// Folder of the place.
        folder: PathBuf,
        temporary: Temporary,
    },
    /// Of a [place in memory](memory::Place).
    Memory(Vec<u8>),
}

impl OutputFile {
    /// Claims `target`.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if its directory is missing or cannot be written, or if `target` is a directory or a device.
    pub fn claim(target: impl AsRef<Path>) -> Result<Self> {
        let target = target.as_ref().to_path_buf();
        if memory::is_place(&target) {
            return Ok(Self { place: target.clone(), target, content: Content::Memory(Vec::new()) });
        }
        if target.is_dir() {
            return Err(Error::new(ErrorKind::Io, target.display(), "is a directory, not a file to write")
                .hint("name a file in it"));
        }
        // through a link, which stays; renaming would put the file in the place of the link
        let place = target.canonicalize().unwrap_or_else(|_| target.clone());
        let directory = match place.parent() {
            Some(p) if !p.as_os_str().is_empty() => p.to_path_buf(),
            _ => PathBuf::from("."),
        };
        let cannot = |e: &std::io::Error| {
            Error::new(ErrorKind::Io, target.display(), format!("cannot be written: {e}"))
                .hint("create the directory, check its permissions, or choose another place")
        };
        if !directory.is_dir() {
            let why =
                std::io::Error::new(std::io::ErrorKind::NotFound, format!("no directory {}", directory.display()));
            return Err(cannot(&why));
        }
        if let Ok(meta) = std::fs::metadata(&target) {
            if !meta.is_file() {
                return Err(Error::new(ErrorKind::Io, target.display(), "is a device or a pipe, not a file to write")
                    .hint("name a file; --json - writes JSON to standard output"));
            }
            if meta.permissions().readonly() {
                return Err(cannot(&std::io::Error::from(std::io::ErrorKind::PermissionDenied)));
            }
        }
        let temporary = Temporary::beside(&directory).map_err(|e| cannot(&e))?;
        Ok(Self { target, place, content: Content::File { folder: directory, temporary } })
    }

    /// Where the content will be.
    #[must_use]
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// The temporary file, for writers that stream.
    pub(crate) fn file(&mut self) -> &mut dyn Write {
        match &mut self.content {
            Content::File { temporary, .. } => temporary.file(),
            Content::Memory(bytes) => bytes,
        }
    }

    /// Appends `bytes` to the content.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if the disk refuses.
    pub fn write_all(&mut self, bytes: &[u8]) -> Result<()> {
        self.file().write_all(bytes).map_err(|e| Error::io(&self.target, &e))
    }

    /// Flushes to disk and puts the file in its place.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if the disk refuses; the target is then as it was before.
    pub fn commit(self) -> Result<()> {
        let Self { target, place, content } = self;
        match content {
            Content::Memory(bytes) => {
                memory::put(&place, bytes);
                Ok(())
            }
            Content::File { folder, mut temporary } => {
                let file = temporary.file();
                file.sync_all()
                    .and_then(|()| set_default_permissions(file))
                    .and_then(|()| temporary.persist(&folder, &place))
                    .map_err(|e| Error::io(&target, &e))
            }
        }
    }
}

/// SHA-256 of a file's bytes, as hexadecimal digits.
///
/// # Errors
/// [`ErrorKind::Io`] if it cannot be read.
pub fn sha256(path: impl AsRef<Path>) -> Result<String> {
    let path = path.as_ref();
    if let Some(bytes) = memory::get::<Vec<u8>>(path) {
        return Ok(Sha256::digest(bytes.as_slice()).iter().map(|b| format!("{b:02x}")).collect());
    }
    let mut file = std::fs::File::open(path).map_err(|e| Error::io(path, &e))?;
    let (mut hash, mut buffer) = (Sha256::new(), vec![0; 1 << 16]);
    loop {
        match file.read(&mut buffer) {
            Ok(0) => break,
            Ok(n) => hash.update(&buffer[..n]),
            Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
            Err(e) => return Err(Error::io(path, &e)),
        }
    }
    Ok(hash.finalize().iter().map(|b| format!("{b:02x}")).collect())
}

/// Temporary files are private (0600); what the user asked for is an ordinary file.
#[cfg(unix)]
fn set_default_permissions(file: &std::fs::File) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(std::fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn set_default_permissions(_file: &std::fs::File) -> std::io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_left_behind_without_commit() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("a.txt");
        let mut out = OutputFile::claim(&target).unwrap();
        out.write_all(b"half").unwrap();
        drop(out);
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
    }

    #[test]
    fn commit_replaces_the_target_whole() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("a.txt");
        std::fs::write(&target, "old and longer").unwrap();
        let mut out = OutputFile::claim(&target).unwrap();
        out.write_all(b"new").unwrap();
        out.commit().unwrap();
        assert_eq!(std::fs::read_to_string(&target).unwrap(), "new");
    }

    #[test]
    fn a_bad_path_is_found_at_once() {
        let dir = tempfile::tempdir().unwrap();
        assert_eq!(OutputFile::claim(dir.path()).unwrap_err().kind, ErrorKind::Io);
        let error = OutputFile::claim(dir.path().join("no/such/x.toml")).unwrap_err();
        assert!(error.to_string().contains("no directory"), "{error}");
    }
}
