//! Encoders that count ticks: the noise of their speeds, and the filter that reads them.

use gyroid::ErrorKind;
use gyroid::config::Config;
use gyroid::navigate::{Settings, Summary, WheelModel, dead_reckoning, run};
use gyroid::signal::{Log, TimeAxis, names};
use gyroid::simulate::{Course, Drive, Options, drive, replay, truth_names};
use gyroid::vehicle::{Motion, Rolling};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::TAU;

/// Torque noise that moves a wheel by most of a tick within a step, so that rounding errors are independent.
const TEXT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
    [gyro]\nc1_rad_s = -2.4e-3\nc2_rad_s = 8e-3\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
    turn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.03\n\
    [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
    wheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.02\n\
    [encoder]\nspeed_noise_std_rad_s = 0.0\nticks_per_revolution = 4096\n\
    [pose]\nrate_hz = 5.0\nposition_std_m = 0.002\nheading_std_rad = 0.002\n";

const TICK: f64 = TAU / 4096.0;
const RUNS: u64 = 40;

fn config() -> Config {
    Config::parse(TEXT, "robot.toml").unwrap()
}

/// Little torque noise: a wheel's speed walks by 4e-3 rad/s in a step, a fifteenth of what its ticks are off, so that the
/// readings' variance is that of their ticks to 0.3 %, also over two steps.
fn calm() -> Config {
    let mut config = config();
    config.vehicle.as_mut().unwrap().torque_noise_n_m_sqrt_s = 0.0004;
    config
}

fn recorded(config: &Config, duration_s: f64, seed: u64) -> Drive {
    let options = Options { since_power_on_s: 20.0, vary_turn_on: true, ..Options::from(seed) };
    drive(config, Course::Random, duration_s, &options).unwrap()
}

fn over_runs<T: Send>(of: impl Fn(u64) -> T + Sync + Send) -> Vec<T> {
    (0..RUNS).into_par_iter().map(of).collect()
}

/// True wheel speeds at each row.
fn wheels(config: &Config, truth: &Log) -> Vec<[f64; 2]> {
    let robot = Rolling::new(config.vehicle.as_ref().unwrap());
    let [speed, yaw] = [truth_names::SPEED, truth_names::YAW_RATE].map(|n| truth.get(n).unwrap());
    let at =
        |(v, w): (&f64, &f64)| robot.wheel_speeds(&Motion { speed_m_s: *v, yaw_rate_rad_s: *w, ..Motion::default() });
    speed.iter().zip(yaw).map(at).collect()
}

#[test]
fn counts_are_the_wheels_true_angles_in_whole_ticks() {
    let config = config();
    let Drive { log, truth, .. } = recorded(&config, 60.0, 1);
    let speeds = wheels(&config, &truth);
    for (side, name) in [names::WHEEL_LEFT_TICKS, names::WHEEL_RIGHT_TICKS].into_iter().enumerate() {
        let counts = log.get(name).unwrap();
        assert_eq!(counts[0], 0.0);
        let (mut angle, mut range) = (0.0, [f64::INFINITY, f64::NEG_INFINITY]);
        for k in 0..log.len() {
            if k > 0 {
                // the trapezium errs by λ a h³/12 a row, λ below 0.2 1/s, a below 100 rad/s²: 1e-6 rad over 6000 rows, at
                // most 0.01 ticks
                angle += 0.005 * (speeds[k][side] + speeds[k - 1][side]);
            }
            assert_eq!(counts[k], counts[k].round());
            let rest = angle / TICK - counts[k];
            range = [f64::min(range[0], rest), f64::max(range[1], rest)];
        }
        // floor(angle + phase) leaves a rest between -phase and 1 - phase
        assert!(range[1] - range[0] < 1.0 + 0.02 && range[1] - range[0] > 0.9, "{name}: {range:?}");
    }
}

#[test]
fn the_noise_of_a_tick_speed_is_as_derived_and_anticorrelated() {
    for noise in [0.0, 0.08] {
        let mut config = config();
        config.encoder.as_mut().unwrap().speed_noise_std_rad_s = noise;
        let sums = over_runs(|seed| {
            let Drive { log, truth, .. } = recorded(&config, 60.0, seed);
            let speeds = wheels(&config, &truth);
            let mut sums = [0.0; 3];
            for (side, name) in [names::WHEEL_LEFT, names::WHEEL_RIGHT].into_iter().enumerate() {
                let read = log.get(name).unwrap();
                assert!(read[0].is_nan());
                let error = |k: usize| read[k] - 0.5 * (speeds[k][side] + speeds[k - 1][side]);
                for k in 2..log.len() {
                    sums[0] += error(k) * error(k);
                    sums[1] += error(k) * error(k - 1);
                    sums[2] += 1.0;
                }
            }
            sums
        });
        let total = |i: usize| sums.iter().map(|s| s[i]).sum::<f64>();
        let n = total(2);
        let ticks = TICK * TICK / 6.0 / 0.01f64.powi(2);
        let expected = noise * noise + ticks;
        let encoder = config.encoder.unwrap();
        assert!((encoder.speed_variance_rad2_s2(0.01) / expected - 1.0).abs() < 1e-12);
        // squares of a difference of two uniform errors: relative variance 1.4, covariance with either neighbour 0.2;
        // normal ones: 2. Five standard errors of the mean
        let bound = 5.0 * (2.0 / n).sqrt();
        assert!((total(0) / n / expected - 1.0).abs() < bound, "{} {expected}", total(0) / n);
        // neighbours share a count: covariance -tick²/(12 Ts²)
        let lag = total(1) / n / expected;
        assert!((lag + 0.5 * ticks / expected).abs() < bound, "{lag}");
    }
}

/// Mean NIS of both wheels, and the number of their readings.
fn wheel_nis(summaries: &[Summary]) -> (f64, f64) {
    let wheels = summaries.iter().flat_map(|s| &s.consistency.sensors[1..3]);
    let [nis, readings] =
        wheels.fold([0.0; 2], |[nis, n], s| [nis + s.nis_mean * s.readings as f64, n + s.readings as f64]);
    (nis / readings, readings)
}

/// Part of the readings over which a wheel turned by less than two ticks: their rounding errors are smaller than uniform
/// ones.
fn slow_share(log: &Log) -> f64 {
    let sides = [names::WHEEL_LEFT_TICKS, names::WHEEL_RIGHT_TICKS].map(|n| log.get(n).unwrap());
    let counted = sides.map(|counts| counts.iter().copied().filter(|n| n.is_finite()).collect::<Vec<_>>());
    let steps = || counted.iter().flat_map(|counts| counts.windows(2).map(|n| (n[1] - n[0]).abs()));
    steps().filter(|step| *step < 2.0).count() as f64 / steps().count() as f64
}

/// White-noise filter on anticorrelated noise: a mean NIS between 1 and 4 - 2√2 (see the filter's page), to five standard
/// errors and the 0.3 % of [`calm`], and less by at most the slow readings; the heading known at least as well as claimed.
fn assert_consistent(outcomes: &[(Summary, f64)], lowest: f64) {
    let summaries: Vec<_> = outcomes.iter().map(|o| o.0.clone()).collect();
    let slow = outcomes.iter().map(|o| o.1).sum::<f64>() / RUNS as f64;
    let lowest = lowest * (1.0 - slow);
    let (mean, readings) = wheel_nis(&summaries);
    let bound = 5.0 * (2.0 / readings).sqrt() + 0.003;
    assert!(mean > lowest - bound && mean < 4.0 - 8f64.sqrt() + bound, "{mean}");
    let nees: f64 = summaries.iter().filter_map(|s| s.reference.as_ref()?.heading_nees_end).sum();
    let limit = ChiSquared::new(RUNS as f64).unwrap().inverse_cdf(1.0 - 1e-6);
    println!(
        "slow readings {slow:.3}; NIS of the wheels {mean:.3}, NEES of the heading at the end {:.2}",
        nees / RUNS as f64
    );
    assert!(nees < limit, "{nees} {limit}");
}

#[test]
fn the_filter_reads_tick_speeds_consistently() {
    // torques that are held over a step walk half as far by its middle as the filter's white ones: NIS is then below 1
    for (config, lowest) in [(calm(), 1.0), (config(), 0.25)] {
        let outcomes = over_runs(|seed| {
            let log = recorded(&config, 60.0, seed).log;
            (run(&config, &log, &Settings::default()).unwrap().summary, slow_share(&log))
        });
        assert_consistent(&outcomes, lowest);
    }
}

#[test]
fn a_mean_over_a_step_is_taken_in_in_its_middle() {
    // half a minute of steady acceleration, 4 rad/s² of the wheels: half a step behind is 0.02 rad/s, a third of the noise
    let mut config = config();
    config.vehicle.as_mut().unwrap().torque_noise_n_m_sqrt_s = 0.002;
    let means = over_runs(|seed| {
        let len = 1001;
        let mut inputs = Log::new("inputs", TimeAxis::Uniform { start_s: 0.0, step_s: 0.01, len });
        inputs.push(names::TORQUE_LEFT, vec![0.05; len]).unwrap();
        inputs.push(names::TORQUE_RIGHT, vec![0.05; len]).unwrap();
        let options = Options { since_power_on_s: 20.0, vary_turn_on: true, ..Options::from(seed) };
        let log = replay(&config, &inputs, &options).unwrap().log;
        let speed = run(&config, &log, &Settings::default()).unwrap().pose;
        let truth = replay(&config, &inputs, &options).unwrap().truth;
        let error = |k: usize| speed.get("speed_m_s").unwrap()[k] - truth.get("speed_m_s").unwrap()[k];
        (500..len).map(error).sum::<f64>() / (len - 500) as f64
    });
    let n = RUNS as f64;
    let mean = means.iter().sum::<f64>() / n;
    let std_error = (means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt();
    let behind = 0.5 * 0.01 * 0.2;
    assert!(mean.abs() < 5.0 * std_error && std_error < 0.1 * behind, "{mean} ± {std_error}, behind {behind}");
}

/// A drive at uneven times whose speeds are taken out, and every third count.
fn bare(config: &Config, seed: u64) -> Log {
    let mut stream = gyroid::math::random::Stream::new(seed, 901);
    let mut t = 0.0;
    let times: Vec<f64> = (0..6000)
        .map(|_| {
            t += 0.004 + 0.012 * stream.uniform();
            t
        })
        .collect();
    let torques = |phase: f64| times.iter().map(|t| 0.05 * (0.3 * t + phase).sin()).collect::<Vec<_>>();
    let mut inputs = Log::new("inputs", TimeAxis::Explicit(times.clone()));
    inputs.push(names::TORQUE_LEFT, torques(0.0)).unwrap();
    inputs.push(names::TORQUE_RIGHT, torques(0.4)).unwrap();
    let options = Options { since_power_on_s: 20.0, vary_turn_on: true, ..Options::from(seed) };
    let mut log = replay(config, &inputs, &options).unwrap().log;
    log.channels.retain(|c| c.name != names::WHEEL_LEFT && c.name != names::WHEEL_RIGHT);
    for channel in log.channels.iter_mut().filter(|c| c.name.ends_with("ticks")) {
        (0..6000).filter(|k| k % 3 == 1).for_each(|k| channel.values[k] = f64::NAN);
    }
    log
}

#[test]
fn a_log_of_ticks_alone_gets_its_speeds_from_them() {
    let config = calm();
    let outcomes = over_runs(|seed| {
        let log = bare(&config, seed);
        (run(&config, &log, &Settings::default()).unwrap().summary, slow_share(&log))
    });
    let readings: u64 = outcomes.iter().flat_map(|(s, _)| &s.consistency.sensors[1..3]).map(|s| s.readings).sum();
    assert_eq!(readings, RUNS * 2 * 3999);
    assert_consistent(&outcomes, 1.0);
}

#[test]
fn rounding_does_not_add_up_in_dead_reckoning() {
    let config = config();
    for seed in 0..5 {
        let Drive { log, truth, .. } = recorded(&config, 120.0, seed);
        let m = dead_reckoning(&config, &log, &Settings::default()).unwrap().motion;
        // the heading is that of the counts, less than a tick off on each side
        let heading = truth.get(names::HEADING).unwrap();
        for (m, heading) in m.iter().zip(heading) {
            assert!((m.heading_rad - heading).abs() < 2.0 * TICK * 0.05 / 0.34 + 1e-9, "{}", m.heading_rad - heading);
        }
    }
}

#[test]
fn wheels_that_slip_are_read_by_their_ticks_too() {
    let mut config = calm();
    let study = include_str!("../../data/study.toml");
    config.traction = Config::parse(study, "study.toml").unwrap().traction;
    let outcomes = over_runs(|seed| {
        let log = recorded(&config, 30.0, seed).log;
        let summary =
            run(&config, &log, &Settings { wheels: WheelModel::Slip, ..Settings::default() }).unwrap().summary;
        assert!(summary.slip_modelled);
        (summary, slow_share(&log))
    });
    // torques that are held over a step walk half as far by its middle as the filter's white ones
    assert_consistent(&outcomes, 0.25);
}

#[test]
fn ticks_without_their_number_in_a_turn_are_named() {
    let mut config = config();
    let log = bare(&config, 1);
    config.encoder.as_mut().unwrap().ticks_per_revolution = None;
    let error = run(&config, &log, &Settings::default()).unwrap_err();
    assert_eq!(error.kind, ErrorKind::Config);
    assert!(error.to_string().contains("encoder.ticks_per_revolution"), "{error}");
}
