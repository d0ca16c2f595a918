//! `gyroid gap fleet` and `gyroid merge`, as those who have many robots run them.

use crate::place::Place;
use serde_json::Value;

const REST: &str = "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.2\n\
    [gyro]\nc1_rad_s = 1e-3\nc2_rad_s = -2e-3\ntime_constant_s = 120.0\nangle_random_walk_rad_sqrt_s = 1e-4\n\
    turn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.03\n";

/// Four robots with a recording each: all vibrate, by amounts that differ, and the third one's noise is that of another gyro.
fn fleet() -> Place {
    let place = Place::with(&[("sim.toml", REST)]);
    for (robot, amplitude) in [2.0e-4, 2.6e-4, 2.3e-4, 1.8e-4].into_iter().enumerate() {
        let mut real =
            format!("{REST}[[effect]]\nid = \"gyro.tone\"\nfrequency_hz = 0.31\namplitude_rad_s = {amplitude:e}\n");
        if robot == 2 {
            real += "[[effect]]\nid = \"gyro.noise_level\"\nnoise_over_nominal = 1.6\n";
        }
        place.write(&format!("real_{robot}.toml"), &real);
        std::fs::create_dir_all(place.path(&format!("fleet/robot_{robot}"))).unwrap();
        place
            .ok(&format!("simulate real_{robot}.toml --duration 500 --seed 2{robot} -o fleet/robot_{robot}/still.csv"));
    }
    place
}

fn effect<'a>(answer: &'a Value, id: &str) -> &'a Value {
    answer["effects"].as_array().unwrap().iter().find(|e| e["id"] == id).unwrap_or_else(|| panic!("{id} in {answer}"))
}

#[test]
fn what_all_robots_have_is_told_from_what_one_has() {
    let place = fleet();
    place.write("fleet/robot_1/torn.csv", "t_s,gyro_z_rad_s\n1,x\n");
    let text = place.unfit("gap fleet sim.toml fleet --results one.parquet --json one.json");
    let answer: Value = serde_json::from_str(&place.read("one.json")).unwrap();
    assert_eq!((answer["rows"].as_array().unwrap().len(), &answer["failed"]), (5, &1.into()));
    let tone = effect(&answer, "gyro.tone");
    assert_eq!((&tone["reach"], &tone["units"].as_array().unwrap().len()), (&"common".into(), &4));
    assert!(tone["shared"]["all"].as_f64().unwrap() > 0.9, "{tone}");
    let noise = effect(&answer, "gyro.noise_level");
    assert_eq!((&noise["reach"], &noise["parameter"]), (&"some".into(), &"noise_over_nominal".into()), "{noise}");
    let has = |unit: &Value| unit["probability"].as_f64().unwrap() > 0.5;
    let have: Vec<bool> = noise["shared"]["units"].as_array().unwrap().iter().map(has).collect();
    assert_eq!(have, [false, false, true, false], "{noise}");
    assert!(text.contains("common to all 4 robots") && text.contains("in 1 of 4 robots: fleet/robot_2"), "{text}");
    assert!(text.contains("torn.csv") && text.contains("error:"), "{text}");

    // parts, in two rounds, make the table of one run
    let again = " --resume --effect gyro.noise_level gyro.tone";
    for round in ["", again] {
        for part in 1..=2 {
            place.run(&format!("gap fleet sim.toml fleet --shard {part}/2 --results part_{part}.parquet{round}"));
        }
        let text = place.unfit("merge part_2.parquet part_1.parquet part_2.parquet -o all.parquet --force");
        assert_eq!(text.contains(again), round.is_empty(), "{text}");
    }
    let [all, one] = ["all.parquet", "one.parquet"].map(|name| std::fs::read(place.path(name)).unwrap());
    assert!(all == one);
    // an effect that a recording cannot show costs it no diagnosis
    let text = place.ok("gap fleet sim.toml fleet/robot_0 --effect gyro.temperature_sensitivity --json none.json");
    let none: Value = serde_json::from_str(&place.read("none.json")).unwrap();
    let row = &none["rows"][0];
    assert!(
        row["verdict"] == "identified" && row["error"].is_null() && none["effects"] == Value::Array(vec![]),
        "{text}"
    );
    assert!(row["notes"].as_str().unwrap().contains("gyro.temperature_sensitivity are not fitted"), "{row}");
    // a table of another simulator is not gone on with
    place.write("other.toml", &REST.replace("120.0", "90.0"));
    place.run("gap fleet other.toml fleet --shard 1/2 --results other.parquet");
    place.refused("merge part_1.parquet other.parquet -o mixed.parquet", 1, &["config_sha256", "same options"]);
}
