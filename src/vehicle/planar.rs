//! dv/dt = a - λ v,  dω/dt = α - μ ω,  dx/dt = v cos θ,  dy/dt = v sin θ,  dθ/dt = ω
//!
//! Over a step with a, α held, v, ω and θ are known in closed form: with E(z) = exp(-z), φ1(z) = (1 - E)/z and
//! φ2(z) = (1 - φ1)/z,
//!
//! v(τ) = v E(λτ) + a τ φ1(λτ),  θ(τ) = θ + ω τ φ1(μτ) + α τ² φ2(μτ).
//!
//! x and y are integrated by Gauss-Legendre quadrature with three points: order 6, the error of a step h is
//! h⁷/2016000 times the sixth derivative of v cos θ, that is below v h (ω h)⁶/2016000 at steady speed (h ω = 0.1:
//! 5e-13 of the way). Longer turns in one step than [`TURN_LIMIT_RAD`] are split.

use crate::math::phi::exponentials;

/// Pose and velocity of the robot's axle centre.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Motion {
    /// Position, m.
    pub x_m: f64,
    /// Position, m.
    pub y_m: f64,
    /// Heading, counter-clockwise from x, unwrapped, rad.
    pub heading_rad: f64,
    /// Forward speed, m/s.
    pub speed_m_s: f64,
    /// Yaw rate, rad/s.
    pub yaw_rate_rad_s: f64,
}

impl Motion {
    /// Speed, m/s, and yaw rate, rad/s.
    pub(crate) fn velocity(&self) -> [f64; 2] {
        [self.speed_m_s, self.yaw_rate_rad_s]
    }
}

/// Accelerations and damping of the motion over a step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Forcing {
    /// a, m/s².
    pub acceleration_m_s2: f64,
    /// α, rad/s².
    pub yaw_acceleration_rad_s2: f64,
    /// λ: rate at which friction takes the speed, 1/s, not negative.
    pub speed_damping_per_s: f64,
    /// μ: rate at which friction takes the yaw rate, 1/s, not negative.
    pub yaw_damping_per_s: f64,
}

impl Forcing {
    /// The even change from one speed (m/s) and yaw rate (rad/s) to another within `dt_s`, without friction.
    pub(crate) fn between(from: [f64; 2], to: [f64; 2], dt_s: f64) -> Self {
        let [acceleration_m_s2, yaw_acceleration_rad_s2] = [0, 1].map(|i| (to[i] - from[i]) / dt_s);
        Self { acceleration_m_s2, yaw_acceleration_rad_s2, ..Self::default() }
    }
}

/// Derivatives of the motion after a step; those of v and ω are diagonal.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct MotionJacobian {
    /// ∂(x, y)/∂θ, m/rad.
    pub position_by_heading: [f64; 2],
    /// ∂(x, y)/∂v, s.
    pub position_by_speed: [f64; 2],
    /// ∂(x, y)/∂ω, m·s/rad.
    pub position_by_yaw_rate: [f64; 2],
    /// ∂(x, y)/∂a, s².
    pub position_by_acceleration: [f64; 2],
    /// ∂(x, y)/∂α, m·s²/rad.
    pub position_by_yaw_acceleration: [f64; 2],
    /// ∂θ/∂ω, s.
    pub heading_by_yaw_rate: f64,
    /// ∂θ/∂α, s².
    pub heading_by_yaw_acceleration: f64,
    /// ∂v/∂v.
    pub speed_by_speed: f64,
    /// ∂v/∂a, s.
    pub speed_by_acceleration: f64,
    /// ∂ω/∂ω.
    pub yaw_rate_by_yaw_rate: f64,
    /// ∂ω/∂α, s.
    pub yaw_rate_by_yaw_acceleration: f64,
}

/// A step that turns further is split, so that the quadrature keeps its digits: (0.5)⁶/2016000 = 8e-9 of the way.
const TURN_LIMIT_RAD: f64 = 0.5;

/// A bound on the parts of a step: a position after eight turns in one step means nothing, and must not cost much.
const PARTS_LIMIT: f64 = 100.0;

/// Nodes and weights of Gauss and Legendre on [0, 1].
const NODES: [(f64, f64); 3] =
    [(0.112_701_665_379_258_31, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// Angles up to this are turned by Σ (-a²)^k / (2k+1)! and Σ (-a²)^k / (2k)!; the omitted terms are below 0.3¹³/13! =
/// 3e-17 and 0.3¹⁴/14! = 5e-19.
const SERIES_LIMIT_RAD: f64 = 0.3;

/// Each term's factorial over the next one's.
const SINE: [f64; 5] = [1.0 / 6.0, 1.0 / 20.0, 1.0 / 42.0, 1.0 / 72.0, 1.0 / 110.0];
const COSINE: [f64; 6] = [1.0 / 2.0, 1.0 / 12.0, 1.0 / 30.0, 1.0 / 56.0, 1.0 / 90.0, 1.0 / 132.0];

/// Sine and cosine of two angles; without a call, and side by side, where both are small, as in a step.
#[inline]
fn sin_cos(angles: [f64; 2]) -> [(f64, f64); 2] {
    if !angles.iter().all(|a| a.abs() < SERIES_LIMIT_RAD) {
        return angles.map(f64::sin_cos);
    }
    angles.map(|a| {
        let series = |ratios: &[f64]| ratios.iter().rev().fold(1.0, |rest, ratio| 1.0 - a * a * ratio * rest);
        (a * series(&SINE), series(&COSINE))
    })
}

/// The motion `dt_s` later.
#[must_use]
pub fn advance(motion: &Motion, forcing: &Forcing, dt_s: f64) -> Motion {
    let parts = parts(motion, forcing, dt_s);
    let h = dt_s / f64::from(parts);
    (0..parts).fold(*motion, |m, _| step::<false>(&m, forcing, h).0)
}

/// The motion `dt_s` later, and its derivatives by the motion before and by the accelerations.
#[must_use]
#[inline]
pub(crate) fn advance_with_jacobian(motion: &Motion, forcing: &Forcing, dt_s: f64) -> (Motion, MotionJacobian) {
    let parts = parts(motion, forcing, dt_s);
    if parts > 1 {
        return advance_in_parts(motion, forcing, dt_s, parts);
    }
    step::<true>(motion, forcing, dt_s)
}

/// Kept apart, so that the usual step, which is one part, is compiled for itself.
#[cold]
#[inline(never)]
fn advance_in_parts(motion: &Motion, forcing: &Forcing, dt_s: f64, parts: u32) -> (Motion, MotionJacobian) {
    let h = dt_s / f64::from(parts);
    let (mut m, mut j) = step::<true>(motion, forcing, h);
    for _ in 1..parts {
        let (next, k) = step::<true>(&m, forcing, h);
        j = k.after(&j);
        m = next;
    }
    (m, j)
}

/// Way (m) and turn (rad) within `dt_s`, backwards and clockwise negative; exact: ∫v dt = v τ φ1(λτ) + a τ² φ2(λτ).
#[must_use]
pub fn travel(motion: &Motion, forcing: &Forcing, dt_s: f64) -> [f64; 2] {
    let over = |rate: f64, by: f64, damping: f64| {
        let [[_, first, second]] = exponentials([damping * dt_s]);
        rate * dt_s * first + by * dt_s * dt_s * second
    };
    [
        over(motion.speed_m_s, forcing.acceleration_m_s2, forcing.speed_damping_per_s),
        over(motion.yaw_rate_rad_s, forcing.yaw_acceleration_rad_s2, forcing.yaw_damping_per_s),
    ]
}

/// Number of parts that a step is taken in.
fn parts(motion: &Motion, forcing: &Forcing, dt_s: f64) -> u32 {
    let turn = (motion.yaw_rate_rad_s.abs() + 0.5 * forcing.yaw_acceleration_rad_s2.abs() * dt_s) * dt_s;
    if turn <= TURN_LIMIT_RAD {
        return 1;
    }
    // the cast saturates, and takes NaN to 0
    ((turn / TURN_LIMIT_RAD).ceil().min(PARTS_LIMIT) as u32).max(1)
}

#[inline]
fn step<const JACOBIAN: bool>(m: &Motion, f: &Forcing, h: f64) -> (Motion, MotionJacobian) {
    let (v, w) = (m.speed_m_s, m.yaw_rate_rad_s);
    let (a, alpha) = (f.acceleration_m_s2, f.yaw_acceleration_rad_s2);
    let times = [NODES[0].0 * h, NODES[1].0 * h, NODES[2].0 * h, h];
    let (damping, yaw_damping) = (f.speed_damping_per_s, f.yaw_damping_per_s);
    let decays = exponentials::<8>(std::array::from_fn(|i| times[i % 4] * if i < 4 { damping } else { yaw_damping }));
    let [along, turning] = [&decays[..4], &decays[4..]];
    let turn = |i: usize| {
        let (t, [_, pw, qw]) = (times[i], turning[i]);
        w * t * pw + alpha * t * t * qw
    };
    let turns = [turn(0), turn(1), turn(2)];
    // in the frame of the heading at the middle node the other two headings lie close
    let (sin, cos) = (m.heading_rad + turns[1]).sin_cos();
    let [(sin0, cos0), (sin2, cos2)] = sin_cos([turns[0] - turns[1], turns[2] - turns[1]]);
    let units = [(cos0, sin0), (1.0, 0.0), (cos2, sin2)];

    let mut way = [0.0; 2];
    let (mut by_speed, mut by_a, mut by_yaw, mut by_alpha) = ([0.0; 2], [0.0; 2], [0.0; 2], [0.0; 2]);
    for (i, (_, weight)) in NODES.into_iter().enumerate() {
        let (t, [ev, pv, _], [_, pw, qw]) = (times[i], along[i], turning[i]);
        let (ahead, aside) = units[i];
        let by = weight * h;
        let part = by * (v * ev + a * t * pv);
        way[0] += part * ahead;
        way[1] += part * aside;
        if JACOBIAN {
            for (axis, (unit, turned)) in [(ahead, -part * aside), (aside, part * ahead)].into_iter().enumerate() {
                by_speed[axis] += by * ev * unit;
                by_a[axis] += by * t * pv * unit;
                by_yaw[axis] += t * pw * turned;
                by_alpha[axis] += t * t * qw * turned;
            }
        }
    }
    let turned = |[x, y]: [f64; 2]| [x * cos - y * sin, x * sin + y * cos];
    let [dx, dy] = turned(way);
    let ([ev, pv, _], [ew, pw, qw]) = (along[3], turning[3]);
    let mut j = MotionJacobian::default();
    if JACOBIAN {
        j = MotionJacobian {
            position_by_heading: [-dy, dx],
            position_by_speed: turned(by_speed),
            position_by_yaw_rate: turned(by_yaw),
            position_by_acceleration: turned(by_a),
            position_by_yaw_acceleration: turned(by_alpha),
            heading_by_yaw_rate: h * pw,
            heading_by_yaw_acceleration: h * h * qw,
            speed_by_speed: ev,
            speed_by_acceleration: h * pv,
            yaw_rate_by_yaw_rate: ew,
            yaw_rate_by_yaw_acceleration: h * pw,
        };
    }
    let after = Motion {
        x_m: m.x_m + dx,
        y_m: m.y_m + dy,
        heading_rad: m.heading_rad + turn(3),
        speed_m_s: v * ev + a * h * pv,
        yaw_rate_rad_s: w * ew + alpha * h * pw,
    };
    (after, j)
}

impl MotionJacobian {
    /// Chain rule: this step's derivatives after those of the step `before`.
    fn after(&self, before: &Self) -> Self {
        let mut out = *self;
        for i in 0..2 {
            let (by_heading, by_speed, by_yaw) =
                (self.position_by_heading[i], self.position_by_speed[i], self.position_by_yaw_rate[i]);
            out.position_by_heading[i] = before.position_by_heading[i] + by_heading;
            out.position_by_speed[i] = before.position_by_speed[i] + by_speed * before.speed_by_speed;
            out.position_by_acceleration[i] +=
                before.position_by_acceleration[i] + by_speed * before.speed_by_acceleration;
            out.position_by_yaw_rate[i] = before.position_by_yaw_rate[i]
                + by_heading * before.heading_by_yaw_rate
                + by_yaw * before.yaw_rate_by_yaw_rate;
            out.position_by_yaw_acceleration[i] += before.position_by_yaw_acceleration[i]
                + by_heading * before.heading_by_yaw_acceleration
                + by_yaw * before.yaw_rate_by_yaw_acceleration;
        }
        out.heading_by_yaw_rate = before.heading_by_yaw_rate + self.heading_by_yaw_rate * before.yaw_rate_by_yaw_rate;
        out.heading_by_yaw_acceleration +=
            before.heading_by_yaw_acceleration + self.heading_by_yaw_rate * before.yaw_rate_by_yaw_acceleration;
        out.speed_by_speed *= before.speed_by_speed;
        out.speed_by_acceleration += self.speed_by_speed * before.speed_by_acceleration;
        out.yaw_rate_by_yaw_rate *= before.yaw_rate_by_yaw_rate;
        out.yaw_rate_by_yaw_acceleration += self.yaw_rate_by_yaw_rate * before.yaw_rate_by_yaw_acceleration;
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const START: Motion = Motion { x_m: 1.0, y_m: -2.0, heading_rad: 0.7, speed_m_s: 0.8, yaw_rate_rad_s: -1.3 };
    const FORCING: Forcing = Forcing {
        acceleration_m_s2: 0.4,
        yaw_acceleration_rad_s2: 0.9,
        speed_damping_per_s: 0.3,
        yaw_damping_per_s: 0.2,
    };

    fn as_array(m: &Motion) -> [f64; 5] {
        [m.x_m, m.y_m, m.heading_rad, m.speed_m_s, m.yaw_rate_rad_s]
    }

    #[test]
    fn series_and_calls_give_the_same_sine_and_cosine() {
        for a in [0.0, 1e-9, -1e-3, 0.05, -0.17, 0.299_999] {
            // beside an angle that asks for the calls, and one that does not
            for turned in [sin_cos([a, 0.1])[0], sin_cos([2.0, a])[1]] {
                let (sin, cos): (f64, f64) = turned;
                assert!((sin - a.sin()).abs() <= 2.0 * f64::EPSILON * a.abs(), "{a}");
                assert!((cos - a.cos()).abs() <= 2.0 * f64::EPSILON, "{a}");
            }
        }
        assert!(sin_cos([f64::NAN, 0.0])[0].0.is_nan());
    }

    #[test]
    fn without_force_and_friction_the_robot_runs_a_circle() {
        let f = Forcing::default();
        let m = Motion { speed_m_s: 0.6, yaw_rate_rad_s: 0.5, ..Motion::default() };
        let after = advance(&m, &f, 3.0);
        let radius = 0.6 / 0.5;
        let (sin, cos) = 1.5f64.sin_cos();
        // error of three parts of 0.5 rad, from the module's bound
        let bound = 0.6 * 3.0 * 0.5f64.powi(6) / 2_016_000.0;
        assert!((after.x_m - radius * sin).abs() < bound, "{}", after.x_m - radius * sin);
        assert!((after.y_m - radius * (1.0 - cos)).abs() < bound);
        assert!((after.heading_rad - 1.5).abs() < 1e-15);
    }

    #[test]
    fn way_and_turn_are_the_integrals_of_speed_and_yaw_rate() {
        let dt = 0.7;
        let [way, turn] = travel(&START, &FORCING, dt);
        assert!((turn - (advance(&START, &FORCING, dt).heading_rad - START.heading_rad)).abs() < 4.0 * f64::EPSILON);
        // Simpson's rule over 1000 parts: below 1e-15 of the way
        let n = 1000;
        let h = dt / f64::from(n);
        let speed = |k: i32| advance(&START, &FORCING, 0.5 * h * f64::from(k)).speed_m_s;
        let simpson: f64 = (0..n).map(|k| h / 6.0 * (speed(2 * k) + 4.0 * speed(2 * k + 1) + speed(2 * k + 2))).sum();
        assert!((way - simpson).abs() < 1e-13, "{way} {simpson}");
    }

    #[test]
    fn position_is_of_sixth_order() {
        let reference = (0..4096).fold(START, |m, _| advance(&m, &FORCING, 0.3 / 4096.0));
        let error = |parts: u32| {
            let m = (0..parts).fold(START, |m, _| advance(&m, &FORCING, 0.3 / f64::from(parts)));
            (m.x_m - reference.x_m).hypot(m.y_m - reference.y_m)
        };
        let (one, two) = (error(1), error(2));
        let order = (one / two).log2();
        assert!(order > 5.5 && order < 6.5, "order {order} from {one} and {two}");
    }

    #[test]
    fn one_step_equals_two_halves_in_what_is_exact() {
        let whole = advance(&START, &FORCING, 0.2);
        let half = advance(&advance(&START, &FORCING, 0.1), &FORCING, 0.1);
        for (a, b) in as_array(&whole).iter().zip(as_array(&half)).skip(2) {
            assert!((a - b).abs() < 4.0 * f64::EPSILON, "{a} {b}");
        }
    }

    #[test]
    fn no_sideways_motion_in_a_turn() {
        // the mean velocity over a short step points along the mean heading: its lateral part is of third order
        let h = 1e-3;
        let after = advance(&START, &FORCING, h);
        let (sin, cos) = (0.5 * (START.heading_rad + after.heading_rad)).sin_cos();
        let lateral = -(after.x_m - START.x_m) * sin + (after.y_m - START.y_m) * cos;
        assert!(lateral.abs() < h.powi(3), "{lateral}");
    }

    #[test]
    fn jacobian_agrees_with_differences_also_over_split_steps() {
        for dt in [0.01, 0.2, 2.0] {
            let (_, j) = advance_with_jacobian(&START, &FORCING, dt);
            let eps = 1e-6;
            let by = |change: &dyn Fn(&mut Motion, &mut Forcing, f64)| {
                let at = |sign: f64| {
                    let (mut m, mut f) = (START, FORCING);
                    change(&mut m, &mut f, sign * eps);
                    as_array(&advance(&m, &f, dt))
                };
                let (up, down) = (at(1.0), at(-1.0));
                std::array::from_fn::<f64, 5, _>(|i| (up[i] - down[i]) / (2.0 * eps))
            };
            let [hx, hy] = j.position_by_heading;
            let [vx, vy] = j.position_by_speed;
            let [wx, wy] = j.position_by_yaw_rate;
            let [ax, ay] = j.position_by_acceleration;
            let [lx, ly] = j.position_by_yaw_acceleration;
            let checks = [
                (by(&|m, _, e| m.heading_rad += e), [hx, hy, 1.0, 0.0, 0.0]),
                (by(&|m, _, e| m.speed_m_s += e), [vx, vy, 0.0, j.speed_by_speed, 0.0]),
                (by(&|m, _, e| m.yaw_rate_rad_s += e), [wx, wy, j.heading_by_yaw_rate, 0.0, j.yaw_rate_by_yaw_rate]),
                (by(&|_, f, e| f.acceleration_m_s2 += e), [ax, ay, 0.0, j.speed_by_acceleration, 0.0]),
                (
                    by(&|_, f, e| f.yaw_acceleration_rad_s2 += e),
                    [lx, ly, j.heading_by_yaw_acceleration, 0.0, j.yaw_rate_by_yaw_acceleration],
                ),
            ];
            for (k, (differences, analytic)) in checks.iter().enumerate() {
                for (d, a) in differences.iter().zip(analytic) {
                    // central differences: eps² for truncation, rounding of values up to 3 over 2 eps
                    assert!((d - a).abs() < 1e-8, "dt {dt}, column {k}: {d} {a}");
                }
            }
        }
    }
}
