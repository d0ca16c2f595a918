//! S(f), two-sided, and σ²(τ):
//!
//! ```text
//! quantisation Q        4 Q²/Δt sin²(πfΔt)      3 Q²/τ²
//! angle random walk N   N²                      N²/τ
//! bias instability B    B²/(2πf)                (2 ln 2/π) B²
//! rate random walk K    K²/(2πf)²               K² τ/3
//! rate ramp R           -                       R² τ²/2
//! Gauss-Markov σ, T     2σ²T/(1+(2πfT)²)        (2σ²T/τ) [1 - (T/2τ)(3 - 4exp(-τ/T) + exp(-2τ/T))]
//! low-pass f_c          N² |H(f)|²              N²/τ where τ is many samples
//! narrow band σ, f₀, Δ  a line at f₀            by quadrature
//! ```
//!
//! IEEE Std 952-1997, annex C. Q is of the integrated angle; a rate on a lattice adds white noise, and is no Q.
//! A Gauss-Markov term is also given by its drive q: σ² = q² T/2.

use serde::Serialize;
use std::f64::consts::{LN_2, PI, TAU};

/// Kinds of stochastic terms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TermKind {
    /// Q, rad.
    Quantization,
    /// N, rad/√s.
    AngleRandomWalk,
    /// B, rad/s.
    BiasInstability,
    /// K, rad/s/√s.
    RateRandomWalk,
    /// R, rad/s².
    RateRamp,
    /// σ, rad/s, with a correlation time, s.
    GaussMarkov,
    /// Half-power frequency of the low-pass before the white noise is sampled, Hz; N is that of the plateau below it.
    Bandwidth,
    /// σ of the noise in a band, rad/s, with its centre and width, Hz.
    NarrowBandNoise,
}

/// A unit that datasheets use, and how many of it are one SI unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Unit {
    /// Name in reports and files.
    pub name: &'static str,
    /// Value in this unit of one SI unit.
    pub per_si: f64,
}

const DEG: f64 = 180.0 / PI;

impl TermKind {
    /// All kinds, by rising slope of the Allan deviation; at the end those that shape the spectrum near the sample rate.
    pub const ALL: [Self; 8] = [
        Self::Quantization,
        Self::AngleRandomWalk,
        Self::BiasInstability,
        Self::RateRandomWalk,
        Self::RateRamp,
        Self::GaussMarkov,
        Self::Bandwidth,
        Self::NarrowBandNoise,
    ];

    /// Whether it shapes the spectrum near the sample rate, by parameters of its own: [`super::LowPass`] and
    /// [`super::BandForm`] say how. Spectra and Allan variances here are zero for these.
    #[must_use]
    pub(crate) fn shapes(self) -> bool {
        matches!(self, Self::Bandwidth | Self::NarrowBandNoise)
    }

    /// Identifier in JSON and on the command line.
    #[must_use]
    pub fn id(self) -> &'static str {
        match self {
            Self::Quantization => "quantization",
            Self::AngleRandomWalk => "angle_random_walk",
            Self::BiasInstability => "bias_instability",
            Self::RateRandomWalk => "rate_random_walk",
            Self::RateRamp => "rate_ramp",
            Self::GaussMarkov => "gauss_markov",
            Self::Bandwidth => "bandwidth",
            Self::NarrowBandNoise => "narrow_band_noise",
        }
    }

    /// The kind with this identifier, or with the letter of its symbol.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let key = text.trim().to_lowercase().replace('-', "_");
        Self::ALL.into_iter().find(|k| k.id() == key || k.symbol().to_lowercase() == key)
    }

    /// Name for people.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Quantization => "quantisation",
            Self::AngleRandomWalk => "angle random walk",
            Self::BiasInstability => "bias instability",
            Self::RateRandomWalk => "rate random walk",
            Self::RateRamp => "rate ramp",
            Self::GaussMarkov => "Gauss-Markov",
            Self::Bandwidth => "low-pass, half power",
            Self::NarrowBandNoise => "narrow-band noise",
        }
    }

    /// Letter in formulas.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Quantization => "Q",
            Self::AngleRandomWalk => "N",
            Self::BiasInstability => "B",
            Self::RateRandomWalk => "K",
            Self::RateRamp => "R",
            Self::GaussMarkov => "GM",
            Self::Bandwidth => "BW",
            Self::NarrowBandNoise => "NB",
        }
    }

    /// SI unit of the size.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Quantization => "rad",
            Self::AngleRandomWalk => "rad/s/sqrt(Hz)",
            Self::BiasInstability | Self::GaussMarkov | Self::NarrowBandNoise => "rad/s",
            Self::Bandwidth => "Hz",
            Self::RateRandomWalk => "rad/s^2/sqrt(Hz)",
            Self::RateRamp => "rad/s^2",
        }
    }

    /// The units in which datasheets state the size, the usual one first.
    #[must_use]
    pub(crate) fn datasheet_units(self) -> &'static [Unit] {
        const HOUR: f64 = 3600.0;
        match self {
            Self::Quantization => &[Unit { name: "arcsec", per_si: DEG * 3600.0 }, Unit { name: "µrad", per_si: 1e6 }],
            Self::AngleRandomWalk => {
                &[Unit { name: "°/√h", per_si: DEG * 60.0 }, Unit { name: "°/s/√Hz", per_si: DEG }]
            }
            Self::NarrowBandNoise => &[Unit { name: "°/s", per_si: DEG }],
            Self::Bandwidth => &[],
            Self::BiasInstability | Self::GaussMarkov => {
                &[Unit { name: "°/h", per_si: DEG * HOUR }, Unit { name: "°/s", per_si: DEG }]
            }
            // (°/h)/√h = DEG · 3600 · √3600 per rad/s/√s
            Self::RateRandomWalk => &[Unit { name: "°/h/√h", per_si: DEG * HOUR * 60.0 }],
            Self::RateRamp => &[Unit { name: "°/h/h", per_si: DEG * HOUR * HOUR }],
        }
    }

    /// Slope of the Allan deviation on log-log paper; none of a Gauss-Markov term, which has a hump.
    #[must_use]
    pub fn slope(self) -> Option<f64> {
        match self {
            Self::Quantization => Some(-1.0),
            Self::AngleRandomWalk => Some(-0.5),
            Self::BiasInstability => Some(0.0),
            Self::RateRandomWalk => Some(0.5),
            Self::RateRamp => Some(1.0),
            Self::GaussMarkov | Self::Bandwidth | Self::NarrowBandNoise => None,
        }
    }

    /// S(f)/size², two-sided, 1/Hz times the unit of the rate over that of the size, squared. `correlation_time_s` is read
    /// for Gauss-Markov terms alone, `step_s` for quantisation alone. A ramp has none: 0.
    #[must_use]
    pub fn spectrum(self, frequency_hz: f64, step_s: f64, correlation_time_s: f64) -> f64 {
        let omega = TAU * frequency_hz;
        match self {
            Self::Quantization => 4.0 / step_s * (0.5 * omega * step_s).sin().powi(2),
            Self::AngleRandomWalk => 1.0,
            Self::BiasInstability => 1.0 / omega,
            Self::RateRandomWalk => omega.powi(-2),
            Self::RateRamp | Self::Bandwidth | Self::NarrowBandNoise => 0.0,
            Self::GaussMarkov => 2.0 * correlation_time_s / (1.0 + (omega * correlation_time_s).powi(2)),
        }
    }

    /// σ²(τ)/size² of the continuous process, averaging time `tau_s`.
    #[must_use]
    pub fn allan_variance(self, tau_s: f64, correlation_time_s: f64) -> f64 {
        match self {
            Self::Quantization => 3.0 / (tau_s * tau_s),
            Self::AngleRandomWalk => 1.0 / tau_s,
            Self::BiasInstability => 2.0 * LN_2 / PI,
            Self::RateRandomWalk => tau_s / 3.0,
            Self::RateRamp => 0.5 * tau_s * tau_s,
            Self::GaussMarkov => gauss_markov(tau_s / correlation_time_s),
            Self::Bandwidth | Self::NarrowBandNoise => 0.0,
        }
    }

    /// σ²(mΔt)/size² of the process as it is sampled, m samples averaged: where averaging times are few samples long, it
    /// differs from [`TermKind::allan_variance`].
    ///
    /// K: K²Δt (2m²+1)/6m. Gauss-Markov: Zhang, Metrologia 45 (2008) 549. B: by quadrature of the sampled spectrum
    /// B²/(2πf), cut at half the sample rate.
    #[must_use]
    pub fn sampled_allan_variance(self, m: usize, step_s: f64, correlation_time_s: f64) -> f64 {
        let (n, tau) = (m as f64, m as f64 * step_s);
        match self {
            Self::RateRandomWalk => step_s * (2.0 * n * n + 1.0) / (6.0 * n),
            Self::GaussMarkov => sampled_gauss_markov(n, step_s / correlation_time_s),
            Self::BiasInstability => sampled_flicker(m),
            _ => self.allan_variance(tau, correlation_time_s),
        }
    }

    /// Expected squares, per size², of the orthonormal cosine coefficients (`math::dct`) of `len` samples `step_s` apart, at
    /// coefficient numbers `k` > 0, which may be fractional: those of a bin's middle.
    ///
    /// White noise and random walk are exactly independent there. Of the others this is the exact expectation, ends
    /// included, or, of flicker noise, its limit for many samples: S(ω_k) alone would be wrong by 2/π²k of it.
    #[must_use]
    pub(crate) fn cosine_variances(self, k: &[f64], len: usize, step_s: f64, correlation_time_s: f64) -> Vec<f64> {
        let n = len as f64;
        let half = |k: f64| 0.5 * PI * k / n;
        match self {
            // differences of white angle noise: the ends add 4/n cos²(ω/2)
            Self::Quantization => {
                let at = |k: f64| (4.0 * half(k).sin().powi(2) + 4.0 / n * half(k).cos().powi(2)) / (step_s * step_s);
                k.iter().map(|k| at(*k)).collect()
            }
            Self::AngleRandomWalk => vec![1.0 / step_s; k.len()],
            Self::BiasInstability => k.iter().map(|k| flicker_at_ends(*k) / (2.0 * half(*k))).collect(),
            Self::RateRandomWalk => k.iter().map(|k| step_s / (4.0 * half(*k).sin().powi(2))).collect(),
            Self::RateRamp | Self::Bandwidth | Self::NarrowBandNoise => vec![0.0; k.len()],
            Self::GaussMarkov => gauss_markov_cosine(k, n, step_s / correlation_time_s),
        }
    }
}

/// σ²(τ)/σ², x = τ/T; by its series where x is small.
fn gauss_markov(x: f64) -> f64 {
    if x < 1e-3 {
        // 2/x [1 - (3 - 4e⁻ˣ + e⁻²ˣ)/2x] = 2x/3 - x²/2 + 7x³/30 - ...
        return x * (2.0 / 3.0 - x * (0.5 - x * 7.0 / 30.0));
    }
    let e = (-x).exp_m1();
    // 3 - 4e⁻ˣ + e⁻²ˣ = -2e + e²
    2.0 / x * (1.0 - (-2.0 * e + e * e) / (2.0 * x))
}

/// The same of samples, h = Δt/T: [n (1-φ²) - 3φ + 4φⁿ⁺¹ - φ²ⁿ⁺¹]/[n²(1-φ)²].
fn sampled_gauss_markov(n: f64, h: f64) -> f64 {
    if n * h < 1e-3 {
        // a random walk of increments 2h that is bent by its decay, where the differences below cancel: relative error (nh)²
        let walk = (2.0 * n * n + 1.0) / (3.0 * n);
        return h * (walk - 0.5 * h * n * n);
    }
    let gap = -(-h).exp_m1();
    let phi = (-h).exp();
    let top = -n * (-2.0 * h).exp_m1() - 3.0 * phi + 4.0 * (-(n + 1.0) * h).exp() - (-(2.0 * n + 1.0) * h).exp();
    top / (n * gap).powi(2)
}

/// From here on sampling changes the Allan variance of flicker noise by less than 1e-4 of it.
const SAMPLED: usize = 32;

/// (1/π) ∫ (1/ω) 2 sin⁴(mω/2)/(m sin(ω/2))² dω from 0 to π.
fn sampled_flicker(m: usize) -> f64 {
    let limit = 2.0 * LN_2 / PI;
    if m > SAMPLED {
        return limit;
    }
    let n = m as f64;
    let density = |omega: f64| {
        let top = (0.5 * n * omega).sin();
        2.0 * top.powi(4) / (n * (0.5 * omega).sin()).powi(2) / omega
    };
    // midpoints: the integrand is smooth, and vanishes at zero
    let cells = 2000 * m;
    let width = PI / cells as f64;
    (0..cells).map(|i| density((i as f64 + 0.5) * width)).sum::<f64>() * width / PI
}

/// E z_k²/S(ω_k) of flicker noise: 4k ∫ ν (1 - (-1)ᵏ cos ν)/(ν² - π²k²)² dν from 0 to ∞, which tends to 1 - 2/π²k. The first
/// six by quadrature.
fn flicker_at_ends(k: f64) -> f64 {
    const FIRST: [f64; 6] = [
        0.773_695_009_907_6,
        0.902_823_333_589_7,
        0.931_091_563_727_4,
        0.949_939_339_785_8,
        0.959_157_381_491_6,
        0.966_410_435_022_7,
    ];
    let whole = k.round() as usize;
    match FIRST.get(whole.wrapping_sub(1)) {
        Some(r) => *r,
        None => 1.0 - 2.0 / (PI * PI * k),
    }
}

/// Stationary AR(1) of unit variance, h = Δt/T. Its precision is (1-φ)² I + φ L + φ(1-φ)(e₁e₁ᵀ + eₙeₙᵀ), L the differences'
/// normal matrix, over 1-φ²: what the cosines diagonalise, and one direction each among even and odd coefficients, which
/// Woodbury's formula takes out.
fn gauss_markov_cosine(k: &[f64], n: f64, h: f64) -> Vec<f64> {
    let (phi, gap, drive) = ((-h).exp(), -(-h).exp_m1(), -(-2.0 * h).exp_m1());
    let half = |k: f64| 0.5 * PI * k / n;
    let free = |k: f64| drive / (gap * gap + 4.0 * phi * half(k).sin().powi(2));
    let kappa = phi * gap / drive;
    // column one of what the cosines diagonalise: a (φⁱ + φ²ⁿ⁺¹⁻ⁱ), i = 1 ... n
    let a = drive / (phi * gap * -(-2.0 * h * n).exp_m1());
    let near = a * (phi + (-2.0 * h * n).exp());
    let far = a * (-h * n).exp() * (1.0 + phi);
    k.iter()
        .map(|k| {
            let d = free(*k);
            let g2 = 4.0 / n * half(*k).cos().powi(2);
            let sign = if (k.round() as i64) % 2 == 0 { 1.0 } else { -1.0 };
            d - d * d * g2 * kappa / (1.0 + kappa * (near + sign * far))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::dct::Cosine;

    /// σ²(τ) = 2 ∫ S(f) 2 sin⁴(πfτ)/(πfτ)² df from zero, by the trapezoidal rule in ln f.
    fn by_spectrum(spectrum: impl Fn(f64) -> f64, tau: f64, high_hz: f64) -> f64 {
        let (low, points) = (1e-5 / tau, 400_000);
        let step = (high_hz / low).ln() / f64::from(points);
        (0..points)
            .map(|i| low * ((f64::from(i) + 0.5) * step).exp())
            .map(|f| {
                let x = PI * f * tau;
                2.0 * spectrum(f) * 2.0 * x.sin().powi(4) / (x * x) * f * step
            })
            .sum()
    }

    #[test]
    fn spectrum_and_allan_variance_are_one_another() {
        for kind in [TermKind::AngleRandomWalk, TermKind::BiasInstability, TermKind::RateRandomWalk] {
            for tau in [0.3, 20.0] {
                let found = by_spectrum(|f| kind.spectrum(f, 0.0, 0.0), tau, 3e3 / tau);
                assert!((found / kind.allan_variance(tau, 0.0) - 1.0).abs() < 1e-3, "{kind:?} {tau}: {found}");
            }
        }
        for (tau, time) in [(0.1, 3.0), (5.0, 3.0), (1e-4, 3.0), (400.0, 3.0)] {
            let found = by_spectrum(|f| TermKind::GaussMarkov.spectrum(f, 0.0, time), tau, 3e3 / tau);
            let known = TermKind::GaussMarkov.allan_variance(tau, time);
            assert!((found / known - 1.0).abs() < 1e-3, "{tau}: {found} {known}");
        }
        // the hump: 0.437 q √T at 1.89 T, with σ² = q² T/2
        let peak = TermKind::GaussMarkov.allan_variance(1.89, 1.0).sqrt() * 0.5_f64.sqrt();
        assert!((peak - 0.437).abs() < 5e-4, "{peak}");
    }

    /// Allan variance from the autocovariance r of the samples: Σ over the 2m weights.
    fn by_covariance(m: usize, r: impl Fn(usize) -> f64) -> f64 {
        let weight = |i: usize| if i < m { -1.0 } else { 1.0 } / m as f64;
        let all = (0..2 * m).flat_map(|i| (0..2 * m).map(move |j| (i, j)));
        0.5 * all.map(|(i, j)| weight(i) * weight(j) * r(i.abs_diff(j))).sum::<f64>()
    }

    #[test]
    fn sampled_allan_variances_are_those_of_the_samples() {
        let step = 0.02;
        for m in [1, 2, 3, 17, 64] {
            for time in [0.005, 0.7, 40.0, 3e4] {
                let known = by_covariance(m, |lag| (-(lag as f64) * step / time).exp());
                let found = TermKind::GaussMarkov.sampled_allan_variance(m, step, time);
                assert!((found / known - 1.0).abs() < 1e-5, "{m} {time}: {found} {known}");
            }
            // a random walk has the generalised covariance -K²Δt lag/2
            let known = by_covariance(m, |lag| -0.5 * step * lag as f64);
            let found = TermKind::RateRandomWalk.sampled_allan_variance(m, step, 0.0);
            assert!((found / known - 1.0).abs() < 1e-10, "{m}: {found} {known}");
        }
        let flicker = |m| TermKind::BiasInstability.sampled_allan_variance(m, step, 0.0);
        // γ + ln π - Ci(π) over π, at one sample
        assert!((flicker(1) - (0.577_215_664_9 + PI.ln() - 0.073_667_912_0) / PI).abs() < 1e-6, "{}", flicker(1));
        assert!((flicker(SAMPLED) / flicker(SAMPLED + 1) - 1.0).abs() < 1e-3);
    }

    /// E z_k² from a covariance matrix r(i, j) of the samples.
    fn dense(n: usize, r: impl Fn(usize, usize) -> f64) -> Vec<f64> {
        let cosine = Cosine::new(n);
        let unit = |i: usize| cosine.forward(&(0..n).map(|j| f64::from(u8::from(i == j))).collect::<Vec<_>>());
        let basis: Vec<Vec<f64>> = (0..n).map(unit).collect();
        let at = |k: usize| (0..n).map(|i| (0..n).map(|j| basis[i][k] * basis[j][k] * r(i, j)).sum::<f64>()).sum();
        (1..n).map(at).collect()
    }

    #[test]
    fn expected_squares_of_cosine_coefficients_hold_with_the_ends() {
        let (n, step) = (60, 0.5);
        let k: Vec<f64> = (1..n).map(|k| k as f64).collect();
        let check = |kind: TermKind, time: f64, known: Vec<f64>, bound: f64| {
            let found = kind.cosine_variances(&k, n, step, time);
            for (k, (a, b)) in found.iter().zip(&known).enumerate() {
                assert!((a / b - 1.0).abs() < bound, "{kind:?} {time}, {}: {a} {b}", k + 1);
            }
        };
        for time in [0.1, 2.0, 15.0, 300.0, 1e5] {
            let known = dense(n, |i, j| (-(i.abs_diff(j) as f64) * step / time).exp());
            check(TermKind::GaussMarkov, time, known, 1e-7);
        }
        let q = |i: usize, j: usize| match i.abs_diff(j) {
            0 => 2.0 / (step * step),
            1 => -1.0 / (step * step),
            _ => 0.0,
        };
        check(TermKind::Quantization, 0.0, dense(n, q), 1e-9);
        check(TermKind::RateRandomWalk, 0.0, dense(n, |i, j| -0.5 * step * i.abs_diff(j) as f64), 1e-9);
        check(TermKind::AngleRandomWalk, 0.0, dense(n, |i, j| f64::from(u8::from(i == j)) / step), 1e-9);
        // flicker noise: generalised covariance -ln|lag|/π, of unit-wide averages; the lowest coefficients know no sampling
        let n = 400;
        let x2 = |x: f64| if x == 0.0 { 0.0 } else { 0.5 * x * x * x.abs().ln() - 0.75 * x * x };
        let known = dense_few(n, 6, |i, j| {
            let d = i.abs_diff(j) as f64;
            -(x2(d + 1.0) - 2.0 * x2(d) + x2(d - 1.0)) / PI
        });
        let found = TermKind::BiasInstability.cosine_variances(&k[..6], n, step, 0.0);
        for (a, b) in found.iter().zip(known) {
            assert!((a / b - 1.0).abs() < 2e-3, "{a} {b}");
        }
    }

    fn dense_few(n: usize, most: usize, r: impl Fn(usize, usize) -> f64) -> Vec<f64> {
        let c =
            |k: usize, i: usize| (2.0 / n as f64).sqrt() * (PI * k as f64 * (2 * i + 1) as f64 / (2 * n) as f64).cos();
        let at = |k: usize| (0..n).map(|i| (0..n).map(|j| c(k, i) * c(k, j) * r(i, j)).sum::<f64>()).sum();
        (1..=most).map(at).collect()
    }

    #[test]
    fn datasheet_units_are_what_their_names_say() {
        let value = |kind: TermKind, unit: usize, si: f64| si * kind.datasheet_units()[unit].per_si;
        // 0.15 °/√h is 0.0025 °/s/√Hz
        let n = 0.15 / TermKind::AngleRandomWalk.datasheet_units()[0].per_si;
        assert!((value(TermKind::AngleRandomWalk, 1, n) - 0.0025).abs() < 1e-15);
        assert!((value(TermKind::BiasInstability, 0, 1.0f64.to_radians() / 3600.0) - 1.0).abs() < 1e-12);
        // in an hour a walk of 1 °/h/√h has a standard deviation of 1 °/h
        let k = 1.0 / TermKind::RateRandomWalk.datasheet_units()[0].per_si;
        assert!((k * 3600f64.sqrt() - 1.0f64.to_radians() / 3600.0).abs() < 1e-18);
        for kind in TermKind::ALL {
            assert_eq!(TermKind::parse(kind.id()), Some(kind));
            assert_eq!(TermKind::parse(kind.symbol()), Some(kind));
        }
    }
}
