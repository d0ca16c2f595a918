//! reading(t) = y(t - τ), τ longer than a row:   min over τ of Σ_k (y_k - β₀ - β₁ x(t_k - τ) - β₂ x f(t_k - τ))²,  x: what all
//! other readings tell, f: torque of a wheel, so that slip, λ ~ f, is no lag
//!
//! A derivative by τ says little about a delay of several rows. A late gyro does not read the present yaw rate, the
//! likelihood has a valley no wider than the gyro's noise over the yaw acceleration, and free forms of accelerations
//! explain more than any delay on the way there. So the readings of gyro or wheels are moved by whole rows, which
//! changes no density. The remaining delay is less than a row, and an effect like any other. Without torques a delay of
//! the wheels is that of [`super::wheel_offset`].

use super::changepoint;
use super::hypothesis::PreprocessingHypothesis;
use super::offset::{Products, WIDTH};
use crate::effects::drive::{Driving, late};
use crate::effects::{About, Parameters};
use crate::gap::drive::ekf::innovations::{Channel, Noise, run};
use crate::gap::drive::fit::begin::{first, start};
use crate::gap::drive::fit::{Compared, Theta};
use crate::gap::drive::model_selection::{HOPELESS, LARGE, Options, plain, rediffused, settled};
use crate::gap::drive::record::Record;
use crate::gap::drive::regressors::candidates::Candidates;
use crate::gap::selection::findings::{Part, WeightedSet};
use crate::model::drive::Instrument;

/// Longest delay that is looked for, s: past motion is stored for this time.
const LONGEST_S: f64 = 0.4;
/// Factor on the variance of readings that excludes them from a pass of the filter.
const ASIDE: f64 = 1e10;
/// Distance from a whole number of rows, in rows, within which the neighbouring number is tried too.
const NEAR: f64 = 0.3;
/// Fewest pairs of rows that are compared.
const FEWEST: usize = 64;

/// A drive whose readings of one instrument were moved earlier by whole rows.
pub(crate) struct RowOffset {
    /// The effect of the late instrument.
    effect: &'static About,
    of: Instrument,
    /// The comparison of sets on that drive.
    pub(crate) branch: PreprocessingHypothesis,
    /// Time by which the readings were moved, s.
    lag_s: f64,
    /// Time between rows, s.
    step_s: f64,
    /// Gain in ln likelihood of the move alone, nats.
    share: f64,
    /// ln prior odds of the effect.
    ln_prior: f64,
}

impl RowOffset {
    /// Name in the trail.
    pub(crate) fn name(&self) -> String {
        let of = if self.of == Instrument::Gyro { "gyro" } else { "wheels" };
        format!("{of} {:.4} s earlier", self.lag_s)
    }

    /// ln weight of its best set, the prior odds of the delay included, which every set of it has.
    pub(crate) fn top(&self) -> f64 {
        self.branch.top() + self.ln_prior
    }

    /// Sets that explain the drive, each with the delay: whole rows and the remainder. In a set without the effect the
    /// remainder is the nuisance's, and where there is none, zero with the standard deviation of a uniform row.
    pub(crate) fn sets(&self) -> Vec<WeightedSet> {
        let (late, name) = (self.effect.id, self.effect.size());
        let (rest_s, std_s) = self.branch.usual(late).unwrap_or((0.0, self.step_s / 12f64.sqrt()));
        let with = |mut set: WeightedSet| {
            if let Some(rest) = set.parts.iter_mut().find(|p| p.id == late) {
                rest.share += self.share;
                *rest.parameters.entry(name.into()).or_insert(0.0) += self.lag_s;
            } else {
                let mut part = Part::new(late, true, self.share);
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

/// A drive with moved readings, of which sets were compared but nothing settled.
struct Moved {
    record: Record,
    noise: Noise,
    compared: Compared,
}

/// What all numbers of rows have in common.
struct Search<'a> {
    record: &'a Record,
    believed: Noise,
    effects: &'a [&'static dyn Driving],
    options: &'a Options,
}

impl Search<'_> {
    /// Instruments that may be late by rows, each with its effect and its lags.
    fn lags(&self) -> Vec<(Instrument, &'static About, Vec<Lag>)> {
        if !self.record.wheels_share_rows() {
            return Vec::new();
        }
        let wheels = self.record.torques_n_m.is_some() && !self.record.wheels_were_set;
        let of = [Some(Instrument::Gyro), wheels.then_some(Instrument::Wheels)].into_iter().flatten();
        let of = of.filter_map(|of| Some((of, late(self.effects, of)?)));
        of.map(|(of, effect)| (of, effect, lags(self.record, &self.believed, of))).collect()
    }

    fn moved(&self, of: Instrument, rows: usize) -> (Moved, changepoint::Onsets) {
        let record = self.record.earlier(of, rows);
        let onsets_s = changepoint::of_each(&record);
        let all = Candidates::new(&record, self.effects, &self.options.prior, true, &onsets_s);
        let (noise, _) = rediffused(&record, &self.believed, &all);
        let begin = start(&record, &noise, &all);
        let compared = first(&record, &noise, all, &begin);
        (Moved { record, noise, compared }, onsets_s)
    }

    fn settled(
        &self,
        (moved, onsets_s): (Moved, changepoint::Onsets),
        (of, effect): (Instrument, &'static About),
        rows: usize,
    ) -> RowOffset {
        let Moved { record, noise, compared } = moved;
        let mut branch = settled(&record, noise, compared, onsets_s, self.effects, self.options);
        // every number of rows is equally probable
        branch.extra_weight -= (LONGEST_S / record.step_s).max(1.0).ln();
        let ln_p = |record: &Record| run(record, &plain(record), &branch.noise, &[], |_| {}).ln_likelihood();
        let share = ln_p(&branch.record) - ln_p(self.record);
        let step_s = record.step_s;
        let (lag_s, ln_prior) = (rows as f64 * step_s, self.options.prior.ln_named);
        RowOffset { effect, of, branch, lag_s, step_s, share, ln_prior }
    }
}

/// The drive with the readings of one instrument moved earlier by whole rows, where named effects explain all of it;
/// with the comparison of sets on the drive as recorded where that, not settled, falls short by far, else none. `all`:
/// candidates of the drive as recorded, of which nothing has been fitted yet; `begin`: θ to start from.
pub(crate) fn moved_at_once(
    record: &Record,
    (all, begin): (&Candidates, &Theta),
    noise: &Noise,
    effects: &[&'static dyn Driving],
    options: &Options,
) -> Option<(RowOffset, Compared)> {
    let search = Search { record, believed: *noise, effects, options };
    let late = search.lags();
    let nearest: Vec<_> = late.iter().filter_map(|(of, effect, lags)| Some((*of, *effect, lags.first()?))).collect();
    if nearest.is_empty() {
        return None;
    }
    let as_recorded = Compared::wide(record, noise, all.clone(), begin.clone());
    for (of, effect, lag) in nearest {
        let (moved, onsets_s) = search.moved(of, lag.rows);
        let all_named = moved.compared.sets[0].members.iter().all(|m| moved.compared.candidates.groups[m.0].named);
        if !all_named || moved.compared.top() < as_recorded.top() + HOPELESS {
            continue;
        }
        let found = search.settled((moved, onsets_s), (of, effect), lag.rows);
        if found.branch.is_settled() && found.top() > as_recorded.top() + HOPELESS {
            return Some((found, as_recorded));
        }
    }
    None
}

/// The drive with the readings of gyro or wheels moved earlier by each plausible number of whole rows; empty where they
/// are on time, or nothing else tells the motion.
pub(crate) fn moved_by_rows(
    record: &Record,
    as_is: &PreprocessingHypothesis,
    effects: &[&'static dyn Driving],
    options: &Options,
) -> Vec<RowOffset> {
    let search = Search { record, believed: as_is.believed, effects, options };
    let mut found: Vec<RowOffset> = Vec::new();
    for (of, effect, lags) in search.lags() {
        for lag in lags {
            // another number of rows is another way to write down the same delay: it must be the better one
            let ways = found.iter().map(|f| (f.top(), (&f.branch, 0.0))).chain([(as_is.top(), (as_is, HOPELESS))]);
            let Some((_, best)) = ways.max_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
            let earlier = record.earlier(of, lag.rows);
            if !falls_short(&earlier, best, effect, lag.rest_rows * record.step_s) {
                found.push(search.settled(search.moved(of, lag.rows), (of, effect), lag.rows));
            }
        }
    }
    found
}

/// Whether effects alone explain all in `best`, under its noise levels, but fall short of that by `short` nats on `moved`,
/// with any remaining delay beside them, about `rest_s`.
fn falls_short(moved: &Record, (best, short): (&PreprocessingHypothesis, f64), late: &About, rest_s: f64) -> bool {
    let c = &best.compared;
    let members = &c.sets[0].members;
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

/// A number of rows by which readings may be late, and the remaining delay, rows.
struct Lag {
    rows: usize,
    rest_rows: f64,
}

/// Lags of an instrument that explain much: the whole part, and its neighbour where the rest is near that; the nearest
/// first. Empty where it is on time.
fn lags(record: &Record, noise: &Noise, of: Instrument) -> Vec<Lag> {
    let Some(rows) = lag(record, noise, of) else { return Vec::new() };
    let whole = rows.floor();
    let near = [(whole - 1.0, rows - whole < NEAR), (whole, true), (whole + 1.0, rows - whole > 1.0 - NEAR)];
    let tried = near.iter().filter(|(rows, tried)| *tried && *rows >= 1.0);
    let mut lags: Vec<Lag> = tried.map(|(own, _)| Lag { rows: *own as usize, rest_rows: rows - own }).collect();
    lags.sort_by(|a, b| a.rest_rows.abs().total_cmp(&b.rest_rows.abs()));
    lags.iter_mut().for_each(|lag| lag.rest_rows = lag.rest_rows.max(0.0));
    lags
}

/// Readings of an instrument without its own error, and their prediction by all others.
struct Predicted {
    reads: Vec<f64>,
    should: Vec<f64>,
    /// Index of the wheel whose torque tells its slip; none: does not slip.
    wheel: Option<usize>,
}

fn predicted(record: &Record, noise: &Noise, of: Instrument) -> Vec<Predicted> {
    let channels: &[(Channel, Option<usize>)] = match of {
        Instrument::Gyro => &[(Channel::Gyro, None)],
        Instrument::Wheels => &[(Channel::WheelLeft, Some(0)), (Channel::WheelRight, Some(1))],
        Instrument::Pose => &[],
    };
    let mut aside = *noise;
    channels.iter().for_each(|(channel, _)| aside.reading[*channel as usize] *= ASIDE);
    let nothing = vec![f64::NAN; record.len()];
    let own = |wheel: &Option<usize>, k: usize| match (wheel, &record.gyro_rad_s) {
        (Some(side), _) => record.wheels_rad_s[*side][k],
        (None, Some(gyro)) => gyro[k] - record.belief.warm_up.error_rad_s(record.since_power_on_s[k]),
        (None, None) => f64::NAN,
    };
    let new = |(_, wheel): &(Channel, Option<usize>)| Predicted {
        reads: nothing.clone(),
        should: nothing.clone(),
        wheel: *wheel,
    };
    let mut all: Vec<Predicted> = channels.iter().map(new).collect();
    let _ = run(record, &plain(record), &aside, &[], |i| {
        if let Some(at) = channels.iter().position(|c| c.0 == i.channel) {
            let read = own(&channels[at].1, i.row);
            all[at].reads[i.row] = read;
            all[at].should[i.row] = read - i.white * i.std;
        }
    });
    all
}

/// Number of rows, as a real number, by which an instrument's readings agree best with all others; none where that is
/// less than one, or explains little.
fn lag(record: &Record, noise: &Noise, of: Instrument) -> Option<f64> {
    let all = predicted(record, noise, of);
    // readings, and ln of the residual share of their variance
    let left = |rows: usize| {
        let (mut count, mut sum) = (0, 0.0);
        for own in &all {
            let torque = own.wheel.and_then(|side| Some(&record.torques_n_m.as_ref()?[side]));
            let mut products = Products::default();
            for drive in record.drives() {
                for k in drive.start + rows.min(drive.len())..drive.end {
                    let (y, x) = (own.reads[k], own.should[k - rows]);
                    let slip = torque.map_or(0.0, |torque| x * torque[k - rows]);
                    let mut row = [0.0; WIDTH];
                    (row[0], row[1], row[2], row[WIDTH - 1]) = (1.0, x, slip, y);
                    if row.iter().all(|v| v.is_finite()) {
                        products.add(&row);
                    }
                }
            }
            if products.count >= FEWEST {
                count += products.count;
                sum += products.count as f64 * products.solved(1 + usize::from(torque.is_some()))?.1.ln();
            }
        }
        (count > 0).then(|| (count as f64, sum / count as f64))
    };
    let (count, on_time) = left(0)?;
    let all = (1..=(LONGEST_S / record.step_s) as usize).filter_map(|n| Some((n, left(n)?.1)));
    let (rows, least) = all.min_by(|a, b| a.1.total_cmp(&b.1))?;
    if 0.5 * count * (on_time - least) <= LARGE {
        return None;
    }
    // the vertex of the parabola through the least and its neighbours
    let [before, after] = [rows - 1, rows + 1].map(|n| left(n).map_or(least, |s| s.1));
    let bend = before + after - 2.0 * least;
    Some(rows as f64 + if bend > 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::drive::{ids, registry};
    use crate::gap::drive::model_selection::judge;
    use crate::gap::drive::preprocess::clocks::tests::{recorded, robot, without};
    use crate::gap::selection::findings::Main;
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
    fn without_torques_a_late_gyro_is_found_to_a_tenth() {
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

    #[test]
    fn a_gyro_that_is_late_by_about_a_row_is_found() {
        assert_eq!(not_found(&[0.005, 0.0061, 0.008, 0.0096, 0.01008, 0.011, 0.014]), []);
    }
}
