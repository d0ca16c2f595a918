//! Logs from files: every format, every refusal, every finding; by the library and by the binary.

mod binary;
mod findings;
mod formats;
mod habits;
mod refusals;
mod round_trip;
mod units;

use gyroid::ingest::{GyroQuery, GyroRecording, read_gyro};
use gyroid::math::random::Stream;
use gyroid::units::RAD_S_PER_DEG_S;
use std::io::Write;
use std::path::{Path, PathBuf};

/// A directory that cleans up after itself, and files in it.
struct Files(tempfile::TempDir);

impl Files {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn put(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, content).unwrap();
        path
    }
}

fn gzip(content: &[u8]) -> Vec<u8> {
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    packer.write_all(content).unwrap();
    packer.finish().unwrap()
}

/// Rates of a gyro at rest, rad/s: 0.01 °/s/√Hz at 100 Hz on a bias of 0.2 °/s, written with nine decimals.
fn rates(n: usize) -> Vec<f64> {
    let mut s = Stream::new(42, 0);
    let noise = 0.01 * RAD_S_PER_DEG_S * 10.0;
    (0..n).map(|_| ((0.2 * RAD_S_PER_DEG_S + noise * s.normal()) * 1e9).round() / 1e9).collect()
}

/// A table of `t_s` at 100 Hz and `rates` under `name`, times `factor`.
fn csv(name: &str, factor: f64, n: usize) -> String {
    table("t_s", 0.01, name, factor, n)
}

fn table(time: &str, step: f64, name: &str, factor: f64, n: usize) -> String {
    let rows = rates(n)
        .iter()
        .enumerate()
        .map(|(i, x)| format!("{},{}\n", digits(i as f64 * step), x * factor))
        .collect::<String>();
    format!("{time},{name}\n{rows}")
}

/// A time without the noise of its last binary digit.
fn digits(x: f64) -> f64 {
    (x * 1e6).round() / 1e6
}

fn read(path: &Path) -> gyroid::Result<GyroRecording> {
    read_gyro(path, &GyroQuery::default())
}

fn gyro(recording: &GyroRecording) -> &[f64] {
    recording.log.get("gyro_z_rad_s").unwrap()
}

/// Asserts that all of `parts` stand in the error's text.
fn refused<T: std::fmt::Debug>(result: gyroid::Result<T>, kind: gyroid::ErrorKind, parts: &[&str]) {
    let error = result.unwrap_err();
    let text = error.to_string();
    assert_eq!(error.kind, kind, "{text}");
    for part in parts {
        assert!(text.contains(part), "{part:?} is not in: {text}");
    }
    assert!(error.hint.is_some(), "no hint: {text}");
}
