//! Positions in proportion to themselves.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Coefficients, Displacement, Follows, Form, Named, Reading, Recorded, Shape, Size, twist};
use crate::effects::{Kind, Parameters, Values};

/// \[1\] Positions in proportion to themselves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Scale {}

impl Follows for Scale {
    fn form(&self, _: bool) -> Form {
        Form { columns: 1, of_magnitude: 1, size: Size::Length, needs: Recorded::Pose, unnamed: None }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        vec![twist(reading.target, Vector3::zeros())]
    }
}

impl Named for Scale {
    fn undecided(&self, _: &Reading) -> bool {
        false
    }

    fn parameters(&self, _: Coefficients<'_>) -> Parameters {
        Parameters::default()
    }

    fn values(&self, _: Coefficients<'_>) -> Result<Vec<Values>, String> {
        Err("the sensor's: the arm has no part in it, its formula is exact".to_owned())
    }
}

pub(in crate::effects) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if site.place.is_none() {
        all.push(site.hypothesis(Kind::MeasurementScale, Shape::Scale(Scale {})));
    }
}
