//! Drives whose torques were not logged, with hard starts and stops between long even stretches: intervals hold the truth.

use crate::cases::cases;
use crate::robots::driving;
use gyroid::config::{Config, EffectTable};
use gyroid::effects::Library;
use gyroid::gap::explain;
use gyroid::math::random::Stream;
use gyroid::signal::{Log, TimeAxis, names};
use gyroid::simulate::{Options, replay_with};

const STEP_S: f64 = 0.02;
/// Of a circle, m/s and m; up to speed and down again within a second and a half.
const SPEED_M_S: f64 = 0.45;
const RADIUS_M: f64 = 0.6;
const RAMP_S: f64 = 1.5;
const HOLD_S: f64 = 7.0;
const STAND_S: f64 = 1.5;
const CIRCLES: usize = 4;

/// Wheel speeds of circles to either side in turns, of the robot as it is believed to be.
fn circles(config: &Config) -> Log {
    let vehicle = config.vehicle.unwrap();
    let lap_s = 2.0 * RAMP_S + HOLD_S + STAND_S;
    let len = (CIRCLES as f64 * lap_s / STEP_S) as usize;
    let mut wheels = [Vec::new(), Vec::new()];
    for k in 0..len {
        let t_s = STEP_S * k as f64;
        let (lap, within) = ((t_s / lap_s) as usize, t_s % lap_s);
        let share = (within / RAMP_S).min((2.0 * RAMP_S + HOLD_S - within) / RAMP_S).clamp(0.0, 1.0);
        let turn = vehicle.half_track_m / RADIUS_M * if lap.is_multiple_of(2) { 1.0 } else { -1.0 };
        for (wheel, side) in wheels.iter_mut().zip([-1.0, 1.0]) {
            wheel.push(share * SPEED_M_S * (1.0 + side * turn) / vehicle.wheel_radius_m);
        }
    }
    let mut log = Log::new("circles", TimeAxis::Uniform { start_s: 0.0, step_s: STEP_S, len });
    let [left, right] = wheels;
    log.push(names::WHEEL_LEFT, left).unwrap();
    log.push(names::WHEEL_RIGHT, right).unwrap();
    for name in [names::GYRO_Z, names::X, names::Y, names::HEADING] {
        log.push(name, vec![0.0; len]).unwrap();
    }
    log
}

/// (estimate - truth)/std of the size `relative` of `id` in drives with it.
fn deviations(id: &str, draws: u64) -> Vec<f64> {
    let config = Config::parse(&driving(50.0, 0.005), "robot.toml").unwrap();
    let inputs = circles(&config);
    (0..draws)
        .map(|seed| {
            let truth = 0.01 * (2.0 * Stream::new(seed, 5).uniform() - 1.0);
            let mut with = config.clone();
            with.effects.push(EffectTable { id: id.into(), parameters: [("relative".to_string(), truth)].into() });
            let mut log = replay_with(&with, &inputs, &Options::from(500 + seed), &Library::new()).unwrap().log;
            log.channels.retain(|c| inputs.get(&c.name).is_some());
            let told = explain(&config, &log, &Library::new(), &[id], 0.0).unwrap();
            assert!(!told.notes.iter().any(|n| n.contains("had not settled")), "{seed}: {:?}", told.notes);
            let size = &told.effects[0].parameters["relative"];
            println!("{id} {seed}: {:.5} ± {:.5}, true {truth:.5}", size.estimate, size.std);
            (size.estimate - truth) / size.std
        })
        .collect()
}

#[track_caller]
fn covers(id: &str, draws: u64) {
    let z = deviations(id, draws);
    let (n, mean) = (draws as f64, z.iter().sum::<f64>() / draws as f64);
    let square = z.iter().map(|z| z * z).sum::<f64>();
    // four standard deviations of the mean and of the sum of squares of standard normal numbers
    assert!(mean.abs() < 4.0 / n.sqrt(), "{id}: mean z {mean:.2} of {draws}");
    assert!(square < n + 4.0 * (2.0 * n).sqrt(), "{id}: mean square of z {:.2} of {draws}", square / n);
}

#[test]
#[ignore = "battery: some seconds"]
fn battery_intervals_hold_where_a_drive_starts_and_stops_hard() {
    for id in ["wheel.radius_scale", "vehicle.track_width", "gyro.scale_factor"] {
        covers(id, 4);
    }
}

#[test]
#[ignore = "battery: 100 drives of each of three effects"]
fn battery_of_intervals_where_a_drive_starts_and_stops_hard() {
    for id in ["wheel.radius_scale", "vehicle.track_width", "gyro.scale_factor"] {
        covers(id, cases(100));
    }
}
