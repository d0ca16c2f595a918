//! `gyroid simulate` and `gyroid navigate` as a user runs them.

use crate::ROBOT;
use crate::place::Place;
use std::path::Path;

fn new() -> Place {
    let rest = ROBOT.split("[vehicle]").next().unwrap().replace("driving", "stationary");
    Place::with(&[("robot.toml", ROBOT), ("rest.toml", &rest)])
}

fn bytes(path: &Path) -> Vec<u8> {
    std::fs::read(path).unwrap()
}

#[test]
fn the_same_seed_writes_the_same_bytes() {
    let p = new();
    p.ok("simulate robot.toml --course figure_eight --duration 20 --seed 3 -o a.parquet");
    p.ok("simulate robot.toml --course figure_eight --duration 20 --seed 3 --out b.parquet");
    p.ok("simulate robot.toml --course figure_eight --duration 20 --seed 4 -o c.parquet");
    assert_eq!(bytes(&p.path("a.parquet")), bytes(&p.path("b.parquet")));
    assert_ne!(bytes(&p.path("a.parquet")), bytes(&p.path("c.parquet")));
}

#[test]
fn a_gyro_at_rest_has_two_columns_and_says_so() {
    let p = new();
    for config in ["rest.toml", "robot.toml"] {
        let text = p.ok(&format!("simulate {config} --duration 5 --sample-time 0.1 -o log.csv --force"));
        assert!(text.contains("51 rows") && text.contains("at rest"), "{text}");
        let log = String::from_utf8(bytes(&p.path("log.csv"))).unwrap();
        assert_eq!(log.lines().next(), Some("t_s,gyro_z_rad_s"));
        assert_eq!(log.lines().count(), 52);
    }
}

#[test]
fn a_drive_is_simulated_replayed_and_navigated() {
    let p = new();
    p.ok("simulate robot.toml --course square --duration 30 --start-offset 20 --truth true.parquet -o drive.parquet");
    let text = p.ok("simulate robot.toml --inputs drive.parquet --seed 9 -o again.parquet");
    assert!(text.contains("3001 rows"), "{text}");
    let text = p.ok("navigate robot.toml drive.parquet -o pose.parquet");
    for part in ["with error model", "without error model", "encoders alone", "from 20.0 s after power-on", "unsigned"]
    {
        assert!(text.contains(part), "{text} lacks {part}");
    }
    let json: serde_json::Value =
        serde_json::from_str(&p.ok("navigate robot.toml drive.parquet --json - -o pose.parquet")).unwrap();
    let rms = |run: &str| json[run]["reference"]["heading_rms_rad"].as_f64().unwrap();
    assert!(rms("with_error_model") < 0.2 * rms("without_error_model"));
    assert!(rms("dead_reckoning") > 0.0);
    let consistency = &json["with_error_model"]["consistency"];
    assert_eq!(consistency["sensors"].as_array().unwrap().len(), 3);
    assert!(consistency["nis_mean"].as_f64().unwrap() > 0.9);

    let pose = gyroid::ingest::read_log(p.path("pose.parquet")).unwrap();
    let names: Vec<_> = pose.channels.iter().map(|c| c.name.as_str()).collect();
    let expected = [
        "x_m",
        "y_m",
        "heading_rad",
        "speed_m_s",
        "yaw_rate_rad_s",
        "gyro_error_rad_s",
        "x_std_m",
        "y_std_m",
        "heading_std_rad",
        "speed_std_m_s",
        "yaw_rate_std_rad_s",
        "gyro_error_std_rad_s",
        "nis",
    ];
    assert_eq!(names, expected);
    let error = |log: &str| gyroid::ingest::read_log(p.path(log)).unwrap().get("gyro_error_rad_s").unwrap()[3000];
    assert!((error("pose.parquet") - error("true.parquet")).abs() < 1e-3);
    // without the model its gyro's innovations are too large, and the pose is written all the same
    p.unfit("navigate robot.toml drive.parquet --no-error-model -q -o off.parquet");
    assert_eq!(error("off.parquet"), 0.0);
}

/// `data/README.md` gives the commands that made the example data.
/// A robot that drives a circle of 1 m at 0.5 m/s: yaw rate 0.5 rad/s.
mod circle {
    pub const YAW_RATE: f64 = 0.5;
    pub const SPEED: f64 = 0.5;

    /// A file with `columns` of (name, value at a time), `rate_hz` rows a second from `start_s`, for 20 s.
    pub fn file(rate_hz: f64, start_s: f64, columns: &[(&str, &dyn Fn(f64) -> f64)]) -> String {
        let names: Vec<_> = columns.iter().map(|c| c.0).collect();
        let mut text = format!("t_s,{}\n", names.join(","));
        for k in 0..=(20.0 * rate_hz) as u32 {
            let t = start_s + f64::from(k) / rate_hz;
            let values: Vec<_> = columns.iter().map(|c| c.1(t).to_string()).collect();
            text += &format!("{t},{}\n", values.join(","));
        }
        text
    }
}

#[test]
fn files_of_several_rates_are_one_drive_and_columns_are_mapped() {
    let p = new();
    let put = |name: &str, text: String| std::fs::write(p.path(name), text).unwrap();
    let degrees = |_: f64| -circle::YAW_RATE.to_degrees();
    put("imu.csv", circle::file(50.0, 0.0, &[("wz", &degrees), ("gz_dps", &|_| 7.0)]));
    let (speed, yaw_rate) = (|_: f64| circle::SPEED, |_: f64| circle::YAW_RATE);
    put("wheels.csv", circle::file(10.0, 0.0, &[("odo_v_m_s", &speed), ("odo_yaw_rate_rad_s", &yaw_rate)]));
    // seen from a frame that is turned by a quarter and shifted
    let (east, north) = (|t: f64| 4.0 + (0.5 * t).cos(), |t: f64| 3.0 + (0.5 * t).sin());
    put("gps.csv", circle::file(4.0, 0.05, &[("east_m", &east), ("north_m", &north)]));

    let line = "navigate robot.toml imu.csv wheels.csv gps.csv --map gyro_z_rad_s=-wz:deg/s --align=0.5 --json -";
    let json: serde_json::Value = serde_json::from_str(&p.ok(line)).unwrap();
    let without = &json["without_error_model"];
    // 50 Hz, 10 Hz on the same stamps, 4 Hz beside them: 0.05 s + k/4 meets k/50 every second time
    let gps = (0..=80).filter(|k| (5 + 25 * k) % 2 == 1).count();
    assert_eq!(without["rows"], 1001 + gps);
    // gyro and wheels agree, so that the filters differ from the circle by the numbers' rounding and the start's prior
    for run in ["without_error_model", "dead_reckoning", "gyro_reckoning"] {
        let reference = &json[run]["reference"];
        assert!(reference["position_rms_m"].as_f64().unwrap() < 0.02, "{run}: {reference}");
        assert!(reference.get("heading_rms_rad").is_none());
        let turn = reference["alignment"]["rotation_rad"].as_f64().unwrap();
        // the robot starts along x, the reference along north at t = 0
        assert!((turn - std::f64::consts::FRAC_PI_2).abs() < 0.02, "{run}: {turn}");
    }
    let with = json["log_notes"].to_string();
    assert!(with.contains("odo_v_m_s") && with.contains("east_m"), "{with}");

    // the sign matters: turned round, the gyro goes the other way about
    let line = "navigate robot.toml imu.csv wheels.csv gps.csv --map gyro_z_rad_s=wz:deg/s --align=0.5 --json -";
    let wrong: serde_json::Value = serde_json::from_str(&p.unfit(line)).unwrap();
    assert!(wrong["gyro_reckoning"]["reference"]["position_rms_m"].as_f64().unwrap() > 0.5);

    let text = p.ok("navigate robot.toml imu.csv wheels.csv gps.csv --map gyro_z_rad_s=-wz:deg/s --plot drive");
    assert!(text.contains("drew drive.png, drive.svg") && text.contains("laid on the reference"), "{text}");
    assert!(bytes(&p.path("drive.png")).starts_with(b"\x89PNG"));
    assert!(String::from_utf8(bytes(&p.path("drive.svg"))).unwrap().contains("gyro as it is"));

    p.refused(
        "navigate robot.toml imu.csv wheels.csv --map gyro_z_rad_s=wy",
        1,
        &["\"wy\"", "wz, gz_dps", "odo_v_m_s"],
    );
    p.refused("navigate robot.toml imu.csv wheels.csv --map gyro_z_rad_s=wz:m", 1, &["imu.csv", "\"m\"", "deg/s"]);
    p.refused("navigate robot.toml imu.csv wheels.csv --map gyro=wz", 2, &["gyro_z_rad_s"]);
    p.refused("navigate robot.toml imu.csv", 1, &["no row tells the speed", "--map odo_speed_m_s"]);
    p.refused("navigate robot.toml wheels.csv --map odo_yaw_rate_rad_s=odo_v_m_s:rad/s --plot a.gif", 2, &["a.gif"]);
    p.refused("navigate robot.toml imu.csv wheels.csv gps.csv --start-at-reference", 1, &["no reference heading"]);
    p.refused("navigate robot.toml imu.csv wheels.csv gps.csv --align=2", 2, &["share"]);
}

#[test]
fn odometry_without_a_gyro_is_navigated_and_replayed() {
    let p = new();
    let (speed, yaw_rate) = (|_: f64| circle::SPEED, |_: f64| circle::YAW_RATE);
    let text = circle::file(10.0, 0.0, &[("v", &speed), ("odo_yaw_rate_rad_s", &yaw_rate)]);
    std::fs::write(p.path("wheels.csv"), text).unwrap();
    let text = std::fs::read_to_string(p.path("robot.toml")).unwrap();
    let (head, tail) = (text.split("[gyro]").next().unwrap(), text.split("[vehicle]").nth(1).unwrap());
    std::fs::write(p.path("bare.toml"), format!("{head}[vehicle]{tail}")).unwrap();

    let json = p.ok("navigate bare.toml wheels.csv --map odo_speed_m_s=v:m/s --json -");
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert!(json["with_error_model"].is_null() && json["gyro_reckoning"].is_null());
    let heading = &json["without_error_model"]["final_pose"]["heading_rad"];
    let [found, std] = ["estimate", "std"].map(|k| heading[k].as_f64().unwrap());
    assert!((found - 20.0 * circle::YAW_RATE).abs() < 5.0 * std, "{heading}");

    let text = p.ok("simulate robot.toml --inputs wheels.csv --map odo_speed_m_s=v:m/s --truth true.csv -o again.csv");
    assert!(text.contains("201 rows"), "{text}");
    let truth = gyroid::ingest::read_log(p.path("true.csv")).unwrap();
    let end = |name: &str| *truth.get(name).unwrap().last().unwrap();
    // a circle of radius 1 m about (0, 1), by quadrature of order 6
    assert!((end("heading_rad") - 10.0).abs() < 1e-9 && (end("x_m") - 10f64.sin()).abs() < 1e-9);
}

#[test]
fn a_written_pose_is_no_gyro_when_it_is_read_back() {
    let p = new();
    p.ok("simulate robot.toml --course square --duration 10 -o drive.parquet");
    p.ok("navigate robot.toml drive.parquet -q -o pose.csv");
    p.refused("navigate robot.toml pose.csv", 1, &["no row tells the speed", "yaw_rate_rad_s"]);
}

#[test]
fn quiet_is_quiet() {
    let p = new();
    assert_eq!(p.ok("simulate robot.toml --course random --duration 5 -q -o d.parquet"), "");
    assert_eq!(p.ok("navigate robot.toml d.parquet -q"), "");
}

#[test]
fn a_gyro_is_switched_off_and_on_again() {
    let p = new();
    p.ok("simulate robot.toml --course square --duration 30 --start-offset 570 -o first.parquet");
    p.refused(
        "navigate robot.toml first.parquet --off-time 300",
        1,
        &["robot.toml", "[gyro.last_run]", "--save-config"],
    );
    p.refused("simulate robot.toml --course square --off-time 300 -o d.csv", 1, &["robot.toml", "[gyro.last_run]"]);
    let text = p.ok("navigate robot.toml first.parquet --save-config after.toml");
    assert!(text.contains("wrote after.toml: warm-up age 600 s"), "{text}");
    let saved = gyroid::config::Config::read(p.path("after.toml")).unwrap();
    let age_s = saved.require_gyro().unwrap().last_run.unwrap().warm_up_age_s;
    assert!((age_s - 600.0).abs() < 1e-9, "{age_s}");
    // nothing else has changed
    let before = gyroid::config::Config::read(p.path("robot.toml")).unwrap().after_run(age_s).unwrap();
    assert_eq!(before, saved);

    p.ok("simulate after.toml --course square --duration 30 --off-time 300 --truth true.parquet -o second.parquet");
    let json = |line: &str| -> serde_json::Value { serde_json::from_str(&p.ok(line)).unwrap() };
    let warm = &json("navigate after.toml second.parquet --off-time 300 --json - -o pose.parquet")["with_error_model"];
    let cold = &json("navigate after.toml second.parquet --json -")["with_error_model"];
    let h0 = (1.0 - (-600f64 / 240.0).exp()) * (-300f64 / 240.0).exp();
    let age = |run: &serde_json::Value| run["warm_up_age_end_s"].as_f64().unwrap();
    assert!((age(warm) - (30.0 - 240.0 * (1.0 - h0).ln())).abs() < 1e-6 && (age(cold) - 30.0).abs() < 1e-6);
    assert!(cold["notes"].to_string().contains("--off-time") && !warm["notes"].to_string().contains("--off-time"));
    // a cold start would begin C1 h0 = -0.64 mrad/s off; the first row's readings know the yaw rate to 4 mrad/s, which moves
    // an error that is known to 0.2 by 0.01 mrad/s
    let first = |log: &str| gyroid::ingest::read_log(p.path(log)).unwrap().get("gyro_error_rad_s").unwrap()[0];
    assert!((first("pose.parquet") - first("true.parquet")).abs() < 5e-5);

    p.refused(
        "navigate after.toml second.parquet --off-time 300 --start-offset 600",
        2,
        &["--start-offset", "second.parquet", "new power-on"],
    );
    p.refused(
        "simulate after.toml --inputs second.parquet --off-time 300 --start-offset 600 -o d.csv",
        2,
        &["--start-offset"],
    );
    p.refused("navigate after.toml second.parquet --off-time -3", 1, &["off time"]);
    p.refused("navigate after.toml second.parquet --save-config no/such/x.toml", 1, &["no directory"]);
    // the file may be saved over itself
    p.ok("navigate after.toml second.parquet --off-time 300 --save-config after.toml -q");
    assert!(
        gyroid::config::Config::read(p.path("after.toml"))
            .unwrap()
            .require_gyro()
            .unwrap()
            .last_run
            .unwrap()
            .warm_up_age_s
            < 200.0
    );
}

#[test]
fn how_the_wheels_move_is_the_users_choice() {
    let p = new();
    let snow = "[traction.law.burckhardt]\nc1 = 0.1946\nc2 = 94.129\nc3 = 0.0646\n[encoder]";
    std::fs::write(p.path("snow.toml"), ROBOT.replace("[encoder]", snow)).unwrap();
    p.ok("simulate snow.toml --course square --duration 20 --truth true.parquet -o drive.parquet");
    let json = |wheels: &str| -> serde_json::Value {
        let line = format!("navigate snow.toml drive.parquet --wheels {wheels} --json - -o {wheels}.parquet");
        serde_json::from_str(&p.ok(&line)).unwrap()
    };
    for (wheels, slips) in [("auto", true), ("slip", true), ("rolling", false)] {
        let with = &json(wheels)["with_error_model"];
        assert_eq!((with["slip_modelled"].as_bool(), with["slip"].is_array()), (Some(slips), slips), "{wheels}");
        let pose = gyroid::ingest::read_log(p.path(&format!("{wheels}.parquet"))).unwrap();
        let columns = ["slip_left", "slip_left_std", "slip_right", "slip_right_std"];
        assert!(columns.iter().all(|name| pose.get(name).is_some() == slips), "{wheels}");
    }
    assert_eq!(bytes(&p.path("auto.parquet")), bytes(&p.path("slip.parquet")));
    // slips as the simulator had them, by the filter's own standard deviation: 95 % within two, and the filter starts
    // without knowing
    let [pose, truth] = ["slip", "true"].map(|f| gyroid::ingest::read_log(p.path(&format!("{f}.parquet"))).unwrap());
    let [slip, std] = ["slip_left", "slip_left_std"].map(|name| pose.get(name).unwrap());
    let within = |(k, truth): &(usize, &f64)| (slip[*k] - *truth).abs() < 5.0 * std[*k];
    let rows = truth.get("slip_left").unwrap().iter().enumerate().skip(100);
    assert!(rows.clone().filter(within).count() as f64 > 0.99 * rows.count() as f64);

    assert!(p.ok("navigate snow.toml drive.parquet").contains("slip: left "));
    assert!(!p.ok("navigate snow.toml drive.parquet --wheels rolling").contains("slip: left "));
    p.refused("navigate robot.toml drive.parquet --wheels slip", 1, &["robot.toml", "[traction]"]);
    p.refused("navigate snow.toml drive.parquet --wheels skid", 2, &["auto", "rolling", "slip"]);
}

#[test]
fn ticks_and_a_restart_go_with_several_files() {
    let p = new();
    let put = |name: &str, text: String| std::fs::write(p.path(name), text).unwrap();
    put("ticks.toml", ROBOT.replace("std_rad_s = 0.02", "std_rad_s = 0.0\nticks_per_revolution = 4096"));
    let rate = |_: f64| circle::YAW_RATE;
    put("imu.csv", circle::file(50.0, 0.0, &[("gyro_z_rad_s", &rate)]));
    // angles of wheels of 5 cm, half a track of 17 cm apart
    let ticks = |side: f64| {
        move |t: f64| {
            (t * (circle::SPEED + side * 0.17 * circle::YAW_RATE) / 0.05 * 4096.0 / std::f64::consts::TAU).floor()
        }
    };
    put("wheels.csv", circle::file(10.0, 0.0, &[("enc_l", &ticks(-1.0)), ("wheel_right_ticks", &ticks(1.0))]));
    let files = "imu.csv wheels.csv --map wheel_left_ticks=enc_l:ticks --start-offset 40";
    let json: serde_json::Value =
        serde_json::from_str(&p.ok(&format!("navigate ticks.toml {files} --json -"))).unwrap();
    let run = &json["without_error_model"];
    let sensors = run["consistency"]["sensors"].as_array().unwrap();
    // every count but the first ends an interval
    let readings: Vec<_> = sensors.iter().map(|s| s["readings"].as_u64().unwrap()).collect();
    assert_eq!(readings, [1001, 200, 200]);
    let heading = &run["final_pose"]["heading_rad"];
    let [found, std] = ["estimate", "std"].map(|key| heading[key].as_f64().unwrap());
    assert!((found - 20.0 * circle::YAW_RATE).abs() < 5.0 * std, "{heading}");

    let text = p.ok(&format!("navigate ticks.toml {files} --save-config after.toml"));
    assert!(text.contains("warm-up age 60 s") && text.contains("encoders alone"), "{text}");
    p.ok("navigate after.toml imu.csv wheels.csv --map wheel_left_ticks=enc_l:ticks --off-time 30 -q");

    // without ticks per revolution, a gyro, or [gyro]
    p.refused(&format!("navigate robot.toml {files}"), 1, &["robot.toml", "encoder.ticks_per_revolution"]);
    let wheels = "wheels.csv --map wheel_left_ticks=enc_l:ticks";
    p.refused(&format!("navigate after.toml {wheels} --off-time 30"), 2, &["--off-time", "no gyro"]);
    p.refused(&format!("navigate ticks.toml {wheels} --save-config x.toml"), 2, &["--save-config", "no gyro"]);
    let text = std::fs::read_to_string(p.path("ticks.toml")).unwrap();
    let (head, tail) = (text.split("[gyro]").next().unwrap(), text.split("[vehicle]").nth(1).unwrap());
    put("bare.toml", format!("{head}[vehicle]{tail}"));
    p.refused(&format!("navigate bare.toml {files} --off-time 30"), 1, &["bare.toml", "[gyro]"]);
    p.ok(&format!("navigate bare.toml {wheels} -q"));
}

#[test]
fn standing_still_is_told() {
    let p = new();
    let held =
        ROBOT.replace("speed_noise_std_rad_s = 0.02", "speed_noise_std_rad_s = 0.0\nticks_per_revolution = 2048");
    std::fs::write(p.path("held.toml"), held).unwrap();
    let rest: String = (0..500).map(|k| format!("{},0.0,0.0\n", 0.01 * f64::from(k))).collect();
    std::fs::write(p.path("rest.csv"), format!("t_s,wheel_left_rad_s,wheel_right_rad_s\n{rest}")).unwrap();
    p.ok("simulate held.toml --inputs rest.csv -o held.parquet");
    let log = gyroid::ingest::read_log(p.path("held.parquet")).unwrap();
    assert_eq!(log.get("wheel_left_ticks").unwrap()[499], 0.0);
    assert!(p.ok("navigate held.toml held.parquet").contains("stood still in 450 rows"));
    assert!(!p.ok("navigate held.toml held.parquet --no-zero-updates").contains("stood still"));
    p.refused("navigate held.toml held.parquet --no-zero-updates --zero-updates", 2, &["--zero-updates"]);
}

#[test]
fn mistakes_are_named_with_their_exit_code() {
    let p = new();
    p.ok("simulate rest.toml --duration 5 -o rest.csv");
    p.refused("simulate rest.toml --course square -o d.csv", 2, &["rest.toml", "driving"]);
    p.refused("simulate robot.toml --truth t.csv -o d.csv", 2, &["--truth"]);
    p.refused("simulate robot.toml --course spiral -o d.csv", 2, &["figure_eight"]);
    p.refused("simulate robot.toml --sample-time -1 -o d.csv", 2, &["--sample-time"]);
    p.refused("simulate robot.toml --duration 0 -o d.csv", 1, &["duration"]);
    p.refused("simulate robot.toml -o no/such/d.csv", 1, &["no directory"]);
    p.refused("simulate robot.toml --inputs rest.csv -o d.csv", 1, &["rest.csv", "neither torques nor wheel speeds"]);
    p.refused("navigate robot.toml rest.csv", 1, &["rest.csv", "wheel_left_rad_s"]);
    p.refused("navigate rest.toml rest.csv", 1, &["rest.toml", "[vehicle]"]);
    p.refused("navigate robot.toml none.csv", 1, &["none.csv"]);
    p.refused("simulate robot.toml --start-offset -3 -o d.csv", 1, &["start offset"]);
    p.refused("navigate robot.toml rest.csv -o no/such/p.csv", 1, &["no directory"]);
    assert!(!p.path("d.csv").exists(), "nothing is left behind");
}

#[test]
fn speeds_over_ground_and_motor_currents_in_two_files_are_the_same_drive() {
    let p = new();
    let constant = 0.35;
    let motors = ROBOT.replace("[encoder]", &format!("torque_constant_n_m_a = {constant}\n[encoder]"));
    std::fs::write(p.path("motors.toml"), motors).unwrap();
    p.ok("simulate robot.toml --course square --duration 30 --seed 5 -o drive.parquet");
    let log = gyroid::ingest::read_log(p.path("drive.parquet")).unwrap();
    let column = |name: &str| log.get(name).unwrap();
    let (mut imu, mut wheels) = (String::from("time,gyro_z_rad_s\n"), String::from("time,curL,curR,velL,velR\n"));
    for k in 0..log.len() {
        let t = log.time.at(k);
        let [i_left, i_right] = ["torque_left_n_m", "torque_right_n_m"].map(|n| column(n)[k] / constant);
        let [left, right] = ["wheel_left_rad_s", "wheel_right_rad_s"].map(|n| 0.05 * column(n)[k]);
        imu += &format!("{t},{}\n", column("gyro_z_rad_s")[k]);
        wheels += &format!("{t},{i_left},{i_right},{left},{right}\n");
    }
    std::fs::write(p.path("imu.csv"), imu).unwrap();
    std::fs::write(p.path("wheels.csv"), wheels).unwrap();
    let end = |text: &str| {
        let json: serde_json::Value = serde_json::from_str(text).unwrap();
        let pose = &json["with_error_model"]["final_pose"];
        ["x_m", "y_m", "heading_rad"].map(|k| pose[k]["estimate"].as_f64().unwrap())
    };
    let torques = end(&p.ok("navigate robot.toml drive.parquet --json -"));
    let currents = end(&p.ok("navigate motors.toml imu.csv wheels.csv --json -"));
    for (a, b) in torques.iter().zip(currents) {
        assert!((a - b).abs() < 1e-9, "{torques:?} {currents:?}");
    }
    let text = p.ok("navigate motors.toml imu.csv wheels.csv");
    for said in ["torques, gyro and encoders", "nominal radius of 0.05 m", "motor currents times 0.35 N·m/A"] {
        assert!(text.contains(said), "{text} lacks {said}");
    }
    let text = p.ok("navigate robot.toml imu.csv wheels.csv");
    assert!(text.contains("(no torques)") && text.contains("torque_constant_n_m_a"), "{text}");
}

#[test]
fn wheels_that_lack_or_turn_against_the_gyro_are_told_with_the_mend() {
    let p = new();
    p.ok("simulate robot.toml --course figure_eight --duration 30 --seed 5 -o drive.parquet");
    let text = p.unfit("navigate robot.toml drive.parquet --map wheel_left_rad_s=-wheel_left_rad_s");
    assert!(text.contains("left wheel seems to count backwards"), "{text}");
    assert!(!p.ok("navigate robot.toml drive.parquet").contains("seems to count backwards"));
    let lines = "t_s,gyro_z_rad_s,wheel_right_rad_s\n0,0.1,1\n0.1,0.2,1\n0.2,0.1,2\n";
    std::fs::write(p.path("one.csv"), lines).unwrap();
    p.refused(
        "navigate robot.toml one.csv",
        1,
        &["one wheel only, wheel_right_rad_s", "--map wheel_left_rad_s=COLUMN"],
    );
    let rows: String = (0..600).map(|k| format!("{k},{k},0\n")).collect();
    std::fs::write(p.path("positions.csv"), format!("t_s,x_m,y_m\n{rows}")).unwrap();
    // nothing is said twice: an answer, and no error
    let text = p.ok("gap diagnose robot.toml --fit positions.csv");
    assert!(text.contains("CANNOT TELL"), "{text}");
}

#[test]
fn commanded_speeds_are_inputs_where_nothing_measures_the_wheels() {
    let p = new();
    p.ok("simulate robot.toml --course figure_eight --duration 40 --seed 5 -o drive.parquet --truth truth.parquet");
    let read = |name: &str| gyroid::ingest::read_log(p.path(name)).unwrap();
    let (log, truth) = (read("drive.parquet"), read("truth.parquet"));
    // commands that the robot follows at once, ten times a second
    let row = |k: usize| {
        let [v, w] = ["speed_m_s", "yaw_rate_rad_s"].map(|name| truth.get(name).unwrap()[k]);
        format!("{},{v},{w}\n", log.time.at(k))
    };
    let rows: String = (0..log.len()).step_by(10).map(row).collect();
    p.write("cmd_vel.csv", &format!("time,cmd_vel.linear.x,cmd_vel.angular.z\n{rows}"));
    let gyro = log.get("gyro_z_rad_s").unwrap();
    let rows: String = gyro.iter().enumerate().map(|(k, w)| format!("{},{w}\n", log.time.at(k))).collect();
    p.write("imu.csv", &format!("time,gyro_z_rad_s\n{rows}"));
    let said = "Commanded speeds stand for the wheels', which nothing in the log measures";
    let output = p.run("navigate robot.toml imu.csv cmd_vel.csv -o pose.parquet");
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains(said) && p.has("pose.parquet"), "{text}");
    let answer = p.ok("gap diagnose robot.toml --fit imu.csv cmd_vel.csv");
    assert!(answer.contains(said) && answer.contains("Forces, masses, motors and slip cannot be judged"), "{answer}");
    let text = p.ok("simulate robot.toml --inputs cmd_vel.csv -o replayed.parquet --truth replayed_truth.parquet");
    assert!(text.contains(said), "{text}");
    let end = |log: &gyroid::signal::Log| ["x_m", "y_m"].map(|name| *log.get(name).unwrap().last().unwrap());
    let (a, b) = (end(&truth), end(&read("replayed_truth.parquet")));
    assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 0.05, "{a:?} {b:?}");
}

/// Most robots have their gyro zeroed at the start: what the error model gains is told beside that.
#[test]
fn a_gyro_zeroed_at_the_start_stands_beside_the_error_model() {
    let p = new();
    p.ok("simulate robot.toml --course square --duration 120 --seed 5 -o drive.parquet");
    let json: serde_json::Value = serde_json::from_str(&p.ok("navigate robot.toml drive.parquet --json -")).unwrap();
    let zeroed = &json["zeroed_at_start"];
    let log = gyroid::ingest::read_log(p.path("drive.parquet")).unwrap();
    let rest_s = zeroed["rest_s"].as_f64().unwrap();
    let rest: Vec<f64> =
        log.get("gyro_z_rad_s").unwrap().iter().copied().take((rest_s / 0.01).round() as usize).collect();
    let mean = rest.iter().sum::<f64>() / rest.len() as f64;
    assert!((zeroed["zero_rad_s"].as_f64().unwrap() - mean).abs() < 1e-6, "{mean} {zeroed}");
    assert!((zeroed["rest_s"].as_f64().unwrap() - 1.0).abs() < 0.1, "{zeroed}");
    let heading = |run: &serde_json::Value| run["reference"]["heading_rms_rad"].as_f64().unwrap();
    let (with, without) = (heading(&json["with_error_model"]), heading(&json["without_error_model"]));
    let (filter, alone) = (heading(&zeroed["filter"]), heading(&zeroed["gyro_reckoning"]));
    assert!(with < filter && filter < without, "{with} {filter} {without}");
    assert!(alone < heading(&json["gyro_reckoning"]), "{alone}");
    let text = p.ok("navigate robot.toml drive.parquet");
    assert!(
        text.contains("\nzeroed at the start ") && text.contains("°/s, the gyro's mean over 1.0 s at rest, held"),
        "{text}"
    );

    // a drive that begins in motion has nothing to zero by
    let (speed, yaw_rate) = (|_: f64| circle::SPEED, |_: f64| circle::YAW_RATE);
    let columns: [(&str, &dyn Fn(f64) -> f64); 3] =
        [("gyro_z_rad_s", &yaw_rate), ("odo_speed_m_s", &speed), ("odo_yaw_rate_rad_s", &yaw_rate)];
    std::fs::write(p.path("moving.csv"), circle::file(10.0, 0.0, &columns)).unwrap();
    let output = p.run("navigate robot.toml moving.csv");
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("does not begin with a second at rest"), "{text}");
}
