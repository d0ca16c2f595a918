//! Comparison for one drive: which sets of effects and free forms explain it, their probabilities, and their shares.
//!
//! Order: quantization of the wheels; diffusion of the speeds where there are no torques; a start for strongly
//! nonlinear changes, and in a large gap the effects that explain most, each alone; the comparison of sets, outliers,
//! noise levels. Then the same with the lost ticks of one wheel restored, and with the readings of wheels or gyro moved
//! to their true times, if that looks worth it.

use super::fit::Compared;
use super::fit::begin::{first, start};
use super::preprocess::acceleration_model;
use super::preprocess::changepoint;

use super::preprocess::hypothesis::PreprocessingHypothesis;
use super::preprocess::lost_ticks::missed_part;
use super::preprocess::noise_levels::lattice_part;
use super::preprocess::reference_extrinsics;
use super::preprocess::reference_extrinsics::Mounting;
use super::preprocess::restored::{restored, restored_at_once};
use super::preprocess::sensor_offset::{SensorOffset, in_time, moved_at_once};
use super::preprocess::wheel_offset;
use super::preprocess::wheel_offset::WheelOffset;
use super::record::Record;
use super::regressors::candidates::{Candidates, knowable};
use super::regressors::common_delay;
use super::regressors::practical_identifiability::alike;
use super::regressors::structural_identifiability::StructuralClasses;
use super::screening::best_single_effect::{BestSingleEffect, closest};
use super::trail::{self, Way};
use crate::effects::About;
use crate::effects::drive::{self, DriveExplanation, Driving};
use crate::gap::answer::Alike;
use crate::gap::drive::ekf::noise::Noise;
use crate::gap::drive::ekf::unknown_input;
use crate::gap::drive::fit::models_at;
use crate::gap::drive::options::{HOPELESS, LARGE, Options};
use crate::gap::drive::preprocess::initial_noise::{InitialNoise, diffused, rediffused};
use crate::gap::drive::preprocess::settle::settled;
use crate::gap::selection::findings::Findings;
use crate::gap::selection::leave_out::{LeftOut, tell};
use crate::gap::selection::sets::{Main, Part, WeightedSet};
use crate::gap::trace::{self, Decision, Step, TraceStage};
use crate::model::drive::Instrument;

/// Result of the comparison for one drive.
#[derive(Debug, Clone)]
pub(crate) struct Judged {
    /// Sets with their probabilities.
    pub findings: Findings,
    /// Where no effect explains most, or noise is not as stated: the effect that explains most alone, and its share of
    /// what the best set explains, 0 to 1; else none.
    pub closest: Option<(BestSingleEffect, f64)>,
    /// Whether the cause is unknown: no effect explains most.
    pub unknown: bool,
    /// Whether the noise of wheels and gyro is as stated; it is estimated only without torques. Noise that is not as
    /// stated is seldom white: the evidence then counts more readings than are independent.
    pub as_stated: bool,
    /// Delay of the wheels' readings, s, where moving them explains the drive better; else none.
    pub wheels_late_s: Option<f64>,
    /// Classes of effects that this drive cannot tell apart, independent of chance in the readings.
    pub alike: Vec<Alike>,
    /// Noise that the nominal filter assumes; without torques, with the estimated diffusion of the speeds and noise of
    /// wheels and gyro.
    pub nominal_noise: Noise,
}

/// ln of the ratio of two quantization steps up to which they are the same.
pub(crate) const SAME_STEP: f64 = 0.01;
/// Most searches for a delay of the wheels, each with the model found so far.
const SETTLING: usize = 5;

/// Mounting of the reference on the robot, where the configuration leaves it open; else none.
#[must_use]
pub(crate) fn mounting(record: &Record, effects: &[&'static dyn Driving], options: &Options) -> Option<Mounting> {
    // the diffusion takes many passes to estimate: not done where the mounting is known
    if !reference_extrinsics::is_open(record) {
        return None;
    }
    reference_extrinsics::find(record, &InitialNoise::of(record).nominal, effects, &options.prior)
}

/// Compares sets of `effects` and free forms on `record`. A free form is told only where one stands with the motion as an
/// unknown input too.
#[must_use]
pub(crate) fn judge(record: &Record, effects: &[&'static dyn Driving], options: &Options) -> Judged {
    let mut judged = judge_as_predicted(record, effects, options);
    let lacks_a_name = |judged: &Judged| {
        let best = judged.findings.sets.first();
        judged.unknown || best.is_some_and(|set| set.parts.iter().any(|part| !part.named))
    };
    if let Some(record) = lacks_a_name(&judged).then(|| unknown_input::assumed(record)).flatten() {
        let mut other = judge_as_predicted(&record, effects, options);
        let named = !lacks_a_name(&other);
        if named {
            std::mem::swap(&mut judged, &mut other);
        }
        judged.findings.trace.push(trail::unknown_input(named));
    }
    judged
}

/// The same, the motion before each row predicting it as far as `record` believes.
fn judge_as_predicted(record: &Record, effects: &[&'static dyn Driving], options: &Options) -> Judged {
    let twins = StructuralClasses::of(record, effects);
    let effects = &twins.told_apart;
    let InitialNoise { lsb, noise, nominal } = InitialNoise::of(record);
    let onsets_s = changepoint::of_each(record);
    let all = Candidates::new(record, effects, &options.prior, true, &onsets_s);
    let (noise, _) = diffused(record, noise, &all);
    let begin = start(record, &noise, &all);
    let loses = effects.iter().find(|e| e.tick_loss().is_some());
    let at_once = loses.and_then(|_| restored_at_once(record, &all, &begin, &noise, effects, options));
    // a drive that is explained with its lost ticks restored is not fitted as recorded where that falls short by far
    let told = at_once.and_then(|told| {
        let compared = Compared::wide(record, &noise, all.clone(), begin.clone());
        (told.0.top() > compared.top() + HOPELESS).then_some((compared, told))
    });
    // neither is one that is explained with its gyro or its wheels some rows earlier
    let moved = match told {
        None => moved_at_once(record, (&all, &begin), &noise, effects, options),
        Some(_) => None,
    };
    let is_told = told.is_some() || moved.is_some();
    let (compared, at_once, moved) = match (told, moved) {
        (Some((compared, told)), _) => (compared, Some(told), None),
        (None, Some((moved, compared))) => (compared, None, Some(moved)),
        (None, None) => (first(record, &noise, all, &begin), None, None),
    };
    let screened = trail::screened(&compared);
    let branch = if is_told {
        PreprocessingHypothesis::new(record.clone(), noise, compared, onsets_s)
    } else {
        settled(record, noise, compared, onsets_s, effects, options)
    };
    // share of the quantization: gain over the same model with the nominal noise of the wheels
    let given = record.given.wheel_lsb_rad_s;
    let lattice = lsb.filter(|lsb| given.is_none_or(|given| (lsb / given).ln().abs() > SAME_STEP)).map(|lsb| {
        let told = at_once.as_ref().map(|(other, _)| other).or(moved.as_ref().map(|m| &m.branch));
        let way = told.unwrap_or(&branch);
        let nominal = way.noise.without_lattice(record);
        let here = way.ln_likelihood(&way.noise) - way.ln_likelihood(&nominal);
        let named = effects.iter().find(|e| matches!(e.explanation(), DriveExplanation::WheelLattice));
        lattice_part(lsb, here.max(1.0), named.map(|e| e.about()))
    });
    let in_time = if is_told { moved.into_iter().collect() } else { in_time(record, &branch, effects, options) };
    let top = in_time.iter().map(SensorOffset::top).fold(branch.top(), f64::max);
    let mut others = Vec::new();
    let as_recorded = if is_told {
        Err(
            "not fitted: where its model begins it falls short by far of the drive as read below, which named effects explain",
        )
    } else {
        Ok(branch.top())
    };
    let mut ways = vec![Way { name: "as recorded".into(), top: as_recorded }];
    let not_tried =
        "not tried: named effects explain the drive as read in another way, and as recorded it falls short by far";
    let mut lost =
        Err(if is_told { not_tried } else { "there are no bursts worth a look, or their account falls short by far" });
    if let Some(loses) = loses
        && let Some((other, bursts)) =
            if is_told { at_once } else { restored(record, (&branch, top), &begin, &noise, effects, options) }
    {
        lost = Ok(other.top());
        let gained = other.top() - branch.top();
        let part = Part { missed_nats: Some(gained - options.prior.ln_named), ..missed_part(*loses, &bursts, gained) };
        others.push((other, part));
    }
    ways.extend(loses.map(|_| Way { name: "lost ticks restored".into(), top: lost }));
    let late_wheels = drive::late(effects, Instrument::Wheels);
    let mut wheels_late_s = None;
    if !record.wheels_were_set
        && !is_told
        && let Some((other, late)) = wheels_in_time(record, &branch, effects, options)
    {
        let part = late.part(other.top() - branch.top(), late_wheels);
        ways.push(Way { name: format!("wheels {:.4} s earlier", late.delay_s), top: Ok(other.top()) });
        others.push((other, part));
        wheels_late_s = Some(late.delay_s);
    } else {
        let why = if record.wheels_were_set {
            "not tried: the clock of the wheels was set before"
        } else if is_told {
            not_tried
        } else {
            "no delay gains as much as a large gap holds, or no set with it is better"
        };
        ways.push(Way { name: "late wheels put back in time".into(), top: Err(why) });
    }
    let mut sets = branch.sets();
    sets.extend(in_time.iter().flat_map(|i| i.sets(branch.top())));
    for (other, part) in &others {
        sets.extend(other.sets().into_iter().map(|set| beside(set, part, late_wheels)));
    }
    let name = |i: &SensorOffset| {
        let of = if i.of == Instrument::Gyro { "gyro" } else { "wheels" };
        format!("{of} {:.4} s earlier", i.lag_s)
    };
    ways.extend(in_time.iter().map(|i| Way { name: name(i), top: Ok(i.top()) }));
    let logged = [
        (true, Instrument::Wheels),
        (record.gyro_rad_s.is_some(), Instrument::Gyro),
        (record.pose.is_some(), Instrument::Pose),
    ];
    let sensors: Vec<&About> = logged.iter().filter(|l| l.0).filter_map(|l| drive::late(effects, l.1)).collect();
    let torques = record.torques_n_m.is_some();
    sets = sets.into_iter().map(|set| common_delay::without_common(set, &sensors, torques, &options.prior)).collect();
    let readings = trail::readings(&ways);
    let mut trace: Vec<Step> = trace::of_notes(&record.notes).chain(twins.steps()).collect();
    trace.extend(
        unknowable(record, effects).map(|id| {
            Step::new(TraceStage::Screening, id, Decision::Removed, "the channels of this log cannot show it")
        }),
    );
    trace.extend(lattice.iter().map(|part| {
        let step = Step::new(TraceStage::Readings, &part.id, Decision::Estimated, part.description.as_str());
        step.nats(part.share)
    }));
    // the interpretation that explains the drive best
    let others = others.iter().map(|o| &o.0).chain(in_time.iter().map(|i| &i.branch));
    let best = others.fold(&branch, |best, other| if other.top() > best.top() { other } else { best });
    let levels = best.levels.iter().map(|l| LeftOut::new(l.about.id, l.margin, options.prior.ln_named));
    let left_out: Vec<LeftOut> = best.left_out.iter().cloned().chain(levels).collect();
    for set in &mut sets {
        set.parts.extend(lattice.iter().cloned());
        tell(&mut set.parts, &left_out);
    }
    let sets = sets.into_iter().flat_map(|set| twins.all(set, &options.prior)).collect();
    let mut findings = Findings::new(sets, &options.prior, &options.calibration, record.notes.clone());
    trace.extend(screened);
    trace.extend(best.trace.iter().cloned().chain(readings));
    trace.extend(trail::torque_bandwidth(best).chain(trail::promising(best)));
    trace.extend(trail::added(&best.compared));
    findings.trace = trace;
    let unknown = findings.top() == Main::Unknown;
    let as_stated = record.torques_n_m.is_some() || acceleration_model::is_as_stated(record, &best.noise);
    let nearest = if unknown || !as_stated { closest(&best.record, &best.noise, effects, options) } else { None };
    let closest = nearest.map(|(one, nothing)| {
        let c = &best.compared;
        let explained = c.problem.ln_evidence(&c.sets[0].fitted) - nothing;
        let share = if explained > 0.0 { (one.gain / explained).clamp(0.0, 1.0) } else { 0.0 };
        (BestSingleEffect { part: twins.plausible(one.part), ..one }, share)
    });
    let mut alike = alike(&best.record, &best.compared);
    let mut classes = findings.sets.first().map_or_else(Vec::new, |set| twins.classes(&set.parts));
    if classes.is_empty() {
        classes.extend(closest.iter().flat_map(|c| twins.classes(std::slice::from_ref(&c.0.part))));
    }
    alike.extend(classes);
    let nominal_noise = best.noise.nominal_beside(&nominal, record);
    Judged { findings, closest, unknown, as_stated, wheels_late_s, alike, nominal_noise }
}

/// The drive with the readings of its wheels moved earlier by their delay; none where they are not late.
fn wheels_in_time(
    record: &Record,
    as_is: &PreprocessingHypothesis,
    effects: &[&'static dyn Driving],
    options: &Options,
) -> Option<(PreprocessingHypothesis, WheelOffset)> {
    let zero = as_is.compared.candidates.zero();
    // with the believed noise: what was found since may have absorbed the delay
    let nominal = models_at(record, &as_is.compared.candidates, &zero);
    // where one effect explains all, a delay must explain as much, or is superfluous
    let worth = if as_is.is_told_by_one() { as_is.compared.gap().max(LARGE) } else { LARGE };
    let mut late = wheel_offset::find(record, &nominal, &as_is.believed).filter(|l| l.gain > worth)?;
    let mut found = None;
    // the delay is searched again with the model and noise found so far
    for _ in 0..SETTLING {
        let moved = wheel_offset::put_back(record, late.delay_s);
        let all = Candidates::new(&moved, effects, &options.prior, true, &[]);
        let (noise, nearest) = rediffused(&moved, &as_is.believed, &all);
        let begin = start(&moved, &noise, &all);
        let compared = first(&moved, &noise, all, &begin);
        let mut other = settled(&moved, noise, compared, Vec::new(), effects, options);
        other.extra_weight += options.prior.ln_free - 0.5 * (record.len() as f64).ln();
        // a free form may hold an effect that these models lack: the effect fitted alone is tried too
        let models = models_at(record, &other.compared.candidates, &other.compared.theta);
        let known = nearest.into_iter().map(|models| (models, noise)).chain([(models, other.noise)]);
        let looks = known.filter_map(|(models, noise)| wheel_offset::find(record, &models, &noise));
        let again = looks.max_by(|a, b| a.ln_likelihood.total_cmp(&b.ln_likelihood));
        found = Some((other, WheelOffset { std_s: again.map_or(late.std_s, |a| a.std_s), ..late }));
        match again {
            Some(again) if (again.delay_s - late.delay_s).abs() > again.std_s => late = again,
            _ => break,
        }
    }
    found.filter(|(other, _)| other.top() > as_is.top())
}

/// A set with one more part. A part of the same delay, `late`, in the set is the rest after the readings were moved, and
/// is added to it.
fn beside(mut set: WeightedSet, part: &Part, late: Option<&About>) -> WeightedSet {
    let mut part = part.clone();
    let same = |p: &Part| p.id == part.id && late.is_some_and(|late| part.id == late.id);
    if let Some(at) = set.parts.iter().position(same) {
        let left = set.parts.swap_remove(at);
        part.share += left.share;
        for (name, value) in &left.parameters {
            *part.parameters.entry(name.clone()).or_insert(0.0) += value;
        }
    }
    set.parts.push(part);
    set
}

/// Ids of the effects of the library that this drive cannot show.
pub(crate) fn unknowable<'a>(
    record: &'a Record,
    effects: &'a [&'static dyn Driving],
) -> impl Iterator<Item = &'static str> + 'a {
    effects.iter().filter(|e| !knowable(**e, record)).map(|e| e.about().id)
}
