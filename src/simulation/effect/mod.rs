//! What can be wrong with an arm, its cell and its sensor besides the geometric parameters: the hidden part of a scene, in SI.
//!
//! True = reading + effect. Beside each description stands what it adds to the parts of the true arm that make it happen, one file per
//! kind; effects of one kind at one place add up. What a sensor does to its reading is none of the arm's:
//! [`cell`](crate::simulation::cell) does that.
//! An effect comes from a scene ([`Effect::from_values`]) or is drawn ([`Effect::drawn`]).

// What makes each happen.
#[cfg(feature = "simulator")]
mod backlash;
#[cfg(feature = "simulator")]
mod base_drift;
#[cfg(feature = "simulator")]
mod base_step;
#[cfg(feature = "simulator")]
pub(super) mod base_tilt;
#[cfg(feature = "simulator")]
mod bearing_clearance;
#[cfg(feature = "simulator")]
mod creep;
#[cfg(feature = "simulator")]
mod creep_after_motion;
#[cfg(feature = "simulator")]
pub(super) mod direction_of_move;
#[cfg(feature = "simulator")]
mod gear_coupling;
#[cfg(feature = "simulator")]
mod gravity_lost_motion;
#[cfg(feature = "simulator")]
mod hardening_stiffness;
#[cfg(feature = "simulator")]
mod joint_angle_map;
#[cfg(feature = "simulator")]
mod joint_compliance;
#[cfg(feature = "simulator")]
mod joint_eccentricity;
#[cfg(feature = "simulator")]
mod joint_thermal_drift;
#[cfg(feature = "simulator")]
mod link_bending;
#[cfg(feature = "simulator")]
mod link_thermal_growth;
#[cfg(feature = "simulator")]
mod measurement_outliers;
#[cfg(feature = "simulator")]
mod measurement_scale;
#[cfg(feature = "simulator")]
mod memory_hysteresis;
#[cfg(feature = "simulator")]
pub(super) mod moment_crosstalk;
#[cfg(feature = "simulator")]
mod strain_wave_error;
#[cfg(feature = "simulator")]
mod tool_step;
#[cfg(feature = "simulator")]
mod unsettled_reading;
#[cfg(feature = "simulator")]
mod worn_tooth_sector;
#[cfg(feature = "simulator")]
mod wrong_payload;

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;

use crate::arm::Arm;
pub use crate::effects::values::{Foot, Moves, Values};
use crate::effects::{Kind, Level, Location};
use crate::seed::Stream;
#[cfg(feature = "simulator")]
use crate::simulation::physics::PhysicsError;
#[cfg(feature = "simulator")]
use crate::simulation::physics::clearance::Clearance;
#[cfg(feature = "simulator")]
use crate::simulation::physics::drive_train::{Memory, WaveGenerator, WornSector};
#[cfg(feature = "simulator")]
use crate::simulation::physics::mechanism::{Checks, Mechanisms};
use crate::statistics;

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
    /// Graduation or teeth are off here and there.
    JointAngleMap {
        /// Joint.
        joint: usize,
        /// Angles of the joint, rising, rad.
        angles: Vec<f64>,
        /// Error at each of them, straight between them and none beyond, rad.
        errors: Vec<f64>,
    },
    /// The output follows each move with a delay.
    Creep {
        /// Joint.
        joint: usize,
        /// Of a move, what is left at its reading.
        share: f64,
        /// Time over which it fades, s; zero: gone by the next reading.
        time_constant: f64,
    },
    /// Friction that grows with the torque winds the output up against its last move.
    DirectionOfMove {
        /// Joint.
        joint: usize,
        /// Angle per torque, from side to side, rad/(N·m).
        gain: f64,
    },
    /// Every output is behind by a share of the last move.
    UnsettledReading {
        /// Of the move.
        share: f64,
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

#[cfg(feature = "simulator")]
impl Effect {
    /// Adds what makes it happen to the parts of an arm.
    pub(super) fn add(&self, parts: &mut Mechanisms, checks: &Checks<'_>) -> Result<(), PhysicsError> {
        match *self {
            Effect::JointCompliance { joint, stiffness } => joint_compliance::add(parts, checks, joint, stiffness),
            Effect::LinkBending { link, compliance, beam } => link_bending::add(parts, checks, link, compliance, beam),
            Effect::Backlash { joint, width } => backlash::add(parts, checks, joint, width),
            Effect::GravityLostMotion { joint, width } => gravity_lost_motion::add(parts, checks, joint, width),
            Effect::JointEccentricity { joint, amplitude, order, phase } => {
                joint_eccentricity::add(parts, checks, joint, amplitude, order, phase)
            }
            Effect::StrainWaveError { joint, amplitude, ratio, phase } => {
                strain_wave_error::add(parts, checks, joint, WaveGenerator { amplitude, ratio, phase })
            }
            Effect::GearCoupling { joint, ratio_error, coupling, source } => {
                gear_coupling::add(parts, checks, joint, ratio_error, (source, coupling))
            }
            Effect::LinkThermalGrowth { of, expansion } => link_thermal_growth::add(parts, checks, of, expansion),
            Effect::JointThermalDrift { joint, drift } => joint_thermal_drift::add(parts, checks, joint, drift),
            Effect::Clearance { joint, radial, axial, tilt, held } => {
                let clearance = Clearance { radial_m: radial, axial_m: axial, tilt_rad: tilt };
                bearing_clearance::add(parts, checks, joint, clearance, held)
            }
            Effect::BaseDrift { moves, translation, rotation } => base_drift::add(parts, checks, moves, (translation, rotation)),
            Effect::BaseStep { moves, translation, rotation, after } => {
                base_step::add(parts, checks, moves, (translation, rotation), after)
            }
            Effect::BaseTilt { compliance } => base_tilt::add(parts, checks, compliance),
            Effect::ToolStep { translation, rotation, after } => tool_step::add(parts, checks, (translation, rotation), after),
            Effect::JointAngleMap { joint, ref angles, ref errors } => joint_angle_map::add(parts, checks, joint, angles, errors),
            Effect::Creep { joint, share, time_constant } => creep::add(parts, checks, joint, share, time_constant),
            Effect::DirectionOfMove { joint, gain } => direction_of_move::add(parts, checks, joint, gain),
            Effect::UnsettledReading { share } => unsettled_reading::add(parts, checks, share),
            Effect::MeasurementScale { scale } => measurement_scale::check(checks, scale),
            Effect::MeasurementOutliers { share, factor } => measurement_outliers::check(checks, share, factor),
            Effect::WornToothSector { joint, depth, centre, half_width } => {
                worn_tooth_sector::add(parts, checks, joint, WornSector { depth, centre, half_width })
            }
            Effect::CreepAfterMotion { joint, compliance, time_constant } => {
                creep_after_motion::add(parts, checks, joint, compliance, time_constant)
            }
            Effect::MomentCrosstalk { joint, gain } => moment_crosstalk::add(parts, checks, joint, gain),
            Effect::MemoryHysteresis { joint, amplitude, travel } => {
                memory_hysteresis::add(parts, checks, joint, Memory { amplitude, travel })
            }
            Effect::WrongPayload { excess, stiffness } => wrong_payload::add(parts, checks, excess, stiffness),
            Effect::HardeningStiffness { joint, stiffness, cubic } => {
                hardening_stiffness::add(parts, checks, joint, stiffness, cubic)
            }
        }
    }
}

/// What grows with temperature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Growing {
    /// One link.
    Link(usize),
    /// All links, and the foot or not.
    Arm(Foot),
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
            Kind::LinkThermalGrowth => {
                let of = place.map_or(Growing::Arm(values.foot), Growing::Link);
                Effect::LinkThermalGrowth { of, expansion: values.expansion }
            }
            Kind::JointThermalDrift => Effect::JointThermalDrift { joint, drift: values.drift },
            Kind::RadialClearance | Kind::TiltClearance => Effect::clearance(joint, values),
            Kind::BaseDrift => Effect::BaseDrift { moves, translation, rotation },
            Kind::BaseStep => Effect::BaseStep { moves, translation, rotation, after },
            Kind::BaseTilt => Effect::BaseTilt { compliance },
            Kind::ToolStep => Effect::ToolStep { translation, rotation, after },
            Kind::JointAngleMap => Effect::JointAngleMap { joint, angles: values.angles.clone(), errors: values.errors.clone() },
            Kind::Creep => Effect::Creep { joint, share: values.lag, time_constant: values.time_constant },
            Kind::DirectionOfMove => Effect::DirectionOfMove { joint, gain: values.gain },
            Kind::UnsettledReading => Effect::UnsettledReading { share: values.lag },
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
        Effect::Clearance { joint, radial: values.radial, axial: values.axial, tilt: values.tilt, held: values.held }
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
                // Once, twice or four times per turn of a motor.
                let ratio = [30.0, 50.0, 80.0, 100.0, 120.0, 160.0][stream.index(6)] * [0.5, 1.0, 2.0][stream.index(3)];
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
            Kind::JointAngleMap => {
                let (angles, errors) = graduation(magnitude, stream);
                Effect::JointAngleMap { joint, angles, errors }
            }
            Kind::Creep => Effect::Creep { joint, share: magnitude, time_constant: stream.uniform(5.0, 200.0) },
            Kind::DirectionOfMove => Effect::DirectionOfMove { joint, gain: magnitude },
            Kind::UnsettledReading => Effect::UnsettledReading { share: magnitude },
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
        self.described().kinds
    }

    /// Where it sits.
    #[must_use]
    pub fn location(&self) -> Location {
        let Described { kinds, place, .. } = self.described();
        // A clearance that has no kind is a joint's.
        let level = kinds.first().map_or(Level::Joint, |kind| kind.level());
        Location { level, index: place.map(|place| place + 1) }
    }

    /// Its magnitude in the unit of its kind, positive; of a clearance, of the part that `kind` names.
    #[must_use]
    pub fn magnitude(&self, kind: Option<Kind>) -> f64 {
        match self {
            Effect::Clearance { tilt, .. } if kind == Some(Kind::TiltClearance) => *tilt,
            effect => effect.described().magnitude,
        }
    }

    /// What it is, where, and in numbers.
    #[must_use]
    pub fn described(&self) -> Described {
        let of = |kind, place, size: f64| Described {
            kinds: vec![kind],
            place,
            size,
            magnitude: size.abs(),
            moves_joint: false,
            more: Vec::new(),
        };
        let at = |kind, joint, size| of(kind, Some(joint), size);
        let moving = |kind, joint, size| Described { moves_joint: true, ..at(kind, joint, size) };
        let twist = |kind, translation: Vector3<f64>, rotation: Vector3<f64>| Described {
            more: vec![("rotation_rad", rotation.norm())],
            ..of(kind, None, translation.norm())
        };
        match *self {
            Effect::JointCompliance { joint, stiffness } => moving(Kind::JointCompliance, joint, 1.0 / stiffness),
            Effect::LinkBending { link, compliance, .. } => at(Kind::LinkBending, link, compliance),
            Effect::Backlash { joint, width } => moving(Kind::Backlash, joint, width),
            Effect::GravityLostMotion { joint, width } => moving(Kind::GravityLostMotion, joint, width),
            Effect::JointEccentricity { joint, amplitude, order, phase } => {
                at(Kind::JointEccentricity, joint, amplitude).with("order", f64::from(order)).with("phase", phase)
            }
            Effect::StrainWaveError { joint, amplitude, ratio, phase } => {
                at(Kind::StrainWaveError, joint, amplitude).with("ratio", ratio).with("phase", phase)
            }
            Effect::GearCoupling { joint, ratio_error, coupling, source } => {
                let largest = ratio_error.abs().max(coupling.abs());
                let one = at(Kind::GearCoupling, joint, largest).with("ratio_error", ratio_error).with("coupling", coupling);
                one.with("source", source as f64 + 1.0)
            }
            Effect::LinkThermalGrowth { of: Growing::Link(link), expansion } => at(Kind::LinkThermalGrowth, link, expansion),
            Effect::LinkThermalGrowth { of: Growing::Arm(_), expansion } => of(Kind::LinkThermalGrowth, None, expansion),
            Effect::JointThermalDrift { joint, drift } => at(Kind::JointThermalDrift, joint, drift),
            Effect::Clearance { joint, radial, axial, tilt, .. } => {
                let kinds = [(radial, Kind::RadialClearance), (tilt, Kind::TiltClearance)];
                let kinds = kinds.into_iter().filter(|(play, _)| *play > 0.0).map(|(_, kind)| kind).collect();
                let size = if radial == 0.0 && tilt > 0.0 { tilt } else { radial };
                let one = Described { kinds, magnitude: radial, ..at(Kind::RadialClearance, joint, size) };
                one.with("radial_m", radial).with("axial_m", axial).with("tilt_rad", tilt)
            }
            Effect::BaseDrift { translation, rotation, .. } => twist(Kind::BaseDrift, translation, rotation),
            Effect::BaseStep { translation, rotation, after, .. } => {
                twist(Kind::BaseStep, translation, rotation).with("after", after)
            }
            Effect::BaseTilt { compliance } => of(Kind::BaseTilt, None, compliance),
            Effect::ToolStep { translation, rotation, after } => {
                twist(Kind::ToolStep, translation, rotation).with("after", after)
            }
            Effect::JointAngleMap { joint, ref errors, .. } => {
                at(Kind::JointAngleMap, joint, statistics::rms(errors.iter().copied()))
            }
            Effect::Creep { joint, share, time_constant } => at(Kind::Creep, joint, share).with("time_constant_s", time_constant),
            Effect::DirectionOfMove { joint, gain } => at(Kind::DirectionOfMove, joint, gain),
            Effect::UnsettledReading { share } => of(Kind::UnsettledReading, None, share),
            Effect::MeasurementScale { scale } => of(Kind::MeasurementScale, None, scale),
            Effect::MeasurementOutliers { share, factor } => of(Kind::MeasurementOutliers, None, share).with("factor", factor),
            Effect::WornToothSector { joint, depth, centre, half_width } => {
                at(Kind::WornToothSector, joint, depth).with("centre", centre).with("half_width", half_width)
            }
            Effect::CreepAfterMotion { joint, compliance, time_constant } => {
                moving(Kind::CreepAfterMotion, joint, compliance).with("time_constant_s", time_constant)
            }
            Effect::MomentCrosstalk { joint, gain } => at(Kind::MomentCrosstalk, joint, gain),
            Effect::MemoryHysteresis { joint, amplitude, travel } => {
                let half = moving(Kind::MemoryHysteresis, joint, amplitude).with("travel", travel);
                Described { magnitude: 2.0 * amplitude, ..half }
            }
            Effect::WrongPayload { excess, stiffness } => of(Kind::WrongPayload, None, excess).with("stiffness", stiffness),
            Effect::HardeningStiffness { joint, stiffness, cubic } => {
                moving(Kind::HardeningStiffness, joint, 1.0 / stiffness).with("cubic", cubic)
            }
        }
    }
}

/// What an effect is, where, and in numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Described {
    /// Its kind; a clearance may be of several, or of none.
    pub kinds: Vec<Kind>,
    /// Joint or link, from 0; `None` for the whole arm and for what has no number.
    pub place: Option<usize>,
    /// How large it is, as a truth file writes it: with its sign, of a memory half of its width, of a clearance the radius of what it has.
    pub size: f64,
    /// How large it is, in the convention of [`Kind::unit`]: positive; of a clearance, the radial one.
    pub magnitude: f64,
    /// Whether it is a motion of the joint itself, so that metres stand for radians where the joint slides.
    pub moves_joint: bool,
    /// What else describes it, by name, SI.
    pub more: Vec<(&'static str, f64)>,
}

impl Described {
    fn with(mut self, name: &'static str, value: f64) -> Described {
        self.more.push((name, value));
        self
    }

    /// What else describes it by this name.
    #[must_use]
    pub fn value(&self, name: &str) -> Option<f64> {
        self.more.iter().find(|(known, _)| *known == name).map(|(_, value)| *value)
    }
}

impl Growing {
    /// A link (from 0), or all with the foot.
    #[must_use]
    pub fn of(link: Option<usize>) -> Growing {
        link.map_or(Growing::Arm(Foot::Own), Growing::Link)
    }
}

/// Orders of a drawn graduation error: those below are an eccentricity's.
const GRADUATION_ORDERS: std::ops::RangeInclusive<u8> = 3..=30;

/// Angles over two turns, a degree apart, and errors there that come again after each turn: waves of all [`GRADUATION_ORDERS`], the finer
/// the smaller, with `rms`, rad.
fn graduation(rms: f64, stream: &mut Stream) -> (Vec<f64>, Vec<f64>) {
    let waves: Vec<(f64, f64, f64)> = GRADUATION_ORDERS
        .map(|order| (f64::from(order), stream.normal() / f64::from(order).sqrt(), stream.normal() / f64::from(order).sqrt()))
        .collect();
    let scale = rms / libm::sqrt(0.5 * waves.iter().map(|(_, a, b)| a * a + b * b).sum::<f64>());
    let angles: Vec<f64> = (-360..=360).map(|degree| f64::from(degree).to_radians()).collect();
    let error = |angle: &f64| -> f64 {
        waves.iter().map(|(order, a, b)| scale * (a * libm::cos(order * angle) + b * libm::sin(order * angle))).sum()
    };
    let errors: Vec<f64> = angles.iter().map(error).collect();
    // The end of a turn counts twice.
    let exact = rms / statistics::rms(errors.iter().copied());
    (angles, errors.iter().map(|error| exact * error).collect())
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
