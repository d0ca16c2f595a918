//! (τ_wheels, τ_gyro, τ_pose) ~ (τ_wheels - s, τ_gyro - s, τ_pose - s): a delay s that all sensors share is none of theirs

use crate::effects::{About, Parameters};
use crate::gap::selection::prior::Prior;
use crate::gap::selection::sets::{Part, WeightedSet};

/// Standard deviations within which two delays are the same.
const SAME_STDS: f64 = 3.0;

/// A sensor's delay in a set.
struct Delay {
    /// Index of its part.
    part: usize,
    /// Name of its parameter.
    name: &'static str,
    delay_s: f64,
    std_s: f64,
}

impl Delay {
    /// The delay of the sensor `late` in `set`; none where it is not in it, or not known.
    fn of(set: &WeightedSet, late: &About) -> Option<Self> {
        let part = set.parts.iter().position(|p| p.id == late.id)?;
        let value = |of: &Parameters| of.get(late.size()).copied();
        let delay_s = value(&set.parts[part].parameters)?;
        let std_s = value(&set.parts[part].std).filter(|std_s| *std_s > 0.0)?;
        Some(Self { part, name: late.size(), delay_s, std_s })
    }
}

/// `set` without a delay s that wheels, gyro and reference share: the delays τ of all and τ - s are one account. Without
/// torques no reading tells s, and the account is told whose smallest delay is zero. With `torques` it is these that
/// act late, whatever the cause, which is no delay of a sensor. `late`: the effects of the sensors that were logged;
/// the set keeps its evidence, and pays for as many terms as it has.
#[must_use]
pub(crate) fn without_common(mut set: WeightedSet, late: &[&About], torques: bool, prior: &Prior) -> WeightedSet {
    let found: Option<Vec<Delay>> = late.iter().map(|late| Delay::of(&set, late)).collect();
    let Some(mut all) = found else { return set };
    all.sort_by(|a, b| a.delay_s.total_cmp(&b.delay_s));
    let Some(first) = all.first() else { return set };
    let is_same = |d: &&Delay| d.delay_s - first.delay_s <= SAME_STDS * d.std_s.hypot(first.std_s);
    let same = all.iter().take_while(is_same).count();
    if all.len() < 2 || first.delay_s <= 0.0 || (same == all.len()) != torques {
        return set;
    }
    let (shared, others) = all.split_at(same);
    let weight: f64 = shared.iter().map(|d| d.std_s.powi(-2)).sum();
    let common_s = shared.iter().map(|d| d.delay_s * d.std_s.powi(-2)).sum::<f64>() / weight;
    let common_std_s = weight.sqrt().recip();
    for d in others {
        let part = &mut set.parts[d.part];
        part.parameters.insert(d.name.into(), d.delay_s - common_s);
        part.std.insert(d.name.into(), d.std_s.hypot(common_std_s));
    }
    let share: f64 = shared.iter().map(|d| set.parts[d.part].share).sum();
    let gone: Vec<String> = shared.iter().map(|d| set.parts[d.part].id.clone()).collect();
    set.ln_weight -= gone.len() as f64 * prior.ln_named;
    match others.last() {
        Some(last) => set.parts[last.part].share += share,
        None => {
            let text = format!(
                "all sensors lag the torques by {:.2} ± {:.2} ms: the motors, or the commands on their way to them, act late",
                1e3 * common_s,
                1e3 * common_std_s
            );
            set.parts.push(Part::described("free.force.late", false, share, text));
            set.ln_weight += prior.ln_free;
        }
    }
    set.parts.retain(|part| !gone.contains(&part.id));
    set
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::drive::{late, registry};
    use crate::gap::selection::sets::Part;
    use crate::model::drive::Instrument;

    /// A set with these delays of wheels, gyro and reference, and their standard deviations, ms.
    fn of_delays(delays: &[(Instrument, f64, f64)]) -> WeightedSet {
        let part = |(of, delay_ms, std_ms): &(Instrument, f64, f64)| {
            let about = late(registry(), *of).unwrap();
            let one = |value: f64| Parameters::from([(about.size().into(), 1e-3 * value)]);
            Part { parameters: one(*delay_ms), std: one(*std_ms), ..Part::new(about.id, true, 10.0) }
        };
        WeightedSet { parts: delays.iter().map(part).collect(), ln_weight: 0.0, probability: 1.0 }
    }

    #[test]
    fn a_delay_that_all_sensors_share_is_none() {
        use Instrument::{Gyro, Pose, Wheels};
        let all: Vec<&About> = [Wheels, Gyro, Pose].iter().map(|of| late(registry(), *of).unwrap()).collect();
        let prior = Prior::of_drives();
        let told = |delays: &[(Instrument, f64, f64)], late: &[&About]| {
            let set = without_common(of_delays(delays), late, false, &prior);
            let ms = |p: &Part| p.parameters.values().next().map(|v| (1e4 * v).round() / 10.0);
            set.parts.iter().map(|p| (p.id.clone(), ms(p).unwrap(), p.share)).collect::<Vec<_>>()
        };
        // moved by a whole row, the rest stands as a delay of both others
        let moved = [(Wheels, 10.0, 0.3), (Gyro, 3.7, 0.1), (Pose, 3.9, 0.2)];
        assert_eq!(told(&moved, &all), [(all[0].id.to_owned(), 6.3, 30.0)]);
        // the reference is later than both
        let late_pose = [(Wheels, 10.0, 0.3), (Gyro, 3.7, 0.1), (Pose, 30.0, 0.2)];
        assert_eq!(told(&late_pose, &all), [(all[0].id.to_owned(), 6.3, 10.0), (all[2].id.to_owned(), 26.3, 20.0)]);
        // a sensor in time: nothing is shared; without a reference in the log there are two
        assert_eq!(told(&moved[..2], &all).len(), 2);
        assert_eq!(told(&moved[..2], &all[..2]), [(all[0].id.to_owned(), 6.3, 20.0)]);
        // all alike says nothing of any of them
        let alike = [(Wheels, 3.6, 0.3), (Gyro, 3.7, 0.1), (Pose, 3.9, 0.2)];
        assert_eq!(told(&alike, &all).len(), 3);
        // with torques it is these that act late, and where one sensor is later than the others these are known
        let set = without_common(of_delays(&alike), &all, true, &prior);
        let parts: Vec<_> = set.parts.iter().map(|p| (p.id.as_str(), p.named, p.share)).collect();
        assert_eq!(parts, [("free.force.late", false, 30.0)]);
        assert!(set.parts[0].description.contains("3.73 ± 0.09 ms"), "{}", set.parts[0].description);
        assert!((set.ln_weight - (prior.ln_free - 3.0 * prior.ln_named)).abs() < 1e-12);
        assert_eq!(without_common(of_delays(&moved), &all, true, &prior), of_delays(&moved));
    }
}
