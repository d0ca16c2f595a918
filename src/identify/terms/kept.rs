//! Data that the terms are estimated from: every sample of a log, or the summary of one pass over it

use super::observed::{Column, EvenLog, Observed, neighbours};
use crate::bias::WarmUp;
use crate::error::{Error, ErrorKind, Result};
use crate::identify::types::Fit;
use crate::math::robust::mad_std;
use crate::noise::confidence::interval95;
use crate::noise::{AllanPoint, Deviation, allan};
use crate::signal::slots::fill;
use crate::signal::{Reduced, Stretch};

/// Stretches with a larger share of missing slots are no witnesses of fast noise.
const MOST_MISSING: f64 = 0.2;

/// The data of a log: all samples, or the summary of one pass.
#[derive(Debug, Clone)]
pub(super) enum Evidence<'a> {
    /// All of it.
    Whole(EvenLog),
    /// Block means and raw stretches.
    Kept(Kept<'a>),
}

#[derive(Debug, Clone)]
pub(super) struct Kept<'a> {
    /// Block means; gaps are filled.
    slow: EvenLog,
    /// Samples in a block.
    block: usize,
    /// Averaging times from here on rest on the block means, samples.
    slow_from: usize,
    stretches: Stretches<'a>,
    filled: usize,
}

/// Raw stretches of equal length. They are most of what is kept: each is filled, and its warm-up taken out, when it is looked at.
#[derive(Debug, Clone)]
pub(super) struct Stretches<'a> {
    kept: Vec<&'a Stretch>,
    step_s: f64,
    without: Option<WarmUp>,
}

impl Stretches<'_> {
    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.kept.len()
    }

    /// Samples in each.
    pub(crate) fn len(&self) -> usize {
        self.kept.first().map_or(0, |s| s.values.len())
    }

    /// One after the other.
    pub(crate) fn iter(&self) -> impl Iterator<Item = EvenLog> {
        self.kept.iter().map(|s| {
            let raw = even(s.first_s, self.step_s, s.values.clone());
            match &self.without {
                Some(model) => less(&raw, model, 1),
                None => raw,
            }
        })
    }
}

/// `values` on an even lattice that begins at `first_s`, missing ones filled as [`EvenLog::new`] does.
fn even(first_s: f64, step_s: f64, mut values: Vec<f64>) -> EvenLog {
    let missing: Vec<usize> = (0..values.len()).filter(|i| !values[*i].is_finite()).collect();
    if !missing.is_empty() {
        let pairs = values.windows(2).map(|w| w[1] - w[0]);
        let mut differences: Vec<f64> = pairs.filter(|d| d.is_finite()).collect();
        fill(&mut values, &missing, mad_std(&mut differences, 0.0) / std::f64::consts::SQRT_2, neighbours);
    }
    EvenLog { first_s, step_s, values, filled: missing.len() }
}

/// A side channel with its gaps bridged by straight lines; `None` where most of it is missing.
pub(super) fn bridged(values: &[f64]) -> Option<Vec<f64>> {
    let missing: Vec<usize> = (0..values.len()).filter(|i| !values[*i].is_finite()).collect();
    if 2 * missing.len() > values.len() {
        return None;
    }
    let mut values = values.to_vec();
    fill(&mut values, &missing, 0.0, neighbours);
    Some(values)
}

impl<'a> Evidence<'a> {
    /// The summary of one pass. Where the pass kept all samples, they are the log.
    ///
    /// # Errors
    /// [`ErrorKind::TooShort`] where a log is shorter than [`EvenLog::new`] asks for, or most of it is missing.
    pub(crate) fn of(log: &'a Reduced) -> Result<Self> {
        let coarse = &log.coarse;
        let there = coarse.means.iter().filter(|v| v.is_finite()).count();
        if there < super::observed::FEWEST || 2 * there < coarse.means.len() {
            let found = format!("{} samples in {} slots of time", log.samples(), coarse.slots());
            return Err(Error::new(ErrorKind::TooShort, "log", found)
                .hint("noise terms need a log without long gaps: cut it at the gaps"));
        }
        let slow = even(coarse.middle_s(0), coarse.block_s(), coarse.means.clone());
        if coarse.block == 1 {
            return Ok(Self::Whole(slow));
        }
        let longest = log.stretches.iter().map(|s| s.values.len()).max().unwrap_or(0);
        let usable = |s: &&Stretch| {
            let missing = s.values.iter().filter(|v| !v.is_finite()).count();
            s.values.len() == longest && (missing as f64) < MOST_MISSING * longest as f64
        };
        let kept: Vec<&Stretch> = log.stretches.iter().filter(usable).collect();
        if kept.is_empty() {
            return Err(Error::new(ErrorKind::TooShort, "log", "no stretch of it is without many gaps")
                .hint("cut the log at its gaps, or hold all of it with --memory"));
        }
        Ok(Self::Kept(Kept {
            slow,
            block: coarse.block,
            slow_from: log.coarse_from(),
            stretches: Stretches { kept, step_s: coarse.step_s, without: None },
            filled: coarse.missing,
        }))
    }

    /// The log without a warm-up.
    pub(crate) fn without(&self, fit: &Fit) -> Self {
        let model = fit.model();
        match self {
            Self::Whole(raw) => Self::Whole(less(raw, &model, 1)),
            Self::Kept(kept) => Self::Kept(Kept {
                slow: less(&kept.slow, &model, kept.block),
                stretches: Stretches { without: Some(model), ..kept.stretches.clone() },
                ..*kept
            }),
        }
    }

    /// The log in the cosine basis.
    pub(crate) fn observed(&self, columns: &[Column]) -> Observed {
        match self {
            Self::Whole(log) => Observed::new(log, columns),
            Self::Kept(kept) => Observed::of_kept(&kept.slow, kept.block, &kept.stretches, columns),
        }
    }

    /// The log, or its block means.
    pub(crate) fn slow(&self) -> &EvenLog {
        match self {
            Self::Whole(log) => log,
            Self::Kept(kept) => &kept.slow,
        }
    }

    /// Slots that were missing and filled.
    pub(crate) fn filled(&self) -> usize {
        match self {
            Self::Whole(log) => log.filled,
            Self::Kept(kept) => kept.filled,
        }
    }

    /// Sample time, s.
    pub(crate) fn step_s(&self) -> f64 {
        match self {
            Self::Whole(log) => log.step_s,
            Self::Kept(kept) => kept.slow.step_s / kept.block as f64,
        }
    }

    /// Length, s.
    pub(crate) fn span_s(&self) -> f64 {
        self.slow().span_s()
    }

    /// Averaging times for the overlapping deviation, samples: `per_decade`, and octaves. Those that rest on block means
    /// are whole blocks.
    pub(crate) fn grid(&self, per_decade: usize) -> Vec<usize> {
        let of = |longest: usize| {
            let mut grid = allan::decades(longest, per_decade);
            grid.extend(allan::octaves(longest));
            grid
        };
        let longest = Deviation::Overlapping.longest(self.slow().values.len());
        let mut grid = match self {
            Self::Whole(_) => of(longest),
            Self::Kept(kept) => {
                let fast = of(kept.slow_from - 1);
                let blocks = kept.slow_from / kept.block;
                fast.into_iter()
                    .chain(of(longest).into_iter().filter(|m| *m >= blocks).map(|m| m * kept.block))
                    .collect()
            }
        };
        grid.sort_unstable();
        grid.dedup();
        grid
    }

    /// Deviations, the overlapping one on `grid`, the others at octaves.
    pub(crate) fn deviations(&self, grid: &[usize], which: &[Deviation]) -> Vec<(Deviation, Vec<AllanPoint>)> {
        let kept = match self {
            Self::Whole(log) => {
                let theta = allan::angles(&log.values);
                let one = |deviation: &Deviation| {
                    let octaves = allan::octaves(deviation.longest(log.values.len()));
                    let averaged = if *deviation == Deviation::Overlapping { grid } else { &octaves };
                    (*deviation, allan::of_angles(&log.values, &theta, log.step_s, averaged, *deviation))
                };
                return which.iter().map(one).collect();
            }
            Self::Kept(kept) => kept,
        };
        let step_s = self.step_s();
        let theta = allan::angles(&kept.slow.values);
        let split = |deviation: &Deviation| -> (Vec<usize>, Vec<usize>) {
            let octaves = allan::octaves(deviation.longest(kept.slow.values.len() * kept.block));
            let averaged = if *deviation == Deviation::Overlapping { grid } else { &octaves };
            averaged.iter().copied().partition(|m| *m < kept.slow_from)
        };
        let (fast, slow): (Vec<_>, Vec<_>) = which.iter().map(split).unzip();
        let mut seen: Vec<Vec<Vec<AllanPoint>>> = which.iter().map(|_| Vec::new()).collect();
        for stretch in kept.stretches.iter() {
            let theta = allan::angles(&stretch.values);
            for ((seen, fast), deviation) in seen.iter_mut().zip(&fast).zip(which) {
                seen.push(allan::of_angles(&stretch.values, &theta, step_s, fast, *deviation));
            }
        }
        let one = |((deviation, seen), slow): ((&Deviation, &Vec<Vec<AllanPoint>>), &Vec<usize>)| {
            let mut points = mean_variances(seen);
            let blocks: Vec<usize> = slow.iter().map(|m| m / kept.block).collect();
            let mut means = allan::of_angles(&kept.slow.values, &theta, kept.slow.step_s, &blocks, *deviation);
            means.iter_mut().for_each(|p| p.m *= kept.block);
            points.append(&mut means);
            (*deviation, points)
        };
        which.iter().zip(&seen).zip(&slow).map(one).collect()
    }
}

/// A log, each of whose values is the mean over `block` samples, less that of the warm-up.
fn less(raw: &EvenLog, model: &WarmUp, block: usize) -> EvenLog {
    // the mean of an exponential over a block is the one in its middle times sinh(bh)/(b sinh h), h half a sample in T
    let n = block as f64;
    let half = 0.5 * raw.step_s / (n * model.time_constant_s);
    // beyond 40 time constants a block has no exponential left that a number could hold
    let swell = if block == 1 || n * half > 20.0 { 1.0 } else { (n * half).sinh() / (n * half.sinh()) };
    let settled = model.warm_error_rad_s();
    let at = |i: usize| {
        let here = model.error_rad_s(raw.first_s + i as f64 * raw.step_s);
        if block == 1 { here } else { settled + swell * (here - settled) }
    };
    EvenLog { values: raw.values.iter().enumerate().map(|(i, v)| v - at(i)).collect(), ..*raw }
}

/// Mean variances of what stretches of equal length show, each a witness of its own.
fn mean_variances(each: &[Vec<AllanPoint>]) -> Vec<AllanPoint> {
    let Some(first) = each.first() else { return Vec::new() };
    let n = each.len() as f64;
    let point = |i: usize| {
        let here: Vec<&AllanPoint> = each.iter().filter_map(|points| points.get(i)).collect();
        let variance = here.iter().map(|p| p.deviation_rad_s.powi(2)).sum::<f64>() / n;
        let mut exponents: Vec<i32> = here.iter().map(|p| p.noise_exponent).collect();
        exponents.sort_unstable();
        let degrees_of_freedom = here.iter().map(|p| p.degrees_of_freedom).sum();
        let deviation_rad_s = variance.sqrt();
        AllanPoint {
            deviation_rad_s,
            ci95: interval95(deviation_rad_s, degrees_of_freedom),
            degrees_of_freedom,
            noise_exponent: exponents[exponents.len() / 2],
            ..first[i]
        }
    };
    (0..first.len()).map(point).collect()
}
