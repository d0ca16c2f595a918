//! A bench on disk: one folder a case (`sim.toml`, `fit.parquet`, `hold.parquet`), sealed labels, and the order.
//!
//! Some cases have `fit.csv` instead, or a file a sensor: `fit_imu.csv`, `fit_wheels.csv`, `fit_pose.csv`.

use super::seal::{SealKey, random_bytes, seal};
use super::workers::each;
use super::worlds;
use super::worlds::{Case, Label, Mix};
use crate::config::Kind;
use crate::error::{Error, ErrorKind, Result};
use crate::files::OutputFile;
use crate::ingest::{DriveQuery, read_drive, write_log};
use crate::signal::Log;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{File, FileTimes};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// File with the sealed labels.
pub(crate) const SEALED: &str = "labels.sealed";
/// File with the commitment to them.
pub(crate) const COMMITMENT: &str = "commitment.txt";
/// File with the description of the bench: [`Bench`].
pub(crate) const BENCH: &str = "bench.json";

/// Order of a bench.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Order {
    /// At rest or driving.
    pub kind: Kind,
    /// Numbers of cases of each sort.
    pub mix: Mix,
    /// Seed; without one it is drawn at random and sealed with the labels, so that nobody can make the labels again.
    pub seed: Option<u64>,
}

/// Public description of a bench, without its labels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Bench {
    /// Version that made it.
    pub gyroid_version: String,
    /// Seed, where it was given; whoever knows it can make the labels again.
    pub seed: Option<u64>,
    /// At rest or driving.
    #[serde(default)]
    pub kind: Kind,
    /// Numbers of cases of each sort that were ordered.
    pub mix: Mix,
    /// SHA-256 of the plain labels.
    pub commitment: String,
}

/// A bench that was made.
#[derive(Debug, Clone)]
pub(crate) struct Made {
    /// Content of `bench.json`.
    pub bench: Bench,
    /// The key to the labels: to be stored away from the folder.
    pub key: SealKey,
    /// The labels, in the open: for development only.
    pub labels: BTreeMap<String, Label>,
}

/// Makes the cases of `order` in `folder`, which must be new or empty; `progress` is called with (done, all).
///
/// # Errors
/// [`ErrorKind::Usage`] for a folder that holds something, or shares that do not add up; [`ErrorKind::Io`].
pub(crate) fn make(folder: &Path, order: &Order, progress: impl Fn(usize, usize) + Sync) -> Result<Made> {
    let seed = match order.seed {
        Some(seed) => seed,
        None => random_bytes()?.iter().take(8).fold(0, |sum, b| sum << 8 | u64::from(*b)),
    };
    let plan = worlds::plan(&order.mix, order.kind, seed)?;
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, &e))?;
    let holds = std::fs::read_dir(folder).map_err(|e| Error::io(folder, &e))?.next().is_some();
    if holds {
        return Err(Error::new(ErrorKind::Usage, folder.display(), "is not empty").hint("name a new folder"));
    }
    let making = tempfile::tempdir_in(folder).map_err(|e| Error::io(folder, &e))?;
    // as many at once as the caller's pool has threads
    let made = each(&plan, rayon::current_num_threads(), progress, |index, spec| {
        let case = worlds::make_kept(order.kind, seed, index, spec, order.mix.habits)?;
        write(making.path(), &case)?;
        Ok((case.name, case.label))
    })?;
    let labels: BTreeMap<String, Label> = made.into_iter().collect();
    copied(making.path(), folder, labels.keys()).map_err(|e| Error::io(folder, &e))?;
    drop(making);
    let key = SealKey::random()?;
    let sealed = seal(labels.clone(), seed, &key)?;
    put(&folder.join(SEALED), &sealed.bytes)?;
    put(&folder.join(COMMITMENT), format!("{}\n", sealed.commitment).as_bytes())?;
    let bench = Bench {
        gyroid_version: env!("CARGO_PKG_VERSION").into(),
        seed: order.seed,
        kind: order.kind,
        mix: order.mix,
        commitment: sealed.commitment,
    };
    put(&folder.join(BENCH), format!("{:#}\n", serde_json::json!(bench)).as_bytes())?;
    Ok(Made { bench, key, labels })
}

/// Writes one case.
fn write(folder: &Path, case: &Case) -> Result<()> {
    let place = folder.join(&case.name);
    std::fs::create_dir(&place).map_err(|e| Error::io(&place, &e))?;
    put(&place.join("sim.toml"), case.config.to_toml()?.as_bytes())?;
    case.files()?.iter().try_for_each(|(name, log)| write_log(place.join(name), log))
}

/// Copies cases one after the other, in the order of their names, and gives all files one time of change: how long a case took to
/// make, and when it was done, tell of what is in it.
fn copied<'a>(from: &Path, to: &Path, names: impl Iterator<Item = &'a String>) -> std::io::Result<()> {
    let at = FileTimes::new().set_modified(SystemTime::now()).set_accessed(SystemTime::now());
    for name in names {
        let case = to.join(name);
        std::fs::create_dir(&case)?;
        let mut files = std::fs::read_dir(from.join(name))?.collect::<std::io::Result<Vec<_>>>()?;
        files.sort_by_key(std::fs::DirEntry::file_name);
        for file in files {
            let copy = case.join(file.file_name());
            std::fs::copy(file.path(), &copy)?;
            File::options().write(true).open(copy)?.set_times(at)?;
        }
    }
    Ok(())
}

/// Files of one recording, `fit` or `hold`, of the case in this folder: one, or those of its sensors in alphabetical
/// order; none where it has no such recording.
///
/// # Errors
/// [`ErrorKind::Io`].
pub(crate) fn recording_files(case: &Path, recording: &str) -> Result<Vec<PathBuf>> {
    let is_log = |path: &Path| {
        let extension = path.extension().and_then(|e| e.to_str());
        let rest = path.file_stem().and_then(|s| s.to_str()).and_then(|s| s.strip_prefix(recording));
        matches!(extension, Some("parquet" | "csv")) && rest.is_some_and(|r| r.is_empty() || r.starts_with('_'))
    };
    let entries = std::fs::read_dir(case).map_err(|e| Error::io(case, &e))?;
    let paths = entries.map(|entry| entry.map(|e| e.path()).map_err(|e| Error::io(case, &e)));
    let mut files: Vec<PathBuf> = paths.collect::<Result<_>>()?;
    files.retain(|path| is_log(path));
    files.sort();
    Ok(files)
}

/// One recording, `fit` or `hold`, of the case in this folder; none where it has no such recording.
///
/// # Errors
/// As [`read_drive`].
pub(super) fn recording(case: &Path, recording: &str) -> Result<Option<Log>> {
    let files = recording_files(case, recording)?;
    if files.is_empty() {
        return Ok(None);
    }
    Ok(Some(read_drive(&files, &DriveQuery::default())?.log))
}

/// Writes a file whole or not at all.
pub(super) fn put(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = OutputFile::claim(path)?;
    file.write_all(bytes)?;
    file.commit()
}

/// Names of the cases in `folder`, in order.
///
/// # Errors
/// [`ErrorKind::Io`]; [`ErrorKind::Usage`] for a folder without cases.
pub(crate) fn names(folder: &Path) -> Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(|e| Error::io(folder, &e))? {
        let path = entry.map_err(|e| Error::io(folder, &e))?.path();
        if path.join("sim.toml").is_file() && !recording_files(&path, "fit")?.is_empty() {
            names.extend(path.file_name().map(|n| n.to_string_lossy().into_owned()));
        }
    }
    if names.is_empty() {
        return Err(Error::new(ErrorKind::Usage, folder.display(), "holds no case")
            .hint("a case is a folder with sim.toml and fit.parquet (or fit.csv, fit_imu.csv, ...); make some with gyroid gap bench make"));
    }
    names.sort();
    Ok(names)
}
