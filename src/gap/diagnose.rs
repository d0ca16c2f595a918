//! The whole diagnosis: which effect, where it shows, how far the gap shrinks.

use super::answer::{Alike, Answer, EffectAnswer, FreeFormAnswer, Metric, Place, Verdict};
use super::believe::believed;
use super::far::{self, Claim, Far};
use super::findings::{Findings, Main};
use super::judge::{Options as JudgeOptions, judge};
use super::prepare::{Prepared, prepare};
use super::state_space::{Believed, blocked_log_score};
use crate::config::{Config, EffectTable};
use crate::effects::{Effect, Library, Parameters};
use crate::error::Result;
use crate::signal::Log;

/// How a diagnosis is made.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Seed of the simulated recordings.
    pub seed: u64,
    /// How hypotheses are compared.
    pub judge: JudgeOptions,
    /// Time since power-on at the first row, s, where the logs' time counts from something else.
    pub since_power_on_s: f64,
    /// Recordings simulated for the floor.
    pub simulated_logs: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { seed: 1, judge: JudgeOptions::default(), since_power_on_s: 0.0, simulated_logs: 8 }
    }
}

/// What a diagnosis comes to.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnosis {
    /// The answer.
    pub answer: Answer,
    /// The nominal simulator with what was found as `[[effect]]` tables.
    pub augmented: Config,
    /// All sets that were compared.
    pub findings: Findings,
    /// The measures on the recording kept back; none without one.
    pub far: Option<Far>,
}

/// Effects less probable than this are not listed.
const LISTED: f64 = 0.01;
/// A rival main effect at least this probable, relative to the main one, cannot be told apart.
const RIVAL: f64 = 0.05;
/// Most effects whose share of the gap is measured one by one.
const MEASURED: usize = 5;

/// Diagnoses `fit` against the nominal simulator `config`, and measures on `hold` how far the gap shrinks.
///
/// # Errors
/// What [`prepare`] refuses of either log; [`crate::ErrorKind::Config`] if the configuration is of a drive or incomplete.
pub fn diagnose(
    config: &Config,
    fit: &Log,
    hold: Option<&Log>,
    library: &Library,
    options: &Options,
) -> Result<Diagnosis> {
    let (prepared, findings, mut answer) = compared(config, fit, library, options)?;
    let found = |id: &String| Some((id.clone(), findings.best_with(id, false)?.part(id)?.parameters.clone()));
    let together: Vec<(String, Parameters)> = answer.together.iter().filter_map(found).collect();
    let listed: Vec<(String, Parameters)> =
        answer.effects.iter().take(MEASURED).map(|e| (e.id.clone(), e.parameters.clone())).collect();
    let far = match hold {
        Some(hold) => {
            let kept = prepare(config, hold, options.since_power_on_s)?;
            other_unit(&prepared, &kept, &mut answer.notes);
            Some(measure(&kept, library, &together, &listed, &answer, options)?)
        }
        None => {
            cross_validate(&prepared, library, &together, &mut answer)?;
            None
        }
    };
    if let Some(far) = &far {
        answer.gap.clone_from(&far.metrics);
        answer.notes.extend(far.notes.iter().cloned());
        for (id, closed) in &far.alone {
            if let Some(effect) = answer.effects.iter_mut().find(|e| e.id == *id) {
                effect.gap_closed = closed.estimate;
                effect.gap_closed_ci95 = closed.ci95;
            }
        }
    }
    let mut augmented = config.clone();
    augmented.effects.extend(together.into_iter().map(|(id, parameters)| EffectTable { id, parameters }));
    if !augmented.effects.is_empty() {
        augmented.provenance = None;
    }
    Ok(Diagnosis { answer, augmented, findings, far })
}

fn compared(config: &Config, fit: &Log, library: &Library, options: &Options) -> Result<(Prepared, Findings, Answer)> {
    let prepared = prepare(config, fit, options.since_power_on_s)?;
    let effects: Vec<&'static dyn Effect> = library.effects().collect();
    let mut findings = judge(&prepared.scene, &prepared.rate_rad_s, &effects, &options.judge);
    findings.notes.splice(0..0, prepared.notes.iter().cloned());
    let answer = answer(&findings, library, &prepared);
    Ok((prepared, findings, answer))
}

/// What the diagnosis of `fit` compares and answers, without measuring how far the gap shrinks: a part of its time.
///
/// # Errors
/// What [`prepare`] refuses; [`crate::ErrorKind::Config`] if the configuration is of a drive or incomplete.
pub fn compare(config: &Config, fit: &Log, library: &Library, options: &Options) -> Result<(Findings, Answer)> {
    compared(config, fit, library, options).map(|(_, findings, answer)| (findings, answer))
}

fn answer(findings: &Findings, library: &Library, prepared: &Prepared) -> Answer {
    let mains = findings.mains();
    let probability = |m: &Main| mains.iter().find(|x| x.0 == *m).map_or(0.0, |x| x.1);
    let (none, unknown) = (probability(&Main::None), probability(&Main::Unknown));
    let rivals: Vec<(String, f64)> = mains
        .iter()
        .filter_map(|(m, p)| match m {
            Main::Effect(id) => Some((id.clone(), *p)),
            _ => None,
        })
        .collect();
    let top = mains.first().map_or(Main::None, |m| m.0.clone());
    let verdict = match &top {
        Main::None => Verdict::None,
        Main::Unknown => Verdict::Unknown,
        Main::Effect(_) => Verdict::Identified,
    };
    let main = match &top {
        Main::Effect(id) => Some(id.clone()),
        _ => None,
    };
    let mut effects = Vec::new();
    let mut free_forms = Vec::new();
    for (id, named, presence) in findings.ids() {
        let as_main = findings.best_with(&id, true).is_some();
        let Some(part) = findings.best_with(&id, as_main).and_then(|s| s.part(&id)) else { continue };
        if named && presence >= LISTED {
            effects.push(EffectAnswer {
                id: id.clone(),
                probability: presence,
                parameters: part.parameters.clone(),
                std: part.std.clone(),
                gap_closed: None,
                gap_closed_ci95: None,
                share: share(findings, &id),
            });
        } else if !named && presence >= LISTED {
            free_forms.push(FreeFormAnswer { id, probability: presence, description: part.description.clone() });
        }
    }
    // the main effect first, whatever its rank by presence
    if let Some(at) = main.as_ref().and_then(|m| effects.iter().position(|e| e.id == *m)) {
        let first = effects.remove(at);
        effects.insert(0, first);
    }
    let mut together = if verdict == Verdict::None { Vec::new() } else { findings.together(main.as_deref()) };
    together.retain(|id| effects.iter().any(|e| e.id == *id));
    if let Some(m) = &main {
        // it comes first, and is one of them
        together.retain(|id| id != m);
        together.insert(0, m.clone());
    }
    let (cannot_tell_apart, alike) = classes(findings, &rivals);
    Answer {
        verdict,
        main_probability: rivals.first().map_or(0.0, |r| r.1),
        none_probability: none,
        unknown_probability: unknown,
        place: place(findings, library, &top, prepared),
        main,
        effects,
        together,
        cannot_tell_apart,
        alike,
        free_forms,
        gap: Vec::new(),
        notes: findings.notes.clone(),
    }
}

/// Share of what the most probable set with the effect closes.
fn share(findings: &Findings, id: &str) -> Option<f64> {
    let set = findings.best_with(id, false)?;
    let total: f64 = set.parts.iter().map(|p| p.share.max(0.0)).sum();
    (total > 0.0).then(|| set.part(id).map_or(0.0, |p| p.share.max(0.0)) / total)
}

/// Main effects between which this recording does not decide, and why.
fn classes(findings: &Findings, rivals: &[(String, f64)]) -> (Vec<Vec<String>>, Vec<Alike>) {
    let Some((first, p)) = rivals.first() else { return Default::default() };
    let class: Vec<String> = rivals.iter().filter(|r| r.1 >= RIVAL * p).take(3).map(|r| r.0.clone()).collect();
    if class.len() < 2 {
        return Default::default();
    }
    let none = findings.sets.iter().find(|s| s.parts.is_empty()).map(|s| s.ln_weight);
    let weight = |id: &String| findings.best_with(id, true).map(|s| s.ln_weight);
    let overlap = class[1..]
        .iter()
        .filter_map(|id| {
            let (a, b) = (weight(first)?, weight(id)?);
            // the share of the evidence that the rival reaches too; evidence is counted from no effect at all
            let base = none.unwrap_or(a.min(b) - 10.0);
            Some(((b - base).max(0.0) / (a - base).max(1e-9)).clamp(0.0, 1.0))
        })
        .fold(1.0, f64::min);
    let separate_by = separate(&class);
    (vec![class.clone()], vec![Alike { ids: class, overlap, separate_by }])
}

fn separate(class: &[String]) -> String {
    let has = |id: &str| class.iter().any(|c| c == id);
    let mut what = Vec::new();
    if has("gyro.temperature_sensitivity") || has("gyro.noise_growth") {
        what.push("a recording in which temperature moves otherwise than with time since power-on: reheated when warm");
    }
    if has("gyro.supply_sensitivity") {
        what.push("a recording in which the supply is stepped by 50 mV or more");
    }
    if has("gyro.rate_random_walk") || has("gyro.gauss_markov") || has("gyro.bias_instability") {
        what.push("a recording four times as long, which shows whether the bias keeps wandering");
    }
    if has("gyro.rate_ramp") || has("gyro.second_time_constant") || has("gyro.bias_step") {
        what.push(
            "a second power-on of the same length: what belongs to the unit repeats, what is drawn anew does not",
        );
    }
    if has("gyro.turn_on_shift") {
        what.push("five or more power-ons: their scatter tells a shifted mean from an unlucky draw");
    }
    if has("gyro.telegraph_noise") {
        what.push("a recording with ten times as many jumps, or a histogram of the smoothed rate");
    }
    if what.is_empty() {
        what.push("a longer recording");
    }
    what.join("; ")
}

fn place(findings: &Findings, library: &Library, top: &Main, prepared: &Prepared) -> Option<Place> {
    let scene = &prepared.scene;
    let nyquist = 0.5 / scene.step_s;
    match top {
        Main::None => None,
        Main::Effect(id) => {
            let about = library.by_id(id)?.about();
            let part = findings.best_with(id, true)?.part(id)?;
            let value = |name: &str| part.parameters.get(name).copied();
            let density = scene.white_std_rad_s * scene.step_s.sqrt();
            let frequency_hz = match id.as_str() {
                "gyro.bandwidth" => value("cutoff_hz").map(|f| [f.min(nyquist), nyquist]),
                // where the walk meets the white noise
                "gyro.rate_random_walk" => {
                    value("rate_random_walk_rad_s_sqrt_s").map(|k| [0.0, k / (std::f64::consts::TAU * density)])
                }
                "gyro.bias_instability" => {
                    value("bias_instability_rad_s").map(|b| [0.0, b * b / (std::f64::consts::TAU * density * density)])
                }
                "gyro.gauss_markov" => value("correlation_time_s").map(|t| [0.0, 1.0 / (std::f64::consts::TAU * t)]),
                _ => part.frequency_hz,
            };
            Some(Place {
                channel: about.channel.into(),
                equation: about.deficient.into(),
                time_s: part.time_s,
                frequency_hz,
                condition: about.condition.map(Into::into),
                description: None,
            })
        }
        Main::Unknown => {
            let set = findings.sets.iter().find(|s| s.main().is_some_and(|m| !m.named))?;
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
    together: &[(String, Parameters)],
    listed: &[(String, Parameters)],
    answer: &Answer,
    options: &Options,
) -> Result<Far> {
    let nominal = Believed::nominal(&kept.scene);
    let augmented = believed(&kept.scene, library, together)?;
    let alone: Vec<(String, Believed)> = listed
        .iter()
        .filter_map(|e| Some((e.0.clone(), believed(&kept.scene, library, std::slice::from_ref(e)).ok()?)))
        .collect();
    let claims: Vec<Claim> = alone.iter().map(|(id, b)| Claim { id, believed: b }).collect();
    let far_options = far::Options {
        seed: options.seed,
        simulated_logs: options.simulated_logs,
        draws: 500,
        whole_log: answer.main.as_deref() == Some("gyro.turn_on_shift"),
        ..far::Options::default()
    };
    far::measure(&kept.rate_rad_s, &nominal, &augmented, &claims, &far_options)
}

/// Without a recording kept back: each block's density given all the others.
fn cross_validate(
    prepared: &Prepared,
    library: &Library,
    together: &[(String, Parameters)],
    answer: &mut Answer,
) -> Result<()> {
    const BLOCKS: usize = 8;
    let rows = prepared.scene.len();
    let blocks: Vec<std::ops::Range<usize>> = (0..BLOCKS).map(|b| b * rows / BLOCKS..(b + 1) * rows / BLOCKS).collect();
    let score = |b: &Believed| -> Result<f64> {
        Ok(blocked_log_score(b, &prepared.rate_rad_s, &blocks)?.iter().sum::<f64>() / rows as f64)
    };
    let nominal = Believed::nominal(&prepared.scene);
    let augmented = believed(&prepared.scene, library, together)?;
    let (before, after) = (score(&nominal)?, score(&augmented)?);
    let own = (0..4).map(|s| blocked_own(&augmented, &blocks, s)).collect::<Result<Vec<f64>>>()?;
    let floor = own.iter().sum::<f64>() / own.len() as f64;
    answer.gap = vec![Metric { metric: "log_score".into(), before, after, floor }];
    answer.notes.push(
        "No recording was kept back: the log score is that of each eighth of this one given the others, with parameters \
         that have seen all of it. Record the unit again to know how far the gap shrinks."
            .into(),
    );
    Ok(())
}

fn blocked_own(b: &Believed, blocks: &[std::ops::Range<usize>], seed: u64) -> Result<f64> {
    let own = b.simulate(seed, 0)?;
    Ok(blocked_log_score(b, &own, blocks)?.iter().sum::<f64>() / own.len() as f64)
}

/// Says so if the recording kept back cannot be of the unit that was diagnosed.
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
            "The recording kept back does not seem to be of the same unit: its noise is {:.2} times that of the one that was \
             diagnosed. What it says of the gap is then not to be relied on.",
            b / a
        ));
    }
    if (fit.scene.step_s / kept.scene.step_s).ln().abs() > 0.01 {
        notes.push(format!(
            "The recordings differ in their sample time: {} s and {} s. White noise is scaled from one to the other.",
            fit.scene.step_s, kept.scene.step_s
        ));
    }
}
