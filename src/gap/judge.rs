//! The comparison of one recording's hypotheses, Gaussian part and the rest together.

use super::clean::clean;
use super::evidence::{Fitted, Likelihood, nuisances};
use super::frame::{Data, Frame};
use super::free::{Chirp, Comb, CovariateForm, Follows, FreeSpectrum, RateForm, Resonance, SmoothTime, WhiteLevel};
use super::hypothesis::{Candidate, Hypothesis, Kind};
use super::layers::{amplitude, bursts, events, lattice, track};
use super::popcorn::{Popcorn, beside};
use super::search::{Met, Prior, Search};
use crate::effects::{Effect, Explanation};
use crate::model::Scene;

/// Candidates in one scene: the effects that it can show, and the free forms.
pub fn candidates(effects: &[&'static dyn Effect], scene: &Scene) -> Vec<Candidate> {
    let mut all = Vec::new();
    for effect in effects {
        let id = effect.about().id.to_owned();
        let kind = match effect.explanation(scene) {
            Some(Explanation::Signal(s)) if id == "gyro.tone" => Kind::Line(s),
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
    free("free.time", Kind::Signal(Box::new(SmoothTime(14))));
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
    free("free.periodic", Kind::Line(Box::new(Comb)));
    let _ = Chirp;
    all
}

/// What was found.
pub struct Judged {
    /// Sets of Gaussian candidates, most probable first.
    pub sets: Vec<Met>,
    /// Share of each candidate of the best set: nats.
    pub shares: Vec<(usize, f64)>,
    /// Amplitudes.
    pub amplitude: amplitude::Amplitude,
    /// Events.
    pub events: events::Events,
    /// Bursts.
    pub bursts: bursts::Bursts,
    /// Two levels beside a set, with the ln weight.
    pub popcorn: Option<(Popcorn, f64)>,
    /// Track.
    pub track: track::Track,
    /// Step of the lattice.
    pub lsb: Option<f64>,
    /// Rows put aside.
    pub aside: Vec<usize>,
}

/// What each part of a fitted set closes: the mean of what it closes first and last, nats.
pub fn shares(likelihood: &Likelihood, fitted: &Fitted) -> Vec<(usize, f64)> {
    let h = &fitted.hypothesis;
    let Some(posterior) = likelihood.coefficients(h) else { return Vec::new() };
    let all = likelihood.plug_in(h, &posterior, &|_| true);
    let none = likelihood.plug_in(h, &posterior, &|_| false);
    h.candidates()
        .map(|c| {
            let last = all - likelihood.plug_in(h, &posterior, &|k| k != c);
            let first = likelihood.plug_in(h, &posterior, &|k| k == c) - none;
            (c, 0.5 * (first + last))
        })
        .collect()
}

/// Judges one recording: `recorded` as it is, in `scene`.
pub fn judge(scene: &Scene, recorded: &[f64], effects: &[&'static dyn Effect], prior: Prior) -> Judged {
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
    let likelihood = Likelihood::new(&frame, &data, &candidates, &nuisances(&frame));
    let mut search = Search::new(&likelihood, prior);
    let best = search.run();
    let mut w = search.whitened(&best.fitted.hypothesis);
    let events = events::judge(&w);
    let track = track::judge(&w, frame.scene.step_s);
    for i in &aside {
        w[*i] += (deviation[*i] - data.values_rad_s[*i]) / frame.scene.white_std_rad_s;
    }
    // what the ends leak into is no sample of the noise
    let edge = (w.len() / 400).min(100);
    let bursts = bursts::judge(&w, frame.scene.step_s);
    let popcorn = effects
        .iter()
        .any(|e| e.about().id == "gyro.telegraph_noise")
        .then(|| popcorn(&frame, &data, &candidates, &nuisances(&frame), &search, prior))
        .flatten();
    let amplitude = amplitude::judge(&w[edge..w.len() - edge]);
    Judged {
        shares: shares(&likelihood, &best.fitted),
        sets: search.posterior(),
        amplitude,
        events,
        bursts,
        popcorn,
        track,
        lsb,
        aside,
    }
}

/// The best of the sets with two levels in the place of a noise, with its ln weight.
fn popcorn(
    frame: &Frame,
    data: &Data,
    candidates: &[Candidate],
    nuisance: &[(super::frame::ColumnId, f64)],
    search: &Search,
    prior: Prior,
) -> Option<(Popcorn, f64)> {
    let sets = search.posterior();
    let top = sets.first()?.ln_weight;
    let mut best: Option<(Popcorn, f64)> = None;
    let mut tried: Vec<Vec<usize>> = Vec::new();
    for met in sets.iter().filter(|m| m.ln_weight > top - 4.0).take(4) {
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
                    let slow: f64 = frame.series(&search.slow(whole)).iter().map(|v| v * v).sum();
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
