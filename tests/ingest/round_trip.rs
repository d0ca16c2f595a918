//! What is written is read back; nothing that is read can crash the reader.

use super::*;
use gyroid::ErrorKind as K;
use gyroid::ingest::inspect;
use gyroid::ingest::{LogWriter, read_log, write_log};
use gyroid::signal::{Log, TimeAxis};
use proptest::prelude::*;

fn drive(values: &[f64]) -> Log {
    let n = values.len();
    let mut log =
        Log::new("test", TimeAxis::Explicit((0..n).map(|i| 0.1 * i as f64 + 0.03 * (i % 3) as f64).collect()));
    log.push("time_since_power_on_s", (0..n).map(|i| 600.0 + 0.1 * i as f64).collect()).unwrap();
    log.push("gyro_z_rad_s", values.to_vec()).unwrap();
    log.push("x_m", values.iter().enumerate().map(|(i, v)| if i % 2 == 0 { *v } else { f64::NAN }).collect()).unwrap();
    log
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|v| if v.is_nan() { u64::MAX } else { v.to_bits() }).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn logs_come_back_bit_for_bit(values in proptest::collection::vec(prop_oneof![-1e3..1e3f64, Just(f64::NAN), Just(0.0), Just(1e-300)], 2..60)) {
        let files = Files::new();
        let log = drive(&values);
        for name in ["a.csv", "a.csv.gz", "a.parquet"] {
            write_log(files.path(name), &log).unwrap();
            let back = read_log(files.path(name)).unwrap();
            prop_assert_eq!(bits(&back.time.to_vec()), bits(&log.time.to_vec()));
            prop_assert_eq!(back.channels.len(), log.channels.len());
            for (a, b) in back.channels.iter().zip(&log.channels) {
                prop_assert_eq!(&a.name, &b.name);
                prop_assert_eq!(bits(&a.values), bits(&b.values), "{} in {}", a.name, name);
            }
        }
    }

    #[test]
    fn no_text_crashes_the_reader(text in "[-0-9.,;\t e\"#\n\ra-z_/()\\[\\]]{0,300}") {
        let files = Files::new();
        let path = files.put("x.csv", &text);
        for result in [read(&path).err(), read_log(&path).err(), inspect(&path).err()].into_iter().flatten() {
            prop_assert!(result.to_string().contains("x.csv"));
        }
    }

    #[test]
    fn no_bytes_crash_the_reader(bytes in proptest::collection::vec(any::<u8>(), 0..300), magic in 0..3usize) {
        let files = Files::new();
        let magic: &[u8] = [&b""[..], b"PAR1", &[0x1f, 0x8b]][magic];
        let path = files.put("x", [magic, &bytes].concat());
        let _ = (read(&path), read_log(&path), inspect(&path));
    }
}

#[test]
fn a_damaged_parquet_file_is_an_error_or_read_as_it_was() {
    let files = Files::new();
    let path = files.path("a.parquet");
    write_log(&path, &drive(&rates(200))).unwrap();
    let sound = std::fs::read(&path).unwrap();
    let log = read_log(&path).unwrap();
    let numbers = |log: &Log| log.channels.iter().map(|c| (c.name.clone(), bits(&c.values))).collect::<Vec<_>>();
    let mut s = gyroid::math::random::Stream::new(5, 0);
    let mut told = 0;
    for turn in 0..300 {
        let mut bytes = sound.clone();
        let at = (s.uniform() * bytes.len() as f64) as usize;
        let to = at + (s.uniform() * (bytes.len() - at) as f64) as usize;
        match turn % 4 {
            0 | 1 => bytes[at] ^= 1 << (s.uniform() * 8.0) as u32,
            2 => bytes.truncate(at),
            _ => bytes = [&sound[..to], &sound[at..]].concat(),
        }
        if bytes == sound {
            continue;
        }
        match read_log(files.put("b.parquet", bytes)) {
            Ok(read) => {
                assert_eq!(bits(&read.time.to_vec()), bits(&log.time.to_vec()), "{at}");
                assert_eq!(numbers(&read), numbers(&log), "{at}");
            }
            Err(error) => {
                told += 1;
                assert!(error.to_string().contains("b.parquet") && error.hint.is_some(), "{error}");
                assert!(turn % 4 > 1 || error.place.is_some(), "{error}");
            }
        }
    }
    // what is not told is in pages' headers and in names of what nobody reads
    assert!(told > 240, "{told}");
}

#[test]
fn the_place_is_claimed_before_the_work() {
    let files = Files::new();
    refused(LogWriter::claim(files.path("a.xlsx")), K::Usage, &["a.xlsx", ".parquet, .csv or .csv.gz"]);
    refused(LogWriter::claim(files.path("no/such/a.csv")), K::Io, &["no directory"]);
    let writer = LogWriter::claim(files.path("a.csv")).unwrap();
    assert!(!files.path("a.csv").exists());
    writer.write(&drive(&[1.0, 2.0])).unwrap();
    assert!(std::fs::read_to_string(files.path("a.csv")).unwrap().starts_with("t_s,time_since_power_on_s,"));
    let mut clash = Log::new("test", TimeAxis::Explicit(vec![0.0]));
    clash.push("t_s", vec![1.0]).unwrap();
    refused(write_log(files.path("b.csv"), &clash), K::Column, &["t_s"]);
    assert!(!files.path("b.csv").exists());
}

#[test]
fn drives_get_canonical_names() {
    let files = Files::new();
    let path = files.put(
        "d.csv",
        "timestamp_ms,yaw_rate_dps,temp_degC,odo_v_m_s,state\n0,90,20.5,1.5,go\n10,180,,1.6,go\n20,0,21.5,,stop\n",
    );
    let log = read_log(&path).unwrap();
    let names: Vec<_> = log.channels.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["gyro_z_rad_s", "temperature_c", "odo_speed_m_s"]);
    assert!((log.require("gyro_z_rad_s").unwrap()[1] - std::f64::consts::PI).abs() < 1e-12);
    assert!(log.get("temperature_c").unwrap()[1].is_nan());
    assert!((log.time.at(2) - 0.02).abs() < 1e-12);
}
