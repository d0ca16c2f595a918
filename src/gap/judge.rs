//! The comparison of one recording's hypotheses, Gaussian part and the rest together.

use super::calibration::Calibration;
use super::clean::clean;
use super::evidence::{Fitted, Likelihood, nuisances};
use super::findings::{Findings, Part, WeightedSet};
use super::frame::{Data, Frame};
use super::free::{Comb, CovariateForm, Follows, FreeSpectrum, RateForm, Resonance, SmoothTime, WhiteLevel};
use super::hypothesis::{Candidate, Hypothesis, Kind};
use super::layers::{amplitude, bursts, events, lattice, repeats, shots, track};
use super::parts::parts;
use super::popcorn::{Popcorn, beside};
use super::search::{Met, Prior, Search, whitened};
use crate::effects::{Effect, Explanation};
use crate::model::Scene;

/// Candidates in one scene: the effects that it can show, and the free forms.
pub fn candidates(effects: &[&'static dyn Effect], scene: &Scene) -> Vec<Candidate> {
    let mut all = Vec::new();
    for effect in effects {
        let id = effect.about().id.to_owned();
        let kind = match effect.explanation(scene) {
            Some(Explanation::Signal(s)) if id == "gyro.tone" => Kind::Line(s, 1),
            Some(Explanation::Signal(s)) => Kind::Signal(s),
            Some(Explanation::Noise(n)) => Kind::Noise(n),
            Some(Explanation::Filter(n)) => Kind::Filter(n),
            Some(Explanation::Variance(s)) => Kind::Variance(s),
            Some(Explanation::TurnOn) => Kind::TurnOn,
            _ => continue,
        };
        all.push(Candidate { id, named: true, kind });
    }
    let mut free = |id: &str, kind: Kind| all.push(Candidate { id: id.to_owned(), named: false, kind });
    free("free.time", Kind::Signal(Box::new(SmoothTime(12))));
    for (name, follows) in [("temperature", Follows::Temperature), ("supply", Follows::Supply)] {
        if follows.of(scene).is_some() {
            free(&format!("free.{name}"), Kind::Signal(Box::new(CovariateForm(follows))));
            free(&format!("free.{name}_rate"), Kind::Signal(Box::new(RateForm(follows))));
            free(&format!("free.variance_{name}"), Kind::Variance(Box::new(CovariateForm(follows))));
            free(&format!("free.variance_{name}_rate"), Kind::Variance(Box::new(RateForm(follows))));
        }
    }
    free("free.variance_time", Kind::Variance(Box::new(SmoothTime(6))));
    free("free.white_level", Kind::Filter(Box::new(WhiteLevel)));
    free("free.spectrum", Kind::Shape(Box::new(FreeSpectrum)));
    free("free.resonance", Kind::Noise(Box::new(Resonance)));
    free("free.periodic", Kind::Line(Box::new(Comb(6)), 6));
    free("free.pulses", Kind::Line(Box::new(Comb(16)), 16));
    all
}

/// What each part of a fitted set closes: the mean of what it closes first and last, nats. The others have the
/// coefficients that they take without it, so that of two that can stand in for each other neither is taken for
/// indispensable.
pub fn shares(likelihood: &Likelihood, fitted: &Fitted) -> Vec<(usize, f64)> {
    let h = &fitted.hypothesis;
    let score = |keep: &dyn Fn(usize) -> bool| likelihood.plug_in(h, keep);
    let (Some(all), Some(none)) = (score(&|_| true), score(&|_| false)) else { return Vec::new() };
    let single = h.size() == 1;
    let share = |c: usize| {
        let last = all - if single { none } else { score(&|k| k != c)? };
        let first = if single { all } else { score(&|k| k == c)? } - none;
        Some((c, 0.5 * (first + last)))
    };
    h.candidates().filter_map(share).collect()
}

/// Sets this much less probable than the best take no part in the answer, nats.
const DEPTH: f64 = 9.0;
/// Most sets of the Gaussian part that do.
const SETS: usize = 60;

/// How hypotheses are compared.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Options {
    /// Prior odds under which sets are searched.
    pub prior: Prior,
    /// How their evidences become probabilities.
    pub calibration: Calibration,
}

/// Judges one recording: `recorded` as it is, in `scene`.
pub fn judge(scene: &Scene, recorded: &[f64], effects: &[&'static dyn Effect], options: &Options) -> Findings {
    let prior = options.prior;
    let knows = |id: &str| effects.iter().any(|e| e.about().id == id);
    let mut scene = scene.clone();
    let nominal = scene.white_std_rad_s;
    // a lattice this fine is how the file keeps its numbers
    let lsb = lattice::step(recorded).filter(|lsb| *lsb > 0.01 * nominal);
    if let Some(lsb) = lsb {
        scene.white_std_rad_s = (nominal * nominal + lsb * lsb / 12.0).sqrt();
    }
    let frame = Frame::new(&scene);
    let deviation: Vec<f64> =
        (0..frame.len()).map(|i| recorded[i] - scene.warm_up.error_rad_s(scene.time.at(i))).collect();
    let (cleaned, aside) = clean(&deviation);
    let data: Data = frame.data(cleaned);
    let candidates = candidates(effects, &frame.scene);
    let nuisance = nuisances(&frame);
    let likelihood = Likelihood::new(&frame, &data, &candidates, &nuisance);
    let mut search = Search::new(&likelihood, prior);
    let best = search.run();
    // on a coarse lattice no distribution of samples is normal
    let coarse = lsb.is_some_and(|lsb| lsb > 0.3 * nominal);
    let looks = Looks { coarse, aside: &aside, deviation: &deviation, data: &data, frame: &frame, prior };
    let layers_of_best = looks.at(search.whitened(&best.fitted.hypothesis), knows("gyro.outliers"));
    // a level that was fitted hides what makes it: bursts are judged beside the nominal level too
    let levels: Vec<usize> = best.fitted.hypothesis.candidates().filter(|c| is_level(&candidates[*c])).collect();
    let unlevelled = (!levels.is_empty()).then(|| {
        let rest = search.meet_without(&best, &levels);
        looks.at(search.whitened(&rest.fitted.hypothesis), knows("gyro.outliers"))
    });
    if let Some(noise) = candidates.iter().position(|c| c.id == "gyro.gauss_markov") {
        // two levels are looked for where a correlated noise may be
        search.meet_with(&best, noise);
    }

    let all = search.posterior();
    let top = all.first().map_or(0.0, |m| m.ln_weight);
    let mut sets: Vec<(WeightedSet, Seen)> = Vec::new();
    let seen = |h: &Hypothesis| {
        let levelled = h.candidates().any(|c| is_level(&candidates[c]));
        if unlevelled.is_some() && !levelled { Seen::Unlevelled } else { Seen::Best }
    };
    let deep = |m: &&Met| {
        let h = &m.fitted.hypothesis;
        m.ln_weight > top - DEPTH || h.size() == 0 || seen(h) == Seen::Unlevelled
    };
    let weighted = |parts, ln_weight| WeightedSet { parts, ln_weight, probability: 0.0 };
    for met in all.iter().filter(deep).take(SETS) {
        let set = weighted(parts(&likelihood, &met.fitted), met.ln_weight);
        sets.push((set, seen(&met.fitted.hypothesis)));
    }
    let mut beside_path = None;
    if let Some((found, ln_weight)) = popcorn(&likelihood, &nuisance, &search, prior) {
        let h = &found.fitted.hypothesis;
        let without = search.weight_without(h).unwrap_or(top);
        let left: Vec<f64> = data.values_rad_s.iter().zip(&found.path).map(|(y, p)| y - p).collect();
        let rest = frame.data_undithered(left);
        let likelihood = Likelihood::new(&frame, &rest, &candidates, &nuisance);
        let shots = shots::judge(&found.series, found.std, found.step_s);
        let ln_shots = ln_weight - found.ln_chain - prior.ln_named + shots.ln_evidence + prior.ln_free;
        if ln_weight.max(ln_shots) > top - DEPTH {
            // what is left of a path of jumps shows no events where there are none
            beside_path = Some(looks.at(whitened(&likelihood, h), knows("gyro.outliers")));
        }
        let view = if beside_path.is_some() { Seen::BesidePath } else { seen(h) };
        let others = parts(&likelihood, &found.fitted);
        let mut push = |part: Part, ln_weight: f64| {
            let parts = others.iter().cloned().chain([part]).collect();
            sets.push((weighted(parts, ln_weight), view));
        };
        if knows("gyro.telegraph_noise") {
            push(super::parts::telegraph(&found, &frame.scene, (ln_weight - without).max(0.1)), ln_weight);
        }
        push(super::parts::shots(&shots, (ln_shots - without).max(0.1)), ln_shots);
    }
    let mut notes = Vec::new();
    if !aside.is_empty() {
        notes.push(format!("{} samples stand out and were put aside before anything else was judged.", aside.len()));
    }
    let lattice = lsb.map(|lsb| {
        let gain = lattice::gain(&layers_of_best.white, lsb, nominal, nominal);
        super::parts::lattice(lsb, recorded, gain, knows("gyro.quantization"))
    });
    // on a lattice, equal values are the rule
    let repeats = if lsb.is_none() { repeats::judge(recorded, nominal) } else { Default::default() };
    let repeats = (repeats.ln_evidence + prior.ln_free > 0.0).then(|| super::parts::repeats(&repeats));
    let mut combined = Vec::new();
    for (set, view) in &sets {
        let layers = match view {
            Seen::Best => None,
            Seen::Unlevelled => unlevelled.as_ref(),
            Seen::BesidePath => beside_path.as_ref(),
        };
        for (extra, ln_weight) in layers.unwrap_or(&layers_of_best).combinations(*view == Seen::Unlevelled) {
            let mut parts = set.parts.clone();
            parts.extend(extra.iter().cloned());
            parts.extend(lattice.iter().chain(&repeats).cloned());
            combined.push(WeightedSet { parts, ln_weight: set.ln_weight + ln_weight, probability: 0.0 });
        }
    }
    Findings::new(combined, &prior, &options.calibration, notes)
}

/// What the whitened series shows beside its spectrum, each with ln weight over nothing of the kind.
struct Layers {
    amplitudes: Vec<(Option<Part>, f64)>,
    free: Vec<(Option<Part>, f64)>,
    /// Whitened residual in rad/s.
    white: Vec<f64>,
}

/// Under which hypothesis a set's whitened series was looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Seen {
    /// The best one.
    Best,
    /// The best one without what changes the level of the noise.
    Unlevelled,
    /// That of the path of two levels.
    BesidePath,
}

/// What is needed to look at a whitened series.
struct Looks<'a> {
    aside: &'a [usize],
    deviation: &'a [f64],
    data: &'a Data,
    frame: &'a Frame,
    prior: Prior,
    coarse: bool,
}

/// Whether a candidate changes the level of the noise.
fn is_level(c: &Candidate) -> bool {
    matches!(c.kind, Kind::Variance(_) | Kind::Shape(_)) || c.id == "free.white_level"
}

impl Looks<'_> {
    fn at(&self, mut w: Vec<f64>, outliers: bool) -> Layers {
        let Self { aside, deviation, data, frame, prior, coarse } = *self;
        let step_s = frame.scene.step_s;
        let start_s = frame.scene.time.at(0);
        // what the ends leak into is no sample of the noise
        let edge = (w.len() / 400).min(100);
        let range = edge..w.len() - edge;
        let quiet = w.clone();
        for i in aside {
            w[*i] += (deviation[*i] - data.values_rad_s[*i]) / frame.scene.white_std_rad_s;
        }
        let amplitude = amplitude::judge(&w[range.clone()]);
        let inner = w[range].to_vec();
        let mut w = quiet;
        if amplitude.outliers > 3.0 {
            amplitude::limit(&mut w, &amplitude);
        }
        let (events, track) = (events::judge(&w), track::judge(&w, step_s));
        let bursts = bursts::judge(&w, step_s);
        let free = |id: &str, share: f64, description: String| Part {
            id: format!("free.{id}"),
            named: false,
            share,
            parameters: Default::default(),
            std: Default::default(),
            time_s: None,
            frequency_hz: None,
            description,
        };
        let mut amplitudes = vec![(None, 0.0)];
        if outliers {
            amplitudes.push((
                Some(super::parts::outliers(&amplitude, frame.scene.white_std_rad_s)),
                amplitude.outliers + prior.ln_named,
            ));
        }
        let tails = if amplitude.shape > 0.0 { "heavier" } else { "of another shape" };
        let text = format!("the samples' distribution is not normal: tails {tails}");
        if !coarse {
            amplitudes.push((Some(free("amplitude", amplitude.free, text)), amplitude.free + prior.ln_free));
        }
        let mut forms = vec![(None, 0.0)];
        let length_s = events.samples as f64 * step_s;
        let text = format!("rare events of about {length_s:.3} s, in {:.1} % of the time", 100.0 * events.share);
        forms.push((Some(free("events", events.ln_evidence, text)), events.ln_evidence + prior.ln_free));
        let [low, high] = track.band_hz;
        let mut part = free("track", track.ln_evidence, format!("energy that moves between {low:.4} and {high:.4} Hz"));
        part.frequency_hz = Some(track.band_hz);
        part.time_s = Some(track.time_s.map(|t| t + start_s));
        forms.push((Some(part), track.ln_evidence + prior.ln_free));
        let text = format!(
            "noise in bursts of about {:.2} s, in {:.1} % of the time",
            bursts.samples as f64 * step_s,
            100.0 * bursts.share
        );
        forms.push((Some(free("bursts", bursts.ln_bursts, text)), bursts.ln_bursts + prior.ln_free));
        let text = format!("the noise's level is periodic: {:.3} s", 1.0 / bursts.frequency_hz.max(1e-300));
        forms.push((Some(free("periodic_level", bursts.ln_periodic, text)), bursts.ln_periodic + prior.ln_free));
        let white = inner.iter().map(|v| v * frame.scene.white_std_rad_s).collect();
        Layers { amplitudes, free: forms, white }
    }
}

impl Layers {
    /// What can be seen together. Heavy tails, bursts and events are all seen in the same excess: of free forms there is
    /// one at a time, and beside the nominal level (`alone`) nothing else.
    fn combinations(&self, alone: bool) -> Vec<(Vec<Part>, f64)> {
        let mut all = Vec::new();
        for (a, wa) in &self.amplitudes {
            for (f, wf) in &self.free {
                let ln_weight = wa + wf;
                let double = a.as_ref().is_some_and(|a| alone || !a.named) && f.is_some();
                if ln_weight > -12.0 && !double {
                    all.push((a.iter().chain(f).cloned().collect(), ln_weight));
                }
            }
        }
        all
    }
}

/// The best of the sets with two levels in the place of a noise, with its ln weight.
fn popcorn(
    likelihood: &Likelihood,
    nuisance: &[(super::frame::ColumnId, f64)],
    search: &Search,
    prior: Prior,
) -> Option<(Popcorn, f64)> {
    let Likelihood { frame, data, candidates, .. } = *likelihood;
    let sets = search.posterior();
    let top = sets.first()?.ln_weight;
    let mut best: Option<(Popcorn, f64)> = None;
    let mut tried: Vec<Vec<usize>> = Vec::new();
    for met in sets.iter().filter(|m| m.ln_weight > top - 9.0 && !m.fitted.hypothesis.noises.is_empty()).take(5) {
        let whole = &met.fitted.hypothesis;
        for part in &whole.noises {
            if !matches!(candidates[part.candidate].kind, Kind::Noise(_)) {
                continue;
            }
            let base: Hypothesis = whole.without(part.candidate);
            let mut key: Vec<usize> = base.candidates().collect();
            key.sort_unstable();
            if tried.contains(&key) {
                continue;
            }
            tried.push(key);
            // the path's standard deviation and correlation time, where the noise in its place has them
            let theta: Vec<f64> = part.ln_theta.iter().map(|v| v.exp()).collect();
            let start = match candidates[part.candidate].id.as_str() {
                "gyro.gauss_markov" => [2.0 * theta[1], 2.0 * theta[0]],
                _ => {
                    let slow: f64 = frame
                        .series(&likelihood.followed(whole, &likelihood.remainder(whole)))
                        .iter()
                        .map(|v| v * v)
                        .sum();
                    [2.0 * (slow / frame.len() as f64).sqrt(), 0.02 * frame.scene.span_s()]
                }
            };
            let Some(found) = beside(frame, data, candidates, nuisance, &base, whole, start) else { continue };
            let one = |c: usize| if candidates[c].named { prior.ln_named } else { prior.ln_free };
            let weight = found.ln_evidence + prior.ln_named + base.candidates().map(one).sum::<f64>();
            if best.as_ref().is_none_or(|b| weight > b.1) {
                best = Some((found, weight));
            }
        }
    }
    best
}
