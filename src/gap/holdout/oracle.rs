//! gain = (ln p(hold | effects, fitted to fit) - ln p(hold | nominal)) / rows
//!
//! Gain of an oracle: it is told which effects are at work, and only fits their parameters. Answers are compared with
//! it.

use crate::config::{Config, Kind};
use crate::effects::{Library, Parameters};
use crate::error::Result;
use crate::gap::drive;
use crate::gap::rest::explain::explain;
use crate::gap::rest::prepare::prepare;
use crate::gap::rest::state_space::StateSpaceModel;
use crate::gap::rest::state_space::of_effects::believed;
use crate::signal::Log;

/// Gain of the effects `ids`, fitted to `fit`, on `hold` over the nominal simulator, in nats a row, the unit of the
/// answer's `log_score`.
///
/// # Errors
/// As [`crate::gap::explain`]; as `prepare` of `hold`.
pub(crate) fn known_gain(config: &Config, fit: &Log, hold: &Log, library: &Library, ids: &[&str]) -> Result<f64> {
    if config.kind == Kind::Driving {
        return drive::known_gain(config, fit, hold, library, ids);
    }
    let value = |(name, e): (String, crate::gap::rest::explain::Estimate)| (name, e.estimate);
    let found: Vec<(String, Parameters)> = explain(config, fit, library, ids, 0.0)?
        .effects
        .into_iter()
        .map(|e| (e.id, e.parameters.into_iter().map(value).collect()))
        .collect();
    let kept = prepare(config, hold, 0.0)?;
    let recorded = kept.recorded_rad_s();
    let rows = recorded.iter().filter(|y| y.is_finite()).count();
    let total = |b: &StateSpaceModel| -> Result<f64> { Ok(b.score(&recorded)?.total()) };
    let augmented = believed(&kept.scene, library, &found)?;
    Ok((total(&augmented)? - total(&StateSpaceModel::nominal(&kept.scene))?) / rows.max(1) as f64)
}
