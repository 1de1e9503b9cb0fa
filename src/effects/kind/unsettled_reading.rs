//! All joints lag behind their last move by one share of it: they were read before the arm had settled.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Coefficients, Displacement, Follows, Form, Named, Reading, Recorded, Shape, Size};
use crate::effects::{Kind, Parameters, Values};

/// \[1\] All joints are behind by a share of the way from the reading before.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Unsettled {}

impl Follows for Unsettled {
    fn form(&self, _: bool) -> Form {
        Form { columns: 1, of_magnitude: 1, size: Size::Length, needs: Recorded::Moves, unnamed: None }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let mut all = [0.0; 6];
        for (joint, behind) in reading.behind.iter().enumerate() {
            let moved = reading.moved(joint, -behind[0]);
            all.iter_mut().zip(moved).for_each(|(sum, moved)| *sum += moved);
        }
        vec![all]
    }
}

impl Named for Unsettled {
    fn undecided(&self, reading: &Reading) -> bool {
        reading.since_begin_s == 0.0
    }

    fn parameters(&self, _: Coefficients<'_>) -> Parameters {
        Parameters::default()
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        Ok(vec![Values { lag: of.at(0)?, ..Values::default() }])
    }
}

pub(in crate::effects) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if site.place.is_none() && site.columns.moves {
        all.push(site.hypothesis(Kind::UnsettledReading, Shape::Unsettled(Unsettled {})));
    }
}
