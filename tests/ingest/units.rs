//! Units by name, by guess, and the questions that are asked.

use super::*;
use gyroid::ErrorKind as K;
use gyroid::units::RateUnit;

const N: usize = 4000;
const PER_RAD: f64 = 1.0 / RAD_S_PER_DEG_S;

fn recording(name: &str, factor: f64, unit: Option<RateUnit>) -> gyroid::Result<GyroRecording> {
    let path = Files::new();
    read_gyro(path.put("x.csv", csv(name, factor, N)), &GyroQuery { unit, ..GyroQuery::default() })
}

#[test]
fn suffixes_give_the_same_numbers_in_every_unit() {
    for (name, factor) in [
        ("gyro_z_rad_s", 1.0),
        ("gz_mrad_s", 1e3),
        ("gz_dps", PER_RAD),
        ("rate_z_deg_s", PER_RAD),
        ("Gyroscope z (°/s)", PER_RAD),
        ("gyro_z_mdps", 1e3 * PER_RAD),
        ("gz_deg_h", 3600.0 * PER_RAD),
    ] {
        let r = recording(name, factor, None).unwrap_or_else(|e| panic!("{e}"));
        assert!(!r.unit_guessed, "{name}");
        for (a, b) in gyro(&r).iter().zip(rates(N)) {
            assert!((a - b).abs() < 1e-12, "{name}: {a} {b}");
        }
    }
}

#[test]
fn without_a_suffix_the_guess_is_right_and_told() {
    for (factor, unit) in [(1.0, RateUnit::RadPerS), (PER_RAD, RateUnit::DegPerS)] {
        let r = recording("gyroZ", factor, None).unwrap();
        assert_eq!((r.unit, r.unit_guessed), (unit, true));
        assert!(r.notes.iter().any(|n| n.contains(&format!("unit guessed: {unit}"))), "{:?}", r.notes);
    }
}

#[test]
fn a_name_that_the_numbers_contradict_is_asked_about() {
    refused(recording("gz_dps", 1.0, None), K::Unit, &["named deg/s", "less than any MEMS gyro's", "--unit rad/s"]);
    refused(
        recording("gz_rad_s", PER_RAD, None),
        K::Unit,
        &["named rad/s", "more than any MEMS gyro's", "--unit deg/s"],
    );
    // what the user says is taken, and the difference is told
    let r = recording("gz_dps", 1.0, Some(RateUnit::RadPerS)).unwrap();
    assert_eq!(gyro(&r), rates(N));
    assert!(r.notes.iter().any(|n| n.contains("says deg/s") && n.contains("rad/s")), "{:?}", r.notes);
    // also when it is wrong
    let r = recording("gz_dps", 1.0, Some(RateUnit::DegPerS)).unwrap();
    assert!((gyro(&r)[7] - rates(N)[7] * RAD_S_PER_DEG_S).abs() < 1e-15);
}

#[test]
fn a_large_rest_rate_is_asked_about() {
    let files = Files::new();
    let rows: String =
        rates(N).iter().enumerate().map(|(i, x)| format!("{},{}\n", digits(i as f64 * 0.01), x + 0.5)).collect();
    let path = files.put("x.csv", format!("t_s,gz_rad_s\n{rows}"));
    refused(read(&path), K::Unit, &["28.", "deg/s, too much for a gyro at rest"]);
}

#[test]
fn unknown_units_are_named() {
    refused(recording("gz [furlong]", 1.0, None), K::Unit, &["\"furlong\"", "gz [furlong]", "mrad/s"]);
    assert!(recording("gz [furlong]", 1.0, Some(RateUnit::RadPerS)).is_ok());
}

#[test]
fn temperature_and_supply_come_along_in_si() {
    let files = Files::new();
    let body = |t: f64, v: f64| -> String {
        rates(N).iter().enumerate().map(|(i, x)| format!("{},{x},{t},{v}\n", digits(i as f64 * 0.01))).collect()
    };
    for (names, t, v, notes) in [
        ("temperature_c,supply_v", 25.0, 5.0, 1),
        ("temperature_k,supply_mv", 298.15, 5000.0, 1),
        ("temp_degF,vcc", 77.0, 5.0, 2),
        ("temp,voltage", 25.0, 5.0, 3),
        ("temp,voltage", 298.15, 5000.0, 3),
    ] {
        let path = files.put("x.csv", format!("t_s,gz_rad_s,{names}\n{}", body(t, v)));
        let r = read(&path).unwrap();
        assert!((r.log.get("temperature_c").unwrap()[3] - 25.0).abs() < 1e-9, "{names}");
        assert!((r.log.get("supply_v").unwrap()[3] - 5.0).abs() < 1e-9, "{names}");
        assert_eq!(r.notes.len(), notes, "{:?}", r.notes);
    }
    // raw counts of a converter are no temperature
    let r = read(&files.put("x.csv", format!("t_s,gz_rad_s,temp,vcc\n{}", body(-3412.0, 5.0)))).unwrap();
    assert!(r.log.get("temperature_c").is_none());
    assert!(r.notes.iter().any(|n| n.contains("\"temp\" is not used")), "{:?}", r.notes);
}

#[test]
fn any_axis_lands_in_the_same_channel() {
    let files = Files::new();
    let rows: String = rates(N)
        .iter()
        .enumerate()
        .map(|(i, x)| format!("{},{},{x},{}\n", digits(i as f64 * 0.01), -x, 2.0 * x))
        .collect();
    let path = files.put("x.csv", format!("t_s,gx_rad_s,gy_rad_s,gz_rad_s\n{rows}"));
    for (axis, factor) in
        [(gyroid::ingest::Axis::X, -1.0), (gyroid::ingest::Axis::Y, 1.0), (gyroid::ingest::Axis::Z, 2.0)]
    {
        let r = read_gyro(&path, &GyroQuery { axis, ..GyroQuery::default() }).unwrap();
        assert!((gyro(&r)[5] - factor * rates(N)[5]).abs() < 1e-15);
        assert_eq!(r.column, format!("g{axis}_rad_s"));
    }
}
