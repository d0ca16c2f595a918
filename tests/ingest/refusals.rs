//! Every bad input, with its message.

use super::*;
use gyroid::ErrorKind as K;
use gyroid::ingest::inspect;
use gyroid::ingest::read_log;

fn one(content: impl AsRef<[u8]>) -> gyroid::Result<GyroRecording> {
    read(&Files::new().put("log.csv", content))
}

#[test]
fn files_that_are_none() {
    let files = Files::new();
    refused(read(&files.path("absent.csv")), K::Io, &["absent.csv", "check the path"]);
    refused(read(files.0.path()), K::Io, &["directory"]);
    refused(one(""), K::TooShort, &["is empty"]);
    refused(one(gzip(b"")), K::TooShort, &["is empty"]);
    refused(one("t_s,gz_rad_s\n"), K::TooShort, &["header and no rows"]);
    refused(one("# only a comment\n"), K::TooShort, &["no table"]);
    refused(one(b"\x00\x01\x02binary"), K::Format, &["unknown format", "Parquet"]);
    refused(one(b"#ROSBAG V1.2\n..."), K::Format, &["byte 0", "V1.2", "rosbag fix"]);
    refused(one(b"#ROSBAG V2.0\n..."), K::Column, &["no topic holds a gyro", "cut off", "byte 13"]);
    refused(one(b"PK\x03\x04\0\0\0"), K::Format, &["zip archive", "spreadsheet"]);
    refused(one(b"MATLAB 5.0 MAT-file"), K::Format, &["byte 124"]);
    refused(one(b"\xff\xfet\x00"), K::Format, &["UTF-16"]);
}

#[test]
fn truncated_files() {
    let files = Files::new();
    let text = csv("gz_rad_s", 1.0, 5000);
    let packed = gzip(text.as_bytes());
    refused(one(&packed[..packed.len() / 2]), K::Format, &["gzip", "truncated"]);
    refused(one(&packed[..6]), K::Format, &["gzip"]);
    let mut damaged = packed.clone();
    damaged[packed.len() / 2..packed.len() / 2 + 50].fill(0x55);
    // garbage comes out before its checksum fails: whichever is met first is told
    assert!(matches!(one(&damaged).unwrap_err().kind, K::Format | K::Value));
    let whole = files.path("a.parquet");
    gyroid::ingest::write_log(&whole, &gyroid::ingest::read_log(files.put("a.csv", &text)).unwrap()).unwrap();
    let bytes = std::fs::read(&whole).unwrap();
    for length in [4, 100, bytes.len() / 2, bytes.len() - 5] {
        refused(one(&bytes[..length]), K::Format, &["Parquet", "truncated"]);
    }
    // the recorder was cut off in its last row: nothing else is lost, and it is said
    let cut = &text[..text.trim_end().rfind(',').unwrap()];
    let recording = one(cut).unwrap();
    assert_eq!(recording.audit.samples, 4999);
    assert!(recording.notes.iter().any(|n| n.contains("line 5001") && n.contains("cut off")), "{:?}", recording.notes);
}

#[test]
fn rows_of_other_lengths() {
    let text = csv("gz_rad_s", 1.0, 100);
    refused(one(text.replacen("\n0.5,", "\n0.495\n0.5,", 1)), K::Format, &["line 52", "1 fields", "2"]);
    refused(one(text.replacen("\n0.5,", "\n0.5,7,", 1)), K::Format, &["line 52", "3 fields", "2"]);
    refused(one(format!("{text}1.0\n")), K::Format, &["line 102"]);
    refused(one(text.replacen("t_s", "a,b,t_s", 1)), K::Format, &["the header has 4 names", "2 fields"]);
}

#[test]
fn columns_that_are_missing_or_many() {
    refused(one("gz_rad_s\n1\n2\n3\n"), K::Column, &["no time column", "gz_rad_s", "--time"]);
    refused(one("t_s\n1\n2\n3\n"), K::Column, &["no column of the gyro's z axis", "t_s", "--column"]);
    refused(one("t_s,gx,gy,az\n1,2,3,4\n2,3,4,5\n"), K::Column, &["z axis", "t_s, gx, gy, az", "--axis"]);
    refused(
        one("t_s,imu0_gyro_z,imu1_gyro_z\n1,2,3\n2,3,4\n"),
        K::Column,
        &["several", "imu0_gyro_z, imu1_gyro_z", "--column"],
    );
    refused(one("t,time,gz\n1,2,3\n2,3,4\n"), K::Column, &["several", "t, time", "--time"]);
}

#[test]
fn named_columns_that_are_not_there() {
    let files = Files::new();
    let path = files.put("x.csv", "t_s,gz_rad_s,mode\n0,1,a\n1,2,b\n");
    let query = |column: Option<&str>, time: Option<&str>| GyroQuery {
        column: column.map(str::to_string),
        time: time.map(str::to_string),
        ..GyroQuery::default()
    };
    refused(read_gyro(&path, &query(Some("nope"), None)), K::Column, &["\"nope\"", "t_s, gz_rad_s, mode", "--column"]);
    refused(read_gyro(&path, &query(None, Some("nope"))), K::Column, &["\"nope\"", "--time"]);
    refused(read_gyro(&path, &query(Some("mode"), None)), K::Column, &["text"]);
    refused(read_gyro(&path, &query(Some("t_s"), None)), K::Column, &["both the time and the rate"]);
}

#[test]
fn values_that_are_no_rates() {
    let text = csv("gz_rad_s", 1.0, 1000);
    let with = |value: &str| {
        text.lines()
            .map(|l| if l.starts_with("5,") { format!("5,{value}\n") } else { format!("{l}\n") })
            .collect::<String>()
    };
    let place = ["row 501", "line 502", "\"gz_rad_s\""];
    let at = |what: &'static str| [&place[..], &[what]].concat();
    refused(one(with("ERR")), K::Value, &at("\"ERR\" is not a number"));
    refused(one(with("1.2.3")), K::Value, &at("\"1.2.3\" is not a number"));
    refused(one(with("1e300")), K::Value, &at("1e300 rad/s"));
    refused(one(with("-1e300")), K::Value, &at("-1e300 rad/s"));
    refused(one(with("inf")), K::Value, &at("infinite"));
    refused(one(with("150")), K::Value, &at("beyond any gyro"));
    for missing in ["", "nan", "NaN", "null", "NA"] {
        let recording = one(with(missing)).unwrap();
        assert_eq!((recording.audit.missing.count, recording.audit.missing.first_row), (1, Some(501)), "{missing:?}");
        assert_eq!(recording.audit.samples, 999);
    }
    refused(one("t_s,gz_rad_s\n0,nan\n1,nan\n2,\n3,nan\n"), K::Value, &["all 4 values are missing"]);
    refused(one("t_s,gz_rad_s\n0,0.1\n1,0.1\n2,0.1\n3,0.1\n"), K::Value, &["0.1 in all 4 samples"]);
    refused(one("t_s,gz_rad_s\n0,0.1\n1,0.2\n"), K::TooShort, &["2 usable samples"]);
    refused(one("t_s,gz_rad_s\n0,0.1\n"), K::TooShort, &["1 usable"]);
}

#[test]
fn times_that_are_none() {
    let swapped = "t_s,gz_rad_s\n0,0.1\n2,0.2\n1,0.15\n3,0.1\n";
    refused(one(swapped), K::Time, &["row 3 (line 4)", "\"t_s\"", "back by 1", "--sort-time"]);
    let files = Files::new();
    let sorted =
        read_gyro(files.put("x.csv", swapped), &GyroQuery { sort_time: true, ..GyroQuery::default() }).unwrap();
    assert_eq!(gyro(&sorted), [0.1, 0.15, 0.2, 0.1]);
    assert_eq!(sorted.audit.out_of_order.count, 1);
    let unix = "time,gz_rad_s\n1700000002,0.1\n1700000000,0.2\n1700000001,0.15\n1700000003,0.1\n";
    let sorted = read_gyro(files.put("u.csv", unix), &GyroQuery { sort_time: true, ..GyroQuery::default() }).unwrap();
    assert_eq!((sorted.log.time.at(0), gyro(&sorted)[0]), (0.0, 0.2));
    assert_eq!(sorted.clock, gyroid::ingest::Clock::FirstSample { file_s: 1.7e9 });
    refused(one("t_s,gz_rad_s\n5,0.1\n5,0.2\n5,0.15\n"), K::Time, &["stands still at 5"]);
    refused(one("t_s,gz_rad_s\nx,0.1\n1,0.2\n2,0.15\n"), K::Value, &["\"x\" is not a number", "row 1"]);
    refused(one("t_s,gz_rad_s\n,0.1\n,0.2\n,0.15\n"), K::Time, &["missing"]);
    refused(one("t_s,gz_rad_s\n0,0.1\ninf,0.2\n2,0.15\n"), K::Time, &["infinite", "row 2"]);
    refused(
        one(table("t", 1.0, "gz_rad_s", 1.0, 100)),
        K::Unit,
        &["1.0000 Hz in s or 1000.0000 Hz in ms", "--time-unit"],
    );
    refused(one(table("t_ns", 1.0, "gz_rad_s", 1.0, 100)), K::Unit, &["1.000e9 Hz"]);
}

#[test]
fn drives_need_rising_times() {
    let files = Files::new();
    let drive = |text: &str| read_log(files.put("d.csv", text));
    refused(drive("t_s,x_m\n0,1\n1,2\n1,3\n"), K::Time, &["row 3", "1 s after 1 s"]);
    refused(drive("t_s,x_m\n0,1\n,2\n1,3\n"), K::Time, &["row 2", "no time"]);
    refused(drive("t_s,x_m\n0,1\n1,2\n2,no\n3,4\n"), K::Value, &["row 3", "\"no\""]);
    refused(drive("x_m,y_m\n0,1\n1,2\n"), K::Column, &["no time column"]);
}

#[test]
fn inspection_says_what_is_missing_instead_of_failing() {
    let files = Files::new();
    for (content, problem) in [
        ("x_m,y_m\n0,1\n1,2\n", "no time column"),
        ("t_s,y_m\n0,1\n1,2\n", "no column of the gyro's z axis"),
        ("t_s,gz_rad_s\n0,1\n1,2\n", "2 usable samples"),
        ("t_s,gz_rad_s\n0,1\n1,2\n0.5,2\n", "time goes back"),
        ("t_s,gz_rad_s\n0,1\n1,2\n2,oops\n3,1\n", "\"oops\" is not a number"),
        ("t_s,a_gyro_z,b_gyro_z\n0,1,1\n1,2,3\n", "several columns"),
    ] {
        let report = inspect(files.put("x.csv", content)).unwrap();
        let axes = report.gyro.iter().filter_map(|g| g.problem.clone());
        let all: Vec<String> = report.problems.iter().cloned().chain(axes).collect();
        assert!(all.iter().any(|p| p.contains(problem)), "{problem}: {all:?}");
        assert!(!report.fits());
    }
    refused(inspect(files.put("e.csv", "")), K::TooShort, &["empty"]);
}
