//! Arguments of `gyroid fit`, and the options of the library that they stand for.

use crate::cli::html::HtmlArgs;
use crate::cli::log_args::{ColumnArgs, MemoryArgs};
use crate::cli::many::{AxesArgs, MANY_LOGS, ManyArgs};
use crate::cli::output::{Common, command_line};
use clap::Args;
use gyroid::bias::{Against, Scheme};
use gyroid::export::ConfigurationOptions;
use gyroid::files::Plan;
use gyroid::identify::{FitOptions, Fixed, Loss, Weighting};
use gyroid::{Error, ErrorKind, Result, validate};
use std::path::{Path, PathBuf};

/// Fits e(t) = C1 (1 - exp(-t/T)) + C2 to a log at rest, validates it, and writes the configuration.
///
/// Where the log has a temperature, the same error is fitted against that too, and the report says which of both explains it, or
/// that the log cannot tell; --against temperature makes that model the one that is judged and written.
///
/// Exit code 3: the fit is done, and not fit for use (no warm-up or effect of temperature, T not identifiable, or residuals not
/// white); nothing is then exported unless --accept says so.
///
/// Of several logs, a folder, or several gyros of a log, it makes a table with one row a log, gyro and axis, and says how much
/// they differ. Exit code 3: there
/// are logs that could not be fitted, or too few for the configuration of the population.
#[derive(Debug, Clone, Args)]
pub(crate) struct FitArgs {
    /// Logs of a gyro at rest, or folders of them: CSV, Parquet, bag, MCAP, db3, ULog, DataFlash, MATLAB, HDF5 or NumPy
    #[arg(value_name = "LOG", required = true)]
    pub logs: Vec<PathBuf>,
    #[command(flatten)]
    pub many: ManyArgs,
    #[command(flatten)]
    pub axes: AxesArgs,
    #[command(flatten)]
    pub population: PopulationArgs,
    /// Keep a parameter at a value: c1=, c2= (rad/s) or t= (s); may be given more than once
    #[arg(long, value_name = "NAME=VALUE", value_parser = parse_fixed)]
    fix: Vec<(Parameter, f64)>,
    /// Latitude of the place in degrees, negative in the south: states which part of C2 is the Earth's rotation. Of the vertical
    /// axis alone, pointing up
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    pub latitude: Option<f64>,
    /// Loss function; huber is robust to outliers
    #[arg(long, value_enum, default_value_t = LossName::Squares)]
    pub loss: LossName,
    /// How samples are weighed; uniform is ordinary least squares, walk finds a warm-up that a random walk of the bias hides
    #[arg(long, value_enum, default_value_t = WeightingName::Uniform)]
    weighting: WeightingName,
    /// Independent variable of the model; temperature is written as [gyro.temperature], which validate and navigate
    /// then use
    #[arg(long, value_enum, default_value_t = AgainstName::Time)]
    pub against: AgainstName,
    /// Configuration to copy: brings [vehicle], [encoder], the filter's sample time
    #[arg(long, value_name = "FILE")]
    pub base: Option<PathBuf>,
    /// Write the configuration here
    #[arg(short, long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Export also what is not fit for use
    #[arg(long)]
    pub accept: bool,
    /// How the model is carried from sample to sample (backward-euler is the paper's equation 5j)
    #[arg(long, value_enum, default_value_t = SchemeName::Exact)]
    scheme: SchemeName,
    /// The filter's sample time in s [default: the base's, else the log's]
    #[arg(long, value_name = "S")]
    sample_time: Option<f64>,
    /// Draw log, fit and residuals here (.png or .svg) [default: beside the configuration, as both]
    #[arg(long, value_name = "FILE", conflicts_with = "no_plot")]
    pub plot: Vec<PathBuf>,
    /// Draw nothing
    #[arg(long)]
    no_plot: bool,
    #[command(flatten)]
    pub page: HtmlArgs,
    #[command(flatten)]
    pub whiteness: WhitenessArgs,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub memory: MemoryArgs,
    #[command(flatten)]
    pub columns: ColumnArgs,
}

/// Options for the population of many logs.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = MANY_LOGS)]
pub(crate) struct PopulationArgs {
    /// Write the configuration of the population here: its means, and how far one power-on lies from them
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Count also logs that are not of one population with the others
    #[arg(long)]
    pub keep_outlying: bool,
}

/// Options of the whiteness test.
#[derive(Debug, Clone, Args)]
pub(crate) struct WhitenessArgs {
    /// Probability at which white residuals fail
    #[arg(long, value_name = "P", default_value_t = 0.05)]
    level: f64,
    /// Permutations that calibrate the whiteness tests
    #[arg(long, value_name = "N", default_value_t = 999)]
    draws: usize,
    /// Seed of the permutations
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

impl WhitenessArgs {
    /// The library's options; a level or a count that decides nothing is a usage error.
    pub(crate) fn options(&self) -> Result<validate::Options> {
        if !(self.level > 0.0 && self.level < 1.0) || (self.draws as f64) < 1.0 / self.level - 1.0 {
            let found = format!("level {} with {} draws cannot be decided", self.level, self.draws);
            return Err(Error::new(ErrorKind::Usage, "--level, --draws", found)
                .hint("give a level between 0 and 1, and at least 1/level draws"));
        }
        Ok(validate::Options { level: self.level, draws: self.draws, seed: self.seed })
    }
}

/// Independent variable of a model, as named on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum AgainstName {
    /// Elapsed time since power-on
    Time,
    /// Temperature of the sensor
    Temperature,
}

impl From<AgainstName> for Against {
    fn from(name: AgainstName) -> Self {
        match name {
            AgainstName::Time => Self::Time,
            AgainstName::Temperature => Self::Temperature,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Parameter {
    C1,
    C2,
    TimeConstant,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum WeightingName {
    Uniform,
    #[value(alias = "random-walk")]
    Walk,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum LossName {
    Squares,
    Huber,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum SchemeName {
    Exact,
    #[value(alias = "backward_euler", alias = "5j")]
    BackwardEuler,
    #[value(alias = "forward_euler")]
    ForwardEuler,
}

fn parse_fixed(text: &str) -> std::result::Result<(Parameter, f64), String> {
    let (name, value) = text.split_once('=').ok_or("write NAME=VALUE, such as c2=0")?;
    let parameter = match name.trim().to_lowercase().as_str() {
        "c1" | "c1_rad_s" => Parameter::C1,
        "c2" | "c2_rad_s" => Parameter::C2,
        "t" | "time_constant" | "time_constant_s" => Parameter::TimeConstant,
        other => return Err(format!("no parameter {other:?}; there are c1, c2, t")),
    };
    let value: f64 = value.trim().parse().map_err(|_| format!("{value:?} is not a number"))?;
    Ok((parameter, value))
}

pub(super) fn configuration_options(args: &FitArgs) -> ConfigurationOptions {
    ConfigurationOptions {
        scheme: match args.scheme {
            SchemeName::Exact => Scheme::Exact,
            SchemeName::BackwardEuler => Scheme::BackwardEuler,
            SchemeName::ForwardEuler => Scheme::ForwardEuler,
        },
        sample_time_s: args.sample_time,
        command: command_line(),
        version: env!("CARGO_PKG_VERSION").into(),
    }
}

/// How the columns are read; a vertical axis is held against gravity.
pub(super) fn columns(args: &FitArgs) -> ColumnArgs {
    let columns = args.columns.clone();
    if args.latitude.is_some() { columns.upright() } else { columns }
}

pub(super) fn fit_options(args: &FitArgs) -> Result<FitOptions> {
    let mut fixed = Fixed::default();
    for (parameter, value) in &args.fix {
        let slot = match parameter {
            Parameter::C1 => &mut fixed.c1_rad_s,
            Parameter::C2 => &mut fixed.c2_rad_s,
            Parameter::TimeConstant => &mut fixed.time_constant_s,
        };
        if slot.replace(*value).is_some() {
            return Err(Error::new(ErrorKind::Usage, "--fix", format!("{parameter:?} is given twice")));
        }
    }
    let loss = match args.loss {
        LossName::Squares => Loss::Squares,
        LossName::Huber => Loss::Huber,
    };
    let weighting = match args.weighting {
        WeightingName::Uniform => Weighting::Uniform,
        WeightingName::Walk => Weighting::Walk,
    };
    Ok(FitOptions { fixed, loss, weighting })
}

/// Files that the command reads and writes.
impl FitArgs {
    /// Whether an option was given that only a fit of many logs has.
    pub(super) fn asks_for_many(&self) -> bool {
        self.many.asked_for() || !self.axes.axes.is_empty() || self.population.config.is_some()
    }

    /// With --shard, --out is the table of the part.
    pub(super) fn of_a_part(&self) -> Self {
        let mut args = self.clone();
        args.many.of_a_part(&mut args.out);
        args
    }
}

pub(super) fn plan(args: &FitArgs) -> Plan {
    let plan = Plan::new().reads(&args.logs).reads(&args.base).writes("--out", &args.out);
    let plan = plan.writes("--config", &args.population.config).writes("--plot", plots(args));
    args.many.planned(args.page.planned(plan))
}

/// The plots that were asked for, or both kinds beside the configuration.
pub(super) fn plots(args: &FitArgs) -> Vec<PathBuf> {
    let beside = |out: &Path| ["png", "svg"].map(|e| out.with_extension(e)).to_vec();
    match (&args.out, args.no_plot, args.plot.is_empty()) {
        (_, true, _) => Vec::new(),
        (_, _, false) => args.plot.clone(),
        (Some(out), _, _) => beside(out),
        _ => Vec::new(),
    }
}
