//! The covariance of a filter is symmetric and positive definite after days of steps, at usual and at tiny noise.

use gyroid::config::Config;
use gyroid::math::random::Stream;
use gyroid::navigate::{Filter, Input, MotionModel, RollingFilter, Sensor, Settings, SlipFilter, state};
use gyroid::vehicle::{Motion, Rolling, Slipping, SlippingState};

const TEXT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
    [gyro]\nc1_rad_s = -2.4e-3\nc2_rad_s = 8e-3\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
    turn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.03\n\
    [gyro.noise]\nrate_random_walk_rad_s_sqrt_s = 2e-6\n\
    [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
    wheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.0004\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n\
    [traction.law.burckhardt]\nc1 = 1.2801\nc2 = 23.99\nc3 = 0.52\n";
const DT_S: f64 = 0.01;
const SINCE_POWER_ON_S: f64 = 20.0;

fn config() -> Config {
    Config::parse(TEXT, "robot.toml").unwrap()
}

/// As the filter's numbers are hardest: variances of readings at the floor, hardly any noise in the motion.
fn tiny_noise() -> Config {
    let mut config = config();
    let gyro = config.gyro.as_mut().unwrap();
    gyro.angle_random_walk_rad_sqrt_s = 1e-12;
    gyro.noise = None;
    config.vehicle.as_mut().unwrap().torque_noise_n_m_sqrt_s = 1e-9;
    config.encoder.as_mut().unwrap().speed_noise_std_rad_s = 0.0;
    config
}

/// Runs `steps` steps through a filter, `next` being the robot's motion and wheels after a step under torques; returns the
/// filter and the last motion.
fn long_run<const N: usize, M: MotionModel<N>>(
    (mut filter, _): (Filter<N, M>, Vec<String>),
    config: &Config,
    steps: u32,
    mut next: impl FnMut([f64; 2]) -> (Motion, [f64; 2]),
) -> (Filter<N, M>, Motion) {
    let gyro = config.gyro.as_ref().unwrap();
    let wheel_std = config.encoder.unwrap().speed_noise_std_rad_s;
    let gyro_std = gyro.angle_random_walk_rad_sqrt_s / DT_S.sqrt();
    let mut stream = Stream::new(5, 0);
    let (mut motion, mut wheels) = (Motion::default(), [0.0; 2]);
    for k in 0..steps {
        let t = DT_S * f64::from(k);
        let error = gyro.warm_up().error_rad_s(SINCE_POWER_ON_S + t);
        filter.update(Sensor::Gyro, motion.yaw_rate_rad_s + error + gyro_std * stream.normal());
        // encoders at a rate of their own
        if k % 3 == 0 {
            filter.update(Sensor::WheelLeft, wheels[0] + wheel_std * stream.normal());
            filter.update(Sensor::WheelRight, wheels[1] + wheel_std * stream.normal());
        }
        let torques = [0.01 + 0.02 * (0.2 * t).sin(), 0.01 - 0.02 * (0.2 * t).sin()];
        filter.predict(Input::Torques(torques), DT_S);
        (motion, wheels) = next(torques);
        if k % (steps / 100) == 0 || k + 1 == steps {
            assert!(filter.factors().diagonal().iter().all(|d| *d > 0.0 && d.is_finite()), "step {k}");
            let p = filter.covariance();
            assert_eq!(p, p.transpose());
            for i in 0..N {
                for j in 0..i {
                    let correlation = p[(i, j)] / (p[(i, i)] * p[(j, j)]).sqrt();
                    assert!(correlation.abs() <= 1.0 + 1e-12, "step {k}: correlation {i} {j} is {correlation}");
                }
            }
        }
    }
    (filter, motion)
}

fn rolling(config: &Config, steps: u32) {
    let robot = Rolling::new(config.vehicle.as_ref().unwrap());
    let mut motion = Motion::default();
    let filter = RollingFilter::new(config, &Settings::default(), SINCE_POWER_ON_S).unwrap();
    let (filter, last) = long_run(filter, config, steps, |torques| {
        motion = robot.step(&motion, torques, DT_S);
        (motion, robot.wheel_speeds(&motion))
    });
    assert_heading(&filter, &last);
}

fn slip(config: &Config, steps: u32) -> (SlipFilter, Motion) {
    let robot = Slipping::new(config.vehicle.as_ref().unwrap(), config.traction.as_ref().unwrap());
    let mut state = SlippingState::default();
    let filter = SlipFilter::new(config, &Settings::default(), SINCE_POWER_ON_S).unwrap();
    long_run(filter, config, steps, |torques| {
        state = robot.step(&state, torques, DT_S);
        (state.motion, state.wheels_rad_s)
    })
}

/// Definite and wrong would be no use: the heading is known as well as claimed, to five standard deviations.
fn assert_heading<const N: usize, M: MotionModel<N>>(filter: &Filter<N, M>, motion: &Motion) {
    let (off, std) = (filter.mean()[state::HEADING] - motion.heading_rad, filter.std()[state::HEADING]);
    assert!(off.abs() < 5.0 * std, "{off} {std}");
}

#[test]
fn rolling_at_usual_noise() {
    rolling(&config(), 1_000_000);
}

#[test]
fn rolling_at_tiny_noise() {
    rolling(&tiny_noise(), 1_000_000);
}

#[test]
fn slip_at_usual_noise() {
    let (filter, motion) = slip(&config(), 300_000);
    assert_heading(&filter, &motion);
}

#[test]
fn slip_at_tiny_noise() {
    slip(&tiny_noise(), 300_000);
}

#[test]
#[ignore = "battery: ten million steps"]
fn battery_of_steps() {
    let steps = 1_000_000 * crate::cases::cases(10) as u32;
    rolling(&config(), steps);
    rolling(&tiny_noise(), steps);
    let (filter, motion) = slip(&config(), steps);
    assert_heading(&filter, &motion);
    slip(&tiny_noise(), steps);
}
