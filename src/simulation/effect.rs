//! What can be wrong with an arm, its cell and its sensor besides the geometric parameters: the hidden part of a scene, in SI.
//!
//! These are descriptions; [`physics`](crate::simulation::physics) and [`cell`](crate::simulation::cell) make them happen. True = reading + effect.
//! An effect comes from a scene ([`Effect::from_values`]) or is drawn ([`Effect::drawn`]).

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;

use crate::arm::Arm;
use crate::effects::{Kind, Level, Location};
use crate::seed::Stream;

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
    /// An elastic hinge across the joint's axis, at the joint: the bending of a link, lumped; or a link that bends all along.
    LinkBending {
        /// Link.
        link: usize,
        /// rad/(N·m), about both axes across the joint's; of a beam, about both axes across its own direction, summed along it.
        compliance: f64,
        /// Whether it is a slender beam from its joint to the next (the last: to the tool).
        beam: bool,
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
        /// What grows.
        of: Growing,
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
        /// Share of the load (of the moment: over weight times length of the arm outboard) up to which friction holds the play in its
        /// middle; `None`: as [`Settling::holding_ratio`](crate::simulation::physics::Settling::holding_ratio) says of all joints.
        held: Option<f64>,
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
    /// The base leans under the moment of arm and payload about its origin.
    BaseTilt {
        /// rad/(N·m), along the moment across gravity.
        compliance: f64,
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
    /// Not known to the diagnosis: a sector of worn teeth, in which the output falls behind.
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
    /// Not known to the diagnosis: the joint yields slowly after a move.
    CreepAfterMotion {
        /// Joint.
        joint: usize,
        /// Compliance that comes with time, rad/(N·m).
        compliance: f64,
        /// Time constant, s.
        time_constant: f64,
    },
    /// Not known to the diagnosis: a moment across the joint's axis is taken for torque about it, and the joint turns.
    MomentCrosstalk {
        /// Joint.
        joint: usize,
        /// Turn about the axis per moment about the joint frame's x axis, rad/(N·m).
        gain: f64,
    },
    /// Not known to the diagnosis: a joint that remembers its last moves (Dahl's friction).
    MemoryHysteresis {
        /// Joint.
        joint: usize,
        /// Half width of the hysteresis, rad.
        amplitude: f64,
        /// Way over which the memory fades, rad.
        travel: f64,
    },
    /// Not known to the diagnosis: the payload weighs more than the cell believes, on an arm whose joints yield and whose servos
    /// compensate the sag that they expect: what is left is what the excess does.
    WrongPayload {
        /// True minus recorded mass, kg.
        excess: f64,
        /// Stiffness of every joint, N·m/rad.
        stiffness: f64,
    },
    /// Not known to the diagnosis: a joint that stiffens under load, torque = stiffness · θ + cubic · θ³.
    HardeningStiffness {
        /// Joint.
        joint: usize,
        /// At no load, N·m/rad.
        stiffness: f64,
        /// N·m/rad³.
        cubic: f64,
    },
}

/// What grows with temperature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Growing {
    /// One link.
    Link(usize),
    /// All links, and the foot or not.
    Arm(Foot),
}

/// How the foot grows with the arm: from the base link's frame to the first joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Foot {
    /// With its own temperature.
    Own,
    /// As warm as the first link that moves.
    AsFirstLink,
    /// Not at all.
    Still,
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

/// What a scene gives of an effect besides kind and place, SI; zero where it says nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Values {
    /// N·m/rad
    pub stiffness: f64,
    /// N·m/rad³
    pub cubic: f64,
    /// rad/(N·m)
    pub compliance: f64,
    /// Whether a link bends as a beam.
    pub beam: bool,
    /// rad/(N·m)
    pub gain: f64,
    /// Full width of a play, rad.
    pub width: f64,
    /// rad
    pub amplitude: f64,
    /// Periods per turn.
    pub order: u8,
    /// rad
    pub phase: f64,
    /// Gear ratio.
    pub ratio: f64,
    /// rad/rad
    pub ratio_error: f64,
    /// rad/rad
    pub coupling: f64,
    /// Joint whose motion leaks, from 0.
    pub source: usize,
    /// 1/K
    pub expansion: f64,
    /// rad/K
    pub drift: f64,
    /// m
    pub radial: f64,
    /// m
    pub axial: f64,
    /// rad
    pub tilt: f64,
    /// What a drift or a step moves.
    pub moves: Moves,
    /// m
    pub translation: Vector3<f64>,
    /// Rotation vector, rad.
    pub rotation: Vector3<f64>,
    /// Share of the session.
    pub after: f64,
    /// Relative error.
    pub scale: f64,
    /// Share of the readings.
    pub share: f64,
    /// Of the noise.
    pub factor: f64,
    /// rad
    pub depth: f64,
    /// rad
    pub centre: f64,
    /// rad
    pub half_width: f64,
    /// s
    pub time_constant: f64,
    /// rad
    pub travel: f64,
    /// kg
    pub excess: f64,
}

impl Effect {
    /// The effect of `kind` at joint or link `place` (from 0; `None` for what has no number) with these values.
    #[must_use]
    pub fn from_values(kind: Kind, place: Option<usize>, values: &Values) -> Effect {
        let joint = place.unwrap_or(0);
        let Values { stiffness, compliance, width, amplitude, phase, moves, translation, rotation, after, .. } = *values;
        match kind {
            Kind::JointCompliance => Effect::JointCompliance { joint, stiffness },
            Kind::LinkBending => Effect::LinkBending { link: joint, compliance, beam: values.beam },
            Kind::Backlash => Effect::Backlash { joint, width },
            Kind::GravityLostMotion => Effect::GravityLostMotion { joint, width },
            Kind::JointEccentricity => Effect::JointEccentricity { joint, amplitude, order: values.order, phase },
            Kind::StrainWaveError => Effect::StrainWaveError { joint, amplitude, ratio: values.ratio, phase },
            Kind::GearCoupling => {
                let Values { ratio_error, coupling, source, .. } = *values;
                Effect::GearCoupling { joint, ratio_error, coupling, source }
            }
            Kind::LinkThermalGrowth => Effect::LinkThermalGrowth { of: Growing::of(place), expansion: values.expansion },
            Kind::JointThermalDrift => Effect::JointThermalDrift { joint, drift: values.drift },
            Kind::RadialClearance | Kind::TiltClearance => Effect::clearance(joint, values),
            Kind::BaseDrift => Effect::BaseDrift { moves, translation, rotation },
            Kind::BaseStep => Effect::BaseStep { moves, translation, rotation, after },
            Kind::BaseTilt => Effect::BaseTilt { compliance },
            Kind::ToolStep => Effect::ToolStep { translation, rotation, after },
            Kind::MeasurementScale => Effect::MeasurementScale { scale: values.scale },
            Kind::MeasurementOutliers => Effect::MeasurementOutliers { share: values.share, factor: values.factor },
            Kind::WornToothSector => {
                let Values { depth, centre, half_width, .. } = *values;
                Effect::WornToothSector { joint, depth, centre, half_width }
            }
            Kind::CreepAfterMotion => Effect::CreepAfterMotion { joint, compliance, time_constant: values.time_constant },
            Kind::MomentCrosstalk => Effect::MomentCrosstalk { joint, gain: values.gain },
            Kind::MemoryHysteresis => Effect::MemoryHysteresis { joint, amplitude, travel: values.travel },
            Kind::WrongPayload => Effect::WrongPayload { excess: values.excess, stiffness },
            Kind::HardeningStiffness => Effect::HardeningStiffness { joint, stiffness, cubic: values.cubic },
        }
    }

    /// All plays of a bearing together.
    #[must_use]
    pub fn clearance(joint: usize, values: &Values) -> Effect {
        Effect::Clearance { joint, radial: values.radial, axial: values.axial, tilt: values.tilt, held: None }
    }

    /// The effect of this magnitude (SI, positive, as [`Kind::unit`] has it) at `place`; what else it has is drawn from `stream`, as
    /// many numbers whatever the magnitude.
    #[must_use]
    pub fn drawn(kind: Kind, place: Option<usize>, magnitude: f64, arm: &Arm, stream: &mut Stream) -> Effect {
        let joint = place.unwrap_or(0);
        let sign = |stream: &mut Stream| if stream.unit() < 0.5 { -1.0 } else { 1.0 };
        match kind {
            Kind::JointCompliance => Effect::JointCompliance { joint, stiffness: 1.0 / magnitude },
            Kind::LinkBending => Effect::LinkBending { link: joint, compliance: magnitude, beam: false },
            Kind::Backlash => Effect::Backlash { joint, width: magnitude },
            Kind::GravityLostMotion => Effect::GravityLostMotion { joint, width: magnitude },
            Kind::JointEccentricity => {
                let order = 1 + stream.index(2) as u8;
                Effect::JointEccentricity { joint, amplitude: magnitude, order, phase: stream.uniform(-PI, PI) }
            }
            Kind::StrainWaveError => {
                let ratio = [80.0, 100.0, 120.0][stream.index(3)];
                Effect::StrainWaveError { joint, amplitude: magnitude, ratio, phase: stream.uniform(-PI, PI) }
            }
            Kind::GearCoupling => {
                let signed = sign(stream) * magnitude;
                match leaking(joint, arm.joint_count(), stream.unit()) {
                    None => {
                        let source = leaking(joint, arm.joint_count(), 0.5).unwrap_or(joint);
                        Effect::GearCoupling { joint, ratio_error: signed, coupling: 0.0, source }
                    }
                    Some(source) => Effect::GearCoupling { joint, ratio_error: 0.0, coupling: signed, source },
                }
            }
            Kind::LinkThermalGrowth => Effect::LinkThermalGrowth { of: Growing::of(place), expansion: magnitude },
            Kind::JointThermalDrift => Effect::JointThermalDrift { joint, drift: sign(stream) * magnitude },
            Kind::RadialClearance => Effect::Clearance { joint, radial: magnitude, axial: 0.0, tilt: 0.0, held: None },
            Kind::TiltClearance => Effect::Clearance { joint, radial: 0.0, axial: 0.0, tilt: magnitude, held: None },
            Kind::BaseDrift => Effect::BaseDrift {
                moves: Moves::Base,
                translation: magnitude * direction(stream),
                rotation: turn(magnitude, stream),
            },
            Kind::BaseStep => Effect::BaseStep {
                moves: Moves::Base,
                translation: magnitude * direction(stream),
                rotation: turn(magnitude, stream),
                after: stream.uniform(0.25, 0.75),
            },
            Kind::BaseTilt => Effect::BaseTilt { compliance: magnitude },
            Kind::ToolStep => Effect::ToolStep {
                translation: magnitude * direction(stream),
                rotation: turn(magnitude, stream),
                after: stream.uniform(0.25, 0.75),
            },
            Kind::MeasurementScale => Effect::MeasurementScale { scale: sign(stream) * magnitude },
            Kind::MeasurementOutliers => Effect::MeasurementOutliers { share: magnitude, factor: stream.uniform(6.0, 20.0) },
            Kind::WornToothSector => {
                let [lower, upper] = [arm.chain.joints[joint].lower, arm.chain.joints[joint].upper].map(|end| 0.6 * end);
                let centre = stream.uniform(lower, upper);
                Effect::WornToothSector { joint, depth: magnitude, centre, half_width: stream.uniform(0.2, 0.6) }
            }
            Kind::CreepAfterMotion => {
                Effect::CreepAfterMotion { joint, compliance: magnitude, time_constant: stream.uniform(20.0, 200.0) }
            }
            Kind::MomentCrosstalk => Effect::MomentCrosstalk { joint, gain: sign(stream) * magnitude },
            Kind::MemoryHysteresis => {
                Effect::MemoryHysteresis { joint, amplitude: 0.5 * magnitude, travel: stream.uniform(0.3, 1.5) }
            }
            Kind::WrongPayload => Effect::WrongPayload { excess: magnitude, stiffness: stream.uniform(1e4, 3e4) },
            Kind::HardeningStiffness => {
                // The cubic part is as large as the linear one at this angle.
                let angle = stream.uniform(0.3e-3, 1.5e-3);
                Effect::HardeningStiffness { joint, stiffness: 1.0 / magnitude, cubic: 1.0 / (magnitude * angle * angle) }
            }
        }
    }

    /// Name of its kind in scenes and results; of all plays of a bearing together, `clearance`.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.kinds().first().map_or("clearance", |kind| kind.name())
    }

    /// Its kind; a clearance may be of several, or of none.
    #[must_use]
    pub fn kinds(&self) -> Vec<Kind> {
        let one = match self {
            Effect::JointCompliance { .. } => Kind::JointCompliance,
            Effect::LinkBending { .. } => Kind::LinkBending,
            Effect::Backlash { .. } => Kind::Backlash,
            Effect::GravityLostMotion { .. } => Kind::GravityLostMotion,
            Effect::JointEccentricity { .. } => Kind::JointEccentricity,
            Effect::StrainWaveError { .. } => Kind::StrainWaveError,
            Effect::GearCoupling { .. } => Kind::GearCoupling,
            Effect::LinkThermalGrowth { .. } => Kind::LinkThermalGrowth,
            Effect::JointThermalDrift { .. } => Kind::JointThermalDrift,
            Effect::Clearance { radial, tilt, .. } => {
                let radial = (*radial > 0.0).then_some(Kind::RadialClearance);
                return radial.into_iter().chain((*tilt > 0.0).then_some(Kind::TiltClearance)).collect();
            }
            Effect::BaseDrift { .. } => Kind::BaseDrift,
            Effect::BaseStep { .. } => Kind::BaseStep,
            Effect::BaseTilt { .. } => Kind::BaseTilt,
            Effect::ToolStep { .. } => Kind::ToolStep,
            Effect::MeasurementScale { .. } => Kind::MeasurementScale,
            Effect::MeasurementOutliers { .. } => Kind::MeasurementOutliers,
            Effect::WornToothSector { .. } => Kind::WornToothSector,
            Effect::CreepAfterMotion { .. } => Kind::CreepAfterMotion,
            Effect::MomentCrosstalk { .. } => Kind::MomentCrosstalk,
            Effect::MemoryHysteresis { .. } => Kind::MemoryHysteresis,
            Effect::WrongPayload { .. } => Kind::WrongPayload,
            Effect::HardeningStiffness { .. } => Kind::HardeningStiffness,
        };
        vec![one]
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
            Effect::LinkBending { link, .. } | Effect::LinkThermalGrowth { of: Growing::Link(link), .. } => {
                at(Level::Link, *link)
            }
            Effect::LinkThermalGrowth { of: Growing::Arm(_), .. } => of(Level::Link),
            Effect::BaseDrift { .. } | Effect::BaseStep { .. } | Effect::BaseTilt { .. } => of(Level::Base),
            Effect::ToolStep { .. } | Effect::WrongPayload { .. } => of(Level::Tool),
            Effect::MeasurementScale { .. } | Effect::MeasurementOutliers { .. } => of(Level::Sensor),
        }
    }

    /// Its magnitude in the unit of its kind, positive; of a clearance, of the part that `kind` names.
    #[must_use]
    pub fn magnitude(&self, kind: Option<Kind>) -> f64 {
        match self {
            Effect::JointCompliance { stiffness, .. } | Effect::HardeningStiffness { stiffness, .. } => 1.0 / stiffness,
            Effect::LinkBending { compliance, .. }
            | Effect::CreepAfterMotion { compliance, .. }
            | Effect::BaseTilt { compliance } => *compliance,
            Effect::Backlash { width, .. } | Effect::GravityLostMotion { width, .. } => *width,
            Effect::JointEccentricity { amplitude, .. } | Effect::StrainWaveError { amplitude, .. } => amplitude.abs(),
            Effect::GearCoupling { ratio_error, coupling, .. } => ratio_error.abs().max(coupling.abs()),
            Effect::LinkThermalGrowth { expansion, .. } => expansion.abs(),
            Effect::JointThermalDrift { drift, .. } => drift.abs(),
            Effect::Clearance { radial, tilt, .. } => {
                if kind == Some(Kind::TiltClearance) {
                    *tilt
                } else {
                    *radial
                }
            }
            Effect::BaseDrift { translation, .. }
            | Effect::BaseStep { translation, .. }
            | Effect::ToolStep { translation, .. } => translation.norm(),
            Effect::MeasurementScale { scale } => scale.abs(),
            Effect::MeasurementOutliers { share, .. } => *share,
            Effect::WornToothSector { depth, .. } => *depth,
            Effect::MomentCrosstalk { gain, .. } => gain.abs(),
            Effect::MemoryHysteresis { amplitude, .. } => 2.0 * amplitude,
            Effect::WrongPayload { excess, .. } => excess.abs(),
        }
    }
}

impl Growing {
    /// A link (from 0), or all with the foot.
    #[must_use]
    pub fn of(link: Option<usize>) -> Growing {
        link.map_or(Growing::Arm(Foot::Own), Growing::Link)
    }
}

/// Whose motion leaks into `joint` of an arm of so many `joints`: `None` for its own gear in half of the cases, else a neighbour, whose
/// drive shares its housing. `chance`: uniform between 0 and 1.
fn leaking(joint: usize, joints: usize, chance: f64) -> Option<usize> {
    let before = joint.checked_sub(1);
    let next = Some(joint + 1).filter(|next| *next < joints);
    match chance {
        own if own < 0.5 => None,
        first if first < 0.75 => before.or(next),
        _ => next.or(before),
    }
}

/// A unit vector, uniform on the sphere.
fn direction(stream: &mut Stream) -> Vector3<f64> {
    let z = stream.uniform(-1.0, 1.0);
    let (sine, cosine) = libm::sincos(stream.uniform(0.0, TAU));
    let across = (1.0 - z * z).sqrt();
    Vector3::new(across * cosine, across * sine, z)
}

/// The rotation that comes with a translation of `magnitude` metres: up to as many radians.
fn turn(magnitude: f64, stream: &mut Stream) -> Vector3<f64> {
    let size = stream.uniform(0.2, 1.0) * magnitude;
    size * direction(stream)
}
