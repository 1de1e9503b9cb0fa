//! Calibration of robot arms with a physics simulator in the loop.
//!
//! Modules in reading order; the README's architecture section says how a datum travels through them.

pub mod arm;
pub mod cell;
pub mod cli;
pub mod design;
pub mod experiments;
pub mod frames;
pub mod identification;
pub mod kinematics;
pub mod measurement;
pub mod physics;
pub mod quality;
pub mod recording;
pub mod report;
pub mod scene;
pub mod seed;
pub mod self_collision;
pub mod session;
#[cfg(feature = "viewer")]
pub mod viewing;
