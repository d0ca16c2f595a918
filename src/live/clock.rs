//! Stamps against a clock that nobody sets: what a stamp says when it comes
//!
//! The monotonic time of arrival alone counts the age of the gyro: it never jumps, and its jitter does not add up. Stamps tell
//! the spacing of samples, in which the jitter of arrival would be noise. A stamp that disagrees with the arrival by more than
//! [`JUMP_S`] is a jump of the sender's clock; messages that a network held up and lets go at once are none.

/// Stamps and arrivals that drift apart by more than this from one sample to the next tell of a set clock, s.
const JUMP_S: f64 = 1.0;

/// A stamp that goes back by less than this belongs to a message that was overtaken, s.
const OVERTAKEN_S: f64 = 0.1;

/// Longest step between samples that are taken for consecutive, s.
const GAP_S: f64 = 0.25;

/// Weight of a step in the running mean of the steps.
const STEP_WEIGHT: f64 = 0.02;

/// State of a sample's stamp.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Stamped {
    /// It follows the last one.
    #[default]
    Steady,
    /// It is the last one again.
    Repeated,
    /// It lies a little before the last one: the message was overtaken.
    Overtaken,
    /// It follows the last one after a pause.
    Gap,
    /// The sender's clock was set forward.
    JumpedForward,
    /// The sender's clock was set back.
    JumpedBack,
}

/// Follows stamps and arrivals.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clock {
    /// Stamp and arrival of the first sample.
    first: (i64, f64),
    stamp_ns: i64,
    arrival_s: f64,
    /// Running mean of the steps, s.
    step_s: Option<f64>,
}

impl Clock {
    /// Begins with the first sample's stamp and its arrival; `step_s` is the step to expect, where it is known.
    pub(super) fn new(stamp_ns: i64, arrival_s: f64, step_s: Option<f64>) -> Self {
        Self { first: (stamp_ns, arrival_s), stamp_ns, arrival_s, step_s }
    }

    /// Takes in the next sample.
    pub(super) fn look(&mut self, stamp_ns: i64, arrival_s: f64) -> Stamped {
        let arrival_s = arrival_s.max(self.arrival_s);
        let step_s = seconds(stamp_ns, self.stamp_ns);
        let waited_s = arrival_s - self.arrival_s;
        self.arrival_s = arrival_s;
        if step_s == 0.0 {
            return Stamped::Repeated;
        }
        if step_s < 0.0 && step_s > -OVERTAKEN_S {
            return Stamped::Overtaken;
        }
        self.stamp_ns = stamp_ns;
        if step_s < 0.0 {
            return Stamped::JumpedBack;
        }
        if step_s > GAP_S {
            // a message that waited arrives late and lets the next step look short: only what comes early can tell a jump
            return if step_s - waited_s > JUMP_S { Stamped::JumpedForward } else { Stamped::Gap };
        }
        let mean = self.step_s.unwrap_or(step_s);
        self.step_s = Some(mean + STEP_WEIGHT * (step_s - mean));
        Stamped::Steady
    }

    /// Arrival since the first sample, s.
    pub(super) fn elapsed_s(&self) -> f64 {
        self.arrival_s - self.first.1
    }

    /// Stamp since the first sample, s: only differences within steady stamps mean anything.
    pub(super) fn stamp_s(&self) -> f64 {
        seconds(self.stamp_ns, self.first.0)
    }

    pub(super) fn arrival_s(&self) -> f64 {
        self.arrival_s
    }

    pub(super) fn stamp_ns(&self) -> i64 {
        self.stamp_ns
    }

    /// Running mean of the steps, s; `None` until it is known.
    pub(super) fn step_s(&self) -> Option<f64> {
        self.step_s
    }
}

/// From `b` to `a`, s, whatever nonsense they are.
fn seconds(a: i64, b: i64) -> f64 {
    a.checked_sub(b).map_or_else(|| (a as f64 - b as f64) * 1e-9, |ns| ns as f64 * 1e-9)
}

/// How long the gyro was off between two stamps, s; `None` where the clock went back meanwhile.
pub(super) fn off_s(before_ns: i64, after_ns: i64) -> Option<f64> {
    let off = seconds(after_ns, before_ns);
    (off >= 0.0).then_some(off)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    #[test]
    fn every_stamp_is_named() {
        let mut clock = Clock::new(0, 0.0, None);
        let mut now = 0.0;
        let mut look = |stamp: i64, waited: f64| {
            now += waited;
            clock.look(stamp, now)
        };
        assert_eq!(look(5 * MS, 0.005), Stamped::Steady);
        assert_eq!(look(5 * MS, 0.005), Stamped::Repeated);
        assert_eq!(look(3 * MS, 0.0), Stamped::Overtaken);
        assert_eq!(look(10 * MS, 0.0), Stamped::Steady);
        assert_eq!(look(3_000 * MS, 2.99), Stamped::Gap);
        // the same pause in the stamps alone
        assert_eq!(look(6_000 * MS, 0.005), Stamped::JumpedForward);
        assert_eq!(look(1_000 * MS, 0.005), Stamped::JumpedBack);
        assert_eq!(look(1_005 * MS, 0.005), Stamped::Steady);
        // held up for three seconds, then let go at once
        assert_eq!(look(1_010 * MS, 3.0), Stamped::Steady);
        assert_eq!(look(1_015 * MS, 0.0), Stamped::Steady);
        assert_eq!(look(i64::MIN, 0.005), Stamped::JumpedBack);
        assert_eq!(look(i64::MAX, 0.005), Stamped::JumpedForward);
    }

    #[test]
    fn the_clock_may_go_back_while_the_gyro_is_off() {
        assert_eq!(off_s(1_000 * MS, 301_000 * MS), Some(300.0));
        assert_eq!(off_s(1_000 * MS, 0), None);
    }
}
