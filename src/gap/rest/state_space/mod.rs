//! y_k = fixed_k + Σ_j x_jk β_j + Σ_i s_ik + level(mode_k) + v_k, then outliers, then a lattice
//!
//! ```text
//! β_j ~ N(mean_j, std_j²)                          static coefficients: warm-up, covariates, amplitude of a tone
//! s_i,k+1 = φ_i s_ik + N(0, q_i)                   random walk, Gauss-Markov, 1/f as a sum of such states; a pair that
//!                                                  turns and decays for noise in a band
//! v_k ~ N(0, (white_std · scale_k)²)               white, or coloured by an ARMA low-pass
//! mode_k: telegraph low/high × before/after the step   Markov chain of two or four states
//! ```
//!
//! The predictive model of a recording at rest ([`StateSpaceModel`]) and the log density of the recording under it
//! ([`StateSpaceModel::score`]), one row after the other, each given the rows before it: the sum is the log likelihood with
//! everything marginalised. Missing samples (NaN) are skipped.
//!
//! Without quantization, outliers, telegraph noise and step the Kalman filter is exact. Otherwise the state's
//! distribution is replaced after every row by the Gaussian with the same mean and covariance, one for each mode
//! (interacting multiple models: Blom and Bar-Shalom, IEEE Trans. Automatic Control 33 (1988) 780). The tests compare
//! with sums over all histories: the error is below 1 nat (root mean square) for a whole recording. A wide prior of the
//! turn-on bias is cut into pieces first, or it would be mistaken for a level.

mod believed;
mod filter;
mod forecast;
mod hypothesis;
mod nominal;
pub(crate) mod of_effects;
mod pieces;
pub(crate) mod quantization;
mod readout;
mod simulate;
mod spectra;
#[cfg(test)]
mod tests;

pub(crate) use believed::{Coefficient, LowPass, Markov, Oscillator, Outliers, StateSpaceModel, Step, Telegraph};
pub(crate) use filter::blocked_log_score;
pub(crate) use filter::{Forecast, Run};
pub(crate) use forecast::Horizon;
pub(crate) use spectra::flicker;
