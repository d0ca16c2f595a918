//! p = (1 - ε)/(1 - ε₀) p₀,  max over ε of Σ_right ln p + Σ_wrong ln (1 - p):   the doubt that answers call for
//!
//! p₀ is the probability that an answer gives its own verdict, under the doubt ε₀ of the calibration that ships. Answers hear
//! the recording held out, which a calibration of evidences does not: it refutes wrong causes, and what remains is right more
//! often. Verdicts 'identified' and 'unknown' have a doubt each. The same normal prior of ln odds as in
//! [`super::calibrate()`] bounds a doubt that few answers determine.

use super::calibrate::{Calibrated, DOUBT, FOLDS, Fit, SPREAD, fit, too_few};
use super::judge::Judged;
use crate::error::Result;
use crate::gap::answer::calibration::Calibration;
use crate::gap::drive::options::Options;
use crate::math::brent;

/// Range of the ln odds that are searched.
const LN_ODDS: [f64; 2] = [-9.0, 3.0];
/// Accuracy of the ln odds.
const TOLERANCE: f64 = 1e-4;
/// Largest probability of an answer.
const LARGEST: f64 = 1.0 - 1e-9;

/// An answer: index of its verdict, 0 'identified' and 1 'unknown' (none: no gap), the probability that it gives this, and
/// whether it is right.
type Given = (Option<usize>, f64, bool);

fn given(judged: &Judged) -> Option<Given> {
    let of = match judged.answered.as_str() {
        "none" => None,
        "unknown" => Some(1),
        _ => Some(0),
    };
    Some((of, judged.confidence?, judged.right))
}

/// Doubts of both verdicts for `answers` that were given under `shipped`.
fn fitted<'a>(answers: impl Iterator<Item = &'a Given> + Clone, shipped: [f64; 2]) -> [f64; 2] {
    std::array::from_fn(|verdict| {
        let value = |ln_odds: f64| {
            let believed = 1.0 / (1.0 + ln_odds.exp());
            let own = answers.clone().filter(|a| a.0 == Some(verdict));
            let ln = own.map(|(_, p, right)| {
                let p = moved(*p, shipped[verdict], 1.0 - believed);
                if *right { p.ln() } else { (1.0 - p).ln() }
            });
            0.5 * ((ln_odds - DOUBT) / SPREAD).powi(2) - ln.sum::<f64>()
        };
        let least = brent::minimum(value, LN_ODDS[0], LN_ODDS[1], TOLERANCE).map_or(DOUBT, |found| found.x);
        1.0 / (1.0 + (-least).exp())
    })
}

/// Probability of an answer under the doubt `to`, where it is `p` under `from`.
fn moved(p: f64, from: f64, to: f64) -> f64 {
    (p * (1.0 - to) / (1.0 - from)).min(LARGEST)
}

/// The calibration of drives that ships, with the doubts under which the answers `judged`, given under it, are most
/// probable.
///
/// # Errors
/// [`crate::ErrorKind::TooShort`] for fewer than fifty answers.
pub(crate) fn doubt(judged: &[Judged]) -> Result<Calibrated> {
    beside(judged, &Options::default().calibration)
}

/// The same for answers that were given under `shipped`.
fn beside(judged: &[Judged], shipped: &Calibration) -> Result<Calibrated> {
    let answers: Vec<Given> = judged.iter().filter_map(given).collect();
    too_few(answers.len())?;
    let from = [shipped.doubt[0], shipped.doubt_unknown.unwrap_or(shipped.doubt[0])];
    let under = |to: [f64; 2], (of, p, right): &Given| (of.map_or(*p, |of| moved(*p, from[of], to[of])), *right);
    let mut verdicts = Vec::new();
    for fold in 0..FOLDS {
        let inside = |i: usize| i % FOLDS == fold;
        let to = fitted(answers.iter().enumerate().filter(|(i, _)| !inside(*i)).map(|(_, a)| a), from);
        verdicts.extend(answers.iter().enumerate().filter(|(i, _)| inside(*i)).map(|(_, a)| under(to, a)));
    }
    let figures = |verdicts: &[(f64, bool)]| -> Fit {
        let truths: Vec<f64> = verdicts.iter().map(|(p, right)| if *right { *p } else { 1.0 - p }).collect();
        fit(verdicts, &truths)
    };
    let before: Vec<(f64, bool)> = answers.iter().map(|a| under(from, a)).collect();
    let [named, unknown] = fitted(answers.iter(), from);
    Ok(Calibrated {
        calibration: Calibration { doubt: [named; 2], doubt_unknown: Some(unknown), ..*shipped },
        cases: answers.len(),
        before: figures(&before),
        cross_validated: figures(&verdicts),
    })
}

#[cfg(test)]
mod tests {
    use super::super::calibrate::tests::label;
    use super::super::judge::judge;
    use super::*;
    use crate::gap::Prior;
    use crate::math::random::Stream;

    /// Of answers that are right in other shares than they say, the doubt becomes the share of wrong ones.
    #[test]
    fn the_doubt_is_how_often_answers_are_wrong() {
        const ANSWERS: usize = 800;
        let wrong = [0.05, 0.3];
        let shipped = Calibration { doubt: [0.14; 2], ..Calibration::none(&Prior::default()) };
        let mut draw = Stream::new(3, 0);
        let label = label(None);
        let one = |i: usize| Judged {
            answered: ["gyro.tone", "unknown"][i % 2].into(),
            right: draw.uniform() >= wrong[i % 2],
            confidence: Some(0.86),
            ..judge("case", &label, None)
        };
        let judged: Vec<Judged> = (0..ANSWERS).map(one).collect();
        let found = beside(&judged, &shipped).unwrap();
        let of = [found.calibration.doubt[0], found.calibration.doubt_unknown.unwrap()];
        for (found, wrong) in of.into_iter().zip(wrong) {
            // four standard deviations of a share, and what the prior may move it by
            let std = (wrong * (1.0 - wrong) / (0.5 * ANSWERS as f64)).sqrt();
            assert!((found - wrong).abs() < 4.0 * std, "{found} {wrong}");
        }
        assert!(found.cross_validated.ece < found.cross_validated.ece_perfect_p95, "{found:?}");
        // both together were right as often as they said: only the losses tell them apart
        assert!(found.cross_validated.ln_loss < found.before.ln_loss, "{found:?}");
        assert!(beside(&judged[..40], &shipped).is_err());
    }
}
