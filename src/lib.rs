//! Calibration of robot arms, with a physics simulator in the loop: choose the configurations in which an arm is measured, simulate
//! the measuring, identify the arm's geometry, and find out which effect causes what no geometry explains.
//!
//! Everything is in SI units and radians; transforms are named `a_from_b`; parameters keep one order everywhere, that of
//! [`arm::Arm`]'s chain. Everything that is drawn comes from a seed, and the same input gives the same bytes on one machine,
//! whatever the number of threads (from machine to machine: aimed at, not proven).
//!
//! # Identify an arm from a table of readings
//!
//! The nominal arm comes from a URDF (or from a [`scene`]), the readings from a CSV table with a row per reading:
//! `q1_rad` …, `x_m`, `y_m`, `z_m` and, where the orientation is measured, `qx` … `qw`.
//!
//! ```
//! use kincal::arm::urdf;
//! use kincal::identification::{align, identify};
//! use kincal::measurement::{Sensor, Weights, table};
//!
//! # // The table: another Panda, its parameters off by up to 30 mm and 1.7 degrees, read with the noise of a laser tracker.
//! # use kincal::{design, progress::Silent, scene, session, simulation::injected::{Injected, Noise}};
//! # let mut file = scene::read("scenes/panda.toml")?;
//! # file.set_method(design::problem::Method::Random)?;
//! # let mut scene = file.scene.clone();
//! # scene.sensor = Sensor::uniform(15e-6, Some(60e-6));
//! # let hidden = Injected { noise: Noise::Declared { factor: 1.0 }, ..file.injected.unwrap() };
//! # let chosen = session::design_and_tell(&scene, &mut Silent)?.configurations;
//! # let (measured, _) = session::measure_design(&scene, &hidden, &chosen, &mut Silent)?;
//! # let text = table::write(&measured, &scene.arm.slides())?;
//! let nominal = urdf::import(&std::fs::read_to_string("scenes/panda.urdf")?, "panda.urdf", None, None)?.arm;
//! let readings = table::parse(&text, "readings.csv")?.measurements; // or `table::read`, from the file
//! let sensor = Sensor::uniform(15e-6, Some(60e-6)); // m and rad, one sigma per axis
//!
//! // Where the arm stands in the tracker's frame, and where the target sits on the tool; then all that the readings tell.
//! let arm = align(&nominal, &sensor, &readings.iter().collect::<Vec<_>>())?;
//! let found = identify(&arm, &sensor, Weights::Noise, &readings)?;
//!
//! assert!(found.converged);
//! assert!(found.fitted.position_m.rms < 50e-6 && found.nominal.position_m.rms > 5e-3);
//! print!("{}", kincal::report::identification(&found));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Simulate an arm with an effect, and diagnose it
//!
//! The cell is simulated in rapier: joints that yield, bearings with play, drives with backlash. The diagnosis sees only the
//! readings. With the feature `simulator`.
//!
//! ```
//! use kincal::design::problem::Method;
//! use kincal::diagnosis::outcome::Verdict;
//! use kincal::progress::Silent;
//! use kincal::simulation::{effect::Effect, injected::Injected};
//! use kincal::{scene, session};
//!
//! let mut file = scene::read("scenes/arm8.toml")?;
//! file.set_method(Method::Random)?;
//! let scene = &file.scene;
//! let hidden = Injected::of_effects("example", vec![Effect::JointCompliance { joint: 1, stiffness: 2e5 }]); // N·m/rad
//!
//! let configurations = session::design_and_tell(scene, &mut Silent)?.configurations;
//! let (readings, _truth) = session::measure_design(scene, &hidden, &configurations, &mut Silent)?;
//! let diagnosis = session::diagnose(scene, &readings)?;
//!
//! assert_eq!(diagnosis.verdict, Verdict::Explained);
//! println!("{}", diagnosis.sentence);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Choose configurations
//!
//! ```
//! use kincal::design::{design, problem::Method};
//! use kincal::progress::Silent;
//! use kincal::scene;
//!
//! let mut file = scene::read("scenes/arm8.toml")?;
//! file.set_count(20)?;
//! file.set_method(Method::Detmax)?;
//! let outcome = design(&file.scene.request(), &mut Silent)?;
//!
//! assert_eq!(outcome.configurations.len(), 20); // each a joint vector, rad
//! assert!(outcome.indexes.o1 > outcome.random.mean.o1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # The guide
//!
//! The [`guide`] has a tutorial, how-tos, the formulas, what was measured, a glossary, and how to add an effect, a measurement or an
//! optimiser.
//!
//! # The rooms, in the order in which to read them
//!
//! | module | what is there |
//! |---|---|
//! | [`arm`] | the serial chain and its parameters, modified DH and URDF, shapes and collisions |
//! | [`measurement`] | a reading, the sensor's declared accuracy, tables in and out |
//! | [`scene`] | the TOML file that describes arm, sensor, task and, apart from them, what is hidden |
//! | [`quality`] | what a set of configurations tells: observability, prediction, covering of the workspace |
//! | [`mod@design`] | choosing configurations: problem, optimisers, outcome, advice whether choosing pays |
//! | [`identification`] | geometry from readings: alignment, least squares, what can be told apart |
//! | [`effects`] | the kinds of un-modelled effects and what each does to readings, in closed form |
//! | [`diagnosis`] | which effects cause what calibration leaves, and what cannot be said |
//! | [`simulation`] | the hidden cell: effects as mechanisms in rapier, temperatures, the sensor's noise |
//! | [`session`], [`event`], [`progress`] | the steps chained, what they tell while they run, and who listens |
//! | [`recording`], [`report`], [`viewing`] | a run as an MCAP file, as text, in the Rerun viewer |
//! | [`lab`] | what knows the truth: published experiments again, sealed challenges, power of the diagnosis |
//! | [`seed`], [`statistics`], [`units`] | random streams by label, order statistics and intervals, numbers for people |
//!
//! Nothing that analyses readings (`identification`, `effects`, `diagnosis`) imports the simulator: it sees what a real cell gives.
//!
//! # Features
//!
//! Without any: everything up to `diagnosis`, with `scene` and `report`. `simulator` adds the cell (rapier) and `session`,
//! `recording` adds MCAP, `viewer` adds Rerun, and `cli` (which needs the first two) adds the program, `lab` and its figures.
//! `default` is `cli` and `viewer`; a library that only identifies and diagnoses takes `default-features = false`.
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "an oracle may compute as it likes"))]

pub mod arm;
pub mod measurement;
pub mod scene;

pub mod design;
pub mod quality;

pub mod effects;
pub mod identification;
pub mod solver;

pub mod diagnosis;

pub mod simulation;

pub mod event;
pub mod progress;
#[cfg(feature = "simulator")]
pub mod session;

#[cfg(feature = "recording")]
pub mod recording;
pub mod report;
#[cfg(feature = "viewer")]
pub mod viewing;

#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "cli")]
mod figure;
#[cfg(feature = "cli")]
pub mod lab;

pub mod files;
pub mod numerics;
pub mod seed;
pub mod statistics;
pub mod units;

#[cfg(any(doc, doctest))]
pub mod guide;
