//! Non-Gaussian features of a recording: distribution of amplitudes, quantization, telegraph noise and shots, repeated
//! values, events, bursts, energy that moves in time and frequency. They are judged on the readings or on the series
//! that the Gaussian part has whitened.

pub(crate) mod amplitude;
pub(crate) mod bursts;
pub(crate) mod events;
pub(crate) mod looks;
pub(crate) mod quantization;
pub(crate) mod repeats;
pub(crate) mod shots;
pub(crate) mod telegraph;
pub(crate) mod track;
pub(crate) mod two_levels;
