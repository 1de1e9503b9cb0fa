//! The program as a whole: what `kincal` does with files, and what holds for the source as a whole.
//!
//! One binary, because linking is slow. Small swarms keep it quick; one test runs the main job as it is shipped.
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::disallowed_methods, reason = "tests")]

#[path = "integration/bad_input.rs"]
mod bad_input;
#[path = "integration/cases.rs"]
mod cases;
#[path = "integration/chain.rs"]
mod chain;
#[path = "integration/challenge.rs"]
mod challenge;
#[path = "integration/determinism.rs"]
mod determinism;
#[path = "integration/diagnose.rs"]
mod diagnose;
#[path = "integration/figures.rs"]
mod figures;
#[path = "integration/guide.rs"]
mod guide;
#[path = "integration/harness.rs"]
mod harness;
#[path = "integration/import.rs"]
mod import;
#[path = "integration/killed.rs"]
mod killed;
#[path = "integration/kinematics.rs"]
mod kinematics;
#[path = "integration/layering.rs"]
mod layering;
#[path = "integration/measure.rs"]
mod measure;
#[path = "integration/mistakes.rs"]
mod mistakes;
#[path = "integration/real_data.rs"]
mod real_data;
#[path = "integration/replay.rs"]
mod replay;
#[path = "integration/repository.rs"]
mod repository;
#[path = "integration/reproduce.rs"]
mod reproduce;
#[path = "integration/secrecy.rs"]
mod secrecy;
#[path = "integration/steps.rs"]
mod steps;
#[path = "integration/sweep.rs"]
mod sweep;
#[path = "integration/tables.rs"]
mod tables;
#[path = "integration/urdf_scene.rs"]
mod urdf_scene;
