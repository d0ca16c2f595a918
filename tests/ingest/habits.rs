//! Files as people have them: clocks of all kinds, raw counts, noise of a serial line, JSON lines, two sensors of one drive.

use super::{Files, csv, digits, gyro, gzip, rates, read, refused};
use gyroid::ErrorKind as K;
use gyroid::ingest::{
    ChannelMap, DriveQuery, DriveRecording, GyroQuery, GyroRecording, Reading, Scale, Stamp, inspect, inspect_topic,
    read_drive, read_gyro, read_gyro_within,
};
use gyroid::signal::names;
use gyroid::units::{RAD_S_PER_DEG_S, TimeUnit};
use std::path::Path;

const ROWS: usize = 2000;

/// A log at rest whose time column is called `time` and written by `stamp` from seconds.
fn stamped(time: &str, stamp: impl Fn(usize) -> String) -> String {
    let rows = rates(ROWS).iter().enumerate().map(|(i, x)| format!("{},{x}\n", stamp(i))).collect::<String>();
    format!("{time},gz_rad_s\n{rows}")
}

/// The same log held, and read once.
fn both_ways(path: &Path, query: &GyroQuery) -> GyroRecording {
    let held = read_gyro(path, query).unwrap();
    let Reading::Streamed(once) = read_gyro_within(path, query, 0, &mut |_| ()).unwrap() else { unreachable!() };
    assert_eq!(once.audit.samples, held.audit.samples);
    assert!((once.log.moments.first_s + once.log.moments.span_s - held.log.time.at(held.log.len() - 1)).abs() < 1e-6);
    held
}

#[test]
fn clocks_of_all_kinds_tell_the_same_time() {
    let files = Files::new();
    let ms = |i: usize| 10 * i;
    let clock = |i: usize| {
        // over midnight after ten seconds
        let of_day = (86_390_000 + ms(i)) % 86_400_000;
        let (s, ms) = (of_day / 1000, of_day % 1000);
        format!("{:02}:{:02}:{:02}.{ms:03}", s / 3600, s / 60 % 60, s % 60)
    };
    let american = |i: usize| {
        let (s, ms) = (ms(i) / 1000, ms(i) % 1000);
        format!("11/23/2026 {}:{:02}:{:02}.{ms:03} PM", 10, 11 + s / 60, s % 60)
    };
    for (text, said) in [
        (stamped("time", |i| digits(0.01 * i as f64).to_string()), "guessed: s"),
        (stamped("Zeit [s]", |i| digits(0.01 * i as f64).to_string()), "starts at 0 s"),
        (stamped("ms", |i| ms(i).to_string()), "starts at 0 s"),
        (stamped("sec,nanosec", |i| format!("{},{}", ms(i) / 1000, ms(i) % 1000 * 1_000_000)), "starts at 0 s"),
        (stamped("nsecs,secs", |i| format!("{},{}", ms(i) % 1000 * 1_000_000, ms(i) / 1000)), "starts at 0 s"),
        (
            stamped("header.stamp.sec,header.stamp.nanosec", |i| {
                format!("{},{}", 1_700_000_000 + ms(i) / 1000, ms(i) % 1000 * 1_000_000)
            }),
            "counted from the first sample",
        ),
        (stamped("time", clock), "passes midnight: a day is added"),
        (stamped("time", american), "month first"),
    ] {
        let path = files.put("x.csv", &text);
        let recording = both_ways(&path, &GyroQuery::default());
        let name = text.lines().next().unwrap();
        assert_eq!(recording.audit.samples, ROWS, "{name}");
        for k in [0, 1, 999, 1000, 1001, ROWS - 1] {
            assert!((recording.log.time.at(k) - 0.01 * k as f64).abs() < 1e-6, "{name}: {}", recording.log.time.at(k));
        }
        assert!(recording.notes.iter().any(|n| n.contains(said)), "{name}: {:?}", recording.notes);
    }
}

#[test]
fn slow_rows_in_fractions_are_seconds_and_whole_ones_are_asked_about() {
    let files = Files::new();
    // 6.5 Hz, or 6500 Hz in ms
    let path = files.put("x.csv", stamped("time", |i| (i as f64 / 6.5).to_string()));
    let recording = read(&path).unwrap();
    assert!((recording.audit.sampling.rate_hz - 6.5).abs() < 1e-3);
    assert!(recording.notes.iter().any(|n| n.contains("guessed: s, because its values are fractions")));
    let path = files.put("x.csv", stamped("time", |i| i.to_string()));
    refused(read(&path), K::Unit, &["1000.0000 Hz in ms", "--time-unit"]);
}

#[test]
fn a_unit_of_time_that_contradicts_the_data_is_asked_about() {
    let files = Files::new();
    let query = |unit| GyroQuery { time_unit: Some(unit), ..GyroQuery::default() };
    let path = files.put("x.csv", stamped("time", |i| digits(0.01 * i as f64).to_string()));
    refused(read_gyro(&path, &query(TimeUnit::Ms)), K::Unit, &["read in ms", "1.000e5 Hz", "--time-unit"]);
    let path = files.put("x.csv", stamped("time", |i| format!("{:.2}", 1.7e9 + 3.0 * i as f64)));
    refused(read_gyro(&path, &query(TimeUnit::Us)), K::Unit, &["read in us"]);
    let path = files.put("x.csv", stamped("time", |i| digits(0.1 * i as f64).to_string()));
    refused(
        read_gyro(&path, &query(TimeUnit::Ms)),
        K::Unit,
        &["in s they make 10.0000 Hz", "leave out --time-unit ms"],
    );
    let path = files.put("x.csv", stamped("t_ms", |i| (100 * i).to_string()));
    refused(read_gyro(&path, &query(TimeUnit::S)), K::Unit, &["in ms they make 10.0000 Hz", "time_s"]);
    // both make a usual rate, and the name states one
    let path = files.put("x.csv", stamped("t_s", |i| digits(0.1 * i as f64).to_string()));
    let said = ["in s they make 10.0000 Hz", "leave out --time-unit ms", "time_ms"];
    refused(read_gyro(&path, &query(TimeUnit::Ms)), K::Unit, &said);
    let drive = DriveQuery { time_unit: Some(TimeUnit::Ms), ..DriveQuery::default() };
    refused(read_drive(&[&path], &drive).map(|d| d.notes), K::Unit, &said);
    // means over a minute of a thermal log are slow, as their user says
    let path = files.put("x.csv", stamped("time", |i| (60 * i).to_string()));
    assert!((read_gyro(&path, &query(TimeUnit::S)).unwrap().log.time.median_step_s() - 60.0).abs() < 1e-9);
    // who states a unit is not asked to state one
    let path = files.put("x.csv", stamped("time", |i| digits(0.01 * i as f64).to_string()));
    let error = read_gyro(&path, &query(TimeUnit::Ms)).unwrap_err();
    assert!(error.hint.unwrap().starts_with("leave out --time-unit ms"));
    // against the name, and right: told
    let path = files.put("x.csv", stamped("t_s", |i| (10 * i).to_string()));
    let recording = read_gyro(&path, &query(TimeUnit::Ms)).unwrap();
    assert!(recording.notes.iter().any(|n| n.contains("says s; it is read as ms")), "{:?}", recording.notes);
}

#[test]
fn parts_of_a_second_are_less_than_one() {
    let files = Files::new();
    let path = files.put("x.csv", stamped("sec,nanosec", |i| format!("{},{}", i / 100, 10_000_000_u64 * i as u64)));
    refused(read(&path), K::Time, &["row 101", "no part of a second", "--time"]);
}

#[test]
fn raw_counts_are_asked_for_and_scaled() {
    let files = Files::new();
    let counts = |rate: &f64| (rate / RAD_S_PER_DEG_S * 131.0).round();
    let text = csv("gz_raw", 1.0, 3);
    let rows: String =
        rates(ROWS).iter().enumerate().map(|(i, x)| format!("{},{}\n", digits(0.01 * i as f64), counts(x))).collect();
    let path = files.put("x.csv", format!("{}\n{rows}", text.lines().next().unwrap()));
    refused(read(&path), K::Unit, &["\"gz_raw\"", "own counts", "--scale gz_raw=1/131:deg/s"]);
    for scale in ["gz_raw=1/131:deg/s", "gyro_z_rad_s=1/131 deg/s"] {
        let query = GyroQuery { scales: vec![Scale::parse(scale).unwrap()], ..GyroQuery::default() };
        let recording = both_ways(&path, &query);
        let right = |(a, b): (&f64, f64)| (a - counts(&b) / 131.0 * RAD_S_PER_DEG_S).abs() < 1e-15;
        assert!(gyro(&recording).iter().zip(rates(ROWS)).all(right));
    }
    // scaled counts are counts no more, and have the unit that is stated
    let scales = vec![Scale::parse("gz_raw=1/131").unwrap()];
    let unit = Some(gyroid::units::RateUnit::DegPerS);
    let query = GyroQuery { scales: scales.clone(), unit, ..GyroQuery::default() };
    assert!(
        (gyro(&read_gyro(&path, &query).unwrap())[0] - counts(&rates(1)[0]) / 131.0 * RAD_S_PER_DEG_S).abs() < 1e-15
    );
    let drive = read_drive(&[&path], &DriveQuery { scales, ..DriveQuery::default() }).unwrap();
    assert!(drive.notes.iter().any(|n| n.contains("--map gyro_z_rad_s=gz_raw:deg/s")), "{:?}", drive.notes);
    let query = GyroQuery { scales: vec![Scale::parse("gz_rwa=2").unwrap()], ..GyroQuery::default() };
    refused(read_gyro(&path, &query), K::Column, &["\"gz_rwa\"", "did you mean \"gz_raw\"?"]);
    // counts beside numbers with a unit are left alone
    let beside = text.replace("gz_raw", "gz_raw,gz_rad_s").replace("0,", "0,7,").replace("0.01,", "0.01,8,");
    let path = files.put("y.csv", beside.replace("0.02,", "0.02,9,"));
    assert_eq!(read(&path).unwrap().column, "gz_rad_s");
}

#[test]
fn a_guessed_unit_of_time_is_told_of_every_log() {
    let files = Files::new();
    let path = files.put("x.csv", stamped("time", |i| digits(0.01 * i as f64).to_string()));
    let said = "time unit of \"time\" guessed: s";
    let told = |notes: &[String]| notes.iter().filter(|n| n.contains(said)).count();
    assert_eq!(told(&read(&path).unwrap().notes), 1);
    assert_eq!(told(&read_drive(&[&path], &DriveQuery::default()).unwrap().notes), 1);
    assert_eq!(told(&inspect(&path).unwrap().notes), 1);
    // a gyro that no fit can use: it drives
    let path = files.put("y.csv", read_as_drive(&std::fs::read_to_string(&path).unwrap()));
    assert_eq!(told(&inspect(&path).unwrap().notes), 1);
}

/// The same rates, 1 rad/s larger.
fn read_as_drive(text: &str) -> String {
    let larger = |line: &str| match line.split_once(',').map(|(t, x)| (t, x.parse::<f64>())) {
        Some((t, Ok(x))) => format!("{t},{}\n", x + 1.0),
        _ => format!("{line}\n"),
    };
    text.lines().map(larger).collect()
}

#[test]
fn times_that_a_spreadsheet_left_are_read_or_refused_by_name() {
    let files = Files::new();
    let stamp = |i: usize| format!("2026-11-23 10:{:02}:{:02}.{:02}", i / 6000, i / 100 % 60, i % 100);
    for name in ["Date", "Datum"] {
        let recording = read(&files.put("x.csv", stamped(name, stamp))).unwrap();
        assert!((recording.audit.sampling.rate_hz - 100.0).abs() < 1e-6, "{name}");
    }
    // whole seconds at 100 Hz
    let path = files.put("x.csv", stamped("timestamp", |i| stamp(i)[..19].to_string()));
    let drive = |path: &Path| read_drive(&[path], &DriveQuery::default()).map(|d| d.notes);
    refused(drive(&path), K::Time, &["stamps repeat: 2000 rows have 20", "fractions of a second", "--time"]);
    // minutes without hours
    let path = files.put("x.csv", stamped("time", |i| format!("{:02}:{:02}.{}", 59, i / 100 % 60, i / 10 % 10)));
    refused(drive(&path), K::Column, &["\"time\" holds text", "clock times with hours", "HH:MM:SS"]);
}

/// `text` with rows as a broken serial line leaves them.
fn broken(text: &str) -> String {
    let broken = |(i, line): (usize, &str)| match i {
        101 => "1.0,0.0\u{fffd}3x\n".to_string(),
        205 => format!("{line},7\n"),
        306 => "3.0\n".into(),
        _ => format!("{line}\n"),
    };
    text.lines().enumerate().map(broken).collect()
}

#[test]
fn bad_rows_are_left_out_when_that_is_asked_for_and_told() {
    let files = Files::new();
    let path = files.put("x.csv", broken(&csv("gz_rad_s", 1.0, ROWS)));
    refused(read(&path), K::Format, &["line 206", "3 fields", "--skip-bad-rows"]);
    refused(inspect(&path), K::Format, &["line 206", "--skip-bad-rows"]);
    assert!(inspect_topic(&path, None, Stamp::Header, true).unwrap().fits());
    let query = GyroQuery { skip_bad_rows: true, ..GyroQuery::default() };
    let recording = both_ways(&path, &query);
    assert_eq!(recording.audit.samples, ROWS - 3);
    let told = recording.notes.iter().find(|n| n.starts_with("3 rows that do not parse left out")).unwrap();
    for part in
        ["line 102 (\"0.0\u{fffd}3x\" in column \"gz_rad_s\")", "line 206 (the row has 3", "line 307 (the row has 1"]
    {
        assert!(told.contains(part), "{told}");
    }
    // a quotation mark in the noise is no field in quotation marks: the rows behind it are read
    let late: String = csv("gz_rad_s", 1.0, 40_000).lines().map(|l| format!("{l}\n")).collect();
    let quoted = late.replacen("\n300,", "\n300,\"", 1);
    let recording = read_gyro(files.put("q.csv", quoted), &query).unwrap();
    assert_eq!(recording.audit.samples, 39_999);
    // a serial line that drops out leaves zero bytes
    let zeros = csv("gz_rad_s", 1.0, ROWS).replacen("\n1,", "\n1,\0", 1);
    let path = files.put("0.csv", zeros);
    refused(read(&path), K::Value, &["gz_rad_s"]);
    assert_eq!(read_gyro(path, &query).unwrap().audit.samples, ROWS - 1);
    // a whole file is read as without the option
    let whole = files.put("w.csv", csv("gz_rad_s", 1.0, ROWS));
    assert_eq!(gyro(&read_gyro(&whole, &query).unwrap()), gyro(&read(&whole).unwrap()));
    // what is mostly no table is refused
    let noise = "t_s,gz_rad_s\n0,1\n1,2\n1,1,1\n1\n1,1,1,1\n1,1,1,1,1\n1,1,1,1,1,1\n";
    refused(read_gyro(files.put("n.csv", noise), &query), K::Format, &["5 rows do not parse, and 2 do", "line 4"]);
}

#[test]
fn what_a_device_says_before_its_table_is_left_out() {
    let files = Files::new();
    let table = csv("gz_rad_s", 1.0, ROWS);
    let bare: String = table.lines().skip(1).map(|l| format!("{l}\n")).collect();
    for (before, first) in [
        ("Booting...\n", "line 1 before the table, \"Booting...\""),
        (
            "ets Jul 29 2019 12:21:46\n\nrst:0x1 (POWERON_RESET),boot:0x13,mode\nready\n",
            "\"ets Jul 29 2019 12:21:46\" and 2 more",
        ),
    ] {
        let recording = read(&files.put("x.csv", format!("{before}{table}"))).unwrap();
        assert_eq!((recording.column.as_str(), recording.audit.samples), ("gz_rad_s", ROWS));
        assert!(recording.notes.iter().any(|n| n.contains(first)), "{:?}", recording.notes);
    }
    let query = GyroQuery {
        column: Some("column_2".into()),
        time: Some("column_1".into()),
        unit: Some(gyroid::units::RateUnit::RadPerS),
        ..GyroQuery::default()
    };
    let recording = read_gyro(files.put("x.csv", format!("Booting...\n{bare}")), &query).unwrap();
    assert_eq!(recording.audit.samples, ROWS);
    // a header that does not fit its rows is still one
    refused(read(&files.put("x.csv", format!("t_s,gz_rad_s,a\n{bare}"))), K::Format, &["3 names", "2 fields"]);
}

#[test]
fn json_lines_are_read_with_nested_keys() {
    let files = Files::new();
    let line = |(i, x): (usize, &f64)| {
        format!(
            "{{\"header\": {{\"stamp\": {{\"sec\": {}, \"nanosec\": {}}}}}, \"imu\": {{\"orientation\": [0, 0, 1], \"gyro_z_rad_s\": {x}}}, \
             \"note\": \"a\", \"temperature_c\": null}}\n",
            1_700_000_000 + i / 100,
            i % 100 * 10_000_000
        )
    };
    let text: String = rates(ROWS).iter().enumerate().map(line).collect();
    for path in [files.put("x.jsonl", &text), files.put("x.jsonl.gz", gzip(text.as_bytes()))] {
        let recording = both_ways(&path, &GyroQuery::default());
        assert_eq!((recording.column.as_str(), recording.audit.samples), ("imu.gyro_z_rad_s", ROWS));
        assert!((recording.log.time.at(ROWS - 1) - 0.01 * (ROWS - 1) as f64).abs() < 1e-6);
        assert_eq!(gyro(&recording), rates(ROWS));
    }
    // an axis by its place in a list
    let list = text
        .replace("orientation\": [0, 0, 1], \"gyro_z_rad_s\": ", "gyro_rad_s\": [0, 0, ")
        .replace("}, \"note\"", "]}, \"note\"");
    let recording = read(&files.put("l.jsonl", &list)).unwrap();
    assert_eq!((recording.column.as_str(), gyro(&recording)), ("imu.gyro_rad_s[2]", &rates(ROWS)[..]));
    let odd = text.replacen("{\"header\"", "noise {\"header\"", 3).replacen("noise ", "", 2);
    let path = files.put("x.jsonl", &odd);
    refused(read(&path), K::Format, &["line 3", "--skip-bad-rows"]);
    let query = GyroQuery { skip_bad_rows: true, ..GyroQuery::default() };
    assert_eq!(read_gyro(&path, &query).unwrap().audit.samples, ROWS - 1);
    // words where numbers belong, and a line that was cut off
    let words = text.replacen(&format!("\"gyro_z_rad_s\": {}", rates(3)[2]), "\"gyro_z_rad_s\": \"ERR\"", 1);
    refused(read(&files.put("x.jsonl", &words)), K::Value, &["row 3", "ERR"]);
    let cut = read(&files.put("x.jsonl", &text[..text.len() - 20])).unwrap();
    assert!(cut.audit.samples == ROWS - 1 && cut.notes.iter().any(|n| n.contains("cut off")), "{:?}", cut.notes);
    refused(read(&files.put("x.json", "[\n{\"a\": 1},\n{\"a\": 2}\n]\n")), K::Format, &["line 1", "jq -c '.[]'"]);
}

#[test]
fn decimals_that_change_are_told() {
    let files = Files::new();
    let line = |(i, l): (usize, &str)| match l.split_once(',').filter(|_| i > ROWS / 2) {
        Some((t, x)) => format!("{t},{:.4}\n", x.parse::<f64>().unwrap()),
        None => format!("{l}\n"),
    };
    let text: String = csv("gz_deg_s", 1.0 / RAD_S_PER_DEG_S, ROWS)
        .lines()
        .enumerate()
        .map(|(i, l)| if i == 0 { format!("{l}\n") } else { line((i, l)) })
        .collect();
    let told = read(&files.put("x.csv", text)).unwrap().notes;
    assert!(told.iter().any(|n| n.contains("with 4 after it: two recorders")), "{told:?}");
    let told = read(&files.put("x.csv", csv("gz_rad_s", 1.0, ROWS))).unwrap().notes;
    assert!(!told.iter().any(|n| n.contains("decimals")), "{told:?}");
}

#[test]
fn a_name_that_is_nearly_right_is_asked_about() {
    let files = Files::new();
    let path = files.put("x.csv", csv("gz_rad_s", 1.0, 100));
    let query = |column: Option<&str>, time: Option<&str>| GyroQuery {
        column: column.map(str::to_string),
        time: time.map(str::to_string),
        ..GyroQuery::default()
    };
    refused(read_gyro(&path, &query(Some("gz_rads"), None)), K::Column, &["did you mean \"gz_rad_s\"?"]);
    refused(read_gyro(&path, &query(None, Some("ts"))), K::Column, &["did you mean \"t_s\"?"]);
    let map = |text: &str| DriveQuery { maps: vec![ChannelMap::parse(text).unwrap()], ..DriveQuery::default() };
    let error = read_drive(&[&path], &map("gyro_z_rad_s=-gz_rds:deg/s")).unwrap_err();
    assert!(error.to_string().contains("did you mean \"gz_rad_s\"?"), "{error}");
    let error = ChannelMap::parse("gyro_z_rads=gz").unwrap_err();
    assert!(error.to_string().contains("did you mean \"gyro_z_rad_s\"?"), "{error}");
}

/// IMU at 100 Hz and wheels at 6.5 Hz, as a robot's two loggers write them; the accelerometer in units of `gravity`.
fn two_files(files: &Files, gravity: f64, wheels_until_s: f64) -> gyroid::Result<DriveRecording> {
    let imu: String = (0..6000)
        .map(|k| 0.01 * f64::from(k))
        .map(|t| format!("{t:.2},0.01,0.02,{},0.3,{},{gravity}\n", 0.3 * (0.5 * t).sin(), 0.1 * t.cos()))
        .collect();
    let wheels: String = (0..390)
        .map(|k| f64::from(k) / 6.5)
        .filter(|t| *t < wheels_until_s)
        .map(|t| {
            format!(
                "{t},{},{},{},{}\n",
                3.0 + t.sin(),
                2.0 + t.cos(),
                0.4 - 0.1 * (0.5 * t).sin(),
                0.4 + 0.1 * (0.5 * t).sin()
            )
        })
        .collect();
    let imu = files.put("imu.csv.gz", gzip(format!("time,wx,wy,wz,ax,ay,az\n{imu}").as_bytes()));
    let wheels = files.put("wheels.csv.gz", gzip(format!("time,curL,curR,velL,velR\n{wheels}").as_bytes()));
    read_drive(&[imu, wheels], &DriveQuery::default())
}

#[test]
fn an_imu_and_wheels_in_two_files_are_one_drive_and_no_sample_is_invented() {
    let files = Files::new();
    let drive = two_files(&files, 9.81, 60.0).unwrap();
    let count = |name: &str| drive.log.get(name).unwrap().iter().filter(|v| v.is_finite()).count();
    assert_eq!(
        (count(names::GYRO_Z), count(names::WHEEL_LEFT_SPEED), count(names::WHEEL_RIGHT_SPEED)),
        (6000, 390, 390)
    );
    // every thirteenth row of the wheels is at a time of the IMU too
    assert!(drive.log.len() > 6000 && drive.log.len() <= 6390);
    for said in ["\"wz\" states no unit: taken as rad/s", "its mean is 9.81", "\"velL\" states no unit: taken as m/s"] {
        assert!(drive.notes.iter().any(|n| n.contains(said)), "{said}: {:?}", drive.notes);
    }
    // what a current stands for holds until the next one
    assert!(count(names::CURRENT_LEFT) >= drive.log.len() - 1);
    // nothing says the unit: asked for, and not used
    let drive = two_files(&files, 1.0, 60.0).unwrap();
    assert!(drive.log.get(names::GYRO_Z).is_none());
    assert!(drive.notes.iter().any(|n| n.contains("--map gyro_z_rad_s=wz:rad/s")), "{:?}", drive.notes);
}

#[test]
fn a_stream_that_stops_half_way_is_told() {
    let files = Files::new();
    let drive = two_files(&files, 9.81, 30.0).unwrap();
    let told = drive.notes.iter().find(|n| n.contains("ends at")).unwrap();
    assert!(
        told.contains("wheel_left_m_s, wheel_right_m_s of") && told.contains("wheels.csv.gz ends at 29.8 s"),
        "{told}"
    );
    let whole = two_files(&files, 9.81, 60.0).unwrap();
    assert!(!whole.notes.iter().any(|n| n.contains("ends at")), "{:?}", whole.notes);
}

#[test]
fn a_gyro_that_froze_is_told_and_the_part_before_does_not_move() {
    let files = Files::new();
    let rates = rates(2 * ROWS);
    let rows: String = (0..2 * ROWS).map(|i| format!("{},{}\n", digits(0.01 * i as f64), rates[i.min(ROWS)])).collect();
    let path = files.put("x.csv", format!("t_s,gz_rad_s\n{rows}"));
    let held = read(&path).unwrap().audit;
    let Reading::Streamed(once) = read_gyro_within(&path, &GyroQuery::default(), 0, &mut |_| ()).unwrap() else {
        unreachable!()
    };
    for audit in [held, once.audit] {
        assert!(audit.motion.assessed && audit.motion.intervals.is_empty(), "{:?}", audit.motion);
        let told = audit.findings().join("\n");
        assert!(told.contains("the sensor froze from 20.0 to 40.0 s: cut the log there"), "{told}");
    }
}
