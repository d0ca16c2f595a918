//! `gyroid init`: what it writes is a base for a fit, and says what is left to fill in.

use crate::place::Place;
use serde_json::Value;

const URDF: &str = r#"<?xml version="1.0"?>
<robot name="rover">
  <link name="base_link"><inertial><mass value="8"/><inertia ixx="0.1" iyy="0.1" izz="0.2"/></inertial></link>
  <link name="left_wheel"><collision><geometry><cylinder radius="0.06" length="0.03"/></geometry><origin rpy="1.5707963 0 0"/></collision>
    <inertial><mass value="0.5"/><inertia ixx="0.0005" iyy="0.0009" izz="0.0005"/></inertial></link>
  <link name="right_wheel"><collision><geometry><cylinder radius="0.06" length="0.03"/></geometry><origin rpy="1.5707963 0 0"/></collision>
    <inertial><mass value="0.5"/><inertia ixx="0.0005" iyy="0.0009" izz="0.0005"/></inertial></link>
  <joint name="left_joint" type="continuous"><parent link="base_link"/><child link="left_wheel"/><origin xyz="0 0.18 0"/><axis xyz="0 1 0"/></joint>
  <joint name="right_joint" type="continuous"><parent link="base_link"/><child link="right_wheel"/><origin xyz="0 -0.18 0"/><axis xyz="0 1 0"/></joint>
</robot>
"#;

fn fill(text: &str, key: &str, value: &str) -> String {
    let mut filled = false;
    let lines = text.lines().map(|line| match line.strip_prefix(&format!("# {key} =")) {
        Some(_) => {
            filled = true;
            format!("{key} = {value}")
        }
        None => line.to_string(),
    });
    let text = lines.collect::<Vec<_>>().join("\n");
    assert!(filled, "no open line {key} in\n{text}");
    text
}

#[test]
fn a_description_becomes_a_configuration_that_a_fit_takes_for_its_base() {
    let place = Place::with(&[("rover.urdf", URDF)]);
    let said = place.ok("init --urdf rover.urdf -o robot.toml --json init.json");
    for part in [
        "rover (URDF), two driven wheels: left left_joint",
        "to be filled in: encoder.speed_noise_std_rad_s",
        "gyroid fit LOG --base robot.toml",
    ] {
        assert!(said.contains(part), "{said}");
    }
    let json: Value = serde_json::from_str(&place.read("init.json")).unwrap();
    assert_eq!(json["schema"], "gyroid.init/1");
    assert_eq!(json["robot"]["half_track_m"]["value"], 0.18);
    assert_eq!(json["to_be_filled_in"], serde_json::json!(["encoder.speed_noise_std_rad_s"]));

    let text = place.read("robot.toml");
    let table: toml::Table = text.parse().unwrap();
    assert_eq!(table["vehicle"]["mass_kg"].as_float(), Some(9.0));
    assert_eq!(table["vehicle"]["wheel_radius_m"].as_float(), Some(0.06));
    assert_eq!(table["vehicle"]["wheel_inertia_kg_m2"].as_float(), Some(9e-4));
    assert_eq!(table["vehicle"]["steering"].as_str(), Some("differential"));
    // each value says where it comes from
    let values = text.lines().filter(|l| l.contains(" = ") && !l.starts_with('#') && !l.starts_with("schema"));
    values.for_each(|line| assert!(line.contains(" # "), "{line}"));

    // as it is, the reader says what is missing; filled in, it is used
    place.ok("init --kind rest -o gyro.toml");
    place.write("rest.csv", &log());
    place.refused(
        "fit rest.csv --base robot.toml --no-plot -o g.toml",
        1,
        &["1 key is missing: encoder.speed_noise_std_rad_s"],
    );
    place.write("filled.toml", &fill(&text, "speed_noise_std_rad_s", "0.02"));
    place.ok("fit rest.csv --base filled.toml --no-plot -o g.toml");
    place.ok("simulate g.toml --course square --duration 20 -o drive.parquet");
    place.ok("fit rest.csv --base gyro.toml --no-plot -o g2.toml");
}

fn log() -> String {
    let mut draw = gyroid::math::random::Stream::new(7, 0);
    let row = |i: u32| {
        format!("{},{}\n", f64::from(i) * 0.5, -3e-3 - 2e-3 * (-f64::from(i) / 400.0).exp() + 2e-4 * draw.normal())
    };
    std::iter::once("t_s,gyro_z_rad_s\n".to_string()).chain((0..4000).map(row)).collect()
}

#[test]
fn without_a_description_every_key_is_there_to_be_filled_in() {
    let place = Place::with(&[]);
    let said = place.ok("init --kind driving -o robot.toml");
    assert!(said.contains("vehicle.mass_kg, vehicle.yaw_inertia_kg_m2, vehicle.half_track_m"), "{said}");
    let mut text = place.read("robot.toml");
    // the reader names exactly the lines that are open
    place.refused(
        "simulate robot.toml --course square -o x.parquet",
        1,
        &["6 keys are missing: vehicle.mass_kg, vehicle.yaw_inertia_kg_m2", "encoder.speed_noise_std_rad_s"],
    );
    for key in [
        "mass_kg",
        "yaw_inertia_kg_m2",
        "half_track_m",
        "wheel_radius_m",
        "wheel_inertia_kg_m2",
        "speed_noise_std_rad_s",
    ] {
        text = fill(&text, key, "0.1");
    }
    for line in ["sample_time_s = 0.01", "[gyro]", "c1_rad_s = 0.0", "c2_rad_s = 0.0", "time_constant_s = 300.0"] {
        text = text.replace(&format!("# {line}"), line);
    }
    text = fill(&text, "angle_random_walk_rad_sqrt_s", "1e-4");
    // the tables that may be left out are right too
    for line in ["[traction.law.burckhardt]", "c1 = 1.2801", "c2 = 23.99", "c3 = 0.52", "[pose]"] {
        assert!(text.contains(&format!("# {line}")), "{line}");
        text = text.replace(&format!("# {line}"), line);
    }
    for key in [
        "rate_hz",
        "position_std_m",
        "heading_std_rad",
        "ticks_per_revolution",
        "torque_constant_n_m_a",
        "turn_on_bias_std_rad_s",
        "warm_up_relative_std",
        "cooling_time_constant_s",
    ] {
        text = fill(&text, key, "5.0");
    }
    place.write("filled.toml", &text);
    place.ok("simulate filled.toml --course square --duration 5 -o x.parquet");
}

#[test]
fn nothing_of_the_users_is_lost_and_what_is_meant_is_said() {
    let place = Place::with(&[("rover.urdf", URDF), ("mine.toml", "# mine\n"), ("page.html", "<html/>")]);
    place.refused("init --urdf rover.urdf -o rover.urdf", 2, &["is an input of this command"]);
    place.refused("init --urdf rover.urdf -o mine.toml", 1, &["gyroid did not write it", "--force"]);
    place.ok("init --urdf rover.urdf -o robot.toml");
    place.ok("init --urdf rover.urdf -o robot.toml");
    place.write("robot.toml", &place.read("robot.toml").replace("9.0", "9.5"));
    place.refused("init --urdf rover.urdf -o robot.toml", 1, &["changed since"]);
    place.refused("init -o robot.toml", 2, &["--kind"]);
    place.refused("init --kind rest --urdf rover.urdf -o r.toml", 2, &["a gyro at rest has no robot"]);
    place.refused("init --urdf rover.urdf --sdf rover.urdf -o r.toml", 2, &["cannot be used with"]);
    place.refused(
        "init --sdf rover.urdf -o r.toml",
        1,
        &["is URDF (<robot>), not SDF", "hint: give it with --urdf rover.urdf"],
    );
    place.refused("init --mjcf page.html -o r.toml", 1, &["begins with <html>"]);
    place.refused("init --urdf no.urdf -o r.toml", 1, &["no.urdf", "check the path"]);
    assert!(!place.has("r.toml"));
}
