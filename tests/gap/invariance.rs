//! An answer depends on what was recorded, not on how it was written down: units, formats, one file or several, their order, threads.

use crate::place::Place;
use crate::robots::{REST, driving};
use gyroid::ingest::{read_log, write_log};
use gyroid::signal::Log;
use serde_json::Value;

const TONE: &str = "[[effect]]\nid = \"gyro.tone\"\nfrequency_hz = 0.21\namplitude_rad_s = 2e-4\n";
const GAIN: &str = "[[effect]]\nid = \"gyro.scale_factor\"\nrelative = 0.03\n";

fn answer(place: &Place, line: &str) -> Value {
    serde_json::from_str(&place.ok(&format!("gap diagnose {line} --json -"))).unwrap()
}

/// Numbers agree to this share, and all else is the same; `beside` are keys that tell of files.
#[track_caller]
fn same(found: &Value, wanted: &Value, share: f64, beside: &[&str], path: &str) {
    match (found, wanted) {
        (Value::Object(found), Value::Object(wanted)) => {
            assert_eq!(found.keys().collect::<Vec<_>>(), wanted.keys().collect::<Vec<_>>(), "{path}");
            let told = wanted.iter().filter(|(key, _)| !beside.contains(&key.as_str()));
            told.for_each(|(key, wanted)| same(&found[key], wanted, share, beside, &format!("{path}.{key}")));
        }
        (Value::Array(found), Value::Array(wanted)) => {
            assert_eq!(found.len(), wanted.len(), "{path}");
            found.iter().zip(wanted).for_each(|(found, wanted)| same(found, wanted, share, beside, path));
        }
        (Value::Number(found), Value::Number(wanted)) => {
            let (found, wanted) = (found.as_f64().unwrap(), wanted.as_f64().unwrap());
            assert!((found - wanted).abs() <= share * wanted.abs().max(1e-6), "{path}: {found} for {wanted}");
        }
        _ => assert_eq!(found, wanted, "{path}"),
    }
}

/// The gyro in °/s and milliseconds, in another order of columns.
fn in_degrees(log: &Log) -> String {
    let rates = log.get("gyro_z_rad_s").unwrap();
    let rows = rates.iter().enumerate().map(|(k, rate)| {
        // decimals to the last bit
        format!("{:?},{:?}\n", rate.to_degrees(), log.time.at(k) * 1e3)
    });
    format!("gyro_z_deg_s,time_ms\n{}", rows.collect::<String>())
}

#[test]
fn a_log_at_rest_has_one_answer_in_any_unit_and_format() {
    let place = Place::with(&[("sim.toml", REST), ("real.toml", &format!("{REST}{TONE}"))]);
    place.ok("simulate real.toml --duration 1500 --seed 5 -o log.parquet");
    let log = read_log(place.path("log.parquet")).unwrap();
    write_log(place.path("log.csv"), &log).unwrap();
    place.write("degrees.csv", &in_degrees(&log));
    let whole = answer(&place, "sim.toml --fit log.parquet");
    assert_eq!(whole["main"], "gyro.tone");
    same(&answer(&place, "sim.toml --fit log.csv"), &whole, 0.0, &["notes"], "");
    // rounded to other floats: evidence and sizes move by what a search leaves
    let degrees = answer(&place, "sim.toml --fit degrees.csv --unit deg/s --time-unit ms");
    for key in ["verdict", "main", "cannot_tell_apart"] {
        assert_eq!(degrees[key], whole[key], "{key}");
    }
    same(&degrees["main_probability"], &whole["main_probability"], 1e-3, &[], "main_probability");
    same(&degrees["effects"], &whole["effects"], 1e-2, &["probability", "gap_closed"], "effects");
}

#[test]
fn a_drive_has_one_answer_in_one_file_or_several_in_any_order() {
    let robot = driving(50.0, 0.01);
    let place = Place::with(&[("sim.toml", &robot), ("real.toml", &format!("{robot}{GAIN}"))]);
    place.ok("simulate real.toml --course random --duration 30 --seed 6 -o whole.parquet");
    let log = read_log(place.path("whole.parquet")).unwrap();
    let part = |name: &str, of: &[&str]| {
        let mut log = log.clone();
        log.channels.retain(|c| of.iter().any(|start| c.name.starts_with(start)));
        write_log(place.path(name), &log).unwrap();
    };
    part("imu.csv", &["gyro_"]);
    part("wheels.parquet", &["wheel_", "torque_"]);
    part("rest.csv", &["x_m", "y_m", "heading_rad", "time_since"]);
    let whole = answer(&place, "sim.toml --fit whole.parquet");
    assert_eq!(whole["main"], "gyro.scale_factor");
    for files in ["imu.csv wheels.parquet rest.csv", "rest.csv imu.csv wheels.parquet"] {
        let parts = answer(&place, &format!("sim.toml --fit {files}"));
        same(&parts, &whole, 0.0, &["notes", "source"], "");
    }
}

/// Sums are taken in one order whatever the number of threads.
#[test]
fn one_thread_gives_the_bytes_of_many() {
    let robot = driving(50.0, 0.01);
    let place = Place::with(&[("rest.toml", REST), ("robot.toml", &robot), ("real.toml", &format!("{robot}{GAIN}"))]);
    place.ok("simulate rest.toml --duration 900 --seed 7 -o rest.parquet");
    let with = |threads: &str, line: &str| {
        let mut command = assert_cmd::Command::cargo_bin("gyroid").unwrap();
        command.current_dir(place.path("")).env("RAYON_NUM_THREADS", threads).env("POLARS_MAX_THREADS", threads);
        let output = command.args(line.split(' ')).output().unwrap();
        assert!(matches!(output.status.code(), Some(0 | 3)), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        output.stdout
    };
    let lines = [
        "simulate real.toml --course random --duration 20 --seed 6 --force --json - -o drive.parquet",
        "fit rest.parquet --no-plot --json -",
        "noise rest.parquet --draws 99 --json -",
        "gap diagnose rest.toml --fit rest.parquet --json -",
        "gap diagnose robot.toml --fit drive.parquet --json -",
        "navigate robot.toml drive.parquet --json -",
    ];
    for line in lines {
        let (one, many) = (with("1", line), with("5", line));
        assert!(one == many, "{line}:\n{}\n{}", String::from_utf8_lossy(&one), String::from_utf8_lossy(&many));
    }
}
