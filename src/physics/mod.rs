//! The true arm as a rapier multibody, which settles under gravity and yields the pose that is measured.
//!
//! What is true and hidden from the identification becomes physics here: parameter errors are in the joint frames, thermal
//! growth scales the segments between joints, clearance is a set of free, limited coordinates that gravity seats.
//! Only this module sees rapier, and only `convert` sees both kinds of vectors.
//!
//! [`PhysicalArm::settle`] goes like this. The joints' frames are put where the commanded coordinates want them (the servos are
//! ideal), every clearance in its middle. The load on each play is gravity through rapier's Jacobians; where it is below the
//! friction of the fit ([`Settling::holding_ratio`]) the coordinate is undecided and stays in the middle. Then rapier steps,
//! heavily damped and from rest each time, until the tool no longer moves. `static_seat` solves the same by statics, without
//! rapier: tests compare a simulation from the middle ([`Start::Centre`]) with it, and one may start there to save steps
//! ([`Start::Predicted`]).
//!
//! How exact it is (tests and `tests/benches/physics.rs`; eight joints, clearances to 60 µm and 200 µrad in all of them):
//! without effects, forward kinematics to 2e-15 m. With clearance, the linear programme about the seat to 4e-11 m and
//! 7e-8 rad (the latter is second order in the tilt), the one about the middle of the clearances to 0.2 µm and 0.4 µrad.

pub mod clearance;
pub mod conditions;
mod convert;
mod coordinate;
mod drive_train;
pub mod error;
mod mechanisms;
pub mod physical_arm;
mod play;
pub mod settling;
mod static_seat;
#[cfg(test)]
mod test_arms;
#[cfg(test)]
mod tests;
mod true_arm;
mod world;

pub use clearance::{Clearance, Seat, SeatedBy};
pub use conditions::{Conditions, Stop};
pub use error::PhysicsError;
pub use physical_arm::PhysicalArm;
pub use settling::{Settled, Settling, Start, Yield};
