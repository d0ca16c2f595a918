//! `gyroid gap bench calibrate`: temperature and prior odds under which the truth is most probable.

use super::key_path::beside;
use crate::cli::outcome::Outcome;
use crate::cli::output::{Common, Output};
use clap::Args;
use gyroid::bench;
use gyroid::bench::{Calibrated, Fit, SealKey};
use gyroid::config::Kind;
use gyroid::files::{OutputFile, Plan, mark};
use gyroid::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};

/// Fit the calibration of the diagnosis to cases whose truth is known
///
/// With --answers temperature and prior odds are those that ship, and only the doubt is fitted: how often whole answers,
/// which heard the recording held out, are wrong whatever their evidence. Else it diagnoses every case
/// without calibration, unseals the labels, and finds the temperature and the prior odds under which
/// the true verdicts are most probable. What it reports is cross-validated: each tenth of the cases is judged by the
/// calibration of the others. Cases that were calibrated on prove nothing afterwards: score on others.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  \
    gyroid gap bench make learn/ --cases 500 --seed 11\n  \
    gyroid gap bench calibrate learn/ -o calibration.toml")]
pub(super) struct CalibrateArgs {
    /// Folders with cases
    #[arg(value_name = "DIR", required = true)]
    folders: Vec<PathBuf>,
    /// Key to the labels of each folder, in their order [default: DIR.key beside each]
    #[arg(long, value_name = "FILE")]
    key: Vec<PathBuf>,
    /// Answers of this version to each folder's cases, in their order (gyroid gap bench run); drives only
    #[arg(long, value_name = "DIR")]
    answers: Vec<PathBuf>,
    /// File to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Cases at a time [default: one a core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    #[command(flatten)]
    common: Common,
}

fn made_by(folder: &Path) -> Result<bench::Bench> {
    let path = folder.join(bench::BENCH);
    let text = std::fs::read_to_string(&path).map_err(|e| Error::io(&path, &e))?;
    serde_json::from_str(&text).map_err(|e| {
        Error::new(ErrorKind::Config, path.display(), format!("does not describe a bench: {e}"))
            .hint("take the file that gyroid gap bench make wrote into this folder")
    })
}

pub(super) fn run(args: &CalibrateArgs) -> Result<Outcome> {
    let plan =
        Plan::new().reads(&args.folders).reads(&args.key).reads(&args.answers).writes("--output", [&args.output]);
    let output = Output::open(&args.common, "gap.bench.calibrate", plan)?;
    if !args.key.is_empty() && args.key.len() != args.folders.len() {
        let found = format!("{} keys for {} folders", args.key.len(), args.folders.len());
        return Err(Error::new(ErrorKind::Usage, "gap bench calibrate", found).at("--key").hint("give one for each"));
    }
    if !args.answers.is_empty() && args.answers.len() != args.folders.len() {
        let found = format!("answers to {} of {} folders", args.answers.len(), args.folders.len());
        return Err(Error::new(ErrorKind::Usage, "gap bench calibrate", found)
            .at("--answers")
            .hint("give one for each"));
    }
    let mut file = OutputFile::claim(&args.output)?;
    let working = output.working("diagnosing");
    let (mut examples, mut judged, mut provenance) = (Vec::new(), Vec::new(), Vec::new());
    for (i, folder) in args.folders.iter().enumerate() {
        let key = args.key.get(i).cloned().unwrap_or_else(|| beside(folder));
        let labels = bench::labels(folder, &SealKey::read(&key)?, None)?.labels;
        if let Some(answers) = args.answers.get(i) {
            judged.extend(bench::judged(&labels, &bench::answers(answers, &labels)?));
        } else {
            let show = working.counter(format!("{}: case", folder.display()));
            examples.extend(bench::examples(folder, &labels, args.jobs.unwrap_or(0).into(), show)?);
        }
        provenance.push(made_by(folder)?);
    }
    drop(working);
    let kind = provenance.first().map(|b| b.kind).unwrap_or_default();
    if provenance.iter().any(|b| b.kind != kind) {
        let found = "cases at rest and drives together";
        return Err(Error::new(ErrorKind::Usage, "gap bench calibrate", found).hint("calibrate each kind for itself"));
    }
    let by_answers = !args.answers.is_empty();
    let found = match (by_answers, kind) {
        (false, _) => bench::calibrate(&examples, &bench::prior_of(kind))?,
        (true, Kind::Driving) => bench::doubt(&judged)?,
        (true, Kind::Stationary) => {
            let found = "the doubt at rest follows how divided the candidates are, which answers do not hold";
            let error = Error::new(ErrorKind::Usage, "gap bench calibrate", found).at("--answers");
            return Err(error.hint("leave --answers out"));
        }
    };
    file.write_all(text(&found, &provenance, by_answers).as_bytes())?;
    file.commit()?;
    output.say(format!("{} cases, calibration in {}", found.cases, args.output.display()));
    for (name, fit) in [("before", &found.before), ("cross-validated", &found.cross_validated)] {
        output.say(format!("{name:16} {}", words(fit)));
    }
    output.finish(&serde_json::json!(found))?;
    Ok(Outcome::Done)
}

fn words(fit: &Fit) -> String {
    format!(
        "right {:.3}, calibration error {:.3} (a perfect method's 95th percentile: {:.3}), -ln p(truth) {:.3} nats a case",
        fit.accuracy, fit.ece, fit.ece_perfect_p95, fit.ln_loss
    )
}

fn text(found: &Calibrated, made: &[bench::Bench], by_answers: bool) -> String {
    let c = &found.calibration;
    let driving = made.iter().any(|b| b.kind == Kind::Driving);
    let kind = if driving { " --kind driving" } else { "" };
    let mut text = format!(
        "# Calibration of the diagnosis {}, fitted to {} cases, {}:\n",
        if driving { "of drives" } else { "at rest" },
        found.cases,
        mark::text()
    );
    for bench in made {
        let seed = bench.seed.map_or_else(String::new, |s| format!(" --seed {s}"));
        let m = &bench.mix;
        text += &format!(
            "#   gyroid gap bench make learn/{kind} --cases {}{seed} --none {} --pairs {} --unlisted {} --messy {} --habits {}\n",
            m.cases, m.none, m.pairs, m.unlisted, m.messy, m.habits
        );
    }
    text += match by_answers {
        true => {
            "#   gyroid gap bench calibrate learn/ --answers answers/ -o calibration.toml (the doubt; the rest as before)\n"
        }
        false => "#   gyroid gap bench calibrate learn/ -o calibration.toml\n",
    };
    for (name, fit) in [("before", &found.before), ("cross-validated", &found.cross_validated)] {
        text += &format!("# {name}: {}\n", words(fit));
    }
    text += &format!(
        "[calibration]\ntemperature = {:.4}\nln_effect = [{:.4}, {:.4}]\nln_free = [{:.4}, {:.4}]\ndoubt = [{:.4}, {:.4}]\n",
        c.temperature, c.ln_effect[0], c.ln_effect[1], c.ln_free[0], c.ln_free[1], c.doubt[0], c.doubt[1]
    );
    text += &c.doubt_unknown.map_or_else(String::new, |doubt| format!("doubt_unknown = {doubt:.4}\n"));
    text
}
