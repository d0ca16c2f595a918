//! A file read record by record, with the place of every byte.

use crate::error::{Error, ErrorKind, Result};
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Why a file cannot be read on.
pub(crate) enum Flaw {
    /// The file ends here.
    Cut,
    /// No valid record begins here, or it cannot be unpacked; the text says why.
    Damaged(String),
    /// An error of the caller that takes the records, or of the disk.
    Error(Error),
}

impl From<Error> for Flaw {
    fn from(error: Error) -> Self {
        Self::Error(error)
    }
}

/// Most bytes that a file may hold once it is unpacked: 64 MiB, and 256 times its own size. Logs are packed three to thirty to one; what
/// is beyond that was made to fill a memory.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Unpacked {
    left: u64,
}

impl Unpacked {
    const ANYWAY: u64 = 64 << 20;
    const TIMES: u64 = 256;
    /// Said of a file that holds more.
    pub(crate) const BEYOND: &'static str = "it unpacks to more than 64 MiB and 256 times its size";

    /// Of a file of so many bytes.
    pub(crate) fn of(file_bytes: u64) -> Self {
        Self { left: Self::ANYWAY.saturating_add(file_bytes.saturating_mul(Self::TIMES)) }
    }

    /// Bytes that may still be unpacked.
    pub(crate) fn left(&self) -> u64 {
        self.left
    }

    /// Takes off what is unpacked; false where it is too much.
    #[must_use]
    pub(crate) fn take(&mut self, bytes: u64) -> bool {
        let rest = self.left.checked_sub(bytes);
        self.left = rest.unwrap_or(0);
        rest.is_some()
    }
}

/// An open file and where it is read.
pub(crate) struct Bytes {
    path: PathBuf,
    inner: BufReader<File>,
    at: u64,
    len: u64,
}

impl Bytes {
    /// Begins at byte `at` of `file`.
    pub(crate) fn open(path: &Path, file: &File, at: u64) -> Result<Self> {
        let fail = |e: &std::io::Error| Error::io(path, e);
        let mut file = file.try_clone().map_err(|e| fail(&e))?;
        let len = file.metadata().map_err(|e| fail(&e))?.len();
        file.seek(SeekFrom::Start(at)).map_err(|e| fail(&e))?;
        Ok(Self { path: path.to_path_buf(), inner: BufReader::with_capacity(256 * 1024, file), at, len })
    }

    /// Offset of the next byte.
    pub(crate) fn at(&self) -> u64 {
        self.at
    }

    /// Bytes in the file.
    pub(crate) fn len(&self) -> u64 {
        self.len
    }

    /// Bytes from here to the end.
    pub(crate) fn left(&self) -> u64 {
        self.len.saturating_sub(self.at)
    }

    /// Replaces `buffer` by the next `n` bytes, or by fewer where the file ends; says whether all were there. What is
    /// asked for is never reserved before the file is known to hold it.
    pub(crate) fn next(&mut self, n: u64, buffer: &mut Vec<u8>) -> Result<bool> {
        buffer.clear();
        let there = n.min(self.left());
        let read = (&mut self.inner).take(there).read_to_end(buffer).map_err(|e| Error::io(&self.path, &e))?;
        self.at += read as u64;
        Ok(read as u64 == n)
    }

    /// Passes over `n` bytes, or to the end; says whether all were there.
    pub(crate) fn skip(&mut self, n: u64) -> Result<bool> {
        let there = n.min(self.left());
        self.inner.seek_relative(there.cast_signed()).map_err(|e| Error::io(&self.path, &e))?;
        self.at += there;
        Ok(there == n)
    }

    /// Goes to byte `at`.
    pub(crate) fn seek(&mut self, at: u64) -> Result<()> {
        let by = at.cast_signed().wrapping_sub(self.at.cast_signed());
        self.inner.seek_relative(by).map_err(|e| Error::io(&self.path, &e))?;
        self.at = at;
        Ok(())
    }

    /// Damage at byte `at`.
    pub(crate) fn damaged(&self, at: u64, found: impl std::fmt::Display) -> Error {
        Error::new(ErrorKind::Format, self.path.display(), found).at(format!("byte {at}"))
    }
}

/// Little-endian numbers at an offset of a record; none beyond its end.
pub(crate) trait Little {
    fn array<const N: usize>(&self, at: usize) -> Option<[u8; N]>;

    fn u8(&self, at: usize) -> Option<u8> {
        self.array::<1>(at).map(|b| b[0])
    }

    fn u16(&self, at: usize) -> Option<u16> {
        self.array(at).map(u16::from_le_bytes)
    }

    fn u32(&self, at: usize) -> Option<u32> {
        self.array(at).map(u32::from_le_bytes)
    }

    fn u64(&self, at: usize) -> Option<u64> {
        self.array(at).map(u64::from_le_bytes)
    }
}

impl Little for [u8] {
    fn array<const N: usize>(&self, at: usize) -> Option<[u8; N]> {
        self.get(at..at.checked_add(N)?)?.try_into().ok()
    }
}
