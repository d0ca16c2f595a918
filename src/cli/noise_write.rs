//! `gyroid noise --write`: the terms into the configuration that the fit made.

use super::output::{Output, command_line};
use clap::Args;
use gyroid::config::Config;
use gyroid::export::{NoiseOptions, check_origin, with_noise};
use gyroid::files::{OutputFile, Plan};
use gyroid::report::{LogFacts, NoiseReport};
use gyroid::{Error, ErrorKind, Result};
use std::path::PathBuf;

/// Where the terms go.
#[derive(Debug, Clone, Args)]
pub(crate) struct WriteArgs {
    /// Write the terms and their intervals into this configuration, which gyroid fit made of this log and axis
    #[arg(long, value_name = "CONFIG")]
    pub write: Option<PathBuf>,
    /// Write them into a copy of it instead; with --shard the table of the part
    #[arg(short, long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Write them although the configuration was fitted to another log of the same gyro
    #[arg(long, requires = "write")]
    other_log: bool,
    /// Write them although the configuration was fitted to another axis
    #[arg(long, requires = "write")]
    other_axis: bool,
    /// Write also terms that do not explain the log
    #[arg(long, requires = "write")]
    pub accept: bool,
}

/// A configuration that waits for its terms, and the place where it will lie.
pub(crate) struct Pending {
    config: Config,
    name: String,
    file: OutputFile,
    options: NoiseOptions,
}

impl WriteArgs {
    /// Adds what is read and written: the configuration itself, or a copy.
    pub(super) fn planned(&self, plan: Plan) -> Plan {
        let plan = plan.reads(&self.write);
        if self.out.is_some() { plan.writes("--out", &self.out) } else { plan.updates("--write", &self.write) }
    }

    /// Refuses a copy of nothing.
    pub(super) fn check(&self) -> Result<()> {
        match (&self.out, &self.write) {
            (Some(_), None) => {
                Err(Error::new(ErrorKind::Usage, "--out", "is a copy of a configuration, and none is given")
                    .hint("name the configuration with --write, or a table with --results"))
            }
            _ => Ok(()),
        }
    }

    /// Reads the configuration and claims its place.
    pub(super) fn claim(&self) -> Result<Option<Pending>> {
        let Some(path) = &self.write else { return Ok(None) };
        let name = path.display().to_string();
        let config = Config::read(path)?;
        let file = OutputFile::claim(self.out.as_ref().unwrap_or(path))?;
        let options = NoiseOptions {
            other_log: self.other_log,
            other_axis: self.other_axis,
            command: command_line(),
            version: env!("CARGO_PKG_VERSION").into(),
        };
        Ok(Some(Pending { config, name, file, options }))
    }
}

impl Pending {
    /// Refuses another log or axis before the work begins.
    pub(super) fn check(&self, log: &LogFacts) -> Result<()> {
        check_origin(&self.config, log, &self.options).map_err(|e| self.named(e))
    }

    /// Writes the configuration with its terms, says so, and returns its path.
    pub(super) fn write(self, report: &NoiseReport, output: &Output) -> Result<String> {
        let config = with_noise(&self.config, report, &self.options).map_err(|e| self.named(e))?;
        let text = config.to_toml().map_err(|e| self.named(e))?;
        let target = self.file.target().display().to_string();
        let mut file = self.file;
        file.write_all(text.as_bytes())?;
        file.commit()?;
        let symbols: Vec<&str> = report.model.terms.iter().map(|t| t.id.symbol()).collect();
        output.say(format!("wrote {target}: {} with their intervals", symbols.join(", ")));
        let walk =
            |c: &Config| c.gyro.as_ref().and_then(|g| g.noise.as_ref()).and_then(|n| n.rate_random_walk_rad_s_sqrt_s);
        if let (Some(k), None) = (walk(&self.config), walk(&config)) {
            output.say(format!("  the random walk of the fit, {k:.3e} rad/s/√s, is taken out: these terms explain it"));
        }
        if config.gyro.as_ref().is_some_and(|g| g.temperature.is_some()) {
            output.say(
                "  note: what follows the temperature was not taken out before: with [gyro.temperature] the walk is overstated",
            );
        }
        Ok(target)
    }

    fn named(&self, error: Error) -> Error {
        if error.input == "configuration" { error.named(&self.name) } else { error }
    }
}
