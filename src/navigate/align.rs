//! min over φ, d of Σ |R(φ) pᵢ + d - qᵢ|²:  φ = atan2(Σ p̃ × q̃, Σ p̃ · q̃),  d = q̄ - R(φ) p̄
//!
//! A track p starts at x = y = θ = 0, a reference q of positions has a frame of its own: the first part of the track is
//! laid on the reference by the rotation and shift of least squares (p̃, q̃: less their means p̄, q̄; the plane's case of
//! Arun, Huang and Blostein, "Least-squares fitting of two 3-D point sets", IEEE PAMI 9 (1987) 698), the rest shows how
//! the track drifts away. There is no scale: a wheel radius that is wrong stays an error.

use serde::Serialize;

/// Positions of track and reference at the same time, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pair {
    pub time_s: f64,
    pub track: [f64; 2],
    pub reference: [f64; 2],
}

/// Alignment of a track with the reference: reference = R(rotation) track + shift.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Alignment {
    /// Rotation, counter-clockwise, rad.
    pub rotation_rad: f64,
    /// Shift after it, m.
    pub x_m: f64,
    /// Shift after it, m.
    pub y_m: f64,
    /// Share of the reference's path that was used, from its beginning.
    pub path_share: f64,
    /// Its length, m.
    pub path_m: f64,
    /// Its last time, s on the log's clock.
    pub until_s: f64,
    /// Reference positions in it.
    pub samples: u64,
    /// Root mean square distance in it after the alignment, m.
    pub rms_m: f64,
}

impl Alignment {
    /// Default share of the path: a fifth. On a shorter part the rotation follows the reference's noise; a longer one
    /// absorbs drift that should show.
    pub const DEFAULT_SHARE: f64 = 0.2;

    /// A position of the track in the reference's frame.
    #[must_use]
    pub fn apply(&self, position_m: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.rotation_rad.sin_cos();
        let [x, y] = position_m;
        [cos * x - sin * y + self.x_m, sin * x + cos * y + self.y_m]
    }

    /// Alignment of pairs (track, reference); `None` if the track does not spread.
    fn of(pairs: &[Pair]) -> Option<Self> {
        let n = pairs.len() as f64;
        let mean = |of: fn(&Pair) -> [f64; 2]| {
            let sum = pairs.iter().map(of).fold([0.0; 2], |s, p| [s[0] + p[0], s[1] + p[1]]);
            sum.map(|s| s / n)
        };
        let (p0, q0) = (mean(|pair| pair.track), mean(|pair| pair.reference));
        let (mut dot, mut cross) = (0.0, 0.0);
        for Pair { track: p, reference: q, .. } in pairs {
            let (p, q) = ([p[0] - p0[0], p[1] - p0[1]], [q[0] - q0[0], q[1] - q0[1]]);
            dot += p[0] * q[0] + p[1] * q[1];
            cross += p[0] * q[1] - p[1] * q[0];
        }
        if !(dot.hypot(cross) > 0.0) {
            return None;
        }
        let mut out = Self {
            rotation_rad: cross.atan2(dot),
            x_m: 0.0,
            y_m: 0.0,
            path_share: 1.0,
            path_m: 0.0,
            until_s: f64::NAN,
            samples: pairs.len() as u64,
            rms_m: 0.0,
        };
        let turned = out.apply(p0);
        [out.x_m, out.y_m] = [q0[0] - turned[0], q0[1] - turned[1]];
        out.rms_m = out.rms_of(pairs);
        Some(out)
    }

    fn rms_of(&self, pairs: &[Pair]) -> f64 {
        let square = |pair: &Pair| {
            let p = self.apply(pair.track);
            (p[0] - pair.reference[0]).powi(2) + (p[1] - pair.reference[1]).powi(2)
        };
        (pairs.iter().map(square).sum::<f64>() / pairs.len() as f64).sqrt()
    }

    /// Aligns the first `share` of the path with the reference. Steps of the reference below `still_m` do not count as
    /// path, so that the noise of a robot at rest adds none.
    pub(super) fn of_first_part(pairs: &[Pair], share: f64, still_m: f64) -> Option<Self> {
        let mut from = pairs.first()?.reference;
        let mut gone_m = Vec::with_capacity(pairs.len());
        let mut path_m = 0.0;
        for Pair { reference, .. } in pairs {
            let step = (reference[0] - from[0]).hypot(reference[1] - from[1]);
            if step > still_m {
                (path_m, from) = (path_m + step, *reference);
            }
            gone_m.push(path_m);
        }
        if path_m == 0.0 {
            return None;
        }
        // rounding must not take the last place off a share of one
        let part = &pairs[..gone_m.partition_point(|gone| *gone <= share * path_m * (1.0 + 1e-12))];
        let mut out = Self::of(part)?;
        let (last, gone) = (part.last()?, gone_m[part.len() - 1]);
        (out.path_share, out.path_m, out.until_s) = (gone / path_m, gone, last.time_s);
        Some(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    #[test]
    fn the_noise_of_a_robot_that_stands_is_no_way() {
        let mut draw = Stream::new(4, 0);
        // stands for 100 s, then drives 100 m
        let pairs: Vec<_> = (0..200)
            .map(|k| {
                let x = f64::from((k - 100).max(0));
                pair(k, [x, 0.0], [x + 0.1 * draw.normal(), 0.1 * draw.normal()])
            })
            .collect();
        let found = Alignment::of_first_part(&pairs, 0.2, 0.5).unwrap();
        // a step of 1 m either side of a fifth, and the noise of the two ends
        assert!((found.until_s - 120.0).abs() <= 2.0, "{found:?}");
        assert!((found.path_m - 20.0).abs() < 2.0, "{found:?}");
        let whole = Alignment::of_first_part(&pairs, 1.0, 0.5).unwrap();
        assert_eq!((whole.samples, whole.path_share), (200, 1.0));
    }

    fn pair(k: i32, track: [f64; 2], reference: [f64; 2]) -> Pair {
        Pair { time_s: f64::from(k), track, reference }
    }

    #[test]
    fn a_turned_and_shifted_track_is_laid_back() {
        let (sin, cos) = 2.5f64.sin_cos();
        let pairs: Vec<_> = (0..50)
            .map(|k| {
                let a = 0.1 * f64::from(k);
                let [x, y] = [3.0 * a.cos(), 2.0 * a.sin() + 0.2 * a];
                pair(k, [x, y], [cos * x - sin * y + 10.0, sin * x + cos * y - 3.0])
            })
            .collect();
        let found = Alignment::of(&pairs).unwrap();
        assert!((found.rotation_rad - 2.5).abs() < 1e-13 && found.rms_m < 1e-13, "{found:?}");
        assert!((found.x_m - 10.0).abs() < 1e-12 && (found.y_m + 3.0).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn no_other_rotation_or_shift_is_better_under_noise() {
        let mut draw = Stream::new(2, 0);
        let pairs: Vec<_> = (0..40)
            .map(|k| {
                let p = [0.3 * f64::from(k), (0.2 * f64::from(k)).sin()];
                pair(k, p, [-p[1] + draw.normal(), p[0] + draw.normal()])
            })
            .collect();
        let best = Alignment::of(&pairs).unwrap();
        let centre = pairs.iter().fold([0.0; 2], |s, p| [s[0] + p.track[0] / 40.0, s[1] + p.track[1] / 40.0]);
        for (turn, x, y) in [(1e-3, 0.0, 0.0), (-1e-3, 0.0, 0.0), (0.0, 1e-3, 0.0), (0.0, 0.0, -1e-3)] {
            // turned about the centre of the track, so that it is not shifted too
            let mut other = Alignment { rotation_rad: best.rotation_rad + turn, ..best };
            let (was, is) = (best.apply(centre), other.apply(centre));
            other.x_m += was[0] - is[0] + x;
            other.y_m += was[1] - is[1] + y;
            assert!(other.rms_of(&pairs) > best.rms_m);
        }
    }
}
