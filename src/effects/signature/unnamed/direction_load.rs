//! The direction of the last move, times the size of the torque.

use std::num::NonZeroUsize;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Family, Follows, Form, Reading, Recorded, Size, Unnamed, from_one};

use super::Nameless;

/// rad/(N·m)
const RANGE: [f64; 2] = [0.5e-5, 5e-5];

/// \[1\] The direction of the last move, times the size of the torque.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DirectionLoad {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
}

impl Follows for DirectionLoad {
    fn form(&self, _: bool) -> Form {
        Form {
            columns: 1,
            of_magnitude: 1,
            size: Size::Length,
            needs: Recorded::Approach,
            unnamed: Some(Unnamed { family: Family::DirectionLoad, contains: None, near: None }),
        }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let joint = self.joint;
        vec![reading.moved(joint, 0.5 * reading.approach[joint] * reading.effort(joint).abs())]
    }
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    if site.columns.approach {
        let detail = format!("direction of joint {}'s last move, growing with its torque", joint + 1);
        all.push(site.unnamed(Nameless::DirectionLoad(DirectionLoad { joint }), RANGE, vec![1.0], detail));
    }
}
