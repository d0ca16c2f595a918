//! gyro = e(t) + Σ effects + white noise, e(t) = c1 (1 - exp(-t/T)) + c2; temperature and supply of the same hours
//!
//! The nominal simulator of a unit, and one power-on of it: its warm-up inside the stated repeatability, its temperature
//! (self-heating of a body with a shell, a room that wanders, a door) and its supply (a battery that empties, a regulator,
//! loads that switch).

use super::draw::{between, chance, exponential, log_between, rounded, sign};
use crate::config::{Config, Gyro, Kind, SCHEMA};
use crate::math::random::Stream;

/// Nominal parameters of a unit, and the true behaviour of the unit and its surroundings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unit {
    pub step_s: f64,
    pub c1_rad_s: f64,
    pub c2_rad_s: f64,
    pub time_constant_s: f64,
    pub angle_random_walk_rad_sqrt_s: f64,
    pub turn_on_std_rad_s: f64,
    pub relative_std: f64,
    self_heating_c: f64,
    heating_s: f64,
    shell_s: f64,
    thermometer_std_c: f64,
    thermometer_lattice_c: f64,
    pub supply_v: f64,
    pub supply_sag_v: f64,
    pub load_step_v: f64,
    load_dwell_s: f64,
    voltmeter_std_v: f64,
}

impl Unit {
    pub(crate) fn draw(s: &mut Stream) -> Self {
        let step_s = match s.uniform() {
            u if u < 0.32 => 0.1,
            u if u < 0.62 => 0.125,
            u if u < 0.94 => 0.2,
            _ => 0.05,
        };
        let time_constant_s = rounded(log_between(s, 150.0, 1000.0), 4);
        // a body that heated with T itself would make temperature and warm-up the same thing
        let factor = if chance(s, 0.5) { between(s, 0.35, 0.7) } else { between(s, 1.5, 3.0) };
        Self {
            step_s,
            c1_rad_s: rounded(log_between(s, 5e-4, 5e-3) * sign(s), 4),
            c2_rad_s: rounded(between(s, -5e-3, 5e-3), 4),
            time_constant_s,
            angle_random_walk_rad_sqrt_s: rounded(log_between(s, 6e-5, 6e-4), 3),
            turn_on_std_rad_s: rounded(between(s, 1e-4, 5e-4), 2),
            relative_std: if chance(s, 0.7) { 0.03 } else { rounded(between(s, 0.02, 0.05), 2) },
            self_heating_c: between(s, 7.0, 13.0),
            heating_s: time_constant_s * factor,
            shell_s: between(s, 5.0, 40.0),
            thermometer_std_c: between(s, 0.01, 0.03),
            thermometer_lattice_c: [0.01, 0.02, 0.03125, 0.0625][crate::bench::worlds::draw::index(s, 4)],
            supply_v: between(s, 4.95, 5.12),
            supply_sag_v: between(s, 0.02, 0.07),
            load_step_v: between(s, 0.008, 0.025),
            load_dwell_s: log_between(s, 100.0, 700.0),
            voltmeter_std_v: between(s, 0.001, 0.002),
        }
    }

    /// The same unit, sampled otherwise.
    pub(crate) fn sampled(self, step_s: f64) -> Self {
        Self { step_s, ..self }
    }

    /// The same unit without a warm-up, or one that the team knows nothing of.
    pub(crate) fn without_warm_up(self) -> Self {
        Self { c1_rad_s: 0.0, ..self }
    }

    /// Time constant with which its body heats, s.
    pub(crate) fn heating_s(&self) -> f64 {
        self.heating_s
    }

    /// Standard deviation of a sample's white noise, rad/s.
    pub(crate) fn white_std_rad_s(&self) -> f64 {
        self.angle_random_walk_rad_sqrt_s / self.step_s.sqrt()
    }

    /// The nominal simulator's file.
    pub(crate) fn config(&self) -> Config {
        Config {
            schema: SCHEMA,
            kind: Kind::Stationary,
            sample_time_s: Some(self.step_s),
            gyro: Some(Gyro {
                c1_rad_s: self.c1_rad_s,
                c2_rad_s: self.c2_rad_s,
                angle_random_walk_rad_sqrt_s: self.angle_random_walk_rad_sqrt_s,
                turn_on_bias_std_rad_s: Some(self.turn_on_std_rad_s),
                warm_up_relative_std: Some(self.relative_std),
                ..Gyro::without_error(self.time_constant_s)
            }),
            vehicle: None,
            traction: None,
            encoder: None,
            pose: None,
            effects: Vec::new(),
            custom_effects: Vec::new(),
            validation: None,
            provenance: None,
        }
    }
}

/// One power-on of a unit.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Run {
    pub unit: Unit,
    pub len: usize,
    /// Drawn inside the stated repeatability.
    pub c1_rad_s: f64,
    pub c2_rad_s: f64,
    pub time_constant_s: f64,
    /// The sensor's temperature itself, °C; a thermometer's reading of it is in the log.
    pub temperature_c: Vec<f64>,
    /// The supply itself, V.
    pub supply_v: Vec<f64>,
}

impl Run {
    pub(crate) fn draw(unit: &Unit, s: &mut Stream) -> Self {
        let len = (between(s, 7300.0, 8700.0) / unit.step_s) as usize;
        let c1_rad_s = unit.c1_rad_s * (1.0 + unit.relative_std * s.normal());
        let c2_rad_s = unit.c2_rad_s + unit.turn_on_std_rad_s * s.normal();
        let time_constant_s = unit.time_constant_s * (1.0 + unit.relative_std * s.normal()).max(0.5);
        let temperature_c = temperature(unit, len, s);
        let supply_v = supply(unit, len, s);
        Self { unit: *unit, len, c1_rad_s, c2_rad_s, time_constant_s, temperature_c, supply_v }
    }

    pub(crate) fn step_s(&self) -> f64 {
        self.unit.step_s
    }

    pub(crate) fn time_s(&self, row: usize) -> f64 {
        row as f64 * self.unit.step_s
    }

    pub(crate) fn times_s(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.len).map(|row| self.time_s(row))
    }

    pub(crate) fn span_s(&self) -> f64 {
        self.len as f64 * self.unit.step_s
    }

    pub(crate) fn warm_up_rad_s(&self, t_s: f64) -> f64 {
        self.c1_rad_s * -(-t_s / self.time_constant_s).exp_m1() + self.c2_rad_s
    }

    /// Temperature since power-on, °C.
    pub(crate) fn warming_c(&self) -> Vec<f64> {
        let first = self.temperature_c.first().copied().unwrap_or(0.0);
        self.temperature_c.iter().map(|c| c - first).collect()
    }

    /// Readings of the thermometer with its noise and quantization, °C.
    pub(crate) fn thermometer_c(&self, s: &mut Stream) -> Vec<f64> {
        let lattice = self.unit.thermometer_lattice_c;
        let read = |c: &f64| ((c + self.unit.thermometer_std_c * s.normal()) / lattice).round() * lattice;
        self.temperature_c.iter().map(read).collect()
    }

    /// Readings of the voltmeter with its noise, V.
    pub(crate) fn voltmeter_v(&self, s: &mut Stream) -> Vec<f64> {
        self.supply_v.iter().map(|v| v + self.unit.voltmeter_std_v * s.normal()).collect()
    }
}

/// Seconds between the nodes of the room's temperature.
const ROOM_STEP_S: f64 = 2.0;

fn temperature(unit: &Unit, len: usize, s: &mut Stream) -> Vec<f64> {
    let span_s = len as f64 * unit.step_s;
    let start_c = between(s, 18.0, 28.0);
    let heating_c = unit.self_heating_c * (1.0 + 0.04 * s.normal());
    let (wander_c, wander_s) = (between(s, 0.15, 0.6), log_between(s, 500.0, 2500.0));
    let daily_c = if chance(s, 0.4) { between(s, 0.3, 1.3) } else { 0.0 };
    let (period_s, phase) = (between(s, 3500.0, 9000.0), between(s, 0.0, std::f64::consts::TAU));
    let door_c = if chance(s, 0.35) { between(s, -2.0, 0.7) } else { 0.0 };
    let (door_at_s, door_s) = (between(s, 0.15, 0.85) * span_s, between(s, 150.0, 600.0));

    let nodes = (span_s / ROOM_STEP_S).ceil() as usize + 2;
    let (keep, fresh) = {
        let keep = (-ROOM_STEP_S / wander_s).exp();
        (keep, (1.0 - keep * keep).sqrt())
    };
    let follow = 1.0 - (-ROOM_STEP_S / unit.shell_s).exp();
    let heat_follow = 1.0 - (-ROOM_STEP_S / unit.heating_s).exp();
    let (mut air, mut shell, mut heat) = (0.0, 0.0, 0.0);
    let daily = |t: f64| daily_c * ((std::f64::consts::TAU * t / period_s + phase).sin() - phase.sin());
    let room: Vec<f64> = (0..nodes)
        .map(|i| {
            let t = i as f64 * ROOM_STEP_S;
            let door = if t > door_at_s { door_c * (-(t - door_at_s) / door_s).exp() } else { 0.0 };
            let out = start_c + shell + heat;
            air = keep * air + fresh * wander_c * s.normal();
            // the body follows the room through its shell, and its own heat through its mass
            shell += follow * (air + daily(t) + door - shell);
            heat += heat_follow * (heating_c - heat);
            out
        })
        .collect();
    (0..len)
        .map(|row| {
            let x = row as f64 * unit.step_s / ROOM_STEP_S;
            let (i, part) = (x as usize, x.fract());
            room[i] * (1.0 - part) + room[i + 1] * part
        })
        .collect()
}

fn supply(unit: &Unit, len: usize, s: &mut Stream) -> Vec<f64> {
    let dt = unit.step_s;
    let span_s = len as f64 * dt;
    let start_v = unit.supply_v + 0.01 * s.normal();
    let sag_v = unit.supply_sag_v * (1.0 + 0.1 * s.normal());
    let bend = between(s, 0.6, 1.6);
    let (ripple_v, ripple_s) = (between(s, 0.002, 0.006), log_between(s, 20.0, 90.0));
    let keep = (-dt / ripple_s).exp();
    let fresh = (1.0 - keep * keep).sqrt();
    let settle = 1.0 - (-dt / between(s, 0.5, 3.0)).exp();
    let (mut ripple, mut load, mut settled) = (0.0, 0.0, 0.0);
    let mut next_s = unit.load_dwell_s * exponential(s);
    (0..len)
        .map(|row| {
            let t = row as f64 * dt;
            while t >= next_s {
                load = if load == 0.0 { -unit.load_step_v * between(s, 0.6, 1.4) } else { 0.0 };
                next_s += unit.load_dwell_s * exponential(s);
            }
            settled += settle * (load - settled);
            ripple = keep * ripple + fresh * ripple_v * s.normal();
            start_v - sag_v * (t / span_s).powf(bend) + settled + ripple
        })
        .collect()
}
