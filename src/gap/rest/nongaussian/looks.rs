//! Non-Gaussian features of a recording, seen in the series that one hypothesis has whitened: heavy tails, events,
//! bursts, energy that moves in frequency. Every set of effects is judged in its own series; series that hardly differ
//! are examined once.

use super::{amplitude, bursts, events, track};
use crate::gap::rest::whittle::evidence::Likelihood;
use crate::gap::rest::whittle::hypothesis::Hypothesis;
use crate::gap::selection::prior::Prior;
use crate::gap::selection::sets::Part;
use crate::gap::trace::{Decision, Step, TraceStage};
use rayon::prelude::*;

/// Settings common to all series.
pub(crate) struct Looks {
    /// Samples that were cleaned: row, and recorded value minus its replacement, rad/s.
    pub aside: Vec<(usize, f64)>,
    pub step_s: f64,
    pub start_s: f64,
    pub prior: Prior,
    /// Whether quantization is so coarse that no distribution of samples is normal.
    pub coarse: bool,
    /// Id of the effect of rare large samples; none where the library lacks it.
    pub outliers: Option<&'static str>,
}

/// A whitened series with the standard deviation of its noise.
#[derive(Debug, Clone)]
pub(crate) struct Seen {
    w: Vec<f64>,
    noise_std: f64,
    /// Standard deviation of the noise in each level block over the mean one.
    profile: Vec<f64>,
}

/// Alternatives of non-Gaussian features, each with its ln weight over the absence of all. One entry of each list is at
/// work.
pub(crate) struct Layers {
    amplitudes: Vec<(Option<Part>, f64)>,
    free: Vec<(Option<Part>, f64)>,
    /// The whitened residual, rad/s, without the ends.
    pub white: Vec<f64>,
}

/// Index of the chosen entry in each list of [`Layers`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Choice([usize; 2]);

/// Distance in nats of a normal density below which two series count as the same.
const SAME_NATS: f64 = 10.0;
/// From so many series on, one within `NEAR_NATS` counts as the same.
const MANY: usize = 16;
const NEAR_NATS: f64 = 100.0;
/// Most series that are examined.
const MOST: usize = 40;
/// ln weight below which a feature is not considered.
const LEAST: f64 = -12.0;

impl Seen {
    /// The recording of `l` whitened by `h`.
    pub(crate) fn new(l: &Likelihood, h: &Hypothesis) -> Self {
        let frame = l.frame;
        let white = h.white_spectrum(frame, l.candidates);
        let power: f64 = white.iter().zip(&frame.bins.count).map(|(s, n)| s * n).sum();
        let (level, _) = h.level(frame, l.candidates);
        let profile = if level.is_empty() { vec![1.0] } else { level.into_iter().map(f64::sqrt).collect() };
        Self { w: l.whitened(h), noise_std: (power / frame.len().max(1) as f64).sqrt(), profile }
    }

    fn std_at(&self, row: usize) -> f64 {
        let long = self.w.len().div_ceil(self.profile.len()).max(1);
        self.noise_std * self.profile[(row / long).min(self.profile.len() - 1)]
    }

    /// Distance of two series in nats of a normal density: half the sum of squared differences, or the difference of their
    /// log densities, which is of first order where neither has variance one.
    fn distance(&self, other: &Self) -> f64 {
        let pairs = self.w.iter().zip(&other.w);
        let [apart, density] =
            pairs.fold([0.0; 2], |[apart, density], (a, b)| [apart + (a - b).powi(2), density + a * a - b * b]);
        0.5 * apart.max(density.abs())
    }
}

/// Distinct whitened series, and their features.
#[derive(Default)]
pub(crate) struct Views {
    seen: Vec<Seen>,
    pub layers: Vec<Layers>,
}

impl Views {
    /// Index of the series that is near `seen`, which is added where none is; none once there are [`MOST`].
    pub(crate) fn of(&mut self, seen: Seen) -> Option<usize> {
        let distances = self.seen.iter().map(|s| s.distance(&seen)).enumerate();
        let same = if self.seen.len() < MANY { SAME_NATS } else { NEAR_NATS };
        match distances.min_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((at, nats)) if nats < same => Some(at),
            _ if self.seen.len() == MOST => None,
            _ => {
                self.seen.push(seen);
                Some(self.seen.len() - 1)
            }
        }
    }

    /// Examines the series that were added since the last call.
    pub(crate) fn look(&mut self, looks: &Looks) {
        let new: Vec<Layers> = self.seen[self.layers.len()..].par_iter().map(|s| looks.at(s)).collect();
        self.layers.extend(new);
    }
}

impl Looks {
    fn at(&self, seen: &Seen) -> Layers {
        let Self { step_s, start_s, prior, coarse, .. } = *self;
        let mut w = seen.w.clone();
        // samples near the ends hold leakage
        let edge = (w.len() / 400).min(100);
        let range = edge..w.len() - edge;
        for (row, off) in &self.aside {
            w[*row] += off / seen.std_at(*row);
        }
        let amplitude = amplitude::judge(&amplitude::levelled(&w[range.clone()]));
        let white = w[range].iter().map(|v| v * seen.noise_std).collect();
        let mut w = seen.w.clone();
        if amplitude.outliers > 3.0 {
            amplitude::limit(&mut w, &amplitude);
        }
        let (events, track) = (events::judge(&w), track::judge(&w, step_s));
        let bursts = bursts::judge(&w, step_s);
        let free = |id: &str, share: f64, description: String| Part {
            description,
            missed_nats: Some(share),
            ..Part::new(&format!("free.{id}"), false, share)
        };
        let mut amplitudes = vec![(None, 0.0)];
        if let Some(id) = self.outliers {
            let part = crate::gap::rest::parts::outliers(id, &amplitude, seen.noise_std);
            amplitudes.push((Some(part), amplitude.outliers + prior.ln_named));
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
        let mut part =
            free("track", track.ln_evidence, format!("energy that moves between {low:.2e} and {high:.2e} Hz"));
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
        Layers { amplitudes, free: forms, white }
    }
}

impl Layers {
    /// Combinations of features. Heavy tails, bursts and events all explain the same excess: at most one free form is
    /// taken, and beside the nominal noise level (`alone`) no other feature with it. None is taken beside a path that
    /// follows anything slow (`followed`).
    pub(crate) fn choices(&self, alone: bool, followed: bool) -> Vec<Choice> {
        let mut all = Vec::new();
        for (i, (a, wa)) in self.amplitudes.iter().enumerate() {
            for (k, (f, wf)) in self.free.iter().enumerate() {
                let double = a.as_ref().is_some_and(|a| alone || !a.named) && f.is_some();
                let second = followed && (f.is_some() || a.as_ref().is_some_and(|a| !a.named));
                let known = (wa + wf).is_finite() && wa + wf > LEAST;
                if known && !double && !second {
                    all.push(Choice([i, k]));
                }
            }
        }
        all
    }

    /// Each distribution and course of the level that was looked for, as steps of the trail; [`Layers::choices`] of `alone` and
    /// `followed` are possible, and the one of most weight is taken.
    pub(crate) fn steps(&self, alone: bool, followed: bool) -> Vec<Step> {
        let possible = self.choices(alone, followed).into_iter();
        let best = possible.max_by(|a, b| self.ln_weight(*a).total_cmp(&self.ln_weight(*b)));
        let Some(Choice([amplitude, free])) = best else { return Vec::new() };
        let lists = [(&self.amplitudes, amplitude), (&self.free, free)].into_iter();
        let each = lists.flat_map(|(list, taken)| list.iter().enumerate().map(move |(i, one)| (one, i == taken)));
        each.filter_map(|((part, nats), taken)| {
            let part = part.as_ref()?;
            let decision = if taken { Decision::Taken } else { Decision::Rejected };
            let reason = if !taken && *nats > 0.0 {
                "gain over normal samples of constant level; not combined: one free form at most describes the samples, and \
                 none beside a path of jumps or the nominal level"
            } else {
                "gain in ln weight over normal samples of constant level, in the series that the best set whitens"
            };
            Some(Step::new(TraceStage::Samples, &part.id, decision, reason).nats(*nats))
        })
        .collect()
    }

    /// Parts of a choice.
    pub(crate) fn parts(&self, choice: Choice) -> impl Iterator<Item = &Part> {
        let Choice([a, f]) = choice;
        self.amplitudes[a].0.iter().chain(&self.free[f].0)
    }

    /// ln weight of a choice over the absence of all features.
    pub(crate) fn ln_weight(&self, choice: Choice) -> f64 {
        let Choice([a, f]) = choice;
        self.amplitudes[a].1 + self.free[f].1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    /// A hundredth of scale is 4 nats of 36 000 deviates, and 600 in the density of those of variance 2.8.
    #[test]
    fn series_of_another_level_are_not_the_same() {
        let draw = &mut Stream::new(3, 1);
        let normal: Vec<f64> = (0..36_000).map(|_| draw.normal()).collect();
        let seen =
            |scale: f64| Seen { w: normal.iter().map(|v| scale * v).collect(), noise_std: 1.0, profile: vec![1.0] };
        let mut views = Views::default();
        let numbers = [1.0, 1.0001, 1.67, 1.66].map(|scale| views.of(seen(scale)));
        assert_eq!(numbers, [Some(0), Some(0), Some(1), Some(2)]);
    }
}
