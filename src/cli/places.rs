//! Whether files are what their places on the command line ask for.

use gyroid::files::sha256;
use gyroid::ingest::{self, GyroRecording};
use gyroid::signal::{Log, names};
use gyroid::vehicle::Odometry;
use gyroid::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};

/// A larger file is no configuration, bytes.
const MOST_BYTES: u64 = 1 << 20;

/// Channels that only a drive has.
const DRIVEN: [&str; 5] =
    [names::WHEEL_LEFT, names::WHEEL_RIGHT, names::ODO_SPEED, names::TORQUE_LEFT, names::TORQUE_RIGHT];

/// Refuses a configuration in the place of a log, whether or not they were swapped; `between` stands before the log on the
/// command line.
pub(crate) fn check<'a, P: AsRef<Path> + 'a + ?Sized>(
    command: &str,
    config: &Path,
    between: &str,
    logs: impl IntoIterator<Item = &'a P>,
) -> Result<()> {
    let Some(log) = logs.into_iter().map(AsRef::as_ref).find(|log| is_configuration(log)) else {
        return check_config(command, config, between);
    };
    if is_configuration(config) || !config.is_file() {
        return check_logs([log]);
    }
    let (config, log) = (config.display(), log.display());
    Err(Error::new(
        ErrorKind::Usage,
        &config,
        format!("is no configuration, and {log} is one, in the place of the log"),
    )
    .hint(format!("swap them: gyroid {command} {log} {between}{config}")))
}

/// Refuses a log in the place of the configuration.
fn check_config(command: &str, config: &Path, between: &str) -> Result<()> {
    let is_toml = config.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml"));
    if is_toml || !config.is_file() || is_configuration(config) {
        return Ok(());
    }
    let is_log = |seen: ingest::Inspection| seen.time.is_some() || !(seen.gyro.is_empty() && seen.topics.is_empty());
    if !ingest::inspect(config).is_ok_and(is_log) {
        return Ok(());
    }
    let config = config.display();
    Err(Error::new(ErrorKind::Usage, &config, "is a log, in the place of the configuration")
        .hint(format!("name the configuration first: gyroid {command} CONFIG.toml {between}{config}")))
}

/// Refuses a configuration in the place of a log, where the command takes logs alone.
pub(crate) fn check_logs<'a, P: AsRef<Path> + 'a + ?Sized>(logs: impl IntoIterator<Item = &'a P>) -> Result<()> {
    let Some(log) = logs.into_iter().map(AsRef::as_ref).find(|log| is_configuration(log)) else { return Ok(()) };
    Err(Error::new(ErrorKind::Usage, log.display(), "is a configuration, in the place of a log")
        .hint("name the recording there"))
}

/// Refuses a recording that is both diagnosed from and held out: a finding cannot be verified on the data that led to
/// it.
pub(crate) fn check_held_out<'a>(fit: &'a [Vec<PathBuf>], hold: &'a [Vec<PathBuf>]) -> Result<()> {
    let size = |path: &Path| std::fs::metadata(path).ok().filter(std::fs::Metadata::is_file).map(|m| m.len());
    for kept in hold.iter().flatten() {
        for own in fit.iter().flatten().filter(|own| size(own).is_some() && size(own) == size(kept)) {
            if sha256(own)? == sha256(kept)? {
                let found = format!("is held out (--hold), and the same as {}, which is diagnosed from", own.display());
                return Err(Error::new(ErrorKind::Usage, kept.display(), found)
                    .hint("hold out another recording, or leave out --hold"));
            }
        }
    }
    Ok(())
}

/// Whether a file is TOML with a table or key of a configuration.
fn is_configuration(path: &Path) -> bool {
    if std::fs::metadata(path).map_or(true, |m| !m.is_file() || m.len() > MOST_BYTES) {
        return false;
    }
    let Ok(text) = std::fs::read_to_string(path) else { return false };
    text.parse::<toml::Table>()
        .is_ok_and(|table| ["schema", "kind", "gyro", "vehicle"].iter().any(|key| table.contains_key(*key)))
}

/// Refuses a drive where the configuration is of a gyro at rest: a log that moves, and that has wheels.
pub(crate) fn check_rest(log: &Path, config: &Path, recording: &GyroRecording) -> Result<()> {
    let Some(motion) = recording.audit.motion.text() else { return Ok(()) };
    let Ok(drive) = ingest::read_log(log) else { return Ok(()) };
    let Some(channel) = DRIVEN.into_iter().find(|name| drive.get(name).is_some()) else { return Ok(()) };
    let found = format!("is a drive ({channel}; it moves, {motion}), and {} is of a gyro at rest", config.display());
    Err(Error::new(ErrorKind::Value, log.display(), found).hint(
        "give a log of the robot standing still, or a configuration with kind = \"driving\", [vehicle] and [encoder]",
    ))
}

/// Whether a log has a channel that only a drive has.
pub(crate) fn is_drive(log: &Log) -> bool {
    let of_drives = DRIVEN.into_iter().chain([names::ODO_YAW_RATE, names::X, names::WHEEL_LEFT_SPEED]);
    of_drives.into_iter().any(|name| log.get(name).is_some()) || Odometry::counts(log).is_some()
}

/// Refuses a log at rest where the configuration is of a drive: one with a gyro and nothing that a drive has.
pub(crate) fn check_drive(log: &Log, config: &Path) -> Result<()> {
    if is_drive(log) || log.get(names::GYRO_Z).is_none() {
        return Ok(());
    }
    let found = format!(
        "has a gyro and no wheels, torques or pose, and {} is of a drive (kind = \"driving\")",
        config.display()
    );
    Err(Error::new(ErrorKind::Column, &log.source, found).hint(format!(
        "if the gyro stood still, set kind = \"stationary\" in a configuration without [vehicle] and [encoder]; else name the \
         wheels' columns: --map {}=COLUMN[:UNIT], or add their file",
        names::WHEEL_LEFT
    )))
}
