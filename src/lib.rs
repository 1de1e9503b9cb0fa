//! Calibration of robot arms with a physics simulator in the loop.
//!
//! The README's architecture section says in which order to read the modules and how a datum travels through them.
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "an oracle may compute as it likes"))]

pub mod arm;
pub mod cli;
pub mod design;
pub mod diagnosis;
pub mod effects;
pub mod event;
pub mod figure;
pub mod identification;
pub mod lab;
pub mod measurement;
pub mod progress;
pub mod quality;
pub mod recording;
pub mod report;
pub mod scene;
pub mod seed;
pub mod session;
pub mod simulation;
pub mod statistics;
pub mod units;
#[cfg(feature = "viewer")]
pub mod viewing;
