//! The extension module `gyroid._gyroid`: commands of the library run for Python with the GIL released, on files and on
//! arrays that Python holds. All types and docstrings that users see are in `gyroid/`.
#![deny(unsafe_code)] // the macros of pyo3 allow it where they need it, which `forbid` would not let them

use gyroid::cli;
use gyroid::error::{Error, ErrorKind};
use gyroid::files::{OutputFile, Plan, memory};
use gyroid::ingest::{Cells, CellsKind, DriveQuery, HeldColumn, Loaded, LogWriter, held, hold, read_drive};
use gyroid::signal::Log;
use pyo3::buffer::{Element, PyBuffer};
use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyBytes, PyDict};
use std::ffi::OsString;
use std::path::PathBuf;

/// The library's error as `gyroid.Error`.
fn raised(py: Python<'_>, error: &Error) -> PyErr {
    let kind = match error.kind {
        ErrorKind::Io => "io",
        ErrorKind::Exists => "exists",
        ErrorKind::Format => "format",
        ErrorKind::Column => "column",
        ErrorKind::Unit => "unit",
        ErrorKind::Time => "time",
        ErrorKind::Value => "value",
        ErrorKind::TooShort => "too_short",
        ErrorKind::Config => "config",
        ErrorKind::Checksum => "checksum",
        ErrorKind::Numeric => "numeric",
        ErrorKind::Usage => "usage",
        _ => "other",
    };
    let make = || {
        let of = py.import("gyroid._errors")?.getattr("of_kind")?;
        of.call1((kind, &error.input, error.place.as_deref(), &error.found, error.hint.as_deref()))
    };
    make().map_or_else(|failed| failed, PyErr::from_value)
}

/// Runs `work` without the GIL.
fn detached<T: Send>(py: Python<'_>, work: impl Send + FnOnce() -> gyroid::Result<T>) -> PyResult<T> {
    py.detach(work).map_err(|error| raised(py, &error))
}

fn with_program(args: Vec<PathBuf>) -> impl Iterator<Item = OsString> + Send {
    std::iter::once(OsString::from("gyroid")).chain(args.into_iter().map(OsString::from))
}

/// Buffers of a column, one after another.
enum Buffers {
    Double(Vec<PyBuffer<f64>>),
    Single(Vec<PyBuffer<f32>>),
    Whole(Vec<PyBuffer<i64>>),
}

impl Buffers {
    fn of(dtype: &str, chunks: &[Bound<'_, PyAny>]) -> PyResult<Self> {
        fn all<T: Element>(chunks: &[Bound<'_, PyAny>]) -> PyResult<Vec<PyBuffer<T>>> {
            chunks.iter().map(PyBuffer::get).collect()
        }
        match dtype {
            "float64" => Ok(Self::Double(all(chunks)?)),
            "float32" => Ok(Self::Single(all(chunks)?)),
            _ => Ok(Self::Whole(all(chunks)?)),
        }
    }
}

/// The numbers of buffers, copied once where there is one of them.
fn numbers<T: Element>(py: Python<'_>, buffers: &[PyBuffer<T>]) -> gyroid::Result<Vec<T>> {
    let parts = buffers.iter().map(|buffer| buffer.to_vec(py));
    let mut parts = parts.collect::<PyResult<Vec<_>>>().map_err(|e| Error::new(ErrorKind::Value, "array", e))?;
    Ok(if parts.len() == 1 { parts.swap_remove(0) } else { parts.concat() })
}

impl Cells for Buffers {
    fn load(&self) -> gyroid::Result<Loaded> {
        Python::attach(|py| {
            Ok(match self {
                Self::Double(buffers) => Loaded::Double(numbers(py, buffers)?),
                Self::Single(buffers) => Loaded::Single(numbers(py, buffers)?),
                Self::Whole(buffers) => Loaded::Whole(numbers(py, buffers)?),
            })
        })
    }
}

/// A column as Python hands it over: name, type of the cells, whether they are instants, shape, chunks.
type Column<'py> = (String, String, bool, Vec<u64>, Vec<Bound<'py, PyAny>>);

/// Data in memory where a path is asked for.
#[pyclass(frozen, module = "gyroid._gyroid")]
struct Place {
    place: memory::Place,
}

#[pymethods]
impl Place {
    /// An empty place, or one that holds a file's bytes.
    #[new]
    #[pyo3(signature = (name, content = None))]
    fn new(name: &str, content: Option<&[u8]>) -> Self {
        let place = content.map_or_else(|| memory::Place::new(name), |c| memory::Place::with_bytes(name, c.to_vec()));
        Self { place }
    }

    /// A place that holds columns, which are kept and not copied.
    #[staticmethod]
    fn of_columns(name: &str, columns: Vec<Column<'_>>) -> PyResult<Self> {
        let held = columns.into_iter().map(|(name, type_name, instant, shape, chunks)| {
            let cells = Box::new(Buffers::of(&type_name, &chunks)?);
            let kind = if instant { CellsKind::Instant } else { CellsKind::Number };
            Ok(HeldColumn { name, kind, shape, type_name, cells })
        });
        Ok(Self { place: hold(name, held.collect::<PyResult<_>>()?) })
    }

    /// The path that stands for it.
    #[getter]
    fn path(&self) -> String {
        self.place.path().to_string_lossy().into_owned()
    }

    /// What the path begins with before the name.
    #[getter]
    fn prefix(&self) -> String {
        self.place.prefix()
    }

    /// The bytes that were written there, if any were.
    fn bytes<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyBytes>> {
        self.place.bytes().map(|bytes| PyBytes::new(py, &bytes))
    }

    /// The columns of the log that was written there, if one was: float64 by name, the time first.
    fn log<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        held(&self.place).map(|log| columns(py, &log)).transpose()
    }
}

/// Columns of a log as bytes of float64, in the machine's order.
fn columns<'py>(py: Python<'py>, log: &Log) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    let put = |name: &str, values: &[f64]| {
        let bytes = PyByteArray::new_with(py, size_of_val(values), |bytes| {
            let cells = bytes.chunks_exact_mut(size_of::<f64>()).zip(values);
            cells.for_each(|(cell, value)| cell.copy_from_slice(&value.to_ne_bytes()));
            Ok(())
        });
        all.set_item(name, bytes?)
    };
    put("t_s", &log.time.to_vec())?;
    log.channels.iter().try_for_each(|channel| put(&channel.name, &channel.values))?;
    Ok(all)
}

/// Runs the program with these arguments; it prints. The exit code.
#[pyfunction]
fn run(py: Python<'_>, args: Vec<PathBuf>) -> u8 {
    py.detach(|| cli::run(with_program(args)))
}

/// Runs a command: its answer as JSON, its page for people, whether it is fit for use.
#[pyfunction]
fn answer(py: Python<'_>, args: Vec<PathBuf>, typed: &str) -> PyResult<(String, String, bool)> {
    let answer = detached(py, || cli::answer(with_program(args), typed))?;
    Ok((answer.json.to_string(), answer.text, answer.fit_for_use))
}

/// Reads a log: its columns as bytes of float64 by name, the time first, and the reader's notes.
#[pyfunction]
fn read_log<'py>(py: Python<'py>, args: Vec<PathBuf>, typed: &str) -> PyResult<(Bound<'py, PyDict>, Vec<String>)> {
    let recording = detached(py, || cli::read_log(with_program(args), typed))?;
    Ok((columns(py, &recording.log)?, recording.notes))
}

/// Writes a file whole or not at all; one that gyroid did not write is replaced only by `force`.
#[pyfunction]
fn write_file(py: Python<'_>, path: PathBuf, content: &[u8], force: bool) -> PyResult<()> {
    detached(py, || {
        Plan::new().writes("path", [&path]).check(force)?;
        let mut file = OutputFile::claim(&path)?;
        file.write_all(content)?;
        file.commit()
    })
}

/// Writes the columns of a place as a log.
#[pyfunction]
fn write_log(py: Python<'_>, path: PathBuf, columns: &Place, force: bool) -> PyResult<()> {
    detached(py, || {
        Plan::new().writes("path", [&path]).check(force)?;
        let out = LogWriter::claim(&path)?;
        out.write(&read_drive(&[columns.place.path()], &DriveQuery::default())?.log)
    })
}

#[pymodule]
#[pyo3(name = "_gyroid")]
mod module {
    #[pymodule_export]
    use super::{Place, answer, read_log, run, write_file, write_log};

    #[pymodule_export]
    #[allow(non_upper_case_globals)]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
