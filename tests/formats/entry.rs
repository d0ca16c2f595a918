//! Calls of a user's program on a file that somebody else made: shared by the tests and by the fuzz targets.
//!
//! Each entry takes the bytes of a file and checks what must hold of any: a result, or an error of one or two lines with the
//! file, the finding and a hint. A panic is left to the caller.

use gyroid::config::Config;
use gyroid::files::memory::Place;
use gyroid::ingest::{
    DriveQuery, GyroQuery, Inspection, Stamp, inspect_topic, read_drive, read_gyro, read_gyro_within,
};
use gyroid::units::{RateUnit, TimeUnit};
use std::ffi::OsString;
use std::io::Write;
use std::path::Path;
use tempfile::{NamedTempFile, TempDir};

/// Topics of a file that are read.
const MOST_TOPICS: usize = 3;
/// Bytes of samples beyond which a log is read in one pass.
const FEW_BYTES: usize = 1 << 12;

/// Letters of an error: each of its parts is shortened.
const MOST_LETTERS: usize = 5000;

/// An entry takes bytes as a file of its kind.
pub type Entry = fn(&[u8]);

/// Every entry by its name.
pub const ENTRIES: [(&str, Entry); 9] = [
    ("csv", log),
    ("parquet", log),
    ("bags", log),
    ("flight", log),
    ("arrays", log),
    ("config", config),
    ("robot", robot),
    ("expression", expression),
    ("answer", answer),
];

fn written(bytes: &[u8], ending: &str) -> NamedTempFile {
    let mut file = tempfile::Builder::new().prefix("input").suffix(ending).tempfile().expect("a temporary file");
    file.write_all(bytes).expect("room for a temporary file");
    file
}

/// Checks that an error in the file `name` names it, has a finding and a hint, and is short.
fn check(error: &gyroid::Error, name: &str) {
    let text = error.to_string();
    assert!(text.contains(name), "the file is not named: {text}");
    assert!(!error.found.is_empty() && error.hint.is_some(), "no hint: {text}");
    assert!(text.lines().count() <= 2, "more than two lines: {text}");
    assert!(text.chars().count() <= MOST_LETTERS, "{} letters: {text}", text.len());
}

fn checked<T>(result: gyroid::Result<T>, path: &Path) -> Option<T> {
    result.inspect_err(|error| check(error, &path.display().to_string())).ok()
}

/// A log of any format: looked at, read as one at rest, in one pass, and as a drive.
pub fn log(bytes: &[u8]) {
    let file = written(bytes, "");
    let path = file.path();
    let Some(whole) = checked(inspect_topic(path, None, Stamp::Header, false), path) else {
        // what cannot be looked at can be with its bad rows left out, or cannot be read at all
        checked(inspect_topic(path, None, Stamp::Receipt, true), path);
        checked(read_gyro(path, &GyroQuery::default()), path);
        return;
    };
    table(path, &whole, None);
    for topic in whole.topics.iter().filter(|t| Some(&t.name) != whole.topic.as_ref()).take(MOST_TOPICS) {
        if let Some(inspection) = checked(inspect_topic(path, Some(&topic.name), Stamp::Receipt, false), path) {
            table(path, &inspection, Some(topic.name.clone()));
        }
    }
    checked(read_drive(&[path], &DriveQuery::default()), path);
}

/// Reads a table, its columns and units named where the file leaves them open.
fn table(path: &Path, inspection: &Inspection, topic: Option<String>) {
    let open = inspection.gyro.iter().all(|axis| axis.column.is_none());
    let name = |at: Option<usize>| Some(inspection.columns.get(at?)?.name.clone());
    let query = GyroQuery {
        topic,
        column: name(open.then(|| inspection.columns.len().saturating_sub(1))),
        time: name((inspection.time.is_none()).then_some(0)),
        time_unit: inspection.time.is_none().then_some(TimeUnit::S),
        unit: open.then_some(RateUnit::RadPerS),
        sort_time: true,
        skip_bad_rows: true,
        ..GyroQuery::default()
    };
    checked(read_gyro(path, &query), path);
    let query = GyroQuery { sort_time: false, ..query };
    checked(read_gyro_within(path, &query, FEW_BYTES, &mut |_| ()), path);
}

/// A configuration: what is read and written back is the same when it is read again.
pub fn config(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        let file = written(bytes, ".toml");
        checked(Config::read(file.path()), file.path());
        return;
    };
    let mut config = match Config::parse(text, "input.toml") {
        Ok(config) => config,
        Err(error) => return check(&error, "input.toml"),
    };
    let once = config.to_toml().expect("what was read can be written");
    let again = Config::parse(&once, "once.toml").unwrap_or_else(|error| panic!("{error}\n{once}"));
    // the checksum alone is made anew
    config.provenance.clone_from(&again.provenance);
    assert_eq!(config, again, "{once}");
    assert_eq!(again.to_toml().expect("what was read can be written"), once);
}

/// The expression of an effect of a user's own, in its signals, `k` and, where it is in it, `shape`.
pub fn expression(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let shown = toml::Value::String(text.into());
    for acts_on in ["gyro_bias_rad_s", "force_n"] {
        let parameter = |name: &str, null: &str| {
            format!(
                "[[custom_effect.parameter]]\nname = \"{name}\"\nunit = \"1\"\nbounds = [-5.0, 5.0]\n{null}\
                 plausible = [0.5, 2.0]\nmeaning = \"m\"\n"
            )
        };
        let text = format!(
            "{DRIVING}\n[[custom_effect]]\nid = \"custom.own\"\ntitle = \"own\"\nacts_on = \"{acts_on}\"\n\
             expression = {shown}\n{}{}",
            parameter("k", "null = 0.0\n"),
            if text.contains("shape") { parameter("shape", "") } else { String::new() }
        );
        config(text.as_bytes());
    }
}

const DRIVING: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n[gyro]\nc1_rad_s = 1e-3\nc2_rad_s = 1e-3\n\
    time_constant_s = 100.0\nangle_random_walk_rad_sqrt_s = 1e-4\n[vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\n\
    half_track_m = 0.17\nwheel_radius_m = 0.05\nwheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\n\
    torque_noise_n_m_sqrt_s = 0.0004\n[encoder]\nspeed_noise_std_rad_s = 0.02\n";

fn command(words: &[&str], paths: &[&Path]) -> gyroid::Result<gyroid::cli::Answer> {
    let words = words.iter().map(OsString::from);
    gyroid::cli::answer(words.chain(paths.iter().map(|p| p.as_os_str().to_owned())), "gyroid")
}

/// A robot's description: a configuration from it, and that one read again.
pub fn robot(bytes: &[u8]) {
    let has = |tag: &[u8]| bytes.windows(tag.len()).any(|w| w == tag);
    let format = if has(b"<mujoco") {
        "--mjcf"
    } else if has(b"<sdf") {
        "--sdf"
    } else {
        "--urdf"
    };
    let file = written(bytes, ".xml");
    let out = Place::new("robot.toml");
    if checked(command(&["gyroid", "init", "-o"], &[out.path(), Path::new(format), file.path()]), file.path()).is_some()
    {
        let text = out.bytes().expect("the configuration was written");
        config(&text);
    }
}

/// The folder of a bench with one case, and its key.
fn bench() -> &'static TempDir {
    static BENCH: std::sync::OnceLock<TempDir> = std::sync::OnceLock::new();
    BENCH.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let made = command(
            &["gyroid", "gap", "bench", "make", "--cases", "1", "--none", "0", "--seed", "1", "--threads", "1"],
            &[&folder.path().join("bench")],
        );
        made.unwrap_or_else(|error| panic!("{error}"));
        folder
    })
}

/// An answer to a case, scored; the times of the answers; what a bench says of itself.
pub fn answer(bytes: &[u8]) {
    if let Ok(answer) = serde_json::from_slice::<gyroid::gap::Answer>(bytes) {
        let text = serde_json::to_string(&answer).expect("an answer is JSON");
        serde_json::from_str::<serde_json::Value>(&text).expect("what was written is JSON");
    }
    let folder = bench().path();
    let [made, key] = ["bench", "bench.key"].map(|name| folder.join(name));
    let here = tempfile::tempdir().expect("a temporary folder");
    let (cases, answers) = (here.path().join("cases"), here.path().join("answers"));
    for folder in [&cases, &answers] {
        std::fs::create_dir(folder).expect("room for a temporary folder");
    }
    for entry in std::fs::read_dir(made).expect("the bench").flatten() {
        let (path, name) = (entry.path(), entry.file_name());
        if path.is_dir() {
            let name = format!("{}.json", name.to_string_lossy());
            std::fs::write(answers.join(name), bytes).expect("room for a temporary file");
        } else {
            std::fs::copy(path, cases.join(name)).expect("room for a temporary file");
        }
    }
    for file in [cases.join("bench.json"), answers.join("timings.json")] {
        std::fs::write(file, bytes).expect("room for a temporary file");
    }
    let options = [cases.as_path(), Path::new("--answers"), &answers, Path::new("--key"), &key];
    checked(command(&["gyroid", "gap", "bench", "score"], &options), here.path());
    let out = Place::new("calibration.toml");
    let options = [&options[..], &[Path::new("-o"), out.path()]].concat();
    checked(command(&["gyroid", "gap", "bench", "calibrate"], &options), here.path());
}
