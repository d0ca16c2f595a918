//! `gyroid study` as a user runs it.

use assert_cmd::Command;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Output;

fn run(directory: &Path, line: &str) -> Output {
    let mut command = Command::cargo_bin("gyroid").unwrap();
    command.current_dir(directory).args(line.split(' ')).output().unwrap()
}

#[track_caller]
fn ok(directory: &Path, line: &str) -> String {
    let output = run(directory, line);
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[track_caller]
fn refused(directory: &Path, line: &str, code: i32, parts: &[&str]) {
    let output = run(directory, line);
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{line}: {text}");
    for part in parts {
        assert!(text.contains(part), "{line}: {part:?} is not in {text}");
    }
}

/// All files of a directory by name.
fn files(directory: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(directory).unwrap().map(|e| e.unwrap().path());
    entries.map(|p| (p.file_name().unwrap().to_string_lossy().into_owned(), std::fs::read(p).unwrap())).collect()
}

const SMALL: &str = "study --runs 3 --duration 5 --surface ice";

#[test]
#[ignore = "battery: some ten seconds and more"]
fn battery_figures_report_and_json_are_written_the_same_on_one_thread_or_two() {
    let dir = tempfile::tempdir().unwrap();
    let text = ok(dir.path(), &format!("{SMALL} --seed 7 --sweeps --convergence 12 --threads 1 -o a"));
    for words in ["filter with slip", "encoders alone", "NEES", "3 runs of 5 s on ice", "report.md"] {
        assert!(text.contains(words), "{words:?} is not in {text}");
    }
    let json = ok(dir.path(), &format!("{SMALL} --seed 7 --sweeps --convergence 12 --threads 2 -o b --json -"));
    let (a, b) = (files(&dir.path().join("a")), files(&dir.path().join("b")));
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    for (name, bytes) in &a {
        assert!(*bytes == b[name], "{name} differs");
        assert!(!bytes.is_empty(), "{name} is empty");
    }
    assert_eq!(a["study.json"], json.as_bytes(), "--json and study.json differ");
    for figure in [
        "figure_2_autocorrelation",
        "figure_3_rms_x",
        "figure_4_rms_y_heading",
        "figure_5_x",
        "figure_6_y",
        "figure_7_heading",
        "nees",
        "error_model",
        "slip",
        "convergence",
        "friction",
        "sensitivity",
    ] {
        assert!(a[&format!("{figure}.png")].starts_with(b"\x89PNG"), "{figure}");
        assert!(a[&format!("{figure}.svg")].starts_with(b"<svg"), "{figure}");
    }
    let page = String::from_utf8(a["report.md"].clone()).unwrap();
    for words in ["(5j)", "Figure 7", "figure_3_rms_x.png", "reproduced", "corrected", "not reproducible"] {
        assert!(page.contains(words), "{words:?} is not in report.md");
    }
    assert_eq!(a.len(), 2 * 12 + 2, "{:?}", a.keys());
}

#[test]
fn the_json_has_the_documented_keys_and_another_seed_other_numbers() {
    let dir = tempfile::tempdir().unwrap();
    let json = |seed: u32| -> Value {
        serde_json::from_str(&ok(dir.path(), &format!("{SMALL} --seed {seed} --json -"))).unwrap()
    };
    let (one, two) = (json(1), json(2));
    assert_eq!(one["runs"], 3);
    for filter in ["slip", "rolling", "dead_reckoning"] {
        for quantity in ["x_m", "y_m", "heading_rad"] {
            let value = |json: &Value| json["rms"][filter][quantity].as_f64().unwrap();
            assert!(value(&one) > 0.0 && value(&one) != value(&two), "{filter} {quantity}");
            let [low, high] = [0, 1].map(|i| one["rms_ci95"][filter][quantity][i].as_f64().unwrap());
            assert!(low < value(&one) && value(&one) < high, "{filter} {quantity}: {low} {high}");
        }
    }
    for key in ["seed", "course", "ground", "nees", "factors", "over_time", "example", "identification", "claims"] {
        assert!(!one[key].is_null(), "{key}");
    }
    // nothing was asked for that writes files
    assert!(files(dir.path()).is_empty());
}

#[test]
fn a_configuration_of_ones_own_and_a_recorded_log_at_rest_can_be_studied() {
    let dir = tempfile::tempdir().unwrap();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data");
    let [truth, rest] = ["truth.toml", "cats_coldsoak_a.csv"].map(|name| data.join(name).display().to_string());
    let own = format!("study {truth} --runs 2 --duration 2");
    let json = ok(dir.path(), &format!("{own} --surface snow --rest {rest} --axis z --json -"));
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!((&json["ground"], &json["identification"]["log"]), (&"snow".into(), &"cats_coldsoak_a.csv".into()));
    assert_eq!(json["identification"]["white"], true);
    // truth.toml has wheels that roll
    refused(dir.path(), &own, 1, &["truth.toml", "[traction]", "--surface"]);
}

#[test]
fn bad_arguments_are_named_before_any_work() {
    let dir = tempfile::tempdir().unwrap();
    refused(dir.path(), "study --runs 0", 2, &["--runs"]);
    refused(dir.path(), "study --threads 0", 2, &["--threads"]);
    refused(dir.path(), "study --surface mud", 2, &["--surface", "wet_asphalt"]);
    refused(dir.path(), "study --course zigzag", 2, &["--course", "square"]);
    refused(dir.path(), "study --runs 1 --duration -1", 1, &["-1", "duration"]);
    refused(dir.path(), "study --runs 1 --start-offset -1", 1, &["-1", "start offset"]);
    refused(dir.path(), "study missing.toml", 1, &["missing.toml"]);
    std::fs::write(dir.path().join("file"), "").unwrap();
    refused(dir.path(), "study --runs 1 -o file", 1, &["file"]);
    let rest = "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.1\n[gyro]\nc1_rad_s = 1e-3\nc2_rad_s = 1e-3\n\
        time_constant_s = 100.0\nangle_random_walk_rad_sqrt_s = 1e-4\n";
    std::fs::write(dir.path().join("rest.toml"), rest).unwrap();
    refused(dir.path(), "study rest.toml", 2, &["rest.toml", "stationary"]);
}
