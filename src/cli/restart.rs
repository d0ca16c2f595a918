//! When the gyro was switched on: options that `simulate` and `navigate` share.

use clap::Args;
use gyroid::signal::{Log, names, since_power_on};
use gyroid::{Error, ErrorKind, Result};

/// Time since power-on, and how long the gyro was off before.
#[derive(Debug, Clone, Args)]
pub(crate) struct PowerArgs {
    /// Time since power-on at the first row, s, where no log says [default: 0]
    #[arg(long, value_name = "S")]
    start_offset: Option<f64>,
    /// Warm restart: the gyro was off for this long since the run in [gyro.last_run], s [default: it starts cold]
    #[arg(long, value_name = "S")]
    pub off_time: Option<f64>,
}

impl PowerArgs {
    /// Time since power-on at the first row, s, for logs that do not say.
    pub(super) fn since_power_on_s(&self) -> f64 {
        self.start_offset.unwrap_or(0.0)
    }

    /// Refuses a warm restart whose log and options disagree about when the gyro was switched on again.
    pub(super) fn check(&self, log: &Log) -> Result<()> {
        let (Some(_), Some(given)) = (self.off_time, self.start_offset) else { return Ok(()) };
        if log.get(names::SINCE_POWER_ON).is_none() {
            return Ok(());
        }
        let Some(logged) = since_power_on(log, given)?.first().copied() else { return Ok(()) };
        // within a row
        if (logged - given).abs() <= log.time.median_step_s() {
            return Ok(());
        }
        let found = format!("{given} s, and {} begins {logged} s after power-on", log.source);
        Err(Error::new(ErrorKind::Usage, "--off-time", found)
            .at("--start-offset")
            .hint("leave out --start-offset: with --off-time both count from the new power-on, the age is the file's"))
    }
}
