//! A statistic of a recording beside that of simulated ones

use serde::{Deserialize, Serialize};

/// Abscissa of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Over {
    /// Time as in the log, s.
    Time,
    /// Frequency, Hz.
    Frequency,
    /// Averaging time of the Allan deviation, s.
    AveragingTime,
    /// Size of the differences of neighbouring samples, in their own robust standard deviations.
    Amplitude,
    /// Temperature, °C.
    TemperatureC,
    /// Rate of change of the temperature, °C/s.
    TemperatureRate,
    /// Supply, V.
    SupplyV,
    /// Time since power-on in logarithmic bins, s.
    ElapsedTime,
}

/// Quantity that a curve shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shown {
    /// Mean deviation from the nominal warm-up, its repeatability taken out, rad/s; over a condition, less the mean of
    /// the whole recording.
    Deviation,
    /// Two-sided power spectral density, mean over the band, rad²/s²/Hz.
    Power,
    /// The largest single ordinate of the power spectral density in the band, rad²/s²/Hz.
    LargestPower,
    /// Overlapping Allan deviation, rad/s.
    AllanDeviation,
    /// Share of the samples in the bin.
    ShareOfSamples,
    /// Root mean square difference of neighbouring samples, relative to that of the whole recording.
    NoiseLevel,
}

/// The recording and the 95 % bands of two simulators, over one quantity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// Abscissa.
    pub over: Over,
    /// Unit of `x`.
    pub x_unit: String,
    /// Quantity shown.
    pub shown: Shown,
    /// Unit of the values.
    pub unit: String,
    /// Middle of each bin.
    pub x: Vec<f64>,
    /// Limits of each bin.
    pub bins: Vec<[f64; 2]>,
    /// Values of the recording.
    pub recorded: Vec<f64>,
    /// 95 % band of the nominal simulator.
    pub before: Vec<[f64; 2]>,
    /// 95 % band of the augmented simulator.
    pub after: Vec<[f64; 2]>,
    /// Share of the points outside the nominal band; 0.05 is expected of a simulator that lacks nothing.
    pub outside_before: f64,
    /// The same for the augmented simulator.
    pub outside_after: f64,
    /// Chi-squared of the recording under the nominal simulator in excess of that of its own recordings; 0 unless it
    /// exceeds all of them.
    pub excess_before: f64,
    /// The same for the augmented simulator.
    pub excess_after: f64,
    /// This curve's share of the excess of all curves under the nominal simulator.
    pub share: f64,
    /// Shortest interval of x that holds four fifths of the excess; none where there is none.
    pub most_in: Option<[f64; 2]>,
}
