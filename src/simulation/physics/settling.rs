//! How a pose is waited for, and what comes out.

use super::clearance::{Seat, SeatedBy};
use super::error::PhysicsError;
use crate::arm::frames::Pose;

/// Where the joints lie in their clearances when the simulation starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// In the middle of every clearance: rapier finds the seat unaided.
    Centre,
    /// Where rigid statics predicts them to rest: about twice as fast.
    Predicted,
}

/// When a pose counts as settled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settling {
    /// Where the joints start in their clearances.
    pub start: Start,
    /// Settled when a step moves the tool's origin by less than this, m,
    pub tolerance_m: f64,
    /// and turns it by less than this, rad.
    pub tolerance_rad: f64,
    /// After so many steps the pose is taken as it is.
    pub steps_max: usize,
    /// The friction of the fits. A radial or axial coordinate moves if its load is at least this fraction of the weight outboard
    /// of the joint; a tilt, if its moment is at least this fraction of that weight times the length of the segments outboard.
    ///
    /// It also keeps out seats that are not well defined: when the joints inboard tilt by `δ` in all, a load of this fraction
    /// turns by up to `δ / holding_ratio`, and the seat with it. At 0.05 the linear programme about the middle of the clearances
    /// was off by at most 1.0 µm and 1.2 µrad in 4000 random poses with 60 µm and 200 µrad in all joints (at 0.02, by 2.1 µm and
    /// 3.1 µrad).
    pub holding_ratio: f64,
}

impl Default for Settling {
    fn default() -> Self {
        Settling { start: Start::Centre, tolerance_m: 1e-9, tolerance_rad: 1e-9, steps_max: 50, holding_ratio: 0.05 }
    }
}

impl Settling {
    pub(super) fn check(&self) -> Result<(), PhysicsError> {
        let positive =
            [("tolerance_m", self.tolerance_m), ("tolerance_rad", self.tolerance_rad), ("holding_ratio", self.holding_ratio)];
        for (what, got) in positive {
            if !(got > 0.0 && got.is_finite()) {
                return Err(PhysicsError::BadSetting { what, got, expected: "a positive number" });
            }
        }
        if self.steps_max == 0 {
            return Err(PhysicsError::BadSetting { what: "steps_max", got: 0.0, expected: "at least 1" });
        }
        Ok(())
    }
}

/// A pose of the arm at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Settled {
    /// Pose of the tool.
    pub base_from_tool: Pose,
    /// Pose of every link, base first.
    pub base_from_link: Vec<Pose>,
    /// How far the tool's origin may still be from rest, m: the way it went in the last step. What is left after a step is about a
    /// twentieth of what was left before, so this is a bound with some room.
    pub settling_error_m: f64,
    /// The same for its orientation, rad.
    pub settling_error_rad: f64,
    /// Simulated steps; none if nothing in the arm yields or has play.
    pub steps: usize,
    /// Simulated time, s. Long, as damping is chosen to outweigh inertia: how a pose is reached is not modelled.
    pub simulated_time_s: f64,
    /// Whether the tolerances of [`Settling`] were met.
    pub converged: bool,
    /// Where each joint lies in its clearance.
    pub seats: Vec<Seat>,
    /// How far joints and links yield.
    pub yields: Vec<Yield>,
}

/// Where a coordinate in which a joint or its link yields came to rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Yield {
    /// Index of the joint.
    pub joint: usize,
    /// Name of the effect. Bending has three coordinates at a place: half of what turns about the link's x, what turns
    /// about y, the other half.
    pub effect: &'static str,
    /// rad, or m where the joint slides.
    pub value: f64,
    /// What decides it; friction means the middle of the play for lost motion, and where the motor left it for backlash.
    pub by: SeatedBy,
}
