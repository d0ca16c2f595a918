//! Sensors that a drive may have or lack: odometry for wheels, one speed, no gyro, a reference without heading. Bounds
//! come from chi-squared and normal distributions, at one in a million or five standard deviations.

use crate::ROBOT;
use gyroid::ErrorKind;
use gyroid::config::Config;
use gyroid::ingest::read_log;
use gyroid::navigate::{Settings, Summary, dead_reckoning, gyro_reckoning, run};
use gyroid::signal::{Log, names};
use gyroid::simulate::{Course, Options, drive};
use gyroid::vehicle::Rolling;
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

const RUNS: u64 = 40;

fn config() -> Config {
    Config::parse(ROBOT, "robot.toml").unwrap()
}

fn recorded(seed: u64) -> Log {
    let options = Options { since_power_on_s: 20.0, vary_turn_on: true, ..Options::from(seed) };
    drive(&config(), Course::Square, 30.0, &options).unwrap().log
}

fn without(mut log: Log, lost: &[&str]) -> Log {
    log.channels.retain(|c| !lost.contains(&c.name.as_str()));
    log
}

/// Speed and yaw rate that an odometry makes of the wheels, in their place.
fn with_odometry(log: Log, yaw_rate: bool) -> Log {
    let robot = Rolling::new(config().require_vehicle().unwrap());
    let wheels = log.get(names::WHEEL_LEFT).unwrap().iter().zip(log.get(names::WHEEL_RIGHT).unwrap());
    let (v, w): (Vec<f64>, Vec<f64>) =
        wheels.map(|(l, r)| <(f64, f64)>::from(robot.speed_and_yaw_rate([*l, *r]))).unzip();
    let mut log = without(log, &[names::WHEEL_LEFT, names::WHEEL_RIGHT]);
    log.push(names::ODO_SPEED, v).unwrap();
    if yaw_rate {
        log.push(names::ODO_YAW_RATE, w).unwrap();
    }
    log
}

fn over_runs<T: Send>(of: impl Fn(Log) -> T + Sync + Send) -> Vec<T> {
    (1..=RUNS).into_par_iter().map(|seed| of(recorded(seed))).collect()
}

fn assert_chi_squared(sum: f64, degrees: f64, what: &str) {
    let chi = ChiSquared::new(degrees).unwrap();
    let [low, high] = [chi.inverse_cdf(5e-7), chi.inverse_cdf(1.0 - 5e-7)];
    assert!(sum > low && sum < high, "{what}: {sum} outside {low} .. {high} for {degrees} degrees of freedom");
}

fn summary(log: &Log, settings: &Settings) -> Summary {
    run(&config(), log, settings).unwrap().summary
}

#[test]
fn an_odometry_is_as_good_as_the_wheels_that_it_was_made_of() {
    let log = recorded(1);
    let [own, odometry] = [log.clone(), with_odometry(log, true)].map(|log| summary(&log, &Settings::default()));
    assert!(odometry.notes.iter().any(|n| n.contains("odometry")), "{:?}", odometry.notes);
    let ends =
        |s: &Summary| [s.final_pose.x_m, s.final_pose.y_m, s.final_pose.heading_rad, s.final_pose.gyro_error_rad_s];
    for (a, b) in ends(&own).iter().zip(ends(&odometry)) {
        // the conversion rounds 3000 rows of two wheels
        assert!((a.estimate - b.estimate).abs() < 1e-9 && (a.std - b.std).abs() < 1e-9, "{a:?} {b:?}");
    }
}

#[test]
fn one_speed_has_the_noise_of_two_wheels_mean() {
    let summaries = over_runs(|log| summary(&with_odometry(log, false), &Settings::default()));
    let mut nis = 0.0;
    let mut readings = 0.0;
    for s in &summaries {
        let sensors: Vec<_> = s.consistency.sensors.iter().map(|s| s.sensor).collect();
        assert_eq!(sensors, ["gyro", "speed"]);
        let speed = &s.consistency.sensors[1];
        nis += speed.nis_mean * speed.readings as f64;
        readings += speed.readings as f64;
    }
    // normal limit of chi-squared: variance two a reading
    assert!((nis / readings - 1.0).abs() < 5.0 * (2.0 / readings).sqrt(), "{}", nis / readings);
}

#[test]
fn without_a_gyro_the_wheels_lead_and_the_filter_knows_how_well() {
    let mut config = config();
    config.gyro = None;
    let nees = over_runs(|log| {
        let log = without(log, &[names::GYRO_Z]);
        let s = run(&config, &log, &Settings::default()).unwrap().summary;
        assert!(s.notes.iter().any(|n| n.contains("no gyro")));
        assert!(gyro_reckoning(&config, &log, &Settings::default()).is_err());
        s.reference.unwrap().heading_nees_end.unwrap()
    });
    assert_chi_squared(nees.iter().sum(), RUNS as f64, "heading by the wheels");
}

#[test]
fn positions_alone_are_judged_by_two_degrees_of_freedom() {
    let settings = Settings { align_share: Some(0.0), ..Settings::default() };
    let nees = over_runs(|log| {
        let errors = summary(&without(log, &[names::HEADING]), &settings).reference.unwrap();
        assert!(errors.heading_rms_rad.is_none() && errors.heading_nees_end.is_none());
        // Abramowitz and Stegun, table 26.8
        assert!((errors.nees_end_bounds95.unwrap()[1] - 7.378).abs() < 5e-4);
        errors.nees_end.unwrap()
    });
    assert_chi_squared(nees.iter().sum(), 2.0 * RUNS as f64, "NEES of the position");
}

#[test]
fn headings_in_some_rows_are_enough() {
    let mut log = recorded(3);
    let heading = log.channels.iter_mut().find(|c| c.name == names::HEADING).unwrap();
    let kept = heading.values.iter().filter(|h| h.is_finite()).count() / 2;
    let mut count = 0;
    heading.values.iter_mut().filter(|h| h.is_finite()).for_each(|h| {
        count += 1;
        *h = if count > kept { f64::NAN } else { *h };
    });
    let errors = summary(&log, &Settings::default()).reference.unwrap();
    assert!(errors.samples > kept as u64 && errors.heading_rms_rad.is_some() && errors.alignment.is_none());
}

#[test]
fn what_cannot_be_started_at_or_laid_on_is_refused() {
    let (config, log) = (config(), recorded(1));
    let start = Settings { start_at_reference: true, ..Settings::default() };
    let refused = |log: &Log, settings: &Settings, kind: ErrorKind, part: &str| {
        for error in [run(&config, log, settings).unwrap_err(), dead_reckoning(&config, log, settings).unwrap_err()] {
            assert!(error.kind == kind && error.to_string().contains(part), "{error}");
        }
    };
    refused(&without(log.clone(), &[names::HEADING]), &start, ErrorKind::Column, "no reference heading");
    refused(&without(log.clone(), &[names::X]), &start, ErrorKind::Column, "no reference pose");
    refused(&log, &Settings { align_share: Some(0.5), ..start }, ErrorKind::Usage, "--start-at-reference");
    for share in [-0.1, 1.1, f64::NAN] {
        refused(&log, &Settings { align_share: Some(share), ..Settings::default() }, ErrorKind::Usage, "share");
    }
    refused(&without(log, &[names::WHEEL_LEFT]), &Settings::default(), ErrorKind::Column, "wheel_left_rad_s");
}

#[test]
fn the_sensors_column_comes_before_a_yaw_rate() {
    let dir = tempfile::tempdir().unwrap();
    let channels = |header: &str| {
        let path = dir.path().join("log.csv");
        std::fs::write(&path, format!("{header}\n0,1,2\n0.1,1,2\n")).unwrap();
        read_log(&path).unwrap().channels.into_iter().map(|c| c.name).collect::<Vec<_>>()
    };
    assert_eq!(channels("t_s,yaw_rate_rad_s,gz_rad_s"), ["yaw_rate_rad_s", "gyro_z_rad_s"]);
    assert_eq!(channels("t_s,yaw_rate_rad_s,speed_m_s"), ["gyro_z_rad_s", "odo_speed_m_s"]);
    // what a filter put out
    assert_eq!(channels("t_s,yaw_rate_rad_s,yaw_rate_std_rad_s"), ["yaw_rate_rad_s", "yaw_rate_std_rad_s"]);
}
