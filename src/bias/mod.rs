//! Floor 2: the warm-up model of the gyro's error and its discretisations, and the error by temperature.
//!
//! e(t) = C1 (1 - exp(-t/T)) + C2, t from power-on (Alessandri et al., equation 2; after Barshan and
//! Durrant-Whyte, IEEE Trans. Robotics and Automation 11 (1995) 328).

mod discrete;
mod earth;
mod restart;
mod thermal;
mod warm_up;

pub use discrete::{Discrete, Scheme};
pub use earth::{EARTH_RATE_RAD_S, EarthRate};
pub(crate) use restart::Lack;
pub use restart::Restart;
pub use thermal::{Against, Thermal};
pub use warm_up::WarmUp;
