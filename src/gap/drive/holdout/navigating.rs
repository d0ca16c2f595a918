//! Errors of the navigation filter on hold-out drives, with the nominal model and with the effects found.

use crate::config::Config;
use crate::error::Result;
use crate::gap::answer::{FilterFigures, FilterGain};
use crate::gap::diagnosis::Drive;
use crate::model::EffectSource;
use crate::navigate::{Settings, Summary, run_with};
use crate::signal::{Log, names};

/// Runs the filter over each of `kept`, nominal and augmented, from its first pose on, which is otherwise only compared
/// with.
///
/// `None` where there is nothing to compare: no effects were found, a drive has no pose, or the nominal filter cannot
/// run (its tables are missing).
///
/// # Errors
/// Errors of the augmented filter.
pub(crate) fn filter_gain(
    nominal: &Config,
    augmented: &Config,
    kept: &[Drive<'_>],
    effects: &dyn EffectSource,
) -> Option<Result<FilterGain>> {
    let has = |log: &Log, name: &str| log.get(name).is_some_and(|values| values.iter().any(|v| v.is_finite()));
    let tracked = |drive: &Drive<'_>| has(drive.log, names::X) && has(drive.log, names::Y);
    if augmented.effects.len() == nominal.effects.len() || kept.is_empty() || !kept.iter().all(tracked) {
        return None;
    }
    let runs = |config: &Config| -> Result<Vec<Summary>> {
        let one = |drive: &Drive<'_>| {
            let start_at_reference = has(drive.log, names::HEADING);
            let settings =
                Settings { since_power_on_s: drive.since_power_on_s, start_at_reference, ..Settings::default() };
            Ok(run_with(&config.carrying(drive.load_kg), drive.log, &settings, effects)?.summary)
        };
        kept.iter().map(one).collect()
    };
    let (before, after) = rayon::join(|| runs(nominal), || runs(augmented));
    let before = together(&before.ok()?)?;
    match after {
        Err(error) => Some(Err(error)),
        Ok(after) => Some(Ok(FilterGain { before, after: together(&after)? })),
    }
}

/// Figures over all drives: mean squares weighted by numbers of readings. The bounds of the mean NIS combine those of
/// the independent drives by root sum of squares.
fn together(drives: &[Summary]) -> Option<FilterFigures> {
    let each = drives.iter().map(FilterFigures::of).collect::<Option<Vec<_>>>()?;
    if let [one] = each[..] {
        return Some(one);
    }
    let samples = |s: &Summary| s.reference.as_ref().map_or(0.0, |r| r.samples as f64);
    let readings = |s: &Summary| s.consistency.readings as f64;
    let mean = |weight: &dyn Fn(&Summary) -> f64, value: &dyn Fn(&FilterFigures) -> Option<f64>| -> Option<f64> {
        let mut sums = [0.0; 2];
        for (summary, figures) in drives.iter().zip(&each) {
            sums = [sums[0] + weight(summary), sums[1] + weight(summary) * value(figures)?];
        }
        Some(sums[1] / sums[0])
    };
    let total: f64 = drives.iter().map(readings).sum();
    let away = |bound: usize| {
        let square = |(s, f): (&Summary, &FilterFigures)| (readings(s) * (f.nis_mean_bounds95[bound] - 1.0)).powi(2);
        drives.iter().zip(&each).map(square).sum::<f64>().sqrt() / total
    };
    Some(FilterFigures {
        position_rms_m: mean(&samples, &|f| Some(f.position_rms_m.powi(2)))?.sqrt(),
        heading_rms_rad: mean(&samples, &|f| Some(f.heading_rms_rad?.powi(2))).map(f64::sqrt),
        nis_mean: mean(&readings, &|f| Some(f.nis_mean))?,
        nis_mean_bounds95: [1.0 - away(0), 1.0 + away(1)],
    })
}
