//! t = (y - ŷ)/(s √(1 + v)),   s² = (d₀ s₀² + d s_u²)/(d₀ + d):  a power-on held against the earlier ones of its unit
//!
//! y is C1, C2, ln T or ln N of the last power-on; ŷ is its prediction by the m earlier ones of that unit, s² v the variance of that, s_u² their
//! variance, d = m - 1. Where the months of a unit do not differ, ŷ is the mean and v is 1/m; where they do, power-ons of one month are
//! correlated (`super::history`). From few power-ons a variance is known badly. Units of a kind share a prior, s_u² ~ s₀² F(d, d₀), of which
//! d₀ and s₀² come from all of them (Smyth, Stat. Appl. Genet. Mol. Biol. 3 (2004) 3, section 6.2): t is Student's with d₀ + d degrees of
//! freedom. A drift is the slope of all power-ons of the unit, its residual variance moderated in the same way. A unit that is as ever is
//! found outside, or drifting, at most once in `per_year` power-ons (Bonferroni over gyros, parameters and both tests).

use super::history::{FEWEST, Months, PowerOn, held, slope, squares};
use super::levels::{FleetLevels, Member};
use super::quantity::{QUANTITIES, Quantity, observed};
use super::row::Row;
use super::variance_prior::VariancePrior;
use jiff::Timestamp;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

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
    /// Mean of the earlier ones, and where months differ nearer to that of its own; of T and N, the geometric one.
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
    /// Its standard deviation; 0 where all power-ons are of one time.
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
    /// Calendar month of each, counted from the first one that has power-ons.
    months: Vec<usize>,
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
        let mut months = vec![0; rows.len()];
        for i in 1..rows.len() {
            months[i] = months[i - 1] + usize::from(!in_days || rows[i].month() != rows[i - 1].month());
        }
        let counts = vec![true; rows.len()];
        Self { unit, rows, at, in_days, months, counts }
    }

    /// Power-on `i`, where it tells the quantity.
    fn power_on(&self, quantity: &Quantity, i: usize) -> Option<PowerOn> {
        Some(PowerOn { at: self.at[i], month: self.months[i], seen: observed(quantity, self.rows[i])? })
    }

    /// The power-ons before `end` that count.
    fn before(&self, quantity: &Quantity, end: usize) -> Vec<PowerOn> {
        (0..end).filter(|i| self.counts[*i]).filter_map(|i| self.power_on(quantity, i)).collect()
    }

    /// Whether power-on `k` was outside what those before it predict.
    fn was_outside(&self, k: usize, priors: &Priors, level: f64) -> bool {
        QUANTITIES.iter().zip(priors).any(|(quantity, (prior, months))| {
            let today = self.power_on(quantity, k);
            today
                .and_then(|today| held(&self.before(quantity, k), &today, prior, self.months_of(months), level))
                .is_some_and(|h| h.outside)
        })
    }

    /// Without dates there are no months.
    fn months_of<'m>(&self, months: &'m Months) -> &'m Months {
        if self.in_days { months } else { &Months::NONE }
    }
}

/// Of each quantity, the prior of a unit's variance, and the variance between months over that between power-ons.
type Priors = [(VariancePrior, Months); 4];

/// Tracks every gyro of every unit of `rows`, and tells by what the power-ons of all differ. `unit`: name of the unit of a row, none where it
/// belongs to none; `kind`: its type. A unit that is as ever raises a false alarm at most once in `per_year` power-ons.
pub(crate) fn track(
    rows: &[Row],
    unit: &dyn Fn(&Row) -> Option<String>,
    kind: &dyn Fn(&Row) -> Option<String>,
    per_year: f64,
) -> (Vec<Tracked>, Vec<FleetLevels>) {
    let (gyros, all) = judged(rows, unit, per_year);
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

/// Every gyro with its last power-on against the earlier ones.
fn judged<'a>(rows: &'a [Row], unit: &dyn Fn(&Row) -> Option<String>, per_year: f64) -> (Vec<Gyro<'a>>, Vec<Tracked>) {
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
    let mut priors: Priors = [(VariancePrior::NONE, Months::NONE); 4];
    for _ in 0..ROUNDS {
        priors = QUANTITIES.map(|quantity| {
            let earlier: Vec<Vec<PowerOn>> = gyros.iter().map(|g| g.before(&quantity, g.rows.len() - 1)).collect();
            let dated = gyros.iter().zip(&earlier).filter(|(g, _)| g.in_days).map(|(_, all)| all.as_slice());
            let months = Months::of(dated);
            (
                VariancePrior::of(gyros.iter().zip(&earlier).map(|(g, all)| squares(all, g.months_of(&months).ratio))),
                months,
            )
        });
        for gyro in &mut gyros {
            for k in FEWEST..gyro.rows.len() - 1 {
                gyro.counts[k] = !gyro.was_outside(k, &priors, level(gyro));
            }
        }
    }
    let all: Vec<Tracked> = gyros.iter().map(|g| tracked(g, &priors, level(g))).collect();
    (gyros, all)
}

fn tracked(gyro: &Gyro<'_>, priors: &Priors, level: f64) -> Tracked {
    let last = gyro.rows.len() - 1;
    let row = gyro.rows[last];
    let mut parameters = Vec::new();
    for (quantity, (prior, months)) in QUANTITIES.iter().zip(priors) {
        let months = gyro.months_of(months);
        let Some(today) = gyro.power_on(quantity, last) else { continue };
        let Some(h) = held(&gyro.before(quantity, last), &today, prior, months, level) else { continue };
        let counting = (0..=last).filter(|i| gyro.counts[*i]);
        let all: Vec<PowerOn> = counting.filter_map(|i| gyro.power_on(quantity, i)).collect();
        let [slope, slope_std, slope_p_value] = slope(&all, prior, months).unwrap_or([0.0, 0.0, 1.0]);
        let back = |v: f64| if quantity.1 { v.exp() } else { v };
        parameters.push(TrackedParameter {
            name: quantity.0,
            value: back(today.seen[0]),
            expected: back(h.expected),
            interval: [back(h.expected - h.half_width), back(h.expected + h.half_width)],
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
        judged(rows, unit, per_year).1
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

    /// Five power-ons a month; C2 of each month of a unit is off by one of the normal deviates with `std`, and of unit `drifts` by a slope a day.
    fn fleet_of_months(units: usize, months: usize, seed: u64, std: f64, drifts: Option<(usize, f64)>) -> Vec<Row> {
        let mut draw = Stream::new(seed, 1);
        let mut rows = fleet(units, 5 * months, seed, |_, _| 0.0);
        let mut offsets: BTreeMap<(String, String), f64> = BTreeMap::new();
        for row in &mut rows {
            let (unit, k) = row.source.sha256.split_once(' ').unwrap();
            let days = 6 * k.parse::<i64>().unwrap();
            let started = Timestamp::from_second(1_700_000_000 + 86_400 * days).unwrap().to_string();
            let slope = drifts.filter(|(of, _)| of.to_string() == unit).map_or(0.0, |(_, slope)| slope);
            let key = (unit.to_string(), started[..7].to_string());
            let off = *offsets.entry(key).or_insert_with(|| std * draw.normal()) + slope * days as f64;
            row.c2_rad_s = row.c2_rad_s.map(|c2| c2 + off);
            row.source.started = Some(started);
        }
        rows
    }

    /// 300 fleets of 1 to 10 units over 4 to 13 months, which differ by as much as power-ons do, or twice.
    #[test]
    fn months_that_differ_raise_no_more_false_alarms() {
        for std in [SPREAD, 2.0 * SPREAD] {
            let (mut told, mut of) = (0, 0);
            for seed in 0..300 {
                let (units, months) = (1 + seed as usize % 10, 4 + seed as usize / 10 % 10);
                let all = gyros(&fleet_of_months(units, months, seed, std, None), &by_folder, 20.0);
                told += changed(&all).len();
                of += all.len();
            }
            let (n, level) = (of as f64, 0.05);
            assert!((told as f64) < n * level + 4.0 * (n * level * (1.0 - level)).sqrt(), "{std}: {told} of {of}");
        }
    }

    #[test]
    fn a_drift_is_no_difference_of_months() {
        let rows = fleet_of_months(6, 12, 9, 0.0, Some((2, SPREAD / 30.0)));
        let all = gyros(&rows, &by_folder, 365.0);
        assert_eq!((changed(&all), all[2].standing), (vec!["2"], Standing::Drifting));
        // beside months that differ as much it takes a steeper one
        let rows = fleet_of_months(6, 12, 9, SPREAD, Some((2, SPREAD / 10.0)));
        assert_eq!(changed(&gyros(&rows, &by_folder, 365.0)), ["2"]);
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
