//! `gyroid noise` of many logs.

use super::many::{Table, refuse_failed, rows_of, settings};
use super::noise_args::{NoiseArgs, options, plan};
use super::outcome::Outcome;
use super::output::Output;
use gyroid::population::{NoiseTerms, analyse_all};
use gyroid::report::NoiseTableReport;
use gyroid::{Error, ErrorKind, Result};
use std::path::PathBuf;

pub(super) fn run(args: &NoiseArgs) -> Result<Outcome> {
    let mut args = args.clone();
    args.many.of_a_part(&mut args.write.out);
    refuse_what_is_for_one(&args)?;
    let many = &args.many;
    let output = Output::open(&args.common, "noise", plan(&args))?;
    let settings = settings(&args.columns, args.axes.or(args.columns.axes()))?;
    let terms = NoiseTerms { options: options(&args)?, level: args.level };
    let beside: Vec<PathBuf> = many.results.iter().chain(&args.common.json).cloned().collect();
    let logs = many.logs(&args.logs, &beside)?;
    let working = output.working("estimating the noise terms");
    let mut table = Table::begin(many, &working, rows_of(&settings, logs.len()), "estimated")?;
    let done = {
        let (known, mut each) = table.parts();
        analyse_all(&logs, &settings, &terms, many.jobs(), known, &mut each)?
    };
    let wrote = table.end(&done.rows)?;
    drop(working);
    let report = NoiseTableReport { rows: done.rows, fitted: done.fitted, resumed: done.resumed };
    output.say(report.text().trim_end());
    if let Some(wrote) = wrote {
        output.say(wrote);
    }
    output.finish(&report.json())?;
    refuse_failed(&report.rows, many.shard, "read")?;
    Ok(if report.failed() == 0 { Outcome::Done } else { Outcome::Unfit })
}

fn refuse_what_is_for_one(args: &NoiseArgs) -> Result<()> {
    let of_one = [
        ("--write", args.write.write.is_some()),
        ("--out", args.write.out.is_some()),
        ("--plot", !args.plot.is_empty()),
        ("--html", args.page.wanted()),
        ("--mcap", args.recording.wanted()),
        ("--datasheet", args.datasheet.is_some()),
    ];
    match of_one.iter().find(|(_, given)| *given) {
        None => Ok(()),
        Some((option, _)) => Err(Error::new(ErrorKind::Usage, option, "is for one log, and this is a table of many")
            .hint("give the log alone; --results FILE holds the table of many")),
    }
}
