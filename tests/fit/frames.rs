//! How a sensor is mounted, what of its bias is the Earth's, and several sensors in one log, as a user meets them.

use crate::common::{self, data, gyroid, run};
use assert_cmd::Command;
use gyroid::ErrorKind;
use gyroid::bias::EARTH_RATE_RAD_S;
use gyroid::config::Config;
use gyroid::ingest::{
    DriveQuery, DriveRecording, GyroQuery, Mounting, Reading, read_drive, read_gyro, read_gyro_within, read_log,
};
use gyroid::math::random::Stream;
use gyroid::signal::names;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

const SAMPLES: usize = 4000;
const STEP_S: f64 = 0.5;
/// Latitude of Genoa.
const LATITUDE_DEG: f64 = 44.4;

type Matrix = [[f64; 3]; 3];

fn product(a: Matrix, b: Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// From the sensor to the robot: first roll, then pitch, then yaw, about the robot's axes.
fn rotation(roll_deg: f64, pitch_deg: f64, yaw_deg: f64) -> Matrix {
    let of = |deg: f64| deg.to_radians().sin_cos();
    let ((sr, cr), (sp, cp), (sy, cy)) = (of(roll_deg), of(pitch_deg), of(yaw_deg));
    let x = [[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]];
    let y = [[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]];
    let z = [[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]];
    product(z, product(y, x))
}

/// Rates of the robot's axes: z warms up (C1 2e-3, C2 -5e-3 and `earth` rad/s, T 200 s), the others stand.
fn rates(earth: f64) -> Vec<[f64; 3]> {
    let mut draw = Stream::new(11, 0);
    (0..SAMPLES)
        .map(|i| {
            let z = -5e-3 + earth - 2e-3 * (-(STEP_S * i as f64) / 200.0).exp_m1();
            [3e-3, -1e-3, z].map(|mean| mean + 3e-4 * draw.normal())
        })
        .collect()
}

/// A log of a sensor that is turned against the robot by `rotation`, with its accelerometer.
fn turned_log(path: &Path, rotation: &Matrix, earth: f64) {
    let mut text = String::from("t_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2\n");
    // the inverse of a rotation is its transpose
    let seen = |v: [f64; 3]| -> [f64; 3] { std::array::from_fn(|j| (0..3).map(|i| rotation[i][j] * v[i]).sum()) };
    for (i, robot) in rates(earth).into_iter().enumerate() {
        let ([x, y, z], [a, b, c]) = (seen(robot), seen([0.0, 0.0, 9.81]));
        text += &format!("{},{x},{y},{z},{a},{b},{c}\n", STEP_S * i as f64);
    }
    fs::write(path, text).unwrap();
}

fn json(command: &mut Command) -> (i32, Value) {
    let (code, out, err) = run(command.args(["--json", "-"]));
    (code, serde_json::from_str(&out).unwrap_or_else(|e| panic!("{e}: {out} {err}")))
}

fn fit(log: &Path, arguments: &[&str]) -> Value {
    let (code, json) =
        json(gyroid().arg("fit").arg(log).args(["--no-plot", "--accept", "--draws", "99"]).args(arguments));
    assert_eq!(code, 0, "{json:#}");
    json
}

fn number(json: &Value, pointer: &str) -> f64 {
    json.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("{pointer} in {json:#}"))
}

/// Every parameter, with its deviation, the same to the rounding of a rotation there and back.
fn same_fit(a: &Value, b: &Value) {
    for parameter in ["c1_rad_s", "c2_rad_s", "time_constant_s"] {
        for part in ["estimate", "std"] {
            let at = format!("/parameters/{parameter}/{part}");
            let (a, b) = (number(a, &at), number(b, &at));
            assert!((a / b - 1.0).abs() < 1e-9, "{at}: {a} {b}");
        }
    }
}

fn notes(json: &Value) -> String {
    json["log"]["notes"].to_string()
}

#[test]
fn a_turned_sensor_gives_the_robot_s_fit() {
    let dir = tempfile::tempdir().unwrap();
    let (straight, turned) = (dir.path().join("straight.csv"), dir.path().join("turned.csv"));
    turned_log(&straight, &rotation(0.0, 0.0, 0.0), 0.0);
    turned_log(&turned, &rotation(30.0, -20.0, 75.0), 0.0);
    let wanted = fit(&straight, &[]);
    let found = fit(&turned, &["--mounting", "30,-20,75"]);
    same_fit(&found, &wanted);
    assert_eq!(found["log"]["column"], "robot_gyro_z");
    let said = notes(&found);
    assert!(
        said.contains("robot_gyro_z = 0.342020 gyro_x_rad_s + 0.469846 gyro_y_rad_s + 0.813798 gyro_z_rad_s"),
        "{said}"
    );
    assert!(said.contains("lies 0.0° from the vertical"), "{said}");
    // read once, another axis of the robot, and one that points down
    same_fit(&fit(&turned, &["--mounting", "30,-20,75", "--memory", "0"]), &fit(&straight, &["--memory", "0"]));
    let (x, down) = (["--mounting", "30,-20,75", "--axis", "x"], ["--mounting", "30,-20,75", "--axis", "-z"]);
    let mean = number(&fit(&turned, &x), "/parameters/c2_rad_s/estimate");
    let straight_x = number(&fit(&straight, &["--axis", "x"]), "/parameters/c2_rad_s/estimate");
    assert!((mean / straight_x - 1.0).abs() < 1e-6, "{mean} {straight_x}");
    let turned_down = number(&fit(&turned, &down), "/parameters/c1_rad_s/estimate");
    assert!((turned_down / number(&wanted, "/parameters/c1_rad_s/estimate") + 1.0).abs() < 1e-9);
    // half angles of a roll of 30 degrees
    let rolled = dir.path().join("rolled.csv");
    turned_log(&rolled, &rotation(30.0, 0.0, 0.0), 0.0);
    let (s, c) = 15f64.to_radians().sin_cos();
    same_fit(&fit(&rolled, &["--mounting-quaternion", &format!("{s},0,0,{c}")]), &wanted);
    // gravity contradicts a wrong mounting, and says the right one
    let said = notes(&fit(&turned, &["--mounting", "0,0,0"]));
    assert!(said.contains("lies 35.5°") && said.contains("roll 30.0 and pitch -20.0"), "{said}");
    // the other commands that read a log at rest
    let config = dir.path().join("gyroid.toml");
    let written = fit(&straight, &["-o", config.to_str().unwrap()]);
    assert!(written["earth"].is_null());
    let (code, checked) =
        json(gyroid().arg("validate").arg(&config).arg(&turned).args(["--mounting", "30,-20,75", "--draws", "99"]));
    assert!(code == 0 || code == 3, "{checked:#}");
    assert_eq!(checked["log"]["column"], "robot_gyro_z", "{checked:#}");
    let (code, noise) = json(gyroid().arg("noise").arg(&turned).args(["--mounting", "30,-20,75", "--draws", "99"]));
    assert!(code == 0 || code == 3, "{noise:#}");
    let density = noise["terms"].as_array().unwrap().iter().find(|t| t["id"] == "angle_random_walk").unwrap();
    // 3e-4 rad/s a sample of half a second; the estimate of 4000 samples is known to 1 %
    assert!((number(density, "/estimate") / (3e-4 * STEP_S.sqrt()) - 1.0).abs() < 0.1, "{density}");
}

#[test]
fn a_turned_log_is_held_and_read_once_alike() {
    let dir = tempfile::tempdir().unwrap();
    let log = dir.path().join("turned.csv");
    turned_log(&log, &rotation(-100.0, 40.0, 10.0), 0.0);
    let mounting = Mounting::from_roll_pitch_yaw_deg([-100.0, 40.0, 10.0]).unwrap();
    let query = GyroQuery { mounting: Some(mounting), ..GyroQuery::default() };
    let whole = read_gyro(&log, &query).unwrap();
    let held = whole.log.require(names::GYRO_Z).unwrap();
    for (found, [_, _, z]) in held.iter().zip(rates(0.0)) {
        // three products of numbers below 1e-2, each rounded once
        assert!((found - z).abs() < 1e-17, "{found} {z}");
    }
    let Reading::Streamed(once) = read_gyro_within(&log, &query, 0, &mut |_| ()).unwrap() else { panic!("was held") };
    assert_eq!(once.log.stretches[0].values, held);
    let of_mounting = |notes: &[String]| notes.iter().filter(|n| n.contains("robot")).cloned().collect::<Vec<_>>();
    assert_eq!(of_mounting(&once.notes), of_mounting(&whole.notes));
    assert_eq!(of_mounting(&once.notes).len(), 2);
    // right angles are exact: on its back the rate only changes its sign
    let back = GyroQuery { mounting: Some(Mounting::from_roll_pitch_yaw_deg([180.0, 0.0, 33.0]).unwrap()), ..query };
    let turned = GyroQuery { reversed: true, ..GyroQuery::default() };
    let values = |query: &GyroQuery| read_gyro(&log, query).unwrap().log.require(names::GYRO_Z).unwrap().to_vec();
    assert_eq!(values(&back), values(&turned));
}

#[test]
fn mountings_that_cannot_be_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let log = dir.path().join("yaw.csv");
    fs::write(&log, common::warm_up_csv(1, 100)).unwrap();
    let refused = |arguments: &[&str], code: i32, parts: &[&str]| {
        let (found, _, err) = run(gyroid().arg("fit").arg(&log).args(arguments));
        assert!(found == code && parts.iter().all(|p| err.contains(p)), "{arguments:?}: {found} {err}");
    };
    refused(&["--mounting", "10,0,0"], 1, &["no column of the gyro's y axis", "t_s, gyro_z_rad_s", "axes"]);
    refused(&["--mounting", "10,0"], 2, &["three angles"]);
    refused(&["--mounting", "a,b,c"], 2, &["three angles"]);
    refused(&["--mounting-quaternion", "0,0,1"], 2, &["four numbers"]);
    refused(&["--mounting-quaternion", "0,0,1,1"], 2, &["1.41", "not 1", "x, y, z, w"]);
    refused(&["--mounting", "0,0,0", "--mounting-quaternion", "0,0,0,1"], 2, &["--mounting"]);
    refused(&["--mounting", "10,0,0", "--column", "gyro_z_rad_s"], 2, &["--column"]);
    // what turns about the vertical alone needs no other axis
    let half = fit(&log, &["--mounting", "180,0,0"]);
    assert!(notes(&half).contains("robot_gyro_z = -gyro_z_rad_s"));
    // a gyro whose only column says no axis has one
    fs::write(&log, common::warm_up_csv(1, 100).replace("gyro_z_rad_s", "gyro_rad_s")).unwrap();
    refused(&["--mounting", "10,20,0"], 1, &["the only gyro", "no axis"]);
    // units that differ cannot be added
    fs::write(&log, "t_s,gx_rad_s,gy_deg_s,gz_rad_s\n0,1,2,3\n1,2,3,1\n2,1,1,2\n3,1,2,1\n").unwrap();
    refused(&["--mounting", "10,20,0"], 1, &["different units", "rad_s", "deg_s"]);
    let both = GyroQuery { column: Some("gx_rad_s".into()), mounting: Some(Mounting::ALIGNED), ..GyroQuery::default() };
    assert_eq!(read_gyro(&log, &both).unwrap_err().kind, ErrorKind::Usage);
}

#[test]
fn the_latitude_parts_c2_into_bias_and_earth() {
    let dir = tempfile::tempdir().unwrap();
    let (log, config) = (dir.path().join("log.csv"), dir.path().join("gyroid.toml"));
    let earth = 7.292_115e-5 * LATITUDE_DEG.to_radians().sin();
    turned_log(&log, &rotation(0.0, 0.0, 0.0), earth);
    let (robot, out) = (data("robot.toml"), config.to_str().unwrap());
    let found = fit(&log, &["--latitude", "44.4", "--base", robot.to_str().unwrap(), "-o", out]);
    let (c2, bias) = (&found["parameters"]["c2_rad_s"], &found["earth"]["bias_rad_s"]);
    assert!((number(&found, "/earth/earth_rate_rad_s") - earth).abs() < 1e-18);
    assert!((number(c2, "/estimate") - number(bias, "/estimate") - earth).abs() < 1e-17);
    assert!((number(c2, "/ci95/0") - number(bias, "/ci95/0") - earth).abs() < 1e-17);
    assert_eq!(c2["std"], bias["std"]);
    // of the bias alone, as it was simulated
    let off = (number(bias, "/estimate") + 5e-3).abs();
    assert!(off < 5.0 * number(bias, "/std"), "{off}");
    assert!(notes(&found).contains("z axis lies 0.0° from the vertical"), "{found:#}");

    // the filter's number is the sum, and stays
    let read = Config::read(&config).unwrap();
    let gyro = read.require_gyro().unwrap();
    assert_eq!(
        (gyro.c2_rad_s, gyro.earth_rate_rad_s),
        (number(c2, "/estimate"), Some(number(&found, "/earth/earth_rate_rad_s")))
    );
    let without = fit(&log, &[]);
    assert_eq!(number(&without, "/parameters/c2_rad_s/estimate"), gyro.c2_rad_s);
    let exported = |target: &str, key: &str| {
        let (code, json) = json(gyroid().arg("export").arg(&config).args(["--to", target, "--accept"]));
        assert_eq!(code, 0, "{json:#}");
        let keys = json["keys"].as_array().unwrap().clone();
        let value = &keys.iter().find(|k| k["key"] == key).unwrap_or_else(|| panic!("{key} in {keys:?}"))["value"];
        (number(value, "/2"), json["notes"].to_string())
    };
    let warm = gyro.c1_rad_s + gyro.c2_rad_s;
    let deg_h = 180.0 / std::f64::consts::PI * 3600.0;
    for (target, key) in [("kf-gins", "initgyrbias"), ("gnss-ins-sim", "gyro_b")] {
        let (value, notes) = exported(target, key);
        assert!((value / ((warm - earth) * deg_h) - 1.0).abs() < 1e-8, "{target}: {value}");
        assert!(notes.contains("taken off"), "{notes}");
    }
    // its world stands still
    let (value, notes) = exported("matlab", "ConstantBias");
    assert!((value / warm - 1.0).abs() < 1e-8 && notes.contains("ConstantBias keeps"), "{value} {notes}");

    let unsigned = Config { provenance: None, ..read.clone() }.to_toml().unwrap();
    let change = |line: &str| match line.starts_with("earth_rate_rad_s") {
        true => "earth_rate_rad_s = 1e-3\n".to_string(),
        false => format!("{line}\n"),
    };
    let wrong: String = unsigned.lines().map(change).collect();
    assert_ne!(wrong, unsigned);
    let error = Config::parse(&wrong, "g.toml").unwrap_err();
    assert!(error.to_string().contains("gyro.earth_rate_rad_s"), "{error}");
    assert!(Config::parse(&unsigned, "g.toml").is_ok());

    // south of the equator it turns the other way; a table of logs says it too
    let rows = fit(&log, &["--latitude", "-90", "--results", dir.path().join("r.csv").to_str().unwrap()]);
    assert_eq!(number(&rows["rows"][0], "/earth_rate_rad_s"), -EARTH_RATE_RAD_S);
    assert!(fs::read_to_string(dir.path().join("r.csv")).unwrap().contains("latitude_deg"));
}

#[test]
fn the_latitude_says_nothing_of_an_axis_that_lies_down() {
    let dir = tempfile::tempdir().unwrap();
    let log = dir.path().join("log.csv");
    // z of the robot is the sensor's y axis
    turned_log(&log, &rotation(90.0, 0.0, 0.0), 0.0);
    let refused = |arguments: &[&str], part: &str| {
        let (code, _, err) = run(gyroid().arg("fit").arg(&log).args(arguments));
        assert!(code == 2 && err.contains(part), "{arguments:?}: {code} {err}");
    };
    refused(&["--axis", "y", "--latitude", "44.4"], "depends on its heading");
    refused(&["--axis", "-x", "--latitude", "44.4", "--mounting", "90,0,0"], "axis -x lies down");
    refused(&["--axes", "y,z", "--latitude", "44.4"], "axis y lies down");
    refused(&["--latitude", "90.5"], "between -90 and 90");
    let found = fit(&log, &["--latitude", "44.4", "--mounting", "90,0,0"]);
    assert_eq!(found["log"]["column"], "robot_gyro_z");
    // without the mounting the accelerometer says that z is not the vertical
    let said = notes(&fit(&log, &["--latitude", "44.4"]));
    assert!(said.contains("lies 90.0°") && said.contains("roll 90.0 and pitch 0.0"), "{said}");
}

fn format_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats").join(name)
}

#[test]
fn every_gyro_of_a_log_is_a_row() {
    let dir = tempfile::tempdir().unwrap();
    let results = dir.path().join("results.csv");
    let log = format_file("px4.ulg");
    let saved = ["--topic", "all", "--results", results.to_str().unwrap(), "--resume"];
    let all = fit(&log, &saved);
    let rows = all["rows"].as_array().unwrap();
    let topics: Vec<&str> = rows.iter().map(|r| r["topic"].as_str().unwrap()).collect();
    assert_eq!(topics, ["sensor_combined/0", "sensor_gyro/0", "sensor_gyro/1", "vehicle_imu/0"]);
    for row in rows {
        let one = fit(&log, &["--topic", row["topic"].as_str().unwrap()]);
        for (ours, theirs) in [("c1_rad_s", "c1_rad_s"), ("time_constant_s", "time_constant_s")] {
            assert_eq!(row[ours], one["parameters"][theirs]["estimate"], "{row:#}");
        }
    }
    // each is a population of its own, and what was fitted is known again
    assert_eq!(all["populations"].as_array().unwrap().len(), 4);
    let again = fit(&log, &saved);
    assert_eq!((&again["resumed"], &again["rows"]), (&Value::from(4), &all["rows"]));
    let (code, out, err) =
        run(gyroid().arg("fit").arg(&log).args(["--topic", "all", "--draws", "99", "--axes", "z,x"]));
    assert_eq!((code, err.as_str()), (0, ""));
    let lines = out.lines().filter(|l| l.contains("px4.ulg")).count();
    assert!(lines == 8 && out.contains("topic") && out.contains("vehicle_imu/0"), "{out}");
    // some of them, and of several logs
    let two = fit(&log, &["--topic", "sensor_gyro/1", "--topic", "sensor_gyro/0"]);
    let named: Vec<&Value> = two["rows"].as_array().unwrap().iter().map(|r| &r["topic"]).collect();
    assert_eq!(named, ["sensor_gyro/1", "sensor_gyro/0"]);
    let table = dir.path().join("table.csv");
    fs::write(&table, common::warm_up_csv(2, 2000)).unwrap();
    let broken = dir.path().join("broken.mcap");
    fs::write(&broken, &fs::read(format_file("two_imus.mcap")).unwrap()[..4]).unwrap();
    let mut command = gyroid();
    command.arg("fit").arg(format_file("two_imus.mcap")).arg(&table).arg(&broken);
    let (code, mixed) = json(command.args(["--topic", "all", "--draws", "99"]));
    let rows = mixed["rows"].as_array().unwrap();
    let seen: Vec<(bool, Option<&str>)> = rows.iter().map(|r| (r["error"].is_null(), r["topic"].as_str())).collect();
    assert_eq!(seen, [(true, Some("/front/imu")), (true, Some("/rear/imu")), (true, None), (false, None)], "{mixed:#}");
    assert_eq!(code, 3);
    for (arguments, hint) in [(["-o", "g.toml"], "one log of one topic"), (["--config", "g.toml"], "--topic")] {
        let mut command = gyroid();
        let (code, _, err) =
            run(command.current_dir(dir.path()).arg("fit").arg(&log).args(["--topic", "all"]).args(arguments));
        assert!(code == 2 && err.contains(hint), "{arguments:?}: {code} {err}");
    }
}

#[test]
fn two_imus_of_a_robot_agree_once_each_is_turned() {
    let log = format_file("two_imus.mcap");
    let (code, _, err) = run(gyroid().arg("fit").arg(&log));
    assert!(code == 1 && err.contains("/front/imu") && err.contains("--topic all"), "{err}");
    let front = fit(&log, &["--topic", "/front/imu"]);
    // the one in the rear lies on its back
    for turned in [["--mounting", "180,0,0"], ["--axis", "-z"], ["--mounting-quaternion", "1,0,0,0"]] {
        let rear = fit(&log, &[&["--topic", "/rear/imu"], &turned[..]].concat());
        assert_eq!(rear["parameters"], front["parameters"], "{turned:?}");
    }
    let rear = fit(&log, &["--topic", "/rear/imu", "--latitude", "44.4"]);
    assert!(notes(&rear).contains("lies 180.0°") || notes(&rear).contains("lies 179.9°"), "{}", notes(&rear));
}

/// A drive whose gyro is turned as `rotation` says, which has the robot's axes in the frame of the sensor.
fn turned_drive(rotation: &[[f64; 3]; 3], unit: &str) -> String {
    let mut out = format!("t_s,gyro_x{unit},gyro_y{unit},gyro_z{unit},wheel_left_rad_s,wheel_right_rad_s\n");
    for i in 0..400 {
        let t = f64::from(i) * 0.05;
        let robot = [0.02 * (3.0 * t).sin(), 0.01 * (5.0 * t).cos(), 0.4 * (0.7 * t).sin()];
        let sensor: Vec<f64> = (0..3).map(|j| (0..3).map(|i| rotation[i][j] * robot[i]).sum()).collect();
        out += &format!("{t},{},{},{},4.0,4.5\n", sensor[0], sensor[1], sensor[2]);
    }
    out
}

#[test]
fn a_turned_gyro_of_a_drive_gives_the_robot_s_yaw_rate() {
    let dir = tempfile::tempdir().unwrap();
    let (straight, turned) = (dir.path().join("straight.csv"), dir.path().join("turned.csv"));
    fs::write(&straight, turned_drive(&rotation(0.0, 0.0, 0.0), "_rad_s")).unwrap();
    fs::write(&turned, turned_drive(&rotation(90.0, -20.0, 75.0), "_rad_s")).unwrap();
    let mounting = Some(Mounting::from_roll_pitch_yaw_deg([90.0, -20.0, 75.0]).unwrap());
    let query = DriveQuery { mounting, ..DriveQuery::default() };
    let found = read_drive(&[&turned], &query).unwrap();
    let wanted = read_drive(&[&straight], &DriveQuery::default()).unwrap();
    let yaw = |d: &DriveRecording| d.log.require(names::GYRO_Z).unwrap().to_vec();
    for (a, b) in yaw(&found).iter().zip(yaw(&wanted)) {
        assert!((a - b).abs() < 1e-12, "{a} {b}");
    }
    assert!(found.notes.iter().any(|n| n.contains("robot_gyro_z = ")), "{:?}", found.notes);
    // the rates of the sensor's own axes are not taken for the robot's
    assert!(found.log.get("gyro_x_rad_s").is_none());
    // the filter goes by it: unturned the robot would be somewhere else
    let config = data("truth.toml");
    let navigate = |log: &Path, more: &[&str]| {
        let out = dir.path().join("pose.csv");
        let (code, _, err) = run(gyroid().arg("navigate").arg(&config).arg(log).arg("--out").arg(&out).args(more));
        assert!(code == 0 || code == 3, "{err}");
        let log = read_log(&out).unwrap();
        fs::remove_file(&out).unwrap();
        [names::X, names::Y, names::HEADING].map(|name| *log.require(name).unwrap().last().unwrap())
    };
    let pose = navigate(&straight, &[]);
    let found = navigate(&turned, &["--mounting", "90,-20,75"]);
    assert!(pose.iter().zip(found).all(|(a, b)| (a - b).abs() < 1e-6), "{pose:?} {found:?}");
    let unturned = navigate(&turned, &[]);
    assert!((pose[2] - unturned[2]).abs() > 0.01, "{pose:?} {unturned:?}");
}

#[test]
fn mountings_of_drives_that_cannot_be_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let (config, log) = (data("truth.toml"), dir.path().join("drive.csv"));
    let refused = |arguments: &[&str], code: i32, parts: &[&str]| {
        let (found, _, err) = run(gyroid().arg("navigate").arg(&config).arg(&log).args(arguments));
        assert!(found == code && parts.iter().all(|p| err.contains(p)), "{arguments:?}: {found} {err}");
    };
    fs::write(&log, turned_drive(&rotation(90.0, 0.0, 0.0), "_rad_s")).unwrap();
    refused(&["--mounting", "90,0,0", "--map", "gyro_z_rad_s=gyro_x_rad_s"], 2, &["--mounting", "--map names one"]);
    fs::write(&log, turned_drive(&rotation(90.0, 0.0, 0.0), "")).unwrap();
    refused(&["--mounting", "90,0,0"], 1, &["name no unit", "gyro_x_rad_s"]);
    fs::write(&log, "t_s,wheel_left_rad_s,wheel_right_rad_s\n0,1,1\n0.1,1,1\n0.2,1,1\n").unwrap();
    refused(&["--mounting", "90,0,0"], 1, &["no gyro", "leave it out"]);
}
