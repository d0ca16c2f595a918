//! `gyroid simulate` and `gyroid navigate` as a user runs them.

use assert_cmd::Command;
use std::path::{Path, PathBuf};
use std::process::Output;

const ROBOT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
    [gyro]\nc1_rad_s = -2.4e-3\nc2_rad_s = 8e-3\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
    turn_on_bias_std_rad_s = 2e-4\n\
    [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
    wheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.0004\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n\
    [pose]\nrate_hz = 5.0\nposition_std_m = 0.002\nheading_std_rad = 0.002\n";

struct Place {
    dir: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("robot.toml"), ROBOT).unwrap();
        let rest = ROBOT.split("[vehicle]").next().unwrap().replace("driving", "stationary");
        std::fs::write(dir.path().join("rest.toml"), rest).unwrap();
        Self { dir }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn run(&self, line: &str) -> Output {
        let mut command = Command::cargo_bin("gyroid").unwrap();
        command.current_dir(self.dir.path()).args(line.split(' ')).output().unwrap()
    }

    #[track_caller]
    fn ok(&self, line: &str) -> String {
        let output = self.run(line);
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    }

    #[track_caller]
    fn refused(&self, line: &str, code: i32, parts: &[&str]) {
        let output = self.run(line);
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{line}: {text}");
        for part in parts {
            assert!(text.contains(part), "{line}: {text} lacks {part}");
        }
    }
}

fn bytes(path: &Path) -> Vec<u8> {
    std::fs::read(path).unwrap()
}

#[test]
fn the_same_seed_writes_the_same_bytes() {
    let p = Place::new();
    p.ok("simulate robot.toml --course figure_eight --duration 20 --seed 3 -o a.parquet");
    p.ok("simulate robot.toml --course figure_eight --duration 20 --seed 3 --out b.parquet");
    p.ok("simulate robot.toml --course figure_eight --duration 20 --seed 4 -o c.parquet");
    assert_eq!(bytes(&p.path("a.parquet")), bytes(&p.path("b.parquet")));
    assert_ne!(bytes(&p.path("a.parquet")), bytes(&p.path("c.parquet")));
}

#[test]
fn a_gyro_at_rest_has_two_columns_and_says_so() {
    let p = Place::new();
    for config in ["rest.toml", "robot.toml"] {
        let text = p.ok(&format!("simulate {config} --duration 5 --sample-time 0.1 -o log.csv"));
        assert!(text.contains("51 rows") && text.contains("at rest"), "{text}");
        let log = String::from_utf8(bytes(&p.path("log.csv"))).unwrap();
        assert_eq!(log.lines().next(), Some("t_s,gyro_z_rad_s"));
        assert_eq!(log.lines().count(), 52);
    }
}

#[test]
fn a_drive_is_simulated_replayed_and_navigated() {
    let p = Place::new();
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
        // a reader takes the only yaw rate of a file for the gyro's
        "gyro_z_rad_s",
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
    p.ok("navigate robot.toml drive.parquet --no-error-model -q -o off.parquet");
    assert_eq!(error("off.parquet"), 0.0);
}

/// `data/README.md` gives the commands that made the example data.
#[test]
fn the_example_data_are_what_their_commands_make() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data");
    let truth = gyroid::config::Config::read(data.join("truth.toml")).unwrap();
    let mut robot = gyroid::config::Config::read_base(data.join("robot.toml")).unwrap();
    assert!(robot.gyro.is_none());
    robot.gyro = truth.gyro.clone();
    assert_eq!(robot, truth);

    let p = Place::new();
    std::fs::copy(data.join("truth.toml"), p.path("truth.toml")).unwrap();
    p.ok("simulate truth.toml --duration 1800 --sample-time 0.1 --seed 1 -o again.csv");
    let [kept, again] = [data.join("power_on.csv"), p.path("again.csv")].map(|f| gyroid::ingest::read_log(&f).unwrap());
    assert_eq!(kept.len(), again.len());
    let gyro = |log: &gyroid::signal::Log| log.get("gyro_z_rad_s").unwrap().to_vec();
    for (a, b) in gyro(&kept).iter().zip(gyro(&again)) {
        // exp and ln of another platform may differ in the last digits
        assert!((a - b).abs() < 1e-14, "{a} {b}");
    }
}

#[test]
fn quiet_is_quiet() {
    let p = Place::new();
    assert_eq!(p.ok("simulate robot.toml --course random --duration 5 -q -o d.parquet"), "");
    assert_eq!(p.ok("navigate robot.toml d.parquet -q"), "");
}

#[test]
fn mistakes_are_named_with_their_exit_code() {
    let p = Place::new();
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
