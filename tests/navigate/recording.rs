//! `gyroid navigate --mcap`: what it writes is read back as a log, and replaces only its own.

use crate::ROBOT;
use crate::place::Place;
use gyroid::ingest::{GyroQuery, read_gyro};
use gyroid::signal::names;

#[test]
fn a_recording_has_the_gyro_as_it_was_and_less_its_error() {
    let p = Place::with(&[("robot.toml", ROBOT)]);
    p.ok("simulate robot.toml --course square --duration 20 --start-offset 20 -o drive.parquet");
    let text = p.ok("navigate robot.toml drive.parquet --filtered -o pose.parquet --mcap out.mcap");
    assert!(text.contains("wrote out.mcap; Foxglove's layout for it is out.foxglove.json"), "{text}");
    let rates = |topic: &str| {
        let query = GyroQuery { topic: Some(topic.into()), ..GyroQuery::default() };
        read_gyro(p.path("out.mcap"), &query).unwrap().log.get(names::GYRO_Z).unwrap().to_vec()
    };
    let (raw, corrected) = (rates("/imu/data_raw"), rates("/imu/data"));
    let recorded = read_gyro(p.path("drive.parquet"), &GyroQuery::default()).unwrap();
    assert_eq!(raw, recorded.log.get(names::GYRO_Z).unwrap());
    // a gyro error of C2 = 8e-3 rad/s, known within the spread from one power-on to the next, 2e-4 rad/s
    let mean = raw.iter().zip(&corrected).map(|(raw, less)| raw - less).sum::<f64>() / raw.len() as f64;
    assert!((mean - 8e-3).abs() < 1e-3, "{mean}");
    // its own is replaced, another's is not
    p.ok("navigate robot.toml drive.parquet --mcap out.mcap");
    std::fs::write(p.path("out.foxglove.json"), "{\"configById\": {}}").unwrap();
    p.refused(
        "navigate robot.toml drive.parquet --mcap out.mcap",
        1,
        &["out.foxglove.json", "gyroid did not write it"],
    );
    p.refused("navigate robot.toml drive.parquet --mcap other.bag", 2, &["let the name end in .mcap"]);
}
