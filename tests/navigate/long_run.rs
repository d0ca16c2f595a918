//! The filter over 1e8 steps, eleven and a half days at 100 Hz: it stays finite, positive definite and consistent.
//!
//! The truth is drawn from the filter's own model. Speeds and the gyro's error are linear in it, so the bounds of a Kalman
//! filter hold at any length. `cargo test --test navigate hundred_million -- --ignored --nocapture` prints the figures.

use crate::ROBOT;
use crate::cases::cases;
use gyroid::config::{Config, Noise};
use gyroid::math::random::Stream;
use gyroid::navigate::state::{GYRO_ERROR, LN_TIME_CONSTANT, SPEED, WARM_ERROR, YAW_RATE};
use gyroid::navigate::{Input, MotionModel, RollingFilter, Sensor, Settings};
use nalgebra::SVector;
use std::time::Instant;

const DT_S: f64 = 0.01;
const PART: u64 = 1_000_000;
/// rad/s/√s
const WALK: f64 = 2e-6;
const SENSORS: [Sensor; 3] = [Sensor::Gyro, Sensor::WheelLeft, Sensor::WheelRight];

#[test]
#[ignore = "battery: 1e8 steps"]
fn battery_of_a_hundred_million_steps() {
    let mut config = Config::parse(ROBOT, "robot.toml").unwrap();
    config.gyro.as_mut().unwrap().noise = Some(Noise { rate_random_walk_rad_s_sqrt_s: Some(WALK), ..Noise::default() });
    let (gyro, vehicle) = (config.gyro.clone().unwrap(), config.vehicle.unwrap());
    let gyro_std = gyro.angle_random_walk_rad_sqrt_s / DT_S.sqrt();
    let wheel_std = config.encoder.as_ref().unwrap().speed_noise_std_rad_s;
    let torque_std = vehicle.torque_noise_n_m_sqrt_s / DT_S.sqrt();
    let mut filter = RollingFilter::new(&config, &Settings::default(), 20.0).unwrap().0;
    let mut draw = Stream::new(24, 0);
    let scales: SVector<f64, 8> = SVector::from(*filter.factors().diagonal()).map(|d| d.sqrt() * draw.normal());
    let mut truth = filter.mean() + filter.factors().unit_upper() * scales;
    let decay = (-DT_S / truth[LN_TIME_CONSTANT].exp()).exp();

    let parts = cases(100);
    let (begin, mut nis, mut nees, mut settled) = (Instant::now(), 0.0, 0.0, None);
    for part in 0..parts {
        for k in 0..PART {
            let turn = truth[YAW_RATE];
            let wheel = |side: f64| (truth[SPEED] + side * vehicle.half_track_m * turn) / vehicle.wheel_radius_m;
            let exact = [turn + truth[GYRO_ERROR], wheel(-1.0), wheel(1.0)];
            for (i, sensor) in SENSORS.into_iter().enumerate() {
                let std = if i == 0 { gyro_std } else { wheel_std };
                nis += filter.update(sensor, exact[i] + std * draw.normal()).unwrap().nis();
            }
            let t_s = DT_S * (part * PART + k) as f64;
            let torques = [0.02 * (0.3 * t_s).sin() + 0.004, 0.02 * (0.3 * t_s + 0.2).sin() + 0.004];
            filter.predict(Input::Torques(torques), DT_S);
            let disturbances = [0.0; 2].map(|_: f64| torque_std * draw.normal());
            let walk = WALK * DT_S.sqrt() * draw.normal();
            truth = filter.model().disturbed(&truth, Input::Torques(torques), disturbances, DT_S);
            truth[GYRO_ERROR] = truth[WARM_ERROR] + decay * (truth[GYRO_ERROR] - truth[WARM_ERROR]) + walk;
            truth[WARM_ERROR] += walk;
        }
        // what the sensors tell, at instants so far apart that they are independent
        let known = [SPEED, YAW_RATE, GYRO_ERROR];
        let covariance = filter.covariance();
        let block = nalgebra::Matrix3::from_fn(|i, j| covariance[(known[i], known[j])]);
        let error = nalgebra::Vector3::from_fn(|i, _| filter.mean()[known[i]] - truth[known[i]]);
        nees += error.dot(&block.cholesky().expect("positive definite").solve(&error));
        assert!(filter.factors().diagonal().iter().all(|d| d.is_finite() && *d > 0.0), "after {} steps", part + 1);
        // the steady state of the Riccati equation
        let std = known.map(|i| filter.std()[i]);
        let first: &mut [f64; 3] = settled.get_or_insert(std);
        for (now, then) in std.iter().zip(*first) {
            assert!((now / then - 1.0).abs() < 1e-3, "{std:?} after {} million steps, {first:?} after one", part + 1);
        }
    }
    let readings = 3.0 * (parts * PART) as f64;
    let (mean, seconds) = (nis / readings, begin.elapsed().as_secs_f64());
    let nees = nees / (3 * parts) as f64;
    println!("{parts} million steps, {seconds:.0} s: mean NIS {mean:.6}, mean NEES of speeds and bias {nees:.3}");
    println!("standard deviations of v, ω, e: {:?}", settled.unwrap());
    // five standard deviations of a mean of chi-squared variables
    assert!((mean - 1.0).abs() < 5.0 * (2.0 / readings).sqrt(), "{mean}");
    assert!((nees - 1.0).abs() < 5.0 * (2.0 / (3 * parts) as f64).sqrt(), "{nees}");
}
