//! Floor 2: the robot on two driven wheels: how it moves, and how torques move it.
//!
//! - [`Motion`], [`Forcing`], [`advance`]: planar motion under constant forcing, with its derivatives
//! - [`Rolling`]: wheels that roll without slip
//!
//! One file a model of the contact between wheel and ground.

mod planar;
mod rolling;

pub use planar::{Forcing, Motion, MotionJacobian, advance, advance_with_jacobian};
pub use rolling::Rolling;
