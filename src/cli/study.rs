//! `gyroid study`: two filters, with and without slip, over many simulated runs.

use super::html::{self, HtmlArgs};
use super::outcome::Outcome;
use super::output::{Common, Output, Working, with_schema};
use clap::Args;
use gyroid::config::{Config, Kind};
use gyroid::files::{OutputFile, Plan};
use gyroid::identify::{self, FitOptions};
use gyroid::ingest::{self, Axis, GyroQuery};
use gyroid::report::html::study_page;
use gyroid::report::{FitReport, LogFacts, StudyReport};
use gyroid::signal::{TimeAxis, names};
use gyroid::simulate::{Course, Options, stationary};
use gyroid::study::{DEFAULT_CONFIG, Estimator, FACTORS, Setup, by_ground, step_costs, study, wrong_beliefs};
use gyroid::traction::Surface;
use gyroid::units::RateUnit;
use gyroid::{Error, ErrorKind, Result, validate};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Compare the filters with and without slip, with and without the gyro's error model, over many simulated runs
///
/// Writes figures (PNG and SVG), study.json and report.md into a directory: the figures of the paper that the filters
/// come from, what it leaves out, and every equation, figure and claim of it with what became of it.
/// The same seed gives the same bytes, on one thread or many.
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:\n  \
    gyroid study --runs 100 --seed 1 -o study/\n  \
    gyroid study --surface ice --course square --sweeps -o study/\n  \
    gyroid study gyroid.toml --surface wet_asphalt --runs 1000 --json -"
)]
pub(crate) struct StudyArgs {
    /// Configuration of robot and gyro [default: a small robot on snow]
    config: Option<PathBuf>,
    /// Number of simulated runs
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// Seed of the first run; the others follow
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Length of a run, s
    #[arg(long, value_name = "S", default_value_t = 60.0)]
    duration: f64,
    /// Course to drive
    #[arg(long, value_name = "NAME", default_value = "brisk", value_parser = course, help = course_help())]
    course: Course,
    /// Ground to drive on [default: the configuration's]
    #[arg(long, value_name = "NAME", visible_alias = "friction", value_parser = surface, help = surface_help())]
    surface: Option<Surface>,
    /// Time since power-on at the begin of a run, s
    #[arg(long, value_name = "S", default_value_t = 20.0)]
    start_offset: f64,
    /// Study also every ground, and filters that are wrong about traction
    #[arg(long)]
    sweeps: bool,
    /// Follow the errors up to this many runs [default: --runs]
    #[arg(long, value_name = "N")]
    convergence: Option<u32>,
    /// Estimators of the pose
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = estimator, help = estimator_help())]
    estimators: Vec<Estimator>,
    /// Log of a gyro at rest, to identify its error model from [default: one simulated from the configuration]
    #[arg(long, value_name = "LOG")]
    rest: Option<PathBuf>,
    /// Axis of that log
    #[arg(long, value_name = "AXIS", value_parser = axis, default_value = "z", requires = "rest")]
    axis: Axis,
    /// Threads to run on [default: as many as there are cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Write figures, study.json and report.md into this directory; it is made where it is missing
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    page: HtmlArgs,
    #[command(flatten)]
    common: Common,
}

fn course(name: &str) -> std::result::Result<Course, String> {
    Course::parse(name).ok_or_else(|| format!("there are {}", Course::ALL.map(Course::name).join(", ")))
}

fn course_help() -> String {
    format!("Course to drive: {}", Course::ALL.map(Course::name).join(", "))
}

fn surface(name: &str) -> std::result::Result<Surface, String> {
    Surface::parse(name).ok_or_else(|| format!("there are {}", Surface::ALL.map(Surface::name).join(", ")))
}

fn surface_help() -> String {
    let names = Surface::ALL.map(Surface::name).join(", ");
    format!("Ground to drive on: {names} [default: the configuration's]")
}

fn estimator(name: &str) -> std::result::Result<Estimator, String> {
    Estimator::parse(name).ok_or_else(|| format!("there are {}", Estimator::ALL.map(Estimator::id).join(", ")))
}

fn estimator_help() -> String {
    let names = Estimator::ALL.map(Estimator::id).join(", ");
    let slow = Estimator::SlipUnscented.id();
    format!("Estimators of the pose, separated by commas: {names} [default: all but {slow}, which takes longest]")
}

fn axis(name: &str) -> std::result::Result<Axis, String> {
    match name.to_lowercase().as_str() {
        "x" => Ok(Axis::X),
        "y" => Ok(Axis::Y),
        "z" => Ok(Axis::Z),
        _ => Err("there are x, y, z".into()),
    }
}

pub(crate) fn run(args: &StudyArgs) -> Result<Outcome> {
    let begin = Instant::now();
    let plan = Plan::new().reads(&args.config).reads(&args.rest);
    let plan = plan.writes("--out", args.out.iter().flat_map(|dir| Files::names(dir, args.sweeps)));
    let output = Output::open(&args.common, "study", args.page.planned(plan))?;
    let page = args.page.claim()?;
    let files = args.out.as_ref().map(|dir| Files::claim(dir, args.sweeps)).transpose()?;
    let (config, robot) = match &args.config {
        Some(path) => {
            let (config, by_time) = Config::read(path)?.by_elapsed_time();
            by_time.into_iter().for_each(|note| output.say(format!("note: {note}")));
            (config, path.display().to_string())
        }
        None => (Config::parse(DEFAULT_CONFIG, "built-in robot")?, "built-in robot".to_string()),
    };
    let named = |error: Error| if error.input == "configuration" { error.named(&robot) } else { error };
    let setup = setup(args, config, &robot)?;
    let mut pool = rayon::ThreadPoolBuilder::new();
    if let Some(threads) = args.threads {
        pool = pool.num_threads(threads.into());
    }
    let pool = pool.build().map_err(|e| usage("--threads", format!("cannot be had: {e}")))?;

    let working = output.working("identifying the gyro's error model");
    let (report, ran_s) = pool.install(|| work(args, &setup, &robot, &working)).map_err(named)?;
    working.show("drawing");
    let json = report.json();
    let written = files.map(|f| f.write(&report, &json)).transpose()?;
    drop(working);
    if output.talks() {
        output.say(report.text());
        let threads = pool.current_num_threads();
        output.say(format!("\nruns {:.2} s, all {:.2} s, on {threads} threads", ran_s, begin.elapsed().as_secs_f64()));
        let costs = step_costs(&setup)?;
        let costs: Vec<_> = costs.iter().map(|(e, s)| format!("{} {:.2} us", e.id(), s * 1e6)).collect();
        output.say(format!("a step of 3 readings and a prediction takes: {}", costs.join(", ")));
        if let (Some(dir), Some(count)) = (&args.out, written) {
            output.say(format!("{count} files in {}, begin with report.md", dir.display()));
        }
    }
    if let Some(file) = page {
        let origin = html::origin(args.config.iter().chain(&args.rest))?;
        html::write(file, &study_page(&report, &origin)?, &output)?;
    }
    output.finish(&json)?;
    Ok(Outcome::Done)
}

fn usage(option: &str, found: String) -> Error {
    Error::new(ErrorKind::Usage, "study", found).at(option)
}

fn setup(args: &StudyArgs, config: Config, robot: &str) -> Result<Setup> {
    if config.kind == Kind::Stationary {
        return Err(Error::new(ErrorKind::Usage, robot, "is stationary, and a study drives")
            .at("`kind`")
            .hint("set kind = \"driving\" and add [vehicle] and [encoder], or give no configuration"));
    }
    if config.traction.is_none() && args.surface.is_none() {
        return Err(Error::new(ErrorKind::Config, robot, "the table is missing: its wheels do not slip")
            .at("[traction]")
            .hint("add it, or name a ground with --surface"));
    }
    let mut estimators = Estimator::ALL.to_vec();
    match args.estimators.as_slice() {
        // sigma points take several times as long as all the others together
        [] => estimators.retain(|e| *e != Estimator::SlipUnscented),
        asked => estimators.retain(|e| asked.contains(e)),
    }
    let setup = Setup {
        estimators,
        duration_s: args.duration,
        since_power_on_s: args.start_offset,
        runs: args.runs as usize,
        seed: args.seed,
        ..Setup::new(config, args.course)
    };
    Ok(args.surface.map_or_else(|| setup.clone(), |surface| setup.on(surface)))
}

/// The report, and the seconds that the runs themselves took.
fn work(args: &StudyArgs, setup: &Setup, robot: &str, working: &Working) -> Result<(StudyReport, f64)> {
    let identification = identification(args, setup)?;
    let count = |what: &'static str, all: usize| {
        let shown = working.counter(what.into());
        move |done: usize| shown(done, all)
    };
    let begin = Instant::now();
    let own = study(setup, count("run", setup.runs))?;
    let ran_s = begin.elapsed().as_secs_f64();
    // beside the study, only what the paper and every user have
    let few = vec![Estimator::Slip, Estimator::Rolling, Estimator::DeadReckoning];
    let beside = Setup { estimators: few, ..setup.clone() };
    let longer = match args.convergence.map(|n| n as usize) {
        Some(n) if n > setup.runs => Some(study(&Setup { runs: n, ..beside.clone() }, count("convergence: run", n))?),
        _ => None,
    };
    let (mut grounds, mut beliefs) = (Vec::new(), Vec::new());
    if args.sweeps {
        working.show("other grounds");
        grounds = by_ground(&beside, count("other grounds:", Surface::ALL.len()))?;
        working.show("wrong beliefs of traction");
        beliefs = wrong_beliefs(&beside, count("wrong beliefs of traction:", 2 * FACTORS.len()))?;
    }
    let report = StudyReport {
        robot: robot.to_string(),
        ground: ground(args, setup),
        identification,
        study: own,
        longer,
        grounds,
        beliefs,
        setup: setup.clone(),
    };
    Ok((report, ran_s))
}

/// Name of the ground: that of the option, or of the law that the configuration holds.
fn ground(args: &StudyArgs, setup: &Setup) -> String {
    use gyroid::traction::TractionLaw;
    let law = setup.truth.traction.map(|t| t.law);
    let known = Surface::ALL.into_iter().find(|s| law == Some(TractionLaw::Burckhardt(s.law())));
    match (args.surface.or(known), law) {
        (Some(surface), _) => surface.name().to_string(),
        (None, Some(law)) => format!("the configuration's {} ground", law.name()),
        (None, None) => "no ground".into(),
    }
}

/// The simulated log at rest is this many time constants long, which identifies T well …
const REST_TIME_CONSTANTS: f64 = 6.0;
/// … with so many samples.
const REST_SAMPLES: f64 = 12_000.0;

/// The gyro's error model, from a recorded log or from a simulated one.
fn identification(args: &StudyArgs, setup: &Setup) -> Result<FitReport> {
    let (log, time, rate_rad_s) = match &args.rest {
        Some(path) => {
            let recording = ingest::read_gyro(path, &GyroQuery { axis: args.axis, ..GyroQuery::default() })?;
            let log = LogFacts {
                name: path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
                column: recording.column.clone(),
                unit: recording.unit,
                sha256: recording.sha256.clone(),
                temperature_c: None,
                notes: recording.notes.clone(),
                audit: serde_json::json!(recording.audit),
            };
            let rate = recording.log.require(names::GYRO_Z)?.to_vec();
            (log, recording.log.time.clone(), rate)
        }
        None => {
            let duration_s = REST_TIME_CONSTANTS * setup.truth.require_gyro()?.time_constant_s;
            let config = Config { sample_time_s: Some(duration_s / REST_SAMPLES), ..setup.truth.clone() };
            let log = stationary(&config, duration_s, &Options::from(setup.seed))?;
            let rate = log.require(names::GYRO_Z)?.to_vec();
            (simulated_log(), log.time.clone(), rate)
        }
    };
    let name = log.name.clone();
    let fit = identify::fit(&time, &rate_rad_s, &FitOptions::default())
        .map_err(|e| if e.input == "log" { e.named(&name) } else { e })?;
    let residuals = fit.residuals(&time, &rate_rad_s);
    let validation = whiteness(&time, &residuals, &fit);
    Ok(FitReport::new(log, fit, validation))
}

fn whiteness(time: &TimeAxis, residuals: &[f64], fit: &identify::Fit) -> validate::Validation {
    validate::whiteness(time, residuals, &fit.jacobian(time), &validate::Options::default())
}

fn simulated_log() -> LogFacts {
    LogFacts {
        name: "simulated log at rest".into(),
        column: names::GYRO_Z.into(),
        unit: RateUnit::RadPerS,
        sha256: String::new(),
        temperature_c: None,
        notes: Vec::new(),
        audit: serde_json::Value::Null,
    }
}

/// The files of a study, claimed before the work begins.
struct Files {
    figures: Vec<[OutputFile; 2]>,
    json: OutputFile,
    page: OutputFile,
}

impl Files {
    /// Where they will lie.
    fn names(directory: &Path, sweeps: bool) -> Vec<PathBuf> {
        let figures = StudyReport::figure_names(sweeps);
        let pictures = figures.iter().flat_map(|name| [format!("{name}.png"), format!("{name}.svg")]);
        pictures.chain(["study.json".into(), "report.md".into()]).map(|name| directory.join(name)).collect()
    }

    fn claim(directory: &Path, sweeps: bool) -> Result<Self> {
        std::fs::create_dir_all(directory).map_err(|e| Error::io(directory, &e))?;
        let file = |name: String| OutputFile::claim(directory.join(name));
        let figure = |name: &str| Ok([file(format!("{name}.png"))?, file(format!("{name}.svg"))?]);
        Ok(Self {
            figures: StudyReport::figure_names(sweeps).into_iter().map(figure).collect::<Result<_>>()?,
            json: file("study.json".into())?,
            page: file("report.md".into())?,
        })
    }

    /// Writes all of them; their number.
    fn write(mut self, report: &StudyReport, json: &serde_json::Value) -> Result<usize> {
        let mut count = 2;
        for ((_, picture), files) in report.figures()?.iter().zip(self.figures) {
            for file in files {
                picture.write(file)?;
                count += 1;
            }
        }
        self.json.write_all(format!("{:#}\n", with_schema("study", json)).as_bytes())?;
        self.json.commit()?;
        self.page.write_all(report.page().as_bytes())?;
        self.page.commit()?;
        Ok(count)
    }
}
