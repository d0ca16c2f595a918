//! min { u : named(u) }  of one log, whose noise stays the same at every size

/// Ratio of the sizes between which the threshold is told.
const CLOSE: f64 = 1.15;
/// Where a gap shows and the effect is not named at sizes so many times as large either, it is not named at larger ones.
const PATIENT: f64 = 32.0;
/// Most steps away from the first size.
const STEPS: usize = 16;

/// Answer of the diagnosis to a log with the effect of one size.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Said {
    /// Whether it names the effect.
    pub named: bool,
    /// The effect that it names, or its verdict.
    pub answer: String,
    /// Evidence of the effect, nats; none where it is not named.
    pub nats: Option<f64>,
}

/// The size from which on one log is named.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Threshold {
    /// This size, and the evidence at the smallest size that was named, nats.
    At(f64, Option<f64>),
    /// None up to the largest: what was said there.
    Never(String),
}

/// Looks for the threshold from `start` on by factors of `step`, up to `most`. `none`: what is said of a log without a gap.
pub(super) fn threshold(start: f64, step: f64, most: f64, none: &str, mut say: impl FnMut(f64) -> Said) -> Threshold {
    let (mut low, mut high): (Option<f64>, Option<(f64, Option<f64>)>) = (None, None);
    let mut u = start.min(most);
    // the first size that shows a gap
    let mut seen = f64::INFINITY;
    for _ in 0..STEPS {
        let said = say(u);
        if said.named {
            high = Some((u, said.nats));
        } else {
            low = Some(u);
            if said.answer != none {
                seen = seen.min(u);
            }
            if high.is_none() && (u >= most || u >= PATIENT * seen) {
                return Threshold::Never(said.answer);
            }
        }
        match (low, high) {
            (Some(_), Some(_)) => break,
            (None, _) => u /= step,
            (_, None) => u = (u * step).min(most),
        }
    }
    let Some((mut high, mut nats)) = high else { return Threshold::Never(none.into()) };
    let Some(mut low) = low else { return Threshold::At(high, nats) };
    while high / low > CLOSE {
        let middle = (low * high).sqrt();
        let said = say(middle);
        if said.named {
            (high, nats) = (middle, said.nats);
        } else {
            low = middle;
        }
    }
    Threshold::At((low * high).sqrt(), nats)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(named: bool, answer: &str) -> Said {
        Said { named, answer: answer.into(), nats: named.then_some(7.0) }
    }

    #[test]
    fn the_threshold_is_found_from_below_and_from_above() {
        for start in [0.01, 0.5, 3.0, 40.0] {
            let mut asked = 0;
            let found = threshold(start, 2.0, 100.0, "none", |u| {
                asked += 1;
                said(u >= 0.7, if u >= 0.7 { "it" } else { "none" })
            });
            let Threshold::At(at, nats) = found else { panic!("{found:?}") };
            assert!((at / 0.7).ln().abs() < CLOSE.ln() && nats == Some(7.0), "{start}: {at}");
            assert!(asked <= 14, "{start}: {asked}");
        }
    }

    #[test]
    fn what_is_taken_for_another_has_none() {
        let mut asked = 0;
        let found = threshold(1.0, 2.0, 1e6, "none", |u| {
            asked += 1;
            said(false, if u > 3.0 { "another" } else { "none" })
        });
        assert_eq!(found, Threshold::Never("another".into()));
        assert!(asked <= STEPS);
        // nor has one beyond its bounds
        let found = threshold(1.0, 2.0, 3.0, "none", |u| said(u > 3.0, "none"));
        assert_eq!(found, Threshold::Never("none".into()));
    }

    #[test]
    fn what_is_named_however_small_is_told_at_the_smallest_that_was_tried() {
        let found = threshold(1.0, 2.0, 10.0, "none", |_| said(true, "it"));
        assert_eq!(found, Threshold::At(2f64.powi(1 - STEPS as i32), Some(7.0)));
    }
}
