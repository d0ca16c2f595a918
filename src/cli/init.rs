//! `gyroid init`: a configuration to begin with.

use super::outcome::Outcome;
use super::output::{Common, Output};
use clap::Args;
use gyroid::Result;
use gyroid::config::{Kind, Steering};
use gyroid::export::{Starter, starter};
use gyroid::files::{OutputFile, Plan};
use gyroid::robot::{self, Choice, Fact, Format, Robot};
use std::fmt::Write;
use std::path::PathBuf;

/// Write a commented configuration to begin with, from a robot's description where there is one
///
/// A description of a robot with two driven wheels, or with several a side that skid, tells mass, yaw inertia, track, wheel radius
/// and wheel inertia; a comment says where each value comes from. What nobody has told stands in the file as a line to be filled
/// in. Then gyroid fit LOG --base FILE adds the gyro.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    gyroid init --kind driving -o robot.toml\n  \
    gyroid init --urdf husky.urdf -o robot.toml\n  \
    gyroid init --sdf world.sdf --model vehicle_blue -o robot.toml\n  \
    gyroid init --mjcf rover.xml --left-wheel left --right-wheel right -o robot.toml\n  \
    gyroid init --kind rest -o gyro.toml")]
pub(crate) struct InitArgs {
    /// Kind of the configuration: a gyro at rest, or a robot that drives [default: driving, with a description]
    #[arg(long, value_enum, required_unless_present = "description")]
    kind: Option<KindName>,
    #[command(flatten)]
    description: Description,
    /// Robot of the description, where that holds several
    #[arg(long, value_name = "NAME", requires = "description")]
    model: Option<String>,
    /// Joint of a driven wheel on the left, where the description leaves it open; may be given more than once
    #[arg(long, value_name = "JOINT", requires = "description", requires = "right_wheel")]
    left_wheel: Vec<String>,
    /// The same on the right
    #[arg(long, value_name = "JOINT", requires = "description", requires = "left_wheel")]
    right_wheel: Vec<String>,
    /// Write the configuration here
    #[arg(short, long, value_name = "FILE")]
    out: PathBuf,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Args)]
#[group(id = "description", multiple = false)]
struct Description {
    /// The robot's description in URDF, its macros expanded (xacro robot.urdf.xacro -o robot.urdf)
    #[arg(long, value_name = "FILE")]
    urdf: Option<PathBuf>,
    /// The same in SDF, a model or a world
    #[arg(long, value_name = "FILE")]
    sdf: Option<PathBuf>,
    /// The same in MJCF, of MuJoCo
    #[arg(long, value_name = "FILE")]
    mjcf: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum KindName {
    Rest,
    Driving,
}

impl Description {
    fn file(&self) -> Option<(&PathBuf, Format)> {
        let given = [(&self.urdf, Format::Urdf), (&self.sdf, Format::Sdf), (&self.mjcf, Format::Mjcf)];
        given.into_iter().find_map(|(path, format)| Some((path.as_ref()?, format)))
    }
}

pub(crate) fn run(args: &InitArgs) -> Result<Outcome> {
    let description = args.description.file();
    if args.kind == Some(KindName::Rest) && description.is_some() {
        return Err(gyroid::Error::new(
            gyroid::ErrorKind::Usage,
            "--kind rest",
            "a gyro at rest has no robot to describe",
        )
        .hint("leave out the description, or say --kind driving"));
    }
    let kind = if args.kind == Some(KindName::Rest) { Kind::Stationary } else { Kind::Driving };
    let plan = Plan::new().reads(description.map(|(path, _)| path)).writes("--out", [&args.out]);
    let output = Output::open(&args.common, "init", plan)?;
    let mut file = OutputFile::claim(&args.out)?;
    let choice = Choice { model: args.model.clone(), left: args.left_wheel.clone(), right: args.right_wheel.clone() };
    let robot = description.map(|(path, format)| robot::read(path, format, &choice)).transpose()?;
    let Starter { text, open } = starter(kind, robot.as_ref());
    file.write_all(text.as_bytes())?;
    file.commit()?;
    output.say(words(args, robot.as_ref(), &open));
    output.finish(&json(args, kind, robot.as_ref(), &open))?;
    Ok(Outcome::Done)
}

fn words(args: &InitArgs, robot: Option<&Robot>, open: &[String]) -> String {
    let out = args.out.display();
    let mut t = format!("wrote {out}");
    if let Some(r) = robot {
        let how = match r.steering {
            Steering::Differential => "two driven wheels",
            Steering::Skid => "wheels that skid",
        };
        let _ =
            write!(t, ": {} ({}), {how}: left {}, right {}", r.name, r.format, r.left.join(", "), r.right.join(", "));
        for (name, fact, unit) in facts(r) {
            if let Fact { value: Some(value), source } = fact {
                let shown = if value.abs() < 0.01 { format!("{value:.3e}") } else { format!("{value:.4}") };
                let _ = write!(t, "\n  {name:<16}{shown:>10} {unit:<8} {source}");
            }
        }
        for note in &r.notes {
            let _ = write!(t, "\nnote: {note}");
        }
    }
    if !open.is_empty() {
        let _ = write!(t, "\nto be filled in: {}", open.join(", "));
    }
    let _ = write!(t, "\nnext, a log of the gyro at rest from power-on: gyroid fit LOG --base {out} -o gyroid.toml");
    t
}

/// Quantities of a robot by name, with their units.
fn facts(r: &Robot) -> [(&'static str, &Fact, &'static str); 6] {
    [
        ("mass", &r.mass_kg, "kg"),
        ("yaw inertia", &r.yaw_inertia_kg_m2, "kg m2"),
        ("half the track", &r.half_track_m, "m"),
        ("wheel radius", &r.wheel_radius_m, "m"),
        ("wheel inertia", &r.wheel_inertia_kg_m2, "kg m2"),
        ("wheel damping", &r.viscous_friction_n_m_s, "N m s"),
    ]
}

fn json(args: &InitArgs, kind: Kind, robot: Option<&Robot>, open: &[String]) -> serde_json::Value {
    let fact = |f: &Fact| serde_json::json!({ "value": f.value, "source": f.source });
    serde_json::json!({
        "configuration": args.out.display().to_string(),
        "kind": kind,
        "to_be_filled_in": open,
        "robot": robot.map(|r| serde_json::json!({
            "name": r.name,
            "file": r.file,
            "format": r.format.to_string(),
            "left_wheels": r.left,
            "right_wheels": r.right,
            "steering": r.steering,
            "mass_kg": fact(&r.mass_kg),
            "yaw_inertia_kg_m2": fact(&r.yaw_inertia_kg_m2),
            "half_track_m": fact(&r.half_track_m),
            "wheel_radius_m": fact(&r.wheel_radius_m),
            "wheel_inertia_kg_m2": fact(&r.wheel_inertia_kg_m2),
            "viscous_friction_n_m_s": fact(&r.viscous_friction_n_m_s),
            "notes": r.notes,
        })),
    })
}
