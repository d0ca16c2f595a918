//! reading = lattice( bias + σ g(T) · filtered white + outliers ): the listed effects of the sensor's electronics

use super::draw::{between, chance, exponential, index, log_between, sign};
use super::effect::{Effect, Turn};
use super::label::{Parameters, Place};
use super::nats;
use super::run::{Run, Unit};
use crate::math::random::Stream;
use nalgebra::Complex;
use std::f64::consts::PI;

/// Substeps of a sample in which a filter runs before the sample is averaged.
const SUBSTEPS: usize = 16;

enum Filter {
    /// So many equal poles.
    Poles(usize),
    /// Two complex poles of this damping.
    Pair(f64),
    /// Mean over a window.
    Window,
}

/// A low-pass between the white noise and the averaging converter. Strength is 1 / cutoff, s.
pub(super) struct Bandwidth {
    filter: Filter,
}

impl Bandwidth {
    pub(crate) fn draw(s: &mut Stream) -> Self {
        let filter = match s.uniform() {
            u if u < 0.6 => Filter::Poles(1 + index(s, 3)),
            u if u < 0.85 => Filter::Pair(between(s, 0.5, 0.95)),
            _ => Filter::Window,
        };
        Self { filter }
    }

    /// Taps of the filter's difference equation at substep `h`: numerator, denominator without its 1; all have gain 1 at 0 Hz
    /// and 1/√2 at `cutoff_hz`.
    fn taps(&self, cutoff_hz: f64, h: f64) -> (Vec<f64>, Vec<f64>) {
        match self.filter {
            Filter::Poles(order) => {
                let each_hz = cutoff_hz / (2.0_f64.powf(1.0 / order as f64) - 1.0).sqrt();
                let keep = (-2.0 * PI * each_hz * h).exp();
                let mut a = vec![1.0];
                for _ in 0..order {
                    let mut next = a.clone();
                    next.push(0.0);
                    for (i, x) in a.iter().enumerate() {
                        next[i + 1] -= keep * x;
                    }
                    a = next;
                }
                (vec![(1.0 - keep).powi(order as i32)], a[1..].to_vec())
            }
            Filter::Pair(damping) => {
                // |H|² = 1/2 at the cutoff: its ratio to the natural frequency
                let q = 1.0 - 2.0 * damping * damping;
                let natural_hz = cutoff_hz / (q + (q * q + 1.0).sqrt()).sqrt();
                let w = 2.0 * PI * natural_hz;
                let radius = (-damping * w * h).exp();
                let angle = w * (1.0 - damping * damping).sqrt() * h;
                let a = vec![-2.0 * radius * angle.cos(), radius * radius];
                (vec![1.0 + a[0] + a[1]], a)
            }
            Filter::Window => {
                let width = (0.442_946 / (cutoff_hz * h)).max(1.0);
                let whole = width.floor();
                let mut b = vec![1.0 / width; whole as usize];
                b.push((width - whole) / width);
                (b, Vec::new())
            }
        }
    }

    /// |H|² at `theta` rad/substep.
    fn power((b, a): &(Vec<f64>, Vec<f64>), theta: f64) -> f64 {
        let turn = Complex::from_polar(1.0, -theta);
        let poly = |c: &[f64]| c.iter().rev().fold(Complex::new(0.0, 0.0), |sum, x| sum * turn + x);
        (poly(b) / (Complex::new(1.0, 0.0) + poly(a) * turn)).norm_sqr()
    }

    /// Spectrum of a sample over that of white noise, at the angular frequency `omega`, rad/sample.
    fn spectrum(taps: &(Vec<f64>, Vec<f64>), omega: f64) -> f64 {
        let m = SUBSTEPS as f64;
        (0..SUBSTEPS)
            .map(|alias| {
                let theta = (omega + 2.0 * PI * alias as f64) / m;
                let gain = Self::power(taps, theta);
                let mean = (0.5 * m * theta).sin() / (m * (0.5 * theta).sin());
                gain * if mean.is_finite() { mean * mean } else { 1.0 }
            })
            .sum()
    }
}

#[cfg(test)]
impl Bandwidth {
    /// Which filter it is.
    pub(crate) fn form(&self) -> &'static str {
        match self.filter {
            Filter::Poles(_) => "poles",
            Filter::Pair(_) => "pair",
            Filter::Window => "window",
        }
    }

    /// |H|² at `f_hz` before the averaging.
    pub(crate) fn gain(&self, f_hz: f64, cutoff_hz: f64, step_s: f64) -> f64 {
        let h = step_s / SUBSTEPS as f64;
        Self::power(&self.taps(cutoff_hz, h), 2.0 * PI * f_hz * h)
    }

    /// Spectrum of the samples over that of white noise.
    pub(crate) fn sampled(&self, f_hz: f64, cutoff_hz: f64, step_s: f64) -> f64 {
        Self::spectrum(&self.taps(cutoff_hz, step_s / SUBSTEPS as f64), 2.0 * PI * f_hz * step_s)
    }
}

impl Effect for Bandwidth {
    fn id(&self) -> &'static str {
        "gyro.bandwidth"
    }

    fn nats(&self, run: &Run, _: &[f64], strength: f64) -> f64 {
        const NODES: usize = 96;
        let taps = self.taps(1.0 / strength, run.step_s() / SUBSTEPS as f64);
        let one =
            |i: usize| nats::level(Self::spectrum(&taps, PI * (i as f64 + 0.5) / NODES as f64).max(1e-300).sqrt());
        (0..NODES).map(one).sum::<f64>() * run.len as f64 / NODES as f64
    }

    fn strengths(&self, run: &Run) -> [f64; 2] {
        // from the Nyquist frequency of the substeps down to a fiftieth of the samples'
        let nyquist_hz = 0.5 / run.step_s();
        [1.0 / (SUBSTEPS as f64 * nyquist_hz), 50.0 / nyquist_hz]
    }

    fn turn(&self) -> Turn {
        Turn::Filter
    }

    fn white(&self, strength: f64, white: &mut [f64], run: &Run, s: &mut Stream) {
        let (b, a) = self.taps(1.0 / strength, run.step_s() / SUBSTEPS as f64);
        let scale = (SUBSTEPS as f64).sqrt();
        let (mut inputs, mut outputs) = (vec![0.0; b.len()], vec![0.0; a.len()]);
        let mut at = 0;
        let mut next = |s: &mut Stream| {
            at = if at == 0 { inputs.len() - 1 } else { at - 1 };
            inputs[at] = scale * s.normal();
            let recent = inputs[at..].iter().chain(&inputs[..at]);
            let mut y: f64 = b.iter().zip(recent).map(|(b, x)| b * x).sum();
            for (a, old) in a.iter().zip(&outputs) {
                y -= a * old;
            }
            let shift = outputs.len().min(1);
            outputs.rotate_right(shift);
            if let Some(first) = outputs.first_mut() {
                *first = y;
            }
            y
        };
        // what the filter remembers of the time before the log
        let settle = (8.0 * strength / run.step_s()).ceil().min(4000.0) as usize * SUBSTEPS;
        for _ in 0..settle {
            next(s);
        }
        for w in white {
            *w = (0..SUBSTEPS).map(|_| next(s)).sum::<f64>() / SUBSTEPS as f64;
        }
    }

    fn parameters(&self, _: &Run, _: &[f64], strength: f64) -> Parameters {
        [("cutoff_hz".to_string(), 1.0 / strength)].into()
    }
}

/// Readings on a lattice: rounded, or cut with what that shifts trimmed away; zero is on the lattice or not. Strength is the
/// step, rad/s.
pub(super) struct Lattice {
    offset: f64,
}

impl Lattice {
    pub(crate) fn draw(s: &mut Stream) -> Self {
        let offset = match s.uniform() {
            u if u < 0.4 => 0.0,
            u if u < 0.7 => 0.5,
            _ => s.uniform(),
        };
        Self { offset }
    }
}

impl Effect for Lattice {
    fn id(&self) -> &'static str {
        "gyro.quantization"
    }

    /// A step q adds q²/12 to the variance σ², of which the level's nats per row are (q²/12σ²)²/4. That is what a
    /// probability per lattice step gains; that the digits show the lattice however fine it is, is not counted.
    fn nats(&self, run: &Run, _: &[f64], strength: f64) -> f64 {
        run.len as f64 * nats::level((1.0 + (strength / run.unit.white_std_rad_s()).powi(2) / 12.0).sqrt())
    }

    fn output(&self, strength: f64, reading_rad_s: &mut [f64], _: &Run, _: &mut Stream) {
        for y in reading_rad_s {
            *y = strength * ((*y / strength - self.offset).round() + self.offset);
        }
    }

    fn parameters(&self, _: &Run, _: &[f64], strength: f64) -> Parameters {
        [("lsb_rad_s".to_string(), strength)].into()
    }
}

#[derive(Clone, Copy)]
enum Sizes {
    Uniform,
    Exponential,
    Normal,
}

/// Rare samples with an addition of another law; single or in short clusters, on one side or both. Strength is the size over
/// the white noise's standard deviation.
pub(super) struct Outliers {
    probability: f64,
    sizes: Sizes,
    one_sided: f64,
    cluster: usize,
}

impl Outliers {
    pub(crate) fn draw(s: &mut Stream) -> Self {
        let sizes = [Sizes::Uniform, Sizes::Exponential, Sizes::Normal][index(s, 3)];
        let one_sided = if chance(s, 0.25) { sign(s) } else { 0.0 };
        let cluster = if chance(s, 0.25) { 2 + index(s, 2) } else { 1 };
        Self { probability: log_between(s, 2e-4, 6e-3), sizes, one_sided, cluster }
    }

    /// Size of the share `u` of all outliers, in units of the strength.
    fn size(&self, u: f64) -> f64 {
        match self.sizes {
            Sizes::Uniform => 0.7 + 0.6 * u,
            Sizes::Exponential => 0.5 - 0.5 * (1.0 - u).ln(),
            Sizes::Normal => 0.4 + 1.2 * (-2.0 * (1.0 - u).ln()).sqrt() / 2.0,
        }
    }
}

impl Effect for Outliers {
    fn id(&self) -> &'static str {
        "gyro.outliers"
    }

    /// Rows times the Kullback-Leibler distance of (1 - p) N(0, 1) + p h from N(0, 1), h the law of an outlier's row.
    fn nats(&self, run: &Run, _: &[f64], strength: f64) -> f64 {
        const LAWS: usize = 24;
        let sizes: Vec<f64> = (0..LAWS).map(|i| strength * self.size((i as f64 + 0.5) / LAWS as f64)).collect();
        let end = sizes.iter().copied().fold(0.0, f64::max) + 6.0;
        let nodes = 200 + (4.0 * end) as usize;
        let width = 2.0 * end / nodes as f64;
        let sides: &[f64] = if self.one_sided == 0.0 { &[-1.0, 1.0] } else { &[1.0] };
        let distance: f64 = (0..nodes)
            .map(|i| {
                let z = -end + (i as f64 + 0.5) * width;
                // both densities over the normal one's; the ratio may be huge, its logarithm is not
                let bell = (-0.5 * z * z).exp();
                let other: f64 = sides
                    .iter()
                    .flat_map(|side| sizes.iter().map(move |a| (-0.5 * (z - side * a).powi(2)).exp()))
                    .sum::<f64>()
                    / (sides.len() * LAWS) as f64;
                let mixed = (1.0 - self.probability) * bell + self.probability * other;
                if mixed > 0.0 { mixed * (mixed.ln() + 0.5 * z * z) * width } else { 0.0 }
            })
            .sum();
        run.len as f64 * distance / (2.0 * PI).sqrt()
    }

    fn strengths(&self, _: &Run) -> [f64; 2] {
        [1.0, 300.0]
    }

    fn output(&self, strength: f64, reading_rad_s: &mut [f64], run: &Run, s: &mut Stream) {
        let std = run.unit.white_std_rad_s();
        let start = self.probability / self.cluster as f64;
        let mut row = (exponential(s) / start) as usize;
        while row < reading_rad_s.len() {
            let side = if self.one_sided == 0.0 { sign(s) } else { self.one_sided };
            for y in reading_rad_s.iter_mut().skip(row).take(self.cluster) {
                *y += side * std * strength * self.size(s.uniform());
            }
            row += self.cluster + (exponential(s) / start) as usize;
        }
    }

    fn parameters(&self, _: &Run, _: &[f64], _: f64) -> Parameters {
        [("probability_per_sample".to_string(), self.probability)].into()
    }
}

#[derive(Clone, Copy)]
enum Growth {
    Linear,
    Exponential,
    Quadratic,
}

/// σ(T) = σ g(x), x the warming since power-on over 10 °C, through a lag; g is 1 + a x, exp(a x) or 1 + a x²
pub(super) struct NoiseGrowth {
    law: Growth,
    lag_s: f64,
}

impl NoiseGrowth {
    pub(crate) fn draw(unit: &Unit, s: &mut Stream) -> Self {
        let law = [Growth::Linear, Growth::Exponential, Growth::Quadratic][index(s, 3)];
        let lag_s = if chance(s, 0.5) { log_between(s, 10.0, 120.0).max(2.0 * unit.step_s) } else { 0.0 };
        Self { law, lag_s }
    }

    fn factor(&self, x: f64, strength: f64) -> f64 {
        match self.law {
            Growth::Linear => 1.0 + strength * x,
            Growth::Exponential => (strength * x).exp(),
            Growth::Quadratic => 1.0 + strength * x * x.abs(),
        }
        .max(0.2)
    }

    fn warmth(&self, run: &Run) -> Vec<f64> {
        let follow = if self.lag_s > 0.0 { -(-run.step_s() / self.lag_s).exp_m1() } else { 1.0 };
        let mut state = 0.0;
        let mut one = |c: f64| {
            state += follow * (0.1 * c - state);
            state
        };
        run.warming_c().into_iter().map(&mut one).collect()
    }
}

impl Effect for NoiseGrowth {
    fn id(&self) -> &'static str {
        "gyro.noise_growth"
    }

    fn nats(&self, run: &Run, _: &[f64], strength: f64) -> f64 {
        const THIN: usize = 50;
        let warmth = self.warmth(run);
        let some = warmth.iter().step_by(THIN).map(|x| nats::level(self.factor(*x, strength)));
        some.sum::<f64>() * THIN as f64
    }

    fn strengths(&self, _: &Run) -> [f64; 2] {
        [1e-4, 5.0]
    }

    fn white(&self, strength: f64, white: &mut [f64], run: &Run, _: &mut Stream) {
        for (w, x) in white.iter_mut().zip(self.warmth(run)) {
            *w *= self.factor(x, strength);
        }
    }

    fn place(&self, _: &Run, _: &[f64]) -> Place {
        Place::following("temperature_c")
    }
}
