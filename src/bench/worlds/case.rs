//! One case: two power-ons of one unit, and the truth about them.

use super::catalogue::{COMMON, draw};
use super::draw::{chance, log_between};
use super::effect::Effect;
use super::files::{Files, split};
use super::habits::{HABITS, Habits, noise_rad_s};
use super::label::{Label, Parameters, Strength};
use super::plan::Spec;
use super::run::{Run, Unit};
use super::warm_up::{UNSTATED, WarmUp};
use crate::config::Config;
use crate::error::{Error, ErrorKind, Result};
use crate::math::random::Stream;
use crate::signal::{Log, TimeAxis, names};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// A nominal simulator, two recordings of the same unit, and the truth about them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Case {
    /// `stationary-000001` or `driving-000001`.
    pub name: String,
    /// Configuration of the nominal simulator.
    pub config: Config,
    /// The recording to diagnose from.
    pub fit: Log,
    /// Another power-on of the same unit.
    pub hold: Log,
    /// The truth about the case.
    pub label: Label,
    /// In which files its recordings lie.
    pub kept_in: Files,
}

impl Case {
    /// File names and logs of both recordings.
    ///
    /// # Errors
    /// [`ErrorKind::Column`] where two channels of a log are called alike.
    pub(crate) fn files(&self) -> Result<Vec<(String, Log)>> {
        let fit = split("fit", &self.fit, self.kept_in)?;
        Ok(fit.into_iter().chain(split("hold", &self.hold, self.kept_in)?).collect())
    }
}

/// Streams of a case's seed; those of effect i in run r follow from the last two.
const UNIT: u64 = 1;
const STRENGTHS: u64 = 2;
const NO_WARM_UP: u64 = 4;
const ENVIRONMENT: u64 = 10;
const WHITE: u64 = 20;
const INSTRUMENTS: u64 = 30;
const FORM: u64 = 100;
const PATH: u64 = 1000;

/// Background effects have these nats, and at most this share of the weakest main effect's.
const BACKGROUND_NATS: [f64; 2] = [0.3, 6.0];
const BACKGROUND_SHARE: f64 = 0.1;

/// An effect in the unit.
struct Present {
    effect: Box<dyn Effect>,
    slot: u64,
    strength: f64,
    fit_path: Vec<f64>,
}

impl Present {
    /// Draws the form of effect `id` and gives it `nats` in the run of the fit.
    fn new(id: &str, slot: u64, nats: f64, seed: u64, unit: &Unit, fit: &Run) -> Result<Self> {
        let effect = draw(id, unit, &mut Stream::new(seed, FORM + slot)).ok_or_else(|| {
            Error::new(ErrorKind::Usage, "bench", format!("{id:?} is no effect of the generator"))
                .hint("take one of worlds::LISTED or worlds::UNLISTED")
        })?;
        let fit_path = effect.path(fit, &mut path_stream(seed, slot, 0));
        let strength = effect.strength(fit, &fit_path, nats);
        if !(strength > 0.0 && strength.is_finite()) {
            return Err(Error::new(
                ErrorKind::Numeric,
                "bench",
                format!("{id} cannot show with {nats} nats in this run"),
            ));
        }
        Ok(Self { effect, slot, strength, fit_path })
    }
}

fn path_stream(seed: u64, slot: u64, run: u64) -> Stream {
    Stream::new(seed, PATH + 10 * slot + run)
}

/// Random stream for an effect's changes of noise and output.
fn change_stream(seed: u64, slot: u64, run: u64) -> Stream {
    Stream::new(seed, PATH + 10 * slot + 2 + run)
}

/// A seed for each case, nothing in common between neighbours.
pub(super) fn case_seed(seed: u64, index: usize) -> u64 {
    let mut z = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ (index as u64).wrapping_mul(0xD1B5_4A32_D192_ED03);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// The unit that the team believes in: of some units' warm-up it knows nothing, and as many others have none. A simulator that states
/// none tells nothing of the effect. A single exponential beside none is no second one but the warm-up itself: there the first is stated.
pub(super) fn believed(unit: Unit, spec: &Spec, seed: u64) -> Unit {
    let slot = |wanted: &str| spec.effects.iter().position(|(id, _)| *id == wanted);
    let is_without = match slot("gyro.warm_up") {
        Some(slot) => WarmUp::draw(&unit, &mut Stream::new(seed, FORM + slot as u64)).is_unstated(),
        None => slot("gyro.second_time_constant").is_none() && chance(&mut Stream::new(seed, NO_WARM_UP), UNSTATED),
    };
    if is_without { unit.without_warm_up() } else { unit }
}

/// Makes case `index` of the bench with this `seed`; its logs have each habit with probability `habits`.
///
/// # Errors
/// [`ErrorKind::Usage`] if `spec` names an effect that the generator does not know.
pub(crate) fn make(seed: u64, index: usize, spec: &Spec, habits: f64) -> Result<Case> {
    let seed = case_seed(seed, index);
    let habits = Habits::draw(habits, &mut Stream::new(seed, HABITS)).at_rest();
    let unit = believed(Unit::draw(&mut Stream::new(seed, UNIT)), spec, seed);
    let [fit, hold] = [0, 1].map(|r| Run::draw(&unit, &mut Stream::new(seed, ENVIRONMENT + r)));

    let s = &mut Stream::new(seed, STRENGTHS);
    let mut present = Vec::new();
    let mut main_nats = BTreeMap::new();
    for (slot, (id, strength)) in spec.effects.iter().enumerate() {
        let [low, high] = strength.nats();
        let nats = log_between(s, low, high);
        main_nats.insert((*id).to_string(), nats);
        present.push(Present::new(id, slot as u64, nats, seed, &unit, &fit)?);
    }
    let main = present.len();
    let weakest = main_nats.values().copied().fold(f64::INFINITY, f64::min);
    let mut background = Vec::new();
    if spec.messy {
        let [low, high] = BACKGROUND_NATS;
        let high = high.min(BACKGROUND_SHARE * weakest).max(low);
        for (k, id) in COMMON.iter().enumerate() {
            if chance(s, 0.5) && spec.effects.iter().all(|(there, _)| there != id) {
                let nats = log_between(s, low, high);
                present.push(Present::new(id, (main + k) as u64, nats, seed, &unit, &fit)?);
                background.push((*id).to_string());
            }
        }
    }

    let mains = &present[..main];
    let parameters = |p: &Present| -> (String, Parameters) {
        let unlisted = p.effect.id().starts_with("x.");
        let values = if unlisted { Parameters::new() } else { p.effect.parameters(&fit, &p.fit_path, p.strength) };
        (p.effect.id().to_string(), values)
    };
    let label = Label {
        background,
        effects: mains.iter().map(parameters).collect(),
        kind: "stationary".into(),
        nats: main_nats,
        strength: spec.effects.iter().map(|(_, strength)| *strength).min().unwrap_or(Strength::None),
        places: mains
            .iter()
            .map(|p| (p.effect.id().to_string(), p.effect.place(&fit, &p.fit_path)))
            .collect::<BTreeMap<_, _>>(),
        without: Vec::new(),
        time_offsets: Vec::new(),
        kept: habits.names(),
    };
    let name = format!("stationary-{index:06}");
    let [fit, hold] =
        [("fit", 0, &fit), ("hold", 1, &hold)].map(|(source, r, run)| record(source, r, run, &present, &habits, seed));
    Ok(Case { name, config: unit.config(), fit: fit?, hold: hold?, label, kept_in: habits.files })
}

/// The log of `run`: `r` is 0 for the fit, 1 for the recording held out.
fn record(source: &str, r: u64, run: &Run, present: &[Present], habits: &Habits, seed: u64) -> Result<Log> {
    let mut streams: Vec<Stream> = present.iter().map(|p| change_stream(seed, p.slot, r)).collect();
    let mut reading: Vec<f64> = run.times_s().map(|t| run.warm_up_rad_s(t)).collect();
    for p in present {
        let path = match r {
            0 => Cow::Borrowed(&p.fit_path),
            _ => Cow::Owned(p.effect.path(run, &mut path_stream(seed, p.slot, r))),
        };
        p.effect.add(p.strength, &path, run, &mut reading);
    }
    let mut noise = Stream::new(seed, WHITE + r);
    let mut white: Vec<f64> = (0..run.len).map(|_| noise.normal()).collect();
    let mut order: Vec<usize> = (0..present.len()).collect();
    order.sort_by_key(|i| present[*i].effect.turn());
    for i in order {
        present[i].effect.white(present[i].strength, &mut white, run, &mut streams[i]);
    }
    let std = run.unit.white_std_rad_s();
    for (y, w) in reading.iter_mut().zip(&white) {
        *y += std * w;
    }
    // a lattice is the last that a reading meets: it is the converter, or the number's format
    let lattice = |p: &Present| p.effect.id() == "gyro.quantization";
    for last in [false, true] {
        for (p, s) in present.iter().zip(&mut streams).filter(|(p, _)| lattice(p) == last) {
            p.effect.output(p.strength, &mut reading, run, s);
        }
    }
    if let Some(printed) = habits.printed {
        let noise_rad_s = noise_rad_s(&reading, std);
        printed.print(&mut reading, noise_rad_s);
    }
    let instruments = &mut Stream::new(seed, INSTRUMENTS + r);
    let mut log = Log::new(source, TimeAxis::Uniform { start_s: 0.0, step_s: run.step_s(), len: run.len });
    log.push(names::GYRO_Z, reading)?;
    log.push(names::TEMPERATURE, run.thermometer_c(instruments))?;
    log.push(names::SUPPLY, run.voltmeter_v(instruments))?;
    Ok(log)
}
