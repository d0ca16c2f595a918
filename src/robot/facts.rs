//! Quantities of a robot that a configuration needs, each with its place in the description.

use super::model::{Mass, Model, shifted, sum};
use super::types::{Fact, Format, Robot};
use super::wheels::{Wheels, radius};
use crate::config::Steering;

/// Plugin and geometry agree within this share.
const AGREE: f64 = 0.01;
/// A robot's frame of this name lies on the ground (REP 120).
const GROUND: &str = "footprint";

/// The robot on those wheels.
pub(super) fn robot(model: &Model, wheels: &Wheels, file: &str, format: Format) -> Robot {
    let mut notes = model.notes.clone();
    let names = |side: &[usize]| side.iter().map(|j| model.joints[*j].name.clone()).collect::<Vec<_>>();
    let (left, right) = (names(&wheels.left), names(&wheels.right));
    let plugin = wheels.plugin.map(|p| &model.drives[p]);
    let differ = |what: &str, geometry: f64, stated: Option<f64>, notes: &mut Vec<String>| {
        if let (Some(stated), Some(plugin)) = (stated, plugin)
            && (stated / geometry - 1.0).abs() > AGREE
        {
            notes.push(format!(
                "{what} is {geometry:.4} m by the links, and {stated:.4} m for the plugin {}",
                plugin.name
            ));
        }
    };
    let steering = if left.len() == 1 && right.len() == 1 { Steering::Differential } else { Steering::Skid };

    differ("the track", wheels.track_m, plugin.and_then(|p| p.separation_m), &mut notes);
    let between = format!("half the distance between {} and {}", left.join(", "), right.join(", "));
    let half_track = Fact::told(wheels.track_m / 2.0, between);

    let stated = plugin.and_then(|p| Some((p.radius_m?, format!("plugin {}", p.name))));
    let own = wheels.all().find_map(|j| radius(model, j));
    if let Some((radius, _)) = &own {
        differ("the wheel's radius", *radius, plugin.and_then(|p| p.radius_m), &mut notes);
    }
    let wheel_radius = match own.or(stated).or_else(|| above_ground(model, wheels)) {
        Some((metres, source)) => Fact::told(metres, source),
        None => Fact::not_told("the wheels are meshes: measure the way of one turn, and divide it by 2 pi"),
    };

    let (mass, yaw_inertia) = masses(model, format, &mut notes);
    let wheel_inertia = inertia_of_side(model, wheels);
    let damping: f64 = wheels.left.iter().filter_map(|j| model.joints[*j].damping).sum();
    let damped = wheels.left.iter().any(|j| model.joints[*j].damping.is_some());
    let viscous_friction = match damped {
        true => {
            Fact::told(damping, "damping of the wheels' joints, a side; simulators often add some for stability".into())
        }
        false => Fact::not_told("the description has no damping of the wheels' joints"),
    };
    Robot {
        file: file.into(),
        format,
        name: model.name.clone(),
        left,
        right,
        steering,
        mass_kg: mass,
        yaw_inertia_kg_m2: yaw_inertia,
        half_track_m: half_track,
        wheel_radius_m: wheel_radius,
        wheel_inertia_kg_m2: wheel_inertia,
        viscous_friction_n_m_s: viscous_friction,
        gyro_rate_hz: model
            .imu
            .as_ref()
            .and_then(|i| Some(Fact::told(i.rate_hz?, format!("rate of the sensor {}", i.name)))),
        gyro_noise_std_rad_s: model
            .imu
            .as_ref()
            .and_then(|i| Some(Fact::told(i.noise_std_rad_s?, format!("noise of the sensor {}", i.name)))),
        notes,
    }
}

/// The height of the wheels over the frame on the ground, which is their radius.
fn above_ground(model: &Model, wheels: &Wheels) -> Option<(f64, String)> {
    let ground = model.links.iter().find(|l| l.name.to_lowercase().contains(GROUND))?;
    let height = |j: usize| (ground.pose.inverse() * model.joints[j].at).z;
    let heights: Vec<f64> = wheels.all().map(height).collect();
    let mean = heights.iter().sum::<f64>() / heights.len() as f64;
    (mean > 1e-3).then(|| (mean, format!("height of the axle over {}; the wheels are meshes", ground.name)))
}

/// Mass and yaw inertia of the whole robot.
fn masses(model: &Model, format: Format, notes: &mut Vec<String>) -> (Fact, Fact) {
    let all = model.links.iter();
    let untold = all.clone().find_map(|l| match &l.mass {
        Mass::NotTold(why) => Some(format!("the mass of {} is not told: {why}", l.name)),
        _ => None,
    });
    if let Some(why) = untold {
        return (
            Fact::not_told(&format!("{why}; weigh the robot")),
            Fact::not_told("of a plate of length a and width b: mass (a^2 + b^2) / 12"),
        );
    }
    let weighed: Vec<_> = all.filter(|l| matches!(&l.mass, Mass::Known { .. })).collect();
    let Some((kg, _, inertia)) = sum(weighed.iter().map(|l| &l.mass)) else {
        return (
            Fact::not_told("the description has no masses; weigh the robot"),
            Fact::not_told("of a plate of length a and width b: mass (a^2 + b^2) / 12"),
        );
    };
    let light = model.links.len() - weighed.len();
    if light > 0 {
        let gazebo = if format == Format::Sdf { " (Gazebo gives such a link 1 kg)" } else { "" };
        notes.push(format!("links without a mass, taken for weightless: {light} of {}{gazebo}", model.links.len()));
    }
    let mass = Fact::told(kg, format!("sum over {} links", weighed.len()));
    let yaw = match inertia[(2, 2)] > 0.0 {
        true => {
            Fact::told(inertia[(2, 2)], "the same links about the vertical axis through their centre of mass".into())
        }
        false => Fact::not_told("of a plate of length a and width b: mass (a^2 + b^2) / 12"),
    };
    (mass, yaw)
}

/// Inertia about the axle of the wheels of one side, with what turns along.
pub(super) fn inertia_of_side(model: &Model, wheels: &Wheels) -> Fact {
    let mut total = 0.0;
    let mut motors = false;
    for j in &wheels.left {
        let joint = &model.joints[*j];
        let turning = model.rigid(joint.child);
        let Some((kg, at, inertia)) = sum(turning.iter().map(|l| &model.links[*l].mass)) else {
            return Fact::not_told("the wheels have no mass; of a disc: mass radius^2 / 2, and that of motor and gear");
        };
        let about = shifted(&inertia, kg, &(at - joint.at));
        total += joint.axis.dot(&(about * joint.axis)) + joint.armature.unwrap_or(0.0);
        motors |= joint.armature.is_some();
    }
    let wheels = match wheels.left.len() {
        1 => "one wheel about its axle".to_string(),
        n => format!("{n} wheels of a side about their axles"),
    };
    match (total > 0.0, motors) {
        (false, _) => {
            Fact::not_told("the wheels have no inertia; of a disc: mass radius^2 / 2, and that of motor and gear")
        }
        (true, true) => Fact::told(total, format!("{wheels}, with the armature of the joint")),
        (true, false) => {
            Fact::told(total, format!("{wheels}; add that of motor and gear, which the description lacks"))
        }
    }
}
