//! A log's bytes: opened once, unpacked where gzip's magic number stands, hashed while they pass.

use super::bytes::Unpacked;
use crate::error::{Error, ErrorKind, Result};
use flate2::read::MultiGzDecoder;
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{self, Cursor, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// How much is looked at to find out what a file is.
const HEAD_BYTES: u64 = 256 * 1024;
const GZIP_MAGIC: &[u8] = &[0x1f, 0x8b];

/// A file with its first bytes, already unpacked.
pub(crate) struct Input {
    /// Where it lies.
    pub path: PathBuf,
    /// The first bytes after unpacking.
    pub head: Vec<u8>,
    /// Whether `head` is all there is.
    pub head_is_all: bool,
    /// Whether it is packed by gzip.
    pub gzipped: bool,
    /// Whether its bytes are hashed; otherwise the hash is empty.
    pub hashed: bool,
    /// Whether rows of text that do not parse are left out.
    pub skip_bad_rows: bool,
    file: File,
    raw_head: Vec<u8>,
}

/// Counts the bytes that pass.
struct Counted<R> {
    inner: R,
    bytes: u64,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.inner.read(buffer)?;
        self.bytes += n as u64;
        Ok(n)
    }
}

/// A gzip file that unpacks to no more than [`Unpacked`] allows of what was read of it.
struct Gunzip<R> {
    inner: MultiGzDecoder<io::BufReader<Counted<R>>>,
    bytes: u64,
}

impl<R: Read> Read for Gunzip<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.inner.read(buffer)?;
        self.bytes += n as u64;
        if Unpacked::of(self.inner.get_ref().get_ref().bytes).take(self.bytes) {
            Ok(n)
        } else {
            Err(io::Error::new(io::ErrorKind::InvalidData, Unpacked::BEYOND))
        }
    }
}

/// Hash of all bytes that passed, where it is wanted.
#[derive(Clone)]
pub(crate) struct Hash(Option<Arc<Mutex<Sha256>>>);

struct Hashing<R> {
    inner: R,
    hash: Hash,
}

impl<R: Read> Read for Hashing<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.inner.read(buffer)?;
        if let Some(mut hash) = self.hash.state() {
            hash.update(&buffer[..n]);
        }
        Ok(n)
    }
}

impl Hash {
    fn new(wanted: bool) -> Self {
        Self(wanted.then(|| Arc::new(Mutex::new(Sha256::new()))))
    }

    /// Nothing between taking and leaving it can panic, so it is never half updated.
    fn state(&self) -> Option<MutexGuard<'_, Sha256>> {
        self.0.as_ref().map(|hash| hash.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The hash so far as hexadecimal digits; empty where it is not wanted.
    pub(crate) fn hex(&self) -> String {
        self.state().map_or(String::new(), |hash| hex(hash.clone()))
    }
}

fn hex(hash: Sha256) -> String {
    hash.finalize().iter().map(|b| format!("{b:02x}")).collect()
}

impl Input {
    /// Opens `path` and reads its head.
    pub(crate) fn open(path: &Path) -> Result<Self> {
        let fail = |e: &io::Error| Error::io(path, e);
        let mut file = File::open(path).map_err(|e| fail(&e))?;
        if file.metadata().map_err(|e| fail(&e))?.is_dir() {
            return Err(
                Error::new(ErrorKind::Io, path.display(), "is a directory, not a log").hint("name a file in it")
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
        Ok(Self {
            path: path.to_path_buf(),
            head,
            head_is_all,
            gzipped,
            hashed: true,
            skip_bad_rows: false,
            file,
            raw_head,
        })
    }

    /// The unpacked content from its beginning, and the hash of the packed one, complete when the end was reached.
    pub(crate) fn into_stream(self) -> (Box<dyn Read + Send>, Hash) {
        let hash = Hash::new(self.hashed);
        let hashed = Hashing { inner: Cursor::new(self.raw_head).chain(self.file), hash: hash.clone() };
        let stream: Box<dyn Read + Send> = if self.gzipped {
            let counted = Counted { inner: hashed, bytes: 0 };
            Box::new(Gunzip { inner: MultiGzDecoder::new(io::BufReader::with_capacity(128 * 1024, counted)), bytes: 0 })
        } else {
            Box::new(io::BufReader::with_capacity(128 * 1024, hashed))
        };
        (stream, hash)
    }

    /// The file for readers that need to jump in it, and its hash.
    pub(crate) fn into_file(self) -> Result<(File, String)> {
        let (file, hash) = self.into_file_at_once()?;
        Ok((file, hash.hex()?))
    }

    /// The same, the hash still to come from another thread.
    pub(crate) fn into_file_at_once(mut self) -> Result<(File, PendingHash)> {
        let fail = |e: &io::Error| Error::io(&self.path, e);
        let ordinary = self.file.metadata().map_err(|e| fail(&e))?.is_file();
        if self.gzipped || !ordinary {
            let found = "this format cannot be read from a gzip file or a pipe";
            return Err(Error::new(ErrorKind::Format, self.path.display(), found).hint("unpack it into a file first"));
        }
        self.file.seek(SeekFrom::Start(0)).map_err(|e| fail(&e))?;
        let hash = PendingHash::of(&self.path, &self.file, self.hashed)?;
        Ok((self.file, hash))
    }
}

/// A file's hash in the making. Nobody waits for the end of one that is dropped.
pub(crate) struct PendingHash {
    path: PathBuf,
    stop: Stop,
    /// None where no hash is wanted.
    thread: Option<JoinHandle<io::Result<String>>>,
}

/// Ends the hashing when it is dropped.
struct Stop(Arc<AtomicBool>);

impl Drop for Stop {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

impl PendingHash {
    /// Bytes between two looks at whether the hash is still wanted.
    const PIECE: usize = 1 << 20;

    fn of(path: &Path, file: &File, wanted: bool) -> Result<Self> {
        let fail = |e: &io::Error| Error::io(path, e);
        let stop = Arc::new(AtomicBool::new(false));
        if !wanted {
            return Ok(Self { path: path.to_path_buf(), stop: Stop(stop), thread: None });
        }
        let (stopped, mut bytes) = (stop.clone(), FromStart::of(path, file).map_err(|e| fail(&e))?);
        let work = move || {
            let mut hash = Sha256::new();
            let mut piece = vec![0; Self::PIECE];
            loop {
                let n = bytes.read(&mut piece)?;
                hash.update(&piece[..n]);
                if n == 0 || stopped.load(Ordering::Relaxed) {
                    return Ok(hex(hash));
                }
            }
        };
        let thread = std::thread::Builder::new().spawn(work).map_err(|e| fail(&e))?;
        Ok(Self { path: path.to_path_buf(), stop: Stop(stop), thread: Some(thread) })
    }

    /// The hash of all of the file as hexadecimal digits, when it is there.
    pub(crate) fn hex(self) -> Result<String> {
        let Self { path, stop, thread } = self;
        let Some(thread) = thread else { return Ok(String::new()) };
        let done = thread.join().unwrap_or_else(|_| Err(io::Error::other("hashing it failed")));
        drop(stop);
        done.map_err(|e| Error::io(&path, &e))
    }
}

/// The bytes of a file, wherever others that read it stand.
struct FromStart {
    file: File,
    #[cfg(unix)]
    at: u64,
}

#[cfg(unix)]
impl FromStart {
    fn of(_: &Path, file: &File) -> io::Result<Self> {
        Ok(Self { file: file.try_clone()?, at: 0 })
    }
}

#[cfg(unix)]
impl Read for FromStart {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = std::os::unix::fs::FileExt::read_at(&self.file, buffer, self.at)?;
        self.at += n as u64;
        Ok(n)
    }
}

#[cfg(not(unix))]
impl FromStart {
    fn of(path: &Path, _: &File) -> io::Result<Self> {
        Ok(Self { file: File::open(path)? })
    }
}

#[cfg(not(unix))]
impl Read for FromStart {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.file.read(buffer)
    }
}

/// Error of a gzip file that is truncated or damaged, with the remedy.
pub(crate) fn broken_gzip(path: &Path, error: &io::Error) -> Error {
    let what = match error.kind() {
        io::ErrorKind::UnexpectedEof => "the gzip file is truncated".to_string(),
        _ => format!("the gzip file is damaged: {error}"),
    };
    Error::new(ErrorKind::Format, path.display(), what)
        .hint("copy the file again; `zcat FILE > part.csv` saves what can be read")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn the_hash_of_a_file_is_that_of_its_stream_wherever_the_file_stands() {
        for len in [0, 1, 1 << 20, (3 << 20) + 17] {
            let bytes: Vec<u8> = (0..len).map(|i: usize| ((i * i) >> 7) as u8).collect();
            let mut file = tempfile::NamedTempFile::new().unwrap();
            file.write_all(&bytes).unwrap();
            let (mut handle, pending) = Input::open(file.path()).unwrap().into_file_at_once().unwrap();
            let mut read = Vec::new();
            handle.read_to_end(&mut read).unwrap();
            assert!(read == bytes);
            let (mut stream, hash) = Input::open(file.path()).unwrap().into_stream();
            io::copy(&mut stream, &mut io::sink()).unwrap();
            assert_eq!(pending.hex().unwrap(), hash.hex());
            assert_eq!(Input::open(file.path()).unwrap().into_file().unwrap().1, hash.hex());
            let unhashed = || Input { hashed: false, ..Input::open(file.path()).unwrap() };
            assert_eq!(unhashed().into_file().unwrap().1, "");
            let (mut stream, hash) = unhashed().into_stream();
            assert_eq!((io::copy(&mut stream, &mut io::sink()).unwrap(), hash.hex()), (len as u64, String::new()));
        }
    }
}
