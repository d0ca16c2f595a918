//! μ = c1 (1 - exp(-c2 λ)) - c3 λ
//!
//! Burckhardt, *Fahrwerktechnik: Radschlupf-Regelsysteme*, Vogel 1993; the surfaces' values as tabulated in Kiencke and
//! Nielsen, *Automotive Control Systems*, Springer 2005.

use super::Traction;
use serde::{Deserialize, Serialize};

/// Burckhardt's law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Burckhardt {
    /// c1: the level that the rise tends to.
    pub c1: f64,
    /// c2: how steep the rise is.
    pub c2: f64,
    /// c3: how fast μ falls beyond the peak; may be zero.
    pub c3: f64,
}

impl Traction for Burckhardt {
    #[inline]
    fn at(&self, slip: f64) -> [f64; 2] {
        let left = (-self.c2 * slip).exp();
        [self.c1 * (1.0 - left) - self.c3 * slip, self.c1 * self.c2 * left - self.c3]
    }

    fn parameters(&self) -> Vec<(&'static str, f64)> {
        vec![("c1", self.c1), ("c2", self.c2), ("c3", self.c3)]
    }
}

/// Grounds whose values have been measured, from slippery to grippy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Surface {
    /// Ice: peak 0.05.
    Ice,
    /// Snow: peak 0.19.
    Snow,
    /// Wet cobblestone: peak 0.38.
    WetCobblestone,
    /// Wet asphalt: peak 0.80.
    WetAsphalt,
    /// Dry asphalt: peak 1.17.
    DryAsphalt,
}

impl Surface {
    /// All of them, slippery first.
    pub const ALL: [Self; 5] = [Self::Ice, Self::Snow, Self::WetCobblestone, Self::WetAsphalt, Self::DryAsphalt];

    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Ice => "ice",
            Self::Snow => "snow",
            Self::WetCobblestone => "wet_cobblestone",
            Self::WetAsphalt => "wet_asphalt",
            Self::DryAsphalt => "dry_asphalt",
        }
    }

    /// The surface of this name.
    #[must_use]
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|s| s.name() == name)
    }

    /// Its law.
    #[must_use]
    pub fn law(self) -> Burckhardt {
        let [c1, c2, c3] = match self {
            Self::Ice => [0.05, 306.39, 0.0],
            Self::Snow => [0.1946, 94.129, 0.0646],
            Self::WetCobblestone => [0.4004, 33.708, 0.1204],
            Self::WetAsphalt => [0.857, 33.822, 0.347],
            Self::DryAsphalt => [1.2801, 23.99, 0.52],
        };
        Burckhardt { c1, c2, c3 }
    }
}
