//! References that are not where the robot is, and wheels that come late: what is a matter of the recording is taken out or
//! told, and what is a matter of the robot is still found. Bounds are five standard deviations of the estimates.

use crate::config::Config;
use crate::effects::drive::registry;
use crate::gap::drive::model_selection::{Judged, judge, mounting};
use crate::gap::drive::options::Options as JudgeOptions;
use crate::gap::drive::preprocess::reference_extrinsics::Mounting;
use crate::gap::drive::preprocess::wheel_offset::put_back;
use crate::gap::drive::record::Record;
use crate::gap::selection::sets::Main;
use crate::signal::{Log, names};
use crate::simulate::{Course, Options, drive};

const ROBOT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.02\n\
    [gyro]\nc1_rad_s = -2.4e-3\nc2_rad_s = 8e-3\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
    turn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.01\n\
    [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = RADIUS\n\
    wheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.002\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n\
    [pose]\nrate_hz = 5.0\nposition_std_m = 0.002\nheading_std_rad = 0.002\n";
/// How the reference may sit on the robot.
const OPEN: &str = "lever_arm_std_m = 0.1\nheading_offset_std_rad = 0.05\ndelay_std_s = 0.05\n";
/// How it does: m ahead, m to the left, rad to the left, s late (rows of 0.02 s).
const SITS: [f64; 4] = [0.06, -0.025, 0.02, 0.04];

fn robot(radius_m: f64, more: &str) -> Config {
    Config::parse(&(ROBOT.replace("RADIUS", &radius_m.to_string()) + more), "robot.toml").unwrap()
}

/// 120 s of a robot whose wheels are this large.
fn recorded(radius_m: f64, seed: u64) -> Log {
    let options = Options { since_power_on_s: 20.0, vary_turn_on: true, ..Options::from(seed) };
    drive(&robot(radius_m, ""), Course::Square, 120.0, &options).unwrap().log
}

fn column<'a>(log: &'a mut Log, name: &str) -> &'a mut Vec<f64> {
    &mut log.channels.iter_mut().find(|c| c.name == name).unwrap().values
}

fn without(mut log: Log, lost: &[&str]) -> Log {
    log.channels.retain(|c| !lost.contains(&c.name.as_str()));
    log
}

/// The same drive, tracked where and when the reference sits.
fn tracked_off(mut log: Log) -> Log {
    let [ahead, left, turned, late_s] = SITS;
    let heading = log.get(names::HEADING).unwrap().to_vec();
    for (name, part) in [(names::X, [1.0, 0.0]), (names::Y, [0.0, 1.0])] {
        for (value, heading) in column(&mut log, name).iter_mut().zip(&heading) {
            let (sin, cos) = heading.sin_cos();
            *value += part[0] * (ahead * cos - left * sin) + part[1] * (ahead * sin + left * cos);
        }
    }
    column(&mut log, names::HEADING).iter_mut().for_each(|h| *h += turned);
    let rows = (late_s / 0.02).round() as usize;
    for name in [names::X, names::Y, names::HEADING] {
        let values = column(&mut log, name);
        values.rotate_right(rows);
        values[..rows].fill(f64::NAN);
    }
    log
}

fn judged(record: &Record) -> Judged {
    judge(record, registry(), &JudgeOptions::default())
}

fn main_of(judged: &Judged) -> Main {
    judged.findings.top()
}

#[test]
#[ignore = "battery: some ten seconds and more"]
fn battery_a_reference_off_the_axle_is_taken_out_before_the_robot_is_judged() {
    // wheels two per cent larger than believed
    let log = tracked_off(recorded(0.051, 3));
    let open = Record::new(&robot(0.05, OPEN), &log, 20.0).unwrap();
    let found: Mounting = mounting(&open, registry(), &JudgeOptions::default()).unwrap();
    for ((offset, std), truth) in found.offset.iter().zip(found.std).zip(SITS) {
        assert!((offset - truth).abs() < 5.0 * std, "{found:?}, not {SITS:?}");
    }
    assert!(found.said().contains("mm ahead of the axle's middle"), "{}", found.said());
    let judged_then = judged(&found.taken_out(&open));
    assert_eq!(main_of(&judged_then), Main::Effect("wheel.radius_scale".into()));
    let set = judged_then.findings.best_with("wheel.radius_scale", true).unwrap();
    let part = set.part("wheel.radius_scale").unwrap();
    let (relative, std) = (part.parameters["relative"], part.std["relative"]);
    assert!((relative - 0.02).abs() < 5.0 * std, "{relative} ± {std}");

    // who believes the reference to sit on the axle is told of the radius, and of more beside it than that
    let closed = Record::new(&robot(0.05, ""), &log, 20.0).unwrap();
    assert_eq!(mounting(&closed, registry(), &JudgeOptions::default()), None);
    let misled = judged(&closed);
    assert_ne!(main_of(&misled), Main::None);
    assert!(misled.findings.sets[0].parts.len() > 1, "{:?}", misled.findings.sets[0]);
}

#[test]
fn a_reference_on_the_axle_is_found_there() {
    let record = Record::new(&robot(0.05, OPEN), &recorded(0.05, 4), 20.0).unwrap();
    let found = mounting(&record, registry(), &JudgeOptions::default()).unwrap();
    for (offset, std) in found.offset.iter().zip(found.std) {
        assert!(offset.abs() < 5.0 * std && std > 0.0, "{found:?}");
    }
    assert_eq!(main_of(&judged(&found.taken_out(&record))), Main::None);
}

#[test]
fn errors_that_last_leave_one_reading_in_their_time() {
    let log = recorded(0.05, 5);
    let count = |record: &Record| record.pose.as_ref().unwrap()[0].iter().filter(|v| v.is_finite()).count();
    let all = Record::new(&robot(0.05, ""), &log, 20.0).unwrap();
    let few = Record::new(&robot(0.05, "correlation_time_s = 2.0\n"), &log, 20.0).unwrap();
    assert_eq!((count(&all), count(&few)), (601, 61));
    assert!(few.notes.iter().any(|n| n.contains("correlation_time_s")), "{:?}", few.notes);
}

/// A drive of wheels and gyro alone, the wheels this many rows late.
fn wheels_late(rows: usize) -> Record {
    let lost = [names::TORQUE_LEFT, names::TORQUE_RIGHT, names::X, names::Y, names::HEADING];
    let mut log = without(recorded(0.05, 6), &lost);
    for name in [names::WHEEL_LEFT, names::WHEEL_RIGHT] {
        let values = column(&mut log, name);
        values.rotate_right(rows);
        values[..rows].fill(f64::NAN);
    }
    Record::new(&robot(0.05, ""), &log, 20.0).unwrap()
}

#[test]
#[ignore = "battery: some ten seconds and more"]
fn battery_wheels_that_come_late_are_told_with_their_delay() {
    let found = judged(&wheels_late(15));
    assert_eq!(main_of(&found), Main::Effect("sensor.wheel_delay".into()));
    let part = found.findings.sets[0].part("sensor.wheel_delay").unwrap();
    assert!((part.parameters["delay_s"] - 0.3).abs() < 0.01, "{part:?}");
    let delay_s = found.wheels_late_s.unwrap();
    assert!((delay_s - 0.3).abs() < 0.01, "{delay_s}");
    // and what is in time is not put back
    assert_eq!(judged(&wheels_late(0)).wheels_late_s, None);
}

#[test]
fn readings_put_back_are_the_same_readings() {
    let record = wheels_late(0);
    let moved = put_back(&record, 0.25);
    assert!(moved.times_s.windows(2).all(|t| t[1] > t[0]));
    let finite = |values: &[f64]| values.iter().copied().filter(|v| v.is_finite()).collect::<Vec<_>>();
    assert_eq!(finite(moved.gyro_rad_s.as_ref().unwrap()), finite(record.gyro_rad_s.as_ref().unwrap()));
    for (moved, wheel) in moved.wheels_rad_s.iter().zip(&record.wheels_rad_s) {
        let (moved, wheel) = (finite(moved), finite(wheel));
        // those from before the log began are gone
        assert_eq!(moved, wheel[wheel.len() - moved.len()..]);
        assert!((12..=13).contains(&(wheel.len() - moved.len())));
    }
}
