//! A configuration to begin with: every key that people write, with its unit and its source or how to find it.

use crate::config::{Kind, SCHEMA, Steering};
use crate::files::mark::with_digest;
use crate::robot::{Fact, Robot};
use crate::units::RAD_S_PER_DEG_S;
use std::fmt::Write;

/// Column where comments begin.
const COMMENT: usize = 38;
/// Marks a line that has to be filled in.
const OPEN: &str = "to be filled in";

/// A configuration to begin with, and what it still lacks.
#[derive(Debug, Clone)]
pub struct Starter {
    /// The file's text.
    pub text: String,
    /// Keys that it needs and that nobody has stated.
    pub open: Vec<String>,
}

/// Lines of a configuration under way.
struct Lines {
    text: String,
    open: Vec<String>,
    table: &'static str,
}

impl Lines {
    /// A line with its comment in its column.
    fn line(&mut self, code: &str, comment: &str) {
        // a name from a description may hold anything
        let comment: String = comment.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        let _ = match comment.is_empty() {
            true => writeln!(self.text, "{code}"),
            false => writeln!(self.text, "{code:<COMMENT$}# {comment}"),
        };
    }

    fn table(&mut self, name: &'static str, comment: &str) {
        self.text.push('\n');
        self.table = name;
        self.line(&format!("[{name}]"), comment);
    }

    /// A key that the file needs.
    fn needs(&mut self, key: &str, unit: &str, fact: Option<&Fact>, hint: &str) {
        match fact {
            Some(Fact { value: Some(value), source }) => {
                self.line(&format!("{key} = {}", number(*value)), &format!("{unit}{source}"));
            }
            other => {
                let hint = other.map_or(hint, |f| f.source.as_str());
                self.open.push(format!("{}.{key}", self.table));
                self.line(&format!("# {key} ="), &format!("{OPEN}: {unit}{hint}"));
            }
        }
    }

    /// A key that may be left out.
    fn may(&mut self, code: &str, comment: &str) {
        self.line(&format!("# {code}"), comment);
    }
}

/// Five digits: descriptions are not known better.
fn number(x: f64) -> String {
    let rounded: f64 = format!("{x:.4e}").parse().unwrap_or(x);
    if rounded != 0.0 && (rounded.abs() < 1e-3 || rounded.abs() >= 1e5) {
        format!("{rounded:e}")
    } else {
        format!("{rounded:?}")
    }
}

/// The configuration of a gyro at rest, or of a robot, as far as its description tells.
#[must_use]
pub(crate) fn starter(kind: Kind, robot: Option<&Robot>) -> Starter {
    let mut lines = Lines { text: String::new(), open: Vec::new(), table: "" };
    match robot {
        Some(r) => {
            let from = format!("# {} of {} ({}): SI units, the unit stands in each key.\n", r.name, r.file, r.format);
            lines.text += &from.replace(|c: char| c.is_control() && c != '\n', " ");
            for note in &r.notes {
                lines.text += &format!("# Note: {}\n", note.replace(char::is_control, " "));
            }
        }
        None => lines.text += "# SI units, the unit stands in each key.\n",
    }
    lines.text += "# A line that begins with # and a key is not in force: delete the # to state it.\n";
    lines.text += "# The table [gyro] comes from a log of the gyro at rest from power-on: gyroid fit LOG --base THIS_FILE -o gyroid.toml\n\n";
    lines.line(&format!("schema = {SCHEMA}"), "");
    match kind {
        Kind::Stationary => {
            lines.line("kind = \"stationary\"", "a gyro at rest; driving: a robot on two driven wheels")
        }
        Kind::Driving => lines.line("kind = \"driving\"", "a robot on two driven wheels, or one that skids"),
    }
    match robot.and_then(|r| r.gyro_rate_hz.as_ref()) {
        Some(Fact { value: Some(hz), source }) => {
            lines.line(
                &format!("sample_time_s = {}", number(1.0 / hz)),
                &format!("step of simulator and filter: {source}"),
            );
        }
        _ => lines.may("sample_time_s = 0.01", "step of simulator and filter, s; else that of the log"),
    }
    gyro(&mut lines, robot);
    if kind == Kind::Driving {
        vehicle(&mut lines, robot);
    }
    Starter { text: with_digest(lines.text), open: lines.open }
}

fn gyro(lines: &mut Lines, robot: Option<&Robot>) {
    lines.text += "\n# Without a log at rest, from the data sheet; all four keys are needed then.\n";
    lines.may("[gyro]", "e(t) = c1 (1 - exp(-t / time_constant)) + c2, t from power-on");
    lines.may("c1_rad_s = 0.0", "change while it warms up; 0: none is known");
    lines.may("c2_rad_s = 0.0", "error at power-on");
    lines.may("time_constant_s = 300.0", "of the warm-up; without effect where c1 is 0");
    let noise = robot.and_then(|r| Some((r.gyro_noise_std_rad_s.as_ref()?, r.gyro_rate_hz.as_ref()?)));
    let told = noise.and_then(|(std, rate)| Some((std.value? / rate.value?.sqrt(), &std.source)));
    match told {
        Some((walk, source)) => lines.may(
            &format!("angle_random_walk_rad_sqrt_s = {}", number(walk)),
            &format!("{source}, times the square root of its step"),
        ),
        None => lines.may(
            "angle_random_walk_rad_sqrt_s =",
            &format!("noise density in deg/s/sqrt(Hz) times {RAD_S_PER_DEG_S:.6}"),
        ),
    }
    lines.may("turn_on_bias_std_rad_s =", "how much c2 varies from one power-on to the next; may be left out");
    lines.may("warm_up_relative_std =", "the same of c1 and time_constant, as a share; may be left out");
    lines.may("cooling_time_constant_s =", "how fast it cools when it is off; without it as it warms up");
}

fn vehicle(lines: &mut Lines, robot: Option<&Robot>) {
    lines.table("vehicle", "");
    let of = |fact: fn(&Robot) -> &Fact| robot.map(fact);
    lines.needs("mass_kg", "", of(|r| &r.mass_kg), "weigh the robot with all that it carries");
    let plate =
        "about the vertical axis through the centre of mass; a plate of length a, width b: mass (a^2 + b^2) / 12";
    lines.needs("yaw_inertia_kg_m2", "", of(|r| &r.yaw_inertia_kg_m2), plate);
    lines.needs("half_track_m", "", of(|r| &r.half_track_m), "half the distance between the middles of the wheels");
    match robot.map(|r| r.steering) {
        Some(Steering::Differential) => lines.line("steering = \"differential\"", "two driven wheels"),
        Some(Steering::Skid) => {
            lines.line("steering = \"skid\"", "several wheels a side: the effective track is wider")
        }
        None => {
            lines.may("steering = \"differential\"", "two driven wheels; skid: four wheels or tracks; may be left out")
        }
    }
    lines.needs("wheel_radius_m", "", of(|r| &r.wheel_radius_m), "the way of one turn, divided by 2 pi");
    let disc = "of one wheel with motor and gear (skid: all of a side); a disc: mass radius^2 / 2";
    lines.needs("wheel_inertia_kg_m2", "", of(|r| &r.wheel_inertia_kg_m2), disc);
    match of(|r| &r.viscous_friction_n_m_s) {
        Some(Fact { value: Some(value), source }) => {
            lines.line(&format!("viscous_friction_n_m_s = {}", number(*value)), source);
        }
        _ => lines.line("viscous_friction_n_m_s = 0.0", "torque per wheel speed; only recorded torques need it"),
    }
    lines.line("torque_noise_n_m_sqrt_s = 0.0", "std over a step dt is this / sqrt(dt); only recorded torques need it");
    lines.may("torque_constant_n_m_a =", "torque at the wheel per ampere, gear included; for recorded currents");

    lines.table("encoder", "");
    let noise = "white noise of one speed; 1 % of full speed where nothing is known";
    lines.needs("speed_noise_std_rad_s", "", None, noise);
    lines.may("ticks_per_revolution =", "of the wheel, gear included, where speeds are counted ticks");

    lines.text += "\n# Where the wheels slip and the drive torques are recorded; dry asphalt:\n";
    lines.may("[traction.law.burckhardt]", "c1, c2, c3 of the curve of traction over slip");
    for line in ["c1 = 1.2801", "c2 = 23.99", "c3 = 0.52"] {
        lines.may(line, "");
    }
    lines.text += "\n# Where a log has a reference pose: motion capture, GPS, scan matching.\n";
    lines.may("[pose]", "");
    lines.may("rate_hz =", "");
    lines.may("position_std_m =", "of x and of y");
    lines.may("heading_std_rad =", "3.2 where it tells none");
}
