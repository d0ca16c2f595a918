//! A log's bytes: opened once, unpacked where gzip's magic number stands, hashed while they pass.

use crate::error::{Error, ErrorKind, Result};
use flate2::read::MultiGzDecoder;
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{self, Cursor, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// How much is looked at to find out what a file is.
const HEAD_BYTES: u64 = 256 * 1024;
const GZIP_MAGIC: &[u8] = &[0x1f, 0x8b];

/// A file with its first bytes, already unpacked.
pub(super) struct Input {
    /// Where it lies.
    pub path: PathBuf,
    /// The first bytes after unpacking.
    pub head: Vec<u8>,
    /// Whether `head` is all there is.
    pub head_is_all: bool,
    /// Whether it is packed by gzip.
    pub gzipped: bool,
    file: File,
    raw_head: Vec<u8>,
}

/// Hash of all bytes that passed.
#[derive(Clone)]
pub(super) struct Hash(Arc<Mutex<Sha256>>);

struct Hashing<R> {
    inner: R,
    hash: Hash,
}

impl<R: Read> Read for Hashing<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.inner.read(buffer)?;
        self.hash.state().update(&buffer[..n]);
        Ok(n)
    }
}

impl Hash {
    fn new() -> Self {
        Self(Arc::new(Mutex::new(Sha256::new())))
    }

    /// Nothing between taking and leaving it can panic, so it is never half updated.
    fn state(&self) -> MutexGuard<'_, Sha256> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The hash so far as hexadecimal digits.
    pub fn hex(&self) -> String {
        self.state().clone().finalize().iter().map(|b| format!("{b:02x}")).collect()
    }
}

impl Input {
    /// Opens `path` and reads its head.
    pub fn open(path: &Path) -> Result<Self> {
        let fail = |e: &io::Error| Error::io(path, e);
        let mut file = File::open(path).map_err(|e| fail(&e))?;
        if file.metadata().map_err(|e| fail(&e))?.is_dir() {
            return Err(
                Error::new(ErrorKind::Io, path.display(), "is a directory, not a log").mend("name a file in it")
            );
        }
        let mut raw_head = Vec::new();
        (&mut file).take(HEAD_BYTES).read_to_end(&mut raw_head).map_err(|e| fail(&e))?;
        let all = (raw_head.len() as u64) < HEAD_BYTES;
        let gzipped = raw_head.starts_with(GZIP_MAGIC);
        let (head, head_is_all) = if gzipped {
            let mut unpacked = Vec::new();
            // the packed head ends in the middle of a block: what comes out before that error is the head
            let end = MultiGzDecoder::new(raw_head.as_slice()).take(HEAD_BYTES).read_to_end(&mut unpacked);
            if unpacked.is_empty()
                && all
                && let Err(e) = end
            {
                return Err(broken_gzip(path, &e));
            }
            let complete = all && end.is_ok() && (unpacked.len() as u64) < HEAD_BYTES;
            (unpacked, complete)
        } else {
            (raw_head.clone(), all)
        };
        Ok(Self { path: path.to_path_buf(), head, head_is_all, gzipped, file, raw_head })
    }

    /// The unpacked content from its beginning, and the hash of the packed one, complete when the end was reached.
    pub fn into_stream(self) -> (Box<dyn Read + Send>, Hash) {
        let hash = Hash::new();
        let raw = Hashing { inner: Cursor::new(self.raw_head).chain(self.file), hash: hash.clone() };
        let raw = io::BufReader::with_capacity(128 * 1024, raw);
        let stream: Box<dyn Read + Send> =
            if self.gzipped { Box::new(MultiGzDecoder::new(raw)) } else { Box::new(raw) };
        (stream, hash)
    }

    /// The file for readers that need to jump in it, and its hash.
    pub fn into_file(mut self) -> Result<(File, String)> {
        let fail = |e: &io::Error| Error::io(&self.path, e);
        let ordinary = self.file.metadata().map_err(|e| fail(&e))?.is_file();
        if self.gzipped || !ordinary {
            let found = "this format cannot be read from a gzip file or a pipe";
            return Err(Error::new(ErrorKind::Format, self.path.display(), found).mend("unpack it into a file first"));
        }
        self.file.seek(SeekFrom::Start(0)).map_err(|e| fail(&e))?;
        let hash = Hash::new();
        io::copy(&mut Hashing { inner: &self.file, hash: hash.clone() }, &mut io::sink()).map_err(|e| fail(&e))?;
        self.file.seek(SeekFrom::Start(0)).map_err(|e| fail(&e))?;
        Ok((self.file, hash.hex()))
    }
}

/// What a gzip error means to the one who has the file.
pub(super) fn broken_gzip(path: &Path, error: &io::Error) -> Error {
    let what = match error.kind() {
        io::ErrorKind::UnexpectedEof => "the gzip file is truncated".to_string(),
        _ => format!("the gzip file is damaged: {error}"),
    };
    Error::new(ErrorKind::Format, path.display(), what)
        .mend("copy the file again; `zcat FILE > part.csv` saves what can be read")
}
