//! A description with what is true of the robot entered: numbers are changed in place, all else stays as it was written.
//!
//! What a controller believes (a plugin's wheel radius and separation) is left alone: the gap between both is the effect.
//!
//! Torques tell masses over what they accelerate, E = M + ΣJw/r². The robot that a truth is over may hold the wheels' inertia in
//! its mass (one that a log told does), and its torques may be in another unit: σ = M/E of it is free of both. A load m of it is
//! Δ = m σ E kg of the description, and a centre of mass d ahead is d σ E (1 + m)/(M + Δ) ahead there. Yaw inertia likewise.

use super::chassis::heaviest;
use super::facts::inertia_of_side;
use super::model::{Mass, Model, shifted, sum};
use super::patch_edits::Edits;
use super::patch_places::{Placed, Places, Weighed};
use super::read::{choose, models, opened};
use super::types::{Choice, Format};
use super::wheels::{Wheels, radius};
use super::xml::Xml;
use super::{patch_mjcf, patch_sdf, patch_urdf};
use crate::error::{Error, ErrorKind, Result};
use crate::model::drive::with_spin;
use nalgebra::{Matrix3, Point3, Vector3};

/// Standard gravity, m/s².
const GRAVITY_M_S2: f64 = 9.80665;
/// Speed at which a coefficient of resistance that grows with speed is stated, m/s.
const STATED_AT_M_S: f64 = 0.5;
/// The patched text, read again, says what was asked for within this share.
const AGREE: f64 = 1e-6;

/// True sizes of the robot, over those of its description.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Truth {
    /// Radii of the left and right wheels, over those described.
    Radius {
        /// Left.
        left: f64,
        /// Right.
        right: f64,
    },
    /// Distance of the sides, over that described.
    Track(f64),
    /// Mass and yaw inertia about the centre of mass that come to it, over those of the whole robot.
    Load {
        /// Mass.
        mass: f64,
        /// Yaw inertia.
        inertia: f64,
    },
    /// How far the centre of mass lies further ahead, m.
    Ahead(f64),
    /// Rolling resistance that comes to it, as force over weight.
    Resistance {
        /// At 0.5 m/s.
        coefficient: f64,
        /// Growth with speed, s/m.
        rise: f64,
    },
    /// Torques of the left and right motors, over those described.
    Torque {
        /// Left.
        left: f64,
        /// Right.
        right: f64,
    },
    /// Tilt of the floor, rad, and the heading of the way uphill, rad, from the robot's heading at the start.
    Slope {
        /// Tilt.
        slope: f64,
        /// Heading uphill.
        uphill: f64,
    },
}

/// A truth, and what a comment beside the changed number says of it: its name, estimate and interval.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Finding {
    /// The truth.
    pub truth: Truth,
    /// The comment.
    pub says: String,
}

/// A patched description.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Patched {
    /// Its text.
    pub text: String,
    /// Changes, a line each: the element, the number before and after.
    pub changes: Vec<String>,
    /// Findings that this description has no place for, with the reason.
    pub no_place: Vec<(Finding, String)>,
}

/// The format of a description, by its first element.
///
/// # Errors
/// [`ErrorKind::Format`] for what is no description of a robot.
pub(crate) fn format_of(text: &str, file: &str) -> Result<Format> {
    let (document, _) = opened(text, file)?;
    let tag = document.root_element().tag_name().name();
    Format::of(tag).ok_or_else(|| {
        Error::new(ErrorKind::Format, file, format!("begins with <{tag}>: that is no description of a robot"))
            .hint("give a file of URDF (<robot>), SDF (<sdf>) or MJCF (<mujoco>)")
    })
}

/// Enters `findings` into the description `text`; `file` is its name in messages. `shares`: mass and yaw inertia of the robot that
/// they are over, each over what its motors accelerate.
///
/// # Errors
/// As [`parse`](super::parse); [`ErrorKind::Numeric`] if the patched text does not say what was to be entered.
pub(crate) fn patch(
    text: &str,
    file: &str,
    format: Format,
    choice: &Choice,
    findings: &[Finding],
    shares: [f64; 2],
) -> Result<Patched> {
    let (document, skipped_rows) = opened(text, file)?;
    let xml = Xml { file, doc: &document, skipped_rows };
    let root = document.root_element();
    let all = models(&xml, root, format)?;
    let (model, wheels) = choose(&all, file, choice)?;
    let places: Box<dyn Places + '_> = match format {
        Format::Urdf => Box::new(patch_urdf::Urdf { root, model }),
        Format::Sdf => Box::new(patch_sdf::Sdf { xml: &xml, root, model }),
        Format::Mjcf => Box::new(patch_mjcf::Mjcf::new(&xml, root, model)),
    };
    let source = document.input_text();
    let mut work = Work { model, wheels: &wheels, source, shares, edits: Edits::default(), no_place: Vec::new() };
    let wanted = work.enter(places.as_ref(), findings);
    let prefix = &text[..text.len() - source.len()];
    let (edited, changes) = work.edits.applied(source);
    let no_place = work.no_place;
    let patched = format!("{prefix}{edited}");
    // wheels of different sizes are only found by their names
    let names = |side: &[usize]| side.iter().map(|j| model.joints[*j].name.clone()).collect();
    let chosen = Choice { model: Some(model.name.clone()), left: names(&wheels.left), right: names(&wheels.right) };
    checked(&patched, file, format, &chosen, &wanted)?;
    Ok(Patched { text: patched, changes, no_place })
}

/// Sizes that the patched description must have.
#[derive(Debug, Clone, Copy)]
struct Sizes {
    kg: f64,
    centre: Point3<f64>,
    yaw_inertia: f64,
    track_m: f64,
    radii_m: [f64; 2],
}

fn sizes(model: &Model, wheels: &Wheels) -> Option<Sizes> {
    let (kg, centre, inertia) = sum(model.links.iter().map(|l| &l.mass))?;
    let of = |side: &[usize]| side.iter().find_map(|j| radius(model, *j)).map_or(f64::NAN, |(r, _)| r);
    let radii_m = [of(&wheels.left), of(&wheels.right)];
    Some(Sizes { kg, centre, yaw_inertia: inertia[(2, 2)], track_m: wheels.track_m, radii_m })
}

struct Work<'a> {
    model: &'a Model,
    wheels: &'a Wheels,
    source: &'a str,
    shares: [f64; 2],
    edits: Edits,
    no_place: Vec<(Finding, String)>,
}

impl Work<'_> {
    /// Enters all findings that have a place; the sizes that the description must then have, where it states masses.
    fn enter(&mut self, places: &dyn Places, findings: &[Finding]) -> Option<Sizes> {
        let before = sizes(self.model, self.wheels);
        let mut wanted = before;
        let mut moved = vec![Vector3::zeros(); self.model.joints.len()];
        for finding in findings {
            let placed = match finding.truth {
                Truth::Radius { left, right } => self.radii(places, [left, right], &mut moved, finding),
                Truth::Track(factor) => self.track(places, factor, &mut moved, finding),
                Truth::Resistance { coefficient, rise } => {
                    self.resistance(places, findings, coefficient, rise, finding)
                }
                Truth::Torque { left, right } => self.gears(places, [left, right], finding),
                Truth::Slope { slope, uphill } => {
                    let (level, down) = (slope.sin(), -slope.cos());
                    let direction = Vector3::new(-level * uphill.cos(), -level * uphill.sin(), down);
                    self.noted(finding, |edits| places.gravity(direction, GRAVITY_M_S2, edits))
                }
                // both meet in one inertial, below
                Truth::Load { .. } | Truth::Ahead(_) => Ok(()),
            };
            match (placed, finding.truth, &mut wanted) {
                (Err(why), ..) => self.no_place.push((finding.clone(), why)),
                (Ok(()), Truth::Radius { left, right }, Some(w)) => {
                    w.radii_m = [w.radii_m[0] * left, w.radii_m[1] * right];
                }
                (Ok(()), Truth::Track(factor), Some(w)) => w.track_m *= factor,
                _ => {}
            }
        }
        let of_mass: Vec<&Finding> =
            findings.iter().filter(|f| matches!(f.truth, Truth::Load { .. } | Truth::Ahead(_))).collect();
        let any_moved = moved.iter().any(|by| by.norm() > 0.0);
        if of_mass.is_empty() && !any_moved {
            return wanted;
        }
        match self.masses(places, &of_mass, &moved, before) {
            Ok((kg, centre, yaw_inertia)) => wanted.map(|w| Sizes { kg, centre, yaw_inertia, ..w }),
            Err(why) => {
                self.no_place.extend(of_mass.into_iter().map(|f| (f.clone(), why.clone())));
                None
            }
        }
    }

    /// Mass, kg, and yaw inertia, kg·m², of the description that stand for those of the robot that truths are over.
    fn own(&self) -> Option<[f64; 2]> {
        let found = sizes(self.model, self.wheels)?;
        let wheel =
            inertia_of_side(self.model, self.wheels).value.filter(|_| found.radii_m.iter().all(|r| r.is_finite()));
        let own = [found.kg, found.yaw_inertia];
        let all = wheel.map_or(own, |j| with_spin(own, found.track_m / 2.0, j, found.radii_m));
        Some([self.shares[0] * all[0], self.shares[1] * all[1]])
    }

    /// Does one change under the finding's comment; what it began is undone where it has no place.
    fn noted(&mut self, finding: &Finding, change: impl FnOnce(&mut Edits) -> Placed) -> Placed {
        let mut edits = self.edits.clone();
        edits.begin(self.source, &finding.says);
        change(&mut edits)?;
        self.edits = edits;
        Ok(())
    }

    /// Wheels of another size, whose axles are moved so that chassis and casters stay at their height.
    fn radii(&mut self, places: &dyn Places, over: [f64; 2], moved: &mut [Vector3<f64>], finding: &Finding) -> Placed {
        let (model, wheels) = (self.model, self.wheels);
        let mut steps = Vec::new();
        for (side, factor) in [&wheels.left, &wheels.right].into_iter().zip(over) {
            for joint in side.iter().filter(|_| factor != 1.0) {
                let (metres, _) = radius(model, *joint)
                    .ok_or_else(|| format!("the wheel of {} has no round shape", model.joints[*joint].name))?;
                steps.push((*joint, factor, Vector3::z() * (factor - 1.0) * metres));
            }
        }
        self.noted(finding, |edits| {
            steps.iter().try_for_each(|(joint, factor, by)| places.wheel(*joint, *factor, *by, edits))
        })?;
        steps.iter().for_each(|(joint, _, by)| moved[*joint] += by);
        Ok(())
    }

    fn track(&mut self, places: &dyn Places, factor: f64, moved: &mut [Vector3<f64>], finding: &Finding) -> Placed {
        let (model, wheels) = (self.model, self.wheels);
        if wheels.left.len() != 1 || wheels.right.len() != 1 {
            return Err(
                "the effective track of a robot that skids is made by its contacts, not by where its wheels are".into(),
            );
        }
        let across = across(model, wheels) * (factor - 1.0) * wheels.track_m / 2.0;
        let steps = [(wheels.left[0], across), (wheels.right[0], -across)];
        self.noted(finding, |edits| steps.iter().try_for_each(|(joint, by)| places.wheel(*joint, 1.0, *by, edits)))?;
        steps.iter().for_each(|(joint, by)| moved[*joint] += by);
        Ok(())
    }

    /// F = weight · [c + a (v - 0.5 m/s)] over the driven wheels: dry friction and damping of their joints.
    fn resistance(
        &mut self,
        places: &dyn Places,
        all: &[Finding],
        coefficient: f64,
        rise: f64,
        finding: &Finding,
    ) -> Placed {
        let (model, wheels) = (self.model, self.wheels);
        let [kg, _] = self.own().ok_or("the description states no masses")?;
        let kg = kg * loaded(all.iter());
        let dry = coefficient - STATED_AT_M_S * rise;
        if dry < 0.0 || rise < 0.0 {
            return Err("it grows with speed in a way that dry friction and damping do not make".into());
        }
        let mut steps = Vec::new();
        for side in [&wheels.left, &wheels.right] {
            for joint in side {
                let (r, _) = radius(model, *joint)
                    .ok_or_else(|| format!("the wheel of {} has no round shape", model.joints[*joint].name))?;
                let weight = kg * GRAVITY_M_S2 / (2 * side.len()) as f64;
                steps.push((*joint, dry * weight * r, rise * weight * r * r));
            }
        }
        self.noted(finding, |edits| {
            steps.iter().try_for_each(|(j, dry, damping)| places.friction(*j, *dry, *damping, edits))
        })
    }

    fn gears(&mut self, places: &dyn Places, over: [f64; 2], finding: &Finding) -> Placed {
        let wheels = self.wheels;
        self.noted(finding, |edits| {
            let mut sides = [&wheels.left, &wheels.right].into_iter().zip(over);
            sides.try_for_each(|(side, factor)| side.iter().try_for_each(|j| places.gear(*j, factor, edits)))
        })
    }

    /// One link takes what the whole robot is to have; mass, centre and yaw inertia of the robot then.
    ///
    /// m' = m + Δ;  c' = (M' C' - Σ m_i c_i)/m';  I' = J' - Σ (I_i + m_i |c_i - C'|²) - m' |c' - C'|², i: the other links
    fn masses(
        &mut self,
        places: &dyn Places,
        findings: &[&Finding],
        moved: &[Vector3<f64>],
        before: Option<Sizes>,
    ) -> std::result::Result<(f64, Point3<f64>, f64), String> {
        let model = self.model;
        let before = before.ok_or("the description states no masses")?;
        let [own_kg, own_yaw] = self.own().ok_or("the description states no masses")?;
        let (mut kg, mut centre, mut yaw) = (before.kg, before.centre, before.yaw_inertia);
        for finding in findings {
            if let Truth::Load { mass, inertia } = finding.truth {
                kg += mass * own_kg;
                yaw += inertia * own_yaw;
            }
        }
        let ahead = across(model, self.wheels).cross(&Vector3::z()) * own_kg * loaded(findings.iter().copied()) / kg;
        centre += findings
            .iter()
            .map(|f| if let Truth::Ahead(metres) = f.truth { ahead * metres } else { Vector3::zeros() })
            .sum::<Vector3<f64>>();
        let carried: Vec<Vec<usize>> =
            (0..moved.len()).filter(|j| moved[*j].norm() > 0.0).map(|j| model.rigid(model.joints[j].child)).collect();
        let chassis = heaviest(model, self.wheels).ok_or("no link but the wheels has a mass")?;
        let others: Vec<Mass> = (0..model.links.len())
            .filter(|l| *l != chassis)
            .map(|l| {
                let joint = (0..moved.len()).filter(|j| moved[*j].norm() > 0.0);
                let by = joint
                    .zip(&carried)
                    .find(|(_, links)| links.contains(&l))
                    .map_or(Vector3::zeros(), |(j, _)| moved[j]);
                match &model.links[l].mass {
                    Mass::Known { kg, at, inertia } => Mass::Known { kg: *kg, at: at + by, inertia: *inertia },
                    other => other.clone(),
                }
            })
            .collect();
        let Mass::Known { inertia, at, .. } = &model.links[chassis].mass else {
            return Err("no link but the wheels has a mass".into());
        };
        let (rest, rest_at, rest_inertia) = sum(others.iter()).unwrap_or((0.0, centre, Matrix3::zeros()));
        let own = kg - rest;
        if own <= 0.0 {
            return Err(format!("{} would have no mass left", model.links[chassis].name));
        }
        let mut to = (centre.coords * kg - rest_at.coords * rest) / own;
        to.z = at.z; // how high the centre is, a drive on level ground does not tell
        let level = |v: Vector3<f64>| Vector3::new(v.x, v.y, 0.0);
        let rest_yaw = shifted(&rest_inertia, rest, &level(rest_at - centre))[(2, 2)];
        let own_inertia = yaw - rest_yaw - own * level(to - centre.coords).norm_squared();
        if own_inertia <= 0.0 {
            return Err(format!("{} would have no yaw inertia left", model.links[chassis].name));
        }
        // what stands upright as a plate does keeps Ixx + Iyy >= Izz
        let gained = own_inertia - inertia[(2, 2)];
        let mut inertia = *inertia;
        inertia[(0, 0)] += gained / 2.0;
        inertia[(1, 1)] += gained / 2.0;
        inertia[(2, 2)] = own_inertia;
        let says = match findings {
            [] => "moved wheels: the yaw inertia stays as it was".to_string(),
            some => some.iter().map(|f| f.says.as_str()).collect::<Vec<_>>().join("; "),
        };
        let to = Weighed { kg: own, at: to.into(), inertia };
        let finding = Finding { truth: Truth::Track(1.0), says };
        self.noted(&finding, |edits| places.mass(chassis, &to, edits))?;
        Ok((kg, centre, yaw))
    }
}

/// Mass with all loads, over that without.
fn loaded<'a>(findings: impl Iterator<Item = &'a Finding>) -> f64 {
    1.0 + findings.map(|f| if let Truth::Load { mass, .. } = f.truth { mass } else { 0.0 }).sum::<f64>()
}

/// Unit vector from the right wheels to the left ones, level.
fn across(model: &Model, wheels: &Wheels) -> Vector3<f64> {
    let mean =
        |side: &[usize]| side.iter().map(|j| model.joints[*j].at.coords).sum::<Vector3<f64>>() / side.len() as f64;
    let way = mean(&wheels.left) - mean(&wheels.right);
    Vector3::new(way.x, way.y, 0.0).try_normalize(0.0).unwrap_or_else(Vector3::y)
}

/// Reads the patched text again: it says what was to be entered.
fn checked(text: &str, file: &str, format: Format, choice: &Choice, wanted: &Option<Sizes>) -> Result<()> {
    let (document, skipped_rows) = opened(text, file)?;
    let all = models(&Xml { file, doc: &document, skipped_rows }, document.root_element(), format)?;
    let (model, wheels) = choose(&all, file, choice)?;
    let (Some(wanted), Some(found)) = (wanted, sizes(model, &wheels)) else { return Ok(()) };
    let off = |found: f64, wanted: f64, scale: f64| (found - wanted).abs() > AGREE * scale;
    let pairs = [
        ("the mass", found.kg, wanted.kg, wanted.kg),
        ("the yaw inertia", found.yaw_inertia, wanted.yaw_inertia, wanted.yaw_inertia),
        ("the centre of mass", found.centre.x, wanted.centre.x, wanted.track_m),
        ("the centre of mass", found.centre.y, wanted.centre.y, wanted.track_m),
        ("the track", found.track_m, wanted.track_m, wanted.track_m),
        ("the left radius", found.radii_m[0], wanted.radii_m[0], wanted.radii_m[0]),
        ("the right radius", found.radii_m[1], wanted.radii_m[1], wanted.radii_m[1]),
    ];
    match pairs.into_iter().find(|(_, found, wanted, scale)| off(*found, *wanted, *scale)) {
        None => Ok(()),
        Some((what, found, wanted, _)) => Err(Error::new(
            ErrorKind::Numeric,
            file,
            format!("{what} is {found} in the patched description, not {wanted}"),
        )
        .hint("the description states it in a way that is not followed here: enter it by hand")),
    }
}
