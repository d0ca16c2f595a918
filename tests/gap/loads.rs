//! `--load`: drives with a known load, as a user diagnoses, explains, plans and simulates them.

use crate::place::Place;
use crate::robots::{REST, driving, json};
use gyroid::ingest::{read_log, write_log};

/// A robot that drives with 3 kg on its 14 kg, a point mass at its centre of mass.
fn loaded(place: &Place) {
    place.ok("simulate robot.toml --course random --duration 60 --seed 4 --load 3 -o loaded.parquet");
}

/// As it is told what the robot carries a diagnosis finds nothing; without it, a payload.
#[test]
fn a_load_that_is_known_is_no_finding() {
    let place = Place::with(&[("robot.toml", &driving(50.0, 0.005))]);
    loaded(&place);
    let told = json(&place, "gap diagnose robot.toml --fit loaded.parquet --load loaded.parquet=3");
    assert_eq!(told["verdict"], "none", "{told}");
    assert!(told["notes"].to_string().contains("known load of 3 kg"), "{}", told["notes"]);
    let untold = json(&place, "gap diagnose robot.toml --fit loaded.parquet");
    assert_eq!(untold["main"], "vehicle.payload", "{untold}");
    // its mass is that of the load, and its inertia none
    let explain = "gap explain robot.toml --fit loaded.parquet --effect vehicle.payload";
    let sizes = |answer: &serde_json::Value| {
        ["mass_relative", "inertia_relative"].map(|name| {
            let of = &answer["effects"][0]["parameters"][name];
            [of["estimate"].as_f64().unwrap(), of["std"].as_f64().unwrap()]
        })
    };
    let truths = [[3.0 / 14.0, 0.0], [0.0, 0.0]];
    for (line, truth) in [explain.to_string(), format!("{explain} --load loaded.parquet=3")].iter().zip(truths) {
        for ([estimate, std], truth) in sizes(&json(&place, line)).into_iter().zip(truth) {
            assert!((estimate - truth).abs() < 5.0 * std && std < 0.02, "{line}: {estimate} ± {std}, {truth}");
        }
    }
}

/// A twin of the simulator carries what the robot is told to have carried.
#[test]
#[ignore = "battery: some seconds"]
fn battery_a_load_that_is_known_is_no_difference_of_simulator_and_robot() {
    let place = Place::with(&[("robot.toml", &driving(50.0, 0.005))]);
    loaded(&place);
    place.ok("simulate robot.toml --course random --duration 60 --seed 5 -o sim.parquet");
    let compare = "gap compare --sim sim.parquet --real loaded.parquet --init robot.toml";
    let told = json(&place, &format!("{compare} --load loaded.parquet=3"));
    assert_eq!(told["verdict"], "none", "{told}");
    assert_eq!(json(&place, compare)["main"], "vehicle.payload");
    place.refused(&format!("{compare} --load sim.parquet=3"), 2, &["no file of a drive", "loaded.parquet"]);
}

/// The wheels alone, with their torques, read a payload and a larger radius alike, on every course without a known load.
#[test]
fn the_plan_asks_for_a_known_load_where_nothing_else_tells() {
    let nominal = driving(50.0, 0.005);
    let with = format!("{nominal}[[effect]]\nid = \"vehicle.payload\"\nmass_relative = 0.15\n");
    let place = Place::with(&[("robot.toml", &nominal), ("with.toml", &with)]);
    let kept = |name: &str| {
        let mut log = read_log(place.path(name)).unwrap();
        log.channels.retain(|c| c.name.starts_with("torque_") || c.name.starts_with("wheel_"));
        write_log(place.path(name), &log).unwrap();
    };
    place.ok("simulate with.toml --course random --duration 40 --seed 3 -o empty.parquet");
    kept("empty.parquet");
    let line = "gap plan robot.toml --fit empty.parquet --among vehicle.payload wheel.radius_scale --experiment";
    let found =
        json(&place, &format!("{line} again spins squares circles speed_steps ramp varied payload -o next.parquet"));
    let experiments = found["experiments"].as_array().unwrap();
    let first = &experiments[0];
    assert_eq!((first["name"].as_str(), first["separates"].as_bool()), (Some("payload"), Some(true)), "{first}");
    assert_eq!(first["load_kg"].as_f64(), Some(2.8));
    let nats = first["nats"].as_f64().unwrap();
    for other in &experiments[1..] {
        assert!(other["load_kg"].is_null(), "{other}");
        // what is left is the price of a payload's second size
        assert!(other["nats"].as_f64().unwrap() < 0.2 * nats, "{}: {}, and {nats}", other["name"], other["nats"]);
    }
    let text = place.ok(&format!("{line} payload"));
    assert!(text.contains("The load is 2.8 kg.") && text.contains("--fit LOG --fit NEW --load NEW=2.8"), "{text}");
    // the robot as it is, on the course and with the load that were asked for
    place.ok("simulate with.toml --inputs next.parquet --load 2.8 --seed 9 -o loaded.parquet");
    kept("loaded.parquet");
    let told =
        json(&place, "gap diagnose robot.toml --fit empty.parquet --fit loaded.parquet --load loaded.parquet=2.8");
    assert_eq!(told["main"], "vehicle.payload", "{told}");
    let size = told["effects"][0]["parameters"]["mass_relative"].as_f64().unwrap();
    let std = told["effects"][0]["std"]["mass_relative"].as_f64().unwrap();
    assert!((size - 0.15).abs() < 5.0 * std && std < 0.02, "{size} ± {std}");
    let beside = |class: &serde_json::Value| {
        ["vehicle.payload", "wheel.radius_scale"].iter().all(|id| class.to_string().contains(id))
    };
    let classes = told["cannot_tell_apart"].as_array().unwrap();
    assert!(!classes.iter().any(beside), "{classes:?}");
}

/// A load that the robot carried in the log is no size of a rival, and stays on it.
#[test]
fn the_plan_knows_the_load_of_the_log() {
    let place = Place::with(&[("robot.toml", &driving(50.0, 0.005))]);
    loaded(&place);
    let line =
        "gap plan robot.toml --fit loaded.parquet --among vehicle.payload motor.torque_gain --experiment payload";
    let (untold, told) = (json(&place, line), json(&place, &format!("{line} --load loaded.parquet=3")));
    let size = |plan: &serde_json::Value| {
        let rivals = plan["rivals"].as_array().unwrap();
        let payload = rivals.iter().find(|r| r["id"] == "vehicle.payload");
        payload.map_or(0.0, |r| r["parameters"]["mass_relative"].as_f64().unwrap())
    };
    assert!(size(&untold) > 0.15 && size(&told).abs() < 0.05, "{untold}\n{told}");
    assert_eq!((untold["load_kg"].as_f64(), told["load_kg"].as_f64()), (Some(0.0), Some(3.0)));
    // a fifth of the robot's mass more
    assert_eq!(told["experiments"][0]["load_kg"].as_f64(), Some(5.8), "{told}");
}

#[test]
fn a_load_of_no_drive_and_one_that_is_no_mass_are_refused() {
    let place = Place::with(&[("robot.toml", &driving(50.0, 0.005)), ("rest.toml", REST)]);
    loaded(&place);
    place.ok("simulate rest.toml --duration 400 --seed 3 -o rest.csv");
    for command in [
        "gap diagnose robot.toml --fit",
        "gap explain robot.toml --effect vehicle.payload --fit",
        "gap plan robot.toml --fit",
        "gap power robot.toml --inputs",
    ] {
        let line = format!("{command} loaded.parquet --load");
        place.refused(&format!("{line} load.parquet=3"), 2, &["--load", "\"load.parquet\"", "loaded.parquet"]);
        place.refused(&format!("{line} loaded.parquet"), 2, &["--load", "\"loaded.parquet\"", "FILE=KG"]);
        for load in ["-3", "nan", "inf", "3kg", ""] {
            place.refused(&format!("{line} loaded.parquet={load}"), 2, &["--load", &format!("{load:?}"), "in kg"]);
        }
        let twice = format!("{line} loaded.parquet=3 --load loaded.parquet=1");
        place.refused(&twice, 2, &["--load", "two loads", "sum"]);
    }
    place.refused("gap diagnose rest.toml --fit rest.csv --load rest.csv=3", 2, &["--load", "at rest", "leave"]);
    let simulate = "simulate robot.toml -o new.parquet --course random --load";
    place.refused(&format!("{simulate} -3"), 2, &["--load", "-3 kg", "zero or more"]);
    place.refused(&format!("{simulate} nan"), 2, &["--load", "NaN kg"]);
    place.refused("simulate rest.toml -o new.parquet --load 3", 2, &["--load", "at rest"]);
}
