//! What each effect is made of: a list of effects sorted into the parts of the true arm that make them happen.
//!
//! Effects of the same kind at one place add up. What a sensor does to its reading is none of the arm's: `cell::sensor` does that.

use nalgebra::{Translation3, Vector3};

use super::clearance::Clearance;
use super::coordinate::{Coordinate, Direction, Law};
use super::drive_train::{Drive, Encoder, Memory, WaveGenerator, WornSector};
use super::error::PhysicsError;
use crate::arm::JointKind;
use crate::arm::frames::{Pose, rotation_from_vector};
use crate::effects::{Level, Location};
use crate::simulation::effect::{Effect, Moves};

/// The parts.
#[derive(Clone, Debug)]
pub(super) struct Mechanisms {
    /// Play of each joint.
    pub(super) clearances: Vec<Clearance>,
    /// Drive train of each joint.
    pub(super) drives: Vec<Drive>,
    /// Coordinates that yield, from the base outwards and in the order of their series.
    pub(super) coordinates: Vec<Coordinate>,
    /// Expansion of each link, base link first, 1/K.
    pub(super) expansion_per_k: Vec<f64>,
    /// What moves the base.
    pub(super) base_shifts: Vec<Shift>,
    /// What moves the tool on the last link.
    pub(super) tool_shifts: Vec<Shift>,
    /// Mass that the tool carries beyond what is believed, kg.
    pub(super) excess_kg: f64,
}

/// A frame that moves in the course of the session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shift {
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
    pub(super) fn at(&self, share: f64) -> Pose {
        let done = match self.when {
            When::Steadily => share,
            When::At(after) => f64::from(u8::from(share >= after)),
        };
        Pose::from_parts(Translation3::from(self.translation * done), rotation_from_vector(&(self.rotation * done)))
    }
}

/// All of `shifts`, one after the other; `None` where there are none.
pub(super) fn shifted(shifts: &[Shift], share: f64) -> Option<Pose> {
    shifts.iter().map(|shift| shift.at(share)).reduce(|before, shift| before * shift)
}

/// Stiffnesses that joints and links may have: softer ones would not yield by a small motion, stiffer ones not at all.
const STIFF: std::ops::RangeInclusive<f64> = 100.0..=1e12;

const POSITIVE: &str = "a positive number";
const SMALL: &str = "between -0.1 and 0.1";

impl Mechanisms {
    /// The parts that make `effects` happen in an arm whose joints are of `kinds`.
    pub(super) fn new(kinds: &[JointKind], effects: &[Effect]) -> Result<Self, PhysicsError> {
        let count = kinds.len();
        let mut parts = Mechanisms {
            clearances: vec![Clearance::NONE; count],
            drives: vec![Drive::default(); count],
            coordinates: Vec::new(),
            expansion_per_k: vec![0.0; count + 1],
            base_shifts: Vec::new(),
            tool_shifts: Vec::new(),
            excess_kg: 0.0,
        };
        for effect in effects {
            parts.add(kinds, effect)?;
        }
        for (joint, clearance) in parts.clearances.iter().enumerate() {
            clearance.check(joint)?;
        }
        parts.coordinates.sort_by_key(|coordinate| (coordinate.joint, series(coordinate)));
        Ok(parts)
    }

    fn add(&mut self, kinds: &[JointKind], effect: &Effect) -> Result<(), PhysicsError> {
        let name = effect.name();
        let bad = |what: &'static str, got: f64, expected: &'static str| {
            Err(PhysicsError::BadEffect { effect: name, place: words(&effect.location()), what, got, expected })
        };
        let positive = |what, got: f64| if got > 0.0 && got.is_finite() { Ok(()) } else { bad(what, got, POSITIVE) };
        let stiff =
            |what, got: f64| if STIFF.contains(&got) { Ok(()) } else { bad(what, got, "between 100 and 1e12 (N·m/rad, N/m)") };
        let soft = |what, got: f64| {
            if STIFF.contains(&(1.0 / got)) { Ok(()) } else { bad(what, got, "between 1e-12 and 0.01 (rad/(N·m), m/N)") }
        };
        let finite = |what, got: f64| if got.is_finite() { Ok(()) } else { bad(what, got, "a finite number") };
        let small = |what, got: f64| if got.abs() <= 0.1 { Ok(()) } else { bad(what, got, SMALL) };
        let share = |what, got: f64| if (0.0..=1.0).contains(&got) { Ok(()) } else { bad(what, got, "between 0 and 1") };
        let exists = |what: &'static str, index: usize| {
            let count = kinds.len();
            if index < count { Ok(()) } else { Err(PhysicsError::NoSuchPlace { effect: name, what, number: index + 1, count }) }
        };
        let turns = |joint: usize| {
            exists("joint", joint)?;
            if kinds[joint] == JointKind::Revolute { Ok(()) } else { Err(PhysicsError::Slides { effect: name, joint }) }
        };
        let moved = |translation: &Vector3<f64>, rotation: &Vector3<f64>| {
            translation.iter().try_for_each(|x| small("translation", *x))?;
            rotation.iter().try_for_each(|x| small("rotation", *x))
        };
        match *effect {
            Effect::JointCompliance { joint, stiffness } => {
                exists("joint", joint)?;
                stiff("stiffness", stiffness)?;
                self.yields(joint, Direction::Joint, Law::Spring { stiffness });
            }
            Effect::LinkBending { link, compliance } => {
                exists("link", link)?;
                soft("compliance", compliance)?;
                for direction in [Direction::AcrossX, Direction::AcrossY] {
                    self.yields(link, direction, Law::Spring { stiffness: 1.0 / compliance });
                }
            }
            Effect::Backlash { joint, width } | Effect::GravityLostMotion { joint, width } => {
                exists("joint", joint)?;
                if !(width > 0.0 && width <= 0.1) {
                    return bad("width", width, "more than 0 and at most 0.1");
                }
                let half_width = width / 2.0;
                let law = if matches!(effect, Effect::Backlash { .. }) {
                    Law::Backlash { half_width }
                } else {
                    Law::LostMotion { half_width }
                };
                self.yields(joint, Direction::Joint, law);
            }
            Effect::JointEccentricity { joint, amplitude, order, phase } => {
                turns(joint)?;
                small("amplitude", amplitude)?;
                finite("phase", phase)?;
                if !(1..=2).contains(&order) {
                    return bad("order", f64::from(order), "1 or 2");
                }
                self.drives[joint].encoders.push(Encoder::new(amplitude, order, phase));
            }
            Effect::StrainWaveError { joint, amplitude, ratio, phase } => {
                turns(joint)?;
                small("amplitude", amplitude)?;
                positive("ratio", ratio)?;
                finite("phase", phase)?;
                self.drives[joint].wave_generators.push(WaveGenerator { amplitude, ratio, phase });
            }
            Effect::GearCoupling { joint, ratio_error, coupling, source } => {
                exists("joint", joint)?;
                exists("source", source)?;
                small("ratio error", ratio_error)?;
                small("coupling", coupling)?;
                self.drives[joint].ratio_error += ratio_error;
                self.drives[joint].leaks.push((source, coupling));
            }
            Effect::LinkThermalGrowth { link, expansion } => {
                if expansion.abs() > 1e-3 || !expansion.is_finite() {
                    return bad("expansion", expansion, "between -0.001 and 0.001 (1/K)");
                }
                match link {
                    Some(link) => {
                        exists("link", link)?;
                        self.expansion_per_k[link + 1] += expansion;
                    }
                    None => self.expansion_per_k.iter_mut().for_each(|of_link| *of_link += expansion),
                }
            }
            Effect::JointThermalDrift { joint, drift } => {
                exists("joint", joint)?;
                small("drift", drift)?;
                self.drives[joint].zero_drift += drift;
            }
            Effect::Clearance { joint, radial, axial, tilt } => {
                exists("joint", joint)?;
                let one = Clearance { radial_m: radial, axial_m: axial, tilt_rad: tilt };
                one.check(joint)?;
                let sum = &mut self.clearances[joint];
                sum.radial_m += radial;
                sum.axial_m += axial;
                sum.tilt_rad += tilt;
            }
            Effect::BaseDrift { moves, translation, rotation } => {
                moved(&translation, &rotation)?;
                if moves == Moves::Base {
                    self.base_shifts.push(Shift { translation, rotation, when: When::Steadily });
                }
            }
            Effect::BaseStep { moves, translation, rotation, after } => {
                moved(&translation, &rotation)?;
                share("share of the session", after)?;
                if moves == Moves::Base {
                    self.base_shifts.push(Shift { translation, rotation, when: When::At(after) });
                }
            }
            Effect::ToolStep { translation, rotation, after } => {
                moved(&translation, &rotation)?;
                share("share of the session", after)?;
                self.tool_shifts.push(Shift { translation, rotation, when: When::At(after) });
            }
            Effect::MeasurementScale { scale } => small("scale", scale)?,
            Effect::MeasurementOutliers { share: of_readings, factor } => {
                share("share", of_readings)?;
                positive("factor", factor)?;
            }
            Effect::WornToothSector { joint, depth, centre, half_width } => {
                turns(joint)?;
                small("depth", depth)?;
                finite("centre", centre)?;
                if !(half_width > 0.0 && half_width <= std::f64::consts::PI) {
                    return bad("half width", half_width, "more than 0 and at most π");
                }
                self.drives[joint].worn.push(WornSector { depth, centre, half_width });
            }
            Effect::CreepAfterMotion { joint, compliance, time_constant } => {
                exists("joint", joint)?;
                soft("compliance", compliance)?;
                positive("time constant", time_constant)?;
                self.yields(joint, Direction::Joint, Law::Creep { compliance, time_constant });
            }
            Effect::MomentCrosstalk { joint, gain } => {
                turns(joint)?;
                small("gain", gain)?;
                self.drives[joint].crosstalk += gain;
            }
            Effect::MemoryHysteresis { joint, amplitude, travel } => {
                exists("joint", joint)?;
                small("amplitude", amplitude)?;
                positive("travel", travel)?;
                self.drives[joint].memories.push(Memory { amplitude, travel });
            }
            Effect::WrongPayload { excess, stiffness } => {
                if !(-1000.0..=1000.0).contains(&excess) {
                    return bad("excess", excess, "between -1000 and 1000 (kg)");
                }
                stiff("stiffness", stiffness)?;
                self.excess_kg += excess;
                for joint in 0..kinds.len() {
                    self.yields(joint, Direction::Joint, Law::Compensated { stiffness });
                }
            }
            Effect::HardeningStiffness { joint, stiffness, cubic } => {
                exists("joint", joint)?;
                stiff("stiffness", stiffness)?;
                if !(0.0..=1e15).contains(&cubic) {
                    return bad("cubic", cubic, "between 0 and 1e15 (N·m/rad³)");
                }
                self.yields(joint, Direction::Joint, Law::Hardening { stiffness, cubic });
            }
        }
        Ok(())
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

/// A place in words, such as `joint 3`.
fn words(location: &Location) -> String {
    let level = match location.level {
        Level::Joint => "joint",
        Level::Link => "link",
        Level::Base => "the base",
        Level::Tool => "the tool",
        Level::Sensor => "the sensor",
    };
    match location.index {
        Some(number) => format!("{level} {number}"),
        None if location.level == Level::Link => "all links".to_owned(),
        None => level.to_owned(),
    }
}

/// Place in the series from the motor to the link: friction acts on the gear's shaft, what is elastic lies outboard of it.
fn series(coordinate: &Coordinate) -> u8 {
    match (coordinate.law, coordinate.direction) {
        (Law::Backlash { .. }, _) => 0,
        (Law::LostMotion { .. }, _) => 1,
        (_, Direction::Joint) => 2,
        (_, Direction::AcrossX) => 3,
        (_, Direction::AcrossY) => 4,
    }
}
