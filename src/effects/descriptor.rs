//! What the table of kinds says of each kind ([`Kind::descriptor`]).

use super::kind::Kind;
use super::location::Level;
use super::signature::library::{Hypothesis, Site};
use crate::arm::Arm;

/// Everything that is the same for all effects of a kind, wherever they are. Conventions: true pose = pose at the joint readings +
/// effect; magnitudes are positive where the kind has no sign.
#[derive(Clone, Copy, Debug)]
pub struct Descriptor {
    /// Name in scenes, options, tables and results.
    pub name: &'static str,
    /// What happens, in a few words.
    pub about: &'static str,
    /// What it belongs to.
    pub level: Level,
    /// Unit of its magnitude.
    pub unit: Unit,
    /// What the magnitude is: a width, a radius, an amplitude.
    pub magnitude: &'static str,
    /// Realistic magnitudes of an arm of about 1 m reach, SI. Case draws and the priors of a diagnosis use these.
    pub range: Range,
    /// Where the range comes from.
    pub source: Source,
    /// How many times the upper end of the range it reaches on hobby and cable-driven arms.
    pub softest: f64,
    /// How many times the upper end of the range a magnitude is on the worst of arms: no prior is wider.
    pub most: f64,
    /// Whether physics allows one sign only, in which case the diagnosis allows no other. Kinds of several coefficients have no sign.
    pub one_signed: bool,
    /// Whether results tell its sign beside its magnitude, which is positive then (as a width is).
    pub sign_apart: bool,
    /// What gravity has to do with it.
    pub load: Load,
    /// What the data must have for it to be seen, or to have its unit.
    pub needs: &'static [Need],
    /// Of a kind without a name in a diagnosis, the one that it is a case of: that name is right, and so is none.
    pub case_of: Option<Kind>,
    /// What the diagnosis knows of it, if it has a name for it. Others are injected to see whether it says that something else is there.
    pub known: Option<Known>,
    /// Whether two of it may sit at one place: ripples of two gear stages, motion that leaks from two joints.
    pub may_repeat: bool,
    /// What it is mistaken for, and what measurement tells them apart.
    pub neighbours: &'static [Neighbour],
    /// How a scene writes it.
    pub scene: SceneKeys,
}

/// What the diagnosis knows of a kind.
#[derive(Clone, Copy, Debug)]
pub struct Known {
    /// Adds what may be there of it at a place: nothing where it cannot sit there, or where the data lack what it takes to see it.
    pub hypotheses: fn(&Site<'_>, &mut Vec<Hypothesis>),
    /// How much of a displacement its signature may miss.
    pub misses: Misses,
    /// Whether on this arm another kind does the same, if there are such arms: a case of one would be a case of the other.
    pub doubles: Option<fn(&Arm) -> bool>,
    /// What to measure next where it is in a set that explains the readings.
    pub advice: &'static [Advice],
}

/// What of the displacement that physics makes is not in a signature, at most, as shares. Tests compare them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misses {
    /// Where magnitude and base are fitted.
    pub fitted: f64,
    /// Where the magnitude is that of the physics.
    pub as_said: f64,
}

/// A unit of magnitudes, SI.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// m
    Metre,
    /// rad
    Radian,
    /// rad/(N·m)
    RadianPerNewtonMetre,
    /// rad/rad
    RadianPerRadian,
    /// 1/K
    PerKelvin,
    /// rad/K
    RadianPerKelvin,
    /// kg
    Kilogram,
    /// A small ratio.
    Ratio,
    /// A share of all readings.
    Share,
}

impl Unit {
    /// As results write it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Unit::Metre => "m",
            Unit::Radian => "rad",
            Unit::RadianPerNewtonMetre => "rad/(N·m)",
            Unit::RadianPerRadian => "rad/rad",
            Unit::PerKelvin => "1/K",
            Unit::RadianPerKelvin => "rad/K",
            Unit::Kilogram => "kg",
            Unit::Ratio | Unit::Share => "1",
        }
    }
}

/// Realistic magnitudes, smallest and largest, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Range {
    /// The same everywhere.
    Everywhere([f64; 2]),
    /// The proximal half of the joints carries the arm; the wrist's gears are smaller.
    ByHalf {
        /// Joints of the proximal half.
        proximal: [f64; 2],
        /// Joints of the distal half.
        distal: [f64; 2],
    },
}

impl Range {
    /// At a joint or link (from 0; `None` for what has no number) of an arm of `joints` joints.
    #[must_use]
    pub fn at(self, place: Option<usize>, joints: usize) -> [f64; 2] {
        match self {
            Range::Everywhere(range) => range,
            Range::ByHalf { proximal, distal } => {
                if place.is_none_or(|place| 2 * place < joints) {
                    proximal
                } else {
                    distal
                }
            }
        }
    }
}

/// Where a range comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// A document that a reader can follow, and what it says.
    Cited(&'static str),
    /// Nothing but judgement.
    Assumed,
}

impl Source {
    /// In words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Source::Cited(document) => document,
            Source::Assumed => "assumed",
        }
    }
}

/// What gravity has to do with an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Load {
    /// Nothing.
    None,
    /// It grows with the load.
    Drives,
    /// The load decides to which side a play is seated, not how far.
    Seats,
}

/// What data must have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// From which side each joint was approached, and both sides.
    ApproachSides,
    /// Moves that lead straight from reading to reading, in an order that is known.
    Moves,
    /// Temperatures that change.
    Temperatures,
    /// The time of each reading.
    Times,
    /// Masses of the links; without them magnitudes have no physical unit.
    Masses,
    /// Orientations, for the rotation that comes with the translation.
    Orientations,
}

impl Need {
    /// In words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Need::ApproachSides => "sides of approach",
            Need::Moves => "moves straight from reading to reading",
            Need::Temperatures => "temperatures",
            Need::Times => "times",
            Need::Masses => "masses of the links",
            Need::Orientations => "orientations (for its rotation)",
        }
    }
}

/// A kind that another is mistaken for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Neighbour {
    /// The other kind.
    pub kind: Kind,
    /// What measurement tells them apart.
    pub told_apart_by: &'static str,
}

/// What to measure next where a set that explains the readings has a kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Advice {
    /// Whatever else there is.
    Alone(Measure),
    /// Where this kind is in the set, too.
    Beside(Kind, Measure),
}

/// A measurement that tells effects apart; advice is given in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Measure {
    /// A load from the side.
    Sideways,
    /// Several payloads.
    Payloads,
    /// Temperatures that return while time goes on.
    HeatAndCool,
    /// All angles of a joint.
    WholeTravel,
    /// The tool turned.
    OtherOrientations,
}

impl Measure {
    /// In words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Measure::Sideways => {
                "compliance or bending: load the arm sideways, tilt the base, or put a target on a link in between"
            }
            Measure::Payloads => {
                "linear and saturating effects of load look alike under one payload: the same configurations with two or three payloads"
            }
            Measure::HeatAndCool => {
                "temperature or time: heat and cool in one session, so that temperatures return while time goes on"
            }
            Measure::WholeTravel => "harmonics of a joint: move it through its whole travel, other joints at rest",
            Measure::OtherOrientations => {
                "base or tool: read the same few configurations again with another orientation of the tool"
            }
        }
    }
}

/// Keys of a table `[[injected.effect]]` besides `kind`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SceneKeys {
    /// How it says where it sits.
    pub place: ScenePlace,
    /// Keys that it needs.
    pub required: &'static [&'static str],
    /// Keys that it may have.
    pub optional: &'static [&'static str],
}

/// How a scene says where an effect sits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScenePlace {
    /// `joint = "…"`, one that turns.
    TurningJoint,
    /// `joint = "…"`.
    Joint,
    /// `link = "…"`.
    Link,
    /// `link = "…"`, or none: the whole arm.
    LinkOrArm,
    /// Nothing that has a name.
    Nowhere,
}

impl SceneKeys {
    /// The key that says where it sits, if there is one.
    #[must_use]
    pub fn place_key(&self) -> Option<&'static str> {
        match self.place {
            ScenePlace::TurningJoint | ScenePlace::Joint => Some("joint"),
            ScenePlace::Link | ScenePlace::LinkOrArm => Some("link"),
            ScenePlace::Nowhere => None,
        }
    }

    /// All of them in a line; in brackets those that may be left out.
    #[must_use]
    pub fn in_a_line(&self) -> String {
        let bracketed = |key: &str| format!("[{key}]");
        let may_be_left_out = self.place == ScenePlace::LinkOrArm;
        let place = self.place_key().map(|key| if may_be_left_out { bracketed(key) } else { key.to_owned() });
        let required = self.required.iter().map(|key| (*key).to_owned());
        place.into_iter().chain(required).chain(self.optional.iter().map(|key| bracketed(key))).collect::<Vec<_>>().join(", ")
    }
}
