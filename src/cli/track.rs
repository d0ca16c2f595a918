//! `gyroid track`: units over months.

use super::html::{self, HtmlArgs};
use super::outcome::Outcome;
use super::output::{Common, Output};
use super::units::{self, UnitArgs};
use clap::Args;
use gyroid::files::Plan;
use gyroid::population::{self, Row};
use gyroid::report::TrackReport;
use gyroid::report::html::track_page;
use gyroid::{Error, ErrorKind, Result};
use regex::Regex;
use std::path::PathBuf;

/// Holds the last power-on of each unit against its earlier ones: is C1, C2, T or the noise where the unit's history puts it?
///
/// The power-ons are the rows of `gyroid fit --results`, in the order of their dates, else of their paths. From three earlier power-ons
/// on a unit is judged; how much units differ from one power-on to the next is learnt from all of them. A power-on that was outside
/// in its time is no history. A unit that is as ever is told to have changed at most once in --per-year power-ons.
///
/// Then it says how much of the differences is between power-ons, months of a unit, units and types, and how much comes with temperature;
/// and which units do not belong to their type. Power-ons that were outside do not count there.
///
/// Exit code 3: a unit changed.
#[derive(Debug, Args)]
pub(crate) struct TrackArgs {
    /// Results of `gyroid fit`, .parquet or .csv
    #[arg(value_name = "RESULTS", required = true)]
    results: Vec<PathBuf>,
    #[command(flatten)]
    unit: UnitArgs,
    /// Regular expression that finds the type of the robot, or of its gyro, in the path of a log, as --unit does
    #[arg(long = "type", value_name = "REGEX", value_parser = units::pattern)]
    kind: Option<Regex>,
    /// Power-ons of a unit in a year: so many may raise one false alarm
    #[arg(long, value_name = "N", default_value_t = 365.0, value_parser = at_least_one)]
    per_year: f64,
    #[command(flatten)]
    page: HtmlArgs,
    #[command(flatten)]
    common: Common,
}

fn at_least_one(text: &str) -> std::result::Result<f64, String> {
    text.parse()
        .ok()
        .filter(|n: &f64| n.is_finite() && *n >= 1.0)
        .ok_or_else(|| format!("{text:?} is no number from 1 on"))
}

pub(crate) fn run(args: &TrackArgs) -> Result<Outcome> {
    let output = Output::open(&args.common, "track", args.page.planned(Plan::new().reads(&args.results)))?;
    let page = args.page.claim()?;
    let origin = page.as_ref().map(|_| html::origin(&args.results)).transpose()?;
    let rows = population::read_merged::<Row>(&args.results)?.rows;
    let unit = |row: &Row| units::of(&args.unit, &row.source.path);
    let kind = |row: &Row| args.kind.as_ref().and_then(|regex| units::found(regex, &row.source.path));
    let without_unit = rows.iter().filter(|row| unit(row).is_none()).count();
    let no_type = args.kind.is_some() && rows.iter().all(|row| kind(row).is_none());
    for (option, misses) in [("--unit", without_unit == rows.len()), ("--type", no_type)] {
        if misses {
            let first =
                rows.first().map_or("there are no rows".into(), |r| format!("it finds nothing in {}", r.source.path));
            let hint = "try it on the paths that `gyroid fit --results` wrote";
            return Err(Error::new(ErrorKind::Usage, option, first).hint(hint));
        }
    }
    let (gyros, fleet) = population::track(&rows, &unit, &kind, args.per_year);
    let report = TrackReport { gyros, fleet, per_year: args.per_year, without_unit };
    output.say(report.text().trim_end());
    if let (Some(file), Some(origin)) = (page, origin) {
        html::write(file, &track_page(&report, &origin)?, &output)?;
    }
    output.finish(&report.json())?;
    Ok(if report.changed().next().is_some() { Outcome::Unfit } else { Outcome::Done })
}
