//! Fit, Allan deviation, autocorrelation and reading beside the libraries of Python, on the same data in one run: seconds,
//! ratios, peak memory.
//!
//! `SAMPLES=10000000 PYTHON=.venv/bin/python cargo bench --bench beside`; a library that the Python lacks is left out. Each task has
//! a process of its own, whose peak memory is the task's; a time is the median of three runs, or of `RUNS`.

use gyroid::identify::{FitOptions, fit};
use gyroid::ingest::{GyroQuery, read_gyro, read_log, write_log};
use gyroid::math::random::Stream;
use gyroid::math::spectra::autocorrelation;
use gyroid::noise::{Deviation, allan};
use gyroid::signal::{Log, TimeAxis, names};
use serde_json::{Value, json};
use std::hint::black_box;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

type Failure = Box<dyn std::error::Error>;

const STEP_S: f64 = 0.01;
/// Runs of each task.
fn runs() -> usize {
    std::env::var("RUNS").ok().and_then(|n| n.parse().ok()).unwrap_or(3).max(1)
}

/// A task: its name, the file that it reads, who else does it.
const TASKS: [(&str, &str, &[&str]); 5] = [
    ("fit", "raw.bin", &["scipy", "lmfit"]),
    ("allan", "raw.bin", &["allantools"]),
    ("autocorrelation", "raw.bin", &["statsmodels"]),
    ("csv", "log.csv", &["pandas", "polars"]),
    // they read the column, gyroid also fits it
    ("parquet", "log.parquet", &["pyarrow"]),
];

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().collect();
    if let [_, flag, task, path] = &arguments[..]
        && flag == "--task"
    {
        println!("{}", measured(task, Path::new(path))?);
        return Ok(());
    }
    let samples = std::env::var("SAMPLES").ok().map_or(Ok(1_000_000), |n| n.parse())?;
    let folder = tempfile::tempdir()?;
    write_data(folder.path(), samples)?;
    println!("{samples} samples: median of {} runs, peak memory of the process", runs());
    for (task, file, others) in TASKS {
        let path = folder.path().join(file);
        let own = answer(Command::new(std::env::current_exe()?).arg("--task").arg(task).arg(&path), "")?;
        let seconds = print(task, "gyroid", &own, None);
        for library in others {
            let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
            let script = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("benches/beside.py");
            let mut command = Command::new(python);
            command.arg(script).args([library, task]).arg(&path).arg(STEP_S.to_string());
            let averaged = averaged(samples).iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
            match answer(&mut command, &averaged) {
                Ok(theirs) => {
                    print(task, library, &theirs, Some(seconds));
                }
                Err(why) => println!("  {task:<16} {library:<12} left out: {why}"),
            }
        }
    }
    Ok(())
}

/// One line; with our time also the ratio to it.
fn print(task: &str, who: &str, answer: &Value, ours: Option<f64>) -> f64 {
    let number = |key: &str| answer[key].as_f64().unwrap_or(f64::NAN);
    let seconds = number("seconds");
    let ratio = ours.map_or(String::new(), |ours| format!("   {:>8.1} times", seconds / ours));
    println!("  {task:<16} {who:<12} {:>10.4} s {:>8.0} MiB{ratio}", seconds, number("peak_mib"));
    seconds
}

/// The JSON that a process prints last.
fn answer(command: &mut Command, input: &str) -> Result<Value, Failure> {
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?;
    if let Some(mut pipe) = child.stdin.take() {
        // one that does not read it has closed it
        let _ = pipe.write_all(input.as_bytes());
    }
    let out = child.wait_with_output()?;
    if !out.status.success() {
        let text = String::from_utf8_lossy(&out.stderr);
        return Err(text.lines().last().unwrap_or("it failed").into());
    }
    let text = String::from_utf8(out.stdout)?;
    Ok(serde_json::from_str(text.lines().last().unwrap_or_default())?)
}

fn write_data(folder: &Path, samples: usize) -> Result<(), Failure> {
    let mut draw = Stream::new(1, 0);
    let mut axis = |c1: f64| -> Vec<f64> {
        let at = |i: usize| -5e-3 - c1 * (-(i as f64) * STEP_S / 600.0).exp_m1();
        // as a sensor's single precision has it
        (0..samples).map(|i| f64::from((at(i) + 1.7e-3 * draw.normal()) as f32)).collect()
    };
    let [x, y, z] = [1e-3, -1e-3, 2e-3].map(&mut axis);
    let raw: Vec<u8> = z.iter().flat_map(|v| v.to_le_bytes()).collect();
    std::fs::write(folder.join("raw.bin"), raw)?;
    let mut log = Log::new("bench", TimeAxis::Uniform { start_s: 0.0, step_s: STEP_S, len: samples });
    for (name, values) in [("gyro_x_rad_s", x), ("gyro_y_rad_s", y), (names::GYRO_Z, z)] {
        log.push(name, values)?;
    }
    for name in ["log.csv", "log.parquet"] {
        write_log(folder.join(name), &log)?;
    }
    Ok(())
}

fn averaged(samples: usize) -> Vec<usize> {
    allan::decades(Deviation::Overlapping.longest(samples), 16)
}

/// Seconds and peak memory of a task.
fn measured(task: &str, path: &Path) -> Result<Value, Failure> {
    let mut seconds = Vec::new();
    let mut time = |work: &mut dyn FnMut() -> Result<(), Failure>| -> Result<(), Failure> {
        for _ in 0..runs() {
            let start = Instant::now();
            work()?;
            seconds.push(start.elapsed().as_secs_f64());
        }
        Ok(())
    };
    match task {
        "csv" => time(&mut || {
            black_box(read_log(path)?);
            Ok(())
        })?,
        "parquet" => time(&mut || {
            let recording = read_gyro(path, &GyroQuery::default())?;
            let rate = recording.log.require(names::GYRO_Z)?;
            black_box(fit(&recording.log.time, rate, &FitOptions::default())?);
            Ok(())
        })?,
        _ => {
            let bytes = std::fs::read(path)?;
            let numbers = bytes.chunks_exact(8).map(|b| f64::from_le_bytes(std::array::from_fn(|i| b[i])));
            let rate: Vec<f64> = numbers.collect();
            drop(bytes);
            let axis = TimeAxis::Uniform { start_s: 0.0, step_s: STEP_S, len: rate.len() };
            let averaged = averaged(rate.len());
            time(&mut || {
                match task {
                    "fit" => drop(black_box(fit(&axis, &rate, &FitOptions::default())?)),
                    "allan" => drop(black_box(allan::deviations(&rate, STEP_S, &averaged, Deviation::Overlapping))),
                    _ => drop(black_box(autocorrelation(&rate, 1000))),
                }
                Ok(())
            })?;
        }
    }
    seconds.sort_by(f64::total_cmp);
    Ok(json!({ "seconds": seconds[seconds.len() / 2], "peak_mib": peak_mib() }))
}

/// Where the system tells it.
fn peak_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}
