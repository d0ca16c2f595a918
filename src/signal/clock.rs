//! The clocks of a log: its own, which must run forward, and time since power-on.

use super::{Log, names};
use crate::error::{Error, ErrorKind, Result};

/// All times of `log`, s.
///
/// # Errors
/// [`ErrorKind::Time`] with the row where time does not increase.
pub(crate) fn increasing_times(log: &Log) -> Result<Vec<f64>> {
    let times = log.time.to_vec();
    match times.windows(2).position(|w| !(w[1] > w[0] && (w[1] - w[0]).is_finite())) {
        None => Ok(times),
        Some(k) => {
            let found = format!("time goes from {} s to {} s, and must increase", times[k], times[k + 1]);
            Err(Error::new(ErrorKind::Time, &log.source, found)
                .at(format!("row {}", k + 2))
                .hint("sort the rows by time, and keep one row for each time"))
        }
    }
}

/// Time since power-on of each row, s: the log's own channel, else counted from `start_s` at the first row.
///
/// # Errors
/// [`ErrorKind::Time`] with the row where the channel holds no time after power-on, or if there is no channel and
/// `start_s` is none.
pub fn since_power_on(log: &Log, start_s: f64) -> Result<Vec<f64>> {
    let Some(values) = log.get(names::SINCE_POWER_ON) else {
        if !(start_s.is_finite() && start_s >= 0.0) {
            return Err(Error::new(ErrorKind::Time, &log.source, format!("{start_s} s is not a time after power-on"))
                .at("start offset")
                .hint("give zero or a positive number of seconds"));
        }
        return Ok((0..log.len()).map(|k| start_s + (log.time.at(k) - log.time.at(0))).collect());
    };
    match values.iter().position(|v| !(v.is_finite() && *v >= 0.0)) {
        None => Ok(values.to_vec()),
        Some(k) => {
            let found = format!("{} is not a time after power-on", values[k]);
            let place = format!("row {}, column {:?}", k + 1, names::SINCE_POWER_ON);
            Err(Error::new(ErrorKind::Time, &log.source, found)
                .at(place)
                .hint("correct the column, or leave it out and give the start with --start-offset"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::TimeAxis;

    #[test]
    fn time_that_stands_still_is_named_by_row() {
        let log = Log::new("x.csv", TimeAxis::Explicit(vec![0.0, 0.1, 0.1, 0.2]));
        assert!(increasing_times(&log).unwrap_err().to_string().contains("row 3"));
        let log = Log::new("x.csv", TimeAxis::Explicit(vec![0.0, f64::NAN]));
        assert!(increasing_times(&log).is_err());
    }

    #[test]
    fn power_on_is_the_channel_or_counts_from_the_start() {
        let mut log = Log::new("x.csv", TimeAxis::Explicit(vec![5.0, 5.5]));
        assert_eq!(since_power_on(&log, 20.0).unwrap(), [20.0, 20.5]);
        assert!(since_power_on(&log, -1.0).unwrap_err().to_string().contains("start offset"));
        assert!(since_power_on(&log, f64::NAN).is_err());
        log.push(names::SINCE_POWER_ON, vec![7.0, 7.5]).unwrap();
        assert_eq!(since_power_on(&log, 20.0).unwrap(), [7.0, 7.5]);
        log.channels[0].values[1] = -1.0;
        assert!(since_power_on(&log, 0.0).unwrap_err().to_string().contains("row 2"));
    }
}
