//! A joint turns in proportion to the torque about it.

use std::num::NonZeroUsize;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{
    Coefficients, Displacement, Follows, Form, Named, Reading, Recorded, Shape, Size, from_one,
};
use crate::effects::{Kind, Parameters, Values};

/// \[1\] A joint turns in proportion to the torque about it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Torque {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
}

impl Follows for Torque {
    fn form(&self, _: bool) -> Form {
        Form { columns: 1, of_magnitude: 1, size: Size::Length, needs: Recorded::Pose, unnamed: None }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        vec![reading.moved(self.joint, reading.effort(self.joint))]
    }
}

impl Named for Torque {
    fn undecided(&self, _: &Reading) -> bool {
        false
    }

    fn parameters(&self, _: Coefficients<'_>) -> Parameters {
        Parameters::default()
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        Ok(vec![Values { stiffness: 1.0 / of.at(0)?, ..Values::default() }])
    }
}

/// \[3 for each link that the joint carries\] A joint turns under gravity's moment about its axis where nobody knows what the links weigh: of
/// each link, mass times the distance of its centre along each axis of its frame, times the compliance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FreeLoad {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
    /// Links from this one on.
    pub links: usize,
}

impl Follows for FreeLoad {
    fn form(&self, _: bool) -> Form {
        let columns = 3 * self.links;
        Form { columns, of_magnitude: columns, size: Size::Rms, needs: Recorded::Pose, unnamed: None }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let axis = reading.posture.axes[self.joint];
        let links = &reading.posture.frames[self.joint..self.joint + self.links];
        let along = links.iter().flat_map(|frame| [0, 1, 2].map(|of| frame.column(of).into_owned()));
        // What a kilogram a metre out does. Distances between joints are those of links further in.
        along.map(|arm| reading.moved(self.joint, axis.dot(&arm.cross(&reading.gravity)))).collect()
    }
}

impl Named for FreeLoad {
    fn undecided(&self, _: &Reading) -> bool {
        false
    }

    fn parameters(&self, _: Coefficients<'_>) -> Parameters {
        Parameters::default()
    }

    fn values(&self, _: Coefficients<'_>) -> Result<Vec<Values>, String> {
        Err("the robot's file has no masses, so that nobody knows the torque".to_owned())
    }
}

pub(in crate::effects) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    let Some(joint) = site.place else {
        return;
    };
    if site.mechanism.masses_known || !site.turns() {
        all.push(site.hypothesis(Kind::JointCompliance, Shape::Torque(Torque { joint })));
        return;
    }
    let links = site.joints() - joint;
    let of = site.hypothesis(Kind::JointCompliance, Shape::FreeLoad(FreeLoad { joint, links }));
    let detail = "the robot's file has no masses: how much in rad per N·m is not known".to_owned();
    // A link's mass times the distance of its centre is of the order of one kilogram metre.
    all.push(Hypothesis { range: site.range(Kind::JointCompliance), spread: vec![1.0; 3 * links], detail, ..of });
}
