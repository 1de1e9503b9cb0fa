//! The parts of the true arm that make effects happen. Which of them an effect needs stands with the effect
//! ([`crate::simulation::effect`]).

use nalgebra::{Translation3, Vector3};

use super::clearance::Clearance;
use super::coordinate::{Axis, Bend, Coordinate, Direction, Law};
use super::drive_train::Drive;
use super::error::PhysicsError;
use super::true_arm::{Placement, TrueArm};
use super::world::World;
use crate::arm::JointKind;
use crate::arm::frames::{Pose, rotation_from_vector};
use crate::effects::Location;
use crate::simulation::effect::{Effect, base_tilt, direction_of_move, moment_crosstalk};

/// The parts.
#[derive(Clone, Debug)]
pub(in crate::simulation) struct Mechanisms {
    /// Play of each joint.
    pub(in crate::simulation) clearances: Vec<Clearance>,
    /// What friction holds of the play of each joint, where an effect says so.
    pub(in crate::simulation) held: Vec<Held>,
    /// Drive train of each joint.
    pub(in crate::simulation) drives: Vec<Drive>,
    /// Coordinates that yield, from the base outwards and in the order of their series.
    pub(in crate::simulation) coordinates: Vec<Coordinate>,
    /// Expansion of each link, base link first, 1/K.
    pub(in crate::simulation) expansion_per_k: Vec<f64>,
    /// Expansion of the base link with the temperature of the first link that moves, 1/K.
    pub(in crate::simulation) foot_expansion_with_first_link_per_k: f64,
    /// What moves the base.
    pub(in crate::simulation) base_shifts: Vec<Shift>,
    /// What moves the tool on the last link.
    pub(in crate::simulation) tool_shifts: Vec<Shift>,
    /// Mass that the tool carries beyond what is believed, kg.
    pub(in crate::simulation) excess_kg: f64,
    /// What answers to the load.
    pub(in crate::simulation) reactions: Reactions,
}

/// What answers to the load by moving the arm, until both agree: it is looked at anew after every step.
#[derive(Clone, Debug, Default)]
pub(in crate::simulation) struct Reactions {
    /// Turn of each joint per moment about the x axis of its frame, rad/(N·m).
    pub(in crate::simulation) crosstalk: Vec<f64>,
    /// Angle per torque by which each joint is wound up against its last move, from side to side, rad/(N·m).
    pub(in crate::simulation) windup: Vec<f64>,
    /// Lean of the base per moment about its origin, rad/(N·m).
    pub(in crate::simulation) base_tilt: f64,
}

impl Reactions {
    /// Whether nothing answers.
    pub(in crate::simulation) fn is_none(&self) -> bool {
        self.base_tilt == 0.0 && self.crosstalk.iter().chain(&self.windup).all(|gain| *gain == 0.0)
    }

    /// Moves what is to be placed: `unloaded` as it would be without a load, under the load of the arm as `world` has last placed it.
    pub(in crate::simulation) fn answer(&self, arm: &TrueArm, world: &World, unloaded: &Placement, placement: &mut Placement) {
        placement.joints.clone_from(&unloaded.joints);
        moment_crosstalk::answer(&self.crosstalk, arm, world, placement);
        direction_of_move::answer(&self.windup, arm, world, placement);
        base_tilt::answer(self.base_tilt, arm, world, unloaded, placement);
    }
}

/// Shares of the load up to which friction holds a play in its middle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::simulation) struct Held {
    /// Of the force that the joint carries, for the radial and the axial play.
    pub(in crate::simulation) force: Option<f64>,
    /// Of that force times the length of the arm outboard, for the tilting play.
    pub(in crate::simulation) moment: Option<f64>,
}

/// A frame that moves in the course of the session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::simulation) struct Shift {
    pub(in crate::simulation) translation: Vector3<f64>,
    /// Rotation vector.
    pub(in crate::simulation) rotation: Vector3<f64>,
    pub(in crate::simulation) when: When,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::simulation) enum When {
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
pub(in crate::simulation) fn shifted(shifts: &[Shift], share: f64) -> Option<Pose> {
    shifts.iter().map(|shift| shift.at(share)).reduce(|before, shift| before * shift)
}

/// Stiffnesses that joints and links may have: softer ones would not yield by a small motion, stiffer ones not at all.
const STIFF: std::ops::RangeInclusive<f64> = 100.0..=1e12;

/// Checks of an effect's numbers, which say whose they are.
pub(in crate::simulation) struct Checks<'a> {
    /// How each joint moves.
    pub(in crate::simulation) kinds: &'a [JointKind],
    effect: &'static str,
    location: Location,
}

impl Checks<'_> {
    pub(in crate::simulation) fn bad(&self, what: &'static str, got: f64, expected: &'static str) -> Result<(), PhysicsError> {
        Err(PhysicsError::BadEffect { effect: self.effect, place: self.location.to_string(), what, got, expected })
    }

    pub(in crate::simulation) fn require(
        &self,
        good: bool,
        what: &'static str,
        got: f64,
        expected: &'static str,
    ) -> Result<(), PhysicsError> {
        if good { Ok(()) } else { self.bad(what, got, expected) }
    }

    pub(in crate::simulation) fn positive(&self, what: &'static str, got: f64) -> Result<(), PhysicsError> {
        self.require(got > 0.0 && got.is_finite(), what, got, "a positive number")
    }

    pub(in crate::simulation) fn finite(&self, what: &'static str, got: f64) -> Result<(), PhysicsError> {
        self.require(got.is_finite(), what, got, "a finite number")
    }

    pub(in crate::simulation) fn stiff(&self, what: &'static str, got: f64) -> Result<(), PhysicsError> {
        self.require(STIFF.contains(&got), what, got, "between 100 and 1e12 (N·m/rad, N/m)")
    }

    pub(in crate::simulation) fn soft(&self, what: &'static str, got: f64) -> Result<(), PhysicsError> {
        self.require(STIFF.contains(&(1.0 / got)), what, got, "between 1e-12 and 0.01 (rad/(N·m), m/N)")
    }

    pub(in crate::simulation) fn small(&self, what: &'static str, got: f64) -> Result<(), PhysicsError> {
        self.require(got.abs() <= 0.1, what, got, "between -0.1 and 0.1")
    }

    pub(in crate::simulation) fn share(&self, what: &'static str, got: f64) -> Result<(), PhysicsError> {
        self.require((0.0..=1.0).contains(&got), what, got, "between 0 and 1")
    }

    /// Of a play.
    pub(in crate::simulation) fn width(&self, got: f64) -> Result<(), PhysicsError> {
        self.require(got > 0.0 && got <= 0.1, "width", got, "more than 0 and at most 0.1")
    }

    /// Of a frame that moves.
    pub(in crate::simulation) fn moved(&self, translation: &Vector3<f64>, rotation: &Vector3<f64>) -> Result<(), PhysicsError> {
        translation.iter().try_for_each(|x| self.small("translation", *x))?;
        rotation.iter().try_for_each(|x| self.small("rotation", *x))
    }

    /// That the arm has joint (or link) number `index`, from 0.
    pub(in crate::simulation) fn exists(&self, what: &'static str, index: usize) -> Result<(), PhysicsError> {
        let count = self.kinds.len();
        if index < count {
            Ok(())
        } else {
            Err(PhysicsError::NoSuchPlace { effect: self.effect, what, number: index + 1, count })
        }
    }

    /// That it has a joint that turns there.
    pub(in crate::simulation) fn turns(&self, joint: usize) -> Result<(), PhysicsError> {
        self.exists("joint", joint)?;
        if self.kinds[joint] == JointKind::Revolute { Ok(()) } else { Err(PhysicsError::Slides { effect: self.effect, joint }) }
    }
}

impl Mechanisms {
    /// The parts that make `effects` happen in an arm whose joints are of `kinds`.
    pub(in crate::simulation) fn new(kinds: &[JointKind], effects: &[Effect]) -> Result<Self, PhysicsError> {
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
            reactions: Reactions { crosstalk: vec![0.0; count], windup: vec![0.0; count], base_tilt: 0.0 },
        };
        for effect in effects {
            effect.add(&mut parts, &Checks { kinds, effect: effect.name(), location: effect.location() })?;
        }
        for (joint, clearance) in parts.clearances.iter().enumerate() {
            clearance.check(joint)?;
        }
        parts.coordinates.sort_by_key(|coordinate| (coordinate.joint, series(coordinate)));
        Ok(parts)
    }

    /// A coordinate more; of the same law in the same place only one, which yields as much as both.
    pub(in crate::simulation) fn yields(&mut self, joint: usize, direction: Direction, law: Law) {
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
        (_, Direction::Across { bend, axis }) => {
            let place = match bend {
                Bend::Joint => 0,
                Bend::Beam { point } => 1 + point,
            };
            3 + Axis::ALL.len() * place + axis as usize
        }
    }
}
