//! Which joints turn driven wheels, and on which side of the robot they are.

use super::model::{Form, Joint, Model, Motion, Shape};
use super::types::Choice;
use crate::error::{Error, ErrorKind, Result, one_of};
use nalgebra::Vector3;
use std::collections::HashMap;

/// The axle of a wheel lies level, and across the robot, up to this sine of the angle.
const LEVEL: f64 = 0.2;
/// Wheels of one robot are as large as each other within this share.
const ALIKE: f64 = 0.02;
/// Names of wheels that nothing drives.
const PASSIVE: [&str; 5] = ["caster", "castor", "idler", "roller", "passive"];
/// Names of wheels.
const WHEEL: [&str; 4] = ["wheel", "tire", "tyre", "sprocket"];
/// Names of wheels that also roll sideways.
const OMNI: [&str; 3] = ["mecanum", "omni", "swerve"];

/// Driven wheels by side, as indices of joints.
#[derive(Debug, Clone)]
pub(super) struct Wheels {
    pub left: Vec<usize>,
    pub right: Vec<usize>,
    /// The way from the right wheels to the left ones, m, and the plugin that named them.
    pub track_m: f64,
    pub plugin: Option<usize>,
}

impl Wheels {
    pub(super) fn all(&self) -> impl Iterator<Item = usize> + '_ {
        self.left.iter().chain(&self.right).copied()
    }
}

/// The driven wheels of a model: those that are chosen, those that a plugin names, or those that look like it.
///
/// # Errors
/// [`ErrorKind::Value`] where there are none, or where several readings are possible.
pub(super) fn find(model: &Model, file: &str, choice: &Choice) -> Result<Wheels> {
    let error = |found: String| Error::new(ErrorKind::Value, file, found).at(format!("robot {}", model.name));
    if !choice.left.is_empty() || !choice.right.is_empty() {
        let named = |option: &str, names: &[String]| -> Result<Vec<usize>> {
            if names.is_empty() {
                return Err(error(format!("{option} names no wheel")).hint("name the joints of both sides"));
            }
            names.iter().map(|name| joint(model, file, name)).collect()
        };
        return sides(model, file, named("--left-wheel", &choice.left)?, named("--right-wheel", &choice.right)?, None);
    }
    let exists = |name: &String| model.joints.iter().any(|j| j.name == *name);
    let stated = model.drives.iter().position(|d| d.left.iter().chain(&d.right).all(exists));
    if let Some(plugin) = stated {
        let drive = &model.drives[plugin];
        let all = |names: &[String]| names.iter().map(|name| joint(model, file, name)).collect::<Result<Vec<_>>>();
        return sides(model, file, all(&drive.left)?, all(&drive.right)?, Some(plugin));
    }
    if let Some(other) = &model.other_drive {
        return Err(error(format!("is moved by {other}, not by a left and a right side of wheels"))
            .hint("gyroid knows robots with two driven wheels, and those that skid (four wheels, or tracks)"));
    }
    let candidates = candidates(model, file)?;
    let across = model.joints[candidates[0]].axis;
    let across = if across.y < -LEVEL || (across.y.abs() <= LEVEL && across.x > 0.0) { -across } else { across };
    let list = || listed(model, &candidates);
    let choose = "name the driven ones: --left-wheel JOINT --right-wheel JOINT (each may be given more than once)";
    if candidates.iter().any(|j| model.joints[*j].axis.cross(&across).norm() > LEVEL) {
        return Err(error(format!("wheels whose axles are not parallel: {}", list())).hint(choose));
    }
    let at = |j: &usize| model.joints[*j].at.coords.dot(&across);
    let (low, high) = candidates.iter().map(at).fold((f64::MAX, f64::MIN), |(l, h), s| (l.min(s), h.max(s)));
    let (middle, apart) = ((low + high) / 2.0, LEVEL * (high - low));
    let (between, beside): (Vec<usize>, Vec<usize>) = candidates.iter().partition(|j| (at(j) - middle).abs() <= apart);
    let (left, right): (Vec<usize>, Vec<usize>) = beside.iter().partition(|j| at(j) > middle);
    if left.len() != right.len() || !between.is_empty() {
        let [left, right, between] = [&left, &right, &between].map(Vec::len);
        let found = format!("{left} wheels lie left, {right} right and {between} between them: {}", list());
        return Err(error(found).hint(choose));
    }
    let radii: Vec<f64> = candidates.iter().filter_map(|j| radius(model, *j)).map(|(r, _)| r).collect();
    let (small, large) = radii.iter().fold((f64::MAX, 0.0f64), |(s, l), r| (s.min(*r), l.max(*r)));
    if large > small * (1.0 + ALIKE) {
        let found = format!("wheels of different sizes, radii {small} to {large} m: {}", list());
        return Err(error(found).hint(choose));
    }
    sides(model, file, left, right, None)
}

/// Checks that two sides of wheels are apart.
fn sides(model: &Model, file: &str, left: Vec<usize>, right: Vec<usize>, plugin: Option<usize>) -> Result<Wheels> {
    let mean = |joints: &[usize]| {
        joints.iter().map(|j| model.joints[*j].at.coords).sum::<Vector3<f64>>() / joints.len() as f64
    };
    let across = model.joints[left[0]].axis;
    let track_m = (mean(&left) - mean(&right)).dot(&across).abs();
    if track_m < 1e-3 {
        let found = format!(
            "the wheels of both sides lie in one place: {}",
            listed(model, &left.iter().chain(&right).copied().collect::<Vec<_>>())
        );
        return Err(Error::new(ErrorKind::Value, file, found)
            .at(format!("robot {}", model.name))
            .hint("name a joint of each side: --left-wheel JOINT --right-wheel JOINT"));
    }
    Ok(Wheels { left, right, track_m, plugin })
}

/// Index of a joint by its name, or by that of the wheel on it.
fn joint(model: &Model, file: &str, name: &str) -> Result<usize> {
    let of_link = |j: &Joint| model.links[j.child].name == name;
    let found = model.joints.iter().position(|j| j.name == name).or_else(|| model.joints.iter().position(of_link));
    found.ok_or_else(|| {
        let moving = model.joints.iter().filter(|j| j.motion != Motion::Fixed);
        let known: Vec<&str> = moving.map(|j| j.name.as_str()).collect();
        Error::new(ErrorKind::Value, file, format!("robot {} has no joint {name}", model.name))
            .hint(one_of(name, &known))
    })
}

/// Joints that may turn driven wheels; at least one.
fn candidates(model: &Model, file: &str) -> Result<Vec<usize>> {
    let error = |found: &str| Error::new(ErrorKind::Value, file, found).at(format!("robot {}", model.name));
    let spinning = (0..model.joints.len()).filter(|i| {
        let j = &model.joints[*i];
        j.motion == Motion::Spinning && j.axis.z.abs() < LEVEL && !called(model, *i, &PASSIVE)
    });
    let all: Vec<usize> = spinning.filter(|i| called(model, *i, &WHEEL) || radius(model, *i).is_some()).collect();
    let named: Vec<usize> = all.iter().copied().filter(|i| called(model, *i, &WHEEL)).collect();
    let wheels = if named.is_empty() { all } else { named };
    if let Some(omni) = wheels.iter().find(|i| called(model, **i, &OMNI)) {
        return Err(error(&format!("{} is a wheel that also rolls sideways", model.joints[*omni].name))
            .hint("gyroid knows robots with two driven wheels, and those that skid (four wheels, or tracks)"));
    }
    // what carries all of them is the robot's own motion, not a fork
    let above: HashMap<usize, Vec<usize>> = wheels.iter().map(|w| (*w, model.ancestors(*w))).collect();
    let mut carries = vec![0; model.joints.len()];
    above.values().flatten().for_each(|up| carries[*up] += 1);
    let steers = |wheel: usize| {
        above[&wheel].iter().copied().find(|up| {
            let j = &model.joints[*up];
            matches!(j.motion, Motion::Spinning | Motion::Turning)
                && j.axis.z.abs() > 1.0 - LEVEL
                && carries[*up] < wheels.len()
        })
    };
    if let Some((wheel, fork)) = wheels.iter().find_map(|w| {
        // a fork that swings freely is a castor's, one with limits or a motor steers
        let fork = steers(*w)?;
        (model.joints[fork].motion == Motion::Turning || model.joints[fork].driven || called(model, fork, &["steer"]))
            .then_some((*w, fork))
    }) {
        let (wheel, fork) = (&model.joints[wheel].name, &model.joints[fork].name);
        return Err(error(&format!("{fork} steers the wheel of {wheel}: a robot like a car")).hint(
            "gyroid knows robots with two driven wheels, and those that skid (four wheels, or tracks); \
             --left-wheel and --right-wheel name two wheels of an axle all the same",
        ));
    }
    let carried: Vec<usize> = wheels.iter().copied().filter(|w| steers(*w).is_none()).collect();
    let driven: Vec<usize> = carried.iter().copied().filter(|w| model.joints[*w].driven).collect();
    let found = if driven.is_empty() { carried } else { driven };
    if found.is_empty() {
        let others: Vec<&str> =
            model.joints.iter().filter(|j| j.motion != Motion::Fixed).map(|j| j.name.as_str()).take(8).collect();
        let hint = match (&model.notes[..], &others[..]) {
            ([note, ..], _) => format!("{note}; give the file that holds the wheels"),
            (_, []) => "it has no joints that move: give the description of a robot on wheels".into(),
            (_, some) => format!(
                "a wheel is a joint that turns without end (URDF: continuous) about a level axle; name two if these are wheels \
                 all the same: --left-wheel JOINT --right-wheel JOINT; there are {}",
                some.join(", ")
            ),
        };
        return Err(error("no driven wheels are found").hint(hint));
    }
    Ok(found)
}

/// Whether the joint, or the link on it, is called by one of the words.
fn called(model: &Model, joint: usize, words: &[&str]) -> bool {
    let j = &model.joints[joint];
    let names = [j.name.to_lowercase(), model.links[j.child].name.to_lowercase()];
    words.iter().any(|word| names.iter().any(|name| name.contains(word)))
}

/// Joints with the places of their wheels, for a message.
fn listed(model: &Model, joints: &[usize]) -> String {
    let at = |j: &usize| {
        let j = &model.joints[*j];
        format!("{} at x {:.3}, y {:.3} m", j.name, j.at.x, j.at.y)
    };
    joints.iter().map(at).collect::<Vec<_>>().join("; ")
}

/// The radius of the wheel on a joint, m, and where it is found.
pub(super) fn radius(model: &Model, joint: usize) -> Option<(f64, String)> {
    let j = &model.joints[joint];
    let round = |shape: &Shape, link: &str| {
        let along = shape.pose * Vector3::z();
        let coaxial = along.cross(&j.axis).norm() < LEVEL;
        let (radius, form) = match shape.form {
            Form::Cylinder { radius, .. } if coaxial => (radius, "cylinder"),
            Form::Capsule { radius, .. } if coaxial => (radius, "capsule"),
            Form::Sphere { radius } => (radius, "sphere"),
            Form::Ellipsoid(radii) => (radii.iter().copied().fold(0.0, f64::max), "ellipsoid"),
            _ => return None,
        };
        // the axle goes through its middle
        let off = (shape.pose.translation.vector - j.at.coords).cross(&j.axis).norm();
        (radius > 0.0 && off < radius / 4.0).then(|| (radius, format!("radius of the {form} of {link}")))
    };
    let links = model.rigid(j.child);
    let of = |collides: bool| {
        let shapes = links.iter().flat_map(|l| model.links[*l].shapes.iter().map(move |s| (s, &model.links[*l].name)));
        let found = shapes.filter(|(s, _)| s.collides == collides).filter_map(|(s, link)| round(s, link));
        found.max_by(|a, b| a.0.total_cmp(&b.0))
    };
    of(true).or_else(|| of(false))
}
