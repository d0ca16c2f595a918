//! The page of a study.

use super::document::{Document, Origin, Table, Tone};
use crate::error::Result;
use crate::report::numbers::significant;
use crate::report::study::StudyReport;
use crate::study::Estimator;
use crate::units::RAD_S_PER_DEG_S;

/// Sentence on a good figure, by the beginning of its name.
const GOOD: [(&str, &str); 10] = [
    ("figure_2", "no more than one lag in twenty leaves the bounds: the identified error model leaves white noise."),
    ("figure_3", "the line with slip lies lowest, and rises slowest."),
    ("figure_4", "the line with slip lies lowest, and rises slowest."),
    ("figure_", "the filter with slip lies on the true line."),
    (
        "nees",
        "the line scatters inside the band: the filter is as sure as it should be; above the band it is too sure.",
    ),
    ("error_model", "lines with the gyro's error model lie below those without."),
    ("slip", "the estimate follows the true slip inside its band."),
    ("convergence", "lines are level and bands narrow at the right end: more runs would change nothing."),
    ("friction", "the filter with slip errs least on every ground."),
    ("sensitivity", "the factor stays above 1 for beliefs that are a little wrong: the slip model pays all the same."),
];

/// The page of `report`.
///
/// # Errors
/// [`crate::ErrorKind::Value`] if an error of a filter is not finite.
pub(crate) fn study_page(report: &StudyReport, origin: &Origin) -> Result<String> {
    let all = report.comparisons();
    let main = all.iter().find(|c| c.0 == "slip_against_rolling");
    let (verdict, tone) = match main {
        Some((_, _, c)) => {
            let better = c.factor_ci95.iter().all(|ci| ci[0] > 1.0);
            let worse = c.factor_ci95.iter().all(|ci| ci[1] < 1.0);
            let head = if better {
                "THE SLIP MODEL PAYS"
            } else if worse {
                "THE SLIP MODEL COSTS"
            } else {
                "THE SLIP MODEL PAYS IN PART"
            };
            let [x, y, heading] = c.factor.map(|f| significant(f, 3));
            let text = format!(
                "{head}: errors without it are {x} times as large in x, {y} times in y, {heading} times in heading"
            );
            (text, if better { Tone::Good } else { Tone::Open })
        }
        None => ("STUDIED: the filters with and without slip did not both run".into(), Tone::Open),
    };
    let of = format!("{}: {}", report.robot, report.heading());
    let mut page = Document::new("Study of filters with and without slip", tone, &verdict, &of);
    let cards = report.study.of(Estimator::Slip).into_iter().flat_map(|e| {
        let [x, y, heading] = e.rms;
        [
            ["x, rms, with slip".to_string(), format!("{} m", significant(x, 3)), String::new()],
            ["y, rms, with slip".into(), format!("{} m", significant(y, 3)), String::new()],
            [
                "heading, rms, with slip".into(),
                format!("{}°", significant(heading / RAD_S_PER_DEG_S, 3)),
                String::new(),
            ],
        ]
    });
    page.numbers(cards);
    let mut errors = Table::new(["root mean square error", "x, m", "y, m", "heading, °", "NEES", "inside 95 %", "NIS"]);
    for e in &report.study.estimators {
        let [x, y, heading] = e.rms;
        let nees = e.nees.as_ref();
        errors.row([
            e.estimator.words().to_string(),
            significant(x, 3),
            significant(y, 3),
            significant(heading / RAD_S_PER_DEG_S, 3),
            nees.map_or_else(String::new, |n| significant(n.mean, 3)),
            nees.map_or_else(String::new, |n| format!("{} %", significant(100.0 * n.inside, 3))),
            e.nis_mean.map_or_else(String::new, |n| significant(n, 3)),
        ]);
    }
    page.table(&errors);
    let mut factors = Table::new(["error over error (95 %)", "x", "y", "heading"]);
    for (_, words, c) in &all {
        let cell = |i: usize| {
            let [low, high] = c.factor_ci95[i].map(|v| significant(v, 3));
            format!("{} ({low} to {high})", significant(c.factor[i], 3))
        };
        factors.row([(*words).to_string(), cell(0), cell(1), cell(2)]);
    }
    page.table(&factors);

    page.section("What else is there: the figures");
    for (name, picture) in report.figures()? {
        let good = GOOD.iter().find(|(begin, _)| name.starts_with(begin)).map_or("", |g| g.1);
        let title = picture.title().to_string();
        for panel in picture.panels {
            page.figure(panel.titled(&title), good);
        }
    }

    page.section("What cannot be told");
    page.paragraph(
        "Errors are estimate less truth in simulated runs whose robot is the one of the configuration; a real robot has what no \
         model here has.",
    );
    let mut claims = Table::new(["where in the paper", "what it says", "status", "here"]);
    for c in report.claims() {
        claims.row([c.place.to_string(), c.says.to_string(), c.status.name().to_string(), c.here.clone()]);
    }
    page.folded_table("The paper, row by row", &claims);
    page.folded("The same as text", &report.text());
    page.finish(origin)
}
