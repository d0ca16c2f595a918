//! The list of formats: one line each in [`FORMATS`].
//!
//! To add one: a file with a [`Format`], whose `open` returns a [`Source`], and its line below.

use super::format::{Format, Source};
use super::input::Input;
use super::{parquet, text};
use crate::error::{Error, ErrorKind, Result};
use std::path::Path;

/// In the order in which they are tried; text accepts whatever is not binary.
const FORMATS: &[Format] = &[parquet::FORMAT, text::FORMAT];

/// Formats known by their first bytes that are not read, and what to do instead.
const FOREIGN: &[(&[u8], &str, &str)] = &[
    (b"#ROSBAG", "a ROS 1 bag", "export the topic: `rostopic echo -b FILE -p /imu/data > imu.csv`"),
    (b"\x89MCAP0", "an MCAP file", "export the IMU topic as CSV or Parquet"),
    (b"SQLite format 3", "an SQLite file (a ROS 2 bag?)", "export the IMU topic as CSV or Parquet"),
    (b"ULog\x01\x12\x35", "a PX4 ULog", "export it: `ulog2csv -m sensor_combined FILE`"),
    (b"\x89HDF", "an HDF5 file", "export the gyro's table as CSV or Parquet"),
    (b"CDF\x01", "a NetCDF file", "export the gyro's table as CSV or Parquet"),
    (b"MATLAB 5.0", "a MATLAB file", "`writetable` the gyro's table as CSV or Parquet"),
    (b"PK\x03\x04", "a zip archive or a spreadsheet", "unpack it, or save the sheet as CSV"),
    (b"\x28\xb5\x2f\xfd", "a zstd archive", "unpack it first: `zstd -d FILE`"),
    (b"BZh", "a bzip2 archive", "unpack it first: `bunzip2 FILE`"),
    (b"\xfd7zXZ", "an xz archive", "unpack it first: `unxz FILE`"),
    (b"\xff\xfe", "text in UTF-16", "save it as UTF-8"),
    (b"\xfe\xff", "text in UTF-16", "save it as UTF-8"),
];

/// Opens `path` with the format that its content shows, whatever its extension says.
pub(super) fn open(path: &Path) -> Result<Box<dyn Source>> {
    let input = Input::open(path)?;
    if input.head.is_empty() {
        return Err(Error::new(ErrorKind::TooShort, path.display(), "is empty").mend("record the log again"));
    }
    if let Some((_, what, mend)) = FOREIGN.iter().find(|(magic, _, _)| input.head.starts_with(magic)) {
        return Err(Error::new(ErrorKind::Format, path.display(), format!("is {what}, which is not read")).mend(mend));
    }
    match FORMATS.iter().find(|f| (f.accepts)(&input.head)) {
        Some(format) => (format.open)(input),
        None => {
            let known: Vec<_> = FORMATS.iter().map(|f| f.name).collect();
            Err(Error::new(ErrorKind::Format, path.display(), "is a binary file of an unknown format")
                .mend(format!("convert it to one of: {}", known.join(", "))))
        }
    }
}
