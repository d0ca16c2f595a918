//! P(named | s) = Φ(s/c - √(2 g)):  the smallest size of each effect that a diagnosis of this very log would name
//!
//! The gain of a law whose size is free is ½ (a + z)², z standard normal and a = √(2 E) with the expected gain
//! E = ½ (s/c)² (a noncentral χ² of one degree of freedom; Cox and Hinkley, Theoretical Statistics (1974), section 9.3).
//! The diagnosis names the effect where the gain reaches g, the price of its prior, its rivals and the doubt. So each log has
//! a size from which on it is named, c (√(2 g) - z), and these sizes are normal over logs. Neither c nor g is taken from
//! a formula: logs with the inputs, rows and channels of the given one are simulated, each with noise of its own, the
//! effect is made larger and smaller beside the same noise (`search`), and the diagnosis itself says from which size on it
//! names it. The size that is told is that by which a further log is named with the asked probability (`bound`).

mod bound;
mod direction;
mod judged;
mod search;
pub(super) mod simulated;

pub use judged::{Cannot, Checked, EffectPower, Instead, Nominal, Options, Power, power};
