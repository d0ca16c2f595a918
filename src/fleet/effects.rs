//! The effects over the robots of a fleet.

use super::row::{DriveRow, Fitted};
use super::share::{Shared, shared};
use crate::effects::{About, Library, Parameter};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// An effect over the robots.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct FleetEffect {
    pub id: String,
    pub title: String,
    /// The parameter that says how large it is, with its unit.
    pub parameter: String,
    /// Recordings whose diagnosis names it.
    pub named: usize,
    /// Robots whose recordings tell its size, in the order of `shared.units`.
    pub units: Vec<String>,
    /// Robots whose recordings do not.
    pub untold: Vec<String>,
    /// In which of `units` it is, and how large.
    pub shared: Shared,
    /// Whether all robots have it, or some, or it cannot be told.
    pub reach: Reach,
}

/// How far an effect reaches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Reach {
    /// All robots have it, with a probability of one half at least.
    Common,
    /// Some have it, and others do not.
    Some,
    /// None has it beyond doubt.
    CannotTell,
}

/// Probability from which on a robot counts as one that has the effect.
pub(crate) const HAS: f64 = 0.5;

/// Each effect that was fitted to `rows`, whose robots `unit` tells. Recordings of one robot are weighed by their standard deviations, which are
/// widened where they differ by more (Birge, Phys. Rev. 40 (1932) 207).
#[must_use]
pub(crate) fn over_robots(
    rows: &[DriveRow],
    unit: &dyn Fn(&DriveRow) -> Option<String>,
    library: &Library,
) -> Vec<FleetEffect> {
    let mut robots: BTreeMap<String, Vec<(&DriveRow, Fitted)>> = BTreeMap::new();
    for row in rows.iter().filter(|r| r.source.error.is_none()) {
        if let Some(robot) = unit(row) {
            robots.entry(robot).or_default().push((row, row.fitted()));
        }
    }
    let asked: BTreeSet<String> = robots.values().flatten().flat_map(|(_, f)| f.asked.iter().cloned()).collect();
    let one = |id: String| {
        let about = library.driving_by_id(&id).map(|e| e.about()).or_else(|| library.by_id(&id).map(|e| e.about()))?;
        let (size, null) = size(about)?;
        let told = robots.iter().map(|(robot, rows)| (robot.clone(), pooled(rows, about, size, null)));
        let (told, untold): (Vec<_>, Vec<_>) = told.partition(|(_, size)| size.is_some());
        let sizes: Vec<(f64, f64)> = told.iter().filter_map(|(_, size)| *size).collect();
        let shared = shared(&sizes)?.above(null);
        let reach = match &shared {
            s if s.all >= HAS && untold.is_empty() => Reach::Common,
            s if s.units.iter().any(|u| u.probability >= HAS) => Reach::Some,
            _ => Reach::CannotTell,
        };
        Some(FleetEffect {
            title: about.title.into(),
            parameter: size.name.into(),
            named: rows.iter().filter(|r| r.named().any(|n| n == id)).count(),
            units: told.into_iter().map(|(robot, _)| robot).collect(),
            untold: untold.into_iter().map(|(robot, _)| robot).collect(),
            shared,
            reach,
            id,
        })
    };
    asked.into_iter().filter_map(one).collect()
}

/// The parameter that says how large an effect is, and its value where the effect is absent: the first that switches it off.
fn size(about: &About) -> Option<(&'static Parameter, f64)> {
    about.parameters.iter().find_map(|p| Some((p, p.null?)))
}

/// Whether the size of an effect that is absent is normal about its null: it may lie on both sides, and nothing else of the effect is searched
/// for, such as a frequency or a time, which lets every recording seem to have some of it.
fn normal_about_null(about: &About) -> bool {
    size(about).is_some_and(|(size, null)| size.bounds[0] < null && size.bounds[1] > null)
        && about.parameters.iter().all(|p| p.null.is_some())
}

/// Size above the null and standard deviation by all recordings of one robot. Where a size without a sign, or one that was searched for, is not named, the
/// recording tells of none that is larger.
fn pooled(rows: &[(&DriveRow, Fitted)], about: &About, size: &Parameter, null: f64) -> Option<(f64, f64)> {
    let normal = normal_about_null(about);
    let of = |(row, fitted): &(&DriveRow, Fitted)| {
        let effect = fitted.effects.get(about.id)?;
        let (size, std) = (effect.parameters.get(size.name)? - null, *effect.std.get(size.name)?);
        let (size, std) = match normal || row.named().any(|id| id == about.id) {
            true => (size, std),
            false => (0.0, std.max(size.abs())),
        };
        (size.is_finite() && std > 0.0 && std.is_finite()).then_some((size, std))
    };
    let sizes: Vec<(f64, f64)> = rows.iter().filter_map(of).collect();
    let weight: f64 = sizes.iter().map(|(_, s)| s.powi(-2)).sum();
    if !(weight > 0.0) {
        return None;
    }
    let mean = sizes.iter().map(|(y, s)| y / (s * s)).sum::<f64>() / weight;
    let chi_squared: f64 = sizes.iter().map(|(y, s)| ((y - mean) / s).powi(2)).sum();
    let ratio = if sizes.len() > 1 { (chi_squared / (sizes.len() - 1) as f64).max(1.0) } else { 1.0 };
    Some((mean, (ratio / weight).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::drive::Driving;

    #[test]
    fn what_is_searched_for_or_has_no_sign_is_not_normal_where_it_is_absent() {
        let library = Library::new();
        let normal = |id: &str| {
            let about = library.driving_by_id(id).map(Driving::about).or_else(|| library.by_id(id).map(|e| e.about()));
            normal_about_null(about.unwrap_or_else(|| panic!("{id}")))
        };
        assert!(
            ["wheel.radius_mismatch", "vehicle.payload", "gyro.scale_factor", "gyro.rate_ramp"].into_iter().all(normal)
        );
        assert!(!["gyro.tone", "gyro.bias_step", "gyro.rate_random_walk"].into_iter().any(normal));
    }
}
