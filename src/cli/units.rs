//! The robot that a log is of: by its path.

use clap::Args;
use regex::Regex;
use std::path::Path;

/// How the robot is found.
#[derive(Debug, Clone, Args)]
pub(crate) struct UnitArgs {
    /// Regular expression that finds the unit in the path of a log, its first group if it has one [default: the folder of the log]
    #[arg(long, value_name = "REGEX", value_parser = pattern)]
    unit: Option<Regex>,
}

/// A regular expression, or why it is none.
pub(super) fn pattern(text: &str) -> Result<Regex, String> {
    Regex::new(text)
        .map_err(|e| e.to_string().lines().last().unwrap_or_default().trim_start_matches("error: ").to_string())
}

/// The unit of the log at `path`; none where the expression finds nothing.
pub(crate) fn of(args: &UnitArgs, path: &str) -> Option<String> {
    let Some(regex) = &args.unit else {
        let folder = Path::new(path).parent().map(|p| p.display().to_string());
        return Some(folder.filter(|p| !p.is_empty()).unwrap_or_else(|| ".".into()));
    };
    found(regex, path)
}

/// The part of `path` that `regex` finds: its first group if it has one.
pub(super) fn found(regex: &Regex, path: &str) -> Option<String> {
    regex.captures(path).and_then(|c| c.get(1).or_else(|| c.get(0))).map(|m| m.as_str().to_string())
}
