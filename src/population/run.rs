//! Many logs fitted, some at a time; a bad one is a row with its error.

use super::axis::AxisChoice;
use super::row::Row;
use crate::bias::EarthRate;
use crate::error::{Error, ErrorKind, Result};
use crate::files;
use crate::identify::{self, FitOptions, Loss};
use crate::ingest::{GyroQuery, GyroRecording, Mounting, Reading, Stamp, gyro_topics, read_axes_within, read_gyro};
use crate::signal::names;
use crate::validate;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use serde_json::{Map, Value, json};
use std::any::Any;
use std::collections::HashMap;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

/// Which gyros of a log are fitted, where it holds messages of several topics.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) enum Topics {
    /// The topic that the query names, or the only one with a gyro.
    #[default]
    Only,
    /// These, of every log.
    Named(Vec<String>),
    /// Every one with a gyro; of a file that is one table, that table.
    All,
}

/// How the logs are read, fitted and tested: all alike.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Settings {
    /// How they are read; its axis gives way to `axes`, its topic to `topics`.
    pub query: GyroQuery,
    /// Gyros of each log.
    pub topics: Topics,
    /// Axes of each log.
    pub axes: Vec<AxisChoice>,
    /// Whether seconds that move are left out.
    pub trim_motion: bool,
    /// Their first samples are this long after power-on, s.
    pub start_offset_s: Option<f64>,
    /// The Earth's rotation as part of C2, for logs that were recorded in one place.
    pub earth: Option<EarthRate>,
    /// Options of the fit.
    pub fit: FitOptions,
    /// Options of the whiteness test.
    pub whiteness: validate::Options,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            query: GyroQuery::default(),
            topics: Topics::default(),
            axes: vec![AxisChoice::default()],
            trim_motion: false,
            start_offset_s: None,
            earth: None,
            fit: FitOptions::default(),
            whiteness: validate::Options::default(),
        }
    }
}

impl Settings {
    /// The options that are not defaults, axes and `topics` aside, as JSON: rows with the same text were made in the same way.
    #[must_use]
    pub(crate) fn text(&self) -> String {
        let (query, usual) = (&self.query, validate::Options::default());
        let fixed = self.fit.fixed;
        let all = [
            ("column", json!(query.column)),
            ("mounting", json!(query.mounting.filter(|m| *m != Mounting::ALIGNED).map(|m| m.rotation()))),
            ("unit", json!(query.unit.map(|u| u.to_string()))),
            ("time", json!(query.time)),
            ("time_unit", json!(query.time_unit.map(|u| format!("{u:?}").to_lowercase()))),
            ("rate_hz", json!(query.rate_hz)),
            ("sort_time", json!(query.sort_time.then_some(true))),
            ("topic", json!(query.topic)),
            ("clock", json!((query.stamp == Stamp::Receipt).then_some("receipt"))),
            ("trim_motion", json!(self.trim_motion.then_some(true))),
            ("start_offset_s", json!(self.start_offset_s)),
            ("latitude_deg", json!(self.earth.map(|e| e.latitude_deg))),
            ("c1_rad_s", json!(fixed.c1_rad_s)),
            ("c2_rad_s", json!(fixed.c2_rad_s)),
            ("time_constant_s", json!(fixed.time_constant_s)),
            ("loss", json!((self.fit.loss == Loss::Huber).then_some(self.fit.loss))),
            ("weighting", json!(self.fit.weighting)),
            ("level", json!(Some(self.whiteness.level).filter(|v| *v != usual.level))),
            ("draws", json!(Some(self.whiteness.draws).filter(|v| *v != usual.draws))),
            ("seed", json!(Some(self.whiteness.seed).filter(|v| *v != usual.seed))),
        ];
        let said = all.into_iter().filter(|(_, v)| !v.is_null());
        Value::Object(said.map(|(k, v)| (k.to_string(), v)).collect::<Map<_, _>>()).to_string()
    }
}

/// Where a row comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Origin {
    /// The log was read and fitted, or failed to be.
    Fitted,
    /// It was known from an earlier run.
    Resumed,
}

/// Result of a run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Done {
    /// One row a log, gyro and axis, in the order of the logs.
    pub rows: Vec<Row>,
    /// Rows whose log was read and fitted now.
    pub fitted: usize,
    /// Rows that were known.
    pub resumed: usize,
}

/// Fits each axis of each gyro of each of `logs`, `jobs` (at least one) at a time, on as many threads. A row of `known` is taken over where
/// the bytes of the log, the topic, the axis, the options (`Settings::text`) and the version are those that it was made of; rows with an
/// error are tried anew. `each` sees every row as soon as it is there, in no certain order.
///
/// # Errors
/// That of `each`, which ends the work after the logs in hand; [`ErrorKind::Numeric`] if no thread can be started. What is
/// wrong with a log stands in its row.
pub(crate) fn fit_all(
    logs: &[PathBuf],
    settings: &Settings,
    jobs: usize,
    known: &[Row],
    each: &mut dyn FnMut(&Row, Origin) -> Result<()>,
) -> Result<Done> {
    let options = settings.text();
    let made_alike =
        |r: &&Row| r.options == options && r.gyroid_version == env!("CARGO_PKG_VERSION") && r.error.is_none();
    let work = Work {
        settings,
        known: known
            .iter()
            .filter(made_alike)
            .map(|r| ((r.sha256.as_str(), r.topic.clone(), r.axis.clone()), r))
            .collect(),
        options: &options,
    };
    let axes = settings.axes.len();
    let jobs = jobs.clamp(1, (logs.len() * axes).max(1));
    let no_threads = |e: &dyn fmt::Display| {
        Error::new(ErrorKind::Numeric, "--jobs", format!("no thread can be started: {e}")).hint("ask for fewer jobs")
    };
    // the tests of a log are parallel themselves: in one pool all keep to `jobs` threads
    let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs).build().map_err(|e| no_threads(&e))?;
    let tasks = pool.install(|| tasks(logs, settings));
    let (next, stop) = (AtomicUsize::new(0), AtomicBool::new(false));
    let mut slots: Vec<Option<(Row, Origin)>> = vec![None; tasks.len() * axes];
    let failed = thread::scope(|scope| {
        let (send, receive) = mpsc::channel();
        for _ in 0..jobs.min(tasks.len()) {
            let send = send.clone();
            let (next, stop, tasks, work, pool) = (&next, &stop, &tasks, &work, &pool);
            let turn = move || {
                while !stop.load(Ordering::Relaxed) {
                    let at = next.fetch_add(1, Ordering::Relaxed);
                    let Some(task) = tasks.get(at) else { break };
                    let done = pool.install(|| work.rows(task));
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
                slots[at * axes + i] = Some((row, origin));
            }
        }
        None
    });
    if let Some(error) = failed {
        return Err(error);
    }
    let (rows, origins): (Vec<Row>, Vec<Origin>) = slots.into_iter().flatten().unzip();
    let fitted = origins.iter().filter(|o| **o == Origin::Fitted).count();
    Ok(Done { fitted, resumed: rows.len() - fitted, rows })
}

/// One log and topic, read at once; it becomes a row an axis.
struct Task<'a> {
    path: &'a Path,
    topic: Option<String>,
    /// Why the topics of the log are not known.
    error: Option<Error>,
}

/// One a log and topic, in this order.
fn tasks<'a>(logs: &'a [PathBuf], settings: &Settings) -> Vec<Task<'a>> {
    type Listed = (Vec<Option<String>>, Option<Error>);
    let of_log = |log: &PathBuf| -> Listed {
        match &settings.topics {
            Topics::Only => (vec![settings.query.topic.clone()], None),
            Topics::Named(names) => (names.iter().cloned().map(Some).collect(), None),
            Topics::All => match gyro_topics(log) {
                Ok(Some(topics)) => (topics.into_iter().map(|t| Some(t.name)).collect(), None),
                Ok(None) => (vec![None], None),
                Err(error) => (vec![None], Some(error)),
            },
        }
    };
    let listed: Vec<Listed> = logs.par_iter().map(of_log).collect();
    let mut tasks = Vec::new();
    for (log, (topics, error)) in logs.iter().zip(listed) {
        tasks.extend(topics.into_iter().map(|topic| Task { path: log, topic, error: error.clone() }));
    }
    tasks
}

struct Work<'a> {
    settings: &'a Settings,
    options: &'a str,
    /// Known rows by hash, topic and axis.
    known: HashMap<(&'a str, Option<String>, String), &'a Row>,
}

impl Work<'_> {
    /// One row an axis; the log is read once for all of them.
    fn rows(&self, task: &Task<'_>) -> Vec<(Row, Origin)> {
        let Task { path, ref topic, .. } = *task;
        let axes = &self.settings.axes;
        let sha256 = if self.known.is_empty() { None } else { files::sha256(path).ok() };
        let known = |axis: AxisChoice| self.known.get(&(sha256.as_deref()?, topic.clone(), axis.to_string()));
        let unknown: Vec<AxisChoice> = axes.iter().copied().filter(|axis| known(*axis).is_none()).collect();
        let mut read = self.read(task, &unknown).into_iter();
        let row = |&axis: &AxisChoice| {
            let row = Row::of_file(path, topic.as_deref(), axis, self.options);
            if let Some(known) = known(axis) {
                let Row { path, size_bytes, modified, .. } = row;
                return (Row { path, size_bytes, modified, ..(*known).clone() }, Origin::Resumed);
            }
            let recording = read.next();
            let named = row.clone();
            // one log on which the program itself fails must not cost the others
            let fit = || recording.map_or(Err(program_fault(path, &"it was not read")), |r| self.fit(path, r?, row));
            let done = catch_unwind(AssertUnwindSafe(fit));
            let done = done.unwrap_or_else(|fault| Err(program_fault(path, fault.as_ref())));
            let mut row = done.unwrap_or_else(|e| named.failed(&e));
            if row.sha256.is_empty() {
                row.sha256 = files::sha256(path).unwrap_or_default();
            }
            (row, Origin::Fitted)
        };
        axes.iter().map(row).collect()
    }

    /// The recordings of `axes`, read together; where one of them fails, one by one, so that it does not cost the others.
    fn read(&self, task: &Task<'_>, axes: &[AxisChoice]) -> Vec<Result<GyroRecording>> {
        if let Some(error) = &task.error {
            return axes.iter().map(|_| Err(error.clone())).collect();
        }
        let path = task.path;
        let query = |c: &AxisChoice| GyroQuery {
            axis: c.axis,
            reversed: c.reversed,
            topic: task.topic.clone(),
            ..self.settings.query.clone()
        };
        let queries: Vec<GyroQuery> = axes.iter().map(query).collect();
        let whole = || -> Result<Vec<Reading>> { read_axes_within(path, &queries, usize::MAX, &mut |_| ()) };
        if queries.len() > 1
            && let Ok(Ok(readings)) = catch_unwind(AssertUnwindSafe(whole))
        {
            let held = |r| if let Reading::Whole(recording) = r { Some(Ok(*recording)) } else { None };
            let held: Option<Vec<Result<GyroRecording>>> = readings.into_iter().map(held).collect();
            if let Some(held) = held {
                return held;
            }
        }
        let alone = |query: &GyroQuery| {
            let read = catch_unwind(AssertUnwindSafe(|| read_gyro(path, query)));
            read.unwrap_or_else(|fault| Err(program_fault(path, fault.as_ref())))
        };
        queries.iter().map(alone).collect()
    }

    fn fit(&self, path: &Path, mut recording: GyroRecording, mut row: Row) -> Result<Row> {
        let settings = self.settings;
        if settings.trim_motion {
            recording = recording.without_motion()?;
        }
        let rate = recording.log.require(names::GYRO_Z)?;
        let mut time = recording.log.time.clone();
        if let (Some(offset), false) = (settings.start_offset_s, time.is_empty()) {
            let first = time.at(0);
            time = time.shifted(offset - first);
        }
        let named = |e: Error| if e.input == "log" { e.named(path.display()) } else { e };
        let fit = identify::fit(&time, rate, &settings.fit).map_err(named)?;
        let validation = {
            let left = fit.without_colour(fit.residuals(&time, rate));
            validate::whiteness(&time, &left, &fit.jacobian(&time), &settings.whiteness)
        };
        row.earth_rate_rad_s = settings.earth.map(|e| e.vertical_rad_s);
        Ok(row.fitted(&recording, &fit, &validation))
    }
}

fn program_fault(path: &Path, fault: &(dyn Any + Send)) -> Error {
    let said = fault.downcast_ref::<String>().map(String::as_str).or(fault.downcast_ref::<&str>().copied());
    let found = format!("the program failed on this log: {}", said.unwrap_or("it does not say why"));
    Error::new(ErrorKind::Numeric, path.display(), found).hint("report it with the log")
}
