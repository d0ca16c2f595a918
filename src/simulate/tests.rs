use super::*;
use crate::config::Kind;
use crate::signal::{Log, TimeAxis, names};
use statrs::distribution::{ChiSquared, ContinuousCDF};

const TEXT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
    [gyro]\nc1_rad_s = -2.4e-3\nc2_rad_s = 8e-3\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
    turn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.03\n\
    [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
    wheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.0004\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n[pose]\nrate_hz = 5.0\nposition_std_m = 0.002\nheading_std_rad = 0.002\n";

fn config() -> Config {
    Config::parse(TEXT, "truth.toml").unwrap()
}

/// Two-sided interval of a chi-squared variable per degree of freedom, wrong once in 10⁶.
fn chi_squared_bounds(degrees: f64) -> [f64; 2] {
    let chi = ChiSquared::new(degrees).unwrap();
    [chi.inverse_cdf(5e-7) / degrees, chi.inverse_cdf(1.0 - 5e-7) / degrees]
}

fn assert_unit_variance(deviates: impl Iterator<Item = f64>) {
    let (n, sum) = deviates.fold((0.0, 0.0), |(n, s), z| (n + 1.0, s + z * z));
    let [low, high] = chi_squared_bounds(n);
    assert!(n > 100.0 && sum / n > low && sum / n < high, "{} outside {low} .. {high}, n = {n}", sum / n);
}

#[test]
fn a_gyro_at_rest_reads_its_warm_up_and_white_noise() {
    let config = config();
    let options = Options { since_power_on_s: 30.0, ..Options::from(1) };
    let log = stationary(&config, 600.0, &options).unwrap();
    assert_eq!(log.len(), 60_001);
    assert_eq!(log.time.at(0), 30.0);
    let names: Vec<_> = log.channels.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, [names::GYRO_Z]);
    let model = config.gyro.as_ref().unwrap().warm_up();
    let gyro = log.get(names::GYRO_Z).unwrap();
    let std = 1.5e-4 / 0.01f64.sqrt();
    assert_unit_variance((0..log.len()).map(|i| (gyro[i] - model.error_rad_s(log.time.at(i))) / std));
}

#[test]
fn the_rate_random_walk_starts_at_power_on() {
    let mut config = config();
    let gyro = config.gyro.as_mut().unwrap();
    gyro.angle_random_walk_rad_sqrt_s = 0.0;
    let k = 3e-6;
    gyro.noise = Some(crate::config::Noise { rate_random_walk_rad_s_sqrt_s: Some(k), ..Default::default() });
    let model = gyro.warm_up();
    let start = 50.0;
    let walks = (0..400).map(|seed| {
        let options = Options { since_power_on_s: start, ..Options::from(seed) };
        let log = stationary(&config, 0.05, &options).unwrap();
        let at = log.len() - 1;
        let t = log.time.at(at);
        (log.get(names::GYRO_Z).unwrap()[at] - model.error_rad_s(t)) / (k * t.sqrt())
    });
    assert_unit_variance(walks);
}

#[test]
fn a_lattice_is_kept() {
    let mut config = config();
    let lsb = 1e-3;
    config.gyro.as_mut().unwrap().noise =
        Some(crate::config::Noise { quantization_lsb_rad_s: Some(lsb), ..Default::default() });
    let log = stationary(&config, 1.0, &Options::from(1)).unwrap();
    for v in log.get(names::GYRO_Z).unwrap() {
        assert!((v / lsb - (v / lsb).round()).abs() < 1e-9, "{v}");
    }
}

#[test]
fn a_drive_has_the_columns_in_order_and_pose_at_its_rate() {
    let drive = drive(&config(), Course::Square, 10.0, &Options::from(1)).unwrap();
    let names: Vec<_> = drive.log.channels.iter().map(|c| c.name.as_str()).collect();
    let expected = [
        names::SINCE_POWER_ON,
        names::TORQUE_LEFT,
        names::TORQUE_RIGHT,
        names::GYRO_Z,
        names::WHEEL_LEFT,
        names::WHEEL_RIGHT,
        names::X,
        names::Y,
        names::HEADING,
    ];
    assert_eq!(names, expected);
    let heading = drive.log.get(names::HEADING).unwrap();
    let rows: Vec<_> = (0..drive.log.len()).filter(|i| heading[*i].is_finite()).collect();
    assert_eq!(rows, (0..=50).map(|i| 20 * i).collect::<Vec<_>>());
}

#[test]
fn sensors_have_the_stated_noise_about_the_truth() {
    let config = config();
    let options = Options { since_power_on_s: 20.0, ..Options::from(4) };
    let Drive { log, truth, .. } = drive(&config, Course::Random, 120.0, &options).unwrap();
    let robot = crate::vehicle::Rolling::new(config.vehicle.as_ref().unwrap());
    let column = |name: &str| log.get(name).unwrap();
    let [speed, yaw, error] =
        [truth_names::SPEED, truth_names::YAW_RATE, truth_names::GYRO_ERROR].map(|n| truth.get(n).unwrap());
    let wheels = |i: usize| {
        let motion = crate::vehicle::Motion { speed_m_s: speed[i], yaw_rate_rad_s: yaw[i], ..Default::default() };
        robot.wheel_speeds(&motion)
    };
    let rows = 0..log.len();
    assert_unit_variance(rows.clone().map(|i| (column(names::GYRO_Z)[i] - yaw[i] - error[i]) / 1.5e-3));
    assert_unit_variance(rows.clone().map(|i| (column(names::WHEEL_LEFT)[i] - wheels(i)[0]) / 0.02));
    assert_unit_variance(rows.clone().map(|i| (column(names::WHEEL_RIGHT)[i] - wheels(i)[1]) / 0.02));
    for name in [names::X, names::Y, names::HEADING] {
        let true_values = truth.get(name).unwrap();
        let deviations = rows.clone().map(|i| (column(name)[i] - true_values[i]) / 0.002);
        assert_unit_variance(deviations.filter(|z| z.is_finite()));
    }
    let model = config.gyro.as_ref().unwrap().warm_up();
    for i in rows {
        assert_eq!(error[i], model.error_rad_s(column(names::SINCE_POWER_ON)[i]));
    }
}

#[test]
fn torques_with_their_noise_move_the_robot_as_the_dynamics_say() {
    // from the logged torques alone, the velocity follows up to white torque noise of the stated density
    let config = config();
    let vehicle = config.vehicle.as_ref().unwrap();
    let robot = crate::vehicle::Rolling::new(vehicle);
    let Drive { log, truth, .. } = drive(&config, Course::FigureEight, 60.0, &Options::from(9)).unwrap();
    let [left, right] = [names::TORQUE_LEFT, names::TORQUE_RIGHT].map(|n| log.get(n).unwrap());
    let [speed, yaw] = [truth_names::SPEED, truth_names::YAW_RATE].map(|n| truth.get(n).unwrap());
    let std = vehicle.torque_noise_n_m_sqrt_s / 0.01f64.sqrt();
    let deviates = (1..log.len()).flat_map(|k| {
        let before =
            crate::vehicle::Motion { speed_m_s: speed[k - 1], yaw_rate_rad_s: yaw[k - 1], ..Default::default() };
        let expected = robot.step(&before, [left[k - 1], right[k - 1]], 0.01);
        let f = robot.forcing([std; 2]);
        let by_sum = f.acceleration_m_s2 / 2f64.sqrt() * 0.01;
        let by_difference = robot.yaw_acceleration_by_torque() * std * 2f64.sqrt() * 0.01;
        // damping over 10 ms changes the gain by less than 2e-4
        [(speed[k] - expected.speed_m_s) / by_sum, (yaw[k] - expected.yaw_rate_rad_s) / by_difference]
    });
    assert_unit_variance(deviates);
}

#[test]
fn the_robot_follows_its_course() {
    // a lap of the square with stops: after it the robot is where it began
    let drive = drive(&config(), Course::Square, 60.0, &Options::from(2)).unwrap();
    let lap_s = 1.0 + 4.0 * (5.0 + std::f64::consts::FRAC_PI_2 + 0.5);
    let at = (lap_s / 0.01).round() as usize;
    let value = |name: &str| drive.truth.get(name).unwrap()[at];
    assert!(value(names::X).hypot(value(names::Y)) < 0.05, "{} {}", value(names::X), value(names::Y));
    assert!((value(names::HEADING) - std::f64::consts::TAU).abs() < 0.05, "{}", value(names::HEADING));
    let far = drive.truth.get(names::X).unwrap().iter().fold(0.0, |m: f64, x| m.max(*x));
    assert!((far - 2.0).abs() < 0.1, "{far}");
}

#[test]
fn the_course_is_followed_at_slow_sample_times_too() {
    for step in [0.001, 0.1, 0.5] {
        let mut config = config();
        config.sample_time_s = Some(step);
        let drive = drive(&config, Course::Square, 60.0, &Options::from(2)).unwrap();
        let far = drive.truth.get(names::X).unwrap().iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        assert!((far - 2.0).abs() < 0.3, "{step}: {far}");
    }
}

#[test]
fn same_seeds_same_log_and_motion_apart_from_sensors() {
    let config = config();
    let run = |motion, sensors| {
        let options = Options { seeds: Seeds { motion, sensors, turn_on: 0 }, ..Options::from(0) };
        drive(&config, Course::Random, 20.0, &options).unwrap()
    };
    let bits = |d: &Drive| d.log.channels.iter().flat_map(|c| c.values.iter().map(|v| v.to_bits())).collect::<Vec<_>>();
    assert_eq!(bits(&run(1, 2)), bits(&run(1, 2)));
    let (one, moved) = (run(1, 2), run(2, 2));
    assert_ne!(one.truth.get(names::X), moved.truth.get(names::X));
    let replayed = |sensors| {
        let options = Options { seeds: Seeds { motion: 1, sensors, turn_on: 0 }, ..Options::from(0) };
        replay(&config, &one.log, &options).unwrap()
    };
    let (same, other) = (replayed(2), replayed(3));
    assert_eq!(same.truth, other.truth);
    assert_ne!(same.log.get(names::GYRO_Z), other.log.get(names::GYRO_Z));
    assert_ne!(same.log.get(names::WHEEL_LEFT), other.log.get(names::WHEEL_LEFT));
}

#[test]
fn replayed_torques_give_the_same_motion() {
    let config = config();
    let first = drive(&config, Course::Random, 30.0, &Options { since_power_on_s: 7.0, ..Options::from(5) }).unwrap();
    let again = replay(&config, &first.log, &Options::from(5)).unwrap();
    // the same torque noise on the same torques: only the time axis' rounding differs
    for name in [names::X, names::Y, names::HEADING] {
        for (a, b) in first.truth.get(name).unwrap().iter().zip(again.truth.get(name).unwrap()) {
            assert!((a - b).abs() < 1e-9, "{name}: {a} {b}");
        }
    }
    assert_eq!(first.log.get(names::SINCE_POWER_ON), again.log.get(names::SINCE_POWER_ON));
    assert_eq!(first.log.get(names::TORQUE_LEFT), again.log.get(names::TORQUE_LEFT));
    let other = replay(&config, &first.log, &Options::from(6)).unwrap();
    assert_ne!(first.truth.get(names::X), other.truth.get(names::X));
}

#[test]
fn without_torques_the_wheel_speeds_are_replayed() {
    let mut config = config();
    config.encoder.as_mut().unwrap().speed_noise_std_rad_s = 0.0;
    let first = drive(&config, Course::Random, 30.0, &Options::from(5)).unwrap();
    let mut log = first.log.clone();
    log.channels.retain(|c| !c.name.starts_with("torque"));
    let again = replay(&config, &log, &Options::from(5)).unwrap();
    assert!(again.log.get(names::TORQUE_LEFT).is_none());
    let last = log.len() - 1;
    for name in [names::X, names::Y] {
        let (a, b) = (first.truth.get(name).unwrap()[last], again.truth.get(name).unwrap()[last]);
        // speeds are not quite linear between rows: λ² h³ of the speed a row, λ below 0.2 1/s
        assert!((a - b).abs() < 1e-5, "{name}: {a} {b}");
    }
}

#[test]
fn gaps_in_recorded_torques_are_held() {
    let config = config();
    let mut log = drive(&config, Course::Square, 5.0, &Options::from(5)).unwrap().log;
    let at = log.channels.iter().position(|c| c.name == names::TORQUE_LEFT).unwrap();
    log.channels[at].values[100] = f64::NAN;
    let held = log.channels[at].values[99];
    let again = replay(&config, &log, &Options::from(5)).unwrap();
    assert_eq!(again.log.get(names::TORQUE_LEFT).unwrap()[100], held);
}

#[test]
fn turn_on_varies_only_on_request_and_as_stated() {
    let config = config();
    let nominal = config.gyro.as_ref().unwrap().warm_up();
    let warm_up = |seed, vary_turn_on| {
        let options = Options { vary_turn_on, ..Options::from(seed) };
        drive(&config, Course::Square, 0.02, &options).unwrap().warm_up
    };
    assert_eq!(warm_up(1, false), nominal);
    let draws: Vec<_> = (0..400).map(|seed| warm_up(seed, true)).collect();
    assert_unit_variance(draws.iter().map(|m| (m.c2_rad_s - nominal.c2_rad_s) / 2e-4));
    assert_unit_variance(draws.iter().map(|m| (m.c1_rad_s / nominal.c1_rad_s - 1.0) / 0.03));
    assert_unit_variance(draws.iter().map(|m| (m.time_constant_s / nominal.time_constant_s).ln() / 0.03));
}

#[test]
fn what_is_missing_is_named() {
    let refused = |change: &dyn Fn(&mut Config), part: &str| {
        let mut config = config();
        change(&mut config);
        let error = drive(&config, Course::Square, 1.0, &Options::from(1)).unwrap_err().to_string();
        assert!(error.contains(part), "{error} lacks {part}");
    };
    refused(&|c| c.vehicle = None, "[vehicle]");
    refused(&|c| c.encoder = None, "[encoder]");
    refused(&|c| c.gyro = None, "[gyro]");
    refused(&|c| c.sample_time_s = None, "sample_time_s");
    let effect = crate::config::EffectTable { id: "wheel.slip".into(), parameters: [].into() };
    refused(&|c| c.effects = vec![effect.clone()], "wheel.slip");

    let text = |r: Result<Log>| r.unwrap_err().to_string();
    assert!(text(stationary(&config(), 0.0, &Options::from(1))).contains("duration"));
    assert!(text(stationary(&config(), f64::NAN, &Options::from(1))).contains("duration"));
    assert!(text(stationary(&config(), 1e12, &Options::from(1))).contains("rows"));
    let early = Options { since_power_on_s: -1.0, ..Options::from(1) };
    assert!(text(stationary(&config(), 1.0, &early)).contains("power-on"));
    let mut plain = config();
    let gyro = plain.gyro.as_mut().unwrap();
    (gyro.turn_on_bias_std_rad_s, gyro.warm_up_relative_std) = (None, None);
    let vary = Options { vary_turn_on: true, ..Options::from(1) };
    assert!(text(stationary(&plain, 1.0, &vary)).contains("no variation"));
}

#[test]
fn logs_that_cannot_be_replayed_are_refused() {
    let config = config();
    let good = drive(&config, Course::Square, 1.0, &Options::from(1)).unwrap().log;
    let refused = |change: &dyn Fn(&mut Log), kind: ErrorKind, part: &str| {
        let mut log = good.clone();
        change(&mut log);
        let error = replay(&config, &log, &Options::from(1)).unwrap_err();
        assert_eq!(error.kind, kind, "{error}");
        assert!(error.to_string().contains(part), "{error} lacks {part}");
    };
    refused(&|l| l.channels.truncate(1), ErrorKind::Column, "neither torques nor wheel speeds");
    let swap = |l: &mut Log| {
        let mut t = l.time.to_vec();
        t.swap(10, 11);
        l.time = TimeAxis::Explicit(t);
    };
    refused(&swap, ErrorKind::Time, "row 12");
    refused(&|l| l.channels[0].values[3] = f64::NAN, ErrorKind::Time, "row 4");
    let short = Log::new("short", TimeAxis::Explicit(vec![0.0]));
    assert_eq!(replay(&config, &short, &Options::from(1)).unwrap_err().kind, ErrorKind::TooShort);
}

#[test]
fn a_stationary_configuration_needs_no_robot() {
    let mut config = config();
    (config.kind, config.vehicle, config.encoder, config.pose) = (Kind::Stationary, None, None, None);
    assert_eq!(stationary(&config, 1.0, &Options::from(1)).unwrap().len(), 101);
}
