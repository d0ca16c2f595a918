//! Every effect at rest: known parameters injected by the simulator lie in the 95 % intervals of `gap::explain` as often as
//! they should.
//!
//! `cargo test --test gap battery -- --ignored --nocapture --test-threads 1` takes 200 recordings an effect, and prints
//! the tables of `data/gap_effects.md`.

use crate::cases::cases;
use gyroid::config::{Config, EffectTable};
use gyroid::effects::{Library, Parameters};
use gyroid::gap::explain;
use gyroid::math::random::Stream;
use gyroid::signal::{Log, TimeAxis, names};
use gyroid::simulate::{self, stationary_like};
use statrs::distribution::{Binomial, DiscreteCDF};

const REST: &str = "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.2\n[gyro]\nc1_rad_s = 1e-3\nc2_rad_s = -2e-3\n\
    time_constant_s = 300.0\nangle_random_walk_rad_sqrt_s = 1e-4\nturn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.03\n";
/// White noise of a sample, rad/s: 1e-4 / √0.2.
const WHITE_STD_RAD_S: f64 = 2.236e-4;
const ROWS: usize = 8000;
/// In a test; the battery takes many.
const FEW: usize = 30;
const MANY: u64 = 200;
/// Probability that an honest set of intervals fails the test, over all effects and parameters.
const FALSE_ALARM: f64 = 0.01;
/// Parameters under test.
const TESTED: f64 = 25.0;

/// Twenty-seven minutes: a room that drifts, self-heating, a supply with a load that comes and goes.
fn surroundings(seed: u64) -> Log {
    let mut log = Log::new("surroundings", TimeAxis::Uniform { start_s: 0.0, step_s: 0.2, len: ROWS });
    let (mut room, mut load) = (Stream::new(seed, 1), Stream::new(seed, 2));
    let (mut drift, mut high) = (0.0, 0.0);
    let (mut temperature, mut supply) = (Vec::new(), Vec::new());
    for i in 0..ROWS {
        let t = 0.2 * i as f64;
        drift += 0.02 * room.normal() - 4e-4 * drift;
        if load.uniform() < 1e-3 {
            high = 0.03 - high;
        }
        temperature.push(22.0 + 8.0 * (1.0 - (-t / 500.0).exp()) + drift + 0.02 * room.normal());
        supply.push(5.0 - high + 1e-3 * load.normal());
    }
    log.push(names::TEMPERATURE, temperature).unwrap();
    log.push(names::SUPPLY, supply).unwrap();
    log.push(names::GYRO_Z, vec![0.0; ROWS]).unwrap();
    log
}

/// Uniform in the logarithm.
fn size(s: &mut Stream, low: f64, high: f64) -> f64 {
    low * (high / low).powf(s.uniform())
}

fn signed(s: &mut Stream, low: f64, high: f64) -> f64 {
    if s.uniform() < 0.5 { -size(s, low, high) } else { size(s, low, high) }
}

/// Parameters of one draw, from hardly visible to plain, and those of them that are to be recovered.
fn drawn(id: &str, s: &mut Stream) -> (Vec<(&'static str, f64)>, usize) {
    match id {
        "gyro.rate_random_walk" => (vec![("rate_random_walk_rad_s_sqrt_s", size(s, 2e-6, 1e-5))], 1),
        "gyro.bias_instability" => (vec![("bias_instability_rad_s", size(s, 4e-5, 2e-4))], 1),
        "gyro.gauss_markov" => {
            (vec![("correlation_time_s", size(s, 4.0, 60.0)), ("std_rad_s", size(s, 6e-5, 2e-4))], 2)
        }
        "gyro.quantization" => (vec![("lsb_rad_s", size(s, 5e-5, 1e-3))], 1),
        "gyro.rate_ramp" => (vec![("ramp_rad_s2", signed(s, 5e-8, 5e-7))], 1),
        "gyro.second_time_constant" => {
            (vec![("c3_rad_s", signed(s, 2e-4, 1e-3)), ("time_constant_s", size(s, 10.0, 80.0))], 2)
        }
        "gyro.temperature_sensitivity" => {
            let lag = if s.uniform() < 0.5 { 0.0 } else { size(s, 20.0, 200.0) };
            (vec![("coefficient_rad_s_per_c", signed(s, 2e-5, 1e-4)), ("lag_s", lag)], 1)
        }
        "gyro.supply_sensitivity" => (vec![("coefficient_rad_s_per_v", signed(s, 1e-3, 1e-2))], 1),
        "gyro.tone" => (vec![("frequency_hz", size(s, 0.02, 2.3)), ("amplitude_rad_s", size(s, 3e-5, 2e-4))], 2),
        "gyro.bias_step" => (vec![("step_rad_s", signed(s, 5e-5, 3e-4))], 1),
        "gyro.outliers" => {
            let amplitude = size(s, 6.0, 40.0) * WHITE_STD_RAD_S;
            (vec![("probability_per_sample", size(s, 1e-3, 1e-2)), ("amplitude_rad_s", amplitude)], 1)
        }
        "gyro.telegraph_noise" => {
            (vec![("level_spacing_rad_s", size(s, 2e-4, 6e-4)), ("mean_dwell_s", size(s, 4.0, 50.0))], 2)
        }
        "gyro.bandwidth" => {
            let (order, sections) = [(1.0, 1.0), (1.0, 2.0), (2.0, 1.0)][(3.0 * s.uniform()) as usize];
            let zero = if order > 1.0 { 1.0 } else { 0.0 };
            let form = [("order", order), ("sections", sections), ("nyquist_zero", zero)];
            ([&[("cutoff_hz", size(s, 0.2, 2.0))], &form[..]].concat(), 1)
        }
        "gyro.noise_growth" => (vec![("relative_per_c", signed(s, 0.01, 0.06))], 1),
        "gyro.turn_on_shift" => (vec![("shift_rad_s", signed(s, 1.5e-3, 8e-3))], 1),
        "gyro.warm_up" => (vec![("c1_rad_s", signed(s, 5e-4, 3e-3)), ("time_constant_s", size(s, 30.0, 200.0))], 2),
        "gyro.noise_level" => (vec![("noise_over_nominal", size(s, 0.3, 4.0))], 1),
        "gyro.narrow_band_noise" => {
            let center = size(s, 0.1, 2.0);
            let band = [("center_hz", center), ("bandwidth_hz", center * size(s, 0.01, 0.15))];
            ([&band[..], &[("std_rad_s", size(s, 8e-5, 2e-4))]].concat(), 3)
        }
        _ => unreachable!("{id}"),
    }
}

/// A recording of the nominal simulator with one effect.
fn recording(id: &str, parameters: &[(&str, f64)], seed: u64) -> Log {
    let mut real = Config::parse(REST, "sim.toml").unwrap();
    let table: Parameters = parameters.iter().map(|(k, v)| ((*k).to_string(), *v)).collect();
    real.effects.push(EffectTable { id: id.into(), parameters: table });
    let options = simulate::Options { vary_turn_on: true, ..seed.into() };
    stationary_like(&real, &surroundings(seed), &options, &Library::new()).unwrap()
}

/// What became of one parameter over all draws.
#[derive(Default)]
struct Record {
    name: &'static str,
    drawn: usize,
    covered: usize,
    /// Σ of (estimate - truth)/std and of its square, in the logarithm where the interval is symmetric there.
    z: [f64; 2],
    errors: Vec<f64>,
}

fn drawn_records(id: &'static str, draws: usize) -> Vec<Record> {
    let config = Config::parse(REST, "sim.toml").unwrap();
    let mut records: Vec<Record> = Vec::new();
    for draw in 0..draws as u64 {
        let seed = 1000 * id.len() as u64 + 7919 * draw + id.bytes().map(u64::from).sum::<u64>();
        let (parameters, tested) = drawn(id, &mut Stream::new(seed, 3));
        let log = recording(id, &parameters, seed);
        let found = explain(&config, &log, &Library::new(), &[id], 0.0).unwrap();
        for (i, (name, truth)) in parameters.into_iter().take(tested).enumerate() {
            if records.len() <= i {
                records.push(Record { name, ..Record::default() });
            }
            let record = &mut records[i];
            record.drawn += 1;
            // an effect that is not seen at all covers nothing
            let Some(e) = found.effects.first().and_then(|e| e.parameters.get(name)) else { continue };
            record.covered += usize::from(e.ci95[0] <= truth && truth <= e.ci95[1]);
            let z = (e.estimate - truth) / e.std;
            record.z[0] += z;
            record.z[1] += z * z;
            record.errors.push((e.estimate / truth - 1.0).abs());
            if std::env::var_os("GYROID_MISSES").is_some() && !(e.ci95[0] <= truth && truth <= e.ci95[1]) {
                println!(
                    "{id} {name} draw {draw}: {truth:.5e} not in {:.5e} .. {:.5e}, gain {:.1}",
                    e.ci95[0], e.ci95[1], found.effects[0].gain_nats
                );
            }
        }
    }
    records
}

/// Fewest and most of `draws` that an honest 95 % interval covers, but for a chance of [`FALSE_ALARM`] over all parameters.
fn bounds(draws: usize) -> [usize; 2] {
    let law = Binomial::new(0.95, draws as u64).unwrap();
    let tail = 0.5 * FALSE_ALARM / TESTED;
    let low = (0..=draws as u64).find(|k| law.cdf(*k) > tail).unwrap();
    let high = (0..=draws as u64).find(|k| law.cdf(*k) >= 1.0 - tail).unwrap();
    [low as usize, high as usize]
}

#[track_caller]
fn covers(id: &'static str) {
    let [low, _] = bounds(FEW);
    for r in drawn_records(id, FEW) {
        assert!(r.covered >= low, "{id} {}: {} of {FEW}, at least {low} expected", r.name, r.covered);
    }
}

macro_rules! each {
    ($($test:ident: $id:literal;)*) => {
        $(#[test] fn $test() { covers($id); })*
        const IDS: &[&str] = &[$($id),*];
    };
}

each! {
    random_walk: "gyro.rate_random_walk";
    flicker: "gyro.bias_instability";
    correlated_noise: "gyro.gauss_markov";
    lattice: "gyro.quantization";
    ramp: "gyro.rate_ramp";
    second_exponential: "gyro.second_time_constant";
    temperature: "gyro.temperature_sensitivity";
    supply: "gyro.supply_sensitivity";
    tone: "gyro.tone";
    step: "gyro.bias_step";
    outliers: "gyro.outliers";
    two_levels: "gyro.telegraph_noise";
    low_pass: "gyro.bandwidth";
    growing_noise: "gyro.noise_growth";
    turn_on: "gyro.turn_on_shift";
    warm_up: "gyro.warm_up";
    noise_level: "gyro.noise_level";
    narrow_band: "gyro.narrow_band_noise";
}

#[test]
#[ignore = "battery: 200 recordings of each of eighteen effects"]
fn battery_of_intervals() {
    let only = std::env::var("GYROID_ONLY").unwrap_or_default();
    let many = cases(MANY) as usize;
    let [low, high] = bounds(many);
    println!("honest 95 % intervals: {low} to {high} of {many}");
    println!("| effect | parameter | covered | mean z | rms z | median error |");
    println!("|---|---|---|---|---|---|");
    let mut bad = Vec::new();
    for id in IDS.iter().filter(|id| id.contains(&only)) {
        for mut r in drawn_records(id, many) {
            let n = r.errors.len().max(1) as f64;
            r.errors.sort_by(f64::total_cmp);
            let median = r.errors.get(r.errors.len() / 2).copied().unwrap_or(f64::NAN);
            println!(
                "| `{id}` | `{}` | {} | {:.2} | {:.2} | {:.1} % |",
                r.name,
                r.covered,
                r.z[0] / n,
                (r.z[1] / n).sqrt(),
                100.0 * median
            );
            if r.covered < low {
                bad.push(format!("{id} {}: {} of {}", r.name, r.covered, r.drawn));
            }
        }
    }
    assert!(bad.is_empty(), "too few in their intervals: {bad:?}");
}

/// One effect a recording, plain to see.
const STANDARD: &[(&str, &[(&str, f64)])] = &[
    ("gyro.rate_random_walk", &[("rate_random_walk_rad_s_sqrt_s", 6e-6)]),
    ("gyro.bias_instability", &[("bias_instability_rad_s", 1e-4)]),
    ("gyro.gauss_markov", &[("correlation_time_s", 20.0), ("std_rad_s", 1e-4)]),
    ("gyro.quantization", &[("lsb_rad_s", 3e-4)]),
    ("gyro.rate_ramp", &[("ramp_rad_s2", 2e-7)]),
    ("gyro.second_time_constant", &[("c3_rad_s", 6e-4), ("time_constant_s", 40.0)]),
    ("gyro.temperature_sensitivity", &[("coefficient_rad_s_per_c", 5e-5), ("lag_s", 60.0)]),
    ("gyro.supply_sensitivity", &[("coefficient_rad_s_per_v", 5e-3)]),
    ("gyro.tone", &[("frequency_hz", 0.31), ("amplitude_rad_s", 6e-5)]),
    ("gyro.bias_step", &[("step_rad_s", 1e-4), ("time_s", 700.0)]),
    ("gyro.outliers", &[("probability_per_sample", 3e-3), ("amplitude_rad_s", 3e-3)]),
    ("gyro.telegraph_noise", &[("level_spacing_rad_s", 3e-4), ("mean_dwell_s", 20.0)]),
    ("gyro.bandwidth", &[("cutoff_hz", 1.5)]),
    ("gyro.noise_growth", &[("relative_per_c", 0.03)]),
    ("gyro.turn_on_shift", &[("shift_rad_s", 3e-3)]),
    ("gyro.warm_up", &[("c1_rad_s", 1.6e-3), ("time_constant_s", 150.0)]),
    ("gyro.noise_level", &[("noise_over_nominal", 1.3)]),
    ("gyro.narrow_band_noise", &[("center_hz", 0.7), ("bandwidth_hz", 0.05), ("std_rad_s", 1e-4)]),
];
/// Recordings that an overlap is the mean of.
const STANDARD_LOGS: u64 = 4;

/// What `other` gains on a recording with `made`, nats.
fn gain(log: &Log, other: &str) -> f64 {
    let config = Config::parse(REST, "sim.toml").unwrap();
    let found = explain(&config, log, &Library::new(), &[other], 0.0).unwrap();
    found.effects.first().map_or(0.0, |e| e.gain_nats.max(0.0))
}

/// The part of what the right effect gains on its recordings that `other` gains there.
fn overlap(made: (&str, &[(&str, f64)]), other: &str) -> f64 {
    let sums = (0..STANDARD_LOGS).map(|k| {
        let log = recording(made.0, made.1, 500 + k);
        [gain(&log, other), gain(&log, made.0)]
    });
    let [wrong, right] = sums.fold([0.0; 2], |a, g| [a[0] + g[0], a[1] + g[1]]);
    (wrong / right).clamp(0.0, 1.0)
}

#[test]
#[ignore = "sixty recordings, fifteen fits each"]
fn resemblance_of_all_pairs() {
    let short = |id: &str| id.trim_start_matches("gyro.").replace('_', " ");
    println!("| made by | {} |", IDS.iter().map(|id| short(id)).collect::<Vec<_>>().join(" | "));
    println!("|---|{}", "---|".repeat(IDS.len()));
    for made in STANDARD {
        let row: Vec<String> = IDS.iter().map(|other| format!("{:.2}", overlap(*made, other))).collect();
        println!("| {} | {} |", short(made.0), row.join(" | "));
    }
}

#[test]
fn what_physics_brings_close_is_close_and_the_rest_is_not() {
    let made = |id: &str| *STANDARD.iter().find(|m| m.0 == id).unwrap();
    // a telegraph signal has the spectrum of a Gauss-Markov process, and a short walk is one with a long correlation time
    assert!(overlap(made("gyro.rate_random_walk"), "gyro.gauss_markov") > 0.8);
    assert!(overlap(made("gyro.telegraph_noise"), "gyro.gauss_markov") > 0.5);
    // a vibration is neither a filter nor a rare sample
    assert!(overlap(made("gyro.tone"), "gyro.outliers") < 0.1);
    assert!(overlap(made("gyro.outliers"), "gyro.tone") < 0.1);
}
