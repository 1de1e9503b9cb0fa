//! Where a joint is in its clearance at one moment.

use nalgebra::{Translation3, Vector2, Vector3};

use super::clearance::SeatedBy;
use crate::arm::frames::{Pose, rotation_from_vector};

/// The coordinates of one joint's play, in the joint frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Play {
    /// m.
    pub(super) radial: Vector2<f64>,
    /// m.
    pub(super) axial: f64,
    /// Rotation vector, rad.
    pub(super) tilt: Vector2<f64>,
}

impl Play {
    /// The middle of the clearance.
    pub(super) const CENTRE: Play = Play { radial: Vector2::new(0.0, 0.0), axial: 0.0, tilt: Vector2::new(0.0, 0.0) };

    /// `inboard_from_outboard`: shift of the centre, then tilt about it.
    pub(super) fn pose(&self) -> Pose {
        Pose::from_parts(
            Translation3::new(self.radial.x, self.radial.y, self.axial),
            rotation_from_vector(&Vector3::new(self.tilt.x, self.tilt.y, 0.0)),
        )
    }
}

/// The load that gravity puts on the play of one joint, in the joint frame: what drives its coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Load {
    /// N.
    pub(super) radial: Vector2<f64>,
    /// N.
    pub(super) axial: f64,
    /// N·m.
    pub(super) tilt: Vector2<f64>,
    /// What drives the joint itself: the torque about its axis, N·m, or the force along it, N.
    pub(super) along: f64,
}

/// What decides where the coordinates of one joint's play come to rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Decision {
    pub(super) radial: SeatedBy,
    pub(super) axial: SeatedBy,
    pub(super) tilt: SeatedBy,
}
