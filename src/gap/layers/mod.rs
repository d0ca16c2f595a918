//! Non-Gaussian features of a recording: distribution of amplitudes, quantization, telegraph noise and shots, repeated
//! values, events, bursts, energy that moves in time and frequency. They are judged on the readings or on the series
//! that the Gaussian part has whitened.

pub mod amplitude;
pub mod bursts;
pub mod events;
pub mod lattice;
pub mod repeats;
pub mod shots;
pub mod track;
pub mod two_levels;
