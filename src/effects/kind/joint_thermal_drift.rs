//! A joint turns with the temperature of the link that it moves.

use std::num::NonZeroUsize;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{
    Coefficients, Displacement, Follows, Form, Named, Reading, Recorded, Shape, Size, from_one,
};
use crate::effects::{Kind, Parameters, Values};

/// \[1\] A joint turns with the temperature of its link.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Warmth {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
}

impl Follows for Warmth {
    fn form(&self, _: bool) -> Form {
        Form { columns: 1, of_magnitude: 1, size: Size::Length, needs: Recorded::Temperatures, unnamed: None }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        vec![reading.moved(self.joint, reading.rise_k[self.joint])]
    }
}

impl Named for Warmth {
    fn undecided(&self, _: &Reading) -> bool {
        false
    }

    fn parameters(&self, _: Coefficients<'_>) -> Parameters {
        Parameters::default()
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        Ok(vec![Values { drift: of.at(0)?, ..Values::default() }])
    }
}

pub(in crate::effects) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if let Some(joint) = site.place.filter(|_| site.columns.temperature) {
        all.push(site.hypothesis(Kind::JointThermalDrift, Shape::Warmth(Warmth { joint })));
    }
}
