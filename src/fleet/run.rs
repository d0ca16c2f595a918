//! Many recordings diagnosed, some at a time; a bad one is a row with its error.

use super::row::DriveRow;
use crate::config::{Config, Kind};
use crate::effects::Library;
use crate::error::{Error, Result};
use crate::gap::{Drive, Options, diagnose_drives, diagnose_observed, explain};
use crate::population::{Done, Known, Origin, Record, Source, fault, run_all};
use crate::signal::Log;
use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// Reads a recording; what was decided for it comes with it.
pub(crate) type Reader<'a> = dyn Fn(&Path) -> Result<(Log, Vec<String>)> + Sync + 'a;

/// The simulator that all recordings are held against, and how.
pub(crate) struct Fleet<'a> {
    /// The nominal simulator of each robot.
    pub config: &'a Config,
    pub library: &'a Library,
    pub options: &'a Options,
    /// Effects that are fitted together to every recording, whether its diagnosis names them or not.
    pub asked: &'a [String],
    pub read: &'a Reader<'a>,
    /// All that decides about a row, effects that are fitted aside, as JSON.
    pub text: &'a str,
}

/// Diagnoses each of `logs`, `jobs` (at least one) at a time. A row of `known` is taken over where the bytes of the recording, the options and
/// the version are those that it was made of; where it was asked for other effects, these alone are fitted. `each` sees every row as soon
/// as it is there, in no certain order.
///
/// # Errors
/// That of `each`; [`crate::ErrorKind::Numeric`] if no thread can be started. What is wrong with a recording stands in its row.
pub(crate) fn diagnose_all(
    logs: &[PathBuf],
    fleet: &Fleet<'_>,
    jobs: usize,
    known: &[DriveRow],
    each: &mut dyn FnMut(&DriveRow, Origin) -> Result<()>,
) -> Result<Done<DriveRow>> {
    let known = Known::of(known, fleet.text);
    let row = |path: &PathBuf| {
        let source = Source::of_file(path, None, String::new(), fleet.text);
        let held = known.rows(path, std::slice::from_ref(&source)).pop().flatten();
        vec![fleet.row(path, source, held)]
    };
    run_all(logs, 1, jobs, &row, each)
}

/// The effects that a diagnosis of `rows` names, in the order of their ids.
#[must_use]
pub(crate) fn named(rows: &[DriveRow]) -> Vec<String> {
    let ids: BTreeSet<&str> = rows.iter().flat_map(DriveRow::named).collect();
    ids.into_iter().map(Into::into).collect()
}

impl Fleet<'_> {
    fn row(&self, path: &Path, source: Source, held: Option<DriveRow>) -> (DriveRow, Origin) {
        let asked_alike = |row: &DriveRow| self.asked.is_empty() || row.fitted().asked == self.asked;
        if let Some(row) = held.as_ref().filter(|row| asked_alike(row)) {
            return (row.clone(), Origin::Resumed);
        }
        let named = source.clone();
        // one recording on which the program itself fails must not cost the others
        let done = catch_unwind(AssertUnwindSafe(|| self.worked(path, source, held)));
        let done = done.unwrap_or_else(|why| Err(fault(path, why.as_ref())));
        let mut row = done.unwrap_or_else(|e| DriveRow::of(named).failed(&e));
        if row.source.sha256.is_empty() {
            row.source.sha256 = crate::files::sha256(path).unwrap_or_default();
        }
        (row, Origin::Fitted)
    }

    fn worked(&self, path: &Path, source: Source, held: Option<DriveRow>) -> Result<DriveRow> {
        let (log, notes) = (self.read)(path)?;
        let since_s = self.options.since_power_on_s;
        let named = |e: Error| if e.input == "log" { e.named(path.display()) } else { e };
        let mut row = match held {
            Some(row) => row,
            None => {
                let mut row = DriveRow::of(source);
                let done = match self.config.kind {
                    Kind::Driving => {
                        let drive = [Drive::new(&log, since_s)];
                        diagnose_drives(self.config, &drive, &[], self.library, self.options, &mut |_| {})
                    }
                    Kind::Stationary => {
                        diagnose_observed(self.config, &log, None, self.library, self.options, &mut |_| {})
                    }
                };
                row.fill(&done.map_err(named)?.answer, log.time.span_s(), &notes);
                row
            }
        };
        if !self.asked.is_empty() {
            let ids: Vec<&str> = self.asked.iter().map(String::as_str).collect();
            // what a recording cannot show costs it no diagnosis
            row.keep(self.asked, explain(self.config, &log, self.library, &ids, since_s).map_err(named));
        }
        Ok(row)
    }
}
