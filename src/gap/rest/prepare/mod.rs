//! A log prepared for the diagnosis: even rows without gaps, covariates, and the scene that the configuration
//! describes.

pub(crate) mod flatten;
pub(crate) mod given;
pub(crate) mod outliers;
use super::nongaussian::quantization;
use crate::config::{Config, Kind};
use crate::error::{Error, ErrorKind, Result};
use crate::math::robust::mad_std;
use crate::model::Scene;
use crate::signal::slots::fill;
use crate::signal::{Log, TimeAxis, names};
use crate::simulate::{self, scene};

/// A recording on an even grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Prepared {
    /// Times, covariates and nominal parameters.
    pub scene: Scene,
    /// Gyro readings, rad/s; rows that were missing are filled.
    pub rate_rad_s: Vec<f64>,
    /// Indices of the rows that were filled.
    pub filled: Vec<usize>,
    /// Changes and assumptions, in sentences.
    pub notes: Vec<String>,
}

impl Prepared {
    /// Gyro readings with NaN where none was recorded, rad/s: for likelihoods that skip missing readings.
    #[must_use]
    pub(crate) fn recorded_rad_s(&self) -> Vec<f64> {
        let mut rate = self.rate_rad_s.clone();
        self.filled.iter().for_each(|row| rate[*row] = f64::NAN);
        rate
    }
}

/// Assumed standard deviation of C2, rad/s, where the configuration states none: data sheets of cheap gyros say 0.1 to
/// 1 °/s.
const TURN_ON_STD_RAD_S: f64 = 5e-3;
/// Assumed relative standard deviation of C1 and T, where the configuration states none.
const WARM_UP_STD: f64 = 0.1;
/// Rows on each side of a gap whose mean fills it.
const NEIGHBOURS: usize = 16;
/// Fewest rows that can be diagnosed.
const FEWEST_ROWS: usize = 512;
/// Largest share of the rows that may be missing.
const MISSING: f64 = 0.2;

/// Puts a log on an even grid and fills its gaps.
///
/// # Errors
/// [`ErrorKind::Config`] if the configuration is not of a gyro at rest; [`ErrorKind::Column`] without a gyro channel;
/// [`ErrorKind::TooShort`] below 512 rows; [`ErrorKind::Time`] if more than a fifth of the rows is missing.
pub(crate) fn prepare(config: &Config, log: &Log, since_power_on_s: f64) -> Result<Prepared> {
    if config.kind != Kind::Stationary {
        return Err(Error::new(ErrorKind::Config, "configuration", "kind is \"driving\"")
            .at("`kind`")
            .hint("a recording at rest is judged by the configuration of the gyro, kind = \"stationary\""));
    }
    if !config.effects.is_empty() {
        return Err(Error::new(ErrorKind::Config, "configuration", "the nominal simulator holds effects already")
            .at("`[[effect]]`")
            .hint("delete these tables: the diagnosis finds what they hold"));
    }
    let rate = log.get(names::GYRO_Z).ok_or_else(|| {
        Error::new(ErrorKind::Column, &log.source, format!("no channel {}", names::GYRO_Z))
            .hint("name the gyro's column with --column, or its axis with --axis")
    })?;
    if log.len() < FEWEST_ROWS {
        let found = format!("{} rows", log.len());
        return Err(Error::new(ErrorKind::TooShort, &log.source, found)
            .hint(format!("a recording needs at least {FEWEST_ROWS} rows to be judged")));
    }
    let options = simulate::Options { since_power_on_s, ..simulate::Options::from(0) };
    let mut scene = scene(config, log, &options)?;
    let mut notes = Vec::new();
    let gyro = config.require_gyro()?;
    if gyro.turn_on_bias_std_rad_s.is_none() {
        scene.turn_on_bias_std_rad_s = TURN_ON_STD_RAD_S;
        notes.push(format!(
            "The configuration does not state turn_on_bias_std_rad_s: {TURN_ON_STD_RAD_S} rad/s is assumed, so that a shift \
             inside it does not count as a gap."
        ));
    }
    if gyro.warm_up_relative_std.is_none() {
        scene.warm_up_relative_std = WARM_UP_STD;
        notes.push(format!("The configuration does not state warm_up_relative_std: {WARM_UP_STD} is assumed."));
    }
    let (mut rate_rad_s, rows) = even(log, rate, &mut scene)?;
    if !rows.is_empty() {
        let (filled, all) = (rows.len(), rate_rad_s.len());
        notes.push(format!("{filled} of {all} rows are missing and were filled by noise about their neighbours."));
    }
    fill(&mut rate_rad_s, &rows, scene.white_std_rad_s, |_| NEIGHBOURS);
    on_lattice(&mut rate_rad_s, rate, &rows);
    notes.extend(crate::gap::rest::prepare::flatten::flatten(gyro.noise.as_ref(), &scene, &mut rate_rad_s));
    if let Some(note) = in_degrees(&rate_rad_s, scene.white_std_rad_s) {
        notes.push(note);
    }
    if scene.span_s() < scene.warm_up.time_constant_s {
        notes.push(format!(
            "The recording lasts {:.0} s, less than one time constant ({:.0} s): slow effects and the warm-up cannot be \
             told apart, and little is learned of either.",
            scene.span_s(),
            scene.warm_up.time_constant_s
        ));
    }
    for (name, there) in [("temperature", scene.temperature_c.is_some()), ("supply", scene.supply_v.is_some())] {
        if !there {
            notes.push(format!("No {name} was logged: what follows it cannot be told from what follows time."));
        }
    }
    Ok(Prepared { scene, rate_rad_s, filled: rows, notes })
}

/// Puts the rows on an even grid; returns the rates (NaN where there is none) and the indices of missing rows.
fn even(log: &Log, rate: &[f64], scene: &mut Scene) -> Result<(Vec<f64>, Vec<usize>)> {
    let missing = |v: &[f64]| (0..v.len()).filter(|i| !v[*i].is_finite()).collect::<Vec<_>>();
    if let TimeAxis::Uniform { .. } = scene.time {
        let rows = missing(rate);
        refuse_gaps(log, rows.len(), rate.len())?;
        return Ok((rate.to_vec(), rows));
    }
    let times = scene.time.to_vec();
    let (start_s, step_s) = (times[0], scene.step_s);
    let len = ((times[times.len() - 1] - start_s) / step_s).round() as usize + 1;
    refuse_gaps(log, len.saturating_sub(times.len()), len)?;
    let place = |values: &[f64]| {
        let mut out = vec![f64::NAN; len];
        for (t, v) in times.iter().zip(values) {
            let row = ((t - start_s) / step_s).round() as usize;
            if row < len {
                out[row] = *v;
            }
        }
        out
    };
    let rates = place(rate);
    let rows = missing(&rates);
    refuse_gaps(log, rows.len(), len)?;
    let covariate = |values: &Option<Vec<f64>>| {
        values.as_ref().map(|v| {
            let mut out = place(v);
            let gaps = missing(&out);
            fill(&mut out, &gaps, 0.0, |_| NEIGHBOURS);
            out
        })
    };
    scene.temperature_c = covariate(&scene.temperature_c);
    scene.supply_v = covariate(&scene.supply_v);
    scene.time = TimeAxis::Uniform { start_s, step_s, len };
    Ok((rates, rows))
}

/// Rounds filled rows to the quantization step of the recorded ones: a single value beside it would hide it.
fn on_lattice(values: &mut [f64], recorded: &[f64], rows: &[usize]) {
    let Some(origin) = recorded.iter().copied().find(|v| v.is_finite()).filter(|_| !rows.is_empty()) else { return };
    if let Some(lsb) = quantization::step(recorded) {
        rows.iter().for_each(|row| values[*row] = origin + ((values[*row] - origin) / lsb).round() * lsb);
    }
}

/// A note if the samples scatter by 180/π times the configured white noise, within 20 %: the unit may be °/s.
fn in_degrees(rate_rad_s: &[f64], white_std_rad_s: f64) -> Option<String> {
    let mut differences: Vec<f64> = rate_rad_s.windows(2).map(|w| w[1] - w[0]).collect();
    let ratio = mad_std(&mut differences, 0.0) / (std::f64::consts::SQRT_2 * white_std_rad_s);
    (ratio / 1.0_f64.to_degrees()).ln().abs().lt(&0.2).then(|| {
        format!(
            "The samples scatter {ratio:.0} times as much as the configuration says: are these degrees per second? Then state \
             the unit (--unit deg/s)."
        )
    })
}

fn refuse_gaps(log: &Log, missing: usize, len: usize) -> Result<()> {
    if missing as f64 > MISSING * len as f64 {
        let found = format!("{missing} of {len} rows are missing");
        return Err(Error::new(ErrorKind::Time, &log.source, found)
            .hint("cut the log to a part without long gaps; at most a fifth may be missing"));
    }
    Ok(())
}
