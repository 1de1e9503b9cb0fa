//! A joint is off by half a unit in the direction of its last move; a positive coefficient leads, a negative one lags, as play does.

use std::num::NonZeroUsize;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{
    Coefficients, Displacement, Follows, Form, Named, Reading, Recorded, Shape, Size, from_one,
};
use crate::effects::{Kind, Parameters, Values};

/// \[1\] A joint is off by half a unit in the direction of its last move.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Direction {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
}

impl Follows for Direction {
    fn form(&self, _: bool) -> Form {
        Form { columns: 1, of_magnitude: 1, size: Size::Length, needs: Recorded::Approach, unnamed: None }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        vec![reading.moved(self.joint, 0.5 * reading.approach[self.joint])]
    }
}

impl Named for Direction {
    fn undecided(&self, reading: &Reading) -> bool {
        // Nobody knows from where the arm came.
        reading.approach.get(self.joint) == Some(&0.0)
    }

    fn parameters(&self, of: Coefficients<'_>) -> Parameters {
        Parameters { sign: Some(of.or_zero(0).signum()), ..Parameters::default() }
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        let size = of.at(0)?;
        if size > 0.0 {
            return Err("the output is ahead of the last move, which no play makes".to_owned());
        }
        Ok(vec![Values { width: -size, ..Values::default() }])
    }
}

pub(in crate::effects) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if let Some(joint) = site.place.filter(|_| site.columns.approach) {
        all.push(site.hypothesis(Kind::Backlash, Shape::Direction(Direction { joint })));
    }
}
