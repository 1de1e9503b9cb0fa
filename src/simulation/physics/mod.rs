//! The true arm as a rapier multibody, which settles under gravity and yields the pose that is measured.
//!
//! What is true and hidden from the identification becomes physics here: parameter errors are in the joint frames, and every
//! [`Effect`](crate::simulation::effect::Effect) of the arm happens by a mechanism of its own, never by adding its formula to the pose:
//!
//! - a gear train from motor to output, with an encoder that may be off its axis: eccentricity, strain-wave error, coupling, worn teeth;
//! - free coordinates in series, each with a spring, a damper, stops or friction: compliance, hardening, bending, creep, backlash, lost
//!   motion, clearances, hysteresis; the payload is a point mass in the multibody;
//! - segments that scale and encoder zeros that move with temperature;
//! - a root frame that moves or leans in the world (gravity does not), a tool that moves on its link;
//! - servos that answer to what their sensors read.
//!
//! How exactly is said at the top of each file in [`effect`](crate::simulation::effect), one per kind.
//!
//! What the sensor does is in `cell::sensor`. Several effects at one joint are in series from the motor outwards: drive train,
//! clearance, backlash, lost motion, springs, bending. Only this module sees rapier, and only `convert` sees both kinds of vectors.
//!
//! [`PhysicalArm::settle`] goes like this. The joints' frames are put where the drive trains have turned them for the commanded
//! coordinates, every clearance in its middle. The load on each play is gravity through rapier's Jacobians; where it is below the
//! friction of the fit ([`Settling::holding_ratio`]) the coordinate is undecided and stays in the middle. Then rapier steps,
//! heavily damped (springs not at all) and from rest each time, until the tool no longer moves. `static_seat` solves clearances by
//! statics, without rapier: tests compare a simulation from the middle ([`Start::Centre`]) with it, and one may start there to save
//! steps ([`Start::Predicted`]).
//!
//! How exact it is (tests and `tests/benches/physics.rs`; eight joints, clearances to 60 µm and 200 µrad in all of them):
//! without effects, forward kinematics to 2e-15 m. With clearance, the linear programme about the seat to 4e-11 m and 7e-8 rad (the
//! latter is second order in the tilt), the one about the middle of the clearances to 0.2 µm and 0.4 µrad. Every effect against an
//! independent solution: `lab::effect_validation`, `kincal effects scenes/arm8.toml`.

pub mod clearance;
pub mod conditions;
mod convert;
pub(super) mod coordinate;
pub(super) mod drive_train;
pub mod error;
pub(super) mod mechanism;
pub mod physical_arm;
mod play;
pub mod settling;
mod static_seat;
#[cfg(test)]
mod test_arms;
#[cfg(test)]
mod tests;
pub(super) mod true_arm;
pub(super) mod world;

pub use clearance::{Clearance, Seat, SeatedBy};
pub use conditions::{Conditions, Stop};
pub use error::PhysicsError;
pub use physical_arm::PhysicalArm;
pub use settling::{Settled, Settling, Start, Yield};
