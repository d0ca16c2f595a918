//! The list of formats: one line each in [`FORMATS`].
//!
//! To add one: a file with a [`Format`], whose `open` returns a [`Source`] or a container of topics, and its line below.

pub(crate) mod arrays;
pub(crate) mod bag;
pub(crate) mod bytes;
pub(crate) mod csv;
pub(crate) mod dataflash;
#[cfg(feature = "db3")]
pub(crate) mod db3;
pub(crate) mod fill;
pub(crate) mod format;
#[cfg(feature = "hdf5")]
pub(crate) mod hdf5;
pub(crate) mod head;
pub(crate) mod input;
pub(crate) mod json_lines;
pub(crate) mod matlab;
pub(crate) mod mcap;
pub(crate) mod memory;
pub(crate) mod numpy;
pub(crate) mod numpy_header;
pub(crate) mod parquet;
pub(crate) mod parquet_plain;
pub(crate) mod px4;
pub(crate) mod ros;
pub(crate) mod scalar;
pub(crate) mod source;
pub(crate) mod table;
pub(crate) mod topics;
pub(crate) mod ulog;
pub(crate) mod watch;

use self::format::{Format, Opened};
use self::input::Input;
use self::source::Source;
use self::topics::{Stamp, Topic};
use self::watch::{State, Watched};
use crate::error::{Error, ErrorKind, Result};
use std::path::Path;

/// All formats in the order in which they are tried; text accepts whatever is not binary.
const FORMATS: &[Format] = &[
    parquet::FORMAT,
    bag::FORMAT,
    mcap::FORMAT,
    #[cfg(feature = "db3")]
    db3::FORMAT,
    ulog::FORMAT,
    dataflash::FORMAT,
    #[cfg(feature = "hdf5")]
    hdf5::FORMAT,
    matlab::FORMAT,
    numpy::ARRAY,
    numpy::ARCHIVE,
    json_lines::FORMAT,
    csv::FORMAT,
];

/// Formats known by their first bytes that are not read, and what to do instead.
const FOREIGN: &[(&[u8], &str, &str)] = &[
    #[cfg(not(feature = "db3"))]
    (b"SQLite format 3", "an SQLite file", "install gyroid with its feature db3, or export the IMU's topic as CSV"),
    #[cfg(not(feature = "hdf5"))]
    (b"\x89HDF", "an HDF5 file", "install gyroid with its feature hdf5, or export the gyro's table as CSV"),
    #[cfg(not(feature = "hdf5"))]
    (
        b"MATLAB 7.3",
        "a MATLAB file of version 7.3",
        "install gyroid with its feature hdf5, or write it with save('-v7')",
    ),
    (b"CDF\x01", "a NetCDF file", "export the gyro's table as CSV or Parquet"),
    (b"PK\x03\x04", "a zip archive or a spreadsheet", "unpack it, or save the sheet as CSV"),
    (b"\x28\xb5\x2f\xfd", "a zstd archive", "unpack it first: `zstd -d FILE`"),
    (b"BZh", "a bzip2 archive", "unpack it first: `bunzip2 FILE`"),
    (b"\xfd7zXZ", "an xz archive", "unpack it first: `unxz FILE`"),
    (b"\xff\xfe", "text in UTF-16", "save it as UTF-8"),
    (b"\xfe\xff", "text in UTF-16", "save it as UTF-8"),
];

/// Which of several tables in a file is read.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Choice<'a> {
    /// Name of the topic; otherwise the only one with a gyro.
    pub topic: Option<&'a str>,
    /// Which time of a message counts.
    pub stamp: Stamp,
    /// Whether the file's hash is not needed: it takes as long as the reading.
    pub unhashed: bool,
    /// Whether rows of text that do not parse are left out.
    pub skip_bad_rows: bool,
}

/// A table, and what there is to tell about its choice.
pub(super) struct Chosen {
    pub source: Box<dyn Source>,
    pub note: Option<String>,
}

impl Chosen {
    /// `before`: the file's state before it was opened.
    fn of(path: &Path, before: Option<State>, source: Box<dyn Source>, note: Option<String>) -> Self {
        Self { source: Box::new(Watched { source, path: path.to_path_buf(), before }), note }
    }
}

/// Opens the table of `path` that `choice` names, or the only one with a gyro.
pub(super) fn open(path: &Path, choice: Choice<'_>) -> Result<Chosen> {
    let before = State::of(path);
    match opened(path, choice)? {
        Opened::Topics(container) => {
            let listing = container.listing();
            let (topic, note) = topics::choose(&listing.about.source, &listing.topics, choice.topic)
                .map_err(|e| told_of_damage(e, &listing.about.notes))?;
            Ok(Chosen::of(path, before, container.open(topic, choice.stamp)?, note))
        }
        Opened::Table(source) => match choice.topic {
            None => Ok(Chosen::of(path, before, source, None)),
            Some(name) => Err(Error::new(ErrorKind::Usage, path.display(), format!("has no topics, so no {name:?}"))
                .hint("leave out --topic; name its column with --column")),
        },
    }
}

/// The topics of `path` with a gyro, if it has topics.
pub(super) fn gyro_topics(path: &Path) -> Result<Option<Vec<Topic>>> {
    let Opened::Topics(container) = open_any(path)? else { return Ok(None) };
    let listing = container.listing();
    let gyros = topics::with_gyro(&listing.about.source, &listing.topics)
        .map_err(|e| told_of_damage(e, &listing.about.notes))?;
    Ok(Some(gyros.into_iter().map(|i| listing.topics[i].clone()).collect()))
}

/// Appends the notes on damage to an error: a missing item may be one that was lost.
fn told_of_damage(mut error: Error, notes: &[String]) -> Error {
    for note in notes {
        error.found = format!("{}; {note}", error.found);
    }
    error
}

/// Opens the tables of a drive in `path`: those of `topics` that are there, or the only one with a gyro. Of several files,
/// each needs only some of the topics. `any` is the choice of a file of one table.
pub(super) fn open_all(path: &Path, topics: &[String], any: Choice<'_>, of_several: bool) -> Result<Vec<Chosen>> {
    if topics.is_empty() {
        return Ok(vec![open(path, any)?]);
    }
    let mut chosen = Vec::new();
    for topic in topics {
        let before = State::of(path);
        match opened(path, any)? {
            // a table beside a bag has no topics
            Opened::Table(source) if of_several => {
                chosen.push(Chosen::of(path, before, source, None));
                break;
            }
            Opened::Table(_) => chosen.push(open(path, Choice { topic: Some(topic), ..any })?),
            Opened::Topics(container) => {
                let listing = container.listing();
                match topics::choose(&listing.about.source, &listing.topics, Some(topic)) {
                    Ok((index, note)) => {
                        chosen.push(Chosen::of(path, before, container.open(index, any.stamp)?, note));
                    }
                    Err(_) if of_several => {}
                    Err(error) => return Err(error),
                }
            }
        }
    }
    Ok(chosen)
}

fn open_any(path: &Path) -> Result<Opened> {
    opened(path, Choice::default())
}

/// Opens `path` with the format that its content shows, whatever its extension says; the topic of `choice` is not looked at.
pub(super) fn opened(path: &Path, choice: Choice<'_>) -> Result<Opened> {
    if let Some(columns) = memory::columns(path) {
        return memory::open(path, columns, !choice.unhashed);
    }
    let mut input = Input::open(path)?;
    (input.hashed, input.skip_bad_rows) = (!choice.unhashed, choice.skip_bad_rows);
    if input.head.is_empty() {
        return Err(Error::new(ErrorKind::TooShort, path.display(), "is empty").hint("record the log again"));
    }
    if let Some((_, what, hint)) = FOREIGN.iter().find(|(magic, _, _)| foreign(&input.head, magic)) {
        return Err(Error::new(ErrorKind::Format, path.display(), format!("is {what}, which is not read")).hint(hint));
    }
    match FORMATS.iter().find(|f| (f.accepts)(&input.head)) {
        Some(format) => (format.open)(input),
        None => {
            let known: Vec<_> = FORMATS.iter().map(|f| f.name).collect();
            Err(Error::new(ErrorKind::Format, path.display(), "is a binary file of an unknown format")
                .hint(format!("convert it to one of: {}", known.join(", "))))
        }
    }
}

/// Whether a file is of a foreign format; an archive of arrays is not.
fn foreign(head: &[u8], magic: &[u8]) -> bool {
    head.starts_with(magic) && !(numpy::ARCHIVE.accepts)(head)
}
