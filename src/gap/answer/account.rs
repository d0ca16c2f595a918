//! gain = Σ_rows [ln p(row | with the effect) - ln p(row | without it)]
//!
//! Gains in log score, nats, of each effect found, on the recording on which the gap is measured: added first (to the
//! nominal simulator) and added last (to all other effects). From them follow the idle effects, the main effect, the
//! verdict and the remainder of the answer.

use super::gain::Gain;
use super::{Answer, Metric, Place, Remainder, Verdict};
use crate::effects::Parameters;
use crate::error::Result;
use crate::gap::holdout::Closed;
use crate::gap::selection::findings::Findings;
use crate::gap::trace::{Decision, Step, TraceStage};
use crate::math::NORMAL_975;
use rayon::prelude::*;
use statrs::function::erf::erfc;

/// Expected gain below which an effect is idle, nats: a superfluous parameter gains as much by chance.
const LEAST_NATS: f64 = 2.0;
/// Share of the gap above which the named effects explain most of it.
const MOST: f64 = 0.5;

/// Gains of an effect that was found.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tested {
    /// Identifier.
    pub id: String,
    /// Gain over the nominal simulator.
    pub first: Gain,
    /// Gain over the simulator with all other effects that were found.
    pub last: Gain,
    /// Gains of the effect alone on simulated recordings that hold it, nats; empty where `first` or `last` lies above
    /// zero.
    expected_nats: Vec<f64>,
    /// Half the sum of both gains in each row (or block), nats.
    rows: Vec<f64>,
    /// Whether it is read off the numbers of that recording themselves: then no gain speaks against it.
    pub is_read_off: bool,
}

impl Tested {
    /// Mean of the gains added first and added last.
    fn mean(&self) -> Gain {
        Gain::of(&vec![0.0; self.rows.len()], &self.rows)
    }

    /// Whether the measured recording contradicts it: both gains lie below zero beyond chance.
    fn is_refuted(&self) -> bool {
        !self.is_read_off && [self.first, self.last].iter().all(|gain| gain.ci95()[1] < -LEAST_NATS)
    }

    /// Whether it closes no measurable part of the gap: neither gain lies above zero beyond chance, and the gain to be
    /// expected of an effect of the size found is below [`LEAST_NATS`].
    fn is_idle(&self) -> bool {
        let n = self.expected_nats.len() as f64;
        n > 0.0 && self.expected_nats.iter().sum::<f64>() / n < LEAST_NATS
    }
}

/// Gains of each of `effects`. `score`: ln densities by row (or by block) under the nominal simulator with some of
/// them. `expect`: gains of one of them over the nominal simulator on simulated recordings that hold it, nats.
///
/// # Errors
/// Errors of `score` and `expect`.
pub(crate) fn test(
    effects: &[(String, Parameters)],
    score: impl Fn(&[(String, Parameters)]) -> Result<Vec<f64>> + Sync,
    expect: impl Fn(&(String, Parameters)) -> Result<Vec<f64>> + Sync,
) -> Result<Vec<Tested>> {
    if effects.is_empty() {
        return Ok(Vec::new());
    }
    let (none, all) = rayon::join(|| score(&[]), || score(effects));
    let (none, all) = (none?, all?);
    let one = |(i, effect): (usize, &(String, Parameters))| {
        let (alone, without) = if effects.len() == 1 {
            (all.clone(), none.clone())
        } else {
            let mut rest = effects.to_vec();
            rest.remove(i);
            let (alone, without) = rayon::join(|| score(std::slice::from_ref(effect)), || score(&rest));
            (alone?, without?)
        };
        let (first, last) = (alone.iter().zip(&none), all.iter().zip(&without));
        let rows = first.zip(last).map(|((f, n), (a, w))| 0.5 * (f - n + a - w)).collect();
        let (first, last) = (Gain::of(&none, &alone), Gain::of(&without, &all));
        let above = [first, last].iter().any(|gain| gain.ci95()[0] > 0.0);
        let expected_nats = if above { Vec::new() } else { expect(effect)? };
        Ok(Tested { id: effect.0.clone(), first, last, expected_nats, rows, is_read_off: false })
    };
    effects.par_iter().enumerate().map(one).collect()
}

/// Whether the scores `after` are better than those `before` beyond chance.
pub(crate) fn is_better(before: &[f64], after: &[f64]) -> bool {
    Gain::of(before, after).ci95()[0] > 0.0
}

/// Effects of `tested`, the first excepted, whose gain added last is not above zero beyond chance.
pub(crate) fn superfluous(tested: &[Tested]) -> Vec<String> {
    tested.iter().skip(1).filter(|t| t.last.ci95()[0] <= 0.0).map(|t| t.id.clone()).collect()
}

/// Effects of `tested` that the hold-out recording contradicts.
pub(crate) fn refuted(tested: &[Tested]) -> Vec<String> {
    tested.iter().filter(|t| t.is_refuted()).map(|t| t.id.clone()).collect()
}

/// Effects of `tested` that the hold-out recording speaks against, each with its ln evidence there, nats, below zero.
fn against(tested: &[Tested]) -> Vec<(String, f64)> {
    let all = tested.iter().filter(|t| !t.is_read_off).map(|t| (t.id.clone(), t.mean().evidence_nats()));
    all.filter(|t| t.1 < 0.0).collect()
}

/// Effects of `tested` that are present beyond doubt and idle.
fn idle(tested: &[Tested], findings: &Findings) -> Vec<String> {
    let there = |t: &&Tested| findings.is_beyond_doubt(findings.presence(&t.id));
    tested.iter().filter(|t| t.is_idle()).filter(there).map(|t| t.id.clone()).collect()
}

/// Gains of `tested` on the recording on which the gap is measured, as steps of the trail; `refuted` and `idle`: ids of
/// those effects.
fn steps(tested: &[Tested], refuted: &[String], idle: &[String]) -> Vec<Step> {
    let one = |t: &Tested| {
        let (first, last) = (t.first.ci95(), t.last.ci95());
        let gains = if tested.len() == 1 {
            format!("gain in log score ({:.1} to {:.1} nats, 95 %)", first[0], first[1])
        } else {
            format!(
                "mean of the gain in log score when added first ({:.1} to {:.1} nats, 95 %) and last ({:.1} to {:.1})",
                first[0], first[1], last[0], last[1]
            )
        };
        let step = |decision, what: &str| {
            Step::new(TraceStage::HoldOut, &t.id, decision, format!("{gains}{what}")).nats(t.mean().nats)
        };
        if refuted.contains(&t.id) {
            let step = step(Decision::Rejected, ": this recording contradicts it");
            step.limit("upper end of both intervals below which one is contradicted", -LEAST_NATS, "nats")
        } else if idle.contains(&t.id) {
            let step = step(Decision::Removed, ": idle, no gain worth the name is to be expected of it");
            step.limit("least gain to be expected", LEAST_NATS, "nats")
        } else if t.is_read_off {
            step(Decision::Taken, ": read off the numbers of this recording themselves")
        } else if first[0].max(last[0]) > 0.0 {
            step(Decision::Taken, "").limit("lower end of an interval above which one closes something", 0.0, "nats")
        } else {
            let told = t.mean().evidence_nats();
            let what = ": not told from no gain; as evidence beside that of the fit";
            step(Decision::Estimated, &format!("{what} it counts {:.1} nats", told.min(0.0)))
        }
    };
    tested.iter().map(one).collect()
}

/// Changes `findings` by what the recording on which the gap is measured says of the effects `tested`, with the steps of the
/// trail. Those `refuted` leave the sets and `tested`, idle ones are set aside, and where the recording was held out
/// (`is_held_out`) a loss there is evidence against an effect. `led`: whether probabilities changed before.
pub(crate) fn weigh(
    findings: &mut Findings,
    tested: &mut Vec<Tested>,
    refuted: &[String],
    is_held_out: bool,
    led: bool,
) {
    let against = if is_held_out { against(tested) } else { Vec::new() };
    findings.refute(refuted);
    findings.weigh_by(&against);
    let idle = idle(tested, findings);
    findings.set_aside(&idle);
    findings.trace.extend(steps(tested, refuted, &idle));
    if led || [refuted.len(), against.len(), idle.len()] != [0; 3] {
        findings.trace.extend(findings.of_probabilities(TraceStage::HoldOut));
    }
    tested.retain(|t| !refuted.contains(&t.id));
}

/// Writes the measures of all effects together, and the share that each closes alone, into `answer`.
pub(crate) fn measured(answer: &mut Answer, metrics: &[Metric], alone: &[(String, Closed)]) {
    answer.gap = metrics.to_vec();
    for (id, closed) in alone {
        if let Some(effect) = answer.effects.iter_mut().find(|e| e.id == *id) {
            (effect.gap_closed, effect.gap_closed_ci95) = (closed.estimate, closed.ci95);
        }
    }
}

/// Adapts main effect, verdict and remainder of `answer` to the measured gains: `tested` of each effect, `closed` of
/// all effects that are not idle together. `place` gives the place of an effect, with `None` that of the remainder.
pub(crate) fn settle(
    answer: &mut Answer,
    tested: &[Tested],
    closed: Option<&Closed>,
    place: impl Fn(Option<&str>) -> Option<Place>,
) {
    if matches!(answer.verdict, Verdict::None | Verdict::CannotTell) {
        return;
    }
    lead(answer, tested);
    if let Some((closed, estimate, ci95)) = closed.and_then(|c| Some((c, c.estimate?, c.ci95?))) {
        let [low, high] = ci95;
        let std = (0.5 * (high - low) / NORMAL_975).max(f64::MIN_POSITIVE);
        // probability that they close less than half
        let less = 0.5 * erfc((estimate - MOST) / (std * std::f64::consts::SQRT_2));
        let told = format!("{:.0} % of the gap (95 %: {:.0} to {:.0} %)", 100.0 * estimate, 100.0 * low, 100.0 * high);
        let presence = answer.main.as_ref().and_then(|id| answer.effects.iter().find(|e| e.id == *id));
        let presence = presence.map_or(0.0, |e| e.probability);
        if !answer.together.is_empty() {
            let why =
                if closed.paired { ", of the gain that is to be expected of them: a loss alone decides" } else { "" };
            let reason = format!("they close {told}{why}");
            answer.trace.push(Step::new(TraceStage::HoldOut, "all that have a name", Decision::Estimated, reason));
        }
        let read_off = tested.iter().any(|t| t.is_read_off && answer.together.contains(&t.id));
        match answer.verdict {
            // a gap within the scatter of the score of one recording is no proof of another cause
            Verdict::Identified if high < MOST && !closed.paired => {
                let why = format!(
                    "What has a name is there, and closes {told}, less than half: most of it has another cause."
                );
                let step = Step::new(TraceStage::Naming, IDENTIFIED, Decision::Rejected, why);
                unseat(answer, less * presence, step.limit(SHARE, MOST, ""), place(None));
            }
            // whatever the floor: a cause does not make predictions worse
            Verdict::Identified if high < 0.0 && !read_off => {
                let why = format!(
                    "With what has a name the simulator predicts the recording on which the gap is measured worse than without, beyond \
                     chance: they close {told}. The cause is another one."
                );
                let step = Step::new(TraceStage::Naming, IDENTIFIED, Decision::Rejected, why);
                unseat(answer, less, step.limit(SHARE, 0.0, ""), place(None));
            }
            // a paired floor is the expected gain itself: its closed share proves nothing
            Verdict::Unknown if low > MOST && !closed.paired && presence * (1.0 - less) > MOST => {
                answer.verdict = Verdict::Identified;
                answer.unknown_probability = less.max(1.0 - presence).min(1.0 - answer.none_probability);
                let left = 1.0 - answer.none_probability - answer.unknown_probability;
                answer.main_probability = (presence * (1.0 - less)).min(left);
                let why = format!(
                    "In the fit, corrections that are in no simulator had the larger share; measured, what has a name closes {told}, \
                     more than half."
                );
                let step = Step::new(TraceStage::Naming, "the verdict 'unknown'", Decision::Rejected, why.as_str());
                answer.trace.push(step.limit(SHARE, MOST, ""));
                answer.notes.push(why);
                answer.place = place(answer.main.as_deref()).or(answer.place.take());
            }
            _ => {}
        }
    }
    let share = if answer.together.is_empty() { Some(1.0) } else { closed.and_then(|c| c.estimate).map(|c| 1.0 - c) };
    if let Some(share) = share {
        answer.remainder = Some(Remainder { share: share.clamp(0.0, 1.0), place: place(None) });
    }
}

/// Names of the verdict that is withdrawn, and of the limit of [`MOST`], in the trail.
pub(crate) const IDENTIFIED: &str = "the verdict 'identified'";
const SHARE: &str = "share that is most of the gap";

/// Makes the cause of `answer` unknown with this probability, for the reason that `step` tells; `place`: place of the
/// remainder.
pub(crate) fn unseat(answer: &mut Answer, probability: f64, step: Step, place: Option<Place>) {
    answer.verdict = Verdict::Unknown;
    answer.unknown_probability = probability.max(answer.unknown_probability);
    answer.main_probability *= 1.0 - probability;
    answer.notes.push(step.reason.clone());
    answer.trace.push(step);
    answer.place = place.or(answer.place.take());
}

/// Makes the effect that closes most the main one: in place of one that the evidence identified only if it gains more
/// beyond chance; where there is none, only if its gain is above zero beyond chance.
fn lead(answer: &mut Answer, tested: &[Tested]) {
    let there = |t: &&Tested| answer.together.contains(&t.id);
    let best = tested.iter().filter(there).max_by(|a, b| a.mean().nats.total_cmp(&b.mean().nats));
    let Some(best) = best else { return };
    let led = match &answer.main {
        Some(main) if *main == best.id => return,
        Some(main) => {
            let Some(main) = tested.iter().find(|t| t.id == *main) else { return };
            Gain::of(&main.rows, &best.rows).ci95()[0] > 0.0
        }
        None => best.mean().ci95()[0] > 0.0,
    };
    if !led {
        return;
    }
    let reason =
        "closes more on the recording on which the gap is measured than the main effect of the fit, beyond chance";
    answer.trace.push(Step::new(TraceStage::Naming, &best.id, Decision::Taken, reason).nats(best.mean().nats));
    answer.main = Some(best.id.clone());
    if let Some(at) = answer.effects.iter().position(|e| e.id == best.id) {
        let first = answer.effects.remove(at);
        if answer.verdict == Verdict::Identified {
            answer.main_probability = first.probability.min(1.0 - answer.none_probability - answer.unknown_probability);
        }
        answer.effects.insert(0, first);
    }
    answer.together.retain(|id| *id != best.id);
    answer.together.insert(0, best.id.clone());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gap::answer::EffectAnswer;
    use crate::gap::selection::sets::{Part, WeightedSet};
    use crate::math::random::Stream;

    /// ln densities of rows: each effect present adds its mean gain a row, with variance 2 × mean as of a true model.
    fn scores(gains: &[(&str, f64)], present: &[(String, Parameters)], rows: usize) -> Vec<f64> {
        let mut total = vec![0.0; rows];
        for (i, (id, mean)) in gains.iter().enumerate() {
            if present.iter().any(|p| p.0 == *id) {
                let mut draw = Stream::new(7, i as u64);
                total.iter_mut().for_each(|t| *t += mean + (2.0 * mean.abs()).sqrt() * draw.normal());
            }
        }
        total
    }

    fn tested(gains: &[(&str, f64)]) -> Vec<Tested> {
        let effects: Vec<(String, Parameters)> = gains.iter().map(|g| (g.0.to_owned(), Parameters::new())).collect();
        // recordings of a simulator that has the effect gain G ± √(2 G)
        let expect = |effect: &(String, Parameters)| {
            let gain = 4000.0 * EXPECTED.iter().find(|e| e.0 == effect.0).map_or(0.0, |e| e.1);
            Ok((-3..=3).map(|k| gain + (2.0 * gain).sqrt() * 0.46 * f64::from(k)).collect())
        };
        test(&effects, |some| Ok(scores(gains, some, 4000)), expect).unwrap()
    }

    /// Gain a row of effects as large as found, nats.
    const EXPECTED: [(&str, f64); 1] = [("weak", 6.0 / 4000.0)];

    fn answered(verdict: Verdict, main: Option<&str>, together: &[&str]) -> Answer {
        let mut answer = crate::gap::answer::compose::answer(&findings(&[]), |_| None);
        answer.verdict = verdict;
        answer.main = main.map(Into::into);
        answer.main_probability = 0.97;
        answer.together = together.iter().map(|id| (*id).to_owned()).collect();
        answer.effects = together.iter().map(|id| EffectAnswer::new(id, 0.97)).collect();
        answer
    }

    fn closed(estimate: f64, ci95: [f64; 2]) -> Closed {
        Closed { estimate: Some(estimate), ci95: Some(ci95), paired: false, gained_nats: 1.0, expected_gain_nats: 1.0 }
    }

    fn findings(ids: &[&str]) -> Findings {
        let parts: Vec<Part> = ids.iter().map(|id| Part::new(id, true, 9.0)).collect();
        let set = WeightedSet { parts, ln_weight: 0.0, probability: 1.0 };
        Findings { sets: vec![set], ..Findings::default() }
    }

    #[test]
    fn a_gain_is_known_as_well_as_its_rows_scatter() {
        let all = tested(&[("a", 0.01)]);
        let one = &all[0];
        // 4000 rows of mean 0.01 and variance 0.02: 40 ± 8.9 nats; 400 blocks tell that scatter to a few percent
        assert!((one.first.std_nats / 80_f64.sqrt() - 1.0).abs() < 0.2, "{:?}", one.first);
        assert!((one.first.nats - 40.0).abs() < 4.0 * 80_f64.sqrt());
        // alone, it is first and last
        assert_eq!(one.first, one.last);
    }

    #[test]
    fn beyond_doubt_and_closing_nothing_is_idle_and_weak_is_not() {
        // of the first no gain is expected; the second gains as little as chance allows, the third as expected
        let effects = [("lattice", 0.0), ("weak", -1.0 / 4000.0), ("strong", 0.1)];
        let all = tested(&effects);
        let ids = ["lattice", "weak", "strong"];
        assert_eq!(idle(&all, &findings(&ids)), ["lattice"]);
        // an effect that is not present beyond doubt is not idle
        let mut doubtful = findings(&ids);
        doubtful.sets[0].probability = 0.8;
        assert!(idle(&all, &doubtful).is_empty());
        let mut found = findings(&["lattice"]);
        found.set_aside(&["lattice".to_owned()]);
        let answer = crate::gap::answer::compose::answer(&found, |_| None);
        assert_eq!((answer.verdict, answer.together.len(), answer.main), (Verdict::None, 0, None));
        assert!(answer.effects[0].idle && answer.effects[0].id == "lattice");
    }

    #[test]
    fn what_the_recording_held_out_contradicts_has_no_name() {
        // one that loses as much as a true one gains, one whose loss is within chance and below the least gain, and a
        // true one
        let mut all = tested(&[("false", -0.1), ("chance", -1.0 / 4000.0), ("true", 0.1)]);
        assert_eq!(refuted(&all), ["false"]);
        let mut found = findings(&["false", "true"]);
        found.refute(&refuted(&all));
        assert_eq!((found.presence("true"), found.sets[0].parts.len()), (1.0, 1));
        // alone it leaves a free form: there is a gap, with another cause
        let mut found = findings(&["false"]);
        found.refute(&refuted(&all));
        let left = &found.sets[0].parts[0];
        assert!(left.id == "free.refuted.false" && !left.named && left.share == 9.0 && left.parameters.is_empty());
        // what the recording's own numbers show is there
        all[0].is_read_off = true;
        assert!(refuted(&all).is_empty() && against(&all).iter().all(|(id, _)| id != "false"));
    }

    #[test]
    fn what_leads_leaves_the_rest_to_the_others() {
        let all = tested(&[("one", 0.1), ("other", 0.1), ("nothing", -1.0 / 4000.0)]);
        assert_eq!(superfluous(&all), ["nothing"]);
        let (zero, some) = (vec![0.0; 4000], scores(&[("one", 0.1)], &[("one".into(), Parameters::new())], 4000));
        assert!(is_better(&zero, &some) && !is_better(&some, &zero));
        let mut found = findings(&["other", "nothing"]);
        found.sets[0].parts.push(Part::new("free.form", false, 40.0));
        found.lead(&Part::new("one", true, 30.0), &superfluous(&all));
        let parts: Vec<_> = found.sets[0].parts.iter().map(|p| (p.id.as_str(), p.share)).collect();
        assert_eq!(parts, [("other", 9.0), ("free.form", 10.0), ("one", 40.0)]);
    }

    #[test]
    fn what_closes_most_leads() {
        let all = tested(&[("small", 0.02), ("large", 0.2)]);
        let mut answer = answered(Verdict::Identified, Some("small"), &["small", "large"]);
        settle(&mut answer, &all, Some(&closed(0.9, [0.8, 1.0])), |_| None);
        assert_eq!((answer.main.as_deref(), answer.together[0].as_str()), (Some("large"), "large"));
        assert!((answer.remainder.as_ref().unwrap().share - 0.1).abs() < 1e-12);
        // of two that close as much the one that the evidence chose remains first
        let all = tested(&[("one", 0.02), ("other", 0.0201)]);
        let mut answer = answered(Verdict::Identified, Some("one"), &["one", "other"]);
        settle(&mut answer, &all, None, |_| None);
        assert_eq!(answer.main.as_deref(), Some("one"));
        // beside an unknown cause too
        let mut answer = answered(Verdict::Unknown, None, &["one"]);
        settle(&mut answer, &tested(&[("one", 0.1)]), None, |_| None);
        assert_eq!((answer.verdict, answer.main.as_deref()), (Verdict::Unknown, Some("one")));
    }

    #[test]
    fn a_name_that_predicts_worse_is_no_cause_unless_it_is_read_off() {
        for (ci95, is_read_off, verdict) in [
            ([-0.8, -0.2], false, Verdict::Unknown),
            ([-0.8, 0.1], false, Verdict::Identified),
            ([-0.8, -0.2], true, Verdict::Identified),
        ] {
            let mut all = tested(&[("one", -1.0 / 4000.0)]);
            all[0].is_read_off = is_read_off;
            let mut answer = answered(Verdict::Identified, Some("one"), &["one"]);
            settle(&mut answer, &all, Some(&Closed { paired: true, ..closed(-0.5, ci95) }), |_| None);
            assert_eq!(answer.verdict, verdict, "{ci95:?}, {is_read_off}");
        }
    }

    #[test]
    fn more_than_half_is_identified_whatever_free_forms_took_in_the_fit() {
        let all = tested(&[("one", 0.1)]);
        let settled_by = |paired, ci95, presence| {
            let mut answer = answered(Verdict::Unknown, None, &["one"]);
            (answer.none_probability, answer.unknown_probability, answer.main_probability) = (0.0, 0.97, 0.03);
            answer.effects[0].probability = presence;
            settle(&mut answer, &all, Some(&Closed { paired, ..closed(0.8, ci95) }), |id| id.map(|_| Place::default()));
            answer
        };
        let settled = |ci95, presence| settled_by(false, ci95, presence);
        let most = settled([0.7, 0.9], 0.97);
        assert_eq!((most.verdict, most.main.as_deref()), (Verdict::Identified, Some("one")));
        assert!((most.main_probability - 0.97).abs() < 1e-6 && (most.unknown_probability - 0.03).abs() < 1e-6);
        assert!(most.place.is_some() && most.notes[0].contains("80 % of the gap (95 %: 70 to 90 %)"));
        // not where the interval reaches below one half, nor where the effect itself is in doubt
        assert_eq!(settled([0.4, 1.2], 0.97).verdict, Verdict::Unknown);
        assert_eq!(settled([0.7, 0.9], 0.45).verdict, Verdict::Unknown);
        // nor with a paired floor
        assert_eq!(settled_by(true, [0.7, 0.9], 0.97).verdict, Verdict::Unknown);
    }

    #[test]
    fn less_than_half_is_unknown_with_its_name() {
        let all = tested(&[("one", 0.1)]);
        let mut answer = answered(Verdict::Identified, Some("one"), &["one"]);
        settle(&mut answer, &all, Some(&closed(0.24, [0.2, 0.28])), |id| id.is_none().then(Place::default));
        assert_eq!((answer.verdict, answer.main.as_deref()), (Verdict::Unknown, Some("one")));
        // the probability is that of the effect being present
        assert!((answer.unknown_probability - 0.97).abs() < 1e-6 && answer.main_probability < 0.031);
        assert!(answer.place.is_some());
        // with a paired floor the gap is no proof of another cause
        let mut answer = answered(Verdict::Identified, Some("one"), &["one"]);
        let small = Closed { paired: true, ..closed(0.24, [0.2, 0.28]) };
        settle(&mut answer, &all, Some(&small), |_| None);
        assert_eq!(answer.verdict, Verdict::Identified);
        // an interval that reaches one half does not contradict the verdict
        let mut answer = answered(Verdict::Identified, Some("one"), &["one"]);
        settle(&mut answer, &all, Some(&closed(0.45, [0.3, 0.6])), |_| None);
        assert_eq!(answer.verdict, Verdict::Identified);
    }
}
