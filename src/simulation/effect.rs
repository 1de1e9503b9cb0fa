//! What can be wrong with an arm, its cell and its sensor besides the geometric parameters: the hidden part of a scene, in SI.
//!
//! These are descriptions; [`physics`](crate::simulation::physics) and [`cell`](crate::simulation::cell) make them happen. True = reading + effect.

use nalgebra::Vector3;

use crate::effects::{Kind, Level, Location};

/// An un-modelled effect with its place and its magnitude. Joints and links count from 0 here; link `i` moves with joint `i`.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// A spring between servo and joint.
    JointCompliance {
        /// Joint.
        joint: usize,
        /// N·m/rad (N/m for a prismatic joint).
        stiffness: f64,
    },
    /// An elastic hinge across the joint's axis, at the joint: the bending of a link, lumped.
    LinkBending {
        /// Link.
        link: usize,
        /// rad/(N·m), about both axes across the joint's.
        compliance: f64,
    },
    /// Play between motor and output, the output held by friction: it lags behind the motor.
    Backlash {
        /// Joint.
        joint: usize,
        /// Full width, rad (m).
        width: f64,
    },
    /// The same without friction: gravity seats the output.
    GravityLostMotion {
        /// Joint.
        joint: usize,
        /// Full width, rad (m).
        width: f64,
    },
    /// The encoder's disc sits off its axis (first order) or tilted on it (second).
    JointEccentricity {
        /// Joint.
        joint: usize,
        /// Amplitude of the angle error, rad.
        amplitude: f64,
        /// 1 or 2: periods per turn.
        order: u8,
        /// The angle error is `amplitude · cos(order · q + phase)`, to first order; rad.
        phase: f64,
    },
    /// Transmission error of a strain-wave gear.
    StrainWaveError {
        /// Joint.
        joint: usize,
        /// Amplitude of the angle error, rad.
        amplitude: f64,
        /// Gear ratio N: the error is `amplitude · cos(2 N q + phase)`.
        ratio: f64,
        /// rad.
        phase: f64,
    },
    /// Gear ratio error and coupling: the output turns by `q (1 + ratio_error) + coupling · q_source`.
    GearCoupling {
        /// Joint that errs.
        joint: usize,
        /// Of its own angle, rad/rad.
        ratio_error: f64,
        /// Of the source's angle, rad/rad.
        coupling: f64,
        /// Joint whose motion leaks.
        source: usize,
    },
    /// Growth of a link, or of all with the foot.
    LinkThermalGrowth {
        /// Link; `None`: all, and the foot.
        link: Option<usize>,
        /// 1/K.
        expansion: f64,
    },
    /// The zero of a joint drifts with the temperature of the link that it moves.
    JointThermalDrift {
        /// Joint.
        joint: usize,
        /// rad/K.
        drift: f64,
    },
    /// Play of a bearing; see [`crate::simulation::physics::Clearance`].
    Clearance {
        /// Joint.
        joint: usize,
        /// Radius across the axis, m.
        radial: f64,
        /// Half width along the axis, m.
        axial: f64,
        /// Radius of the tilt, rad.
        tilt: f64,
    },
    /// Base or sensor move steadily from the session's start to its end.
    BaseDrift {
        /// What moves.
        moves: Moves,
        /// Over the whole session, m, in base.
        translation: Vector3<f64>,
        /// Over the whole session: rotation vector about the base's origin (the sensor's position), rad.
        rotation: Vector3<f64>,
    },
    /// Base or sensor move at one moment.
    BaseStep {
        /// What moves.
        moves: Moves,
        /// m, in base.
        translation: Vector3<f64>,
        /// Rotation vector about the base's origin (the sensor's position), rad.
        rotation: Vector3<f64>,
        /// Share of the session (0 to 1) after which it happens.
        after: f64,
    },
    /// The tool is seated anew at one moment.
    ToolStep {
        /// m, in the tool frame.
        translation: Vector3<f64>,
        /// Rotation vector, rad, in the tool frame.
        rotation: Vector3<f64>,
        /// Share of the session (0 to 1) after which it happens.
        after: f64,
    },
    /// The sensor's distances are wrong by a factor.
    MeasurementScale {
        /// Relative error.
        scale: f64,
    },
    /// Some readings have a larger noise.
    MeasurementOutliers {
        /// Share of the readings, 0 to 1.
        share: f64,
        /// Their noise is so many times the declared one.
        factor: f64,
    },
    /// Not in the analyser's library: a sector of worn teeth, in which the output falls behind.
    WornToothSector {
        /// Joint.
        joint: usize,
        /// How far the output falls behind in the middle of the sector, rad.
        depth: f64,
        /// Middle of the sector, rad.
        centre: f64,
        /// Half of its width, rad.
        half_width: f64,
    },
    /// Not in the analyser's library: the joint yields slowly after a move.
    CreepAfterMotion {
        /// Joint.
        joint: usize,
        /// Compliance that comes with time, rad/(N·m).
        compliance: f64,
        /// Time constant, s.
        time_constant: f64,
    },
    /// Not in the analyser's library: a moment across the joint's axis is taken for torque about it, and the joint turns.
    MomentCrosstalk {
        /// Joint.
        joint: usize,
        /// Turn about the axis per moment about the joint frame's x axis, rad/(N·m).
        gain: f64,
    },
    /// Not in the analyser's library: a joint that remembers its last moves (Dahl's friction).
    MemoryHysteresis {
        /// Joint.
        joint: usize,
        /// Half width of the hysteresis, rad.
        amplitude: f64,
        /// Way over which the memory fades, rad.
        travel: f64,
    },
    /// Not in the analyser's library: the payload weighs more than the cell believes, on an arm whose joints yield and whose servos
    /// compensate the sag that they expect: what is left is what the excess does.
    WrongPayload {
        /// True minus recorded mass, kg.
        excess: f64,
        /// Stiffness of every joint, N·m/rad.
        stiffness: f64,
    },
    /// Not in the analyser's library: a joint that stiffens under load, torque = stiffness · θ + cubic · θ³.
    HardeningStiffness {
        /// Joint.
        joint: usize,
        /// At no load, N·m/rad.
        stiffness: f64,
        /// N·m/rad³.
        cubic: f64,
    },
}

/// What a drift or a step of the measurement frame moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Moves {
    /// The robot's base.
    #[default]
    Base,
    /// The sensor.
    Sensor,
}

impl Effect {
    /// Name of its kind in scenes: those of [`Kind`], and of the kinds that the analyser does not know.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Effect::WornToothSector { .. } => "worn_tooth_sector",
            Effect::CreepAfterMotion { .. } => "creep_after_motion",
            Effect::MomentCrosstalk { .. } => "moment_crosstalk",
            Effect::MemoryHysteresis { .. } => "memory_hysteresis",
            Effect::WrongPayload { .. } => "wrong_payload",
            Effect::HardeningStiffness { .. } => "hardening_stiffness",
            known => known.kinds().first().map_or("clearance", |kind| kind.name()),
        }
    }

    /// What the analyser may call it; nothing where it is not to know it. A clearance may be of several kinds.
    #[must_use]
    pub fn kinds(&self) -> Vec<Kind> {
        match self {
            Effect::JointCompliance { .. } => vec![Kind::JointCompliance],
            Effect::LinkBending { .. } => vec![Kind::LinkBending],
            Effect::Backlash { .. } => vec![Kind::Backlash],
            Effect::GravityLostMotion { .. } => vec![Kind::GravityLostMotion],
            Effect::JointEccentricity { .. } => vec![Kind::JointEccentricity],
            Effect::StrainWaveError { .. } => vec![Kind::StrainWaveError],
            Effect::GearCoupling { .. } => vec![Kind::GearCoupling],
            Effect::LinkThermalGrowth { .. } => vec![Kind::LinkThermalGrowth],
            Effect::JointThermalDrift { .. } => vec![Kind::JointThermalDrift],
            Effect::Clearance { radial, tilt, .. } => {
                let radial = (*radial > 0.0).then_some(Kind::RadialClearance);
                radial.into_iter().chain((*tilt > 0.0).then_some(Kind::TiltClearance)).collect()
            }
            Effect::BaseDrift { .. } => vec![Kind::BaseDrift],
            Effect::BaseStep { .. } => vec![Kind::BaseStep],
            Effect::ToolStep { .. } => vec![Kind::ToolStep],
            Effect::MeasurementScale { .. } => vec![Kind::MeasurementScale],
            Effect::MeasurementOutliers { .. } => vec![Kind::MeasurementOutliers],
            Effect::WornToothSector { .. }
            | Effect::CreepAfterMotion { .. }
            | Effect::MomentCrosstalk { .. }
            | Effect::MemoryHysteresis { .. }
            | Effect::WrongPayload { .. }
            | Effect::HardeningStiffness { .. } => Vec::new(),
        }
    }

    /// Where it sits.
    #[must_use]
    pub fn location(&self) -> Location {
        let at = |level, index: usize| Location { level, index: Some(index + 1) };
        let of = |level| Location { level, index: None };
        match self {
            Effect::JointCompliance { joint, .. }
            | Effect::Backlash { joint, .. }
            | Effect::GravityLostMotion { joint, .. }
            | Effect::JointEccentricity { joint, .. }
            | Effect::StrainWaveError { joint, .. }
            | Effect::GearCoupling { joint, .. }
            | Effect::JointThermalDrift { joint, .. }
            | Effect::Clearance { joint, .. }
            | Effect::WornToothSector { joint, .. }
            | Effect::CreepAfterMotion { joint, .. }
            | Effect::MomentCrosstalk { joint, .. }
            | Effect::MemoryHysteresis { joint, .. }
            | Effect::HardeningStiffness { joint, .. } => at(Level::Joint, *joint),
            Effect::LinkBending { link, .. } => at(Level::Link, *link),
            Effect::LinkThermalGrowth { link, .. } => Location { level: Level::Link, index: link.map(|link| link + 1) },
            Effect::BaseDrift { .. } | Effect::BaseStep { .. } => of(Level::Base),
            Effect::ToolStep { .. } | Effect::WrongPayload { .. } => of(Level::Tool),
            Effect::MeasurementScale { .. } | Effect::MeasurementOutliers { .. } => of(Level::Sensor),
        }
    }
}
