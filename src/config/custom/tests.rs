use crate::config::Config;

const REST: &str = "schema = 1\nkind = \"stationary\"\n[gyro]\nc1_rad_s = 0.0\nc2_rad_s = 0.0\ntime_constant_s = 300.0\n\
    angle_random_walk_rad_sqrt_s = 1e-4\n\n";
const OWN: &str = "[[custom_effect]]\nid = \"custom.aging\"\ntitle = \"aging\"\nacts_on = \"gyro_bias_rad_s\"\n\
    expression = \"k*(1 - exp(-t_s/tau_s))\"\n\
    [[custom_effect.parameter]]\nname = \"k\"\nunit = \"rad/s\"\nbounds = [-0.1, 0.1]\nnull = 0.0\nplausible = [1e-5, 1e-2]\n\
    meaning = \"k\"\n\
    [[custom_effect.parameter]]\nname = \"tau_s\"\nunit = \"s\"\nbounds = [1.0, 1e5]\nplausible = [30.0, 3000.0]\n\
    meaning = \"time constant\"\n";

fn parsed(own: &str) -> Result<Config, String> {
    Config::parse(&format!("{REST}{own}"), "sim.toml").map_err(|e| e.to_string())
}

#[test]
fn a_table_is_read_and_written_back() {
    let config = parsed(OWN).unwrap();
    assert_eq!(config.custom_effects[0].parameters[1].plausible, [30.0, 3000.0]);
    let again = Config::parse(&config.to_toml().unwrap(), "again.toml").unwrap();
    assert_eq!(again, config);
}

/// The error of the table with `from` in the place of `to`: it names the file, and all of `says` stands in it.
#[track_caller]
fn refused(from: &str, to: &str, says: &[&str]) {
    assert!(OWN.contains(from), "{from}");
    let error = parsed(&OWN.replacen(from, to, 1)).unwrap_err();
    assert!(error.contains("sim.toml"), "{error}");
    says.iter().for_each(|part| assert!(error.contains(part), "{part:?} is not in: {error}"));
}

#[test]
fn what_cannot_be_used_is_refused_with_its_place_and_a_hint() {
    refused("\"custom.aging\"", "\"gyro.tone\"", &["`custom_effect.gyro.tone.id`", "write custom.tone"]);
    refused("\"custom.aging\"", "\"custom.Aging\"", &["custom_effect.custom.Aging.id"]);
    refused(
        "t_s/",
        "time/",
        &["`custom_effect.custom.aging.expression`, column 13", "time is unknown", "there are t_s"],
    );
    refused("/tau_s", "/tau", &["tau is unknown", "did you mean tau_s?"]);
    refused("/tau_s", "/", &["column", "a value is expected here"]);
    refused("exp(-t_s/tau_s)", "exp(-t_s)", &["the parameter tau_s is not in it"]);
    refused(
        "bounds = [1.0, 1e5]",
        "bounds = [5.0, 5.0]",
        &["`custom_effect.custom.aging.tau_s.bounds`", "no number lies"],
    );
    refused("bounds = [1.0, 1e5]", "bounds = [-10.0, 1e5]", &["expression", "tau_s = -"]);
    refused("null = 0.0", "null = 0.5", &["`custom_effect.custom.aging.k.null`", "out of bounds"]);
    refused("null = 0.0", "null = 0.05", &["where it should change nothing"]);
    refused("null = 0.0\n", "", &["no parameter has a null value"]);
    refused("plausible = [30.0, 3000.0]", "plausible = [0.5, 3000.0]", &["tau_s.plausible", "leaves the bounds"]);
    refused("plausible = [1e-5, 1e-2]", "plausible = [0.0, 1e-2]", &["k.plausible", "is no range"]);
    refused("\"k*(1", "\"k^2*(1", &["not linear in k"]);
    refused("name = \"tau_s\"", "name = \"t_s\"", &["t_s is a signal"]);
    refused("name = \"tau_s\"", "name = \"sin\"", &["no name of a parameter"]);
    refused("unit = \"s\"", "units = \"s\"", &["did you mean unit?"]);
    refused("gyro_bias_rad_s", "gyro_bias", &["acts_on", "did you mean gyro_bias_rad_s?"]);
    let twice = parsed(&format!("{OWN}{OWN}")).unwrap_err();
    assert!(twice.contains("another [[custom_effect]] has this id"), "{twice}");
}

const ROBOT: &str = "schema = 1\nkind = \"driving\"\n[vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\n\
    wheel_radius_m = 0.05\nwheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.0004\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n[gyro]\nc1_rad_s = 0.0\nc2_rad_s = 0.0\ntime_constant_s = 300.0\n\
    angle_random_walk_rad_sqrt_s = 1e-4\n";

/// An effect that acts on `place` by `expression` in k.
fn acts(head: &str, place: &str, expression: &str) -> Result<Config, String> {
    let own = format!(
        "[[custom_effect]]\nid = \"custom.drag\"\ntitle = \"drag\"\nacts_on = \"{place}\"\nexpression = \"{expression}\"\n\
         [[custom_effect.parameter]]\nname = \"k\"\nunit = \"-\"\nbounds = [0.0, 9.0]\nnull = 0.0\nplausible = [0.01, 5.0]\n\
         meaning = \"k\"\n"
    );
    Config::parse(&format!("{head}{own}"), "sim.toml").map_err(|e| e.to_string())
}

#[test]
fn drives_have_places_that_a_gyro_at_rest_has_not() {
    let forces = ["force_n", "torque_n_m", "wheel_left_torque_n_m", "wheel_right_torque_n_m"];
    let of_robot = forces.into_iter().chain(["wheel_left_rad_s", "wheel_right_rad_s", "gyro_rate_rad_s"]);
    for place in of_robot {
        assert!(acts(ROBOT, place, "k*speed_m_s*exp(-t_s)").is_ok(), "{place}");
        let refused = acts(REST, place, "k*speed_m_s").unwrap_err();
        for part in
            ["sim.toml", "`custom_effect.custom.drag.acts_on`", "kind is \"stationary\"", "write gyro_bias_rad_s"]
        {
            assert!(refused.contains(part), "{part:?} is not in: {refused}");
        }
    }
    // the gyro's bias is there in both
    assert!(acts(ROBOT, "gyro_bias_rad_s", "k*t_s").is_ok());
    // in drives sizes need not be factors
    assert!(acts(ROBOT, "force_n", "k^2*speed_m_s").is_ok());
    assert!(acts(ROBOT, "gyro_bias_rad_s", "k^2*t_s").unwrap_err().contains("not linear in k"));
}

#[test]
fn what_is_no_signal_of_a_place_is_refused_with_those_that_are() {
    let refused = |place: &str, signal: &str| acts(ROBOT, place, &format!("k*{signal}")).unwrap_err();
    let error = refused("force_n", "speed");
    assert!(error.contains("column 3: speed is unknown") && error.contains("did you mean speed_m_s?"), "{error}");
    // accelerations follow from forces, and a reading does not follow the place
    assert!(refused("force_n", "acceleration_m_s2").contains("acceleration_m_s2 is unknown"));
    assert!(refused("gyro_rate_rad_s", "x_m").contains("x_m is unknown"));
    assert!(refused("wheel_left_rad_s", "supply_v").contains("supply_v is unknown"));
    assert!(refused("pose_m", "x_m").contains("acts_on"));
}
