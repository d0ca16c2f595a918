//! y = f(signals, parameters): the expression of an effect of the user's own, read once and evaluated at every row

use crate::math::expression::{Expression, Fault};

/// A quantity that an expression may follow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Signal {
    /// Name with unit.
    pub name: &'static str,
    /// Values at which an expression must be finite.
    pub range: [f64; 2],
}

/// An expression in signals and parameters.
#[derive(Debug, Clone)]
pub struct Law {
    expression: Expression,
    signals: usize,
}

impl Law {
    pub(super) fn new(expression: &str, signals: &[Signal], parameters: &[&str]) -> Result<Self, Fault> {
        let names: Vec<&str> = signals.iter().map(|s| s.name).chain(parameters.iter().copied()).collect();
        Ok(Self { expression: Expression::new(expression, &names)?, signals: signals.len() })
    }

    /// Its value, where `signal` gives the signal at a place in [`super::ActsOn::signals`], and `parameters` are in the order of
    /// their tables.
    #[must_use]
    pub fn value(&self, signal: impl Fn(usize) -> f64, parameters: &[f64]) -> f64 {
        let own = |at: usize| parameters.get(at).copied().unwrap_or(f64::NAN);
        self.expression.value(|at| if at < self.signals { signal(at) } else { own(at - self.signals) })
    }

    /// Whether it follows the signal at this place in [`super::ActsOn::signals`].
    #[must_use]
    pub(crate) fn uses_signal(&self, at: usize) -> bool {
        at < self.signals && self.expression.uses(at)
    }

    /// Whether the parameter at this place is in it.
    #[must_use]
    pub(crate) fn uses_parameter(&self, at: usize) -> bool {
        self.expression.uses(self.signals + at)
    }
}
