//! Columns in memory that are read as those of a file: a table of a [place](Place).

use super::arrays::{self, Arrays, Entry, Loaded};
use super::format::Opened;
use super::head::Kind;
use super::source::About;
use crate::error::Result;
use crate::files::memory::{self, Place};
use crate::signal::Log;
use sha2::{Digest, Sha256};
use std::fmt;
use std::path::Path;
use std::sync::Arc;

/// Kind of the cells of a column in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellsKind {
    /// Numbers.
    Number,
    /// Dates with time of day, in nanoseconds since 1970-01-01 UTC.
    Instant,
}

/// Cells of a column that somebody else holds, in whatever form: copied once, when they are read.
pub trait Cells: Send + Sync {
    /// The cells, row by row; of a matrix, its rows one after another. Missing ones are NaN, or `i64::MIN`.
    ///
    /// # Errors
    /// Whatever keeps the holder from handing them over.
    fn load(&self) -> Result<Loaded>;
}

/// A column in memory: a vector, or a matrix of three columns such as the rates about three axes.
pub struct HeldColumn {
    /// Name, as a file would have it: unit and meaning are told from it.
    pub name: String,
    /// Kind of the cells.
    pub kind: CellsKind,
    /// Rows, and columns where it is a matrix.
    pub shape: Vec<u64>,
    /// Name of the type of the cells, for messages.
    pub type_name: String,
    /// The cells.
    pub cells: Box<dyn Cells>,
}

impl fmt::Debug for HeldColumn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({:?}, {} of shape {:?})", self.name, self.kind, self.type_name, self.shape)
    }
}

/// Columns as a log called `name`, to be read by the path of the place: by [`read_gyro`](crate::ingest::read_gyro),
/// [`read_drive`](crate::ingest::read_drive) and all that stands on them.
#[must_use]
pub fn hold(name: &str, columns: Vec<HeldColumn>) -> Place {
    let place = Place::new(name);
    memory::put(place.path(), columns);
    place
}

/// The log that a [`LogWriter`](crate::ingest::LogWriter) wrote to a place; `None` before.
#[must_use]
pub fn held(place: &Place) -> Option<Arc<Log>> {
    memory::get(place.path())
}

/// The columns at `path`, if it is a place that holds some.
pub(super) fn columns(path: &Path) -> Option<Arc<Vec<HeldColumn>>> {
    memory::get(path)
}

/// Opens columns that are held; the hash, where it is wanted, is of the names and cells that were read, in their order.
pub(super) fn open(path: &Path, columns: Arc<Vec<HeldColumn>>, hashed: bool) -> Result<Opened> {
    let entry = |column: &HeldColumn| Entry {
        group: String::new(),
        name: column.name.clone(),
        shape: column.shape.clone(),
        first_fastest: false,
        type_name: column.type_name.clone(),
        unit: None,
        kind: match column.kind {
            CellsKind::Number => Kind::Number,
            CellsKind::Instant => Kind::Instant,
        },
    };
    let entries = columns.iter().map(entry).collect();
    let source = path.display().to_string();
    let about = About { source, format: "arrays in memory", sha256: String::new(), notes: Vec::new() };
    arrays::open(Box::new(Held { entries, columns, hash: hashed.then(Sha256::new) }), about)
}

/// Cells that are hashed at once.
const PIECE: usize = 1 << 13;

/// Adds the bytes of `all` to `hash`.
fn add<T: Copy, const N: usize>(hash: &mut Sha256, all: &[T], bytes: impl Fn(T) -> [u8; N]) {
    let mut piece = Vec::with_capacity(PIECE * N);
    for some in all.chunks(PIECE) {
        piece.clear();
        some.iter().for_each(|v| piece.extend_from_slice(&bytes(*v)));
        hash.update(&piece);
    }
}

struct Held {
    entries: Vec<Entry>,
    columns: Arc<Vec<HeldColumn>>,
    /// Of what was read so far, where it is wanted.
    hash: Option<Sha256>,
}

impl Arrays for Held {
    fn entries(&self) -> &[Entry] {
        &self.entries
    }

    fn load(&mut self, entry: usize) -> Result<Loaded> {
        let column = &self.columns[entry];
        let cells = column.cells.load()?;
        if let Some(hash) = &mut self.hash {
            hash.update(column.name.as_bytes());
            match &cells {
                Loaded::Double(all) => add(hash, all, f64::to_le_bytes),
                Loaded::Single(all) => add(hash, all, f32::to_le_bytes),
                Loaded::Whole(all) => add(hash, all, i64::to_le_bytes),
            }
        }
        Ok(cells)
    }

    fn sha256(&mut self) -> Option<String> {
        self.hash.take().map(|hash| hash.finalize().iter().map(|b| format!("{b:02x}")).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ingest::{DriveQuery, GyroQuery, LogWriter, read_drive, read_gyro};
    use crate::signal::{Channel, TimeAxis, names};

    struct Doubles(Vec<f64>);

    impl Cells for Doubles {
        fn load(&self) -> Result<Loaded> {
            Ok(Loaded::Double(self.0.clone()))
        }
    }

    struct Instants(Vec<i64>);

    impl Cells for Instants {
        fn load(&self) -> Result<Loaded> {
            Ok(Loaded::Whole(self.0.clone()))
        }
    }

    fn doubles(name: &str, cells: Vec<f64>) -> HeldColumn {
        let (kind, shape) = (CellsKind::Number, vec![cells.len() as u64]);
        HeldColumn { name: name.into(), kind, shape, type_name: "float64".into(), cells: Box::new(Doubles(cells)) }
    }

    #[test]
    fn columns_are_read_as_those_of_a_file() {
        let rate: Vec<f64> = (0..400).map(|i| 1e-3 * f64::from((i * 37) % 101)).collect();
        let time: Vec<f64> = (0..400).map(|i| 0.01 * f64::from(i)).collect();
        let place = hold("arrays", vec![doubles("t_s", time.clone()), doubles("wz_deg_s", rate.clone())]);
        let read = read_gyro(place.path(), &GyroQuery::default()).unwrap();
        let file = tempfile::Builder::new().suffix(".csv").tempfile().unwrap();
        let rows: String = time.iter().zip(&rate).map(|(t, w)| format!("{t},{w}\n")).collect();
        std::fs::write(file.path(), format!("t_s,wz_deg_s\n{rows}")).unwrap();
        let of_file = read_gyro(file.path(), &GyroQuery::default()).unwrap();
        assert_eq!(read.log.require(names::GYRO_Z).unwrap(), of_file.log.require(names::GYRO_Z).unwrap());
        assert_eq!((read.unit, &read.column), (of_file.unit, &of_file.column));
        assert_eq!(read.sha256.len(), 64);
        // the hash is of the content: another place with the same has the same, and other cells have another
        let same = hold("arrays", vec![doubles("t_s", time.clone()), doubles("wz_deg_s", rate.clone())]);
        assert_eq!(read_gyro(same.path(), &GyroQuery::default()).unwrap().sha256, read.sha256);
        let other = hold("arrays", vec![doubles("t_s", time), doubles("wz_deg_s", rate.iter().map(|w| -w).collect())]);
        assert_ne!(read_gyro(other.path(), &GyroQuery::default()).unwrap().sha256, read.sha256);
    }

    #[test]
    fn matrices_and_dates_are_columns_too() {
        const NS: i64 = 1_000_000_000;
        let begin = 1_700_000_000 * NS;
        let times: Vec<i64> = (0..300).map(|i| begin + i * (NS / 100)).collect();
        let time = HeldColumn {
            name: "time".into(),
            kind: CellsKind::Instant,
            shape: vec![300],
            type_name: "datetime64[ns]".into(),
            cells: Box::new(Instants(times)),
        };
        let rows: Vec<f64> = (0..300).flat_map(|i| [0.0, f64::from(i % 7), -f64::from(i % 11)]).collect();
        let matrix = HeldColumn { shape: vec![300, 3], ..doubles("gyro_rad_s", rows) };
        let place = hold("frame", vec![time, matrix]);
        let query = GyroQuery { unit: Some(crate::units::RateUnit::RadPerS), ..GyroQuery::default() };
        let log = read_gyro(place.path(), &query).unwrap().log;
        assert_eq!(log.require(names::GYRO_Z).unwrap()[..12], (0..12).map(|i| -f64::from(i % 11)).collect::<Vec<_>>());
        assert!((log.time.span_s() - 2.99).abs() < 1e-9);
    }

    #[test]
    fn a_log_is_written_to_a_place_and_taken_from_there() {
        let time = TimeAxis::Uniform { start_s: 0.0, step_s: 0.5, len: 3 };
        let channels = vec![Channel { name: names::GYRO_Z.into(), values: vec![0.1, f64::NAN, 0.3] }];
        let log = Log { source: "made".into(), time, channels };
        let place = Place::new("log");
        let out = LogWriter::claim(place.path()).unwrap();
        assert!(held(&place).is_none());
        out.write(&log).unwrap();
        let back = held(&place).unwrap();
        assert_eq!((back.time.to_vec(), back.channels.len()), (vec![0.0, 0.5, 1.0], 1));
        // a place that holds a log is none of columns
        assert!(read_drive(&[place.path()], &DriveQuery::default()).is_err());
    }
}
