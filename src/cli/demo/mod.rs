//! `gyroid demo`: a log fitted, its configuration in the filter, a gap found and closed.

mod steps;

use super::outcome::Outcome;
use super::output::{Common, Output, as_typed, captured};
use clap::Args;
use gyroid::files::{OutputFile, Plan, mark};
use gyroid::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};
use std::time::Instant;
use steps::{NEXT, STEPS, Step};

const ROBOT: &str = include_str!("robot.toml");
const GYRO: &str = include_str!("gyro.toml");
const EFFECT: &str = include_str!("effect.toml");

/// Show the whole of it in half a minute: a log is fitted, the filter uses the result, a gap is found and closed
///
/// Recordings are simulated, with an effect that the configuration does not know. Each command stands there as you would type it, with
/// its output shortened ([...]); they run in a folder of their own, where all files stay.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  gyroid demo\n  gyroid demo -o demo")]
pub(crate) struct DemoArgs {
    /// Folder for the files; made if it is not there [default: a new one among the temporary files]
    #[arg(short, long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
}

/// A command that has run.
struct Ran {
    line: &'static str,
    exit_code: u8,
    seconds: f64,
}

/// Runs a command as it would be typed.
type Typed<'a> = &'a dyn Fn(&[&str]) -> Result<Outcome>;

/// Runs the demonstration by `typed`.
pub(crate) fn run(args: &DemoArgs, typed: Typed) -> Result<Outcome> {
    let output = Output::open(&args.common, "demo", Plan::new())?;
    let folder = folder(args.out.as_deref())?;
    let begun = Instant::now();
    let back = std::env::current_dir().map_err(|e| Error::io(".", &e))?;
    std::env::set_current_dir(&folder).map_err(|e| Error::io(&folder, &e))?;
    let ran = all(&output, args.common.force, typed);
    std::env::set_current_dir(&back).map_err(|e| Error::io(&back, &e))?;
    let ran = ran?;
    let seconds = begun.elapsed().as_secs_f64();
    let shown = folder.display();
    output.say(format!(
        "\nDone in {seconds:.0} s. All files are in {shown}\n  before.png and after.png: the drive without and with the finding; \
         gap.html: the page of the gap, for a browser; gap.png: its picture; why.md: all that was tried\n\n{NEXT}"
    ));
    let steps: Vec<_> = ran
        .iter()
        .map(|r| serde_json::json!({ "command": r.line, "exit_code": r.exit_code, "seconds": r.seconds }))
        .collect();
    output.finish(&serde_json::json!({ "folder": shown.to_string(), "seconds": seconds, "steps": steps }))?;
    Ok(Outcome::Done)
}

/// The folder that was named, or a new one.
fn folder(named: Option<&Path>) -> Result<PathBuf> {
    let Some(named) = named else {
        let new = tempfile::Builder::new().prefix("gyroid-demo-").tempdir();
        return Ok(new.map_err(|e| Error::io(std::env::temp_dir(), &e))?.keep());
    };
    if named.exists() && !named.is_dir() {
        return Err(Error::new(ErrorKind::Exists, named.display(), "is a file, and the demonstration needs a folder")
            .at("--out")
            .hint("name a folder, or one that is yet to be made"));
    }
    std::fs::create_dir_all(named).map_err(|e| Error::io(named, &e))?;
    named.canonicalize().map_err(|e| Error::io(named, &e))
}

/// Writes the robot, and runs all commands, in the current folder.
fn all(output: &Output, force: bool, typed: Typed) -> Result<Vec<Ran>> {
    let real = format!("{ROBOT}{GYRO}");
    let files = [("robot.toml", ROBOT.into()), ("withheld.toml", format!("{real}{EFFECT}")), ("real.toml", real)];
    Plan::new().writes("--out", files.iter().map(|(name, _)| name)).check(force)?;
    for (name, text) in files {
        let mut file = OutputFile::claim(name)?;
        file.write_all(mark::with_digest(text).as_bytes())?;
        file.commit()?;
    }
    output.say(
        "robot.toml is a small robot as its builder knows it; real.toml has its gyro too; withheld.toml has what nobody knows.",
    );
    let working = output.working("demonstrating");
    let mut ran = Vec::new();
    for (i, step) in STEPS.iter().enumerate() {
        working.show(format!("{} of {}: {}", i + 1, STEPS.len(), step.line));
        let (done, text) = one(step, force, typed)?;
        working.aside(|| output.say(text));
        ran.push(done);
    }
    Ok(ran)
}

/// Runs a command as the command line would, and shows it with what it said.
fn one(step: &Step, force: bool, typed: Typed) -> Result<(Ran, String)> {
    let words: Vec<&str> = step.line.split(' ').chain(force.then_some("--force")).collect();
    let begun = Instant::now();
    let (outcome, answer) = captured(|| as_typed(step.line.into(), || typed(&words)));
    let exit_code = outcome?.code();
    let mut text = String::new();
    if !step.why.is_empty() {
        text = format!("\n{}\n", step.why);
    }
    text += &format!("\n$ {}\n{}", step.line, shortened(&answer.text, step.shown));
    if exit_code != 0 {
        text += &format!("\n(exit code {exit_code})");
    }
    Ok((Ran { line: step.line, exit_code, seconds: begun.elapsed().as_secs_f64() }, text))
}

/// Lines that begin as one of `shown` does; `[...]` stands for those left out between them.
fn shortened(said: &str, shown: &[&str]) -> String {
    let (mut lines, mut gap) = (Vec::new(), false);
    for line in said.lines() {
        if shown.iter().any(|beginning| line.trim_start().starts_with(beginning)) {
            if std::mem::take(&mut gap) {
                lines.push("  [...]");
            }
            lines.push(line);
        } else {
            gap |= !line.trim().is_empty();
        }
    }
    if gap {
        lines.push("  [...]");
    }
    lines.join("\n")
}
