//! y = μ + β (ϑ - ϑ̄) + type + unit + month + power-on + error:  of what the differences of a fleet's power-ons are made
//!
//! y is C1, C2, ln T or ln N of a power-on, ϑ the lowest temperature of its log, which is that at power-on where the device warms up.
//! Each term but the first two is normal with a spread of its own (`crate::math::nested`); months are those of a unit, units those of a type. Where two
//! levels have the same groups (one power-on a month, one unit a type) the data tell their spreads only together, and one stands for
//! both. A unit whose mean is not of one population with the others of its type (`crate::math::outlying`) is named, and counts no more.

use super::quantity::{QUANTITIES, Quantity, observed};
use super::row::Row;
use crate::math::nested::{Grouping, Interval, LevelSpread, nested};
use crate::math::outlying::outlying;
use crate::math::{NORMAL_975, mean};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// Seed of the draws of intervals and of simulated populations.
const SEED: u64 = 1;
/// Fewest simulated populations of units.
const DRAWS: usize = 999;
/// An ordinary fleet has a unit that does not belong at an axis with this probability at most, all its types and parameters together.
pub(crate) const LEVEL: f64 = 0.05;

/// A power-on that counts.
#[derive(Debug, Clone)]
pub(super) struct Member<'a> {
    /// Its unit.
    pub unit: &'a str,
    /// Type of the unit, where types are told apart.
    pub kind: Option<String>,
    /// Its results.
    pub row: &'a Row,
}

/// Spread between the items of one level, or of several that the data do not tell apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Between {
    /// `power_on`, `month`, `unit`, `type`.
    pub levels: Vec<&'static str>,
    /// Number of items.
    pub items: usize,
    /// In the unit of the parameter; of T and N, that of the logarithm.
    #[serde(flatten)]
    pub spread: LevelSpread,
}

/// A unit that does not belong to its type.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Apart {
    /// Its name.
    pub unit: String,
    /// Distance of its mean from the median of the units, in robust standard deviations.
    pub studentized: f64,
    /// Probability of a unit as far in an ordinary fleet, all types and parameters looked at.
    pub p_value: f64,
}

/// One parameter over the fleet.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct FleetParameter {
    /// As in `TrackedParameter`.
    pub name: &'static str,
    /// Whether spreads and slope are those of the logarithm.
    pub relative: bool,
    /// Power-ons that tell it.
    pub power_ons: usize,
    /// Mean, at the mean temperature; of T and N, the geometric one.
    pub mean: Interval,
    /// The finest level first.
    pub between: Vec<Between>,
    /// Slope a °C within the units; none where not every log has a temperature, or it does not vary.
    pub per_c: Option<Interval>,
    /// Units that do not belong; they do not count.
    pub apart: Vec<Apart>,
    /// Whether there were enough units to look for such.
    pub apart_tested: bool,
}

/// The power-ons of all units at one topic and axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct FleetLevels {
    /// As in the rows.
    pub topic: Option<String>,
    /// As in the rows.
    pub axis: String,
    /// Power-ons that count and tell a parameter.
    pub power_ons: usize,
    /// Units.
    pub units: usize,
    /// Types, where they are told apart; the units without one are one more.
    pub types: Option<usize>,
    /// Calendar months, UTC; none where a log has no date.
    pub months: Option<usize>,
    /// Mean of the logs' lowest temperatures, °C, where every log has one.
    pub temperature_c: Option<f64>,
    /// One a parameter that is told.
    pub parameters: Vec<FleetParameter>,
}

/// The rows of a fleet in groups: of a power-on, a month of a unit, a unit, a type, or all.
struct Partition {
    /// Levels that have these groups; none where all rows are one.
    levels: Vec<&'static str>,
    /// Group of each row.
    of: Vec<usize>,
    groups: usize,
}

impl Partition {
    fn by<K: Ord>(level: &'static str, keys: impl Iterator<Item = K>) -> Self {
        let keys: Vec<K> = keys.collect();
        let mut number: BTreeMap<&K, usize> = BTreeMap::new();
        for key in &keys {
            let next = number.len();
            number.entry(key).or_insert(next);
        }
        Self { levels: vec![level], of: keys.iter().map(|key| number[key]).collect(), groups: number.len() }
    }

    /// A row of each group.
    fn first_rows(&self) -> Vec<usize> {
        let mut first = vec![usize::MAX; self.groups];
        self.of.iter().enumerate().for_each(|(row, g)| first[*g] = first[*g].min(row));
        first
    }

    /// Those of `members`, the finest first and all in one last; of levels with the same groups one stands for all.
    fn all(members: &[&Member<'_>]) -> Vec<Self> {
        let unit = |m: &&Member<'_>| (m.kind.clone(), m.unit.to_string());
        let mut given = vec![Self::by("power_on", 0..members.len())];
        if members.iter().all(|m| m.row.month().is_some()) {
            given.push(Self::by("month", members.iter().map(|m| (unit(m), m.row.month()))));
        }
        given.push(Self::by("unit", members.iter().map(unit)));
        given.push(Self::by("type", members.iter().map(|m| &m.kind)));
        given.push(Self { levels: Vec::new(), of: vec![0; members.len()], groups: 1 });
        let mut kept: Vec<Self> = Vec::new();
        for next in given {
            match kept.last_mut() {
                Some(last) if last.groups == next.groups && next.levels.is_empty() => last.levels.clear(),
                Some(last) if last.groups == next.groups => last.levels.extend(next.levels),
                _ => kept.push(next),
            }
        }
        kept
    }
}

/// `quantity` over `members`; none where too few tell it.
fn parameter(quantity: &Quantity, members: &[Member<'_>]) -> Option<FleetParameter> {
    let (told, numbers): (Vec<&Member<'_>>, Vec<[f64; 2]>) =
        members.iter().filter_map(|m| Some((m, observed(quantity, m.row)?))).unzip();
    let partitions = Partition::all(&told);
    let above = |pair: &[Partition]| Grouping {
        group: pair[0].first_rows().into_iter().map(|row| pair[1].of[row]).collect(),
        groups: pair[1].groups,
    };
    let groupings: Vec<Grouping> = partitions.windows(2).map(above).collect();
    let temperatures: Option<Vec<f64>> = told.iter().map(|m| m.row.temperature_low_c).collect();
    // of units with one power-on each the slope would be one between units
    let temperatures = temperatures.filter(|_| !partitions[0].levels.contains(&"unit"));
    let found = nested(&numbers, temperatures.as_deref(), &groupings, SEED)?;
    let back = |v: f64| if quantity.1 { v.exp() } else { v };
    let between = partitions.iter().zip(&found.levels).map(|(p, level)| Between {
        levels: p.levels.clone(),
        items: p.groups,
        spread: *level,
    });
    let units = partitions.iter().position(|p| p.levels.contains(&"unit") && !p.levels.contains(&"type"));
    let apart = units.filter(|k| *k < groupings.len()).and_then(|k| {
        let names: Vec<&str> = partitions[k].first_rows().into_iter().map(|row| told[row].unit).collect();
        let mut means = found.items[k].clone();
        if let (Some(t), Some(slope)) = (&temperatures, found.slope) {
            // the slope's own error, by how much the unit was colder than its type
            let std = (slope.ci95[1] - slope.ci95[0]) / (2.0 * NORMAL_975);
            let colder = from_group(&partitions[k], &partitions[k + 1], t);
            means.iter_mut().zip(colder).for_each(|(m, x)| m[1] += (std * x).powi(2));
        }
        apart(&names, &means, &groupings[k])
    });
    Some(FleetParameter {
        name: quantity.0,
        relative: quantity.1,
        power_ons: told.len(),
        mean: Interval { value: back(found.mean.value), ci95: found.mean.ci95.map(back) },
        between: between.collect(),
        per_c: found.slope,
        apart_tested: apart.is_some(),
        apart: apart.unwrap_or_default(),
    })
}

/// Mean of `x` over each group of `inner` less that over the group of `outer` that it is in.
fn from_group(inner: &Partition, outer: &Partition, x: &[f64]) -> Vec<f64> {
    let means = |p: &Partition| {
        let mut sums = vec![[0.0; 2]; p.groups];
        p.of.iter().zip(x).for_each(|(g, x)| sums[*g] = [sums[*g][0] + x, sums[*g][1] + 1.0]);
        sums.into_iter().map(|[sum, n]| sum / n).collect::<Vec<f64>>()
    };
    let [own, of_outer] = [inner, outer].map(means);
    inner.first_rows().into_iter().zip(own).map(|(row, own)| own - of_outer[outer.of[row]]).collect()
}

/// Every unit held against those of its type; none where no type has enough of them.
fn apart(names: &[&str], means: &[[f64; 2]], types: &Grouping) -> Option<Vec<Apart>> {
    let mut all = Vec::new();
    let mut tests = 0.0;
    // so many that the least p value of them, times the tests, is below the level
    let draws = DRAWS.max(40 * types.groups * QUANTITIES.len());
    for kind in 0..types.groups {
        let own: Vec<usize> = (0..names.len()).filter(|i| types.group[*i] == kind).collect();
        let values: Vec<f64> = own.iter().map(|i| means[*i][0]).collect();
        let errors: Vec<f64> = own.iter().map(|i| means[*i][1].sqrt()).collect();
        let Some(found) = outlying(&values, &errors, draws, SEED) else { continue };
        tests += 1.0;
        all.extend(own.into_iter().zip(found).map(|(i, o)| Apart {
            unit: names[i].to_string(),
            studentized: o.studentized,
            p_value: o.p_value,
        }));
    }
    all.iter_mut().for_each(|a| a.p_value *= tests);
    (tests > 0.0).then_some(all)
}

impl FleetLevels {
    /// Of `members`, power-ons at one topic and axis.
    pub(super) fn of(members: &[Member<'_>]) -> Option<Self> {
        let tells = |m: &&Member<'_>| QUANTITIES.iter().any(|quantity| observed(quantity, m.row).is_some());
        let members: Vec<Member<'_>> = members.iter().filter(tells).cloned().collect();
        let members = members.as_slice();
        let source = &members.first()?.row.source;
        let told = QUANTITIES.iter().filter_map(|quantity| Some((quantity, parameter(quantity, members)?)));
        let told: Vec<(&Quantity, FleetParameter)> = told.collect();
        // Bonferroni over the parameters
        let tests = told.iter().filter(|(_, p)| p.apart_tested).count() as f64;
        let settled = |(quantity, mut p): (&Quantity, FleetParameter)| {
            p.apart.iter_mut().for_each(|a| a.p_value = (a.p_value * tests).min(1.0));
            p.apart.retain(|a| a.p_value <= LEVEL);
            if p.apart.is_empty() {
                return p;
            }
            let belongs = |m: &&Member<'_>| !p.apart.iter().any(|a| a.unit == m.unit);
            let left: Vec<Member<'_>> = members.iter().filter(belongs).cloned().collect();
            match parameter(quantity, &left) {
                Some(again) => FleetParameter { apart: p.apart, apart_tested: true, ..again },
                None => p,
            }
        };
        let distinct = |keys: Vec<Option<&str>>| keys.into_iter().collect::<BTreeSet<_>>().len();
        let months: Vec<Option<&str>> = members.iter().map(|m| m.row.month()).collect();
        let kinds: Vec<Option<&str>> = members.iter().map(|m| m.kind.as_deref()).collect();
        let temperatures: Option<Vec<f64>> = members.iter().map(|m| m.row.temperature_low_c).collect();
        Some(Self {
            topic: source.topic.clone(),
            axis: source.axis.clone(),
            power_ons: members.len(),
            units: distinct(members.iter().map(|m| Some(m.unit)).collect()),
            months: months.iter().all(Option::is_some).then(|| distinct(months)),
            types: kinds.iter().any(Option::is_some).then(|| distinct(kinds)),
            temperature_c: temperatures.map(|t| mean(t.into_iter())),
            parameters: told.into_iter().map(settled).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::source::Source;
    use super::*;
    use crate::math::random::Stream;

    /// Spreads of C2 between power-ons, months, units and types, rad/s.
    const STD: [f64; 4] = [3e-4, 5e-4, 1e-3, 2e-3];
    /// Slope of C2 with temperature, rad/s/°C.
    const PER_C: f64 = 2e-5;

    /// Rows of types, units of each, months, power-ons in each month; C1, T and N differ between power-ons alone.
    fn fleet([types, units, months, power_ons]: [usize; 4], seed: u64) -> Vec<Row> {
        let mut draw = Stream::new(seed, 3);
        let mut rows = Vec::new();
        for kind in 0..types {
            let of_type = STD[3] * draw.normal();
            for unit in 0..units {
                let of_unit = of_type + STD[2] * draw.normal();
                for month in 0..months {
                    let of_month = of_unit + STD[1] * draw.normal();
                    for day in 0..power_ons {
                        let temperature = 20.0 + 2.0 * month as f64 + 3.0 * draw.normal();
                        let mut spread = |std: f64, error: f64| std * draw.normal() + error * draw.normal();
                        rows.push(Row {
                            source: Source {
                                path: format!("type_{kind}/{unit}/{month}_{day}.csv"),
                                axis: "z".into(),
                                started: Some(format!("2026-{:02}-{:02}T08:00:00Z", month + 1, day + 1)),
                                ..Source::default()
                            },
                            c1_rad_s: Some(2e-3 + spread(1e-4, 1e-5)),
                            c1_std_rad_s: Some(1e-5),
                            c2_rad_s: Some(-5e-3 + of_month + PER_C * (temperature - 20.0) + spread(STD[0], 1e-4)),
                            c2_std_rad_s: Some(1e-4),
                            time_constant_s: Some(120.0 * spread(0.05, 0.01).exp()),
                            time_constant_std_s: Some(1.2),
                            angle_random_walk_rad_sqrt_s: Some(1e-4 * spread(0.02, 0.01).exp()),
                            degrees_of_freedom: Some(5000.0),
                            temperature_low_c: Some(temperature),
                            ..Row::default()
                        });
                    }
                }
            }
        }
        rows
    }

    /// Of rows whose paths name type and unit.
    fn levels(rows: &[Row], types: bool) -> FleetLevels {
        fn member(row: &Row, types: bool) -> Member<'_> {
            let unit = row.source.path.rsplit_once('/').unwrap().0;
            let kind = types.then(|| unit.split_once('/').unwrap().0.to_string());
            Member { unit, kind, row }
        }
        FleetLevels::of(&rows.iter().map(|row| member(row, types)).collect::<Vec<_>>()).unwrap()
    }

    fn labels(levels: &FleetLevels) -> Vec<(String, usize)> {
        levels.parameters[1].between.iter().map(|b| (b.levels.join("+"), b.items)).collect()
    }

    fn named(labels: &[(&str, usize)]) -> Vec<(String, usize)> {
        labels.iter().map(|(level, items)| (level.to_string(), *items)).collect()
    }

    #[test]
    fn levels_that_the_data_do_not_tell_apart_are_one() {
        let all = levels(&fleet([2, 3, 2, 2], 1), true);
        assert_eq!(labels(&all), named(&[("power_on", 24), ("month", 12), ("unit", 6), ("type", 2)]));
        assert_eq!((all.power_ons, all.units, all.types, all.months), (24, 6, Some(2), Some(2)));
        let mut rows = fleet([2, 3, 2, 2], 1);
        assert_eq!(labels(&levels(&rows, false)), named(&[("power_on", 24), ("month", 12), ("unit", 6)]));
        rows[3].source.started = None;
        let undated = levels(&rows, true);
        assert_eq!(labels(&undated), named(&[("power_on", 24), ("unit", 6), ("type", 2)]));
        assert_eq!(undated.months, None);
        let of = |shape| labels(&levels(&fleet(shape, 1), true));
        assert_eq!(of([2, 3, 4, 1]), named(&[("power_on+month", 24), ("unit", 6), ("type", 2)]));
        assert_eq!(of([2, 3, 1, 4]), named(&[("power_on", 24), ("month+unit", 6), ("type", 2)]));
        assert_eq!(of([3, 1, 2, 2]), named(&[("power_on", 12), ("month", 6), ("unit+type", 3)]));
        assert_eq!(of([1, 4, 1, 1]), named(&[("power_on+month+unit", 4)]));
        assert_eq!(of([1, 1, 2, 2]), named(&[("power_on", 4), ("month", 2)]));
        assert_eq!(levels(&fleet([1, 1, 1, 1], 1), true).parameters, []);
    }

    #[test]
    fn each_level_gets_its_spread_and_temperature_its_slope() {
        let (runs, mut held) = (40, [0; 5]);
        for seed in 0..runs {
            let found = levels(&fleet([3, 4, 3, 3], seed), true);
            let c2 = &found.parameters[1];
            let holds = |ci: [f64; 2], truth: f64| usize::from(ci[0] <= truth && truth <= ci[1]);
            for (k, between) in c2.between.iter().enumerate() {
                held[k] += holds(between.spread.ci95, STD[k]);
            }
            held[4] += holds(c2.per_c.unwrap().ci95, PER_C);
        }
        // 95 %, less three binomial standard deviations
        let least = (runs as f64 * 0.95 - 3.0 * (runs as f64 * 0.95 * 0.05).sqrt()) as usize;
        assert!(held.iter().all(|n| *n >= least), "{held:?} of {runs}");
    }

    #[test]
    fn a_unit_that_does_not_belong_is_named_and_counts_no_more() {
        let mut rows = fleet([2, 6, 1, 4], 5);
        let own = |row: &Row| row.source.path.starts_with("type_1/3/");
        rows.iter_mut().filter(|r| own(r)).for_each(|r| r.time_constant_s = r.time_constant_s.map(|t| 2.0 * t));
        let found = levels(&rows, true);
        let t = &found.parameters[2];
        let apart: Vec<&str> = t.apart.iter().map(|a| a.unit.as_str()).collect();
        assert!(t.apart_tested && apart == ["type_1/3"] && t.apart[0].p_value <= LEVEL, "{t:?}");
        assert_eq!((t.power_ons, t.between[1].items), (44, 11));
        let without: Vec<Row> = rows.iter().filter(|r| !own(r)).cloned().collect();
        assert_eq!(levels(&without, true).parameters[2].between, t.between);
        assert!(found.parameters.iter().filter(|p| p.name != t.name).all(|p| p.apart.is_empty()));
    }

    #[test]
    fn a_unit_at_another_temperature_belongs_to_the_others() {
        let runs = 40;
        let alarms = (0..runs).filter(|seed| {
            let mut rows = fleet([1, 6, 1, 6], 300 + seed);
            for row in rows.iter_mut().filter(|r| r.source.path.starts_with("type_0/3/")) {
                row.temperature_low_c = row.temperature_low_c.map(|t| t - 60.0);
                row.c2_rad_s = row.c2_rad_s.map(|c2| c2 - 60.0 * PER_C);
            }
            levels(&rows, true).parameters.iter().any(|p| !p.apart.is_empty())
        });
        let (n, alarms) = (runs as f64, alarms.count() as f64);
        assert!(alarms <= n * LEVEL + 3.0 * (n * LEVEL * (1.0 - LEVEL)).sqrt(), "{alarms} of {n}");
    }

    #[test]
    fn an_ordinary_fleet_has_no_such_unit_but_at_the_stated_rate() {
        let runs = 60;
        let alarms = (0..runs).filter(|seed| {
            let found = levels(&fleet([2, 6, 1, 3], 100 + seed), true);
            found.parameters.iter().any(|p| !p.apart.is_empty())
        });
        let (n, alarms) = (runs as f64, alarms.count() as f64);
        assert!(alarms <= n * LEVEL + 3.0 * (n * LEVEL * (1.0 - LEVEL)).sqrt(), "{alarms} of {n}");
    }
}
