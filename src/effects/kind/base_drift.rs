//! A twist of the base in proportion to time.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site, twist_spread};
use crate::effects::signature::shape::{Coefficients, Displacement, Follows, Form, Named, Reading, Recorded, Shape, Size};
use crate::effects::{Kind, Parameters, Values};

/// \[6\] A twist of the base in proportion to time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BaseDrift {}

impl Follows for BaseDrift {
    fn form(&self, _: bool) -> Form {
        // The magnitude of a twist is the length of its translation.
        Form { columns: 6, of_magnitude: 3, size: Size::Length, needs: Recorded::Pose, unnamed: None }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        reading.base_twist(reading.share)
    }
}

impl Named for BaseDrift {
    fn undecided(&self, _: &Reading) -> bool {
        false
    }

    fn parameters(&self, of: Coefficients<'_>) -> Parameters {
        of.moved()
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        Ok(vec![of.twist()])
    }
}

pub(in crate::effects) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if site.place.is_none() && site.columns.time {
        let drift = site.hypothesis(Kind::BaseDrift, Shape::BaseDrift(BaseDrift {}));
        all.push(Hypothesis { spread: twist_spread(true), ..drift });
    }
}
