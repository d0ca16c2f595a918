//! `--simulate`, with a simulator of nobody's: a script that gives one of two logs that were made before, as the model's mass says.

use crate::place::Place;
use gyroid::ingest::{read_log, write_log};
use gyroid::signal::names;
use serde_json::Value;

pub(crate) const ROBOT_XML: &str = include_str!("../../examples/mujoco/robot.xml");
pub(crate) const ROBOT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
    [gyro]\nc1_rad_s = 0.0\nc2_rad_s = 0.0\ntime_constant_s = 200.0\nangle_random_walk_rad_sqrt_s = 1.8e-4\n\
    [vehicle]\nmass_kg = 12.0\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.065\n\
    wheel_inertia_kg_m2 = 0.00133\nviscous_friction_n_m_s = 0.004\ntorque_noise_n_m_sqrt_s = 0.001\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n\
    [pose]\nrate_hz = 10.0\nposition_std_m = 0.002\nheading_std_rad = 0.002\n";
pub(crate) const LOAD: &str = "[[effect]]\nid = \"vehicle.payload\"\nmass_relative = 0.2\ninertia_relative = 0.2\n";
/// Notes each model that it is given.
const SIMULATOR: &str = "echo \"$1\" >> models.txt\n\
    test -f \"$2\" || exit 4\n\
    if grep -q 'mass=\"11.1\"' \"$1\"; then cp before.parquet \"$3\"; else cp after.parquet \"$3\"; fi\n";
/// Its words are parted by tabs: those of the program's line are parted by spaces.
pub(crate) const COMMAND: &str = "--simulate sh\tsimulator.sh\t{model}\t{inputs}\t{log}";
const LINE: &str =
    "gap diagnose robot.toml --fit fit.parquet --hold hold.parquet --patch robot.xml -o out/copy.xml --json told.json";

/// Recordings of a robot with this effect, and logs of `simulator` with it and without.
fn place(effect: &str, simulator: &str) -> Place {
    let truth = format!("{ROBOT}{effect}");
    let place = Place::with(&[
        ("robot.xml", ROBOT_XML),
        ("robot.toml", ROBOT),
        ("truth.toml", &truth),
        ("simulator.sh", simulator),
    ]);
    std::fs::create_dir(place.path("out")).unwrap();
    for (name, seed) in [("fit", 1), ("hold", 2)] {
        place.ok(&format!("simulate truth.toml --course random --duration 60 --seed {seed} -o {name}.parquet"));
    }
    place.ok("simulate robot.toml --inputs hold.parquet --seed 3 -o before.parquet");
    place.ok("simulate truth.toml --inputs hold.parquet --seed 3 -o after.parquet");
    place
}

fn beside_the_copy(place: &Place) -> Vec<String> {
    let names = std::fs::read_dir(place.path("out")).unwrap().map(|f| f.unwrap().file_name().into_string().unwrap());
    names.collect()
}

#[test]
fn what_makes_their_simulator_better_is_entered_and_nothing_else() {
    let place = place(LOAD, SIMULATOR);
    let text = place.ok(&format!("{LINE} {COMMAND}"));
    let told: Value = serde_json::from_str(&place.read("told.json")).unwrap();
    let replay = &told["patch"]["replay"];
    assert_eq!(replay["kept"], serde_json::json!(["vehicle.payload"]), "{told}");
    let [closed, low] = [&replay["closed"], &replay["ci95"][0]].map(|v| v.as_f64().unwrap());
    // the motors' noise is drawn anew in each run, and no model closes it
    assert!(0.8 < closed && closed < 1.05 && 0.5 < low && low < closed, "{replay}");
    let channels: Vec<&str> =
        replay["channels"].as_array().unwrap().iter().map(|c| c["channel"].as_str().unwrap()).collect();
    let all = [
        "wheel_left_rad_s",
        "wheel_right_rad_s",
        "gyro_z_rad_s",
        "moved_ahead_1s_m",
        "moved_left_1s_m",
        "turned_1s_rad",
    ];
    assert_eq!(channels, all);
    assert!(text.contains(&format!("in your simulator, on hold.parquet: closes {:.1} %", 100.0 * closed)), "{text}");
    assert!(!place.read("out/copy.xml").contains("mass=\"11.1\""));
    // the patched model lay beside the copy, and went
    let models = place.read("models.txt");
    let models: Vec<&str> = models.lines().collect();
    assert!(models.len() == 2 && models[0] == "robot.xml" && models[1].contains("out/gyroid-"), "{models:?}");
    assert_eq!(beside_the_copy(&place), ["copy.xml"]);

    // a simulator that does not become better is not told anything
    std::fs::remove_file(place.path("out/copy.xml")).unwrap();
    std::fs::copy(place.path("before.parquet"), place.path("after.parquet")).unwrap();
    let text = place.ok(&format!("{LINE} {COMMAND}"));
    assert!(text.contains("did not write out/copy.xml") && text.contains("left out vehicle.payload"), "{text}");
    let told: Value = serde_json::from_str(&place.read("told.json")).unwrap();
    assert_eq!((&told["patch"]["file"], &told["patch"]["replay"]["kept"]), (&Value::Null, &serde_json::json!([])));
    assert_eq!(beside_the_copy(&place), [] as [&str; 0]);
}

/// Simulators of robots whose motors hold speeds follow the speeds that were asked for.
#[test]
#[ignore = "battery: some seconds"]
fn battery_a_simulator_without_torques_gets_the_commands() {
    let wide = "[[effect]]\nid = \"wheel.radius_scale\"\nrelative = 0.03\n";
    let simulator =
        SIMULATOR.replace("mass=\"11.1\"", "size=\"0.065 ").replace("test -f", "cp \"$2\" seen.csv; test -f");
    let place = place(wide, &simulator);
    for name in ["fit.parquet", "hold.parquet"] {
        let mut log = read_log(place.path(name)).unwrap();
        let asked = [names::WHEEL_LEFT, names::WHEEL_RIGHT].map(|wheel| log.require(wheel).unwrap().to_vec());
        log.channels.retain(|c| !c.name.starts_with("torque_"));
        for (name, values) in [names::COMMAND_LEFT, names::COMMAND_RIGHT].into_iter().zip(asked) {
            log.push(name, values).unwrap();
        }
        write_log(place.path(name), &log).unwrap();
    }
    place.ok(&format!("{LINE} {COMMAND}"));
    let told: Value = serde_json::from_str(&place.read("told.json")).unwrap();
    assert_eq!(told["patch"]["replay"]["kept"], serde_json::json!(["wheel.radius_scale"]), "{told}");
    assert!(place.read("seen.csv").starts_with("t_s,command_left_rad_s,command_right_rad_s\n0,"));

    // neither torques nor commands
    std::fs::remove_file(place.path("out/copy.xml")).unwrap();
    let mut log = read_log(place.path("hold.parquet")).unwrap();
    log.channels.retain(|c| !c.name.starts_with("command_"));
    write_log(place.path("bare.parquet"), &log).unwrap();
    let line = LINE.replace("hold.parquet", "bare.parquet");
    place.refused(&format!("{line} {COMMAND}"), 2, &["--simulate", "bare.parquet", "torques or commands", "--map"]);
}

#[test]
fn a_simulator_that_fails_is_said_and_nothing_is_written() {
    let place = place(LOAD, SIMULATOR);
    let refused = |line: &str, code: i32, parts: &[&str]| {
        place.refused(line, code, parts);
        assert!(!place.has("told.json") && beside_the_copy(&place).is_empty(), "{line}");
    };
    let with = |command: &str| format!("{LINE} --simulate {}", command.replace(' ', "\t"));
    refused(&with("run {model} {inputs}"), 2, &["--simulate", "has no {log}", "hint"]);
    let broken = "echo {model} {inputs} {log}; echo broken >&2; exit 3";
    refused(&with(broken), 2, &["--simulate", "robot.xml", "exit status: 3", "broken", "by hand"]);
    refused(&with("true {model} {inputs} {log}"), 2, &["wrote no {log}"]);
    refused(&with("cp robot.xml {log}; true {model} {inputs}"), 1, &["the simulator's log with robot.xml"]);
    place.ok("simulate robot.toml --course random --duration 20 --seed 3 -o before.parquet");
    refused(&format!("{LINE} {COMMAND}"), 1, &["the simulator's log with robot.xml", "0 to 60.00 s"]);
    let alone = LINE.replace(" --hold hold.parquet", "");
    refused(&format!("{alone} {COMMAND}"), 2, &["--simulate", "--hold"]);
    let unpatched = LINE.replace(" --patch robot.xml -o out/copy.xml", "");
    refused(&format!("{unpatched} {COMMAND}"), 2, &["--patch"]);
}
