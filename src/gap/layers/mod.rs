//! What a Gaussian likelihood cannot see: the distribution of amplitudes, the lattice, two levels, energy that moves in
//! time and frequency. Each is judged on the series that the Gaussian part has whitened.

pub mod amplitude;
pub mod bursts;
pub mod events;
pub mod lattice;
pub mod repeats;
pub mod shots;
pub mod track;
pub mod two_levels;
