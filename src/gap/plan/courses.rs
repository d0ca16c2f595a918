//! Courses of drives, each from the speeds and accelerations that the wheels of this robot reach
//!
//! A wheel turns by (v ± b ω)/r: with the fastest wheel W the robot drives straight at W r, turns in place at W r/b, and in a
//! circle of radius ρ it drives at W r/(1 + b/ρ).

use super::worth::Command;
use crate::config::Vehicle;
use crate::error::{Error, ErrorKind, Result};
use crate::math::random::Stream;
use crate::signal::Log;
use crate::simulate::Profile;
use crate::vehicle::{Odometry, Rolling};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Speeds of the wheels are means over this time, s: their noise is no acceleration.
const MEAN_S: f64 = 0.2;
/// Share of the log in which a wheel is slower than the limit.
const SLOWER: f64 = 0.98;
/// A robot whose wheels turn no faster than so many standard deviations of their noise stands.
const STANDS: f64 = 5.0;
/// How long the robot stands where it stops, s.
const STAND_S: f64 = 1.0;
/// Radius of circles over the half track.
const WIDE: f64 = 3.0;
/// Seed of the varied course.
const VARIED: u64 = 20;

/// How fast the wheels of a robot turn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    /// Speed, m/s, driving straight, and change of it, m/s².
    pub speed_m_s: f64,
    pub acceleration_m_s2: f64,
    /// Half track, m.
    pub half_track_m: f64,
}

impl Limits {
    /// Of the robot of `vehicle` as it drives in `log`; `noise_rad_s`: standard deviation of a wheel's speed.
    ///
    /// # Errors
    /// [`ErrorKind::Value`] where it stands all the time.
    pub(super) fn of(vehicle: &Vehicle, log: &Log, tick_rad: Option<f64>, noise_rad_s: f64) -> Result<Self> {
        let robot = Rolling::new(vehicle);
        let odometry = Odometry::of(log, &robot, tick_rad);
        let wheels = odometry.as_ref().and_then(Odometry::wheels).unwrap_or_default();
        let rows = (MEAN_S / log.time.median_step_s()).round().max(1.0) as usize;
        let (mut speeds, mut changes) = (Vec::new(), Vec::new());
        for wheel in wheels {
            let mean = |part: &[f64]| {
                let there: Vec<f64> = part.iter().copied().filter(|v| v.is_finite()).collect();
                there.iter().sum::<f64>() / there.len() as f64
            };
            let means: Vec<f64> = wheel.chunks_exact(rows).map(mean).filter(|m| m.is_finite()).collect();
            changes.extend(means.windows(2).map(|w| (w[1] - w[0]).abs()));
            speeds.extend(means.iter().map(|m| m.abs()));
        }
        let (fastest, change) = (limit(&mut speeds), limit(&mut changes));
        if !(fastest > STANDS * noise_rad_s / (rows as f64).sqrt()) {
            return Err(Error::new(ErrorKind::Value, &log.source, "the wheels stand: it tells no speed to drive at")
                .hint("give a log in which the robot drives as fast as it may"));
        }
        let radius_m = vehicle.wheel_radius_m;
        Ok(Self {
            speed_m_s: fastest * radius_m,
            acceleration_m_s2: change / (rows as f64 * log.time.median_step_s()) * radius_m,
            half_track_m: vehicle.half_track_m,
        })
    }

    /// Yaw rate turning in place, rad/s.
    fn yaw_rate_rad_s(&self) -> f64 {
        self.speed_m_s / self.half_track_m
    }
}

/// The value below which all but a few lie.
fn limit(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(((values.len() as f64 - 1.0) * SLOWER).max(0.0) as usize).copied().unwrap_or(0.0)
}

/// A course as it is driven.
#[derive(Debug, Clone)]
pub(super) struct Track {
    limits: Limits,
    profile: Profile,
    /// Times at which the robot stands on a mark, s.
    pub marks_s: Vec<f64>,
}

impl Track {
    fn new(limits: Limits) -> Self {
        let mut track = Self { limits, profile: Profile::default(), marks_s: Vec::new() };
        track.stand();
        track.on_mark();
        track
    }

    /// Speed, m/s, and yaw rate, rad/s.
    pub(super) fn at(&self, t_s: f64) -> [f64; 2] {
        self.profile.at(t_s)
    }

    pub(super) fn duration_s(&self) -> f64 {
        self.now()[0]
    }

    /// Its end so far: time, s, speed, m/s, and yaw rate, rad/s.
    fn now(&self) -> [f64; 3] {
        self.profile.corners().next_back().unwrap_or_default()
    }

    /// Its corners.
    pub(super) fn commands(&self) -> Vec<Command> {
        let corner = |[t_s, speed_m_s, yaw_rate_rad_s]: [f64; 3]| Command { t_s, speed_m_s, yaw_rate_rad_s };
        let same = |a: &Command, b: &Command| (a.speed_m_s, a.yaw_rate_rad_s) == (b.speed_m_s, b.yaw_rate_rad_s);
        let mut all: Vec<Command> = vec![corner([0.0; 3])];
        for one in self.profile.corners().map(corner) {
            // between two that are the same nothing changes
            if let [.., a, b] = all.as_slice()
                && same(a, b)
                && same(b, &one)
            {
                all.pop();
            }
            all.push(one);
        }
        all
    }

    /// Goes over to this speed and yaw rate in `ramp_s`, and keeps them for `hold_s`.
    fn go(&mut self, [speed_m_s, yaw_rate_rad_s]: [f64; 2], ramp_s: f64, hold_s: f64) {
        self.profile.ramp(ramp_s, speed_m_s, yaw_rate_rad_s);
        self.profile.hold(hold_s);
    }

    /// Shortest time in which wheels go over to this speed and yaw rate, s.
    fn ramp_s(&self, [speed_m_s, yaw_rate_rad_s]: [f64; 2]) -> f64 {
        let [_, speed, yaw_rate] = self.now();
        let by_speed = (speed_m_s - speed).abs();
        let by_turn = (yaw_rate_rad_s - yaw_rate).abs() * self.limits.half_track_m;
        ((by_speed + by_turn) / self.limits.acceleration_m_s2).max(MEAN_S)
    }

    fn stand(&mut self) {
        self.go([0.0; 2], self.ramp_s([0.0; 2]), STAND_S);
    }

    /// From rest to rest with this top speed and yaw rate, until the way (m) or, turning in place, the angle (rad) is `way`.
    fn stretch(&mut self, top: [f64; 2], way: f64) {
        let pace = if top[0] == 0.0 { top[1].abs() } else { top[0].abs() };
        let ramp_s = self.ramp_s(top);
        // both ramps cover half of what the top speed would
        let hold_s = way / pace - ramp_s;
        let share = if hold_s >= 0.0 { 1.0 } else { (way / (pace * ramp_s)).sqrt() };
        self.go(top.map(|v| share * v), share * ramp_s, hold_s.max(0.0));
        self.go([0.0; 2], share * ramp_s, STAND_S);
    }

    fn on_mark(&mut self) {
        self.marks_s.push(self.duration_s() - 0.5 * STAND_S);
    }
}

/// A course of drives.
pub(super) struct Course {
    pub name: &'static str,
    pub how: &'static str,
    /// How marks make a reference of it, in sentences; empty where it passes no place again.
    pub marked: &'static str,
    /// Known load that the robot carries on it, over the mass of the configuration; zero without one.
    load_share: f64,
    /// One lap: 1 and -1 in turns for the way round, full and half of the speed in turns.
    lap: fn(&mut Track, sense: f64, share: f64),
}

/// All of them.
pub(super) const COURSES: [Course; 8] = [
    Course {
        name: "rest",
        how: "Leave the robot standing, its motors and sensors on.",
        marked: "",
        load_share: 0.0,
        lap: |track, _, _| track.stand(),
    },
    Course {
        name: "spins",
        how: "Turn in place by two full turns, then by two the other way, at full and at half of the yaw rate.",
        marked: "Mark its place and its heading: after each spin it stands as at first.",
        load_share: 0.0,
        lap: |track, sense, share| {
            let yaw_rate = share * track.limits.yaw_rate_rad_s();
            track.stretch([0.0, sense * yaw_rate], 2.0 * TAU);
            track.on_mark();
        },
    },
    Course {
        name: "squares",
        how: "Drive a square counter-clockwise, turning in place at its corners, then one clockwise.",
        marked: "Mark the corners of a square and measure its sides: it stops on every corner, turned by a known angle.",
        load_share: 0.0,
        lap: |track, sense, _| {
            for _ in 0..4 {
                let (speed, yaw_rate) = (track.limits.speed_m_s, track.limits.yaw_rate_rad_s());
                track.stretch([speed, 0.0], SIDE_S * speed);
                track.stretch([0.0, 0.5 * sense * yaw_rate], FRAC_PI_2);
                track.on_mark();
            }
        },
    },
    Course {
        name: "circles",
        how: "Drive a full circle to the left and one to the right, first at full and then at half of the speed.",
        marked: "Mark its place and its heading: after each circle it stands as at first.",
        load_share: 0.0,
        lap: |track, sense, share| {
            let speed = share * track.limits.speed_m_s / (1.0 + WIDE.recip());
            let radius_m = WIDE * track.limits.half_track_m;
            track.stretch([speed, sense * speed / radius_m], TAU * radius_m);
            track.on_mark();
        },
    },
    Course {
        name: "speed_steps",
        how: "Drive straight ahead and back again, with hard starts and stops, at full and at half of the speed.",
        marked: "Mark both ends of the way and measure it: it stops on either.",
        load_share: 0.0,
        lap: |track, sense, share| {
            let speed = share * track.limits.speed_m_s;
            track.stretch([sense * speed, 0.0], SIDE_S * track.limits.speed_m_s);
            track.on_mark();
        },
    },
    Course {
        name: "ramp",
        how: "Drive straight ahead, faster and faster over half a minute and slower likewise, then back in the same way.",
        marked: "Mark both ends of the way and measure it: it stops on either.",
        load_share: 0.0,
        lap: |track, sense, _| {
            let speed = sense * track.limits.speed_m_s;
            let ramp_s = track.ramp_s([speed, 0.0]).max(RAMP_S);
            track.go([speed, 0.0], ramp_s, 0.0);
            track.go([0.0; 2], ramp_s, STAND_S);
            track.on_mark();
        },
    },
    Course {
        name: "varied",
        how: "Drive at speeds and yaw rates that change every second or two, both ways round, with a stop now and then.",
        marked: "",
        load_share: 0.0,
        lap: varied,
    },
    Course {
        name: "payload",
        how: "Weigh a load, fix it at the robot's centre of mass, and drive at speeds and yaw rates that change every second or two, \
              both ways round, with a stop now and then.",
        marked: "",
        load_share: LOAD_SHARE,
        lap: varied,
    },
];

/// Length of the sides of a square, and of a way ahead and back, in seconds at full speed.
const SIDE_S: f64 = 4.0;
/// How long a slow ramp takes, s.
const RAMP_S: f64 = 30.0;
/// Share of stops in a varied course.
const STOPS: f64 = 0.2;
/// A load over the mass of the configuration: most robots carry it.
const LOAD_SHARE: f64 = 0.2;
/// Laps after which a course is where it set off: both ways round.
const BACK: usize = 2;

/// Another speed and yaw rate, or a stop.
fn varied(track: &mut Track, _sense: f64, _share: f64) {
    let mut draw = Stream::new(VARIED, track.profile.corners().count() as u64);
    if draw.uniform() < STOPS {
        return track.stand();
    }
    let (speed, turn) = (draw.uniform(), 2.0 * draw.uniform() - 1.0);
    // of the fastest wheel
    let share = 1.0 / (speed + turn.abs()).max(1.0);
    let to = [share * speed * track.limits.speed_m_s, share * turn * track.limits.yaw_rate_rad_s()];
    track.go(to, track.ramp_s(to), STAND_S * (0.5 + draw.uniform()));
}

impl Course {
    /// Known load on a robot of this mass, kg, to two digits; none without one.
    pub(super) fn load_kg(&self, mass_kg: f64) -> Option<f64> {
        let load_kg = self.load_share * mass_kg;
        (load_kg > 0.0).then(|| format!("{load_kg:.1e}").parse().unwrap_or(load_kg))
    }

    /// The course for at least `duration_s`, whole laps.
    pub(super) fn track(&self, limits: Limits, duration_s: f64) -> Track {
        // the same torques move more
        let limits = Limits { acceleration_m_s2: limits.acceleration_m_s2 / (1.0 + self.load_share), ..limits };
        let mut track = Track::new(limits);
        let mut laps: usize = 0;
        while track.duration_s() < duration_s || !laps.is_multiple_of(BACK) {
            let sense = if laps.is_multiple_of(BACK) { 1.0 } else { -1.0 };
            let share = if (laps / BACK).is_multiple_of(2) { 1.0 } else { 0.5 };
            (self.lap)(&mut track, sense, share);
            laps += 1;
        }
        track.stand();
        track
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::{Forcing, Motion, advance};

    const LIMITS: Limits = Limits { speed_m_s: 0.8, acceleration_m_s2: 1.6, half_track_m: 0.2 };

    /// The courses keep to what the wheels reach, begin and end at rest, stand on their marks, and return to the first.
    #[test]
    fn courses_keep_their_limits_and_return_to_their_first_mark() {
        const DT: f64 = 1e-3;
        for course in &COURSES {
            let track = course.track(LIMITS, 100.0);
            assert!(
                track.duration_s() >= 100.0 && track.duration_s() < 260.0,
                "{} {}",
                course.name,
                track.duration_s()
            );
            let mut motion = Motion::default();
            let mut marks = track.marks_s.iter().peekable();
            let mut seen = 0;
            for k in 0..(track.duration_s() / DT) as usize {
                let t = k as f64 * DT;
                if marks.next_if(|m| **m <= t).is_some() {
                    let quarters = motion.heading_rad / FRAC_PI_2;
                    assert!((quarters - quarters.round()).abs() < 1e-3, "{} {t}: {quarters}", course.name);
                    assert!(motion.speed_m_s.abs() < 1e-9 && motion.yaw_rate_rad_s.abs() < 1e-9);
                    seen += 1;
                }
                let ([v, w], [next_v, next_w]) = (track.at(t), track.at(t + DT));
                let wheel = v.abs() + LIMITS.half_track_m * w.abs();
                assert!(wheel < LIMITS.speed_m_s * (1.0 + 1e-9), "{} {t}: {v} {w}", course.name);
                let change = ((next_v - v).abs() + LIMITS.half_track_m * (next_w - w).abs()) / DT;
                assert!(change < LIMITS.acceleration_m_s2 * (1.0 + 1e-6), "{} {t}: {change}", course.name);
                let forcing = Forcing::between([v, w], [next_v, next_w], DT);
                motion = advance(&motion, &forcing, DT);
            }
            assert_eq!(track.at(track.duration_s()), [0.0, 0.0]);
            assert_eq!(seen > 2, !course.marked.is_empty(), "{}: {seen}", course.name);
            let off = motion.x_m.hypot(motion.y_m);
            assert!(course.marked.is_empty() || off < 1e-2, "{}: {off}", course.name);
            let commands = track.commands();
            assert_eq!(commands[0].t_s, 0.0);
            assert!(commands.windows(2).all(|c| c[1].t_s >= c[0].t_s), "{}", course.name);
        }
    }

    #[test]
    fn both_ways_round_are_driven_alike() {
        for name in ["spins", "squares", "circles"] {
            let course = COURSES.iter().find(|c| c.name == name).unwrap();
            let track = course.track(LIMITS, 60.0);
            let sum = |sign: f64| {
                let rates = (0..(track.duration_s() * 100.0) as usize).map(|k| track.at(k as f64 * 0.01)[1]);
                rates.filter(|w| w * sign > 0.0).map(|w| 0.01 * w.abs()).sum::<f64>()
            };
            let [left, right] = [1.0, -1.0].map(sum);
            assert!(left > 0.99 * TAU && (left / right - 1.0).abs() < 1e-2, "{name}: {left} {right}");
        }
    }
}
