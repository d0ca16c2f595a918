//! Fit of given effects and no others: argmax p(log, θ | effects), with an interval for each parameter
//!
//! The likelihood is the diagnosis's ([`crate::gap::diagnose()`]), without the search over sets. Parameters that are
//! positive by nature have intervals that are symmetric in their logarithm, where the likelihood is close to normal;
//! the others are symmetric about the estimate.

mod chain;
mod interval;
mod rare;

pub(crate) use interval::Estimate;

use super::model_selection::candidates;
use super::nongaussian::quantization;
use super::nongaussian::telegraph::{Start, TelegraphFit, beside};
use super::parts;
use super::prepare::outliers::clean;
use super::prepare::{Prepared, prepare};
use super::whittle::basis::{ColumnId, SpectralBasis};
use super::whittle::evidence::{Fitted, Likelihood, nuisances};
use super::whittle::hypothesis::{Candidate, Hypothesis, Kind};
use super::whittle::lines::Lines;
use crate::config::Config;
use crate::effects::{About, Effect, Explanation, Library};
use crate::error::{Error, ErrorKind, Result};
use crate::gap::asked;
use crate::gap::selection::sets::Part;
use crate::signal::Log;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One effect, fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Explained {
    /// Its identifier.
    pub id: String,
    /// Its gain in the log-likelihood of the recording, nats; a small gain means that the recording hardly shows it.
    pub gain_nats: f64,
    /// Parameters that the recording tells, without form parameters that it tells no better than their default.
    pub parameters: BTreeMap<String, Estimate>,
    /// Interval in which it shows, s; none where it shows all the time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_s: Option<[f64; 2]>,
}

/// Effects fitted together to one recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Explanations {
    /// The effects, in the order asked for; those that the recording does not show are missing, and a note says so.
    pub effects: Vec<Explained>,
    /// Assumptions, and effects that could not be fitted, in sentences.
    pub notes: Vec<String>,
}

/// Least number of cycles of a tone in the recording.
const CYCLES: f64 = 3.0;
/// Rounds in which every signal is fitted anew beside all others.
const ROUNDS: usize = 2;

/// [`crate::gap::explain`] of a recording at rest.
///
/// # Errors
/// As there.
pub(in crate::gap) fn explain(
    config: &Config,
    log: &Log,
    library: &Library,
    ids: &[&str],
    since_power_on_s: f64,
) -> Result<Explanations> {
    let known: Vec<&str> = library.effects().map(|e| e.about().id).collect();
    asked::check("effects", ids, &known, config.kind)?;
    let effects: Vec<_> = ids.iter().filter_map(|id| library.by_id(id)).collect();
    let prepared = prepare(config, log, since_power_on_s)?;
    for effect in &effects {
        if effect.explanation(&prepared.scene).is_none() {
            let found = format!("nothing that {} could follow: it is not logged, or constant", effect.about().id);
            return Err(Error::new(ErrorKind::Column, &log.source, found)
                .hint("log it (temperature_c, supply_v), or leave the effect out"));
        }
    }
    Ok(fit(&prepared, &effects))
}

/// Fits `effects` to a prepared recording.
pub(crate) fn fit(prepared: &Prepared, effects: &[&'static dyn Effect]) -> Explanations {
    let mut notes = prepared.notes.clone();
    let recorded = &prepared.rate_rad_s;
    let mut scene = prepared.scene.clone();
    let nominal = scene.white_std_rad_s;
    let grain = quantization::Grain::of(recorded, nominal);
    let lsb = grain.lsb_rad_s;
    scene.white_std_rad_s = (nominal * nominal + grain.variance()).sqrt();
    let frame = SpectralBasis::new(&scene);
    let deviation: Vec<f64> =
        (0..frame.len()).map(|i| recorded[i] - scene.warm_up.error_rad_s(scene.time.at(i))).collect();
    let (cleaned, aside) = clean(&deviation);
    let frame = frame.resolving(&cleaned);
    let data = frame.data(cleaned);
    let nuisance = nuisances(&frame);

    let asked_for = |wanted: fn(&Explanation) -> bool| {
        effects.iter().find(|e| e.explanation(&frame.scene).as_ref().is_some_and(wanted)).map(|e| e.about().id)
    };
    let two_levels = asked_for(|e| matches!(e, Explanation::TwoLevels));
    let mut all: Vec<Candidate> = candidates(effects, &frame.scene).into_iter().filter(|c| c.named).collect();
    let asked = all.len();
    if two_levels.is_some() {
        // correlated noise holds the place of the two levels at the start
        all.extend(candidates(crate::effects::registry(), &frame.scene).into_iter().find(|c| c.kind.is_exponential()));
    }
    let likelihood = Likelihood::new(&frame, &data, &all, &nuisance);
    let gaussian = together(&likelihood, 0..asked);
    let found = two_levels.and_then(|id| Some((id, levels(&likelihood, &nuisance, &gaussian, asked)?)));

    let mut explained: Vec<Explained> = Vec::new();
    let tell = |l: &Likelihood, fitted: &Fitted| {
        let told =
            parts::parts(l, fitted).into_iter().filter_map(|p| Some(told(library_effect(effects, &p.id)?.about(), &p)));
        (told.collect::<Vec<_>>(), l.whitened(&fitted.hypothesis))
    };
    // the whitened remainder, beside the two levels where they are asked for and found
    let (gaussian_parts, white) = match &found {
        Some((id, (popcorn, gain))) => {
            let left: Vec<f64> = data.values_rad_s.iter().zip(&popcorn.path).map(|(y, p)| y - p).collect();
            let rest = frame.data_undithered(left);
            let beside = Likelihood::new(&frame, &rest, &all, &nuisance);
            explained.extend(two_levels_told(id, &beside, popcorn, &data.values_rad_s, *gain));
            tell(&beside, &popcorn.fitted)
        }
        None => tell(&likelihood, &gaussian),
    };
    explained.extend(gaussian_parts);
    if let Some(id) = asked_for(|e| matches!(e, Explanation::Outliers { .. })) {
        let mut w = white.clone();
        for i in &aside {
            w[*i] += (deviation[*i] - data.values_rad_s[*i]) / frame.scene.white_std_rad_s;
        }
        // samples near the ends hold leakage
        let edge = (w.len() / 400).min(100);
        explained
            .extend(rare::judge(&w[edge..w.len() - edge]).map(|r| outliers_told(id, &r, frame.scene.white_std_rad_s)));
    } else if !aside.is_empty() {
        notes.push(format!("Samples that stand out were put aside before anything else was fitted: {}.", aside.len()));
    }
    let lattice_id = asked_for(|e| matches!(e, Explanation::Lattice));
    if let Some(lsb) = lsb.filter(|_| lattice_id.is_some()) {
        let residual: Vec<f64> = white.iter().map(|v| v * frame.scene.white_std_rad_s).collect();
        let part = parts::lattice(lsb, recorded, quantization::gain(&residual, lsb, nominal, nominal), lattice_id);
        explained.extend(library_effect(effects, &part.id).map(|e| told(e.about(), &part)));
    }
    let place = |id: &str| effects.iter().position(|e| e.about().id == id);
    explained.retain(|e| place(&e.id).is_some());
    explained.sort_by_key(|e| place(&e.id));
    for effect in effects.iter().filter(|e| explained.iter().all(|x| x.id != e.about().id)) {
        notes.push(format!("{}: the recording has no trace of it.", effect.about().id));
    }
    Explanations { effects: explained, notes }
}

fn library_effect(effects: &[&'static dyn Effect], id: &str) -> Option<&'static dyn Effect> {
    effects.iter().copied().find(|e| e.about().id == id)
}

/// Telegraph noise by the recursion over all samples, started from the result of alternating chain and Gaussian part.
fn two_levels_told(
    id: &str,
    beside: &Likelihood,
    popcorn: &TelegraphFit,
    values_rad_s: &[f64],
    gain: f64,
) -> Option<Explained> {
    let (frame, h) = (beside.frame, &popcorn.fitted.hypothesis);
    let scene = &frame.scene;
    let levels = h.white_spectrum(frame, beside.candidates);
    let power: f64 = levels.iter().zip(&frame.bins.count).map(|(s, n)| s * n).sum();
    let white = (power / frame.len().max(1) as f64).sqrt();
    // the Gaussian part without its nuisances: signals at their posterior means, and the estimate of the noises
    let posterior = beside.coefficients(h)?;
    let mut z = vec![0.0; frame.len()];
    let ids = h.signals.iter().flat_map(|s| s.columns.iter());
    ids.zip(&posterior.mean[beside.nuisance.len()..]).for_each(|(id, b)| frame.add_column(&mut z, *id, *b));
    h.offsets().iter().for_each(|id| frame.add_column(&mut z, *id, 1.0));
    if !h.noises.is_empty() {
        let followed = beside.followed(h, &beside.remainder(h));
        z.iter_mut().zip(followed).for_each(|(z, f)| *z += f);
    }
    let known = frame.series(&z);
    let y: Vec<f64> = values_rad_s.iter().zip(&known).map(|(y, k)| (y - k) / white).collect();
    let relative = scene.warm_up_relative_std;
    let stds = [
        relative * scene.warm_up.c1_rad_s.abs(),
        scene.turn_on_bias_std_rad_s,
        relative * scene.warm_up.time_constant_s,
    ];
    let gradient: Vec<[f64; 3]> = (0..frame.len()).map(|i| scene.warm_up.gradient(scene.time.at(i))).collect();
    let column = |j: usize| gradient.iter().map(|g| g[j] * stds[j] / white).collect::<Vec<f64>>();
    let columns: Vec<Vec<f64>> = (0..3).filter(|j| stds[*j] > 0.0).map(column).collect();
    let start = &popcorn.chain;
    let dwell_s = [start.dwell_low, start.dwell_high].map(|d| d * scene.step_s);
    let samples = chain::Beside { y: &y, columns: &columns, white_std_rad_s: white, step_s: scene.step_s };
    let found = samples.fit(start.spacing, dwell_s)?;
    Some(Explained {
        id: id.into(),
        gain_nats: gain,
        parameters: [
            (parts::name(id, 0).into(), found.spacing_rad_s),
            (parts::name(id, 1).into(), found.mean_dwell_s),
            (parts::name(id, 2).into(), found.dwell_ratio),
        ]
        .into(),
        time_s: None,
    })
}

fn outliers_told(id: &str, rare: &rare::Rare, white_std_rad_s: f64) -> Explained {
    let scaled = |e: Estimate| Estimate {
        estimate: e.estimate * white_std_rad_s,
        std: e.std * white_std_rad_s,
        ci95: e.ci95.map(|v| v * white_std_rad_s),
    };
    Explained {
        id: id.into(),
        gain_nats: rare.gain_nats,
        parameters: [(parts::name(id, 0).into(), rare.probability), (parts::name(id, 1).into(), scaled(rare.size))]
            .into(),
        time_s: None,
    }
}

/// An effect as explained, from its part in a set.
pub(crate) fn told(about: &About, part: &Part) -> Explained {
    let one = |(name, value): (&String, &f64)| {
        let std = *part.std.get(name)?;
        let positive = about.parameters.iter().any(|p| p.name == name && p.bounds[0] >= 0.0);
        Some((name.clone(), Estimate::normal(*value, std, positive)))
    };
    Explained {
        id: part.id.clone(),
        gain_nats: part.share,
        parameters: part.parameters.iter().filter_map(one).collect(),
        time_s: part.time_s,
    }
}

/// The candidates `which` fitted together, at their mode.
///
/// A random walk can take up a ramp, and the reverse: the order in which they are added may decide which maximum is
/// reached. Both orders are tried, and the more probable result is taken.
fn together(l: &Likelihood, which: std::ops::Range<usize>) -> Fitted {
    let is_signal = |c: &usize| matches!(l.candidates[*c].kind, Kind::Signal(_) | Kind::Line(..) | Kind::TurnOn);
    let (signals, noises): (Vec<usize>, Vec<usize>) = which.partition(is_signal);
    let climb = |order: &[usize]| {
        let mut h = Hypothesis::default();
        for c in order {
            h = with(l, &h, *c);
        }
        let mut fitted = l.fit(&h);
        if order.len() == 1 && noises.len() == 1 {
            return fitted;
        }
        for _ in 0..ROUNDS {
            let mut h = fitted.hypothesis.clone();
            for c in &signals {
                h = with(l, &h.without(*c), *c);
            }
            let again = l.fit(&h);
            let gained = again.ln_evidence - fitted.ln_evidence;
            if gained > 0.0 {
                fitted = again;
            }
            if gained < 0.05 {
                break;
            }
        }
        fitted
    };
    let first = climb(&[&noises[..], &signals[..]].concat());
    if noises.is_empty() || signals.is_empty() {
        return first;
    }
    let second = climb(&[&signals[..], &noises[..]].concat());
    if second.ln_evidence > first.ln_evidence { second } else { first }
}

/// `h` with `candidate` added at its best start; unchanged where the recording cannot show it.
fn with(l: &Likelihood, h: &Hypothesis, candidate: usize) -> Hypothesis {
    let added = match &l.candidates[candidate].kind {
        Kind::Signal(s) => l.add_signal(h, candidate, s.as_ref()).map(|a| a.0),
        Kind::Noise(_) | Kind::Filter(_) | Kind::Level(_) | Kind::Shape(_) => l.add_noise(h, candidate).map(|a| a.0),
        Kind::Variance(s) => l.add_variance(h, candidate, s.as_ref()).map(|a| a.0),
        Kind::TurnOn => Some(l.add_turn_on(h, candidate).0),
        Kind::Line(s, _) => {
            let w = l.whitened(h);
            let lines = Lines::new(&w, l.frame.scene.step_s);
            lines
                .tone(CYCLES)
                .map(|line| l.add_line(h, candidate, s.as_ref(), &[line.frequency_hz], lines.ln_shape(&line, CYCLES)))
        }
    };
    added.unwrap_or_else(|| h.clone())
}

/// Telegraph noise beside `gaussian`, and its gain in ln evidence, nats; the candidate `noise` holds its place at the
/// start.
fn levels(
    l: &Likelihood,
    nuisance: &[(ColumnId, f64)],
    gaussian: &Fitted,
    noise: usize,
) -> Option<(TelegraphFit, f64)> {
    let base = &gaussian.hypothesis;
    let whole = l.fit(&l.add_noise(base, noise)?.0).hypothesis;
    let theta = whole.noises.iter().find(|n| n.candidate == noise)?.ln_theta.clone();
    let start = Start { spacing_rad_s: 2.0 * theta[1].exp(), mean_dwell_s: 2.0 * theta[0].exp(), coarse: false };
    let found = beside(l.frame, l.data, l.candidates, nuisance, base, &whole, start)?;
    let gain = found.ln_evidence - gaussian.ln_evidence;
    Some((found, gain))
}
