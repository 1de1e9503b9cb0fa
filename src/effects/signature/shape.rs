//! What an effect of unit magnitude does to the target: true pose = pose at the joint readings + effect, to first order.

use std::num::NonZeroUsize;

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::posture::Posture;
use super::strain_wave_error::RIPPLES;
pub use super::unnamed::angle_map::MAP_ORDERS;
pub use super::unnamed::memory::MEMORIES;
pub use super::unnamed::torque_memory::FORGETTING_S;
use super::unnamed::{
    all_yield, angle_curve, angle_map, bump, course, crosstalk, direction_load, memory, nonlinear_torque, time_curve,
    torque_memory, unequal_bend, unequal_seat, unequal_shift,
};
use super::{
    backlash, base_drift, base_step, base_tilt, gear_coupling, gravity_lost_motion, joint_compliance, joint_eccentricity,
    joint_thermal_drift, link_bending, link_thermal_growth, measurement_scale, radial_clearance, tilt_clearance, tool_step,
};
use crate::effects::Kind;

/// What an effect follows. Joints and links count from 0 here, and from 1 where it is written; link `i` moves with joint `i`. One column
/// per number in brackets.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "shape", rename_all = "snake_case")]
pub enum Shape {
    /// \[1\] A joint turns in proportion to the torque about it.
    Torque {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
    },
    /// \[1\] A turn about a joint's origin in proportion to the moment across its axis.
    MomentAcross {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
    },
    /// \[1\] A link bends as a beam from its joint to the next under the moment across its own direction, which may change along
    /// it: a turn in proportion to the mean moment, about where a beam turns.
    Beam {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
    },
    /// \[1\] A joint is off by half a unit in the direction of its last move.
    Direction {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
    },
    /// \[1\] A joint is off by half a unit in the direction of its torque.
    TorqueSign {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
    },
    /// \[1\] As [`Shape::TorqueSign`], where gravity is not along the nominal direction but leans towards an azimuth about the joint's axis:
    /// what decides the side that an upright joint's play is seated on.
    LeaningTorqueSign {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
        /// rad, from the first axis across ([`across`]).
        azimuth: f64,
        /// Friction holds the play in the middle where the lever towards which gravity leans carries less than this share of the force
        /// times the length of the arm outboard.
        held: f64,
    },
    /// \[2\] Cosine and sine of so many times a joint's angle turn it.
    Harmonic {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
        /// Periods per turn.
        order: f64,
    },
    /// \[4\] Cosine and sine of a joint's angle, and of twice the angle, turn it.
    TwoHarmonics {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
    },
    /// \[1\] A joint turns by the angle of another, or of its own.
    Ratio {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
        /// Joint whose angle counts.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        source: usize,
    },
    /// \[1\] A link grows with its temperature; all, and the foot, where there is none.
    Growth {
        /// Link.
        #[serde(default, skip_serializing_if = "Option::is_none", with = "from_one_or_none")]
        #[schemars(with = "Option<NonZeroUsize>")]
        link: Option<usize>,
    },
    /// \[1\] All links grow with their temperatures, and the foot with that of the first link, or not at all.
    GrowthOnFoot {
        /// Whether the foot grows.
        grows: bool,
    },
    /// \[1\] A joint turns with the temperature of its link.
    Warmth {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
    },
    /// \[1\] A shift along the force across a joint's axis. Friction of the fit holds what carries less than the share `held` of the
    /// force in the middle of its play.
    ForceAcrossSign {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
        /// Share.
        held: f64,
    },
    /// \[1\] A turn along the moment across a joint's axis. Friction of the fit holds what carries less than the share `held` of the
    /// force times the length of the arm outboard.
    MomentAcrossSign {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
        /// Share.
        held: f64,
    },
    /// \[6\] A twist of the base in proportion to time.
    BaseDrift,
    /// \[6\] A twist of the base from a row on.
    BaseStep {
        /// Place in the order of time, from 0, of the first reading after it.
        row: usize,
    },
    /// \[1\] A turn about the base's origin along the horizontal moment about it.
    BaseTilt,
    /// \[3, 6 with orientations\] A twist of the tool from a row on.
    ToolStep {
        /// Place in the order of time, from 0, of the first reading after it.
        row: usize,
    },
    /// \[1\] Positions in proportion to themselves.
    Scale,
    /// \[2\] A turn about a joint's origin: the moments about the x and y axes of its link bend it unequally.
    UnequalBend {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
    },
    /// \[2\] A turn about a joint's origin: the moment across seats it, about the x and y axes of its link unequally.
    UnequalSeat {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
    },
    /// \[2\] A shift: the force across a joint seats it, along the x and y axes of its link unequally.
    UnequalShift {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
    },
    /// \[6\] A twist of the base over a course of time.
    BaseCourse {
        /// How it goes.
        course: Course,
    },
    /// \[3, 6 with orientations\] A twist of the tool over a course of time.
    ToolCourse {
        /// How it goes.
        course: Course,
    },
    /// \[1\] A joint is off where its angle is near a value, within a half width: a raised cosine.
    Bump {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
        /// rad
        centre: f64,
        /// rad
        half_width: f64,
    },
    /// \[3\] A joint turns with its angle, the square and the cube of it.
    AngleCurve {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
    },
    /// \[[`MAP_ORDERS`]\] A joint is off by a free function of its angle: cosines over its travel.
    AngleMap {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
        /// Smallest angle, rad.
        low: f64,
        /// Largest angle, rad.
        high: f64,
    },
    /// \[2\] The moments about the x and y axes of a joint's frame turn it about z; the frame is that of the moving side or of the
    /// side that the joint moves on.
    Crosstalk {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
        /// The moving side.
        moving: bool,
    },
    /// \[2\] Torque, and its cube, turn a joint.
    Softening {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
    },
    /// \[2\] Torque, and the root of its size with its sign, turn a joint.
    Hardening {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
    },
    /// \[1\] The torque of past readings, forgotten over a time, turns a joint.
    TorqueMemory {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
        /// Which of [`FORGETTING_S`].
        which: usize,
    },
    /// \[2\] All joints yield alike, to the torque and to that of a mass that the tool carries besides.
    AllYield,
    /// \[1\] The direction of the last move, times the size of the torque.
    DirectionLoad {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
    },
    /// \[1\] The direction of the last move that was long enough fades with a joint's way: Dahl's memory of a way.
    Memory {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
        /// One of [`MEMORIES`], rad.
        way: f64,
    },
    /// \[2\] A joint turns with time and its square.
    TimeCurve {
        /// Joint, or the link that it moves.
        #[serde(with = "from_one")]
        #[schemars(with = "NonZeroUsize")]
        joint: usize,
    },
}

/// Joints and links are written as people count.
mod from_one {
    use serde::{Deserialize, Deserializer, Serializer};

    pub(super) fn serialize<S: Serializer>(index: &usize, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_u64(*index as u64 + 1)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<usize, D::Error> {
        let number = usize::deserialize(deserializer)?;
        number.checked_sub(1).ok_or_else(|| serde::de::Error::custom("joints and links count from 1"))
    }
}

/// The same where there may be none.
mod from_one_or_none {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn serialize<S: Serializer>(index: &Option<usize>, serializer: S) -> Result<S::Ok, S::Error> {
        index.map(|index| index + 1).serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<usize>, D::Error> {
        let number = Option::<usize>::deserialize(deserializer)?;
        let from_zero = |number: usize| number.checked_sub(1).ok_or_else(|| serde::de::Error::custom("links count from 1"));
        number.map(from_zero).transpose()
    }
}

/// Shapes without a name that share one prior.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Family {
    /// As many periods per turn as a gear makes.
    Ripple,
    /// Fewer.
    Harmonic,
    /// A joint near an angle.
    Bump,
    /// A joint over its angle, as a polynomial.
    AngleCurve,
    /// A joint over its angle, as a free function.
    AngleMap,
    /// A moment across that turns a joint.
    Crosstalk,
    /// A torque that turns a joint, not in proportion.
    NonlinearTorque,
    /// A torque that turns a joint slowly.
    TorqueMemory,
    /// Approach times torque.
    DirectionLoad,
    /// Past moves.
    Memory,
    /// A joint over time.
    TimeCurve,
    /// All joints at once.
    AllYield,
    /// A link that bends unequally.
    UnequalBend,
    /// A bearing that tilts unequally.
    UnequalSeat,
    /// A bearing that shifts unequally.
    UnequalShift,
    /// The base over time.
    BaseCourse,
    /// The tool over time.
    ToolCourse,
}

/// How something goes with the share of the session that has passed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Course {
    /// From 0 to 1 about a moment, along a raised cosine that is so wide.
    Ramp {
        /// Middle, share of the session.
        centre: f64,
        /// Whole width, share of the session.
        width: f64,
    },
    /// There and back: half a sine.
    Return,
    /// In proportion.
    Steady,
}

impl Course {
    /// At the share `share` of the session.
    #[must_use]
    pub fn at(self, share: f64) -> f64 {
        use std::f64::consts::PI;
        match self {
            Course::Ramp { centre, width } => 0.5 * (1.0 + libm::sin(PI * ((share - centre) / width).clamp(-0.5, 0.5))),
            Course::Return => libm::sin(PI * share),
            Course::Steady => share,
        }
    }
}

/// A row of measurements as signatures see it.
#[derive(Clone, Debug)]
pub struct Reading {
    /// The configuration.
    pub posture: Posture,
    /// Coordinates, rad or m.
    pub joints: Vec<f64>,
    /// Which joints slide.
    pub slides: Vec<bool>,
    /// Target on the tool, in root, m.
    pub target: Vector3<f64>,
    /// Direction of each joint's last move; empty where unknown.
    pub approach: Vec<f64>,
    /// Rise of each link's temperature, K; empty where unknown.
    pub rise_k: Vec<f64>,
    /// Rise of the foot's temperature, K.
    pub foot_rise_k: f64,
    /// Share of the session that has passed.
    pub share: f64,
    /// Place in time.
    pub order: usize,
    /// Each joint's torque as it is remembered, by [`FORGETTING_S`], N·m.
    pub torque_memory: Vec<[f64; FORGETTING_S.len()]>,
    /// Free fall, m/s².
    pub gravity: Vector3<f64>,
    /// Memory of each joint's moves, by [`MEMORIES`].
    pub memory: Vec<[f64; MEMORIES.len()]>,
}

/// Displacement of the target: shift (m) and turn (rad), in root.
pub type Displacement = [f64; 6];

pub(super) fn twist(shift: Vector3<f64>, turn: Vector3<f64>) -> Displacement {
    [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z]
}

impl Reading {
    /// Torque (N·m) or, where the joint slides, the force along it (N).
    pub(super) fn effort(&self, joint: usize) -> f64 {
        if self.slides[joint] { self.posture.forces[joint].dot(&self.posture.axes[joint]) } else { self.posture.torque(joint) }
    }

    /// The joint moves by `amount`.
    #[must_use]
    pub fn moved(&self, joint: usize, amount: f64) -> Displacement {
        self.posture.moved(joint, self.slides[joint], &self.target).map(|value| value * amount)
    }

    /// Everything from the origin of `joint` on turns by the rotation vector `turn`.
    pub(super) fn turned(&self, joint: usize, turn: Vector3<f64>) -> Displacement {
        twist(turn.cross(&(self.target - self.posture.origins[joint])), turn)
    }

    /// \[6\] Shifts along and turns about the axes of the root, times `factor`.
    pub(super) fn base_twist(&self, factor: f64) -> Vec<Displacement> {
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| axis * factor);
        let shifts = axes.map(|axis| twist(axis, Vector3::zeros()));
        let turns = axes.map(|axis| twist(axis.cross(&self.target), axis));
        [shifts, turns].concat()
    }

    /// \[3, 6 with orientations\] The same of the tool's axes, about its origin.
    pub(super) fn tool_twist(&self, factor: f64, orientation: bool) -> Vec<Displacement> {
        let lever = self.target - self.posture.tool;
        let axes = [0, 1, 2].map(|axis| Vector3::from(self.posture.tool_axes.column(axis)) * factor);
        let mut columns = axes.map(|axis| twist(axis, Vector3::zeros())).to_vec();
        if orientation {
            columns.extend(axes.map(|axis| twist(axis.cross(&lever), axis)));
        }
        columns
    }
}

impl Shape {
    /// The columns at `reading`, which must not lack what the shape follows ([`Shape::can_be_read`]). `orientation`: whether orientations
    /// are measured.
    #[must_use]
    pub fn columns(&self, reading: &Reading, orientation: bool) -> Vec<Displacement> {
        match *self {
            Shape::Torque { joint } => joint_compliance::columns(reading, joint),
            Shape::MomentAcross { joint } => link_bending::hinge_columns(reading, joint),
            Shape::Beam { joint } => link_bending::beam_columns(reading, joint),
            Shape::Direction { joint } => backlash::columns(reading, joint),
            Shape::TorqueSign { joint } => gravity_lost_motion::columns(reading, joint),
            Shape::LeaningTorqueSign { joint, azimuth, held } => {
                gravity_lost_motion::leaning_columns(reading, joint, azimuth, held)
            }
            Shape::Harmonic { joint, order } => joint_eccentricity::columns(reading, joint, order),
            Shape::TwoHarmonics { joint } => joint_eccentricity::both_columns(reading, joint),
            Shape::Ratio { joint, source } => gear_coupling::columns(reading, joint, source),
            Shape::Growth { link } => link_thermal_growth::columns(reading, link),
            Shape::GrowthOnFoot { grows } => link_thermal_growth::on_foot_columns(reading, grows),
            Shape::Warmth { joint } => joint_thermal_drift::columns(reading, joint),
            Shape::ForceAcrossSign { joint, held } => radial_clearance::columns(reading, joint, held),
            Shape::MomentAcrossSign { joint, held } => tilt_clearance::columns(reading, joint, held),
            Shape::BaseDrift => base_drift::columns(reading),
            Shape::BaseStep { row } => base_step::columns(reading, row),
            Shape::BaseTilt => base_tilt::columns(reading),
            Shape::ToolStep { row } => tool_step::columns(reading, row, orientation),
            Shape::Scale => measurement_scale::columns(reading),
            Shape::UnequalBend { joint } => unequal_bend::columns(reading, joint),
            Shape::UnequalSeat { joint } => unequal_seat::columns(reading, joint),
            Shape::UnequalShift { joint } => unequal_shift::columns(reading, joint),
            Shape::BaseCourse { course } => course::base_columns(reading, course),
            Shape::ToolCourse { course } => course::tool_columns(reading, course, orientation),
            Shape::Bump { joint, centre, half_width } => bump::columns(reading, joint, centre, half_width),
            Shape::AngleCurve { joint } => angle_curve::columns(reading, joint),
            Shape::AngleMap { joint, low, high } => angle_map::columns(reading, joint, low, high),
            Shape::Crosstalk { joint, moving } => crosstalk::columns(reading, joint, moving),
            Shape::Softening { joint } => nonlinear_torque::softening_columns(reading, joint),
            Shape::Hardening { joint } => nonlinear_torque::hardening_columns(reading, joint),
            Shape::TorqueMemory { joint, which } => torque_memory::columns(reading, joint, which),
            Shape::AllYield => all_yield::columns(reading),
            Shape::DirectionLoad { joint } => direction_load::columns(reading, joint),
            Shape::Memory { joint, way } => memory::columns(reading, joint, way),
            Shape::TimeCurve { joint } => time_curve::columns(reading, joint),
        }
    }

    /// Number of columns, and of those, from the first, that have the magnitude as their length.
    fn counts(&self, orientation: bool) -> (usize, usize) {
        match self {
            Shape::Torque { .. }
            | Shape::MomentAcross { .. }
            | Shape::Beam { .. }
            | Shape::Direction { .. }
            | Shape::TorqueSign { .. }
            | Shape::LeaningTorqueSign { .. }
            | Shape::Ratio { .. }
            | Shape::Growth { .. }
            | Shape::GrowthOnFoot { .. }
            | Shape::Warmth { .. }
            | Shape::ForceAcrossSign { .. }
            | Shape::MomentAcrossSign { .. }
            | Shape::BaseTilt
            | Shape::Scale
            | Shape::Bump { .. }
            | Shape::TorqueMemory { .. }
            | Shape::DirectionLoad { .. }
            | Shape::Memory { .. } => (1, 1),
            Shape::Harmonic { .. }
            | Shape::Crosstalk { .. }
            | Shape::Softening { .. }
            | Shape::Hardening { .. }
            | Shape::UnequalBend { .. }
            | Shape::UnequalSeat { .. }
            | Shape::UnequalShift { .. }
            | Shape::AllYield
            | Shape::TimeCurve { .. } => (2, 2),
            Shape::AngleCurve { .. } => (3, 3),
            // The magnitude is that of the first harmonic.
            Shape::TwoHarmonics { .. } => (4, 2),
            Shape::AngleMap { .. } => (MAP_ORDERS, MAP_ORDERS),
            // Of a twist, the length of its translation.
            Shape::BaseDrift | Shape::BaseStep { .. } | Shape::BaseCourse { .. } => (6, 3),
            Shape::ToolStep { .. } | Shape::ToolCourse { .. } => (if orientation { 6 } else { 3 }, 3),
        }
    }

    /// Number of columns.
    #[must_use]
    pub fn width(&self, orientation: bool) -> usize {
        self.counts(orientation).0
    }

    /// Number of columns, from the first, whose coefficients have the magnitude as their length.
    #[must_use]
    pub fn magnitude_width(&self) -> usize {
        self.counts(false).1
    }

    /// Whether nobody knows to which side this is seated at `reading`: the load is next to nothing, and friction or a base that is not
    /// level may decide.
    #[must_use]
    pub fn undecided(&self, reading: &Reading) -> bool {
        match *self {
            Shape::TorqueSign { joint } => gravity_lost_motion::undecided(reading, joint),
            Shape::LeaningTorqueSign { joint, azimuth, held } => {
                gravity_lost_motion::leaning_undecided(reading, joint, azimuth, held)
            }
            Shape::ForceAcrossSign { joint, .. } => radial_clearance::undecided(reading, joint),
            Shape::MomentAcrossSign { joint, .. } => tilt_clearance::undecided(reading, joint),
            // Nothing is seated, or the shape is one of no name, of which nobody asks.
            Shape::Torque { .. }
            | Shape::MomentAcross { .. }
            | Shape::Beam { .. }
            | Shape::Direction { .. }
            | Shape::Harmonic { .. }
            | Shape::TwoHarmonics { .. }
            | Shape::Ratio { .. }
            | Shape::Growth { .. }
            | Shape::GrowthOnFoot { .. }
            | Shape::Warmth { .. }
            | Shape::BaseDrift
            | Shape::BaseStep { .. }
            | Shape::BaseTilt
            | Shape::ToolStep { .. }
            | Shape::Scale
            | Shape::UnequalBend { .. }
            | Shape::UnequalSeat { .. }
            | Shape::UnequalShift { .. }
            | Shape::BaseCourse { .. }
            | Shape::ToolCourse { .. }
            | Shape::Bump { .. }
            | Shape::AngleCurve { .. }
            | Shape::AngleMap { .. }
            | Shape::Crosstalk { .. }
            | Shape::Softening { .. }
            | Shape::Hardening { .. }
            | Shape::TorqueMemory { .. }
            | Shape::AllYield
            | Shape::DirectionLoad { .. }
            | Shape::Memory { .. }
            | Shape::TimeCurve { .. } => false,
        }
    }

    /// Whether `reading` has what the shape follows: the side of the approach, or temperatures.
    #[must_use]
    pub fn can_be_read(&self, reading: &Reading) -> bool {
        match self {
            Shape::Direction { .. } | Shape::DirectionLoad { .. } => !reading.approach.is_empty(),
            Shape::Growth { .. } | Shape::GrowthOnFoot { .. } | Shape::Warmth { .. } => !reading.rise_k.is_empty(),
            Shape::Torque { .. }
            | Shape::MomentAcross { .. }
            | Shape::Beam { .. }
            | Shape::TorqueSign { .. }
            | Shape::LeaningTorqueSign { .. }
            | Shape::Harmonic { .. }
            | Shape::TwoHarmonics { .. }
            | Shape::Ratio { .. }
            | Shape::ForceAcrossSign { .. }
            | Shape::MomentAcrossSign { .. }
            | Shape::BaseDrift
            | Shape::BaseStep { .. }
            | Shape::BaseTilt
            | Shape::ToolStep { .. }
            | Shape::Scale
            | Shape::UnequalBend { .. }
            | Shape::UnequalSeat { .. }
            | Shape::UnequalShift { .. }
            | Shape::BaseCourse { .. }
            | Shape::ToolCourse { .. }
            | Shape::Bump { .. }
            | Shape::AngleCurve { .. }
            | Shape::AngleMap { .. }
            | Shape::Crosstalk { .. }
            | Shape::Softening { .. }
            | Shape::Hardening { .. }
            | Shape::TorqueMemory { .. }
            | Shape::AllYield
            | Shape::Memory { .. }
            | Shape::TimeCurve { .. } => true,
        }
    }

    /// Where it has no name: the family that it shares its prior with, and the kind whose signature it has in it as a special case, so
    /// that both cannot be in one model at one place. `None` for shapes that always have a name.
    #[must_use]
    pub fn unnamed(&self) -> Option<(Family, Option<Kind>)> {
        Some(match self {
            Shape::Harmonic { order, .. } if *order >= f64::from(*RIPPLES.start()) => (Family::Ripple, None),
            Shape::Harmonic { .. } => (Family::Harmonic, None),
            Shape::UnequalBend { .. } => (Family::UnequalBend, Some(Kind::LinkBending)),
            Shape::UnequalSeat { .. } => (Family::UnequalSeat, Some(Kind::TiltClearance)),
            Shape::UnequalShift { .. } => (Family::UnequalShift, Some(Kind::RadialClearance)),
            Shape::Softening { .. } | Shape::Hardening { .. } => (Family::NonlinearTorque, Some(Kind::JointCompliance)),
            Shape::BaseCourse { .. } => (Family::BaseCourse, None),
            Shape::ToolCourse { .. } => (Family::ToolCourse, None),
            Shape::Bump { .. } => (Family::Bump, None),
            Shape::AngleCurve { .. } => (Family::AngleCurve, None),
            Shape::AngleMap { .. } => (Family::AngleMap, None),
            Shape::Crosstalk { .. } => (Family::Crosstalk, None),
            Shape::TorqueMemory { .. } => (Family::TorqueMemory, None),
            Shape::AllYield => (Family::AllYield, None),
            Shape::DirectionLoad { .. } => (Family::DirectionLoad, None),
            Shape::Memory { .. } => (Family::Memory, None),
            Shape::TimeCurve { .. } => (Family::TimeCurve, None),
            Shape::Torque { .. }
            | Shape::MomentAcross { .. }
            | Shape::Beam { .. }
            | Shape::Direction { .. }
            | Shape::TorqueSign { .. }
            | Shape::LeaningTorqueSign { .. }
            | Shape::TwoHarmonics { .. }
            | Shape::Ratio { .. }
            | Shape::Growth { .. }
            | Shape::GrowthOnFoot { .. }
            | Shape::Warmth { .. }
            | Shape::ForceAcrossSign { .. }
            | Shape::MomentAcrossSign { .. }
            | Shape::BaseDrift
            | Shape::BaseStep { .. }
            | Shape::BaseTilt
            | Shape::ToolStep { .. }
            | Shape::Scale => return None,
        })
    }
}

/// How well friction is known, as a share of it: no fit's to better than some hundredths; neither is the load.
const FRICTION_KNOWN: f64 = 0.15;
/// Keeps quotients finite where there is no load, N or N·m: far below any that seats something.
const NO_LOAD: f64 = 1e-9;
/// Sigmas of a load below which nobody knows to which side it seats something.
const SIGMAS_UNDECIDED: f64 = 4.0;
/// Share of all the load below which a base that is not level may decide instead: it leans by a degree or so.
const SHARE_UNDECIDED: f64 = 0.02;

/// The direction of a load that seats something, as far as it is known: shorter than one where the load is as small as the `sigma` of
/// its components, so that a reading whose side nobody knows says little, and zero where friction up to `friction` holds.
pub(super) fn seated(load: Vector3<f64>, sigma: f64, friction: f64) -> Vector3<f64> {
    let size = load.norm();
    let edge = libm::hypot(sigma, FRICTION_KNOWN * friction).max(NO_LOAD);
    let free = if friction > 0.0 { (0.5 + 0.5 * (size - friction) / edge).clamp(0.0, 1.0) } else { 1.0 };
    load * free / libm::hypot(size, sigma).max(NO_LOAD)
}

/// Two directions across `axis` that do not turn with the joint.
#[must_use]
pub fn across(axis: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let other = if axis.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let y = axis.cross(&other).normalize();
    (y.cross(axis), y)
}

/// Whether a load is too little to say which way it seats something: `sigma` of it, `all` that there is.
pub(super) fn little(load: f64, sigma: f64, all: f64) -> bool {
    load < f64::max(SIGMAS_UNDECIDED * sigma, SHARE_UNDECIDED * all)
}
