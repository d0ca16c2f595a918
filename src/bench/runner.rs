//! answers[case] = diagnosis(sim.toml, fit, hold), for every case that has no answer yet
//!
//! Answers are written whole or not at all, so that an interrupted run continues where it stopped. Beside each answer
//! lies `CASE.seconds`, and `timings.json` gathers them.

use super::folder::{names, put, recording};
use super::workers::each;
use crate::config::Config;
use crate::error::{Error, ErrorKind, Result};
use crate::gap::Answer;
use crate::signal::Log;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;
use std::time::Instant;

/// A diagnosis: nominal simulator, fit recording, hold-out recording.
pub(crate) trait Diagnosis: Sync {
    /// Diagnoses one case.
    ///
    /// # Errors
    /// Errors of the diagnosis; the case then stays without an answer.
    fn diagnose(&self, config: &Config, fit: &Log, hold: Option<&Log>) -> Result<Answer>;
}

impl<F: Fn(&Config, &Log, Option<&Log>) -> Result<Answer> + Sync> Diagnosis for F {
    fn diagnose(&self, config: &Config, fit: &Log, hold: Option<&Log>) -> Result<Answer> {
        self(config, fit, hold)
    }
}

/// How long one case took.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Timing {
    /// Wall time of the diagnosis without reading and writing, s.
    pub seconds: f64,
}

/// Summary of a run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ran {
    /// Cases that were answered now.
    pub answered: usize,
    /// Cases that had an answer before.
    pub there: usize,
    /// Cases that the diagnosis refused, and why.
    pub refused: Vec<(String, Error)>,
}

/// Runs `diagnosis` over the cases of `folder`, `jobs` at a time (0: one a core); `progress` is called with (done,
/// all).
///
/// # Errors
/// [`ErrorKind::Io`], [`ErrorKind::Usage`] for a folder without cases. What the diagnosis refuses is in the result.
pub(crate) fn run(
    folder: &Path,
    answers: &Path,
    jobs: usize,
    diagnosis: &impl Diagnosis,
    progress: impl Fn(usize, usize) + Sync,
) -> Result<Ran> {
    let all = names(folder)?;
    std::fs::create_dir_all(answers).map_err(|e| Error::io(answers, &e))?;
    let open: Vec<&String> = all.iter().filter(|n| !answers.join(format!("{n}.json")).is_file()).collect();
    let there = all.len() - open.len();
    let refused = Mutex::new(Vec::new());
    let one = |name: &str| -> Result<()> {
        match answer(&folder.join(name), diagnosis) {
            Ok((answer, seconds)) => {
                let text = serde_json::to_string_pretty(&answer)
                    .map_err(|e| Error::new(ErrorKind::Numeric, name, format!("the answer is no JSON: {e}")))?;
                // the time first: every answer has its time beside it
                put(&answers.join(format!("{name}.seconds")), format!("{seconds:.4}\n").as_bytes())?;
                put(&answers.join(format!("{name}.json")), format!("{text}\n").as_bytes())?;
            }
            // one case that cannot be diagnosed must not cost the answers to the others
            Err(error) => refused.lock().unwrap_or_else(|e| e.into_inner()).push((name.to_owned(), error)),
        }
        Ok(())
    };
    each(&open, jobs, progress, |_, name| one(name))?;
    let mut refused = refused.into_inner().unwrap_or_else(|e| e.into_inner());
    refused.sort_by(|a, b| a.0.cmp(&b.0));
    timings(answers, &all)?;
    Ok(Ran { answered: open.len() - refused.len(), there, refused })
}

/// Nominal simulator, fit recording and hold-out recording of the case in this folder.
pub(super) fn case_logs(case: &Path) -> Result<(Config, Log, Option<Log>)> {
    let config = Config::read(case.join("sim.toml"))?;
    let fit = recording(case, "fit")?.ok_or_else(|| {
        Error::new(ErrorKind::Usage, case.display(), "holds no recording to diagnose from")
            .hint("a case has fit.parquet, fit.csv, or a file a sensor such as fit_imu.csv")
    })?;
    Ok((config, fit, recording(case, "hold")?))
}

fn answer(case: &Path, diagnosis: &impl Diagnosis) -> Result<(Answer, f64)> {
    let (config, fit, hold) = case_logs(case)?;
    let begin = Instant::now();
    let answer = diagnosis.diagnose(&config, &fit, hold.as_ref())?;
    Ok((answer, begin.elapsed().as_secs_f64()))
}

/// Gathers the times of all answers.
fn timings(answers: &Path, names: &[String]) -> Result<()> {
    let mut all = BTreeMap::new();
    for name in names {
        if let Ok(text) = std::fs::read_to_string(answers.join(format!("{name}.seconds")))
            && let Ok(seconds) = text.trim().parse()
        {
            all.insert(name, Timing { seconds });
        }
    }
    put(&answers.join("timings.json"), format!("{:#}\n", serde_json::json!(all)).as_bytes())
}
