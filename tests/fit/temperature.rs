//! The gyro's error by temperature as a user meets it: `fit`, `validate` and `navigate`.

use crate::common::{data, gyroid, run, warm_up_csv};
use gyroid::config::Config;
use gyroid::ingest::write_log;
use gyroid::math::random::Stream;
use gyroid::signal::{Log, names};
use gyroid::simulate::{Course, Options, drive};
use serde_json::Value;
use std::f64::consts::TAU;
use std::fs;
use std::path::{Path, PathBuf};

const SLOPE: f64 = 3e-4;
const BIAS_AT_25: f64 = -4e-3;
const SIGMA: f64 = 3e-4;

fn error(temperature_c: f64) -> f64 {
    BIAS_AT_25 + SLOPE * (temperature_c - 25.0)
}

/// An hour and more at 1 Hz in a room that warms and cools, the gyro's error a line in the temperature.
fn write(dir: &Path, name: &str, seed: u64, middle_c: f64, with_temperature: bool) -> PathBuf {
    let mut draw = Stream::new(seed, 0);
    let mut text =
        String::from(if with_temperature { "t_s,gyro_z_rad_s,temperature_c\n" } else { "t_s,gyro_z_rad_s\n" });
    for i in 0..5000 {
        let temperature = middle_c + 6.0 * (TAU * f64::from(i) / 2500.0).sin();
        let rate = error(temperature) + SIGMA * draw.normal();
        text += &match with_temperature {
            true => format!("{i},{rate},{temperature:.2}\n"),
            false => format!("{i},{rate}\n"),
        };
    }
    let path = dir.join(name);
    fs::write(&path, text).unwrap();
    path
}

fn json(arguments: &[&str]) -> (i32, Value, String) {
    let (code, out, err) = run(gyroid().args(arguments).args(["--json", "-"]));
    (code, serde_json::from_str(&out).unwrap_or(Value::Null), err)
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn the_report_says_which_of_time_and_temperature_and_how_much() {
    let dir = tempfile::tempdir().unwrap();
    let log = write(dir.path(), "room.csv", 1, 25.0, true);
    let (_, found, err) = json(&["fit", text(&log), "--no-plot"]);
    let temperature = &found["temperature"];
    assert_eq!(
        (&found["against"], &temperature["explanation"]["decided"]),
        (&"time".into(), &"temperature".into()),
        "{err}"
    );
    let slope = &temperature["parameters"]["sensitivity_rad_s_k"];
    let (estimate, std) = (slope["estimate"].as_f64().unwrap(), slope["std"].as_f64().unwrap());
    assert!((estimate - SLOPE).abs() < 4.0 * std, "{slope}");
    // white noise on a sine of 6 K: σ / (6 K sqrt(n/2)), wider by what a walk could add
    let white = SIGMA / (6.0 * 2500f64.sqrt());
    assert!(std > 0.9 * white && std < 2.0 * white, "{std} {white}");
    let (_, said, _) = run(gyroid().args(["fit", text(&log), "--no-plot"]));
    assert!(said.contains("temperature explains what drifts") && said.contains("--against temperature"), "{said}");
    // a log without one says nothing of it
    let (_, plain, _) = json(&["fit", text(&write(dir.path(), "plain.csv", 1, 25.0, false)), "--no-plot"]);
    assert_eq!(plain["temperature"], Value::Null);
}

#[test]
fn a_model_by_temperature_explains_another_log_and_asks_for_the_temperature() {
    let dir = tempfile::tempdir().unwrap();
    let log = write(dir.path(), "room.csv", 2, 25.0, true);
    let config = dir.path().join("g.toml");
    let fit = |extra: &[&str]| {
        let arguments = ["fit", text(&log), "--against", "temperature", "--out", text(&config)];
        json(&[&arguments[..], extra].concat())
    };
    let (code, found, err) = fit(&[]);
    assert_eq!(
        (code, &found["verdict"], &found["against"]),
        (0, &"fit_for_use".into(), &"temperature".into()),
        "{err}"
    );
    assert!(config.with_extension("png").exists());
    let read = Config::read(&config).unwrap();
    let table = read.require_gyro().unwrap().temperature.unwrap();
    assert_eq!(
        Some(table.sensitivity_rad_s_k),
        found["temperature"]["parameters"]["sensitivity_rad_s_k"]["estimate"].as_f64()
    );
    let std = table.covariance.unwrap().bias_bias_rad2_s2.sqrt();
    assert!((table.bias_rad_s - error(table.reference_c)).abs() < 4.0 * std);

    // another day, three degrees warmer
    let other = write(dir.path(), "other.csv", 3, 28.0, true);
    let (code, check, err) = json(&["validate", text(&config), text(&other)]);
    assert_eq!((code, &check["against"], &check["explained"]), (0, &"temperature".into(), &true.into()), "{err}");
    assert!(check["offset_rad_s"].as_f64().unwrap().abs() < 5.0 * check["offset_expected_std_rad_s"].as_f64().unwrap());
    assert_eq!(check["inside_valid_temperature"], Value::Bool(false), "it is warmer than a tenth of the range allows");
    // read once, and not held
    let (code, once, _) = json(&["validate", text(&config), text(&other), "--memory", "0"]);
    assert_eq!((code, &once["explained"]), (0, &true.into()));
    let near = |key: &str| once[key].as_f64().unwrap() / check[key].as_f64().unwrap() - 1.0;
    assert!(near("residual_std_rad_s").abs() < 1e-3);
    // by elapsed time it would be a drift that nothing explains
    let (code, by_time, _) = json(&["validate", text(&config), text(&other), "--against", "time"]);
    assert_eq!((code, &by_time["white"], &by_time["against"]), (3, &false.into(), &"time".into()));

    let plain = write(dir.path(), "plain.csv", 4, 25.0, false);
    let (code, _, err) = json(&["validate", text(&config), text(&plain)]);
    assert!(code == 1 && err.contains("temperature") && err.contains("--against time"), "{code} {err}");
    // a simulator has no thermometer, and says so
    let out = dir.path().join("sim.csv");
    let (code, said, err) = run(gyroid().args(["simulate", text(&config), "-o", text(&out)]));
    assert!(code == 0 && said.contains("[gyro.temperature] is not used here"), "{said} {err}");
}

#[test]
fn what_cannot_be_fitted_against_temperature_is_refused_with_a_mend() {
    let dir = tempfile::tempdir().unwrap();
    let plain = write(dir.path(), "plain.csv", 5, 25.0, false);
    let (code, _, err) = json(&["fit", text(&plain), "--against", "temperature"]);
    assert!(code == 1 && err.contains("plain.csv") && err.contains("temperature_c") && err.contains("hint"), "{err}");
    let log = write(dir.path(), "room.csv", 5, 25.0, true);
    let (code, _, err) = json(&["fit", text(&log), "--against", "temperature", "--loss", "huber"]);
    assert!(code == 2 && err.contains("--loss"), "{err}");
    let (code, _, err) = json(&["fit", text(&log), text(&plain), "--against", "temperature"]);
    assert!(code == 2 && err.contains("--against"), "{err}");
    // a temperature that has no effect is no model
    let mut draw = Stream::new(9, 0);
    let mut rows = String::from("t_s,gyro_z_rad_s,temperature_c\n");
    for i in 0..3000 {
        rows += &format!("{i},{},{}\n", SIGMA * draw.normal(), 25.0 + (TAU * f64::from(i) / 1500.0).sin());
    }
    let none = dir.path().join("none.csv");
    fs::write(&none, rows).unwrap();
    let config = dir.path().join("none.toml");
    let (code, found, _) = json(&["fit", text(&none), "--against", "temperature", "--out", text(&config)]);
    assert_eq!((code, &found["verdict"]), (3, &"no_temperature_effect".into()));
    assert!(!config.exists());
    // a thermometer that stands still is a note, and no obstacle to the fit by time
    let still = dir.path().join("still.csv");
    let warm = warm_up_csv(3, 4000);
    let with =
        warm.lines().enumerate().map(|(i, l)| format!("{l},{}\n", if i == 0 { "temperature_c" } else { "25.0" }));
    fs::write(&still, with.collect::<String>()).unwrap();
    let (_, found, err) = json(&["fit", text(&still), "--no-plot"]);
    let notes = found["log"]["notes"].to_string();
    assert!(notes.contains("not held against temperature") && notes.contains("25.00 °C throughout"), "{notes} {err}");
    assert!(found["temperature"].is_null() && found["parameters"]["c1_rad_s"]["estimate"].is_number());
}

#[test]
fn the_cold_soak_of_a_real_gyro_is_told_apart_or_said_to_be_undecided() {
    let (_, found, err) = json(&["fit", text(&data("cats_coldsoak_a.csv")), "--axis", "x", "--no-plot"]);
    let temperature = &found["temperature"];
    // cooled by 13 K over an hour and a half: an effect that no noise explains
    assert_eq!(temperature["found"], Value::Bool(true), "{err}");
    let all = temperature["explanation"]["explanations"].as_array().unwrap();
    let sum: f64 = all.iter().map(|e| e["probability"].as_f64().unwrap()).sum();
    assert!((sum - 1.0).abs() < 1e-9);
    let best = &all[0];
    let decided = &temperature["explanation"]["decided"];
    assert!(decided.is_null() || decided == &best["explanation"]);
}

#[test]
fn a_drive_goes_by_its_temperature() {
    let dir = tempfile::tempdir().unwrap();
    let room = write(dir.path(), "room.csv", 6, 25.0, true);
    let config = dir.path().join("robot.toml");
    let (code, ..) = json(&[
        "fit",
        text(&room),
        "--against",
        "temperature",
        "--no-plot",
        "--base",
        text(&data("robot.toml")),
        "--out",
        text(&config),
    ]);
    assert_eq!(code, 0);
    let truth = Config::read(data("truth.toml")).unwrap();
    let mut constant = truth.clone();
    let gyro = constant.gyro.as_mut().unwrap();
    (gyro.c1_rad_s, gyro.c2_rad_s) = (0.0, 0.0);
    // as noisy as the log that was fitted
    gyro.angle_random_walk_rad_sqrt_s = Config::read(&config).unwrap().gyro.unwrap().angle_random_walk_rad_sqrt_s;
    let recorded = drive(&constant, Course::Square, 60.0, &Options::from(1)).unwrap().log;
    let temperature: Vec<f64> = (0..recorded.len()).map(|i| 22.0 + 0.1 * recorded.time.at(i)).collect();
    let mut log = Log::new("drive", recorded.time.clone());
    for c in &recorded.channels {
        let hot = |(rate, t): (&f64, &f64)| if c.name == names::GYRO_Z { rate + error(*t) } else { *rate };
        log.push(&c.name, c.values.iter().zip(&temperature).map(hot).collect()).unwrap();
    }
    let cold = dir.path().join("cold.csv");
    write_log(&cold, &log).unwrap();
    log.push(names::TEMPERATURE, temperature).unwrap();
    let drive = dir.path().join("drive.csv");
    write_log(&drive, &log).unwrap();

    let (code, found, err) = json(&["navigate", text(&config), text(&drive)]);
    assert_eq!(code, 0, "{err}");
    let notes = found["with_error_model"]["notes"].to_string();
    assert!(notes.contains("by temperature, 22.0 to 28.0"), "{notes}");
    let e = &found["with_error_model"]["final_pose"]["gyro_error_rad_s"];
    let (estimate, std) = (e["estimate"].as_f64().unwrap(), e["std"].as_f64().unwrap());
    assert!((estimate - error(28.0)).abs() < 5.0 * std, "{e}");
    let (code, _, err) = json(&["navigate", text(&config), text(&cold)]);
    assert!(code == 1 && err.contains("temperature_c") && err.contains("--map"), "{code} {err}");
}

#[test]
fn a_temperature_that_is_logged_now_and_then_is_enough() {
    let dir = tempfile::tempdir().unwrap();
    let dense = write(dir.path(), "room.csv", 8, 25.0, true);
    let thinned = |(i, line): (usize, &str)| match i {
        i if i == 0 || i % 10 == 1 => format!("{line}\n"),
        _ => format!("{},\n", &line[..line.rfind(',').unwrap()]),
    };
    let sparse = dir.path().join("sparse.csv");
    fs::write(&sparse, fs::read_to_string(&dense).unwrap().lines().enumerate().map(thinned).collect::<String>())
        .unwrap();
    let slope = |path: &Path| {
        let (_, found, err) = json(&["fit", text(path), "--no-plot"]);
        let s = found["temperature"]["parameters"]["sensitivity_rad_s_k"].clone();
        (s["estimate"].as_f64().expect(&err), s["std"].as_f64().unwrap())
    };
    let ((a, std), (b, _)) = (slope(&dense), slope(&sparse));
    assert!((a - b).abs() < 0.05 * std, "{a} {b}");
}
