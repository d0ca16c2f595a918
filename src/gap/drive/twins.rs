//! b/(1 + radius) = (1 + track) b = b/(1 + gyro scale):   z = (v ∓ ω b)/r of the wheels and ω of the gyro are the same
//!
//! Without torques and pose no reading knows a length, nor which of two yaw rates is right: wheels with larger radii are wheels
//! on a narrower track of a robot that drives farther, and either is a gyro that reads too much. One of the three is compared,
//! and stands for all of them: the gyro's, which leaves the motion as the wheels tell it. With another one beside the free
//! forms of the gyro, the scale of all speeds would be open, and how speeds change is too roughly known to tell it.

use super::record::Record;
use crate::effects::drive::Driving;
use crate::gap::findings::WeightedSet;

/// The effects that are the same, and whether they are 1/(1 + track) - 1.
const SAME: [(&str, bool); 3] =
    [("gyro.scale_factor", true), ("vehicle.track_width", false), ("wheel.radius_scale", true)];
/// Their parameter.
const RELATIVE: &str = "relative";

/// Effects that are one and the same to a drive.
pub(super) struct Twins {
    /// The effects, but for those that another stands for.
    pub(super) told_apart: Vec<&'static dyn Driving>,
    /// Those that are the same, the one that is compared first.
    same: Vec<(&'static str, bool)>,
}

impl Twins {
    /// Of `effects` in this drive.
    pub(super) fn of(record: &Record, effects: &[&'static dyn Driving]) -> Self {
        let has = |id: &str| effects.iter().any(|e| e.about().id == id);
        let same: Vec<_> = SAME.into_iter().filter(|s| record.is_blind() && has(s.0)).collect();
        let stood_for = |e: &&&'static dyn Driving| same.iter().skip(1).any(|s| s.0 == e.about().id);
        let told_apart = effects.iter().filter(|e| !stood_for(e)).copied().collect();
        Self { told_apart, same }
    }

    /// The set, and those with each of the others in the place of the one that was compared, as probable.
    pub(super) fn all(&self, set: WeightedSet) -> Vec<WeightedSet> {
        let Some((&(first, inverse), others)) = self.same.split_first() else { return vec![set] };
        let Some(at) = set.parts.iter().position(|p| p.id == first) else { return vec![set] };
        let compared = 1.0 + set.parts[at].parameters.get(RELATIVE).copied().unwrap_or(0.0);
        let with = |&(id, other): &(&'static str, bool)| {
            let mut twin = set.clone();
            let part = &mut twin.parts[at];
            part.id = id.into();
            if other != inverse {
                part.parameters.insert(RELATIVE.into(), 1.0 / compared - 1.0);
                part.std.values_mut().for_each(|std| *std /= compared * compared);
            }
            twin
        };
        let twins: Vec<WeightedSet> = others.iter().map(with).collect();
        std::iter::once(set).chain(twins).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gap::findings::Part;

    #[test]
    fn each_of_the_same_stands_in_with_its_own_parameter() {
        let twins = Twins { told_apart: Vec::new(), same: SAME.to_vec() };
        let mut part = Part::new("gyro.scale_factor", true, 5.0);
        part.parameters.insert(RELATIVE.into(), 0.25);
        part.std.insert(RELATIVE.into(), 0.01);
        let set = WeightedSet { parts: vec![part], ln_weight: -3.0, probability: 0.0 };
        let all = twins.all(set);
        let told: Vec<(&str, f64)> =
            all.iter().map(|s| (s.parts[0].id.as_str(), s.parts[0].parameters[RELATIVE])).collect();
        // a gyro that reads 5/4 of what the wheels do, or wheels on a track of 4/5, or with radii of 5/4
        assert_eq!(told[0], ("gyro.scale_factor", 0.25));
        assert!(told[1].0 == "vehicle.track_width" && (told[1].1 + 0.2).abs() < 1e-12, "{told:?}");
        assert_eq!(told[2], ("wheel.radius_scale", 0.25));
        assert!((all[1].parts[0].std[RELATIVE] - 0.0064).abs() < 1e-12);
        assert!(all.iter().all(|s| s.ln_weight.to_bits() == (-3.0f64).to_bits()));
        let other = WeightedSet { parts: vec![Part::new("wheel.slip", true, 1.0)], ln_weight: 0.0, probability: 0.0 };
        assert_eq!(twins.all(other.clone()), vec![other]);
    }
}
