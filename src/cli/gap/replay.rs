//! `--simulate`: the user's own simulator, run on the recording held out under one description and another.

use super::recordings::read_drive;
use crate::cli::log_args::ColumnArgs;
use gyroid::config::Config;
use gyroid::export::Snippet;
use gyroid::gap::holdout::gate::Gate;
use gyroid::gap::holdout::replay::Replayed;
use gyroid::ingest::{self, LogWriter};
use gyroid::signal::{Log, TimeAxis, names};
use gyroid::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use tempfile::TempDir;

/// Placeholders that a command must have.
const PLACES: [&str; 3] = ["{model}", "{inputs}", "{log}"];
/// Inputs that a simulator can follow; the first pair that a recording has is given.
const INPUTS: [[&str; 2]; 3] = [
    [names::TORQUE_LEFT, names::TORQUE_RIGHT],
    [names::COMMAND_LEFT, names::COMMAND_RIGHT],
    [names::COMMAND_SPEED, names::COMMAND_YAW_RATE],
];
/// Interpreter of the Python for the log.
const PYTHON: &str = "python3";
/// Lines of a failed command's last words.
const LAST_WORDS: usize = 5;

/// How the simulator's log is read: as the recordings are.
#[derive(Clone, Copy)]
pub(super) struct Reads<'a> {
    pub columns: &'a ColumnArgs,
    pub map: &'a [String],
    pub config: &'a Config,
}

/// A simulator with the inputs of one recording.
pub(super) struct Simulator<'a> {
    command: &'a str,
    reads: Reads<'a>,
    recording: &'a Log,
    /// Holds the inputs, and the log of each run; goes with it.
    folder: TempDir,
}

fn usage(found: impl std::fmt::Display) -> Error {
    Error::new(ErrorKind::Usage, "--simulate", found)
}

/// Refuses a command that has no place for model, inputs or log.
pub(super) fn check(command: &str) -> Result<()> {
    match PLACES.iter().find(|place| !command.contains(*place)) {
        None => Ok(()),
        Some(missing) => Err(usage(format!("the command {command:?} has no {missing}"))
            .hint("name all three: 'python run.py --model {model} --inputs {inputs} --out {log}'")),
    }
}

/// The last lines that a command said.
fn last_words(stderr: &[u8]) -> String {
    let words = String::from_utf8_lossy(stderr);
    let lines: Vec<&str> = words.lines().filter(|line| !line.trim().is_empty()).collect();
    let last = lines[lines.len().saturating_sub(LAST_WORDS)..].join("\n  ");
    if last.is_empty() { "it said nothing on standard error".to_string() } else { last }
}

/// As one word of the shell.
fn quoted(path: &Path) -> String {
    format!("'{}'", path.display().to_string().replace('\'', r"'\''"))
}

impl<'a> Simulator<'a> {
    /// Writes the inputs of the recording held out to a temporary folder: torques, else commanded wheel speeds, else a commanded
    /// speed and yaw rate.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] without a recording held out, or where it has none of these.
    pub(super) fn new(command: &'a str, kept: Option<&'a Log>, reads: Reads<'a>) -> Result<Self> {
        let recording = kept.ok_or_else(|| {
            usage("runs on a recording that is held out, and none is").hint("give another drive with --hold")
        })?;
        let rows_of = |channels: [&str; 2]| -> Option<Vec<usize>> {
            let [first, second] = channels.map(|name| recording.get(name));
            let both = first?.iter().zip(second?).enumerate();
            let rows: Vec<usize> = both.filter(|(_, (a, b))| a.is_finite() && b.is_finite()).map(|(k, _)| k).collect();
            (rows.len() > 1).then_some(rows)
        };
        let found = INPUTS.into_iter().find_map(|channels| Some((channels, rows_of(channels)?)));
        let (channels, rows) = found.ok_or_else(|| {
            let source = &recording.source;
            usage(format!("gives the simulator torques or commands of {source}, which has no two rows of either")).hint(
                "hold out a recording with torque_left_n_m and torque_right_n_m, command_left_rad_s and \
                 command_right_rad_s, or command_speed_m_s and command_yaw_rate_rad_s, or --map them",
            )
        })?;
        let begin_s = recording.time.at(0);
        let times_s = rows.iter().map(|k| recording.time.at(*k) - begin_s).collect();
        let mut inputs = Log::new("inputs", TimeAxis::Explicit(times_s));
        for name in channels {
            let values = recording.require(name)?;
            inputs.push(name, rows.iter().map(|k| values[*k]).collect())?;
        }
        let folder = tempfile::Builder::new().prefix("gyroid-").tempdir();
        let folder = folder.map_err(|e| Error::io(std::env::temp_dir(), &e))?;
        let simulator = Self { command, reads, recording, folder };
        LogWriter::claim(simulator.inputs())?.write(&inputs)?;
        Ok(simulator)
    }

    /// The recording that it runs on.
    pub(super) fn recording(&self) -> &'a Log {
        self.recording
    }

    fn inputs(&self) -> PathBuf {
        self.folder.path().join("inputs.csv")
    }

    /// Whether there is a Python that can change a log.
    pub(super) fn has_python(&self) -> bool {
        Command::new(PYTHON).args(["-c", "import numpy"]).output().is_ok_and(|ended| ended.status.success())
    }

    /// Path of the CSV that `snippet` makes of the one at `given`.
    fn as_real(&self, snippet: &Snippet, given: &Path, options: &[&str]) -> Result<PathBuf> {
        let (code, made) = (self.folder.path().join("log.py"), given.with_extension("made.csv"));
        std::fs::write(&code, &snippet.text).map_err(|e| Error::io(&code, &e))?;
        let ended = Command::new(PYTHON).arg(&code).args([given, made.as_path()]).args(options).output();
        let ended = ended.map_err(|e| Error::io(PYTHON, &e).at("--simulate"))?;
        if ended.status.success() {
            return Ok(made);
        }
        let found = format!("{PYTHON} failed on the simulator's log: {}", last_words(&ended.stderr));
        Err(usage(found).hint("leave out --simulate, and try the Python beside the copy by hand"))
    }

    /// Runs it under the description at `model`, and `snippet` on its inputs and log; `called` is the name in messages.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] where the command fails or leaves no log; those of the reader and of [`Replayed::of`].
    pub(super) fn run(&self, model: &Path, called: &str, snippet: Option<&Snippet>) -> Result<Replayed> {
        let log = self.folder.path().join("log.parquet");
        if log.exists() {
            std::fs::remove_file(&log).map_err(|e| Error::io(&log, &e))?;
        }
        let inputs = match snippet.filter(|snippet| snippet.commands) {
            Some(snippet) => self.as_real(snippet, &self.inputs(), &["--inputs"])?,
            None => self.inputs(),
        };
        let paths = [quoted(model), quoted(&inputs), quoted(&log)];
        let line =
            PLACES.iter().zip(&paths).fold(self.command.to_string(), |line, (place, path)| line.replace(place, path));
        let ended = Command::new("sh").args(["-c", &line]).stdin(Stdio::null()).output();
        let ended = ended.map_err(|e| Error::io("sh", &e).at("--simulate"))?;
        let failed = |found: String| usage(found).at(format!("with {called}"));
        if !ended.status.success() {
            return Err(failed(format!("the command failed ({}):\n  {}", ended.status, last_words(&ended.stderr)))
                .hint(format!("try it by hand: {}", self.command)));
        }
        if !log.is_file() {
            return Err(failed("the command ended well and wrote no {log}".into())
                .hint("let it write its log, CSV or Parquet, to the path in the place of {log}"));
        }
        let source = format!("the simulator's log with {called}");
        let reads = self.reads;
        let read = read_drive((reads.columns, reads.map), ("--simulate", &[log]), reads.config, &mut Vec::new());
        let mut simulated = read.map_err(|e| e.named(&source))?;
        if let Some(snippet) = snippet {
            let given = self.folder.path().join("given.csv");
            LogWriter::claim(&given)?.write(&simulated)?;
            let made = self.as_real(snippet, &given, &[])?;
            simulated = ingest::read_drive(&[made], &ingest::DriveQuery::default())?.log;
        }
        simulated.source = source;
        Replayed::of(self.recording, &simulated)
    }
}

/// Results of the replay, a line each.
pub(super) fn text(recording: &str, gate: &Gate) -> String {
    let share = |closed: Option<f64>, ci95: Option<[f64; 2]>| match (closed, ci95) {
        (Some(closed), Some([low, high])) => {
            format!("{:.1} % of the gap (95 %: {:.1} to {:.1} %)", 100.0 * closed, 100.0 * low, 100.0 * high)
        }
        (Some(closed), None) => format!("{:.1} % of the gap (its interval has no bounds)", 100.0 * closed),
        (None, _) => "no share of a gap: the error before does not exceed the noise".into(),
    };
    let mut lines = Vec::new();
    if let Some(all) = &gate.shrinkage {
        let what = if gate.kept.is_empty() { "all that was found closes" } else { "closes" };
        lines.push(format!("in your simulator, on {recording}: {what} {}", share(all.closed, all.ci95)));
        lines.extend(all.channels.iter().map(|c| {
            format!(
                "  {}: rms {:.3e} before, {:.3e} after, of which noise {:.3e}",
                c.channel, c.rms_before, c.rms_after, c.noise_std
            )
        }));
    }
    lines.extend(
        gate.dropped.iter().map(|d| format!("  left out {}: {}, adds {}", d.effect, d.why, share(d.adds, d.ci95))),
    );
    if lines.is_empty() {
        lines.push("your simulator was run once: nothing was found that its description has a place for".into());
    }
    lines.join("\n")
}
