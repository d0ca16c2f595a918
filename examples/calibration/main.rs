//! Whether the intervals and probabilities that gyroid prints are right as often as they say: simulated logs with known truth.
//!
//! ```sh
//! cargo run --release --example calibration -- [--logs N] [--only NAME]... [--json FILE]
//! ```
//!
//! Prints one table. A number is consistent where the Clopper-Pearson interval of its share at 99 % holds what it claims; of a
//! hundred right numbers one is not. Exit code 1 where a number is not consistent and the table does not say what it is instead.
//! With `--only limit` it prints how well any interval can do where a log cannot tell a random walk from white noise.

mod filter;
mod fit;
mod gap;
mod limit;
mod noise;
mod table;

use clap::Parser;
use std::process::ExitCode;
use table::Row;

#[derive(Parser)]
struct Arguments {
    /// Logs of each quantity; of effects and time offsets a tenth.
    #[arg(long, default_value_t = 2000)]
    logs: u64,
    /// Only these: fit, line, whiteness, noise, allan, filter, effects, offsets, limit.
    #[arg(long, num_args = 1..)]
    only: Vec<String>,
    /// Write the counts here as well.
    #[arg(long)]
    json: Option<std::path::PathBuf>,
}

type Part = (&'static str, fn(u64) -> gyroid::Result<Vec<Row>>);

const PARTS: [Part; 8] = [
    ("fit", fit::intervals),
    ("line", fit::line),
    ("whiteness", fit::tests),
    ("noise", noise::terms),
    ("allan", noise::allan),
    ("filter", filter::rows),
    ("effects", gap::effects),
    ("offsets", gap::offsets),
];

fn run(given: &Arguments) -> Result<bool, Box<dyn std::error::Error>> {
    let asked = |name: &str| given.only.is_empty() || given.only.iter().any(|o| o == name);
    let known = |name: &String| name == "limit" || PARTS.iter().any(|p| p.0 == name);
    if let Some(name) = given.only.iter().find(|name| !known(name)) {
        return Err(format!("no quantity is called {name}").into());
    }
    let mut rows = Vec::new();
    for (_, part) in PARTS.into_iter().filter(|p| asked(p.0)) {
        let found = part(given.logs)?;
        if rows.is_empty() {
            println!("{}", Row::head());
        }
        found.iter().for_each(|row| println!("{row}"));
        rows.extend(found);
    }
    if asked("limit") {
        println!("\n{}", limit::table(given.logs)?);
    }
    if let Some(path) = &given.json {
        std::fs::write(path, serde_json::to_string_pretty(&rows)? + "\n")?;
    }
    Ok(rows.iter().all(|row| row.consistent() || !row.note.is_empty()))
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}
