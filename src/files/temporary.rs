//! Content of an output file until it is committed. Where the system can, it has no name until then, and a command that is
//! killed leaves nothing. Elsewhere it lies beside the target under a name, locked as long as its command runs, and the next
//! command clears away what is no longer locked.

use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use tempfile::{NamedTempFile, TempPath};

const PREFIX: &str = ".gyroid-";
const SUFFIX: &str = ".tmp";
/// Letters between them.
const RANDOM: usize = 6;

#[derive(Debug)]
pub(super) enum Temporary {
    Unnamed(File),
    Named(NamedTempFile),
}

impl Temporary {
    /// An empty file on the disk of `folder`, once it is clear of what killed commands left.
    pub(super) fn beside(folder: &Path) -> io::Result<Self> {
        clear(folder);
        unnamed(folder).map_or_else(|| named(folder).map(Self::Named), |file| Ok(Self::Unnamed(file)))
    }

    pub(super) fn file(&mut self) -> &mut File {
        match self {
            Self::Unnamed(file) => file,
            Self::Named(file) => file.as_file_mut(),
        }
    }

    /// Puts it at `place` in `folder`, for what is there.
    pub(super) fn persist(self, folder: &Path, place: &Path) -> io::Result<()> {
        let named = match self {
            Self::Named(file) => file.into_temp_path(),
            Self::Unnamed(file) => {
                if link(&file, place).is_ok() {
                    return Ok(());
                }
                // a link takes the place of nothing; where there can be none, hours of work are not lost
                let linked = builder().make_in(folder, |path| link(&file, path));
                linked.map(NamedTempFile::into_temp_path).or_else(|_| copied(file, folder))?
            }
        };
        Ok(named.persist(place)?)
    }
}

fn builder() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX).rand_bytes(RANDOM);
    builder
}

/// A file with a name, locked: none that [`clear`] may take away.
fn named(folder: &Path) -> io::Result<NamedTempFile> {
    loop {
        let file = builder().tempfile_in(folder)?;
        // not every disk has locks; nothing is cleared there
        let _ = file.as_file().lock();
        // it may have been cleared before it was locked
        if file.path().exists() {
            return Ok(file);
        }
    }
}

fn copied(mut file: File, folder: &Path) -> io::Result<TempPath> {
    let mut copy = named(folder)?;
    io::Seek::rewind(&mut file)?;
    io::copy(&mut file, &mut copy)?;
    copy.as_file().set_permissions(file.metadata()?.permissions())?;
    copy.as_file().sync_all()?;
    Ok(copy.into_temp_path())
}

#[cfg(target_os = "linux")]
fn unnamed(folder: &Path) -> Option<File> {
    use std::os::unix::fs::OpenOptionsExt;
    let flags = rustix::fs::OFlags::TMPFILE.bits() as i32;
    let file = OpenOptions::new().read(true).write(true).mode(0o600).custom_flags(flags).open(folder).ok()?;
    // locked before it has a name
    let _ = file.lock();
    descriptor(&file).exists().then_some(file)
}

#[cfg(not(target_os = "linux"))]
fn unnamed(_: &Path) -> Option<File> {
    None
}

#[cfg(target_os = "linux")]
fn link(file: &File, path: &Path) -> io::Result<()> {
    use rustix::fs::{AtFlags, CWD, linkat};
    Ok(linkat(CWD, descriptor(file), CWD, path, AtFlags::SYMLINK_FOLLOW)?)
}

#[cfg(not(target_os = "linux"))]
fn link(_: &File, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Where the system shows an open file.
#[cfg(target_os = "linux")]
fn descriptor(file: &File) -> PathBuf {
    format!("/proc/self/fd/{}", std::os::fd::AsRawFd::as_raw_fd(file)).into()
}

/// Takes what killed commands left out of `folder`, once a process.
fn clear(folder: &Path) {
    static CLEARED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    if CLEARED.lock().unwrap_or_else(PoisonError::into_inner).insert(folder.to_path_buf()) {
        clear_now(folder);
    }
}

fn clear_now(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten().filter(|e| is_temporary(&e.file_name().to_string_lossy())) {
        let path = entry.path();
        if entry.file_type().is_ok_and(|t| t.is_file())
            && let Ok(file) = OpenOptions::new().write(true).open(&path)
            && file.try_lock().is_ok()
        {
            // who cannot remove it leaves it to the next one
            let _ = fs::remove_file(path);
        }
    }
}

fn is_temporary(name: &str) -> bool {
    let random = name.strip_prefix(PREFIX).and_then(|name| name.strip_suffix(SUFFIX));
    random.is_some_and(|name| name.len() == RANDOM && name.bytes().all(|b| b.is_ascii_alphanumeric()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn a_file_gets_to_its_place_with_a_name_and_without() {
        let dir = tempfile::tempdir().unwrap();
        let (dir, place) = (dir.path(), dir.path().join("a.txt"));
        for text in ["first", "next"] {
            let mut file = Temporary::beside(dir).unwrap();
            file.file().write_all(text.as_bytes()).unwrap();
            file.persist(dir, &place).unwrap();
            let mut file = named(dir).unwrap();
            file.write_all(b"x").unwrap();
            let copy = copied(file.reopen().unwrap(), dir).unwrap();
            assert_eq!((fs::read(&place).unwrap(), fs::read(&copy).unwrap()), (text.into(), b"x".to_vec()));
            Temporary::Named(file).persist(dir, &dir.join(text)).unwrap();
        }
        assert_eq!(fs::read_dir(dir).unwrap().count(), 3);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_file_without_a_name_is_not_seen() {
        let dir = tempfile::tempdir().unwrap();
        // some disks have none
        if let Some(file) = unnamed(dir.path()) {
            assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
            // also for one moment under a name, it is locked
            let path = dir.path().join(".gyroid-aaaaaa.tmp");
            link(&file, &path).unwrap();
            clear_now(dir.path());
            assert!(path.exists());
            drop(file);
            clear_now(dir.path());
            assert!(!path.exists());
        }
    }

    #[test]
    fn what_a_killed_command_left_is_cleared_and_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let held = named(dir.path()).unwrap();
        let others = [".gyroid-abc.tmp", ".gyroid-abcdef.toml", "x.gyroid-abcdef.tmp", ".gyroid-ab.def.tmp"];
        for name in others.iter().chain(&[".gyroid-abcdef.tmp"]) {
            fs::write(dir.path().join(name), "half").unwrap();
        }
        clear_now(dir.path());
        assert!(held.path().exists() && others.iter().all(|name| dir.path().join(name).exists()));
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), others.len() + 1);
    }
}
