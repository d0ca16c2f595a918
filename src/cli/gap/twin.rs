//! `gyroid gap twin`: the model of ours that stands for somebody's simulator, from its log.

use super::asked::AskedArgs;
use super::diagnose::{library, names};
use super::recordings::Runs;
use super::simulated::Reader;
use crate::cli::outcome::Outcome;
use crate::cli::output::{Common, Output};
use crate::cli::places;
use clap::Args;
use gyroid::Result;
use gyroid::files::{OutputFile, Plan};
use gyroid::gap::{Options, Stage};
use gyroid::report::TwinReport;
use std::path::PathBuf;

/// Identify the model that stands for a simulator, from the simulator's own log
///
/// Of a drive: mass, yaw inertia, wheel radius, track, friction, noises, delays, the gyro's bias and warm-up; at rest: warm-up and
/// noise. Effects that the simulator has and the model has not become tables [[effect]]. What the log cannot tell is taken from
/// --init, or named. The log alone says whether it is a drive.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    gyroid gap twin mujoco.csv -o sim.toml\n  \
    gyroid gap twin imu.csv wheels.csv --run imu2.csv wheels2.csv --init robot.toml -o sim.toml --json twin.json\n  \
    gyroid gap twin sim.parquet --map torque_left_n_m=tau_l --map torque_right_n_m=tau_r -o sim.toml")]
pub(crate) struct TwinArgs {
    /// Log of the simulator, in any format that `gyroid inspect` reads; several files on one clock are sensors of one run
    #[arg(value_name = "SIM_LOG", required = true, num_args = 1..)]
    logs: Vec<PathBuf>,
    #[command(flatten)]
    runs: Runs,
    /// Configuration with what the log cannot tell: mass and inertia without torques, radius without a pose
    #[arg(long, value_name = "CONFIG")]
    init: Option<PathBuf>,
    /// Write the twin as a configuration
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    asked: AskedArgs,
    #[command(flatten)]
    common: Common,
}

pub(crate) fn run(args: &TwinArgs) -> Result<Outcome> {
    let runs: Vec<Vec<PathBuf>> = std::iter::once(&args.logs).chain(&args.runs.run).cloned().collect();
    places::check_logs(runs.iter().flatten())?;
    let plan = Plan::new().reads(&args.init).reads(runs.iter().flatten()).writes("--out", &args.out);
    let output = Output::open(&args.common, "gap.twin", plan)?;
    let out = args.out.as_ref().map(OutputFile::claim).transpose()?;
    let mut reader = Reader::new(&args.asked.columns, &args.asked.map, args.init.as_ref())?;
    let library = library(&args.asked.without, reader.init.as_ref())?;
    let working = output.working("1 of 3: reading");
    let logs = reader.read("--run", &runs)?;
    let starts_s = args.asked.columns.starts_s(runs.len())?;
    let mut show = |stage| match stage {
        Stage::Prepare => working.show("2 of 3: identifying the simulator"),
        Stage::Compare => working.show("3 of 3: looking for what the model lacks"),
        Stage::Measure | Stage::Done => {}
    };
    let options = Options { seed: args.asked.seed, ..Options::default() };
    let mut twin = reader.twin(&logs, &starts_s, &library, &options, &mut show)?;
    drop(working);
    twin.notes.splice(0..0, reader.notes);
    output.say(TwinReport { log: &names(&runs), twin: &twin }.text());
    if let Some(mut file) = out {
        let target = file.target().display().to_string();
        file.write_all(twin.config.to_toml().map_err(|e| e.named(&target))?.as_bytes())?;
        file.commit()?;
        output.say(format!("\nwrote {target}"));
    }
    output.finish(&serde_json::json!({ "twin": twin.json() }))?;
    Ok(Outcome::Done)
}
