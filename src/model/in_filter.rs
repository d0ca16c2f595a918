//! reading = gain · expected + offset + noise, of two kinds between which a sensor switches at random
//!
//! Form of an effect in a filter. A simulator draws random numbers and knows when each row is read. A filter knows
//! neither the draws nor the present reading of a sensor that is late. The rest it takes from the same equations.

use super::instrument::Instrument;

/// Form of an effect of drives ([`super::drive::DriveEffect`]) in a filter.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum InFilter {
    /// The equations as they stand.
    #[default]
    Equations,
    /// The gyro's readings are this late, s (negative: early): they are compared with the state at their own time.
    GyroDelay(f64),
    /// The same for the wheels' readings.
    WheelDelay(f64),
    /// The same for the external reference: a filter that drives by wheels and gyro does not use it.
    PoseDelay(f64),
    /// Standard deviation of an instrument's white noise over the nominal one.
    Noise(Instrument, f64),
    /// The gyro switches between two ways of reading.
    GyroSwitch(Switch),
    /// A wheel (left 0, right 1) switches between two ways of reading.
    WheelSwitch(usize, Switch),
    /// The wheels' readings are quantized with this step, rad/s.
    WheelLattice(f64),
}

/// Form of an effect of the gyro ([`super::GyroEffect`]) in a filter.
#[derive(Debug, Clone, PartialEq)]
pub enum GyroInFilter {
    /// Bias and scale of the white noise follow from row and scene: the effect itself tells them.
    Known,
    /// White noise of this variance is added to each reading, rad²/s².
    White(f64),
    /// The bias walks: K, rad/s/√s.
    Walk(f64),
    /// Exponentially correlated noises are added: standard deviation (rad/s) and correlation time (s) of each.
    Correlated(Vec<[f64; 2]>),
    /// A sinusoid of unknown phase is added.
    Sinusoid {
        /// rad/s
        amplitude_rad_s: f64,
        /// 2π times its frequency, rad/s
        angular_frequency_rad_s: f64,
    },
    /// The gyro switches between two ways of reading.
    Switching(Switch),
    /// A filter cannot represent it; the reason, as the rest of a sentence.
    Unrepresented(&'static str),
}

/// One way of reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Way {
    /// Factor on the expected reading.
    pub gain: f64,
    /// Added to the expected reading, in the sensor's unit.
    pub offset: f64,
    /// Variance of noise beyond the sensor's own, its unit squared.
    pub variance: f64,
}

impl Way {
    /// Reading without gain, offset or additional noise.
    pub(crate) const PLAIN: Self = Self { gain: 1.0, offset: 0.0, variance: 0.0 };
}

/// Two ways of reading, and how a sensor switches between them: a Markov chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Switch {
    /// The two ways.
    pub ways: [Way; 2],
    /// Stationary probability of the second way.
    pub share: f64,
    /// Rate at which the probability of the second way tends to `share`, 1/s; infinite where each reading is drawn
    /// anew.
    pub rate_per_s: f64,
    /// Initial probability of the second way.
    pub start: f64,
}

impl Switch {
    /// Probability of the second way `dt_s` after it was `probability`.
    #[must_use]
    pub(crate) fn after(&self, probability: f64, dt_s: f64) -> f64 {
        let stays = if self.rate_per_s.is_finite() { (-self.rate_per_s * dt_s).exp() } else { 0.0 };
        self.share + (probability - self.share) * stays
    }
}
