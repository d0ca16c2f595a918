//! Reading of a log for callers of the library; no command of the program.

use super::drive_args::DriveArgs;
use super::places;
use clap::Parser;
use gyroid::Result;
use gyroid::ingest::DriveRecording;
use std::path::PathBuf;

/// Reads every channel of a log.
#[derive(Debug, Parser)]
#[command(name = "read", disable_help_flag = true, disable_version_flag = true)]
pub(super) struct Read {
    /// One file, or several on one clock
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    #[command(flatten)]
    columns: DriveArgs,
}

impl Read {
    pub(super) fn run(&self) -> Result<DriveRecording> {
        places::check_logs(&self.logs)?;
        self.columns.read_alone(&self.logs)
    }
}
