//! One log at rest in every format (written by `make.py`): the same samples, the same fit; damage is told and not met by
//! a panic.

#[path = "../common/cases.rs"]
mod cases;
mod damage;
mod entry;
mod found;
mod held;
mod hostile;
mod topics;

use gyroid::identify::{FitOptions, fit, fit_reduced};
use gyroid::ingest::{Clock, GyroQuery, GyroRecording, Reading, Stamp, read_gyro, read_gyro_within};
use gyroid::units::{RateUnit, TimeUnit};
use std::path::{Path, PathBuf};

/// How a format holds a rate.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Held {
    Double,
    Single,
    /// As an increment of angle over 5 ms, of single precision.
    Increment,
}

/// A file, what to ask for, and how the rates are held in it.
struct Case {
    file: &'static str,
    topic: Option<&'static str>,
    /// Time and rate column, where the file names neither.
    columns: Option<(&'static str, &'static str)>,
    /// Whether the file states the unit.
    unit: bool,
    held: Held,
}

const fn case(file: &'static str, topic: Option<&'static str>, held: Held) -> Case {
    Case { file, topic, columns: None, unit: true, held }
}

const CASES: [Case; 26] = [
    case("euroc.csv", None, Held::Double),
    case("ros1.bag", None, Held::Double),
    case("ros1_lz4.bag", None, Held::Double),
    case("ros1_bz2.bag", Some("/imu/data"), Held::Double),
    case("ros1_unstamped.bag", None, Held::Double),
    case("ros2.mcap", None, Held::Double),
    case("ros2_lz4.mcap", Some("imu/data"), Held::Double),
    case("ros2_zstd.mcap", None, Held::Double),
    case("px4.mcap", None, Held::Single),
    case("ros2.db3", None, Held::Double),
    case("px4.ulg", Some("sensor_gyro/0"), Held::Single),
    case("px4.ulg", Some("sensor_combined"), Held::Single),
    case("px4.ulg", Some("vehicle_imu"), Held::Increment),
    case("ardupilot.bin", Some("IMU/0"), Held::Single),
    case("ardupilot.bin", Some("GYR"), Held::Single),
    Case { unit: false, ..case("v5.mat", None, Held::Double) },
    Case { unit: false, ..case("v5_struct.mat", None, Held::Double) },
    Case { unit: false, ..case("v73.mat", None, Held::Double) },
    case("log.h5", None, Held::Double),
    Case { unit: false, ..case("log.npz", None, Held::Double) },
    Case { unit: false, ..case("record.npy", None, Held::Single) },
    Case { unit: false, columns: Some(("column_1", "column_4")), ..case("matrix.npy", None, Held::Double) },
    case("px4.db3", Some("/fmu/out/sensor_combined"), Held::Single),
    case("px4.db3", Some("/fmu/out/sensor_gyro"), Held::Single),
    case("px4.db3", Some("/fmu/out/vehicle_imu"), Held::Increment),
    case("px4.ulg", Some("sensor_gyro/1"), Held::Single),
];

const SAMPLES: usize = 400;
const STEP_S: f64 = 0.5;

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats").join(name)
}

/// The yaw rates as Python wrote them, read without any of the library's readers.
fn written() -> Vec<f64> {
    let text = std::fs::read_to_string(file("euroc.csv")).unwrap();
    text.lines().skip(1).map(|line| line.split(',').nth(3).unwrap().parse().unwrap()).collect()
}

impl Case {
    fn query(&self) -> GyroQuery {
        GyroQuery {
            topic: self.topic.map(str::to_string),
            column: self.columns.map(|c| c.1.to_string()),
            time: self.columns.map(|c| c.0.to_string()),
            // seconds since the first sample could as well be milliseconds of a fast sensor
            time_unit: (self.columns.is_some() || self.file.ends_with(".mat")).then_some(TimeUnit::S),
            unit: (!self.unit).then_some(RateUnit::RadPerS),
            ..GyroQuery::default()
        }
    }

    fn expected(&self) -> Vec<f64> {
        // the second sensor is mounted the other way round
        let sign = if self.topic == Some("sensor_gyro/1") { -1.0 } else { 1.0 };
        let single = |x: f64| f64::from(x as f32);
        let held = |x: f64| match self.held {
            Held::Double => x,
            Held::Single => single(x),
            Held::Increment => single(x * 5000e-6) / (5000.0 * 1e-6),
        };
        written().into_iter().map(|x| held(sign * x)).collect()
    }

    fn read(&self) -> GyroRecording {
        read_gyro(file(self.file), &self.query()).unwrap_or_else(|e| panic!("{}: {e}", self.file))
    }
}

fn rates(recording: &GyroRecording) -> &[f64] {
    recording.log.get("gyro_z_rad_s").unwrap()
}

/// C1, C2 and T of the warm-up, time counted from the first sample.
fn fitted(time: &gyroid::signal::TimeAxis, rates: &[f64]) -> [f64; 3] {
    let found = fit(&time.clone().shifted(-time.at(0)), rates, &FitOptions::default()).unwrap();
    [found.c1_rad_s.estimate, found.c2_rad_s.estimate, found.time_constant_s.estimate]
}

#[test]
fn every_format_is_read_in_one_pass_to_the_same_fit() {
    for case in CASES {
        let name = format!("{} {:?}", case.file, case.topic);
        let whole = case.read();
        let reading = read_gyro_within(file(case.file), &case.query(), 0, &mut |_| ());
        let Reading::Streamed(streamed) = reading.unwrap_or_else(|e| panic!("{name}: {e}")) else {
            panic!("{name} was held")
        };
        assert_eq!(streamed.log.stretches[0].values, rates(&whole), "{name}");
        assert_eq!(
            (&streamed.column, streamed.unit, streamed.clock),
            (&whole.column, whole.unit, whole.clock),
            "{name}"
        );
        assert_eq!(streamed.sha256, whole.sha256, "{name}");
        let (ours, theirs) = (&streamed.audit, &whole.audit);
        assert_eq!(
            (ours.rows, ours.samples, ours.gaps.count),
            (theirs.rows, theirs.samples, theirs.gaps.count),
            "{name}"
        );
        let first = streamed.log.moments.first_s;
        let found = fit_reduced(&streamed.log.clone().shifted(-first), &FitOptions::default()).unwrap();
        let found = [&found.c1_rad_s, &found.c2_rad_s, &found.time_constant_s].map(|e| e.estimate);
        for (a, b) in found.iter().zip(fitted(&whole.log.time, rates(&whole))) {
            assert!((a / b - 1.0).abs() < 1e-6, "{name}: {a} {b}");
        }
    }
}

#[test]
fn every_format_gives_the_same_samples() {
    for case in CASES {
        let recording = case.read();
        let name = format!("{} {:?}", case.file, case.topic);
        assert_eq!(recording.unit, RateUnit::RadPerS, "{name}");
        assert_eq!(rates(&recording), case.expected(), "{name}");
        let time = &recording.log.time;
        assert_eq!(time.len(), SAMPLES, "{name}");
        for i in 0..SAMPLES {
            // a nanosecond is the finest that any of them holds
            let late = time.at(i) - time.at(0) - STEP_S * i as f64;
            assert!(late.abs() < 1e-9, "{name}: {late} s at {i}");
        }
        assert_eq!(recording.sha256.len(), 64, "{name}");
    }
}

#[test]
fn every_format_gives_the_same_fit() {
    let even = gyroid::signal::TimeAxis::Uniform { start_s: 0.0, step_s: STEP_S, len: SAMPLES };
    for case in CASES {
        let recording = case.read();
        let (found, wanted) = (fitted(&recording.log.time, rates(&recording)), fitted(&even, &case.expected()));
        for (a, b) in found.iter().zip(wanted) {
            // the samples are equal bit for bit; what is left is the rounding of the times
            assert!((a / b - 1.0).abs() < 1e-9, "{}: {found:?} {wanted:?}", case.file);
        }
    }
}

#[test]
fn times_count_from_boot_where_the_format_says_so() {
    for case in CASES {
        let clock = case.read().clock;
        match case.file {
            "px4.ulg" | "ardupilot.bin" => assert_eq!(clock, Clock::PowerOn { first_s: 12.0, stated: true }),
            "px4.mcap" | "px4.db3" => assert_eq!(clock, Clock::PowerOn { first_s: 12.0, stated: false }),
            "v5.mat" | "v5_struct.mat" | "v73.mat" | "matrix.npy" => {
                assert_eq!(clock, Clock::PowerOn { first_s: 0.0, stated: false });
            }
            file => {
                let late = if file == "ros1_unstamped.bag" { 0.003 } else { 0.0 };
                let Clock::FirstSample { file_s } = clock else { panic!("{file}: {clock:?}") };
                assert!((file_s - 1.7e9 - late).abs() < 1e-6, "{file}: {file_s}");
            }
        }
    }
}

#[test]
fn a_sensor_that_is_mounted_the_other_way_round_is_turned() {
    let [first, .., last] = &CASES;
    assert!(first.expected() == written() && last.topic == Some("sensor_gyro/1"));
    let turned = read_gyro(file(last.file), &GyroQuery { reversed: true, ..last.query() }).unwrap();
    assert_eq!(rates(&turned), CASES[10].expected());
    assert!(turned.notes.iter().any(|n| n.contains("other sign")), "{:?}", turned.notes);
}

#[test]
fn temperature_comes_along_where_it_is_logged() {
    for (name, topic) in [("px4.ulg", "sensor_gyro/1"), ("ardupilot.bin", "IMU/0")] {
        let query = GyroQuery { topic: Some(topic.into()), ..GyroQuery::default() };
        let recording = read_gyro(file(name), &query).unwrap();
        let temperature = recording.log.get("temperature_c").unwrap();
        assert_eq!(temperature[0], 25.0);
        let last = 25.0 + 10.0 * (1.0 - (-STEP_S * (SAMPLES - 1) as f64 / 30.0).exp());
        assert!((temperature[SAMPLES - 1] - last).abs() < 2e-6, "{name}: {}", temperature[SAMPLES - 1]);
    }
    assert!(CASES[20].read().log.get("temperature_c").is_some());
}

#[test]
fn the_time_of_receipt_counts_if_asked_for() {
    let read = |name: &str, topic: Option<&str>| {
        let query = GyroQuery { topic: topic.map(str::to_string), stamp: Stamp::Receipt, ..GyroQuery::default() };
        read_gyro(file(name), &query).unwrap().clock
    };
    for name in ["ros1_lz4.bag", "ros2_zstd.mcap", "ros2.db3", "px4.mcap"] {
        let Clock::FirstSample { file_s } = read(name, None) else { panic!("{name}") };
        assert!((file_s - 1.7e9 - 0.003).abs() < 1e-6, "{name}: {file_s}");
    }
    for (name, topic, late) in [("px4.ulg", "sensor_gyro/0", 200e-6), ("ardupilot.bin", "GYR/0", 150e-6)] {
        let Clock::PowerOn { first_s, .. } = read(name, Some(topic)) else { panic!("{name}") };
        assert!((first_s - 12.0 - late).abs() < 1e-9, "{name}: {first_s}");
    }
    let notes = CASES[4].read().notes;
    assert!(notes.iter().any(|n| n.contains("zero") && n.contains("receipt")), "{notes:?}");
}
