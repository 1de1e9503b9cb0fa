//! A shift: the force across a joint seats it, along the x and y axes of its link unequally.

use std::num::NonZeroUsize;

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::Kind;
use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{
    Displacement, Family, Follows, Form, Reading, Recorded, Size, Unnamed, from_one, seated, twist,
};

use super::Nameless;

/// \[2\] A shift: the force across a joint seats it, along the x and y axes of its link unequally.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct UnequalShift {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
}

impl Follows for UnequalShift {
    fn form(&self, _: bool) -> Form {
        Form {
            columns: 2,
            of_magnitude: 2,
            size: Size::Length,
            needs: Recorded::Pose,
            unnamed: Some(Unnamed { family: Family::UnequalShift, contains: Some(Kind::RadialClearance), near: None }),
        }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let joint = self.joint;
        let posture = &reading.posture;
        let seat = seated(posture.force_across(joint), posture.force_sigma(joint), 0.0);
        posture.across_link(joint).map(|axis| twist(axis * axis.dot(&seat), Vector3::zeros())).to_vec()
    }
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    let detail = format!("force across the axis of joint {} shifts it, more one way than another", joint + 1);
    all.push(site.unnamed(
        Nameless::UnequalShift(UnequalShift { joint }),
        site.range(Kind::RadialClearance),
        vec![1.0; 2],
        detail,
    ));
}
