//! Calibration of robot arms with a physics simulator in the loop.
//!
//! Modules in reading order; the README's architecture section says how a datum travels through them.

pub mod arm;
pub mod frames;
pub mod kinematics;
pub mod physics;
pub mod seed;
