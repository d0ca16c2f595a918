//! The driving effects that the contract names, each otherwise than its formula: transitions are smooth, speeds lag, forces
//! bend, bursts differ, floors wave.
//!
//! A parameter is the value with which the contract's formula comes nearest: where the form bends, the least squares
//! over the motion of the fit's run.

use super::effect::{Effect, Need, Shows};
use super::grip::Grip;
use super::machine::Machine;
use super::world::{Rolling, World};
use crate::bench::worlds::draw::{between, chance, exponential, index, log_between, sign};
use crate::bench::worlds::noise_level::Loudness;
use crate::config::Steering;
use crate::math::random::Stream;
use std::f64::consts::PI;

/// Σ y x / Σ x².
fn through_origin(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (cross, square) = pairs.fold((0.0, 0.0), |(c, q), (x, y)| (c + x * y, q + x * x));
    if square > 0.0 { cross / square } else { 0.0 }
}

/// Slope of the line through y over x.
fn slope(pairs: &[(f64, f64)]) -> f64 {
    let n = pairs.len().max(1) as f64;
    let (mx, my) = pairs.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    through_origin(pairs.iter().map(|(x, y)| (x - mx, y - my)))
}

/// Left and right of a ratio right/left = 1 + q whose mean is one.
fn apart(q: f64) -> [f64; 2] {
    [2.0 / (2.0 + q), 2.0 * (1.0 + q) / (2.0 + q)]
}

pub(super) fn slip(s: &mut Stream) -> Effect {
    let grip = Grip::draw(s);
    Effect::new("wheel.slip", "wheels", Need::Anything, [0.03, 0.25]).sets(move |a, world, _, _| {
        world.wheels.grip = (a > 0.0).then_some(grip.with(1.0 / a));
    })
}

pub(super) fn radius_mismatch(s: &mut Stream) -> Effect {
    let side = sign(s);
    Effect::new("wheel.radius_mismatch", "wheels", Need::Anything, [0.002, 0.06])
        .sets(move |a, world, _, _| {
            for (radius, factor) in world.wheels.radius_factor.iter_mut().zip(apart(side * a)) {
                *radius *= factor;
            }
        })
        .tells("right_over_left_minus_one", move |a, _| side * a)
}

pub(super) fn radius_scale(s: &mut Stream) -> Effect {
    let side = sign(s);
    Effect::new("wheel.radius_scale", "wheels", Need::Anything, [0.003, 0.08])
        .sets(move |a, world, _, _| world.wheels.radius_factor.iter_mut().for_each(|r| *r *= 1.0 + side * a))
        .tells("relative", move |a, _| side * a)
}

/// One wheel's radius, the other's is nominal.
pub(super) fn one_radius(wheel: usize, s: &mut Stream) -> Effect {
    let side = sign(s);
    let id = ["wheel.radius_left", "wheel.radius_right"][wheel];
    Effect::new(id, "wheels", Need::Anything, [0.003, 0.08])
        .sets(move |a, world, _, _| world.wheels.radius_factor[wheel] *= 1.0 + side * a)
        .tells("relative", move |a, _| side * a)
}

pub(super) fn rolling_resistance(s: &mut Stream) -> Effect {
    let form = Rolling {
        coefficient: 1.0,
        smooth_m_s: log_between(s, 0.005, 0.05),
        stribeck: between(s, -0.1, 0.3),
        stribeck_m_s: between(s, 0.05, 0.2),
        rise_s_m: between(s, 0.0, 0.12),
        at_wheels: chance(s, 0.75),
    };
    Effect::new("wheel.rolling_resistance", "torque", Need::Torque, [0.003, 0.06])
        .sets(move |a, world, _, _| world.body.rolling = Rolling { coefficient: a, ..form })
        .tells("coefficient", move |a, trace| {
            through_origin(trace.v_m_s.iter().filter(|v| v.abs() > 0.05).map(|v| (v.signum(), a * form.share(*v))))
        })
}

pub(super) fn lateral_skid(s: &mut Stream) -> Effect {
    let (side, lag_s, bend) =
        (if chance(s, 0.85) { 1.0 } else { -1.0 }, log_between(s, 0.02, 0.4), between(s, 0.0, 0.2));
    Effect::new("wheel.lateral_skid", "pose", Need::Pose, [0.02, 0.3])
        .timed()
        .sets(move |a, world, _, _| {
            let wheels = &mut world.wheels;
            (wheels.skid_s, wheels.skid_lag_s, wheels.skid_bend_s2_m) = (side * a, lag_s, bend);
        })
        .tells("lateral_slip_s", move |a, trace| {
            let turns = trace.v_m_s.iter().zip(&trace.w_rad_s).map(|(v, w)| v * w);
            through_origin(turns.map(|x| (x, side * a * x * (1.0 + bend * x.abs()))))
        })
}

pub(super) fn track_width(machine: &Machine, s: &mut Stream) -> Effect {
    let side = sign(s);
    if machine.vehicle.steering == Some(Steering::Skid) {
        return skidding_track(s);
    }
    Effect::new("vehicle.track_width", "wheels", Need::Anything, [0.005, 0.15])
        .sets(move |a, world, _, _| world.wheels.track_factor *= 1.0 + side * a)
        .tells("relative", move |a, _| side * a)
}

/// Wheels that skid where the robot turns: the track is effectively wider, and a little different at speed.
fn skidding_track(s: &mut Stream) -> Effect {
    let (large, bend_s_m) = (log_between(s, 0.1, 1.0), between(s, -0.04, 0.04));
    Effect::new("vehicle.track_width", "wheels", Need::Anything, [0.005, 1.0])
        .at_large(large)
        .sets(move |a, world, _, _| {
            world.wheels.track_factor *= 1.0 + a;
            world.wheels.track_bend_s_m = a * bend_s_m;
        })
        .tells("relative", move |a, trace| {
            let rows = trace.v_m_s.iter().zip(&trace.w_rad_s);
            a * through_origin(rows.map(|(v, w)| (*w, w * (1.0 + bend_s_m * (v.abs() - 0.5)))))
        })
}

pub(super) fn payload(s: &mut Stream) -> Effect {
    let turning = between(s, 0.3, 1.6);
    Effect::new("vehicle.payload", "torque", Need::Torque, [0.03, 1.0])
        .sets(move |a, world, _, _| {
            world.body.mass_factor *= 1.0 + a;
            world.body.inertia_factor *= 1.0 + turning * a;
        })
        .tells("mass_relative", |a, _| a)
}

pub(super) fn com_offset(s: &mut Stream) -> Effect {
    let (side, slosh) = (sign(s), between(s, 0.0, 0.08));
    Effect::new("vehicle.com_offset", "torque", Need::Torque, [0.02, 0.15])
        .sets(move |a, world, _, _| {
            world.body.com_offset_m += side * a;
            world.body.slosh_s2_m = slosh;
        })
        .tells("offset_m", move |a, _| side * a)
}

pub(super) fn torque_gain(s: &mut Stream) -> Effect {
    let side = sign(s);
    Effect::new("motor.torque_gain", "torque", Need::Torque, [0.02, 0.4])
        .sets(move |a, world, _, _| {
            for (gain, factor) in world.motors.gain.iter_mut().zip(apart(side * a)) {
                *gain *= factor;
            }
        })
        .tells("right_over_left_minus_one", move |a, _| side * a)
}

pub(super) fn encoder_quantization(s: &mut Stream) -> Effect {
    let offset = [0.0, 0.5, s.uniform()][index(s, 3)];
    Effect::new("encoder.quantization", "wheels", Need::Anything, [0.08, 0.6])
        .shows(Shows::Noise)
        .sets(move |a, world, _, _| (world.encoders.lsb_rad_s, world.encoders.offset) = (a, offset))
        .tells("lsb_rad_s", |a, _| a)
}

pub(super) fn missed_ticks(s: &mut Stream) -> Effect {
    let wheel = index(s, 2);
    let (burst_s, duty, uneven) = (log_between(s, 0.4, 12.0), between(s, 0.08, 0.4), between(s, 0.0, 0.25));
    Effect::new("encoder.missed_ticks", ["wheel_left", "wheel_right"][wheel], Need::Anything, [0.02, 0.5])
        .sets(move |a, world, scene, s| {
            let span_s = scene.run.course.len() as f64 * scene.machine.step_s;
            let mut bursts = Vec::new();
            let mut at_s = burst_s / duty * s.uniform();
            while at_s < span_s {
                let end_s = at_s + burst_s * (0.3 + 0.7 * exponential(s));
                let lost = (a * (1.0 + uneven * (2.0 * s.uniform() - 1.0))).min(0.95);
                bursts.push([at_s, end_s, lost]);
                at_s = end_s + burst_s * (1.0 / duty - 1.0) * (0.2 + 0.8 * exponential(s));
            }
            world.encoders.missed = Some((wheel, bursts));
        })
        .tells("loss_fraction", |a, _| a)
}

pub(super) fn scale_factor(s: &mut Stream) -> Effect {
    let side = sign(s);
    Effect::new("gyro.scale_factor", "gyro", Need::Gyro, [0.002, 0.1])
        .sets(move |a, world, _, _| world.gyro.scale += side * a)
        .tells("relative", move |a, _| side * a)
}

pub(super) fn scale_asymmetry(s: &mut Stream) -> Effect {
    let (side, width) = (sign(s), log_between(s, 0.005, 0.12));
    Effect::new("gyro.scale_asymmetry", "gyro", Need::Gyro, [0.004, 0.15])
        .sets(move |a, world, _, _| {
            world.gyro.asymmetry += side * a;
            world.gyro.asymmetry_width_rad_s = width;
        })
        .tells("relative", move |a, _| side * a)
}

pub(super) fn vibration_rectification(s: &mut Stream) -> Effect {
    let (side, bend, lag_s) = (sign(s), between(s, -0.15, 0.15), between(s, 0.0, 0.5));
    Effect::new("gyro.vibration_rectification", "gyro", Need::Gyro, [0.001, 0.05])
        .sets(move |a, world, _, _| {
            let gyro = &mut world.gyro;
            gyro.rectification_rad_s_per_m2_s2 = side * a;
            (gyro.rectification_bend, gyro.rectification_lag_s) = (bend, lag_s);
        })
        .tells("coefficient_rad_s_per_m2_s2", move |a, trace| {
            let one = |v: &f64| (v * v, side * a * v * v * (1.0 + bend * (v.abs() - 0.5)));
            slope(&trace.v_m_s.iter().map(one).collect::<Vec<_>>())
        })
}

pub(super) fn gyro_delay(s: &mut Stream) -> Effect {
    let jitter = between(s, 0.0, 0.15);
    Effect::new("sensor.gyro_delay", "gyro", Need::Gyro, [0.01, 0.15])
        .timed()
        .sets(move |a, world, _, _| (world.gyro.delay_s, world.gyro.delay_jitter) = (a, jitter))
        .tells("delay_s", |a, _| a)
}

pub(super) fn wheel_delay(s: &mut Stream) -> Effect {
    let jitter = between(s, 0.0, 0.15);
    Effect::new("sensor.wheel_delay", "wheels", Need::Anything, [0.01, 0.12])
        .timed()
        .sets(move |a, world, _, _| (world.encoders.delay_s, world.encoders.delay_jitter) = (a, jitter))
        .tells("delay_s", |a, _| a)
}

pub(super) fn pose_delay(s: &mut Stream) -> Effect {
    let jitter = between(s, 0.0, 0.15);
    // longer ones are a clock's affair
    Effect::new("sensor.pose_delay", "pose", Need::Pose, [0.02, 0.19])
        .timed()
        .sets(move |a, world, _, _| (world.pose.delay_s, world.pose.delay_jitter) = (a, jitter))
        .tells("delay_s", |a, _| a)
}

/// A sensor whose white noise is another than stated; `of` is its loudness. Strength is the mean of |ln σ'/σ|.
fn noise_level(
    [id, channel]: [&'static str; 2],
    need: Need,
    of: fn(&mut World) -> &mut Loudness,
    machine: &Machine,
    s: &mut Stream,
) -> Effect {
    let (form, step_s) = (Loudness::draw([60.0, 600.0], s), machine.step_s);
    Effect::new(id, channel, need, [0.05, 1.4])
        .shows(Shows::Level)
        .sets(move |a, world, _, _| *of(world) = form.times(a))
        .tells("noise_over_nominal", move |a, trace| {
            form.times(a).rms((0..trace.v_m_s.len()).map(|k| k as f64 * step_s))
        })
}

pub(super) fn gyro_noise(machine: &Machine, s: &mut Stream) -> Effect {
    noise_level(["gyro.noise_level", "gyro"], Need::GyroAndTorque, |world| &mut world.gyro.loud, machine, s)
}

pub(super) fn encoder_noise(machine: &Machine, s: &mut Stream) -> Effect {
    noise_level(["encoder.noise_level", "wheels"], Need::Torque, |world| &mut world.encoders.loud, machine, s)
}

pub(super) fn pose_noise(machine: &Machine, s: &mut Stream) -> Effect {
    noise_level(["pose.noise_level", "pose"], Need::Pose, |world| &mut world.pose.loud, machine, s)
}

pub(super) fn ground_slope(s: &mut Stream) -> Effect {
    let uphill = between(s, -PI, PI);
    let waves = [between(s, 0.0, 0.12), between(s, 1.0, 6.0), between(s, 0.0, 2.0 * PI)];
    Effect::new("ground.slope", "torque", Need::Torque, [0.003, 0.08])
        .sets(move |a, world, _, _| {
            let body = &mut world.body;
            (body.slope_rad, body.uphill_heading_rad, body.undulation) = (a, uphill, waves);
        })
        .tells("slope_rad", |a, _| a)
        .tells("uphill_heading_rad", move |_, _| uphill)
}
