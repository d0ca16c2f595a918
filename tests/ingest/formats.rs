//! Every way to write a log gives the same numbers.

use super::*;
use gyroid::ingest::{Clock, Scale, write_log};
use gyroid::signal::{Log, TimeAxis};
use polars_arrow::array::{Array, PrimitiveArray, Utf8ViewArray};
use polars_arrow::datatypes::{ArrowDataType, ArrowSchema, Field, TimeUnit};
use polars_arrow::record_batch::RecordBatch;
use polars_parquet::write::{
    CompressionOptions, FileWriter, RowGroupIterator, StatisticsOptions, Version, WriteOptions, get_dtype_encoding,
};
use std::sync::Arc;

const N: usize = 500;

fn same(path: &Path) {
    let recording = read(path).unwrap_or_else(|e| panic!("{e}"));
    let expected = rates(N);
    assert_eq!(gyro(&recording).len(), N, "{}", path.display());
    for (a, b) in gyro(&recording).iter().zip(&expected) {
        assert!((a - b).abs() <= 1e-15, "{}: {a} {b}", path.display());
    }
    let time = &recording.log.time;
    assert!(matches!(time, TimeAxis::Uniform { .. }), "{}: {time:?}", path.display());
    for i in [0, 1, N - 1] {
        assert!((time.at(i) - time.at(0) - i as f64 * 0.01).abs() < 1e-8, "{}: {}", path.display(), time.at(i));
    }
    assert_eq!(recording.sha256.len(), 64);
}

#[test]
fn text_in_all_dialects() {
    let files = Files::new();
    let plain = csv("gyro_z_rad_s", 1.0, N);
    let rows = |line: &dyn Fn(&str, &str) -> String| -> String {
        plain.lines().skip(1).map(|l| l.split_once(',').unwrap()).map(|(t, z)| line(t, z)).collect()
    };
    for (name, content) in [
        ("comma.csv", plain.clone()),
        ("no_newline_at_end.csv", plain.trim_end().to_string()),
        ("windows.csv", plain.replace('\n', "\r\n")),
        ("bom.csv", format!("\u{feff}{plain}")),
        ("tab.tsv", plain.replace(',', "\t")),
        ("semicolon.csv", plain.replace(',', ";")),
        ("decimal_comma.csv", plain.replace(',', ";").replace('.', ",")),
        ("blanks.txt", format!("t_s gz_rad_s\n{}", rows(&|t, z| format!("  {t}    {z} \n")))),
        ("spaced.csv", plain.replace(',', ", ")),
        ("quoted.csv", format!("\"t_s\",\"gyro_z_rad_s\"\n{}", rows(&|t, z| format!("\"{t}\",\"{z}\"\n")))),
        ("comments.csv", format!("# recorder 3\n#\n\n{}", plain.replacen("0.5,", "# a mark\n0.5,", 1))),
        ("commented_header.csv", format!("#t [s],w_RS_S_z [rad s^-1]\n{}", rows(&|t, z| format!("{t},{z}\n")))),
        ("units_row.csv", format!("t,gyroZ,state\ns,rad/s,-\n{}", rows(&|t, z| format!("{t},{z},ok\n")))),
        ("trailing.csv", format!("t_s,gz_rad_s\n{}", rows(&|t, z| format!("{t},{z},\n")))),
        ("more_columns.csv", format!("name,t_s,ax,gz_rad_s,gx_rad_s\n{}", rows(&|t, z| format!("a b,{t},1,{z},x\n")))),
    ] {
        same(&files.put(name, &content));
        same(&files.put(&format!("{name}.gz"), gzip(content.as_bytes())));
    }
    // the content decides, whatever the name says
    same(&files.put("a.parquet", &plain));
    same(&files.put("no_extension", gzip(plain.as_bytes())));
}

#[test]
fn time_in_all_units() {
    let files = Files::new();
    for (column, offset, per_second) in [
        ("t_s", 0i64, 1.0),
        ("time_ms", 37_200, 1e3),
        ("timestamp_us", 37_200_000, 1e6),
        ("#timestamp [ns]", 1_700_000_000_123_456_789, 1e9),
        ("field.header.stamp", 1_700_000_000_123_456_789, 1e9),
        ("timestamp", 1_700_000_000_123_456, 1e6),
        ("stamp", 1_700_000_000, 1.0),
    ] {
        let step = per_second / 100.0;
        let time = |i: usize| match per_second {
            1.0 => format!("{offset}.{:02}", i % 100).replacen(
                &offset.to_string(),
                &(offset + i as i64 / 100).to_string(),
                1,
            ),
            _ => (offset + (i as f64 * step) as i64).to_string(),
        };
        let rows: String = rates(N).iter().enumerate().map(|(i, z)| format!("{},{z}\n", time(i))).collect();
        same(&files.put("x.csv", format!("{column},gz_rad_s\n{rows}")));
        let clock = read(&files.path("x.csv")).unwrap().clock;
        match clock {
            Clock::PowerOn { first_s, stated } => {
                assert!(offset < 1_000_000_000 && !stated);
                assert!((first_s - offset as f64 / per_second).abs() < 1e-9);
            }
            Clock::FirstSample { file_s } => assert!((file_s - 1.7e9).abs() < 1.0, "{column}: {file_s}"),
        }
    }
}

#[test]
fn dates_and_stamps_in_two_columns() {
    let files = Files::new();
    let rows = |time: &dyn Fn(usize) -> String| -> String {
        rates(N).iter().enumerate().map(|(i, z)| format!("{},{z}\n", time(i))).collect()
    };
    let iso = |i: usize| format!("2024-05-01T12:00:{:02}.{:02}0Z", i / 100, i % 100);
    same(&files.put("iso.csv", format!("time,gz_rad_s\n{}", rows(&iso))));
    let plain = |i: usize| iso(i).replace('T', " ").replace('Z', "");
    same(&files.put("local.csv", format!("datetime,gz_rad_s\n{}", rows(&plain))));
    let parts = |i: usize| format!("{},{}", 1_700_000_000 + i / 100, (i % 100) * 10_000_000);
    same(&files.put(
        "ros2.csv",
        format!("header.stamp.sec,header.stamp.nanosec,angular_velocity.z [rad/s]\n{}", rows(&parts)),
    ));
}

fn parquet(path: &Path, columns: Vec<(&str, Box<dyn Array>)>) {
    let field = |(name, cells): &(&str, Box<dyn Array>)| Field::new((*name).into(), cells.dtype().clone(), true);
    let schema: ArrowSchema = columns.iter().map(|column| (column.0.into(), field(column))).collect();
    let encodings = schema.iter_values().map(|field| get_dtype_encoding(&field.dtype)).collect();
    let options = WriteOptions {
        statistics: StatisticsOptions::default(),
        version: Version::V1,
        compression: CompressionOptions::Snappy,
        data_page_size: None,
    };
    let rows = RecordBatch::new(N, Arc::new(schema.clone()), columns.into_iter().map(|column| column.1).collect());
    let groups = RowGroupIterator::try_new(std::iter::once(Ok(rows)), &schema, options, encodings).unwrap();
    let mut writer = FileWriter::try_new(std::fs::File::create(path).unwrap(), schema, options).unwrap();
    groups.for_each(|group| writer.write(N as u64, group.unwrap()).unwrap());
    writer.end(None).unwrap();
}

#[test]
fn parquet_with_floats_integers_and_dates() {
    let files = Files::new();
    let rate = || ("gyro_z_rad_s", PrimitiveArray::from_vec(rates(N)).boxed());
    let seconds: Vec<f64> = (0..N).map(|i| i as f64 * 0.01).collect();
    let nanoseconds: Vec<i64> = (0..N).map(|i| 1_700_000_000_123_456_789 + i as i64 * 10_000_000).collect();
    let single: Vec<f32> = seconds.iter().map(|&t| t as f32).collect();
    parquet(&files.path("s.parquet"), vec![("t_s", PrimitiveArray::from_vec(seconds).boxed()), rate()]);
    same(&files.path("s.parquet"));
    parquet(&files.path("f32.parquet"), vec![("t_s", PrimitiveArray::from_vec(single).boxed()), rate()]);
    let recording = read(&files.path("f32.parquet")).unwrap();
    assert!(matches!(recording.log.time, TimeAxis::Uniform { .. }));
    let state = ("state", Utf8ViewArray::from_slice_values(vec!["idle"; N]).boxed());
    let time = ("timestamp_ns", PrimitiveArray::from_slice(&nanoseconds).boxed());
    parquet(&files.path("ns.parquet"), vec![time, state, rate()]);
    same(&files.path("ns.parquet"));
    let unsigned: Vec<u64> = nanoseconds.iter().map(|t| t.unsigned_abs()).collect();
    parquet(&files.path("u64.parquet"), vec![("timestamp_ns", PrimitiveArray::from_vec(unsigned).boxed()), rate()]);
    same(&files.path("u64.parquet"));
    for (unit, per) in [(TimeUnit::Nanosecond, 1), (TimeUnit::Microsecond, 1000), (TimeUnit::Millisecond, 1_000_000)] {
        let whole: Vec<i64> = nanoseconds.iter().map(|t| t / per).collect();
        let date = PrimitiveArray::from_vec(whole).to(ArrowDataType::Timestamp(unit, None)).boxed();
        parquet(&files.path("date.parquet"), vec![("time", date), rate()]);
        same(&files.path("date.parquet"));
    }
}

/// Counts of an inertial unit in the narrowest type that holds them, some missing.
#[test]
fn parquet_with_narrow_integers_and_gaps() {
    fn counts<T: polars_arrow::types::NativeType + TryFrom<i64>>() -> Box<dyn Array> {
        let cell = |i: usize| (i % 100 != 7).then(|| T::try_from(100 + (i * 7 % 11) as i64).ok().unwrap());
        PrimitiveArray::from_iter((0..N).map(cell)).boxed()
    }
    let files = Files::new();
    let path = files.path("counts.parquet");
    let query = GyroQuery { scales: vec![Scale::parse("gz_raw=1/131:deg/s").unwrap()], ..GyroQuery::default() };
    for cells in [
        counts::<i8>(),
        counts::<u8>(),
        counts::<i16>(),
        counts::<u16>(),
        counts::<i32>(),
        counts::<u32>(),
        counts::<i64>(),
    ] {
        let seconds: Vec<f64> = (0..N).map(|i| i as f64 * 0.01).collect();
        parquet(&path, vec![("t_s", PrimitiveArray::from_vec(seconds).boxed()), ("gz_raw", cells)]);
        let recording = read_gyro(&path, &query).unwrap();
        let rates = gyro(&recording);
        assert_eq!(rates.len(), N - 5);
        // the row after the first missing one
        assert!((rates[7] - (100.0 + 56.0 % 11.0) / 131.0 * RAD_S_PER_DEG_S).abs() < 1e-15, "{}", rates[7]);
    }
}

#[test]
fn a_file_without_header_is_read_by_column_numbers() {
    let files = Files::new();
    let plain = csv("x", 1.0, N);
    let path = files.put("bare.csv", plain.split_once('\n').unwrap().1);
    let query = GyroQuery {
        column: Some("column_2".into()),
        time: Some("column_1".into()),
        unit: Some(gyroid::units::RateUnit::RadPerS),
        ..GyroQuery::default()
    };
    let recording = read_gyro(&path, &query).unwrap();
    assert_eq!(gyro(&recording), rates(N));
    assert!(recording.notes.iter().any(|n| n.contains("no header")));
}

#[test]
fn a_file_without_times_is_read_at_a_stated_rate() {
    let files = Files::new();
    let rows: String = rates(N).iter().map(|z| format!("{z}\n")).collect();
    let path = files.put("rows.csv", format!("gz_rad_s\n{rows}"));
    refused(read(&path), gyroid::ErrorKind::Column, &["no time column", "gz_rad_s", "--rate"]);
    let recording = read_gyro(&path, &GyroQuery { rate_hz: Some(100.0), ..GyroQuery::default() }).unwrap();
    assert!((recording.log.time.span_s() - 0.01 * (N - 1) as f64).abs() < 1e-9);
    let bad = GyroQuery { rate_hz: Some(0.0), ..GyroQuery::default() };
    refused(read_gyro(&path, &bad), gyroid::ErrorKind::Usage, &["0 Hz"]);
}

#[test]
fn what_is_written_is_read_by_every_format() {
    let files = Files::new();
    let mut log = Log::new("test", TimeAxis::Uniform { start_s: 0.0, step_s: 0.01, len: N });
    log.push("gyro_z_rad_s", rates(N)).unwrap();
    for name in ["a.csv", "a.csv.gz", "a.parquet"] {
        write_log(files.path(name), &log).unwrap();
        same(&files.path(name));
    }
}
