//! gyroid beside the libraries that Python users have, in one table: time, peak memory and answers, on the same files in one run.
//!
//! `SAMPLES=10000000 PYTHON=.venv/bin/python cargo bench --bench peers -- --json peers.json` prints the table as Markdown; the file
//! is optional and has all numbers. Each task of each program is a process of its own. Its time is the median of three runs, or
//! of `RUNS`. A library that the Python lacks is left out.

use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;
use table::{Column, Section};

#[path = "../filter/drive.rs"]
mod drive;
mod making;
mod navigation;
mod ours;
mod table;
use drive::Outcome;

/// A task: its name, its title, the file that it reads, who else does it.
const TASKS: [(&str, &str, &str, &[&str]); 10] = [
    ("fit", "warm-up fit of an array", "raw.bin", &["scipy", "lmfit"]),
    ("allan", "overlapping Allan deviation at 100 times", "noise.bin", &["allantools", "allan-variance"]),
    ("noise", "noise terms", "noise.bin", &["allantools", "allan-variance"]),
    ("autocorrelation", "autocorrelation, 1000 lags", "coloured.bin", &["statsmodels"]),
    ("whiteness", "Ljung-Box, 40 lags, 50 000 white samples", "white.bin", &["statsmodels"]),
    ("rolling", "extended Kalman filter, 98 s at 100 Hz", "rolling.json", &["filterpy"]),
    ("slip", "the same with wheels that slip", "slip.json", &["filterpy"]),
    ("payload", "payload from a drive of 20 s", "payload.parquet", &["mujoco.sysid"]),
    ("csv", "four columns of CSV", "log.csv", &["pandas", "polars"]),
    ("parquet", "the same of Parquet", "log.parquet", &["pyarrow", "polars"]),
];

/// Runs of each task.
fn runs() -> usize {
    std::env::var("RUNS").ok().and_then(|n| n.parse().ok()).unwrap_or(3).max(1)
}

fn main() -> Outcome<()> {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let json_path = match &arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["--task", task, path] => {
            println!("{}", ours::measured(task, Path::new(path))?);
            return Ok(());
        }
        ["--json", path] => Some(PathBuf::from(path)),
        [] => None,
        _ => return Err("usage: cargo bench --bench peers -- [--json FILE]".into()),
    };
    let samples = std::env::var("SAMPLES").ok().map_or(Ok(1_000_000), |n| n.parse())?;
    let folder = tempfile::tempdir()?;
    let truth = making::write_data(folder.path(), samples)?;
    for task in ["rolling", "slip"] {
        navigation::write(folder.path(), task)?;
    }
    let mut sections = Vec::new();
    for (task, title, file, peers) in TASKS {
        let truth = truth.get(task).cloned().unwrap_or_default();
        if let Some(why) = truth.as_str() {
            eprintln!("{task}: left out: {why}");
            continue;
        }
        let path = folder.path().join(file);
        let own = answer(Command::new(std::env::current_exe()?).arg("--task").arg(task).arg(&path))?;
        let mut columns = vec![Column::new("gyroid", Ok(own))];
        columns.extend(peers.iter().map(|peer| Column::new(peer, python(&[peer, task], &path))));
        sections.push(Section::new(task, title, truth.as_object().cloned().unwrap_or_default(), columns));
    }
    let lines = table::lines(&sections);
    println!("{samples} samples, the median of {} runs:\n\n{}", runs(), lines.join("\n"));
    if let Some(path) = json_path {
        let tasks: Map<String, Value> = sections.iter().map(|s| (s.task.into(), s.json())).collect();
        let all = json!({ "samples": samples, "runs": runs(), "tasks": tasks, "table": lines });
        std::fs::write(path, format!("{all:#}\n"))?;
    }
    Ok(())
}

/// The answer of `peers.py`, called by `words` and with the file `path`.
fn python(words: &[&str], path: &Path) -> Outcome<Value> {
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    let script = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("benches/peers/peers.py");
    answer(Command::new(python).arg(script).args(words).arg(path).arg(making::STEP_S.to_string()))
}

/// The JSON that a process prints last.
fn answer(command: &mut Command) -> Outcome<Value> {
    let out = command.output()?;
    if !out.status.success() {
        let text = String::from_utf8_lossy(&out.stderr);
        return Err(text.trim_end().lines().last().unwrap_or("it failed").into());
    }
    let text = String::from_utf8(out.stdout)?;
    Ok(serde_json::from_str(text.trim_end().lines().last().unwrap_or_default())?)
}
