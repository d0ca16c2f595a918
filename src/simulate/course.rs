//! Courses: speed and yaw rate over time, made of pieces of constant acceleration.
//!
//! `umbmark` is the bidirectional square of Borenstein and Feng, "Measurement and correction of systematic odometry
//! errors in mobile robots", IEEE Trans. Robotics and Automation 12 (1996) 869: 4 m sides, five laps each way.

use super::Purpose;
use std::f64::consts::{PI, TAU};

/// A course to follow; it repeats until the drive ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Course {
    /// Squares of 2 m, counter-clockwise, turning on the spot.
    Square,
    /// The same clockwise.
    SquareClockwise,
    /// Two loops of 1 m radius, left and right.
    FigureEight,
    /// Five squares of 4 m clockwise, five counter-clockwise.
    Umbmark,
    /// Speeds and yaw rates drawn at random (stream of `Seeds::motion`).
    Random,
    /// The same driven hard: 2 m/s² and 5 rad/s², up to 1.2 m/s and 1.5 rad/s, a stop now and then. Slips on snow.
    Brisk,
}

impl Course {
    /// All courses.
    pub const ALL: [Self; 6] =
        [Self::Square, Self::SquareClockwise, Self::FigureEight, Self::Umbmark, Self::Random, Self::Brisk];

    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Square => "square",
            Self::SquareClockwise => "square_clockwise",
            Self::FigureEight => "figure_eight",
            Self::Umbmark => "umbmark",
            Self::Random => "random",
            Self::Brisk => "brisk",
        }
    }

    /// The course of this name.
    #[must_use]
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|c| c.name() == name)
    }

    /// Speed and yaw rate for at least `duration_s`.
    pub(super) fn profile(self, duration_s: f64, seed: u64) -> Profile {
        let mut p = Profile::default();
        p.hold(REST_S);
        match self {
            Self::Square => p.repeat(duration_s, |p| p.square(2.0, 1.0)),
            Self::SquareClockwise => p.repeat(duration_s, |p| p.square(2.0, -1.0)),
            Self::FigureEight => {
                p.ramp(SPEED_M_S / ACCELERATION_M_S2, SPEED_M_S, 0.0);
                p.repeat(duration_s, |p| {
                    p.turn(TAU, SPEED_M_S / LOOP_RADIUS_M);
                    p.turn(-TAU, SPEED_M_S / LOOP_RADIUS_M);
                });
            }
            Self::Umbmark => p.repeat(duration_s, |p| {
                for sense in [-1.0, 1.0] {
                    (0..5).for_each(|_| p.square(4.0, sense));
                    p.hold(REST_S);
                }
            }),
            Self::Random => {
                let mut draw = Purpose::Course.stream(seed);
                p.repeat(duration_s, |p| {
                    let speed = draw.uniform() * 1.6 * SPEED_M_S;
                    let yaw_rate = (2.0 * draw.uniform() - 1.0) * YAW_RATE_RAD_S;
                    p.ramp(0.5 + 1.5 * draw.uniform(), speed, yaw_rate);
                    p.hold(0.5 + 3.5 * draw.uniform());
                });
            }
            Self::Brisk => {
                let mut draw = Purpose::Course.stream(seed);
                p.repeat(duration_s, |p| {
                    let stop = draw.uniform() < 0.25;
                    let speed = if stop { 0.0 } else { draw.uniform() * BRISK_SPEED_M_S };
                    let yaw_rate = if stop { 0.0 } else { (2.0 * draw.uniform() - 1.0) * BRISK_YAW_RATE_RAD_S };
                    let now = p.last();
                    let by_speed = (speed - now.speed_m_s).abs() / BRISK_ACCELERATION_M_S2;
                    let by_yaw_rate = (yaw_rate - now.yaw_rate_rad_s).abs() / BRISK_YAW_ACCELERATION_RAD_S2;
                    p.ramp(by_speed.max(by_yaw_rate).max(0.1), speed, yaw_rate);
                    p.hold(0.2 + 1.3 * draw.uniform());
                });
            }
        }
        p
    }
}

/// At rest before the robot sets off, s.
const REST_S: f64 = 1.0;
const SPEED_M_S: f64 = 0.5;
const ACCELERATION_M_S2: f64 = 0.5;
const YAW_RATE_RAD_S: f64 = 1.0;
const YAW_ACCELERATION_RAD_S2: f64 = 2.0;
const LOOP_RADIUS_M: f64 = 1.0;
const BRISK_SPEED_M_S: f64 = 1.2;
const BRISK_ACCELERATION_M_S2: f64 = 2.0;
const BRISK_YAW_RATE_RAD_S: f64 = 1.5;
const BRISK_YAW_ACCELERATION_RAD_S2: f64 = 5.0;

/// Speed and yaw rate, linear between corners.
#[derive(Debug, Clone, Default)]
pub(crate) struct Profile {
    corners: Vec<Corner>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Corner {
    t_s: f64,
    speed_m_s: f64,
    yaw_rate_rad_s: f64,
}

impl Profile {
    /// Speed (m/s) and yaw rate (rad/s) at `t_s`.
    pub(crate) fn at(&self, t_s: f64) -> [f64; 2] {
        let next = self.corners.partition_point(|c| c.t_s <= t_s);
        let before = if next == 0 { Corner::default() } else { self.corners[next - 1] };
        let Some(after) = self.corners.get(next) else { return [before.speed_m_s, before.yaw_rate_rad_s] };
        let part = (t_s - before.t_s) / (after.t_s - before.t_s);
        [
            before.speed_m_s + part * (after.speed_m_s - before.speed_m_s),
            before.yaw_rate_rad_s + part * (after.yaw_rate_rad_s - before.yaw_rate_rad_s),
        ]
    }

    /// Times (s), speeds (m/s) and yaw rates (rad/s) between which it is linear.
    pub(crate) fn corners(&self) -> impl DoubleEndedIterator<Item = [f64; 3]> + '_ {
        self.corners.iter().map(|c| [c.t_s, c.speed_m_s, c.yaw_rate_rad_s])
    }

    fn last(&self) -> Corner {
        self.corners.last().copied().unwrap_or_default()
    }

    fn repeat(&mut self, duration_s: f64, mut lap: impl FnMut(&mut Self)) {
        while self.last().t_s < duration_s {
            lap(self);
        }
    }

    /// Goes over to this speed (m/s) and yaw rate (rad/s) evenly.
    pub(crate) fn ramp(&mut self, duration_s: f64, speed_m_s: f64, yaw_rate_rad_s: f64) {
        self.corners.push(Corner { t_s: self.last().t_s + duration_s, speed_m_s, yaw_rate_rad_s });
    }

    /// Keeps the last speed and yaw rate.
    pub(crate) fn hold(&mut self, duration_s: f64) {
        let Corner { speed_m_s, yaw_rate_rad_s, .. } = self.last();
        self.ramp(duration_s, speed_m_s, yaw_rate_rad_s);
    }

    /// From rest to rest over `length_m`.
    fn straight(&mut self, length_m: f64) {
        let (rise_s, cruise_s, top) = trapezium(length_m, SPEED_M_S, ACCELERATION_M_S2);
        self.ramp(rise_s, top, 0.0);
        self.hold(cruise_s);
        self.ramp(rise_s, 0.0, 0.0);
    }

    /// A turn at the present speed: yaw rate from zero to zero over `angle_rad`.
    fn turn(&mut self, angle_rad: f64, yaw_rate_rad_s: f64) {
        let (rise_s, cruise_s, top) = trapezium(angle_rad.abs(), yaw_rate_rad_s, YAW_ACCELERATION_RAD_S2);
        let speed = self.last().speed_m_s;
        self.ramp(rise_s, speed, top.copysign(angle_rad));
        self.hold(cruise_s);
        self.ramp(rise_s, speed, 0.0);
    }

    fn square(&mut self, side_m: f64, sense: f64) {
        for _ in 0..4 {
            self.straight(side_m);
            self.turn(sense * PI / 2.0, YAW_RATE_RAD_S);
        }
    }
}

/// Rise time, cruise time and top of a trapezium of area `way` with slope `slope` and at most `top`.
fn trapezium(way: f64, top: f64, slope: f64) -> (f64, f64, f64) {
    let top = top.min((way * slope).sqrt());
    (top / slope, way / top - top / slope, top)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Way and turn of a profile, exact for linear pieces.
    fn integral(p: &Profile, until: impl Fn(&Corner) -> bool) -> [f64; 2] {
        let mut sum = [0.0; 2];
        let mut before = Corner::default();
        for c in p.corners.iter().take_while(|c| until(c)) {
            let h = 0.5 * (c.t_s - before.t_s);
            sum[0] += h * (c.speed_m_s + before.speed_m_s);
            sum[1] += h * (c.yaw_rate_rad_s + before.yaw_rate_rad_s);
            before = *c;
        }
        sum
    }

    #[test]
    fn a_square_has_four_sides_and_one_turn() {
        for (sense, turn) in [(1.0, TAU), (-1.0, -TAU)] {
            let mut p = Profile::default();
            p.square(2.0, sense);
            let [way, angle] = integral(&p, |_| true);
            assert!((way - 8.0).abs() < 1e-12 && (angle - turn).abs() < 1e-12, "{way} {angle}");
        }
    }

    #[test]
    fn a_short_way_never_reaches_the_top() {
        let (rise, cruise, top) = trapezium(0.1, 0.5, 0.5);
        assert!(top < 0.5 && cruise.abs() < 1e-12);
        assert!((top * rise - 0.1).abs() < 1e-12);
    }

    #[test]
    fn umbmark_turns_as_often_one_way_as_the_other() {
        // both runs end before the third begins
        let p = Course::Umbmark.profile(2.0, 0);
        let [way, angle] = integral(&p, |_| true);
        assert!((way - 160.0).abs() < 1e-9 && angle.abs() < 1e-9, "{way} {angle}");
    }

    #[test]
    fn every_course_starts_at_rest_covers_its_duration_and_is_continuous() {
        for course in Course::ALL {
            assert_eq!(Course::parse(course.name()), Some(course));
            let p = course.profile(100.0, 3);
            assert_eq!(p.at(0.0), [0.0, 0.0], "{}", course.name());
            assert!(p.last().t_s >= 100.0);
            let mut before = p.at(0.0);
            for k in 1..10_000 {
                let now = p.at(0.01 * f64::from(k));
                // no course accelerates harder than 2 m/s² or 5 rad/s²
                assert!((now[0] - before[0]).abs() < 0.02 + 1e-9, "{} {k}", course.name());
                assert!((now[1] - before[1]).abs() < 0.05 + 1e-9, "{} {k}", course.name());
                before = now;
            }
        }
    }

    #[test]
    fn the_random_course_follows_its_seed() {
        let speeds = |seed| Course::Random.profile(50.0, seed).at(20.0);
        assert_eq!(speeds(1), speeds(1));
        assert_ne!(speeds(1), speeds(2));
    }
}
