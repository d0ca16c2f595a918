//! Which of several topics is read, and what is said about the others.

use super::*;
use gyroid::ErrorKind;
use gyroid::ingest::inspect;
use gyroid::ingest::{DriveQuery, inspect_topic, read_drive};
use std::process::Command;

fn gyroid(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_gyroid")).args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

fn read(name: &str, topic: &str) -> gyroid::Result<GyroRecording> {
    read_gyro(file(name), &GyroQuery { topic: Some(topic.into()), ..GyroQuery::default() })
}

#[test]
fn the_only_gyro_is_taken_and_said() {
    for name in ["ros1.bag", "ros2.mcap", "ros2.db3"] {
        let notes = read_gyro(file(name), &GyroQuery::default()).unwrap().notes;
        assert!(notes.iter().any(|n| n.contains("/imu/data") && n.contains("only one with a gyro")), "{notes:?}");
    }
}

#[test]
fn several_gyros_are_asked_about() {
    let text = read_gyro(file("px4.ulg"), &GyroQuery::default()).unwrap_err().to_string();
    for part in ["sensor_combined/0", "sensor_gyro/0", "sensor_gyro/1", "vehicle_imu/0", "400 messages", "--topic"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    // a status of sensors is no gyro
    assert!(!text.contains("sensors_status_imu"), "{text}");
    let text = read_gyro(file("ardupilot.bin"), &GyroQuery::default()).unwrap_err().to_string();
    assert!(text.contains("GYR/0 (GYR, 400 messages), IMU/0") && !text.contains("XKF1"), "{text}");
    // a name without its instance, where there are two
    let text = read("px4.ulg", "sensor_gyro").unwrap_err().to_string();
    assert!(text.contains("sensor_gyro/0, sensor_gyro/1"), "{text}");
}

#[test]
fn a_topic_that_is_missing_lists_those_that_are_there() {
    for (name, there) in [
        (
            "ros1.bag",
            "/imu/data (sensor_msgs/Imu, 400 messages), /imu/temperature (sensor_msgs/Temperature, 40 messages)",
        ),
        ("ros2.mcap", "/chatter (std_msgs/msg/String, 8 messages), /imu/data (sensor_msgs/msg/Imu, 400 messages)"),
        ("ros2.db3", "/imu/data (sensor_msgs/msg/Imu, 400 messages)"),
        ("px4.ulg", "sensors_status_imu/0 (sensors_status_imu, 4 messages)"),
        ("ardupilot.bin", "XKF1 (XKF1, 8 messages)"),
        ("v5_struct.mat", "gps (2 columns, 40 messages), imu (5 columns, 400 messages)"),
    ] {
        let error = read(name, "/imu/raw").unwrap_err();
        assert_eq!(error.kind, ErrorKind::Column);
        assert!(error.to_string().contains(there), "{error}");
    }
    let error = read("euroc.csv", "/imu").unwrap_err();
    assert!(error.kind == ErrorKind::Usage && error.to_string().contains("no topics"), "{error}");
    // a topic without a gyro has columns
    let text = read("ros1.bag", "/imu/temperature").unwrap_err().to_string();
    assert!(text.contains("header.stamp") && text.contains("temperature"), "{text}");
}

#[test]
fn inspection_lists_topics_types_counts_and_rates() {
    let report = inspect(file("ros2.mcap")).unwrap();
    let seen: Vec<(&str, u64, bool)> = report.topics.iter().map(|t| (t.name.as_str(), t.messages, t.gyro)).collect();
    assert_eq!(seen, [("/chatter", 8, false), ("/imu/data", 400, true)]);
    assert!((report.topics[1].rate_hz.unwrap() - 2.0).abs() < 1e-9);
    assert!(report.fits() && report.topic.as_deref() == Some("/imu/data") && report.rows == 400);
    let report = inspect(file("px4.ulg")).unwrap();
    assert!(!report.fits() && report.topics.len() == 5 && report.columns.is_empty());
    assert!(report.problems[0].contains("several topics hold a gyro"), "{:?}", report.problems);
    assert!(inspect_topic(file("px4.ulg"), Some("sensor_gyro/1"), Stamp::Header, false).unwrap().fits());
    assert!(inspect_topic(file("px4.ulg"), Some("nope"), Stamp::Header, false).is_err());
}

#[test]
fn the_commands_take_a_topic() {
    let path = |name: &str| file(name).display().to_string();
    let (code, out, err) = gyroid(&["inspect", &path("px4.ulg")]);
    assert_eq!((code, err.as_str()), (0, ""));
    for part in ["5 topics", "sensor_gyro/1", "400", "2 Hz", "name it with --topic"] {
        assert!(out.contains(part), "{part}: {out}");
    }
    let (code, out, _) = gyroid(&["inspect", &path("px4.ulg"), "--topic", "sensor_gyro/0"]);
    assert!(code == 0 && out.contains("gyro z") && out.contains("can use x, y, z"), "{out}");
    let (code, out, err) = gyroid(&["fit", &path("ros1_lz4.bag"), "--topic", "/imu/data", "--no-plot", "--json", "-"]);
    assert!(code == 0 || code == 3, "{err}");
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    let wanted = fitted(&CASES[2].read().log.time, &CASES[2].expected())[2];
    let found = json["parameters"]["time_constant_s"]["estimate"].as_f64().unwrap();
    assert!((found / wanted - 1.0).abs() < 1e-6, "{found} {wanted}");
    let (code, out, err) = gyroid(&["fit", &path("ros1.bag"), "--axis", "-x", "--no-plot"]);
    assert!((code == 0 || code == 3) && out.contains("other sign"), "{out} {err}");
    assert_eq!(gyroid(&["fit", &path("ros1.bag"), "--axis", "w"]).0, 2);
    let (code, _, err) = gyroid(&["fit", &path("px4.ulg"), "--no-plot"]);
    assert!(code == 1 && err.contains("sensor_gyro/1"), "{err}");
    // several topics are several logs: a table
    let two = ["noise", &path("px4.ulg"), "--topic", "sensor_gyro/0", "--topic", "sensor_gyro/1"];
    let (code, out, err) = gyroid(&two);
    assert!((code == 0 || code == 3) && out.contains("sensor_gyro/0") && out.contains("sensor_gyro/1"), "{out} {err}");
    let (code, _, err) = gyroid(&["noise", &path("px4.ulg"), "--topic", "a", "--topic", "b"]);
    assert!(code == 1 && err.contains("no topic \"a\"") && err.contains("--topic"), "{err}");
    let (code, out, err) = gyroid(&["noise", &path("px4.ulg"), "--topic", "all"]);
    assert!((code == 0 || code == 3) && out.contains("sensor_gyro/1"), "{out} {err}");
    let (code, out, _) = gyroid(&["inspect", &path("ros2.db3"), "--clock", "receipt"]);
    assert!(code == 0 && out.contains("\"receipt_time\""), "{out}");
}

#[test]
fn a_drive_reads_several_topics_of_one_bag() {
    let query = DriveQuery { topics: vec!["/imu/data".into(), "/imu/temperature".into()], ..DriveQuery::default() };
    let log = read_drive(&[file("ros1.bag")], &query).unwrap().log;
    assert_eq!(log.get("gyro_z_rad_s").unwrap(), written());
    let temperature = log.get("temperature_c").unwrap();
    assert_eq!(temperature.iter().filter(|v| !v.is_nan()).count(), SAMPLES / 10);
    let query = DriveQuery { topics: vec!["/odom".into()], ..DriveQuery::default() };
    assert!(read_drive(&[file("ros1.bag")], &query).unwrap_err().to_string().contains("/imu/data"));
    let both = [file("ros1.bag"), file("ros2.mcap")];
    assert!(read_drive(&both, &query).unwrap_err().to_string().contains("no file has a topic /odom"));
}
