//! ω(t - τ) ≈ ω - τ dω/dt,  ω of slipping wheels ≈ ω + κ J |v|/(b² M g) dω/dt,  their v ≈ v + κ |v|/g dv/dt
//!
//! Without torques nothing tells the force by which wheels slip, so that slip is not compared. Rims that run ahead of
//! the ground while the yaw rate grows run ahead of the gyro, as they do where the gyro is late: an apparent delay of
//! the gyro may be slip. The likelihood does not decide: forces would have to come from accelerations of the same
//! wheels, and slip would follow their noise and win even where the gyro is late.
//!
//! Rims that run ahead of the ground run ahead of the reference, too. A late gyro and a late reference are then one effect and
//! not two, where both delays are those of one slip, or one and the same: by the ratio of the densities of the reference's
//! delay, where it is bound to that of the gyro and where it is not (Dickey, Ann. Math. Statist. 42 (1971) 204).

use crate::effects::drive::{Driving, ModelChange, by_id, late};
use crate::effects::{About, Parameters};
use crate::gap::drive::record::Record;
use crate::gap::selection::sets::WeightedSet;
use crate::model::drive::{GRAVITY_M_S2, Instrument};
use std::f64::consts::TAU;

/// Nodes of the sum over the scales of a prior.
const NODES: usize = 48;
/// Nats by which the compared one of two equal effects comes first: too few to matter otherwise.
const LAST: f64 = 1e-6;

/// An effect that looks like a late gyro where nothing tells the force by which wheels slip.
pub(crate) struct Slip {
    about: &'static About,
    law: &'static dyn ModelChange,
    /// θ over the delay of the gyro, 1/s.
    per_s: Vec<f64>,
    /// Delay by which positions seem late over that of the gyro.
    way_over_turn: f64,
    /// Effects of a late gyro, and of a late reference.
    late: [Option<&'static About>; 2],
}

/// A delay in a set.
struct Delay {
    /// Place of its part.
    at: usize,
    value_s: f64,
    std_s: f64,
}

impl Slip {
    /// The one of `effects` in this drive; none where torques are logged, or no gyro.
    pub(crate) fn of(record: &Record, effects: &[&'static dyn Driving]) -> Option<Self> {
        if record.torques_n_m.is_some() || record.gyro_rad_s.is_none() {
            return None;
        }
        let late = [Instrument::Gyro, Instrument::Pose].map(|instrument| late(effects, instrument));
        let speed_m_s = mean_speed_m_s(record);
        let robot = record.robot(record.mean_load_kg());
        effects.iter().find_map(|effect| {
            let law = effect.change()?;
            let per_s = law.like_late_gyro(&robot, speed_m_s)?;
            let way_over_turn = per_s.first()? * speed_m_s / GRAVITY_M_S2;
            let about = effect.about();
            per_s.iter().all(|v| v.is_finite()).then_some(Self { about, law, per_s, way_over_turn, late })
        })
    }

    /// The set, and the sets with slipping wheels in the place of a late gyro, and of a late gyro and a late reference.
    /// `ln_named`: ln prior odds of one more effect.
    pub(crate) fn all(&self, mut set: WeightedSet, ln_named: f64) -> Vec<WeightedSet> {
        let [Some(turn), way] = self.late.map(|late| late.and_then(|about| delay(&set, about))) else {
            return vec![set];
        };
        // wheels that lag the gyro do not slip
        if turn.value_s <= 0.0 {
            return vec![set];
        }
        let mut alone = WeightedSet { ln_weight: set.ln_weight - LAST, ..set.clone() };
        self.put(&mut alone, &turn);
        let both = way.filter(|way| way.value_s > 0.0).map(|way| {
            let mut both = alone.clone();
            both.parts[turn.at].share += both.parts[way.at].share;
            both.parts.remove(way.at);
            // a reference with headings is late by something between the delay of positions and that of the gyro
            let [position, heading] = [self.way_over_turn * turn.value_s, turn.value_s];
            let spread = (position - heading).abs() / 12f64.sqrt();
            let bound_by_slip = [0.5 * (position + heading), spread, self.way_over_turn.max(1.0) * turn.std_s];
            let free = -ln_named - self.ln_prior(&way);
            both.ln_weight += free + ln_normal(&way, bound_by_slip);
            let same = set.ln_weight + free + ln_normal(&way, [heading, 0.0, turn.std_s]);
            let most = same.max(set.ln_weight);
            set.ln_weight = most + (-(same - set.ln_weight).abs()).exp().ln_1p();
            both
        });
        [set, alone].into_iter().chain(both).collect()
    }

    /// Puts slip in the place of a late gyro.
    fn put(&self, set: &mut WeightedSet, late: &Delay) {
        let part = &mut set.parts[late.at];
        part.id = self.about.id.into();
        part.parameters = self.law.parameters(&self.per_s.iter().map(|each| each * late.value_s).collect::<Vec<_>>());
        part.std = Parameters::from([(self.about.size().into(), self.per_s[0] * late.std_s)]);
    }

    /// ln prior density of a reference's delay, 1/s.
    fn ln_prior(&self, way: &Delay) -> f64 {
        let law = self.late[1].and_then(|about| by_id(about.id)).and_then(Driving::change);
        law.map_or(0.0, |law| ln_density(law.coordinates()[0].scale, way.value_s))
    }
}

/// The delay of `about` in `set`; none where the set is without.
fn delay(set: &WeightedSet, about: &About) -> Option<Delay> {
    let at = set.parts.iter().position(|p| p.id == about.id)?;
    let value_s = *set.parts[at].parameters.get(about.size())?;
    Some(Delay { at, value_s, std_s: set.parts[at].std.get(about.size()).copied().unwrap_or(0.0) })
}

/// ln N(delay; mean, Σ std²), ln 1/s; the first value is the mean, the others are standard deviations, s.
fn ln_normal(delay: &Delay, [mean, one, other]: [f64; 3]) -> f64 {
    let variance = (delay.std_s.powi(2) + one * one + other * other).max(f64::MIN_POSITIVE);
    -0.5 * (delay.value_s - mean).powi(2) / variance - 0.5 * (TAU * variance).ln()
}

/// ln ∫ N(value; 0, s²) d ln s / ln(s1/s0): scales s uniform in their logarithm, from the least that shows.
pub(crate) fn ln_density([least, most]: [f64; 2], value: f64) -> f64 {
    let least = least.min(value.abs().max(1e-12));
    let span = (most / least).ln();
    let one = |i: usize| {
        let s = least * (span * (i as f64 + 0.5) / NODES as f64).exp();
        (-0.5 * (value / s).powi(2)).exp() / (s * std::f64::consts::TAU.sqrt())
    };
    // beyond the reach of all, the widest scale decides
    let far = -0.5 * (value / most).powi(2) - (most * std::f64::consts::TAU.sqrt() * NODES as f64).ln();
    ((0..NODES).map(one).sum::<f64>() / NODES as f64).ln().max(far)
}

/// Mean speed of the wheels over ground, m/s.
fn mean_speed_m_s(record: &Record) -> f64 {
    let robot = &record.belief.robot;
    let ground = |i: usize| record.wheels_rad_s[i].iter().map(move |w| (w * robot.radius_m[i]).abs());
    let (sum, n) = ground(0).chain(ground(1)).filter(|v| v.is_finite()).fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
    sum / n
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::drive::{ids, registry};
    use crate::gap::selection::sets::Part;

    /// Wheels that slip in proportion to the force look like a gyro that is late beside wheels that roll.
    #[test]
    fn a_late_gyro_may_be_wheels_that_slip() {
        use crate::gap::drive::preprocess::acceleration_model::tests::{belief, recorded};
        use crate::model::drive::{Moving, Robot};
        let belief = belief();
        let robot: Robot = belief.robot;
        let (v, yaw_rate, about, delay_s) = (0.6, 0.2, 0.5, 0.004);
        let wheels = robot.wheels_rad_s(v, yaw_rate);
        let record = recorded(belief, 0.02, wheels.map(|w| vec![w; 400]), vec![yaw_rate; 400]);
        let mut part = Part::new(ids::gyro_delay(), true, 50.0);
        part.parameters.insert("delay_s".into(), delay_s);
        part.std.insert("delay_s".into(), 1e-4);
        let set = WeightedSet { parts: vec![part], ln_weight: -1.0, probability: 0.0 };
        let all = Slip::of(&record, registry()).unwrap().all(set.clone(), -4.0);
        assert_eq!(all.iter().map(|s| s.parts[0].id.as_str()).collect::<Vec<_>>(), [ids::gyro_delay(), ids::slip()]);
        let slip = &all[1].parts[0];
        assert!(all[1].ln_weight < set.ln_weight && set.ln_weight - all[1].ln_weight < 1e-5);
        // the law of slip itself, at this yaw acceleration
        let force = 0.5 * robot.yaw_inertia_kg_m2 * about / robot.half_track_m;
        let at = Moving { speed_m_s: v, yaw_rate_rad_s: yaw_rate, wheel_force_n: [-force, force], ..Moving::default() };
        let law = by_id(ids::slip()).and_then(|e| e.change()).unwrap();
        let turned = law.at(&law.theta(&slip.parameters)).wheels_rad_s(&robot, &at, wheels);
        let of = |w: [f64; 2]| robot.speed_and_yaw_rate(w)[1];
        let ahead = of(turned) - of(wheels);
        assert!((ahead / (delay_s * about) - 1.0).abs() < 0.05, "{ahead} {}", delay_s * about);
        assert!((slip.std["compliance"] / slip.parameters["compliance"] - 0.025).abs() < 1e-9);
        // with torques the force is known, and slip itself is compared
        let mut driven = record.clone();
        driven.torques_n_m = Some([vec![0.0; 400], vec![0.0; 400]]);
        assert!(Slip::of(&driven, registry()).is_none());
    }

    /// A reference that is late as slip has it is no effect beside it; one that is not, is.
    #[test]
    fn a_late_gyro_and_a_late_reference_may_be_one_slip() {
        let late = [Instrument::Gyro, Instrument::Pose].map(|instrument| late(registry(), instrument));
        let effect = by_id(ids::slip()).unwrap();
        let law = effect.change().unwrap();
        let slip = Slip { about: effect.about(), law, per_s: vec![40.0, 0.0], way_over_turn: 1.4, late };
        let with = |way_s: f64| {
            let part = |about: &About, delay_s: f64| {
                let mut part = Part::new(about.id, true, 50.0);
                part.parameters.insert(about.size().into(), delay_s);
                part.std.insert(about.size().into(), 2e-4);
                part
            };
            let parts = vec![part(late[0].unwrap(), 6e-3), part(late[1].unwrap(), way_s)];
            slip.all(WeightedSet { parts, ln_weight: -1.0, probability: 0.0 }, -4.0)
        };
        let [two, beside, one] = &with(7.2e-3)[..] else { panic!("three sets") };
        assert_eq!(one.parts.iter().map(|p| p.id.as_str()).collect::<Vec<_>>(), [ids::slip()]);
        assert_eq!([two.parts.len(), beside.parts.len()], [2, 2]);
        assert!(one.parts[0].share == 100.0 && (one.parts[0].parameters["compliance"] - 0.24).abs() < 1e-12);
        assert!(one.ln_weight > two.ln_weight + 4.0 && one.ln_weight > beside.ln_weight + 4.0, "{one:?} {two:?}");
        // both late by the same: of one clock, or of slip
        let [two, _, one] = &with(6e-3)[..] else { panic!("three sets") };
        assert!(two.ln_weight > 3.0 && (two.ln_weight - one.ln_weight).abs() < 4.0, "{one:?} {two:?}");
        // far from either
        let [two, _, one] = &with(0.1)[..] else { panic!("three sets") };
        assert!((two.ln_weight + 1.0).abs() < 1e-9 && one.ln_weight < -1000.0, "{one:?} {two:?}");
        assert_eq!(with(-5e-3).len(), 2);
    }
}
