//! A robot arm: a chain of elementary motions with limits ([`chain`]), and what its links weigh, how they are shaped and what stands
//! around it ([`Arm`]).
//!
//! Any serial arm is written as one list of rotations about and translations along the axes of the moving frame. The paper's
//! five-parameter modified Denavit–Hartenberg convention (eq. 39, [`mdh`]), the six parameters of a base or tool frame and a
//! URDF's joint origins ([`urdf`]) are all such lists, so one forward kinematics and one Jacobian serve them all.

pub mod frames;
pub mod inverse;
pub mod parameters;

pub mod chain;
pub mod dh;
pub mod mdh;
pub mod model;
pub mod self_collision;
pub mod urdf;

pub use chain::{Axis, Chain, ChainAt, Joint, JointKind, Mimic, Step};
pub use model::{Arm, Fixture, Geometry, Inertial, Link, Shape};
pub use parameters::{Parameter, Quantity};
