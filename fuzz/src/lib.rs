//! Shared by the fuzz targets: the entries of the tests, and which bytes belong to which target.
#![forbid(unsafe_code)]

#[path = "../../tests/formats/entry.rs"]
mod entry;

use libfuzzer_sys::Corpus;

/// First bytes of binary logs, by the target that reads them.
const MAGIC: [(&[u8], &str); 9] = [
    (b"PAR1", "parquet"),
    (b"#ROSBAG V", "bags"),
    (b"\x89MCAP", "bags"),
    (b"SQLite format 3", "bags"),
    (b"ULog", "flight"),
    (b"\xa3\x95", "flight"),
    (b"\x89HDF", "arrays"),
    (b"MATLAB", "arrays"),
    (b"\x93NUMPY", "arrays"),
];

/// The target that reads a log: the others pass over it, and every target spends its time on its own.
fn reader(bytes: &[u8]) -> &'static str {
    let found = MAGIC.into_iter().find(|(magic, _)| bytes.starts_with(magic)).map(|(_, target)| target);
    found.unwrap_or(if bytes.starts_with(b"PK") { "arrays" } else { "csv" })
}

/// Runs the entry called `target`.
pub fn run(target: &str, bytes: &[u8]) -> Corpus {
    let Some((_, run)) = entry::ENTRIES.into_iter().find(|(name, _)| *name == target) else { return Corpus::Reject };
    let is_log = MAGIC.iter().any(|(_, reader)| *reader == target) || target == "csv";
    if is_log && reader(bytes) != target {
        return Corpus::Reject;
    }
    run(bytes);
    Corpus::Keep
}
