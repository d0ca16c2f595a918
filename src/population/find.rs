//! The logs of files and folders.

use crate::error::{Error, ErrorKind, Result};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Endings of the names of logs in a folder. The format is found from a file's content; the endings exclude notes,
/// pictures and settings, which a reader of text would try as tables. A file of another name is read if it is named
/// itself.
pub(crate) const EXTENSIONS: [&str; 18] = [
    "csv", "tsv", "csv.gz", "tsv.gz", "jsonl", "jsonl.gz", "parquet", "bag", "mcap", "db3", "ulg", "ulog", "bin",
    "mat", "h5", "hdf5", "npy", "npz",
];

/// The logs that `paths` name: files as they are, and of folders, with their folders, the files whose names end like a log's
/// (`EXTENSIONS`), by name. Hidden files and folders are passed over, links to folders not followed, and a file is listed
/// once; those of `except`, such as results that lie beside the logs, are left out of folders.
///
/// # Errors
/// [`ErrorKind::Io`] if a folder cannot be read, or holds no log.
pub(crate) fn find<P: AsRef<Path>>(paths: &[P], except: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let except: BTreeSet<PathBuf> = except.iter().filter_map(|p| p.canonicalize().ok()).collect();
    let (mut found, mut seen) = (Vec::new(), BTreeSet::new());
    for path in paths.iter().map(AsRef::as_ref) {
        let mut here = Vec::new();
        if path.is_dir() {
            walk(path, &mut here)?;
            here.retain(|p| p.canonicalize().is_ok_and(|p| !except.contains(&p)));
            if here.is_empty() {
                let found = "the directory holds no log of a known format";
                return Err(Error::new(ErrorKind::Io, path.display(), found)
                    .hint(format!("logs in it are files called .{}; name others themselves", EXTENSIONS.join(", ."))));
            }
        } else {
            here.push(path.to_path_buf());
        }
        // one that cannot be found is a row with its error later
        let first = |p: &PathBuf| !p.canonicalize().is_ok_and(|real| !seen.insert(real));
        found.extend(here.into_iter().filter(first));
    }
    Ok(found)
}

fn walk(folder: &Path, found: &mut Vec<PathBuf>) -> Result<()> {
    let fail = |e: &std::io::Error| Error::io(folder, e);
    let mut entries = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(|e| fail(&e))? {
        entries.push(entry.map_err(|e| fail(&e))?);
    }
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        let name = entry.file_name().to_string_lossy().to_lowercase();
        if name.starts_with('.') {
            continue;
        }
        let (path, kind) = (entry.path(), entry.file_type().map_err(|e| fail(&e))?);
        if kind.is_dir() {
            walk(&path, found)?;
        } else if path.is_file() && EXTENSIONS.iter().any(|e| name.ends_with(&format!(".{e}"))) {
            found.push(path);
        }
    }
    Ok(())
}
