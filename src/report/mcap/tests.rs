use super::drive;
use super::messages::Header;
use super::recording::Recording;
use crate::files::OutputFile;
use crate::ingest::{GyroQuery, read_gyro};

/// A recording of a gyro that begins at `first_s`, 100 rows a second apart by 10 ms.
fn written(first_s: f64) -> (tempfile::TempDir, std::path::PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("gyro.mcap");
    let mut to = Recording::new(OutputFile::claim(&path).unwrap(), first_s).unwrap();
    let topic = to.topic("/imu/data_raw").unwrap();
    for k in 0..100 {
        let time_s = first_s + 0.01 * f64::from(k);
        let header = Header::new(to.stamp(time_s), "imu_link");
        to.put(&topic, time_s, &drive::imu(header, 1e-3 * f64::from(k), 0.0)).unwrap();
    }
    to.finish().unwrap();
    (dir, path)
}

#[test]
fn a_recording_is_a_log() {
    for first_s in [0.0, 20.0, 1.7e9] {
        let (_dir, path) = written(first_s);
        let log = read_gyro(&path, &GyroQuery::default()).unwrap().log;
        assert_eq!(log.len(), 100);
        let rates = log.get(crate::signal::names::GYRO_Z).unwrap();
        assert!(rates.iter().enumerate().all(|(k, rate)| *rate == 1e-3 * k as f64));
        assert!((log.time.span_s() - 0.99).abs() < 1e-6);
    }
}

#[test]
fn a_log_that_begins_before_zero_is_shifted() {
    let (_dir, path) = written(-5.0);
    let bytes = std::fs::read(&path).unwrap();
    let messages: Vec<_> = mcap::MessageStream::new(&bytes).unwrap().map(|m| m.unwrap()).collect();
    assert_eq!((messages[0].log_time, messages[99].log_time), (0, 990_000_000));
    assert_eq!(messages[0].channel.schema.as_ref().unwrap().name, "sensor_msgs/msg/Imu");
}
