//! Each effect of the generator does to a log what it should; bounds are from the theory of the statistic.

use super::bias::Telegraph;
use super::case;
use super::catalogue::{COMMON, LISTED, UNLISTED, draw};
use super::effect::Effect;
use super::files::Files;
use super::label::Strength;
use super::run::{Run, Unit};
use super::*;
use crate::math::random::Stream;
use crate::math::spectra::Periodogram;
use crate::signal::names;
use std::collections::BTreeSet;
use std::path::Path;

mod kept;
mod new;

/// Case `index` as one machine records it.
fn make(seed: u64, index: usize, spec: &Spec) -> Result<Case> {
    case::make(seed, index, spec, 0.0)
}

fn run(seed: u64) -> Run {
    let unit = Unit::draw(&mut Stream::new(seed, 1));
    Run::draw(&unit, &mut Stream::new(seed, 2))
}

fn effect(id: &str, run: &Run, seed: u64) -> Box<dyn Effect> {
    draw(id, &run.unit, &mut Stream::new(seed, 3)).unwrap()
}

fn path(id: &str, run: &Run, seed: u64) -> Vec<f64> {
    effect(id, run, seed).path(run, &mut Stream::new(seed, 4))
}

fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len() as f64
}

fn variance(x: &[f64]) -> f64 {
    let m = mean(x);
    x.iter().map(|v| (v - m).powi(2)).sum::<f64>() / x.len() as f64
}

fn correlation(x: &[f64], y: &[f64]) -> f64 {
    let (mx, my) = (mean(x), mean(y));
    let cross: f64 = x.iter().zip(y).map(|(a, b)| (a - mx) * (b - my)).sum();
    cross / (x.len() as f64 * (variance(x) * variance(y)).sqrt())
}

/// White noise after `id` at `strength`.
fn white(id: &str, run: &Run, seed: u64, strength: f64) -> Vec<f64> {
    let mut noise = Stream::new(seed, 5);
    let mut z: Vec<f64> = (0..run.len).map(|_| noise.normal()).collect();
    effect(id, run, seed).white(strength, &mut z, run, &mut Stream::new(seed, 6));
    z
}

/// Unit white noise in rad/s, as it comes out of `id` at `strength`.
fn output(id: &str, run: &Run, seed: u64, strength: f64) -> (Vec<f64>, Vec<f64>) {
    let (mut noise, std) = (Stream::new(seed, 5), run.unit.white_std_rad_s());
    let before: Vec<f64> = (0..run.len).map(|_| std * noise.normal()).collect();
    let mut after = before.clone();
    effect(id, run, seed).output(strength, &mut after, run, &mut Stream::new(seed, 6));
    (before, after)
}

#[test]
fn the_generator_knows_nothing_of_the_diagnosis() {
    let allowed = ["math", "signal", "config", "units", "error", "ingest"];
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/bench/worlds");
    let (mut found, mut folders, mut files) = (BTreeSet::new(), vec![root], 0);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            files += 1;
            let text = std::fs::read_to_string(path).unwrap();
            for line in text.lines().filter(|l| !l.trim_start().starts_with("//")) {
                // the generator itself, and nothing else of the bench
                for rest in line.split("crate::").skip(1).filter(|rest| !rest.starts_with("bench::worlds")) {
                    found.insert(rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>());
                }
                for rest in line.split("gyroid::").skip(1) {
                    assert!(line.contains('"'), "the crate under its own name: {rest}");
                }
            }
        }
    }
    found.remove("");
    let strangers: Vec<_> = found.iter().filter(|m| !allowed.contains(&m.as_str())).collect();
    assert!(strangers.is_empty(), "{strangers:?}");
    assert!(found.contains("signal") && found.contains("config"), "the scan sees nothing: {found:?}");
    assert!(files >= 28, "the scan sees {files} files: folders below are part of the generator");
}

#[test]
fn labels_state_the_nats_of_each_main_effect() {
    for kind in [Kind::Stationary, Kind::Driving] {
        let listed = if kind == Kind::Driving { "wheel.radius_scale" } else { "gyro.rate_ramp" };
        for strength in [Strength::Weak, Strength::Medium] {
            let spec = Spec { effects: vec![(listed, strength)], messy: false };
            let label = crate::bench::worlds::make(kind, 5, 0, &spec).unwrap().label;
            let [low, high] = label.strength.nats();
            let nats = label.nats[listed];
            assert!(label.nats.len() == 1 && (low..=high).contains(&nats), "{listed}: {nats} nats in {low} to {high}");
        }
    }
}

#[test]
fn every_effect_shows_as_clearly_as_it_was_asked_to() {
    for seed in 0..3 {
        let run = run(seed);
        for (list, targets) in [(&LISTED[..], [5.0, 60.0, 2500.0]), (&UNLISTED[..], [12.0, 60.0, 2500.0])] {
            for id in list {
                let effect = effect(id, &run, seed);
                let path = effect.path(&run, &mut Stream::new(seed, 4));
                for target in targets {
                    let strength = effect.strength(&run, &path, target);
                    let nats = effect.nats(&run, &path, strength);
                    assert!((nats / target - 1.0).abs() < 0.02, "{id}, seed {seed}: {nats} nats for {target}");
                    let stronger = effect.nats(&run, &path, 1.1 * strength);
                    assert!(stronger > nats, "{id}: {stronger} nats at more strength");
                }
            }
        }
    }
}

#[test]
fn a_unit_without_effects_is_the_nominal_simulator() {
    for index in 0..6 {
        let case = make(3, index, &Spec { effects: Vec::new(), messy: false }).unwrap();
        assert!(case.label.effects.is_empty() && case.label.strength == Strength::None);
        let gyro = case.config.require_gyro().unwrap();
        let step_s = case.config.sample_time_s.unwrap();
        let expected = gyro.angle_random_walk_rad_sqrt_s.powi(2) / step_s;
        for log in [&case.fit, &case.hold] {
            assert!((7290.0..8701.0).contains(&log.time.span_s()), "{} s", log.time.span_s());
            let y = log.get(names::GYRO_Z).unwrap();
            // differences of neighbours: the warm-up moves by less than 1e-6 rad/s in a sample
            let d2 = y.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum::<f64>() / (2.0 * (y.len() - 1) as f64);
            let bound = 5.0 * (3.0 / y.len() as f64).sqrt();
            assert!((d2 / expected - 1.0).abs() < bound, "{} against {expected}", d2);
            // where it ends: c1 + c2 inside the repeatability
            let tail = &y[y.len() * 9 / 10..];
            let t_s = 0.95 * log.time.span_s();
            let nominal = gyro.warm_up().error_rad_s(t_s);
            let std =
                gyro.turn_on_bias_std_rad_s.unwrap().hypot(2.0 * gyro.warm_up_relative_std.unwrap() * gyro.c1_rad_s);
            assert!((mean(tail) - nominal).abs() < 4.5 * std, "{} against {nominal}", mean(tail));
            let c = log.get(names::TEMPERATURE).unwrap();
            let rise = mean(&c[c.len() * 3 / 4..]) - c[0];
            assert!((1.0..18.0).contains(&rise), "{rise} °C");
            let v = log.get(names::SUPPLY).unwrap();
            assert!((4.7..5.3).contains(&mean(v)) && (0.004..0.06).contains(&variance(v).sqrt()));
        }
        assert_ne!(case.fit, case.hold);
    }
}

#[test]
fn cases_repeat_and_differ_by_seed_and_index() {
    let spec =
        Spec { effects: vec![("gyro.tone", Strength::Medium), ("gyro.bandwidth", Strength::Strong)], messy: true };
    let one = make(1, 0, &spec).unwrap();
    assert_eq!(one, make(1, 0, &spec).unwrap());
    assert_ne!(one.fit, make(1, 1, &spec).unwrap().fit);
    assert_ne!(one.fit, make(2, 0, &spec).unwrap().fit);
    assert!(make(1, 0, &Spec { effects: vec![("gyro.nonsense", Strength::Weak)], messy: false }).is_err());
}

#[test]
fn a_plan_holds_the_shares_that_were_asked_for_evenly() {
    let mix = Mix { cases: 400, none: 0.15, pairs: 0.2, unlisted: 0.1, messy: 0.5, habits: 0.0 };
    let plan = plan(&mix, Kind::Stationary, 9).unwrap();
    let count = |f: &dyn Fn(&Spec) -> bool| plan.iter().filter(|s| f(s)).count();
    assert_eq!(plan.len(), 400);
    assert_eq!(count(&|s| s.effects.is_empty()), 60);
    assert_eq!(count(&|s| s.effects.len() == 2), 80);
    assert!(plan.iter().all(|s| s.effects.len() < 2 || s.effects[0].0 != s.effects[1].0));
    assert_eq!(count(&|s| s.effects.len() == 1 && s.effects[0].0.starts_with("x.")), 40);
    // 220 of 18: each 12 or 13 times, each strength of it 4 or 5
    for id in LISTED {
        let n = count(&|s| s.effects.len() == 1 && s.effects[0].0 == id);
        assert!((12..=13).contains(&n), "{id}: {n}");
        let weak = count(&|s| s.effects == [(id, Strength::Weak)]);
        assert!((4..=5).contains(&weak), "{id}: {weak} weak");
    }
    let messy = count(&|s| s.effects.len() == 1 && s.messy && s.effects[0].0.starts_with("gyro."));
    // binomial, 220 at 1/2: standard deviation 7.4
    assert!((77..=143).contains(&messy), "{messy}");
    assert!(crate::bench::worlds::plan(&Mix { pairs: 0.9, ..mix }, Kind::Stationary, 9).is_err());
    assert!(crate::bench::worlds::plan(&Mix { messy: f64::NAN, ..mix }, Kind::Stationary, 9).is_err());
}

#[test]
fn background_is_named_and_small() {
    let spec = Spec { effects: vec![("gyro.tone", Strength::Strong)], messy: true };
    let clean = Spec { messy: false, ..spec.clone() };
    let mut named = 0;
    for index in 0..4 {
        let (dirty, clean) = (make(5, index, &spec).unwrap(), make(5, index, &clean).unwrap());
        named += dirty.label.background.len();
        assert!(dirty.label.background.iter().all(|id| COMMON.contains(&id.as_str())));
        assert_eq!(dirty.label.effects, clean.label.effects);
        assert_eq!(dirty.fit == clean.fit, dirty.label.background.is_empty());
    }
    // binomial, 36 at 1/2: standard deviation 3
    assert!((4..=32).contains(&named), "{named}");
}

/// Mean of the periodogram over the PSD, from frequency number `from` to `to`, and of how many independent ones.
fn whitened(x: &[f64], step_s: f64, psd: impl Fn(f64) -> f64, from: usize, to: usize) -> (f64, f64) {
    // Hann's taper: without it the ends of a slow path leak over the tail of its spectrum
    let (n, m) = (x.len(), mean(x));
    let taper = |i: usize| 1.0 - (std::f64::consts::TAU * (i as f64 + 0.5) / n as f64).cos();
    let tapered: Vec<f64> = x.iter().enumerate().map(|(i, v)| taper(i) * (v - m)).collect();
    let power: f64 = (0..n).map(|i| taper(i).powi(2)).sum();
    let ordinates = Periodogram::new(n).ordinates(&tapered);
    let ratio = |k: usize| ordinates[k - 1] * step_s / power / psd(k as f64 / (n as f64 * step_s));
    let ratios: Vec<f64> = (from..to).map(ratio).collect();
    // neighbours share half of what the taper lets through
    (mean(&ratios), ratios.len() as f64 / 2.0)
}

#[test]
fn coloured_noises_have_the_spectrum_by_which_they_are_scaled() {
    for seed in 0..4 {
        let run = run(seed);
        for id in ["gyro.bias_instability", "gyro.gauss_markov"] {
            let effect = effect(id, &run, seed);
            let x = effect.path(&run, &mut Stream::new(seed, 4));
            let (ratio, of) = whitened(&x, run.step_s(), |f| effect.psd(f).unwrap(), 20, run.len / 40);
            // ordinates are exponential; 2 % for the averaging over a sample
            assert!((ratio - 1.0).abs() < 5.0 / of.sqrt() + 0.02, "{id}: {ratio} over {of}");
        }
        // a random walk by its increments: their mean square over the time between
        let x = path("gyro.rate_random_walk", &run, seed);
        for stride in [50, 400] {
            let d: Vec<f64> =
                x.iter().step_by(stride).zip(x.iter().skip(stride).step_by(stride)).map(|(a, b)| b - a).collect();
            let ratio = d.iter().map(|v| v * v).sum::<f64>() / (d.len() as f64 * stride as f64 * run.step_s());
            // tails are heavier than normal by a factor below 2 in variance; averaging takes a third of a sample
            assert!((ratio - 1.0).abs() < 5.0 * (4.0 / d.len() as f64).sqrt() + 0.02, "{ratio} over {}", d.len());
        }
    }
}

#[test]
fn telegraph_noise_dwells_as_long_as_its_label_says() {
    for seed in 0..5 {
        let run = run(seed);
        let effect = Telegraph::draw(&mut Stream::new(seed, 3));
        let label = effect.parameters(&run, &[], 1.0)["mean_dwell_s"];
        let (path, flips) = effect.once(&run, &mut Stream::new(seed, 4));
        let expected = run.span_s() / label;
        // of dwell times with a coefficient of variation of √2 at most, two levels of unequal means
        let bound = 5.0 * (3.0 * expected).sqrt() + 2.0;
        assert!((flips as f64 - expected).abs() < bound, "{flips} flips, expected {expected}");
        let spread = path.iter().copied().fold(f64::MIN, f64::max) - path.iter().copied().fold(f64::MAX, f64::min);
        assert!((0.7..1.8).contains(&spread), "levels {spread} apart");
    }
}

#[test]
fn signals_have_the_shape_of_their_name() {
    for seed in 0..4 {
        let run = run(seed);
        let times: Vec<f64> = run.times_s().collect();
        let ramp = path("gyro.rate_ramp", &run, seed);
        assert!(correlation(&ramp, &times).abs() > 0.9995);
        assert!((ramp.last().unwrap().abs() / run.span_s() - 1.0).abs() < 1e-3);

        let second = effect("gyro.second_time_constant", &run, seed);
        let x = second.path(&run, &mut Stream::new(seed, 4));
        let label = second.parameters(&run, &x, 1.0);
        let row = (label["time_constant_s"] / run.step_s()).round() as usize;
        assert!((x[row].abs() - 0.632).abs() < 0.01, "{}", x[row]);
        assert!((x[run.len - 1] - label["c3_rad_s"]).abs() < 1e-3);

        let step = path("gyro.bias_step", &run, seed);
        let tenth = run.len / 10;
        assert!(step[..tenth].iter().all(|v| v.abs() < 1e-3));
        assert!(step[run.len - tenth..].iter().all(|v| (v.abs() - 1.0).abs() < 1e-3));
        let crossings = step.windows(2).filter(|w| (w[0].abs() < 0.5) != (w[1].abs() < 0.5)).count();
        assert_eq!(crossings, 1);

        let warm = path("gyro.temperature_sensitivity", &run, seed);
        assert!(correlation(&warm, &run.warming_c()).abs() > 0.9);
        let supply = path("gyro.supply_sensitivity", &run, seed);
        assert!(correlation(&supply, &run.supply_v).abs() > 0.98);

        let tone = effect("gyro.tone", &run, seed);
        let x = tone.path(&run, &mut Stream::new(seed, 4));
        let ordinates = Periodogram::new(run.len).ordinates(&x);
        let peak = ordinates.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).unwrap().0 + 1;
        let found_hz = peak as f64 / run.span_s();
        let label = tone.parameters(&run, &x, 2.0);
        assert!((found_hz - label["frequency_hz"]).abs() < 1.6 / run.span_s(), "{found_hz} Hz");
        assert_eq!(label["amplitude_rad_s"], 2.0);
        // a sinusoid of amplitude one, breathing by 12 % at most
        assert!((variance(&x) - 0.5).abs() < 0.13, "{}", variance(&x));
    }
}

#[test]
fn filters_pass_half_the_power_at_their_cutoff_and_colour_the_noise_so() {
    let mut forms = BTreeSet::new();
    for seed in 0..12 {
        let run = run(seed);
        let filter = crate::bench::worlds::sensor::Bandwidth::draw(&mut Stream::new(seed, 3));
        forms.insert(filter.form());
        // far below the substeps' rate, where the digital filter is the analog one
        let cutoff_hz = 0.1 / run.step_s();
        let at_cutoff = filter.gain(cutoff_hz, cutoff_hz, run.step_s());
        assert!((at_cutoff - 0.5).abs() < 0.02, "{at_cutoff}");
        assert!((filter.gain(1e-6, cutoff_hz, run.step_s()) - 1.0).abs() < 1e-6);
        if seed < 5 {
            let mut z = vec![0.0; run.len];
            filter.white(1.0 / cutoff_hz, &mut z, &run, &mut Stream::new(seed, 6));
            let psd = |f: f64| filter.sampled(f, cutoff_hz, run.step_s()) * run.step_s();
            let (ratio, of) = whitened(&z, run.step_s(), psd, 1, run.len / 4);
            assert!((ratio - 1.0).abs() < 5.0 / of.sqrt(), "{ratio} over {of}");
        }
    }
    assert!(forms.len() >= 3, "{forms:?}");
}

#[test]
fn lattices_outliers_and_growth_change_what_they_should() {
    for seed in 0..4 {
        let run = run(seed);
        let (n, std) = (run.len as f64, run.unit.white_std_rad_s());
        let lsb = 0.8 * std;
        let (_, y) = output("gyro.quantization", &run, seed, lsb);
        let first = y[0] / lsb;
        assert!(y.iter().all(|v| ((v / lsb - first) - (v / lsb - first).round()).abs() < 1e-6));
        let expected = std * std * (1.0 + 0.64 / 12.0);
        assert!((variance(&y) / expected - 1.0).abs() < 5.0 * (2.0 / n).sqrt() + 1e-3);

        let (before, after) = output("gyro.outliers", &run, seed, 20.0);
        let changed = before.iter().zip(&after).filter(|(a, b)| a != b).count() as f64;
        let p = effect("gyro.outliers", &run, seed).parameters(&run, &[], 1.0)["probability_per_sample"];
        // clusters of three make the count wilder
        assert!((changed - p * n).abs() < 5.0 * (3.0 * p * n).sqrt() + 3.0, "{changed} of {}", p * n);

        // of ones it leaves its factors
        let mut factors = vec![1.0; run.len];
        effect("gyro.noise_growth", &run, seed).white(0.5, &mut factors, &run, &mut Stream::new(seed, 6));
        assert!((factors[0] - 1.0).abs() < 1e-3 && mean(&factors[run.len / 2..]) > 1.15);
        assert!(correlation(&factors, &run.warming_c()) > 0.9);
    }
}

#[test]
fn unlisted_noises_change_what_they_should() {
    for seed in 0..4 {
        let run = run(seed);
        let n = run.len as f64;
        let bursts = white("x.noise_bursts", &run, seed, 1.0);
        let mut blocks: Vec<f64> = bursts.chunks(run.len / 200).map(variance).collect();
        let quiet = crate::math::robust::quantile(&mut blocks, 0.05);
        let loud = crate::math::robust::quantile(&mut blocks, 1.0);
        assert!(loud > 1.5 * quiet, "{quiet} to {loud}");

        // Student's t with 12 degrees of freedom: variance one, kurtosis 3 + 6/8
        let heavy = white("x.heavy_tails", &run, seed, 0.1);
        assert!((variance(&heavy) - 1.0).abs() < 5.0 * (2.75 / n).sqrt(), "{}", variance(&heavy));
        let fourth = heavy.iter().map(|z| z.powi(4)).sum::<f64>() / n;
        assert!((3.2..5.5).contains(&fourth), "{fourth}");

        let soft = white("x.saturation", &run, seed, 0.4);
        assert!(soft.iter().all(|z| z.abs() <= 2.5) && variance(&soft) < 0.85);

        let repeats = |y: &[f64]| y.windows(2).filter(|w| w[0] == w[1]).count() as f64 / n;
        let (_, stuck) = output("x.stuck_samples", &run, seed, 0.2);
        assert!((repeats(&stuck) / 0.2 - 0.9).abs() < 0.2, "{}", repeats(&stuck));
        let (_, dead) = output("x.dead_band", &run, seed, 0.2);
        assert!((repeats(&dead) / 0.2 - 1.0).abs() < 0.2, "{}", repeats(&dead));
    }
}

#[test]
fn unlisted_signals_have_the_shape_of_their_name() {
    for seed in 0..4 {
        let run = run(seed);
        for id in ["x.pulse_train", "x.sawtooth", "x.square_wave"] {
            let effect = effect(id, &run, seed);
            let x = effect.path(&run, &mut Stream::new(seed, 4));
            let [f_hz, _] = effect.place(&run, &x).frequency_hz.unwrap();
            let shift = (1.0 / (f_hz * run.step_s())).round() as usize;
            let again = correlation(&x[..run.len - shift], &x[shift..]);
            let half = correlation(&x[..run.len - shift / 2], &x[shift / 2..]);
            assert!(again > 0.3 && half < 0.1, "{id}: {again} after a period, {half} after half of one");
        }
        let chirp = effect("x.chirp", &run, seed);
        let x = chirp.path(&run, &mut Stream::new(seed, 4));
        let [low, high] = chirp.place(&run, &x).frequency_hz.unwrap();
        let crossings = |x: &[f64]| x.windows(2).filter(|w| w[0].signum() != w[1].signum()).count() as f64;
        let tenth = run.len / 10;
        let (first, last) = (crossings(&x[..tenth]), crossings(&x[run.len - tenth..]));
        assert!(first.max(last) + 2.0 > (high / low).sqrt() * (first.min(last) - 2.0), "{first} {last}");

        let rate: Vec<f64> = run.temperature_c.windows(2).map(|w| w[1] - w[0]).collect();
        let early = run.len / 20;
        for id in ["x.hysteresis", "x.temperature_rate"] {
            let x = path(id, &run, seed);
            // the unit warms: the early rate is positive
            let sign = x[early].signum();
            assert!(mean(&rate[..early]) > 0.0 && x[early] * sign > 0.0);
            assert!(correlation(&x[..rate.len()], &rate) * sign > 0.2, "{id}");
        }
        let threshold = path("x.supply_threshold", &run, seed);
        let zero = threshold.iter().filter(|v| **v == 0.0).count() as f64 / run.len as f64;
        assert!((0.05..0.95).contains(&zero), "above the threshold for {zero} of the time");
        let ringing = path("x.ringing_after_power_on", &run, seed);
        assert!(variance(&ringing[..run.len / 10]) > 5.0 * variance(&ringing[run.len * 9 / 10..]));
        let shots = path("x.shot_relaxation", &run, seed);
        let jumps = shots.windows(2).filter(|w| (w[1] - w[0]).abs() > 0.25).count();
        assert!((1..200).contains(&jumps), "{jumps}");
        let bursts = path("x.modulated_tone", &run, seed);
        let loud = bursts.iter().filter(|v| v.abs() > 0.3).count() as f64 / run.len as f64;
        assert!((0.005..0.5).contains(&loud), "{loud}");
    }
}
