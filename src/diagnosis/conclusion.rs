//! What a diagnosis comes to, as kinds, places and numbers, without a word: [`crate::report`] has the words.

use super::held_out::Block;
use super::outcome::{Candidate, Effect, Gap, Map, MinimumDetectable, NoiseFloor, NoiseSource, Place, Residual, Verdict};
use super::settings::Settings;
use crate::effects::{Kind, Location, Measure};

/// All that was found; in words it is [`super::outcome::Diagnosis`].
#[derive(Clone, Debug, PartialEq)]
pub struct Conclusion {
    /// In one word.
    pub verdict: Verdict,
    /// Noise of the sensor, one sigma per axis.
    pub noise_floor: NoiseFloor,
    /// 3-D position RMS on held-out poses.
    pub gap: Gap,
    /// What is named, in the order added. The detail of readings that are far off is empty: their parameters say all.
    pub effects: Vec<Effect>,
    /// What cannot be told apart.
    pub confusion_sets: Vec<Vec<Candidate>>,
    /// What this data set would not show.
    pub undetectable: Vec<Hidden>,
    /// Smallest magnitude that this data set would show, of everything else.
    pub detectable: Vec<Visible>,
    /// Share of kinds and places that would have shown at a realistic magnitude.
    pub detectable_share: f64,
    /// What no effect explains.
    pub unknown: Remainder,
    /// Mean residual along each joint's motion.
    pub maps: Vec<Map>,
    /// What to measure next.
    pub next: Vec<Advice>,
    /// What was assumed, switched off, thinned out or left out.
    pub notes: Vec<Note>,
    /// Gravity in the root frame, m/s², where the readings have told and not the robot's file.
    pub gravity_m_s2: Option<[f64; 3]>,
    /// Number of readings used.
    pub readings: usize,
    /// Every number that decided.
    pub settings: Settings,
    /// Reading by reading, what is left.
    pub residuals: Vec<Residual>,
}

/// A kind at a place that the data would show from a realistic magnitude on.
#[derive(Clone, Debug, PartialEq)]
pub struct Visible {
    /// Kind.
    pub kind: Kind,
    /// Where.
    pub location: Place,
    /// From which magnitude on.
    pub minimum_detectable: MinimumDetectable,
}

/// A kind at a place that the data would not show at a realistic magnitude.
#[derive(Clone, Debug, PartialEq)]
pub struct Hidden {
    /// Kind.
    pub kind: Kind,
    /// Where.
    pub location: Place,
    /// From which larger magnitude on it would show, if from any.
    pub minimum_detectable: MinimumDetectable,
    /// Why.
    pub reason: Reason,
}

/// Why something would not show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reason {
    /// It looks like another effect.
    Like {
        /// The other's kind.
        kind: Kind,
        /// Where that would be.
        location: Location,
        /// Cosine between both.
        likeness: f64,
    },
    /// It is smaller than the noise and what geometry absorbs.
    TooSmall,
    /// Nobody recorded from which side joints came.
    NoApproach,
    /// The arm came to its readings over points between, or nobody knows from where.
    NoMoves,
    /// The joint always came from one side.
    OneSide,
    /// No temperatures that change were recorded.
    NoTemperatures,
    /// Its load is nothing, or always alike.
    LoadedAlike,
    /// Lengths of links can be anything.
    LengthsAbsorb,
    /// Some geometry does the same.
    GeometryAbsorbs,
}

/// What no effect explains.
#[derive(Clone, Debug, PartialEq)]
pub struct Remainder {
    /// Something is left.
    pub present: bool,
    /// Of the residual having no structure, all tests together.
    pub p_value: f64,
    /// What it is; nothing where nothing is left.
    pub remains: Vec<Remains>,
}

/// A part of what no effect explains.
#[derive(Clone, Debug, PartialEq)]
pub enum Remains {
    /// Shapes without a name at one place.
    Shape {
        /// What the first of them is, as its hypothesis says.
        detail: String,
        /// How many more stand for the same.
        besides: usize,
        /// RMS of what they do to positions together, m.
        rms_m: f64,
    },
    /// So many more such shapes, all smaller.
    Smaller {
        /// How many.
        count: usize,
    },
    /// A joint that does not repeat.
    Scatter {
        /// Its number, from 1.
        joint: usize,
        /// One sigma of its error, rad (m where it slides).
        sigma: f64,
        /// Whether it slides.
        slides: bool,
    },
    /// The residual has an order.
    Trend(Trend),
    /// More than the noise, in no order.
    Noise {
        /// What remains over the noise.
        ratio: f64,
        /// Whose noise that is.
        source: NoiseSource,
    },
}

/// The residual follows something that was recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Trend {
    /// Number of the joint along whose motion it is looked at, from 1; `None`: all of it.
    pub along: Option<usize>,
    /// What it follows.
    pub follows: Variable,
}

/// Something that was recorded of each reading. Joints count from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variable {
    /// Angle of a joint.
    Angle(usize),
    /// Torque of a joint.
    Torque(usize),
    /// Time.
    Time,
    /// Temperature.
    Temperature,
}

/// Something worth knowing. Joints and rows count from 1.
#[derive(Clone, Debug, PartialEq)]
pub enum Note {
    /// No sides of approach were recorded.
    NoApproach,
    /// The temperature of the air stands in for those of the links.
    AirForLinks,
    /// The temperature never changes.
    ConstantTemperature,
    /// No temperatures were recorded.
    NoTemperatures,
    /// No payloads were recorded.
    NoPayload,
    /// No masses are known of the arm.
    NoMasses,
    /// Nobody said which way gravity acts, and the readings do.
    Gravity {
        /// In root, m/s².
        m_s2: [f64; 3],
    },
    /// What the fit of the geometry says, in its own words.
    Geometry(String),
    /// No fit settles around what was found.
    Astray,
    /// The arm did not move between the repeats.
    UnmovedRepeats,
    /// Readings of a configuration are alike.
    Alike {
        /// Correlation of what is left of them.
        correlation: f64,
    },
    /// Folds leave out effects that were chosen for them.
    FoldsDoWithout {
        /// What the rows of a fold share.
        by: Block,
        /// How many folds do.
        count: usize,
        /// Of how many.
        folds: usize,
    },
    /// The noise is that of repeats.
    NoiseOfRepeats {
        /// Degrees of freedom of the sigma.
        degrees_of_freedom: f64,
    },
    /// Orientations are not as exact as is said.
    OrientationNoise {
        /// One sigma that they are taken to have, rad.
        taken_rad: f64,
        /// That is said of them, rad.
        said_rad: f64,
    },
    /// Held-out errors are far above those of the readings that were used.
    FewReadings {
        /// RMS of those held out, m.
        held_out_m: f64,
        /// RMS of those used, m.
        used_m: f64,
        /// Readings.
        readings: usize,
    },
    /// Joint readings are rounded so much that it shows.
    Rounded {
        /// Joints.
        joints: Vec<usize>,
        /// To what.
        step: Step,
        /// RMS error that it makes, m.
        rms_m: f64,
    },
    /// Readings that are far off.
    FarOff {
        /// Their rows.
        rows: Vec<usize>,
    },
    /// The residuals are not as large as the noise.
    UnusualNoise {
        /// Residuals over noise.
        ratio: f64,
        /// Whose noise.
        source: NoiseSource,
        /// Joints whose scatter is beside it.
        beside: Vec<usize>,
    },
}

/// A step to which joint angles are written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// So many degrees.
    Degrees(f64),
    /// So many radians.
    Radians(f64),
}

impl Step {
    /// In radians.
    #[must_use]
    pub fn rad(self) -> f64 {
        match self {
            Step::Degrees(degrees) => degrees.to_radians(),
            Step::Radians(radians) => radians,
        }
    }
}

/// Something to measure next. Joints count from 1.
#[derive(Clone, Debug, PartialEq)]
pub enum Advice {
    /// What tells two kinds apart, as the table of kinds has it.
    Measure(Measure),
    /// More readings where a shape without a name shows.
    MoreWhereItShows,
    /// Many readings of few configurations show how well a joint repeats.
    Repeat {
        /// The joint.
        joint: usize,
    },
    /// Sides of approach show backlash.
    RecordApproach,
    /// So does approach from both sides.
    BothSides {
        /// Joints that always came from one.
        joints: Vec<usize>,
    },
    /// Temperatures that change show thermal effects.
    WarmUp,
    /// So do temperatures that are recorded.
    RecordTemperatures,
    /// Repeats tell the noise.
    ReadTwice,
    /// More readings show smaller effects, and so does less noise.
    MoreReadings,
}
