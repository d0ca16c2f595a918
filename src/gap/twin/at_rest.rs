//! The twin of a simulated gyro at rest: its warm-up and white noise by [`crate::identify`], and what the diagnosis names beside them.

use super::told::{Parameter, Provenance, Twin, TwinEffect};
use crate::config::{Config, CustomEffect, Gyro, Kind};
use crate::effects::Library;
use crate::error::{Error, ErrorKind, Result};
use crate::gap::answer::Verdict;
use crate::gap::diagnose::diagnose_observed;
use crate::gap::diagnosis::{Options, Stage};
use crate::identify::{Fit, FitOptions, fit};
use crate::math::random_effects::{Observed, spread};
use crate::signal::{Log, names};
use std::collections::BTreeMap;

/// Shortest log of a simulator, s.
const SHORTEST_S: f64 = 1.0;
/// Time constant of a gyro that does not warm up, s: it moves nothing.
const UNMOVED_S: f64 = 200.0;

/// Identifies the twin of the simulator of a gyro at rest that made `runs`. What varies between power-ons is taken from `init` where
/// there is one run.
///
/// # Errors
/// [`ErrorKind::TooShort`] for a log shorter than a second, and as [`crate::identify::fit`] and [`crate::gap::diagnose()`].
pub fn twin_at_rest(
    init: Option<&Config>,
    runs: &[&Log],
    library: &Library,
    options: &Options,
    observe: &mut dyn FnMut(Stage),
) -> Result<Twin> {
    observe(Stage::Prepare);
    let fits = runs.iter().map(|log| fitted(log)).collect::<Result<Vec<_>>>()?;
    let Some((first, log)) = fits.first().zip(runs.first()) else {
        return Err(Error::new(ErrorKind::TooShort, "simulator", "no log"));
    };
    let warms = first.identifiable && first.warm_up_found();
    let constants: Vec<Observed<1>> = fits.iter().zip(runs).map(|(f, log)| constant(f, log, warms)).collect();
    let told = spread(&constants);
    let given = init.and_then(|c| c.gyro.as_ref());
    let c2 = told.map_or(constants[0].value[0], |t| t.mean[0]);
    let c2_std = told.map_or(constants[0].covariance[0], |t| t.mean_covariance[0]).sqrt();
    let model = first.model();
    let gyro = Gyro {
        c1_rad_s: if warms { model.c1_rad_s } else { 0.0 },
        c2_rad_s: c2,
        angle_random_walk_rad_sqrt_s: first.noise.angle_random_walk_rad_sqrt_s,
        turn_on_bias_std_rad_s: told.map(|t| t.std).or(given.and_then(|g| g.turn_on_bias_std_rad_s)),
        warm_up_relative_std: given.and_then(|g| g.warm_up_relative_std),
        ..Gyro::without_error(if warms { model.time_constant_s } else { UNMOVED_S })
    };
    let mut parameters = BTreeMap::new();
    let mut tell = |name: &str, parameter: Parameter| parameters.insert(name.to_string(), parameter);
    tell("gyro_c2_rad_s", Parameter::told(c2, c2_std, "rad/s"));
    if warms {
        tell("gyro_c1_rad_s", Parameter::told(gyro.c1_rad_s, first.c1_rad_s.std, "rad/s"));
        let mut constant = Parameter::told(gyro.time_constant_s, first.time_constant_s.std, "s");
        constant.ci95 = Some(first.time_constant_s.ci95);
        tell("gyro_time_constant_s", constant);
    }
    let density_std_ln = (0.5 / first.samples.max(1) as f64).sqrt();
    let density = gyro.angle_random_walk_rad_sqrt_s;
    tell("gyro_angle_random_walk_rad_sqrt_s", Parameter::positive(density, density_std_ln, "rad/sqrt(s)"));
    if let Some(std) = gyro.turn_on_bias_std_rad_s {
        let source = if told.is_some() { Provenance::Log } else { Provenance::Given };
        tell("gyro_turn_on_bias_std_rad_s", Parameter::kept(std, "rad/s", source));
    }
    let config = Config {
        schema: crate::config::SCHEMA,
        kind: Kind::Stationary,
        sample_time_s: Some(1.0 / first.sample_rate_hz),
        gyro: Some(gyro),
        vehicle: None,
        traction: None,
        encoder: None,
        pose: None,
        effects: Vec::new(),
        custom_effects: init.map(of_gyro).unwrap_or_default(),
        validation: None,
        provenance: None,
    };
    observe(Stage::Compare);
    let diagnosis = diagnose_observed(&config, log, None, library, options, &mut |_| {})?;
    let account = diagnosis.answer;
    let held = |id: &str| diagnosis.augmented.effects.iter().any(|e| e.id == id);
    let effects = account.together.iter().filter_map(|id| account.effects.iter().find(|e| e.id == *id));
    let effects: Vec<TwinEffect> = effects
        .map(|e| TwinEffect {
            id: e.id.clone(),
            parameters: e.parameters.clone(),
            std: e.std.clone(),
            in_twin: held(&e.id),
        })
        .collect();
    let mut notes = account.notes.clone();
    if runs.len() == 1 {
        notes.push("One run of the simulator does not tell how its bias varies from run to run.".into());
    }
    let forms = account.free_forms.iter().filter(|f| f.probability > 0.5).map(|f| f.id.clone()).collect();
    Ok(Twin {
        parameters,
        channels: Vec::new(),
        horizons: account.gap.iter().filter(|m| m.metric.contains("rms")).cloned().collect(),
        effects,
        left: Some(if account.verdict == Verdict::Identified { Verdict::None } else { account.verdict }),
        remainder: account.remainder.clone().filter(|_| account.verdict == Verdict::Unknown),
        free_forms: forms,
        runs: runs.len(),
        notes,
        config: diagnosis.augmented,
        account: Some(account),
        fitting: None,
    })
}

/// Effects of the user's own that act on a gyro at rest.
fn of_gyro(config: &Config) -> Vec<CustomEffect> {
    config.custom_effects.iter().filter(|e| !e.acts_on.is_of_drives()).cloned().collect()
}

fn fitted(log: &Log) -> Result<Fit> {
    let span_s = log.time.span_s();
    if span_s < SHORTEST_S {
        return Err(Error::new(ErrorKind::TooShort, &log.source, format!("{span_s:.2} s of a simulator"))
            .hint("log a second at least; minutes tell the noise, an hour what drifts"));
    }
    let named = |e: Error| if e.input == "log" { e.named(&log.source) } else { e };
    fit(&log.time, log.require(names::GYRO_Z)?, &FitOptions::default()).map_err(named)
}

/// C2 of one run; without a warm-up the mean.
fn constant(fit: &Fit, log: &Log, warms: bool) -> Observed<1> {
    if warms {
        return Observed::number(fit.c2_rad_s.estimate, fit.c2_rad_s.std);
    }
    let there: Vec<f64> =
        log.get(names::GYRO_Z).unwrap_or_default().iter().copied().filter(|v| v.is_finite()).collect();
    let n = there.len().max(1) as f64;
    let mean = there.iter().sum::<f64>() / n;
    let variance = there.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
    Observed::number(mean, (variance / n).sqrt())
}
