//! `gyroid gap`: the gap between the nominal simulator and recordings.

mod asked;
mod bench;
mod calibrate;
mod compare;
mod diagnose;
mod explain;
mod fleet;
mod key_path;
mod loads;
mod patching;
mod plan;
mod power;
mod recordings;
mod replay;
mod simulated;
mod twin;
mod written;

use super::outcome::Outcome;
use clap::{Args, Subcommand};
use gyroid::Result;

/// The gap between a simulator and the real world: where it lies, which effect causes it, how far it shrinks
#[derive(Debug, Args)]
#[command(arg_required_else_help = true)]
pub(crate) struct GapArgs {
    #[command(subcommand)]
    command: GapCommand,
}

#[derive(Debug, Subcommand)]
enum GapCommand {
    Diagnose(diagnose::DiagnoseArgs),
    Explain(explain::ExplainArgs),
    Twin(twin::TwinArgs),
    Compare(compare::CompareArgs),
    Power(power::PowerArgs),
    Plan(plan::PlanArgs),
    Fleet(fleet::FleetArgs),
    Bench(bench::BenchArgs),
}

pub(crate) fn run(args: &GapArgs) -> Result<Outcome> {
    match &args.command {
        GapCommand::Diagnose(args) => diagnose::run(args),
        GapCommand::Explain(args) => explain::run(args),
        GapCommand::Twin(args) => twin::run(args),
        GapCommand::Compare(args) => compare::run(args),
        GapCommand::Power(args) => power::run(args),
        GapCommand::Plan(args) => plan::run(args),
        GapCommand::Fleet(args) => fleet::run(args),
        GapCommand::Bench(args) => bench::run(args),
    }
}
