//! σ² = σ²_nominal n²:   ln p(z | n) over ln p(z | 1), with n where it is most likely
//!
//! Noise that is larger or smaller than stated: of an instrument as a whole (a named effect), or of one channel alone
//! (a free form). The residuals of a settled model tell how much; the likelihood then tells n, its error and its gain.
//! A mere noise level is the same wherever the robot is and whatever it does, and white. Where the residuals are not,
//! the level only resembles another cause.

use super::heteroscedastic::departs;
use super::hypothesis::PreprocessingHypothesis;
use crate::effects::drive::{DriveExplanation, Driving};
use crate::effects::{About, Parameters};
use crate::gap::drive::ekf::noise::{Noise, Process};
use crate::gap::drive::fit::form::FORM;
use crate::gap::drive::options::{Options, WORTH};
use crate::gap::drive::preprocess::level::{CHANNELS, Level, Residual, price};
use crate::gap::drive::record::Record;
use crate::gap::selection::search::Member;
use crate::gap::selection::sets::Part;
use crate::gap::trace::{Decision, Step, TraceStage};
use crate::model::drive::Instrument;
use rayon::prelude::*;
use std::ops::Range;

/// Fewest residuals that determine a level.
const FEWEST: usize = 16;
/// Share of a level's energy that may vary until another cause is as likely: ln of the level is constant to a sixth.
const CONSTANT: f64 = 0.03;
/// Most Newton steps towards the most likely level.
const STEPS: usize = 16;
/// Longest of them, in ln of the variance.
const FURTHEST: f64 = 1.5;
/// Evidence that a step may lose by rounding, nats.
const LOST: f64 = 1e-3;
/// Most levels that are estimated: one an instrument, and once more.
const LEVELS: usize = 6;
/// Standard deviations of a mean square beyond which it is not chance.
const BEYOND_CHANCE: f64 = 3.0;
/// Share of the predicted variance of the motion that torques may tell beyond the logged readings: a speed control acts
/// on more readings than are logged.
const TOLD_BY_TORQUES: f64 = 0.25;

/// Certainty that a noise level is as found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Proof {
    /// None: motion that torques tell may look like it.
    None,
    /// The filter says so.
    Likely,
    /// No motion can look like it.
    Beyond,
}

/// A level that differs from the stated one.
struct Clearest {
    instrument: Instrument,
    /// Effect of its instrument; none: the level of one channel alone.
    about: Option<&'static About>,
    /// Name of the channel, or of its instrument's first one.
    name: &'static str,
    /// Indices of its channels.
    places: Vec<usize>,
    /// Number of their residuals, and the sum of their squares.
    n: usize,
    square: f64,
    /// Net gain, nats.
    worth: f64,
}

/// Number of residuals of the channels, and the sum of their squares.
fn summed(residuals: &[Residual], channels: &Range<usize>) -> (usize, f64) {
    let own = residuals.iter().filter(|r| channels.contains(&(r.0 as usize)));
    own.fold((0, 0.0), |(n, sum), r| (n + 1, sum + r.2 * r.2))
}

/// Gain in ln likelihood of `n` residuals with another variance, nats; `square`: sum of their squares.
fn gain(n: usize, square: f64) -> f64 {
    let ratio = (square / n.max(1) as f64).max(f64::MIN_POSITIVE);
    0.5 * n as f64 * (ratio - 1.0 - ratio.ln())
}

/// `noise` with the variance of the channels `places` times exp(`ln`).
fn times(noise: &Noise, places: &[usize], ln: f64) -> Noise {
    let mut noise = *noise;
    places.iter().for_each(|c| noise.reading[*c] *= ln.exp());
    noise
}

/// Id of the free form of one channel's noise level.
fn free_id(name: &str) -> String {
    format!("free.level.{name}")
}

impl PreprocessingHypothesis {
    /// Estimates noise levels that differ from the stated ones, the clearest first: a wrong level of one instrument
    /// leaves innovations of the others that are not as stated either. Returns whether there are any. Wheels quantized
    /// more coarsely than their noise are skipped.
    pub(crate) fn level(
        &mut self,
        effects: &[&'static dyn Driving],
        options: &Options,
        residuals: &[Residual],
    ) -> bool {
        let mut next = self.clearest(effects, options, residuals);
        let any = next.is_some();
        for round in 1.. {
            let Some(found) = next else { break };
            let Clearest { instrument, about, name, places, n, square, worth } = found;
            places.iter().for_each(|c| self.noise.reading[*c] *= square / n as f64);
            self.most_likely_level(&places, n);
            let before = self.levels.iter().find(|l| l.instrument == instrument).map(|l| l.margin);
            match about {
                Some(about) => {
                    self.note_level(about.id, places[0], n, before.unwrap_or(worth));
                    if before.is_none() {
                        let cost = price(n) - options.prior.ln_named;
                        self.extra_weight -= cost;
                        self.levels.push(Level { about, instrument, count: n, margin: worth, cost });
                    }
                }
                None => {
                    self.note_level(&free_id(name), places[0], n, worth);
                    self.free_level(options, name, places[0], n);
                }
            }
            next = (round < LEVELS).then(|| self.clearest(effects, options, &self.residuals())).flatten();
        }
        any
    }

    /// The level that gains most beside the present noise, of an instrument or of one channel; none that is worth it.
    fn clearest(
        &self,
        effects: &[&'static dyn Driving],
        options: &Options,
        residuals: &[Residual],
    ) -> Option<Clearest> {
        let mut found = Vec::new();
        for (instrument, _, channels) in CHANNELS {
            if instrument == Instrument::Wheels && self.is_coarse() {
                continue;
            }
            // without torques accelerations are only a diffusion, and noise makes up for its errors: both were
            // estimated together
            if self.record.torques_n_m.is_none() && instrument != Instrument::Pose {
                continue;
            }
            let known = effects.iter().map(|e| (e.about(), e.explanation()));
            let named = known
                .filter(|k| matches!(k.1, DriveExplanation::NoiseLevel(of) if of == instrument))
                .map(|k| k.0)
                .next();
            let sums: Vec<(&str, &Range<usize>, usize, f64)> = channels
                .iter()
                .map(|(name, places)| (*name, places, summed(residuals, places)))
                .map(|(name, places, (n, square))| (name, places, n, square))
                .filter(|s| s.2 >= FEWEST)
                .collect();
            let worth = |n: usize, square: f64, prior: f64| gain(n, square) - price(n) + prior;
            let each: Vec<f64> = sums.iter().map(|s| worth(s.2, s.3, options.prior.ln_free)).collect();
            let alone: f64 = each.iter().filter(|w| **w >= WORTH).sum();
            let (n, square) = sums.iter().fold((0, 0.0), |(n, q), s| (n + s.2, q + s.3));
            let together = worth(n, square, options.prior.ln_named);
            // where all channels are louder, or all quieter, one level is named, even if each has further causes
            let louder = sums.iter().filter(|s| s.3 > s.2 as f64).count();
            let alike = (louder == 0 || louder == sums.len()) && each.iter().all(|w| *w >= WORTH);
            let most = alike && 2.0 * gain(n, square) > alone;
            let is_known = self.levels.iter().any(|l| l.instrument == instrument);
            if named.is_some() && n >= FEWEST && (is_known || together >= WORTH && (together >= alone || most)) {
                if !is_known || gain(n, square) >= WORTH {
                    let places = sums.iter().flat_map(|s| s.1.clone()).collect();
                    let name = channels[0].0;
                    found.push(Clearest { instrument, about: named, name, places, n, square, worth: together });
                }
                continue;
            }
            for ((name, places, n, square), worth) in sums.into_iter().zip(each).filter(|s| s.1 >= WORTH) {
                let places = places.clone().collect();
                found.push(Clearest { instrument, about: None, name, places, n, square, worth });
            }
        }
        found.into_iter().max_by(|a, b| a.worth.total_cmp(&b.worth))
    }

    /// Moves the noise of the channels `places`, with `count` residuals, to its most likely level by Newton's method in
    /// the logarithm of the variance; returns the standard deviation of that.
    fn most_likely_level(&mut self, places: &[usize], count: usize) -> f64 {
        // standard deviation of the logarithm of a variance by so many readings
        let apart = 2.0 * (2.0 / count as f64).sqrt();
        let mut std = 0.5 * apart;
        let (mut from, mut moved) = (f64::NEG_INFINITY, 0.0);
        for _ in 0..STEPS {
            let weighed: Vec<f64> =
                [-apart, 0.0, apart].par_iter().map(|ln| self.weigh(&times(&self.noise, places, *ln))).collect();
            // a step that lost is halved
            if weighed[1] < from - LOST {
                moved *= 0.5;
                self.noise = times(&self.noise, places, -moved);
                continue;
            }
            from = weighed[1];
            let bend = (weighed[0] + weighed[2] - 2.0 * weighed[1]) / (apart * apart);
            let slope = 0.5 * (weighed[2] - weighed[0]) / apart;
            if !(bend.is_finite() && slope.is_finite()) {
                break;
            }
            // far from the maximum the curve may bend the other way
            moved = if bend < 0.0 { (-slope / bend).clamp(-FURTHEST, FURTHEST) } else { FURTHEST.copysign(slope) };
            self.noise = times(&self.noise, places, moved);
            if bend < 0.0 {
                std = (-bend).sqrt().recip();
                if moved.abs() < 0.1 * std {
                    break;
                }
            }
        }
        std
    }

    fn is_coarse(&self) -> bool {
        self.believed.wheel_lsb_rad_s > self.record.belief.wheel_std_rad_s
    }

    /// Notes in the trail how loud the channel at `place` is, by `n` innovations; `nats`: evidence of another level.
    fn note_level(&mut self, id: &str, place: usize, n: usize, nats: f64) {
        let ratio = (self.noise.reading[place] / self.believed.reading[place]).sqrt();
        let reason = format!("the noise is {ratio:.3} times as large as stated, by {n} innovations");
        let step = Step::new(TraceStage::Readings, id, Decision::Estimated, reason).nats(nats);
        self.note(step.limit("least evidence of another level", WORTH, "nats"));
    }

    /// Adds the part of a free form: the noise level of one channel.
    fn free_level(&mut self, options: &Options, name: &str, place: usize, n: usize) {
        let id = free_id(name);
        let again = self.extra_parts.iter().any(|p| p.id == id);
        let total = self.noise.reading[place] / self.believed.reading[place];
        let text = format!("the noise of {name} is {:.2} times as large as believed", total.sqrt());
        self.extra_parts.retain(|p| p.id != id);
        self.extra_parts.push(Part::described(&id, false, gain(n, total * n as f64), text));
        if !again {
            // the gain of the other noise is in the evidence itself; its cost is added here
            self.extra_weight += options.prior.ln_free - price(n);
        }
    }

    /// Fits the named levels beside the best set by maximum weight, and adds their parts.
    pub(crate) fn tell_levels(&mut self) {
        let levels = self.levels.clone();
        let mut told = Vec::new();
        for level in &levels {
            let places = level.places();
            let std = self.most_likely_level(&places, level.count);
            let mut without = self.noise;
            places.iter().for_each(|c| without.reading[*c] = self.believed.reading[*c]);
            let share = self.weigh(&self.noise) - self.weigh(&without);
            // with the stated torque noise within a step the level must lie on the same side
            let holds = self.noise.process.ripple == 0.0 || {
                let stated = Noise { process: Process { ripple: 0.0, ..without.process }, ..without };
                let [smaller, larger] = [-std, std].map(|ln| self.weigh(&times(&stated, &places, 2.0 * ln)));
                (larger > smaller) == (self.noise.reading[places[0]] > without.reading[places[0]])
            };
            told.push((std, share, holds));
        }
        // a filter with a wrong noise level leaves correlated innovations: they are judged under the fitted levels
        let residuals = if levels.is_empty() { Vec::new() } else { self.residuals() };
        for (level, (std, share, holds)) in levels.iter().zip(told) {
            self.levels.iter_mut().filter(|l| l.instrument == level.instrument).for_each(|l| l.margin = share - l.cost);
            let departs = departs(&self.record, &residuals, &level.places());
            let proof = self.proof(&residuals, &level.places());
            self.tell(level, std, share, (holds, proof), departs);
        }
    }

    /// Certainty that the noise of these channels is as found. E ν² = H P H' + R is no less than R, however well a
    /// filter knows the motion: innovations below the believed R prove that the noise is less. Otherwise the difference
    /// may be motion that the torques tell better than the filter assumes, within limits.
    fn proof(&self, residuals: &[Residual], places: &[usize]) -> Proof {
        let own = residuals.iter().filter(|r| places.contains(&(r.0 as usize)));
        let [n, square, motion, less] = own.fold([0.0; 4], |[n, square, motion, less], (channel, _, white, std)| {
            let (believed, found) = (self.believed.reading[*channel as usize], self.noise.reading[*channel as usize]);
            let ratio = found / believed;
            [
                n + 1.0,
                square + (white * std).powi(2) / believed,
                motion + std * std / believed - ratio,
                less + 1.0 - ratio,
            ]
        });
        if square < n - BEYOND_CHANCE * f64::sqrt(2.0 * n) {
            return Proof::Beyond;
        }
        let by_torques = self.record.torques_n_m.is_some() && less > 0.0 && less < TOLD_BY_TORQUES * motion;
        if by_torques { Proof::None } else { Proof::Likely }
    }

    fn tell(
        &mut self,
        level: &Level,
        ln_std: f64,
        share: f64,
        (holds, proof): (bool, Proof),
        departs: Option<(&'static str, f64)>,
    ) {
        let place = level.places()[0];
        let b = &self.record.belief;
        let (found, believed) = (self.noise.reading[place], self.believed.reading[place]);
        let white = match level.instrument {
            Instrument::Gyro => b.gyro_std_rad_s.powi(2),
            Instrument::Wheels => b.wheel_std_rad_s.powi(2),
            Instrument::Pose => b.position_std_m.powi(2),
        };
        // quantization noise is not the instrument's
        let over = ((found - (believed - white)) / white).max(1e-4).sqrt();
        let name = CHANNELS.iter().find(|c| c.0 == level.instrument).map_or("", |c| c.1);
        // energy of a level in ln variance, comparable to that of a varying one
        let energy = 0.25 * level.count as f64 * (found / believed).ln().powi(2);
        let moved = departs.map_or(0.0, |(_, nats)| nats / (nats + CONSTANT * energy));
        // errors in the form of laws that may bend add to innovations in all directions; less noise may make up for
        // that assumption, unless the noise is below that of any motion
        let excess = 0.5 * level.count as f64 * (found / believed - 1.0);
        let by_laws = self.bent_nats_beside(level.about.id);
        let bent = proof != Proof::Beyond && by_laws > 0.0 && excess < 2.0 * FORM * FORM * by_laws;
        let text = format!("the white noise of {name} is {over:.2} times as large as stated");
        let mut part = Part::described(level.about.id, true, share * (1.0 - moved), text);
        part.parameters = Parameters::from([(level.about.size().into(), over)]);
        part.std = Parameters::from([(level.about.size().into(), 0.5 * ln_std * found / (white * over))]);
        self.extra_parts.retain(|p| p.id != level.about.id);
        // a level that is more probably due to another cause is not named
        if holds && !bent && moved < 0.5 && proof != Proof::None && share > level.cost {
            self.extra_parts.push(part);
        }
        if let Some((condition, _)) = departs {
            let short = match level.instrument {
                Instrument::Gyro => "gyro",
                Instrument::Wheels => "wheels",
                Instrument::Pose => "pose",
            };
            let id = format!("free.level.{short}.{condition}");
            let text = format!("the noise of {name} is not the same throughout: {}", condition.replace('_', " "));
            self.extra_parts.retain(|p: &Part| p.id != id);
            self.extra_parts.push(Part::described(&id, false, share * moved, text));
        }
    }

    /// ln weight of the best set with `noise`.
    pub(crate) fn weigh(&self, noise: &Noise) -> f64 {
        self.weigh_in(&self.record, noise)
    }

    /// ln weight of the best set with `noise`, on another `record` of the same drive.
    pub(crate) fn weigh_in(&self, record: &Record, noise: &Noise) -> f64 {
        let c = &self.compared;
        let mut inside: Vec<Member> = c.sets[0].fitted.clone();
        inside.sort_unstable();
        let few = c.candidates.only(|g| inside.iter().any(|m| m.0 == g));
        let members: Vec<Member> = inside.iter().enumerate().map(|(place, m)| (place, m.1)).collect();
        few.linearise(record, noise, &c.theta).ln_weight(&members)
    }
}

/// Part for quantization of the wheels by `lsb`, rad/s, which closes `share` nats; `named`: its effect, none: a free
/// form.
pub(crate) fn lattice_part(lsb: f64, share: f64, named: Option<&About>) -> Part {
    let id = named.map_or("free.lattice.wheels", |e| e.id);
    let text = format!("wheel speeds are quantized in steps of {lsb:.5} rad/s");
    let mut part = Part { certain: true, ..Part::described(id, named.is_some(), share, text) };
    if let Some(name) = named.map(About::size) {
        part.parameters = Parameters::from([(name.into(), lsb)]);
        part.std = Parameters::from([(name.into(), 1e-6 * lsb)]);
    }
    part
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::drive::{ids, registry};
    use crate::gap::drive::model_selection::judge;
    use crate::gap::drive::preprocess::clocks::tests::{recorded, robot};
    use crate::gap::drive::record::Record;
    use crate::gap::selection::sets::Main;

    /// Main cause of a drive whose noise of positions and headings is overstated by these factors.
    fn main_of(position: f64, heading: f64) -> Main {
        let mut record = Record::new(&robot(), &recorded(60.0, 8, None), 0.0).unwrap();
        record.belief.position_std_m *= position;
        record.belief.heading_std_rad *= heading;
        let findings = judge(&record, registry(), &Options::default()).findings;
        findings.mains()[0].0.clone()
    }

    #[test]
    #[ignore = "battery: some seconds"]
    fn battery_a_reference_that_is_quieter_than_any_motion_leaves_is_told_beside_laws_that_bend() {
        let payload = Some((ids::payload(), "mass_relative", 0.3));
        let mut record = Record::new(&robot(), &recorded(60.0, 8, payload), 0.0).unwrap();
        record.belief.position_std_m *= 4.0;
        record.belief.heading_std_rad *= 4.0;
        let top = judge(&record, registry(), &Options::default()).findings.sets.swap_remove(0);
        for id in [ids::payload(), ids::pose_noise()] {
            assert!(top.parts.iter().any(|p| p.id == id), "{:?}", top.parts);
        }
    }

    #[test]
    fn what_torques_may_tell_is_no_quieter_gyro() {
        let quieter = |by: f64| {
            let mut record = Record::new(&robot(), &recorded(60.0, 8, None), 0.0).unwrap();
            record.belief.gyro_std_rad_s *= by;
            let findings = judge(&record, registry(), &Options::default()).findings;
            findings.sets[0].parts.iter().any(|p| p.id == ids::gyro_noise())
        };
        assert!(!quieter(1.06) && quieter(3.0));
    }

    #[test]
    #[ignore = "battery: some seconds"]
    fn battery_noise_far_below_what_is_stated_is_of_its_own_instrument() {
        // quiet wheels make the innovations of the gyro small too, and a quiet gyro those of the wheels
        for (id, wheels, gyro) in
            [(ids::wheel_noise(), 3.0, 1.0), (ids::wheel_noise(), 1.8, 1.0), (ids::gyro_noise(), 1.0, 3.0)]
        {
            let mut record = Record::new(&robot(), &recorded(60.0, 8, None), 0.0).unwrap();
            record.belief.wheel_std_rad_s *= wheels;
            record.belief.gyro_std_rad_s *= gyro;
            let top = judge(&record, registry(), &Options::default()).findings.sets.swap_remove(0);
            let levels: Vec<&Part> = top.parts.iter().filter(|p| p.id.contains("noise_level")).collect();
            assert!(levels.len() == 1 && levels[0].id == id, "{:?}", top.parts);
            let (found, std) = (levels[0].parameters["noise_over_nominal"], levels[0].std["noise_over_nominal"]);
            let truth = 1.0 / (wheels * gyro);
            assert!((found - truth).abs() < 4.0 * std && std < 0.1 * truth, "{id}: {found} ± {std} for {truth}");
        }
    }

    #[test]
    fn channels_that_are_all_less_loud_have_one_level() {
        let level = Main::Effect(ids::pose_noise().into());
        // the two factors differ a little, as other noise adds to each
        assert_eq!(main_of(4.0, 3.4), level);
        // a heading alone is not the whole reference
        assert_eq!(main_of(1.0, 4.0), Main::Unknown);
    }
}
