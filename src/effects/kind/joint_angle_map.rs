//! A fixed error of a joint's angle that follows the angle in no simple way: straight lines between values at even angles. Of angles
//! that no reading comes near it says nothing.

use std::num::NonZeroUsize;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Coefficients, Displacement, Follows, Form, Named, Reading, Recorded, Size, from_one};
use crate::effects::{Kind, Parameters, Values};

/// Degrees between two values: for errors with up to a dozen periods per turn, and with several dozens.
const SPACINGS_DEG: [f64; 2] = [10.0, 3.0];
/// Fewer values are a polynomial.
const FEWEST: usize = 4;

/// \[`values`\] An error of a joint's angle, given at even angles and straight between them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AngleTable {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
    /// Angle of the first value, rad.
    pub first: f64,
    /// From angle to angle, rad.
    pub spacing: f64,
    /// How many.
    pub values: usize,
}

impl AngleTable {
    /// Angles of the values, rad.
    fn angles(&self) -> impl Iterator<Item = f64> {
        let AngleTable { first, spacing, .. } = *self;
        (0..self.values).map(move |number| first + number as f64 * spacing)
    }
}

impl Follows for AngleTable {
    fn form(&self, _: bool) -> Form {
        Form { columns: self.values, of_magnitude: self.values, size: Size::Rms, needs: Recorded::Pose, unnamed: None }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let mut columns = vec![[0.0; 6]; self.values];
        let place = (reading.joints[self.joint] - self.first) / self.spacing;
        let below = libm::floor(place);
        for (number, share) in [(below, 1.0 - (place - below)), (below + 1.0, place - below)] {
            if number >= 0.0 && (number as usize) < self.values && share > 0.0 {
                columns[number as usize] = reading.moved(self.joint, share);
            }
        }
        columns
    }

    fn of_angle(&self) -> Option<usize> {
        Some(self.joint)
    }
}

impl Named for AngleTable {
    fn undecided(&self, _: &Reading) -> bool {
        false
    }

    fn parameters(&self, of: Coefficients<'_>) -> Parameters {
        let errors = (0..self.values).map(|number| of.or_zero(number)).collect();
        Parameters { angles_rad: Some(self.angles().collect()), errors_rad: Some(errors), ..Parameters::default() }
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        let errors = (0..self.values).map(|number| of.at(number)).collect::<Result<_, _>>()?;
        Ok(vec![Values { angles: self.angles().collect(), errors, ..Values::default() }])
    }
}

pub(in crate::effects) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    let Some(joint) = site.place.filter(|_| site.turns()) else {
        return;
    };
    let [low, high] = site.columns.travel[joint];
    for spacing_deg in SPACINGS_DEG {
        let spacing = spacing_deg.to_radians();
        let [from, to] = [libm::floor(low / spacing), libm::ceil(high / spacing)];
        let values = (to - from) as usize + 1;
        // With more values than configurations each would have its own.
        if values < FEWEST || values > site.columns.configurations {
            continue;
        }
        let table = AngleTable { joint, first: from * spacing, spacing, values };
        let of = site.hypothesis(Kind::JointAngleMap, super::Shape::AngleTable(table));
        all.push(Hypothesis { spread: vec![1.0; values], detail: format!("a value every {spacing_deg}°"), ..of });
    }
}
