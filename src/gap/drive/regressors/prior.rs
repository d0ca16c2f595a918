//! ln prior odds of effects and free forms

/// Prior odds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// ln odds of each effect of the library.
    pub ln_named: f64,
    /// ln odds of an effect known from recordings at rest.
    pub ln_rest: f64,
    /// ln odds of each free form.
    pub ln_free: f64,
}

impl Default for Prior {
    /// Half the probability on none of some twenty effects, a tenth on any of the free forms. Effects known from
    /// recordings at rest are seldom the main one of a drive: a walk or a few outliers lie beside its effects.
    fn default() -> Self {
        Self { ln_named: 0.05f64.ln(), ln_rest: 0.0005f64.ln(), ln_free: 0.0008f64.ln() }
    }
}

impl Prior {
    /// The prior odds of the search, which a calibration replaces.
    #[must_use]
    pub(crate) fn of_search(&self) -> crate::gap::Prior {
        crate::gap::Prior { ln_named: self.ln_named, ln_free: self.ln_free }
    }
}

/// Prior share of lost ticks whose bursts do not show singly.
pub(crate) const UNSEEN: f64 = 0.5;
