//! Calibration of robot arms with a physics simulator in the loop.
//!
//! The README's architecture section says in which order to read the modules and how a datum travels through them.
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "an oracle may compute as it likes"))]

pub mod arm;
pub mod cell;
pub mod cli;
pub mod design;
pub mod diagnosis;
pub mod effects;
pub mod experiments;
pub mod figure;
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
