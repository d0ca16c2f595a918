//! What the filter learns while the robot stands, and that it does not learn it from a robot that only seems to.

use gyroid::config::Config;
use gyroid::navigate::{Settings, Standstill, Summary, run};
use gyroid::signal::{Log, TimeAxis, names};
use gyroid::simulate::{Course, Drive, Options, drive, replay, truth_names};
use gyroid::vehicle::{Motion, Rolling};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

const TEXT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
    [gyro]\nc1_rad_s = -2.4e-3\nc2_rad_s = 8e-3\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
    turn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.03\n\
    [gyro.noise]\nrate_random_walk_rad_s_sqrt_s = 2e-6\n\
    [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
    wheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.0004\n\
    [encoder]\nspeed_noise_std_rad_s = 0.0\nticks_per_revolution = 4096\n";

const RUNS: u64 = 60;
const STEP_S: f64 = 0.01;
const ROWS: usize = 6001;

fn config() -> Config {
    Config::parse(TEXT, "robot.toml").unwrap()
}

fn over_runs<T: Send>(of: impl Fn(u64) -> T + Sync + Send) -> Vec<T> {
    (0..RUNS).into_par_iter().map(of).collect()
}

/// Speed and yaw rate: two seconds of a curve and eight at rest, over and over.
fn course(k: usize) -> [f64; 2] {
    let t = (STEP_S * k as f64) % 10.0;
    let up = (t / 0.5).min((2.0 - t) / 0.5).clamp(0.0, 1.0);
    [0.4 * up, 0.6 * up]
}

/// A drive whose robot is held in its stops: its motion is given, so that no torque noise moves it.
fn held(config: &Config, seed: u64, torques: bool) -> Drive {
    let robot = Rolling::new(config.vehicle.as_ref().unwrap());
    let motion = |k: usize| {
        let [speed_m_s, yaw_rate_rad_s] = course(k);
        Motion { speed_m_s, yaw_rate_rad_s, ..Motion::default() }
    };
    let mut inputs = Log::new("inputs", TimeAxis::Uniform { start_s: 0.0, step_s: STEP_S, len: ROWS });
    for (side, name) in [names::WHEEL_LEFT, names::WHEEL_RIGHT].into_iter().enumerate() {
        inputs.push(name, (0..ROWS).map(|k| robot.wheel_speeds(&motion(k))[side]).collect()).unwrap();
    }
    let options = Options { since_power_on_s: 20.0, vary_turn_on: true, ..Options::from(seed) };
    let mut drive = replay(config, &inputs, &options).unwrap();
    if torques {
        let commanded = |k: usize| {
            let (now, next) = (course(k), course(k + 1));
            robot.torques_for(&motion(k), (next[0] - now[0]) / STEP_S, (next[1] - now[1]) / STEP_S)
        };
        for (side, name) in [names::TORQUE_LEFT, names::TORQUE_RIGHT].into_iter().enumerate() {
            drive.log.push(name, (0..ROWS).map(|k| commanded(k)[side]).collect()).unwrap();
        }
    }
    drive
}

/// Summary, and the normalised error squared of the gyro error at the end.
fn outcome(config: &Config, drive: &Drive, standstill: Option<Standstill>) -> (Summary, f64) {
    let settings = Settings { standstill, ..Settings::default() };
    let summary = run(config, &drive.log, &settings).unwrap().summary;
    let end = summary.final_pose.gyro_error_rad_s;
    let truth = *drive.truth.get(truth_names::GYRO_ERROR).unwrap().last().unwrap();
    let nees = ((end.estimate - truth) / end.std).powi(2);
    (summary, nees)
}

/// Sum of squares inside its chi-squared interval, wrong once in a million.
fn assert_chi_squared(sum: f64, what: &str) {
    let chi = ChiSquared::new(RUNS as f64).unwrap();
    let [low, high] = [chi.inverse_cdf(5e-7), chi.inverse_cdf(1.0 - 5e-7)];
    assert!(sum > low && sum < high, "{what}: {sum} outside {low} .. {high}");
}

#[test]
fn a_robot_that_is_held_teaches_the_gyro_error() {
    let config = config();
    for torques in [true, false] {
        let outcomes = over_runs(|seed| {
            let drive = held(&config, seed, torques);
            let (with, nees) = outcome(&config, &drive, Some(Standstill::EXACT));
            let (without, _) = outcome(&config, &drive, None);
            assert!(without.standstill.is_none());
            (with, nees, without)
        });
        for (with, _, without) in &outcomes {
            let still = with.standstill.unwrap();
            // six stops of 8 s, less the hold time and the last tick's, which may come early
            assert!((6 * 745..=6 * 765).contains(&still.rows), "{}", still.rows);
            assert!(still.gyro_error_std_after_rad_s < 0.2 * still.gyro_error_std_before_rad_s, "{still:?}");
            let std = |s: &Summary| s.final_pose.gyro_error_rad_s.std;
            assert!(std(with) < 0.5 * std(without), "{} {}", std(with), std(without));
            // no better than 45 s of the gyro's white noise allow
            assert!(std(with) > 1.5e-4 / 45f64.sqrt(), "{}", std(with));
        }
        let of = |std: &dyn Fn(&Summary) -> f64| outcomes.iter().map(|o| std(&o.0)).sum::<f64>() / RUNS as f64;
        println!(
            "torques {torques}: gyro error known to {:.2e} rad/s before the first stop, {:.2e} after the last; at the end \
             {:.2e} without the stops; NEES {:.2}",
            of(&|s| s.standstill.unwrap().gyro_error_std_before_rad_s),
            of(&|s| s.standstill.unwrap().gyro_error_std_after_rad_s),
            outcomes.iter().map(|o| o.2.final_pose.gyro_error_rad_s.std).sum::<f64>() / RUNS as f64,
            outcomes.iter().map(|o| o.1).sum::<f64>() / RUNS as f64,
        );
        assert_chi_squared(outcomes.iter().map(|o| o.1).sum(), &format!("gyro error, torques {torques}"));
    }
}

#[test]
fn a_filter_with_slip_learns_at_stops_as_well() {
    let mut config = config();
    let study = include_str!("../../data/study.toml");
    config.traction = Config::parse(study, "study.toml").unwrap().traction;
    let outcomes = over_runs(|seed| {
        let (summary, nees) = outcome(&config, &held(&config, seed, true), Some(Standstill::EXACT));
        assert!(summary.slip_modelled);
        let still = summary.standstill.unwrap();
        assert!(still.gyro_error_std_after_rad_s < 0.2 * still.gyro_error_std_before_rad_s, "{still:?}");
        nees
    });
    println!("with slip: NEES {:.2}", outcomes.iter().sum::<f64>() / RUNS as f64);
    assert_chi_squared(outcomes.iter().sum(), "gyro error with slip");
}

#[test]
fn wheels_that_torque_noise_moves_are_not_still() {
    // commanded to rest, and never at it: noisy speeds, and ticks fine enough to show it
    for (noise, ticks) in [(0.02, None), (0.0, Some(65536.0))] {
        let mut config = config();
        let encoder = config.encoder.as_mut().unwrap();
        (encoder.speed_noise_std_rad_s, encoder.ticks_per_revolution) = (noise, ticks);
        for seed in 0..5 {
            let log = drive(&config, Course::Square, 60.0, &Options::from(seed)).unwrap().log;
            let summary = run(&config, &log, &Settings::default()).unwrap().summary;
            assert_eq!(summary.standstill, None, "{ticks:?}");
        }
    }
}

#[test]
fn motion_that_hides_within_a_tick_does_no_harm() {
    // 256 ticks: the robot wanders at its stops, and both counts stand still for half a second time and again
    let mut config = config();
    config.encoder.as_mut().unwrap().ticks_per_revolution = Some(256.0);
    let outcomes = over_runs(|seed| {
        let options = Options { since_power_on_s: 20.0, vary_turn_on: true, ..Options::from(seed) };
        let drive = drive(&config, Course::Square, 120.0, &options).unwrap();
        outcome(&config, &drive, Some(Standstill::EXACT))
    });
    let rows: u64 = outcomes.iter().filter_map(|(s, _)| Some(s.standstill?.rows)).sum();
    assert!(rows > 10 * RUNS, "the rule was put to the test: {rows} rows");
    let nees: f64 = outcomes.iter().map(|o| o.1).sum();
    let limit = ChiSquared::new(RUNS as f64).unwrap().inverse_cdf(1.0 - 1e-6);
    println!("hidden in a tick: {} rows a run, NEES {:.2}", rows / RUNS, nees / RUNS as f64);
    assert!(nees < limit, "{nees} {limit}");
}

#[test]
fn noisy_encoders_need_the_users_word() {
    let mut config = config();
    let encoder = config.encoder.as_mut().unwrap();
    (encoder.speed_noise_std_rad_s, encoder.ticks_per_revolution) = (0.02, None);
    let asked = Standstill { within_noise: true, ..Standstill::EXACT };
    let outcomes = over_runs(|seed| {
        let drive = held(&config, seed, true);
        assert_eq!(outcome(&config, &drive, Some(Standstill::EXACT)).0.standstill, None);
        let (summary, nees) = outcome(&config, &drive, Some(asked));
        (summary.standstill.unwrap(), nees)
    });
    for (still, _) in &outcomes {
        // three standard deviations on two wheels keep out one row in 185, in runs of the hold time's length
        assert!(still.rows > 6 * 600 && still.rows < 6 * 765, "{}", still.rows);
        assert!(still.gyro_error_std_after_rad_s < 0.2 * still.gyro_error_std_before_rad_s, "{still:?}");
    }
    println!("noisy encoders, asked: NEES {:.2}", outcomes.iter().map(|o| o.1).sum::<f64>() / RUNS as f64);
    assert_chi_squared(outcomes.iter().map(|o| o.1).sum(), "gyro error");
}
