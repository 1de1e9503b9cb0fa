//! A joint lags behind its last move by an angle that grows with its torque: friction of teeth that are pressed together winds it up.

use std::num::NonZeroUsize;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{
    Coefficients, Displacement, Follows, Form, Named, Reading, Recorded, Shape, Size, from_one,
};
use crate::effects::{Kind, Parameters, Values};

/// \[1\] The direction of the last move, times the size of the torque: half of the magnitude to either side, behind.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DirectionLoad {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
}

impl Follows for DirectionLoad {
    fn form(&self, _: bool) -> Form {
        Form { columns: 1, of_magnitude: 1, size: Size::Length, needs: Recorded::Approach, unnamed: None }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let joint = self.joint;
        vec![reading.moved(joint, -0.5 * reading.approach[joint] * reading.effort(joint).abs())]
    }
}

impl Named for DirectionLoad {
    fn undecided(&self, reading: &Reading) -> bool {
        // Nobody knows from where the arm came.
        reading.approach.get(self.joint) == Some(&0.0)
    }

    fn parameters(&self, of: Coefficients<'_>) -> Parameters {
        Parameters { sign: Some(if of.or_zero(0) > 0.0 { -1.0 } else { 1.0 }), ..Parameters::default() }
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        let gain = of.at(0)?;
        if gain < 0.0 {
            return Err("the joint leads its last move, which no friction does".to_owned());
        }
        Ok(vec![Values { gain, ..Values::default() }])
    }
}

pub(in crate::effects) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    let Some(joint) = site.place.filter(|_| site.columns.approach) else {
        return;
    };
    all.push(site.hypothesis(Kind::DirectionOfMove, Shape::DirectionLoad(DirectionLoad { joint })));
}
