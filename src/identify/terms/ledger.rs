//! Contribution of each cause to the heading error over a horizon h, in place of 'multiply by ten'
//!
//! A filter that knew the whole past without error would still not know what the noise does next. That innovation of the
//! integrated rate has the variance
//!
//! ```text
//! white N             N² h
//! bias instability B  (2/π) B² h²          S = B²/|ω| is white noise integrated half a time: ∫ (h-s)/Γ(3/2)² ds
//! random walk K       K² h³/3
//! Gauss-Markov σ, T   2σ²T [h - 2T(1 - e^{-h/T}) + T/2 (1 - e^{-2h/T})]
//! quantisation Q      2 Q²                 of the angle at both ends
//! rate ramp R         (R h²/2)²            a certain error, if nobody takes it out
//! narrow band σ, f₀   2 σ²/(2πf₀)²         the swing at both ends
//! ```
//!
//! A filter whose only noise is white needs the density √(Σ variances/h): that over N is the factor, and the table is the
//! reason for it.

use super::term::TermEstimate;
use crate::identify::types::Fit;
use crate::noise::TermKind;
use serde::Serialize;

/// One cause.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LedgerEntry {
    /// Identifier: of a term, `turn_on_spread`, `warm_up_residual` or `warm_up_not_removed`.
    pub id: String,
    /// Description of the cause.
    pub cause: String,
    /// Standard deviation (of a ramp and a warm-up: size) of the heading error that it leaves, rad; `None` where it is not known.
    pub heading_std_rad: Option<f64>,
    /// Share of the variance of those that count.
    pub share: f64,
    /// Whether it is part of the sum; the others show the cost of leaving something out.
    pub counted: bool,
}

/// The ledger.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Ledger {
    /// Over how long a heading is carried without correction, s.
    pub horizon_s: f64,
    /// The causes, the largest first.
    pub entries: Vec<LedgerEntry>,
    /// Standard deviation of all that count, rad.
    pub heading_std_rad: f64,
    /// White noise density that a filter without a bias state should assume, rad/s/√Hz: all that counts.
    pub noise_density_rad_s_sqrt_hz: f64,
    /// That over the N of the log.
    pub factor: f64,
    /// The density for a filter with a bias state that is driven by this log's random walk and starts at the spread of
    /// the turn-on: white noise and what neither describes, rad/s/√Hz.
    pub noise_density_with_bias_state_rad_s_sqrt_hz: f64,
}

/// Variance of the heading that a term adds over `h` seconds, per squared size.
fn innovation(kind: TermKind, h: f64, time_s: f64) -> f64 {
    match kind {
        TermKind::Quantization => 2.0,
        TermKind::AngleRandomWalk => h,
        TermKind::BiasInstability => 2.0 / std::f64::consts::PI * h * h,
        TermKind::RateRandomWalk => h.powi(3) / 3.0,
        TermKind::RateRamp => 0.25 * h.powi(4),
        // its own frequency says how much: see `vibration`
        TermKind::Bandwidth | TermKind::NarrowBandNoise => 0.0,
        TermKind::GaussMarkov => {
            let x = h / time_s;
            if x < 1e-3 {
                // a random walk of drive 2σ²/T
                return 2.0 * h.powi(3) / (3.0 * time_s) * (1.0 - 0.75 * x);
            }
            let (once, twice) = (-(-x).exp_m1(), -(-2.0 * x).exp_m1());
            2.0 * time_s * (h - 2.0 * time_s * once + 0.5 * time_s * twice)
        }
    }
}

/// Variance of the heading that a band swings by, per squared size: the integral of a line at f₀ has the amplitude 1/(2πf₀),
/// at both ends of the horizon.
fn vibration(t: &TermEstimate) -> f64 {
    t.center_hz.map_or(0.0, |f| 2.0 / (std::f64::consts::TAU * f.estimate).powi(2))
}

/// Contributions to the heading error over `horizon_s` after power-on. `turn_on_std_rad_s` is known from many power-ons
/// alone.
pub(super) fn ledger(
    terms: &[TermEstimate],
    warm_up: Option<&Fit>,
    turn_on_std_rad_s: Option<f64>,
    horizon_s: f64,
) -> Ledger {
    let h = horizon_s;
    let entry = |id: &str, cause: &str, std: Option<f64>, counted: bool| LedgerEntry {
        id: id.into(),
        cause: cause.into(),
        heading_std_rad: std,
        share: 0.0,
        counted,
    };
    let mut entries: Vec<LedgerEntry> = terms
        .iter()
        .filter(|t| t.id != TermKind::Bandwidth)
        .map(|t| {
            let time = t.correlation_time_s.map_or(0.0, |c| c.estimate);
            let std = t.estimate.abs() * innovation(t.id, h, time).max(vibration(t)).sqrt();
            entry(t.id.id(), t.id.title(), Some(std), true)
        })
        .collect();
    entries.push(entry(
        "turn_on_spread",
        "bias of one power-on against another, not estimated",
        turn_on_std_rad_s.map(|s| s * h),
        true,
    ));
    if let Some(fit) = warm_up {
        let model = fit.model();
        // heading by the model's error: its gradient integrated from power-on
        let steps = 200;
        let dt = h / f64::from(steps);
        let mut gradient = [0.0; 3];
        let mut drift = 0.0;
        for i in 0..steps {
            let t = (f64::from(i) + 0.5) * dt;
            let here = model.gradient(t);
            gradient.iter_mut().zip(here).for_each(|(g, v)| *g += v * dt);
            drift += (model.error_rad_s(t) - model.error_rad_s(0.0)) * dt;
        }
        // C2 is the turn-on's: what the warm-up adds is C1 and T
        let [g1, _, g3] = gradient;
        let c = &fit.covariance;
        let variance = g1 * g1 * c[0][0] + 2.0 * g1 * g3 * c[0][2] + g3 * g3 * c[2][2];
        entries.push(entry(
            "warm_up_residual",
            "warm-up after power-on, removed by this fit: what C1 and T are uncertain by",
            Some(variance.max(0.0).sqrt()),
            true,
        ));
        entries.push(entry(
            "warm_up_not_removed",
            "the same warm-up, bias held at its value at power-on: the cost of not removing it",
            Some(drift.abs()),
            false,
        ));
    }
    let sum = |kept: &dyn Fn(&LedgerEntry) -> bool| -> f64 {
        entries.iter().filter(|e| e.counted && kept(e)).filter_map(|e| e.heading_std_rad).map(|v| v * v).sum()
    };
    let total = sum(&|_| true);
    let walk = TermKind::RateRandomWalk.id();
    let beside = sum(&|e| e.id != walk && e.id != "turn_on_spread");
    let white = terms.iter().find(|t| t.id == TermKind::AngleRandomWalk).map_or(f64::NAN, |t| t.estimate);
    for e in entries.iter_mut().filter(|e| e.counted) {
        e.share = e.heading_std_rad.map_or(0.0, |v| v * v / total);
    }
    entries.sort_by(|a, b| {
        let size = |e: &LedgerEntry| e.heading_std_rad.unwrap_or(-1.0);
        b.counted.cmp(&a.counted).then(size(b).total_cmp(&size(a)))
    });
    Ledger {
        horizon_s,
        entries,
        heading_std_rad: total.sqrt(),
        noise_density_rad_s_sqrt_hz: (total / h).sqrt(),
        factor: (total / h).sqrt() / white,
        noise_density_with_bias_state_rad_s_sqrt_hz: (beside / h).sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn innovations_have_their_limits() {
        for h in [0.5, 60.0] {
            // long correlation: a random walk of K² = 2σ²/T; short: white noise of density 2σ²T
            let long = innovation(TermKind::GaussMarkov, h, 1e5 * h);
            let walk = 2.0 / (1e5 * h) * innovation(TermKind::RateRandomWalk, h, 0.0);
            assert!((long / walk - 1.0).abs() < 1e-4, "{long} {walk}");
            let short = innovation(TermKind::GaussMarkov, h, 1e-4 * h);
            assert!((short / (2e-4 * h * h) - 1.0).abs() < 2e-4, "{short}");
            // both formulas meet
            let [below, above] = [0.999e-3, 1.001e-3].map(|x| innovation(TermKind::GaussMarkov, x, 1.0) / x.powi(3));
            assert!((below / above - 1.0).abs() < 1e-4, "{below} {above}");
        }
    }
}
