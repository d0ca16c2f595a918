//! e_k = wheel_k - what the other sensors and the model expect;  e ~ N(0, s²) or, inside a burst, N(-λ wheel_k, s²)
//!
//! Missed ticks of one wheel: a hidden Markov chain of two states (Rabiner 1989) over the wheel's prediction error, the
//! wheel itself taking no part in the prediction. Loss, length and share of the bursts lie on a grid.

use super::pass::{Channel, Models, Noise, run};
use super::record::Record;

/// Losses that are tried.
const LOSSES: [f64; 9] = [0.02, 0.035, 0.06, 0.1, 0.15, 0.22, 0.33, 0.5, 0.8];
/// Mean lengths of a burst, s.
const LENGTHS_S: [f64; 4] = [0.06, 0.2, 0.7, 2.5];
/// Shares of time in bursts.
const SHARES: [f64; 3] = [0.004, 0.02, 0.1];
/// Slow errors of the prediction are no bursts: medians over this time are taken out, s.
const SLOW_S: f64 = 10.0;
/// Variance of the wheel while it takes no part, relative.
const ASIDE: f64 = 1e6;

/// Bursts in which one wheel read low.
#[derive(Debug, Clone, PartialEq)]
pub struct Bursts {
    /// 0 left, 1 right.
    pub side: usize,
    /// Rows inside bursts.
    pub lost: Vec<bool>,
    /// λ
    pub loss: f64,
    /// Its standard deviation.
    pub loss_std: f64,
    /// Mean length, s.
    pub length_s: f64,
    /// Share of the rows.
    pub share: f64,
    /// ln evidence over no burst, every node of the grid equally probable.
    pub ln_evidence: f64,
    /// ln probability of when the bursts lie.
    pub ln_path: f64,
}

/// Looks for bursts of wheel `side`.
#[must_use]
pub fn find(record: &Record, models: &Models, noise: &Noise, side: usize) -> Option<Bursts> {
    let channel = Channel::ALL[side];
    let mut aside = *noise;
    let variance = noise.reading[side];
    aside.reading[side] *= ASIDE;
    let mut rows: Vec<(usize, f64, f64)> = Vec::with_capacity(record.len());
    let _ = run(record, models, &aside, &[], |i| {
        if i.channel == channel {
            let error = i.white * i.std;
            rows.push((i.row, error, (i.std * i.std - aside.reading[side]).max(0.0) + variance));
        }
    });
    if rows.len() < 64 {
        return None;
    }
    let errors = without_slow(&rows, (SLOW_S / record.step_s) as usize);
    // the model may be off: what counts is how the errors really scatter
    let mut sizes: Vec<f64> = errors.iter().zip(&rows).map(|(e, r)| e * e / r.2).collect();
    sizes.sort_by(f64::total_cmp);
    let scatter = (sizes[sizes.len() / 2] / 0.4549).max(1.0);
    let speeds: Vec<f64> = rows.iter().map(|r| record.wheels_rad_s[side][r.0] - r.1).collect();
    let variances: Vec<f64> = rows.iter().map(|r| r.2 * scatter).collect();
    // ln odds of each row to lie in a burst of this loss
    let ratios = |loss: f64| -> Vec<f64> {
        (0..errors.len())
            .map(|k| {
                let shift = -loss * speeds[k];
                (errors[k] * shift - 0.5 * shift * shift) / variances[k]
            })
            .collect()
    };
    let mut best: Option<(f64, [f64; 3])> = None;
    let mut total = Vec::new();
    for loss in LOSSES {
        let ratios = ratios(loss);
        for length_s in LENGTHS_S {
            for share in SHARES {
                let evidence = forward(&ratios, transitions(record.step_s, length_s, share), None);
                total.push(evidence);
                if best.is_none_or(|b| evidence > b.0) {
                    best = Some((evidence, [loss, length_s, share]));
                }
            }
        }
    }
    let (top, [loss, length_s, share]) = best?;
    let mean = total.iter().map(|e| (e - top).exp()).sum::<f64>() / total.len() as f64;
    let ln_evidence = top + mean.ln();
    if ln_evidence.is_nan() || ln_evidence <= 0.0 {
        return None;
    }
    let rates = transitions(record.step_s, length_s, share);
    let mut posterior = vec![0.0; errors.len()];
    forward(&ratios(loss), rates, Some(&mut posterior));
    let mut lost = vec![false; record.len()];
    let (mut against, mut square, mut path, mut before) = (0.0, 0.0, 0.0, false);
    for (k, p) in posterior.iter().enumerate() {
        let inside = *p > 0.5;
        lost[rows[k].0] = inside;
        let [enter, leave] = rates;
        path += match (before, inside) {
            (false, true) => enter.ln(),
            (true, false) => leave.ln(),
            (false, false) => (-enter).ln_1p(),
            (true, true) => (-leave).ln_1p(),
        };
        before = inside;
        if inside {
            against -= errors[k] * speeds[k] / variances[k];
            square += speeds[k] * speeds[k] / variances[k];
        }
    }
    if square <= 0.0 {
        return None;
    }
    let count = lost.iter().filter(|l| **l).count();
    Some(Bursts {
        side,
        loss: (against / square).clamp(0.0, 0.99),
        loss_std: square.sqrt().recip(),
        length_s,
        share: count as f64 / rows.len() as f64,
        lost,
        ln_evidence,
        ln_path: path,
    })
}

/// Probability of entering and of leaving a burst, each row.
fn transitions(step_s: f64, length_s: f64, share: f64) -> [f64; 2] {
    let leave = 1.0 - (-step_s / length_s).exp();
    [leave * share / (1.0 - share), leave]
}

/// ln likelihood ratio of the chain over no burst; with `posterior`, the probability of each row to lie in one.
fn forward(ratios: &[f64], [enter, leave]: [f64; 2], posterior: Option<&mut Vec<f64>>) -> f64 {
    let mut inside = enter / (enter + leave);
    let mut ln_total = 0.0;
    let mut filtered = Vec::new();
    let keep = posterior.is_some();
    for ratio in ratios {
        let predicted = inside * (1.0 - leave) + (1.0 - inside) * enter;
        let odds = ratio.clamp(-60.0, 60.0).exp();
        let norm = 1.0 - predicted + predicted * odds;
        ln_total += norm.ln();
        inside = predicted * odds / norm;
        if keep {
            filtered.push(inside);
        }
    }
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

/// Errors without their slow part: medians of blocks, straight lines between them.
fn without_slow(rows: &[(usize, f64, f64)], window: usize) -> Vec<f64> {
    let size = window.clamp(16, rows.len());
    let mut nodes: Vec<(f64, f64)> = Vec::new();
    for block in rows.chunks(size) {
        let mut values: Vec<f64> = block.iter().map(|r| r.1).collect();
        values.sort_by(f64::total_cmp);
        nodes.push((nodes.len() as f64 * size as f64 + 0.5 * block.len() as f64, values[values.len() / 2]));
    }
    let mut at = 0;
    rows.iter()
        .enumerate()
        .map(|(k, row)| {
            let x = k as f64;
            while at + 2 < nodes.len() && nodes[at + 1].0 < x {
                at += 1;
            }
            let slow = match nodes.get(at + 1) {
                Some(&(x1, y1)) => {
                    let (x0, y0) = nodes[at];
                    y0 + (y1 - y0) * ((x - x0) / (x1 - x0)).clamp(0.0, 1.0)
                }
                None => nodes[at].1,
            };
            row.1 - slow
        })
        .collect()
}

impl Bursts {
    /// The drive with the lost ticks put back.
    #[must_use]
    pub fn restored(&self, record: &Record) -> Record {
        let mut out = record.clone();
        for (value, lost) in out.wheels_rad_s[self.side].iter_mut().zip(&self.lost) {
            if *lost {
                *value /= 1.0 - self.loss;
            }
        }
        out
    }

    /// What restoring does to densities: Σ ln 1/(1-λ) over the rows inside.
    #[must_use]
    pub fn ln_jacobian(&self) -> f64 {
        -(1.0 - self.loss).ln() * self.lost.iter().filter(|l| **l).count() as f64
    }
}
