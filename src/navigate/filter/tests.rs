use super::*;
use crate::bias::{Discrete, Scheme};

const TEXT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
    [gyro]\nc1_rad_s = -2.4e-3\nc2_rad_s = 8e-3\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
    turn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.03\n\
    [gyro.noise]\nrate_random_walk_rad_s_sqrt_s = 2e-6\n\
    [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
    wheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.0004\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n[pose]\nrate_hz = 5.0\nposition_std_m = 0.002\nheading_std_rad = 0.002\n";

fn config() -> Config {
    Config::parse(TEXT, "truth.toml").unwrap()
}

fn filter(config: &Config, settings: &Settings) -> RollingFilter {
    RollingFilter::new(config, settings, 20.0).unwrap().0
}

#[test]
fn a_start_is_known_as_it_is_stated_and_no_better_than_the_origin() {
    let started = |std| filter(&config(), &Settings::default()).starting_at([1.0, -2.0, 0.5], std);
    let stated = started([0.1, 0.02]);
    assert_eq!([X, Y, HEADING].map(|i| stated.mean[i]), [1.0, -2.0, 0.5]);
    for (std, wanted) in [([0.1, 0.02], [0.1, 0.1, 0.02]), ([0.0, 0.0], [ORIGIN_STD; 3])] {
        let p = started(std).covariance.covariance();
        for (i, wanted) in [X, Y, HEADING].into_iter().zip(wanted) {
            assert!((p[(i, i)].sqrt() / wanted - 1.0).abs() < 1e-9, "{std:?}: {}", p[(i, i)].sqrt());
        }
    }
}

#[test]
fn the_transition_matrix_agrees_with_differences() {
    let mut config = config();
    for scheme in Scheme::ALL {
        let model = config.gyro.as_ref().unwrap().warm_up();
        config.gyro.as_mut().unwrap().discrete = Some(Discrete::new(&model, 2.0, scheme).unwrap());
        let f = filter(&config, &Settings::default());
        let mean = SVector::from([0.4, -1.0, 0.9, 0.5, -0.8, 7e-3, 5e-3, 240f64.ln()]);
        for input in [Input::Torques([0.2, -0.1]), Input::Accelerations([0.1, 0.2])] {
            for dt in [0.01, 0.37] {
                let phi = f.transition(&mean, None, input, dt).phi;
                for column in 0..ROLLING_STATES {
                    let eps = 1e-6;
                    let at = |sign: f64| {
                        let mut m = mean;
                        m[column] += sign * eps;
                        f.transition(&m, None, input, dt).mean
                    };
                    let difference = (at(1.0) - at(-1.0)) / (2.0 * eps);
                    // rounding of values near 5 over 2 eps, truncation eps²
                    let error = (difference - phi.column(column)).amax();
                    assert!(error < 2e-9, "{scheme}, dt {dt}, column {column}: {error}");
                }
            }
        }
    }
}

#[test]
fn the_noise_gains_agree_with_differences() {
    let f = filter(&config(), &Settings::default());
    let torques = [0.2, -0.1];
    let dt = 0.05;
    let input = Input::Torques(torques);
    let Transition { gamma, variances: q, .. } = f.transition(&f.mean, None, input, dt);
    for (k, _) in torques.iter().enumerate() {
        let eps = 1e-5;
        let at = |sign: f64| {
            let mut u = torques;
            u[k] += sign * eps;
            f.transition(&f.mean, None, Input::Torques(u), dt).mean
        };
        let difference = (at(1.0) - at(-1.0)) / (2.0 * eps);
        assert!((difference - gamma.column(k)).amax() < 1e-9, "torque {k}");
        assert!((q[k] - 0.0004f64.powi(2) / dt).abs() < 1e-18);
    }
    // the walk moves error and asymptote alike
    assert_eq!(gamma.column(2).iter().filter(|g| **g != 0.0).count(), 2);
    assert!((q[2] - 2e-6f64.powi(2) * dt).abs() < 1e-24);
}

#[test]
fn unknown_accelerations_are_a_wiener_process_of_the_velocity() {
    // q dt for the variance of the speed, whatever the steps
    let mut f = filter(&config(), &Settings::default());
    let start = f.covariance()[(SPEED, SPEED)];
    let steps = [0.01, 0.3, 0.05, 0.14];
    steps.iter().for_each(|dt| f.predict(Input::Accelerations([0.2, 0.5]), *dt));
    let p = f.covariance();
    assert!((p[(SPEED, SPEED)] - start - 0.2 * 0.5).abs() < 1e-12);
    assert!((p[(YAW_RATE, YAW_RATE)] - start - 0.5 * 0.5).abs() < 1e-12);
}

#[test]
fn two_half_steps_carry_the_gyro_error_like_a_whole_one() {
    for scheme in Scheme::ALL {
        let mut config = config();
        let model = config.gyro.as_ref().unwrap().warm_up();
        config.gyro.as_mut().unwrap().discrete = Some(Discrete::new(&model, 0.5, scheme).unwrap());
        let (mut one, mut two) = (filter(&config, &Settings::default()), filter(&config, &Settings::default()));
        let input = Input::Torques([0.0; 2]);
        one.predict(input, 3.0);
        (0..2).for_each(|_| two.predict(input, 1.5));
        let block = |f: &RollingFilter| f.covariance().fixed_view::<3, 3>(GYRO_ERROR, GYRO_ERROR).into_owned();
        let (a, b) = (block(&one), block(&two));
        for i in 0..3 {
            assert!((one.mean[GYRO_ERROR + i] - two.mean[GYRO_ERROR + i]).abs() < 1e-15, "{scheme}");
            for j in 0..3 {
                // the chain of two derivatives is the derivative of the whole: only rounding differs
                let scale = (a[(i, i)] * a[(j, j)]).sqrt();
                assert!((a[(i, j)] - b[(i, j)]).abs() < 1e-12 * scale, "{scheme} {i} {j}");
            }
        }
    }
}

#[test]
fn missing_readings_change_nothing() {
    let mut f = filter(&config(), &Settings::default());
    let before = f.clone();
    for reading in [f64::NAN, f64::INFINITY] {
        assert!(f.update(Sensor::Gyro, reading).is_none());
    }
    assert_eq!(f.mean, before.mean);
    assert_eq!(f.covariance, before.covariance);
}

#[test]
fn the_gate_leaves_out_what_is_beyond_it() {
    let settings = Settings { gate_probability: Some(0.999), ..Settings::default() };
    let mut f = filter(&config(), &settings);
    // the yaw rate is known to 1 rad/s at first
    let far = f.update(Sensor::Gyro, 5.0).unwrap();
    assert!(!far.used && far.nis() > 10.8);
    let near = f.update(Sensor::Gyro, 1.0).unwrap();
    assert!(near.used);
    assert!(filter(&config(), &Settings::default()).update(Sensor::Gyro, 5.0).unwrap().used);
    let bad = Settings { gate_probability: Some(1.0), ..Settings::default() };
    assert!(RollingFilter::new(&config(), &bad, 0.0).unwrap_err().to_string().contains("probability"));
}

#[test]
fn without_error_model_the_gyro_error_stays_zero() {
    let settings = Settings { error_model: ErrorModel::Off, ..Settings::default() };
    let mut f = filter(&config(), &settings);
    for _ in 0..100 {
        f.update(Sensor::Gyro, 0.01);
        f.predict(Input::Torques([0.0; 2]), 0.01);
    }
    assert_eq!((f.mean[GYRO_ERROR], f.mean[WARM_ERROR]), (0.0, 0.0));
    assert_eq!(f.std()[GYRO_ERROR], 0.0);
}

#[test]
fn a_covariance_that_is_none_is_refused() {
    // pairwise correlations of -0.9 are each possible, all three together are not
    let mut config = config();
    let (s1, s2, st) = (1e-5, 1e-5, 1.0);
    let gyro = config.gyro.as_mut().unwrap();
    (gyro.turn_on_bias_std_rad_s, gyro.warm_up_relative_std) = (None, None);
    gyro.covariance = Some(crate::config::Covariance::from_matrix(&[
        [s1 * s1, -0.9 * s1 * s2, -0.9 * s1 * st],
        [-0.9 * s1 * s2, s2 * s2, -0.9 * s2 * st],
        [-0.9 * s1 * st, -0.9 * s2 * st, st * st],
    ]));
    let error = RollingFilter::new(&config, &Settings::default(), 20.0).unwrap_err();
    assert!(error.to_string().contains("gyro.covariance"), "{error}");
}

#[test]
fn what_is_missing_is_named() {
    let refused = |change: &dyn Fn(&mut Config), part: &str| {
        let mut config = config();
        change(&mut config);
        let error = RollingFilter::new(&config, &Settings::default(), 0.0).unwrap_err().to_string();
        assert!(error.contains(part), "{error} lacks {part}");
    };
    refused(&|c| c.gyro = None, "[gyro]");
    refused(&|c| c.vehicle = None, "[vehicle]");
    refused(&|c| c.encoder = None, "[encoder]");
    refused(&|c| c.sample_time_s = None, "sample_time_s");
}

#[test]
fn a_mean_speed_of_ticks_has_the_variance_of_its_ticks_and_of_the_walk_about_its_middle() {
    let mut config = config();
    config.encoder.as_mut().unwrap().ticks_per_revolution = Some(1000.0);
    let mut f = filter(&config, &Settings::default());
    f.predict(Input::Accelerations([0.2, 0.5]), 0.01);
    for (side, sensor) in [Sensor::WheelLeft, Sensor::WheelRight].into_iter().enumerate() {
        let row = f.model().wheel_row(side);
        let known = f.covariance.innovation_variance(&row, 0.0);
        let innovation = f.clone().update_mean(sensor, 3.0, 0.02).unwrap();
        let tick = std::f64::consts::TAU / 1000.0;
        // a wheel's speed walks by (q_a + b² q_α)/r² a second
        let walk = (0.2 + 0.17f64.powi(2) * 0.5) / 0.05f64.powi(2);
        let expected = 0.02f64.powi(2) + tick * tick / 6.0 / 0.02f64.powi(2) + walk * 0.02 / 12.0;
        assert!(
            ((innovation.variance - known) / expected - 1.0).abs() < 1e-9,
            "{} {expected}",
            innovation.variance - known
        );
        assert!((innovation.residual - (3.0 - row.dot(&f.mean))).abs() < 1e-15);
        assert!(f.update_mean(sensor, f64::NAN, 0.02).is_none());
    }
}

#[test]
fn a_robot_that_stands_tells_the_gyro_error() {
    // one gyro reading at a known yaw rate of zero is a reading of the error with the gyro's noise
    let mut f = filter(&config(), &Settings::default());
    f.update_still([1e-14, 1e-14]);
    let before = f.covariance()[(GYRO_ERROR, GYRO_ERROR)];
    f.update(Sensor::Gyro, 6e-3);
    let after = f.covariance()[(GYRO_ERROR, GYRO_ERROR)];
    let noise = 1.5e-4f64.powi(2) / 0.01;
    assert!((1.0 / after - 1.0 / before - 1.0 / noise).abs() < 1e-6 / noise, "{before} {after}");
    assert!(f.mean()[SPEED].abs() < 1e-12 && f.std()[SPEED] < 1.1e-7);
}
