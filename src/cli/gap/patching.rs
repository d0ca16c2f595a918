//! `--patch`: what was found, entered into a copy of the robot's description, and Python beside it for what its log lacks.

use super::replay::{self, Reads, Simulator};
use crate::cli::output::Output;
use clap::Args;
use gyroid::config::{Config, Vehicle};
use gyroid::effects::{Parameters, drive};
use gyroid::export::{Snippet, log_snippet, on_log};
use gyroid::files::{OutputFile, Plan};
use gyroid::gap::answer::{Answer, EffectAnswer};
use gyroid::gap::holdout::gate::{Gate, gate};
use gyroid::gap::holdout::replay::Replayed;
use gyroid::model::drive::{Robot, with_spin};
use gyroid::robot::{self, Chassis, Choice, Finding, Format, Patched};
use gyroid::signal::Log;
use gyroid::{Error, ErrorKind, Result};
use serde_json::{Value, json};
use std::io::Write;
use std::path::{Path, PathBuf};

/// CONFIG and description are of one robot within this share.
const ONE_ROBOT: f64 = 0.01;

#[derive(Debug, Args)]
pub(crate) struct PatchArgs {
    /// The robot's description (SDF, URDF, MJCF): enter what was found into a copy of it
    ///
    /// True sizes are changed in place, each under a comment with its 95 % interval; what the controller believes stays. What sensors
    /// do to their readings goes into Python beside the copy (COPY's name and _log.py), for the simulator's log.
    #[arg(long, value_name = "FILE", requires = "out")]
    patch: Option<PathBuf>,
    /// Write that copy here
    #[arg(short, long, value_name = "COPY", requires = "patch")]
    out: Option<PathBuf>,
    /// Run your simulator on the first recording of --hold, before and after, and enter only what makes its error smaller there
    ///
    /// A command of the shell: {model} becomes the path of a description, {inputs} that of a CSV with t_s from 0 and the recording's
    /// torque_left_n_m, torque_right_n_m (without torques: command_left_rad_s, command_right_rad_s; else command_speed_m_s,
    /// command_yaw_rate_rad_s), {log} that of the log it is to write. Each run is to draw the same chance.
    #[arg(long, value_name = "COMMAND", requires = "patch")]
    simulate: Option<String>,
}

/// A description that was read, and the place of its copy.
pub(crate) struct Patch<'a> {
    file: String,
    text: String,
    format: Format,
    copy: OutputFile,
    /// Python for the simulator's log.
    log: OutputFile,
    simulate: Option<&'a str>,
    /// The user's simulator, and its errors under the description as it is.
    replay: Option<(Simulator<'a>, Replayed)>,
}

/// Changes that one effect makes.
#[derive(Clone)]
struct Change<'a> {
    effect: &'a EffectAnswer,
    /// In the description.
    findings: Vec<Finding>,
    /// In the log.
    on_log: bool,
}

/// The files that are to be written.
pub(crate) struct Decided {
    /// None where the replay kept nothing.
    patched: Option<Patched>,
    /// Python, and the effects in it.
    snippet: Option<(Snippet, Vec<String>)>,
    no_place: Vec<(String, String)>,
    replay: Option<(String, Gate)>,
    notes: Vec<String>,
}

/// Beside the copy, under a name that Python can import.
fn log_path(copy: &Path) -> PathBuf {
    let stem = copy.file_stem().unwrap_or_default().to_string_lossy();
    let word: String = stem.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
    copy.with_file_name(format!("{word}_log.py"))
}

impl PatchArgs {
    pub(super) fn planned(&self, plan: Plan) -> Plan {
        plan.reads(&self.patch).writes("--out", &self.out).writes("--out", self.out.as_deref().map(log_path))
    }

    /// Reads the description, and claims the copy's place; `drives`: the configuration is of a robot.
    pub(super) fn claim(&self, drives: bool) -> Result<Option<Patch<'_>>> {
        let (Some(path), Some(out)) = (&self.patch, &self.out) else { return Ok(None) };
        if !drives {
            let found = "enters sizes of a robot, and the configuration is of a gyro at rest";
            return Err(Error::new(ErrorKind::Usage, "--patch", found).hint("leave it out, or give --write-sim"));
        }
        self.simulate.as_deref().map_or(Ok(()), replay::check)?;
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, &e))?;
        let file = path.display().to_string();
        let format = robot::format_of(&text, &file)?;
        robot::parse(&text, &file, format, &Choice::default())?;
        let (copy, log) = (OutputFile::claim(out)?, OutputFile::claim(log_path(out))?);
        Ok(Some(Patch { file, text, format, copy, log, simulate: self.simulate.as_deref(), replay: None }))
    }
}

impl<'a> Patch<'a> {
    /// Runs the user's simulator, where there is one, on the recording held out with the description as it is.
    pub(super) fn replays(&mut self, kept: Option<&'a Log>, reads: Reads<'a>) -> Result<()> {
        let Some(command) = self.simulate else { return Ok(()) };
        let simulator = Simulator::new(command, kept, reads)?;
        let before = simulator.run(Path::new(&self.file), &self.file, None)?;
        self.replay = Some((simulator, before));
        Ok(())
    }

    /// The link that carries the robot.
    pub(super) fn chassis(&self) -> Result<Option<Chassis>> {
        robot::chassis(&self.text, &self.file, self.format, &Choice::default())
    }

    /// `findings`, over `robot`, in the description.
    fn entered(&self, findings: &[Finding], robot: &Robot) -> Result<Patched> {
        let [mass_kg, yaw_inertia_kg_m2] = robot.accelerated();
        let shares = [robot.mass_kg / mass_kg, robot.yaw_inertia_kg_m2 / yaw_inertia_kg_m2];
        robot::patch(&self.text, &self.file, self.format, &Choice::default(), findings, shares)
    }

    /// Errors of the user's simulator with `changes`: a description with them lies beside the copy meanwhile, since what it
    /// includes is found from there.
    fn replayed(
        &self,
        simulator: &Simulator<'_>,
        changes: &[(&str, Change<'_>)],
        robot: &Robot,
        config: &Config,
    ) -> Result<Replayed> {
        let findings: Vec<Finding> = changes.iter().flat_map(|(_, change)| change.findings.clone()).collect();
        let patched = self.entered(&findings, robot)?;
        let folder = self.copy.target().parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let ending =
            Path::new(&self.file).extension().map_or_else(String::new, |e| format!(".{}", e.to_string_lossy()));
        let cannot = |e: std::io::Error| Error::io(folder, &e);
        let mut model =
            tempfile::Builder::new().prefix("gyroid-").suffix(&ending).tempfile_in(folder).map_err(cannot)?;
        model.write_all(patched.text.as_bytes()).and_then(|()| model.flush()).map_err(cannot)?;
        let ids: Vec<&str> = changes.iter().map(|(id, _)| *id).collect();
        let of_log: Vec<&EffectAnswer> = changes.iter().filter(|(_, c)| c.on_log).map(|(_, c)| c.effect).collect();
        let snippet = (!of_log.is_empty()).then(|| log_snippet(&of_log, &[], config));
        simulator.run(model.path(), &format!("{} and {}", self.file, ids.join(", ")), snippet.as_ref())
    }

    /// The effects of the answer that are present, entered; with a simulator, those of them that make its error smaller, and those
    /// of sensors that no replay can judge. `config`: the simulator.
    pub(super) fn decide(&self, answer: &Answer, vehicle: &Vehicle, config: &Config) -> Result<Decided> {
        let robot = Robot::from(vehicle);
        let mut found: Vec<(&str, Change<'_>)> = Vec::new();
        let (mut no_place, mut notes) = (Vec::new(), Vec::new());
        for effect in answer.present() {
            let truths = drive::by_id(&effect.id).map(|e| drive::described(e, &effect.parameters, &robot));
            let says = || says(&effect.id, &effect.parameters, &effect.std);
            let findings = truths.into_iter().flatten().map(|truth| Finding { truth, says: says() });
            let findings: Vec<Finding> = findings.collect();
            let change = match on_log(effect) {
                Ok(_) if self.entered(&findings, &robot)?.changes.is_empty() => {
                    Change { effect, findings: Vec::new(), on_log: true }
                }
                Err(why) if findings.is_empty() => {
                    no_place.push((effect.id.clone(), why.to_string()));
                    continue;
                }
                _ => Change { effect, findings, on_log: false },
            };
            found.push((&effect.id, change));
        }
        let all = |found: &[(&str, Change<'_>)]| -> Vec<Finding> {
            found.iter().flat_map(|f| f.1.findings.clone()).collect()
        };
        let whole = self.entered(&all(&found), &robot)?;
        no_place.extend(whole.no_place.into_iter().map(|(finding, why)| (finding.says, why)));
        let mut gated = None;
        if let Some((simulator, before)) = &self.replay {
            let python = simulator.has_python();
            let judged = |change: &Change<'_>| -> Result<bool> {
                // what has no place changes nothing there
                Ok(if change.on_log {
                    python && on_log(change.effect).is_ok_and(|work| work.repeats)
                } else {
                    !self.entered(&change.findings, &robot)?.changes.is_empty()
                })
            };
            let mut tried = Vec::new();
            let mut unjudged = Vec::new();
            for one in found {
                if judged(&one.1)? { tried.push(one) } else { unjudged.push(one) }
            }
            let gate = gate(before, tried.clone(), |changes| self.replayed(simulator, changes, &robot, config))?;
            tried.retain(|(id, _)| gate.kept.iter().any(|kept| kept == id));
            unjudged.retain(|(_, change)| change.on_log);
            if !unjudged.is_empty() {
                let ids: Vec<&str> = unjudged.iter().map(|(id, _)| *id).collect();
                let why = if python {
                    "no replay comes nearer to one recording by them"
                } else {
                    "python3 has no numpy here"
                };
                notes.push(format!("not tried in your simulator: {}: {why}", ids.join(", ")));
            }
            gated = Some((simulator.recording().source.clone(), gate, !tried.is_empty()));
            found = tried.into_iter().chain(unjudged).collect();
        }
        let of_log: Vec<&EffectAnswer> = found.iter().filter(|(_, c)| c.on_log).map(|(_, c)| c.effect).collect();
        let ids = of_log.iter().map(|effect| effect.id.clone()).collect();
        let snippet = (!of_log.is_empty()).then(|| (log_snippet(&of_log, &no_place, config), ids));
        let patched = match gated {
            Some((_, _, false)) => None,
            _ => Some(self.entered(&all(&found), &robot)?),
        };
        let replay = gated.map(|(recording, gate, _)| (recording, gate));
        Ok(Decided { patched, snippet, no_place, replay, notes })
    }

    /// Writes the copy and Python for the log; what was changed, and what has no place, as JSON.
    pub(super) fn write(mut self, decided: Decided, vehicle: &Vehicle, output: &Output) -> Result<Value> {
        let Decided { patched, snippet, no_place, replay, mut notes } = decided;
        let target = self.copy.target().display().to_string();
        let changes = match &patched {
            Some(patched) => {
                self.copy.write_all(patched.text.as_bytes())?;
                self.copy.commit()?;
                output.say(format!("\nwrote {target}: {} of {} changed", patched.changes.len(), self.file));
                patched.changes.as_slice()
            }
            None => {
                output.say(format!(
                    "\ndid not write {target}: nothing that was found makes your simulator's error smaller"
                ));
                &[]
            }
        };
        changes.iter().for_each(|change| output.say(format!("  {change}")));
        let mut on_log = Vec::new();
        let python = self.log.target().display().to_string();
        if let Some((snippet, ids)) = &snippet {
            self.log.write_all(snippet.text.as_bytes())?;
            self.log.commit()?;
            output.say(format!("wrote {python}: for the log of your simulator, {}", ids.join(", ")));
            on_log.clone_from(ids);
        }
        no_place.iter().for_each(|(what, why)| output.say(format!("  no place for {what}: {why}")));
        if let Some((recording, gate)) = &replay {
            output.say(replay::text(recording, gate));
        }
        let choice = Choice::default();
        notes.extend(other_sizes(&robot::parse(&self.text, &self.file, self.format, &choice)?, vehicle));
        notes.iter().for_each(|other| output.say(format!("note: {other}")));
        let no_place: Vec<Value> = no_place.iter().map(|(what, why)| json!({"finding": what, "why": why})).collect();
        let file = patched.is_some().then_some(target);
        let mut told = json!({"file": file, "changes": changes, "no_place": no_place, "notes": notes});
        told["log"] = json!({"file": snippet.is_some().then_some(python), "effects": on_log});
        if let Some((recording, gate)) = replay {
            told["replay"] = json!(gate);
            told["replay"]["recording"] = json!(recording);
        }
        Ok(told)
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
    let differ = |what: &str, value: Option<f64>, stated: f64| {
        let value = value.filter(|value| (value / stated - 1.0).abs() > ONE_ROBOT)?;
        Some(format!(
            "{what} is {value:.5} in the description and {stated:.5} in the configuration: changes are over the latter"
        ))
    };
    // a robot that a log told holds the wheels' spin in its mass
    let [half_track, radius, wheel] =
        [&described.half_track_m, &described.wheel_radius_m, &described.wheel_inertia_kg_m2].map(|fact| fact.value);
    let own = described.mass_kg.value.zip(described.yaw_inertia_kg_m2.value);
    let all = own.zip(half_track.zip(radius)).map(|((mass, inertia), (half_track, radius))| {
        with_spin([mass, inertia], half_track, wheel.unwrap_or(0.0), [radius; 2])
    });
    let stated = Robot::from(vehicle).accelerated();
    [
        differ("the mass with the wheels' spin (kg)", all.map(|a| a[0]), stated[0]),
        differ("the yaw inertia with it (kg m2)", all.map(|a| a[1]), stated[1]),
        differ("half the track (m)", half_track, vehicle.half_track_m),
        differ("the wheel radius (m)", radius, vehicle.wheel_radius_m),
    ]
    .into_iter()
    .flatten()
    .collect()
}
