//! p_k ≈ t + R(θ₀) d_k,  d: dead reckoning of the nominal robot from its start:   θ̂₀ = arg Σ (p_k - p̄)* (d_k - d̄)
//!
//! A reference that knows positions alone, as GPS does, does not tell the initial heading. The first part of the path
//! does: dead reckoning is fitted to the positions. The heading stands in the record as one reading at the first
//! position, with a wide standard deviation: positions tell the filter the rest.

use crate::gap::drive::record::Record;
use crate::gap::drive::record::reckoning::reckoned;

/// Distance from the start, in standard deviations of a position, from which on the heading is estimated. It is then
/// known to a fraction of a tenth of a radian, and dead reckoning has not yet drifted.
const AWAY: f64 = 40.0;
/// Fewest positions on that path.
const FEWEST: usize = 12;
/// Factor on the fitted standard deviation of the heading: the filter reads the same positions again.
const WIDER: f64 = 3.0;

/// `record` with a heading at the first position of each drive that has positions and no heading, and the largest
/// standard deviation of these, rad; none where no drive lacks one. Drives that hardly move are left without.
pub(crate) fn told(record: &Record) -> Option<(Record, f64)> {
    let lacks = |r: &Record| {
        r.pose
            .as_ref()
            .is_some_and(|[x, _, heading]| heading.iter().all(|h| !h.is_finite()) && x.iter().any(|x| x.is_finite()))
    };
    if !record.apart().any(|drive| lacks(&drive)) {
        return None;
    }
    let mut widest: f64 = 0.0;
    let out = record.by_drive(|_, drive| {
        let mut out = drive.clone();
        if let Some((row, heading_rad, std_rad)) = lacks(drive).then(|| of(drive)).flatten() {
            widest = widest.max(std_rad);
            out.pose.iter_mut().for_each(|pose| pose[2][row] = heading_rad);
        }
        out
    });
    (widest > 0.0).then_some((out, widest))
}

/// First row with a position, the heading there and its standard deviation, rad; none where the positions do not tell
/// it.
fn of(drive: &Record) -> Option<(usize, f64, f64)> {
    let [x, y, _] = drive.pose.as_ref()?;
    let first = (0..drive.len()).find(|k| x[*k].is_finite() && y[*k].is_finite())?;
    let away_m = AWAY * drive.belief.position_std_m;
    let mut pairs: Vec<[f64; 4]> = Vec::new();
    for (k, believed) in (first..).zip(reckoned(drive, first)) {
        if x[k].is_finite() && y[k].is_finite() {
            pairs.push([believed[0], believed[1], x[k], y[k]]);
            if pairs.len() >= FEWEST && (x[k] - x[first]).hypot(y[k] - y[first]) > away_m {
                break;
            }
        }
    }
    let n = pairs.len() as f64;
    let mean: [f64; 4] = std::array::from_fn(|i| pairs.iter().map(|p| p[i]).sum::<f64>() / n);
    let [mut along, mut across, mut square, mut away] = [0.0; 4];
    for p in &pairs {
        let [dx, dy, px, py] = std::array::from_fn(|i| p[i] - mean[i]);
        along += dx * px + dy * py;
        across += dx * py - dy * px;
        square += dx * dx + dy * dy;
        away += px * px + py * py;
    }
    if pairs.len() < FEWEST || square.sqrt() <= drive.belief.position_std_m * n.sqrt() {
        return None;
    }
    let heading_rad = across.atan2(along);
    // residual of the fit by rotation and scale
    let misfit = ((away - along.hypot(across).powi(2) / square).max(0.0) / n).sqrt();
    let std_rad = WIDER * drive.belief.position_std_m.max(misfit) / square.sqrt();
    Some((first, heading_rad, std_rad))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gap::drive::preprocess::acceleration_model::tests::{belief, recorded};
    use crate::math::random::Stream;

    /// A circle driven from a heading of two radians, positions with noise.
    #[test]
    fn the_heading_at_the_start_is_what_lays_the_way_on_the_positions() {
        let (v, rate, step_s, start) = (0.6, 0.4, 0.02, 2.0_f64);
        let wheels = belief().robot.wheels_rad_s(v, rate).map(|w| vec![w; 1000]);
        let mut record = recorded(belief(), step_s, wheels, vec![rate; 1000]);
        let draw = &mut Stream::new(5, 1);
        let std = record.belief.position_std_m;
        let mut at = |k: usize| {
            let turned = rate * step_s * k as f64;
            let radius = v / rate;
            let x = radius * ((start + turned).sin() - start.sin());
            let y = -radius * ((start + turned).cos() - start.cos());
            if k % 10 == 3 { [x + std * draw.normal(), y + std * draw.normal()] } else { [f64::NAN; 2] }
        };
        let places: Vec<[f64; 2]> = (0..1000).map(&mut at).collect();
        record.pose =
            Some([places.iter().map(|p| p[0]).collect(), places.iter().map(|p| p[1]).collect(), vec![f64::NAN; 1000]]);
        let (with, wide) = told(&record).unwrap();
        let headings = &with.pose.as_ref().unwrap()[2];
        assert_eq!(headings.iter().filter(|h| h.is_finite()).count(), 1);
        // at the first position, three rows after the start; the width is three standard deviations
        let off = headings[3] - (start + 3.0 * step_s * rate);
        assert!(off.abs() < 5.0 * wide / WIDER && wide < 0.2, "{off} {wide}");
        assert!(told(&with).is_none());
        // one that stands still does not tell
        let still = recorded(belief(), step_s, [vec![0.0; 1000], vec![0.0; 1000]], vec![0.0; 1000]);
        let noise: [Vec<f64>; 2] = std::array::from_fn(|_| (0..1000).map(|_| std * draw.normal()).collect());
        let [x, y] = noise;
        assert!(told(&Record { pose: Some([x, y, vec![f64::NAN; 1000]]), ..still }).is_none());
    }
}
