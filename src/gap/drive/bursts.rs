//! e_k = wheel_k - what the other sensors and the model expect;  e ~ N(0, s²) or, inside a burst, N(-λ wheel_k, s²)
//!
//! Missed ticks of one wheel: a hidden Markov chain of two states (Rabiner 1989) over the wheel's prediction error, the
//! wheel itself taking no part in the prediction. Loss, length and share of the bursts lie on a grid; each burst then has a
//! loss of its own, λ_i ~ N(λ, (λ/4)²).

use super::pass::{Channel, Models, Noise, run};
use super::record::Record;

/// Losses that are tried.
const LOSSES: [f64; 16] =
    [4e-4, 7e-4, 1.2e-3, 2.2e-3, 0.004, 0.007, 0.012, 0.02, 0.035, 0.06, 0.1, 0.15, 0.22, 0.33, 0.5, 0.8];
/// Mean lengths of a burst, s.
const LENGTHS_S: [f64; 5] = [0.06, 0.2, 0.7, 2.5, 8.0];
/// Shares of time in bursts.
const SHARES: [f64; 4] = [0.004, 0.02, 0.1, 0.3];
/// Slow errors of the prediction are no bursts: medians over this time are taken out, s. Bursts fill less than half of it.
const SLOW_S: f64 = 40.0;
/// How much the loss of single bursts varies, relatively.
const UNEVEN: f64 = 0.25;
/// Variance of the wheel while it takes no part, relative.
const ASIDE: f64 = 1e6;

/// Bursts in which one wheel read low.
#[derive(Debug, Clone, PartialEq)]
pub struct Bursts {
    /// 0 left, 1 right.
    pub side: usize,
    /// Share lost in each row, zero outside bursts.
    pub lost: Vec<f64>,
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
    /// ln of the evidence over the likelihood with these very bursts and losses: what it costs that nobody knows them.
    pub ln_path: f64,
}

/// What is looked for.
#[derive(Debug, Clone, Copy)]
pub struct Sought {
    /// 0 left, 1 right.
    pub side: usize,
    /// λ, where it is known.
    pub loss: Option<f64>,
    /// Whether the model may be off slowly. What is then taken out takes a part of long bursts along.
    pub slow: bool,
}

/// Looks for bursts of one wheel.
#[must_use]
pub fn find(record: &Record, models: &Models, noise: &Noise, sought: Sought) -> Option<Bursts> {
    let Sought { side, loss: known, slow } = sought;
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
    let errors = if slow {
        without_slow(&rows, &record.wheels_rad_s[side], record.step_s)
    } else {
        rows.iter().map(|r| r.1).collect()
    };
    // the model may be off: what counts is how the errors really scatter
    let mut sizes: Vec<f64> = errors.iter().zip(&rows).map(|(e, r)| e * e / r.2).collect();
    sizes.sort_by(f64::total_cmp);
    let scatter = (sizes[sizes.len() / 2] / 0.4549).max(1.0);
    let speeds: Vec<f64> = rows.iter().map(|r| record.wheels_rad_s[side][r.0] - r.1).collect();
    let variances: Vec<f64> = rows.iter().map(|r| r.2 * scatter).collect();
    // odds of each row to lie in a burst of this loss
    let odds = |loss: f64| -> Vec<f64> {
        (0..errors.len())
            .map(|k| {
                let shift = -loss * speeds[k];
                let ratio = (errors[k] * shift - 0.5 * shift * shift) / variances[k];
                ratio.clamp(-60.0, 60.0).exp()
            })
            .collect()
    };
    let mut best: Option<(f64, [f64; 3])> = None;
    let mut total = Vec::new();
    let losses = known.map_or_else(|| LOSSES.to_vec(), |loss| vec![loss]);
    for loss in losses {
        let odds = odds(loss);
        for length_s in LENGTHS_S {
            for share in SHARES {
                let evidence = forward(&odds, transitions(record.step_s, length_s, share), None);
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
    forward(&odds(loss), rates, Some(&mut posterior));
    let mut lost = vec![0.0; record.len()];
    let (mut all, mut likelihood) = ([0.0; 2], 0.0);
    let mut burst: Option<(usize, [f64; 2])> = None;
    let prior = (UNEVEN * loss).powi(-2);
    for k in 0..=posterior.len() {
        let inside = posterior.get(k).is_some_and(|p| *p > 0.5);
        if inside {
            let (_, [against, square]) = burst.get_or_insert((k, [0.0; 2]));
            *against -= errors[k] * speeds[k] / variances[k];
            *square += speeds[k] * speeds[k] / variances[k];
        } else if let Some((from, [against, square])) = burst.take() {
            let own = ((against + prior * loss) / (square + prior)).clamp(0.0, 0.99);
            rows[from..k].iter().for_each(|r| lost[r.0] = own);
            likelihood += own * against - 0.5 * own * own * square;
            all = [all[0] + against, all[1] + square];
        }
    }
    let [against, square] = all;
    if square <= 0.0 {
        return None;
    }
    let count = lost.iter().filter(|l| **l > 0.0).count();
    Some(Bursts {
        side,
        loss: known.unwrap_or((against / square).clamp(0.0, 0.99)),
        loss_std: square.sqrt().recip(),
        length_s,
        share: count as f64 / rows.len() as f64,
        lost,
        ln_evidence,
        ln_path: ln_evidence - likelihood,
    })
}

/// Probability of entering and of leaving a burst, each row.
fn transitions(step_s: f64, length_s: f64, share: f64) -> [f64; 2] {
    let leave = 1.0 - (-step_s / length_s).exp();
    [leave * share / (1.0 - share), leave]
}

/// ln likelihood ratio of the chain over no burst; with `posterior`, the probability of each row to lie in one.
fn forward(odds: &[f64], [enter, leave]: [f64; 2], posterior: Option<&mut Vec<f64>>) -> f64 {
    let mut inside = enter / (enter + leave);
    let mut ln_total = 0.0;
    // logarithms of products, taken before they leave the range of numbers: one factor lies within e^±61
    let mut product = 1.0;
    let mut filtered = Vec::new();
    let keep = posterior.is_some();
    for odds in odds {
        let predicted = inside * (1.0 - leave) + (1.0 - inside) * enter;
        let norm = 1.0 - predicted + predicted * odds;
        product *= norm;
        if !(1e-200..1e200).contains(&product) {
            ln_total += f64::ln(product);
            product = 1.0;
        }
        inside = predicted * odds / norm;
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

/// Errors without their slow parts: relative ones (radius, track, gain) first, then offsets.
fn without_slow(rows: &[(usize, f64, f64)], wheel: &[f64], step_s: f64) -> Vec<f64> {
    let window = (SLOW_S / step_s) as usize;
    let known = wheel.iter().filter(|w| w.is_finite());
    let fast = known.clone().map(|w| w.abs()).sum::<f64>() / known.count().max(1) as f64;
    let relative = rows.iter().map(|r| if wheel[r.0].abs() > fast { r.1 / wheel[r.0] } else { f64::NAN });
    let slow = medians(&relative.collect::<Vec<_>>(), window);
    let even: Vec<f64> = rows.iter().zip(slow).map(|(r, s)| r.1 - s * wheel[r.0]).collect();
    let slow = medians(&even, window);
    even.iter().zip(slow).map(|(e, s)| e - s).collect()
}

/// Medians of blocks, straight lines between them; values that are no number take no part.
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

impl Bursts {
    /// The drive with the lost ticks put back.
    #[must_use]
    pub fn restored(&self, record: &Record) -> Record {
        let mut out = record.clone();
        out.wheels_rad_s[self.side].iter_mut().zip(&self.lost).for_each(|(value, lost)| *value /= 1.0 - lost);
        out
    }

    /// What restoring does to densities: Σ ln 1/(1-λ) over the rows.
    #[must_use]
    pub fn ln_jacobian(&self) -> f64 {
        -self.lost.iter().map(|l| (-l).ln_1p()).sum::<f64>()
    }
}
