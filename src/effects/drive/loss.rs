//! reading_i = (1 - λ) reading_i inside bursts: lost ticks as the likelihood of a drive knows them.

use super::ModelChange;
use crate::effects::Parameters;

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

/// An effect by which one wheel reads low in bursts.
pub trait TickLoss: Sync + Send {
    /// The mean loss of the left wheel and of the right one, where no burst shows by itself.
    fn mean(&self) -> &'static [&'static dyn ModelChange; 2];

    /// Whether `parameters` state the mean loss over all of a drive.
    fn is_mean(&self, parameters: &Parameters) -> bool;

    /// The wheel that `parameters` state: 0 left, 1 right.
    fn side(&self, parameters: &Parameters) -> usize;

    /// The bursts that `parameters` state; none without a loss.
    fn lost(&self, parameters: &Parameters) -> Option<Lost>;

    /// Parameters that state these bursts.
    fn parameters(&self, lost: &Lost) -> Parameters;
}
