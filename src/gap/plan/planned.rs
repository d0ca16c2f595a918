//! The plan: what is in question, and experiments by what they are worth.

use super::at_rest::{self, Like, RECORDINGS};
use super::courses::{COURSES, Limits};
use super::drives::{self, Drives};
use super::inputs::{Reference, has_torques, of_track};
use super::rivals::{Rival, fitted, in_question};
use super::worth::{Command, Pair, likely_nats, worth};
use crate::config::{Config, Kind};
use crate::effects::Library;
use crate::error::{Error, ErrorKind, Result, one_of};
use crate::gap::answer::Answer;
use crate::signal::Log;
use crate::units::duration_text;
use rayon::prelude::*;
use serde::Serialize;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Lengths of a course that follow from that of the log, s.
const LENGTHS_S: [f64; 2] = [30.0, 300.0];
/// Longest course that is planned unasked, and longest that is worth a word, s.
const LONGEST_S: [f64; 2] = [600.0, 3600.0];
/// Most courses that are planned again, longer.
const LENGTHENED: usize = 4;
/// Name of the experiment that repeats the log.
const AGAIN: &str = "again";
/// End of the name of a course whose marks are a reference.
const MARKED: &str = "_marked";
/// How marks get into a log.
const MARKS: &str = "Write x_m, y_m and heading_rad of the mark, full turns counted, into the row in which it stands there, and nothing elsewhere.";

/// End of the name of a course on which the torques of the wheels are logged beside what the log has.
const TORQUES: &str = "_torques";
/// How torques get into a log.
const MOTORS: &str = "Log torque_left_n_m and torque_right_n_m too: current of the motor times its torque constant and the gear's ratio.";

/// Settings of a plan.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Options {
    /// Ids of the effects to tell apart; empty: those that the answer cannot tell apart.
    pub among: Vec<String>,
    /// Names of the experiments to compare; empty: all.
    pub experiments: Vec<String>,
    /// Least length of a course, s; none: that of the log, within half a minute and five; where no course of it tells, also that of
    /// the course that tells soonest, up to ten minutes.
    pub duration_s: Option<f64>,
    /// Seed of the simulated recordings.
    pub seed: u64,
    /// Time since power-on at the first row of a drive, s, where the log does not hold it.
    pub since_power_on_s: f64,
}

/// Effects that a log cannot tell apart, and the experiments that would.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// Effects that the log cannot tell apart and gives a size; without one there is nothing to plan.
    pub rivals: Vec<Rival>,
    /// Evidence from which on a diagnosis tells two of them apart, nats.
    pub resolution_nats: f64,
    /// Known load in the log, which the robot carries in every experiment too, kg.
    pub load_kg: f64,
    /// Experiments, the best first.
    pub experiments: Vec<Suggestion>,
    /// Where no experiment tells all of them apart: what would be needed, a sentence.
    pub needed: Option<String>,
    /// Remarks, in sentences.
    pub notes: Vec<String>,
}

/// An experiment and what it is worth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Suggestion {
    /// Its name.
    pub name: String,
    /// How to do it, in sentences.
    pub how: String,
    /// How long it lasts, s.
    pub duration_s: f64,
    /// Known load that the robot carries, kg, with which its log is diagnosed ([`crate::gap::Drive::load_kg`]); none without one.
    pub load_kg: Option<f64>,
    /// Whether its log is diagnosed by itself, and not together with the given one.
    pub alone: bool,
    /// Whether it tells every rival from every other one, whichever is at work.
    pub separates: bool,
    /// Least evidence of a truth over a rival to be expected, nats.
    pub nats: f64,
    /// Least probability that a diagnosis tells a truth from a rival.
    pub probability: f64,
    /// Every truth against every rival.
    pub pairs: Vec<Pair>,
    /// Largest evidence of a truth over no effect to be expected, nats; infinite at rest, and where no size matters.
    #[serde(skip)]
    pub shown_nats: f64,
    /// Course as a robot is commanded; empty at rest, and where the log's own inputs are repeated.
    pub commands: Vec<Command>,
    /// Course as a log that a simulator follows ([`crate::simulate::replay_with`], [`crate::simulate::stationary_like`]).
    #[serde(skip)]
    pub inputs: Log,
}

/// An experiment before it is judged.
struct Experiment {
    name: String,
    how: String,
    load_kg: Option<f64>,
    alone: bool,
    commands: Vec<Command>,
    inputs: Log,
}

impl Plan {
    /// The first experiment, if it tells all rivals apart.
    #[must_use]
    pub fn first(&self) -> Option<&Suggestion> {
        self.experiments.first().filter(|e| e.separates)
    }
}

/// Experiments that would tell apart what `log` leaves open against `config`: the effects that `answer`, the diagnosis of the log, cannot tell
/// apart, or those of `options`. `observe` is told how many experiments are judged, and of how many.
///
/// # Errors
/// Those of the fits, simulations and comparisons; [`ErrorKind::Usage`] for effects and experiments that are unknown or no rivals;
/// [`ErrorKind::Value`] for a drive in which the robot stands.
pub fn plan(
    config: &Config,
    log: &Log,
    answer: Option<&Answer>,
    library: &Library,
    options: &Options,
    observe: &(dyn Fn(usize, usize) + Sync),
) -> Result<Plan> {
    let driving = config.kind == Kind::Driving;
    let (ids, beside) = in_question(answer, &options.among, library, config.kind)?;
    let resolution_nats = if driving { drives::resolution() } else { at_rest::resolution() };
    let carried_kg = config.vehicle.map_or(0.0, |v| v.load_kg);
    let mut plan = Plan {
        rivals: Vec::new(),
        resolution_nats,
        load_kg: carried_kg,
        experiments: Vec::new(),
        needed: None,
        notes: Vec::new(),
    };
    let mut experiments = experiments(config, log, options)?;
    if ids.len() < 2 {
        return Ok(plan);
    }
    let (rivals, hidden) = fitted((config, log, options.since_power_on_s), library, &ids, &beside)?;
    plan.rivals = rivals;
    let lost = ids.iter().filter(|id| plan.rivals.iter().all(|r| r.id != **id));
    plan.notes.extend(lost.map(|id| match hidden.contains(id) {
        true => format!("The log does not show {id}: only experiments that log more count it among the rivals."),
        false => format!("{id} is left out: the log gives it no size in the place of the others."),
    }));
    if plan.rivals.is_empty() || plan.rivals.len() + hidden.len() < 2 {
        return Ok(plan);
    }
    if plan.rivals.len() < 2 {
        experiments.retain(|e| e.alone);
    }
    let of_drives = driving
        .then(|| Drives::new(config, log, library, (&plan.rivals, hidden), (options.seed, options.since_power_on_s)))
        .transpose()?;
    let judge = |one: Experiment| -> Result<(usize, Suggestion)> {
        let (pairs, shown_nats) = match &of_drives {
            Some(drives) => drives.pairs(&one.inputs, one.load_kg.unwrap_or(0.0), one.alone)?,
            None => (at_rest::pairs(config, &one.inputs, library, &plan.rivals, options.seed)?, f64::INFINITY),
        };
        let (told, nats) = worth(&pairs, resolution_nats);
        let suggestion = Suggestion {
            name: one.name,
            how: one.how,
            duration_s: one.inputs.time.span_s(),
            load_kg: Some(carried_kg + one.load_kg.unwrap_or(0.0)).filter(|kg| *kg > 0.0),
            alone: one.alone,
            separates: told == pairs.len(),
            nats,
            probability: pairs.iter().map(|p| p.probability).fold(1.0, f64::min),
            pairs,
            shown_nats,
            commands: one.commands,
            inputs: one.inputs,
        };
        Ok((told, suggestion))
    };
    let judged = |all: Vec<Experiment>| {
        let (done, of) = (AtomicUsize::new(0), all.len());
        observe(0, of);
        let one = |one| {
            let judged = judge(one);
            observe(done.fetch_add(1, Ordering::Relaxed) + 1, of);
            judged
        };
        all.into_par_iter().map(one).collect::<Result<Vec<_>>>()
    };
    // sensors that the robot may not have are asked for only where its own do not tell
    let is_more = |e: &Experiment| has_torques(&e.inputs) && !has_torques(log);
    let is_asked = |e: &Experiment| !is_more(e) || !options.experiments.is_empty();
    let (own, more) = experiments.into_iter().partition(is_asked);
    let mut suggestions: Vec<(usize, Suggestion)> = Vec::new();
    for stage in [own, more] {
        if suggestions.iter().any(|(_, e)| e.separates) {
            break;
        }
        suggestions.extend(judged(stage)?);
        for _ in 0..if driving && options.duration_s.is_none() { LENGTHENED } else { 0 } {
            let told = suggestions.iter().map(|s| &s.1);
            let Some((name, lasts_s)) = soonest(told, resolution_nats, LONGEST_S[0]) else { break };
            let experiments = vec![name.to_owned()];
            let options = Options { duration_s: Some(lasts_s), experiments, ..options.clone() };
            suggestions.extend(judged(self::experiments(config, log, &options)?)?);
        }
    }
    suggestions.sort_by(|(told_a, a), (told_b, b)| told_b.cmp(told_a).then(b.nats.total_cmp(&a.nats)));
    let tried = suggestions.iter().any(|(_, e)| has_torques(&e.inputs));
    let lacking = of_drives.as_ref().map(|drives| drives.lacking(tried)).transpose()?;
    plan.experiments = suggestions.into_iter().map(|s| s.1).collect();
    if plan.first().is_none() {
        plan.needed = Some(needed(&plan.experiments, resolution_nats, lacking.as_deref()));
    }
    Ok(plan)
}

/// Where no experiment separates, the course that would in the shortest time, and that time, s, if it is at most `longest_s`. Evidence
/// grows with the length of a course, or faster; a course that was judged at several lengths counts with the longest.
fn soonest<'a>(
    experiments: impl Iterator<Item = &'a Suggestion> + Clone,
    resolution_nats: f64,
    longest_s: f64,
) -> Option<(&'a str, f64)> {
    let wanted_nats = likely_nats(resolution_nats);
    let lasts_s = |e: &Suggestion| e.duration_s * wanted_nats / e.nats;
    let longest = |e: &Suggestion| experiments.clone().all(|o| o.name != e.name || o.duration_s <= e.duration_s);
    let tells = |e: &&Suggestion| e.name != AGAIN && e.nats > 0.0 && lasts_s(e) <= longest_s && longest(e);
    if experiments.clone().any(|e| e.separates) {
        return None;
    }
    let first = experiments.clone().filter(tells).min_by(|a, b| lasts_s(a).total_cmp(&lasts_s(b)))?;
    Some((&first.name, lasts_s(first)))
}

/// Sentences on what is needed where no experiment tells rivals apart; `lacking`: channels that a drive lacks, none at rest.
fn needed(experiments: &[Suggestion], resolution_nats: f64, lacking: Option<&[&str]>) -> String {
    if let (Some(_), Some((name, lasts_s))) = (lacking, soonest(experiments.iter(), resolution_nats, LONGEST_S[1])) {
        return format!("The course that tells soonest is {name}: plan courses of {}.", duration_text(lasts_s));
    }
    if experiments.iter().all(|e| e.shown_nats < resolution_nats) {
        return "As large as this log has them, none of them shows in an experiment of this length: plan longer ones, or start from a log \
                that shows one."
            .into();
    }
    match lacking {
        None => "A recording at rest shows them alike: several power-ons, or a drive, would have to tell them apart.".into(),
        Some([]) => {
            "The sensors of this log read them alike on every course: measure one of them by itself, as its remedy says.".into()
        }
        Some(channels) => format!("Log {} beside what this log has, and plan again.", channels.join(", or ")),
    }
}

/// The experiments that `options` asks for.
///
/// # Errors
/// [`ErrorKind::Usage`] for one that is unknown; [`ErrorKind::Value`] for a drive in which the robot stands.
fn experiments(config: &Config, log: &Log, options: &Options) -> Result<Vec<Experiment>> {
    let mut all = match config.kind {
        Kind::Stationary => of_rest(config, log)?,
        Kind::Driving => of_drives(config, log, options)?,
    };
    let known: Vec<String> = all.iter().map(|e| e.name.clone()).collect();
    if let Some(unknown) = options.experiments.iter().find(|name| !known.contains(name)) {
        let known: Vec<&str> = known.iter().map(String::as_str).collect();
        return Err(Error::new(
            ErrorKind::Usage,
            "experiments",
            format!("no experiment for this log is called {unknown:?}"),
        )
        .hint(one_of(unknown, &known)));
    }
    all.retain(|e| options.experiments.is_empty() || options.experiments.contains(&e.name));
    Ok(all)
}

fn of_rest(config: &Config, log: &Log) -> Result<Vec<Experiment>> {
    let like = Like::of(log, config.require_gyro()?.warm_up().time_constant_s);
    let one = |recording: &at_rest::Recording| {
        let inputs = recording.inputs(&like)?;
        Ok(Experiment {
            name: recording.name.into(),
            how: recording.how.into(),
            load_kg: None,
            alone: true,
            commands: Vec::new(),
            inputs,
        })
    };
    RECORDINGS.iter().map(one).collect()
}

fn of_drives(config: &Config, log: &Log, options: &Options) -> Result<Vec<Experiment>> {
    let encoder = config.require_encoder()?;
    let step_s = log.time.median_step_s();
    let noise_rad_s = encoder.speed_variance_rad2_s2(step_s).sqrt();
    let vehicle = config.require_vehicle()?;
    let limits = Limits::of(vehicle, log, encoder.tick_rad(), noise_rad_s)?;
    let duration_s = options.duration_s.unwrap_or_else(|| log.time.span_s().clamp(LENGTHS_S[0], LENGTHS_S[1]));
    let reference = Reference::of(log);
    let again = "Drive the course of this log once more.";
    let mut all = vec![Experiment {
        name: AGAIN.into(),
        how: again.into(),
        load_kg: None,
        alone: false,
        commands: Vec::new(),
        inputs: log.clone(),
    }];
    for course in &COURSES {
        let track = course.track(limits, duration_s);
        let commands = track.commands();
        let load_kg = course.load_kg(vehicle.mass_kg);
        let loaded = config.carrying(load_kg.unwrap_or(0.0));
        let marked = (reference == Reference::None && !course.marked.is_empty()).then_some(Reference::Marks);
        let references = std::iter::once(reference).chain(marked);
        let logged = references.flat_map(|r| [false, true].map(|torques| (r, torques)));
        for (reference, torques) in logged.filter(|(_, torques)| !(*torques && has_torques(log))) {
            let marks = reference == Reference::Marks;
            let (mut name, mut how) = (course.name.to_owned(), course.how.to_owned());
            let mut add = |end: &str, sentences: &[&str]| {
                name.push_str(end);
                sentences.iter().for_each(|one| how.extend([" ", one]));
            };
            if marks {
                add(MARKED, &[course.marked, MARKS]);
            }
            if torques {
                add(TORQUES, &[MOTORS]);
            }
            if let Some(load_kg) = load_kg {
                add("", &[&format!("The load is {} kg.", vehicle.load_kg + load_kg)]);
            }
            let inputs = of_track(&loaded, &track, log, (reference, torques))?;
            let (alone, commands) = (marks || torques, commands.clone());
            all.push(Experiment { name, how, load_kg, alone, commands, inputs });
        }
    }
    Ok(all)
}
