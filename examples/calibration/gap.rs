//! Intervals of effects that `gap explain` fits, and time offsets of clocks.

use crate::table::{Row, counts, inside};
use gyroid::Result;
use gyroid::config::{Config, EffectTable};
use gyroid::effects::Library;
use gyroid::gap::{self, Options, explain};
use gyroid::math::random::Stream;
use gyroid::signal::{Log, names};
use gyroid::simulate::{self, Course, drive_with, stationary_with};
use rayon::prelude::*;

const REST: &str = "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.2\n[gyro]\nc1_rad_s = 1e-3\nc2_rad_s = -2e-3\n\
    time_constant_s = 300.0\nangle_random_walk_rad_sqrt_s = 1e-4\nturn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.03\n";
const REST_S: f64 = 1600.0;
const DRIVE_S: f64 = 30.0;
/// Of recordings and drives a tenth as many as of logs: a fit takes seconds.
const SLOWER: u64 = 10;

const ROBOT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.02\n\
    [gyro]\nc1_rad_s = 1e-3\nc2_rad_s = -2e-3\ntime_constant_s = 300.0\nangle_random_walk_rad_sqrt_s = 1e-4\n\
    turn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.03\n\
    [vehicle]\nmass_kg = 14.0\nyaw_inertia_kg_m2 = 0.4\nhalf_track_m = 0.2\nwheel_radius_m = 0.08\n\
    wheel_inertia_kg_m2 = 2e-3\nviscous_friction_n_m_s = 2e-3\ntorque_noise_n_m_sqrt_s = 2e-3\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n\
    [pose]\nrate_hz = 10.0\nposition_std_m = 5e-3\nheading_std_rad = 5e-3\n";

/// Uniform in the logarithm.
fn size(draw: &mut Stream, low: f64, high: f64) -> f64 {
    low * (high / low).powf(draw.uniform())
}

struct Effect {
    id: &'static str,
    first_seed: u64,
    parameters: fn(&mut Stream) -> Vec<(&'static str, f64)>,
}

const AT_REST: [Effect; 2] = [
    Effect {
        id: "gyro.tone",
        first_seed: 401_000,
        parameters: |draw| vec![("frequency_hz", size(draw, 0.02, 2.3)), ("amplitude_rad_s", size(draw, 3e-5, 2e-4))],
    },
    Effect {
        id: "gyro.rate_random_walk",
        first_seed: 411_000,
        parameters: |draw| vec![("rate_random_walk_rad_s_sqrt_s", size(draw, 2e-6, 1e-5))],
    },
];

const OF_DRIVES: [Effect; 2] = [
    Effect {
        id: "wheel.radius_mismatch",
        first_seed: 421_000,
        parameters: |draw| vec![("right_over_left_minus_one", size(draw, 2e-3, 2e-2))],
    },
    Effect {
        id: "gyro.scale_factor",
        first_seed: 431_000,
        parameters: |draw| vec![("relative", size(draw, 3e-3, 2e-2))],
    },
];

/// One entry a parameter: its name, and whether its interval holds the truth; an effect that is not seen has none.
fn explained(
    text: &str,
    effect: &Effect,
    seed: u64,
    log: impl Fn(&Config) -> Result<Log>,
) -> Result<Vec<(&'static str, bool)>> {
    let nominal = Config::parse(text, "calibration")?;
    let truth = (effect.parameters)(&mut Stream::new(seed, 3));
    let mut real = nominal.clone();
    let parameters = truth.iter().map(|(name, value)| ((*name).to_string(), *value)).collect();
    real.effects.push(EffectTable { id: effect.id.into(), parameters });
    let found = explain(&nominal, &log(&real)?, &Library::new(), &[effect.id], 0.0)?;
    let of = |name: &str| found.effects.first().and_then(|e| e.parameters.get(name));
    Ok(truth.into_iter().filter_map(|(name, value)| Some((name, inside(of(name)?.ci95, value)))).collect())
}

pub fn effects(logs: u64) -> Result<Vec<Row>> {
    let logs = (logs / SLOWER).max(1);
    let rest = |real: &Config, seed: u64| {
        let options = simulate::Options { vary_turn_on: true, ..seed.into() };
        stationary_with(real, REST_S, &options, &Library::new())
    };
    let driven = |real: &Config, seed: u64| {
        let options = simulate::Options { vary_turn_on: true, ..seed.into() };
        Ok(drive_with(real, Course::Brisk, DRIVE_S, &options, &Library::new())?.log)
    };
    type Make<'a> = &'a (dyn Fn(&Config, u64) -> Result<Log> + Sync);
    let at_rest = AT_REST.iter().map(|e| (e, REST, &rest as Make));
    let of_drives = OF_DRIVES.iter().map(|e| (e, ROBOT, &driven as Make));
    let mut rows = Vec::new();
    for (effect, text, make) in at_rest.chain(of_drives) {
        let one = |i: u64| {
            let seed = effect.first_seed + i;
            explained(text, effect, seed, |real| make(real, seed))
        };
        let held: Vec<_> = (0..logs).into_par_iter().map(one).collect::<Result<_>>()?;
        for (name, _) in (effect.parameters)(&mut Stream::new(0, 3)) {
            let of = held.iter().map(|h: &Vec<(&str, bool)>| h.iter().find(|p| p.0 == name).map(|p| p.1));
            rows.push(Row::interval(format!("`{}`: `{name}`", effect.id), counts(of)));
        }
    }
    Ok(rows)
}

/// Wheels that are stamped later than a sensor's delay could be, found beside the gyro.
pub fn offsets(logs: u64) -> Result<Vec<Row>> {
    let config = Config::parse(ROBOT, "calibration")?;
    let one = |i: u64| {
        let seed = 441_000 + i;
        let late_s = size(&mut Stream::new(seed, 3), 0.3, 0.8);
        let options = simulate::Options { vary_turn_on: true, ..seed.into() };
        let mut log = simulate::drive(&config, Course::Brisk, DRIVE_S, &options)?.log;
        late(&mut log, late_s);
        let answer =
            gap::diagnose(&config, &log, None, &Library::new(), &Options { seed, ..Options::default() })?.answer;
        let found = answer.time_offsets.iter().find(|o| o.channel == "wheels");
        Ok(found.map(|o| (o.offset_s - late_s).abs() <= 1.96 * o.std_s))
    };
    let held: Vec<Option<bool>> = (0..(logs / SLOWER).max(1)).into_par_iter().map(one).collect::<Result<_>>()?;
    let row = Row::interval("time offset of the wheels, ± 1.96 std", counts(held));
    Ok(vec![if row.consistent() { row } else { row.with_note("the standard deviation is too small") }])
}

/// Puts the wheels' readings later by `late_s`, between rows by a line.
fn late(log: &mut Log, late_s: f64) {
    let rows = late_s / log.time.median_step_s();
    for channel in
        log.channels.iter_mut().filter(|c| [names::WHEEL_LEFT, names::WHEEL_RIGHT].contains(&c.name.as_str()))
    {
        let of = channel.values.clone();
        for (i, value) in channel.values.iter_mut().enumerate() {
            let at = (i as f64 - rows).max(0.0);
            let (low, share) = (at as usize, at.fract());
            *value = of[low] + share * (of[(low + 1).min(of.len() - 1)] - of[low]);
        }
    }
}
