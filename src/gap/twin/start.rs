//! Δθ = a_r Δφ_r - a_l Δφ_l,   [Δx, Δy] = ½ Σ_i r_i ∫ wheel_i [cos θ, sin θ] dt,   a_i = r_i/(2b)
//! Δs = k ∫ (u_r + u_l - 2 c s - F sgn s) dt,   s = (wheel_r + wheel_l)/2 = v/r,     k = 1/(M' r²),    M' = M + 2 Jw/r²
//! Δd = q ∫ (u_r - u_l - 2 c d - N sgn d) dt,   d = (wheel_r - wheel_l)/2 = b ω/r,   q = b²/(J' r²),   J' = Jc + 2 Jw b²/r²
//!
//! The equations of motion ([`crate::vehicle::Rolling`]) integrated over windows are linear in what they are to tell: no reading
//! is differentiated. Kinematics first: what turns the robot by how much a wheel turns, then how far that carries it. Then
//! dynamics. Regressors are integrals over every second reading, instruments those over the others; commanded torques have no
//! error and are their own instruments. Coulomb terms stand beside the others so that friction does not pass for mass or damping.

use super::integrals::Integral;
use super::regression::Equations;
use crate::gap::drive::record::Record;
use crate::math::robust;
use nalgebra::Complex;
use std::f64::consts::TAU;

/// Length of a window, s: speeds change within it by many times their noise, and a motion of some minutes has hundreds.
const WINDOW_S: f64 = 0.5;
/// Readings at each end of a window whose mean is the speed there.
const ENDS: usize = 3;
/// Steps of the integral along a window.
const PARTS: usize = 25;

/// Start values of one log; none where it does not tell them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Start {
    /// Radii, left and right, m.
    pub radius_m: Option<[f64; 2]>,
    /// a, left and right: turn of the robot by that of a wheel.
    pub turn: Option<[f64; 2]>,
    /// d(v/r)/dt by the sum of the torques, 1/(M' r²).
    pub force: Option<Dynamics>,
    /// d(b ω/r)/dt by the difference of the torques, b²/(J' r²).
    pub moment: Option<Dynamics>,
    /// Bias of the gyro, rad/s.
    pub bias_rad_s: Option<f64>,
}

/// An equation of motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Dynamics {
    /// Acceleration of the wheels by the sum or the difference of the torques, 1/(kg·m²).
    pub by_torque: f64,
    /// Viscous friction, N·m·s.
    pub viscous_n_m_s: f64,
}

/// The half-sampled integrals of both wheels.
struct Wheels([[Integral; 2]; 2]);

impl Wheels {
    fn of(times_s: &[f64], wheels: [&[f64]; 2]) -> Option<Self> {
        let both =
            |half: usize| Some([Integral::half(times_s, wheels[0], half)?, Integral::half(times_s, wheels[1], half)?]);
        Some(Self([both(0)?, both(1)?]))
    }
}

/// Equations of all drives.
#[derive(Default)]
struct All {
    turn_by_pose: Equations<2>,
    turn_by_gyro: Equations<3>,
    gyro_alone: Vec<f64>,
}

/// Windows of a drive that begin and end at `edges`, apart by [`WINDOW_S`] at least.
fn windows(edges: impl Iterator<Item = f64>) -> Vec<[f64; 2]> {
    let mut out = Vec::new();
    let mut from: Option<f64> = None;
    for t in edges {
        match from {
            Some(begin) if t - begin >= WINDOW_S => {
                out.push([begin, t]);
                from = Some(t);
            }
            Some(_) => {}
            None => from = Some(t),
        }
    }
    out
}

/// Start values of `record`; the constants that it believes are not used.
pub(super) fn of(record: &Record) -> Start {
    let drives: Vec<Record> = record.apart().collect();
    let mut start = Start::default();
    let mut all = All::default();
    drives.iter().for_each(|drive| turning(drive, &mut all));
    let (by_pose, by_gyro) = (all.turn_by_pose.solve(), all.turn_by_gyro.solve());
    let bias = by_gyro.map(|g| g[2]);
    start.bias_rad_s = bias.or_else(|| still(&mut all.gyro_alone));
    let turn = by_pose.or(by_gyro.map(|[left, right, _]| [left, right]));
    start.turn = turn.map(|[left, right]| [-left, right]).filter(|t| t.iter().all(|a| *a > 0.0));
    let Some(turn) = start.turn else { return start };
    start.radius_m = radii(&drives, turn);
    let [force, moment] = dynamics(&drives, turn);
    (start.force, start.moment) = (force, moment);
    start
}

/// Median of the gyro where no turn tells it apart.
fn still(gyro: &mut [f64]) -> Option<f64> {
    (gyro.len() > 1).then(|| robust::median(gyro))
}

fn turning(drive: &Record, all: &mut All) {
    let times = &drive.times_s;
    let Some(Wheels([even, odd])) = Wheels::of(times, [&drive.wheels_rad_s[0], &drive.wheels_rad_s[1]]) else { return };
    if let Some([_, _, heading]) = &drive.pose {
        let at: Vec<(f64, f64)> =
            times.iter().zip(heading).filter(|(_, h)| h.is_finite()).map(|(t, h)| (*t, *h)).collect();
        for window in windows(at.iter().map(|r| r.0)) {
            let reading = |t: f64| at.iter().find(|r| r.0 == t).map_or(f64::NAN, |r| r.1);
            let [x, z] = [&even, &odd].map(|w| [w[0].between(window), w[1].between(window)]);
            let turned = reading(window[1]) - reading(window[0]);
            // no robot turns by half a turn within a window
            all.turn_by_pose.push(x, z, turned - TAU * (turned / TAU).round());
        }
    }
    if let Some(gyro) = &drive.gyro_rad_s {
        all.gyro_alone.extend(gyro.iter().filter(|g| g.is_finite()));
        let Some(turned) = Integral::whole(times, gyro) else { return };
        let [first, last] = turned.span_s();
        for k in 0..((last - first) / WINDOW_S) as usize {
            let window = [first + k as f64 * WINDOW_S, first + (k + 1) as f64 * WINDOW_S];
            let [x, z] = [&even, &odd].map(|w| [w[0].between(window), w[1].between(window), window[1] - window[0]]);
            all.turn_by_gyro.push(x, z, turned.between(window));
        }
    }
}

/// r from the ways between readings of the position, θ from the wheels.
fn radii(drives: &[Record], turn: [f64; 2]) -> Option<[f64; 2]> {
    // of each window: [∫ wheel_l e^{iψ}, ∫ wheel_r e^{iψ}] by both halves, and the way
    let mut ways = Vec::new();
    for drive in drives {
        let Some([x, y, heading]) = &drive.pose else { continue };
        let times = &drive.times_s;
        let Some(Wheels(halves)) = Wheels::of(times, [&drive.wheels_rad_s[0], &drive.wheels_rad_s[1]]) else {
            continue;
        };
        // a heading at the start alone was estimated from the positions
        let has_heading = heading.iter().filter(|h| h.is_finite()).count() > 1;
        let there: Vec<usize> = (0..times.len())
            .filter(|k| x[*k].is_finite() && y[*k].is_finite() && (!has_heading || heading[*k].is_finite()))
            .collect();
        let row = |t: f64| there.iter().copied().find(|k| times[*k] == t);
        let begin = there.first().map_or(0.0, |k| times[*k]);
        for window in windows(there.iter().map(|k| times[*k])) {
            let (Some(from), Some(to)) = (row(window[0]), row(window[1])) else { continue };
            let way = Complex::new(x[to] - x[from], y[to] - y[from]);
            let turned = |w: &[Integral; 2], since: f64, t: f64| {
                turn[1] * w[1].between([since, t]) - turn[0] * w[0].between([since, t])
            };
            let along = |w: &[Integral; 2]| -> [Complex<f64>; 2] {
                let step = (window[1] - window[0]) / PARTS as f64;
                let mut sums = [Complex::new(0.0, 0.0); 2];
                for k in 0..PARTS {
                    let (a, b) = (window[0] + k as f64 * step, window[0] + (k as f64 + 1.0) * step);
                    let psi = match has_heading {
                        true => heading[from] + turned(w, window[0], 0.5 * (a + b)),
                        false => turned(w, begin, 0.5 * (a + b)),
                    };
                    for (sum, wheel) in sums.iter_mut().zip(w) {
                        *sum += Complex::from_polar(0.5 * wheel.between([a, b]), psi);
                    }
                }
                sums
            };
            ways.push((along(&halves[0]), along(&halves[1]), way, has_heading));
        }
    }
    // without headings the first one is the direction in which the ways agree best
    let away: Complex<f64> =
        ways.iter().map(|(x, _, way, _)| way * (x[0] + x[1]).conj()).filter(|c| c.is_finite()).sum();
    let first = Complex::from_polar(1.0, -away.arg());
    let mut equations = Equations::<2>::default();
    for (x, z, way, has_heading) in ways {
        let way = if has_heading { way } else { way * first };
        equations.push(x.map(|c| c.re), z.map(|c| c.re), way.re);
        equations.push(x.map(|c| c.im), z.map(|c| c.im), way.im);
    }
    equations.solve().filter(|radii| radii.iter().all(|r| *r > 0.0))
}

/// Equations of wheel motion: half sum and half difference of the wheels' speeds stand for v/r and b ω/r.
fn dynamics(drives: &[Record], turn: [f64; 2]) -> [Option<Dynamics>; 2] {
    let mut equations = [Equations::<3>::default(), Equations::<3>::default()];
    // what the wheels share, and what they differ by, in the ratio in which they turn the robot
    let share = [0, 1].map(|i| 2.0 * turn[i] / (turn[0] + turn[1]));
    for drive in drives {
        let Some(torques) = &drive.torques_n_m else { continue };
        let times = &drive.times_s;
        let there: Vec<usize> =
            (0..times.len()).filter(|k| drive.wheels_rad_s.iter().all(|w| w[*k].is_finite())).collect();
        let mixed: [Vec<f64>; 2] = [1.0, -1.0].map(|sign| {
            let of =
                |k: usize| 0.5 * (share[1] * drive.wheels_rad_s[1][k] + sign * share[0] * drive.wheels_rad_s[0][k]);
            (0..times.len()).map(of).collect()
        });
        for ((sign, speed), equations) in [1.0, -1.0].into_iter().zip(&mixed).zip(&mut equations) {
            let pushed: Vec<f64> = torques[0].iter().zip(&torques[1]).map(|(l, r)| r + sign * l).collect();
            let signs: Vec<f64> = speed.iter().map(|v| if v.is_finite() { v.signum() } else { f64::NAN }).collect();
            let Some(push) = Integral::held(times, &pushed) else { continue };
            let halves = |values: &[f64]| Some([Integral::half(times, values, 0)?, Integral::half(times, values, 1)?]);
            let (Some(turned), Some(signed)) = (halves(speed), halves(&signs)) else { continue };
            let mean = |near: usize| {
                let rows = there[near.saturating_sub(ENDS / 2)..(near + ENDS / 2 + 1).min(there.len())].iter();
                let n = rows.len() as f64;
                rows.clone().fold((0.0, 0.0), |(t, v), k| (t + times[*k] / n, v + speed[*k] / n))
            };
            let mut from = ENDS / 2;
            while from + ENDS / 2 < there.len() {
                let until = times[there[from]] + WINDOW_S;
                let to = there.partition_point(|k| times[*k] < until);
                if to + ENDS / 2 >= there.len() {
                    break;
                }
                let ((t0, v0), (t1, v1)) = (mean(from), mean(to));
                let row = |half: usize| {
                    let damped = 2.0 * turned[half].between([t0, t1]);
                    [push.between([t0, t1]), -damped, -signed[half].between([t0, t1])]
                };
                equations.push(row(0), row(1), v1 - v0);
                from = to;
            }
        }
    }
    equations.map(|equations| {
        let [by_torque, damping, _] = equations.solve()?;
        Some(Dynamics { by_torque, viscous_n_m_s: damping / by_torque })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::effects::Library;
    use crate::simulate::{Course, Options, drive_with};

    const TRUE: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.02\n\
        [gyro]\nc1_rad_s = 0.0\nc2_rad_s = 1e-3\ntime_constant_s = 200.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
        [vehicle]\nmass_kg = 14.0\nyaw_inertia_kg_m2 = 0.4\nhalf_track_m = 0.2\nwheel_radius_m = 0.07\n\
        wheel_inertia_kg_m2 = 0.0\nviscous_friction_n_m_s = 0.004\ntorque_noise_n_m_sqrt_s = 0.0005\n\
        [encoder]\nspeed_noise_std_rad_s = 0.02\n[pose]\nrate_hz = 10.0\nposition_std_m = 0.002\nheading_std_rad = 0.002\n";

    /// Told by a minute of the true robot, read as one of unit size.
    fn drawn(seed: u64) -> Start {
        let config = Config::parse(TRUE, "true.toml").unwrap();
        let log = drive_with(&config, Course::Random, 60.0, &Options::from(seed), &Library::new()).unwrap().log;
        let mut unit = config;
        let v = unit.vehicle.as_mut().unwrap();
        (v.mass_kg, v.yaw_inertia_kg_m2, v.half_track_m, v.wheel_radius_m) = (1.0, 1.0, 1.0, 1.0);
        of(&Record::new(&unit, &log, 0.0).unwrap())
    }

    #[test]
    fn start_values_scatter_about_the_truth() {
        const RUNS: u64 = 60;
        // speeds at the ends of a window are means over three rows: an error of the method, which the refinement takes out
        const NEAR: f64 = 0.005;
        let all: Vec<Start> = (0..RUNS).map(drawn).collect();
        type Of = fn(&Start) -> f64;
        let told: [(&str, f64, Of); 8] = [
            ("left radius", 0.07, |s| s.radius_m.unwrap()[0]),
            ("right radius", 0.07, |s| s.radius_m.unwrap()[1]),
            ("turn by the left wheel", 0.07 / 0.4, |s| s.turn.unwrap()[0]),
            ("turn by the right wheel", 0.07 / 0.4, |s| s.turn.unwrap()[1]),
            ("bias", 1e-3, |s| s.bias_rad_s.unwrap()),
            ("1/(M r²)", 1.0 / (14.0 * 0.07 * 0.07), |s| s.force.unwrap().by_torque),
            ("b²/(Jc r²)", 0.04 / (0.4 * 0.07 * 0.07), |s| s.moment.unwrap().by_torque),
            ("c", 0.004, |s| s.force.unwrap().viscous_n_m_s),
        ];
        let n = RUNS as f64;
        // means further from the truth than that and four standard errors
        let mut wrong: Vec<String> = Vec::new();
        for (name, truth, of) in told {
            let found: Vec<f64> = all.iter().map(of).collect();
            let mean = found.iter().sum::<f64>() / n;
            let std = (found.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
            let bound = NEAR * truth + 4.0 * std / n.sqrt();
            let is_off = (mean - truth).abs() > bound;
            wrong.extend(is_off.then(|| format!("{name}: {mean} ± {std}, true {truth}")));
        }
        assert!(wrong.is_empty(), "{wrong:?}");
    }
}
