//! Files of a diagnosis beside its page: pictures, the trail, the page in HTML, the augmented configuration, a patched copy.

use super::patching::{Patch, PatchArgs};
use super::replay::Reads;
use crate::cli::html::{self, HtmlArgs};
use crate::cli::mcap::{Claimed, McapArgs};
use crate::cli::output::Output;
use clap::Args;
use gyroid::config::EffectTable;
use gyroid::export::ranges;
use gyroid::files::{OutputFile, Plan};
use gyroid::gap::Diagnosis;
use gyroid::report::GapReport;
use gyroid::report::html::gap_page;
use gyroid::report::mcap::{GapRecording, Shown};
use gyroid::report::plot::Format;
use gyroid::signal::Log;
use gyroid::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(crate) struct WrittenArgs {
    /// Write the configuration with the effects that were found as tables [[effect]]
    #[arg(long, value_name = "FILE")]
    write_sim: Option<PathBuf>,
    #[command(flatten)]
    patch: PatchArgs,
    /// Write what was found as ranges for the domain randomisation of Isaac Lab, JSON: terms of its event manager, changes of
    /// observations, and what has no place there
    #[arg(long, value_name = "FILE")]
    ranges: Option<PathBuf>,
    /// Write everything that was tried, stage by stage, and why it was taken or not, as Markdown
    #[arg(long, value_name = "FILE")]
    why: Option<PathBuf>,
    /// Draw the page; the format follows the ending, .svg or .png; may be given more than once
    #[arg(long, value_name = "FILE")]
    plot: Vec<PathBuf>,
    #[command(flatten)]
    page: HtmlArgs,
    #[command(flatten)]
    recording: McapArgs,
}

/// Files that were claimed before the work began.
pub(crate) struct Written<'a> {
    write_sim: Option<OutputFile>,
    patch: Option<Patch<'a>>,
    ranges: Option<OutputFile>,
    why: Option<OutputFile>,
    plots: Vec<OutputFile>,
    page: Option<OutputFile>,
    mcap: Option<Claimed>,
}

impl WrittenArgs {
    /// Adds the files to what the command reads and writes.
    pub(super) fn planned(&self, plan: Plan) -> Plan {
        let plan = plan.writes("--write-sim", &self.write_sim).writes("--ranges", &self.ranges);
        let plan = plan.writes("--plot", &self.plot).writes("--why", &self.why);
        self.recording.planned(self.page.planned(self.patch.planned(plan)))
    }

    /// Claims the files; `drives`: the diagnosis is of a robot.
    pub(super) fn claim(&self, drives: bool) -> Result<Written<'_>> {
        let plots = self.plot.iter().map(|path| Format::of(path).and_then(|_| OutputFile::claim(path)));
        let plots = plots.collect::<Result<Vec<_>>>()?;
        let write_sim = self.write_sim.as_ref().map(OutputFile::claim).transpose()?;
        if self.ranges.is_some() && !drives {
            let found = "are of a robot's sizes and sensors, and the configuration is of a gyro at rest";
            return Err(Error::new(ErrorKind::Usage, "--ranges", found)
                .hint("leave it out: gyroid export CONFIG --to isaac-lab writes the noise of a gyro"));
        }
        let ranges = self.ranges.as_ref().map(OutputFile::claim).transpose()?;
        let why = self.why.as_ref().map(OutputFile::claim).transpose()?;
        let (page, mcap) = (self.page.claim()?, self.recording.claim()?);
        Ok(Written { write_sim, patch: self.patch.claim(drives)?, ranges, why, plots, page, mcap })
    }
}

impl<'a> Written<'a> {
    /// Runs the user's simulator, where one is given, on the first recording held out: one that fails does so before the work.
    pub(super) fn replays(&mut self, kept: Option<&'a Log>, reads: Reads<'a>) -> Result<()> {
        self.patch.as_mut().map_or(Ok(()), |patch| patch.replays(kept, reads))
    }

    /// Whether time traces are shown.
    pub(super) fn shows_traces(&self) -> bool {
        self.page.is_some() || self.mcap.is_some() || !self.plots.is_empty()
    }

    /// Writes all of it, and says so; `given`: effects that the simulator had before, `inputs`: files that were read. The
    /// patch as JSON, where there is one.
    pub(super) fn write<P: AsRef<Path>>(
        self,
        report: &GapReport,
        diagnosis: &Diagnosis,
        given: &[EffectTable],
        inputs: impl IntoIterator<Item = P>,
        output: &Output,
    ) -> Result<Option<serde_json::Value>> {
        let augmented = &diagnosis.augmented;
        let chassis = self.patch.as_ref().map(Patch::chassis).transpose()?.flatten();
        let patch = self.patch.zip(augmented.vehicle.as_ref());
        let patch =
            patch.map(|(patch, vehicle)| Ok((patch.decide(report.answer, vehicle, augmented)?, patch, vehicle)));
        let patch = patch.transpose()?;
        if !self.plots.is_empty() {
            let picture = report.picture()?;
            let names: Vec<String> = self.plots.iter().map(|p| p.target().display().to_string()).collect();
            self.plots.into_iter().try_for_each(|file| picture.write(file))?;
            output.say(format!("\ndrew {}", names.join(", ")));
        }
        if let Some(file) = self.page {
            html::write(file, &gap_page(report, &html::origin(inputs)?)?, output)?;
        }
        if let Some(mcap) = self.mcap {
            let shown = Shown::Gap { drive: augmented.vehicle.is_some() };
            mcap.write(shown, |file| GapRecording { report, command: output.command() }.write(file), output)?;
        }
        if let Some(mut file) = self.why {
            let target = file.target().display().to_string();
            file.write_all(report.why().as_bytes())?;
            file.commit()?;
            output.say(format!("wrote {target}: {} steps", report.answer.trace.len()));
        }
        if let Some(mut file) = self.write_sim {
            let target = file.target().display().to_string();
            file.write_all(augmented.to_toml().map_err(|e| e.named(&target))?.as_bytes())?;
            file.commit()?;
            let found = augmented.effects.iter().filter(|e| !given.contains(e)).count();
            output.say(format!("wrote {target}: {}", effects_text(found)));
        }
        if let Some(mut file) = self.ranges {
            let present: Vec<_> = report.answer.present().collect();
            let found = ranges(&present, augmented, chassis.as_ref());
            let target = file.target().display().to_string();
            let text = serde_json::to_string_pretty(&found)
                .map_err(|e| Error::new(ErrorKind::Numeric, &target, e.to_string()))?;
            file.write_all((text + "\n").as_bytes())?;
            file.commit()?;
            output.say(format!(
                "wrote {target}: for Isaac Lab {} events, {} observations, {} without a place",
                found.events.len(),
                found.observations.len(),
                found.no_place.len()
            ));
        }
        patch.map(|(decided, patch, vehicle)| patch.write(decided, vehicle, output)).transpose()
    }
}

fn effects_text(count: usize) -> String {
    match count {
        0 => "the nominal simulator, no effect added".into(),
        1 => "one effect added".into(),
        n => format!("{n} effects added"),
    }
}
