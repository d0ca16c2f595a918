//! x = f(p̂), σ_x² = Σ_i (∂f/∂p_i σ_i)²: what was found, as domain randomisation for Isaac Lab 2.x
//!
//! A term of the event manager is drawn evenly between the ends of the 95 % interval. Names and meanings are those of
//! `isaaclab.envs.mdp.events` 2.3: `randomize_rigid_body_mass` adds kg to the bodies that are named; with `recompute_inertia` it scales
//! their inertia with their mass. `randomize_rigid_body_com` moves their centres, m. `randomize_physics_scene_gravity` sets one gravity
//! for all environments, each component by itself. What no event there does rightly is listed with the reason: with Isaac Sim 5
//! `randomize_joint_parameters` draws static, dynamic (N·m) and viscous friction (N·m·s) from one range, and before it the friction is a
//! coefficient of the joint's load; `randomize_rigid_body_scale` refuses an articulation.

use super::log_snippet::{on_log, white};
use crate::config::Config;
use crate::effects::Parameters;
use crate::effects::drive::{Stage, by_id, described};
use crate::files::mark;
use crate::gap::answer::EffectAnswer;
use crate::model::drive::{GRAVITY_M_S2, Robot};
use crate::robot::{Chassis, Truth};
use crate::signal::names;
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// A number with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Range {
    /// The estimate.
    pub mean: f64,
    /// From and to.
    pub ci95: [f64; 2],
}

/// A term of the event manager.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Event {
    /// The effect's id.
    pub effect: String,
    /// Function in `isaaclab.envs.mdp`.
    pub func: &'static str,
    /// When it acts.
    pub mode: &'static str,
    /// Its parameters; ranges are 95 % intervals.
    pub params: Value,
    /// The estimate of what is drawn.
    pub mean: Value,
    /// Unit of what is drawn.
    pub unit: &'static str,
    /// Remark on it; none where its name says all.
    pub note: Option<String>,
}

/// Change of a sensor's reading.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Observation {
    /// The effect's id.
    pub effect: String,
    /// Channels that it changes.
    pub channels: &'static [&'static str],
    /// Its parameters.
    pub parameters: BTreeMap<String, Range>,
    /// Standard deviation of its white noise by channel, discrete; none where it is no noise.
    pub std: Option<BTreeMap<String, Range>>,
    /// Where it goes in the configuration of an observation term.
    pub goes_to: &'static str,
}

/// Parameters that no event sets.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NoPlace {
    /// The effect's id.
    pub effect: String,
    /// Its parameters.
    pub parameters: BTreeMap<String, Range>,
    /// The reason, and what to do instead.
    pub why: &'static str,
    /// Values for what is to be done instead, by name.
    pub instead: BTreeMap<&'static str, Range>,
}

/// Named effects as events and observations of Isaac Lab.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Ranges {
    /// Name and version of the format.
    pub schema: String,
    /// The program that takes it.
    pub target: &'static str,
    /// Terms of the event manager.
    pub events: Vec<Event>,
    /// Changes of observations.
    pub observations: Vec<Observation>,
    /// Effects that neither an event nor an observation holds.
    pub no_place: Vec<NoPlace>,
    /// Gaps that the user fills in, and quantities that the ranges are over.
    pub notes: Vec<String>,
}

/// Ranges of `effects` over the robot of `config`; `chassis`: of its description, where there is one.
#[must_use]
pub(crate) fn ranges(effects: &[&EffectAnswer], config: &Config, chassis: Option<&Chassis>) -> Ranges {
    let mut out = Ranges {
        schema: mark::json_schema("gap.ranges"),
        target: "Isaac Lab 2.x",
        events: Vec::new(),
        observations: Vec::new(),
        no_place: Vec::new(),
        notes: vec!["a range is the 95 % interval of this one robot: widen it for robots that differ".into()],
    };
    let Some(vehicle) = &config.vehicle else { return out };
    let robot = Robot::from(vehicle);
    if chassis.is_none() {
        out.notes
            .push("in asset_cfg put your chassis in the place of <chassis>; --patch FILE would have told it".into());
    }
    let loads = effects.iter().flat_map(|e| truths(e, &e.parameters, &robot));
    let loaded = loads.fold(1.0, |m, truth| if let Truth::Load { mass, .. } = truth { m * (1.0 + mass) } else { m });
    let over = Over { robot, loaded, chassis };
    out.notes.push(format!(
        "the robot without the effects weighs {:.4} kg, on wheels of {:.5} m",
        robot.mass_kg, robot.radius_m[0]
    ));
    for effect in effects {
        let found = truths(effect, &effect.parameters, &robot);
        for truth in &found {
            over.enter(effect, truth, &mut out);
        }
        if !found.is_empty() {
            continue;
        }
        match on_log(effect) {
            Ok(work) => out.observations.push(Observation {
                effect: effect.id.clone(),
                channels: work.channels,
                parameters: parameters(effect),
                std: (work.stage == Stage::Noise).then(|| noise(effect, work.channels, config)),
                goes_to: goes_to(work.stage),
            }),
            Err(why) => out.no_place.push(NoPlace {
                effect: effect.id.clone(),
                parameters: parameters(effect),
                why,
                instead: BTreeMap::new(),
            }),
        }
    }
    out
}

fn truths(effect: &EffectAnswer, parameters: &Parameters, robot: &Robot) -> Vec<Truth> {
    by_id(&effect.id).map_or_else(Vec::new, |e| described(e, parameters, robot))
}

fn range(mean: f64, std: f64) -> Range {
    Range { mean, ci95: [mean - 1.96 * std, mean + 1.96 * std] }
}

fn parameters(effect: &EffectAnswer) -> BTreeMap<String, Range> {
    let std = |name: &str| effect.std.get(name).copied().unwrap_or(0.0);
    effect.parameters.iter().map(|(name, value)| (name.clone(), range(*value, std(name)))).collect()
}

const fn goes_to(stage: Stage) -> &'static str {
    match stage {
        Stage::Command => "the action term",
        Stage::Delay => {
            "func of the term: isaaclab.utils.DelayBuffer, whose lag is the delay over the step of the observations"
        }
        Stage::Noise => {
            "noise of the term: isaaclab.utils.noise.GaussianNoiseCfg(std=...), where nothing else makes noise"
        }
        Stage::Gain | Stage::Bias | Stage::Recorder => {
            "modifiers of the term: isaaclab.utils.modifiers.ModifierCfg with a function of this law"
        }
    }
}

/// n σ of each channel.
fn noise(effect: &EffectAnswer, channels: &[&str], config: &Config) -> BTreeMap<String, Range> {
    let Some(ratio) = parameters(effect).into_values().next() else { return BTreeMap::new() };
    let step_s = config.sample_time_s.unwrap_or(f64::NAN);
    let a_reading = |name: &str, std: f64| if name == names::GYRO_Z { std / step_s.sqrt() } else { std };
    let scaled = |std: f64| Range { mean: ratio.mean * std, ci95: ratio.ci95.map(|x| x.max(0.0) * std) };
    let stated = white(config).into_iter().filter(|(name, _)| channels.contains(name));
    stated.map(|(name, std)| (name.to_string(), scaled(a_reading(name, std)))).collect()
}

/// The robot that truths are over.
struct Over<'a> {
    robot: Robot,
    /// Mass with all loads, over that without.
    loaded: f64,
    chassis: Option<&'a Chassis>,
}

impl Over<'_> {
    /// Numbers of a truth, in the unit of what takes them.
    fn numbers(&self, truth: &Truth) -> Vec<f64> {
        let robot = &self.robot;
        match *truth {
            Truth::Radius { left, right } | Truth::Torque { left, right } => vec![left, right],
            Truth::Track(over) => vec![over],
            Truth::Load { mass, inertia } => vec![mass * robot.mass_kg, mass, inertia],
            Truth::Ahead(metres) => {
                let whole = robot.mass_kg * self.loaded;
                let own = self.chassis.map_or(whole, |c| c.mass_kg + whole - robot.mass_kg);
                vec![metres * whole / own]
            }
            Truth::Resistance { coefficient, rise } => {
                let wheels = 2 * self.chassis.map_or(1, |c| c.wheels_a_side);
                let (load_n, r) = (robot.mass_kg * self.loaded * GRAVITY_M_S2 / wheels as f64, robot.radius_m[0]);
                vec![(coefficient - 0.5 * rise) * load_n * r, rise * load_n * r * r]
            }
            Truth::Slope { slope, uphill } => {
                vec![-slope.sin() * uphill.cos(), -slope.sin() * uphill.sin(), -slope.cos()]
                    .into_iter()
                    .map(|x| x * GRAVITY_M_S2)
                    .collect()
            }
        }
    }

    /// The numbers with their intervals; a truth that is not there at other parameters does not change with them.
    fn spread(&self, effect: &EffectAnswer, truth: &Truth) -> Vec<Range> {
        let mean = self.numbers(truth);
        let at = |name: &str, by: f64| {
            let mut moved = effect.parameters.clone();
            moved.entry(name.to_string()).and_modify(|value| *value += by);
            let all = truths(effect, &moved, &self.robot);
            let same = all.into_iter().find(|t| std::mem::discriminant(t) == std::mem::discriminant(truth));
            same.map(|t| self.numbers(&t))
        };
        let mut variance = vec![0.0; mean.len()];
        for (name, std) in &effect.std {
            let (Some(low), Some(high)) = (at(name, -std), at(name, *std)) else { continue };
            variance.iter_mut().zip(low.iter().zip(&high)).for_each(|(v, (l, h))| *v += (0.5 * (h - l)).powi(2));
        }
        mean.into_iter().zip(variance).map(|(mean, variance)| range(mean, variance.sqrt())).collect()
    }

    fn asset(&self) -> Value {
        let body = self.chassis.map_or("<chassis>", |c| c.name.as_str());
        json!({"name": "robot", "body_names": body})
    }

    fn enter(&self, effect: &EffectAnswer, truth: &Truth, out: &mut Ranges) {
        let found = self.spread(effect, truth);
        let event = |func, params, mean, unit, note| Event {
            effect: effect.id.clone(),
            func,
            mode: "startup",
            params,
            mean,
            unit,
            note,
        };
        let mut no_place = |why, names: &[&'static str]| {
            let instead = names.iter().copied().zip(found.iter().copied()).collect();
            out.no_place.push(NoPlace { effect: effect.id.clone(), parameters: parameters(effect), why, instead });
        };
        match (truth, &found[..]) {
            (Truth::Load { .. }, [kg, mass, inertia]) => {
                // the inertia grows as the mass or stays: what is nearer
                let scales = (inertia.mean - mass.mean).abs() < inertia.mean.abs();
                let note = format!(
                    "the yaw inertia of the whole robot is {:.4} of itself larger (95 %: {:.4} to {:.4}), and no event of 2.x sets it alone",
                    inertia.mean, inertia.ci95[0], inertia.ci95[1]
                );
                out.events.push(event(
                    "randomize_rigid_body_mass",
                    json!({"asset_cfg": self.asset(), "mass_distribution_params": kg.ci95, "operation": "add",
                           "distribution": "uniform", "recompute_inertia": scales}),
                    json!({"mass_distribution_params": kg.mean}),
                    "kg",
                    Some(note),
                ));
            }
            (Truth::Ahead(_), [ahead]) => {
                let whole = "of the whole robot, not of its chassis: over the chassis' share of the mass it is larger";
                out.events.push(event(
                    "randomize_rigid_body_com",
                    json!({"asset_cfg": self.asset(), "com_range": {"x": ahead.ci95}}),
                    json!({"com_range": {"x": ahead.mean}}),
                    "m",
                    self.chassis.is_none().then(|| whole.to_string()),
                ));
            }
            (Truth::Slope { .. }, [_, _, _]) => {
                let side = |i: usize| found.iter().map(|r| r.ci95[i]).collect::<Vec<_>>();
                let mean: Vec<f64> = found.iter().map(|r| r.mean).collect();
                out.events.push(event(
                    "randomize_physics_scene_gravity",
                    json!({"gravity_distribution_params": [side(0), side(1)], "operation": "abs", "distribution": "uniform"}),
                    json!({"gravity_distribution_params": mean}),
                    "m/s2",
                    Some("of the whole scene, in the frame in which the robot starts along x".into()),
                ));
            }
            (Truth::Resistance { .. }, _) => no_place(
                "randomize_joint_parameters draws static, dynamic and viscous friction from one range: enter these into the actuator's \
                 friction, dynamic_friction (N m) and viscous_friction (N m s), which are per wheel and need Isaac Sim 5",
                &["friction", "viscous_friction"],
            ),
            (Truth::Torque { .. }, _) => no_place(
                "no event draws a motor's gain: multiply the scale of JointEffortActionCfg by these, wheel by wheel",
                &["scale_left", "scale_right"],
            ),
            (Truth::Radius { .. }, _) => no_place(
                "randomize_rigid_body_scale refuses an articulation: make an asset for each size, over the radii by these",
                &["left_over_described", "right_over_described"],
            ),
            (Truth::Track(_), _) => no_place(
                "no event moves a joint: make an asset for each track, over the described one by this",
                &["over_described"],
            ),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests;
