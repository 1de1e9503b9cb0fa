//! What each effect is made of: a list of effects sorted into the parts of the true arm that make them happen, one file per kind.
//!
//! Effects of the same kind at one place add up. What a sensor does to its reading is none of the arm's: `cell::sensor` does that.

mod backlash;
mod base_drift;
mod base_step;
mod base_tilt;
mod bearing_clearance;
mod creep_after_motion;
mod gear_coupling;
mod gravity_lost_motion;
mod hardening_stiffness;
mod joint_compliance;
mod joint_eccentricity;
mod joint_thermal_drift;
mod link_bending;
mod link_thermal_growth;
mod measurement_outliers;
mod measurement_scale;
mod memory_hysteresis;
mod moment_crosstalk;
mod strain_wave_error;
mod tool_step;
mod worn_tooth_sector;
mod wrong_payload;

use nalgebra::{Translation3, Vector3};

use super::clearance::Clearance;
use super::coordinate::{Coordinate, Direction, Law};
use super::drive_train::{Drive, Memory, WaveGenerator, WornSector};
use super::error::PhysicsError;
use super::true_arm::{Placement, TrueArm};
use super::world::World;
use crate::arm::JointKind;
use crate::arm::frames::{Pose, rotation_from_vector};
use crate::effects::Location;
use crate::simulation::effect::Effect;

/// The parts.
#[derive(Clone, Debug)]
pub(super) struct Mechanisms {
    /// Play of each joint.
    pub(super) clearances: Vec<Clearance>,
    /// What friction holds of the play of each joint, where an effect says so.
    pub(super) held: Vec<Held>,
    /// Drive train of each joint.
    pub(super) drives: Vec<Drive>,
    /// Coordinates that yield, from the base outwards and in the order of their series.
    pub(super) coordinates: Vec<Coordinate>,
    /// Expansion of each link, base link first, 1/K.
    pub(super) expansion_per_k: Vec<f64>,
    /// Expansion of the base link with the temperature of the first link that moves, 1/K.
    pub(super) foot_expansion_with_first_link_per_k: f64,
    /// What moves the base.
    pub(super) base_shifts: Vec<Shift>,
    /// What moves the tool on the last link.
    pub(super) tool_shifts: Vec<Shift>,
    /// Mass that the tool carries beyond what is believed, kg.
    pub(super) excess_kg: f64,
    /// What answers to the load.
    pub(super) reactions: Reactions,
}

/// What answers to the load by moving the arm, until both agree: it is looked at anew after every step.
#[derive(Clone, Debug, Default)]
pub(super) struct Reactions {
    /// Turn of each joint per moment about the x axis of its frame, rad/(N·m).
    crosstalk: Vec<f64>,
    /// Lean of the base per moment about its origin, rad/(N·m).
    base_tilt: f64,
}

impl Reactions {
    /// Whether nothing answers.
    pub(super) fn is_none(&self) -> bool {
        self.base_tilt == 0.0 && self.crosstalk.iter().all(|gain| *gain == 0.0)
    }

    /// Moves what is to be placed: `unloaded` as it would be without a load, under the load of the arm as `world` has last placed it.
    pub(super) fn answer(&self, arm: &TrueArm, world: &World, unloaded: &Placement, placement: &mut Placement) {
        moment_crosstalk::answer(&self.crosstalk, arm, world, unloaded, placement);
        base_tilt::answer(self.base_tilt, arm, world, unloaded, placement);
    }
}

/// Shares of the load up to which friction holds a play in its middle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Held {
    /// Of the force that the joint carries, for the radial and the axial play.
    pub(super) force: Option<f64>,
    /// Of that force times the length of the arm outboard, for the tilting play.
    pub(super) moment: Option<f64>,
}

/// A frame that moves in the course of the session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct Shift {
    translation: Vector3<f64>,
    /// Rotation vector.
    rotation: Vector3<f64>,
    when: When,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum When {
    /// In proportion to the share of the session that has passed.
    Steadily,
    /// At once when this share has passed.
    At(f64),
}

impl Shift {
    /// `before_from_after` when `share` of the session has passed.
    fn at(&self, share: f64) -> Pose {
        let done = match self.when {
            When::Steadily => share,
            When::At(after) => f64::from(u8::from(share >= after)),
        };
        Pose::from_parts(Translation3::from(self.translation * done), rotation_from_vector(&(self.rotation * done)))
    }
}

/// All of `shifts`, one after the other; `None` where there are none.
pub(in super::super) fn shifted(shifts: &[Shift], share: f64) -> Option<Pose> {
    shifts.iter().map(|shift| shift.at(share)).reduce(|before, shift| before * shift)
}

/// Stiffnesses that joints and links may have: softer ones would not yield by a small motion, stiffer ones not at all.
const STIFF: std::ops::RangeInclusive<f64> = 100.0..=1e12;

/// Checks of an effect's numbers, which say whose they are.
struct Checks<'a> {
    /// How each joint moves.
    kinds: &'a [JointKind],
    effect: &'static str,
    location: Location,
}

impl Checks<'_> {
    fn bad(&self, what: &'static str, got: f64, expected: &'static str) -> Result<(), PhysicsError> {
        Err(PhysicsError::BadEffect { effect: self.effect, place: self.location.to_string(), what, got, expected })
    }

    fn require(&self, good: bool, what: &'static str, got: f64, expected: &'static str) -> Result<(), PhysicsError> {
        if good { Ok(()) } else { self.bad(what, got, expected) }
    }

    fn positive(&self, what: &'static str, got: f64) -> Result<(), PhysicsError> {
        self.require(got > 0.0 && got.is_finite(), what, got, "a positive number")
    }

    fn finite(&self, what: &'static str, got: f64) -> Result<(), PhysicsError> {
        self.require(got.is_finite(), what, got, "a finite number")
    }

    fn stiff(&self, what: &'static str, got: f64) -> Result<(), PhysicsError> {
        self.require(STIFF.contains(&got), what, got, "between 100 and 1e12 (N·m/rad, N/m)")
    }

    fn soft(&self, what: &'static str, got: f64) -> Result<(), PhysicsError> {
        self.require(STIFF.contains(&(1.0 / got)), what, got, "between 1e-12 and 0.01 (rad/(N·m), m/N)")
    }

    fn small(&self, what: &'static str, got: f64) -> Result<(), PhysicsError> {
        self.require(got.abs() <= 0.1, what, got, "between -0.1 and 0.1")
    }

    fn share(&self, what: &'static str, got: f64) -> Result<(), PhysicsError> {
        self.require((0.0..=1.0).contains(&got), what, got, "between 0 and 1")
    }

    /// Of a play.
    fn width(&self, got: f64) -> Result<(), PhysicsError> {
        self.require(got > 0.0 && got <= 0.1, "width", got, "more than 0 and at most 0.1")
    }

    /// Of a frame that moves.
    fn moved(&self, translation: &Vector3<f64>, rotation: &Vector3<f64>) -> Result<(), PhysicsError> {
        translation.iter().try_for_each(|x| self.small("translation", *x))?;
        rotation.iter().try_for_each(|x| self.small("rotation", *x))
    }

    /// That the arm has joint (or link) number `index`, from 0.
    fn exists(&self, what: &'static str, index: usize) -> Result<(), PhysicsError> {
        let count = self.kinds.len();
        if index < count {
            Ok(())
        } else {
            Err(PhysicsError::NoSuchPlace { effect: self.effect, what, number: index + 1, count })
        }
    }

    /// That it has a joint that turns there.
    fn turns(&self, joint: usize) -> Result<(), PhysicsError> {
        self.exists("joint", joint)?;
        if self.kinds[joint] == JointKind::Revolute { Ok(()) } else { Err(PhysicsError::Slides { effect: self.effect, joint }) }
    }
}

impl Mechanisms {
    /// The parts that make `effects` happen in an arm whose joints are of `kinds`.
    pub(super) fn new(kinds: &[JointKind], effects: &[Effect]) -> Result<Self, PhysicsError> {
        let count = kinds.len();
        let mut parts = Mechanisms {
            clearances: vec![Clearance::NONE; count],
            held: vec![Held::default(); count],
            drives: vec![Drive::default(); count],
            coordinates: Vec::new(),
            expansion_per_k: vec![0.0; count + 1],
            foot_expansion_with_first_link_per_k: 0.0,
            base_shifts: Vec::new(),
            tool_shifts: Vec::new(),
            excess_kg: 0.0,
            reactions: Reactions { crosstalk: vec![0.0; count], base_tilt: 0.0 },
        };
        for effect in effects {
            parts.add(&Checks { kinds, effect: effect.name(), location: effect.location() }, effect)?;
        }
        for (joint, clearance) in parts.clearances.iter().enumerate() {
            clearance.check(joint)?;
        }
        parts.coordinates.sort_by_key(|coordinate| (coordinate.joint, series(coordinate)));
        Ok(parts)
    }

    fn add(&mut self, checks: &Checks<'_>, effect: &Effect) -> Result<(), PhysicsError> {
        match *effect {
            Effect::JointCompliance { joint, stiffness } => joint_compliance::add(self, checks, joint, stiffness),
            Effect::LinkBending { link, compliance, beam } => link_bending::add(self, checks, link, compliance, beam),
            Effect::Backlash { joint, width } => backlash::add(self, checks, joint, width),
            Effect::GravityLostMotion { joint, width } => gravity_lost_motion::add(self, checks, joint, width),
            Effect::JointEccentricity { joint, amplitude, order, phase } => {
                joint_eccentricity::add(self, checks, joint, amplitude, order, phase)
            }
            Effect::StrainWaveError { joint, amplitude, ratio, phase } => {
                strain_wave_error::add(self, checks, joint, WaveGenerator { amplitude, ratio, phase })
            }
            Effect::GearCoupling { joint, ratio_error, coupling, source } => {
                gear_coupling::add(self, checks, joint, ratio_error, (source, coupling))
            }
            Effect::LinkThermalGrowth { of, expansion } => link_thermal_growth::add(self, checks, of, expansion),
            Effect::JointThermalDrift { joint, drift } => joint_thermal_drift::add(self, checks, joint, drift),
            Effect::Clearance { joint, radial, axial, tilt, held } => {
                let clearance = Clearance { radial_m: radial, axial_m: axial, tilt_rad: tilt };
                bearing_clearance::add(self, checks, joint, clearance, held)
            }
            Effect::BaseDrift { moves, translation, rotation } => base_drift::add(self, checks, moves, (translation, rotation)),
            Effect::BaseStep { moves, translation, rotation, after } => {
                base_step::add(self, checks, moves, (translation, rotation), after)
            }
            Effect::BaseTilt { compliance } => base_tilt::add(self, checks, compliance),
            Effect::ToolStep { translation, rotation, after } => tool_step::add(self, checks, (translation, rotation), after),
            Effect::MeasurementScale { scale } => measurement_scale::check(checks, scale),
            Effect::MeasurementOutliers { share, factor } => measurement_outliers::check(checks, share, factor),
            Effect::WornToothSector { joint, depth, centre, half_width } => {
                worn_tooth_sector::add(self, checks, joint, WornSector { depth, centre, half_width })
            }
            Effect::CreepAfterMotion { joint, compliance, time_constant } => {
                creep_after_motion::add(self, checks, joint, compliance, time_constant)
            }
            Effect::MomentCrosstalk { joint, gain } => moment_crosstalk::add(self, checks, joint, gain),
            Effect::MemoryHysteresis { joint, amplitude, travel } => {
                memory_hysteresis::add(self, checks, joint, Memory { amplitude, travel })
            }
            Effect::WrongPayload { excess, stiffness } => wrong_payload::add(self, checks, excess, stiffness),
            Effect::HardeningStiffness { joint, stiffness, cubic } => {
                hardening_stiffness::add(self, checks, joint, stiffness, cubic)
            }
        }
    }

    /// A coordinate more; of the same law in the same place only one, which yields as much as both.
    fn yields(&mut self, joint: usize, direction: Direction, law: Law) {
        let same = self.coordinates.iter_mut().filter(|other| other.joint == joint && other.direction == direction);
        for other in same {
            match (&mut other.law, law) {
                (Law::Spring { stiffness: sum }, Law::Spring { stiffness }) => {
                    *sum = 1.0 / (1.0 / *sum + 1.0 / stiffness);
                    return;
                }
                (Law::LostMotion { half_width: sum }, Law::LostMotion { half_width })
                | (Law::Backlash { half_width: sum }, Law::Backlash { half_width }) => {
                    *sum += half_width;
                    return;
                }
                _ => {}
            }
        }
        self.coordinates.push(Coordinate { joint, direction, law });
    }
}

/// Place in the series from the motor to the link: friction acts on the gear's shaft, what is elastic lies outboard of it.
fn series(coordinate: &Coordinate) -> usize {
    match (coordinate.law, coordinate.direction) {
        (Law::Backlash { .. }, _) => 0,
        (Law::LostMotion { .. }, _) => 1,
        (_, Direction::Joint) => 2,
        (_, Direction::AcrossX) => 3,
        (_, Direction::AcrossY) => 4,
        (_, Direction::AcrossBeamX { point }) => 5 + 2 * point,
        (_, Direction::AcrossBeamY { point }) => 6 + 2 * point,
    }
}
