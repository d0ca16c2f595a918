//! gyro(t) = ω(t - τ), τ longer than a row:   min over τ of Σ_k (g_k - c - ŵ(t_k - τ))²,  ŵ: yaw rate as told without the gyro
//!
//! A slope in τ says little of a delay of several rows: what the gyro reads is then no reading of the yaw rate that is, the
//! likelihood is a valley no wider than what the gyro's noise makes of yaw accelerations, and free forms that follow these
//! explain more than any delay on the way there. So the gyro is put back by whole rows, which changes no density; what is
//! left of the delay is less than a row, late still, and an effect like any other.

use super::branch::Branch;
use super::candidates::Candidates;
use super::judge::{LARGE, Options, knows, plain, settled, start};
use super::late::{earlier, share_rows};
use super::onset;
use super::pass::{Channel, Noise, run};
use super::record::Record;
use crate::effects::Parameters;
use crate::effects::drive::Driving;
use crate::gap::findings::{Part, WeightedSet};
use std::borrow::Cow;

/// Longest delay that is looked for, s: what past yaw rates are kept for.
const LONGEST_S: f64 = 0.4;
/// Variance of the gyro while it takes no part, relative.
const ASIDE: f64 = 1e10;
/// Fewest rows that are held against each other.
const FEWEST: f64 = 64.0;
/// The effect, and its parameter.
pub(super) const LATE: (&str, &str) = ("sensor.gyro_delay", "delay_s");

/// A drive whose gyro was put back to when it was true.
pub(super) struct InTime {
    /// What explains it then.
    pub(super) branch: Branch,
    lag_s: f64,
    /// Time between rows, s.
    step_s: f64,
    /// What putting it back explains alone, nats.
    share: f64,
    /// ln odds of the effect.
    ln_prior: f64,
}

impl InTime {
    /// The sets that explain it, the delay among their parts.
    pub(super) fn sets(&self) -> Vec<WeightedSet> {
        let with = |mut set: WeightedSet| {
            if let Some(rest) = set.parts.iter_mut().find(|p| p.id == LATE.0) {
                rest.share += self.share;
                *rest.parameters.entry(LATE.1.into()).or_insert(0.0) += self.lag_s;
            } else {
                let mut part = Part::new(LATE.0, true, self.share);
                part.parameters = Parameters::from([(LATE.1.into(), self.lag_s)]);
                part.std = Parameters::from([(LATE.1.into(), self.step_s / 12f64.sqrt())]);
                set.parts.insert(0, part);
                set.ln_weight += self.ln_prior;
            }
            set
        };
        self.branch.sets().into_iter().map(with).collect()
    }
}

/// The drive with its gyro put back by whole rows; none where it is on time, or nothing else but the gyro tells the yaw rate.
pub(super) fn gyro_in_time(
    record: &Record,
    as_is: &Branch,
    effects: &[&'static dyn Driving],
    options: &Options,
) -> Option<InTime> {
    let rows = (knows(effects, LATE.0) && record.torques_n_m.is_some() && share_rows(record))
        .then(|| lag(record, &as_is.believed))??;
    let moved = put_back(record, rows);
    let onsets_s = onset::of_each(&moved);
    let all = Candidates::new(&moved, effects, &options.prior, true, &onsets_s);
    let noise = as_is.believed;
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
    if rows < 1.0 || record.torques_n_m.is_none() || !share_rows(record) {
        return (Cow::Borrowed(record), delay_s);
    }
    (Cow::Owned(put_back(record, rows as usize)), (delay_s - rows * record.step_s).max(0.0))
}

/// By how many rows the gyro is late, where that explains much.
fn lag(record: &Record, noise: &Noise) -> Option<usize> {
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
    // the row before the vertex of the parabola through the least and its neighbours
    let beside = [rows - 1, rows + 1].map(|n| scatter(n).map_or(f64::INFINITY, |s| s.1));
    let rows = if beside[0] < beside[1] { rows - 1 } else { rows };
    (rows > 0).then_some(rows)
}
