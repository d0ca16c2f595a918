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
mod curve;
mod measure;
mod repeatability;
#[cfg(test)]
mod tests;

pub use curve::{Curve, Over, Shown};

use super::prepare::Prepared;
use super::state_space::StateSpaceModel;
use super::state_space::of_effects::believed;
use crate::config::EffectTable;
use crate::effects::Library;
use crate::error::{Error, ErrorKind, Result};
use crate::model::Scene;
use measure::Instrument;
use rayon::prelude::*;

/// Recordings simulated for each band: a 40th lies outside their range with a probability of 2/40.
const LOGS: usize = 39;
/// Fewest samples for bands.
const FEWEST_ROWS: usize = 64;
/// First random stream of these simulations; others of the diagnosis use small numbers.
const STREAMS: u64 = 1 << 32;

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
