//! A label's parameters come out of drives without noise, by the simplest estimators.

use super::*;

const GRAVITY_M_S2: f64 = 9.806_65;

/// One drive with one effect.
struct Case {
    machine: Machine,
    trace: Trace,
    world: World,
    label: std::collections::BTreeMap<String, f64>,
}

impl Case {
    fn new(id: &str, seed: u64, strength: f64) -> Self {
        let (machine, run) = robot(seed, 150.0);
        let effect = effect(id, &machine, seed);
        let (world, trace) = driven(&machine, &run, &effect, strength, 0.0);
        let label = effect.parameters(strength, &run, &trace, &mut Stream::new(9, 4));
        Self { machine, trace, world, label }
    }

    fn rows(&self) -> impl Iterator<Item = usize> + '_ {
        1..self.trace.v_m_s.len() - 1
    }

    fn v(&self, k: usize) -> f64 {
        self.trace.v_m_s[k]
    }

    fn w(&self, k: usize) -> f64 {
        self.trace.w_rad_s[k]
    }

    /// Means over row k: forward speed, yaw rate, and their rates.
    fn middle(&self, k: usize) -> [f64; 4] {
        let dt = self.machine.step_s;
        let (v, v1, w, w1) = (self.v(k), self.v(k + 1), self.w(k), self.w(k + 1));
        [0.5 * (v + v1), 0.5 * (w + w1), (v1 - v) / dt, (w1 - w) / dt]
    }

    /// Torques less friction in row k.
    fn torques(&self, k: usize) -> [f64; 2] {
        let c = &self.machine.vehicle;
        let [v, w, ..] = self.middle(k);
        let b = c.half_track_m;
        std::array::from_fn(|i| {
            let wheel = (v + [-1.0, 1.0][i] * b * w) / c.wheel_radius_m;
            self.trace.torque_n_m[i][k] - c.viscous_friction_n_m_s * wheel
        })
    }

    /// Force that is missing in row k, over the weight.
    fn missing(&self, k: usize) -> f64 {
        let c = &self.machine.vehicle;
        let [left, right] = self.torques(k);
        let mass = c.mass_kg + 2.0 * c.wheel_inertia_kg_m2 / c.wheel_radius_m.powi(2);
        (mass * self.middle(k)[2] - (left + right) / c.wheel_radius_m) / (c.mass_kg * GRAVITY_M_S2)
    }
}

/// Σ y x / Σ x².
fn ratio(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (cross, square) = pairs.fold((0.0, 0.0), |(c, q), (x, y)| (c + x * y, q + x * x));
    cross / square
}

#[track_caller]
fn near(found: f64, label: f64, share: f64) {
    assert!((found - label).abs() < share * label.abs(), "found {found}, labelled {label}");
}

#[test]
#[ignore = "battery: some ten seconds"]
fn battery_of_wheels_and_track() {
    for seed in 0..3 {
        let c = Case::new("wheel.radius_scale", seed, 0.02);
        let r = c.machine.vehicle.wheel_radius_m;
        let rim = |c: &Case, k: usize| 0.5 * r * (c.trace.wheel_rad_s[0][k] + c.trace.wheel_rad_s[1][k]);
        near(ratio(c.rows().map(|k| (rim(&c, k), c.v(k)))) - 1.0, c.label["relative"], 1e-6);

        let c = Case::new("wheel.radius_mismatch", seed, 0.02);
        let b = c.machine.vehicle.half_track_m;
        let [left, right] = [(0, -1.0), (1, 1.0)]
            .map(|(i, side)| ratio(c.rows().map(|k| (c.trace.wheel_rad_s[i][k], c.v(k) + side * b * c.w(k)))));
        near(right / left - 1.0, c.label["right_over_left_minus_one"], 1e-6);
        near(0.5 * (left + right), c.machine.vehicle.wheel_radius_m, 1e-9);

        for (id, wheel) in [("wheel.radius_left", 0), ("wheel.radius_right", 1)] {
            let c = Case::new(id, seed, 0.02);
            let b = c.machine.vehicle.half_track_m;
            let [left, right] = [(0, -1.0), (1, 1.0)]
                .map(|(i, side)| ratio(c.rows().map(|k| (c.trace.wheel_rad_s[i][k], c.v(k) + side * b * c.w(k)))));
            let (own, other) = if wheel == 0 { (left, right) } else { (right, left) };
            near(own / c.machine.vehicle.wheel_radius_m - 1.0, c.label["relative"], 1e-6);
            near(other, c.machine.vehicle.wheel_radius_m, 1e-9);
        }

        let c = Case::new("vehicle.track_width", seed, 0.03);
        let (r, b) = (c.machine.vehicle.wheel_radius_m, c.machine.vehicle.half_track_m);
        let across = |k: usize| 0.5 * r * (c.trace.wheel_rad_s[1][k] - c.trace.wheel_rad_s[0][k]);
        near(ratio(c.rows().map(|k| (c.w(k), across(k)))) / b - 1.0, c.label["relative"], 1e-6);

        // wheels that drive turn faster than they roll, wheels that brake slower
        let c = Case::new("wheel.slip", seed, 0.05);
        let ahead = ratio(c.rows().map(|k| (c.middle(k)[2] * c.v(k).abs(), rim(&c, k) - c.v(k))));
        assert!(ahead > 0.0 && c.label.is_empty(), "{ahead}");
    }
}

#[test]
fn stiff_grip_is_rolling() {
    let (machine, run) = robot(1, 40.0);
    let rolling = drive(&machine, &run, &World::nominal(), 0.0);
    for seed in 0..6 {
        let effect = effect("wheel.slip", &machine, seed);
        let (_, trace) = driven(&machine, &run, &effect, 1e-5, 0.0);
        let worst = rolling.wheel_rad_s.iter().flatten().zip(trace.wheel_rad_s.iter().flatten());
        let worst = worst.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 5e-3, "{worst} rad/s");
    }
}

#[test]
fn of_forces() {
    for seed in 0..3 {
        let c = Case::new("vehicle.payload", seed, 0.2);
        let v = &c.machine.vehicle;
        let mass = ratio(c.rows().map(|k| (c.middle(k)[2], c.torques(k).iter().sum::<f64>() / v.wheel_radius_m)));
        let found = (mass - 2.0 * v.wheel_inertia_kg_m2 / v.wheel_radius_m.powi(2)) / v.mass_kg - 1.0;
        near(found, c.label["mass_relative"], 1e-3);

        let c = Case::new("motor.torque_gain", seed, 0.1);
        let v = &c.machine.vehicle;
        let (r, b) = (v.wheel_radius_m, v.half_track_m);
        let wheel = 2.0 * v.wheel_inertia_kg_m2 / (r * r);
        let (mass, yaw) = (v.mass_kg + wheel, v.yaw_inertia_kg_m2 + wheel * b * b);
        let [left, right] = [(0, -1.0), (1, 1.0)].map(|(i, side)| {
            ratio(c.rows().map(|k| {
                let [.., dv, dw] = c.middle(k);
                let friction = c.trace.torque_n_m[i][k] - c.torques(k)[i];
                (c.trace.torque_n_m[i][k], 0.5 * r * (mass * dv + side * yaw * dw / b) + friction)
            }))
        });
        near(right / left - 1.0, c.label["right_over_left_minus_one"], 1e-3);

        // Stribeck's part and the rise with speed bend it by some tenths where it is slow
        let c = Case::new("wheel.rolling_resistance", seed, 0.01);
        let b = c.machine.vehicle.half_track_m;
        let rolls = |k: &usize| c.v(*k).abs() > b * c.w(*k).abs() + 0.15;
        let found = ratio(c.rows().filter(rolls).map(|k| (c.v(k).signum(), -c.missing(k))));
        near(found, c.label["coefficient"], 0.12);

        // the load shifts by some percent under acceleration
        let c = Case::new("vehicle.com_offset", seed, 0.05);
        let found = ratio(c.rows().map(|k| (c.middle(k)[1].powi(2), GRAVITY_M_S2 * c.missing(k))));
        near(found, c.label["offset_m"], 0.06);

        // waves of the floor are 12 % deep at most
        let c = Case::new("ground.slope", seed, 0.01);
        let heading: Vec<f64> = c
            .trace
            .w_rad_s
            .iter()
            .scan(0.0, |h, w| {
                *h += w * c.machine.step_s;
                Some(*h)
            })
            .collect();
        let sums = c.rows().fold([0.0; 5], |s, k| {
            let (sin, cos) = heading[k].sin_cos();
            let m = -c.missing(k);
            [s[0] + cos * cos, s[1] + sin * cos, s[2] + sin * sin, s[3] + m * cos, s[4] + m * sin]
        });
        let det = sums[0] * sums[2] - sums[1] * sums[1];
        let (a, b) = ((sums[3] * sums[2] - sums[4] * sums[1]) / det, (sums[0] * sums[4] - sums[1] * sums[3]) / det);
        near(a.hypot(b), c.label["slope_rad"], 0.13);
        let turn = (b.atan2(a) - c.label["uphill_heading_rad"]).sin().abs();
        assert!(turn < 0.15 && a * c.label["uphill_heading_rad"].cos() + b * c.label["uphill_heading_rad"].sin() > 0.0);
    }
}

#[test]
fn of_sensors() {
    for seed in 0..3 {
        let c = Case::new("gyro.scale_factor", seed, 0.01);
        near(ratio(c.rows().map(|k| (c.w(k), c.trace.gyro_rad_s[k]))) - 1.0, c.label["relative"], 1e-6);

        let c = Case::new("gyro.scale_asymmetry", seed, 0.02);
        let side =
            |sign: f64| ratio(c.rows().filter(|k| sign * c.w(*k) > 0.25).map(|k| (c.w(k), c.trace.gyro_rad_s[k])));
        near(side(1.0) - side(-1.0), c.label["relative"], 0.05);

        // the response lags by up to half a second
        let c = Case::new("gyro.vibration_rectification", seed, 0.005);
        let name = "coefficient_rad_s_per_m2_s2";
        near(ratio(c.rows().map(|k| (c.v(k).powi(2), c.trace.gyro_rad_s[k] - c.w(k)))), c.label[name], 0.15);

        let c = Case::new("sensor.gyro_delay", seed, 0.004);
        let rate = |k: usize| (c.w(k + 1) - c.w(k - 1)) / (2.0 * c.machine.step_s);
        near(ratio(c.rows().map(|k| (rate(k), c.w(k) - c.trace.gyro_rad_s[k]))), c.label["delay_s"], 0.1);

        let c = Case::new("sensor.wheel_delay", seed, 0.03);
        let (r, b) = (c.machine.vehicle.wheel_radius_m, c.machine.vehicle.half_track_m);
        let late = |k: usize| 0.5 * r / b * (c.trace.wheel_rad_s[1][k] - c.trace.wheel_rad_s[0][k]);
        let rate = |k: usize| (c.w(k + 1) - c.w(k - 1)) / (2.0 * c.machine.step_s);
        // where the rate changes evenly a delay is the difference over the rate's rate; else it is less by the bend
        near(ratio(c.rows().map(|k| (rate(k), c.w(k) - late(k)))), c.label["delay_s"], 0.3);

        let c = Case::new("sensor.pose_delay", seed, 0.1);
        let mut turned = 0.0;
        let pairs: Vec<(f64, f64)> = c
            .rows()
            .filter_map(|k| {
                turned += 0.5 * c.machine.step_s * (c.w(k - 1) + c.w(k));
                let heading = c.trace.pose[2][k];
                (!heading.is_nan()).then_some((c.w(k), turned - heading))
            })
            .collect();
        near(ratio(pairs.into_iter()), c.label["delay_s"], 0.15);

        let c = Case::new("gyro.bias_step", seed, 0.002);
        let path = &c.world.gyro.path_rad_s;
        near(path[path.len() - 1] - path[0], c.label["step_rad_s"], 0.05);

        let c = Case::new("encoder.quantization", seed, 0.1);
        let (lsb, readings) = (c.label["lsb_rad_s"], &c.trace.wheel_rad_s[0]);
        let off = |v: &f64| ((v - readings[0]) / lsb).round() * lsb - (v - readings[0]);
        assert!(readings.iter().all(|v| off(v).abs() < 1e-9));

        let c = Case::new("encoder.missed_ticks", seed, 0.1);
        let (r, b) = (c.machine.vehicle.wheel_radius_m, c.machine.vehicle.half_track_m);
        let (wheel, bursts) = c.world.encoders.missed.clone().unwrap();
        let lost: Vec<f64> = c
            .rows()
            .filter_map(|k| {
                let speed = (c.v(k) + [-1.0, 1.0][wheel] * b * c.w(k)) / r;
                let share = 1.0 - c.trace.wheel_rad_s[wheel][k] / speed;
                (speed.abs() > 0.5 && share.abs() > 1e-6).then_some(share)
            })
            .collect();
        assert!(lost.len() > 50 && bursts.len() > 2);
        // bursts differ by a quarter at most
        near(lost.iter().sum::<f64>() / lost.len() as f64, c.label["loss_fraction"], 0.25);
        assert!(c.rows().all(|k| {
            let speed = (c.v(k) + [1.0, -1.0][wheel] * b * c.w(k)) / r;
            (c.trace.wheel_rad_s[1 - wheel][k] - speed).abs() < 1e-9
        }));
    }
}

#[test]
fn of_skid() {
    for seed in 0..3 {
        let c = Case::new("wheel.lateral_skid", seed, 0.05);
        let (rows, dt) = (c.machine.pose_rows, c.machine.step_s);
        let pairs = (0..c.trace.v_m_s.len() / rows - 1).map(|i| {
            let (k, next) = (i * rows, (i + 1) * rows);
            let at = |p: usize, k: usize| c.trace.pose[p][k];
            let (sin, cos) = (0.5 * (at(2, k) + at(2, next))).sin_cos();
            let sideways = (at(1, next) - at(1, k)) * cos - (at(0, next) - at(0, k)) * sin;
            let turns = (k..next).map(|k| c.v(k) * c.w(k)).sum::<f64>() / rows as f64;
            (turns, -sideways / (rows as f64 * dt))
        });
        // it lags by up to 0.4 s, which takes some of it in weaves
        near(ratio(pairs), c.label["lateral_slip_s"], 0.2);
    }
}
