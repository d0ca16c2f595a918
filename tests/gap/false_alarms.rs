//! No effect is found in clean recordings more often than is stated: one in twenty.
//!
//! `cargo test --test gap false_alarms:: -- --ignored --nocapture` goes through 200 recordings.

use gyroid::config::Config;
use gyroid::effects::Library;
use gyroid::gap::answer::Verdict;
use gyroid::gap::{Options, diagnose};
use gyroid::math::random::Stream;
use gyroid::signal::{Log, TimeAxis, names};
use gyroid::simulate::{self, stationary_like};
use statrs::distribution::{Binomial, DiscreteCDF};
use std::collections::BTreeMap;

const REST: &str = "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.5\n[gyro]\nc1_rad_s = 1e-3\nc2_rad_s = -2e-3\n\
    time_constant_s = 150.0\nangle_random_walk_rad_sqrt_s = 1e-4\nturn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.03\n";
/// Share of clean recordings with an effect named, at most.
const RATE: f64 = 0.05;
/// Probability that a diagnosis which keeps the rate fails.
const CHANCE: f64 = 0.01;

fn clean(seed: u64, rows: usize) -> Log {
    let mut inputs = Log::new("surroundings", TimeAxis::Uniform { start_s: 0.0, step_s: 0.5, len: rows });
    let mut draw = Stream::new(seed, 1);
    let mut drift = 0.0;
    let mut temperature = Vec::new();
    for i in 0..rows {
        drift += 0.02 * draw.normal() - 1e-3 * drift;
        temperature.push(20.0 + 6.0 * (1.0 - (-(i as f64) / 600.0).exp()) + drift);
    }
    inputs.push(names::TEMPERATURE, temperature).unwrap();
    inputs.push(names::SUPPLY, (0..rows).map(|_| 5.0 + 5e-3 * draw.normal()).collect()).unwrap();
    inputs.push(names::GYRO_Z, vec![0.0; rows]).unwrap();
    let options = simulate::Options { vary_turn_on: true, ..seed.into() };
    stationary_like(&Config::parse(REST, "sim.toml").unwrap(), &inputs, &options, &Library::new()).unwrap()
}

/// Alarms among `logs` recordings, by what was alleged.
fn alarms(logs: u64, rows: usize) -> BTreeMap<String, u64> {
    let config = Config::parse(REST, "sim.toml").unwrap();
    let mut all = BTreeMap::new();
    for seed in 0..logs {
        let log = clean(9000 + seed, rows);
        let answer = diagnose(&config, &log, None, &Library::new(), &Options::default()).unwrap().answer;
        let alleged = match answer.verdict {
            Verdict::None | Verdict::CannotTell => continue,
            Verdict::Identified => answer.main.unwrap_or_default(),
            Verdict::Unknown => answer.free_forms.first().map_or_else(String::new, |f| f.id.clone()),
        };
        *all.entry(alleged).or_default() += 1;
    }
    all
}

fn most(logs: u64) -> u64 {
    let law = Binomial::new(RATE, logs).unwrap();
    (0..=logs).find(|k| law.cdf(*k) >= 1.0 - CHANCE).unwrap()
}

#[track_caller]
fn keeps_the_rate(logs: u64, rows: usize) {
    let found = alarms(logs, rows);
    let count: u64 = found.values().sum();
    println!("{count} false alarms in {logs} recordings of {rows} rows, at most {} expected: {found:?}", most(logs));
    assert!(count <= most(logs), "{count} of {logs}: {found:?}");
}

#[test]
fn clean_recordings_are_called_so() {
    keeps_the_rate(20, 2400);
}

#[test]
#[ignore = "battery: 200 recordings"]
fn battery_of_clean_recordings() {
    keeps_the_rate(crate::cases::cases(200), 4800);
}
