//! The origin of a row of results, and the traits that rows of any command share.

use crate::error::Error;
use crate::ingest::{Clock, DATES_S, GyroRecording};
use jiff::Timestamp;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The origin of a row: the log, how it was read, and why there is no result.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Source {
    /// Path as it was given, or found in a folder that was.
    pub path: String,
    /// Topic that was asked for, in a log that holds several.
    pub topic: Option<String>,
    /// `x`, `y`, `z`, or `-x`, `-y`, `-z` of one that points the other way; empty for a drive.
    pub axis: String,
    /// Column that was read, as the file calls it.
    pub column: Option<String>,
    /// Its unit in the file.
    pub unit: Option<String>,
    /// SHA-256 of the file; empty where it could not be read.
    pub sha256: String,
    /// Its size, bytes.
    pub size_bytes: Option<i64>,
    /// When it was last changed, ISO 8601, UTC.
    pub modified: Option<String>,
    /// First sample by the file's clock, ISO 8601, UTC; unknown where the clock tells no date.
    pub started: Option<String>,
    /// Version of gyroid.
    pub gyroid_version: String,
    /// Options that are not defaults, as JSON.
    pub options: String,
    /// Why there is no result.
    pub error: Option<String>,
}

impl Source {
    /// A log of which only the file is known yet.
    pub(crate) fn of_file(path: &Path, topic: Option<&str>, axis: String, options: &str) -> Self {
        let meta = std::fs::metadata(path).ok();
        let modified = meta.as_ref().and_then(|m| m.modified().ok());
        Self {
            path: path.display().to_string(),
            topic: topic.map(str::to_string),
            axis,
            size_bytes: meta.as_ref().and_then(|m| i64::try_from(m.len()).ok()),
            modified: modified.and_then(|t| Timestamp::try_from(t).ok()).map(|t| t.to_string()),
            gyroid_version: env!("CARGO_PKG_VERSION").into(),
            options: options.into(),
            ..Self::default()
        }
    }

    /// Fills in what is known once the log was read.
    pub(crate) fn read(&mut self, recording: &GyroRecording) {
        self.column = Some(recording.column.clone());
        self.unit = Some(recording.unit.to_string());
        self.sha256.clone_from(&recording.sha256);
        self.started = started(&recording.clock).map(|t| t.to_string());
    }

    /// The same for two rows of one log, and for no others: the bytes of its file (of one that could not be read, its path), topic and axis.
    pub(crate) fn key(&self) -> (String, Option<String>, String) {
        let log = if self.sha256.is_empty() { &self.path } else { &self.sha256 };
        (log.clone(), self.topic.clone(), self.axis.clone())
    }
}

/// Time of the first sample; none where the file's clock tells no date of this century.
fn started(clock: &Clock) -> Option<Timestamp> {
    let Clock::FirstSample { file_s } = *clock else { return None };
    // milliseconds: a double holds no more than microseconds of today's Unix time
    DATES_S.contains(&file_s).then(|| Timestamp::from_millisecond((file_s * 1e3).round() as i64).ok()).flatten()
}

/// Type of a column, for files that have types.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Text,
    Flag,
    Whole,
    Number,
}

/// A row of results: one log, topic and axis, with what one command made of it, or its error. Its columns are its fields.
pub(crate) trait Record: Clone + Default + Serialize + DeserializeOwned + Send + Sync {
    /// Command that makes such rows.
    const COMMAND: &'static str;
    /// Columns beside those of [`Source`] that are no numbers, with their types.
    const TYPES: &'static [(&'static str, Kind)];

    fn source(&self) -> &Source;
    fn source_mut(&mut self) -> &mut Source;

    /// A row of which only the source is known.
    fn of(source: Source) -> Self {
        let mut row = Self::default();
        *row.source_mut() = source;
        row
    }

    /// The row of a log of which nothing could be made.
    fn failed(mut self, error: &Error) -> Self {
        self.source_mut().error = Some(error.to_string());
        self
    }

    /// The type of the column called `name`.
    fn kind(name: &str) -> Kind {
        const TEXT: [&str; 11] = [
            "path",
            "topic",
            "axis",
            "column",
            "unit",
            "sha256",
            "modified",
            "started",
            "gyroid_version",
            "options",
            "error",
        ];
        match name {
            n if TEXT.contains(&n) => Kind::Text,
            "size_bytes" => Kind::Whole,
            n => Self::TYPES.iter().find(|(column, _)| *column == n).map_or(Kind::Number, |(_, kind)| *kind),
        }
    }
}

/// Rows of which nothing could be made.
#[must_use]
pub(crate) fn failed<R: Record>(rows: &[R]) -> usize {
    rows.iter().filter(|r| r.source().error.is_some()).count()
}
