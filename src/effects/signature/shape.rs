//! What an effect of unit magnitude does to the target: true pose = pose at the joint readings + effect, to first order. What a shape
//! answers of itself (`Follows`, `Named`) is in its own file; here is what the files share.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::library::Columns;
use super::posture::Posture;
pub use super::unnamed::angle_map::MAP_ORDERS;
pub use super::unnamed::memory::MEMORIES;
pub use super::unnamed::torque_memory::FORGETTING_S;
use crate::effects::kind::Answers;
pub use crate::effects::kind::Shape;
use crate::effects::{Kind, Parameters, Values};

/// What every shape answers.
pub(in crate::effects) trait Follows {
    /// What it is made of. `orientation`: whether orientations are measured.
    fn form(&self, orientation: bool) -> Form;

    /// Its columns at `reading`, which has what it follows.
    fn columns(&self, reading: &Reading, orientation: bool) -> Vec<Displacement>;

    /// The joint (from 0) whose angle alone decides how much it is off, if there is one.
    fn of_angle(&self) -> Option<usize> {
        None
    }
}

/// What those answer besides that a kind has: which have a name, or may have.
pub(in crate::effects) trait Named: Follows {
    /// Whether nobody knows to which side this is seated at `reading`: the load is next to nothing, and friction or a base that is not
    /// level may decide. False where nothing is seated.
    fn undecided(&self, reading: &Reading) -> bool;

    /// Others that lie between this one and its neighbours in the library, with what is said of them in words.
    fn closer(&self, _: &Columns) -> Vec<(Shape, String)> {
        Vec::new()
    }

    /// What a diagnosis says of it besides kind, place and magnitude.
    fn parameters(&self, of: Coefficients<'_>) -> Parameters;

    /// What a scene would say to make the same happen, several times where it takes more than one effect; in words, why nothing can. A
    /// step's moment is left to the caller, who knows the times of the readings.
    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String>;
}

/// What a shape is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::effects) struct Form {
    /// Number of columns.
    pub(in crate::effects) columns: usize,
    /// How many of them, from the first, tell the magnitude.
    pub(in crate::effects) of_magnitude: usize,
    /// What of these it is.
    pub(in crate::effects) size: Size,
    /// What a reading must have besides its pose.
    pub(in crate::effects) needs: Recorded,
    /// What it is where it has no name. `None` for shapes that always have one.
    pub(in crate::effects) unnamed: Option<Unnamed>,
}

/// How coefficients tell a magnitude.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// Their length.
    Length,
    /// Of a free function of something, its root mean square over the readings.
    Rms,
}

/// What a shape without a name is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::effects) struct Unnamed {
    /// What it shares its prior with.
    pub(in crate::effects) family: Family,
    /// The kind whose signature it has in it as a special case, so that both cannot be in one model at one place.
    pub(in crate::effects) contains: Option<Kind>,
    /// Where it is one of many side by side: middle and half width, rad. Two that overlap are one.
    pub(in crate::effects) near: Option<[f64; 2]>,
}

/// What is recorded of a reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::effects) enum Recorded {
    /// The pose at the joint readings: always.
    Pose,
    /// From which side each joint was approached.
    Approach,
    /// From where each joint came.
    Moves,
    /// Temperatures.
    Temperatures,
}

/// Of each column of a shape, how much of it there is, SI.
#[derive(Clone, Copy, Debug)]
pub struct Coefficients<'a>(pub &'a [f64]);

impl Coefficients<'_> {
    /// Of column `at`.
    ///
    /// # Errors
    /// In words, if there is none.
    pub(in crate::effects) fn at(&self, at: usize) -> Result<f64, String> {
        self.0.get(at).copied().ok_or_else(|| "the diagnosis lacks a coefficient".to_owned())
    }

    /// Of column `at`; zero where there is none.
    pub(in crate::effects) fn or_zero(&self, at: usize) -> f64 {
        self.0.get(at).copied().unwrap_or(0.0)
    }

    /// Amplitude and phase (rad) of a cosine and a sine, from column `from` on: a cos + b sin = amplitude · cos(order · q + phase).
    pub(in crate::effects) fn wave(&self, from: usize) -> Result<(f64, f64), String> {
        let (a, b) = (self.at(from)?, self.at(from + 1)?);
        Ok((libm::hypot(a, b), libm::atan2(-b, a)))
    }

    /// Three of them. Where only positions of a tool are measured its rotation is not seen: zero.
    fn vector(&self, from: usize) -> [f64; 3] {
        std::array::from_fn(|axis| self.or_zero(from + axis))
    }

    /// Of a twist, what a diagnosis says.
    pub(in crate::effects) fn moved(&self) -> Parameters {
        Parameters { translation_m: Some(self.vector(0)), rotation_rad: Some(self.vector(3)), ..Parameters::default() }
    }

    /// Of a twist, what a scene says.
    pub(in crate::effects) fn twist(&self) -> Values {
        Values { translation: self.vector(0).into(), rotation: self.vector(3).into(), ..Values::default() }
    }
}

/// Joints and links are written as people count.
pub(in crate::effects) mod from_one {
    use serde::{Deserialize, Deserializer, Serializer};

    pub(in crate::effects) fn serialize<S: Serializer>(index: &usize, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_u64(*index as u64 + 1)
    }

    pub(in crate::effects) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<usize, D::Error> {
        let number = usize::deserialize(deserializer)?;
        number.checked_sub(1).ok_or_else(|| serde::de::Error::custom("joints and links count from 1"))
    }
}

/// The same where there may be none.
pub(in crate::effects) mod from_one_or_none {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(in crate::effects) fn serialize<S: Serializer>(index: &Option<usize>, serializer: S) -> Result<S::Ok, S::Error> {
        index.map(|index| index + 1).serialize(serializer)
    }

    pub(in crate::effects) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<usize>, D::Error> {
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

/// Times over which what is left of a move fades, s; zero: it is gone by the next reading.
pub const FADING_S: [f64; 13] = [0.0, 5.0, 7.0, 10.0, 14.0, 20.0, 28.0, 40.0, 56.0, 80.0, 112.0, 160.0, 225.0];

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
    /// Since the first reading of its session, to which nobody knows from where the arm came, s.
    pub since_begin_s: f64,
    /// Of each joint, its ways from reading to reading, each faded since its end over one of [`FADING_S`], rad or m; empty where moves are not
    /// known.
    pub behind: Vec<[f64; FADING_S.len()]>,
    /// Memory of each joint's moves, by [`MEMORIES`].
    pub memory: Vec<[f64; MEMORIES.len()]>,
}

/// Displacement of the target: shift (m) and turn (rad), in root.
pub type Displacement = [f64; 6];

pub(in crate::effects) fn twist(shift: Vector3<f64>, turn: Vector3<f64>) -> Displacement {
    [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z]
}

impl Reading {
    /// Torque (N·m) or, where the joint slides, the force along it (N).
    pub(in crate::effects) fn effort(&self, joint: usize) -> f64 {
        if self.slides[joint] { self.posture.forces[joint].dot(&self.posture.axes[joint]) } else { self.posture.torque(joint) }
    }

    /// The joint moves by `amount`.
    #[must_use]
    pub fn moved(&self, joint: usize, amount: f64) -> Displacement {
        self.posture.moved(joint, self.slides[joint], &self.target).map(|value| value * amount)
    }

    /// Everything from the origin of `joint` on turns by the rotation vector `turn`.
    pub(in crate::effects) fn turned(&self, joint: usize, turn: Vector3<f64>) -> Displacement {
        twist(turn.cross(&(self.target - self.posture.origins[joint])), turn)
    }

    /// \[6\] Shifts along and turns about the axes of the root, times `factor`.
    pub(in crate::effects) fn base_twist(&self, factor: f64) -> Vec<Displacement> {
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| axis * factor);
        let shifts = axes.map(|axis| twist(axis, Vector3::zeros()));
        let turns = axes.map(|axis| twist(axis.cross(&self.target), axis));
        [shifts, turns].concat()
    }

    /// \[3, 6 with orientations\] The same of the tool's axes, about its origin.
    pub(in crate::effects) fn tool_twist(&self, factor: f64, orientation: bool) -> Vec<Displacement> {
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
        self.follows().columns(reading, orientation)
    }

    /// Number of columns.
    #[must_use]
    pub fn width(&self, orientation: bool) -> usize {
        self.follows().form(orientation).columns
    }

    /// Number of columns, from the first, whose coefficients tell the magnitude.
    #[must_use]
    pub fn magnitude_width(&self) -> usize {
        self.follows().form(false).of_magnitude
    }

    /// The joint (from 0) whose angle alone decides how much it is off, if there is one.
    #[must_use]
    pub fn of_angle(&self) -> Option<usize> {
        self.follows().of_angle()
    }

    /// How they do.
    #[must_use]
    pub fn size(&self) -> Size {
        self.follows().form(false).size
    }

    /// Whether nobody knows to which side this is seated at `reading`: the load is next to nothing, and friction or a base that is not
    /// level may decide. Of a shape without a name nobody asks.
    #[must_use]
    pub fn undecided(&self, reading: &Reading) -> bool {
        self.named().is_some_and(|named| named.undecided(reading))
    }

    /// Whether `reading` has what the shape follows: the side of the approach, or temperatures.
    #[must_use]
    pub fn can_be_read(&self, reading: &Reading) -> bool {
        match self.follows().form(false).needs {
            Recorded::Pose => true,
            Recorded::Approach => !reading.approach.is_empty(),
            Recorded::Moves => !reading.behind.is_empty(),
            Recorded::Temperatures => !reading.rise_k.is_empty(),
        }
    }

    /// Where it has no name: the family that it shares its prior with, and the kind whose signature it has in it as a special case, so
    /// that both cannot be in one model at one place. `None` for shapes that always have a name.
    #[must_use]
    pub fn unnamed(&self) -> Option<(Family, Option<Kind>)> {
        self.follows().form(false).unnamed.map(|of| (of.family, of.contains))
    }

    /// Whether both, without a name at one place, are the same: two bumps that overlap.
    #[must_use]
    pub fn overlaps(&self, other: &Shape) -> bool {
        let near = |shape: &Shape| shape.follows().form(false).unnamed.and_then(|of| of.near);
        near(self).zip(near(other)).is_some_and(|([x, w], [y, v])| (x - y).abs() < w.max(v))
    }

    /// What a diagnosis says of it besides kind, place and magnitude. When a step happens is left out: the shape knows only its row.
    #[must_use]
    pub fn parameters(&self, of: Coefficients<'_>) -> Parameters {
        self.named().map_or_else(Parameters::default, |named| named.parameters(of))
    }

    /// Of a step, the place in the order of time, from 0, of the first reading after it.
    #[must_use]
    pub fn row(&self) -> Option<usize> {
        self.parameters(Coefficients(&[])).row
    }

    /// What a scene would say to make the same happen; a step's moment is left out, as in [`Shape::parameters`].
    ///
    /// # Errors
    /// In words, why nothing in a scene does that.
    pub fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        // Nothing follows from a diagnosis that does not say how much of it there is.
        of.at(0)?;
        self.named().map_or_else(|| Err("a shape without a name".to_owned()), |named| named.values(of))
    }

    /// Others that lie between this one and its neighbours in the library that is made of `columns`, with what is said of them in words.
    #[must_use]
    pub fn closer(&self, columns: &Columns) -> Vec<(Shape, String)> {
        self.named().map_or_else(Vec::new, |named| named.closer(columns))
    }

    fn follows(&self) -> &dyn Follows {
        match self.answers() {
            Answers::Named(named) => named,
            Answers::Nameless(nameless) => nameless.follows(),
        }
    }

    fn named(&self) -> Option<&dyn Named> {
        match self.answers() {
            Answers::Named(named) => Some(named),
            Answers::Nameless(_) => None,
        }
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
pub(in crate::effects) fn seated(load: Vector3<f64>, sigma: f64, friction: f64) -> Vector3<f64> {
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
pub(in crate::effects) fn little(load: f64, sigma: f64, all: f64) -> bool {
    load < f64::max(SIGMAS_UNDECIDED * sigma, SHARE_UNDECIDED * all)
}
