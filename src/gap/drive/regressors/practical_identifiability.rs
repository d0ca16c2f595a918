//! E[ln B] = ½ s'(I + A U² A')⁻¹s of the effect - the same of its rival,   s = A β: change of the innovations by the
//! effect
//!
//! Effects that a drive cannot tell apart, from the information matrix alone. The readings that the best set predicts
//! on average are compared, not those recorded: the evidence lost without an effect, and how much of it each other
//! effect takes over, beside the rest of the set and the nuisances of the run. Chance in this one recording plays no
//! part: it is in the posterior.

use crate::gap::answer::Alike;
use crate::gap::drive::fit::Compared;
use crate::gap::drive::fit::evidence::{Group, Problem, Rank};
use crate::gap::drive::record::Record;
use crate::gap::selection::search::Member;

/// Expected ln odds below which two effects are not told apart: as for rivals in the posterior.
pub(crate) const LN_ODDS: f64 = 3.0;
/// Largest class that is reported.
pub(crate) const LARGEST: usize = 3;
/// Factor on the length of a drive beyond which a longer one is not proposed.
const LONGER: f64 = 30.0;

/// An effect and those that resemble it.
struct Class {
    ids: Vec<String>,
    /// Least share of the effect's evidence that a member takes over, 0 to 1.
    overlap: f64,
    /// Expected evidence of the effect over its most similar rival, nats.
    apart: f64,
}

/// Classes of effects that this drive cannot tell apart: one for each effect of the best set that has similar effects.
#[must_use]
pub(crate) fn alike(record: &Record, compared: &Compared) -> Vec<Alike> {
    let classes = classes(&compared.problem, &compared.candidates.groups, &compared.sets[0].fitted);
    let told = |c: Class| Alike { separate_by: separate_by(record, Some(c.apart)), ids: c.ids, overlap: c.overlap };
    classes.into_iter().map(told).collect()
}

fn classes(problem: &Problem, groups: &[Group], members: &[Member]) -> Vec<Class> {
    let expected = problem.expected(members);
    let has_law = |m: &Member| groups[m.0].rank == Rank::Law;
    let class = |own: &Member| {
        let rest: Vec<Member> = members.iter().copied().filter(|m| m != own).collect();
        let gains: Vec<(&str, f64)> = gains(&expected, groups, &rest)
            .into_iter()
            .filter(|g| has_law(&g.0))
            .map(|(m, gain)| (groups[m.0].id.as_str(), gain))
            .collect();
        let id = groups[own.0].id.as_str();
        let gain = gains.iter().find(|g| g.0 == id)?.1;
        let mut class = Class { ids: vec![id.into()], overlap: 1.0, apart: f64::INFINITY };
        // an effect with little evidence resembles everything
        for (rival, other) in gains.into_iter().filter(|g| gain > LN_ODDS && gain - g.1 < LN_ODDS) {
            if class.ids.len() < LARGEST && class.ids.iter().all(|c| c != rival) {
                class.ids.push(rival.into());
                class.apart = class.apart.min((gain - other).max(0.0));
                class.overlap = class.overlap.min((other / gain).clamp(0.0, 1.0));
            }
        }
        (class.ids.len() > 1).then_some(class)
    };
    members.iter().filter(|m| has_law(m)).filter_map(class).collect()
}

/// Gain in evidence of each group beside `rest`, nats, without its prior odds, the largest first.
pub(crate) fn gains(expected: &Problem, groups: &[Group], rest: &[Member]) -> Vec<(Member, f64)> {
    let without_prior = |(m, gain): (Member, f64)| (m, gain - groups[m.0].ln_prior);
    let mut gains: Vec<(Member, f64)> = expected.additions(rest).into_iter().map(without_prior).collect();
    gains.sort_by(|a, b| b.1.total_cmp(&a.1));
    gains
}

/// Advice for separating effects whose expected evidence differs by `apart` nats (none: unknown): missing channels, and
/// a longer drive, with whose length the evidence grows.
pub(crate) fn separate_by(record: &Record, apart: Option<f64>) -> String {
    let lacking = lacking(record);
    let drive = match apart.map(|nats| LN_ODDS / nats.max(1e-9)) {
        None => "a longer drive of this kind".into(),
        Some(longer) if longer <= LONGER => format!("a drive of this kind {:.0} times as long", longer.ceil().max(2.0)),
        Some(_) => "a drive with other speeds, turns and accelerations: of this kind no length would do".into(),
    };
    if lacking.is_empty() { drive } else { format!("{} in the log; {drive}", lacking.join(", or ")) }
}

/// Channels that effects which act on forces need, in words.
pub(crate) const TORQUES: &str = "the wheels' torques";

/// Channels that a drive lacks, in words.
pub(crate) fn lacking(record: &Record) -> Vec<&'static str> {
    let channels = [
        ("a pose reference", record.pose.is_none()),
        (TORQUES, record.torques_n_m.is_none()),
        ("a gyro", record.gyro_rad_s.is_none()),
    ];
    channels.iter().filter(|c| c.1).map(|c| c.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::Mat;

    /// Two effects of one coefficient each, whose columns have the energy `g` and the correlation `rho`; the readings
    /// have the moments `b` with them.
    fn of(g: f64, rho: f64, b: [f64; 2]) -> (Problem, Vec<Group>) {
        let group = |i: usize| Group {
            id: format!("effect.{i}"),
            named: true,
            columns: vec![i],
            nodes: vec![vec![1.0]],
            ln_prior: -3.0,
            rank: Rank::Law,
            positive: 0,
            varies: None,
            drive: 0,
        };
        let summed = [[g, rho * g, b[0]], [rho * g, g, b[1]], [b[0], b[1], 1e3]];
        let groups = vec![group(0), group(1)];
        (Problem::new(&Mat::from_fn(3, 3, |i, j| summed[i][j]), 0.0, &[0.0; 2], groups.clone(), Vec::new()), groups)
    }

    #[test]
    fn classes_follow_from_the_overlap_and_the_size_of_an_effect() {
        let (g, beta) = (1e4, 0.2);
        // wide priors: E[ln B] = ½ g β² (1 - ρ²), here 2 and 20 nats of 200
        for (rho, is_class) in [(0.99f64.sqrt(), true), (0.9f64.sqrt(), false)] {
            let (problem, groups) = of(g, rho, [g * beta, rho * g * beta]);
            let found = classes(&problem, &groups, &[(0, 0)]);
            assert_eq!(!found.is_empty(), is_class);
            if let Some(class) = found.first() {
                assert_eq!(class.ids, ["effect.0", "effect.1"]);
                assert!((class.apart - 2.0).abs() < 0.05, "{}", class.apart);
                // Occam's factor, 4.6 nats, is the same for both
                assert!((class.overlap - 193.4 / 195.4).abs() < 1e-3, "{}", class.overlap);
            }
        }
    }

    #[test]
    fn chance_in_the_recording_plays_no_part() {
        // the readings say one nat more, or less, in favour of the rival than on average
        let (g, beta, rho) = (1e4, 0.2, 0.99f64.sqrt());
        for luck in [-10.0, 10.0] {
            let (problem, groups) = of(g, rho, [g * beta, rho * g * beta + luck]);
            let class = &classes(&problem, &groups, &[(0, 0)])[0];
            assert!((class.apart - 2.0).abs() < 0.05, "{}", class.apart);
        }
    }

    #[test]
    fn what_is_hardly_there_is_in_no_class() {
        let (problem, groups) = of(1e4, 0.999, [150.0, 149.0]);
        assert!(classes(&problem, &groups, &[(0, 0)]).is_empty());
    }
}
