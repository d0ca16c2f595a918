//! Options that the commands which judge recordings share.

use crate::cli::log_args::ColumnArgs;
use clap::Args;

#[derive(Debug, Args)]
pub(crate) struct AskedArgs {
    /// Seed of the simulated recordings
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Effects to leave out of the library, by id
    #[arg(long, value_name = "ID", num_args = 1..)]
    pub without: Vec<String>,
    /// Of a drive: read a column as a channel, whatever it is called: wheel_left_rad_s=wl:deg/s; may be given more than once
    #[arg(long, value_name = "CHANNEL=[-]COLUMN[:UNIT]")]
    pub map: Vec<String>,
    #[command(flatten)]
    pub columns: ColumnArgs,
}
