//! Effects in simulated drives, against closed forms.

use super::*;
use crate::effects;
use crate::model::drive::GRAVITY_M_S2;
use crate::signal::TimeAxis;

/// No noise, no friction.
fn quiet(effects: &[(&str, &Parameters)]) -> Config {
    let mut config = config(effects);
    config.gyro.as_mut().unwrap().angle_random_walk_rad_sqrt_s = 0.0;
    let vehicle = config.vehicle.as_mut().unwrap();
    (vehicle.viscous_friction_n_m_s, vehicle.torque_noise_n_m_sqrt_s) = (0.0, 0.0);
    config.encoder.as_mut().unwrap().speed_noise_std_rad_s = 0.0;
    config
}

/// Torques that push for a second, then none.
fn pushed(left: f64, right: f64, len: usize) -> Log {
    let mut log = Log::new("pushed", TimeAxis::Uniform { start_s: 0.0, step_s: 0.01, len });
    let torque = |u: f64| (0..len).map(|k| if k < 100 { u } else { 0.0 }).collect();
    log.push(names::TORQUE_LEFT, torque(left)).unwrap();
    log.push(names::TORQUE_RIGHT, torque(right)).unwrap();
    log
}

fn replayed(config: &Config, inputs: &Log) -> Drive {
    replay_with(config, inputs, &Options::from(1), &Library::new()).unwrap()
}

/// M + 2 Jw/r², kg.
fn effective_mass_kg(v: &Vehicle) -> f64 {
    v.mass_kg + 2.0 * v.wheel_inertia_kg_m2 / v.wheel_radius_m.powi(2)
}

#[test]
fn no_energy_is_gained_or_lost_about_a_centre_of_mass_off_the_axle() {
    let d = 0.15;
    let config = quiet(&[("vehicle.com_offset", &of([("offset_m", d)]))]);
    let v = config.vehicle.unwrap();
    let truth = replayed(&config, &pushed(0.2, 0.5, 800)).truth;
    let (speed, yaw) = (truth.get(truth_names::SPEED).unwrap(), truth.get(truth_names::YAW_RATE).unwrap());
    let wheels = 2.0 * v.wheel_inertia_kg_m2 * (v.half_track_m / v.wheel_radius_m).powi(2);
    let inertia = v.yaw_inertia_kg_m2 + v.mass_kg * d * d + wheels;
    let energy = |k: usize| 0.5 * (effective_mass_kg(&v) * speed[k].powi(2) + inertia * yaw[k].powi(2));
    let (first, last) = (energy(100), energy(799));
    assert!((speed[100] - speed[799]).abs() > 0.01, "the motion goes on changing: {} {}", speed[100], speed[799]);
    assert!((last / first - 1.0).abs() < 1e-9, "{first} {last}");
}

#[test]
fn a_robot_let_go_on_a_slope_rolls_down_with_constant_acceleration() {
    let config = quiet(&[("ground.slope", &of([("slope_rad", 0.03), ("uphill_heading_rad", 0.0)]))]);
    let v = config.vehicle.unwrap();
    let truth = replayed(&config, &pushed(0.0, 0.0, 301)).truth;
    let a = -v.mass_kg * GRAVITY_M_S2 * 0.03f64.sin() / effective_mass_kg(&v);
    assert!((truth.get(truth_names::SPEED).unwrap()[300] - 3.0 * a).abs() < 1e-12);
    assert!((truth.get(names::X).unwrap()[300] - 4.5 * a).abs() < 1e-12);
}

#[test]
fn dry_friction_brings_the_robot_to_rest_and_keeps_it_there() {
    // the largest that the bounds allow is stiff near standstill: 2.4e3/s and more
    for c in [0.02, 0.5] {
        let config = quiet(&[("wheel.rolling_resistance", &of([("coefficient", c)]))]);
        let v = config.vehicle.unwrap();
        let push = 0.5 * v.wheel_radius_m * v.mass_kg * GRAVITY_M_S2 * c + 0.05 + 4.0 * c;
        let truth = replayed(&config, &pushed(push, push, 1200)).truth;
        let speed = truth.get(truth_names::SPEED).unwrap();
        let slowing = (speed[120] - speed[110]) / 0.1 * effective_mass_kg(&v) / (v.mass_kg * GRAVITY_M_S2);
        assert!(speed[110] > 0.05 && (slowing / c + 1.0).abs() < 1e-3, "{slowing} {c}");
        // the integrator lets decay alone that is below 1e-9 m/s, and a part too long grows it (h λ)⁴/24 times at most
        assert!(speed[1000..].iter().all(|v| v.abs() < 1e-7), "{:?}", speed[1199]);
    }
}

#[test]
fn a_late_gyro_reads_what_the_rate_was() {
    let config = quiet(&[("sensor.gyro_delay", &of([("delay_s", 0.03)]))]);
    let Drive { log, truth, .. } =
        drive_with(&config, Course::Brisk, 20.0, &Options::from(2), &Library::new()).unwrap();
    let column = |log: &Log, name: &str| log.get(name).unwrap().to_vec();
    let (gyro, rate, error) =
        (column(&log, names::GYRO_Z), column(&truth, truth_names::YAW_RATE), column(&truth, truth_names::GYRO_ERROR));
    for k in 3..gyro.len() {
        assert!((gyro[k] - error[k] - rate[k - 3]).abs() < 1e-9, "row {k}");
    }
    assert!((3..gyro.len()).any(|k| (rate[k] - rate[k - 3]).abs() > 0.1));
}

#[test]
fn recorded_wheels_move_a_robot_of_other_radii_and_track() {
    let nominal = config(&[]);
    let mut inputs = drive(&nominal, Course::Brisk, 20.0, &Options::from(2)).unwrap().log;
    inputs.channels.retain(|c| !c.name.starts_with("torque"));
    let truth = |effects: &[(&str, &Parameters)]| {
        let truth = replayed(&config(effects), &inputs).truth;
        [truth_names::SPEED, truth_names::YAW_RATE, names::Y].map(|n| truth.get(n).unwrap().to_vec())
    };
    let plain = truth(&[]);
    let check = |effects: &[(&str, &Parameters)], speed: f64, yaw: f64| {
        let here = truth(effects);
        for k in 0..plain[0].len() {
            assert!((here[0][k] - speed * plain[0][k]).abs() < 1e-9, "{effects:?}");
            assert!((here[1][k] - yaw * plain[1][k]).abs() < 1e-9, "{effects:?}");
        }
    };
    check(&[("wheel.radius_scale", &of([("relative", 0.02)]))], 1.02, 1.02);
    check(&[("vehicle.track_width", &of([("relative", 0.05)]))], 1.0, 1.0 / 1.05);
    // forces change nothing here, and neither does what follows them
    let base = truth(&[("vehicle.payload", &of([("mass_relative", 0.0)]))]);
    for id in ["vehicle.payload", "ground.slope", "motor.torque_gain", "wheel.rolling_resistance", "wheel.slip"] {
        assert!(truth(&[(id, &usual(id))]) == base, "{id}");
    }
    let skid = truth(&[("wheel.lateral_skid", &usual("wheel.lateral_skid"))]);
    assert!(skid[1] == base[1] && (skid[2][1999] - base[2][1999]).abs() > 1e-3);
}

#[test]
fn counters_lose_the_ticks_that_the_speeds_lack() {
    let mut config = quiet(&[("encoder.missed_ticks", &usual("encoder.missed_ticks"))]);
    config.encoder.as_mut().unwrap().ticks_per_revolution = Some(4096.0);
    let tick_rad = config.encoder.unwrap().tick_rad().unwrap();
    let made = |config: &Config| drive_with(config, Course::Square, 30.0, &Options::from(5), &Library::new()).unwrap();
    let log = made(&config).log;
    for (speed, ticks) in [(names::WHEEL_LEFT, names::WHEEL_LEFT_TICKS), (names::WHEEL_RIGHT, names::WHEEL_RIGHT_TICKS)]
    {
        let (speed, ticks) = (log.get(speed).unwrap(), log.get(ticks).unwrap());
        let way: f64 = speed[1..].iter().map(|w| 0.01 * w).sum();
        let counted = (ticks[ticks.len() - 1] - ticks[0]) * tick_rad;
        assert!((way - counted).abs() < 2.0 * tick_rad, "{way} {counted}");
    }
    config.effects.clear();
    let last = |log: &Log, name: &str| *log.get(name).unwrap().last().unwrap();
    let whole = made(&config).log;
    assert!(last(&log, names::WHEEL_LEFT_TICKS) < 0.98 * last(&whole, names::WHEEL_LEFT_TICKS));
}

#[test]
fn effects_of_a_gyro_at_rest_work_in_drives_too() {
    let nominal = config(&[]);
    let inputs = drive(&nominal, Course::Brisk, 20.0, &Options::from(2)).unwrap().log;
    let base = replay_with(&nominal, &inputs, &Options::from(3), &Library::new()).unwrap().log;
    let mut measured = inputs.clone();
    let along = |at: f64, slope: f64| (0..inputs.len()).map(|k| at + slope * k as f64).collect();
    measured.push(names::TEMPERATURE, along(20.0, 0.005)).unwrap();
    measured.push(names::SUPPLY, along(5.0, -1e-4)).unwrap();
    let mut followed = 0;
    for effect in effects::registry().iter().filter(|e| by_id(e.about().id).is_none()) {
        let id = effect.about().id;
        let config = config(&[(id, &effect.tried().sizes[0])]);
        let replayed = |inputs: &Log| replay_with(&config, inputs, &Options::from(3), &Library::new());
        let log = match replayed(&inputs) {
            Ok(drive) => drive.log,
            Err(error) => {
                followed += 1;
                let error = error.to_string();
                assert!(error.contains(names::TEMPERATURE) || error.contains(names::SUPPLY), "{id}: {error}");
                replayed(&measured).unwrap().log
            }
        };
        for channel in &base.channels {
            let here = log.get(&channel.name).unwrap();
            let same = here.iter().zip(&channel.values).all(|(a, b)| a.to_bits() == b.to_bits());
            assert_eq!(same, channel.name != names::GYRO_Z, "{id} {}", channel.name);
        }
    }
    assert!(followed >= 3, "temperature, supply and noise that grows with temperature: {followed}");
    let ramp = config(&[("gyro.rate_ramp", &of([("ramp_rad_s2", 1e-4)]))]);
    let options = Options { since_power_on_s: 10.0, ..Options::from(3) };
    let late = drive_with(&ramp, Course::Square, 5.0, &options, &Library::new()).unwrap().truth;
    let error = late.get(truth_names::GYRO_ERROR).unwrap();
    let model = ramp.gyro.as_ref().unwrap().warm_up();
    let grown = error[500] - error[0] - (model.error_rad_s(15.0) - model.error_rad_s(10.0));
    assert!((grown - 5e-4).abs() < 1e-12, "{grown}");
}

#[test]
fn what_cannot_be_simulated_is_refused_by_name() {
    let refused = |config: &Config, parts: &[&str]| {
        let error = drive_with(config, Course::Square, 1.0, &Options::from(1), &Library::new()).unwrap_err();
        assert_eq!(error.kind, crate::ErrorKind::Config);
        parts.iter().for_each(|part| assert!(error.to_string().contains(part), "{error} lacks {part}"));
    };
    let none = Parameters::new();
    refused(&config(&[("wheel.unheard_of", &none)]), &["wheel.unheard_of", "gyro.tone", "wheel.slip"]);
    refused(&config(&[("gyro.scale_factor", &none)]), &["gyro.scale_factor.relative", "missing"]);
    refused(&config(&[("gyro.scale_factor", &of([("relative", 90.0)]))]), &["relative", "90", "not physical"]);
    let grip = "[traction.law.linear]\nstiffness = 20.0\nfriction = 0.5\n";
    let mut slipping = Config::parse(&format!("{TEXT}{grip}"), "robot.toml").unwrap();
    let table = |id: &str| EffectTable { id: id.into(), parameters: usual(id) };
    slipping.effects = vec![table("gyro.scale_factor")];
    refused(&slipping, &["gyro.scale_factor", "[traction]"]);
    let offset = EffectTable { id: "gyro.turn_on_shift".into(), parameters: of([("shift_rad_s", 1e-3)]) };
    slipping.effects = vec![offset];
    assert!(drive_with(&slipping, Course::Square, 1.0, &Options::from(1), &Library::new()).is_ok());
    let withheld = Library::without(["gyro.scale_factor"]);
    let scale = config(&[("gyro.scale_factor", &usual("gyro.scale_factor"))]);
    assert!(drive_with(&scale, Course::Square, 1.0, &Options::from(1), &withheld).is_err());
    let error = drive(&scale, Course::Square, 1.0, &Options::from(1)).unwrap_err().to_string();
    assert!(error.contains("nominal robot") && error.contains("gyro.scale_factor"), "{error}");
}
