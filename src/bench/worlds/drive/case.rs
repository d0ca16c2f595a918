//! One driving case: two drives of one robot, and the truth about them.

use super::catalogue::{COMMON, draw};
use super::effect::{Effect, Need, Scene, Shows};
use super::keep::{Keep, log};
use super::machine::{Course, Machine};
use super::nats::{Innovations, Reader, Sensors, of_level, of_noise, of_rare, of_signal};
use super::record::{DriveRun, GYRO, Trace, drive};
use super::world::World;
use crate::bench::worlds::case::{Case, case_seed};
use crate::bench::worlds::draw::{between, chance, index as pick, log_between};
use crate::bench::worlds::habits::{HABITS, Habits};
use crate::bench::worlds::label::{Label, Parameters, Strength};
use crate::bench::worlds::plan::Spec;
use crate::bench::worlds::run::Run;
use crate::error::{Error, ErrorKind, Result};
use crate::math::random::Stream;
use crate::signal::{Log, names};
use std::collections::BTreeMap;

/// Streams of a case's seed; those of effect i in run r follow from the last two.
const UNIT: u64 = 1;
const STRENGTHS: u64 = 2;
const ENVIRONMENT: u64 = 10;
const FORM: u64 = 100;
const PATH: u64 = 10_000;

/// Share of cases whose log lacks torques, pose or gyro.
const WITHOUT: f64 = 0.25;
/// Share of the strong effects that are obvious.
const COARSE: f64 = 0.35;
/// Share of real robots' common effects that one robot has.
const BACKGROUND: f64 = 0.4;
/// A background effect's nats over the weakest main effect's, and the least that counts.
const BACKGROUND_SHARE: [f64; 2] = [0.003, 0.1];
const BACKGROUND_NATS: f64 = 0.3;
/// More nats of a main effect do not make what lies beside it larger.
const MOST: f64 = 2e6;
/// Forms that are tried for an effect, and robots for a case, until the effects show.
const TRIES: u64 = 8;
/// Least nats of a main effect: four fifths of what is called weak.
const LEAST: f64 = 3.2;
/// Effects that are lags themselves: beside them a clock's offset has no truth.
const LAGS: [&str; 5] =
    ["sensor.gyro_delay", "sensor.wheel_delay", "sensor.pose_delay", "x.pose_clock_drift", "x.encoder_low_pass"];
/// Keeps the seeds of drives apart from those of rest, and of a case's robots from each other.
const DRIVING: u64 = 0x5DEE_CE66_0D12_141F;

/// Nats of a main effect of this strength. Weak and medium ones are as at rest; strong ones reach further: on the move every
/// wheel turn counts, and what a workshop would call small has thousands of nats.
fn draw_nats(strength: Strength, s: &mut Stream) -> f64 {
    let [low, high] = match (strength, chance(s, COARSE)) {
        (Strength::Strong, true) => [30_000.0, 1e6],
        (Strength::Strong, false) => [100.0, 30_000.0],
        (other, _) => other.nats(),
    };
    log_between(s, low, high)
}

/// The strength's name for so many nats.
fn strength_of(nats: f64) -> Strength {
    match nats {
        n if n < Strength::Medium.nats()[0] => Strength::Weak,
        n if n < Strength::Strong.nats()[0] => Strength::Medium,
        _ => Strength::Strong,
    }
}

/// An effect in the robot.
pub(super) struct Present {
    pub effect: Effect,
    pub slot: u64,
    pub strength: f64,
}

fn path_stream(seed: u64, slot: u64, run: u64) -> Stream {
    Stream::new(seed, PATH + 10 * slot + run)
}

/// The run `r` of `machine`.
pub(super) fn draw_run(machine: &Machine, span_s: f64, seed: u64, r: u64) -> DriveRun {
    let s = &mut Stream::new(seed, ENVIRONMENT + r);
    let unit = machine.gyro;
    let len = (span_s / machine.step_s) as usize;
    let course = Course::draw(machine, len, s);
    let c1_rad_s = unit.c1_rad_s * (1.0 + unit.relative_std * s.normal());
    let c2_rad_s = unit.c2_rad_s + unit.turn_on_std_rad_s * s.normal();
    let time_constant_s = unit.time_constant_s * (1.0 + unit.relative_std * s.normal()).max(0.5);
    let since_power_on_s = if chance(s, 0.2) { between(s, 1.0, 30.0) } else { log_between(s, 10.0, 1200.0) };
    let gyro = Run { unit, len, c1_rad_s, c2_rad_s, time_constant_s, temperature_c: Vec::new(), supply_v: Vec::new() };
    let seed = seed ^ (0x5851_F42D_4C95_7F2D_u64.wrapping_mul(r + 1));
    DriveRun { course, since_power_on_s, seed, gyro }
}

/// The gyro's channel in `run`: motion, warm-up, noise, and what `present` does to its readings.
pub(super) fn gyro_channel(
    run: &DriveRun,
    r: u64,
    world: &World,
    trace: &Trace,
    present: &[&Present],
    seed: u64,
) -> Vec<f64> {
    let noise = &mut Stream::new(run.seed, GYRO);
    let (std, dt) = (run.gyro.unit.white_std_rad_s(), run.gyro.step_s());
    let mut out: Vec<f64> = (trace.gyro_rad_s.iter().zip(&trace.gyro_noise).enumerate())
        .map(|(k, (rate, loud))| {
            let bias = run.gyro.warm_up_rad_s(run.since_power_on_s + k as f64 * dt);
            rate + bias + world.gyro.path_rad_s.get(k).unwrap_or(&0.0) + std * loud * noise.normal()
        })
        .collect();
    for p in present {
        p.effect.output(p.strength, &mut out, run, &mut path_stream(seed, p.slot, 2 + r));
    }
    out
}

/// The world with all of `present` in run `r`.
fn world_of(present: &[&Present], scene: Scene<'_>, r: u64, seed: u64) -> World {
    let mut world = World::nominal();
    for p in present {
        p.effect.set(p.strength, &mut world, scene, &mut path_stream(seed, p.slot, r));
    }
    world
}

/// Nats of an effect beyond what robots without a fault have of it, `usual` times its strength a (one standard
/// deviation s = `usual` a). a²/2σ² nats are those of an estimate a ± σ; beside the usual ones they are a²/2(σ² + s²).
fn beyond_usual(nats: f64, usual: f64) -> f64 {
    (nats.recip() + 2.0 * usual * usual).recip()
}

/// Says how clearly an effect shows in the fit's run.
pub(super) struct Judge<'a> {
    scene: Scene<'a>,
    reader: Reader<'a>,
    pub nominal: Innovations,
    seed: u64,
}

impl<'a> Judge<'a> {
    pub(crate) fn new(scene: Scene<'a>, sensors: Sensors, seed: u64) -> Self {
        let world = World::nominal();
        let trace = drive(scene.machine, scene.run, &world, 1.0);
        let reader = Reader::new(scene.machine, scene.run, sensors, &trace);
        let nominal = reader.innovations(&trace, &gyro_channel(scene.run, 0, &world, &trace, &[], seed));
        Self { scene, reader, nominal, seed }
    }

    pub(crate) fn nats(&self, present: &Present) -> f64 {
        let world = world_of(&[present], self.scene, 0, self.seed);
        let trace = drive(self.scene.machine, self.scene.run, &world, 1.0);
        let gyro = gyro_channel(self.scene.run, 0, &world, &trace, &[present], self.seed);
        let with = self.reader.innovations(&trace, &gyro);
        let nats = match present.effect.shows {
            Shows::Signal => of_signal,
            Shows::Noise => of_noise,
            Shows::Level => of_level,
            Shows::Rare => of_rare,
        };
        let found = nats(&with, &self.nominal);
        let usual = present.effect.usual_rows * self.scene.machine.step_s;
        if found.is_finite() { beyond_usual(found, usual / present.strength) } else { f64::MAX }
    }

    /// Gives `present` the strength with `target` nats, to `precision` (relative), in so many tries; returns its nats.
    pub(crate) fn fit(&self, present: &mut Present, target: f64, precision: f64, tries: usize) -> f64 {
        let most = present.effect.most;
        let mut at = present.effect.start.min(most);
        let mut before: Option<(f64, f64)> = None;
        let (mut low, mut high) = (0.0_f64, f64::INFINITY);
        let mut found = 0.0;
        for _ in 0..tries {
            present.strength = at;
            found = self.nats(present);
            if (found / target - 1.0).abs() < precision || (at >= most && found < target) {
                break;
            }
            if found < target {
                low = low.max(at)
            } else {
                high = high.min(at)
            }
            let slope = match before {
                Some((a, n)) if (at / a).ln().abs() > 1e-3 => ((found / n).ln() / (at / a).ln()).clamp(0.7, 5.0),
                _ => 2.0,
            };
            before = Some((at, found.max(1e-9)));
            at *= (target / found.max(1e-9)).powf(1.0 / slope).clamp(1e-3, 1e3);
            // laws with a threshold leap: between what was too weak and what was too strong
            if low > 0.0 && high.is_finite() && !(low..high).contains(&at) {
                at = (low * high).sqrt();
            }
            at = at.min(most);
        }
        found
    }
}

/// Draws a form of effect `id` that reaches `target` nats, at least [`LEAST`], or has its own size where it `is_strong`; none if
/// there is none.
fn present(
    id: &'static str,
    slot: u64,
    target: f64,
    is_strong: bool,
    judge: &Judge<'_>,
) -> Result<Option<(Present, f64)>> {
    for turn in 0..TRIES {
        let form = &mut Stream::new(judge.seed, FORM + 100 * turn + slot);
        let effect = draw(id, judge.scene.machine, form).ok_or_else(|| {
            Error::new(ErrorKind::Usage, "bench", format!("{id:?} is no driving effect of the generator"))
                .hint("take one of worlds::drive::LISTED or worlds::drive::UNLISTED")
        })?;
        let mut present = Present { effect, slot, strength: 0.0 };
        let nats = match present.effect.large {
            Some(large) if is_strong => {
                present.strength = large;
                judge.nats(&present)
            }
            _ => judge.fit(&mut present, target, 0.05, 9),
        };
        if nats >= LEAST {
            return Ok(Some((present, nats)));
        }
    }
    Ok(None)
}

/// Sensors of a case's log. One at most is missing, and none that a main effect needs.
fn sensors(mains: &[Need], s: &mut Stream) -> Sensors {
    let all = Sensors::ALL;
    let without = [Sensors { torque: false, ..all }, Sensors { pose: false, ..all }, Sensors { gyro: false, ..all }];
    // draws do not depend on the effects, so that neighbours stay apart
    let (lacks, first) = (chance(s, WITHOUT), pick(s, 3));
    let fits = |one: &Sensors| mains.iter().all(|need| need.met(*one));
    match (0..3).map(|i| without[(first + i) % 3]).find(fits) {
        Some(one) if lacks => one,
        _ => all,
    }
}

/// Makes driving case `index` of the bench with this `seed`; its logs have each habit with probability `habits`.
///
/// # Errors
/// [`ErrorKind::Usage`] if `spec` names an effect that the generator does not know; [`ErrorKind::Numeric`] if one cannot show.
pub(crate) fn make(seed: u64, index: usize, spec: &Spec, habits: f64) -> Result<Case> {
    let first = case_seed(seed, index) ^ DRIVING;
    let habits = Habits::draw(habits, &mut Stream::new(first, HABITS));
    for turn in 0..TRIES {
        if let Some(case) = attempt(first.wrapping_add(turn.wrapping_mul(DRIVING)), index, spec, &habits)? {
            return Ok(case);
        }
    }
    let ids: Vec<&str> = spec.effects.iter().map(|(id, _)| *id).collect();
    Err(Error::new(ErrorKind::Numeric, "bench", format!("{} cannot show in any drive", ids.join(" and ")))
        .at(format!("case {index}"))
        .hint("take another seed"))
}

/// The case of one robot; none where an effect cannot show: who never reverses never turns a caster.
fn attempt(seed: u64, index: usize, spec: &Spec, habits: &Habits) -> Result<Option<Case>> {
    let s = &mut Stream::new(seed, UNIT);
    let mut machine = Machine::draw(s);
    machine.vehicle.steering = habits.steering;
    let span_s = log_between(s, 60.0, 600.0);
    let fit = draw_run(&machine, span_s, seed, 0);
    let hold = draw_run(&machine, span_s * between(s, 0.8, 1.2), seed, 1);

    let s = &mut Stream::new(seed, STRENGTHS);
    let needs: Vec<Need> = spec
        .effects
        .iter()
        .filter_map(|(id, _)| Some(draw(id, &machine, &mut Stream::new(seed, FORM))?.need))
        .collect();
    let mut has = sensors(&needs, s);
    // what logs torques logs the wheels with them
    if let Some(hz) =
        habits.wheels_hz.filter(|_| needs.iter().all(|need| need.met(Sensors { torque: false, ..Sensors::ALL })))
    {
        let wheel_rows = (1.0 / (hz * machine.step_s)).round().max(1.0) as usize;
        has = Sensors { torque: false, wheel_rows, ..Sensors::ALL };
    }
    let judge = Judge::new(Scene { machine: &machine, run: &fit }, has, seed);
    let mut inside = Vec::new();
    let mut main_nats = BTreeMap::new();
    for (slot, (id, strength)) in spec.effects.iter().enumerate() {
        let target = draw_nats(*strength, s);
        let found = present(id, slot as u64, target, *strength == Strength::Strong, &judge)?;
        let Some((one, nats)) = found else { return Ok(None) };
        main_nats.insert((*id).to_string(), nats);
        inside.push(one);
    }
    let mains = inside.len();
    let weakest = main_nats.values().copied().fold(f64::INFINITY, f64::min);
    let mut background = Vec::new();
    if spec.messy {
        let [low, high] = BACKGROUND_SHARE.map(|share| (share * weakest.min(MOST)).max(BACKGROUND_NATS));
        for (k, id) in COMMON.iter().enumerate() {
            let (there, target) = (chance(s, BACKGROUND), log_between(s, low, high));
            if there && spec.effects.iter().all(|(main, _)| main != id) {
                let slot = (mains + k) as u64;
                let Some(mut effect) = draw(id, &machine, &mut Stream::new(seed, FORM + slot)) else { continue };
                // little is what changes little, whether or not healthy robots have it too
                effect.usual_rows = 0.0;
                let mut one = Present { effect, slot, strength: 0.0 };
                if !one.effect.need.met(has) {
                    continue;
                }
                let nats = judge.fit(&mut one, target, 0.3, 5);
                if (0.1 * BACKGROUND_NATS..=2.0 * high).contains(&nats) {
                    background.push((*id).to_string());
                    inside.push(one);
                }
            }
        }
    }

    let all: Vec<&Present> = inside.iter().collect();
    let lags = inside.iter().any(|p| LAGS.contains(&p.effect.id));
    let keep = Keep::new(habits, lags, has, machine.step_s);
    let [(fit_log, trace), (hold_log, _)] =
        [("fit", 0, &fit), ("hold", 1, &hold)].map(|(name, r, run)| record(name, r, &machine, run, &all, &keep, seed));
    let told = |p: &Present| -> (String, Parameters) {
        let unlisted = p.effect.id.starts_with("x.");
        let s = &mut path_stream(seed, p.slot, 0);
        let values = if unlisted { Parameters::new() } else { p.effect.parameters(p.strength, &fit, &trace, s) };
        (p.effect.id.to_string(), values)
    };
    let place = |p: &Present| (p.effect.id.to_string(), p.effect.place(&fit, &mut path_stream(seed, p.slot, 0)));
    background.sort();
    let label = Label {
        background,
        effects: inside[..mains].iter().map(told).collect(),
        kind: "driving".into(),
        nats: main_nats,
        strength: if mains == 0 { Strength::None } else { strength_of(weakest) },
        places: inside[..mains].iter().map(place).collect::<BTreeMap<_, _>>(),
        without: without(has),
        time_offsets: keep.labels(),
        kept: habits.names(),
    };
    let name = format!("driving-{index:06}");
    Ok(Some(Case { name, config: machine.config(), fit: fit_log?, hold: hold_log?, label, kept_in: habits.files }))
}

fn without(has: Sensors) -> Vec<String> {
    let mut out: Vec<&str> = Vec::new();
    if !has.torque {
        out.extend([names::TORQUE_LEFT, names::TORQUE_RIGHT]);
    }
    if !has.gyro {
        out.push(names::GYRO_Z);
    }
    if !has.pose {
        out.extend([names::X, names::Y, names::HEADING]);
    }
    out.into_iter().map(String::from).collect()
}

/// The log of run `r`, and the true motion.
fn record(
    source: &str,
    r: u64,
    machine: &Machine,
    run: &DriveRun,
    present: &[&Present],
    keep: &Keep,
    seed: u64,
) -> (Result<Log>, Trace) {
    let scene = Scene { machine, run };
    let world = world_of(present, scene, r, seed);
    let trace = drive(machine, run, &world, 1.0);
    let gyro = gyro_channel(run, r, &world, &trace, present, seed);
    (log(source, r as usize, scene, &world, &trace, gyro, keep), trace)
}
