//! The score of a bench: who was taken for whom, how far confidence can be believed, how well the unknown is told.

use super::{Axis, Chart, HeatMap, Page, Picture, bad, palette};
use crate::bench::Score;
use crate::error::Result;

/// Names of the pictures of a score, without ending.
pub(crate) const NAMES: [&str; 3] = ["confusion", "reliability", "roc"];

/// The pictures of a score, with their names without ending; those for which there are no answers are left out.
///
/// # Errors
/// [`crate::ErrorKind::Value`] if a number cannot be shown.
pub(crate) fn pictures(score: &Score, title: &str) -> Result<Vec<(&'static str, Picture)>> {
    let mut out = Vec::new();
    if !score.confusion.truths.is_empty() {
        out.push((NAMES[0], confusion(score, title)?));
    }
    if !score.calibration.bins.is_empty() {
        out.push((NAMES[1], reliability(score, title)?));
    }
    if score.unknown_roc.is_some() {
        out.push((NAMES[2], roc(score, title)?));
    }
    Ok(out)
}

/// `gyro.rate_random_walk` is `rate random walk`.
fn short(id: &str) -> String {
    id.strip_prefix("gyro.").unwrap_or(id).replace('_', " ")
}

/// Shares of each truth's cases by answer, with counts where rows say how many they are.
///
/// # Errors
/// [`crate::ErrorKind::Value`] if there is no case.
pub(crate) fn confusion(score: &Score, title: &str) -> Result<Picture> {
    let c = &score.confusion;
    let width = c.answers.len();
    if width == 0 || c.truths.is_empty() {
        return Err(bad("confusion matrix", "holds no case"));
    }
    let totals: Vec<usize> = c.counts.chunks(width).map(|row| row.iter().sum()).collect();
    // columns are too narrow for names: they carry the numbers that the rows explain
    let number = |name: &String| c.answers.iter().position(|a| a == name).map_or(0, |i| i + 1);
    let rows = c.truths.iter().zip(&totals).map(|(t, n)| format!("{} {} ({n})", number(t), short(t)));
    let extra: Vec<String> = c.answers.iter().filter(|a| !c.truths.contains(a)).cloned().collect();
    let columns = (1..=width).map(|i| i.to_string());
    let shares = c.counts.iter().enumerate().map(|(i, n)| match (*n, totals[i / width]) {
        // an empty cell is easier to read than a zero
        (0, _) | (_, 0) => f64::NAN,
        (n, all) => n as f64 / all as f64,
    });
    let map = HeatMap::new(rows, columns, shares.collect())?.labels("What the case holds", "What was answered");
    let mut subtitle =
        "share of each row's cases; cases with one effect, none, or an unlisted one; in brackets how many".to_string();
    if !extra.is_empty() {
        let names: Vec<String> = extra.iter().map(|e| format!("{} {}", number(e), short(e))).collect();
        subtitle = format!("{subtitle}; also answered: {}", names.join(", "));
    }
    let height = 260 + 44 * c.truths.len() as u32;
    Page::new(format!("{title}: what was taken for what"))
        .subtitle(subtitle)
        .size(1500, height.clamp(500, 2000))
        .row([map.into()])
        .draw()
}

/// Share of right answers against confidence, with Wilson's intervals.
///
/// # Errors
/// [`crate::ErrorKind::Value`] if there is no answer with a confidence.
pub(crate) fn reliability(score: &Score, title: &str) -> Result<Picture> {
    let c = &score.calibration;
    let share = |b: &crate::bench::Bin| b.rate.rate.unwrap_or(f64::NAN);
    let bars = c.bins.iter().filter_map(|b| {
        let [low, high] = b.rate.ci95?;
        Some([b.confidence, low, high])
    });
    let chart = Chart::new(
        Axis::linear("Confidence, mean of the bin", "").limits(0.0, 1.0),
        Axis::linear("Share that is right", "").limits(0.0, 1.0),
    )
    .line("as believed", [[0.0, 0.0], [1.0, 1.0]], palette::GREY.stroke(1.5).dashed())
    .bars("95 % interval", bars, palette::BLUE.tint(0.6).stroke(3.0))
    .dots("answers in ten bins", c.bins.iter().map(|b| [b.confidence, share(b)]), palette::BLUE, 6.0);
    let shown = |x: Option<f64>| x.map_or_else(|| "unknown".into(), |x| format!("{x:.3}"));
    let subtitle = format!(
        "calibration error (ECE) {} over {} answers; 95 % of perfectly calibrated methods stay below {}",
        shown(c.ece),
        c.of,
        shown(c.ece_perfect_p95)
    );
    Page::new(format!("{title}: how far confidence can be believed"))
        .subtitle(subtitle)
        .size(900, 900)
        .row([chart.into()])
        .draw()
}

/// The probability of 'unknown' as a detector of unlisted effects.
///
/// # Errors
/// [`crate::ErrorKind::Value`] if the bench has not both cases with and without an unlisted effect.
pub(crate) fn roc(score: &Score, title: &str) -> Result<Picture> {
    let Some(roc) = &score.unknown_roc else {
        return Err(bad("ROC", "needs cases with and without an unlisted effect"));
    };
    let chart = Chart::new(
        Axis::linear("Share of other cases above the threshold", "").limits(0.0, 1.0),
        Axis::linear("Share of unlisted effects above the threshold", "").limits(0.0, 1.0),
    )
    .line("by chance", [[0.0, 0.0], [1.0, 1.0]], palette::GREY.stroke(1.5).dashed())
    .line("by the probability of 'unknown'", roc.points.iter().copied(), palette::BLUE.stroke(2.5));
    let [low, high] = roc.area_ci95;
    Page::new(format!("{title}: telling unlisted effects"))
        .subtitle(format!("area under the curve {:.3} (95 %: {low:.3} to {high:.3})", roc.area))
        .size(900, 900)
        .row([chart.into()])
        .draw()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench;

    #[test]
    fn pictures_show_every_truth_and_the_numbers_of_the_score() {
        let labels = serde_json::from_str(include_str!("../../bench/fixture/labels.json")).unwrap();
        let answers = serde_json::from_str(include_str!("../../bench/fixture/answers.json")).unwrap();
        let score = bench::score(&labels, &answers, &[]);
        let pictures = pictures(&score, "fixture").unwrap();
        let svg = |i: usize| pictures[i].1.svg().unwrap();
        assert_eq!(pictures.iter().map(|p| p.0).collect::<Vec<_>>(), ["confusion", "reliability", "roc"]);
        for truth in ["quantization (1)", "missed ticks", "none (2)", "unknown (2)"] {
            assert!(svg(0).contains(truth), "{truth}");
        }
        assert!(svg(1).contains("0.268"));
        assert!(svg(2).contains(&format!("{:.3}", score.unknown_roc.unwrap().area)));

        let empty = bench::score(&Default::default(), &Default::default(), &[]);
        assert!(super::pictures(&empty, "nothing").unwrap().is_empty());
        assert!(confusion(&empty, "nothing").is_err() && roc(&empty, "nothing").is_err());
    }
}
