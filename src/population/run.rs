//! Many logs at rest, some at a time; a bad one is a row with its error.

use super::axis::AxisChoice;
use super::engine::{Done, Known, Origin, fault, run_all, within};
use super::source::{Record, Source};
use crate::error::{Error, Result};
use crate::files;
use crate::ingest::{GyroQuery, GyroRecording, Mounting, Reading, Stamp, gyro_topics, read_axes_within, read_gyro};
use crate::signal::{TimeAxis, names};
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use serde_json::{Map, Value, json};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

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

/// How the logs are read: all alike.
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
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            query: GyroQuery::default(),
            topics: Topics::default(),
            axes: vec![AxisChoice::default()],
            trim_motion: false,
            start_offset_s: None,
        }
    }
}

impl Settings {
    /// These and the `further` options that are not defaults (null: a default), axes and `topics` aside, as JSON: rows with the same text
    /// were made in the same way.
    #[must_use]
    pub(crate) fn text(&self, further: Vec<(&'static str, Value)>) -> String {
        let query = &self.query;
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
        ];
        let said = all.into_iter().chain(further).filter(|(_, v)| !v.is_null());
        Value::Object(said.map(|(k, v)| (k.to_string(), v)).collect::<Map<_, _>>()).to_string()
    }
}

/// The work on a log at rest, which makes a row.
pub(crate) trait Analysis: Sync {
    type Row: Record;

    /// Its options by name; null for a default.
    fn options(&self) -> Vec<(&'static str, Value)>;

    /// Fills in `row` of the log `recording`, whose times since power-on are `time` and whose rates, rad/s, are `rate`.
    ///
    /// # Errors
    /// Those of the work, which become the row's.
    fn fill(&self, row: &mut Self::Row, recording: &GyroRecording, time: &TimeAxis, rate: &[f64]) -> Result<()>;
}

/// Makes a row of each axis of each gyro of each of `logs`, `jobs` (at least one) at a time, on as many threads. A row of `known` is taken
/// over where the bytes of the log, the topic, the axis, the options (`Settings::text`) and the version are those that it was made of; rows
/// with an error are tried anew. `each` sees every row as soon as it is there, in no certain order.
///
/// # Errors
/// As [`run_all`]. What is wrong with a log stands in its row.
pub(crate) fn analyse_all<A: Analysis>(
    logs: &[PathBuf],
    settings: &Settings,
    analysis: &A,
    jobs: usize,
    known: &[A::Row],
    each: &mut dyn FnMut(&A::Row, Origin) -> Result<()>,
) -> Result<Done<A::Row>> {
    let options = settings.text(analysis.options());
    let work = Work { settings, analysis, known: Known::of(known, &options), options: &options };
    let axes = settings.axes.len();
    let jobs = jobs.clamp(1, (logs.len() * axes).max(1));
    let tasks = within(jobs, || tasks(logs, settings))?;
    run_all(&tasks, axes, jobs, &|task| work.rows(task), each)
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

struct Work<'a, A: Analysis> {
    settings: &'a Settings,
    analysis: &'a A,
    options: &'a str,
    known: Known<'a, A::Row>,
}

impl<A: Analysis> Work<'_, A> {
    /// One row an axis; the log is read once for all of them.
    fn rows(&self, task: &Task<'_>) -> Vec<(A::Row, Origin)> {
        let Task { path, ref topic, .. } = *task;
        let sources = self.settings.axes.iter();
        let sources = sources.map(|axis| Source::of_file(path, topic.as_deref(), axis.to_string(), self.options));
        let sources: Vec<Source> = sources.collect();
        let held = self.known.rows(path, &sources);
        let axes = self.settings.axes.iter().zip(&held);
        let unknown: Vec<AxisChoice> = axes.filter(|(_, held)| held.is_none()).map(|(axis, _)| *axis).collect();
        let mut read = self.read(task, &unknown).into_iter();
        let row = |(source, held): (Source, Option<A::Row>)| match held {
            Some(held) => (held, Origin::Resumed),
            None => {
                let recording = read.next().unwrap_or_else(|| Err(fault(path, &"it was not read")));
                (self.made(path, recording, source), Origin::Fitted)
            }
        };
        sources.into_iter().zip(held).map(row).collect()
    }

    fn made(&self, path: &Path, recording: Result<GyroRecording>, source: Source) -> A::Row {
        let named = source.clone();
        // one log on which the program itself fails must not cost the others
        let done = catch_unwind(AssertUnwindSafe(|| self.analysed(path, recording?, source)));
        let done = done.unwrap_or_else(|why| Err(fault(path, why.as_ref())));
        let mut row = done.unwrap_or_else(|e| A::Row::of(named).failed(&e));
        if row.source().sha256.is_empty() {
            row.source_mut().sha256 = files::sha256(path).unwrap_or_default();
        }
        row
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
            read.unwrap_or_else(|why| Err(fault(path, why.as_ref())))
        };
        queries.iter().map(alone).collect()
    }

    fn analysed(&self, path: &Path, mut recording: GyroRecording, mut source: Source) -> Result<A::Row> {
        if self.settings.trim_motion {
            recording = recording.without_motion()?;
        }
        let rate = recording.log.require(names::GYRO_Z)?;
        let mut time = recording.log.time.clone();
        if let (Some(offset), false) = (self.settings.start_offset_s, time.is_empty()) {
            let first = time.at(0);
            time = time.shifted(offset - first);
        }
        source.read(&recording);
        let mut row = A::Row::of(source);
        let named = |e: Error| if e.input == "log" { e.named(path.display()) } else { e };
        self.analysis.fill(&mut row, &recording, &time, rate).map_err(named)?;
        Ok(row)
    }
}
