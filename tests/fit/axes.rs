//! Several axes of one log: read once, and each as if it were read alone.

use crate::common::{self, data, gyroid, run};
use gyroid::identify::{FitOptions, fit_reduced};
use gyroid::ingest::{Axis, GyroQuery, Reading, StreamedRecording, read_axes_within, read_gyro_within};
use gyroid::math::random::Stream;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

const AXES: [Axis; 3] = [Axis::X, Axis::Y, Axis::Z];

/// Three axes that warm up by different amounts, at 50 Hz.
fn write(dir: &Path, samples: usize) -> PathBuf {
    let mut draw = Stream::new(4, 0);
    let mut text = String::from("t_s,gx_rad_s,gy_rad_s,gz_rad_s,temperature_c\n");
    for i in 0..samples {
        let t = 0.02 * i as f64;
        let warm = -(-t / 60.0).exp_m1();
        let [x, y, z] = [3e-3, -2e-3, 1e-3].map(|c1| 1e-2 + c1 * warm + 1e-3 * draw.normal());
        text += &format!("{t:.2},{x:.7},{y:.7},{z:.7},{:.3}\n", 25.0 + 10.0 * warm + 2.0 * (t / 40.0).sin());
    }
    let path = dir.join("imu.csv");
    fs::write(&path, text).unwrap();
    path
}

fn json(arguments: &[&str]) -> (i32, Value, String) {
    let (code, out, err) = run(gyroid().args(arguments).args(["--json", "-"]));
    (code, serde_json::from_str(&out).unwrap_or(Value::Null), err)
}

fn streamed(reading: Reading) -> StreamedRecording {
    match reading {
        Reading::Streamed(recording) => *recording,
        Reading::Whole(_) => panic!("the log was held"),
    }
}

#[test]
fn three_axes_in_one_pass_are_the_three_axes() {
    let dir = tempfile::tempdir().unwrap();
    let log = write(dir.path(), 40_000);
    let queries = AXES.map(|axis| GyroQuery { axis, reversed: axis == Axis::Y, ..GyroQuery::default() });
    let mut rows = 0;
    let together = read_axes_within(&log, &queries, 0, &mut |p| rows = p.rows).unwrap();
    assert_eq!((together.len(), rows), (3, 40_000));
    for (reading, query) in together.into_iter().zip(&queries) {
        let (ours, alone) = (streamed(reading), streamed(read_gyro_within(&log, query, 0, &mut |_| ()).unwrap()));
        assert_eq!(
            (&ours.column, ours.unit, &ours.sha256, ours.clock),
            (&alone.column, alone.unit, &alone.sha256, alone.clock)
        );
        assert_eq!((ours.temperature_c, ours.log.samples()), (alone.temperature_c, alone.log.samples()));
        // the sums of the fit do not depend on how many means are kept
        let fits = [&ours, &alone].map(|r| fit_reduced(&r.log, &FitOptions::default()).unwrap());
        assert_eq!(fits[0], fits[1], "{:?}", query.axis);
    }
}

#[test]
fn the_command_line_reads_a_pipe_once_for_all_axes() {
    let dir = tempfile::tempdir().unwrap();
    let log = write(dir.path(), 8_000);
    let path = log.to_str().unwrap();
    let piped = gyroid()
        .args(["fit", "/dev/stdin", "--axis", "all", "--memory", "0", "--json", "-"])
        .write_stdin(fs::read(&log).unwrap())
        .output()
        .unwrap();
    let together: Value = serde_json::from_slice(&piped.stdout)
        .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&piped.stderr)));
    let (_, all, _) = json(&["fit", path, "--axis", "x,y,z", "--no-plot"]);
    for axis in ["x", "y", "z"] {
        let (_, alone, err) = json(&["fit", path, "--axis", axis, "--memory", "0", "--no-plot"]);
        let ours = &together["axes"][axis];
        assert_eq!(ours["parameters"], alone["parameters"], "{axis} {err}");
        assert_eq!(ours["verdict"], alone["verdict"]);
        assert_eq!(ours["temperature"]["parameters"], alone["temperature"]["parameters"]);
        // in memory all of it is the same, to the last digit
        let (_, held, _) = json(&["fit", path, "--axis", axis, "--no-plot"]);
        assert_eq!(all["axes"][axis]["parameters"], held["parameters"], "{axis}");
    }
    assert_eq!(together["fit_for_use"], Value::Bool(piped.status.code() == Some(0)));
}

#[test]
fn noise_and_validate_take_all_axes_too() {
    let dir = tempfile::tempdir().unwrap();
    let log = write(dir.path(), 8_000);
    let path = log.to_str().unwrap();
    let (_, found, err) = json(&["noise", path, "--axis", "all", "--memory", "0", "--draws", "99"]);
    for axis in ["x", "y", "z"] {
        let terms = found["axes"][axis]["terms"].as_array().unwrap_or_else(|| panic!("{found} {err}"));
        let n = terms.iter().find(|t| t["id"] == "angle_random_walk").unwrap();
        let (estimate, std) = (n["estimate"].as_f64().unwrap(), n["std"].as_f64().unwrap());
        // 1e-3 rad/s a sample at 50 Hz
        assert!((estimate - 1e-3 * 0.02f64.sqrt()).abs() < 4.0 * std, "{axis}: {n}");
    }
    let config = dir.path().join("x.toml");
    let (code, ..) = json(&["fit", path, "--axis", "x", "--accept", "--no-plot", "-o", config.to_str().unwrap()]);
    assert_eq!(code, 0);
    let (code, found, _) = json(&["validate", config.to_str().unwrap(), path, "--axis", "x,z"]);
    // the other axis warms up by a third as much
    assert_eq!((code, &found["axes"]["x"]["white"], &found["axes"]["z"]["white"]), (3, &true.into(), &false.into()));
    let (_, said, _) = run(gyroid().args(["validate", config.to_str().unwrap(), path, "--axis", "all"]));
    assert_eq!(said.matches("axis ").count(), 3, "{said}");
}

#[test]
fn what_is_of_one_axis_is_refused_for_several() {
    let log = data("cats_coldsoak_a.csv");
    let path = log.to_str().unwrap();
    for extra in [["-o", "g.toml"], ["--plot", "g.png"], ["--base", "b.toml"]] {
        let (code, _, err) = json(&["fit", path, "--axis", "all", extra[0], extra[1]]);
        assert!(code == 2 && err.contains("one axis") && err.contains("--axis z"), "{extra:?} {err}");
    }
    let (code, _, err) = json(&["noise", path, "--axis", "all", "--write", "g.toml"]);
    assert!(code == 2 && err.contains("--write"), "{err}");
    let (code, _, err) = json(&["fit", path, "--axis", "all", "--column", "gx_rad_s"]);
    assert!(code == 2 && err.contains("--column"), "{err}");
    let (code, _, err) = json(&["fit", path, "--axis", "x,-x"]);
    assert!(code == 2 && err.contains("twice"), "{err}");
    let dir = tempfile::tempdir().unwrap();
    let one = dir.path().join("one.csv");
    fs::write(&one, common::warm_up_csv(1, 500).replace("gyro_z_rad_s", "gyro_rad_s")).unwrap();
    let (code, _, err) = json(&["fit", one.to_str().unwrap(), "--axis", "all"]);
    assert!(code == 1 && err.contains("gyro_rad_s"), "{code} {err}");
    // gap takes one
    let config = dir.path().join("rest.toml");
    let gyro = "c1_rad_s = 1e-3\nc2_rad_s = 2e-3\ntime_constant_s = 300\nangle_random_walk_rad_sqrt_s = 1e-4\n";
    fs::write(&config, format!("schema = 1\nkind = \"stationary\"\nsample_time_s = 1.0\n[gyro]\n{gyro}")).unwrap();
    let (code, _, err) = json(&["gap", "diagnose", config.to_str().unwrap(), "--fit", path, "--axis", "all"]);
    assert!(code == 2 && err.contains("--axis"), "{code} {err}");
}
