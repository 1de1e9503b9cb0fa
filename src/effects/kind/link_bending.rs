//! A link bends under the moment across: where it is bolted to its joint (a hinge at the joint), or all along, as a slender beam.

use std::num::NonZeroUsize;

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{
    Coefficients, Displacement, Follows, Form, Named, Reading, Recorded, Shape, Size, from_one, twist,
};
use crate::effects::{Kind, Parameters, Values};

/// Of the prior, the share of a link that is a slender beam; others yield where they are bolted to their joint.
const BEAM: f64 = 0.2;

/// \[1\] A turn about a joint's origin in proportion to the moment across its axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MomentAcross {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
}

impl Follows for MomentAcross {
    fn form(&self, _: bool) -> Form {
        Form { columns: 1, of_magnitude: 1, size: Size::Length, needs: Recorded::Pose, unnamed: None }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        vec![reading.turned(self.joint, reading.posture.moment_across(self.joint))]
    }
}

impl Named for MomentAcross {
    fn undecided(&self, _: &Reading) -> bool {
        false
    }

    fn parameters(&self, _: Coefficients<'_>) -> Parameters {
        Parameters::default()
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        Ok(vec![Values { compliance: of.at(0)?, beam: false, ..Values::default() }])
    }
}

/// \[1\] A link bends as a beam from its joint to the next under the moment across its own direction, which may change along
/// it: a turn in proportion to the mean moment, about where a beam turns.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Beam {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
}

impl Follows for Beam {
    fn form(&self, _: bool) -> Form {
        Form { columns: 1, of_magnitude: 1, size: Size::Length, needs: Recorded::Pose, unnamed: None }
    }

    fn columns(&self, reading: &Reading, orientation: bool) -> Vec<Displacement> {
        let joint = self.joint;
        let posture = &reading.posture;
        let next = if joint + 1 < reading.joints.len() { posture.origins[joint + 1] } else { posture.tool };
        let along = next - posture.origins[joint];
        let square = along.norm_squared();
        // Too short to have a direction: a hinge.
        if square < 1e-6 {
            return MomentAcross { joint }.columns(reading, orientation);
        }
        let across = |moment: Vector3<f64>| moment - along * (along.dot(&moment) / square);
        // Its own weight is a small part of what it carries: the moment at its end is that at its root without the lever.
        let near = across(posture.moments[joint]);
        let far = across(posture.moments[joint] - along.cross(&posture.forces[joint]));
        let turn = (near + far) / 2.0;
        let bow = (near / 3.0 + far / 6.0).cross(&along);
        vec![twist(bow + turn.cross(&(reading.target - next)), turn)]
    }
}

impl Named for Beam {
    fn undecided(&self, _: &Reading) -> bool {
        false
    }

    fn parameters(&self, _: Coefficients<'_>) -> Parameters {
        Parameters::default()
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        Ok(vec![Values { compliance: of.at(0)?, beam: true, ..Values::default() }])
    }
}

pub(in crate::effects) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if let Some(joint) = site.place {
        let hinge = site.hypothesis(Kind::LinkBending, Shape::MomentAcross(MomentAcross { joint }));
        all.push(Hypothesis { share: Some(1.0 - BEAM), ..hinge.clone() });
        all.push(Hypothesis { shape: Shape::Beam(Beam { joint }), share: Some(BEAM), detail: "as a beam".to_owned(), ..hinge });
    }
}
