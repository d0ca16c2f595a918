//! gyro(t) = ω(t - τ), τ longer than a row:   min over τ of Σ_k (g_k - c - ŵ(t_k - τ))²,  ŵ: yaw rate as told without the gyro
//!
//! A slope in τ says little of a delay of several rows: what the gyro reads is then no reading of the yaw rate that is, the
//! likelihood is a valley no wider than what the gyro's noise makes of yaw accelerations, and free forms that follow these
//! explain more than any delay on the way there. So the gyro is put back by whole rows, which changes no density; what is
//! left of the delay is less than a row, late still, and an effect like any other.

use super::begin::start;
use super::branch::Branch;
use super::candidates::Candidates;
use super::fit::Compared;
use super::judge::{HOPELESS, LARGE, Options, knows, plain, rediffused, settled};
use super::late::{earlier, share_rows};
use super::onset;
use super::pass::{Channel, Noise, run};
use super::record::Record;
use crate::effects::Parameters;
use crate::effects::drive::{Driving, late};
use crate::gap::findings::{Part, WeightedSet};
use crate::model::drive::Instrument;
use std::borrow::Cow;

/// Longest delay that is looked for, s: what past yaw rates are kept for.
const LONGEST_S: f64 = 0.4;
/// Variance of the gyro while it takes no part, relative.
const ASIDE: f64 = 1e10;
/// Rows by which a lag may be near a whole number of them.
const NEAR: f64 = 0.3;
/// Fewest rows that are held against each other.
const FEWEST: f64 = 64.0;
/// The effect ...
pub(super) const LATE: &str = late(Instrument::Gyro).id;
/// ... and its parameter, s.
pub(super) const DELAY: &str = late(Instrument::Gyro).parameters[0].name;

/// A drive whose gyro was put back to when it was true.
pub(super) struct InTime {
    /// What explains it then.
    pub(super) branch: Branch,
    /// Time by which its gyro was put back, s.
    pub(super) lag_s: f64,
    /// Time between rows, s.
    step_s: f64,
    /// What putting it back explains alone, nats.
    share: f64,
    /// ln odds of the effect.
    ln_prior: f64,
}

impl InTime {
    /// The sets that explain it, the delay among their parts: whole rows, and what is left of it, which where it is no effect of its own is
    /// the nuisance that every set has.
    pub(super) fn sets(&self) -> Vec<WeightedSet> {
        let (rest_s, std_s) = self.branch.usual(LATE).unwrap_or((0.0, self.step_s / 12f64.sqrt()));
        let with = |mut set: WeightedSet| {
            if let Some(rest) = set.parts.iter_mut().find(|p| p.id == LATE) {
                rest.share += self.share;
                *rest.parameters.entry(DELAY.into()).or_insert(0.0) += self.lag_s;
            } else {
                let mut part = Part::new(LATE, true, self.share);
                part.parameters = Parameters::from([(DELAY.into(), self.lag_s + rest_s)]);
                part.std = Parameters::from([(DELAY.into(), std_s)]);
                set.parts.insert(0, part);
                set.ln_weight += self.ln_prior;
            }
            set
        };
        self.branch.sets().into_iter().map(with).collect()
    }
}

/// The drive with its gyro put back by whole rows, by each number of them that comes near; none where it is on time, or nothing
/// else but the gyro tells the yaw rate.
pub(super) fn gyro_in_time(
    record: &Record,
    as_is: &Branch,
    effects: &[&'static dyn Driving],
    options: &Options,
) -> Vec<InTime> {
    if !knows(effects, LATE) || !share_rows(record) {
        return Vec::new();
    }
    let tried =
        lags(record, &as_is.believed).into_iter().filter_map(|rows| in_time(record, as_is, rows, effects, options));
    tried.collect()
}

/// Whether one effect leaves nothing to explain in `as_is`, and falls far short with the gyro put back, whatever is left of the delay
/// beside it.
fn is_hopeless(moved: &Record, as_is: &Branch) -> bool {
    let c = &as_is.compared;
    let members = &c.sets[0].members;
    if !as_is.is_told_by_one() {
        return false;
    }
    let own = c.candidates.only(|g| g == members[0].0 || c.candidates.groups[g].id == LATE);
    Compared::narrow(moved, &as_is.noise, own, c.theta.clone(), None).top() < c.top() - HOPELESS
}

fn in_time(
    record: &Record,
    as_is: &Branch,
    rows: usize,
    effects: &[&'static dyn Driving],
    options: &Options,
) -> Option<InTime> {
    let moved = put_back(record, rows);
    if is_hopeless(&moved, as_is) {
        return None;
    }
    let onsets_s = onset::of_each(&moved);
    let all = Candidates::new(&moved, effects, &options.prior, true, &onsets_s);
    let (noise, _) = rediffused(&moved, &as_is.believed, &all);
    let begin = start(&moved, &noise, &all);
    let mut branch = settled(moved, noise, all, &begin, onsets_s, effects, options);
    // every number of rows is as probable
    branch.extra_weight -= (LONGEST_S / record.step_s).max(1.0).ln();
    let of = |record: &Record| run(record, &plain(record), &branch.noise, &[], |_| {}).ln_likelihood();
    let share = of(&branch.record) - of(record);
    let step_s = record.step_s;
    Some(InTime { branch, lag_s: rows as f64 * step_s, step_s, share, ln_prior: options.prior.ln_named })
}

/// `record` with the readings of its gyro this many rows earlier, in each drive; the last rows are without.
fn put_back(record: &Record, rows: usize) -> Record {
    record.by_drive(|_, drive| {
        let mut out = drive.clone();
        if let Some(gyro) = &mut out.gyro_rad_s {
            earlier(gyro, rows);
        }
        out
    })
}

/// `record` with a gyro that is late by `delay_s` put back by whole rows, and what is left of the delay; as it is where it is less than a
/// row, or cannot be put back by rows.
pub(super) fn by_whole_rows(record: &Record, delay_s: f64) -> (Cow<'_, Record>, f64) {
    let rows = (delay_s / record.step_s * (1.0 + 1e-9)).floor();
    if rows < 1.0 || !share_rows(record) {
        return (Cow::Borrowed(record), delay_s);
    }
    (Cow::Owned(put_back(record, rows as usize)), (delay_s - rows * record.step_s).max(0.0))
}

/// By how many rows the gyro is late, where that explains much: whole ones, and a row more or less where what is left is near
/// one.
fn lags(record: &Record, noise: &Noise) -> Vec<usize> {
    let Some(rows) = lag(record, noise) else { return Vec::new() };
    let whole = rows.floor();
    let near = [(whole - 1.0, rows - whole < NEAR), (whole, true), (whole + 1.0, rows - whole > 1.0 - NEAR)];
    near.iter().filter(|(rows, tried)| *tried && *rows >= 1.0).map(|(rows, _)| *rows as usize).collect()
}

fn lag(record: &Record, noise: &Noise) -> Option<f64> {
    let gyro = record.gyro_rad_s.as_ref()?;
    let mut aside = *noise;
    aside.reading[Channel::Gyro as usize] *= ASIDE;
    // what the gyro reads but for its own error, and what it should
    let mut reads = vec![f64::NAN; record.len()];
    let mut should = reads.clone();
    let _ = run(record, &plain(record), &aside, &[], |i| {
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
    use super::super::clocks::tests::{recorded, robot, without};
    use super::super::judge::judge;
    use super::*;
    use crate::effects::drive::registry;
    use crate::gap::findings::Main;
    use crate::signal::names;
    use rayon::prelude::*;

    /// Rows are 10 ms apart. Of the delays those that are not found, with what is told of them. A twentieth of a
    /// row is what stamps are true to.
    fn not_found(delays_s: &[f64]) -> Vec<(f64, f64, f64)> {
        let tried = |(i, delay_s): (usize, f64)| {
            let log = recorded(40.0, 41 + i as u64, Some((LATE, DELAY, delay_s)));
            let record = Record::new(&robot(), &log, 0.0).unwrap();
            let findings = judge(&record, registry(), &Options::default()).findings;
            let mains = findings.mains();
            let set = findings.best_with(LATE, false);
            let [found, std] = set
                .and_then(|s| s.part(LATE))
                .map_or([f64::NAN; 2], |part| [&part.parameters, &part.std].map(|of| of[DELAY]));
            println!("{delay_s} s: {found:.6} ± {std:.6}, {:?}", mains[0]);
            let right = mains[0].0 == Main::Effect(LATE.into());
            (!right || !((found - delay_s).abs() < 3.0 * std) || std > 0.0005).then_some((delay_s, found, std))
        };
        delays_s.to_vec().into_par_iter().enumerate().filter_map(tried).collect()
    }

    #[test]
    fn a_gyro_that_is_late_by_a_row_and_a_little_is_found() {
        assert_eq!(not_found(&[0.01008]), []);
    }

    /// Without torques nothing tells accelerations but the speeds themselves: how far the filter has come in the last step, and what noise
    /// has added.
    #[test]
    fn without_torques_a_late_gyro_is_found_to_a_tenth() {
        for (seed, delay_s) in [(51, 0.004), (52, 0.013)] {
            let log = recorded(60.0, seed, Some((LATE, DELAY, delay_s)));
            let log = without(log, &[names::TORQUE_LEFT, names::TORQUE_RIGHT]);
            let record = Record::new(&robot(), &log, 0.0).unwrap();
            let findings = judge(&record, registry(), &Options::default()).findings;
            let set = findings.best_with(LATE, false).unwrap();
            let part = set.part(LATE).unwrap();
            let (found, std) = (part.parameters[DELAY], part.std[DELAY]);
            assert!((found - delay_s).abs() < 4.0 * std + 0.1 * delay_s, "{delay_s} s: {found} ± {std}");
            assert!(std < 0.001, "{std}");
        }
    }

    #[test]
    #[ignore = "two minutes; cargo test --lib gap::drive::lag -- --ignored"]
    fn a_gyro_that_is_late_by_about_a_row_is_found() {
        assert_eq!(not_found(&[0.005, 0.0061, 0.008, 0.0096, 0.01008, 0.011, 0.014]), []);
    }
}
