//! The true arm as a rapier multibody, which settles under gravity and yields the pose that is measured.
//!
//! What is true and hidden from the identification becomes physics here: parameter errors are in the joint frames, thermal
//! growth scales the segments between joints, clearance is a set of free, limited coordinates that gravity seats.
//! Only this module sees rapier, and only `convert` sees both kinds of vectors.

pub mod clearance;
mod convert;
pub mod error;
pub mod physical_arm;
mod play;
pub mod settling;
mod static_seat;
#[cfg(test)]
mod test_arms;
mod true_arm;
mod world;

pub use clearance::{Clearance, Seat, SeatedBy};
pub use error::PhysicsError;
pub use physical_arm::PhysicalArm;
pub use settling::{Settled, Settling, Start};
