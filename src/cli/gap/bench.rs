//! `gyroid gap bench`: cases with sealed labels, answers to them, their score.

use super::calibrate;
use super::key_path::beside;
use crate::cli::outcome::Outcome;
use crate::cli::output::{Common, Output};
use clap::{Args, Subcommand, ValueEnum};
use gyroid::bench;
use gyroid::bench::worlds::Mix;
use gyroid::bench::{Order, SealKey};
use gyroid::config::{Config, Kind};
use gyroid::effects::Library;
use gyroid::files::{OutputFile, Plan};
use gyroid::gap::{self, Answer};
use gyroid::report::plot;
use gyroid::signal::Log;
use gyroid::{Error, ErrorKind, Result};
use std::path::PathBuf;

/// Try the diagnosis on recordings whose truth is sealed: make cases, run the diagnosis, score its answers
///
/// Cases are logs of real-looking units, at rest or driving, with no effect, one, two, or one that is in no list, kept as people
/// keep logs (CSV, few decimals, a file a sensor, clocks that disagree), which is no effect. The labels are encrypted with a key
/// that lies elsewhere, and a commitment to them is published before the diagnosis runs.
#[derive(Debug, Args)]
#[command(arg_required_else_help = true)]
pub(crate) struct BenchArgs {
    #[command(subcommand)]
    command: BenchCommand,
}

#[derive(Debug, Subcommand)]
enum BenchCommand {
    Make(MakeArgs),
    Run(RunArgs),
    Score(ScoreArgs),
    Calibrate(calibrate::CalibrateArgs),
}

pub(crate) fn run(args: &BenchArgs) -> Result<Outcome> {
    match &args.command {
        BenchCommand::Make(args) => make(args),
        BenchCommand::Run(args) => answer(args),
        BenchCommand::Score(args) => score(args),
        BenchCommand::Calibrate(args) => calibrate::run(args),
    }
}

/// Make cases in a new folder, and seal their labels
///
/// Prints the commitment: the SHA-256 of the labels. Publish it before the diagnosis runs; whoever has it can tell
/// afterwards that the labels are the same. The same seed gives the same cases, on one thread or many.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    gyroid gap bench make bench/ --cases 500\n  \
    gyroid gap bench make bench/ --kind driving --cases 200\n  \
    gyroid gap bench make bench/ --kind driving --cases 200 --habits 0\n  \
    gyroid gap bench make bench/ --cases 300 --seed 7 --unlisted 0.3 --key bench.key")]
struct MakeArgs {
    /// Folder to make; must be new or empty
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// A gyro at rest, or a driving robot
    #[arg(long, value_name = "KIND", default_value = "stationary")]
    kind: BenchKind,
    /// Number of cases
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..1_000_000))]
    cases: u32,
    /// Seed [default: drawn at random and sealed with the labels; who knows the seed can make the labels again]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Share of cases without any effect
    #[arg(long, value_name = "SHARE", default_value_t = 0.15)]
    none: f64,
    /// Share of cases with two effects
    #[arg(long, value_name = "SHARE", default_value_t = 0.15)]
    pairs: f64,
    /// Share of cases with an effect that is in no list
    #[arg(long, value_name = "SHARE", default_value_t = 0.15)]
    unlisted: f64,
    /// Share of cases with one effect that hold a little of others too (pairs, unlisted: half of it)
    #[arg(long, value_name = "SHARE", default_value_t = 0.4)]
    messy: f64,
    /// Share of cases for each habit of who records: rates printed with few decimals; CSV instead of Parquet; of drives also how the
    /// robot steers is stated, and for half of the share wheels read at 10 to 20 Hz into a file of their own, and clocks that
    /// disagree. None of it is an effect. 0: Parquet, one file a recording
    #[arg(long, value_name = "SHARE", default_value_t = 0.33)]
    habits: f64,
    /// Write the key to the labels to FILE [default: DIR.key, beside the folder]
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// Write the labels in the open too: for development, a bench made so proves nothing
    #[arg(long, value_name = "FILE", hide = true)]
    open_labels: Option<PathBuf>,
    /// Threads to run on [default: as many as there are cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    #[command(flatten)]
    common: Common,
}

/// Which recordings are made.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum BenchKind {
    /// A gyro at rest
    Stationary,
    /// A robot that drives
    Driving,
}

impl From<BenchKind> for Kind {
    fn from(kind: BenchKind) -> Self {
        match kind {
            BenchKind::Stationary => Self::Stationary,
            BenchKind::Driving => Self::Driving,
        }
    }
}

fn make(args: &MakeArgs) -> Result<Outcome> {
    let key_path = args.key.clone().unwrap_or_else(|| beside(&args.folder));
    let plan = Plan::new().writes("--key", [&key_path]).writes("--open-labels", &args.open_labels);
    let output = Output::open(&args.common, "gap.bench.make", plan)?;
    let mut key_file = OutputFile::claim(&key_path)?;
    let open = args.open_labels.as_ref().map(OutputFile::claim).transpose()?;
    let mix = Mix {
        cases: args.cases as usize,
        none: args.none,
        pairs: args.pairs,
        unlisted: args.unlisted,
        messy: args.messy,
        habits: args.habits,
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(args.threads.unwrap_or(0).into())
        .build()
        .map_err(|e| Error::new(ErrorKind::Usage, "gap bench make", e).at("--threads"))?;
    let working = output.working("making cases");
    let order = Order { kind: args.kind.into(), mix, seed: args.seed };
    let made = pool.install(|| bench::make(&args.folder, &order, working.counter("case".into())))?;
    drop(working);
    key_file.write_all(format!("{}\n", made.key.to_hex()).as_bytes())?;
    key_file.commit()?;
    if let Some(mut file) = open {
        file.write_all(format!("{:#}\n", serde_json::json!(made.labels)).as_bytes())?;
        file.commit()?;
    }
    output.say(format!("{} cases in {}", made.labels.len(), args.folder.display()));
    output.say(format!("key to the labels: {}", key_path.display()));
    output.say(format!("commitment: {}", made.bench.commitment));
    output.finish(&serde_json::json!({
        "folder": args.folder.display().to_string(),
        "cases": made.labels.len(),
        "key": key_path.display().to_string(),
        "commitment": made.bench.commitment,
    }))?;
    Ok(Outcome::Done)
}

/// Run the diagnosis over every case of a folder that has no answer yet
///
/// Answers are written whole or not at all: a run that was broken off goes on where it stopped.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    gyroid gap bench run bench/ --answers answers/\n  \
    gyroid gap bench run bench/ --answers without_tone/ --leave-out gyro.tone")]
struct RunArgs {
    /// Folder with the cases
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Folder for the answers; it is made where it is missing
    #[arg(long, value_name = "OUT")]
    answers: PathBuf,
    /// Cases at a time [default: one a core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Take this effect out of the library, so that cases with it have to be called unknown
    #[arg(long, value_name = "ID")]
    leave_out: Vec<String>,
    #[command(flatten)]
    common: Common,
}

/// The diagnosis that the bench tries.
fn diagnose(config: &Config, fit: &Log, hold: Option<&Log>, leave_out: &[String]) -> Result<Answer> {
    let library = Library::without(leave_out.iter().cloned());
    Ok(gap::diagnose(config, fit, hold, &library, &gap::Options::default())?.answer)
}

fn answer(args: &RunArgs) -> Result<Outcome> {
    let output = Output::open(&args.common, "gap.bench.run", Plan::new().reads([&args.folder]))?;
    let working = output.working("diagnosing");
    let ran = bench::run(
        &args.folder,
        &args.answers,
        args.jobs.unwrap_or(0).into(),
        &|config: &Config, fit: &Log, hold: Option<&Log>| diagnose(config, fit, hold, &args.leave_out),
        working.counter("case".into()),
    )?;
    drop(working);
    if let (0, 0, [(_, error), ..]) = (ran.answered, ran.there, ran.refused.as_slice()) {
        return Err(error.clone());
    }
    output.say(format!("{} answered, {} had an answer before, {} refused", ran.answered, ran.there, ran.refused.len()));
    for (name, error) in &ran.refused {
        output.say(format!("{name}: {error}"));
    }
    let refused: Vec<_> =
        ran.refused.iter().map(|(name, e)| serde_json::json!({"case": name, "error": e.to_string()})).collect();
    output.finish(&serde_json::json!({
        "answered": ran.answered,
        "there_before": ran.there,
        "refused": refused,
    }))?;
    Ok(if ran.refused.is_empty() { Outcome::Done } else { Outcome::Unfit })
}

/// Unseal the labels, check them against the commitment, and score the answers
///
/// Rates have Wilson's 95 % intervals. The calibration error stands beside what 95 % of perfectly calibrated methods
/// would score with the same confidences: below that, nothing is wrong with the confidence that this bench could show.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  \
    gyroid gap bench score bench/ --answers answers/ --key bench.key --plots pictures/")]
struct ScoreArgs {
    /// Folder with the cases
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Folder with the answers: CASE.json each
    #[arg(long, value_name = "OUT")]
    answers: PathBuf,
    /// Key to the labels
    #[arg(long, value_name = "FILE")]
    key: PathBuf,
    /// The commitment that was published, to compare with [default: the one in the folder]
    #[arg(long, value_name = "SHA256")]
    commitment: Option<String>,
    /// Effects that the run left out: cases with them count as unlisted, pairs with them do not count
    #[arg(long, value_name = "ID")]
    leave_out: Vec<String>,
    /// Score only the cases that have an answer, instead of counting the others as wrong; says how many there are
    #[arg(long)]
    answered: bool,
    /// Hold what answers gain on the recording held out against an oracle that is told the effects; takes seconds a case
    #[arg(long)]
    oracle: bool,
    /// Draw the confusion matrix, the reliability diagram and the ROC into this folder, as SVG and PNG
    #[arg(long, value_name = "FOLDER")]
    plots: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
}

fn score(args: &ScoreArgs) -> Result<Outcome> {
    let drawn = |folder: &PathBuf| {
        let of = |name| ["svg", "png"].map(|ending| folder.join(format!("{name}.{ending}")));
        plot::bench::NAMES.into_iter().flat_map(of).collect::<Vec<_>>()
    };
    let plan = Plan::new().reads([&args.folder, &args.answers, &args.key]);
    let plan = plan.writes("--plots", args.plots.iter().flat_map(drawn));
    let output = Output::open(&args.common, "gap.bench.score", plan)?;
    if let Some(folder) = &args.plots {
        std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, &e))?;
    }
    let key = SealKey::read(&args.key)?;
    let unsealed = bench::labels(&args.folder, &key, args.commitment.as_deref())?;
    let mut labels = bench::left_out(unsealed.labels, &args.leave_out);
    let answers = bench::answers(&args.answers, &labels)?;
    let all = labels.len();
    if args.answered {
        labels.retain(|name, _| answers.contains_key(name));
    }
    let mut score = bench::score(&labels, &answers, &bench::seconds(&args.answers));
    if args.oracle {
        let working = output.working("asking the oracle");
        let gains = bench::oracle(&args.folder, &labels, &answers, 0, working.counter("case".into()))?;
        score.of_oracle = bench::OfOracle::of(&gains);
    }
    if let Some(folder) = &args.plots {
        let title = args.folder.file_name().map_or_else(|| "bench".into(), |n| n.to_string_lossy().into_owned());
        for (name, picture) in plot::bench::pictures(&score, &title)? {
            for ending in ["svg", "png"] {
                picture.write(OutputFile::claim(folder.join(format!("{name}.{ending}")))?)?;
            }
        }
    }
    if labels.len() < all {
        output.say(format!("{} of {all} cases have no answer and are left out (--answered)", all - labels.len()));
    }
    output.say(score.text());
    output.finish(&score.json())?;
    Ok(Outcome::Done)
}
