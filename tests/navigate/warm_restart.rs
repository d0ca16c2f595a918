//! Ten minutes on, five off, and on again: the simulator restarts where the heat equation says, and the filter that is
//! told of the pause is consistent. Bounds from chi-squared and normal distributions, wrong once in a million.

use gyroid::bias::WarmUp;
use gyroid::config::Config;
use gyroid::navigate::{Settings, run};
use gyroid::simulate::{Course, Drive, Options, drive, stationary, truth_names};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

const TEXT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
    [gyro]\nc1_rad_s = -2.4e-3\nc2_rad_s = 8e-3\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
    turn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.1\n\
    [gyro.noise]\nrate_random_walk_rad_s_sqrt_s = 2e-6\n\
    [gyro.last_run]\nwarm_up_age_s = 600.0\n\
    [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
    wheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.0004\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n";

const ON_S: f64 = 600.0;
const OFF_S: f64 = 300.0;
const RUNS: u64 = 80;

fn config() -> Config {
    Config::parse(TEXT, "robot.toml").unwrap()
}

fn options(seed: u64) -> Options {
    Options { vary_turn_on: true, off_time_s: Some(OFF_S), ..Options::from(seed) }
}

/// Heat after ten minutes on and five off, from the two differential equations by fine steps (Heun), off with `cooling_s`.
fn heat(warm_up: &WarmUp, cooling_s: f64) -> f64 {
    let steps = 20_000;
    let run = |mut h: f64, span: f64, target: f64, tau: f64| {
        let dt = span / f64::from(steps);
        for _ in 0..steps {
            let slope = (target - h) / tau;
            h += 0.5 * dt * (slope + (target - (h + dt * slope)) / tau);
        }
        h
    };
    let warmed = run(0.0, ON_S, 1.0, warm_up.time_constant_s);
    run(warmed, OFF_S, 0.0, cooling_s)
}

fn assert_chi_squared(sum: f64, degrees: f64, what: &str) {
    let chi = ChiSquared::new(degrees).unwrap();
    let [low, high] = [chi.inverse_cdf(5e-7), chi.inverse_cdf(1.0 - 5e-7)];
    assert!(sum > low && sum < high, "{what}: {sum} outside {low} .. {high} for {degrees} degrees of freedom");
}

#[test]
fn the_simulator_goes_on_where_the_heat_equation_says() {
    let mut config = config();
    config.gyro.as_mut().unwrap().noise = None;
    for cooling_s in [None, Some(700.0)] {
        config.gyro.as_mut().unwrap().cooling_time_constant_s = cooling_s;
        for seed in 0..5 {
            let Drive { truth, warm_up, .. } = drive(&config, Course::Square, 10.0, &options(seed)).unwrap();
            let h0 = heat(&warm_up, cooling_s.unwrap_or(warm_up.time_constant_s));
            let errors = truth.get(truth_names::GYRO_ERROR).unwrap();
            for (k, found) in errors.iter().enumerate() {
                let t = 0.01 * k as f64;
                let h = 1.0 - (1.0 - h0) * (-t / warm_up.time_constant_s).exp();
                let expected = warm_up.c1_rad_s * h + warm_up.c2_rad_s;
                // Heun's steps of span/20000 err by (dt/τ)²/6 of a value below one: 3e-9 of C1
                assert!((found - expected).abs() < 1e-11, "seed {seed}, row {k}: {found} {expected}");
            }
        }
    }
}

#[test]
fn a_gyro_at_rest_restarts_too() {
    let mut config = config();
    let gyro = config.gyro.as_mut().unwrap();
    (gyro.noise, gyro.angle_random_walk_rad_sqrt_s) = (None, 0.0);
    let options = Options { vary_turn_on: false, ..options(1) };
    let log = stationary(&config, 5.0, &options).unwrap();
    let model = config.gyro.as_ref().unwrap().warm_up();
    let expected = model.c1_rad_s * heat(&model, model.time_constant_s) + model.c2_rad_s;
    assert_eq!(log.time.at(0), 0.0);
    assert!((log.channels[0].values[0] - expected).abs() < 1e-11);
}

/// Errors of the gyro's error and their claimed standard deviations at the first and the last row, and whether NIS holds.
struct Outcome {
    errors: [f64; 2],
    stds: [f64; 2],
    nis_holds: bool,
}

fn outcomes(off_time_s: Option<f64>) -> Vec<Outcome> {
    let config = config();
    let settings = Settings { off_time_s, ..Settings::default() };
    (0..RUNS)
        .into_par_iter()
        .map(|seed| {
            let Drive { log, truth, .. } = drive(&config, Course::Random, 60.0, &options(seed)).unwrap();
            let run = run(&config, &log, &settings).unwrap();
            let of = |log: &gyroid::signal::Log, name: &str| {
                let values = log.get(name).unwrap();
                [values[0], values[values.len() - 1]]
            };
            let [estimate, stds] = ["gyro_error_rad_s", "gyro_error_std_rad_s"].map(|name| of(&run.pose, name));
            let truth = of(&truth, truth_names::GYRO_ERROR);
            let errors = [estimate[0] - truth[0], estimate[1] - truth[1]];
            Outcome { errors, stds, nis_holds: run.summary.consistency.nis_holds }
        })
        .collect()
}

fn nees(outcomes: &[Outcome], at: usize) -> f64 {
    outcomes.iter().map(|o| (o.errors[at] / o.stds[at]).powi(2)).sum()
}

#[test]
fn a_filter_that_knows_the_pause_is_consistent() {
    let outcomes = outcomes(Some(OFF_S));
    assert_chi_squared(nees(&outcomes, 0), RUNS as f64, "gyro error at power-on");
    assert_chi_squared(nees(&outcomes, 1), RUNS as f64, "gyro error after a minute");
    println!(
        "NEES at power-on {:.2}, after a minute {:.2}",
        nees(&outcomes, 0) / RUNS as f64,
        nees(&outcomes, 1) / RUNS as f64
    );
    let held = outcomes.iter().filter(|o| o.nis_holds).count() as f64;
    let n = RUNS as f64;
    assert!(held >= 0.95 * n - 5.0 * (n * 0.95 * 0.05).sqrt(), "NIS held in {held} of {n}");
}

#[test]
fn a_filter_that_assumes_a_cold_start_is_off_by_the_heat_that_was_left() {
    let outcomes = outcomes(None);
    let config = config();
    let model = config.gyro.as_ref().unwrap().warm_up();
    let h0 = heat(&model, model.time_constant_s);
    let n = RUNS as f64;
    let mean = outcomes.iter().map(|o| o.errors[0]).sum::<f64>() / n;
    let spread = (outcomes.iter().map(|o| (o.errors[0] - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    println!("bias {mean:.2e} rad/s, NEES {:.2}", nees(&outcomes, 0) / n);
    // it expects C2, and finds C2 + C1 h0
    let expected = -model.c1_rad_s * h0;
    assert!((mean - expected).abs() < 5.0 * spread / n.sqrt(), "{mean} {expected} ± {}", spread / n.sqrt());
    assert!(expected > 10.0 * spread / n.sqrt(), "the bias is large against its scatter");
    let limit = ChiSquared::new(n).unwrap().inverse_cdf(1.0 - 5e-7);
    assert!(nees(&outcomes, 0) > limit, "{} {limit}", nees(&outcomes, 0));
}

#[test]
fn the_age_goes_on_and_the_notes_say_what_was_taken() {
    let config = config();
    let log = drive(&config, Course::Square, 30.0, &options(1)).unwrap().log;
    let told = |config: &Config, off_time_s| {
        run(config, &log, &Settings { off_time_s, ..Settings::default() }).unwrap().summary
    };
    let warm = told(&config, Some(OFF_S));
    let h0 = heat(&config.gyro.as_ref().unwrap().warm_up(), 240.0);
    assert!((warm.warm_up_age_end_s - (30.0 - 240.0 * (1.0 - h0).ln())).abs() < 1e-5, "{}", warm.warm_up_age_end_s);
    assert!(warm.notes.iter().any(|n| n.contains("taken as time_constant_s")), "{:?}", warm.notes);
    let cold = told(&config, None);
    assert!((cold.warm_up_age_end_s - 30.0).abs() < 1e-9);
    assert!(cold.notes.iter().any(|n| n.contains("--off-time")), "{:?}", cold.notes);
    let mut stated = config.clone();
    stated.gyro.as_mut().unwrap().cooling_time_constant_s = Some(300.0);
    assert!(told(&stated, Some(OFF_S)).notes.iter().all(|n| !n.contains("taken as time_constant_s")));
}
