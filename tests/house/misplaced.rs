//! Arguments in each other's place, slips of the pen, and logs of another kind are said as such.

use crate::place::Place;

const ROBOT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.02\n\
    [gyro]\nc1_rad_s = -2.4e-3\nc2_rad_s = 8e-3\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
    [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
    wheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.0004\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n";

fn place() -> Place {
    let rest = ROBOT.split("[vehicle]").next().unwrap().replace("driving", "stationary");
    let place = Place::with(&[("robot.toml", ROBOT), ("rest.toml", &rest)]);
    place.ok("simulate rest.toml --duration 600 --sample-time 0.5 -o rest.csv");
    place.ok("simulate robot.toml --course square --duration 30 -o drive.parquet");
    place.ok("simulate robot.toml --course square --duration 30 -o drive.csv");
    place
}

#[test]
fn swapped_arguments_are_said_to_be_swapped() {
    let place = place();
    for (line, hint) in [
        ("navigate drive.parquet robot.toml", "gyroid navigate robot.toml drive.parquet"),
        ("navigate drive.csv robot.toml", "gyroid navigate robot.toml drive.csv"),
        ("validate rest.csv rest.toml", "gyroid validate rest.toml rest.csv"),
        ("gap diagnose rest.csv --fit rest.toml", "gyroid gap diagnose rest.toml --fit rest.csv"),
        ("gap explain rest.csv --fit rest.toml --effect gyro.tone", "gyroid gap explain rest.toml --fit rest.csv"),
        ("simulate drive.csv --inputs robot.toml -o x.parquet", "gyroid simulate robot.toml --inputs drive.csv"),
    ] {
        place.refused(line, 2, &["is no configuration", "swap them", hint]);
    }
    for (line, hint) in [
        ("navigate drive.csv drive.parquet", "gyroid navigate CONFIG.toml drive.csv"),
        ("gap diagnose rest.csv --fit drive.csv", "gyroid gap diagnose CONFIG.toml --fit rest.csv"),
        ("simulate drive.parquet -o x.parquet", "gyroid simulate CONFIG.toml --inputs drive.parquet"),
    ] {
        place.refused(line, 2, &["is a log, in the place of the configuration", hint]);
    }
    for line in ["navigate robot.toml rest.toml", "fit rest.csv rest.toml", "noise rest.toml", "inspect rest.toml"] {
        place.refused(line, 2, &["rest.toml", "is a configuration, in the place of a log"]);
    }
}

#[test]
fn a_recording_proves_nothing_that_it_led_to() {
    let place = place();
    std::fs::copy(place.path("rest.csv"), place.path("copy.csv")).unwrap();
    for kept in ["rest.csv", "copy.csv"] {
        let line = format!("gap diagnose rest.toml --fit rest.csv --hold {kept}");
        place.refused(&line, 2, &[kept, "held out", "the same as rest.csv", "hold out another recording"]);
    }
}

#[test]
fn a_slip_of_the_pen_is_seen_through() {
    let place = place();
    place.write("slip.toml", &ROBOT.replace("time_constant_s", "tim_constant_s"));
    place.refused("simulate slip.toml -o x.parquet", 1, &["tim_constant_s", "did you mean time_constant_s?"]);
    place.write("kind.toml", &ROBOT.replace("\"driving\"", "\"drivng\""));
    place.refused("simulate kind.toml -o x.parquet", 1, &["drivng", "did you mean driving?"]);
    place.write("kind.toml", &ROBOT.replace("\"driving\"", "\"drive\""));
    place.refused("simulate kind.toml -o x.parquet", 1, &["did you mean driving?"]);
    let explain = "gap explain rest.toml --fit rest.csv --effect gyro.tome";
    place.refused(explain, 2, &["gyro.tome", "did you mean gyro.tone?"]);
    let drive = "gap explain robot.toml --fit drive.parquet --effect wheel.slp";
    place.refused(drive, 2, &["wheel.slp", "did you mean wheel.slip?"]);
    let without = "gap diagnose rest.toml --fit rest.csv --without bias_step";
    place.refused(without, 2, &["bias_step", "did you mean gyro.bias_step?"]);
    place.write("effect.toml", &format!("{ROBOT}[[effect]]\nid = \"vehicle.paylod\"\n"));
    place.refused("simulate effect.toml --course square -o x.parquet", 1, &["did you mean vehicle.payload?"]);
    place.refused("export rest.toml --to kalibra", 2, &["kalibr"]);
    // nothing is made up for what is like nothing
    let output = place.run("gap diagnose rest.toml --fit rest.csv --without quux");
    assert!(!String::from_utf8_lossy(&output.stderr).contains("did you mean"));
}

#[test]
fn a_log_of_another_kind_is_said_to_be_one() {
    let place = place();
    let rest = ["rest.csv", "robot.toml", "kind = \"driving\"", "kind = \"stationary\""];
    place.refused("gap diagnose robot.toml --fit rest.csv", 1, &rest);
    place.refused("navigate robot.toml rest.csv", 1, &rest);
    place.refused("gap explain robot.toml --fit rest.csv --effect wheel.slip", 1, &rest);
    let drive = ["drive.csv", "is a drive", "rest.toml is of a gyro at rest", "kind = \"driving\""];
    place.refused("gap diagnose rest.toml --fit drive.csv", 1, &drive);
    place.refused("gap explain rest.toml --fit drive.csv --effect gyro.tone", 1, &drive);
}
