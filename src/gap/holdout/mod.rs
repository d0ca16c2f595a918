//! gap closed = (before - after)/(before - floor)
//!
//! How far the gap shrinks on a hold-out recording. *Before* is the measure under the nominal simulator, *after* under
//! the augmented one, *floor* the score of the augmented simulator on its own recordings: no model of this noise does
//! better on average.
//!
//! | measure | is |
//! |---|---|
//! | `log_score` | mean log predictive density of a row, in nats (the total where `Options::whole_log`) |
//! | `heading_drift_rms_rad_{H}s` | heading error after H seconds at rest, the bias predicted from the rows before them |
//! | `allan_deviation_ln_rms` | distance of ln Allan deviation from the mean of simulated recordings, over octaves |
//! | `spectrum_ln_rms` | the same of the ln power spectrum, over half octaves |
//!
//! The last two are distances of curves: 0.1 is about 10 %. Their floor is the distance of the augmented simulator's
//! recordings from each other.

mod closed;
pub(crate) mod gate;
mod heading;
pub(crate) mod oracle;
pub(crate) mod replay;
#[cfg(test)]
mod replay_tests;
mod shape;
#[cfg(test)]
mod tests;

pub(crate) use closed::Closed;
pub(super) use closed::block_sums;
pub(crate) use closed::{Scores, block_rows, gap_closed};
pub(crate) use heading::{HeadingError, heading_horizons};
pub(crate) use shape::Band;

use super::answer::Metric;
use super::rest::state_space::StateSpaceModel;
use crate::error::{Error, ErrorKind, Result};
use crate::math::mean;
use crate::math::robust::mad_std;
use heading::heading_errors;
use rayon::prelude::*;
use shape::{Residuals, Shape};

/// Robust standard deviations beyond which a second difference is that of an outlier.
const FAR_OFF: f64 = 6.0;

/// Settings of the measurement.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Options {
    /// Seed of the simulated recordings and of the resampling.
    pub seed: u64,
    /// Recordings simulated for the floor, at least 2.
    pub simulated_logs: usize,
    /// Number of resamplings for an interval.
    pub draws: usize,
    /// Horizons of the heading drift, s.
    pub horizons_s: Vec<f64>,
    /// Whether the log score is that of the whole recording rather than of a row: for quantities that are drawn once in
    /// a recording, such as the turn-on bias. Gap and interval then come from pairs (see [`gap_closed`]).
    pub whole_log: bool,
    /// Whether gap and interval come from pairs whatever the floor is: where the simulator cannot know the motion, such
    /// as that of a robot whose torques were not logged.
    pub in_pairs: bool,
}

impl Default for Options {
    fn default() -> Self {
        let horizons_s = vec![1.0, 10.0, 60.0, 600.0];
        Self { seed: 1, simulated_logs: 12, draws: 2000, horizons_s, whole_log: false, in_pairs: false }
    }
}

/// One effect alone added to the nominal simulator.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Claim<'a> {
    /// Identifier of the effect.
    pub id: &'a str,
    /// Predictive model of the simulator with it, for the hold-out recording.
    pub believed: &'a StateSpaceModel,
}

/// The gap on the hold-out recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Far {
    /// The measures, `log_score` first.
    pub metrics: Vec<Metric>,
    /// Share closed by all effects found together.
    pub closed: Closed,
    /// Share closed by each effect alone, against the same floor.
    pub alone: Vec<(String, Closed)>,
    /// Standard error of the floor of `log_score`.
    pub floor_std_error: f64,
    /// Rows of a block of the resampling.
    pub block_rows: usize,
    /// Allan deviation, rad/s over s, with the range of the simulated recordings.
    pub allan_deviation: Vec<Band>,
    /// Power spectrum, two-sided, rad²/s over Hz, with the range of the simulated recordings.
    pub spectrum: Vec<Band>,
    /// Remarks on the measurement, in sentences.
    pub notes: Vec<String>,
}

/// Scores of one simulated recording of each simulator.
struct OwnLog {
    log_density: Vec<f64>,
    nominal_total: f64,
    heading: Vec<HeadingError>,
    white_variance: f64,
    augmented_shape: Shape,
    nominal_shape: Shape,
}

/// Measures the gap on `hold_rad_s` (missing readings are NaN) between `nominal` and reality, and the shares of it that
/// `augmented` and each effect of `alone` close.
///
/// # Errors
/// As [`StateSpaceModel::score`]; [`ErrorKind::TooShort`] for fewer than 64 readings; [`ErrorKind::Usage`] for fewer than two
/// simulated recordings.
pub(crate) fn measure(
    hold_rad_s: &[f64],
    nominal: &StateSpaceModel,
    augmented: &StateSpaceModel,
    alone: &[Claim<'_>],
    options: &Options,
) -> Result<Far> {
    let present = hold_rad_s.iter().filter(|y| y.is_finite()).count();
    if present < 64 {
        let found = format!("{present} readings");
        return Err(Error::new(ErrorKind::TooShort, "recording held out", found).hint("give at least 64"));
    }
    if options.simulated_logs < 2 {
        let found = format!("{} simulated recordings", options.simulated_logs);
        return Err(Error::new(ErrorKind::Usage, "floor", found).hint("simulate at least 2"));
    }
    let (horizons_s, horizons) = heading_horizons(hold_rad_s.len(), nominal.step_s, &options.horizons_s);
    let before = nominal.run(hold_rad_s, &horizons)?;
    let after = augmented.run(hold_rad_s, &horizons)?;
    let score = |claim: &Claim<'_>| Ok(claim.believed.score(hold_rad_s)?.log_density);
    let singles: Vec<Vec<f64>> = alone.par_iter().map(score).collect::<Result<_>>()?;
    let residuals = Residuals::new(hold_rad_s, nominal);

    let own: Vec<OwnLog> = (0..options.simulated_logs as u64)
        .into_par_iter()
        .map(|log| own_log(hold_rad_s, (nominal, augmented), &residuals, &horizons, (options.seed, log)))
        .collect::<Result<_>>()?;

    let block_rows = block_rows(&before.log_density, &after.log_density);
    let louder = white_variance(hold_rad_s) / mean(own.iter().map(|o| o.white_variance));
    let level_nats = if louder > 0.0 && louder.is_finite() { 0.5 * present as f64 * louder.ln() } else { 0.0 };
    let close = |log_density: &[f64]| {
        let scores = Scores {
            before: &before.log_density,
            after: log_density,
            floor: own.iter().map(|o| o.log_density.as_slice()).collect(),
            own_before: own.iter().map(|o| o.nominal_total).collect(),
            level_nats,
        };
        gap_closed(&scores, block_rows, options)
    };
    let closed = close(&after.log_density);
    let alone: Vec<(String, Closed)> =
        alone.iter().zip(&singles).map(|(claim, run)| (claim.id.to_string(), close(run))).collect();

    let unit = if options.whole_log { 1.0 } else { present as f64 };
    let totals: Vec<f64> = own.iter().map(|o| o.log_density.iter().sum::<f64>() / unit).collect();
    let floor = mean(totals.iter().copied());
    let scatter = totals.iter().map(|t| (t - floor).powi(2)).sum::<f64>() / (totals.len() - 1) as f64;
    let floor_std_error = (scatter / totals.len() as f64).sqrt();
    let mut metrics =
        vec![Metric { metric: "log_score".into(), before: before.total() / unit, after: after.total() / unit, floor }];
    let drift = [heading_errors(hold_rad_s, &before, &horizons, nominal.step_s), {
        heading_errors(hold_rad_s, &after, &horizons, nominal.step_s)
    }];
    for (at, horizon_s) in horizons_s.iter().enumerate() {
        metrics.push(Metric {
            metric: format!("heading_drift_rms_rad_{horizon_s}s"),
            before: drift[0][at].rms_rad,
            after: drift[1][at].rms_rad,
            floor: mean(own.iter().map(|o| o.heading[at].rms_rad.powi(2))).sqrt(),
        });
    }
    let hold = Shape::new(hold_rad_s, &residuals);
    let nominal_shapes: Vec<&Shape> = own.iter().map(|o| &o.nominal_shape).collect();
    let augmented_shapes: Vec<&Shape> = own.iter().map(|o| &o.augmented_shape).collect();
    metrics.extend(shape::metrics(&hold, &nominal_shapes, &augmented_shapes));
    let mut notes = vec![format!(
        "The floor is the mean over {} simulated recordings; its standard error in log score is {floor_std_error:.3e}.",
        own.len()
    )];
    if closed.estimate.is_none() {
        notes.push(
            "The augmented simulator expects no gain in log score worth the name: there is no share to close.".into(),
        );
    } else if closed.paired {
        notes.push(
            "The gap in log score is small against what chance in the white noise makes of a whole recording: the share closed \
             is the gain over the gain that the augmented simulator expects."
                .into(),
        );
    }
    let missing: Vec<String> =
        options.horizons_s.iter().filter(|h| !horizons_s.contains(h)).map(|h| format!("{h} s")).collect();
    if !missing.is_empty() {
        notes.push(format!("The recording is too short for a heading drift over {}.", missing.join(" and ")));
    }
    let bands = shape::bands(&hold, &nominal_shapes, &augmented_shapes);
    Ok(Far { metrics, closed, alone, floor_std_error, block_rows, allan_deviation: bands.0, spectrum: bands.1, notes })
}

/// Six times the variance of the white noise, from second differences without outliers; missing readings are NaN.
fn white_variance(readings: &[f64]) -> f64 {
    let bends: Vec<f64> =
        readings.windows(3).map(|w| w[0] - 2.0 * w[1] + w[2]).filter(|bend| bend.is_finite()).collect();
    let far = FAR_OFF * mad_std(&mut bends.clone(), 0.0);
    let near = || bends.iter().filter(|bend| bend.abs() <= far);
    near().map(|bend| bend * bend).sum::<f64>() / near().count() as f64
}

/// Simulates a recording of each simulator with the missing readings of the real one, and scores it.
fn own_log(
    hold_rad_s: &[f64],
    (nominal, augmented): (&StateSpaceModel, &StateSpaceModel),
    residuals: &Residuals,
    horizons: &[crate::gap::rest::state_space::Horizon],
    (seed, log): (u64, u64),
) -> Result<OwnLog> {
    let simulate = |believed: &StateSpaceModel, stream: u64| -> Result<Vec<f64>> {
        let mut y = believed.simulate(seed, stream)?;
        y.iter_mut().zip(hold_rad_s).filter(|(_, real)| !real.is_finite()).for_each(|(y, _)| *y = f64::NAN);
        Ok(y)
    };
    let y = simulate(augmented, 2 * log)?;
    let run = augmented.run(&y, horizons)?;
    Ok(OwnLog {
        heading: heading_errors(&y, &run, horizons, augmented.step_s),
        white_variance: white_variance(&y),
        log_density: run.log_density,
        nominal_total: nominal.score(&y)?.total(),
        augmented_shape: Shape::new(&y, residuals),
        nominal_shape: Shape::new(&simulate(nominal, 2 * log + 1)?, residuals),
    })
}
