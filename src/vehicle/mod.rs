//! Floor 2: the robot on two driven wheels: how it moves, and how torques move it.
//!
//! - [`Motion`], [`Forcing`], [`advance`], [`travel`]: planar motion under constant forcing, with its derivatives
//! - [`Rolling`]: wheels that roll without slip
//! - [`AsPrinted`]: the equations of Alessandri et al. as they are printed, for comparison
//! - [`Slipping`]: wheels that slip, by a law of [`crate::traction`]
//! - [`Odometry`]: the wheels' speeds in a log; [`known_by`]: channels that follow by the robot's dimensions
//!
//! One file a model of the contact between wheel and ground.

mod as_printed;
mod known;
mod odometry;
mod planar;
mod rolling;
mod signs;
mod slipping;

pub use as_printed::{AsPrinted, PrintedState};
pub use known::known_by;
pub(crate) use known::{one_wheel, positions_only};
pub use odometry::Odometry;
pub(crate) use planar::advance_with_jacobian;
pub use planar::{Forcing, Motion, advance, travel};
pub use rolling::Rolling;
pub use signs::wrong_signs;
pub(crate) use signs::{GAIN, opposite};
pub use slipping::{Slipping, SlippingState};
