//! Whether recordings are of one unit: the gyro's bias before the wheels turn, compared with the stated turn-on bias.

use super::Record;

/// Standard deviations by which a gyro's bias may differ between two runs of one unit.
const OTHER_UNIT: f64 = 4.0;
/// Fewest rows at rest for an estimate of the bias, and number of parts whose means give its scatter.
const AT_REST: usize = 64;
const PARTS: usize = 8;

/// Deviation of the gyro from its model before the wheels turn, rad/s, and its variance: from means over parts of the
/// time, at least that of white noise. None without a gyro or rows at rest. The wheels' yaw rate is subtracted: below
/// their noise torque noise may turn the robot.
fn bias_at_rest(r: &Record) -> Option<(f64, f64)> {
    let (gyro, robot) = (r.gyro_rad_s.as_ref()?, &r.belief.robot);
    let still = |k: &usize| r.wheels_rad_s.iter().all(|w| !(w[*k].abs() > 5.0 * r.belief.wheel_std_rad_s));
    let off = |k: usize| gyro[k] - r.belief.warm_up.error_rad_s(r.since_power_on_s[k]) - r.rolling(k)[1];
    let begin = r.drives().next()?;
    let values: Vec<f64> = begin.take_while(still).map(off).filter(|v| v.is_finite()).collect();
    if values.len() < AT_REST {
        return None;
    }
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    let parts: Vec<f64> = values.chunks_exact(values.len() / PARTS).map(mean).collect();
    let all = mean(&values);
    let scatter = parts.iter().map(|m| (m - all).powi(2)).sum::<f64>() / (parts.len() * (parts.len() - 1)) as f64;
    let wheels = 0.5 * (robot.radius_m[0] * r.belief.wheel_std_rad_s / robot.half_track_m).powi(2);
    Some((all, scatter.max((r.belief.gyro_std_rad_s.powi(2) + wheels) / values.len() as f64)))
}

/// Adds a note if the gyro's bias at rest before a drive is too far from the first drive's for one unit.
pub(crate) fn other_robot(record: &Record, kept: Option<&Record>, notes: &mut Vec<String>) {
    let drives: Vec<Record> = record.apart().chain(kept.into_iter().flat_map(Record::apart)).collect();
    let mut known = drives.iter().filter_map(|r| Some((r, bias_at_rest(r)?)));
    let Some((first, (a, own))) = known.next() else { return };
    for (other, (b, others)) in known {
        let std = (2.0 * record.belief.turn_on_bias_std_rad_s.powi(2) + own + others).sqrt();
        if (a - b).abs() > OTHER_UNIT * std {
            let [one, two] = match drives.len() {
                2 => ["one recording".into(), "the other".into()],
                _ => [first, other].map(|r| r.sources.join(", ")),
            };
            notes.push(format!(
                "Before it moves the gyro reads {a:.2e} rad/s off its model in {one} and {b:.2e} in {two}, more than one unit's \
                 turn-on bias varies: are they of the same unit?"
            ));
        }
    }
}
