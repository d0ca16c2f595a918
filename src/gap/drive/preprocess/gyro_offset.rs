//! gyro(t) = ω(t - τ), τ longer than a row:   min over τ of Σ_k (g_k - c - ŵ(t_k - τ))²,  ŵ: yaw rate as told without
//! the gyro
//!
//! A derivative by τ says little about a delay of several rows. The gyro then does not read the present yaw rate, the
//! likelihood has a valley no wider than the gyro's noise over the yaw acceleration, and free forms of accelerations
//! explain more than any delay on the way there. So the gyro's readings are moved by whole rows, which changes no
//! density. The remaining delay is less than a row, and an effect like any other.

use super::changepoint;
use super::changepoint::Onsets;
use super::hypothesis::PreprocessingHypothesis;
use crate::effects::drive::{Driving, late};
use crate::effects::{About, Parameters};
use crate::gap::drive::ekf::innovations::run;
use crate::gap::drive::ekf::models::Models;
use crate::gap::drive::ekf::noise::{Channel, Noise};
use crate::gap::drive::fit::begin::{first, start};
use crate::gap::drive::fit::{Compared, Theta};
use crate::gap::drive::options::{HOPELESS, LARGE, Options};
use crate::gap::drive::preprocess::initial_noise::rediffused;
use crate::gap::drive::preprocess::settle::settled;
use crate::gap::drive::record::Record;
use crate::gap::drive::regressors::candidates::Candidates;
use crate::gap::selection::sets::{Part, WeightedSet};
use crate::model::drive::Instrument;

/// Longest delay that is looked for, s: past yaw rates are stored for this time.
const LONGEST_S: f64 = 0.4;
/// Distance from a whole number of rows, in rows, within which the neighbouring number is tried too.
const NEAR: f64 = 0.3;
/// Fewest pairs of rows that are compared.
const FEWEST: f64 = 64.0;

/// A drive whose gyro readings were moved earlier by whole rows.
pub(crate) struct GyroOffset {
    /// The effect of a late gyro.
    effect: &'static About,
    /// The comparison of sets on that drive.
    pub(crate) branch: PreprocessingHypothesis,
    /// Time by which its gyro was put back, s.
    pub(crate) lag_s: f64,
    /// Time between rows, s.
    step_s: f64,
    /// Gain in ln likelihood of the move alone, nats.
    share: f64,
    /// ln prior odds of the effect.
    ln_prior: f64,
}

impl GyroOffset {
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

/// A drive with its gyro moved earlier by whole rows, of which sets were compared and nothing has settled.
struct Moved {
    rows: usize,
    record: Record,
    noise: Noise,
    compared: Compared,
    onsets_s: Onsets,
}

impl Moved {
    fn by(rows: usize, record: &Record, believed: &Noise, effects: &[&'static dyn Driving], options: &Options) -> Self {
        let record = record.earlier(Instrument::Gyro, rows);
        let onsets_s = changepoint::of_each(&record);
        let all = Candidates::new(&record, effects, &options.prior, true, &onsets_s);
        let (noise, _) = rediffused(&record, believed, &all);
        let begin = start(&record, &noise, &all);
        let compared = first(&record, &noise, all, &begin);
        Self { rows, record, noise, compared, onsets_s }
    }

    fn settled(
        self,
        record: &Record,
        effect: &'static About,
        effects: &[&'static dyn Driving],
        options: &Options,
    ) -> GyroOffset {
        let step_s = self.record.step_s;
        let mut branch = settled(&self.record, self.noise, self.compared, self.onsets_s, effects, options);
        // every number of rows is equally probable
        branch.extra_weight -= (LONGEST_S / step_s).max(1.0).ln();
        let of = |record: &Record| run(record, &Models::plain(record), &branch.noise, &[], |_| {}).ln_likelihood();
        let share = of(&branch.record) - of(record);
        GyroOffset { effect, branch, lag_s: self.rows as f64 * step_s, step_s, share, ln_prior: options.prior.ln_named }
    }
}

/// The drive with its gyro moved earlier by whole rows, where named effects then explain all, beside the comparison of
/// sets on the drive as recorded, where that falls short by far before it has settled; else none. `all`: candidates of
/// the drive as recorded, of which nothing has been fitted yet; `begin`: θ to start from.
pub(crate) fn moved_at_once(
    record: &Record,
    (all, begin): (&Candidates, &Theta),
    noise: &Noise,
    effects: &[&'static dyn Driving],
    options: &Options,
) -> Option<(GyroOffset, Compared)> {
    let late = late(effects, Instrument::Gyro).filter(|_| record.wheels_share_rows())?;
    let lag = lags(record, noise).into_iter().next()?;
    let as_recorded = Compared::wide(record, noise, all.clone(), begin.clone());
    let moved = Moved::by(lag.rows, record, noise, effects, options);
    if !moved.compared.is_named() || moved.compared.top() < as_recorded.top() + HOPELESS {
        return None;
    }
    let found = moved.settled(record, late, effects, options);
    (found.branch.is_settled() && found.top() > as_recorded.top() + HOPELESS).then_some((found, as_recorded))
}

/// The drive with its gyro moved earlier by each plausible number of whole rows; empty where the gyro is on time, or
/// nothing else tells the yaw rate.
pub(crate) fn gyro_in_time(
    record: &Record,
    as_is: &PreprocessingHypothesis,
    effects: &[&'static dyn Driving],
    options: &Options,
) -> Vec<GyroOffset> {
    let late = late(effects, Instrument::Gyro).filter(|_| record.wheels_share_rows());
    let Some(late) = late else { return Vec::new() };
    let mut found: Vec<GyroOffset> = Vec::new();
    for lag in lags(record, &as_is.believed) {
        // another number of rows is another way to write down the same delay: it must be the better one
        let ways = found.iter().map(|f| (f.top(), (&f.branch, 0.0))).chain([(as_is.top(), (as_is, HOPELESS))]);
        let Some((_, (best, short))) = ways.max_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
        let earlier = record.earlier(Instrument::Gyro, lag.rows);
        if !falls_short(&earlier, (best, short), late, lag.rest_rows * record.step_s) {
            found.push(
                Moved::by(lag.rows, record, &as_is.believed, effects, options).settled(record, late, effects, options),
            );
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

/// A number of rows by which the gyro may be late, and the remaining delay, rows.
struct Lag {
    rows: usize,
    rest_rows: f64,
}

/// Lags of the gyro that explain much: the whole part, and its neighbour where the rest is near that; the nearest first.
/// Empty where the gyro is on time.
fn lags(record: &Record, noise: &Noise) -> Vec<Lag> {
    let Some(rows) = lag(record, noise) else { return Vec::new() };
    let whole = rows.floor();
    let near = [(whole - 1.0, rows - whole < NEAR), (whole, true), (whole + 1.0, rows - whole > 1.0 - NEAR)];
    let tried = near.iter().filter(|(rows, tried)| *tried && *rows >= 1.0);
    let mut lags: Vec<Lag> = tried.map(|(own, _)| Lag { rows: *own as usize, rest_rows: rows - own }).collect();
    lags.sort_by(|a, b| a.rest_rows.abs().total_cmp(&b.rest_rows.abs()));
    lags.iter_mut().for_each(|lag| lag.rest_rows = lag.rest_rows.max(0.0));
    lags
}

fn lag(record: &Record, noise: &Noise) -> Option<f64> {
    let gyro = record.gyro_rad_s.as_ref()?;
    let mut aside = *noise;
    aside.exclude([Channel::Gyro as usize]);
    // the gyro's reading without its own error, and its prediction
    let mut reads = vec![f64::NAN; record.len()];
    let mut should = reads.clone();
    let _ = run(record, &Models::plain(record), &aside, &[], |i| {
        if i.channel == Channel::Gyro {
            reads[i.row] = gyro[i.row] - record.belief.warm_up.error_rad_s(record.since_power_on_s[i.row]);
            should[i.row] = reads[i.row] - i.white * i.std;
        }
    });
    let scatter = |rows: usize| {
        let [mut count, mut sum, mut square] = [0.0; 3];
        for drive in record.drives() {
            let late = reads[drive.clone()].iter().skip(rows);
            for apart in late.zip(&should[drive]).map(|(g, w)| g - w).filter(|d| d.is_finite()) {
                (count, sum, square) = (count + 1.0, sum + apart, square + apart * apart);
            }
        }
        (count >= FEWEST).then(|| (count, square / count - (sum / count).powi(2)))
    };
    let (count, on_time) = scatter(0)?;
    let all = (1..=(LONGEST_S / record.step_s) as usize).filter_map(|n| Some((n, scatter(n)?.1)));
    let (rows, least) = all.min_by(|a, b| a.1.total_cmp(&b.1))?;
    if 0.5 * count * (on_time / least).ln() <= LARGE {
        return None;
    }
    // the vertex of the parabola through the least and its neighbours
    let [before, after] = [rows - 1, rows + 1].map(|n| scatter(n).map_or(least, |s| s.1));
    let bend = before + after - 2.0 * least;
    Some(rows as f64 + if bend > 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 })
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
