//! Rows of many tasks, some tasks at a time, on as many threads.

use super::source::{Record, Source};
use crate::error::{Error, ErrorKind, Result};
use crate::files;
use std::any::Any;
use std::collections::HashMap;
use std::fmt;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

/// Where a row comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Origin {
    /// The log was read and worked on, or failed to be.
    Fitted,
    /// It was known from an earlier run.
    Resumed,
}

/// Result of a run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Done<R> {
    /// The rows, in the order of the tasks.
    pub rows: Vec<R>,
    /// Rows whose log was read and worked on now.
    pub fitted: usize,
    /// Rows that were known.
    pub resumed: usize,
}

/// Rows of an earlier run that hold for this one: made by this version with the same options, and no error.
pub(crate) struct Known<'a, R>(HashMap<(String, Option<String>, String), &'a R>);

impl<'a, R: Record> Known<'a, R> {
    pub(crate) fn of(rows: &'a [R], options: &str) -> Self {
        let alike = |s: &Source| {
            s.options == options
                && s.gyroid_version == env!("CARGO_PKG_VERSION")
                && s.error.is_none()
                && !s.sha256.is_empty()
        };
        Self(rows.iter().filter(|r| alike(r.source())).map(|r| (r.source().key(), r)).collect())
    }

    /// Those of the log `path`, one for each of its `sources`, with the file's name and dates as they are now.
    pub(crate) fn rows(&self, path: &Path, sources: &[Source]) -> Vec<Option<R>> {
        let sha256 = if self.0.is_empty() { None } else { files::sha256(path).ok() };
        let Some(sha256) = sha256 else { return vec![None; sources.len()] };
        let one = |source: &Source| {
            let mut row = (*self.0.get(&(sha256.clone(), source.topic.clone(), source.axis.clone()))?).clone();
            let now = source.clone();
            let held = row.source_mut();
            (held.path, held.size_bytes, held.modified) = (now.path, now.size_bytes, now.modified);
            Some(row)
        };
        sources.iter().map(one).collect()
    }
}

fn no_threads(e: &dyn fmt::Display) -> Error {
    Error::new(ErrorKind::Numeric, "--jobs", format!("no thread can be started: {e}")).hint("ask for fewer jobs")
}

fn pool(jobs: usize) -> Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new().num_threads(jobs).build().map_err(|e| no_threads(&e))
}

/// Does `work` with `jobs` threads for what is parallel in it.
///
/// # Errors
/// [`ErrorKind::Numeric`] if no thread can be started.
pub(super) fn within<T: Send>(jobs: usize, work: impl FnOnce() -> T + Send) -> Result<T> {
    Ok(pool(jobs)?.install(work))
}

/// Makes the rows of each of `tasks`, `each_has` of every one, `jobs` (at least one) at a time, on as many threads. `each` sees every row as soon
/// as it is there, in no certain order.
///
/// # Errors
/// That of `each`, which ends the work after the tasks in hand; [`ErrorKind::Numeric`] if no thread can be started.
pub(crate) fn run_all<T: Sync, R: Record>(
    tasks: &[T],
    each_has: usize,
    jobs: usize,
    rows_of: &(dyn Fn(&T) -> Vec<(R, Origin)> + Sync),
    each: &mut dyn FnMut(&R, Origin) -> Result<()>,
) -> Result<Done<R>> {
    // the work on a log is parallel itself: in one pool all keep to `jobs` threads
    let pool = pool(jobs)?;
    let (next, stop) = (AtomicUsize::new(0), AtomicBool::new(false));
    let mut slots: Vec<Option<(R, Origin)>> = vec![None; tasks.len() * each_has];
    let failed = thread::scope(|scope| {
        let (send, receive) = mpsc::channel();
        for _ in 0..jobs.min(tasks.len()) {
            let send = send.clone();
            let (next, stop, pool) = (&next, &stop, &pool);
            let turn = move || {
                while !stop.load(Ordering::Relaxed) {
                    let at = next.fetch_add(1, Ordering::Relaxed);
                    let Some(task) = tasks.get(at) else { break };
                    let done = pool.install(|| rows_of(task));
                    if send.send((at, done)).is_err() {
                        break;
                    }
                }
            };
            if let Err(e) = thread::Builder::new().spawn_scoped(scope, turn) {
                stop.store(true, Ordering::Relaxed);
                return Some(no_threads(&e));
            }
        }
        drop(send);
        for (at, rows) in receive {
            for (i, (row, origin)) in rows.into_iter().enumerate() {
                if let Err(e) = each(&row, origin) {
                    stop.store(true, Ordering::Relaxed);
                    return Some(e);
                }
                slots[at * each_has + i] = Some((row, origin));
            }
        }
        None
    });
    if let Some(error) = failed {
        return Err(error);
    }
    let (rows, origins): (Vec<R>, Vec<Origin>) = slots.into_iter().flatten().unzip();
    let fitted = origins.iter().filter(|o| **o == Origin::Fitted).count();
    Ok(Done { fitted, resumed: rows.len() - fitted, rows })
}

/// The error of a log on which the program itself failed.
pub(crate) fn fault(path: &Path, why: &(dyn Any + Send)) -> Error {
    let said = why.downcast_ref::<String>().map(String::as_str).or(why.downcast_ref::<&str>().copied());
    let found = format!("the program failed on this log: {}", said.unwrap_or("it does not say why"));
    Error::new(ErrorKind::Numeric, path.display(), found).hint("report it with the log")
}
