//! gyro = ± k (wheel_right ∓ wheel_left) + c: whether wheels, gyro and pose agree on what is forwards and what is left
//!
//! Means over a second are compared, in which neither a delay nor the noise counts. Of the four ways to take the signs of two
//! wheels, the one that is logged has to explain the gyro at least better than a constant does; where it does not, and another
//! way leaves a quarter of its squares or less, a sign is wrong. The gain k may lie between a third and one and a half of
//! r/2b: wheels slip, and a robot that skids turns as if its track were wider.

use super::{Odometry, Rolling};
use crate::config::Vehicle;
use crate::signal::{Log, names};

/// Length of the means, s.
const MEAN_S: f64 = 1.0;
/// Gains of a yaw rate by the wheels over the nominal one.
pub(crate) const GAIN: [f64; 2] = [1.0 / 3.0, 1.5];
/// Smallest ratio of the squares under a wrong sign to those under the right one.
const WORSE: f64 = 4.0;
/// Share of the torques' power of one sign, less that of the other, from which they tell.
const CLEAR: f64 = 0.3;
/// Fewest means that are compared.
const FEWEST: usize = 8;

/// Evidence against the signs of wheels, gyro and pose, in sentences with the remedy.
#[must_use]
pub fn wrong_signs(vehicle: &Vehicle, log: &Log) -> Vec<String> {
    let robot = Rolling::new(vehicle);
    let odometry = Odometry::of(log, &robot, None);
    let Some([left, right]) = odometry.as_ref().and_then(Odometry::wheels) else { return Vec::new() };
    let against = log.get(names::GYRO_Z).and_then(|gyro| {
        let means = means(&log.time.to_vec(), [gyro, left, right]);
        against_gyro(&means, vehicle.wheel_radius_m / (2.0 * vehicle.half_track_m))
    });
    match against {
        Some([l, r]) if l == r => {
            let [found, remedy] = opposite(vehicle, log);
            vec![format!("{}; {remedy}.", capital(&found))]
        }
        one_side => {
            let side = one_side.map(|[left, _]| if left < 0.0 { "left" } else { "right" });
            let wheel = side.map(|side| {
                format!(
                    "The {side} wheel seems to count backwards: the gyro turns as the wheels' sum does, not as their \
                     difference; turn its sign: --map wheel_{side}_rad_s=-COLUMN."
                )
            });
            let pose = (by_pose(&robot, log, [left, right]) == Some(true)).then(|| {
                format!(
                    "The pose moves backwards where the wheels roll forwards: turn the signs of both wheels ({TURN_BOTH}), or \
                     the reference's heading by 180°."
                )
            });
            wheel.into_iter().chain(pose).collect()
        }
    }
}

const TURN_BOTH: &str = "--map wheel_left_rad_s=-COLUMN --map wheel_right_rad_s=-COLUMN";

/// Finding and remedy where wheels and gyro turn opposite ways: a pose, or torques, tell whether both wheels count
/// backwards.
pub(crate) fn opposite(vehicle: &Vehicle, log: &Log) -> [String; 2] {
    let robot = Rolling::new(vehicle);
    let odometry = Odometry::of(log, &robot, None);
    let wheels = odometry.as_ref().and_then(Odometry::wheels);
    let told = wheels.and_then(|wheels| {
        let pose = by_pose(&robot, log, wheels).map(|backwards| ("the pose moves", backwards));
        pose.or_else(|| by_torques(log, wheels).map(|backwards| ("the torques drive", backwards)))
    });
    let [found, remedy] = match told {
        Some((moves, true)) => [
            format!(
                "wheels and gyro turn opposite ways, and {moves} backwards where the wheels roll forwards: both wheels count \
                 backwards"
            ),
            format!("turn the signs of both: {TURN_BOTH}"),
        ],
        Some((moves, false)) => [
            format!(
                "wheels and gyro turn opposite ways, and {moves} forwards as the wheels roll: the gyro's axis points down, or left \
                 and right are exchanged"
            ),
            "turn the gyro round, --map gyro_z_rad_s=-COLUMN, or name the wheels' columns the other way round".into(),
        ],
        None => [
            "wheels and gyro turn opposite ways: the gyro reads backwards, both wheels do, or left and right are exchanged".into(),
            format!(
                "turn the gyro round, --map gyro_z_rad_s=-COLUMN, or both wheels, {TURN_BOTH}, or name the wheels' columns the \
                 other way round; a pose or torques in the log would tell which"
            ),
        ],
    };
    [found, remedy]
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Whether a pose moves backwards where the wheels roll forwards; none where it does not tell.
fn by_pose(robot: &Rolling, log: &Log, [left, right]: [&[f64]; 2]) -> Option<bool> {
    let (x, y, heading) = (log.get(names::X)?, log.get(names::Y)?, log.get(names::HEADING)?);
    let times = log.time.to_vec();
    let speed: Vec<f64> = left.iter().zip(right).map(|(l, r)| robot.speed_and_yaw_rate([*l, *r])[0]).collect();
    let means = means(&times, [&speed, &ahead(&times, x, y, heading)]);
    if means.len() < FEWEST {
        return None;
    }
    let [forwards, backwards] = [1.0, -1.0].map(|sign| means.iter().map(|[v, p]| (p - sign * v).powi(2)).sum::<f64>());
    let nothing = means.iter().map(|m| m[1] * m[1]).sum::<f64>();
    let refuted = |this: f64, other: f64| this > nothing && this >= WORSE * other;
    refuted(forwards, backwards).then_some(true).or(refuted(backwards, forwards).then_some(false))
}

/// Whether the torques take power out of the wheels all in all, which friction does not let them: they or the wheels have the
/// wrong signs. None where they do not tell.
fn by_torques(log: &Log, wheels: [&[f64]; 2]) -> Option<bool> {
    let torques = [log.get(names::TORQUE_LEFT)?, log.get(names::TORQUE_RIGHT)?];
    let powers =
        torques.into_iter().zip(wheels).flat_map(|(torque, wheel)| torque.iter().zip(wheel).map(|(t, w)| t * w));
    let (sum, size) =
        powers.filter(|p| p.is_finite()).fold((0.0, 0.0), |(sum, size), p: f64| (sum + p, size + p.abs()));
    (sum.abs() > CLEAR * size).then_some(sum < 0.0)
}

/// Speed ahead at the samples of a pose, m/s, by its positions; NaN elsewhere.
fn ahead(times: &[f64], x: &[f64], y: &[f64], heading: &[f64]) -> Vec<f64> {
    let mut out = vec![f64::NAN; times.len()];
    let mut last: Option<usize> = None;
    for k in (0..times.len()).filter(|&k| x[k].is_finite() && y[k].is_finite() && heading[k].is_finite()) {
        if let Some(j) = last {
            let (dx, dy) = (x[k] - x[j], y[k] - y[j]);
            out[k] = (dx * heading[j].cos() + dy * heading[j].sin()) / (times[k] - times[j]);
        }
        last = Some(k);
    }
    out
}

/// Means of channels over [`MEAN_S`], where each has a value.
fn means<const N: usize>(times: &[f64], channels: [&[f64]; N]) -> Vec<[f64; N]> {
    let mut out = Vec::new();
    let (mut sums, mut counts, mut end) = ([0.0; N], [0_usize; N], f64::NEG_INFINITY);
    let mut close = |sums: &mut [f64; N], counts: &mut [usize; N]| {
        if counts.iter().all(|c| *c > 0) {
            out.push(std::array::from_fn(|i| sums[i] / counts[i] as f64));
        }
        (*sums, *counts) = ([0.0; N], [0; N]);
    };
    for (k, t) in times.iter().enumerate() {
        if *t >= end {
            close(&mut sums, &mut counts);
            end = t + MEAN_S;
        }
        for (i, channel) in channels.iter().enumerate().filter(|(_, c)| c[k].is_finite()) {
            sums[i] += channel[k];
            counts[i] += 1;
        }
    }
    close(&mut sums, &mut counts);
    out
}

/// Residual sum of squares of `y = k x + c`, with k within bounds.
fn left_over(pairs: &[[f64; 2]], bounds: [f64; 2]) -> f64 {
    let n = pairs.len() as f64;
    let [mx, my] = [0, 1].map(|i| pairs.iter().map(|p| p[i]).sum::<f64>() / n);
    let moment = |f: &dyn Fn(f64, f64) -> f64| pairs.iter().map(|p| f(p[0] - mx, p[1] - my)).sum::<f64>();
    let (xx, xy, yy) = (moment(&|x, _| x * x), moment(&|x, y| x * y), moment(&|_, y| y * y));
    let gain = if xx > 0.0 { (xy / xx).clamp(bounds[0], bounds[1]) } else { bounds[0] };
    yy - 2.0 * gain * xy + gain * gain * xx
}

/// Signs of left and right wheel that the gyro asks for; none where it agrees with them as they are.
fn against_gyro(means: &[[f64; 3]], nominal: f64) -> Option<[f64; 2]> {
    if means.len() < FEWEST {
        return None;
    }
    let bounds = GAIN.map(|g| g * nominal);
    let squares = |left: f64, right: f64| {
        let pairs: Vec<[f64; 2]> = means.iter().map(|[g, l, r]| [right * r - left * l, *g]).collect();
        left_over(&pairs, bounds)
    };
    let constant = left_over(&means.iter().map(|m| [0.0, m[0]]).collect::<Vec<_>>(), bounds);
    let told = squares(1.0, 1.0);
    let [left, right, both] = [(-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)].map(|(l, r)| squares(l, r));
    let best = left.min(right).min(both);
    if told <= constant || told < WORSE * best {
        return None;
    }
    Some(match () {
        () if best == both => [-1.0, -1.0],
        () if best == left => [-1.0, 1.0],
        () => [1.0, -1.0],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::TimeAxis;

    fn vehicle() -> Vehicle {
        Vehicle {
            mass_kg: 10.0,
            yaw_inertia_kg_m2: 0.3,
            half_track_m: 0.2,
            steering: None,
            wheel_radius_m: 0.1,
            wheel_inertia_kg_m2: 0.0,
            viscous_friction_n_m_s: 0.0,
            torque_noise_n_m_sqrt_s: 0.0,
            torque_constant_n_m_a: None,
            load_kg: 0.0,
        }
    }

    /// A drive of 60 s that bends by `bend`, with the signs of left wheel, right wheel, gyro and heading.
    fn drive(bend: f64, [left, right, gyro]: [f64; 3], turned_rad: f64) -> Log {
        let robot = Rolling::new(&vehicle());
        let (mut x, mut y, mut heading) = (0.0, 0.0, 0.0);
        let mut columns: [Vec<f64>; 6] = Default::default();
        let times: Vec<f64> = (0..3000).map(|k| 0.02 * f64::from(k)).collect();
        for t in &times {
            let (v, w) = (0.5 + 0.2 * (0.3 * t).sin(), bend * (0.7 * t).cos());
            let wheel = robot.wheel_by_motion().map(|[by_speed, by_yaw]| by_speed * v + by_yaw * w);
            // slip, and a step of the encoder
            let values = [left * 1.05 * wheel[0], right * wheel[1], gyro * w + 0.003, x, y, heading + turned_rad];
            columns.iter_mut().zip(values).for_each(|(c, v)| c.push(v));
            (x, y, heading) = (x + 0.02 * v * heading.cos(), y + 0.02 * v * heading.sin(), heading + 0.02 * w);
        }
        let mut log = Log::new("test", TimeAxis::Explicit(times));
        let channels = [names::WHEEL_LEFT, names::WHEEL_RIGHT, names::GYRO_Z, names::X, names::Y, names::HEADING];
        channels.into_iter().zip(columns).for_each(|(name, values)| log.push(name, values).unwrap());
        log
    }

    #[test]
    fn a_wrong_sign_is_told_with_its_side() {
        for (signs, turned_rad, said) in [
            ([1.0, 1.0, 1.0], 0.0, &[][..]),
            ([-1.0, 1.0, 1.0], 0.0, &["wheel_left_rad_s=-COLUMN"]),
            ([1.0, -1.0, 1.0], 0.0, &["wheel_right_rad_s=-COLUMN"]),
            ([1.0, 1.0, -1.0], 0.0, &["gyro_z_rad_s=-COLUMN"]),
            ([1.0, 1.0, 1.0], std::f64::consts::PI, &["heading by 180°"]),
        ] {
            let found = wrong_signs(&vehicle(), &drive(0.4, signs, turned_rad));
            let gyro: Vec<_> = found.iter().filter(|f| said.iter().any(|s| f.contains(s))).collect();
            assert_eq!((gyro.len(), found.is_empty()), (said.len(), said.is_empty()), "{signs:?} {found:?}");
        }
    }

    #[test]
    fn both_wheels_backwards_are_told_from_a_gyro_that_is_by_pose_and_by_torques() {
        let both = "both wheels count backwards; turn the signs of both: --map wheel_left_rad_s=-COLUMN --map";
        for (sign, gyro, said) in [(-1.0, 1.0, both), (1.0, -1.0, "axis points down")] {
            let mut log = drive(0.4, [sign, sign, gyro], 0.0);
            let told = wrong_signs(&vehicle(), &log);
            assert!(told.len() == 1 && told[0].contains(said) && told[0].contains("pose moves"), "{told:?}");
            log.channels.retain(|c| ![names::X, names::Y, names::HEADING].contains(&c.name.as_str()));
            let told = wrong_signs(&vehicle(), &log);
            assert!(told.len() == 1 && told[0].contains("would tell which"), "{told:?}");
            // friction: a torque as the speed
            for (torque, wheel) in [(names::TORQUE_LEFT, names::WHEEL_LEFT), (names::TORQUE_RIGHT, names::WHEEL_RIGHT)]
            {
                let values = log.get(wheel).unwrap().iter().map(|w| 0.01 * sign * w).collect();
                log.push(torque, values).unwrap();
            }
            let told = wrong_signs(&vehicle(), &log);
            assert!(told.len() == 1 && told[0].contains(said) && told[0].contains("torques drive"), "{told:?}");
        }
    }

    #[test]
    fn wheels_against_each_other_on_a_straight_line_are_told_and_a_straight_line_is_not() {
        let found = wrong_signs(&vehicle(), &drive(1e-4, [-1.0, 1.0, 1.0], 0.0));
        assert!(found.iter().any(|f| f.contains("count backwards")), "{found:?}");
        for bend in [0.0, 1e-4] {
            assert_eq!(wrong_signs(&vehicle(), &drive(bend, [1.0; 3], 0.0)), [""; 0]);
        }
    }
}
