//! The noise of `[gyro.noise]` near the sample rate: white noise behind a low-pass, and bands of vibration
//!
//! The low-pass is the causal filter of least delay that has its gain; it colours the noise, and leaves the rate alone. A
//! resonance is z ← r e^{iω₀} z + drive, of which the real part is seen, r = exp(-πΔ Δt); a wandering frequency is white
//! noise through a normal window, turned by ω₀. Both begin in their stationary state.

use super::Purpose;
use crate::config::{NarrowBand, Noise};
use crate::math::minimum_phase::minimum_phase;
use crate::math::random::Stream;
use crate::noise::BandForm;
use std::f64::consts::{LN_2, PI, TAU};

/// Length of a filter, and of the longest one, samples.
const LENGTHS: [usize; 2] = [4096, 65_536];
/// A filter is computed with so many times its memory.
const MEMORIES: f64 = 200.0;
/// The normal window ends at so many standard deviations.
const WINDOW_ENDS: f64 = 6.0;

/// y = Σ h_k u[-k]
struct Fir {
    taps: Vec<f64>,
    /// Ring of the last inputs, `newest` the last of them.
    inputs: Vec<f64>,
    newest: usize,
}

impl Fir {
    /// A filter in its stationary state.
    fn new(taps: Vec<f64>, mut draw: impl FnMut() -> f64) -> Self {
        let inputs = taps.iter().map(|_| draw()).collect();
        Self { taps, inputs, newest: 0 }
    }

    fn next(&mut self, input: f64) -> f64 {
        self.newest = if self.newest == 0 { self.inputs.len() - 1 } else { self.newest - 1 };
        self.inputs[self.newest] = input;
        let (wrapped, recent) = self.inputs.split_at(self.newest);
        let (first, rest) = self.taps.split_at(recent.len());
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        dot(first, recent) + dot(rest, wrapped)
    }
}

enum Oscillator {
    Resonance { state: [f64; 2], decay: f64, drive: f64 },
    Wander { quadratures: Box<[Fir; 2]>, std: f64 },
}

struct Band {
    oscillator: Oscillator,
    turn: f64,
    phase: f64,
    draw: Stream,
}

impl Band {
    fn new(band: &NarrowBand, step_s: f64, mut draw: Stream) -> Self {
        let (turn, std) = (TAU * band.center_hz * step_s, band.std_rad_s);
        let oscillator = match band.form.unwrap_or(BandForm::Resonance) {
            BandForm::Resonance => {
                let decay = (-PI * band.bandwidth_hz * step_s).exp();
                let drive = std * (1.0 - decay * decay).sqrt();
                Oscillator::Resonance { state: [std * draw.normal(), std * draw.normal()], decay, drive }
            }
            BandForm::Wander => {
                // exp(-k²/2s²) has the autocovariance exp(-k²/4s²), and that is exp(-(πΔτ)²/(4 ln 2))
                let s = LN_2.sqrt() / (PI * band.bandwidth_hz * step_s);
                let reach = (WINDOW_ENDS * s).ceil();
                let window = (0..=2 * reach as usize).map(|k| (-0.5 * ((k as f64 - reach) / s).powi(2)).exp());
                let mut taps: Vec<f64> = window.collect();
                let size = taps.iter().map(|h| h * h).sum::<f64>().sqrt();
                taps.iter_mut().for_each(|h| *h /= size);
                let mut fir = || Fir::new(taps.clone(), || draw.normal());
                Oscillator::Wander { quadratures: Box::new([fir(), fir()]), std }
            }
        };
        Self { oscillator, turn, phase: 0.0, draw }
    }

    fn next(&mut self) -> f64 {
        let Self { oscillator, turn, phase, draw } = self;
        match oscillator {
            Oscillator::Resonance { state, decay, drive } => {
                let (sin, cos) = turn.sin_cos();
                let [a, b] = *state;
                *state = [
                    *decay * (a * cos - b * sin) + *drive * draw.normal(),
                    *decay * (a * sin + b * cos) + *drive * draw.normal(),
                ];
                state[0]
            }
            Oscillator::Wander { quadratures, std } => {
                let [a, b] = [0, 1].map(|i| quadratures[i].next(draw.normal()));
                *phase = (*phase + *turn).rem_euclid(TAU);
                *std * (a * phase.cos() - b * phase.sin())
            }
        }
    }
}

/// The shaped part of a gyro's noise.
pub(super) struct Coloured {
    low_pass: Option<Fir>,
    bands: Vec<Band>,
}

impl Coloured {
    /// A generator of the stated noise; `white_std_rad_s` is the standard deviation of the plateau.
    pub(crate) fn new(noise: &Noise, white_std_rad_s: f64, step_s: f64, seed: u64) -> Self {
        let filter = |cutoff_hz: f64| {
            let form = noise.bandwidth_form.unwrap_or_default();
            let memory = (MEMORIES / (TAU * cutoff_hz * step_s)) as usize;
            let power = form.filter(cutoff_hz, step_s);
            let mut taps = minimum_phase(power, memory.clamp(LENGTHS[0], LENGTHS[1]));
            let gain: f64 = taps.iter().sum();
            taps.iter_mut().for_each(|h| *h /= gain);
            let mut before = Purpose::GyroBefore.stream(seed);
            Fir::new(taps, || white_std_rad_s * before.normal())
        };
        let band = |(i, band): (usize, &NarrowBand)| {
            Band::new(band, step_s, Stream::new(seed, Purpose::GyroBand as u64 + 1000 * i as u64))
        };
        Self {
            low_pass: noise.bandwidth_cutoff_hz.map(filter),
            bands: noise.narrow_band.iter().enumerate().map(band).collect(),
        }
    }

    /// The noise of a sample whose white noise would be `white_rad_s`.
    pub(crate) fn next(&mut self, white_rad_s: f64) -> f64 {
        let filtered = self.low_pass.as_mut().map_or(white_rad_s, |f| f.next(white_rad_s));
        filtered + self.bands.iter_mut().map(Band::next).sum::<f64>()
    }
}
