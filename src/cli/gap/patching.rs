//! `--patch`: what was found, entered into a copy of the robot's description.

use crate::cli::output::Output;
use clap::Args;
use gyroid::config::Vehicle;
use gyroid::effects::{Parameters, drive};
use gyroid::files::{OutputFile, Plan};
use gyroid::gap::Answer;
use gyroid::model::drive::Robot;
use gyroid::robot::{self, Choice, Fact, Finding, Format};
use gyroid::{Error, ErrorKind, Result};
use serde_json::{Value, json};
use std::path::PathBuf;

/// CONFIG and description are of one robot within this share.
const ONE_ROBOT: f64 = 0.01;

#[derive(Debug, Args)]
pub(crate) struct PatchArgs {
    /// The robot's description (SDF, URDF, MJCF): enter what was found into a copy of it
    ///
    /// True sizes are changed in place, each under a comment with its 95 % interval; what the controller believes stays.
    #[arg(long, value_name = "FILE", requires = "out")]
    patch: Option<PathBuf>,
    /// Write that copy here
    #[arg(short, long, value_name = "COPY", requires = "patch")]
    out: Option<PathBuf>,
}

/// A description that was read, and the place of its copy.
pub(crate) struct Patch {
    file: String,
    text: String,
    format: Format,
    copy: OutputFile,
}

impl PatchArgs {
    pub fn planned(&self, plan: Plan) -> Plan {
        plan.reads(&self.patch).writes("--out", &self.out)
    }

    /// Reads the description, and claims the copy's place; `drives`: the configuration is of a robot.
    pub fn claim(&self, drives: bool) -> Result<Option<Patch>> {
        let (Some(path), Some(out)) = (&self.patch, &self.out) else { return Ok(None) };
        if !drives {
            let found = "enters sizes of a robot, and the configuration is of a gyro at rest";
            return Err(Error::new(ErrorKind::Usage, "--patch", found).hint("leave it out, or give --write-sim"));
        }
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, &e))?;
        let file = path.display().to_string();
        let format = robot::format_of(&text, &file)?;
        robot::parse(&text, &file, format, &Choice::default())?;
        Ok(Some(Patch { file, text, format, copy: OutputFile::claim(out)? }))
    }
}

impl Patch {
    /// Enters the effects of the answer that are present; what was changed, and what has no place, as JSON.
    pub fn write(mut self, answer: &Answer, vehicle: &Vehicle, output: &Output) -> Result<Value> {
        let robot = Robot::from(vehicle);
        let named = answer.together.iter().filter_map(|id| answer.effects.iter().find(|e| e.id == *id));
        let mut findings = Vec::new();
        let mut no_place = Vec::new();
        for effect in named {
            let truths = drive::by_id(&effect.id).map(|e| drive::described(e, &effect.parameters, &robot));
            let truths = truths.unwrap_or_default();
            if truths.is_empty() {
                no_place.push((effect.id.clone(), "descriptions of robots have no such number".to_string()));
            }
            findings.extend(
                truths
                    .into_iter()
                    .map(|truth| Finding { truth, says: says(&effect.id, &effect.parameters, &effect.std) }),
            );
        }
        let choice = Choice::default();
        let patched = robot::patch(&self.text, &self.file, self.format, &choice, &findings)?;
        no_place.extend(patched.no_place.into_iter().map(|(finding, why)| (finding.says, why)));
        let target = self.copy.target().display().to_string();
        self.copy.write_all(patched.text.as_bytes())?;
        self.copy.commit()?;
        output.say(format!("\nwrote {target}: {} of {} changed", patched.changes.len(), self.file));
        patched.changes.iter().for_each(|change| output.say(format!("  {change}")));
        no_place.iter().for_each(|(what, why)| output.say(format!("  no place for {what}: {why}")));
        let others = other_sizes(&robot::parse(&self.text, &self.file, self.format, &choice)?, vehicle);
        others.iter().for_each(|other| output.say(format!("note: {other}")));
        let no_place: Vec<Value> = no_place.iter().map(|(what, why)| json!({"finding": what, "why": why})).collect();
        Ok(json!({"file": target, "changes": patched.changes, "no_place": no_place, "notes": others}))
    }
}

/// An effect with its parameters and their 95 % intervals.
fn says(id: &str, parameters: &Parameters, std: &Parameters) -> String {
    let short = |x: f64| format!("{x:.3e}").parse::<f64>().unwrap_or(x);
    let one = |(name, value): (&String, &f64)| match std.get(name) {
        Some(std) => {
            format!(" {name} {} [{}, {}]", short(*value), short(value - 1.96 * std), short(value + 1.96 * std))
        }
        None => format!(" {name} {}", short(*value)),
    };
    let parameters: Vec<String> = parameters.iter().map(one).collect();
    format!("{id}{}", parameters.join(","))
}

/// Sizes in which the description is not CONFIG's robot: what was found is over CONFIG, and was entered over the description.
fn other_sizes(described: &robot::Robot, vehicle: &Vehicle) -> Vec<String> {
    let differ = |what: &str, fact: &Fact, stated: f64| {
        let value = fact.value.filter(|value| (value / stated - 1.0).abs() > ONE_ROBOT)?;
        Some(format!(
            "{what} is {value:.5} in the description and {stated:.5} in the configuration: changes are over the latter"
        ))
    };
    [
        differ("the mass (kg)", &described.mass_kg, vehicle.mass_kg),
        differ("the yaw inertia (kg m2)", &described.yaw_inertia_kg_m2, vehicle.yaw_inertia_kg_m2),
        differ("half the track (m)", &described.half_track_m, vehicle.half_track_m),
        differ("the wheel radius (m)", &described.wheel_radius_m, vehicle.wheel_radius_m),
    ]
    .into_iter()
    .flatten()
    .collect()
}
