//! A turn about a joint's origin: the moment across seats it, about the x and y axes of its link unequally.

use std::num::NonZeroUsize;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::Kind;
use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Family, Follows, Form, Reading, Recorded, Size, Unnamed, from_one, seated};

use super::Nameless;

/// \[2\] A turn about a joint's origin: the moment across seats it, about the x and y axes of its link unequally.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct UnequalSeat {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
}

impl Follows for UnequalSeat {
    fn form(&self, _: bool) -> Form {
        Form {
            columns: 2,
            of_magnitude: 2,
            size: Size::Length,
            needs: Recorded::Pose,
            unnamed: Some(Unnamed { family: Family::UnequalSeat, contains: Some(Kind::TiltClearance), near: None }),
        }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let joint = self.joint;
        let posture = &reading.posture;
        let seat = seated(posture.moment_across(joint), posture.moment_sigma(joint), 0.0);
        posture.across_link(joint).map(|axis| reading.turned(joint, axis * axis.dot(&seat))).to_vec()
    }
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    let detail = format!(
        "moment across the axis of joint {} turns its link, whatever its size, about one axis more than about another",
        joint + 1
    );
    all.push(site.unnamed(Nameless::UnequalSeat(UnequalSeat { joint }), site.range(Kind::TiltClearance), vec![1.0; 2], detail));
}
