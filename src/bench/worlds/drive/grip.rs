//! force = load · μ(s),  s = (r wheel - v_w) / √(max(|r wheel|, |v_w|)² + small²)
//!
//! Four shapes of μ, all odd, with the slope `stiffness` at s = 0 and saturating: straight with a sharp bend, tanh, an exponential that
//! falls again beyond its peak (after Burckhardt, Fahrwerktechnik: Radschlupf-Regelsysteme, 1993), and an arc tangent's sine
//! (after Pacejka, Tyre and Vehicle Dynamics, 2012).

use crate::bench::worlds::draw::{between, index};
use crate::math::random::Stream;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Shape {
    Bent,
    Tanh,
    /// Share of the peak that is lost at s = 1.
    Peaked(f64),
    /// Shape factor.
    Sine(f64),
}

/// Traction curve of both wheels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Grip {
    shape: Shape,
    /// Static friction: the largest μ.
    pub limit: f64,
    /// dμ/ds at 0.
    pub stiffness: f64,
    pub small_m_s: f64,
}

impl Grip {
    pub(crate) fn draw(s: &mut Stream) -> Self {
        let shape = match index(s, 4) {
            0 => Shape::Bent,
            1 => Shape::Tanh,
            2 => Shape::Peaked(between(s, 0.1, 0.4)),
            _ => Shape::Sine(between(s, 1.2, 1.7)),
        };
        Self { shape, limit: between(s, 0.3, 1.0), stiffness: f64::INFINITY, small_m_s: between(s, 0.01, 0.08) }
    }

    /// The same with another slope at 0.
    pub(crate) fn with(self, stiffness: f64) -> Self {
        Self { stiffness, ..self }
    }

    /// μ at slip `s`.
    fn friction(&self, s: f64) -> f64 {
        let x = self.stiffness * s.abs() / self.limit;
        let y = match self.shape {
            // the corner of min(x, 1), rounded
            Shape::Bent => x / (1.0 + x.powi(8)).powf(0.125),
            Shape::Tanh => x.tanh(),
            Shape::Peaked(lost) => (-(-x).exp_m1()) * (1.0 - lost * s.abs()).max(0.3),
            Shape::Sine(c) => (c * (x / c).atan()).sin(),
        };
        (self.limit * y).copysign(s)
    }

    /// Force over load of a wheel whose rim moves at `rim_m_s` over ground that passes at `ground_m_s`.
    pub(crate) fn share(&self, rim_m_s: f64, ground_m_s: f64) -> f64 {
        let speed = rim_m_s.abs().max(ground_m_s.abs()).hypot(self.small_m_s);
        self.friction((rim_m_s - ground_m_s) / speed)
    }
}
