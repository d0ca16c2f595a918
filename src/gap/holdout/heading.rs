//! error(H) = ∫ (reading - predicted rate) dt over H seconds at rest, the prediction from the readings before them

use crate::gap::rest::state_space::{Horizon, Run};

/// Starts that a horizon must have to be reported.
const FEWEST_STARTS: usize = 4;

/// Drift of the heading over one horizon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct HeadingError {
    /// Root mean square over the starts, rad.
    pub rms_rad: f64,
    /// Number of starts.
    pub starts: usize,
}

/// The horizons, of those asked for, that fit into `rows` rows, in s and in rows: starts half a horizon apart, the first after
/// 60 s or a tenth of the recording, whichever is shorter, so that it is not the turn-on bias that is measured.
#[must_use]
pub(crate) fn heading_horizons(rows: usize, step_s: f64, horizons_s: &[f64]) -> (Vec<f64>, Vec<Horizon>) {
    let first = ((60.0 / step_s) as usize).min(rows / 10);
    let fits = |horizon_s: &f64| {
        let length = (horizon_s / step_s).round() as usize;
        let horizon = Horizon { rows: length, first, every: (length / 2).max(1) };
        let needed = first + length + (FEWEST_STARTS - 1) * horizon.every;
        (length > 0 && needed <= rows).then_some((*horizon_s, horizon))
    };
    horizons_s.iter().filter_map(fits).unzip()
}

/// Drift over each horizon of `run`. Where a reading is missing the one-step prediction stands in for it.
pub(super) fn heading_errors(reading_rad_s: &[f64], run: &Run, horizons: &[Horizon], step_s: f64) -> Vec<HeadingError> {
    let mut sums = Vec::with_capacity(reading_rad_s.len() + 1);
    let mut sum = 0.0;
    sums.push(sum);
    for (y, predicted) in reading_rad_s.iter().zip(&run.predicted_rad_s) {
        sum += if y.is_finite() { y } else { predicted };
        sums.push(sum);
    }
    let drift = |(horizon, forecasts): (&Horizon, &Vec<crate::gap::rest::state_space::Forecast>)| {
        let square = |f: &crate::gap::rest::state_space::Forecast| {
            ((sums[f.row + horizon.rows] - sums[f.row]) * step_s - f.increment_rad).powi(2)
        };
        let starts = forecasts.len();
        HeadingError { rms_rad: (forecasts.iter().map(square).sum::<f64>() / starts.max(1) as f64).sqrt(), starts }
    };
    horizons.iter().zip(&run.forecasts).map(drift).collect()
}
