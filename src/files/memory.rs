//! Data in memory where a path is asked for, as GDAL has it under `/vsimem/`: what is written to a [`Place`] is kept there,
//! and what was put there is read by whatever reads files of that kind. Bindings hand data in and take results out by this.

use std::any::Any;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, LazyLock, PoisonError, RwLock};

type Content = Arc<dyn Any + Send + Sync>;

/// Content by path. Nothing between taking and leaving the lock can panic.
static PLACES: LazyLock<RwLock<HashMap<PathBuf, Content>>> = LazyLock::new(RwLock::default);
static NEXT: AtomicU64 = AtomicU64::new(1);

/// A path that stands for data in memory until it is dropped.
#[derive(Debug)]
pub struct Place {
    path: PathBuf,
}

impl Place {
    /// An empty place whose file name is `name`; the ending says what may be written there, as for a file.
    #[must_use]
    pub fn new(name: &str) -> Self {
        let path = PathBuf::from(format!("memory:{}/{name}", NEXT.fetch_add(1, Ordering::Relaxed)));
        store(&path, Arc::new(()));
        Self { path }
    }

    /// A place that holds the bytes of a file.
    #[must_use]
    pub fn with_bytes(name: &str, bytes: Vec<u8>) -> Self {
        let place = Self::new(name);
        put(&place.path, bytes);
        place
    }

    /// The path, unique in this process.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The part of the path that is not the name: what a message to people should be without.
    #[must_use]
    pub fn prefix(&self) -> String {
        let text = self.path.to_string_lossy();
        text.find('/').map_or_else(String::new, |end| text[..=end].to_string())
    }

    /// The bytes that were written, if any were.
    #[must_use]
    pub fn bytes(&self) -> Option<Arc<Vec<u8>>> {
        get(&self.path)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        PLACES.write().unwrap_or_else(PoisonError::into_inner).remove(&self.path);
    }
}

fn store(path: &Path, content: Content) {
    PLACES.write().unwrap_or_else(PoisonError::into_inner).insert(path.to_path_buf(), content);
}

/// Whether `path` is a place in memory.
pub(crate) fn is_place(path: &Path) -> bool {
    PLACES.read().unwrap_or_else(PoisonError::into_inner).contains_key(path)
}

/// Puts `content` at `path`, which is a place.
pub(crate) fn put<T: Any + Send + Sync>(path: &Path, content: T) {
    store(path, Arc::new(content));
}

/// Content at `path`; `None` where it is no place or holds something else.
pub(crate) fn get<T: Any + Send + Sync>(path: &Path) -> Option<Arc<T>> {
    let content = PLACES.read().unwrap_or_else(PoisonError::into_inner).get(path).cloned()?;
    content.downcast().ok()
}

/// The bytes of a file, or of a place in memory.
pub(crate) fn read(path: &Path) -> std::io::Result<Vec<u8>> {
    get::<Vec<u8>>(path).map_or_else(|| std::fs::read(path), |bytes| Ok(bytes.to_vec()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::{OutputFile, sha256};

    #[test]
    fn a_place_holds_what_is_written_until_it_is_dropped() {
        let place = Place::new("a.toml");
        let path = place.path().to_path_buf();
        assert!(place.bytes().is_none() && is_place(&path));
        let mut file = OutputFile::claim(&path).unwrap();
        file.write_all(b"x = ").unwrap();
        file.write_all(b"1").unwrap();
        assert!(place.bytes().is_none(), "not before commit");
        file.commit().unwrap();
        assert_eq!(place.bytes().unwrap().as_slice(), b"x = 1");
        assert_eq!(read(&path).unwrap(), b"x = 1");
        let on_disk = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(on_disk.path(), b"x = 1").unwrap();
        assert_eq!(sha256(&path).unwrap(), sha256(on_disk.path()).unwrap());
        assert!(path.to_string_lossy().starts_with(&place.prefix()) && path.ends_with("a.toml"));
        drop(place);
        assert!(!is_place(&path) && read(&path).is_err());
        assert!(OutputFile::claim(&path).is_err());
    }

    #[test]
    fn places_of_one_name_are_apart() {
        let (one, other) = (Place::with_bytes("log", vec![1]), Place::with_bytes("log", vec![2]));
        assert_ne!(one.path(), other.path());
        assert_eq!((one.bytes().unwrap().as_slice(), other.bytes().unwrap().as_slice()), (&[1][..], &[2][..]));
    }
}
