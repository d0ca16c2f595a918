//! Results of several runs as one: each log, topic and axis once, in the order in which one run over all of them has them
//!
//! The result is the same in whatever order the parts come, and however often one of them comes: a log is known by the bytes of its
//! file, and of two rows of it one that was fitted stays before one that failed.

use super::results;
use super::source::{Record, Source};
use crate::error::{Error, ErrorKind, Result};
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Rows of several results, and how many came more than once.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Merged<R> {
    pub rows: Vec<R>,
    /// Rows that stand for a log, topic and axis that another row stands for.
    pub repeated: usize,
}

/// Reads and merges the results in the files `parts`.
///
/// # Errors
/// As [`results::read`] and [`merge`].
pub(crate) fn read_merged<R: Record>(parts: &[PathBuf]) -> Result<Merged<R>> {
    merge(parts.iter().map(|path| Ok((path.clone(), results::read(path)?))).collect::<Result<_>>()?)
}

/// Merges the rows of `parts`, each with the name of its file.
///
/// # Errors
/// [`ErrorKind::Value`] where two parts were made with different options or versions: their rows are no one population.
fn merge<R: Record>(parts: Vec<(PathBuf, Vec<R>)>) -> Result<Merged<R>> {
    let mut first: Option<(PathBuf, String)> = None;
    let mut kept: BTreeMap<_, R> = BTreeMap::new();
    let mut all = 0;
    for (file, rows) in parts {
        for row in rows {
            all += 1;
            let made = format!("gyroid {} with {}", row.source().gyroid_version, row.source().options);
            let (other, alike) = first.get_or_insert_with(|| (file.clone(), made.clone()));
            if *alike != made {
                let found = format!("was made by {made}, and {} by {alike}", other.display());
                return Err(Error::new(ErrorKind::Value, file.display(), found)
                    .hint("make all parts by one version with the same options"));
            }
            kept.entry(row.source().key())
                .and_modify(|held| {
                    if before(row.source(), held.source()) == Ordering::Less {
                        held.clone_from(&row);
                    }
                })
                .or_insert(row);
        }
    }
    let mut rows: Vec<R> = kept.into_values().collect();
    let repeated = all - rows.len();
    rows.sort_by(|a, b| in_a_folder(a.source(), b.source()));
    Ok(Merged { rows, repeated })
}

/// Which of two rows of one log stays: the lesser one.
fn before(a: &Source, b: &Source) -> Ordering {
    let failed = a.error.is_some().cmp(&b.error.is_some());
    failed.then_with(|| in_a_folder(a, b)).then_with(|| a.error.cmp(&b.error)).then_with(|| a.modified.cmp(&b.modified))
}

/// The order in which [`super::find()`] lists logs.
fn in_a_folder(a: &Source, b: &Source) -> Ordering {
    let path = Path::new(&a.path).cmp(Path::new(&b.path));
    path.then_with(|| a.topic.cmp(&b.topic)).then_with(|| a.axis.cmp(&b.axis))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::population::Row;

    fn row(path: &str, sha256: &str, error: Option<&str>) -> Row {
        let error = error.map(Into::into);
        let (path, sha256) = (path.into(), sha256.into());
        Row::of(Source { path, sha256, axis: "z".into(), options: "{}".into(), error, ..Source::default() })
    }

    fn merged(parts: &[&[Row]]) -> Merged<Row> {
        merge(parts.iter().map(|rows| ("part.csv".into(), rows.to_vec())).collect()).unwrap()
    }

    #[test]
    fn neither_order_nor_repetition_matters() {
        let a = [row("logs/a.csv", "1", None), row("logs/b/a.csv", "2", Some("no time"))];
        let b = [row("logs/b.csv", "3", None), row("logs/gone.csv", "", Some("not found"))];
        let once = merged(&[&a, &b]);
        assert_eq!((once.rows.len(), once.repeated), (4, 0));
        assert_eq!(merged(&[&b, &a]), once);
        let twice = merged(&[&b, &once.rows, &a, &b]);
        assert_eq!((&twice.rows, twice.repeated), (&once.rows, 6));
        assert_eq!(merged(&[]).rows, []);
    }

    #[test]
    fn of_a_log_that_was_tried_again_the_fit_stays() {
        let (failed, fitted) = (row("a.csv", "1", Some("disk")), row("copy/a.csv", "1", None));
        for parts in [[&failed, &fitted], [&fitted, &failed]] {
            let got = merged(&parts.map(std::slice::from_ref));
            assert_eq!((got.rows, got.repeated), (vec![fitted.clone()], 1));
        }
    }

    #[test]
    fn parts_that_were_made_otherwise_are_refused() {
        let mut other = row("b.csv", "2", None);
        other.source.options = "{\"loss\":\"huber\"}".into();
        let parts = vec![("one.csv".into(), vec![row("a.csv", "1", None)]), ("two.csv".into(), vec![other])];
        let error = merge(parts).unwrap_err();
        assert!(
            error.input == "two.csv" && error.found.contains("huber") && error.found.contains("one.csv"),
            "{error}"
        );
    }
}
