//! b/(1 + radius) = (1 + track) b = b/(1 + gyro scale):   z = (v ∓ ω b)/r of the wheels and ω of the gyro are the same
//! 1/(1 + radius of one wheel) = 1 - its lost ticks:   z_i is the same
//!
//! Without torques and pose no reading tells a length, nor which of two yaw rates is right. Wheels with larger radii
//! equal wheels on a narrower track of a robot that drives farther, and either equals a gyro that reads too much. One
//! of the three is compared and represents all: the gyro's scale, which leaves the motion as the wheels tell it. With
//! another one beside the free forms of the gyro, the scale of all speeds would be open, and the diffusion of the
//! speeds is too roughly known to tell it.
//! The likelihood is the same, θ' = θ'(θ), so that p(θ' | z) : p(θ | z) = p(θ') |dθ'/dθ| : p(θ). The priors decide: of
//! a gyro's gain by its data sheet, of a track by how the robot steers.
//!
//! A wheel with a larger radius turns less on the same way, and seems to where ticks are lost on average: its radius is
//! compared. Torques tell them apart, since they move the wheel and not its reading.

use super::apparent_delays::{Slip, ln_density};
use crate::config::Steering;
use crate::effects::drive::{
    Coordinate, DriveExplanation, Driving, Equivalent, Map, ModelChange, Within, by_id, registry,
};
use crate::gap::answer::Alike;
use crate::gap::drive::fit::evidence::ln_possible;
use crate::gap::drive::record::Record;
use crate::gap::selection::prior::Prior;
use crate::gap::selection::sets::{Part, WeightedSet};
use crate::gap::trace::{Decision, Step, TraceStage};

/// Prior share of lost ticks whose bursts do not show singly.
pub(crate) const UNSEEN: f64 = 0.5;

/// An effect, and the equivalent effect that is compared in its place.
#[derive(Clone, Copy)]
struct Twin {
    /// Id of the effect that is compared.
    of: &'static str,
    id: &'static str,
    to: Equivalent,
}

/// All pairs of the library.
fn twins() -> impl Iterator<Item = Twin> {
    registry().iter().flat_map(|effect| {
        let to = effect.change().map_or(&[][..], ModelChange::equivalents);
        to.iter().map(|to| Twin { of: effect.about().id, id: to.effect.about().id, to: *to })
    })
}

impl Twin {
    /// Whether both are the same to this drive.
    fn is_same(&self, record: &Record) -> bool {
        match self.to.within {
            Within::NoTorques => record.torques_n_m.is_none(),
            Within::GyroAndWheels => record.is_blind(),
        }
    }

    fn is_loss(&self) -> bool {
        self.to.map == Map::Loss
    }

    /// ln prior odds relative to the compared effect, without the priors of their sizes; `sure`: the value over its
    /// standard deviation.
    fn ln_odds(&self, sure: f64) -> f64 {
        // lost ticks whose bursts show are looked for elsewhere, and half of the others are those of the other wheel
        if self.is_loss() { (0.5 * UNSEEN).ln() + ln_possible(sure) } else { 0.0 }
    }

    fn law(&self) -> Option<&'static dyn ModelChange> {
        law(self.id, self.to.side)
    }
}

/// Effects that are equivalent in a drive.
pub(crate) struct StructuralClasses {
    /// The effects without those that another one represents.
    pub(crate) told_apart: Vec<&'static dyn Driving>,
    /// The effects that another one represents.
    same: Vec<Twin>,
    /// Slip, where it and a late gyro are equivalent; else none.
    slip: Option<Slip>,
    /// Steering, where it is stated.
    steering: Option<Steering>,
}

impl StructuralClasses {
    /// Equivalences of `effects` in this drive.
    pub(crate) fn of(record: &Record, effects: &[&'static dyn Driving]) -> Self {
        let same: Vec<Twin> = same(record, effects).collect();
        // single bursts of lost ticks are looked for all the same
        let stood_for = |e: &&&'static dyn Driving| same.iter().any(|t| t.id == e.about().id && !t.is_loss());
        let told_apart = effects.iter().filter(|e| !stood_for(e)).copied().collect();
        Self { told_apart, same, slip: Slip::of(record, effects), steering: record.belief.steering }
    }

    /// Whether no reading of this drive tells two effects apart, by their ids.
    pub(crate) fn are_same(&self, one: &str, other: &str) -> bool {
        let compared = |id| self.same.iter().find(|twin| twin.id == id).map_or(id, |twin| twin.of);
        compared(one) == compared(other)
    }

    /// Effects that are not compared, with the one that is compared in their place, as steps of the trail.
    pub(crate) fn steps(&self) -> Vec<Step> {
        let one = |twin: &Twin| {
            let reason = format!(
                "this drive cannot tell it from {}, which is compared for both; the priors of their sizes decide",
                twin.of
            );
            Step::new(TraceStage::Screening, twin.id, Decision::Removed, reason)
        };
        self.same.iter().filter(|t| !t.is_loss()).map(one).collect()
    }

    /// The set, and the sets with each equivalent effect in the place of the compared one; `prior`: odds of one more effect.
    pub(crate) fn all(&self, set: WeightedSet, prior: &Prior) -> Vec<WeightedSet> {
        let all = match &self.slip {
            Some(slip) => slip.all(set, prior.ln_named),
            None => vec![set],
        };
        all.into_iter().flat_map(|set| self.scaled(set)).collect()
    }

    /// The set with each part as itself, and as each effect that it represents.
    fn scaled(&self, set: WeightedSet) -> Vec<WeightedSet> {
        let mut all = vec![set];
        for at in 0..all[0].parts.len() {
            all = all.into_iter().flat_map(|set| self.scaled_at(set, at)).collect();
        }
        all
    }

    fn scaled_at(&self, set: WeightedSet, at: usize) -> Vec<WeightedSet> {
        let part = &set.parts[at];
        let twins = || self.same.iter().filter(|t| t.of == part.id);
        let (Some(one), Some(own)) = (twins().next(), law(&part.id, 0)) else { return vec![set] };
        let x = own.theta(&part.parameters)[0];
        let std = part.std.values().copied().fold(0.0, f64::max);
        let scale = |law: &dyn ModelChange| law.coordinates_of(self.steering)[0].scale;
        let used = ln_density(widened(one.of, own, &self.same, self.steering), x);
        let with = |twin: &Twin| {
            let (law, value, slope) = (twin.law()?, twin.to.map.value(x), twin.to.map.slope(x));
            let mut other = set.clone();
            let part = &mut other.parts[at];
            part.id = twin.id.into();
            part.parameters = law.parameters(&[value]);
            // parameters are linear in the coordinate
            let beside = law.parameters(&[value + 1.0]);
            part.std =
                part.parameters.iter().map(|(name, v)| (name.clone(), (beside[name] - v) * std * slope)).collect();
            other.ln_weight += ln_density(scale(law), value) + slope.ln() - used + twin.ln_odds(x / std);
            let is_possible = !twin.is_loss() || value > 0.0;
            (is_possible && !set.parts.iter().any(|p| p.id == twin.id)).then_some(other)
        };
        let others: Vec<WeightedSet> = twins().filter_map(with).collect();
        let ln_weight = set.ln_weight + ln_density(scale(own), x) - used;
        std::iter::once(WeightedSet { ln_weight, ..set }).chain(others).collect()
    }

    /// The most plausible of the effects that a part represents, itself included.
    pub(crate) fn plausible(&self, part: Part) -> Part {
        let set = WeightedSet { parts: vec![part.clone()], ln_weight: 0.0, probability: 0.0 };
        let best = self.scaled(set).into_iter().max_by(|a, b| a.ln_weight.total_cmp(&b.ln_weight));
        best.and_then(|set| set.parts.into_iter().next()).unwrap_or(part)
    }

    /// Classes of effects equivalent to a part, for each part that has some; the part itself is first.
    pub(crate) fn classes(&self, parts: &[Part]) -> Vec<Alike> {
        let class = |told: &Part| {
            let is_mean_of = |t: &Twin| {
                let loss = t.to.effect.tick_loss();
                loss.is_some_and(|l| l.is_mean(&told.parameters) && l.side(&told.parameters) == t.to.side)
            };
            let lost = |t: &Twin| !t.is_loss() || is_mean_of(t);
            let found = self.same.iter().find(|t| t.of == told.id || t.id == told.id && lost(t))?;
            // wheels that lose ticks turn faster than they read, never slower
            let x = law(found.of, 0).map(|own| own.theta(&told.parameters)[0]).filter(|_| told.id == found.of);
            let may = |t: &&Twin| t.of == found.of && !(t.is_loss() && x.is_some_and(|x| t.to.map.value(x) <= 0.0));
            let all = std::iter::once(found.of).chain(self.same.iter().filter(may).map(|t| t.id));
            let others = all.filter(|id| *id != told.id);
            let ids: Vec<String> = std::iter::once(told.id.as_str()).chain(others).map(str::to_owned).collect();
            let pose = if found.is_loss() { "" } else { "a pose reference, or " };
            let separate_by = format!("{pose}the wheels' torques in the log");
            (ids.len() > 1).then_some(Alike { ids, overlap: 1.0, separate_by })
        };
        parts.iter().filter_map(class).collect()
    }
}

/// Those of `effects` that another one represents in this drive.
fn same(record: &Record, effects: &[&'static dyn Driving]) -> impl Iterator<Item = Twin> {
    let has = |id: &str| effects.iter().any(|e| e.about().id == id);
    twins().filter(move |t| t.is_same(record) && has(t.of) && has(t.id))
}

/// Whether the mean loss of ticks is represented by one wheel's radius, to which it is equivalent.
pub(crate) fn is_lost_by_radius(record: &Record, effects: &[&'static dyn Driving]) -> bool {
    same(record, effects).any(|t| t.is_loss())
}

/// Model change of an effect; of one wheel where it has one for each.
fn law(id: &str, side: usize) -> Option<&'static dyn ModelChange> {
    match by_id(id)?.explanation() {
        DriveExplanation::Model(law) => Some(law),
        DriveExplanation::MissedTicks(loss) => Some(loss.mean()[side]),
        _ => None,
    }
}

/// Prior scales of the first coordinate of the effect `of`, `own` its change, up to the largest of those that it
/// represents.
fn widened(of: &str, own: &dyn ModelChange, same: &[Twin], steering: Option<Steering>) -> [f64; 2] {
    let scale = |law: &dyn ModelChange| law.coordinates_of(steering)[0].scale;
    let [least, most] = scale(own);
    let others = same.iter().filter(|t| t.of == of).filter_map(Twin::law);
    [least, others.map(|law| scale(law)[1]).fold(most, f64::max)]
}

/// Coordinates of an effect with plausible sizes for this robot, also those of the effects that it represents.
pub(crate) fn sizes(record: &Record, id: &str, change: &dyn ModelChange) -> Vec<Coordinate> {
    let steering = record.belief.steering;
    let mut own = change.coordinates_of(steering).to_vec();
    let same: Vec<Twin> = twins().filter(|t| t.is_same(record)).collect();
    own[0].scale = widened(id, change, &same, steering);
    own
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::drive::ids;

    const RELATIVE: &str = "relative";

    #[test]
    fn each_of_the_same_stands_in_with_its_own_parameter() {
        let twins = StructuralClasses { told_apart: Vec::new(), same: twins().collect(), slip: None, steering: None };
        let mut part = Part::new(ids::scale_factor(), true, 5.0);
        part.parameters.insert(RELATIVE.into(), 0.25);
        part.std.insert(RELATIVE.into(), 0.01);
        let set = WeightedSet { parts: vec![part], ln_weight: -3.0, probability: 0.0 };
        let all = twins.all(set, &Prior::of_drives());
        let told: Vec<(&str, f64)> =
            all.iter().map(|s| (s.parts[0].id.as_str(), s.parts[0].parameters[RELATIVE])).collect();
        // a gyro that reads 5/4 of what the wheels do, or wheels on a track of 4/5, or with radii of 5/4
        assert_eq!(told[0], (ids::scale_factor(), 0.25));
        assert!(told[1].0 == ids::track_width() && (told[1].1 + 0.2).abs() < 1e-12, "{told:?}");
        assert_eq!(told[2], (ids::radius_scale(), 0.25));
        assert!((all[1].parts[0].std[RELATIVE] - 0.0064).abs() < 1e-12);
        assert_eq!(twins.plausible(all[0].parts[0].clone()).id, ids::track_width());
        // no gyro and no radius is off by a quarter, and a track of four fifths is well within what robots have
        assert!(all[1].ln_weight > all[2].ln_weight + 5.0 && all[2].ln_weight > all[0].ln_weight + 10.0, "{all:?}");
        let other = WeightedSet { parts: vec![Part::new(ids::slip(), true, 1.0)], ln_weight: 0.0, probability: 0.0 };
        assert_eq!(twins.all(other.clone(), &Prior::of_drives()), vec![other]);
    }

    #[test]
    fn a_larger_radius_may_be_lost_ticks_of_the_same_wheel() {
        let twins = StructuralClasses { told_apart: Vec::new(), same: twins().collect(), slip: None, steering: None };
        let found = |relative: f64| {
            let mut part = Part::new(ids::radius_right(), true, 5.0);
            part.parameters.insert(RELATIVE.into(), relative);
            part.std.insert(RELATIVE.into(), 1e-3);
            WeightedSet { parts: vec![part], ln_weight: -3.0, probability: 0.0 }
        };
        let all = twins.all(found(0.02), &Prior::of_drives());
        assert_eq!(all.len(), 2);
        let ticks = &all[1].parts[0];
        let loss = by_id(ids::missed_ticks()).and_then(|e| e.tick_loss()).unwrap();
        assert!(ticks.id == ids::missed_ticks() && loss.is_mean(&ticks.parameters), "{ticks:?}");
        assert_eq!(loss.side(&ticks.parameters), 1);
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} {b}");
        close(ticks.parameters["loss_fraction"], 0.02 / 1.02);
        close(ticks.std["loss_fraction"], 1e-3 / 1.02f64.powi(2));
        close(ticks.std["right"], 0.0);
        // a quarter is of this wheel and does not show in bursts, none of which could be negative; scales are those of
        // a radius
        assert!((all[1].ln_weight - all[0].ln_weight - 0.5f64.ln()).abs() < 0.05, "{all:?}");
        let class = &twins.classes(&all[1].parts)[0];
        assert_eq!(class.ids, [ids::missed_ticks(), ids::radius_right()]);
        assert_eq!(class.separate_by, "the wheels' torques in the log");
        assert_eq!(twins.classes(&all[0].parts)[0].ids, [ids::radius_right(), ids::missed_ticks()]);
        assert_eq!(twins.classes(&found(-0.02).parts), Vec::new());
        // no ticks are gained, and none are lost on average beside those whose bursts are found
        assert_eq!(twins.all(found(-0.02), &Prior::of_drives()).len(), 1);
        let mut bursts = found(0.02);
        bursts.parts.push(Part::new(ids::missed_ticks(), true, 9.0));
        assert_eq!(twins.all(bursts, &Prior::of_drives()).len(), 1);
    }
}
