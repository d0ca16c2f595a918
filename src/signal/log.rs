//! A log in memory: one time axis, named channels, all SI. Missing values are NaN.

use crate::error::{Error, ErrorKind, Result};
use crate::math::scan;

/// Canonical channel names: what readers map a file's columns to, and what simulator and filter write and read.
pub mod names {
    /// Yaw rate of the gyro, rad/s.
    pub const GYRO_Z: &str = "gyro_z_rad_s";
    /// Sensor temperature, °C.
    pub const TEMPERATURE: &str = "temperature_c";
    /// Supply voltage, V.
    pub const SUPPLY: &str = "supply_v";
    /// Time since power-on where the time axis counts from something else, s.
    pub const SINCE_POWER_ON: &str = "time_since_power_on_s";
    /// Commanded torque of the left wheel, N·m.
    pub const TORQUE_LEFT: &str = "torque_left_n_m";
    /// Commanded torque of the right wheel, N·m.
    pub const TORQUE_RIGHT: &str = "torque_right_n_m";
    /// Left encoder speed, rad/s.
    pub const WHEEL_LEFT: &str = "wheel_left_rad_s";
    /// Right encoder speed, rad/s.
    pub const WHEEL_RIGHT: &str = "wheel_right_rad_s";
    /// Speed over ground that the left encoder stands for, m/s.
    pub const WHEEL_LEFT_SPEED: &str = "wheel_left_m_s";
    /// Speed over ground that the right encoder stands for, m/s.
    pub const WHEEL_RIGHT_SPEED: &str = "wheel_right_m_s";
    /// Current of the left motor, A; positive drives forwards.
    pub const CURRENT_LEFT: &str = "motor_current_left_a";
    /// Current of the right motor, A; positive drives forwards.
    pub const CURRENT_RIGHT: &str = "motor_current_right_a";
    /// Commanded speed of the left wheel, rad/s.
    pub const COMMAND_LEFT: &str = "command_left_rad_s";
    /// Commanded speed of the right wheel, rad/s.
    pub const COMMAND_RIGHT: &str = "command_right_rad_s";
    /// Commanded forward speed, m/s.
    pub const COMMAND_SPEED: &str = "command_speed_m_s";
    /// Commanded yaw rate, rad/s.
    pub const COMMAND_YAW_RATE: &str = "command_yaw_rate_rad_s";
    /// Forward speed by odometry, m/s.
    pub const ODO_SPEED: &str = "odo_speed_m_s";
    /// Yaw rate by odometry, that is by the difference of the wheels, rad/s.
    pub const ODO_YAW_RATE: &str = "odo_yaw_rate_rad_s";
    /// Ticks that the left encoder has counted.
    pub const WHEEL_LEFT_TICKS: &str = "wheel_left_ticks";
    /// Ticks that the right encoder has counted.
    pub const WHEEL_RIGHT_TICKS: &str = "wheel_right_ticks";
    /// External reference: position, m.
    pub const X: &str = "x_m";
    /// External reference: position, m.
    pub const Y: &str = "y_m";
    /// External reference: heading, rad.
    pub const HEADING: &str = "heading_rad";
}

/// Time of each row, s.
#[derive(Debug, Clone, PartialEq)]
pub enum TimeAxis {
    /// Row i at `start_s + i * step_s`.
    Uniform {
        /// Time of the first row, s.
        start_s: f64,
        /// Sample time, s.
        step_s: f64,
        /// Number of rows.
        len: usize,
    },
    /// One time a row, strictly increasing, s.
    Explicit(Vec<f64>),
}

impl TimeAxis {
    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Uniform { len, .. } => *len,
            Self::Explicit(t) => t.len(),
        }
    }

    /// Whether there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Time of row `i`, s. Panics outside `0..len`, like a slice.
    #[inline]
    #[must_use]
    pub fn at(&self, i: usize) -> f64 {
        match self {
            Self::Uniform { start_s, step_s, len } => {
                assert!(i < *len, "row {i} of {len}");
                start_s + i as f64 * step_s
            }
            Self::Explicit(t) => t[i],
        }
    }

    /// All times, s.
    #[must_use]
    pub fn to_vec(&self) -> Vec<f64> {
        match self {
            Self::Uniform { start_s, step_s, len } => (0..*len).map(|i| start_s + i as f64 * step_s).collect(),
            Self::Explicit(t) => t.clone(),
        }
    }

    /// Last time minus first, s; 0 with fewer than two rows.
    #[must_use]
    pub fn span_s(&self) -> f64 {
        if self.len() < 2 { 0.0 } else { self.at(self.len() - 1) - self.at(0) }
    }

    /// Median interval between rows, s; NaN with fewer than two rows.
    #[must_use]
    pub fn median_step_s(&self) -> f64 {
        match self {
            _ if self.len() < 2 => f64::NAN,
            Self::Uniform { step_s, .. } => *step_s,
            Self::Explicit(t) => {
                let mut d: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
                let mid = d.len() / 2;
                *d.select_nth_unstable_by(mid, f64::total_cmp).1
            }
        }
    }

    /// The same axis with `offset_s` added to every time.
    #[must_use]
    pub fn shifted(self, offset_s: f64) -> Self {
        match self {
            Self::Uniform { start_s, step_s, len } => Self::Uniform { start_s: start_s + offset_s, step_s, len },
            Self::Explicit(mut t) => {
                t.iter_mut().for_each(|x| *x += offset_s);
                Self::Explicit(t)
            }
        }
    }

    /// The uniform axis of `time_s`, if every time lies within `tolerance` steps of its lattice.
    #[must_use]
    pub fn even(time_s: &[f64], tolerance: f64) -> Option<Self> {
        let (&[start_s, ..], &[.., end_s]) = (time_s, time_s) else { return None };
        let step_s = (end_s - start_s) / (time_s.len() - 1) as f64;
        // NaN is far from everywhere
        let near = |i: usize, x: f64| (x - (start_s + i as f64 * step_s)).abs() <= tolerance * step_s;
        let even = step_s > 0.0 && scan::first_where(time_s, |i, x| !near(i, x)).is_none();
        even.then_some(Self::Uniform { start_s, step_s, len: time_s.len() })
    }

    /// Number of rows before the first whose time does not meet `predicate`, which the earlier rows all meet and the later ones
    /// do not.
    #[must_use]
    pub(crate) fn partition_point(&self, predicate: impl Fn(f64) -> bool) -> usize {
        let (mut low, mut high) = (0, self.len());
        while low < high {
            let middle = low + (high - low) / 2;
            if predicate(self.at(middle)) {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        low
    }

    /// Turns an explicit axis into a uniform one where every time lies within `tolerance` steps of the lattice.
    #[must_use]
    pub fn compact(self, tolerance: f64) -> Self {
        match self {
            Self::Explicit(t) => Self::even(&t, tolerance).unwrap_or(Self::Explicit(t)),
            uniform => uniform,
        }
    }
}

/// One named series. Its unit stands in the name (`gyro_z_rad_s`), values are SI, missing ones NaN.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Name with unit suffix.
    pub name: String,
    /// One value a row.
    pub values: Vec<f64>,
}

/// A recording: time axis and channels of equal length.
#[derive(Debug, Clone, PartialEq)]
pub struct Log {
    /// Where it came from, for messages: a file name, or "simulation".
    pub source: String,
    /// Time of each row, s.
    pub time: TimeAxis,
    /// Channels in the file's order.
    pub channels: Vec<Channel>,
}

impl Log {
    /// An empty log of `source` on `time`.
    #[must_use]
    pub fn new(source: impl Into<String>, time: TimeAxis) -> Self {
        Self { source: source.into(), time, channels: Vec::new() }
    }

    /// Adds a channel.
    ///
    /// # Errors
    /// [`ErrorKind::Column`] if the length differs from the time axis, or the name is taken.
    pub fn push(&mut self, name: impl Into<String>, values: Vec<f64>) -> Result<()> {
        let name = name.into();
        if values.len() != self.time.len() {
            let found = format!("{} values on {} times", values.len(), self.time.len());
            return Err(Error::new(ErrorKind::Column, &self.source, found).at(format!("channel {name:?}")));
        }
        if self.get(&name).is_some() {
            return Err(Error::new(ErrorKind::Column, &self.source, "is there twice").at(format!("channel {name:?}")));
        }
        self.channels.push(Channel { name, values });
        Ok(())
    }

    /// The values of channel `name`, if it is there.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&[f64]> {
        self.channels.iter().find(|c| c.name == name).map(|c| c.values.as_slice())
    }

    /// The values of channel `name`.
    ///
    /// # Errors
    /// [`ErrorKind::Column`] that lists the channels that are there.
    pub fn require(&self, name: &str) -> Result<&[f64]> {
        self.get(name).ok_or_else(|| {
            let there: Vec<_> = self.channels.iter().map(|c| c.name.as_str()).collect();
            Error::new(ErrorKind::Column, &self.source, format!("no channel {name:?}; there are {}", there.join(", ")))
                .hint("call the column that in the log, or write the log anew under that name")
        })
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Whether there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compact_keeps_only_what_is_uniform() {
        let even = TimeAxis::Explicit((0..100).map(|i| 3.0 + 0.01 * f64::from(i)).collect());
        assert!(matches!(even.clone().compact(1e-6), TimeAxis::Uniform { len: 100, .. }));
        let TimeAxis::Explicit(mut t) = even else { unreachable!() };
        t[50] += 0.004;
        let jittered = TimeAxis::Explicit(t);
        assert_eq!(jittered.clone().compact(1e-6), jittered);
        assert!((jittered.median_step_s() - 0.01).abs() < 1e-12);
    }

    #[test]
    fn a_channel_of_another_length_is_refused() {
        let mut log = Log::new("test", TimeAxis::Uniform { start_s: 0.0, step_s: 1.0, len: 3 });
        assert!(log.push("a", vec![0.0; 2]).is_err());
        log.push("a", vec![0.0; 3]).unwrap();
        assert!(log.push("a", vec![0.0; 3]).is_err());
        assert!(log.require("b").unwrap_err().to_string().contains("there are a"));
    }
}
