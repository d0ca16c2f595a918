//! Lines in a whitened series: w = a cos(2πft) + b sin(2πft) + white noise of variance one
//!
//! P(f) = |Σ w exp(-2πift)|²/n is the gain in log-likelihood of a line at f; a comb gains the sum over its harmonics.

use realfft::RealFftPlanner;
use std::f64::consts::{PI, TAU};

/// A series whose lines are searched.
pub(crate) struct Lines<'a> {
    w: &'a [f64],
    step_s: f64,
    /// P on a grid of spacing 1/(PAD · span).
    power: Vec<f64>,
    grid_hz: f64,
}

/// Points of the grid of frequencies for each of the periodogram's.
const PAD: usize = 4;

/// A line or comb that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Line {
    /// Its frequency, Hz.
    pub frequency_hz: f64,
    /// Gain in log-likelihood, nats.
    pub gain: f64,
}

impl<'a> Lines<'a> {
    /// Of `w`, sampled every `step_s`.
    pub(crate) fn new(w: &'a [f64], step_s: f64) -> Self {
        let size = (PAD * w.len()).next_power_of_two();
        let plan = RealFftPlanner::<f64>::new().plan_fft_forward(size);
        let mut input = plan.make_input_vec();
        input[..w.len()].copy_from_slice(w);
        let mut spectrum = plan.make_output_vec();
        let n = w.len().max(1) as f64;
        let power = match plan.process(&mut input, &mut spectrum) {
            Ok(()) => spectrum.iter().map(|c| c.norm_sqr() / n).collect(),
            Err(_) => vec![0.0; size / 2 + 1],
        };
        Self { w, step_s, power, grid_hz: 1.0 / (size as f64 * step_s) }
    }

    fn span_s(&self) -> f64 {
        self.w.len() as f64 * self.step_s
    }

    /// P at any frequency.
    pub(crate) fn power_at(&self, frequency_hz: f64) -> f64 {
        // Goertzel's recursion drifts at low frequencies; a rotation kept normalised does not
        let (sin, cos) = (TAU * frequency_hz * self.step_s).sin_cos();
        let (mut c, mut s, mut re, mut im) = (1.0, 0.0, 0.0, 0.0);
        for (i, w) in self.w.iter().enumerate() {
            re += w * c;
            im += w * s;
            (c, s) = (c * cos - s * sin, s * cos + c * sin);
            if i % 4096 == 4095 {
                let r = c.hypot(s);
                (c, s) = (c / r, s / r);
            }
        }
        (re * re + im * im) / self.w.len().max(1) as f64
    }

    fn first(&self, cycles: f64) -> usize {
        ((cycles / self.span_s() / self.grid_hz).ceil() as usize).max(1)
    }

    /// Frequencies of the highest peaks from `cycles` in the recording upwards, highest first.
    pub(crate) fn peaks(&self, cycles: f64, count: usize) -> Vec<f64> {
        let p = &self.power;
        let mut found: Vec<usize> = (self.first(cycles)..p.len().saturating_sub(1))
            .filter(|k| p[*k] > 4.0 && p[*k] >= p[*k - 1] && p[*k] > p[*k + 1])
            .collect();
        found.sort_by(|a, b| p[*b].total_cmp(&p[*a]));
        let mut kept: Vec<usize> = Vec::new();
        for k in found {
            // side lobes of a line are not lines
            if kept.iter().all(|q| q.abs_diff(k) > 6 * PAD) {
                kept.push(k);
            }
            if kept.len() == count {
                break;
            }
        }
        kept.iter().map(|k| *k as f64 * self.grid_hz).collect()
    }

    /// The frequency near `frequency_hz` at which `gain` is largest.
    fn climb(&self, frequency_hz: f64, half_width_hz: f64, gain: impl Fn(f64) -> f64) -> Line {
        let (mut best, mut width) = (Line { frequency_hz, gain: gain(frequency_hz) }, half_width_hz);
        for _ in 0..5 {
            let centre = best.frequency_hz;
            for f in [centre - width, centre + width] {
                let g = gain(f);
                if g > best.gain {
                    best = Line { frequency_hz: f, gain: g };
                }
            }
            width *= 0.5;
        }
        best
    }

    /// The strongest line with at least `cycles` in the recording.
    pub(crate) fn tone(&self, cycles: f64) -> Option<Line> {
        let f = *self.peaks(cycles, 1).first()?;
        Some(self.climb(f, 0.5 * self.grid_hz, |f| self.power_at(f)))
    }

    /// Interpolated P.
    fn quick(&self, f: f64) -> f64 {
        let x = f / self.grid_hz;
        let k = x as usize;
        match (self.power.get(k), self.power.get(k + 1)) {
            (Some(a), Some(b)) => a.max(*b),
            _ => 0.0,
        }
    }

    /// The strongest comb of `harmonics`, its fundamental with at least `cycles` in the recording.
    pub(crate) fn comb(&self, cycles: f64, harmonics: usize) -> Option<Line> {
        let nyquist = 0.5 / self.step_s;
        let sum = |f: f64, at: &dyn Fn(f64) -> f64| {
            (1..=harmonics).map(|h| h as f64 * f).filter(|f| *f < nyquist).map(|f| (at(f) - 2.0).max(0.0)).sum::<f64>()
        };
        let quick = |f: f64| self.quick(f);
        let least = cycles / self.span_s();
        let fundamentals = self.peaks(cycles, 8).into_iter().flat_map(|f| (1..=harmonics).map(move |h| f / h as f64));
        let best = fundamentals
            .filter(|f| *f >= least)
            .flat_map(|f| (-4..=4).map(move |d| f + 0.25 * f64::from(d) * self.grid_hz))
            .map(|f| (f, sum(f, &quick)))
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        let exact = |f: f64| self.power_at(f);
        Some(self.climb(best.0, 0.25 * self.grid_hz, |f| sum(f, &exact)))
    }

    /// ln of the probability that a line prior, uniform in ln f between `cycles` in the recording and the Nyquist
    /// frequency, gives to the neighbourhood of `line` that the data allow.
    pub(crate) fn ln_shape(&self, line: &Line, cycles: f64) -> f64 {
        let (low, high) = (cycles / self.span_s(), 0.5 / self.step_s);
        // Cramér-Rao bound of the frequency: 12 / (2 (2π span)² · gain)
        let std = (6.0 / line.gain.max(1.0)).sqrt() / (TAU * self.span_s());
        let density = 1.0 / (line.frequency_hz * (high / low).ln());
        ((2.0 * PI).sqrt() * std * density).ln().min(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    #[test]
    fn a_line_and_a_comb_are_found_where_they_are() {
        let (n, step) = (8192, 0.1);
        let mut draw = Stream::new(3, 0);
        let wave = |f: f64, a: f64| move |i: usize| a * (TAU * f * step * i as f64 + 0.3).sin();
        let (a, b) = (wave(0.1234, 0.15), wave(3.0 * 0.1234, 0.1));
        let w: Vec<f64> = (0..n).map(|i| draw.normal() + a(i) + b(i)).collect();
        let lines = Lines::new(&w, step);
        let tone = lines.tone(4.0).unwrap();
        // three Cramér-Rao standard deviations
        let std = (6.0 / tone.gain).sqrt() / (TAU * n as f64 * step);
        assert!((tone.frequency_hz - 0.1234).abs() < 3.0 * std, "{tone:?}");
        // expected gain n a²/4 = 46
        assert!((tone.gain - 46.0).abs() < 4.0 * 46.0_f64.sqrt() * 1.5);
        let comb = lines.comb(4.0, 4).unwrap();
        assert!((comb.frequency_hz - 0.1234).abs() < 1e-3, "{comb:?}");
    }
}
