//! y_k = fixed_k + Σ_j x_jk β_j + Σ_i s_ik + level_k + v_k: the parts, their units, and their checks.

use crate::error::{Error, ErrorKind, Result};
use std::ops::Range;

/// Predictive model of one recording at rest, before its samples are seen. All rates in rad/s; one entry a row where a
/// vector has rows.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StateSpaceModel {
    /// Number of rows.
    pub rows: usize,
    /// Sample time, s.
    pub step_s: f64,
    /// Standard deviation of a sample's white noise, rad/s.
    pub white_std_rad_s: f64,
    /// Factor on `white_std_rad_s` in each row (noise growth); none: 1.
    pub white_scale: Option<Vec<f64>>,
    /// Known part of the reading, rad/s; none: 0.
    pub fixed_rad_s: Option<Vec<f64>>,
    /// Unknown constants times known columns.
    pub coefficients: Vec<Coefficient>,
    /// Independent scalar states, added up.
    pub markov: Vec<Markov>,
    /// Independent damped oscillators, the first component of each added up: noise in a band.
    pub oscillators: Vec<Oscillator>,
    /// ARMA filter of the white noise; none: it stays white.
    pub low_pass: Option<LowPass>,
    /// Quantization step of the readings, rad/s; none: not quantized. The log density of a row is then ln(probability
    /// of its cell / step).
    pub lattice_lsb_rad_s: Option<f64>,
    /// Rare samples with additional variance; none: no outliers.
    pub outliers: Option<Outliers>,
    /// Telegraph noise: two levels between which the bias jumps at random.
    pub telegraph: Option<Telegraph>,
    /// One jump of the bias at an unknown row.
    pub step: Option<Step>,
}

/// β ~ N(mean, std²), constant over the recording.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Coefficient {
    /// One value a row, rad/s per unit of β.
    pub column: Vec<f64>,
    /// Prior mean.
    pub mean: f64,
    /// Prior standard deviation.
    pub std: f64,
}

/// s\[k+1\] = decay s\[k\] + N(0, variance), s\[0\] ~ N(0, initial_variance).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Markov {
    /// φ, -1 < φ <= 1: 1 is a random walk.
    pub decay: f64,
    /// q, added in each row, rad²/s².
    pub variance: f64,
    /// Variance in the first row, rad²/s².
    pub initial_variance: f64,
}

impl Markov {
    /// A random walk that begins at zero, since the turn-on bias holds its offset. `rate_random_walk` is in rad/s/√s.
    #[must_use]
    pub(crate) fn random_walk(rate_random_walk_rad_s_sqrt_s: f64, step_s: f64) -> Self {
        Self { decay: 1.0, variance: rate_random_walk_rad_s_sqrt_s.powi(2) * step_s, initial_variance: 0.0 }
    }

    /// Stationary exponentially correlated noise: autocovariance std² exp(-|τ|/correlation time), s and rad/s.
    #[must_use]
    pub(crate) fn gauss_markov(correlation_time_s: f64, std_rad_s: f64, step_s: f64) -> Self {
        let stationary = std_rad_s * std_rad_s;
        let lag = step_s / correlation_time_s;
        // expm1 keeps the digits of a long correlation time
        Self { decay: (-lag).exp(), variance: -stationary * (-2.0 * lag).exp_m1(), initial_variance: stationary }
    }
}

/// z\[k+1\] = decay exp(i angle) z\[k\] + noise, the real part is read; stationary from the first row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Oscillator {
    /// 0 <= decay < 1.
    pub decay: f64,
    /// Angle from row to row, rad.
    pub angle_rad: f64,
    /// Variance of the real part, rad²/s²; the imaginary part has the same.
    pub variance: f64,
}

impl Oscillator {
    /// Noise about `center_hz`, `width_hz` wide at half the height of its spectrum.
    #[must_use]
    pub(crate) fn band(center_hz: f64, width_hz: f64, std_rad_s: f64, step_s: f64) -> Self {
        use std::f64::consts::{PI, TAU};
        Self {
            decay: (-PI * width_hz * step_s).exp(),
            angle_rad: (TAU * center_hz * step_s) % TAU,
            variance: std_rad_s * std_rad_s,
        }
    }

    /// Variance added to each component in each row, rad²/s².
    #[must_use]
    pub(crate) fn drive_variance(&self) -> f64 {
        self.variance * (1.0 - self.decay * self.decay)
    }
}

/// z\[k\] = Σ_j ma\[j\] x\[k-j\], x\[k\] = Σ_i ar\[i-1\] x\[k-i\] + white\[k\]: an ARMA filter of the white noise,
/// stationary from the first row.
///
/// Only the white noise passes it: all else in the model must be slow against the cut-off.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LowPass {
    /// a_1 … a_p, roots inside the unit circle.
    pub ar: Vec<f64>,
    /// b_0 … b_q; b_0 is not zero. A gain of one at zero frequency means Σ b = 1 - Σ a.
    pub ma: Vec<f64>,
}

/// With `probability` a sample has N(0, std²) added, after the filter and before quantization.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Outliers {
    /// Probability per sample.
    pub probability: f64,
    /// Standard deviation of the added value, rad/s.
    pub std_rad_s: f64,
}

/// A bias that jumps between two levels as a Markov chain, stationary from the first row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Telegraph {
    /// The two levels, rad/s. Their time average should be zero, so that the turn-on bias keeps its meaning.
    pub levels_rad_s: [f64; 2],
    /// Mean dwell time in each, s; at least one sample time.
    pub mean_dwell_s: [f64; 2],
}

impl Telegraph {
    /// Levels `spacing_rad_s` apart, their time average zero.
    #[must_use]
    pub(crate) fn centred(spacing_rad_s: f64, mean_dwell_s: [f64; 2]) -> Self {
        let high = mean_dwell_s[1] / (mean_dwell_s[0] + mean_dwell_s[1]);
        Self { levels_rad_s: [-spacing_rad_s * high, spacing_rad_s * (1.0 - high)], mean_dwell_s }
    }

    /// Probabilities of leaving each level at a row.
    pub(super) fn leave(&self, step_s: f64) -> [f64; 2] {
        self.mean_dwell_s.map(|dwell_s| step_s / dwell_s)
    }

    /// Stationary probability of the second level.
    pub(super) fn high_probability(&self) -> f64 {
        self.mean_dwell_s[1] / (self.mean_dwell_s[0] + self.mean_dwell_s[1])
    }
}

/// The bias is larger by `size_rad_s` from one row on. That row is uniform over `at`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Step {
    /// Size, rad/s.
    pub size_rad_s: f64,
    /// Rows at which it may happen.
    pub at: Range<usize>,
}

impl Step {
    /// Prior probability that the step has not happened at `row` (in it or before).
    pub(super) fn before(&self, row: usize) -> f64 {
        if row < self.at.start {
            return 1.0;
        }
        self.at.end.saturating_sub(row + 1) as f64 / self.at.len().max(1) as f64
    }
}

fn refuse(place: impl std::fmt::Display, found: impl std::fmt::Display, hint: &str) -> Error {
    Error::new(ErrorKind::Value, "state-space model", found).at(place).hint(hint)
}

fn column(place: &str, values: &[f64], rows: usize) -> Result<()> {
    if values.len() != rows {
        let found = format!("{} values for {rows} rows", values.len());
        return Err(refuse(place, found, "give one value a row"));
    }
    match values.iter().position(|v| !v.is_finite()) {
        Some(row) => Err(refuse(place, format!("row {row} is {}", values[row]), "fill gaps of covariates first")),
        None => Ok(()),
    }
}

fn number(place: &str, value: f64, [low, high]: [f64; 2]) -> Result<()> {
    if !(value >= low && value <= high) {
        return Err(refuse(place, value, &format!("from {low} to {high}")));
    }
    Ok(())
}

/// Ranges of what a caller gives.
const POSITIVE: [f64; 2] = [f64::MIN_POSITIVE, f64::MAX];
const NOT_NEGATIVE: [f64; 2] = [0.0, f64::MAX];
const FINITE: [f64; 2] = [f64::MIN, f64::MAX];

impl StateSpaceModel {
    /// White noise about zero and nothing else: `rows` rows every `step_s`.
    #[must_use]
    pub(crate) fn white(rows: usize, step_s: f64, white_std_rad_s: f64) -> Self {
        Self {
            rows,
            step_s,
            white_std_rad_s,
            white_scale: None,
            fixed_rad_s: None,
            coefficients: Vec::new(),
            markov: Vec::new(),
            oscillators: Vec::new(),
            low_pass: None,
            lattice_lsb_rad_s: None,
            outliers: None,
            telegraph: None,
            step: None,
        }
    }

    /// Refuses a model whose likelihood would not be a number.
    ///
    /// # Errors
    /// [`ErrorKind::Value`] that names the part: lengths, numbers that are not finite, and values out of range.
    pub(crate) fn check(&self) -> Result<()> {
        number("step_s", self.step_s, POSITIVE)?;
        number("white_std_rad_s", self.white_std_rad_s, POSITIVE)?;
        if let Some(fixed) = &self.fixed_rad_s {
            column("fixed_rad_s", fixed, self.rows)?;
        }
        if let Some(scale) = &self.white_scale {
            column("white_scale", scale, self.rows)?;
            if let Some(row) = scale.iter().position(|s| *s <= 0.0) {
                return Err(refuse("white_scale", format!("row {row} is {}", scale[row]), "a factor is positive"));
            }
        }
        for (j, c) in self.coefficients.iter().enumerate() {
            column(&format!("coefficients[{j}].column"), &c.column, self.rows)?;
            number(&format!("coefficients[{j}].mean"), c.mean, FINITE)?;
            number(&format!("coefficients[{j}].std"), c.std, NOT_NEGATIVE)?;
        }
        for (i, m) in self.markov.iter().enumerate() {
            number(&format!("markov[{i}].decay"), m.decay, [-1.0 + f64::EPSILON, 1.0])?;
            number(&format!("markov[{i}].variance"), m.variance, NOT_NEGATIVE)?;
            number(&format!("markov[{i}].initial_variance"), m.initial_variance, NOT_NEGATIVE)?;
        }
        for (i, o) in self.oscillators.iter().enumerate() {
            number(&format!("oscillators[{i}].decay"), o.decay, [0.0, 1.0 - f64::EPSILON])?;
            number(&format!("oscillators[{i}].angle_rad"), o.angle_rad, FINITE)?;
            number(&format!("oscillators[{i}].variance"), o.variance, NOT_NEGATIVE)?;
        }
        if let Some(low_pass) = &self.low_pass {
            low_pass.check()?;
        }
        if let Some(lsb) = self.lattice_lsb_rad_s {
            number("lattice_lsb_rad_s", lsb, POSITIVE)?;
        }
        if let Some(outliers) = &self.outliers {
            number("outliers.probability", outliers.probability, [0.0, 1.0 - f64::EPSILON])?;
            number("outliers.std_rad_s", outliers.std_rad_s, NOT_NEGATIVE)?;
        }
        if let Some(telegraph) = &self.telegraph {
            for level in telegraph.levels_rad_s {
                number("telegraph.levels_rad_s", level, FINITE)?;
            }
            for dwell_s in telegraph.mean_dwell_s {
                number("telegraph.mean_dwell_s", dwell_s, [self.step_s, f64::MAX])?;
            }
        }
        if let Some(step) = &self.step {
            number("step.size_rad_s", step.size_rad_s, FINITE)?;
            if step.at.is_empty() || step.at.end > self.rows {
                let found = format!("rows {} to {} of {}", step.at.start, step.at.end, self.rows);
                return Err(refuse("step.at", found, "name at least one row of the recording"));
            }
        }
        Ok(())
    }

    /// Standard deviation of the white noise that enters at `row`, rad/s.
    #[inline]
    pub(super) fn white_std_at(&self, row: usize) -> f64 {
        self.white_std_rad_s * self.white_scale.as_ref().map_or(1.0, |scale| scale[row])
    }

    /// Known part of the reading at `row`, rad/s.
    #[inline]
    pub(super) fn fixed_at(&self, row: usize) -> f64 {
        self.fixed_rad_s.as_ref().map_or(0.0, |fixed| fixed[row])
    }
}

impl LowPass {
    /// Number of past values of x needed for z and the next x.
    pub(super) fn order(&self) -> usize {
        self.ar.len().max(self.ma.len())
    }

    fn check(&self) -> Result<()> {
        for v in self.ar.iter().chain(&self.ma) {
            number("low_pass", *v, FINITE)?;
        }
        if self.ma.first().is_none_or(|b| *b == 0.0) {
            return Err(refuse("low_pass.ma", "no first coefficient", "b_0 lets the newest sample through"));
        }
        if self.reflections().is_none() {
            return Err(refuse("low_pass.ar", "a root on or outside the unit circle", "give a stable filter"));
        }
        Ok(())
    }

    /// Reflection coefficients by the step-down recursion (Schur, Cohn); none unless all are inside (-1, 1), the
    /// condition of stability.
    fn reflections(&self) -> Option<Vec<f64>> {
        let mut a = self.ar.clone();
        let mut out = Vec::new();
        while let Some(k) = a.pop() {
            if !(k.abs() < 1.0) {
                return None;
            }
            out.push(k);
            let n = a.len();
            let lower: Vec<f64> = (0..n).map(|i| (a[i] + k * a[n - 1 - i]) / (1.0 - k * k)).collect();
            a = lower;
        }
        Some(out)
    }

    /// x\[k+1\], x\[k\], … from x\[k\], x\[k-1\], …: the companion matrix applied in place, without the noise.
    pub(super) fn advance(&self, x: &mut [f64]) {
        let next: f64 = self.ar.iter().zip(x.iter()).map(|(a, x)| a * x).sum();
        let last = x.len().saturating_sub(1);
        x.copy_within(..last, 1);
        if let Some(first) = x.first_mut() {
            *first = next;
        }
    }

    /// Stationary covariance of (x\[k\], x\[k-1\], …) for white noise of variance one, row by row.
    ///
    /// Toeplitz from the autocovariance; that from the prediction error variances of the reflection coefficients and
    /// the Yule-Walker recursion (Brockwell and Davis, Time Series, §5.2).
    pub(super) fn stationary_covariance(&self) -> Result<Vec<f64>> {
        let order = self.order();
        let reflections = self.reflections().unwrap_or_default();
        let mut autocovariance = vec![reflections.iter().fold(1.0, |v, k| v / (1.0 - k * k))];
        // the predictor grows from order 0 to p; each order adds one autocovariance
        let mut predictor: Vec<f64> = Vec::new();
        let mut error = autocovariance[0];
        for k in reflections.iter().rev() {
            let n = predictor.len();
            let known: f64 = (0..n).map(|i| predictor[i] * autocovariance[n - i]).sum();
            autocovariance.push(known + k * error);
            let grown: Vec<f64> = (0..n).map(|i| predictor[i] - k * predictor[n - 1 - i]).chain([*k]).collect();
            predictor = grown;
            error *= 1.0 - k * k;
        }
        while autocovariance.len() < order {
            let n = autocovariance.len();
            autocovariance.push(self.ar.iter().enumerate().map(|(i, a)| a * autocovariance[n - 1 - i]).sum());
        }
        if autocovariance.iter().any(|r| !r.is_finite()) {
            return Err(refuse("low_pass.ar", "a root on the unit circle", "give a stable filter"));
        }
        Ok((0..order * order).map(|at| autocovariance[(at / order).abs_diff(at % order)]).collect())
    }
}
