//! The whole diagnosis: which effect, where it shows, how far the gap shrinks.

use super::answer::{Answer, Metric, Place, account, compose};
use super::diagnosis::{Diagnosis, Drive, Options, Stage};
use super::holdout;
use super::holdout::{Claim, Far};
use super::rest::model_selection::judge;
use super::rest::prepare::given::Given;
use super::rest::prepare::{Prepared, prepare};
use super::rest::state_space::of_effects::believed;
use super::rest::state_space::{StateSpaceModel, blocked_log_score};
use super::selection::findings::Findings;
use super::trace;
use crate::config::{Config, EffectTable, Kind};
use crate::effects::{Effect, Explanation, Library, Parameters};
use crate::error::Result;
use crate::signal::{Log, names};

/// Largest number of effects whose share of the gap is measured one by one.
const MEASURED: usize = 5;

/// Diagnoses `fit` against the nominal simulator `config`, and measures on `hold` how far the gap shrinks.
///
/// # Errors
/// As `prepare` for either log, of a drive as [`diagnose_drives`]; [`crate::ErrorKind::Config`] if the configuration
/// is incomplete; [`crate::ErrorKind::Numeric`] if the recording has no finite likelihood.
pub fn diagnose(
    config: &Config,
    fit: &Log,
    hold: Option<&Log>,
    library: &Library,
    options: &Options,
) -> Result<Diagnosis> {
    diagnose_observed(config, fit, hold, library, options, &mut |_| {})
}

/// As [`diagnose`]; `observe` is told each stage as it begins.
///
/// # Errors
/// As [`diagnose`].
pub fn diagnose_observed(
    config: &Config,
    fit: &Log,
    hold: Option<&Log>,
    library: &Library,
    options: &Options,
    observe: &mut dyn FnMut(Stage),
) -> Result<Diagnosis> {
    if config.kind == Kind::Driving {
        let drive = |log| Drive::new(log, options.since_power_on_s);
        let kept: Vec<Drive<'_>> = hold.map(drive).into_iter().collect();
        return crate::gap::drive::diagnose(config, &[drive(fit)], &kept, library, options, observe);
    }
    observe(Stage::Prepare);
    let given = Given::of(config, library)?;
    let prepared = prepare(&given.bare, fit, options.since_power_on_s)?;
    // an unusable hold-out recording is refused before the comparison begins
    let kept = hold.map(|hold| prepare(&given.bare, hold, options.since_power_on_s)).transpose()?;
    observe(Stage::Compare);
    let mut findings = judged(&prepared, library, &given, options).weighed(&fit.source)?;
    let found = compose::found(&findings);
    observe(Stage::Measure);
    let untested = hold.zip(kept.as_ref()).and_then(|(log, kept)| untested(log, kept, library, &found));
    // the other effects would be tested there on what this one does
    let kept = kept.filter(|_| untested.is_none());
    let scored = kept.as_ref().unwrap_or(&prepared);
    let recorded = scored.recorded_rad_s();
    let blocks = blocks(recorded.len());
    let score = |believed: &StateSpaceModel, y: &[f64]| match kept {
        Some(_) => Ok(believed.score(y)?.log_density),
        None => blocked_log_score(believed, y, &blocks),
    };
    let mut tested = account::test(
        &found,
        |effects| score(&believed(&scored.scene, library, &given.with(effects))?, &recorded),
        |effect| {
            let [with, nominal] =
                [std::slice::from_ref(effect), &[]].map(|e| believed(&scored.scene, library, &given.with(e)));
            let (with, nominal) = (with?, nominal?);
            let gain = |log: u64| {
                let mut y = with.simulate(options.seed, log)?;
                y.iter_mut().zip(&recorded).filter(|(_, real)| !real.is_finite()).for_each(|(y, _)| *y = f64::NAN);
                Ok(score(&with, &y)?.iter().sum::<f64>() - score(&nominal, &y)?.iter().sum::<f64>())
            };
            (0..options.simulated_logs as u64).map(gain).collect()
        },
    )?;
    account::weigh(&mut findings, &mut tested, &[], kept.is_some(), false);
    let place = |id: Option<&str>| place(&findings, library, id, &prepared);
    let mut answer = compose::answer(&findings, place);
    let together: Vec<(String, Parameters)> = found.into_iter().filter(|f| answer.together.contains(&f.0)).collect();
    let listed: Vec<(String, Parameters)> =
        answer.effects.iter().take(MEASURED).map(|e| (e.id.clone(), e.parameters.clone())).collect();
    let far = match kept {
        Some(kept) => {
            let new = kept.notes.iter().filter(|n| !prepared.notes.contains(n));
            answer.notes.extend(new.map(|n| format!("Of the recording held out: {n}")));
            other_unit(&prepared, &kept, &mut answer.notes);
            Some(measure(&kept, library, &given, [&together, &listed], &answer, options)?)
        }
        None => {
            cross_validate(&prepared, library, &given, &together, &mut answer)?;
            answer.notes.push(match untested {
                Some(why) => why,
                None => format!(
                    "No recording was held out: {BY_EIGHTHS} Record the unit again to know how far the gap shrinks."
                ),
            });
            None
        }
    };
    if let Some(far) = &far {
        account::measured(&mut answer, &far.metrics, &far.alone);
        answer.notes.extend(far.notes.iter().cloned());
    }
    let closed = far.as_ref().map(|far| &far.closed);
    account::settle(&mut answer, &tested, closed, place);
    let mut augmented = config.clone();
    augmented.effects =
        given.with(&together).into_iter().map(|(id, parameters)| EffectTable { id, parameters }).collect();
    if augmented.effects != config.effects {
        augmented.provenance = None;
    }
    observe(Stage::Done);
    Ok(Diagnosis { answer, augmented, findings, far, prepared: Some(prepared), traces: Vec::new() })
}

/// Diagnoses several drives of one robot jointly against the nominal simulator `config`. Effects and their parameters
/// are common to all drives; initial state, turn-on bias and random walk of the gyro are separate for each. The gap is
/// measured on the hold-out drives `kept`, which may be empty. Each drive states its own time since power-on; that in
/// `options` is not used. `observe` is told each stage as it begins.
///
/// # Errors
/// As [`crate::gap::drive::record::Record::of_drives`]: [`crate::ErrorKind::Config`] if the configuration is not of a drive,
/// otherwise with the name of the log.
pub fn diagnose_drives(
    config: &Config,
    fit: &[Drive<'_>],
    kept: &[Drive<'_>],
    library: &Library,
    options: &Options,
    observe: &mut dyn FnMut(Stage),
) -> Result<Diagnosis> {
    crate::gap::drive::diagnose(config, fit, kept, library, options, observe)
}

fn judged(prepared: &Prepared, library: &Library, given: &Given, options: &Options) -> Findings {
    let effects: Vec<&'static dyn Effect> = library.effects().collect();
    let mut findings = judge(&prepared.scene, &prepared.rate_rad_s, &effects, &options.judge);
    findings.trace.splice(0..0, trace::of_withheld(library));
    findings.trace.splice(0..0, trace::of_notes(&prepared.notes));
    findings.notes.splice(0..0, prepared.notes.iter().cloned());
    given.take_out(&mut findings, &options.judge.calibration);
    findings
}

/// Sets compared and answer of the diagnosis of `fit`, without measuring how far the gap shrinks: faster than
/// [`diagnose`].
///
/// # Errors
/// As [`prepare`]; [`crate::ErrorKind::Config`] if the configuration is of a drive or incomplete.
pub(crate) fn compare(config: &Config, fit: &Log, library: &Library, options: &Options) -> Result<(Findings, Answer)> {
    let given = Given::of(config, library)?;
    let prepared = prepare(&given.bare, fit, options.since_power_on_s)?;
    let findings = judged(&prepared, library, &given, options).weighed(&fit.source)?;
    let answer = compose::answer(&findings, |id| place(&findings, library, id, &prepared));
    Ok((findings, answer))
}

/// Channel, equation, time and band in which the effect `id` shows; with `None`, those of the largest free form of the
/// most probable set whose main cause is unknown.
fn place(findings: &Findings, library: &Library, id: Option<&str>, prepared: &Prepared) -> Option<Place> {
    let scene = &prepared.scene;
    match id {
        Some(id) => {
            let effect = library.by_id(id)?;
            let about = effect.about();
            let part = findings.best_with(id, true).or_else(|| findings.best_with(id, false))?.part(id)?;
            let frequency_hz = effect.band_hz(&part.parameters, scene).or(part.frequency_hz);
            let equation = effect.deficient(&part.parameters);
            Some(Place { equation, time_s: part.time_s, frequency_hz, ..Place::of(about) })
        }
        None => {
            let set = findings.best_unknown()?;
            let part = set.main()?;
            let condition = match part.id.as_str() {
                "free.temperature" | "free.variance_temperature" => Some("temperature_c"),
                "free.temperature_rate" | "free.variance_temperature_rate" => Some("temperature_rate"),
                "free.supply" | "free.variance_supply" | "free.supply_rate" => Some("supply_v"),
                "free.time" | "free.variance_time" => Some("elapsed_time"),
                _ => None,
            };
            let equation = if part.id.contains("variance") || part.id.contains("bursts") || part.id.contains("level") {
                "gyro measurement: the level of the noise"
            } else if part.id.contains("amplitude") || part.id.contains("lattice") {
                "gyro measurement: the distribution of the samples"
            } else {
                "gyro bias"
            };
            Some(Place {
                channel: "gyro".into(),
                equation: equation.into(),
                time_s: part.time_s,
                frequency_hz: part.frequency_hz,
                condition: condition.map(Into::into),
                description: Some(part.description.clone()),
            })
        }
    }
}

fn measure(
    kept: &Prepared,
    library: &Library,
    given: &Given,
    [together, listed]: [&[(String, Parameters)]; 2],
    answer: &Answer,
    options: &Options,
) -> Result<Far> {
    let with = |effects: &[(String, Parameters)]| believed(&kept.scene, library, &given.with(effects));
    let (nominal, augmented) = (with(&[])?, with(together)?);
    let alone: Vec<(String, StateSpaceModel)> =
        listed.iter().filter_map(|e| Some((e.0.clone(), with(std::slice::from_ref(e)).ok()?))).collect();
    let claims: Vec<Claim> = alone.iter().map(|(id, b)| Claim { id, believed: b }).collect();
    let main = answer.main.as_deref().and_then(|id| library.by_id(id));
    let far_options = holdout::Options {
        seed: options.seed,
        simulated_logs: options.simulated_logs,
        draws: 500,
        whole_log: matches!(main.and_then(|effect| effect.explanation(&kept.scene)), Some(Explanation::TurnOn)),
        ..holdout::Options::default()
    };
    holdout::measure(&kept.recorded_rad_s(), &nominal, &augmented, &claims, &far_options)
}

/// Equal blocks of a recording whose means give the scatter of its mean.
const BLOCKS: usize = 8;

/// Row ranges of the blocks of a recording.
fn blocks(rows: usize) -> Vec<std::ops::Range<usize>> {
    (0..BLOCKS).map(|b| b * rows / BLOCKS..(b + 1) * rows / BLOCKS).collect()
}

/// Log score without a hold-out recording, nats a row: each block's density given all other blocks, written to
/// `answer.gap`.
fn cross_validate(
    prepared: &Prepared,
    library: &Library,
    given: &Given,
    together: &[(String, Parameters)],
    answer: &mut Answer,
) -> Result<()> {
    let rows = prepared.scene.len();
    let blocks = blocks(rows);
    let recorded = prepared.recorded_rad_s();
    let score = |b: &StateSpaceModel| -> Result<f64> {
        Ok(blocked_log_score(b, &recorded, &blocks)?.iter().sum::<f64>() / rows as f64)
    };
    let [nominal, augmented] = [&[], together].map(|effects| believed(&prepared.scene, library, &given.with(effects)));
    let (nominal, augmented) = (nominal?, augmented?);
    let (before, after) = (score(&nominal)?, score(&augmented)?);
    let own = (0..4).map(|s| blocked_own(&augmented, &blocks, s)).collect::<Result<Vec<f64>>>()?;
    let floor = own.iter().sum::<f64>() / own.len() as f64;
    answer.gap = vec![Metric { metric: "log_score".into(), before, after, floor }];
    Ok(())
}

/// End of the sentence that says why no other recording was scored.
const BY_EIGHTHS: &str = "the log score is that of each eighth of this one given the others, with parameters that have seen \
                          all of it.";

/// Why the recording `log`, held out, cannot test all of the effects `found`: it lacks, or holds constant, a quantity that
/// one of them is a function of. None where it can.
fn untested(log: &Log, kept: &Prepared, library: &Library, found: &[(String, Parameters)]) -> Option<String> {
    let effects = found.iter().filter_map(|(id, _)| library.by_id(id));
    let about =
        effects.filter(|effect| effect.explanation(&kept.scene).is_none()).map(|effect| effect.about()).next()?;
    let quantity = if about.condition == Some(names::SUPPLY) { "supply" } else { "temperature" };
    let there = log.get(about.condition.unwrap_or_default()).is_some();
    Some(format!(
        "{} was held out and cannot test {} ({}): its {quantity} is {}. Therefore {BY_EIGHTHS} Record the unit again, with a \
         {quantity} that varies, to know how far the gap shrinks.",
        log.source,
        about.title,
        about.id,
        if there { "constant" } else { "not logged" }
    ))
}

fn blocked_own(b: &StateSpaceModel, blocks: &[std::ops::Range<usize>], seed: u64) -> Result<f64> {
    let own = b.simulate(seed, 0)?;
    Ok(blocked_log_score(b, &own, blocks)?.iter().sum::<f64>() / own.len() as f64)
}

/// Rounds to six significant digits: further digits of a sample time are rounding errors.
fn short(v: f64) -> f64 {
    format!("{v:.5e}").parse().unwrap_or(v)
}

/// Mean deviation from the nominal warm-up, and the standard deviation of the means of eight equal blocks, both rad/s.
fn offset(p: &Prepared) -> [f64; 2] {
    let rows = p.rate_rad_s.len();
    let off = |row: usize| p.rate_rad_s[row] - p.scene.warm_up.error_rad_s(p.scene.time.at(row));
    let mean = |part: std::ops::Range<usize>| {
        let rows = part.len().max(1) as f64;
        part.map(off).sum::<f64>() / rows
    };
    let parts: Vec<f64> = blocks(rows).into_iter().map(mean).collect();
    let all = parts.iter().sum::<f64>() / BLOCKS as f64;
    [all, (parts.iter().map(|m| (m - all).powi(2)).sum::<f64>() / (BLOCKS - 1) as f64).sqrt()]
}

/// Adds a note if noise or turn-on bias show that the hold-out recording is of another unit, or if the sample times
/// differ.
fn other_unit(fit: &Prepared, kept: &Prepared, notes: &mut Vec<String>) {
    let level = |p: &Prepared| {
        let d: f64 = p
            .rate_rad_s
            .windows(2)
            .filter(|w| w[0].is_finite() && w[1].is_finite())
            .map(|w| (w[1] - w[0]).powi(2))
            .sum();
        (d / p.rate_rad_s.len() as f64 * p.scene.step_s).sqrt()
    };
    let (a, b) = (level(fit), level(kept));
    if (a / b).ln().abs() > 0.2 {
        notes.push(format!(
            "The recording held out does not seem to be of the same unit: its noise is {:.2} times that of the one that was \
             diagnosed. What it says of the gap is then not to be relied on.",
            b / a
        ));
    }
    let ([mean_a, own_a], [mean_b, own_b]) = (offset(fit), offset(kept));
    let stated = std::f64::consts::SQRT_2 * fit.scene.turn_on_bias_std_rad_s;
    let scatter = stated.hypot(own_a).hypot(own_b);
    if (mean_b - mean_a).abs() > 6.0 * scatter {
        notes.push(format!(
            "The recording held out does not seem to be of the same unit: its turn-on bias differs by {:.1e} rad/s from that \
             of the one that was diagnosed, {:.0} standard deviations of what is stated and of what the bias does within a \
             recording.",
            mean_b - mean_a,
            (mean_b - mean_a).abs() / scatter
        ));
    }
    if (fit.scene.step_s / kept.scene.step_s).ln().abs() > 0.01 {
        notes.push(format!(
            "The recordings differ in their sample time: {} s and {} s. White noise is scaled from one to the other.",
            short(fit.scene.step_s),
            short(kept.scene.step_s)
        ));
    }
}
