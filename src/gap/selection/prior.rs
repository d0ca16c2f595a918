//! ln prior odds of one more effect or free form in a set

/// Prior odds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// ln of the odds of one more named effect.
    pub ln_named: f64,
    /// ln of the odds of one more free form.
    pub ln_free: f64,
}

/// Odds in a drive of an effect known from recordings at rest, relative to an effect of drives: it is seldom the main one,
/// a walk or a few outliers lie beside the others.
const KNOWN_AT_REST: f64 = 0.01;

impl Prior {
    /// Those of drives: half the probability on none of some twenty effects, a tenth on any of the free forms.
    #[must_use]
    pub fn of_drives() -> Self {
        Self { ln_named: 0.05f64.ln(), ln_free: 0.0008f64.ln() }
    }

    /// ln of the odds of one more part.
    #[must_use]
    pub(crate) fn of(&self, named: bool) -> f64 {
        if named { self.ln_named } else { self.ln_free }
    }

    /// ln of the odds, in a drive, of one more effect known from recordings at rest.
    #[must_use]
    pub(crate) fn ln_known_at_rest(&self) -> f64 {
        self.ln_named + KNOWN_AT_REST.ln()
    }
}

impl Default for Prior {
    /// Those of recordings at rest.
    fn default() -> Self {
        Self { ln_named: (0.08_f64).ln(), ln_free: (0.012_f64).ln() }
    }
}
