//! `gyroid gap twin` and `gyroid gap compare`, as a user of another simulator runs them: the simulator stands for a foreign one, whose
//! constants nobody tells.

use crate::place::Place;
use crate::robots::json;
use gyroid::config::Config;
use gyroid::gap::Answer;
use gyroid::gap::answer::Verdict;
use gyroid::math::random::Stream;

/// A simulator of somebody's: no constant is that of `INIT`.
const THEIRS: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
    [gyro]\nc1_rad_s = 0.0\nc2_rad_s = 1e-3\ntime_constant_s = 200.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
    [vehicle]\nmass_kg = 14.0\nyaw_inertia_kg_m2 = 0.4\nhalf_track_m = 0.2\nwheel_radius_m = 0.07\n\
    wheel_inertia_kg_m2 = 0.001\nviscous_friction_n_m_s = 0.002\ntorque_noise_n_m_sqrt_s = 0.001\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n\
    [pose]\nrate_hz = 10.0\nposition_std_m = 0.002\nheading_std_rad = 0.002\n";
const SKID: &str = "[[effect]]\nid = \"wheel.lateral_skid\"\nlateral_slip_s = 0.03\n";
const AHEAD: &str = "[[effect]]\nid = \"vehicle.com_offset\"\noffset_m = 0.04\n";

/// Logs of one minute of `config` under these names, each with its seed.
fn drives(place: &Place, config: &str, names: &[(&str, u64)]) {
    place.write("made.toml", config);
    for (name, seed) in names {
        place.ok(&format!("simulate made.toml --course random --duration 60 --seed {seed} -o {name}"));
    }
}

/// A CSV log without its columns of torques.
fn without_torques(log: &str) -> String {
    let header = log.lines().next().unwrap().split(',');
    let kept: Vec<usize> = header.enumerate().filter(|(_, c)| !c.contains("torque")).map(|c| c.0).collect();
    let cut = |row: &str| {
        let cells: Vec<&str> = row.split(',').collect();
        kept.iter().map(|i| cells[*i]).collect::<Vec<_>>().join(",") + "\n"
    };
    log.lines().map(cut).collect()
}

#[test]
fn constants_of_a_simulator_are_told_with_their_errors() {
    let place = Place::with(&[]);
    drives(&place, THEIRS, &[("sim.parquet", 1)]);
    let told = json(&place, "gap twin sim.parquet -o twin.toml");
    // the wheels' inertia moves with the mass: M + 2 Jw/r², Jc + 2 Jw b²/r²
    let wheels_kg = 2.0 * 0.001 / (0.07 * 0.07);
    for (name, truth) in [
        ("mass_kg", 14.0 + wheels_kg),
        ("yaw_inertia_kg_m2", 0.4 + wheels_kg * 0.04),
        ("half_track_m", 0.2),
        ("wheel_radius_m", 0.07),
        ("wheel_radius_left_m", 0.07),
        ("wheel_radius_right_m", 0.07),
        ("viscous_friction_n_m_s", 0.002),
        ("torque_noise_n_m_sqrt_s", 0.001),
        ("encoder_speed_noise_std_rad_s", 0.02),
        ("pose_position_std_m", 0.002),
        ("pose_heading_std_rad", 0.002),
        ("gyro_angle_random_walk_rad_sqrt_s", 1.5e-4),
        ("gyro_c2_rad_s", 1e-3),
    ] {
        let p = &told["twin"]["parameters"][name];
        let (value, std) = (p["value"].as_f64().unwrap(), p["std"].as_f64().unwrap());
        assert!((value - truth).abs() < 4.0 * std, "{name}: {value} ± {std}, true {truth}");
        // and well enough to be of use
        assert!(std < 0.1 * truth, "{name}: {value} ± {std}");
        assert_eq!(p["source"], "log");
    }
    // the simulator's own log has no gap to its twin
    assert_eq!(told["twin"]["fit"]["left"], "none");
    assert_eq!(told["twin"]["effects"], serde_json::json!([]));
    for channel in told["twin"]["fit"]["channels"].as_array().unwrap() {
        let [nis, low, high] =
            [&channel["nis_mean"], &channel["nis_mean_bounds95"][0], &channel["nis_mean_bounds95"][1]]
                .map(|v| v.as_f64().unwrap());
        // twice as wide: six channels are looked at
        assert!((nis - 1.0).abs() < 2.0 * (high - low), "{channel}");
    }
    let config = Config::parse(&place.read("twin.toml"), "twin.toml").unwrap();
    assert!(config.effects.is_empty() && config.vehicle.unwrap().wheel_inertia_kg_m2 == 0.0);
}

/// Mass and inertia decide nothing without torques: no value is asked for.
#[test]
fn without_torques_neither_mass_nor_inertia_is_needed() {
    let place = Place::with(&[]);
    drives(&place, THEIRS, &[("all.csv", 1)]);
    place.write("sim.csv", &without_torques(&place.read("all.csv")));
    let told = json(&place, "gap twin sim.csv -o twin.toml");
    let p = &told["twin"]["parameters"];
    assert_eq!((p["mass_kg"]["value"].as_f64(), p["mass_kg"]["source"].as_str()), (Some(1.0), Some("convention")));
    for (name, truth) in [("wheel_radius_m", 0.07), ("half_track_m", 0.2)] {
        let [value, std] = ["value", "std"].map(|key| p[name][key].as_f64().unwrap());
        assert!((value - truth).abs() < 4.0 * std, "{name}: {value} ± {std}, true {truth}");
    }
}

/// Gyro and wheels both read the motion; the noise of one is read by it alone.
#[test]
#[ignore = "battery: some ten seconds and more"]
fn battery_without_torques_a_gyro_that_is_noisier_than_the_simulators_is_named() {
    let place = Place::with(&[]);
    drives(&place, THEIRS, &[("sim.csv", 1), ("same.csv", 2)]);
    let level = "[[effect]]\nid = \"gyro.noise_level\"\nnoise_over_nominal = 2.5\n";
    drives(&place, &format!("{THEIRS}{level}"), &[("real.csv", 3), ("hold.csv", 4)]);
    for name in ["sim.csv", "same.csv", "real.csv", "hold.csv"] {
        place.write(&format!("bare_{name}"), &without_torques(&place.read(name)));
    }
    let compare = "gap compare --sim bare_sim.csv --real";
    let told = json(&place, &format!("{compare} bare_real.csv --hold bare_hold.csv --write-sim augmented.toml"));
    assert_eq!((&told["verdict"], &told["main"]), (&"identified".into(), &"gyro.noise_level".into()));
    let [over, std] = ["parameters", "std"].map(|key| told["effects"][0][key]["noise_over_nominal"].as_f64().unwrap());
    assert!((over - 2.5).abs() < 4.0 * std && std < 0.5, "{over} ± {std}");
    assert!(place.read("augmented.toml").contains("gyro.noise_level"));
    assert_eq!(json(&place, &format!("{compare} bare_same.csv"))["verdict"], "none");
}

#[test]
fn what_simulator_and_robot_share_is_not_named_and_what_the_robot_has_alone_is() {
    let place = Place::with(&[]);
    drives(&place, &format!("{THEIRS}{SKID}"), &[("sim.parquet", 1)]);
    drives(&place, &format!("{THEIRS}{SKID}{AHEAD}"), &[("real.parquet", 3), ("hold.parquet", 4)]);
    let told =
        json(&place, "gap compare --sim sim.parquet --real real.parquet --hold hold.parquet --write-twin twin.toml");
    let answer: Answer = serde_json::from_value(told.clone()).unwrap();
    assert_eq!(answer.together, ["vehicle.com_offset"], "{:?}", answer.effects);
    assert_eq!((answer.verdict, answer.main.as_deref()), (Verdict::Identified, Some("vehicle.com_offset")));
    let (value, std) = (answer.effects[0].parameters["offset_m"], answer.effects[0].std["offset_m"]);
    // M d turns the robot, and the twin's mass holds the wheels' inertia: M + 2 Jw/r²
    let ahead = 0.04 * 14.0 / (14.0 + 2.0 * 0.001 / (0.07 * 0.07));
    assert!((value - ahead).abs() < 4.0 * std, "{value} ± {std}");
    assert!(answer.effects[0].gap_closed.unwrap() > 0.8, "{:?}", answer.effects[0]);
    // the skid is the simulator's own
    assert_eq!(told["twin"]["effects"][0]["id"], "wheel.lateral_skid");
    assert!(place.read("twin.toml").contains("wheel.lateral_skid"));
}

#[test]
#[ignore = "battery: some seconds"]
fn battery_what_the_simulator_has_as_well_is_no_difference() {
    let place = Place::with(&[]);
    drives(&place, &format!("{THEIRS}{SKID}"), &[("sim.parquet", 1), ("same.parquet", 2)]);
    let same = json(&place, "gap compare --sim sim.parquet --real same.parquet");
    assert_eq!(same["verdict"], "none", "{:?}", same["together"]);
}

/// Gains of the gyro that swing by 40 %, at another phase in each log: no model of ours stands for that.
#[test]
#[ignore = "battery: some ten seconds and more"]
fn battery_a_simulator_that_no_model_stands_for_is_not_judged() {
    let place = Place::with(&[]);
    drives(&place, THEIRS, &[("sim.csv", 1), ("real.csv", 2)]);
    for (name, phase) in [("sim.csv", 0.0), ("real.csv", 2.0)] {
        let log = place.read(name);
        let (header, rows) = log.split_once('\n').unwrap();
        let gyro = header.split(',').position(|c| c == "gyro_z_rad_s").unwrap();
        let swung = |row: &str| {
            let mut cells: Vec<String> = row.split(',').map(str::to_string).collect();
            let [t_s, rate_rad_s]: [f64; 2] = [&cells[0], &cells[gyro]].map(|c| c.parse().unwrap());
            cells[gyro] = format!("{:.7}", rate_rad_s * (1.0 + 0.4 * (0.7 * t_s + phase).sin()));
            cells.join(",") + "\n"
        };
        place.write(
            &format!("swung_{name}"),
            &(header.to_string() + "\n" + &rows.lines().map(swung).collect::<String>()),
        );
    }
    let page = place.ok("gap compare --sim swung_sim.csv --real swung_real.csv --json told.json");
    let answer: Answer = serde_json::from_str(&place.read("told.json")).unwrap();
    assert_eq!(answer.verdict, Verdict::CannotTell, "{page}");
    assert!(page.contains("CANNOT TELL: our model does not move as the simulator does"), "{page}");
    assert!(answer.effects.iter().all(|e| e.gap_closed.is_none()));
}

#[test]
fn logs_that_cannot_be_compared_are_refused_with_the_reason() {
    let place = Place::with(&[]);
    drives(&place, THEIRS, &[("sim.csv", 1), ("real.csv", 2)]);
    let log = place.read("sim.csv");
    let rows: Vec<&str> = log.lines().collect();
    let column = |name: &str| rows[0].split(',').position(|c| c == name).unwrap();
    // some columns of the log, under their names
    let cut = |names: &[&str], rows: &[&str]| -> String {
        let at: Vec<usize> = names.iter().map(|n| column(n)).collect();
        rows.iter()
            .map(|r| at.iter().map(|i| r.split(',').nth(*i).unwrap()).collect::<Vec<_>>().join(",") + "\n")
            .collect()
    };
    let wheels = ["t_s", "wheel_left_rad_s", "wheel_right_rad_s"];
    place.write("short.csv", &(rows[..60].join("\n") + "\n"));
    place.refused("gap twin short.csv -o twin.toml", 1, &["short.csv", "0.58 s", "second"]);
    place.write("wheels.csv", &cut(&wheels, &rows));
    place.refused("gap twin wheels.csv -o twin.toml", 1, &["wheels.csv", "wheel_radius_m", "--init"]);
    place.write("gyro.csv", &cut(&[&wheels[..], &["gyro_z_rad_s"]].concat(), &rows));
    place.write("torques.csv", &cut(&[&wheels[..], &["torque_left_n_m", "torque_right_n_m"]].concat(), &rows));
    place.write("init.toml", &THEIRS.replace("mass_kg = 14.0", "mass_kg = 11.0"));
    place.refused(
        "gap compare --sim torques.csv --real gyro.csv --init init.toml --write-twin twin.toml",
        1,
        &["gyro.csv", "neither torques nor gyro nor pose"],
    );
    // torques of another course, drawn at random, and of another scale
    let draw = &mut Stream::new(5, 0);
    let other: Vec<String> = rows[1..]
        .iter()
        .map(|r| {
            let mut cells: Vec<String> = r.split(',').map(str::to_string).collect();
            for name in ["torque_left_n_m", "torque_right_n_m"] {
                cells[column(name)] = format!("{:.6}", draw.normal());
            }
            cells.join(",")
        })
        .collect();
    place.write("other.csv", &format!("{}\n{}\n", rows[0], other.join("\n")));
    place.refused(
        "gap compare --sim sim.csv --real other.csv --paired --write-twin twin.toml",
        1,
        &["other.csv", "the commands differ from those of sim.csv", "--paired"],
    );
    place.refused("gap compare --sim sim.csv --real sim.csv", 2, &["sim.csv", "--sim", "--real"]);
    place.write("rest.csv", &cut(&["t_s", "gyro_z_rad_s"], &rows));
    place.refused("gap compare --sim sim.csv --real rest.csv", 2, &["rest.csv", "of a gyro at rest", "is a drive"]);
    assert!(!place.has("twin.toml"));
}

#[test]
fn imus_at_rest_are_compared_likewise() {
    let rest = |extra: &str| {
        format!(
            "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.2\n[gyro]\nc1_rad_s = 1e-3\nc2_rad_s = -2e-3\n\
             time_constant_s = 60.0\nangle_random_walk_rad_sqrt_s = 1e-4\n{extra}"
        )
    };
    let tone = "[[effect]]\nid = \"gyro.tone\"\nfrequency_hz = 0.31\namplitude_rad_s = 2.2e-4\n";
    let place = Place::with(&[("sim.toml", &rest("")), ("real.toml", &rest(tone))]);
    for (config, name, seed) in [("sim", "sim", 1), ("sim", "same", 2), ("real", "real", 3), ("real", "tone", 4)] {
        place.ok(&format!("simulate {config}.toml --duration 900 --seed {seed} -o {name}.csv"));
    }
    let told = json(&place, "gap compare --sim sim.csv --real real.csv");
    assert_eq!(told["main"], "gyro.tone");
    let c1 = &told["twin"]["parameters"]["gyro_c1_rad_s"];
    let (value, std) = (c1["value"].as_f64().unwrap(), c1["std"].as_f64().unwrap());
    assert!((value - 1e-3).abs() < 4.0 * std, "{value} ± {std}");
    for (sim, real) in [("sim", "same"), ("tone", "real")] {
        let told = json(&place, &format!("gap compare --sim {sim}.csv --real {real}.csv"));
        assert_eq!(told["verdict"], "none", "{sim} {real}: {}", told["together"]);
    }
}
