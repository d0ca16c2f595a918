//! What the navigation filter gains on a recording kept back when it gets the model with what was found.

use crate::config::Config;
use crate::error::Result;
use crate::gap::answer::{FilterFigures, FilterGain};
use crate::model::EffectSource;
use crate::navigate::{Settings, run_with};
use crate::signal::{Log, names};

/// Runs the filter over `kept`, nominal and augmented, from its first pose on; the pose is only compared with.
///
/// `None` where nothing can be told: no effects were found, `kept` has no pose, or the nominal filter cannot run (its tables
/// are missing).
///
/// # Errors
/// Why the augmented filter cannot run.
pub fn filter_gain(
    nominal: &Config,
    augmented: &Config,
    kept: &Log,
    since_power_on_s: f64,
    effects: &dyn EffectSource,
) -> Option<Result<FilterGain>> {
    let has = |name: &str| kept.get(name).is_some_and(|values| values.iter().any(|v| v.is_finite()));
    if augmented.effects.len() == nominal.effects.len() || !has(names::X) || !has(names::Y) {
        return None;
    }
    let settings = Settings { since_power_on_s, start_at_reference: has(names::HEADING), ..Settings::default() };
    let before = run_with(nominal, kept, &settings, effects).ok()?.summary;
    let before = FilterFigures::of(&before)?;
    match run_with(augmented, kept, &settings, effects) {
        Err(error) => Some(Err(error)),
        Ok(run) => Some(Ok(FilterGain { before, after: FilterFigures::of(&run.summary)? })),
    }
}
