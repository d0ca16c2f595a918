//! The estimates of a run, row by row, as they are written.

use super::compare::Track;
use super::model::state;
use crate::error::Result;
use crate::signal::{Log, TimeAxis, names as channels};
use nalgebra::SVector;
use serde::Serialize;

/// Channels of [`super::Run::pose`] beside `x_m`, `y_m` and `heading_rad`.
pub mod names {
    /// Forward speed, m/s.
    pub const SPEED: &str = "speed_m_s";
    /// Yaw rate, rad/s.
    pub const YAW_RATE: &str = "yaw_rate_rad_s";
    /// Gyro error, rad/s.
    pub const GYRO_ERROR: &str = "gyro_error_rad_s";
    /// Standard deviation of x, m.
    pub const X_STD: &str = "x_std_m";
    /// Standard deviation of y, m.
    pub const Y_STD: &str = "y_std_m";
    /// Standard deviation of the heading, rad.
    pub const HEADING_STD: &str = "heading_std_rad";
    /// Standard deviation of the speed, m/s.
    pub const SPEED_STD: &str = "speed_std_m_s";
    /// Standard deviation of the yaw rate, rad/s.
    pub const YAW_RATE_STD: &str = "yaw_rate_std_rad_s";
    /// Standard deviation of the gyro error, rad/s.
    pub const GYRO_ERROR_STD: &str = "gyro_error_std_rad_s";
    /// Slip of the left wheel, where the filter models it.
    pub const SLIP_LEFT: &str = "slip_left";
    /// Slip of the right wheel.
    pub const SLIP_RIGHT: &str = "slip_right";
    /// Standard deviation of the left wheel's slip.
    pub const SLIP_LEFT_STD: &str = "slip_left_std";
    /// Standard deviation of the right wheel's slip.
    pub const SLIP_RIGHT_STD: &str = "slip_right_std";
    /// Normalised innovation squared of the row's readings together.
    pub const NIS: &str = "nis";
}

/// A wheel's slip over a run, as shares of the wheel's speed (see [`crate::traction`]).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WheelSlip {
    /// Root mean square of the estimates.
    pub rms: f64,
    /// Size of the largest estimate.
    pub largest: f64,
    /// Root mean square of their standard deviations.
    pub std_rms: f64,
}

/// States that are written, with the names of value and standard deviation.
const COLUMNS: [(usize, &str, &str); 6] = [
    (state::X, channels::X, names::X_STD),
    (state::Y, channels::Y, names::Y_STD),
    (state::HEADING, channels::HEADING, names::HEADING_STD),
    (state::SPEED, names::SPEED, names::SPEED_STD),
    (state::YAW_RATE, names::YAW_RATE, names::YAW_RATE_STD),
    (state::GYRO_ERROR, names::GYRO_ERROR, names::GYRO_ERROR_STD),
];

/// The output, column by column.
pub(super) struct Table {
    values: [Vec<f64>; COLUMNS.len()],
    std: [Vec<f64>; COLUMNS.len()],
    /// Left, its std, right, its std; where slip is modelled.
    slips: Option<[Vec<f64>; 4]>,
    nis: Vec<f64>,
}

impl Table {
    pub(crate) fn new(len: usize, slips: bool) -> Self {
        let columns = || std::array::from_fn(|_| Vec::with_capacity(len));
        let slips = slips.then(|| std::array::from_fn(|_| Vec::with_capacity(len)));
        Self { values: columns(), std: columns(), slips, nis: Vec::with_capacity(len) }
    }

    pub(crate) fn push<const N: usize>(
        &mut self,
        mean: &SVector<f64, N>,
        std: &SVector<f64, N>,
        slips: Option<[[f64; 2]; 2]>,
        nis: f64,
    ) {
        if let (Some(columns), Some(slips)) = (&mut self.slips, slips) {
            columns.iter_mut().zip(slips.iter().flatten()).for_each(|(column, value)| column.push(*value));
        }
        for (at, (i, ..)) in COLUMNS.iter().enumerate() {
            self.values[at].push(mean[*i]);
            self.std[at].push(std[*i]);
        }
        self.nis.push(nis);
    }

    pub(crate) fn slip(&self) -> Option<[WheelSlip; 2]> {
        let columns = self.slips.as_ref()?;
        let rms = |values: &[f64]| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
        let wheel = |slip: &[f64], std: &[f64]| WheelSlip {
            rms: rms(slip),
            largest: slip.iter().fold(0.0, |most, s| s.abs().max(most)),
            std_rms: rms(std),
        };
        Some([wheel(&columns[0], &columns[1]), wheel(&columns[2], &columns[3])])
    }

    /// An empty one of the same kind.
    pub(crate) fn like(&self) -> Self {
        Self::new(self.nis.len(), self.slips.is_some())
    }

    /// NIS of a row.
    pub(crate) fn nis(&self, row: usize) -> f64 {
        self.nis[row]
    }

    /// Rows that were added from the last to the first come into their order.
    pub(crate) fn reverse(&mut self) {
        let columns = self.values.iter_mut().chain(&mut self.std).chain(self.slips.iter_mut().flatten());
        columns.chain([&mut self.nis]).for_each(|column| column.reverse());
    }

    pub(crate) fn track(&self) -> Track<'_> {
        let column = |state| COLUMNS.iter().position(|c| c.0 == state).map_or(&[][..], |at| &self.values[at]);
        let [x_m, y_m, heading_rad] = [state::X, state::Y, state::HEADING].map(column);
        Track { x_m, y_m, heading_rad }
    }

    pub(crate) fn finish(self, source: &str, time: TimeAxis) -> Result<Log> {
        let mut log = Log::new(source, time);
        for (values, (_, name, _)) in self.values.into_iter().zip(COLUMNS) {
            log.push(name, values)?;
        }
        for (values, (_, _, name)) in self.std.into_iter().zip(COLUMNS) {
            log.push(name, values)?;
        }
        let slip_names = [names::SLIP_LEFT, names::SLIP_LEFT_STD, names::SLIP_RIGHT, names::SLIP_RIGHT_STD];
        for (values, name) in self.slips.into_iter().flatten().zip(slip_names) {
            log.push(name, values)?;
        }
        log.push(names::NIS, self.nis)?;
        Ok(log)
    }
}
