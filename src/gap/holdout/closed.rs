//! gap closed = (after - before)/(floor - before) in log score, with an interval by blocks of time
//!
//! The interval is by bootstrap: blocks of rows are drawn with replacement, the same for both models and the floor, and
//! the simulated recordings of the floor too; it holds the middle 95 % of the ratios. Blocks keep the correlation that
//! a wrong model leaves (Künsch, Annals of Statistics 17 (1989) 1217; here the blocks do not overlap).

use super::Options;
use crate::math::NORMAL_975;
use crate::math::random::Stream;

/// Fewest blocks of a recording.
const FEWEST_BLOCKS: usize = 20;
/// Least expected gain of a gap, nats: a single superfluous parameter may gain as much by chance.
const LEAST_GAIN_NATS: f64 = 2.0;
/// Gain below which a level of white noise is not named, nats: its prior, and ln n / 2 for one more parameter of n
/// rows.
const UNNAMED_NATS: f64 = 8.0;
/// Largest number of blocks, with which [`block_rows`] begins.
const MOST_BLOCKS: usize = 400;

/// Share of the gap that a model closes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closed {
    /// The share; none where there is no measurable gap.
    pub estimate: Option<f64>,
    /// Its 95 % interval; none where the share is none or the interval is unbounded.
    pub ci95: Option<[f64; 2]>,
    /// Whether the floor is the score before plus the expected gain (see `gap_closed`).
    pub paired: bool,
    /// Gain in the log score of the whole recording, nats.
    pub gained_nats: f64,
    /// Gain of the augmented simulator over the nominal one on its own recordings, nats: the gain to be expected if it
    /// were right. Unlike in the floor, chance in the white noise cancels in it.
    pub expected_gain_nats: f64,
}

/// Log densities by rows.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Scores<'a> {
    /// Under the nominal simulator.
    pub before: &'a [f64],
    /// Under the model in question.
    pub after: &'a [f64],
    /// Of the augmented simulator on each of its own recordings.
    pub floor: Vec<&'a [f64]>,
    /// Total of the nominal simulator on each of these recordings, nats.
    pub own_before: Vec<f64>,
    /// ½ Σ ln r, r the variance of the recording's white noise over that of these recordings: lowers the floor, nats.
    pub level_nats: f64,
}

/// Sums over blocks of `rows` rows; a remainder shorter than half a block is added to the last block.
pub(in crate::gap) fn block_sums(values: &[f64], rows: usize) -> Vec<f64> {
    let rows = rows.max(1);
    let mut sums: Vec<f64> = values.chunks(rows).map(|b| b.iter().sum()).collect();
    let rest = values.len() % rows;
    if sums.len() > 1 && rest > 0 && 2 * rest < rows {
        let rest = sums.pop().unwrap_or(0.0);
        if let Some(last) = sums.last_mut() {
            *last += rest;
        }
    }
    sums
}

/// Length of a block, rows: doubled until the gains of neighbouring blocks are no longer correlated beyond chance, as
/// long as 20 blocks remain.
#[must_use]
pub(crate) fn block_rows(before: &[f64], after: &[f64]) -> usize {
    let gain: Vec<f64> = before.iter().zip(after).map(|(b, a)| a - b).collect();
    let mut rows = gain.len().div_ceil(MOST_BLOCKS).max(4);
    while gain.len() / (2 * rows) >= FEWEST_BLOCKS {
        let sums = block_sums(&gain, rows);
        let n = sums.len() as f64;
        let mean = sums.iter().sum::<f64>() / n;
        let variance: f64 = sums.iter().map(|s| (s - mean).powi(2)).sum();
        let neighbours: f64 = sums.windows(2).map(|w| (w[0] - mean) * (w[1] - mean)).sum();
        if !(neighbours > 1.64 * variance / n.sqrt()) {
            break;
        }
        rows *= 2;
    }
    rows
}

fn std(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len().max(2) - 1) as f64).sqrt()
}

/// Share of the gap that is closed.
///
/// The score of a recording scatters by √(rows/2) nats from chance in the white noise alone. White noise larger by the
/// factor 1 + δ lowers it by rows·δ, which no model can recover: knowing δ gains rows·δ², and a level that gains less
/// than 8 nats is not named. The floor of a recording with louder noise is lower by [`Scores::level_nats`].
/// A gap that does not exceed two standard deviations of this chance plus that of an unnamed level, and every gap under
/// [`Options::whole_log`] or [`Options::in_pairs`], is measured in pairs. The floor is then the nominal score on the
/// recording plus the expected gain, so that chance cancels; the interval is that of the gain over simulated
/// recordings, or over blocks of this one where they scatter more. The share is none where the expected gain is not above 2 nats.
#[must_use]
pub(crate) fn gap_closed(scores: &Scores<'_>, block_rows: usize, options: &Options) -> Closed {
    let total = |v: &[f64]| v.iter().sum::<f64>();
    let (before, after) = (total(scores.before), total(scores.after));
    let floors: Vec<f64> = scores.floor.iter().map(|f| total(f)).collect();
    let gains: Vec<f64> = floors.iter().zip(&scores.own_before).map(|(f, b)| f - b).collect();
    let logs = floors.len().max(1) as f64;
    let floor = floors.iter().sum::<f64>() / logs;
    let expected_gain_nats = gains.iter().sum::<f64>() / logs;
    let gained_nats = after - before;
    let gap = floor - before - scores.level_nats;
    // rows·δ at the largest δ that is not named, in standard deviations √(rows/2) of the score
    let by_noise = (2.0 * UNNAMED_NATS).sqrt();
    if !options.whole_log && !options.in_pairs && floors.len() >= 2 && gap > (2.0 + by_noise) * std(&floors) {
        let ci95 = resampled(scores, block_rows, options);
        return Closed { estimate: Some(gained_nats / gap), ci95, paired: false, gained_nats, expected_gain_nats };
    }
    let resolved = gains.len() >= 2 && expected_gain_nats > LEAST_GAIN_NATS;
    let estimate = resolved.then(|| gained_nats / expected_gain_nats);
    // on a recording that the model does not describe the gain scatters more than on the model's own
    let each: Vec<f64> = scores.after.iter().zip(scores.before).map(|(a, b)| a - b).collect();
    let sums = block_sums(&each, block_rows);
    let scatter = std(&gains).max(std(&sums) * (sums.len() as f64).sqrt());
    let ci95 = estimate.map(|share| {
        let half = NORMAL_975 * scatter * (1.0 + 1.0 / logs).sqrt() / expected_gain_nats;
        [share - half, share + half]
    });
    Closed { estimate, ci95, paired: true, gained_nats, expected_gain_nats }
}

/// Middle 95 % of the ratio over resampled blocks and recordings; none where more than one gap in 40 is not positive.
fn resampled(scores: &Scores<'_>, block_rows: usize, options: &Options) -> Option<[f64; 2]> {
    let (before, after) = (block_sums(scores.before, block_rows), block_sums(scores.after, block_rows));
    let floors: Vec<Vec<f64>> = scores.floor.iter().map(|f| block_sums(f, block_rows)).collect();
    let (blocks, logs) = (before.len(), floors.len());
    let mut draw = Stream::new(options.seed, u64::MAX);
    let mut pick = |n: usize| ((draw.uniform() * n as f64) as usize).min(n - 1);
    let mut ratios = Vec::with_capacity(options.draws);
    let mut floor = vec![0.0; blocks];
    let level_nats = scores.level_nats / blocks as f64;
    for _ in 0..options.draws {
        floor.fill(0.0);
        for _ in 0..logs {
            let log = &floors[pick(logs)];
            floor.iter_mut().zip(log).for_each(|(f, l)| *f += l / logs as f64);
        }
        let (mut gained, mut gap) = (0.0, 0.0);
        for _ in 0..blocks {
            let b = pick(blocks);
            gained += after[b] - before[b];
            gap += floor[b] - before[b] - level_nats;
        }
        if gap > 0.0 {
            ratios.push(gained / gap);
        }
    }
    if options.draws == 0 || 40 * (options.draws - ratios.len()) > options.draws {
        return None;
    }
    ratios.sort_by(f64::total_cmp);
    let quantile = |p: f64| ratios[((p * ratios.len() as f64) as usize).min(ratios.len() - 1)];
    Some([quantile(0.025), quantile(0.975)])
}
