//! bin(row): which bin of a condition a row belongs to

use crate::gap::rest::predictive::curve::Over;
use crate::model::Scene;

/// Bins of a condition, at most.
const BINS: usize = 24;
/// Blocks in which the temperature is averaged before its rate is taken ...
const RATE_BLOCKS: usize = 512;
/// ... over so many of them on both sides.
const RATE_REACH: usize = 4;

/// One condition and the rows in each of its bins.
pub(super) struct Condition {
    pub over: Over,
    /// Bin of each row; none for a row without a sample.
    pub bin: Vec<Option<u16>>,
    /// Mean of the condition in each bin.
    pub x: Vec<f64>,
    /// From where to where it reaches.
    pub edges: Vec<[f64; 2]>,
}

/// The conditions that `scene` has, with bins for the rows that are `there`.
pub(super) fn conditions(scene: &Scene, there: &[bool]) -> Vec<Condition> {
    let elapsed: Vec<f64> = (0..scene.len()).map(|row| scene.time.at(row)).collect();
    let rate = scene.temperature_c.as_ref().map(|t| rate_of_change(t, scene.step_s));
    let by_count = |over, values: &Option<Vec<f64>>| {
        values.as_ref().and_then(|v| Condition::new(over, v, there, &equal_counts(v, there)))
    };
    [
        by_count(Over::TemperatureC, &scene.temperature_c),
        by_count(Over::TemperatureRate, &rate),
        by_count(Over::SupplyV, &scene.supply_v),
        Condition::new(Over::ElapsedTime, &elapsed, there, &log_edges(&elapsed)),
    ]
    .into_iter()
    .flatten()
    .collect()
}

impl Condition {
    /// Of `values` between inner `edges`, ascending; none if there are fewer than three bins with rows.
    fn new(over: Over, values: &[f64], there: &[bool], edges: &[f64]) -> Option<Self> {
        let mut count = vec![0_usize; edges.len() + 1];
        let mut sum = vec![0.0; edges.len() + 1];
        let mut range = vec![[f64::INFINITY, f64::NEG_INFINITY]; edges.len() + 1];
        let raw: Vec<Option<usize>> = values
            .iter()
            .zip(there)
            .map(|(v, there)| {
                if !there || !v.is_finite() {
                    return None;
                }
                let bin = edges.partition_point(|e| e <= v);
                count[bin] += 1;
                sum[bin] += v;
                range[bin] = [range[bin][0].min(*v), range[bin][1].max(*v)];
                Some(bin)
            })
            .collect();
        // a difference needs two rows
        let kept: Vec<usize> = (0..count.len()).filter(|b| count[*b] >= 2).collect();
        if kept.len() < 3 {
            return None;
        }
        let mut number = vec![None; count.len()];
        kept.iter().enumerate().for_each(|(i, b)| number[*b] = u16::try_from(i).ok());
        Some(Self {
            over,
            bin: raw.into_iter().map(|b| b.and_then(|b| number[b])).collect(),
            x: kept.iter().map(|b| sum[*b] / count[*b] as f64).collect(),
            edges: kept.iter().map(|b| range[*b]).collect(),
        })
    }
}

/// Edges that cut the values into bins with about the same number of rows.
fn equal_counts(values: &[f64], there: &[bool]) -> Vec<f64> {
    let mut sorted: Vec<f64> =
        values.iter().zip(there).filter(|(v, there)| **there && v.is_finite()).map(|(v, _)| *v).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let bins = BINS.min(sorted.len() / 8).max(1);
    let mut edges: Vec<f64> = (1..bins).filter_map(|i| sorted.get(i * sorted.len() / bins).copied()).collect();
    edges.dedup();
    edges
}

/// Edges evenly spaced in the logarithm of the time since power-on; the first bin reaches down to the first row.
fn log_edges(elapsed: &[f64]) -> Vec<f64> {
    let (Some(first), Some(last)) = (elapsed.first(), elapsed.last()) else { return Vec::new() };
    // eight octaves are what a panel can show
    let low = first.max(last / 512.0);
    let ratio = last / low;
    if !(ratio > 1.0) {
        return Vec::new();
    }
    (1..BINS).map(|i| low * ratio.powf(i as f64 / BINS as f64)).collect()
}

/// °C/s, from block means: a sensor of coarse resolution has no rate from row to row.
fn rate_of_change(temperature_c: &[f64], step_s: f64) -> Vec<f64> {
    let block = temperature_c.len().div_ceil(RATE_BLOCKS).max(1);
    let means: Vec<f64> = temperature_c.chunks(block).map(|c| c.iter().sum::<f64>() / c.len() as f64).collect();
    let at = |b: usize| {
        let (from, to) = (b.saturating_sub(RATE_REACH), (b + RATE_REACH).min(means.len() - 1));
        if to > from { (means[to] - means[from]) / ((to - from) as f64 * block as f64 * step_s) } else { 0.0 }
    };
    (0..temperature_c.len()).map(|row| at(row / block)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_hold_about_equally_many_rows_and_their_own_values() {
        let values: Vec<f64> = (0..4800).map(|i| f64::from(i).sqrt()).collect();
        let there: Vec<bool> = (0..4800).map(|i| i % 5 != 0).collect();
        let c = Condition::new(Over::SupplyV, &values, &there, &equal_counts(&values, &there)).unwrap();
        assert_eq!(c.x.len(), BINS);
        for (b, [low, high]) in c.edges.iter().enumerate() {
            let rows: Vec<usize> = (0..4800).filter(|i| c.bin[*i] == Some(b as u16)).collect();
            assert!(rows.len().abs_diff(160) <= 1 && *low <= c.x[b] && c.x[b] <= *high);
            assert!(rows.iter().all(|i| there[*i] && (*low..=*high).contains(&values[*i])));
        }
        let constant = vec![5.0; 4800];
        assert!(Condition::new(Over::SupplyV, &constant, &there, &equal_counts(&constant, &there)).is_none());
    }

    #[test]
    fn a_coarse_sensor_has_a_smooth_rate() {
        // 0.01 °C/s read to 0.1 °C at 10 Hz
        let temperature: Vec<f64> = (0..20_000).map(|i| (0.001 * f64::from(i) * 10.0).round() / 10.0).collect();
        let rate = rate_of_change(&temperature, 0.1);
        assert!(rate[1000..19_000].iter().all(|r| (r - 0.01).abs() < 0.003));
    }
}
