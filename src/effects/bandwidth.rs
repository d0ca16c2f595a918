//! |H|² = (1 - δ) (1 + (2^{1/m} - 1) x^{2q})^{-m} + δ M²,  x = w(ω)/w(ω_c),  w = sin(ω/2)/cos(ω/2)^z
//!
//! f_c (ω_c = 2π f_c Δt) is the frequency of half power whatever q, m, z and δ are. Special cases, all exact:
//!
//! | filter | q | m | z | δ |
//! |---|---|---|---|---|
//! | one pole, y += (1 - a)(u - y) for any a | 1 | 1 | 0 | 0 |
//! | k such poles one after the other | 1 | k | 0 | 0 |
//! | Butterworth of order k by the bilinear transform | k | 1 | 1 | 0 |
//! | mean of the last L samples, M = sin(Lω/2)/(L sin(ω/2)) | | | | 1 |
//!
//! Other q, m, z and δ give smooth forms between these. A pole so weak that even at half the sample rate more than half
//! the power passes has its f_c above half the sample rate: sin(ω_c/2) is continued as cosh((ω_c - π)/2). cos(ω/2) is
//! kept above 0.01, and |H|² in the spectrum above 1e-5, because the ends of a log leak as much.

use super::about::{About, Parameter, Parameters};
use super::effect::Effect;
use super::explanation::{Explanation, Noise};
use super::parts::{Checked, log_spaced, stream, white_std_rad_s};
#[cfg(test)]
use super::tried::Tried;
use crate::error::Result;
use crate::math::minimum_phase::minimum_phase;
use crate::math::random::Stream;
use crate::model::{GyroEffect, GyroInFilter, Scene};
use std::f64::consts::{PI, TAU};

const CUTOFF: &str = "cutoff_hz";
const ORDER: &str = "order";
const SECTIONS: &str = "sections";
const ZERO: &str = "nyquist_zero";
const AVERAGE: &str = "moving_average_share";
/// Parameters of the form, and their values where they are not stated.
const FORM: [(&str, f64); 4] = [(ORDER, 1.0), (SECTIONS, 1.0), (ZERO, 0.0), (AVERAGE, 0.0)];

/// Above this nothing is filtered at any rate that a gyro is read at.
const OPEN_HZ: f64 = 1e7;

static ABOUT: About = About {
    id: "gyro.bandwidth",
    title: "limited bandwidth",
    equation: "a low-pass filter colours noise and rate: half the power passes at the cutoff",
    source: "Oppenheim and Schafer, Discrete-Time Signal Processing; IEEE Std 1554-2005, frequency response",
    channel: "gyro",
    deficient: "gyro measurement: rate and noise pass a low-pass filter",
    condition: None,
    parameters: &[
        Parameter {
            name: CUTOFF,
            meaning: "f_c, Hz: half the power passes",
            bounds: [1e-6, OPEN_HZ],
            null: Some(OPEN_HZ),
            required: true,
        },
        Parameter {
            name: ORDER,
            meaning: "q: 1 for a pole, k for Butterworth's of order k; 1 where it is not stated",
            bounds: [0.2, 16.0],
            null: None,
            required: false,
        },
        Parameter {
            name: SECTIONS,
            meaning: "m: equal sections one after the other; 1 where it is not stated",
            bounds: [0.2, 16.0],
            null: None,
            required: false,
        },
        Parameter {
            name: ZERO,
            meaning: "z: 1 for a zero at half the sample rate as the bilinear transform makes; 0 where it is not stated",
            bounds: [0.0, 4.0],
            null: None,
            required: false,
        },
        Parameter {
            name: AVERAGE,
            meaning: "δ: 1 for a moving average, 0 for a smooth filter; 0 where it is not stated",
            bounds: [0.0, 1.0],
            null: None,
            required: false,
        },
    ],
    remedy: "Set the sensor's filter to what the configuration assumes, or simulate it; the samples' noise is then \
             correlated, and the filter's measurement noise must grow accordingly.",
};

/// Smallest cos(ω/2) in w.
const COS_FLOOR: f64 = 0.01;
/// Smallest |H|² of the spectrum.
const POWER_FLOOR: f64 = 1e-5;
/// L ω_c of a moving average, L large; and how far L² is above the square of it over ω_c for every L.
const SINC_HALF: f64 = 2.783_114_756_502_9;
const SINC_REST: f64 = 0.863;
/// A filter is computed with this many times its memory 1/ω_c, at least and at most so many samples.
const MEMORIES: f64 = 200.0;
const LENGTHS: [f64; 2] = [4096.0, 262_144.0];

/// A low-pass filter colours the noise.
pub(super) struct Bandwidth;

/// The form of a filter.
#[derive(Debug, Clone, Copy)]
struct Form {
    /// w(ω_c)
    scale: f64,
    order: f64,
    sections: f64,
    zero: f64,
    average: f64,
    /// L
    window: f64,
    omega_c: f64,
}

impl Form {
    fn new(cutoff_hz: f64, [order, sections, zero, average]: [f64; 4], dt_s: f64) -> Self {
        let omega_c = TAU * cutoff_hz * dt_s;
        let sin = if omega_c < PI { (0.5 * omega_c).sin() } else { (0.5 * (omega_c - PI)).cosh() };
        let cos = (0.5 * omega_c.min(PI)).cos().max(COS_FLOOR);
        let window = ((SINC_HALF / omega_c).powi(2) + SINC_REST).sqrt().max(1.0);
        Self { scale: sin / cos.powf(zero), order, sections, zero, average, window, omega_c }
    }

    fn power(&self, omega: f64) -> f64 {
        let (sin, cos) = (0.5 * omega).sin_cos();
        let x = sin / cos.max(COS_FLOOR).powf(self.zero) / self.scale;
        let step = (self.sections.recip() * std::f64::consts::LN_2).exp_m1();
        let smooth = (1.0 + step * x.powf(2.0 * self.order)).powf(-self.sections);
        if self.average > 0.0 && omega > 0.0 {
            let mean = (0.5 * self.window * omega).sin() / (self.window * sin);
            (1.0 - self.average) * smooth + self.average * mean * mean
        } else {
            smooth
        }
    }

    /// Whether nothing is filtered.
    fn open(&self) -> bool {
        (1..=16).all(|k| 1.0 - self.power(PI * f64::from(k) / 16.0) < 1e-12)
    }

    /// Whether it is one pole.
    fn one_pole(&self) -> bool {
        self.order == 1.0 && self.sections == 1.0 && self.zero == 0.0 && self.average == 0.0
    }
}

/// Why a navigation filter has nothing for it.
const FILTERED: &str =
    "it filters rate and noise alike; below its cutoff it is a delay of 1/(2π cutoff): sensor.gyro_delay";

/// y += (1 - a)(u - y)
struct OnePole {
    pass: f64,
    state: f64,
}

impl GyroEffect for OnePole {
    fn filtered(&mut self, rate_rad_s: f64) -> f64 {
        self.state += self.pass * (rate_rad_s - self.state);
        self.state
    }

    fn in_filter(&self) -> GyroInFilter {
        GyroInFilter::Unrepresented(FILTERED)
    }
}

/// y = Σ h_k u[-k]
struct Response {
    taps: Vec<f64>,
    /// ring of the last inputs, `newest` the last of them
    inputs: Vec<f64>,
    newest: usize,
}

impl GyroEffect for Response {
    fn filtered(&mut self, rate_rad_s: f64) -> f64 {
        self.newest = if self.newest == 0 { self.inputs.len() - 1 } else { self.newest - 1 };
        self.inputs[self.newest] = rate_rad_s;
        let (wrapped, recent) = self.inputs.split_at(self.newest);
        let (first, rest) = self.taps.split_at(recent.len());
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        dot(first, recent) + dot(rest, wrapped)
    }

    fn in_filter(&self) -> GyroInFilter {
        GyroInFilter::Unrepresented(FILTERED)
    }
}

struct Open;

impl GyroEffect for Open {
    fn in_filter(&self) -> GyroInFilter {
        GyroInFilter::Known
    }
}

/// The filter at work since long before the first row: its memory holds the nominal bias and white noise.
fn filter(form: &Form, scene: &Scene, mut draw: Stream) -> Box<dyn GyroEffect> {
    let bias = if scene.is_empty() { 0.0 } else { scene.warm_up.error_rad_s(scene.time.at(0)) };
    let white = white_std_rad_s(scene);
    if form.open() {
        return Box::new(Open);
    }
    if form.one_pole() {
        // (1 - a)²/(4a) = w(ω_c)²; 1 - a without cancellation
        let square = form.scale * form.scale;
        let pass = 2.0 * (form.scale * (1.0 + square).sqrt() - square);
        // variance of the output over that of the input: (1 - a)/(1 + a)
        let state = bias + white * (pass / (2.0 - pass)).sqrt() * draw.normal();
        return Box::new(OnePole { pass, state });
    }
    let len = (MEMORIES / form.omega_c).max(MEMORIES * form.window / 10.0).clamp(LENGTHS[0], LENGTHS[1]);
    let mut taps = minimum_phase(|omega| form.power(omega), len as usize);
    let gain: f64 = taps.iter().sum();
    if !(gain > 0.0) {
        return Box::new(Open);
    }
    taps.iter_mut().for_each(|h| *h /= gain);
    let inputs = taps.iter().map(|_| bias + white * draw.normal()).collect();
    Box::new(Response { taps, inputs, newest: 0 })
}

impl Effect for Bandwidth {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        // rate 20 Hz: one pole, one that is weak, two poles, the bilinear Butterworth, and something between
        Tried::size(&[("cutoff_hz", 5.0)])
            .spectrum(&[2.0, 1.0, 1.0, 0.0, 0.0], 4, 0.03)
            .spectrum(&[14.0, 1.0, 1.0, 0.0, 0.0], 4, 0.03)
            .spectrum(&[3.0, 1.0, 2.0, 0.0, 0.0], 4, 0.03)
            .spectrum(&[4.0, 2.0, 1.0, 0.3, 0.0], 4, 0.03)
            .spectrum(&[1.5, 1.3, 1.2, 0.2, 0.1], 4, 0.03)
    }

    fn simulated(&self, parameters: &Parameters, scene: &Scene, seed: u64) -> Result<Box<dyn GyroEffect>> {
        let checked = Checked::of(&ABOUT, parameters)?;
        let shape = FORM.map(|(name, usual)| checked.optional(name).unwrap_or(usual));
        Ok(filter(&Form::new(checked.value(CUTOFF)?, shape, scene.step_s), scene, stream(&ABOUT, seed)))
    }

    fn explanation(&self, _: &Scene) -> Option<Explanation> {
        Some(Explanation::Filter(Box::new(Self)))
    }

    fn band_hz(&self, parameters: &Parameters, scene: &Scene) -> Option<[f64; 2]> {
        let nyquist = 0.5 / scene.step_s;
        Some([parameters.get(CUTOFF)?.min(nyquist), nyquist])
    }
}

impl Noise for Bandwidth {
    fn names(&self) -> Vec<&'static str> {
        vec![CUTOFF, ORDER, SECTIONS, ZERO, AVERAGE]
    }

    fn unless_stated(&self, name: &str) -> Option<f64> {
        FORM.iter().find(|(form, _)| *form == name).map(|(_, usual)| *usual)
    }

    /// Cutoff: from a hundred periods in the log, below which the bias itself would be filtered, to three sample rates,
    /// where a pole takes a millionth off the power. Form: from nothing of a zero or an average to all of it.
    fn range(&self, scene: &Scene) -> Vec<[f64; 2]> {
        let rate_hz = 1.0 / scene.step_s;
        let low = (100.0 / scene.span_s()).min(0.01 * rate_hz);
        vec![[low, 3.0 * rate_hz], [0.4, 8.0], [0.4, 8.0], [0.01, 2.0], [1e-4, 0.999]]
    }

    fn starts(&self, scene: &Scene) -> Vec<Vec<f64>> {
        let forms = [[1.0, 1.0, 0.02, 1e-3], [1.0, 2.0, 0.02, 1e-3], [2.0, 1.0, 1.0, 1e-3], [1.0, 2.0, 0.05, 0.99]];
        let with = |cutoff: f64| forms.map(|form| [&[cutoff], &form[..]].concat());
        log_spaced(0.02 / scene.step_s, 1.5 / scene.step_s, 14).into_iter().flat_map(with).collect()
    }

    fn spectrum(&self, scene: &Scene, theta: &[f64], omega: f64) -> f64 {
        let &[cutoff, order, sections, zero, average] = theta else { return 1.0 };
        Form::new(cutoff, [order, sections, zero, average], scene.step_s).power(omega).max(POWER_FLOOR)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT_S: f64 = 0.01;

    #[test]
    fn half_the_power_passes_at_the_cutoff_whatever_the_form() {
        for cutoff in [0.1, 3.0, 20.0, 33.0] {
            for shape in [[1.0, 1.0, 0.0, 0.0], [2.0, 1.0, 1.0, 0.0], [0.6, 3.0, 0.3, 0.0], [1.0, 1.0, 0.0, 1.0]] {
                let power = Form::new(cutoff, shape, DT_S).power(TAU * cutoff * DT_S);
                // the length of the average is a fit, and not whole
                let bound = if shape[3] > 0.0 { 5e-3 } else { 1e-12 };
                assert!((power - 0.5).abs() < bound, "{cutoff} Hz, {shape:?}: {power}");
            }
        }
    }

    #[test]
    fn known_filters_are_special_cases() {
        let omegas = || log_spaced(1e-3, 3.1, 50).into_iter();
        for a in [0.02f64, 0.3, 0.95] {
            // half power where 2 (1 - a)² = 1 - 2 a cos ω + a², or beyond half the sample rate, where cos goes on as -cosh
            let cos = 2.0 - (a * a + 1.0) / (2.0 * a);
            let omega_c = if cos >= -1.0 { cos.acos() } else { PI + (-cos).acosh() };
            let form = Form::new(omega_c / TAU / DT_S, [1.0, 1.0, 0.0, 0.0], DT_S);
            for w in omegas() {
                let pole = (1.0 - a).powi(2) / (1.0 - 2.0 * a * w.cos() + a * a);
                assert!((form.power(w) / pole - 1.0).abs() < 1e-9, "a = {a}, ω = {w}");
            }
        }
        let form = Form::new(10.0, [2.0, 1.0, 1.0, 0.0], DT_S);
        for w in omegas() {
            let butterworth = 1.0 / (1.0 + ((0.5 * w).tan() / (PI * 10.0 * DT_S).tan()).powi(4));
            assert!((form.power(w) / butterworth - 1.0).abs() < 1e-9, "ω = {w}");
        }
        // two samples: cos²(ω/2), half power at π/2, as the average and as the smooth form
        let quarter = 0.25 / DT_S;
        let (smooth, mean) =
            (Form::new(quarter, [1.0, 1.0, 1.0, 0.0], DT_S), Form::new(quarter, [1.0, 1.0, 0.0, 1.0], DT_S));
        for w in omegas() {
            let exact = (0.5 * w).cos().powi(2);
            assert!((smooth.power(w) - exact).abs() < 1e-9 && (mean.power(w) - exact).abs() < 2e-3, "ω = {w}");
        }
    }

    #[test]
    fn a_moving_average_has_equal_weights() {
        let omega_c = SINC_HALF / (25.0 - SINC_REST).sqrt();
        let form = Form::new(omega_c / TAU / DT_S, [1.0, 1.0, 0.0, 1.0], DT_S);
        // zeros on the unit circle: the cepstrum falls as 1/k only
        let taps = minimum_phase(|w| form.power(w), 1 << 16);
        for (k, h) in taps.iter().enumerate() {
            let expected = if k < 5 { 0.2 } else { 0.0 };
            assert!((h - expected).abs() < 2e-3, "{k}: {h}");
        }
    }

    #[test]
    fn a_constant_passes_and_a_pole_needs_no_response() {
        let scene = crate::effects::battery::scene(1000, DT_S);
        for shape in [[1.0, 1.0, 0.0, 0.0], [1.4, 2.0, 0.5, 0.2], [1.0, 1.0, 0.0, 1.0]] {
            let mut work = filter(&Form::new(4.0, shape, DT_S), &scene, Stream::new(1, 0));
            let last = (0..5000).map(|_| work.filtered(0.25)).last().unwrap();
            assert!((last - 0.25).abs() < 1e-9, "{shape:?}: {last}");
        }
        // the recursion and the response are one filter
        let form = Form::new(4.0, [1.0, 1.0, 0.0, 0.0], DT_S);
        let square = form.scale * form.scale;
        let pass = 2.0 * (form.scale * (1.0 + square).sqrt() - square);
        let taps = minimum_phase(|w| form.power(w), 4096);
        for (k, h) in taps.iter().enumerate() {
            assert!((h - pass * (1.0 - pass).powi(k as i32)).abs() < 1e-10, "{k}");
        }
    }
}
