//! What is looked for: every kind at every place, and shapes that have no name.

use super::posture::Mechanism;
use super::shape::Shape;
use super::unnamed;
pub use crate::effects::kind::radial_clearance::HELD;
pub use crate::effects::kind::strain_wave_error::{RIPPLES, ripple, strongest};
use crate::effects::{Kind, Level, Load, Location};

/// Something that may be there.
#[derive(Clone, Debug, PartialEq)]
pub struct Hypothesis {
    /// What it is; `None` for a shape without a name.
    pub kind: Option<Kind>,
    /// Where.
    pub location: Location,
    /// What it does.
    pub shape: Shape,
    /// Realistic magnitudes, SI, least and most.
    pub range: [f64; 2],
    /// Of each column, its standard deviation in units of the magnitude.
    pub spread: Vec<f64>,
    /// In words: harmonic order, source joint, shape without a name; empty where the kind says all.
    pub detail: String,
    /// Of the prior of its kind at its place, the share that is its own; `None`: one over the number of all of its kind there. A
    /// ripple found by a scan has that of one of all that were scanned.
    pub share: Option<f64>,
}

/// What the data have.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns {
    /// Directions of the last moves.
    pub approach: bool,
    /// Whether they lead straight from reading to reading.
    pub moves: bool,
    /// Temperatures.
    pub temperature: bool,
    /// Orientations.
    pub orientation: bool,
    /// Rows are in the order of time.
    pub time: bool,
    /// Rows in time.
    pub rows: usize,
    /// Configurations that differ.
    pub configurations: usize,
    /// Smallest and largest coordinate of each joint.
    pub travel: Vec<[f64; 2]>,
    /// Joints whose torque is not known to differ from zero in any reading.
    pub upright: Vec<bool>,
    /// Candidates for a change point, as places in time.
    pub changes: Vec<usize>,
}

impl Columns {
    /// Places in time strictly between `row` and the candidates for a change on either side of it.
    pub(in crate::effects) fn rows_about(&self, row: usize) -> Vec<usize> {
        let before = self.changes.iter().rev().find(|known| **known < row);
        let after = self.changes.iter().find(|known| **known > row);
        match (before, after) {
            (Some(before), Some(after)) => (before + 1..*after).filter(|near| *near != row).collect(),
            (None, Some(after)) => (row + 1..*after).collect(),
            (Some(before), None) => (before + 1..row).collect(),
            (None, None) => Vec::new(),
        }
    }
}

/// A place of an arm at which effects may sit, and what the data have.
pub struct Site<'a> {
    /// Joint, or the link that it moves, from 0; `None` for the whole arm and for what has no number.
    pub(in crate::effects) place: Option<usize>,
    /// The arm.
    pub(in crate::effects) mechanism: &'a Mechanism,
    /// What the data have.
    pub(in crate::effects) columns: &'a Columns,
}

/// Without masses each link is taken to weigh 1 kg, a tenth of what it does: what load drives looks as many times larger.
const WITHOUT_MASSES: f64 = 10.0;

impl Site<'_> {
    /// Number of joints of the arm.
    pub(in crate::effects) fn joints(&self) -> usize {
        self.mechanism.joint_count()
    }

    /// Whether it is a joint that turns.
    pub(in crate::effects) fn turns(&self) -> bool {
        self.place.is_some_and(|joint| !self.mechanism.slides[joint])
    }

    /// Realistic magnitudes of `kind` here.
    pub(in crate::effects) fn range(&self, kind: Kind) -> [f64; 2] {
        kind.range(self.place, self.joints())
    }

    /// That an effect of `kind` is here: one column, as likely as all others of its kind at this place.
    pub(in crate::effects) fn hypothesis(&self, kind: Kind, shape: Shape) -> Hypothesis {
        let location = Location { level: kind.level(), index: self.place.map(|place| place + 1) };
        let unknown_load = kind.descriptor().load == Load::Drives && !self.mechanism.masses_known;
        let range = self.range(kind).map(|magnitude| if unknown_load { WITHOUT_MASSES * magnitude } else { magnitude });
        Hypothesis { kind: Some(kind), location, shape, range, spread: vec![1.0], detail: String::new(), share: None }
    }

    /// That a shape without a name is at this joint.
    pub(in crate::effects) fn unnamed(
        &self,
        shape: impl Into<Shape>,
        range: [f64; 2],
        spread: Vec<f64>,
        detail: String,
    ) -> Hypothesis {
        let location = Location { level: Level::Joint, index: self.place.map(|place| place + 1) };
        Hypothesis { kind: None, location, shape: shape.into(), range, spread, detail, share: None }
    }
}

/// Of the columns of a twist, their standard deviations in units of its translation: one of so many metres comes with a rotation of up
/// to as many radians. Of a tool whose orientation is not measured only the translation can be seen.
pub(in crate::effects) fn twist_spread(rotation: bool) -> Vec<f64> {
    let third = 1.0 / libm::sqrt(3.0);
    let rotations = if rotation { vec![0.6 * third; 3] } else { Vec::new() };
    [vec![third; 3], rotations].concat()
}

/// Everything that may be there in an arm like `mechanism`, seen through `columns`.
#[must_use]
pub fn library(mechanism: &Mechanism, columns: &Columns) -> Vec<Hypothesis> {
    let mut all = Vec::new();
    for place in (0..mechanism.joint_count()).map(Some).chain([None]) {
        let site = Site { place, mechanism, columns };
        for known in Kind::ALL.into_iter().filter_map(|kind| kind.descriptor().known) {
            (known.hypotheses)(&site, &mut all);
        }
        unnamed::hypotheses(&site, &mut all);
    }
    all
}
