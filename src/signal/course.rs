//! A slow channel beside the rate, such as a temperature that is logged now and then: its values at every time.

use super::log::TimeAxis;
use super::reduced::Reduced;
use crate::error::{Error, ErrorKind, Result};

/// Largest gap that is bridged, as a share of the samples.
const LONGEST_GAP: f64 = 0.1;

/// `values` with missing ones (NaN) interpolated linearly in time between their neighbours; before the first and after
/// the last known one they are held. `name` is the channel's, for messages.
///
/// # Errors
/// [`ErrorKind::Column`] if lengths differ; [`ErrorKind::Value`] where one gap is longer than a tenth of the values,
/// and than one value.
pub fn bridged(name: &str, time: &TimeAxis, values: &[f64]) -> Result<Vec<f64>> {
    if values.len() != time.len() {
        let found = format!("{} values on {} times", values.len(), time.len());
        return Err(Error::new(ErrorKind::Column, "log", found).at(format!("channel {name:?}")));
    }
    if values.iter().all(|v| v.is_finite()) {
        return Ok(values.to_vec());
    }
    let known: Vec<usize> = (0..values.len()).filter(|&i| values[i].is_finite()).collect();
    let longest = known.windows(2).map(|w| w[1] - w[0] - 1).chain(ends(&known, values.len())).max();
    if longest.is_none_or(|gap| gap as f64 > (LONGEST_GAP * values.len() as f64).max(1.0)) {
        let found = match longest {
            Some(gap) if !known.is_empty() => format!("{gap} of {} values are missing on end", values.len()),
            _ => "no value is a finite number".to_string(),
        };
        return Err(Error::new(ErrorKind::Value, "log", found)
            .at(format!("channel {name:?}"))
            .hint("cut the log to where the channel was logged"));
    }
    let mut out = Vec::with_capacity(values.len());
    let mut next = 0;
    for i in 0..values.len() {
        while next < known.len() && known[next] < i {
            next += 1;
        }
        out.push(match (next.checked_sub(1).map(|k| known[k]), known.get(next)) {
            (_, Some(&at)) if at == i => values[i],
            (Some(a), Some(&b)) => {
                let u = (time.at(i) - time.at(a)) / (time.at(b) - time.at(a));
                values[a] + u * (values[b] - values[a])
            }
            (Some(at), None) => values[at],
            (None, Some(&at)) => values[at],
            (None, None) => f64::NAN,
        });
    }
    Ok(out)
}

/// Missing values before the first known one and after the last; all of them where none is known.
fn ends(known: &[usize], len: usize) -> [usize; 2] {
    match (known.first(), known.last()) {
        (Some(first), Some(last)) => [*first, len - 1 - last],
        _ => [len, len],
    }
}

/// A slow channel on an even lattice, as a function of time.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// Time of the first value, s.
    pub first_s: f64,
    /// Time from one value to the next, s.
    pub step_s: f64,
    /// Values, all of them finite.
    pub values: Vec<f64>,
}

impl Course {
    /// The temperature of a log of which one pass kept block means, °C; `None` where it was not logged.
    ///
    /// # Errors
    /// As [`bridged`].
    pub(crate) fn of_temperature(log: &Reduced) -> Result<Option<Self>> {
        let coarse = &log.coarse;
        let Some(means) = &coarse.temperature_c else { return Ok(None) };
        let (first_s, step_s) = (coarse.middle_s(0), coarse.block_s());
        let axis = TimeAxis::Uniform { start_s: first_s, step_s, len: means.len() };
        let values = bridged(super::names::TEMPERATURE, &axis, means)?;
        Ok(Some(Self { first_s, step_s, values }))
    }

    /// The value at `t_s`, on the straight line between neighbours; held beyond the ends.
    #[must_use]
    pub fn at(&self, t_s: f64) -> f64 {
        let last = self.values.len() - 1;
        let place = ((t_s - self.first_s) / self.step_s).clamp(0.0, last as f64);
        let low = place as usize;
        let high = (low + 1).min(last);
        self.values[low] + (place - low as f64) * (self.values[high] - self.values[low])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NO: f64 = f64::NAN;

    #[test]
    fn what_is_missing_lies_on_the_line_in_time() {
        let time = TimeAxis::Explicit((0..40).map(|i| f64::from(i).powi(2)).collect());
        let mut values: Vec<f64> = (0..40).map(|i| 20.0 + 0.5 * f64::from(i).powi(2)).collect();
        let known = values.clone();
        for i in [5, 6, 7, 20, 30] {
            values[i] = NO;
        }
        let found = bridged("temperature_c", &time, &values).unwrap();
        assert!(found.iter().zip(&known).all(|(a, b)| (a - b).abs() < 1e-12));
        (values[0], values[39]) = (NO, NO);
        let found = bridged("temperature_c", &time, &values).unwrap();
        assert_eq!((found[0], found[39]), (known[1], known[38]));
    }

    #[test]
    fn a_channel_that_breaks_off_is_not_made_up() {
        let time = TimeAxis::Uniform { start_s: 0.0, step_s: 1.0, len: 100 };
        let half: Vec<f64> = (0..100).map(|i| if i < 50 { 20.0 } else { NO }).collect();
        let error = bridged("temperature_c", &time, &half).unwrap_err().to_string();
        assert!(error.contains("50 of 100") && error.contains("temperature_c"), "{error}");
        assert!(bridged("t", &time, &[NO; 100]).unwrap_err().to_string().contains("no value"));
        assert!(bridged("t", &time, &[1.0; 3]).is_err());
    }

    #[test]
    fn a_course_is_a_line_between_its_values() {
        let course = Course { first_s: 10.0, step_s: 2.0, values: vec![1.0, 3.0, 2.0] };
        let found = [0.0, 10.0, 11.0, 13.5, 14.0, 99.0].map(|t| course.at(t));
        assert_eq!(found, [1.0, 1.0, 2.0, 2.25, 2.0, 2.0]);
    }
}
