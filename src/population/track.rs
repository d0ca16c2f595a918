//! t = (y - ȳ)/(s √(1 + 1/m)),   s² = (d₀ s₀² + d s_u²)/(d₀ + d):  a power-on held against the earlier ones of its unit
//!
//! y is C1, C2, ln T or ln N of the last power-on; ȳ and s_u² are mean and variance of the m earlier ones of that unit, d = m - 1. From few
//! power-ons a variance is known badly. Units of a kind share a prior, s_u² ~ s₀² F(d, d₀), of which d₀ and s₀² come from all of them
//! (Smyth, Stat. Appl. Genet. Mol. Biol. 3 (2004) 3, section 6.2): t is Student's with d₀ + d degrees of freedom. A drift is the slope of
//! all power-ons of the unit, its residual variance moderated in the same way. A unit that is as ever is found outside, or drifting, at
//! most once in `per_year` power-ons (Bonferroni over gyros, parameters and both tests).

use super::levels::{FleetLevels, Member};
use super::quantity::{QUANTITIES, Quantity, observed};
use super::row::Row;
use super::variance_prior::VariancePrior;
use crate::math::mean;
use jiff::Timestamp;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::collections::{BTreeMap, BTreeSet};

/// Fewest earlier power-ons against which one is held.
const FEWEST: usize = 3;
/// Rounds in which power-ons that were outside at their time leave the history, and the prior is estimated again.
const ROUNDS: usize = 3;
/// Seconds of a day.
const DAY_S: f64 = 86_400.0;

/// How the last power-on of a gyro stands to the earlier ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Standing {
    /// Inside what they predict.
    Inside,
    /// Outside.
    Outside,
    /// Inside, and all of them lie on a slope.
    Drifting,
    /// It has no estimates of a warm-up.
    NotJudged,
    /// There are fewer than three.
    TooFew,
}

/// A parameter of the last power-on against the earlier ones. In the unit of its name; T, N: through their logarithms.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct TrackedParameter {
    /// `c1_rad_s`, `c2_rad_s`, `time_constant_s` or `angle_random_walk_rad_sqrt_s`.
    pub name: &'static str,
    /// Its estimate in the last power-on.
    pub value: f64,
    /// Mean of the earlier ones; of T and N, the geometric one.
    pub expected: f64,
    /// Interval that holds the value of a unit that is as ever, but for the agreed false alarms.
    pub interval: [f64; 2],
    /// Student's t.
    pub t: f64,
    /// Its degrees of freedom, those of the prior included.
    pub degrees_of_freedom: f64,
    /// Probability of as large a t.
    pub p_value: f64,
    /// Whether the value is outside the interval.
    pub outside: bool,
    /// Slope a day, or a power-on where times are not known; of T and N, relative.
    pub slope: f64,
    /// Its standard deviation.
    pub slope_std: f64,
    /// Probability of as steep a slope without drift.
    pub slope_p_value: f64,
    /// Whether it is a drift.
    pub drifting: bool,
    /// Values of the power-ons in their order, the last one included; none where one has no estimate.
    pub history: Vec<Option<f64>>,
}

/// One gyro of a unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Tracked {
    /// Name of the unit.
    pub unit: String,
    /// As in the rows.
    pub topic: Option<String>,
    /// As in the rows.
    pub axis: String,
    /// Power-ons, the last one included.
    pub power_ons: usize,
    /// Earlier ones that were outside in their time, which count no more.
    pub set_aside: usize,
    /// Log of the last one.
    pub last: String,
    /// When it began, ISO 8601, UTC.
    pub last_started: Option<String>,
    /// Verdict.
    pub standing: Standing,
    /// Why it was not judged.
    pub why: Option<String>,
    /// Days since the first power-on of each, or their numbers, from 1, where times are not known.
    pub at: Vec<f64>,
    /// Whether `at` is in days.
    pub in_days: bool,
    /// One a parameter; none where it was not judged.
    pub parameters: Vec<TrackedParameter>,
}

/// The power-ons of one gyro, in their order.
struct Gyro<'a> {
    unit: String,
    rows: Vec<&'a Row>,
    at: Vec<f64>,
    in_days: bool,
    /// Whether a power-on counts as history.
    counts: Vec<bool>,
}

impl<'a> Gyro<'a> {
    fn new(unit: String, mut rows: Vec<&'a Row>) -> Self {
        // a copy of a log is no other power-on
        let mut seen = BTreeSet::new();
        rows.retain(|r| r.source.sha256.is_empty() || seen.insert(r.source.sha256.as_str()));
        let times: Option<Vec<Timestamp>> = rows.iter().map(|r| r.source.started.as_ref()?.parse().ok()).collect();
        let (at, in_days) = match times {
            Some(times) => {
                let mut order: Vec<usize> = (0..rows.len()).collect();
                order.sort_by_key(|i| times[*i]);
                rows = order.iter().map(|i| rows[*i]).collect();
                let first = times[order[0]];
                (order.iter().map(|i| times[*i].duration_since(first).as_secs_f64() / DAY_S).collect(), true)
            }
            None => {
                rows.sort_by(|a, b| a.source.path.cmp(&b.source.path));
                ((1..=rows.len()).map(|i| i as f64).collect(), false)
            }
        };
        let counts = vec![true; rows.len()];
        Self { unit, rows, at, in_days, counts }
    }

    /// Observations of the power-ons before `end` that count.
    fn before(&self, quantity: &Quantity, end: usize) -> Vec<[f64; 2]> {
        let there = (0..end).filter(|i| self.counts[*i]);
        there.filter_map(|i| observed(quantity, self.rows[i])).collect()
    }

    /// Whether power-on `k` was outside what those before it predict.
    fn was_outside(&self, k: usize, priors: &[VariancePrior; 4], level: f64) -> bool {
        QUANTITIES.iter().zip(priors).any(|(quantity, prior)| {
            let today = observed(quantity, self.rows[k]);
            today.and_then(|today| held(&self.before(quantity, k), today, prior, level)).is_some_and(|h| h.outside)
        })
    }
}

/// A value held against earlier ones.
struct Held {
    mean: f64,
    half_width: f64,
    t: f64,
    degrees: f64,
    p_value: f64,
    outside: bool,
}

fn held(earlier: &[[f64; 2]], [today, std]: [f64; 2], prior: &VariancePrior, level: f64) -> Option<Held> {
    if earlier.len() < FEWEST {
        return None;
    }
    let m = earlier.len() as f64;
    let centre = mean(earlier.iter().map(|v| v[0]));
    let squares: f64 = earlier.iter().map(|v| (v[0] - centre).powi(2)).sum();
    let (variance, degrees) = prior.moderated(squares, m - 1.0);
    // the variance holds the errors of the earlier estimates; a shorter log today errs by more
    let more = (std * std - mean(earlier.iter().map(|v| v[1] * v[1]))).max(0.0);
    let scale = (variance * (1.0 + 1.0 / m) + more).sqrt();
    let t = (today - centre) / scale;
    let (p_value, quantile) = student(t, degrees, level)?;
    Some(Held { mean: centre, half_width: quantile * scale, t, degrees, p_value, outside: p_value < level })
}

/// Two-sided probability of as large a t, and its quantile at `level`.
fn student(t: f64, degrees: f64, level: f64) -> Option<(f64, f64)> {
    let law = StudentsT::new(0.0, 1.0, degrees).ok()?;
    Some((2.0 * law.sf(t.abs()), -law.inverse_cdf(0.5 * level))).filter(|(p, _)| p.is_finite())
}

/// Slope of `y` over `x`, its standard deviation and the probability of as steep a one by chance.
fn slope(x: &[f64], y: &[f64], prior: &VariancePrior) -> Option<[f64; 3]> {
    let (mx, my) = (mean(x.iter().copied()), mean(y.iter().copied()));
    let sxx: f64 = x.iter().map(|x| (x - mx).powi(2)).sum();
    let slope = x.iter().zip(y).map(|(x, y)| (x - mx) * (y - my)).sum::<f64>() / sxx;
    let left: f64 = x.iter().zip(y).map(|(x, y)| (y - my - slope * (x - mx)).powi(2)).sum();
    let (variance, degrees) = prior.moderated(left, x.len() as f64 - 2.0);
    let std = (variance / sxx).sqrt();
    let (p_value, _) = student(slope / std, degrees, 0.5)?;
    Some([slope, std, p_value])
}

/// Tracks every gyro of every unit of `rows`, and tells by what the power-ons of all differ. `unit`: name of the unit of a row, none where it
/// belongs to none; `kind`: its type. A unit that is as ever raises a false alarm at most once in `per_year` power-ons.
pub(crate) fn track(
    rows: &[Row],
    unit: &dyn Fn(&Row) -> Option<String>,
    kind: &dyn Fn(&Row) -> Option<String>,
    per_year: f64,
) -> (Vec<Tracked>, Vec<FleetLevels>) {
    let mut named: BTreeMap<(String, &Option<String>, &str), Vec<&Row>> = BTreeMap::new();
    for row in rows {
        if let Some(unit) = unit(row) {
            named.entry((unit, &row.source.topic, &row.source.axis)).or_default().push(row);
        }
    }
    let mut gyros: Vec<Gyro<'_>> = named.into_iter().map(|((unit, ..), rows)| Gyro::new(unit, rows)).collect();
    let mut of_unit: BTreeMap<String, f64> = BTreeMap::new();
    gyros.iter().for_each(|g| *of_unit.entry(g.unit.clone()).or_default() += 1.0);
    let level = |g: &Gyro<'_>| 1.0 / (per_year.max(1.0) * 2.0 * QUANTITIES.len() as f64 * of_unit[&g.unit]);
    let mut priors = [VariancePrior::NONE; 4];
    for _ in 0..ROUNDS {
        priors = QUANTITIES.map(|quantity| {
            let squares = gyros.iter().map(|g| {
                let earlier = g.before(&quantity, g.rows.len() - 1);
                let centre = mean(earlier.iter().map(|v| v[0]));
                (earlier.iter().map(|v| (v[0] - centre).powi(2)).sum(), earlier.len() as f64 - 1.0)
            });
            VariancePrior::of(squares)
        });
        for gyro in &mut gyros {
            for k in FEWEST..gyro.rows.len() - 1 {
                gyro.counts[k] = !gyro.was_outside(k, &priors, level(gyro));
            }
        }
    }
    let all: Vec<Tracked> = gyros.iter().map(|g| tracked(g, &priors, level(g))).collect();
    let mut members: BTreeMap<(&Option<String>, &str), Vec<Member<'_>>> = BTreeMap::new();
    for (gyro, tracked) in gyros.iter().zip(&all) {
        let last = if tracked.standing == Standing::Outside { gyro.rows.len() - 1 } else { gyro.rows.len() };
        let counting = gyro.rows[..last].iter().zip(&gyro.counts).filter(|(_, counts)| **counts);
        let of_gyro = counting.map(|(row, _)| Member { unit: &gyro.unit, kind: kind(row), row });
        members.entry((&tracked.topic, &tracked.axis)).or_default().extend(of_gyro);
    }
    let levels = members.values().filter_map(|m| FleetLevels::of(m)).collect();
    (all, levels)
}

fn tracked(gyro: &Gyro<'_>, priors: &[VariancePrior; 4], level: f64) -> Tracked {
    let last = gyro.rows.len() - 1;
    let row = gyro.rows[last];
    let mut parameters = Vec::new();
    for (quantity, prior) in QUANTITIES.iter().zip(priors) {
        let Some(today) = observed(quantity, row) else { continue };
        let Some(h) = held(&gyro.before(quantity, last), today, prior, level) else { continue };
        let there = (0..=last)
            .filter(|i| gyro.counts[*i])
            .filter_map(|i| Some((gyro.at[i], observed(quantity, gyro.rows[i])?[0])));
        let (x, y): (Vec<f64>, Vec<f64>) = there.unzip();
        let [slope, slope_std, slope_p_value] = slope(&x, &y, prior).unwrap_or([0.0, f64::NAN, 1.0]);
        let back = |v: f64| if quantity.1 { v.exp() } else { v };
        parameters.push(TrackedParameter {
            name: quantity.0,
            value: back(today[0]),
            expected: back(h.mean),
            interval: [back(h.mean - h.half_width), back(h.mean + h.half_width)],
            t: h.t,
            degrees_of_freedom: h.degrees,
            p_value: h.p_value,
            outside: h.outside,
            slope,
            slope_std,
            slope_p_value,
            drifting: slope_p_value < level,
            history: gyro.rows.iter().map(|r| observed(quantity, r).map(|v| back(v[0]))).collect(),
        });
    }
    let told = QUANTITIES.iter().any(|quantity| observed(quantity, row).is_some());
    let standing = match parameters.is_empty() {
        true if told => Standing::TooFew,
        true => Standing::NotJudged,
        _ if parameters.iter().any(|p| p.outside) => Standing::Outside,
        _ if parameters.iter().any(|p| p.drifting) => Standing::Drifting,
        _ => Standing::Inside,
    };
    let why = || match (&row.source.error, row.warm_up_found) {
        (Some(error), _) => error.clone(),
        (None, Some(false)) => "no warm-up found".into(),
        _ => "T is not identifiable".into(),
    };
    Tracked {
        unit: gyro.unit.clone(),
        topic: row.source.topic.clone(),
        axis: row.source.axis.clone(),
        power_ons: gyro.rows.len(),
        set_aside: gyro.counts[..last].iter().filter(|counts| !**counts).count(),
        last: row.source.path.clone(),
        last_started: row.source.started.clone(),
        standing,
        why: (standing == Standing::NotJudged).then(why),
        at: gyro.at.clone(),
        in_days: gyro.in_days,
        parameters,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;
    use crate::population::Source;

    /// Spread of C2 from one power-on to the next, rad/s.
    const SPREAD: f64 = 3e-4;

    /// Rows of units with this many power-ons a day apart; `off` is added to C2 of a unit's power-on.
    fn fleet(units: usize, power_ons: usize, seed: u64, off: impl Fn(usize, usize) -> f64) -> Vec<Row> {
        let mut draw = Stream::new(seed, 0);
        let mut rows = Vec::new();
        for unit in 0..units {
            for k in 0..power_ons {
                let mut normal = || draw.normal();
                let started = Timestamp::from_second(1_700_000_000 + 86_400 * k as i64).unwrap();
                rows.push(Row {
                    source: Source {
                        path: format!("fleet/{unit}/{:03}.csv", power_ons - k),
                        sha256: format!("{unit} {k}"),
                        axis: "z".into(),
                        started: Some(started.to_string()),
                        ..Source::default()
                    },
                    identifiable: Some(true),
                    c1_rad_s: Some(2e-3 + 1e-4 * normal()),
                    c1_std_rad_s: Some(1e-5),
                    c2_rad_s: Some(-5e-3 + 1e-3 * unit as f64 + SPREAD * normal() + off(unit, k)),
                    c2_std_rad_s: Some(1e-5),
                    time_constant_s: Some(120.0 * (0.05 * normal()).exp()),
                    time_constant_std_s: Some(2.0),
                    angle_random_walk_rad_sqrt_s: Some(1e-4 * (0.01 * normal()).exp()),
                    degrees_of_freedom: Some(5000.0),
                    ..Row::default()
                });
            }
        }
        rows
    }

    fn gyros(rows: &[Row], unit: &dyn Fn(&Row) -> Option<String>, per_year: f64) -> Vec<Tracked> {
        track(rows, unit, &|_| None, per_year).0
    }

    fn by_folder(row: &Row) -> Option<String> {
        row.source.path.split('/').nth(1).map(Into::into)
    }

    fn changed(all: &[Tracked]) -> Vec<&str> {
        let changed = all.iter().filter(|g| matches!(g.standing, Standing::Outside | Standing::Drifting));
        changed.map(|g| g.unit.as_str()).collect()
    }

    /// 1000 fleets of 1 to 12 units with 3 to 12 earlier power-ons: at one false alarm in 20 power-ons no more than a twentieth, and four
    /// standard deviations of a binomial share, are told to have changed.
    #[test]
    fn units_that_are_as_ever_keep_to_the_agreed_false_alarms() {
        let (mut told, mut of) = (0, 0);
        for seed in 0..1000 {
            let (units, power_ons) = (1 + seed as usize % 12, 4 + seed as usize / 12 % 10);
            let all = gyros(&fleet(units, power_ons, seed, |_, _| 0.0), &by_folder, 20.0);
            told += changed(&all).len();
            of += all.len();
        }
        let (n, level) = (of as f64, 0.05);
        assert!((told as f64) < n * level + 4.0 * (n * level * (1.0 - level)).sqrt(), "{told} of {of}");
    }

    #[test]
    fn a_step_and_a_drift_are_told_of_the_parameter_that_has_them() {
        let last = 29;
        let rows = fleet(8, last + 1, 3, |unit, k| match unit {
            2 if k == last => 8.0 * SPREAD,
            5 => 0.3 * SPREAD * k as f64,
            _ => 0.0,
        });
        let all = gyros(&rows, &by_folder, 365.0);
        assert_eq!(changed(&all), ["2", "5"]);
        let [step, drift] = [&all[2], &all[5]];
        assert_eq!((step.standing, drift.standing), (Standing::Outside, Standing::Drifting));
        let names =
            |g: &Tracked| g.parameters.iter().filter(|p| p.outside || p.drifting).map(|p| p.name).collect::<Vec<_>>();
        assert_eq!((names(step), names(drift)), (vec!["c2_rad_s"], vec!["c2_rad_s"]));
        // the newest by its date, though its path comes first
        assert!(step.last.ends_with("001.csv") && step.in_days && step.at[last] == last as f64, "{step:?}");
        let slope = &drift.parameters[1];
        assert!((slope.slope - 0.3 * SPREAD).abs() < 4.0 * slope.slope_std, "{slope:?}");
        let within = |p: &TrackedParameter| p.interval[0] < p.expected && p.expected < p.interval[1];
        assert!(all.iter().flat_map(|g| &g.parameters).all(within));
    }

    #[test]
    fn a_power_on_that_was_outside_is_no_history_and_a_copy_no_power_on() {
        let mut rows = fleet(6, 20, 4, |unit, k| if unit == 1 && (k == 12 || k == 19) { 10.0 * SPREAD } else { 0.0 });
        let all = gyros(&rows, &by_folder, 365.0);
        assert_eq!((changed(&all), all[1].set_aside), (vec!["1"], 1));
        let mut copy = rows[25].clone();
        copy.source.path = "fleet/1/copy.csv".into();
        rows.push(copy);
        assert_eq!(gyros(&rows, &by_folder, 365.0)[1].power_ons, 20);
    }

    #[test]
    fn where_nothing_can_be_judged_it_says_why() {
        let few = gyros(&fleet(2, 3, 5, |_, _| 0.0), &by_folder, 365.0);
        assert!(few.iter().all(|g| g.standing == Standing::TooFew));
        let mut rows = fleet(1, 6, 5, |_, _| 0.0);
        rows[5].source.error = Some("no time column".into());
        let failed = &gyros(&rows, &by_folder, 365.0)[0];
        assert_eq!((failed.standing, failed.why.as_deref()), (Standing::NotJudged, Some("no time column")));
        assert_eq!(gyros(&rows, &|_| None, 365.0), []);
    }
}
