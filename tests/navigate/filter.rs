//! Simulated drives through the navigation filter: what the error model is worth, and whether the filter knows how
//! good it is. Bounds come from chi-squared and binomial distributions, at five standard deviations or one in a million.

use gyroid::ErrorKind;
use gyroid::config::{Config, Covariance, Noise, Validation};
use gyroid::math::random::Stream;
use gyroid::navigate::{ErrorModel, ReferenceErrors, Settings, Standstill, Summary, dead_reckoning, run};
use gyroid::signal::{Log, TimeAxis, names};
use gyroid::simulate::{Course, Drive, Options, drive, replay};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

const TEXT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
    [gyro]\nc1_rad_s = -2.4e-3\nc2_rad_s = 8e-3\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
    turn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.03\n\
    [gyro.noise]\nrate_random_walk_rad_s_sqrt_s = 2e-6\n\
    [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
    wheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.0004\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n\
    [pose]\nrate_hz = 5.0\nposition_std_m = 0.002\nheading_std_rad = 0.002\n";

const PLAIN: Settings = Settings {
    wheels: gyroid::navigate::WheelModel::Auto,
    error_model: ErrorModel::WarmUp,
    use_pose: false,
    start_at_reference: false,
    align_share: None,
    gate_probability: None,
    since_power_on_s: 0.0,
    acceleration_densities: None,
    off_time_s: None,
    standstill: Some(Standstill::EXACT),
    smooth: false,
    innovations: false,
};
const OFF: Settings = Settings { error_model: ErrorModel::Off, ..PLAIN };
const RUNS: u64 = 60;

fn config() -> Config {
    Config::parse(TEXT, "robot.toml").unwrap()
}

/// A drive of a gyro that was powered on anew, 20 s after power-on.
fn recorded(config: &Config, course: Course, duration_s: f64, seed: u64) -> Drive {
    let options = Options { since_power_on_s: 20.0, vary_turn_on: true, ..Options::from(seed) };
    drive(config, course, duration_s, &options).unwrap()
}

fn over_runs<T: Send>(of: impl Fn(u64) -> T + Sync + Send) -> Vec<T> {
    (0..RUNS).into_par_iter().map(of).collect()
}

/// Fails if a sum of chi-squared variables lies where it does once in a million times.
fn assert_chi_squared(sum: f64, degrees: f64, what: &str) {
    let chi = ChiSquared::new(degrees).unwrap();
    let [low, high] = [chi.inverse_cdf(5e-7), chi.inverse_cdf(1.0 - 5e-7)];
    assert!(sum > low && sum < high, "{what}: {sum} outside {low} .. {high} for {degrees} degrees of freedom");
}

/// Fails if fewer runs than five binomial standard deviations below 95 % are inside.
fn assert_share95(inside: &[bool], what: &str) {
    let n = inside.len() as f64;
    let count = inside.iter().filter(|i| **i).count() as f64;
    assert!(count >= 0.95 * n - 5.0 * (n * 0.95 * 0.05).sqrt(), "{what}: {count} of {n} inside");
}

/// Root mean square of the heading error at the end over all runs: with model, without, and by encoders alone.
fn heading_rms_rad(config: &Config, vary_turn_on: bool) -> [f64; 3] {
    let errors = over_runs(|seed| {
        let options = Options { since_power_on_s: 20.0, vary_turn_on, ..Options::from(seed) };
        let log = drive(config, Course::Square, 180.0, &options).unwrap().log;
        let end = |settings| run(config, &log, settings).unwrap().summary.reference.unwrap().heading_end_rad.unwrap();
        let encoders = dead_reckoning(config, &log, &PLAIN).unwrap().reference.unwrap().heading_end_rad.unwrap();
        [end(&PLAIN), end(&OFF), encoders]
    });
    std::array::from_fn(|i| (errors.iter().map(|e| e[i] * e[i]).sum::<f64>() / RUNS as f64).sqrt())
}

#[test]
fn a_model_that_varies_from_turn_on_to_turn_on_is_worth_its_while() {
    // unmodelled, 7 mrad/s for 180 s are 1.3 rad, of which the encoders take a part back
    let [with, without, _] = heading_rms_rad(&config(), true);
    assert!(with < 0.1 * without, "{with} {without}");
}

#[test]
fn a_model_of_this_very_turn_on_also_beats_the_encoders() {
    let mut config = config();
    let gyro = config.gyro.as_mut().unwrap();
    (gyro.turn_on_bias_std_rad_s, gyro.warm_up_relative_std, gyro.noise) = (None, None, None);
    let [s1, s2, st] = [1e-5, 1e-5, 1.0];
    gyro.covariance = Some(Covariance::from_matrix(&[[s1 * s1, 0.0, 0.0], [0.0, s2 * s2, 0.0], [0.0, 0.0, st * st]]));
    let [with, without, encoders] = heading_rms_rad(&config, false);
    assert!(with < 0.1 * without, "{with} {without}");
    // random walks over 180 s, each beside the reference's 2 mrad: encoders 0.02 r/(√2 b) √(0.01 · 180) = 5.6 mrad; the
    // gyro 2 mrad and the fit's 1e-5 rad/s 1.8 mrad. An rms of 60 runs is good to 9 %: three tenths are kept as margin
    let pose = 2e-3f64;
    let by_encoders = (0.02 * 0.05 / (2f64.sqrt() * 0.17) * 1.8f64.sqrt()).hypot(pose);
    let by_gyro = (1.5e-4 * 180f64.sqrt()).hypot(1e-5 * 180.0).hypot(pose);
    assert!(with < 1.3 * by_gyro, "{with} {by_gyro}");
    assert!((encoders / by_encoders - 1.0).abs() < 0.3, "{encoders} {by_encoders}");
    assert!(with < encoders, "{with} {encoders}");
}

#[test]
fn the_filter_is_consistent() {
    let config = config();
    for course in [Course::Square, Course::FigureEight, Course::Random] {
        let summaries = over_runs(|seed| {
            let log = recorded(&config, course, 60.0, seed).log;
            run(&config, &log, &PLAIN).unwrap().summary
        });
        let name = course.name();
        let inside: Vec<_> = summaries.iter().map(|s| s.consistency.nis_holds).collect();
        assert_share95(&inside, &format!("{name}: NIS"));
        let unbiased: Vec<_> = summaries.iter().map(|s| s.consistency.unbiased).collect();
        assert_share95(&unbiased, &format!("{name}: mean of innovations"));
        let white: Vec<_> = summaries.iter().map(|s| s.consistency.white).collect();
        assert_share95(&white, &format!("{name}: whiteness of innovations"));
        for (at, sensor) in ["gyro", "wheel_left", "wheel_right"].iter().enumerate() {
            let sensors = summaries.iter().map(|s| &s.consistency.sensors[at]);
            let [nis, readings] = sensors.fold([0.0; 2], |[nis, n], s| {
                assert_eq!(s.sensor, *sensor);
                [nis + s.nis_mean * s.readings as f64, n + s.readings as f64]
            });
            // normal limit of chi-squared: variance two a reading
            assert!((nis / readings - 1.0).abs() < 5.0 * (2.0 / readings).sqrt(), "{name}: NIS of {sensor}");
        }
        let rows: f64 = summaries.iter().map(|s| s.rows as f64).sum();
        let inside_rows = summaries.iter().map(|s| s.consistency.rows_inside95 * s.rows as f64).sum::<f64>() / rows;
        assert!((inside_rows - 0.95).abs() < 5.0 * (0.95 * 0.05 / rows).sqrt(), "{name}: {inside_rows}");

        let of = |pick: fn(&ReferenceErrors) -> Option<f64>| -> f64 {
            summaries.iter().filter_map(|s| pick(s.reference.as_ref()?)).sum()
        };
        assert_chi_squared(of(|r| r.heading_nees_end), RUNS as f64, &format!("{name}: NEES of heading"));
        assert_chi_squared(of(|r| r.nees_end), 3.0 * RUNS as f64, &format!("{name}: NEES of pose"));
    }
}

#[test]
fn the_gyro_error_is_known_as_well_as_claimed() {
    let config = config();
    let squares = over_runs(|seed| {
        let drive = recorded(&config, Course::Random, 60.0, seed);
        let end = run(&config, &drive.log, &PLAIN).unwrap().summary.final_pose.gyro_error_rad_s;
        let truth = *drive.truth.get("gyro_error_rad_s").unwrap().last().unwrap();
        ((end.estimate - truth) / end.std).powi(2)
    });
    assert_chi_squared(squares.iter().sum(), RUNS as f64, "gyro error");
}

#[test]
fn without_the_error_model_nis_says_so() {
    let config = config();
    let holds = over_runs(|seed| {
        let log = recorded(&config, Course::Square, 60.0, seed).log;
        run(&config, &log, &OFF).unwrap().summary.consistency.nis_holds
    });
    assert!(holds.iter().all(|h| !h));
}

/// A drive recorded at uneven times with a gap, encoders and pose at rates of their own.
fn uneven(config: &Config, seed: u64) -> Log {
    let mut stream = Stream::new(seed, 900);
    let mut t = 0.0;
    let times: Vec<f64> = (0..6000)
        .map(|k| {
            t += 0.002 + 0.016 * stream.uniform() + if k == 3000 { 0.8 } else { 0.0 };
            t
        })
        .collect();
    let torques = |phase: f64| times.iter().map(|t| 0.05 * (0.3 * t + phase).sin()).collect::<Vec<_>>();
    let mut inputs = Log::new("inputs", TimeAxis::Explicit(times.clone()));
    inputs.push(names::TORQUE_LEFT, torques(0.0)).unwrap();
    inputs.push(names::TORQUE_RIGHT, torques(0.4)).unwrap();
    let options = Options { since_power_on_s: 20.0, vary_turn_on: true, ..Options::from(seed) };
    let mut log = replay(config, &inputs, &options).unwrap().log;
    for channel in &mut log.channels {
        let every = match channel.name.as_str() {
            names::WHEEL_LEFT => 3,
            names::WHEEL_RIGHT => 2,
            _ => 1,
        };
        channel.values.iter_mut().enumerate().filter(|(k, _)| k % every != 0).for_each(|(_, v)| *v = f64::NAN);
    }
    log
}

#[test]
fn uneven_times_gaps_and_different_rates_keep_it_consistent() {
    let config = config();
    let summaries = over_runs(|seed| run(&config, &uneven(&config, seed), &PLAIN).unwrap().summary);
    let inside: Vec<_> = summaries.iter().map(|s| s.consistency.nis_holds).collect();
    assert_share95(&inside, "NIS");
    let nees: f64 = summaries.iter().filter_map(|s| s.reference.as_ref()?.heading_nees_end).sum();
    assert_chi_squared(nees, RUNS as f64, "NEES of heading");
}

#[test]
fn the_reference_pose_can_be_used() {
    let config = config();
    let settings = Settings { use_pose: true, ..PLAIN };
    let summaries = over_runs(|seed| {
        let log = recorded(&config, Course::Random, 60.0, seed).log;
        run(&config, &log, &settings).unwrap().summary
    });
    let inside: Vec<_> = summaries.iter().map(|s| s.consistency.nis_holds).collect();
    assert_share95(&inside, "NIS with pose");
    assert!(summaries.iter().all(|s| s.consistency.sensors.len() == 6));
    assert!(summaries.iter().all(|s| s.final_pose.x_m.std < 0.002));
}

#[test]
fn without_torques_white_accelerations_are_measured_and_consistent() {
    // a robot under torque noise alone has truly white accelerations, of a density that the configuration gives
    let mut config = config();
    let q = 0.02;
    let vehicle = config.vehicle.as_mut().unwrap();
    vehicle.torque_noise_n_m_sqrt_s = q;
    let (r, b) = (vehicle.wheel_radius_m, vehicle.half_track_m);
    let wheels = 2.0 * vehicle.wheel_inertia_kg_m2 / (r * r);
    let by_speed = 1.0 / (r * (vehicle.mass_kg + wheels));
    let by_yaw = b / (r * (vehicle.yaw_inertia_kg_m2 + wheels * b * b));
    let expected = [by_speed, by_yaw].map(|gain| 2.0 * gain * gain * q * q);

    let summaries = over_runs(|seed| {
        let mut inputs = Log::new("inputs", TimeAxis::Uniform { start_s: 0.0, step_s: 0.01, len: 6001 });
        inputs.push(names::TORQUE_LEFT, vec![0.0; 6001]).unwrap();
        inputs.push(names::TORQUE_RIGHT, vec![0.0; 6001]).unwrap();
        let options = Options { since_power_on_s: 20.0, vary_turn_on: true, ..Options::from(seed) };
        let mut log = replay(&config, &inputs, &options).unwrap().log;
        log.channels.retain(|c| !c.name.starts_with("torque"));
        run(&config, &log, &PLAIN).unwrap().summary
    });
    assert!(summaries.iter().all(|s| !s.torques_used));
    for (i, expected) in expected.into_iter().enumerate() {
        let mean = summaries.iter().filter_map(|s| Some(s.acceleration_densities?[i])).sum::<f64>() / RUNS as f64;
        // 60 runs of 300 independent lags of 0.2 s: five standard errors are 5 sqrt(2/18000) = 5 %; friction, which
        // the white model lacks, takes less than a twentieth of the speed in a lag
        assert!((mean / expected - 1.0).abs() < 0.05 + 0.05, "{i}: {mean} {expected}");
    }
    let mean = summaries.iter().map(|s| s.consistency.nis_mean).sum::<f64>() / RUNS as f64;
    // the density of one run is known to sqrt(2/300) = 8 %, and NIS follows it at most in proportion
    assert!((mean - 1.0).abs() < 0.08, "{mean}");
}

#[test]
fn on_a_course_without_torques_the_model_still_helps() {
    let config = config();
    for [with, without] in over_runs(|seed| {
        let mut log = recorded(&config, Course::Square, 120.0, seed).log;
        log.channels.retain(|c| !c.name.starts_with("torque"));
        [&PLAIN, &OFF].map(|s| run(&config, &log, s).unwrap().summary.reference.unwrap().heading_rms_rad.unwrap())
    }) {
        assert!(with < 0.2 * without, "{with} {without}");
    }
}

#[test]
fn torques_missing_in_some_rows_are_bridged() {
    let config = config();
    let mut log = recorded(&config, Course::Square, 60.0, 3).log;
    let whole = run(&config, &log, &PLAIN).unwrap().summary;
    assert!(whole.acceleration_densities.is_none());
    for channel in log.channels.iter_mut().filter(|c| c.name == names::TORQUE_LEFT) {
        channel.values[1000..1100].fill(f64::NAN);
    }
    let bridged = run(&config, &log, &PLAIN).unwrap().summary;
    assert!(bridged.torques_used && bridged.acceleration_densities.is_some());
    let end = |s: &Summary| s.final_pose.heading_rad;
    assert!((end(&whole).estimate - end(&bridged).estimate).abs() < 5.0 * end(&bridged).std);
}

#[test]
fn the_gate_keeps_outliers_out() {
    let config = config();
    let mut log = recorded(&config, Course::Square, 60.0, 3).log;
    let hits = [500, 1500, 2500, 3500];
    for channel in log.channels.iter_mut().filter(|c| c.name == names::GYRO_Z) {
        hits.iter().for_each(|k| channel.values[*k] += 3.0);
    }
    let gate = Settings { gate_probability: Some(1.0 - 1e-9), ..PLAIN };
    let [open, gated] = [&PLAIN, &gate].map(|s| run(&config, &log, s).unwrap().summary);
    assert_eq!(gated.consistency.gated, hits.len() as u64);
    assert!(!open.consistency.nis_holds);
    let heading = |s: &Summary| s.reference.as_ref().unwrap().heading_rms_rad.unwrap();
    assert!(heading(&gated) < heading(&open));
}

#[test]
fn same_seed_same_bytes() {
    let config = config();
    let bits = |seed| {
        let pose = run(&config, &recorded(&config, Course::Random, 10.0, seed).log, &PLAIN).unwrap().pose;
        pose.channels.iter().flat_map(|c| c.values.iter().map(|v| v.to_bits())).collect::<Vec<_>>()
    };
    assert_eq!(bits(1), bits(1));
    assert_ne!(bits(1), bits(2));
}

#[test]
fn time_since_power_on_is_assumed_where_it_is_missing_and_said() {
    let config = config();
    let log = recorded(&config, Course::Square, 60.0, 3).log;
    let mut bare = log.clone();
    bare.channels.retain(|c| c.name != names::SINCE_POWER_ON);
    let known = run(&config, &log, &PLAIN).unwrap();
    assert!(!known.summary.since_power_on_assumed && known.summary.notes.is_empty());
    let told = run(&config, &bare, &Settings { since_power_on_s: 20.0, ..PLAIN }).unwrap();
    assert!(told.summary.notes.iter().any(|n| n.contains("20 s after power-on")), "{:?}", told.summary.notes);
    assert_eq!(told.summary.final_pose, known.summary.final_pose);
}

#[test]
fn a_drive_beyond_the_span_of_the_fit_is_noted() {
    let mut config = config();
    let log = recorded(&config, Course::Square, 10.0, 3).log;
    for (valid_to_s, noted) in [(30.0, false), (29.0, true)] {
        config.validation = Some(Validation {
            white: true,
            identifiable: true,
            accepted_by_user: false,
            joint_p_value: 0.5,
            level: 0.05,
            averaging_times_s: vec![1.0],
            samples: 1000,
            sample_rate_hz: 10.0,
            valid_from_s: 0.0,
            valid_to_s,
            valid_from_temperature_c: None,
            valid_to_temperature_c: None,
            time_constant_ci95_s: [200.0, 300.0],
        });
        let notes = run(&config, &log, &PLAIN).unwrap().summary.notes;
        assert_eq!(notes.iter().any(|n| n.contains("extrapolates")), noted, "{valid_to_s}: {notes:?}");
    }
}

#[test]
fn a_reference_that_begins_elsewhere_is_noticed() {
    let config = config();
    let mut log = recorded(&config, Course::Square, 30.0, 3).log;
    for (name, shift) in [(names::X, 3.0), (names::Y, -1.0), (names::HEADING, 0.0)] {
        let channel = log.channels.iter_mut().find(|c| c.name == name).unwrap();
        channel.values.iter_mut().for_each(|v| *v += shift);
    }
    let apart = run(&config, &log, &PLAIN).unwrap().summary;
    assert!(apart.notes.iter().any(|n| n.contains("--start-at-reference")), "{:?}", apart.notes);
    let there = run(&config, &log, &Settings { start_at_reference: true, ..PLAIN }).unwrap().summary;
    let errors = there.reference.unwrap();
    assert!(errors.position_rms_m < 0.1 && apart.reference.unwrap().position_rms_m > 3.0);
    assert_chi_squared(errors.nees_end.unwrap(), 3.0, "NEES of pose");
}

#[test]
fn bad_inputs_are_named() {
    let config = config();
    let good = recorded(&config, Course::Square, 2.0, 1).log;
    let refused = |change: &dyn Fn(&mut Config, &mut Log), kind: ErrorKind, part: &str| {
        let (mut c, mut l) = (config.clone(), good.clone());
        change(&mut c, &mut l);
        let settings = Settings { use_pose: true, ..PLAIN };
        let error = run(&c, &l, &settings).unwrap_err();
        assert_eq!(error.kind, kind, "{error}");
        assert!(error.to_string().contains(part), "{error} lacks {part}");
    };
    let lose = |l: &mut Log, name: &str| l.channels.retain(|c| c.name != name);
    let speed_alone = |l: &mut Log| {
        [names::WHEEL_LEFT, names::WHEEL_RIGHT, names::GYRO_Z].iter().for_each(|n| lose(l, n));
        l.push(names::ODO_SPEED, vec![1.0; l.len()]).unwrap();
    };
    refused(&|_, l| speed_alone(l), ErrorKind::Column, "gyro_z_rad_s");
    refused(&|_, l| lose(l, names::WHEEL_RIGHT), ErrorKind::Column, "wheel_right_rad_s");
    refused(&|_, l| lose(l, names::HEADING), ErrorKind::Column, "heading_rad");
    refused(&|c, _| c.vehicle = None, ErrorKind::Config, "[vehicle]");
    refused(&|c, _| c.encoder = None, ErrorKind::Config, "[encoder]");
    refused(&|c, _| c.gyro = None, ErrorKind::Config, "[gyro]");
    refused(&|c, _| c.pose = None, ErrorKind::Config, "[pose]");
    let effect = gyroid::config::EffectTable { id: "wheel.slip".into(), parameters: [].into() };
    refused(&|c, _| c.effects = vec![effect.clone()], ErrorKind::Config, "wheel.slip");
    let stuck = |l: &mut Log| {
        let mut t = l.time.to_vec();
        t[7] = t[6];
        l.time = TimeAxis::Explicit(t);
    };
    refused(&|_, l| stuck(l), ErrorKind::Time, "row 8");
    let fill = |l: &mut Log, value: f64| l.channels.iter_mut().skip(1).for_each(|c| c.values.fill(value));
    refused(&|_, l| fill(l, f64::NAN), ErrorKind::Value, "wheel speeds");
    refused(&|_, l| fill(l, 1e300), ErrorKind::Numeric, "row");
    refused(&|_, l| *l = Log::new("empty.csv", TimeAxis::Explicit(vec![])), ErrorKind::TooShort, "empty.csv");
}

#[test]
fn a_lattice_is_allowed_for() {
    // with a step of ten standard deviations of the white noise, lsb²/12 is nearly all of the noise
    let mut config = config();
    let noise = Noise { quantization_lsb_rad_s: Some(0.015), ..Default::default() };
    config.gyro.as_mut().unwrap().noise = Some(noise);
    let means = over_runs(|seed| {
        let log = recorded(&config, Course::Random, 60.0, seed).log;
        run(&config, &log, &PLAIN).unwrap().summary.consistency.sensors[0].nis_mean
    });
    let mean = means.iter().sum::<f64>() / RUNS as f64;
    // the rounding errors of a moving robot are independent from row to row only in part, so a tenth is allowed
    assert!((mean - 1.0).abs() < 0.1, "{mean}");
}
