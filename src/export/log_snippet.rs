//! Python that makes of a simulator's log what the robot's sensors would have written: one block an effect, in the order in which
//! sensors change what they read.

use crate::config::{Config, OWN};
use crate::effects::drive::{OnLog, Stage, by_id};
use crate::files::mark::with_digest;
use crate::gap::answer::EffectAnswer;
use crate::signal::names;
use std::fmt::Write;

/// Longest line of prose.
const WIDTH: usize = 120;

const HEAD: &str = r#"as_real(log, seed=1) takes a frame of polars or pandas, or a dict of arrays, whose columns have gyroid's names and units
(t_s, gyro_z_rad_s, wheel_left_rad_s, ...), and gives one of the same kind. A channel that the log has not is passed over.
As a program, on CSV: python FILE LOG.csv NEW.csv
"#;
const HEAD_INPUTS: &str = r"as_real_inputs(inputs) does the same to the commands, before the simulator is run: python FILE INPUTS.csv NEW.csv --inputs
A log of that run holds what the motors were given, and not what was commanded.
";
const FRAME: &str = r#"
import sys

import numpy as np


def columns(log):
    return list(log.columns if hasattr(log, "columns") else log)


def read(log, names):
    return {name: np.array(log[name], dtype=float) for name in names if name in columns(log)}


def written(log, new, without=()):
    return type(log)({name: new.get(name, log[name]) for name in columns(log) if name not in without})
"#;
const LATE: &str = r"

def late(t, value, by_s, angle=False):
    # between two readings a straight line, which smooths white noise; before the first reading that one
    there = np.isfinite(value)
    if there.any():
        known = np.unwrap(value[there]) if angle else value[there]
        value = value.copy()
        value[there] = np.interp(t[there] - by_s, t[there], known)
    return value
";
const BURSTS: &str = r"

def bursts(t, rng, burst_s, share_of_time):
    # a chain of two states, from row to row
    step_s = np.diff(t, prepend=2 * t[0] - t[1])
    leave = 1 - np.exp(-step_s / burst_s)
    enter = np.minimum(leave * share_of_time / (1 - share_of_time), 1)
    inside, flags = False, np.zeros(t.size)
    for row, draw in enumerate(rng.random(t.size)):
        inside ^= bool(draw < (leave if inside else enter)[row])
        flags[row] = inside
    return flags
";
const MAIN: &str = r#"

if __name__ == "__main__":
    given, made, *rest = sys.argv[1:]
    table = np.genfromtxt(given, delimiter=",", names=True)
    log = {name: table[name] for name in table.dtype.names}
    log = CALL
    np.savetxt(made, np.column_stack(list(log.values())), "%.17g", ",", header=",".join(log), comments="")
"#;
/// Counts that no longer fit the speeds of wheels that were changed.
const COUNTS: [&str; 2] = [names::WHEEL_LEFT_TICKS, names::WHEEL_RIGHT_TICKS];

/// A file of Python.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Snippet {
    /// Its text, with gyroid's mark.
    pub text: String,
    /// Whether it changes commands too.
    pub commands: bool,
}

/// Work of the effect on a log without it.
///
/// # Errors
/// The reason, where it is no effect on a log.
pub fn on_log(effect: &EffectAnswer) -> Result<OnLog, &'static str> {
    let why = match effect.id.starts_with(OWN) {
        true => "it is an effect of your own",
        false => "it is no effect of drives",
    };
    by_id(&effect.id).ok_or(why)?.on_log(&effect.parameters)
}

/// Python for `effects` of a simulator that `config` stands for; `untold`: effects that it cannot make, with the reasons.
#[must_use]
pub fn log_snippet(effects: &[&EffectAnswer], untold: &[(String, String)], config: &Config) -> Snippet {
    let mut blocks: Vec<(OnLog, &EffectAnswer)> =
        effects.iter().filter_map(|effect| Some((on_log(effect).ok()?, *effect))).collect();
    blocks.sort_by_key(|(work, _)| work.stage);
    let (commands, readings): (Vec<_>, Vec<_>) = blocks.into_iter().partition(|(work, _)| work.stage == Stage::Command);
    let uses = |function: &str| readings.iter().any(|(work, _)| work.uses(function));
    let mut text = String::from(
        "\"\"\"What the robot's sensors have and the log of its simulator has not, as gyroid found it.\n\n",
    );
    text += HEAD;
    if !commands.is_empty() {
        text += HEAD_INPUTS;
    }
    if !untold.is_empty() {
        text += "\nWhat no log tells, and is not in here:\n";
    }
    untold.iter().for_each(|(what, why)| wrapped(&mut text, "  ", &format!("{}: {}", plain(what), plain(why))));
    text += "\"\"\"\n";
    text += FRAME;
    let helpers = [("late", LATE), ("bursts", BURSTS)];
    helpers.into_iter().filter(|(name, _)| uses(name)).for_each(|(_, code)| text += code);
    if !commands.is_empty() {
        text += "\n\ndef as_real_inputs(inputs):\n";
        text += &listed("    new = read(inputs, [", &commands);
        commands.iter().for_each(|block| written(&mut text, block));
        text += "    return written(inputs, new)\n";
    }
    text += "\n\ndef as_real(log, seed=1):\n";
    text += "    rng = np.random.default_rng(seed)\n    t = np.array(log[\"t_s\"], dtype=float)\n";
    text += &listed("    new = read(log, [", &readings);
    if uses("speed") {
        let (left, right) = (names::WHEEL_LEFT, names::WHEEL_RIGHT);
        let radius_m = config.vehicle.as_ref().map_or(f64::NAN, |v| v.wheel_radius_m);
        let _ = write!(
            text,
            "    wheels = read(log, [\"{left}\", \"{right}\"])\n\n    def speed():\n        \
             # wheel radius of the simulator, m\n        return {radius_m:?} * (wheels[\"{left}\"] + wheels[\"{right}\"]) / 2\n"
        );
    }
    if uses("std") {
        text += "\n    def std(name):\n        # white noise of the simulator's readings; of the gyro angle random walk over the root of the step\n";
        text += "        return {\n";
        white(config).into_iter().for_each(|(name, std)| {
            let root = if name == names::GYRO_Z { " / np.median(np.diff(t)) ** 0.5" } else { "" };
            let _ = writeln!(text, "            \"{name}\": {std:?}{root},");
        });
        text += "        }[name]\n";
    }
    readings.iter().for_each(|block| written(&mut text, block));
    let changes_wheels = readings.iter().any(|(work, _)| work.channels.iter().any(|c| c.starts_with("wheel_")));
    text += &match changes_wheels {
        true => format!(
            "    # counts of ticks would no longer fit the speeds\n    return written(log, new, without=[{}])\n",
            quoted(&COUNTS)
        ),
        false => "    return written(log, new)\n".to_string(),
    };
    let call = if commands.is_empty() {
        "as_real(log)"
    } else {
        "as_real_inputs(log) if \"--inputs\" in rest else as_real(log)"
    };
    text += &MAIN.replace("CALL", call);
    Snippet { text: with_digest(text), commands: !commands.is_empty() }
}

/// White noise of each channel of the simulator: standard deviation of a reading; of the gyro its density, rad/√s.
pub(super) fn white(config: &Config) -> Vec<(&'static str, f64)> {
    let gyro = config.gyro.as_ref().map(|g| (names::GYRO_Z, g.angle_random_walk_rad_sqrt_s));
    let wheels = config.encoder.as_ref().map(|e| e.speed_noise_std_rad_s);
    let wheels = wheels.into_iter().flat_map(|std| [(names::WHEEL_LEFT, std), (names::WHEEL_RIGHT, std)]);
    let pose = config.pose.iter().flat_map(|p| {
        [(names::X, p.position_std_m), (names::Y, p.position_std_m), (names::HEADING, p.heading_std_rad)]
    });
    gyro.into_iter().chain(wheels).chain(pose).collect()
}

/// `head` and the channels of all blocks, each once.
fn listed(head: &str, blocks: &[(OnLog, &EffectAnswer)]) -> String {
    let mut channels: Vec<&str> = blocks.iter().flat_map(|(work, _)| work.channels).copied().collect();
    channels.sort_unstable();
    channels.dedup();
    format!("{head}{}])\n", quoted(&channels))
}

fn quoted(names: &[&str]) -> String {
    names.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ")
}

/// One effect: its parameters, each with its interval, and what it does to its channels.
fn written(text: &mut String, (work, effect): &(OnLog, &EffectAnswer)) {
    let Some(about) = by_id(&effect.id).map(|e| e.about()) else { return };
    text.push('\n');
    wrapped(text, "    # ", &format!("{}, {}: {}", effect.id, about.title, about.equation));
    for parameter in about.parameters {
        let Some(value) = effect.parameters.get(parameter.name).copied().or(parameter.null) else { continue };
        let interval = effect.std.get(parameter.name).map(|std| {
            let [low, high] = [-1.96, 1.96].map(|z| format!("{:.3e}", value + z * std));
            format!("  # 95 %: {low} to {high}")
        });
        let _ = writeln!(text, "    {} = {value:?}{}", parameter.name, interval.unwrap_or_default());
    }
    let channels = quoted(work.channels);
    let _ = writeln!(text, "    for name in [{channels}]:\n        if name in new:\n            value = new[name]");
    let _ = writeln!(text, "            new[name] = {}", work.value);
}

/// Words behind `indent`, in lines that are not too long.
fn wrapped(text: &mut String, indent: &str, words: &str) {
    let mut line = String::new();
    for word in words.split_whitespace() {
        if !line.is_empty() && indent.len() + line.chars().count() + 1 + word.chars().count() > WIDTH {
            let _ = writeln!(text, "{indent}{line}");
            line.clear();
        }
        if !line.is_empty() {
            line.push(' ');
        }
        line += word;
    }
    let _ = writeln!(text, "{indent}{line}");
}

/// Without what would end a text of Python: names come from descriptions of robots.
fn plain(words: &str) -> String {
    words.replace('\\', "/").replace('"', "'")
}

#[cfg(test)]
mod tests;
