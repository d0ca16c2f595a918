use super::*;
use crate::traction::{Dugoff, Linear, Pacejka, Surface};

impl Slipping {
    /// Traction of each wheel, N.
    fn tractions_n(&self, state: &SlippingState) -> [f64; 2] {
        let slips = self.slips(state);
        std::array::from_fn(|i| self.loads_n[i] * self.law.friction(slips[i].slip)[0])
    }

    /// Energy of body and wheels in motion, J.
    fn kinetic_energy_j(&self, state: &SlippingState) -> f64 {
        let (v, w) = (state.motion.speed_m_s, state.motion.yaw_rate_rad_s);
        let wheels: f64 = state.wheels_rad_s.iter().map(|s| s * s).sum();
        0.5 * (v * v / self.inverse_mass + w * w / self.inverse_yaw_inertia + wheels / self.inverse_wheel_inertia)
    }

    /// The explicit Euler step of (5a) to (5i), with the corrected equations.
    fn euler(&self, state: &SlippingState, torques_n_m: [f64; 2], dt_s: f64) -> SlippingState {
        let m = &state.motion;
        let [left, right] = self.tractions_n(state);
        let wheels = std::array::from_fn(|i| {
            let resisting = self.friction_n_m_s * state.wheels_rad_s[i] + self.rolling(i, state.wheels_rad_s[i]);
            let torque = torques_n_m[i] - self.radius_m * [left, right][i] - resisting;
            state.wheels_rad_s[i] + dt_s * self.inverse_wheel_inertia * torque
        });
        let (sin, cos) = m.heading_rad.sin_cos();
        SlippingState {
            motion: Motion {
                x_m: m.x_m + dt_s * m.speed_m_s * cos,
                y_m: m.y_m + dt_s * m.speed_m_s * sin,
                heading_rad: m.heading_rad + dt_s * m.yaw_rate_rad_s,
                speed_m_s: m.speed_m_s + dt_s * self.inverse_mass * (left + right),
                yaw_rate_rad_s: m.yaw_rate_rad_s + dt_s * self.inverse_yaw_inertia * self.half_track_m * (right - left),
            },
            wheels_rad_s: wheels,
        }
    }

    /// Torque of the rolling resistance of wheel `i`, N·m.
    fn rolling(&self, i: usize, wheel_rad_s: f64) -> f64 {
        self.rolling_n_m[i] * (self.radius_m * wheel_rad_s / self.low_speed_m_s).clamp(-1.0, 1.0)
    }
}

fn vehicle(friction: f64) -> Vehicle {
    Vehicle {
        mass_kg: 20.0,
        yaw_inertia_kg_m2: 0.6,
        half_track_m: 0.2,
        steering: None,
        wheel_radius_m: 0.1,
        wheel_inertia_kg_m2: 0.01,
        viscous_friction_n_m_s: friction,
        torque_noise_n_m_sqrt_s: 0.0,
        torque_constant_n_m_a: None,
        load_kg: 0.0,
    }
}

fn robot(law: TractionLaw) -> Slipping {
    Slipping::new(&vehicle(0.002), &Traction::new(law))
}

fn burckhardt(surface: Surface) -> TractionLaw {
    TractionLaw::Burckhardt(surface.law())
}

fn dry() -> Slipping {
    robot(burckhardt(Surface::DryAsphalt))
}

fn rolling_at(speed: f64, yaw_rate: f64) -> SlippingState {
    let motion = Motion { speed_m_s: speed, yaw_rate_rad_s: yaw_rate, ..Motion::default() };
    let lead = 0.2 * yaw_rate;
    SlippingState { motion, wheels_rad_s: [(speed - lead) / 0.1, (speed + lead) / 0.1] }
}

fn as_array(s: &SlippingState) -> [f64; 7] {
    let m = &s.motion;
    let [left, right] = s.wheels_rad_s;
    [m.x_m, m.y_m, m.heading_rad, m.speed_m_s, m.yaw_rate_rad_s, left, right]
}

fn from_array(a: [f64; 7]) -> SlippingState {
    let motion = Motion { x_m: a[0], y_m: a[1], heading_rad: a[2], speed_m_s: a[3], yaw_rate_rad_s: a[4] };
    SlippingState { motion, wheels_rad_s: [a[5], a[6]] }
}

/// Torques that start, steer, brake through zero and reverse.
fn torques(t: f64) -> [f64; 2] {
    let drive = if t < 1.0 { 0.8 } else { -0.8 };
    let steer = 0.2 * (3.0 * t).sin();
    [drive - steer, drive + steer]
}

/// `seconds` of the manoeuvre, torques held over 10 ms, each divided into `parts` steps.
fn manoeuvre(robot: &Slipping, start: SlippingState, seconds: f64, parts: u32) -> SlippingState {
    let rows = (seconds / 0.01).round() as u32;
    (0..rows).fold(start, |state, k| {
        let u = torques(0.01 * f64::from(k));
        (0..parts).fold(state, |s, _| robot.step(&s, u, 0.01 / f64::from(parts)))
    })
}

fn distance(a: &SlippingState, b: &SlippingState) -> f64 {
    as_array(a).iter().zip(as_array(b)).take(5).map(|(x, y)| (x - y).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn order_two_against_a_tight_reference_also_where_slip_is_stiff() {
    // from rest through a start, a turn, a stop and reversing: the slip's rate is 160 000 1/s at standstill
    for law in [
        burckhardt(Surface::DryAsphalt),
        burckhardt(Surface::Snow),
        TractionLaw::Dugoff(Dugoff { friction: 0.8, stiffness: 20.0 }),
    ] {
        let robot = robot(law);
        let tight = manoeuvre(&robot, SlippingState::default(), 2.5, 512);
        let errors: Vec<f64> = [1, 2, 4, 8, 16]
            .iter()
            .map(|parts| distance(&manoeuvre(&robot, SlippingState::default(), 2.5, *parts), &tight))
            .collect();
        println!("{}: {errors:?}", law.name());
        // after 2.5 s at 1 m/s at most
        assert!(errors[0] < 2e-4, "{} {errors:?}", law.name());
        let order = (errors[0] / errors[4]).log2() / 4.0;
        assert!(order > 1.5, "{}: order {order}, {errors:?}", law.name());
    }
}

#[test]
fn stable_at_rest_and_through_zero_at_steps_from_a_microsecond_to_a_second() {
    for dt in [1e-6, 1e-3, 0.01, 0.1, 1.0] {
        let robot = dry();
        let mut state = rolling_at(0.01, 0.02);
        for _ in 0..2000 {
            let before = robot.kinetic_energy_j(&state);
            state = robot.step(&state, [0.0; 2], dt);
            let after = robot.kinetic_energy_j(&state);
            // forces are solved to 1e-12 of the weight: speeds to 1e-9 m/s at most, over the longest step
            assert!(after <= before * (1.0 + 1e-12) + 1e-17, "{dt}: {before} {after}");
        }
        // a torque that reverses every step
        for k in 0..2000 {
            let u = if k % 2 == 0 { 0.5 } else { -0.5 };
            state = robot.step(&state, [u, -u], dt);
            assert!(as_array(&state).iter().all(|v| v.is_finite() && v.abs() < 1e3), "{dt} {state:?}");
        }
    }
}

#[test]
fn where_the_explicit_step_diverges() {
    // the example of the paper's robot: 6475 1/s at 0.5 m/s, so that Euler needs steps below 2/6475 s = 0.31 ms
    let mut v = vehicle(0.0);
    v.wheel_radius_m = 0.1;
    let robot = Slipping::new(&v, &Traction::new(TractionLaw::Linear(Linear { stiffness: 30.0, friction: 10.0 })));
    let rate = robot.slip_rate_per_s(0.5);
    assert!((rate - 6475.0).abs() < 10.0, "{rate}");
    let slip_after = |dt: f64| {
        let mut state = rolling_at(0.5, 0.0);
        state.wheels_rad_s = state.wheels_rad_s.map(|w| w * (1.0 + 1e-9));
        for _ in 0..200 {
            state = robot.euler(&state, [0.0; 2], dt);
        }
        robot.slips(&state)[0].slip.abs()
    };
    assert!(slip_after(0.9 * 2.0 / rate) < 1e-9);
    assert!(slip_after(1.1 * 2.0 / rate) > 1e-3);
    assert!(slip_after(0.01) > 1e-3, "at the filter's 10 ms");
    let mut state = rolling_at(0.5, 0.0);
    state.wheels_rad_s = state.wheels_rad_s.map(|w| w * (1.0 + 1e-3));
    for _ in 0..200 {
        state = robot.step(&state, [0.0; 2], 0.01);
    }
    assert!(robot.slips(&state)[0].slip.abs() < 1e-9);
}

#[test]
fn energy_is_what_torques_bring_less_friction_and_slip() {
    // trapezoidal sums over short steps: d/dt E = Σ u φ̇ - c φ̇² - F (r φ̇ - v_w)
    let robot = dry();
    let dt = 2e-5;
    let power = |s: &SlippingState, u: [f64; 2]| {
        let ground = robot.ground_speeds_m_s(&s.motion);
        let force = robot.tractions_n(s);
        (0..2)
            .map(|i| {
                let w = s.wheels_rad_s[i];
                u[i] * w - 0.002 * w * w - force[i] * (0.1 * w - ground[i])
            })
            .sum::<f64>()
    };
    let mut state = rolling_at(0.5, 0.3);
    // the jump of torque at the start relaxes within a millisecond, which the sum does not resolve: let it pass
    for _ in 0..500 {
        state = robot.step(&state, [0.6, 0.9], dt);
    }
    let begin = robot.kinetic_energy_j(&state);
    let mut brought = 0.0;
    for _ in 0..20_000 {
        let next = robot.step(&state, [0.6, 0.9], dt);
        brought += 0.5 * dt * (power(&state, [0.6, 0.9]) + power(&next, [0.6, 0.9]));
        state = next;
    }
    let gained = robot.kinetic_energy_j(&state) - begin;
    assert!(gained > 1.0);
    assert!((gained / brought - 1.0).abs() < 1e-6, "{gained} {brought}");
}

#[test]
fn without_torque_friction_and_slip_energy_and_speed_stay() {
    let robot = Slipping::new(&vehicle(0.0), &Traction::new(burckhardt(Surface::DryAsphalt)));
    let start = rolling_at(0.5, 0.7);
    let mut state = start;
    let mut way = 0.0;
    for _ in 0..10_000 {
        let next = robot.step(&state, [0.0; 2], 0.01);
        // the chord of a step points along the mean heading: nothing sideways
        let (dx, dy) = (next.motion.x_m - state.motion.x_m, next.motion.y_m - state.motion.y_m);
        let (sin, cos) = (0.5 * (next.motion.heading_rad + state.motion.heading_rad)).sin_cos();
        assert!((dy * cos - dx * sin).abs() < 1e-12, "sideways");
        way += dx.hypot(dy);
        state = next;
    }
    let (before, after) = (robot.kinetic_energy_j(&start), robot.kinetic_energy_j(&state));
    // rounding of ten thousand steps
    assert!((after / before - 1.0).abs() < 1e-10, "{before} {after}");
    // chords of arcs of 7 mrad: 1 - 0.007²/24
    assert!((way / 50.0 - (1.0 - 0.007f64.powi(2) / 24.0)).abs() < 1e-9, "{way}");
    assert!((state.motion.heading_rad - 70.0).abs() < 1e-8);
}

#[test]
fn a_gripping_wheel_rolls_as_the_rolling_robot_does() {
    // slip vanishes as stiffness grows: the difference is of order 1/stiffness
    let v = vehicle(0.002);
    let rolling = crate::vehicle::Rolling::new(&v);
    let difference = |stiffness: f64| {
        let robot = Slipping::new(&v, &Traction::new(TractionLaw::Linear(Linear { stiffness, friction: 10.0 })));
        let (mut slips, mut rolls) = (rolling_at(0.5, 0.0), rolling_at(0.5, 0.0).motion);
        for k in 0..200 {
            let u = torques(0.01 * f64::from(k));
            slips = robot.step(&slips, u, 0.01);
            rolls = rolling.step(&rolls, u, 0.01);
        }
        (slips.motion.speed_m_s - rolls.speed_m_s).hypot(slips.motion.yaw_rate_rad_s - rolls.yaw_rate_rad_s)
    };
    let (soft, stiff) = (difference(3e2), difference(3e4));
    assert!(stiff < soft / 30.0 && stiff < 1e-4, "{soft} {stiff}");
}

#[test]
fn full_sliding_carries_the_load_times_the_friction() {
    let law = TractionLaw::Linear(Linear { stiffness: 20.0, friction: 0.3 });
    let mut traction = Traction::new(law);
    (traction.driven_load_share, traction.left_load_share) = (0.8, 0.4);
    let robot = Slipping::new(&vehicle(0.0), &traction);
    let mut state = SlippingState::default();
    for _ in 0..100 {
        state = robot.step(&state, [10.0, 10.0], 0.01);
    }
    let weight = 20.0 * STANDARD_GRAVITY_M_S2;
    let [left, right] = robot.tractions_n(&state);
    assert!((left - 0.3 * weight * 0.8 * 0.4).abs() < 1e-9 && (right - 0.3 * weight * 0.8 * 0.6).abs() < 1e-9);
    // the body gains what both give, the wheels what is left of the torque
    assert!((state.motion.speed_m_s - 0.3 * 0.8 * STANDARD_GRAVITY_M_S2).abs() < 1e-9, "{}", state.motion.speed_m_s);
    assert!((state.wheels_rad_s[0] - (10.0 - 0.1 * left) / 0.01).abs() < 1e-7);
}

#[test]
fn rolling_resistance_brings_the_robot_to_rest_and_holds_it() {
    let mut traction = Traction::new(burckhardt(Surface::DryAsphalt));
    traction.rolling_resistance = 0.02;
    let robot = Slipping::new(&vehicle(0.0), &traction);
    let mut state = rolling_at(0.5, 0.0);
    for _ in 0..100 {
        state = robot.step(&state, [0.0; 2], 0.01);
    }
    // the wheels' inertia adds 2 J/r² = 2 kg to 20 kg; slip under such a force is below a part in a thousand
    let expected = 0.5 - 0.02 * STANDARD_GRAVITY_M_S2 * 20.0 / 22.0;
    assert!((state.motion.speed_m_s - expected).abs() < 2e-3, "{} {expected}", state.motion.speed_m_s);
    for _ in 0..1000 {
        state = robot.step(&state, [0.1; 2], 0.01);
    }
    // 0.1 N·m is less than 0.02 N r = 0.196 N·m: it creeps at v_low 0.1/0.196
    let creep = 0.02 * 0.1 / (0.02 * 10.0 * STANDARD_GRAVITY_M_S2 * 0.1);
    assert!((state.motion.speed_m_s - creep).abs() < 1e-3 * creep + 1e-6, "{} {creep}", state.motion.speed_m_s);
}

#[test]
fn derivatives_of_a_step_are_those_of_differences() {
    let laws = [
        burckhardt(Surface::DryAsphalt),
        burckhardt(Surface::Ice),
        TractionLaw::Pacejka(Pacejka { b: 10.0, c: 1.9, d: 0.9, e: 0.97 }),
        TractionLaw::Dugoff(Dugoff { friction: 0.8, stiffness: 20.0 }),
    ];
    for law in laws {
        let mut traction = Traction::new(law);
        traction.rolling_resistance = 0.01;
        let robot = Slipping::new(&vehicle(0.002), &traction);
        for (speed, yaw, ratio, u, dt) in [
            (0.5, 0.4, 1.002, [0.3, 0.5], 0.01),
            (-0.4, 0.1, 1.001, [-0.2, 0.1], 0.01),
            (0.003, 0.004, 1.1, [0.05, 0.02], 0.01),
            (0.5, 0.4, 1.3, [3.0, 2.0], 0.002),
            (0.6, -0.9, 0.9, [-0.5, 0.4], 0.03),
        ] {
            let mut start = rolling_at(speed, yaw);
            start.motion.heading_rad = 0.7;
            start.wheels_rad_s = start.wheels_rad_s.map(|w| w * ratio);
            let (end, j) = robot.step_with_jacobian(&start, u, dt);
            assert_eq!(end, robot.step(&start, u, dt));
            let differences = |cause: usize| {
                let eps = 1e-6;
                let at = |sign: f64| {
                    let (mut s, mut torque) = (as_array(&start), u);
                    if cause < 7 {
                        s[cause] += sign * eps
                    } else {
                        torque[cause - 7] += sign * eps
                    }
                    as_array(&robot.step(&from_array(s), torque, dt))
                };
                let (up, down) = (at(1.0), at(-1.0));
                std::array::from_fn::<f64, 7, _>(|i| (up[i] - down[i]) / (2.0 * eps))
            };
            for cause in 0..6 {
                let d = differences(3 + cause);
                let analytic: [f64; 7] =
                    std::array::from_fn(|i| if i < 3 { j.pose[i][cause] } else { j.velocities[i - 3][cause] });
                for i in 0..7 {
                    let scale = analytic[i].abs().max(d[i].abs()).max(1e-2);
                    // curvature of slip near its low speed: a few hundred times eps² and Newton's 1e-12 over eps
                    assert!(
                        (d[i] - analytic[i]).abs() < 2e-5 * scale,
                        "{} {speed} {i} {cause}: {} {}",
                        law.name(),
                        d[i],
                        analytic[i]
                    );
                }
            }
            let d = differences(2);
            assert!((d[0] - j.position_by_heading[0]).abs() < 1e-8 && (d[1] - j.position_by_heading[1]).abs() < 1e-8);
        }
    }
}
