//! `gyroid fit --shard`, `gyroid merge` and `gyroid track`, as those who have many robots run them.

use crate::common::{gyroid, run};
use gyroid::math::random::Stream;
use serde_json::Value;
use std::fs;
use std::path::Path;

/// A log of 300 s at 2 Hz from `day` on, C2 in rad/s.
fn log(seed: u64, day: u64, c2: f64) -> String {
    let mut draw = Stream::new(seed, 0);
    let mut text = String::from("time_unix_s,gyro_z_rad_s\n");
    for i in 0..600 {
        let t = 0.5 * f64::from(i);
        let rate = c2 - 2e-3 * (-t / 40.0).exp_m1() + 3e-4 * draw.normal();
        text += &format!("{},{rate:.9}\n", 1.7e9 + 86_400.0 * day as f64 + t);
    }
    text
}

/// Four units with seven power-ons each; the last one of the second unit is far off.
fn fleet(dir: &Path) {
    let mut draw = Stream::new(7, 1);
    for unit in 0..4 {
        let folder = dir.join(format!("fleet/robot_{unit}"));
        fs::create_dir_all(&folder).unwrap();
        for day in 0..7 {
            let off = if (unit, day) == (1, 6) { 3e-3 } else { 0.0 };
            let c2 = -5e-3 + 1e-4 * draw.normal() + off;
            fs::write(folder.join(format!("{day}.csv")), log(100 * unit + day, day, c2)).unwrap();
        }
    }
}

/// The exit code, standard output and error of a command, run in `dir`.
fn at(dir: &Path, line: &str) -> (i32, String, String) {
    run(gyroid().current_dir(dir).args(line.split_whitespace()))
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

#[test]
fn shards_in_any_order_become_what_one_run_makes() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    fleet(dir);
    fs::write(dir.join("fleet/robot_2/torn.csv"), "time_unix_s,gyro_z_rad_s\n1,x\n").unwrap();
    let fit = "fit fleet --accept --draws 99";
    let (code, whole, _) = at(dir, &format!("{fit} --results whole.parquet --config whole.toml --json -"));
    assert_eq!(code, 3);
    let mut rows = 0;
    for i in 1..=3 {
        let (code, out, err) = at(dir, &format!("{fit} --shard {i}/3 -o part_{i}.parquet --json -"));
        assert!(code == 0 || code == 3, "{err}");
        rows += json(&out)["rows"].as_array().unwrap().len();
    }
    assert_eq!(rows, 29);
    let (code, merged, err) = at(
        dir,
        "merge part_3.parquet part_1.parquet part_3.parquet part_2.parquet -o merged.parquet --accept --config merged.toml --json -",
    );
    assert_eq!(code, 3, "{err}");
    let [whole, merged] = [json(&whole), json(&merged)];
    assert_eq!((&whole["rows"], &whole["populations"]), (&merged["rows"], &merged["populations"]));
    assert_eq!((merged["failed"].as_u64(), merged["parts"].as_u64()), (Some(1), Some(4)));
    assert!(merged["repeated"].as_u64() > Some(0));
    assert_eq!(fs::read(dir.join("whole.parquet")).unwrap(), fs::read(dir.join("merged.parquet")).unwrap());
    // merged once more nothing changes
    assert_eq!(at(dir, "merge merged.parquet part_2.parquet -o again.csv -q").0, 3);
    assert_eq!(at(dir, "merge again.csv -o again.parquet -q").0, 3);
    assert_eq!(fs::read(dir.join("whole.parquet")).unwrap(), fs::read(dir.join("again.parquet")).unwrap());
    let gyro = |name: &str| {
        fs::read_to_string(dir.join(name)).unwrap().lines().filter(|l| l.starts_with("c2_rad_s")).collect::<String>()
    };
    assert_eq!(gyro("whole.toml"), gyro("merged.toml"));
    // a part may hold nothing: there are more parts than logs
    let empty = (1..=300).find(|i| {
        let (code, out, _) = at(dir, &format!("{fit} --shard {i}/300 -o empty.parquet --force --json -"));
        code == 0 && json(&out)["rows"].as_array().unwrap().is_empty()
    });
    assert!(empty.is_some());
    assert_eq!(at(dir, "merge empty.parquet merged.parquet -o all.parquet -q").0, 3);
    assert_eq!(fs::read(dir.join("whole.parquet")).unwrap(), fs::read(dir.join("all.parquet")).unwrap());
}

#[test]
fn parts_that_do_not_belong_together_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    fs::write(dir.join("a.csv"), log(1, 0, -5e-3)).unwrap();
    for (line, said) in [("", "a.csv"), ("--loss huber", "b.csv")] {
        let (_, _, err) = at(dir, &format!("fit a.csv --accept --draws 99 {line} --results {said}.results.csv"));
        assert!(err.is_empty(), "{err}");
    }
    let (code, _, err) = at(dir, "merge a.csv.results.csv b.csv.results.csv -o all.csv");
    assert!(code == 1 && err.contains("huber") && err.contains("hint:") && !dir.join("all.csv").exists(), "{err}");
    for (line, said) in [
        ("merge a.csv.results.csv -o a.csv.results.csv", "is an input"),
        ("merge a.csv.results.csv -o all.xlsx", ".parquet or .csv"),
        ("fit a.csv --shard 4/3 -o part.csv", "2/8"),
        ("track a.csv.results.csv --unit robot_(", "--unit"),
        ("track a.csv.results.csv --unit robot_([0-9]+)", "a.csv"),
        ("track a.csv.results.csv --type rover_([0-9]+)", "--type"),
        ("track a.csv.results.csv --per-year 0", "per-year"),
    ] {
        let (code, _, err) = at(dir, line);
        assert!(code == 2 && err.contains(said), "{line}: {code} {err}");
    }
    let (code, _, err) = at(dir, "merge a.csv -o all.csv");
    assert!(code == 1 && err.contains("a.csv") && err.contains("hint:"), "{err}");
}

#[test]
fn a_unit_that_changed_is_told_with_its_parameter_a_page_and_exit_code_3() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    fleet(dir);
    let (_, _, err) = at(dir, "fit fleet --accept --draws 99 -q --results fleet.csv");
    assert!(err.is_empty(), "{err}");
    let (code, out, err) = at(dir, "track fleet.csv --html page.html --json track.json");
    assert!(code == 3 && err.is_empty(), "{out}{err}");
    assert!(out.contains("OUTSIDE") && out.contains("C2 is") && out.contains("1 of 4 gyros changed"), "{out}");
    let told = json(&fs::read_to_string(dir.join("track.json")).unwrap());
    assert_eq!((told["schema"].as_str(), told["changed"].as_u64()), (Some("gyroid.track/1"), Some(1)));
    let gyros = told["gyros"].as_array().unwrap();
    let changed: Vec<&Value> = gyros.iter().filter(|g| g["standing"] != "inside").collect();
    let [changed] = changed[..] else { panic!("{gyros:#?}") };
    assert_eq!(
        (changed["unit"].as_str(), changed["last"].as_str()),
        (Some("fleet/robot_1"), Some("fleet/robot_1/6.csv"))
    );
    assert_eq!((changed["in_days"].as_bool(), changed["at"][6].as_f64()), (Some(true), Some(6.0)));
    let page = fs::read_to_string(dir.join("page.html")).unwrap();
    assert!(page.contains("C2 of fleet/robot_1") && page.contains("robot_3"));
    // the robots differ from power-on to power-on alone, by 1e-4 rad/s; the one that was outside does not count
    assert!(out.contains("27 power-ons of 4 units, 1 month\n") && page.contains("27 power-ons of 4 units"), "{out}");
    let c2 = &told["fleet"][0]["parameters"][1];
    let spreads = c2["between"].as_array().unwrap();
    let ends = |k: usize| [0, 1].map(|end| spreads[k]["ci95"][end].as_f64().unwrap());
    assert_eq!((spreads[0]["levels"][0].as_str(), spreads[0]["items"].as_u64()), (Some("power_on"), Some(27)));
    assert_eq!((spreads[1]["levels"][1].as_str(), spreads[1]["items"].as_u64()), (Some("unit"), Some(4)));
    assert!(ends(0)[0] < 1e-4 && 1e-4 < ends(0)[1] && ends(1)[0] < 2e-5, "{c2}");
    let (_, out, _) = at(dir, "track fleet.csv --type robot_([0-1])");
    assert!(out.contains("27 power-ons of 4 units, 3 types, 1 month\n"), "{out}");
    // by a number in the path; the robots but that one are as ever
    let (code, out, _) = at(dir, "track fleet.csv --unit robot_([023])");
    assert!(code == 0 && out.contains("7 rows are left out") && out.contains("0 of 3"), "{out}");
}
