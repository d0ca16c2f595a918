//! z(x) = (d_recorded(x) - mean d_simulated(x)) / std d_simulated(x), for d over time, frequency, amplitude and
//! conditions
//!
//! Where the gap lies. The recording and 39 recordings of a simulator are measured alike: block means, spectrum, Allan
//! deviation, amplitudes, and means and noise levels by temperature, its rate, supply and time since power-on. The
//! range of 39 simulated values is an exact 95 % prediction interval for the recorded one, whatever its distribution: 2
//! in 40.
//!
//! The stated repeatability of the warm-up is first taken out of all of them (C2, C1 and T, linear, at most three
//! stated standard deviations each). Otherwise the bands of slow curves would be as wide as the turn-on bias varies.
//!
//! Outliers count in the curve of the amplitudes alone. From the other curves, samples beyond six robust standard
//! deviations from the median of their neighbours are removed.
//!
//! An effect shows in several curves: a tone in the spectrum and in the Allan deviation. The shares are weights,
//! largest where the effect stands out most; they do not partition the gap.

mod axes;
mod calm;
mod compare;
mod condition;
mod measure;
mod repeatability;
#[cfg(test)]
mod tests;

use super::prepare::Prepared;
use super::state_space::StateSpaceModel;
use super::state_space::of_effects::believed;
use crate::config::EffectTable;
use crate::effects::Library;
use crate::error::{Error, ErrorKind, Result};
use crate::model::Scene;
use measure::Instrument;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Recordings simulated for each band: a 40th lies outside their range with a probability of 2/40.
const LOGS: usize = 39;
/// Fewest samples for bands.
const FEWEST_ROWS: usize = 64;
/// First random stream of these simulations; others of the diagnosis use small numbers.
const STREAMS: u64 = 1 << 32;

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

/// `curves` of a prepared log; `effects`: those of the nominal simulator, and those of the augmented one.
///
/// # Errors
/// As `curves` and `believed`.
pub fn of_prepared(
    prepared: &Prepared,
    effects: [&[EffectTable]; 2],
    library: &Library,
    seed: u64,
) -> Result<Vec<Curve>> {
    let simulator = |effects: &[EffectTable]| {
        let effects: Vec<_> = effects.iter().map(|e| (e.id.clone(), e.parameters.clone())).collect();
        believed(&prepared.scene, library, &effects)
    };
    let [before, after] = effects.map(simulator);
    curves(&prepared.scene, &prepared.recorded_rad_s(), &before?, &after?, seed)
}

/// Compares a recording with recordings simulated by `before` (the nominal simulator) and `after` (the augmented one).
/// Missing samples of the recording are NaN. Curves over conditions that were not logged, or did not vary, are left
/// out.
///
/// # Errors
/// [`ErrorKind::TooShort`] for fewer than 64 samples; [`ErrorKind::Value`] if lengths differ, and as
/// [`StateSpaceModel::check`].
pub(crate) fn curves(
    scene: &Scene,
    recorded_rad_s: &[f64],
    before: &StateSpaceModel,
    after: &StateSpaceModel,
    seed: u64,
) -> Result<Vec<Curve>> {
    for (place, rows) in [("recording", recorded_rad_s.len()), ("before", before.rows), ("after", after.rows)] {
        if rows != scene.len() {
            let found = format!("{rows} rows for the {} of the scene", scene.len());
            return Err(Error::new(ErrorKind::Value, "log", found).at(place));
        }
    }
    let samples = recorded_rad_s.iter().filter(|v| v.is_finite()).count();
    if samples < FEWEST_ROWS {
        let found = format!("{samples} samples");
        return Err(Error::new(ErrorKind::TooShort, "log", found).hint(format!("record at least {FEWEST_ROWS}")));
    }
    let instrument = Instrument::new(scene, recorded_rad_s);
    let recorded = instrument.read(recorded_rad_s);
    let simulated = |believed: &StateSpaceModel| -> Result<Vec<Vec<Vec<f64>>>> {
        (0..LOGS as u64)
            .into_par_iter()
            .map(|log| {
                let mut y = believed.simulate(seed, STREAMS + log)?;
                let gaps = y.iter_mut().zip(recorded_rad_s).filter(|(_, r)| !r.is_finite());
                gaps.for_each(|(y, _)| *y = f64::NAN);
                Ok(instrument.read(&y))
            })
            .collect()
    };
    let nominal = simulated(before)?;
    // both simulators are the same where nothing was found
    let augmented = if after == before { None } else { Some(simulated(after)?) };
    let mut curves: Vec<Curve> = instrument
        .recipes
        .iter()
        .enumerate()
        .map(|(i, recipe)| {
            let of = |logs: &[Vec<Vec<f64>>]| logs.iter().map(|log| log[i].clone()).collect::<Vec<_>>();
            let nominal = of(&nominal);
            let augmented = augmented.as_ref().map(|logs| of(logs));
            compare::curve(recipe, &recorded[i], &nominal, augmented.as_deref().unwrap_or(&nominal))
        })
        .collect();
    let total: f64 = curves.iter().map(|c| c.excess_before).sum();
    if total > 0.0 {
        curves.iter_mut().for_each(|c| c.share = c.excess_before / total);
    }
    Ok(curves)
}
