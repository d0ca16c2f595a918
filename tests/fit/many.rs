//! `gyroid fit` of many logs as a user runs it.

use crate::common::{data, gyroid, run, warm_up_csv};
use gyroid::config::Config;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// A gyro of which every power-on differs.
const TRUTH: &str = "schema = 1\nsample_time_s = 0.2\n[gyro]\nc1_rad_s = 2e-3\nc2_rad_s = -5e-3\ntime_constant_s = 120.0\n\
                     angle_random_walk_rad_sqrt_s = 1e-4\nturn_on_bias_std_rad_s = 3e-4\nwarm_up_relative_std = 0.05\n";

/// Logs of `power_ons` power-ons in a folder of their own, by the simulator.
fn folder(dir: &Path, power_ons: u64) -> PathBuf {
    let (truth, logs) = (dir.join("truth.toml"), dir.join("logs"));
    fs::write(&truth, TRUTH).unwrap();
    fs::create_dir_all(logs.join("second")).unwrap();
    for seed in 1..=power_ons {
        let out =
            logs.join(if seed.is_multiple_of(2) { format!("second/{seed}.csv") } else { format!("{seed}.parquet") });
        let mut simulate = gyroid();
        simulate.arg("simulate").arg(&truth).args([
            "--duration",
            "1200",
            "--vary-turn-on",
            "--seed",
            &seed.to_string(),
        ]);
        let (code, _, err) = run(simulate.arg("-o").arg(&out));
        assert_eq!(code, 0, "{err}");
    }
    logs
}

/// Not white is what one log in twenty is by chance: `--accept` counts it.
fn fit(logs: &Path, arguments: &[&str]) -> (i32, Value) {
    let mut command = gyroid();
    command.arg("fit").arg(logs).args(["--accept", "--draws", "99", "--json", "-"]).args(arguments);
    let (code, out, err) = run(&mut command);
    (code, serde_json::from_str(&out).unwrap_or_else(|e| panic!("{e}: {out} {err}")))
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn a_folder_becomes_a_table_a_population_and_a_configuration() {
    let dir = tempfile::tempdir().unwrap();
    let logs = folder(dir.path(), 7);
    let whole = fs::read(logs.join("1.parquet")).unwrap();
    fs::write(logs.join("cut.parquet"), &whole[..whole.len() / 2]).unwrap();
    fs::write(logs.join("notes.txt"), "on the bench").unwrap();
    let (results, config) = (dir.path().join("results.parquet"), dir.path().join("gyroid.toml"));
    let arguments = ["--results", text(&results), "--config", text(&config), "--jobs", "2"];
    let (code, json) = fit(&logs, &arguments);
    // the bad log is said by the exit code, and stops nothing
    assert_eq!((code, &json["failed"], &json["fitted"]), (3, &Value::from(1), &Value::from(8)), "{json:#}");
    let rows = json["rows"].as_array().unwrap();
    let bad = rows.iter().find(|r| r["path"].as_str().unwrap().ends_with("cut.parquet")).unwrap();
    assert!(bad["error"].as_str().unwrap().contains("truncated") && bad["c1_rad_s"].is_null());
    let population = &json["populations"][0];
    assert_eq!(population["counted"].as_array().unwrap().len() + population["left_out"].as_array().unwrap().len(), 7);
    // spread 3e-4 beside errors of 1e-5: 0.975 quantiles of χ²₆ allow 0.45 to 1.55; five standard deviations are wider
    let c2 = &population["c2"];
    let spread = c2["spread"].as_f64().unwrap();
    assert!((0.1 * 3e-4..3.0 * 3e-4).contains(&spread), "{spread}");
    let written = Config::read(&config).unwrap();
    let gyro = written.require_gyro().unwrap();
    assert_eq!(gyro.turn_on_bias_std_rad_s, Some(spread));
    assert_eq!(gyro.warm_up_relative_std, population["warm_up"]["relative_std"].as_f64());
    assert_eq!(Some(gyro.c2_rad_s), c2["mean"].as_f64());
    assert!(written.is_signed() && written.validation.as_ref().unwrap().identifiable);
    // what was waited for: the exports that need it have it
    let mut export = gyroid();
    export.arg("export").arg(&config).args(["--to", "isaac-lab", "--accept", "--json", "-"]);
    let (code, out, err) = run(&mut export);
    assert_eq!(code, 0, "{err}");
    let exported: Value = serde_json::from_str(&out).unwrap();
    let keys = exported["keys"].as_array().unwrap();
    let bias = keys.iter().find(|k| k["key"] == "bias_noise_cfg.std").unwrap_or_else(|| panic!("{exported:#}"));
    assert!((bias["value"].as_f64().unwrap() / spread - 1.0).abs() < 1e-8);
    // the simulator and the filter read the file
    let again = dir.path().join("again.csv");
    let mut simulate = gyroid();
    simulate.arg("simulate").arg(&config).args(["--duration", "60", "--vary-turn-on", "-o"]).arg(&again);
    assert_eq!(run(&mut simulate).0, 0);
    let left: Vec<_> = fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert!(left.iter().all(|n| !n.to_string_lossy().starts_with('.')), "{left:?}");
}

#[test]
fn resumed_work_fits_what_is_new_alone() {
    let dir = tempfile::tempdir().unwrap();
    let logs = folder(dir.path(), 3);
    // beside the logs, where the next search must not take it for one
    let results = logs.join("results.csv");
    let resume = ["--results", text(&results), "--resume"];
    let (code, json) = fit(&logs, &resume);
    assert_eq!((code, &json["fitted"], &json["resumed"]), (0, &Value::from(3), &Value::from(0)));
    // a digit that no fit would find stays: nothing was fitted
    let table = fs::read_to_string(&results).unwrap();
    let c1 = json["rows"][0]["c1_rad_s"].to_string();
    assert!(table.contains(&c1), "{c1}: {table}");
    fs::write(&results, table.replacen(&c1, "0.0123", 1)).unwrap();
    let (_, json) = fit(&logs, &resume);
    assert_eq!((&json["fitted"], &json["resumed"]), (&Value::from(0), &Value::from(3)));
    assert_eq!(json["rows"][0]["c1_rad_s"], 0.0123);
    // a log that came is fitted, other options fit all anew
    fs::write(logs.join("new.csv"), warm_up_csv(9, 2000)).unwrap();
    let (_, json) = fit(&logs, &resume);
    assert_eq!((&json["fitted"], &json["resumed"]), (&Value::from(1), &Value::from(3)));
    let (_, json) = fit(&logs, &[&resume[..], &["--loss", "huber"]].concat());
    assert_eq!((&json["fitted"], &json["resumed"]), (&Value::from(4), &Value::from(0)));
    // without --resume the work begins anew, and a table that others may have written is replaced only if that is said
    let (_, json) = fit(&logs, &[&resume[..2], &["--force"]].concat());
    assert_eq!(json["fitted"], 4);
    assert_ne!(json["rows"][0]["c1_rad_s"], 0.0123);
    fs::write(&results, "something,else\n1,2\n").unwrap();
    let mut command = gyroid();
    let (code, _, err) = run(command.arg("fit").arg(&logs).args(resume));
    assert!(code == 1 && err.contains("results.csv") && err.contains("hint:"), "{err}");
    assert_eq!(fs::read_to_string(&results).unwrap(), "something,else\n1,2\n");
}

#[test]
fn every_axis_is_a_row_and_options_for_one_log_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let log = data("cats_coldsoak_a.csv");
    let copy = dir.path().join("copy.csv");
    fs::copy(&log, &copy).unwrap();
    let (code, json) = fit(&log, &["--axes", "x,y,-z"]);
    assert_eq!(code, 0);
    let rows = json["rows"].as_array().unwrap();
    assert_eq!(rows.iter().map(|r| r["axis"].as_str().unwrap()).collect::<Vec<_>>(), ["x", "y", "-z"]);
    // as the fit of one log has it, with the sign turned
    let (_, out, _) = run(gyroid().arg("fit").arg(&log).args(["--axis", "z", "--no-plot", "--json", "-"]));
    let one: Value = serde_json::from_str(&out).unwrap();
    let alone = one["parameters"]["c1_rad_s"]["estimate"].as_f64().unwrap();
    assert!((rows[2]["c1_rad_s"].as_f64().unwrap() / alone + 1.0).abs() < 1e-12);
    assert_eq!(rows[2]["time_constant_std_s"], one["parameters"]["time_constant_s"]["std"]);

    let (code, out, _) = run(gyroid().arg("fit").arg(&log).arg(&copy).args(["--axis", "z", "--draws", "99"]));
    assert_eq!(code, 0, "{out}");
    assert!(out.contains("verdict") && out.contains("the same bytes as"), "{out}");
    let refused: [(&[&str], &str); 4] = [
        (&["-o", "g.toml"], "--config"),
        (&["--plot", "a.png"], "alone"),
        (&["--axes", "x,z", "--config", "g.toml"], "--axis"),
        (&["--results", "r.xlsx"], ".parquet"),
    ];
    for (arguments, hint) in refused {
        let mut command = gyroid();
        let (code, _, err) = run(command.current_dir(dir.path()).arg("fit").arg(&log).arg(&copy).args(arguments));
        assert!(code == 2 && err.contains(hint), "{arguments:?}: {code} {err}");
    }
    assert_eq!(run(gyroid().arg("fit").arg(&log).arg(&copy).arg("--resume")).0, 2);
    assert_eq!(run(gyroid().arg("fit").arg(&log).arg(&copy).args(["--jobs", "0"])).0, 2);
    // all failed: as one bad log
    let mut command = gyroid();
    let (code, out, err) = run(command.arg("fit").args(["no_such_1.csv", "no_such_2.csv"]));
    assert!(code == 1 && out.contains("no_such_2.csv") && err.contains("none could be fitted"), "{out}{err}");
    // too few for a population: said, and nothing written
    let config = dir.path().join("g.toml");
    let mut command = gyroid();
    command.arg("fit").arg(&log).arg(&copy).args(["--axis", "z", "--draws", "99", "--config"]).arg(&config);
    let (code, out, err) = run(&mut command);
    assert!(code == 3 && out.contains("not written") && !config.exists(), "{out}{err}");
}
