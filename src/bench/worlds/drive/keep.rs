//! log(t + offset of the stream) = reading(t): which signals of a drive are recorded, with which time stamps and
//! decimals

use super::effect::Scene;
use super::nats::Sensors;
use super::record::Trace;
use super::world::World;
use crate::bench::worlds::files::Files;
use crate::bench::worlds::habits::{Habits, Printed};
use crate::bench::worlds::label::ClockOffset;
use crate::error::Result;
use crate::signal::{Log, TimeAxis, names};

/// Sensors with a clock of their own, in the order of [`Habits::offsets_s`].
const OWN: [&str; 2] = ["wheels", "pose"];
/// Recordings as labels name them.
const RECORDINGS: [&str; 2] = ["fit", "hold"];
/// Ticks in a second, to which stamps are told apart.
const TICKS: f64 = 1e7;

/// How the logs of one case are kept.
pub(super) struct Keep {
    has: Sensors,
    printed: Option<Printed>,
    /// By how much the clocks of wheels and pose are late in fit and hold, s.
    offsets_s: [[f64; 2]; 2],
}

impl Keep {
    /// The habits that apply to a drive with these sensors. Beside effects that are `lags` clocks are right, and so are
    /// those of the wheels where there is no gyro to disagree with. In a file that all sensors share they are off by
    /// whole rows of `step_s`.
    pub(crate) fn new(habits: &Habits, lags: bool, has: Sensors, step_s: f64) -> Self {
        let own = [has.gyro, has.pose];
        let mut offsets_s = [[0.0; 2]; 2];
        for (i, off) in habits.offsets_s.iter().enumerate() {
            if let (Some(off_s), true, false) = (off, own[i], lags) {
                let whole = |s: f64| if habits.files == Files::Apart { s } else { (s / step_s).round() * step_s };
                offsets_s[i] = off_s.map(whole);
            }
        }
        Self { has, printed: habits.printed, offsets_s }
    }

    /// The clocks that disagree.
    pub(crate) fn labels(&self) -> Vec<ClockOffset> {
        let both = OWN.iter().zip(self.offsets_s).filter(|(_, off)| *off != [0.0; 2]);
        both.flat_map(|(channel, off)| {
            RECORDINGS.iter().zip(off).map(|(recording, offset_s)| ClockOffset {
                channel: (*channel).to_string(),
                recording: (*recording).to_string(),
                offset_s,
            })
        })
        .collect()
    }
}

/// One sensor's channels, with the rows at which it is read, and how late its clock is, s.
struct Part {
    channels: Vec<(&'static str, Vec<f64>)>,
    every: usize,
    offset_s: f64,
}

impl Part {
    /// Stamps of its rows as ticks, with the rows, as far as they lie within `len` rows of `step_s`.
    fn stamps(&self, len: usize, step_s: f64) -> impl Iterator<Item = (i64, usize)> + '_ {
        let tick = move |k: usize, late_s: f64| ((k as f64 * step_s + late_s) * TICKS).round() as i64;
        let last = tick(len.saturating_sub(1), 0.0);
        (0..len)
            .step_by(self.every)
            .map(move |k| (tick(k, self.offset_s), k))
            .filter(move |(stamp, _)| (0..=last).contains(stamp))
    }
}

/// The log of run `r`, on the union of all stamps, NaN where a sensor has none. Sensors are in single precision, as loggers keep
/// them, or printed.
pub(super) fn log(
    source: &str,
    r: usize,
    scene: Scene<'_>,
    world: &World,
    trace: &Trace,
    gyro: Vec<f64>,
    keep: &Keep,
) -> Result<Log> {
    let Scene { machine, run } = scene;
    let (len, step_s) = (run.course.len(), machine.step_s);
    let single = |values: &[f64]| values.iter().map(|v| f64::from(*v as f32)).collect::<Vec<f64>>();
    let times = || (0..len).map(|k| k as f64 * step_s);
    let rate = |values: &[f64], stated_rad_s: f64, loud: f64| match keep.printed {
        None => single(values),
        Some(printed) => {
            let mut values = values.to_vec();
            printed.print(&mut values, stated_rad_s * loud.min(1.0));
            values
        }
    };
    let mut base = vec![(names::SINCE_POWER_ON, times().map(|t| run.since_power_on_s + t).collect::<Vec<f64>>())];
    if keep.has.torque {
        base.push((names::TORQUE_LEFT, single(&trace.torque_n_m[0])));
        base.push((names::TORQUE_RIGHT, single(&trace.torque_n_m[1])));
    }
    if keep.has.gyro {
        let white = machine.gyro.white_std_rad_s();
        base.push((names::GYRO_Z, rate(&gyro, white, world.gyro.loud.rms(times()))));
    }
    let loud = world.encoders.loud.rms(times());
    let wheels = [names::WHEEL_LEFT, names::WHEEL_RIGHT].into_iter().zip(&trace.wheel_rad_s);
    let wheels = wheels.map(|(name, values)| (name, rate(values, machine.wheel_std_rad_s, loud))).collect();
    let [wheels_s, pose_s] = keep.offsets_s.map(|of| of[r]);
    let mut parts = vec![
        Part { channels: base, every: 1, offset_s: 0.0 },
        Part { channels: wheels, every: keep.has.wheel_rows, offset_s: wheels_s },
    ];
    if keep.has.pose {
        let pose = [names::X, names::Y, names::HEADING].into_iter().zip(&trace.pose);
        let channels = pose.map(|(name, values)| (name, single(values))).collect();
        parts.push(Part { channels, every: machine.pose_rows, offset_s: pose_s });
    }
    let mut stamps: Vec<i64> = parts.iter().flat_map(|p| p.stamps(len, step_s)).map(|s| s.0).collect();
    stamps.sort_unstable();
    stamps.dedup();
    let time = match stamps.len() == len {
        true => TimeAxis::Uniform { start_s: 0.0, step_s, len },
        false => TimeAxis::Explicit(stamps.iter().map(|tick| *tick as f64 / TICKS).collect()),
    };
    let mut log = Log::new(source, time);
    for part in &parts {
        let rows: Vec<(usize, usize)> =
            part.stamps(len, step_s).filter_map(|(stamp, k)| Some((stamps.binary_search(&stamp).ok()?, k))).collect();
        for (name, values) in &part.channels {
            let mut on_union = vec![f64::NAN; stamps.len()];
            rows.iter().for_each(|(row, k)| on_union[*row] = values[*k]);
            log.push(*name, on_union)?;
        }
    }
    Ok(log)
}
