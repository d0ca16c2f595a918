//! `gyroid gap power`, as a user asks what a log could have found.

use crate::place::Place;
use crate::robots::{REST, driving, json};
use gyroid::gap::answer::Verdict;

/// Effect that the diagnosis names in a log of `config` with `effect` of this size, by other chance than the power's.
fn named(place: &Place, config: &str, inputs: &str, effect: (&str, &str, f64)) -> Option<String> {
    let (id, parameter, size) = effect;
    place.write("with.toml", &format!("{config}[[effect]]\nid = \"{id}\"\n{parameter} = {size:e}\n"));
    place.ok(&format!("simulate with.toml --inputs {inputs} --seed 4711 -o with.parquet"));
    let answer = json(place, "gap diagnose nominal.toml --fit with.parquet");
    let is_named = answer["verdict"] == serde_json::json!(Verdict::Identified);
    is_named.then(|| answer["main"].as_str().unwrap().to_string())
}

#[test]
#[ignore = "battery: some ten seconds and more"]
fn battery_a_size_at_rest_is_named_and_a_third_of_it_is_not() {
    let place = Place::with(&[("nominal.toml", REST)]);
    place.ok("simulate nominal.toml --duration 1800 --seed 3 -o rest.csv");
    let found = json(&place, "gap power nominal.toml --inputs rest.csv --effect gyro.rate_ramp --cases 4 --plot p.svg");
    assert_eq!((found["schema"].as_str(), found["kind"].as_str()), (Some("gyroid.gap.power/1"), Some("stationary")));
    let both = found["effects"].as_array().unwrap();
    assert_eq!(both.iter().map(|e| e["sign"].as_i64().unwrap()).collect::<Vec<_>>(), [1, -1]);
    let sizes: Vec<f64> = both.iter().map(|e| e["smallest"].as_f64().unwrap()).collect();
    // a ramp shows as much upwards as downwards
    assert!(sizes[0] > 0.0 && sizes[1] < 0.0 && (sizes[0] / -sizes[1]).ln().abs() < 1.0, "{sizes:?}");
    for size in sizes {
        let of = |share: f64| named(&place, REST, "rest.csv", ("gyro.rate_ramp", "ramp_rad_s2", share * size));
        assert_eq!(of(1.6).as_deref(), Some("gyro.rate_ramp"), "{size}");
        assert_ne!(of(0.33).as_deref(), Some("gyro.rate_ramp"), "{size}");
    }
    for effect in both {
        let nats = effect["evidence_nats"].as_f64().unwrap();
        assert!((1.0..40.0).contains(&nats), "{effect}");
    }
    assert!(place.read("p.svg").contains("rate ramp"));
}

#[test]
#[ignore = "battery: some ten seconds and more"]
fn battery_a_size_of_a_drive_is_named_and_what_its_channels_cannot_show_is_said() {
    let config = driving(10.0, 0.002);
    let place = Place::with(&[("nominal.toml", &config)]);
    place.ok("simulate nominal.toml --course random --duration 40 --seed 3 -o drive.parquet");
    let line = "gap power nominal.toml --inputs drive.parquet --effect wheel.radius_mismatch --cases 3";
    let found = json(&place, line);
    let size = found["effects"][0]["smallest"].as_f64().unwrap();
    let of = |share: f64| {
        let effect = ("wheel.radius_mismatch", "right_over_left_minus_one", share * size);
        named(&place, &config, "drive.parquet", effect)
    };
    assert_eq!(of(2.0).as_deref(), Some("wheel.radius_mismatch"), "{size}");
    assert_ne!(of(0.25).as_deref(), Some("wheel.radius_mismatch"), "{size}");
    assert_eq!(json(&place, line), found, "the same seed gives the same sizes");
    // without torques nothing tells a load
    let log = gyroid::ingest::read_log(place.path("drive.parquet")).unwrap();
    let names = ["gyro_z_rad_s", "wheel_left_rad_s", "wheel_right_rad_s", "x_m", "y_m", "heading_rad"];
    let row = |i: usize| {
        let values =
            names.map(|n| log.get(n).unwrap()[i]).map(|v| if v.is_nan() { String::new() } else { v.to_string() });
        format!("{},{}\n", log.time.at(i), values.join(","))
    };
    let rows: String = (0..log.len()).map(row).collect();
    place.write("bare.csv", &format!("t_s,{}\n{rows}", names.join(",")));
    let text = place.ok("gap power nominal.toml --inputs bare.csv --effect vehicle.payload --cases 3");
    assert!(text.contains("not sought: payload (vehicle.payload), the channels of this log cannot show it"), "{text}");
}

#[test]
fn bad_input_is_said() {
    let place = Place::with(&[("nominal.toml", REST)]);
    place.ok("simulate nominal.toml --duration 300 --seed 3 -o rest.csv");
    let line = "gap power nominal.toml --inputs rest.csv";
    place.refused(&format!("{line} --effect gyro.tones"), 2, &["--effect", "gyro.tones", "gyro.tone"]);
    place.refused(&format!("{line} --probability 0.3"), 2, &["--probability", "0.3", "0.5 to 0.99"]);
    place.refused(&format!("{line} --cases 2"), 2, &["--cases"]);
    place.refused(&format!("{line} --plot p.pdf"), 2, &["p.pdf", ".svg or .png"]);
    place.refused("gap power rest.csv --inputs nominal.toml", 2, &["gyroid gap power nominal.toml --inputs rest.csv"]);
    place.refused(&format!("{line} rest.csv"), 2, &["--inputs", "several files"]);
    assert!(!place.has("p.pdf"));
}
