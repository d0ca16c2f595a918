//! Files beside a patched description: Python for the simulator's log, and ranges for Isaac Lab.

use crate::place::Place;
use crate::replay::{COMMAND, LOAD, ROBOT, ROBOT_XML};
use serde_json::Value;

const LATE: &str = "[[effect]]\nid = \"sensor.gyro_delay\"\ndelay_s = 0.15\n";
const SIMULATOR: &str =
    "if grep -q 'mass=\"11.1\"' \"$1\"; then cp before.parquet \"$3\"; else cp after.parquet \"$3\"; fi\n";
const LINE: &str = "gap diagnose robot.toml --fit fit.parquet --hold hold.parquet --patch robot.xml -o out/a-copy.xml \
                    --ranges out/ranges.json --json told.json";

/// A robot with a load and a late gyro, and a simulator that can carry the load.
fn place() -> Place {
    let (truth, loaded) = (format!("{ROBOT}{LOAD}{LATE}"), format!("{ROBOT}{LOAD}"));
    let place = Place::with(&[
        ("robot.xml", ROBOT_XML),
        ("robot.toml", ROBOT),
        ("truth.toml", &truth),
        ("loaded.toml", &loaded),
        ("simulator.sh", SIMULATOR),
    ]);
    std::fs::create_dir(place.path("out")).unwrap();
    for (name, seed) in [("fit", 1), ("hold", 2)] {
        place.ok(&format!("simulate truth.toml --course random --duration 60 --seed {seed} -o {name}.parquet"));
    }
    place.ok("simulate robot.toml --inputs hold.parquet --seed 3 -o before.parquet");
    place.ok("simulate loaded.toml --inputs hold.parquet --seed 3 -o after.parquet");
    place
}

fn json(place: &Place, name: &str) -> Value {
    serde_json::from_str(&place.read(name)).unwrap()
}

#[test]
fn what_the_description_has_no_place_for_is_python_for_its_log() {
    let place = place();
    let text = place.ok(LINE);
    assert!(text.contains("wrote out/a_copy_log.py: for the log of your simulator, sensor.gyro_delay"), "{text}");
    let told = json(&place, "told.json");
    assert_eq!(told["patch"]["log"]["effects"], serde_json::json!(["sensor.gyro_delay"]));
    assert_eq!(
        (&told["patch"]["log"]["file"], &told["patch"]["no_place"]),
        (&"out/a_copy_log.py".into(), &serde_json::json!([]))
    );
    let python = place.read("out/a_copy_log.py");
    let line = python.lines().find(|line| line.trim_start().starts_with("delay_s = ")).unwrap();
    let delay_s: f64 = line.split_whitespace().nth(2).unwrap().parse().unwrap();
    assert!((delay_s - 0.15).abs() < 0.002 && line.contains("# 95 %: "), "{line}");
    assert!(!python.contains("vehicle.payload") && !place.read("out/a-copy.xml").contains("mass=\"11.1\""));

    let ranges = json(&place, "out/ranges.json");
    assert_eq!(ranges["schema"], "gyroid.gap.ranges/1");
    let [event] = &ranges["events"].as_array().unwrap()[..] else { panic!("{ranges}") };
    assert_eq!((&event["func"], &event["effect"]), (&"randomize_rigid_body_mass".into(), &"vehicle.payload".into()));
    let [low, high] = [0, 1].map(|i| event["params"]["mass_distribution_params"][i].as_f64().unwrap());
    let mean = event["mean"]["mass_distribution_params"].as_f64().unwrap();
    assert!(low < mean && mean < high && (mean - 0.2 * 12.0).abs() < 0.1, "{event}");
    let body = event["params"]["asset_cfg"]["body_names"].as_str().unwrap();
    assert!(ROBOT_XML.contains(&format!("name=\"{body}\"")), "{body}");
    assert_eq!(ranges["observations"][0]["effect"], "sensor.gyro_delay");

    // both are gyroid's own until somebody changes them
    std::fs::remove_file(place.path("out/a-copy.xml")).unwrap();
    place.ok(LINE);
    std::fs::remove_file(place.path("out/a-copy.xml")).unwrap();
    place.write("out/a_copy_log.py", &python.replace("delay_s", "late_s"));
    place.refused(LINE, 1, &["out/a_copy_log.py", "--out", "gyroid did not write it", "--force"]);
    assert!(place.read("out/a_copy_log.py").contains("late_s") && !place.has("out/a-copy.xml"));
}

#[test]
#[ignore = "battery: some seconds"]
fn battery_the_replay_judges_the_python_too() {
    let with_numpy = std::process::Command::new("python3").args(["-c", "import numpy"]).output();
    let place = place();
    let text = place.ok(&format!("{LINE} {COMMAND}"));
    let told = json(&place, "told.json");
    if !with_numpy.is_ok_and(|ended| ended.status.success()) {
        assert_eq!(told["patch"]["replay"]["kept"], serde_json::json!(["vehicle.payload"]), "{told}");
        assert!(text.contains("not tried in your simulator: sensor.gyro_delay: python3 has no numpy here"), "{text}");
        return;
    }
    let mut kept: Vec<&str> =
        told["patch"]["replay"]["kept"].as_array().unwrap().iter().map(|id| id.as_str().unwrap()).collect();
    kept.sort_unstable();
    assert_eq!(kept, ["sensor.gyro_delay", "vehicle.payload"], "{told}");
    let closed = told["patch"]["replay"]["closed"].as_f64().unwrap();
    assert!((0.8..1.05).contains(&closed), "{told}");
    let gyro = &told["patch"]["replay"]["channels"]
        .as_array()
        .unwrap()
        .iter()
        .find(|c| c["channel"] == "gyro_z_rad_s")
        .unwrap();
    // without the delay the gyro's error would stay
    assert!(gyro["rms_after"].as_f64().unwrap() < 0.5 * gyro["rms_before"].as_f64().unwrap(), "{gyro}");

    // a simulator whose gyro is as late already is not made later
    place.ok("simulate truth.toml --inputs hold.parquet --seed 3 -o after.parquet");
    place.write("late.toml", &format!("{ROBOT}{LATE}"));
    place.ok("simulate late.toml --inputs hold.parquet --seed 3 -o before.parquet");
    std::fs::remove_file(place.path("out/a-copy.xml")).unwrap();
    let text = place.ok(&format!("{LINE} {COMMAND}"));
    assert!(text.contains("left out sensor.gyro_delay"), "{text}");
    assert_eq!(json(&place, "told.json")["patch"]["log"]["file"], Value::Null);
}

#[test]
fn a_gyro_at_rest_has_no_ranges() {
    let place =
        Place::with(&[("rest.toml", &ROBOT.split("[vehicle]").next().unwrap().replace("driving", "stationary"))]);
    place.ok("simulate rest.toml --duration 600 --seed 1 -o log.csv");
    let line = "gap diagnose rest.toml --fit log.csv --ranges ranges.json";
    place.refused(line, 2, &["--ranges", "gyro at rest", "gyroid export CONFIG --to isaac-lab"]);
    assert!(!place.has("ranges.json"));
}
