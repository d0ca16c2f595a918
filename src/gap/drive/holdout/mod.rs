//! Share of the gap of a drive that a set of effects closes, on a hold-out recording.
//!
//! Log score: Σ ln p(reading | readings before). C2, C1, T and all else that is drawn anew in each run are integrated
//! over their priors: ln p = -½ Σ (ν²/S + ln 2πS) - ½ ln det(I + U G U) + ½ b'(G + U⁻²)⁻¹ b. Where the wheels' readings lie
//! on a lattice the density is probability / lsb, under every model alike: a smooth density at the points of a lattice could
//! exceed what any model of the lattice can reach.
//! Horizons: the model drives without readings, with the recorded torques (where there are none: with the wheels), from
//! the pose at the beginning of each window; and the filter of the model does, with wheels and gyro.

pub(crate) mod horizons;
pub(crate) mod navigating;
pub(crate) mod simulate_fitted;
pub(crate) mod traces;
mod under;
use self::horizons::{Horizons, horizon_metrics, misled};
use self::simulate_fitted::own;
use self::under::Under;
use super::ekf::effect_set::{EffectSet, Effects};
use super::ekf::innovations::run;
use super::fit::evidence::{Group, Nuisance, Problem};
use super::preprocess::lost_ticks::LostTicks;
use super::preprocess::start_heading;
use super::record::Record;
use super::regressors::basis::{COSINES, Column, nuisances};
use crate::effects::{Library, Parameters};
use crate::gap::answer::Metric;
use crate::gap::drive::ekf::noise::{Channel, Process};
use crate::gap::holdout::{Closed, Options, Scores, block_rows, gap_closed};
use rayon::prelude::*;
use statrs::function::erf::erfc;
use std::ops::Range;

/// Intervals of the grid of times at which a bias step may lie.
const STEPS: usize = 96;

/// Measures of the gap on the hold-out recording.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DriveFar {
    /// Measures, `log_score` first: before, after and floor.
    pub metrics: Vec<Metric>,
    /// Share that each effect closes alone.
    pub alone: Vec<(String, Closed)>,
    /// Share that all effects together close.
    pub together: Closed,
    /// The effect nearest to an unknown cause, and the measures with it alone; none where there is no such effect.
    pub nearest: Option<(String, Vec<Metric>)>,
    /// Of several hold-out drives, the share closed in each by all effects together or, where none were found, by the
    /// nearest one.
    pub each: Vec<(String, Closed)>,
    /// Standard deviations by which the navigation filter's position error with all effects together exceeds that
    /// without, or the error that it may have; the lesser of both.
    pub misled: f64,
}

/// Effects whose shares of the gap are measured.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sought<'a> {
    /// Those judged present.
    pub together: &'a Effects,
    /// Each of them alone.
    pub listed: &'a Effects,
    /// Effect that is added alone.
    pub nearest: Option<&'a (String, Parameters)>,
}

/// Score of a recording under a model.
struct Scored {
    /// Bursts of lost ticks in each drive, where they are claimed
    lost: Vec<Option<LostTicks>>,
    /// ln densities of its rows, nats
    rows: Vec<f64>,
}

impl Under<'_> {
    fn is(&self, other: &Self) -> bool {
        std::ptr::eq(self.record, other.record) && std::ptr::eq(self.claimed, other.claimed)
    }

    /// Bursts of lost ticks in each drive, where they are claimed.
    fn lost(&self) -> Vec<Option<LostTicks>> {
        let of = |drive: Record| self.claimed.bursts(&drive, &self.claimed.noise(&drive, self.process));
        self.record.apart().map(of).collect()
    }

    /// ln densities of the rows, nats, of each drive by itself: effects have known parameters, all else is the drive's
    /// own.
    fn score(&self) -> Scored {
        let lost = self.lost();
        let one = |(drive, lost): (Record, &Option<LostTicks>)| score_drive(&drive, lost.as_ref(), self);
        let rows = self.record.apart().zip(&lost).flat_map(one).collect();
        Scored { lost, rows }
    }

    /// Errors at each horizon, with ticks lost as in `lost`; `alone`: without readings within the window.
    fn horizons(&self, lost: &[Option<LostTicks>], alone: bool) -> Horizons {
        let mut all = Horizons::default();
        self.record.apart().zip(lost).for_each(|(drive, lost)| all.add(&drive, lost.as_ref(), self, alone));
        all
    }
}

/// An innovation without its slopes.
struct Kept {
    row: usize,
    channel: Channel,
    white: f64,
    std: f64,
}

fn score_drive(record: &Record, bursts: Option<&LostTicks>, under: &Under) -> Vec<f64> {
    let claimed = under.claimed;
    let noise = claimed.noise(record, under.process);
    // step of the readings' lattice, and the variance of rounding to it that S holds
    let claimed_lsb = claimed.wheel_lsb_rad_s.map(|lsb| (lsb, lsb * lsb / 12.0));
    let lattice_of_wheels = claimed_lsb.or_else(|| record.wheel_lsb_rad_s().map(|lsb| (lsb, 0.0)));
    let restored;
    let (record, extra) = match bursts {
        Some(b) => {
            restored = b.restored(record);
            (&restored, b.ln_path + b.ln_jacobian())
        }
        None => (record, 0.0),
    };
    let (record, models) = claimed.read(record);
    let record = record.as_ref();
    // quantities drawn anew in each run: columns with their priors
    let mut columns = Vec::new();
    let mut nuisance = Vec::new();
    let walk = claimed.walk_rad_s_sqrt_s.filter(|_| record.gyro_rad_s.is_some());
    let walk = walk.into_iter().flat_map(|walk| {
        let std = move |n: usize| walk * (2.0 * record.span_s()).sqrt() / (n as f64 * std::f64::consts::PI);
        (1..COSINES).map(move |n| (Column::GyroCosine(n), std(n)))
    });
    let own = nuisances(record).into_iter().map(|(one, std)| (one.column, std));
    for (column, std) in own.chain(walk) {
        nuisance.push(Nuisance::new(columns.len(), std));
        columns.push(column);
    }
    let first = columns.len();
    let step = claimed.step_rad_s.filter(|_| record.gyro_rad_s.is_some());
    let times: Vec<f64> = (1..STEPS).map(|i| record.span_s() * i as f64 / STEPS as f64).collect();
    if step.is_some() {
        columns.extend(times.iter().map(|t| Column::GyroStep(*t)));
    }
    // slopes by all possible times of a step would need much memory
    let (mut kept, mut slopes) = (Vec::new(), Vec::new());
    let summed = run(record, &models, &noise, &columns, |i| {
        if step.is_none() {
            kept.push(Kept { row: i.row, channel: i.channel, white: i.white, std: i.std });
            slopes.extend_from_slice(i.slopes);
        }
    });
    let here = vec![0.0; columns.len()];
    let plain = Problem::new(&summed.gram, summed.ln_volume, &here, Vec::<Group>::new(), nuisance.clone());
    // the most likely time of the step, and the cost of not knowing it
    let mut shift = vec![0.0; columns.len()];
    let mut chosen = plain;
    let mut at_best = None;
    if let Some(step) = step {
        let at = |i: usize| {
            let mut shift = vec![0.0; columns.len()];
            shift[first + i] = -step;
            // the data less the step: linearised with the opposite sign
            Problem::new(&summed.gram, summed.ln_volume, &shift, Vec::<Group>::new(), nuisance.clone())
        };
        let (best, problem) = (0..times.len())
            .map(|i| (i, at(i)))
            .max_by(|a, b| a.1.ln_evidence(&[]).total_cmp(&b.1.ln_evidence(&[])))
            .unwrap_or_else(|| (0, at(0)));
        shift[first + best] = step;
        chosen = problem;
        at_best = Some(first + best);
    }
    let total = chosen.ln_evidence(&[]) + extra - if step.is_some() { (times.len() as f64).ln() } else { 0.0 };
    for (column, mean, _) in chosen.coefficients(&[]) {
        shift[column] += mean;
    }
    let mut rows = vec![0.0; record.len()];
    let mut lattice = 0.0;
    let mut take = |i: &Kept, slopes: &[f64], shift: &[f64]| {
        let explained: f64 = slopes.iter().zip(shift).map(|(s, b)| s * b).sum();
        let white = i.white - explained;
        let normal = -0.5 * (white * white + (std::f64::consts::TAU * i.std * i.std).ln());
        let wheel = matches!(i.channel, Channel::WheelLeft | Channel::WheelRight);
        rows[i.row] += match lattice_of_wheels.filter(|_| wheel) {
            Some((lsb, rounding)) => {
                let spread = (i.std * i.std - rounding).max(1e-12 * lsb * lsb).sqrt();
                let on = on_lattice(white * i.std, spread, lsb);
                lattice += on - normal;
                on
            }
            None => normal,
        };
    };
    if let Some(best) = at_best {
        // of the columns of a step, only that of the chosen time
        let own: Vec<usize> = (0..first).chain([best]).collect();
        let (columns, shift): (Vec<Column>, Vec<f64>) = own.into_iter().map(|c| (columns[c], shift[c])).unzip();
        let _ = run(record, &models, &noise, &columns, |i| {
            take(&Kept { row: i.row, channel: i.channel, white: i.white, std: i.std }, i.slopes, &shift);
        });
    } else {
        let p = columns.len();
        kept.iter().enumerate().for_each(|(n, i)| take(i, &slopes[n * p..(n + 1) * p], &shift));
    }
    // the cost of the integration is spread evenly over the rows
    let rest = (total + lattice - rows.iter().sum::<f64>()) / rows.len() as f64;
    rows.iter_mut().for_each(|r| *r += rest);
    rows
}

/// ln [Φ((e + q/2)/s) - Φ((e - q/2)/s)] - ln q
fn on_lattice(error: f64, std: f64, lsb: f64) -> f64 {
    let z = |x: f64| x / (std * std::f64::consts::SQRT_2);
    // computed from the small tail
    let e = error.abs();
    let mass = 0.5 * (erfc(z(e - 0.5 * lsb)) - erfc(z(e + 0.5 * lsb)));
    mass.max(1e-300).ln() - lsb.ln()
}

/// The second half of each drive of a record.
#[must_use]
pub(crate) fn second_half(record: &Record) -> Record {
    let half = record.by_drive(|_, drive| drive.window(drive.len() / 2..drive.len()));
    start_heading::told(&half).map_or(half, |told| told.0)
}

/// ln densities of the rows of `kept` under the nominal simulator with `effects`.
#[must_use]
pub(crate) fn rows(kept: &Record, library: &Library, effects: &Effects, process: Process) -> Vec<f64> {
    Under { record: kept, claimed: &EffectSet::new(effects, library), process }.score().rows
}

/// Gains of `effects` over the nominal simulator on simulated recordings like `kept` that hold them, nats.
#[must_use]
pub(crate) fn expected_gains(
    kept: &Record,
    library: &Library,
    effects: &Effects,
    process: Process,
    options: &Options,
) -> Vec<f64> {
    let (with, nominal) = (EffectSet::new(effects, library), EffectSet::new(&[], library));
    let gain = |log: u64| {
        let record = own(kept, &with, process, options.seed.wrapping_add(log));
        let total = |claimed: &EffectSet| Under { record: &record, claimed, process }.score().rows.iter().sum::<f64>();
        total(&with) - total(&nominal)
    };
    (0..options.simulated_logs as u64).into_par_iter().map(gain).collect()
}

/// Gain of `effects` on `kept` over the nominal simulator, nats a row.
#[must_use]
pub(crate) fn gain(kept: &Record, library: &Library, effects: &Effects, process: Process) -> f64 {
    let total = |effects: &Effects| rows(kept, library, effects, process).iter().sum::<f64>();
    (total(effects) - total(&[])) / kept.len().max(1) as f64
}

/// Measures the gap on `kept`, with the effects of `sought`.
#[must_use]
pub(crate) fn measure(
    kept: &Record,
    library: &Library,
    sought: &Sought,
    process: Process,
    options: &Options,
) -> DriveFar {
    let Sought { together, listed, nearest } = *sought;
    let nominal = EffectSet::new(&[], library);
    let found = (!together.is_empty()).then(|| EffectSet::new(together, library));
    let all = found.as_ref().unwrap_or(&nominal);
    let logs: Vec<Record> = (0..options.simulated_logs as u64)
        .into_par_iter()
        .map(|i| own(kept, all, process, options.seed.wrapping_add(i)))
        .collect();
    let singles: Vec<EffectSet> = listed.iter().map(|one| EffectSet::new(std::slice::from_ref(one), library)).collect();
    let single = |i: usize| if together == &listed[i..=i] { all } else { &singles[i] };
    // each recording under each model once, in parallel
    let under = |record, claimed| Under { record, claimed, process };
    let mut sought: Vec<Under> = Vec::new();
    let mut place = |record, claimed| {
        let one = under(record, claimed);
        sought.iter().position(|s| s.is(&one)).unwrap_or_else(|| {
            sought.push(one);
            sought.len() - 1
        })
    };
    let (before_at, after_at) = (place(kept, &nominal), place(kept, all));
    let floors_at: Vec<[usize; 2]> = logs.iter().map(|log| [place(log, all), place(log, &nominal)]).collect();
    let listed_at: Vec<usize> = (0..listed.len()).map(|i| place(kept, single(i))).collect();
    let scored: Vec<Scored> = sought.par_iter().map(Under::score).collect();
    let (before, after) = (&scored[before_at].rows, &scored[after_at].rows);
    let (floors, own_before): (Vec<&Vec<f64>>, Vec<&Vec<f64>>) =
        floors_at.iter().map(|at| at.map(|at| &scored[at].rows).into()).unzip();
    let closed_in = |after: &[f64], rows: Range<usize>| {
        let scores = Scores {
            before: &before[rows.clone()],
            after: &after[rows.clone()],
            floor: floors.iter().map(|f| &f[rows.clone()]).collect(),
            own_before: own_before.iter().map(|o| o[rows.clone()].iter().sum()).collect(),
            level_nats: 0.0,
        };
        gap_closed(&scores, block_rows(scores.before, scores.after), options)
    };
    let closed = |after: &[f64]| closed_in(after, 0..kept.len());
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len().max(1) as f64;
    let mean_of = |all: &[&Vec<f64>]| all.iter().map(|rows| mean(rows)).sum::<f64>() / all.len().max(1) as f64;
    let floor =
        if options.in_pairs { mean(before) + mean_of(&floors) - mean_of(&own_before) } else { mean_of(&floors) };
    let log_score =
        |after: &[f64]| Metric { metric: "log_score".into(), before: mean(before), after: mean(after), floor };
    let mut metrics = vec![log_score(after)];
    let mut with_nearest = Vec::new();
    let near_at = nearest.and_then(|near| listed.iter().position(|one| one == near));
    let near = nearest.map(|one| EffectSet::new(std::slice::from_ref(one), library));
    let drives = [("", true), ("filter_", false)];
    let of = |at: usize, alone: bool| sought[at].horizons(&scored[at].lost, alone);
    let of_near = |alone: bool| match near_at {
        Some(i) => of(listed_at[i], alone).rms(),
        None => near.as_ref().and_then(|near| {
            let near = under(kept, near);
            near.horizons(&near.lost(), alone).rms()
        }),
    };
    let reached = |(_, alone): &(&str, bool)| {
        let floor = || floors_at.first().map(|at| of(at[0], *alone)).unwrap_or_default();
        let (kept, others) = rayon::join(
            || rayon::join(|| of(before_at, *alone), || of(after_at, *alone)),
            || rayon::join(floor, || of_near(*alone)),
        );
        ([kept.0, kept.1, others.0], others.1)
    };
    let horizons: Vec<_> = drives.par_iter().map(reached).collect();
    let misled = misled(&horizons[1].0.each_ref().map(Horizons::ln_positions));
    for ((prefix, _), (errors, near)) in drives.into_iter().zip(horizons) {
        let [before, after, floor] = errors.map(|e| e.rms());
        let Some((before, floor)) = before.zip(floor) else { continue };
        let told = |after: [[f64; 2]; 3]| horizon_metrics(prefix, [before, after, floor]);
        metrics.extend(after.into_iter().flat_map(told));
        with_nearest.extend(near.into_iter().flat_map(told));
    }
    let mut alone = Vec::with_capacity(listed.len());
    let mut nearest_score = None;
    let mut found = after;
    for (one, at) in listed.iter().zip(listed_at) {
        let rows = &scored[at].rows;
        if nearest.is_some_and(|(id, _)| *id == one.0) {
            nearest_score = Some(log_score(rows));
            if together.is_empty() {
                found = rows;
            }
        }
        alone.push((one.0.clone(), closed(rows)));
    }
    let nearest = nearest.map(|(id, _)| (id.clone(), nearest_score.into_iter().chain(with_nearest).collect()));
    let together = closed(after);
    let several = kept.sources.iter().cloned().zip(kept.drives()).filter(|_| kept.starts.len() > 1);
    let each = several.map(|(source, rows)| (source, closed_in(found, rows))).collect();
    DriveFar { metrics, alone, together, nearest, each, misled }
}
