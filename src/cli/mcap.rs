//! `--mcap FILE`: the result as a recording for Foxglove and Rerun, with a layout beside it.

use super::output::Output;
use clap::Args;
use gyroid::files::{OutputFile, Plan};
use gyroid::report::mcap::{Shown, layout};
use gyroid::{Error, ErrorKind, Result};
use std::path::PathBuf;

/// Option of the commands that write a recording.
#[derive(Debug, Clone, Args)]
pub(crate) struct McapArgs {
    /// Write the result as a recording here (.mcap) for Foxglove, Rerun and ROS: sensors, poses, innovations, bands, verdict;
    /// and beside it a layout for Foxglove (.foxglove.json)
    #[arg(long, value_name = "FILE")]
    mcap: Option<PathBuf>,
}

/// The recording and its layout, claimed before the work begins.
pub(crate) struct Claimed {
    recording: OutputFile,
    layout: OutputFile,
}

impl McapArgs {
    fn layout(&self) -> Option<PathBuf> {
        self.mcap.as_ref().map(|path| path.with_extension("foxglove.json"))
    }

    /// Adds both files to what the command writes.
    pub(super) fn planned(&self, plan: Plan) -> Plan {
        plan.writes("--mcap", &self.mcap).writes("--mcap", self.layout())
    }

    /// Whether a recording is wanted.
    pub(super) fn wanted(&self) -> bool {
        self.mcap.is_some()
    }

    /// Claims both files.
    pub(super) fn claim(&self) -> Result<Option<Claimed>> {
        let (Some(path), Some(layout)) = (&self.mcap, self.layout()) else { return Ok(None) };
        if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mcap")) {
            return Err(Error::new(ErrorKind::Usage, path.display(), "is not the name of a recording")
                .at("--mcap")
                .hint("let the name end in .mcap"));
        }
        Ok(Some(Claimed { recording: OutputFile::claim(path)?, layout: OutputFile::claim(layout)? }))
    }
}

impl Claimed {
    /// Writes both files, and says so.
    pub(super) fn write(
        self,
        shown: Shown,
        record: impl FnOnce(OutputFile) -> Result<()>,
        output: &Output,
    ) -> Result<()> {
        let Self { recording, layout: mut beside } = self;
        let [target, name] = [&recording, &beside].map(|file| file.target().display().to_string());
        record(recording)?;
        beside.write_all(format!("{:#}\n", layout(shown)).as_bytes())?;
        beside.commit()?;
        output.say(format!("wrote {target}; Foxglove's layout for it is {name}"));
        Ok(())
    }
}
