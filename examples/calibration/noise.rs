//! Intervals of noise terms and of the Allan family.

use crate::table::{Claim, Row, counts, inside};
use gyroid::Result;
use gyroid::identify::terms::{NoiseModel, TermOptions, noise_model};
use gyroid::math::random::Stream;
use gyroid::noise::{Deviation, TermKind, allan};
use gyroid::signal::TimeAxis;
use rayon::prelude::*;

const STEP_S: f64 = 0.4;
const ANGLE_RANDOM_WALK: f64 = 1e-4;
/// Spectra drawn for the goodness of fit: its p values are multiples of 1/20.
const DRAWS: usize = 19;

const GIVEN: &str = "given the terms that the log chose; with a term too many it is another number";

#[derive(Clone, Copy, Default)]
struct Truth {
    quantization: f64,
    rate_random_walk: f64,
    gauss_markov: f64,
}

/// Correlation time of the Gauss-Markov noise, s.
const CORRELATION_TIME_S: f64 = 10.0;

impl Truth {
    fn size(&self, kind: TermKind) -> f64 {
        match kind {
            TermKind::AngleRandomWalk => ANGLE_RANDOM_WALK,
            TermKind::Quantization => self.quantization,
            TermKind::RateRandomWalk => self.rate_random_walk,
            TermKind::GaussMarkov => self.gauss_markov,
            _ => 0.0,
        }
    }

    /// `len` rates, rad/s.
    fn log(&self, seed: u64, len: usize) -> Vec<f64> {
        let [mut white, mut walk, mut angle, mut markov] = [0, 1, 2, 3].map(|stream| Stream::new(seed, stream));
        let decay = (-STEP_S / CORRELATION_TIME_S).exp();
        let mut bias = 0.0;
        let mut before = self.quantization * angle.normal();
        let mut state = self.gauss_markov * markov.normal();
        (0..len)
            .map(|_| {
                bias += self.rate_random_walk * STEP_S.sqrt() * walk.normal();
                let now = self.quantization * angle.normal();
                let rounded = (now - before) / STEP_S;
                before = now;
                state = decay * state + self.gauss_markov * (1.0 - decay * decay).sqrt() * markov.normal();
                ANGLE_RANDOM_WALK / STEP_S.sqrt() * white.normal() + bias + rounded + state
            })
            .collect()
    }
}

pub fn terms(logs: u64) -> Result<Vec<Row>> {
    const LEN: usize = 8192;
    let scenarios = [
        ("Q N K", 211_000, Truth { quantization: 1.2e-4, rate_random_walk: 3.5e-6, ..Truth::default() }),
        ("N Gauss-Markov", 221_000, Truth { gauss_markov: 1.1e-4, ..Truth::default() }),
    ];
    let time = TimeAxis::Uniform { start_s: 0.0, step_s: STEP_S, len: LEN };
    let mut rows = Vec::new();
    for (name, first, truth) in &scenarios {
        let one = |i: u64| {
            let seed = first + i;
            let options = TermOptions { draws: DRAWS, seed, per_decade: 1, ..TermOptions::default() };
            noise_model(&time, &truth.log(seed, LEN), None, &options)
        };
        let models: Vec<NoiseModel> = (0..logs).into_par_iter().map(one).collect::<Result<_>>()?;
        for kind in TermKind::ALL.into_iter().filter(|k| truth.size(*k) > 0.0) {
            let held = |m: &NoiseModel| m.term(kind).map(|t| inside(t.ci95, truth.size(kind)));
            let row = Row::interval(format!("{}, log of {name}", kind.symbol()), counts(models.iter().map(held)));
            rows.push(if row.consistent() { row } else { row.with_note(GIVEN) });
        }
        if truth.gauss_markov > 0.0 {
            let held = |m: &NoiseModel| {
                let time = m.term(TermKind::GaussMarkov)?.correlation_time_s?;
                Some(inside(time.ci95, CORRELATION_TIME_S))
            };
            let row = Row::interval(format!("correlation time, log of {name}"), counts(models.iter().map(held)));
            rows.push(if row.consistent() { row } else { row.with_note(GIVEN) });
        }
        let rejected = counts(models.iter().map(|m| Some(m.goodness.p_value <= 0.05)));
        let row = Row::new(format!("goodness of fit below 0.05, log of {name}"), Claim::Exactly(0.05), rejected);
        rows.push(if row.consistent() { row } else { row.with_note("not the level that it says") });
    }
    Ok(rows)
}

pub fn allan(logs: u64) -> Result<Vec<Row>> {
    const LEN: usize = 4096;
    const AVERAGED: [usize; 4] = [1, 16, 128, 512];
    let white = |deviation: Deviation, m: usize| {
        let n = m as f64;
        // modified: the mean over m angles takes (m² + 1)/2m² (Riley, NIST SP 1065, 5.2.5)
        let ratio = if deviation == Deviation::Modified { (n * n + 1.0) / (2.0 * n * n) } else { 1.0 };
        ANGLE_RANDOM_WALK * (ratio / (n * STEP_S)).sqrt()
    };
    let walk = Truth { rate_random_walk: 3e-5, ..Truth::default() };
    let walking = |m: usize| {
        let of = |kind: TermKind| kind.sampled_allan_variance(m, STEP_S, f64::NAN) * walk.size(kind).powi(2);
        (of(TermKind::AngleRandomWalk) + of(TermKind::RateRandomWalk)).sqrt()
    };
    let held = |first: u64, truth: Truth, deviation: Deviation, expected: &(dyn Fn(usize) -> f64 + Sync)| {
        let one = |i: u64| -> Vec<bool> {
            let points = allan::deviations(&truth.log(first + i, LEN), STEP_S, &AVERAGED, deviation);
            points.iter().map(|p| inside(p.ci95, expected(p.m))).collect()
        };
        (0..logs).into_par_iter().map(one).collect::<Vec<_>>()
    };
    let mut rows = Vec::new();
    let mut add = |name: &str, notes: [&str; 4], held: &[Vec<bool>]| {
        for ((j, m), note) in AVERAGED.iter().enumerate().zip(notes) {
            let of = if *m == 1 { "one sample".into() } else { format!("{m} samples of {LEN}") };
            let row = Row::interval(format!("{name} deviation, {of}"), counts(held.iter().map(|h| h.get(j).copied())));
            rows.push(if row.consistent() { row } else { row.with_note(note) });
        }
    };
    let few = "eight means: the type of the noise is that of shorter times";
    for deviation in Deviation::ALL {
        let name = deviation.id().replace('_', " ").replace("total", "total allan");
        let logs = held(231_000, Truth::default(), deviation, &|m| white(deviation, m));
        add(&format!("white: {name}"), ["", "", "", few], &logs);
    }
    let both = "two noises at once, each with other degrees of freedom";
    add("N and K: overlapping allan", ["", both, both, few], &held(241_000, walk, Deviation::Overlapping, &walking));
    Ok(rows)
}
