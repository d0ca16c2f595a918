//! The files of a case: one for each recording, or one for each sensor of it.

use crate::error::Result;
use crate::signal::{Log, TimeAxis, names};

/// In which files a recording lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Files {
    /// `fit.parquet`
    Parquet,
    /// `fit.csv`
    Csv,
    /// `fit_imu.csv`, `fit_wheels.csv`, `fit_pose.csv`: each sensor on times of its own.
    Apart,
}

/// The sensors that have files of their own, and their channels; all else is in the first file.
const OWN: [(&str, &[&str]); 2] =
    [("wheels", &[names::WHEEL_LEFT, names::WHEEL_RIGHT]), ("pose", &[names::X, names::Y, names::HEADING])];

/// File names and logs of the recording `name`, kept in `files`.
///
/// # Errors
/// [`crate::ErrorKind::Column`] where two channels are called alike.
pub(super) fn split(name: &str, log: &Log, files: Files) -> Result<Vec<(String, Log)>> {
    Ok(match files {
        Files::Parquet => vec![(format!("{name}.parquet"), log.clone())],
        Files::Csv => vec![(format!("{name}.csv"), log.clone())],
        Files::Apart => {
            let is_own = |channel: &str| OWN.iter().any(|(_, own)| own.contains(&channel));
            let mut out = vec![(format!("{name}_imu.csv"), part(log, |channel| !is_own(channel))?)];
            for (sensor, own) in OWN {
                out.push((format!("{name}_{sensor}.csv"), part(log, |channel| own.contains(&channel))?));
            }
            out.retain(|(_, log)| !log.is_empty());
            out
        }
    })
}

/// The channels that `is_in`, at the times at which they have values.
fn part(log: &Log, is_in: impl Fn(&str) -> bool) -> Result<Log> {
    let channels: Vec<_> = log.channels.iter().filter(|c| is_in(&c.name)).collect();
    let rows: Vec<usize> = (0..log.len()).filter(|k| channels.iter().any(|c| !c.values[*k].is_nan())).collect();
    let mut out = Log::new(log.source.clone(), TimeAxis::Explicit(rows.iter().map(|k| log.time.at(*k)).collect()));
    for channel in channels {
        out.push(channel.name.clone(), rows.iter().map(|k| channel.values[*k]).collect())?;
    }
    Ok(out)
}
