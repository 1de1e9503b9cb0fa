//! The true arm as a rapier multibody, which settles under gravity and yields the pose that is measured.
//!
//! What is true and hidden from the identification becomes physics here: parameter errors are in the joint frames, and every
//! [`Effect`](crate::simulation::effect::Effect) of the arm happens by a mechanism of its own, never by adding its formula to the pose:
//!
//! | effect | mechanism |
//! |---|---|
//! | joint compliance | a free coordinate about the joint's axis with rapier's passive spring; the payload is a point mass in the multibody |
//! | wrong payload | the same in every joint, the springs relaxed where a servo that knows the believed payload would put them |
//! | hardening stiffness | the same with the tangent of its spring, renewed every step |
//! | link bending | two springs across the axis (a Cardan joint) at the joint, outboard of its motion; of a beam, two such pairs along it |
//! | creep | a spring and a damper beside it, stepped exactly over each stop of the session |
//! | backlash | output between two stops of the motor's, held by rapier's friction; the last of the move is driven |
//! | gravity lost motion, clearances | free, limited coordinates that gravity seats |
//! | eccentricity | an encoder disc off its axis, or behind a Hooke joint; the servo turns until the head reads the command |
//! | strain-wave error, gear coupling, worn teeth | gear train from motor to output |
//! | memory hysteresis | Dahl's friction, exact for each straight move of the session |
//! | moment crosstalk | the servo adds what its torque sensor reads of the moment across, until both agree |
//! | thermal growth and drift | segments that scale, encoder zeros that move |
//! | base tilt | the root frame leans under the moment of what it carries, until both agree |
//! | base and tool | the root frame moves in the world (gravity does not), the tool moves on its link |
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
mod coordinate;
mod drive_train;
pub mod error;
mod mechanism;
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
