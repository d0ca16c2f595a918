//! Runs of a simulator and recordings, of drives or at rest as their channels say.

use super::diagnose::begun;
use super::recordings::{read_drive, shown};
use crate::cli::log_args::ColumnArgs;
use crate::cli::places;
use gyroid::config::{Config, Kind};
use gyroid::effects::Library;
use gyroid::gap::twin::{Twin, twin_at_rest, twin_of_drives};
use gyroid::gap::{Options, Stage};
use gyroid::signal::Log;
use gyroid::{Error, ErrorKind, Result};
use std::path::PathBuf;

/// How logs are read.
pub(super) struct Reader<'a> {
    pub columns: &'a ColumnArgs,
    pub map: &'a [String],
    /// The robot as far as it is known.
    pub init: Option<Config>,
    /// Decisions on the logs.
    pub notes: Vec<String>,
}

/// Several runs, all drives or all at rest.
pub(super) struct Logs {
    pub drives: bool,
    pub logs: Vec<Log>,
}

impl<'a> Reader<'a> {
    /// # Errors
    /// Those of a configuration that cannot be read.
    pub(super) fn new(columns: &'a ColumnArgs, map: &'a [String], init: Option<&PathBuf>) -> Result<Self> {
        let init = init.map(Config::read_base).transpose()?.map(|config| config.by_elapsed_time().0);
        Ok(Self { columns, map, init, notes: Vec::new() })
    }

    /// The robot as far as it is known.
    ///
    /// # Errors
    /// As [`Config::parse`].
    pub(super) fn config(&self) -> Result<Config> {
        let nothing = Config::parse("schema = 1\n", "configuration")?;
        Ok(self.init.clone().unwrap_or(nothing))
    }

    /// Reads runs, each of its files.
    ///
    /// # Errors
    /// Those of the reader; [`ErrorKind::Usage`] for several files at rest.
    pub(super) fn read(&mut self, option: &str, runs: &[Vec<PathBuf>]) -> Result<Logs> {
        let config = self.config()?;
        let mut logs = Vec::new();
        let mut at_rest = self.init.as_ref().map(|c| c.kind == Kind::Stationary);
        for files in runs {
            let seen = match at_rest {
                Some(true) => None,
                _ => Some(read_drive((self.columns, self.map), (option, files), &config, &mut self.notes)),
            };
            let log = match seen {
                Some(Ok(log)) if at_rest == Some(false) || places::is_drive(&log) => {
                    at_rest = Some(false);
                    log
                }
                // what is no drive may be read at rest; if not, the first error tells more
                Some(Err(error)) => self.rest(option, files).map_err(|_| error)?,
                _ => self.rest(option, files)?,
            };
            at_rest = at_rest.or(Some(true));
            logs.push(log);
        }
        Ok(Logs { drives: at_rest == Some(false), logs })
    }

    fn rest(&mut self, option: &str, files: &[PathBuf]) -> Result<Log> {
        let [path] = files else {
            let found = format!("several files, and {} is of a gyro at rest", shown(files));
            return Err(Error::new(ErrorKind::Usage, option, found)
                .hint("give one file for each recording at rest; several files on one clock can only be of a drive"));
        };
        let recording = self.columns.read(path)?;
        for note in self.columns.notes_on(&recording) {
            if !self.notes.contains(&note) {
                self.notes.push(note);
            }
        }
        let time = self.columns.time_since_power_on(&recording);
        let mut log = recording.log;
        log.time = time;
        log.source = path.display().to_string();
        Ok(log)
    }

    /// The twin of the simulator that made `runs`.
    ///
    /// # Errors
    /// As [`twin_of_drives`] and [`twin_at_rest`].
    pub(super) fn twin(
        &self,
        runs: &Logs,
        starts_s: &[f64],
        library: &Library,
        options: &Options,
        observe: &mut dyn FnMut(Stage),
    ) -> Result<Twin> {
        if runs.drives {
            twin_of_drives(
                self.init.as_ref(),
                &begun(&runs.logs, starts_s, &vec![0.0; runs.logs.len()]),
                library,
                options,
                observe,
            )
        } else {
            twin_at_rest(self.init.as_ref(), &runs.logs.iter().collect::<Vec<_>>(), library, options, observe)
        }
    }
}

/// Refuses one file in two places on the command line.
pub(super) fn apart(one: (&str, &[Vec<PathBuf>]), other: (&str, &[Vec<PathBuf>])) -> Result<()> {
    let twice = one.1.iter().flatten().find(|path| other.1.iter().flatten().any(|o| o == *path));
    match twice {
        None => Ok(()),
        Some(path) => {
            let found = format!("is given with {} and with {}", one.0, other.0);
            Err(Error::new(ErrorKind::Usage, shown(std::slice::from_ref(path)), found).hint("give two different logs"))
        }
    }
}
