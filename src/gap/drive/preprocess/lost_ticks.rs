//! e_k = wheel_k - its prediction by other sensors and model;  e ~ N(0, s²) or, inside a burst, N(-λ wheel_k, s²)
//!
//! Missed ticks of one wheel: a hidden Markov chain of two states (Rabiner 1989) over the wheel's prediction error,
//! with the wheel itself excluded from the prediction. Prediction errors are correlated in time: s is the scatter of
//! their means over the length of a burst. Loss, length and share of the bursts lie on a grid; each burst then has a
//! loss of its own, λ_i ~ N(λ, (λ/4)²). The chain begins anew in each drive.

use crate::effects::Parameters;
use crate::effects::drive::{Driving, Lost};
use crate::gap::drive::ekf::innovations::run;
use crate::gap::drive::ekf::models::Models;
use crate::gap::drive::ekf::noise::{Channel, Noise};
use crate::gap::drive::record::Record;
use crate::gap::selection::sets::Part;
use rayon::prelude::*;
use std::ops::Range;

/// Grid of losses λ.
const LOSSES: [f64; 16] =
    [4e-4, 7e-4, 1.2e-3, 2.2e-3, 0.004, 0.007, 0.012, 0.02, 0.035, 0.06, 0.1, 0.15, 0.22, 0.33, 0.5, 0.8];
/// Grid of mean lengths of a burst, s.
const LENGTHS_S: [f64; 5] = [0.06, 0.2, 0.7, 2.5, 8.0];
/// Grid of shares of time in bursts.
const SHARES: [f64; 4] = [0.004, 0.02, 0.1, 0.3];
/// Time over which medians of the prediction error are subtracted as slow errors, s. Bursts fill less than half of it.
const SLOW_S: f64 = 40.0;
/// Relative standard deviation of the loss of single bursts.
const UNEVEN: f64 = 0.25;
/// Errors count as independent over a time if their means scatter by this share of the scatter over the longest time.
const HARDLY_MORE: f64 = 0.8;
/// Fewest stretches for a scatter of means.
const FEWEST: usize = 16;
/// Median of the square of a standard normal variable.
const MEDIAN: f64 = 0.4549;
/// ln likelihood ratio beyond which a row is certain: e to it is near the largest number.
const CERTAIN: f64 = 700.0;
/// Factor on the wheel's variance that excludes it from a pass of the filter.
const ASIDE: f64 = 1e6;

/// Bursts in which one wheel read low.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LostTicks {
    /// 0 left, 1 right.
    pub side: usize,
    /// Share lost in each row, zero outside bursts.
    pub lost: Vec<f64>,
    /// λ, share of the speed lost inside bursts.
    pub loss: f64,
    /// Its standard deviation.
    pub loss_std: f64,
    /// Mean length of a burst, s.
    pub length_s: f64,
    /// Share of the rows in bursts.
    pub share: f64,
    /// ln evidence over no burst, every node of the grid equally probable; exact if errors are independent over longer
    /// times.
    pub ln_evidence: f64,
    /// ln evidence less ln likelihood with these bursts and losses: cost of not knowing them.
    pub ln_path: f64,
}

/// Settings of a search for bursts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sought {
    /// 0 left, 1 right.
    pub side: usize,
    /// λ, if it is known; none: over the grid.
    pub loss: Option<f64>,
    /// Whether slow errors of the model are subtracted, and with them a part of long bursts.
    pub slow: bool,
}

/// Best account of bursts of one wheel at each mean length; none for lengths without evidence.
#[must_use]
pub(crate) fn accounts(record: &Record, models: &Models, noise: &Noise, sought: Sought) -> Vec<LostTicks> {
    Predicted::of(record, models, noise, sought.side).accounts(record, sought)
}

/// Prediction errors of one wheel, by the other sensors and the model.
pub(crate) struct Predicted {
    /// Row, error in rad/s and its variance in rad²/s²
    rows: Vec<(usize, f64, f64)>,
}

impl Predicted {
    /// From a pass of the filter that excludes the wheel of this side.
    #[must_use]
    pub(crate) fn of(record: &Record, models: &Models, noise: &Noise, side: usize) -> Self {
        let mut aside = *noise;
        let variance = noise.reading[side];
        aside.reading[side] *= ASIDE;
        let mut rows: Vec<(usize, f64, f64)> = Vec::with_capacity(record.len());
        let _ = run(record, models, &aside, &[], |i| {
            if i.channel == Channel::ALL[side] {
                let error = i.white * i.std;
                rows.push((i.row, error, (i.std * i.std - aside.reading[side]).max(0.0) + variance));
            }
        });
        Self { rows }
    }

    /// As [`accounts`]; `sought` has the side that was predicted.
    #[must_use]
    pub(crate) fn accounts(&self, record: &Record, sought: Sought) -> Vec<LostTicks> {
        let Some(errors) = Errors::of(record, &self.rows, sought) else { return Vec::new() };
        let losses = sought.loss.map_or_else(|| LOSSES.to_vec(), |loss| vec![loss]);
        let scatters = LENGTHS_S.map(|length_s| errors.scatter(record, length_s));
        let evidences: Vec<Evidences> =
            losses.par_iter().map(|loss| errors.evidences(record.step_s, *loss, &scatters)).collect();
        let account = |i: usize| {
            let at_length = losses.iter().zip(&evidences).map(|(loss, of)| (*loss, of[i])).collect::<Vec<_>>();
            errors.account(record, &at_length, i, &scatters, sought)
        };
        let all: Vec<Option<LostTicks>> = (0..LENGTHS_S.len()).into_par_iter().map(account).collect();
        all.into_iter().flatten().collect()
    }
}

/// ln evidence of one loss at each length and share.
type Evidences = [[f64; SHARES.len()]; LENGTHS_S.len()];

/// ln p of the drive with the lost ticks restored under `models`, including the cost of not knowing the bursts. The
/// chain takes prediction errors for independent, which they are not; the filter knows their correlation.
#[must_use]
pub(crate) fn weight(record: &Record, models: &Models, noise: &Noise, bursts: &LostTicks) -> f64 {
    let restored = run(&bursts.restored(record), models, noise, &[], |_| {});
    restored.ln_likelihood() + bursts.ln_path + bursts.ln_jacobian()
}

/// Likelihoods of each row outside a burst and inside, the larger of both one: a row of a large loss tells thousands of
/// nats.
struct Odds {
    rows: Vec<[f64; 2]>,
    /// ln of the product of what the rows were divided by, over that outside a burst
    ln_scale: f64,
}

impl Odds {
    /// From the ln likelihood ratio of each row, inside over outside.
    fn of(ln_ratios: impl Iterator<Item = f64>) -> Self {
        let mut ln_scale = 0.0;
        let row = |ratio: f64| {
            ln_scale += ratio.max(0.0);
            // numbers next to the smallest are slow, and tell no more than zero
            let less = if ratio.abs() < CERTAIN { (-ratio.abs()).exp() } else { 0.0 };
            if ratio > 0.0 { [less, 1.0] } else { [1.0, less] }
        };
        let rows = ln_ratios.map(row).collect();
        Self { rows, ln_scale }
    }
}

/// Prediction errors of one wheel, in order of rows.
struct Errors {
    rows: Vec<usize>,
    errors: Vec<f64>,
    speeds: Vec<f64>,
    variances: Vec<f64>,
    whitened: Vec<f64>,
    /// Index range of the errors of each drive
    drives: Vec<Range<usize>>,
}

impl Errors {
    fn of(record: &Record, rows: &[(usize, f64, f64)], sought: Sought) -> Option<Self> {
        if rows.len() < 64 {
            return None;
        }
        let wheel = &record.wheels_rad_s[sought.side];
        let place = |row: usize| rows.partition_point(|r| r.0 < row);
        let drives: Vec<Range<usize>> = record.drives().map(|d| place(d.start)..place(d.end)).collect();
        let errors = if sought.slow {
            without_slow(rows, wheel, record.step_s, &drives)
        } else {
            rows.iter().map(|r| r.1).collect()
        };
        Some(Self {
            drives,
            speeds: rows.iter().map(|r| wheel[r.0] - r.1).collect(),
            whitened: errors.iter().zip(rows).map(|(e, r)| e / r.2.sqrt()).collect(),
            errors,
            variances: rows.iter().map(|r| r.2).collect(),
            rows: rows.iter().map(|r| r.0).collect(),
        })
    }

    fn scatter(&self, record: &Record, length_s: f64) -> f64 {
        scatter(&self.whitened, &self.drives, (length_s / record.step_s).round() as usize)
    }

    /// ln likelihood ratio of the chain over no burst, over all drives; with `posterior`, the probability of each row
    /// to lie in one.
    fn forward(&self, odds: &Odds, rates: [f64; 2], mut posterior: Option<&mut [f64]>) -> f64 {
        let of = |drive: &Range<usize>| {
            let posterior = posterior.as_mut().map(|p| &mut p[drive.clone()]);
            forward(&odds.rows[drive.clone()], rates, posterior)
        };
        odds.ln_scale + self.drives.iter().map(of).sum::<f64>()
    }

    /// Likelihoods of each row in a burst of this loss and outside.
    fn odds(&self, loss: f64, scatter: f64) -> Odds {
        Odds::of((0..self.errors.len()).map(|k| {
            let shift = -loss * self.speeds[k];
            (self.errors[k] * shift - 0.5 * shift * shift) / (scatter * self.variances[k])
        }))
    }

    /// ln evidence of this loss, at each length and share.
    fn evidences(&self, step_s: f64, loss: f64, scatters: &[f64; LENGTHS_S.len()]) -> Evidences {
        let mut out = Evidences::default();
        let mut known: Option<(f64, Odds)> = None;
        for ((out, length_s), scatter) in out.iter_mut().zip(LENGTHS_S).zip(*scatters) {
            // white errors have the same scatter at every length
            let (_, odds) = match known.take() {
                Some(same) if same.0 == scatter => known.insert(same),
                _ => known.insert((scatter, self.odds(loss, scatter))),
            };
            *out = SHARES.map(|share| self.forward(odds, transitions(step_s, length_s, share), None));
        }
        out
    }

    /// Best account of bursts of the mean length number `place`, from the evidence of each loss at it.
    fn account(
        &self,
        record: &Record,
        losses: &[(f64, [f64; SHARES.len()])],
        place: usize,
        scatters: &[f64; LENGTHS_S.len()],
        sought: Sought,
    ) -> Option<LostTicks> {
        let (length_s, scatter) = (LENGTHS_S[place], scatters[place]);
        let mut best: Option<(f64, [f64; 2])> = None;
        let mut total = Vec::with_capacity(losses.len() * SHARES.len());
        for (loss, evidences) in losses {
            for (share, evidence) in SHARES.into_iter().zip(*evidences) {
                total.push(evidence);
                if best.is_none_or(|b| evidence > b.0) {
                    best = Some((evidence, [*loss, share]));
                }
            }
        }
        let (top, [loss, share]) = best?;
        let mean = total.iter().map(|e| (e - top).exp()).sum::<f64>() / total.len() as f64;
        // every length is equally probable
        let ln_evidence = top + mean.ln() - (LENGTHS_S.len() as f64).ln();
        if ln_evidence.is_nan() || ln_evidence <= 0.0 {
            return None;
        }
        let rates = transitions(record.step_s, length_s, share);
        let mut posterior = vec![0.0; self.errors.len()];
        self.forward(&self.odds(loss, scatter), rates, Some(&mut posterior));
        let mut spans = Vec::new();
        let mut lost = vec![0.0; record.len()];
        let (mut all, mut likelihood) = ([0.0; 2], 0.0);
        let mut burst: Option<(usize, [f64; 2])> = None;
        let prior = (UNEVEN * loss).powi(-2);
        for (k, end) in self.drives.iter().flat_map(|d| (d.start..=d.end).map(|k| (k, d.end))) {
            if k < end && posterior[k] > 0.5 {
                let (_, [against, square]) = burst.get_or_insert((k, [0.0; 2]));
                let variance = scatter * self.variances[k];
                *against -= self.errors[k] * self.speeds[k] / variance;
                *square += self.speeds[k] * self.speeds[k] / variance;
            } else if let Some((from, [against, square])) = burst.take() {
                let own = ((against + prior * loss) / (square + prior)).clamp(0.0, 0.99);
                spans.push((k - from, square));
                self.rows[from..k].iter().for_each(|row| lost[*row] = own);
                likelihood += own * against - 0.5 * own * own * square;
                all = [all[0] + against, all[1] + square];
            }
        }
        let [against, square] = all;
        if square <= 0.0 {
            return None;
        }
        // with errors correlated over more than a burst, the chain counts one path of bursts too often
        let independent = scatter >= HARDLY_MORE * scatters[LENGTHS_S.len() - 1];
        let by_chain = ln_evidence - likelihood;
        let count = lost.iter().filter(|l| **l > 0.0).count();
        Some(LostTicks {
            side: sought.side,
            loss: sought.loss.unwrap_or((against / square).clamp(0.0, 0.99)),
            loss_std: square.sqrt().recip(),
            length_s,
            share: count as f64 / self.rows.len() as f64,
            lost,
            ln_evidence,
            ln_path: if independent {
                by_chain
            } else {
                by_chain.min(self.ln_unknown(losses.len(), rates, loss, &spans))
            },
        })
    }

    /// ln of the cost of not knowing these bursts, each given by its rows and information on the loss: their prior
    /// probability under the chain, the rows by which their ends may move, and losses of their own.
    fn ln_unknown(&self, losses: usize, [enter, leave]: [f64; 2], loss: f64, spans: &[(usize, f64)]) -> f64 {
        let inside: usize = spans.iter().map(|s| s.0).sum();
        let outside = self.errors.len() - inside;
        let chain = spans.len() as f64 * (enter.ln() + leave.ln())
            + inside as f64 * (-leave).ln_1p()
            + outside as f64 * (-enter).ln_1p();
        let one = |(rows, square): &(usize, f64)| {
            // an end may lie wherever rows tell less than a nat
            let told = 0.5 * loss * loss * square / *rows as f64;
            let ends = 2.0 * (1.0 / told).clamp(1.0, *rows as f64).ln();
            ends - 0.5 * ((UNEVEN * loss).powi(2) * square).ln_1p()
        };
        let nodes = (losses * LENGTHS_S.len() * SHARES.len()) as f64;
        chain + spans.iter().map(one).sum::<f64>() - nodes.ln()
    }
}

/// Variance of the mean of `length` errors over that of white noise, at least one: errors of model and sensors last for
/// some time. From the median of squares, which bursts do not move.
fn scatter(whitened: &[f64], drives: &[Range<usize>], length: usize) -> f64 {
    let longest = drives.iter().map(Range::len).max().unwrap_or(1).max(1);
    let length = length.clamp(1, (whitened.len() / FEWEST).max(1)).min(longest);
    let square = |part: &[f64]| part.iter().sum::<f64>().powi(2) / part.len() as f64;
    let mut squares: Vec<f64> =
        drives.iter().flat_map(|d| whitened[d.clone()].chunks_exact(length)).map(square).collect();
    squares.sort_by(f64::total_cmp);
    (squares[squares.len() / 2] / MEDIAN).max(1.0)
}

/// Probabilities of entering and of leaving a burst, each row.
fn transitions(step_s: f64, length_s: f64, share: f64) -> [f64; 2] {
    let leave = 1.0 - (-step_s / length_s).exp();
    [leave * share / (1.0 - share), leave]
}

/// ln likelihood of the chain in one drive; with `posterior`, the probability of each row to lie in
/// one.
fn forward(odds: &[[f64; 2]], [enter, leave]: [f64; 2], posterior: Option<&mut [f64]>) -> f64 {
    let mut inside = enter / (enter + leave);
    let mut ln_total = 0.0;
    // logarithms of products, taken before they leave the range of numbers: no factor is below the probability of a change
    let mut product = 1.0;
    let mut filtered = Vec::new();
    let keep = posterior.is_some();
    for [outside, within] in odds {
        let predicted = inside * (1.0 - leave) + (1.0 - inside) * enter;
        let norm = (1.0 - predicted) * outside + predicted * within;
        product *= norm;
        if !(1e-200..1e200).contains(&product) {
            ln_total += f64::ln(product);
            product = 1.0;
        }
        inside = predicted * within / norm;
        if keep {
            filtered.push(inside);
        }
    }
    ln_total += f64::ln(product);
    if let Some(out) = posterior {
        let mut smoothed = filtered.last().copied().unwrap_or(0.0);
        for (k, p) in filtered.iter().enumerate().rev() {
            if k + 1 < filtered.len() {
                let predicted = p * (1.0 - leave) + (1.0 - p) * enter;
                let stay = p * (1.0 - leave) * smoothed / predicted.max(1e-300);
                smoothed = (stay + p * leave * (1.0 - smoothed) / (1.0 - predicted).max(1e-300)).clamp(0.0, 1.0);
            }
            out[k] = smoothed;
        }
    }
    ln_total
}

/// Errors less their slow parts in each drive: first relative ones (radius, track, gain), then offsets.
fn without_slow(rows: &[(usize, f64, f64)], wheel: &[f64], step_s: f64, drives: &[Range<usize>]) -> Vec<f64> {
    let window = (SLOW_S / step_s) as usize;
    let slow_of =
        |values: &[f64]| -> Vec<f64> { drives.iter().flat_map(|d| medians(&values[d.clone()], window)).collect() };
    let known = wheel.iter().filter(|w| w.is_finite());
    let fast = known.clone().map(|w| w.abs()).sum::<f64>() / known.count().max(1) as f64;
    let relative = rows.iter().map(|r| if wheel[r.0].abs() > fast { r.1 / wheel[r.0] } else { f64::NAN });
    let slow = slow_of(&relative.collect::<Vec<_>>());
    let even: Vec<f64> = rows.iter().zip(slow).map(|(r, s)| r.1 - s * wheel[r.0]).collect();
    let slow = slow_of(&even);
    even.iter().zip(slow).map(|(e, s)| e - s).collect()
}

/// Medians of blocks, linear between them; values that are NaN are ignored.
fn medians(values: &[f64], window: usize) -> Vec<f64> {
    let size = window.clamp(16, values.len().max(16));
    let mut nodes: Vec<(f64, f64)> = Vec::new();
    for (block, part) in values.chunks(size).enumerate() {
        let mut known: Vec<f64> = part.iter().copied().filter(|v| v.is_finite()).collect();
        known.sort_by(f64::total_cmp);
        if let Some(middle) = known.get(known.len() / 2) {
            nodes.push(((block * size) as f64 + 0.5 * part.len() as f64, *middle));
        }
    }
    let mut at = 0;
    (0..values.len())
        .map(|k| {
            let x = k as f64;
            while at + 2 < nodes.len() && nodes[at + 1].0 < x {
                at += 1;
            }
            match (nodes.get(at), nodes.get(at + 1)) {
                (Some((x0, y0)), Some((x1, y1))) => y0 + (y1 - y0) * ((x - x0) / (x1 - x0)).clamp(0.0, 1.0),
                (Some((_, y)), None) => *y,
                _ => 0.0,
            }
        })
        .collect()
}

impl LostTicks {
    /// The drive with the lost ticks restored.
    #[must_use]
    pub(crate) fn restored(&self, record: &Record) -> Record {
        let mut out = record.clone();
        out.wheels_rad_s[self.side].iter_mut().zip(&self.lost).for_each(|(value, lost)| *value /= 1.0 - lost);
        out
    }

    /// ln Jacobian of restoring: Σ ln 1/(1-λ) over the rows.
    #[must_use]
    pub(crate) fn ln_jacobian(&self) -> f64 {
        -self.lost.iter().map(|l| (-l).ln_1p()).sum::<f64>()
    }
}

/// Part of lost ticks of one wheel in a set, of which they close `share` nats; `effect`: that which loses them.
pub(crate) fn missed_part(effect: &dyn Driving, bursts: &LostTicks, share: f64) -> Part {
    let side = if bursts.side == 0 { "left" } else { "right" };
    let about = effect.about();
    let mut part = Part::described(about.id, true, share, format!("the {side} wheel reads low in bursts"));
    let lost = Lost { loss: bursts.loss, side: bursts.side, length_s: bursts.length_s, share: bursts.share };
    part.parameters = effect.tick_loss().map_or_else(Parameters::new, |of| of.parameters(&lost));
    part.std = Parameters::from([(about.size().into(), bursts.loss_std)]);
    part
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All paths of the chain, one by one, where a row tells more than a number can hold.
    #[test]
    fn the_chain_is_the_sum_over_all_paths() {
        let (ratios, [enter, leave]) = ([3.0, -2.0, 900.0, 1500.0, -700.0, 0.5], [0.02, 0.3]);
        let path = |states: u32| {
            let inside = |k: usize| states >> k & 1 == 1;
            let start: f64 = if inside(0) { enter } else { leave };
            let step = |k: usize| match [inside(k - 1), inside(k)] {
                [false, false] => 1.0 - enter,
                [false, true] => enter,
                [true, false] => leave,
                [true, true] => 1.0 - leave,
            };
            let ln = (1..ratios.len()).map(|k| f64::ln(step(k))).sum::<f64>() + (start / (enter + leave)).ln();
            ln + (0..ratios.len()).filter(|k| inside(*k)).map(|k| ratios[k]).sum::<f64>()
        };
        let all: Vec<f64> = (0..1 << ratios.len()).map(path).collect();
        let top = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let total = top + all.iter().map(|v| (v - top).exp()).sum::<f64>().ln();
        let odds = Odds::of(ratios.into_iter());
        let mut inside = [0.0; 6];
        // the chain takes one step before its first row, from its stationary state, which it does not change
        let found = odds.ln_scale + forward(&odds.rows, [enter, leave], Some(&mut inside));
        assert!((found - total).abs() < 1e-9, "{found} {total}");
        assert!(inside[2] > 0.999 && inside[3] > 0.999 && inside[4] < 0.001, "{inside:?}");
    }
}
