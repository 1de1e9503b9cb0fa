//! The arm as a chain of elementary motions: forward kinematics and the error Jacobian.
//!
//! Any serial arm is written as one list of rotations about and translations along the axes of the moving frame. The paper's
//! five-parameter modified Denavit–Hartenberg convention (eq. 39, [`mdh`]), the six parameters of a base or tool frame and a
//! URDF's joint origins ([`urdf`]) are all such lists, so one forward kinematics and one Jacobian serve them all.

pub mod chain;
pub mod mdh;
pub mod parameters;
pub mod urdf;

pub use chain::{Axis, Chain, ChainAt, Joint, JointKind, Step};
pub use parameters::{Parameter, Quantity};
