//! `--load FILE=KG`: what the robot carried in a drive.

use clap::Args;
use gyroid::config::{Config, Kind};
use gyroid::error::one_of;
use gyroid::signal::Log;
use gyroid::{Error, ErrorKind, Result};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct LoadArgs {
    /// Of a drive: known load that the robot carried in it, kg, weighed and fixed at the robot's centre of mass; FILE is a file of the
    /// drive as it is named elsewhere in the command. Given again, that of another drive
    #[arg(long, value_name = "FILE=KG")]
    load: Vec<String>,
}

impl LoadArgs {
    /// The robot of `config` with its load in the one drive of `files`.
    ///
    /// # Errors
    /// As [`Self::of_drives`].
    pub(super) fn carried(&self, config: Config, files: &[PathBuf]) -> Result<Config> {
        let load_kg = self.of_drives(&[files], config.kind == Kind::Stationary)?[0];
        Ok(config.carrying(load_kg))
    }

    /// Load in each of `drives`, which are named by their files, kg.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] for a file of none of them, a second load of one, a load that is no mass, and one `at_rest`.
    pub(super) fn of_drives(&self, drives: &[&[PathBuf]], at_rest: bool) -> Result<Vec<f64>> {
        let refused = |found: String| Error::new(ErrorKind::Usage, "--load", found);
        if at_rest && !self.load.is_empty() {
            return Err(
                refused("a robot carries a load, and this is of a gyro at rest".into()).hint("leave --load out")
            );
        }
        let mut loads_kg: Vec<Option<f64>> = vec![None; drives.len()];
        for given in &self.load {
            let Some((file, load)) = given.rsplit_once('=') else {
                return Err(refused(format!("{given:?} tells no load")).hint("give a file and its load: FILE=KG"));
            };
            let Some(load_kg) = load.parse::<f64>().ok().filter(|kg| kg.is_finite() && *kg >= 0.0) else {
                return Err(refused(format!("{load:?} of {file} is no mass"))
                    .hint("give the weighed load in kg, zero or more: run.csv=2.5"));
            };
            let named = |path: &PathBuf| path.display().to_string() == file;
            let Some(place) = drives.iter().position(|files| files.iter().any(named)) else {
                let known: Vec<String> = drives.iter().copied().flatten().map(|p| p.display().to_string()).collect();
                let known: Vec<&str> = known.iter().map(String::as_str).collect();
                return Err(refused(format!("{file:?} is no file of a drive")).hint(one_of(file, &known)));
            };
            if loads_kg[place].replace(load_kg).is_some() {
                return Err(refused(format!("the drive of {file} has two loads")).hint("give their sum once"));
            }
        }
        Ok(loads_kg.into_iter().map(Option::unwrap_or_default).collect())
    }
}

/// The first log without a load: the user's simulator carries none.
pub(super) fn bare<'a>(logs: &'a [Log], loads_kg: &[f64]) -> Option<&'a Log> {
    logs.iter().zip(loads_kg).find(|(_, load_kg)| **load_kg == 0.0).map(|(log, _)| log)
}
