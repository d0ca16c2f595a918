//! log = files( clocks( print( reading ) ) ): how logs are written and kept, apart from their content
//!
//! No habit is an effect: rates printed with few decimals, files that are tables of text, sensors recorded by machines
//! with clocks and rates of their own, and the steering that the configuration states.

use super::draw::{between, chance};
use super::files::Files;
use crate::config::Steering;
use crate::math::random::Stream;
use std::f64::consts::PI;

/// Stream of a case's seed.
pub(super) const HABITS: u64 = 3;

/// A step of the decimals over the standard deviation of a sample's white noise, at most.
const COARSEST: f64 = 0.1;
/// Longest offset of a clock, s, and by how much those of two recordings differ at least.
const OFFSET_S: f64 = 1.5;
const OFFSETS_APART_S: f64 = 0.3;
/// Rates at which slow wheels are read, Hz.
const SLOW_HZ: [f64; 2] = [10.0, 20.0];
/// Clocks that disagree and slow wheels are half as common as the other habits.
const RARER: f64 = 0.5;

/// Unit in which rates are printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Printed {
    Radians,
    Degrees,
}

impl Printed {
    /// Degrees or radians in a radian.
    fn in_a_radian(self) -> f64 {
        match self {
            Self::Radians => 1.0,
            Self::Degrees => 180.0 / PI,
        }
    }

    /// Steps in a unit: the smallest power of ten whose step is a tenth of `noise_rad_s` at most.
    fn steps(self, noise_rad_s: f64) -> f64 {
        let digits = -(COARSEST * noise_rad_s * self.in_a_radian()).log10();
        10.0_f64.powf(digits.ceil().clamp(0.0, 15.0))
    }

    /// Rounds rates, rad/s, to as few decimals as leave a noise of standard deviation `noise_rad_s` as it is.
    pub(crate) fn print(self, values_rad_s: &mut [f64], noise_rad_s: f64) {
        let (unit, steps) = (self.in_a_radian(), self.steps(noise_rad_s));
        for v in values_rad_s {
            *v = (*v * unit * steps).round() / steps / unit;
        }
    }

    /// Step of the decimals that [`Self::print`] leaves, rad/s.
    #[cfg(test)]
    pub(crate) fn step_rad_s(self, noise_rad_s: f64) -> f64 {
        1.0 / self.steps(noise_rad_s) / self.in_a_radian()
    }
}

/// Standard deviation of the noise from sample to sample, rad/s: the stated one, or less where samples differ by less.
pub(super) fn noise_rad_s(values_rad_s: &[f64], stated_rad_s: f64) -> f64 {
    let mut steps: Vec<f64> = values_rad_s.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    let middle = steps.len() / 2;
    if steps.is_empty() {
        return stated_rad_s;
    }
    let (_, median, _) = steps.select_nth_unstable_by(middle, f64::total_cmp);
    // the median of |N(0, 2σ²)|
    let found = *median / (0.674_490 * std::f64::consts::SQRT_2);
    if found > 0.0 { found.min(stated_rad_s) } else { stated_rad_s }
}

/// How the logs of one case are kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Habits {
    /// Rates of gyro and wheels are printed with few decimals.
    pub printed: Option<Printed>,
    pub files: Files,
    /// Steering that the configuration states; `None` where it states none.
    pub steering: Option<Steering>,
    /// Rate of the wheels' own file, Hz.
    pub wheels_hz: Option<f64>,
    /// By how much the clocks of wheels and pose are late in fit and hold, s.
    pub offsets_s: [Option<[f64; 2]>; 2],
}

impl Habits {
    /// One machine records all that there is, with all its digits.
    pub(crate) const PLAIN: Self =
        Self { printed: None, files: Files::Parquet, steering: None, wheels_hz: None, offsets_s: [None; 2] };

    /// Each habit with probability `share`, the rarer ones with half of it.
    pub(crate) fn draw(share: f64, s: &mut Stream) -> Self {
        let unit = if chance(s, 0.5) { Printed::Radians } else { Printed::Degrees };
        let printed = chance(s, share).then_some(unit);
        let csv = chance(s, share);
        let steering = match s.uniform() {
            u if u < share => Some(Steering::Skid),
            u if u < 2.0 * share => Some(Steering::Differential),
            _ => None,
        };
        let hz = between(s, SLOW_HZ[0], SLOW_HZ[1]);
        let wheels_hz = chance(s, RARER * share).then_some(hz);
        let (disagree, which) = (chance(s, RARER * share), s.uniform());
        let own = [which < 0.75, which >= 0.5];
        let offsets_s = own.map(|own| {
            let offsets_s = clock(s);
            (own && disagree).then_some(offsets_s)
        });
        let files = match (wheels_hz, csv) {
            (Some(_), _) => Files::Apart,
            (None, true) => Files::Csv,
            (None, false) => Files::Parquet,
        };
        Self { printed, files, steering, wheels_hz, offsets_s }
    }

    /// The habits that apply to a gyro at rest.
    pub(crate) fn at_rest(self) -> Self {
        let files = if self.files == Files::Parquet { Files::Parquet } else { Files::Csv };
        Self { printed: self.printed, files, ..Self::PLAIN }
    }

    /// Names of the habits as labels have them.
    pub(crate) fn names(&self) -> Vec<String> {
        let printed = self.printed.map(|_| "printed");
        let files = match self.files {
            Files::Parquet => None,
            Files::Csv => Some("csv"),
            Files::Apart => Some("apart"),
        };
        printed.into_iter().chain(files).map(String::from).collect()
    }
}

/// Offsets of one clock in both recordings, s.
fn clock(s: &mut Stream) -> [f64; 2] {
    let fit = between(s, -OFFSET_S, OFFSET_S);
    loop {
        let hold = between(s, -OFFSET_S, OFFSET_S);
        if (hold - fit).abs() >= OFFSETS_APART_S {
            return [fit, hold];
        }
    }
}
