//! |ν/√S| > 6, and beside its neighbours:   outliers, single readings that are removed

use super::hypothesis::PreprocessingHypothesis;
use crate::effects::{About, InDrives, Parameters, in_drives};
use crate::gap::drive::ekf::noise::Channel;
use crate::gap::drive::options::Options;
use crate::gap::drive::preprocess::level::Residual;
use crate::gap::selection::sets::Part;
use crate::gap::trace::{Decision, Step, TraceStage};
use crate::math::robust::{SECOND_DIFFERENCE, second_difference_std};

/// Standard deviations of an innovation beyond which a reading may be an outlier.
const OUTLYING: f64 = 6.0;
/// Readings on either side with which it is compared.
const NEIGHBOURS: usize = 5;
/// Largest distance, in steps, of readings without a missing one between them.
const ONE_STEP: f64 = 1.5;
/// Largest share of a channel's readings that may be single outliers.
const MANY: f64 = 0.02;
/// ln odds that one reading is an outlier, its size included.
const LN_OUTLIER: f64 = -9.0;
/// Least evidence for which outliers are removed, nats.
const WORTH: f64 = 3.0;

/// A reading that is far off.
struct Far {
    channel: Channel,
    row: usize,
    /// Innovation over its standard deviation, as large as the noise is.
    white: f64,
    /// That standard deviation, in the channel's unit.
    std: f64,
}

impl PreprocessingHypothesis {
    /// Removes outliers; returns whether there were any.
    pub(crate) fn put_outliers_aside(&mut self, options: &Options, residuals: &[Residual]) -> bool {
        let mut found: Vec<Far> = Vec::new();
        let mut counts = [0usize; 6];
        // innovations are compared with the actual level of their noise
        let scales = scales(residuals);
        for &(channel, row, white, std) in residuals {
            counts[channel as usize] += 1;
            let scale = scales[channel as usize];
            if white.abs() > OUTLYING * scale {
                found.push(Far { channel, row, white: white / scale, std: std * scale });
            }
        }
        if found.is_empty() {
            return false;
        }
        let [_, every_s] = self.record.read_every_s();
        let mut any = false;
        for (place, (known, free, channels)) in [
            (in_drives(InDrives::Outliers), "free.outliers.gyro", &Channel::ALL[2..3]),
            (None, "free.outliers.pose", &Channel::ALL[3..6]),
            (None, "free.outliers.wheels", &Channel::ALL[0..2]),
        ]
        .into_iter()
        .enumerate()
        {
            let (id, named) = (known.map_or(free, |e| e.id), known.is_some());
            let own = |f: &&Far| channels.contains(&f.channel) && self.stands_out(f.channel, f.row, every_s);
            let here: Vec<&Far> = found.iter().filter(own).collect();
            let all: usize = channels.iter().map(|c| counts[*c as usize]).sum();
            let gain: f64 = here.iter().map(|f| 0.5 * f.white * f.white + LN_OUTLIER).sum();
            let prior = if named { options.prior.ln_known_at_rest() } else { options.prior.ln_free };
            // neighbouring rows that are off together are no single outliers
            let rows: std::collections::BTreeSet<usize> = here.iter().map(|f| f.row).collect();
            let next = |r: usize| rows.contains(&(r + 1)) && !self.record.starts.contains(&(r + 1));
            let alone = rows.iter().filter(|r| !next(**r)).count();
            if here.is_empty() {
                continue;
            }
            let step = |decision, reason: String| Step::new(TraceStage::Readings, id, decision, reason);
            let refused = if here.len() as f64 > MANY * all as f64 {
                Some(step(Decision::Rejected, "too many readings are far off for single ones".into()).limit(
                    "largest share of all readings",
                    MANY,
                    "",
                ))
            } else if 3 * alone < 2 * rows.len() {
                Some(step(Decision::Rejected, "the readings far off stand in neighbouring rows".into()))
            } else if gain + prior < WORTH {
                let step = step(Decision::Rejected, "readings are far off, by too little".into()).nats(gain + prior);
                Some(step.limit("least evidence", WORTH, "nats"))
            } else {
                None
            };
            if let Some(step) = refused {
                self.note_unless_known(step);
                continue;
            }
            // the likelihood gains ν²/2S + ln √S where a reading is put aside: what it costs is said here
            let cost: f64 = here.iter().map(|f| f.std.ln() - LN_OUTLIER).sum();
            for Far { channel, row, .. } in here {
                let column = match channel {
                    Channel::Gyro => self.record.gyro_rad_s.as_mut().map(|g| &mut g[*row]),
                    Channel::WheelLeft => Some(&mut self.record.wheels_rad_s[0][*row]),
                    Channel::WheelRight => Some(&mut self.record.wheels_rad_s[1][*row]),
                    Channel::X | Channel::Y | Channel::Heading => {
                        self.record.pose.as_mut().map(|p| &mut p[*channel as usize - 3][*row])
                    }
                };
                if let Some(value) = column {
                    *value = f64::NAN;
                }
            }
            let again = self.put_aside[place] > 0;
            self.put_aside[place] += rows.len();
            let count = self.put_aside[place];
            let share = count as f64 / all.max(1) as f64;
            let mut part = Part::described(
                id,
                named,
                gain,
                if count == 1 {
                    "a single reading is far off".into()
                } else {
                    format!("{count} single readings are far off")
                },
            );
            let reason = format!("{count} single readings lie more than {OUTLYING} standard deviations off");
            let step = step(Decision::Removed, reason);
            if let Some(name) = known.map(About::size) {
                part.parameters = Parameters::from([(name.into(), share)]);
                part.std = Parameters::from([(name.into(), share / (count as f64).sqrt())]);
            }
            self.extra_weight += if again { -cost } else { prior - cost };
            self.add(part);
            // of all rounds
            let share = self.extra_parts.iter().find(|p| p.id == id).map_or(0.0, |p| p.share);
            self.note(step.nats(share + prior).limit("least evidence", WORTH, "nats"));
            any = true;
        }
        any
    }

    /// Without torques a robot that starts to move looks like an outlier, but gyro and wheels agree then. Whether the
    /// yaw rate of this reading departs from that of the other sensor, more than those around it do. Without a gyro,
    /// and where a row has no wheels, whether it departs from the readings before and after it. `every_s`: typical time
    /// between readings of the yaw rate, s.
    fn stands_out(&self, channel: Channel, row: usize, every_s: f64) -> bool {
        let r = &self.record;
        if r.torques_n_m.is_some() || channel > Channel::Gyro {
            return true;
        }
        let Some(gyro) = r.gyro_rad_s.as_ref().filter(|_| r.rolling(row)[1].is_finite()) else {
            return self.departs_from_both(channel, row);
        };
        let robot = &r.belief.robot;
        let drive = r.drive_around(row);
        // streams with clocks of their own have rows of their own: the gyro is interpolated between readings
        let turning = |k: usize| {
            let read = |j: usize| Some((r.times_s[j], gyro[j])).filter(|g| g.1.is_finite());
            let (Some((t0, from)), Some((t1, to))) =
                ((drive.start..=k).rev().find_map(read), (k..drive.end).find_map(read))
            else {
                return f64::NAN;
            };
            // none where one has been removed
            match t1 - t0 {
                0.0 => from,
                apart_s if apart_s < ONE_STEP * every_s => from + (to - from) * (r.times_s[k] - t0) / apart_s,
                _ => f64::NAN,
            }
        };
        let apart = |k: usize| {
            let rolling = r.rolling(k)[1];
            // most rows have no wheels
            if rolling.is_finite() { turning(k) - rolling } else { f64::NAN }
        };
        let read = |v: &f64| v.is_finite();
        let before = (drive.start..row).rev().map(apart).filter(read).take(NEIGHBOURS);
        let after = (row + 1..drive.end).map(apart).filter(read).take(NEIGHBOURS);
        let mut near: Vec<f64> = before.chain(after).collect();
        near.sort_by(f64::total_cmp);
        let Some(middle) = near.get(near.len() / 2).copied() else { return true };
        let wheel = robot.radius_m[0] * self.noise.reading[0].sqrt() / robot.half_track_m;
        let std = (self.noise.reading[2] + 0.5 * wheel * wheel).sqrt();
        (apart(row) - middle).abs() > OUTLYING * std
    }

    /// Whether this reading of a wheel or the gyro is far above the extrapolations of both the two before it and the
    /// two after it, or far below both: where a robot begins to move, stops or turns round, one of them fits.
    fn departs_from_both(&self, channel: Channel, row: usize) -> bool {
        let r = &self.record;
        let values = match channel {
            Channel::WheelLeft | Channel::WheelRight => Some(&r.wheels_rad_s[channel as usize]),
            _ => r.gyro_rad_s.as_ref(),
        };
        let Some(values) = values else { return true };
        let drive = r.drive_around(row);
        let read = |k: usize| Some(values[k]).filter(|v| v.is_finite());
        let led_to = |near: &mut dyn Iterator<Item = f64>| Some(2.0 * near.next()? - near.next()?);
        let before = led_to(&mut (drive.start..row).rev().filter_map(read));
        let after = led_to(&mut (row + 1..drive.end).filter_map(read));
        let (Some(before), Some(after)) = (before, after) else { return false };
        // of stated white noise, or of the actual scatter from one reading to the next
        let all: Vec<f64> = drive.filter_map(read).collect();
        let white = (SECOND_DIFFERENCE * self.noise.reading[channel as usize]).sqrt();
        let far = OUTLYING * second_difference_std([all.as_slice()]).max(white);
        let departs = |sign: f64| [before, after].iter().all(|side| sign * (values[row] - side) > far);
        departs(1.0) || departs(-1.0)
    }
}

/// Standard deviation of the residuals of each channel from their median size, which outliers do not move; at least
/// one.
fn scales(residuals: &[Residual]) -> [f64; 6] {
    /// Median of the size of a standard normal variable.
    const MEDIAN: f64 = 0.674_489_75;
    let mut sizes: [Vec<f64>; 6] = Default::default();
    residuals.iter().for_each(|r| sizes[r.0 as usize].push(r.2.abs()));
    sizes.map(|mut sizes| {
        let middle = sizes.len() / 2;
        if sizes.is_empty() {
            return 1.0;
        }
        (*sizes.select_nth_unstable_by(middle, f64::total_cmp).1 / MEDIAN).max(1.0)
    })
}

#[cfg(test)]
mod tests {
    use crate::effects::drive::registry;
    use crate::gap::drive::model_selection::judge;
    use crate::gap::drive::options::Options;
    use crate::gap::drive::preprocess::clocks::tests::{recorded, robot, without};
    use crate::gap::drive::record::Record;
    use crate::gap::selection::sets::Main;
    use crate::signal::names;

    /// With a robot that has only wheels and a pose.
    #[test]
    fn a_robot_that_starts_to_move_is_no_reading_that_is_far_off() {
        let lost = [names::TORQUE_LEFT, names::TORQUE_RIGHT, names::GYRO_Z];
        let found = |spoilt: &[usize]| {
            let mut record = Record::new(&robot(), &without(recorded(60.0, 2, None), &lost), 0.0).unwrap();
            spoilt.iter().for_each(|k| record.wheels_rad_s[0][*k] += 3.0);
            judge(&record, registry(), &Options::default()).findings
        };
        assert_eq!(found(&[]).mains()[0].0, Main::None, "{:?}", found(&[]).mains());
        let far_off = found(&[1000, 2500, 4100]);
        assert!(far_off.presence("free.outliers.wheels") > 0.8, "{:?}", far_off.mains());
    }
}
