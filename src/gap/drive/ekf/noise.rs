//! R, Q: variances of the readings, and of the motion beyond the model, that the filter assumes

use crate::gap::drive::record::{Belief, Record};

/// Number of classes, from even motion to the hardest.
pub(crate) const CLASSES: usize = 5;
/// Diffusion of each class over the mean, of v and of ω. The five are `CLASSES`, which rustc 1.95 cannot take here: it
/// panics over a constant in the type of another one.
pub(crate) type Ratios = [[f64; 5]; 2];
/// The same diffusion in all classes.
pub(crate) const EVEN: Ratios = [[1.0; 5]; 2];

/// Time for which an uncertain force keeps its sign, s.
pub(crate) const LASTING_S: f64 = crate::model::drive::FORCE_LASTING_S;

/// Quantity that is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Channel {
    /// Speed of the left wheel, rad/s
    WheelLeft,
    /// Speed of the right wheel, rad/s
    WheelRight,
    /// Yaw rate, rad/s
    Gyro,
    /// Position, m
    X,
    /// Position, m
    Y,
    /// Heading, rad
    Heading,
}

impl Channel {
    /// All channels, in order.
    pub(crate) const ALL: [Self; 6] = [Self::WheelLeft, Self::WheelRight, Self::Gyro, Self::X, Self::Y, Self::Heading];
}

/// Motion beyond the model: without torques, accelerations last and speeds diffuse; torque noise may change within a
/// step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Process {
    /// Diffusion of v (m²/s³) and ω (rad²/s³), the mean over time
    pub diffusion: [f64; 2],
    /// Diffusion in rows with little and with much change of motion, relative to that mean
    pub agility: Ratios,
    /// Diffusion of v (m²/s³) and ω (rad²/s³) by an input that nothing is known of, with which the motion before a row
    /// tells nothing of it; zero where that has to tell
    pub unknown_input: [f64; 2],
    /// Share of an acceleration that lasts to the next row, 0 to 1
    pub lasting: f64,
    /// Torque noise of each wheel that is white within a step, squared: N²·m²·s
    pub ripple: f64,
    /// Torque noise of each wheel that an effect passes to its reading, squared: N²·m²·s
    pub at_rims: f64,
}

impl Default for Process {
    fn default() -> Self {
        Self { diffusion: [0.0; 2], agility: EVEN, unknown_input: [0.0; 2], lasting: 0.0, ripple: 0.0, at_rims: 0.0 }
    }
}

/// Variances that the filter assumes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Noise {
    /// Torque noise of each wheel, squared: N²·m²·s
    pub torque: f64,
    /// Motion beyond the model
    pub process: Process,
    /// Quantization step of the wheels by which repeated readings are correlated, rad/s; zero: all readings are
    /// independent
    pub wheel_lsb_rad_s: f64,
    /// Variance of one reading of each channel, in its unit squared
    pub reading: [f64; 6],
}

/// Factor on the variance of a reading that excludes it from a pass of the filter.
const ASIDE: f64 = 1e10;

impl Noise {
    /// Excludes the readings of these channels, by their indices, from a pass of the filter.
    pub(crate) fn exclude(&mut self, channels: impl IntoIterator<Item = usize>) {
        channels.into_iter().for_each(|channel| self.reading[channel] *= ASIDE);
    }

    /// The same without the noise of the wheels' quantization, but no less than the stated noise of `record`.
    #[must_use]
    pub(crate) fn without_lattice(&self, record: &Record) -> Self {
        let mut plain = Self { wheel_lsb_rad_s: 0.0, ..*self };
        let least = record.belief.wheel_std_rad_s.powi(2).min(self.reading[0]);
        plain.reading[..2].iter_mut().for_each(|r| *r = (*r - self.wheel_lsb_rad_s.powi(2) / 12.0).max(least));
        plain
    }

    /// Noise of the nominal filter: `before`, the noise without effects, with the motion beyond the model of this noise
    /// and, without torques, also its noise of wheels and gyro.
    #[must_use]
    pub(crate) fn nominal_beside(&self, before: &Self, record: &Record) -> Self {
        // the nominal robot has no effect that passes torque noise on
        let process = Process { at_rims: 0.0, ..self.process };
        let mut nominal = Self { process, ..*before };
        if record.torques_n_m.is_none() {
            nominal.reading[..3].copy_from_slice(&self.without_lattice(record).reading[..3]);
        }
        nominal
    }

    /// As stated in the configuration; quantization of the wheels adds a twelfth of its step squared.
    #[must_use]
    pub(crate) fn believed(record: &Record, wheel_lsb_rad_s: Option<f64>) -> Self {
        Self::of(&record.belief, record.torques_n_m.is_some(), wheel_lsb_rad_s)
    }

    /// The same from `b`; `forced`: whether torques were logged.
    #[must_use]
    pub(crate) fn of(b: &Belief, forced: bool, wheel_lsb_rad_s: Option<f64>) -> Self {
        let wheel = b.wheel_std_rad_s.powi(2) + wheel_lsb_rad_s.map_or(0.0, |q| q * q / 12.0);
        let torque = if forced { b.torque_noise_n_m_sqrt_s.powi(2) } else { 0.0 };
        let (position, heading) = (b.position_std_m.powi(2), b.heading_std_rad.powi(2));
        Self {
            torque,
            process: Process::default(),
            wheel_lsb_rad_s: 0.0,
            reading: [wheel, wheel, b.gyro_std_rad_s.powi(2), position, position, heading],
        }
    }
}

impl Record {
    /// With the noise of wheels and gyro of `noise` if no torques were logged: motion and noise are then estimated
    /// together.
    #[must_use]
    pub(crate) fn with_levels_of(mut self, noise: &Noise) -> Self {
        if self.torques_n_m.is_none() {
            let [wheel, _, gyro, ..] = noise.reading.map(f64::sqrt);
            (self.belief.wheel_std_rad_s, self.belief.gyro_std_rad_s) = (wheel, gyro);
        }
        self
    }
}
