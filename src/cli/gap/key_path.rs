//! Place of the key to the labels of a bench.

use std::path::{Path, PathBuf};

/// DIR.key beside DIR.
pub(super) fn beside(folder: &Path) -> PathBuf {
    let name = folder.file_name().map_or_else(|| "bench".into(), |n| n.to_string_lossy().into_owned());
    folder.with_file_name(format!("{name}.key"))
}
