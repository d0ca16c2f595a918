//! `gyroid noise` as a user runs it.

use crate::logs::{Truth, simulated};
use assert_cmd::Command;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

fn gyroid(arguments: &[&str]) -> (i32, String, String) {
    let out = Command::new(env!("CARGO_BIN_EXE_gyroid")).arg("noise").args(arguments).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (out.status.code().unwrap(), text(out.stdout), text(out.stderr))
}

fn log(dir: &Path, truth: &Truth, seed: u64) -> PathBuf {
    let path = dir.join("log.csv");
    let rates = simulated(truth, seed);
    let rows = rates.iter().enumerate().map(|(i, v)| format!("{},{v}\n", i as f64 * truth.step_s));
    fs::write(&path, format!("t_s,gyro_z_rad_s\n{}", rows.collect::<String>())).unwrap();
    path
}

#[test]
fn terms_picture_datasheet_and_ledger_in_one_run() {
    let dir = tempfile::tempdir().unwrap();
    let path = log(dir.path(), &Truth { rate_random_walk: 3.5e-6, warm_up: Some([2e-3, 400.0]), ..Truth::white() }, 1);
    let (png, svg) = (dir.path().join("a.png"), dir.path().join("a.svg"));
    let json_file = dir.path().join("noise.json");
    let (code, text, err) = gyroid(&[
        path.to_str().unwrap(),
        "--datasheet",
        "mpu6050",
        "--horizon",
        "5min",
        "--plot",
        png.to_str().unwrap(),
        "--plot",
        svg.to_str().unwrap(),
        "--json",
        json_file.to_str().unwrap(),
    ]);
    assert_eq!(code, 0, "{text}{err}");
    assert!(text.starts_with("FIT FOR USE: N + K"), "{text}");
    assert!(text.contains("MPU-6050") && text.contains("PS-MPU-6000A"), "{text}");
    assert!(fs::metadata(&png).unwrap().len() > 10_000);
    assert!(fs::read_to_string(&svg).unwrap().contains("Averaging time"));
    let json: Value = serde_json::from_str(&fs::read_to_string(&json_file).unwrap()).unwrap();
    let terms = json["terms"].as_array().unwrap();
    let ids: Vec<&str> = terms.iter().map(|t| t["id"].as_str().unwrap()).collect();
    assert_eq!(ids, ["angle_random_walk", "rate_random_walk"]);
    for term in terms {
        assert!(term["estimate"].is_number() && term["std"].is_number() && term["unit"].is_string());
        let ci = term["ci95"].as_array().unwrap();
        assert!(ci[0].as_f64() < term["estimate"].as_f64() && term["estimate"].as_f64() < ci[1].as_f64());
    }
    let n = terms[0]["estimate"].as_f64().unwrap();
    assert!((n / 1e-4 - 1.0).abs() < 0.03, "{n}");
    let compared = &json["datasheet"]["compared"][0];
    assert!((compared["measured"].as_f64().unwrap() - n.to_degrees()).abs() < 1e-9);
    assert_eq!(json["ledger"]["horizon_s"], 300.0);
    let factor = json["ledger"]["factor"].as_f64().unwrap();
    // N and K alone: √(1 + K² h²/3N²), here with the warm-up's rest
    assert!(factor > 1.0 && factor < 20.0, "{factor}");
    assert_eq!(json["warm_up_influence"]["removed"], true);
    assert!(json["deviations"]["overlapping_allan"].as_array().unwrap().len() > 20);
}

#[test]
fn what_the_terms_do_not_explain_is_unfit() {
    let dir = tempfile::tempdir().unwrap();
    let truth = Truth { gauss_markov: 2e-4, correlation_time_s: 10.0, samples: 8192, ..Truth::white() };
    let path = log(dir.path(), &truth, 2);
    let (code, text, _) = gyroid(&[path.to_str().unwrap(), "--terms", "N,Q", "--json", "-"]);
    assert_eq!(code, 3);
    let json: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(json["verdict"], "does_not_fit");
    assert!(json["verdict_text"].as_str().unwrap().contains("Hz"), "{}", json["verdict_text"]);
}

#[test]
fn usage_errors_name_the_option_and_the_mend() {
    let dir = tempfile::tempdir().unwrap();
    let path = log(dir.path(), &Truth { samples: 2000, ..Truth::white() }, 3);
    let path = path.to_str().unwrap();
    for (arguments, expected) in [
        (&["--datasheet", "HG1700"][..], "STIM300"),
        (&["--terms", "N,Z"], "rate_random_walk"),
        (&["--horizon", "soon"], "60s"),
        (&["--level", "2"], "between 0 and 1"),
        (&["--plot", "a.jpg"], ".svg or .png"),
        (&["--max-frequency", "0"], "--max-frequency"),
    ] {
        let (code, _, err) = gyroid(&[&[path][..], arguments].concat());
        assert_eq!(code, 2, "{arguments:?}: {err}");
        assert!(err.contains(expected), "{arguments:?}: {err}");
    }
}

/// A gyro at rest, by the simulator; its walk only where `walk` says so.
fn simulated_log(dir: &Path, name: &str, walk: f64, duration: &str) -> PathBuf {
    let truth = dir.join("truth.toml");
    let noise =
        if walk > 0.0 { format!("[gyro.noise]\nrate_random_walk_rad_s_sqrt_s = {walk}\n") } else { String::new() };
    let gyro =
        "[gyro]\nc1_rad_s = 2e-3\nc2_rad_s = -5e-3\ntime_constant_s = 200.0\nangle_random_walk_rad_sqrt_s = 1e-4\n";
    fs::write(&truth, format!("schema = 1\nsample_time_s = 0.1\n{gyro}{noise}")).unwrap();
    let out = dir.join(name);
    let (code, _, err) = run(&["simulate", text(&truth), "--duration", duration, "--seed", "3", "-o", text(&out)]);
    assert_eq!(code, 0, "{err}");
    out
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn run(arguments: &[&str]) -> (i32, String, String) {
    let out = Command::new(env!("CARGO_BIN_EXE_gyroid")).args(arguments).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (out.status.code().unwrap(), text(out.stdout), text(out.stderr))
}

/// The exported keys and what was left out.
fn exported(config: &Path, target: &str) -> Value {
    let (code, out, err) = run(&["export", text(config), "--to", target, "--json", "-"]);
    assert_eq!(code, 0, "{out}{err}");
    serde_json::from_str(&out).unwrap()
}

#[test]
fn what_was_found_is_written_and_exported_with_its_interval() {
    let dir = tempfile::tempdir().unwrap();
    let (short, long) = (
        simulated_log(dir.path(), "power_on.csv", 0.0, "1200"),
        simulated_log(dir.path(), "hours.csv", 3.5e-6, "3600"),
    );
    let config = dir.path().join("gyroid.toml");
    let (code, out, err) = run(&["fit", text(&short), "--no-plot", "-o", text(&config)]);
    assert_eq!(code, 0, "{out}{err}");
    // without a walk its key is left out, and the hint names the command that finds one
    for (target, walk) in [("kalibr", "gyroscope_random_walk"), ("openvins", "gyroscope_random_walk")] {
        let json = exported(&config, target);
        let left = json["left_out"].as_array().unwrap().iter().find(|l| l["key"] == walk).unwrap();
        assert!(left["hint"].as_str().unwrap().contains("gyroid noise LOG --write CONFIG"), "{left}");
    }
    let before = fs::read_to_string(&config).unwrap();
    let write = [text(&long), "--draws", "99", "--write", text(&config)];
    let (code, _, err) = gyroid(&write);
    assert!(code == 2 && err.contains("gyroid.toml") && err.contains("--other-log"), "{err}");
    assert_eq!(fs::read_to_string(&config).unwrap(), before);

    let (code, out, err) = gyroid(&[&write[..], &["--other-log", "--json", "-"]].concat());
    assert_eq!(code, 0, "{out}{err}");
    let json: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(json["configuration"], text(&config));
    let term = |id: &str| json["terms"].as_array().unwrap().iter().find(|t| t["id"] == id).unwrap().clone();
    let (n, k) = (term("angle_random_walk"), term("rate_random_walk"));
    let written = gyroid::config::Config::read(&config).unwrap();
    let gyro = written.require_gyro().unwrap();
    // serde_json reads a number to the last bit but one
    let same = |a: f64, b: &Value| (a / b.as_f64().unwrap() - 1.0).abs() < 4e-16;
    assert!(same(gyro.angle_random_walk_rad_sqrt_s, &n["estimate"]), "{n}");
    assert!(same(gyro.noise.as_ref().unwrap().rate_random_walk_rad_s_sqrt_s.unwrap(), &k["estimate"]), "{k}");
    let origin = written.provenance.as_ref().unwrap();
    let noise = origin.noise.as_ref().unwrap();
    assert_eq!((origin.log.as_str(), noise.log.as_str()), ("power_on.csv", "hours.csv"));
    assert!(noise.command.starts_with("gyroid noise") && noise.log_sha256.len() == 64);
    for target in ["kalibr", "openvins"] {
        let json = exported(&config, target);
        let keys = json["keys"].as_array().unwrap();
        let walk = keys.iter().find(|key| key["key"] == "gyroscope_random_walk").unwrap();
        for i in 0..2 {
            assert_eq!(walk["ci95"][i].as_f64(), k["ci95"][i].as_f64(), "{target}");
        }
        assert!(json["text"].as_str().unwrap().contains("noise terms: hours.csv"), "{target}");
    }
    // the file is whole and signed: a changed byte is refused
    let changed = fs::read_to_string(&config).unwrap().replacen("hours.csv", "other.csv", 1);
    fs::write(&config, changed).unwrap();
    assert_eq!(run(&["export", text(&config), "--to", "kalibr"]).0, 1);
}

#[test]
fn terms_go_only_where_they_belong() {
    let dir = tempfile::tempdir().unwrap();
    let rates = simulated(&Truth { samples: 8192, warm_up: Some([2e-3, 60.0]), ..Truth::white() }, 4);
    let rows = rates.iter().enumerate().map(|(i, v)| format!("{},{v},{}\n", 0.1 * i as f64, v + 1e-3));
    let path = dir.path().join("log.csv");
    fs::write(&path, format!("t_s,gyro_z_rad_s,gyro_x_rad_s\n{}", rows.collect::<String>())).unwrap();
    let (config, copy) = (dir.path().join("g.toml"), dir.path().join("copy.toml"));
    let (code, out, err) = run(&["fit", text(&path), "--no-plot", "--accept", "-o", text(&config)]);
    assert_eq!(code, 0, "{out}{err}");
    let before = fs::read_to_string(&config).unwrap();
    let write = [text(&path), "--draws", "99", "--write", text(&config), "-o", text(&copy)];
    let (code, _, err) = gyroid(&[&write[..], &["--axis", "x"]].concat());
    assert!(code == 2 && err.contains("--other-axis") && !copy.exists(), "{err}");
    assert_eq!(gyroid(&[&write[..], &["--axis", "x", "--other-axis", "--accept"]].concat()).0, 0);
    // the log and axis of the fit need no leave; the configuration itself stays as it was
    assert_eq!(gyroid(&[&write[..], &["--accept"]].concat()).0, 0);
    assert_eq!(fs::read_to_string(&config).unwrap(), before);
    let terms = gyroid::config::Config::read(&copy).unwrap().gyro.unwrap().noise.unwrap().terms.unwrap();
    let n = terms.angle_random_walk_rad_sqrt_s.unwrap();
    assert!((n.estimate / 1e-4 - 1.0).abs() < 0.05 && n.ci95[0] < n.estimate && n.estimate < n.ci95[1]);
    // terms that do not explain the log stay out
    let markov = Truth { gauss_markov: 2e-4, correlation_time_s: 10.0, samples: 8192, ..Truth::white() };
    let other = log(dir.path(), &markov, 2);
    let none = dir.path().join("none.toml");
    let wrong =
        [text(&other), "--terms", "N,Q", "--draws", "199", "--write", text(&config), "--other-log", "-o", text(&none)];
    let (code, out, _) = gyroid(&wrong);
    assert!(code == 3 && out.contains("--accept") && !none.exists(), "{out}");
    // a file written by hand would lose its comments
    let hand = before.split("\n[provenance]").next().unwrap();
    fs::write(&config, format!("# by hand\n{hand}")).unwrap();
    let (code, _, err) = gyroid(&write[..5]);
    assert!(
        code == 1 && err.contains("--force") && fs::read_to_string(&config).unwrap().contains("# by hand"),
        "{err}"
    );
    assert_eq!(gyroid(&["log.csv", "--other-log"]).0, 2);
}
