//! The fit of given effects to a recording, at rest or of a drive

use super::rest::explain::Explanations;
use super::{drive, rest};
use crate::config::{Config, Kind};
use crate::effects::Library;
use crate::error::Result;
use crate::signal::Log;

/// Fits the effects `ids` of `library`, and no others, to `log`, beside what `config` models: for a gyro at rest
/// warm-up and white noise, for a drive the robot and its sensors. The time of the first row since power-on is
/// `since_power_on_s` where the log's time counts from something else.
///
/// ```no_run
/// use gyroid::{config::Config, effects::{self, Library}, gap};
/// # fn main() -> gyroid::Result<()> {
/// # let log = gyroid::signal::Log::new("fit.csv", gyroid::signal::TimeAxis::Uniform { start_s: 0.0, step_s: 0.1, len: 0 });
/// let config = Config::read("sim.toml")?;
/// let tone = effects::registry().iter().map(|e| e.about()).find(|about| about.title == "tone").unwrap();
/// let fitted = gap::explain(&config, &log, &Library::new(), &[tone.id], 0.0)?;
/// let [low, high] = fitted.effects[0].parameters[tone.size()].ci95;
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// As `prepare`, of a drive as [`crate::gap::drive::record::Record::new`]; [`crate::ErrorKind::Usage`] if an id is unknown or
/// given twice, or there is none; [`crate::ErrorKind::Column`] if the log lacks the quantity that an effect is a function of.
pub fn explain(
    config: &Config,
    log: &Log,
    library: &Library,
    ids: &[&str],
    since_power_on_s: f64,
) -> Result<Explanations> {
    let fit = if config.kind == Kind::Driving { drive::explain } else { rest::explain::explain };
    fit(config, log, library, ids, since_power_on_s)
}
