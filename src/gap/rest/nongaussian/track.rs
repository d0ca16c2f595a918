//! X_s(f) ~ CN(0, 1 + g) on a track f(s) through the segments' spectra, CN(0, 1) elsewhere: energy that moves in frequency
//!
//! Free form: a hidden Markov chain over the frequency bins (and 'silent') of short segments, its evidence summed over all
//! tracks by the forward recursion. A chirp, a wandering line and bursts of a tone all leave a track.

use crate::gap::rest::whittle::evidence::ln_mean_exp;
use realfft::RealFftPlanner;

/// A track.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Track {
    /// Evidence in nats over white noise.
    pub ln_evidence: f64,
    /// Lowest and highest frequency of the most probable states, Hz.
    pub band_hz: [f64; 2],
    /// First and last time with energy, s from the first sample.
    pub time_s: [f64; 2],
}

/// Probabilities of going silent and of coming back in a segment: a track that lasts, and bursts of a few segments.
const LEAVE: [[f64; 2]; 2] = [[0.03, 0.03], [0.3, 0.06]];

/// Judges a whitened series, sampled every `step_s`.
#[must_use]
pub(crate) fn judge(w: &[f64], step_s: f64) -> Track {
    let mut results: Vec<(f64, [f64; 2], [f64; 2])> = Vec::new();
    for segments in [16, 48, 144, 432, 1296] {
        let size = w.len() / segments;
        if size < 48 {
            continue;
        }
        if let Some(r) = at_resolution(w, size, step_s) {
            results.push(r);
        }
    }
    let values: Vec<f64> = results.iter().map(|r| r.0).collect();
    let best = results.iter().max_by(|a, b| a.0.total_cmp(&b.0)).copied();
    let (_, band_hz, time_s) = best.unwrap_or((0.0, [0.0; 2], [0.0; 2]));
    let ln_evidence = if values.is_empty() { 0.0 } else { ln_mean_exp(&values, values.len() as f64) };
    Track { ln_evidence, band_hz, time_s }
}

fn at_resolution(w: &[f64], size: usize, step_s: f64) -> Option<(f64, [f64; 2], [f64; 2])> {
    let plan = RealFftPlanner::<f64>::new().plan_fft_forward(size);
    let (mut input, mut spectrum) = (plan.make_input_vec(), plan.make_output_vec());
    let mut power: Vec<Vec<f64>> = Vec::new();
    for chunk in w.chunks_exact(size) {
        input.copy_from_slice(chunk);
        plan.process(&mut input, &mut spectrum).ok()?;
        power.push(spectrum[1..spectrum.len() - 1].iter().map(|c| c.norm_sqr() / size as f64).collect());
    }
    let bins = power.first()?.len();
    let mut evidences = Vec::new();
    let mut best = (f64::NEG_INFINITY, Vec::new());
    for gain in [3.0, 8.0, 20.0, 60.0] {
        for reach in [1usize, 4] {
            for leave in LEAVE {
                let (value, path) = forward(&power, bins, gain, reach, leave);
                evidences.push(value);
                if value > best.0 {
                    best = (value, path);
                }
            }
        }
    }
    let df = 1.0 / (size as f64 * step_s);
    let on: Vec<(usize, usize)> = best.1.iter().enumerate().filter_map(|(s, k)| k.map(|k| (s, k))).collect();
    let ends = |v: &mut dyn Iterator<Item = usize>| v.fold((usize::MAX, 0), |(a, b), k| (a.min(k), b.max(k)));
    let (k0, k1) = ends(&mut on.iter().map(|o| o.1));
    let (s0, s1) = ends(&mut on.iter().map(|o| o.0));
    let duration = size as f64 * step_s;
    let (band, time) = if on.is_empty() {
        ([0.0; 2], [0.0; 2])
    } else {
        ([(k0 + 1) as f64 * df, (k1 + 1) as f64 * df], [s0 as f64 * duration, (s1 + 1) as f64 * duration])
    };
    Some((ln_mean_exp(&evidences, evidences.len() as f64), band, time))
}

/// Forward recursion; also the state that is most probable at each segment given the past.
fn forward(
    power: &[Vec<f64>],
    bins: usize,
    gain: f64,
    reach: usize,
    [to_silence, from_silence]: [f64; 2],
) -> (f64, Vec<Option<usize>>) {
    let ratio = |p: f64| (p * gain / (1.0 + gain)).exp() / (1.0 + gain);
    let mut state = vec![from_silence / (to_silence + from_silence) / bins as f64; bins];
    let mut silent = to_silence / (to_silence + from_silence);
    let mut total = 0.0;
    let mut path = Vec::with_capacity(power.len());
    let mut next = vec![0.0; bins];
    let mut sums = vec![0.0; bins + 1];
    let width = (2 * reach + 1) as f64;
    for (s, p) in power.iter().enumerate() {
        if s > 0 {
            // moves of at most `reach` bins, equally probable, by running sums
            for k in 0..bins {
                sums[k + 1] = sums[k] + state[k];
            }
            let on: f64 = sums[bins];
            for (k, n) in next.iter_mut().enumerate() {
                let (a, b) = (k.saturating_sub(reach), (k + reach + 1).min(bins));
                *n = (1.0 - to_silence) * (sums[b] - sums[a]) / width + from_silence * silent / bins as f64;
            }
            silent = (1.0 - from_silence) * silent + to_silence * on;
            std::mem::swap(&mut state, &mut next);
        }
        state.iter_mut().zip(p).for_each(|(s, p)| *s *= ratio(*p));
        let norm = state.iter().sum::<f64>() + silent;
        if !(norm > 0.0 && norm.is_finite()) {
            return (f64::NEG_INFINITY, path);
        }
        total += norm.ln();
        state.iter_mut().for_each(|v| *v /= norm);
        silent /= norm;
        let top = (0..bins).max_by(|a, b| state[*a].total_cmp(&state[*b]));
        path.push(top.filter(|k| state[*k] > silent.max(0.2)));
    }
    (total, path)
}
