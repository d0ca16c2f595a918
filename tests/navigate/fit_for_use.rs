//! Whether a filter is fit for use, and the path given the whole drive.

use crate::place::Place;
use gyroid::config::Config;
use gyroid::navigate::{Run, Settings, run};
use gyroid::signal::names;
use gyroid::simulate::{Course, Drive, Options, drive};
use rayon::prelude::*;
use statrs::distribution::{Binomial, ChiSquared, ContinuousCDF, DiscreteCDF};

const ROBOT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.02\n\
    [gyro]\nc1_rad_s = -2.4e-3\nc2_rad_s = 8e-3\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
    turn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.03\n\
    [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
    wheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.0004\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n\
    [pose]\nrate_hz = 5.0\nposition_std_m = 0.002\nheading_std_rad = 0.002\n";
const SNOW: &str = "[traction.law.burckhardt]\nc1 = 0.1946\nc2 = 94.129\nc3 = 0.0646\n";
const RUNS: u64 = 60;

fn recorded(config: &Config, course: Course, seed: u64) -> Drive {
    let options = Options { since_power_on_s: 20.0, vary_turn_on: true, ..Options::from(seed) };
    drive(config, course, 40.0, &options).unwrap()
}

/// Of [`RUNS`] sound drives, no more are refused than once in a million times if each sensor is at one in a thousand.
fn few_are_refused(what: &str, text: &str, settings: &Settings, course: Course, torques: bool) {
    let config = Config::parse(text, "robot.toml").unwrap();
    let judged: Vec<_> = (0..RUNS)
        .into_par_iter()
        .map(|seed| {
            let mut log = recorded(&config, course, seed).log;
            log.channels.retain(|c| torques || !c.name.starts_with("torque"));
            run(&config, &log, settings).unwrap().summary.consistency
        })
        .collect();
    let sensors = judged[0].sensors.len() as f64;
    let refused = judged.iter().filter(|c| !c.fit_for_use).count() as u64;
    let most = Binomial::new(1.0 - 0.999f64.powf(sensors), RUNS).unwrap().inverse_cdf(1.0 - 1e-6);
    let first = judged.iter().find(|c| !c.fit_for_use).map(|c| &c.sensors);
    assert!(refused <= most, "{what}: {refused} of {RUNS}, at most {most}; {first:?}");
}

#[test]
fn sound_drives_are_fit_for_use() {
    let plain = Settings::default();
    for (what, course) in [("random", Course::Random), ("square", Course::Square), ("brisk", Course::Brisk)] {
        few_are_refused(what, ROBOT, &plain, course, true);
    }
    few_are_refused("pose", ROBOT, &Settings { use_pose: true, ..plain }, Course::Random, true);
    few_are_refused("slip", &format!("{ROBOT}{SNOW}"), &plain, Course::Brisk, true);
    let ticks =
        ROBOT.replace("speed_noise_std_rad_s = 0.02", "speed_noise_std_rad_s = 0.0\nticks_per_revolution = 4096");
    few_are_refused("ticks", &ticks, &plain, Course::Random, true);
}

#[test]
fn without_torques_sound_drives_are_fit_for_use_too() {
    for course in [Course::Random, Course::Square, Course::Brisk] {
        few_are_refused("no torques", ROBOT, &Settings::default(), course, false);
    }
}

#[test]
fn what_the_configuration_does_not_say_is_found() {
    // a track 10 % wider than it says; wheels 0.2 s late; a gyro three times as noisy
    let config = Config::parse(ROBOT, "robot.toml").unwrap();
    let shift = |values: &mut Vec<f64>| values.rotate_right(10);
    let (mut wide, mut noisy) = (config.clone(), config.clone());
    wide.vehicle.as_mut().unwrap().half_track_m *= 1.1;
    noisy.gyro.as_mut().unwrap().angle_random_walk_rad_sqrt_s *= 3.0;
    for (what, real, late, sensor) in
        [("wide", &wide, false, "wheel_left"), ("late", &config, true, "wheel_left"), ("noisy", &noisy, false, "gyro")]
    {
        // with torques: without them the unknown accelerations take what the wheels say too much, and the lower bound is zero
        let mut log = recorded(real, Course::Random, 7).log;
        let wheels = log.channels.iter_mut().filter(|c| late && c.name.starts_with("wheel"));
        wheels.for_each(|c| shift(&mut c.values));
        let judged = run(&config, &log, &Settings::default()).unwrap().summary.consistency;
        let found = judged.sensors.iter().find(|s| s.sensor == sensor).unwrap();
        assert!(!judged.fit_for_use && !found.fit_for_use, "{what}: {:?}", judged.sensors);
    }
}

/// A robot that knows its gyro's error badly when it sets out, and learns it from noisy wheels.
fn learning() -> Config {
    let text = ROBOT.replace("turn_on_bias_std_rad_s = 2e-4", "turn_on_bias_std_rad_s = 5e-3");
    Config::parse(&text.replace("std_rad_s = 0.02\n", "std_rad_s = 0.2\n"), "robot.toml").unwrap()
}

fn steps(pose: &gyroid::signal::Log) -> Vec<f64> {
    let [x, y] = [names::X, names::Y].map(|name| pose.require(name).unwrap());
    x.windows(2).zip(y.windows(2)).map(|(x, y)| (x[1] - x[0]).hypot(y[1] - y[0])).collect()
}

#[test]
fn given_the_whole_drive_the_path_does_not_jump() {
    let config = learning();
    for seed in 0..4 {
        let Drive { log, truth, .. } = recorded(&config, Course::Random, seed);
        let Run { pose, smoothed, .. } = run(&config, &log, &Settings { smooth: true, ..Settings::default() }).unwrap();
        let smoothed = smoothed.unwrap().pose;
        let speed = smoothed.require("speed_m_s").unwrap();
        // a row's step is its way and what its process noise moves: no retraction of the way before
        let far = |steps: &[f64]| {
            steps.iter().zip(speed).map(|(step, v)| step - v.abs() * 0.02).fold(0.0, |most: f64, d| most.max(d))
        };
        let (before, after) = (far(&steps(&pose)), far(&steps(&smoothed)));
        assert!(after < 0.1 * before, "{before} {after}");
        let length = |pose| steps(pose).iter().sum::<f64>();
        let (driven, found) = (length(&truth), length(&smoothed));
        assert!((found / driven - 1.0).abs() < 0.02, "{driven} {found}");
        // at the last row all readings are those up to it
        for name in [names::X, names::Y, names::HEADING, "heading_std_rad"] {
            let last = |log: &gyroid::signal::Log| *log.require(name).unwrap().last().unwrap();
            assert_eq!(last(&pose), last(&smoothed), "{name}");
        }
    }
}

#[test]
fn given_the_whole_drive_heading_and_gyro_error_are_as_sure_as_they_say() {
    let config = learning();
    let rows: Vec<[f64; 3]> = (0..RUNS)
        .into_par_iter()
        .map(|seed| {
            let Drive { log, truth, .. } = recorded(&config, Course::Random, seed);
            let found = run(&config, &log, &Settings { smooth: true, ..Settings::default() }).unwrap();
            let smoothed = found.smoothed.unwrap().pose;
            let k = log.len() / 2;
            let at = |log: &gyroid::signal::Log, name: &str| log.require(name).unwrap()[k];
            let of = |name, std| (at(&smoothed, name) - at(&truth, name)) / at(&smoothed, std);
            let surer = at(&smoothed, "gyro_error_std_rad_s") / at(&found.pose, "gyro_error_std_rad_s");
            [of(names::HEADING, "heading_std_rad"), of("gyro_error_rad_s", "gyro_error_std_rad_s"), surer]
        })
        .collect();
    let chi = ChiSquared::new(RUNS as f64).unwrap();
    for i in 0..2 {
        let sum: f64 = rows.iter().map(|r| r[i] * r[i]).sum();
        assert!(sum > chi.inverse_cdf(5e-7) && sum < chi.inverse_cdf(1.0 - 5e-7), "{i}: {sum}");
    }
    assert!(rows.iter().all(|r| r[2] < 1.0));
}

#[test]
fn a_filter_that_is_not_fit_for_use_says_so_writes_its_pose_and_withholds_the_configuration() {
    let wide = ROBOT.replace("half_track_m = 0.17", "half_track_m = 0.2");
    let p = Place::with(&[("robot.toml", ROBOT), ("wide.toml", &wide)]);
    p.ok("simulate wide.toml --course random --duration 60 --start-offset 20 -o drive.parquet");
    let sound = p.ok("navigate wide.toml drive.parquet -o a.parquet --save-config after.toml");
    assert!(!sound.contains("NOT FIT") && sound.contains("smoothed") && p.has("after.toml"), "{sound}");

    let done = p.run("navigate robot.toml drive.parquet -o b.parquet --plot b.svg --json b.json --save-config no.toml");
    let text = String::from_utf8(done.stdout).unwrap();
    assert_eq!(done.status.code(), Some(3), "{text}");
    for part in
        ["NOT FIT FOR USE", "wheel_", "no.toml not written", "--accept", "gap diagnose robot.toml --fit drive.parquet"]
    {
        assert!(text.contains(part), "{text} lacks {part}");
    }
    assert!(p.has("b.parquet") && p.has("b.svg") && !p.has("no.toml"));
    let json: serde_json::Value = serde_json::from_str(&p.read("b.json")).unwrap();
    assert_eq!((&json["schema"], &json["fit_for_use"]), (&"gyroid.navigate/1".into(), &false.into()));
    for sensor in json["with_error_model"]["consistency"]["sensors"].as_array().unwrap() {
        let [low, high] = [0, 1].map(|i| sensor["nis_mean_bounds999"][i].as_f64().unwrap());
        let inside = (low..=high).contains(&sensor["nis_mean"].as_f64().unwrap());
        assert_eq!(sensor["fit_for_use"], inside, "{sensor}");
    }
    p.ok("navigate robot.toml drive.parquet --save-config yes.toml --accept");
    assert!(p.has("yes.toml"));
    // as the robot knew it on its way
    p.ok("navigate wide.toml drive.parquet --filtered -o c.parquet");
    let [all, some] = ["a.parquet", "c.parquet"].map(|f| gyroid::ingest::read_log(p.path(f)).unwrap());
    let sum = |log: &gyroid::signal::Log| log.require("x_std_m").unwrap().iter().sum::<f64>();
    assert!(sum(&all) < sum(&some));
}
