//! δ = θ_real - θ_sim,  var δ = σ²_real + σ²_sim + τ²,  evidence' = evidence (z'/z)²,  z = θ_real/σ_real, z' = δ/√var δ
//!
//! The account of the recording, less that of the simulator. Both are deviations from one twin: what stands in both alike is how the
//! simulator differs from our model, and no gap. σ_sim is how well the simulator's own log tells the effect beside the twin's
//! constants, τ how much it differs from run to run. The evidence of an effect grows with the square of its size over its standard
//! deviation; what it has left must reach what any effect must reach to be named. Where the twin errs by more than its noise
//! ([`Misfit`]) evidence counts for as much less: what it does not reach then is neither a gap nor none.

use super::compared::{Compared, Inherited, Said, presence};
use super::levels;
use super::parameters::moved;
use super::quality::{Misfit, misfit};
use super::refine::{Fitting, Level};
use super::told::Twin;
use super::unnamed::inherits_unknown;
use crate::config::{Config, Kind};
use crate::effects::drive::{DriveExplanation, ModelChange};
use crate::effects::{About, Library};
use crate::error::{Error, ErrorKind, Result};
use crate::gap::answer::{Answer, EffectAnswer, Place, Verdict};
use crate::gap::diagnose::diagnose_observed;
use crate::gap::diagnosis::{Diagnosis, Drive, Options, Stage};
use crate::gap::drive::record::Record;
use crate::gap::explain::explain;
use crate::gap::selection::findings::Findings;
use crate::gap::trace::{Decision, Step, TraceStage};
use crate::math::random_effects::{Observed, spread};
use crate::model::drive::Instrument;
use crate::signal::{Log, names};
use std::cmp::Ordering;

/// ln of the ratio of two steps up to which logs have the same.
const SAME_STEP: f64 = 0.01;
/// Probability above which an effect that is not named is held against the simulator's log too: it counts in that of none.
const LIKELY: f64 = 0.5;
/// Factor of a [`Misfit`] from which on the twin errs by more than its noise: neither that there is no gap, nor shares of it, which are
/// measured against the noise, are told.
const WORSE_THAN_NOISE: f64 = 2.0;

/// Diagnoses the drives `real` against the twin, and takes out what the simulator has too. `kept` are held out.
///
/// # Errors
/// As [`crate::gap::diagnose_drives`]; [`ErrorKind::Column`] where simulator and recording share no channel but the wheels, or not
/// these.
pub fn compare_drives(
    twin: &Twin,
    real: &[Drive<'_>],
    kept: &[Drive<'_>],
    library: &Library,
    options: &Options,
    observe: &mut dyn FnMut(Stage),
) -> Result<Compared> {
    let Some(fitting) = &twin.fitting else {
        return Err(Error::new(
            ErrorKind::Usage,
            "simulator",
            "its log is of a gyro at rest, and the recording is a drive",
        )
        .hint("give two drives, or two logs at rest"));
    };
    let mut notes = Vec::new();
    let shared = |drives: &[Drive<'_>], notes: &mut Vec<String>| {
        let one = |d: &Drive<'_>| Ok((share(fitting, d.log, notes)?, [d.since_power_on_s, d.load_kg]));
        drives.iter().map(one).collect::<Result<Vec<_>>>()
    };
    let (fit_logs, kept_logs) = (shared(real, &mut notes)?, shared(kept, &mut notes)?);
    let [fit, hold] = [&fit_logs, &kept_logs].map(|logs| {
        logs.iter().map(|(log, [start_s, load_kg])| Drive::new(log, *start_s).carrying(*load_kg)).collect::<Vec<_>>()
    });
    let runs: Vec<_> = fitting.record.apart().collect();
    let levels = fitting.level_stds();
    let temperature = options.judge_drives.calibration.temperature;
    let says = |effect: &EffectAnswer, name: &str| -> Option<Said> {
        // what the twin holds is told beside itself: the recording deviates from that
        if let Some(own) = twin.effects.iter().find(|e| e.in_twin && e.id == effect.id) {
            return own.std.get(name).map(|std| Said { value: 0.0, std: *std });
        }
        let by_account = || account_says(twin, &effect.id, name);
        let Some(driving) = library.driving_by_id(&effect.id) else { return by_account() };
        match driving.explanation() {
            DriveExplanation::Model(change) => {
                let each: Vec<Said> = runs.iter().filter_map(|run| of_run(fitting, run, change, name)).collect();
                (each.len() == runs.len()).then(|| over_runs(&each)).flatten()
            }
            DriveExplanation::NoiseLevel(of) => {
                let level = match of {
                    Instrument::Gyro => Level::Gyro,
                    Instrument::Wheels => Level::Wheels,
                    Instrument::Pose => Level::Position,
                };
                let std = levels.iter().find(|l| l.0 == level).map_or(0.0, |l| l.1);
                let left = by_account().filter(|said| said.value > 0.0);
                Some(left.unwrap_or(Said { value: 1.0, std }))
            }
            _ => by_account(),
        }
    };
    let about =
        |id: &str| library.driving_by_id(id).map(|e| e.about()).or_else(|| library.by_id(id).map(|e| e.about()));
    let rows = fit.iter().map(|d| d.log.len()).sum();
    let steps_s = [fitting.record.step_s, fit.first().map_or(0.0, |d| d.log.time.median_step_s())];
    let same_step = (steps_s[0] / steps_s[1]).ln().abs() <= SAME_STEP;
    if !same_step {
        notes.push(format!(
            "The simulator is logged every {:.4} s, the recording every {:.4} s: the noise of a reading is taken to be the same at both.",
            steps_s[0], steps_s[1]
        ));
    }
    let mut against = |config: &Config| -> Result<Compared> {
        let mut diagnosis = crate::gap::drive::diagnose(config, &fit, &hold, library, options, observe)?;
        diagnosis.answer.notes.extend(notes.iter().cloned());
        let held_against = subtract(&mut diagnosis, twin, (temperature, rows), about, says);
        Ok(Compared { diagnosis, held_against })
    };
    let told = against(&twin.config)?;
    // without torques a diagnosis alone does not tell the noise of gyro and wheels
    if !told.diagnosis.answer.together.is_empty() || fitting.record.torques_n_m.is_some() || !same_step {
        return Ok(told);
    }
    let real = Record::of_drives(&twin.config, &fit)?;
    let changes = levels::changes(&fitting.record, &real, library, told.diagnosis.findings.least_nats);
    if changes.is_empty() {
        return Ok(told);
    }
    let mut twin_with_levels = twin.config.clone();
    changes.iter().for_each(|change| change.enter(&mut twin_with_levels, fitting.record.step_s));
    let mut beside = against(&twin_with_levels)?;
    levels::name(&mut beside, &changes, &twin.config, fitting.record.step_s, temperature);
    Ok(beside)
}

/// Diagnoses the recording `real` of a gyro at rest against the twin, and takes out what the simulator's logs have too.
///
/// # Errors
/// As [`crate::gap::diagnose()`].
pub fn compare_at_rest(
    twin: &Twin,
    simulated: &[&Log],
    real: &Log,
    kept: Option<&Log>,
    library: &Library,
    options: &Options,
    observe: &mut dyn FnMut(Stage),
) -> Result<Compared> {
    if twin.config.kind != Kind::Stationary {
        return Err(Error::new(
            ErrorKind::Usage,
            "simulator",
            "its log is a drive, and the recording is of a gyro at rest",
        )
        .hint("give two drives, or two logs at rest"));
    }
    let mut diagnosis = diagnose_observed(&twin.config, real, kept, library, options, observe)?;
    let says = |effect: &EffectAnswer, name: &str| -> Option<Said> {
        let of = |log: &&Log| {
            let told = explain(&twin.config, log, library, &[effect.id.as_str()], 0.0).ok()?;
            let null = effect_null(library, &effect.id, name).unwrap_or(0.0);
            // no trace of it
            let Some(one) = told.effects.first().and_then(|e| e.parameters.get(name)) else {
                return Some(Said { value: null, std: 0.0 });
            };
            Some(Said { value: one.estimate, std: one.std })
        };
        let each: Vec<Said> = simulated.iter().filter_map(of).collect();
        (each.len() == simulated.len()).then(|| over_runs(&each)).flatten()
    };
    let about = |id: &str| library.by_id(id).map(|e| e.about());
    let (temperature, rows) = (options.judge.calibration.temperature, real.len());
    let held_against = subtract(&mut diagnosis, twin, (temperature, rows), about, says);
    Ok(Compared { diagnosis, held_against })
}

fn effect_null(library: &Library, id: &str, name: &str) -> Option<f64> {
    library.by_id(id)?.about().parameters.iter().find(|p| p.name == name)?.null
}

/// Size of an effect that is no change of the equations in the last diagnosis of the simulator's log.
fn account_says(twin: &Twin, id: &str, name: &str) -> Option<Said> {
    let account = twin.account.as_ref()?;
    let there = account.effects.iter().find(|e| e.id == id && account.together.contains(&e.id));
    let Some(there) = there else { return Some(Said { value: 0.0, std: 0.0 }) };
    Some(Said { value: *there.parameters.get(name)?, std: there.std.get(name).copied().unwrap_or(0.0) })
}

fn of_run(fitting: &Fitting, run: &Record, change: &'static dyn ModelChange, name: &str) -> Option<Said> {
    let told = fitting.beside(run, change);
    let theta: Vec<f64> = told.iter().map(|t| t.map_or(0.0, |t| t[0])).collect();
    // a law that bends is compared by what the log tells of it
    told.first()?.as_ref()?;
    let stds: Vec<f64> = told.iter().map(|t| t.map_or(0.0, |t| t[1])).collect();
    let std = moved(change, &theta, &stds);
    Some(Said { value: *change.parameters(&theta).get(name)?, std: *std.get(name)? })
}

/// Several runs: their mean, with the spread that one more run would have about it.
fn over_runs(each: &[Said]) -> Option<Said> {
    let observed: Vec<Observed<1>> = each.iter().map(|s| Observed::number(s.value, s.std)).collect();
    match spread(&observed) {
        Some(s) => Some(Said { value: s.mean[0], std: s.std.hypot(s.mean_covariance[0].sqrt()) }),
        None => each.first().copied(),
    }
}

/// `log` with the channels that the simulator's log has too.
fn share(fitting: &Fitting, log: &Log, notes: &mut Vec<String>) -> Result<Log> {
    let has = |name: &str| log.get(name).is_some_and(|v| v.iter().any(|v| v.is_finite()));
    let record = &fitting.record;
    let (torques, gyro, pose) = (record.torques_n_m.is_some(), record.gyro_rad_s.is_some(), record.pose.is_some());
    let lacking = [
        (torques, &[names::TORQUE_LEFT, names::TORQUE_RIGHT][..], "torques"),
        (gyro, &[names::GYRO_Z][..], "gyro"),
        (pose, &[names::X, names::Y, names::HEADING][..], "pose"),
    ];
    let mut out = log.clone();
    let mut alike = 0;
    for (there, channels, what) in lacking {
        let own = channels.iter().any(|c| has(c));
        alike += usize::from(there && own);
        if own && !there {
            out.channels.retain(|c| !channels.contains(&c.name.as_str()));
            let note = format!("The simulator's log has no {what}: those of the recording are not compared.");
            if !notes.contains(&note) {
                notes.push(note);
            }
        }
    }
    if alike == 0 {
        return Err(Error::new(
            ErrorKind::Column,
            &log.source,
            "shares neither torques nor gyro nor pose with the simulator's log",
        )
        .hint("log one of them in both, or name its column: --map gyro_z_rad_s=COLUMN"));
    }
    Ok(out)
}

/// Takes out of the diagnosis what the simulator's log says too.
fn subtract(
    diagnosis: &mut Diagnosis,
    twin: &Twin,
    (temperature, rows): (f64, usize),
    about: impl Fn(&str) -> Option<&'static About>,
    says: impl Fn(&EffectAnswer, &str) -> Option<Said>,
) -> Vec<Inherited> {
    let mut all = Vec::new();
    let findings = &diagnosis.findings;
    let answer = &mut diagnosis.answer;
    let named: Vec<String> = answer.main.iter().chain(&answer.together).cloned().collect();
    let mut taken_out: Vec<String> = Vec::new();
    let misfit = misfit(&twin.channels);
    let factor = misfit.as_ref().map_or(1.0, |m| m.factor);
    let mut hidden = false;
    for effect in answer.effects.iter_mut().filter(|e| named.contains(&e.id) || e.probability > LIKELY) {
        let Some(about) = about(&effect.id) else { continue };
        let mut held: Vec<(Inherited, f64, f64)> = Vec::new();
        for parameter in about.parameters {
            let Some(null) = parameter.null else { continue };
            let (Some(value), Some(std)) = (effect.parameters.get(parameter.name), effect.std.get(parameter.name))
            else {
                continue;
            };
            let real = Said { value: *value, std: *std };
            let simulator = says(effect, parameter.name);
            held.push(one(&effect.id, parameter.name, null, real, simulator));
        }
        let Some((before, share)) = kept_share(&held) else { continue };
        // an effect in whose place another could stand was named for what it explains: its evidence is then how far it is from none
        let nats = effect.evidence_nats.filter(|nats| *nats >= findings.least_nats).unwrap_or(0.5 * before * before);
        let left = share * nats / factor;
        let is_gap = left >= findings.least_nats;
        hidden |= !is_gap && share * nats >= findings.least_nats;
        // no surer than the evidence that is left makes it, however much was there before
        effect.probability = effect.probability.min(presence(left, findings, temperature));
        effect.evidence_nats = effect.evidence_nats.map(|_| left);
        for (inherited, ..) in &mut held {
            inherited.is_gap = is_gap;
            effect.parameters.insert(inherited.parameter.clone(), inherited.difference.value);
            effect.std.insert(inherited.parameter.clone(), inherited.difference.std);
        }
        if !is_gap {
            taken_out.push(effect.id.clone());
        }
        all.extend(held.into_iter().map(|h| h.0));
    }
    for id in &taken_out {
        let reason =
            "the simulator's own log has as much of it: it is how the simulator differs from our model, and no gap";
        answer.trace.push(Step::new(TraceStage::Naming, id, Decision::Removed, reason));
    }
    if !taken_out.is_empty() {
        answer.notes.push(format!(
            "In the simulator's log as in the recording, and therefore no gap: {}.",
            taken_out.join(", ")
        ));
        diagnosis.augmented.effects.retain(|e| !taken_out.contains(&e.id) || twin.config.effects.contains(e));
    }
    answer.together.retain(|id| !taken_out.contains(id));
    if answer.main.as_ref().is_some_and(|id| taken_out.contains(id)) {
        answer.main = answer.together.first().cloned();
        answer.place = answer.place.take().filter(|_| answer.verdict == Verdict::Unknown);
    }
    if factor > WORSE_THAN_NOISE {
        answer.effects.iter_mut().for_each(|e| (e.gap_closed, e.gap_closed_ci95, e.share) = (None, None, None));
    }
    settle(answer, twin, findings, rows, (misfit.as_ref(), hidden));
    all
}

/// One parameter of an effect, with z before and after.
fn one(id: &str, name: &str, null: f64, real: Said, simulator: Option<Said>) -> (Inherited, f64, f64) {
    // a ratio is compared in its logarithm
    let is_ratio = null == 1.0 && real.value > 0.0;
    let deviation = |s: Said| if is_ratio { Said { value: s.value.ln(), std: s.std / s.value } } else { s };
    let own = deviation(real);
    let other = simulator.map_or(Said { value: 0.0, std: f64::INFINITY }, deviation);
    let std = own.std.hypot(other.std);
    let value = if simulator.is_some() { own.value - other.value } else { own.value };
    let z = |value: f64, std: f64| if std > 0.0 { (value / std).abs() } else { 0.0 };
    let difference = if is_ratio { Said { value: value.exp(), std: value.exp() * std } } else { Said { value, std } };
    let inherited = Inherited { id: id.into(), parameter: name.into(), real, simulator, difference, is_gap: true };
    (inherited, z(own.value, own.std), z(value, std))
}

/// z of the parameter that proves an effect best, and the share of its evidence that is beyond the simulator's. It proves it in the
/// recording *and* beyond the simulator: one that the recording does not tell differs from the simulator's by the latter's chance.
fn kept_share(held: &[(Inherited, f64, f64)]) -> Option<(f64, f64)> {
    let proves = |h: &(Inherited, f64, f64)| (h.1.min(h.2), h.1);
    let best = held.iter().max_by(|a, b| proves(a).partial_cmp(&proves(b)).unwrap_or(Ordering::Equal));
    best.map(|(_, before, after)| (*before, if *before > 0.0 { (after / before).powi(2).min(1.0) } else { 1.0 }))
}

/// The verdict that follows from what is left. `misfit`: that of the twin, and whether it may hide a named effect.
fn settle(
    answer: &mut Answer,
    twin: &Twin,
    findings: &Findings,
    rows: usize,
    (misfit, mut hidden): (Option<&Misfit>, bool),
) {
    let rows = twin.fitting.as_ref().map(|fitting| [rows, fitting.record.len()]);
    let inherits = |answer: &Answer, factor: f64| {
        let account = twin.account.as_ref().zip(rows);
        account.is_some_and(|(account, rows)| inherits_unknown(answer, account, rows, factor))
    };
    let inherited = inherits(answer, 1.0);
    if answer.verdict == Verdict::Unknown && !inherited && misfit.is_some_and(|m| inherits(answer, m.factor)) {
        hidden = true;
        answer.unknown_probability = 0.0;
        answer.verdict = if answer.together.is_empty() { Verdict::None } else { Verdict::Identified };
    }
    if answer.verdict == Verdict::Unknown && inherited {
        answer.notes.push(
            "What is left without a name is as strong in the simulator's own log: it is how the simulator differs from our model, and no gap."
                .into(),
        );
        answer.unknown_probability = (1.0 - findings.least_presence()).min(answer.unknown_probability);
        answer.verdict = if answer.together.is_empty() { Verdict::None } else { Verdict::Identified };
        let reason =
            "no stronger than in the simulator's own log: it is how the simulator differs from our model, and no gap";
        answer.trace.push(Step::new(TraceStage::Naming, "free forms", Decision::Removed, reason));
    }
    let lost_all = answer.verdict == Verdict::Identified && answer.together.is_empty();
    if lost_all {
        answer.verdict = Verdict::None;
    }
    // that nothing is seen says nothing where anything of the size of the noise is hidden
    let misfit = misfit.filter(|m| hidden || m.factor > WORSE_THAN_NOISE);
    if let (Verdict::None, Some(misfit)) = (answer.verdict, misfit) {
        cannot_tell(answer, misfit);
    }
    if answer.verdict != Verdict::Unknown {
        answer.nearest = None;
    }
    match answer.verdict {
        Verdict::None => {
            let most = answer.effects.iter().filter(|e| !e.idle).map(|e| e.probability).fold(0.0, f64::max);
            answer.main = None;
            answer.place = None;
            answer.remainder = None;
            answer.together.clear();
            answer.none_probability = (1.0 - most - answer.unknown_probability).max(answer.none_probability);
            answer.main_probability = most.min(1.0 - answer.none_probability);
        }
        Verdict::Identified => {
            if answer.main.is_none() {
                answer.main = answer.together.first().cloned();
            }
            let presence =
                answer.effects.iter().find(|e| Some(&e.id) == answer.main.as_ref()).map_or(0.0, |e| e.probability);
            answer.main_probability = presence.min(1.0 - answer.none_probability - answer.unknown_probability).max(0.0);
        }
        Verdict::Unknown | Verdict::CannotTell => {}
    }
}

/// The answer where the twin's own error may be all that there is.
fn cannot_tell(answer: &mut Answer, misfit: &Misfit) {
    answer.verdict = Verdict::CannotTell;
    (answer.main_probability, answer.none_probability, answer.unknown_probability) = (0.0, 0.0, 0.0);
    (answer.main, answer.nearest, answer.remainder) = (None, None, None);
    answer.together.clear();
    answer.place = Some(Place {
        channel: misfit.channel.clone(),
        equation: "motion of the simulated robot".into(),
        description: Some(format!("our model does not move as the simulator does, most in {}", misfit.channel)),
        ..Place::default()
    });
    answer.notes.push(format!(
        "The twin errs by more than its noise even in the simulator's own log: evidence in {} counts for a {:.0}th. What the simulator \
         lacks is smaller than that, or nothing. Log torques or motor currents as well, or drive where the robot skids less.",
        misfit.channel, misfit.factor
    ));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `parameters`: value and standard deviation in the recording, and in the simulator's log.
    fn share(parameters: &[([f64; 2], Option<[f64; 2]>)]) -> f64 {
        let said = |[value, std]: [f64; 2]| Said { value, std };
        let each = parameters.iter().map(|(real, simulator)| one("", "", 0.0, said(*real), simulator.map(said)));
        kept_share(&each.collect::<Vec<_>>()).unwrap().1
    }

    /// A slide of 4.5 standard deviations, 1.6 beyond the simulator's, and a bend that only the simulator's log tells.
    #[test]
    fn what_the_recording_does_not_tell_proves_nothing_of_it() {
        let slide = ([1.94e-3, 4.4e-4], Some([1.05e-3, 3.3e-4]));
        let bend = ([1e-8, 8e-6], Some([-5.5e-3, 1.8e-3]));
        assert_eq!(share(&[slide, bend]), share(&[slide]));
        assert!(share(&[slide]) < 0.2);
        // what the simulator's log does not tell is no gap, whichever parameter comes last
        assert_eq!(share(&[([2.0, 0.1], None), ([0.0, 0.1], None)]), 0.0);
        assert!(share(&[([2.0, 0.1], Some([0.0, 0.01]))]) > 0.95);
    }
}
