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
const GAIN: [f64; 2] = [1.0 / 3.0, 1.5];
/// Smallest ratio of the squares under a wrong sign to those under the right one.
const WORSE: f64 = 4.0;
/// Fewest means that are compared.
const FEWEST: usize = 8;

/// Evidence against the signs of wheels, gyro and pose, in sentences with the remedy.
#[must_use]
pub fn wrong_signs(vehicle: &Vehicle, log: &Log) -> Vec<String> {
    let mut found = Vec::new();
    let robot = Rolling::new(vehicle);
    let odometry = Odometry::of(log, &robot, None);
    let Some([left, right]) = odometry.as_ref().and_then(Odometry::wheels) else { return found };
    let times = log.time.to_vec();
    if let Some(gyro) = log.get(names::GYRO_Z) {
        let means = means(&times, [gyro, left, right]);
        found.extend(against_gyro(&means, vehicle.wheel_radius_m / (2.0 * vehicle.half_track_m)));
    }
    if let (Some(x), Some(y), Some(heading)) = (log.get(names::X), log.get(names::Y), log.get(names::HEADING)) {
        let speed: Vec<f64> = left.iter().zip(right).map(|(l, r)| robot.speed_and_yaw_rate([*l, *r])[0]).collect();
        found.extend(against_pose(&means(&times, [&speed, &ahead(&times, x, y, heading)])));
    }
    found
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

fn against_gyro(means: &[[f64; 3]], nominal: f64) -> Option<String> {
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
    let wheel = |side: &str| {
        format!(
            "The {side} wheel seems to count backwards: the gyro turns as the wheels' sum does, not as their difference; turn \
             its sign: --map wheel_{side}_rad_s=-COLUMN."
        )
    };
    Some(match () {
        () if best == both => {
            "The gyro turns left where the wheels turn right: its axis points down, or the wheels are \
                              exchanged; turn its sign: --map gyro_z_rad_s=-COLUMN, or exchange the wheels."
                .into()
        }
        () if best == left => wheel("left"),
        () => wheel("right"),
    })
}

fn against_pose(means: &[[f64; 2]]) -> Option<String> {
    if means.len() < FEWEST {
        return None;
    }
    let [forwards, backwards] = [1.0, -1.0].map(|sign| means.iter().map(|[v, p]| (p - sign * v).powi(2)).sum::<f64>());
    let nothing = means.iter().map(|m| m[1] * m[1]).sum::<f64>();
    (forwards > nothing && forwards >= WORSE * backwards).then(|| {
        "The pose moves backwards where the wheels roll forwards: turn the signs of both wheels (--map \
         wheel_left_rad_s=-COLUMN, wheel_right_rad_s=-COLUMN), or the reference's heading by 180°."
            .into()
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
    fn wheels_against_each_other_on_a_straight_line_are_told_and_a_straight_line_is_not() {
        let found = wrong_signs(&vehicle(), &drive(1e-4, [-1.0, 1.0, 1.0], 0.0));
        assert!(found.iter().any(|f| f.contains("count backwards")), "{found:?}");
        for bend in [0.0, 1e-4] {
            assert_eq!(wrong_signs(&vehicle(), &drive(bend, [1.0; 3], 0.0)), [""; 0]);
        }
    }
}
