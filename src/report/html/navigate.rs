//! The page of a drive over which filters ran.

use super::document::{Document, Origin, Table, Tone};
use crate::error::Result;
use crate::navigate::{ReferenceErrors, Summary};
use crate::report::numbers::significant;
use crate::report::plot::{Panel, Picture};
use crate::units::{RAD_S_PER_DEG_S, duration_text};

/// Filters that ran over a drive.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DrivePage<'a> {
    /// Names of the logs.
    pub logs: &'a str,
    /// Estimators by name, the one that is judged first: errors where there is a reference, summaries of filters.
    pub rows: &'a [(&'a str, Option<&'a ReferenceErrors>, Option<&'a Summary>)],
    /// Summary of the filter that is judged.
    pub judged: &'a Summary,
    /// Paths, and errors where there is a reference.
    pub picture: &'a Picture,
    /// The page for a terminal.
    pub text: &'a str,
    /// Notes on reading the logs.
    pub notes: &'a [String],
}

/// The page of a drive.
///
/// # Errors
/// [`crate::ErrorKind::Value`] if a number cannot be shown.
pub(crate) fn drive_page(drive: &DrivePage, origin: &Origin) -> Result<String> {
    let c = &drive.judged.consistency;
    let reference = drive.rows.first().and_then(|r| r.1);
    let heading = |r: &ReferenceErrors| r.heading_rms_rad.map(|rad| rad / RAD_S_PER_DEG_S);
    let errs = match reference {
        Some(r) => {
            let turn = heading(r).map(|deg| format!(" and {}° in heading", significant(deg, 3))).unwrap_or_default();
            format!("it errs by {} m rms{turn}", significant(r.position_rms_m, 3))
        }
        None => "there is no reference to compare with".into(),
    };
    let outside: Vec<&str> = c.sensors.iter().filter(|s| !s.fit_for_use).map(|s| s.sensor).collect();
    let verdict = match c.fit_for_use {
        true => format!("FIT FOR USE: {errs}, and its readings lie as far from what it expects as its model says"),
        false => format!("NOT FIT FOR USE: {errs}; {} lie not as its model says", outside.join(", ")),
    };
    let tone = if c.fit_for_use { Tone::Good } else { Tone::Bad };
    let of = format!("{}: {} rows, {}", drive.logs, drive.judged.rows, duration_text(drive.judged.span_s));
    let mut page = Document::new(&format!("Drive {}", drive.logs), tone, &verdict, &of);
    let [low, high] = c.nis_mean_bounds95;
    let mut cards = vec![[
        "mean NIS".to_string(),
        significant(c.nis_mean, 3),
        format!("1 is consistent; 95 %: {} to {}", significant(low, 3), significant(high, 3)),
    ]];
    if let Some(r) = reference {
        let end = format!("{} m at the end", significant(r.position_end_m, 3));
        cards.insert(0, ["position, rms".into(), format!("{} m", significant(r.position_rms_m, 3)), end]);
        if let Some(deg) = heading(r) {
            let end =
                r.heading_end_rad.map(|rad| format!("{}° at the end", significant(rad.abs() / RAD_S_PER_DEG_S, 3)));
            cards.insert(1, ["heading, rms".into(), format!("{}°", significant(deg, 3)), end.unwrap_or_default()]);
        }
    }
    page.numbers(cards);
    for panel in &drive.picture.panels {
        let (title, good) = match panel {
            Panel::Chart(chart) if chart.equal => (
                "Paths",
                "the first line lies on the reference from start to end; without a reference, it closes where the robot came back.",
            ),
            _ => (
                "Errors over time",
                "the error of the first line stays within its own ±2σ band, below those of the others.",
            ),
        };
        page.figure(panel.clone().titled(title), good);
    }
    page.table(&errors(drive));

    page.section("What else is there: the sensors");
    let mut sensors =
        Table::new(["sensor", "readings", "mean NIS", "99.9 % bounds", "inside 95 %", "mean, std", "lag 1", "verdict"]);
    for s in &c.sensors {
        let [low, high] = s.nis_mean_bounds999.map(|v| significant(v, 3));
        sensors.row([
            s.sensor.to_string(),
            s.readings.to_string(),
            significant(s.nis_mean, 3),
            format!("{low} to {high}"),
            format!("{:.1} %", 100.0 * s.inside95),
            significant(s.mean, 2),
            significant(s.lag1_autocorrelation, 2),
            if s.fit_for_use { "as modelled" } else { "not as modelled" }.to_string(),
        ]);
    }
    page.table(&sensors);

    page.section("What is left");
    let words = [
        (c.nis_holds, "the mean NIS lies inside its bounds", "the mean NIS lies outside its bounds"),
        (c.unbiased, "innovations have no mean", "innovations have a mean that is not zero: something is biased"),
        (c.white, "innovations are white", "innovations are not white: something has a course that no state follows"),
    ];
    page.list(words.map(|(holds, yes, no)| if holds { yes } else { no }));

    page.section("What cannot be told");
    if reference.is_none() {
        page.paragraph("The log has no reference pose: errors are not known.");
    }
    page.list(drive.notes.iter().chain(&drive.judged.notes));
    page.folded("The same as text", drive.text);
    page.finish(origin)
}

fn errors(drive: &DrivePage) -> Table {
    let mut table = Table::new([
        "",
        "heading rms, °",
        "heading at the end, °",
        "position rms, m",
        "position at the end, m",
        "mean NIS",
    ]);
    for (name, reference, summary) in drive.rows {
        let degrees = |rad: Option<f64>| rad.map_or_else(|| "–".into(), |v| significant(v.abs() / RAD_S_PER_DEG_S, 3));
        let metres = |m: Option<f64>| m.map_or_else(|| "–".into(), |v| significant(v, 3));
        table.row([
            (*name).to_string(),
            degrees(reference.and_then(|r| r.heading_rms_rad)),
            degrees(reference.and_then(|r| r.heading_end_rad)),
            metres(reference.map(|r| r.position_rms_m)),
            metres(reference.map(|r| r.position_end_m)),
            summary.map_or_else(|| "–".into(), |s| significant(s.consistency.nis_mean, 3)),
        ]);
    }
    table
}
