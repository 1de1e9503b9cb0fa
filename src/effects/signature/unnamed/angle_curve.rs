//! A joint turns with its angle, the square and the cube of it.

use std::num::NonZeroUsize;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::Kind;
use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Family, Follows, Form, Reading, Recorded, Size, Unnamed, from_one};

use super::Nameless;

/// \[3\] A joint turns with its angle, the square and the cube of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AngleCurve {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
}

impl Follows for AngleCurve {
    fn form(&self, _: bool) -> Form {
        Form {
            columns: 3,
            of_magnitude: 3,
            size: Size::Length,
            needs: Recorded::Pose,
            unnamed: Some(Unnamed { family: Family::AngleCurve, contains: None, near: None }),
        }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let joint = self.joint;
        let angle = reading.joints[joint];
        [angle, angle * angle, angle * angle * angle / 3.0].map(|amount| reading.moved(joint, amount)).to_vec()
    }

    fn of_angle(&self) -> Option<usize> {
        Some(self.joint)
    }
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    if site.turns() {
        let range = site.range(Kind::GearCoupling);
        let detail = format!("error of joint {} grows with its angle", joint + 1);
        all.push(site.unnamed(Nameless::AngleCurve(AngleCurve { joint }), range, vec![1.0, 0.5, 0.5], detail));
    }
}
