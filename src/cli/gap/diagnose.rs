//! `gyroid gap diagnose`: where the gap lies, which effect causes it, how far it shrinks.

use super::asked::AskedArgs;
use super::loads::{LoadArgs, bare};
use super::recordings::{Recordings, read_drive};
use super::replay::Reads;
use super::written::WrittenArgs;
use crate::cli::log_args::ColumnArgs;
use crate::cli::outcome::Outcome;
use crate::cli::output::{Common, Output};
use crate::cli::places;
use clap::Args;
use gyroid::config::{Config, Kind};
use gyroid::effects::{Library, registry};
use gyroid::error::one_of;
use gyroid::files::Plan;
use gyroid::gap::rest::predictive;
use gyroid::gap::{Drive, DriveTraces, Options, Stage, diagnose_drives, diagnose_observed, trace};
use gyroid::report::GapReport;
use gyroid::signal::{Log, names as channel};
use gyroid::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};

/// Compare a recording with the simulator of CONFIG: where the gap lies, which effect causes it, how far it shrinks
///
/// A gyro at rest or a drive, as CONFIG's `kind` says. A drive needs wheel speeds; torques, gyro and pose tell more. Files after
/// one --fit are sensors of one drive; each --fit begins another drive of the same robot, and all are fitted together.
/// Exit code 0 whatever the verdict: an effect of the library, none, or one that the library does not know.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    gyroid gap diagnose sim.toml --fit fit.parquet --hold hold.parquet --plot gap.png\n  \
    gyroid gap diagnose sim.toml --fit fit.csv --json answer.json --write-sim augmented.toml\n  \
    gyroid gap diagnose sim.toml --fit fit.csv --why why.md --html gap.html\n  \
    gyroid gap diagnose husky.toml --fit imu.csv wheels.csv --map gyro_z_rad_s=gy_rad_s\n  \
    gyroid gap diagnose robot.toml --fit run2.csv --fit run3.csv --hold run4.csv --hold run5.csv\n  \
    gyroid gap diagnose robot.toml --fit empty.csv --fit loaded.csv --load loaded.csv=4.2\n  \
    gyroid gap diagnose robot.toml --fit run2.csv --patch robot.xml -o patched.xml --ranges isaac_lab.json")]
pub(crate) struct DiagnoseArgs {
    /// The nominal simulator: a configuration with [gyro]; of a drive also [vehicle] and [encoder]
    config: PathBuf,
    #[command(flatten)]
    recordings: Recordings,
    #[command(flatten)]
    loads: LoadArgs,
    #[command(flatten)]
    written: WrittenArgs,
    #[command(flatten)]
    asked: AskedArgs,
    #[command(flatten)]
    common: Common,
}

pub(crate) fn run(args: &DiagnoseArgs) -> Result<Outcome> {
    let Recordings { fit, hold } = &args.recordings;
    places::check("gap diagnose", &args.config, "--fit ", fit.iter().chain(hold).flatten())?;
    let plan = Plan::new().reads([&args.config]).reads(fit.iter().chain(hold).flatten());
    let output = Output::open(&args.common, "gap.diagnose", args.written.planned(plan))?;
    places::check_held_out(fit, hold)?;
    let (config, by_time) = Config::read_base(&args.config)?.by_elapsed_time();
    let library = library(&args.asked.without, Some(&config))?;
    let drives = config.kind == Kind::Driving;
    let files: Vec<&[PathBuf]> = fit.iter().chain(hold).map(Vec::as_slice).collect();
    let loads_kg = args.loads.of_drives(&files, !drives)?;
    let mut written = args.written.claim(drives)?;
    if !drives && !args.asked.map.is_empty() {
        return Err(Error::new(
            ErrorKind::Usage,
            "--map",
            "names columns of a drive, and the configuration is of a gyro at rest",
        )
        .hint("name the gyro's column with --column"));
    }
    let working = output.working("1 of 4: reading");
    let mut notes: Vec<String> = by_time.into_iter().collect();
    if !drives {
        one_at_rest(fit, "--fit")?;
        one_at_rest(hold, "--hold")?;
    }
    let mut read_one = |option: &str, paths: &[PathBuf]| -> Result<Log> {
        if let (false, [path]) = (drives, paths) {
            let (log, said) = read(&args.asked.columns, path, &args.config)?;
            let new = said.into_iter().filter(|note| !notes.contains(note));
            let of = if option == "--hold" { "Of the recording held out: " } else { "" };
            let new: Vec<String> = new.map(|note| format!("{of}{note}")).collect();
            notes.extend(new);
            return Ok(log);
        }
        let log = read_drive((&args.asked.columns, &args.asked.map), (option, paths), &config, &mut notes)?;
        places::check_drive(&log, &args.config)?;
        Ok(log)
    };
    let fit_logs = fit.iter().map(|paths| read_one("--fit", paths)).collect::<Result<Vec<_>>>()?;
    let hold_logs = hold.iter().map(|paths| read_one("--hold", paths)).collect::<Result<Vec<_>>>()?;
    let reads = Reads { columns: &args.asked.columns, map: &args.asked.map, config: &config };
    let (fit_loads_kg, hold_loads_kg) = loads_kg.split_at(fit.len());
    written.replays(bare(&hold_logs, hold_loads_kg), reads)?;
    let traces = written.shows_traces() || output.answers();
    let options = Options { seed: args.asked.seed, corrections: true, traces, ..Options::default() };
    let named = |e: Error| if e.input == "configuration" { e.named(args.config.display()) } else { e };
    let mut show = |stage| match stage {
        Stage::Compare => working.show("2 of 4: comparing effects"),
        Stage::Measure => working.show("3 of 4: measuring how far the gap shrinks"),
        Stage::Prepare | Stage::Done => {}
    };
    let diagnosed = if drives {
        let starts = args.asked.columns.starts_s(fit.len() + hold.len())?;
        let (fit_starts, hold_starts) = starts.split_at(fit.len());
        let (fit, kept) = (begun(&fit_logs, fit_starts, fit_loads_kg), begun(&hold_logs, hold_starts, hold_loads_kg));
        diagnose_drives(&config, &fit, &kept, &library, &options, &mut show)
    } else {
        diagnose_observed(&config, &fit_logs[0], hold_logs.first(), &library, &options, &mut show)
    };
    let mut diagnosis = diagnosed.map_err(|error| with_yaw_column(named(error), &notes))?;
    diagnosis.answer.trace.extend(trace::of_notes(&notes));
    diagnosis.answer.notes.extend(notes);
    let curves = match &diagnosis.prepared {
        Some(prepared) => {
            working.show("4 of 4: simulating recordings");
            let effects = [config.effects.as_slice(), &diagnosis.augmented.effects];
            predictive::of_prepared(prepared, effects, &library, args.asked.seed).map_err(named)?
        }
        None => Vec::new(),
    };
    drop(working);

    // one that cannot test what was found is not measured on, as a note says
    let measured = drives || diagnosis.far.is_some();
    let held_out = (measured && !hold.is_empty()).then(|| names(hold));
    let report = GapReport {
        recording: &names(fit),
        held_out: held_out.as_deref(),
        answer: &diagnosis.answer,
        curves: &curves,
        traces: &diagnosis.traces,
    };
    output.say(report.text());
    let inputs = [&args.config].into_iter().chain(fit.iter().chain(hold).flatten());
    let patched = written.write(&report, &diagnosis, &config.effects, inputs, &output)?;
    let mut json = serde_json::json!(diagnosis.answer);
    json["curves"] = match drives {
        true => serde_json::json!(diagnosis.traces.iter().flat_map(DriveTraces::curves).collect::<Vec<_>>()),
        false => serde_json::json!(curves),
    };
    if let Some(patched) = patched {
        json["patch"] = patched;
    }
    output.finish(&json)?;
    Ok(Outcome::Done)
}

/// `error` whose hint asks for the column of a yaw rate, with the column that was read as the gyro, as a note says.
fn with_yaw_column(mut error: Error, notes: &[String]) -> Error {
    let read_as = format!("\" is read as {}", channel::GYRO_Z);
    let column = notes.iter().find_map(|note| note.strip_suffix(&read_as)?.rsplit('"').next());
    if let (Some(hint), Some(column)) = (&mut error.hint, column) {
        *hint =
            hint.replace(&format!("{}=COLUMN", channel::ODO_YAW_RATE), &format!("{}={column}", channel::ODO_YAW_RATE));
    }
    error
}

/// Files of a drive apart by commas, drives by semicolons.
pub(super) fn names(drives: &[Vec<PathBuf>]) -> String {
    let one = |paths: &Vec<PathBuf>| paths.iter().map(|p| name(p)).collect::<Vec<_>>().join(", ");
    drives.iter().map(one).collect::<Vec<_>>().join("; ")
}

/// Drives with when each began, s after power-on, and what the robot carried in it, kg.
pub(super) fn begun<'a>(logs: &'a [Log], starts_s: &[f64], loads_kg: &[f64]) -> Vec<Drive<'a>> {
    let each = logs.iter().zip(starts_s).zip(loads_kg);
    each.map(|((log, start_s), load_kg)| Drive::new(log, *start_s).carrying(*load_kg)).collect()
}

/// Refuses what can only be of drives.
fn one_at_rest(recordings: &[Vec<PathBuf>], option: &str) -> Result<()> {
    let at_rest = |found: &str| {
        Error::new(ErrorKind::Usage, option, format!("{found}, and the configuration is of a gyro at rest"))
    };
    match recordings {
        [] => Ok(()),
        [files] if files.len() == 1 => Ok(()),
        [_] => {
            Err(at_rest("several files").hint("give one recording; several files on one clock can only be of a drive"))
        }
        _ => Err(at_rest("several recordings")
            .hint(format!("give {option} once: only drives are fitted together; diagnose each recording by itself"))),
    }
}

fn name(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

/// The effects but those of these ids, with those of the user's own that `config` defines.
pub(super) fn library(without: &[String], config: Option<&Config>) -> Result<Library> {
    let own = config.into_iter().flat_map(|config| &config.custom_effects).map(|e| e.id.as_str());
    let driving = gyroid::effects::drive::registry().iter().map(|e| e.about().id);
    let mut ids: Vec<&str> = registry().iter().map(|e| e.about().id).chain(driving).chain(own).collect();
    ids.dedup();
    match without.iter().find(|w| !ids.contains(&w.as_str())) {
        Some(unknown) => Err(Error::new(ErrorKind::Usage, "--without", format!("no effect is called {unknown:?}"))
            .hint(one_of(unknown, &ids))),
        None => {
            let library = Library::without(without.iter().cloned());
            config.map_or(Ok(library.clone()), |config| library.with_own(config))
        }
    }
}

/// A recording at rest on time since power-on, named by its path, with notes on it.
pub(super) fn read(columns: &ColumnArgs, path: &Path, config: &Path) -> Result<(Log, Vec<String>)> {
    let recording = columns.read(path)?;
    places::check_rest(path, config, &recording)?;
    let (time, notes) = (columns.time_since_power_on(&recording), columns.notes_on(&recording));
    let mut log = recording.log;
    log.time = time;
    log.source = path.display().to_string();
    Ok((log, notes))
}
