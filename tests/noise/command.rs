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
