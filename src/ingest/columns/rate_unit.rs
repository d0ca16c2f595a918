//! The unit of a rate column: stated by the user, by its name, or guessed; and whether the numbers agree.
//!
//! Two things in a log at rest tell degrees from radians, whose numbers differ by 57.3:
//!
//! **Noise.** Datasheets of MEMS gyros give noise densities from 0.0025 °/s/√Hz (best silicon, 0.15 °/√h) to
//! 0.1 °/s/√Hz. The density is read off in two ways that bracket it: the noise of a sample times √Ts (too high where
//! a fast sensor was sampled slowly without averaging, so Ts counts at most 20 ms on the low side: 25 Hz of sensor
//! bandwidth), and the Allan deviation at 1 s times √1 s (right also where the sensor has a low-pass filter).
//! - Named rad/s: degrees would read as 0.0025 rad/s/√Hz and more. Above 2e-3 rad/s/√Hz (0.115 °/s/√Hz, noisier than
//!   any datasheet) the unit is asked about.
//! - Named °/s: radians of a part of up to 0.029 °/s/√Hz read as less than 5e-4 °/s/√Hz, five times quieter than the
//!   best silicon. Below that the unit is asked about. (A fibre-optic gyro is that quiet: `--unit deg/s` says so.)
//!
//! **Lattice.** Steps of common sensors (1/131, 0.0175, 0.05 °/s ...) are known to four digits. A step that is one of
//! them in the named unit settles it; one that is so only in the other unit is evidence against the name, and counts
//! together with a noise that leans the same way (above 0.06 °/s/√Hz read as rad/s, below 0.003 °/s/√Hz read as °/s).
//! Fifteen steps with a window of ±0.2 % cover about 1 % of a decade and a half: alone, one in a hundred matches by chance.
//!
//! A rest rate above 20 °/s (the worst zero-rate output of common parts) is asked about in any unit.

use crate::ingest::clean::quantization;
use crate::math::robust::{mad_std, median, quantile};
use crate::units::{RAD_S_PER_DEG_S, RateUnit};

/// Worst zero-rate output of common MEMS gyros, rad/s.
const LARGEST_REST_RATE: f64 = 20.0 * RAD_S_PER_DEG_S;
/// Noise densities outside these are those of another unit: rad/s/√Hz.
const NOISIEST: f64 = 2e-3;
const QUIETEST: f64 = 5e-4 * RAD_S_PER_DEG_S;
/// Densities that lean to the other unit, and count together with its lattice: rad/s/√Hz.
const NOISY: f64 = 0.0605 * RAD_S_PER_DEG_S;
const QUIET: f64 = 3e-3 * RAD_S_PER_DEG_S;
/// Ts of the low estimate is at most this, s.
const SLOWEST_BANDWIDTH_S: f64 = 0.02;
/// With fewer samples nothing is said about noise.
const FEWEST: usize = 64;
/// Steps of common gyros, °/s: 16 bits over ±125 to ±2000 °/s (InvenSense, Bosch), ST's mdps per digit, Analog Devices.
const KNOWN_STEPS_DEG_S: [f64; 16] = [
    125.0 / 32768.0,
    1.0 / 131.0,
    1.0 / 65.5,
    1.0 / 32.8,
    1.0 / 16.4,
    0.004_375,
    0.008_75,
    0.0175,
    0.035,
    0.07,
    0.14,
    0.05,
    0.025,
    0.02,
    0.0125,
    0.006_25,
];
const STEP_TOLERANCE: f64 = 2e-3;

/// Statistics of a column at rest, in the file's unit, from which the unit is guessed or doubted.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Evidence {
    pub samples: usize,
    pub median: f64,
    pub density_low: f64,
    pub density_high: f64,
    pub lattice: Option<f64>,
}

impl Evidence {
    /// Reads `values` (finite, in time order, `step_s` apart).
    pub(crate) fn of(values: &[f64], step_s: f64) -> Self {
        let (lattice, (noise_std, (allan, median))) = rayon::join(
            || quantization::step(values),
            || (noise_std(values), (allan_density(values, step_s), median(&mut values.to_vec()))),
        );
        let noise_std = noise_std.max(lattice.unwrap_or(0.0) / 12f64.sqrt());
        let allan = allan.unwrap_or(noise_std * step_s.sqrt());
        Self {
            samples: values.len(),
            median,
            density_low: (noise_std * step_s.min(SLOWEST_BANDWIDTH_S).sqrt()).min(allan),
            density_high: (noise_std * step_s.sqrt()).max(allan),
            lattice,
        }
    }

    fn on_known_step(&self, unit: RateUnit) -> Option<f64> {
        let q = self.lattice? * unit.to_rad_s() / RAD_S_PER_DEG_S;
        KNOWN_STEPS_DEG_S.into_iter().find(|known| (q / known - 1.0).abs() < STEP_TOLERANCE)
    }

    fn rest_rate_doubt(&self, unit: RateUnit) -> Option<String> {
        let rest = self.median * unit.to_rad_s();
        (rest.abs() > LARGEST_REST_RATE).then(|| {
            format!(
                "the median rate is {:.4} {unit} = {:.1} deg/s, too much for a gyro at rest",
                self.median,
                rest / RAD_S_PER_DEG_S
            )
        })
    }

    fn noisy_doubt(&self, unit: RateUnit) -> Option<String> {
        let density = self.density_low * unit.to_rad_s();
        (self.samples >= FEWEST && density > NOISIEST).then(|| {
            format!(
                "as {unit} its noise density is {:.2} deg/s/√Hz, more than any MEMS gyro's (0.0025 to 0.1)",
                density / RAD_S_PER_DEG_S
            )
        })
    }

    fn quiet_doubt(&self, unit: RateUnit) -> Option<String> {
        let density = self.density_high * unit.to_rad_s();
        (self.samples >= FEWEST && density < QUIETEST).then(|| {
            format!(
                "as {unit} its noise density is {:.1e} deg/s/√Hz, less than any MEMS gyro's (0.0025 to 0.1)",
                density / RAD_S_PER_DEG_S
            )
        })
    }

    /// Why the named unit looks wrong.
    fn doubt(&self, unit: RateUnit) -> Option<String> {
        if let Some(doubt) = self.rest_rate_doubt(unit) {
            return Some(doubt);
        }
        let (other, leans, noise) = match unit {
            RateUnit::RadPerS => {
                (RateUnit::DegPerS, self.density_low * unit.to_rad_s() > NOISY, self.noisy_doubt(unit))
            }
            RateUnit::DegPerS => {
                (RateUnit::RadPerS, self.density_high * unit.to_rad_s() < QUIET, self.quiet_doubt(unit))
            }
            _ => return None,
        };
        match (self.on_known_step(unit), self.on_known_step(other)) {
            (Some(_), _) => None,
            (None, Some(known)) if leans && self.samples >= FEWEST => Some(format!(
                "its values are {:.4e} apart, which is {known:.5} deg/s, a common gyro's step, only if they are {other}",
                self.lattice.unwrap_or_default()
            )),
            _ => noise,
        }
    }
}

/// Noise of one sample by first differences in blocks: the lower quartile of the blocks is at rest in any log that rests
/// for a good part of its time.
pub(crate) fn noise_std(values: &[f64]) -> f64 {
    const BLOCK: usize = 50;
    let rms = |block: &[f64]| {
        let sum: f64 = block.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum();
        (sum / (2 * (block.len() - 1)) as f64).sqrt()
    };
    if values.len() < 8 * BLOCK {
        let mut differences: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).collect();
        let centre = median(&mut differences);
        return mad_std(&mut differences, centre) / std::f64::consts::SQRT_2;
    }
    let mut blocks: Vec<f64> = values.chunks_exact(BLOCK).map(rms).collect();
    // of normal noise the block's figure scatters by √(3/n)/2 (von Neumann 1941), its lower quartile is 0.674 of that low
    quantile(&mut blocks, 0.25) / (1.0 - 0.674 * 0.5 * (3.0 / (BLOCK - 1) as f64).sqrt())
}

/// Allan deviation at about 1 s times the root of that time; `None` if the log is shorter than 16 such times.
fn allan_density(values: &[f64], step_s: f64) -> Option<f64> {
    let m = (1.0 / step_s).round().clamp(1.0, 1e9) as usize;
    let means: Vec<f64> = values.chunks_exact(m).map(|c| c.iter().sum::<f64>() / m as f64).collect();
    if means.len() < 16 {
        return None;
    }
    let mut differences: Vec<f64> = means.windows(2).map(|w| w[1] - w[0]).collect();
    let centre = median(&mut differences);
    Some(mad_std(&mut differences, centre) / std::f64::consts::SQRT_2 * (m as f64 * step_s).sqrt())
}

/// A unit and how it was come by.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Decision {
    pub unit: RateUnit,
    pub guessed: bool,
    pub note: Option<String>,
}

/// Decides on the unit, or says what speaks against deciding.
pub(crate) fn decide(
    stated: Option<RateUnit>,
    named: Option<RateUnit>,
    evidence: &Evidence,
) -> std::result::Result<Decision, String> {
    if let Some(unit) = stated {
        let note =
            named.filter(|n| *n != unit).map(|n| format!("the column says {n}; it is read as {unit}, as --unit asks"));
        return Ok(Decision { unit, guessed: false, note });
    }
    if let Some(unit) = named {
        return match evidence.doubt(unit) {
            None => Ok(Decision { unit, guessed: false, note: None }),
            Some(doubt) => Err(format!("is named {unit}, but {doubt}")),
        };
    }
    guess(evidence)
}

fn guess(evidence: &Evidence) -> std::result::Result<Decision, String> {
    let units = [RateUnit::RadPerS, RateUnit::DegPerS];
    let known: Vec<_> = units.iter().filter_map(|&u| evidence.on_known_step(u).map(|q| (u, q))).collect();
    if let [(unit, q)] = known[..]
        && evidence.rest_rate_doubt(unit).is_none()
    {
        let note = format!("unit guessed: {unit}, because its step is then {q:.5} deg/s, that of a common gyro");
        return Ok(Decision { unit, guessed: true, note: Some(note) });
    }
    let doubts = units.map(|u| evidence.rest_rate_doubt(u).or(evidence.noisy_doubt(u)).or(evidence.quiet_doubt(u)));
    match (&doubts[0], &doubts[1]) {
        (None, Some(why)) | (Some(why), None) => {
            let unit = if doubts[0].is_none() { units[0] } else { units[1] };
            Ok(Decision { unit, guessed: true, note: Some(format!("unit guessed: {unit}, because {why}")) })
        }
        (None, None) => Err("names no unit, and its numbers would do for rad/s as well as for deg/s".to_string()),
        (Some(a), Some(b)) => {
            Err(format!("names no unit, and its numbers are neither rad/s nor deg/s (raw counts?): {a}; {b}"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    /// White noise of density `n` (σ = n/√Ts) around `bias`, in rad/s.
    fn log(seed: u64, n: f64, bias: f64, step_s: f64, samples: usize) -> Vec<f64> {
        let mut s = Stream::new(seed, 0);
        (0..samples).map(|_| bias + n / step_s.sqrt() * s.normal()).collect()
    }

    fn in_unit(values: &[f64], unit: RateUnit) -> Vec<f64> {
        values.iter().map(|x| x / unit.to_rad_s()).collect()
    }

    #[test]
    fn simulated_logs_in_rad_s_are_never_doubted() {
        let mut seed = 0;
        for n in [1e-5, 1e-4, 5e-4, 1e-3] {
            for step_s in [0.001, 0.01, 0.1, 1.0] {
                for bias in [-0.02, 0.0, 0.02] {
                    seed += 1;
                    let evidence = Evidence::of(&log(seed, n, bias, step_s, 5000), step_s);
                    let decision = decide(None, Some(RateUnit::RadPerS), &evidence);
                    assert!(decision.is_ok(), "{n} {step_s} {bias}: {decision:?}");
                }
            }
        }
    }

    #[test]
    fn mislabelled_logs_of_common_parts_are_asked_about() {
        // 0.005, 0.01, 0.02 °/s/√Hz
        for density_deg in [0.005, 0.01, 0.02] {
            for step_s in [0.002, 0.01, 0.02] {
                let rad = log(7, density_deg * RAD_S_PER_DEG_S, 0.003, step_s, 20_000);
                let deg = in_unit(&rad, RateUnit::DegPerS);
                let (of_rad, of_deg) = (Evidence::of(&rad, step_s), Evidence::of(&deg, step_s));
                assert!(decide(None, Some(RateUnit::RadPerS), &of_rad).is_ok());
                assert!(decide(None, Some(RateUnit::DegPerS), &of_deg).is_ok());
                assert!(decide(None, Some(RateUnit::DegPerS), &of_rad).is_err(), "{density_deg} {step_s}");
                assert!(decide(None, Some(RateUnit::RadPerS), &of_deg).is_err(), "{density_deg} {step_s}");
                // what the user says is not doubted
                assert!(decide(Some(RateUnit::RadPerS), Some(RateUnit::DegPerS), &of_rad).is_ok());
                // and without a name the guess is right
                assert_eq!(decide(None, None, &of_rad).unwrap().unit, RateUnit::RadPerS);
                assert_eq!(decide(None, None, &of_deg).unwrap().unit, RateUnit::DegPerS);
            }
        }
    }

    #[test]
    fn a_known_step_decides_where_noise_is_in_between() {
        // 0.05 °/s/√Hz on ST's 0.0175 °/s: its numbers in rad/s would do for a quiet part in °/s
        let deg = in_unit(&log(9, 0.05 * RAD_S_PER_DEG_S, 0.003, 0.01, 20_000), RateUnit::DegPerS);
        let deg: Vec<f64> = deg.iter().map(|x| (x / 0.0175).round() * 0.0175).collect();
        let rad: Vec<f64> = deg.iter().map(|x| x * RAD_S_PER_DEG_S).collect();
        let of_rad = Evidence::of(&rad, 0.01);
        let question = decide(None, Some(RateUnit::DegPerS), &of_rad).unwrap_err();
        assert!(question.contains("0.01750 deg/s"), "{question}");
        assert!(decide(None, Some(RateUnit::RadPerS), &of_rad).is_ok());
        assert_eq!(decide(None, None, &of_rad).unwrap().unit, RateUnit::RadPerS);
        assert_eq!(decide(None, None, &Evidence::of(&deg, 0.01)).unwrap().unit, RateUnit::DegPerS);
    }

    #[test]
    fn a_large_rest_rate_is_asked_about_in_any_unit() {
        let fast = Evidence::of(&log(3, 1e-4, 0.6, 0.01, 1000), 0.01);
        assert!(decide(None, Some(RateUnit::RadPerS), &fast).unwrap_err().contains("34.4 deg/s"));
        assert!(decide(Some(RateUnit::RadPerS), None, &fast).is_ok());
    }

    #[test]
    fn raw_counts_are_not_guessed_at() {
        let counts: Vec<f64> = log(4, 0.7, 120.0, 0.01, 5000).iter().map(|x| x.round()).collect();
        assert!(decide(None, None, &Evidence::of(&counts, 0.01)).unwrap_err().contains("raw counts"));
    }
}
