//! z = C y: the recording in the orthonormal cosine basis C, in bins of frequency
//!
//! Random walks and white noise are independent there ([`crate::math::dct`]), other spectra nearly so. Columns of
//! signals are stored as their lowest coefficients, computed from block means. Inner products of columns with each
//! other and with the recording are stored by bins, so that a likelihood under any smooth spectrum costs a few hundred
//! products whatever the length of the recording.

use super::memo::Memo;
use crate::math::binned::{Bins, BlockCosine};
use crate::math::dct::Cosine;
use crate::math::random::Stream;
use crate::model::Scene;
use crate::signal::TimeAxis;
use std::collections::HashMap;
use std::sync::{Arc, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

/// Most blocks, whose means hold the slow part of a recording.
const BLOCKS: usize = 2048;
/// Standard deviation of white noise that is added to every recording (dither), relative to the nominal white noise:
/// where a low-pass leaves next to nothing, leakage from the ends of the recording would be taken for a signal. It
/// costs 0.2 % of the information where nothing was filtered.
const DITHER: f64 = 0.045;
/// Most blocks over which the noise level is followed.
const LEVEL_BLOCKS: usize = 128;

/// A column in the cosine basis: its lowest coefficients, or all of them.
struct Stored {
    low: Vec<f64>,
    /// Root mean square over the recording.
    rms: f64,
}

/// Index of a stored column.
pub(crate) type ColumnId = u32;

#[derive(Default)]
struct Store {
    columns: Vec<Stored>,
    variance: HashMap<usize, Arc<Vec<Vec<f64>>>>,
    variance_scales: HashMap<usize, Arc<Vec<f64>>>,
}

/// Quantities common to all hypotheses about one recording: scene, bins, stored columns and their products.
pub(crate) struct SpectralBasis {
    /// The recording's scene, cut to a whole number of blocks.
    pub scene: Scene,
    /// The scene with block means in place of samples.
    pub coarse: Scene,
    /// Samples in a block.
    pub block: usize,
    /// Bins of the coefficients.
    pub bins: Bins,
    cosine: Cosine,
    slow: BlockCosine,
    store: RwLock<Store>,
    gram: Memo<(ColumnId, ColumnId), Arc<Vec<f64>>>,
}

/// A series in this frame: the recording, or its remainder after a part was taken out.
#[derive(Clone)]
pub(crate) struct Data {
    /// Deviation from the nominal warm-up, rad/s.
    pub values_rad_s: Vec<f64>,
    /// Its cosine coefficients, rad/s.
    pub z: Vec<f64>,
    /// Σ z² in each bin, rad²/s².
    pub power: Vec<f64>,
}

fn means(values: &[f64], block: usize) -> Vec<f64> {
    values.chunks_exact(block).map(|c| c.iter().sum::<f64>() / block as f64).collect()
}

impl SpectralBasis {
    /// The frame of a recording; rows after the last whole block are left out.
    #[must_use]
    pub(crate) fn new(scene: &Scene) -> Self {
        let block = scene.len().div_ceil(BLOCKS).max(1);
        let blocks = scene.len() / block;
        let len = blocks * block;
        let start_s = if scene.is_empty() { 0.0 } else { scene.time.at(0) };
        let axis = |start_s, step_s, len| TimeAxis::Uniform { start_s, step_s, len };
        let cut = |v: &Option<Vec<f64>>| v.as_ref().map(|v| v[..len].to_vec());
        let scene = Scene {
            time: axis(start_s, scene.step_s, len),
            temperature_c: cut(&scene.temperature_c),
            supply_v: cut(&scene.supply_v),
            ..scene.clone()
        };
        let coarse_step = scene.step_s * block as f64;
        let coarse = Scene {
            time: axis(start_s + 0.5 * (coarse_step - scene.step_s), coarse_step, blocks),
            step_s: coarse_step,
            temperature_c: scene.temperature_c.as_ref().map(|v| means(v, block)),
            // the mean of the first block may be well above the temperature at power-on
            power_on_temperature_c: scene.first_temperature_c(),
            supply_v: scene.supply_v.as_ref().map(|v| means(v, block)),
            white_std_rad_s: scene.white_std_rad_s / (block as f64).sqrt(),
            ..scene.clone()
        };
        Self {
            bins: Bins::new(len, blocks),
            cosine: Cosine::new(len),
            slow: BlockCosine::new(blocks, block),
            store: RwLock::default(),
            gram: Memo::default(),
            scene,
            coarse,
            block,
        }
    }

    /// The same with bins made as narrow as the bands that stand out of `values_rad_s`.
    #[must_use]
    pub(crate) fn resolving(self, values_rad_s: &[f64]) -> Self {
        let z = self.cosine.forward(&values_rad_s[..self.len()]);
        Self { bins: self.bins.resolving(&z), ..self }
    }

    /// Variance of the dither, rad²/s².
    pub(crate) fn dither_variance(&self) -> f64 {
        (DITHER * self.scene.white_std_rad_s).powi(2)
    }

    /// Number of samples used.
    pub(crate) fn len(&self) -> usize {
        self.cosine.len()
    }

    /// The recording in this frame, with dither added.
    pub(crate) fn data(&self, mut values_rad_s: Vec<f64>) -> Data {
        values_rad_s.truncate(self.len());
        let dither = DITHER * self.scene.white_std_rad_s;
        let mut draw = Stream::new(self.len() as u64, 1);
        values_rad_s.iter_mut().for_each(|v| *v += dither * draw.normal());
        self.data_undithered(values_rad_s)
    }

    /// As [`SpectralBasis::data`], of values that hold the dither already.
    pub(crate) fn data_undithered(&self, values_rad_s: Vec<f64>) -> Data {
        let z = self.cosine.forward(&values_rad_s);
        let power = self.bins.power(&z);
        Data { values_rad_s, z, power }
    }

    /// The series with the cosine coefficients `z`.
    pub(crate) fn series(&self, z: &[f64]) -> Vec<f64> {
        self.cosine.inverse(z)
    }

    /// Stores a column given by block means.
    pub(crate) fn store(&self, block_means: &[f64]) -> ColumnId {
        self.keep(self.slow.forward(block_means), block_means)
    }

    /// Stores a column given by all its samples, for signals that are not slow.
    pub(crate) fn store_whole(&self, values: &[f64]) -> ColumnId {
        self.keep(self.cosine.forward(values), values)
    }

    fn keep(&self, low: Vec<f64>, values: &[f64]) -> ColumnId {
        let rms = (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt();
        let mut store = self.write();
        store.columns.push(Stored { low, rms });
        (store.columns.len() - 1) as ColumnId
    }

    /// Stores the columns by which `candidate` changes ln variance of the noise, one value a level block, scaled so
    /// that a coefficient of one is a root mean square change of ln variance by the column's relative scale.
    pub(crate) fn store_variance(&self, candidate: usize, columns: &[crate::effects::Column]) {
        let per = self.coarse.len().div_ceil(LEVEL_BLOCKS).max(1);
        let columns: Vec<crate::effects::Column> = columns
            .iter()
            .map(|c| crate::effects::Column { values: means(&c.values, per), relative_scale: c.relative_scale })
            .collect();
        let factor = |c: &crate::effects::Column| {
            let mean = c.values.iter().sum::<f64>() / c.values.len().max(1) as f64;
            let rms = (c.values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / c.values.len().max(1) as f64).sqrt();
            if rms > 0.0 { c.relative_scale / rms } else { 0.0 }
        };
        let scales: Vec<f64> = columns.iter().map(factor).collect();
        let scaled = columns.iter().zip(&scales).map(|(c, f)| c.values.iter().map(|v| v * f).collect()).collect();
        let mut store = self.write();
        store.variance.insert(candidate, Arc::new(scaled));
        store.variance_scales.insert(candidate, Arc::new(scales));
    }

    /// Factors from coefficients of the stored columns to coefficients of the columns as given.
    pub(crate) fn variance_scales(&self, candidate: usize) -> Arc<Vec<f64>> {
        self.read().variance_scales.get(&candidate).map(Arc::clone).unwrap_or_default()
    }

    /// Columns stored by [`SpectralBasis::store_variance`].
    pub(crate) fn variance_columns(&self, candidate: usize) -> Arc<Vec<Vec<f64>>> {
        self.read().variance.get(&candidate).map(Arc::clone).unwrap_or_default()
    }

    /// Mean square in each level block of the whitened series above the blocks' own frequencies (one on average), and
    /// the degrees of freedom of its chi-squared distribution under a constant noise level.
    pub(crate) fn block_power(&self, data: &Data) -> (Vec<f64>, f64) {
        let mut z = vec![0.0; self.len()];
        for b in self.bins.low..self.bins.len() {
            let range = self.bins.edges[b]..self.bins.edges[b + 1];
            let scale = (self.bins.count[b] / data.power[b].max(1e-300)).sqrt();
            z[range.clone()].iter_mut().zip(&data.z[range]).for_each(|(o, v)| *o = v * scale);
        }
        let kept = 1.0 - 1.0 / self.block as f64;
        let flat = self.series(&z);
        let long = self.block * self.coarse.len().div_ceil(LEVEL_BLOCKS).max(1);
        let power = flat.chunks_exact(long).map(|c| c.iter().map(|v| v * v).sum::<f64>() / long as f64 / kept);
        (power.collect(), long as f64 * kept)
    }

    /// Root mean square of a column.
    pub(crate) fn rms(&self, column: ColumnId) -> f64 {
        self.read().columns[column as usize].rms
    }

    /// Inner product of two columns in each bin.
    pub(crate) fn gram(&self, a: ColumnId, b: ColumnId) -> Arc<Vec<f64>> {
        let key = (a.min(b), a.max(b));
        self.gram.get(key, || {
            let store = self.read();
            let (low, high) = (&store.columns[key.0 as usize].low, &store.columns[key.1 as usize].low);
            Arc::new(self.bins.products(low, high))
        })
    }

    fn read(&self) -> RwLockReadGuard<'_, Store> {
        self.store.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn write(&self) -> RwLockWriteGuard<'_, Store> {
        self.store.write().unwrap_or_else(PoisonError::into_inner)
    }

    /// Inner product of a column with the recording in each bin.
    pub(crate) fn with_data(&self, column: ColumnId, data: &Data) -> Vec<f64> {
        self.bins.products(&self.read().columns[column as usize].low, &data.z)
    }

    /// z += factor · column.
    pub(crate) fn add_column(&self, z: &mut [f64], column: ColumnId, factor: f64) {
        let store = self.read();
        z.iter_mut().zip(&store.columns[column as usize].low).for_each(|(z, c)| *z += factor * c);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bias::WarmUp;

    /// The coarse scene counts the temperature from power-on, not from the mean of its first block.
    #[test]
    fn blocks_count_the_temperature_from_power_on() {
        let len = 4 * BLOCKS;
        let scene = Scene {
            time: TimeAxis::Uniform { start_s: 0.0, step_s: 0.1, len },
            step_s: 0.1,
            temperature_c: Some((0..len).map(|k| 25.0 + 0.5 * k as f64).collect()),
            power_on_temperature_c: None,
            supply_v: None,
            warm_up: WarmUp { c1_rad_s: 0.0, c2_rad_s: 0.0, time_constant_s: 1.0 },
            white_std_rad_s: 1e-3,
            turn_on_bias_std_rad_s: 0.0,
            warm_up_relative_std: 0.0,
        };
        let coarse = SpectralBasis::new(&scene).coarse;
        assert_eq!(coarse.first_temperature_c(), scene.first_temperature_c());
        assert_eq!(scene.first_temperature_c(), Some(25.0 + 0.5 * 4.5));
        assert_eq!(coarse.temperature_c.unwrap()[0], 25.0 + 0.5 * 1.5);
    }
}
