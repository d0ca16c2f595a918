//! Recorded drives that others published, and that are not in the repository: `GYROID_REAL` names the folder that holds them,
//! `GYROID_REAL=... cargo test --test navigate real_drives -- --ignored` runs these tests.
//!
//! What can be asked of a recording without knowing its truth: sensors that agree on the way, a track that keeps to the
//! reference better than one whose gyro is turned round, and the files' own numbers of rows.

use gyroid::config::Config;
use gyroid::effects::Library;
use gyroid::gap::{Drive, Options, diagnose_drives};
use gyroid::ingest::{ChannelMap, DriveQuery, DriveRecording, read_drive};
use gyroid::navigate::{
    ErrorModel, ReferenceErrors, Settings, Summary, Track, compare, dead_reckoning, gyro_reckoning, run,
};
use std::path::PathBuf;

fn recorded(folder: &str, files: &[&str], maps: &[&str]) -> DriveRecording {
    let root = std::env::var_os("GYROID_REAL").expect("GYROID_REAL names the folder of the recordings");
    let folder = PathBuf::from(root).join(folder);
    let paths: Vec<_> = files.iter().map(|f| folder.join(f)).collect();
    let maps = maps.iter().map(|m| ChannelMap::parse(m).unwrap()).collect();
    read_drive(&paths, &DriveQuery { maps, ..DriveQuery::default() }).unwrap()
}

fn config(name: &str) -> Config {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("data/drives").join(name);
    Config::read_base(path).unwrap()
}

const HUSKY: [&str; 3] = ["imu_30hz.csv.gz", "wheel_odom_10hz.csv.gz", "gps_2p5hz.csv.gz"];

fn row(name: &str, errors: &ReferenceErrors, summary: Option<&Summary>) {
    let heading = errors.heading_rms_rad.map_or("-".into(), |h| format!("{:.2}°", h.to_degrees()));
    let nis = summary.map_or(String::new(), |s| format!(", NIS {:.2}", s.consistency.nis_mean));
    println!(
        "{name}: position {:.3} m rms, {:.3} m end, heading {heading} rms{nis}",
        errors.position_rms_m, errors.position_end_m
    );
}

/// The configurations are read as they are, also where the recordings are absent.
#[test]
fn the_configurations_hold() {
    for (name, gyro) in [("husky.toml", true), ("wifibot.toml", false), ("smartloc.toml", true)] {
        let config = config(name);
        assert_eq!(config.gyro.is_some(), gyro, "{name}");
        assert!(config.vehicle.is_some() && config.encoder.is_some() && config.pose.is_some(), "{name}");
    }
}

#[test]
#[ignore = "needs recordings that are not in the repository: GYROID_REAL names their folder"]
fn husky_three_files_become_one_drive() {
    let drive = recorded("drive_husky", &HUSKY, &["gyro_z_rad_s=gy_rad_s"]);
    let (config, log) = (config("husky.toml"), &drive.log);
    let count = |name: &str| log.get(name).unwrap().iter().filter(|v| v.is_finite()).count();
    // the files' own rows
    assert_eq!([count("gyro_z_rad_s"), count("odo_speed_m_s"), count("x_m")], [11865, 3952, 989]);
    assert!(log.len() <= 11865 + 3952 + 989 && log.get("heading_rad").is_none());

    let off = Settings { error_model: ErrorModel::Off, ..Settings::default() };
    let with = run(&config, log, &Settings::default()).unwrap().summary;
    let without = run(&config, log, &off).unwrap().summary;
    let errors = |s: &Summary| s.reference.clone().unwrap();
    row("husky, with error model", &errors(&with), Some(&with));
    row("husky, without", &errors(&without), Some(&without));
    let encoders = dead_reckoning(&config, log, &off).unwrap().reference.unwrap();
    let gyro = gyro_reckoning(&config, log, &off).unwrap().reference.unwrap();
    row("husky, encoders", &encoders, None);
    row("husky, gyro", &gyro, None);
    assert!(errors(&with).heading_rms_rad.is_none() && errors(&with).nees_end.is_none());
    let aligned = errors(&with).alignment.unwrap();
    assert!((aligned.path_share - 0.2).abs() < 0.05, "{aligned:?}");

    // a gyro that is turned round leads further astray
    let turned = recorded("drive_husky", &HUSKY, &["gyro_z_rad_s=-gy_rad_s"]).log;
    let turned = gyro_reckoning(&config, &turned, &off).unwrap().reference.unwrap();
    assert!(turned.position_rms_m > 2.0 * gyro.position_rms_m, "{turned:?} {gyro:?}");
}

#[test]
#[ignore = "needs recordings that are not in the repository: GYROID_REAL names their folder"]
fn husky_without_its_imu_goes_by_the_wheels() {
    let drive = recorded("drive_husky", &HUSKY[1..], &[]);
    let mut config = config("husky.toml");
    config.gyro = None;
    let summary = run(&config, &drive.log, &Settings::default()).unwrap().summary;
    assert!(summary.notes.iter().any(|n| n.contains("no gyro")), "{:?}", summary.notes);
    let sensors: Vec<_> = summary.consistency.sensors.iter().map(|s| s.sensor).collect();
    assert_eq!(sensors, ["wheel_left", "wheel_right"]);
}

#[test]
#[ignore = "needs recordings that are not in the repository: GYROID_REAL names their folder"]
fn wifibot_is_compared_in_heading_too() {
    for file in ["run2.csv.gz", "run3.csv.gz", "run4.csv.gz", "run5.csv.gz"] {
        let drive = recorded("drive_wifibot", &[file], &[]);
        let (config, log) = (config("wifibot.toml"), &drive.log);
        let found = run(&config, log, &Settings::default()).unwrap();
        let errors = found.summary.reference.clone().unwrap();
        row(&format!("wifibot {file}, filter"), &errors, Some(&found.summary));
        let reckoned = dead_reckoning(&config, log, &Settings::default()).unwrap().reference.unwrap();
        row(&format!("wifibot {file}, encoders"), &reckoned, None);
        assert!(errors.alignment.is_none() && errors.nees_end.is_some());
        // without a gyro the filter has nothing but the encoders: it stays with them, within its own 5 σ at the end
        let difference = (errors.heading_end_rad.unwrap() - reckoned.heading_end_rad.unwrap()).abs();
        assert!(difference < 5.0 * found.summary.final_pose.heading_rad.std, "{file}: {difference}");
        assert!(gyro_reckoning(&config, log, &Settings::default()).is_err());

        let column = |name: &str| found.pose.get(name).unwrap();
        let track = Track { x_m: column("x_m"), y_m: column("y_m"), heading_rad: column("heading_rad") };
        let compared = compare(&config, log, &Settings::default(), &track).unwrap().unwrap();
        let square = compared.position_error_m.iter().map(|d| d * d).sum::<f64>();
        let rms = (square / compared.rows.len() as f64).sqrt();
        assert!((rms - errors.position_rms_m).abs() < 1e-9 * rms, "{rms}");
    }
}

#[test]
#[ignore = "needs recordings that are not in the repository: GYROID_REAL names their folder"]
fn smartloc_has_one_speed_and_no_heading() {
    let drive = recorded("drive_smartloc", &["run.csv.gz"], &[]);
    let (config, log) = (config("smartloc.toml"), &drive.log);
    let found = run(&config, log, &Settings::default()).unwrap().summary;
    let errors = found.reference.clone().unwrap();
    row("smartloc, with error model", &errors, Some(&found));
    let gyro = gyro_reckoning(&config, log, &Settings::default()).unwrap().reference.unwrap();
    row("smartloc, gyro", &gyro, None);
    assert!(dead_reckoning(&config, log, &Settings::default()).is_err());
    let sensors: Vec<_> = found.consistency.sensors.iter().map(|s| s.sensor).collect();
    assert_eq!(sensors, ["gyro", "speed"]);
    assert!(errors.heading_rms_rad.is_none());
    let turned = recorded("drive_smartloc", &["run.csv.gz"], &["gyro_z_rad_s=-yaw_rate_rad_s"]).log;
    let turned = run(&config, &turned, &Settings::default()).unwrap().summary.reference.unwrap();
    assert!(turned.position_rms_m > 2.0 * errors.position_rms_m, "{turned:?}");
}

/// What least squares on the raw readings give: the odometry lags the gyro by 0.36 to 0.38 s in each third of the drive, and
/// reads 1/1.10 to 1/1.21 of the turning, as its readings or the gyro's are taken to be exact.
#[test]
#[ignore = "needs recordings that are not in the repository: GYROID_REAL names their folder"]
fn husky_wheels_lag_the_gyro_by_what_the_raw_data_says() {
    let drive = recorded("drive_husky", &HUSKY, &["gyro_z_rad_s=gy_rad_s"]);
    let fit = [Drive::new(&drive.log, 0.0)];
    let (library, options) = (Library::new(), Options::default());
    let answer = diagnose_drives(&config("husky.toml"), &fit, &[], &library, &options, &mut |_| {}).unwrap().answer;
    let late_s = answer.time_offsets.iter().find(|t| t.channel == "wheels").unwrap().offset_s;
    println!("husky: wheels late by {late_s:.3} s");
    assert!((0.32..0.40).contains(&late_s), "{late_s}");
    let nearest = answer.nearest.unwrap();
    println!("husky: nearest {}, {:.2} of what was explained", nearest.id, nearest.share);
    // a robot that skids has the track that its motion shows: 1/1.21 to 1/1.10 of what is written, less one
    assert_eq!(nearest.id, "vehicle.track_width");
    let size = answer.effects.iter().find(|e| e.id == nearest.id).unwrap().parameters["relative"];
    assert!((-0.18..-0.09).contains(&size), "{size}");
}
