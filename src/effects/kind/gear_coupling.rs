//! A joint turns by a share of its own angle, or of that of a neighbour, whose drive shares its housing.

use std::num::NonZeroUsize;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{
    Coefficients, Displacement, Follows, Form, Named, Reading, Recorded, Shape, Size, from_one,
};
use crate::effects::{Kind, Parameters, Values};

/// \[1\] A joint turns by the angle of another, or of its own.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Ratio {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
    /// Joint whose angle counts.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub source: usize,
}

impl Follows for Ratio {
    fn form(&self, _: bool) -> Form {
        Form { columns: 1, of_magnitude: 1, size: Size::Length, needs: Recorded::Pose, unnamed: None }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        vec![reading.moved(self.joint, reading.joints[self.source])]
    }

    fn of_angle(&self) -> Option<usize> {
        Some(self.source).filter(|source| *source == self.joint)
    }
}

impl Named for Ratio {
    fn undecided(&self, _: &Reading) -> bool {
        false
    }

    fn parameters(&self, _: Coefficients<'_>) -> Parameters {
        Parameters { source: Some(self.source + 1), ..Parameters::default() }
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        let (source, size) = (self.source, of.at(0)?);
        let (ratio_error, coupling) = if source == self.joint { (size, 0.0) } else { (0.0, size) };
        Ok(vec![Values { ratio_error, coupling, source, ..Values::default() }])
    }
}

pub(in crate::effects) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    let Some(joint) = site.place else {
        return;
    };
    let next = Some(joint + 1).filter(|next| *next < site.joints());
    // Two joints behind one another drive a wrist: what turns the last goes through both.
    for source in [Some(joint), joint.checked_sub(1), next, joint.checked_sub(2)].into_iter().flatten() {
        let detail = if source == joint { "its own angle".to_owned() } else { format!("angle of joint {}", source + 1) };
        all.push(Hypothesis { detail, ..site.hypothesis(Kind::GearCoupling, Shape::Ratio(Ratio { joint, source })) });
    }
}
