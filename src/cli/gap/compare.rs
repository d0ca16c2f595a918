//! `gyroid gap compare`: the gap between somebody's simulator and the robot, from a log of each.

use super::asked::AskedArgs;
use super::diagnose::{begun, library, names};
use super::loads::{LoadArgs, bare};
use super::recordings::Sides;
use super::replay::Reads;
use super::simulated::{Logs, Reader, apart};
use super::written::WrittenArgs;
use crate::cli::outcome::Outcome;
use crate::cli::output::{Common, Output};
use crate::cli::places;
use clap::Args;
use gyroid::files::{OutputFile, Plan};
use gyroid::gap::twin::{Pair, compare_at_rest, compare_drives, paired};
use gyroid::gap::{DriveTraces, Options, Stage};
use gyroid::report::{GapReport, TwinReport};
use gyroid::{Error, ErrorKind, Result};
use std::path::PathBuf;

/// Compare a simulator of anybody's with the robot, from a log of each: which effect the robot has and the simulator has not
///
/// The simulator's log is identified first (as gyroid gap twin does), and the recording is judged against that twin. What the
/// simulator has too is taken out, each with its uncertainty. A drive or a gyro at rest, as the logs' channels say. Exit code 0 whatever
/// the verdict.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    gyroid gap compare --sim mujoco.csv --real robot.csv --hold robot2.csv --json answer.json\n  \
    gyroid gap compare --sim imu_s.csv odo_s.csv --real imu.bag --init robot.toml\n  \
    gyroid gap compare --sim run1.csv --sim run2.csv --real drive1.csv --real drive2.csv --paired")]
pub(crate) struct CompareArgs {
    #[command(flatten)]
    sides: Sides,
    /// Configuration with what the simulator's log cannot tell: mass and inertia without torques, radius without a pose
    #[arg(long, value_name = "CONFIG")]
    init: Option<PathBuf>,
    /// The logs have the same commands, the first --sim with the first --real and so on: align them, and refuse those that differ
    #[arg(long)]
    paired: bool,
    /// Write the twin of the simulator as a configuration
    #[arg(long, value_name = "FILE")]
    write_twin: Option<PathBuf>,
    #[command(flatten)]
    loads: LoadArgs,
    #[command(flatten)]
    written: WrittenArgs,
    #[command(flatten)]
    asked: AskedArgs,
    #[command(flatten)]
    common: Common,
}

pub(crate) fn run(args: &CompareArgs) -> Result<Outcome> {
    let Sides { sim, real, hold } = &args.sides;
    let all = || sim.iter().chain(real).chain(hold).flatten();
    places::check_logs(all())?;
    let plan = Plan::new().reads(&args.init).reads(all());
    let plan = plan.writes("--write-twin", &args.write_twin);
    let output = Output::open(&args.common, "gap.compare", args.written.planned(plan))?;
    apart(("--sim", sim), ("--real", real))?;
    apart(("--sim", sim), ("--hold", hold))?;
    places::check_held_out(real, hold)?;
    let write_twin = args.write_twin.as_ref().map(OutputFile::claim).transpose()?;
    let mut reader = Reader::new(&args.asked.columns, &args.asked.map, args.init.as_ref())?;
    let library = library(&args.asked.without, reader.init.as_ref())?;
    let working = output.working("1 of 4: reading");
    let sim_logs = reader.read("--sim", sim)?;
    let real_logs = reader.read("--real", real)?;
    let hold_logs = reader.read("--hold", hold)?;
    alike(&sim_logs, &real_logs)?;
    if !hold.is_empty() {
        alike(&sim_logs, &hold_logs)?;
    }
    // the simulator's own runs carry what its model says
    let files: Vec<&[PathBuf]> = real.iter().chain(hold).map(Vec::as_slice).collect();
    let loads_kg = args.loads.of_drives(&files, !sim_logs.drives)?;
    let mut written = args.written.claim(sim_logs.drives)?;
    let config = reader.config()?;
    let reads = Reads { columns: &args.asked.columns, map: &args.asked.map, config: &config };
    let (real_loads_kg, hold_loads_kg) = loads_kg.split_at(real.len());
    written.replays(bare(&hold_logs.logs, hold_loads_kg), reads)?;
    let pairs = if args.paired { pairs(&sim_logs, &real_logs)? } else { Vec::new() };
    let starts_s = args.asked.columns.starts_s(sim.len() + real.len() + hold.len())?;
    let (sim_starts, others) = starts_s.split_at(sim.len());
    let (real_starts, hold_starts) = others.split_at(real.len());
    let traces = written.shows_traces() || output.answers();
    let options = Options { seed: args.asked.seed, corrections: false, traces, ..Options::default() };
    working.show("2 of 4: identifying the simulator");
    let twin = reader.twin(&sim_logs, sim_starts, &library, &options, &mut |_| {})?;
    let mut show = |stage| match stage {
        Stage::Compare => working.show("3 of 4: comparing the recording with the twin"),
        Stage::Measure => working.show("4 of 4: measuring how far the gap shrinks"),
        Stage::Prepare | Stage::Done => {}
    };
    let compared = if sim_logs.drives {
        let fit = begun(&real_logs.logs, real_starts, real_loads_kg);
        let kept = begun(&hold_logs.logs, hold_starts, hold_loads_kg);
        compare_drives(&twin, &fit, &kept, &library, &options, &mut show)
    } else {
        let simulated: Vec<_> = sim_logs.logs.iter().collect();
        compare_at_rest(&twin, &simulated, &real_logs.logs[0], hold_logs.logs.first(), &library, &options, &mut show)
    };
    let mut compared = compared?;
    drop(working);
    let answer = &mut compared.diagnosis.answer;
    answer.notes.extend(reader.notes);
    if hold.is_empty() {
        answer.notes.push("No recording was held out (--hold): nothing proves that the gap shrinks.".into());
    }
    let held_out = (!hold.is_empty()).then(|| names(hold));
    output.say(TwinReport { log: &names(sim), twin: &twin }.text());
    output.say("");
    let diagnosis = &compared.diagnosis;
    let report = GapReport {
        recording: &names(real),
        held_out: held_out.as_deref(),
        answer: &diagnosis.answer,
        curves: &[],
        traces: &diagnosis.traces,
    };
    output.say(report.text());
    let patched = written.write(&report, diagnosis, &twin.config.effects, args.init.iter().chain(all()), &output)?;
    if let Some(mut file) = write_twin {
        let target = file.target().display().to_string();
        file.write_all(twin.config.to_toml().map_err(|e| e.named(&target))?.as_bytes())?;
        file.commit()?;
        output.say(format!("wrote {target}: the twin of the simulator"));
    }
    let mut json = serde_json::json!(compared.diagnosis.answer);
    json["curves"] = serde_json::json!(diagnosis.traces.iter().flat_map(DriveTraces::curves).collect::<Vec<_>>());
    if let Some(patched) = patched {
        json["patch"] = patched;
    }
    json["twin"] = twin.json();
    json["twin"]["difference"] = serde_json::json!(compared.held_against);
    json["twin"]["pairs"] = serde_json::json!(pairs);
    output.finish(&json)?;
    Ok(Outcome::Done)
}

/// Refuses a drive beside a gyro at rest, and several recordings of the latter.
fn alike(sim: &Logs, real: &Logs) -> Result<()> {
    let kind = |drives: bool| if drives { "a drive" } else { "of a gyro at rest" };
    if sim.drives != real.drives {
        let found =
            format!("is {}, and the simulator's log {} is {}", kind(real.drives), sim.logs[0].source, kind(sim.drives));
        return Err(Error::new(ErrorKind::Usage, &real.logs[0].source, found)
            .hint("give two drives or two logs at rest, and name columns that were not recognised with --map"));
    }
    if !real.drives && real.logs.len() > 1 {
        return Err(Error::new(ErrorKind::Usage, "--real", "several recordings of a gyro at rest")
            .hint("give one: only drives are fitted together; compare each recording by itself"));
    }
    Ok(())
}

fn pairs(sim: &Logs, real: &Logs) -> Result<Vec<Pair>> {
    if !sim.drives || sim.logs.len() != real.logs.len() {
        let found = format!("{} runs of the simulator and {} recordings", sim.logs.len(), real.logs.len());
        return Err(
            Error::new(ErrorKind::Usage, "--paired", found).hint("give --real once for each --sim, both of drives")
        );
    }
    sim.logs.iter().zip(&real.logs).map(|(sim, real)| paired(sim, real)).collect()
}
