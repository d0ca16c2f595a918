//! x(t) = ± Σ_i A_i exp(-(t - t_i)/τ) + noise, t_i Poisson, A_i exponential: shots that relax
//!
//! Free form that competes with telegraph noise, which shots resemble where a decay is taken for the way back. A hidden
//! Markov chain over the height of the relaxation: it falls by one rung of a logarithmic ladder at a time, and leaps to
//! any rung above. Forward recursion (Rabiner, Proc. IEEE 77 (1989) 257); evidence by a sum over a grid of parameters.

use crate::gap::rest::whittle::evidence::ln_mean_exp;

/// Shots found in a series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Shots {
    /// ln p(series), summed over the grid of parameters, nats.
    pub ln_evidence: f64,
    /// Relaxation time of the best shots, s.
    pub relax_s: f64,
    /// Mean time between the best shots, s.
    pub every_s: f64,
}

/// Rungs of the ladder; the lowest is height zero.
const RUNGS: usize = 14;
/// Ratio of neighbouring heights.
const RATIO: f64 = 1.45;
/// The top rung, in mean heights of a shot.
const TOP: f64 = 4.0;
/// Most samples of the recursion; longer series are averaged.
const MOST: usize = 2500;

/// Probability of each rung after a shot from height zero, heights exponential of mean one.
fn leap() -> [f64; RUNGS] {
    let height = |j: usize| TOP / RATIO.powi((RUNGS - 1 - j) as i32);
    let mut p = [0.0; RUNGS];
    for (j, p) in p.iter_mut().enumerate().skip(1) {
        let from = if j == 1 { 0.0 } else { height(j) / RATIO.sqrt() };
        let to = if j == RUNGS - 1 { f64::INFINITY } else { height(j) * RATIO.sqrt() };
        *p = (-from).exp() - (-to).exp();
    }
    p
}

/// ln p(x) with shots of mean height `size` (unit of x) that relax over `relax` samples, one every `every` samples on
/// average.
fn forward(x: &[f64], std: f64, size: f64, relax: f64, every: f64) -> f64 {
    let leap = leap();
    let height: Vec<f64> =
        (0..RUNGS).map(|j| if j == 0 { 0.0 } else { size * TOP / RATIO.powi((RUNGS - 1 - j) as i32) }).collect();
    // the series has mean zero: the mean of all shots is subtracted
    let floor = -size * relax / every;
    let slope: Vec<f64> = height.iter().map(|h| (h + floor) / (std * std)).collect();
    let square: Vec<f64> = height.iter().map(|h| -0.5 * ((h + floor) / std).powi(2)).collect();
    let down = (1.0 / (relax * RATIO.ln())).min(1.0);
    // several rungs a sample where the relaxation is fast
    let falls = (1.0 / (relax * RATIO.ln())).ceil().max(1.0) as usize;
    let fall = down.min(1.0 / (relax * RATIO.ln()) / falls as f64);
    let shot = 1.0 - (-1.0 / every).exp();
    let mut p = [0.0; RUNGS];
    p[0] = 1.0;
    let mut ln = 0.0;
    for v in x {
        for _ in 0..falls {
            for j in 1..RUNGS {
                let moved = fall * p[j];
                p[j] -= moved;
                p[j - 1] += moved;
            }
        }
        let mut below = 0.0;
        for j in 0..RUNGS {
            let here = p[j];
            // a leap ends on a rung above: one that would end below changes nothing
            p[j] = here * (1.0 - shot) + shot * (leap[j] * below + here * leap[..=j].iter().sum::<f64>());
            below += here;
        }
        let mut total = 0.0;
        let top = (0..RUNGS).map(|j| slope[j] * v + square[j]).fold(f64::NEG_INFINITY, f64::max);
        for j in 0..RUNGS {
            p[j] *= (slope[j] * v + square[j] - top).exp();
            total += p[j];
        }
        ln += total.max(1e-300).ln() + top;
        p.iter_mut().for_each(|p| *p /= total.max(1e-300));
    }
    let noise: f64 = x.iter().map(|v| -0.5 * (v / std).powi(2)).sum();
    ln + noise - x.len() as f64 * (std * std::f64::consts::TAU.sqrt()).ln()
}

/// Judges a series with white noise of standard deviation `std`, sampled every `step_s`. Its ln evidence is comparable
/// to that of other explanations of the same series.
#[must_use]
pub(crate) fn judge(series: &[f64], std: f64, step_s: f64) -> Shots {
    let per = series.len().div_ceil(MOST).max(1);
    let mean = series.iter().sum::<f64>() / series.len().max(1) as f64;
    let x: Vec<f64> = series.chunks_exact(per).map(|c| c.iter().sum::<f64>() / per as f64 - mean).collect();
    let noise = std / (per as f64).sqrt();
    // the part of the series that averaging removes is noise under every hypothesis
    let within: f64 = {
        let ln = |v: f64, s: f64| -0.5 * ((v / s).powi(2) + (std::f64::consts::TAU * s * s).ln());
        let all: f64 = series[..x.len() * per].iter().map(|v| ln(v - mean, std)).sum();
        let means: f64 = x.iter().map(|v| ln(*v, noise)).sum();
        let rest: f64 = series[x.len() * per..].iter().map(|v| ln(v - mean, std)).sum();
        all - means + rest
    };
    let n = x.len() as f64;
    let mut found: Vec<(f64, f64, f64)> = Vec::new();
    for relax in [1.0, 2.5, 6.0, 15.0, 40.0, 100.0] {
        for every in [5.0, 15.0, 45.0].map(|r: f64| r * relax) {
            if every > n / 4.0 {
                continue;
            }
            for clear in [2.0, 5.0, 12.0, 30.0, 80.0] {
                for sign in [-1.0, 1.0] {
                    // a shot's energy is size² relax / 2
                    let size = clear * noise / (0.5 * relax).sqrt();
                    let signed: Vec<f64> = x.iter().map(|v| sign * v).collect();
                    found.push((forward(&signed, noise, size, relax, every), relax, every));
                }
            }
        }
    }
    let values: Vec<f64> = found.iter().map(|f| f.0).collect();
    let best = found.iter().max_by(|a, b| a.0.total_cmp(&b.0)).copied().unwrap_or((f64::NEG_INFINITY, 0.0, 0.0));
    Shots {
        ln_evidence: ln_mean_exp(&values, values.len().max(1) as f64) + within,
        relax_s: best.1 * per as f64 * step_s,
        every_s: best.2 * per as f64 * step_s,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gap::rest::nongaussian::two_levels;
    use crate::math::random::Stream;

    fn noisy(draw: &mut Stream, path: Vec<f64>) -> Vec<f64> {
        path.into_iter().map(|v| v + draw.normal()).collect()
    }

    fn against_two_levels(x: &[f64]) -> f64 {
        let chain = two_levels::fit(x, 1.0, 3.0, 40.0, 30);
        judge(x, 1.0, 1.0).ln_evidence - two_levels::evidence(x, 1.0, &chain).1
    }

    #[test]
    fn shots_are_told_from_two_levels_both_ways() {
        let mut draw = Stream::new(4, 0);
        let (mut h, mut s) = (0.0_f64, 0.0);
        let mut shots = Vec::new();
        let mut levels = Vec::new();
        for _ in 0..2400 {
            h *= (-1.0_f64 / 25.0).exp();
            if draw.uniform() < 1.0 / 200.0 {
                h += -6.0 * (1.0 - draw.uniform()).ln();
            }
            if draw.uniform() < 1.0 / 60.0 {
                s = 3.0 - s;
            }
            shots.push(h);
            levels.push(s);
        }
        let shots = noisy(&mut draw, shots);
        let levels = noisy(&mut draw, levels);
        assert!(against_two_levels(&shots) > 20.0, "{}", against_two_levels(&shots));
        assert!(against_two_levels(&levels) < -20.0, "{}", against_two_levels(&levels));
        let found = judge(&shots, 1.0, 0.5);
        assert!((found.relax_s / 12.5).ln().abs() < 0.7, "{found:?}");
    }
}
