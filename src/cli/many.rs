//! A table of many logs: a row a log, gyro and axis, kept in a file while the work goes on.

use super::log_args::ColumnArgs;
use super::log_values::parse_axis;
use super::output::Working;
use clap::Args;
use gyroid::files::{OutputFile, Plan};
use gyroid::population::{self, AxisChoice, Origin, Record, Settings, Shard, Topics, results};
use gyroid::units::duration_text;
use gyroid::{Error, ErrorKind, Result};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// How often results are saved while the work goes on.
const SAVE_EVERY: Duration = Duration::from_secs(5);

/// Heading of the options for many logs.
pub(crate) const MANY_LOGS: &str = "Many logs";

/// Options for many logs; one of them makes a single log a row of a table too.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = MANY_LOGS)]
pub(crate) struct ManyArgs {
    /// Logs that are worked on at a time, each on one core [default: the cores of the machine]
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
    /// Write all estimates and what they are from here (.parquet or .csv)
    #[arg(long, value_name = "FILE")]
    pub results: Option<PathBuf>,
    /// Take over what --results holds of the same logs and options, and do the rest
    #[arg(long, requires = "results")]
    resume: bool,
    /// Do part i of n of the logs, i from 1; --out is its table, `gyroid merge` makes one of all
    #[arg(long, value_name = "i/n", value_parser = Shard::parse)]
    pub shard: Option<Shard>,
}

/// The axes of many logs.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = MANY_LOGS)]
pub(crate) struct AxesArgs {
    /// Axes of each log, a row each: x,y,z [default: that of --axis]
    #[arg(long, value_name = "LIST", value_delimiter = ',', allow_hyphen_values = true, value_parser = parse_axis)]
    pub axes: Vec<AxisChoice>,
}

impl AxesArgs {
    /// Each axis once: those that are named here, else those of --axis.
    pub(super) fn or(&self, others: &[AxisChoice]) -> Vec<AxisChoice> {
        let mut axes = if self.axes.is_empty() { others.to_vec() } else { self.axes.clone() };
        let mut seen = Vec::new();
        axes.retain(|a| {
            !seen.contains(a) && {
                seen.push(*a);
                true
            }
        });
        axes
    }
}

/// How logs are read whose columns are `columns`, a row for each of `axes`.
pub(super) fn settings(columns: &ColumnArgs, axes: Vec<AxisChoice>) -> Result<Settings> {
    Ok(Settings {
        query: columns.query_of_any_topic(axes[0])?,
        topics: columns.topics(),
        axes,
        trim_motion: columns.trims_motion(),
        start_offset_s: columns.start_offset_s(),
    })
}

impl ManyArgs {
    /// Adds the output file.
    pub(super) fn planned(&self, plan: Plan) -> Plan {
        if self.resume { plan.resumes("--results", &self.results) } else { plan.writes("--results", &self.results) }
    }

    /// Whether an option was given that only many logs have.
    pub(super) fn asked_for(&self) -> bool {
        self.results.is_some() || self.shard.is_some()
    }

    /// With --shard, --out is the table of the part.
    pub(super) fn of_a_part(&mut self, out: &mut Option<PathBuf>) {
        if self.shard.is_some() && self.results.is_none() {
            self.results = out.take();
        }
    }

    pub(super) fn jobs(&self) -> usize {
        self.jobs.or_else(|| std::thread::available_parallelism().ok()).map_or(1, NonZeroUsize::get)
    }

    /// The logs that `named` names, or the part of them that --shard asks for; those of `beside` are results.
    pub(super) fn logs(&self, named: &[PathBuf], beside: &[PathBuf]) -> Result<Vec<PathBuf>> {
        let logs = population::find(named, beside)?;
        Ok(match self.shard {
            Some(shard) => shard.of(logs, named),
            None => logs,
        })
    }
}

/// A table that is made: rows of an earlier run, and the file where they are saved now and then.
pub(super) struct Table<'a, R> {
    saved: Option<Saved<R>>,
    /// Rows of an earlier run.
    known: Vec<R>,
    progress: Progress<'a>,
}

impl<'a, R: Record> Table<'a, R> {
    /// Claims the file. `rows`: how many there will be, where that is known; `doing`: the work in one word, `fitted`.
    pub(super) fn begin(
        many: &ManyArgs,
        working: &'a Working,
        rows: Option<usize>,
        doing: &'static str,
    ) -> Result<Self> {
        let claimed = many.results.clone().map(|path| Saved::claim(path, many.resume)).transpose()?;
        let (saved, known) = claimed.map_or_else(Default::default, |(saved, known)| (Some(saved), known));
        Ok(Self { saved, known, progress: Progress::new(working, rows, doing) })
    }

    /// The rows of an earlier run, and what sees each new one.
    pub(super) fn parts(&mut self) -> (&[R], impl FnMut(&R, Origin) -> Result<()> + '_) {
        let Self { saved, known, progress } = self;
        let each = |row: &R, origin: Origin| {
            progress.step(row, origin);
            saved.as_mut().map_or(Ok(()), |s| s.add(row))
        };
        (known, each)
    }

    /// Writes all rows, and says so. Returns what was said.
    pub(super) fn end(self, rows: &[R]) -> Result<Option<String>> {
        let Some(saved) = self.saved else { return Ok(None) };
        results::write(&saved.path, rows)?;
        let of = |row: &R| {
            let source = row.source();
            (source.sha256.clone(), source.topic.clone(), source.axis.clone())
        };
        let now: std::collections::BTreeSet<_> = rows.iter().map(of).collect();
        let gone = self.known.iter().filter(|row| !now.contains(&of(row))).count();
        let gone = if gone > 0 { format!("; {gone} of logs that are not named now are gone") } else { String::new() };
        Ok(Some(format!("wrote {}: {} rows{gone}", saved.path.display(), rows.len())))
    }
}

/// Refuses rows that are all errors: the first says what is wrong. Those of a part are but some of the logs.
pub(super) fn refuse_failed<R: Record>(rows: &[R], shard: Option<Shard>, done: &str) -> Result<()> {
    let failed = population::failed(rows);
    if failed == 0 || failed < rows.len() || shard.is_some() {
        return Ok(());
    }
    let first = rows.iter().find_map(|r| r.source().error.clone()).unwrap_or_default();
    Err(Error::new(ErrorKind::Format, format!("{failed} logs"), format!("none could be {done}: {first}")))
}

/// Rows that a run over `logs` logs will have, where that is known before they are opened.
pub(super) fn rows_of(settings: &Settings, logs: usize) -> Option<usize> {
    let gyros = match &settings.topics {
        Topics::Only => 1,
        Topics::Named(names) => names.len(),
        Topics::All => return None,
    };
    Some(gyros * logs * settings.axes.len())
}

/// A file of results, saved now and then, so that little is lost when the work is broken off.
struct Saved<R> {
    path: PathBuf,
    rows: Vec<R>,
    saved: Instant,
}

impl<R: Record> Saved<R> {
    /// Checks that the file can be written, and returns the rows that it holds if the work is to be resumed.
    fn claim(path: PathBuf, resume: bool) -> Result<(Self, Vec<R>)> {
        results::Format::of(&path)?;
        drop(OutputFile::claim(&path)?);
        let known = if resume && path.exists() { results::read(&path)? } else { Vec::new() };
        Ok((Self { path, rows: known.clone(), saved: Instant::now() }, known))
    }

    /// Adds a row, in place of an earlier one of the same log, topic and axis.
    fn add(&mut self, row: &R) -> Result<()> {
        let new = row.source();
        let same = |r: &&mut R| {
            let old = r.source();
            old.path == new.path && old.topic == new.topic && old.axis == new.axis
        };
        match self.rows.iter_mut().find(same) {
            Some(old) => old.clone_from(row),
            None => self.rows.push(row.clone()),
        }
        if self.saved.elapsed() < SAVE_EVERY {
            return Ok(());
        }
        results::write(&self.path, &self.rows)?;
        self.saved = Instant::now();
        Ok(())
    }
}

/// How far the work is, and how long the rest will take.
struct Progress<'a> {
    working: &'a Working,
    doing: &'static str,
    /// Rows in all, where that is known before the logs are opened.
    total: Option<usize>,
    done: usize,
    fitted: usize,
    failed: usize,
    start: Instant,
}

impl<'a> Progress<'a> {
    fn new(working: &'a Working, total: Option<usize>, doing: &'static str) -> Self {
        Self { working, doing, total, done: 0, fitted: 0, failed: 0, start: Instant::now() }
    }

    fn step<R: Record>(&mut self, row: &R, origin: Origin) {
        self.done += 1;
        self.fitted += usize::from(origin == Origin::Fitted);
        self.failed += usize::from(row.source().error.is_some());
        let left = self.total.map_or(0, |total| total.saturating_sub(self.done));
        let of = self.total.map_or(String::new(), |total| format!(" of {total}"));
        // what was known took no time
        let each = self.start.elapsed().as_secs_f64() / self.fitted.max(1) as f64;
        let rest = if left > 0 { format!(", {} left", duration_text(each * left as f64)) } else { String::new() };
        self.working.show(format!("{} {}{of}, {} failed{rest}", self.doing, self.done, self.failed));
    }
}
