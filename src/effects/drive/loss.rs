//! reading_i = (1 - λ) reading_i inside bursts: lost ticks as the likelihood of a drive knows them.

/// Ticks that one wheel loses in bursts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lost {
    /// Share of the speed that is lost inside a burst.
    pub loss: f64,
    /// 0 left, 1 right.
    pub side: usize,
    /// Mean length of a burst, s.
    pub length_s: f64,
    /// Share of the time that lies in bursts.
    pub share: f64,
}
