//! The whole diagnosis of a drive, or of several of one robot: which equation, which effect, how far the gap shrinks.

use super::ekf::effect_set::EffectSet;
use super::holdout::navigating::filter_gain;
use super::holdout::traces::traces;
use super::holdout::{self, DriveFar};
use super::model_selection::{Judged, SAME_STEP, judge, unknowable};
use super::preprocess::{clocks, wheel_offset};
use super::record::Record;
use super::record::ready::{Ready, ready};
use super::record::same_unit::other_robot;
use super::record::testable::nothing_twice;
use super::regressors::basis::{Equation, Follows};
use super::regressors::candidates::VARYING;
use super::regressors::practical_identifiability::{LARGEST, separate_by};
use super::screening::best_single_effect::BestSingleEffect;
use super::screening::deficient_equations::pinpoint;
use super::trail;
use crate::config::{Config, EffectTable, Kind};
use crate::effects::drive::{DriveExplanation, Driving};
use crate::effects::{InDrives, Library, Parameters, in_drives};
use crate::error::Result;
use crate::gap::answer::{Alike, Answer, EffectAnswer, Nearest, Place, TimeOffset, Verdict, account, compose};
use crate::gap::diagnosis::{Diagnosis, Drive, Options, Stage};
use crate::gap::drive::ekf::noise::Process;
use crate::gap::holdout::Options as FarOptions;
use crate::gap::selection::findings::{Findings, REFUTED};
use crate::gap::selection::sets::Part;
use crate::gap::trace::{self, Decision, Step, TraceStage};
use statrs::function::erf::erfc;

mod notes;

/// Share of the explained gap above which an effect explains most of it.
const MOST: f64 = 0.5;
/// Largest number of effects whose share of the gap is measured one by one.
const MEASURED: usize = 4;
/// Most recordings simulated for the floor.
const SIMULATED: usize = 6;
/// Standard deviations by which the filter's error may grow with an effect: the true effect makes no filter worse.
const MISLED: f64 = 3.0;

/// Diagnoses drives; see [`crate::gap::diagnose_drives`].
///
/// # Errors
/// As [`Record::of_drives`] of either; also if a recording has no finite likelihood.
pub(crate) fn diagnose(
    config: &Config,
    fit: &[Drive<'_>],
    hold: &[Drive<'_>],
    library: &Library,
    options: &Options,
    observe: &mut dyn FnMut(Stage),
) -> Result<Diagnosis> {
    observe(Stage::Prepare);
    let nominal_alone = config.kind == Kind::Driving && config.effects.is_empty();
    if let Some(untested) = nominal_alone.then(|| nothing_twice(config, fit, &options.judge_drives)).flatten() {
        observe(Stage::Done);
        return Ok(untested);
    }
    let clocks = clocks::agree(config, fit, hold)?;
    let [fit, hold] = &clocks.drives(fit, hold);
    let Ready { record, kept, effects, lags, mounting } =
        ready(config, &clocks, [fit, hold], library, &options.judge_drives)?;
    observe(Stage::Compare);
    let mut judged = judge(&record, &effects, &options.judge_drives);
    judged.findings = judged.findings.weighed(&record.sources.join("; "))?;
    let loud = notes::loud_note(&record.belief, &judged.nominal_noise).filter(|_| record.torques_n_m.is_none());
    let record = record.with_levels_of(&judged.nominal_noise);
    let kept = kept.map(|kept| kept.with_levels_of(&judged.nominal_noise));
    observe(Stage::Measure);
    let half = kept.is_none().then(|| holdout::second_half(&record));
    let measured = kept.as_ref().or(half.as_ref()).unwrap_or(&record);
    let mut found = compose::found(&judged.findings);
    let process = judged.nominal_noise.process;
    let far_options = far_options(options, measured);
    let rows = |effects: &[(String, Parameters)]| holdout::rows(measured, library, effects, process);
    let expect =
        |one: &_| Ok(holdout::expected_gains(measured, library, std::slice::from_ref(one), process, &far_options));
    let mut tested = account::test(&found, |effects| Ok(rows(effects)), expect)?;
    let mut vouched = None;
    let total = |rows: &[f64]| rows.iter().sum::<f64>();
    if let Some((closest, share)) = judged.closest.as_ref().filter(|_| !judged.as_stated)
        && let one = (closest.part.id.clone(), closest.part.parameters.clone())
        // quantization is read off the readings, whatever moves the robot
        && let lattice = found.iter().filter(|other| other.0 != one.0 && is_lattice(library, &other.0))
        && let alone = rows(&std::iter::once(&one).chain(lattice).cloned().collect::<Vec<_>>())
        && let others = [rows(&[]), rows(&found)]
        && others.iter().all(|other| total(&alone) > total(other))
        && (*share > MOST || others.iter().all(|other| account::is_better(other, &alone)))
    {
        let id = one.0.clone();
        found.retain(|other| other.0 != id);
        found.insert(0, one);
        tested = account::test(&found, |effects| Ok(rows(effects)), expect)?;
        let superfluous = account::superfluous(&tested);
        let beside = "gains nothing beyond chance on this recording beside the effect that explains most alone";
        let removed = |id: &String| Step::new(TraceStage::HoldOut, id, Decision::Removed, beside);
        judged.findings.trace.extend(superfluous.iter().map(removed));
        judged.findings.lead(&Part { share: closest.gain, ..closest.part.clone() }, &superfluous);
        tested.retain(|t| !superfluous.contains(&t.id));
        found.retain(|one| !superfluous.contains(&one.0));
        vouched = Some(id);
    }
    judged.closest = judged.closest.filter(|_| judged.unknown && vouched.is_none());
    judged.findings.trace.splice(0..0, trace::of_withheld(library));
    judged.findings.trace.splice(0..0, mounting.iter().map(trail::reference));
    judged.findings.trace.splice(0..0, trace::of_notes(&clocks.notes));
    judged.findings.trace.extend(
        loud.iter().map(|loud| {
            Step::new(TraceStage::Readings, "noise of wheels and gyro", Decision::Estimated, loud.as_str())
        }),
    );
    judged.findings.trace.splice(0..0, clocks.offsets.iter().zip(&clocks.said).map(clock_step));
    // readings on the same lattice show it, however well its rounding is predicted
    let lsb_rad_s = measured.wheel_lsb_rad_s();
    for test in tested.iter_mut().filter(|t| is_lattice(library, &t.id)) {
        let lsb = found.iter().filter(|f| f.0 == test.id).flat_map(|f| f.1.values()).next();
        test.is_read_off = lsb.zip(lsb_rad_s).is_some_and(|(own, there)| (own / there).ln().abs() < SAME_STEP);
    }
    let refuted = if kept.is_some() { account::refuted(&tested) } else { Vec::new() };
    account::weigh(&mut judged.findings, &mut tested, &refuted, kept.is_some(), vouched.is_some());
    let findings = &judged.findings;
    let place = |id: Option<&str>| place(findings, library, id);
    let mut answer = compose::answer(findings, place);
    let closest = judged.closest.as_ref().map(|(one, _)| one.part.id.as_str());
    told_apart(&mut answer, &record, &judged.alike, closest);
    drop_inconstant(&mut answer, findings);
    let wanders = told_as_wander(&mut answer);
    answer.notes.extend(wanders);
    answer.equations = pinpoint(&record, &judged.nominal_noise, options.corrections);
    answer.time_offsets.clone_from(&clocks.offsets);
    answer.notes.extend(clocks.said.iter().chain(&clocks.notes).cloned());
    answer.notes.extend(notes::together_note(&record));
    answer.notes.extend(loud);
    let vouched = vouched.map(|id| {
        let why = format!(
            "{id} explains most alone of the recordings diagnosed from, and predicts the one on which the gap is measured better than \
             all that was found beside each other. It leads: noise that is not as stated is seldom white, and their own evidence counts more readings \
             than are independent."
        );
        answer.trace.push(Step::new(TraceStage::Naming, &id, Decision::Taken, why.as_str()));
        why
    });
    answer.notes.extend(vouched);
    answer.notes.extend((!refuted.is_empty()).then(|| {
        format!(
            "The recording held out contradicts {}: with it the simulator predicts that recording worse, beyond chance. It is no \
             cause of what it explains of the recordings diagnosed from.",
            refuted.join(", ")
        )
    }));
    answer.notes.extend(mounting.map(|m| m.said()));
    let hidden: Vec<_> = unknowable(&record, &effects).chain(lags.iter().map(|e| e.about().id)).collect();
    if !hidden.is_empty() {
        answer.notes.push(format!("This log alone cannot tell whether there is any of {}.", hidden.join(", ")));
    }
    let together: Vec<(String, Parameters)> = found.into_iter().filter(|f| answer.together.contains(&f.0)).collect();
    let is_mean = |(id, parameters): &(String, Parameters)| {
        library.driving_by_id(id).and_then(Driving::tick_loss).is_some_and(|loss| loss.is_mean(parameters))
    };
    answer.notes.extend(together.iter().any(is_mean).then(|| {
        "Ticks are lost in bursts too weak to show singly: the loss that is told is the mean over all of the drive."
            .into()
    }));
    let together = offered(&record, library, together, judged.nominal_noise.process, &mut answer);
    let nearest = judged.closest.as_ref().map(|(closest, _)| list_closest(closest, &mut answer));
    let listed: Vec<(String, Parameters)> = answer
        .effects
        .iter()
        .enumerate()
        .filter(|(i, _)| *i < MEASURED || Some(*i) == nearest)
        .map(|(_, e)| (e.id.clone(), e.parameters.clone()))
        .collect();
    let mut augmented = config.clone();
    let tables = together.iter().cloned().map(|(id, parameters)| EffectTable { id, parameters });
    augmented.effects.extend(tables);
    if !augmented.effects.is_empty() {
        augmented.provenance = None;
    }
    let traces = match options.traces {
        true => traces(measured, library, &together, judged.nominal_noise.process),
        false => Vec::new(),
    };
    let (far, filter_gain) = rayon::join(
        || measure(measured, library, &together, &listed, &judged, &far_options),
        || filter_gain(config, &augmented, hold, library),
    );
    match &kept {
        Some(kept) => {
            let new = kept.notes.iter().filter(|n| !record.notes.contains(n));
            answer.notes.extend(new.map(|n| format!("Of the recording held out: {n}")));
            other_robot(&record, Some(kept), &mut answer.notes);
        }
        None => {
            other_robot(&record, None, &mut answer.notes);
            let halves = if fit.len() > 1 { "halves of these" } else { "half of this one" };
            answer.notes.push(format!(
                "No recording was held out: the gap is measured on the second {halves}, which took part in choosing and fitting \
                 the effects, so that the shares are somewhat too large."
            ));
        }
    }
    account::measured(&mut answer, &far.metrics, &far.alone);
    answer.notes.extend(notes::each_note(&far, &together));
    if let (Some(delay_s), Some(kept)) = (judged.wheels_late_s, &kept) {
        let nominal = EffectSet::new(&[], library).models(kept);
        let gain = wheel_offset::gain(kept, &nominal, &judged.nominal_noise, delay_s);
        answer.notes.push(format!(
            "With the readings of the wheels stamped {delay_s:.3} s earlier the nominal simulator gains {gain:.0} nats on the \
             recording held out."
        ));
    }
    if let Some((id, gap)) = far.nearest {
        let share = judged.closest.as_ref().map_or(0.0, |c| c.1);
        answer.nearest = Some(Nearest { id, share, gap });
    }
    account::settle(&mut answer, &tested, Some(&far.together), place);
    // no filter knows an effect whose time differs from run to run
    let law =
        |id: &str| library.driving_by_id(id).is_some_and(|e| matches!(e.explanation(), DriveExplanation::Model(_)));
    if answer.verdict == Verdict::Identified
        && answer.main.as_deref().is_some_and(law)
        && far.misled > MISLED
        && kept.is_some()
    {
        let why = "The navigation filter errs more with what has a name than without, and more than it may: in a simulator that has it \
                   instead of the true cause, filters are tuned to the wrong robot.";
        let probability = 0.5 * erfc(-far.misled / std::f64::consts::SQRT_2) * answer.main_probability;
        let step = Step::new(TraceStage::Naming, account::IDENTIFIED, Decision::Rejected, why).limit(
            "standard deviations by which the filter may err more",
            MISLED,
            "",
        );
        account::unseat(&mut answer, probability, step, place(None));
    }
    if let (Some(share), true) = (far.together.estimate, together.len() > 1) {
        answer.notes.push(format!("All that were found close {:.1} % of the gap together.", 100.0 * share));
    }
    if far_options.in_pairs && !together.is_empty() {
        answer.remainder = None;
        let note = "Without torques nothing tells how the robot should have moved: the gap is the gain to be expected of what was found, \
                    and what else is left is not known.";
        answer.notes.push(note.into());
    }
    if let Some(gain) = filter_gain {
        match gain {
            Ok(gain) => answer.navigation = Some(gain),
            Err(error) => answer.notes.push(format!("The navigation filter cannot take what was found: {error}")),
        }
    }
    observe(Stage::Done);
    Ok(Diagnosis { answer, augmented, findings: judged.findings, far: None, prepared: None, traces })
}

/// A clock that was set, with the sentence that tells it, as a step of the trail.
fn clock_step((offset, said): (&TimeOffset, &String)) -> Step {
    let subject = format!("{} of {}", offset.channel, offset.recording);
    Step::new(TraceStage::Clocks, &subject, Decision::Estimated, said.as_str())
}

fn is_lattice(library: &Library, id: &str) -> bool {
    library.driving_by_id(id).is_some_and(|e| matches!(e.explanation(), DriveExplanation::WheelLattice))
}

fn measure(
    kept: &Record,
    library: &Library,
    together: &[(String, Parameters)],
    listed: &[(String, Parameters)],
    judged: &Judged,
    options: &FarOptions,
) -> DriveFar {
    let nearest =
        judged.closest.as_ref().map(|(closest, _)| (closest.part.id.clone(), closest.part.parameters.clone()));
    let sought = holdout::Sought { together, listed, nearest: nearest.as_ref() };
    holdout::measure(kept, library, &sought, judged.nominal_noise.process, options)
}

/// Settings of the measurement on `measured`. Without torques the simulator follows filtered speeds, smoother than any
/// robot's, and scores better on its own recordings than on any other: the gap is then measured in pairs.
fn far_options(options: &Options, measured: &Record) -> FarOptions {
    let simulated_logs = options.simulated_logs.min(SIMULATED);
    let in_pairs = measured.torques_n_m.is_none();
    FarOptions { seed: options.seed, simulated_logs, in_pairs, ..FarOptions::default() }
}

/// Place of the effect `id`; with `None`, of the largest free form of the most probable set of unknown cause.
fn place(findings: &Findings, library: &Library, id: Option<&str>) -> Option<Place> {
    match id {
        Some(id) => {
            let part = findings.best_with(id, true).or_else(|| findings.best_with(id, false))?.part(id)?;
            // of several drives the description names the one of that time
            let described = part.time_s.is_some() && !part.description.is_empty();
            let description = described.then(|| part.description.clone());
            let of = if let Some(effect) = library.driving_by_id(id) {
                Place { channel: effect.channel(&part.parameters).into(), ..Place::of(effect.about()) }
            } else {
                let about = library.by_id(id).map(crate::effects::Effect::about);
                let equation = about.map_or("gyro measurement", |a| a.deficient).into();
                Place { channel: "gyro".into(), equation, ..Place::default() }
            };
            Some(Place { time_s: part.time_s, description, ..of })
        }
        None => {
            let set = findings.best_unknown()?;
            let part = set.main()?;
            let description = Some(part.description.clone());
            let of = [VARYING, REFUTED].iter().find_map(|begin| part.id.strip_prefix(begin));
            if let Some(about) = of.and_then(|id| library.driving_by_id(id)).map(Driving::about) {
                return Some(Place { description, ..Place::of(about) });
            }
            let equation = Equation::of_free_form(&part.id);
            let follows = part.id.rsplit('.').next().unwrap_or_default();
            let condition = match follows {
                "turning" => Some("yaw_rate"),
                "torque_rate" | "late" => Some("torque"),
                other => Follows::ALL.iter().map(|f| f.condition()).find(|c| *c == other),
            };
            Some(Place {
                channel: equation.map_or("wheels", Equation::channel).into(),
                equation: equation.map_or("wheel measurement", Equation::words).into(),
                time_s: part.time_s,
                frequency_hz: part.frequency_hz,
                condition: condition.map(Into::into),
                description,
            })
        }
    }
}

/// Effects of `together` that the augmented simulator is to hold. They were fitted beside free forms, which it does not
/// have. Where it predicts the fitted drive worse than the nominal one, the effects with the smallest shares are left
/// out, as many as is best for the prediction.
fn offered(
    record: &Record,
    library: &Library,
    mut together: Vec<(String, Parameters)>,
    process: Process,
    answer: &mut Answer,
) -> Vec<(String, Parameters)> {
    // the gain of a simulator that diverges is not finite
    let gain = |effects: &[(String, Parameters)]| {
        let gain = holdout::gain(record, library, effects, process);
        if gain.is_finite() { gain } else { f64::NEG_INFINITY }
    };
    if together.is_empty() || gain(&together) >= 0.0 {
        return together;
    }
    let share = |one: &(String, Parameters)| {
        let listed = answer.effects.iter().find(|e| e.id == one.0);
        listed.and_then(|e| e.share).unwrap_or(f64::NEG_INFINITY)
    };
    together.sort_by(|a, b| share(b).total_cmp(&share(a)));
    let most = (1..together.len()).map(|n| (gain(&together[..n]), n)).filter(|g| g.0 > 0.0);
    let kept = most.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(0, |g| g.1);
    let left_out = together.split_off(kept);
    let ids: Vec<&str> = left_out.iter().map(|one| one.0.as_str()).collect();
    let ids = ids.join(", ");
    let why = format!(
        "The augmented simulator is without {ids}: what corrects it beside the effects is in no simulator, and with them alone it \
         would predict this very recording worse than the nominal one does."
    );
    answer.trace.push(Step::new(TraceStage::Naming, &ids, Decision::Removed, why.as_str()));
    answer.notes.push(why);
    together
}

/// Merges classes of effects with similar signatures into the classes of rivals in the posterior: of effects that are named,
/// and of the `closest` one to an unknown cause.
fn told_apart(answer: &mut Answer, record: &Record, alike: &[Alike], closest: Option<&str>) {
    for class in &mut answer.alike {
        class.separate_by = separate_by(record, None);
    }
    let told = |id: &String| answer.together.contains(id) || closest == Some(id.as_str());
    for one in alike.iter().filter(|a| a.ids.first().is_some_and(told)) {
        let known = answer.cannot_tell_apart.iter().position(|class| class.first() == one.ids.first());
        let Some(at) = known else {
            answer.cannot_tell_apart.push(one.ids.clone());
            answer.alike.push(one.clone());
            continue;
        };
        let class = &mut answer.cannot_tell_apart[at];
        for id in &one.ids {
            if class.len() < LARGEST && !class.contains(id) {
                class.push(id.clone());
            }
        }
        answer.alike[at] = Alike { ids: class.clone(), ..one.clone() };
    }
}

/// Where the cause is unknown, removes effects from `together` whose coefficient was found not to be constant: beside
/// the part that varies, the constant may have any value.
fn drop_inconstant(answer: &mut Answer, findings: &Findings) {
    if answer.verdict != Verdict::Unknown {
        return;
    }
    let Some(set) = findings.best_unknown() else { return };
    let varies = |id: &String| set.parts.iter().any(|p| p.id.strip_prefix(VARYING) == Some(id));
    let (gone, left): (Vec<String>, Vec<String>) = answer.together.drain(..).partition(varies);
    let why = "its coefficient is not constant, and the cause is unknown: it is not simulated with a constant one";
    answer.trace.extend(gone.iter().map(|id| Step::new(TraceStage::Naming, id, Decision::Removed, why)));
    answer.together = left;
}

/// Removes a random walk of the gyro's bias from `together` unless it is the main effect, and returns a note. A drive
/// is too short to tell it from other slow processes.
fn told_as_wander(answer: &mut Answer) -> Option<String> {
    let walk = in_drives(InDrives::Walk)?.id;
    if answer.main.as_deref() == Some(walk) || !answer.together.iter().any(|id| id == walk) {
        return None;
    }
    answer.together.retain(|id| id != walk);
    let why = "The gyro's bias wanders within the drive, like a walk as large as listed; drives are too short to tell which slow process \
               that is. Diagnose a recording at rest, an hour or longer, to know.";
    answer.trace.push(Step::new(TraceStage::Naming, walk, Decision::Removed, why));
    Some(why.into())
}

/// Index of the effect that explains most alone in the list, appended if it is missing. Unless it was found, its
/// parameters are those of its fit alone: beside free forms that explain the same they say nothing.
fn list_closest(closest: &BestSingleEffect, answer: &mut Answer) -> usize {
    let part = &closest.part;
    let at = answer.effects.iter().position(|e| e.id == part.id).unwrap_or_else(|| {
        answer.effects.push(EffectAnswer::new(&part.id, 0.0));
        answer.effects.len() - 1
    });
    if !answer.together.contains(&part.id) {
        let effect = &mut answer.effects[at];
        (effect.parameters, effect.std) = (part.parameters.clone(), part.std.clone());
    }
    at
}

#[cfg(test)]
mod tests;
