//! Floor 2: λ = (a - g)/max(|a|, |g|, v_low),  a = r φ̇ (rim over wheel centre),  g = v ∓ b ω (wheel centre over ground)
//!
//! Slip and the laws that turn it into traction, force = load · μ(λ). λ lies in [-2, 2]: beyond ±1 rim and ground move
//! in opposite directions, and the contact slides fully: every law holds μ(±1) there.
//!
//! Regularisation: below v_low on both sides the slip is (a - g)/v_low, so that a contact near standstill is a stiff
//! viscous link of load · μ'(0)/v_low newtons per m/s, and λ is continuous through zero speed. Above v_low it is the
//! quotient itself. λ bends only where rim and ground move at v_low or in opposite directions equally fast; at a = g its
//! derivative is continuous.
//!
//! One file a law, behind one trait. All are odd in λ and have a continuous first derivative, but for [`Linear`], which
//! has a corner where it saturates.

mod burckhardt;
mod dugoff;
mod linear;
mod pacejka;

pub use burckhardt::{Burckhardt, Surface};
pub use dugoff::Dugoff;
pub use linear::Linear;
pub use pacejka::Pacejka;

use serde::{Deserialize, Serialize};

/// A law of traction: friction coefficient against slip.
pub(crate) trait Traction {
    /// μ and dμ/dλ at slip `slip`, 0 <= slip <= 1.
    fn at(&self, slip: f64) -> [f64; 2];

    /// Parameters by name, for checks and reports; all of them must be positive unless said otherwise by the law.
    fn parameters(&self) -> Vec<(&'static str, f64)>;
}

/// Any of the laws, as the configuration states it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TractionLaw {
    /// Rise and slow fall; measured for many road surfaces.
    Burckhardt(Burckhardt),
    /// The magic formula.
    Pacejka(Pacejka),
    /// Friction and stiffness alone, without a peak.
    Dugoff(Dugoff),
    /// Proportional up to its greatest value.
    Linear(Linear),
}

impl TractionLaw {
    /// Its name in the configuration.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Burckhardt(_) => "burckhardt",
            Self::Pacejka(_) => "pacejka",
            Self::Dugoff(_) => "dugoff",
            Self::Linear(_) => "linear",
        }
    }

    /// Parameters by name.
    #[must_use]
    pub(crate) fn parameters(&self) -> Vec<(&'static str, f64)> {
        match self {
            Self::Burckhardt(law) => law.parameters(),
            Self::Pacejka(law) => law.parameters(),
            Self::Dugoff(law) => law.parameters(),
            Self::Linear(law) => law.parameters(),
        }
    }

    /// μ(λ) and dμ/dλ at any slip.
    #[must_use]
    #[inline]
    pub(crate) fn friction(&self, slip: f64) -> [f64; 2] {
        let size = slip.abs();
        let inside = size.min(1.0);
        let [mu, slope] = match self {
            Self::Burckhardt(law) => law.at(inside),
            Self::Pacejka(law) => law.at(inside),
            Self::Dugoff(law) => law.at(inside),
            Self::Linear(law) => law.at(inside),
        };
        [mu.copysign(slip), if size > 1.0 { 0.0 } else { slope }]
    }

    /// The slip at which μ is greatest, and that μ; the smallest such slip for laws that level off.
    #[must_use]
    pub(crate) fn peak(&self) -> [f64; 2] {
        // μ rises to its peak and never rises again: bisection on the sign of its slope
        let (mut low, mut high) = (0.0, 1.0);
        if self.friction(high)[1] > 0.0 {
            return [1.0, self.friction(1.0)[0]];
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if self.friction(middle)[1] > 0.0 { low = middle } else { high = middle }
        }
        [high, self.friction(high)[0]]
    }
}

/// The slip of a wheel, with its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slip {
    /// λ.
    pub slip: f64,
    /// ∂λ/∂(rim speed), s/m; not negative but where the wheel turns backwards against the ground.
    pub by_rim: f64,
    /// ∂λ/∂(ground speed), s/m.
    pub by_ground: f64,
}

impl Slip {
    /// λ of a rim moving at `rim_m_s` over ground that passes at `ground_m_s`.
    #[must_use]
    #[inline]
    pub(crate) fn new(rim_m_s: f64, ground_m_s: f64, low_speed_m_s: f64) -> Self {
        let (rim, ground) = (rim_m_s.abs(), ground_m_s.abs());
        let scale = rim.max(ground).max(low_speed_m_s);
        let inverse = 1.0 / scale;
        let slip = (rim_m_s - ground_m_s) * inverse;
        let bend = slip * inverse;
        let (mut by_rim, mut by_ground) = (inverse, -inverse);
        if scale > low_speed_m_s {
            if rim >= ground {
                by_rim -= bend * rim_m_s.signum();
            } else {
                by_ground -= bend * ground_m_s.signum();
            }
        }
        Self { slip, by_rim, by_ground }
    }
}

#[cfg(test)]
mod tests;
