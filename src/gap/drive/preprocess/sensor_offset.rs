//! reading(t) = y(t - τ), τ longer than a row:   τ = n rows + rest
//!
//! A derivative by τ says little about a delay of several rows. The instrument then does not read the present motion, the
//! likelihood has a valley no wider than its noise over the acceleration, and free forms of accelerations explain more
//! than any delay on the way there. So the readings of gyro or wheels are moved by whole rows, which changes no density.
//! The remaining delay is less than a row, and an effect like any other.

use super::changepoint;
use super::changepoint::Onsets;
use super::hypothesis::PreprocessingHypothesis;
use super::lag;
use crate::effects::drive::{Driving, late};
use crate::effects::{About, Parameters};
use crate::gap::drive::ekf::innovations::run;
use crate::gap::drive::ekf::models::Models;
use crate::gap::drive::ekf::noise::Noise;
use crate::gap::drive::fit::begin::{first, start};
use crate::gap::drive::fit::{Compared, Theta};
use crate::gap::drive::options::{HOPELESS, Options};
use crate::gap::drive::preprocess::initial_noise::rediffused;
use crate::gap::drive::preprocess::settle::settled;
use crate::gap::drive::record::Record;
use crate::gap::drive::regressors::candidates::Candidates;
use crate::gap::selection::sets::{Part, WeightedSet};
use crate::model::drive::Instrument;

/// Distance from a whole number of rows, in rows, within which the neighbouring number is tried too.
const NEAR: f64 = 0.3;

/// Instruments whose readings are moved.
const MOVED: [Instrument; 2] = [Instrument::Gyro, Instrument::Wheels];

/// A drive in which the readings of one instrument were moved earlier by whole rows.
pub(crate) struct SensorOffset {
    /// The instrument.
    pub(crate) of: Instrument,
    /// The effect of its being late.
    late: &'static About,
    /// The comparison of sets on that drive.
    pub(crate) branch: PreprocessingHypothesis,
    /// Time by which its readings were put back, s.
    pub(crate) lag_s: f64,
    /// Time between rows, s.
    step_s: f64,
    /// Gain in ln likelihood of the move alone, nats.
    share: f64,
    /// ln prior odds of the effect.
    ln_prior: f64,
}

impl SensorOffset {
    /// ln weight of its best set, the prior odds of the delay included, which every set of it has.
    pub(crate) fn top(&self) -> f64 {
        self.branch.top() + self.ln_prior
    }

    /// Sets that explain the drive, each with the delay: whole rows and the remainder. In a set without the effect the
    /// remainder is the nuisance's, and where there is none, zero with the standard deviation of a uniform row.
    /// `as_recorded`: ln weight of the best set of the drive as recorded. The share of the move is the mean of what it
    /// gains alone and beside the effects.
    pub(crate) fn sets(&self, as_recorded: f64) -> Vec<WeightedSet> {
        let missed = self.branch.top() - as_recorded;
        let share = 0.5 * (self.share + missed);
        let (late, name) = (self.late.id, self.late.size());
        let (rest_s, std_s) = self.branch.usual(late).unwrap_or((0.0, self.step_s / 12f64.sqrt()));
        let with = |mut set: WeightedSet| {
            if let Some(rest) = set.parts.iter_mut().find(|p| p.id == late) {
                rest.share += share;
                rest.missed_nats = Some(missed);
                *rest.parameters.entry(name.into()).or_insert(0.0) += self.lag_s;
            } else {
                let mut part = Part { missed_nats: Some(missed), ..Part::new(late, true, share) };
                part.parameters = Parameters::from([(name.into(), self.lag_s + rest_s)]);
                part.std = Parameters::from([(name.into(), std_s)]);
                set.parts.insert(0, part);
                set.ln_weight += self.ln_prior;
            }
            set
        };
        self.branch.sets().into_iter().map(with).collect()
    }
}

/// A drive with the readings of one instrument moved earlier by whole rows, of which sets were compared and nothing has
/// settled.
struct Moved {
    lag: Lag,
    record: Record,
    noise: Noise,
    compared: Compared,
    onsets_s: Onsets,
}

impl Moved {
    fn by(lag: Lag, record: &Record, believed: &Noise, effects: &[&'static dyn Driving], options: &Options) -> Self {
        let record = record.earlier(lag.of, lag.rows);
        let onsets_s = changepoint::of_each(&record);
        let all = Candidates::new(&record, effects, &options.prior, true, &onsets_s);
        let (noise, _) = rediffused(&record, believed, &all);
        let begin = start(&record, &noise, &all);
        let compared = first(&record, &noise, all, &begin);
        Self { lag, record, noise, compared, onsets_s }
    }

    fn settled(self, record: &Record, effects: &[&'static dyn Driving], options: &Options) -> SensorOffset {
        let step_s = self.record.step_s;
        let mut branch = settled(&self.record, self.noise, self.compared, self.onsets_s, effects, options);
        // every number of rows is equally probable
        branch.extra_weight -= (lag::LONGEST_S / step_s).max(1.0).ln();
        let of = |record: &Record| run(record, &Models::plain(record), &branch.noise, &[], |_| {}).ln_likelihood();
        let share = of(&branch.record) - of(record);
        let Lag { of, late, rows, .. } = self.lag;
        let (lag_s, ln_prior) = (rows as f64 * step_s, options.prior.ln_named);
        SensorOffset { of, late, branch, lag_s, step_s, share, ln_prior }
    }
}

/// The drive with the readings of one instrument moved earlier by whole rows, where named effects then explain all,
/// beside the comparison of sets on the drive as recorded, where that falls short by far before it has settled; else
/// none. `all`: candidates of the drive as recorded, of which nothing has been fitted yet; `begin`: θ to start from.
pub(crate) fn moved_at_once(
    record: &Record,
    (all, begin): (&Candidates, &Theta),
    noise: &Noise,
    effects: &[&'static dyn Driving],
    options: &Options,
) -> Option<(SensorOffset, Compared)> {
    let lag = lags(record, noise, effects).into_iter().next()?;
    let as_recorded = Compared::wide(record, noise, all.clone(), begin.clone());
    let moved = Moved::by(lag, record, noise, effects, options);
    if !moved.compared.is_named() || moved.compared.top() < as_recorded.top() + HOPELESS {
        return None;
    }
    let found = moved.settled(record, effects, options);
    (found.branch.is_settled() && found.top() > as_recorded.top() + HOPELESS).then_some((found, as_recorded))
}

/// The drive with the readings of one instrument moved earlier by each plausible number of whole rows; empty where they
/// are on time, or nothing else tells what they read.
pub(crate) fn in_time(
    record: &Record,
    as_is: &PreprocessingHypothesis,
    effects: &[&'static dyn Driving],
    options: &Options,
) -> Vec<SensorOffset> {
    let mut found: Vec<SensorOffset> = Vec::new();
    for lag in lags(record, &as_is.believed, effects) {
        // another number of rows is another way to write down the same delay: it must be the better one
        let ways = found.iter().map(|f| (f.top(), (&f.branch, 0.0))).chain([(as_is.top(), (as_is, HOPELESS))]);
        let Some((_, (best, short))) = ways.max_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
        let earlier = record.earlier(lag.of, lag.rows);
        if !falls_short(&earlier, (best, short), lag.late, lag.rest_rows * record.step_s) {
            found.push(Moved::by(lag, record, &as_is.believed, effects, options).settled(record, effects, options));
        }
    }
    found
}

/// Whether effects alone explain all in `best`, under its noise levels, but fall short of that by `short` nats on `moved`,
/// with any remaining delay beside them, about `rest_s`.
fn falls_short(moved: &Record, (best, short): (&PreprocessingHypothesis, f64), late: &About, rest_s: f64) -> bool {
    let c = &best.compared;
    let members = &c.sets[0].fitted;
    // `moved` still has the readings that were put aside
    if !best.is_settled() || best.put_aside != [0; 3] {
        return false;
    }
    let own = c.candidates.only(|g| members.iter().any(|m| m.0 == g) || c.candidates.groups[g].id == late.id);
    let mut theta = c.theta.clone();
    if let Some(own) = c.candidates.changes.iter().position(|change| change.0.about().id == late.id) {
        theta[own][0] = rest_s;
    }
    Compared::narrow(moved, &best.noise, own, theta, None).top() < c.top() - short
}

/// A number of rows by which an instrument may be late.
#[derive(Clone, Copy)]
pub(crate) struct Lag {
    pub(crate) of: Instrument,
    /// The effect of its being late
    pub(crate) late: &'static About,
    pub(crate) rows: usize,
    /// Remaining delay, rows
    rest_rows: f64,
}

/// Lags of gyro and wheels that explain much: the whole part, and its neighbour where the rest is near that; the nearest
/// first. Empty where both are on time.
pub(crate) fn lags(record: &Record, noise: &Noise, effects: &[&'static dyn Driving]) -> Vec<Lag> {
    if !record.wheels_share_rows() {
        return Vec::new();
    }
    let of_one = |of: Instrument| {
        let rows = late(effects, of).and_then(|late| Some((late, lag::late_rows(record, of, noise)?)));
        let Some((late, rows)) = rows else { return Vec::new() };
        let whole = rows.floor();
        let near = [(whole - 1.0, rows - whole < NEAR), (whole, true), (whole + 1.0, rows - whole > 1.0 - NEAR)];
        let tried = near.iter().filter(|(rows, tried)| *tried && *rows >= 1.0);
        let one = |(own, _): &(f64, bool)| Lag { of, late, rows: *own as usize, rest_rows: rows - own };
        let mut lags: Vec<Lag> = tried.map(one).collect();
        lags.sort_by(|a, b| a.rest_rows.abs().total_cmp(&b.rest_rows.abs()));
        lags.iter_mut().for_each(|lag| lag.rest_rows = lag.rest_rows.max(0.0));
        lags
    };
    MOVED.into_iter().flat_map(of_one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::drive::{ids, registry};
    use crate::gap::drive::model_selection::judge;
    use crate::gap::drive::preprocess::clocks::tests::{recorded, robot, without};
    use crate::gap::selection::sets::Main;
    use crate::signal::names;
    use rayon::prelude::*;

    /// Delays that are not found, each with its estimate and standard deviation, s. Rows are 10 ms apart; stamps are
    /// accurate to a twentieth of a row.
    fn not_found(delays_s: &[f64]) -> Vec<(f64, f64, f64)> {
        let tried = |(i, delay_s): (usize, f64)| {
            let log = recorded(40.0, 41 + i as u64, Some((ids::gyro_delay(), "delay_s", delay_s)));
            let record = Record::new(&robot(), &log, 0.0).unwrap();
            let findings = judge(&record, registry(), &Options::default()).findings;
            let mains = findings.mains();
            let set = findings.best_with(ids::gyro_delay(), false);
            let [found, std] = set
                .and_then(|s| s.part(ids::gyro_delay()))
                .map_or([f64::NAN; 2], |part| [&part.parameters, &part.std].map(|of| of["delay_s"]));
            let right = mains[0].0 == Main::Effect(ids::gyro_delay().into());
            (!right || !((found - delay_s).abs() < 3.0 * std) || std > 0.0005).then_some((delay_s, found, std))
        };
        delays_s.to_vec().into_par_iter().enumerate().filter_map(tried).collect()
    }

    /// Without torques only the speeds tell accelerations: by the last step of the filter, and by noise in it.
    #[test]
    #[ignore = "battery: some seconds"]
    fn battery_without_torques_a_late_gyro_is_found_to_a_tenth() {
        for (seed, delay_s) in [(51, 0.004), (52, 0.013)] {
            let log = recorded(60.0, seed, Some((ids::gyro_delay(), "delay_s", delay_s)));
            let log = without(log, &[names::TORQUE_LEFT, names::TORQUE_RIGHT]);
            let record = Record::new(&robot(), &log, 0.0).unwrap();
            let findings = judge(&record, registry(), &Options::default()).findings;
            let set = findings.best_with(ids::gyro_delay(), false).unwrap();
            let part = set.part(ids::gyro_delay()).unwrap();
            let (found, std) = (part.parameters["delay_s"], part.std["delay_s"]);
            assert!((found - delay_s).abs() < 4.0 * std + 0.1 * delay_s, "{delay_s} s: {found} ± {std}");
            assert!(std < 0.001, "{std}");
        }
    }

    /// Slip looks like a delay, and a delay of several rows hides it: both are found, with their sizes.
    #[test]
    #[ignore = "battery: some ten seconds and more"]
    fn battery_wheels_that_are_late_by_rows_are_found_beside_slip() {
        let (delay_s, slip) = (0.033, (ids::slip(), "compliance", 0.2));
        let log = recorded(60.0, 62, [(ids::wheel_delay(), "delay_s", delay_s), slip]);
        let record = Record::new(&robot(), &log, 0.0).unwrap();
        let found = judge(&record, registry(), &Options::default()).findings;
        let set = &found.sets[0];
        assert_eq!(found.mains()[0].0, Main::Effect(ids::wheel_delay().into()));
        for (id, name, value) in [(ids::wheel_delay(), "delay_s", delay_s), slip] {
            let part = set.part(id).unwrap();
            let (size, std) = (part.parameters[name], part.std[name]);
            assert!((size - value).abs() < 4.0 * std && std < 0.02 * value, "{id}: {size} ± {std}");
            assert!(found.is_beyond_doubt(found.presence(id)), "{id}");
        }
    }

    #[test]
    #[ignore = "battery: some ten seconds and more"]
    fn battery_a_gyro_that_is_late_by_about_a_row_is_found() {
        assert_eq!(not_found(&[0.005, 0.0061, 0.008, 0.0096, 0.01008, 0.011, 0.014]), []);
    }
}
