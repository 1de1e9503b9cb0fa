//! Clearance of a joint, and where in it the joint came to rest.

use super::error::PhysicsError;

/// Clearances of one joint; zero where it fits without play.
///
/// The play is between the inboard part and the outboard part of the joint, at the joint's centre `o_i`. The joint frame has
/// the joint axis as z: for a revolute joint it is the frame before the joint's motion, for a prismatic one the frame after it
/// (same axes, origin on the carriage).
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Clearance {
    /// Radius of the disc, perpendicular to the joint axis, in which the outboard part's centre may lie, m.
    pub radial_m: f64,
    /// Half the width along the joint axis: the centre may lie `±axial_m` along it.
    pub axial_m: f64,
    /// Radius of the disc of the tilt, a rotation vector perpendicular to the joint axis, about the outboard part's centre, rad.
    pub tilt_rad: f64,
}

/// A play is a small motion: beyond this the seat is no longer what a bearing does, and a unit was probably mistaken.
pub(super) const LARGEST_LENGTH_M: f64 = 1e-3;
pub(super) const LARGEST_TILT_RAD: f64 = 0.01;

impl Clearance {
    /// No play at all.
    pub const NONE: Clearance = Clearance { radial_m: 0.0, axial_m: 0.0, tilt_rad: 0.0 };

    /// Whether there is any play.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Clearance::NONE
    }

    pub(in crate::simulation) fn check(&self, joint: usize) -> Result<(), PhysicsError> {
        let fields = [
            ("radial", self.radial_m, LARGEST_LENGTH_M, "m"),
            ("axial", self.axial_m, LARGEST_LENGTH_M, "m"),
            ("tilt", self.tilt_rad, LARGEST_TILT_RAD, "rad"),
        ];
        for (what, got, largest, unit) in fields {
            if !(0.0..=largest).contains(&got) {
                return Err(PhysicsError::BadClearance { joint, what, got, largest, unit });
            }
        }
        Ok(())
    }
}

/// What holds a coordinate of a joint at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SeatedBy {
    /// There is no clearance: the fit itself.
    Fit,
    /// Decided: the load pushes the coordinate to the edge of its clearance.
    Load,
    /// Undecided: with every joint in the middle of its clearance, the load is too small to overcome the friction of the fit
    /// ([`super::Settling::holding_ratio`]), and the coordinate stays in the middle.
    Friction,
}

/// Where a joint lies in its clearance, and why. Vectors are in the joint frame (see [`Clearance`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seat {
    /// Index of the joint.
    pub joint: usize,
    /// Displacement of the outboard part's centre, perpendicular to the joint axis, m.
    pub radial_in_joint: [f64; 2],
    /// Displacement along the joint axis, m.
    pub axial_in_joint: f64,
    /// Rotation vector of the tilt, perpendicular to the joint axis, rad.
    pub tilt_in_joint: [f64; 2],
    /// What decides `radial_in_joint`.
    pub radial_by: SeatedBy,
    /// What decides `axial_in_joint`.
    pub axial_by: SeatedBy,
    /// What decides `tilt_in_joint`.
    pub tilt_by: SeatedBy,
}
